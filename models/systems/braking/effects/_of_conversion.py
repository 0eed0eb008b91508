"""What the effects of sensors behind a port have in common: keys of [port.signals] and [port.pressures]."""

from typing import Any

NEEDS = ("port",)
NOISE, BITS, SCALE = ("noise", "seed"), ("bits", "range"), ("gain", "offset")
"""Keys of white noise, of the steps of a converter, and of a sensor that is not set right."""


def has(scene: Any, kind: str, keys: tuple[str, ...]) -> bool:
    """Whether any of these keys is other than a perfect sensor's."""
    if scene.port is None:
        return False
    own = getattr(scene.port, kind)
    return any(getattr(own, key) != type(own).model_fields[key].default for key in keys if key != "seed")


def drop(table: dict[str, Any], kind: str, keys: tuple[str, ...]) -> None:
    """A sensor without these."""
    for key in keys:
        table["port"][kind].pop(key, None)


def add(table: dict[str, Any], kind: str, values: dict[str, float]) -> None:
    """A sensor with these."""
    table.setdefault("port", {}).setdefault(kind, {}).update(values)
