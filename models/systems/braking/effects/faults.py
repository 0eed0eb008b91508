"""Lost, delayed or wrong samples, and valves that are stuck, on demand."""

from typing import Any

PLACE = "port.faults"
NEEDS = ("port",)
COST = "one look at each fault per sample"
COUNTS = {"all": {"asked": 1}}


def named(scene: Any) -> bool:
    """Whether a scene has it."""
    return scene.port is not None and bool(scene.port.faults)


def leave_out(table: dict[str, Any], scene: Any) -> None:
    """Nothing fails."""
    del table["port"]["faults"]


def put_in(table: dict[str, Any], scene: Any) -> None:
    """All signals are lost for a tenth of a second."""
    table.setdefault("port", {})["faults"] = [{"kind": "lost", "start": 0.1, "end": 0.2}]
