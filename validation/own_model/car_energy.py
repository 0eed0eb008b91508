"""Energies of the saloon car of ``cars`` at random states, beside those of MuJoCo's own model of the same file."""

import mujoco
import numpy as np

from models.engines.spatial_reference import SpatialReference
from models.multibody.numbers import Handling
from models.systems.handling.energy import bodies_energy
from models.vehicles.free_vehicle import rotor_name
from validation.own_model.cars import CORNERS, SALOON

REVERSED_JOINTS = ("rl swing", "rr swing", "rl spin", "rr spin")
"""Joints of the file whose axes point along -y."""


def largest_energy_difference(handling_car: Handling, state_count: int) -> float:
    """Largest difference between MuJoCo's energies and twinrig's (kinetic, gravity and springs) at ``state_count``
    random states, divided by the largest energy.

    Equal energies at all states are equal equations of motion, but for dampers and tyres.
    """
    draw, n = np.random.default_rng(1), len(handling_car.vehicle.coordinates())
    states = [(draw.uniform(-0.3, 0.3, n), draw.uniform(-3.0, 3.0, n)) for _ in range(state_count)]
    pairs = np.array(
        [(_energy_by_mujoco(handling_car, *each), _energy_by_description(handling_car, *each)) for each in states]
    )
    return float(np.abs(np.diff(pairs, axis=1)).max() / np.abs(pairs).max())


def _coordinate_names() -> dict[str, tuple[str, str]]:
    """For the name of each joint of the file, the (body, freedom) of the vehicle's coordinate that it stands for."""
    places = {"engine roll": ("engine joint 1", "rx"), "engine bounce": ("engine", "z")}
    for name in CORNERS:
        front = name.startswith("f")
        places[f"{name} {'travel' if front else 'swing'}"] = (
            (f"{name} strut", "z") if front else (f"{name} arm joint 1", "ry")
        )
        places[f"{name} spin"] = (rotor_name(name), "ry")
    return places


def _energy_by_mujoco(handling_car: Handling, q: np.ndarray, v: np.ndarray) -> float:
    """Energy (J), kinetic, of gravity and of springs, by MuJoCo's own model of the file, at coordinates and rates
    (n,)."""
    model = mujoco.MjModel.from_xml_string(SALOON)
    data, coordinates = mujoco.MjData(model), handling_car.vehicle.coordinates()
    motion = SpatialReference(handling_car.vehicle).motions_of(q, v)["body"]
    arm, turning = motion.rotation @ model.body("body").ipos, motion.turn @ v
    data.qpos[:3], data.qvel[:3] = motion.centre - arm, motion.shift @ v - np.cross(turning, arm)
    mujoco.mju_mat2Quat(data.qpos[3:7], motion.rotation.ravel())
    data.qvel[3:6] = motion.rotation.T @ turning
    for name, place in _coordinate_names().items():
        joint, sign = model.joint(name), -1.0 if name in REVERSED_JOINTS else 1.0
        i = [*coordinates].index(place)  # type: ignore[arg-type]
        data.qpos[joint.qposadr], data.qvel[joint.dofadr] = sign * q[i], sign * v[i]
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    mujoco.mj_forward(model, data)
    mass = np.empty((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    return float(data.energy[0] + 0.5 * data.qvel @ mass @ data.qvel)


def _energy_by_description(handling_car: Handling, q: np.ndarray, v: np.ndarray) -> float:
    """Energy (J) of bodies and springs by twinrig's description of the vehicle, at coordinates and rates (n,); springs
    have no preload, as in MuJoCo's file."""
    places, springs = handling_car.vehicle.coordinates(), 0.0
    for e in handling_car.vehicle.joint_elements:
        travel = sum(k * q[places.index(at)] for at, k in zip(e.coordinates, e.factors, strict=True))
        springs += 0.5 * e.stiffness * travel**2
    return bodies_energy(handling_car, q, v) + springs
