"""Steady rolling: the case's rows, conditions checked by plain sums, simple limits, refusals."""

import numpy as np
import pytest

from models.contact import rolling_problem
from models.contact.half_space import influence_of_rectangle
from models.contact.linear_theory import kalker_coefficients
from models.contact.material import STEEL, Material, MaterialPair
from models.contact.normal_problem import PressureGrid, cell_centres, hertzian_pressure_grid, solve_normal
from models.contact.rolling_operator import SlipOperator
from models.contact.rolling_problem import STICK_SLIP_TOLERANCE, rigid_slip, solve_rolling, solve_shift
from models.core.errors import InputError, RunFailed
from validation.cases.contact_exact import CREEPAGE_CASES, carter_traction, measure, rolling_forces

PAIR, LOAD, A, B, MU = MaterialPair(), 8e4, 6e-3, 4e-3, 0.3
PRESSED = hertzian_pressure_grid(A, B, LOAD, 16)
SCALE = MU * LOAD / (PAIR.G * A * B)


def test_every_row_of_the_case_passes(tmp_path):
    rows, _ = measure(True, tmp_path)
    assert [row.id for row in rows if row.status == "failed"] == []


def test_every_condition_holds_by_a_plain_sum():
    """Slip again from the tractions, by differences of displacement summed cell by cell; then Coulomb in each cell."""
    motion = (0.1 * SCALE, -0.1 * SCALE, 0.2 * SCALE / A)
    found = solve_rolling(PRESSED, MU, *motion, PAIR)
    y, x = np.meshgrid(PRESSED.y, PRESSED.x, indexing="ij")
    away = (x[..., None, None] - x, y[..., None, None] - y)
    u = [
        np.einsum(
            "abcdij,cdj->abi",
            influence_of_rectangle(away[0] + i * PRESSED.dx, away[1], PRESSED.dx, PRESSED.dy, PAIR)[..., :2, :2],
            found.traction,
        )
        for i in range(3)
    ]
    slip = rigid_slip(PRESSED.x, PRESSED.y, *motion) + (3 * u[0] - 4 * u[1] + u[2]) / (2 * PRESSED.dx)
    size, bound = np.linalg.norm(found.traction, axis=-1), MU * PRESSED.pressure
    allowed = 10 * STICK_SLIP_TOLERANCE
    assert (size <= bound * (1 + 1e-12)).all()
    assert np.linalg.norm(slip[found.stick], axis=-1).max() < allowed * SCALE
    slips = PRESSED.contact & ~found.stick
    assert 0.2 < slips.sum() / PRESSED.contact.sum() < 0.8  # both kinds of cells are tried
    against = -bound[slips][:, None] * slip[slips] / np.linalg.norm(slip[slips], axis=-1)[:, None]
    assert np.abs(found.traction[slips] - against).max() < allowed * bound.max()
    assert np.abs(found.slip[slips] - slip[slips]).max() < allowed * SCALE
    assert found.residual <= STICK_SLIP_TOLERANCE


@pytest.mark.parametrize("name", CREEPAGE_CASES)
def test_laws_of_every_mixture(name):
    """On few cells: at most mu N, power taken from the motion, the opposite of it reversed."""
    force = rolling_forces(name, 12)
    assert np.hypot(force[0], force[1]) <= 1 + 1e-12
    assert force @ CREEPAGE_CASES[name][1:] < 0
    assert rolling_forces(name, 12, -1.0) == pytest.approx(-force, abs=1e-7)


def test_slow_creepage_is_the_linear_theory():
    """At 1e-4 of the scale of sliding, on the area of the cells; 16 of them leave 3 %."""
    little = 1e-4 * SCALE
    found = solve_rolling(PRESSED, MU, little, 0.0, 0.0, PAIR)
    slope = float(kalker_coefficients(A / B, PAIR.nu).c11)
    assert found.fx == pytest.approx(-PAIR.G * PRESSED.area / np.pi * slope * little, rel=0.03)
    assert 0.0 <= found.power <= 0.1 * little * abs(found.fx)  # next to nothing slips


def test_an_unfinished_solution_is_none(monkeypatch):
    monkeypatch.setattr(rolling_problem, "ROUND_LIMIT", 1)
    with pytest.raises(RunFailed):
        solve_rolling(PRESSED, MU, 0.2 * SCALE, 0.0, 0.0, PAIR)


def test_nothing_from_nothing():
    still = solve_rolling(PRESSED, MU, 0.0, 0.0, 0.0, PAIR)
    assert (still.fx, still.fy, still.mz, still.power) == (0.0, 0.0, 0.0, 0.0)
    assert still.stick[PRESSED.contact].all()
    smooth = solve_rolling(PRESSED, 0.0, 0.01, 0.0, 0.0, PAIR)
    assert smooth.fx == 0.0
    apart = PressureGrid(np.zeros((5, 5)), cell_centres(5, 1e-3), cell_centres(5, 1e-3))
    assert solve_rolling(apart, MU, 0.01, 0.0, 0.0, PAIR).fx == 0.0


@pytest.mark.parametrize("part", [1e-9, 1e-15, 1e-70])
def test_next_to_no_friction_turns_with_the_slip(part):
    """A slip of 1e9 times what the tractions make: its rounding must not be taken for a task of Newton's step."""
    motion = (1e-4, 1e-3, 100.0)
    found, other = (solve_rolling(PRESSED, MU * share, *motion, PAIR) for share in (part, 1e-8))
    whole = other.fy * part / 1e-8 if part > 1e-60 else 0.0
    assert found.fy == pytest.approx(whole, rel=1e-6, abs=1e-60)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda: solve_rolling(PRESSED, MU, [1e-3, 2e-3], 0.0, 0.0, PAIR), r"xi_x = .*one number, not an array"),
        (lambda: solve_rolling(PRESSED, MU, 0.0, 0.0, 1e12, PAIR), r"spin = 1000000000000.0: must be a spin in 1/m"),
        (
            lambda: PressureGrid(np.zeros((5, 4)), cell_centres(5, 1e-3), cell_centres(4, 1e-3)),
            r"pressure = \[5, 4\]: .*\(4, 5\)",
        ),
        (lambda: PressureGrid(np.zeros((4, 5)), cell_centres(5, 1e-3)[::-1], cell_centres(4, 1e-3)), r"x: must ascend"),
        (
            lambda: PressureGrid(np.full((4, 5), -1.0), cell_centres(5, 1e-3), cell_centres(4, 1e-3)),
            r"pressure\[0, 0\] = -1.0",
        ),
    ],
)
def test_wrong_input_is_named(wrong, words):
    with pytest.raises(InputError, match=words):
        wrong()


def test_size_and_stiffness_do_not_matter():
    """Forces by mu N depend on creepage by mu N / (G ab) alone."""
    found = solve_rolling(PRESSED, MU, 0.2 * SCALE, 0.0, 0.1 * SCALE / A, PAIR)
    soft = Material(E=7e10, nu=STEEL.nu)
    pair, load, mu, size = MaterialPair(soft, soft), 10.0, 0.05, 1e-2
    scale = mu * load / (pair.G * A * B * size**2)
    other = solve_rolling(
        hertzian_pressure_grid(size * A, size * B, load, 16), mu, 0.2 * scale, 0.0, 0.1 * scale / (size * A), pair
    )
    assert other.fx / (mu * load) == pytest.approx(found.fx / (MU * LOAD), rel=1e-6)
    assert other.mz / (mu * load * size) == pytest.approx(found.mz / (MU * LOAD), rel=1e-6)


def test_empty_cells_around_do_not_matter():
    """The same pressure in a larger grid, off its middle; moments are taken about the origin of x and y."""
    x, y = PRESSED.x[0] + PRESSED.dx * np.arange(-3, 20), PRESSED.y[0] + PRESSED.dy * np.arange(-1, 18)
    wide = PressureGrid(np.pad(PRESSED.pressure, ((1, 2), (3, 4))), x, y)
    motion = (0.1 * SCALE, 0.0, 0.2 * SCALE / A)
    one, other = (solve_rolling(grid, MU, *motion, PAIR) for grid in (PRESSED, wide))
    assert (other.fx, other.fy, other.mz) == pytest.approx((one.fx, one.fy, one.mz), rel=1e-12)


def test_pressure_of_our_own_gives_the_same_forces():
    """Rolling on the pressure of the normal problem instead of Hertz'."""
    step = 0.5e-3
    x = cell_centres(33, step)
    pressed = solve_normal((x**2 + x[:, None] ** 2) / 1.0, step, step, PAIR, load=LOAD)
    radius = (0.75 * LOAD * 0.5 / PAIR.modulus) ** (1 / 3)
    motion = (0.2 * MU * LOAD / (PAIR.G * radius**2), 0.0, 0.0)
    truth = solve_rolling(hertzian_pressure_grid(radius, radius, LOAD, 24), MU, *motion, PAIR)
    found = solve_rolling(pressed, MU, *motion, PAIR)
    assert found.fx == pytest.approx(truth.fx, abs=0.015 * MU * LOAD)  # 24 cells across, error up to 0.7 % each


def test_the_slip_of_tractions_takes_power():
    """C is positive definite, on cells of any shape: the ground of uniqueness."""
    rng = np.random.default_rng(2)
    for dy in (0.1e-3, 1e-3, 10e-3):
        operator = SlipOperator(9, 7, 1e-3, dy, PAIR)
        tractions = rng.normal(size=(50, 7, 9, 2))
        assert min(float(np.sum(p * operator(p)) / np.sum(p * p)) for p in tractions) > 0.0
        matrix = np.array([operator(unit.reshape(7, 9, 2)).ravel() for unit in np.eye(126)])
        assert np.linalg.eigvalsh(matrix + matrix.T).min() > 0.0


def test_a_shift_keeps_its_distance():
    """A shift so long that all slips ends at mu N; the rest of the way is slip."""
    far = solve_shift(PRESSED, MU, 1e-3, 0.0, PAIR)
    assert far.fx == pytest.approx(-MU * LOAD, rel=1e-4)
    assert far.power == pytest.approx(MU * LOAD * 1e-3, rel=0.05)  # less what the bodies take up elastically


def test_carter_s_own_limits():
    x = np.linspace(-1, 1, 4001)
    assert np.trapezoid(carter_traction(x, 1.0, 0.3), x) == pytest.approx(np.pi / 2 * (1 - 0.7**2), rel=1e-3)
    assert carter_traction(x, 1.0, 1 - 1e-9) == pytest.approx(np.sqrt(1 - x * x), abs=1e-8)


@pytest.mark.parametrize(
    ("arguments", "place"),
    [
        ((-0.1, 0.0, 0.0, 0.0, PAIR), "mu"),
        ((0.3, np.nan, 0.0, 0.0, PAIR), "xi_x"),
        ((0.3, 0.0, np.inf, 0.0, PAIR), "xi_y"),
        ((0.3, 0.0, 0.0, np.nan, PAIR), "spin"),
        ((0.3, 0.0, 0.0, 0.0, MaterialPair(STEEL, Material(E=3e9, nu=0.4))), "bodies"),
    ],
)
def test_bad_input_is_refused(arguments, place):
    with pytest.raises(InputError) as error:
        solve_rolling(PRESSED, *arguments)
    assert error.value.place == place
