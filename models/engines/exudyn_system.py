"""Functions that all models in Exudyn share: items, states, mass matrix and residual, packed forces, and runs of its
solvers."""

import struct
from collections.abc import Callable, Collection, Sequence
from typing import Any

import exudyn as exu
import exudyn.itemInterface as typed_items
import numpy as np

from models.core.waiting import report_simulation_progress
from models.engines.assembly import Settings
from models.engines.catalogue import CATALOGUE

exu.config.printToConsole = False
KINDS = exu.OutputVariableType
lists: Any = exu
"""Exudyn without its type hints, which do not know how its lists are made."""
items: Any = typed_items
"""Exudyn's items without their type hints, which do not know user functions."""
UserFunction = Callable[[Any, float, int, Any, Any], Any]
"""Force function in the form that Exudyn requires: of system, time (s), item, lists of positions and of rates; returns
a list."""


def packed_forces(
    coordinate_count: int, memory_block: np.ndarray, write_forces: Callable[[int, float, int], Any]
) -> UserFunction:
    """User function of Exudyn that packs its lists into one block of doubles for ``write_forces(address, time, size)``.
    The block holds forces, positions and rates (size,) each, then a table.

    Exudyn calls Python and nothing else, and hands a user function lists: to pack both into one block, to let a
    compiled kernel work on its address and to return a list costs least.
    """
    pack, raw = struct.Struct(f"{2 * coordinate_count}d").pack_into, memory_block.data.cast("B")[8 * coordinate_count :]
    answer, address = memory_block[:coordinate_count].data.tolist, memory_block.ctypes.data

    def forces(mbs: Any, time: float, item: int, positions: Any, rates: Any) -> Any:
        pack(raw, 0, *positions, *rates)
        write_forces(address, time, coordinate_count)
        return answer()

    return forces


def add_node(mbs: Any, coordinate_count: int) -> Any:
    """New node of an Exudyn system with ``coordinate_count`` coordinates, all zero."""
    zero = [0.0] * coordinate_count
    return mbs.AddNode(
        items.NodeGenericODE2(
            numberOfODE2Coordinates=coordinate_count,
            referenceCoordinates=zero,
            initialCoordinates=zero,
            initialCoordinates_t=zero,
        )
    )


def quiet_settings() -> Any:
    """Simulation settings with which Exudyn writes no files and stores no sensor values."""
    options = exu.SimulationSettings()
    options.solution.file.write = options.solution.sensors.active = False
    return options


def add_state_sensors(mbs: Any, nodes: Collection[Any]) -> list[list[Any]]:
    """New sensors that store the coordinates of every node, and sensors that store the rates."""
    return [
        [
            mbs.AddSensor(
                items.SensorNode(nodeNumber=node, storeInternal=True, writeToFile=False, outputVariableType=kind)
            )
            for node in nodes
        ]
        for kind in (KINDS.Coordinates, KINDS.Coordinates_t)
    ]


def set_start(mbs: Any, q: np.ndarray, v: np.ndarray) -> None:
    """Set the initial coordinates and rates (n,) of an Exudyn system, in Exudyn's order."""
    initial = exu.ConfigurationType.Initial
    mbs.systemData.SetODE2Coordinates(q, initial)
    mbs.systemData.SetODE2Coordinates_t(v, initial)


def mass_and_force(mbs: Any, time: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Exudyn's own mass matrix (n, n) and residual (n,) at the initial state and a time (s), without multipliers."""
    solver: Any = exu.MainSolverImplicitSecondOrder()
    options = quiet_settings()
    options.timeIntegration.startTime = time
    solver.InitializeSolver(mbs, options)
    solver.ComputeMassMatrix(mbs)
    solver.ComputeODE2RHS(mbs)
    n = solver.GetODE2size()
    mass, force = np.array(solver.GetSystemMassMatrix(), float)[:n, :n], np.array(solver.GetSystemResidual(), float)[:n]
    solver.FinalizeSolver(mbs, options)
    return mass, force


def constraint_jacobians(mbs: Any, positions: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Jacobians (c, n) of Exudyn's own c constraints with respect to the coordinates, one for each of ``positions``
    (n,)."""
    solver: Any = exu.MainSolverImplicitSecondOrder()
    options = quiet_settings()
    solver.InitializeSolver(mbs, options)
    n, count = solver.GetODE2size(), solver.GetAEsize()
    nothing, rows = np.zeros((n + count, n + count)), list[np.ndarray]()
    for q in positions:
        mbs.systemData.SetODE2Coordinates(q, exu.ConfigurationType.Current)
        solver.SetSystemJacobian(nothing)
        solver.ComputeJacobianAE(mbs)
        rows.append(np.array(solver.GetSystemJacobian(), float)[n:, :n])
    solver.FinalizeSolver(mbs, options)
    return rows


def constraint_residuals(mbs: Any, q: np.ndarray) -> np.ndarray:
    """Residuals (c,) of Exudyn's own c constraints at coordinates (n,)."""
    mbs.systemData.SetODE2Coordinates(q, exu.ConfigurationType.Initial)
    solver: Any = exu.MainSolverImplicitSecondOrder()
    options = quiet_settings()
    solver.InitializeSolver(mbs, options)
    solver.ComputeAlgebraicEquations(mbs)
    gaps = np.array(solver.GetSystemResidual(), float)[solver.GetODE2size() :]
    solver.FinalizeSolver(mbs, options)
    return gaps


def march_settings(run_settings: Settings) -> Any:
    """Exudyn's settings for a run in which sensors store every step."""
    options = quiet_settings()
    options.solution.sensors.active, options.solution.sensors.writePeriod = True, run_settings.step
    ti = options.timeIntegration
    ti.automaticStepSize = CATALOGUE["exudyn"][run_settings.integrator].adaptive
    ti.relativeTolerance, ti.absoluteTolerance = run_settings.tolerance, run_settings.tolerance * 1e-2
    ti.generalizedAlpha.spectralRadius = run_settings.spectral_radius
    ti.newton.relativeTolerance, ti.newton.absoluteTolerance = 1e-8, 1e-10
    return options


def solve(mbs: Any, run_settings: Settings, solver_options: Any = None) -> str:
    """Run Exudyn's solver over the duration with ``solver_options``, by default those of ``march_settings``. Returns
    the solver's failure message, empty if there is none."""
    solver_options = solver_options or march_settings(run_settings)
    ti = solver_options.timeIntegration
    ti.numberOfSteps, ti.endTime, ti.verboseMode = run_settings.steps, run_settings.duration, 0
    ti.adaptiveStep = ti.explicit.computeEndOfStepAccelerations = False
    with report_simulation_progress(lambda: mbs.systemData.GetTime() / run_settings.duration):
        return solver_failure(mbs, run_settings.integrator, solver_options)


def solver_failure(mbs: Any, integrator: str, solver_options: Any) -> str:
    """Run Exudyn's solver; returns a phrase on how it failed, empty if it succeeded."""
    try:
        done = mbs.SolveDynamic(solver_options, solverType=getattr(exu.DynamicSolverType, integrator))
    except (exu.ExudynError, RuntimeError, ValueError) as error:
        if "KeyboardInterrupt" in str(error):
            raise KeyboardInterrupt from error
        return f"; the solver stopped: {str(error).strip().splitlines()[0]}"
    return "" if done else "; the solver reported failure"


def solver_counts(mbs: Any) -> dict[str, int]:
    """Counts of steps, force evaluations and Jacobians of a system's last run, from the solver's own counters."""
    solver = mbs.sys["dynamicSolver"]
    steps = solver.it.currentStepIndex - 1
    tried = steps + solver.it.rejectedAutomaticStepSizeSteps
    explicit = hasattr(solver, "GetNumberOfStages")
    calls = tried * solver.GetNumberOfStages() if explicit else solver.it.newtonStepsCount + steps
    return {"steps": steps, "force calls": calls, "Jacobians": solver.it.newtonJacobiCount}
