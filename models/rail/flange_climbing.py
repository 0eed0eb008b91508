"""Forces by what bounds them: of a flange that may climb by its wheel's load, of creep by what friction carries.

M. J. Nadal, Theorie de la stabilite des locomotives, Annales des Mines (1896): a flange at the angle beta to the
horizontal slides down again as long as Y / Q stays below (tan beta - mu) / (1 + mu tan beta).
"""

import math

import numpy as np

FLANGE_ANGLE = math.radians(70.0)
"""Of a usual flange: a cone's spring has none of its own."""


def nadal_limit(friction: float, angle: float = FLANGE_ANGLE) -> float:
    """Limit of the ratio Y / Q below which a flange at an angle (rad) does not climb, by Nadal's formula."""
    return (math.tan(angle) - friction) / (1.0 + friction * math.tan(angle))


def bound_shares(force: np.ndarray, bound: np.ndarray) -> np.ndarray:
    """Ratios of forces' magnitudes to their bounds, arrays of one shape: 0 where there is no force, infinite where the
    bound is zero."""
    force = np.abs(force)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(force > 0.0, force / bound, 0.0)
