"""Runs of measured files and virtual measurements, by closed forms: a car that is pushed sideways without turning,
held angles, a turning table of accelerometers, travels of moved wheels."""

import json
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from models.core.strict import read
from models.fatigue.counting import CountedLoad
from models.measured.columns import SampleFile, SamplesInMemory
from models.measured.faults_of_measurement import SimulatedFaults
from models.measured.recording import Recording
from models.measured.signal import MeasuredSignal, TransducerPlace
from models.multibody.cut_table import joint_table_of
from models.systems.hub_forces.measurement import element_travels
from models.systems.measured.hand_on import labelled_result
from models.systems.measured.inputs import RecordingInputs, StepGrid
from models.systems.measured.run import _record_seconds, run
from models.systems.measured.scene import build
from models.systems.measured.section_run import AttitudeHold, SectionOutcome, SectionRunSettings
from models.systems.measured.section_run import run as march
from models.systems.measured.sections import (
    AccelerometerPoint,
    SectionChannel,
    Sections,
    _guide_arrays,
    accelerometer_points,
)
from models.systems.measured.virtual import (
    VirtualTable,
    _chassis_motion,
    body_rates,
    channel_group,
    checked_signals,
    virtual_measurement,
)
from validation.spatial.cars import r19

pytestmark = pytest.mark.grounds("closed form")
CAR, GRAVITY, PERIOD = r19(), 9.81, 2e-3
MASS = sum(body.mass for body in CAR.tree.bodies)
CENTRE = sum(body.mass * np.array(body.position) for body in CAR.tree.bodies) / MASS
FRONT, REAR = (next(tyre.point[0] for tyre in CAR.uncut.tyres if tyre.axle == axle) for axle in (0, 1))
FRONT_LOAD = MASS * GRAVITY * (CENTRE[0] - REAR) / (FRONT - REAR) / 2.0
LOADS = {tyre.name: FRONT_LOAD if tyre.axle == 0 else MASS * GRAVITY / 2.0 - FRONT_LOAD for tyre in CAR.uncut.tyres}
"""N: of a wheel, by moments about the rear axle; the car is the same to the left and to the right."""
NOISE = {"force": 12.5, "moment": 2.5, "angle": 0.25, "rate": 0.5}
PUSH = 0.25
"""1/s: growth of the ratio of a wheel's lateral force to its load."""


def pushed(folder: Path, count=301):
    """A scene whose wheels push sideways, in the ratio of their loads, and turn against the height of the centre."""
    times = PERIOD * np.arange(count)
    columns, rows = {}, []
    for hub, load in LOADS.items():
        lateral = PUSH * load * times
        height = next(tyre.point[2] for tyre in CAR.uncut.tyres if tyre.name == hub) - CENTRE[2]
        forces = {"z": ("kN", np.full(count, 1e-3 * load)), "y": ("N", lateral)}
        columns |= {f"{hub} F{axis} [{unit}]": values for axis, (unit, values) in forces.items()}
        columns[f"{hub} Mx [N*m]"] = height * lateral
        rows += [{"channel": f"{hub} F{axis}", "quantity": "force", "at": hub, "component": axis} for axis in "zy"]
        rows.append({"channel": f"{hub} Mx", "quantity": "moment", "at": hub, "component": "x"})
    body = "\n".join(",".join(f"{value:.17g}" for value in row) for row in np.column_stack([times, *columns.values()]))
    (folder / "a.csv").write_text(f"time [s],{','.join(columns)}\n{body}\n")
    table = {"title": "t", "system": "measured", "vehicle": {"file": "r19_free"}, "noise": NOISE}
    table |= {"stabilise": {"method": "none"}, "files": [{"file": "a.csv", "channels": rows}]}
    return build(table, "scene.toml", folder)


@pytest.mark.parametrize("engine", ["reference", "exudyn", "mujoco"])
def test_a_car_that_is_pushed_without_a_turn_moves_along_a_cubic(engine, tmp_path):
    """a = g PUSH t of every body: y = g PUSH t^3 / 6; springs bear what they bear at rest, guides push the wheels."""
    result = run(pushed(tmp_path), engine)
    times, outcome = PERIOD * np.arange(301), result.detail.outcome
    assert result.times == pytest.approx(times, abs=1e-12) and outcome.period == PERIOD
    assert result["body y"] == pytest.approx(GRAVITY * PUSH * times**3 / 6.0, abs=1e-9)
    still = [result[name] for name in ("body x", "body z", "body roll", "body pitch", "front left travel")]
    assert np.abs(still).max() < 1e-9
    assert result["left seat F"] == pytest.approx(np.full(301, 60.0 * GRAVITY), rel=1e-9)
    wheel = CAR.tree.body("fl").mass
    assert result["fl hub Fy"] == pytest.approx(PUSH * LOADS["fl"] * times, abs=1e-6)
    assert result["fl guide Fy"] == pytest.approx(PUSH * (wheel * GRAVITY - LOADS["fl"]) * times, abs=1e-6)
    assert result.detail.holds == {"free": AttitudeHold("none", **NOISE)}
    assert outcome.samples("body y").tolist() == result["body y"].tolist()


def signal_of(name, quantity="force", at="fl", component="z", frame="hub"):
    """A signal in SI units that a file calls as the recording does."""
    return MeasuredSignal(name, "a.csv", name, quantity, at, component, frame, 1, "N", 1.5, zero=0.25)


def standing(count=120, **angles):
    """A recording of the car's loads and of roll, pitch and their rates, all constant; angles : values, in rad."""
    samples = {signal_of(hub, at=hub): load for hub, load in LOADS.items()}
    for name, value in angles.items():
        component, _, rate = name.partition("_")
        quantity, frame = ("angular rate", "body") if rate else ("angle", "inertial")
        samples[signal_of(name, quantity, "body", component, frame)] = value
    names = tuple(signal.name for signal in samples)
    return Recording(tuple(samples), SamplesInMemory(names, np.tile([*samples.values()], (count, 1))), PERIOD)


def test_a_run_is_held_to_the_angles_that_were_measured(tmp_path):
    """A low-pass leaves constants as they are."""
    job = SectionRunSettings(
        CAR, standing(roll=0.02, pitch=-0.01), Sections(CAR), "reference", AttitudeHold("prescribed")
    )
    outcome = march(job, tmp_path)
    assert (job.grid.step, job.grid.period, outcome.period, outcome.done) == (PERIOD, PERIOD, PERIOD, 120)
    assert outcome.samples("body roll") == pytest.approx(np.full(120, 0.02), rel=1e-9)
    assert outcome.samples("body pitch") == pytest.approx(np.full(120, -0.01), rel=1e-9)


def turned_rates(roll, pitch, rates):
    """Rates (rad/s) of gyros on a body with roll, pitch and heading 0.3 whose angles have these rates: the turn from
    shortly before to shortly after."""
    angles, short = np.array([0.3, pitch, roll]), 1e-5
    before, after = (Rotation.from_euler("ZYX", angles + way * short * rates[::-1]) for way in (-1.0, 1.0))
    return (before.inv() * after).as_rotvec() / (2.0 * short)


def test_gyros_become_rates_of_angles_and_rates_of_angles_what_gyros_read():
    rates = np.array([0.5, -0.75, 1.25])
    gyros = turned_rates(0.2, -0.3, rates)
    assert body_rates(np.array([[0.2, -0.3]]), rates[None])[0] == pytest.approx(gyros, rel=1e-8)
    named = dict(zip(("roll_rate", "pitch_rate", "yaw_rate"), gyros.tolist(), strict=True))
    inputs = RecordingInputs(standing(roll=0.2, pitch=-0.3, **named), CAR)
    assert inputs.tilt(5, 2) == pytest.approx(np.tile([0.2, -0.3, *rates[:2]], (2, 1)), rel=1e-8)
    assert {signal.factor for signal in inputs.used_signals} == {1.5} and len(inputs.used_signals) == 9
    expected = np.zeros((2, 6 * len(LOADS)))
    expected[:, 2::6] = [*LOADS.values()]
    assert inputs.wrenches(5, 2) == pytest.approx(expected, rel=1e-12)


def test_rows_between_samples_lie_on_the_line_through_them():
    samples = np.column_stack([1.5 + 0.25 * np.arange(9), -2.0 * np.arange(9)])
    half_steps = np.arange(30) / 4.0
    rows = StepGrid(1e-3, PERIOD).rows(samples, 30)
    assert rows == pytest.approx(np.column_stack([1.5 + 0.25 * half_steps, -2.0 * half_steps]), rel=1e-12)


def test_accelerometers_sit_where_the_scene_and_the_vehicle_say():
    signals = [signal_of(f"{at} az", "acceleration", at, "z", "body") for at in ("dash", "engine", "nowhere")]
    places = {"dash": TransducerPlace("body", (0.5, -0.25, 0.75))}
    points = accelerometer_points(CAR, signals, places)
    assert points == (
        AccelerometerPoint("dash", "body", (0.5, -0.25, 0.75)),
        AccelerometerPoint("engine", "engine", (0.95, 0.0, 0.55)),
    )


def test_behind_a_guide_of_a_car_acts_what_the_guided_body_bears():
    """All bodies ride on the chassis: 1 where the body, the hub or an element's end is the guided one, else 0."""
    last, behind = _guide_arrays(CAR, joint_table_of(CAR))
    coordinates = [body for body, _ in CAR.tree.coordinates()]
    guided = [body.name for body in CAR.uncut.bodies if body.name != "body"]
    heavy = [body.name for body in CAR.tree.bodies if body.mass > 0.0]
    ends = [end for e in CAR.elements for end in (e.first_body, e.second_body, e.frame)]
    assert last.tolist() == [len(coordinates) - 1 - coordinates[::-1].index(name) for name in guided]
    assert behind.tolist() == [[float(body == name) for body in (*heavy, *LOADS, *ends)] for name in guided]


def test_a_result_has_the_samples_and_the_counts_of_its_section_forces(tmp_path):
    force, travel = SectionChannel("a F", "N", "", "a"), SectionChannel("a travel", "m", "", "a")
    columns = SampleFile(tmp_path / "run.f64", ("a F", "a travel"), 4)
    columns.write(0, np.array([[3.5, 0.5], [-4.5, 0.25], [3.5, 0.5], [-4.5, 0.125]]))
    outcome = SectionOutcome(columns, (force, travel), 0.25, 3, np.nan, ())
    no_levels = np.empty(0)
    counted = CountedLoad({3.0: 8.5, 5.0: 32.25}, no_levels, no_levels, no_levels, no_levels, -4.5, 3.5, 0.75)
    scene = SimpleNamespace(title="t", file="", system="measured", table=dict, provenance=dict)
    result = labelled_result(scene, outcome, {force: counted}, tmp_path, engine="none", seconds=0.0, detail=None)
    assert result.times.tolist() == [0.0, 0.25, 0.5] and json.loads(result.data.attrs["columns_of"]) == [
        "a F",
        "a travel",
    ]
    assert result["a F"].tolist() == [3.5, -4.5, 3.5] and result["a travel"].tolist() == [0.5, 0.25, 0.5]
    figures = {name: result[name].tolist() for name in ("least", "greatest", "mean", "damage")}
    assert figures == {"least": [-4.5], "greatest": [3.5], "mean": [0.75], "damage": [[8.5, 32.25]]}
    assert result["rms"] == pytest.approx([np.sqrt((2 * 3.5**2 + 4.5**2) / 3)], rel=1e-12)
    assert outcome.samples(travel).tolist() == [0.5, 0.25, 0.5]


def test_a_stage_takes_the_seconds_since_the_stage_before(monkeypatch):
    monkeypatch.setattr(time, "perf_counter", lambda: 12.75)
    examination = SimpleNamespace(seconds={"reading": 0.5})
    _record_seconds(examination, "checks", 10.0)
    assert examination.seconds == {"reading": 0.5, "checks": 2.25}


def test_wheels_that_are_moved_press_their_springs_and_turn_their_bars():
    """The left front wheel is 10 mm up: along its spring, 4 degrees beside the vertical. Over its track the
    bar turns, and would push that wheel down, which counts as negative."""
    states = np.zeros((3, 2 * CAR.size))
    states[:, CAR.tree.coordinates().index(("fl", "z"))] = 0.01
    travels = element_travels(CAR, SimpleNamespace(times=1e-3 * np.arange(3), states=states))
    assert travels["front left"] == pytest.approx(np.full(3, 0.01 * np.cos(np.radians(4.0))), rel=1e-9)
    assert travels["front left bush"] == pytest.approx(np.full(3, -0.01 * np.sin(np.radians(4.0))), rel=1e-9)
    assert travels["front bar"] == pytest.approx(np.full(3, -0.01 / (2.0 * 0.69342)), rel=1e-9)
    assert np.abs(travels["rear left"]).max() == 0.0


VIRTUAL = {
    "duration": 0.02,
    "step": 1e-3,
    "sampling_rate": 500.0,
    "accelerometers": {"dash": [0.6, 0.4, 0.9]},
    "sections": ["left seat"],
    "travels": ["front left"],
}


def test_accelerometers_on_a_table_that_turns_and_speeds_up_feel_both_and_gravity():
    """Along x in the space by a t, heading w t: a in the body's axes, and w^2 inwards."""
    times, speedup, rate = 1e-2 * np.arange(41), 1.75, 0.5
    states, at = np.zeros((41, 2 * CAR.size)), CAR.size
    states[:, 0], states[:, at] = speedup * times**2 / 2.0, speedup * times
    states[:, 3], states[:, at + 3] = rate * times, rate
    motion = _chassis_motion(CAR, SimpleNamespace(times=times, states=states), VIRTUAL["accelerometers"])
    arm = np.array([0.6, 0.4, 0.9]) - np.array(CAR.tree.body("body").position)
    expected = np.column_stack(
        [
            speedup * np.cos(rate * times) - rate**2 * arm[0],
            -speedup * np.sin(rate * times) - rate**2 * arm[1],
            np.full(41, GRAVITY),
        ]
    )
    assert motion[:, :5] == pytest.approx(np.tile([0.0, 0.0, 0.0, 0.0, rate], (41, 1)), abs=1e-12)
    assert motion[:, 5:] == pytest.approx(expected, abs=1e-9)


def test_channels_of_a_virtual_measurement_have_the_units_of_a_test_track():
    degree = np.pi / 180.0
    factors = {signal.name: signal.factor for signal in checked_signals(CAR, read(VirtualTable, VIRTUAL, ""))}
    named = {"fl_fz": 1e3, "rr_mx": 1.0, "roll": degree, "yaw_rate": degree, "dash_az": 1.0}
    assert {name: factors[name] for name in named} == named
    assert (factors["left seat_force"], factors["front left_travel"]) == (1e3, 1e-3)
    assert len(factors) == 6 * len(LOADS) + 2 + 3 + 3 + 2


def test_samples_are_written_in_the_units_of_their_file():
    signals = (replace(signal_of("a"), factor=1e3), replace(signal_of("b"), factor=0.5))
    group = channel_group(signals, np.array([[1500.0, 0.25], [-500.0, 0.75]]), 0.125)
    assert (group.period, group.count) == (0.125, 2)
    assert np.vstack([*group.blocks]).tolist() == [[1.5, 0.5], [-0.5, 1.5]]


def test_a_virtual_measurement_begins_at_rest_with_the_weight_on_its_wheels():
    virtual = virtual_measurement(CAR, read(VirtualTable, VIRTUAL, ""), "reference")
    first = dict(zip((signal.name for signal in virtual.signals), virtual.values[0], strict=True))
    assert {hub: first[f"{hub}_fz"] for hub in LOADS} == pytest.approx(LOADS, rel=1e-9)
    assert first["left seat_force"] == pytest.approx(60.0 * GRAVITY, rel=1e-9)
    assert first["dash_az"] == pytest.approx(GRAVITY, abs=1e-3)  # the road begins gently
    assert (virtual.step, virtual.period, virtual.stride, virtual.errors) == (1e-3, PERIOD, 2, {})
    assert virtual.samples(SimulatedFaults(), 1).tolist() == virtual.values[::2].tolist()
