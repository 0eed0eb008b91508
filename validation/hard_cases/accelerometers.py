"""Hard cases of accelerometers on the chassis: sensors in a plane, loose mounts, missing readings, vertical
attitudes."""

from pathlib import Path
from typing import Any

import numpy as np

from models.core.signals import SampledSignal
from models.engines.protocol import build
from models.sensors.rigid_body_motion import (
    BodyStartState,
    angular_acceleration,
    body_rotation_from_readings,
    fit_quality,
    recovered_motion,
)
from models.sensors.rotations import quaternion_from_cardan, rotation_matrix
from models.sensors.sensor_array import sensor_array
from models.systems.pitch_plane.effects.accelerometers import readings_of
from models.systems.pitch_plane.run import run as simulate
from validation.hard_cases.case import HardCase
from validation.hard_cases.setups import (
    REFUSED,
    driven_by_forces,
    largest_magnitude,
    root_mean_square,
    run_settings,
    vehicle,
)

SAMPLE_PERIOD, NOISE = 1e-3, 0.1
FLOOR_SENSORS = {
    "fl": (1.1, -0.6, 0.2),
    "fr": (1.1, 0.6, 0.2),
    "rl": (-0.9, -0.6, 0.2),
    "rr": (-0.9, 0.6, 0.2),
    "mid": (0.1, 0.0, 0.2),
}
LIFTED_SENSORS = FLOOR_SENSORS | {"mid": (0.1, 0.0, 0.17)}
ROOF_SENSORS = FLOOR_SENSORS | {"mid": (0.1, 0.0, -0.8)}
BRACKET_SENSORS = {"battery": {"x": 0.6, "y": 0.3, "z": 0.0, "bracket": {"frequency": 30.0, "damping": 0.05}}}


def _readings_of_run(
    engine_name: str,
    sensor_positions: dict[str, Any],
    extra_effects: dict[str, Any] | None = None,
    noise: float = 0.0,
    start_state: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Accelerometer readings (n, sensors, 3) in m/s^2, states (n, 8) and pitch accelerations (n,) in rad/s^2 of a run
    of 0.3 s.

    After a kick on a flat road, or in free fall from an initial state.
    """
    sensors = {name: dict(zip("xyz", position, strict=True)) for name, position in sensor_positions.items()} | (
        extra_effects or {}
    )
    start = vehicle().initial + np.array([0, 0, 0, 0, 0, 0, 0.5, 1.5])
    base = vehicle(
        start_state=start if start_state is None else start_state,
        effects={"accelerometers": {"sampling_rate": 1 / SAMPLE_PERIOD, "sensors": sensors, "deviation": noise}},
    )
    assembly = (
        base
        if start_state is None
        else driven_by_forces(base, SampledSignal(np.zeros((400, 2)), SAMPLE_PERIOD, held=True))
    )
    engine_settings = run_settings(engine_name, SAMPLE_PERIOD, 0.3)
    model = build(engine_name, assembly, engine_settings)
    run = simulate(assembly.scene, engine_name, engine_settings, assembly)
    felt = readings_of(run, assembly.scene.effects["accelerometers"])
    true = np.array([model.acceleration(t, *np.split(y, 2))[3] for t, y in zip(run.times, run.states, strict=True)])
    return felt, run.states, true


def _angular_velocities(states: np.ndarray) -> np.ndarray:
    """Angular velocities (n, 3) in rad/s, in body axes, of a vehicle that only pitches."""
    return states[:, 7:] * [0.0, 1.0, 0.0]


def _pitch_acceleration(sensor_positions: dict[str, Any], specific_forces: np.ndarray) -> np.ndarray:
    """Pitch acceleration (n,) in rad/s^2 by the paper's eq. (18) as printed, by numpy's pseudo-inverse without any
    checks."""
    positions = np.array(list(sensor_positions.values()))
    relative = np.swapaxes(specific_forces - specific_forces[:, -1:], 1, 2)[:, :, :-1]
    m = relative @ np.linalg.pinv((positions[:-1] - positions[-1]).T)
    return 0.5 * (m[:, 0, 2] - m[:, 2, 0])


def flat_floor_error(engine_name: str, work_folder: Path) -> float:
    """Case: all sensors lie on a flat floor, and the pitch axis lies in their plane. Error: that of the pitch
    acceleration, divided by its largest value."""
    felt, states, true = _readings_of_run(engine_name, FLOOR_SENSORS)
    computed = angular_acceleration(
        body_rotation_from_readings(sensor_array(FLOOR_SENSORS), felt), _angular_velocities(states)
    )[:, 1]
    return largest_magnitude(computed - true) / largest_magnitude(true)


def flat_floor_naive_result(work_folder: Path) -> str:
    """Result of the printed formula on the readings of sensors on a flat floor, as text."""
    felt, _, true = _readings_of_run("reference", FLOOR_SENSORS)
    ratio = root_mean_square(_pitch_acceleration(FLOOR_SENSORS, felt)) / root_mean_square(true)
    return f"the printed formula gives {ratio:.2f} of the pitch acceleration"


def nearly_flat_floor_error(engine_name: str, work_folder: Path) -> float:
    """Case: noisy sensors, the fifth only 3 cm above the plane of the others. Error: rms error of the pitch
    acceleration divided by the smallest that this noise can cause."""
    felt, states, true = _readings_of_run(engine_name, LIFTED_SENSORS, noise=NOISE)
    array = sensor_array(LIFTED_SENSORS)
    computed = angular_acceleration(body_rotation_from_readings(array, felt), _angular_velocities(states))[:, 1]
    least_gain = array.noise_gains(with_plane_formula=True)[1]
    return root_mean_square(computed - true) / (NOISE * least_gain)


def nearly_flat_floor_naive_result(work_folder: Path) -> str:
    """Result of the printed formula on the readings of sensors nearly in a plane, as text."""
    felt, _, true = _readings_of_run("reference", LIFTED_SENSORS, noise=NOISE)
    error = root_mean_square(_pitch_acceleration(LIFTED_SENSORS, felt) - true)
    return f"the printed formula errs by {error:.1f} rad/s^2 for {NOISE:g} m/s^2 of noise"


def loose_bracket_error(engine_name: str, work_folder: Path) -> float:
    """Case: five rigid sensors and a sixth on a flexible bracket, which must be left out. Error: that of the pitch
    acceleration, divided by its largest value."""
    felt, states, true = _readings_of_run(engine_name, ROOF_SENSORS, BRACKET_SENSORS)
    sensor_positions = ROOF_SENSORS | {"battery": (0.6, 0.3, 0.0)}
    loose = fit_quality(sensor_array(sensor_positions), felt).suspect_sensor
    keep = [name != loose for name in sensor_positions]
    rigid_array = sensor_array({name: position for name, position in sensor_positions.items() if name != loose})
    computed = angular_acceleration(
        body_rotation_from_readings(rigid_array, felt[:, keep]), _angular_velocities(states)
    )[:, 1]
    return largest_magnitude(computed - true) / largest_magnitude(true)


def loose_bracket_naive_result(work_folder: Path) -> str:
    """Result without the guard, as text: the printed formula with all six sensors."""
    felt, _, true = _readings_of_run("reference", ROOF_SENSORS, BRACKET_SENSORS)
    wrong = largest_magnitude(
        _pitch_acceleration(ROOF_SENSORS | {"battery": (0.6, 0.3, 0.0)}, felt) - true
    ) / largest_magnitude(true)
    return f"all six together are wrong by {100 * wrong:.0f} % of the largest pitch acceleration"


def missing_reading_error(engine_name: str, work_folder: Path) -> float:
    """Case: one reading is NaN, which must be refused. Error: largest error of the recovered rates (rad/s)."""
    felt, states, _ = _readings_of_run(engine_name, ROOF_SENSORS)
    felt[100, 2, 0] = np.nan
    return largest_magnitude(
        recovered_motion(sensor_array(ROOF_SENSORS), felt, SAMPLE_PERIOD).rates - _angular_velocities(states)
    )


def missing_reading_naive_result(work_folder: Path) -> str:
    """Result without the guard, as text: share of the record for which a sum over the printed formula's values is lost
    by one NaN."""
    felt, _, _ = _readings_of_run("reference", ROOF_SENSORS)
    felt[100, 2, 0] = np.nan
    lost = np.isnan(np.cumsum(_pitch_acceleration(ROOF_SENSORS, felt))).mean()
    return f"a sum over one missing reading is lost for {100 * lost:.0f} % of the record"


def _readings_in_free_fall(
    engine_name: str, pitch: float, pitch_rate: float
) -> tuple[np.ndarray, np.ndarray, BodyStartState]:
    """Accelerometer readings, states and initial state of a rotating vehicle in free fall with unstressed struts."""
    p, sine, speed = vehicle().parameters, np.sin(pitch), np.cos(pitch) * pitch_rate
    start = np.array([-p.b * sine, p.a * sine, 0, pitch, -p.b * speed, p.a * speed, 0, pitch_rate])
    felt, states, _ = _readings_of_run(engine_name, ROOF_SENSORS, start_state=start)
    return felt, states, BodyStartState.pitched(pitch, pitch_rate)


def vertical_nose_error(engine_name: str, work_folder: Path) -> float:
    """Case: the nose passes through the vertical. Error: largest difference of an entry of the rotation matrix."""
    felt, states, start = _readings_in_free_fall(engine_name, 1.4, 3.0)
    orientation = recovered_motion(sensor_array(ROOF_SENSORS), felt, SAMPLE_PERIOD, start).orientation
    no_angles = np.zeros(len(states))
    return largest_magnitude(
        rotation_matrix(orientation) - rotation_matrix(quaternion_from_cardan(no_angles, states[:, 3], no_angles))
    )


def gimbal_lock_error(engine_name: str, work_folder: Path) -> float:
    """Case: the nose points straight up, where roll and yaw are not unique; it must be refused. Error: largest roll or
    yaw (rad) that is returned."""
    felt, _, start = _readings_in_free_fall(engine_name, np.pi / 2, 0.0)
    return largest_magnitude(
        recovered_motion(sensor_array(ROOF_SENSORS), felt, SAMPLE_PERIOD, start).angles()[:, [0, 2]]
    )


def gimbal_lock_naive_result(work_folder: Path) -> str:
    """Result without the guard, as text: roll angle by the textbook's formula at gimbal lock."""
    s = rotation_matrix(quaternion_from_cardan(0.3, np.pi / 2, 0.0))
    roll = np.arctan2(s[2, 1], s[2, 2])
    return f"the textbook's formula gives a roll of {roll:.2f} rad for 0.30, out of rounding errors"


CASES = (
    HardCase(
        "accelerometers in a plane",
        "sensors on a flat floor do not see half of the pitch acceleration",
        "the engine's own pitch acceleration",
        "of its largest",
        1e-12,
        "the formula for a plane is exact: rounding only",
        flat_floor_error,
        {},
        flat_floor_naive_result,
    ),
    HardCase(
        "accelerometers nearly in a plane",
        "one sensor 3 cm off the plane makes the formula solvable and its noise 22 times larger",
        "noise of the pitch acceleration against that of the formula for a plane",
        "of that noise",
        1.2,
        "300 samples: 4 % standard error",
        nearly_flat_floor_error,
        {},
        nearly_flat_floor_naive_result,
    ),
    HardCase(
        "accelerometer on a bracket",
        "one of six sensors moves on its own",
        "the engine's own pitch acceleration, once the loose sensor is found and left out",
        "of its largest",
        1e-12,
        "five rigid sensors: rounding only",
        loose_bracket_error,
        {},
        loose_bracket_naive_result,
    ),
    HardCase(
        "accelerometer reading that is no number",
        "one missing reading spreads over the whole record by integration",
        "refused with sensor and sample",
        "",
        0.0,
        "no answer is wanted",
        missing_reading_error,
        REFUSED,
        missing_reading_naive_result,
    ),
    HardCase(
        "attitude through the vertical",
        "Cardan angles are singular where the nose points straight up",
        "orientation of a tumbling vehicle",
        "",
        1e-6,
        "quaternions pass; order 4 at 1 ms, across wheel modes of 700 1/s",
        vertical_nose_error,
    ),
    HardCase(
        "Cardan angles at gimbal lock",
        "roll and yaw turn about the same axis",
        "refused with the sample and its pitch",
        "",
        0.0,
        "no answer is wanted",
        gimbal_lock_error,
        REFUSED,
        gimbal_lock_naive_result,
    ),
)
