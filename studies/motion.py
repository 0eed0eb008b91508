"""Motion of the chassis from accelerometers: pitch, pitch rate and heave, quality of the readings, and filters.

Each engine's run leaves its readings as a file; the motion is then recovered from the file alone, as from a measured
one. A user's own file takes the place of the runs; nothing is known of the truth then.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.core.assumptions import with_assumptions
from models.core.discretisation import not_estimated
from models.core.errors import InputError, RunFailed
from models.core.result import Channel, Result, result
from models.core.strict import Strict, quantity, read
from models.core.tables import ACCELERATIONS
from models.core.time_series import read_time_series, write_time_series
from models.core.told import Results
from models.core.whole_files import write_whole
from models.drift.score import root_mean_square
from models.sensors.motion_assumptions import AccelerometerRecord, assumptions_of_motion
from models.sensors.rate_filter import filter_rates
from models.sensors.rigid_body_motion import (
    UNEXPLAINED_SHARE_LIMIT,
    BodyStartState,
    CutOffFrequencies,
    RecoveredMotion,
    RigidFitQuality,
    body_rotation_from_readings,
    check_cut_off,
    fit_quality,
    recovered_motion,
    tilt_displacement,
)
from models.sensors.rotations import GimbalLock
from models.sensors.sensor_array import SensorArray, sensor_array
from models.systems.pitch_plane.effects.accelerometers import Parameters, channels_of_sensors
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.sampling import write_samples
from models.systems.pitch_plane.scene import Scene

ReportProgress = Callable[[str, float], None]
COMPARED_CHANNELS = {"pitch": ("pitch", "rad"), "rate": ("pitch_rate", "rad/s"), "heave": ("z3", "m")}
"""Channel of the run and its unit, for each compared quantity."""
TABLE_TILT = 1e-3
"""Tilt error (rad) for which the table states the false displacement."""
SENSORS_KEY = "effects.accelerometers.sensors"


class Options(Strict):
    """Keys of the table [options] of this study."""

    file: str | None = Field(None, description="CSV of measured readings: time [s], ax1 [m/s^2], ay1, az1, ax2, ...")
    zeroed: bool = Field(False, description="true for readings set to zero at rest on level ground (eq. 17)")
    turning_cut_off: float = quantity("Hz", "high-pass on rates and angles", default=0.2)
    position_cut_off: float = quantity("Hz", "high-pass on velocity and position", default=0.2)


@dataclass
class ReadingsSource:
    """Accelerometer readings (n, sensors, 3) in m/s^2 of an engine's run or a file, ``period`` (s) apart, with the true
    motion and gyro readings if there are any."""

    source_name: str
    readings: np.ndarray
    sample_period: float
    true_motion: dict[str, np.ndarray] = field(default_factory=dict)
    gyro_rates: np.ndarray | None = None
    readings_quality: RigidFitQuality | None = None
    recovered_motions: dict[str, RecoveredMotion] = field(default_factory=dict)
    engine_run: Result | None = None

    @property
    def start_state(self) -> BodyStartState:
        """Initial state of the recovered motion: that of the run, or level and at rest."""
        first = (
            float(self.true_motion[name][0]) for name in ("pitch", "rate", "heave", "heave rate") if self.true_motion
        )
        return BodyStartState.pitched(*first) if self.true_motion else BodyStartState()


def run(scene: Scene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress) -> dict[str, Any]:
    """Take readings of each engine's run or of the file, and recover the motion by each method; saves the motions, a
    table and a figure, and returns the summary."""
    options, p = check(scene, engines)
    array = _sensor_array(scene, p.positions())
    failed: dict[str, str] = {}
    sources: list[ReadingsSource] = []
    results: dict[str, Result] = {}
    for i, name in enumerate(engines if options.file is None else (options.file,)):
        report_progress(f"{name}: readings and motion", i / len(engines))
        try:
            source = (
                _readings_of_run(scene, name, output_folder)
                if options.file is None
                else _measured_readings(scene, options, p)
            )
            _recover_motions(source, array, options, p)
        except (RunFailed, GimbalLock) as error:
            failed[name] = str(error)
            continue
        results |= {} if source.engine_run is None else {name: source.engine_run}
        results[f"{name}: motion"] = _save_motions(scene, source, output_folder, options)
        sources.append(source)
    arranged = ["  The sensors", *(f"    {line}" for line in array.description_sentences())]
    table = [*arranged, *(line for source in sources for line in _screen_lines(source, p)), *_closing_lines(options)]
    write_whole(output_folder / "table.txt", "\n".join(table) + "\n")
    report_progress("figure", 1.0)
    if sources:
        _figure(sources[0], results, output_folder / "motion.png")
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": failed,
        "results": results,
        "table": table,
        "rows": [_summary_of_methods(source) for source in sources],
    }


def check(scene: Scene, engines: tuple[str, ...]) -> tuple[Options, Parameters]:
    """Options and accelerometers of the scene; raises InputError if the readings cannot be used."""
    options = read(Options, scene.options, scene.file, "options")
    if "accelerometers" not in scene.effects:
        raise InputError(scene.file, "effects.accelerometers", None, "is missing: this study reads accelerometers")
    p = scene.effects["accelerometers"]
    _sensor_array(scene, p.positions())
    if scene.run.output_step is not None:
        allowed = "this study reads its sensors at every step, and saves their samples alone: drop this key"
        raise InputError(scene.file, "run.output_step", scene.run.output_step, allowed)
    if options.file is not None:
        source = _measured_readings(scene, options, p)
        count, period = len(source.readings), source.sample_period
    else:
        if options.zeroed:
            allowed = (
                "virtual sensors read specific force, gravity included: this key belongs to readings of your own "
                "(options.file)"
            )
            raise InputError(scene.file, "options.zeroed", True, allowed)
        count, period = round(scene.run.duration * p.sampling_rate) + 1, 1 / p.sampling_rate
    for name in ("turning_cut_off", "position_cut_off"):
        check_cut_off(count, period, getattr(options, name), scene.file, f"options.{name}")
    return options, p


def _sensor_array(scene: Scene, positions: dict[str, tuple[float, float, float]]) -> SensorArray:
    """Array of the accelerometers at positions (m); an InputError about them names the scene's file and key."""
    try:
        return sensor_array(positions)
    except InputError as error:
        raise InputError(scene.file, SENSORS_KEY, error.value, error.allowed) from None


def _measured_readings(scene: Scene, study_options: Options, parameters: Parameters) -> ReadingsSource:
    """Readings of the user's file, in the order of the scene's accelerometers."""
    assert study_options.file is not None
    return _readings_of_file(study_options.file, scene.path(study_options.file, "options.file"), parameters)


def _readings_of_file(source_name: str, readings_path: Path, parameters: Parameters) -> ReadingsSource:
    """Accelerometer readings of a file, named for the results."""
    values, period = read_time_series(
        readings_path, dict.fromkeys(chain(*channels_of_sensors(parameters)), ACCELERATIONS)
    )
    return ReadingsSource(source_name, values.reshape(len(values), -1, 3), period)


def _readings_of_run(scene: Scene, engine: str, output_folder: Path) -> ReadingsSource:
    """Readings of an engine's run, which are written to a file and read again like measured readings."""
    p = scene.effects["accelerometers"]
    computed = simulate(scene, engine, error=scene.error)
    path = output_folder / f"{engine} readings.csv"
    write_samples(computed, {channel: channel for channel in chain(*channels_of_sensors(p))}, p.sampling_rate, path)
    source = _readings_of_file(engine, path, p)
    rows = np.searchsorted(computed.times, source.sample_period * (np.arange(len(source.readings)) - 1e-3))
    wanted = {name: channel for name, (channel, _) in COMPARED_CHANNELS.items()} | {"heave rate": "z3_rate"}
    source.true_motion = {name: computed[channel][rows] for name, channel in wanted.items()}
    source.engine_run = computed
    source.gyro_rates = computed["gyro"][rows] if "gyro" in computed.data else None
    return source


def _recover_motions(
    readings_source: ReadingsSource, accelerometers: SensorArray, study_options: Options, parameters: Parameters
) -> None:
    """Recover the motion from the readings by every method, and store it in the source. A suspect sensor, whose
    readings do not fit a rigid body, is used by the first method only."""
    readings_source.readings_quality = fit_quality(accelerometers, readings_source.readings, parameters.deviation)
    suspect, readings = readings_source.readings_quality.suspect_sensor, readings_source.readings
    recover = partial(
        recovered_motion,
        sample_period=readings_source.sample_period,
        start_state=readings_source.start_state,
        gravity_corrected=study_options.zeroed,
    )
    if suspect:
        readings_source.recovered_motions["all sensors, integrated"] = recover(accelerometers, readings)
        readings = readings[:, [name != suspect for name in accelerometers.names]]
        accelerometers = sensor_array(
            {name: sensor_position for name, sensor_position in parameters.positions().items() if name != suspect}
        )
    readings_source.recovered_motions["integrated"] = recover(accelerometers, readings)
    if parameters.deviation > 0:
        filtered_rates, _ = filter_rates(
            body_rotation_from_readings(accelerometers, readings),
            readings_source.sample_period,
            np.array(readings_source.start_state.rates),
            parameters.deviation,
        )
        readings_source.recovered_motions["rates held by w w^T"] = recover(
            accelerometers, readings, rates=filtered_rates
        )
    if readings_source.gyro_rates is not None:
        turning = readings_source.gyro_rates[:, None] * [
            0.0,
            1.0,
            0.0,
        ]  # it reads the pitch rate; the vehicle does nothing else
        readings_source.recovered_motions["rates from the gyro"] = recover(accelerometers, readings, rates=turning)
    cut_offs = CutOffFrequencies(study_options.turning_cut_off, study_options.position_cut_off)
    readings_source.recovered_motions["high-passed"] = recover(accelerometers, readings, cut_offs=cut_offs)


def _compared_values(recovered_motion: RecoveredMotion) -> dict[str, np.ndarray]:
    """Pitch (rad), pitch rate (rad/s) and heave (m, down) of a recovered motion."""
    return {
        "pitch": recovered_motion.angles()[:, 1],
        "rate": recovered_motion.rates[:, 1],
        "heave": recovered_motion.position[:, 2],
    }


def _save_motions(scene: Scene, readings_source: ReadingsSource, output_folder: Path, study_options: Options) -> Result:
    """Save the recovered pitch, pitch rate and heave: a CSV file per method, and a netCDF result with all methods,
    which is returned."""
    stem, values_of_methods = (
        Path(readings_source.source_name).stem,
        {method_name: _compared_values(motion) for method_name, motion in readings_source.recovered_motions.items()},
    )
    for method_name, moved_values in values_of_methods.items():
        columns = {name: (COMPARED_CHANNELS[name][1], values) for name, values in moved_values.items()}
        write_time_series(output_folder / f"{stem}, {method_name}.csv", columns, readings_source.sample_period)
    channels = {
        name: Channel(("way", "time"), [moved_values[name] for moved_values in values_of_methods.values()], unit)
        for name, (_, unit) in COMPARED_CHANNELS.items()
    }
    reading_times = readings_source.sample_period * np.arange(len(readings_source.readings))
    axes = {"way": Channel("way", list(values_of_methods)), "time": Channel("time", reading_times, "s")}
    saved = result(scene, channels, axes, engine=readings_source.source_name)
    assert readings_source.readings_quality is not None
    record = AccelerometerRecord(
        readings_source.readings_quality,
        readings_source.readings,
        readings_source.sample_period,
        not readings_source.true_motion and not study_options.zeroed,
    )
    with_assumptions(saved, assumptions_of_motion(record, readings_source.recovered_motions["integrated"]))
    if scene.error:
        truth_text = (
            "the table has the error of each way beside the run" if readings_source.true_motion else "no truth is known"
        )
        not_estimated(saved, f"noise and mounts err most, and {truth_text}")
    saved.save(output_folder / f"{stem} motion.nc")
    return saved


def _summary_of_methods(readings_source: ReadingsSource) -> dict[str, Any]:
    """Summary of the recovered motions: share of misfit in the readings, suspect sensor, and largest and rms error of
    each method; without a true motion, largest and rms value in place of errors."""
    assert readings_source.readings_quality is not None
    errors_of_methods = {}
    for method_name, motion in readings_source.recovered_motions.items():
        errors = {
            name: values - readings_source.true_motion.get(name, 0.0)
            for name, values in _compared_values(motion).items()
        }
        errors_of_methods[method_name] = {
            name: [float(np.abs(error).max()), root_mean_square(error)] for name, error in errors.items()
        }
    quality = readings_source.readings_quality
    assert quality is not None
    quality_facts = {"share": quality.unexplained_share, "rigid": quality.rigid, "suspect": quality.suspect_sensor}
    return {"source": readings_source.source_name, **quality_facts, "ways": errors_of_methods}


def _screen_lines(readings_source: ReadingsSource, parameters: Parameters) -> list[str]:
    """Lines for the screen: verdict on the readings, then largest and rms error (or value) for each method."""
    assert readings_source.readings_quality is not None
    numbers, kind = _summary_of_methods(readings_source), "error" if readings_source.true_motion else "size"
    head = f"largest {kind} (rms)"
    lines = [
        f"  {readings_source.source_name}",
        f"    {_rigidity_text(readings_source.readings_quality)}",
        f"    {head:<28}{'pitch [mrad]':>20}{'rate [rad/s]':>20}{'heave [m]':>20}",
    ]
    for method_name, errors in numbers["ways"].items():
        cells = [
            f"{scale * errors[name][0]:.3g} ({scale * errors[name][1]:.2g})"
            for name, scale in (("pitch", 1e3), ("rate", 1.0), ("heave", 1.0))
        ]
        lines.append(f"    {method_name:<28}{cells[0]:>20}{cells[1]:>20}{cells[2]:>20}")
    if parameters.deviation == 0:
        lines.append("    rates held by w w^T: not made, as the scene states no noise (deviation) to weigh it with")
    return lines


def _rigidity_text(readings_quality: RigidFitQuality) -> str:
    """Sentence on the consistency of the readings with rigid-body motion."""
    if readings_quality.rigid is None:
        return "whether the body is rigid cannot be told: no sensor is left over"
    share = f"{100 * readings_quality.unexplained_share:.2g} % of the relative accelerations fit no rigid body"
    if readings_quality.rigid:
        return (
            f"{share} (allowed: {100 * UNEXPLAINED_SHARE_LIMIT:g} %, or what the noise leaves): the mounts "
            "pass for rigid"
        )
    if readings_quality.suspect_sensor:
        return (
            f"{share} (allowed: {100 * UNEXPLAINED_SHARE_LIMIT:g} %): {readings_quality.suspect_sensor!r} does "
            "not move with the body and is left out"
        )
    return (
        f"{share} (allowed: {100 * UNEXPLAINED_SHARE_LIMIT:g} %): the body or a mount gives way and no "
        "single sensor explains it, "
        "or the noise is larger than the scene states (deviation)"
    )


def _closing_lines(study_options: Options) -> list[str]:
    """Lines for the screen on the cut-off frequencies of the filters, and on the false displacement that a tilt
    causes."""
    far = float(tilt_displacement(TABLE_TILT, np.array([10.0]))[0])
    return [
        f"  High-pass: rates and angles {study_options.turning_cut_off:g} Hz, velocity and position "
        f"{study_options.position_cut_off:g} Hz, Butterworth of order 2 forwards and backwards;",
        "  it takes slow errors and true grades alike, and is least sure within one period of the ends.",
        f"  A tilt error of {1e3 * TABLE_TILT:g} mrad turns gravity into a false displacement of "
        f"{far:.2g} m after 10 s, "
        "four times that after 20 s.",
    ]


def _figure(readings_source: ReadingsSource, shown_results: Results, figure_path: Path) -> None:
    """Save a figure of pitch and heave for one source of readings, the error of each method if the true motion is
    known, and the misfit of the readings from rigid-body motion."""
    from models.drawing.figures import COLUMN_WIDTH, GREY, add_heading, legend_below, save, subplot_mosaic

    assert readings_source.readings_quality is not None
    reading_times = readings_source.sample_period * np.arange(len(readings_source.readings))
    rows: list[Any] = [
        ["pitch", "heave"],
        *([["pitch error", "heave error"]] if readings_source.true_motion else []),
        ["misfit", "misfit"],
    ]
    figure, axes = subplot_mosaic(rows, figsize=(COLUMN_WIDTH, 2.0 * len(rows) + 0.8), sharex=True)
    for axis in axes.values():
        axis.xaxis.set_tick_params(labelbottom=True)
    motions = {
        method_name: _compared_values(motion) for method_name, motion in readings_source.recovered_motions.items()
    }
    for name, label, scale in (("pitch", "Pitch, nose up [mrad]", 1e3), ("heave", "Heave, down [m]", 1.0)):
        _plot_motions(
            axes[name],
            reading_times,
            {method_name: scale * motion[name] for method_name, motion in motions.items()},
            label,
            readings_source,
            name,
        )
        if readings_source.true_motion:
            errors = {
                method_name: scale * np.abs(motion[name] - readings_source.true_motion[name])
                for method_name, motion in motions.items()
            }
            _plot_errors(
                axes[f"{name} error"],
                reading_times,
                errors,
                f"Largest error of the {name} so far {label[label.index('[') :]}",
            )
    axes["misfit"].plot(reading_times, readings_source.readings_quality.unexplained_rms, color=GREY, linewidth=0.4)
    axes["misfit"].set_title(
        f"Readings that no rigid motion explains, "
        f"{100 * readings_source.readings_quality.unexplained_share:.2g} % [m/s²]"
    )
    axes["misfit"].set_xlabel("time [s]")
    legend_below(figure, axes["pitch error" if readings_source.true_motion else "pitch"], column_count=3)
    add_heading(
        figure,
        f"Pitch and heave from accelerometers, {readings_source.source_name}: what each way errs by",
        shown_results,
    )
    save(figure, figure_path)


def _plot_motions(
    axis: Any,
    times: np.ndarray,
    values_of_methods: dict[str, np.ndarray],
    title: str,
    readings_source: ReadingsSource,
    quantity_name: str,
) -> None:
    """Plot the true motion over time if it is known, else the motion recovered by each method."""
    from models.drawing.figures import TRUTH_COLOUR

    if readings_source.true_motion:
        axis.plot(
            times,
            (1e3 if quantity_name == "pitch" else 1.0) * readings_source.true_motion[quantity_name],
            color=TRUTH_COLOUR,
        )
        axis.set_title(f"True {title[0].lower()}{title[1:]}")
        return
    for method_name, values in values_of_methods.items():
        axis.plot(times, values, linewidth=0.9, label=method_name)
    axis.set_title(title)


def _plot_errors(axis: Any, times: np.ndarray, errors_of_methods: dict[str, np.ndarray], title: str) -> None:
    """Plot the largest error of each method up to each time, on a logarithmic scale."""
    for method_name, error in errors_of_methods.items():
        axis.semilogy(times[1:], np.maximum.accumulate(error)[1:], label=method_name)
    axis.set_title(title)


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("motion")
