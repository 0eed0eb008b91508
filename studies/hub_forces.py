"""Drift of a vehicle under noisy hub forces, its effect on section forces and damage, and the moments of
stabilisers."""

from pathlib import Path
from typing import Any

import numpy as np

from models.core.result import join_results
from models.core.strict import Strict, read
from models.core.time_series import write_time_series
from models.systems.hub_forces.comparison import METHOD_OF_RUN, Progress, StabiliserComparison, compare_stabilisers
from models.systems.hub_forces.run import MOTION_CHANNELS
from models.systems.hub_forces.scene import COLUMNS_OF_ANGLES, COLUMNS_OF_HUB, HubScene

SYSTEM = "hub-forces"


class Options(Strict):
    """Keys of the table [options] of this study: none."""


def check(scene: HubScene, engines: tuple[str, ...]) -> None:
    """Raise InputError for any option, as this study has none."""
    read(Options, scene.options, scene.file, "options")


def run(scene: HubScene, engines: tuple[str, ...], output_folder: Path, report_progress: Progress) -> dict[str, Any]:
    """Measure hub forces virtually; run the vehicle free, with the Kalman filter and with prescribed roll and pitch.
    Saves the measurement, all runs and two figures; returns the summary."""
    from studies.hub_forces_figures import damage_figure, drift_figure

    comparison = compare_stabilisers(scene, engines, report_progress)
    save_measurement_and_runs(comparison, output_folder)
    drift_figure(comparison, scene.title, output_folder / "drift.png")
    damage_figure(comparison, scene.title, output_folder / "damage.png")
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": {},
        "answer": comparison.figures(),
        "results": comparison.results,
        "doubts": list(comparison.measurement.tilt.objections),
        "table": _table_lines(scene, comparison),
    }


def _table_lines(scene: HubScene, run_comparison: StabiliserComparison) -> list[str]:
    known, tilt = run_comparison.truth is not None, run_comparison.measurement.tilt
    error_heading = "largest error" if known else "largest difference"
    damage = "damage / true damage" if known else "damage / that with the filter"
    lines = [
        f"  forces in the frame {scene.forces.frame!r}; innovations squared {tilt.normalised_innovation:.2f} times",
        f"  {'':<18}{'roll':>9}{'pitch':>9}{'heading':>9}{'x':>8}{'y':>8}{'z':>8}{'drift-off':>11}"
        f"{'moments rms':>16}   {damage}",
        f"  {error_heading:<18}{'[mrad]':>9}{'[mrad]':>9}{'[mrad]':>9}{'[m]':>8}{'[m]':>8}{'[m]':>8}{'[s]':>11}"
        f"{'[N m]':>16}   least, most",
    ]
    for name, path in run_comparison.runs.items():
        largest = np.abs(run_comparison.errors(path)).max(axis=0)
        roll, pitch = np.sqrt(np.mean(path["holding_moment"] ** 2, axis=0))
        ratios, drifted = (
            run_comparison.relative_damages(path["section_force"]).values(),
            run_comparison.drift_off_time(path),
        )
        lines.append(
            f"  {name:<18}"
            + "".join(f"{1e3 * v:>9.3g}" for v in largest[:3])
            + "".join(f"{v:>8.2g}" for v in largest[3:])
            + f"{f'{drifted:.4g}' if np.isfinite(drifted) else 'never':>11}{roll:>8.3g}{pitch:>8.3g}   "
            + f"{min(ratios):.3g}, {max(ratios):.3g}"
        )
    if not known:
        lines.append("  the true run is not known: angles are beside the filter's estimate, damage beside that run's")
    lines += [f"  doubt: {text}" for text in tilt.objections]
    lines += [f"  {name}: {text}" for name, text in run_comparison.failed.items()]
    if len(run_comparison.runs) > len(METHOD_OF_RUN):
        lines.append(f"  engines before drift-off: {run_comparison.largest_engine_difference():.1e}")
    return lines


def save_measurement_and_runs(run_comparison: StabiliserComparison, output_folder: Path) -> None:
    """Save the measurement as CSV files of a user, all runs as ``runs.nc``, and the motion of the chassis as
    ``runs.csv``."""
    measurement = run_comparison.measurement
    names = [
        (f"{hub}_{name}", next(iter(units)))
        for hub in measurement.vehicle.hubs
        for name, units in COLUMNS_OF_HUB.items()
    ]
    _write_samples(output_folder / "hub_forces.csv", names, measurement.forces)
    _write_samples(
        output_folder / "angles.csv",
        [(name, next(iter(units))) for name, units in COLUMNS_OF_ANGLES.items()],
        measurement.angles,
    )
    runs = run_comparison.results
    angles, position_names = list(MOTION_CHANNELS)[:3], list(MOTION_CHANNELS)[3:]
    columns = {
        f"{name}: {channel}": (MOTION_CHANNELS[channel][1], path[channel])
        for channels in (angles, position_names)
        for name, path in runs.items()
        for channel in channels
    }
    write_time_series(output_folder / "runs.csv", columns, float(next(iter(run_comparison.runs.values())).times[1]))
    join_results(runs, "run").save(output_folder / "runs.nc")


def _write_samples(table_path: Path, columns_and_units: list[tuple[str, str]], sampled: Any) -> None:
    """Write sampled hub forces or angles to a CSV file, with a column for each (name, unit)."""
    columns = {name: (unit, sampled.samples[:, i]) for i, (name, unit) in enumerate(columns_and_units)}
    write_time_series(table_path, columns, sampled.period)


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("hub_forces")
