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

FOLLOWING_ENGINE = "mujoco"
SPEED_TOLERANCE = 0.002
"""Largest rms error of the speed, divided by the mean speed, at which the torques are accepted."""
LARGEST_ITERATION_COUNT = 8
"""Most runs in which the torques are corrected."""
LOW_PASS_FREQUENCY = 2.0
"""Cut-off frequency (Hz) of the measured speed, so that torques do not follow the sensor's noise."""


def controls_following_drive(
    handling_model: Handling, measured_drive: MeasuredDrive, time_step: float, measured_path: str
) -> Controls:
    """Compute steer angle, brake torque and drive torque over time with which the car follows a measured steer angle
    and speed.

    handling_model : the car, with the shares of its axles in braking and driving; time_step : time step (s);
    measured_path : name of the scene's file. Raises RunFailed where no torques give the measured speed, as on a road
    without friction.
    """
    period = float(measured_drive.times[1] - measured_drive.times[0])
    stride = round(period / time_step)
    speed = low_passed(
        measured_drive.speed[:, None], period, LOW_PASS_FREQUENCY, measured_path, "manoeuvres.NAME.measured"
    )[:, 0]
    mass, radius = sum(body.mass for body in handling_model.vehicle.bodies), handling_model.vehicle.tyres[0].point[2]
    force, resistance = mass * np.gradient(speed, period), 0.0
    for march in range(LARGEST_ITERATION_COUNT):
        controls = _with_torque(handling_model.controls, measured_drive, radius * force)
        run = drive_run(
            FOLLOWING_ENGINE,
            handling_model.changed(controls=controls),
            float(speed[0]),
            period * (len(speed) - 1),
            time_step,
        )
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
        FOLLOWING_ENGINE, f"no torque of the wheels gives the measured speed: it is off by up to {largest_miss:.3g} m/s"
    )


def _with_torque(controls: Controls, measured_drive: MeasuredDrive, wheel_torque: np.ndarray) -> Controls:
    """Returns the controls with the measured steer angle and a torque (n,) in N m of all wheels together, driving above
    0, braking below.
    """
    knot_times = measured_drive.times - measured_drive.times[0]

    def knots(knot_values: np.ndarray) -> Control:
        return tuple(zip(knot_times.tolist(), knot_values.tolist(), strict=True))

    return replace(
        controls,
        steer=knots(measured_drive.steer),
        brake=knots(np.maximum(-wheel_torque, 0.0)),
        drive=knots(np.maximum(wheel_torque, 0.0)),
    )
