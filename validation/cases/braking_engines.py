"""A braked truck in the plane: Exudyn, MuJoCo and hand-written equations compared with the compiled step, symmetries,
and the trailer."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from models.brake.advance import FINE, advance
from models.brake.brake import PAPER_BRAKES
from models.brake.controllers.slip import SlipBangBang
from models.brake.plane_vehicle import PAPER_TRUCK
from models.brake.pressure import BrakeChambers
from models.brake.trailer import CHOSEN_TRAILER, plane_of_trailer, trailer_behind_hook
from models.engines.braking import EngineChassis
from models.systems.braking.march import braked_vehicle_on_tyres
from models.tyre.tyre_table import StackedTyreTables, TyreTable, stacked_tables
from validation.braking.braked_truck import (
    ICE_TABLE,
    PAPER_PLANE,
    RollingTruck,
    lateral_displacement_when_locked,
    on_road,
    transfer_errors,
)
from validation.braking.truck_equations import TurnEnd, braked_turn
from validation.common.rows import Observed, Row, System, Table

TITLE = "Braking in a turn, in engines and with a trailer"
SYSTEM: System = "anti-lock"
TIME_STEP, START_SPEED, END_SPEED, STEER_ANGLE = 1e-3, 11.11, 0.5, 0.03
"""Step (s), initial and final speed (m/s), and steer angle (rad) of the braked turn."""
BRAKE_TORQUES = (870.0, 580.0)
"""Brake torque (N m) of each front and of each rear wheel: the truck goes 60 m, and no wheel locks."""
STIFF_TYRE_SLOPE = 100.0
"""Slope (1/rad) of the lateral friction of the trailer's tyres, so steep that the wheels nearly roll without slip."""


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of the braked turn in engines, by hand-written equations and mirrored, of straight braking, and of the
    trailer. A quick run brakes down to 10 m/s only."""
    until = 10.0 if quick else END_SPEED
    compiled = braked_truck_turn(until)
    beside = {"written out": braked_turn(PAPER_TRUCK, ICE_TABLE, STEER_ANGLE, BRAKE_TORQUES, START_SPEED, until)}
    beside |= {
        name: braked_truck_turn(until, step_function=EngineChassis(name, PAPER_PLANE).advance)
        for name in ("exudyn", "mujoco")
    }
    rows = [
        Observed(
            f"braking_engines.{name.replace(' ', '_')}",
            SYSTEM,
            f"distance at the end of a turn between {name} and the compiled step at 1 ms",
            float(np.hypot(end.x - compiled.x, end.y - compiled.y)),
            "m",
        ).at_most(
            5e-3,
            "the same vehicle by other equations and another method",
            "native" if name == "written out" else "shared kernel",
        )
        for name, end in beside.items()
    ]
    rows += [*_symmetry_rows(until, compiled), *_axle_load_rows(), *_trailer_rows(quick)]
    rows += [
        Observed(
            f"braking_engines.speed.{steps}",
            SYSTEM,
            f"speed of a compiled truck with a bang-bang slip controller on ice, samples of 5.5 ms in {steps} step(s)",
            real_time_factor(steps),
            "times real time",
        ).aim(100.0, "asked for; by the processor's time, which wanders", "at least")
        for steps in (1, 4)
    ]
    turns = {"compiled step": compiled, **beside}
    return rows, {name: list(where) for name, where in turns.items()}


def braked_truck_turn(
    end_speed: float, steer_angle: float = STEER_ANGLE, step_function: Callable[..., Any] = advance
) -> TurnEnd:
    """End of a braked turn of the truck on ice from START_SPEED down to ``end_speed`` (m/s), interpolated linearly
    within the last step."""
    truck = RollingTruck(
        on_road(PAPER_PLANE, stacked_tables([ICE_TABLE]), cornering_slope=ICE_TABLE.cornering),
        START_SPEED,
        steer=steer_angle,
        advance_step=step_function,
    )
    while True:
        passed, position, fast = truck.time, truck.state[0].copy(), truck.speed
        status, used = truck.on(np.repeat(BRAKE_TORQUES, 2), TIME_STEP)
        if status != FINE or truck.speed <= end_speed:
            share = (fast - end_speed) / (fast - truck.speed)
            x, y, heading = (float(value) for value in position + share * (truck.state[0] - position))
            return TurnEnd(x, y, heading, float(passed + share * used))


def real_time_factor(substep_count: int) -> float:
    """Simulated seconds of a straight stop per second of processor time."""
    chambers = BrakeChambers(np.full(4, 0.15), np.full(4, 0.1), 6.0)
    vehicle = braked_vehicle_on_tyres(PAPER_PLANE, [ICE_TABLE], PAPER_BRAKES, chambers, substeps=substep_count)
    vehicle.run(SlipBangBang(wheels=4), START_SPEED, 0.1)
    start = time.process_time()
    path = vehicle.run(SlipBangBang(wheels=4), START_SPEED)
    return float(path.times[-1]) / (time.process_time() - start)


def _axle_load_rows() -> list[Row]:
    """Rows: axle loads of a truck with locked wheels, and the sideways path of a truck with locked steered wheels."""
    rows = [
        Observed(
            f"braking_engines.transfer.{name.replace(' ', '-')}",
            SYSTEM,
            f"relative difference of the axle loads from those of a rigid truck, {name} locked",
            error,
            "relative",
        ).at_most(1e-6, "loads are solved with the forces that they allow, not lagged", "closed form")
        for name, error in transfer_errors().items()
    ]
    return [
        *rows,
        Observed(
            "braking_engines.locked-front",
            SYSTEM,
            "sideways distance of a truck with steered, locked front wheels",
            abs(lateral_displacement_when_locked()),
            "m",
        ).at_most(1e-3, "a locked wheel's force is against its way, wherever it points", "closed form"),
    ]


def _symmetry_rows(end_speed: float, steered_turn: TurnEnd) -> list[Row]:
    """Rows: a turn compared with its mirror image, and no yaw without steering."""
    mirrored, straight = braked_truck_turn(end_speed, -STEER_ANGLE), braked_truck_turn(end_speed, 0.0)
    apart = max(
        abs(mirrored.x - steered_turn.x), abs(mirrored.y + steered_turn.y), abs(mirrored.heading + steered_turn.heading)
    )
    return [
        Observed(
            "braking_engines.mirror", SYSTEM, "difference between a turn and its mirror image", apart, "m, rad"
        ).at_most(1e-9, "left and right differ by rounding alone", "closed form"),
        Observed(
            "braking_engines.no_yaw",
            SYSTEM,
            "yaw and sideways distance without steering on equal friction",
            abs(straight.heading) + abs(straight.y),
            "m, rad",
        ).at_most(0.0, "equal forces have no moment", "closed form"),
    ]


def lateral_tyre_tables(friction_slope: float) -> StackedTyreTables:
    """Tyre tables with lateral friction alone. Its coefficient rises with a slope (1/rad) up to a slip angle of 0.01
    rad."""
    mu = np.array([[0.0], [0.01 * friction_slope], [0.01 * friction_slope]])
    nodes = np.array([0.0, 0.01, np.pi / 2.0]), np.array([0.0, 0.1, 1.0]), np.array([1e4])
    return stacked_tables([TyreTable(*nodes, np.zeros((3, 1, 3)), np.ones((3, 3)), mu)])


def _trailer_rows(quick: bool) -> list[Row]:
    """Rows on the trailer: pulled straight at 0.2 m/s; in the full run also on a circle of 15 m radius at 0.5 m/s."""
    why = "wheels that only roll: low speed, stiff tyres"
    rows = [
        Observed(
            "braking_engines.pull",
            SYSTEM,
            "relative difference of the drawbar angle on a straight pull from its closed form",
            trailer_pull_error(),
            "",
        ).at_most(1e-4, why, "closed form")
    ]
    if not quick:
        rows += [
            Observed(
                f"braking_engines.circle_{name}",
                SYSTEM,
                f"relative difference of the radius of the {name} axle on a circle from its closed form",
                off,
                "",
            ).at_most(1e-4, why, "closed form")
            for name, off in zip(("front", "rear"), trailer_circle_errors(), strict=True)
        ]
    return rows


def trailer_pull_error(
    start_angle: float = 0.5, v: float = 0.2, time_step: float = 5e-4, duration: float = 4.0
) -> float:
    """Relative error of the drawbar angle psi after a straight pull over the time t at speed v. Exact, with drawbar
    length L: tan(psi / 2) = tan(psi_0 / 2) exp(-v t / L)."""
    n = round(duration / time_step)
    state = np.array(
        [[0.0, 0.0, start_angle, start_angle], [v, 0.0, -v * np.sin(start_angle) / CHOSEN_TRAILER.drawbar, 0.0]]
    )
    states, _ = trailer_behind_hook(
        plane_of_trailer(CHOSEN_TRAILER),
        lateral_tyre_tables(STIFF_TYRE_SLOPE),
        state,
        np.tile([v, 0.0], (n + 1, 1)),
        time_step,
        STIFF_TYRE_SLOPE,
        np.zeros(4),
    )
    exact = 2.0 * np.arctan(np.tan(start_angle / 2.0) * np.exp(-v * duration / CHOSEN_TRAILER.drawbar))
    return abs(float(states[-1, 0, 2] / exact - 1.0))


def trailer_circle_errors(
    radius: float = 15.0, v: float = 0.5, time_step: float = 2e-4, duration: float = 20.0
) -> tuple[float, float]:
    """Relative errors of the radii of the trailer's front and rear axle on a steady circle. Exact, with drawbar length
    L: R_front^2 = R_hook^2 - L^2 and R_rear^2 = R_front^2 - wheelbase^2."""
    yaw_rate, times = v / radius, time_step * np.arange(round(duration / time_step) + 1)
    hook = v * np.column_stack((-np.sin(yaw_rate * times), np.cos(yaw_rate * times)))
    front = np.sqrt(radius**2 - CHOSEN_TRAILER.drawbar**2)
    rear = np.sqrt(front**2 - CHOSEN_TRAILER.wheelbase**2)
    first = np.pi / 2.0 - np.arcsin(CHOSEN_TRAILER.drawbar / radius)
    state = np.array(
        [[radius, 0.0, first, first - np.arcsin(CHOSEN_TRAILER.wheelbase / front)], [*hook[0], yaw_rate, yaw_rate]]
    )
    states, _ = trailer_behind_hook(
        plane_of_trailer(CHOSEN_TRAILER),
        lateral_tyre_tables(STIFF_TYRE_SLOPE),
        state,
        hook,
        time_step,
        STIFF_TYRE_SLOPE,
        np.zeros(4),
    )
    x, y, drawbar, body = states[-1, 0]
    at = np.array([x, y]) - CHOSEN_TRAILER.drawbar * np.array([np.cos(drawbar), np.sin(drawbar)])
    behind = at - CHOSEN_TRAILER.wheelbase * np.array([np.cos(body), np.sin(body)])
    return abs(float(np.hypot(*at) / front - 1.0)), abs(float(np.hypot(*behind) / rear - 1.0))


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Table of position, heading and time at the end of the braked turn."""
    rows = tuple((name, *(f"{value:.6f}" for value in where)) for name, where in case_data.items())
    return [
        Table(
            "End of the turn",
            "On ice, front wheels steered by 0.03 rad, constant torques.",
            ("by", "x, m", "y, m", "heading, rad", "time, s"),
            rows,
        )
    ]
