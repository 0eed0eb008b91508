"""Springs, dampers, curves, dry friction and anti-roll bars between the points of a vehicle, from its description.

The travel of a part is one function of all coordinates, d(q) = a(q) . (p2(q) - p1(q)) less its design value, the axis
a fixed in the part's frame; of a bar a share of the roll coordinate of its body is added, unless that is its frame.
The force F acts as -F dd/dq on the coordinates: whatever the frame is, there is one formula.
"""

from dataclasses import dataclass

import numpy as np

from models.multibody.plain.motion import FIRST_DERIVATIVE, PLACE, RATE, Bodies, BodyPoints, PlainMotion
from models.vehicles.spatial import AntiRollBar, Curve, SpatialVehicle, SpringDamper


def frame_of(spring_or_bar: SpringDamper | AntiRollBar, default_frame: str | None) -> str | None:
    """Body in which the axis of a spring or bar is fixed (None for space): the ``frame`` that it names, or
    ``default_frame``."""
    return getattr(spring_or_bar, "frame", None) or default_frame


@dataclass(frozen=True, eq=False)
class Travels:
    """Travels (p,) of springs and bars, their rates (p,) and their derivatives with respect to the coordinates (p, n):
    m, or rad for a bar."""

    travel: np.ndarray
    rate: np.ndarray
    gradient: np.ndarray


class PlainParts:
    """The springs, then the bars, of a vehicle; ``default`` is the frame of those that name no frame."""

    def __init__(self, bodies: Bodies, vehicle: SpatialVehicle, default_frame: str | None) -> None:
        springs, bars = vehicle.springs, vehicle.bars
        both: tuple[SpringDamper | AntiRollBar, ...] = (*springs, *bars)
        self.names = tuple(part.name for part in both)
        self.stiffness, self.damping = (np.array([getattr(p, k) for p in both]) for k in ("stiffness", "damping"))
        self.friction = np.array([s.friction for s in springs] + [0.0] * len(bars))
        self.friction_rate = np.array([s.friction_rate for s in springs] + [1.0] * len(bars))
        self._first_points = bodies.points(
            [*((s.first_body, s.first_point) for s in springs), *((b.left, b.point_left) for b in bars)]
        )
        self._second_points = bodies.points(
            [*((s.second_body, s.second_point) for s in springs), *((b.right, b.point_right) for b in bars)]
        )
        axes = [s.axis for s in springs] + [(0.0, 0.0, 1.0 / bar.track) for bar in bars]
        frames = [frame_of(part, default_frame) for part in both]
        rows = [bodies.row[frame] if frame else 0 for frame in frames]
        self._axes = BodyPoints(np.array(rows, int), np.array([[*axis, 0.0] for axis in axes]).reshape(-1, 4))
        self._rolls = np.zeros((len(both), bodies.size))
        for i, (bar, frame) in enumerate(zip(bars, frames[len(springs) :], strict=True)):
            if frame != bar.body:
                self._rolls[len(springs) + i, bodies.index(bar.body, "rx")] = 1.0
        self._curves = [_spring_curves(i, s) for i, s in enumerate(springs) if s.travel_force or s.rate_force]
        still = np.zeros(bodies.size)
        self._design = np.zeros(len(both))
        self._design = self.travels(bodies.move(still, still), still, still).travel

    def travels(self, body_motion: PlainMotion, q: np.ndarray, v: np.ndarray) -> Travels:
        """Travels of all springs and bars at coordinates and rates (n,); ``body_motion`` is the motion of the bodies
        there."""
        axes, apart = (
            body_motion.at(self._axes),
            body_motion.at(self._second_points) - body_motion.at(self._first_points),
        )
        axis, way = axes[:, PLACE, :, None], apart[:, PLACE, :, None]
        all_ways = ((apart @ axis) + (axes @ way))[:, :, 0]
        travel = 0.5 * all_ways[:, PLACE] + self._rolls @ q - self._design
        return Travels(travel, all_ways[:, RATE] + self._rolls @ v, all_ways[:, FIRST_DERIVATIVE:] + self._rolls)

    def forces(self, travels: Travels, preloads: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forces (p,) that pull both ends together, N or N m: those of the springs with preloads ``preloads`` (p,); and
        those of dampers, friction and curves."""
        other = self.damping * travels.rate + self.friction * np.tanh(travels.rate / self.friction_rate)
        for i, on_travel, on_rate in self._curves:
            other[i] += on_travel(float(travels.travel[i])) if on_travel else 0.0
            other[i] += on_rate(float(travels.rate[i])) if on_rate else 0.0
        return preloads + self.stiffness * travels.travel, other


def _spring_curves(spring_index: int, spring: SpringDamper) -> tuple[int, Curve | None, Curve | None]:
    return spring_index, spring.travel_force, spring.rate_force
