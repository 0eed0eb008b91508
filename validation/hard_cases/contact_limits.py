"""Hard cases of rolling contact at its limits: few cells, mirrored contacts, pure spin, patches that separate, merge or
reach the grid's edge.

No engine takes part: forces are plain functions of the creepages, so each case has one answer for all.
"""

from pathlib import Path

import numpy as np

from models.contact import hertz
from models.contact.fastsim import MarchChoice, RollingEllipse, fastsim
from models.contact.linear_theory import linear_creep_forces
from models.contact.material import MaterialPair
from models.contact.normal_problem import NormalSolution, cell_centres, solve_normal
from validation.hard_cases.case import IMPLEMENTATIONS, HardCase

MATERIAL_PAIR = MaterialPair()
A, B, LOAD, MU = 6e-3, 4e-3, 80e3, 0.3
SMALL_CREEPAGE = 1e-7
CELL, RADIUS, BALL_LOAD = 1.5e-4, 0.3, 1e4
"""Cell size (m), radius (m) of two balls, load (N) on each."""


def _linear_theory_error(cell_count: int, march_name: MarchChoice) -> float:
    """Relative error of FASTSIM's force at a small creepage, with a number of cells along each axis, against the linear
    theory."""
    answer = fastsim(
        RollingEllipse(A, B, LOAD, MU, SMALL_CREEPAGE, 0.0, 0.0), MATERIAL_PAIR, cells=cell_count, march=march_name
    )
    return abs(float(answer.fx / linear_creep_forces(A, B, SMALL_CREEPAGE, 0.0, 0.0, MATERIAL_PAIR)[0]) - 1.0)


def few_cells_error(engine_name: str, work_folder: Path) -> float:
    """Case: small creepage on 8, 16 and 32 cells. Error: largest relative error of the force divided by the bound 1.7
    (8 / cells)^1.9 per cent."""
    return max(_linear_theory_error(n, "second-order") / (0.017 * (8.0 / n) ** 1.9) for n in (8, 16, 32))


def few_cells_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: error on few cells if the first step at the leading edge is a complete
    one."""
    return f"a whole first step makes the force {100 * _linear_theory_error(8, 'plain'):.1f} % too large by 8 cells"


def _draw_creepages(draw_count: int = 400) -> np.ndarray:
    """Random creepages xi_x, xi_y and spin (1/m), shape (3, draw_count), from sticking to full sliding."""
    draw = np.random.default_rng(8)
    return (
        draw.uniform(-1.0, 1.0, (3, draw_count))
        * 10.0 ** draw.uniform(-5.0, -1.0, draw_count)
        * [[1.0], [1.0], [100.0]]
    )


def reversal_error(engine_name: str, work_folder: Path) -> float:
    """Case: all creepages reversed. Error: largest difference between the forces and the reversed forces, divided by mu
    N."""
    creepage_along, across, spin = _draw_creepages()
    ellipses = (RollingEllipse(A, B, LOAD, MU, s * creepage_along, s * across, s * spin) for s in (1.0, -1.0))
    first, second = (fastsim(ellipse, MATERIAL_PAIR) for ellipse in ellipses)
    return float(max(np.abs(first.fx + second.fx).max(), np.abs(first.fy + second.fy).max()) / (MU * LOAD))


def mirror_error(engine_name: str, work_folder: Path) -> float:
    """Case: left and right exchanged, so that lateral creepage, spin and lateral force change sign. Error: largest
    difference of the forces divided by mu N."""
    creepage_along, across, spin = _draw_creepages()
    first, second = (
        fastsim(RollingEllipse(A, B, LOAD, MU, creepage_along, s * across, s * spin), MATERIAL_PAIR)
        for s in (1.0, -1.0)
    )
    return float(max(np.abs(first.fx - second.fx).max(), np.abs(first.fy + second.fy).max()) / (MU * LOAD))


def gained_energy_ratio(engine_name: str, work_folder: Path) -> float:
    """Case: random creepages on 21 cells. Error: largest energy that a contact gains per metre, divided by mu N times
    the creepage."""
    creepage_along, across, spin = _draw_creepages()
    size = MU * LOAD * (np.hypot(creepage_along, across) + A * np.abs(spin))
    lost = fastsim(RollingEllipse(A, B, LOAD, MU, creepage_along, across, spin), MATERIAL_PAIR).dissipation
    return float(max(np.max(-lost / size), 0.0))


def pure_spin_error(engine_name: str, work_folder: Path) -> float:
    """Case: pure spin. Error: the larger of the longitudinal force divided by mu N and, for small spin, the relative
    error of the lateral force against the linear theory."""
    small = fastsim(RollingEllipse(A, B, LOAD, MU, 0.0, 0.0, 1e-6), MATERIAL_PAIR)
    large = fastsim(RollingEllipse(A, B, LOAD, MU, 0.0, 0.0, [0.1, 1.0, 10.0, 1e3]), MATERIAL_PAIR)
    wanted = float(linear_creep_forces(A, B, 0.0, 0.0, 1e-6, MATERIAL_PAIR)[1])
    return max(abs(float(small.fy) / wanted - 1.0), float(np.abs(large.fx).max()) / (MU * LOAD))


def contact_of_two_balls(
    centre_distance: float, contact_load: float, cell_counts: tuple[int, int] = (41, 101)
) -> NormalSolution:
    """Exact normal contact of two balls side by side at a distance (m) between their centres."""
    y, x = (cell_centres(n, CELL) for n in cell_counts)
    away = np.minimum((x - centre_distance / 2) ** 2, (x + centre_distance / 2) ** 2) + y[:, None] ** 2
    return solve_normal(away / (2.0 * RADIUS), CELL, CELL, MATERIAL_PAIR, load=contact_load)


def two_patch_error(engine_name: str, work_folder: Path) -> float:
    """Case: two separate contact patches. Error: the larger of the relative error of a patch's load and of the
    difference of the area from that of single balls beyond the cells along the edges."""
    draw = contact_of_two_balls(9e-3, 2.0 * BALL_LOAD)
    left = float(draw.pressure[:, : draw.x.size // 2].sum() * CELL**2)
    single_contact = hertz.by_load(0.5 / RADIUS, 0.5 / RADIUS, BALL_LOAD, MATERIAL_PAIR)
    edge = CELL * 2.0 * np.pi * float(single_contact.a)
    return max(
        abs(left / BALL_LOAD - 1.0), abs(draw.area / 2.0 - np.pi * float(single_contact.a) ** 2) / edge - 1.0, 0.0
    )


def merging_patch_error(engine_name: str, work_folder: Path) -> float:
    """Case: two balls approach each other in steps of a fifth of a cell. Error: largest second difference of the
    approach, divided by the approach."""
    answer = [
        contact_of_two_balls(ball_distance, 2.0 * BALL_LOAD, (41, 81)).approach
        for ball_distance in np.linspace(4.0e-3, 3.4e-3, 21)
    ]
    return float(np.abs(np.diff(answer, 2)).max() / answer[0])


def load_of_cut_off_patch(engine_name: str, work_folder: Path) -> float:
    """Case: a contact patch that the grid's edge cuts off, which must be refused. Error: the load (N) that is
    returned."""
    return contact_of_two_balls(9e-3, 2.0 * BALL_LOAD, (41, 61)).load


CASES = (
    HardCase(
        "leading edge by few cells",
        "a whole first step is of first order in the cells",
        "linear theory: 1.7 % by 8 cells, of order 1.9 in them",
        "of the error allowed",
        1.0,
        "second order; measured 1.67 % by 8 cells",
        few_cells_error,
        naive_result=few_cells_naive_result,
        is_without_engine=True,
    ),
    HardCase(
        "all creepages turned round",
        "branches of sticking and slipping",
        "the force turned round, bit by bit",
        "mu N",
        0.0,
        "every operation is odd",
        reversal_error,
        is_without_engine=True,
    ),
    HardCase(
        "contact in a mirror",
        "strips are marched from one side to the other",
        "mirrored forces",
        "mu N",
        1e-12,
        "sums in another order",
        mirror_error,
        is_without_engine=True,
    ),
    HardCase(
        "power of a contact",
        "tractions lag behind the slip",
        "never gained, 400 creepages",
        "of mu N creepage",
        1e-5,
        "what 21 cells leave",
        gained_energy_ratio,
        is_without_engine=True,
    ),
    HardCase(
        "nothing but spin",
        "the pole of slip lies inside the patch",
        "no force along; linear theory across",
        "relative",
        4e-3,
        "error of 21 cells",
        pure_spin_error,
        is_without_engine=True,
    ),
    HardCase(
        "two patches under one load",
        "the load is shared, each patch is lost or doubled easily",
        "halves alike, area of a ball alone",
        "relative, beyond a row of cells",
        0.01,
        "one ball deforms the other's ground by 1 %",
        two_patch_error,
        is_without_engine=True,
    ),
    HardCase(
        "patches that merge",
        "the area jumps",
        "second difference of the approach",
        "of the approach",
        1e-3,
        "a twentieth of what merging changes",
        merging_patch_error,
        answer_independence="none",
        is_without_engine=True,
    ),
    HardCase(
        "patch cut off by the grid",
        "the load fits on what is left",
        "refused",
        "N",
        0.0,
        "a part of a contact is none",
        load_of_cut_off_patch,
        dict.fromkeys(IMPLEMENTATIONS, "refused"),
        is_without_engine=True,
    ),
)
