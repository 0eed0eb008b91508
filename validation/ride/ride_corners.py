"""Quarter cars, alone or under one body: the vehicles of the closed forms, written down by hand."""

from collections.abc import Sequence

import numpy as np

from models.ride.closed_forms import QuarterCar
from models.vehicles.linear_vehicle import LinearVehicle, Output, Wheel


def corners(
    places: Sequence[tuple[float, QuarterCar]], mass: np.ndarray | None = None, tyre_damping: float = 0.0
) -> LinearVehicle:
    """Corners (x in m, quarter car), one per axle, under a body with the mass matrix of z or of z and pitch.

    tyre_damping in N s/m. Outputs: body acceleration; travel, tyre deflection, body height; load and acceleration of
    the first wheel.
    """
    body = np.array([[places[0][1].m_s]]) if mass is None else mass
    b, w = len(body), len(places)
    n = b + w
    M = np.diag([*np.diag(body), *(corner.m_u for _, corner in places)])
    D, K, R, S = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, w)), np.zeros((n, w))
    for i, (x, corner) in enumerate(places):
        travel = np.array([*[1.0, -x][:b], *(-np.eye(w)[i])])
        K += corner.k * np.outer(travel, travel)
        D += corner.c * np.outer(travel, travel)
        K[b + i, b + i] += corner.k_t
        D[b + i, b + i] += tyre_damping
        R[b + i, i], S[b + i, i] = corner.k_t, tyre_damping
    unit, no, none, first = np.eye(n), np.zeros(n), np.zeros(w), np.eye(w)[0]
    k_t, c_t = R[b, 0], S[b, 0]
    outputs = (
        Output("body", "m/s2", "acceleration", unit[0], no, no, none, none),
        Output("travel", "m", "travel", no, no, unit[0] - unit[b], none, none),
        Output("tyre", "m", "deflection", no, no, unit[b], -first, none),
        Output("height", "m", "displacement", no, no, unit[0], none, none),
        Output("load", "N", "force", no, -c_t * unit[b], -k_t * unit[b], k_t * first, c_t * first),
        Output("wheel", "m/s2", "acceleration", unit[b], no, no, none, none),
    )
    wheels = tuple(Wheel(f"wheel {i}", x, 0.0, i) for i, (x, _) in enumerate(places))
    return LinearVehicle(M, D, K, R, S, tuple(("body", str(i)) for i in range(n)), wheels, outputs)
