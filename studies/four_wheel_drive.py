"""A virtual measurement: the car on four rolling tyres, driven through turns to both sides, with sensor noise.

``python -m studies.four_wheel_drive FILE.csv`` writes it. It is what the studies of the car of two axles run on where
no measured drive is at hand; nothing in it comes from a measurement.
"""

import sys
from pathlib import Path

import numpy as np

from models.core.whole_files import write_whole
from models.systems.handling.run import SimulatedDrive
from models.systems.handling.run import run as run_handling
from models.systems.handling.scene import build

DURATION, SAMPLING_RATE, START_SPEED = 30.0, 50, 20.0
"""Duration (s), sampling rate (Hz), and initial speed (m/s)."""
NOISE_DEVIATIONS = {"yaw rate": 0.004, "lateral acceleration": 0.3, "side slip": 0.0008}
"""Standard deviations (rad/s, m/s^2, rad) of the white noise on every sample of the measured channels."""
RANDOM_SEED = 20
Knots = list[list[float]]


def random_controls() -> dict[str, Knots]:
    """Random steer angle (rad), drive and brake torque (N m), as lists of [time (s), value]."""
    random = np.random.default_rng(RANDOM_SEED)
    steer, drive, brake, time, side = [[0.5, 0.0]], [[0.5, 120.0]], [[0.5, 0.0]], 0.5, 1.0
    while time < DURATION - 4.0:
        angle = side * random.uniform(0.015, 0.055)
        rise, hold = random.uniform(0.4, 1.0), random.uniform(0.6, 2.0)
        steer += [[time + rise, angle], [time + rise + hold, angle], [time + 2.0 * rise + hold, 0.0]]
        pull, stop = random.uniform(150.0, 700.0), random.choice([0.0, 0.0, 400.0, 700.0])
        drive += [
            [time + rise, 250.0],
            [time + rise + hold, 250.0 if stop == 0.0 else 0.0],
            [time + 2.0 * rise + hold, pull],
        ]
        brake += [[time + rise, 0.0], [time + rise + 0.5 * hold, stop], [time + rise + hold, 0.0]]
        time, side = time + 2.0 * rise + hold + random.uniform(0.2, 0.8), side * random.choice([-1.0, -1.0, 1.0])
    return {"steer": steer, "drive": drive, "brake": brake}


def simulated_drive() -> SimulatedDrive:
    """The run with random steer, drive and brake inputs, computed in MuJoCo."""
    manoeuvre = {"speed": START_SPEED, "duration": DURATION, "front_brake": 0.6, **random_controls()}
    table = {"title": "a drive that is made", "system": "handling", "manoeuvres": {"drive": manoeuvre}}
    return run_handling(build(table), "mujoco").detail


def measured_columns(car_drive: SimulatedDrive) -> dict[str, tuple[str, np.ndarray]]:
    """Columns (unit, sampled values) of a run, as a logger in the car would write them: inputs, speed and noisy
    sensors."""
    stride = round(1.0 / (SAMPLING_RATE * float(car_drive.run.times[1] - car_drive.run.times[0])))
    forward_speed, lateral_speed, yaw = car_drive.velocity().T
    random = np.random.default_rng(RANDOM_SEED + 1)
    front = car_drive["steer"][:, 0]
    channels = {
        "yaw rate": ("rad/s", yaw),
        "lateral acceleration": ("m/s^2", car_drive.lateral_acceleration()),
        "side slip": ("rad", np.arctan2(lateral_speed, forward_speed)),
    }
    noisy = {
        name: (unit, values[::stride] + NOISE_DEVIATIONS[name] * random.standard_normal(len(values[::stride])))
        for name, (unit, values) in channels.items()
    }
    plain = {"time": ("s", car_drive.run.times), "steer": ("rad", front), "speed": ("m/s", forward_speed)}
    return {name: (unit, values[::stride]) for name, (unit, values) in plain.items()} | noisy


def save_virtual_measurement(output_path: Path) -> None:
    """Write the virtual measurement to a CSV file, with six digits."""
    columns = measured_columns(simulated_drive())
    head = ",".join(f"{name} [{unit}]" for name, (unit, _) in columns.items())
    rows = zip(*(values.tolist() for _, values in columns.values()), strict=True)
    write_whole(output_path, "\n".join([head, *(",".join(f"{value:.6g}" for value in row) for row in rows), ""]))


if __name__ == "__main__":
    save_virtual_measurement(Path(sys.argv[1]))
