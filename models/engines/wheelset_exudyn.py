"""A wheelset on rails in Exudyn: a kinematic tree of five links, native spring-dampers, both rails by a user function.

Only the last link has mass. The suspension's ends are points of the axle, which spin does not move. The tree's own
force function is called once per stage.
"""

from functools import cached_property
from typing import Any

import exudyn as exu
import numpy as np

from models.contact.inputs import Array
from models.engines.exudyn_coordinates import accelerations, add_node, compiled_forces, march
from models.engines.exudyn_system import items, lists
from models.engines.wheelset import EngineWheelset, leaning
from models.rail.equations import Body
from models.rail.joint_forces import JOINTS, set_joint_forces, table
from models.rail.wheelset import GRAVITY

KIND = exu.JointType
CHAIN = [KIND.PrismaticY, KIND.PrismaticZ, KIND.RevoluteZ, KIND.RevoluteX, KIND.RevoluteY]
"""From the track to the wheelset."""


def tree(mbs: Any, node: Any, numbers: Array, body: Body) -> Any:
    """The wheelset of ``Equations.body`` on a node of five coordinates; ``numbers`` is the table of the rails."""
    zero, forces = lists.Vector3DList([[0.0, 0.0, 0.0]] * JOINTS), compiled_forces(JOINTS, numbers, set_joint_forces)
    inertias = [np.zeros((3, 3))] * (JOINTS - 1) + [np.diag([body.across, body.along, body.across])]
    return mbs.AddObject(
        items.ObjectKinematicTree(
            nodeNumber=node,
            gravity=leaning(GRAVITY, body),
            jointTypes=CHAIN,
            linkParents=list(range(-1, JOINTS - 1)),
            jointTransformations=lists.Matrix3DList([np.eye(3)] * JOINTS),
            jointOffsets=zero,
            linkInertiasCOM=lists.Matrix3DList(inertias),
            linkCOMs=zero,
            linkMasses=[0.0] * (JOINTS - 1) + [body.mass],
            forceUserFunction=lambda mbs, t, item, q, v: forces(q, v),
        )
    )


def suspension(mbs: Any, wheelset: Any, body: Body) -> None:
    """Springs and dampers of both ends along the track's axes, if any, and what the vehicle weighs on them."""
    ground = mbs.AddObject(items.ObjectGround())
    for arm in (body.arm, -body.arm):
        frame = mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=ground, localPosition=[0.0, arm, body.sunk]))
        end = mbs.AddMarker(
            items.MarkerKinematicTreeRigid(objectNumber=wheelset, linkNumber=JOINTS - 1, localPosition=[0.0, arm, 0.0])
        )
        if body.held:
            mbs.AddObject(
                items.CartesianSpringDamper(markerNumbers=[frame, end], stiffness=body.stiffness, damping=body.damping)
            )
        mbs.AddLoad(items.LoadForceVector(markerNumber=end, loadVector=leaning(body.carried, body)))


class ExudynWheelset(EngineWheelset):
    """The wheelset in an Exudyn system of its own."""

    ENGINE = "exudyn"

    @cached_property
    def system(self) -> tuple[Any, list[Any]]:
        """System and the sensors of positions and of rates."""
        mbs = exu.SystemContainer().AddSystem()
        node = add_node(mbs, JOINTS)
        suspension(mbs, tree(mbs, node, table(float(self.speed), self.rails), self.body), self.body)
        kinds = exu.OutputVariableType.Coordinates, exu.OutputVariableType.Coordinates_t
        sensors = [
            mbs.AddSensor(
                items.SensorNode(nodeNumber=node, storeInternal=True, writeToFile=False, outputVariableType=kind)
            )
            for kind in kinds
        ]
        mbs.Assemble()
        return mbs, sensors

    def accelerations(self, q: Array, v: Array) -> Array:
        """Accelerations (5,) of the joints from Exudyn's own residual and mass matrix."""
        return accelerations(self.system[0], q, v)

    def marched(self, q: Array, v: Array, steps: int, step: float) -> Array:
        """Positions and rates (steps + 1, 10) by Exudyn's RK44; RunFailed where it stops or is not finite."""
        return march(*self.system, q, v, steps, step)
