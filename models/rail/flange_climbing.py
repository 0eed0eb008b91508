"""Ratios of wheel-rail forces to their bounds: Nadal's limit of flange climbing, and the friction limit of creep
forces.

M. J. Nadal, Theorie de la stabilite des locomotives, Annales des Mines (1896): a flange at the angle beta to the
horizontal slides down again as long as Y / Q stays below (tan beta - mu) / (1 + mu tan beta).
"""

import math

import numpy as np

FLANGE_ANGLE = math.radians(70.0)
"""Angle (rad) of a usual flange: the spring that models the flange of a cone has no angle."""


def nadal_limit(friction: float, angle: float = FLANGE_ANGLE) -> float:
    """Limit of the ratio Y / Q of lateral to vertical wheel force below which a flange at an angle (rad) does not
    climb, by Nadal's formula."""
    return (math.tan(angle) - friction) / (1.0 + friction * math.tan(angle))


def bound_shares(force: np.ndarray, bound: np.ndarray) -> np.ndarray:
    """Ratios of the magnitudes of forces to their bounds, arrays of equal shape: 0 where there is no force, infinite
    where the bound is zero."""
    force = np.abs(force)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(force > 0.0, force / bound, 0.0)
