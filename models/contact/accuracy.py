"""How far the forces of a contact are off: what its cells leave, and what the theory itself does.

Cells
    The same contact is rolled again on about half as many cells along each axis. An error of order p then changes by
    the ratio of the cells to the power p, which tells how much of it is left. Cells begin to slip one by one, so the
    two grids agree by chance now and then: force and moment are compared as one vector, twice the difference is stated
    (``SAFETY``) and a part of the force used that goes with the cells' area; and where little slips, both grids miss
    a zone of slip narrower than their cells (``UNSEEN``). At least 95 % of contacts keep to it, FASTSIM's on 5 to 41
    cells (validation case ``contact_price``).
Theory
    On converged cells the theories were held against the exact one, on 1570 contacts of
    ``validation.contact.contact_set``: ellipses of a/b from 0.1 to 10, Poisson's ratio 0, 0.28 and 0.5, creepage and
    spin of 0.05 to 10 times what the linear theory takes to reach mu N, of thirteen kinds and in directions drawn at
    random. ``BANDS`` and ``MOMENT_BANDS`` keep what 95 % of contacts keep to that are drawn anew, of each Poisson's
    ratio, of spin with and against the lateral creepage, and of ellipses longer along and across by themselves; the
    validation case ``contact_price`` tells whether they still do. The theory of 1983 was so measured on the same
    ellipses; other shapes are outside of what its band was measured on. Beyond a/b from 0.1 to 10 all bands widen in
    proportion (``slenderness``).

Both are stated for the tangential force and for the moment about the normal, which is that of FASTSIM's tractions.
"""

from dataclasses import dataclass

import numpy as np

from models.contact.linear_theory import coefficients
from models.contact.theories import Contact, Fastsim, Linear, Motion, OnEllipse, Rolled, Simplified

SAFETY = 2.0
"""Factor on what step halving tells."""
UNSEEN = 0.17
"""What a zone of slip at the trailing edge takes off the force, by the square of the force used; it is wider than a
cell, and seen, where the force used is beyond three by the cells."""
SLENDER = (0.1, 10.0)
"""a/b between which the bands were measured."""
KNOTS = (0.05, 0.2, 0.4, 0.6, 0.8, 0.95, 1.0)
"""Tangential force by mu N at which the bands are kept."""
BANDS = {
    "blended intermediate": (
        (0.0186, 0.0168, 0.0417, 0.0543, 0.0837, 0.0804, 0.0279),
        (0.0629, 0.0630, 0.0518, 0.0569, 0.0542, 0.0288, 0.0200),
    ),
    "blended parabolic": (
        (0.0121, 0.0299, 0.0335, 0.0408, 0.0722, 0.0722, 0.0324),
        (0.0526, 0.0742, 0.0934, 0.1013, 0.0899, 0.0555, 0.0222),
    ),
    "blended elliptic": (
        (0.0251, 0.0279, 0.0595, 0.0613, 0.1005, 0.0981, 0.0419),
        (0.0909, 0.0914, 0.0850, 0.0934, 0.1030, 0.0551, 0.0388),
    ),
    "one intermediate": (
        (0.0856, 0.1478, 0.2148, 0.2659, 0.2441, 0.1858, 0.0400),
        (0.2004, 0.2096, 0.2796, 0.2851, 0.2050, 0.1200, 0.0764),
    ),
    "one parabolic": (
        (0.0882, 0.1587, 0.2289, 0.2816, 0.2565, 0.1850, 0.0510),
        (0.1884, 0.2223, 0.2968, 0.3014, 0.2120, 0.1309, 0.0820),
    ),
    "one elliptic": (
        (0.0836, 0.1364, 0.1996, 0.2511, 0.2330, 0.1819, 0.0384),
        (0.2203, 0.1979, 0.2536, 0.2679, 0.2440, 0.1296, 0.0492),
    ),
    "three intermediate": (
        (0.0296, 0.0983, 0.2185, 0.2443, 0.1542, 0.0985, 0.1215),
        (0.1230, 0.1609, 0.1895, 0.1171, 0.0855, 0.0428, 0.0178),
    ),
    "three parabolic": (
        (0.0275, 0.1079, 0.1805, 0.2278, 0.2288, 0.1095, 0.1167),
        (0.1383, 0.1648, 0.1833, 0.1323, 0.1060, 0.0674, 0.0371),
    ),
    "three elliptic": (
        (0.0361, 0.0967, 0.2652, 0.2653, 0.1950, 0.1052, 0.1221),
        (0.1219, 0.1691, 0.1967, 0.1374, 0.1173, 0.0646, 0.0400),
    ),
    "simplified": (
        (0.0268, 0.0743, 0.1117, 0.1440, 0.1798, 0.1779, 0.0460),
        (0.2834, 0.2347, 0.2161, 0.2576, 0.2696, 0.0940, 0.0405),
    ),
}
"""Name of a theory -> error by mu N that 95 % of the contacts keep to at each knot, without spin and with it."""
MOMENT_BANDS = {
    "blended intermediate": (
        (0.0108, 0.0252, 0.0351, 0.0389, 0.0378, 0.0287, 0.0143),
        (0.0239, 0.0435, 0.0491, 0.0491, 0.0463, 0.0312, 0.0177),
    ),
    "blended parabolic": (
        (0.0145, 0.0366, 0.0572, 0.0575, 0.0449, 0.0457, 0.0201),
        (0.0339, 0.0661, 0.0735, 0.0764, 0.0746, 0.0639, 0.0206),
    ),
    "blended elliptic": (
        (0.0072, 0.0297, 0.0297, 0.0270, 0.0280, 0.0277, 0.0164),
        (0.0197, 0.0313, 0.0309, 0.0350, 0.0320, 0.0182, 0.0206),
    ),
    "one intermediate": (
        (0.0536, 0.0799, 0.0861, 0.0848, 0.0841, 0.0589, 0.0225),
        (0.0653, 0.1072, 0.1219, 0.1225, 0.1053, 0.0831, 0.0540),
    ),
    "one parabolic": (
        (0.0568, 0.0933, 0.1005, 0.1003, 0.0876, 0.0594, 0.0278),
        (0.0989, 0.1277, 0.1412, 0.1415, 0.1151, 0.0983, 0.0610),
    ),
    "one elliptic": (
        (0.0507, 0.0701, 0.0705, 0.0692, 0.0872, 0.0611, 0.0198),
        (0.0526, 0.0855, 0.1002, 0.1004, 0.0912, 0.0765, 0.0383),
    ),
    "three intermediate": (
        (0.0106, 0.0279, 0.0358, 0.0807, 0.0809, 0.0418, 0.0168),
        (0.0224, 0.0429, 0.0473, 0.0475, 0.0421, 0.0283, 0.0129),
    ),
    "three parabolic": (
        (0.0144, 0.0364, 0.0550, 0.0633, 0.0633, 0.0246, 0.0163),
        (0.0341, 0.0656, 0.0728, 0.0761, 0.0737, 0.0454, 0.0180),
    ),
    "three elliptic": (
        (0.0072, 0.0350, 0.0594, 0.1002, 0.1004, 0.0606, 0.0272),
        (0.0198, 0.0315, 0.0354, 0.0631, 0.0576, 0.0471, 0.0204),
    ),
    "simplified": (
        (0.0114, 0.0774, 0.0989, 0.0997, 0.0665, 0.0628, 0.0197),
        (0.0842, 0.1023, 0.0989, 0.0985, 0.1094, 0.0401, 0.0092),
    ),
}
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
    """Errors of force (N) and moment (N m) that the cells leave."""
    limit = contact.friction * contact.pressing.load
    if limit == 0.0:
        return 0.0, 0.0
    coarse = contact.roll(motion, halved(cells))
    here, there = (np.array([one.fx, one.fy, one.mz / contact.lever]) / limit for one in (fine, coarse))
    error = limit * float(cells_error(here, there, cells, contact.order))
    return error, contact.lever * error


def halved(cells: int) -> int:
    """Cells of the coarser grid."""
    return (cells + 1) // 2


def cells_error(fine: np.ndarray, coarse: np.ndarray, cells: int, order: float) -> np.ndarray:
    """Error by mu N, and of the moment by mu N times the lever, that ``cells`` leave, (...).

    fine, coarse : (3, ...) fx and fy by mu N, mz by mu N times the lever, on ``cells`` and half of them. order : of the
    theory in the size of a cell.
    """
    used, gained = np.linalg.norm(fine, axis=0), (cells / halved(cells)) ** order - 1.0
    unseen = UNSEEN * used**2 * np.clip(2.0 - used * cells / 3.0, 0.0, 1.0)
    return SAFETY * np.linalg.norm(fine - coarse, axis=0) / gained + used / cells**2 + unseen


def band(name: str, used: np.ndarray, spinning: np.ndarray) -> np.ndarray:
    """Error by mu N of a theory, one of BANDS, at forces ``used`` (by mu N) and shares ``spinning`` of spin."""
    without, with_spin = (np.interp(used, KNOTS, values) for values in BANDS[name])
    without = without * np.minimum(used / KNOTS[0], 1.0)  # the linear theory is met, but not where spin meets creepage
    return without + spinning * (with_spin - without)


def moment_band(name: str, used: np.ndarray, spinning: np.ndarray) -> np.ndarray:
    """Error of the moment by mu N times the lever; ``used`` as by ``used_with_moment``, the rest as of ``band``."""
    without, with_spin = (np.interp(used, (0.0, *KNOTS), (0.0, *values)) for values in MOMENT_BANDS[name])
    return without + spinning * (with_spin - without)


def slenderness(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Factor on the bands of an ellipse: 1 on those that they were measured on, more beyond."""
    ratio = a / b
    return np.maximum(np.maximum(SLENDER[0] / ratio, ratio / SLENDER[1]), 1.0)


def used_with_moment(used: np.ndarray, moment: np.ndarray) -> np.ndarray:
    """How far friction is used where moments count: force by mu N and moment by mu N times the lever."""
    return np.hypot(used, moment)


def spin_share(a: np.ndarray, b: np.ndarray, motion: np.ndarray, nu: float | np.ndarray) -> np.ndarray:
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
    share, wider = (
        spin_share(np.array(a), np.array(b), np.array(motion), contact.pair.nu),
        float(slenderness(np.array(a), np.array(b))),
    )
    used, most = np.array(np.linalg.norm(found.force) / limit), limit * contact.lever
    whole = used_with_moment(used, np.array(found.mz / most))
    return wider * limit * float(band(name, used, share)), wider * most * float(moment_band(name, whole, share))


def _of_linear(contact: OnEllipse, motion: Motion, found: Rolled) -> tuple[float, float]:
    """Distances of force (N) and moment (N m) from FASTSIM, and its bands."""
    better = Fastsim(contact.hertz, contact.friction, contact.pair, **BEST)
    other, error = rolled(better, motion, 31)
    return float(np.linalg.norm(found.force - other.force)) + error.total, abs(found.mz - other.mz) + error.moment


BEST = {"flexibilities": "blended", "bound": "intermediate", "march": "second-order"}
"""Choices of FASTSIM that are closest to the exact theory on the whole."""
