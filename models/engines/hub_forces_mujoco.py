"""A vehicle cut at its wheels in MuJoCo: native bodies and joints, all other forces by one native callback."""

from functools import cache
from typing import Any

import mujoco
import numpy as np
from numba import cfunc, types

from models.engines.contact_bridge_mujoco import Marcher
from models.engines.hub_forces import HubModel
from models.engines.mujoco_callback import _array_at, _double_at, installed
from models.engines.mujoco_layout import check, offset
from models.engines.spatial_mujoco import Numbers, _spec, _weigh
from models.hub_forces.cut_vehicle import CutVehicle
from models.hub_forces.kernel import joint_forces
from models.hub_forces.table import Drive


@cache
def law() -> Any:
    """Compiled callback: a shell about the forces of time, positions and rates."""
    numbers = offset("mjModel", "numeric_data")
    time, position, rate, force = (offset("mjData", field) for field in ("time", "qpos", "qvel", "qfrc_passive"))

    @cfunc(types.void(types.voidptr, types.voidptr))
    def shell(model, data):
        joint_forces(_array_at(model, numbers), _double_at(data, time), _array_at(data, position),
                     _array_at(data, rate), _array_at(data, force))  # fmt: skip

    return shell


class MujocoHubs(HubModel):
    """The cut vehicle in a MuJoCo model of its own."""

    ENGINE = "mujoco"

    def __init__(self, vehicle: CutVehicle, drive: Drive, step: float, duration: float) -> None:
        super().__init__(vehicle, drive, step, duration)
        spec = _spec(vehicle.tree, step)
        spec.add_numeric(name="hubs", size=len(self.numbers), data=[0.0])
        self.model = spec.compile()
        self.model.numeric_data[:] = self.numbers
        _weigh(self.model, (own := Numbers(vehicle.tree, self.model)), vehicle.tree.bodies)
        if not np.array_equal(own.columns, np.arange(self.size)):
            raise RuntimeError("MuJoCo counts the joints of this tree in another order")
        self._data = mujoco.MjData(self.model)
        check(self.model, self._data)

    def accelerations(self, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (n,) by ``mj_forward``."""
        data = self._data
        data.time, data.qpos[:], data.qvel[:] = time, q, v
        with installed(law()):
            mujoco.mj_forward(self.model, data)
        return data.qacc.copy()

    def marched(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Coordinates and rates (steps + 1, 2 n) by MuJoCo's RK4; RunFailed where it gives up."""
        start = np.concatenate((q, v))
        with installed(law()):
            return np.vstack((start, Marcher(self.model).run(start[None], self.steps)[0]))


MODEL = MujocoHubs
