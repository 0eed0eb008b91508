"""The pitch-plane vehicle in MuJoCo: native joints, tendons and actuators; sampled input through a compiled callback.

World axes are the description's own (x forward, y right, z down), so gravity is (0, 0, +g) and the
hinge about +y lifts the front. A strut with exact geometry is a site actuator whose reference site sits
on the wheel, which does not rotate; with linear geometry it is a fixed tendon. MuJoCo's own equality
constraints are soft (a fifth of the enforced moment is lost), so a prescribed pitch uses the model
without that joint, and inverse dynamics of the full one for the moment.
"""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from models.core.errors import RunFailed
from models.core.trajectory import Trajectory
from models.engines.assembly import Assembly, Settings
from models.engines.mujoco_march import FORCE_CALLS, march
from models.engines.mujoco_quiet import installed_callback
from models.engines.protocol import check_landings, check_trajectory
from models.vehicles.description import PlaneVehicle, Strut

INTEGRATORS = {
    "RK4": mujoco.mjtIntegrator.mjINT_RK4,
    "Euler": mujoco.mjtIntegrator.mjINT_EULER,
    "implicit": mujoco.mjtIntegrator.mjINT_IMPLICIT,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "discrete": mujoco.mjtIntegrator.mjINT_DISCRETE,
}
"""MuJoCo's number of each integrator."""


def specification(
    vehicle: PlaneVehicle, run_settings: Settings, prescribed_coordinates: Collection[int] = ()
) -> mujoco.MjSpec:
    """MuJoCo specification with bodies and joints of the vehicle, without joints for the prescribed coordinates
    ``prescribed_coordinates``, which stay at zero."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.option.gravity = [0, 0, vehicle.gravity]
    spec.option.timestep = run_settings.step
    spec.option.integrator = INTEGRATORS[run_settings.integrator]
    off = mujoco.mjtDisableBit
    spec.option.disableflags |= off.mjDSBL_AUTORESET | off.mjDSBL_CONTACT | off.mjDSBL_CONSTRAINT
    places = {axle.wheel: axle.x for axle in vehicle.axles}
    joints = {place for i, place in enumerate(vehicle.coordinates()) if i not in prescribed_coordinates}
    for body in vehicle.bodies:
        body_spec = spec.worldbody.add_body(
            name=body.name,
            pos=[places.get(body.name, 0.0), 0, 0],
            mass=body.mass,
            ipos=[0, 0, 0],
            inertia=[body.pitch_inertia or 1.0] * 3,
            explicitinertial=True,
        )
        if (body.name, "z") in joints:
            body_spec.add_joint(name=f"{body.name} z", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0, 1])
        if (body.name, "pitch") in joints:
            body_spec.add_joint(name=f"{body.name} pitch", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 1, 0])
    for strut in (strut for strut in vehicle.struts if not strut.pushes_only):
        if strut.lower.body is None:
            joint = spec.joint(f"{strut.upper.body} z")
            joint.stiffness[0], joint.damping[0] = strut.stiffness, strut.damping
        else:
            _add_suspension(spec, vehicle, strut, joints)
    for spring in (spring for spring in vehicle.pitch_springs if not spring.dead_band):
        joint = spec.joint(f"{spring.body} pitch")
        joint.stiffness[0] += spring.stiffness
        joint.damping[0] += spring.damping
    return spec


def _add_suspension(
    mujoco_spec: mujoco.MjSpec, vehicle: PlaneVehicle, strut: Strut, free_joints: set[tuple[str, str]]
) -> None:
    """Add a suspension strut: as a fixed tendon with linear geometry, or as a site actuator with exact geometry."""
    if vehicle.geometry == "linear":
        tendon = mujoco_spec.add_tendon(name=strut.name, springlength=[0, 0])
        tendon.stiffness[0], tendon.damping[0] = strut.stiffness, strut.damping
        upper, lower = strut.upper.body, strut.lower.body
        arms = {(upper, "z"): 1.0, (lower, "z"): -1.0, (upper, "pitch"): -strut.upper.x}
        for (body, kind), arm in arms.items():
            if (body, kind) in free_joints:
                tendon.wrap_joint(f"{body} {kind}", arm)
        return
    mujoco_spec.body(strut.upper.body).add_site(name=f"{strut.name} upper", pos=[strut.upper.x, 0, 0])
    mujoco_spec.body(strut.lower.body).add_site(name=f"{strut.name} lower")
    mujoco_spec.add_actuator(
        name=strut.name,
        target=f"{strut.name} upper",
        refsite=f"{strut.name} lower",
        trntype=mujoco.mjtTrn.mjTRN_SITE,
        gear=[0, 0, 1, 0, 0, 0],
        gainprm=[0.0] * 10,
        biastype=mujoco.mjtBias.mjBIAS_AFFINE,
        biasprm=[0, -strut.stiffness, -strut.damping, *[0] * 7],
    )


@dataclass
class ModelInput:
    """Input of a MuJoCo model: a table (rows, columns) of generalised forces per half step, controls (n, 2), lever arms
    (m), and the callback ``law``.

    Where tyres only push, the table has the road, heights and rates, and ``tyres`` stiffness and damping of each.
    """

    table: np.ndarray | None = None
    controls: np.ndarray | None = None
    arms: np.ndarray | None = None
    law: Any = None
    tyres: tuple[float, ...] = ()


def _model_input(assembly: Assembly, run_settings: Settings) -> ModelInput:
    """The model's input, with a callback where native items cannot apply it: for tables, forces that turn, and springs
    or tyres that lose contact."""
    signal, h, n = assembly.input, run_settings.step, run_settings.steps
    slack = any(spring.dead_band for spring in assembly.vehicle.pitch_springs)
    slack = slack or any(tyre.pushes_only for tyre in assembly.vehicle.tyres)
    held = signal.sample(0.0, h, n)[:, :2] if signal is not None and signal.held else None
    native = signal is None or (held is not None and assembly.mode == "force" and assembly.moment is None)
    if native and not slack:
        return ModelInput(controls=held)
    from models.engines.mujoco_callback import body_fixed_law, pushing_law, table_law

    pushing = tuple(
        number for tyre in assembly.vehicle.tyres if tyre.pushes_only for number in (tyre.stiffness, tyre.damping)
    )
    if pushing:
        road = np.zeros((1, 4)) if signal is None else signal.sample(0.0, h / 2, 2 * n + 1)
        return ModelInput(road, law=pushing_law(), tyres=pushing)
    if native or signal is None:
        return ModelInput(None, held, None, table_law())
    inputs = signal.sample(0.0, h / 2, 2 * n + 1)
    moment = np.empty((2 * n + 1, 0)) if assembly.moment is None else assembly.moment.sample(0.0, h / 2, 2 * n + 1)
    if assembly.mode == "force-body":
        arms = np.array([axle.x for axle in assembly.vehicle.axles])
        return ModelInput(np.hstack([inputs[:, : 0 if signal.held else 2], moment]), held, arms, body_fixed_law())
    forces = _generalised_forces(assembly, inputs)
    if assembly.moment is not None:
        forces = np.column_stack([forces, np.zeros(len(forces)), moment])
    return ModelInput(forces, held, None, table_law())


def _generalised_forces(assembly: Assembly, input_rows: np.ndarray) -> np.ndarray:
    """Generalised forces (rows, 2 or 3) in N on the free heave coordinates that the input causes; motors apply forces
    that are held over a step."""
    if assembly.mode == "road":
        tyres = assembly.vehicle.tyres
        pushes = [
            tyre.stiffness * input_rows[:, i] + tyre.damping * input_rows[:, 2 + i] for i, tyre in enumerate(tyres)
        ]
        return np.column_stack(pushes)
    held = assembly.input is not None and assembly.input.held
    forces = np.zeros((len(input_rows), 2)) if held else -input_rows[:, :2]
    if not assembly.guided:
        return forces
    guidance = _guidance_forces(assembly, input_rows)
    guidance[:, :2] += forces
    return guidance


def _guidance_forces(assembly: Assembly, input_rows: np.ndarray) -> np.ndarray:
    """Generalised forces (rows, 2 or 3) in N on the free heave coordinates that the prescribed coordinates cause
    through the struts."""
    count = len(assembly.guided)
    path, rate = (input_rows[:, 2 + i * count : 2 + (i + 1) * count] for i in range(2))
    z, pitch, dz, turn = (
        (path[:, 0], path[:, 1], rate[:, 0], rate[:, 1]) if count == 2 else (0.0, path[:, 0], 0.0, rate[:, 0])
    )
    exact = assembly.vehicle.geometry == "exact"
    sine, cosine = (np.sin(pitch), np.cos(pitch)) if exact else (pitch, np.ones_like(pitch))
    forces = np.zeros((len(input_rows), 3))
    names = [body.name for body in assembly.vehicle.bodies]
    for strut in assembly.vehicle.struts:
        force = strut.stiffness * (z - strut.upper.x * sine) + strut.damping * (dz - strut.upper.x * turn * cosine)
        forces[:, names.index(str(strut.upper.body))] -= force
        forces[:, names.index(str(strut.lower.body))] += force
    return forces[:, : 4 - count]


def _compiled_model(
    assembly: Assembly, run_settings: Settings, model_input: ModelInput, prescribed_coordinates: Collection[int] = ()
) -> mujoco.MjModel:
    """The compiled MuJoCo model. Its numeric data hold the input table, after the numbers that ``mujoco_callback``
    reads."""
    spec = specification(assembly.vehicle, run_settings, prescribed_coordinates)
    gear = 0.0 if model_input.arms is not None else -1.0
    for axle in (
        assembly.vehicle.axles if model_input.controls is not None else ()
    ):  # motors for forces held over a step
        spec.add_actuator(
            name=f"{axle.name} force",
            target=f"{axle.wheel} z",
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
            gear=[gear, 0, 0, 0, 0, 0],
            gainprm=[1.0 if gear else 0.0, *[0] * 9],
        )
    if model_input.law is None:
        return spec.compile()
    arms = (0.0, 0.0) if model_input.arms is None else model_input.arms
    table = np.empty((0, 2)) if model_input.table is None else model_input.table
    motors = len(spec.actuators) - 2 if model_input.controls is not None else -1
    slack = [spring for spring in assembly.vehicle.pitch_springs if spring.dead_band]
    springs = [value for spring in slack for value in (spring.stiffness, spring.damping, spring.dead_band)]
    header = [2.0 / run_settings.step, table.shape[1], len(table), motors, *arms, len(springs), *springs]
    content = np.concatenate((header, model_input.tyres, table.ravel()))
    spec.add_numeric(name="input", size=len(content), data=[0.0])
    model = spec.compile()
    model.numeric_data[:] = content
    return model


class MujocoModel:
    """Model of one pitch-plane assembly in MuJoCo; a second model, with all joints, computes the force and moment of a
    prescribed motion."""

    def __init__(self, assembly: Assembly, run_settings: Settings) -> None:
        self.assembly, self.settings = assembly, run_settings
        self.signal: Any = assembly.input
        self.guided = list(assembly.guided)
        self.free = [i for i in range(4) if i not in self.guided]
        self.drive = _model_input(assembly, run_settings)
        for table in (self.drive.table, self.drive.controls):  # the discrete integrator skips a force that is no number
            if table is not None and not np.isfinite(table).all():
                raise RunFailed("mujoco", "the input holds an infinite value or one that is not a number")
        self.model = _compiled_model(assembly, run_settings, self.drive, self.guided)
        self.data = mujoco.MjData(self.model)
        if self.drive.law is not None:
            from models.engines.mujoco_layout import check_offsets

            check_offsets(self.model, self.data)

    def run(self) -> Trajectory:
        """Trajectory over the whole duration; raises RunFailed unless it is complete and finite."""
        n = self.settings.steps
        states, free = np.empty((n + 1, 8)), [*self.free, *(4 + i for i in self.free)]
        with installed_callback(self.drive.law):
            states[:, free] = march(self.model, self.data, self.assembly.initial[free], self.controls())
        times = self.settings.step * np.arange(n + 1)
        if self.guided:
            inputs = self.signal.sample(0.0, self.settings.step, n + 1)
            states[:, [*self.guided, *(4 + i for i in self.guided)]] = inputs[:, 2 : 2 + 2 * len(self.guided)]
        check_trajectory("mujoco", times, states, self.settings.duration)
        check_landings("mujoco", self.assembly, self.settings, times, states)
        enforced = self._enforced(times, states) if self.guided else None
        check_trajectory("mujoco", times, states, self.settings.duration, enforcing_forces=enforced)
        calls = n * FORCE_CALLS.get(self.settings.integrator, 1)
        return Trajectory(times, states, enforced, {"steps": n, "force calls": calls})

    def controls(self) -> np.ndarray:
        """Controls (steps, nu) of all nu actuators, the wheels' motors last; (steps, 0) without motors, as springs need
        no controls."""
        if self.drive.controls is None:
            return np.zeros((self.settings.steps, 0))
        padded = np.zeros((self.settings.steps, self.model.nu))
        padded[:, self.model.nu - 2 :] = self.drive.controls
        return padded

    def acceleration(self, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (4,) in m/s^2 and rad/s^2 at a time (s), from coordinates and rates (4,)."""
        out = np.empty(4)
        with installed_callback(self.drive.law):
            out[self.free] = self._free_acceleration(time, q, v, round(time / self.settings.step))
        if self.guided:
            out[self.guided] = self.signal.at(time)[-len(self.guided) :]
        return out

    def _free_acceleration(self, time: float, q: np.ndarray, v: np.ndarray, step_index: int) -> np.ndarray:
        """Accelerations of the coordinates that are not prescribed, at a time (s) and state within a given step of the
        run."""
        self.data.time, self.data.qpos[:], self.data.qvel[:] = time, q[self.free], v[self.free]
        if self.drive.controls is not None:
            self.data.ctrl[self.model.nu - 2 :] = self.drive.controls[min(step_index, len(self.drive.controls) - 1)]
        mujoco.mj_forward(self.model, self.data)
        return self.data.qacc

    def _enforced(self, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        """Force (N) and moment (N m) (n, guided) that enforce the prescribed motion, by inverse dynamics of a model
        with all joints.

        Wheel forces and motors act on the wheels' heave only, so the rows of the chassis need neither.
        """
        full = _compiled_model(self.assembly, self.settings, ModelInput())
        data, enforced = mujoco.MjData(full), np.empty((len(times), len(self.guided)))
        accelerations = np.empty((len(times), 4))
        with installed_callback(self.drive.law):
            for i, time in enumerate(times):
                accelerations[i, self.free] = self._free_acceleration(time, states[i, :4], states[i, 4:], i)
        signal = self.signal.sample(0.0, self.settings.step, len(times))
        accelerations[:, self.guided] = signal[:, -len(self.guided) :]
        for i, state in enumerate(states):
            data.qpos[:], data.qvel[:], data.qacc[:] = state[:4], state[4:], accelerations[i]
            mujoco.mj_inverse(full, data)
            mujoco.mj_fwdActuation(full, data)
            enforced[i] = data.qfrc_inverse[self.guided] - data.qfrc_actuator[self.guided]
        return enforced

    def plan(self) -> dict[str, int]:
        """Counts of built items: degrees of freedom, native items, callbacks."""
        native = self.model.nu + self.model.ntendon + int((self.model.jnt_stiffness != 0).sum())
        law = int(self.drive.law is not None)
        return {"degrees of freedom": self.model.nv, "native items": native, "callbacks": law}


def build(assembly: Assembly, run_settings: Settings) -> MujocoModel:
    """The MuJoCo model of a pitch-plane assembly."""
    return MujocoModel(assembly, run_settings)
