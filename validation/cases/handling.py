"""The R19-free car on four brush tyres: agreement of Exudyn and MuJoCo, the linear limit, friction, energy, standstill,
and computing time."""

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from models.contact.fastsim_many import LOAD, MU, A, B
from models.engines.free_vehicle_mujoco import FreeMujoco
from models.engines.mujoco_march import Marcher
from models.engines.mujoco_quiet import installed_callback
from models.machine.compiled import njit
from models.machine.timing import bootstrap_median, interleave
from models.multibody import forces as at
from models.multibody.numbers import GRAVITY, Controls, Handling, TyreParameters
from models.road.plane_waves import plane_waves
from models.systems.handling.energy import drive_energy, unaccounted_energy
from models.systems.handling.run import SimulatedDrive, drive_run, driven_model
from models.systems.handling.single_track import steady_turn_gains
from models.tyre.bristles import FIRST_FLEXIBILITY, brush_forces, patch_grid, tyre_forces
from models.vehicles.vehicle_file import load_vehicle
from validation.braking.load_transfer import braked_error, sliding_car, turning_car, turning_error
from validation.braking.sprung_box import box
from validation.common.rows import Observed, Row, System, behaviour_row
from validation.spatial.cars import cornering_error, mirrored_coordinates

TITLE = "A car on four rolling tyres"
SYSTEM: System = "rolling-vehicle"
R19_CAR = load_vehicle("r19_free")
R19_CAR_WITHOUT_DRAG = replace(R19_CAR, drags=())
WHEEL_NAMES = ("fl", "fr", "rl", "rr")
LANE_CHANGE_CONTROLS = Controls(steer=((0.0, 0.0), (0.3, 0.05), (0.7, -0.05), (1.0, 0.0)))
SMALL_LANE_CHANGE_CONTROLS = Controls(steer=tuple((time, 0.5 * angle) for time, angle in LANE_CHANGE_CONTROLS.steer))
ROAD_LEVEL, SEED, SPEED = 4e-6, 3, 25.0
SLOPE, GENTLE_FRICTION = 0.1, 0.05
TIMING_ROUNDS = 60


def car_in_lane_change(**setting_changes: Any) -> Handling:
    """The car in a lane change on a rough road; keyword arguments replace its settings."""
    return Handling(R19_CAR, controls=LANE_CHANGE_CONTROLS, waves=plane_waves(ROAD_LEVEL, seed=SEED)).changed(
        **setting_changes
    )


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows on tyre forces, engines and mirror image; a full run also has turns, stops, slopes, energy, planted faults
    and computing time."""
    duration = 0.3 if quick else 1.0
    drives = {engine: drive_run(engine, car_in_lane_change(), SPEED, duration) for engine in ("mujoco", "exudyn")}
    rows = [
        _engine_agreement_row(drives),
        *_single_tyre_rows(),
        _friction_power_row(drives["mujoco"]),
        _mirror_row(duration),
        _equal_bits_in_threads_row(),
    ]
    if not quick:
        rows += [
            *_steady_turn_rows(),
            *_locked_stop_rows(),
            *_load_transfer_rows(),
            _slope_standstill_row(),
            *_energy_rows(),
            *_planted_fault_rows(),
            _tyre_cost_row(),
        ]
    return rows, {}


def _drive_difference(first_drive: SimulatedDrive, second_drive: SimulatedDrive) -> float:
    """Largest difference of coordinates and rates between two drives."""
    return float(
        max(
            np.abs(first_drive.run.positions - second_drive.run.positions).max(),
            np.abs(first_drive.run.rates - second_drive.run.rates).max(),
        )
    )


def _engine_agreement_row(drives_by_engine: dict[str, SimulatedDrive]) -> Row:
    """Row: largest difference between Exudyn and MuJoCo in a lane change on a rough road."""
    return Observed(
        "handling.engines",
        SYSTEM,
        "lane change on a rough road: positions and rates of the two engines",
        _drive_difference(drives_by_engine["mujoco"], drives_by_engine["exudyn"]),
        "m, rad, m/s, rad/s",
    ).at_most(1e-10, "the same tableau, step and forces around two engines' own trees: rounding alone", "shared kernel")


def locked_wheel_error() -> float:
    """Largest error of the force on wheels that do not turn, divided by mu N. The exact force has the size mu N and
    opposes the sliding."""
    angles, speeds = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 25), [0.1, 1.0, 40.0])
    slides = np.zeros((angles.size, 4))
    slides[:, 0], slides[:, 1] = (speeds * np.cos(angles)).ravel(), (speeds * np.sin(angles)).ravel()
    forces = brush_forces(3000.0, 0.8, 0.08, 0.09, 5e7, slides)[:, :2]
    return float(np.abs(forces / (0.8 * 3000.0) + slides[:, :2] / np.hypot(*slides[:, :2].T)[:, None]).max())


def _single_tyre_rows() -> list[Row]:
    """Rows: cornering stiffness at small slip, and force on locked wheels, compared with closed forms."""
    return [
        Observed(
            "handling.cornering",
            SYSTEM,
            "cornering stiffness at small slip / that of the ride vehicle - 1",
            cornering_error(Handling(R19_CAR)),
            "",
        ).at_most(1e-3, "the bristles are those of the ride vehicle's tyres", "closed form"),
        Observed(
            "handling.locked",
            SYSTEM,
            "deviation of the force on a locked wheel from mu N against its sliding velocity, relative to mu N",
            locked_wheel_error(),
            "",
        ).at_most(1e-9, "all bristles slide one way", "closed form"),
    ]


def _friction_power_row(simulated_drive: SimulatedDrive) -> Row:
    """Row: friction of the tyres never feeds energy into the car."""
    return behaviour_row(
        "handling.power",
        SYSTEM,
        "power of each tyre's contact at every step of the lane change",
        "never positive" if simulated_drive["power"].max() <= 0.0 else "positive",
        "never positive",
        "friction takes energy out",
    )


def mirror_difference(handling_car: Handling, duration: float) -> float:
    """Largest difference between a steer step to the left and the mirror image of a steer step to the right."""
    left, right = (
        drive_run(
            "mujoco", handling_car.changed(controls=Controls(steer=((0.0, 0.0), (0.2, side * 0.06)))), SPEED, duration
        )
        for side in (1.0, -1.0)
    )
    return float(np.abs(left.run.positions - mirrored_coordinates(handling_car, right.run.positions)).max())


def _mirror_row(duration: float) -> Row:
    """Row: a steer step to the left compared with the mirror image of one to the right."""
    inclined = Handling(R19_CAR, TyreParameters(inclination=-0.02))
    return Observed(
        "handling.mirror",
        SYSTEM,
        "difference of a step steer to the left from the mirror image of a step steer to the right, inclined wheels",
        mirror_difference(inclined, duration),
        "m, rad",
    ).at_most(1e-10, "a symmetric vehicle", "none")


def yaw_gain_error(plant_fault: Callable[[Handling], None] | None = None, speed: float = 20.0) -> float:
    """Relative error of the yaw gain in a steady turn with small slip, compared with the closed form. ``plant_fault``
    may change the table of the vehicle first."""
    steer = 2e-5
    handling = Handling(R19_CAR_WITHOUT_DRAG, controls=Controls(steer=((0.0, 0.0), (0.5, steer))))
    gain = steady_turn_gains(handling, speed).yaw_gain
    if plant_fault is not None:
        plant_fault(handling)
    return float(drive_run("mujoco", handling, speed, 5.0).velocity()[-1, 2] / steer / gain - 1.0)


def _steady_turn_rows() -> list[Row]:
    """Rows: yaw gain of a steady turn compared with the single-track vehicle, and the understeer gradient."""
    turn = steady_turn_gains(Handling(R19_CAR_WITHOUT_DRAG), 20.0)
    return [
        Observed(
            "handling.turn",
            SYSTEM,
            "yaw gain of a steady turn of small slip at 20 m/s / that of the single-track vehicle - 1",
            yaw_gain_error(),
            "",
        ).at_most(1e-3, "linear tyres, with trail and turning slip", "closed form"),
        Observed("handling.understeer", SYSTEM, "its understeer gradient", turn.understeer, "s^2/m").beside(
            "positive: understeering", "closed form at the static loads"
        ),
    ]


def _locked_stop_rows() -> list[Row]:
    """Rows: braking force and distance of a stop with locked wheels, compared with Coulomb friction."""
    mu, speed = 0.7, 15.0
    handling = Handling(R19_CAR_WITHOUT_DRAG, TyreParameters(friction=mu, fixed=WHEEL_NAMES))
    drive = drive_run("mujoco", handling, speed, 2.0)
    ahead = drive.velocity()[:, 0]
    left = drive["fx"] + drive.largest_tyre_forces()
    stopped = (speed**2 - ahead[-1] ** 2) / (2.0 * mu * GRAVITY)  # sliding friction alone
    return [
        Observed(
            "handling.slide",
            SYSTEM,
            "braking force of four locked wheels: deviation from mu N, relative to mu N",
            float(np.abs(left / drive.largest_tyre_forces()).max()),
            "",
        ).at_most(1e-9, "at every step of a stop", "closed form"),
        Observed(
            "handling.stop",
            SYSTEM,
            "way of a stop with locked wheels from 15 m/s, by (v0^2 - v^2) / (2 mu g), less 1",
            float(drive.path[-1, 0] / stopped - 1.0),
            "",
        ).at_most(1e-2, "wheel loads swing about the weight when the body dives", "closed form"),
    ]


def _load_transfer_rows() -> list[Row]:
    """Rows: load transfer of the car, and of a box on four springs, compared with the balance of moments of all
    bodies."""
    rows = []
    for name, vehicle in (("car", R19_CAR_WITHOUT_DRAG), ("box", box().handling.given)):
        braking = braked_error(drive_run("mujoco", sliding_car(vehicle, GENTLE_FRICTION), 10.0, 2.0), GENTLE_FRICTION)
        turn = turning_error(drive_run("mujoco", turning_car(vehicle, 2e-3), SPEED, 3.0))
        rows += [
            Observed(
                f"handling.transfer.{name}",
                SYSTEM,
                f"load transfer of the {name} between its axles, wheels "
                f"locked at mu = {GENTLE_FRICTION:g}, by m_total a h / L and weight that leans, less 1",
                braking,
                "",
            ).at_most(5e-3, "first order in the pitch angle; 2 s of settling", "closed form"),
            Observed(
                f"handling.transfer_aside.{name}",
                SYSTEM,
                f"the same of the {name} between its sides in a steady turn of 0.4 m/s^2, by m_total a h / t",
                turn,
                "",
            ).at_most(1e-3, "first order in the roll angle", "closed form"),
        ]
    return rows


def _slope_standstill_row() -> Row:
    """Row: drift of a car that stands on a slope with locked wheels."""
    handling = Handling(R19_CAR, TyreParameters(fixed=WHEEL_NAMES), slope=SLOPE)
    drive = drive_run("mujoco", handling, 0.0, 2.0, 1e-4)
    last = slice(-2000, None)
    drift = float(np.abs(drive["slip_x"][last].mean(axis=0)).max())
    return Observed(
        "handling.slope", SYSTEM, f"drift of locked wheels at rest on a slope of {SLOPE:g} rad", 1e3 * drift, "mm/s"
    ).at_most(1.0, "bristles that do not roll are dampers, relative to 0.1 m/s", "none")


def _energy_rows() -> list[Row]:
    """Rows: error of the energy balance of a lane change, and its order in the step."""
    gaps = {}
    for name, friction, controls in (
        ("held", 20.0, SMALL_LANE_CHANGE_CONTROLS),
        ("sliding", 0.9, LANE_CHANGE_CONTROLS),
    ):
        for step in (1e-3, 5e-4):
            drive = drive_run(
                "mujoco",
                car_in_lane_change(tyres=TyreParameters(friction=friction), controls=controls),
                SPEED,
                1.0,
                step,
            )
            gaps[name, step] = float(np.abs(unaccounted_energy(drive)).max())
    start_energy = drive_energy(drive)[0]
    order = np.log2(gaps["held", 1e-3] / gaps["held", 5e-4])
    return [
        Observed(
            "handling.ledger",
            SYSTEM,
            "error of the energy balance of the lane change, relative to its total energy",
            gaps["sliding", 1e-3] / start_energy,
            "",
        ).at_most(
            1e-7,
            "springs, dampers, tyres, drag and steering are summed up by "
            "Simpson's rule; bristles that begin to slide limit its order",
            "closed form",
        ),
        behaviour_row(
            "handling.ledger_order",
            SYSTEM,
            "its order in the step where friction holds the bristles and no wheel lifts",
            "at least 3.5" if order >= 3.5 else f"{order:.2f}",
            "at least 3.5",
            "that of Runge and Kutta is 4",
            "closed form",
        ),
    ]


def _swap_axles(handling_car: Handling) -> None:
    """Plant a fault: the bristle stiffnesses of front and rear tyres are exchanged."""
    for front, rear in ((0, 2), (1, 3)):
        ahead, behind = handling_car.tyre_numbers(front), handling_car.tyre_numbers(rear)
        ahead[at.BRISTLES], behind[at.BRISTLES] = float(behind[at.BRISTLES]), float(ahead[at.BRISTLES])


def _reverse_steer(handling_car: Handling) -> None:
    """Plant a fault: one front wheel is steered in the opposite direction."""
    handling_car.tyre_numbers(1)[at.STEERED] *= -1.0


def _planted_fault_rows() -> list[Row]:
    """Rows: small faults planted in tyres, steering and friction are caught by the other checks."""
    soft, rough = Handling(R19_CAR), car_in_lane_change()
    soft.tyre_numbers(0)[at.BRISTLES] *= 1.01
    rough.tyre_numbers(2)[at.GRIP] *= 1.0 + 1e-6
    seen = {
        "bristles of one tyre 1 % too stiff, by the cornering stiffness": cornering_error(soft) > 1e-3,
        "bristles of front and rear swapped, by the steady turn": abs(yaw_gain_error(_swap_axles)) > 1e-3,
        "one wheel steered the other way, by the steady turn": abs(yaw_gain_error(_reverse_steer)) > 1e-3,
        "friction of one tyre 1e-6 off in one engine, by the engines": _drive_difference(
            drive_run("mujoco", rough, SPEED, 1.0), drive_run("exudyn", car_in_lane_change(), SPEED, 1.0)
        )
        > 1e-10,
    }
    return [
        behaviour_row(
            f"handling.fault{i}",
            SYSTEM,
            f"planted: {name}",
            "caught" if caught else "missed",
            "caught",
            "a check that cannot fail shows nothing",
        )
        for i, (name, caught) in enumerate(seen.items())
    ]


def _tyre_cost_row() -> Row:
    """Row: cost of MuJoCo's step with four tyres beyond the bare step and the tyres' own kernel."""
    steps, (car, bare) = 50, (car_in_lane_change(waves=np.empty((0, 4))) for _ in range(2))
    bare.numbers[at.TYRES] = 0.0
    jobs = _timed_march(car, steps), _timed_march(bare, steps), lambda: _repeat_four_tyres(4 * steps)
    full, none, kernel = interleave(jobs, TIMING_ROUNDS, 0.001, clock=time.process_time)
    ratio, low, high = bootstrap_median(full / (none + kernel) - 1.0)
    return Observed(
        "handling.price",
        SYSTEM,
        "step of MuJoCo with four tyres (22 x 21 cells), by a step without them "
        f"and what the kernel takes alone, less 1, 95 % interval {low:.3g} to {high:.3g}",
        ratio,
        "",
    ).aim(0.3, "seconds of the processor, median of interleaved rounds")


def _equal_bits_in_threads_row() -> Row:
    """Row: lane changes at three speeds give the same bits in two threads of MuJoCo as in one."""
    handling = car_in_lane_change()
    built = FreeMujoco(driven_model(handling))
    built.model.opt.timestep = 1e-3
    starts = np.array([np.concatenate(handling.straight(speed)) for speed in (20.0, 25.0, 30.0)])
    with installed_callback(built.law):
        serial, both = (Marcher(built.model, threads).run(starts, 50) for threads in (1, 2))
    outcome = "identical" if serial.tobytes() == both.tobytes() else f"{np.abs(serial - both).max():.1e} apart"
    return behaviour_row(
        "handling.threads",
        SYSTEM,
        "three lane changes computed by MuJoCo in two threads and in one: equal to the last bit",
        outcome,
        "identical",
        "the callback writes nothing but its own run's forces",
        "none",
    )


def _timed_march(handling_car: Handling, step_count: int) -> Callable[[], Any]:
    """Function that runs a number of steps in MuJoCo's own loop, without preparation or output channels."""
    built = FreeMujoco(driven_model(handling_car))
    built.model.opt.timestep = 1e-4
    start, marcher = np.concatenate(handling_car.straight(SPEED))[None], Marcher(built.model)

    def job() -> None:
        with installed_callback(built.law):
            marcher.run(start, step_count)

    return job


def _repeat_four_tyres(repeat_count: int) -> None:
    """Evaluate the forces of four slightly slipping tyres a number of times."""
    of = patch_grid(21)
    contacts, forces = np.zeros((4, 10)), np.empty((4, 4))
    contacts[:, [A, B, LOAD, MU]] = 0.08, 0.09, 3000.0, 0.9
    contacts[:, FIRST_FLEXIBILITY:] = 2e-8
    _repeat_tyre_forces(
        contacts, np.array([[0.1, 0.2, 0.1, SPEED]] * 4), of.strips, of.cells, of.middle, forces, repeat_count
    )


@njit(cache=True, error_model="numpy")
def _repeat_tyre_forces(tyre_contacts, sliding_velocities, strips, cells, middle_cells, forces, repeat_count):
    for _ in range(repeat_count):
        tyre_forces(tyre_contacts, sliding_velocities, strips, cells, middle_cells, forces)
