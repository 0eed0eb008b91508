"""An asymmetric vehicle in space: all parameters that are equal in pairs on a usual car differ.

Products of inertia everywhere, riders on riders, riders without freedoms, riders far behind what they ride on, springs
that are inclined between bodies that both turn, anti-roll bars with damping, tyres with damping, a rigid axle with a
side force: what the engines build in different ways. Chosen for twinrig, no vehicle that exists.
"""

import numpy as np

from models.vehicles.spatial import (
    AntiRollBar,
    Body,
    Drag,
    PartOutput,
    PointOutput,
    SideForce,
    SpatialVehicle,
    SpringDamper,
    TurnOutput,
    Tyre,
    TyreOutput,
    Vector,
)

LARGE_INERTIA = ((200.0, 5.0, -10.0), (5.0, 900.0, 7.0), (-10.0, 7.0, 1000.0))
SMALL_INERTIA = ((9.0, 0.5, -1.0), (0.5, 12.0, 0.7), (-1.0, 0.7, 14.0))
FRONT_LEFT, FRONT_RIGHT = (1.2, 0.7, 0.33), (1.25, -0.72, 0.33)
UP: Vector = (0.0, 0.0, 1.0)
STEEP_AXIS, FLAT_AXIS = (np.sin(0.07), 0.0, np.cos(0.07)), (np.cos(0.07), 0.0, -np.sin(0.07))
SKEW_DIRECTION = tuple(np.array([0.3, -0.2, 0.9]) / np.sqrt(0.94))
"""Unit vector that is parallel to no axis of the vehicle."""


def asymmetric_vehicle(gravity: float = 0.0) -> SpatialVehicle:
    """The asymmetric vehicle, under a gravity (m/s^2)."""
    return SpatialVehicle(
        "spatial twin",
        _bodies(),
        _twin_springs(),
        _tyres(),
        (1.2, -1.4),
        _twin_bars(),
        _side_forces(),
        (Drag("body", 1.0),),
        _twin_outputs(),
        gravity,
    )


def _bodies() -> tuple[Body, ...]:
    return (
        Body("axle", 90.0, (-1.4, 0.0, 0.35), ("z", "rx"), SMALL_INERTIA),
        Body("body", 800.0, (0.1, 0.02, 0.6), ("z", "rx", "ry"), LARGE_INERTIA),
        Body("box", 50.0, (-1.2, 0.3, 0.9), (), SMALL_INERTIA, "body"),
        Body("engine", 120.0, (0.9, 0.05, 0.5), ("x", "z", "rx", "ry", "rz"), SMALL_INERTIA, "body"),
        Body("fl", 40.0, FRONT_LEFT, ("x", "z")),
        Body("fr", 42.0, FRONT_RIGHT, ("x", "z")),
        Body("pump", 10.0, (1.1, 0.1, 0.7), ("ry",), SMALL_INERTIA, "engine"),
        Body("hub", 12.0, (-1.5, 0.6, 0.4), ("ry",), SMALL_INERTIA, "axle"),
        Body("lid", 5.0, (1.1, 0.3, 0.9), (), SMALL_INERTIA, "pump"),
    )


def _twin_spring(
    spring_name: str,
    first_body: str,
    second_body: str,
    attachment_point: Vector,
    spring_axis: Vector,
    stiffness: float,
    damping: float,
) -> SpringDamper:
    return SpringDamper(
        spring_name, first_body, second_body, attachment_point, attachment_point, spring_axis, stiffness, damping
    )


def _twin_springs() -> tuple[SpringDamper, ...]:
    """Springs of the asymmetric vehicle: suspensions and bushings, mounts along three orthogonal skew axes, and springs
    of the bodies that others carry."""
    suspensions = (
        _twin_spring("spring fl", "body", "fl", FRONT_LEFT, STEEP_AXIS, 2.0e4, 1500.0),
        _twin_spring("spring fr", "body", "fr", FRONT_RIGHT, STEEP_AXIS, 2.2e4, 1400.0),
        SpringDamper("spring rl", "body", "axle", (-1.4, 0.5, 0.7), (-1.4, 0.5, 0.35), UP, 2.0e4, 1500.0),
        SpringDamper("spring rr", "body", "axle", (-1.4, -0.6, 0.7), (-1.4, -0.6, 0.35), UP, 1.9e4, 1600.0),
        _twin_spring("bush fl", "body", "fl", FRONT_LEFT, FLAT_AXIS, 2.0e5, 900.0),
        _twin_spring("bush fr", "body", "fr", FRONT_RIGHT, FLAT_AXIS, 2.1e5, 800.0),
    )
    skew = np.linalg.qr(np.array([SKEW_DIRECTION, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]).T)[0].T
    mounts = tuple(
        _twin_spring(f"mount {i}{j}", "engine", "body", (x, y, 0.45), tuple(axis), 9.0e4 + 1e4 * i, 300.0)
        for i, (x, y) in enumerate(((1.1, 0.3), (1.1, -0.25), (0.3, 0.02)))
        for j, axis in enumerate(skew.tolist())
    )
    riders = (
        _twin_spring("pump", "pump", "engine", (1.3, 0.1, 0.5), UP, 5.0e4, 200.0),
        _twin_spring("hub", "hub", "axle", (-1.1, 0.6, 0.5), UP, 4.0e4, 150.0),
        _twin_spring("lid", "lid", "body", (1.4, 0.2, 0.6), SKEW_DIRECTION, 5.0e3, 20.0),
    )
    return suspensions + mounts + riders


def _tyres() -> tuple[Tyre, ...]:
    return (
        Tyre("fl", "fl", FRONT_LEFT, 0, 1.6e5, 50.0),
        Tyre("fr", "fr", FRONT_RIGHT, 0, 1.5e5, 60.0),
        Tyre("rl", "axle", (-1.4, 0.68, 0.35), 1, 1.7e5),
        Tyre("rr", "axle", (-1.4, -0.7, 0.35), 1, 1.6e5),
    )


def _twin_bars() -> tuple[AntiRollBar, ...]:
    return (
        AntiRollBar("front bar", "body", "fl", "fr", FRONT_LEFT, FRONT_RIGHT, 6000.0, 20.0),
        AntiRollBar("rear bar", "body", "axle", "axle", (-1.4, 0.4, 0.35), (-1.4, -0.4, 0.35), 2000.0),
    )


def _side_forces() -> tuple[SideForce, ...]:
    return (SideForce("rear left", "axle", (-1.4, 0.7, 0.0), "body", 5.0e4, 0.05),)


def _twin_outputs() -> tuple[PointOutput | TurnOutput | PartOutput | TyreOutput, ...]:
    return (
        PointOutput("lid", "acceleration", "lid", (1.0, 0.2, 1.0), UP),
        TurnOutput("pump", "angular velocity", "pump", (0.0, 1.0, 0.0)),
        PartOutput("lid's spring", "force", "lid"),
        PartOutput("bar", "force", "front bar"),
        TyreOutput("tyre", "tyre force", "rl"),
    )
