"""What every shipped scene saves: netCDF files that say of which scene, version and machine they are."""

import json
import os
import tomllib
from pathlib import Path
from typing import Any

import pytest

from models.core.result import load_result
from studies.command.asked import SCENES_FOLDER, checked_study, load_scene, requested_engines
from validation.replay.jobs import SHORT_RUN_SETTINGS

LESS = tomllib.loads(SHORT_RUN_SETTINGS.read_text())
NAMES = sorted(path.stem for path in SCENES_FOLDER.glob("*.toml"))
OTHERS = ("animation", "choice", "choice_hub_forces", "choice_road", "choice_wheelset", "contact_price")
"""Films are no results, a choice saves the table of its questions, and a search takes half a minute."""


def saved_by_studies(name: str) -> list[Path]:
    """Results of a scene in the folder that TWINRIG_RESULTS names, where its study was run just before; else none."""
    return sorted((Path(os.environ["TWINRIG_RESULTS"]) / name).rglob("*.nc")) if "TWINRIG_RESULTS" in os.environ else []


def saved_by_short_run(scene: Any, folder: Path) -> list[Path]:
    """Results that the study of a scene leaves in a folder."""
    engines = requested_engines(getattr(getattr(scene, "run", None), "engine", None), scene.system)
    checked_study(scene, engines).run(scene, engines, folder, lambda text, part: None)
    return sorted(folder.rglob("*.nc"))


@pytest.mark.full
@pytest.mark.parametrize("name", [name for name in NAMES if name not in OTHERS])
def test_every_netcdf_is_a_result_of_its_scene(name: str, tmp_path: Path):
    scene = load_scene(name, LESS.get(name, []))
    saved = saved_by_studies(name) or saved_by_short_run(scene, tmp_path)
    assert saved, "a study leaves at least one result"
    for path in saved:
        said = load_result(path).data.attrs
        assert json.loads(said["scene_table"])["title"] == scene.title, path.name
        assert said["title"].startswith(scene.title), path.name  # what is added names the procedure
        assert json.loads(said["provenance"])["twinrig"], path.name
        assert said["system"] == scene.system and "counts" in said, path.name
