"""Faults planted one at a time, checks that see them or not, and what a report says of both.

What a check compares with is computed once without a fault, by a route that the fault does not touch.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from models.core.errors import RunFailed
from validation.common.rows import Observed, Row, System, Table
from validation.faults.patches import Patch

Record = dict[str, Any]
FAULT_SYSTEM: System = "hard-cases"
"""Where the report has all rows of planted faults; a campaign's own system is that of the thing that they are in."""


@dataclass(frozen=True)
class Check:
    """A check by which faults are looked for: it sees a fault if ``measure()`` exceeds ``tolerance``."""

    title: str
    unit: str
    tolerance: float
    measure: Callable[[], float]

    def size(self) -> float:
        """Measured error; infinite if the fault makes a run fail."""
        try:
            return self.measure()
        except RunFailed:
            return math.inf


@dataclass(frozen=True)
class CampaignFault:
    """A planted fault: its description, where it is planted, and the patch that plants it."""

    name: str
    place: str
    inside: Patch


@dataclass(frozen=True)
class Campaign:
    """Faults in one subject, named ``what``, and the checks that are run under each fault. The ids of its rows begin
    with ``id``."""

    id: str
    what: str
    system: System
    checks: dict[str, Check]
    faults: tuple[CampaignFault, ...]

    def measure(self, every: int = 1) -> list[Record]:
        """Ratio of error to tolerance for every check: first without a fault, then with each planted fault, or with
        every ``every``-th one."""
        clean = {"fault": "no fault", "place": "nowhere", "ratios": self._error_ratios()}
        planted = self.faults[::every]
        return [
            clean,
            *(
                {"fault": fault.name, "place": fault.place, "ratios": self._ratios_with_fault(fault)}
                for fault in planted
            ),
        ]

    def _ratios_with_fault(self, fault: CampaignFault) -> dict[str, float]:
        with fault.inside()():
            return self._error_ratios()

    def _error_ratios(self) -> dict[str, float]:
        return {name: check.size() / check.tolerance for name, check in self.checks.items()}

    def rows(self, records: list[Record]) -> list[Row]:
        """Rows: faults caught, false alarms, and faults that only a single check catches."""
        clean, *faulty = records
        single = [
            f"{record['fault']} ({seeing_checks(record)[0]})" for record in faulty if len(seeing_checks(record)) == 1
        ]
        return [
            Observed(
                f"{self.id}.caught",
                FAULT_SYSTEM,
                f"faults planted in {self.what} that a check catches",
                sum(bool(seeing_checks(record)) for record in faulty),
                "faults",
            ).within(
                len(faulty),
                0,
                f"every one of them makes it wrong; {len(faulty)} of {len(self.faults)} were planted",
                "native",
            ),
            Observed(
                f"{self.id}.false_alarms",
                FAULT_SYSTEM,
                f"false alarms of the checks of {self.what} (no fault planted)",
                len(seeing_checks(clean)),
                "alarms",
            ).within(0, 0, "a check that cries without a fault is no check", "native"),
            Observed(
                f"{self.id}.single",
                FAULT_SYSTEM,
                f"faults planted in {self.what} that a single check catches",
                len(single),
                "faults",
            ).beside("few", "what would pass if that check were dropped: " + (", ".join(single) or "none"), "native"),
        ]

    def table(self, records: list[Record]) -> Table:
        """Table of every fault with the checks that see it."""
        lines = tuple(
            (
                record["fault"],
                record["place"],
                self._sizes_text(record),
                ", ".join(name for name in self.checks if name not in seeing_checks(record)),
            )
            for record in records[1:]
        )
        checks = (f"{name}: {check.title} (allowed {check.tolerance:g})" for name, check in self.checks.items())
        return Table(
            f"Faults of {self.what}, one at a time",
            f"Sizes as each check takes them: {'; '.join(checks)}.",
            ("fault", "planted in", "caught by", "not seen by"),
            lines,
        )

    def lines(self, records: list[Record]) -> list[tuple[str, ...]]:
        """Table lines, one for each fault: system, the part with the fault, fault, checks that see it, checks that had
        missed it."""
        return [
            (
                self.system,
                self.what,
                record["fault"],
                ", ".join(seeing_checks(record)) or "none",
                ", ".join(name for name in self.checks if name not in seeing_checks(record)),
            )
            for record in records[1:]
        ]

    def _sizes_text(self, record: Record) -> str:
        return ", ".join(
            f"{name} {record['ratios'][name] * self.checks[name].tolerance:.1g}" for name in seeing_checks(record)
        )


def seeing_checks(record: Record) -> list[str]:
    """Names of the checks that see a fault."""
    return [name for name, ratio in record["ratios"].items() if not ratio <= 1.0]
