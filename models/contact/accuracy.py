"""How far the forces of a contact are off: what its cells leave, and what the theory itself does.

Cells
    The same contact is rolled again on about half as many cells along each axis. An error of order p then changes by
    the ratio of the cells to the power p, which tells how much of it is left.
Theory
    On converged cells the theories were held against the exact one, on the 360 contacts of ``validation.contact_set``:
    ellipses of a/b from 0.2 to 5, nine kinds of creepage and spin, of 0.05 to 10 times what the linear theory takes to
    reach mu N, nu = 0.28. ``BANDS`` and ``MOMENT_BANDS`` keep what 95 % of them keep to, and the validation case
    ``contact_price`` tells whether they still do. The theory of 1983 was so measured on the same ellipses; other shapes
    are outside of what its band was measured on.

Both are stated for the tangential force and for the moment about the normal. The simplified theories' moment is worse
than their force: under spin it is too large, by up to a quarter of mu N sqrt(ab) at a/b = 0.2.
"""

from dataclasses import dataclass

import numpy as np

from models.contact.linear_theory import coefficients
from models.contact.theories import Contact, Fastsim, Linear, Motion, OnEllipse, Rolled, Simplified

KNOTS = (0.05, 0.2, 0.4, 0.6, 0.8, 0.95, 1.0)
"""Tangential force by mu N at which the bands are kept."""
BANDS = {
    "blended intermediate": ((0.0014, 0.0018, 0.0085, 0.0257, 0.0433, 0.0503, 0.0030),
                             (0.0512, 0.0590, 0.0614, 0.0637, 0.0563, 0.0393, 0.0583)),
    "blended parabolic": ((0.0045, 0.0046, 0.0113, 0.0386, 0.0407, 0.0499, 0.0392),
                          (0.0621, 0.0718, 0.0753, 0.0769, 0.0770, 0.0710, 0.0356)),
    "blended elliptic": ((0.0075, 0.0075, 0.0312, 0.0310, 0.0614, 0.0614, 0.0205),
                         (0.0584, 0.0903, 0.0931, 0.0901, 0.0872, 0.0541, 0.0850)),
    "one intermediate": ((0.0554, 0.1132, 0.1530, 0.1699, 0.1699, 0.1422, 0.0190),
                         (0.1634, 0.1614, 0.2171, 0.2235, 0.1876, 0.0977, 0.1948)),
    "one parabolic": ((0.0579, 0.1220, 0.1668, 0.1863, 0.1911, 0.1503, 0.0318),
                      (0.1515, 0.1578, 0.2242, 0.2416, 0.2028, 0.1248, 0.1019)),
    "one elliptic": ((0.0524, 0.0968, 0.1306, 0.1460, 0.1528, 0.1362, 0.0347),
                     (0.1833, 0.1833, 0.2173, 0.2140, 0.1642, 0.0698, 0.1926)),
    "three intermediate": ((0.0014, 0.0018, 0.0085, 0.0257, 0.0433, 0.1130, 0.1166),
                           (0.1226, 0.1257, 0.1148, 0.0874, 0.0707, 0.0376, 0.1165)),
    "three parabolic": ((0.0045, 0.0046, 0.0113, 0.0386, 0.0407, 0.1174, 0.1058),
                        (0.1354, 0.1312, 0.1273, 0.1039, 0.0888, 0.0720, 0.0356)),
    "three elliptic": ((0.0075, 0.0075, 0.0312, 0.0310, 0.0615, 0.1058, 0.1165),
                       (0.1059, 0.1306, 0.1316, 0.1156, 0.0895, 0.0546, 0.1246)),
    "simplified": ((0.0108, 0.0400, 0.0889, 0.0936, 0.0918, 0.0904, 0.0243),
                   (0.2115, 0.1797, 0.1668, 0.1832, 0.1344, 0.1049, 0.1786)),
}  # fmt: skip
"""Name of a theory -> error by mu N that 95 % of the contacts keep to at each knot, without spin and with it."""
MOMENT_BANDS = {
    "blended intermediate": ((0.0033, 0.0045, 0.0111, 0.0154, 0.0171, 0.0174, 0.0090),
                             (0.0458, 0.0906, 0.1094, 0.1104, 0.0780, 0.0718, 0.0092)),
    "blended parabolic": ((0.0005, 0.0005, 0.0031, 0.0076, 0.0079, 0.0107, 0.0103),
                          (0.0390, 0.0732, 0.0911, 0.0923, 0.0797, 0.0658, 0.0061)),
    "blended elliptic": ((0.0027, 0.0108, 0.0317, 0.0346, 0.0360, 0.0316, 0.0081),
                         (0.0556, 0.0729, 0.1373, 0.1388, 0.1135, 0.0983, 0.1347)),
    "one intermediate": ((0.0158, 0.0214, 0.0246, 0.0243, 0.0318, 0.0329, 0.0090),
                         (0.0617, 0.0966, 0.1097, 0.0988, 0.0885, 0.0761, 0.0953)),
    "one parabolic": ((0.0176, 0.0264, 0.0306, 0.0315, 0.0325, 0.0287, 0.0117),
                      (0.0762, 0.1197, 0.1258, 0.1045, 0.1002, 0.0977, 0.0658)),
    "one elliptic": ((0.0140, 0.0153, 0.0132, 0.0183, 0.0401, 0.0391, 0.0133),
                     (0.0462, 0.0770, 0.0854, 0.0925, 0.0902, 0.0598, 0.0820)),
    "three intermediate": ((0.0033, 0.0045, 0.0111, 0.0154, 0.0171, 0.0171, 0.0088),
                           (0.0458, 0.0909, 0.1233, 0.1240, 0.1161, 0.0764, 0.0092)),
    "three parabolic": ((0.0005, 0.0005, 0.0031, 0.0076, 0.0079, 0.0105, 0.0103),
                        (0.0390, 0.0736, 0.1028, 0.1039, 0.0966, 0.0534, 0.0061)),
    "three elliptic": ((0.0027, 0.0108, 0.0317, 0.0346, 0.0360, 0.0317, 0.0100),
                       (0.0556, 0.0735, 0.1583, 0.1591, 0.1648, 0.1454, 0.1586)),
    "simplified": ((0.0032, 0.0063, 0.0073, 0.0094, 0.0171, 0.0169, 0.0065),
                   (0.0570, 0.0838, 0.0774, 0.0672, 0.0523, 0.0410, 0.0718)),
}  # fmt: skip
"""The same of the moment by mu N times the lever: abscissa is ``used_with_moment``, and all vanish at its zero."""


@dataclass(frozen=True)
class Error:
    """Error of the tangential force (N) and of the moment (N m).

    cells : what the cells leave. theory : what 95 % of contacts like this keep to. moment_cells, moment_theory : the
    same of the moment.
    """

    cells: float
    theory: float
    moment_cells: float
    moment_theory: float

    @property
    def total(self) -> float:
        """Of the force, both together (N)."""
        return self.cells + self.theory

    @property
    def moment(self) -> float:
        """Of the moment, both together (N m)."""
        return self.moment_cells + self.moment_theory


def rolled(contact: Contact, motion: Motion, cells: int, *, fields: bool = False) -> tuple[Rolled, Error]:
    """Forces and how far they are off."""
    fine = contact.roll(motion, cells, fields=fields)
    if isinstance(contact, Linear):
        force, moment = _of_linear(contact, motion, fine)
        return fine, Error(0.0, force, 0.0, moment)
    (force, moment), (theory, moment_theory) = left(contact, motion, cells, fine), _of_theory(contact, motion, fine)
    return fine, Error(force, theory, moment, moment_theory)


def left(contact: Contact, motion: Motion, cells: int, fine: Rolled) -> tuple[float, float]:
    """Errors of force (N) and moment (N m) that the cells leave, by step halving."""
    half = (cells + 1) // 2
    coarse, gained = contact.roll(motion, half), (cells / half) ** contact.order - 1.0
    return float(np.linalg.norm(fine.force - coarse.force) / gained), abs(fine.mz - coarse.mz) / gained


def band(name: str, used: np.ndarray, spinning: np.ndarray) -> np.ndarray:
    """Error by mu N of a theory, one of BANDS, at forces ``used`` (by mu N) and shares ``spinning`` of spin."""
    without, with_spin = (np.interp(used, KNOTS, values) for values in BANDS[name])
    without = without * np.minimum(used / KNOTS[0], 1.0)  # the linear theory is met, but not where spin meets creepage
    return without + spinning * (with_spin - without)


def moment_band(name: str, used: np.ndarray, spinning: np.ndarray) -> np.ndarray:
    """Error of the moment by mu N times the lever; ``used`` as by ``used_with_moment``, the rest as of ``band``."""
    without, with_spin = (np.interp(used, (0.0, *KNOTS), (0.0, *values)) for values in MOMENT_BANDS[name])
    return without + spinning * (with_spin - without)


def used_with_moment(used: np.ndarray, moment: np.ndarray) -> np.ndarray:
    """How far friction is used where moments count: force by mu N and moment by mu N times the lever."""
    return np.hypot(used, moment)


def spin_share(a: np.ndarray, b: np.ndarray, motion: np.ndarray, nu: float) -> np.ndarray:
    """How far a motion (3, ...) counts as one with spin, 0 to 1: all from a third of the linear work on."""
    c = coefficients(a / b, nu)
    parts = np.stack([c.c11 * motion[0], c.c22 * motion[1], np.sqrt(a * b) * c.c23 * motion[2]]) ** 2
    whole = parts.sum(axis=0)
    return np.minimum(1.0, 3.0 * np.divide(parts[2], whole, out=np.zeros_like(whole), where=whole > 0))


def _of_theory(contact: Contact, motion: Motion, found: Rolled) -> tuple[float, float]:
    """Bands of force (N) and moment (N m) of the simplified theories; of the exact one there are none."""
    limit = contact.friction * contact.pressing.load
    if limit == 0.0 or not isinstance(contact, Fastsim | Simplified):
        return 0.0, 0.0
    if isinstance(contact, Fastsim):
        name, a, b = f"{contact.choices['flexibilities']} {contact.choices['bound']}", contact.a, contact.b
    else:
        name, a, b = "simplified", 1.0, 1.0
    share = spin_share(np.array(a), np.array(b), np.array(motion), contact.pair.nu)
    used, most = np.array(np.linalg.norm(found.force) / limit), limit * contact.lever
    whole = used_with_moment(used, np.array(found.mz / most))
    return limit * float(band(name, used, share)), most * float(moment_band(name, whole, share))


def _of_linear(contact: OnEllipse, motion: Motion, found: Rolled) -> tuple[float, float]:
    """Distances of force (N) and moment (N m) from FASTSIM, and its bands."""
    better = Fastsim(contact.hertz, contact.friction, contact.pair, **BEST)
    other, error = rolled(better, motion, 31)
    return float(np.linalg.norm(found.force - other.force)) + error.total, abs(found.mz - other.mz) + error.moment


BEST = {"flexibilities": "blended", "bound": "intermediate", "march": "second-order"}
"""Choices of FASTSIM that are closest to the exact theory on the whole."""
