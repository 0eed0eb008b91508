"""A built wheel, installed in an environment of its own outside of the checkout: its files, its command, its scenes."""

import os
import subprocess
import sys
import sysconfig
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest

from studies.command.asked import SCENES_FOLDER
from validation.replay.jobs import SHORT_RUN_SETTINGS

ROOT = Path(__file__).parents[1]
PACKAGES = ("models", "studies", "validation", "twinrig")
LESS = tomllib.loads(SHORT_RUN_SETTINGS.read_text())
NAMES = sorted(path.stem for path in SCENES_FOLDER.glob("*.toml"))

pytestmark = pytest.mark.full


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", str(folder), str(ROOT)]
    subprocess.run(command, check=True)
    (file,) = folder.glob("twinrig-*.whl")
    return file


@pytest.fixture(scope="module")
def command(wheel, tmp_path_factory):
    """Function that runs ``twinrig ARGS`` of the installed wheel in a folder; packages that it needs are those here."""
    place = tmp_path_factory.mktemp("environment")
    venv.create(place)
    python = place / "bin" / "python"
    install = [sys.executable, "-m", "pip", "--python", python, "install", "-q", "--no-deps", str(wheel)]
    subprocess.run(install, check=True)
    paths = {"base": str(place), "platbase": str(place)}
    site = Path(sysconfig.get_path("purelib", vars=paths))
    (site / "needed.pth").write_text(f"{sysconfig.get_path('purelib')}\n")
    plain = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}

    def run(folder, *arguments, **more):
        return subprocess.run(
            [place / "bin" / "twinrig", *arguments], cwd=folder, env=plain | more, capture_output=True, text=True
        )

    return run


def test_the_wheel_has_every_file_of_the_packages(wheel):
    kept = subprocess.run(["git", "ls-files", *PACKAGES], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    with zipfile.ZipFile(wheel) as archive:
        packed = {name for name in archive.namelist() if name.split("/")[0] in PACKAGES}
    assert packed == set(kept.split())


def test_the_installed_command_is_that_of_the_wheel(command, tmp_path):
    listed = command(tmp_path, "list")
    assert listed.returncode == 0 and all(name in listed.stdout for name in NAMES)
    (tmp_path / "models.py").write_text("")
    hidden = command(tmp_path, "list", PYTHONPATH=str(tmp_path))
    assert hidden.returncode == 1 and hidden.stderr.startswith(f"twinrig: {tmp_path / 'models.py'} hides")


@pytest.mark.parametrize("name", NAMES)
def test_every_shipped_scene_runs(command, tmp_path, name):
    changes = [part for change in LESS.get(name, []) for part in ("--set", change)]
    done = command(tmp_path, "run", name, "--no-error", "--out", "out", *changes)
    assert done.returncode == 0, done.stderr
    assert len(list((tmp_path / "out").rglob("*"))) > 1 and "Traceback" not in done.stderr


@pytest.mark.parametrize("engine", ["mujoco", "exudyn"])
def test_a_vehicle_is_exported(command, tmp_path, engine):
    done = command(tmp_path, "export", "hub_forces", "--engine", engine)
    assert done.returncode == 0 and "left out" in done.stdout, done.stderr
