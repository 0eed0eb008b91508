"""Export of a scene's vehicle as a file of an engine: ``twinrig export``."""

from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from models.core.errors import InputError
from models.core.systems import SYSTEMS
from models.core.whole_files import write_whole
from models.engines.export import SUFFIXES, ExportedModel


def exported_vehicle(scene: Any, engine: str) -> ExportedModel:
    """Export of a scene's vehicle: text of the file, and lists of its contents and omissions. Raises InputError for an
    engine without a file format and for a system without an exportable vehicle."""
    if engine not in SUFFIXES:
        raise InputError("--engine", "", engine, "no engine that has files of its own", tuple(SUFFIXES))
    if scene.system not in _exportable_systems():
        allowed = "has no vehicle that an engine builds"
        raise InputError(scene.file, "system", scene.system, allowed, _exportable_systems())
    answer: ExportedModel = import_module(f"{SYSTEMS[scene.system].package}.export").exported(scene, engine)
    return answer


def _exportable_systems() -> tuple[str, ...]:
    """Systems whose vehicles can be exported: those with a module ``export``."""
    return tuple(name for name, system in SYSTEMS.items() if find_spec(f"{system.package}.export"))


def exported_file_path(scene: Any, engine: str, output_path: Path | None) -> Path:
    """Path of the exported file; raises InputError if it exists, has the wrong extension, or its folder does not
    exist."""
    suffix = SUFFIXES.get(engine, "")
    path = output_path or Path(f"{Path(scene.file).stem}_{engine}{suffix}")
    if path.suffix != suffix:
        raise InputError("--out", "", str(path), f"must end in {suffix} for {engine}")
    if path.exists():
        raise InputError("--out", "", str(path), "is there already, and nothing is overwritten: name another file")
    if not path.parent.is_dir():
        raise InputError("--out", "", str(path), "lies in a folder that does not exist")
    return path


def export(scene: Any, engine: str, output_path: Path | None) -> dict[str, Any]:
    """Write the exported file of a scene's vehicle; returns its path ("file"), and sentences on its contents ("has")
    and omissions ("left out")."""
    answer = exported_vehicle(scene, engine)
    path = exported_file_path(scene, engine, output_path)
    write_whole(path, answer.text)
    return {"file": str(path), "has": [*answer.has], "left out": [*answer.left_out]}


def export_lines(scene_title: str, export_record: dict[str, Any]) -> list[str]:
    """Lines for the screen: the scene's title, and the contents and omissions of the exported file."""
    path, left_out = export_record["file"], [f"    {text}" for text in export_record["left out"]]
    head = "  left out:" if left_out else "  leaves nothing out"
    opened = f"python -m mujoco.viewer --mjcf={path}" if path.endswith(SUFFIXES["mujoco"]) else f"python {path}"
    return [
        f"{scene_title}: {path}",
        f"  has {', '.join(export_record['has'])}",
        head,
        *left_out,
        f"  open it: {opened}",
    ]
