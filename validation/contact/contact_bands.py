"""Bands of error of the simplified theories, from their forces and moments on ``contact_set``.

Those contacts are the set and one of the two parts of the drawn and of the wide ones; the other part judges. A band
holds for every group of contacts by itself: each Poisson's ratio, spin with and against the lateral creepage, ellipses
longer along the rolling direction and across it.

``python -m validation.contact.contact_bands`` prints what ``models.contact.accuracy`` keeps.
"""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from models.contact.accuracy import KNOTS, band, moment_band, spin_share, used_with_moment
from models.contact.fastsim import fastsim
from models.contact.hertz import by_axes
from models.contact.inputs import Array
from models.contact.theories import Simplified
from models.systems.contact.run import interpenetrating
from models.systems.contact.work_precision import Case
from validation.contact.contact_set import FITTED, FRICTION, LOAD, read, read_drawn, read_wide

CELLS = 101
"""In each strip of FASTSIM: its own error is then below 0.05 % of mu N."""
SHARE, NEAR, FEW = 0.95, 0.96, 12
"""Part of unseen contacts that a band is to hold; of the known ones of each group between the neighbours of each knot;
contacts that tell no quantile."""
ROUNDING = 1e-9
"""Of a moment that is zero by symmetry."""
FASTSIM = [
    f"{kind} {bound}" for kind in ("blended", "one", "three") for bound in ("intermediate", "parabolic", "elliptic")
]


@dataclass(frozen=True)
class Held:
    """A theory against the exact one: force (n, 2) by mu N, moment (n,) by mu N times the lever.

    error, moment_error : (n,) of both, in the same units. spinning : (n,) share of spin. group : (n,) numbers by
    ``groups``.
    """

    force: Array
    moment: Array
    error: Array
    moment_error: Array
    spinning: Array
    group: Array

    @property
    def used(self) -> Array:
        """Size of the force, (n,)."""
        return np.linalg.norm(self.force, axis=1)

    @property
    def used_with_moment(self) -> Array:
        """Size of force and moment, (n,)."""
        return used_with_moment(self.used, self.moment)

    def of(self, which: Array) -> "Held":
        """Some of the contacts, by a mask (n,)."""
        return Held(*(getattr(self, part.name)[which] for part in fields(self)))


def forces(name: str, cases: list[Case], cells: int) -> Array:
    """Force by mu N and moment by mu N and the longer semi-axis (n, 3) of a theory, of FASTSIM or "simplified"."""
    axes, motions = _arrays(cases)
    unit = FRICTION * LOAD * np.array([np.ones(len(cases)), np.ones(len(cases)), axes.max(axis=0)]).T
    if name == "simplified":
        found = [_simplified(c).roll(c.motion, cells) for c in cases]
        return np.array([(one.fx, one.fy, one.mz) for one in found]) / unit
    kind, bound = name.split()
    choices: dict[str, Any] = {"cells": cells, "bound": bound, "flexibilities": kind}
    moved, pairs = np.empty((len(cases), 3)), np.array([c.pair.nu for c in cases])
    for nu in np.unique(pairs):
        rows = np.flatnonzero(pairs == nu)
        given = (*axes[:, rows], LOAD, FRICTION, *motions[:, rows], cases[rows[0]].pair)
        one = fastsim(*given, **choices)
        moved[rows] = np.stack([one.fx, one.fy, one.mz], axis=1)
    return moved / unit


def _arrays(cases: list[Case]) -> tuple[Array, Array]:
    """Semi-axes (2, n) and motions (3, n)."""
    return np.array([(c.a, c.b) for c in cases]).T, np.array([c.motion for c in cases]).T


def _simplified(case: Case) -> Simplified:
    return Simplified(interpenetrating(by_axes(case.a, case.b, case.pair, load=LOAD), case.pair), FRICTION)


def groups(cases: list[Case]) -> Array:
    """Number (n,) of the group of each contact, of which theories err in different ways: by Poisson's ratio, whether
    spin is against the lateral creepage, and whether the ellipse is longer across the rolling direction.
    """
    told = [(c.pair.nu, c.parts[1] * c.parts[2] < 0, c.a < c.b) for c in cases]
    return np.unique(np.array(told, dtype=float), axis=0, return_inverse=True)[1].ravel()


def held(name: str, cases: list[Case], cells: int = CELLS) -> Held:
    """A theory's forces, moments and errors."""
    found, nu = forces(name, cases, cells), np.array([c.pair.nu for c in cases])
    axes, motions = _arrays(cases)
    exact = np.array([(*c.force, c.mz * np.sqrt(c.a * c.b) / max(c.a, c.b)) for c in cases])
    off, share = found - exact, spin_share(axes[0], axes[1], motions, nu)
    return Held(found[:, :2], found[:, 2], np.linalg.norm(off[:, :2], axis=1), np.abs(off[:, 2]), share, groups(cases))


def kept(name: str, one: Held) -> tuple[float, float]:
    """Parts of the contacts whose errors of force and moment lie within what ``models.contact.accuracy`` states."""
    moment = moment_band(name, one.used_with_moment, one.spinning)
    return (
        float(np.mean(one.error <= band(name, one.used, one.spinning))),
        float(np.mean(one.moment_error <= moment + ROUNDING)),
    )


def measured(error: Array, used: Array, one: Held) -> tuple[tuple[float, ...], ...]:
    """Quantiles of the error at each knot, without spin and with it, of the group with the largest."""
    ends = (0.0, *KNOTS, 1.1)
    within = [(used >= low) & (used <= high) for low, high in zip(ends, ends[2:], strict=False)]
    return tuple(
        tuple(_largest(error, rows & some, one.group) for some in within)
        for rows in (one.spinning < 0.5, one.spinning >= 0.5)
    )


def _largest(error: Array, rows: Array, group: Array) -> float:
    """Largest quantile of a group with more than a few contacts; of all together where none has them."""
    parts = [error[rows & (group == value)] for value in np.unique(group)]
    told = [part for part in parts if part.size >= FEW] or [error[rows]]
    return round(max(float(np.quantile(part, NEAR)) for part in told), 4)


def main() -> None:
    """Print both tables."""
    known = read() + read_drawn(FITTED) + read_wide(FITTED)
    theories = {name: held(name, known) for name in (*FASTSIM, "simplified")}
    print("BANDS")
    for name, one in theories.items():
        print(f'    "{name}": {measured(one.error, one.used, one)},')
    print("MOMENT_BANDS")
    for name, one in theories.items():
        print(f'    "{name}": {measured(one.moment_error, one.used_with_moment, one)},')


if __name__ == "__main__":
    main()
