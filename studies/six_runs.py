"""Drift of a force-excited vehicle: the six runs of the paper, Section 4.

A virtual measurement on a road gives wheel forces and pitch. Each run on them is a scene of its own
(models/systems/pitch_plane/six_runs.py), in every engine.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import RunFailed
from models.core.result import Result
from models.core.whole_files import write_whole
from models.systems.pitch_plane.run import run_with_drift
from models.systems.pitch_plane.scene import Scene
from models.systems.pitch_plane.six_runs import (
    DRIFT_OFF_PITCH,
    channel_error,
    figures_of_run,
    measurement_and_runs,
    options_of,
)
from models.systems.pitch_plane.six_runs import SixRunOptions as Options

ReportProgress = Callable[[str, float], None]

SAVED_SPACING = 0.01
"""Row spacing (s) of the saved runs; the table is computed from every step."""
check = options_of


def run(scene: Scene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress) -> dict[str, Any]:
    """Run all six runs in each engine; saves every result, five figures and ``table.txt``, and returns the summary."""
    options = check(scene, engines)
    measured, deviation, scenes = measurement_and_runs(scene, output_folder, scene.error)
    measured.save(output_folder / "measurement.nc")
    runs: dict[str, dict[str, Result]] = {engine: {} for engine in engines}
    failed: dict[str, str] = {}
    pairs = [(engine, name) for engine in engines for name in scenes]
    for i, (engine, name) in enumerate(pairs):
        report_progress(f"{engine}: {name}", i / len(pairs))
        try:
            runs[engine][name] = run_with_drift(scenes[name], engine, scene.error)
        except RunFailed as failure:
            failed[f"{engine}, {name}"] = str(failure)
            continue
        runs[engine][name].every(SAVED_SPACING).save(output_folder / f"{engine} {name}.nc")
    rows = [
        figures_of_run(engine, name, measured, result) for engine in engines for name, result in runs[engine].items()
    ]
    table = summary_lines(rows, engines, options, deviation)
    write_whole(output_folder / "table.txt", "\n".join(table) + "\n")
    report_progress("figures", 1.0)
    if not failed:
        _draw_figures(measured, runs[engines[0]], output_folder)
    results_by_name = {f"{engine}: {name}": result for engine in engines for name, result in runs[engine].items()}
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "results": {"measurement": measured, **results_by_name},
        "sampling rate": options.sampling_rate,
        "noise deviation": deviation,
        "rows": rows,
        "failed": failed,
        "table": table,
    }


PUBLISHED_DRIFT = {
    "undisturbed": "about 30 s",
    "noisy 1": "about 10 s",
    "perturbed": "about 10 s",
    "guided, undisturbed": "about 70 N m",
    "guided, both": "+-800 N m; inertia term about 15 kN m",
}
"""Published figures of the paper by run. Its "85 kN m" is impossible, as |I beta''| <= b|f3| + a|f4|, and 5 % of it is
the moment."""


def summary_lines(
    run_rows: list[dict[str, Any]], engines: tuple[str, ...], study_options: Options, noise_deviation: float
) -> list[str]:
    """Lines for the screen: a table with a line per run and a column per engine."""
    runs: dict[str, list[dict[str, Any]]] = {}
    for line in run_rows:
        runs.setdefault(line["run"], []).append(line)
    free, guided = list[str](), list[str]()
    for name, lines in runs.items():
        first, paper = lines[0], PUBLISHED_DRIFT.get(name, "")
        if "moment max" in first:
            cells = " ".join(f"{line['moment max']:>9.1f}" for line in lines)
            further_cells = f"{first['moment rms']:>9.1f}   {first['inertia max'] / 1e3:>9.1f}"
        else:
            drift_off_texts = ("never" if line["drift-off"] is None else f"{line['drift-off']:.2f}" for line in lines)
            cells, further_cells = " ".join(f"{time:>9}" for time in drift_off_texts), f"{first['heave error']:>9.1e}"
        (guided if "moment max" in first else free).append(f"  {name:<20} {cells}   {further_cells}   {paper}".rstrip())
    names = " ".join(f"{engine:>9}" for engine in engines)
    return [
        f"  Sampled at {study_options.sampling_rate:g} Hz, linear in between; noise {noise_deviation:.1f} N.",
        f"  Time [s] until the pitch is {DRIFT_OFF_PITCH} rad wrong",
        f"  {'force-excited':<20} {names}   heave [m]   paper",
        *free,
        "  Largest enforced moment [N m]",
        f"  {'pitch prescribed':<20} {names}   rms [N m]   I b'' [kN m]   paper",
        *guided,
        "  rms and I b'' (largest) are those of the first column; generalised-alpha's moment errs by some "
        "1e-3 of I b'' at 1 ms on this road",
    ]


def _draw_figures(measured_run: Result, runs_by_name: dict[str, Result], output_folder: Path) -> None:
    """Save figures like Figs 4 to 8 of the paper."""
    from models.drawing.figures import save

    save(_measurement_figure(measured_run), output_folder / "fig4_measurement.png")
    main = {
        "virtual measurement": measured_run,
        "undisturbed": runs_by_name["undisturbed"],
        "noisy": runs_by_name["noisy 1"],
        "perturbed model": runs_by_name["perturbed"],
        "both": runs_by_name["both"],
    }
    save(_drift_figure(main, "Force-excited runs beside the measurement"), output_folder / "fig5_drift.png")
    for prefix, title, name in (
        ("noisy", "noise samples", "fig6_noise_samples"),
        ("model", "perturbed models", "fig7_perturbed_models"),
    ):
        chosen = {"virtual measurement": measured_run} | {
            key: run for key, run in runs_by_name.items() if key.startswith(prefix)
        }
        if len(chosen) == 1:
            continue
        save(_drift_figure(chosen, f"Force-excited runs: {len(chosen) - 1} {title}"), output_folder / f"{name}.png")
    save(_moment_figure(runs_by_name["guided, both"]), output_folder / "fig8_enforced_moment.png")


def _measurement_figure(measured_run: Result) -> Any:
    from models.drawing.figures import COLUMN_WIDTH, add_heading, legend_below, subplots

    figure, axes = subplots(2, 2, figsize=(COLUMN_WIDTH, 4.6), sharex="col", width_ratios=(2, 1))
    middle = round(float(measured_run.times[-1]) / 2, 1)
    detail = (measured_run.times >= middle) & (measured_run.times <= middle + 1)
    panels = ((("zeta1", "zeta2"), "Road under the wheels, up [m]", -1.0), (("f1", "f2"), "Wheel force [kN]", 1e-3))
    for (whole_axis, detail_axis), (channels, label, scale) in zip(axes, panels, strict=True):
        for channel, name in zip(channels, ("front", "rear"), strict=True):
            whole_axis.plot(measured_run.times, scale * measured_run[channel], label=name, linewidth=0.7)
            detail_axis.plot(measured_run.times[detail], scale * measured_run[channel][detail], label=name)
        whole_axis.set_title(label)
        detail_axis.set_title("Detail " + label[label.index("[") :])
    legend_below(figure, axes[0, 0])
    for axis in axes[1]:
        axis.set_xlabel("time [s]")
    add_heading(figure, "Virtual measurement: road and wheel forces", {"measurement": measured_run})
    return figure


def _drift_figure(results_by_run: dict[str, Result], title: str) -> Any:
    """Figure of each run's heave error on a logarithmic scale, and of its pitch; the first of the results is the
    measurement."""
    from models.drawing.figures import COLUMN_WIDTH, TRUTH_COLOUR, add_heading, legend_below, subplots

    figure, (heave, pitch) = subplots(1, 2, figsize=(COLUMN_WIDTH, 3.8))
    (name, measured), *runs = results_by_run.items()
    pitch.plot(measured.times, measured["pitch"], label=name, color=TRUTH_COLOUR, linewidth=1.8, zorder=9)
    for i, (name, run) in enumerate(runs):
        heave.semilogy(run.times, np.abs(channel_error(measured, run, "z3")) + 1e-12, color=f"C{i}", linewidth=0.8)
        pitch.plot(run.times, run["pitch"], label=name, color=f"C{i}")
    heave.set(title="Error of the chassis' heave [m]", ylim=(1e-9, 10), xlabel="time [s]")
    pitch.set(title="Pitch, nose up [rad]", ylim=(-1, 1), xlabel="time [s]")
    legend_below(figure, pitch, column_count=6)
    add_heading(figure, title, results_by_run)
    return figure


def _moment_figure(stabilised_run: Result) -> Any:
    from models.drawing.figures import COLUMN_WIDTH, add_heading, subplots

    figure, (inertia, moment) = subplots(1, 2, figsize=(COLUMN_WIDTH, 3.2))
    inertia.plot(stabilised_run.times, stabilised_run["inertia_term"] / 1e3, linewidth=0.5)
    inertia.set(title="Inertia term I β'' [kN m]", xlabel="time [s]")
    moment.plot(stabilised_run.times, stabilised_run["enforced_moment"], linewidth=0.5)
    moment.set(title="Enforced moment [N m]", xlabel="time [s]")
    title = "Pitch prescribed, perturbed model and noisy forces: what the guidance takes"
    add_heading(figure, title, {"guided, both": stabilised_run})
    return figure


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("six_runs")
