"""A wheelset on rails in MuJoCo: one body of five joints, its suspension as actuators, both rails by a native callback.

The suspension's ends are sites on the axle, which spin does not move. Their reference sites stand still in the track,
so that length and moment of each actuator are exact along the track's axes.
"""

from functools import cached_property
from typing import Any

import mujoco
import numpy as np

from models.contact.inputs import Array
from models.engines.contact_bridge_mujoco import Marcher, add_joint, blank, compiled, native_law
from models.engines.mujoco_callback import installed
from models.engines.wheelset import EngineWheelset, leaning
from models.rail.equations import Body
from models.rail.joint_forces import joint_forces, table
from models.rail.wheelset import GRAVITY

JOINTS = (
    ("slide", (0.0, 1.0, 0.0)),
    ("slide", (0.0, 0.0, 1.0)),
    ("hinge", (0.0, 0.0, 1.0)),
    ("hinge", (1.0, 0.0, 0.0)),
    ("hinge", (0.0, 1.0, 0.0)),
)
"""Kind and axis, from the track to the wheelset."""
COORDINATES = ("y", "z", "yaw", "roll", "spin")
"""Of the joints."""
NAME = "wheelset"
"""Of the body."""


def specified(numbers: Array, body: Body) -> Any:
    """Specification of the wheelset of ``Equations.body``; ``numbers``, the callback's table, lie in it."""
    spec = blank("rails", numbers, "RK4", leaning(GRAVITY, body))
    inertia = body.across, body.along, body.across
    wheelset = spec.worldbody.add_body(
        name=NAME, mass=body.mass, ipos=[0.0, 0.0, 0.0], inertia=inertia, explicitinertial=True
    )
    for name, joint in zip(COORDINATES, JOINTS, strict=True):
        add_joint(wheelset, *joint, name=name)
    for name, arm in (("right", body.arm), ("left", -body.arm)):
        wheelset.add_site(name=name, pos=[0.0, arm, 0.0])
        spec.worldbody.add_site(name=f"{name} frame", pos=[0.0, arm, body.sunk])
        for i, load in enumerate(leaning(body.carried, body)):
            if body.stiffness[i] or body.damping[i] or load:
                strut = spec.add_actuator(trntype=mujoco.mjtTrn.mjTRN_SITE, target=name, refsite=f"{name} frame")
                strut.gear[:], strut.gainprm[0], strut.biastype = np.eye(6)[i], 0.0, mujoco.mjtBias.mjBIAS_AFFINE
                strut.biasprm[:3] = load, -body.stiffness[i], -body.damping[i]
    return spec


def model(numbers: Array, body: Body) -> mujoco.MjModel:
    """The model of ``specified``."""
    return compiled(specified(numbers, body))


def rail_law() -> Any:
    """Compiled callback of both rails."""
    return native_law(joint_forces)


class MujocoWheelset(EngineWheelset):
    """The wheelset in a MuJoCo model of its own."""

    ENGINE = "mujoco"

    @cached_property
    def model(self) -> mujoco.MjModel:
        """The model; without ``rail_law`` installed, it has no rails."""
        return model(table(float(self.speed), self.rails), self.body)

    @cached_property
    def _data(self) -> mujoco.MjData:
        return mujoco.MjData(self.model)

    def accelerations(self, q: Array, v: Array) -> Array:
        """Accelerations (5,) of the joints by ``mj_forward``."""
        data = self._data
        data.qpos[:], data.qvel[:] = q, v
        with installed(rail_law()):
            mujoco.mj_forward(self.model, data)
        return data.qacc.copy()

    def marched(self, q: Array, v: Array, steps: int, step: float) -> Array:
        """Positions and rates (steps + 1, 10) by MuJoCo's RK4; RunFailed where it starts again or is not finite."""
        self.model.opt.timestep, start = step, np.concatenate((q, v))
        with installed(rail_law()):
            path = Marcher(self.model).run(start[None], steps)[0]
        return np.vstack((start, path))
