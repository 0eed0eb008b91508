"""Planted faults of all systems: each is put on purpose into one of two compared implementations, and the checks must
detect it.

A full run plants every fault. A quick run plants two faults of the pitch plane on one vehicle and every sixteenth of
the other systems, beside all runs without a fault that these need.
"""

from pathlib import Path

from validation.common.rows import CaseAnswer, Drawn, Observed, Row, Saved, Table
from validation.faults import (
    advice,
    braking,
    braking_reference,
    choosing,
    contact,
    hubs,
    measuring,
    native,
    pitch_plane,
    ride,
    tyres,
    wheelset,
    written,
)
from validation.faults.campaign import FAULT_SYSTEM
from validation.faults.planting import CONTROLS_WITHOUT_FAULT, DESCRIPTION_FAULTS, EQUATIONS_FAULTS

TITLE = "Planted faults: what each check sees"
FAULT_CAMPAIGNS = (
    contact.CAMPAIGN,
    ride.CAMPAIGN,
    wheelset.CAMPAIGN,
    tyres.CAMPAIGN,
    hubs.CAMPAIGN,
    written.CAMPAIGN,
    native.CAMPAIGN,
    braking.CAMPAIGN,
    braking_reference.CAMPAIGN,
    measuring.CAMPAIGN,
    choosing.CAMPAIGN,
    advice.CAMPAIGN,
)
QUICK_FAULTS = (DESCRIPTION_FAULTS[0], EQUATIONS_FAULTS[0])
QUICK_FAULT_SPACING, FEWEST_FAULT_COUNT = 16, 40
"""Every so many faults of a campaign are planted in a quick run; and the least number of faults that must be caught."""


def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows on planted faults by system; a full run also has a row over all systems. A quick run plants every sixteenth
    fault of each system."""
    plane = (
        pitch_plane.measure(QUICK_FAULTS, CONTROLS_WITHOUT_FAULT[:1], (pitch_plane.ASYMMETRIC_SET,))
        if quick
        else pitch_plane.measure()
    )
    data: Saved = {
        "pitch-plane": plane,
        **{campaign.id: campaign.measure(QUICK_FAULT_SPACING if quick else 1) for campaign in FAULT_CAMPAIGNS},
    }
    rows = [
        *pitch_plane.rows(plane),
        *(row for campaign in FAULT_CAMPAIGNS for row in campaign.rows(data[campaign.id])),
    ]
    return [*rows, *([] if quick else [_fault_count_row(data)])], data


def _fault_count_row(case_data: Saved) -> Row:
    """Row: by how much the number of detected faults falls short of the number asked for."""
    caught = sum(line[3] != "none" for line in _fault_table_lines(case_data))
    return Observed(
        "planted.count",
        FAULT_SYSTEM,
        f"shortfall of the number of faults that are caught in all systems from {FEWEST_FAULT_COUNT}",
        max(0, FEWEST_FAULT_COUNT - caught),
        "faults",
    ).at_most(0, f"{caught} of {len(_fault_table_lines(case_data))} are", "native")


def _fault_table_lines(case_data: Saved) -> list[tuple[str, ...]]:
    """Table lines, one for each fault: system, component with the fault, fault, checks that detect it, and checks that
    alone would have missed it."""
    return [
        *pitch_plane.lines(case_data["pitch-plane"]),
        *(line for campaign in FAULT_CAMPAIGNS for line in campaign.lines(case_data[campaign.id])),
    ]


def tables(case_data: Saved) -> list[Table]:
    """Tables of all faults, and for each system of the errors and descriptions of the checks."""
    lines = _fault_table_lines(case_data)
    systems = len({line[0] for line in lines})
    note = (
        f"{len(lines)} faults in {systems} systems, one at a time. Each check in the last column, had it been the "
        "only one, would have let the fault pass."
    )
    headings = ("system", "planted in", "fault", "caught by", "would have been missed by")
    overview = Table("Planted faults of all systems", note, headings, tuple(lines))
    return [
        overview,
        *pitch_plane.tables(case_data["pitch-plane"]),
        *(campaign.table(case_data[campaign.id]) for campaign in FAULT_CAMPAIGNS),
    ]


def draw(case_data: Saved) -> Drawn:
    """Plot how far above its tolerance each check's error is for every fault of the pitch plane."""
    return pitch_plane.draw(case_data["pitch-plane"])
