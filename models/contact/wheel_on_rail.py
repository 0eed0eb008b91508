"""Geometry of a wheel on a rail: where the profiles touch, and the undeformed distance around each touching place.

The wheel is a body of revolution, the rail straight along x. Axes of the track: x in the direction of rolling, y to
the right, z down. The wheelset is shifted to the right, turned by the yaw (about z, positive from x to y) and rolled
(about x) so far that both wheels touch; then it is lowered. The right wheel is described; the left one is its mirror
image, with shift, yaw and roll reversed.

Touching
    Of every circle of the wheel one point is nearest to a straight rail: where the wheel's normal is square to x.
    These points form the wheel's outline, seen along x (Wickens; also "locus of contact points"). The vertical gap of
    outline and rail has a minimum at every place that can touch.
Distance
    At each minimum a plane touches the rail. Over this plane both surfaces are heights, and the difference of the
    heights is the distance, by Newton's method on the wheel's surface itself: rolling radius, yaw and roll are all in
    it.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from models.contact.inputs import Array, checked_quantity
from models.contact.patches import Patch, ridge_indices
from models.contact.profiles import ContactProfile
from models.contact.undeformed_distance import UndeformedDistance
from models.core.errors import InputError, RunFailed

SURROUNDINGS_DISTANCE = 2e-4
"""Distance (m) between the surfaces up to which the surroundings of a touching place are included; steel yields long
before.
"""
NODE_COUNT = 121
"""Number of nodes of an undeformed distance along each axis."""
LARGEST_ROLL = 0.06
"""Largest roll angle (rad) of the wheelset that is searched."""
ITERATION_COUNT = 12


@dataclass(frozen=True)
class TrackGeometry:
    """Track geometry. gauge : between the rails (m), measured ``gauge_depth`` below their tops (m). inclination : of
    the rails (rad)."""

    gauge: float = 1.435
    gauge_depth: float = 0.014
    inclination: float = 0.025


@dataclass(frozen=True)
class WheelsetGeometry:
    """Wheelset geometry. radius : at the taping line (m). back_to_back : between the flanges' backs (m). taping :
    distance of the taping line from the back (m)."""

    radius: float = 0.46
    back_to_back: float = 1.360
    taping: float = 0.070

    @property
    def arm(self) -> float:
        """Distance from the middle of the axle to a taping line (m)."""
        return self.back_to_back / 2.0 + self.taping


@dataclass(frozen=True, eq=False)
class WheelsetPose:
    """Position and attitude of the wheelset, seen from one side.

    shift : towards this side's rail (m). yaw, roll : rad. fall : of the axle (m) below the height at which the taping
    line is level with the top of the rail.
    """

    shift: float
    yaw: float
    roll: float
    fall: float

    @cached_property
    def rotation(self) -> Array:
        """Rotation (3, 3) from the wheelset to the track: roll, then yaw."""
        (cr, sr), (cy, sy) = ((np.cos(a), np.sin(a)) for a in (self.roll, self.yaw))
        return np.array([[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]]) @ np.array(
            [[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]]
        )


@dataclass(frozen=True, eq=False)
class TouchingPlace:
    """A place where wheel and rail touch, or would if they came closer.

    gap : vertical gap (m), 0 at the place that touches but for some nanometres. angle : of the rail's surface (rad),
    negative where it falls towards the gauge corner. wheel_y, rail_y : place on the profiles (m; rail: from the rail's
    highest point after inclination). x : ahead of the axle, square to it (m). patch : undeformed distance around it, x
    and y from the place, y along the surface.
    """

    gap: float
    angle: float
    wheel_y: float
    rail_y: float
    x: float
    patch: Patch


@dataclass(frozen=True, eq=False)
class WheelAndRail:
    """One wheel on one rail. rail : in its position in the track, y from the middle of the track."""

    wheel: ContactProfile
    rail: ContactProfile
    wheelset: WheelsetGeometry

    def axle_centre(self, wheelset_pose: WheelsetPose) -> Array:
        """Position (3,) of the middle of the axle in the track's coordinates (m)."""
        return np.array([0.0, wheelset_pose.shift, wheelset_pose.fall - self.wheelset.radius])

    def outline(self, wheelset_pose: WheelsetPose) -> Array:
        """Points (n, 3) of the wheel's surface nearest to straight rails, in the track's coordinates (m)."""
        y, radius = self.wheel.y, self.wheelset.radius + self.wheel.z
        lead = np.sin(wheelset_pose.roll) * np.tan(wheelset_pose.yaw)
        sine = -self.wheel.curve(y, 1) * np.cos(wheelset_pose.roll) * np.tan(wheelset_pose.yaw) / np.hypot(1.0, lead)
        angle = np.arcsin(np.clip(sine, -1.0, 1.0)) - np.arctan(lead)
        points = np.column_stack([radius * np.sin(angle), self.wheelset.arm + y, radius * np.cos(angle)])
        return points @ wheelset_pose.rotation.T + self.axle_centre(wheelset_pose)

    def gaps(self, wheelset_pose: WheelsetPose) -> tuple[Array, Array]:
        """Points of the wheel's outline (n, 3) above the rail, and the vertical gap (m) between each point and the
        rail."""
        points = self.outline(wheelset_pose)
        over = (points[:, 1] >= self.rail.y[0]) & (points[:, 1] <= self.rail.y[-1])
        over &= np.append(np.diff(points[:, 1]) > 0.0, True)
        if np.count_nonzero(over) < 10:
            raise InputError(
                "",
                "lateral_shift",
                wheelset_pose.shift,
                "leaves no part of the wheel above the rail: profiles, "
                "radius, back_to_back, gauge and shift do not fit",
            )
        return points[over], self.rail.curve(points[over, 1]) - points[over, 2]

    def clearance(self, wheelset_pose: WheelsetPose) -> float:
        """Least vertical gap (m) between wheel and rail, refined between the points by a parabola."""
        gap = self.gaps(wheelset_pose)[1]
        k = int(np.clip(np.argmin(gap), 1, gap.size - 2))
        rise, bend = _parabola_derivatives(gap, k)
        return float(gap[k] - 0.5 * rise**2 / bend) if bend > abs(rise) else float(gap.min())


def _parabola_derivatives(gaps: Array, point_index: int) -> tuple[float, float]:
    """First and second derivative, per step, of the parabola through the gaps at k - 1, k, k + 1."""
    return (gaps[point_index + 1] - gaps[point_index - 1]) / 2.0, gaps[point_index + 1] - 2.0 * gaps[
        point_index
    ] + gaps[point_index - 1]


def wheel_on_rail(
    wheel: ContactProfile,
    rail: ContactProfile,
    *,
    lateral_shift: float = 0.0,
    yaw: float = 0.0,
    track: TrackGeometry | None = None,
    wheelset: WheelsetGeometry | None = None,
) -> list[TouchingPlace]:
    """Touching places of the right wheel: first the one in contact, then others with vertical gaps below 0.2 mm in
    ascending order.

    wheel, rail : profiles; the rail upright, ``track.inclination`` turns it (0 for one that is measured as it lies).
    lateral_shift : of the wheelset to the right (m). yaw : rad. For the left wheel give both with the other sign.
    The defaults of ``track`` and ``wheelset`` are those of the Manchester contact benchmark.
    Raises InputError for values out of range, or a wheelset so placed that both wheels cannot touch.
    """
    track, wheelset = track or TrackGeometry(), wheelset or WheelsetGeometry()
    checked_quantity("lateral_shift", lateral_shift, "a shift in m from -0.03 to 0.03", -0.03, 0.03)
    checked_quantity("yaw", yaw, "a yaw angle in rad from -0.1 to 0.1", -0.1, 0.1)
    side = WheelAndRail(wheel, rail_in_track(rail, track), wheelset)
    touches = touching_places(side, touching_pose(side, lateral_shift, yaw))
    if not touches:
        raise InputError("", "lateral_shift", lateral_shift, "lets wheel and rail touch at the end of a profile only")
    return touches


def rail_in_track(rail: ContactProfile, track: TrackGeometry) -> ContactProfile:
    """The rail profile as it lies to the right of the track: inclined, its top at z = 0, its gauge face at half the
    gauge.
    """
    inclined = rail.turned(track.inclination) if track.inclination else rail
    y, z = inclined.y, inclined.z - inclined.z.min()
    inner = (y < y[np.argmin(z)]) & (z <= track.gauge_depth)
    if not inner.any() or z[0] < track.gauge_depth:
        raise InputError(
            "",
            "rail",
            float(z[0]),
            f"is the depth (m) to which the gauge side is known; the gauge is measured at {track.gauge_depth:g} m",
        )
    k = int(np.argmax(inner))  # the contour crosses the depth just before this point
    face = y[k] - (y[k] - y[k - 1]) * (track.gauge_depth - z[k]) / (z[k - 1] - z[k])
    return ContactProfile(y - face + track.gauge / 2.0, z, inclined.smoothing)


def lowest_point(wheel_and_rail: WheelAndRail, wheelset_pose: WheelsetPose) -> Array:
    """Point (3,) of the wheel's outline nearest to the rail, refined between the points by a parabola, in the track's
    coordinates (m)."""
    points, gap = wheel_and_rail.gaps(wheelset_pose)
    k = int(np.clip(np.argmin(gap), 1, gap.size - 2))
    share = _parabola_minimum(gap, k)
    return points[k] + abs(share) * ((points[k + 1] if share > 0.0 else points[k - 1]) - points[k])


def _parabola_minimum(gaps: Array, point_index: int) -> float:
    """Offset, in steps from point k, at which the parabola through three gaps has its minimum."""
    rise, bend = _parabola_derivatives(gaps, point_index)
    return float(np.clip(-rise / bend, -0.5, 0.5)) if bend > 0.0 else 0.0


def touching_pose(
    wheel_and_rail: WheelAndRail, lateral_shift: float, yaw: float, left_wheel_and_rail: WheelAndRail | None = None
) -> WheelsetPose:
    """Pose of the wheelset in which both wheels just touch. ``left_wheel_and_rail`` : the mirrored left side, if it
    differs from the right one.
    """
    left_side = left_wheel_and_rail or wheel_and_rail

    def right_over_left(roll: float) -> float:
        return wheel_and_rail.clearance(WheelsetPose(lateral_shift, yaw, roll, 0.0)) - left_side.clearance(
            WheelsetPose(-lateral_shift, -yaw, -roll, 0.0)
        )

    if right_over_left(-LARGEST_ROLL) * right_over_left(LARGEST_ROLL) > 0.0:
        raise InputError(
            "", "lateral_shift", lateral_shift, "lets only one wheel touch: profiles, gauge and shift do not fit"
        )
    roll = float(brentq(right_over_left, -LARGEST_ROLL, LARGEST_ROLL, xtol=1e-13))
    return WheelsetPose(lateral_shift, yaw, roll, wheel_and_rail.clearance(WheelsetPose(lateral_shift, yaw, roll, 0.0)))


def touching_places(wheel_and_rail: WheelAndRail, wheelset_pose: WheelsetPose) -> list[TouchingPlace]:
    """Places where a wheel touches the rail or nearly does: minima of the vertical gap, one between each two ridges."""
    points, gap = wheel_and_rail.gaps(wheelset_pose)
    touches = []
    for first, last in pairwise([0, *ridge_indices(gap), gap.size - 1]):
        k = first + int(np.argmin(gap[first : last + 1]))
        if gap[k] < SURROUNDINGS_DISTANCE and 0 < k < gap.size - 1:
            touches.append(_touching_place(wheel_and_rail, wheelset_pose, points, gap, (first, k, last)))
    return sorted(touches, key=lambda touch: touch.gap)


def _touching_place(
    wheel_and_rail: WheelAndRail,
    wheelset_pose: WheelsetPose,
    outline_points: Array,
    gaps: Array,
    minimum_and_ridges: tuple[int, int, int],
) -> TouchingPlace:
    """One touching place, at the minimum of the parabola through three gaps, with the undeformed distance around it."""
    first, k, last = minimum_and_ridges
    share = _parabola_minimum(gaps, k)
    lowest = outline_points[k] + abs(share) * (
        (outline_points[k + 1] if share > 0.0 else outline_points[k - 1]) - outline_points[k]
    )
    x, y = float(lowest[0]), float(lowest[1])
    angle = float(np.arctan(wheel_and_rail.rail.curve(y, 1)))
    deep = (gaps - gaps[k]) * np.cos(
        angle
    ) > SURROUNDINGS_DISTANCE * 1.5  # where the surroundings end, if not at a ridge
    below, above = np.flatnonzero(deep[first:k]), np.flatnonzero(deep[k : last + 1])
    low, high = first + int(below[-1]) if below.size else first, k + int(above[0]) if above.size else last
    cut = (False, False, low == first and first > 0, high == last and last < gaps.size - 1)
    ends = (outline_points[low, 1] - y) / np.cos(angle), (outline_points[high, 1] - y) / np.cos(angle)
    distance = distance_over(wheel_and_rail, wheelset_pose, np.array([x, y, wheel_and_rail.rail.curve(y)]), angle, ends)
    top = float(wheel_and_rail.rail.y[np.argmin(wheel_and_rail.rail.z)])
    between = np.linspace(top, y, 200)
    along = float(np.trapezoid(np.hypot(1.0, wheel_and_rail.rail.curve(between, 1)), between))
    ahead, across, _ = wheelset_pose.rotation.T @ (lowest - wheel_and_rail.axle_centre(wheelset_pose))
    patch = Patch(distance, cut, abs(angle), along)
    wheel_y = float(across) - wheel_and_rail.wheelset.arm
    return TouchingPlace(patch.low / float(np.cos(angle)), angle, wheel_y, y - top, float(ahead), patch)


def distance_over(
    wheel_and_rail: WheelAndRail,
    wheelset_pose: WheelsetPose,
    contact_point: Array,
    plane_angle: float,
    contour_limits: tuple[float, float],
) -> UndeformedDistance:
    """Undeformed distance over the tangent plane at a contact point of the rail, between two ends along the rail's
    contour.

    contact_point : x, y, z in the track (m); plane_angle : of the plane (rad); contour_limits : ends, from the contact
    point (m).
    """
    half = 1.2 * np.sqrt(2.0 * SURROUNDINGS_DISTANCE * wheel_and_rail.wheelset.radius / np.cos(plane_angle))
    rail_s, rail_n = _rail_heights(wheel_and_rail.rail, contact_point, plane_angle)
    x = np.linspace(-half, half, NODE_COUNT)
    s = np.linspace(max(contour_limits[0], rail_s[0]), min(contour_limits[1], rail_s[-1]), NODE_COUNT)
    return UndeformedDistance(
        x,
        s,
        CubicSpline(rail_s, rail_n)(s)[:, None]
        - _wheel_heights(wheel_and_rail, wheelset_pose, contact_point, plane_angle, x, s),
    )


def _rail_heights(rail: ContactProfile, contact_point: Array, plane_angle: float) -> tuple[Array, Array]:
    """Coordinates (m) of the rail relative to its tangent plane: s along it and n into the rail, where s ascends around
    the place."""
    y, z = rail.y - contact_point[1], rail.z - contact_point[2]
    s, n = y * np.cos(plane_angle) + z * np.sin(plane_angle), z * np.cos(plane_angle) - y * np.sin(plane_angle)
    backward, here = np.flatnonzero(np.diff(s) <= 1e-9), int(np.argmin(np.abs(s)))
    low, high = backward[backward < here], backward[backward >= here]
    keep = slice(int(low[-1]) + 1 if low.size else 0, int(high[0]) + 1 if high.size else s.size)
    return s[keep], n[keep]


def _wheel_heights(
    wheel_and_rail: WheelAndRail,
    wheelset_pose: WheelsetPose,
    contact_point: Array,
    plane_angle: float,
    x: Array,
    contour_positions: Array,
) -> Array:
    """Heights (s, x) of the wheel over the tangent plane, by Newton's method on the condition that the distance to the
    axle is the radius."""
    ahead, along, into = np.array(
        [
            [1.0, 0.0, 0.0],
            [0.0, np.cos(plane_angle), np.sin(plane_angle)],
            [0.0, -np.sin(plane_angle), np.cos(plane_angle)],
        ]
    )
    base = contact_point + x[None, :, None] * ahead + contour_positions[:, None, None] * along
    base, into = (
        (base - wheel_and_rail.axle_centre(wheelset_pose)) @ wheelset_pose.rotation,
        into @ wheelset_pose.rotation,
    )
    curve, slope, arm = wheel_and_rail.wheel.curve, wheel_and_rail.wheel.curve.derivative(), wheel_and_rail.wheelset.arm
    height = np.zeros((contour_positions.size, x.size))
    for _ in range(ITERATION_COUNT):
        q = base + height[..., None] * into
        y, axle = (
            np.clip(q[..., 1] - arm, wheel_and_rail.wheel.y[0], wheel_and_rail.wheel.y[-1]),
            np.hypot(q[..., 0], q[..., 2]),
        )
        short = axle - wheel_and_rail.wheelset.radius - curve(y)
        rate = (q[..., 0] * into[0] + q[..., 2] * into[2]) / axle - slope(y) * into[1]
        step = short / rate
        height -= step
        if np.abs(step).max() < 1e-12:
            return height
    raise RunFailed("wheel on rail", "the wheel's surface was not found around the place of contact")
