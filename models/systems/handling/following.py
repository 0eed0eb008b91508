"""The driver's torques along a measured drive: those with which the car keeps to the speed that was measured.

The first torques move the car's mass alone. A march then shows what speed they give, and what is missing changes them:
by m e' + c e, with e the missing speed and c the resistance (N s/m) that the first march shows. The march is the run's,
in MuJoCo, so what is found holds to rounding in Exudyn too.
"""

from dataclasses import replace

import numpy as np

from models.core.errors import RunFailed
from models.core.smoothing import low_passed
from models.measured.drive import MeasuredDrive
from models.multibody.numbers import Control, Controls, Handling
from models.systems.handling.run import drive_run

ENGINE = "mujoco"
SPEED_TOLERANCE = 0.002
"""Rms error of the speed by its mean, with which torques will do."""
MOST_MARCHES = 8
LOW_PASS = 2.0
"""Hz: torques follow no faster change of the speed, which would be the sensor's noise."""


def controls_along(handling: Handling, drive: MeasuredDrive, step: float, file: str) -> Controls:
    """Steering, brakes and drive that move the car along a measured steer angle and speed.

    handling : the car, with the shares of its axles in braking and driving; step : s, of the march; file : of the
    scene. Raises RunFailed where no torques of this kind give the measured speed, as on a road without friction.
    """
    period = float(drive.times[1] - drive.times[0])
    stride = round(period / step)
    speed = low_passed(drive.speed[:, None], period, LOW_PASS, file, "manoeuvres.NAME.measured")[:, 0]
    mass, radius = sum(body.mass for body in handling.vehicle.bodies), handling.vehicle.tyres[0].point[2]
    force, resistance = mass * np.gradient(speed, period), 0.0
    for march in range(MOST_MARCHES):
        controls = _with_torque(handling.controls, drive, radius * force)
        run = drive_run(ENGINE, handling.changed(controls=controls), float(speed[0]), period * (len(speed) - 1), step)
        reached = run.velocity()[::stride, 0]
        missing = speed - reached
        if np.sqrt(np.mean(missing**2)) <= SPEED_TOLERANCE * speed.mean():
            return controls
        if march == 0:
            lost = force - mass * np.gradient(reached, period)
            resistance = float(lost @ reached / (reached @ reached))
        force = force + mass * np.gradient(missing, period) + resistance * missing
    largest_miss = float(np.abs(missing).max())
    raise RunFailed(
        ENGINE, f"no torque of the wheels gives the measured speed: it is off by up to {largest_miss:.3g} m/s"
    )


def _with_torque(controls: Controls, drive: MeasuredDrive, torque: np.ndarray) -> Controls:
    """Controls with the measured steer angle and a torque (n,) in N m of all wheels together."""
    knot_times = drive.times - drive.times[0]

    def knots(values: np.ndarray) -> Control:
        return tuple(zip(knot_times.tolist(), values.tolist(), strict=True))

    return replace(
        controls, steer=knots(drive.steer), brake=knots(np.maximum(-torque, 0.0)), drive=knots(np.maximum(torque, 0.0))
    )
