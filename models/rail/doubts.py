"""What a path of a wheelset leaves in doubt: flanges that may climb, creep forces that friction would not carry.

M. J. Nadal, Theorie de la stabilite des locomotives, Annales des Mines (1896): a flange at the angle beta to the
horizontal slides down again as long as Y / Q stays below (tan beta - mu) / (1 + mu tan beta).
"""

import math

import numpy as np

from models.rail import wheel_forces as wf
from models.rail.equations import Equations, Path

FLANGE_ANGLE = math.radians(70.0)
"""Of a usual flange: a cone's spring has none of its own."""


def nadal(friction: float, angle: float = FLANGE_ANGLE) -> float:
    """Largest Y / Q at which a flange at an angle (rad) does not climb."""
    return (math.tan(angle) - friction) / (1.0 + friction * math.tan(angle))


def largest_share(force: np.ndarray, bound: np.ndarray) -> float:
    """Largest magnitude of a force by its bound, both (n, patches), 0 without any; infinite without a bound."""
    force = np.abs(force)
    acting = force > 0.0
    with np.errstate(divide="ignore"):
        return float(np.max(force[acting] / bound[acting], initial=0.0))


def flange_share(contacts: np.ndarray) -> float:
    """Largest force of a cone's flange by its wheel's load, over reports (n, 2, REPORTED); infinite without load."""
    return largest_share(contacts[:, :, wf.FLANGE_FORCE], contacts[:, :, wf.LOAD])


def doubts(equations: Equations, path: Path) -> list[str]:
    """A sentence on each assumption that a path broke."""
    wheelset, contacts, sentences = equations.wheelset, path.contacts, list[str]()
    share, limit = flange_share(contacts), nadal(wheelset.friction)
    if wheelset.profiles is None and share > max(limit, 0.0):
        sentences.append(
            f"a flange is pushed with {share:.2g} times its wheel's load; beyond {limit:.2g} (Nadal, 70 "
            "degrees) it may climb, which cones cannot show: use [profiles]"
        )
    creep = np.hypot(contacts[:, :, wf.FX], contacts[:, :, wf.FY])
    most = largest_share(creep, wheelset.friction * contacts[:, :, wf.LOAD])
    if equations.law == "linear" and most > 1.0:
        sentences.append(
            f"the linear law's creep forces are up to {most:.3g} times what friction carries: it knows no "
            "slip; use fastsim"
        )
    return sentences
