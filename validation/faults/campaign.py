"""Campaigns of faults that are planted one at a time: the checks that see them, and the report's rows and tables.

The value that a check compares with is computed once, without a fault, by code that the fault does not change.
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
"""System under which the report lists all rows of planted faults. A campaign's ``system`` is that of its subject."""


@dataclass(frozen=True)
class Check:
    """A check for planted faults: it sees a fault if ``measure()`` exceeds ``tolerance``."""

    title: str
    unit: str
    tolerance: float
    measure: Callable[[], float]

    def size(self) -> float:
        """Error that the check measures; infinite if the fault makes a run fail."""
        try:
            return self.measure()
        except RunFailed:
            return math.inf


@dataclass(frozen=True)
class CampaignFault:
    """A fault to be planted: its description, the part of the code that it is planted in, and the patch that plants
    it."""

    name: str
    planted_in: str
    patch: Patch


@dataclass(frozen=True)
class Campaign:
    """Faults in a subject, such as "braking", and the checks that are run under each fault. The ids of its report rows
    begin with ``id``."""

    id: str
    subject: str
    system: System
    checks: dict[str, Check]
    faults: tuple[CampaignFault, ...]

    def measure(self, fault_stride: int = 1) -> list[Record]:
        """Records with the ratio of error to tolerance of every check: first without a fault, then with every
        ``fault_stride``-th fault planted."""
        clean = {"fault": "no fault", "place": "nowhere", "ratios": self._error_ratios()}
        planted = self.faults[::fault_stride]
        return [
            clean,
            *(
                {"fault": fault.name, "place": fault.planted_in, "ratios": self._ratios_with_fault(fault)}
                for fault in planted
            ),
        ]

    def _ratios_with_fault(self, campaign_fault: CampaignFault) -> dict[str, float]:
        with campaign_fault.patch()():
            return self._error_ratios()

    def _error_ratios(self) -> dict[str, float]:
        return {name: check.size() / check.tolerance for name, check in self.checks.items()}

    def rows(self, fault_records: list[Record]) -> list[Row]:
        """Report rows: numbers of faults caught, of false alarms, and of faults that a single check catches."""
        clean, *faulty = fault_records
        single = [
            f"{record['fault']} ({seeing_checks(record)[0]})" for record in faulty if len(seeing_checks(record)) == 1
        ]
        return [
            Observed(
                f"{self.id}.caught",
                FAULT_SYSTEM,
                f"faults planted in {self.subject} that a check catches",
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
                f"false alarms of the checks of {self.subject} (no fault planted)",
                len(seeing_checks(clean)),
                "alarms",
            ).within(0, 0, "a check that cries without a fault is no check", "native"),
            Observed(
                f"{self.id}.single",
                FAULT_SYSTEM,
                f"faults planted in {self.subject} that a single check catches",
                len(single),
                "faults",
            ).beside("few", "what would pass if that check were dropped: " + (", ".join(single) or "none"), "native"),
        ]

    def table(self, fault_records: list[Record]) -> Table:
        """Table of every planted fault with the checks that see it and their errors."""
        lines = tuple(
            (
                record["fault"],
                record["place"],
                self._sizes_text(record),
                ", ".join(name for name in self.checks if name not in seeing_checks(record)),
            )
            for record in fault_records[1:]
        )
        checks = (f"{name}: {check.title} (allowed {check.tolerance:g})" for name, check in self.checks.items())
        return Table(
            f"Faults of {self.subject}, one at a time",
            f"Sizes as each check takes them: {'; '.join(checks)}.",
            ("fault", "planted in", "caught by", "not seen by"),
            lines,
        )

    def lines(self, fault_records: list[Record]) -> list[tuple[str, ...]]:
        """Table lines, one for each fault: system, subject, fault, checks that see it, checks that do not."""
        return [
            (
                self.system,
                self.subject,
                record["fault"],
                ", ".join(seeing_checks(record)) or "none",
                ", ".join(name for name in self.checks if name not in seeing_checks(record)),
            )
            for record in fault_records[1:]
        ]

    def _sizes_text(self, fault_record: Record) -> str:
        return ", ".join(
            f"{name} {fault_record['ratios'][name] * self.checks[name].tolerance:.1g}"
            for name in seeing_checks(fault_record)
        )


def seeing_checks(fault_record: Record) -> list[str]:
    """Names of the checks that see the fault of a record: their error exceeds the tolerance."""
    return [name for name, ratio in fault_record["ratios"].items() if not ratio <= 1.0]
