"""Faults planted in vehicle, road, covariance and weighting of ride: which check sees which."""

from pathlib import Path
from typing import Any

from validation.faults.ride import CAMPAIGN
from validation.rows import Row, System, Table

TITLE = "Planted faults of ride: what each check sees"
SYSTEM: System = "ride"


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
