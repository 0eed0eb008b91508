"""A set of Hertzian contacts with forces by the exact theory, against which every faster theory is measured.

Five ellipses, nine kinds of creepage and eight sizes of it. Forces are kept as shares of mu N and of mu N sqrt(ab), so
that they hold for every load, size and friction of the same ellipse and Poisson's ratio. ``contact_set.csv`` holds
them: ``python -m validation.contact_set`` computes it anew in ten minutes, and every report does so for a few of its
rows.
"""

import csv
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np

from models.contact.hertz_cells import hertzian
from models.contact.linear_theory import coefficients
from models.contact.material import Pair
from models.contact.rolling_problem import solve_rolling

RATIOS = (0.2, 0.5, 1.0, 2.0, 5.0)
KINDS = {"x": (1, 0, 0), "y": (0, 1, 0), "spin": (0, 0, 1), "x+y": (1, 1, 0), "x+spin": (1, 0, 1), "y+spin": (0, 1, 1),
         "y-spin": (0, 1, -1), "x+y+spin": (1, 1, 1), "x-y+spin": (1, -1, 1)}  # fmt: skip
"""Parts of the three creepages, each in units of its linear scale."""
LEVELS = (0.05, 0.2, 0.5, 0.8, 1.2, 2.0, 4.0, 10.0)
"""Sizes of the creepage: at 1 the linear theory of a single creepage reaches mu N."""
FINEST, ENOUGH = (40, 80), 0.005
"""Cells along each axis of the finest grid, halved once for the forces and twice for their error; the next grid is
taken where that error, by mu N, is larger."""
SIZE, LOAD, FRICTION, PAIR = 5e-3, 8e4, 0.3, Pair()
"""sqrt(ab) in m, N, coefficient of friction and materials with which the set is computed."""
FILE = Path(__file__).with_suffix(".csv")


@dataclass(frozen=True)
class Case:
    """One contact. fx, fy by mu N; mz by mu N sqrt(ab); error: what the grid leaves uncertain, by mu N."""

    ratio: float
    kind: str
    level: float
    fx: float = np.nan
    fy: float = np.nan
    mz: float = np.nan
    error: float = np.nan

    @property
    def axes(self) -> tuple[float, float]:
        """a and b (m)."""
        return SIZE * self.ratio**0.5, SIZE / self.ratio**0.5

    @property
    def creepage(self) -> tuple[float, float, float]:
        """xi_x, xi_y and spin (1/m)."""
        c = coefficients(self.ratio, PAIR.nu)
        parts = np.array(KINDS[self.kind], float)
        unit = FRICTION * LOAD / (PAIR.G * SIZE**2) * np.array([1 / c.c11, 1 / c.c22, 1 / (SIZE * c.c23)])
        return tuple(float(v) for v in self.level * unit * parts / np.linalg.norm(parts))  # type: ignore[return-value]


def cases() -> list[Case]:
    """All contacts of the set, without their forces."""
    return [Case(*one) for one in product(RATIOS, KINDS, LEVELS)]


def read() -> list[Case]:
    """All contacts of the set with their forces."""
    with FILE.open(newline="") as file:
        return [Case(float(row["ratio"]), row["kind"], *(float(row[key]) for key in COLUMNS[2:]))
                for row in csv.DictReader(file)]  # fmt: skip


COLUMNS = ("ratio", "kind", "level", "fx", "fy", "mz", "error")


def on_grid(case: Case, cells: int) -> np.ndarray:
    """fx, fy, mz of the exact theory on one grid, as shares."""
    found = solve_rolling(hertzian(*case.axes, LOAD, cells), FRICTION, *case.creepage, PAIR)
    return np.array([found.fx, found.fy, found.mz / SIZE]) / (FRICTION * LOAD)


def exact(case: Case, finest: tuple[int, ...] = FINEST) -> Case:
    """The case with its forces: the error of the grid is of first order in the size of a cell, and taken out."""
    for fine in finest:
        grids = [on_grid(case, cells) for cells in (fine // 4, fine // 2, fine)]
        found, before = 2 * grids[2] - grids[1], 2 * grids[1] - grids[0]
        error = float(np.hypot(*(found - before)[:2]))
        if error < ENOUGH:
            break
    return replace(case, fx=float(found[0]), fy=float(found[1]), mz=float(found[2]), error=error)


def write() -> None:
    """Compute the whole set."""
    with FILE.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for case in cases():
            found = exact(case)
            writer.writerow([found.ratio, found.kind, found.level,
                             *(f"{value:.6f}" for value in (found.fx, found.fy, found.mz, found.error))])  # fmt: skip
            file.flush()


if __name__ == "__main__":
    write()
