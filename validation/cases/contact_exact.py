"""The exact theory of contact, discretised in cells, compared with closed forms, with finer grids, and with a sample of
another program's results."""

import csv
from pathlib import Path
from typing import Any

import numpy as np

from models.contact.hertz import by_axes
from models.contact.inputs import Array
from models.contact.material import Material, MaterialPair
from models.contact.normal_problem import NormalSolution, cell_centres, hertzian_pressure_grid, solve_normal
from models.contact.rolling_problem import RollingSolution, solve_rolling, solve_shift
from models.core.errors import RunFailed
from models.systems.contact.work_precision import ContactCase
from validation.common.rows import Observed, Row, System, Table, not_run
from validation.common.scenes import data_folder

TITLE = "The exact theory of contact on cells"
SYSTEM: System = "contact"
MATERIAL_PAIR, FRICTION_COEFFICIENT, NORMAL_LOAD, CONTACT_SIZE = MaterialPair(), 0.3, 8e4, 5e-3
"""Materials, coefficient of friction mu, normal load N (N), and sqrt(a b) (m) of the contact ellipse with the semi-axes
a and b."""
FRICTION_LIMIT = FRICTION_COEFFICIENT * NORMAL_LOAD
SAMPLE_FILE = "contact_sample.csv"
STRIP_AXIS_RATIO = 0.02
"""Axis ratio a/b of a slender ellipse, whose middle is nearly a cylinder contact."""
CREEPAGE_CASES: dict[str, tuple[float, float, float, float]] = {
    "little x": (1.0, 0.04, 0.0, 0.0),
    "x": (1.0, 0.2, 0.0, 0.0),
    "y, wide": (0.3, 0.0, 0.25, 0.0),
    "spin": (1.0, 0.0, 0.0, 0.3),
    "much spin": (1.0, 0.0, 0.0, 3.0),
    "y and spin": (2.0, 0.0, 0.15, 0.3),
    "x, y against spin": (2.0, 0.12, -0.13, 0.25),
    "spin, long": (5.0, 0.0, 0.0, 0.15),
}
"""Axis ratio a/b, longitudinal and lateral creepage divided by mu N / (G ab), and spin divided by mu N / (G
(ab)^(3/2)); N is the normal load, G the shear modulus."""
RANDOM_CONTACT_COUNT, SEED = 12, 47
"""Number of random contacts that test the solver's convergence, and their seed. Ellipses, creepages with spin, and
numbers of cells are random."""
DISCRETISATION_ERROR = 0.0075
"""Stated bound of the force error with 40 cells along each axis, divided by mu N; it halves with 80 cells."""


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows for the normal and the rolling problem compared with closed forms, finer grids, symmetries, and the sample
    if it exists. A quick run has two cases up to 32 cells instead of all up to 80, and every fourth contact of the
    sample with half the cells."""
    grids, names = ((8, 16, 32), ("x", "spin")) if quick else ((10, 20, 40, 80), tuple(CREEPAGE_CASES))
    refined = {name: [[cells, *rolling_forces(name, cells).tolist()] for cells in grids] for name in names}
    rows = [
        *_hertz_rows(),
        *_carter_rows(20 if quick else 80),
        *_cattaneo_rows(),
        *_sliding_rows(),
        *_creepage_symmetry_rows(),
        *_grid_refinement_rows(refined),
    ]
    sample, sample_rows = _sample_file_rows(quick)
    rows += [] if quick else [_convergence_row()]
    return rows + sample_rows, {"refined": refined, "sample": sample, "strip": _strip_traction(40, 0.5)[:2]}


def _bound_row(
    row_name: str,
    quantity_name: str,
    largest_error: float,
    upper_bound: float,
    tolerance_reason: str,
    unit: str = "",
    independence: Any = "closed form",
) -> Row:
    """Row: an error that must not exceed a bound."""
    return Observed(f"contact_exact.{row_name}", SYSTEM, quantity_name, largest_error, unit).at_most(
        upper_bound, tolerance_reason, independence
    )


def numerical_hertz_contact(axis_ratio: float, cell_count: int) -> tuple[NormalSolution, Array]:
    """Numerical solution of the normal problem for a Hertzian ellipse with the axis ratio a/b, and its relative errors
    (3,) of approach, peak pressure and area."""
    a, b = CONTACT_SIZE * axis_ratio**0.5, CONTACT_SIZE / axis_ratio**0.5
    truth = by_axes(a, b, MATERIAL_PAIR, load=NORMAL_LOAD)
    dx, dy = 2 * a / cell_count, 2 * b / cell_count
    x, y = cell_centres(cell_count + 5, dx), cell_centres(cell_count + 5, dy)
    solved = solve_normal(
        float(truth.A) * x**2 + float(truth.B) * y[:, None] ** 2, dx, dy, MATERIAL_PAIR, load=NORMAL_LOAD
    )
    values = np.array([solved.approach, solved.pressure.max(), solved.area])
    return solved, values / [float(truth.approach), float(truth.p0), np.pi * a * b] - 1.0


def _hertz_rows() -> list[Row]:
    """Rows: errors of approach, peak pressure and area on grids with an odd number of cells, so that one cell lies in
    the centre."""
    rows = []
    for ratio in (1.0, 3.0):
        (coarse, wide), (fine, narrow) = (numerical_hertz_contact(ratio, cells) for cells in (21, 63))
        order = np.log(np.abs(wide / narrow)) / np.log(3.0)
        name, where = f"hertz.{ratio:g}", f"Hertz, a/b {ratio:g}, 63 cells"
        rows += [
            _bound_row(f"{name}.approach", f"{where}: approach", abs(narrow[0]), 2e-4, "of order 2"),
            _bound_row(f"{name}.pressure", f"{where}: greatest pressure", abs(narrow[1]), 4e-4, "of order 2"),
            _bound_row(f"{name}.area", f"{where}: area", abs(narrow[2]), 0.02, "to a part of the cells along its edge"),
            Observed(
                f"contact_exact.{name}.order",
                SYSTEM,
                "observed order of the greatest pressure, 21 to 63 cells",
                float(order[1]),
                "",
            ).within(2.0, 0.4, "collocation at the middle of cells", "closed form"),
            _bound_row(
                f"{name}.residual",
                f"{where}: unmet contact conditions, over the displacement",
                max(coarse.residual, fine.residual),
                1e-9,
                "the proof of the solution",
            ),
        ]
    return rows


def carter_traction(x: Array, half_length: float, creepage_share: float) -> Array:
    """Carter's traction (divided by mu p0) on a strip -a < x < a, with the half-length a, that rolls in the direction
    +x. creepage_share: creepage divided by the creepage of full sliding.

    Carter (1926) as in Johnson, Contact Mechanics, 1985, section 8.3: two semi-ellipses, of which the second fills the
    zone that sticks, a (1 - creepage_share) wide each way, at the leading edge.
    """
    full_traction = np.sqrt(np.maximum(1 - (x / half_length) ** 2, 0.0))
    half = half_length * (1 - creepage_share)
    return full_traction - half / half_length * np.sqrt(np.maximum(1 - ((x - (half_length - half)) / half) ** 2, 0.0))


def _strip_traction(cell_count: int, creepage_share: float) -> tuple[list[float], list[float], float]:
    """Middle line of a slender ellipse: x / a, traction divided by mu p0, and error of the integrated traction divided
    by that of full sliding. creepage_share: creepage divided by the creepage of full sliding."""
    b = CONTACT_SIZE / STRIP_AXIS_RATIO**0.5
    a = STRIP_AXIS_RATIO * b
    pressed = hertzian_pressure_grid(a, b, NORMAL_LOAD, cell_count + 1)  # odd: one strip of cells lies in the middle
    bound = FRICTION_COEFFICIENT * 1.5 * NORMAL_LOAD / (np.pi * a * b)
    solved = solve_rolling(
        pressed, FRICTION_COEFFICIENT, 2 * creepage_share * bound / MATERIAL_PAIR.modulus, 0.0, 0.0, MATERIAL_PAIR
    )
    traction = -solved.traction[cell_count // 2, :, 0] / bound
    error = float(traction.sum() * pressed.dx / (np.pi * a / 2) - (1 - (1 - creepage_share) ** 2))
    return (pressed.x / a).tolist(), traction.tolist(), error


def _carter_rows(cell_count: int) -> list[Row]:
    """Rows: error of the force on a rolling strip, compared with Carter's closed form."""
    why = "first order in the cells: the leading edge of the zone that sticks; and the ellipse is no cylinder by 1e-3"
    return [
        _bound_row(
            f"carter.{share:g}",
            f"error of the force on Carter's cylinder over mu N, {share:g} of the creepage of sliding, {cell_count} "
            "cells",
            abs(_strip_traction(cell_count, share)[2]),
            0.2 / cell_count,
            why,
        )
        for share in (0.2, 0.5, 0.8)
    ]


def shifted_ball(force_share: float, poisson_ratio: float, cell_count: int) -> RollingSolution:
    """Exact solution for a ball that is shifted by the distance at which Cattaneo and Mindlin's tangential force is
    ``force_share`` times mu N."""
    body = Material(E=2.1e11, nu=poisson_ratio)
    pair = MaterialPair(body, body)
    shift_distance = (
        3 * FRICTION_LIMIT * (2 - poisson_ratio) / (8 * CONTACT_SIZE * pair.G) * (1 - (1 - force_share) ** (2 / 3))
    )
    return solve_shift(
        hertzian_pressure_grid(CONTACT_SIZE, CONTACT_SIZE, NORMAL_LOAD, cell_count),
        FRICTION_COEFFICIENT,
        shift_distance,
        0.0,
        pair,
    )


def _cattaneo_rows() -> list[Row]:
    """Rows: error of the force on a shifted ball, compared with Cattaneo and Mindlin's closed form."""
    why = "exact for nu = 0 (Johnson, Contact Mechanics, 1985, section 7.2); the cells err by 4e-4"
    return [
        _bound_row(
            f"cattaneo.{share:g}",
            f"error of the force on Cattaneo and Mindlin's shifted ball over mu N, {share:g} of sliding",
            abs(shifted_ball(share, 0.0, 40).fx / FRICTION_LIMIT + share),
            1e-3,
            why,
        )
        for share in (0.3, 0.8)
    ]


def rolling_forces(case_name: str, cell_count: int, creepage_sign: float = 1.0, mirror_sign: float = 1.0) -> Array:
    """Forces (3,) of one of CREEPAGE_CASES: fx and fy divided by mu N, mz divided by mu N sqrt(ab). ``creepage_sign``
    reverses the creepages, ``mirror_sign`` mirrors the lateral creepage and the spin."""
    ratio, xi_x, xi_y, spin = CREEPAGE_CASES[case_name]
    creepage = FRICTION_LIMIT / (MATERIAL_PAIR.G * CONTACT_SIZE**2) * creepage_sign
    pressed = hertzian_pressure_grid(CONTACT_SIZE * ratio**0.5, CONTACT_SIZE / ratio**0.5, NORMAL_LOAD, cell_count)
    across = mirror_sign * creepage
    solved = solve_rolling(
        pressed, FRICTION_COEFFICIENT, creepage * xi_x, across * xi_y, across * spin / CONTACT_SIZE, MATERIAL_PAIR
    )
    return np.array([solved.fx, solved.fy, solved.mz / CONTACT_SIZE]) / FRICTION_LIMIT


def _sliding_rows() -> list[Row]:
    """Rows on creepages so large that the whole contact area slides."""
    pressed = hertzian_pressure_grid(CONTACT_SIZE, CONTACT_SIZE, NORMAL_LOAD, 20)
    rows = []
    for angle in (0.0, 0.7, 2.0):
        solved = solve_rolling(pressed, FRICTION_COEFFICIENT, np.cos(angle), np.sin(angle), 0.0, MATERIAL_PAIR)
        gap = (
            np.hypot(solved.fx + FRICTION_LIMIT * np.cos(angle), solved.fy + FRICTION_LIMIT * np.sin(angle))
            / FRICTION_LIMIT
        )
        rows.append(
            _bound_row(
                f"sliding.{angle:g}",
                "difference of the force from mu N against the creepage, over mu N, sliding "
                f"at creepage 1, {angle:g} rad from x",
                float(gap),
                2.6e-3,
                "half of 0.3 degrees",
            )
        )
    most = np.hypot(solved.fx, solved.fy) / FRICTION_LIMIT - 1.0
    return [
        *rows,
        _bound_row(
            "sliding.most", "excess of the force above mu N, over mu N", max(float(most), 0.0), 1e-12, "Coulomb"
        ),
    ]


def _creepage_symmetry_rows() -> list[Row]:
    """Rows: reversed and mirrored creepages must give reversed and mirrored forces, up to the solver's residual."""
    name, cells = "x, y against spin", 20
    there, back, mirror = (
        rolling_forces(name, cells),
        rolling_forces(name, cells, -1.0),
        rolling_forces(name, cells, 1.0, -1.0),
    )
    return [
        _bound_row("reversed", "F(-creepage) + F(creepage), over mu N", float(np.abs(there + back).max()), 1e-7, "odd"),
        _bound_row(
            "mirrored",
            "difference of the forces from those of the mirror image in y, over mu N",
            float(np.abs(there - mirror * [1, -1, -1]).max()),
            1e-7,
            "no side is preferred",
        ),
    ]


def _grid_refinement_rows(forces_by_grid: dict[str, list[list[float]]]) -> list[Row]:
    """Rows: error relative to the limit of infinitely small cells, which is extrapolated from the two finest grids at
    order 1; and the observed order."""
    rows = []
    for name, values in forces_by_grid.items():
        left = 2.0 * np.linalg.norm(np.diff(np.array(values)[:, 1:3], axis=0), axis=1)
        cells = int(values[-2][0])
        bound = DISCRETISATION_ERROR * 40 / cells
        rows.append(
            _bound_row(
                f"refined.{name.replace(', ', '.').replace(' ', '_')}",
                f"error of the rolling force with {cells} cells along each axis, over mu N, {name}",
                float(left[-1]),
                bound,
                "as its documentation states",
                independence="none",
            )
        )
    total = np.array([np.diff(np.array(v)[:, 1:3], axis=0) for v in forces_by_grid.values()])
    changes = np.linalg.norm(total, axis=2).mean(axis=0)
    order = float(np.log2(changes[0] / changes[-1]) / (len(changes) - 1))
    return [
        *rows,
        Observed(
            "contact_exact.order",
            SYSTEM,
            "observed order of the rolling forces in the size of the cells, mean of the cases",
            order,
            "",
        ).within(1.5, 0.6, "2 where all slips, 1 where much sticks", "none"),
    ]


def random_contact_case(random_generator: np.random.Generator) -> tuple[ContactCase, int]:
    """A random contact with spin, a/b from 0.2 to 5 and Poisson's ratio from 0 to 0.5, with no forces computed; and its
    number of cells along each axis, 60 to 120."""
    ratio, level = (
        float(np.exp(random_generator.uniform(np.log(low), np.log(high)))) for low, high in ((0.2, 5.0), (0.1, 10.0))
    )
    body = Material(E=2.1e11, nu=float(random_generator.uniform(0.0, 0.5)))
    x, y, spin = (float(component) for component in random_generator.normal(size=3))
    case = ContactCase(
        CONTACT_SIZE * ratio**0.5,
        CONTACT_SIZE / ratio**0.5,
        NORMAL_LOAD,
        FRICTION_COEFFICIENT,
        MaterialPair(body, body),
        "drawn",
        (x, y, spin),
        level,
    )
    return case, int(random_generator.integers(60, 121))


def _convergence_row() -> Row:
    """Row: number of random contacts for which the solver does not converge."""
    rng, failed = np.random.default_rng(SEED), 0
    for case, cells in (random_contact_case(rng) for _ in range(RANDOM_CONTACT_COUNT)):
        try:
            solve_rolling(
                hertzian_pressure_grid(case.a, case.b, NORMAL_LOAD, cells),
                FRICTION_COEFFICIENT,
                *case.motion,
                case.pair,
            )
        except RunFailed:
            failed += 1
    return _bound_row(
        "converged",
        f"{RANDOM_CONTACT_COUNT} contacts drawn at random, a/b 0.2 to 5, with spin, 60 to 120 cells along each "
        "axis: how many the solver gave up",
        float(failed),
        0.0,
        "none is asked for",
        independence="none",
    )


def _sample_file_rows(quick: bool) -> tuple[list[list[Any]], list[Row]]:
    """Differences from every row of another program's sample, and rows with the largest; without the sample file, a row
    that was not run."""
    words = "largest difference from the forces of CONTACT's sample (40 cells, error 0.6 %) over mu N"
    folder = data_folder()
    if folder is None or not (folder / SAMPLE_FILE).is_file():
        return [], [not_run("contact_exact.sample", SYSTEM, words, f"TWINRIG_DATA names no folder with {SAMPLE_FILE}")]
    lines = (folder / SAMPLE_FILE).read_text(encoding="utf-8").splitlines()
    table = list(csv.DictReader(line for line in lines if not line.startswith("#")))[:: 4 if quick else 1]
    solved = [_differences_from_file(row, 20 if quick else 40) for row in table]
    force, moment = (max(solved_row[i] for solved_row in solved) for i in (2, 3))
    return solved, [
        _bound_row("sample", words, force, 0.01, "its own error and ours", independence="native"),
        _bound_row(
            "sample.moment",
            words.replace("forces", "moments").replace("mu N", "mu N sqrt(ab)"),
            moment,
            0.01,
            "its own error and ours",
            independence="native",
        ),
    ]


def _differences_from_file(sample_row: dict[str, str], cell_count: int) -> list[Any]:
    """Kind and axis ratio of a row of the sample file, difference of the force divided by mu N, and difference of the
    moment divided by mu N sqrt(ab). The file's units are mm, N and MPa."""
    value = {name: float(text) for name, text in sample_row.items() if name != "kind"}
    a, b, nu = value["a_mm"] / 1e3, value["b_mm"] / 1e3, value["nu"]
    body = Material(E=2e6 * value["G_MPa"] * (1 + nu), nu=nu)
    solved = solve_rolling(
        hertzian_pressure_grid(a, b, value["FN_N"], cell_count),
        value["mu"],
        value["xi_x"],
        value["xi_y"],
        value["phi_rad_per_mm"] * 1e3,
        MaterialPair(body, body),
    )
    limit = value["mu"] * value["FN_N"]
    force = np.hypot(solved.fx - value["Fx_N"], solved.fy - value["Fy_N"]) / limit
    moment = abs(solved.mz - value["Mz_Nmm"] / 1e3) / (limit * (a * b) ** 0.5)
    return [sample_row["kind"], value["a_over_b"], float(force), moment]


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Tables of the rolling forces over the grids, and of the differences from the sample."""
    grids = [f"{int(row[0])} cells" for row in next(iter(case_data["refined"].values()))]
    rows = tuple(
        (name, *(f"{100 * fx:z.2f}, {100 * fy:z.2f}" for _, fx, fy, _ in values))
        for name, values in case_data["refined"].items()
    )
    solved = [
        Table(
            "Refinement of the exact rolling problem",
            "Fx, Fy in % of mu N; cells along each axis.",
            ("case", *grids),
            rows,
        )
    ]
    if case_data["sample"]:
        rows = tuple(
            (f"{ratio:g}", kind, f"{100 * force:.2f}", f"{100 * moment:.2f}")
            for kind, ratio, force, moment in case_data["sample"]
        )
        solved.append(
            Table(
                "The exact theory beside CONTACT",
                "Differences in % of mu N and of mu N sqrt(ab).",
                ("a/b", "kind", "force", "moment"),
                rows,
            )
        )
    return solved


def draw(case_data: dict[str, Any]) -> list[tuple[str, Any]]:
    """Plot Carter's traction on a strip, and the change of the rolling forces with the number of cells."""
    from models.drawing.figures import COLUMN_WIDTH, add_heading, subplots

    figure, (left, right) = subplots(1, 2, figsize=(COLUMN_WIDTH, 4.2))
    x, traction = case_data["strip"]
    fine = np.linspace(-1, 1, 801)
    left.plot(fine, carter_traction(fine, 1.0, 0.5), color="0.4", label="Carter")
    left.plot(x, traction, ".", label="40 cells, middle of a/b = 1/50")
    left.set(xlabel="x / a [-] (leading edge at 1)", ylabel="traction / (μ p0) [-]")
    left.set_title("Cylinder at half the creepage of sliding")
    left.set_xticks([-1, -0.5, 0, 0.5, 1])
    left.legend()
    for name, values in case_data["refined"].items():
        numbers = np.array(values)
        left_over = np.linalg.norm(np.diff(numbers[:, 1:3], axis=0), axis=1)
        right.loglog(numbers[1:, 0], 100 * left_over, "o-", label=name)
    right.set(xlabel="cells along each axis [-]", ylabel="change from half as many [% of μN]")
    right.set_xticks(ticks := numbers[1:, 0].astype(int), ticks)
    right.minorticks_off()
    right.set_yticks([0.01, 0.1, 1], ["0.01", "0.1", "1"])
    right.set_title("Rolling forces by their cells")
    right.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=3)
    add_heading(figure, "The exact theory meets Carter's closed form, and its forces settle as cells are halved")
    return [
        (
            "Traction of a rolling cylinder beside Carter's closed form, and how much the forces change where cells "
            "are halved.",
            figure,
        )
    ]
