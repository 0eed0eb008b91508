"""What runs of cut vehicles, recordings and tyres' tables say of their error and of what they take for granted."""

from pathlib import Path

import numpy as np
import pytest

from models.core import told
from models.core.assumptions import assumption_sentences, broken_assumptions_of, with_assumptions
from models.core.discretisation import error_estimates_of
from models.core.systems import load
from models.core.time_series import write_time_series
from models.systems.braking.of_scene import tyre_table_of
from models.systems.braking.scene import build as build_braking
from models.systems.hub_forces import run as module
from models.systems.hub_forces.comparison import compare_stabilisers
from models.systems.hub_forces.plan import describe
from models.systems.hub_forces.run import principal_series, run
from models.systems.hub_forces.scene import COLUMNS_OF_ANGLES, COLUMNS_OF_HUB, HubScene, build
from models.systems.measured.run import run as run_recording
from models.systems.measured.scene import build as recording
from models.tyre.assumptions import tyre_table_assumptions as of_table
from models.vehicles.cut_vehicle import cut_at_hubs
from models.vehicles.vehicle_file import load_vehicle
from studies.tyre import run as read_tyre

SCENES = Path(__file__).parents[1] / "studies" / "scenes"
CAR = cut_at_hubs(load_vehicle("r19_free"), "body")


def scene(road: dict | None = None, **tables: dict) -> HubScene:
    """A car over half a second of a road, in steps of 2 ms."""
    base = {"title": "t", "system": "hub-forces", "vehicle": {"file": "r19_free"}, "road": road or {}}
    return build({**base, "run": {"duration": 0.6, "step": 2e-3}, **tables}, "s.toml")


def filed(folder: Path, factor: float = 1.0, lift: float = 0.0, **tables: dict) -> HubScene:
    """A car on files of a second: its loads times a factor, at the left front wheel more by so much (N) in the middle;
    measured to lie level."""
    times = 2e-3 * np.arange(501)
    pulse = np.exp(-(((times - 0.5) / 0.05) ** 2))
    columns = {
        f"{hub}_{name}": (next(iter(units)), (name == "fz") * (factor * load + lift * pulse * (hub == "fl")))
        for hub, load in zip(CAR.hubs, CAR.loads, strict=True)
        for name, units in COLUMNS_OF_HUB.items()
    }
    write_time_series(folder / "forces.csv", columns, 2e-3)
    write_time_series(
        folder / "angles.csv", {n: (next(iter(u)), 0.0 * times) for n, u in COLUMNS_OF_ANGLES.items()}, 2e-3
    )
    accept = {"accept": ["weight", "clipped", "gain", "offset", "lever", "unit", "turning", "noise"]}
    table = {"title": "t", "system": "hub-forces", "vehicle": {"file": "r19_free"}, "angles": {"file": "angles.csv"}}
    table |= {"run": {"duration": 1.0, "step": 2e-3}, "forces": {"file": "forces.csv", **accept}}
    return build({**table, **tables}, "s.toml", folder)


ROUGH = {"iso8608": "G", "speed": 30.0}
FAST = {"speed": 60.0, "iso8608": "B"}
PLANTED = {
    "tyres press": ({"road": ROUGH}, {"road": ROUGH, "effects": {"lift_off": {}}}, "lift_off"),
    "springs between stops": ({"road": {**ROUGH, "iso8608": "H"}}, {"road": {"iso8608": "C"}}, "road.iso8608"),
    "samples": (
        {"road": FAST, "forces": {"sampling_rate": 250.0}},
        {"road": FAST, "forces": {"sampling_rate": 500.0, "interpolation": "smooth"}},
        'forces.interpolation = "smooth"',
    ),
}
"""By the name of the assumption: a scene that breaks it, one with the remedy, and what the remedy must name."""


@pytest.mark.parametrize("name", PLANTED)
def test_what_is_broken_is_told_with_its_remedy_and_gone_with_it(name):
    engine = ("mujoco", "reference", "exudyn")[list(PLANTED).index(name) % 3]
    planted, cured, remedy = PLANTED[name]
    broken = {one.name: one for one in broken_assumptions_of(run(scene(**planted), engine))}
    assert name in broken and remedy in broken[name].remedy and 0.0 < broken[name].share <= 1.0
    assert name not in {one.name for one in broken_assumptions_of(run(scene(**cured), engine))}


def test_forces_out_of_balance_and_a_vehicle_that_turns_are_told(tmp_path):
    light = {one.name: one for one in broken_assumptions_of(run(filed(tmp_path, 0.8), "mujoco"))}
    assert set(light) == {"balance"} and light["balance"].worst == pytest.approx(0.85, abs=0.01)  # 0.05 may be motion
    turning = {"forces": {"file": "forces.csv", "frame": "inertial"}, "stabilise": {"bandwidth": 2.0}}
    own = filed(tmp_path, lift=8000.0, **turning)
    free = {one.name: one for one in broken_assumptions_of(run(own, "reference"))}
    assert "same attitude" in free and "kalman_filter" in free["same attitude"].remedy
    assert free["same attitude"].first > 0.4 and free["same attitude"].worst > 0.05
    held = run(own, "reference", "prescribed")
    assert "same attitude" not in {one.name for one in broken_assumptions_of(held)}
    assert broken_assumptions_of(run(filed(tmp_path), "exudyn")) == []


def test_the_measurement_itself_is_judged_and_show_lists_all():
    own = scene({"iso8608": "H", "speed": 30.0})
    measurement = module.measure(own, "mujoco")
    true = {
        one.name: one for one in broken_assumptions_of(module.labelled_result(measurement, measurement.truth, "mujoco"))
    }
    assert {"tyres press", "springs between stops", "side forces"} <= set(true)
    assert 'system = "handling"' in true["side forces"].remedy
    assert all(line in describe(own) for line in assumption_sentences(run(own, "mujoco", measurement=measurement)))


@pytest.mark.parametrize(
    ("step", "rate", "method"), [(4e-3, 125.0, "kalman"), (5e-3, 200.0, "none"), (8e-3, 125.0, "prescribed")]
)
def test_the_error_that_is_told_is_that_of_measurement_and_run(step, rate, method):
    """Between a third and ten times the difference from an eighth of the steps, by longer steps and by half steps."""

    def made(step: float, error: bool):
        tables = {"run": {"duration": 1.2, "step": step}, "stabilise": {"method": method, "smoothing": 3.0}}
        return run(scene({"speed": 25.0}, forces={"sampling_rate": rate}, **tables), "mujoco", error=error)

    own, fine = made(step, True), made(step / 8, False)
    mine, truth = (principal_series(CAR, each.detail).channels for each in (own, fine))
    name, one = max(error_estimates_of(own).items(), key=lambda each: each[1].share)
    true = float(np.sqrt(np.mean((mine[name] - truth[name][::8]) ** 2)))
    assert true / 3.0 < one.error < 10.0 * true and one.unit == "N"


def test_longer_steps_than_the_samples_would_be_caught(monkeypatch):
    """Planted fault: white noise between steps that skip samples is taken for an error of the steps."""
    own = scene({"iso8608": "A"}, forces={"sampling_rate": 500.0, "force_deviation": 200.0})
    right = max(one.share for one in error_estimates_of(run(own, "mujoco", error=True)).values())
    monkeypatch.setattr(module, "step_divides", lambda step, period: True)
    assert max(one.share for one in error_estimates_of(run(own, "mujoco", error=True)).values()) > 10.0 * right


def test_no_error_costs_no_run_and_a_comparison_tells_of_all(monkeypatch):
    calls, build_model, models, model_of = [], module.build, [], module.HubModel
    monkeypatch.setattr(module, "build", lambda *model: calls.append(model) or build_model(*model))
    monkeypatch.setattr(module, "HubModel", lambda *model: models.append(model) or model_of(*model))
    own = scene()
    plain = compare_stabilisers(own.model_copy(update={"error": False}), ("mujoco",))
    assert (
        len(models) == 4 and not calls and told.messages_on_results(plain.results) == []
    )  # the measurement, and three runs
    whole = compare_stabilisers(own, ("mujoco",))
    assert set(whole.results) == {"true", "free, mujoco", "filter", "prescribed"}
    assert (
        all(error_estimates_of(each) for each in whole.results.values())
        and len(told.messages_on_results(whole.results)) == 4
    )
    steps = [round(model[4] / model[3]) for model in calls]
    assert sum(steps) / 1200 <= 1.6  # 0.6 of the four runs of 300 steps each


def recorded(**virtual: object):
    """A recording of a virtual measurement of 0.8 s, in memory."""
    own = {"duration": 0.8, "sampling_rate": 500.0, "step": 2e-3, "format": "csv", **virtual}
    return recording({"title": "t", "system": "measured", "vehicle": {"file": "r19_free"}, "virtual": own}, "s.toml")


def test_recordings_are_judged(tmp_path):
    right = run_recording(recorded(), error=True)
    assert broken_assumptions_of(right) == [] and len(assumption_sentences(right)) == 6
    assert 0.0 < max(one.share for one in error_estimates_of(right).values()) < 0.02
    run_recording(recorded(), folder=tmp_path / "a")
    lines = (tmp_path / "a" / "measured.csv").read_text().splitlines()
    header, *rows = [line for line in lines if not line.startswith("#")]
    column = next(i for i, name in enumerate(header.split(",")) if name.strip('"').startswith("fl_fz"))
    values = np.array([[float(each) for each in row.split(",")] for row in rows])
    values[:, column] = np.minimum(values[:, column], np.quantile(values[:, column], 0.9))  # kN: an amplifier's end
    text = [header, *(",".join(f"{each:.12g}" for each in row) for row in values), ""]
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "measured.csv").write_text("\n".join(text))
    (tmp_path / "b" / "scene.toml").write_text((tmp_path / "a" / "scene.toml").read_text())
    (one,) = broken_assumptions_of(run_recording(load(tmp_path / "b" / "scene.toml")))
    assert (one.name, one.where) == ("transducers in range", "fl_fz") and one.worst == pytest.approx(0.1, abs=0.02)
    assert "[clock]" in one.remedy
    heavy = run_recording(recorded(faults={"gain": {"force": 0.3}}))
    assert "balance" in {one.name for one in broken_assumptions_of(heavy)}
    rough = {
        one.name: one for one in broken_assumptions_of(run_recording(recorded(road={"iso8608": "H", "speed": 30.0})))
    }
    assert {"wheels press", "springs between stops"} <= set(rough)


def test_a_table_of_a_tyre_has_no_steps_and_says_where_it_ends(tmp_path):
    table = {"title": "t", "system": "braking", "procedures": {"straight": {}}, "study": "tyre"}
    own = build_braking({**table, "road": {"stretches": [{"left": "ice"}]}}, "s.toml", tmp_path)
    results = read_tyre(own, (), tmp_path, lambda what, share: None)["results"]
    assert (
        broken_assumptions_of(results["ice"]) == [] and "a table has no steps" in told.messages_on_results(results)[0]
    )
    whole = tyre_table_of(own, "ice")
    short = whole.refined(whole.angles[:3], whole.slips, np.array([5e3, 2e4]))
    beyond = {one.name: one for one in broken_assumptions_of(with_assumptions(results["ice"], of_table(short, 3e4)))}
    assert set(beyond) == {"slip angles in the table", "loads in the table"}
    assert all("tyres.files" in one.remedy for one in beyond.values())


@pytest.mark.full
def test_the_shipped_scenes_break_nothing():
    comparison = compare_stabilisers(load(SCENES / "hub_forces.toml"), ("mujoco",))
    assert all(broken_assumptions_of(each) == [] for each in comparison.results.values())
    assert broken_assumptions_of(run(load(SCENES / "choice_hub_forces.toml"), "mujoco")) == []
    assert broken_assumptions_of(run_recording(load(SCENES / "recording.toml"))) == []
