"""Errors that are stated with creep forces: whether they hold, and what a table of contacts takes.

What accuracy costs in rolling contact stands among the problems of ``price``.
"""

import time
from pathlib import Path
from typing import Any

import numpy as np

from models.contact.accuracy import BEST, left
from models.contact.cases_table import answer
from models.contact.hertz import by_axes
from models.contact.scene import Method
from models.contact.theories import Fastsim
from models.contact.work_precision import Case, exact
from validation.contact.contact_bands import FASTSIM, SHARE, held, kept
from validation.contact.contact_set import FRICTION, JUDGED, LOAD, PAIR, read, read_drawn
from validation.contact.programs import compare, table
from validation.rows import Row, System, Table, at_most, finding
from validation.timing import paired_ratio

TITLE = "Stated errors of rolling contact"
SYSTEM: System = "contact"
REPEATED = ((1.0, "x", 0.5), (1.0, "spin", 1.2), (0.5, "x+y", 0.8), (2.0, "y+spin", 0.8), (5.0, "x-y+spin", 0.5),
            (0.2, "y-spin", 1.2))  # fmt: skip
"""Cases of the set that are computed anew; a quick run takes the first two on coarser grids."""
REFERENCE = {True: 0.01, False: 0.005}
"""By mu N: the exact theory's own error on the grids of a quick and of a full run."""
BEYOND = 0.06
"""Share of contacts of the set that a stated error may miss: the band's 5 % and a row or two."""
SMALL = 5e-4
ROWS, SEED = 100_000, 41


def measure(quick: bool, folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Whether stated errors hold; in the full run also Kalker's two programs and a long table."""
    cases = read()
    rows = _reference_rows(cases, quick) + _band_rows(cases, quick) + _cell_rows(cases[::9] if quick else cases)
    if quick:
        return rows, {}
    programs = compare(cases[::2])
    return [*rows, *_program_rows(programs), _table_row(folder)], {"programs": programs}


def _reference_rows(cases: list[Case], quick: bool) -> list[Row]:
    """The kept forces against those that the exact theory gives now."""
    known = {(round(c.a / c.b, 6), c.kind, c.level): c for c in cases}
    found = []
    for key in REPEATED[:2] if quick else REPEATED:
        now = exact(known[key], (20,) if quick else (40,))
        found.append(float(np.linalg.norm(now.force - known[key].force)))
    return [at_most("contact_price.reference", SYSTEM, f"exact forces computed anew against those kept, {len(found)} "
                    "cases, largest difference by mu N", max(found), "", REFERENCE[quick],
                    "what the cells leave uncertain after their first order is taken out", "none")]  # fmt: skip


def _band_rows(cases: list[Case], quick: bool) -> list[Row]:
    """Stated errors on the contacts of the set, and on drawn ones that the bands have never seen."""
    unseen, rows = read_drawn(JUDGED), []
    against = np.array([case.parts[1] * case.parts[2] < 0 for case in unseen])
    for name in ["blended intermediate"] if quick else [*FASTSIM, "simplified"]:
        drawn = held(name, unseen)
        for some, place, which, most in (
            (held(name, cases), "", "of the set", BEYOND),
            (drawn, "drawn.", "drawn", 1 - SHARE),
            (drawn.of(against), "against.", "drawn with lateral creepage against spin", BEYOND),
        ):
            for what, kind, within in zip(("force", "moment"), ("band", "moment"), kept(name, some), strict=True):
                rows.append(at_most(f"contact_price.{place}{kind}.{name.replace(' ', '-')}", SYSTEM, f"{name}: share "
                                    f"of {some.error.size} contacts {which} beyond the band of error that is stated "
                                    f"with the {what}", 1 - within, "", most, f"the band is meant to hold {SHARE:.0%}",
                                    "native"))  # fmt: skip
    return rows


def _cell_rows(cases: list[Case]) -> list[Row]:
    """The errors of the cells that step halving states, against those found on many cells."""
    found = []
    for case in cases:
        contact = Fastsim(by_axes(case.a, case.b, PAIR, load=LOAD), FRICTION, PAIR, **BEST)
        fine, true = contact.roll(case.motion, 21), contact.roll(case.motion, 161)
        unit = np.array([FRICTION * LOAD, FRICTION * LOAD * contact.lever])
        off = np.array([np.linalg.norm(fine.force - true.force), abs(fine.mz - true.mz)])
        found.append((off / unit, left(contact, case.motion, 21, fine) / unit))
    error, stated = np.array(found).transpose(1, 2, 0)
    beyond = np.mean(error > 2 * stated + SMALL, axis=1)
    why = "halving sees a difference, not the error itself; twice holds nearly always"
    return [at_most(f"contact_price.cells{end}", SYSTEM, f"FASTSIM at 21 cells: share of {len(cases)} contacts whose "
                    f"error of the cells in the {what} is beyond twice the stated one and {SMALL:g} {unit}",
                    float(share), "", BEYOND, why, "native")
            for end, what, unit, share in zip(("", ".moment"), ("force", "moment"), ("mu N", "mu N max(a, b)"), beyond,
                                              strict=True)]  # fmt: skip


def _program_rows(found: dict[str, Any]) -> list[Row]:
    t = {name: np.array(own) for name, own in found["seconds"].items()}
    why = "the paper's figure is of a computer and a Fortran program of 1983"
    what = "contact and forces by the program of 1983, by the time of the one of 1982"
    ratio, low, high = paired_ratio(t["1983"] + t["press"], t["1982"])
    return [finding("contact_price.programs.time", SYSTEM, f"{what}, 95 % interval {low:.3g} to {high:.3g}", ratio,
                    "times", "about 3", why)]  # fmt: skip


def _table_row(folder: Path) -> Row:
    """Time of a long table of contacts."""
    rng = np.random.default_rng(SEED)
    low, high = np.array([2.0, 2.0, 1.0, 0.1, -0.5, -0.5, -1.0]), np.array([9.0, 9.0, 150.0, 0.5, 0.5, 0.5, 1.0])
    path, out = folder / "contact_cases.csv", folder / "contact_forces.csv"
    np.savetxt(path, rng.uniform(low, high, (ROWS, 7)), fmt="%.8g", delimiter=",", comments="",
               header="a [mm],b [mm],load [kN],friction [-],xi_x [%],xi_y [%],spin [1/m]")  # fmt: skip
    start = time.perf_counter()
    found = answer(path, out, PAIR, Method())
    seconds = time.perf_counter() - start
    path.unlink()
    out.unlink()
    assert found == {"rows": ROWS, "wrong": 0}
    what = f"a CSV of {ROWS:,} contacts answered, with errors and status, once"
    return finding("contact_price.table", SYSTEM, what, seconds, "s", "seconds", "reported and never gated", "none")


def tables(data: dict[str, Any]) -> list[Table]:
    """The paper's comparison."""
    return [table(data["programs"])] if data else []


def draw(data: dict[str, Any]) -> list[tuple[str, Any]]:
    """None: what accuracy costs in contact is drawn beside the other problems of ``price``."""
    return []
