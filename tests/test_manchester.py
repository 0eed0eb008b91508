"""The study of a wheelset held on its rails: files, table, figure, and what it refuses."""

import json
from pathlib import Path

import numpy as np
import pytest

from models.core.errors import RunFailed
from models.core.result import load_result
from validation.contact.manchester_references import contact_of, first_touch

pytestmark = pytest.mark.usefixtures("empty_folder")


def refused(twinrig, capsys, *changes):
    """What is said of a scene that cannot be run."""
    assert twinrig("run", "manchester", *(part for change in changes for part in ("--set", change))) == 2
    return capsys.readouterr().err


def test_study_saves_patches_of_both_wheels_and_a_figure(twinrig, capsys):
    changes = ("positions.start=5e-3", "positions.count=1", "cases={A-1={}}")
    args = [part for change in changes for part in ("--set", change)]
    assert twinrig("run", "manchester", *args, "--out", "out", "--json") == 0
    (found,) = json.loads(capsys.readouterr().out)["answer"]["A-1"]
    names = {path.name for path in Path("out").iterdir()}
    assert names == {"command.txt", "A-1.csv", "A-1.nc", "A-1_right.csv", "A-1_left.csv", "manchester.png"}
    assert (len(found["right"]), len(found["left"])) == (2, 1)
    right = np.genfromtxt("out/A-1_right.csv", delimiter=",", skip_header=1)
    heads = Path("out/A-1_right.csv").read_text().splitlines()[0].split(",")
    assert right[:, heads.index("normal [kN]")].tolist() == [patch["normal"] for patch in found["right"]]
    saved = load_result(Path("out/A-1.nc")).data
    assert saved["normal"].sel(wheel="right").values.ravel().tolist() == [patch["normal"] for patch in found["right"]]
    assert np.isnan(saved["normal"].values[0, 1, 1])  # the left wheel has one patch
    # Without friction the vertical parts of the forces are the load; the angle is that at the centre, not of the patch.
    upright = sum(patch["normal"] * np.cos(np.radians(patch["touch_angle"])) for patch in found["right"])
    assert upright == pytest.approx(10.0, rel=1e-5)


def test_what_cannot_be_is_told_in_one_sentence(twinrig, capsys):
    assert "no such file" in refused(twinrig, capsys, "profiles.wheel=missing.prw")
    Path("rail.prr").write_text("0 0\n")
    assert "file of a rail" in refused(twinrig, capsys, "profiles.wheel=rail.prr")
    assert "wheelset.load = -1.0: must be above 0" in refused(twinrig, capsys, "wheelset.load=-1.0")
    assert "positions.stop = 10.0: must be from -0.03 to 0.03 m" in refused(twinrig, capsys, "positions.stop=10.0")
    assert "rad for each metre" in refused(twinrig, capsys, "cases={A={yaw=24.0}}")


def test_position_that_fails_is_named(twinrig, capsys):
    changes = ("wheelset.load=4e5", "positions.start=6.5e-3", "positions.count=1", "cases={A={}}")
    args = [part for change in changes for part in ("--set", change)]
    assert twinrig("run", "manchester", *args) == 1
    assert "A, 6.5 mm  FAILED: a load of 400000 N presses" in capsys.readouterr().out


def test_wheel_that_has_climbed_its_flange_is_told():
    with pytest.raises(RunFailed, match="right wheel has climbed its flange"):
        contact_of("A-1").at(18e-3)


def test_search_finds_the_places():
    contact = contact_of("A-1")
    placed = contact.at(6.5e-3, 0.0156)  # the yaw moves the flange's place 17 mm ahead
    for sign, (place,) in ((1.0, placed.right), (-1.0, placed.left)):
        y, u, angle = first_touch(contact.side, placed, sign, place.wheel_y + 1e-3)
        # Straight pieces of 0.1 mm and the last grid of 0.05 mm leave some hundredths.
        assert (y, u) == pytest.approx((place.touch_y, place.wheel_y), abs=1e-4)
        assert angle == pytest.approx(place.angle, abs=0.02)
