"""Stated errors of random rides: covariances against extended precision, drives against shorter steps, Monte Carlo
copies against many more, and engines' runs against runs with a hundredth of the step on the same road."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from control import lyap

from models.core.discretisation import Estimate, error_estimates_of
from models.core.errors import RunFailed
from models.core.result import Result
from models.ride.covariance import noise_arrivals
from models.ride.excited import vehicle_with_road
from models.ride.nonlinear_copies import copies_in_time
from models.ride.road_path import RoadPath
from models.ride.varying_speed import LARGEST_RATE_TIMES_STEP, varying_speed
from models.road.excitation import RoadExcitation
from models.systems.ride.nonlinear import (
    RUNGE_KUTTA_ORDER,
    RunSampling,
    engine_result,
    linearised_result,
    ride_over_heights,
)
from models.systems.ride.of_scene import excitation_of, linear_vehicle, vehicle_of
from models.systems.ride.run import ARBITRARY_SPEED, run
from models.systems.ride.scene import RideScene, build
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import linearise, wheels
from validation.stated_errors.sample import Sample

FINER_STEPS = 100
"""Ratio of the run's step to the step of the true solution."""
TRUTH_COPIES = 2000
"""Number of Monte Carlo copies of the true solution."""
ENGINES = ("exudyn", "mujoco")


def samples(sample_count: int, seed: int) -> Iterator[Sample]:
    """Yield ``sample_count`` samples from random rides: runs in time, sweeps, drives and Monte Carlo copies in turn."""
    rng = np.random.default_rng(seed)
    kinds = (_sample_in_time, _sample_of_sweep, _sample_in_time, _sample_of_drive, _sample_in_time, _sample_of_copies)
    for i in range(sample_count):
        yield kinds[i % len(kinds)](rng, i)


def _random_scene(
    generator: np.random.Generator, vehicle_file: str, output_point: str = "unloaded", **scene_tables: Any
) -> RideScene:
    """Ride scene of a vehicle file with a random level, random corners and sometimes a random cutoff of the road."""
    road = {
        "level": float(10 ** generator.uniform(-6.0, -4.3)),
        "corner_mean": float(generator.uniform(0.02, 0.5)),
        "corner_roll": float(generator.uniform(0.6, 3.0)),
    }
    road |= {"cutoff": float(generator.uniform(8.0, 40.0))} if generator.random() < 0.5 else {}
    vehicle = {"file": vehicle_file, "operating_point": output_point}
    return build(
        {"title": "a sample", "system": "ride", "vehicle": vehicle, "road": road, **scene_tables}, "sample.toml"
    )


def _varied_vehicle(generator: np.random.Generator, vehicle: SpatialVehicle) -> SpatialVehicle:
    """The vehicle with its stiffnesses and dampings randomly changed."""
    springs = tuple(
        replace(s, stiffness=s.stiffness * generator.uniform(0.6, 1.6), damping=s.damping * generator.uniform(0.5, 1.8))
        for s in vehicle.springs
    )
    tyres = tuple(replace(t, stiffness=t.stiffness * generator.uniform(0.7, 1.4)) for t in vehicle.tyres)
    return replace(vehicle, springs=springs, tyres=tyres)


def _sample_of(
    ride_result: Result,
    sample_name: str,
    engine: str,
    true_errors: Mapping[str, float],
    call_count: float,
    extra_call_count: float,
) -> Sample:
    estimates = {
        channel: estimate for channel, estimate in error_estimates_of(ride_result).items() if channel in true_errors
    }
    return Sample(sample_name, engine, estimates, true_errors, call_count, extra_call_count)


def _sample_of_sweep(generator: np.random.Generator, sample_number: int) -> Sample:
    """Sample from the standard deviations of a linear vehicle at nine random speeds; the true ones are computed in
    extended precision."""
    file = str(generator.choice(["quarter_car", "half_car", "seven_freedoms"]))
    engine = str(generator.choice(["reference", *ENGINES]))
    scene = _random_scene(generator, file, speeds={"values": sorted(generator.uniform(2.0, 60.0, 9).tolist())})
    vehicle = _varied_vehicle(generator, vehicle_of(scene))
    result = run(scene, engine, vehicle=vehicle, error=True)
    road, deviation = excitation_of(scene, wheels(vehicle)), result["deviation"][0]
    true = np.array([exact_deviations(linearise(vehicle), road, float(speed)) for speed in result["speed"]])
    gaps = np.sqrt(np.mean((deviation - true) ** 2, axis=0))
    names = result["output"].tolist()
    return _sample_of(
        result, f"{sample_number}: {file}, sweep", engine, dict(zip(names, gaps.tolist(), strict=True)), 9.0, 3.0
    )


def exact_deviations(linear_vehicle: LinearVehicle, road_excitation: RoadExcitation, speed: float) -> np.ndarray:
    """Standard deviations (p,) of the outputs of a linear vehicle with undamped tyres, computed in extended
    precision."""
    system, n, m = (
        vehicle_with_road(linear_vehicle, road_excitation, speed),
        len(linear_vehicle.mass),
        len(road_excitation.F),
    )
    A, C = system.A.astype(np.longdouble), system.C.astype(np.longdouble)
    forces = np.hstack(
        [linear_vehicle.road_stiffness.astype(np.longdouble) @ heights for heights in road_excitation.heights]
    )
    wanted = np.hstack([-linear_vehicle.stiffness, -linear_vehicle.damping, forces])
    for _ in range(3):
        left = wanted - linear_vehicle.mass.astype(np.longdouble) @ A[n : 2 * n]
        A[n : 2 * n] += np.linalg.solve(linear_vehicle.mass, left.astype(float))
    A[2 * n :, 2 * n :] = np.kron(
        np.eye(len(road_excitation.heights)), speed * road_excitation.F.astype(np.longdouble)
    ).reshape(len(road_excitation.heights) * m, -1)
    C += linear_vehicle.read.acceleration_factors @ (A - system.A)[n : 2 * n]
    met = noise_arrivals(system)
    earlier_response, Q = np.zeros_like(met.B[0], np.longdouble), np.zeros_like(A)
    for j, b in enumerate(met.B):
        if j and not met.independent:
            earlier_response = _exponential(A * (met.delays[j] - met.delays[j - 1])) @ (earlier_response + met.B[j - 1])
        Q += b @ b.T + earlier_response @ b.T + b @ earlier_response.T
    P: np.ndarray = np.zeros_like(A)
    for _ in range(8):
        half = A @ P
        P += lyap(system.A, (half + half.T + Q).astype(float), method="scipy")
        P = (P + P.T) / 2
    return np.sqrt(np.einsum("pi,ij,pj->p", C, P, C)).astype(float)


def _exponential(matrix: np.ndarray) -> np.ndarray:
    """Matrix exponential e^A in extended precision: series of a small fraction of A, then squaring."""
    halvings = max(0, int(np.ceil(np.log2(float(abs(matrix).sum(axis=1).max()) + 1e-30))) + 1)
    small, term = matrix / 2**halvings, np.eye(len(matrix), dtype=np.longdouble)
    total = term.copy()
    for k in range(1, 30):
        term = term @ small / k
        total += term
    for _ in range(halvings):
        total = total @ total
    return total


def _sample_of_drive(generator: np.random.Generator, sample_number: int) -> Sample:
    """Sample from a drive at varying speed with two sections; the true solution has steps an eighth as long, so that
    its error is about 1e-9 of the run's."""
    first = float(generator.choice([0.0, generator.uniform(2.0, 15.0)]))
    drive = {
        "time": [0.0, float(generator.uniform(1.0, 2.0)), 3.0],
        "speed": [first, *generator.uniform(3.0, 30.0, 2).tolist()],
    }
    scene = _random_scene(generator, "quarter_car", drive=drive, study="ride_drive")
    vehicle = _varied_vehicle(generator, vehicle_of(scene))
    engine = str(generator.choice(["reference", *ENGINES]))
    result = run(scene, engine, vehicle=vehicle, error=True)
    road, profile = excitation_of(scene, wheels(vehicle)), scene.drive.profile()  # type: ignore[union-attr]
    fine = varying_speed(
        linear_vehicle(vehicle)(ARBITRARY_SPEED),
        road,
        profile,
        instants=result.times,
        largest_rate_times_step=LARGEST_RATE_TIMES_STEP / 8.0,
    )
    rows = np.abs(fine.time[:, None] - result.times).argmin(axis=0)
    gaps = np.sqrt(np.mean((fine.deviation[rows] - result["deviation"]) ** 2, axis=0))
    true = dict(zip(result["output"].tolist(), gaps.tolist(), strict=True))
    steps = float(len(result.times))
    return _sample_of(
        result, f"{sample_number}: quarter car, drive from {first:.3g} m/s", engine, true, steps, 0.6 * steps
    )


def _sample_of_copies(generator: np.random.Generator, sample_number: int) -> Sample:
    """Sample from Monte Carlo copies and statistical linearisation of a nonlinear quarter car; the true solution has
    many more copies and shorter steps. Both contain random scatter."""
    speed = float(generator.uniform(5.0, 35.0))
    scene = _random_scene(generator, "quarter_car_nonlinear", speeds={"values": [speed]}, study="ride_nonlinear")
    vehicle, sampling = vehicle_of(scene), RunSampling(beside=[speed], copies=100, lasting=6.0, seed=sample_number)
    result = linearised_result(scene, vehicle, sampling, lambda text, share: None, estimate_error=True)
    run, road = result.detail.copies[speed], excitation_of(scene, wheels(vehicle))
    fine = copies_in_time(
        vehicle, road, speed, 10.0, copy_count=TRUTH_COPIES, seed=1000 + sample_number, longest_step=run.step / 4.0
    )
    chance = json.loads(result.data.attrs["error"])["chance"]["channels"]
    estimates, true = dict[str, Estimate](), dict[str, float]()
    for i, (name, gains) in enumerate(zip(run.names, result["deviation"][0], strict=True)):
        for method_name, value in (("copies", run.deviation[i]), ("gains", gains)):
            channel = f"{name}, {method_name}"
            estimate = error_estimates_of(result)[channel]
            chance_part = chance.get(channel, {"error": 0.0, "share": 0.0})
            error, share = (
                np.hypot(estimate.error, chance_part["error"]),
                np.hypot(estimate.share, chance_part["share"]),
            )
            estimates[channel] = replace(estimate, error=float(error), share=float(share))
            true[channel] = abs(float(value - fine.deviation[i]))
    steps = sampling.copies * 6.0 / run.step
    return Sample(
        f"{sample_number}: bent quarter car at {speed:.3g} m/s", "reference", estimates, true, steps, 0.375 * steps
    )


def _sample_in_time(generator: np.random.Generator, sample_number: int) -> Sample:
    """Sample from a run in time with nonlinear springs or tyres that lift off; the true solution has much shorter steps
    on the same road."""
    bent, speed = generator.random() < 0.5, float(generator.uniform(5.0, 40.0))
    file = "quarter_car_nonlinear" if bent else str(generator.choice(["quarter_car", "half_car", "seven_freedoms"]))
    tables: dict[str, Any] = {"speeds": {"values": [speed]}, "study": "ride_nonlinear"}
    tables |= {} if bent else {"effects": {"lift_off": {}}}
    scene = _random_scene(generator, file, "loaded", **tables)
    vehicle, engine = _varied_vehicle(generator, vehicle_of(scene)), str(generator.choice(ENGINES))
    sampling = RunSampling(step=float(10 ** generator.uniform(-3.7, -2.5)), driven=3.0, skipped=0.5, seed=sample_number)
    road = excitation_of(scene, wheels(vehicle))
    path = _road_path_of_run(scene, engine, vehicle, sampling, road, speed)
    steps, finer = int(np.ceil(sampling.driven / path.step)), replace(path, half_step=path.half_step / FINER_STEPS)
    table = finer.wheel_heights_and_rates(steps * FINER_STEPS, sample_number)
    try:
        result = engine_result(scene, engine, vehicle, sampling, True, table[::FINER_STEPS].copy())
    except RunFailed as failure:
        result = failure.partial
    rows = result.detail.rows * FINER_STEPS
    stride, begin = int(rows[1] - rows[0]), float(rows[0] * finer.step)
    fine = ride_over_heights("mujoco", vehicle, finer, table, skipped_time=begin, steps_per_output=stride)
    gaps = np.sqrt(np.mean((fine.outputs[: len(rows)] - result.detail.outputs) ** 2, axis=0))
    true = dict(zip(result["output"].tolist(), gaps.tolist(), strict=True))
    calls = RUNGE_KUTTA_ORDER * steps + len(rows)
    read = (1.0 + 0.9 + 0.18) * steps / 16
    name = f"{sample_number}: {file} at {speed:.3g} m/s in steps of {1e3 * path.step:.2g} ms"
    return _sample_of(result, name, engine, true, calls, 0.54 * RUNGE_KUTTA_ORDER * steps + read)


def _road_path_of_run(
    scene: RideScene,
    engine: str,
    vehicle: SpatialVehicle,
    sampling: RunSampling,
    road_excitation: RoadExcitation,
    speed: float,
) -> RoadPath:
    """Road path with the step that ``in_engine`` uses."""
    from models.ride.nonlinear_copies import longest_resolving_step
    from models.ride.road_path import road_path
    from models.systems.ride.nonlinear import LONGEST_TIME_STEP

    return road_path(
        road_excitation, speed, min(sampling.step or LONGEST_TIME_STEP, longest_resolving_step(vehicle, speed))
    )
