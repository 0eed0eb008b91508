"""A wheelset on straight track: Klingel's wavelength, critical speed, and motion below and above it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import RunFailed
from models.core.result import Result, join_results
from models.core.tables import write_table
from models.core.told import joined_result
from models.rail.energy import energy_ledger
from models.rail.equations import WheelsetPath as Motion
from models.rail.equations import Y
from models.rail.limit_cycle import positive_maxima
from models.rail.linear import critical_speed_or_reason, kinematic_wavelength, klingel_wavelength
from models.rail.wheelset import Wheelset
from models.systems.wheelset import conicity
from models.systems.wheelset.of_scene import equations_of, path_speeds, wheelset_of
from models.systems.wheelset.run import LinearisedMotion, linearised_result, over_speeds, results_by_speed_text
from models.systems.wheelset.run import run as run_path
from models.systems.wheelset.scene import WheelsetScene

SYSTEM = "wheelset"
ReportProgress = Callable[[str, float], None]
RunsByEngineAndSpeed = dict[str, dict[float, Result]]
"""Result of each run, by engine and speed (m/s)."""


def run(
    scene: WheelsetScene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Compute eigenvalues over speed, and runs at the scene's speeds; saves ``eigenvalues.nc``, ``paths.nc``,
    ``over_speed.csv`` and figures, and returns the summary."""
    from studies.wheelset_figures import creep_force_figure, lateral_motion_figure, stability_figure

    wheelset, failed, eigenvalues, paths = (
        wheelset_of(scene),
        dict[str, str](),
        dict[str, Result](),
        RunsByEngineAndSpeed(),
    )
    conicities = conicity.run(scene) if conicity.reports_conicity(scene) else None
    for i, engine in enumerate(engines):
        try:
            report_progress(f"eigenvalues of {engine}", i / len(engines))
            eigenvalues[engine] = linearised_result(scene, engine, estimate_error=scene.error)
            report_progress(f"paths of {engine}", (i + 0.5) / len(engines))
            paths[engine] = {speed: run_path(scene, engine, speed, error=scene.error) for speed in path_speeds(scene)}
        except RunFailed as error:
            failed[engine] = str(error)
    linear = {engine: result.detail for engine, result in eigenvalues.items()}
    if linear:
        joined_result(join_results(eigenvalues, "engine"), eigenvalues).save(output_folder / "eigenvalues.nc")
        _save_speed_table(linear, output_folder)
        stability_figure(eigenvalues, wheelset, scene.title, output_folder / "stability.png")
    if paths:
        over_speeds(paths).save(output_folder / "paths.nc")
        lateral_motion_figure(paths, scene.title, output_folder / "paths.png")
        creep_force_figure(next(iter(paths.values())), scene.title, output_folder / "creep.png")
    if conicities:
        conicities.save(output_folder / "conicity.nc")
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": failed,
        "answer": _summary_of_runs(wheelset, linear, paths)
        | (conicity.conicity_numbers(conicities) if conicities else {}),
        "results": {
            **_results_by_name(paths),
            **{f"{engine}, eigenvalues": linear_run for engine, linear_run in eigenvalues.items()},
            **({"conicity": conicities} if conicities else {}),
        },
        "table": [
            *(conicity.conicity_lines(conicities.detail) if conicities else []),
            *_wavelength_lines(wheelset, linear),
            *_stability_lines(wheelset, linear),
            *_run_lines(scene, paths),
        ],
    }


def _results_by_name(wheelset_runs: RunsByEngineAndSpeed) -> dict[str, Result]:
    """Results of all runs, by a name of engine and speed."""
    return {
        f"{engine}, {speed_text}": path
        for engine, paths_of_engine in wheelset_runs.items()
        for speed_text, path in results_by_speed_text(paths_of_engine).items()
    }


def _save_speed_table(linear_results: dict[str, LinearisedMotion], output_folder: Path) -> None:
    """Save a CSV table of growth rate (1/s), and damping and frequency of hunting, over speed."""
    columns = {"speed": ("m/s", next(iter(linear_results.values())).speeds)}
    for engine, linear_run in linear_results.items():
        columns[f"{engine} growth"] = ("1/s", linear_run.values.real.max(axis=1))
        columns[f"{engine} hunting damping"] = ("1/s", -linear_run.hunting_eigenvalue.real)
        columns[f"{engine} hunting frequency"] = ("Hz", linear_run.hunting_eigenvalue.imag / (2.0 * np.pi))
    write_table(output_folder / "over_speed.csv", columns)


def _summary_of_runs(
    wheelset: Wheelset, linear_results: dict[str, LinearisedMotion], wheelset_runs: RunsByEngineAndSpeed
) -> dict[str, Any]:
    """Summary in SI units: wavelengths, critical speed by engine (None if there is none), and largest power of the
    creep forces."""
    return {
        "klingel": klingel_wavelength(wheelset),
        "wavelength": {engine: linear_run.wavelength for engine, linear_run in linear_results.items()},
        "critical_speed": {engine: linear_run.critical_speed for engine, linear_run in linear_results.items()},
        "largest_power": {
            engine: max(float(path["power"].max()) for path in paths_of_engine.values())
            for engine, paths_of_engine in wheelset_runs.items()
        },
    }


def _wavelength_lines(wheelset: Wheelset, linear_results: dict[str, LinearisedMotion]) -> list[str]:
    """Lines for the screen on the wavelength of the free wheelset: Klingel's closed form, and the deviation of each
    engine's eigenvalues from it."""
    closed_form = "closed form of the cones, no slip" if wheelset.profiles else "closed form, no slip"
    closed, first = (
        klingel_wavelength(wheelset),
        next((linear_run.wavelength for linear_run in linear_results.values()), 0.0),
    )
    lines = [
        "  wavelength of the free wheelset",
        f"    {closed_form:<34}{closed:>14.9g} m",
        f"    {'creep forces alone':<34}{kinematic_wavelength(wheelset):>14.9g} m",
    ]
    for engine, linear_run in linear_results.items():
        lines.append(
            f"    {f'eigenvalues of {engine}':<34}{linear_run.wavelength:>14.9g} m   "
            f"{linear_run.wavelength / closed - 1:+.1e} from the closed form, "
            f"{linear_run.wavelength / first - 1:+.0e} from the first"
        )
    return lines


def _stability_lines(wheelset: Wheelset, linear_results: dict[str, LinearisedMotion]) -> list[str]:
    """Lines for the screen on the critical speed in every engine, or the reason why there is none."""
    lines = [
        "  critical speed with linear creep",
        f"    {'lateral and yaw motion alone':<34}" + _critical_speed_text(*critical_speed_or_reason(wheelset)),
    ]
    first = next((linear_run.critical_speed for linear_run in linear_results.values()), None)
    return lines + [
        f"    {f'eigenvalues of {engine}':<34}"
        + _critical_speed_text(linear_run.critical_speed, linear_run.no_critical_reason, first if k else None)
        for k, (engine, linear_run) in enumerate(linear_results.items())
    ]


def _critical_speed_text(
    critical_speed: float | None, missing_reason: str, first_critical_speed: float | None = None
) -> str:
    if critical_speed is None:
        return f"none: the wheelset {missing_reason}"
    return f"{critical_speed:>14.9g} m/s" + (
        f" {critical_speed / first_critical_speed - 1:+.0e} from the first" if first_critical_speed else ""
    )


def _run_lines(scene: WheelsetScene, wheelset_runs: RunsByEngineAndSpeed) -> list[str]:
    """Lines for the screen on the end of each run, the differences between the engines, and the energy balance."""
    if not wheelset_runs:
        return []
    (name, first), *other_paths = wheelset_runs.items()
    lines = [f"  paths, by {name}, with {scene.contact.law}"]
    for speed, path in first.items():
        motion, power = path.detail, path["power"]
        gaps = {
            engine: np.abs(paths_of_engine[speed].detail.states - motion.states).max()
            for engine, paths_of_engine in other_paths
        }
        book = energy_ledger(equations_of(scene, "reference", speed), motion)
        lines += [
            f"    {speed:g} m/s: {_ending_text(motion)}",
            *(f"      {engine}: within {gap:.1e} of {name} (m, rad, s)" for engine, gap in gaps.items()),
            f"      power of the creep forces: from {power.min():,.3g} to {power.max():.3g} W at a patch; "
            f"together they take {book.creep[-1]:,.4g} J",
            f"      energy: the drive gives {book.drive[-1]:,.4g} J, dampers take {book.dampers[-1]:,.4g} J; "
            f"{np.abs(book.residual).max():.1e} J are not accounted for",
        ]
    return lines


def _ending_text(wheelset_motion: Motion) -> str:
    """Text on a run's last lateral amplitude, and its change in the last cycle."""
    y = wheelset_motion.states[:, Y]
    tops = y[positive_maxima(y)]
    if tops.size < 2:
        return f"ends at {1e3 * wheelset_motion.states[-1, Y]:.3g} mm without a second maximum"
    return f"last amplitude {1e3 * tops[-1]:.4g} mm, {100 * (tops[-1] / tops[-2] - 1):+.3g} % in the last cycle"


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("wheelset")
