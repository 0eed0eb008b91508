"""A measured race car whose vehicle model is identified on one stretch and predicts another; and a known car,
identified from noisy data."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from models.core.tables import write_table
from models.identification.bands import error_bands, error_model
from models.identification.fit import fit
from models.identification.held_out import IdentifiedVehicle, ParameterSearch, identified_vehicle
from models.identification.of_scene import identification_problem_of
from models.identification.problem import FitClock, IdentificationProblem
from models.identification.uncertainty import Uncertainty, uncertainty
from models.measured.drive import read_drive
from models.systems.single_track.race_file import IDENTIFIED_PARAMETERS, RACE_CAR, write_plain_table
from models.systems.single_track.run import run
from models.systems.single_track.scene import SingleTrackScene, build
from validation.common.rows import Observed, Row, System, not_run
from validation.common.scenes import data_folder

TITLE = "A measured race car, and a known car found again"
SYSTEM: System = "rolling-vehicle"
RACE_CAR_FILE = "race_car/race_car.csv.gz"
RELATIVE_ERROR_AIMS = {"yaw rate": 0.12, "lateral acceleration": 0.12, "side slip": 0.25}
"""Aims for the rms prediction error divided by the rms of the measurement, both low-passed at 5 Hz."""
IDENTIFIED_SHARE = 0.65
"""Share of the measurement on which the vehicle is identified."""
WIDEST_PREDICTION_BAND = 2.5
"""Largest mean half-width of the prediction bands, divided by the rms error, that is asked for."""
SENSOR_NOISE = {"yaw rate": ("rad/s", 0.004), "lateral acceleration": ("m/s^2", 0.2), "side slip": ("rad", 0.0008)}
TRUE_PARAMETERS = {
    "vehicle.yaw_inertia": 1700.0,
    "front.stiffness": 16.0,
    "rear.stiffness": 19.0,
    "front.friction": 0.95,
}
START_PARAMETERS = {
    "vehicle.yaw_inertia": 1450.0,
    "front.stiffness": 14.0,
    "rear.stiffness": 21.0,
    "front.friction": 1.05,
}
DRIVE_TIMES = np.arange(0.0, 12.0, 0.02)
NOISE_SAMPLE_COUNT = 5
CHI_SQUARE_LIMIT = 52.0
"""99.99 % quantile of the chi-square distribution with 4 x 5 degrees of freedom; standard errors that are 1.6 times too
small exceed it."""


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows on a known car with repeated noise; a full run also has the measured race car."""
    rows = _known_car_rows(work_folder)
    if quick:
        return rows, {}
    data = data_folder()
    if data is None or not (data / RACE_CAR_FILE).is_file():
        return [*rows, *_rows_not_run(f"needs {RACE_CAR_FILE} in the folder that TWINRIG_DATA names")], {}
    chosen = _identified_race_car(data / RACE_CAR_FILE, work_folder)
    return [*rows, *_race_car_rows(chosen), _sensor_consistency_row(work_folder / "race.csv")], _data_for_report(chosen)


def _car_scene(work_folder: Path, parameter_values: dict[str, float]) -> SingleTrackScene:
    """Scene of a car with a drive that steers, brakes and accelerates; ``parameter_values`` replaces parameters by
    their scene keys."""
    table: dict[str, Any] = {
        "title": "a known car",
        "system": "single-track",
        "vehicle": {"mass": 1200.0, "front": 1.2, "rear": 1.4},
        "front": {},
        "rear": {"friction": 1.0},
        "drive": {"file": "known.csv"},
    }
    for key, value in parameter_values.items():
        owner, name = key.split(".")
        table[owner][name] = value
    return build(table, "known car", work_folder)


def _write_drive(work_folder: Path) -> None:
    """Write steer angle and speed of the known car's drive to a table."""
    steer = 0.045 * np.sin(1.1 * DRIVE_TIMES) * np.cos(0.35 * DRIVE_TIMES) + 0.015 * np.sin(3.7 * DRIVE_TIMES)
    columns = {
        "time": ("s", DRIVE_TIMES),
        "steer": ("rad", steer),
        "speed": ("m/s", 20.0 + 3.0 * np.sin(0.4 * DRIVE_TIMES)),
    }
    write_table(work_folder / "known.csv", columns)


def _noisy_problem(scene: SingleTrackScene, seed: int) -> IdentificationProblem:
    """Identification problem: the car's parameters are to be found from its noisy channels, starting from other
    values."""
    driven, random = run(scene), np.random.default_rng(seed)
    columns = {
        n: (unit, driven[n] + size * random.standard_normal(len(DRIVE_TIMES)))
        for n, (unit, size) in SENSOR_NOISE.items()
    }
    path = Path(scene.folder) / f"known measured {seed}.csv"
    write_table(path, {"time": ("s", DRIVE_TIMES), **columns})
    return identification_problem_of(
        _car_scene(Path(scene.folder), START_PARAMETERS), path, list(TRUE_PARAMETERS), low_pass_edge=5.0
    )


def _known_car_rows(work_folder: Path) -> list[Row]:
    """Rows: parameters of a known car identified from noisy data, and coverage of the prediction bands."""
    _write_drive(work_folder)
    scene, truth = _car_scene(work_folder, TRUE_PARAMETERS), np.array(list(TRUE_PARAMETERS.values()))
    solved = [uncertainty(fit(_noisy_problem(scene, seed))) for seed in range(NOISE_SAMPLE_COUNT)]
    distance, worst = 0.0, 0.0
    for known in solved:
        off = (known.fit.values - truth) / known.fit.problem.scales
        distance += float(off @ np.linalg.solve(known.covariance, off))
        worst = max(worst, float(np.abs(off * known.fit.problem.scales / known.deviations).max()))
    inside = _share_inside_prediction_bands(solved)
    return [
        Observed(
            "race_car.known.distance",
            SYSTEM,
            f"squared distance of {NOISE_SAMPLE_COUNT} estimates of {len(TRUE_PARAMETERS)} numbers from the truth, "
            "by their covariance",
            distance,
            "",
        ).at_most(
            CHI_SQUARE_LIMIT, "chi-square: larger where standard errors are too small, or estimates off", "closed form"
        ),
        Observed(
            "race_car.known.coverage", SYSTEM, "least share of another noise inside the bands of 95 %", inside, ""
        ).within(0.95, 0.05, "bands that are neither too narrow nor empty", "closed form"),
        Observed(
            "race_car.known.worst",
            SYSTEM,
            "largest distance of an estimate from the truth, in standard errors",
            worst,
            "",
        ).beside(2.0, f"the largest of {NOISE_SAMPLE_COUNT * len(TRUE_PARAMETERS)} numbers is about 2", "closed form"),
    ]


def _share_inside_prediction_bands(identified_cars: list[Uncertainty]) -> float:
    """Least share of measured samples inside the prediction bands, over all channels, as a mean over the fits. Each
    fit's bands are compared with the measurement of the next noise sample."""
    shares = []
    for known, other_fit in zip(identified_cars, [*identified_cars[1:], identified_cars[0]], strict=True):
        problem = known.fit.problem
        predicted = problem.predicted(known.fit.values)
        pairs = zip(predicted, problem.channels, strict=True)
        errors = [error_model(row - channel.values, row) for row, channel in pairs]
        fresh = replace(problem, channels=other_fit.fit.problem.channels)
        shares.append(error_bands(fresh, known, errors).share_inside())
    return float(np.mean(shares, axis=0).min())


def _identified_race_car(measured_path: Path, work_folder: Path) -> IdentifiedVehicle:
    """The race car identified on the first part of its drive, with predictions of the rest."""
    path = write_plain_table(measured_path, work_folder / "race.csv")
    table = {"title": "race car", "system": "single-track", **RACE_CAR, "drive": {"file": path.name, "low_pass": 10.0}}
    times = read_drive(path).times
    middle = float(times[round(IDENTIFIED_SHARE * len(times))])
    scenes = []
    for ends in ([float(times[0]), middle], [middle, float(times[-1])]):
        scenes.append(build({**table, "drive": {**table["drive"], "stretch": ends}}, "race car", path.parent))  # type: ignore[dict-item]
    return identified_vehicle(
        scenes[0], scenes[1], ParameterSearch(IDENTIFIED_PARAMETERS, list(RELATIVE_ERROR_AIMS), 5.0)
    )


def _race_car_rows(identified_car: IdentifiedVehicle) -> list[Row]:
    """Rows: prediction error, share inside the bands and width of the bands, for every channel."""
    answer, rows = identified_car.bands, []
    figures = zip(
        RELATIVE_ERROR_AIMS.items(),
        answer.relative_error(),
        answer.share_inside(),
        answer.relative_width(),
        strict=True,
    )
    for (name, aim), error, inside, width in figures:
        id = f"race_car.{name.replace(' ', '_')}"
        rows += [
            Observed(
                f"{id}.error", SYSTEM, f"{name} of the last {1 - IDENTIFIED_SHARE:.0%}: error by its rms", error, ""
            ).aim(aim, "asked for; predicted from measured steer angle and speed alone", independence="measured"),
            Observed(
                f"{id}.inside", SYSTEM, f"{name}: share of the measured samples inside 95 % bands", inside, ""
            ).within(0.945, 0.045, "90 to 99 %, as asked for", "measured"),
            Observed(
                f"{id}.width", SYSTEM, f"{name}: mean half-width of the bands by the rms error", width, ""
            ).at_most(WIDEST_PREDICTION_BAND, "asked for: bands that are not merely wide", "measured"),
        ]
    return rows


def _sensor_consistency_row(table_path: Path) -> Row:
    """Row: measured lateral acceleration compared with that from measured speed, yaw rate and side slip, without a
    vehicle model.

    A sensor that rolls with the body also reads g sin(roll), a share of the lateral acceleration. A sensor at another
    place or with a delay differs as the motion changes.
    """
    times, _, speed, turning, sensed, slip = np.genfromtxt(table_path, delimiter=",", skip_header=1).T[:6]
    times, speed, turning, sensed, slip = (
        row[: round(IDENTIFIED_SHARE * len(times))] for row in (times, speed, turning, sensed, slip)
    )
    clock = FitClock(times, 5.0)
    moved = clock.filtered(np.gradient(speed * np.tan(slip), clock.period) + speed * turning)
    felt = clock.filtered(sensed)
    slope, offset = np.polyfit(moved, felt, 1)
    error = float(np.sqrt(np.mean((felt - moved) ** 2) / np.mean(felt**2)))
    quantity = (
        "lateral acceleration of the first stretch beside that of measured speed, yaw rate and side slip: error by its "
        f"rms; slope {slope:.3f}, offset {offset:.2f} m/s^2"
    )
    why = "no model takes part: what sensors leave of the error of a prediction"
    return Observed("race_car.sensors", SYSTEM, quantity, error, "").beside(0.0, why, "measured")


def _rows_not_run(reason: str) -> list[Row]:
    """Rows of the race car that were not run, with the reason."""
    return [
        not_run(f"race_car.{name.replace(' ', '_')}.error", SYSTEM, f"{name} predicted", reason)
        for name in RELATIVE_ERROR_AIMS
    ]


def _data_for_report(identified_car: IdentifiedVehicle) -> dict[str, Any]:
    """Estimates, standard errors and prediction errors, as saved data."""
    known = identified_car.uncertainty
    return {
        "estimates": dict(zip([p.name for p in known.fit.problem.parameters], known.fit.values.tolist(), strict=True)),
        "standard errors": [
            None if np.isnan(standard_error) else float(standard_error) for standard_error in known.deviations
        ],
        "errors": dict(zip(RELATIVE_ERROR_AIMS, identified_car.bands.relative_error().tolist(), strict=True)),
    }
