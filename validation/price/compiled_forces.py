"""The pitch-plane vehicle in MuJoCo with all its forces in one compiled callback, for comparison with native springs.

The forces are written anew from eqs (35) and (36): an independent check, and the cost of a compiled callback.
"""

from dataclasses import replace
from functools import cache
from typing import Any

import mujoco
import numpy as np
from mujoco import rollout
from numba import carray, cfunc, types

from models.engines import mujoco as adapter
from models.engines.assembly import Assembly, Settings
from models.engines.mujoco_layout import offsets
from models.engines.mujoco_quiet import installed_callback
from models.machine.stack import array_at, double_at

HEADER_LENGTH = 17
"""Length of the header: rows per second, number of rows, and the vehicle's fifteen parameters."""


def _compiled_callback(numeric_offset, passive_force_offset, time_offset, position_offset, velocity_offset):
    @cfunc(types.void(types.voidptr, types.voidptr), cache=True)
    def force_callback(mujoco_model, mujoco_data):
        header = carray(array_at(mujoco_model, numeric_offset), (HEADER_LENGTH,))
        row = int(np.rint(carray(double_at(mujoco_data, time_offset), (1,))[0] * header[0]))
        if not 0 <= row < int(header[1]):
            return
        road = carray(array_at(mujoco_model, numeric_offset), (HEADER_LENGTH + 4 * int(header[1]),))
        q, v = (
            carray(array_at(mujoco_data, position_offset), (4,)),
            carray(array_at(mujoco_data, velocity_offset), (4,)),
        )
        force = carray(array_at(mujoco_data, passive_force_offset), (4,))
        road_index = HEADER_LENGTH + 4 * row
        a, b = header[2], header[3]
        sine, cosine = np.sin(q[3]), np.cos(q[3])
        f1 = header[8] * (q[0] - road[road_index]) + header[12] * (v[0] - road[road_index + 2])
        f2 = header[9] * (q[1] - road[road_index + 1]) + header[13] * (v[1] - road[road_index + 3])
        f3 = header[10] * (q[2] - q[0] - b * sine) + header[14] * (v[2] - v[0] - b * v[3] * cosine)
        f4 = header[11] * (q[2] - q[1] + a * sine) + header[15] * (v[2] - v[1] + a * v[3] * cosine)
        force[0] += f3 - f1
        force[1] += f4 - f2
        force[2] -= f3 + f4
        force[3] += cosine * (b * f3 - a * f4)

    return force_callback


@cache
def force_callback() -> Any:
    """The MuJoCo callback that adds all forces of the vehicle, compiled at its first use."""
    return _compiled_callback(*offsets("numeric_data", "qfrc_passive", "time", "qpos", "qvel"))


class CompiledForces:
    """A vehicle on a road as a MuJoCo model of bodies without springs; one compiled callback computes all forces."""

    def __init__(self, assembly: Assembly, run_settings: Settings) -> None:
        self.assembly, self.settings = assembly, run_settings
        bare = replace(assembly.vehicle, struts=())
        spec = adapter.specification(bare, run_settings)
        assert assembly.input is not None
        table = assembly.input.sample(0.0, run_settings.step / 2, 2 * run_settings.steps + 1)
        header = [2.0 / run_settings.step, len(table), *assembly.parameters.array()]
        content = np.concatenate((header, table.ravel()))
        spec.add_numeric(name="input", size=len(content), data=[0.0])
        self.model = spec.compile()
        self.model.numeric_data[:] = content
        self.data = mujoco.MjData(self.model)

    def run(self) -> np.ndarray:
        """States (n + 1, 8) of a run with the forces, without the checks of an engine: for comparison and timing
        only."""
        with installed_callback(force_callback()):
            return self.run_with_installed_callback()

    def run_with_installed_callback(self) -> np.ndarray:
        """States (n + 1, 8) of a run with whatever callback is installed; without any, weight alone acts."""
        start = np.concatenate(([0.0], self.assembly.initial))
        path, _ = rollout.rollout(self.model, self.data, start[None, :], nstep=self.settings.steps)
        return np.vstack([self.assembly.initial, path[0, :, 1:9]])
