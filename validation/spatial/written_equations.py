"""Differences of the engines from plain equations of motion: test cars, random states, and largest differences.

The plain side (``models.multibody.plain``) reads the description alone and shares no force, no table and no mechanics
with the engines. What both read is the description, and for paths the tableau and the step.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from models.engines.assembly import Settings
from models.engines.cut_vehicle import PLAIN_ENGINE
from models.engines.cut_vehicle import build as hub_model
from models.multibody import forces as at
from models.multibody.cut_table import HubInputs
from models.multibody.numbers import Controls, Handling, Push, TyreParameters
from models.multibody.plain.bristles import TyrePatches
from models.multibody.plain.bristles import tyre_forces as plain_tyre_forces
from models.multibody.plain.rolling import PlainRolling
from models.road.iso8608 import iso8608_road
from models.road.plane_waves import plane_waves
from models.systems.handling.run import REFERENCE_ENGINE, build_in_engine
from models.systems.hub_forces.measurement import HubForces, road_under_wheels
from models.tyre.bristles import brush_forces
from models.vehicles.cut_vehicle import PITCH, ROLL, CutVehicle, Z, cut_at_hubs
from models.vehicles.spatial import Curve, SpatialVehicle, hitch_of
from models.vehicles.vehicle_file import load_vehicle
from validation.common.checks import largest_relative_difference
from validation.spatial.cars import random_states, static_forces, twin
from validation.spatial.trains import caravan, train

SEED, STEP, SPEED = 41, 1e-3, 22.0
ROLLING_STEP = 2e-3
"""Step (s) of a run on tyres; an evaluation of the plain equations takes 5 ms."""
FORCE_FRAMES = ("hub", "body", "inertial")
LARGEST_TILT = 0.3
"""Largest random roll and pitch angle (rad) of a chassis."""
LARGEST_FOLD = 1.5
"""Largest random yaw angle (rad) of a trailer's hitch."""
BUMP_STOP = Curve((-0.1, -0.02, 0.02, 0.1), (-4000.0, 0.0, 0.0, 6000.0))
NONLINEAR_DAMPER = Curve((-1.0, -0.1, 0.0, 0.1, 1.0), (-900.0, -300.0, 0.0, 150.0, 400.0))
TURN_CONTROLS = Controls(
    steer=((0.0, 0.01), (0.3, 0.05), (0.7, -0.05), (1.0, 0.0)),
    brake=((0.0, 0.0), (0.4, 900.0)),
    drive=((0.0, 0.0), (0.2, 300.0)),
)


def nonlinear_spring_car() -> SpatialVehicle:
    """The car R19-free with a bump stop, a nonlinear damper and dry friction in each of its first four springs."""
    car = load_vehicle("r19_free")
    first = (replace(s, travel_force=BUMP_STOP, rate_force=NONLINEAR_DAMPER, friction=120.0) for s in car.springs[:4])
    return replace(car, springs=(*first, *car.springs[4:]))


def rolling_cars() -> dict[str, Handling]:
    """Test cars by name, steered, braked and driven on a rough road: as shipped, asymmetric, with nonlinear springs,
    with a caravan, and with a trailer; two are on a slope and pushed by a gust."""
    waves, r19 = plane_waves(4e-6, seed=3), load_vehicle("r19_free")
    gust = Push("body", (0.3, 0.1, 1.0), (0.1, 1.0, 0.2), ((0.0, 0.0), (0.4, 500.0)))
    return {
        "r19_free": Handling(r19, TyreParameters(), TURN_CONTROLS, waves),
        "twin": Handling(
            twin(), TyreParameters(inclination=-0.03, fixed=("fl", "rr"), cells=11), TURN_CONTROLS, waves, 0.05, (gust,)
        ),
        "curved": Handling(nonlinear_spring_car(), TyreParameters(spin_inertia=1.2), TURN_CONTROLS, waves),
        "caravan": Handling(caravan(), TyreParameters(inclination=0.02), TURN_CONTROLS, waves),
        "train": Handling(
            train(), TyreParameters(fixed=("fl", "dr", "bl"), cells=11), TURN_CONTROLS, waves, 0.05, (gust,)
        ),
    }


def rolling_states(car: Handling, state_count: int) -> Iterator[tuple[float, np.ndarray, np.ndarray]]:
    """Yield random times (s), coordinates and rates (n,) of a car: any heading, rolled and pitched, at speeds from 0 to
    25 m/s."""
    rng, coordinates = np.random.default_rng(SEED), car.vehicle.coordinates()
    towing = ("sway", *map(hitch_of, car.vehicle.towed))
    leans = [i for i, (name, freedom) in enumerate(coordinates) if name in towing and freedom in ("rx", "ry")]
    folds = [i for i, (name, freedom) in enumerate(coordinates) if name in towing and freedom == "rz"]
    for i in range(state_count):
        speed = (0.0, 0.05, 25.0)[i % 3] * rng.uniform()
        q, v = rng.uniform(-0.03, 0.03, len(coordinates)), rng.uniform(-0.5, 0.5, len(coordinates))
        q[:3] = *rng.uniform(-5.0, 5.0, 2), rng.uniform(-3.1, 3.1)
        q[leans], q[folds] = (
            rng.uniform(-LARGEST_TILT, LARGEST_TILT, len(leans)),
            rng.uniform(-LARGEST_FOLD, LARGEST_FOLD, len(folds)),
        )
        start_rates = car.straight(speed)[1]
        v = v * min(1.0, 0.1 + speed) + start_rates
        v[:2] += speed * np.array([np.cos(q[2]) - 1.0, np.sin(q[2])])
        yield rng.uniform(0.0, 1.0), q, v


def rolling_acceleration_difference(car: Handling, engine: str, state_count: int) -> float:
    """Largest difference between the accelerations of an engine and of the plain equations, divided by the largest of
    the state."""
    plain, model = build_in_engine(REFERENCE_ENGINE, car), build_in_engine(engine, car)
    states = rolling_states(car, state_count)
    return max(
        largest_relative_difference(model.acceleration(t, q, v), plain.acceleration(t, q, v)) for t, q, v in states
    )


def report_difference(car: Handling, state_count: int) -> float:
    """Largest difference of the reported tyre quantities and energies from the plain equations, each column divided by
    its largest value."""
    plain, numbers, worst = PlainRolling(car), car.numbers, 0.0
    states = list(rolling_states(car, state_count))
    state_times, q, v = (np.array(column) for column in zip(*states, strict=True))
    tyres, ledgers = np.empty((state_count, len(car.vehicle.tyres), at.REPORTED)), np.empty((state_count, at.LEDGER))
    at.fill_reports(numbers, state_times, q, v, tyres, ledgers)
    for ours, theirs in zip((tyres, ledgers), plain.report(state_times, q, v), strict=True):
        shape = -1, ours.shape[-1]
        gap, size = np.abs(ours - theirs).reshape(shape).max(0), np.abs(theirs).reshape(shape).max(0)
        worst = max(worst, float((gap / np.maximum(size, 1e-300)).max()))
    return worst


def rolling_path_difference(car: Handling, engine: str, duration: float) -> float:
    """Largest difference of a car's coordinates and rates between runs by an engine and by the plain equations."""
    settings = Settings("RK4", ROLLING_STEP, duration)
    ours, theirs = (
        build_in_engine(name, car, settings).run(*car.straight(SPEED)) for name in (engine, REFERENCE_ENGINE)
    )
    return float(max(np.abs(ours.positions - theirs.positions).max(), np.abs(ours.rates - theirs.rates).max()))


def cut_cars() -> dict[str, CutVehicle]:
    """Cars cut at their wheels, by name: as shipped, and asymmetric with tyres that can lift off."""
    return {
        "r19_free": cut_at_hubs(load_vehicle("r19_free"), "body"),
        "twin": cut_at_hubs(twin().with_tyres(pushes_only=True), "body"),
    }


def hub_input_sets(vehicle: CutVehicle) -> list[HubInputs]:
    """Inputs of a cut vehicle: random hub forces and moments in each frame, without and with a prescribed guide, with a
    guide that pulls, and road heights."""
    rng, rows = np.random.default_rng(SEED), static_forces(vehicle, 3).hubs
    hubs = rows + rng.normal(0.0, 500.0, rows.shape)
    guide, pull = rng.normal(0.0, 0.1, (3, 6)), (2e4, 3e3, 5e4, 4e3)
    wrenches = [HubInputs(hubs, frame, guide=guide_values) for frame in FORCE_FRAMES for guide_values in (None, guide)]
    road = HubInputs(rng.normal(0.0, 0.01, (3, 2 * len(vehicle.hubs))), speed=SPEED)
    return [*wrenches, HubInputs(hubs, guide=guide, pull=pull), road, replace(road, frame="inertial")]


def cut_state(vehicle: CutVehicle, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Random coordinates and rates (n,) of a cut vehicle: any heading, roll and pitch up to LARGEST_TILT, tyres near
    the road."""
    q, v = random_states(vehicle, seed)
    q[Z] *= 2e-3
    q[PITCH], q[ROLL] = LARGEST_TILT * q[PITCH], LARGEST_TILT * q[ROLL]
    return q, v


def cut_car_acceleration_difference(vehicle: CutVehicle, engine: str, state_count: int) -> float:
    """Largest difference between the accelerations of an engine and of the plain equations, divided by the largest of
    the state."""
    worst, input_sets = 0.0, hub_input_sets(vehicle)
    for i, hub_inputs in enumerate(input_sets):
        models = [hub_model(name, vehicle, hub_inputs, STEP, STEP) for name in (engine, PLAIN_ENGINE)]
        for seed in range(i, state_count, len(input_sets)):
            q, v = cut_state(vehicle, seed)
            time = 0.5 * STEP * (seed % 3)
            worst = max(worst, largest_relative_difference(*(model.acceleration(time, q, v) for model in models)))
    return worst


def inner_force_difference(vehicle: CutVehicle, state_count: int) -> float:
    """Largest difference of element forces, hub forces and moments, and stabilising moments from the plain equations,
    each divided by its largest value."""
    worst = 0.0
    for hub_inputs in hub_input_sets(vehicle):
        models = [hub_model(name, vehicle, hub_inputs, STEP, STEP) for name in ("reference", PLAIN_ENGINE)]
        states = np.array([np.concatenate(cut_state(vehicle, seed)) for seed in range(state_count)])
        ours, theirs = (model.reported(0.5 * STEP * np.arange(state_count), states) for model in models)
        for name in ("elements", "wrenches", "moments"):
            gap, size = np.abs(getattr(ours, name) - getattr(theirs, name)).max(), np.abs(getattr(theirs, name)).max()
            worst = max(worst, float(gap / max(size, 1e-300)))
    return worst


def cut_car_path_difference(vehicle: CutVehicle, engine: str, duration: float, on_rough_road: bool) -> float:
    """Largest difference of a cut vehicle's coordinates and rates between runs by an engine and by the plain equations,
    on a rough road or with noisy hub forces."""
    steps = round(duration / STEP)
    if on_rough_road:
        left, right = (iso8608_road("C", seed) for seed in (1, 2))
        hub_inputs = road_under_wheels(vehicle, left, right, SPEED, STEP, steps)
    else:
        deviation = np.tile([50.0] * 3 + [5.0] * 3, len(vehicle.hubs))
        hub_inputs = (
            HubForces(static_forces(vehicle, steps + 1).hubs, STEP, "hub")
            .with_noise(deviation, SEED)
            .hub_inputs(STEP, steps)
        )
    paths = [hub_model(name, vehicle, hub_inputs, STEP, duration).run().states for name in (engine, PLAIN_ENGINE)]
    return float(np.abs(paths[0] - paths[1]).max())


def brush_force_difference(state_count: int) -> float:
    """Largest difference of the creep forces and moments of random brush contact patches from plain code; forces are
    divided by the load, moments by load times half width."""
    rng, worst, width = np.random.default_rng(SEED), 0.0, 0.09
    for i in range(state_count):
        load, mu, half = rng.uniform(50.0, 8000.0), rng.uniform(0.1, 1.2), rng.uniform(0.02, 0.12)
        stiffness, cells = rng.uniform(1e7, 1e8), int(rng.integers(3, 40))
        slides = rng.normal(0.0, 1.0, (8, 4)) * 10.0 ** rng.uniform(-4.0, 1.0, (8, 1))
        slides[:, 3] = rng.uniform(1.0, 40.0, 8) if i % 2 else rng.uniform(-0.3, 0.3, 8)
        ones = np.ones(len(slides))
        patch = TyrePatches(half * ones, width * ones, load * ones, mu * ones, stiffness * ones)
        gap = plain_tyre_forces(patch, slides, cells) - brush_forces(load, mu, half, width, stiffness, slides, cells)
        worst = max(worst, float(np.abs(gap / (load * np.array([1.0, 1.0, width]))).max()))
    return worst
