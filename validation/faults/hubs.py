"""Faults of measured hub forces, planted where a vehicle's table takes them up; what sees them."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import mujoco
import numpy as np

from models.engines.cut_vehicle import EngineHubs
from models.engines.free_vehicle_mujoco import FreeMujoco
from models.multibody.cut_kernel import WRENCH, forces
from models.multibody.cut_table import Drive
from models.vehicles.cut_vehicle import CutVehicle, cut
from models.vehicles.vehicle_file import load_vehicle
from validation.faults.campaign import Campaign, Check, Fault, off
from validation.faults.patches import Patch, attribute


def loaded(factor: float = 1.0) -> tuple[EngineHubs, np.ndarray]:
    """R19-free with a wrench on every hub, or without, in MuJoCo, and coordinates far from rest."""
    vehicle = _cut()
    built = EngineHubs("mujoco", vehicle, Drive(factor * _wrenches(vehicle)), 1e-3, 1e-3)
    q = np.random.default_rng(5).uniform(-0.03, 0.03, vehicle.size)
    q[3:6] = 1.0, 0.1, -0.2
    return built, q


@cache
def _cut() -> CutVehicle:
    return cut(load_vehicle("r19_free"), "body")


def _wrenches(vehicle: CutVehicle) -> np.ndarray:
    rows = np.random.default_rng(4).normal(0.0, 500.0, WRENCH * len(vehicle.hubs))
    rows[2::WRENCH] += vehicle.loads
    return np.tile(rows, (3, 1))


def _at_rest(built: EngineHubs, q: np.ndarray) -> np.ndarray:
    work = built.work()
    forces(built.numbers, 0.0, q, np.zeros(len(q)), *work)
    return work[1]


def _jacobians() -> float:
    """Joint forces of the wrenches beside MuJoCo's own, by the hubs' places and axes there."""
    (built, q), (bare, _), vehicle = loaded(), loaded(0.0), _cut()
    assert isinstance(built.model, FreeMujoco)
    own = built.model.model
    data, other = mujoco.MjData(own), np.zeros(vehicle.size)
    data.qpos[:] = q
    mujoco.mj_kinematics(own, data)
    mujoco.mj_comPos(own, data)
    names = [body.name for body in vehicle.tree.bodies]
    for hub, wrench in zip(vehicle.whole.tyres, _wrenches(vehicle)[0].reshape(-1, 2, 3), strict=True):
        body = int(own.body(str(names.index(hub.body))).id)
        force, moment = wrench @ data.xmat[body].reshape(3, 3).T
        mujoco.mj_applyFT(own, data, force, moment, data.xpos[body], body, other)
    return off(_at_rest(built, q) - _at_rest(bare, q), other)


def _still() -> float:
    """Accelerations at rest on the static loads (m/s^2, rad/s^2)."""
    vehicle = _cut()
    rows = np.zeros((3, WRENCH * len(vehicle.hubs)))
    rows[:, 2::WRENCH] = vehicle.loads
    built = EngineHubs("mujoco", vehicle, Drive(rows), 1e-3, 1e-3)
    return float(np.abs(built.accelerations(0.0, np.zeros(vehicle.size), np.zeros(vehicle.size))).max())


CHECKS = {
    "Jacobians": Check("joint forces by MuJoCo's own Jacobians", "of the largest", 1e-12, _jacobians),
    "still": Check("no acceleration on the static loads", "m/s^2, rad/s^2", 1e-9, _still),
}


def read(change: Callable[[np.ndarray], np.ndarray] | None = None, frame: str = "hub") -> Patch:
    """Wrenches (rows, hubs, 6) changed where they are read, or read in another frame."""

    def table(real: Any) -> Any:
        def made(vehicle: CutVehicle, drive: Drive, step: float) -> Any:
            parts = drive.hubs.reshape(len(drive.hubs), -1, WRENCH)
            rows = parts if change is None else change(parts)
            return real(vehicle, replace(drive, hubs=rows.reshape(drive.hubs.shape), frame=frame), step)

        return made

    return attribute("models.engines.cut_vehicle:table", table)


FAULTS = (
    Fault("left and right hubs swapped", "input", read(lambda parts: parts[:, [1, 0, 3, 2]])),
    Fault("front and rear hubs swapped", "input", read(lambda parts: parts[:, [2, 3, 0, 1]])),
    Fault("forces read along axes of the road", "input", read(frame="inertial")),
    Fault("y turned round", "input", read(lambda parts: parts * np.array([1.0, -1.0, 1.0, 1.0, -1.0, 1.0]))),
    Fault("moments left out", "input", read(lambda parts: parts * np.repeat([1.0, 0.0], 3))),
    Fault(
        "one force 1 % off",
        "input",
        read(lambda parts: parts * np.r_[1.01, np.ones(parts[0].size - 1)].reshape(parts[0].shape)),
    ),
)

CAMPAIGN = Campaign("planted.hubs", "hub forces", "rolling-vehicle", CHECKS, FAULTS)
