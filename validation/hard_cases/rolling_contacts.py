"""Hard cases of rolling contacts: wheels of the callback rig, a contact that jumps to another patch, a car on four
tyres.

Of the rig, the reference is the compiled kernel called alone; a car has none, and its reference is Runge and Kutta's
method written out about MuJoCo's accelerations.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from scipy.integrate import simpson

from models.core.trajectory import Trajectory
from models.engines.contact_bridge import RailWheels, add_forces, check_step, forces
from models.engines.contact_bridge_exudyn import RailWheelSystem, WheelForceFunctions
from models.engines.contact_bridge_mujoco import rail_wheel_model
from models.engines.mujoco_callback import kernel_law
from models.engines.mujoco_quiet import installed_callback
from models.multibody.numbers import Handling, TyreParameters
from models.multibody.plain.march import march
from models.rail.energy import energy_ledger
from models.rail.equations import WheelsetEquations
from models.rail.laid_profiles import CrossSections
from models.rail.wheel_forces import REGULARISED_SPEED
from models.rail.wheelset import CHOSEN_WHEELSET
from models.systems.handling.energy import drive_energy
from models.systems.handling.run import SimulatedDrive, build_in_engine, drive_of_fixed_steps, drive_run
from models.vehicles.vehicle_file import load_vehicle
from validation.hard_cases.case import HardCase
from validation.hard_cases.rolling import built_wheelset, displaced_state

SLIDING_VELOCITIES = np.array(
    [[0.02, 0.01, 0.0, 0.3], [-0.3, 0.1, 0.0, -2.0], [1e-6, -2e-6, 0.0, 1e-4], [0.0, 0.0, 0.0, 1.0]]
)
"""Velocities (4, 4) of four wheels: x', y', z' (m/s), yaw' (rad/s)."""
LOCKED_TYRES = TyreParameters(cells=11, fixed=("fl", "fr", "rl", "rr"))
HILL_WAVES = np.array([[2.0 * np.pi / 10.0, 0.0, -0.08, 0.0], [0.0, 0.0, 0.08, 0.0]])
"""Road waves of a hill 16 cm high and 10 m long, flat at the start."""
R19_VEHICLE = replace(load_vehicle("r19_free"), drags=())


def rig_forces(engine_name: str, wheels: RailWheels, wheel_velocities: np.ndarray) -> np.ndarray:
    """Contact forces (4, 4) on the rig's wheels, which are at fixed positions and have velocities (4, 4)."""
    q, v, f = np.zeros(wheels.size), wheel_velocities.ravel(), np.zeros(wheels.size)
    if engine_name == "exudyn":
        f = np.array(WheelForceFunctions(wheels).of(list(q), list(v)))
    elif engine_name == "mujoco":
        rig = rail_wheel_model(replace(wheels, stiffness=(0.0,) * 4, damping=(0.0,) * 4), 1e-7)
        data = mujoco.MjData(rig)
        data.qvel[:] = v
        with installed_callback(kernel_law(forces)):
            mujoco.mj_forward(rig, data)
        f = data.qfrc_passive.copy()
    else:
        add_forces(wheels.numbers, q, v, f)
    return f.reshape(-1, 4)


def excess_over_friction_limit(wheels: RailWheels, forces: np.ndarray) -> float:
    """Largest tangential force divided by mu N, minus 1; infinite if a contact gains energy."""
    if (forces * SLIDING_VELOCITIES).sum(axis=1).max() > 0.0 or not np.isfinite(forces).all():
        return np.inf
    return max(0.0, float(np.hypot(forces[:, 0], forces[:, 1]).max() / (wheels.mu * wheels.load) - 1.0))


def friction_excess(engine_name: str, work_folder: Path, **rig_changes: Any) -> float:
    """Case: wheels at three speeds, zero included, for both theories with a friction limit. Error: largest excess of
    the force over mu N, divided by mu N."""
    shares = []
    for theory in ("fastsim", "simplified"):
        for speed in (20.0, 0.0, -20.0):
            wheels = RailWheels(theory=theory, cells=7, speed=speed, **rig_changes)
            shares.append(excess_over_friction_limit(wheels, rig_forces(engine_name, wheels, SLIDING_VELOCITIES)))
    return max(shares)


def reversal_force_jump(engine_name: str, work_folder: Path) -> float:
    """Case: the speed passes 0 and the limits of the regularisation. Error: largest change of a force divided by mu
    N."""
    shares = []
    for middle in (-REGULARISED_SPEED, 0.0, REGULARISED_SPEED):
        backwards, forwards_wheels = (
            RailWheels(cells=7, speed=middle + speed_offset) for speed_offset in (-1e-9, 1e-9)
        )
        change = rig_forces(engine_name, forwards_wheels, SLIDING_VELOCITIES) - rig_forces(
            engine_name, backwards, SLIDING_VELOCITIES
        )
        shares.append(np.abs(change[:, :2]).max() / (backwards.mu * backwards.load))
    return float(max(shares))


def pure_spin_force_error(engine_name: str, work_folder: Path) -> float:
    """Case: wheels with pure spin. Error: longitudinal force divided by mu N; infinite if there is no lateral force."""
    wheels = RailWheels(cells=7)
    shares = rig_forces(engine_name, wheels, SLIDING_VELOCITIES[[3, 3, 3, 3]]) / (wheels.mu * wheels.load)
    return float(np.abs(shares[:, 0]).max()) if np.abs(shares[:, 1]).min() > 1e-3 else np.inf


def too_long_step_error(engine_name: str, work_folder: Path) -> float:
    """Case: a step of 1 ms at 0.1 m/s, explicit or implicit without slopes of the contact forces, which must be refused
    or fail. Error: infinite if it does not."""
    wheels = RailWheels(1, speed=0.1)
    start = (np.array([1e-4, 1e-4, 0.0, 1e-4]), np.zeros(4))
    if engine_name == "exudyn":
        RailWheelSystem(wheels, WheelForceFunctions(wheels).of).run(*start, 200, 1e-3, "GeneralizedAlpha")
    elif engine_name == "mujoco":
        rail_wheel_model(wheels, 1e-3, "RK4")
    else:
        check_step("reference", wheels, "RK4", 1e-3)
    return np.inf


def patch_jump_energy_error(engine_name: str, work_folder: Path) -> float:
    """Case: a wheelset whose contacts open and close. Error: that of its energy balance divided by the energy that
    creep dissipates."""
    equations = built_wheelset(engine_name, CHOSEN_WHEELSET.changed(profiles=CrossSections()), 30.0)
    motion = equations.run(displaced_state(equations, Y=3e-3, Y_RATE=0.2), 0.03, 1e-4)
    carries = motion.contacts["load"] > 0.0
    if (carries[1:] != carries[:-1]).any(axis=1).sum() < 2 or motion.contacts["power"].max() > 0.0:
        return np.inf
    book = energy_ledger(WheelsetEquations(equations.wheelset, equations.speed, equations.law, equations.cells), motion)
    return float(np.abs(book.residual).max() / book.creep[-1])


def car_run(
    engine_name: str, handling: Handling, start_speed: float, duration: float, time_step: float
) -> SimulatedDrive:
    """Run of a car on its tyres in an implementation, from a speed (m/s); duration and step in s."""
    if engine_name != "reference":
        return drive_run(engine_name, handling, start_speed, duration, time_step)
    model, start = build_in_engine("mujoco", handling), handling.straight(start_speed)
    states = march(lambda _, q, v: model.acceleration(0.0, q, v), *start, round(duration / time_step), time_step)
    return drive_of_fixed_steps(handling, Trajectory(time_step * np.arange(len(states)), states))


def violates_friction(car_drive: SimulatedDrive) -> bool:
    """Whether a tyre contact of a run gains energy, or its force exceeds mu N."""
    force = np.hypot(car_drive["fx"], car_drive["fy"])
    return bool(car_drive["power"].max() > 0.0 or (force > car_drive.largest_tyre_forces() * (1.0 + 1e-9)).any())


def energy_balance_error(car_drive: SimulatedDrive) -> float:
    """Error of the energy balance over a run with equal steps, divided by the initial energy."""
    run_times, ends = car_drive.run.times, [0, -1]
    run_ends = Trajectory(run_times[ends], car_drive.run.states[ends])
    first_energy, last_energy = drive_energy(
        SimulatedDrive(car_drive.handling, run_ends, car_drive.tyres[ends], car_drive.ledger[ends])
    )
    return float(abs(last_energy - first_energy - simpson(car_drive.power(), x=run_times)) / first_energy)


def ramp_jump_error(engine_name: str, work_folder: Path) -> float:
    """Case: a car leaves a ramp with all wheels and lands. Error: that of its energy balance divided by the initial
    energy."""
    run = car_run(engine_name, Handling(R19_VEHICLE, TyreParameters(cells=7), waves=HILL_WAVES), 25.0, 0.5, 5e-4)
    loads = run["load"]
    in_air = (loads == 0.0).all(axis=1)
    if violates_friction(run) or not in_air.any() or (loads[-1] == 0.0).any():
        return np.inf
    return energy_balance_error(run)


def creep_when_parked(engine_name: str, work_folder: Path) -> float:
    """Case: a car parked on a slope with locked wheels. Error: its mean speed (m/s) after the first swing."""
    run = car_run(engine_name, Handling(R19_VEHICLE, LOCKED_TYRES, slope=0.1), 0.0, 0.05, 1e-4)
    return np.inf if violates_friction(run) else float(np.abs(run["slip_x"][-250:].mean(axis=0)).max())


def locked_wheel_error(engine_name: str, work_folder: Path) -> float:
    """Case: a car with locked wheels. Error: relative difference of the tyre forces from mu N against the sliding."""
    run = car_run(engine_name, Handling(R19_VEHICLE, LOCKED_TYRES), 15.0, 0.03, 1e-3)
    return float(np.abs(run["fx"] / run.largest_tyre_forces() + 1.0).max())


def roll_back_error(engine_name: str, work_folder: Path) -> float:
    """Case: a car rolls up a slope, stops and rolls back. Error: that of its energy balance divided by the initial
    energy."""
    run = car_run(engine_name, Handling(R19_VEHICLE, TyreParameters(cells=7), slope=0.3), 0.005, 0.006, 4e-5)
    forward_speed = run.velocity()[:, 0]
    if violates_friction(run) or not forward_speed[0] > 0.0 > forward_speed[-1]:
        return np.inf
    return energy_balance_error(run)


ErrorFunction = Callable[[str, Path], float]
RIG: tuple[tuple[str, str, ErrorFunction], ...] = (
    ("rig with friction of 1e-6", "next to nothing holds", partial(friction_excess, mu=1e-6)),
    ("rig with friction of 1", "all that can hold", partial(friction_excess, mu=1.0)),
    ("rig with a load of a micronewton", "patches of micrometres", partial(friction_excess, load=1e-6)),
)
CASES = (
    *(
        HardCase(name, hard, "|F| <= mu N, no power; at rest, too", "mu N", 1e-8, "rounding of the approach", error)
        for name, hard, error in RIG
    ),
    HardCase(
        "rig that reverses",
        "leading edges become trailing ones",
        "forces do not jump",
        "mu N",
        1e-5,
        "slope times 2e-9 m/s",
        reversal_force_jump,
    ),
    HardCase(
        "rig that only spins",
        "no creepage",
        "no force along the rail, some across",
        "mu N",
        1e-9,
        "rounding",
        pure_spin_force_error,
    ),
    HardCase(
        "rig at 0.1 m/s in steps of 1 ms",
        "friction damps at 1e5 1/s",
        "refused, or Newton's method says it failed",
        "",
        0.0,
        "exact",
        too_long_step_error,
        {"reference": "refused", "mujoco": "refused", "exudyn": "raised"},
    ),
    HardCase(
        "contact that jumps to another patch",
        "loads come and go within steps",
        "energy is accounted for",
        "of creep's",
        1e-3,
        "error of the step",
        patch_jump_energy_error,
    ),
    HardCase(
        "car off a ramp",
        "wheels lift off and land",
        "energy is accounted for",
        "of it",
        1e-6,
        "error of the step",
        ramp_jump_error,
    ),
    HardCase(
        "car parked on a slope",
        "creepage by no speed",
        "creeps by less than 1 mm/s",
        "m/s",
        1e-3,
        "asked for",
        creep_when_parked,
    ),
    HardCase(
        "car with locked wheels",
        "all bristles slide",
        "mu N against the sliding",
        "mu N",
        1e-9,
        "rounding",
        locked_wheel_error,
    ),
    HardCase(
        "car that rolls back",
        "tyres' speed passes 0",
        "energy is accounted for",
        "of it",
        1e-6,
        "error of the step",
        roll_back_error,
    ),
)
