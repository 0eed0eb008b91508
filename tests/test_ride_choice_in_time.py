"""Effects of rides on bent springs: copies that meet the same roads, what chance may add, choice, price, refusals."""

import json
from dataclasses import replace

import numpy as np
import pytest

from models.advice.choice.answer import sampled_change_and_error
from models.advice.choice.choose import EffectChooser
from models.advice.choice.screen import EffectScreen
from models.advice.choice.systems.ride import copies_of_scene
from models.advice.choice.variants import Variants
from models.advice.price import effects
from models.advice.price.effects import price_list
from models.advice.price.effects_text import price_list_lines
from models.advice.ride_choice.in_time import FEWEST_COPIES, reduced_vehicle
from models.core.errors import InputError
from models.ride.statistical_linearisation import nonlinear_springs
from models.systems.ride.reduced_scene import ReducedScene
from models.systems.ride.scene import build
from models.vehicles.spatial_linear import linearise
from models.vehicles.vehicle_file import load_vehicle
from validation.ride.drawn_rides import random_nonlinear_ride

LAWS = ("curves over rate", "curves over travel", "friction")


def quarter_car(**more):
    table = {
        "title": "t",
        "system": "ride",
        "effects": "auto",
        "quantities": ["body front"],
        "tolerance": 0.05,
        "vehicle": {"file": "quarter_car_nonlinear"},
        "road": {"level": 6.4e-5},
        "speeds": {"values": [20.0]},
        "options": {"copies": 16, "lasting": 2.0},
    }
    return build(table | more, "t")


def test_chance_is_the_error_of_a_ratio_of_means():
    draw = np.random.default_rng(5)
    full = draw.gamma(4.0, size=(2000, 40))  # 2000 experiments of 40 samples each
    rest = full * draw.normal(1.02, 0.05, full.shape)
    found = [sampled_change_and_error((b - a,), (a,)) for a, b in zip(full, rest, strict=True)]
    roots = np.sqrt(rest.mean(axis=1) / full.mean(axis=1)) - 1.0
    assert [one for one, _ in found] == pytest.approx(abs(roots))
    off, beside = abs(roots - (np.sqrt(1.02) - 1.0)), np.array(found)[:, 1]
    assert 0.99 < np.mean(off <= beside) < 1.0  # 0.997 of them for normal samples; these are skewed


def test_a_change_that_is_the_same_in_all_samples_is_sure_and_nothing_left_is_all():
    own = np.array([1.0, 2.0, 5.0])
    assert sampled_change_and_error((0.21 * own,), (own,)) == pytest.approx((0.1, 0.0))
    assert sampled_change_and_error((-own,), (own,)) == (1.0, 0.0)
    assert sampled_change_and_error((-2.0 * own,), (own,)) == (np.inf, np.inf)


def test_longer_steps_meet_the_same_roads():
    whole = copies_of_scene(quarter_car())
    pace = whole.steps_at_speeds[0]
    one, two = (scene.mean_squares(pace, scene.roads(pace))[1] for scene in (whole, whole.in_longer_steps(2)))
    other = whole.mean_squares(
        pace, copies_of_scene(quarter_car(options={"copies": 16, "lasting": 2.0, "seed": 2})).roads(pace)
    )[1]
    assert np.array_equal(whole.in_longer_steps(2).roads(pace), whole.roads(pace)[::2])
    same, apart = (sampled_change_and_error((rest[:, 0] - one[:, 0],), (one[:, 0],)) for rest in (two, other))
    assert 0.0 < same[0] < 0.02 and apart[1] > 10.0 * same[1]  # other roads tell next to nothing


def test_what_is_left_out_is_gone_and_gains_stand_for_it():
    whole = copies_of_scene(quarter_car())
    rest = whole.without(LAWS)
    (spring,) = nonlinear_springs(whole.vehicle(whole.steps_at_speeds[0]))
    (gains,) = rest.vehicle(rest.steps_at_speeds[0]).springs
    assert not nonlinear_springs(rest.vehicle(rest.steps_at_speeds[0])) and rest.effect_names == ("body z",)
    k, c = whole.steps_at_speeds[0].springs[spring.name].equivalent_gains
    assert (gains.stiffness, gains.damping) == pytest.approx((k, c))  # those of statistical linearisation
    with pytest.raises(InputError, match="closed form"):
        copies_of_scene(quarter_car(vehicle={"file": "quarter_car_nonlinear", "small_motion": True}))


def test_a_mount_that_is_left_out_seats_its_body_on_the_other():
    vehicle = load_vehicle("r19_ride")
    names = frozenset(spring.name for spring in vehicle.springs if spring.first_body == "engine")
    scene = quarter_car(vehicle={"file": "r19_ride"}, quantities=["body centre"])
    found = reduced_vehicle(ReducedScene(scene, vehicle, rigid=names), {})
    assert len(found.coordinates()) == len(vehicle.coordinates()) - 6
    before, after = (linearise(own) for own in (vehicle, found))
    mass = sum(body.mass for body in vehicle.bodies if body.name in ("engine", "body"))
    assert after.mass[0, 0] == pytest.approx(mass) and before.mass[0, 0] < 0.95 * mass


def test_a_choice_is_kept_and_says_what_chance_may_add():
    scene = quarter_car()
    choice = EffectChooser(scene, "reference", scene.quantities, scene.tolerance).choose()
    assert choice.within_tolerance and choice.left_out and choice.step_factor > 1
    assert scene.tolerance - choice.confirmed_change[0] >= choice.statistical_error[0] > 0.0


def test_few_copies_find_what_all_of_them_tell():
    scene = quarter_car(options={"copies": 48, "lasting": 2.0})
    own = EffectChooser(scene, "reference", scene.quantities, scene.tolerance)
    copies = [one.variants.scene.samples.copies for one in (own.screen, own.reporting_screen, own.whole)]
    assert (
        copies == [12, 48, 48]
        and own.screen.variants.scene.step_factor == own.reporting_screen.variants.scene.step_factor == own.step_factor
    )


def test_what_a_search_may_take_is_shown_beforehand(twinrig, capsys):
    assert (
        twinrig(
            "show", "ride_choice", "--set", "vehicle.file=quarter_car_nonlinear", "--set", "quantities=['body front']"
        )
        == 0
    )
    assert "among 4 effects; the search ends at the calls of 100 runs" in capsys.readouterr().out


def test_a_choice_that_chance_alone_could_break_is_refused():
    asked = random_nonlinear_ride(4)
    with pytest.raises(InputError, match="times as many samples would tell"):
        EffectChooser(asked.prepared_in_time(FEWEST_COPIES), "reference", list(asked.quantities), 0.005).choose()


def test_a_quantity_that_one_sample_makes_up_is_refused():
    variants = Variants(quarter_car(), "reference")
    answer = variants.quantities_of_run()
    name = "body front"
    lone = replace(answer.quantities[name], case_values=(np.array([1.0, *[0.01] * 15]),))
    variants._quantities_of_variant[frozenset(), 1] = replace(answer, quantities={**answer.quantities, name: lone})
    with pytest.raises(InputError, match="made up to 87 % by one sample of 16"):
        EffectScreen(variants, [name])


def test_prices_of_a_ride_on_bent_springs_say_what_chance_may_add(monkeypatch):
    monkeypatch.setattr(effects, "TIMING_ROUNDS", 3)
    found = price_list(quarter_car())
    prices = {price.name: price for price in found.prices}
    before, after = prices["friction"].counts
    assert set(LAWS) < set(prices) and after["terms"] == before["terms"] + 1
    rate = {change.name: change for change in prices["curves over rate"].changes}["body front"]
    assert rate.chance > 0.0 and rate.relative > 0.01
    assert " +- " in "\n".join(price_list_lines(found, ["body front"])).partition("body front by")[2]
    assert "weighting" in prices and "not read by runs in time" in prices["weighting"].why


def test_the_study_tells_the_choice(twinrig, capsys):
    asked = (
        "--set",
        "vehicle.file=quarter_car_nonlinear",
        "--set",
        "quantities=['body front']",
        "--set",
        "options.copies=16",
        "--set",
        "options.lasting=2.0",
        "--set",
        "tolerance=0.05",
    )
    assert twinrig("run", "ride_choice", *asked, "--out", "out", "--json") == 0
    (found,) = json.loads(capsys.readouterr().out)["answer"]
    assert found["kept"] and found["errors"]["body front"]["chance"] > 0.0
    assert twinrig("run", "ride_choice", *asked, "--engine", "mujoco", "--out", "other") == 2
    assert "leave it out" in capsys.readouterr().err
