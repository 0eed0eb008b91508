"""A free vehicle in Exudyn: one kinematic tree, all forces by its user function around the compiled kernel."""

import struct
from collections.abc import Callable
from typing import Any

import exudyn as exu
import numpy as np

from models.core.errors import RunFailed
from models.engines.assembly import Settings
from models.engines.exudyn_system import items, mass_and_force, recorders, solve, start
from models.engines.exudyn_tree import Build, add_tree
from models.engines.free_vehicle import Driven, FreeModel
from models.engines.native_exudyn import add_parts, built_elements
from models.vehicles.spatial_linear import Preloads


def user_function(driven: Driven) -> Callable[..., Any]:
    """Exudyn's force function of the tree: lists of positions and rates in, a list of forces out."""
    n = driven.size
    block = np.concatenate((np.zeros(3 * n), driven.numbers))
    pack, raw = struct.Struct(f"{2 * n}d").pack_into, block.data.cast("B")[8 * n :]
    answer, address, fill = block[:n].data.tolist, block.ctypes.data, driven.block

    def forces(mbs: Any, t: float, item: int, q: Any, v: Any) -> Any:
        pack(raw, 0, *q, *v)
        fill(address, t, n)
        return answer()

    return forces


def share(driven: Driven) -> tuple[tuple[str, ...], int]:
    """Names of the elements that have an object in the system, and the joints of its first tree."""
    model = FreeExudyn(driven)
    names = built_elements(model.mbs, [part.element.name for part in driven.parts])
    return names, len(model.mbs.GetObject(model.tree)["jointTypes"])


class FreeExudyn(FreeModel):
    """One free vehicle in one Exudyn system."""

    ENGINE = "exudyn"

    def __init__(self, driven: Driven) -> None:
        self.driven, self._container, bodies = driven, exu.SystemContainer(), driven.vehicle.bodies
        mbs: Any = self._container.AddSystem()
        self.mbs, built = mbs, Build(driven.vehicle, mbs, Preloads({}, {}), mbs.AddObject(items.ObjectGround()))
        add_tree(built, list(bodies))
        self.tree = built.links[bodies[0].name][0]
        mbs.SetObjectParameter(self.tree, "gravity", driven.gravity.tolist())
        mbs.SetObjectParameter(self.tree, "forceUserFunction", user_function(driven))
        node = next(iter(built.places.values()))[0]
        add_parts(built, node, driven.parts)
        self._sensors = recorders(mbs, [node])
        mbs.Assemble()

    def acceleration(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (n,) from Exudyn's own residual and mass matrix."""
        start(self.mbs, q, v)
        return np.linalg.solve(*mass_and_force(self.mbs, t))

    def march(self, q: np.ndarray, v: np.ndarray, steps: int, step: float) -> np.ndarray:
        """Positions and rates (steps + 1, 2 n) by Exudyn's RK44; RunFailed where it stops."""
        start(self.mbs, q, v)
        if note := solve(self.mbs, Settings("RK44", step, steps * step)):
            raise RunFailed(self.ENGINE, note.lstrip("; "))
        return np.hstack([self.mbs.GetSensorStoredData(sensor)[:, 1:] for (sensor,) in self._sensors])
