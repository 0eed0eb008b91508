"""The vehicle in time, the road in path: the form of a ride system in which nothing depends on the speed.

At speed v a road filter reads f' = v F f + sqrt(v) G w, and tyre damping lets the vehicle x see its rate as well:

    x' = A x + sum_i (R_i f_i + T_i f_i').

With y = x - sum_i T_i f_i the rate is gone, and with it the white noise and the speed:

    y' = A y + sum_i (R_i + A T_i) f_i,    f_i(t) = f(s(t) - L_i).

Only s(t) still knows how fast the vehicle drives. At standstill s stays, f stays, and y goes on to its rest.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from models.ride.delayed_system import DelayedSystem
from models.ride.excited import excited
from models.ride.weighting import weighted
from models.road.excitation import Excitation
from models.vehicles.linear_vehicle import LinearVehicle


@dataclass(frozen=True)
class RoadInPath:
    """y' = A y + sum_i inputs_i f_i, outputs (C + v rate) (y, f) beside white noise that the road may bring.

    A (n, n); inputs (n, a, m) over axles and filter states; ``basis`` turns (y, f) into the states of
    ``excited``, weightings included; C, rate (p, n + a m).
    """

    A: np.ndarray
    inputs: np.ndarray
    basis: np.ndarray
    C: np.ndarray
    rate: np.ndarray
    names: tuple[str, ...]
    excitation: Excitation


def road_in_path(
    vehicle: LinearVehicle, excitation: Excitation, weightings: Mapping[str, str] | None = None
) -> RoadInPath:
    """The form of a vehicle on a road, with weighted outputs as in ``weighted``; raises its errors.

    A system is linear in v (its noise in sqrt(v)), so two speeds tell all.
    """
    one, two = (at_speed(vehicle, excitation, v, weightings) for v in (1.0, 2.0))
    first, (m, axles) = 2 * len(vehicle.mass), (len(excitation.F), len(excitation.heights))
    road = np.arange(first, first + axles * m)
    rest = np.setdiff1d(np.arange(len(one.A)), road)
    steady, by_speed = 2.0 * one.A - two.A, two.A - one.A
    A = steady[np.ix_(rest, rest)]
    known = np.linalg.pinv(np.hstack([excitation.F, excitation.G]))
    T = np.hstack(
        [
            np.hstack([by_speed[np.ix_(rest, at)], B[rest]]) @ known
            for at, B in zip(road.reshape(axles, m), one.B, strict=True)
        ]
    )
    basis = np.zeros_like(one.A)
    basis[rest, : len(rest)], basis[road, len(rest) :] = np.eye(len(rest)), np.eye(len(road))
    basis[np.ix_(rest, np.arange(len(rest), len(basis)))] = T
    inputs = steady[np.ix_(rest, road)] + A @ T
    return RoadInPath(
        A,
        inputs.reshape(-1, axles, m),
        basis,
        (2.0 * one.C - two.C) @ basis,
        (two.C - one.C) @ basis,
        one.names,
        excitation,
    )


def at_speed(
    vehicle: LinearVehicle, excitation: Excitation, speed: float, weightings: Mapping[str, str] | None = None
) -> DelayedSystem:
    """The system at a constant speed (m/s, above 0)."""
    return weighted(excited(vehicle, excitation, speed), weightings or {})
