"""Engine-neutral description of a vehicle that moves in the vertical plane.

Exudyn and MuJoCo are built from it, and so are the analytic M, D, K (``linear.py``). It holds no
numbers of any engine and imports none.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

Geometry = Literal["exact", "linear"]


@dataclass(frozen=True)
class PlaneBody:
    """A rigid body that heaves and, if it has a pitch inertia, pitches.

    mass in kg; pitch_inertia in kg m^2 about the centre of mass, None for a body that does not pitch.
    """

    name: str
    mass: float
    pitch_inertia: float | None = None


@dataclass(frozen=True)
class Point:
    """A point on a body, ``x`` (m) ahead of the body's centre of mass; ``body`` None means the ground."""

    body: str | None
    x: float = 0.0


@dataclass(frozen=True)
class Strut:
    """A vertical spring and damper between two points, linear in their vertical distance.

    Its force k e + d e' with the compression e = z_upper - z_lower (m, z counts down) is positive in compression: it
    pushes the upper point up and the lower one down. stiffness in N/m, damping in N s/m. A strut that ``pushes_only``
    has the force max(0, min(k e + d e', 2 k e)) instead; ``models.systems.pitch_plane.effects.lift_off`` says why.
    """

    name: str
    upper: Point
    lower: Point
    stiffness: float
    damping: float
    pushes_only: bool = False


@dataclass(frozen=True)
class PitchSpring:
    """A rotational spring and damper between a body and the ground (N m/rad, N m s/rad).

    Within ``dead_band`` (rad) to either side of zero pitch there is neither; beyond it the spring counts from the
    band's edge, and the damper acts, so that the moment jumps by damping times rate at the edge.
    """

    body: str
    stiffness: float
    damping: float
    dead_band: float = 0.0


@dataclass(frozen=True)
class PlaneAxle:
    """Axle of a vehicle in the plane, where the road or a wheel force acts: its wheel body, and its position ahead of
    the chassis' centre (m)."""

    name: str
    wheel: str
    x: float


@dataclass(frozen=True)
class PlaneVehicle:
    """Vehicle that moves in the vertical plane: bodies, struts and axles; ``gravity`` (m/s^2) acts down; ``geometry``
    "exact" uses sin and cos of pitch."""

    bodies: tuple[PlaneBody, ...]
    struts: tuple[Strut, ...]
    axles: tuple[PlaneAxle, ...]
    gravity: float
    geometry: Geometry
    pitch_springs: tuple[PitchSpring, ...] = ()

    @property
    def tyres(self) -> tuple[Strut, ...]:
        """Tyres: the struts that end on the ground, in the order of ``struts``."""
        return tuple(strut for strut in self.struts if strut.lower.body is None)

    def coordinates(self) -> tuple[tuple[str, str], ...]:
        """Coordinates of the vehicle in the order of the state, as (body, "z" or "pitch")."""
        heave = [(body.name, "z") for body in self.bodies]
        return (*heave, *((body.name, "pitch") for body in self.bodies if body.pitch_inertia is not None))


def mass_damping_stiffness(vehicle: PlaneVehicle) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, damping and stiffness matrices M, D, K of M q'' + D q' + K q = f, each (n, n) in the order of
    ``vehicle.coordinates()``.

    Units kg, N s/m and N/m for heave rows; pitch rows are moments (N m). Gravity is not in K, nor a spring with
    a dead band, which is slack about zero pitch. Tyres that can lift are on the road.
    """
    coordinates = vehicle.coordinates()
    inertias = {(body.name, "z"): body.mass for body in vehicle.bodies}
    inertias |= {(body.name, "pitch"): body.pitch_inertia or 0.0 for body in vehicle.bodies}
    mass = np.diag([inertias[coordinate] for coordinate in coordinates])
    damping, stiffness = np.zeros_like(mass), np.zeros_like(mass)
    for strut in vehicle.struts:
        row = _vertical_displacement_row(strut.upper, coordinates) - _vertical_displacement_row(
            strut.lower, coordinates
        )
        damping += strut.damping * np.outer(row, row)
        stiffness += strut.stiffness * np.outer(row, row)
    for spring in (spring for spring in vehicle.pitch_springs if not spring.dead_band):
        at = coordinates.index((spring.body, "pitch"))
        damping[at, at] += spring.damping
        stiffness[at, at] += spring.stiffness
    return mass, damping, stiffness


def _vertical_displacement_row(point: Point, coordinate_names: tuple[tuple[str, str], ...]) -> np.ndarray:
    """Row (n,) that maps small coordinates to the vertical displacement of a point (m, down): z - x pitch."""
    row = np.zeros(len(coordinate_names))
    for i, (body, kind) in enumerate(coordinate_names):
        if body == point.body:
            row[i] = 1.0 if kind == "z" else -point.x
    return row
