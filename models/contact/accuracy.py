"""Error estimates of contact forces: the error of the finite cells, and the error of the theory itself.

Cells
    The same contact is rolled again on about half as many cells along each axis. An error of order p then changes by
    the ratio of the cells to the power p, which tells how much of it is left. Cells begin to slip one by one, so the
    two grids agree by chance now and then: force and moment are compared as one vector, twice the difference is stated
    (``SAFETY_FACTOR``) and a part of the force used that goes with the cells' area; and where little slips, both grids
    miss a zone of slip narrower than their cells (``TRAILING_SLIP_FACTOR``). At least 95 % of contacts keep to it,
    FASTSIM's on 5 to 41 cells (validation case ``contact_price``).
Theory
    On converged cells the theories were held against the exact one, on 1570 contacts of
    ``validation.contact.contact_set``: ellipses of a/b from 0.1 to 10, Poisson's ratio 0, 0.28 and 0.5, creepage and
    spin of 0.05 to 10 times what the linear theory takes to reach mu N, of thirteen kinds and in directions drawn at
    random. ``error_bands.csv`` keeps what 95 % of contacts keep to that are drawn anew, of each Poisson's
    ratio, of spin with and against the lateral creepage, and of ellipses longer along and across by themselves; the
    validation case ``contact_price`` tells whether they still do. The theory of 1983 was so measured on the same
    ellipses; other shapes are outside of what its band was measured on. Beyond a/b from 0.1 to 10 all bands widen in
    proportion (``slenderness``).

Both are stated for the tangential force and for the moment about the normal, which is that of FASTSIM's tractions.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from models.contact.inputs import Array
from models.contact.linear_theory import coefficients
from models.contact.theories import Fastsim, LinearTheory, Motion, OnEllipse, Rolled, RollingContact, Simplified

SAFETY_FACTOR = 2.0
"""Safety factor on the error that the comparison of two grids gives."""
LIKELY_SHARE = 0.7
"""Likely error of the finer grid as a share of the difference of both grids, from 600 contacts of all choices of
FASTSIM against cells a hundred times finer: a third had more, a hundredth more than three times as much.
"""
TRAILING_SLIP_FACTOR = 0.17
"""Factor of the force that a narrow zone of slip at the trailing edge takes away: share of mu N, divided by the square
of the used share of mu N. A zone wider than a cell is resolved: where the used share exceeds 3 divided by the number of
cells.
"""
MEASURED_AXIS_RATIOS = (0.1, 10.0)
"""Axis ratios a/b between which the error bands were measured."""
FILE = Path(__file__).with_name("error_bands.csv")
(_, _, _, *_KNOTS), *_ROWS = csv.reader(FILE.read_text().splitlines())
KNOTS = np.array(_KNOTS, float)
"""Ratios of the tangential force to mu N at which the error bands are tabulated."""
BANDS, MOMENT_BANDS = (
    {
        theory: [np.array(values, float) for kind, name, _, *values in _ROWS if (kind, name) == (quantity, theory)]
        for theory in dict.fromkeys(row[1] for row in _ROWS)
    }
    for quantity in ("force", "moment")
)
"""Error bands by the name of a theory: ratio of the error to mu N that 95 % of the contacts keep to at each knot,
without spin and with it; of the moment, ratio to mu N times the lever: the abscissa is ``used_with_moment``, and all
vanish at its zero.
"""


@dataclass(frozen=True)
class Error:
    """Estimated errors of the tangential force (N) and of the moment (N m) of a rolling contact.

    cells : largest error by the cells. theory : error of the theory that 95 % of contacts like this keep to.
    moment_cells and moment_theory : the same for the moment. likely, moment_likely : likely error by the cells, which a
    third of the contacts exceed.
    """

    cells: float
    theory: float
    moment_cells: float
    moment_theory: float
    likely: float = 0.0
    moment_likely: float = 0.0

    @property
    def total(self) -> float:
        """Error of the force (N) from the grid of cells and from the theory together."""
        return self.cells + self.theory

    @property
    def moment(self) -> float:
        """Error of the moment (N m) from the grid of cells and from the theory together."""
        return self.moment_cells + self.moment_theory


def rolled(contact: RollingContact, motion: Motion, cells: int, *, fields: bool = False) -> tuple[Rolled, Error]:
    """Contact forces at the given creepages and spin, and their estimated errors."""
    fine = contact.roll(motion, cells, fields=fields)
    if isinstance(contact, LinearTheory):
        force, moment = _linear_theory_errors(contact, motion, fine)
        return fine, Error(0.0, force, 0.0, moment)
    coarse = contact.roll(motion, coarser_cells(cells))
    (force, moment), (likely, turning) = (
        _largest_errors(contact, cells, fine, coarse),
        _likely_errors(contact, cells, fine, coarse),
    )
    theory, moment_theory = _theory_errors(contact, motion, fine)
    return fine, Error(force, theory, moment, moment_theory, likely, turning)


def remaining_errors(contact: RollingContact, motion: Motion, cells: int, fine: Rolled) -> tuple[float, float]:
    """Upper bounds of the errors that the finite number of cells causes in force (N) and moment (N m)."""
    return _largest_errors(contact, cells, fine, contact.roll(motion, coarser_cells(cells)))


def _friction_ratios(contact: RollingContact, *rolled: Rolled) -> list[Array]:
    """Ratios (3,) of each result: fx and fy to mu N, and mz to mu N times the lever."""
    limit = contact.friction * contact.pressing.load
    return [np.array([creep.fx, creep.fy, creep.mz / contact.lever]) / limit for creep in rolled]


def _largest_errors(contact: RollingContact, cells: int, fine: Rolled, coarse: Rolled) -> tuple[float, float]:
    """Upper bounds of the discretisation errors of force (N) and moment (N m), from a fine and a coarse grid."""
    limit = contact.friction * contact.pressing.load
    if limit == 0.0:
        return 0.0, 0.0
    fine_ratios, coarse_ratios = _friction_ratios(contact, fine, coarse)
    error = limit * float(cells_error(fine_ratios, coarse_ratios, cells, contact.order))
    return error, contact.lever * error


def _likely_errors(contact: RollingContact, cells: int, fine: Rolled, coarse: Rolled) -> tuple[float, float]:
    """Likely discretisation errors of force (N) and moment (N m): LIKELY_SHARE times the difference between fine and
    coarse grid, plus a small allowance for errors that both grids share.
    """
    limit = contact.friction * contact.pressing.load
    if limit == 0.0:
        return 0.0, 0.0
    fine_ratios, coarse_ratios = _friction_ratios(contact, fine, coarse)
    force, moment = (float(np.linalg.norm(part)) for part in (fine_ratios[:2], fine_ratios[2:]))
    errors = [
        LIKELY_SHARE * float(np.linalg.norm(gap)) + 0.2 * size / cells**2
        for gap, size in (((fine_ratios - coarse_ratios)[:2], force), ((fine_ratios - coarse_ratios)[2:], moment))
    ]
    unseen = 0.05 * force**2 * float(np.clip(2.0 - force * cells / 3.0, 0.0, 1.0))
    return limit * (errors[0] + unseen), limit * contact.lever * (errors[1] + unseen * moment)


def coarser_cells(cells: int) -> int:
    """Number of cells of the coarser grid that is compared with a grid of ``cells`` cells."""
    return (cells + 1) // 2


def cells_error(fine: Array, coarse: Array, cells: int, order: float) -> Array:
    """Relative discretisation errors (...) on ``cells`` cells, of the force to mu N, and of the moment to mu N times
    the lever.

    fine, coarse : (3, ...) fx and fy divided by mu N, mz divided by mu N times the lever, on ``cells`` and half of
    them. order : of the theory in the size of a cell.
    """
    used, order_gain = np.linalg.norm(fine, axis=0), (cells / coarser_cells(cells)) ** order - 1.0
    unseen = TRAILING_SLIP_FACTOR * used**2 * np.clip(2.0 - used * cells / 3.0, 0.0, 1.0)
    return SAFETY_FACTOR * np.linalg.norm(fine - coarse, axis=0) / order_gain + used / cells**2 + unseen


def band(name: str, used: Array, spinning: Array) -> Array:
    """Error band of a theory's force, as a ratio to mu N, at force ratios ``used`` (force to mu N) and weights
    ``spinning`` of spin from ``spin_share``; ``name`` : key of BANDS.
    """
    without, with_spin = (np.interp(used, KNOTS, values) for values in BANDS[name])
    without = without * np.minimum(used / KNOTS[0], 1.0)  # the linear theory is met, but not where spin meets creepage
    return without + spinning * (with_spin - without)


def moment_band(name: str, used: Array, spinning: Array) -> Array:
    """Error band of a theory's moment, as a ratio to mu N times the lever. ``used`` comes from ``used_with_moment``;
    other arguments as in ``band``.
    """
    without, with_spin = (np.interp(used, (0.0, *KNOTS), (0.0, *values)) for values in MOMENT_BANDS[name])
    return without + spinning * (with_spin - without)


def slenderness(a: Array, b: Array) -> Array:
    """Factor on the error bands of ellipses with semi-axes a, b: 1 for the axis ratios at which the bands were
    measured, larger beyond.
    """
    ratio = a / b
    return np.maximum(np.maximum(MEASURED_AXIS_RATIOS[0] / ratio, ratio / MEASURED_AXIS_RATIOS[1]), 1.0)


def used_with_moment(used: Array, moment: Array) -> Array:
    """Share of the friction limit used by force and moment: root of the sum of squares of force / (mu N) and moment /
    (mu N lever)."""
    return np.hypot(used, moment)


def spin_share(a: Array, b: Array, motion: Array, nu: float | Array) -> Array:
    """Weight, 0 to 1, of spin in a motion (3, ...) of creepages and spin: three times the share of spin in the sum of
    squares of the linear theory's terms, at most 1.
    """
    c = coefficients(a / b, nu)
    parts = np.stack([c.c11 * motion[0], c.c22 * motion[1], np.sqrt(a * b) * c.c23 * motion[2]]) ** 2
    total = parts.sum(axis=0)
    return np.minimum(1.0, 3.0 * np.divide(parts[2], total, out=np.zeros_like(total), where=total > 0))


def _theory_errors(contact: RollingContact, motion: Motion, forces: Rolled) -> tuple[float, float]:
    """Error bands of force (N) and moment (N m) of the simplified theories; zero for the exact theory."""
    limit = contact.friction * contact.pressing.load
    if limit == 0.0 or not isinstance(contact, Fastsim | Simplified):
        return 0.0, 0.0
    name, a, b = "simplified", np.array(1.0), np.array(1.0)
    if isinstance(contact, Fastsim):
        name = f"{contact.choices['flexibilities']} {contact.choices['bound']}"
        a, b = np.array(contact.a), np.array(contact.b)
    share, wider = spin_share(a, b, np.array(motion), contact.pair.nu), float(slenderness(a, b))
    used, most = np.array(np.linalg.norm(forces.force) / limit), limit * contact.lever
    both = used_with_moment(used, np.array(forces.mz / most))
    return wider * limit * float(band(name, used, share)), wider * most * float(moment_band(name, both, share))


def _linear_theory_errors(contact: OnEllipse, motion: Motion, forces: Rolled) -> tuple[float, float]:
    """Errors of the linear theory in force (N) and moment (N m): its difference from FASTSIM plus the error of
    FASTSIM.
    """
    better, error = rolled(Fastsim(contact.hertz, contact.friction, contact.pair, **BEST_CHOICES), motion, 31)
    difference = float(np.linalg.norm(forces.force - better.force))
    return difference + error.total, abs(forces.mz - better.mz) + error.moment


BEST_CHOICES = {"flexibilities": "blended", "bound": "intermediate", "march": "second-order"}
"""Options of FASTSIM that are on the whole closest to the exact theory."""
