"""A spatial vehicle in Exudyn: the system that Exudyn linearises, and its solvers in time."""

from typing import Any

import exudyn as exu
import numpy as np

from models.core.trajectory import Trajectory
from models.engines.assembly import Settings
from models.engines.exudyn_system import (
    KINDS,
    add_state_sensors,
    mass_and_force,
    quiet_settings,
    set_start,
    solve,
    solver_counts,
)
from models.engines.protocol import settings_of
from models.engines.spatial_exudyn_build import RoadRows, assemble
from models.engines.spatial_protocol import (
    DIFFERENCE_WEIGHTS,
    EngineKinematics,
    checked_trajectory,
    curve_count,
    difference_step,
    linear_vehicle,
)
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial import SpatialVehicle, Vector


class SpatialExudyn:
    """A spatial vehicle in one Exudyn system."""

    def __init__(
        self, vehicle: SpatialVehicle, run_settings: Settings | None, speed: float | None, road_rows: np.ndarray | None
    ) -> None:
        self.vehicle, self.settings = vehicle, run_settings
        self.size = len(vehicle.coordinates())
        per_time = 2.0 / run_settings.step if run_settings is not None and road_rows is not None else 0.0
        self._flat = np.zeros((1, 2 * len(vehicle.tyres)))
        self.road = RoadRows(self._flat if road_rows is None else road_rows, per_time)
        self.built = assemble(vehicle, speed, self.road)
        mbs = self.mbs = self.built.mbs
        places = [self.built.coordinate_nodes[place] for place in vehicle.coordinates()]
        self._sensors = add_state_sensors(mbs, dict.fromkeys(node for node, _ in places))
        mbs.Assemble()
        self._columns = [mbs.GetNodeODE2Index(node) + index for node, index in places]

    def _values_in_exudyn_order(self, coordinate_values: np.ndarray) -> np.ndarray:
        """Coordinates or rates (n,) in Exudyn's order, tree by tree."""
        out = np.empty(self.size)
        out[self._columns] = coordinate_values
        return out

    def acceleration(self, time: float, q: np.ndarray, v: np.ndarray, road_row: np.ndarray | None = None) -> np.ndarray:
        """Accelerations (n,) from Exudyn's own residual and mass matrix at a time (s), positions and rates (n,);
        ``road_row`` (2 w,) replaces the road's row at this time: heights (m), then rates (m/s) under w tyres."""
        if road_row is None:
            return np.linalg.solve(*self._mass_and_force(q, v, time))
        with self.road.fixed_row(road_row):
            return np.linalg.solve(*self._mass_and_force(q, v))

    def _mass_and_force(self, q: np.ndarray, v: np.ndarray, time: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Exudyn's own mass matrix (n, n) and residual (n,), in the order of the vehicle's coordinates."""
        set_start(self.mbs, self._values_in_exudyn_order(q), self._values_in_exudyn_order(v))
        mass, force = mass_and_force(self.mbs, time)
        return mass[np.ix_(self._columns, self._columns)], force[self._columns]

    def linearise(self) -> LinearVehicle:
        """The linear vehicle as Exudyn linearises it about the design position, on a flat road.

        Of a tree Exudyn differentiates by one forward difference, which loses half of the digits. Asked at several
        steps to both sides, its answers combine to central differences of order six.
        """
        zero, h = np.zeros(self.size), difference_step(self.vehicle)
        set_start(self.mbs, zero, zero)
        with self.road.fixed_row(self._flat[0]):
            parts = {i: self._linearised(i * h) for weight in DIFFERENCE_WEIGHTS for i in (weight, -weight)}
        stiffness, damping = (
            sum(w * i * (parts[i][part] + parts[-i][part]) for i, w in DIFFERENCE_WEIGHTS.items()) for part in (1, 2)
        )
        motion = EngineKinematics(self.vehicle, self._point_jacobian, self._rotation_jacobian)
        return linear_vehicle("exudyn", self.vehicle, motion, parts[1][0], damping, stiffness, self._road_columns())

    def _linearised(self, small_step: float) -> list[np.ndarray]:
        """Exudyn's matrices [M, K, D] from forward differences with this step (m, rad), which may be negative."""
        options, exceptions = quiet_settings(), exu.special.exceptions
        numerical, checks = options.staticSolver.newton.numericalDifferentiation, exceptions.parameterRangeChecks
        numerical.forODE2 = numerical.doSystemWideDifferentiation = True
        exceptions.parameterRangeChecks = False  # a negative step is outside of the range
        numerical.relativeEpsilon, numerical.minimumCoordinateSize = small_step, 1.0
        exceptions.parameterRangeChecks = checks
        rows = np.ix_(self._columns, self._columns)
        return [np.asarray(part)[rows] for part in self.mbs.ComputeLinearizedSystem(simulationSettings=options)]

    def _road_columns(self) -> np.ndarray:
        """Generalised forces (n, 2 w) per metre and per m/s of the road under each of w tyres; the forces are linear in
        these."""
        zero, forces = np.zeros(self.size), list[np.ndarray]()
        for row in (*self._flat, *np.eye(2 * len(self.vehicle.tyres))):
            with self.road.fixed_row(row):
                forces.append(self._mass_and_force(zero, zero)[1])
        flat, *loaded = forces
        return np.column_stack([force - flat for force in loaded])

    def _point_jacobian(self, body: str, point: Vector) -> np.ndarray:
        """Jacobian (3, n) of a point's velocity in the design position."""
        return self._jacobian(self.built.marker(body, point), KINDS.Velocity)

    def _rotation_jacobian(self, body: str) -> np.ndarray:
        """Jacobian (3, n) of a body's angular velocity in the design position."""
        return self._jacobian(self.built.marker(body, self.vehicle.body(body).position, True), KINDS.AngularVelocity)

    def _jacobian(self, marker: Any, variable_type: Any) -> np.ndarray:
        """Jacobian (3, n) of a marker in the design position: its velocity for a unit rate of each coordinate."""
        data, columns = self.mbs.systemData, []
        data.SetODE2Coordinates(np.zeros(self.size))
        for unit in np.eye(self.size):
            data.SetODE2Coordinates_t(self._values_in_exudyn_order(unit))
            columns.append(np.array(self.mbs.GetMarkerOutput(marker, variable_type)))
        return np.column_stack(columns)

    def run(self, q: np.ndarray | None = None, v: np.ndarray | None = None) -> Trajectory:
        """Trajectory over the duration from positions and rates (n,), or from rest; raises RunFailed unless it is
        finite and sane."""
        settings, rest = settings_of("exudyn", self.settings), np.zeros(self.size)
        set_start(
            self.mbs,
            self._values_in_exudyn_order(rest if q is None else q),
            self._values_in_exudyn_order(rest if v is None else v),
        )
        note = solve(self.mbs, settings)
        return checked_trajectory("exudyn", settings, *self._recorded_states(settings), note, solver_counts(self.mbs))

    def _recorded_states(self, run_settings: Settings) -> tuple[np.ndarray, np.ndarray]:
        """Times (m,) in s and states (m, 2 n) from the sensors. Times are multiples of the step, as Exudyn's own sum
        ends 1e-13 early."""
        read = self.mbs.GetSensorStoredData
        halves = [np.hstack([read(sensor)[:, 1:] for sensor in sensors])[:, self._columns] for sensors in self._sensors]
        stored, times = read(self._sensors[0][0])[:, 0], run_settings.step * np.arange(len(halves[0]))
        times = times if np.allclose(stored, times, rtol=0, atol=1e-9 * run_settings.duration) else stored
        return times, np.hstack(halves)

    def plan(self) -> dict[str, int]:
        """Counts of built items: degrees of freedom, native items, callbacks, and the curves among these."""
        return {
            "degrees of freedom": self.size,
            "native items": self.mbs.systemData.NumberOfObjects(),
            "callbacks": self.built.callbacks,
            "curves": curve_count(self.vehicle),
        }
