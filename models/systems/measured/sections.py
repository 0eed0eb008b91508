"""Section forces and moments of a cut vehicle: what can be asked for, its names, units, axes and signs.

- a spring, mount, seat or bar, by its own name: the force along its own axis, positive in compression; of an
  anti-roll bar the moment, positive where the left end is pushed up;
- ``NAME guide``: what the chassis, or another body that carries it, exerts on the body NAME through its guide, about
  the body's joint; components along which the body slides freely are nought and left out;
- ``NAME hub``: what acts on the hub NAME from outside, about the hub.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from models.core.errors import InputError
from models.measured.signal import HUB_COMPONENTS, Quantity, Signal, TransducerPlace
from models.multibody.cut_kernel import WRENCH
from models.multibody.cut_section_kernel import CHASSIS_ROW, MOMENTS, POINT, SectionPlaces, section_results
from models.multibody.cut_table import Joints, joints
from models.vehicles.cut_vehicle import CutVehicle

MOTION_CHANNELS: tuple[tuple[str, Quantity | None, str, str], ...] = (
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
class SectionChannel:
    """One output channel of a run: a section force, a motion or a stabilising moment.

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
        """Whether a signal measures the same as this channel."""
        return (self.quantity, self.at, self.component) == (signal.quantity, signal.at, signal.component)


@dataclass(frozen=True)
class AccelerometerPoint:
    """Where an accelerometer sits: name, body, position (m) in the design state; whether it feels gravity."""

    name: str
    body: str
    position: tuple[float, float, float]
    gravity: bool = True


@dataclass(frozen=True)
class Sections:
    """Section forces and other channels that are computed from a vehicle's run. answers : channels in the order of
    their columns; columns : their indices in the kernel's row.

    frame : axes of guides and hubs, "body" for the chassis', "hub" for those of what they carry.
    """

    vehicle: CutVehicle
    frame: str = "body"
    points: tuple[AccelerometerPoint, ...] = ()
    wanted: tuple[str, ...] | None = None
    answers: tuple[SectionChannel, ...] = field(init=False)
    columns: np.ndarray = field(init=False)
    _places: SectionPlaces = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.wanted is not None:
            known = section_names(self.vehicle)
            for name in (name for name in self.wanted if name not in known):
                raise InputError("", "hand_on.sections", name, "the vehicle has no such section", known)
        sliding, channel_of_column = _zero_components(self.vehicle, self.frame), list[tuple[int, SectionChannel]]()
        for column, answer in enumerate(_kernel_columns(self.vehicle, self.frame, self.points)):
            is_wanted = self.wanted is None or answer.section in ("", *self.wanted)
            if is_wanted and answer.name not in sliding:
                channel_of_column.append((column, answer))
        joined = joints(self.vehicle)
        object.__setattr__(self, "answers", tuple(answer for _, answer in channel_of_column))
        object.__setattr__(self, "columns", np.array([column for column, _ in channel_of_column]))
        rows = [
            [joined.last_joint[p.body], *np.subtract(p.position, joined.joint_position[p.body]), float(p.gravity)]
            for p in self.points
        ]
        points = np.array(rows, float).reshape(len(rows), 5)
        object.__setattr__(self, "_places", SectionPlaces(*_guide_arrays(self.vehicle, joined), points))

    def read(self, numbers: np.ndarray, states: np.ndarray, stride: int) -> np.ndarray:
        """Values (n, answers) of the channels at states (n, 2 c), ``stride`` half steps apart; ``numbers`` as in
        ``HubModel``.
        """
        wrenches, points = len(self._places.guide_joints) + len(self.vehicle.hubs), len(self._places.points)
        count = 2 * len(self.vehicle.elements) + CHASSIS_ROW + MOMENTS + POINT * points + WRENCH * wrenches
        out = np.empty((len(states), count))
        section_results(numbers, float(stride), np.ascontiguousarray(states), self._places, self.frame == "hub", out)
        return out[:, self.columns]


def section_names(vehicle: CutVehicle) -> tuple[str, ...]:
    """Names of all sections at which forces can be requested."""
    guides = tuple(f"{name} guide" for name in guided_bodies(vehicle))
    return (*(element.name for element in vehicle.elements), *guides, *(f"{hub} hub" for hub in vehicle.hubs))


def guided_bodies(vehicle: CutVehicle) -> tuple[str, ...]:
    """Names of the bodies that are guided by the chassis or by another body."""
    return tuple(body.name for body in vehicle.uncut.bodies if body.name != vehicle.chassis)


def _kernel_columns(
    vehicle: CutVehicle, frame: str, points: tuple[AccelerometerPoint, ...]
) -> Iterator[SectionChannel]:
    """The channel of every column in the kernel's row."""
    chassis, about = vehicle.chassis, "chassis" if frame == "body" else ""
    for e in vehicle.elements:
        if e.unit == "N":
            text = "along its own axis, compression positive"
            yield SectionChannel(f"{e.name} F", e.unit, text, e.name, "force", e.name)
        else:
            text = "moment, left end pushed up positive"
            yield SectionChannel(f"{e.name} M", e.unit, text, e.name, "moment", e.name)
    for e in vehicle.elements:
        unit = "m" if e.unit == "N" else "rad"
        text = "from the design position, compression positive"
        yield SectionChannel(f"{e.name} travel", unit, text, e.name, "travel", e.name)
    for name, quantity, axis, unit in MOTION_CHANNELS:
        text = "of the chassis, x forward, y left, z up"
        yield SectionChannel(f"{chassis} {name}", unit, text, "", quantity, chassis if quantity else "", axis)
    for name in ("roll", "pitch"):
        yield SectionChannel(f"stabiliser {name}", "N m", "artificial moment on the chassis", component=name)
    for name in guided_bodies(vehicle):
        for axis, _, _, unit in HUB_COMPONENTS:
            text = f"on {name} from what carries it, axes of {about or name}"
            yield SectionChannel(f"{name} guide {axis}", unit, text, f"{name} guide")
    for hub, tyre in zip(vehicle.hubs, vehicle.uncut.tyres, strict=True):
        for axis, quantity, component, unit in HUB_COMPONENTS:
            text = f"on the hub from outside, axes of {about or tyre.body}"
            yield SectionChannel(f"{hub} hub {axis}", unit, text, f"{hub} hub", quantity, hub, component)
    for p in points:
        text = f"{'with' if p.gravity else 'without'} gravity, axes of {p.body}"
        yield from (
            SectionChannel(f"{p.name} a{axis}", "m/s^2", text, "", "acceleration", p.name, axis) for axis in "xyz"
        )


def _zero_components(vehicle: CutVehicle, frame: str) -> set[str]:
    """Names of the guides' force components that are zero, as they act along the guide's free direction."""
    sliding = set[str]()
    for name in guided_bodies(vehicle):
        body = vehicle.uncut.body(name)
        turns = any(freedom.startswith("r") for freedom in body.freedoms)
        if body.parent == vehicle.chassis and (frame == "body" or not turns):
            sliding |= {f"{name} guide F{axis}" for axis in body.freedoms}
    return sliding


def _guide_arrays(vehicle: CutVehicle, joined: Joints) -> tuple[np.ndarray, np.ndarray]:
    """For every guided body its last joint (g,), and which bodies, hubs and elements act behind that joint (g, b + h +
    3 e), in the kernel's format.
    """
    heavy = [body.name for body in vehicle.tree.bodies if body.mass or np.any(body.inertia)]
    ends = [end for element in vehicle.elements for end in (element.first_body, element.second_body, element.frame)]
    owners = [*heavy, *(tyre.body for tyre in vehicle.uncut.tyres), *ends]
    parents = {body.name: body.parent for body in vehicle.uncut.bodies}

    def behind(name: str | None, guide: str) -> bool:
        return name is not None and (name == guide or behind(parents[name], guide))

    last = np.array([joined.last_joint[name] for name in guided_bodies(vehicle)], np.int64)
    rows = [[float(behind(owner, name)) for owner in owners] for name in guided_bodies(vehicle)]
    return last, np.array(rows).reshape(len(last), len(owners))


def accelerometer_points(
    vehicle: CutVehicle, signals: Iterable[Signal], places: Mapping[str, TransducerPlace]
) -> tuple[AccelerometerPoint, ...]:
    """Points at which accelerations are measured: sensors, which ``places`` lists, and centres of bodies."""
    section_points = dict[str, AccelerometerPoint]()
    for signal in (signal for signal in signals if signal.quantity == "acceleration"):
        if signal.at in places:
            section_points[signal.at] = AccelerometerPoint(
                signal.at, places[signal.at].body, places[signal.at].position, signal.gravity
            )
        elif signal.at in {body.name for body in vehicle.uncut.bodies}:
            section_points[signal.at] = AccelerometerPoint(
                signal.at, signal.at, vehicle.uncut.body(signal.at).position, signal.gravity
            )
    return tuple(section_points.values())
