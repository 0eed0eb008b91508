"""The car R19-free and an asymmetric car, on tyres or cut at their wheels, and functions that check them."""

from dataclasses import replace
from functools import cache
from typing import Any

import mujoco
import numpy as np

from models.engines.cut_vehicle import HubModel
from models.engines.free_vehicle_mujoco import FreeMujoco
from models.multibody import forces as at
from models.multibody.cut_kernel import WRENCH
from models.multibody.cut_table import HubInputs
from models.multibody.numbers import Handling
from models.tyre.bristles import brush_forces
from models.vehicles.cut_vehicle import CutVehicle, cut_at_hubs
from models.vehicles.spatial import Curve, SpatialVehicle, SpringDamper
from models.vehicles.vehicle_file import load_vehicle

SEED = 31
"""Seed of the random forces and moments at the hubs."""


@cache
def r19() -> CutVehicle:
    """The shipped car R19-free, cut at its wheels."""
    return cut_at_hubs(load_vehicle("r19_free"), "body")


def twin() -> SpatialVehicle:
    """The car R19-free without any symmetry: every spring, mount and body has other parameters."""
    full_vehicle = load_vehicle("r19_free")
    springs = tuple(
        replace(s, stiffness=s.stiffness * (1 + 0.02 * i), damping=s.damping * (1.3 - 0.02 * i))
        for i, s in enumerate(full_vehicle.springs)
    )
    bodies = tuple(replace(b, mass=b.mass * (1 + 0.03 * i)) for i, b in enumerate(full_vehicle.bodies))
    chassis = replace(bodies[0], inertia=((200.0, 15.0, -10.0), (15.0, 1390.0, 8.0), (-10.0, 8.0, 1617.0)))
    return replace(full_vehicle, springs=springs, bodies=(chassis, *bodies[1:]))


@cache
def rough_car() -> CutVehicle:
    """The asymmetric car, cut at its wheels, with bump stops, digressive dampers and dry friction in suspension and
    mounts.

    One wheel moves in all three directions, on a spring along none of them; one seat has no spring but a curve.
    """
    full_vehicle, skew = twin(), tuple((np.array([0.2, 0.95, -0.3]) / np.linalg.norm([0.2, 0.95, -0.3])).tolist())
    wheel = full_vehicle.tyres[0]
    bodies = tuple(replace(b, freedoms=("x", "y", "z")) if b.name == wheel.body else b for b in full_vehicle.bodies)
    lateral = SpringDamper("lateral", "body", wheel.body, wheel.point, wheel.point, skew, 2e5, 800.0)
    seat = Curve((-0.1, 0.1), (-1500.0, 1500.0))
    stop = Curve((-0.08, -0.02, 0.0, 0.015, 0.05), (-3000.0, -200.0, 0.0, 100.0, 2500.0))
    damper = Curve((-1.0, -0.1, 0.0, 0.1, 1.0), (-900.0, -300.0, 0.0, 200.0, 500.0))
    law_sets: tuple[dict[str, Any], ...] = (
        {"travel_force": stop},
        {"rate_force": damper},
        {"friction": 80.0, "friction_rate": 0.02},
        {},
    )
    springs = [replace(s, **law_sets[i % 4]) for i, s in enumerate(full_vehicle.springs)]
    springs[-1] = replace(springs[-1], stiffness=0.0, travel_force=seat)
    return cut_at_hubs(replace(full_vehicle, bodies=bodies, springs=(*springs, lateral)), "body")


def static_forces(vehicle: CutVehicle, row_count: int, force_frame: str = "hub") -> HubInputs:
    """Hub input of ``row_count`` equal rows: the vertical hub forces that carry the vehicle at rest."""
    forces = np.zeros((row_count, WRENCH * len(vehicle.hubs)))
    forces[:, 2::WRENCH] = vehicle.loads
    return HubInputs(forces, force_frame)


def random_states(vehicle: CutVehicle, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Random coordinates (n,) and rates (n,) of a cut vehicle: any heading, roll and pitch of the chassis up to 1
    rad."""
    rng = np.random.default_rng(seed)
    q, v = rng.uniform(-0.03, 0.03, vehicle.size), rng.uniform(-0.5, 0.5, vehicle.size)
    q[:6] = *rng.uniform(-5, 5, 3), rng.uniform(-3, 3), *rng.uniform(-1, 1, 2)
    return q, v


def random_wrenches(vehicle: CutVehicle, force_frame: str, has_guide: bool) -> HubInputs:
    """Hub input with random forces and moments on every hub; ``has_guide`` : with a prescribed random chassis
    motion."""
    rng = np.random.default_rng(SEED)
    hub_inputs = static_forces(vehicle, 3, force_frame)
    hubs = hub_inputs.hubs + rng.normal(0, 500.0, hub_inputs.hubs.shape[1])
    return replace(hub_inputs, hubs=hubs, guide=rng.normal(0, 0.1, (1, 6)).repeat(3, axis=0) if has_guide else None)


def hub_forces_by_jacobians(
    hub_model: HubModel, q: np.ndarray, wrenches: np.ndarray, force_frame: str = "hub"
) -> np.ndarray:
    """Generalised forces (n,) of forces and moments (6 h,) at h hubs, by MuJoCo's Jacobians; ``force_frame`` : their
    axes, of the hubs or "inertial"."""
    assert isinstance(hub_model.model, FreeMujoco)
    model, names = hub_model.model.model, [body.name for body in hub_model.vehicle.tree.bodies]
    data, forces = mujoco.MjData(model), np.zeros(hub_model.size)
    data.qpos[:] = q
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    for tyre, wrench in zip(hub_model.vehicle.uncut.tyres, wrenches.reshape(-1, 2, 3), strict=True):
        body = int(model.body(str(names.index(tyre.body))).id)
        force, moment = wrench if force_frame == "inertial" else wrench @ data.xmat[body].reshape(3, 3).T
        mujoco.mj_applyFT(model, data, force, moment, data.xpos[body], body, forces)
    return forces


def cornering_error(handling_car: Handling, slip_angle: float = 1e-7) -> float:
    """Largest relative error of the tyres' cornering stiffnesses at their static loads: from the brush tyres of a
    handling car, against those of the vehicle file."""
    wanted, worst = {force.name: force.stiffness for force in handling_car.given.side_forces}, 0.0
    for i, tyre in enumerate(handling_car.vehicle.tyres):
        n = handling_car.tyre_numbers(i)
        half = np.sqrt(n[at.RADIUS] * n[at.STATIC] / n[at.VERTICAL])
        slides = np.array([[0, slip_angle, 0, 1.0]])
        force = brush_forces(n[at.STATIC], n[at.GRIP], half, n[at.HALF_WIDTH], n[at.BRISTLES], slides)[0, 1]
        worst = max(worst, abs(float(-force / slip_angle) / wanted[tyre.name] - 1.0))
    return worst


def mirrored_coordinates(handling_car: Handling, coordinate_values: np.ndarray) -> np.ndarray:
    """Coordinates, or their rates, (..., n) of the mirror image of a car, with left and right exchanged."""
    coordinates = handling_car.vehicle.coordinates()
    swap = [coordinates.index((_opposite_body(name), freedom)) for name, freedom in coordinates]
    return (
        np.array([-1.0 if freedom in ("y", "rx", "rz") else 1.0 for _, freedom in coordinates])
        * coordinate_values[..., swap]
    )


def _opposite_body(body_name: str) -> str:
    """Name of the corresponding body on the opposite side of the car."""
    for left, right in (("fl", "fr"), ("rl", "rr"), ("left", "right")):
        for side, opposite in ((left, right), (right, left)):
            if body_name.startswith(side):
                return body_name.replace(side, opposite, 1)
    return body_name
