"""A vehicle in space in MuJoCo: native bodies and joints; forces through one compiled callback.

World axes are those of ride, z up. A body has one joint per freedom, in their order. MuJoCo counts bodies and joints
from the root of a tree to its leaves: a rider may come earlier there than in the vehicle. Masses and inertias are
written into the compiled model: MuJoCo refuses bodies without inertia, even where they never turn, and tensors that
no distribution of mass has, which published vehicles contain.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import mujoco
import numpy as np
from mujoco import rollout

from models.core.errors import RunFailed
from models.engines.mujoco import CHUNK
from models.engines.mujoco import INTEGRATORS as OWN_NAMES
from models.engines.mujoco_callback import installed
from models.engines.mujoco_layout import check
from models.engines.mujoco_quiet import quiet
from models.engines.protocol import Settings, guard
from models.engines.spatial_mujoco_callback import HEADER, PER_TIME, ROAD, spatial_law
from models.engines.spatial_mujoco_numbers import AXES, NONE, Numbers, elements, packed
from models.engines.spatial_protocol import (
    EngineKinematics,
    SpatialRun,
    curves,
    difference_step,
    jacobian,
    linear_vehicle,
    sound,
    timed,
)
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial import FREEDOMS, Body, SpatialVehicle, Vector


def _spec(vehicle: SpatialVehicle, step: float, carriers: Mapping[str, str] = NONE) -> mujoco.MjSpec:
    """Bodies and joints, with masses and inertias of 1 for the moment (see ``_weigh``).

    Their names are numbers: a user's body may be called "world". carriers : bodies that are one with the only one that
    rides on them, whose frame and name they get.
    """
    numbers = {body.name: str(i) for i, body in enumerate(vehicle.bodies)}
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.option.gravity = [0, 0, -vehicle.gravity]
    spec.option.timestep, spec.option.integrator = step, mujoco.mjtIntegrator.mjINT_RK4
    off = mujoco.mjtDisableBit
    spec.option.disableflags |= off.mjDSBL_AUTORESET | off.mjDSBL_CONTACT | off.mjDSBL_CONSTRAINT
    for body in (body for body in vehicle.bodies if body.name not in carriers):
        joined, parent = [body], body.parent
        while parent is not None and parent in carriers:
            joined.insert(0, vehicle.body(parent))
            parent = joined[0].parent
        below = spec.worldbody if parent is None else spec.body(numbers[parent])
        origin = (0.0, 0.0, 0.0) if parent is None else vehicle.body(parent).position
        own = below.add_body(
            name=numbers[body.name],
            pos=np.subtract(body.position, origin),
            ipos=[0, 0, 0],
            mass=1.0,
            iquat=_principal(body)[1],
            inertia=[1.0, 1.0, 1.0],
            explicitinertial=True,
        )
        for one in joined:
            _join(own, one, numbers[one.name], np.subtract(one.position, body.position))
    return spec


def _join(own: Any, body: Body, number: str, place: np.ndarray) -> None:
    """Joints of a vehicle's body in one of MuJoCo's, at a place (m) there."""
    for freedom in (freedom for freedom in FREEDOMS if freedom in body.freedoms):
        turns = freedom.startswith("r")
        kind = mujoco.mjtJoint.mjJNT_HINGE if turns else mujoco.mjtJoint.mjJNT_SLIDE
        own.add_joint(name=f"{number} {freedom}", type=kind, axis=AXES[freedom], pos=place)


def _principal(body: Body) -> tuple[np.ndarray, np.ndarray]:
    """Principal inertias (3,) and the quaternion of their axes; nothing turns where there are no products."""
    tensor, quaternion = np.array(body.inertia, float), np.array([1.0, 0.0, 0.0, 0.0])
    if np.array_equal(tensor, np.diag(tensor.diagonal())):
        return tensor.diagonal(), quaternion
    principal, axes = np.linalg.eigh(tensor)
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(axes).ravel())
    return principal, quaternion


def _weigh(model: mujoco.MjModel, numbers: Numbers, bodies: tuple[Body, ...]) -> None:
    """Give the bodies their masses and principal inertias, summed where they are one."""
    model.body_mass[1:] = model.body_inertia[1:] = 0.0
    for body in bodies:
        number = numbers.bodies[body.name]
        model.body_mass[number] += body.mass
        model.body_inertia[number] += _principal(body)[0]
    mujoco.mj_setConst(model, mujoco.MjData(model))


def _compiled(
    vehicle: SpatialVehicle, step: float, integrator: str, speed: float | None, road: np.ndarray, per_time: float
) -> mujoco.MjModel:
    """The model with all numbers of the callback in its numeric data."""
    spec = _spec(vehicle, step)
    spec.option.integrator = OWN_NAMES[integrator]
    plain = spec.compile()
    content = packed(vehicle, elements(vehicle, speed), plain, Numbers(vehicle, plain))
    begins = HEADER + len(content.numbers)
    header = [per_time, len(road), len(vehicle.tyres), *content.counts, begins]
    spec.add_numeric(name="vehicle", size=begins + road.size, data=[0.0])
    model = spec.compile()
    model.numeric_data[:] = np.concatenate([header, content.numbers, road.ravel()])
    _weigh(model, Numbers(vehicle, model), vehicle.bodies)
    return model


class SpatialMujoco:
    """One vehicle in one MuJoCo model."""

    def __init__(
        self, vehicle: SpatialVehicle, settings: Settings | None, speed: float | None, road: np.ndarray | None
    ) -> None:
        self.vehicle, self.settings = vehicle, settings
        self._flat = np.zeros(2 * len(vehicle.tyres))
        step, integrator = (settings.step, settings.integrator) if settings else (1e-3, "RK4")
        table = self._flat[None, :] if road is None else road
        self.model = _compiled(vehicle, step, integrator, speed, table, 0.0 if road is None else 2.0 / step)
        self.data = mujoco.MjData(self.model)
        self.numbers = Numbers(vehicle, self.model)
        self.law: Any = spatial_law()
        check(self.model, self.data)

    @contextmanager
    def _forces(self) -> Iterator[None]:
        """The callback is installed; refused where another one is."""
        if mujoco.get_mjcb_control() is not None or mujoco.get_mjcb_passive() is not None:
            raise RunFailed("mujoco", "another callback is installed in this process: its forces would act here, too")
        with installed(self.law):
            yield

    @contextmanager
    def _still(self) -> Iterator[np.ndarray]:
        """The callback reads the row (2 w,) of the road that is given here, at every time."""
        numbers = self.model.numeric_data
        first = int(numbers[ROAD])
        row = numbers[first : first + len(self._flat)]
        before = numbers[PER_TIME], row.copy()
        numbers[PER_TIME] = 0.0
        try:
            with self._forces():
                yield row
        finally:
            numbers[PER_TIME], row[:] = before

    def acceleration(self, q: np.ndarray, v: np.ndarray, road: np.ndarray | None = None) -> np.ndarray:
        """Accelerations (n,) at positions and rates (n,); ``road`` (2 w,) as in the protocol."""
        with self._still() as row:
            row[:] = self._flat if road is None else road
            return self._acceleration(q, v)

    def _acceleration(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        columns = self.numbers.columns
        self.data.time, self.data.qpos[columns], self.data.qvel[columns] = 0.0, q, v
        mujoco.mj_forward(self.model, self.data)
        return self.data.qacc[columns]

    def linearise(self) -> LinearVehicle:
        """M from MuJoCo; D, K and the road's columns by central differences of the acceleration, callback included."""
        n, zero, h = self.model.nv, np.zeros(self.model.nv), difference_step(self.vehicle)
        with self._still() as row:
            row[:] = 0.0
            stiffness = jacobian(lambda q: self._acceleration(q, zero), n, h)
            damping = jacobian(lambda v: self._acceleration(zero, v), n, h)
            road = jacobian(lambda z: self._on_road(row, z), len(row), h)
            row[:] = 0.0
            self._acceleration(zero, zero)
        mass = np.empty((n, n))
        mujoco.mj_fullM(self.model, self.data, mass)
        mass = mass[np.ix_(self.numbers.columns, self.numbers.columns)]
        motion = EngineKinematics(self.vehicle, self._shift, self._turn)
        return linear_vehicle("mujoco", self.vehicle, motion, mass, -mass @ damping, -mass @ stiffness, mass @ road)

    def _on_road(self, row: np.ndarray, road: np.ndarray) -> np.ndarray:
        """Accelerations in the design position on a road (2 w,)."""
        row[:] = road
        return self._acceleration(np.zeros(self.model.nv), np.zeros(self.model.nv))

    def _shift(self, body: str, point: Vector) -> np.ndarray:
        return self._jacobians(body, np.array(point, float))[0]

    def _turn(self, body: str) -> np.ndarray:
        return self._jacobians(body, np.zeros(3))[1]

    def _jacobians(self, body: str, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(3, n) of a point and of its body's turning, in the design position."""
        shift, turn = np.empty((2, 3, self.model.nv))
        self.data.qpos[:] = 0.0
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_jac(self.model, self.data, shift, turn, point, self.numbers.bodies[body])
        return shift[:, self.numbers.columns], turn[:, self.numbers.columns]

    def run(self, q: np.ndarray, v: np.ndarray) -> SpatialRun:
        """March from positions and rates (n,) over the duration; RunFailed unless all of it is finite and sane."""
        own, size = timed("mujoco", self.settings), self.model.nv
        both = 1 + np.concatenate((self.numbers.columns, size + self.numbers.columns))
        path = np.empty((own.steps + 1, 1 + 2 * size))
        path[0, 0], path[0, both] = 0.0, np.concatenate((q, v))
        for warning in self.data.warning:
            warning.number = 0
        times = own.step * np.arange(own.steps + 1)
        with self._forces(), quiet():
            self._advance(path, times, own)
        counts = {"steps": own.steps, "force calls": (4 if own.integrator == "RK4" else 1) * own.steps}
        states = path[:, 1:] if (np.diff(both) == 1).all() else path[:, both]
        return sound("mujoco", own, times, states, self._warned(), counts)

    def _advance(self, path: np.ndarray, times: np.ndarray, own: Settings) -> None:
        """March in chunks, so that a run that has failed is not carried to its end; ``path``: time and state."""
        for first in range(0, own.steps, CHUNK):
            after = slice(first + 1, min(first + CHUNK, own.steps) + 1)
            found = path[after]
            rollout.rollout(self.model, self.data, path[None, first], nstep=len(found), state=found[None])
            late = np.abs(found[:, 0] - times[after]) > 1e-6 * own.duration
            if late.any() or self._warned():
                last = first + (int(np.argmax(late)) if late.any() else len(found))
                guard("mujoco", times[: last + 1], path[: last + 1, 1:], times[last])
                raise RunFailed("mujoco", f"the engine gave up{self._warned()}", times[last], path[last, 1:])

    def _warned(self) -> str:
        """What MuJoCo itself noticed, as a phrase; empty if nothing."""
        found = [mujoco.mjtWarning(i).name for i in range(len(self.data.warning)) if self.data.warning[i].number]
        return f"; MuJoCo warned {', '.join(found)}" if found else ""

    def plan(self) -> dict[str, int]:
        """What was built: degrees of freedom, native items, callbacks, and curves within them."""
        return {
            "degrees of freedom": self.model.nv,
            "native items": self.model.nbody - 1 + self.model.njnt,
            "callbacks": 1,
            "curves": curves(self.vehicle),
        }


def build(
    vehicle: SpatialVehicle, settings: Settings | None, speed: float | None, road: np.ndarray | None
) -> SpatialMujoco:
    """The MuJoCo model of a vehicle in space."""
    return SpatialMujoco(vehicle, settings, speed, road)
