"""What runs of the pitch plane say of themselves: assumptions, broken and lifted, and errors beside finer truths."""

import numpy as np
import pytest

from models.core import discretisation
from models.core.assumptions import broken_assumptions_of
from models.core.discretisation import RunSeries, error_estimates_of, largest_estimate, with_estimated_errors
from models.core.errors import RunFailed
from models.core.result import Channel, result
from models.core.systems import load
from models.core.time_series import write_time_series
from models.engines.assembly import Settings
from models.sensors.motion_assumptions import AccelerometerRecord, assumptions_of_motion
from models.sensors.rigid_body_motion import RecoveredMotion, RigidFitQuality
from models.systems.pitch_plane.run import run
from models.systems.pitch_plane.scene import build
from models.systems.pitch_plane.trust import small_errors
from models.vehicles.parameters.itwm_drift import PARAMETERS as P
from studies.command.asked import SCENES_FOLDER

LOAD = 0.5 * P.m3 * P.g + P.m1 * P.g
"""N on each axle of the paper's vehicle at rest."""
GENTLE = {"road": {"source": "hills", "speed": 20.0}, "lift_off": {}}
FORCES = {"wheel_forces": {"file": "forces.csv", "interpolation": "linear"}}


def scene(folder="", duration=1.0, step=1e-3, **tables):
    table = {"title": "planted", "run": {"duration": duration, "step": step}, **tables}
    return build(table, "planted.toml", folder)


def breaches(planted, engine="reference"):
    """Broken assumptions of a run by their names."""
    return {breach.name: breach for breach in broken_assumptions_of(run(planted, engine))}


@pytest.fixture
def files(tmp_path):
    """A folder of wheel forces that wave about the weight, by their amplitude (N) in opposite phases, and a pitch."""

    def written(front=0.0, rear=0.0, pitch=0.0, mean=(0.0, 0.0), duration=2.0):
        times = 1e-3 * np.arange(round(duration / 1e-3) + 1)
        wave = np.sin(2.0 * np.pi * times) ** 2 * np.sin(6.0 * np.pi * times)
        columns = {"front": LOAD + mean[0] + front * wave, "rear": LOAD + mean[1] - rear * wave}
        write_time_series(tmp_path / "forces.csv", {name: ("N", values) for name, values in columns.items()}, 1e-3)
        write_time_series(tmp_path / "pitch.csv", {"pitch": ("rad", pitch * wave)}, 1e-3)
        return tmp_path

    return written


STEEP = "s [m], left [mm], right [mm]\n" + "\n".join(f"{0.5 * i}, {y}, {y}" for i, y in enumerate([0, 0, 500, 0] * 20))
ON_STEEP = {"road": {"source": "csv", "file": "steep.csv", "beyond_end": "refused", "speed": 5.0}, "lift_off": {}}
SENSORS = {"sampling_rate": 200.0, "sensors": {"one": {"x": 1.0, "z": 0.2}}}
PLANTED = {
    "tyres press": ({"start": {"z3": -0.1}}, {"effects": {"lift_off": {}}}, "lift_off"),
    "tyres not flat": (
        {"start": {"z3": 0.6}, "effects": {"lift_off": {}}},
        {"start": {"z3": 0.6}, "effects": {"lift_off": {}}, "vehicle": {"override": {"k1": 8e5, "k2": 8e5}}},
        "vehicle.override",
    ),
    "springs compressed": ({"start": {"z3": -0.1}}, {"start": {"z3": 0.05}}, "start lower"),
    "small angles": (
        {"vehicle": {"geometry": "linear"}, "start": {"pitch": 0.4}},
        {"start": {"pitch": 0.4}},
        'geometry = "exact"',
    ),
    "upright": ({"start": {"pitch": 0.6}}, {"start": {"pitch": 0.3}}, "start nearer to level"),
    "gyro in range": (
        {"start": {"pitch": 0.3}, "effects": {"gyro": {"sampling_rate": 200.0, "deviation": 0.0, "range": 0.5}}},
        {"start": {"pitch": 0.3}, "effects": {"gyro": {"sampling_rate": 200.0, "deviation": 0.0}}},
        "effects.gyro.range",
    ),
    "accelerometers in range": (
        {"start": {"z3": -0.1}, "effects": {"accelerometers": {**SENSORS, "range": 15.0}}},
        {"start": {"z3": -0.1}, "effects": {"accelerometers": SENSORS}},
        "effects.accelerometers.range",
    ),
    "even road": ({"effects": ON_STEEP}, {"effects": GENTLE}, "smooth the road"),
}
"""By the assumption: a scene that breaks it, the same with the remedy, and a piece of what is told to do."""


@pytest.mark.parametrize("name", PLANTED)
@pytest.mark.parametrize("engine", ["reference", "mujoco"])
def test_a_planted_breach_is_told_with_its_remedy_and_gone_with_it(name, engine, tmp_path):
    wrong, cured, remedy = PLANTED[name]
    (tmp_path / "steep.csv").write_text(STEEP + "\n")
    found = breaches(scene(tmp_path, step=5e-4, **wrong), engine)[name]
    assert remedy in found.remedy and 0.0 < found.share <= 1.0 and 0.0 <= found.first < 1.0
    assert name not in breaches(scene(tmp_path, step=5e-4, **cured), engine)


def test_a_start_that_breaks_two_assumptions_tells_both():
    assert {"tyres press", "springs compressed"} <= set(breaches(scene(start={"z3": -0.1})))


def test_forces_that_do_not_carry_the_weight_are_told_unless_they_are_accepted(files):
    folder = files(100.0, 100.0, mean=(0.04 * LOAD, 0.04 * LOAD))
    weight = breaches(scene(folder, 2.0, effects=FORCES))["weight"]
    assert weight.worst == pytest.approx(0.04 * P.g, rel=0.1) and 'accept = ["weight"]' in weight.remedy
    accepted = {"wheel_forces": {**FORCES["wheel_forces"], "accept": ["weight"]}}
    assert "weight" not in breaches(scene(folder, 2.0, effects=accepted))
    assert breaches(scene(files(100.0, 100.0), 2.0, effects=FORCES)) == {}


def test_axles_that_do_not_balance_are_told(files):
    folder = files(100.0, 100.0, mean=(0.01 * LOAD, -0.01 * LOAD))
    found = breaches(scene(folder, 2.0, effects=FORCES), "mujoco")
    assert list(found) == ["balance"] and "a, b of the vehicle" in found["balance"].remedy


def test_forces_that_tumble_the_vehicle_are_told_and_a_held_pitch_lifts_it(files):
    folder = files(mean=(0.2 * LOAD, -0.2 * LOAD))
    accepted = {"wheel_forces": {**FORCES["wheel_forces"], "accept": ["balance"]}}
    found = breaches(scene(folder, 2.0, effects=accepted))["upright"]
    assert "prescribed_pitch" in found.remedy and found.first > 0.1
    held = {**accepted, "prescribed_pitch": {"file": "pitch.csv"}}
    assert set(breaches(scene(folder, 2.0, effects=held))) == {"little artificial"}  # and what holds it is told


@pytest.mark.parametrize("engine", ["reference", "mujoco"])
def test_a_stiff_spring_is_told_and_a_soft_one_is_not(files, engine):
    folder = files(2000.0, 2000.0)

    def held(stiffness):
        spring = {"pitch_spring": {"stiffness": stiffness, "damping": 2.0 * (stiffness * 500.0) ** 0.5}}
        return breaches(scene(folder, 2.0, effects=FORCES | spring), engine)

    assert "kalman_filter" in held(1e5)["little artificial"].remedy and held(100.0) == {}


@pytest.mark.full
def test_a_filter_that_contradicts_its_sensor_is_told(files):
    folder = files(500.0, 500.0, pitch=0.0)
    truth = run(scene(folder, 2.0, effects=FORCES), "reference")["pitch"]
    noise = 1e-3 * np.random.default_rng(1).normal(size=2001)
    for name, bias in (("right.csv", 0.0), ("biased.csv", 2e-3)):
        write_time_series(folder / name, {"pitch": ("rad", truth + noise + bias)}, 1e-3)

    def filtered(name):
        kalman = {"file": name, "force_deviation": 20.0, "pitch_deviation": 1e-3}
        return breaches(scene(folder, 2.0, effects=FORCES | {"kalman_filter": kalman}))

    found = filtered("biased.csv")["innovations"]
    assert abs(found.worst) > 1.0 and "bias" in found.remedy and "innovations" not in filtered("right.csv")


def test_a_motion_that_no_angles_and_no_samples_tell(files):
    """Of a body that turns by a right angle in few samples, after a tilted start, on a mount that gives way."""
    angle = np.linspace(0.3, 1.5, 5)
    rates = np.column_stack([np.zeros(5), np.full(5, 30.0), np.zeros(5)])
    turned = np.column_stack([np.cos(angle / 2), np.zeros(5), np.sin(angle / 2), np.zeros(5)])
    moved = RecoveredMotion(rates, rates, turned, rates, rates, rates)
    readings = np.tile([9.81 * np.sin(0.3), 0.0, -9.81 * np.cos(0.3)], (5, 4, 1))
    loose = AccelerometerRecord(RigidFitQuality(np.full(5, 1.0), 0.4, 0.0, 6), readings, 0.01, True)
    names = [a.name for a in assumptions_of_motion(loose, moved) if not within(a)]
    assert names == ["away from gimbal lock", "fine samples", "rigid body", "level start"]
    level = np.tile([0.0, 0.0, -9.81], (5, 4, 1))
    firm = AccelerometerRecord(RigidFitQuality(np.full(5, 0.01), 0.01, 0.0, 6), level, 1e-3, True)
    still = RecoveredMotion(0 * rates, 0.1 * rates, np.tile([1.0, 0.0, 0.0, 0.0], (5, 1)), rates, rates, rates)
    assert all(within(a) for a in assumptions_of_motion(firm, still))


def within(assumption):
    """Whether what is watched of a motion stays where it may."""
    values = np.concatenate(list(assumption.watched_values(None).values()))
    return bool(((values >= assumption.lower_limit) & (values <= assumption.upper_limit)).all())


def test_a_trust_in_large_errors_is_told():
    assert not within(small_errors(0.5)) and within(small_errors(0.05))


ODD = {
    "coarse on the study road": ("reference", "RK4", 2.5e-3, {"effects": {"road": {"source": "study", "speed": 13.0}}}),
    "Euler on a class C road": (
        "mujoco",
        "Euler",
        5e-4,
        {"effects": {"road": {"source": "iso8608", "road_class": "C", "speed": 30.0}}},
    ),
    "generalised-alpha, released": ("exudyn", "GeneralizedAlpha", 1e-3, {"start": {"pitch": 0.1}}),
    "landings": ("exudyn", "RK33", 1e-3, {"start": {"z3": -0.15}, "effects": {"lift_off": {}}}),
    "adaptive": ("reference", "DOP853", 1e-3, {"start": {"pitch": 0.1}}),
}


def told_and_true(engine, integrator, step, tables):
    """Ratio of the true error to the stated one, of the channel that the screen names."""
    planted = scene(duration=2.0, step=step, engines={engine: {"integrator": integrator}}, **tables)
    made = run(planted, engine, error=True)
    truth = run(planted, "reference", Settings("RK4", step / 100.0, 2.0))
    name, said = max(error_estimates_of(made).items(), key=lambda entry: entry[1].share)
    rows = np.rint(made.times / (step / 100.0)).astype(int)
    return float(np.sqrt(np.mean((made[name] - truth[name][rows]) ** 2))) / said.error


@pytest.mark.parametrize("name", ODD)
def test_the_stated_error_is_that_beside_a_truth_a_hundred_times_finer(name):
    assert 0.1 < told_and_true(*ODD[name]) < 3.0


def test_forces_whose_steps_cannot_be_longer_are_told_by_shorter_ones(files):
    folder = files(3000.0, 2000.0, duration=4.0)
    made = run(scene(folder, 4.0, effects=FORCES), "reference", error=True)
    truth = run(scene(folder, 4.0, effects=FORCES), "reference", Settings("RK4", 2.5e-5, 4.0))
    assert "half the step" in made.data.attrs["error"] and set(error_estimates_of(made)) == {"z3", "pitch", "f3", "f4"}
    worst = max(error_estimates_of(made), key=lambda name: error_estimates_of(made)[name].share)
    true = float(np.sqrt(np.mean((made[worst] - truth[worst][::40]) ** 2)))
    assert 0.1 < true / error_estimates_of(made)[worst].error < 3.0


def test_an_estimate_that_forgets_how_errors_grow_is_caught(monkeypatch):
    """Planted fault: what the first part shows is taken for the whole run, while the error grows as a drift does."""

    step = 0.002  # s: so many rows that a part of them is repeated

    def drifting(factor: float, share: float = 1.0) -> RunSeries:
        if factor > 1.0:
            raise RunFailed("reference", "no longer step can be")
        times = step * factor * np.arange(round(share * 4.0 / (step * factor)) + 1)
        return RunSeries(times, {"z3": np.sin(5.0 * times) + 1e-3 * factor**2 * times**2})

    fine = drifting(1.0)
    made = result(
        scene(), {"z3": Channel("time", fine.channels["z3"], "m")}, {"time": Channel("time", fine.times, "s")}
    )
    true = 1e-3 * float(np.sqrt(np.mean(fine.times**4)))
    assert error_estimates_of(with_estimated_errors(made, fine, drifting, 2, step))["z3"].error == pytest.approx(
        true, rel=0.3
    )
    monkeypatch.setattr(discretisation, "_growth_after_window", lambda gap, values: 1.0)
    assert error_estimates_of(with_estimated_errors(made, fine, drifting, 2, step))["z3"].error < true / 3.0


@pytest.mark.parametrize("steps", [1, 2, 3, 5])
def test_a_run_of_few_steps_is_compared_at_its_own_times(steps):
    """Twice the step of a run of one would outlast it, and tell the road's rise beside its foot for an error."""
    made = run(scene(duration=steps * 1e-3, start={"z3": -0.1}), "mujoco", error=True)
    truth = run(scene(duration=steps * 1e-3, step=1e-3 / 8, start={"z3": -0.1}), "mujoco")
    for name in ("z3", "f3"):
        true = float(np.sqrt(np.mean((made[name] - truth[name][::8]) ** 2)))
        assert true / 3.0 < error_estimates_of(made)[name].error < 30.0 * true  # the order of a few steps is not seen


def test_a_refused_run_names_a_step_that_is_then_accepted():
    """The belgian block's case: a step that is stable and far too long for the road."""
    rough = {"effects": {"road": {"source": "iso8608", "road_class": "G", "speed": 40.0}}}
    soft = {"vehicle": {"override": {"k1": 1e5, "k2": 1e5, "d1": 3000.0, "d2": 3000.0}}}
    with pytest.raises(RunFailed, match="this is no answer") as refusal:
        run(scene(duration=3.0, step=3e-3, **rough, **soft), "reference", error=True)
    advised = largest_estimate(refusal.value.partial).step
    shorter = float(f"{advised:g}")  # as it is printed
    assert (
        shorter < 3e-3
        and not largest_estimate(run(scene(duration=3.0, step=shorter, **rough, **soft), "mujoco", error=True)).warned
    )


SAYS_SO = {"tyres press", "springs compressed"}
"""What comments of the shipped scenes say of the paper's linear tyres."""


@pytest.mark.parametrize(("name", "allowed"), [("study_road", set()), ("iso_road", set()), ("release", SAYS_SO)])
def test_shipped_scenes_raise_no_alarm_that_they_do_not_speak_of(name, allowed):
    shipped = load(SCENES_FOLDER / f"{name}.toml")
    made = run(shipped, "reference", error=True)
    assert {breach.name for breach in broken_assumptions_of(made)} == allowed and not largest_estimate(made).warned
    assert not allowed or "for 3 % of the time" in (SCENES_FOLDER / f"{name}.toml").read_text()
