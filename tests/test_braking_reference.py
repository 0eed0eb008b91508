"""The independent reference of braking on the suspension: its laws, its accelerations, its stops, and its limits."""

import math
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from scipy.special import bernoulli

from models.brake import plain
from models.brake.plain.suspension import PlainSuspension
from models.brake.plain.wheel import TyreForceCurve, WheelStepData, advance_slip_along_nodes, wheel_step
from models.brake.plane_vehicle import plane_of_truck
from models.brake.wheel_step import distance_integral
from models.core.errors import Refused, RunFailed
from models.systems.braking.plan import check
from models.systems.braking.run import run as drive
from models.systems.braking.scene import build
from validation.braking import plain_brakes as laws
from validation.braking import plain_sprung as whole
from validation.braking.plain_relaxation import braked_turn_difference
from validation.braking.sprung_box import box, car
from validation.cases import braking_reference as case


@pytest.mark.parametrize("name", case.FORCE_LAW_COMPARISONS)
@pytest.mark.grounds("plain counterpart")
def test_a_law_is_the_same_by_compiled_and_by_plain_code(name):
    both, bound, _ = case.FORCE_LAW_COMPARISONS[name]
    assert laws.largest_difference(*both(60, seed=5)) < bound


@pytest.mark.parametrize("size", [1e-6, 1e-3, 9.999e-3, 1.0001e-2, 0.3, 3.0])
def test_the_integral_of_a_slip_that_decays_is_exact_on_both_sides_of_its_series(size):
    for decay in (size, -size):
        # z / (1 - exp(-z)) - 1 by Bernoulli's numbers, whose series converges for |z| < 2 pi
        exact = sum(float(b) * decay ** (k - 1) / math.factorial(k) for k, b in enumerate(bernoulli(40)) if k > 1) + 0.5
        way = -math.expm1(-decay) / decay
        assert distance_integral(way, 1.0, decay, 1.0) == pytest.approx(exact * way, rel=1e-13)


def test_the_states_of_the_wheel_reach_every_branch():
    _, plain = laws.tyre_reports(100)
    slip, locked, turning = plain[:, 3], plain[:, 5], plain[:, 6]
    assert (locked > 0.0).sum() > 5 and (slip < -0.5).sum() > 5 and (slip > 1.0).sum() > 2
    assert ((turning == 0.0) & (locked > 0.0)).any() and ((turning != 0.0) & (locked > 0.0)).any()


def test_slip_between_nodes_follows_its_differential_equation():
    nodes, rates = np.array([0.0, 0.1, 0.4, 1.0]), np.array([3.0, 2.0, 2.0, 0.5])
    times = np.linspace(0.0, 0.2, 201)
    slips, areas = np.array([advance_slip_along_nodes(0.02, nodes, rates, time)[1:] for time in times[1:]]).T
    slopes = np.gradient(np.concatenate(([0.02], slips)), times)[1:-1]
    assert slopes == pytest.approx(np.interp(slips[:-1], nodes, rates), rel=2e-2)  # central differences at corners
    assert areas[-1] == pytest.approx(np.trapezoid(np.concatenate(([0.02], slips)), times), rel=1e-5)
    time, slip, _ = advance_slip_along_nodes(0.02, nodes, rates, 1e3)
    assert slip == 1.0 and time < 1e3


def test_a_wheel_keeps_its_momentum_whatever_it_does():
    force = TyreForceCurve(np.array([0.0, 0.1, 1.0]), np.array([0.0, 5e3, 4e3]))
    for torques, turning in (((800.0, 900.0), 30.0), ((2e4, 2e4), 0.0), ((0.0, 0.0), 0.0), ((5e3, 100.0), 0.0)):
        of = WheelStepData((10.0, 9.95), torques, 5.5e-3, 0.33, 1.7)
        turned, mean, _, locked = wheel_step(of, turning, force)
        if locked == 0.0:
            braked = 0.5 * sum(torques) * of.step
            assert of.inertia * (turned - turning) == pytest.approx(0.33 * mean * of.step - braked, abs=1e-10)
        else:
            assert mean <= 5e3 and turned * 0.33 <= 9.95


def test_loads_at_rest_are_those_of_levers():
    for own in (box(), car()):
        assert PlainSuspension(own).loads == pytest.approx(plane_of_truck(own.plane).static_loads, rel=1e-9)


@pytest.mark.grounds("plain counterpart")
@pytest.mark.parametrize(("name", "engine"), [("twin", "mujoco"), ("bent", "mujoco"), ("twin", "exudyn")])
def test_accelerations_are_those_of_the_engine(name, engine):
    compiled = whole.accelerations(whole.VEHICLES[name](), engine, 5)
    assert whole.relative_difference(compiled, whole.plain_accelerations(name, 5)) < 1e-12


def test_a_piece_of_a_stop_is_that_of_the_engine():
    own = whole.asymmetric_twin()
    assert whole.path_difference(whole.run(own, "mujoco", 0.03), whole.plain_run("twin", 0.03)) < 1e-11


def test_a_turn_on_relaxing_tyres_tends_to_its_written_equations_by_order_two():
    errors = [braked_turn_difference(0.6, substeps) for substeps in (1, 2)]
    assert 3.5 < errors[0] / errors[1] < 4.5 and errors[1] < 2e-4  # m, of some 60 m


def test_a_steady_circle_is_that_of_the_engine():
    found, plain = whole.steady_circle_pair(whole.asymmetric_twin())
    assert found[0] > 0.05 and np.abs(found - plain).max() < 1e-11


def test_a_stop_ends_where_that_of_the_engine_ends():
    stops = [whole.run(box(), engine, 1.0, False, 0.3) for engine in ("mujoco", "reference")]
    assert all(stop.ended_at_rest for stop in stops) and whole.path_difference(*stops) < 1e-11


def test_what_turns_over_and_what_is_too_stiff_is_told():
    vehicle = whole.braked_vehicle_on_springs(car(), "reference", False)
    start = vehicle.rolling(10.0)
    start.state[0, 4], start.state[1, 4] = 0.49, 5.0
    with pytest.raises(RunFailed, match="turns over"):
        vehicle.run(whole.controller(False), start, 0.1)
    with pytest.raises(Refused, match="at most"):
        replace(whole.braked_vehicle_on_springs(box(100.0), "reference", False), substeps=1).run(
            whole.controller(False), 2.0, 0.1
        )


def scene(**run):
    return build(
        {
            "title": "car",
            "system": "braking",
            "vehicle": {"file": "r19_free", "spin_inertia": 1.7},
            "road": {"stretches": [{"left": "wet"}]},
            "brakes": {"front": {"gradient": 300.0}, "rear": {"gradient": 100.0}, "supply": 2.0},
            "run": run,
            "procedures": {"straight": {"speed": 6.0}, "turn": {"kind": "turn", "speed": 6.0, "radius": 40.0}},
        },
        "scene.toml",
    )


def test_a_scene_is_run_by_the_reference_when_it_is_asked_for():
    own = scene(duration=0.05)
    check(own, ("reference",))
    for name in own.procedures:
        found, plain = (drive(own, engine, procedure=name) for engine in ("mujoco", "reference"))
        assert plain.data.attrs["engine"] == "reference" and whole.path_difference(found.detail, plain.detail) < 1e-11
        assert float(plain.data["load"][-1].min()) > 1e3


def test_the_plain_code_holds_no_compiled_function():
    names = [f"models.brake.plain.{path.stem}" for path in Path(plain.__file__).parent.glob("*.py")]
    for name in (*names, "models.engines.braking_sprung_plain"):
        assert not [key for key, value in vars(import_module(name)).items() if hasattr(value, "py_func")], name
