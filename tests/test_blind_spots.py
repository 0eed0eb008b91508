"""The blind-spot audit: it spoils what it names and nothing else, and tells what nothing independent notices."""

import ast
import json
import os
import subprocess
import sys

import numpy as np
import pytest
from numba import njit

from models.machine.records import record
from validation.blind_spots import planting
from validation.blind_spots.audit import STARTUP, Traced, line_of
from validation.blind_spots.rewriting import ROOT, NoSuchFunction, rewritten
from validation.blind_spots.shared import compiled_functions, shared_functions, shared_modules
from validation.blind_spots.spoiling import scaled, spoiled
from validation.blind_spots.table import Line, read, uncovered, write
from validation.report.blind_spots import blind_spots

SOURCE = '''"""A module."""
def law(x, found, room):
    part = found[1:]
    part[0] = 2.0 * x
    room = x
    if x < 0.0:
        return -x, 3
    return x, 3
def other(x):
    return x
'''


def line(name="models.a:f", rows="", tests="", independent="", ended="whole"):
    return Line(name, ended, 1, 0, rows, tests, independent, "abc")


def made(name):
    space = {}
    exec(compile(rewritten(SOURCE, "models.none", name), "a", "exec"), space)
    return space


def test_what_a_function_returns_and_writes_is_one_percent_off_and_counts_stay():
    space, found = made("law"), np.array([5.0, 0.0, 7.0])
    assert space["law"](1.5, found, None) == (1.01 * 1.5, 3)
    assert found.tolist() == [5.0, 1.01 * 3.0, 7.0]
    assert space["law"](-1.5, found, None) == (1.01 * 1.5, 3)
    assert space["other"](1.5) == 1.5


def test_an_unknown_function_is_an_error():
    with pytest.raises(NoSuchFunction, match="nothing"):
        rewritten(SOURCE, "models.none", "nothing")


def test_compiled_code_spoils_as_python_does():
    @njit
    def both(x, values):
        scaled(values)
        return spoiled((x, 2)), spoiled(values)

    values = np.array([0.5, 1.5])
    (number, count), array = both(0.3, values)
    assert (number, count) == (1.01 * 0.3, 2)
    assert values.tolist() == [1.01 * 0.5, 1.01 * 1.5]
    assert array == pytest.approx([1.01**2 * 0.5, 1.01**2 * 1.5], rel=1e-15)


def test_records_are_spoiled_field_by_field_in_python_and_in_compiled_code():
    first = np.array([(0.5, 1.5), (2.5, 3.0)], record("force", "moment"))
    second = first.copy()
    scaled(first)
    njit(lambda values: scaled(values))(second)
    assert first.tolist() == [(1.01 * 0.5, 1.01 * 1.5), (1.01 * 2.5, 3.0)]
    assert second.tolist() == [(1.01 * 0.5, 1.01 * 1.5), (1.01 * 2.5, 1.01 * 3.0)]


def test_whole_numbers_of_a_table_that_python_makes_stay_for_they_may_be_places():
    assert spoiled(np.array([2.0, 0.5])).tolist() == [2.0, 0.505]


@pytest.mark.parametrize(
    ("module", "name", "argument"),
    [("models.tyre.bristles", "tyre_forces", "found"), ("models.contact.fastsim_many", "forces_within", "answers")],
)
def test_an_argument_that_only_called_functions_fill_is_spoiled_at_the_end(module, name, argument):
    source = ROOT.joinpath(*module.split(".")).with_suffix(".py").read_text()
    assert f"_scaled_by_audit({argument})" in ast.unparse(rewritten(source, module, name))


def test_shared_by_rule_are_the_laws_and_not_what_only_one_engine_has():
    modules, compiled = shared_modules(), compiled_functions()
    assert {"models.tyre.bristles", "models.multibody.forces", "models.road.kernels"} <= set(modules)
    assert "models.brake.controllers.five_phase_cycle" in modules, "found by listing, imported by no one"
    assert not {"models.engines.mujoco", "models.engines.exudyn", "models.engines.spatial_mujoco_callback"} & set(
        modules
    )
    assert "models.tyre.bristles:tyre_forces" in compiled and len(compiled) > 200
    python = "models.tyre.bristles:shape_factor"
    assert python not in compiled and python in shared_functions([python, "models.core.errors:InputError"])


def process(spoiled_function, code):
    """What a new process prints, in which the function is spoiled."""
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(STARTUP), str(ROOT)]),
        planting.VARIABLE: json.dumps({"spoil": spoiled_function} if spoiled_function else {}),
    }
    return float(subprocess.check_output([sys.executable, "-c", code], env=environment, cwd=ROOT))


def test_machine_code_that_is_kept_is_not_taken_for_the_spoiled_function_nor_the_other_way_round():
    """``aspects`` calls a compiled function that calls ``aspect``; sound, spoiled, and sound again."""
    code = "import numpy as np; from models.contact.hertz import aspects; print(aspects(np.array([0.5]))[0][0])"
    sound, wrong, again = (process(name, code) for name in ("", "models.contact.hertz:aspect", ""))
    assert wrong == pytest.approx(1.01 * sound, rel=1e-14) and again == sound


def test_a_spoiled_function_is_noticed_by_the_rows_that_call_it():
    """Hertz' ellipse by Johnson's figures and a closed form; the sound run had no failed row."""
    name = "models.contact.hertz:_contact"
    case = {"case": "contact_hertz", "rows": [], "seconds": 1.0, "names": {name}}
    noticed = line_of(name, Traced({"contact_hertz": case}, {name}), "abc")
    assert (noticed.ended, noticed.calling, noticed.left) == ("whole", 1, 0)
    assert "contact_hertz.p0" in noticed.rows and "contact_hertz.p0" in noticed.independent


def test_a_function_that_nothing_calls_has_a_line_that_says_so():
    assert line_of("models.a:f", Traced({}, set()), "abc") == Line("models.a:f", "whole", 0, 0, "", "", "", "abc")


def test_what_nothing_independent_notices_is_not_covered_and_so_is_what_has_no_line():
    lines = [line("models.a:f", rows="x.y", independent="x.y"), line("models.a:g", rows="x.y"), line("models.a:h")]
    names = ["models.a:f", "models.a:g", "models.a:h", "models.a:new"]
    assert uncovered(lines, names) == {
        "noticed by nothing": ["models.a:h"],
        "noticed by nothing independent": ["models.a:g"],
        "not audited": ["models.a:new"],
    }


def test_a_function_that_numba_refuses_counts_as_not_covered():
    assert not line(rows="x.broken", independent="x.y", ended="not compiled").is_covered


def test_a_table_is_read_as_it_was_written(tmp_path):
    lines = [line("models.a:f", rows="x.y; x.z", independent="x.y"), line("models.a:g")]
    write(reversed(lines), tmp_path / "table.csv")
    assert read(tmp_path / "table.csv") == lines


def test_the_report_names_functions_of_the_sources_that_have_no_line(tmp_path):
    write([line("models.tyre.bristles:tyre_forces", rows="x.y", independent="x.y")], tmp_path / "table.csv")
    told = blind_spots(tmp_path / "table.csv")
    assert "models.tyre.bristles:_mix" in told["uncovered"]["not audited"]
    assert "models.tyre.bristles:tyre_forces" not in told["uncovered"]["not audited"]
    assert told["modules"] == [("models.tyre.bristles", 1, 1, 1)] and told["commits"] == ["abc"]


def test_a_page_names_what_the_kept_audit_says_is_not_covered():
    text = (ROOT / "docs" / "not_covered.md").read_text()
    lines = read()
    assert lines
    for names in uncovered(lines, [each.function for each in lines]).values():
        for name in names:
            assert f"`{name.replace('.<locals>', '')}`" in text
