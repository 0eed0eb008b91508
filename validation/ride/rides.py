"""Ride vehicles and roads that cases and tests share: the paper's road, quarter-car vehicles, asymmetric vehicles.

Quarter-car matrices are written by hand. An asymmetric twin has every mass, spring, damper and tyre of a vehicle
changed by its own share, reproducibly: a symmetric vehicle hides a swap of left and right, and one with alike axles a
swap of front and rear.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from models.ride.closed_forms import QuarterCar
from models.road.excitation import RoadExcitation
from models.road.two_track import (
    CORRELATION_CASES,
    TRACK_DENSITY_LEVEL,
    TwoTrackRoad,
    half_track,
    road_excitation,
    road_of_level,
    wheels_on_track,
)
from models.vehicles.linear_vehicle import LinearOutput, LinearVehicle, WheelPosition
from models.vehicles.spatial import SpatialVehicle

ROAD_INTENSITY = 1e-4
"""White-noise intensity of the road of one track, m^2 per m."""
R19_FREQUENCIES = (
    1.357622,
    1.47076,
    2.152076,
    2.738235,
    2.89083,
    5.917883,
    6.426765,
    9.707712,
    10.419969,
    10.434258,
    11.280234,
    11.401383,
    11.656264,
    12.007752,
    12.667486,
    15.478222,
    15.487798,
    15.526984,
    15.535278,
)
"""Natural frequencies |lambda| / 2 pi (Hz) of the vehicle R19-ride, published with its data."""
STANDARD_WEIGHTINGS = (
    (0.5, 418, 853),
    (0.63, 459, 944),
    (0.8, 477, 992),
    (1.0, 482, 1011),
    (1.25, 484, 1008),
    (1.6, 494, 968),
    (2.0, 531, 890),
    (2.5, 631, 776),
    (3.15, 804, 642),
    (4.0, 967, 512),
    (5.0, 1039, 409),
    (6.3, 1054, 323),
    (8.0, 1036, 253),
    (10.0, 988, 212),
    (12.5, 902, 161),
    (16.0, 768, 125),
    (20.0, 636, 100),
    (25.0, 513, 80.0),
    (31.5, 405, 63.2),
    (40.0, 314, 49.4),
    (50.0, 246, 38.8),
    (63.0, 186, 29.5),
    (80.0, 132, 21.1),
)
"""ISO 2631-1:1997, Table 3, from two copies of it in print: Hz, 1000 Wk, 1000 Wd. The standard itself was not read."""


def largest_relative_error(computed_values: ArrayLike, expected_values: ArrayLike) -> float:
    """Largest relative error of computed values (n,) against expected ones (n,)."""
    return float(np.abs(np.asarray(computed_values) / np.asarray(expected_values) - 1.0).max())


def one_track(axle_positions: tuple[float, ...], corner_wavenumber: float = 0.0) -> RoadExcitation:
    """Road of a single track under axles at ``axle_positions`` (m); its height z over the distance obeys
    z' = -corner_wavenumber z + w with white noise w; corner_wavenumber in 1/m.
    """
    heights = tuple(np.eye(len(axle_positions))[:, [i]] for i in range(len(axle_positions)))
    filter_ = np.array([[-corner_wavenumber]]), np.array([[ROAD_INTENSITY**0.5]])
    return RoadExcitation(*filter_, heights, tuple(axle_positions[0] - x for x in axle_positions))


def paper_road(
    wheel_positions: Sequence[WheelPosition],
    *correlation_words: str,
    level_factor: float = TRACK_DENSITY_LEVEL,
    cutoff_wavenumber: float | None = None,
) -> RoadExcitation:
    """The paper's road of two tracks under wheels, with the named kinds of correlation; one track for wheels without a
    track width."""
    y = half_track(wheel_positions)
    placed = wheel_positions if y else wheels_on_track(wheel_positions, 1.0)
    return road_excitation(
        road_of_level(y or 1.0, level_factor, cutoff_wavenumber=cutoff_wavenumber), placed, *correlation_words
    )


def five_correlation_cases(
    wheel_positions: Sequence[WheelPosition], given_road: TwoTrackRoad | None = None
) -> dict[str, RoadExcitation]:
    """The paper's road, or a given road, in the paper's five cases of correlation, by the number of the case."""
    given_road = given_road or road_of_level(half_track(wheel_positions))
    return {
        str(number): road_excitation(given_road, wheel_positions, *case) for number, case in CORRELATION_CASES.items()
    }


def quarter_car_vehicle(
    quarter_cars_at_axles: Sequence[tuple[float, QuarterCar]],
    body_mass_matrix: np.ndarray | None = None,
    tyre_damping: float = 0.0,
) -> LinearVehicle:
    """Linear vehicle of a body on quarter-car corners (x in m, quarter car), one per axle; ``body_mass_matrix`` is the
    body's mass matrix in heave, or in heave and pitch.

    tyre_damping in N s/m. Outputs: body acceleration; travel, tyre deflection, body height; load and acceleration of
    the first wheel.
    """
    body = np.array([[quarter_cars_at_axles[0][1].m_s]]) if body_mass_matrix is None else body_mass_matrix
    b, w = len(body), len(quarter_cars_at_axles)
    n = b + w
    M = np.diag([*np.diag(body), *(corner.m_u for _, corner in quarter_cars_at_axles)])
    D, K, R, S = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, w)), np.zeros((n, w))
    for i, (x, corner) in enumerate(quarter_cars_at_axles):
        travel = np.array([*[1.0, -x][:b], *(-np.eye(w)[i])])
        K += corner.k * np.outer(travel, travel)
        D += corner.c * np.outer(travel, travel)
        K[b + i, b + i] += corner.k_t
        D[b + i, b + i] += tyre_damping
        R[b + i, i], S[b + i, i] = corner.k_t, tyre_damping
    unit, no, no_heights, first = np.eye(n), np.zeros(n), np.zeros(w), np.eye(w)[0]
    k_t, c_t = R[b, 0], S[b, 0]
    outputs = (
        LinearOutput("body", "m/s2", "acceleration", unit[0], no, no, no_heights, no_heights),
        LinearOutput("travel", "m", "travel", no, no, unit[0] - unit[b], no_heights, no_heights),
        LinearOutput("tyre", "m", "deflection", no, no, unit[b], -first, no_heights),
        LinearOutput("height", "m", "displacement", no, no, unit[0], no_heights, no_heights),
        LinearOutput("load", "N", "force", no, -c_t * unit[b], -k_t * unit[b], k_t * first, c_t * first),
        LinearOutput("wheel", "m/s2", "acceleration", unit[b], no, no, no_heights, no_heights),
    )
    wheels = tuple(WheelPosition(f"wheel {i}", x, 0.0, i) for i, (x, _) in enumerate(quarter_cars_at_axles))
    return LinearVehicle(M, D, K, R, S, tuple(("body", str(i)) for i in range(n)), wheels, outputs)


LARGEST_CHANGE = 0.2
"""Largest relative change of a parameter in an asymmetric twin."""


def changed_vehicle(vehicle: SpatialVehicle, seed: int) -> SpatialVehicle:
    """Asymmetric twin: the vehicle with each mass, stiffness and damping randomly changed by up to LARGEST_CHANGE."""
    rng = np.random.default_rng(seed)

    def changed_value(parameter_value: float) -> float:
        return parameter_value * (1 + LARGEST_CHANGE * rng.uniform(-1, 1))

    bodies = []
    for body in vehicle.bodies:
        factor = changed_value(1.0)
        inertia = tuple(tuple(factor * entry for entry in row) for row in body.inertia)
        bodies.append(replace(body, mass=factor * body.mass, inertia=inertia))  # type: ignore[arg-type]
    return replace(
        vehicle,
        name=f"{vehicle.name}, asymmetric twin {seed}",
        bodies=tuple(bodies),
        springs=tuple(
            replace(s, stiffness=changed_value(s.stiffness), damping=changed_value(s.damping)) for s in vehicle.springs
        ),
        bars=tuple(replace(bar, stiffness=changed_value(bar.stiffness)) for bar in vehicle.bars),
        tyres=tuple(replace(tyre, stiffness=changed_value(tyre.stiffness)) for tyre in vehicle.tyres),
    )
