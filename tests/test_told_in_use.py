"""Errors and broken assumptions in sweeps, comparisons, choices, and the report."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from models.advice.choice.choose import EffectChooser
from models.advice.price.runner import attempt
from models.core import told
from models.core.assumptions import broken_assumptions_of, collected_broken_assumptions
from models.core.discretisation import Estimate, error_estimates_of, with_stated_errors
from models.core.systems import load
from models.systems.pitch_plane.run import run
from models.systems.pitch_plane.scene import build
from studies.choice import choice_lines, choice_of_scene
from studies.command import sweep
from studies.command.comparison import compare, report
from studies.command.sweep_figure import BROKEN_MARK, WARNING_MARK, SweepResults, draw_sweep
from studies.command_line import app
from validation.cases import stated_errors
from validation.common.grounds import allowing_breaches
from validation.common.rows import Observed, not_run, rows_on_grounds
from validation.price.problems import road_excited
from validation.report.page import allowed_assumptions
from validation.stated_errors.sample import Sample

ROAD = {"road": {"source": "study", "speed": 20.0}}
SCENE = """title = "linear tyres on the study road"
study = "single_run"
[vehicle]
parameters = "itwm_drift"
[run]
duration = 1.5
step = 2e-3
[effects.road]
source = "study"
speed = 20.0
"""


def simulate(speed=20.0, error=False, step=2e-3, **effects):
    """The paper's vehicle on its study road, whose linear tyres pull from 1.2 s on at 20 m/s."""
    table = {
        "title": "study road",
        "vehicle": {"parameters": "itwm_drift"},
        "run": {"duration": 1.5, "step": step},
        "effects": {"road": {"source": "study", "speed": speed}, **effects},
    }
    return run(build(table), "reference", error=error)


@pytest.fixture(scope="module")
def pulling():
    return simulate(error=True)


@pytest.fixture(scope="module")
def pressing():
    return simulate(speed=5.0, error=True)


def test_a_sweep_tells_in_table_columns_json_and_code(tmp_path, monkeypatch, capsys):
    (tmp_path / "s.toml").write_text(SCENE)
    monkeypatch.setattr("studies.command.sweep_figure.draw_sweep", lambda swept, folder: [])
    asked = [str(tmp_path / "s.toml"), "--engine", "reference", "--sweep", "effects.road.speed=5,20", "--strict"]
    asked += ["--workers", "1"]
    with pytest.raises(SystemExit) as ended:
        app(["run", *asked, "--out", str(tmp_path / "a")], standalone_mode=False)
    out = capsys.readouterr().out
    assert ended.value.code == 1 and "speed=20 reference: assumption broken: linear tyres" in out
    assert "speed=5 reference: error at most" in out
    kept, broken = csv.DictReader((tmp_path / "a" / "sweep.csv").open())
    assert list(kept)[-3:] == ["failed", "largest error [-]", "broken assumptions"]
    assert kept["broken assumptions"] == "" and "reference: tyres press (" in broken["broken assumptions"]
    saved = json.loads((tmp_path / "a" / "sweep.json").read_text())["results"]
    estimates = saved[1]["errors"]["reference"]["channels"].values()
    assert float(broken["largest error [-]"]) == max(one["share"] for one in estimates)
    quick = sweep.sweep_points("effects.road.speed=5,20", asked[0], (), "reference", with_error=False)
    said = replace(quick, output_folder=tmp_path / "b").record(1)["results"]["reference"]
    assert said["error"] == "{}" and "tyres press" in said["assumptions"]


def test_curves_have_marks_at_the_points_of_their_own_engine(tmp_path, monkeypatch, pulling, pressing):
    rough = type(pulling)(pulling.data.copy())
    with_stated_errors(rough, {"f1": Estimate(3.0, "N", 0.1, 4.0, 1e-3)}, "hand")
    rough.data.attrs["engine"] = "mujoco"
    results = [{"reference": pressing, "mujoco": pressing}, {"reference": pulling, "mujoco": rough}]
    columns = {"reference, f1": [1.0, 2.0], "mujoco, f1": [1.5, 2.5]}
    swept = SweepResults("s.toml", "k", (1, 2), columns, [{}, {}], results)
    seen = []
    monkeypatch.setattr("studies.command.sweep_figure.save", lambda figure, path: seen.append(figure))
    draw_sweep(swept, tmp_path)
    marks = {line.get_label(): line.get_xydata().tolist() for line in seen[0].axes[0].lines}
    assert marks[WARNING_MARK["label"]] == [[2.0, 2.5]] and [2.0, 2.5] in marks[BROKEN_MARK["label"]]
    assert swept.broken_points("reference") == [1] and swept.warned_points("reference") == []


def test_what_results_say_survives_json(pulling):
    said = json.loads(json.dumps(told.attributes_for_json({"reference": pulling})))
    (copy,) = told.results_with_attributes(said).values()
    assert broken_assumptions_of(copy) == broken_assumptions_of(pulling) and error_estimates_of(
        copy
    ) == error_estimates_of(pulling)


def test_many_results_are_told_in_few_lines(pulling):
    rough = [type(pulling)(pulling.data.copy()) for _ in range(9)]
    for i, one in enumerate(rough):
        with_stated_errors(one, {"f1": Estimate(3.0, "N", 0.03 + 0.01 * i, 4.0, 1e-3)}, "hand")
    said = told.messages_on_results({f"k={i}": one for i, one in enumerate(rough)})
    assert said[0].startswith("  9 results, the largest error k=8: error at most 11 %") and "WARNING" in said[0]
    assert said[1] == "  errors above 2 % in 9 of 9: k=0, k=1, k=2, k=3 and 5 more" and "and 5 more: ass" in said[2]


def test_a_difference_below_the_stated_errors_is_called_so(tmp_path, pulling):
    shifted = type(pulling)(pulling.data.copy(deep=True))
    error = error_estimates_of(pulling)["f1"].error
    shifted.data["f1"].values[:] += error
    shifted.data["f2"].values[:] += 3.0 * error_estimates_of(pulling)["f2"].error
    for name, one in (("a", pulling), ("b", shifted)):
        one.save(tmp_path / f"{name}.nc")
    found = {one.name: one for one in compare(tmp_path / "a.nc", tmp_path / "b.nc")[0]}
    assert found["f1"].within and found["f1"].stated == pytest.approx(2.0 * error) and not found["f2"].within
    summary = report(tmp_path / "a.nc", tmp_path / "b.nc", tmp_path)
    assert summary["within the stated error"] == ["f1"] and len(summary["results"]) == 2
    assert any("f1 " in line and "rms within the stated error of" in line for line in summary["table"])
    assert any("assumption broken" in line for line in told.messages_on_results(summary["results"]))
    assert "stated error of both" in (tmp_path / "compare.csv").read_text().splitlines()[0]


CHOICE = """title = "what may go?"
study = "choice"
quantities = ["rms z3"]
tolerance = 0.95
[vehicle]
parameters = "itwm_drift"
[run]
duration = 1.5
step = 2e-3
[effects.road]
source = "study"
speed = 20.0
[effects.lift_off]
"""


def test_a_choice_keeps_what_the_assumptions_need_and_states_its_error(tmp_path):
    (tmp_path / "s.toml").write_text(CHOICE)
    scene = load(tmp_path / "s.toml")
    found = choice_of_scene(scene, ())
    assert "lift_off" in found.staying_effects and {
        one.name for one in found.choice.assumptions_barring["lift_off"]
    } >= {"tyres press"}
    said = "\n".join(choice_lines(found, False))
    assert "lift_off stays; without it an assumption would be broken: linear tyres stay on the road" in said
    (left,) = found.results
    assert error_estimates_of(left) and broken_assumptions_of(left) == []
    monkey = EffectChooser(scene, "reference", scene.quantities, scene.tolerance)
    monkey.breaks_assumption = lambda chosen: False  # what the screen foretells is confirmed by whole runs, too
    assert not monkey.within_tolerance(monkey.confirmed_changes(frozenset(["lift_off"])))


def test_points_of_work_precision_curves_are_marked():
    problem = object.__new__(road_excited.RoadExcited)
    problem.assembly, problem.units, problem.bound = (
        road_excited.assembly_of_scene(road_excited.scene()),
        {"q": "N"},
        1.0,
    )
    problem.errors = lambda run: (road_excited.result_with_assumptions(problem.assembly, run), {"q": 0.1})[1]
    point = attempt(problem, road_excited.setting("reference", "RK4", 2e-3))
    assert point.status == "ok" and "linear tyres stay on the road" in point.broken


def of(value, id="case.row"):
    return Observed(id, "effects", "q", value, "N").at_most(1e9, "why", "none")


def test_a_row_that_rests_on_a_tyre_that_pulls_fails():
    """The planted fault: a case whose run lifts a tyre."""
    rows, _ = rows_on_grounds("case", lambda: ([of(float(simulate()["f1"].max()))], {}))
    assert rows[0].status == "failed" and "rests on a broken assumption: linear tyres stay on" in rows[0].reason


def again(result):
    """Judge a result once more."""
    from models.systems.pitch_plane.assumptions import assumptions
    from models.systems.pitch_plane.scene import assembly_of_scene

    scene = build({"title": "t", "vehicle": {"parameters": "itwm_drift"}, "run": {"duration": 1.5}, "effects": ROAD})
    from models.core.assumptions import with_assumptions

    return with_assumptions(result, assumptions(assembly_of_scene(scene)))


def test_rows_rest_on_the_runs_before_them_alone(pulling, pressing):
    def part(result):
        again(result)
        return [of(1.0), Observed("case.told", "effects", "q", 1.0, "").beside(1.0, "why")]

    def measure():
        rows = [of(0.0), *part(pressing), not_run("case.none", "effects", "q", "no file")]
        rows += [*part(pulling), not_run("case.none", "effects", "q", "no file")]
        rows += [of(2.0)]
        return [*rows, *part(pressing)], {}

    rows, _ = rows_on_grounds("case", measure)
    assert [row.status for row in rows] == [
        *("passed", "passed", "reported", "not run"),
        *("failed", "failed", "not run"),
        *("passed", "passed", "reported"),
    ]


def test_runs_whose_rows_are_made_elsewhere_are_not_lost(pulling):
    def both():
        return again(pulling)

    rows, _ = rows_on_grounds("case", lambda: (((lambda run: [of(1.0)])(both())), {}))
    assert rows[0].status == "failed"
    rows, _ = rows_on_grounds("case", lambda: ([of(1.0)], {"late": bool(both())}))
    assert [(row.id, row.status) for row in rows] == [("case.row", "passed"), ("case.assumptions", "failed")]


def test_what_a_case_allows_is_told_with_its_reason(pulling):
    @allowing_breaches("the linear tyre is what is shown", "tyres press", "springs compressed")
    def measure():
        again(pulling)
        return [of(1.0)], {}

    (row,), _ = rows_on_grounds("case", measure)
    assert row.status == "passed" and row.broken == "" and row.allowed.endswith(": the linear tyre is what is shown")
    assert allowed_assumptions([row.as_dict()]) == [(row.allowed, [row.as_dict()])]
    with allowing_breaches("another one", "small angles"):
        (row,), _ = rows_on_grounds("case", lambda: ([of(float(bool(again(pulling))))], {}))
    assert row.status == "failed"


def test_inner_watches_keep_what_they_see(pulling):
    with collected_broken_assumptions() as outer, collected_broken_assumptions() as inner:
        again(pulling)
    assert "tyres press" in inner and not outer


def sample(ratio, share=1e-3, cost=0.5, told=True):
    estimate = {"f": Estimate(2.0, "N", share, 4.0, 1e-3)} if told else {}
    return Sample("drawn", "mujoco", estimate, {"f": 2.0 * ratio}, 100.0, 100.0 * cost)


def rows_of(*drawn):
    found = [stated_errors._error_sample_as_table("ride", one) for one in drawn]
    return {row.id.removeprefix("stated_errors."): row for row in stated_errors._common_rows(found, False)}


def test_stated_errors_are_judged_by_the_bounds_that_are_asked():
    good = [sample(1.0)] * 30
    assert {row.status for row in rows_of(*good, sample(4.0)).values()} == {"passed", "reported"}
    assert rows_of(*good, sample(4.0), sample(4.0))["near"].status == "failed"
    assert rows_of(*good, sample(11.0))["silent"].status == "failed"
    assert rows_of(*good, sample(11.0, share=0.1))["silent"].status == "passed"
    assert rows_of(*good, *[sample(0.05)] * 4)["useless"].status == "failed"
    assert rows_of(*good, *[sample(1e-14)] * 9)["useless"].status == "passed"
    assert rows_of(sample(1.0, cost=0.7))["cost"].status == "failed"
    assert rows_of(*good, sample(0.0, told=False))["without"].value == 1.0


def test_all_systems_that_have_samples_are_found_and_shown(monkeypatch, tmp_path):
    drawn = {"validation.stated_errors.systems.ride": [sample(0.7), sample(np.inf, share=0.1), sample(0.0, told=False)]}
    modules = {"ride": "validation.stated_errors.systems.ride"}
    fake = type("Fake", (), {"samples": staticmethod(lambda count, seed: drawn[modules["ride"]][:count])})
    monkeypatch.setattr(stated_errors, "import_module", lambda name: fake)
    monkeypatch.setattr(stated_errors, "SAMPLING_MODULES", modules)
    monkeypatch.setattr(stated_errors, "QUICK_SAMPLE_COUNTS", {"ride": 3})
    rows, data = stated_errors.measure(True, tmp_path)
    assert {row.id for row in rows} >= {"stated_errors.silent", "stated_errors.ride.near", "stated_errors.cost"}
    saved = json.loads(json.dumps(data))
    (table,), ((_, _),) = stated_errors.tables(saved), stated_errors.draw(saved)
    assert len(table.rows) == 2


def test_results_of_engines_are_not_of_others(pulling):
    other = replace(pulling, data=pulling.data.copy())
    other.data.attrs["engine"] = "exudyn"
    swept = SweepResults("s", "k", (1,), {}, [{}], [{"exudyn": other}])
    assert swept.broken_points("mujoco") == [] and swept.broken_points("exudyn") == [0] == swept.broken_points("")[0:1]
