"""An Exudyn system seen through its coordinates: started at any positions and rates, its accelerations, its marches."""

import struct
from collections.abc import Callable
from typing import Any

import exudyn as exu
import numpy as np

from models.contact.inputs import Array
from models.core.errors import RunFailed
from models.core.waiting import marching
from models.engines.exudyn_system import items, mass_and_force, quiet_settings, start

Listed = Callable[[Any, Any], Any]
"""Forces of lists of positions and rates, as a list."""


def compiled_forces(size: int, numbers: Array, law: Callable[..., Any], *more: int) -> Listed:
    """``law(address, *more)`` about one block of doubles: forces, positions, rates (size,), then numbers.

    Exudyn calls Python and nothing else, and hands a user function lists: to pack both into one block, to let a
    compiled kernel work on its address and to return a list costs least.
    """
    block = np.concatenate((np.zeros(3 * size), numbers))
    pack, raw = struct.Struct(f"{2 * size}d").pack_into, block.data.cast("B")[8 * size :]
    answer, address = block[:size].data.tolist, block.ctypes.data

    def forces(positions: Any, rates: Any) -> Any:
        pack(raw, 0, *positions, *rates)
        law(address, *more)
        return answer()

    return forces


def add_node(mbs: Any, size: int) -> Any:
    """A node of so many coordinates, all zero."""
    zero = [0.0] * size
    return mbs.AddNode(
        items.NodeGenericODE2(
            numberOfODE2Coordinates=size, referenceCoordinates=zero, initialCoordinates=zero, initialCoordinates_t=zero
        )
    )


def accelerations(mbs: Any, q: Array, v: Array) -> Array:
    """Accelerations (n,) of the coordinates from Exudyn's own residual and mass matrix."""
    start(mbs, q, v)
    return np.linalg.solve(*mass_and_force(mbs))


def solve(mbs: Any, options: Any, steps: int, step: float, solver: str) -> bool:
    """March some steps (s); whether Exudyn is content. RunFailed where the solver stops."""
    ti = options.timeIntegration
    ti.numberOfSteps, ti.endTime, ti.verboseMode = steps, steps * step, 0
    ti.adaptiveStep = ti.explicit.computeEndOfStepAccelerations = False
    try:
        with marching(lambda: mbs.systemData.GetTime() / (steps * step)):
            return bool(mbs.SolveDynamic(options, solverType=getattr(exu.DynamicSolverType, solver)))
    except (exu.ExudynError, RuntimeError, ValueError) as error:
        if "KeyboardInterrupt" in str(error):
            raise KeyboardInterrupt from error
        raise RunFailed("exudyn", f"the solver stopped: {str(error).strip().splitlines()[0]}") from error


def march(mbs: Any, sensors: list[Any], q: Array, v: Array, steps: int, step: float) -> Array:
    """What sensors record (steps + 1, columns) of a march by RK44; RunFailed where it stops or is not finite."""
    start(mbs, q, v)
    options = quiet_settings()
    options.solution.sensors.active, options.solution.sensors.writePeriod = True, step
    options.timeIntegration.automaticStepSize = False
    solve(mbs, options, steps, step, "RK44")
    path = np.hstack([mbs.GetSensorStoredData(sensor)[:, 1:] for sensor in sensors])
    good = np.isfinite(path).all(axis=1).cumprod().sum()
    if good != steps + 1:
        raise RunFailed("exudyn", "the engine gave up", max(good - 1, 0) * step)
    return path
