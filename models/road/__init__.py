"""Road profiles: heights over arc length, from sums of waves or from measured points.

Every profile answers in the same way, whatever it was made from: ``height_and_slope(s)``,
``sample_uniform(start, step, count)``, ``height_slope_at(s)`` and ``extent``. Arc length s is in m;
zeta is the height in m, positive **down** (a rise is negative); the slope is d(zeta)/ds.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from models.road.profile import RoadProfile, SineProfile, SplineProfile

__all__ = ["RoadProfile", "SineProfile", "SplineProfile"]

TRACK_WIDTH = 1.5
"""Default distance (m) between the two tracks of a measured surface."""


def __getattr__(name: str) -> Any:
    """Import the classes above on first use: their kernels need the compiler, which random roads do not."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from models.road import profile

    return getattr(profile, name)
