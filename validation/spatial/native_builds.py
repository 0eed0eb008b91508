"""A cut vehicle built with the engines' native springs, compared with compiled forces and with hand-written
equations."""

from dataclasses import replace

import numpy as np

from models.engines.cut_vehicle import ForceRoute, HubModel, build
from models.engines.spatial_reference import SpatialReference
from models.multibody.cut_table import HubInputs
from models.vehicles.cut_vehicle import GRAVITY, CutVehicle
from validation.spatial.cars import static_forces

NATIVE_ENGINES = ("exudyn", "mujoco")
SEED, STEP = 37, 1e-3
State = tuple[np.ndarray, np.ndarray]


def random_states(vehicle: CutVehicle, state_count: int) -> list[State]:
    """Random states (coordinates and rates (n,)): any heading, roll and pitch up to 0.3 rad, other rotations up to 0.05
    rad, slides up to 0.08 m."""
    rng, turns = np.random.default_rng(SEED), np.array([f.startswith("r") for _, f in vehicle.tree.coordinates()])
    ranges = np.where(turns, 0.05, 0.08)
    ranges[:6] = 5.0, 5.0, 5.0, np.pi, 0.3, 0.3
    n = vehicle.size
    return [(ranges * rng.uniform(-1.0, 1.0, n), rng.uniform(-0.5, 0.5, n)) for _ in range(state_count)]


def random_hub_input(vehicle: CutVehicle, row_count: int) -> HubInputs:
    """Hub input of static wheel loads and a random force and moment on every hub at every half step, in the hubs'
    axes."""
    static_inputs = static_forces(vehicle, row_count)
    return replace(
        static_inputs,
        hubs=static_inputs.hubs + np.random.default_rng(SEED).normal(0.0, 300.0, static_inputs.hubs.shape),
    )


def hub_model(engine: str, vehicle: CutVehicle, force_route: ForceRoute, step_count: int = 1) -> HubModel:
    """A cut vehicle with random hub forces in an engine, with native springs or with compiled forces
    (``force_route``)."""
    return build(engine, vehicle, random_hub_input(vehicle, 2 * step_count + 1), STEP, step_count * STEP, force_route)


def native_acceleration_difference(engine: str, vehicle: CutVehicle, states: list[State]) -> float:
    """Largest difference between the accelerations with native springs and with compiled forces, divided by the largest
    acceleration of the coordinate."""
    native, compiled = hub_model(engine, vehicle, "native"), hub_model("mujoco", vehicle, "compiled")
    return _relative_difference([[built.acceleration(0.0, *state) for state in states] for built in (native, compiled)])


def difference_from_equations(vehicle: CutVehicle, states: list[State]) -> float:
    """Largest relative difference between the accelerations by compiled forces and by hand-written equations, which
    share no code, without hub forces."""
    still = HubInputs(0.0 * static_forces(vehicle, 3).hubs)
    compiled, equations = build("reference", vehicle, still, STEP, STEP), hand_written_equations(vehicle)
    paths = [
        [compiled.acceleration(0.0, *state) for state in states],
        [equations.acceleration(0.0, *state) for state in states],
    ]
    return _relative_difference(paths)


def hand_written_equations(vehicle: CutVehicle) -> SpatialReference:
    """Hand-written equations of motion of a cut vehicle without hub forces: bodies with springs, anti-roll bars,
    preloads and weight."""
    full_vehicle = vehicle.uncut
    equations = SpatialReference(
        replace(vehicle.tree, springs=full_vehicle.springs, bars=full_vehicle.bars, gravity=0.0)
    )
    equations.vehicle = replace(equations.vehicle, gravity=GRAVITY)
    equations.held = equations.held._replace(parts={element.name: element.preload for element in vehicle.elements})
    return equations


def trajectory_difference(engine: str, vehicle: CutVehicle, step_count: int) -> float:
    """Largest difference (m, rad, m/s, rad/s) between the states of runs with native springs and with compiled
    forces."""
    native = hub_model(engine, vehicle, "native", step_count).run()
    compiled = hub_model("mujoco", vehicle, "compiled", step_count).run()
    return float(np.abs(native.states - compiled.states).max())


def _relative_difference(value_pairs: list[list[np.ndarray]]) -> float:
    computed, wanted = map(np.array, value_pairs)
    return float((np.abs(computed - wanted).max(axis=0) / np.abs(wanted).max(axis=0)).max())
