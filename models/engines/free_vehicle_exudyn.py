"""A free vehicle in Exudyn: one kinematic tree, and a user function around the compiled forces."""

from collections.abc import Sequence
from typing import Any

import exudyn as exu
import numpy as np

from models.core.errors import RunFailed
from models.engines.assembly import Settings
from models.engines.exudyn_system import (
    add_state_sensors,
    constraint_jacobians,
    constraint_residuals,
    items,
    mass_and_force,
    packed_forces,
    set_start,
    solve,
)
from models.engines.exudyn_tree import TreeBuild, add_tree
from models.engines.free_vehicle import FreeModel, LoadedVehicle
from models.engines.native_exudyn import (
    CoordinateConnectors,
    add_body_load,
    add_connection,
    add_ground_spring,
    add_line_spring,
    add_parts,
    add_rotors,
    add_turning_spring,
    built_elements,
)
from models.engines.native_parts import rotors
from models.vehicles.spatial_linear import Preloads


def native_elements_and_joints(loaded_vehicle: LoadedVehicle) -> tuple[tuple[str, ...], int]:
    """Names of the elements that have an object in the built system, and the number of joints of its tree."""
    model = FreeExudyn(loaded_vehicle)
    names = built_elements(model.mbs, [part.element.name for part in loaded_vehicle.parts])
    return names, len(model.mbs.GetObject(model.tree)["jointTypes"])


class FreeExudyn(FreeModel):
    """One free vehicle in one Exudyn system. The numbers for the user function are in a block of the model's own."""

    ENGINE = "exudyn"

    def __init__(self, loaded_vehicle: LoadedVehicle, run_settings: Settings | None = None) -> None:
        self.driven, self.size, self.settings, bodies = (
            loaded_vehicle,
            loaded_vehicle.size,
            run_settings,
            loaded_vehicle.vehicle.bodies,
        )
        self._container = exu.SystemContainer()
        mbs: Any = self._container.AddSystem()
        self.mbs, built = (
            mbs,
            TreeBuild(loaded_vehicle.vehicle, mbs, Preloads({}, {}), mbs.AddObject(items.ObjectGround())),
        )
        add_tree(built, list(bodies))
        self.tree = built.links[bodies[0].name][0]
        self._block = np.concatenate((np.zeros(3 * self.size), loaded_vehicle.numbers))
        mbs.SetObjectParameter(self.tree, "gravity", loaded_vehicle.gravity.tolist())
        if loaded_vehicle.has_kernel:
            forces = packed_forces(self.size, self._block, loaded_vehicle.block)
            mbs.SetObjectParameter(self.tree, "forceUserFunction", forces)
        node = next(iter(built.coordinate_nodes.values()))[0]
        add_parts(built, node, loaded_vehicle.parts)
        add_rotors(built, node, rotors(loaded_vehicle.vehicle))
        for spring in loaded_vehicle.ground_springs:
            add_ground_spring(built, spring)
        for line in loaded_vehicle.line_springs:
            add_line_spring(built, line)
        for load in loaded_vehicle.body_loads:
            add_body_load(built, load)
        for turning in loaded_vehicle.turning_springs:
            add_turning_spring(built, turning)
        coordinates = CoordinateConnectors(built, node)
        for friction in loaded_vehicle.frictions:
            coordinates.add_friction(friction)
        for coupling in loaded_vehicle.couplings:
            coordinates.add_coupling(coupling)
        for connection in loaded_vehicle.connections:
            add_connection(built, connection)
        self._sensors = add_state_sensors(mbs, [node])
        mbs.Assemble()

    @property
    def numbers(self) -> np.ndarray:
        """The table of numbers, which follows forces, positions and rates in the user function's block."""
        return self._block[3 * self.size :]

    def plan(self) -> dict[str, int]:
        """Counts of built items: degrees of freedom, native items, callbacks."""
        data = self.mbs.systemData
        native = data.NumberOfObjects() + data.NumberOfLoads()
        return {"degrees of freedom": self.size, "native items": native, "callbacks": int(self.driven.has_kernel)}

    def acceleration(self, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (n,) from Exudyn's own residual and mass matrix."""
        return np.linalg.solve(*self.mass_and_force(time, q, v))

    def mass_and_force(self, time: float, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Exudyn's own mass matrix (n, n) and residual (n,) at a time (s), positions and rates (n,)."""
        set_start(self.mbs, q, v)
        return mass_and_force(self.mbs, time)

    def ties(self, positions: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Jacobians (c, n) of Exudyn's own c constraints with respect to the coordinates, one for each of the positions
        (n,)."""
        return constraint_jacobians(self.mbs, positions)

    def gaps(self, q: np.ndarray) -> np.ndarray:
        """Residuals (c,) of Exudyn's own c constraints at coordinates (n,)."""
        return constraint_residuals(self.mbs, q)

    def march(self, q: np.ndarray, v: np.ndarray, steps: int, step: float, integrator: str = "RK44") -> np.ndarray:
        """Positions and rates (steps + 1, 2 n) by one of Exudyn's integrators; RunFailed where it stops."""
        set_start(self.mbs, q, v)
        if note := solve(self.mbs, Settings(integrator, step, steps * step)):
            raise RunFailed("exudyn", note.lstrip("; "))
        return np.hstack([self.mbs.GetSensorStoredData(sensor)[:, 1:] for (sensor,) in self._sensors])
