"""Efficiency of two workers that share the blocks of an ensemble, compared with two separate processes.

Rounds alternate, in a random order: two processes that each take half of the blocks in one go and send nothing back,
then the same blocks by two workers through ``models.ensemble.runner``, and through a Dask cluster of this machine where
the extra ``cluster`` is installed. The efficiency is the ratio of the first's seconds to the others', with its 95 %
interval. It says nothing on a machine with fewer than two idle cores.

``python -m validation.price.two_workers [ROUNDS]`` prints it, with the seconds of the processor that a block
costs the command, by the size of what a block sends.
"""

import os
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, wait
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from models.ensemble.runner import PathBlocks, run_paths
from models.ensemble.workers import dask_workers, process_pool
from models.machine.timing import bootstrap_median, interleave, paired_ratio
from models.systems.pitch_plane.noise_paths import noise_paths
from models.systems.pitch_plane.run import run
from models.systems.pitch_plane.virtual_measurement import write_measurement
from validation.common.scenes import force_scene, road_scene

TIMING_ROUNDS = 9
PATHS_PER_RUN, BLOCKS_OF_RUN = 400, PathBlocks(25)
"""Number of paths of a timed run, and their blocks: about 3 s by two workers, and 8 blocks each."""
SENT_COUNTS = (1_000, 50_000, 500_000)
"""Numbers of values that a block sends back, for which its cost is measured."""
EMPTY_BLOCKS = 100
"""Number of blocks that compute nothing and only send values, over which a block's cost is averaged."""


def ensemble_job(duration: float = 60.0) -> Any:
    """Ensemble job: noise paths, of 60 s at 1 kHz by default, of the half car on the study road, as ``run ensemble``
    computes them."""
    with TemporaryDirectory() as name:
        write_measurement(run(road_scene(duration=duration), "reference"), Path(name), 1e-3)
        scene = force_scene(Path(name), duration=duration, effects={"force_noise": {"deviation": 30.0, "seed": 3}})
        return noise_paths(scene, np.linspace(0.0, duration, 121))


def compute_blocks(noise_ensemble: Any, block_numbers: list[int]) -> None:
    """Compute the blocks with the given numbers of an ensemble one after the other in this process."""
    for number in block_numbers:
        noise_ensemble(BLOCKS_OF_RUN.block(number, PATHS_PER_RUN))


def compute_in_two_processes(process_pools: list[Executor], noise_ensemble: Any) -> None:
    """Compute an ensemble in two separate processes, each of which computes half of the blocks."""
    count = BLOCKS_OF_RUN.count(PATHS_PER_RUN)
    wait(
        [pool.submit(compute_blocks, noise_ensemble, list(range(i, count, 2))) for i, pool in enumerate(process_pools)]
    )


@dataclass(frozen=True)
class Sender:
    """Ensemble job that computes nothing and sends back ``numbers_per_path`` zeros per path."""

    numbers_per_path: int

    def __call__(self, paths: range) -> dict[str, np.ndarray]:
        """Array "x" (paths, numbers) of zeros."""
        return {"x": np.zeros((len(paths), self.numbers_per_path))}

    def facts(self) -> dict[str, Any]:
        """Settings on which the result of a block depends."""
        return {"numbers": self.numbers_per_path}


def cost_of_blocks(executor: Executor) -> dict[int, float]:
    """Processor time (s) of this process per block, for each number of values that a block sends back."""
    costs = {}
    for numbers in SENT_COUNTS:
        run_paths(Sender(numbers), 4, executor=executor, path_blocks=PathBlocks(1))
        start_time = time.process_time()
        run_paths(Sender(numbers), EMPTY_BLOCKS, executor=executor, path_blocks=PathBlocks(1))
        costs[numbers] = (time.process_time() - start_time) / EMPTY_BLOCKS
    return costs


@contextmanager
def worker_pools() -> Iterator[dict[str, Executor]]:
    """Context that yields pools of two workers by name: processes and, if it is installed, a local Dask cluster."""
    with ExitStack() as stack:
        pools: dict[str, Executor] = {"processes": stack.enter_context(process_pool(2))}
        with suppress(ImportError):
            from distributed import LocalCluster

            local_cluster = LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
            local = stack.enter_context(local_cluster)
            pools["Dask"] = stack.enter_context(dask_workers(local.scheduler_address))
        yield pools


def measured_pools(round_count: int = TIMING_ROUNDS, noise_ensemble: Any = None) -> dict[str, dict[str, Any]]:
    """Measurement of each pool of workers: ``efficiency`` relative to two separate processes and ``seconds`` of a run,
    both with intervals; ``cost`` of a block (s)."""
    noise_ensemble = ensemble_job() if noise_ensemble is None else noise_ensemble
    with ExitStack() as stack, worker_pools() as pools:
        single_pools: list[Executor] = [stack.enter_context(process_pool(1)) for _ in range(2)]
        turns: list[Callable[[], Any]] = [partial(compute_in_two_processes, single_pools, noise_ensemble)]
        turns += [
            partial(run_paths, noise_ensemble, PATHS_PER_RUN, executor=pool, path_blocks=BLOCKS_OF_RUN)
            for pool in pools.values()
        ]
        seconds = interleave(turns, round_count)
        return {
            name: {
                "efficiency": paired_ratio(seconds[0], took),
                "seconds": bootstrap_median(took),
                "cost": cost_of_blocks(pools[name]),
            }
            for name, took in zip(pools, seconds[1:], strict=True)
        }


def measurement_lines(pool_measurements: dict[str, dict[str, Any]]) -> list[str]:
    """Lines of text on the measured efficiency and block costs of each pool of workers."""
    answer = []
    for name, crew in pool_measurements.items():
        ratio, low, high = crew["efficiency"]
        answer.append(
            f"{name}: efficiency {ratio:.3f} ({low:.3f} to {high:.3f}) of two lone processes, "
            f"{crew['seconds'][0]:.2f} s a turn"
        )
        answer += [
            f"  a block of {8e-6 * n:.3g} MB: {1e3 * took:.2f} ms of the command" for n, took in crew["cost"].items()
        ]
    return answer


if __name__ == "__main__":
    print(f"{os.cpu_count()} cores; load before: {os.getloadavg()[0]:.2f}")
    print("\n".join(measurement_lines(measured_pools(int(sys.argv[1]) if sys.argv[1:] else TIMING_ROUNDS))))
