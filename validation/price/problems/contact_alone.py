"""Test problem: creep forces of single contacts by every theory of rolling contact, over the number of cells.

Contacts of the saved set differ in ellipse, kind and size of creepage. The reference is the exact theory of the half
space, extrapolated to infinitely small cells. It is independent of all other theories; the curve of the exact theory
itself only shows the error of its cells. The uncertainty is the error left after the extrapolation.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from models.advice.price.problem import Setting
from models.contact.theories import friction_warning
from models.systems.contact.work_precision import THEORIES_COMPARED, TheorySettings, tangential_force_of
from validation.contact.contact_set import read_contacts

CONTACT_SPACING = 23
"""Every 23rd contact of the saved set is used: these go through its ratios of axes, kinds and sizes of creepage."""
CURVE_OF_THEORY = {
    "linear theory": ("linear", "theory"),
    "FASTSIM 1982": ("FASTSIM", "of 1982"),
    "FASTSIM, plain march": ("FASTSIM", "plain march"),
    "FASTSIM": ("FASTSIM", "second order"),
    "FASTSIM, three flexibilities": ("FASTSIM", "three flexibilities"),
    "FASTSIM, parabolic": ("FASTSIM", "parabolic bound"),
    "theory of 1983": ("1983", "theory"),
    "exact theory": ("exact", "theory"),
}
"""Family and member, (engine, method) of a curve, for the name of every theory."""
_STRIP_CELLS, _SQUARE_CELLS = (5, 7, 11, 15, 21, 41, 81, 161), (7, 11, 15, 21, 31, 45)
CELLS_OF_THEORY = {"linear theory": (1,), "theory of 1983": _SQUARE_CELLS, "exact theory": (6, 7, 8, 10, 14, 20)}
"""Numbers of cells along each axis of a contact, by theory; theories that are not named have those of _STRIP_CELLS."""
DEFAULT_THEORY_AND_CELLS = ("FASTSIM", 21)
"""Default of a contact scene: theory, and number of cells along each axis."""


@dataclass(frozen=True)
class ContactResult:
    """Creep forces (n, 2) of n contacts divided by mu N, counts of work, and a doubt about the result ("" if none)."""

    forces: np.ndarray
    counts: dict[str, int]
    doubt: str


@dataclass(frozen=True)
class ContactSolver:
    """Computation of all contacts by one theory, ready to run."""

    run: Callable[[], ContactResult]


class ContactAlone:
    """Test problem: rolling contacts with their exact forces; a
    ``models.advice.price.problem.WorkPrecisionProblem``.
    """

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
        self._ways = {CURVE_OF_THEORY[theory.name]: theory for theory in THEORIES_COMPARED}
        self._forces = np.array([case.force for case in self._cases])
        self.title = f"Creep forces of {len(self._cases)} contacts by every theory of rolling contact"
        self.units = {"mean creep force": "% of mu N", "creep force in 95 of 100": "% of mu N"}
        left = 100.0 * np.array([case.error for case in self._cases])
        self.uncertainty = dict(zip(self.units, (float(left.mean()), float(left.max())), strict=True))

    def settings(self, quick: bool) -> tuple[Setting, ...]:
        """Settings of every theory with every number of cells."""
        return tuple(
            self.setting(*curve, 1.0 / cells)
            for curve, theory in self._ways.items()
            for cells in CELLS_OF_THEORY.get(theory.name, _STRIP_CELLS)
        )

    def setting(self, engine: str, method: str, inverse_cells: float) -> Setting:
        """Setting of a theory (``engine``: its family, ``method``: its member), with 1 / number of cells as its
        value."""
        cells = round(1.0 / inverse_cells)
        usual = (self._ways[engine, method].name, cells) == DEFAULT_THEORY_AND_CELLS
        return Setting(engine, method, 1.0 / cells, 0, default="twinrig" if usual else "", cells=True)

    def build(self, setting: Setting) -> ContactSolver:
        """The computation of all contacts by the theory and cells of a setting, ready to run."""
        return ContactSolver(partial(self._run, self._ways[setting.engine, setting.method], round(1.0 / setting.value)))

    def errors(self, solution: ContactResult) -> dict[str, float]:
        """Errors of the creep forces in % of mu N: mean over the contacts, and the error that 95 % of them do not
        exceed."""
        contact_errors = 100.0 * np.linalg.norm(solution.forces - self._forces, axis=1)
        return dict(
            zip(self.units, (float(contact_errors.mean()), float(np.quantile(contact_errors, 0.95))), strict=True)
        )

    def _run(self, contact_theory: TheorySettings, cell_count: int) -> ContactResult:
        forces = np.array(
            [
                tangential_force_of(contact_theory.rolled(case, cell_count)(case.motion)) / case.friction_limit
                for case in self._cases
            ]
        )
        linear, number = contact_theory.name == "linear theory", len(self._cases)
        counts = {"contacts": number, "contact cells": number * (1 if linear else cell_count**2)}
        return ContactResult(forces, counts, friction_warning(np.linalg.norm(forces, axis=1)) if linear else "")


@cache
def problem(is_quick: bool) -> ContactAlone:
    """The test problem of rolling contacts; its reference forces are read once per process."""
    return ContactAlone()
