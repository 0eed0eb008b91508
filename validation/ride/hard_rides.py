"""Vehicles and exact solutions for the hard cases of ride."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from scipy.linalg import expm

from models.core.scene_file import parse_toml
from models.ride.closed_forms import QuarterCar
from models.ride.covariance import stationary_covariance
from models.ride.excited import DelayedSystem, vehicle_with_road
from models.systems.ride.of_scene import linear_vehicle
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial import Body, PointOutput, SpatialVehicle, SpringDamper, TurnOutput, Tyre
from models.vehicles.vehicle_file import SHIPPED_FOLDER, build_vehicle, load_vehicle
from validation.ride.rides import ROAD_INTENSITY, largest_relative_error, one_track

SPEED = 20.0
QUARTER_CAR_NUMBERS = (300.0, 40.0, 2e4, 1500.0, 2e5)
"""Masses (kg) of body and wheel, spring stiffness (N/m), damping (N s/m) and tyre stiffness (N/m) of a quarter car."""
BODY_POSITION, BODY_AXIS = (0.0, 0.0, 1.0), (0.0, 0.0, 1.0)
"""Position (m) of a body with a single freedom, and the direction of its motion."""


def linear_equations(vehicle: SpatialVehicle, implementation: str, speed: float = SPEED) -> LinearVehicle:
    """Linear equations of a vehicle at a speed (m/s), by an implementation."""
    return linear_vehicle(vehicle, implementation)(speed)


def closed_form_error(
    corner: float = 0.3, speeds: tuple[float, ...] = (SPEED,), **quarter_car_parameters: float
) -> Callable[..., float]:
    """Hard case: a quarter car with some parameters changed. Returns its error function: the relative error of the
    variances of acceleration and travel against the closed form."""
    exact = replace(QuarterCar(*QUARTER_CAR_NUMBERS), **quarter_car_parameters)

    def error(implementation: str, work_folder: Path) -> float:
        worst, vehicle = 0.0, quarter_car(*vars(exact).values())
        for speed in speeds:
            covariance = stationary_covariance(
                vehicle_with_road(linear_equations(vehicle, implementation), one_track((0.0,), corner), speed)
            )
            q, w = ROAD_INTENSITY * speed, corner * speed
            worst = max(
                worst,
                largest_relative_error(
                    covariance.variance[:2],
                    [exact.body_acceleration_variance(q, w), exact.suspension_travel_variance(q, w)],
                ),
            )
        return worst

    return error


def quarter_car(
    sprung_mass: float,
    unsprung_mass: float,
    spring_stiffness: float,
    damping: float,
    tyre_stiffness: float,
    c_t: float = 0.0,
) -> SpatialVehicle:
    """A quarter car (kg, N/m, N s/m); outputs:
    acceleration of the body, suspension travel, and force of the tyre."""
    car = replace(load_vehicle("quarter_car"), name="quarter")
    bodies = tuple(replace(body, mass=m) for body, m in zip(car.bodies, (sprung_mass, unsprung_mass), strict=True))
    springs = (replace(car.springs[0], stiffness=spring_stiffness, damping=damping),)
    return replace(
        car, bodies=bodies, springs=springs, tyres=(replace(car.tyres[0], stiffness=tyre_stiffness, damping=c_t),)
    )


def single_body(mass: float, stiffness: float, damping: float) -> SpatialVehicle:
    """A body on a tyre with a damper to the ground (kg, N/m, N s/m); outputs: acceleration and height of the body."""
    outputs = tuple(
        PointOutput(kind, kind, "body", BODY_POSITION, BODY_AXIS) for kind in ("acceleration", "displacement")
    )
    damper = SpringDamper("damper", "body", None, BODY_POSITION, BODY_POSITION, BODY_AXIS, 0.0, damping)
    return SpatialVehicle(
        "single",
        (Body("body", mass, BODY_POSITION, ("z",)),),
        (damper,),
        (Tyre("tyre", "body", BODY_POSITION, 0, stiffness),),
        (0.0,),
        outputs=outputs,
    )


@cache
def roll_steered_vehicle() -> SpatialVehicle:
    """The vehicle R19-free with roll steer at the front axle; outputs: heading and lateral position."""
    table = parse_toml(SHIPPED_FOLDER / "r19_free.toml")
    table["axles"][0]["roll_steer"] = 0.05
    vehicle = build_vehicle(table, "steered")
    outputs = (
        TurnOutput("heading", "angle", "body", BODY_AXIS),
        PointOutput("place", "displacement", "body", vehicle.body("body").position, (0.0, 1.0, 0.0)),
    )
    return replace(vehicle, outputs=outputs)


def variances_after_hours(delayed_system: DelayedSystem) -> tuple[np.ndarray, np.ndarray]:
    """Variances (p,) of the outputs 1 and 2 hours after rest on independent axle inputs, by a van Loan discretisation
    over 3 ms that is doubled repeatedly."""
    n, Q, step = len(delayed_system.A), sum(b @ b.T for b in delayed_system.B), 3600.0 / 2**20
    block = expm(np.block([[-delayed_system.A, Q], [np.zeros((n, n)), delayed_system.A.T]]) * step)
    E, P = block[n:, n:].T, block[n:, n:].T @ block[:n, n:]
    variances = []
    for _ in range(22):
        variances.append(np.einsum("pi,ij,pj->p", delayed_system.C, P, delayed_system.C))
        E, P = E @ E, P + E @ P @ E.T
    return variances[-2], variances[-1]
