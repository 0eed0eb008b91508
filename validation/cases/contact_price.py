"""Stated errors of creep forces: whether they hold, and the time to compute a table of contacts.

What accuracy costs in rolling contact stands among the problems of ``price``.
"""

import time
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from models.contact.accuracy import BEST_FASTSIM_CHOICES, remaining_errors, rolled_with_errors
from models.contact.theories import FastsimTheory
from models.machine.timing import paired_ratio
from models.systems.contact.cases_table import solve_table
from models.systems.contact.run import Built
from models.systems.contact.scene import ContactMethod
from models.systems.contact.work_precision import ContactCase, with_exact_forces
from validation.common.rows import Observed, Row, System, Table
from validation.contact.contact_bands import (
    BAND_SHARE,
    FASTSIM_BANDS,
    MOMENT_ROUNDING,
    shares_within_bands,
    theory_errors,
)
from validation.contact.contact_set import (
    AXIS_RATIOS,
    JUDGED_PART,
    MATERIAL_PAIR,
    POISSON,
    read_contacts,
    read_drawn,
    read_wide,
)
from validation.contact.programs import compare_programs, table

TITLE = "Stated errors of rolling contact"
SYSTEM: System = "contact"
RECOMPUTED_CASES = (
    (1.0, "x", 0.5),
    (1.0, "spin", 1.2),
    (0.5, "x+y", 0.8),
    (2.0, "y+spin", 0.8),
    (5.0, "x-y+spin", 0.5),
    (0.2, "y-spin", 1.2),
)
"""Axis ratio, kind and size of creepage of the stored contacts whose exact forces are computed anew; a quick run takes
the first two on coarser grids."""
CELL_COUNTS = (7, 11, 21, 41)
"""Cells per strip at which the stated discretisation errors are judged; a quick run takes 21 alone."""
JUDGED_FASTSIM_OPTIONS: tuple[dict[str, str], ...] = (
    {},
    {"bound": "elliptic"},
    {"march": "plain"},
    {"flexibilities": "one"},
)
"""Options of FASTSIM, changed from the best ones, whose stated discretisation errors are judged; a quick run takes the
first alone."""
REFERENCE_TOLERANCES = {True: 0.01, False: 0.005}
"""Error of the exact theory, divided by mu N, on the grids of a quick run (True) and of a full run (False)."""
LARGEST_MISSED_SHARE = 0.06
"""Largest share of contacts whose error may exceed the stated one: the 5 % for which the band is made, and a contact or
two."""
MOMENT_TOLERANCES = {"intermediate": (0.024, 0.06), "elliptic": (0.013, 0.045)}
"""Bounds of the moment's error divided by mu N sqrt(ab), by the traction bound of FASTSIM: of its mean, and of its 95 %
quantile."""
CONVERGED_CELL_COUNT = 161
"""Cells per strip whose result counts as exact when fewer cells are judged."""
SLENDER_CONTACT_REASON = (
    "reached for a/b 0.2 to 5 at every Poisson's ratio, not beyond: by mu N and the longer semi-axis the error "
    "is alike on slender ellipses, and that semi-axis is up to 3.2 sqrt(ab)"
)
"""Reason why the moments of slender contacts by the elliptic traction bound miss their tolerance."""
LONG_TABLE_ROW_COUNT, SEED = 100_000, 41


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows on whether the stated errors hold; a full run also compares Kalker's two programs, and times a long table of
    contacts."""
    cases = read_contacts()
    wide = read_wide(JUDGED_PART)
    rows = _stored_forces_rows(cases, quick) + _error_band_rows(cases, quick) + _total_error_rows(wide)
    rows += _moment_error_rows(cases, read_drawn(JUDGED_PART), wide) + _discretisation_error_rows(
        [*cases, *wide], quick
    )
    if quick:
        return rows, {}
    programs = compare_programs(cases[::2])
    return [*rows, *_program_time_rows(programs), _long_table_row(work_folder)], {"programs": programs}


def _stored_forces_rows(contact_cases: list[ContactCase], quick: bool) -> list[Row]:
    """Row: difference of the stored exact forces from those that the exact theory computes now."""
    known = {(round(c.a / c.b, 6), c.kind, c.level): c for c in contact_cases}
    answers = []
    for key in RECOMPUTED_CASES[:2] if quick else RECOMPUTED_CASES:
        now = with_exact_forces(known[key], (20,) if quick else (40,))
        answers.append(float(np.linalg.norm(now.force - known[key].force)))
    return [
        Observed(
            "contact_price.reference",
            SYSTEM,
            f"largest difference of exact forces computed anew from those kept, over mu N, {len(answers)} cases",
            max(answers),
            "",
        ).at_most(
            REFERENCE_TOLERANCES[quick], "what the cells leave uncertain after their first order is taken out", "none"
        )
    ]


def _error_band_rows(contact_cases: list[ContactCase], quick: bool) -> list[Row]:
    """Rows: share of contacts whose error exceeds the stated error band, for the contacts of the calibration set and
    for random ones."""
    unseen, rows = read_drawn(JUDGED_PART), []
    against = np.array([case.parts[1] * case.parts[2] < 0 for case in unseen])
    for name in ["blended intermediate"] if quick else [*FASTSIM_BANDS, "simplified"]:
        drawn = theory_errors(name, unseen)
        for some, row_name, which, most in (
            (theory_errors(name, contact_cases), "", "of the set", LARGEST_MISSED_SHARE),
            (drawn, "drawn.", "drawn", 1 - BAND_SHARE),
            (drawn.selected(against), "against.", "drawn with lateral creepage against spin", LARGEST_MISSED_SHARE),
        ):
            for what, kind, within in zip(
                ("force", "moment"), ("band", "moment"), shares_within_bands(name, some), strict=True
            ):
                rows.append(
                    Observed(
                        f"contact_price.{row_name}{kind}.{name.replace(' ', '-')}",
                        SYSTEM,
                        f"{name}: share "
                        f"of {some.error.size} contacts {which} beyond the band of error that is stated "
                        f"with the {what}",
                        1 - within,
                        "",
                    ).at_most(most, f"the band is meant to hold {BAND_SHARE:.0%}", "native")
                )
    return rows


def _total_error_rows(contact_cases: list[ContactCase]) -> list[Row]:
    """Rows: share of random contacts whose error at 21 cells exceeds the stated total error of discretisation and
    theory, for every Poisson's ratio."""
    ratios, off, stated = np.array([case.pair.nu for case in contact_cases]), [], []
    for case in contact_cases:
        contact = case.contact(FastsimTheory, **BEST_FASTSIM_CHOICES)
        answers, error = rolled_with_errors(contact, case.motion, 21)
        limit, moment = case.friction_limit, case.friction_limit * np.sqrt(case.a * case.b) * case.mz
        off.append((np.linalg.norm(answers.force - limit * case.force), abs(answers.mz - moment)))
        stated.append((error.total, error.moment + MOMENT_ROUNDING * limit))
    beyond = np.array(off) > np.array(stated)
    return [
        Observed(
            f"contact_price.total.{what}.{nu:g}",
            SYSTEM,
            f"share of {np.count_nonzero(ratios == nu)} unseen "
            f"contacts of a/b 0.1 to 10 and Poisson's ratio {nu:g} whose {what} is off by more than is stated",
            float(beyond[ratios == nu, k].mean()),
            "",
        ).at_most(1 - BAND_SHARE, "what users read: 95 % are covered", "native")
        for k, what in enumerate(("force", "moment"))
        for nu in POISSON
    ]


def _moment_error_rows(
    contact_cases: list[ContactCase], random_cases: list[ContactCase], wide_cases: list[ContactCase]
) -> list[Row]:
    """Rows: error of FASTSIM's moment compared with the exact theory, by traction bound and set of contacts."""
    rows = []
    range_of_set = [case for case in wide_cases if AXIS_RATIOS[0] <= case.a / case.b <= AXIS_RATIOS[-1]]
    sets = {
        "set": (contact_cases, "the set"),
        "drawn": (random_cases, "the drawn contacts"),
        "less_wide": (range_of_set, "the wide contacts of a/b 0.2 to 5, Poisson's ratio 0 to 0.5"),
        "wide": (wide_cases, "the wide contacts, a/b 0.1 to 10, Poisson's ratio 0 to 0.5"),
    }
    for (bound, (mean, most)), (row_name, (some, words)) in product(MOMENT_TOLERANCES.items(), sets.items()):
        lever = np.array([max(c.a, c.b) / np.sqrt(c.a * c.b) for c in some])
        error = theory_errors(f"blended {bound}", some).moment_error * lever
        for what, value, allowed in (("mean", error.mean(), mean), ("95 %", np.quantile(error, 0.95), most)):
            observed = Observed(
                f"contact_price.mz.{bound}.{row_name}.{what.split()[0]}",
                SYSTEM,
                f"{bound} bound, moment of {len(some)} contacts: {words}; {what} of the error",
                float(value),
                "mu N sqrt(ab)",
            )
            rows.append(
                observed.aim(allowed, SLENDER_CONTACT_REASON)
                if (bound, row_name) == ("elliptic", "wide")
                else observed.at_most(allowed, "the exact theory, kept", "native")
            )
    return rows


def _discretisation_error_rows(contact_cases: list[ContactCase], quick: bool) -> list[Row]:
    """Rows: share of contacts whose discretisation error, measured with many cells, exceeds the stated one."""
    rows, some = [], contact_cases[::9] if quick else contact_cases
    for choices, cells in product(JUDGED_FASTSIM_OPTIONS[: 1 if quick else None], (21,) if quick else CELL_COUNTS):
        share = _shares_beyond_stated_error(some, cells, choices)
        name = ".".join([f"{cells}", *choices.values()])
        for what, value in zip(("force", "moment"), share, strict=True):
            rows.append(
                Observed(
                    f"contact_price.cells.{what}.{name}",
                    SYSTEM,
                    f"FASTSIM at {cells} cells"
                    f"{''.join(f', {word}' for word in choices.values())}: share of {len(some)} contacts "
                    f"whose error of the cells in the {what} is beyond the stated one",
                    value,
                    "",
                ).at_most(1 - BAND_SHARE, "what users read: 95 % are covered", "native")
            )
    return rows


def _shares_beyond_stated_error(
    contact_cases: list[ContactCase], cell_count: int, fastsim_options: dict[str, str]
) -> list[float]:
    """Shares of contacts whose discretisation errors of force and of moment exceed the stated ones."""
    answers = []
    for case in contact_cases:
        contact = case.contact(FastsimTheory, **{**BEST_FASTSIM_CHOICES, **fastsim_options})
        fine, true = contact.roll(case.motion, cell_count), contact.roll(case.motion, CONVERGED_CELL_COUNT)
        off = np.linalg.norm(fine.force - true.force), abs(fine.mz - true.mz)
        answers.append(
            np.array(off)
            > np.array(remaining_errors(contact, case.motion, cell_count, fine)) + MOMENT_ROUNDING * case.friction_limit
        )
    return [float(value) for value in np.mean(answers, axis=0)]


def _program_time_rows(program_times: dict[str, Any]) -> list[Row]:
    """Row: ratio of the computing times of Kalker's programs of 1983 and of 1982."""
    t = {name: np.array(values) for name, values in program_times["seconds"].items()}
    why = "the paper's figure is of a computer and a Fortran program of 1983"
    what = "ratio of the time of contact and forces by the program of 1983 to that of the program of 1982"
    ratio, low, high = paired_ratio(t["1983"] + t["press"], t["1982"])
    return [
        Observed(
            "contact_price.programs.time", SYSTEM, f"{what}, 95 % interval {low:.3g} to {high:.3g}", ratio, "times"
        ).beside("about 3", why)
    ]


def _long_table_row(work_folder: Path) -> Row:
    """Row: computing time of a long table of contacts."""
    rng = np.random.default_rng(SEED)
    low, high = np.array([2.0, 2.0, 1.0, 0.1, -0.5, -0.5, -1.0]), np.array([9.0, 9.0, 150.0, 0.5, 0.5, 0.5, 1.0])
    path, out = work_folder / "contact_cases.csv", work_folder / "contact_forces.csv"
    np.savetxt(
        path,
        rng.uniform(low, high, (LONG_TABLE_ROW_COUNT, 7)),
        fmt="%.8g",
        delimiter=",",
        comments="",
        header="a [mm],b [mm],load [kN],friction [-],xi_x [%],xi_y [%],spin [1/m]",
    )
    start = time.perf_counter()
    answers = solve_table(path, out, partial(Built, MATERIAL_PAIR), ContactMethod())
    seconds = time.perf_counter() - start
    path.unlink()
    out.unlink()
    assert answers == {"rows": LONG_TABLE_ROW_COUNT, "wrong": 0}
    what = f"time to answer a CSV of {LONG_TABLE_ROW_COUNT:,} contacts with errors and status, measured once"
    return Observed("contact_price.table", SYSTEM, what, seconds, "s").beside(
        "seconds", "reported and never gated", "none"
    )


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Table that compares Kalker's two programs."""
    return [table(case_data["programs"])] if case_data else []


def draw(case_data: dict[str, Any]) -> list[tuple[str, Any]]:
    """No figure, since the cost of accuracy in contact is drawn with the other problems of ``price``."""
    return []
