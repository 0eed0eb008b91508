"""One signal of a recording: which quantity, of what, along which axis of which frame."""

from dataclasses import dataclass
from typing import Literal

Quantity = Literal["force", "moment", "acceleration", "angular rate", "angle", "travel", "strain"]
UNITS: dict[Quantity, str] = {
    "force": "N",
    "moment": "N m",
    "acceleration": "m/s^2",
    "angular rate": "rad/s",
    "angle": "rad",
    "travel": "m",
    "strain": "-",
}
"""The SI unit of each quantity: that of every recording."""
Frame = Literal["hub", "body", "inertial", "sensor"]


@dataclass(frozen=True)
class Signal:
    """A channel of a file, as the channel map reads it.

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
