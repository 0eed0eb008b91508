"""The braked vehicle on its suspension, by an engine and by plain code: accelerations at random states, and runs."""

from dataclasses import replace
from functools import cache

import numpy as np

from models.brake.brake import Brake, brakes_of_wheels
from models.brake.controller import Controller
from models.brake.controllers.slip import SlipBangBang
from models.brake.plain.suspension import ConstantWheelForces, PlainSuspension
from models.brake.pressure import BrakeChambers
from models.brake.sprung import SprungVehicle, suspended_vehicle
from models.brake.surfaces import UNIFORM_ROAD, RoadStretch, road_of_stretches
from models.engines.braking_sprung import EngineSprungVehicle
from models.engines.braking_sprung_plain import PlainSprungVehicle
from models.systems.braking.march import BrakedVehicle, BrakingPath, braked_vehicle_on_tyres
from models.systems.braking.procedures import steady_turn
from models.tyre.magic_formula import table_of_surface
from models.vehicles.spatial import Curve, SpatialVehicle
from models.vehicles.vehicle_file import load_vehicle
from validation.braking.compiled_brakes import engine_model, wheel_force_views
from validation.braking.sprung_box import WHEEL_SPIN_INERTIA, car, steady_torques
from validation.spatial.cars import twin
from validation.spatial.trains import caravan, train

STATE_COUNT, SEED = 100, 22
RELAXATION_LENGTHS = np.array([0.4, 0.4, 0.3, 0.3])
"""Relaxation lengths (m) of a vehicle's tyres where they lag; tyres of a trailer have the last one."""
LARGEST_LEAN = 0.3
"""Largest roll and pitch (rad) of the random states."""


@cache
def asymmetric_twin() -> SprungVehicle:
    """The asymmetric twin of the car on its suspension: a vehicle without any symmetry."""
    return suspended_vehicle(twin(), WHEEL_SPIN_INERTIA)


@cache
def car_with_stops() -> SprungVehicle:
    """The car of 19 freedoms with bump stops, nonlinear dampers and dry friction at its wheels, and damped tyres."""
    stop = Curve((-0.06, -0.03, 0.0, 0.03, 0.06), (-4e3, -500.0, 0.0, 300.0, 3e3))
    damper = Curve((-1.0, -0.1, 0.0, 0.2, 1.0), (-900.0, -200.0, 0.0, 150.0, 400.0))
    vehicle: SpatialVehicle = load_vehicle("r19_free")
    wheels = {tyre.body for tyre in vehicle.tyres}
    springs = tuple(
        replace(s, travel_force=stop, rate_force=damper, friction=60.0) if wheels & {s.first_body, s.second_body} else s
        for s in vehicle.springs
    )
    tyres = tuple(replace(tyre, damping=80.0 + 10.0 * i) for i, tyre in enumerate(vehicle.tyres))
    return suspended_vehicle(replace(vehicle, springs=springs, tyres=tyres), WHEEL_SPIN_INERTIA)


@cache
def towing_car() -> SprungVehicle:
    """The car with a caravan on its tow ball, without aerodynamic drag."""
    return suspended_vehicle(replace(caravan(), drags=()), WHEEL_SPIN_INERTIA)


@cache
def asymmetric_train() -> SprungVehicle:
    """The asymmetric twin with a trailer made of a drawbar and a box, all without symmetry."""
    return suspended_vehicle(train(), WHEEL_SPIN_INERTIA)


@cache
def train_with_compiled_springs() -> SprungVehicle:
    """The asymmetric twin with its trailer, all springs computed by the compiled force function."""
    return suspended_vehicle(train(), WHEEL_SPIN_INERTIA, trailer_spring_code="compiled")


VEHICLES = {"car": car, "twin": asymmetric_twin, "bent": car_with_stops}
TRAINS = {"caravan": towing_car, "train": asymmetric_train, "compiled train": train_with_compiled_springs}
EVERY_VEHICLE = {**VEHICLES, **TRAINS}


def wheel_count(vehicle: SprungVehicle) -> int:
    """Number of wheels of a vehicle, including those of its trailer."""
    return len(vehicle.handling.vehicle.tyres)


def random_states(
    coordinate_count: int, state_count: int = STATE_COUNT, wheel_count: int = 4
) -> tuple[np.ndarray, list[ConstantWheelForces]]:
    """Random coordinates and rates (state_count, 2, coordinate_count) at any heading, and random steer angles, forces
    and moments of their wheels.
    """
    random = np.random.default_rng(SEED)
    coordinates_and_rates = random.normal(0.0, 1.0, (state_count, 2, coordinate_count)) * np.array([[0.02], [0.3]])
    coordinates_and_rates[:, 0, :2], coordinates_and_rates[:, 0, 2] = (
        random.uniform(-50.0, 50.0, (state_count, 2)),
        random.uniform(-np.pi, np.pi, state_count),
    )
    coordinates_and_rates[:, 0, 4:6], coordinates_and_rates[:, 1, :2] = (
        random.uniform(-LARGEST_LEAN, LARGEST_LEAN, (state_count, 2)),
        random.normal(0.0, 15.0, (state_count, 2)),
    )
    wheel_forces = [
        ConstantWheelForces(
            random.normal(0.0, 0.2, wheel_count),
            random.normal(0.0, 3e3, (wheel_count, 2)),
            random.normal(0.0, 300.0, wheel_count),
        )
        for _ in range(state_count)
    ]
    return coordinates_and_rates, wheel_forces


@cache
def plain_accelerations(vehicle_name: str, state_count: int = STATE_COUNT) -> np.ndarray:
    """Accelerations (state_count, number of coordinates) of a vehicle at the random states, by plain code."""
    suspension = PlainSuspension(EVERY_VEHICLE[vehicle_name]())
    coordinates_and_rates, wheel_forces = random_states(suspension.size, state_count, len(suspension.tyres))
    return np.array(
        [
            suspension.acceleration(q, v, kept_state)
            for (q, v), kept_state in zip(coordinates_and_rates, wheel_forces, strict=True)
        ]
    )


def accelerations(vehicle: SprungVehicle, engine: str, state_count: int = STATE_COUNT) -> np.ndarray:
    """Accelerations (state_count, number of coordinates) of a vehicle at the random states, by an engine that calls the
    compiled forces."""
    model, computed = engine_model(vehicle, engine), np.empty((state_count, vehicle.size))
    wheels = wheel_count(vehicle)
    rows = wheel_force_views(model.numbers, wheels)
    for i, (state, kept_state) in enumerate(zip(*random_states(vehicle.size, state_count, wheels), strict=True)):
        rows.steer[:], rows.forces[:], rows.spin_moments[:] = (
            kept_state.steer,
            kept_state.forces,
            kept_state.spin_moments,
        )
        computed[i] = model.acceleration(0.0, *state)
    return computed


def relative_difference(compiled_accelerations: np.ndarray, plain_accelerations_of_states: np.ndarray) -> float:
    """Largest difference of the accelerations, divided in each state by its largest acceleration; infinite where an
    acceleration is not a number."""
    difference = float(
        np.max(
            np.abs(compiled_accelerations - plain_accelerations_of_states).max(axis=1)
            / np.abs(plain_accelerations_of_states).max(axis=1)
        )
    )
    return difference if np.isfinite(difference) else np.inf


def braked_vehicle_on_springs(
    vehicle: SprungVehicle, engine: str, with_valves: bool, with_lags: bool = False
) -> BrakedVehicle:
    """A braked vehicle on its suspension, steered to the left, with hysteresis in its brakes. Its road is dry on the
    left and wet on the right for 3 m, then ice. with_lags: whether its tyres have relaxation lengths."""
    front, rear = (
        Brake(push_out=0.4, release=0.3, rising=level, falling=1.1 * level)
        for level in ((150.0, 50.0) if with_valves else (3e2, 1e2))
    )
    plane = vehicle.in_plane()
    unit_values, on_front_unit = np.ones(plane.wheels), np.arange(plane.wheels) < 2
    return braked_vehicle_on_tyres(
        plane,
        [table_of_surface(name) for name in ("wet", "dry", "ice")],
        brakes_of_wheels(front, front, *[rear] * (plane.wheels - 2)),
        BrakeChambers(0.05 * unit_values, 0.04 * unit_values, 6.0, 0.5 * unit_values, 200.0, 3e-3),
        road_of_stretches([RoadStretch(0.0, 1, 0), RoadStretch(3.0, 2, 2)], 0.2),
        steer=np.where(on_front_unit, 0.05, 0.0),
        substeps=2,
        engine=PlainSprungVehicle(vehicle) if engine == "reference" else EngineSprungVehicle(engine, vehicle),
        sprung=vehicle,
        relaxation=np.where(on_front_unit, RELAXATION_LENGTHS[0], RELAXATION_LENGTHS[-1]) if with_lags else None,
    )


def controller(with_valves: bool, number_of_wheels: int = 4) -> Controller:
    """A slip controller that sets valves if ``with_valves``, else constant brake pressures."""
    return SlipBangBang(wheels=number_of_wheels) if with_valves else steady_torques(*number_of_wheels * (4e4,))


def run(
    vehicle: SprungVehicle,
    engine: str,
    duration: float,
    with_valves: bool = True,
    speed: float = 10.0,
    with_lags: bool = False,
) -> BrakingPath:
    """Simulate a stop of a vehicle on its suspension from a speed (m/s) for a duration (s) in an engine."""
    return braked_vehicle_on_springs(vehicle, engine, with_valves, with_lags).run(
        controller(with_valves, wheel_count(vehicle)), speed, duration
    )


@cache
def plain_run(
    vehicle_name: str, duration: float, with_valves: bool = True, speed: float = 10.0, with_lags: bool = False
) -> BrakingPath:
    """Simulate the stop of ``run`` by plain code."""
    return run(EVERY_VEHICLE[vehicle_name](), "reference", duration, with_valves, speed, with_lags)


def path_difference(first_path: BrakingPath, second_path: BrakingPath) -> float:
    """Largest difference of two paths in positions, rates and rim speeds (m, rad, per s); infinite if they differ in
    length or a value is not a number."""
    if len(first_path.times) != len(second_path.times):
        return np.inf
    difference = max(
        float(np.abs(first_path.states - second_path.states).max()),
        0.3 * float(np.abs(first_path.turning - second_path.turning).max()),
    )
    return difference if np.isfinite(difference) else np.inf


def steady_circle_pair(
    vehicle: SprungVehicle, speed: float = 8.0, radius: float = 30.0
) -> tuple[np.ndarray, np.ndarray]:
    """Steady circle of a vehicle at a speed (m/s) and radius (m), by MuJoCo's forces and by plain code. Each array has
    steer angles, wheel speeds and state; NaN where no steady turn exists."""
    rows = []
    for engine in ("mujoco", "reference"):
        on_suspension = braked_vehicle_on_springs(vehicle, engine, False)
        turn = steady_turn(replace(on_suspension, road=UNIFORM_ROAD), speed, radius)
        if turn is None:
            rows.append(np.full(2 * wheel_count(vehicle) + 2 * vehicle.size, np.nan))
        else:
            rows.append(np.concatenate((turn.steer, turn.start.turning, turn.start.state.ravel())))
    return rows[0], rows[1]
