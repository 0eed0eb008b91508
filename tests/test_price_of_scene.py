"""The price of accuracy of a user's own scene: what is recommended, what is refused, and whether both are true."""

from dataclasses import dataclass

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp

from models.advice.price import PricedRun, SettingLadder
from models.advice.price.problem import Setting
from models.advice.price.recommendation import price, recommend
from models.advice.price.systems.pitch_plane import priced_scene
from models.advice.price.text import as_dict, recommendation_lines
from models.advice.price.truth import values_at
from models.core.assumptions import Assumption, with_assumptions
from models.core.errors import InputError, RunFailed
from models.core.result import Result
from models.engines import outside
from models.engines.outside import register
from models.systems.pitch_plane.scene import build
from validation.price.unseen import true_errors

STEPS = tuple(0.1 / 2**k for k in range(12))


@dataclass(frozen=True)
class Planted:
    """y = t^2 sin 5t with an error of scale h^order, and one method that lies."""

    title, quantity, unit, kink_period, note, work_count_name = "planted", "y", "N", 0.0, "", "force calls"
    full_duration: float = 2.0
    searched_duration: float = 1.0
    growing: float = 0.0
    lies: float = 0.0

    def setting_ladders(self):
        return [
            SettingLadder("exudyn", "fourth", STEPS, 4),
            SettingLadder("exudyn", "first", STEPS, 1, default=0.05),
            SettingLadder("exudyn", "liar", STEPS, 2),
        ]

    def reference_ladder(self):
        return SettingLadder("reference", "exact", tuple(5e-3 / 2**k for k in range(6)), 4)

    def second_setting(self, last):
        return Setting("reference", "other", 1e-9, 0, adaptive=True)

    def solve(self, setting, duration):
        if setting.method == "fourth" and setting.value > 0.06:
            raise RunFailed("exudyn", "unstable", 0.5)
        return setting, duration

    def priced_run(self, solution):
        setting, duration = solution
        step = 1e-2 if setting.adaptive else setting.value
        times = np.linspace(0.0, duration, round(duration / step) + 1)
        error = {"fourth": 1e3, "first": 1.0, "liar": 1e9}.get(setting.method, 0.0) * step ** (setting.order or 1)
        if setting.method == "other":
            error = self.lies
        grown = 1.0 + self.growing * (times > 1.5)
        values = times**2 * np.sin(5 * times) + error * grown
        return PricedRun(times, values[:, None], {"steps": len(times) - 1, "force calls": 4 * (len(times) - 1)})

    def scene_file_lines(self, setting):
        return [setting.label()]


def test_the_coarsest_setting_that_meets_the_tolerance_wins_and_liars_are_named():
    found = recommend(Planted(), 1e-2)
    best = found.winners["exudyn", "calls"].tried.setting
    # 1e3 h^4 <= 1e-2 from h = 56 ms on: the rung of 50 ms
    assert (best.method, best.value) == ("fourth", 0.05)
    assert found.winners["exudyn", "calls"].error == pytest.approx(1e3 * 0.05**4, rel=1e-3)
    assert {one.status for one in found.tried if one.setting.method == "liar" and one.setting.value == STEPS[0]} <= {
        "SILENT"
    }
    assert found.defaults["exudyn"].refined.tried.setting.value <= 1e-2


def test_an_error_that_grows_after_the_part_searched_is_found_and_met():
    calm, wild = recommend(Planted(), 1e-2), recommend(Planted(growing=20.0), 1e-2)
    assert wild.winners["", "calls"].tried.setting.value < calm.winners["", "calls"].tried.setting.value
    assert wild.winners["", "calls"].error <= 1e-2 and wild.winners["", "calls"].confirmed


@dataclass(frozen=True)
class AsGood(Planted):
    """One whose steps must be so short that they are those of the reference, which has the same error."""

    def setting_ladders(self):
        return [SettingLadder("exudyn", "fourth", STEPS[5:], 4)]

    def reference_ladder(self):
        return SettingLadder("reference", "fourth", tuple(2 * STEPS[5] / 2**k for k in range(6)), 4)


@dataclass(frozen=True)
class Lifting(Planted):
    """One whose steps above 20 ms make a tyre pull, or in which it pulls always."""

    always: bool = False

    def solve(self, setting, duration):
        force = 5.0 if setting.value <= 0.02 and not self.always else -5.0
        run = Result(xr.Dataset(attrs={"status": "complete"}))
        with_assumptions(
            run, [Assumption("press", "tyres press", "name lift_off", lambda run: {"t": np.array([force])}, "N", 0.0)]
        )
        return super().solve(setting, duration)


def test_nothing_is_recommended_that_breaks_an_assumption_which_the_reference_keeps():
    """The rung of 50 ms meets the tolerance, and its tyre pulls; that of 12.5 ms does neither."""
    found = recommend(Lifting(), 1e-2)
    best = found.winners["", "calls"]
    assert best.tried.setting.value == 0.0125 and best.error == pytest.approx(1e3 * 0.0125**4, rel=1e-3)
    flagged = [one for one in found.tried if one.status == "flagged"]
    assert {one.setting.value > 0.02 for one in flagged} == {True} and "tyres press" in flagged[0].reason
    assert any("flagged" in line and "tyres press" in line for line in recommendation_lines(found))
    assert as_dict(found)["broken assumptions"] == []


def test_what_every_setting_breaks_is_told_and_forbids_none():
    found = recommend(Lifting(always=True), 1e-2)
    assert found.winners["exudyn", "calls"].tried.setting.value == 0.05
    assert any("with every setting: assumption broken: tyres press" in line for line in recommendation_lines(found))
    assert as_dict(found)["broken assumptions"][0]["remedy"] == "name lift_off"


def test_an_error_is_told_against_a_truth_that_is_better_known():
    """The reference of 3.1 ms would show no error of the setting of 3.1 ms; the true one is 1e3 h^4 = 9.5e-8."""
    found = recommend(AsGood(), 1e-2)
    assert found.winners["", "calls"].tried.setting.value == STEPS[5]
    assert found.winners["", "calls"].error == pytest.approx(1e3 * STEPS[5] ** 4, rel=0.1)
    assert found.truth.uncertainty < found.winners["", "calls"].error


def test_two_families_that_differ_are_no_truth():
    with pytest.raises(RunFailed, match="differ by"):
        recommend(Planted(lies=5e-3), 1e-2)


def test_values_between_rows_do_not_reach_across_a_kink():
    times = np.linspace(0.0, 1.0, 41)
    kinked = PricedRun(times, np.abs(times - 0.5)[:, None] ** 3, {})
    between = np.linspace(0.0, 1.0, 333)
    off = {
        cell: np.abs(values_at(kinked, between, cell)[:, 0] - np.abs(between - 0.5) ** 3).max() for cell in (0.0, 0.5)
    }
    assert off[0.5] < 1e-12 < 1e-7 < off[0.0]


RELEASE = {"title": "release", "run": {"duration": 0.2}, "start": {"z3": 0.02}, "vehicle": {"geometry": "linear"}}


def test_a_recommendation_holds_beside_another_solver():
    scene = priced_scene(build(RELEASE), None, ("mujoco",))
    found = recommend(scene, 0.5)
    for one in found.winners.values():
        assert true_errors(scene, [one.tried.setting])[one.tried.setting] == pytest.approx(one.error, rel=0.2)
        assert one.error <= 0.5
    text = "\n".join(recommendation_lines(found))
    assert "f1 and f2 within 0.5 N" in text and "[engines.mujoco]" in text
    assert as_dict(found)["cheapest"][0]["error"] == found.winners["", "seconds"].error


@pytest.mark.parametrize(
    ("tolerance", "quantity", "message"),
    [
        (0.0, None, "--tolerance = 0.0: must be a finite number above 0"),
        (float("nan"), None, "--tolerance"),
        ("little", None, "--tolerance = 'little': must be a finite number"),
        (True, None, "--tolerance = true: must be a finite number"),
        (1.0, "f9", "--quantity = 'f9': is no channel"),
        (1.0, "f1,pitch", "has several units, N and rad"),
    ],
)
def test_what_cannot_be_asked_is_one_message(tolerance, quantity, message):
    with pytest.raises(InputError, match=message.replace("(", r"\(")):
        price(build(RELEASE), tolerance, quantity, ("reference",))


def test_a_run_of_one_step_has_a_price():
    answer = price(build(RELEASE | {"run": {"duration": 1e-3}}), 5.0, None, ("mujoco",))
    assert answer.winners["", "calls"].error <= 5.0


def test_sensors_do_not_decide_which_steps_are_tried():
    sensors = {"accelerometers": {"sampling_rate": 250.0, "sensors": {"roof": {"x": 0.1, "z": -0.9}}}}
    with_sensors = build(RELEASE | {"effects": sensors})
    price(with_sensors, 5.0, None, ("mujoco",))
    with pytest.raises(InputError, match=r"ax1.*is no channel"):
        price(with_sensors, 5.0, "ax1", ("mujoco",))


@pytest.mark.parametrize("step", [1e-3, 2.5e-4])
def test_the_first_part_of_a_run_need_not_be_steps_of_the_scene(step):
    """Of 5 s the first third is searched, which 1 ms and 0.25 ms do not divide."""
    road = {"road": {"source": "iso8608", "road_class": "A", "speed": 15.0}}
    scene = priced_scene(build(RELEASE | {"run": {"duration": 5.0, "step": step}, "effects": road}), None, ("mujoco",))
    assert scene.unit == "N" and scene.searched_duration == pytest.approx(5.0 / 3.0)


def test_a_tolerance_below_rounding_is_refused():
    scene = priced_scene(build(RELEASE), "z3", ("reference",))
    with pytest.raises((InputError, RunFailed), match=r"finer than|differ by"):
        recommend(scene, 1e-17)


class Fixed:
    """scipy's DOP853, whose work the tolerance alone decides."""

    order, adaptive = 8, True

    def integrate(self, f, times, start, tolerance):
        return solve_ivp(f, times[[0, -1]], start, "DOP853", times, rtol=tolerance, atol=tolerance).y.T


@pytest.fixture
def catalogue(monkeypatch):
    """Engines from outside leave the catalogue with the test that entered them: others list what is in it."""
    for table in (outside.CATALOGUE, outside.RECOMMENDED, outside.OUTSIDE_CLASSES):
        monkeypatch.setitem(table, f"{__name__}:Fixed", None)  # which is taken back; until then register enters it


@pytest.mark.usefixtures("catalogue")
def test_an_integrator_of_ones_own_is_priced_by_its_tolerance():
    name = f"{__name__}:Fixed"
    register(name)
    found = recommend(priced_scene(build(RELEASE), None, (name,)), 0.5)
    best = found.winners["", "seconds"]
    assert best.tried.setting.adaptive and 0.0 < best.error <= 0.5
    assert len({one.setting.value for one in found.tried}) > 1
    assert f"    # twinrig run SCENE --engine {name}" in recommendation_lines(found)
