"""Assumptions of the pitch-plane vehicle's equations; effects add further assumptions in their modules."""

from collections.abc import Callable
from contextlib import suppress
from functools import partial

import numpy as np

from models.core.assumptions import Assumption, Watched
from models.core.errors import InputError
from models.core.result import Result
from models.engines.assembly import Assembly
from models.vehicles.pitch_plane import PitchPlaneParameters

SMALL_PITCH = 0.3
"""Largest pitch (rad) with linear geometry: it differs from its sine by 1.5 %."""
STEEPEST_PITCH = 0.5
"""Largest pitch (rad): no road is steeper, and the wheels, which only move vertically, are 12 %
nearer to each other.
"""
PULL_LIMIT = 1.0
"""Largest pull (N) of a tyre at the road that does not count as leaving the road."""
LARGEST_TYRE_TRAVEL = 0.12
"""Largest compression (m) of a tyre: beyond, it rests on its rim; a car's sidewall is 0.1 to 0.14 m high."""
LARGEST_SPRING_EXTENSION = 1e-3
"""Largest extension (m) of a suspension spring beyond its free length that does not count as pulling."""
ARTIFICIAL_SHARE_LIMIT = 0.15
"""Largest rms of an artificial moment up to 15 Hz divided by the rms of I pitch'', and of an artificial force divided
by the rms of m3 z3'': beyond, it contributes to the damage. models/drift/score.py uses the same limit.
"""


def assumptions(vehicle_assembly: Assembly) -> list[Assumption]:
    """Assumptions of the equations of an assembled scene: tyres, springs, pitch, and artificial forces."""
    lifts = any(tyre.pushes_only for tyre in vehicle_assembly.vehicle.tyres)
    listed = _tyre_assumptions(vehicle_assembly, lifts) if vehicle_assembly.mode in ("free", "road") else []
    listed.append(_spring_assumption(vehicle_assembly, lifts))
    if vehicle_assembly.vehicle.geometry == "linear":
        remedy = 'use vehicle.geometry = "exact"'
        says = "the pitch is so small that its sine is itself"
        listed.append(Assumption("small angles", says, remedy, _watched_pitch, "rad", -SMALL_PITCH, SMALL_PITCH))
    listed.append(upright_assumption(_pitch_remedy(vehicle_assembly), _watched_pitch))
    if vehicle_assembly.vehicle.pitch_springs or vehicle_assembly.guided:
        listed.append(_artificial_force_assumption(vehicle_assembly))
    return [*listed, *vehicle_assembly.assumptions]


def principal_channels(vehicle_assembly: Assembly) -> tuple[str, ...]:
    """Names of the channels whose error is estimated: motions and forces that are not prescribed."""
    free = tuple(name for name, index in (("z3", 2), ("pitch", 3)) if index not in vehicle_assembly.guided)
    wheels = ("f1", "f2") if vehicle_assembly.mode in ("free", "road") else ()
    enforced = {"pitch": ("enforced_moment",), "heave-pitch": ("enforced_force", "enforced_moment")}
    return (*free, *wheels, "f3", "f4", *enforced.get(vehicle_assembly.mode, ()))


def watch_function(**channel_by_name: str) -> partial[Watched]:
    """Returns a function of a result that gives its channels under other names; ``channel_by_name`` : channel by
    name.
    """
    return partial(_watched_channels, channel_by_name)


def _watched_channels(channel_by_name: dict[str, str], run_result: Result) -> Watched:
    """Values of some channels of a result under other names."""
    return {name.replace("_", " "): run_result[channel] for name, channel in channel_by_name.items()}


_watched_pitch = watch_function(chassis="pitch")


def _tyre_assumptions(vehicle_assembly: Assembly, tyres_may_lift: bool) -> list[Assumption]:
    """Assumptions that tyres are not pressed to their rims and, where they may not lift, that they press on the
    road.
    """
    pressed = Assumption(
        "tyres not flat",
        "no tyre is pressed to its rim",
        "use tyres that are stiffer (vehicle.override), or drive more slowly",
        partial(_deflections, vehicle_assembly.parameters),
        "m",
        upper_limit=LARGEST_TYRE_TRAVEL,
    )
    if tyres_may_lift:
        return [pressed]
    says, remedy = "linear tyres stay on the road", "name the effect lift_off, whose tyres only push"
    forces = watch_function(front_wheel="f1", rear_wheel="f2")
    return [Assumption("tyres press", says, remedy, forces, "N", lower_limit=-PULL_LIMIT), pressed]


def _deflections(vehicle_parameters: PitchPlaneParameters, run_result: Result) -> Watched:
    """Static deflection (n,) in m of each tyre under the wheel's force, by tyre."""
    return {
        "front tyre": run_result["f1"] / vehicle_parameters.k1,
        "rear tyre": run_result["f2"] / vehicle_parameters.k2,
    }


def _spring_assumption(vehicle_assembly: Assembly, tyres_may_lift: bool) -> Assumption:
    """Assumption that no suspension spring pulls, as the equations have no droop stop, which would prevent it."""
    remedy = "no effect adds a droop stop: start lower, or excite it less"
    if vehicle_assembly.mode not in ("free", "road"):
        remedy = f"take wheel forces of tyres that only push (lift_off on a road); {remedy}"
    elif not tyres_may_lift:
        remedy = f"name the effect lift_off, whose tyres do not pull the wheels down; else {remedy}"
    return Assumption(
        "springs compressed",
        "no suspension droops beyond its spring's free length",
        remedy,
        partial(_compressions, vehicle_assembly.parameters, vehicle_assembly.vehicle.geometry == "exact"),
        "m",
        lower_limit=-LARGEST_SPRING_EXTENSION,
    )


def _compressions(vehicle_parameters: PitchPlaneParameters, exact_geometry: bool, run_result: Result) -> Watched:
    """Compression (n,) in m of each suspension spring from the motion of chassis and wheels, by axle."""
    sine_of_pitch = np.sin(run_result["pitch"]) if exact_geometry else run_result["pitch"]
    return {
        "front suspension": run_result["z3"] - vehicle_parameters.b * sine_of_pitch - run_result["z1"],
        "rear suspension": run_result["z3"] + vehicle_parameters.a * sine_of_pitch - run_result["z2"],
    }


def upright_assumption(remedy: str, pitch_of_result: Callable[[Result], Watched]) -> Assumption:
    """Assumption that the pitch stays within STEEPEST_PITCH; ``pitch_of_result`` : function of a result that gives it
    (rad).
    """
    says = "the chassis pitches less than any road does, as wheels only move vertically"
    return Assumption("upright", says, remedy, pitch_of_result, "rad", -STEEPEST_PITCH, STEEPEST_PITCH)


def _pitch_remedy(vehicle_assembly: Assembly) -> str:
    """Text with advice on how to keep the pitch small in a run."""
    if vehicle_assembly.guided:
        return "no effect lifts it: check the file of the prescribed pitch, and its unit"
    if vehicle_assembly.mode in ("free", "road"):
        return "no effect lifts it: drive more slowly, or start nearer to level"
    return "hold it by prescribed_pitch, kalman_filter or pitch_spring, or end the run before"


def _artificial_force_assumption(vehicle_assembly: Assembly) -> Assumption:
    """Assumption that artificial forces of springs or prescribed motion are small compared with the
    chassis' inertia.
    """
    remedy = "the measured motion, or the wheel forces, do not fit the vehicle: smooth it (bandwidth), correct its mass"
    soft = "soften what holds the pitch, or name kalman_filter with a measured pitch in its place"
    return Assumption(
        "little artificial",
        "the forces that hold pitch or heave are small compared with the chassis' own inertia",
        remedy if vehicle_assembly.guided else soft,
        partial(_artificial_shares, vehicle_assembly.parameters, vehicle_assembly.mode == "heave-pitch"),
        "",
        upper_limit=ARTIFICIAL_SHARE_LIMIT,
    )


def _artificial_shares(
    vehicle_parameters: PitchPlaneParameters, heave_is_prescribed: bool, run_result: Result
) -> Watched:
    """Rms of the artificial moment, and of the artificial force where heave is prescribed, divided by the chassis'
    inertia term, up to 15 Hz. Empty where the rows are too few or too far apart.
    """
    from models.drift.score import figures_of_run

    with suppress(InputError):
        figures = figures_of_run(run_result, vehicle_parameters)
        force = {"force": np.array([figures.force_share_band])} if heave_is_prescribed else {}
        return {"moment": np.array([figures.moment_share_band]), **force}
    return {}
