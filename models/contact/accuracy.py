"""How far the forces of a contact are off: what its cells leave, and what the theory itself does.

Cells
    The same contact is rolled again on about half as many cells along each axis. An error of order p then changes by
    the ratio of the cells to the power p, which tells how much of it is left.
Theory
    On converged cells the theories were held against the exact one, on the ellipses, kinds and sizes of creepage of
    the validation case ``contact_price``: ``BANDS`` keeps what was found, the validation case that it still holds.
"""

from dataclasses import dataclass

import numpy as np

from models.contact.linear_theory import coefficients
from models.contact.theories import Contact, Fastsim, Linear, Motion, OnEllipse, Rolled, Simplified

KNOTS = (0.05, 0.2, 0.4, 0.6, 0.8, 0.95, 1.0)
"""Tangential force by mu N at which the bands are kept."""
BANDS = {
    "blended intermediate": ((0.0033, 0.0033, 0.0073, 0.0279, 0.0450, 0.0514, 0.0029),
                             (0.0503, 0.0594, 0.0620, 0.0636, 0.0561, 0.0384, 0.0581)),
    "blended parabolic": ((0.0025, 0.0026, 0.0114, 0.0407, 0.0430, 0.0506, 0.0395),
                          (0.0611, 0.0720, 0.0752, 0.0752, 0.0754, 0.0708, 0.0348)),
    "blended elliptic": ((0.0093, 0.0093, 0.0299, 0.0301, 0.0631, 0.0631, 0.0210),
                         (0.0587, 0.0909, 0.0940, 0.0912, 0.0884, 0.0568, 0.0863)),
    "one intermediate": ((0.0534, 0.1135, 0.1552, 0.1708, 0.1708, 0.1443, 0.0196),
                         (0.1610, 0.1620, 0.2177, 0.2264, 0.1903, 0.0958, 0.1952)),
    "one parabolic": ((0.0559, 0.1223, 0.1690, 0.1873, 0.1924, 0.1524, 0.0339),
                      (0.1492, 0.1573, 0.2235, 0.2444, 0.2061, 0.1245, 0.1000)),
    "one elliptic": ((0.0505, 0.0972, 0.1328, 0.1472, 0.1545, 0.1384, 0.0350),
                     (0.1823, 0.1826, 0.2183, 0.2164, 0.1668, 0.0699, 0.1944)),
    "three intermediate": ((0.0033, 0.0033, 0.0073, 0.0279, 0.0450, 0.1125, 0.1160),
                           (0.1227, 0.1255, 0.1140, 0.0874, 0.0708, 0.0382, 0.1158)),
    "three parabolic": ((0.0025, 0.0026, 0.0114, 0.0407, 0.0430, 0.1168, 0.1056),
                        (0.1347, 0.1303, 0.1271, 0.1030, 0.0885, 0.0719, 0.0348)),
    "three elliptic": ((0.0093, 0.0093, 0.0299, 0.0301, 0.0632, 0.1055, 0.1159),
                       (0.1055, 0.1312, 0.1326, 0.1169, 0.0912, 0.0573, 0.1246)),
    "simplified": ((0.0107, 0.0415, 0.0889, 0.0937, 0.0932, 0.0911, 0.0247),
                   (0.2110, 0.1808, 0.1679, 0.1866, 0.1357, 0.1057, 0.1805)),
}  # fmt: skip
"""Name of a theory -> error by mu N that 95 % of the contacts keep to at each knot, without spin and with it."""


@dataclass(frozen=True)
class Error:
    """Error of the tangential force (N): of the cells, and what 95 % of contacts like this keep to for the theory."""

    cells: float
    theory: float

    @property
    def total(self) -> float:
        """Both together (N)."""
        return self.cells + self.theory


def rolled(contact: Contact, motion: Motion, cells: int, *, fields: bool = False) -> tuple[Rolled, Error]:
    """Forces and how far they are off."""
    fine = contact.roll(motion, cells, fields=fields)
    if isinstance(contact, Linear):
        return fine, Error(0.0, _of_linear(contact, motion, fine))
    return fine, Error(left(contact, motion, cells, fine), _of_theory(contact, motion, fine))


def left(contact: Contact, motion: Motion, cells: int, fine: Rolled) -> float:
    """Error (N) that the cells leave, by step halving."""
    half = (cells + 1) // 2
    coarse = contact.roll(motion, half)
    return float(np.linalg.norm(fine.force - coarse.force) / ((cells / half) ** contact.order - 1.0))


def band(name: str, used: np.ndarray, spinning: np.ndarray) -> np.ndarray:
    """Error by mu N of a theory, one of BANDS, at forces ``used`` (by mu N) and shares ``spinning`` of spin."""
    without, with_spin = (np.interp(used, KNOTS, values) for values in BANDS[name])
    without = without * np.minimum(used / KNOTS[0], 1.0)  # the linear theory is met, but not where spin meets creepage
    return without + spinning * (with_spin - without)


def spin_share(a: np.ndarray, b: np.ndarray, motion: np.ndarray, nu: float) -> np.ndarray:
    """How far a motion (3, ...) counts as one with spin, 0 to 1: all from a third of the linear work on."""
    c = coefficients(a / b, nu)
    parts = np.stack([c.c11 * motion[0], c.c22 * motion[1], np.sqrt(a * b) * c.c23 * motion[2]]) ** 2
    whole = parts.sum(axis=0)
    return np.minimum(1.0, 3.0 * np.divide(parts[2], whole, out=np.zeros_like(whole), where=whole > 0))


def _of_theory(contact: Contact, motion: Motion, found: Rolled) -> float:
    """Band (N) of the simplified theories; of the exact one there is none."""
    limit = contact.friction * contact.pressing.load
    if limit == 0.0 or not isinstance(contact, Fastsim | Simplified):
        return 0.0
    if isinstance(contact, Fastsim):
        name, a, b = f"{contact.choices['flexibilities']} {contact.choices['bound']}", contact.a, contact.b
    else:
        name, a, b = "simplified", 1.0, 1.0
    share = spin_share(np.array(a), np.array(b), np.array(motion), contact.pair.nu)
    return limit * float(band(name, np.array(np.linalg.norm(found.force) / limit), share))


def _of_linear(contact: OnEllipse, motion: Motion, found: Rolled) -> float:
    """Distance (N) from FASTSIM, and its band."""
    better = Fastsim(contact.hertz, contact.friction, contact.pair, **BEST)
    other, error = rolled(better, motion, 31)
    return float(np.linalg.norm(found.force - other.force)) + error.total


BEST = {"flexibilities": "blended", "bound": "intermediate", "march": "second-order"}
"""Choices of FASTSIM that are closest to the exact theory on the whole."""
