"""Engine-neutral description of a vehicle in space, from which Exudyn, MuJoCo and the analytic mass, damping and
stiffness matrices are built.

Axes of ride (see ``models.ride``): x forward, y left, z up from the ground. Every point is given in metres where it
lies in the **design position**, all coordinates zero, in which every body is parallel to the axes. The laws below are
exact, not linearised. "Along a" means along a direction that is fixed in a **frame**: in the axes of the body that a
spring or a bar names, or in the space where it names none.

Which frame stands for none is the law of a system: the space in ride, the carrier in handling (``free_vehicle``), the
chassis under hub forces (``cut_vehicle``); each of them names it when it makes its vehicle.
"""

from bisect import bisect_right
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np

Vector = tuple[float, float, float]
Freedom = Literal["x", "y", "z", "rx", "ry", "rz"]

FREEDOMS: tuple[Freedom, ...] = ("x", "y", "z", "rx", "ry", "rz")
"""Order in which the freedoms of a body are applied and counted."""
PARALLEL: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
"""Directions of a body's freedoms by default: along the vehicle's axes."""


@dataclass(frozen=True)
class Body:
    """A rigid body with its centre of mass at ``position`` (m), its joint there, and what it may do.

    mass in kg; inertia: tensor (kg m^2) about the centre of mass, axes parallel to the vehicle's, rows of the matrix
    (products of inertia as tensor entries, -int x z dm). A body rides on its ``parent``, or on the space if None:

        c = c_parent + R_parent (position - position_parent + (x, y, z)),    R = R_parent Rx(rx) Ry(ry) Rz(rz),

    c its centre, R its rotation, with the coordinates of ``freedoms`` (in the order of FREEDOMS) and zero for every
    other one: translation along the parent's axes, then turning about its own x, then new y, then new z.

    axes : right-handed directions that stand for x, y and z in all six freedoms, unit vectors in the design position,
    rows of the matrix; with A their transpose, c = c_parent + R_parent (... + A (x, y, z)) and R = R_parent A Rx Ry Rz
    A^T. All else of the body stays parallel to the vehicle's axes. Other than PARALLEL, only models of ``twinrig twin``
    have them.
    """

    name: str
    mass: float
    position: Vector
    freedoms: tuple[Freedom, ...]
    inertia: tuple[Vector, Vector, Vector] = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    parent: str | None = None
    axes: tuple[Vector, Vector, Vector] = PARALLEL

    def direction(self, freedom: Freedom) -> Vector:
        """Unit vector (3,) along or about which a freedom moves the body, in the design position."""
        return self.axes[FREEDOMS.index(freedom) % 3]


@dataclass(frozen=True)
class JointElement:
    """Spring, damper, constant force and geared rotor along a sum of coordinates, d = sum of factor q over coordinates
    q.

    F = preload + stiffness d + damping d' + inertia d'' acts as -factor F on each of the ``coordinates`` (body,
    freedom). preload (N or N m), stiffness (N/m, N m/rad), damping (N s/m, N m s/rad), inertia (kg, kg m^2): of what
    turns with d alone, as the rotor of a gear motor does ("armature"). ``models.own_model`` reads them from MJCF and
    URDF; in a vehicle of a scene ``preload`` is the preload that ``spatial_linear.static_preloads`` finds."""

    name: str
    coordinates: tuple[tuple[str, Freedom], ...]
    factors: tuple[float, ...]
    stiffness: float = 0.0
    damping: float = 0.0
    preload: float = 0.0
    inertia: float = 0.0


@dataclass(frozen=True)
class Curve:
    """Force (N) over travel (m) or over its rate (m/s), piecewise linear; the outer pieces extend to infinity.

    ``arguments`` rise strictly, at least two; the curve passes through (0, 0), so that it changes no equilibrium.
    """

    arguments: tuple[float, ...]
    forces: tuple[float, ...]

    def __call__(self, travel_or_rate: float) -> float:
        """Force (N) of the curve at a travel (m) or rate (m/s)."""
        i = self._piece_of(travel_or_rate)
        return self.forces[i] + self._slopes[i] * (travel_or_rate - self.arguments[i])

    def slope_at_rest(self) -> float:
        """Slope of the curve at 0. At a corner it is the mean of both sides, as a central difference gives."""
        slopes, at = self._slopes, self._piece_of(0.0)
        if self.arguments[at] == 0.0 and at > 0:
            return 0.5 * (slopes[at - 1] + slopes[at])
        return slopes[at]

    def hinges(self) -> tuple[float, float, tuple[float, ...], tuple[float, ...]]:
        """Equivalent form of the curve, force = offset + slope x + sum of bend max(x - corner, 0): offset (N), first
        slope, corners, bends."""
        slopes, x = self._slopes, self.arguments
        bends = tuple(after - before for before, after in pairwise(slopes))
        return self.forces[0] - slopes[0] * x[0], slopes[0], x[1:-1], bends

    @cached_property
    def _slopes(self) -> list[float]:
        x, f = self.arguments, self.forces
        return [(f[i + 1] - f[i]) / (x[i + 1] - x[i]) for i in range(len(x) - 1)]

    def _piece_of(self, travel_or_rate: float) -> int:
        """Index of the curve's straight piece that contains the argument; outer pieces extend to infinity."""
        return bisect_right(self.arguments, travel_or_rate, 1, len(self.arguments) - 1) - 1


@dataclass(frozen=True)
class SpringDamper:
    """Spring, damper, force curves and dry friction between a point p1 fixed to ``first_body`` and a point p2 fixed to
    ``second_body``.

    With a = ``axis`` (a unit vector fixed in ``frame``) and d = a . (p2 - p1) less its value in the design position,

        F = F0 + k d + c d' + travel_force(d) + rate_force(d') + friction tanh(d' / friction_rate),

    acts as +F a at p1 on the first body and as -F a at p2 on the second (None: the ground). With the first above, the
    second below and a up, travel d and force F are positive in compression. F0 is the preload of
    ``spatial_linear.static_preloads``, 0 without gravity. The two forces are equal and opposite; the couple (p1 - p2) x
    F a of the pair is taken up by the frame, which keeps a. It is 0 where p2 - p1 is 0 or along a, as in most
    suspensions at rest. Where it is not, as with a spring beside the wheel that it carries, bodies that turn together
    strain a spring whose frame is the space.

    first_point, second_point (m), stiffness (N/m), damping (N s/m), friction (N), friction_rate (m/s); frame: the body
    in whose axes a is fixed, None for the space."""

    name: str
    first_body: str
    second_body: str | None
    first_point: Vector
    second_point: Vector
    axis: Vector
    stiffness: float
    damping: float
    travel_force: Curve | None = None
    rate_force: Curve | None = None
    friction: float = 0.0
    friction_rate: float = 0.01
    frame: str | None = None

    @property
    def is_nonlinear(self) -> bool:
        """Whether the spring is nonlinear: it has curves or dry friction."""
        return bool(self.travel_force or self.rate_force or self.friction)


@dataclass(frozen=True)
class AntiRollBar:
    """Anti-roll bar between a body that rolls and the points ``left`` and ``right`` of an axle's bodies.

    With e = rx - (h_left - h_right) / (y_left - y_right), rx the body's own roll coordinate (rad) and h how far each
    point has risen from its design position along z of ``frame``, the moment M = M0 + stiffness e + damping e' (N m)
    acts as -M on the coordinate rx, as the force +M / (y_left - y_right) along z at left and as the opposite one at
    right. In the space (None) the body has no parent, so that -M turns it about the space's x. Where the frame is the
    body itself, rx counts as 0, and -M is the couple of the two forces. M0 is the preload.
    """

    name: str
    body: str
    left: str
    right: str
    point_left: Vector
    point_right: Vector
    stiffness: float
    damping: float = 0.0
    frame: str | None = None

    @property
    def track(self) -> float:
        """Lateral distance (m) of the two points of the bar, positive."""
        return self.point_left[1] - self.point_right[1]


@dataclass(frozen=True)
class Tyre:
    """Vertical spring and damper of a wheel on the road: F = F0 + stiffness (zeta - h) + damping (zeta' - h'), up, at
    ``point`` of ``body``.

    h is how far the point has risen from its design position, zeta the height of the road under it (m). ``axle``
    counts from the front, 0 first. The point is the centre of a wheel, or one end of a rigid axle. A tyre that
    ``pushes_only`` has max(0, min(F, 2 S)) instead, S = F0 + stiffness (zeta - h) what its spring alone has: the law
    of ``models.systems.pitch_plane.effects.lift_off``. spin_inertia : of the wheel about its axle (kg m^2), beside the
    body's; None where the scene says it.
    """

    name: str
    body: str
    point: Vector
    axle: int
    stiffness: float
    damping: float = 0.0
    pushes_only: bool = False
    spin_inertia: float | None = None


@dataclass(frozen=True)
class SideForce:
    """Linear side force of a tyre at ``point`` (on the road, z = 0) fixed to ``body``, along the space's y.

    F = stiffness (roll_steer rx + rz - y' / v), y' the velocity (m/s) of the point along y, v the vehicle's speed,
    rx and rz coordinates of ``chassis``. stiffness in N/rad; roll_steer in rad/rad.
    """

    name: str
    body: str
    point: Vector
    chassis: str
    stiffness: float
    roll_steer: float = 0.0


@dataclass(frozen=True)
class Drag:
    """Aerodynamic drag force -coefficient v x' along x at the centre of ``body``; x' is its velocity relative to the
    vehicle's speed v (m/s).

    coefficient in N s^2/m^2.
    """

    body: str
    coefficient: float


PointKind = Literal["acceleration", "velocity", "displacement"]
TurnKind = Literal["angular acceleration", "angular velocity", "angle"]
PartKind = Literal["travel", "travel rate", "force"]
TyreKind = Literal["tyre force", "tyre deflection"]


@dataclass(frozen=True)
class PointOutput:
    """Output of a point of a body along ``axis``: acceleration (m/s^2), velocity (m/s) or displacement (m)."""

    name: str
    kind: PointKind
    body: str
    point: Vector
    axis: Vector


@dataclass(frozen=True)
class TurnOutput:
    """Output of a body's rotation about ``axis``: its angular acceleration (rad/s^2), angular velocity (rad/s), or
    small angle (rad)."""

    name: str
    kind: TurnKind
    body: str
    axis: Vector


@dataclass(frozen=True)
class PartOutput:
    """Output of a spring-damper: travel d (m), its rate (m/s), or force minus preload (N); of a bar: twist angle, its
    rate or its moment."""

    name: str
    kind: PartKind
    part: str


@dataclass(frozen=True)
class TyreOutput:
    """Output of a tyre: force minus static load (N, positive when the tyre presses harder), or deflection zeta - h (m)
    of road height zeta minus wheel rise h."""

    name: str
    kind: TyreKind
    tyre: str


@dataclass(frozen=True)
class ReductionLimits:
    """Limits that make up a reduced vehicle, for small motion only: bodies without mass, rigid springs, locked
    freedoms.

    Names of ``massless`` bodies and ``rigid`` springs, and ``locked`` freedoms as (body, freedom). Rigid springs and
    locked freedoms leave q = N r with fewer coordinates r; bodies without mass leave a mass matrix that may be singular
    (see ``models.ride.excited``): nothing is taken to a limit with large numbers.
    """

    massless: frozenset[str] = frozenset()
    rigid: frozenset[str] = frozenset()
    locked: frozenset[tuple[str, Freedom]] = frozenset()

    def __bool__(self) -> bool:
        return bool(self.massless or self.rigid or self.locked)


NO_LIMITS = ReductionLimits()

SpatialOutput = PointOutput | TurnOutput | PartOutput | TyreOutput


@dataclass(frozen=True)
class SpatialVehicle:
    """Vehicle in space: bodies (parents before their children), forces between them, and outputs.

    ``gravity`` (m/s^2) acts along -z on every body. At 0 the vehicle is unloaded; above, the spring-dampers, bars
    and tyres carry the preloads that make the design position the equilibrium on a flat road. ``axles``: places x (m)
    of the axles from the front. ``limits`` : what a reduced vehicle has not, for closed forms of ride alone.
    ``joint_elements`` : what acts along coordinates themselves. ``ranges`` : lowest and highest values (m, rad) of
    coordinates whose stops are left out. ``notes`` : sentences on what reading a file left out or changed. ``towed`` :
    bodies that another one tows, each fixed to a massless body at its hitch, whose turns are the joint between both.
    """

    name: str
    bodies: tuple[Body, ...]
    springs: tuple[SpringDamper, ...]
    tyres: tuple[Tyre, ...]
    axles: tuple[float, ...]
    bars: tuple[AntiRollBar, ...] = ()
    side_forces: tuple[SideForce, ...] = ()
    drags: tuple[Drag, ...] = ()
    outputs: tuple[SpatialOutput, ...] = ()
    gravity: float = 0.0
    limits: ReductionLimits = NO_LIMITS
    joint_elements: tuple[JointElement, ...] = ()
    ranges: tuple[tuple[tuple[str, Freedom], float, float], ...] = ()
    notes: tuple[str, ...] = ()
    towed: tuple[str, ...] = ()

    def coordinates(self) -> tuple[tuple[str, Freedom], ...]:
        """Coordinates of the vehicle in the order of the state: body by body, freedoms in the order of FREEDOMS."""
        return tuple((body.name, freedom) for body in self.bodies for freedom in FREEDOMS if freedom in body.freedoms)

    @property
    def lifts(self) -> bool:
        """Whether at least one tyre may leave the road."""
        return any(tyre.pushes_only for tyre in self.tyres)

    def with_tyres(self, pushes_only: bool) -> "SpatialVehicle":
        """The vehicle with ``pushes_only`` set to this value for all tyres."""
        return replace(self, tyres=tuple(replace(tyre, pushes_only=pushes_only) for tyre in self.tyres))

    def in_frame(self, frame_body: str) -> "SpatialVehicle":
        """The vehicle in which every spring and bar without a frame gets the body ``frame_body`` as its frame."""
        return replace(
            self,
            springs=tuple(replace(spring, frame=spring.frame or frame_body) for spring in self.springs),
            bars=tuple(replace(bar, frame=bar.frame or frame_body) for bar in self.bars),
        )

    def body(self, body_name: str) -> Body:
        """The body with this name; KeyError if there is none."""
        return {body.name: body for body in self.bodies}[body_name]

    def chain(self, body_name: str | None) -> tuple[str, ...]:
        """Names of a body and of all bodies that carry it, down to the one without parent; empty for None, the
        ground."""
        return () if body_name is None else (body_name, *self.chain(self.body(body_name).parent))

    def towed_under(self, body_name: str | None) -> str | None:
        """Name of the towed body that is, or carries, the given body; None if there is none."""
        return next((body for body in self.chain(body_name) if body in self.towed), None)

    def turns(self, body_name: str | None) -> bool:
        """Whether a body can rotate, by its own freedoms or by those of bodies that carry it."""
        return any(freedom.startswith("r") for body in self.chain(body_name) for freedom in self.body(body).freedoms)


def hitch_of(towed_body: str) -> str:
    """Name of the massless body at the hitch of a towed body."""
    return f"{towed_body} hitch"


def point_mass_inertia(mass: float, arm: np.ndarray) -> np.ndarray:
    """Inertia (3, 3) of a point mass (kg) at an arm (3,) in m, in kg m^2."""
    return mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
