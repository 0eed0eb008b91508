"""Whether verdicts on recommended settings see what they should: refused scenes, forgotten defaults, lost engines."""

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest

from models.advice.price import SettingLadder, recommendation
from models.advice.price.problem import Setting
from models.advice.price.recommendation import recommend
from models.advice.price.search import SettingSearch, TriedSetting
from models.advice.price.text import as_dict, recommendation_lines
from models.advice.price.truth import refined_reference
from models.core.errors import InputError, RunFailed
from validation.cases import recommendation as case
from validation.faults.advice import LOOSE_TOLERANCE, Swing
from validation.price.unseen import Verdict, default_is_cheaper

GOOD = Verdict("a scene", "mujoco RK4", "2 ms", 1.0, 0.5, 0.5, 0.01, False)


@dataclass(frozen=True)
class Whole(Swing):
    """All of it is searched."""

    full_duration, searched_duration = 2.0, 2.0


@dataclass(frozen=True)
class Torn(Whole):
    """One engine gives no answer at all."""

    def setting_ladders(self):
        return [*super().setting_ladders(), SettingLadder("exudyn", "RK4", (0.1, 0.05), 4, default=0.1)]

    def solve(self, setting, duration):
        if setting.engine == "exudyn":
            raise RunFailed("exudyn", "the solver gave up", 0.1)
        return super().solve(setting, duration)


def test_an_engine_that_fails_is_named_and_the_other_one_recommended():
    found = recommend(Torn(), LOOSE_TOLERANCE)
    assert {one.tried.setting.engine for one in found.winners.values()} == {"mujoco"}
    text = "\n".join(recommendation_lines(found))
    assert "Exudyn RK4" in text and "the solver gave up" in text
    assert "Infinity" not in json.dumps(as_dict(found)) and json.dumps(as_dict(found), allow_nan=False)


@pytest.fixture
def refusing(monkeypatch):
    """Scenes up to a number are refused; the numbers that were asked for."""
    asked = []

    def judge(number, engines):
        asked.append(number)
        if number < 2 * case.REDRAW_STRIDE:
            raise InputError("--tolerance", "", 1e-9, "is finer than can be known")
        return [GOOD]

    monkeypatch.setattr(case, "random_scene", lambda number, folder: number)
    monkeypatch.setattr(case, "verdicts_on_pitch_plane", judge)
    return asked


def test_a_refused_scene_is_drawn_anew_and_told(refusing, tmp_path):
    found, refused = case.verdicts_on_scene("pitch-plane", 5, tmp_path)
    assert found == [GOOD] and refusing == [5, 1005, 2005]
    assert [one.split(":")[0] for one in refused] == ["pitch-plane 5", "pitch-plane 1005"]


def test_one_that_is_refused_again_and_again_is_not_held(refusing, tmp_path, monkeypatch):
    monkeypatch.setattr(case, "REDRAW_COUNT", 1)
    found, refused = case.verdicts_on_scene("pitch-plane", 5, tmp_path)
    rows = {row.id: row for row in case._promise_rows([found, *[[GOOD]] * 9], refused)}
    assert found == [] and rows["recommendation.met"].value == 0.9
    assert rows["recommendation.met"].status == rows["recommendation.refused"].status == "failed"  # 2 of 10


@pytest.mark.parametrize(
    ("row", "change"),
    [
        ("met", {"true": 1.1}),
        ("predicted", {"predicted": 0.05}),
        ("predicted", {"predicted": 2.0}),
        ("slower", {"slower": True}),
    ],
)
def test_every_promise_that_is_broken_fails_its_row(row, change):
    good, bad = (
        {one.id: one.status for one in case._promise_rows([[own]] * 10, [])} for own in (GOOD, replace(GOOD, **change))
    )
    assert good[f"recommendation.{row}"] == "passed" and bad[f"recommendation.{row}"] == "failed"


def test_a_recommendation_that_is_slow_by_the_clock_misses_an_aim_and_fails_no_row():
    bad = {row.id: row.status for row in case._promise_rows([[replace(GOOD, slower=True, kind="seconds")]] * 10, [])}
    assert bad.pop("recommendation.slower.seconds") == "missed" and "failed" not in bad.values()


def test_a_default_that_the_race_forgot_is_seen_by_the_verdict(monkeypatch):
    real = recommendation._timed_settings
    whole = recommend(Whole(), LOOSE_TOLERANCE)
    monkeypatch.setattr(
        recommendation, "_timed_settings", lambda search: [one for one in real(search) if not one.tried.setting.default]
    )
    forgot = recommend(Whole(), LOOSE_TOLERANCE)
    said = [
        any(default_is_cheaper(own, key, one) for key, one in own.winners.items() if key[1] == "calls")
        for own in (whole, forgot)
    ]
    assert said == [False, True]


def test_a_run_of_minutes_is_not_made_where_the_tolerance_is_met_in_less():
    own = Whole()
    quick = TriedSetting(Setting("reference", "RK4", 0.1, 4), "ok", "", 0.0, 80, 0.1)
    search = SettingSearch(
        own, refined_reference(own, LOOSE_TOLERANCE, own.full_duration), LOOSE_TOLERANCE, own.full_duration, [quick]
    )
    rough = TriedSetting(Setting("mujoco", "Euler", 0.2, 1), "ok", "", 10 * LOOSE_TOLERANCE, 10, 8.0)
    ladder = own.setting_ladders()[2]
    assert not search._is_too_long(ladder, 0, rough)  # 8 s
    assert search._is_too_long(ladder, 2, rough)  # 24 s
    assert search.tried[-1].reason == "not run: it would take about 24 s, and the tolerance is met in 0.1 s"
    assert np.isinf(search.tried[-1].error)
