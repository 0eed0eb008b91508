"""Whether a wheel may climb its rail: lateral by vertical force against Nadal's limit.

M. J. Nadal, Theorie de la stabilite des locomotives, Annales des Mines (1896): a flange at the angle beta to the
horizontal slides down again as long as Y / Q stays below (tan beta - mu) / (1 + mu tan beta).
"""

import math

import numpy as np

from models.rail import wheel_forces as wf

FLANGE_ANGLE = math.radians(70.0)
"""Of a usual flange: a cone's spring has none of its own."""


def nadal(friction: float, angle: float = FLANGE_ANGLE) -> float:
    """Largest Y / Q at which a flange at an angle (rad) does not climb."""
    return (math.tan(angle) - friction) / (1.0 + friction * math.tan(angle))


def flange_share(contacts: np.ndarray) -> float:
    """Largest force of a cone's flange by its wheel's load, over reports (n, 2, REPORTED); infinite without load."""
    force, load = np.abs(contacts[:, :, wf.FLANGE_FORCE]), contacts[:, :, wf.LOAD]
    pushed = force > 0.0
    if not pushed.any():
        return 0.0
    with np.errstate(divide="ignore"):
        return float((force[pushed] / load[pushed]).max())
