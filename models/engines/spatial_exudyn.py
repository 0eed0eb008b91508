"""A vehicle in space in Exudyn: its own linearised system, and its solvers in time."""

from typing import Any

import exudyn as exu
import numpy as np

from models.engines.exudyn import counted
from models.engines.protocol import Settings
from models.engines.spatial_exudyn_build import KINDS, RoadTable, assemble, items
from models.engines.spatial_protocol import (
    DIFFERENCES,
    EngineKinematics,
    SpatialRun,
    curves,
    difference_step,
    linear_vehicle,
    sound,
    timed,
)
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial import SpatialVehicle, Vector


class SpatialExudyn:
    """One vehicle in one Exudyn system."""

    def __init__(
        self, vehicle: SpatialVehicle, settings: Settings | None, speed: float | None, road: np.ndarray | None
    ) -> None:
        self.vehicle, self.settings = vehicle, settings
        self.size = len(vehicle.coordinates())
        per_time = 2.0 / settings.step if settings is not None and road is not None else 0.0
        self._flat = np.zeros((1, 2 * len(vehicle.tyres)))
        self.road = RoadTable(self._flat if road is None else road, per_time)
        self.built = assemble(vehicle, speed, self.road)
        mbs = self.mbs = self.built.mbs
        places = [self.built.places[place] for place in vehicle.coordinates()]
        self._nodes = list(dict.fromkeys(node for node, _ in places))
        self._sensors = [
            [
                mbs.AddSensor(
                    items.SensorNode(nodeNumber=node, storeInternal=True, writeToFile=False, outputVariableType=kind)
                )
                for node in self._nodes
            ]
            for kind in (KINDS.Coordinates, KINDS.Coordinates_t)
        ]
        mbs.Assemble()
        self._columns = [mbs.GetNodeODE2Index(node) + index for node, index in places]

    def _all(self, values: np.ndarray) -> np.ndarray:
        """Values (n,) in Exudyn's own order, tree by tree."""
        out = np.empty(self.size)
        out[self._columns] = values
        return out

    def _start(self, q: np.ndarray, v: np.ndarray) -> None:
        data, initial = self.mbs.systemData, exu.ConfigurationType.Initial
        data.SetODE2Coordinates(self._all(q), initial)
        data.SetODE2Coordinates_t(self._all(v), initial)

    def acceleration(self, q: np.ndarray, v: np.ndarray, road: np.ndarray | None = None) -> np.ndarray:
        """Accelerations (n,) from Exudyn's own residual and mass matrix; ``road`` (2 w,) as in the protocol."""
        mass, force = self._mass_and_force(q, v, self._flat[0] if road is None else road)
        return np.linalg.solve(mass, force)

    def _mass_and_force(self, q: np.ndarray, v: np.ndarray, road: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self._start(q, v)
        solver: Any = exu.MainSolverImplicitSecondOrder()
        options = exu.SimulationSettings()
        options.solution.file.write = options.solution.sensors.active = False
        with self.road.still(road):
            solver.InitializeSolver(self.mbs, options)
            solver.ComputeMassMatrix(self.mbs)
            solver.ComputeODE2RHS(self.mbs)
        mass = np.asarray(solver.GetSystemMassMatrix(), dtype=float)[np.ix_(self._columns, self._columns)]
        force = np.asarray(solver.GetSystemResidual(), dtype=float)[self._columns]
        solver.FinalizeSolver(self.mbs, options)
        return mass, force

    def linearise(self) -> LinearVehicle:
        """Exudyn's own linearised system about the design position, on a flat road.

        Of a tree Exudyn differentiates by one forward difference, which loses half of the digits. Asked at several
        steps to both sides, its answers combine to central differences of order six.
        """
        zero, h = np.zeros(self.size), difference_step(self.vehicle)
        self._start(zero, zero)
        with self.road.still(self._flat[0]):
            found = {i: self._linearised(i * h) for weight in DIFFERENCES for i in (weight, -weight)}
        stiffness, damping = (
            sum(w * i * (found[i][part] + found[-i][part]) for i, w in DIFFERENCES.items()) for part in (1, 2)
        )
        motion = EngineKinematics(self.vehicle, self._shift, self._turn)
        return linear_vehicle("exudyn", self.vehicle, motion, found[1][0], damping, stiffness, self._road_columns())

    def _linearised(self, step: float) -> list[np.ndarray]:
        """[M, K, D] of Exudyn with forward differences of this step; it may be negative."""
        options = exu.SimulationSettings()
        options.solution.file.write = options.solution.sensors.active = False
        numerical = options.staticSolver.newton.numericalDifferentiation
        numerical.forODE2 = numerical.doSystemWideDifferentiation = True
        checks = exu.special.exceptions.parameterRangeChecks
        exu.special.exceptions.parameterRangeChecks = False  # a negative step is outside of the range
        numerical.relativeEpsilon, numerical.minimumCoordinateSize = step, 1.0
        exu.special.exceptions.parameterRangeChecks = checks
        own = np.ix_(self._columns, self._columns)
        return [np.asarray(part)[own] for part in self.mbs.ComputeLinearizedSystem(simulationSettings=options)]

    def _road_columns(self) -> np.ndarray:
        """Generalised forces (n, 2 w) per metre and per m/s of the road under each tyre: loads are linear in it."""
        zero = np.zeros(self.size)
        flat = self._mass_and_force(zero, zero, self._flat[0])[1]
        units = np.eye(2 * len(self.vehicle.tyres))
        return np.column_stack([self._mass_and_force(zero, zero, unit)[1] - flat for unit in units])

    def _shift(self, body: str, point: Vector) -> np.ndarray:
        return self._jacobian(self.built.marker(body, point), KINDS.Velocity)

    def _turn(self, body: str) -> np.ndarray:
        return self._jacobian(self.built.marker(body, self.vehicle.body(body).position, True), KINDS.AngularVelocity)

    def _jacobian(self, marker: Any, kind: Any) -> np.ndarray:
        """(3, n) of a marker in the design position: its velocity by each rate of 1."""
        data, columns = self.mbs.systemData, []
        data.SetODE2Coordinates(np.zeros(self.size))
        for unit in np.eye(self.size):
            data.SetODE2Coordinates_t(self._all(unit))
            columns.append(np.array(self.mbs.GetMarkerOutput(marker, kind)))
        return np.column_stack(columns)

    def run(self, q: np.ndarray, v: np.ndarray) -> SpatialRun:
        """March from positions and rates (n,) over the duration; RunFailed unless all of it is finite and sane."""
        own, options, note = timed("exudyn", self.settings), exu.SimulationSettings(), ""
        options.solution.file.write = False
        options.solution.sensors.active, options.solution.sensors.writePeriod = True, own.step
        ti = options.timeIntegration
        ti.numberOfSteps, ti.endTime, ti.verboseMode = own.steps, own.duration, 0
        ti.adaptiveStep = ti.automaticStepSize = False
        ti.explicit.computeEndOfStepAccelerations = False
        ti.generalizedAlpha.spectralRadius = own.spectral_radius
        ti.newton.relativeTolerance, ti.newton.absoluteTolerance = 1e-8, 1e-10
        self._start(q, v)
        try:
            if not self.mbs.SolveDynamic(options, solverType=getattr(exu.DynamicSolverType, own.integrator)):
                note = "; the solver reported failure"
        except (exu.ExudynError, RuntimeError, ValueError) as error:
            if "KeyboardInterrupt" in str(error):
                raise KeyboardInterrupt from error
            note = f"; the solver stopped: {str(error).strip().splitlines()[0]}"
        times, states = self._recorded(own)
        return sound("exudyn", own, times, states, note, counted(self.mbs))

    def _recorded(self, own: Settings) -> tuple[np.ndarray, np.ndarray]:
        """Times (m,) and states (m, 2 n) from the sensors. Steps are counted: Exudyn's sum of them ends 1e-13 early."""
        read = self.mbs.GetSensorStoredData
        halves = [np.hstack([read(sensor)[:, 1:] for sensor in sensors])[:, self._columns] for sensors in self._sensors]
        found, times = read(self._sensors[0][0])[:, 0], own.step * np.arange(len(halves[0]))
        times = times if np.allclose(found, times, rtol=0, atol=1e-9 * own.duration) else found
        return times, np.hstack(halves)

    def plan(self) -> dict[str, int]:
        """What was built: degrees of freedom, native items, callbacks, and curves among these."""
        return {
            "degrees of freedom": self.size,
            "native items": self.mbs.systemData.NumberOfObjects(),
            "callbacks": self.built.callbacks,
            "curves": curves(self.vehicle),
        }


def build(
    vehicle: SpatialVehicle, settings: Settings | None, speed: float | None, road: np.ndarray | None
) -> SpatialExudyn:
    """The Exudyn model of a vehicle in space."""
    return SpatialExudyn(vehicle, settings, speed, road)
