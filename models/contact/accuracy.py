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
    proportion (``slenderness_factor``).

Both are stated for the tangential force and for the moment about the normal, which is that of FASTSIM's tractions.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from models.contact.inputs import Array
from models.contact.linear_theory import kalker_coefficients
from models.contact.theories import (
    CreepagesAndSpin,
    FastsimTheory,
    LinearTheory,
    RollingContact,
    RollingOnEllipse,
    RollingResult,
    SimplifiedTheory,
)

SAFETY_FACTOR = 2.0
"""Safety factor on the error that the comparison of two grids gives."""
LIKELY_ERROR_SHARE = 0.7
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
ERROR_BANDS_PATH = Path(__file__).with_name("error_bands.csv")
(_, _, _, *_KNOTS), *_ROWS = csv.reader(ERROR_BANDS_PATH.read_text().splitlines())
FRICTION_SHARE_KNOTS = np.array(_KNOTS, float)
"""Ratios of the tangential force to mu N at which the error bands are tabulated."""
BANDS, MOMENT_BANDS = (
    {
        theory: [np.array(values, float) for kind, name, _, *values in _ROWS if (kind, name) == (quantity, theory)]
        for theory in dict.fromkeys(row[1] for row in _ROWS)
    }
    for quantity in ("force", "moment")
)
"""Error bands by the name of a theory: ratio of the error to mu N that 95 % of the contacts keep to at each knot,
without spin and with it; of the moment, ratio to mu N times the lever: the abscissa is ``friction_share_with_moment``,
and all vanish at its zero.
"""


@dataclass(frozen=True)
class ContactErrors:
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


def rolled_with_errors(
    rolling_contact: RollingContact, creepages: CreepagesAndSpin, cell_count: int, *, with_fields: bool = False
) -> tuple[RollingResult, ContactErrors]:
    """Contact forces at the given creepages and spin, and their estimated errors."""
    fine = rolling_contact.roll(creepages, cell_count, with_fields=with_fields)
    if isinstance(rolling_contact, LinearTheory):
        force, moment = _linear_theory_errors(rolling_contact, creepages, fine)
        return fine, ContactErrors(0.0, force, 0.0, moment)
    coarse = rolling_contact.roll(creepages, coarser_cells(cell_count))
    (force, moment), (likely, turning) = (
        _largest_errors(rolling_contact, cell_count, fine, coarse),
        _likely_errors(rolling_contact, cell_count, fine, coarse),
    )
    theory, moment_theory = _theory_errors(rolling_contact, creepages, fine)
    return fine, ContactErrors(force, theory, moment, moment_theory, likely, turning)


def remaining_errors(
    rolling_contact: RollingContact, creepages: CreepagesAndSpin, cell_count: int, fine_result: RollingResult
) -> tuple[float, float]:
    """Upper bounds of the errors that the finite number of cells causes in force (N) and moment (N m)."""
    return _largest_errors(
        rolling_contact, cell_count, fine_result, rolling_contact.roll(creepages, coarser_cells(cell_count))
    )


def _friction_ratios(rolling_contact: RollingContact, *rolled: RollingResult) -> list[Array]:
    """Ratios (3,) of each result: fx and fy to mu N, and mz to mu N times the lever."""
    limit = rolling_contact.friction * rolling_contact.pressing.load
    return [np.array([creep.fx, creep.fy, creep.mz / rolling_contact.lever]) / limit for creep in rolled]


def _largest_errors(
    rolling_contact: RollingContact, cell_count: int, fine_result: RollingResult, coarse_result: RollingResult
) -> tuple[float, float]:
    """Upper bounds of the discretisation errors of force (N) and moment (N m), from a fine and a coarse grid."""
    limit = rolling_contact.friction * rolling_contact.pressing.load
    if limit == 0.0:
        return 0.0, 0.0
    fine_ratios, coarse_ratios = _friction_ratios(rolling_contact, fine_result, coarse_result)
    error = limit * float(cells_error(fine_ratios, coarse_ratios, cell_count, rolling_contact.order))
    return error, rolling_contact.lever * error


def _likely_errors(
    rolling_contact: RollingContact, cell_count: int, fine_result: RollingResult, coarse_result: RollingResult
) -> tuple[float, float]:
    """Likely discretisation errors of force (N) and moment (N m): LIKELY_SHARE times the difference between fine and
    coarse grid, plus a small allowance for errors that both grids share.
    """
    limit = rolling_contact.friction * rolling_contact.pressing.load
    if limit == 0.0:
        return 0.0, 0.0
    fine_ratios, coarse_ratios = _friction_ratios(rolling_contact, fine_result, coarse_result)
    force, moment = (float(np.linalg.norm(part)) for part in (fine_ratios[:2], fine_ratios[2:]))
    errors = [
        LIKELY_ERROR_SHARE * float(np.linalg.norm(gap)) + 0.2 * size / cell_count**2
        for gap, size in (((fine_ratios - coarse_ratios)[:2], force), ((fine_ratios - coarse_ratios)[2:], moment))
    ]
    unseen = 0.05 * force**2 * float(np.clip(2.0 - force * cell_count / 3.0, 0.0, 1.0))
    return limit * (errors[0] + unseen), limit * rolling_contact.lever * (errors[1] + unseen * moment)


def coarser_cells(cell_count: int) -> int:
    """Number of cells of the coarser grid that is compared with a grid of ``cell_count`` cells."""
    return (cell_count + 1) // 2


def cells_error(fine_result: Array, coarse_result: Array, cell_count: int, convergence_order: float) -> Array:
    """Relative discretisation errors (...) on ``cell_count`` cells, of the force to mu N, and of the moment to mu N
    times the lever.

    fine_result, coarse_result : (3, ...) fx and fy divided by mu N, mz divided by mu N times the lever, on
    ``cell_count`` and half of them. convergence_order : of the theory in the size of a cell.
    """
    used, order_gain = (
        np.linalg.norm(fine_result, axis=0),
        (cell_count / coarser_cells(cell_count)) ** convergence_order - 1.0,
    )
    unseen = TRAILING_SLIP_FACTOR * used**2 * np.clip(2.0 - used * cell_count / 3.0, 0.0, 1.0)
    return (
        SAFETY_FACTOR * np.linalg.norm(fine_result - coarse_result, axis=0) / order_gain + used / cell_count**2 + unseen
    )


def force_error_band(theory_name: str, friction_share: Array, spin_weight: Array) -> Array:
    """Error band of a theory's force, as a ratio to mu N, at force ratios ``friction_share`` (force to mu N) and
    weights ``spin_weight`` of spin from ``spin_weight_of_motion``; ``theory_name`` : key of BANDS.
    """
    without, with_spin = (np.interp(friction_share, FRICTION_SHARE_KNOTS, values) for values in BANDS[theory_name])
    without = without * np.minimum(
        friction_share / FRICTION_SHARE_KNOTS[0], 1.0
    )  # the linear theory is met, but not where spin meets creepage
    return without + spin_weight * (with_spin - without)


def moment_error_band(theory_name: str, friction_share: Array, spin_weight: Array) -> Array:
    """Error band of a theory's moment, as a ratio to mu N times the lever. ``friction_share`` comes from
    ``friction_share_with_moment``; other arguments as in ``force_error_band``.
    """
    without, with_spin = (
        np.interp(friction_share, (0.0, *FRICTION_SHARE_KNOTS), (0.0, *values)) for values in MOMENT_BANDS[theory_name]
    )
    return without + spin_weight * (with_spin - without)


def slenderness_factor(a: Array, b: Array) -> Array:
    """Factor on the error bands of ellipses with semi-axes a, b: 1 for the axis ratios at which the bands were
    measured, larger beyond.
    """
    ratio = a / b
    return np.maximum(np.maximum(MEASURED_AXIS_RATIOS[0] / ratio, ratio / MEASURED_AXIS_RATIOS[1]), 1.0)


def friction_share_with_moment(friction_share: Array, moment_share: Array) -> Array:
    """Share of the friction limit used by force and moment_share: root of the sum of squares of force / (mu N) and
    moment / (mu N lever).
    """
    return np.hypot(friction_share, moment_share)


def spin_weight_of_motion(a: Array, b: Array, creepages: Array, nu: float | Array) -> Array:
    """Weight, 0 to 1, of spin in a motion (3, ...) of creepages and spin: three times the share of spin in the sum of
    squares of the linear theory's terms, at most 1.
    """
    c = kalker_coefficients(a / b, nu)
    parts = np.stack([c.c11 * creepages[0], c.c22 * creepages[1], np.sqrt(a * b) * c.c23 * creepages[2]]) ** 2
    total = parts.sum(axis=0)
    return np.minimum(1.0, 3.0 * np.divide(parts[2], total, out=np.zeros_like(total), where=total > 0))


def _theory_errors(
    rolling_contact: RollingContact, creepages: CreepagesAndSpin, rolling_result: RollingResult
) -> tuple[float, float]:
    """Error bands of force (N) and moment (N m) of the simplified theories; zero for the exact theory."""
    limit = rolling_contact.friction * rolling_contact.pressing.load
    if limit == 0.0 or not isinstance(rolling_contact, FastsimTheory | SimplifiedTheory):
        return 0.0, 0.0
    name, a, b = "simplified", np.array(1.0), np.array(1.0)
    if isinstance(rolling_contact, FastsimTheory):
        name = f"{rolling_contact.choices['flexibilities']} {rolling_contact.choices['bound']}"
        a, b = np.array(rolling_contact.a), np.array(rolling_contact.b)
    share, wider = (
        spin_weight_of_motion(a, b, np.array(creepages), rolling_contact.pair.nu),
        float(slenderness_factor(a, b)),
    )
    used, most = np.array(np.linalg.norm(rolling_result.force) / limit), limit * rolling_contact.lever
    both = friction_share_with_moment(used, np.array(rolling_result.mz / most))
    return wider * limit * float(force_error_band(name, used, share)), wider * most * float(
        moment_error_band(name, both, share)
    )


def _linear_theory_errors(
    rolling_contact: RollingOnEllipse, creepages: CreepagesAndSpin, rolling_result: RollingResult
) -> tuple[float, float]:
    """Errors of the linear theory in force (N) and moment (N m): its difference from FASTSIM plus the error of
    FASTSIM.
    """
    better, error = rolled_with_errors(
        FastsimTheory(rolling_contact.hertz, rolling_contact.friction, rolling_contact.pair, **BEST_FASTSIM_CHOICES),
        creepages,
        31,
    )
    difference = float(np.linalg.norm(rolling_result.force - better.force))
    return difference + error.total, abs(rolling_result.mz - better.mz) + error.moment


BEST_FASTSIM_CHOICES = {"flexibilities": "blended", "bound": "intermediate", "march": "second-order"}
"""Options of FASTSIM that are on the whole closest to the exact theory."""
