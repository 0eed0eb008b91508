"""Cars with trailers: the shipped caravan, and an asymmetric train whose hitches turn about some axes only."""

from dataclasses import replace

from models.vehicles.spatial import (
    AntiRollBar,
    Body,
    Curve,
    Freedom,
    SideForce,
    SpatialVehicle,
    SpringDamper,
    Tyre,
    Vector,
    hitch_of,
)
from models.vehicles.vehicle_file import load_vehicle
from validation.spatial.cars import twin

DRAWBAR, BOX, TIE_SPRING = "drawbar", "box", "tie"
HOOK_POSITION: Vector = (-2.3, 0.05, 0.45)
TURNTABLE: Vector = (-4.1, 0.02, 0.6)
WHEELS: dict[str, tuple[str, Vector, float, tuple[Freedom, ...]]] = {
    "dl": (DRAWBAR, (-4.2, 0.85, 0.33), 22.0, ("z",)),
    "dr": (DRAWBAR, (-4.2, -0.8, 0.33), 25.0, ("z",)),
    "bl": (BOX, (-7.0, 0.9, 0.35), 30.0, ("x", "z")),
    "br": (BOX, (-7.0, -0.86, 0.35), 28.0, ("x", "z")),
}
"""Wheels of the trailer by name: body that carries the wheel, position (m), mass (kg), freedoms."""
BUMP_STOP = Curve((-0.1, -0.02, 0.02, 0.1), (-5000.0, 0.0, 0.0, 7000.0))
DAMPER = Curve((-1.0, -0.1, 0.0, 0.1, 1.0), (-1500.0, -400.0, 0.0, 200.0, 600.0))


def caravan() -> SpatialVehicle:
    """The shipped car with a caravan of one axle on its ball hitch."""
    return load_vehicle("r19_caravan", allows_towing=True)


def train() -> SpatialVehicle:
    """The asymmetric car with a trailer of two axles. The drawbar, with the first axle, yaws and pitches about the
    hook, and the box yaws on the drawbar. Springs have curves, friction and skew axes; one connects drawbar and car
    beside the hook."""
    car = twin()
    tyres = tuple(
        Tyre(name, name, position, 2 + (carrier == BOX), 2.1e5) for name, (carrier, position, _, _) in WHEELS.items()
    )
    sides = tuple(
        SideForce(name, carrier, (x, y, 0.0), carrier, 4.2e4) for name, (carrier, (x, y, _), _, _) in WHEELS.items()
    )
    bar = AntiRollBar("trailer's bar", BOX, "bl", "br", WHEELS["bl"][1], WHEELS["br"][1], 3000.0, 20.0, BOX)
    tie = SpringDamper(TIE_SPRING, "body", DRAWBAR, (-2.2, 0.4, 0.5), (-2.5, 0.45, 0.4), (1.0, 0.0, 0.0), 3e3, 50.0)
    return replace(
        car,
        bodies=(*car.bodies, *_bodies()),
        springs=(*car.springs, *_springs(), tie),
        tyres=(*car.tyres, *tyres),
        axles=(*car.axles, -4.2, -7.0),
        bars=(*car.bars, bar),
        side_forces=(*car.side_forces, *sides),
        towed=(DRAWBAR, BOX),
    )


def train_without_tie() -> SpatialVehicle:
    """The train without the spring TIE_SPRING between car and drawbar, and with a box that also pitches on the drawbar,
    so that no hitch transmits a moment.

    Closed forms of a turn know none. A box that cannot pitch beside a drawbar that rolls with the car yaws by its
    weight: its axis leans.
    """
    full_vehicle = train()
    bodies = (replace(b, freedoms=("ry", "rz")) if b.name == hitch_of(BOX) else b for b in full_vehicle.bodies)
    return replace(
        full_vehicle, bodies=tuple(bodies), springs=tuple(s for s in full_vehicle.springs if s.name != TIE_SPRING)
    )


def _bodies() -> tuple[Body, ...]:
    """Bodies of the trailer: hitches, drawbar, box and wheels."""
    inertia = ((260.0, 6.0, -9.0), (6.0, 700.0, 4.0), (-9.0, 4.0, 720.0))
    light = ((20.0, 0.0, 1.0), (0.0, 60.0, 0.0), (1.0, 0.0, 65.0))
    return (
        Body(hitch_of(DRAWBAR), 0.0, HOOK_POSITION, ("ry", "rz"), parent="body"),
        Body(DRAWBAR, 90.0, (-3.8, 0.03, 0.5), (), light, hitch_of(DRAWBAR)),
        Body(hitch_of(BOX), 0.0, TURNTABLE, ("rz",), parent=DRAWBAR),
        Body(BOX, 620.0, (-5.7, -0.04, 0.9), (), inertia, hitch_of(BOX)),
        *(
            Body(name, mass, position, freedoms, parent=carrier)
            for name, (carrier, position, mass, freedoms) in WHEELS.items()
        ),
    )


def _springs() -> tuple[SpringDamper, ...]:
    """Springs and bushings of the trailer's wheels, with axes fixed in the body that carries the wheel."""
    upward: Vector = (0.06, 0.0, 0.9981984772580131)
    dampers = {"dl": DAMPER, "br": DAMPER}
    upright = tuple(
        SpringDamper(
            f"spring {name}",
            carrier,
            name,
            (x, y, z + 0.3),
            (x, y, z),
            upward,
            3.2e4,
            1800.0,
            BUMP_STOP,
            dampers.get(name),
            60.0,
        )
        for name, (carrier, (x, y, z), _, _) in WHEELS.items()
    )
    bushes = tuple(
        SpringDamper(f"bush {name}", BOX, name, WHEELS[name][1], WHEELS[name][1], (1.0, 0.0, 0.0), 2e5, 700.0)
        for name in ("bl", "br")
    )
    return tuple(replace(spring, frame=spring.first_body) for spring in (*upright, *bushes))
