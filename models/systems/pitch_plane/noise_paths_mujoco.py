"""The same noise paths in MuJoCo's own threads: one model per path, one callback for all of them.

MuJoCo's callbacks are global to a process, so its runs cannot each bring their own into several Python threads. Here
the compiled callback is installed once and ``rollout`` shares the models, each of which holds its path's forces as
a table, among its threads. Exudyn, and anything else, runs in processes: ``noise_paths(..., engine="exudyn")`` on
``runner.processes``.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from models.core.errors import InputError, RunFailed
from models.engines.protocol import Trajectory, build, guard
from models.ensemble.store import Arrays
from models.systems.pitch_plane.noise_paths import DRIFT, NoisePaths, noise_paths
from models.systems.pitch_plane.scene import Scene


@dataclass(frozen=True)
class MujocoThreads(NoisePaths):
    """Noise paths whose blocks MuJoCo computes with this many threads; the bits do not depend on their number."""

    threads: int = 2

    def __post_init__(self) -> None:
        if self.engine != "mujoco" or self.base.guided:
            raise InputError(self.base.scene.file, "engine", self.engine, "only free runs of mujoco have its threads")

    def runs(self, paths: range) -> Iterator[Trajectory | RunFailed]:
        """Every path's run, from one call of ``rollout``; a path that MuJoCo warned of is run again alone."""
        models = [build("mujoco", self.assembly(path), self.settings) for path in paths]
        times = self.settings.step * np.arange(self.settings.steps + 1)
        marched, warned = self._rollout(models)
        if warned:
            yield from super().runs(paths)
            return
        for states in marched:
            try:
                guard("mujoco", times, states, self.settings.duration)
                yield Trajectory(times, states)
            except RunFailed as error:
                yield error

    def _rollout(self, models: list[Any]) -> tuple[np.ndarray, bool]:
        """States (paths, steps + 1, 8) of all models, and whether MuJoCo warned of anything."""
        from mujoco import rollout

        from models.engines.mujoco_quiet import quiet

        start = np.concatenate(([0.0], self.base.initial))
        controls = None
        if models[0].drive.controls is not None:
            controls = np.concatenate([model.padded(model.drive.controls) for model in models])
        working = models[: self.threads]
        with models[0].callback(), quiet():
            found, _ = rollout.rollout(
                [model.model for model in models],
                [model.data for model in working],
                np.tile(start, (len(models), 1)),
                control=controls,
                nstep=self.settings.steps,
            )
        states = np.concatenate((np.tile(self.base.initial, (len(models), 1, 1)), found[:, :, 1:9]), axis=1)
        return states, any(model.warnings() for model in working)

    def facts(self) -> dict[str, Any]:
        """As of all noise paths."""
        return {**super().facts(), "way": "threads"}


def mujoco_threads(
    scene: Scene, times: np.ndarray, truth: np.ndarray | None = None, threshold: float = DRIFT, threads: int = 2
) -> MujocoThreads:
    """The job of ``noise_paths`` in MuJoCo's threads."""
    return MujocoThreads(**vars(noise_paths(scene, times, truth, threshold, "mujoco")), threads=threads)


def gap(reference: Arrays, other: Arrays, times: np.ndarray) -> float:
    """Largest difference of any state before both paths' drift-off, by the reference's largest state there.

    reference, other : arrays of ``NoisePaths`` of which the second may hold fewer paths; times (rows,) in s. After
    drift-off a rounding error is as large as the run, and no comparison says anything; nan where all paths have
    drifted off before the first row past the start.
    """
    count = len(other["states"])
    until = np.minimum(reference["drift_off"][:count], other["drift_off"])
    if not (times[times > 0.0] < until[:, None]).any():
        return math.nan
    one = np.where((times < until[:, None])[:, :, None], reference["states"][:count], 0.0)
    two = np.where((times < until[:, None])[:, :, None], other["states"], 0.0)
    return float(np.abs(one - two).max() / np.abs(one).max())
