"""Runs in MuJoCo's own loop: a single run with checks on the way, or many runs at once in several threads."""

from collections.abc import Iterator

import mujoco
import numpy as np
from mujoco import rollout

from models.core.errors import RunFailed
from models.core.waiting import report_simulation_progress
from models.engines.mujoco_quiet import without_warnings
from models.engines.protocol import check_trajectory

STEPS_PER_CHUNK = 4096
"""Number of steps between two checks of a run."""
FORCE_CALLS = {"RK4": 4}
"""Force evaluations per step of an integrator; 1 for integrators that are not listed."""
GAVE_UP = "the engine gave up, since the motion grew without bound: shorten the step, or soften what is stiff"
"""Failure message of a run in which MuJoCo reset itself to time zero."""


def warning_text(mujoco_data: mujoco.MjData) -> str:
    """Text that lists MuJoCo's own warnings; empty if there are none."""
    names = [mujoco.mjtWarning(i).name for i in range(len(mujoco_data.warning)) if mujoco_data.warning[i].number]
    return f"; MuJoCo warned {', '.join(names)}" if names else ""


def march(
    mujoco_model: mujoco.MjModel, mujoco_data: mujoco.MjData, start_state: np.ndarray, controls: np.ndarray
) -> np.ndarray:
    """Positions and rates (steps + 1, 2 n) from the state ``start_state`` (2 n,), with controls (steps, nu) held over
    each step, or without controls (steps, 0).

    In chunks, so that a run that has failed is not carried to its end. RunFailed where MuJoCo stops, starts again at
    time zero or warns; the guard names a worse reason if there is one.
    """
    steps, step = len(controls), mujoco_model.opt.timestep
    path, times = np.empty((steps + 1, 1 + start_state.size)), step * np.arange(steps + 1)
    path[0, 0], path[0, 1:] = 0.0, start_state
    for warning in mujoco_data.warning:
        warning.number = 0
    with without_warnings(), report_simulation_progress(lambda: mujoco_data.time / times[-1]):
        for first, last in _chunks(steps):
            rows, held = path[first + 1 : last + 1], controls[None, first:last] if controls.size else None
            rollout.rollout(mujoco_model, mujoco_data, path[None, first], held, nstep=len(rows), state=rows[None])
            late = np.abs(rows[:, 0] - times[first + 1 : last + 1]) > 1e-6 * times[-1]
            if late.any() or warning_text(mujoco_data):
                end = first + (int(np.argmax(late)) if late.any() else len(rows))
                check_trajectory("mujoco", times[: end + 1], path[: end + 1, 1:], times[end])
                raise RunFailed("mujoco", f"{GAVE_UP}{warning_text(mujoco_data)}", times[end], path[end, 1:])
    return path[:, 1:]


def _chunks(step_count: int) -> Iterator[tuple[int, int]]:
    """First and last row of each chunk of a run."""
    for first in range(0, step_count, STEPS_PER_CHUNK):
        yield first, min(first + STEPS_PER_CHUNK, step_count)


class Marcher:
    """Runner of one MuJoCo model, in one thread or several."""

    def __init__(self, compiled_model: mujoco.MjModel, thread_count: int = 1) -> None:
        self.model, self._data = compiled_model, [mujoco.MjData(compiled_model) for _ in range(thread_count)]

    def run(self, start_states: np.ndarray, step_count: int) -> np.ndarray:
        """States (n, steps, 2 m) of n runs that start at ``start_states`` (n, 2 m); RunFailed unless all are finite."""
        whole = np.concatenate((np.zeros((len(start_states), 1)), start_states), axis=1)
        with report_simulation_progress(lambda: self._data[0].time / (step_count * self.model.opt.timestep)):
            path = rollout.rollout(self.model, self._data, whole, nstep=step_count)[0][..., : 1 + 2 * self.model.nv]
        late = path[:, -1, 0] < (step_count - 0.5) * self.model.opt.timestep
        failed = late | ~np.isfinite(path[:, -1]).all(axis=1)  # MuJoCo starts again at time zero where it gives up
        if failed.any():
            failed_path = path[int(failed.argmax())]
            last = failed_path[int(failed_path[:, 0].argmax())]
            raise RunFailed("mujoco", GAVE_UP, float(last[0]), last[1:])
        return path[..., 1:]
