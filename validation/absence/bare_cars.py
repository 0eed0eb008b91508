"""A bare car in time beside one that was written for that alone, in MuJoCo: it rolls freely on a flat road."""

import time
from collections.abc import Callable

import numpy as np

from models.engines.assembly import Settings
from models.engines.protocol import guard
from models.machine.timing import interleave, paired_ratio
from models.multibody.numbers import Handling
from models.systems.handling.run import build
from validation.absence import hand_built_handling, handling
from validation.absence.of_systems import bare_scene

STEP, SPEED = 1e-3, 15.0
"""Step of the runs (s); speed (m/s)."""
Job = Callable[[], tuple[np.ndarray, ...]]


def start() -> tuple[Handling, np.ndarray, np.ndarray]:
    """The car of the bare scene with initial coordinates and rates at which every motion is excited: it drifts, turns,
    bounces and rolls."""
    car = bare_scene("handling").handling(handling.ROLLING)
    q, v = car.straight(SPEED)
    q[3:6], v[1], v[2] = (0.01, 0.01, 0.002), 0.1, 0.02
    return car, q, v


def cars(steps: int) -> tuple[Job, Job]:
    """Two runs of the bare car, by twinrig's model and by the hand-written one. Both check the path with the same
    guard, and give coordinates and rates (steps + 1, 23)."""
    car, q, v = start()
    model, by_hand, state_times = (
        build("mujoco", car, Settings("RK4", STEP, steps * STEP)),
        hand_built_handling.run(car, q, v, STEP, steps),
        STEP * np.arange(steps + 1),
    )

    def ours() -> tuple[np.ndarray, ...]:
        path = model.run(q, v)
        return path.positions, path.rates

    def theirs() -> tuple[np.ndarray, ...]:
        states = by_hand()
        guard("mujoco", state_times, states, steps * STEP)
        return tuple(np.split(states, 2, axis=1))

    return ours, theirs


def ratio_of_cars(steps: int, round_count: int) -> tuple[float, tuple[float, float, float]]:
    """Largest difference between the states (m, rad, m/s, rad/s) of twinrig's car and the hand-written one, and the
    ratio of their computing times with its confidence interval."""
    jobs = cars(steps)
    ours, theirs = (np.hstack(job()) for job in jobs)
    return float(np.abs(ours - theirs).max()), paired_ratio(*interleave(jobs, round_count, clock=time.process_time))
