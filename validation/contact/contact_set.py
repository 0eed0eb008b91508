"""Hertzian contacts with forces by the exact theory, against which every faster theory is measured.

The set: five ellipses, thirteen kinds of creepage and eight sizes of it. Drawn contacts: ellipses, directions and sizes
at random. Wide ones: the same of a/b from 0.1 to 10 and of three Poisson's ratios, every creepage absent in a quarter
of them. Drawn and wide ones have two parts, of which one goes into the bands of error that are stated and the other one
judges them. Forces are kept as shares of mu N and of mu N sqrt(ab), so that they hold for every load, size and friction
of the same ellipse and Poisson's ratio. ``contact_set.csv``, ``contact_drawn.csv`` and ``contact_wide.csv`` hold them:
``python -m validation.contact.contact_set`` computes all anew in an hour, and every report does so for a few rows.
"""

import csv
from dataclasses import replace
from itertools import cycle
from math import cos, radians, sin
from pathlib import Path
from typing import Any

import numpy as np

from models.contact.material import Material, MaterialPair
from models.systems.contact import work_precision
from models.systems.contact.work_precision import ContactCase, ellipse_cases, with_exact_forces

AXIS_RATIOS = (0.2, 0.5, 1.0, 2.0, 5.0)
CREEPAGE_SIZES = (0.05, 0.2, 0.5, 0.8, 1.2, 2.0, 4.0, 10.0)
CREEPAGE_KINDS = {
    **work_precision.CREEPAGE_KINDS,
    **{
        f"y{sign}spin {angle}": (0.0, cos(radians(angle)), float(f"{sign}1") * sin(radians(angle)))
        for angle in (15, 30)
        for sign in "+-"
    },
}
"""Name -> scaled creepages xi_x, xi_y and spin; lateral creepage with and against spin, where theories differ most, is
added by angles in degrees."""
CONTACT_SIZE, LOAD, FRICTION, MATERIAL_PAIR = 5e-3, 8e4, 0.3, MaterialPair()
"""sqrt(ab) (m), normal load (N), coefficient of friction and materials with which the set is computed."""
SEED, DRAWN_CONTACTS, SIZE_RANGE = 43, 300, (0.2, 10.0)
"""Random contacts: seed, number in each part, and range of the creepages' sizes."""
WIDE_RATIOS, WIDE_RANGE, POISSON = (0.1, 10.0), (0.05, 10.0), (0.0, 0.28, 0.5)
"""Wide contacts: range of a/b, range of the creepages' sizes, and Poisson's ratios, used in turn."""
WIDE_CONTACTS, ABSENT_SHARE = ((300, 450), (300,)), 0.25
"""Numbers of wide contacts in each part, draw by draw; share of contacts in which each of xi_x, xi_y and spin is
zero."""
FITTED_PART, JUDGED_PART = 0, 1
"""Parts of the random contacts: the error bands are fitted to the first and judged by the second."""
FORCES_FILE = Path(__file__).with_suffix(".csv")
DRAWN_FILE, WIDE_FILE = (FORCES_FILE.with_name(f"contact_{name}.csv") for name in ("drawn", "wide"))
RESULT_COLUMNS = ("fx", "fy", "mz", "error")
Range = tuple[float, float]


def regular_contacts() -> list[ContactCase]:
    """All contacts on the grid of axis ratios, creepages and spins; forces are not yet computed."""
    return [
        case
        for ratio in AXIS_RATIOS
        for case in ellipse_cases(*_semi_axes(ratio), LOAD, FRICTION, MATERIAL_PAIR, CREEPAGE_SIZES, CREEPAGE_KINDS)
    ]


def drawn_contacts(part_number: int) -> list[ContactCase]:
    """A part (FITTED_PART or JUDGED_PART) of the random contacts, without forces; all directions of the scaled
    creepages are equally likely."""
    return _draw_contacts(
        part_number,
        DRAWN_CONTACTS,
        (AXIS_RATIOS[0], AXIS_RATIOS[-1]),
        SIZE_RANGE,
        f"drawn {part_number}",
        [MATERIAL_PAIR],
    )


def wide_contacts(part_number: int) -> list[ContactCase]:
    """A part (FITTED_PART or JUDGED_PART) of the random contacts with wide ranges of shape and material, without
    forces."""
    bodies = [Material(E=MATERIAL_PAIR.wheel.E, nu=nu) for nu in POISSON]
    pairs, first = [MaterialPair(body, body) for body in bodies], 2 + len(WIDE_CONTACTS[FITTED_PART]) * part_number
    streams = enumerate(WIDE_CONTACTS[part_number], first)
    return [
        case
        for stream in streams
        for case in _draw_contacts(*stream, WIDE_RATIOS, WIDE_RANGE, "wide", pairs, ABSENT_SHARE)
    ]


def _draw_contacts(
    stream_number: int,
    contact_count: int,
    axis_ratios: Range,
    creepage_range: Range,
    contact_kind: str,
    material_pairs: list[MaterialPair],
    zero_creepage_share: float = 0.0,
) -> list[ContactCase]:
    """Random contacts from a stream of random numbers, with the material pairs in turn. Each creepage is zero in a
    share of the contacts, but never all three at a time."""
    rng = np.random.default_rng((SEED, stream_number))
    ratio, level = (
        np.exp(rng.uniform(np.log(low), np.log(high), contact_count)).tolist()
        for low, high in (axis_ratios, creepage_range)
    )
    directions, present = (
        rng.normal(size=(contact_count, 3)),
        rng.uniform(size=(contact_count, 3)) >= zero_creepage_share,
    )
    present[~present.any(axis=1)] = True
    parts = map(tuple, (directions * present).tolist())
    drawn = zip(ratio, level, parts, cycle(material_pairs), strict=False)
    return [
        ContactCase(*_semi_axes(a_by_b), LOAD, FRICTION, pair, contact_kind, part, size)
        for a_by_b, size, part, pair in drawn
    ]


def _semi_axes(axis_ratio: float) -> tuple[float, float]:
    return CONTACT_SIZE * axis_ratio**0.5, CONTACT_SIZE / axis_ratio**0.5


def read_contacts() -> list[ContactCase]:
    """All contacts of the regular set, with their stored exact forces."""
    return _read_contacts(FORCES_FILE, regular_contacts())


def read_drawn(part_number: int) -> list[ContactCase]:
    """A part (FITTED_PART or JUDGED_PART) of the random contacts, with their stored exact forces."""
    return _read_contacts(DRAWN_FILE, drawn_contacts(FITTED_PART) + drawn_contacts(JUDGED_PART))[
        part_number * DRAWN_CONTACTS : (part_number + 1) * DRAWN_CONTACTS
    ]


def read_wide(part_number: int) -> list[ContactCase]:
    """A part (FITTED_PART or JUDGED_PART) of the wide contacts, with their stored exact forces."""
    return _read_contacts(WIDE_FILE, wide_contacts(FITTED_PART) + wide_contacts(JUDGED_PART))[
        part_number * sum(WIDE_CONTACTS[FITTED_PART]) :
    ][: sum(WIDE_CONTACTS[part_number])]


def _read_contacts(table_path: Path, contacts: list[ContactCase]) -> list[ContactCase]:
    with table_path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    forces: list[dict[str, Any]] = [{name: float(row[name]) for name in RESULT_COLUMNS} for row in rows]
    return [replace(case, **force) for case, force in zip(contacts, forces, strict=True)]


def compute_and_write(table_path: Path, contacts: list[ContactCase]) -> None:
    """Compute the exact forces of contacts and write them to a CSV file."""
    with table_path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("ratio", "kind", "level", *RESULT_COLUMNS))
        for case in map(with_exact_forces, contacts):
            numbers = (f"{getattr(case, name):.6f}" for name in RESULT_COLUMNS)
            writer.writerow((round(case.a / case.b, 9), case.kind, round(case.level, 9), *numbers))
            file.flush()


if __name__ == "__main__":
    compute_and_write(FORCES_FILE, regular_contacts())
    compute_and_write(DRAWN_FILE, drawn_contacts(FITTED_PART) + drawn_contacts(JUDGED_PART))
    compute_and_write(WIDE_FILE, wide_contacts(FITTED_PART) + wide_contacts(JUDGED_PART))
