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

SMALLEST_COST, EIGENVALUE_PROBLEMS = 200.0, 2.4
"""Cost of a choice in eigenvalue problems: of any choice, and what is added per effect, per state and for
SCREENED_SPEEDS speeds. Fitted to scenes of 2 to 26 effects and 6 to 42 states, nearly all within a factor of two.
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


def estimate(ride_scene: RideScene) -> Estimate:
    """Estimate of a choice of effects for a linear ride scene at constant speeds."""
    assert ride_scene.speeds is not None
    with scene_errors(ride_scene):
        scene = ReducedScene.complete(ride_scene)
        effects, speeds, states = (
            len(effects_of(scene)),
            len(ride_scene.speeds.all()),
            _count_of_states(scene, scene.excitation()),
        )
    screened = min(speeds, SCREENED_SPEEDS)
    share = (1 + screened + FURTHER_SPEED_SHARE * (speeds - screened)) / (1 + SCREENED_SPEEDS)
    problems = SMALLEST_COST + EIGENVALUE_PROBLEMS * effects * states * share
    return Estimate(effects, speeds, states, problems * _eigenvalue_problem())


def _count_of_states(scene: ReducedScene, excitation: RoadExcitation) -> int:
    """Number of states of the vehicle and of the road's filters."""
    return 2 * len(scene.vehicle.coordinates()) + len(excitation.heights) * len(excitation.F)


def _eigenvalue_problem() -> float:
    """Processor time (s) of an eigenvalue problem of ``TIMED_PROBLEM_SIZE`` states on this machine, measured now."""
    A, seconds = np.random.default_rng(TIMED_PROBLEM_SIZE).standard_normal((TIMED_PROBLEM_SIZE, TIMED_PROBLEM_SIZE)), []
    for _ in range(TIMED_REPETITIONS):
        start_time = time.process_time()
        np.linalg.eig(A)
        seconds.append(time.process_time() - start_time)
    return float(np.median(seconds))
