"""The paper's J-turn on ice: friction and steer angle are fitted to two published figures, the others are compared.

A calibration, no validation: the paper prints neither its tyre matrices nor its steer angle.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.core.discretisation import with_sampling_error
from models.core.errors import InputError, RunFailed
from models.core.result import Channel, result
from models.core.strict import Strict, quantity, read
from models.core.whole_files import write_whole
from models.ensemble.runner import PathBlocks, run_paths
from models.ensemble.workers import Crew, folders_for_workers
from models.systems.braking.plan import check_reference
from models.systems.braking.run import run as drive
from models.systems.braking.scene import BrakingScene
from models.systems.braking.stops import SampleScatter, StopEnsemble, scatter_of, statistical_errors

SYSTEM = "braking"
ReportProgress = Callable[[str, float], None]
PAPER_VALUES = {
    "deceleration": ("mean deceleration v0/T [m/s^2]", "1.36 +- 0.02", "1.37 +- 0.4", "fitted"),
    "aside": ("y-displacement [m]", "7.5 +- 0.7", "7.2 +- 0.3", "fitted"),
    "distance": ("stopping distance [m]", "44.4 +- 1.2", "44.4 +- 0.5", "compared"),
    "time": ("stopping time [s]", "8.15 in one run", "", "compared"),
    "yaw": ("final yaw [deg]", "21.3 in one run, a guessed reading", "", "compared"),
}
"""Published figures of the paper: label, simulated value, measured value, and use here. The printed "0.4" is probably
0.04."""
QUANTITIES_OF_ROUND = {"scale": "", "steer": "rad", "deceleration": "m/s^2", "aside": "m"}
"""Unit of each quantity that is saved for every round of the fit."""
STOPS_PER_BLOCK = 2
"""Number of stops in a block that a worker computes."""
FITTED_FIGURES = {"deceleration": 1.36, "aside": 7.5}


class Options(Strict):
    """Keys of the table [options] of this study."""

    procedure: str = Field("j_turn", description="name of the J-turn")
    surface: str = Field("ice", description="whose friction is fitted")
    runs: int = Field(10, ge=2, le=1000, description="stops of which the means are fitted")
    last: int = Field(40, ge=2, le=1000, description="stops of which the results are the means")
    rounds: int = Field(6, ge=1, le=50, description="of the fit")
    speed_spread: float = quantity("", "standard deviation of the initial speed, relative", default=0.002, zero=True)
    seed: int = Field(1, ge=0, le=2**62, description="of the speeds")


def check(scene: BrakingScene, engines: tuple[str, ...]) -> None:
    """Raise InputError if the procedure is no J-turn with a positive constant steer angle."""
    check_reference(scene, engines)
    options = read(Options, scene.options, scene.file, "options")
    procedure = scene.procedures.get(options.procedure)
    if procedure is None or procedure.kind != "j_turn":
        names = tuple(name for name, turn in scene.procedures.items() if turn.kind == "j_turn")
        raise InputError(scene.file, "options.procedure", options.procedure, "must be a J-turn of the scene", names)
    if procedure.steer is None:
        allowed = "has no meaning here: one angle is fitted, steer"
        raise InputError(scene.file, f"procedures.{options.procedure}.steering", procedure.steering, allowed)
    if procedure.steer <= 0.0:
        raise InputError(
            scene.file, f"procedures.{options.procedure}.steer", procedure.steer, "must be above 0 to be fitted"
        )


def run(
    scene: BrakingScene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Fit friction and steer angle, and repeat the stops with them; saves the fit as ``rounds.nc`` and
    ``calibration.csv``, a fitted stop as ``calibration.nc`` and ``calibration.png``, and returns the summary."""
    from studies.braking_figures import stop_figure

    check(scene, engines)
    options = read(Options, scene.options, scene.file, "options")
    steer = scene.procedures[options.procedure].steer
    assert steer is not None
    scale, steps = scene.tyres.scale.get(options.surface, 1.0), []
    report_progress("loading", 0.0)
    drive(scene, procedure=options.procedure)  # compiles what is not compiled yet, once and not in every worker
    with Crew.of(scene).at_work(options.runs, *folders_for_workers(scene)) as pool:
        for i in range(options.rounds):
            report_progress(f"fit, round {i + 1}", i / (options.rounds + 2))
            means = _means_of_stops(fitted_scene(scene, options, scale, steer), options, options.runs, pool)
            steps.append((scale, steer, means["deceleration"].mean, means["aside"].mean))
            scale *= FITTED_FIGURES["deceleration"] / means["deceleration"].mean
            steer *= FITTED_FIGURES["aside"] / means["aside"].mean
        report_progress("as fitted", options.rounds / (options.rounds + 2))
        fitted = fitted_scene(scene, options, scale, steer)
        scatters = _means_of_stops(fitted, options, options.last, pool, options.seed + 1)
    columns = zip(QUANTITIES_OF_ROUND.items(), np.array(steps).T, strict=True)
    rounds = {name: Channel("round", values, unit) for (name, unit), values in columns}
    by_rounds = with_sampling_error(
        result(scene, rounds, {}, engine="reference"), statistical_errors(means), options.runs
    )
    by_rounds.save(output_folder / "rounds.nc")
    heads = (f"{name} [{unit}]" if unit else name for name, unit in QUANTITIES_OF_ROUND.items())
    rows = [",".join(heads), *(",".join(f"{value:.9g}" for value in step) for step in steps)]
    write_whole(output_folder / "calibration.csv", "\n".join(rows) + "\n")
    stop = drive(fitted, procedure=options.procedure, error=scene.error)
    stop.save(output_folder / "calibration.nc")
    stop_figure(fitted, options.procedure, {"as fitted": stop}, output_folder / "calibration.png")
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": {},
        "results": {"rounds": by_rounds, "as fitted": stop},
        "table": calibration_lines(options, scale, steer, scatters),
        "answer": {"scale": scale, "steer": steer, **{key: figure.mean for key, figure in scatters.items()}},
    }


def fitted_scene(
    scene: BrakingScene, study_options: Options, friction_scale: float, steer_angle: float
) -> BrakingScene:
    """The scene with a friction factor of the surface and a steer angle (rad); raises RunFailed if the fit left their
    possible range."""
    if not (0.05 < friction_scale < 2.0 and steer_angle < 1.0):
        raise RunFailed(
            "calibration", f"the fit diverges: friction times {friction_scale:.3g}, steer angle {steer_angle:.3g} rad"
        )
    procedure = scene.procedures[study_options.procedure].model_copy(update={"steer": steer_angle})
    tyres = scene.tyres.model_copy(update={"scale": {**scene.tyres.scale, study_options.surface: friction_scale}})
    return scene.model_copy(
        update={"tyres": tyres, "procedures": {**scene.procedures, study_options.procedure: procedure}}
    )


def _means_of_stops(
    scene: BrakingScene, study_options: Options, run_count: int, worker_pool: Any, seed: int | None = None
) -> dict[str, SampleScatter]:
    job = StopEnsemble(
        scene.table(),
        scene.file,
        scene.folder,
        study_options.procedure,
        study_options.speed_spread,
        study_options.seed if seed is None else seed,
    )
    stops = run_paths(job, run_count, executor=worker_pool, path_blocks=PathBlocks(STOPS_PER_BLOCK))
    return {key: scatter_of(stops[key]) for key in PAPER_VALUES}


def calibration_lines(
    study_options: Options, friction_scale: float, steer_angle: float, scatter_by_figure: dict[str, SampleScatter]
) -> list[str]:
    """Lines for the screen: the fitted parameters, and each figure beside the paper's values."""
    lines = [
        f"  calibration: friction of {study_options.surface} times {friction_scale:.4f}, "
        f"steer angle {steer_angle:.5f} rad",
        f"  means of {study_options.last} stops, +- the scatter of one",
        f"    {'':<34}{'here':>18}   {'paper, simulated':<36}{'paper, measured':<18}",
    ]
    for key, (label, simulated, measured, kind_of_value) in PAPER_VALUES.items():
        simulated_here = f"{scatter_by_figure[key].mean:.3f} +- {scatter_by_figure[key].deviation:.3f}"
        lines.append(f"    {label:<34}{simulated_here:>18}   {simulated:<36}{measured:<18}{kind_of_value}")
    return lines


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("braking_calibration")
