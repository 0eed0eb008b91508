"""Stated errors of a wheelset's results: errors of time steps, and of FASTSIM's cells.

Cells leave a hundred times as much as steps. One more path on half the cells, in twice the step where that can be,
tells what cells leave; a few steps of twice the length on all cells tell how much of that is of steps, which grows
along the path as what cells leave does.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress

import numpy as np

from models.contact.accuracy import LIKELY_SHARE, coarser_cells
from models.core.discretisation import (
    FINE_WINDOW,
    Estimate,
    Series,
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
from models.systems.wheelset.scene import MOST_CELLS, WheelsetScene

UNIT_OF_CHANNEL = {"y": "m", "yaw": "rad", "fx": "N", "fy": "N"}
"""Channels whose error is told; forces are the sum over the patches of a wheel."""
STILL = 1e-12
"""m, rad, and share of the load: a channel of a centred wheelset that is smaller is rounding, and no share is of it."""
RK4_ORDER, KINKED_ORDER = 4, 2.0
"""Of RK4, and as it is left where cells begin to slide one by one: 1 to 4 in random scenes."""
OF_CELLS = 1.5
"""Order that is taken for the cells to use; their error falls with the first to the second power."""
HALF_STEP_SHARE, LEAST_STEPS = 0.1, 20
"""Share of the path that half the step repeats where twice the step cannot be, and its steps at least."""
FEWEST_CELLS = 5
"""Cells from which on half of them are a net."""
March = Callable[[WheelsetScene], WheelsetPath]
"""The path of a scene, by one engine at one speed."""


def with_error(run: Result, scene: WheelsetScene, march_scene: March) -> Result:
    """The result of a path with the errors of its principal channels; RunFailed where these are so large that it is no
    answer.
    """
    fine, step = principal_series(run.detail), scene.run.step
    sizes = _sizes(fine, float(np.abs(run.detail.contacts["load"]).max()))
    if scene.contact.law == "linear":
        return with_estimated_errors(
            run,
            fine,
            lambda step_factor, share: principal_series(march_scene(with_step_factor(scene, step_factor, share))),
            RK4_ORDER,
            step,
            channel_sizes=sizes,
        )
    cells = scene.contact.cells
    other_cells = coarser_cells(cells) if cells >= FEWEST_CELLS else 2 * cells
    try:
        coarse = _coarse_run(scene, march_scene, other_cells)
    except (InputError, RunFailed) as failure:
        return not_estimated(run, f"on {other_cells} cells the path fails: {failure}")
    estimates = _of_steps(scene, march_scene, fine, coarse, sizes)
    for name, unit in UNIT_OF_CHANNEL.items():
        gap = _rms_difference(fine, coarse, name)
        estimates[f"{name} of cells"] = grid_error(gap, sizes[name], unit, cells, OF_CELLS, MOST_CELLS)
    return with_stated_errors(run, estimates, f"a path on {other_cells} cells and some steps of other length")


def principal_series(path: WheelsetPath) -> Series:
    """Time series of the principal channels of a path."""
    forces = {
        name: np.stack([*sums_by_wheel(path.contacts, path.contacts[name]).values()], axis=1) for name in ("fx", "fy")
    }
    return Series(path.times, {"y": path.states[:, Y], "yaw": path.states[:, YAW], **forces})


def _sizes(fine_series: Series, load: float) -> dict[str, float]:
    """Sizes of the channels by which errors are divided; ``load`` : the largest of a patch (N)."""
    return {
        name: max(reference_size(values), STILL * (load if UNIT_OF_CHANNEL[name] == "N" else 1.0))
        for name, values in fine_series.channels.items()
    }


def with_step_factor(
    scene: WheelsetScene, step_factor: float, share: float = 1.0, cells: int | None = None
) -> WheelsetScene:
    """The scene with a step that is ``step_factor`` as long, over a share of its path (whole steps), and with another
    number of cells. Raises RunFailed for a step that outlasts the path.
    """
    step = step_factor * scene.run.step
    if step > scene.run.duration * (1.0 + 1e-9):
        raise RunFailed("", f"a step of {step:g} s outlasts the path of {scene.run.duration:g} s")
    duration = step * max(1, math.floor(share * scene.run.duration / step + 1e-9))
    contact = scene.contact if cells is None else scene.contact.model_copy(update={"cells": cells})
    run = scene.run.model_copy(update={"step": step, "duration": duration})
    return scene.model_copy(update={"contact": contact, "run": run})


def _coarse_run(scene: WheelsetScene, march_scene: March, cells: int) -> Series:
    """The path on another number of cells, in twice the step where this is possible."""
    with suppress(InputError, RunFailed):
        return principal_series(march_scene(with_step_factor(scene, 2.0, cells=cells)))
    return principal_series(march_scene(with_step_factor(scene, 1.0, cells=cells)))


def _of_steps(
    scene: WheelsetScene,
    march_scene: March,
    fine_series: Series,
    coarse_series: Series,
    channel_sizes: Mapping[str, float],
) -> dict[str, Estimate]:
    """Step errors over the whole path: those of its first part, enlarged as the errors of the cells grow."""
    power = 2.0**KINKED_ORDER
    try:
        first_part, share, remains = (
            principal_series(march_scene(with_step_factor(scene, 2.0, FINE_WINDOW))),
            FINE_WINDOW,
            1.0 / (power - 1.0),
        )
    except (InputError, RunFailed):
        share = min(1.0, max(HALF_STEP_SHARE, LEAST_STEPS * scene.run.step / scene.run.duration))
        first_part, remains = principal_series(march_scene(with_step_factor(scene, 0.5, share))), power / (power - 1.0)
    end, estimates = share * scene.run.duration, {}
    for name, unit in UNIT_OF_CHANNEL.items():
        difference_at_start, difference_over_all = (
            _rms_difference(fine_series, coarse_series, name, end),
            _rms_difference(fine_series, coarse_series, name),
        )
        grown = max(1.0, difference_over_all / difference_at_start) if difference_at_start > 0.0 else 1.0
        error = remains * grown * _rms_difference(fine_series, first_part, name)
        estimates[name] = Estimate(error, unit, error / channel_sizes[name], KINKED_ORDER, scene.run.step)
    return estimates


def _rms_difference(fine_series: Series, other_series: Series, name: str, end_time: float = math.inf) -> float:
    """Root mean square of the difference between two series in one channel, up to a time (s), at the rows that both
    have.
    """
    long, short = sorted((fine_series, other_series), key=lambda series: -series.times[min(1, len(series.times) - 1)])
    shared_times = long.times[long.times <= min(end_time, short.times[-1]) * (1.0 + 1e-9)]
    gap = long.channels[name][: len(shared_times)] - short.channels[name][nearest_rows(short.times, shared_times)]
    return float(np.sqrt(np.mean(gap**2)))


def with_error_of_cycles(
    run: Result, orbits: Sequence[Orbit], coarse_orbits: Mapping[int, Orbit], sought_quantity: str, cells: int
) -> Result:
    """The result of limit cycles with the errors of the frequency and of the unknown that was solved for.

    Each cycle was also solved in half the step, which gives the error of the steps. ``coarse_orbits`` : some of them on
    half the cells, by their index.
    """
    units, estimates = (
        {sought_quantity: "m" if sought_quantity == "amplitude" else "m/s", "frequency": "Hz"},
        dict[str, Estimate](),
    )
    for name, unit in units.items():
        size = reference_size(np.array([getattr(orbit, name) for orbit in orbits]))
        changes = [orbit.frequency_error if name == "frequency" else orbit.error for orbit in orbits]
        error = float(np.sqrt(np.mean(np.square(changes)))) / (2.0**KINKED_ORDER - 1.0)
        steps = [orbit.period / orbit.step_count for orbit in orbits]
        estimates[name] = Estimate(error, unit, error / size, KINKED_ORDER, float(min(steps)))
        if coarse_orbits:
            gaps = [getattr(orbits[k], name) - getattr(coarse_orbit, name) for k, coarse_orbit in coarse_orbits.items()]
            left = LIKELY_SHARE * float(np.sqrt(np.mean(np.square(gaps))))
            estimates[f"{name} of cells"] = grid_error(left, size, unit, cells, OF_CELLS, MOST_CELLS)
    cells_text = (
        f", and half the cells at {len(coarse_orbits)} of {len(orbits)} cycles"
        if coarse_orbits
        else ", none on fewer cells"
    )
    return with_stated_errors(run, estimates, f"half the step at every cycle{cells_text}")
