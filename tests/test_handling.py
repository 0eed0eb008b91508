"""A car on four rolling tyres: the brush, the free vehicle, scenes, and both engines."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from models.core.errors import InputError, RunFailed
from models.multibody import forces
from models.multibody.numbers import Controls, Handling, Push, TyreParameters
from models.road.plane_waves import plane_waves
from models.systems.handling.run import SimulatedDrive, drive_run
from models.systems.handling.scene import build
from models.tyre.bristles import FADING_SPEED, brush_forces
from models.vehicles.free_vehicle import SWAY, free_vehicle
from models.vehicles.spatial_linear import design_mass_matrix
from models.vehicles.vehicle_file import load_vehicle
from validation.braking.load_transfer import turning_car, turning_error
from validation.braking.sprung_box import box

LOAD, MU, A, B, K = 3000.0, 0.8, 0.08, 0.09, 4e7
R19 = load_vehicle("r19_free")


def tyre(x: float, y: float, turning: float, tread: float, load: float = LOAD) -> np.ndarray:
    """Forces of one tyre that slides."""
    return brush_forces(load, MU, A, B, K, np.array([[x, y, turning, tread]]))[0]


def side_force(slip: float) -> float:
    """The brush of an elliptic patch and parabolic pressure: along a strip of half length l the traction grows by
    K slip until it meets MU p; from there on it slides."""
    p0 = 2.0 * LOAD / (np.pi * A * B)

    def strip(eta: float) -> float:
        length = A * np.sqrt(1.0 - eta * eta)
        slides = min(max(2.0 * length - K * slip * A**2 / (MU * p0), 0.0), 2.0 * length)  # way from the leading edge
        left = MU * p0 / A**2 * (4.0 / 3.0 * length**3 - (length * slides**2 - slides**3 / 3.0))
        return K * slip * slides**2 / 2.0 + left

    return B * quad(strip, -1.0, 1.0)[0]


@pytest.mark.parametrize("slip", [1e-4, 0.02, 0.06, 0.3])
def test_side_force_is_that_of_the_brush(slip: float) -> None:
    """Within the net's 0.2 % of mu N at 21 cells."""
    assert -tyre(0.0, slip * 20.0, 0.0, 20.0)[1] == pytest.approx(side_force(slip), abs=2e-3 * MU * LOAD)


def test_trail_of_small_slip() -> None:
    """3 pi a / 32 behind the centre, to the net's 1 / 21^2."""
    _, fy, mz = tyre(0.0, 1e-6, 0.0, 20.0)
    assert mz / -fy == pytest.approx(3.0 * np.pi / 32.0 * A, rel=5e-3)


def test_locked_wheel_is_opposed_by_mu_n() -> None:
    """All bristles slide one way; rounding alone."""
    for angle in np.linspace(0.0, 6.0, 7):
        way = np.array([np.cos(angle), np.sin(angle)])
        assert np.allclose(tyre(5.0 * way[0], 5.0 * way[1], 0.0, 0.0)[:2], -MU * LOAD * way, rtol=0, atol=1e-9 * LOAD)


def test_rolling_backwards_is_the_mirror_image() -> None:
    """x and the turning change their signs with the speed; and nothing jumps where it passes 0."""
    assert np.allclose(tyre(0.1, 0.2, 0.3, -20.0), tyre(-0.1, 0.2, -0.3, 20.0) * [-1, 1, -1], rtol=1e-12)
    speeds = np.linspace(-2.0 * FADING_SPEED, 2.0 * FADING_SPEED, 2001)
    slides = np.column_stack([np.tile([0.002, 0.003, 0.01], (2001, 1)), speeds])
    found = brush_forces(LOAD, MU, A, B, K, slides)
    assert np.abs(np.diff(found[:, :2], axis=0)).max() < 2e-2 * np.abs(found[:, :2]).max()  # by 1/1000 of the way
    assert (np.einsum("ij,ij->i", found, slides[:, :3]) <= 0.0).all()


def test_without_load_there_is_no_force() -> None:
    assert not tyre(1.0, 1.0, 1.0, 5.0, load=0.0).any()


@pytest.mark.grounds("closed form")
def test_free_vehicle_has_all_of_the_mass() -> None:
    """Sideways and in yaw, too; the ride vehicle's wheels and occupants have none there."""
    free = free_vehicle(R19, spin_inertia=1.7)
    total = sum(body.mass for body in R19.bodies)
    assert len(free.coordinates()) == 23
    assert design_mass_matrix(free)[:2, :2] == pytest.approx(total * np.eye(2), rel=1e-9)


@pytest.mark.grounds("closed form")
def test_the_chassis_feels_the_inertia_of_the_whole_vehicle_in_roll_and_pitch() -> None:
    """m_total h about the ground; wheels and occupants were left out once, a sixth of it."""
    free = free_vehicle(R19, spin_inertia=1.7)
    whole = sum(body.mass * body.position[2] for body in R19.bodies)
    roll, pitch = (free.coordinates().index((SWAY, turn)) for turn in ("rx", "ry"))
    assert design_mass_matrix(free)[0, pitch] == pytest.approx(whole, rel=1e-9)
    assert design_mass_matrix(free)[1, roll] == pytest.approx(-whole, rel=1e-9)


def test_loads_balance_the_inertia_of_the_whole_vehicle() -> None:
    """Between the sides of a box on springs that turns gently; 1 % of it is still to come after 1 s."""
    own = turning_car(box().handling.given, 2e-3)
    assert abs(turning_error(drive_run("mujoco", own, 20.0, 1.0))) < 2e-2


def test_a_vehicle_without_cornering_is_refused() -> None:
    with pytest.raises(InputError, match="cornering stiffness of every tyre"):
        Handling(replace(R19, side_forces=R19.side_forces[:3]))
    with pytest.raises(InputError, match="no such tyre"):
        Handling(R19, TyreParameters(fixed=("fx",)))


def test_what_pushes_a_rotor_pushes_all_that_it_rides_on() -> None:
    """At the middle of its axle, where it does not turn it: as on its wheel, to rounding. A rotor that nothing else
    is on was once left out as the car's places were worked out."""
    still = np.zeros(len(Handling(R19).vehicle.coordinates()))
    found = {}
    for body in ("fl", "fl rotor"):
        at_centre = Push(body, R19.body("fl").position, (0.6, 0.8, 0.0), ((0.0, 1000.0),))
        found[body] = still.copy()
        report, ledger = np.zeros((4, forces.REPORTED)), np.zeros(forces.LEDGER)
        forces.all_forces(Handling(R19, pushes=(at_centre,)).numbers, 0.0, still, still, found[body], report, ledger)
    assert np.abs(found["fl"][2]) > 100.0  # N m about the vertical
    assert np.abs(found["fl"] - found["fl rotor"]).max() < 1e-9


def test_road_has_the_variance_of_its_level() -> None:
    """Each wave's variance is that of its band; 4000 of them leave 6.5 % (4 standard errors of 1 / sqrt(4000))."""
    waves = plane_waves(1e-6, 4000, 7)
    number = np.hypot(waves[:, 0], waves[:, 1])
    ratio = (waves[:, 2:] ** 2).sum(axis=1) / 2.0 / (np.pi * 1e-6 / number)
    assert ratio.mean() / np.log(60.0 / 0.5) * 4000 == pytest.approx(1.0, abs=0.065)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"steer": [[0.0, 0.0], [0.0, 0.1]]}, "manoeuvres.go.steer.*rise from knot to knot"),
        ({"steer": [[0.0, 2.0]]}, "manoeuvres.go.steer.*from -1.2 to 1.2 rad"),
        ({"brake": [[0.0, -5.0]]}, "manoeuvres.go.brake.*from 0 to 100000 N m"),
        ({"duration": 0.0015}, "run.step.*must divide"),
        ({"speeds": 1.0}, "manoeuvres.go.speeds.*unknown key"),
    ],
)
def test_bad_manoeuvres_are_told(change: dict, message: str) -> None:
    table = {"title": "t", "manoeuvres": {"go": {"speed": 20.0, **change}}}
    with pytest.raises(InputError, match=message):
        build(table, "own.toml", Path())


@pytest.mark.full
def test_engines_agree_where_all_wheels_slide_and_lift() -> None:
    """Off a kerb-like road at full lock, brakes on: rounding alone, and no contact gains energy."""
    controls = Controls(steer=((0.0, 0.0), (0.2, 0.4)), brake=((0.0, 0.0), (0.1, 4000.0)))
    wild = Handling(R19, controls=controls, waves=plane_waves(2e-4, 24, 2))
    one, two = (drive_run(engine, wild, 20.0, 0.4) for engine in ("mujoco", "exudyn"))
    assert np.abs(one.run.positions - two.run.positions).max() < 1e-10
    assert one["load"].min() == 0.0
    assert one["power"].max() <= 0.0


@pytest.fixture(scope="module")
def braked_turn() -> SimulatedDrive:
    """800 N m of braking, 7 parts of 10 in front, while the car begins to turn left, 0.2 s."""
    controls = Controls(steer=((0.0, 0.0), (0.1, 0.03)), brake=((0.0, 0.0), (0.1, 800.0)), front_brake=0.7)
    return drive_run("mujoco", Handling(R19, TyreParameters(cells=5), controls), 20.0, 0.2)


@pytest.mark.grounds("closed form")
def test_brakes_of_each_axle_have_their_share(braked_turn: SimulatedDrive) -> None:
    """At spins of 60 rad/s the torque is whole: tanh(60) is 1 to rounding."""
    front = np.array([at.name.startswith("f") for at in braked_turn.handling.vehicle.tyres])
    torque = braked_turn.tyres[-1, :, forces.SPIN_TORQUE]
    assert front.sum() == 2 and np.allclose(torque, np.where(front, -280.0, -120.0), rtol=1e-9)


@pytest.mark.grounds("closed form")
def test_lateral_acceleration_is_that_of_the_place_below_the_chassis(braked_turn: SimulatedDrive) -> None:
    """Twice the difference of its path in the axes of the road, turned to the left: 1 ms of a manoeuvre of 0.1 s."""
    x, y, yaw = braked_turn.path.T
    place = next(body for body in R19.bodies if body.name == "body").position
    path = np.stack(
        [x + np.cos(yaw) * place[0] - np.sin(yaw) * place[1], y + np.sin(yaw) * place[0] + np.cos(yaw) * place[1]]
    )
    times = braked_turn.run.times
    along, across = np.gradient(np.gradient(path, times, axis=1), times, axis=1)
    found, expected = braked_turn.lateral_acceleration(), np.cos(yaw) * across - np.sin(yaw) * along
    assert found[-10] > 0.5
    assert np.allclose(found[5:-5], expected[5:-5], rtol=0, atol=3e-3 * found.max())


@pytest.mark.full
def test_a_step_that_cannot_follow_slow_tyres_is_told() -> None:
    with pytest.raises(RunFailed, match=r"damps its wheel faster than steps of 0\.001 s"):
        drive_run("mujoco", Handling(R19, TyreParameters(fixed=("fl", "fr", "rl", "rr")), slope=0.05), 0.0, 0.05, 1e-3)


def test_car_that_turns_over_is_no_result() -> None:
    """Friction of a race track on a high car's steer: 89 m/s^2 were printed for it once."""
    controls = Controls(steer=((0.1, 0.0), (0.3, 0.3)))
    handling = Handling(R19, replace(TyreParameters(), friction=1.5), controls)
    with pytest.raises(RunFailed, match=r"turns over.*t = "):
        drive_run("mujoco", handling, 60.0, 1.5, 1e-3)
