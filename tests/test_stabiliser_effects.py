"""Added moments and stabilisers on the asymmetric vehicle: every sign, arm and time shows in one of the engines."""

from dataclasses import replace

import numpy as np
import pytest

from models.core.errors import InputError
from models.core.signals import signal_from_samples
from models.core.time_series import write_time_series
from models.engines.assembly import Assembly, Settings
from models.engines.catalogue import RECOMMENDED
from models.engines.protocol import build
from models.engines.stability import first_order, linearised_matrices, step_matrix
from models.systems.pitch_plane.plan import describe
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import assembly_of_scene
from models.systems.pitch_plane.scene import build as build_scene
from models.vehicles.description import PitchSpring
from validation.common import checks

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
    return assembly_of_scene(
        build_scene(
            {
                "title": "t",
                "vehicle": {"parameters": "asymmetric_twin", "geometry": geometry},
                "run": {"duration": DURATION, "step": STEP},
                "start": {"pitch": 0.2, "pitch_rate": 0.5},
                "effects": {"wheel_forces": table, **effects},
            },
            "t",
            folder,
        )
    )


def moment(interpolation="linear", period=SAMPLING):
    """A rough moment of 2,000 N m."""
    t = np.arange(0, DURATION + period / 2, period)
    return signal_from_samples(2e3 * np.sin(400.0 * t + 0.5)[:, None], period, interpolation)


def model(engine, assembly, **settings):
    """An assembly in an engine by its classical Runge-Kutta method."""
    return build(engine, assembly, replace(Settings(RECOMMENDED[engine], STEP, DURATION), **settings))


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("frame", "interpolation"), [("inertial", "held"), ("body", "held"), ("body", "smooth")])
def test_an_added_moment_turns_the_chassis_and_nothing_else(forces, engine, frame, interpolation):
    """pitch'' gains m(t) / I at the time asked for, nose up; 1e-12 is four digits above rounding."""
    bare, signal = driven(forces, interpolation, frame), moment()
    for time in (0.0, 3.5e-3, 0.1505):
        before, after = (
            model(engine, own).acceleration(time, *np.split(STATE, 2)) for own in (bare, bare.with_moment(signal))
        )
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
        found = [
            model(engine, replace(own, vehicle=replace(own.vehicle, pitch_springs=springs))).acceleration(
                0, *np.split(STATE, 2)
            )
            for springs in ((one, two), (both,))
        ]
        np.testing.assert_allclose(found[0], found[1], rtol=1e-12)


def banded(folder, interpolation="linear", frame="inertial", geometry="exact") -> Assembly:
    """The driven vehicle on a spring with a dead band of 0.22 rad, which it leaves and comes back to."""
    return driven(
        folder, interpolation, frame, geometry, pitch_spring={"stiffness": 5e4, "damping": 300.0, "dead_band": 0.22}
    )


@pytest.mark.parametrize("engine", ENGINES)
def test_a_dead_band_is_slack_within_and_counts_from_its_edge(forces, engine):
    own, p = banded(forces), driven(forces).parameters
    bare, taut = model(engine, driven(forces)), model(engine, own)
    for pitch in (0.1, -0.2, 0.3, -0.4):
        state = STATE.copy()
        state[3] = pitch
        beyond = max(abs(pitch) - 0.22, 0.0)
        moment = -(5e4 * np.copysign(beyond, pitch) + 300.0 * state[7]) if beyond else 0.0
        gained = taut.acceleration(0.0, *np.split(state, 2)) - bare.acceleration(0.0, *np.split(state, 2))
        np.testing.assert_allclose(gained, [0, 0, 0, moment / p.I], atol=1e-10)  # accelerations of 1e3: rounding 1e-13


@pytest.mark.parametrize("engine", ["exudyn", "mujoco"])
@pytest.mark.parametrize(
    ("frame", "interpolation", "geometry"),
    [
        ("inertial", "held", "exact"),
        ("inertial", "linear", "exact"),
        ("body", "held", "exact"),
        ("inertial", "smooth", "linear"),
    ],
)
def test_engines_agree_on_a_dead_band(forces, engine, frame, interpolation, geometry):
    """The same stages see the same side of the edge: rounding, although the moment jumps by 150 N m there."""
    own = banded(forces, interpolation, frame, geometry)
    path = model("reference", own).run().states[:, 3]
    assert (np.abs(path) < 0.22).any() and (np.abs(path) > 0.22).any()
    assert checks.trajectory_gap(checks.engine(engine), own, Settings(RECOMMENDED[engine], STEP, DURATION)) < 1e-12


def test_a_dead_band_stands_in_a_vehicle_without_any_input(tmp_path):
    """On its tyres, over a flat road: the law is there although there is no table to read."""
    effects = {"pitch_spring": {"stiffness": 5e4, "damping": 300.0, "dead_band": 0.05}}
    scene = build_scene(
        {"title": "t", "run": {"duration": DURATION, "step": STEP}, "start": {"pitch": 0.1}, "effects": effects},
        "t",
        tmp_path,
    )
    paths = [model(engine, assembly_of_scene(scene)).run().states for engine in ENGINES]
    assert np.abs(paths[1] - paths[0]).max() < 1e-12 > np.abs(paths[2] - paths[0]).max()


def test_a_high_pass_is_the_spring_of_its_corner(forces):
    """k = (I + J) wc^2 and d = 2 zeta (I + J) wc: the wheels move with the pitch, about the common centre of mass."""
    p = driven(forces).parameters
    coupling = p.b * p.m1 - p.a * p.m2
    inertia = p.I + p.m1 * p.b**2 + p.m2 * p.a**2 - coupling**2 / (p.m1 + p.m2 + p.m3)
    corner = 2 * np.pi * 0.5
    (spring,) = driven(forces, high_pass={"cut_off": 0.5, "damping_ratio": 0.6}).vehicle.pitch_springs
    assert (spring.stiffness, spring.damping) == pytest.approx((inertia * corner**2, 1.2 * inertia * corner))


def test_a_high_pass_decays_as_declared(forces):
    """The slow pair of poles of the force-excited vehicle is that of the filter, softened by the struts by 1 %."""
    vehicle = driven(forces, geometry="linear", high_pass={"cut_off": 0.5, "damping_ratio": 0.6}).vehicle
    poles = np.linalg.eigvals(first_order(linearised_matrices(vehicle)))
    slow = poles[np.abs(np.abs(poles) - np.pi) < 1.0]
    assert np.abs(slow) == pytest.approx([np.pi, np.pi], rel=0.01)
    assert -slow.real == pytest.approx([0.6 * np.pi, 0.6 * np.pi], rel=0.01)


@pytest.fixture
def guided(forces):
    """The folder with a motion of heave and pitch beside the forces."""
    t = np.arange(0, DURATION + SAMPLING / 2, SAMPLING)
    write_time_series(
        forces / "motion.csv",
        {"z3": ("m", 0.06 + 0.02 * np.sin(23.0 * t + 0.4)), "pitch": ("rad", 0.1 * np.sin(17.0 * t + 1.0))},
        SAMPLING,
    )
    return forces


def on_rails(folder, interpolation="smooth", geometry="exact", **values):
    """The asymmetric vehicle whose heave and pitch are prescribed."""
    scene = {
        "vehicle": {"parameters": "asymmetric_twin", "geometry": geometry},
        "title": "t",
        "run": {"duration": DURATION, "step": STEP},
        "effects": {
            "wheel_forces": {"file": "forces.csv", "interpolation": interpolation},
            "prescribed_heave_and_pitch": {"file": "motion.csv", **values},
        },
    }
    return assembly_of_scene(build_scene(scene, "t", folder))


@pytest.mark.parametrize("geometry", ["exact", "linear"])
@pytest.mark.parametrize("interpolation", ["held", "linear", "smooth"])
def test_mujoco_and_the_reference_agree_on_rails(guided, geometry, interpolation):
    own = on_rails(guided, interpolation, geometry)
    one, other = (model(engine, own).run() for engine in ("reference", "mujoco"))
    assert np.abs(one.states - other.states).max() < 1e-12
    assert np.abs(one.enforced - other.enforced).max() < 1e-12 * np.abs(one.enforced).max()


def test_exudyn_multipliers_on_rails(guided):
    """Second order: (2 pi f h)^2 / 12 of m3 z3'' and I beta'', 4e-5 at 23 rad/s and 1 ms; its start has died out."""
    own = on_rails(guided)
    one, other = (
        model(engine, own, integrator=name).run()
        for engine, name in (("reference", "RK4"), ("exudyn", "GeneralizedAlpha"))
    )
    assert np.abs(one.states - other.states)[:, [2, 3]].max() < 1e-12  # it stays where it is put
    off = np.abs(one.enforced - other.enforced)[50:].max(axis=0) / np.abs(one.enforced).max(axis=0)
    assert (off < 1e-3).all()


@pytest.mark.parametrize("engine", ENGINES)
def test_accelerations_on_rails_are_those_of_the_file(guided, engine):
    own = on_rails(guided)
    name = "GeneralizedAlpha" if engine == "exudyn" else "RK4"
    motion = own.input.at(0.1)
    state = np.concatenate((STATE[:2], motion[2:4], STATE[4:6], motion[4:6]))
    found = [
        model(e, own, integrator=n).acceleration(0.1, *np.split(state, 2))
        for e, n in ((engine, name), ("reference", "RK4"))
    ]
    np.testing.assert_allclose(found[0], found[1], rtol=1e-12)
    np.testing.assert_allclose(found[0][2:], motion[6:], rtol=1e-12)


def noisy_pitch(folder, rng=0):
    """0.1 sin(4 t) sampled at 1 kHz with white noise of 0.1 degrees; returns what is true."""
    t = np.arange(0, 2.0005, 1e-3)
    true = 0.1 * np.sin(4.0 * t)
    noise = np.deg2rad(0.1) * np.random.default_rng(rng).standard_normal(len(t))
    write_time_series(folder / "pitch.csv", {"pitch": ("rad", true + noise)}, 1e-3)
    write_time_series(folder / "forces.csv", {"front": ("N", 0 * t + 3825.9), "rear": ("N", 0 * t + 3825.9)}, 1e-3)
    return true


def measured(folder, **values):
    scene = {
        "title": "t",
        "run": {"duration": 2.0, "step": 1e-3},
        "effects": {
            "wheel_forces": {"file": "forces.csv", "interpolation": "linear"},
            "prescribed_pitch": {"file": "pitch.csv", **values},
        },
    }
    return assembly_of_scene(build_scene(scene, "scene.toml", folder))


def test_bandwidth_takes_the_noise_and_leaves_the_motion(tmp_path):
    """White noise through a zero-phase low-pass keeps 2 B T (0.92) of its variance; a late one would follow late."""
    true = noisy_pitch(tmp_path)
    left = measured(tmp_path, bandwidth=5.0).input.sample(0.0, 1e-3, len(true))[:, 2] - true
    assert 0.5 < np.std(left[200:-200]) / (np.deg2rad(0.1) * np.sqrt(2 * 5.0 * 1e-3 * 0.92)) < 1.7  # 18 free values
    rough, smooth = (
        measured(tmp_path, **own).input.sample(0.0, 1e-3, len(true))[:, 4] * 500.0 for own in ({}, {"bandwidth": 5.0})
    )
    assert np.std(rough) > 1e6 > 1e3 > np.std(smooth[200:-200])  # N m, with I = 500 kg m^2


@pytest.mark.parametrize("octaves", [0, 1])
def test_bandwidth_is_a_zero_phase_low_pass_of_eighth_order(tmp_path, octaves):
    """1 / (1 + (f / B)^8) without a phase: a half at the bandwidth, 1/257 an octave above, but for the ends."""
    t = np.arange(0, 4.0005, 1e-3)
    wave = np.cos(2 * np.pi * 5.0 * 2**octaves * t)
    write_time_series(tmp_path / "pitch.csv", {"pitch": ("rad", 0.1 * wave)}, 1e-3)
    write_time_series(tmp_path / "forces.csv", {"front": ("N", 0 * t + 3825.9), "rear": ("N", 0 * t + 3825.9)}, 1e-3)
    found = measured(tmp_path, bandwidth=5.0).input.sample(0.0, 1e-3, 2001)[:, 2]
    np.testing.assert_allclose(found[800:1200], 0.1 / (1 + 256**octaves) * wave[800:1200], atol=1e-5)


def test_a_bandwidth_beyond_half_the_sampling_rate_is_refused(tmp_path):
    noisy_pitch(tmp_path)
    with pytest.raises(InputError, match=r"prescribed_pitch\.bandwidth = 500\.0: must be below 500 Hz"):
        measured(tmp_path, bandwidth=500.0)


def linear_map(engine, own, integrator, free):
    """What one step of an engine does to small changes of the free coordinates and rates, column by column."""
    columns = []
    for i in (*free, *(4 + j for j in free)):
        ends = []
        for push in (1e-5, -1e-5):
            start = replace(own, initial=own.initial + push * np.eye(8)[i])
            ends.append(model(engine, start, integrator=integrator, duration=STEP).run().states[-1])
        columns.append((ends[0] - ends[1]) / 2e-5)
    return np.array(columns).T[[*free, *(4 + j for j in free)]]


@pytest.mark.parametrize(
    ("engine", "integrator"), [("exudyn", "RK44"), ("mujoco", "Euler"), ("mujoco", "implicitfast")]
)
def test_the_step_check_knows_a_taut_dead_band(forces, engine, integrator):
    """Beyond its band the spring stiffens the vehicle; its damper is in a callback, so implicit in no integrator."""
    own = driven(forces, geometry="linear", pitch_spring={"stiffness": 5e4, "damping": 3e3, "dead_band": 0.1})
    wanted = step_matrix(integrator, STEP, linearised_matrices(own.vehicle))
    assert np.abs(linear_map(engine, own, integrator, range(4)) - wanted).max() < 1e-7  # differences of 1e-5


@pytest.mark.parametrize(("engine", "integrator"), [("reference", "RK4"), ("mujoco", "Euler")])
def test_the_step_check_knows_a_vehicle_on_rails(guided, engine, integrator):
    own = on_rails(guided, geometry="linear")
    wanted = step_matrix(integrator, STEP, linearised_matrices(own.vehicle, own.guided))
    assert np.abs(linear_map(engine, own, integrator, range(2)) - wanted).max() < 1e-7


def test_the_plan_names_what_is_there(guided):
    scene = build_scene(
        {
            "title": "t",
            "run": {"duration": DURATION, "step": STEP},
            "effects": {"pitch_spring": {"stiffness": 5e4, "dead_band": 0.22}},
        },
        "t",
        guided,
    )
    assert "to the ground, beyond 0.22 rad" in describe(scene)
    effects = {
        "wheel_forces": {"file": "forces.csv", "interpolation": "linear", "accept": ["weight", "balance"]},
        "prescribed_heave_and_pitch": {"file": "motion.csv"},
    }
    scene = build_scene(
        {
            "title": "t",
            "run": {"duration": DURATION, "step": STEP},
            "effects": effects,
            "engines": {"exudyn": {"integrator": "GeneralizedAlpha"}},
        },
        "t",
        guided,
    )
    text = describe(scene)
    assert "heave and pitch of the chassis prescribed" in text and "enforced_force, inertia_term" in text
    names = set(simulate(scene, "exudyn").data.data_vars)
    assert {"enforced_force", "enforced_moment", "inertia_term"} <= names
