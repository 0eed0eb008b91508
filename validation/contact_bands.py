"""Bands of error of the simplified theories, from their forces on ``contact_set``.

``python -m validation.contact_bands`` prints what ``models.contact.accuracy`` keeps.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from models.contact.accuracy import KNOTS, band, spin_share
from models.contact.fastsim import fastsim
from models.contact.hertz import by_axes
from models.contact.of_scene import interpenetrating
from models.contact.theories import Simplified
from models.contact.work_precision import Case
from validation.contact_set import FRICTION, LOAD, PAIR, read

CELLS = 101
"""In each strip of FASTSIM: its own error is then below 0.05 % of mu N."""
SHARE, NEAR = 0.95, 0.96
"""Part of the contacts that a band is to hold; of those between the neighbours of each knot."""
FASTSIM = [f"{kind} {bound}" for kind in ("blended", "one", "three")
           for bound in ("intermediate", "parabolic", "elliptic")]  # fmt: skip


@dataclass(frozen=True)
class Held:
    """A theory against the exact one; all by mu N. force : (n, 2). error : (n,). spinning : (n,) share of spin."""

    force: np.ndarray
    error: np.ndarray
    spinning: np.ndarray

    @property
    def used(self) -> np.ndarray:
        """Size of the force, (n,)."""
        return np.linalg.norm(self.force, axis=1)


def forces(name: str, cases: list[Case], cells: int) -> np.ndarray:
    """Force (n, 2) by mu N of a theory, one of those in FASTSIM or "simplified"."""
    if name == "simplified":
        found = [_simplified(c).roll(c.motion, cells).force for c in cases]
        return np.array(found) / (FRICTION * LOAD)
    axes, motions = _arrays(cases)
    kind, bound = name.split()
    choices: dict[str, Any] = {"cells": cells, "bound": bound, "flexibilities": kind}
    one = fastsim(axes[0], axes[1], LOAD, FRICTION, motions[0], motions[1], motions[2], PAIR, **choices)
    return np.stack([one.fx, one.fy], axis=1) / (FRICTION * LOAD)


def _arrays(cases: list[Case]) -> tuple[np.ndarray, np.ndarray]:
    """Semi-axes (2, n) and motions (3, n)."""
    return np.array([(c.a, c.b) for c in cases]).T, np.array([c.motion for c in cases]).T


def _simplified(case: Case) -> Simplified:
    return Simplified(interpenetrating(by_axes(case.a, case.b, PAIR, load=LOAD), PAIR), FRICTION)


def held(name: str, cases: list[Case], cells: int = CELLS) -> Held:
    """A theory's forces and errors."""
    force = forces(name, cases, cells)
    exact = np.array([c.force for c in cases])
    axes, motions = _arrays(cases)
    return Held(force, np.linalg.norm(force - exact, axis=1), spin_share(axes[0], axes[1], motions, PAIR.nu))


def kept(name: str, one: Held) -> float:
    """Part of the contacts whose error lies within the band that ``models.contact.accuracy`` states."""
    return float(np.mean(one.error <= band(name, one.used, one.spinning)))


def measured(one: Held) -> tuple[tuple[float, ...], ...]:
    """Quantiles of the error at each knot, without spin and with it; a knot that no contact is near has the largest."""
    found, ends = [], (0.0, *KNOTS, 1.1)
    for rows in (one.spinning < 0.5, one.spinning >= 0.5):
        within = [rows & (one.used >= low) & (one.used <= high) for low, high in zip(ends, ends[2:], strict=False)]
        whole = float(np.quantile(one.error[rows], NEAR))
        found.append(tuple(round(float(np.quantile(one.error[some], NEAR)) if some.sum() > 3 else whole, 4)
                           for some in within))  # fmt: skip
    return tuple(found)


if __name__ == "__main__":
    for theory in (*FASTSIM, "simplified"):
        print(f'    "{theory}": {measured(held(theory, read()))},')
