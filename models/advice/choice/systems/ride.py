"""Ride scenes with nonlinear springs, for a choice of effects: quantities are standard deviations of outputs, one case
per speed, estimated from copies of the vehicle in time.
"""

import time
from math import gcd

import numpy as np

from models.advice.choice.answer import Quantity, RunQuantities
from models.advice.ride_choice.in_time import STEP_MULTIPLE, CopiesInTime, in_time
from models.core.errors import InputError
from models.engines.spatial_protocol import curve_count
from models.systems.ride.of_scene import scene_errors
from models.systems.ride.reduced_scene import ReducedScene
from models.systems.ride.scene import RideScene

DEFAULT_ENGINE, PART_REPRESENTS_RUN = "reference", True


def copies_of_scene(scene: RideScene | CopiesInTime) -> CopiesInTime:
    """The ride scene as an ensemble of copies that are integrated in time, an object that can leave out effects,
    shorten the run and lengthen its steps.
    """
    if isinstance(scene, CopiesInTime):
        return scene
    with scene_errors(scene):
        return in_time(ReducedScene.complete(scene))


def computed_quantities(scene: CopiesInTime, engine: str, with_error_estimate: bool = False) -> RunQuantities:
    """Integrate the copies at every speed with their own equations, and collect the mean squares of the outputs;
    InputError for another engine.
    """
    if engine != DEFAULT_ENGINE:
        raise InputError("--engine", "", engine, "marches no copies of a vehicle with bent springs: leave it out")
    squares_of, seconds = dict[str, list[np.ndarray]](), 0.0
    for pace in scene.steps_at_speeds:
        roads, start_time = scene.roads(pace), time.process_time()
        outputs, squares = scene.mean_squares(pace, roads)
        seconds += time.process_time() - start_time
        for output, of_copies in zip(outputs, squares.T, strict=True):
            squares_of.setdefault(output.name, []).append(of_copies)
    units = {output.name: output.unit for output in outputs}
    vehicle = scene.vehicle(scene.steps_at_speeds[0])
    counts = {
        "steps": scene.steps,
        "calls": 4 * scene.steps,
        "states": 2 * len(vehicle.coordinates()),
        "terms": curve_count(vehicle) + sum(tyre.pushes_only for tyre in vehicle.tyres),
    }
    quantities = {name: Quantity(units[name], tuple(cases), True) for name, cases in squares_of.items()}
    return RunQuantities(quantities, counts, seconds)


def step_count(scene: CopiesInTime) -> int:
    """Number of time steps of all copies at all speeds."""
    return scene.steps


def divisible_step_count(scene: CopiesInTime) -> int:
    """Number of steps that a longer step must divide, both in the lead-in and while outputs are averaged."""
    return STEP_MULTIPLE // gcd(STEP_MULTIPLE, scene.step_factor)
