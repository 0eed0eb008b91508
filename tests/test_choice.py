"""Effects of any system's scene priced and chosen by runs: differences, screen, choice, refusals."""

import json
import time
from dataclasses import replace

import numpy as np
import pytest

from models.advice.choice import choose
from models.advice.choice.answer import (
    Quantity,
    RunQuantities,
    difference_of_runs,
    largest_relative_change,
    reference_sizes_of_cases,
    rounding_floor,
    sum_of_differences,
)
from models.advice.choice.choose import EffectChooser
from models.advice.choice.screen import EffectScreen
from models.advice.choice.variants import Variants
from models.advice.price.effects import price_list
from models.advice.price.effects_text import as_dict, price_list_lines
from models.core.errors import InputError
from studies import choice as study
from studies.command.asked import KNOWN_SYSTEMS, checked_study
from validation.choice.drawn_scenes import draw_scene

ROAD = {"source": "study", "speed": 20.0}


def half_car(**more):
    from models.systems.pitch_plane.scene import build

    table = {
        "title": "t",
        "study": "choice",
        "quantities": ["pitch", "rms f1"],
        "tolerance": 0.02,
        "run": {"duration": 0.96, "step": 1e-3},
        "effects": {"road": ROAD, "pitch_spring": {"stiffness": 100.0}},
    }
    return build(table | more, "t")


def test_paths_are_compared_where_both_have_a_row_and_by_their_deviation():
    full, half = np.array([0.0, 2.0, 4.0, 6.0, 8.0]), np.array([0.0, 4.0, 9.0])
    change = difference_of_runs((half,), (full,))
    assert change[0].tolist() == [0.0, 0.0, 1.0]
    assert largest_relative_change(change, reference_sizes_of_cases((full,))) == pytest.approx(
        np.sqrt(1.0 / 3.0) / np.sqrt(8.0)
    )  # its deviation
    assert sum_of_differences(change, (np.ones(5),))[0].tolist() == [1.0, 1.0, 2.0]
    with pytest.raises(InputError):
        difference_of_runs((np.zeros(4),), (full,))


def test_a_case_that_does_not_move_is_held_to_a_share_of_the_others():
    assert reference_sizes_of_cases((np.array([0.0]), np.array([-5.0]))).tolist() == [0.005, 5.0]


class Made(Variants):
    """Variants whose quantity is a given function of what is left out and of the step."""

    def __init__(self, function, effects):
        (
            self.function,
            self.names,
            self.calls,
            self._quantities_of_variant,
            self._seconds_per_call,
            self._assumptions_broken,
        ) = (function, effects, 0, {}, {}, {})
        self._computed_in_advance = {}
        self.scene, self.engine = type("Made", (), {"file": "t", "system": "made"}), ""
        self.system = type(
            "System",
            (),
            {
                "PART_REPRESENTS_RUN": False,
                "divisible_step_count": staticmethod(lambda scene: 4),
                "step_count": staticmethod(lambda scene: 4),
            },
        )

    @property
    def effects(self):
        return self.names

    def changed_scene(self, left_out, times=1):
        return self.scene

    def _run(self, left_out, times):
        value = np.array([self.function(left_out, times)])
        return RunQuantities({"q": Quantity("", (value,))}, {"calls": 100 // times, "states": 2}, 1.0)


def chooser(monkeypatch, function, effects, tolerance=0.05):
    monkeypatch.setattr(choose, "Variants", lambda scene, engine, executor: Made(function, effects))
    return EffectChooser(None, "", ["q"], tolerance)


def test_the_second_order_is_exact_for_a_quadratic_and_tells_what_it_leaves_out():
    def quantity(left_out, times):
        x = sum({"a": 1.0, "b": 2.0, "c": 3.0}[name] for name in left_out)
        return 100.0 + x + 0.1 * x**2

    screen = EffectScreen(Made(quantity, ("a", "b", "c")), ["q"])
    assert screen.predicted_change(frozenset("abc"))[0] == pytest.approx((6.0 + 3.6) / 100.0)
    assert screen.higher_order_estimate(frozenset("ab"))[0] == 0.0  # run itself
    second, first = 0.2 * (2.0 + 3.0 + 6.0), 6.0 + 0.1 * 14.0
    assert screen.higher_order_estimate(frozenset("abc"))[0] == pytest.approx(second**2 / first / 100.0)


def test_a_pair_is_found_of_which_one_alone_ruins(monkeypatch):
    ruined = {frozenset("a"): 300.0, frozenset("ab"): 101.0, frozenset("b"): 104.5, frozenset(): 100.0}
    choice = chooser(monkeypatch, lambda left_out, times: ruined[left_out], ("a", "b")).choose()
    assert (
        choice.left_out == ("a", "b") and choice.within_tolerance and choice.confirmed_change[0] == pytest.approx(0.01)
    )


def test_a_search_ends_where_its_runs_are_spent_and_says_so(monkeypatch):
    """40 effects of which each alone ruins and no pair helps: 780 pairs. What goes by itself is confirmed."""
    names = tuple(f"e{i:02}" for i in range(40))

    def quantity(left_out, times):
        return 100.0 + (0.1 if "e00" in left_out else 0.0) + 50.0 * len(left_out - {"e00"})

    found, shares = chooser(monkeypatch, quantity, names), []
    found.report_progress = shares.append
    choice = found.choose()
    own = found.whole.variants.quantities_of_run().counts["calls"]
    assert choice.ended_early and choice.left_out == ("e00",) and choice.within_tolerance
    assert (
        choose.SEARCH_BUDGET_IN_RUNS * own < choice.calls_of_search < (choose.SEARCH_BUDGET_IN_RUNS + 10) * own
        and max(shares) == 1.0
    )
    assert not chooser(monkeypatch, quantity, names[:5]).choose().ended_early


def test_what_steps_change_is_told_by_shorter_ones_that_have_the_same_times(monkeypatch):
    """25 times as long is told by 1, not by 2, whose rows fall between."""
    found = chooser(monkeypatch, lambda left_out, times: 100.0 + 0.01 * times, ("a",))
    monkeypatch.setattr(found.whole.variants, "step_factors", lambda: [1, 2, 5, 25])
    asked = []
    monkeypatch.setattr(found.whole.variants, "quantities_of_run", lambda left_out=(), times=1: asked.append(times))
    found.change_with_longer_steps(frozenset(), 25)
    assert 2 not in asked and 1 in asked


def test_what_the_confirmation_breaks_is_taken_back(monkeypatch):
    """Longer steps hide what an effect does: the screen takes them, the whole run at its own step does not."""

    def quantity(left_out, times):
        return 100.0 + (0.5 if "a" in left_out else 0.0) + (30.0 if "b" in left_out and times == 1 else 0.0)

    own = chooser(monkeypatch, quantity, ("a", "b"))
    own.screen.variants._run = lambda left_out, times: Made._run(own.screen.variants, left_out, max(2, times))
    own.screen.variants._quantities_of_variant.clear()
    own.whole.variants._quantities_of_variant.clear()
    monkeypatch.setattr(own.whole.variants, "_run", lambda left_out, times: Made._run(own.whole.variants, left_out, 1))
    choice = own.choose()
    assert choice.left_out == ("a",) and choice.within_tolerance and choice.confirmed_change[0] == pytest.approx(0.005)


def test_steps_of_the_screen_are_shorter_where_a_run_fails_late(monkeypatch):
    """Steps that do for the first part of a scene, and fail after it, are neither taken nor told as the scene's."""
    own = Made(lambda left_out, times: 100.0 + len(left_out), ("a",))
    run, own._run = own._run, lambda left_out, times: None if times > 2 else run(left_out, times)
    part = Made(own.function, ("a",))
    monkeypatch.setattr(own, "window", lambda steps: part)
    own.system.PART_REPRESENTS_RUN = True
    monkeypatch.setattr(choose, "Variants", lambda scene, engine, executor: own)
    found = EffectChooser(None, "", ["q"], 0.05)
    assert (
        found._longest_allowed_step(EffectScreen(part, ["q"]), frozenset(), part.step_factors(), 0.05)[0] == 4
        and found.step_factor == 2
    )


def hub_forces(**more):
    from models.systems.hub_forces.scene import build

    table = {
        "title": "t",
        "system": "hub-forces",
        "effects": "auto",
        "quantities": ["rms z"],
        "tolerance": 0.05,
        "vehicle": {"file": "r19_free", "chassis": "body"},
        "road": {"iso8608": "B", "speed": 20.0},
    }
    return build(table | {"run": {"duration": 0.5, "step": 1e-3}, "forces": {"sampling_rate": 500.0}} | more, "t")


def test_a_part_of_a_run_has_a_length_that_the_scene_may_have():
    """125 steps of 500 are whole steps of the run, and no whole samples of 2 ms."""
    variants = Variants(hub_forces(), "mujoco")
    assert variants.system.step_count(variants.window(125).scene) == 180
    assert (
        variants.system.step_count(Variants(hub_forces(forces={"sampling_rate": 1000.0}), "").window(125).scene) == 125
    )


def test_the_study_chooses_where_a_plan_must_know_the_engine(tmp_path, monkeypatch):
    monkeypatch.setattr("studies.choice.choice_figure", lambda found, path: None)
    scene = hub_forces(run={"duration": 0.04, "step": 1e-3})
    checked_study(scene, ("exudyn", "mujoco"))
    (found,) = study.run(scene, ("exudyn", "mujoco"), tmp_path, lambda said, share: None)["answer"]
    assert found["implementation"] == "mujoco" and found["kept"]


def test_what_only_rounds_does_not_move():
    scene = half_car(effects={}, quantities=["z1_rate"])  # 2e-17 m/s at rest
    with pytest.raises(InputError, match="does not move"):
        EffectChooser(scene, "reference", scene.quantities, scene.tolerance)
    answer = RunQuantities(
        {"a": Quantity("N", (np.array([5e4, 5e4 + 1e-7]),)), "b": Quantity("m", (np.zeros(2),))}, {}, 0.0
    )
    assert (
        reference_sizes_of_cases(answer.quantity("a").case_values)[0]
        < rounding_floor(answer, "N")
        == pytest.approx(5e-6)
    )
    assert rounding_floor(answer, "m") == 1e-15


def test_drawn_half_cars_keep_their_tolerance_by_runs_of_their_own():
    asked = draw_scene("pitch-plane", 3)
    choice = EffectChooser(asked.scene(), "reference", list(asked.quantities), asked.tolerance).choose()
    assert (
        choice.within_tolerance
        and (choice.confirmed_change <= asked.tolerance).all()
        and choice.calls[2] < choice.calls[0]
    )


def test_a_spring_that_hardly_pulls_goes_and_the_road_stays():
    scene = half_car()
    own = EffectChooser(scene, "reference", scene.quantities, scene.tolerance)
    assert own.tolerance_share(frozenset(["pitch_spring"])) < 1.0 < own.tolerance_share(frozenset(["road"]))
    assert "road" not in own.choose().left_out


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"quantities": []}, "quantities"),
        ({"tolerance": 2.0}, "tolerance"),
        ({"study": "single_run"}, "quantities"),
        ({"effects": "auto", "study": "single_run"}, "study"),
        ({"effects": "all"}, "effects"),
        ({"quantities": ["pitch", "f1", "pitch"]}, "quantities"),
    ],
)
def test_half_a_question_is_refused_with_its_place(change, place):
    with pytest.raises(InputError) as error:
        half_car(**change)
    assert error.value.place == place


def test_auto_alone_names_the_study():
    from models.systems.wheelset.scene import build

    scene = build(
        {
            "title": "t",
            "system": "wheelset",
            "effects": "auto",
            "quantities": ["y"],
            "tolerance": 0.01,
            "speeds": {"values": [10.0]},
        },
        "t",
    )
    assert scene.study == "choice" and scene.tolerance == 0.01


def test_seconds_have_no_say_in_what_is_chosen(monkeypatch):
    """A clock that runs wild changes the seconds that are reported, and nothing else of the choice."""
    asked, draw, found = draw_scene("pitch-plane", 4), np.random.default_rng(1), []
    for clock in (time.process_time, lambda: float(draw.exponential(1e3))):
        monkeypatch.setattr("time.process_time", clock)
        found.append(EffectChooser(asked.scene(), "reference", list(asked.quantities), asked.tolerance).choose())
    one, two = (
        replace(choice, seconds=(), predicted_change=0, prediction_remainder=0, confirmed_change=0, statistical_error=0)
        for choice in found
    )
    assert one == two and found[0].seconds != found[1].seconds
    assert np.array_equal(found[0].confirmed_change, found[1].confirmed_change)


def test_work_is_calls_times_what_each_goes_through():
    own = Made(lambda left_out, times: 1.0, ("a", "b"))
    assert own.work(frozenset()) == 100 * (2 + 2) and own.work(frozenset("a"), 4) == 25 * (2 + 1)


def test_unknown_quantities_and_systems_without_runs_are_refused():
    scene = half_car(quantities=["yaw"])
    with pytest.raises(InputError, match="yaw"):
        EffectChooser(scene, "reference", scene.quantities, scene.tolerance)
    with pytest.raises(InputError, match="pictures"):
        Variants(type("Other", (), {"system": "pictures", "file": "t"}), "reference")
    assert "pictures" in KNOWN_SYSTEMS


def test_prices_name_costs_and_changes_and_why_there_is_none():
    found = price_list(half_car(), "reference")
    prices = {price.name: price for price in found.prices}
    assert prices["road"].there and not prices["gyro"].there
    assert "gyro" in prices["gyro"].gone and prices["gyro"].changes[0].relative == 0.0
    assert prices["road"].changes[0].relative > 0.1 > max(c.relative for c in prices["pitch_spring"].changes)
    assert "wheel_forces" in prices["contact_points"].why and not prices["contact_points"].counts[0]
    text = "\n".join(price_list_lines(found, ["pitch"]))
    assert "road" in text and "no price" in text and json.dumps(as_dict(found))
