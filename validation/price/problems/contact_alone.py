"""Problem G: creep forces of one contact by every theory, over the cells that it is cut into.

Contacts of the kept set, each of another ellipse, kind and size of creepage. The reference is the exact theory of the
half space with its cells extrapolated to none: another family than all but the exact theory itself, whose own curve
therefore only shows what its cells cost. What is left of its cells is its uncertainty.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from models.advice.price.problem import Setting
from models.contact.theories import beyond_friction
from models.systems.contact.work_precision import THEORIES_COMPARED, TheorySettings, force_of
from validation.contact.contact_set import read_contacts

CONTACT_SPACING = 23
"""Every so many contacts of the set stand for all: they go through its ratios of axes, kinds and sizes of creepage."""
CURVES = {
    "linear theory": ("linear", "theory"),
    "FASTSIM 1982": ("FASTSIM", "of 1982"),
    "FASTSIM, plain march": ("FASTSIM", "plain march"),
    "FASTSIM": ("FASTSIM", "second order"),
    "FASTSIM, three flexibilities": ("FASTSIM", "three flexibilities"),
    "FASTSIM, parabolic": ("FASTSIM", "parabolic bound"),
    "theory of 1983": ("1983", "theory"),
    "exact theory": ("exact", "theory"),
}
"""Family and member of every method."""
_STRIPS, _NET = (5, 7, 11, 15, 21, 41, 81, 161), (7, 11, 15, 21, 31, 45)
CELLS = {"linear theory": (1,), "theory of 1983": _NET, "exact theory": (6, 7, 8, 10, 14, 20)}
"""Cells along each axis of a contact, those of FASTSIM left out."""
DEFAULT_ANSWER = ("FASTSIM", 21)
"""What a scene of a contact is answered by if it does not say."""


@dataclass(frozen=True)
class ContactResult:
    """Forces (n, 2) divided by mu N, counts of work, and a doubt about the result ("" if none)."""

    forces: np.ndarray
    counts: dict[str, int]
    doubt: str


@dataclass(frozen=True)
class ContactSolver:
    """A theory on all contacts, ready to run."""

    run: Callable[[], ContactResult]


class ContactAlone:
    """Test problem: rolling contacts with their exact forces; see ``validation.price.problems.Problem``."""

    key, duration, uncertain_share = "contact", 1.0, 0.25
    note = (
        "Cells are those of the square about the contact; the exact theory solves for all of them together, others "
        "march along strips. Seconds are those of all contacts, one call from Python each."
    )
    reference = "exact theory, cells extrapolated to none"
    tolerances: tuple[float, ...] = (10.0, 5.0, 2.0, 1.0)
    bound = 100.0

    def __init__(self) -> None:
        self._cases = read_contacts()[::CONTACT_SPACING]
        self._ways = {CURVES[theory.name]: theory for theory in THEORIES_COMPARED}
        self._forces = np.array([case.force for case in self._cases])
        self.title = f"Creep forces of {len(self._cases)} contacts by every theory of rolling contact"
        self.units = {"mean creep force": "% of mu N", "creep force in 95 of 100": "% of mu N"}
        left = 100.0 * np.array([case.error for case in self._cases])
        self.uncertainty = dict(zip(self.units, (float(left.mean()), float(left.max())), strict=True))

    def settings(self, quick: bool) -> tuple[Setting, ...]:
        """Every theory with every number of cells."""
        return tuple(
            self.setting(*curve, 1.0 / cells)
            for curve, theory in self._ways.items()
            for cells in CELLS.get(theory.name, _STRIPS)
        )

    def setting(self, engine: str, method: str, inverse_cells: float) -> Setting:
        """A setting of this problem: curve, and 1 / number of cells as its value."""
        cells = round(1.0 / inverse_cells)
        usual = (self._ways[engine, method].name, cells) == DEFAULT_ANSWER
        return Setting(engine, method, 1.0 / cells, 0, default="twinrig" if usual else "", cells=True)

    def build(self, setting: Setting) -> ContactSolver:
        """A solver that computes all contacts by one theory."""
        return ContactSolver(partial(self._run, self._ways[setting.engine, setting.method], round(1.0 / setting.value)))

    def errors(self, solution: ContactResult) -> dict[str, float]:
        """Error over the contacts in % of mu N: the mean, and the one that 95 of 100 contacts do not exceed."""
        contact_errors = 100.0 * np.linalg.norm(solution.forces - self._forces, axis=1)
        return dict(
            zip(self.units, (float(contact_errors.mean()), float(np.quantile(contact_errors, 0.95))), strict=True)
        )

    def _run(self, theory: TheorySettings, cells: int) -> ContactResult:
        forces = np.array([force_of(theory.rolled(case, cells)(case.motion)) / case.limit for case in self._cases])
        linear, number = theory.name == "linear theory", len(self._cases)
        counts = {"contacts": number, "contact cells": number * (1 if linear else cells**2)}
        return ContactResult(forces, counts, beyond_friction(np.linalg.norm(forces, axis=1)) if linear else "")


@cache
def problem(quick: bool) -> ContactAlone:
    """The problem, its reference read once per process."""
    return ContactAlone()
