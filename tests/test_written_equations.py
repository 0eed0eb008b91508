"""Cars by their plain equations: beside both engines, law by law, through the command line; faults that they see."""

from dataclasses import replace

import numpy as np
import pytest

from models.core.errors import InputError, RunFailed
from models.core.systems import load
from models.engines.assembly import Settings
from models.engines.cut_vehicle import PLAIN_ENGINE
from models.engines.cut_vehicle import build as hub_model
from models.engines.free_vehicle import PlainModel
from models.multibody import forces as at
from models.multibody.plain.road import control_value, road_surface
from models.multibody.plain.rolling import EnergyLedger, TyreReport
from models.road.plane_waves import plane_waves
from models.systems.handling.run import build_in_engine, run
from studies.command.asked import SCENES_FOLDER, requested_engines
from validation.faults.campaign import seeing_checks
from validation.faults.written import CAMPAIGN
from validation.spatial.cars import static_forces
from validation.spatial.written_equations import (
    brush_force_difference,
    cut_car_acceleration_difference,
    cut_car_path_difference,
    cut_cars,
    inner_force_difference,
    nonlinear_spring_car,
    report_difference,
    rolling_acceleration_difference,
    rolling_cars,
    rolling_path_difference,
)

INSTANT, PATH = 1e-12, 1e-10
"""Demanded of accelerations, by the largest of their state, and of paths (m, rad, and their rates)."""


@pytest.mark.parametrize("name", ["r19_free", "twin"])
def test_a_cut_car_moves_as_in_mujoco(name):
    vehicle = cut_cars()[name]
    assert cut_car_acceleration_difference(vehicle, "mujoco", 18) < INSTANT
    assert cut_car_path_difference(vehicle, "mujoco", 0.01, on_rough_road=True) < PATH
    assert cut_car_path_difference(vehicle, "mujoco", 0.01, on_rough_road=False) < PATH


def test_what_is_felt_inside_is_that_of_its_own_state():
    """Section forces, wrenches and the moments that enforce angles, of several states in one report."""
    assert inner_force_difference(cut_cars()["twin"], 3) < INSTANT


@pytest.mark.parametrize("name", ["r19_free", "twin", "curved", "caravan", "train"])
def test_a_car_on_tyres_moves_as_in_mujoco(name):
    car = rolling_cars()[name]
    assert rolling_acceleration_difference(car, "mujoco", 9) < INSTANT
    assert report_difference(car, 9) < INSTANT
    assert rolling_path_difference(car, "mujoco", 0.01) < PATH


@pytest.mark.grounds("plain counterpart")
def test_a_car_on_tyres_accelerates_as_in_exudyn():
    """Whose compiled forces lie in one block of numbers."""
    assert rolling_acceleration_difference(rolling_cars()["twin"], "exudyn", 3) < INSTANT


def test_bristles_are_those_of_the_kernel():
    assert brush_force_difference(20) < INSTANT


def test_roads_and_controls_are_those_of_the_kernel():
    waves, rng = plane_waves(4e-6, seed=2), np.random.default_rng(1)
    x, y = rng.uniform(-200.0, 200.0, (2, 50))
    wanted = np.array(
        [at.road_height_and_slopes(waves.ravel(), len(waves), *place) for place in zip(x, y, strict=True)]
    )
    assert np.column_stack(road_surface(waves, x, y)) == pytest.approx(wanted, abs=1e-12 * np.abs(wanted).max())
    knots = ((0.1, 0.2), (0.5, -0.3), (0.5 + 1e-9, 0.4), (2.0, 1.0))
    table = np.array(knots).T.ravel()
    for t in (-1.0, 0.1, 0.3, 0.5, 1.2345, 2.0, 3.0):
        assert control_value(knots, t) == pytest.approx(
            at.control_value_and_rate(table, 0, 0, len(knots), t), rel=1e-14, abs=1e-15
        )
    assert control_value(((0.7, 3.0),), 0.0) == (3.0, 0.0)


def test_reports_have_the_columns_of_the_kernel():
    columns = [getattr(at, name.upper()) for name in TyreReport._fields]
    assert columns == list(range(at.REPORTED))
    assert [getattr(at, name.upper()) for name in EnergyLedger._fields] == list(range(at.LEDGER))


def test_engines_on_request_run_where_they_are_named():
    assert requested_engines("plain", "hub-forces") == ("plain",)
    assert requested_engines("reference", "handling") == ("reference",)
    assert (
        requested_engines("all", "hub-forces")
        == requested_engines(None, "hub-forces")
        == ("reference", "exudyn", "mujoco")
    )
    assert requested_engines(None, "handling") == ("exudyn", "mujoco")
    with pytest.raises(InputError, match="no such engine"):
        requested_engines("plain", "handling")


def test_a_scene_of_handling_runs_in_the_reference():
    """Every manoeuvre of the shipped scene, some steps of each; reports are the reference's own."""
    scene = load(
        SCENES_FOLDER / "handling.toml",
        [f"manoeuvres.{name}.duration=0.006" for name in ("step_steer", "lane_change", "brake_in_curve")],
    )
    for name in scene.manoeuvres:
        ours, theirs = (run(scene, engine, name) for engine in ("reference", "mujoco"))
        assert np.abs(ours["positions"] - theirs["positions"]).max() < PATH
        assert np.abs(ours["load"] - theirs["load"]).max() < 1e-8
        assert ours.data.attrs["engine"].startswith("reference")


def test_a_run_that_blows_up_fails():
    def blown(t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.full(len(q), np.inf)

    with pytest.raises(RunFailed):
        PlainModel(PLAIN_ENGINE, blown, 1, Settings("RK4", 1e-3, 0.01)).run()


def test_curves_of_the_description_press():
    """A car with curves is not the car without: the comparison of the curved one compares them."""
    car = rolling_cars()["curved"]
    without = car.changed(given=replace(nonlinear_spring_car(), springs=rolling_cars()["r19_free"].given.springs))
    q, v = car.straight(10.0)
    v[5:] += 0.3
    ours, others = (build_in_engine("reference", each).acceleration(0.0, q, v) for each in (car, without))
    assert np.abs(ours - others).max() > 0.1


def test_a_cut_car_rests_on_its_static_loads():
    vehicle = cut_cars()["twin"]
    still = np.zeros(vehicle.size)
    model = hub_model(PLAIN_ENGINE, vehicle, static_forces(vehicle, 3), 1e-3, 1e-3)
    assert np.abs(model.acceleration(0.0, still, still)).max() < 1e-9


@pytest.mark.parametrize(
    "name", ["bristles of all tyres 30 % stiffer", "stiffness and damping swapped in the table, cut"]
)
def test_faults_in_what_engines_share_are_seen(name):
    fault = next(fault for fault in CAMPAIGN.faults if fault.name == name)
    clean, planted = replace(CAMPAIGN, faults=(fault,)).measure()
    assert seeing_checks(clean) == [] and seeing_checks(planted) != []
