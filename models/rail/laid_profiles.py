"""Wheel and rail profiles as a wheelset has them, prepared for the compiled contact of ``profile_contact``."""

from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.contact.inputs import Array
from models.contact.profile_files import ProfileKind, read_profile
from models.contact.profiles import ContactProfile
from models.contact.standard_profiles import BUILT_IN_RAILS, BUILT_IN_WHEELS
from models.contact.wheel_on_rail import (
    TrackGeometry,
    WheelAndRail,
    WheelsetGeometry,
    WheelsetPose,
    rail_in_track,
    touching_pose,
)
from models.core.errors import InputError
from models.core.scene_file import SceneFile
from models.core.strict import Strict, quantity
from models.rail.profile_contact import PROFILE_COUNTS, RAIL_KNOT_RECORD, WHEEL_NODE_RECORD, LaidProfile

BUILT_IN = {"wheel": BUILT_IN_WHEELS, "rail": BUILT_IN_RAILS}
NODE_SPACING, KNOT_SPACING = 1e-4, 2.5e-4
"""Spacing (m) of the nodes along the wheel's contour and of the knots along the rail's."""
LATERAL_SHIFTS = np.arange(-0.012, 0.0120001, 1e-3)
"""Lateral displacements (m) at which the first contact is computed."""
CONTACT_JUMP, DISPLACEMENT_STEP = 3e-3, 1e-6
"""Distance (m) on the wheel that first contact must jump; difference (m) of the two displacements between which it
jumps."""
RIDGE_HEIGHT = 1e-5
"""Height (m) of the gap between both positions of a jump above which the patches count as two."""
BLEND_HALF_LENGTH = 1e-3
"""Half the length (m) of the transition from one zone of the contour to the next."""


class CrossSections(Strict):
    """Cross-sections in place of cones and round heads; the wheel's ``radius`` is that at the taping line.

    wheel, rail : the name of a built-in profile, or a file that ``models.contact.profile_files`` reads.
    """

    wheel: str = Field(default="S1002", description="built-in wheel, or the file of one")
    rail: str = Field(default="UIC60", description="built-in rail, or the file of one")
    smoothing: float = quantity(
        "m", "wavelength of which half is left, for profiles from files", default=0.0, zero=True
    )
    gauge: float = quantity("m", "between the rails, gauge_depth below their tops", default=1.435)
    gauge_depth: float = quantity("m", "below the tops, at which the gauge is measured", default=0.014)
    inclination: float = quantity("rad", "of the rails, towards each other", default=0.025, signed=True)
    back_to_back: float = quantity("m", "between the backs of the flanges", default=1.360)
    taping: float = quantity("m", "from a flange's back to the taping line", default=0.070)

    def with_full_paths(self, scene: SceneFile) -> "CrossSections":
        """These profiles with full paths of the files. Raises InputError for a name that is neither a file nor built
        in."""
        files = {}
        for kind, known in BUILT_IN.items():
            name = getattr(self, kind)
            if Path(name).suffix:
                files[kind] = str(scene.path(name, f"profiles.{kind}"))
            elif name not in known:
                raise InputError(scene.file, f"profiles.{kind}", name, "must be a file or built in", tuple(known))
        return self.model_copy(update=files)

    def wheel_on_rail(self, wheel_radius: float) -> WheelAndRail:
        """The right wheel with a radius (m) on its rail. Raises InputError for files that contain no profile."""
        rail = _contact_profile(self.rail, "rail", self.smoothing)
        return WheelAndRail(
            _contact_profile(self.wheel, "wheel", self.smoothing),
            rail_in_track(rail, TrackGeometry(self.gauge, self.gauge_depth, self.inclination)),
            WheelsetGeometry(wheel_radius, self.back_to_back, self.taping),
        )

    def first_touch_pose(self, wheel_radius: float, lateral_shift: float) -> tuple[float, float]:
        """Fall (m, downwards) of the wheelset from its height in the middle of the track, and roll (rad), at which both
        wheels just touch at a lateral displacement (m). Raises InputError if they cannot."""
        wheel_on_rail = self.wheel_on_rail(wheel_radius)
        pose = touching_pose(wheel_on_rail, lateral_shift, 0.0)
        return pose.fall - wheel_on_rail.clearance(WheelsetPose(0.0, 0.0, 0.0, 0.0)), pose.roll


def _contact_profile(profile_name: str, profile_kind: ProfileKind, smoothing: float) -> ContactProfile:
    known = BUILT_IN[profile_kind]
    if profile_name in known:
        return known[profile_name]()
    if not Path(profile_name).suffix:
        raise InputError("", profile_kind, profile_name, "is neither built in nor a file", tuple(known))
    return read_profile(profile_name, profile_kind, smoothing=smoothing)


@cache
def laid_profile(profiles: CrossSections, wheel_radius: float) -> LaidProfile:
    """``LaidProfile`` that ``profile_on_rail`` reads, for wheels with a radius (m) at the taping line."""
    from scipy.interpolate import CubicSpline

    wheel_on_rail = profiles.wheel_on_rail(wheel_radius)
    tip = int(np.argmax(wheel_on_rail.wheel.z))
    y = _evenly_spaced(wheel_on_rail.wheel.y[tip:], wheel_on_rail.wheel.z[tip:], NODE_SPACING)
    curve = wheel_on_rail.wheel.curve
    touched = [
        (shift, touch[0])
        for shift in LATERAL_SHIFTS.tolist()
        if (touch := _first_contact(wheel_on_rail, shift)) is not None
    ]
    cuts = [cut for cut in (_ridge_position(wheel_on_rail, *pair) for pair in pairwise(touched)) if cut is not None]
    nodes = np.column_stack([y, wheel_radius + curve(y), curve(y, 1), _zones_of_positions(y, cuts)])
    knots = _evenly_spaced(wheel_on_rail.rail.y, wheel_on_rail.rail.z, KNOT_SPACING)
    cubic = CubicSpline(knots, wheel_on_rail.rail.curve(knots)).c
    rail = np.column_stack([knots, np.vstack([cubic[::-1].T, np.zeros(4)])])
    level = wheel_on_rail.clearance(WheelsetPose(0.0, 0.0, 0.0, 0.0)) - wheel_radius
    head = [[int(nodes[:, 3].max()) + 1, len(nodes), len(rail), NODE_SPACING, wheel_on_rail.wheelset.arm, level]]
    return LaidProfile(
        *(
            _read_only_records(*pair)
            for pair in ((head, PROFILE_COUNTS), (nodes, WHEEL_NODE_RECORD), (rail, RAIL_KNOT_RECORD))
        )
    )


def empty_profile() -> LaidProfile:
    """An empty profile, for a wheelset on cones: no zones, nodes or knots."""
    return LaidProfile(np.zeros(1, PROFILE_COUNTS), np.empty(0, WHEEL_NODE_RECORD), np.empty(0, RAIL_KNOT_RECORD))


def _read_only_records(number_rows: Any, record_type: np.dtype) -> Array:
    """Read-only records (n,) from rows of numbers."""
    records_array = np.ascontiguousarray(number_rows, float).view(record_type)[:, 0]
    records_array.flags.writeable = False
    return records_array


def _evenly_spaced(y: Array, z: Array, spacing: float) -> Array:
    """Positions y at even distances (m) along a contour."""
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(y), np.diff(z)))])
    return np.interp(np.arange(0.0, length[-1], spacing), length, y)


def _first_contact(wheel_and_rail: WheelAndRail, lateral_shift: float) -> tuple[float, Array, Array] | None:
    """Position of first contact on the wheel (m from the taping line), all positions of the outline, and their gaps
    (m). None where the profiles do not meet."""
    try:
        pose = touching_pose(wheel_and_rail, lateral_shift, 0.0)
    except InputError:
        return None
    points, gap = wheel_and_rail.gaps(pose)
    y_positions = points[:, 1] - lateral_shift - wheel_and_rail.wheelset.arm
    return float(y_positions[np.argmin(gap)]), y_positions, gap


def _ridge_position(
    wheel_and_rail: WheelAndRail, touch_before: tuple[float, float], touch_after: tuple[float, float]
) -> float | None:
    """Position (m) of the largest gap between the two contact positions of a jump. ``touch_before`` and ``touch_after``
    are pairs (shift, position). None if contact does not jump between them."""
    while abs(touch_after[1] - touch_before[1]) > CONTACT_JUMP:
        middle = (touch_before[0] + touch_after[0]) / 2.0
        touch = _first_contact(wheel_and_rail, middle)
        if touch is None:
            return None
        contact_y, y_positions, gap = touch
        low, high = sorted((touch_before[1], touch_after[1]))
        if touch_after[0] - touch_before[0] < DISPLACEMENT_STEP:
            between = (y_positions > low) & (y_positions < high)
            return float(y_positions[between][np.argmax(gap[between])]) if gap[between].max() > RIDGE_HEIGHT else None
        if abs(contact_y - touch_before[1]) > abs(contact_y - touch_after[1]):
            touch_after = middle, contact_y
        else:
            touch_before = middle, contact_y
    return None


def _zones_of_positions(y: Array, zone_borders: list[float]) -> Array:
    """Zone (n,) of positions on the wheel: a whole number, or a fraction in the smooth transition between two zones."""
    zones = np.zeros(y.size)
    for cut in zone_borders:
        t = np.clip((y - cut) / (2.0 * BLEND_HALF_LENGTH) + 0.5, 0.0, 1.0)
        zones += t**3 * (10.0 - 15.0 * t + 6.0 * t**2)
    return zones
