"""Computing time of a linear choice of effects divided by that of the full covariance: a car with 19 degrees of
freedom, five speeds."""

import time

from models.advice.ride_choice.choose import Chooser
from models.advice.ride_choice.estimate import estimate
from models.machine.timing import interleave, paired_ratio
from models.systems import run
from models.systems.ride.of_scene import scene_errors
from models.systems.ride.scene import RideScene, build

CAR_SCENE_TABLE = {
    "title": "a car of 19 degrees of freedom",
    "system": "ride",
    "study": "ride_choice",
    "vehicle": {"file": "r19_ride"},
    "effects": "auto",
    "quantities": ["left occupant", "tyre force front left"],
    "tolerance": 0.03,
    "speeds": {"values": [10.0, 15.0, 20.0, 25.0, 30.0]},
}
TIMING_ROUNDS = 5
"""Number of timed pairs of a choice and a full covariance."""


def car_scene() -> RideScene:
    """Scene of a car with 19 degrees of freedom, for which effects are chosen."""
    return build(CAR_SCENE_TABLE, "a car of 19 degrees of freedom")


def price_of_choice() -> tuple[tuple[float, float, float], float]:
    """Processor time of a choice divided by that of the full covariance with its error, with a 95 % interval; and
    predicted divided by actual time of a choice."""
    scene = car_scene()

    def choose() -> None:
        with scene_errors(scene):
            Chooser.from_scene(scene).choose()

    jobs = (choose, lambda: run(scene, "reference", error=scene.error))
    seconds = interleave(jobs, TIMING_ROUNDS, 1e-3, clock=time.process_time)
    return paired_ratio(seconds[0], seconds[1]), estimate(scene).seconds / float(seconds[0].mean())
