"""A measured race car: tyres identified on one section of a drive, motion on another predicted with 95 % bands.

Input of the prediction is measured steer angle and speed alone. The file of the drive is that of the scene, or, where
``options.measurement`` names one, columns as in the race's file: t, delta, vx, beta_true, yawRate, ayCG in SI units.
Without either the study runs on a drive that was made by the car on four wheels, and says so.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.core.errors import InputError
from models.core.strict import Strict, read
from models.identification.held_out import IdentifiedVehicle, ParameterSearch, identified_vehicle
from models.identification.of_scene import SceneModel
from models.systems.single_track.race_file import IDENTIFIED_PARAMETERS, RACE_CAR, write_plain_table
from models.systems.single_track.scene import SingleTrackScene, build
from studies.command.identify import identification_as_dict, identification_lines

SYSTEM = "single-track"
ReportProgress = Callable[[str, float], None]
AIMED_ERRORS = {"yaw rate": 0.12, "lateral acceleration": 0.12, "side slip": 0.25}
"""Aim for the rms prediction error of each channel, divided by the rms of the measurement."""


class Options(Strict):
    """Keys of the table [options] of this study."""

    measurement: str = Field("", description="file of the race in TWINRIG_DATA, or a path; empty for the scene's drive")
    prediction: str = Field("", description="another such file that is predicted; empty: the last part of the first")
    share: float = Field(
        0.65, gt=0.1, lt=0.95, description="of the measurement that is identified on, without prediction"
    )
    low_pass: float = Field(5.0, gt=0, le=50, description="Hz, of run and measurement alike, without phase")
    blocks: int = Field(3, ge=2, le=10, description="parts of the measurement, each predicted from the others")
    parameters: list[str] = Field(
        [],
        description="keys that are identified, each KEY or KEY=LOW:HIGH; empty: fifteen of a measured race car, five "
        "of the scene's own short drive, which determines no more",
    )

    def identified_keys(self) -> list[str]:
        """Keys of the parameters to identify, each KEY or KEY=LOW:HIGH."""
        return self.parameters or list(IDENTIFIED_PARAMETERS if self.measurement else FITTED_PARAMETERS)


FITTED_PARAMETERS = (
    "vehicle.yaw_inertia=300:5000",
    "front.stiffness=5:50",
    "front.friction=0.3:3",
    "rear.stiffness=5:50",
    "rear.friction=0.3:3",
)
"""Parameters that half a minute of driving determines; with all fifteen the search does not converge."""
SIMPLER_VEHICLES: dict[str, tuple[dict[str, float], tuple[str, ...]]] = {
    "linear single track": ({"front.friction": 50.0, "rear.friction": 50.0}, ("stiffness", "yaw_inertia", "offset")),
    "six numbers": ({}, ("stiffness", "friction", "yaw_inertia", "steer_offset")),
}
"""Simpler vehicles by name: values of fixed keys, and words in the keys that are still identified."""


def check(scene: SingleTrackScene, engines: tuple[str, ...]) -> None:
    """Raise InputError for missing files, and for a prediction without a measurement."""
    options = read(Options, scene.options, scene.file, "options")
    for name in ("measurement", "prediction"):
        if getattr(options, name):
            _data_file(scene, getattr(options, name), f"options.{name}")
    if options.prediction and not options.measurement:
        raise InputError(scene.file, "options.prediction", options.prediction, "needs options.measurement beside it")


def run(
    scene: SingleTrackScene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Identify the vehicle, predict its motion, and compare with simpler vehicles; saves ``race_car.png``,
    ``predicted.nc`` and the measured drives, and returns the summary."""
    from studies.race_car_figure import draw_race_car_figure

    options = read(Options, scene.options, scene.file, "options")
    first, second = identification_and_test_scenes(scene, options, output_folder)
    chosen = identified_vehicle(
        first,
        second,
        ParameterSearch(options.identified_keys(), list(AIMED_ERRORS), options.low_pass, options.blocks),
        report_progress,
    )
    simpler = {
        name: identify_simpler_vehicle(first, second, options, name, report_progress) for name in SIMPLER_VEHICLES
    }
    draw_race_car_figure(chosen, simpler, scene.title, output_folder / "race_car.png")
    solved = chosen.uncertainty.fit
    predicted = SceneModel(second, [identified_one.name for identified_one in solved.problem.parameters], "").result(
        solved.values
    )
    predicted.save(output_folder / "predicted.nc")
    answer = error_ratios(chosen)
    answer["identified"] = identification_as_dict(chosen.uncertainty)
    answer["simpler vehicles"] = {
        name: dict(zip(AIMED_ERRORS, identified_one.bands.relative_error(), strict=True))
        for name, identified_one in simpler.items()
    }
    answer["residuals"] = residual_correlations(chosen)
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": {},
        "answer": answer,
        "results": {"prediction": predicted},
        "table": [
            *identification_lines(chosen.uncertainty),
            *_result_lines(chosen, simpler),
            *_residual_lines(answer["residuals"]),
        ],
    }


def identification_and_test_scenes(
    scene: SingleTrackScene, study_options: Options, output_folder: Path
) -> tuple[SingleTrackScene, SingleTrackScene]:
    """Scene of the drive's section for identification, and scene of the section for prediction; measured drives are
    written into ``output_folder``."""
    if not study_options.measurement:
        full_scene, path = scene, scene.path(scene.drive.file, "drive.file")
    else:
        path = write_plain_table(
            _data_file(scene, study_options.measurement, "options.measurement"), output_folder / "measured.csv"
        )
        full_scene = _scene_with_car(scene, path, RACE_CAR)
    if study_options.prediction:
        prediction_file = write_plain_table(
            _data_file(scene, study_options.prediction, "options.prediction"), output_folder / "predicted.csv"
        )
        return full_scene, _scene_with_car(scene, prediction_file, RACE_CAR)
    from models.measured.drive import read_drive

    drive_times = read_drive(path).times
    middle = float(drive_times[round(study_options.share * len(drive_times))])
    ends = [float(drive_times[0]), middle], [middle, float(drive_times[-1])]
    return tuple(_scene_of_section(full_scene, end) for end in ends)  # type: ignore[return-value]


def _data_file(scene: SingleTrackScene, file_name: str, key_path: str) -> Path:
    """Path of a file in the folder TWINRIG_DATA if it is there; else the path that the scene finds for the name."""
    data = os.environ.get("TWINRIG_DATA", "")
    return Path(data) / file_name if data and (Path(data) / file_name).is_file() else scene.path(file_name, key_path)


def _scene_with_car(scene: SingleTrackScene, drive_path: Path, car_tables: dict[str, Any]) -> SingleTrackScene:
    """Scene of a car, given as tables, on the drive in a file."""
    table = {"title": scene.title, "system": SYSTEM, **car_tables, "drive": {"file": drive_path.name, "low_pass": 10.0}}
    return build(table, scene.file, drive_path.parent)


def _scene_of_section(scene: SingleTrackScene, section_ends: list[float]) -> SingleTrackScene:
    """The scene with the drive cut to a section (s), without options."""
    return scene.model_copy(update={"drive": scene.drive.model_copy(update={"stretch": section_ends}), "options": {}})


def identify_simpler_vehicle(
    identification_scene: SingleTrackScene,
    prediction_scene: SingleTrackScene,
    study_options: Options,
    vehicle_name: str,
    report_progress: ReportProgress,
) -> IdentifiedVehicle:
    """Identification and prediction with a simpler vehicle, of which some parameters are fixed and fewer are
    identified."""
    holds, kept_words = SIMPLER_VEHICLES[vehicle_name]
    parameters = [text for text in study_options.identified_keys() if any(word in text for word in kept_words)]
    simpler_search = ParameterSearch(parameters, list(AIMED_ERRORS), study_options.low_pass, blocks=2)

    def tell(task_text: str, finished_share: float) -> None:
        report_progress(f"{vehicle_name}: {task_text}", 0.95)

    return identified_vehicle(
        _scene_with_values(identification_scene, holds),
        _scene_with_values(prediction_scene, holds),
        simpler_search,
        tell,
    )


def _scene_with_values(scene: SingleTrackScene, new_values: dict[str, float]) -> SingleTrackScene:
    """The scene with a sharpness of 2 at both axles, and other values of some keys."""
    from models.core.scene_file import set_key

    table = scene.table()
    for axle in ("front", "rear"):
        set_key(table, f"{axle}.sharpness", 2.0)
    for key, value in new_values.items():
        set_key(table, key, value)
    return build(table, scene.file, Path(scene.folder))


def error_ratios(identified_vehicle: IdentifiedVehicle) -> dict[str, Any]:
    """For each channel, ratios of: rms prediction error to rms of the measurement; samples inside the bands to all
    samples; half-width of the bands to the error; rms cross-validation error to rms of the measurement."""
    sizes = np.array([channel.size for channel in identified_vehicle.uncertainty.fit.problem.channels])
    crossed = np.sqrt(np.mean(identified_vehicle.cross_validation_errors**2, axis=1)) / sizes
    share_inside, width, relative = (
        identified_vehicle.bands.share_inside(),
        identified_vehicle.bands.relative_width(),
        identified_vehicle.bands.relative_error(),
    )
    return {
        name: {
            "error": float(relative[k]),
            "inside": float(share_inside[k]),
            "half-width by error": float(width[k]),
            "error between parts": float(crossed[k]),
        }
        for k, name in enumerate(AIMED_ERRORS)
    }


def _result_lines(full_vehicle: IdentifiedVehicle, identified_vehicles: dict[str, IdentifiedVehicle]) -> list[str]:
    table = [f"  {'prediction':<26}{'error':>9}{'aim':>8}{'inside 95 %':>13}{'half-width':>12}{'parts':>9}"]
    for name, identified_one in error_ratios(full_vehicle).items():
        table.append(
            f"  {name:<26}{identified_one['error']:>9.1%}{AIMED_ERRORS[name]:>8.0%}{identified_one['inside']:>13.1%}"
            f"{identified_one['half-width by error']:>12.2f}{identified_one['error between parts']:>9.1%}"
        )
    for name, identified_one in identified_vehicles.items():
        errors = ", ".join(
            f"{n} {e:.1%}" for n, e in zip(AIMED_ERRORS, identified_one.bands.relative_error(), strict=True)
        )
        table.append(f"  {name}: {errors}")
    return table


def residual_correlations(identified_vehicle: IdentifiedVehicle) -> dict[str, dict[str, float]]:
    """For each channel, correlations of the cross-validation error, or of its magnitude, with accelerations, speed and
    braking of the car."""
    problem = identified_vehicle.uncertainty.fit.problem
    model = problem.model.result(identified_vehicle.uncertainty.fit.values)  # type: ignore[attr-defined]
    clock = problem.clock.times
    lateral, forward_acceleration = (
        np.interp(clock, model.times, model[n]) for n in ("lateral acceleration", "forward acceleration")
    )
    speed = np.interp(clock, model.times, model.detail.speed)
    causes: dict[str, tuple[Callable[[np.ndarray], np.ndarray], np.ndarray]] = {
        "magnitude with |lateral acceleration|": (np.abs, np.abs(lateral)),
        "magnitude with speed": (np.abs, speed),
        "magnitude with braking": (np.abs, -np.minimum(forward_acceleration, 0.0)),
        "itself with lateral acceleration": (np.asarray, lateral),
        "itself with |lateral acceleration|": (np.asarray, np.abs(lateral)),
        "itself with lateral x forward acceleration": (np.asarray, lateral * forward_acceleration),
        "itself with time x lateral acceleration": (np.asarray, lateral * (clock - clock.mean())),
    }
    return {
        name: {cause: float(np.corrcoef(transform(row), values)[0, 1]) for cause, (transform, values) in causes.items()}
        for name, row in zip(AIMED_ERRORS, identified_vehicle.cross_validation_errors, strict=True)
    }


def _residual_lines(correlations_by_channel: dict[str, dict[str, float]]) -> list[str]:
    def causes_text(correlations: dict[str, float]) -> str:
        strongest = sorted(correlations, key=lambda cause: -abs(correlations[cause]))[:2]
        return ", ".join(f"{cause} {correlations[cause]:+.2f}" for cause in strongest)

    return [
        f"  residual of {name} goes with: {causes_text(causes)}" for name, causes in correlations_by_channel.items()
    ]


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("race_car")
