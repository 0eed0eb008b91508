"""Stated errors of a wheelset's results: errors of time steps, and of FASTSIM's cells.

The error of the cells is a hundred times that of the time steps. The error of the cells is estimated by one more path
on half the cells, in twice the step where this is possible. The error of the steps is estimated by a few steps of twice
the length on all cells; it grows along the path as the error of the cells does.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress

import numpy as np

from models.contact.accuracy import LIKELY_ERROR_SHARE, coarser_cells
from models.core.discretisation import (
    FINE_WINDOW,
    Estimate,
    RunSeries,
    grid_error,
    nearest_rows,
    not_estimated,
    reference_size,
    with_estimated_errors,
    with_stated_errors,
)
from models.core.errors import InputError, RunFailed
from models.core.result import Result
from models.rail.equations import YAW, WheelsetPath, Y
from models.rail.limit_cycle import Orbit
from models.systems.wheelset.assumptions import sums_by_wheel
from models.systems.wheelset.scene import LARGEST_CELL_COUNT, WheelsetScene

UNIT_OF_CHANNEL = {"y": "m", "yaw": "rad", "fx": "N", "fy": "N"}
"""Channels whose error is stated, with their units; forces are the sum over the patches of a wheel."""
ROUNDING_SIZE = 1e-12
"""Size of a channel below which its values are rounding (m, rad, or share of the load), as of a centred wheelset;
relative errors refer to at least this size.
"""
RK4_ORDER, KINKED_ORDER = 4, 2.0
"""Order of RK4, and the order that is observed where cells begin to slide one by one: 1 to 4 in random scenes."""
CELL_ERROR_ORDER = 1.5
"""Assumed order of the error of the cells, which falls with the first to the second power of their number."""
HALF_STEP_SHARE, LEAST_STEPS = 0.1, 20
"""Share of the path that is repeated in half the step where twice the step is too long, and its least number of
steps.
"""
FEWEST_CELLS = 5
"""Fewest cells per strip that can be halved."""
SimulatePath = Callable[[WheelsetScene], WheelsetPath]
"""Function that simulates a scene in one engine at one speed, and returns the path."""


def with_error(run_result: Result, scene: WheelsetScene, simulate_path: SimulatePath) -> Result:
    """Returns the result of a path with the stated errors of its principal channels. Raises RunFailed where the errors
    are too large for the result to be used.
    """
    fine, step = principal_series(run_result.detail), scene.run.step
    sizes = _channel_sizes(fine, float(np.abs(run_result.detail.contacts["load"]).max()))
    if scene.contact.law == "linear":
        return with_estimated_errors(
            run_result,
            fine,
            lambda step_factor, share: principal_series(simulate_path(with_step_factor(scene, step_factor, share))),
            RK4_ORDER,
            step,
            channel_sizes=sizes,
        )
    cells = scene.contact.cells
    other_cells = coarser_cells(cells) if cells >= FEWEST_CELLS else 2 * cells
    try:
        coarse = _coarse_series(scene, simulate_path, other_cells)
    except (InputError, RunFailed) as failure:
        return not_estimated(run_result, f"on {other_cells} cells the path fails: {failure}")
    estimates = _step_errors(scene, simulate_path, fine, coarse, sizes)
    for name, unit in UNIT_OF_CHANNEL.items():
        gap = _rms_difference(fine, coarse, name)
        estimates[f"{name} of cells"] = grid_error(gap, sizes[name], unit, cells, CELL_ERROR_ORDER, LARGEST_CELL_COUNT)
    return with_stated_errors(run_result, estimates, f"a path on {other_cells} cells and some steps of other length")


def principal_series(wheelset_path: WheelsetPath) -> RunSeries:
    """Time series of the channels whose error is stated: lateral displacement (m), yaw (rad), and creep forces (N) of
    each wheel.
    """
    forces = {
        name: np.stack([*sums_by_wheel(wheelset_path.contacts, wheelset_path.contacts[name]).values()], axis=1)
        for name in ("fx", "fy")
    }
    return RunSeries(
        wheelset_path.times, {"y": wheelset_path.states[:, Y], "yaw": wheelset_path.states[:, YAW], **forces}
    )


def _channel_sizes(fine_series: RunSeries, largest_patch_load: float) -> dict[str, float]:
    """Sizes of the channels, by which relative errors are divided; ``largest_patch_load`` : largest load of a patch
    (N).
    """
    return {
        name: max(reference_size(values), ROUNDING_SIZE * (largest_patch_load if UNIT_OF_CHANNEL[name] == "N" else 1.0))
        for name, values in fine_series.channels.items()
    }


def with_step_factor(
    scene: WheelsetScene, step_factor: float, run_share: float = 1.0, cell_count: int | None = None
) -> WheelsetScene:
    """Returns the scene with its time step multiplied by ``step_factor``, over the first ``run_share`` of its path
    (whole steps), and with ``cell_count`` if given. Raises RunFailed for a step that outlasts the path.
    """
    step = step_factor * scene.run.step
    if step > scene.run.duration * (1.0 + 1e-9):
        raise RunFailed("", f"a step of {step:g} s outlasts the path of {scene.run.duration:g} s")
    duration = step * max(1, math.floor(run_share * scene.run.duration / step + 1e-9))
    contact = scene.contact if cell_count is None else scene.contact.model_copy(update={"cells": cell_count})
    run = scene.run.model_copy(update={"step": step, "duration": duration})
    return scene.model_copy(update={"contact": contact, "run": run})


def _coarse_series(scene: WheelsetScene, simulate_path: SimulatePath, cell_count: int) -> RunSeries:
    """Time series of the path on another number of cells, in twice the time step where this is possible."""
    with suppress(InputError, RunFailed):
        return principal_series(simulate_path(with_step_factor(scene, 2.0, cell_count=cell_count)))
    return principal_series(simulate_path(with_step_factor(scene, 1.0, cell_count=cell_count)))


def _step_errors(
    scene: WheelsetScene,
    simulate_path: SimulatePath,
    fine_series: RunSeries,
    coarse_series: RunSeries,
    channel_sizes: Mapping[str, float],
) -> dict[str, Estimate]:
    """Errors of the time steps over the whole path. They are measured over its first part, and enlarged as the errors
    of the cells grow from there.
    """
    power = 2.0**KINKED_ORDER
    try:
        duration_of_first_part, share, remains = (
            principal_series(simulate_path(with_step_factor(scene, 2.0, FINE_WINDOW))),
            FINE_WINDOW,
            1.0 / (power - 1.0),
        )
    except (InputError, RunFailed):
        share = min(1.0, max(HALF_STEP_SHARE, LEAST_STEPS * scene.run.step / scene.run.duration))
        duration_of_first_part, remains = (
            principal_series(simulate_path(with_step_factor(scene, 0.5, share))),
            power / (power - 1.0),
        )
    end, estimates = share * scene.run.duration, {}
    for name, unit in UNIT_OF_CHANNEL.items():
        difference_at_start, difference_over_all = (
            _rms_difference(fine_series, coarse_series, name, end),
            _rms_difference(fine_series, coarse_series, name),
        )
        grown = max(1.0, difference_over_all / difference_at_start) if difference_at_start > 0.0 else 1.0
        error = remains * grown * _rms_difference(fine_series, duration_of_first_part, name)
        estimates[name] = Estimate(error, unit, error / channel_sizes[name], KINKED_ORDER, scene.run.step)
    return estimates


def _rms_difference(
    fine_series: RunSeries, other_series: RunSeries, channel_name: str, end_time: float = math.inf
) -> float:
    """Root mean square of the difference of a channel between two series, up to a time (s), at the times of the coarser
    one.
    """
    long, short = sorted((fine_series, other_series), key=lambda series: -series.times[min(1, len(series.times) - 1)])
    shared_times = long.times[long.times <= min(end_time, short.times[-1]) * (1.0 + 1e-9)]
    gap = (
        long.channels[channel_name][: len(shared_times)]
        - short.channels[channel_name][nearest_rows(short.times, shared_times)]
    )
    return float(np.sqrt(np.mean(gap**2)))


def with_error_of_cycles(
    run_result: Result,
    limit_cycles: Sequence[Orbit],
    coarse_limit_cycles: Mapping[int, Orbit],
    sought_quantity: str,
    cell_count: int,
) -> Result:
    """Returns the result of limit cycles with the errors of the frequency (Hz) and of the unknown that was solved for.

    Each cycle was also solved in half the step, which gives the error of the steps. ``coarse_limit_cycles`` : some
    cycles on half the cells, by index into ``limit_cycles``.
    """
    units, estimates = (
        {sought_quantity: "m" if sought_quantity == "amplitude" else "m/s", "frequency": "Hz"},
        dict[str, Estimate](),
    )
    for name, unit in units.items():
        size = reference_size(np.array([getattr(orbit, name) for orbit in limit_cycles]))
        changes = [orbit.frequency_error if name == "frequency" else orbit.error for orbit in limit_cycles]
        error = float(np.sqrt(np.mean(np.square(changes)))) / (2.0**KINKED_ORDER - 1.0)
        steps = [orbit.period / orbit.step_count for orbit in limit_cycles]
        estimates[name] = Estimate(error, unit, error / size, KINKED_ORDER, float(min(steps)))
        if coarse_limit_cycles:
            gaps = [
                getattr(limit_cycles[k], name) - getattr(coarse_orbit, name)
                for k, coarse_orbit in coarse_limit_cycles.items()
            ]
            left = LIKELY_ERROR_SHARE * float(np.sqrt(np.mean(np.square(gaps))))
            estimates[f"{name} of cells"] = grid_error(
                left, size, unit, cell_count, CELL_ERROR_ORDER, LARGEST_CELL_COUNT
            )
    cells_text = (
        f", and half the cells at {len(coarse_limit_cycles)} of {len(limit_cycles)} cycles"
        if coarse_limit_cycles
        else ", none on fewer cells"
    )
    return with_stated_errors(run_result, estimates, f"half the step at every cycle{cells_text}")
