"""Scatter of anti-lock braking: two ensembles of stops, their means, scatter, and a test of their difference."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.core.discretisation import with_sampling_error
from models.core.errors import InputError
from models.core.result import Channel, Result, result
from models.core.strict import Strict, quantity, read
from models.core.told import Results, joined_result
from models.ensemble.runner import EnsembleProgress as Done
from models.ensemble.runner import PathBlocks, run_paths
from models.ensemble.workers import Crew, folders_for_workers
from models.systems.braking.of_scene import merged_tables
from models.systems.braking.plan import check_reference
from models.systems.braking.run import run as drive
from models.systems.braking.scene import BrakingScene, build
from models.systems.braking.stops import (
    SAVED_QUANTITIES,
    SampleScatter,
    StopEnsemble,
    WelchResult,
    scatter_of,
    statistical_errors,
    welch_test,
)

SYSTEM = "braking"
ReportProgress = Callable[[str, float], None]
BLOCKS_FOLDER = "blocks"
"""Name of the folder of finished blocks in the results' folder, from which a killed run can be resumed."""
RUNS_PER_BLOCK = 5
"""Number of runs in a block that a worker computes."""


class Options(Strict):
    """Keys of the table [options] of this study."""

    runs: int = Field(100, ge=2, le=100_000, description="stops in each ensemble")
    procedure: str = Field("straight", description="name of the procedure that is repeated")
    speed_spread: float = quantity("", "standard deviation of the initial speed, relative", default=0.002, zero=True)
    seed: int = Field(1, ge=0, le=2**62, description="of the speeds")
    other: dict[str, Any] = Field(default_factory=dict, description="what the second ensemble has otherwise, as tables")
    names: list[str] = Field(["first", "second"], min_length=2, max_length=2, description="of both ensembles")


def check(scene: BrakingScene, engines: tuple[str, ...]) -> None:
    """Raise InputError for an unknown procedure, and for an impossible second ensemble."""
    check_reference(scene, engines)
    options = read(Options, scene.options, scene.file, "options")
    if options.procedure not in scene.procedures:
        raise InputError(
            scene.file, "options.procedure", options.procedure, "no such procedure", tuple(scene.procedures)
        )
    build(merged_tables(scene.table(), options.other), f"{scene.file} with options.other", Path(scene.folder))


def run(
    scene: BrakingScene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Run both ensembles of stops; saves each under its name as netCDF and CSV, and ``ensemble.png``; returns the
    summary."""
    check(scene, engines)
    options = read(Options, scene.options, scene.file, "options")
    tables = [scene.table(), merged_tables(scene.table(), options.other)][: 2 if options.other else 1]
    ensembles, results, blocks = [], dict[str, Result](), PathBlocks(RUNS_PER_BLOCK)
    report_progress("loading", 0.0)  # compiles what is not compiled yet, once and not in every worker
    scenes = [build(table, scene.file, Path(scene.folder)) for table in tables]
    singles = [drive(scene_of_ensemble, procedure=options.procedure, error=scene.error) for scene_of_ensemble in scenes]
    with Crew.of(scene).at_work(blocks.count(options.runs), *folders_for_workers(scene)) as pool:
        for i, table in enumerate(tables):
            job = StopEnsemble(
                table, scene.file, scene.folder, options.procedure, options.speed_spread, options.seed + i
            )

            def tell(ensemble_progress: Done, ensemble_number: int = i) -> None:
                report_progress(
                    f"{options.names[ensemble_number]}: {ensemble_progress}",
                    (ensemble_number + ensemble_progress.done / ensemble_progress.paths) / len(tables),
                )

            store = output_folder / BLOCKS_FOLDER / options.names[i]
            ensembles.append(run_paths(job, options.runs, store, pool, blocks, tell))
    units = {"speed": "m/s", **{key: label.partition("[")[2][:-1] for key, label in SAVED_QUANTITIES.items()}}
    scatters = [{key: scatter_of(arrays[key]) for key in SAVED_QUANTITIES} for arrays in ensembles]
    for name, scene_of_ensemble, single, arrays, means in zip(
        options.names, scenes, singles, ensembles, scatters, strict=False
    ):
        channels = {key: Channel("stop", arrays[key], unit) for key, unit in units.items()}
        stops = joined_result(result(scene_of_ensemble, channels, {}, engine="reference"), {"one stop": single})
        results[name] = with_sampling_error(stops, statistical_errors(means), options.runs)
        stops.save(output_folder / f"{name}.nc")
        stops.save_table(output_folder / f"{name}.csv")
    tests = (
        {key: welch_test(scatters[0][key], scatters[1][key]) for key in SAVED_QUANTITIES} if len(ensembles) > 1 else {}
    )
    _figure(scene, options, ensembles, scatters, tests, results, output_folder)
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": {},
        "results": results,
        "table": ensemble_lines(options, scatters, tests),
        "answer": {
            "means": [{key: means[key].mean for key in SAVED_QUANTITIES} for means in scatters],
            "p": {key: test.p_value for key, test in tests.items()},
        },
    }


def ensemble_lines(
    study_options: Options, scatters_of_ensembles: list[dict[str, SampleScatter]], welch_tests: dict[str, WelchResult]
) -> list[str]:
    """Lines for the screen: means with standard errors, scatter, and Welch's test of the difference."""
    lines = [
        f"  {study_options.runs} stops in each ensemble, "
        f"initial speed scatters by {100 * study_options.speed_spread:g} %",
        "    "
        + " " * 26
        + "".join(
            f"{name + ': mean':>24}{'scatter':>10}"
            for name, _ in zip(study_options.names, scatters_of_ensembles, strict=False)
        ),
    ]
    for key, label in SAVED_QUANTITIES.items():
        parts = "".join(
            f"{figures[key].mean:>14.3f} +- {figures[key].error:<6.3f}{figures[key].deviation:>10.3f}"
            for figures in scatters_of_ensembles
        )
        lines.append(f"    {label:<26}{parts}")
    for key in welch_tests:
        test = welch_tests[key]
        if np.isfinite(test.t) and test.half_width > 0.0:
            lines.append(
                f"  difference of {SAVED_QUANTITIES[key]}: {test.difference:+.3f}, 95 % interval "
                f"+-{test.half_width:.3f}; Welch's t = {test.t:.2f}, {test.freedoms:.0f} degrees of freedom, "
                f"p = {test.p_value:.2g}"
            )
    return lines


def _figure(
    scene: BrakingScene,
    study_options: Options,
    ensembles: list[dict[str, np.ndarray]],
    scatters_of_ensembles: list[dict[str, SampleScatter]],
    welch_tests: dict[str, WelchResult],
    shown_results: Results,
    output_folder: Path,
) -> None:
    from models.drawing.figures import COLUMN_WIDTH, DARK, add_heading, legend_below, save, subplots

    figure, (histogram, cloud) = subplots(1, 2, figsize=(COLUMN_WIDTH, 4.0))
    edges = np.histogram_bin_edges(np.concatenate([arrays["distance"] for arrays in ensembles]), bins=24)
    for i, (arrays, figures) in enumerate(zip(ensembles, scatters_of_ensembles, strict=True)):
        distance = figures["distance"]
        label = f"{study_options.names[i]}: {distance.mean:.2f} m, scatter {distance.deviation:.2f} m"
        histogram.hist(arrays["distance"], edges, color=f"C{i}", alpha=0.5, label=label)
        histogram.axvline(distance.mean, color=f"C{i}")
        cloud.plot(arrays["speed"], arrays["distance"], "o", ms=3, color=f"C{i}", alpha=0.6)
    speeds = np.sort(ensembles[0]["speed"])
    cloud.plot(
        speeds,
        scatters_of_ensembles[0]["distance"].mean * (speeds / speeds.mean()) ** 2,
        color=DARK,
        lw=0.9,
        label="by the square of the speed alone",
    )
    test_text = f"; Welch's test of the means: p = {welch_tests['distance'].p_value:.2g}" if welch_tests else ""
    histogram.set(xlabel="stopping distance [m]", ylabel="stops [-]", title="Stopping distances and their means")
    cloud.set(xlabel="initial speed [m/s]", ylabel="stopping distance [m]", title="More scatters than the speed")
    legend_below(figure, histogram, cloud, column_count=2)
    add_heading(figure, f"{scene.title}: {study_options.runs} stops each{test_text}", shown_results)
    save(figure, output_folder / "ensemble.png")


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("braking_ensemble")
