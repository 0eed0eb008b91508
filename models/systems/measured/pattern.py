"""A virtual measurement as an engineer would have it: a file of the format named, and the scene that reads it."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from models.core.whole_files import write_whole
from models.measured.channel import BLOCK
from models.measured.formats import write
from models.measured.formats.writing import Group
from models.systems.measured.scene import MeasuredScene
from models.systems.measured.virtual import VirtualMeasurement, map_lines

BEGAN = datetime(2026, 1, 5, 8, 0, tzinfo=UTC)
"""When a virtual measurement began: the same in every one, so that it repeats bit for bit."""
COMMENT = "virtual measurement"


def write_pattern(scene: MeasuredScene, found: VirtualMeasurement, samples: np.ndarray, folder: Path) -> Path:
    """Write samples (n, signals), SI, as ``measured.EXTENSION`` in the file's units, and ``scene.toml`` beside it.

    Returns the scene's path. Raises InputError where a file exists or the format has no room for the channels.
    """
    assert scene.virtual is not None
    factors = np.array([signal.factor for signal in found.signals])
    blocks = (samples[i : i + BLOCK] / factors for i in range(0, len(samples), BLOCK))
    comments = tuple(f"{s.quantity} {s.component} at {s.at}, axes {s.frame}" for s in found.signals)
    group = Group(
        tuple(s.channel for s in found.signals),
        tuple(s.unit for s in found.signals),
        comments,
        found.period,
        len(samples),
        blocks,
    )
    file = write(folder / f"measured.{scene.virtual.format}", [group], BEGAN, f"{COMMENT}: {scene.title}")
    path = folder / "scene.toml"
    write_whole(path, _text(scene, found, file.name))
    return path


def _text(scene: MeasuredScene, found: VirtualMeasurement, file: str) -> str:
    """The scene without its table ``virtual``, with the file's map."""
    assert scene.virtual is not None
    own = scene.model_dump(exclude_unset=True, exclude={"virtual", "files", "sensors", "file", "folder", "options"})
    effects = own.pop("effects", {})
    plain = {key: value for key, value in own.items() if not isinstance(value, dict)}
    lines = [f"{key} = {_value(value)}" for key, value in plain.items()]
    for name, table in (own | {f"effects.{name}": table for name, table in effects.items()}).items():
        if isinstance(table, dict):
            lines += ["", f"[{name}]", *(f"{key} = {_value(value)}" for key, value in table.items())]
    for name, place in scene.virtual.accelerometers.items():
        lines += ["", f"[sensors.{_value(name)}]", f'body = "{found.vehicle.chassis}"', f"position = {place}"]
    return "\n".join([*lines, "", map_lines(found.signals, file)])


def _value(value: object) -> str:
    """A TOML value: text, number, truth or a list of these, whose notation is that of Python but for truth."""
    import json

    return json.dumps(value, ensure_ascii=False)
