"""Assumptions of the contact of a wheelset at prescribed lateral displacements, checked in every contact patch at every
displacement.
"""

from collections.abc import Callable

import numpy as np

from models.contact.limits import FAST_SLIP, LARGEST_AXIS_SHARE, SMALL_CREEPAGE, YIELD_PRESSURE, yield_is_known
from models.core.assumptions import Assumption, Watched
from models.core.result import Result
from models.rail.contact_table import PatchReport
from models.systems.wheel_rail.scene import WheelRailScene

WHEEL_NAMES = ("right", "left")


def assumptions(scene: WheelRailScene, friction: float) -> list[Assumption]:
    """Assumptions about the contacts of a case with a coefficient of friction. They are checked on ``ContactsOfCase``,
    the detail of a result.
    """
    listed = [_half_space_assumption(), _profile_bounds_assumption(scene)]
    if yield_is_known(scene.bodies.wheel, scene.bodies.rail):
        listed.append(_elastic_assumption())
    if friction > 0.0:
        listed += [_small_creepage_assumption(), _slow_slip_assumption(scene.wheelset.speed)]
    return listed


def _extreme_of_patches(
    patch_value: Callable[[PatchReport], float], take_largest: bool = True
) -> Callable[[Result], Watched]:
    """Returns the function that computes, for each wheel, the largest (or least) of a patch's values at every position
    of a result.
    """
    worst = max if take_largest else min

    def watched(run_result: Result) -> Watched:
        placed = run_result.detail.placements
        return {
            f"{wheel} wheel": np.array([worst(map(patch_value, getattr(position, wheel))) for position in placed])
            for wheel in WHEEL_NAMES
        }

    return watched


def _half_space_assumption() -> Assumption:
    """Assumption that contact patches are small beside the bodies' radii of curvature."""

    def share(patch_report: PatchReport) -> float:
        return max(
            0.5 * patch_report.length * patch_report.curvature_x, 0.5 * patch_report.width * patch_report.curvature_y
        )

    return Assumption(
        "half-space",
        "contacts are small beside the radii of wheel and rail",
        "lower wheelset.load, or compute with finite elements",
        _extreme_of_patches(share),
        "of the radius",
        upper_limit=LARGEST_AXIS_SHARE,
    )


def _profile_bounds_assumption(scene: WheelRailScene) -> Assumption:
    """Assumption that contact patches lie within the profiles: the distance (mm) from a patch to the nearest end of the
    rail's profile or to the wheel's outer face is above 0.
    """
    side = scene.profiles.wheel_on_rail(scene.wheelset.radius)

    def free(patch_report: PatchReport) -> float:
        ends = (
            patch_report.y - side.rail.y[0],
            side.rail.y[-1] - patch_report.y,
            side.wheel.y[-1] - patch_report.wheel_centre,
        )
        return float(1e3 * (min(ends) - 0.5 * patch_report.width))

    return Assumption(
        "within the profiles",
        "contacts lie within the profiles",
        "use longer profiles or smaller positions",
        _extreme_of_patches(free, take_largest=False),
        "mm from the end",
        lower_limit=0.0,
    )


def _elastic_assumption() -> Assumption:
    """Assumption that pressures stay within the elastic range of the steel."""
    return Assumption(
        "elastic",
        "the steel does not flow",
        "lower wheelset.load: a real contact would be larger and its pressure lower",
        _extreme_of_patches(lambda patch: 1e-6 * patch.peak),
        "MPa",
        upper_limit=1e-6 * YIELD_PRESSURE,
    )


def _small_creepage_assumption() -> Assumption:
    def largest(patch_report: PatchReport) -> float:
        return max(
            abs(patch_report.xi_x),
            abs(patch_report.xi_y),
            0.5 * max(patch_report.length, patch_report.width) * abs(patch_report.spin),
        )

    return Assumption(
        "small creepage",
        "creepages, and spin times the semi-axis, are so small that their squares do not count",
        "lower the yaw: a wheel that slides is no rolling contact",
        _extreme_of_patches(largest),
        "",
        upper_limit=SMALL_CREEPAGE,
    )


def _slow_slip_assumption(speed: float) -> Assumption:
    return Assumption(
        "constant friction",
        "friction is the same however fast the wheels slip",
        "give the case's friction as it is for such slip, or lower wheelset.speed",
        _extreme_of_patches(lambda patch: speed * float(np.hypot(patch.xi_x, patch.xi_y))),
        "m/s",
        upper_limit=FAST_SLIP,
    )
