"""Hard cases of rolling contact: no creepage, tiny creepage, spin against lateral creepage, lift-off, cells that begin
to slip.

No engine takes part: forces are plain functions of the creepages, so each case has one answer for all.
"""

from pathlib import Path

import numpy as np

from models.contact import hertz
from models.contact.fastsim import RollingEllipse, fastsim
from models.contact.fastsim_derivatives import creep_force_derivatives
from models.contact.linear_theory import linear_creep_forces
from models.contact.material import MaterialPair
from validation.hard_cases.case import HardCase

MATERIAL_PAIR = MaterialPair()
A, B, LOAD, MU = 6e-3, 4e-3, 80e3, 0.3


def largest_force_without_creepage(engine_name: str, work_folder: Path) -> float:
    """Case: no creepage. Error: largest creep force (N); infinite if a derivative is not finite."""
    answer = creep_force_derivatives(RollingEllipse(A, B, LOAD, MU, 0.0, 0.0, 0.0), MATERIAL_PAIR)
    return float(np.abs(answer.forces).max() + (0.0 if np.isfinite(answer.slopes).all() else np.inf))


def no_creepage_naive_result(work_folder: Path) -> str:
    """Result without the guard, as text: the weighted flexibility of 1982 without creepage is 0/0."""
    with np.errstate(invalid="ignore"):
        weighted = np.float64(0.0) / np.float64(0.0)
    return f"the weighted flexibility of 1982 is 0/0 there: {weighted}"


def tiny_creepage_error(engine_name: str, work_folder: Path) -> float:
    """Case: creepages from 1e-300 to 1e-12. Error: relative difference of the creep forces from the linear theory."""
    small = 10.0 ** np.arange(-300.0, -11.0, 12.0)
    motion = (small, -0.5 * small, 30.0 * small)
    answer, linear = (
        fastsim(RollingEllipse(A, B, LOAD, MU, *motion), MATERIAL_PAIR),
        linear_creep_forces(A, B, *motion, MATERIAL_PAIR),
    )
    relative_errors = np.hypot(answer.fx / linear[0] - 1.0, (answer.fy - linear[1]) / np.abs(linear[0]))
    return float(np.abs(relative_errors).max())


def opposed_spin_error(engine_name: str, work_folder: Path) -> float:
    """Case: spin against lateral creepage, with its pole anywhere in the ellipse. Error: largest difference between the
    forces with 21 and with 201 cells, divided by mu N."""
    pole = np.linspace(-1.0, 1.0, 41)
    motion = (np.zeros(41), -0.5 * A * pole, np.full(41, 0.5))
    coarse, fine = (fastsim(RollingEllipse(A, B, LOAD, MU, *motion), MATERIAL_PAIR, cells=cells) for cells in (21, 201))
    return float(np.hypot(coarse.fx - fine.fx, coarse.fy - fine.fy).max() / (MU * LOAD))


def opposed_spin_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: the march of 1982 on the same cells."""
    motion = (0.0, -0.25 * A, 0.5)
    plain, fine = (
        fastsim(RollingEllipse(A, B, LOAD, MU, *motion), MATERIAL_PAIR, march="plain"),
        fastsim(RollingEllipse(A, B, LOAD, MU, *motion), MATERIAL_PAIR, cells=201),
    )
    return f"the plain march is {100 * abs(plain.fy - fine.fy) / (MU * LOAD):.1f} % of mu N off on as many cells"


def lift_off_error(engine_name: str, work_folder: Path) -> float:
    """Case: loads from large to zero and negative in full sliding. Error: difference of the force from mu N, or from 0
    without load, divided by the largest mu N."""
    load = np.concatenate((10.0 ** np.arange(-12.0, 5.0), [0.0, -1.0, -1e3]))
    contact = hertz.by_load(1.1, 0.8, load, MATERIAL_PAIR)
    answer = fastsim(RollingEllipse(contact.a, contact.b, load, MU, 0.02, 0.0, 0.0), MATERIAL_PAIR)
    return float(np.abs(answer.fx + MU * np.maximum(load, 0.0)).max() / (MU * load.max()))


def creep_curve_roughness(engine_name: str, work_folder: Path) -> float:
    """Case: a creep curve at 2001 creepages. Error: largest second difference of the force divided by mu N, which is
    small for a smooth curve."""
    creep = np.linspace(0.0, 4e-3, 2001)
    force = fastsim(RollingEllipse(A, B, LOAD, MU, creep, 0.5 * creep, 50.0 * creep), MATERIAL_PAIR).fx / (MU * LOAD)
    return float(np.abs(np.diff(force, 2)).max())


def locked_wheel_excess(engine_name: str, work_folder: Path) -> float:
    """Case: a locked wheel, and a spin of 1000 per metre. Error: amount by which the creep force exceeds mu N, divided
    by mu N."""
    ellipses = RollingEllipse(A, B, LOAD, [1e-6, 0.3, 1.0], [[1.0], [0.0], [-1.0]], [[0.0], [1.0], [1.0]], 1e3)
    answer = fastsim(ellipses, MATERIAL_PAIR)
    return float(np.max(np.hypot(answer.fx, answer.fy) / (np.array([1e-6, 0.3, 1.0]) * LOAD) - 1.0, initial=0.0))


CASES = (
    HardCase(
        "rolling without creepage",
        "the mean flexibility is 0/0",
        "no force, derivatives are numbers",
        "N",
        0.0,
        "exact",
        largest_force_without_creepage,
        naive_result=no_creepage_naive_result,
    ),
    HardCase(
        "creepage of 1e-300",
        "squares underflow",
        "linear theory",
        "of it",
        4e-3,
        "error of 21 cells",
        tiny_creepage_error,
    ),
    HardCase(
        "spin against lateral creepage",
        "forces nearly cancel, tractions turn about a pole",
        "201 cells per strip",
        "mu N",
        4e-3,
        "error of 21 cells",
        opposed_spin_error,
        answer_independence="none",
        naive_result=opposed_spin_naive_result,
    ),
    HardCase(
        "lift-off", "axes and stiffness vanish", "mu N to 1e-12 N, then none", "mu N", 1e-12, "rounding", lift_off_error
    ),
    HardCase(
        "cells that begin to slip",
        "a cell sticks or slips, nothing between",
        "second difference of a creep curve",
        "mu N",
        1e-3,
        "a tenth of a per cent, and the curve itself bends by 1e-5",
        creep_curve_roughness,
        answer_independence="none",
    ),
    HardCase(
        "locked wheel with spin",
        "no cell sticks, directions all differ",
        "|F| <= mu N",
        "mu N",
        1e-12,
        "rounding",
        locked_wheel_excess,
    ),
)
