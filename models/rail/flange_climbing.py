"""Ratios of wheel-rail forces to their bounds: Nadal's limit of flange climbing, and the friction limit of creep
forces.

M. J. Nadal, Theorie de la stabilite des locomotives, Annales des Mines (1896): a flange at the angle beta to the
horizontal slides down again as long as Y / Q stays below (tan beta - mu) / (1 + mu tan beta).
"""

import math

import numpy as np

FLANGE_ANGLE = math.radians(70.0)
"""Angle (rad) of a usual flange: the spring that models the flange of a cone has no angle."""


def nadal_limit(friction: float, flange_angle: float = FLANGE_ANGLE) -> float:
    """Limit of the ratio Y / Q of lateral to vertical wheel force below which a flange at an angle (rad) does not
    climb, by Nadal's formula."""
    return (math.tan(flange_angle) - friction) / (1.0 + friction * math.tan(flange_angle))


def shares_of_bounds(forces: np.ndarray, force_bounds: np.ndarray) -> np.ndarray:
    """Ratios of the magnitudes of forces to their bounds, arrays of equal shape: 0 where there is no force, infinite
    where the bound is zero."""
    forces = np.abs(forces)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(forces > 0.0, forces / force_bounds, 0.0)
