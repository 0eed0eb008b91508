"""Estimate of the processor time of a choice of effects, made beforehand: from counts, and the time of an eigenvalue
problem on this machine.
"""

import time
from dataclasses import dataclass

import numpy as np

from models.advice.ride_choice.candidates import SCREENED_SPEEDS
from models.road.excitation import RoadExcitation
from models.systems.ride.of_scene import scene_errors
from models.systems.ride.omissions import effects_of
from models.systems.ride.reduced_scene import ReducedScene
from models.systems.ride.scene import RideScene

EIGENVALUE_PROBLEMS = 4.0
"""Cost of a choice per effect, per state and for SCREENED_SPEEDS speeds, in eigenvalue problems: the proportion is
fitted to 14 scenes of 7 to 26 effects and 10 to 42 states, all within a factor of two, and the size to the largest
scene.
"""
FURTHER_SPEED_SHARE = 0.05
"""Ratio of the cost of a speed at which effects are only confirmed to that of a speed at which they are screened."""
TIMED_PROBLEM_SIZE, TIMED_REPETITIONS = 40, 9
"""Number of states of the eigenvalue problem that is timed, and number of repetitions."""


@dataclass(frozen=True)
class Estimate:
    """Size of a choice of effects in counts, and an estimate of its processor time (s), within a factor of two."""

    effects: int
    speeds: int
    states: int
    seconds: float


def estimate(ride: RideScene) -> Estimate:
    """Estimate of a choice of effects for a linear ride scene at constant speeds."""
    assert ride.speeds is not None
    with scene_errors(ride):
        scene = ReducedScene.complete(ride)
        effects, speeds, states = (
            len(effects_of(scene)),
            len(ride.speeds.all()),
            _count_of_states(scene, scene.excitation()),
        )
    screened = min(speeds, SCREENED_SPEEDS)
    share = (1 + screened + FURTHER_SPEED_SHARE * (speeds - screened)) / (1 + SCREENED_SPEEDS)
    return Estimate(effects, speeds, states, EIGENVALUE_PROBLEMS * effects * states * share * _eigenvalue_problem())


def _count_of_states(scene: ReducedScene, road: RoadExcitation) -> int:
    """Number of states of the vehicle and of the road's filters."""
    return 2 * len(scene.vehicle.coordinates()) + len(road.heights) * len(road.F)


def _eigenvalue_problem() -> float:
    """Processor time (s) of an eigenvalue problem of ``TIMED_PROBLEM_SIZE`` states on this machine, measured now."""
    A, seconds = np.random.default_rng(TIMED_PROBLEM_SIZE).standard_normal((TIMED_PROBLEM_SIZE, TIMED_PROBLEM_SIZE)), []
    for _ in range(TIMED_REPETITIONS):
        start_time = time.process_time()
        np.linalg.eig(A)
        seconds.append(time.process_time() - start_time)
    return float(np.median(seconds))
