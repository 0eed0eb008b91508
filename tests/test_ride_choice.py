"""Effects of a ride scene chosen by its quantities: reduced systems, screen, certificate, choice, refusals."""

import json
from dataclasses import replace

import numpy as np
import pytest
import xarray

from models.advice.ride_choice.choose import Chooser
from models.advice.ride_choice.march import March
from models.advice.ride_choice.marched import comparison_of_steps, confirms_step
from models.advice.ride_choice.modes import stable_step
from models.advice.ride_choice.neighbourhood import Neighbourhood
from models.advice.ride_choice.parameters import scaled_vehicle
from models.advice.ride_choice.reduced import FullScene
from models.advice.ride_choice.screen import Screen, exact_variances
from models.core.errors import InputError
from models.engines.spatial_protocol import build as build_engine
from models.ride.covariance import stationary_covariance
from models.ride.excited import vehicle_with_road
from models.systems.ride.omissions import effects_of
from models.systems.ride.reduced_scene import ReducedScene, reduced_without, refusal_reason
from models.systems.ride.scene import build
from models.vehicles.spatial_linear import linearise
from models.vehicles.vehicle_file import load_vehicle
from studies.command.asked import SCENES_FOLDER
from validation.choice.judged import measured_step, worst_nearby
from validation.choice.sampled import SampledStatistics
from validation.ride.drawn_rides import random_linear_ride

SPEED = 20.0


def held(name="half_car", tyre_damping=0.0, **road):
    scene = build(
        {"title": "t", "system": "ride", "vehicle": {"file": name}, "road": road, "speeds": {"values": [SPEED]}}, "t"
    )
    vehicle = load_vehicle(name)
    tyres = tuple(replace(tyre, damping=tyre_damping) for tyre in vehicle.tyres)
    return ReducedScene(scene, replace(vehicle, tyres=tyres))


def named(scene):
    return {effect.name: effect for effect in effects_of(scene)}


def deviations(scene, *names):
    own = named(scene)
    return stationary_covariance(
        FullScene(scene, SPEED).reduced(reduced_without(scene, [own[name] for name in names])).system
    ).deviation


def of_vehicle(scene, vehicle):
    return stationary_covariance(vehicle_with_road(linearise(vehicle), scene.excitation(), SPEED)).deviation


def test_nothing_left_out_is_the_system_itself():
    scene = held("seven_freedoms", 100.0)
    whole = FullScene(scene, SPEED)
    own = vehicle_with_road(whole.linear, whole.excitation, SPEED)
    assert np.abs(whole.full.system.A - own.A).max() < 1e-11 * np.abs(own.A).max()
    assert np.abs(whole.full.left @ whole.full.T - np.eye(len(own.A))).max() < 1e-12


@pytest.mark.parametrize(("name", "small"), [("half_car", 1e-5), ("seven_freedoms", 1e-5)])
def test_wheels_without_mass_are_the_limit_of_light_ones(name, small):
    scene = held(name)
    bodies = tuple(
        replace(b, mass=small * b.mass) if b.name in {t.body for t in scene.vehicle.tyres} else b
        for b in scene.vehicle.bodies
    )
    light = of_vehicle(scene, replace(scene.vehicle, bodies=bodies))
    assert deviations(scene, "mass of all wheels") == pytest.approx(light, rel=1e-4, abs=1e-9)  # error of order small


def test_rigid_springs_and_locked_freedoms_are_limits():
    drew = random_linear_ride(
        2
    )  # a car with bushings; undamped tyres, for white noise never lets a stiff spring come to rest
    tyres = tuple(replace(tyre, damping=0.0) for tyre in drew.scene.vehicle.tyres)
    one = replace(drew, scene=replace(drew.scene, vehicle=replace(drew.scene.vehicle, tyres=tyres)))
    own = named(one.scene)
    bush = next(name for name in own if name.startswith("bushings"))
    stiff = tuple(
        replace(s, stiffness=1e4 * s.stiffness, damping=1e2 * s.damping) if "bush" in s.name else s
        for s in one.scene.vehicle.springs
    )
    limit = of_vehicle(one.scene, replace(one.scene.vehicle, springs=stiff))
    found = deviations(one.scene, bush)
    told = np.isfinite(limit) & (limit > 1e-6)
    assert found[told] == pytest.approx(limit[told], rel=2e-3)  # compliance 1e-4 of a few per cent's effect
    scene = held()
    heavy = tuple(
        replace(b, inertia=((0.0,) * 3, (0.0, 1e12, 0.0), (0.0,) * 3)) if b.name == "body" else b
        for b in scene.vehicle.bodies
    )
    front = [output.name for output in scene.vehicle.outputs].index("body front")
    limit = of_vehicle(scene, replace(scene.vehicle, bodies=heavy))[front]
    assert deviations(scene, "body ry")[front] == pytest.approx(limit, rel=1e-6)


def test_roads_without_delay_and_second_corner():
    alike = held(front_rear="equal")
    assert deviations(held(), "delay front to rear") == pytest.approx(deviations(alike), rel=1e-9)
    assert deviations(held(cutoff=50.0), "second corner of the road") == pytest.approx(deviations(held()), rel=1e-9)


def test_what_saves_no_calls_stays():
    """A wheel without mass is a slower call than the hop that it saves: two states less, but 35 % more calls."""
    scene = held("quarter_car")
    mass = named(scene)["mass of all wheels"]
    chooser = Chooser(scene, [SPEED], ["travel front left"], 0.3)
    choice = chooser.choose()
    assert chooser.holds(chooser.confirmed_changes(frozenset([mass]))) and not choice.left_out
    assert chooser.cost(frozenset([mass])).calls > chooser.cost(frozenset()).calls
    assert choice.cost_after == choice.cost_before


def test_identity_and_screen_of_a_small_change():
    scene = held("seven_freedoms", 50.0)
    whole, rows = FullScene(scene, SPEED), [0, 2, 4]
    screen, effect = Screen(whole.full, rows), named(scene)["tyre damping"]
    rest = whole.reduced(reduced_without(scene, [effect]))
    two, one = screen.certificate_sides(rest)
    assert np.abs(two / one - 1).max() < 1e-12
    full = screen.extended_solution.variance.astype(float)
    predicted, true = (np.sqrt(v / full) - 1 for v in (screen.predicted_variances(rest), exact_variances(rest, rows)))
    assert np.all((predicted / true > 0.9) & (predicted / true < 1.1)) and np.all(true > 1e-3)


def test_wheel_mass_needs_the_tyre_damper_and_says_so():
    own = named(held(tyre_damping=100.0))
    mass, damper = own["mass of all wheels"], own["tyre damping"]
    assert "leave out tyre damping, too" in refusal_reason([mass]) and not refusal_reason([mass, damper])
    assert not refusal_reason([named(held())["mass of all wheels"]])
    assert "cannot be left out beside" in refusal_reason([mass, damper, own["mass of the wheels of axle 1"]])


def test_stable_step_of_runge_kutta():
    assert stable_step(np.array([-10.0])) == pytest.approx(0.2785, abs=6e-4)  # 2.785 on the real axis
    assert stable_step(np.array([10j])) == pytest.approx(0.2828, abs=6e-4)  # 2 sqrt(2) on the imaginary one
    assert stable_step(np.array([1.0])) == 0.0


def test_the_published_pair_is_found_and_reported(twinrig, capsys):
    assert twinrig("run", "ride_choice", "--out", "out", "--json") == 0
    found = json.loads(capsys.readouterr().out)["answer"]
    assert {"mass of all wheels", "tyre damping"} <= set(found["left out"]) and found["kept"]
    assert all(abs(change) <= 0.03 for error in found["errors"].values() for change in error.values())
    assert found["step limit"][1] / found["step limit"][0] > 28.3  # the published 691 and 24 1/s
    assert found["calls"][0] / found["calls"][1] == pytest.approx(6.35, rel=0.05)  # by two runs of many copies


def test_a_tolerance_that_holds_because_errors_cancel_is_refused_with_its_reason(twinrig, capsys):
    """Together the pair changes pitch acceleration by 1.9 %, tyre damping alone by 2.5 %."""
    assert twinrig("run", "ride_choice", "--set", "tolerance=0.02", "--out", "out", "--json") == 0
    found = json.loads(capsys.readouterr().out)["answer"]
    assert not found["left out"] and "tyre damping alone changes pitch acceleration by +2.51 %" in found["said"][0]


def test_a_quantity_that_symmetry_silences_is_refused_not_held_to_its_rounding():
    """Both axles of a symmetric half car meet the same at once: it does not pitch."""
    scene = build(
        {
            "title": "t",
            "system": "ride",
            "vehicle": {"file": str(SCENES_FOLDER / "vehicles/pitch_plane.toml")},
            "road": {"front_rear": "equal"},
            "speeds": {"values": [SPEED]},
        },
        "t",
    )
    own = ReducedScene.complete(scene)
    with pytest.raises(InputError, match="finite standard deviation above zero"):
        Chooser(own, [SPEED], ["pitch acceleration"], 0.02)
    assert Chooser(own, [SPEED], ["body centre"], 0.02).choose().within_tolerance


ASKING = {
    "title": "t",
    "system": "ride",
    "study": "ride_choice",
    "vehicle": {"file": "half_car"},
    "effects": "auto",
    "quantities": ["body front"],
    "tolerance": 0.02,
    "speeds": {"values": [SPEED]},
}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"quantities": []}, "quantities"),
        ({"tolerance": None}, "tolerance"),
        ({"study": "ride"}, "ride_choice"),
        ({"effects": None, "study": "ride"}, "quantities"),
        ({"tolerance": 1.5}, "below 1"),
        ({"quantities": ["body front", "body front"]}, "names 'body front' twice"),
    ],
)
def test_scenes_that_ask_half_a_question(change, said):
    table = {key: value for key, value in {**ASKING, **change}.items() if value is not None}
    with pytest.raises(InputError, match=said):
        build(table, "mine.toml")


def test_a_vehicle_that_is_free_to_drive_away_is_refused(twinrig, capsys):
    assert twinrig("run", "ride_choice", "--set", "vehicle.file=r19_free", "--out", "out") == 2
    assert "nothing pulls back" in capsys.readouterr().err


def test_a_quantity_that_is_none(twinrig, capsys):
    assert twinrig("run", "ride_choice", "--set", "quantities=['body center']", "--out", "out") == 2
    assert "did you mean 'body centre'" in capsys.readouterr().err


def test_rounding_is_not_taken_for_white_noise():
    """Wheels without mass on rigid bushings: no noise of the road reaches the body, but 1e-18 of it by rounding."""
    drew = random_linear_ride(38, 0.02)
    own = Chooser(drew.scene, [drew.speed], drew.quantities, drew.tolerance)
    choice = own.choose()
    assert {"mass of all wheels", "bushings: fl bush"} <= {effect.name for effect in choice.left_out}
    assert choice.predicted_change == pytest.approx(choice.confirmed_change, rel=0.2) and choice.within_tolerance


def test_options_of_copies_are_refused_where_a_vehicle_is_linear(twinrig, capsys):
    assert twinrig("run", "ride_choice", "--set", "options.copies=20", "--out", "out") == 2
    assert "there is a closed form" in capsys.readouterr().err


def test_a_tolerance_that_nothing_keeps_leaves_everything_and_says_what_would_change_that(twinrig, capsys):
    """Parts that change nothing at all may go even so; whatever stays says from which tolerance it would not matter."""
    assert twinrig("run", "ride_choice", "--set", "tolerance=1e-12", "--out", "out", "--json") == 0
    found = json.loads(capsys.readouterr().out)["answer"]
    assert found["kept"] and all(abs(error["confirmed"]) <= 1e-12 for error in found["errors"].values())
    assert set(found["would matter no more above"]) <= set(found["stay"]) and found["would matter no more above"]


def test_a_choice_whose_identity_is_not_exact_is_not_taken(monkeypatch):
    """Neither what a sound certificate lets go nor any other set is reported as left out."""
    drew, exact = random_linear_ride(38, 0.02), Screen.certificate_sides

    def chooser():
        return Chooser(drew.scene, [drew.speed], drew.quantities, drew.tolerance)

    sound = frozenset(chooser().choose().left_out)
    monkeypatch.setattr(
        Screen, "certificate_sides", lambda own, rest: (exact(own, rest)[0] * (1 + 3e-12), exact(own, rest)[1])
    )
    doubtful = chooser()
    assert sound and not doubtful.choose().left_out
    assert sound in doubtful.uncertified_sets and not doubtful.within_tolerance(sound)


def drawn_speeds(seed):
    """A scene of a detailed vehicle, with what its choice leaves out as far as the tolerance of 2 % allows."""
    drew = random_linear_ride(seed, 0.02)
    chooser = Chooser(drew.scene, [0.7 * drew.speed, drew.speed, 1.3 * drew.speed], drew.quantities, drew.tolerance)
    return chooser, chooser.choose()


def test_the_tolerance_holds_between_speeds_and_with_parameters_off():
    chooser, choice = drawn_speeds(2)
    chosen = frozenset(choice.left_out)
    assert (
        chosen
        and choice.within_tolerance
        and abs(choice.change_with_parameters_off).max()
        > abs(choice.change_between_speeds).max()
        >= abs(choice.confirmed_change).max()
    )
    assert 0.3 < worst_nearby(chooser, chosen, 6, 1) <= abs(choice.change_with_parameters_off).max() / 0.02
    saving = measured_step(chooser, chosen) / measured_step(chooser, frozenset())
    assert saving == pytest.approx(choice.cost_before.calls / choice.cost_after.calls, rel=0.02)


def test_spectra_near_a_scene_are_those_of_the_exact_solve():
    drew = random_linear_ride(2)
    rest = reduced_without(drew.scene, [named(drew.scene)["springs of part on body"]])
    rows = [[output.name for output in drew.scene.vehicle.outputs].index(name) for name in drew.quantities]
    near = Neighbourhood(drew.scene, np.array([10.0, 30.0]), [(row, "") for row in rows])
    corner = near.corners(rest)[0]
    for factors in ({}, corner):
        found = near.changes(rest, factors)
        for i in (0, len(near.speeds) // 2):
            full, left = (replace(one, vehicle=scaled_vehicle(one.vehicle, factors)) for one in (drew.scene, rest))
            whole = FullScene(full, float(near.speeds[i]))
            exact = np.sqrt(exact_variances(whole.reduced(left), rows) / exact_variances(whole.full, rows)) - 1
            assert found[i] == pytest.approx(exact, abs=2e-4)  # what the panels leave
    assert abs(near.changes(rest, corner)[:, 0]).max() > abs(near.changes(rest)[:, 0]).max()


def test_a_run_does_what_the_closed_form_of_runs_says():
    """Steps of 80 % of the stable one change deviations by per cents; a planted 10 % longer step is seen."""
    scene = held("half_car", cutoff=50.0)
    march = March(FullScene(scene, SPEED).full, SPEED, (0, 2), ())
    step = 0.8 * march.longest_stable_step
    assert confirms_step(march, step)
    run = comparison_of_steps(march, step)
    wrong = march.deviations(1.1 * step) / march.deviations(step / 4)
    assert (abs(run.deviation_ratio - wrong) > 4 * run.error).any()


@pytest.mark.parametrize(
    "road",
    [{}, {"cutoff": 50.0}, {"front_rear": "uncorrelated"}, {"front_rear": "equal"}],
    ids=["first", "second", "apart", "together"],
)
def test_two_closed_forms_of_runs_agree(road):
    """A sum over frequencies and a covariance of steps, under white noise from damped tyres, too."""
    scene = held("half_car", tyre_damping=300.0, **road)
    march = March(FullScene(scene, SPEED).full, SPEED, (0, 2), ())
    for share in (0.9, 0.2):
        step = share * march.longest_stable_step
        assert SampledStatistics(march).deviations(step) == pytest.approx(march.deviations(step), rel=1e-3)
    late = replace(march, reduced=replace(march.reduced, excitation=further(march.reduced.excitation)))
    if scene.ride_scene.road.front_rear == "delayed":
        assert SampledStatistics(late).deviations(step) != pytest.approx(march.deviations(step), rel=3e-3)


def further(excitation):
    """Its second axle a fifth of the wheelbase further back."""
    return replace(excitation, lengths=tuple(1.2 * length for length in excitation.lengths))


def test_the_reduced_vehicle_runs_as_it_stands(twinrig, capsys, empty_folder):
    """Its deviations are those that were confirmed, by the study of the whole vehicle."""
    assert twinrig("run", "ride_choice", "--out", "out", "--json") == 0
    changes = json.loads(capsys.readouterr().out)["answer"]["errors"]
    assert twinrig("run", "out/reduced.toml", "--out", "left", "--json") == 0
    scene = SCENES_FOLDER / "vehicles" / "pitch_plane.toml"
    (empty_folder / "whole.toml").write_text(f"""title = "w"
system = "ride"
[vehicle]
file = "{scene}"
[speeds]
values = [20.0]
""")
    assert twinrig("run", "whole.toml", "--engine", "reference", "--out", "whole", "--json") == 0
    with xarray.open_dataset("left/deviations.nc") as left, xarray.open_dataset("whole/deviations.nc") as full:
        found = left.deviation[0, 0, 0].values / full.deviation[0, 0, 0].values - 1.0
    assert found[:2] == pytest.approx([error["confirmed"] for error in changes.values()], rel=1e-6)


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ('massless = ["wheel"]', "no such body"),
        ('rigid = ["none"]', "no such spring"),
        ('locked = [["body", "rz"]]', "no such freedom of a body"),
    ],
)
def test_limits_of_parts_that_a_vehicle_has_not(table, said, empty_folder):
    text = (SCENES_FOLDER / "vehicles" / "pitch_plane.toml").read_text()
    (empty_folder / "mine.toml").write_text(f"{text}\n[reduced]\n{table}\n")
    with pytest.raises(InputError, match=said):
        load_vehicle("mine.toml", empty_folder, allows_reduced_vehicle=True)


def test_a_reduced_vehicle_is_refused_where_it_would_be_read_as_a_whole_one(empty_folder):
    text = (SCENES_FOLDER / "vehicles" / "pitch_plane.toml").read_text()
    (empty_folder / "mine.toml").write_text(f'{text}\n[reduced]\nmassless = ["front wheel"]\n')
    with pytest.raises(InputError, match="only the study ride"):
        load_vehicle("mine.toml", empty_folder)
    with pytest.raises(InputError, match="reduced vehicle"):
        build_engine("mujoco", load_vehicle("mine.toml", empty_folder, allows_reduced_vehicle=True))
