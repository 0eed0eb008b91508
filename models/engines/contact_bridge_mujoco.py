"""Rail wheels in MuJoCo: the model, and creep forces by a native callback or by one that goes through Python."""

from collections.abc import Callable
from functools import cache
from typing import Any

import mujoco
from numba import cfunc, types

from models.contact.inputs import Array
from models.engines.contact_bridge import RailWheels, check_step
from models.engines.mujoco_layout import check_offsets

SLIDE, HINGE = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
JOINTS = ((SLIDE, (1.0, 0.0, 0.0)), (SLIDE, (0.0, 1.0, 0.0)), (SLIDE, (0.0, 0.0, 1.0)), (HINGE, (0.0, 0.0, 1.0)))


def rail_wheel_model(wheels: RailWheels, time_step: float = 1e-4, integrator: str = "Euler") -> mujoco.MjModel:
    """MuJoCo model of rail wheels on springs. The callback's numbers are stored in the model, so that one callback
    serves all models of the process.

    Refused is raised for a step that the integrator cannot take.
    """
    check_step("mujoco", wheels, integrator, time_step)
    spec = mujoco.MjSpec()
    spec.option.gravity, spec.option.timestep = [0.0, 0.0, 0.0], time_step
    spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    spec.compiler.degree = False
    spec.add_numeric(name="wheels", data=wheels.numbers, size=wheels.numbers.size)
    for _ in range(wheels.count):
        body = spec.worldbody.add_body(mass=wheels.mass, inertia=[wheels.inertia] * 3, explicitinertial=True)
        for (kind, axis), k, d in zip(JOINTS, wheels.stiffness, wheels.damping, strict=True):
            body.add_joint(type=kind, axis=axis, stiffness=k, damping=d)
    built = spec.compile()
    check_offsets(built, mujoco.MjData(built))
    return built


@cache
def empty_law() -> Any:
    """Compiled MuJoCo callback that does nothing."""

    @cfunc(types.void(types.voidptr, types.voidptr))
    def law(model, data):
        return

    return law


def python_law(add_forces: Callable[[Array, Array, Array, Array], Any]) -> Callable[[Any, Any], None]:
    """MuJoCo callback that calls a Python function ``add_forces`` with arrays: numbers, positions, rates, and the
    forces to which it adds."""
    return lambda model, data: add_forces(model.numeric_data, data.qpos, data.qvel, data.qfrc_passive)
