"""What guides transmit, by the engines' own joint forces: MuJoCo's force sensors, Exudyn's constraints.

Here springs, mounts, bars and hubs are loads at their points, worked out from where the engine says that these are;
the chassis takes what they leave, so that they are forces inside.
"""

import mujoco
import numpy as np

from models.engines.mujoco_quiet import quiet
from models.engines.spatial_mujoco import Numbers, _spec, _weigh
from models.hub_forces.cut_vehicle import CutVehicle
from models.measured.sections import guided


def mujoco_guides(vehicle: CutVehicle, q: np.ndarray, v: np.ndarray, wrenches: np.ndarray) -> np.ndarray:
    """Force and moment (guides, 6) on every guided body in its own axes, at coordinates and rates (n,).

    wrenches (h, 6) : at the hubs, in the axes of what they carry.
    """
    spec = _spec(vehicle.tree, 1e-3)
    names = {body.name: str(i) for i, body in enumerate(vehicle.tree.bodies)}
    for name in guided(vehicle):
        spec.body(names[name]).add_site(name=names[name])
        for kind in ("force", "torque"):
            sensor = getattr(mujoco.mjtSensor, f"mjSENS_{kind.upper()}")
            spec.add_sensor(name=f"{kind} {names[name]}", type=sensor, objtype=mujoco.mjtObj.mjOBJ_SITE,
                            objname=names[name])  # fmt: skip
    with quiet():
        model = spec.compile()
        _weigh(model, Numbers(vehicle.tree, model), vehicle.tree.bodies)
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[:] = q, v
        mujoco.mj_forward(model, data)
        loads = _Loads(vehicle, model, data, names)
        for i, tyre in enumerate(vehicle.whole.tyres):
            turn = data.xmat[loads.ids[tyre.body]].reshape(3, 3)
            place, _ = loads.point(tyre.body, np.array(tyre.point))
            loads.add(tyre.body, place, turn @ wrenches[i, :3], turn @ wrenches[i, 3:])
        loads.add_elements()
        mujoco.mj_forward(model, data)
    return data.sensordata.reshape(-1, 6).copy()


class _Loads:
    """Loads on bodies of a MuJoCo model at their centres."""

    def __init__(self, vehicle: CutVehicle, model: mujoco.MjModel, data: mujoco.MjData, names: dict[str, str]) -> None:
        self.vehicle, self.model, self.data = vehicle, model, data
        self.ids = {name: int(model.body(number).id) for name, number in names.items()}

    def point(self, body: str, design: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Place and velocity of a point of a body."""
        number, jacobian = self.ids[body], np.zeros((3, self.model.nv))
        arm = design - np.array(self.vehicle.tree.body(body).position)
        place = self.data.xpos[number] + self.data.xmat[number].reshape(3, 3) @ arm
        mujoco.mj_jac(self.model, self.data, jacobian, None, place, number)
        return place, jacobian @ self.data.qvel

    def add(self, body: str, place: np.ndarray, force: np.ndarray, moment: np.ndarray) -> None:
        """A force at a place and a moment, in space."""
        number = self.ids[body]
        self.data.xfrc_applied[number, :3] += force
        self.data.xfrc_applied[number, 3:] += moment + np.cross(place - self.data.xpos[number], force)

    def add_elements(self) -> None:
        """Springs, mounts and bars; d' is beside the turning chassis."""
        chassis = self.ids[self.vehicle.chassis]
        turn, spin = self.data.xmat[chassis].reshape(3, 3), np.zeros(6)
        mujoco.mj_objectVelocity(self.model, self.data, mujoco.mjtObj.mjOBJ_BODY, chassis, spin, 0)
        for e in self.vehicle.elements:
            axis = turn @ e.axis
            (one, fast_one), (two, fast_two) = self.point(e.one, e.point_one), self.point(e.two, e.point_two)
            travel = axis @ (two - one) - e.axis @ (e.point_two - e.point_one)
            rate = axis @ (fast_two - fast_one - np.cross(spin[:3], two - one))
            force = (e.held + e.stiffness * travel + e.damping * rate) * axis
            for body, place, part in ((e.one, one, force), (e.two, two, -force)):
                if body != self.vehicle.chassis:
                    self.add(body, place, part, np.zeros(3))
                    self.add(self.vehicle.chassis, place, -part, np.zeros(3))
