"""Hard cases of recordings that are plausible and wrong: units, signs, sides, clocks, gaps, clipped and dead channels.

A virtual measurement of 5 s on a rough road is spoilt; the check must name the fault at its place. The error is the
size found against the size planted, relative; infinite where nothing is named, or another channel is.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from validation.hard_cases.case import HardCase
from validation.measured import planted as bench

ROAD: bench.Ride = ("C", 1, 20.0, 5.0)
FAULT_SIZE_TOLERANCE = 0.2


def planted_fault_case(
    check_name: str,
    expected_error_place: str,
    fault_size: float | None,
    spoil_recording: bench.Spoil | None = None,
    **planted_faults: Any,
) -> Callable[[str, Path], float]:
    """Case: a recording with one planted fault. Error: relative error of the size that the check finds; infinite unless
    ``check_name`` reports the fault first, and all findings name ``expected_error_place``."""

    def error(engine_name: str, work_folder: Path) -> float:
        findings = bench.planted_findings(bench.measurement(road=ROAD), work_folder, spoil_recording, **planted_faults)
        if (
            not findings
            or findings[0].check != check_name
            or not all(expected_error_place in finding.place for finding in findings)
        ):
            return np.inf
        return 0.0 if fault_size is None else abs((findings[0].size or 0.0) / fault_size - 1.0)

    return error


def clean_recording_findings(engine_name: str, work_folder: Path) -> float:
    """Case: a recording without faults. Error: number of errors and doubts that the check reports."""
    return float(len(bench.planted_findings(bench.measurement(road=ROAD), work_folder)))


CASES = (
    HardCase(
        "clean recording",
        "a check that always cries is no check",
        "no error, no doubt",
        "findings",
        0.0,
        "noise as stated, nothing planted",
        clean_recording_findings,
        is_without_engine=True,
    ),
    *(
        HardCase(
            name,
            hard,
            check,
            "of its size",
            FAULT_SIZE_TOLERANCE,
            "what was planted, 20 %",
            error,
            is_without_engine=True,
        )
        for name, hard, check, error in (
            (
                "wheel force in kN read as N",
                "a vehicle that flies off, or a plausible bias",
                "unit named at its channel",
                planted_fault_case("unit", "fl_fz", 1e-3, bench.scaled_channels(1e-3, "fl_fz")),
            ),
            (
                "wheel force with the other sign",
                "its mean is that of another load",
                "sign named at its channel",
                planted_fault_case("sign", "rr_fz", -1.0, bench.scaled_channels(-1.0, "rr_fz")),
            ),
            (
                "clipped wheel force",
                "the worst loads are missing, the mean hardly changes",
                "clipping, 3 % of samples",
                planted_fault_case("clipped", "fl_fz", 3.0, bench.clipped_channel("fl_fz", 0.03)),
            ),
            (
                "spike of one sample",
                "its damage is that of the whole recording; the mean hardly changes",
                "its height",
                planted_fault_case("spikes", "fl_fz", 5e3, bench.spiked_channel("fl_fz", 2.0, 5e3)),
            ),
            (
                "value held for 0.06 s",
                "shorter than a gap that is bridged: a straight line at any height",
                "length and place",
                planted_fault_case("clipped", "fl_fz", 0.06, bench.hold_sample("fl_fz", 2.0, 0.06)),
            ),
            (
                "dead channel",
                "a constant is a valid number",
                "named as dead",
                planted_fault_case("clipped", "fr_fz", None, bench.scaled_channels(0.0, "fr_fz", offset=3e3)),
            ),
            (
                "front wheels exchanged",
                "loads are alike left and right",
                "the sides named",
                planted_fault_case("swapped", "fl with fr", None, bench.exchanged_hubs(("fl", "fr"))),
            ),
            (
                "one channel 3 ms late",
                "a phantom moment of pitch",
                "the delay and its channel",
                planted_fault_case("shift", "fl_fz", 3e-3, delay={"fl_fz": 3e-3}),
            ),
            (
                "gap of half a second",
                "interpolated it is a road without roughness",
                "length and place",
                planted_fault_case("gaps", "rr_fz", 0.5, bench.drop_samples("rr_fz", 3.0, 0.5)),
            ),
        )
    ),
)
