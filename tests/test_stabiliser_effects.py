"""Added moments and stabilisers on the asymmetric vehicle: every sign, arm and time shows in one of the engines."""

from dataclasses import replace

import numpy as np
import pytest

from models.assembly import Assembly, assemble
from models.engines.catalogue import RECOMMENDED
from models.engines.protocol import Settings, build
from models.scene import build as build_scene
from models.signals import sampled
from models.time_series import write_time_series
from models.vehicles.description import PitchSpring
from validation import checks

ENGINES = ("reference", "exudyn", "mujoco")
STEP, SAMPLING, DURATION = 1e-3, 4e-3, 0.2
"""s: four steps in each sample, so that a force held over a step and one held over a sample differ."""
STATE = np.array([0.02, -0.01, 0.05, 0.3, 0.5, -0.4, 0.3, 0.7])
"""m, rad, m/s, rad/s."""


@pytest.fixture
def forces(tmp_path):
    """A folder with rough wheel forces of the size of the axle loads."""
    t = np.arange(0, DURATION + SAMPLING / 2, SAMPLING)
    wave = np.sin(150.0 * t**1.5 + 0.3)
    columns = {"front": ("N", 4e3 + 3e3 * wave), "rear": ("N", 3e3 - 2e3 * np.roll(wave, 3))}
    write_time_series(tmp_path / "forces.csv", columns, SAMPLING)
    return tmp_path


def driven(folder, interpolation="linear", frame="inertial", geometry="exact", **effects) -> Assembly:
    """The asymmetric vehicle under the wheel forces, with further effects, released from a tilt."""
    table = {"file": "forces.csv", "interpolation": interpolation, "frame": frame}
    return assemble(build_scene({
        "title": "t", "vehicle": {"parameters": "asymmetric_twin", "geometry": geometry},
        "run": {"duration": DURATION, "step": STEP}, "start": {"pitch": 0.2, "pitch_rate": 0.5},
        "effects": {"wheel_forces": table, **effects},
    }, "t", folder))  # fmt: skip


def moment(interpolation="linear", period=SAMPLING):
    """A rough moment of 2,000 N m."""
    t = np.arange(0, DURATION + period / 2, period)
    return sampled(2e3 * np.sin(400.0 * t + 0.5)[:, None], period, interpolation)


def model(engine, assembly, **settings):
    """An assembly in an engine by its classical Runge-Kutta method."""
    return build(engine, assembly, replace(Settings(RECOMMENDED[engine], STEP, DURATION), **settings))


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("frame", "interpolation"), [("inertial", "held"), ("body", "held"), ("body", "smooth")])
def test_an_added_moment_turns_the_chassis_and_nothing_else(forces, engine, frame, interpolation):
    """pitch'' gains m(t) / I at the time asked for, nose up; 1e-12 is four digits above rounding."""
    bare, signal = driven(forces, interpolation, frame), moment()
    for time in (0.0, 3.5e-3, 0.1505):
        before, after = (model(engine, own).acceleration(time, STATE) for own in (bare, bare.with_moment(signal)))
        wanted = signal.at(time)[0] / bare.parameters.I
        np.testing.assert_allclose(after - before, [0, 0, 0, wanted], atol=1e-12 * np.abs(after).max())


@pytest.mark.parametrize("engine", ["exudyn", "mujoco"])
@pytest.mark.parametrize("frame", ["inertial", "body"])
@pytest.mark.parametrize("interpolation", ["held", "linear", "smooth"])
def test_engines_agree_under_an_added_moment_and_a_spring(forces, engine, frame, interpolation):
    """Same tableau, same step, same stage times; 1e-12 of states of size 1 after 200 steps."""
    spring = PitchSpring("chassis", 3e3, 100.0)
    own = driven(forces, interpolation, frame)
    own = replace(own, vehicle=replace(own.vehicle, pitch_springs=(spring,))).with_moment(moment())
    assert checks.trajectory_gap(checks.engine(engine), own, Settings(RECOMMENDED[engine], STEP, DURATION)) < 1e-12


@pytest.mark.parametrize("engine", ["exudyn", "mujoco"])
def test_engines_agree_under_an_added_moment_in_linear_geometry(forces, engine):
    own = driven(forces, "held", geometry="linear").with_moment(moment("smooth"))
    assert checks.trajectory_gap(checks.engine(engine), own, Settings(RECOMMENDED[engine], STEP, DURATION)) < 1e-12


def test_an_added_moment_is_read_at_each_stages_time(forces):
    """Against an adaptive solver: RK4's pitch errs by 1e-6 here, and by 4e-4 with a moment that is half a step late."""
    own = driven(forces, "held").with_moment(moment("smooth"))
    tight = model("reference", own, integrator="DOP853", tolerance=1e-12).run()
    fine = model("reference", own, step=STEP / 4).run()
    assert np.abs(fine.states[::4] - tight.states)[:, [3, 7]].max() < 1e-6


def test_two_springs_are_both_there(forces):
    """Two of them pull like one with the sum of their stiffness and damping, in each implementation."""
    own = driven(forces)
    one, two, both = (PitchSpring("chassis", k, d) for k, d in ((2e3, 50.0), (1e3, 200.0), (3e3, 250.0)))
    for engine in ENGINES:
        found = [model(engine, replace(own, vehicle=replace(own.vehicle, pitch_springs=springs))).acceleration(0, STATE)
                 for springs in ((one, two), (both,))]
        np.testing.assert_allclose(found[0], found[1], rtol=1e-12)
