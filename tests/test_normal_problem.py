"""The normal problem: conditions checked by plain sums, what must scale, several patches, refusals."""

import numpy as np
import pytest

from models.contact import normal_problem
from models.contact.half_space import influence_of_rectangle
from models.contact.hertz import by_load
from models.contact.material import MaterialPair
from models.contact.normal_problem import CONTACT_TOLERANCE, cell_centres, solve_normal
from models.core.errors import InputError, RunFailed

PAIR = MaterialPair()
STEP = 0.4e-3
X = cell_centres(41, STEP)


def bowl(middle=0.0, radius=0.5):
    """Distance (m) of a ball at x = middle from a plane."""
    return ((X - middle) ** 2 + X[:, None] ** 2) / (2 * radius)


def test_every_condition_holds_by_a_plain_sum():
    """The gap again from the pressure, without the Fourier transform, in contact and outside."""
    found = solve_normal(bowl(), STEP, STEP, PAIR, load=5e4)
    y, x = np.meshgrid(X, X, indexing="ij")
    cells = np.flatnonzero(found.contact)
    places = np.concatenate([cells[::7], np.flatnonzero(~found.contact)[::11]])
    far = x.ravel()[places, None] - x.ravel()[cells], y.ravel()[places, None] - y.ravel()[cells]
    displacement = influence_of_rectangle(*far, STEP, STEP, PAIR)[..., 2, 2] @ found.pressure.ravel()[cells]
    gap = bowl().ravel()[places] + displacement - found.approach
    inside = np.isin(places, cells)
    allowed = 2 * CONTACT_TOLERANCE * displacement.max()
    assert np.abs(gap[inside]).max() < allowed
    assert gap[~inside].min() > -allowed
    assert found.pressure.min() == 0.0
    assert found.residual <= 2 * CONTACT_TOLERANCE
    assert found.load == pytest.approx(5e4, rel=1e-12)


def test_load_and_approach_are_each_other_s_inverse():
    one = solve_normal(bowl(), STEP, STEP, PAIR, load=5e4)
    other = solve_normal(bowl(), STEP, STEP, PAIR, approach=one.approach)
    assert other.load == pytest.approx(5e4, rel=1e-7)  # load is 1.5 times as steep as approach; residual 1e-9
    assert (one.contact == other.contact).all()


def test_eight_times_the_load_is_twice_the_radius():
    """On cells twice as large the same cells are in contact: Hertz' N ~ a^3 is exact on a grid, too."""
    small = solve_normal(bowl(), STEP, STEP, PAIR, load=1e4)
    large = solve_normal(4 * bowl(), 2 * STEP, 2 * STEP, PAIR, load=8e4)
    assert (small.contact == large.contact).all()
    assert large.pressure == pytest.approx(2 * small.pressure, rel=1e-6, abs=1e-6 * small.pressure.max())


def test_a_ball_off_the_middle_is_hertz():
    found = solve_normal(bowl(middle=2e-3), STEP, STEP, PAIR, load=2e4)
    truth = by_load(1.0, 1.0, 2e4, PAIR)
    assert found.approach == pytest.approx(float(truth.approach), rel=3e-3)  # 20 cells across
    assert np.sum(found.pressure * X) / found.pressure.sum() == pytest.approx(2e-3, rel=1e-6)


def test_two_patches_share_the_load():
    wells = np.minimum(bowl(middle=-4e-3), bowl(middle=4e-3))
    found = solve_normal(wells, STEP, STEP, PAIR, load=1e4)
    left, right = found.pressure[:, :20].sum(), found.pressure[:, 21:].sum()
    assert left == pytest.approx(right, rel=1e-6)
    assert not found.contact[:, 20].any()
    alone = by_load(1.0, 1.0, 5e3, PAIR)
    assert found.approach > float(alone.approach)  # each presses the other's surface down as well


def test_a_rough_surface_touches_in_many_places():
    """Cells that an early step lets go have to come back; the residual says whether they did."""
    rough = bowl(radius=50.0) + 1e-6 * np.random.default_rng(3).normal(size=(41, 41))
    rough[[0, -1]], rough[:, [0, -1]] = 1.0, 1.0
    found = solve_normal(rough, STEP, STEP, PAIR, load=3e4)
    assert found.residual <= 2 * CONTACT_TOLERANCE
    assert 0.2 < found.contact.mean() < 0.8


def test_an_unfinished_solution_is_none(monkeypatch):
    monkeypatch.setattr(normal_problem, "ITERATION_LIMIT", 3)
    with pytest.raises(RunFailed):
        solve_normal(bowl(), STEP, STEP, PAIR, load=5e4)


@pytest.mark.parametrize("given", [{"load": 0.0}, {"load": -5.0}, {"approach": 0.0}, {"approach": -1e-3}])
def test_bodies_apart(given):
    found = solve_normal(bowl(), STEP, STEP, PAIR, **given)
    assert found.load == 0.0 and not found.contact.any() and found.area == 0.0


@pytest.mark.parametrize(
    ("distance", "step", "given", "place"),
    [
        (np.zeros(5), STEP, {"load": 1.0}, "distance"),
        (np.full((5, 5), np.nan), STEP, {"load": 1.0}, "distance"),
        (bowl(), -STEP, {"load": 1.0}, "dx"),
        (bowl(), 0.4, {"load": 1.0}, "dx"),
        (bowl(), STEP, {}, "load"),
        (bowl(), STEP, {"load": 1.0, "approach": 1e-5}, "load"),
        (bowl(), STEP, {"load": np.inf}, "load"),
        (bowl(), STEP, {"approach": 7.0}, "approach"),
        (bowl(), STEP, {"load": 1e7}, "distance"),
    ],
)
def test_bad_input_is_refused(distance, step, given, place):
    with pytest.raises(InputError) as error:
        solve_normal(distance, step, STEP, PAIR, **given)
    assert error.value.place.startswith(place)
