"""Computing time of twinrig's car without effects against a hand-written car, both in MuJoCo, rolling freely on a flat
road."""

import time
from collections.abc import Callable

import numpy as np

from models.engines.assembly import Settings
from models.engines.protocol import check_trajectory
from models.machine.timing import interleave, paired_ratio
from models.multibody.numbers import Handling
from models.systems.handling.run import build_in_engine
from validation.absence import hand_built_handling, handling
from validation.absence.of_systems import bare_scene

STEP, SPEED = 1e-3, 15.0
"""Step of the runs (s); speed (m/s)."""
Job = Callable[[], tuple[np.ndarray, ...]]


def start_state() -> tuple[Handling, np.ndarray, np.ndarray]:
    """Returns the car without effects, and initial coordinates and rates (23,) that excite every motion: it drifts,
    turns, bounces and rolls."""
    car = bare_scene("handling").handling(handling.ROLLING)
    q, v = car.straight(SPEED)
    q[3:6], v[1], v[2] = (0.01, 0.01, 0.002), 0.1, 0.02
    return car, q, v


def car_runs(step_count: int) -> tuple[Job, Job]:
    """Two functions that simulate the car without effects, by twinrig's model and by the hand-written one. Both check
    the path in the same way, and return coordinates and rates (step_count + 1, 23)."""
    car, q, v = start_state()
    model, by_hand, state_times = (
        build_in_engine("mujoco", car, Settings("RK4", STEP, step_count * STEP)),
        hand_built_handling.run(car, q, v, STEP, step_count),
        STEP * np.arange(step_count + 1),
    )

    def run_twinrig() -> tuple[np.ndarray, ...]:
        path = model.run(q, v)
        return path.positions, path.rates

    def run_hand_built() -> tuple[np.ndarray, ...]:
        states = by_hand()
        check_trajectory("mujoco", state_times, states, step_count * STEP)
        return tuple(np.split(states, 2, axis=1))

    return run_twinrig, run_hand_built


def ratio_of_cars(step_count: int, round_count: int) -> tuple[float, tuple[float, float, float]]:
    """Largest difference between the states (m, rad, m/s, rad/s) of twinrig's car and the hand-written one, and the
    ratio of their computing times with its confidence interval."""
    jobs = car_runs(step_count)
    ours, theirs = (np.hstack(job()) for job in jobs)
    return float(np.abs(ours - theirs).max()), paired_ratio(*interleave(jobs, round_count, clock=time.process_time))
