"""Faults planted in a braked vehicle, its brakes and its tyres: which check sees which."""

from pathlib import Path
from typing import Any

from validation.faults.braking import CAMPAIGN
from validation.rows import Row, System, Table

TITLE = "Planted faults of braking: what each check sees"
SYSTEM: System = "anti-lock"


def measure(quick: bool, folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Every fault under every check; the quick share is all of it."""
    found = CAMPAIGN.measure()
    return CAMPAIGN.rows(found), {"faults": found}


def tables(data: dict[str, Any]) -> list[Table]:
    """Every fault with what sees it and what does not."""
    return [CAMPAIGN.table(data["faults"])]


def draw(data: dict[str, Any]) -> list[tuple[str, Any]]:
    """No figure: the table has it all."""
    return []
