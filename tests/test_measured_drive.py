"""Handling along a measured steer angle and speed: the car that made the drive repeats it, and bad files are named."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from models.core.errors import InputError, RunFailed
from models.core.scene_file import parse_toml
from models.systems.handling.following import SPEED_TOLERANCE
from models.systems.handling.run import run
from models.systems.handling.scene import HandlingScene, build
from studies.four_wheel_drive import NOISE_DEVIATIONS

SCENES = Path(__file__).parents[1] / "studies" / "scenes"
MADE = SCENES / "single_track.csv"
FEW = {"duration": 2.0}


def scene(tyres: dict | None = None, run: dict | None = None, **changes: object) -> HandlingScene:
    """The shipped scene with changes of its manoeuvre."""
    table = parse_toml(SCENES / "measured_drive.toml")
    table["manoeuvres"]["measured"] |= changes
    table["tyres"] |= tyres or {}
    return build(table | {"run": run or {}}, "drive.toml", SCENES)


def test_car_that_made_the_drive_repeats_its_motion():
    """What is left is the noise of the sensors: nothing but steer angle and speed came from the file."""
    drive = run(scene(), "mujoco")
    columns = np.genfromtxt(MADE, delimiter=",", skip_header=1)[: len(drive.times[::20])]
    for name, column in (("yaw rate", 3), ("side slip", 5)):
        error = drive[name][::20] - columns[:, column]
        assert np.sqrt(np.mean(error**2)) < 1.15 * NOISE_DEVIATIONS[name]
    assert (
        np.sqrt(np.mean((drive["forward speed"][::20] - columns[:, 2]) ** 2))
        < 2.0 * SPEED_TOLERANCE * columns[:, 2].mean()
    )


def test_other_tyres_do_not_repeat_it():
    drive = run(scene({"cornering": [0.8, 1.0]}), "mujoco")
    columns = np.genfromtxt(MADE, delimiter=",", skip_header=1)[: len(drive.times[::20])]
    assert np.sqrt(np.mean((drive["yaw rate"][::20] - columns[:, 3]) ** 2)) > 2.0 * NOISE_DEVIATIONS["yaw rate"]


def test_engines_drive_alike():
    built = scene(**FEW)
    first, second = (run(built, engine) for engine in ("mujoco", "exudyn"))
    for name in ("positions", "rates"):
        assert np.abs(first[name] - second[name]).max() < 1e-10


def test_table_of_the_scene_builds_it_again():
    built = scene(**FEW)
    rebuilt = build(built.table(), "drive.toml", SCENES)
    assert rebuilt.table() == built.table()
    assert rebuilt.manoeuvres["measured"].duration == 2.0


def test_results_have_the_clock_of_the_file():
    drive = run(scene(stretch=[4.0, 5.0]), "mujoco")
    assert drive.times[0] == 4.0
    assert drive.times[-1] == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"steer": [[0.0, 0.0], [1.0, 0.1]]}, "steer: cannot go with a measured drive"),
        ({"brake": [[0.0, 0.0], [1.0, 9.0]]}, "brake: cannot go with a measured drive"),
        ({"speed": 3.0}, "the measured drive begins with 20 m/s"),
        ({"duration": 9.0}, "the measured drive lasts 8 s"),
        ({"stretch": [0.0, 99.0]}, "must rise and lie within the file's time"),
        ({"stretch": [5.0, 4.0]}, "must rise and lie within the file's time"),
        ({"measured": "nothing.csv"}, "no such file"),
        ({"run": {"step": 3e-3}}, "clock of manoeuvres.measured.measured"),
        ({"tyres": {"cornering": [1.0]}}, "a ratio for each of the 2 axles"),
    ],
)
def test_bad_input_is_named(changes: dict, told: str):
    with pytest.raises(InputError, match=told):
        scene(**changes).model_with_scene_controls("measured")


def test_manoeuvre_without_speed_is_refused():
    with pytest.raises(InputError, match="speed: is missing"):
        build({"title": "t", "system": "handling", "manoeuvres": {"turn": {}}}, "drive.toml")


def test_speed_that_no_tyre_can_give_is_refused():
    """On ice no torque slows the car as it was slowed on the dry road."""
    with pytest.raises(RunFailed):
        run(scene({"friction": 0.02}), "mujoco")


def test_no_scene_without_a_measured_drive_reads_measurements():
    code = (
        "import sys; from studies.command.asked import load_scene; from models.systems.handling.run import run;"
        "scene = load_scene('handling', None); run(scene.model_copy(), 'mujoco', 'brake_in_curve');"
        "print([m for m in ('models.measured.drive', 'models.systems.handling.following') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
