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
    "blended parabolic": ((0.0004, 0.0026, 0.0114, 0.0268, 0.0443, 0.0554, 0.0259),
                          (0.0773, 0.0831, 0.0850, 0.1050, 0.1279, 0.1046, 0.1059)),
    "blended elliptic": ((0.0007, 0.0093, 0.0299, 0.0304, 0.0220, 0.0653, 0.0038),
                         (0.0731, 0.1178, 0.0596, 0.0703, 0.0743, 0.0608, 0.0947)),
    "one parabolic": ((0.0153, 0.0569, 0.1673, 0.1979, 0.1556, 0.0354, 0.0158),
                      (0.1536, 0.1131, 0.1981, 0.2594, 0.2089, 0.1060, 0.1959)),
    "one elliptic": ((0.0149, 0.0516, 0.1003, 0.1558, 0.1483, 0.0598, 0.0038),
                     (0.1834, 0.1353, 0.1837, 0.2417, 0.1843, 0.0719, 0.1840)),
    "three parabolic": ((0.0004, 0.0026, 0.0114, 0.0268, 0.0443, 0.0554, 0.1110),
                        (0.1132, 0.1329, 0.0963, 0.0868, 0.0864, 0.0468, 0.1217)),
    "three elliptic": ((0.0007, 0.0093, 0.0299, 0.0304, 0.0220, 0.0852, 0.1118),
                       (0.0717, 0.1315, 0.1270, 0.1055, 0.0764, 0.0448, 0.1230)),
    "simplified": ((0.0106, 0.0447, 0.0623, 0.0941, 0.0782, 0.0881, 0.0033),
                   (0.1896, 0.0985, 0.1596, 0.1453, 0.1538, 0.0802, 0.1713)),
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
    """How far a motion (3, ...) counts as one with spin, 0 to 1: from half of its linear force on, all of it."""
    c = coefficients(a / b, nu)
    parts = np.stack([c.c11 * motion[0], c.c22 * motion[1], np.sqrt(a * b) * c.c23 * motion[2]]) ** 2
    whole = parts.sum(axis=0)
    return np.minimum(1.0, 2.0 * np.divide(parts[2], whole, out=np.zeros_like(whole), where=whole > 0))


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
