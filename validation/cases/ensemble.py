"""Thousands of noise paths: equal bits whatever computes them, computing time and memory, and the scatter of the
paths."""

import time
from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from models.ensemble.runner import PathBlocks, run_paths
from models.ensemble.statistics import deviation_with_error, percentiles, quantile_with_interval
from models.ensemble.store import ArraysByName
from models.ensemble.workers import process_pool
from models.systems.pitch_plane.noise_paths import NoisePaths, largest_difference, mujoco_threads, noise_paths
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import Scene
from validation.common.peak_memory import peak_memory
from validation.common.rows import CaseAnswer, Drawn, Observed, Row, Saved, System, Table, behaviour_row
from validation.common.scenes import force_scene, virtual_drive

TITLE = "Noise paths by the thousand"
SYSTEM: System = "drift"
SEED = 17
NOISE_DEVIATION = 35.0
"""Standard deviation (N) of the noise on each force sample: 0.2 % of the largest force on the study road."""
TIME_STEP = 1e-3
LARGE_ENSEMBLE_PATHS, LARGE_ENSEMBLE_SECONDS = 10_000, 60.0
"""Number of paths and their length (s) in the large ensemble."""
RECOMPUTED_PATH_COUNT = 200
"""Number of paths that are computed again by one worker, and by a run that is killed and resumed."""
TARGET_SECONDS, TARGET_MEMORY = 120.0, 2e9
"""Target computing time (s) and memory (bytes) of the large ensemble on two cores."""
STATE_BYTES, TIME_BYTES = 8 * 8, 2 * 8
"""Bytes of a saved state, and of a path's saved times of drift-off and of failure."""
TABLE_TIMES = (1.0, 2.0, 5.0, 10.0, 15.0)
"""Times (s) in the table of standard deviations."""
SAME_BITS = "the same bits"


def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows on equal bits by path, workers and interruption, and on the agreement of engines; a full run also has the
    large ensemble and computing times."""
    with TemporaryDirectory() as name:
        forces, duration = Path(name), 1.0 if quick else LARGE_ENSEMBLE_SECONDS
        measured = virtual_drive(forces, duration, TIME_STEP, TIME_STEP)
        truth = measured["pitch"]
        scene, times = _noisy_scene(forces, duration), np.arange(0.0, duration + 0.5)
        job = noise_paths(scene, times, truth)
        if quick:
            return _quick_rows(forces, scene, job, times), {}
        large = _in_separate_process(_simulate_large_ensemble, job, LARGE_ENSEMBLE_PATHS, forces / "large")
        paths = large.pop("found")
        rows = [_single_run_row(forces, duration, paths), *_large_ensemble_rows(large)]
        with process_pool(2) as pool:
            again, half = pool.submit(run_paths, job, RECOMPUTED_PATH_COUNT), pool.submit(_half_step_row, forces)
            killed = _killed_run_row(job, paths, forces / "killed")
            rows += [
                _equal_bits_row(
                    "workers",
                    f"{RECOMPUTED_PATH_COUNT} paths have the same bits with 1 worker and with 2",
                    paths,
                    again.result(),
                ),
                killed,
            ]
            halved = half.result()  # nothing else runs while the engines are timed
            engines, prices = _engine_rows_and_times(scene, truth, times, paths, 4, pool)
        prices = {"reference, 2 processes": large["seconds"] / large["path-steps"], **prices}
        rows += [*engines, halved, *_wall_time_rows(prices)]
        return rows, _data_for_tables_and_figure(measured.states, times, paths, large, prices)


def _noisy_scene(force_folder: Path, duration: float, noise_path: int = 0, time_step: float = TIME_STEP) -> Scene:
    """Scene of the force-excited vehicle on one path of force noise."""
    noise = {"force_noise": {"deviation": NOISE_DEVIATION, "seed": SEED, "path": noise_path}}
    return force_scene(force_folder, duration=duration, step=time_step, effects=noise)


def _quick_rows(force_folder: Path, scene: Scene, ensemble_job: NoisePaths, output_times: np.ndarray) -> list[Row]:
    """Rows of a quick run: a few paths of one second, computed in threads because these start at once."""
    paths = run_paths(ensemble_job, 12)
    with ThreadPoolExecutor(2) as pool:
        two = run_paths(ensemble_job, 12, executor=pool, path_blocks=PathBlocks(3))
    engines, _ = _engine_rows_and_times(scene, ensemble_job.truth, output_times, paths, 2, None)
    return [
        _single_run_row(force_folder, 1.0, paths),
        _equal_bits_row("workers", "12 paths have the same bits with 1 worker and with 2", paths, two),
        _interrupted_run_row(ensemble_job, paths, force_folder / "stopped"),
        *engines,
    ]


def _single_run_row(force_folder: Path, duration: float, simulated_paths: ArraysByName) -> Row:
    """Row: path 7 of the ensemble equals a single run of the scene with ``path = 7``."""
    alone = simulate(_noisy_scene(force_folder, duration, noise_path=7), "reference")
    worst = float(np.abs(alone.states[:: round(1.0 / TIME_STEP)] - simulated_paths["states"][7]).max())
    return Observed(
        "ensemble.path",
        SYSTEM,
        "largest difference in any state between path 7 of the ensemble and the scene with path = 7",
        worst,
        "m, rad, m/s, rad/s",
    ).within(0.0, 0.0, "the same samples through the same march: the same bits", "shared kernel")


def _equal_bits_row(
    row_name: str, title: str, simulated_paths: ArraysByName, other_simulated_paths: ArraysByName
) -> Row:
    """Row: two ensembles are equal to the last bit."""
    count = len(other_simulated_paths["drift_off"])
    equal = all(
        np.array_equal(simulated_paths[name][:count], other_simulated_paths[name], equal_nan=True)
        for name in simulated_paths
    )
    return behaviour_row(
        f"ensemble.{row_name}",
        SYSTEM,
        title,
        SAME_BITS if equal else "different bits",
        SAME_BITS,
        "a sample belongs to seed, path and place alone",
        "shared kernel",
    )


def _interrupted_run_row(ensemble_job: NoisePaths, simulated_paths: ArraysByName, block_folder: Path) -> Row:
    """Row: an interrupted run that is continued gives the same ensemble."""

    def interrupt_half_way(run_progress: Any) -> None:
        if run_progress.done >= 6:
            raise KeyboardInterrupt

    try:
        run_paths(ensemble_job, 12, block_folder, path_blocks=PathBlocks(3), report_progress=interrupt_half_way)
    except KeyboardInterrupt:
        again = run_paths(ensemble_job, 12, block_folder, path_blocks=PathBlocks(3))
        return _equal_bits_row(
            "resumed",
            "12 paths have the same bits if they are interrupted half-way and resumed",
            simulated_paths,
            again,
        )
    raise AssertionError("the interrupt was lost")


def _killed_run_row(ensemble_job: NoisePaths, simulated_paths: ArraysByName, block_folder: Path) -> Row:
    """Row: a run is killed after two of its blocks, then resumed, and must give the same ensemble."""
    child = get_context("spawn").Process(target=_run_slow_job, args=(ensemble_job, block_folder))
    child.start()
    while child.is_alive() and len(list(block_folder.glob("block*.npz"))) < 2:
        time.sleep(0.02)
    child.kill()
    child.join()
    modification_times = {path: path.stat().st_mtime_ns for path in block_folder.glob("block*.npz")}
    again = run_paths(ensemble_job, RECOMPUTED_PATH_COUNT, block_folder, path_blocks=PathBlocks(20))
    if (
        not modification_times
        or len(modification_times) == RECOMPUTED_PATH_COUNT // 20
        or any(path.stat().st_mtime_ns != when for path, when in modification_times.items())
    ):
        raise AssertionError(f"not killed half-way, or computed again: {len(modification_times)} blocks were kept")
    return _equal_bits_row(
        "resumed",
        f"{RECOMPUTED_PATH_COUNT} paths, killed half-way and resumed: the kept blocks are not touched, the "
        "whole is compared with a run in one piece",
        simulated_paths,
        again,
    )


def _run_slow_job(ensemble_job: NoisePaths, block_folder: Path) -> None:
    """Compute an ensemble that waits after each block, so that the run can be killed in between."""
    run_paths(
        ensemble_job,
        RECOMPUTED_PATH_COUNT,
        block_folder,
        path_blocks=PathBlocks(20),
        report_progress=lambda state: time.sleep(0.1),
    )


def _in_separate_process(called_function: Callable[..., Any], *arguments: Any) -> Any:
    """Value of a function that is run in a separate process, so that its memory can be measured alone."""
    with process_pool(1) as pool:
        return pool.submit(called_function, *arguments).result()


def _simulate_large_ensemble(ensemble_job: NoisePaths, noise_path_count: int, block_folder: Path) -> Saved:
    """A large ensemble with its computing time (s) and the peak memory (bytes) of this process and its workers."""
    import resource

    start = time.perf_counter()
    with process_pool(2) as pool:
        paths = run_paths(ensemble_job, noise_path_count, block_folder, pool)
    seconds = time.perf_counter() - start
    parent, child = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    busy = parent.ru_utime + parent.ru_stime + child.ru_utime + child.ru_stime
    bytes_per_path = sum(values.nbytes for values in paths.values()) / len(paths["drift_off"])
    most = peak_memory() + 2048 * child.ru_maxrss
    return {
        "found": paths,
        "seconds": seconds,
        "busy": busy,
        "kept": bytes_per_path,
        "bytes": most,
        "path-steps": len(paths["drift_off"]) * ensemble_job.settings.steps,
        "failed": int((paths["failed"] >= 0).sum()),
    }


def _large_ensemble_rows(large_ensemble: Saved) -> list[Row]:
    """Rows: steps, computing time and memory of the large ensemble."""
    what = f"{LARGE_ENSEMBLE_PATHS:,} paths of {LARGE_ENSEMBLE_SECONDS:g} s at 1 kHz in the reference, 2 processes"
    share = f"{50.0 * large_ensemble['busy'] / large_ensemble['seconds']:.0f} % of two cores"
    counted = (
        (
            "path-steps",
            "steps of all paths",
            float(large_ensemble["path-steps"]),
            "",
            LARGE_ENSEMBLE_PATHS * LARGE_ENSEMBLE_SECONDS / TIME_STEP,
            "a count",
        ),
        (
            "failed",
            "paths that left all bounds",
            float(large_ensemble["failed"]),
            "",
            0.0,
            "a tumbling vehicle stays finite",
        ),
        (
            "kept",
            "bytes of results, by paths",
            large_ensemble["kept"],
            "byte",
            STATE_BYTES * (LARGE_ENSEMBLE_SECONDS + 1.0) + TIME_BYTES,
            "a count: a state of eight numbers every second, and when it drifts off or fails",
        ),
    )
    aimed = (
        (
            "seconds",
            f"start of the processes to the last path, once, with {share}",
            large_ensemble["seconds"],
            "s",
            TARGET_SECONDS,
            "target on two free cores; what other programs take of them adds to it",
        ),
        (
            "processor",
            "processor time of all processes by two cores, once",
            large_ensemble["busy"] / 2,
            "s",
            TARGET_SECONDS,
            "what it takes on two free cores, whoever else uses them now",
        ),
        (
            "memory",
            "largest memory of all processes together, once",
            large_ensemble["bytes"],
            "byte",
            TARGET_MEMORY,
            "target; libraries included, of which a machine's own are a part",
        ),
    )
    steps, failed, bytes_kept = (
        Observed(f"ensemble.scale.{id}", SYSTEM, f"{what}: {words}", value, unit).within(expected, 0.0, why, "none")
        for id, words, value, unit, expected, why in counted
    )
    aims = [
        Observed(f"ensemble.scale.{id}", SYSTEM, f"{what}: {words}", value, unit).aim(bound, why)
        for id, words, value, unit, bound, why in aimed
    ]
    return [steps, failed, *aims, bytes_kept]


def _engine_rows_and_times(
    scene: Scene,
    true_pitch: np.ndarray,
    output_times: np.ndarray,
    reference_paths: ArraysByName,
    noise_path_count: int,
    worker_pool: Executor | None,
) -> tuple[list[Row], dict[str, float]]:
    """Rows on the agreement of the first paths between engines, and the wall time (s) per path and step of each
    engine."""
    exudyn = noise_paths(scene, output_times, true_pitch, engine="exudyn")
    single, two = (
        mujoco_threads(scene, output_times, true_pitch, thread_count=thread_count) for thread_count in (1, 2)
    )
    jobs_by_method: dict[str, Callable[[], ArraysByName]] = {
        "mujoco, 1 thread": lambda: run_paths(single, noise_path_count),
        "mujoco, 2 threads": lambda: run_paths(two, noise_path_count),
        "exudyn, 2 processes" if worker_pool else "exudyn": lambda: run_paths(
            exudyn, noise_path_count, executor=worker_pool, path_blocks=PathBlocks(1)
        ),
    }
    rows, prices = [], {}
    for method_name, job in jobs_by_method.items():
        start = time.perf_counter()
        paths = job()
        prices[method_name] = (time.perf_counter() - start) / (noise_path_count * (len(true_pitch) - 1))
        what = (
            f"largest difference of {noise_path_count} paths in {method_name} from the reference before drift-off, "
            "over the largest state"
        )
        rows.append(
            Observed(
                f"ensemble.engines.{_method_in_row_id(method_name)}",
                SYSTEM,
                what,
                largest_difference(reference_paths, paths, output_times),
                "",
            ).at_most(1e-9, "the same tableau on the same samples: rounding, grown by the instability", "native")
        )
    return rows, prices


def _wall_time_rows(seconds_by_method: dict[str, float]) -> list[Row]:
    """Rows: wall time per path and step of every engine."""
    return [
        Observed(
            f"ensemble.price.{_method_in_row_id(method_name)}",
            SYSTEM,
            f"wall time per path and step, {method_name}, measured once",
            1e9 * price,
            "ns",
        ).beside("", "seconds are reported", "none")
        for method_name, price in seconds_by_method.items()
    ]


def _method_in_row_id(method_name: str) -> str:
    """Name of a method as part of a row id."""
    return method_name.replace(", ", ".").replace(" ", "-")


def _half_step_row(force_folder: Path) -> Row:
    """Row: change of the pitch when the step is halved. The noise samples stay the same, so only the integrator's error
    changes."""
    pitch = [
        run_paths(noise_paths(_noisy_scene(force_folder, 10.0, time_step=step), np.array([10.0])), 100)["states"][
            :, 0, 3
        ]
        for step in (TIME_STEP, TIME_STEP / 2)
    ]
    change = float(np.abs(pitch[0] - pitch[1]).max() / pitch[1].std())
    return Observed(
        "ensemble.half-step",
        SYSTEM,
        "largest difference of 100 paths' pitch at 10 s between steps of 1 and 0.5 ms, over the standard deviation",
        change,
        "",
    ).at_most(1e-4, "the samples are the same, so only the integrator's error differs", "shared kernel")


def _data_for_tables_and_figure(
    true_pitch: np.ndarray,
    output_times: np.ndarray,
    simulated_paths: ArraysByName,
    large_ensemble: Saved,
    seconds_by_method: dict[str, float],
) -> Saved:
    """Saved numbers for the tables and the figure."""
    errors = simulated_paths["states"] - true_pitch[:: round(1.0 / TIME_STEP)]
    spreads = [
        [when, *deviation_with_error(errors[:, round(when), 3]), *deviation_with_error(errors[:, round(when), 2])]
        for when in TABLE_TIMES
    ]
    quantiles = [[level, *quantile_with_interval(simulated_paths["drift_off"], level)] for level in (0.05, 0.5, 0.95)]
    counts, edges = np.histogram(simulated_paths["drift_off"], bins=np.arange(0.0, 31.0, 0.5))
    fan = percentiles(errors[:, 1:, 3])
    return {
        "spreads": spreads,
        "quantiles": quantiles,
        "prices": seconds_by_method,
        "large": large_ensemble,
        "times": output_times[1:].tolist(),
        "counts": counts.tolist(),
        "edges": edges.tolist(),
        "fan": fan.tolist(),
    }


def tables(case_data: Saved) -> list[Table]:
    """Tables of standard deviations, drift-off times and computing times; none after a quick run."""
    if not case_data:
        return []
    paths = (
        f"{LARGE_ENSEMBLE_PATHS:,} paths of {LARGE_ENSEMBLE_SECONDS:g} s, noise {NOISE_DEVIATION:g} N at 1 kHz "
        "on the study road"
    )
    spreads = tuple(
        (f"{when:g}", f"{pitch:.4e} +- {e:.0e}", f"{heave:.4e} +- {o:.0e}")
        for when, pitch, e, heave, o in case_data["spreads"]
    )
    times = tuple(
        (f"{100 * level:g} %", f"{value:.2f}", f"{low:.2f} to {high:.2f}")
        for level, value, low, high in case_data["quantiles"]
    )
    prices = tuple(
        (
            method_name,
            f"{1e9 * price:,.0f}",
            f"{price * LARGE_ENSEMBLE_PATHS * LARGE_ENSEMBLE_SECONDS / TIME_STEP / 60:,.1f}",
        )
        for method_name, price in case_data["prices"].items()
    )
    return [
        Table(
            "Spread of the paths",
            f"{paths}; standard deviation with its standard error.",
            ("time [s]", "pitch [rad]", "heave [m]"),
            spreads,
        ),
        Table(
            "Drift-off times",
            "First time at which the pitch is 0.05 rad wrong; 95 % intervals by order statistics.",
            ("quantile", "time [s]", "interval [s]"),
            times,
        ),
        Table(
            "Price of a path",
            f"Wall time on two cores, once; the last column is {LARGE_ENSEMBLE_PATHS:,} paths of "
            f"{LARGE_ENSEMBLE_SECONDS:g} s.",
            ("way", "per path and step [ns]", "all of them [min]"),
            prices,
        ),
    ]


def draw(case_data: Saved) -> Drawn:
    """Plot the percentiles of the pitch error over time, and a histogram of the drift-off times."""
    if not case_data:
        return []
    from models.drawing.drift import draw_quantile_bands
    from models.drawing.figures import BLUE, COLUMN_WIDTH, add_heading, subplots

    figure, (fan, histogram) = subplots(1, 2, figsize=(COLUMN_WIDTH, 3.6), width_ratios=(3, 2))
    draw_quantile_bands(fan, np.array(case_data["times"]), np.array(case_data["fan"]))
    fan.legend(loc="lower right")
    histogram.stairs(case_data["counts"], case_data["edges"], fill=True, color=BLUE, alpha=0.6)
    histogram.set_title("Drift-offs: paths per half second [-]")
    for axis in (fan, histogram):
        axis.set_xlabel("time [s]")
    add_heading(figure, f"One measured run, {LARGE_ENSEMBLE_PATHS:,} samples of its noise: how far its pitch is off")
    return [
        (
            f"{LARGE_ENSEMBLE_PATHS:,} noise paths in the reference: how the pitch error spreads, and when paths "
            "drift off.",
            figure,
        )
    ]
