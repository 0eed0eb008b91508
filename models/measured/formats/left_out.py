"""What a reader leaves out of a file, by reason: one sentence each, however many channels it concerns."""

from dataclasses import dataclass, field
from pathlib import Path

from models.core.finding import Finding
from models.measured.formats.opened import notice

SHOWN = 5


@dataclass
class LeftOut:
    """Names of what is left out, by reason."""

    names: dict[str, list[str]] = field(default_factory=dict)

    def add(self, why: str, name: str) -> None:
        """One more."""
        self.names.setdefault(why, []).append(name)

    def findings(self, path: Path) -> list[Finding]:
        """One sentence per reason."""
        return [
            notice(path, "note", f"left out, {why}: {', '.join(names[:SHOWN])}{more(len(names) - SHOWN)}")
            for why, names in self.names.items()
        ]


def more(count: int) -> str:
    """Say how many are not shown."""
    return f" and {count} more" if count > 0 else ""
