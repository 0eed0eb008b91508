"""Road profiles: heights over arc length, from waves or from measured points.

Every profile answers in the same way, whatever it was made from: ``height_and_slope(s)``,
``sample_uniform(start, step, count)``, ``height_slope_at(s)`` and ``extent``. Arc length s is in m;
zeta is the height in m, positive **down** (a rise is negative); the slope is d(zeta)/ds.
"""

from models.road.profile import Profile, SineProfile, SplineProfile

__all__ = ["Profile", "SineProfile", "SplineProfile"]
