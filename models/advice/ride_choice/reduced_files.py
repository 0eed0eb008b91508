"""Files of the result of a choice of effects: a ride scene and a reduced vehicle, which can be run unchanged."""

import json
from pathlib import Path
from typing import Any

from models.core.scene_effects import table_without_defaults
from models.core.scene_file import parse_toml
from models.systems.ride.of_scene import CLOSED_FORM_STUDY
from models.systems.ride.reduced_scene import ReducedScene
from models.vehicles.vehicle_file import vehicle_path

SCENE_FILE_NAME, VEHICLE_FILE_NAME = "reduced.toml", "reduced_vehicle.toml"
QUESTION_KEYS = ("quantities", "tolerance", "options")
"""Keys of a scene that belong to the choice of effects, and are left out of the reduced scene."""


def write(reduced_scene: ReducedScene, output_folder: Path) -> Path:
    """Write the reduced scene and its vehicle into a folder; returns the path of the scene file."""
    scene = table_without_defaults(reduced_scene.ride_scene)
    vehicle_file = scene["vehicle"]["file"]
    vehicle = reduced_tables(parse_toml(vehicle_path(vehicle_file, reduced_scene.ride_scene.folder)), reduced_scene)
    origin = f"Reduced by a choice of effects; the whole vehicle is {vehicle_file}."
    notes = f"{vehicle.get('notes', '').strip()}\n{origin}".strip()
    with (output_folder / VEHICLE_FILE_NAME).open("x") as file:
        file.write(toml_text({**vehicle, "notes": notes}))
    table = {key: value for key, value in scene.items() if key not in QUESTION_KEYS and value != "auto"}
    road = dict(table.get("road", {}))
    if "file" in road:
        road["file"] = str(reduced_scene.ride_scene.path(road["file"], "road.file").resolve())
    changes = {
        "title": f"{reduced_scene.ride_scene.title}, less what was left out",
        "system": "ride",
        "study": CLOSED_FORM_STUDY,
        "vehicle": {**scene["vehicle"], "file": VEHICLE_FILE_NAME},
    }
    with (output_folder / SCENE_FILE_NAME).open("x") as file:
        file.write(toml_text({**table, **changes, **({"road": road} if road else {})}))
    return output_folder / SCENE_FILE_NAME


def reduced_tables(vehicle_table: dict[str, Any], reduced_scene: ReducedScene) -> dict[str, Any]:
    """The tables of the full vehicle without the bars and the tyre damping that are left out, and with the limits
    (massless, rigid, locked) that reduce it.
    """
    bars = {bar.name for bar in reduced_scene.vehicle.bars}
    undamped = {tyre.name for tyre in reduced_scene.vehicle.tyres if not tyre.damping}
    changed = dict(vehicle_table)
    if "anti_roll_bars" in vehicle_table:
        changed["anti_roll_bars"] = [bar for bar in vehicle_table["anti_roll_bars"] if bar["name"] in bars]
    changed["tyres"] = [
        {**tyre, "damping": 0.0} if tyre["name"] in undamped else tyre for tyre in vehicle_table["tyres"]
    ]
    limits = {
        "massless": sorted(reduced_scene.massless),
        "rigid": sorted(reduced_scene.rigid),
        "locked": [list(pair) for pair in sorted(reduced_scene.locked)],
    }
    reduced_limits = {key: names for key, names in limits.items() if names}
    return changed | ({"reduced": reduced_limits} if reduced_limits else {})


def toml_text(nested_table: dict[str, Any]) -> str:
    """Nested tables as the text of a TOML file: plain keys first, then a block for each table and each table of a
    list.
    """
    lines, blocks = list[str](), list[str]()
    for key, value in nested_table.items():
        if isinstance(value, dict) and not value:
            continue
        if isinstance(value, dict):
            blocks += ["", f"[{_key_text(key)}]", *_table_lines(value)]
        elif isinstance(value, list) and value and all(isinstance(entry, dict) for entry in value):
            for entry in value:
                blocks += ["", f"[[{_key_text(key)}]]", *_table_lines(entry)]
        else:
            lines.append(f"{_key_text(key)} = {_value_text(value)}")
    return "\n".join([*lines, *blocks]) + "\n"


def _table_lines(nested_table: dict[str, Any]) -> list[str]:
    return [f"{_key_text(key)} = {_value_text(value)}" for key, value in nested_table.items() if value is not None]


def _key_text(table_key: str) -> str:
    return (
        table_key
        if table_key.replace("_", "").replace("-", "").isalnum() and table_key.isascii()
        else json.dumps(table_key)
    )


def _value_text(table_value: Any) -> str:
    if isinstance(table_value, dict):
        return "{ " + ", ".join(_table_lines(table_value)) + " }" if table_value else "{}"
    if isinstance(table_value, list | tuple):
        return "[" + ", ".join(map(_value_text, table_value)) + "]"
    if isinstance(table_value, bool):
        return "true" if table_value else "false"
    return json.dumps(table_value) if isinstance(table_value, str) else repr(table_value)
