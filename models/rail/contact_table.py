"""Contact of a wheelset with profiles, over its lateral displacement and yaw: the Manchester contact benchmark.

The wheelset is held at a lateral displacement and a yaw angle. Its roll and the approach of each wheel follow from the
vertical load of each wheel; both wheels carry the same. Without friction the vertical parts of the normal forces make
up the load. With friction the wheelset rolls at a speed; creep forces come in, and its speed of spin is such that they
have no moment about the axle.

Normal contact is that of Kalker's simplified non-Hertzian theory (``models.contact.simplified_theory``), each patch
with an area of its own, the patches of one wheel with the vertical approach in common.

Benchmark: Shackleton and Iwnicki, Vehicle System Dynamics 46 (2008) 129-149; case A-1 without yaw, A-2 with 2.4 mrad
for each mm. The load of 10 kN on each wheel and the steps of 0.5 mm are those that CONTACT's example files give.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from models.contact.inputs import quantity
from models.contact.material import Pair
from models.contact.profiles import Profile
from models.contact.simplified_theory import NormalContact, PatchPressure, press, roll
from models.contact.standard_profiles import s1002, uic60
from models.contact.wheel_on_rail import Pose, Side, Touch, Track, Wheelset, laid, placed, touches_of
from models.errors import RunFailed

BENCHMARK_SHIFTS = tuple(0.5e-3 * k for k in range(21))
"""m"""
BENCHMARK_YAW = 2.4
"""rad of yaw for each m of lateral displacement in case A-2."""
BENCHMARK_LOAD, BENCHMARK_SPEED, BENCHMARK_FRICTION = 1.0e4, 2.0, 0.3
"""N on each wheel; m/s; coefficient of friction."""
ROLLS = 3
"""Times that the roll angle is found anew with the approaches of both wheels."""
ITERATIONS = 60
SLIDE = 0.05
"""Share of the nominal speed of spin within which the one without moment is looked for."""
CELLS = 31
"""Strips of a patch, and cells along each."""


@dataclass(frozen=True)
class Place:
    """One patch of one wheel; the left wheel as in a mirror, so that y and fy point away from the track's middle.

    touch_y, y : first touch and centre of pressure, on the rail from the middle of the track (m). x : of the centre of
    pressure, ahead of the axle's middle (m). wheel_y : of first touch, on the wheel from the taping line (m). angle :
    of the rail's surface at first touch (rad), negative where it falls towards the middle. rolling_radius : at first
    touch (m). curvature_x, curvature_y : second derivatives of the undeformed distance there, along and across (1/m).
    normal : N. fx, fy : creep forces on the wheel (N), mz : N m. xi_x, xi_y, spin : creepages at first touch, spin in
    1/m. peak : largest pressure (Pa). area : m^2. approach : vertical, of the wheel (m).
    """

    touch_y: float
    y: float
    x: float
    wheel_y: float
    angle: float
    rolling_radius: float
    curvature_x: float
    curvature_y: float
    normal: float
    fx: float
    fy: float
    mz: float
    xi_x: float
    xi_y: float
    spin: float
    peak: float
    area: float
    approach: float


@dataclass(frozen=True)
class Placed:
    """Contact at one lateral displacement (m) and yaw (rad): roll (rad), speed of spin (rad/s), the patches."""

    shift: float
    yaw: float
    roll: float
    spin_speed: float
    right: tuple[Place, ...]
    left: tuple[Place, ...]


@dataclass(frozen=True, eq=False)
class Carried:
    """One wheel under its load: each patch pressed, and what rolling does to it (N, N, N m), in a mirror if left."""

    touches: list[Touch]
    pressed: NormalContact
    creepages: list[tuple[float, float, float]]
    forces: list[tuple[float, float, float]]
    moment: float


@dataclass(frozen=True, eq=False)
class Contact:
    """Profiles, track and wheelset in touch. load : N on each wheel. speed : m/s. friction : 0 for a smooth contact."""

    wheel: Profile
    rail: Profile
    track: Track
    wheelset: Wheelset
    load: float
    speed: float = BENCHMARK_SPEED
    friction: float = 0.0
    pair: Pair = Pair()  # noqa: RUF009 - a frozen value

    def at(self, shift: float, yaw: float = 0.0) -> Placed:
        """Contact at a lateral displacement (m) to the right and a yaw (rad); raises InputError as wheel_on_rail."""
        quantity("lateral_shift", shift, "a shift in m from -0.03 to 0.03", -0.03, 0.03)
        quantity("yaw", yaw, "a yaw angle in rad from -0.1 to 0.1", -0.1, 0.1)
        side = Side(self.wheel, laid(self.rail, self.track), self.wheelset)
        pose = placed(side, shift, yaw)
        for _ in range(ROLLS):
            spin, right, left = self._balanced(side, pose)
            sunk = (right.pressed.approach, left.pressed.approach)
            turned = placed(side, shift, yaw).roll + (sunk[0] - sunk[1]) / self._span(side, pose, right, left)
            pose = replace(pose, roll=turned)
        spin, right, left = self._balanced(side, pose)
        return Placed(shift, yaw, pose.roll, spin, _places(side, right, self.wheel), _places(side, left, self.wheel))

    def _span(self, side: Side, pose: Pose, right: Carried, left: Carried) -> float:
        """Distance (m) of the two wheels' first touches, over which a difference in approach makes roll."""
        return sum(one.touches[0].wheel_y + side.wheelset.arm for one in (right, left))

    def _balanced(self, side: Side, pose: Pose) -> tuple[float, Carried, Carried]:
        """Speed of spin (rad/s) without moment about the axle, and both wheels at it."""
        poses = [_lowered(side, Pose(sign * pose.shift, sign * pose.yaw, sign * pose.roll, 0.0)) for sign in (1.0, -1.0)]
        touches = [touches_of(side, one) for one in poses]
        rolling = -self.speed / side.wheelset.radius

        def both(spin: float) -> list[Carried]:
            return [self._carried(side, one, found, spin) for one, found in zip(poses, touches, strict=True)]

        if self.friction > 0.0:
            bounds = (rolling * (1.0 - SLIDE), rolling * (1.0 + SLIDE))
            rolling = float(brentq(lambda spin: sum(one.moment for one in both(spin)), *bounds, xtol=1e-9))
        right, left = both(rolling)
        return rolling, right, left

    def _carried(self, side: Side, pose: Pose, touches: list[Touch], spin: float) -> Carried:
        """One wheel with normal forces such that they and the creep forces carry its load."""
        creepages = [self._creepage(side, pose, touch, spin) for touch in touches]
        normal = self.load
        for _ in range(ITERATIONS):
            pressed = press([touch.patch for touch in touches], self.pair, load=normal)
            forces = [self._rolled(pressed, touch, creep) for touch, creep in zip(touches, creepages, strict=True)]
            lifted = sum(force[1] * math.sin(touch.angle) for force, touch in zip(forces, touches, strict=True))
            if abs(normal - lifted - self.load) < 1e-9 * self.load:
                moment = sum(_moment(side, pose, touch, force) for touch, force in zip(touches, forces, strict=True))
                return Carried(touches, pressed, creepages, forces, moment)
            normal *= self.load / (normal - lifted)
        raise RunFailed("contact table", f"no normal force was found that carries {self.load:g} N")

    def _creepage(self, side: Side, pose: Pose, touch: Touch, spin: float) -> tuple[float, float, float]:
        """Creepages and spin (1/m) at a place of first touch."""
        if self.friction == 0.0:
            return 0.0, 0.0, 0.0
        axle, place = pose.turn[:, 1], _arm(side, pose, touch)
        velocity = spin * np.cross(axle, place) + np.array([self.speed, 0.0, 0.0])
        across, into = _axes(touch)
        return (float(velocity[0] / self.speed), float(velocity @ across / self.speed),
                float(spin * axle @ into / self.speed))  # fmt: skip

    def _rolled(self, pressed: NormalContact, touch: Touch, creep: tuple[float, float, float]
                ) -> tuple[float, float, float]:  # fmt: skip
        """Creep forces of one patch (N, N, N m)."""
        part = _part(pressed, touch)
        if part is None or self.friction == 0.0:
            return 0.0, 0.0, 0.0
        found = roll(replace(pressed, patches=(part,)), self.friction, *creep, cells=CELLS)
        return found.fx, found.fy, found.mz


def manchester(*, yaw: bool = False, rolling: bool = False, shifts: Iterable[float] = BENCHMARK_SHIFTS) -> list[Placed]:
    """The benchmark's case A-1 (``yaw``: A-2), without friction or rolling with it, at lateral displacements in m."""
    contact = Contact(s1002(), uic60(), Track(), Wheelset(), BENCHMARK_LOAD,
                      friction=BENCHMARK_FRICTION if rolling else 0.0)  # fmt: skip
    return [contact.at(shift, BENCHMARK_YAW * shift if yaw else 0.0) for shift in shifts]


def rolling_radius_difference(placed_at: Placed) -> float:
    """Rolling radius of the right wheel less that of the left one (m), each at the patch that carries most."""
    right, left = (max(places, key=lambda place: place.normal) for places in (placed_at.right, placed_at.left))
    return right.rolling_radius - left.rolling_radius


def equivalent_conicity(shifts: np.ndarray, differences: np.ndarray, amplitude: float) -> float:
    """Conicity of the cones whose first harmonic is that of profiles moving sideways as amplitude (m) times a sine.

    shifts : (n,) m, ascending, from -amplitude to amplitude at least, or from 0 on for profiles alike on both sides;
    differences : (n,) of the rolling radii (m), right less left.
    """
    shifts, differences = np.asarray(shifts, float), np.asarray(differences, float)
    if shifts[0] == 0.0:
        shifts = np.concatenate([-shifts[:0:-1], shifts])
        differences = np.concatenate([-differences[:0:-1], differences])
    quantity("amplitude", amplitude, f"an amplitude in m, above 0 and up to {shifts[-1]:g}", 1e-9, shifts[-1])
    phase = 2.0 * math.pi * (np.arange(720) + 0.5) / 720
    values = np.interp(amplitude * np.sin(phase), shifts, differences)
    return float((values * np.sin(phase)).mean() / amplitude)


def _lowered(side: Side, pose: Pose) -> Pose:
    """The pose at the height at which this side's wheel just touches."""
    return replace(pose, fall=side.clearance(pose))


def _axes(touch: Touch) -> tuple[np.ndarray, np.ndarray]:
    """Directions along the rail's surface and into the rail, in the track."""
    cosine, sine = math.cos(touch.angle), math.sin(touch.angle)
    return np.array([0.0, cosine, sine]), np.array([0.0, -sine, cosine])


def _radius(side: Side, touch: Touch) -> float:
    return side.wheelset.radius + float(side.wheel.curve(touch.wheel_y))


def _arm(side: Side, pose: Pose, touch: Touch) -> np.ndarray:
    """From the wheelset's centre to a place of first touch, in the track (m)."""
    down = math.sqrt(_radius(side, touch) ** 2 - touch.x**2)
    return pose.turn @ np.array([touch.x, side.wheelset.arm + touch.wheel_y, down])


def _moment(side: Side, pose: Pose, touch: Touch, force: tuple[float, float, float]) -> float:
    """Moment (N m) of a patch's creep forces about the axle."""
    across, into = _axes(touch)
    whole = force[0] * np.array([1.0, 0.0, 0.0]) + force[1] * across
    return float(pose.turn[:, 1] @ (np.cross(_arm(side, pose, touch), whole) + force[2] * into))


def _part(pressed: NormalContact, touch: Touch) -> PatchPressure | None:
    return next((part for part in pressed.patches if part.patch is touch.patch), None)


def _places(side: Side, carried: Carried, wheel: Profile) -> tuple[Place, ...]:
    """What a wheel's patches report, those that carry something."""
    found = []
    for touch, creep, force in zip(carried.touches, carried.creepages, carried.forces, strict=True):
        part = _part(carried.pressed, touch)
        if part is not None:
            found.append(_place(side, carried.pressed, part, touch, creep, force))
    return tuple(found)


def _place(side: Side, pressed: NormalContact, part: PatchPressure, touch: Touch, creep: tuple[float, float, float],
           force: tuple[float, float, float]) -> Place:  # fmt: skip
    alone = replace(pressed, patches=(part,))
    fields = roll(alone, 0.0, 0.0, 0.0, 0.0, cells=CELLS).fields[0]
    weight = fields.pressure * fields.dx * fields.dy
    area = float((fields.dx * fields.dy).sum())
    across, along = (float((weight * values).sum() / weight.sum()) for values in (fields.y, fields.x))
    touch_y = touch.rail_y + float(side.rail.y[np.argmin(side.rail.z)])
    distance = part.patch.distance
    step = 4.0 * distance.dx, 4.0 * distance.dy
    curvature = [(distance.at(np.array(x), np.array(y)) + distance.at(np.array(-x), np.array(-y))
                  - 2.0 * distance.at(np.array(0.0), np.array(0.0))) / (x + y) ** 2
                 for x, y in ((step[0], 0.0), (0.0, step[1]))]  # fmt: skip
    return Place(touch_y, touch_y + across * math.cos(touch.angle), touch.x + along, touch.wheel_y, touch.angle,
                 _radius(side, touch), *map(float, curvature), part.load, *force, *creep,
                 float(fields.pressure.max()), area, pressed.approach)  # fmt: skip
