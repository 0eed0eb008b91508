"""A vehicle cut at its wheels in Exudyn: one kinematic tree, all other forces by its user function.

The function is called once per stage: it packs coordinates and rates into one array, lets the compiled forces work,
and returns a list.
"""

import struct
from collections.abc import Callable
from typing import Any

import exudyn as exu
import numpy as np

from models.engines.hub_forces import HubModel
from models.engines.spatial_exudyn_build import KINDS, Build, _tree, items
from models.errors import RunFailed
from models.hub_forces.cut_vehicle import CutVehicle
from models.hub_forces.kernel import forces
from models.hub_forces.table import Drive
from models.vehicles.spatial_linear import Preloads


def user_function(numbers: np.ndarray, work: tuple[np.ndarray, ...]) -> Callable[..., Any]:
    """Exudyn's user function: forces of the joints, a list, by the time and lists of their positions and rates."""
    out, n = work[1], len(work[1])
    both = np.empty(2 * n)
    pack, raw, q, v, answer = struct.Struct(f"{2 * n}d").pack_into, both.data.cast("B"), both[:n], both[n:], out.tolist

    def joint_forces(mbs: Any, t: float, item: int, positions: Any, rates: Any) -> Any:
        pack(raw, 0, *positions, *rates)
        out.fill(0.0)
        forces(numbers, t, q, v, *work)
        return answer()

    return joint_forces


class ExudynHubs(HubModel):
    """The cut vehicle in an Exudyn system of its own."""

    ENGINE = "exudyn"

    def __init__(self, vehicle: CutVehicle, drive: Drive, step: float, duration: float) -> None:
        super().__init__(vehicle, drive, step, duration)
        mbs: Any = exu.SystemContainer().AddSystem()
        built = Build(vehicle.tree, mbs, Preloads({}, {}), mbs.AddObject(items.ObjectGround()))
        _tree(built, list(vehicle.tree.bodies))
        tree = built.links[vehicle.chassis][0]
        mbs.SetObjectParameter(tree, "forceUserFunction", user_function(self.numbers, self.work()))
        node = next(iter(built.places.values()))[0]
        self._mbs, self._sensors = mbs, [
            mbs.AddSensor(items.SensorNode(nodeNumber=node, storeInternal=True, writeToFile=False,
                                           outputVariableType=kind))
            for kind in (KINDS.Coordinates, KINDS.Coordinates_t)]  # fmt: skip
        mbs.Assemble()

    def _started(self, q: np.ndarray, v: np.ndarray) -> Any:
        """Settings that write no file, the system at coordinates and rates."""
        options, initial = exu.SimulationSettings(), exu.ConfigurationType.Initial
        self._mbs.systemData.SetODE2Coordinates(q, initial)
        self._mbs.systemData.SetODE2Coordinates_t(v, initial)
        options.solution.file.write = options.solution.sensors.active = False
        return options

    def accelerations(self, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (n,) from Exudyn's own residual and mass matrix."""
        mbs, options = self._mbs, self._started(q, v)
        mbs.systemData.SetTime(time, exu.ConfigurationType.Initial)
        solver: Any = exu.MainSolverImplicitSecondOrder()
        options.timeIntegration.startTime = time
        solver.InitializeSolver(mbs, options)
        solver.ComputeMassMatrix(mbs)
        solver.ComputeODE2RHS(mbs)
        mass, force = np.array(solver.GetSystemMassMatrix()), np.array(solver.GetSystemResidual())
        solver.FinalizeSolver(mbs, options)
        return np.linalg.solve(mass, force)

    def marched(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Coordinates and rates (steps + 1, 2 n) by Exudyn's RK44; RunFailed where it stops."""
        options = self._started(q, v)
        options.solution.sensors.active, options.solution.sensors.writePeriod = True, self.step
        ti = options.timeIntegration
        ti.numberOfSteps, ti.endTime, ti.verboseMode = self.steps, self.steps * self.step, 0
        ti.adaptiveStep = ti.automaticStepSize = ti.explicit.computeEndOfStepAccelerations = False
        try:
            self._mbs.SolveDynamic(options, solverType=exu.DynamicSolverType.RK44)
        except (exu.ExudynError, RuntimeError, ValueError) as error:
            if "KeyboardInterrupt" in str(error):
                raise KeyboardInterrupt from error
            raise RunFailed("exudyn", f"the solver stopped: {str(error).strip().splitlines()[0]}") from error
        return np.hstack([self._mbs.GetSensorStoredData(sensor)[:, 1:] for sensor in self._sensors])


MODEL = ExudynHubs
