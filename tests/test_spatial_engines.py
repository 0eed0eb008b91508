"""Vehicles in space in both engines: the analytic matrices, the equations by hand, and what they must refuse."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from models.core.errors import InputError, Refused, RunFailed
from models.engines.assembly import Settings
from models.engines.catalogue import CATALOGUE
from models.engines.spatial_protocol import ALLOWED_INTEGRATORS, INTEGRATORS, build, jacobian, linear_vehicle_at_speeds
from models.engines.spatial_reference import SpatialReference
from models.vehicles.spatial import AntiRollBar, Body, SpatialVehicle, SpringDamper, TurnOutput, Tyre
from models.vehicles.spatial_linear import linearise
from validation.cases.ride_engines import (
    GRAVITY,
    TRAVEL_SPEED,
    matrix_difference,
    random_state,
    relative_difference,
    shipped_vehicle_or_twin,
    with_nonlinear_springs,
)

ENGINES = ("exudyn", "mujoco")


def settings(engine, duration=0.02, step=1e-3):
    return Settings(INTEGRATORS[engine], step, duration)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("name", "gravity"), [("r19_ride", 0.0), ("spatial twin", GRAVITY)])
def test_linear_vehicle_is_the_analytic_one(engine, name, gravity):
    """1e-11: a factor of 7 above what MuJoCo's differences leave of a force of 1 N beside preloads of 5 kN."""
    vehicle = shipped_vehicle_or_twin(name, gravity)
    found = build(engine, vehicle, speed=TRAVEL_SPEED).linearise()
    assert matrix_difference(found, linearise(vehicle, TRAVEL_SPEED)) < 1e-11
    assert found.source == f"{engine}, " + ("loaded" if gravity else "unloaded")


@pytest.mark.parametrize("speed", [0.5, 30.0, 70.0])
def test_three_linearisations_give_every_speed(speed):
    """Within and beyond the three speeds; 1e-11 of the largest damping as above."""
    vehicle = shipped_vehicle_or_twin("r19_free")
    at = linear_vehicle_at_speeds("mujoco", vehicle)
    assert matrix_difference(at(speed), linearise(vehicle, speed)) < 1e-11
    with pytest.raises(InputError, match="above 0"):
        at(0.0)


def test_curves_are_linearised_by_their_mean_slope_at_rest():
    """Short steps keep 1e-11; a one-sided slope would miss by (1786 - 700 / 0.1) / max D, over 1e-2."""
    vehicle = with_nonlinear_springs(shipped_vehicle_or_twin("quarter_car", GRAVITY))
    for engine in ENGINES:
        assert matrix_difference(build(engine, vehicle).linearise(), linearise(vehicle)) < 1e-9


def test_accelerations_agree_with_the_equations_by_hand():
    """Large random motion of the vehicle that no symmetry helps, curves, gravity, road: rounding only."""
    vehicle = with_nonlinear_springs(shipped_vehicle_or_twin("spatial twin", GRAVITY))
    exudyn, mujoco_, reference = (
        *(build(engine, vehicle, speed=TRAVEL_SPEED) for engine in ENGINES),
        SpatialReference(vehicle, TRAVEL_SPEED),
    )
    for path in range(5):
        state = random_state(vehicle, path)
        expected = reference.acceleration(0.0, *state)
        assert relative_difference(exudyn.acceleration(0.0, *state), expected) < 1e-12
        assert relative_difference(mujoco_.acceleration(0.0, *state), expected) < 1e-12


def test_a_wheel_that_only_slides_is_linearised_wherever_its_spring_and_its_tyre_are():
    """Points of the spring beside the tyre's, an axis that leans, outputs of none or of turning; a bar on a body of one
    coordinate. Exudyn once asked for markers that it had not."""
    roller = Body("roller", 400.0, (0.0, 0.0, 0.6), ("rx",), ((30.0, 0.0, 0.0), (0.0, 30.0, 0.0), (0.0, 0.0, 30.0)))
    wheel = Body("wheel", 40.0, (0.0, 0.7, 0.3), ("z",))
    springs = tuple(
        SpringDamper(f"{i}", "roller", "wheel", (0.0, 0.6, 0.6), (0.0, 0.6, 0.3), axis, 3e4, 1e3)
        for i, axis in enumerate([(0.0, 0.0, 1.0), (0.0, 0.6, 0.8)])
    )
    bar = AntiRollBar("bar", "roller", "wheel", "roller", (0.0, 0.7, 0.3), (0.0, -0.7, 0.6), 1e4, 10.0)
    tyre = Tyre("tyre", "wheel", (0.0, 0.7, 0.3), 0, 2e5)
    turning = TurnOutput("turn", "angle", "wheel", (1.0, 0.0, 0.0))
    for outputs in ((), (turning,)):
        vehicle = SpatialVehicle("odd", (roller, wheel), springs, (tyre,), (0.0,), (bar,), outputs=outputs)
        for engine in ENGINES:
            assert matrix_difference(build(engine, vehicle).linearise(), linearise(vehicle)) < 1e-9


def test_equations_by_hand_keep_energy():
    """Without damping, friction, speed and road: kinetic energy grows by what weights and springs give.

    The power is measured along the motion itself, d/dt (T + U) by differences of order six: 1e-9 of its parts.
    """
    plain = shipped_vehicle_or_twin("spatial twin", GRAVITY)
    vehicle = replace(
        plain,
        side_forces=(),
        drags=(),
        tyres=tuple(replace(tyre, damping=0.0) for tyre in plain.tyres),
        springs=tuple(replace(s, damping=0.0) for s in plain.springs),
        bars=tuple(replace(bar, damping=0.0) for bar in plain.bars),
    )
    model = SpatialReference(vehicle)
    q, v, _ = random_state(vehicle, 0)
    a = model.acceleration(0.0, q, v)

    def energy(t):
        at, rate = q + t[0] * v + t[0] ** 2 / 2 * a, v + t[0] * a
        motions = model.motions_of(at, rate)
        kinetic = sum(
            0.5 * body.mass * np.sum((m.shift @ rate) ** 2)
            + 0.5 * (w := m.rotation.T @ m.turn @ rate) @ np.array(body.inertia) @ w
            for body, m in motions_of(vehicle, motions)
        )
        return np.array([kinetic])

    def motions_of(vehicle, motions):
        return [(body, motions[body.name]) for body in vehicle.bodies]

    gained = jacobian(energy, 1, 1e-4)[0, 0]
    model.acceleration(0.0, q, v)  # leaves the motion at (q, v) behind
    weights = sum(-body.mass * GRAVITY * (m.shift @ v)[2] for body, m in motions_of(vehicle, model.motions))
    given = float(model._forces(np.zeros(2 * len(vehicle.tyres))) @ v) + weights
    assert gained == pytest.approx(given, rel=1e-7)


def test_paths_agree():
    """R19-ride with curves under gravity on a random road from a random start: 20 steps of the same tableau."""
    vehicle = with_nonlinear_springs(shipped_vehicle_or_twin("r19_ride", GRAVITY))
    road = 1e-4 * np.cumsum(np.ones((41, 8)), axis=0)
    exudyn, other = (
        build(engine, vehicle, settings(engine), None, road).run(*random_state(vehicle, 1)[:2]) for engine in ENGINES
    )
    assert len(exudyn.times) == 21
    assert exudyn.counts["force calls"] == 80
    assert np.abs(exudyn.positions - other.positions).max() < 1e-13
    assert np.abs(exudyn.rates - other.rates).max() < 1e-12


@pytest.mark.parametrize("engine", ENGINES)
def test_road_is_read_at_half_steps(engine):
    """One RK4 step of a mass on a spring over a road z = t^3, whose stages are written down here."""
    mass, k, h = 2.0, 50.0, 0.01
    vehicle = SpatialVehicle(
        "one mass", (Body("m", mass, (0, 0, 0.3), ("z",)),), (), (Tyre("t", "m", (0.0, 0.0, 0.3), 0, k),), (0.0,)
    )
    times = h / 2 * np.arange(3)
    found = build(engine, vehicle, settings(engine, h, h), None, np.column_stack([times**3, 3 * times**2])).run(
        np.array([0.1]), np.array([0.0])
    )

    def rate(y, z):
        return np.array([y[1], k / mass * (z - y[0])])

    y = np.array([0.1, 0.0])
    k1 = rate(y, 0.0)
    k2 = rate(y + h / 2 * k1, times[1] ** 3)
    k3 = rate(y + h / 2 * k2, times[1] ** 3)
    k4 = rate(y + h * k3, times[2] ** 3)
    expected = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    assert [found.positions[-1, 0], found.rates[-1, 0]] == pytest.approx(expected, rel=1e-14, abs=1e-16)


@pytest.mark.parametrize("engine", ENGINES)
def test_design_position_is_an_equilibrium(engine):
    vehicle = shipped_vehicle_or_twin("spatial twin", GRAVITY)
    zero = np.zeros(len(vehicle.coordinates()))
    assert np.abs(build(engine, vehicle, speed=TRAVEL_SPEED).acceleration(0.0, zero, zero)).max() < 1e-10


def test_no_curve_code_without_curves():
    plain, bent = shipped_vehicle_or_twin("r19_ride"), with_nonlinear_springs(shipped_vehicle_or_twin("r19_ride"))
    of_plain, of_bent = (build("exudyn", vehicle).plan() for vehicle in (plain, bent))
    assert of_plain["curves"] == 0
    # four springs with two curves and a friction each, one function for each spring
    assert of_bent["curves"] == 12
    assert of_bent["callbacks"] - of_plain["callbacks"] == 4


@pytest.mark.parametrize("engine", ENGINES)
def test_what_would_be_wrong_is_refused(engine):
    vehicle = shipped_vehicle_or_twin("quarter_car")
    with pytest.raises(Refused, match="lets a mode of the vehicle grow; use at most"):
        build(engine, vehicle, settings(engine, 2.0, 0.1))
    with pytest.raises(Refused, match="does not divide"):
        build(engine, vehicle, settings(engine, 0.0205))
    with pytest.raises(Refused, match="41 rows"):
        build(engine, vehicle, settings(engine), None, np.zeros((21, 2)))
    with pytest.raises(Refused, match="41 rows"):
        build(engine, vehicle, settings(engine), None, np.full((41, 2), np.nan))
    with pytest.raises(Refused, match="march with"):
        build(engine, vehicle, Settings("RK67", 1e-3, 1.0))
    with pytest.raises(Refused, match="needs settings"):
        build(engine, vehicle, None, None, np.zeros((41, 2)))
    with pytest.raises(InputError, match="needs a speed above 0"):
        build(engine, shipped_vehicle_or_twin("r19_free"))


@pytest.mark.parametrize("engine", ENGINES)
def test_every_method_is_of_its_order(engine):
    """A quarter car let go: halving the step divides the error beside RK4 at 0.25 ms by about 2^order."""
    vehicle, start, rates = shipped_vehicle_or_twin("quarter_car"), np.array([0.02, 0.0]), np.array([0.0, 0.3])

    def end(method, step):
        return build(engine, vehicle, Settings(method, step, 0.2)).run(start, rates).positions[-1]

    true = end(INTEGRATORS[engine], 2.5e-4)
    for method in ALLOWED_INTEGRATORS[engine]:
        coarse, fine = (np.abs(end(method, step) - true).max() for step in (4e-3, 2e-3))
        assert coarse / fine == pytest.approx(2 ** CATALOGUE[engine][method].order, rel=0.3), method


@pytest.mark.parametrize("engine", ENGINES)
def test_failed_runs_raise(engine):
    model, n = build(engine, shipped_vehicle_or_twin("quarter_car"), settings(engine)), 2
    for start in (1e6, np.nan):
        with pytest.raises(RunFailed):
            model.run(np.full(n, start), np.zeros(n))
    model.run(np.zeros(n), np.zeros(n))  # and leave no trace
    with pytest.raises(RunFailed, match="without settings"):
        build(engine, shipped_vehicle_or_twin("quarter_car")).run(np.zeros(n), np.zeros(n))


def test_other_callback_is_not_overruled():
    model = build("mujoco", shipped_vehicle_or_twin("quarter_car"))
    mujoco.set_mjcb_passive(lambda model, data: None)
    try:
        with pytest.raises(RunFailed, match="another callback"):
            model.acceleration(0.0, np.zeros(2), np.zeros(2))
    finally:
        mujoco.set_mjcb_passive(None)


@pytest.mark.parametrize("engine", ENGINES)
def test_answers_do_not_depend_on_what_was_asked_before(engine):
    """A linearisation and a state on a road in between leave a run what it was, to the bit."""
    vehicle = shipped_vehicle_or_twin("quarter_car", GRAVITY)
    road = 0.01 * np.ones((41, 2))
    model = build(engine, vehicle, settings(engine), None, road)
    start = random_state(vehicle, 2)
    first = model.run(*start[:2])
    model.linearise()
    model.acceleration(0.0, *start)
    assert np.array_equal(model.run(*start[:2]).positions, first.positions)


def test_body_may_bear_any_name():
    """MuJoCo's own ground is called "world"."""
    vehicle = SpatialVehicle(
        "two",
        (Body("world", 2.0, (0, 0, 0.3), ("z",)), Body("0 z", 1.0, (0, 0, 0.6), ("z",))),
        (SpringDamper("s", "0 z", "world", (0, 0, 0.6), (0, 0, 0.3), (0, 0, 1), 30.0, 1.0),),
        (Tyre("t", "world", (0.0, 0.0, 0.3), 0, 50.0),),
        (0.0,),
    )
    for engine in ENGINES:
        assert matrix_difference(build(engine, vehicle).linearise(), linearise(vehicle)) < 1e-12
