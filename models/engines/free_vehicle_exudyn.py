"""A free vehicle in Exudyn: one kinematic tree, all forces by its user function around the compiled kernel."""

import struct
from collections.abc import Callable
from typing import Any

import exudyn as exu
import numpy as np

from models.core.errors import RunFailed
from models.engines.free_vehicle import Driven, FreeModel
from models.engines.spatial_exudyn_build import KINDS, Build, _tree, items
from models.vehicles.spatial_linear import Preloads


def user_function(driven: Driven) -> Callable[..., Any]:
    """Exudyn's force function of the tree: lists of positions and rates in, a list of forces out."""
    n = driven.size
    block = np.concatenate((np.zeros(3 * n), driven.numbers))
    pack, raw = struct.Struct(f"{2 * n}d").pack_into, block.data.cast("B")[8 * n :]
    answer, address, fill = block[:n].data.tolist, block.ctypes.data, driven.block

    def forces(mbs: Any, t: float, item: int, q: Any, v: Any) -> Any:
        pack(raw, 0, *q, *v)
        fill(address, t, n)
        return answer()

    return forces


class FreeExudyn(FreeModel):
    """One free vehicle in one Exudyn system."""

    ENGINE = "exudyn"

    def __init__(self, driven: Driven) -> None:
        self.driven, self._container = driven, exu.SystemContainer()
        self.mbs: Any = self._container.AddSystem()
        mbs = self.mbs
        built = Build(driven.vehicle, mbs, Preloads({}, {}), mbs.AddObject(items.ObjectGround()))
        _tree(built, list(driven.vehicle.bodies))
        tree, node = built.links[driven.vehicle.bodies[0].name][0], next(iter(built.places.values()))[0]
        mbs.SetObjectParameter(tree, "gravity", driven.gravity.tolist())
        mbs.SetObjectParameter(tree, "forceUserFunction", user_function(driven))
        self._sensors = [
            mbs.AddSensor(
                items.SensorNode(nodeNumber=node, storeInternal=True, writeToFile=False, outputVariableType=kind)
            )
            for kind in (KINDS.Coordinates, KINDS.Coordinates_t)
        ]
        mbs.Assemble()

    def _started(self, q: np.ndarray, v: np.ndarray) -> Any:
        """Settings that write no file; the system is at positions and rates."""
        options, initial, data = exu.SimulationSettings(), exu.ConfigurationType.Initial, self.mbs.systemData
        data.SetODE2Coordinates(q, initial)
        data.SetODE2Coordinates_t(v, initial)
        options.solution.file.write = options.solution.sensors.active = False
        return options

    def acceleration(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (n,) from Exudyn's own residual and mass matrix."""
        options = self._started(q, v)
        options.timeIntegration.startTime = t
        solver: Any = exu.MainSolverImplicitSecondOrder()
        solver.InitializeSolver(self.mbs, options)
        solver.ComputeMassMatrix(self.mbs)
        solver.ComputeODE2RHS(self.mbs)
        mass, force = np.array(solver.GetSystemMassMatrix()), np.array(solver.GetSystemResidual())
        solver.FinalizeSolver(self.mbs, options)
        return np.linalg.solve(mass, force)

    def march(self, q: np.ndarray, v: np.ndarray, steps: int, step: float) -> np.ndarray:
        """Positions and rates (steps + 1, 2 n) by Exudyn's RK44; RunFailed where it stops."""
        options = self._started(q, v)
        options.solution.sensors.active, options.solution.sensors.writePeriod = True, step
        ti = options.timeIntegration
        ti.numberOfSteps, ti.endTime, ti.verboseMode = steps, steps * step, 0
        ti.adaptiveStep = ti.automaticStepSize = ti.explicit.computeEndOfStepAccelerations = False
        try:
            self.mbs.SolveDynamic(options, solverType=exu.DynamicSolverType.RK44)
        except (exu.ExudynError, RuntimeError, ValueError) as error:
            if "KeyboardInterrupt" in str(error):
                raise KeyboardInterrupt from error
            raise RunFailed("exudyn", f"the solver stopped: {str(error).strip().splitlines()[0]}") from error
        return np.hstack([self.mbs.GetSensorStoredData(sensor)[:, 1:] for sensor in self._sensors])
