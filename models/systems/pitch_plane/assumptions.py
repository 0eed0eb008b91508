"""Assumptions of the pitch-plane vehicle's equations; an effect says in its own file what it adds."""

from collections.abc import Callable
from contextlib import suppress
from functools import partial

import numpy as np

from models.core.assumptions import Assumption, Watched
from models.core.errors import InputError
from models.core.result import Result
from models.engines.assembly import Assembly
from models.vehicles.pitch_plane import Parameters

SMALL_PITCH = 0.3
"""rad: where sines are taken for angles, the pitch may be so large: 1.5 % of the sine."""
STEEPEST_PITCH = 0.5
"""rad: no road is steeper, and the wheels, which only move vertically, are 12 % nearer to each other."""
PULL_LIMIT = 1.0
"""N: a tyre that pulls by less is at its edge."""
LARGEST_TYRE_TRAVEL = 0.12
"""m: a tyre that is pressed further rests on its rim; a car's sidewall is 0.1 to 0.14 m high."""
SPRING_EDGE = 1e-3
"""m: a spring that is longer than it is free by less is at its edge."""
ARTIFICIAL_SHARE_LIMIT = 0.15
"""Rms of an artificial moment up to 15 Hz divided by that of I pitch'', and of the force divided by that of m3 z3'',
from which on it takes part in the damage: the limit that models/drift/score.py judges stabilisers by."""


def assumptions(assembly: Assembly) -> list[Assumption]:
    """Assumptions of the equations of this scene."""
    lifts = any(tyre.pushes_only for tyre in assembly.vehicle.tyres)
    listed = _of_tyres(assembly, lifts) if assembly.mode in ("free", "road") else []
    listed.append(_spring_assumption(assembly, lifts))
    if assembly.vehicle.geometry == "linear":
        remedy = 'use vehicle.geometry = "exact"'
        says = "the pitch is so small that its sine is itself"
        listed.append(Assumption("small angles", says, remedy, _watched_pitch, "rad", -SMALL_PITCH, SMALL_PITCH))
    listed.append(upright_assumption(_pitch_remedy(assembly), _watched_pitch))
    if assembly.vehicle.pitch_springs or assembly.guided:
        listed.append(_artificial_assumption(assembly))
    return [*listed, *assembly.assumptions]


def principal_channels(assembly: Assembly) -> tuple[str, ...]:
    """Channels whose error is estimated, without prescribed motions and forces, which have no error."""
    free = tuple(name for name, index in (("z3", 2), ("pitch", 3)) if index not in assembly.guided)
    wheels = ("f1", "f2") if assembly.mode in ("free", "road") else ()
    enforced = {"pitch": ("enforced_moment",), "heave-pitch": ("enforced_force", "enforced_moment")}
    return (*free, *wheels, "f3", "f4", *enforced.get(assembly.mode, ()))


def watch_function(**channels: str) -> partial[Watched]:
    """Watch function of an assumption; ``channels`` gives the run's channel for each name of a part."""
    return partial(_watched_channels, channels)


def _watched_channels(channels: dict[str, str], run: Result) -> Watched:
    return {name.replace("_", " "): run[channel] for name, channel in channels.items()}


_watched_pitch = watch_function(chassis="pitch")


def _of_tyres(assembly: Assembly, lifts: bool) -> list[Assumption]:
    pressed = Assumption(
        "tyres not flat",
        "no tyre is pressed to its rim",
        "use tyres that are stiffer (vehicle.override), or drive more slowly",
        partial(_deflections, assembly.parameters),
        "m",
        upper_limit=LARGEST_TYRE_TRAVEL,
    )
    if lifts:
        return [pressed]
    says, remedy = "linear tyres stay on the road", "name the effect lift_off, whose tyres only push"
    forces = watch_function(front_wheel="f1", rear_wheel="f2")
    return [Assumption("tyres press", says, remedy, forces, "N", lower_limit=-PULL_LIMIT), pressed]


def _deflections(parameters: Parameters, run: Result) -> Watched:
    """Deflection (n,) in m of each tyre if its spring alone carried the wheel's force."""
    return {"front tyre": run["f1"] / parameters.k1, "rear tyre": run["f2"] / parameters.k2}


def _spring_assumption(assembly: Assembly, lifts: bool) -> Assumption:
    """Assumption that no suspension's spring pulls: a droop stop, which would prevent it, is not in the equations."""
    remedy = "no effect adds a droop stop: start lower, or excite it less"
    if assembly.mode not in ("free", "road"):
        remedy = f"take wheel forces of tyres that only push (lift_off on a road); {remedy}"
    elif not lifts:
        remedy = f"name the effect lift_off, whose tyres do not pull the wheels down; else {remedy}"
    return Assumption(
        "springs compressed",
        "no suspension droops beyond its spring's free length",
        remedy,
        partial(_compressions, assembly.parameters, assembly.vehicle.geometry == "exact"),
        "m",
        lower_limit=-SPRING_EDGE,
    )


def _compressions(parameters: Parameters, exact: bool, run: Result) -> Watched:
    """Compression (n,) in m of each suspension's spring, from the motion of chassis and wheels."""
    sine_of_pitch = np.sin(run["pitch"]) if exact else run["pitch"]
    return {
        "front suspension": run["z3"] - parameters.b * sine_of_pitch - run["z1"],
        "rear suspension": run["z3"] + parameters.a * sine_of_pitch - run["z2"],
    }


def upright_assumption(remedy: str, pitch: Callable[[Result], Watched]) -> Assumption:
    """Assumption that the pitch stays as small as that of a vehicle on a road."""
    says = "the chassis pitches less than any road does, as wheels only move vertically"
    return Assumption("upright", says, remedy, pitch, "rad", -STEEPEST_PITCH, STEEPEST_PITCH)


def _pitch_remedy(assembly: Assembly) -> str:
    """Advice on how to keep the pitch small."""
    if assembly.guided:
        return "no effect lifts it: check the file of the prescribed pitch, and its unit"
    if assembly.mode in ("free", "road"):
        return "no effect lifts it: drive more slowly, or start nearer to level"
    return "hold it by prescribed_pitch, kalman_filter or pitch_spring, or end the run before"


def _artificial_assumption(assembly: Assembly) -> Assumption:
    """Assumption that the forces which hold pitch or heave are small compared with the vehicle's own forces."""
    remedy = "the measured motion, or the wheel forces, do not fit the vehicle: smooth it (bandwidth), correct its mass"
    soft = "soften what holds the pitch, or name kalman_filter with a measured pitch in its place"
    return Assumption(
        "little artificial",
        "the forces that hold pitch or heave are small compared with the chassis' own inertia",
        remedy if assembly.guided else soft,
        partial(_artificial_shares, assembly.parameters, assembly.mode == "heave-pitch"),
        "",
        upper_limit=ARTIFICIAL_SHARE_LIMIT,
    )


def _artificial_shares(parameters: Parameters, heave: bool, run: Result) -> Watched:
    """Ratio of the artificial moment, and of the force where the heave is held, to the chassis' inertia term, up to 15
    Hz. Empty where the rows are too few or too far apart.
    """
    from models.drift.score import figures_of_run

    with suppress(InputError):
        figures = figures_of_run(run, parameters)
        force = {"force": np.array([figures.force_share_band])} if heave else {}
        return {"moment": np.array([figures.moment_share_band]), **force}
    return {}
