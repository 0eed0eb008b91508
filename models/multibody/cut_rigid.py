"""The cut vehicle as one rigid body: what its drift follows when its springs have settled.

Forces and moments of white noise at the hubs turn the vehicle as a double integral, var = q t^3 / 3, with
q = period I^-1 C I^-1 of the covariance C of the moment samples about the common centre of mass. What turns by phi
carries body-fixed forces with it, but not gravity: the vehicle slides off by g times the tilt, a double integral of a
double integral, var = g^2 q t^7 / 252. Forces that are given in the space do not turn, and there is no such error;
but what carries the vehicle from below its centre of mass then topples it, as an upright pendulum, with the rates
sqrt(m g h / I) of roll and pitch, h the height of the centre above the hubs.
"""

from dataclasses import dataclass

import numpy as np

from models.vehicles.cut_vehicle import GRAVITY, CutVehicle


@dataclass(frozen=True)
class Rigid:
    """mass (kg), centre (3,) in the design position (m), inertia (3, 3) about it (kg m^2), arms (h, 3) of the hubs."""

    mass: float
    centre: np.ndarray
    inertia: np.ndarray
    arms: np.ndarray

    def moments(self, wrenches: np.ndarray) -> np.ndarray:
        """Moments (m, 3) about the centre, N m, of wrenches (m, 6 h) in the chassis' axes."""
        parts = wrenches.reshape(len(wrenches), -1, 6)
        return (np.cross(self.arms, parts[:, :, :3]) + parts[:, :, 3:]).sum(axis=1)

    def turning(self, deviation: np.ndarray) -> np.ndarray:
        """Covariance (3, 3) of the angular accelerations, rad^2/s^4, that samples of noise (6 h,), N and N m, make."""
        rows = self.moments(np.eye(len(deviation)))
        inverse = np.linalg.inv(self.inertia)
        return inverse @ (rows.T * deviation**2) @ rows @ inverse

    def toppling(self) -> np.ndarray:
        """Growth rates (2,) of roll and pitch, 1/s, under forces that keep their directions in the space."""
        loads = -self.arms[:, 2].mean() * self.mass * GRAVITY
        return np.sqrt(np.maximum(loads, 0.0) / np.diag(self.inertia)[:2])

    def angle_variance(self, deviation: np.ndarray, period: float, times: np.ndarray) -> np.ndarray:
        """Variances (m, 3) of roll, pitch, heading (rad^2) at times (m,) from rest."""
        return np.outer(times**3 / 3, period * np.diag(self.turning(deviation)))

    def position_variance(self, deviation: np.ndarray, period: float, times: np.ndarray, frame: str) -> np.ndarray:
        """Variances (m, 3) of x, y, z (m^2) at times (m,) from rest, forces in a frame."""
        force = period * (deviation.reshape(-1, 6)[:, :3] ** 2).sum(axis=0) / self.mass**2
        found = np.outer(times**3 / 3, force)
        if frame != "inertial":
            turning = period * np.diag(self.turning(deviation))
            found[:, :2] += GRAVITY**2 * np.outer(times**7 / 252, turning[[1, 0]])
        return found


def rigid(vehicle: CutVehicle) -> Rigid:
    """All bodies in the design position as one."""
    bodies = vehicle.whole.bodies
    mass = sum(body.mass for body in bodies)
    centre = np.array([body.mass * np.array(body.position) for body in bodies]).sum(axis=0) / mass
    inertia = np.zeros((3, 3))
    for body in bodies:
        arm = np.subtract(body.position, centre)
        inertia += np.array(body.inertia) + body.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return Rigid(mass, centre, inertia, np.array([tyre.point for tyre in vehicle.whole.tyres]) - centre)
