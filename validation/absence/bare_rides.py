"""Rides without effects, compared in time with hand-written code for that case: a car with seven degrees of freedom on
a single track."""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from models.engines.assembly import Settings
from models.engines.protocol import guard
from models.engines.spatial_protocol import INTEGRATORS, build
from models.machine.timing import interleave, paired_ratio
from models.ride.copies_kernel import POWERS_SUMMED, march
from models.ride.nonlinear_copies import force_laws
from models.ride.road_path import RoadPath, road_path
from models.systems.ride.of_scene import excitation_of, vehicle_of
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import linearise, wheels
from validation.absence import ride
from validation.absence.hand_built_ride import Car, exudyn_run, mujoco_run, numbers
from validation.absence.hand_built_ride import march as march_written
from validation.absence.of_systems import bare_scene

STEP = 1e-3
"""Step of the runs (s)."""
COPIES = 64
Job = Callable[[], np.ndarray]
BY_HAND = {"exudyn": exudyn_run, "mujoco": mujoco_run}


def scene() -> tuple[SpatialVehicle, RoadPath]:
    """The vehicle of the bare scene without its anti-roll bars, an effect of a vehicle's file, and its road."""
    bare = bare_scene("ride")
    vehicle = replace(vehicle_of(bare), bars=())
    return vehicle, road_path(excitation_of(bare, wheels(vehicle)), ride.SPEED, STEP)


def rides(engine: str, steps: int) -> tuple[Job, Job]:
    """Two runs of the bare ride in one engine, by twinrig's model and by the hand-written car. Both give states (steps
    + 1, 14), and check them with the same guard."""
    vehicle, road = scene()
    table, rest_state, duration = (
        road.wheel_heights_and_rates(steps, 0),
        np.zeros(len(vehicle.coordinates())),
        steps * road.step,
    )
    model = build(engine, vehicle, Settings(INTEGRATORS[engine], road.step, duration), road.speed, table)
    by_hand = BY_HAND[engine](Car.of(vehicle), table[:, : len(vehicle.tyres)], road.step, steps)

    def ours() -> np.ndarray:
        path = model.run(rest_state, rest_state)
        return np.hstack([path.positions, path.rates])

    def theirs() -> np.ndarray:
        states = by_hand()
        guard(engine, road.step * np.arange(steps + 1), states, duration)
        return states

    return ours, theirs


def copies(steps: int) -> tuple[Job, Job]:
    """Two runs of COPIES linear cars on different random roads, by twinrig and by hand-written equations. Both give the
    final states (14, COPIES)."""
    vehicle, road = scene()
    plain, roads = linearise(vehicle, road.speed), next(road.blocks(steps, COPIES, 0))
    laws, car, heights = force_laws(vehicle, plain, (), road.speed), numbers(Car.of(vehicle)), roads[:, :4].copy()
    sums = np.zeros((POWERS_SUMMED, len(plain.outputs), COPIES))

    def ours() -> np.ndarray:
        states = np.zeros((2 * len(plain.mass), COPIES))
        march(states, roads, road.step, steps, 1, laws, sums)
        return states

    def theirs() -> np.ndarray:
        states = np.zeros((2 * len(plain.mass), COPIES))
        march_written(states, heights, road.step, car)
        return states

    return ours, theirs


def ratio_of_rides(engine: str, steps: int, round_count: int) -> tuple[float, tuple[float, float, float]]:
    """Compare twinrig with a hand-built ride in an engine or the reference: largest difference of the states (m, rad,
    m/s, rad/s), and the ratio of computing times with its confidence interval."""
    jobs = copies(steps) if engine == "reference" else rides(engine, steps)
    ours, theirs = (job() for job in jobs)
    return float(np.abs(ours - theirs).max()), paired_ratio(*interleave(jobs, round_count, clock=time.process_time))
