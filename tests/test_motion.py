"""The study of motion from accelerometers: virtual readings, a user's file, and what it refuses."""

import numpy as np
import pytest

from models.core.errors import InputError
from models.core.systems import load
from studies.command.asked import SCENES_FOLDER
from studies.motion import run

SHORT = [
    "run.duration=2.5",
    "effects.accelerometers.sampling_rate=200.0",
    "effects.gyro.sampling_rate=200.0",
    "options.turning_cut_off=0.5",
    "options.position_cut_off=0.5",
]
CLEAN = [*SHORT, "effects.accelerometers.deviation=0.0"]


def ran(changes, folder, engines=("reference",), file=None):
    scene = load(SCENES_FOLDER / "motion.toml", changes)
    own = scene.model_copy(update={"folder": str(file or scene.folder)})
    return run(own, engines, folder, lambda text, part: None)


def test_the_loose_sensor_is_left_out_and_the_rest_recovers_the_motion(tmp_path):
    found = ran(SHORT, tmp_path, ("reference", "mujoco"))
    for row in found["rows"]:
        assert row["rigid"] is False and row["suspect"] == "battery" and row["share"] > 0.1
        # 0.02 m/s^2 at 200 Hz: 0.02 * 0.56 / m * sqrt(3 s * 5 ms) = 1.4 mrad/s in the rate after 3 s
        assert row["ways"]["integrated"]["rate"][0] < 5e-3
        assert row["ways"]["rates held by w w^T"]["rate"][0] < 5e-3
        # four standard deviations of the gyro's samples; summed over 2.5 s at 200 Hz: 0.2 mrad
        assert row["ways"]["rates from the gyro"]["rate"][0] < 1e-2
        assert row["ways"]["rates from the gyro"]["pitch"][0] < 1e-3
        # 20 m/s over the first hill: slow pitch of some hundredths that the filter takes away
        assert row["ways"]["high-passed"]["pitch"][0] > 0.01
    assert "'battery' does not move" in "\n".join(found["table"])
    assert {"motion.png", "table.txt", "reference readings.csv", "mujoco, integrated.csv", "mujoco motion.nc"} <= {
        path.name for path in tmp_path.iterdir()
    }


def test_clean_rigid_sensors_recover_it_to_the_integration(tmp_path):
    rigid = [
        *CLEAN,
        "effects.accelerometers.sensors.battery={x = 0.6, y = 0.3, z = 0.0}",
        "effects.accelerometers.sampling_rate=1000.0",
    ]
    (row,) = ran(rigid, tmp_path)["rows"]
    assert row["rigid"] and row["suspect"] == "" and row["share"] < 1e-14
    # kinks of the road's start and fast poles at 1 kHz; order 4 elsewhere
    assert row["ways"]["integrated"]["pitch"][0] < 1e-6 and row["ways"]["integrated"]["heave"][0] < 1e-5
    assert "rates held by w w^T" not in row["ways"]


def test_a_users_file_takes_the_place_of_the_runs(tmp_path):
    ran(CLEAN, tmp_path)
    (tmp_path / "mine.csv").write_bytes((tmp_path / "reference readings.csv").read_bytes())
    again = tmp_path / "again"
    again.mkdir()
    (row,) = ran([*CLEAN, "options.file=mine.csv"], again, ("reference", "mujoco"), file=tmp_path)["rows"]
    assert row["source"] == "mine.csv" and row["suspect"] == "battery"
    # the file says nothing of the start: at rest and level, as this run begins but for the static pitch of 0
    one, other = (
        np.loadtxt(folder / name, delimiter=",", skiprows=1)[:, 1:3]
        for folder, name in ((tmp_path, "reference, integrated.csv"), (again, "mine, integrated.csv"))
    )
    assert np.abs(one - other).max() < 1e-12


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("options.turning_cut_off=0.01", "options.turning_cut_off.*shorter than one period"),
        ("options.position_cut_off=200.0", "options.position_cut_off.*between 0 and 100 Hz"),
        ("effects.accelerometers.sensors={a = {x = 1.0, z = 0.0}, b = {x = 2.0, z = 0.0}}", "sensors.*at least three"),
        ("effects.accelerometers.sensors={a={x=1.0,z=0.0},b={x=2.0,z=0.0},c={x=3.0,z=0.0}}", "sensors.*on a line"),
        ("options.file=none.csv", "options.file.*no such file"),
        ("options.zeroed=true", "options.zeroed.*of your own"),
        ("run.output_step=5e-3", "run.output_step.*drop this key"),
        ("options.speed=3.0", "unknown key"),
    ],
)
def test_what_cannot_be_used_is_refused_before_anything_is_written(change, words, tmp_path):
    with pytest.raises(InputError, match=words):
        ran([*SHORT, change], tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_scene_without_accelerometers_is_refused(tmp_path):
    scene = load(SCENES_FOLDER / "study_road.toml", ["study=motion"])
    with pytest.raises(InputError, match=r"effects\.accelerometers"):
        run(scene, ("reference",), tmp_path, lambda text, part: None)
