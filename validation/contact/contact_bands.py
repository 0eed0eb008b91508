"""Error bands of the simplified contact theories, from their forces and moments on ``contact_set``.

The bands are fitted to the regular contacts and to a part of the random and wide ones; the other part judges them. A
band holds for every group of contacts separately: each Poisson's ratio, spin with and against the lateral creepage,
ellipses longer along the rolling direction and across it.

``python -m validation.contact.contact_bands`` prints what ``models/contact/error_bands.csv`` keeps.
"""

from dataclasses import dataclass, fields

import numpy as np

from models.contact.accuracy import (
    FRICTION_SHARE_KNOTS,
    force_error_band,
    friction_share_with_moment,
    moment_error_band,
    spin_weight_of_motion,
)
from models.contact.fastsim import RollingEllipse, fastsim
from models.contact.hertz import by_axes
from models.contact.inputs import Array
from models.contact.theories import SimplifiedTheory
from models.systems.contact.run import interpenetration_contact
from models.systems.contact.work_precision import ContactCase
from validation.contact.contact_set import FITTED_PART, FRICTION, LOAD, read_contacts, read_drawn, read_wide

CELLS_PER_STRIP = 101
"""Cells per strip of FASTSIM where its bands are fitted; the error of the cells is then below 0.05 % of mu N."""
BAND_SHARE, FITTED_QUANTILE, FEWEST_CONTACTS = 0.95, 0.96, 12
"""Share of unseen contacts whose error must lie within a band; quantile of the fitted contacts' errors that is the
band; smallest number of contacts in a group of which a quantile is taken."""
MOMENT_ROUNDING = 1e-9
"""Rounding error of a scaled moment that is zero by symmetry."""
FASTSIM_BANDS = [
    f"{kind} {bound}" for kind in ("blended", "one", "three") for bound in ("intermediate", "parabolic", "elliptic")
]


@dataclass(frozen=True)
class TheoryErrors:
    """Forces of a contact theory and their errors against the exact theory: force (n, 2) divided by mu N, moment (n,)
    divided by mu N times the longer semi-axis.

    error, moment_error (n,) : of force and moment, in the same units; spin_share (n,) : share of spin in the
    creepage; group_number (n,) : numbers by ``groups_of_contacts``.
    """

    force: Array
    moment: Array
    error: Array
    moment_error: Array
    spin_share: Array
    group_number: Array

    @property
    def used_friction(self) -> Array:
        """Magnitude (n,) of the creep force divided by mu N."""
        return np.linalg.norm(self.force, axis=1)

    @property
    def used_with_moment(self) -> Array:
        """Magnitude (n,) of the scaled creep force and moment together."""
        return friction_share_with_moment(self.used_friction, self.moment)

    def selected(self, selected_contacts: Array) -> "TheoryErrors":
        """Forces and errors of the contacts that a mask (n,) selects."""
        return TheoryErrors(*(getattr(self, part.name)[selected_contacts] for part in fields(self)))


def theory_forces(theory_name: str, contact_cases: list[ContactCase], cell_count: int) -> Array:
    """Creep forces (n, 3) of a theory named as in FASTSIM_BANDS or "simplified": fx, fy divided by mu N, and moment
    divided by mu N times the longer semi-axis."""
    axes, motions = _arrays_of_contacts(contact_cases)
    unit = FRICTION * LOAD * np.array([np.ones(len(contact_cases)), np.ones(len(contact_cases)), axes.max(axis=0)]).T
    if theory_name == "simplified":
        pressed = [interpenetration_contact(by_axes(c.a, c.b, c.pair, load=LOAD), c.pair) for c in contact_cases]
        theory_forces = [
            SimplifiedTheory(p, FRICTION).roll(c.motion, cell_count)
            for p, c in zip(pressed, contact_cases, strict=True)
        ]
        return np.array([(force.fx, force.fy, force.mz) for force in theory_forces]) / unit
    kind, bound = theory_name.split()
    moved, nus = np.empty((len(contact_cases), 3)), np.array([case.pair.nu for case in contact_cases])
    for nu in np.unique(nus):
        rows = np.flatnonzero(nus == nu)
        (a, b), (x, y, spin), pair = axes[:, rows], motions[:, rows], contact_cases[rows[0]].pair
        ellipses = RollingEllipse(a, b, LOAD, FRICTION, x, y, spin)
        creep = fastsim(ellipses, pair, cells=cell_count, bound=bound, flexibilities=kind)  # type: ignore[arg-type]
        moved[rows] = np.stack([creep.fx, creep.fy, creep.mz], axis=1)
    return moved / unit


def _arrays_of_contacts(contact_cases: list[ContactCase]) -> tuple[Array, Array]:
    """Semi-axes a, b (2, n) and creepages xi_x, xi_y, spin (3, n) of contacts."""
    return np.array([(c.a, c.b) for c in contact_cases]).T, np.array([c.motion for c in contact_cases]).T


def groups_of_contacts(contact_cases: list[ContactCase]) -> Array:
    """Group number (n,) of each contact. Groups, which have different errors, differ in Poisson's ratio, in spin with
    or against the lateral creepage, and in ellipses longer along or across the rolling direction."""
    kinds = [(c.pair.nu, c.parts[1] * c.parts[2] < 0, c.a < c.b) for c in contact_cases]
    return np.unique(np.array(kinds, dtype=float), axis=0, return_inverse=True)[1].ravel()


def theory_errors(
    theory_name: str, contact_cases: list[ContactCase], cell_count: int = CELLS_PER_STRIP
) -> TheoryErrors:
    """Forces, moments and errors of a contact theory on a list of contacts with exact forces."""
    answers, nu = theory_forces(theory_name, contact_cases, cell_count), np.array([c.pair.nu for c in contact_cases])
    axes, motions = _arrays_of_contacts(contact_cases)
    exact = np.array([(*c.force, c.mz * np.sqrt(c.a * c.b) / max(c.a, c.b)) for c in contact_cases])
    off, share = answers - exact, spin_weight_of_motion(axes[0], axes[1], motions, nu)
    return TheoryErrors(
        answers[:, :2],
        answers[:, 2],
        np.linalg.norm(off[:, :2], axis=1),
        np.abs(off[:, 2]),
        share,
        groups_of_contacts(contact_cases),
    )


def shares_within_bands(theory_name: str, theory_errors_of_contacts: TheoryErrors) -> tuple[float, float]:
    """Shares of contacts whose errors of force and of moment lie within the bands that ``models.contact.accuracy``
    states."""
    moment = moment_error_band(
        theory_name, theory_errors_of_contacts.used_with_moment, theory_errors_of_contacts.spin_share
    )
    return (
        float(
            np.mean(
                theory_errors_of_contacts.error
                <= force_error_band(
                    theory_name, theory_errors_of_contacts.used_friction, theory_errors_of_contacts.spin_share
                )
            )
        ),
        float(np.mean(theory_errors_of_contacts.moment_error <= moment + MOMENT_ROUNDING)),
    )


def measured_bands(
    relative_errors: Array, used_friction: Array, theory_errors_of_contacts: TheoryErrors
) -> tuple[list[float], ...]:
    """Bands of a theory's error: its quantile at each knot of used friction, largest over the groups of contacts; a
    list without spin and a list with spin."""
    ends = (0.0, *FRICTION_SHARE_KNOTS, 1.1)
    within = [(used_friction >= low) & (used_friction <= high) for low, high in zip(ends, ends[2:], strict=False)]
    kinds = theory_errors_of_contacts.spin_share < 0.5, theory_errors_of_contacts.spin_share >= 0.5
    return tuple(
        [_largest_quantile(relative_errors, rows & some, theory_errors_of_contacts.group_number) for some in within]
        for rows in kinds
    )


def _largest_quantile(relative_errors: Array, selected_rows: Array, group_numbers: Array) -> float:
    """Largest error quantile over the groups with enough contacts, or the quantile over all contacts if no group has
    enough."""
    parts = [relative_errors[selected_rows & (group_numbers == value)] for value in np.unique(group_numbers)]
    told = [part for part in parts if part.size >= FEWEST_CONTACTS] or [relative_errors[selected_rows]]
    return max(float(np.quantile(part, FITTED_QUANTILE)) for part in told)


def main() -> None:
    """Fit the bands of all theories and print the rows of ``error_bands.csv``."""
    known = read_contacts() + read_drawn(FITTED_PART) + read_wide(FITTED_PART)
    theories = {name: theory_errors(name, known) for name in (*FASTSIM_BANDS, "simplified")}
    for quantity, error, used in (("force", "error", "used_friction"), ("moment", "moment_error", "used_with_moment")):
        for name, theory in theories.items():
            bands = measured_bands(getattr(theory, error), getattr(theory, used), theory)
            for spin, band_of in zip(("without", "with"), bands, strict=True):
                print(",".join([quantity, name, spin, *(f"{value:.4f}" for value in band_of)]))


if __name__ == "__main__":
    main()
