"""Rolling wheels in MuJoCo: the model, and creep forces by a native callback or by one that goes through Python."""

from collections.abc import Callable
from functools import cache
from typing import Any

import mujoco
import numpy as np
from mujoco import rollout
from numba import cfunc, types

from models.contact.inputs import Array
from models.core.errors import RunFailed
from models.core.waiting import marching
from models.engines.contact_bridge import Wheels, check_step, forces
from models.engines.mujoco_layout import check, offset
from models.machine.stack import array_at

JOINTS = (
    ("slide", (1.0, 0.0, 0.0)),
    ("slide", (0.0, 1.0, 0.0)),
    ("slide", (0.0, 0.0, 1.0)),
    ("hinge", (0.0, 0.0, 1.0)),
)


def model(wheels: Wheels, step: float = 1e-4, integrator: str = "Euler") -> mujoco.MjModel:
    """Wheels on springs; the callback's numbers lie in the model, so that it serves every model of the process.

    Refused is raised for a step that the integrator cannot take.
    """
    check_step("mujoco", wheels, integrator, step)
    spec = blank("wheels", wheels.numbers, integrator, [0.0, 0.0, 0.0])
    spec.option.timestep = step
    for _ in range(wheels.count):
        body = spec.worldbody.add_body(mass=wheels.mass, inertia=[wheels.inertia] * 3, explicitinertial=True)
        for joint, k, d in zip(JOINTS, wheels.stiffness, wheels.damping, strict=True):
            add_joint(body, *joint, stiffness=k, damping=d)
    return compiled(spec)


def blank(name: str, numbers: Array, integrator: str, gravity: Any) -> Any:
    """A specification without contacts and constraints; a callback's numbers lie in the model."""
    spec = mujoco.MjSpec()
    spec.option.gravity = gravity
    spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    spec.compiler.degree = False
    spec.add_numeric(name=name, data=numbers, size=numbers.size)
    return spec


def add_joint(body: Any, kind: str, axis: tuple[float, float, float], **more: Any) -> None:
    """A joint, "slide" or "hinge", along or about an axis; ``more`` : of MuJoCo's, such as stiffness or a name."""
    body.add_joint(type=getattr(mujoco.mjtJoint, f"mjJNT_{kind.upper()}"), axis=axis, **more)


def compiled(spec: Any) -> mujoco.MjModel:
    """The model of a specification, its layout checked."""
    built = spec.compile()
    check(built, mujoco.MjData(built))
    return built


@cache
def native_law(kernel: Any = forces) -> Any:
    """Compiled callback: a shell about a compiled kernel of (numbers, positions, rates, forces), kept on disk."""
    numbers = offset("mjModel", "numeric_data")
    position, rate, force = (offset("mjData", field) for field in ("qpos", "qvel", "qfrc_passive"))

    @cfunc(types.void(types.voidptr, types.voidptr))
    def law(model, data):
        kernel(array_at(model, numbers), array_at(data, position), array_at(data, rate), array_at(data, force))

    return law


@cache
def empty_law() -> Any:
    """Compiled callback that does nothing."""

    @cfunc(types.void(types.voidptr, types.voidptr))
    def law(model, data):
        return

    return law


def python_law(add: Callable[[Array, Array, Array, Array], Any]) -> Callable[[Any, Any], None]:
    """Callback by a Python function of numbers, positions, rates and the forces it adds to, all arrays."""
    return lambda model, data: add(model.numeric_data, data.qpos, data.qvel, data.qfrc_passive)


class Marcher:
    """Runs of one model in MuJoCo's own loop, in one thread or more."""

    def __init__(self, built: mujoco.MjModel, threads: int = 1) -> None:
        self.model, self._data = built, [mujoco.MjData(built) for _ in range(threads)]

    def run(self, states: Array, steps: int) -> Array:
        """States (n, steps, 2 m) of n runs from ``states`` (n, 2 m); RunFailed unless all of it is finite."""
        whole = np.concatenate((np.zeros((len(states), 1)), states), axis=1)
        with marching(lambda: self._data[0].time / (steps * self.model.opt.timestep)):
            path = rollout.rollout(self.model, self._data, whole, nstep=steps)[0][..., : 1 + 2 * self.model.nv]
        late = path[:, -1, 0] < (steps - 0.5) * self.model.opt.timestep
        failed = late | ~np.isfinite(path[:, -1]).all(axis=1)  # MuJoCo starts again at time zero where it gives up
        if failed.any():
            own = path[int(failed.argmax())]
            last = own[int(own[:, 0].argmax())]
            raise RunFailed("mujoco", "the engine gave up", float(last[0]), last[1:])
        return path[..., 1:]
