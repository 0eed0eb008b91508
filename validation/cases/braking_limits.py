"""Limits of braking: legal stops that must finish, rollover and jackknife, slow vehicles, and refused input."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from models.brake.brake import Brake, brakes_of_wheels
from models.brake.controller import SLOW
from models.brake.controllers.five_phase import FivePhase
from models.brake.controllers.five_phase_cycle import WheelAtConstantSpeed, limit_cycle
from models.brake.controllers.slip import SlipPI
from models.brake.plane_vehicle import GRAVITY
from models.brake.pressure import BrakeChambers, advance_by_valves, air_at_rest
from models.brake.trailer import CHOSEN_TRAILER
from models.core.errors import InputError, RunFailed
from models.systems.braking.run import run
from models.systems.braking.scene import build
from models.tyre.magic_formula import table_of_surface
from validation.braking.five_phase_exact import exact_cycle
from validation.braking.random_stops import random_stop
from validation.common.grounds import allowing_breaches
from validation.common.rows import Observed, Row, System, Table, behaviour_row

TITLE = "Limits of braking: stops that finish, vehicles that fall or fold, slow ones, and what cannot be"
SYSTEM: System = "anti-lock"
SEED = 19
STOP_COUNTS = {True: 3, False: 200}
"""Number of random stops, for a quick run (True) and a full run (False)."""
VEHICLE_LIMIT_WORDS = ("rolls over", "pitches over", "jackknifes", "turns over")
"""Words in the error of a run that ends at a physical limit of the vehicle, which a legal scene may reach."""
LINEAR_BRAKE = Brake(push_out=0.0, release=0.0, rising=1500.0, falling=1500.0)
LONG_RELEASE_CONTROLLER = FivePhase(
    1, e1=21.21, e2=26.62, e3=20.73, e4=2.07, e5=50.4, falling=74.51, fast=42.29, slow=6.42
)
"""Five-phase controller whose release does not end by the wheel's acceleration after a fast first application."""


@allowing_breaches("stops at the limits, and random ones: that they end, or say why not, is judged")
def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of all limits. A quick run takes three of the random stops, and one speed of the slow stops on split
    friction."""
    ends = [random_stop_ending(number) for number in range(STOP_COUNTS[quick])]
    rows = [_random_stops_row(ends), _jackknife_row(), *_rollover_rows(), _slow_pressure_rise_row(), _limit_cycle_row()]
    rows += [_split_friction_yaw_row(speed) for speed in ((1.0,) if quick else (0.5, 1.0, 3.0))]
    return rows + [_refused_input_row(*refusal_arguments) for refusal_arguments in REFUSED_INPUTS.items()], {
        "ends": ends
    }


def random_stop_ending(stop_number: int) -> str:
    """Text on how a random stop ended; empty if the vehicle came to rest."""
    try:
        path = run(build(random_stop(SEED, stop_number))).detail
    except RunFailed as error:
        return error.reason
    return "" if path.ended_at_rest else "does not stand"


def _random_stops_row(stop_endings: list[str]) -> Row:
    """Row: number of random stops that neither come to rest nor end at a physical limit of the vehicle."""
    limits = [end for end in stop_endings if any(limit in end for limit in VEHICLE_LIMIT_WORDS)]
    wrong = [f"{i}: {end}" for i, end in enumerate(stop_endings) if end and end not in limits]
    what = (
        f"stops that do not finish, of {len(stop_endings)} random legal ones, {len(limits)} of which end by a limit "
        "of the "
        f"vehicle: {'; '.join(wrong[:3])}"
    )
    return Observed("braking_limits.stops", SYSTEM, what.removesuffix(": "), len(wrong), "").within(
        0, 0, "asked for", "none"
    )


def _braking_scene(**scene_tables: Any) -> Any:
    """Scene of the system "braking" with the given tables."""
    return build({"system": "braking", "title": "limit", **scene_tables}, "limit.toml")


def _error_of_braking_procedure(scene: Any) -> RunFailed | None:
    """Error with which the only braking procedure of a scene fails; None if the procedure runs to its end."""
    try:
        run(scene)
    except RunFailed as error:
        return error
    return None


def _jackknife_row() -> Row:
    """Row: largest recorded hinge angle of a truck and trailer that jackknife while the truck's rear wheels slide,
    compared with the limit angle."""
    end = _error_of_braking_procedure(
        _braking_scene(
            vehicle={"override": {"mass": 4200.0, "yaw_inertia": 15000.0}},
            run={"duration": 6.0},
            road={"stretches": [{"left": "snow"}]},
            brakes={
                "supply": 8.0,
                "front": {"gradient": 1.0},
                "rear": {"gradient": 3000.0},
                "trailer": {"gradient": 1.0},
            },
            procedures={"p": {"kind": "turn", "speed": 12.0, "radius": 60.0}},
            trailer=CHOSEN_TRAILER.model_copy(update={"fold": 1.0}).model_dump(),
        )
    )
    headings = None if end is None or end.partial is None else end.partial.detail.states[:, 0, 2:]
    angle = 0.0 if headings is None else float(np.abs(np.diff(headings, axis=1)).max())
    angle_text = "" if end is None or "jackknifes" not in end.reason else end.reason
    return Observed(
        "braking_limits.jackknife",
        SYSTEM,
        f"largest recorded hinge angle of a train that jackknifes, limit 1 rad: {angle_text}",
        angle if angle_text else math.nan,
        "rad",
    ).within(1.0, 0.02, "a sample before the limit", "closed form")


def _rollover_rows() -> list[Row]:
    """Rows: a high truck with a narrow track rolls over in a J-turn on dry road; compared is the lateral acceleration
    that the error states."""
    track, height = 1.8, 2.2
    axle = {"track": track}
    end = _error_of_braking_procedure(
        _braking_scene(
            vehicle={"override": {"height": height, "front": axle, "rear": axle}},
            load_transfer={"front": 0.5},
            road={"stretches": [{"left": "dry"}]},
            brakes={"supply": 0.5},
            run={"duration": 3.0},
            procedures={"p": {"kind": "j_turn", "speed": 20.0, "steering": [[0.0, 0.0], [2.0, 0.12]]}},
        )
    )
    reason = "" if end is None else end.reason
    limit = float(reason.rpartition("limit ")[2]) if "rolls over" in reason else math.nan
    return [
        Observed(
            "braking_limits.roll_over",
            SYSTEM,
            f"sideways acceleration at which a vehicle rolls over: {reason}",
            limit,
            "m/s^2",
        ).within(GRAVITY * track / (2.0 * height), 0.005, "g t / (2 h); printed to two digits", "closed form"),
        behaviour_row(
            "braking_limits.roll_over.kept",
            SYSTEM,
            "the path until the vehicle rolls over is kept",
            "kept" if end is not None and end.partial is not None and len(end.partial.times) > 50 else "lost",
            "kept",
            "the run ends there, and is not lost",
        ),
    ]


def _slow_pressure_rise_row() -> Row:
    """Row: pressure in a brake chamber that fills slowly, compared with an exponential."""
    chambers = BrakeChambers(np.full(1, 0.15), np.full(1, 0.1), 8.0, slow=np.full(1, 1.2))
    air, torques = air_at_rest(chambers, 0.01), np.empty((5, 1))
    for _ in range(50):
        advance_by_valves(np.full(1, SLOW), 0.01, air, chambers, brakes_of_wheels(LINEAR_BRAKE), torques)
    return Observed(
        "braking_limits.slow_apply",
        SYSTEM,
        "relative difference of the pressure after 0.5 s of slow apply from its law",
        float(air.pressure[0]) / (8.0 * -math.expm1(-0.5 / 1.2)) - 1.0,
        "",
    ).at_most(1e-12, "supply (1 - exp(-t / slow))", "closed form")


def _limit_cycle_row() -> Row:
    """Row: period of the controller's limit cycle after a fast first application to a rolling wheel, compared with the
    exact period after a slow first application."""
    frozen = WheelAtConstantSpeed(20.0, 16900.0, 0.5, 13.35, LINEAR_BRAKE, table_of_surface("snow"))
    period, _ = exact_cycle(frozen, LONG_RELEASE_CONTROLLER, LONG_RELEASE_CONTROLLER.slow)
    reached = limit_cycle(frozen, replace(LONG_RELEASE_CONTROLLER), 1e-4).period
    return Observed(
        "braking_limits.cycle_from_rolling",
        SYSTEM,
        "relative difference of the period of the limit cycle, after a fast first application to a "
        "rolling wheel, from the exact period",
        reached / period - 1.0,
        "",
    ).at_most(1e-4, "the cycle does not know how it was begun", "closed form")


def _split_friction_yaw_row(start_speed: float) -> Row:
    """Row: final yaw angle of a stop on split friction with steps of 20 ms, compared with steps of 0.1 ms."""

    def yaw(substep_count: int) -> float:
        scene = _braking_scene(
            procedures={"p": {"kind": "split", "speed": start_speed, "right": "ice"}},
            brakes={"supply": 2.0},
            road={"stretches": [{"left": "dry"}]},
            load_transfer={},
            run={"sample": 0.02, "substeps": substep_count, "duration": 20.0},
        )
        return float(run(scene).detail.states[-1, 0, 2])

    return Observed(
        f"braking_limits.yaw.{start_speed:g}",
        SYSTEM,
        f"ratio of the yaw with steps of 20 ms to the yaw with steps of 0.1 ms, stop from {start_speed:g} "
        "m/s on split friction",
        yaw(1) / yaw(200),
        "",
    ).within(
        1.0,
        0.05,
        "a long step of a slow vehicle is cut; by whole steps it yaws 1.4 to 5.2 times as far",
        "shared kernel",
    )


REFUSED_INPUTS: dict[str, Callable[[], Any]] = {
    "a supply of 10000 bar": lambda: _braking_scene(procedures={"p": {}}, brakes={"supply": 1e4}),
    "a brake of 6e9 N m": lambda: _braking_scene(procedures={"p": {}}, brakes={"front": {"gradient": 1e9}}),
    "a truck lighter than its wheels": lambda: run(
        _braking_scene(procedures={"p": {}}, vehicle={"override": {"mass": 0.1}})
    ),
    "a gain of 1e12": lambda: SlipPI(4, gain=1e12),
    "a complex threshold": lambda: FivePhase(4, e1=1j),  # type: ignore[arg-type]
    "slow apply faster than apply": lambda: _braking_scene(procedures={"p": {}}, pressure={"slow": 0.01}),
}
"""Inputs that are physically impossible, each with a function that must raise InputError."""


def _refused_input_row(input_name: str, build_refused_scene: Callable[[], Any]) -> Row:
    """Row: an impossible input is refused by an error that names the entry and its value."""
    try:
        build_refused_scene()
        outcome = "taken"
    except InputError as error:
        outcome = "refused" if error.place and error.value is not None else "refused without its value"
    return behaviour_row(
        f"braking_limits.refused.{input_name.replace(' ', '-')}",
        SYSTEM,
        f"a scene with {input_name} is refused",
        outcome,
        "refused",
        "a vehicle that cannot be has no answer",
    )


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Table of the random stops that do not come to rest, with the reason."""
    ends = tuple((str(i), end) for i, end in enumerate(case_data["ends"]) if end)
    return [Table("Random stops that do not come to rest", "", ("number", "how it ended"), ends)] if ends else []
