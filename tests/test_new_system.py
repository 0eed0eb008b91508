"""A new system is one folder: dropped in, it is listed, shown, run and refused like those that come with twinrig."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import models

ROOT = Path(models.__file__).parents[1]
FILES = {
    "__init__.py": '"""A mass that falls."""\n\nENGINES = ("reference",)\n',
    "scene.py": '''"""Scenes of a mass that falls."""

from typing import Literal

from models.core.scene_file import SceneFile, checked
from models.core.strict import quantity


class FallScene(SceneFile):
    """A scene."""

    system: Literal["falling-mass"] = "falling-mass"
    study: str = "falling"
    height: float = quantity("m", "at the start")
    effects: dict = {}


def build(table, file="", folder=None):
    """A checked scene."""
    return checked(FallScene, table, file, folder)
''',
    "plan.py": '''"""What a scene computes."""


def check(scene, engines):
    """Nothing is left to refuse."""


def describe(scene):
    """The plan."""
    return f"{scene.title}\\n  height     {scene.height:g} m"
''',
    "run.py": '''"""The run."""

import numpy as np

from models.core.result import Channel, result


def run(scene, engine):
    """Fall to the ground."""
    times = np.linspace(0.0, (2.0 * scene.height / 9.81) ** 0.5, 5)
    height = scene.height - 9.81 / 2.0 * times**2
    return result(
        scene,
        {"height": Channel("time", height, "m", "above the ground")},
        {"time": Channel("time", times, "s", "time")},
        engine=engine,
    )
''',
    "effects/__init__.py": '''"""Effects of falling: none comes with it."""

TABLE = {}
''',
}
STUDY = '''"""How long does a mass fall?"""

from models.systems import run as run_scene

SYSTEM = "falling-mass"


def run(scene, engines, folder, progress):
    """Run it, save it."""
    fall = run_scene(scene, engines[0])
    fall.save(folder / "fall.nc")
    last = float(fall["time"][-1])
    return {"scene": scene.title, "folder": str(folder), "failed": {}, "table": [f"  falls for {last:.3f} s"]}
'''
SCENE = 'title = "A stone"\nsystem = "falling-mass"\nheight = 20.0\n'


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the tree with one folder and its study more."""
    copy = tmp_path_factory.mktemp("tree")
    for name in ("models", "studies", "validation"):
        shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name, text in FILES.items():
        path = copy / "models" / "systems" / "falling_mass" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    (copy / "studies" / "falling.py").write_text(STUDY)
    (copy / "stone.toml").write_text(SCENE)
    return copy


def asked(tree: Path, *words: str) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "studies.command_line", *words]
    return subprocess.run(command, cwd=tree, capture_output=True, text=True, timeout=120, env={"PYTHONPATH": str(tree)})


def test_it_is_shown(tree):
    assert "height     20 m" in asked(tree, "show", "stone.toml").stdout


def test_it_runs_and_saves_a_result(tree):
    done = asked(tree, "run", "stone.toml", "--out", "out")
    assert done.returncode == 0, done.stderr
    assert "falls for 2.019 s" in done.stdout
    from models.core.result import load_result

    saved = load_result(tree / "out" / "fall.nc")
    assert json.loads(saved.data.attrs["scene_table"])["height"] == 20.0
    assert "commit" in json.loads(saved.data.attrs["provenance"])


def test_its_mistakes_are_answered(tree):
    done = asked(tree, "run", "stone.toml", "--set", "height=-1.0")
    assert done.returncode == 2 and "height" in done.stderr


def test_a_wrong_name_lists_it(tree):
    done = asked(tree, "run", "stone.toml", "--set", "system=falling")
    assert done.returncode == 2 and "falling-mass" in done.stderr
