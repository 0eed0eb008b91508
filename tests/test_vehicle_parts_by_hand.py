"""Small functions of plain Python that engines share, by their definitions written out: parts of vehicles, the growth
of errors over a run, sensors, controllers, and controls of a measured file."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from models.core.noise import GYRO_BIAS, normal_samples
from models.core.systems import scene_of_table
from models.engines.stability import first_order, log_growth
from models.multibody.numbers import Handling, TyreParameters
from models.sensors.inertial_unit import bias_path
from models.systems.braking.of_scene import controller_of
from models.systems.braking.scene import build
from models.systems.pitch_plane.sampling import within_range
from models.vehicles.cut_vehicle import rigid_vehicle
from models.vehicles.free_vehicle import chassis_of, wheel_spin_inertia
from models.vehicles.kinematics import Kinematics
from models.vehicles.parameters import asymmetric_twin
from models.vehicles.pitch_plane import pitch_plane_vehicle
from models.vehicles.spatial import point_mass_inertia
from models.vehicles.vehicle_file import load_vehicle
from validation.spatial.cars import r19

pytestmark = pytest.mark.grounds("closed form")
R19 = load_vehicle("r19_free")
P = asymmetric_twin.PARAMETERS


def test_inertia_of_a_point_mass_is_the_sum_of_squares_across_each_axis():
    inertia = point_mass_inertia(2.5, np.array([0.3, 0.4, 0.1]))
    assert inertia == pytest.approx(
        2.5 * np.array([[0.17, -0.12, -0.03], [-0.12, 0.10, -0.04], [-0.03, -0.04, 0.25]]), rel=1e-12
    )


def test_a_wheel_spins_with_the_inertia_of_its_tyre_or_else_of_all():
    tyre = R19.tyres[0]
    assert wheel_spin_inertia(replace(tyre, spin_inertia=None), 1.75) == 1.75
    assert wheel_spin_inertia(replace(tyre, spin_inertia=2.25), 1.75) == 2.25
    car = Handling(R19, TyreParameters(spin_inertia=1.75)).vehicle
    rotors = [body.inertia for body in car.bodies if body.name.endswith("rotor")]
    assert rotors == 4 * [((0.0, 0.0, 0.0), (0.0, 1.75, 0.0), (0.0, 0.0, 0.0))]


def test_a_car_keeps_the_stiffness_of_its_bars_and_the_body_of_its_chassis():
    bars = {bar.name: bar.stiffness for bar in R19.bars}
    assert {bar.name: bar.stiffness for bar in Handling(R19).vehicle.bars} == bars and min(bars.values()) > 0.0
    body, chassis = next(body for body in R19.bodies if body.name == "body"), chassis_of(R19)
    assert (chassis.mass, chassis.position, chassis.inertia) == (body.mass, body.position, body.inertia)


def test_tyres_that_may_lift_are_the_same_tyres():
    lifting = R19.with_tyres(True)
    assert all(tyre.pushes_only for tyre in lifting.tyres)
    assert [replace(tyre, pushes_only=False) for tyre in lifting.tyres] == [
        replace(tyre, pushes_only=False) for tyre in R19.tyres
    ]
    assert lifting.gravity == R19.gravity


def test_struts_to_the_ground_are_the_tyres_of_a_vehicle_in_the_pitch_plane():
    tyres = pitch_plane_vehicle(P).tyres
    assert [(tyre.stiffness, tyre.damping) for tyre in tyres] == [(P.k1, P.d1), (P.k2, P.d2)]


@pytest.mark.parametrize("turned", [("rx", (0.0, -0.3, 0.8)), ("ry", (0.3, 0.0, -0.6)), ("rz", (-0.8, 0.6, 0.0))])
def test_an_axis_that_a_body_carries_changes_by_the_vector_product_with_each_turn(turned):
    """Axis (0.6, 0.8, 0.3): e_x x axis, and so on."""
    freedom, change = turned
    motion = Kinematics(R19)
    column = motion.coordinate("body", freedom)
    assert motion.turned_axis("body", (0.6, 0.8, 0.3)) @ column == pytest.approx(change, abs=1e-14)


def test_elements_know_their_length_along_their_axis_and_gauge_their_travel():
    for element in r19().elements:
        along = float(np.dot(element.axis, np.subtract(element.second_point, element.first_point)))
        assert element.design == pytest.approx(along, rel=1e-12, abs=1e-15)
        gauge = element.travel_gauge()
        assert (gauge.stiffness, gauge.damping, gauge.preload, gauge.friction) == (1.0, 0.0, 0.0, 0.0)
        assert (
            gauge.axis.tolist() == element.axis.tolist() and gauge.first_point.tolist() == element.first_point.tolist()
        )


def test_noise_of_one_force_turns_a_rigid_vehicle_about_its_arm():
    whole = rigid_vehicle(r19())
    deviation = np.zeros(24)
    deviation[8] = 3.0  # the second hub's force up
    turn = np.linalg.solve(whole.inertia, np.cross(whole.arms[1], [0.0, 0.0, 3.0]))
    assert whole.turning(deviation) == pytest.approx(np.outer(turn, turn), rel=1e-9, abs=1e-18)


def test_an_oscillator_grows_in_steps_of_euler_by_their_known_factor():
    """|1 + i w h| per step."""
    mass, damping, stiffness = (np.array([[value]]) for value in (2.5, 0.5, 90.0))
    undamped = (mass, 0.0 * damping, stiffness, 0.0 * damping, 0.0 * damping)
    assert first_order((mass, damping, stiffness, damping, damping)).tolist() == [[0.0, 1.0], [-36.0, -0.2]]
    wanted = 0.3 / 1e-3 * 0.5 * math.log1p(36.0 * 1e-6)
    assert log_growth("ExplicitEuler", 1e-3, 0.3, undamped) == pytest.approx(wanted, rel=1e-9)


def test_a_bias_starts_from_its_draw_and_forgets_by_its_time():
    """b = turn_on n0 + s x, x(0) = n1, x(k + 1) = f x(k) + sqrt(1 - f^2) n(k + 2), f = exp(-period / tau)."""
    draws = normal_samples(3, 1, 6, 1, noise_source=GYRO_BIAS)[:, 0]
    factor, state, wanted = math.exp(-0.25), draws[1], []
    for k in range(5):
        wanted.append(0.3 * draws[0] + 0.2 * state)
        state = factor * state + math.sqrt(1.0 - factor**2) * (draws[k + 2] if k < 4 else 0.0)
    assert bias_path(5, 0.5, 0.3, 0.2, 2.0, 3, 1) == pytest.approx(wanted, rel=1e-12)


def test_the_range_of_a_sensor_has_two_ends():
    assumed = within_range("gyro", {"gyro": "gyro"}, "rad/s", 2.5)
    assert (assumed.lower_limit, assumed.upper_limit) == (-2.5, 2.5)


def test_a_scene_s_controller_has_its_parameters():
    parameters = {"target": 0.085, "gain": 1.35, "reset": 0.075, "mix": 0.15}
    table = {"title": "t", "system": "braking", "procedures": {"stop": {"speed": 9.5}}}
    scene = build({**table, "controller": {"kind": "slip_pi", "parameters": parameters}}, "t.toml")
    made = controller_of(scene, 4, "stop")
    assert {name: getattr(made, name) for name in parameters} == parameters


def test_results_of_a_measured_drive_begin_at_the_time_of_its_file(tmp_path: Path):
    rows = "\n".join(f"{5.25 + 0.1 * k:.2f},{0.01 * k:.2f},{8.5:.2f}" for k in range(21))
    (tmp_path / "drive.csv").write_text(f"time [s],steer [rad],speed [m/s]\n{rows}\n")
    table = {"title": "t", "system": "handling", "manoeuvres": {"way": {"measured": "drive.csv"}}}
    scene = scene_of_table(table, "s.toml", tmp_path)
    assert scene.start_time("way") == pytest.approx(5.25, rel=1e-12)
    assert (scene.manoeuvres["way"].speed, scene.manoeuvres["way"].duration) == pytest.approx((8.5, 2.0), rel=1e-9)
