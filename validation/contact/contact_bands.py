"""Bands of error of the simplified theories, from their forces and moments on ``contact_set``.

Those contacts are the set and one of the two parts of the drawn and of the wide ones; the other part judges. A band
holds for every group of contacts by itself: each Poisson's ratio, spin with and against the lateral creepage, ellipses
longer along the rolling direction and across it.

``python -m validation.contact.contact_bands`` prints what ``models/contact/error_bands.csv`` keeps.
"""

from dataclasses import dataclass, fields

import numpy as np

from models.contact.accuracy import KNOTS, band, moment_band, spin_share, used_with_moment
from models.contact.fastsim import RollingEllipse, fastsim
from models.contact.hertz import by_axes
from models.contact.inputs import Array
from models.contact.theories import Simplified
from models.systems.contact.run import interpenetrating
from models.systems.contact.work_precision import ContactCase
from validation.contact.contact_set import FITTED_PART, FRICTION, LOAD, read_contacts, read_drawn, read_wide

CELLS_PER_STRIP = 101
"""In each strip of FASTSIM_BANDS: its own error is then below 0.05 % of mu N."""
HELD_SHARE, KNOWN_SHARE, FEWEST_OF_GROUP = 0.95, 0.96, 12
"""Part of unseen contacts that a band is to hold; of the known ones of each group between the neighbours of each knot;
contacts that tell no quantile."""
ROUNDING = 1e-9
"""Of a moment that is zero by symmetry."""
FASTSIM_BANDS = [
    f"{kind} {bound}" for kind in ("blended", "one", "three") for bound in ("intermediate", "parabolic", "elliptic")
]


@dataclass(frozen=True)
class TheoryErrors:
    """Forces and errors of a theory relative to the exact one: force (n, 2) divided by mu N, moment (n,) divided by mu
    N times the lever arm.

    error, moment_error : (n,) of both, in the same units. spinning : (n,) share of spin. group : (n,) numbers by
    ``groups_of_contacts``.
    """

    force: Array
    moment: Array
    error: Array
    moment_error: Array
    spinning: Array
    group: Array

    @property
    def used_friction(self) -> Array:
        """Magnitude (n,) of the force divided by mu N."""
        return np.linalg.norm(self.force, axis=1)

    @property
    def used_with_moment(self) -> Array:
        """Magnitude (n,) of force and moment together."""
        return used_with_moment(self.used_friction, self.moment)

    def of(self, mask: Array) -> "TheoryErrors":
        """The contacts that a mask (n,) selects."""
        return TheoryErrors(*(getattr(self, part.name)[mask] for part in fields(self)))


def forces(name: str, cases: list[ContactCase], cells: int) -> Array:
    """Forces (n, 3) of a theory, FASTSIM_BANDS or "simplified": force divided by mu N, and moment divided by mu N and
    the longer semi-axis."""
    axes, motions = _arrays_of_contacts(cases)
    unit = FRICTION * LOAD * np.array([np.ones(len(cases)), np.ones(len(cases)), axes.max(axis=0)]).T
    if name == "simplified":
        pressed = [interpenetrating(by_axes(c.a, c.b, c.pair, load=LOAD), c.pair) for c in cases]
        forces = [Simplified(p, FRICTION).roll(c.motion, cells) for p, c in zip(pressed, cases, strict=True)]
        return np.array([(force.fx, force.fy, force.mz) for force in forces]) / unit
    kind, bound = name.split()
    moved, nus = np.empty((len(cases), 3)), np.array([case.pair.nu for case in cases])
    for nu in np.unique(nus):
        rows = np.flatnonzero(nus == nu)
        (a, b), (x, y, spin), pair = axes[:, rows], motions[:, rows], cases[rows[0]].pair
        ellipses = RollingEllipse(a, b, LOAD, FRICTION, x, y, spin)
        creep = fastsim(ellipses, pair, cells=cells, bound=bound, flexibilities=kind)  # type: ignore[arg-type]
        moved[rows] = np.stack([creep.fx, creep.fy, creep.mz], axis=1)
    return moved / unit


def _arrays_of_contacts(cases: list[ContactCase]) -> tuple[Array, Array]:
    """Semi-axes (2, n) and motions (3, n)."""
    return np.array([(c.a, c.b) for c in cases]).T, np.array([c.motion for c in cases]).T


def groups_of_contacts(cases: list[ContactCase]) -> Array:
    """Group number (n,) of each contact. Groups, in which theories have different errors, differ in Poisson's ratio, in
    spin with or against the lateral creepage, and in ellipses longer along or across the rolling direction."""
    kinds = [(c.pair.nu, c.parts[1] * c.parts[2] < 0, c.a < c.b) for c in cases]
    return np.unique(np.array(kinds, dtype=float), axis=0, return_inverse=True)[1].ravel()


def theory_errors(name: str, cases: list[ContactCase], cells: int = CELLS_PER_STRIP) -> TheoryErrors:
    """A theory's forces, moments and errors."""
    answers, nu = forces(name, cases, cells), np.array([c.pair.nu for c in cases])
    axes, motions = _arrays_of_contacts(cases)
    exact = np.array([(*c.force, c.mz * np.sqrt(c.a * c.b) / max(c.a, c.b)) for c in cases])
    off, share = answers - exact, spin_share(axes[0], axes[1], motions, nu)
    return TheoryErrors(
        answers[:, :2],
        answers[:, 2],
        np.linalg.norm(off[:, :2], axis=1),
        np.abs(off[:, 2]),
        share,
        groups_of_contacts(cases),
    )


def kept_shares(name: str, constant: TheoryErrors) -> tuple[float, float]:
    """Shares of contacts whose errors of force and of moment are within those that ``models.contact.accuracy``
    states."""
    moment = moment_band(name, constant.used_with_moment, constant.spinning)
    return (
        float(np.mean(constant.error <= band(name, constant.used_friction, constant.spinning))),
        float(np.mean(constant.moment_error <= moment + ROUNDING)),
    )


def measured_bands(error: Array, used: Array, theory: TheoryErrors) -> tuple[list[float], ...]:
    """Quantiles of the error at each knot, of the group of contacts with the largest; one list without spin and one
    with spin."""
    ends = (0.0, *KNOTS, 1.1)
    within = [(used >= low) & (used <= high) for low, high in zip(ends, ends[2:], strict=False)]
    kinds = theory.spinning < 0.5, theory.spinning >= 0.5
    return tuple([_largest_quantile(error, rows & some, theory.group) for some in within] for rows in kinds)


def _largest_quantile(error: Array, rows: Array, group: Array) -> float:
    """Largest quantile over the groups with enough contacts, or the quantile over all contacts if no group has
    enough."""
    parts = [error[rows & (group == value)] for value in np.unique(group)]
    told = [part for part in parts if part.size >= FEWEST_OF_GROUP] or [error[rows]]
    return max(float(np.quantile(part, KNOWN_SHARE)) for part in told)


def main() -> None:
    """Print the rows of ``error_bands.csv``."""
    known = read_contacts() + read_drawn(FITTED_PART) + read_wide(FITTED_PART)
    theories = {name: theory_errors(name, known) for name in (*FASTSIM_BANDS, "simplified")}
    for quantity, error, used in (("force", "error", "used_friction"), ("moment", "moment_error", "used_with_moment")):
        for name, theory in theories.items():
            bands = measured_bands(getattr(theory, error), getattr(theory, used), theory)
            for spin, band_of in zip(("without", "with"), bands, strict=True):
                print(",".join([quantity, name, spin, *(f"{value:.4f}" for value in band_of)]))


if __name__ == "__main__":
    main()
