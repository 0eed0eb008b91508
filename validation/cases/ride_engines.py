"""Vehicles in space in Exudyn and MuJoCo: linearised matrices, accelerations at random states, simulations, and rest
under gravity."""

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from models.core.noise import normal_samples
from models.engines.assembly import Settings
from models.engines.spatial_protocol import INTEGRATORS, SpatialModel, build
from models.engines.spatial_reference import SpatialReference
from models.vehicles.linear_vehicle import LinearVehicle, OutputRows, eigenvalue_shifts, eigenvalues
from models.vehicles.spatial import Curve, SpatialVehicle
from models.vehicles.spatial_linear import linearise
from models.vehicles.vehicle_file import load_vehicle
from validation.common.rows import Observed, Row, System, Table, behaviour_row
from validation.ride.rides import R19_FREQUENCIES, largest_relative_error
from validation.spatial import spatial_twin

TITLE = "Vehicles in space: both engines, the analytic matrices and equations written by hand"
SYSTEM: System = "ride"
ENGINE_NAMES = ("exudyn", "mujoco")
TRAVEL_SPEED, GRAVITY = 20.0, 9.81
SEED = 20261121
STATE_COUNT, TIME_STEP = 100, 1e-3
VEHICLE_NAMES = (
    ("quarter_car", "r19_ride"),
    ("quarter_car", "seven_freedoms", "r19_ride", "r19_free", "three_axle_truck", "spatial twin"),
)
"""Vehicles of a quick run, and of a full run."""
MATRIX_TOLERANCES = {"exudyn": 1e-12, "mujoco": 1e-9}
DIGRESSIVE_DAMPER = Curve((-1.0, -0.1, 0.0, 0.1, 1.0), (-1500.0, -400.0, 0.0, 700.0, 2500.0))
BUMP_STOPS = Curve((-0.2, -0.05, 0.05, 0.2), (-8000.0, 0.0, 0.0, 8000.0))
DRY_FRICTION = 40.0
DIFFERENCES_REASON = "central differences of order six leave 1e-13 of smooth laws, 1e-11 of curves with corners"
SAME_LAWS_REASON = "the same laws, added up in another order: 1e-16 of the largest force per operation"


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of the linearised matrices; a full run also has accelerations, simulations, rest and computing times."""
    rows: list[Row] = []
    for name in VEHICLE_NAMES[not quick]:
        rows += _matrix_rows(shipped_vehicle_or_twin(name), name, "unloaded", MATRIX_TOLERANCES)
    rows += _frequency_rows()
    if quick:
        return rows, {"price": []}
    for name in VEHICLE_NAMES[1]:
        rows += _matrix_rows(
            shipped_vehicle_or_twin(name, GRAVITY), name, "loaded", MATRIX_TOLERANCES
        ) + _acceleration_rows(name)
    bent = with_nonlinear_springs(shipped_vehicle_or_twin("r19_ride", GRAVITY))
    rows += _matrix_rows(bent, "r19_ride", "loaded and curved", dict.fromkeys(ENGINE_NAMES, 1e-9))
    path, price = _simulation_rows()
    return rows + path + _rest_position_rows() + _eigenvalue_shift_rows() + _curve_count_row(), {"price": price}


def shipped_vehicle_or_twin(vehicle_name: str, gravity: float = 0.0) -> SpatialVehicle:
    """A shipped vehicle, or the asymmetric twin, with a given gravity (m/s^2)."""
    return (
        spatial_twin.asymmetric_vehicle(gravity)
        if vehicle_name == "spatial twin"
        else replace(load_vehicle(vehicle_name), gravity=gravity)
    )


def with_nonlinear_springs(vehicle: SpatialVehicle) -> SpatialVehicle:
    """The vehicle with nonlinear elements in its first four springs: digressive and asymmetric dampers, bump stops and
    dry friction."""
    bent = [
        replace(spring, damping=0.0, rate_force=DIGRESSIVE_DAMPER, travel_force=BUMP_STOPS, friction=DRY_FRICTION)
        for spring in vehicle.springs[:4]
    ]
    return replace(vehicle, springs=(*bent, *vehicle.springs[4:]))


def matrix_difference(computed_vehicle: LinearVehicle, expected_vehicle: LinearVehicle) -> float:
    """Largest difference of M, D, K, the road's columns and the outputs of two vehicles; each matrix is compared
    relative to its largest entry."""
    matrices = ("mass", "damping", "stiffness", "road_stiffness", "road_damping")
    sides: list[tuple[Any, Any, tuple[str, ...]]] = [(computed_vehicle, expected_vehicle, matrices)]
    sides += [
        (a, b, OutputRows._fields) for a, b in zip(computed_vehicle.outputs, expected_vehicle.outputs, strict=True)
    ]
    return max(relative_difference(getattr(a, name), getattr(b, name)) for a, b, names in sides for name in names)


def relative_difference(computed_values: np.ndarray, expected_values: np.ndarray) -> float:
    """Largest difference, divided by the largest expected magnitude unless this is 0."""
    size = float(np.abs(expected_values).max(initial=0.0))
    return float(np.abs(computed_values - expected_values).max(initial=0.0)) / (size or 1.0)


def random_state(vehicle: SpatialVehicle, random_stream: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random state with standard deviations of 0.05 m or rad for coordinates and 0.5 per s for rates, and a random road
    with 0.05 m and m/s."""
    n, w = len(vehicle.coordinates()), len(vehicle.tyres)
    drawn = normal_samples(SEED, random_stream, 1, 2 * n + 2 * w)[0]
    return 0.05 * drawn[:n], 0.5 * drawn[n : 2 * n], 0.05 * drawn[2 * n :]


def _matrix_rows(
    vehicle: SpatialVehicle, vehicle_name: str, load_case: str, tolerance_of_engine: dict[str, float]
) -> list[Row]:
    """Rows: linearised matrices of a vehicle in each engine, compared with the analytic ones."""
    expected = linearise(vehicle, TRAVEL_SPEED)
    return [
        Observed(
            f"ride_engines.matrices.{vehicle_name}.{load_case}.{engine}",
            SYSTEM,
            f"difference of M, D, K, road columns and outputs of {vehicle_name} in {engine} from the analytic ones, "
            f"{load_case}",
            matrix_difference(build(engine, vehicle, speed=TRAVEL_SPEED).linearise(), expected),
            "relative",
        ).at_most(tolerance_of_engine[engine], DIFFERENCES_REASON, "native")
        for engine in ENGINE_NAMES
    ]


def _frequency_rows() -> list[Row]:
    """Rows: eigenfrequencies of the R19-ride vehicle in each engine, compared with the published ones."""
    return [
        Observed(
            f"ride_engines.frequencies.{engine}",
            SYSTEM,
            f"difference of the 19 eigenfrequencies of R19-ride in {engine} from the published ones",
            largest_relative_error(
                np.abs(eigenvalues(build(engine, shipped_vehicle_or_twin("r19_ride")).linearise()))[::2] / (2 * np.pi),
                R19_FREQUENCIES,
            ),
            "relative",
        ).at_most(1e-5, "six decimals of the expected ones are known", "published")
        for engine in ENGINE_NAMES
    ]


def _acceleration_rows(vehicle_name: str) -> list[Row]:
    """Rows: accelerations at random states with nonlinear springs, gravity and a road, compared between the engines and
    with the equations."""
    vehicle = (
        with_nonlinear_springs(shipped_vehicle_or_twin(vehicle_name, GRAVITY))
        if vehicle_name != "quarter_car"
        else shipped_vehicle_or_twin(vehicle_name, GRAVITY)
    )
    built = (build(engine, vehicle, speed=TRAVEL_SPEED) for engine in ENGINE_NAMES)
    models: list[SpatialModel | SpatialReference] = [*built, SpatialReference(vehicle, TRAVEL_SPEED)]
    worst = np.zeros(3)
    for path in range(STATE_COUNT):
        exudyn, mujoco, reference = (model.acceleration(0.0, *random_state(vehicle, path)) for model in models)
        pairs = ((exudyn, mujoco), (exudyn, reference), (mujoco, reference))
        worst = np.maximum(worst, [relative_difference(*pair) for pair in pairs])
    names = ("exudyn against mujoco", "exudyn against equations", "mujoco against equations")
    return [
        Observed(
            f"ride_engines.states.{vehicle_name}.{what}",
            SYSTEM,
            f"difference of the accelerations of {vehicle_name} at {STATE_COUNT} random states, {what}",
            float(value),
            "relative",
        ).at_most(1e-12, SAME_LAWS_REASON, "native")
        for what, value in zip(names, worst, strict=True)
    ]


def _integrator_settings(engine_name: str, duration: float = 1.0) -> Settings:
    """Settings of an engine's usual integrator."""
    return Settings(INTEGRATORS[engine_name], TIME_STEP, duration)


def _simulation_rows() -> tuple[list[Row], list[list[str]]]:
    """Rows and computing times: states of Exudyn and MuJoCo from a random start over 1 s on a random road, with
    nonlinear and with linear springs."""
    rows, price = [], []
    for what in ("linear", "curved"):
        vehicle = shipped_vehicle_or_twin("r19_ride", GRAVITY)
        vehicle = with_nonlinear_springs(vehicle) if what == "curved" else vehicle
        road = 1e-4 * np.cumsum(normal_samples(SEED, 0, 2 * round(1.0 / TIME_STEP) + 1, 2 * len(vehicle.tyres)), axis=0)
        runs = {}
        for engine in ENGINE_NAMES:
            model = build(engine, vehicle, _integrator_settings(engine), None, road)
            start = time.process_time()
            runs[engine] = model.run(*random_state(vehicle, STATE_COUNT)[:2])
            price.append([engine, what, f"{1e3 * (time.process_time() - start):.0f}", str(model.plan()["callbacks"])])
        gap = max(
            np.abs(getattr(runs["exudyn"], state_name) - getattr(runs["mujoco"], state_name)).max()
            for state_name in ("positions", "rates")
        )
        rows.append(
            Observed(
                f"ride_engines.path.{what}",
                SYSTEM,
                f"difference of R19-ride's states over 1 s between Exudyn and MuJoCo, {what} springs, RK4 at 1 ms",
                float(gap),
                "m, rad, m/s, rad/s",
            ).at_most(1e-12, SAME_LAWS_REASON, "native")
        )
    return rows, price


def _rest_position_rows() -> list[Row]:
    """Rows: in the design position under gravity nothing accelerates, and nothing has moved after 1 s."""
    rows = []
    vehicle = with_nonlinear_springs(shipped_vehicle_or_twin("r19_ride", GRAVITY))
    zero = np.zeros(len(vehicle.coordinates()))
    for engine in ENGINE_NAMES:
        model = build(engine, vehicle, _integrator_settings(engine))
        rows.append(
            Observed(
                f"ride_engines.rest.{engine}",
                SYSTEM,
                f"acceleration in the design position, {engine}",
                float(np.abs(model.acceleration(0.0, zero, zero)).max()),
                "m/s^2, rad/s^2",
            ).at_most(1e-10, "preloads hold the weights to rounding", "none")
        )
        mean = np.abs(model.run(zero, zero).positions.mean(axis=0)).max()
        rows.append(
            Observed(
                f"ride_engines.mean.{engine}",
                SYSTEM,
                f"largest mean displacement in 1 s from the design position, {engine}",
                float(mean),
                "m, rad",
            ).at_most(1e-10, "nothing moves it", "none")
        )
    return rows


def _eigenvalue_shift_rows() -> list[Row]:
    """Rows: shift of the eigenvalues by gravity and preload, from the matrices of Exudyn and MuJoCo and from the
    analytic matrices."""
    rows = []
    for name in VEHICLE_NAMES[1]:
        analytic = eigenvalue_shifts(
            *(linearise(shipped_vehicle_or_twin(name, gravity), TRAVEL_SPEED) for gravity in (0.0, GRAVITY))
        )
        for engine in ENGINE_NAMES:
            shifted = eigenvalue_shifts(
                *(
                    build(engine, shipped_vehicle_or_twin(name, gravity), speed=TRAVEL_SPEED).linearise()
                    for gravity in (0.0, GRAVITY)
                )
            )
            rows.append(
                Observed(
                    f"ride_engines.shift.{name}.{engine}",
                    SYSTEM,
                    f"largest shift of an eigenvalue of {name} from unloaded to loaded, {engine}",
                    float(np.abs(shifted).max()),
                    "1/s",
                ).beside(float(np.abs(analytic).max()), "expected: the same from the analytic matrices", "native")
            )
    return rows


def _curve_count_row() -> list[Row]:
    """Row: a vehicle with linear springs has no curve functions, and a vehicle with nonlinear springs has one for each
    of these springs."""
    plain, bent = (
        build("exudyn", vehicle).plan()
        for vehicle in (
            shipped_vehicle_or_twin("r19_ride"),
            with_nonlinear_springs(shipped_vehicle_or_twin("r19_ride")),
        )
    )
    counts = f"{plain['curves']} curves, {bent['callbacks'] - plain['callbacks']} functions more with curves"
    return [
        behaviour_row(
            "ride_engines.curves",
            SYSTEM,
            "number of times that R19-ride runs the code of spring curves",
            counts,
            "0 curves, 4 functions more with curves",
            "four springs are bent",
        )
    ]


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Table of computing times for one simulated second."""
    if not case_data["price"]:
        return []
    note = (
        "CPU milliseconds, once, per simulated second of R19-ride, RK4 at 1 ms on a random road, and functions "
        "called back."
    )
    heads = ("engine", "springs", "ms per s", "callbacks")
    return [Table("R19-ride in time", note, heads, tuple(tuple(row) for row in case_data["price"]))]
