"""Work and precision of the theories of rolling contact: error, computing time and cells of each theory on many cases.

Each case is an ellipse with one of nine combinations of creepages. Sizes of creepage go from a twentieth to ten times
the creepage at which the linear theory reaches mu N.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product
from operator import attrgetter
from typing import Any

import numpy as np

from models.contact.fastsim import FastsimEllipse
from models.contact.hertz import by_axes
from models.contact.inputs import Array
from models.contact.linear_theory import kalker_coefficients
from models.contact.material import MaterialPair
from models.contact.theories import (
    CreepagesAndSpin,
    ExactTheoryOnEllipse,
    LinearTheory,
    RollingOnEllipse,
    SimplifiedTheory,
)
from models.core.assumptions import with_assumptions
from models.core.discretisation import finite_rms, grid_error, with_stated_errors
from models.core.errors import RunFailed
from models.core.result import Channel, Result, result
from models.machine.seconds import seconds_text
from models.systems.contact.assumptions import pressing_assumptions
from models.systems.contact.run import Progress, hertzian_contact, inputs_of_scene_contact, interpenetration_contact
from models.systems.contact.scene import ContactScene
from models.systems.contact.stated_error import LARGEST_CELL_COUNT

CreepageParts = tuple[float, float, float]
CREEPAGE_KINDS: dict[str, CreepageParts] = {
    "x": (1, 0, 0),
    "y": (0, 1, 0),
    "spin": (0, 0, 1),
    "x+y": (1, 1, 0),
    "x+spin": (1, 0, 1),
    "y+spin": (0, 1, 1),
    "y-spin": (0, 1, -1),
    "x+y+spin": (1, 1, 1),
    "x-y+spin": (1, -1, 1),
}
"""Combinations of xi_x, xi_y and spin, each in units of the value at which the linear theory reaches mu N."""
EXACT_GRID_CELLS, GRID_ERROR_LIMIT = (40, 80), 0.005
"""Cells along each axis of the exact theory, halved once for the forces and twice for their error. The finer grid is
used where the error on the coarser grid, divided by mu N, is above GRID_ERROR_LIMIT."""
ForcesOfMotion = Callable[[CreepagesAndSpin], Any]


@dataclass(frozen=True)
class ContactCase:
    """A rolling contact with semi-axes a and b (m), and its exact forces: fx, fy divided by mu N; mz divided by mu N
    sqrt(ab); error of the exact theory's grid, divided by mu N.

    parts : xi_x, xi_y and spin, each in units of its linear scale; only their ratios count. level : size of the
    creepage; at 1 a single creepage reaches mu N by the linear theory.
    """

    a: float
    b: float
    load: float
    friction: float
    pair: MaterialPair
    kind: str
    parts: CreepageParts
    level: float
    fx: float = np.nan
    fy: float = np.nan
    mz: float = np.nan
    error: float = np.nan

    @property
    def friction_limit(self) -> float:
        """Largest tangential force (N): coefficient of friction times load."""
        return self.friction * self.load

    @property
    def motion(self) -> CreepagesAndSpin:
        """Creepages xi_x, xi_y and spin (1/m) of the case. At ``level`` 1 a single creepage reaches mu N by the linear
        theory.
        """
        c, size = kalker_coefficients(self.a / self.b, self.pair.nu), np.sqrt(self.a * self.b)
        parts = np.array(self.parts)
        unit = self.friction_limit / (self.pair.G * size**2) * np.array([1 / c.c11, 1 / c.c22, 1 / (size * c.c23)])
        return tuple(float(v) for v in self.level * unit * parts / np.linalg.norm(parts))  # type: ignore[return-value]

    @property
    def force(self) -> Array:
        """Exact tangential force (2,), fx and fy, divided by mu N."""
        return np.array([self.fx, self.fy])

    def contact(self, theory_class: Callable[..., RollingOnEllipse], **theory_choices: Any) -> RollingOnEllipse:
        """Returns the case's contact as an object of ``theory_class``, a theory of elliptic contacts."""
        return theory_class(
            by_axes(self.a, self.b, self.pair, load=self.load), self.friction, self.pair, **theory_choices
        )


def with_exact_forces(contact_case: ContactCase, finest_cell_counts: tuple[int, ...] = EXACT_GRID_CELLS) -> ContactCase:
    """Returns the case with its exact forces, extrapolated to vanishing cells, and with the error that remains.

    Raises RunFailed where the exact theory is not solved even on the coarsest grids.
    """
    contact = contact_case.contact(ExactTheoryOnEllipse)
    scale = contact_case.friction_limit * np.array([1.0, 1.0, np.sqrt(contact_case.a * contact_case.b)])
    best, error = np.full(3, np.nan), np.inf
    for fine in finest_cell_counts:
        try:
            rolled = [contact.roll(contact_case.motion, cells) for cells in (fine // 4, fine // 2, fine)]
        except RunFailed:
            if fine == finest_cell_counts[0]:
                raise
            break
        best, error = extrapolated_to_vanishing_cells(
            [np.array([rolling.fx, rolling.fy, rolling.mz]) / scale for rolling in rolled]
        )
        if error < GRID_ERROR_LIMIT:
            break
    return replace(contact_case, fx=float(best[0]), fy=float(best[1]), mz=float(best[2]), error=error)


def extrapolated_to_vanishing_cells(forces_by_grid: list[Array]) -> tuple[Array, float]:
    """Returns fx, fy and mz (3,) extrapolated to vanishing cells, and the error of fx and fy. ``forces_by_grid`` : fx,
    fy and mz on three grids, each with cells half as long as the grid before.

    The error of the cells is of first order where much sticks and of second where all slips. The order is chosen with
    which the extrapolations from the two coarser and the two finer grids agree best; their difference is the error.
    """
    coarse, middle, fine = forces_by_grid
    extrapolations = [
        (fine + (fine - middle) / divisor, middle + (middle - coarse) / divisor) for divisor in (1.0, 3.0)
    ]
    finest, finest_before = min(
        extrapolations, key=lambda finer_pair: float(np.hypot(*(finer_pair[0] - finer_pair[1])[:2]))
    )
    return finest, float(np.hypot(*(finest - finest_before)[:2]))


@dataclass(frozen=True)
class TheorySettings:
    """A contact theory with its options. cells : numbers of cells to compare; ``rolled(case, cells)`` computes all that
    does not depend on the creepage, and returns a function from creepages to forces.
    """

    name: str
    cells: tuple[int, ...]
    rolled: Callable[[ContactCase, int], ForcesOfMotion]


def _fastsim(**fastsim_choices: Any) -> Callable[[ContactCase, int], ForcesOfMotion]:
    """Returns a function that makes, for a case and a number of cells, the function of the creepages by FASTSIM."""

    def rolled(contact_case: ContactCase, cell_count: int) -> ForcesOfMotion:
        ellipse = FastsimEllipse(
            contact_case.a / contact_case.b, contact_case.pair, cells=cell_count, **fastsim_choices
        )
        return lambda motion: ellipse(contact_case.a, contact_case.load, contact_case.friction, *motion)

    return rolled


def _simplified(contact_case: ContactCase, cell_count: int) -> ForcesOfMotion:
    """Returns the function of the creepages that computes the forces of a case by the simplified theory."""
    pressed = interpenetration_contact(
        by_axes(contact_case.a, contact_case.b, contact_case.pair, load=contact_case.load), contact_case.pair
    )
    contact = SimplifiedTheory(pressed, contact_case.friction)
    return lambda motion: contact.roll(motion, cell_count)


def _rolled_by_theory(theory_class: Callable[..., RollingOnEllipse]) -> Callable[[ContactCase, int], ForcesOfMotion]:
    """Returns a function that makes, for a case and a number of cells, the function of the creepages by a theory."""

    def rolled(contact_case: ContactCase, cell_count: int) -> ForcesOfMotion:
        contact = contact_case.contact(theory_class)
        return lambda motion: contact.roll(motion, cell_count)

    return rolled


SECOND_ORDER_CELLS, PLAIN_MARCH_CELLS, SIMPLIFIED_CELLS, EXACT_CELLS = (
    (7, 11, 15, 21, 41),
    (7, 11, 21, 41, 81),
    (11, 21, 45),
    (10, 20, 40),
)
"""Cells along each axis: of FASTSIM's second-order march, of its plain march, of the theory of 1983, of the exact
theory.
"""
THEORIES_COMPARED = (
    TheorySettings("linear theory", (1,), _rolled_by_theory(LinearTheory)),
    TheorySettings("FASTSIM 1982", PLAIN_MARCH_CELLS, _fastsim(march="plain", flexibilities="one", bound="parabolic")),
    TheorySettings("FASTSIM, plain march", PLAIN_MARCH_CELLS, _fastsim(march="plain")),
    TheorySettings("FASTSIM", SECOND_ORDER_CELLS, _fastsim()),
    TheorySettings("FASTSIM, three flexibilities", SECOND_ORDER_CELLS, _fastsim(flexibilities="three")),
    TheorySettings("FASTSIM, parabolic", SECOND_ORDER_CELLS, _fastsim(bound="parabolic")),
    TheorySettings("theory of 1983", SIMPLIFIED_CELLS, _simplified),
    TheorySettings("exact theory", EXACT_CELLS, _rolled_by_theory(ExactTheoryOnEllipse)),
)


@dataclass(frozen=True)
class TheoryPoint:
    """Accuracy and time of a theory on a number of cells. errors (cases,) : force errors divided by mu N; seconds :
    time of an evaluation, median over the cases; range : least and largest time of a case (s).
    """

    name: str
    cells: int
    errors: tuple[float, ...]
    seconds: float
    range: tuple[float, float]

    @property
    def mean(self) -> float:
        """Mean force error over the cases, divided by mu N."""
        return float(np.mean(self.errors))

    @property
    def quantile_95(self) -> float:
        """Force error divided by mu N that 95 of 100 cases do not exceed."""
        return float(np.quantile(self.errors, 0.95))


def measure_theory(
    theory_settings: TheorySettings, cell_count: int, contact_cases: list[ContactCase], repeat_count: int = 3
) -> TheoryPoint:
    """Measure force errors and evaluation time of a theory over all cases. The time is the median of ``repeat_count``
    in each case, then the median over the cases.
    """
    errors, seconds = [], []
    for case in contact_cases:
        answer, seconds_taken = _forces_and_seconds(theory_settings.rolled(case, cell_count), case.motion, repeat_count)
        errors.append(float(np.linalg.norm(tangential_force_of(answer) / case.friction_limit - case.force)))
        seconds.append(seconds_taken)
    return TheoryPoint(
        theory_settings.name, cell_count, tuple(errors), float(np.median(seconds)), (min(seconds), max(seconds))
    )


def tangential_force_of(computed_forces: Any) -> Array:
    """Tangential force (2,) in N from what a theory returns: a tuple of forces and moment, or an object with
    ``force``.
    """
    return np.array(computed_forces[:2]) if isinstance(computed_forces, tuple) else computed_forces.force


LEAST_TIMED_SECONDS = 2e-5
"""Least time (s) over which an evaluation is repeated to measure its time."""


def _forces_and_seconds(
    forces_of_motion: ForcesOfMotion, motion: CreepagesAndSpin, repeat_count: int
) -> tuple[Any, float]:
    """Forces of a motion, and median time (s) of one evaluation over the repeats."""
    start = time.perf_counter()
    answer = forces_of_motion(motion)
    count = max(1, int(LEAST_TIMED_SECONDS / max(time.perf_counter() - start, 1e-7)))
    seconds_taken = []
    for _ in range(repeat_count if count > 1 else 1):
        start = time.perf_counter()
        for _ in range(count):
            answer = forces_of_motion(motion)
        seconds_taken.append((time.perf_counter() - start) / count)
    return answer, float(np.median(seconds_taken))


def fastest_point(
    theory_points: list[TheoryPoint], target_error: float, error_of_point: Callable[[TheoryPoint], float]
) -> TheoryPoint | None:
    """Returns the fastest theory, with its number of cells, whose error is at most ``target_error``; None if no error
    is so small.
    """
    meets = [point for point in theory_points if error_of_point(point) <= target_error]
    return min(meets, key=lambda point: point.seconds, default=None)


def ellipse_cases(
    a: float,
    b: float,
    load: float,
    friction: float,
    material_pair: MaterialPair,
    creepage_levels: tuple[float, ...],
    creepage_kinds: dict[str, CreepageParts] = CREEPAGE_KINDS,
) -> list[ContactCase]:
    """Returns a case for every kind and size of creepage on an ellipse with semi-axes a and b (m), without exact forces
    yet.
    """
    return [
        ContactCase(a, b, load, friction, material_pair, kind, parts, level)
        for (kind, parts), level in product(creepage_kinds.items(), creepage_levels)
    ]


def priced_theories(scene: ContactScene, creepage_levels: tuple[float, ...], report_progress: Progress) -> Result:
    """Measure errors and times of every theory on every number of cells, on the scene's ellipse; the result's detail is
    the list of ``TheoryPoint``.

    creepage_levels : sizes of the creepage; at 1 the linear theory reaches mu N.
    """
    hertz, built = hertzian_contact(scene), inputs_of_scene_contact(scene)
    cases = ellipse_cases(
        float(hertz.a), float(hertz.b), float(hertz.load), built.friction, built.pair, creepage_levels
    )
    known, points = list[ContactCase](), list[TheoryPoint]()
    for i, case in enumerate(cases):
        report_progress("exact theory", 0.5 * i / len(cases))
        known.append(with_exact_forces(case))
    for i, theory in enumerate(THEORIES_COMPARED):
        report_progress(theory.name, 0.5 + 0.5 * i / len(THEORIES_COMPARED))
        points += [measure_theory(theory, cells, known) for cells in theory.cells]
    channels = {
        "theory": Channel("point", [point.name for point in points], "", "theory, with its choices"),
        "cells": Channel("point", [point.cells for point in points], "", "cells along each axis"),
        "error": Channel(("point", "contact"), [point.errors for point in points], "mu N", "of the tangential force"),
        "seconds": Channel("point", [point.seconds for point in points], "s", "of an evaluation, median of contacts"),
        "uncertainty": Channel("contact", [case.error for case in known], "mu N", "of the exact force"),
    }
    price = result(scene, channels, {}, a=float(hertz.a), b=float(hertz.b), detail=points)
    with_assumptions(price, pressing_assumptions(scene, cases[0].contact(ExactTheoryOnEllipse)))
    left = grid_error(finite_rms(price["uncertainty"]), 1.0, "mu N", max(EXACT_GRID_CELLS), 1.0, LARGEST_CELL_COUNT)
    return with_stated_errors(price, {"exact force": left}, "three grids of the exact theory")


ERROR_TARGETS = (0.05, 0.02, 0.01, 0.005)
"""Target errors of the force, divided by mu N, for which the cheapest theory is listed."""


def cheapest_lines(theory_points: list[TheoryPoint]) -> list[tuple[str, ...]]:
    """Table rows for every target error: the fastest theory whose mean error meets the target, and the fastest whose
    error meets it in 95 of 100 cases.
    """
    errors = attrgetter("mean"), attrgetter("quantile_95")
    return [
        (f"{100 * target:g} %", *(_point_text(fastest_point(theory_points, target, error), error) for error in errors))
        for target in ERROR_TARGETS
    ]


def _point_text(theory_point: TheoryPoint | None, error_of_point: Callable[[TheoryPoint], float]) -> str:
    if theory_point is None:
        return "none"
    seconds = seconds_text((theory_point.seconds, *theory_point.range))
    return f"{theory_point.name}, {theory_point.cells} cells: {seconds} ({100 * error_of_point(theory_point):.2g} %)"
