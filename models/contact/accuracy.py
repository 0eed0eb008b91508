"""How far the forces of a contact are off: what its cells leave, and what the theory itself does.

Cells
    The same contact is rolled again on about half as many cells along each axis. An error of order p then changes by
    the ratio of the cells to the power p, which tells how much of it is left.
Theory
    On converged cells the theories were held against the exact one, on 820 contacts of
    ``validation.contact.contact_set``: ellipses of a/b from 0.2 to 5,
    creepage and spin of 0.05 to 10 times what the linear theory takes to reach mu N, of
    thirteen kinds and in 300 directions drawn at random, nu = 0.28. ``BANDS`` and ``MOMENT_BANDS`` keep what 95 % of
    contacts keep to that are drawn anew, and the validation case ``contact_price`` tells whether they still do. The
    theory of 1983 was so measured on the same ellipses; other shapes are outside of what its band was measured on.
    Beyond a/b from 0.2 to 5 all bands widen in proportion (``slenderness``): of 30 contacts each at a/b = 0.1, 0.05,
    0.02 and 0.01 FASTSIM's largest error was 2.0, 3.7, 5.7 and 12 times the band, of its moment mostly.

Both are stated for the tangential force and for the moment about the normal. The simplified theories' moment is worse
than their force: under spin it is too large, by up to a quarter of mu N sqrt(ab) at a/b = 0.2.
"""

from dataclasses import dataclass

import numpy as np

from models.contact.linear_theory import coefficients
from models.contact.theories import Contact, Fastsim, Linear, Motion, OnEllipse, Rolled, Simplified

SLENDER = (0.2, 5.0)
"""a/b between which the bands were measured."""
KNOTS = (0.05, 0.2, 0.4, 0.6, 0.8, 0.95, 1.0)
"""Tangential force by mu N at which the bands are kept."""
BANDS = {
    "blended intermediate": ((0.0027, 0.0146, 0.0243, 0.0286, 0.0410, 0.0400, 0.0215),
                             (0.0316, 0.0378, 0.0451, 0.0462, 0.0458, 0.0344, 0.0203)),
    "blended parabolic": ((0.0056, 0.0270, 0.0292, 0.0398, 0.0429, 0.0359, 0.0312),
                          (0.0434, 0.0696, 0.0771, 0.0799, 0.0784, 0.0489, 0.0224)),
    "blended elliptic": ((0.0085, 0.0263, 0.0341, 0.0423, 0.0595, 0.0596, 0.0283),
                         (0.0580, 0.0608, 0.0597, 0.0753, 0.0763, 0.0570, 0.0418)),
    "one intermediate": ((0.0727, 0.1540, 0.1882, 0.2012, 0.1719, 0.1409, 0.0392),
                         (0.1664, 0.1801, 0.2347, 0.2353, 0.1845, 0.1144, 0.0860)),
    "one parabolic": ((0.0753, 0.1611, 0.2008, 0.2177, 0.1877, 0.1469, 0.0435),
                      (0.1571, 0.1887, 0.2387, 0.2411, 0.1977, 0.1375, 0.0936)),
    "one elliptic": ((0.0701, 0.1395, 0.1496, 0.1760, 0.1680, 0.1421, 0.0354),
                     (0.1848, 0.1848, 0.2223, 0.2219, 0.1836, 0.1103, 0.0265)),
    "three intermediate": ((0.0041, 0.0861, 0.1543, 0.1486, 0.1197, 0.0912, 0.1046),
                           (0.1246, 0.1311, 0.1410, 0.1128, 0.0798, 0.0453, 0.0218)),
    "three parabolic": ((0.0070, 0.0706, 0.1520, 0.1413, 0.1170, 0.0923, 0.0962),
                        (0.1360, 0.1422, 0.1401, 0.1207, 0.0908, 0.0659, 0.0371)),
    "three elliptic": ((0.0083, 0.0782, 0.1718, 0.1647, 0.1359, 0.0882, 0.1077),
                       (0.1172, 0.1421, 0.1538, 0.1272, 0.1085, 0.0716, 0.0418)),
    "simplified": ((0.0326, 0.0718, 0.0853, 0.0963, 0.1170, 0.1019, 0.0321),
                   (0.2212, 0.1919, 0.1975, 0.2193, 0.2138, 0.1084, 0.0262)),
}  # fmt: skip
"""Name of a theory -> error by mu N that 95 % of the contacts keep to at each knot, without spin and with it."""
MOMENT_BANDS = {
    "blended intermediate": ((0.0154, 0.0506, 0.0620, 0.0533, 0.0248, 0.0194, 0.0154),
                             (0.0451, 0.0759, 0.0830, 0.0759, 0.0425, 0.0349, 0.0159)),
    "blended parabolic": ((0.0120, 0.0427, 0.0486, 0.0441, 0.0354, 0.0318, 0.0175),
                          (0.0384, 0.0630, 0.0683, 0.0683, 0.0656, 0.0638, 0.0170)),
    "blended elliptic": ((0.0187, 0.0543, 0.0794, 0.0744, 0.0386, 0.0297, 0.0162),
                         (0.0540, 0.1009, 0.1089, 0.0973, 0.0461, 0.0276, 0.0252)),
    "one intermediate": ((0.0440, 0.0769, 0.0880, 0.0865, 0.0669, 0.0558, 0.0223),
                         (0.0699, 0.1041, 0.1122, 0.1068, 0.0921, 0.0779, 0.0570)),
    "one parabolic": ((0.0462, 0.0867, 0.0992, 0.0988, 0.0745, 0.0497, 0.0289),
                      (0.0921, 0.1212, 0.1270, 0.1192, 0.1031, 0.1006, 0.0640)),
    "one elliptic": ((0.0410, 0.0618, 0.0687, 0.0680, 0.0617, 0.0566, 0.0184),
                     (0.0519, 0.0802, 0.0882, 0.0933, 0.0916, 0.0720, 0.0229)),
    "three intermediate": ((0.0160, 0.0591, 0.0997, 0.1385, 0.1391, 0.0960, 0.0536),
                           (0.0457, 0.0860, 0.1235, 0.1266, 0.1280, 0.0909, 0.0256)),
    "three parabolic": ((0.0126, 0.0478, 0.0808, 0.1186, 0.1209, 0.0782, 0.0439),
                        (0.0390, 0.0729, 0.1047, 0.1064, 0.1017, 0.0738, 0.0206)),
    "three elliptic": ((0.0200, 0.0646, 0.1299, 0.1720, 0.1719, 0.1261, 0.0660),
                       (0.0555, 0.1021, 0.1583, 0.1637, 0.1665, 0.1605, 0.0249)),
    "simplified": ((0.0296, 0.0740, 0.0794, 0.0758, 0.0659, 0.0467, 0.0158),
                   (0.0755, 0.0811, 0.0790, 0.0765, 0.0691, 0.0519, 0.0085)),
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


def slenderness(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Factor on the bands of an ellipse: 1 on those that they were measured on, more beyond."""
    ratio = a / b
    return np.maximum(np.maximum(SLENDER[0] / ratio, ratio / SLENDER[1]), 1.0)


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
