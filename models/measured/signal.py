"""One signal of a recording: its quantity, location, component and frame, and the locations possible in a vehicle."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

Quantity = Literal["force", "moment", "acceleration", "angular rate", "angle", "travel", "strain"]
UNIT_OF_QUANTITY: dict[Quantity, str] = {
    "force": "N",
    "moment": "N m",
    "acceleration": "m/s^2",
    "angular rate": "rad/s",
    "angle": "rad",
    "travel": "m",
    "strain": "-",
}
"""SI unit of each quantity, as in every recording."""
HUB_COMPONENTS: tuple[tuple[str, Quantity, str, str], ...] = (
    ("Fx", "force", "x", "N"),
    ("Fy", "force", "y", "N"),
    ("Fz", "force", "z", "N"),
    ("Mx", "moment", "x", "N m"),
    ("My", "moment", "y", "N m"),
    ("Mz", "moment", "z", "N m"),
)
"""Components of the force and moment at a hub or guide: name, quantity, axis, unit."""
Frame = Literal["hub", "body", "inertial", "sensor"]


@dataclass(frozen=True)
class MeasuredSignal:
    """A channel of a file, as the channel map interprets it.

    at : the hub (tyre), body, connector or accelerometer that it belongs to. component : x, y, z; roll, pitch, yaw of
    angles and angular rates; empty for a travel or a strain. frame : whose axes. factor : value in SI = sign * factor *
    (file's value - zero). gravity : whether an acceleration includes it. check : named only to be compared with.
    """

    name: str
    file: str
    channel: str
    quantity: Quantity
    at: str
    component: str
    frame: Frame
    sign: int
    unit: str
    factor: float
    zero: float = 0.0
    gravity: bool = True
    check: bool = False


class TransducerPlace(NamedTuple):
    """Position of a transducer: the body that carries it, and its coordinates (m) in the vehicle's design axes."""

    body: str
    position: tuple[float, float, float]


@dataclass(frozen=True)
class MeasurementPlaces:
    """Names in a vehicle at which a channel can be measured: hubs, bodies, connectors (springs, mounts, bars),
    sensors."""

    hubs: tuple[str, ...]
    bodies: tuple[str, ...]
    connectors: tuple[str, ...]
    sensors: tuple[str, ...] = ()

    def of(self, quantity: Quantity) -> Mapping[str, tuple[str, ...]]:
        """Names at which a quantity can be measured, by kind of place; empty if it can be measured anywhere."""
        connectors = {"springs, mounts and bars": self.connectors}
        if quantity in ("force", "moment"):
            return {"hubs": self.hubs, **connectors}
        moving = {"bodies": self.bodies, "sensors": self.sensors}
        return {"travel": connectors, "strain": {}}.get(quantity, moving)
