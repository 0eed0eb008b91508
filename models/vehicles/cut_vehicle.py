"""A vehicle in space, cut at the wheels: what is above the cut, free to move and turn without limit.

All bodies ride on the chassis, in its own axes, and so do the axes of springs, mounts and bars: what is inside the
vehicle feels relative coordinates alone. The chassis itself has position, heading (about the vertical), pitch and
roll, in this order, so that roll and pitch say where gravity points whatever the heading is. Two carriers without mass
hold these joints. Wheels ride along sideways. The tyres are cut off; what they did comes from outside, at the hubs.
"""

from dataclasses import dataclass, replace

import numpy as np

from models.core.errors import InputError
from models.vehicles.free_vehicle import guided
from models.vehicles.spatial import Body, SpatialVehicle, SpringDamper
from models.vehicles.spatial_linear import preloads

GRAVITY = 9.81
X, Y, Z, HEADING, PITCH, ROLL = range(6)
"""The chassis' coordinates: m and rad; nose down is a positive pitch (about y, to the left)."""
ANGLES = {"roll": ROLL, "pitch": PITCH, "heading": HEADING}


@dataclass(frozen=True)
class Element:
    """A force F = held + stiffness d + damping d' along an axis of the chassis, positive in compression, or a moment.

    d = axis . (point two - point one) less its design value, in the chassis' frame; of an anti-roll bar the axis is
    divided by the track, so that d is an angle and F a moment. points in the design position, m; N or N m.
    """

    name: str
    one: str
    two: str
    point_one: np.ndarray
    point_two: np.ndarray
    axis: np.ndarray
    stiffness: float
    damping: float
    held: float

    @property
    def unit(self) -> str:
        """Unit of the force."""
        return "N" if np.isclose(np.linalg.norm(self.axis), 1.0) else "N m"


@dataclass(frozen=True)
class CutVehicle:
    """What is above the cut.

    tree : bodies and joints, carriers first, then the chassis; without springs and tyres
    whole : the vehicle that was cut, all its bodies on the chassis, loaded; tyres are listed there
    elements : springs, mounts, seats and bars, in that order
    loads : (hubs,) static load of every tyre, N
    """

    chassis: str
    tree: SpatialVehicle
    whole: SpatialVehicle
    elements: tuple[Element, ...]
    loads: np.ndarray

    @property
    def hubs(self) -> tuple[str, ...]:
        """Names of the tyres that were cut off."""
        return tuple(tyre.name for tyre in self.whole.tyres)

    @property
    def size(self) -> int:
        """Degrees of freedom."""
        return len(self.tree.coordinates())


def cut(vehicle: SpatialVehicle, chassis: str) -> CutVehicle:
    """Cut a vehicle whose body ``chassis`` has all six freedoms; InputError for what cannot be cut."""
    _check(vehicle, chassis)
    whole = replace(guided(vehicle, chassis), gravity=GRAVITY, drags=())
    held = preloads(whole)
    springs = [_spring(spring, held.parts[spring.name]) for spring in whole.springs]
    bars = [
        Element(
            bar.name,
            bar.left,
            bar.right,
            np.array(bar.point_left),
            np.array(bar.point_right),
            np.array([0.0, 0.0, 1.0 / bar.track]),
            bar.stiffness,
            bar.damping,
            held.parts[bar.name],
        )
        for bar in whole.bars
    ]
    loads = np.array([held.tyres[tyre.name] for tyre in whole.tyres])
    return CutVehicle(chassis, _tree(whole, chassis), whole, (*springs, *bars), loads)


def _spring(s: SpringDamper, held: float) -> Element:
    assert s.two is not None
    return Element(
        s.name,
        s.one,
        s.two,
        np.array(s.point_one),
        np.array(s.point_two),
        np.array(s.axis),
        s.stiffness,
        s.damping,
        held,
    )


def _tree(vehicle: SpatialVehicle, chassis: str) -> SpatialVehicle:
    """Heading and pitch on carriers without mass, roll on the chassis, all others behind it."""
    own = vehicle.body(chassis)
    carriers = (
        Body(f"{chassis} heading", 0.0, own.position, ("x", "y", "z", "rz")),
        Body(f"{chassis} pitch", 0.0, own.position, ("ry",), parent=f"{chassis} heading"),
    )
    turned = replace(own, freedoms=("rx",), parent=f"{chassis} pitch")
    others = tuple(body for body in vehicle.bodies if body.name != chassis)
    return SpatialVehicle(vehicle.name, (*carriers, turned, *others), (), (), vehicle.axles, gravity=vehicle.gravity)


def _check(vehicle: SpatialVehicle, chassis: str) -> None:
    names = tuple(body.name for body in vehicle.bodies)
    if chassis not in names:
        raise InputError(vehicle.name, "chassis", chassis, "no such body", names)
    own = vehicle.body(chassis)
    if len(own.freedoms) != 6 or own.parent is not None:
        raise InputError(
            vehicle.name,
            f"bodies[{chassis}].freedoms",
            own.freedoms,
            "what is left of a vehicle without tyres is free: its chassis needs x, y, z, rx, ry and rz",
        )
    for spring in vehicle.springs:
        if spring.two is None:
            raise InputError(vehicle.name, f"springs[{spring.name}].bodies", "ground", "a cut vehicle has no ground")
        if spring.travel_force or spring.rate_force or spring.friction:
            raise InputError(
                vehicle.name,
                f"springs[{spring.name}]",
                None,
                "has a curve or friction: the cut vehicle knows linear springs and dampers alone",
            )
    for bar in vehicle.bars:
        if bar.body != chassis:
            place = f"anti_roll_bars[{bar.name}].body"
            raise InputError(vehicle.name, place, bar.body, "must be the chassis", (chassis,))
    if not vehicle.tyres:
        raise InputError(vehicle.name, "tyres", None, "there is nothing to cut: no tyre")
