"""Continuation of a measured road before its start and beyond its end: only by a declared rule.

Beyond its end a finite road is ``refused``, or it goes on ``mirrored``: the measured **points** are
reflected at the end in arc length, zeta(2 L - s) = zeta(s), again and again, and the spline is fitted
through all of them. Reflecting the finished spline would put a kink at L wherever its slope is not 0
there; reflecting about the end *point*, 2 zeta(L) - zeta, would keep the slope but climb for ever on a
road with any grade. Through mirrored points the spline is C2 everywhere by construction, the heights stay
within the measured ones, and only the last few stations of the measured part differ from the spline
without continuation (by a factor 0.27 less per station).

Before its start a measured road needs a run-in: a vehicle at rest on the flat has to meet it without a
jump in height, slope or curvature.
"""

import math
from dataclasses import replace

import numpy as np

from models.core.errors import InputError
from models.road.profile import OVERRUN_SHARE, RoadProfile, SplineProfile

CONTINUATION_RULES = ("mirrored", "refused")
RUN_IN_LENGTH = 5.0
"""Default length (m) of the run-in."""
POINT_LIMIT = 5_000_000
"""Largest count of points of a mirrored road: about 400 MB with its coefficients and the fit."""


def continued_road(
    profile: RoadProfile, continuation_rule: str, needed_distance: float, scene_path: object = ""
) -> RoadProfile:
    """Road that reaches at least to ``needed_distance``; a road that is long enough is returned unchanged.

    Parameters
    ----------
    profile : any road; one without end is never changed
    continuation_rule : "mirrored" or "refused", see the top of this file
    needed_distance : last arc length that the run reads, m
    scene_path : the user's file, for the message

    Raises
    ------
    InputError : unknown rule; the road is too short and the rule is "refused"
    """
    if continuation_rule not in CONTINUATION_RULES:
        raise InputError(
            scene_path,
            "continuation",
            continuation_rule,
            "must be a rule for what follows a road's end",
            CONTINUATION_RULES,
        )
    if not math.isfinite(needed_distance):
        raise InputError(scene_path, "distance", needed_distance, "must be a finite distance in m")
    if not isinstance(profile, SplineProfile) or needed_distance <= profile.end + OVERRUN_SHARE * (
        profile.end - profile.start
    ):
        return profile
    if continuation_rule == "refused":
        allowed = f"the road ends at s = {profile.end:.6g} m and the run needs {needed_distance:.6g} m"
        raise InputError(
            scene_path, profile.name, None, f"{allowed}: shorten the run or declare continuation 'mirrored'"
        )
    station, height = _mirrored_points(profile, needed_distance, scene_path)
    longer = type(profile).through(station, height, f"{profile.name}, mirrored")
    return replace(longer, window_length=profile.window_length)


def _mirrored_points(
    profile: SplineProfile, needed_distance: float, scene_path: object
) -> tuple[np.ndarray, np.ndarray]:
    """Stations (m) and heights (m) of the road, reflected at its ends repeatedly until it reaches
    ``needed_distance``."""
    station, height = profile.points
    gaps, length = np.diff(station), profile.end - profile.start
    copies = math.ceil((needed_distance - profile.start) / length)
    if copies * gaps.size > POINT_LIMIT:
        allowed = f"mirroring {profile.name!r} that far takes more than {POINT_LIMIT} points"
        raise InputError(scene_path, "distance (m)", needed_distance, allowed)
    stations, heights = [station], [height]
    for i in range(1, copies):
        points, back = (station, height), (profile.end - (station[::-1] - profile.start), height[::-1])
        s, zeta = back if i % 2 else points
        stations.append(s[1:] + i * length)
        heights.append(zeta[1:])
    return np.concatenate(stations), np.concatenate(heights)


def road_with_run_in(
    profile: SplineProfile, transition_length: float = RUN_IN_LENGTH, reference_height_value: float | None = None
) -> SplineProfile:
    """Road that rises from the flat: height 0 up to its first point, then w(s / length) (zeta - reference).

    w is the quintic smoothstep, so height, slope and curvature are continuous; beyond ``transition_length`` the road
    is the measured one, moved by ``reference_height_value``. Without moving it, a road surveyed at 200 m above the sea
    would begin with a cliff.

    Parameters
    ----------
    profile : spline through measured points
    transition_length : of the run-in, m
    reference_height_value : height (m, positive down) that becomes 0. None takes the mean over the run-in, which puts
        the least step into it. Two tracks of one road must share one value, or the bank between them is
        lost: pass ``reference_height`` of their mean track.

    Raises
    ------
    InputError : ``transition_length`` is not positive or is longer than the road
    """
    mean = reference_height(profile, transition_length)  # also checks the length
    level = mean if reference_height_value is None else float(reference_height_value)
    coefficients = profile.coefficients.copy()
    coefficients[:, 3] -= level
    return replace(profile, coefficients=coefficients, window_length=float(transition_length))


def reference_height(profile: SplineProfile, averaging_length: float = RUN_IN_LENGTH) -> float:
    """Mean height (m, positive down) over the first ``averaging_length`` m of a road, which must be as long."""
    if not 0.0 < averaging_length <= profile.end - profile.start:
        allowed = f"must be above 0 and at most the road's own {profile.end - profile.start:.6g} m"
        raise InputError(profile.name, "run-in length (m)", averaging_length, allowed)
    raw = replace(profile, window_length=0.0)
    return float(raw.sample_uniform(profile.start, averaging_length / 512, 513)[0].mean())
