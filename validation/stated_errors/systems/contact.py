"""Stated errors of random contacts; the true solution has ten times as many cells along each axis.

The work is counted in cells; in the exact theory every cell acts on every other cell.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from models.contact.accuracy import coarser_cells
from models.contact.theories import RollingContact
from models.core.discretisation import error_estimates_of, finite_rms
from models.systems.contact.run import ERROR_ORDER_OF_CELLS, run
from models.systems.contact.scene import ContactScene, build
from validation.stated_errors.sample import Sample, random_samples

FINER_CELLS, MOST_CELLS, MOST_CELLS_OF_EXACT_THEORY = 10, 400, 60
"""Ratio of the true solution's number of cells along each axis to the run's; largest number, and for the exact
theory."""
THEORIES = ("fastsim", "fastsim", "fastsim", "simplified", "exact")
LEAST_CELLS, LARGEST_CELLS = 5, {"fastsim": 50, "simplified": 40, "exact": 14}
"""Least and largest number of cells along each axis of a random contact."""


def samples(sample_count: int, seed: int) -> Iterator[Sample]:
    """Yield ``sample_count`` samples from random contact scenes; scenes that are refused are replaced."""
    return random_samples(sample_count, seed, lambda random: _sample_of_contact(_random_scene(random)))


def _random_scene(generator: np.random.Generator) -> ContactScene:
    theory = str(generator.choice(THEORIES))
    method: dict[str, Any] = {"name": theory, "cells": int(generator.integers(LEAST_CELLS, LARGEST_CELLS[theory]))}
    if theory == "fastsim":
        method["march"] = str(generator.choice(["second-order", "second-order", "plain"]))
        method["bound"] = str(generator.choice(["intermediate", "parabolic", "elliptic"]))
        method["flexibilities"] = str(generator.choice(["blended", "one", "three"]))
    spins = {"xi_x": 3e-3, "xi_y": 3e-3, "spin": 0.8}
    creepage = {name: float(size * generator.normal()) for name, size in spins.items() if generator.random() < 0.7}
    table: dict[str, Any] = {
        "title": "a random contact",
        "system": "contact",
        "curvatures": {
            "A": float(10.0 ** generator.uniform(-0.4, 0.8)),
            "B": float(10.0 ** generator.uniform(-0.4, 1.0)),
        },
        "contact": {"load": float(10.0 ** generator.uniform(4.0, 5.2)), "friction": float(generator.uniform(0.1, 0.6))},
        "creepage": creepage or {"xi_x": 1e-3},
        "method": method,
    }
    if generator.random() < 0.4 and theory != "exact":
        swept = str(generator.choice([*spins]))
        table["creepage"].pop(swept, None)
        table["sweep"] = {"of": swept, "start": 0.0, "stop": 2.0 * spins[swept], "count": 9}
    return build(table)


def _sample_of_contact(scene: ContactScene) -> Sample:
    run_ = run(scene, error=True)
    body, motions, cells = run_.detail.contact, run_.detail.motions, scene.method.cells
    most_cells = MOST_CELLS_OF_EXACT_THEORY if scene.method.name == "exact" else MOST_CELLS
    truth = np.array([_forces_of_motion(body, motion, min(FINER_CELLS * cells, most_cells)) for motion in motions])
    gap = np.column_stack([run_["fx"], run_["fy"], run_["mz"]]) - truth
    true = {"force": finite_rms(np.hypot(gap[:, 0], gap[:, 1])), "mz": finite_rms(gap[:, 2])}
    power = ERROR_ORDER_OF_CELLS[scene.method.name] or 0
    name = f"{scene.method.name} on {cells} cells, {len(motions)} motions"
    calls = len(motions) * float(cells) ** power
    return Sample(name, "", error_estimates_of(run_), true, calls, calls * (coarser_cells(cells) / cells) ** power)


def _forces_of_motion(
    rolling_contact: RollingContact, creepages_and_spin: tuple[float, float, float], cell_count: int
) -> tuple[float, float, float]:
    forces = rolling_contact.roll(creepages_and_spin, cell_count)
    return forces.fx, forces.fy, forces.mz
