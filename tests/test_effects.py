"""Effects: what each adds is what its formula says, in every implementation."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from models.core.noise import normal_samples
from models.core.time_series import write_time_series
from models.engines.assembly import Settings
from models.systems.pitch_plane.effects.contact_points import compression
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import build

ENGINES = ("reference", "exudyn", "mujoco")


@pytest.fixture
def forces(tmp_path):
    t = 1e-3 * np.arange(601)
    front = 4200 + 800 * np.sin(9 * t) + 300 * np.sin(40 * t)
    rear = 3300 + 500 * np.cos(7 * t)
    write_time_series(tmp_path / "f.csv", {"front": ("N", front), "rear": ("N", rear)}, 1e-3)
    write_time_series(tmp_path / "p.csv", {"pitch": ("rad", 0.05 * (1 - np.cos(8 * t)) + 0.02)}, 1e-3)
    return tmp_path


def scene(folder, effects, parameters="asymmetric_twin", interpolation="linear", geometry="exact", **forces):
    own = {"wheel_forces": {"file": "f.csv", "interpolation": interpolation, **forces}, **effects}
    return build(
        {
            "title": "test",
            "vehicle": {"parameters": parameters, "geometry": geometry},
            "run": {"duration": 0.5, "step": 5e-4},
            "effects": own,
        },
        "",
        folder,
    )


@pytest.mark.parametrize("geometry", ["exact", "linear"])
@pytest.mark.parametrize("frame", ["inertial", "body"])
@pytest.mark.parametrize("interpolation", ["held", "linear", "smooth"])
@pytest.mark.parametrize(
    "extra",
    [{}, {"pitch_spring": {"stiffness": 5e3, "damping": 80.0}}, {"force_noise": {"deviation": 40.0, "seed": 3}}],
    ids=["plain", "spring", "noise"],
)
def test_three_implementations_agree_in_every_combination(forces, geometry, frame, interpolation, extra):
    own = scene(forces, extra, interpolation=interpolation, geometry=geometry, frame=frame)
    truth = simulate(own, "reference").states
    for engine in ("exudyn", "mujoco"):
        # same tableau, same step: the order of additions is all that differs
        assert np.abs(simulate(own, engine).states - truth).max() < 1e-12


@pytest.mark.parametrize("interpolation", ["held", "linear", "smooth"])
@pytest.mark.parametrize("geometry", ["exact", "linear"])
def test_reduced_model_agrees_with_the_eliminated_form(forces, interpolation, geometry):
    own = scene(forces, {"prescribed_pitch": {"file": "p.csv"}}, interpolation=interpolation, geometry=geometry)
    truth, found = simulate(own, "reference"), simulate(own, "mujoco")
    assert np.abs(found.states - truth.states).max() < 1e-12
    # moments of some kN m through forces of the same size
    assert np.abs(found["enforced_moment"] - truth["enforced_moment"]).max() < 1e-8


def test_pitch_spring_takes_its_part_of_the_moment(forces):
    """I beta'' is the suspension's moment less the spring's, k beta + d beta'."""
    stiffness, damping = 4e4, 600.0
    y = simulate(scene(forces, {"pitch_spring": {"stiffness": stiffness, "damping": damping}}), "exudyn")
    inertia = 540.0 * np.gradient(y["pitch_rate"], y.times)
    balance = y["suspension_moment"] - stiffness * y["pitch"] - damping * y["pitch_rate"]
    # central differences at 0.5 ms err by (2 pi 100 Hz h)^2 / 6, a percent and a half, at the fastest pole of the start
    assert np.abs(inertia - balance)[20:-1].max() < 0.01 * np.abs(inertia).max()
    assert np.abs(stiffness * y["pitch"]).max() > 0.2 * np.abs(inertia).max()


def test_contact_point_answers_a_step_exactly():
    """e = f/k (1 - exp(-t k/d)) for a step, at any times."""
    times = np.sort(np.random.default_rng(2).uniform(0.0, 0.09, 200))
    for period in (1e-4, 1e-3, 5e-3, 2e-2):
        force = np.full((1, round(0.1 / period)), 2000.0)
        force[0, 0] = 0.0
        got = compression(force, period, 2e5, 2e2, times)
        expected = -2000 / 2e5 * np.expm1(-np.maximum(times - period, 0.0) * 1e3)
        assert np.abs(got - expected).max() < 1e-15  # rounding of 0.01 m


def test_contact_point_follows_polynomials_exactly():
    """A cubic force on every piece, against the closed form and against a tight solver."""
    pieces = np.random.default_rng(3).normal(size=(4, 6)) * np.array([[1e3], [1e4], [1e5], [1e6]])
    period, stiffness, damping = 0.02, 2e5, 2e3
    times = np.linspace(0.0, 0.12, 121)[:-1]

    def force(t):
        piece = min(int(t / period + 1e-12), 5)
        return np.polynomial.polynomial.polyval(t - piece * period, pieces[:, piece])

    truth, start = [pieces[0, 0] / stiffness], pieces[0, 0] / stiffness
    for piece in range(6):
        own = times[(times > piece * period + 1e-9) & (times < (piece + 1) * period - 1e-9)]
        span = (piece * period, (piece + 1) * period - 1e-13)
        solution = solve_ivp(
            lambda t, e: (force(t) - stiffness * e) / damping,
            span,
            [start],
            "DOP853",
            rtol=1e-12,
            atol=1e-16,
            dense_output=True,
        )
        start = solution.y[0, -1]
        truth += [*solution.sol(own)[0], start]
    assert np.abs(compression(pieces, period, stiffness, damping, times) - truth[:-1]).max() < 1e-11


@pytest.mark.parametrize("interpolation", ["held", "linear", "smooth"])
def test_contact_points_do_not_depend_on_the_rows(forces, interpolation):
    """Coarse rows of an adaptive run read the same filter as fine ones."""
    own = scene(forces, {"contact_points": {}}, interpolation=interpolation)
    fine, coarse = (simulate(own, "reference", Settings("DOP853", step, 0.5, 1e-11)) for step in (1e-3, 1e-2))
    gap = [np.abs((run["z1"] - run["zeta1"])[::every][:50]) for run, every in ((fine, 10), (coarse, 1))]
    assert np.abs(gap[0] - gap[1]).max() < 1e-14


def test_contact_points_are_channels_and_never_feed_back(forces):
    plain, named = scene(forces, {}), scene(forces, {"contact_points": {}})
    for engine in ENGINES:
        with_points = simulate(named, engine)
        assert {"zeta1", "zeta2"} <= set(with_points.data) and "zeta1" not in simulate(plain, engine).data
        assert np.array_equal(with_points.states, simulate(plain, engine).states)


def test_contact_points_find_the_road_that_made_the_forces(tmp_path):
    """Virtual measurement on a road, then forces alone: the contact points draw the road again."""
    road = build(
        {
            "title": "test",
            "run": {"duration": 2.0, "step": 5e-4},
            "effects": {"road": {"source": "hills", "speed": 20.0}},
        }
    )
    measured = simulate(road, "reference")
    write_time_series(tmp_path / "f.csv", {"front": ("N", measured["f1"]), "rear": ("N", measured["f2"])}, 5e-4)
    own = build(
        {
            "title": "test",
            "run": {"duration": 2.0, "step": 5e-4},
            "effects": {"wheel_forces": {"file": "f.csv", "interpolation": "smooth"}, "contact_points": {}},
        },
        "",
        tmp_path,
    )
    found = simulate(own, "reference")
    # half a digit of drift in heave
    assert np.abs(found["zeta1"] - measured["zeta1"]).max() < 1e-6


def test_noise_is_named_by_its_seed_and_independent_of_the_step(forces):
    long = normal_samples(4, 0, 9000, 2)
    assert np.array_equal(normal_samples(4, 0, 300, 2, first_sample=4000), long[4000:4300])  # across a block's edge
    assert not np.array_equal(long[:5], normal_samples(5, 0, 5, 2)) and not np.array_equal(
        long[:5], normal_samples(4, 1, 5, 2)
    )
    own = scene(forces, {"force_noise": {"deviation": 40.0}}, interpolation="held")
    fine = own.model_copy(update={"run": own.run.model_copy(update={"step": 1.25e-4})})
    coarse, finer = simulate(own, "reference").states, simulate(fine, "reference").states[::4]
    # integration error of 0.5 ms on kinks at the samples; noise drawn per step would differ by 1e-3
    assert np.abs(coarse - finer).max() < 2e-5
