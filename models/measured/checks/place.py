"""Where a transducer sits."""

from typing import NamedTuple


class Place(NamedTuple):
    """The body that carries it, and its position (m) in the vehicle's design axes."""

    body: str
    position: tuple[float, float, float]
