"""What models in Exudyn share: items, states, mass matrix and residual, and the march by one of its solvers."""

from collections.abc import Collection
from typing import Any

import exudyn as exu
import exudyn.itemInterface as typed_items
import numpy as np

from models.core.waiting import marching
from models.engines.assembly import Settings

exu.config.printToConsole = False
KINDS = exu.OutputVariableType
lists: Any = exu
items: Any = typed_items
"""Exudyn's type hints know neither how its lists are made nor that a function is a user function."""


def quiet_settings() -> Any:
    """Simulation settings that write no file and store nothing."""
    options = exu.SimulationSettings()
    options.solution.file.write = options.solution.sensors.active = False
    return options


def recorders(mbs: Any, nodes: Collection[Any]) -> list[list[Any]]:
    """Sensors that store the coordinates of every node, and those that store their rates."""
    return [
        [
            mbs.AddSensor(
                items.SensorNode(nodeNumber=node, storeInternal=True, writeToFile=False, outputVariableType=kind)
            )
            for node in nodes
        ]
        for kind in (KINDS.Coordinates, KINDS.Coordinates_t)
    ]


def start(mbs: Any, q: np.ndarray, v: np.ndarray) -> None:
    """Let a system begin with coordinates and rates (n,), in Exudyn's own order."""
    initial = exu.ConfigurationType.Initial
    mbs.systemData.SetODE2Coordinates(q, initial)
    mbs.systemData.SetODE2Coordinates_t(v, initial)


def mass_and_force(mbs: Any, time: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Exudyn's own mass matrix (n, n) and residual (n,) at its initial state and a time (s)."""
    solver: Any = exu.MainSolverImplicitSecondOrder()
    options = quiet_settings()
    options.timeIntegration.startTime = time
    solver.InitializeSolver(mbs, options)
    solver.ComputeMassMatrix(mbs)
    solver.ComputeODE2RHS(mbs)
    mass, force = np.array(solver.GetSystemMassMatrix(), float), np.array(solver.GetSystemResidual(), float)
    solver.FinalizeSolver(mbs, options)
    return mass, force


def solve(mbs: Any, settings: Settings) -> str:
    """March by fixed steps, all of which the sensors store; a phrase on what the solver reported, empty if nothing."""
    options = quiet_settings()
    options.solution.sensors.active, options.solution.sensors.writePeriod = True, settings.step
    ti = options.timeIntegration
    ti.numberOfSteps, ti.endTime, ti.verboseMode = settings.steps, settings.duration, 0
    ti.adaptiveStep = ti.automaticStepSize = ti.explicit.computeEndOfStepAccelerations = False
    ti.generalizedAlpha.spectralRadius = settings.spectral_radius
    ti.newton.relativeTolerance, ti.newton.absoluteTolerance = 1e-8, 1e-10
    try:
        with marching(lambda: mbs.systemData.GetTime() / settings.duration):
            done = mbs.SolveDynamic(options, solverType=getattr(exu.DynamicSolverType, settings.integrator))
    except (exu.ExudynError, RuntimeError, ValueError) as error:
        if "KeyboardInterrupt" in str(error):
            raise KeyboardInterrupt from error
        return f"; the solver stopped: {str(error).strip().splitlines()[0]}"
    return "" if done else "; the solver reported failure"
