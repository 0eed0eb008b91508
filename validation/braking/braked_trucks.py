"""Hard cases of braked trucks and trains that lock, slide, jackknife or overturn, and of controllers with impossible
commands; each function returns the case's error."""

from pathlib import Path
from typing import Any

import numpy as np

from models.brake.brake import PAPER_FRONT_BRAKE, brake_torque, brakes_of_wheels
from models.brake.controller import Command, NoAntiLock, Sample
from models.brake.plane_chain import fill_mass_matrix
from models.brake.plane_step import redistribute_negative_loads
from models.brake.plane_vehicle import GRAVITY, PAPER_TRUCK, plane_of_truck
from models.brake.port.ask import usable_command
from models.brake.surfaces import RoadStretch, road_of_stretches
from models.brake.trailer import CHOSEN_TRAILER, plane_of_train
from models.systems.braking.march import StartState
from models.systems.braking.procedures import vehicle_and_start_state
from models.systems.braking.run import run, vehicle_in_engine
from models.systems.braking.scene import BrakingScene, build
from validation.braking.braked_wheels import DRY, ICE, SPEED, AdvancedVehicle, Error, piecewise_linear_friction

TRUCK, HIGH_TRUCKS = plane_of_truck(PAPER_TRUCK), plane_of_truck(PAPER_TRUCK.model_copy(update={"height": 4.0}))
"""The paper's truck, and a truck as high as it is long and twice as high as it is wide."""


def energy_gain_case(initial_rates: tuple[float, float, float], brake_torque: float) -> Error:
    """Case: the truck slides on ice with initial rates of x, y (m/s) and heading (rad/s) under brake torques (N m).
    Error: largest gain of kinetic energy over 20 ms divided by the initial energy."""

    def energy(rates: np.ndarray) -> float:
        return float(TRUCK.masses[0] * (rates[:2] ** 2).sum() + TRUCK.inertias[0] * rates[2] ** 2)

    def error(implementation: str, work_folder: Path) -> float:
        moved_vehicle = AdvancedVehicle(implementation, TRUCK, ICE, rim_turning=0.0)
        moved_vehicle.state[1] = initial_rates
        first, gains = energy(moved_vehicle.state[1]), []
        for _ in range(25):
            energy_before = energy(moved_vehicle.state[1])
            moved_vehicle.advance_with(np.full((5, 4), brake_torque), 5e-3)
            gains.append(energy(moved_vehicle.state[1]) - energy_before)
        return float(max(*gains, 0.0) / first) if np.isfinite(moved_vehicle.state).all() else np.inf

    return error


def asymmetry_on_even_friction(implementation: str, work_folder: Path) -> float:
    """Case: the truck brakes straight ahead on even friction. Error: largest of y, heading and their rates (m, rad, per
    s), which should be 0."""
    moved_vehicle = AdvancedVehicle(implementation, TRUCK, DRY)
    moved_vehicle.advance_with(np.full((101, 4), 4e3))
    return float(np.abs(moved_vehicle.state[:, 1:]).max())


def mirrored_truck_error(implementation: str, work_folder: Path) -> float:
    """Case: the truck brakes and steers left, with less friction on the left. Error: difference (m, rad) from the
    mirror image of the mirrored stop."""
    ends = []
    for side, stretch in ((1.0, RoadStretch(0.0, 0, 1)), (-1.0, RoadStretch(0.0, 1, 0))):
        moved_vehicle = AdvancedVehicle(
            implementation, TRUCK, ICE, DRY, road=road_of_stretches([stretch]), steer=0.05 * side
        )
        moved_vehicle.advance_with(np.full((101, 4), 2e3))
        ends.append(moved_vehicle.state * np.array([1.0, side, side]))
    return float(np.abs(ends[0] - ends[1]).max())


def lifting_truck_error(implementation: str, work_folder: Path) -> float:
    """Case: a truck as high as it is long brakes on dry road; the run must fail. Error: infinite if it does not."""
    AdvancedVehicle(implementation, HIGH_TRUCKS, DRY, speed=20.0).advance_with(np.full((101, 4), 2e4))
    return np.inf


def overturning_truck_error(implementation: str, work_folder: Path) -> float:
    """Case: a truck twice as high as it is wide steers on dry road; the run must fail. Error: infinite if it does
    not."""
    AdvancedVehicle(implementation, HIGH_TRUCKS, DRY, speed=20.0, steer=0.1).advance_with(np.zeros((201, 4)))
    return np.inf


def jackknifed_train_error(implementation: str, work_folder: Path) -> float:
    """Case: a train folded by 100 degrees slides on dry road with all wheels locked. Error: largest gain of kinetic
    energy in 20 ms divided by the initial energy."""
    plane = plane_of_train(PAPER_TRUCK, CHOSEN_TRAILER.model_copy(update={"fold": np.pi}), with_load_transfer=False)
    moved_vehicle = AdvancedVehicle(implementation, plane, DRY, rim_turning=0.0)
    state = moved_vehicle.state
    state[0, 3:] = np.radians(-100.0)

    def energy() -> float:
        mass, right_side = np.zeros((5, 5)), np.zeros(5)
        units = np.column_stack((np.cos(state[0, 2:]), np.sin(state[0, 2:])))
        fill_mass_matrix(units, state[1], plane, mass, right_side, right_side.copy(), right_side.copy())
        return float(0.5 * state[1] @ mass @ state[1])

    levels = [energy()]
    for _ in range(20):
        moved_vehicle.advance_with(np.full((5, plane.wheels), 2e4), 5e-3)
        levels.append(energy())
    return float(max(np.diff(levels).max(), 0.0) / levels[0]) if levels[-1] < 0.8 * levels[0] else np.inf


def split_friction_error(implementation: str, work_folder: Path) -> float:
    """Case: all wheels of the truck are locked for 5 ms, with friction 0 on the left and 0.8 on the right. Error:
    relative difference of the loss of speed from mu g t / 2."""
    tyres, plane = (
        (piecewise_linear_friction((0.0, 0.0), (1.0, mu)) for mu in (0.0, 0.8)),
        plane_of_truck(PAPER_TRUCK, with_load_transfer=False),
    )
    moved_vehicle = AdvancedVehicle(
        implementation, plane, *tyres, rim_turning=0.0, road=road_of_stretches([RoadStretch(0.0, 0, 1)])
    )
    moved_vehicle.advance_with(np.full((6, 4), 2e4), 1e-3)
    lost = abs((SPEED - moved_vehicle.state[1, 0]) / (0.4 * GRAVITY * 5e-3) - 1.0)
    return lost if moved_vehicle.state[1, 2] < 0.0 else np.inf


def braking_scene(**scene_tables: Any) -> BrakingScene:
    """Braking scene of the truck from 1.5 m/s on ice without an anti-lock system; keyword arguments add or replace
    tables."""
    plain = {"title": "hard", "system": "braking", "procedures": {"stop": {"speed": 1.5}}, "pressure": {}}
    return build({**plain, **scene_tables})


def motion_after_rest_on_lagging_tyres(implementation: str, work_folder: Path) -> float:
    """Case: the truck slides to rest on tyres with relaxation lengths, then keeps its brakes on for 1 s. Error:
    displacement (m) and speed (m/s) after the stop."""
    scene = braking_scene(relaxation={"front": 0.5, "rear": 0.5})
    vehicle, start_state = vehicle_and_start_state(scene, "stop")
    vehicle = vehicle_in_engine(vehicle, implementation)
    start_state.state[1, 1] = 0.2
    path = vehicle.run(NoAntiLock(4), start_state, 10.0)
    rest_state = StartState(path.states[-1].copy(), path.turning[-1].copy())
    path_after = vehicle.run(NoAntiLock(4), rest_state, 1.0)
    displacement = np.abs(path_after.states[:, 0] - rest_state.state[0]).max() + np.abs(path_after.states[:, 1]).max()
    return float(displacement) if path.ended_at_rest else np.inf


def rest_error_of_scene(**scene_tables: Any) -> Error:
    """Case: a braking scene in which the vehicle must come to rest. Error: remaining speeds of vehicle and wheels (m/s,
    rad/s)."""

    def error(implementation: str, work_folder: Path) -> float:
        path = run(braking_scene(**scene_tables), implementation).detail
        return (
            float(np.abs(path.states[-1, 1]).max() + np.abs(path.turning[-1]).max()) if path.ended_at_rest else np.inf
        )

    return error


J_TURN_AT_LOCKING_LIMIT: dict[str, Any] = {
    "load_transfer": {"front": 0.3},
    "brakes": {"supply": 5.0},
    "road": {"stretches": [{"left": "dry"}]},
    "procedures": {"stop": {"kind": "j_turn", "speed": 15.0, "steer": 0.02}},
    "pressure": None,
}
"""Scene tables of a J-turn on dry road with brake torques at the limit of locking."""


def load_sharing_error(implementation: str, work_folder: Path) -> float:
    """Case: four wheel loads of which one is negative are redistributed to the other wheels. Error: change of their sum
    (N) and of their moments (N m) about both horizontal axes."""
    loads = np.array([9e3, 24e3, -4e3, 26e3])

    def balance() -> np.ndarray:
        return np.array([loads.sum(), loads @ TRUCK.place[:, 0], loads @ TRUCK.place[:, 1]])

    balance_before = balance()
    redistribute_negative_loads(loads, TRUCK.place)
    return float(np.abs(balance() - balance_before).max()) if loads.min() >= 0.0 else np.inf


def torque_below_push_out(implementation: str, work_folder: Path) -> float:
    """Case: a brake just below its push-out pressure. Error: its torque (N m), which should be 0."""
    return float(brake_torque(0, 0.99 * PAPER_FRONT_BRAKE.push_out, 0.0, brakes_of_wheels(PAPER_FRONT_BRAKE)))


def impossible_command_case(supply_pressure: float = 8.0, **command_fields: Any) -> Error:
    """Case: a controller returns an impossible command while the supply has a pressure (bar); the command must be
    refused. Error: infinite if it is not."""

    def error(implementation: str, work_folder: Path) -> float:
        usable_command(
            Command(**command_fields),
            Sample(3, 16_500_000, np.ones(4), True, supply_pressure, 10.0),
            maximum_pressure=supply_pressure,
        )
        return np.inf

    return error
