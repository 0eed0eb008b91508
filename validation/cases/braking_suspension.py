"""A braked vehicle on its suspension in Exudyn and MuJoCo: wheel loads, pitch and stops compared with closed forms and
with the plane vehicle."""

import math
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from models.brake.controller import Command, Controller, Sample
from models.brake.controllers.slip import SlipBangBang
from models.brake.plane_vehicle import GRAVITY
from models.brake.sprung import PITCH
from models.systems.braking.march import BrakingPath
from models.systems.braking.stop_report import StopHistory
from models.tyre.magic_formula import table_of_surface
from models.tyre.tyre_table import TyreTable
from validation.braking.sprung_box import (
    LOCKING_TORQUE,
    box,
    braked_vehicle,
    car,
    constant_friction,
    pitch_and_transfer,
    remaining_speed,
    steady_torques,
)
from validation.common.rows import Observed, Row, System, Table

TITLE = "Braking on the suspension"
SYSTEM: System = "anti-lock"
GENTLE_FRICTION, HARD_FRICTION = 0.05, 0.5
"""Coefficients of friction of locked wheels."""
TURN_TORQUES, HARD_TURN_TORQUES = (200.0, 200.0, 100.0, 100.0), (600.0, 600.0, 200.0, 200.0)
"""Brake torques (N m) of the four wheels in J-turns; no wheel locks."""


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of stops with locked wheels, and of a J-turn and its mirror image; a full run also compares Exudyn and
    MuJoCo, the limit of a stiff suspension, and ice."""
    wet = table_of_surface("wet")
    turns = [
        braked_vehicle(car(), wet, steer=steer).run(steady_torques(*HARD_TURN_TORQUES), 6.0) for steer in (0.1, -0.1)
    ]
    rows = [*_locked_wheel_rows(GENTLE_FRICTION), *_mirror_rows(*turns)]
    data: dict[str, Any] = {"limit": []}
    if not quick:
        rows += [
            *_locked_wheel_rows(HARD_FRICTION),
            *_engine_rows(wet),
            *_ice_stop_rows(),
            *_substep_rows(wet),
            _real_time_factor_row(wet),
        ]
        data["limit"] = stiff_suspension_distances(wet)
        rows += _stiff_suspension_rows(data["limit"])
    return rows, data


def _locked_wheel_rows(mu: float) -> list[Row]:
    """Rows of stops of the box and the car with locked wheels, from a speed at which the stop takes 4 s."""
    speed, rows = 4.0 * mu * GRAVITY, []
    for name, vehicle_kind in (("box", box()), ("car", car())):
        vehicle, row_name = braked_vehicle(vehicle_kind, constant_friction(mu)), f"{name}.{mu:g}"
        path = vehicle.run(steady_torques(*4 * (LOCKING_TORQUE,)), speed)
        distance, exact = float(path.states[-1, 0, 0]), speed**2 / (2.0 * mu * GRAVITY)
        late = -len(path.times) // 8
        gained = float(path.reports.load[late, :2].sum() - path.reports.load[0, :2].sum())
        plane, pitch = vehicle_kind.plane, float(path.states[late, 0, PITCH])
        moment = plane.mass * GRAVITY * (mu * plane.height + (plane.height - plane.front.radius) * pitch)
        weight = float(path.reports.load[late].sum()) / (plane.mass * GRAVITY)
        rows += [
            Observed(
                f"braking_suspension.locked.{row_name}",
                SYSTEM,
                f"relative difference of the {name}'s stopping distance from v^2 / (2 mu g), wheels "
                f"locked, mu = {mu:g}",
                abs(distance / exact - 1.0),
                "relative",
            ).at_most(
                1e-3, "wheels take v / r in J v / (r T) to lock; the centre of mass leans ahead of them", "closed form"
            ),
            Observed(
                f"braking_suspension.transfer.{row_name}",
                SYSTEM,
                f"relative difference of the {name}'s load transfer from m a h / L and the shift of its leaning weight",
                abs(gained * plane.wheelbase / moment - 1.0),
                "relative",
            ).at_most(
                2e-2 if mu == HARD_FRICTION else 2e-3, "pitch takes the weight forwards, and wheels less", "closed form"
            ),
            Observed(
                f"braking_suspension.weight.{row_name}",
                SYSTEM,
                "ratio of the sum of the wheel loads to the weight, late in braking",
                weight,
                "",
            ).within(1.0, 1e-4, "the body has come to rest on its springs", "closed form"),
            Observed(
                f"braking_suspension.stays.{row_name}",
                SYSTEM,
                f"speed of the {name} and its rims 2 s after the stop",
                remaining_speed(vehicle, path),
                "m/s",
            ).at_most(1e-3, "what stands has no slip, and friction holds it", "closed form"),
        ]
        if name == "box":
            rows += _pitch_and_load_transfer_rows(mu, pitch, gained)
    return rows


def _pitch_and_load_transfer_rows(mu: float, pitch: float, axle_load_gain: float) -> list[Row]:
    """Rows: pitch and load transfer of the braked box, compared with closed forms."""
    exact, bound = pitch_and_transfer(mu * GRAVITY), 2e-2 if mu == HARD_FRICTION else 2e-3
    return [
        Observed(
            f"braking_suspension.{what}.box.{mu:g}",
            SYSTEM,
            f"relative difference of the box's {what} from that of springs in series and the leaning weight",
            abs(value / theory - 1.0),
            "relative",
        ).at_most(bound, "closed form to first order in the pitch angle", "closed form")
        for what, value, theory in zip(("pitch", "axle-loads"), (pitch, axle_load_gain), exact, strict=True)
    ]


def _mirror_rows(left_turn: BrakingPath, mirrored_turn: BrakingPath) -> list[Row]:
    """Row: a J-turn of the car compared with its mirror image."""
    apart = np.abs(left_turn.states[-1, 0, :3] * (1.0, -1.0, -1.0) - mirrored_turn.states[-1, 0, :3]).max()
    return [
        Observed(
            "braking_suspension.mirror",
            SYSTEM,
            "difference between a J-turn of the car and its mirror image",
            float(apart),
            "m, rad",
        ).at_most(1e-9, "left and right differ by rounding alone", "closed form")
    ]


def _engine_rows(wet_tyre_table: TyreTable) -> list[Row]:
    """Row: distance between Exudyn and MuJoCo at the end of a braked turn with steps of 1 ms."""
    ends = [
        braked_vehicle(car(), wet_tyre_table, engine, 0.05, 1e-3)
        .run(steady_torques(*HARD_TURN_TORQUES), 15.0)
        .states[-1, 0, :2]
        for engine in ("mujoco", "exudyn")
    ]
    return [
        Observed(
            "braking_suspension.engines",
            SYSTEM,
            "distance between Exudyn and MuJoCo at the end of a braked turn, steps of 1 ms",
            float(np.hypot(*(ends[1] - ends[0]))),
            "m",
        ).at_most(5e-3, "the same forces around two multibody codes", "shared kernel")
    ]


def _substep_rows(wet_tyre_table: TyreTable) -> list[Row]:
    """Rows: stopping distance with 1 and with 4 substeps per sample, compared with 16 substeps."""
    distances = [
        braked_vehicle(car(), wet_tyre_table, steer=0.05, substeps=n)
        .run(steady_torques(*HARD_TURN_TORQUES), 10.0)
        .states[-1, 0, 0]
        for n in (1, 4, 16)
    ]
    return [
        Observed(
            "braking_suspension.step",
            SYSTEM,
            "relative difference of the stopping distance of a braked turn in steps of 5.5 ms from steps of 0.34 ms",
            abs(float(distances[0] / distances[2] - 1.0)),
            "relative",
        ).at_most(5e-4, "order two", "none"),
        Observed(
            "braking_suspension.substeps",
            SYSTEM,
            "relative difference of the stopping distance of a braked turn in steps of 1.4 ms from steps of 0.34 ms",
            abs(float(distances[1] / distances[2] - 1.0)),
            "relative",
        ).beside(5e-4, "four substeps, as a scene has them", "none"),
    ]


def _ice_stop_rows() -> list[Row]:
    """Rows: stop on ice by the slip controller, with the suspension and with the plane vehicle with load transfer."""
    ice, speed = table_of_surface("ice"), 11.11
    stops = [
        StopHistory(braked_vehicle(car(), ice, engine, substeps=4, gradient=150.0).run(SlipBangBang(wheels=4), speed))
        for engine in ("mujoco", None)
    ]
    distances = [stop.vehicle_results()["stopping distance [m]"] for stop in stops]
    return [
        Observed(
            "braking_suspension.ice.locks",
            SYSTEM,
            "longest time for which a wheel locks above 15 km/h on ice, bang-bang slip controller",
            float(stops[0].lock_times().longest_lock.max()),
            "s",
        ).at_most(0.1, "the controller holds the wheels", "none"),
        Observed(
            "braking_suspension.ice.distance",
            SYSTEM,
            "difference of the stopping distance on ice from that of the plane vehicle",
            abs(distances[0] / distances[1] - 1.0),
            "relative",
        ).beside(0.05, "single runs on ice scatter", "none"),
    ]


class _TimedController:
    """Wrapper of a controller that records the time (s) that the vehicle's model takes from each command to the next
    sample."""

    def __init__(self, controller: Controller) -> None:
        self.controller, self.command_time, self.seconds = controller, math.nan, list[float]()

    def sample(self, sample: Sample) -> Command:
        """The controller's command for a sample; the time since the last command is recorded."""
        self.seconds.append(perf_counter() - self.command_time)
        command = self.controller.sample(sample)
        self.command_time = perf_counter()
        return command


def _real_time_factor_row(wet_tyre_table: TyreTable) -> Row:
    """Row of the simulation speed, from the fastest tenth of the samples, which other processes disturb least."""
    vehicle, controller = (
        braked_vehicle(car(), wet_tyre_table, substeps=4, gradient=150.0),
        _TimedController(SlipBangBang(wheels=4)),
    )
    vehicle.run(controller, 15.0, 2.0)
    speed = vehicle.sample / float(np.nanquantile(controller.seconds, 0.1))
    return Observed(
        "braking_suspension.speed",
        SYSTEM,
        "speed of the car in MuJoCo at four substeps, measured once",
        speed,
        "times real time",
    ).aim(
        20.0,
        "all of a sample is one call of compiled code, which calls MuJoCo; the swiftest tenth of samples",
        "at least",
    )


def stiff_suspension_distances(tyre_table: TyreTable) -> list[list[float]]:
    """Distance (m) between the ends of a J-turn of the box on its suspension and of the plane vehicle with load
    transfer, for three stiffness factors. Each row of the result: stiffness factor, distance. The wheels have hardly
    any inertia."""
    distances = []
    for stiffer in (1.0, 10.0, 100.0):
        stiff_box = box(stiffer, 0.01)
        ends = [
            braked_vehicle(stiff_box, tyre_table, engine, 0.015, substeps=4)
            .run(steady_torques(*TURN_TORQUES), 10.0)
            .states[-1, 0, :2]
            for engine in ("mujoco", None)
        ]
        distances.append([stiffer, float(np.hypot(*(ends[1] - ends[0])))])
    return distances


def _stiff_suspension_rows(distances_by_stiffness: list[list[float]]) -> list[Row]:
    """Row: stiffer springs bring the box's J-turn closer to that of the vehicle in the plane."""
    return [
        Observed(
            "braking_suspension.limit",
            SYSTEM,
            "ratio of distances from the plane vehicle at the end of the box's J-turn: springs 100 "
            "times as stiff, to the plain springs",
            distances_by_stiffness[-1][1] / distances_by_stiffness[0][1],
            "",
        ).at_most(0.05, "stiff springs are the plane vehicle with algebraic load transfer", "shared kernel")
    ]


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Table of the limit of a stiff suspension."""
    rows = tuple((f"{stiffer:g}", f"{apart:.6f}") for stiffer, apart in case_data["limit"])
    return [
        Table(
            "Stiff suspension and plane vehicle",
            "A J-turn of a box on four springs, wheels almost massless in spin.",
            ("stiffness", "ends apart, m"),
            rows,
        )
    ]
