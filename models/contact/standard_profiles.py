"""Built-in profiles: the new wheel S1002 and the new rail UIC 60 (60E1).

S1002
    The sections of EN 13715 (formerly UIC 510-2 and ORE S1002) for a flange of 28 mm height and 32.5 mm thickness,
    lengths in mm, y from the taping line, here with the flange at negative y.
UIC 60
    The head of tangent arcs of 300, 80 and 13 mm radius and a side of 1:20, as EN 13674-1 draws it. The two places
    where the radius changes are fitted, to the rail of the Manchester contact benchmark; the standard's own drawing
    rounds them otherwise, which moves the surface by some hundredths of a millimetre.
"""

from collections.abc import Callable
from functools import cache

import numpy as np

from models.contact.inputs import Array
from models.contact.profiles import POINT_SPACING, ContactProfile
from models.core.errors import InputError

METRES_PER_MILLIMETRE = 1e-3

TREAD_COEFFICIENTS = (
    0.0,
    -3.358537058e-2,
    1.565681624e-3,
    -2.810427944e-5,
    5.844240864e-8,
    -1.562379023e-8,
    5.309217349e-15,
    -5.957839843e-12,
    2.646656573e-13,
)
THROAT_COEFFICIENTS = (
    -4.320221063e3,
    -1.038384026e3,
    -1.065501873e2,
    -6.051367875,
    -2.054332446e-1,
    -4.169739389e-3,
    -4.687195829e-5,
    -2.252755540e-7,
)
WHEEL = (-70.0, -62.764705882, -49.662510381, -39.764473993, -38.426669071, -35.0, -26.0, 32.15796, 60.0)
"""Ends (mm) of the sections H to A of the wheel profile S1002, y from the taping line."""
SECTIONS: tuple[Callable[[Array], Array], ...] = (
    lambda y: 9.519259302 + np.sqrt(20.5**2 - (y + 49.5) ** 2),
    lambda y: 16.0 + np.sqrt(12.0**2 - (y + 55.0) ** 2),
    lambda y: 8.834924130 + np.sqrt(20.0**2 - (y + 58.558326413) ** 2),
    lambda y: -93.576667419 - 2.747477419 * y,
    lambda y: 16.446 - np.sqrt(13.0**2 - (y + 26.210665) ** 2),
    lambda y: np.polynomial.polynomial.polyval(y, THROAT_COEFFICIENTS),
    lambda y: np.polynomial.polynomial.polyval(y, TREAD_COEFFICIENTS),
    lambda y: 1.364323640 - 0.066666667 * y,
)
"""Height over y (mm) in each section of the wheel profile S1002, from the flange's back to the outer end of the
tread.
"""

RAIL_HEAD_RADII = (300.0, 80.0, 13.0)
RAIL_RADIUS_CHANGES = (10.49975, 25.98806)
"""Distance (mm) from the rail's axis at which the head's radius changes from 300 to 80 mm, and from 80 to 13 mm."""
SIDE_SLOPE = 20.0
"""Slope of the rail head's side: height over width."""
LARGEST_DEPTH = 37.0
"""Depth (mm) below the rail head's top down to which the profile reaches."""


def s1002_height(y: Array) -> Array:
    """Growth (mm) of the radius of an S1002 wheel at y (mm) from the taping line, flange at -70 to -38 mm."""
    y = np.asarray(y, float)
    section = np.clip(np.searchsorted(WHEEL, y, side="right") - 1, 0, len(SECTIONS) - 1)
    with np.errstate(invalid="ignore"):  # every formula is evaluated everywhere, and used where it is defined
        return np.select([section == k for k in range(len(SECTIONS))], [height(y) for height in SECTIONS])


@cache
def s1002_profile() -> ContactProfile:
    """The wheel profile S1002 from 0.5 mm inside its flange's back to 60 mm outside the taping line."""
    y = np.linspace(-69.5, 60.0, 20001)
    return _evenly_spaced(y, s1002_height(y))


@cache
def uic60_profile() -> ContactProfile:
    """The head of an upright UIC 60 rail as a profile, to 37 mm below its top."""
    y, z = _half_rail_head()
    return _evenly_spaced(np.concatenate([-y[::-1], y[1:]]), np.concatenate([z[::-1], z[1:]]))


def _half_rail_head() -> tuple[Array, Array]:
    """Right half of the rail head (mm) from the axis: arcs that continue one another's tangent, then the side."""
    y, z, angle = [np.zeros(1)], [np.zeros(1)], 0.0
    for radius, end in zip(RAIL_HEAD_RADII, (*RAIL_RADIUS_CHANGES, None), strict=True):
        centre_y, centre_z = y[-1][-1] - radius * np.sin(angle), z[-1][-1] + radius * np.cos(angle)
        last = np.arctan(SIDE_SLOPE) if end is None else np.arcsin((end - centre_y) / radius)
        angles = np.linspace(angle, last, 2001)[1:]
        y.append(centre_y + radius * np.sin(angles))
        z.append(centre_z - radius * np.cos(angles))
        angle = last
    depth = np.linspace(z[-1][-1], LARGEST_DEPTH, 1001)[1:]
    y.append(y[-1][-1] + (depth - z[-1][-1]) / SIDE_SLOPE)
    return np.concatenate(y), np.concatenate([*z, depth])


def _evenly_spaced(y: Array, z: Array) -> ContactProfile:
    """Profile in m of points (mm), at even distances along the contour."""
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(y), np.diff(z)))])
    even = np.linspace(0.0, length[-1], round(length[-1] * METRES_PER_MILLIMETRE / POINT_SPACING) + 1)
    return ContactProfile(
        np.interp(even, length, y) * METRES_PER_MILLIMETRE, np.interp(even, length, z) * METRES_PER_MILLIMETRE
    )


BUILT_IN_WHEELS = {"S1002": s1002_profile}
BUILT_IN_RAILS = {"UIC60": uic60_profile}


def built_in_profile(profile_name: str) -> ContactProfile:
    """The built-in wheel or rail profile of this name; raises InputError that lists the names."""
    known = BUILT_IN_WHEELS | BUILT_IN_RAILS
    if profile_name not in known:
        raise InputError("", "profile", profile_name, "is not built in", tuple(known))
    return known[profile_name]()
