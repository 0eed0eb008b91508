"""Joint forces of guided bodies as the engines compute them: by MuJoCo's force sensors and Exudyn's constraints.

Here springs, mounts, bars and hubs are loads at their points, worked out from where MuJoCo says that these are; the
chassis takes what they leave, so that they are forces inside. In Exudyn the bodies are free and their guides are
constraints, which no tree of joints has.
"""

from typing import Any

import mujoco
import numpy as np

from models.engines.mujoco_quiet import without_warnings
from models.engines.mujoco_tree import MujocoIndices, mujoco_specification, set_masses
from models.systems.measured.sections import guided_bodies
from models.vehicles.cut_vehicle import GRAVITY, CutVehicle
from models.vehicles.spatial import FREEDOMS

STEP, STEPS = 3e-5, 4
"""Step (s) and number of steps in Exudyn: rounding and motion within the steps cause relative errors of 1e-6 each."""
MULTIPLIER_SIGNS = np.array([-1.0, -1.0, -1.0, -1.0, 1.0, 1.0])
"""Signs that turn Exudyn's multipliers of a generic joint into forces and moments on its second body."""


def mujoco_guides(vehicle: CutVehicle, q: np.ndarray, v: np.ndarray, hub_wrenches: np.ndarray) -> np.ndarray:
    """Force and moment (guides, 6) on each guided body by MuJoCo's sensors, in the body's axes, at coordinates and
    rates (n,).

    hub_wrenches (h, 6) : at the hubs, in the axes of what they carry.
    """
    return _LoadedModel(vehicle, q, v, hub_wrenches).data.sensordata.reshape(-1, 6).copy()


def exudyn_guides(vehicle: CutVehicle, q: np.ndarray, hub_wrenches: np.ndarray) -> np.ndarray:
    """Force and moment (guides, 6) on each guided body at rest by Exudyn's constraints, in the axes of the carrying
    body; exact if at most one angle is free."""
    import exudyn as exu
    from exudyn.rigidBodyUtilities import RotationMatrix2EulerParameters

    from models.engines.exudyn_system import KINDS, items

    loaded, container = _LoadedModel(vehicle, q, 0 * q, hub_wrenches), exu.SystemContainer()
    mbs: Any = container.AddSystem()
    objects, centres, sensors = dict[str, Any](), dict[str, Any](), list[Any]()
    for body in vehicle.uncut.bodies:
        i, (a, b, c) = loaded.ids[body.name], np.array(body.inertia, float) + 1e-6 * np.eye(3)
        pose = [*loaded.data.xpos[i], *RotationMatrix2EulerParameters(loaded.data.xmat[i].reshape(3, 3))]
        node = mbs.AddNode(items.NodeRigidBodyEP(referenceCoordinates=pose))
        objects[body.name] = mbs.AddObject(
            items.ObjectRigidBody(mass=body.mass, inertia=[a[0], b[1], c[2], b[2], a[2], a[1]], nodeNumber=node)
        )
        centres[body.name] = mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=objects[body.name]))
        loads = np.split(loaded.data.xfrc_applied[i] - GRAVITY * body.mass * np.eye(6)[2], 2)
        for kind, load in zip((items.LoadForceVector, items.LoadTorqueVector), loads, strict=True):
            mbs.AddLoad(kind(markerNumber=centres[body.name], loadVector=load.tolist()))
    for body in (vehicle.uncut.body(name) for name in guided_bodies(vehicle)):
        assert body.parent is not None
        arm = np.subtract(body.position, vehicle.uncut.body(body.parent).position)
        seat = mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=objects[body.parent], localPosition=arm.tolist()))
        joint = mbs.AddObject(
            items.ObjectJointGeneric(
                markerNumbers=[seat, centres[body.name]],
                constrainedAxes=[int(f not in body.freedoms) for f in FREEDOMS],
            )
        )
        sensors += [
            mbs.AddSensor(
                items.SensorObject(objectNumber=joint, storeInternal=True, writeToFile=False, outputVariableType=kind)
            )
            for kind in (KINDS.ForceLocal, KINDS.TorqueLocal)
        ]
    mbs.Assemble()
    options = exu.SimulationSettings()
    options.solution.file.write, options.solution.sensors.writePeriod = False, STEP
    ti = options.timeIntegration
    ti.numberOfSteps, ti.endTime, ti.verboseMode, ti.generalizedAlpha.spectralRadius = STEPS, STEPS * STEP, 0, 0.0
    mbs.SolveDynamic(options)
    return np.hstack([mbs.GetSensorStoredData(sensor)[-1, 1:] for sensor in sensors]).reshape(-1, 6) * MULTIPLIER_SIGNS


class _LoadedModel:
    """MuJoCo model of a cut vehicle at coordinates and rates (n,), with the forces of hubs and elements as loads on its
    bodies."""

    def __init__(self, vehicle: CutVehicle, q: np.ndarray, v: np.ndarray, hub_wrenches: np.ndarray) -> None:
        self.vehicle, spec = vehicle, mujoco_specification(vehicle.tree, 1e-3)
        names = {body.name: str(i) for i, body in enumerate(vehicle.tree.bodies)}
        for number in (names[name] for name in guided_bodies(vehicle)):
            spec.body(number).add_site(name=number)
            for kind in (mujoco.mjtSensor.mjSENS_FORCE, mujoco.mjtSensor.mjSENS_TORQUE):
                spec.add_sensor(name=f"{kind} {number}", type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=number)
        with without_warnings():
            self.model = spec.compile()
            set_masses(self.model, MujocoIndices(vehicle.tree, self.model), vehicle.tree.bodies)
            self.data = mujoco.MjData(self.model)
            self.ids = {name: int(self.model.body(number).id) for name, number in names.items()}
            self.data.qpos[:], self.data.qvel[:] = q, v
            mujoco.mj_forward(self.model, self.data)
            self._load_hubs(hub_wrenches)
            self._load_elements()
            mujoco.mj_forward(self.model, self.data)

    def _point(self, body_name: str, design_position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Position (m) and velocity (m/s) in space of a point fixed to a body, given by its design position (m)."""
        number, jacobian = self.ids[body_name], np.zeros((3, self.model.nv))
        arm = design_position - np.array(self.vehicle.tree.body(body_name).position)
        position = self.data.xpos[number] + self.data.xmat[number].reshape(3, 3) @ arm
        mujoco.mj_jac(self.model, self.data, jacobian, None, position, number)
        return position, jacobian @ self.data.qvel

    def _add_load(
        self, body_name: str, force_point: np.ndarray, force: np.ndarray, moment: np.ndarray | float = 0.0
    ) -> None:
        """Add a force (N) at a point and a moment (N m), both in axes of space, to the loads of a body."""
        number = self.ids[body_name]
        self.data.xfrc_applied[number, :3] += force
        self.data.xfrc_applied[number, 3:] += moment + np.cross(force_point - self.data.xpos[number], force)

    def _load_hubs(self, hub_wrenches: np.ndarray) -> None:
        for tyre, wrench in zip(self.vehicle.uncut.tyres, hub_wrenches, strict=True):
            turn = self.data.xmat[self.ids[tyre.body]].reshape(3, 3)
            position, _ = self._point(tyre.body, np.array(tyre.point))
            self._add_load(tyre.body, position, turn @ wrench[:3], turn @ wrench[3:])

    def _load_elements(self) -> None:
        """Apply the forces of springs, mounts and bars to their bodies; travel rates are relative to the rotating
        chassis."""
        chassis, spin = self.ids[self.vehicle.chassis], np.zeros(6)
        turn = self.data.xmat[chassis].reshape(3, 3)
        mujoco.mj_objectVelocity(self.model, self.data, mujoco.mjtObj.mjOBJ_BODY, chassis, spin, 0)
        for e in self.vehicle.elements:
            axis = turn @ e.axis
            (from_point, fast_one), (second_position, fast_two) = (
                self._point(e.first_body, e.first_point),
                self._point(e.second_body, e.second_point),
            )
            travel = axis @ (second_position - from_point) - e.axis @ (e.second_point - e.first_point)
            rate = axis @ (fast_two - fast_one - np.cross(spin[:3], second_position - from_point))
            force = (e.preload + e.stiffness * travel + e.damping * rate) * axis
            for body, point_position, signed_force in (
                (e.first_body, from_point, force),
                (e.second_body, second_position, -force),
            ):
                if body != self.vehicle.chassis:
                    self._add_load(body, point_position, signed_force)
                    self._add_load(self.vehicle.chassis, point_position, -signed_force)
