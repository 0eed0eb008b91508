"""The blind-spot audit: it spoils what it names and nothing else, and tells what nothing independent notices."""

import ast
import json
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numba import njit

import validation.blind_spots.compiled_spoiling  # noqa: F401  makes numba know what is spoiled
from docs import not_covered
from models.core.errors import InputError, RunFailed
from models.core.result import Channel, result
from models.core.systems import DEFAULT_SYSTEM, SYSTEMS
from models.machine.records import record
from studies.command_line import validate
from validation.blind_spots import memory, probe
from validation.blind_spots.audit import (
    FUNCTIONS,
    TRACE,
    FaultChecks,
    FaultFreeTrace,
    Job,
    WorkerPool,
    audit_of,
    jobs,
    logged_lines,
    save_functions,
    worker_environment,
)
from validation.blind_spots.probe import JobLog
from validation.blind_spots.rewriting import (
    ROOT,
    NoSuchFunction,
    argument_of_names,
    function_definition,
    rewritten_module,
    root_argument,
    source_text,
)
from validation.blind_spots.shared import (
    candidate_functions,
    compiled_functions,
    function_definitions,
    shared_functions,
    shared_modules,
)
from validation.blind_spots.sides import engines_of_functions, prepared_scene, runs_to_trace
from validation.blind_spots.spoiling import scaled, spoiled
from validation.blind_spots.table import (
    WHY_HARMLESS,
    Line,
    harmless_functions,
    kind_of,
    merged_lines,
    read_table,
    uncovered_functions,
    write_table,
)
from validation.report.blind_spots import blind_spots

PLACE = 3
"""Of the function that is spoiled within this process."""
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


@pytest.fixture
def fault():
    """Function that sets the fault of the place, which has none after the test."""
    yield lambda value: memory.FAULTS.__setitem__(PLACE, value)
    memory.FAULTS[PLACE] = 0.0
    memory.clear_marks()


def made(names):
    space = {}
    exec(compile(rewritten_module(SOURCE, "models.none", names), "a", "exec"), space)
    return space


def test_what_a_function_returns_and_writes_is_one_percent_off_and_counts_stay(fault):
    space, found = made({"law": PLACE, "other": PLACE + 1}), np.array([5.0, 0.0, 7.0])
    fault(0.01)
    assert space["law"](1.5, found, None) == (1.01 * 1.5, 3)
    assert found.tolist() == [5.0, 1.01 * 3.0, 7.0]
    assert space["law"](-1.5, found, None) == (1.01 * 1.5, 3)
    assert space["other"](1.5) == 1.5


def test_a_function_without_a_fault_gives_what_it_is_given_itself_and_is_marked():
    values = np.array([0.5, 1.5])
    assert made({"other": PLACE})["other"](values) is values
    assert made({"other": PLACE + 1})["other"]("text") == "text"
    assert memory.nonzero_functions(memory.FUNCTIONS_THAT_RAN) == [PLACE, PLACE + 1] and memory.nonzero_functions(
        memory.FUNCTIONS_WITH_NUMBERS
    ) == [PLACE]
    memory.clear_marks()
    assert not memory.nonzero_functions(memory.FUNCTIONS_THAT_RAN) and not memory.nonzero_functions(
        memory.FUNCTIONS_WITH_NUMBERS
    )


def test_a_labelled_result_is_off_in_its_channels_and_keeps_its_labels_and_what_it_hands_on(fault):
    path = np.array([2.5])
    given = result(
        SimpleNamespace(title="t", file="", system="handling", table=dict, provenance=dict),
        {"x": Channel("time", np.array([0.5, 1.5]), "m", "place")},
        {"time": Channel("time", np.array([0.25, 0.75]), "s", "time")},
        engine="none",
        counts={},
        seconds=0.0,
        detail=SimpleNamespace(path=path),
    )
    fault(0.01)
    off = made({"other": PLACE})["other"](given)
    assert off["x"].tolist() == [1.01 * 0.5, 1.01 * 1.5] and off.times.tolist() == [0.25, 0.75]
    assert off.data["x"].attrs == given.data["x"].attrs and off.data.attrs == given.data.attrs
    assert off.detail.path is path and given["x"].tolist() == [0.5, 1.5]
    assert made({"other": PLACE})["other"]({"a": 0.5, "b": 2}) == {"a": 1.01 * 0.5, "b": 2}
    assert memory.nonzero_functions(memory.FUNCTIONS_WITH_NUMBERS) == [PLACE]


def test_an_object_that_only_hands_on_others_has_no_number_of_its_own():
    handed = replace(line(), function=line())
    assert made({"other": PLACE})["other"](handed) is handed
    assert memory.nonzero_functions(memory.FUNCTIONS_THAT_RAN) == [PLACE] and not memory.nonzero_functions(
        memory.FUNCTIONS_WITH_NUMBERS
    )
    memory.clear_marks()


def test_an_unknown_function_is_an_error():
    with pytest.raises(NoSuchFunction, match="nothing"):
        rewritten_module(SOURCE, "models.none", {"nothing": PLACE})


def test_nothing_stands_before_what_a_module_takes_from_the_future():
    source = '"""A module."""\nfrom __future__ import annotations\n' + SOURCE.partition("\n")[2]
    compile(rewritten_module(source, "models.none", {"law": PLACE}), "a", "exec")


def test_functions_that_call_each_other_are_rewritten():
    module = "models.contact.accuracy"
    names = {name: PLACE for name, _ in function_definitions(module)}
    assert "_spoiled_by_audit" in ast.unparse(rewritten_module(source_text(module), module, names))


def test_compiled_code_takes_a_fault_as_it_runs_and_compiles_nothing_for_it(fault):
    @njit
    def both(x, values):
        scaled(values, PLACE)
        return spoiled((x, 2), PLACE), spoiled(values, PLACE)

    values = np.array([0.5, 1.5])
    (number, count), array = both(0.3, values)
    assert (number, count, values.tolist(), array.tolist()) == (0.3, 2, [0.5, 1.5], [0.5, 1.5])
    assert (
        memory.nonzero_functions(memory.FUNCTIONS_THAT_RAN)
        == memory.nonzero_functions(memory.FUNCTIONS_WITH_NUMBERS)
        == [PLACE]
    )
    fault(0.01)
    (number, count), array = both(0.3, values)
    assert (number, count) == (1.01 * 0.3, 2)
    assert values.tolist() == [1.01 * 0.5, 1.01 * 1.5]
    assert array == pytest.approx([1.01**2 * 0.5, 1.01**2 * 1.5], rel=1e-15)
    assert len(both.signatures) == 1


def test_compiled_code_that_gives_no_number_is_marked_as_having_run():
    assert njit(lambda count: spoiled(count, PLACE))(3) == 3
    assert memory.nonzero_functions(memory.FUNCTIONS_THAT_RAN) == [PLACE] and not memory.nonzero_functions(
        memory.FUNCTIONS_WITH_NUMBERS
    )
    memory.clear_marks()


def test_records_are_spoiled_field_by_field_in_python_and_in_compiled_code(fault):
    fault(0.01)
    first = np.array([(0.5, 1.5), (2.5, 3.0)], record("force", "moment"))
    second = first.copy()
    scaled(first, PLACE)
    njit(lambda values: scaled(values, PLACE))(second)
    assert first.tolist() == [(1.01 * 0.5, 1.01 * 1.5), (1.01 * 2.5, 3.0)]
    assert second.tolist() == [(1.01 * 0.5, 1.01 * 1.5), (1.01 * 2.5, 1.01 * 3.0)]


def test_whole_numbers_of_a_table_that_python_makes_stay_for_they_may_be_places(fault):
    fault(0.01)
    assert spoiled(np.array([2.0, 0.5]), PLACE).tolist() == [2.0, 0.505]


@pytest.mark.parametrize(
    ("module", "name", "argument"),
    [
        ("models.tyre.bristles", "tyre_forces", "forces_out"),
        ("models.contact.fastsim_many", "fill_contact_forces_in_place", "forces_out"),
    ],
)
def test_an_argument_that_only_called_functions_fill_is_spoiled_at_the_end(module, name, argument):
    source = ROOT.joinpath(*module.split(".")).with_suffix(".py").read_text()
    assert f"_scaled_by_audit({argument}, {PLACE})" in ast.unparse(rewritten_module(source, module, {name: PLACE}))


def test_an_array_that_a_function_sees_behind_a_pointer_is_spoiled_at_the_end():
    """Once: neither what it is cleared with nor what is handed on is."""
    for module in ("models.multibody.cut_kernel", "models.rail.joint_forces"):
        function = function_definition(
            rewritten_module(source_text(module), module, {"set_joint_forces": PLACE}), "set_joint_forces"
        )
        assert ast.unparse(function.body[-1]) == f"_scaled_by_audit(array(f, (coordinate_count,)), {PLACE})"
        assert ast.unparse(function).count("_spoiled_by_audit") == 0


def test_shared_by_rule_are_the_laws_and_not_what_only_one_engine_has():
    modules, compiled = shared_modules(), compiled_functions()
    assert {"models.tyre.bristles", "models.multibody.forces", "models.road.kernels"} <= set(modules)
    assert "models.brake.controllers.five_phase_cycle" in modules, "found by listing, imported by no one"
    assert not {"models.engines.mujoco", "models.engines.exudyn", "models.engines.spatial_mujoco_callback"} & set(
        modules
    )
    assert "models.tyre.bristles:tyre_forces" in compiled and len(compiled) > 200
    python = "models.tyre.bristles:cornering_stiffness_factor"
    assert python not in compiled and python in shared_functions([python, "models.core.errors:InputError"])
    assert python not in shared_functions([])


def test_a_function_of_python_is_shared_where_several_engines_call_it_in_one_scene():
    traced = [
        {"run": ["a.toml", "exudyn"], "numbers": {"models.a:both", "models.a:first", "models.a:apart"}},
        {"run": ["a.toml", "mujoco"], "numbers": {"models.a:both"}},
        {"run": ["b.toml", "mujoco"], "numbers": {"models.a:apart", "models.a:both"}},
        {"run": ["b.toml", "reference"], "numbers": {"models.a:both"}},
    ]
    traced += [
        {"run": ["a.toml", engine], "numbers": {"models.a.assumptions:judge"}} for engine in ("mujoco", "exudyn")
    ]
    engines = engines_of_functions(traced)
    assert engines == {"models.a:both": ("exudyn", "mujoco", "reference")}
    assert kind_of("models.a:both", engines) == "Python exudyn mujoco reference"
    assert kind_of("models.tyre.bristles:tyre_forces", engines) == "compiled"


def test_sides_are_runs_of_scenes_of_every_system_that_has_several_engines():
    systems = {getattr(prepared_scene(scene), "system", DEFAULT_SYSTEM) for scene, _ in runs_to_trace()}
    assert systems == {name for name, system in SYSTEMS.items() if len(system.engines) > 1}
    traces = [job.trace_file for job in (*jobs(False), *(Job([], [], [run]) for run in runs_to_trace()))]
    assert len({*traces}) == len(traces), "a trace of its own for each"


def test_a_side_has_what_runs_after_its_scene_is_read_and_nothing_of_a_run_that_fails(tmp_path, monkeypatch):
    def mark(place, value):
        memory.FUNCTIONS_WITH_NUMBERS[place] = 1.0
        if value == "none":
            raise RunFailed("none", "stopped", 0.0)
        return value

    told = JobLog({"out": tmp_path / "told.jsonl", "sound": [], "budgets": [9.0, 9.0]})
    monkeypatch.setattr(probe, "prepared_scene", lambda scene: mark(1, scene))
    monkeypatch.setattr("models.systems.run", lambda scene, engine: mark(2, engine))
    for engine in ("exudyn", "none"):
        probe.run_scene("a.toml", engine, told)
    (line,) = logged_lines(tmp_path / "told.jsonl")
    assert (line["run"], line["numbers"]) == (["a.toml", "exudyn"], [2])
    memory.clear_marks()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Folder of an audit, whose machine code the tests share."""
    place = tmp_path_factory.mktemp("audit")
    save_functions(place)
    return place


def process(folder, faults, code):
    """What a new process prints, in which functions have faults."""
    doubles = folder / "memory"
    shared = memory.shared_rows(doubles)[0]
    for place in range(len(candidate_functions())):
        shared[place] = faults.get(candidate_functions()[place], 0.0)
    return float(
        subprocess.check_output([sys.executable, "-c", code], env=worker_environment(folder, doubles), cwd=ROOT)
    )


def test_machine_code_that_is_kept_takes_the_fault_of_each_process(folder):
    """``axis_ratios_and_integrals`` calls a compiled function; sound, spoiled, and sound again."""
    code = (
        "import numpy as np; from models.contact.hertz import axis_ratios_and_integrals as ratios; "
        "print(ratios(np.array([0.5]))[0][0])"
    )
    sound, wrong, again = (
        process(folder, {"models.contact.hertz:axis_ratio_and_integrals": fault}, code) for fault in (0.0, 0.01, 0.0)
    )
    assert wrong == pytest.approx(1.01 * sound, rel=1e-14) and again == sound


@pytest.fixture(scope="module")
def probes(folder):
    """A process of an audit."""
    with WorkerPool(folder, worker_count=1) as started:
        yield started


def audited_line(probes, name, **case):
    """What is told of a function that one case runs, which has independent rows."""
    rows = [{"id": "contact_hertz.p0", "status": "passed", "independence": "closed form"}]
    item = {"case": "contact_hertz", "rows": rows, "seconds": 1.0, "ran": {name}, "numbers": {name}}
    return FaultChecks(
        probes, FaultFreeTrace(candidate_functions(), {"contact_hertz": item | case}), True, {}
    ).audited_line(name)


def test_a_spoiled_function_is_noticed_by_the_rows_that_call_it(probes):
    """Hertz' ellipse by Johnson's figures and a closed form; the sound run had no failed row."""
    name = "models.contact.hertz:_hertz_contact"
    noticed = audited_line(probes, name)
    assert (noticed.ended, noticed.calling, noticed.left) == ("whole", 1, 0)
    assert "contact_hertz.p0" in noticed.rows and "contact_hertz.p0" in noticed.independent


def test_a_row_that_fails_without_a_fault_notices_nothing(probes):
    name = "models.contact.hertz:_hertz_contact"
    rows = [{"id": "contact_hertz.p0", "status": "failed", "independence": "closed form"}]
    noticed = audited_line(probes, name, rows=rows)
    assert noticed.rows and "contact_hertz.p0" not in noticed.rows.split("; ")


def test_a_function_that_gives_no_number_has_a_line_that_says_so(probes):
    name = "models.contact.hertz:_hertz_contact"
    for case, ended in (({"numbers": set()}, "no numbers"), ({"numbers": set(), "ran": set()}, "not run")):
        line = audited_line(probes, name, **case)
        assert (line.ended, line.calling, line.left, line.rows) == (ended, 0, 0, "")


def test_a_folder_of_other_functions_is_refused(folder, tmp_path):
    (tmp_path / TRACE).mkdir()
    (tmp_path / FUNCTIONS).write_text(json.dumps(["models.a:f"]))
    with pytest.raises(InputError, match=FUNCTIONS):
        save_functions(tmp_path)


def test_judges_and_all_others_make_one_line():
    judges, others = line("models.a:f", rows="x.y"), line("models.a:f", rows="x.z", tests="t")
    assert judges.joined_with(others) == Line("models.a:f", "whole", 2, 0, "x.y; x.z", "t", "", "abc")
    assert line(ended="not run").joined_with(others).ended == "whole"


def test_what_nothing_independent_notices_is_not_covered_and_so_is_what_has_no_line():
    lines = [line("models.a:f", rows="x.y", independent="x.y"), line("models.a:g", rows="x.y"), line("models.a:h")]
    names = ["models.a:f", "models.a:g", "models.a:h", "models.a:new"]
    assert uncovered_functions(lines, names) == {
        "noticed by nothing": ["models.a:h"],
        "noticed by nothing independent": ["models.a:g"],
        "not audited": ["models.a:new"],
    }


def test_what_nothing_runs_is_told_and_what_gives_no_number_needs_none():
    lines = [line("models.a:f", ended="not run"), line("models.a:g", ended="no numbers")]
    assert uncovered_functions(lines, ["models.a:f", "models.a:g"]) == {"run by nothing": ["models.a:f"]}


def test_functions_whose_faults_change_no_value_are_told_apart_and_their_proofs_are_there():
    for name, (why, proof) in harmless_functions().items():
        assert uncovered_functions([], [name]) == {why: [name]} and why in WHY_HARMLESS
        file, _, test = proof.partition("::")
        assert name in candidate_functions() and f"def {test}(" in (ROOT / file).read_text(), proof


VIEWS = [name for name, (why, _) in harmless_functions().items() if why == WHY_HARMLESS[1]]
STATUSES = ("call_at_address", "solve_contact", "solve_simplified")
"""Functions that return whole numbers: how a contact ended."""


def is_no_number(node, given):
    """Whether an expression is a view of an argument, a new array that is written over, 0, not a number or a status."""
    if isinstance(node, ast.Call):
        name = getattr(node.func, "attr", getattr(node.func, "id", ""))
        if name == "view":
            return is_no_number(node.func.value, given)
        if name == "full":
            return is_no_number(node.args[1], given)
        return name in ("empty", "zeros", *STATUSES) or (
            name[0].isupper() and all(is_no_number(each, given) for each in node.args)
        )
    if isinstance(node, ast.Tuple):
        return all(is_no_number(each, given) for each in node.elts)
    if isinstance(node, ast.IfExp):
        return is_no_number(node.body, given) and is_no_number(node.orelse, given)
    is_zero = isinstance(node, ast.Constant) and node.value == 0.0
    is_status = isinstance(node, ast.Name) and (node.id.isupper() or node.id == "status")
    return is_zero or is_status or ast.unparse(node) in ("math.nan", "np.nan") or root_argument(node, given) != ""


@pytest.mark.parametrize("name", VIEWS)
def test_a_function_that_hands_on_views_has_no_number_of_its_own(name):
    module, _, function = name.partition(":")
    parsed = function_definition(ast.parse(source_text(module)), function)
    given, values = argument_of_names(parsed), [each.value for each in ast.walk(parsed) if isinstance(each, ast.Return)]
    for node in ast.walk(parsed):
        if isinstance(node, ast.Assign) and any(
            isinstance(each, ast.Subscript | ast.Attribute) for each in node.targets
        ):
            values.append(node.value)
    assert all(is_no_number(each, given) for each in values)


def test_lines_of_some_functions_take_the_place_of_the_kept_ones_and_lines_of_none_go():
    kept, new = [line("models.a:f"), line("models.a:g"), line("models.a:gone")], line("models.a:g", rows="x.y")
    functions = ["models.a:f", "models.a:g", "models.a:h"]
    assert merged_lines(kept, [new], functions) == [kept[0], new]
    unknown = [line(name, ended="not audited") for name in ("models.a:h", "models.a:f")]
    assert merged_lines(kept, unknown, functions) == [kept[0], kept[1], unknown[0]]


def test_an_audit_of_functions_that_there_are_none_of_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"--only = 'models.tyres\.\*'"):
        audit_of("models.tyres.*", tmp_path, lambda *_: None)
    with pytest.raises(InputError, match="test_nothing"):
        audit_of("*", tmp_path, lambda *_: None, check_pattern="tests/test_nothing.py")
    with pytest.raises(InputError, match="goes with --blind-spots"):
        validate(only="models.tyre.*")


def test_a_table_is_read_as_it_was_written(tmp_path):
    lines = [line("models.a:f", rows="x.y; x.z", independent="x.y"), line("models.a:g")]
    write_table(reversed(lines), tmp_path / "table.csv")
    assert read_table(tmp_path / "table.csv") == lines


def test_the_report_names_functions_of_the_sources_that_have_no_line(tmp_path):
    write_table([line("models.tyre.bristles:tyre_forces", rows="x.y", independent="x.y")], tmp_path / "table.csv")
    told = blind_spots(tmp_path / "table.csv")
    assert "models.tyre.bristles:_blend_directions" in told["uncovered"]["not audited"]
    assert "models.tyre.bristles:tyre_forces" not in told["uncovered"]["not audited"]
    assert told["modules"] == [("models.tyre.bristles", 1, 1, 1)] and told["commits"] == ["abc"]


def test_a_page_names_what_the_kept_audit_says_is_not_covered():
    source_text = not_covered.PAGE.read_text()
    assert not_covered.page(source_text) == source_text, "run python -m docs.not_covered"
    lines = read_table()
    assert lines
    for names in uncovered_functions(lines, [each.function for each in lines]).values():
        for name in names:
            assert f"`{name.replace('.<locals>', '')}`" in source_text
