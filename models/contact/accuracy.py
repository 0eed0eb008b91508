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
    ratio by itself, and the validation case ``contact_price`` tells whether they still do. The theory of 1983 was so
    measured on the same ellipses; other shapes are outside of what its band was measured on. Beyond a/b from 0.1 to 10
    all bands widen in proportion (``slenderness``).

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
    "blended intermediate": ((0.0159, 0.0300, 0.0417, 0.0507, 0.0771, 0.0616, 0.0294),
                             (0.0574, 0.0598, 0.0560, 0.0576, 0.0533, 0.0292, 0.0200)),
    "blended parabolic": ((0.0064, 0.0282, 0.0491, 0.0478, 0.0722, 0.0674, 0.0291),
                          (0.0408, 0.0744, 0.0983, 0.1031, 0.0932, 0.0555, 0.0222)),
    "blended elliptic": ((0.0093, 0.0269, 0.0596, 0.0618, 0.0893, 0.0726, 0.0390),
                         (0.0881, 0.0860, 0.0792, 0.0694, 0.0848, 0.0716, 0.0393)),
    "one intermediate": ((0.0880, 0.1457, 0.1715, 0.2519, 0.2233, 0.1535, 0.0373),
                         (0.1602, 0.1668, 0.2623, 0.2676, 0.1979, 0.1200, 0.0764)),
    "one parabolic": ((0.0906, 0.1570, 0.1882, 0.2724, 0.2320, 0.1402, 0.0456),
                      (0.1489, 0.1635, 0.2725, 0.2799, 0.2031, 0.1428, 0.0820)),
    "one elliptic": ((0.0860, 0.1344, 0.1476, 0.2369, 0.2171, 0.1504, 0.0438),
                     (0.1743, 0.1757, 0.2102, 0.2546, 0.2298, 0.1296, 0.0492)),
    "three intermediate": ((0.0314, 0.0717, 0.2158, 0.2473, 0.1969, 0.0777, 0.0926),
                           (0.1108, 0.1395, 0.1454, 0.1083, 0.0955, 0.0556, 0.0180)),
    "three parabolic": ((0.0376, 0.0681, 0.1759, 0.2320, 0.2261, 0.0868, 0.0869),
                        (0.1246, 0.1316, 0.1315, 0.1110, 0.1081, 0.0674, 0.0371)),
    "three elliptic": ((0.0266, 0.0853, 0.2651, 0.2656, 0.1940, 0.0872, 0.0954),
                       (0.0979, 0.1643, 0.1699, 0.1255, 0.1282, 0.0724, 0.0400)),
    "simplified": ((0.0348, 0.0727, 0.1069, 0.1132, 0.1821, 0.1780, 0.0470),
                   (0.1782, 0.1726, 0.1883, 0.2130, 0.1763, 0.1678, 0.0412)),
}  # fmt: skip
"""Name of a theory -> error by mu N that 95 % of the contacts keep to at each knot, without spin and with it."""
MOMENT_BANDS = {
    "blended intermediate": ((0.0118, 0.0240, 0.0264, 0.0284, 0.0271, 0.0245, 0.0137),
                             (0.0207, 0.0399, 0.0421, 0.0472, 0.0464, 0.0312, 0.0177)),
    "blended parabolic": ((0.0157, 0.0315, 0.0430, 0.0437, 0.0444, 0.0419, 0.0202),
                          (0.0291, 0.0564, 0.0683, 0.0801, 0.0759, 0.0603, 0.0206)),
    "blended elliptic": ((0.0096, 0.0247, 0.0264, 0.0228, 0.0263, 0.0261, 0.0211),
                         (0.0224, 0.0287, 0.0293, 0.0319, 0.0292, 0.0237, 0.0215)),
    "one intermediate": ((0.0382, 0.0736, 0.0861, 0.0798, 0.0708, 0.0460, 0.0226),
                         (0.0599, 0.0911, 0.0991, 0.0977, 0.0889, 0.0827, 0.0540)),
    "one parabolic": ((0.0403, 0.0838, 0.0988, 0.0945, 0.0750, 0.0501, 0.0341),
                      (0.0774, 0.1080, 0.1185, 0.1110, 0.1026, 0.0985, 0.0610)),
    "one elliptic": ((0.0377, 0.0605, 0.0737, 0.0663, 0.0714, 0.0527, 0.0247),
                     (0.0508, 0.0754, 0.0805, 0.0880, 0.0857, 0.0765, 0.0383)),
    "three intermediate": ((0.0117, 0.0234, 0.0304, 0.0795, 0.0806, 0.0399, 0.0216),
                           (0.0208, 0.0369, 0.0404, 0.0471, 0.0432, 0.0300, 0.0129)),
    "three parabolic": ((0.0157, 0.0328, 0.0388, 0.0619, 0.0632, 0.0240, 0.0164),
                        (0.0292, 0.0557, 0.0679, 0.0818, 0.0708, 0.0454, 0.0180)),
    "three elliptic": ((0.0097, 0.0276, 0.0544, 0.0987, 0.0992, 0.0603, 0.0260),
                       (0.0224, 0.0291, 0.0322, 0.0495, 0.0606, 0.0495, 0.0204)),
    "simplified": ((0.0261, 0.0680, 0.0977, 0.0960, 0.0636, 0.0403, 0.0234),
                   (0.1008, 0.1008, 0.0951, 0.0699, 0.0665, 0.0630, 0.0093)),
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
    share, wider = (spin_share(np.array(a), np.array(b), np.array(motion), contact.pair.nu),
                    float(slenderness(np.array(a), np.array(b))))  # fmt: skip
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
