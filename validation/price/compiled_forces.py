"""The vehicle in MuJoCo with every force in one compiled callback, compared with native springs.

Written once more from eqs (35) and (36): an independent route, and the price of compiled callbacks.
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
from models.engines.mujoco_quiet import installed
from models.machine.stack import array_at, double_at

PARAMETERS = 17
"""Rows per second and number of rows, before the vehicle's fifteen parameters."""


def _compile_law(numeric, passive, time, position, velocity):
    @cfunc(types.void(types.voidptr, types.voidptr), cache=True)
    def law(model, case_data):
        header = carray(array_at(model, numeric), (PARAMETERS,))
        row = int(np.rint(carray(double_at(case_data, time), (1,))[0] * header[0]))
        if not 0 <= row < int(header[1]):
            return
        road = carray(array_at(model, numeric), (PARAMETERS + 4 * int(header[1]),))
        q, v = carray(array_at(case_data, position), (4,)), carray(array_at(case_data, velocity), (4,))
        force = carray(array_at(case_data, passive), (4,))
        road_index = PARAMETERS + 4 * row
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

    return law


@cache
def law() -> Any:
    """The callback, compiled at its first use."""
    return _compile_law(*offsets("numeric_data", "qfrc_passive", "time", "qpos", "qvel"))


class CompiledForces:
    """A vehicle on a road as a MuJoCo model of mere bodies, whose forces are all computed by one compiled callback."""

    def __init__(self, assembly: Assembly, settings: Settings) -> None:
        self.assembly, self.settings = assembly, settings
        bare = replace(assembly.vehicle, struts=())
        spec = adapter.specification(bare, settings)
        assert assembly.input is not None
        table = assembly.input.sample(0.0, settings.step / 2, 2 * settings.steps + 1)
        header = [2.0 / settings.step, len(table), *assembly.parameters.array()]
        content = np.concatenate((header, table.ravel()))
        spec.add_numeric(name="input", size=len(content), data=[0.0])
        self.model = spec.compile()
        self.model.numeric_data[:] = content
        self.data = mujoco.MjData(self.model)

    def run(self) -> np.ndarray:
        """States (n + 1, 8) of a run, without guards, for comparison and timing only."""
        with installed(law()):
            return self.coast()

    def coast(self) -> np.ndarray:
        """A copy of the model with no forces except weight."""
        start = np.concatenate(([0.0], self.assembly.initial))
        path, _ = rollout.rollout(self.model, self.data, start[None, :], nstep=self.settings.steps)
        return np.vstack([self.assembly.initial, path[0, :, 1:9]])
