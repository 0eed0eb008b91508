"""A wheelset on rails in Exudyn: a kinematic tree of five links, native spring-dampers, both rails by a user function.

Only the last link has mass. The suspension's ends are points of the axle, which spin does not move. The tree's own
force function is called once per stage: it packs positions and rates into one block, lets the compiled forces work on
its address, and returns a list.
"""

import struct
from collections.abc import Callable
from functools import cached_property
from typing import Any

import exudyn as exu
import numpy as np

from models.core.errors import RunFailed
from models.engines.spatial_exudyn_build import KINDS, items, lists
from models.engines.wheelset import EngineWheelset, leaning
from models.rail.equations import ACROSS, ALONG, ARM, CARRIED, DX, DZ, KX, KZ, MASS, SUNK
from models.rail.joint_forces import JOINTS, set_joint_forces, table
from models.rail.wheelset import GRAVITY

KIND = exu.JointType
CHAIN = [KIND.PrismaticY, KIND.PrismaticZ, KIND.RevoluteZ, KIND.RevoluteX, KIND.RevoluteY]
"""From the track to the wheelset."""


def rails(numbers: np.ndarray) -> Callable[..., Any]:
    """Exudyn's user function: forces of the joints, a list, by lists of their positions and rates."""
    block = np.concatenate((np.zeros(3 * JOINTS), numbers))
    pack, raw = struct.Struct(f"{2 * JOINTS}d").pack_into, block.data.cast("B")[8 * JOINTS :]
    answer, address = block[:JOINTS].data.tolist, block.ctypes.data

    def forces(mbs: Any, t: float, item: int, q: Any, v: Any) -> Any:
        pack(raw, 0, *q, *v)
        set_joint_forces(address)
        return answer()

    return forces


def tree(mbs: Any, node: Any, numbers: np.ndarray, body: np.ndarray) -> Any:
    """The wheelset of ``Equations.body`` on a node of five coordinates; ``numbers`` is the table of the rails."""
    zero = [[0.0, 0.0, 0.0]] * JOINTS
    inertias = [np.zeros((3, 3))] * (JOINTS - 1) + [np.diag(body[[ACROSS, ALONG, ACROSS]])]
    return mbs.AddObject(
        items.ObjectKinematicTree(
            nodeNumber=node,
            gravity=leaning(GRAVITY, body),
            jointTypes=CHAIN,
            linkParents=list(range(-1, JOINTS - 1)),
            jointTransformations=lists.Matrix3DList([np.eye(3)] * JOINTS),
            jointOffsets=lists.Vector3DList(zero),
            linkInertiasCOM=lists.Matrix3DList(inertias),
            linkCOMs=lists.Vector3DList(zero),
            linkMasses=[0.0] * (JOINTS - 1) + [body[MASS]],
            forceUserFunction=rails(numbers),
        )
    )


def suspension(mbs: Any, wheelset: Any, body: np.ndarray) -> None:
    """Springs and dampers of both ends along the track's axes, if any, and what the vehicle weighs on them."""
    ground = mbs.AddObject(items.ObjectGround())
    for arm in (body[ARM], -body[ARM]):
        frame = mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=ground, localPosition=[0.0, arm, body[SUNK]]))
        end = mbs.AddMarker(
            items.MarkerKinematicTreeRigid(objectNumber=wheelset, linkNumber=JOINTS - 1, localPosition=[0.0, arm, 0.0])
        )
        if body[KX : DZ + 1].any():
            mbs.AddObject(
                items.CartesianSpringDamper(
                    markerNumbers=[frame, end], stiffness=body[KX : KZ + 1], damping=body[DX : DZ + 1]
                )
            )
        mbs.AddLoad(items.LoadForceVector(markerNumber=end, loadVector=leaning(body[CARRIED], body)))


class ExudynWheelset(EngineWheelset):
    """The wheelset in an Exudyn system of its own."""

    ENGINE = "exudyn"

    @cached_property
    def _system(self) -> tuple[Any, list[Any]]:
        """System and the sensors of positions and of rates."""
        mbs, zero = exu.SystemContainer().AddSystem(), [0.0] * JOINTS
        node = mbs.AddNode(
            items.NodeGenericODE2(
                referenceCoordinates=zero,
                initialCoordinates=zero,
                initialCoordinates_t=zero,
                numberOfODE2Coordinates=JOINTS,
            )
        )
        suspension(mbs, tree(mbs, node, table(*self.parameters), self.body), self.body)
        sensors = [
            mbs.AddSensor(
                items.SensorNode(nodeNumber=node, storeInternal=True, writeToFile=False, outputVariableType=kind)
            )
            for kind in (KINDS.Coordinates, KINDS.Coordinates_t)
        ]
        mbs.Assemble()
        return mbs, sensors

    def _started(self, q: np.ndarray, v: np.ndarray) -> tuple[Any, Any]:
        """System at positions and rates, and settings that write no file."""
        mbs, options, initial = self._system[0], exu.SimulationSettings(), exu.ConfigurationType.Initial
        mbs.systemData.SetODE2Coordinates(q, initial)
        mbs.systemData.SetODE2Coordinates_t(v, initial)
        options.solution.file.write = options.solution.sensors.active = False
        return mbs, options

    def accelerations(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (5,) of the joints from Exudyn's own residual and mass matrix."""
        mbs, options = self._started(q, v)
        solver: Any = exu.MainSolverImplicitSecondOrder()
        solver.InitializeSolver(mbs, options)
        solver.ComputeMassMatrix(mbs)
        solver.ComputeODE2RHS(mbs)
        mass, force = np.array(solver.GetSystemMassMatrix()), np.array(solver.GetSystemResidual())
        solver.FinalizeSolver(mbs, options)
        return np.linalg.solve(mass, force)

    def marched(self, q: np.ndarray, v: np.ndarray, steps: int, step: float) -> np.ndarray:
        """Positions and rates (steps + 1, 10) by Exudyn's RK44; RunFailed where it stops or is not finite."""
        mbs, options = self._started(q, v)
        options.solution.sensors.active, options.solution.sensors.writePeriod = True, step
        ti = options.timeIntegration
        ti.numberOfSteps, ti.endTime, ti.verboseMode = steps, steps * step, 0
        ti.adaptiveStep = ti.automaticStepSize = ti.explicit.computeEndOfStepAccelerations = False
        try:
            mbs.SolveDynamic(options, solverType=exu.DynamicSolverType.RK44)
        except (exu.ExudynError, RuntimeError, ValueError) as error:
            if "KeyboardInterrupt" in str(error):
                raise KeyboardInterrupt from error
            raise RunFailed("exudyn", f"the solver stopped: {str(error).strip().splitlines()[0]}") from error
        path = np.hstack([mbs.GetSensorStoredData(sensor)[:, 1:] for sensor in self._system[1]])
        good = np.isfinite(path).all(axis=1).cumprod().sum()
        if good != steps + 1:
            raise RunFailed("exudyn", "the engine gave up", max(good - 1, 0) * step)
        return path
