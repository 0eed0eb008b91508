"""Computing time of twinrig's rides without effects against hand-written code: a car with seven degrees of freedom on
a single track."""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from models.engines.assembly import Settings
from models.engines.protocol import check_trajectory
from models.engines.spatial_protocol import INTEGRATORS, build
from models.machine.timing import interleave, paired_ratio
from models.ride.copies_kernel import POWERS_SUMMED, march_copies
from models.ride.nonlinear_copies import force_laws
from models.ride.road_path import RoadPath, road_path
from models.systems.ride.of_scene import excitation_of, vehicle_of
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import linearise, wheels
from validation.absence import ride
from validation.absence.hand_built_ride import Car, exudyn_run, mujoco_run, parameter_array
from validation.absence.hand_built_ride import march as march_written
from validation.absence.of_systems import bare_scene

STEP = 1e-3
"""Step of the runs (s)."""
COPIES = 64
Job = Callable[[], np.ndarray]
HAND_BUILT_RUNS = {"exudyn": exudyn_run, "mujoco": mujoco_run}


def vehicle_and_road() -> tuple[SpatialVehicle, RoadPath]:
    """The vehicle of the ride scene without effects, and its road. Anti-roll bars, which come from the vehicle's file,
    are removed."""
    bare = bare_scene("ride")
    vehicle = replace(vehicle_of(bare), bars=())
    return vehicle, road_path(excitation_of(bare, wheels(vehicle)), ride.SPEED, STEP)


def ride_runs(engine: str, step_count: int) -> tuple[Job, Job]:
    """Two functions that simulate a ride without effects in an engine, by twinrig's model and by the hand-written car.
    Both return states (step_count + 1, 14) and check them in the same way."""
    vehicle, road = vehicle_and_road()
    table, rest_state, duration = (
        road.wheel_heights_and_rates(step_count, 0),
        np.zeros(len(vehicle.coordinates())),
        step_count * road.step,
    )
    model = build(engine, vehicle, Settings(INTEGRATORS[engine], road.step, duration), road.speed, table)
    by_hand = HAND_BUILT_RUNS[engine](Car.of(vehicle), table[:, : len(vehicle.tyres)], road.step, step_count)

    def run_twinrig() -> np.ndarray:
        path = model.run(rest_state, rest_state)
        return np.hstack([path.positions, path.rates])

    def run_hand_built() -> np.ndarray:
        states = by_hand()
        check_trajectory(engine, road.step * np.arange(step_count + 1), states, duration)
        return states

    return run_twinrig, run_hand_built


def copy_runs(step_count: int) -> tuple[Job, Job]:
    """Two functions that simulate COPIES linear cars on different random roads, by twinrig and by hand-written
    equations. Both return the final states (14, COPIES)."""
    vehicle, road = vehicle_and_road()
    plain, roads = linearise(vehicle, road.speed), next(road.blocks(step_count, COPIES, 0))
    laws, car, heights = (
        force_laws(vehicle, plain, (), road.speed),
        parameter_array(Car.of(vehicle)),
        roads[:, :4].copy(),
    )
    sums = np.zeros((POWERS_SUMMED, len(plain.outputs), COPIES))

    def run_twinrig() -> np.ndarray:
        states = np.zeros((2 * len(plain.mass), COPIES))
        march_copies(states, roads, road.step, step_count, 1, laws, sums)
        return states

    def run_hand_built() -> np.ndarray:
        states = np.zeros((2 * len(plain.mass), COPIES))
        march_written(states, heights, road.step, car)
        return states

    return run_twinrig, run_hand_built


def ratio_of_rides(engine: str, step_count: int, round_count: int) -> tuple[float, tuple[float, float, float]]:
    """Largest difference of the states (m, rad, m/s, rad/s) between twinrig's ride and the hand-written one in an
    engine or the reference, and the ratio of computing times with its confidence interval."""
    jobs = copy_runs(step_count) if engine == "reference" else ride_runs(engine, step_count)
    ours, theirs = (job() for job in jobs)
    return float(np.abs(ours - theirs).max()), paired_ratio(*interleave(jobs, round_count, clock=time.process_time))
