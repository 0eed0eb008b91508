"""Whatever a user gets wrong ends in one message and exit code 2, and touches nothing.

The table of wrong inputs is in ``bad_inputs.py``. ``python tests/test_bad_input.py`` prints every message.
"""

import itertools
import os
import pickle
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from bad_inputs import CUTS, FORCED, FREE, GOOD, GUIDED, ON_CRG, ON_CSV, ON_ROAD, OWN_SET, ROADS, TABLE, Bad
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from models.core.errors import InputError, Refused, RunFailed
from models.core.systems import SYSTEMS, load
from models.road.opencrg import write_opencrg
from models.road.study import study_road
from models.systems.pitch_plane.plan import check
from models.vehicles.pitch_plane import PitchPlaneParameters
from studies import command_line

JARGON = ("Traceback", "pydantic", "Input should", "dictionary", "validation error", "instance of", "NoneType")


@pytest.fixture(scope="session")
def road(tmp_path_factory):
    """Bytes of a sound OpenCRG road of 12 m."""
    path = tmp_path_factory.mktemp("road") / "road.crg"
    write_opencrg(study_road(), path, 12.0, 0.2)
    return path.read_bytes()


@pytest.fixture
def folder(tmp_path, monkeypatch, road):
    """A folder with good files and an earlier result, in which the command runs."""
    monkeypatch.chdir(tmp_path)
    furnish(tmp_path, road)
    return tmp_path


@pytest.fixture(scope="module")
def folder_of_good_files(tmp_path_factory, road):
    folder = tmp_path_factory.mktemp("fuzz")
    furnish(folder, road)
    return folder


def furnish(folder, road):
    (folder / "results" / "ride").mkdir(parents=True)
    (folder / "results" / "ride" / "mujoco.nc").write_bytes(b"an earlier result")
    for name, text in GOOD.items():
        (folder / name).write_text(text)
    (folder / "road.crg").write_bytes(road)


def command(*args):
    """Exit code of ``twinrig ARGS`` within this process."""
    with pytest.MonkeyPatch.context() as patch, pytest.raises(SystemExit) as ended:
        patch.setattr(sys, "argv", ["twinrig", *args])
        command_line.main()
    return ended.value.code


def tree(folder):
    """Every path below a folder with its bytes and the time of its last change."""
    files = sorted(folder.rglob("*"))
    return {path: (path.read_bytes() if path.is_file() else None, path.stat().st_mtime_ns) for path in files}


def prepare(case, folder):
    """Write the files of a case; returns what follows ``twinrig run``."""
    for name, content in {"ride.toml": case.scene, **case.files}.items():
        if content is None:
            (folder / name).unlink()
        else:
            (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    return case.args if case.args and case.args[0] != "--set" else ("ride.toml", *case.args)


@pytest.mark.parametrize("case", TABLE, ids=lambda case: case.id)
def test_a_mistake_is_one_message_and_touches_nothing(case, folder, capsys):
    args = prepare(case, folder)
    before = tree(folder)
    assert command("run", *args) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("twinrig: ") and said.err.count("\n") == 1
    assert not [word for word in JARGON if word in said.err]
    assert not [word for word in case.words if word not in said.err], said.err
    assert tree(folder) == before


@pytest.mark.parametrize("cut", CUTS)
def test_a_cut_road_file_is_refused(cut, folder, road, capsys):
    case = Bad("cut", ON_CRG, (), files={"road.crg": road[:cut]})
    args = prepare(case, folder)
    before = tree(folder)
    assert command("run", *args) == 2
    assert capsys.readouterr().err.startswith("twinrig: road.crg")
    assert tree(folder) == before


@pytest.mark.parametrize("scene", [FREE, FORCED, GUIDED, ON_ROAD, ON_CSV, ON_CRG, OWN_SET])
def test_the_scenes_of_the_table_are_sound_without_their_mistake(scene, folder, capsys):
    assert command("show", *prepare(Bad("none", scene, ()), folder)) == 0
    assert "refused" not in capsys.readouterr().out


def test_a_byte_order_mark_is_no_mistake(folder):
    assert command("show", *prepare(Bad("none", b"\xef\xbb\xbf" + FREE.encode(), ()), folder)) == 0


@pytest.mark.parametrize("case", [TABLE[0], ROADS[8]], ids=lambda case: case.id)
def test_the_installed_command_says_the_same(case, folder, capsys):
    """The console script itself, in a process of its own."""
    args = prepare(case, folder)
    before = tree(folder)
    code = "import sys; from studies.command_line import main; sys.argv[0] = 'twinrig'; main()"
    done = subprocess.run([sys.executable, "-c", code, "run", *args], capture_output=True, text=True, check=False)
    assert command("run", *args) == done.returncode == 2
    assert done.stderr == capsys.readouterr().err
    assert done.stdout == "" and tree(folder) == before


NASTY = [
    "nan",
    "inf",
    "-1",
    "0",
    "1e308",
    "1e-308",
    "-0.0",
    "true",
    '""',
    "[]",
    "{}",
    '"x"',
    "[[",
    "=",
    "\n",
    "\r",
    "#",
    "\x00",
    "\ufeff",
    "999999999999999999999",
    "1979-05-27",
    ".",
    ",",
    "'",
]
"""Pieces that readers stumble over."""


@st.composite
def mutations(draw, text):
    """The text after one to three changes: a token put in place of another, a line lost or doubled, a cut."""
    for _ in range(draw(st.integers(1, 3))):
        kind = draw(st.sampled_from(["token", "insert", "lose", "double", "cut"]))
        spans = [match.span() for match in re.finditer(r"[\w.\-]+|\S", text)] or [(0, 0)]
        start, end = draw(st.sampled_from(spans))
        piece = draw(st.sampled_from(NASTY) | st.text(max_size=3))
        lines = text.splitlines(keepends=True) or [""]
        row = draw(st.integers(0, len(lines) - 1))
        text = {
            "token": text[:start] + piece + text[end:],
            "insert": text[:start] + piece + text[start:],
            "lose": "".join(lines[:row] + lines[row + 1 :]),
            "double": "".join(lines[: row + 1] + lines[row:]),
            "cut": text[:end],
        }[kind]
    return text


FUZZ = settings(max_examples=150, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
FULL = (
    FREE.replace("[run]", "override = { m3 = 700.0, k3 = 1e5, d4 = 1e4, a = 1.0 }\n[run]\noutput_step = 0.002")
    + """
[start]
pitch = 0.1
[engines.exudyn]
integrator = "GeneralizedAlpha"
spectral_radius = 0.8
step = 0.0005
"""
)


def accepted_or_refused(path, *changes):
    """Read and check a scene as ``run`` does before it runs; an error that is not the user's passes through."""
    try:
        check(load(path, changes), SYSTEMS["pitch-plane"].engines)
    except InputError as error:
        assert str(error) and "\n" not in str(error)


@pytest.mark.parametrize("scene", [FREE, FORCED, GUIDED, ON_ROAD, ON_CSV], ids=lambda text: str(len(text)))
@FUZZ
@given(data=st.data())
def test_no_scene_text_ends_in_a_traceback(scene, data, folder_of_good_files):
    path = folder_of_good_files / "ride.toml"
    path.write_bytes(data.draw(mutations(FULL + scene[len(FREE) :])).encode("utf-8", "surrogatepass"))
    accepted_or_refused(path)


EXTREME = (1e308, 1e-308, 5e-324, 1e40, 1e15, 1e-15, 1e-20, -1, 0, 123456789012345678901234567890)


@pytest.mark.parametrize("scene", [FREE, GUIDED, ON_CSV], ids=["free", "guided", "csv"])
def test_no_number_ends_in_a_traceback(scene, folder):
    """Every number of a scene made huge or tiny: accepted or refused, without an overflow on the way."""
    (folder / "ride.toml").write_text(scene)
    parameters = [f"vehicle.override.{name}" for name in PitchPlaneParameters.model_fields]
    others = [
        "run.step",
        "run.duration",
        "run.output_step",
        "engines.exudyn.step",
        "effects.road.speed",
        "effects.road.run_in",
        "start.z3",
        "start.pitch_rate",
        "effects.pitch_spring.stiffness",
    ]
    for key, value in itertools.product([*parameters, *others], EXTREME):
        accepted_or_refused(folder / "ride.toml", f"{key}={value!r}")


@pytest.mark.parametrize("name", ["forces.csv", "pitch.csv", "road.csv", "mine.toml"])
@FUZZ
@given(data=st.data())
def test_no_file_ends_in_a_traceback(name, data, folder_of_good_files):
    scene = {"forces.csv": FORCED, "pitch.csv": GUIDED, "road.csv": ON_CSV, "mine.toml": OWN_SET}[name]
    (folder_of_good_files / "ride.toml").write_text(scene)
    (folder_of_good_files / name).write_bytes(data.draw(mutations(GOOD[name])).encode("utf-8", "surrogatepass"))
    accepted_or_refused(folder_of_good_files / "ride.toml")
    (folder_of_good_files / name).write_text(GOOD[name])


def read_aloud():
    """Print every message of the table."""
    with tempfile.TemporaryDirectory() as name:
        road = Path(name) / "road.crg"
        write_opencrg(study_road(), road, 12.0, 0.2)
        for i, case in enumerate([*TABLE, *(Bad(f"cut@{n}", ON_CRG, (), files={"road.crg": None}) for n in CUTS)]):
            folder = Path(name) / str(i)
            furnish(folder, road.read_bytes())
            os.chdir(folder)
            args = prepare(case, folder)
            if case.id.startswith("cut@"):
                (folder / "road.crg").write_bytes(road.read_bytes()[: int(case.id[4:])])
            print(f"[{case.id}] ", end="", flush=True)
            sys.stderr = sys.stdout
            if command("run", *args) != 2:
                print("^^^ NOT REFUSED")


if __name__ == "__main__":
    read_aloud()


@pytest.mark.parametrize(
    "error",
    [
        InputError("scene.toml", "run.step", 3.0, "must be smaller", ("step",)),
        Refused("exudyn", "has no such law", "scene.toml"),
        RunFailed("mujoco", "not finite", 1.5),
    ],
)
def test_errors_cross_the_border_of_a_process(error):
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error) and str(again) == str(error)
    assert vars(again) == vars(error)
