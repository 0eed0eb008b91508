"""Section forces and moments of a cut vehicle: what can be asked for, its names, units, axes and signs.

- a spring, mount, seat or bar, by its own name: the force along its own axis, positive in compression; of an
  anti-roll bar the moment, positive where the left end is pushed up;
- ``NAME guide``: what the chassis, or another body that carries it, exerts on the body NAME through its guide, about
  the body's joint; components along which the body slides freely are nought and left out;
- ``NAME hub``: what acts on the hub NAME from outside, about the hub.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from models.core.errors import InputError
from models.measured.checks.place import Place
from models.measured.signal import Quantity, Signal
from models.multibody.cut_kernel import WRENCH
from models.multibody.cut_section_kernel import CHASSIS_ROW, MOMENTS, POINT, felt
from models.multibody.cut_table import Joints, joints
from models.vehicles.cut_vehicle import CutVehicle

AXES: tuple[tuple[str, Quantity, str, str], ...] = (
    ("Fx", "force", "x", "N"),
    ("Fy", "force", "y", "N"),
    ("Fz", "force", "z", "N"),
    ("Mx", "moment", "x", "N m"),
    ("My", "moment", "y", "N m"),
    ("Mz", "moment", "z", "N m"),
)
MOTION: tuple[tuple[str, Quantity | None, str, str], ...] = (
    ("x", None, "", "m"),
    ("y", None, "", "m"),
    ("z", None, "", "m"),
    ("heading", "angle", "yaw", "rad"),
    ("pitch", "angle", "pitch", "rad"),
    ("roll", "angle", "roll", "rad"),
    ("roll rate", "angular rate", "roll", "rad/s"),
    ("pitch rate", "angular rate", "pitch", "rad/s"),
    ("yaw rate", "angular rate", "yaw", "rad/s"),
)
"""Of the chassis: position and angles in the space, rates about its own axes."""


@dataclass(frozen=True)
class Answer:
    """One channel of a run.

    section : the element, guide or hub that it belongs to, empty of motion and of what stabilises; quantity, at and
    component : as those of a signal that measures the same; comment : axes and sign, as the files say them.
    """

    name: str
    unit: str
    comment: str
    section: str = ""
    quantity: Quantity | None = None
    at: str = ""
    component: str = ""

    def measures(self, signal: Signal) -> bool:
        """Whether a signal measures this."""
        return (self.quantity, self.at, self.component) == (signal.quantity, signal.at, signal.component)


@dataclass(frozen=True)
class Point:
    """Where an accelerometer sits: name, body, place (m) in the design position; whether it feels gravity."""

    name: str
    body: str
    place: tuple[float, float, float]
    gravity: bool = True


@dataclass(frozen=True)
class Sections:
    """What is read of a run of a vehicle; answers in the order of their columns, ``columns`` those of the kernel's row.

    frame : axes of guides and hubs, "body" for the chassis', "hub" for those of what they carry.
    """

    vehicle: CutVehicle
    frame: str = "body"
    points: tuple[Point, ...] = ()
    wanted: tuple[str, ...] | None = None
    answers: tuple[Answer, ...] = field(init=False)
    columns: np.ndarray = field(init=False)
    _guides: tuple[np.ndarray, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        every = _answers(self.vehicle, self.frame, self.points)
        if self.wanted is not None:
            known = names(self.vehicle)
            for name in (name for name in self.wanted if name not in known):
                raise InputError("", "hand_on.sections", name, "the vehicle has no such section", known)
        asked = [self.wanted is None or answer.section in ("", *self.wanted) for answer, _ in every]
        kept = [i for i, (_, free) in enumerate(every) if asked[i] and not free]
        joined = joints(self.vehicle)
        object.__setattr__(self, "answers", tuple(every[i][0] for i in kept))
        object.__setattr__(self, "columns", np.array(kept))
        own = (*_guides(self.vehicle, joined), _points(self.points, joined))
        object.__setattr__(self, "_guides", own)

    def read(self, numbers: np.ndarray, states: np.ndarray, every: int) -> np.ndarray:
        """Answers (n, answers) of states (n, 2 c), ``every`` half steps apart; ``numbers`` as in ``HubModel``."""
        guides, carried, points = self._guides
        count = (
            2 * len(self.vehicle.elements)
            + CHASSIS_ROW
            + MOMENTS
            + POINT * len(points)
            + WRENCH * (len(guides) + len(self.vehicle.hubs))
        )
        out = np.empty((len(states), count))
        felt(numbers, float(every), np.ascontiguousarray(states), guides, carried, points, self.frame == "hub", out)
        return out[:, self.columns]


def names(vehicle: CutVehicle) -> tuple[str, ...]:
    """Every section that can be asked for."""
    guides = tuple(f"{name} guide" for name in guided(vehicle))
    return (*(element.name for element in vehicle.elements), *guides, *(f"{hub} hub" for hub in vehicle.hubs))


def guided(vehicle: CutVehicle) -> tuple[str, ...]:
    """Bodies that ride on the chassis or on one another."""
    return tuple(body.name for body in vehicle.whole.bodies if body.name != vehicle.chassis)


def _answers(vehicle: CutVehicle, frame: str, points: tuple[Point, ...]) -> list[tuple[Answer, bool]]:
    """Every column of the kernel's row, and whether it is nought because the body slides freely along it."""
    found = list[Answer]()
    for e in vehicle.elements:
        bar, sign = e.unit != "N", "along its own axis, compression positive"
        found.append(
            Answer(
                f"{e.name} {'M' if bar else 'F'}",
                e.unit,
                "moment, left end pushed up positive" if bar else sign,
                e.name,
                "moment" if bar else "force",
                e.name,
            )
        )
    for e in vehicle.elements:
        bar = e.unit != "N"
        found.append(
            Answer(
                f"{e.name} travel",
                "rad" if bar else "m",
                "from the design position, compression positive",
                e.name,
                "travel",
                e.name,
            )
        )
    found += [
        Answer(
            f"{vehicle.chassis} {name}",
            unit,
            "of the chassis, x forward, y left, z up",
            "",
            what,
            vehicle.chassis if what else "",
            axis,
        )
        for name, what, axis, unit in MOTION
    ]
    found += [
        Answer(f"stabiliser {name}", "N m", "artificial moment on the chassis", component=name)
        for name in ("roll", "pitch")
    ]
    free = len(found) * [False]
    for name in guided(vehicle):
        axes = "chassis" if frame == "body" else name
        found += [
            Answer(f"{name} guide {axis}", unit, f"on {name} from what carries it, axes of {axes}", f"{name} guide")
            for axis, _, _, unit in AXES
        ]
        free += [_slides(vehicle, name, frame, axis) for axis, *_ in AXES]
    for hub, tyre in zip(vehicle.hubs, vehicle.whole.tyres, strict=True):
        axes = "chassis" if frame == "body" else tyre.body
        found += [
            Answer(
                f"{hub} hub {axis}",
                unit,
                f"on the hub from outside, axes of {axes}",
                f"{hub} hub",
                what,
                hub,
                component,
            )
            for axis, what, component, unit in AXES
        ]
    for p in points:
        text = f"{'with' if p.gravity else 'without'} gravity, axes of {p.body}"
        found += [Answer(f"{p.name} a{axis}", "m/s^2", text, "", "acceleration", p.name, axis) for axis in "xyz"]
    return list(zip(found, free + (len(found) - len(free)) * [False], strict=True))


def _slides(vehicle: CutVehicle, name: str, frame: str, axis: str) -> bool:
    """Whether a body slides along a component of its guide's force, so that there is none."""
    body = vehicle.whole.body(name)
    turns = any(freedom.startswith("r") for freedom in body.freedoms)
    straight = body.parent == vehicle.chassis and (frame == "body" or not turns)
    return straight and axis.startswith("F") and axis[1:] in body.freedoms


def _guides(vehicle: CutVehicle, joined: Joints) -> tuple[np.ndarray, np.ndarray]:
    """Last joint (g,) of every guided body and what acts behind it (g, b + h + 2 e), as the kernel reads it."""
    heavy = [body.name for body in vehicle.tree.bodies if body.mass or np.any(body.inertia)]
    ends = [end for element in vehicle.elements for end in (element.one, element.two)]
    owners = [*heavy, *(tyre.body for tyre in vehicle.whole.tyres), *ends]
    parents = {body.name: body.parent for body in vehicle.whole.bodies}
    rows = [[float(name in _line(owner, parents)) for owner in owners] for name in guided(vehicle)]
    last = np.array([joined.last[name] for name in guided(vehicle)], np.int64)
    return last, np.array(rows).reshape(len(last), len(owners))


def _line(name: str, parents: dict[str, str | None]) -> list[str]:
    """A body and all that carry it."""
    found, above = [name], parents[name]
    while above is not None:
        found.append(above)
        above = parents[above]
    return found


def _points(points: tuple[Point, ...], joined: Joints) -> np.ndarray:
    rows = [[joined.last[p.body], *np.subtract(p.place, joined.origin[p.body]), float(p.gravity)] for p in points]
    return np.array(rows, float).reshape(len(points), 5)


def points(vehicle: CutVehicle, signals: Iterable[Signal], places: Mapping[str, Place]) -> tuple[Point, ...]:
    """Where accelerations are measured: at sensors, which ``places`` knows, and at centres of bodies."""
    found = dict[str, Point]()
    for signal in (signal for signal in signals if signal.quantity == "acceleration"):
        if signal.at in places:
            found[signal.at] = Point(signal.at, places[signal.at].body, places[signal.at].position, signal.gravity)
        elif signal.at in {body.name for body in vehicle.whole.bodies}:
            found[signal.at] = Point(signal.at, signal.at, vehicle.whole.body(signal.at).position, signal.gravity)
    return tuple(found.values())
