"""A bare stop of a braked vehicle beside one that was written for that alone: a truck in a turn on snow."""

import time
from collections.abc import Callable

import numpy as np

from models.machine.timing import interleave, paired_ratio
from models.systems.braking.march import Path
from models.systems.braking.procedures import controller_of, ready
from validation.absence import hand_built_braking
from validation.absence.braking import STOP
from validation.absence.of_systems import bare

STEER, SUPPLY = 0.02, 0.5
"""Angle of the front wheels (rad); pressure of the brakes (bar): all wheels roll down to walking pace, so that their
whole motion takes part."""
Job = Callable[[], Path]


def stops(speed: float) -> tuple[Job, Job]:
    """Stops of a bare vehicle from a speed (m/s), built beforehand, and of the written one."""
    scene = bare(
        "braking", brakes={"supply": SUPPLY}, procedures={STOP: {"kind": "j_turn", "speed": speed, "steer": STEER}}
    )
    vehicle, start = ready(scene, STOP)

    def ours() -> Path:
        return vehicle.run(controller_of(scene, vehicle.plane.wheels, STOP), start, scene.run.duration)

    return ours, hand_built_braking.run(vehicle, speed, STEER, len(ours().times))


def gap(ours: Path, theirs: Path) -> float:
    """Largest difference of states (m, rad, m/s, rad/s), of the wheels' turning (rad/s), of the tyres' forces by the
    largest one, and of pressures and torques by theirs."""
    shares = [
        np.abs(one - other).max() / np.abs(other).max()
        for one, other in (
            (ours.reports[..., :2], theirs.reports[..., :2]),
            (ours.pressures, theirs.pressures),
            (ours.torques, theirs.torques),
        )
    ]
    return float(max(np.abs(ours.states - theirs.states).max(), np.abs(ours.turning - theirs.turning).max(), *shares))


def ratio_of_stops(speed: float, rounds: int) -> tuple[float, tuple[float, float, float]]:
    """Largest difference of a stop from a speed (m/s), see ``gap``, and the ratio of seconds with its interval."""
    jobs = stops(speed)
    return gap(*(job() for job in jobs)), paired_ratio(*interleave(jobs, rounds, clock=time.process_time))
