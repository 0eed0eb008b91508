"""What can be drawn: the motion that an engine reports, and the stage that it happens on.

Axes are those of the run, whatever they are; the camera's ``up`` says where up is. Lengths in m, forces in N.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from studies.pictures.camera import Camera
from studies.pictures.shapes import Colour, Surface


@dataclass(frozen=True, eq=False)
class Arrow:
    """A force over time: points (f, 3) in space, on ``body``, vectors (f, 3); ``kind``: its scale and colour."""

    name: str
    kind: str
    body: str
    points: np.ndarray
    vectors: np.ndarray


@dataclass(frozen=True, eq=False)
class Motion:
    """Poses from one engine at times (f,) in s: places (f, 3) and turns (f, 3, 3) of each body, space from body."""

    engine: str
    times: np.ndarray
    places: dict[str, np.ndarray]
    turns: dict[str, np.ndarray]
    arrows: tuple[Arrow, ...] = ()


@dataclass(frozen=True)
class Kind:
    """How arrows of one kind look: colour, metres per newton, and a round force (N) for the legend."""

    colour: Colour
    scale: float
    legend: float


@dataclass(frozen=True)
class Curve:
    """What is plotted below the pictures: forces of one kind along a direction, and how that is called."""

    kind: str
    direction: tuple[float, float, float]
    meaning: str


@dataclass(frozen=True)
class Strut:
    """A rod between points fixed to two bodies, in the bodies' axes."""

    one: str
    point_one: tuple[float, float, float]
    two: str
    point_two: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Stage:
    """Shapes of the bodies and of what stands around.

    shapes : surfaces of each body in its own axes; rest : its place when nothing moves; magnified : how many times as
    large displacements and turns from there are drawn (turning about the y of ``wheels`` apart, which is drawn as it
    is); kinds : of the arrows; curve : plotted below; scenery : surfaces around at a time (s), in space.
    """

    title: str
    caption: str
    shapes: dict[str, list[Surface]]
    rest: Mapping[str, ArrayLike]
    camera: Camera
    kinds: dict[str, Kind]
    curve: Curve
    scenery: Callable[[float], list[Surface]] = lambda time: []
    magnified: float = 1.0
    wheels: tuple[str, ...] = ()
    struts: tuple[Strut, ...] = ()


def gaps(one: Motion, two: Motion) -> tuple[float, float, float]:
    """Largest difference of places (m), of turns (elements of the matrices) and of forces (N) of two motions."""
    places = max(float(np.abs(one.places[name] - two.places[name]).max()) for name in one.places)
    turns = max(float(np.abs(one.turns[name] - two.turns[name]).max()) for name in one.turns)
    forces = [float(np.abs(a.vectors - b.vectors).max()) for a, b in zip(one.arrows, two.arrows, strict=True)]
    return places, turns, max(forces, default=0.0)
