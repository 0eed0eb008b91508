"""A set of Hertzian contacts with forces by the exact theory, against which every faster theory is measured.

Five ellipses, nine kinds of creepage and eight sizes of it. Forces are kept as shares of mu N and of mu N sqrt(ab), so
that they hold for every load, size and friction of the same ellipse and Poisson's ratio. ``contact_set.csv`` holds
them: ``python -m validation.contact_set`` computes it anew in ten minutes, and every report does so for a few of its
rows.
"""

import csv
from dataclasses import replace
from pathlib import Path

from models.contact.material import Pair
from models.contact.work_precision import Case, ellipse_cases, exact

RATIOS = (0.2, 0.5, 1.0, 2.0, 5.0)
LEVELS = (0.05, 0.2, 0.5, 0.8, 1.2, 2.0, 4.0, 10.0)
SIZE, LOAD, FRICTION, PAIR = 5e-3, 8e4, 0.3, Pair()
"""sqrt(ab) in m, N, coefficient of friction and materials with which the set is computed."""
FILE = Path(__file__).with_suffix(".csv")
ANSWERS = ("fx", "fy", "mz", "error")


def cases() -> list[Case]:
    """All contacts of the set, without their forces."""
    return [case for ratio in RATIOS
            for case in ellipse_cases(SIZE * ratio**0.5, SIZE / ratio**0.5, LOAD, FRICTION, PAIR, LEVELS)]  # fmt: skip


def read() -> list[Case]:
    """All contacts of the set with their forces."""
    with FILE.open(newline="") as file:
        rows = list(csv.DictReader(file))
    return [_answered(case, *(float(row[name]) for name in ANSWERS)) for case, row in zip(cases(), rows, strict=True)]


def _answered(case: Case, fx: float, fy: float, mz: float, error: float) -> Case:
    return replace(case, fx=fx, fy=fy, mz=mz, error=error)


def write() -> None:
    """Compute the whole set."""
    with FILE.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("ratio", "kind", "level", *ANSWERS))
        for case in map(exact, cases()):
            numbers = (f"{getattr(case, name):.6f}" for name in ANSWERS)
            writer.writerow((round(case.a / case.b, 9), case.kind, case.level, *numbers))
            file.flush()


if __name__ == "__main__":
    write()
