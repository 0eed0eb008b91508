"""Rows on stabilisers and index reduction pass, and fail where something is wrong."""

import json

import numpy as np
import pytest

from models.core.errors import RunFailed
from models.engines import exudyn, mujoco, reference
from validation.cases import index_reduction as index_case
from validation.cases import stabilisers as case
from validation.hard_cases import stabilisers as hard
from validation.hard_cases.case import judge


def failed(module, tmp_path):
    """Ids of the rows of a quick case that do not pass."""
    return {row.id for row in module.measure(True, tmp_path)[0] if row.status == "failed"}


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Both quick cases: name -> (rows, data)."""
    folder = tmp_path_factory.mktemp("cases")
    return {"stabilisers": case.measure(True, folder), "index_reduction": index_case.measure(True, folder)}


def test_all_rows_pass_and_their_ids_are_their_own(measured):
    for name, (rows, _) in measured.items():
        assert [(row.id, row.reason) for row in rows if row.status == "failed"] == []
        assert len({row.id for row in rows}) == len(rows) and all(row.id.startswith(f"{name}.") for row in rows)


@pytest.mark.parametrize(
    ("module", "model", "engine"),
    [
        (reference, "PitchPlaneReference", "reference"),
        (mujoco, "MujocoModel", "mujoco"),
        (exudyn, "ExudynModel", "exudyn"),
    ],
)
def test_a_force_without_its_sign_fails_its_rows(monkeypatch, tmp_path, module, model, engine):
    """The enforced force upward instead of down: both vehicles' rows of that implementation, and no other row."""
    original = getattr(module, model)._enforced
    flip = np.array([-1.0, 1.0])

    def upward(self, *arguments):
        found = original(self, *arguments)
        return found if found is None or found.shape[1] == 1 else found * flip

    monkeypatch.setattr(getattr(module, model), "_enforced", upward)
    if engine == "exudyn":
        monkeypatch.setattr(exudyn, "check_balance", lambda *_: None)  # which would raise before the row could see it
    names = {f"stabilisers.mass.{engine}.{vehicle}" for vehicle in ("itwm_drift", "asymmetric_twin")}
    assert failed(case, tmp_path) == names


def test_the_balance_sees_a_force_without_its_sign(monkeypatch):
    original = exudyn.ExudynModel._enforced
    monkeypatch.setattr(exudyn.ExudynModel, "_enforced", lambda self: original(self) * np.array([-1.0, 1.0]))
    with pytest.raises(RunFailed, match="of forces"):
        hard._guided_run("exudyn", hard.guided_assembly(mass_factor=0.95))


def test_a_missing_projection_fails_its_row(monkeypatch, tmp_path):
    monkeypatch.setattr(index_case.IndexOneVehicle, "_projection", lambda self, y, u: y)
    assert failed(index_case, tmp_path) == {"index_reduction.none.index_1.projection"}


def test_a_wrong_multiplier_column_fails_every_law_at_index_1(monkeypatch, tmp_path):
    """The constraint on heave instead of pitch: nothing at index 1 follows any more."""
    monkeypatch.setattr(index_case, "CONSTRAINT_JACOBIAN", np.array([[0.0, 0.0, 1.0, 0.0]]))
    assert {"index_reduction.law.index_1", "index_reduction.law.index_1.Baumgarte"} <= failed(index_case, tmp_path)


def test_the_gap_law_is_the_damped_one():
    """Against its own differential equation by differences: g'' + 2 alpha g' + alpha^2 g = 0."""
    t = np.linspace(0, 1, 100_001)
    g = index_case.pitch_gap_law(t, 1e-3, 2e-3, 7.0)
    rate, step = np.gradient(g, t), t[1]
    second = np.diff(g, 2) / step**2
    assert np.abs(second + 14.0 * rate[1:-1] + 49.0 * g[1:-1]).max() < 1e-6  # differences of 1e-5: rounding 1e-8


def test_figure_draws_from_saved_data(measured):
    ((_, figure),) = index_case.draw(json.loads(json.dumps(measured["index_reduction"][1])))
    figure.canvas.draw()


def test_exudyns_limit_stops_would_be_silent(monkeypatch, tmp_path):
    monkeypatch.setattr(exudyn, "_add_pitch_spring", hard._add_limit_stop)
    edge = next(one for one in hard.CASES if one.name == "edge of a dead band")
    assert judge(edge, "exudyn", tmp_path).word == "SILENT"


def test_without_the_balance_rough_rails_are_silent(monkeypatch, tmp_path):
    monkeypatch.setattr(exudyn, "check_balance", lambda *_: None)
    rough = next(one for one in hard.CASES if one.name.startswith("noise of 1e-6 on prescribed"))
    assert judge(rough, "exudyn", tmp_path).word == "SILENT"
