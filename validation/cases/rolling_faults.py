"""Faults planted in wheelset, tyres and hub forces: which check sees which."""

from pathlib import Path
from typing import Any

from validation.faults import hubs, tyres, wheelset
from validation.rows import Row, System, Table

TITLE = "Planted faults of vehicles that roll: what each check sees"
SYSTEM: System = "rolling-vehicle"
CAMPAIGNS = (wheelset.CAMPAIGN, tyres.CAMPAIGN, hubs.CAMPAIGN)


def measure(quick: bool, folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Every fault under every check of its vehicle; the quick share is all of it."""
    found = {campaign.id: campaign.measure() for campaign in CAMPAIGNS}
    return [row for campaign in CAMPAIGNS for row in campaign.rows(found[campaign.id])], found


def tables(data: dict[str, Any]) -> list[Table]:
    """Every fault with what sees it and what does not."""
    return [campaign.table(data[campaign.id]) for campaign in CAMPAIGNS]


def draw(data: dict[str, Any]) -> list[tuple[str, Any]]:
    """No figure: the tables have it all."""
    return []
