"""Wheel torques with which the car follows the speed of a measured drive.

The first torques accelerate the car's mass alone. A run in MuJoCo then gives the speed that they lead to. The force is
corrected by m e' + c e, with e the missing speed and c the resistance (N s/m) that the first run shows. As both engines
agree to rounding, the torques suit Exudyn, too.
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
"""Largest rms error of the speed, divided by the mean speed, at which the torques are accepted."""
MOST_MARCHES = 8
"""Most runs in which the torques are corrected."""
LOW_PASS = 2.0
"""Cut-off frequency (Hz) of the measured speed, so that torques do not follow the sensor's noise."""


def controls_along(handling: Handling, drive: MeasuredDrive, step: float, file: str) -> Controls:
    """Compute steer angle, brake torque and drive torque over time with which the car follows a measured steer angle
    and speed.

    handling : the car, with the shares of its axles in braking and driving; step : time step (s); file : name of the
    scene's file. Raises RunFailed where no torques give the measured speed, as on a road without friction.
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
    """Returns the controls with the measured steer angle and a torque (n,) in N m of all wheels together, driving above
    0, braking below.
    """
    knot_times = drive.times - drive.times[0]

    def knots(values: np.ndarray) -> Control:
        return tuple(zip(knot_times.tolist(), values.tolist(), strict=True))

    return replace(
        controls, steer=knots(drive.steer), brake=knots(np.maximum(-torque, 0.0)), drive=knots(np.maximum(torque, 0.0))
    )
