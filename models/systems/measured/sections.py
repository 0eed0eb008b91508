"""Section forces and moments of a vehicle without tyres: their names, units, axes and signs.

- a spring, mount, seat or bar, by its name: the force along its axis, positive in compression; of an anti-roll bar the
  moment, positive where the left end is pushed up;
- ``NAME guide``: force and moment on the body NAME from the chassis, or from another body that carries it, through its
  guide, about the body's joint; components along which the body slides freely are zero and left out;
- ``NAME hub``: force and moment on the hub NAME from outside, about the hub.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from models.core.errors import InputError
from models.measured.signal import HUB_COMPONENTS, MeasuredSignal, Quantity, TransducerPlace
from models.multibody.cut_kernel import WRENCH
from models.multibody.cut_section_kernel import CHASSIS_ROW, MOMENTS, POINT, SectionPlaces, section_results
from models.multibody.cut_table import JointTable, joint_table_of
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
"""Channels of the chassis' motion (name, quantity, component, unit): position and angles in space, rates about axes of
the chassis.
"""


@dataclass(frozen=True)
class SectionChannel:
    """An output channel of a run: a section force, a motion or a stabilising moment.

    section : element, guide or hub of a section force, else empty; quantity, at and component : as in a signal that
    measures the same; comment : text on axes and sign.
    """

    name: str
    unit: str
    comment: str
    section: str = ""
    quantity: Quantity | None = None
    at: str = ""
    component: str = ""

    def measures(self, measured_signal: MeasuredSignal) -> bool:
        """Whether a signal measures the quantity of this channel at the same place and in the same component."""
        return (self.quantity, self.at, self.component) == (
            measured_signal.quantity,
            measured_signal.at,
            measured_signal.component,
        )


@dataclass(frozen=True)
class AccelerometerPoint:
    """Position of an accelerometer: name, body, position (m) in the design state; gravity : whether
    it feels gravity.
    """

    name: str
    body: str
    position: tuple[float, float, float]
    gravity: bool = True


@dataclass(frozen=True)
class Sections:
    """Section forces and other channels that are computed from a vehicle's run. wanted : names of sections, None for
    all; answers : channels; columns : their indices in a row of the compiled kernel.

    frame : axes of guide and hub forces, "body" for axes of the chassis, "hub" for axes of the guided body or wheel
    carrier.
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
        joined = joint_table_of(self.vehicle)
        object.__setattr__(self, "answers", tuple(answer for _, answer in channel_of_column))
        object.__setattr__(self, "columns", np.array([column for column, _ in channel_of_column]))
        rows = [
            [joined.last_joint[p.body], *np.subtract(p.position, joined.joint_position[p.body]), float(p.gravity)]
            for p in self.points
        ]
        points = np.array(rows, float).reshape(len(rows), 5)
        object.__setattr__(self, "_places", SectionPlaces(*_guide_arrays(self.vehicle, joined), points))

    def read(self, model_parameters: np.ndarray, states: np.ndarray, half_steps_per_row: int) -> np.ndarray:
        """Computes all channels (n, channels) at states (n, 2 c) that are ``half_steps_per_row`` half steps apart;
        numbers : parameters as in ``HubModel``.
        """
        wrenches, points = len(self._places.guide_joints) + len(self.vehicle.hubs), len(self._places.points)
        count = 2 * len(self.vehicle.elements) + CHASSIS_ROW + MOMENTS + POINT * points + WRENCH * wrenches
        out = np.empty((len(states), count))
        section_results(
            model_parameters,
            float(half_steps_per_row),
            np.ascontiguousarray(states),
            self._places,
            self.frame == "hub",
            out,
        )
        return out[:, self.columns]


def section_names(vehicle: CutVehicle) -> tuple[str, ...]:
    """Names of all sections at which forces can be requested."""
    guides = tuple(f"{name} guide" for name in guided_bodies(vehicle))
    return (*(element.name for element in vehicle.elements), *guides, *(f"{hub} hub" for hub in vehicle.hubs))


def guided_bodies(vehicle: CutVehicle) -> tuple[str, ...]:
    """Names of the bodies that the chassis or another body guides: all except the chassis."""
    return tuple(body.name for body in vehicle.uncut.bodies if body.name != vehicle.chassis)


def _kernel_columns(
    vehicle: CutVehicle, force_frame: str, accelerometer_points_in_use: tuple[AccelerometerPoint, ...]
) -> Iterator[SectionChannel]:
    """Yields the channel of every column in a row of the compiled kernel."""
    chassis, about = vehicle.chassis, "chassis" if force_frame == "body" else ""
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
    for p in accelerometer_points_in_use:
        text = f"{'with' if p.gravity else 'without'} gravity, axes of {p.body}"
        yield from (
            SectionChannel(f"{p.name} a{axis}", "m/s^2", text, "", "acceleration", p.name, axis) for axis in "xyz"
        )


def _zero_components(vehicle: CutVehicle, force_frame: str) -> set[str]:
    """Names of the guide force channels that are zero, as they act along a free direction of the guide."""
    sliding = set[str]()
    for name in guided_bodies(vehicle):
        body = vehicle.uncut.body(name)
        turns = any(freedom.startswith("r") for freedom in body.freedoms)
        if body.parent == vehicle.chassis and (force_frame == "body" or not turns):
            sliding |= {f"{name} guide F{axis}" for axis in body.freedoms}
    return sliding


def _guide_arrays(vehicle: CutVehicle, joints: JointTable) -> tuple[np.ndarray, np.ndarray]:
    """Returns the last joint of every guided body (g,), and which bodies, hubs and elements act behind that joint
    (g, b + h + 3 e), in the format of the compiled kernel.
    """
    heavy = [body.name for body in vehicle.tree.bodies if body.mass or np.any(body.inertia)]
    ends = [end for element in vehicle.elements for end in (element.first_body, element.second_body, element.frame)]
    owners = [*heavy, *(tyre.body for tyre in vehicle.uncut.tyres), *ends]
    parents = {body.name: body.parent for body in vehicle.uncut.bodies}

    def behind(body_name: str | None, guided_body: str) -> bool:
        return body_name is not None and (body_name == guided_body or behind(parents[body_name], guided_body))

    last = np.array([joints.last_joint[name] for name in guided_bodies(vehicle)], np.int64)
    rows = [[float(behind(owner, name)) for owner in owners] for name in guided_bodies(vehicle)]
    return last, np.array(rows).reshape(len(last), len(owners))


def accelerometer_points(
    vehicle: CutVehicle, signals: Iterable[MeasuredSignal], transducer_places: Mapping[str, TransducerPlace]
) -> tuple[AccelerometerPoint, ...]:
    """Points at which acceleration signals are measured: sensors in ``transducer_places``, and centres of bodies."""
    section_points = dict[str, AccelerometerPoint]()
    for signal in (signal for signal in signals if signal.quantity == "acceleration"):
        if signal.at in transducer_places:
            section_points[signal.at] = AccelerometerPoint(
                signal.at, transducer_places[signal.at].body, transducer_places[signal.at].position, signal.gravity
            )
        elif signal.at in {body.name for body in vehicle.uncut.bodies}:
            section_points[signal.at] = AccelerometerPoint(
                signal.at, signal.at, vehicle.uncut.body(signal.at).position, signal.gravity
            )
    return tuple(section_points.values())
