"""Engine-neutral description of a vehicle that moves in the vertical plane.

Exudyn and MuJoCo are built from it, and so are the analytic M, D, K (``linear.py``). It holds no
numbers of any engine and imports none.
"""

from dataclasses import dataclass
from typing import Literal

Geometry = Literal["exact", "linear"]


@dataclass(frozen=True)
class Body:
    """A rigid body that heaves and, if it has a pitch inertia, pitches.

    mass in kg; pitch_inertia in kg m^2 about the centre of mass, None for a body that does not pitch.
    """

    name: str
    mass: float
    pitch_inertia: float | None = None


@dataclass(frozen=True)
class Point:
    """A point of a body, ``x`` (m) ahead of its centre of mass; ``body`` None is the ground."""

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
class Axle:
    """Where the road or a wheel force acts: the wheel body and its place ahead of the chassis' centre (m)."""

    name: str
    wheel: str
    x: float


@dataclass(frozen=True)
class Vehicle:
    """Bodies, struts and axles; ``gravity`` (m/s^2) acts down; ``geometry`` exact uses sin and cos of pitch."""

    bodies: tuple[Body, ...]
    struts: tuple[Strut, ...]
    axles: tuple[Axle, ...]
    gravity: float
    geometry: Geometry
    pitch_springs: tuple[PitchSpring, ...] = ()

    @property
    def tyres(self) -> tuple[Strut, ...]:
        """The struts to the ground, in the order of ``struts``."""
        return tuple(strut for strut in self.struts if strut.lower.body is None)

    def coordinates(self) -> tuple[tuple[str, str], ...]:
        """Degrees of freedom in the order of the state, as (body, "z" or "pitch")."""
        heave = [(body.name, "z") for body in self.bodies]
        return (*heave, *((body.name, "pitch") for body in self.bodies if body.pitch_inertia is not None))
