"""A Kalman filter of roll and pitch beside the cut vehicle: measured angles and rates, and the measured hub forces.

filterpy's ``KalmanFilter``. State: roll, pitch and their rates. The hub forces turn the rigid vehicle; that its springs
give is noise of the acceleration, ``model`` (rad/s^2). Products of rates are neglected, and so is the difference of
angles and turns about the body's axes, as is right for tilts of a few degrees.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from filterpy.kalman import KalmanFilter

from models.errors import InputError
from models.hub_forces.cut_vehicle import CutVehicle
from models.hub_forces.measurement import Angles, HubForces
from models.hub_forces.rigid import rigid
from models.hub_forces.table import Drive
from models.signals import Sampled, Smooth

SURPRISE = 4.0
"""Largest mean of the normalised innovation squared, per measured value: errors twice as large as stated."""

UNEXPLAINED = 0.65
"""Largest part of the measured rates that the hub forces do not explain. The rigid vehicle leaves 0.3 to 0.45 of them
on rough roads, for its springs give; forces in another frame than stated leave 0.8, exchanged hubs 2 and more."""
REMEDY = "check signs, units, order of the hubs and frame, or state larger deviations"


@dataclass(frozen=True)
class Tilt:
    """Estimated roll, pitch and rates (m, 4), their standard deviations, and the mean of the normalised innovation
    squared per measured value: 1 where the stated deviations are right."""

    states: np.ndarray
    deviations: np.ndarray
    period: float
    surprise: float


def estimate(vehicle: CutVehicle, forces: HubForces, angles: Angles, force_deviation: np.ndarray,
             angle_deviations: tuple[float, float], model: float, file: str = "") -> Tilt:  # fmt: skip
    """Filter angles sampled with the forces.

    force_deviation : (6 h,), N and N m, of each sample; angle_deviations : rad and rad/s; model : rad/s^2.
    Raises InputError where measurement and forces contradict one another.
    """
    own, dt = rigid(vehicle), forces.period
    inverse = np.linalg.inv(own.inertia)[:2]
    noise = own.turning(force_deviation)[:2, :2] + model**2 * np.eye(2)
    push = np.vstack([np.eye(2) * dt**2 / 2, np.eye(2) * dt])
    kalman = KalmanFilter(dim_x=4, dim_z=4, dim_u=2)
    kalman.F, kalman.B = np.eye(4) + dt * np.eye(4, k=2), push
    kalman.H, kalman.Q = np.eye(4), push @ noise @ push.T
    kalman.R = np.diag(np.repeat(angle_deviations, 2)) ** 2
    kalman.x, kalman.P = angles.samples[0][:, None].copy(), kalman.R.copy()
    wrenches = _level(forces.samples, angles.samples) if forces.frame == "inertial" else forces.samples
    turning = own.moments(wrenches) @ inverse.T
    _check_balance(turning, angles, noise - model**2 * np.eye(2), angle_deviations[1], file)
    states, spread, surprise = np.empty((len(angles.samples), 4)), np.empty((len(angles.samples), 4)), 0.0
    for i, measured in enumerate(angles.samples):
        if i:
            kalman.predict(u=turning[i - 1][:, None])
            kalman.update(measured)
            surprise += float(kalman.y[:, 0] @ kalman.SI @ kalman.y[:, 0])
        states[i], spread[i] = kalman.x[:, 0], np.sqrt(np.diag(kalman.P))
    found = Tilt(states, spread, dt, surprise / max(4 * (len(states) - 1), 1))
    if not found.surprise <= SURPRISE:
        raise InputError(file, "angles", None, "contradict the hub forces: the squares of the innovations are "
                         f"{found.surprise:.3g} times what the deviations allow (at most {SURPRISE:g}): {REMEDY}")
    return found


def _check_balance(turning: np.ndarray, angles: Angles, noise: np.ndarray, rate: float, file: str) -> None:
    """Refuse hub forces whose moments, integrated, are not the measured rates of roll and pitch.

    turning : (m, 2), rad/s^2; noise : (2, 2), covariance of what their noise adds; rate : rad/s, noise of the rates.
    """
    rates = angles.samples[:, 2:]
    integral = np.vstack((np.zeros(2), np.cumsum(turning[1:] + turning[:-1], axis=0) * angles.period / 2))
    lasting = angles.period * len(rates)
    allowed = rate**2 + np.diag(noise) * angles.period * lasting / 6
    share = np.sqrt(np.maximum(np.var(rates - integral, axis=0) - 9 * allowed, 0.0) / np.var(rates, axis=0))
    for name, found in zip(("roll", "pitch"), share, strict=True):
        if not found <= UNEXPLAINED:
            raise InputError(file, f"angles.{name}_rate", None, f"contradicts the hub forces: {found:.0%} of it is not "
                             f"the integral of their moment (at most {UNEXPLAINED:.0%}): {REMEDY}")


def _level(wrenches: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Wrenches (m, 6 h) of the space in axes that roll and pitch by angles (m, 2 and more), rad."""
    (sr, sp), (cr, cp), zero = np.sin(angles[:, :2]).T, np.cos(angles[:, :2]).T, np.zeros(len(angles))
    turned = np.array([[cp, sp * sr, sp * cr], [zero, cr, -sr], [-sp, cp * sr, cp * cr]])
    return np.einsum("mhi,ijm->mhj", wrenches.reshape(len(wrenches), -1, 3), turned).reshape(wrenches.shape)


def pulled(drive: Drive, vehicle: CutVehicle, tilt: Tilt, step: float, bandwidth: float, ratio: float = 0.7) -> Drive:
    """The drive with moments towards the estimate: wc = 2 pi ``bandwidth`` (Hz), damping ``ratio``, rigid inertia."""
    rows, corner = len(drive.hubs), 2 * math.pi * bandwidth
    wanted = Sampled(tilt.states, tilt.period, held=False).sample(0.0, step / 2, rows)
    roll, pitch, _ = np.diag(rigid(vehicle).inertia)
    pull = (roll * corner**2, 2 * ratio * roll * corner, pitch * corner**2, 2 * ratio * pitch * corner)
    return replace(drive, guide=np.hstack([wanted, np.zeros((rows, 2))]), pull=pull)


def held(drive: Drive, angles: np.ndarray, period: float, step: float) -> Drive:
    """The drive with roll and pitch (m, 2), rad, enforced: a quintic spline through the samples."""
    motion = Smooth(angles, period, derivatives=2, degree=5)
    return replace(drive, guide=motion.sample(0.0, step / 2, len(drive.hubs)))
