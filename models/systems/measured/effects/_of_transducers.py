"""What the effects of virtual transducers have in common: each is a key of [virtual.faults]."""

from collections.abc import Mapping
from typing import Any

from models.core.errors import InputError

NEEDS = ("virtual_measurement",)
WHY = "for files have the faults that they have"


def has(scene: Any, key: str) -> bool:
    """Whether a scene names one that does anything."""
    own = getattr(scene.virtual.faults, key) if scene.virtual is not None else None
    return any(own.values()) if isinstance(own, Mapping) else own is not None


def drop(table: dict[str, Any], key: str) -> None:
    """Transducers are right in this."""
    del table["virtual"]["faults"][key]


def add(table: dict[str, Any], file: str, key: str, value: Any) -> None:
    """Transducers err in this; InputError where there are none."""
    if "virtual" not in table:
        raise InputError(file, f"virtual.faults.{key}", None, f"needs a table [virtual], {WHY}")
    table["virtual"].setdefault("faults", {})[key] = value
