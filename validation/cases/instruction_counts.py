"""What a step costs in instructions, which do not wander as seconds do, and how well their count repeats."""

from pathlib import Path
from typing import Any

from validation.common.rows import Row, System, Table
from validation.price import instructions

TITLE = "Instructions per step"
SYSTEM: System = "cost"


def measure(quick: bool, folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Counts of every method in two processes under valgrind, in full alone: they have no quick share."""
    rows, data = ([], {}) if quick else instructions.measure(folder)
    return rows, {"instructions": data}


def tables(data: dict[str, Any]) -> list[Table]:
    """Instructions per step, where they were counted."""
    return [instructions.table(data["instructions"])] if data["instructions"] else []
