"""Rail wheels in Exudyn: the model, and the kinds of user function that apply creep forces.

The route that costs least is one generic object over the nodes of all wheels: its force function is called once per
stage. A load for each coordinate is called more often; a function before each step cannot see the stages, so that no
integrator keeps its order.
"""

from collections.abc import Callable
from typing import Any

import exudyn as exu
import numpy as np

from models.contact.inputs import Array
from models.core.errors import RunFailed
from models.engines.assembly import Settings
from models.engines.contact_bridge import FREEDOMS, RailWheels, check_step, force_slopes_by_differences, set_forces
from models.engines.exudyn_system import add_node, items, packed_forces, quiet_settings, set_start, solve

Law = Callable[[Array, Array, Array, Array], Any]
"""Function that adds forces to its last argument: of the table of numbers, positions, rates and forces."""
ListForces = Callable[[Any, Any], Any]
"""Function that returns a list of forces for lists of positions and rates."""
CONTRACTIVITY, ITERATIONS = 0.99999, 1000
"""Settings of Exudyn's modified Newton method for steep creep forces: largest contractivity, and most iterations."""
ROUTES = ("generic object", "loads", "before each step")
"""Kinds of user function by which Exudyn receives forces: one object for all wheels, a load per coordinate, or a
function before each step."""


def list_forces(
    coordinate_count: int, parameter_table: Array, write_forces: Callable[[int, float, int], Any]
) -> ListForces:
    """Function that returns lists of forces by a compiled force law that does not depend on time; its block of doubles
    ends with the table ``parameter_table``."""
    packed = packed_forces(
        coordinate_count, np.concatenate((np.zeros(3 * coordinate_count), parameter_table)), write_forces
    )
    return lambda positions, rates: packed(None, 0.0, 0, positions, rates)


class WheelForceFunctions:
    """Creep forces as functions of lists of positions and rates, by the compiled kernel or by a Python ``law``.

    ``of`` gives the forces, ``slopes`` the sum of their derivatives to positions and rates, each times a factor: those
    of the linear theory, the steepest that there are. With the slopes of a wheel that slides, next to none, Newton's
    method leaps from slip to slip at low speed and never settles; with the steepest it creeps up on the solution.
    """

    def __init__(self, wheels: RailWheels, python_law: Law | None = None) -> None:
        size, numbers, sticking = wheels.size, wheels.numbers, wheels.sticking
        jacobian = np.zeros((size, size))

        def by_law(positions: Any, rates: Any) -> Any:
            forces = np.zeros(size)
            python_law(numbers, np.array(positions), np.array(rates), forces)  # type: ignore[misc]
            return forces.tolist()

        def steepest_jacobian(positions: Any, rates: Any, position_factor: float, rate_factor: float) -> Array:
            force_slopes_by_differences(
                sticking, np.array(positions), np.array(rates), position_factor, rate_factor, jacobian
            )
            return jacobian

        self.of = by_law if python_law is not None else list_forces(size, numbers, set_forces)
        self.slopes = steepest_jacobian


class RailWheelSystem:
    """Rail wheels on springs in one Exudyn system.

    force_function : forces of positions and rates, None for no contact; route : one of ROUTES; slopes : as those of
    ``WheelForceFunctions``, for implicit solvers by the generic object; without them Exudyn differentiates by 2 size
    calls of ``force_function``.
    """

    def __init__(
        self,
        wheels: RailWheels,
        force_function: ListForces | None,
        force_route: str = ROUTES[0],
        force_slopes: Callable[[Any, Any, float, float], Array] | None = None,
    ) -> None:
        self._container = exu.SystemContainer()
        self.mbs: Any = self._container.AddSystem()
        self.wheels, self._slopes = wheels, force_slopes
        masses, k, d = wheels.masses[:FREEDOMS], wheels.stiffness, wheels.damping
        self._nodes = []
        for _ in range(wheels.count):
            node = add_node(self.mbs, FREEDOMS)
            self.mbs.AddObject(
                items.ObjectGenericODE2(
                    nodeNumbers=[node], massMatrix=np.diag(masses), stiffnessMatrix=np.diag(k), dampingMatrix=np.diag(d)
                )
            )
            self._nodes.append(node)
        if force_function is not None:
            {
                "generic object": self._add_generic_object,
                "loads": self._add_loads,
                "before each step": self._add_step_loads,
            }[force_route](force_function)
        self.mbs.Assemble()

    def _add_generic_object(self, force_function: ListForces) -> None:
        """Add one generic object over the nodes of all wheels, whose user function gives their forces."""
        slopes, more = self._slopes, dict[str, Any]()
        if slopes is not None:  # those of the left-hand side
            more["jacobianUserFunction"] = lambda mbs, t, item, q, v, by_q, by_v: -slopes(q, v, by_q, by_v)
        self.mbs.AddObject(
            items.ObjectGenericODE2(
                nodeNumbers=self._nodes,
                massMatrix=exu.MatrixContainer(),
                forceUserFunction=lambda mbs, t, item, q, v: force_function(q, v),
                **more,
            )
        )

    def _markers(self) -> list[Any]:
        """New markers of all coordinates, wheel by wheel."""
        return [
            self.mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=i))
            for node in self._nodes
            for i in range(FREEDOMS)
        ]

    def _add_loads(self, force_function: ListForces) -> None:
        """Add a load to every coordinate; the first load's callback computes the forces of all."""
        data, loads = self.mbs.systemData, [0.0] * self.wheels.size

        def first_load(mbs: Any, t: float, load: float) -> float:
            loads[:] = force_function(data.GetODE2Coordinates(), data.GetODE2Coordinates_t())
            return loads[0]

        for i, marker in enumerate(self._markers()):
            function = (lambda mbs, t, load, i=i: loads[i]) if i else first_load
            self.mbs.AddLoad(items.LoadCoordinate(markerNumber=marker, loadUserFunction=function))

    def _add_step_loads(self, force_function: ListForces) -> None:
        """Add loads that are constant over a step; their forces are computed at the beginning of the step."""
        loads = [self.mbs.AddLoad(items.LoadCoordinate(markerNumber=marker)) for marker in self._markers()]

        def set_loads(mbs: Any, t: float) -> bool:
            data, write = mbs.systemData, mbs.SetLoadParameter
            for load, value in zip(
                loads, force_function(data.GetODE2Coordinates(), data.GetODE2Coordinates_t()), strict=True
            ):
                write(load, "load", value)
            return True

        self.mbs.SetPreStepUserFunction(set_loads)

    def run(
        self,
        q: Array,
        v: Array,
        step_count: int,
        time_step: float = 1e-4,
        solver_name: str = "ExplicitEuler",
        solver_tolerance: float = 0.0,
    ) -> Array:
        """State (2 size,) after ``step_count`` steps from positions and rates (size,); RunFailed unless it is finite.

        solver_tolerance : relative, of a solver that picks its own steps, at most ``time_step`` long; 0 for steps as
        they are. Refused is raised for a step that an explicit solver cannot take; RunFailed where Newton's method
        gives up."""
        check_step("exudyn", self.wheels, solver_name, time_step, step_count)
        set_start(self.mbs, q, v)
        options, data = quiet_settings(), self.mbs.systemData
        ti = options.timeIntegration
        ti.automaticStepSize = solver_tolerance > 0.0
        ti.relativeTolerance, ti.absoluteTolerance = solver_tolerance, 1e-2 * solver_tolerance
        if self._slopes is not None:  # steep slopes converge slowly but surely: keep the matrix, go on for longer
            ti.newton.useModifiedNewton, ti.newton.modifiedNewtonContractivity = True, CONTRACTIVITY
            ti.newton.maxIterations = ITERATIONS
        note = solve(self.mbs, Settings(solver_name, time_step, step_count * time_step), options)
        state = np.concatenate((data.GetODE2Coordinates(), data.GetODE2Coordinates_t()))
        if note or not np.isfinite(state).all():
            raise RunFailed("exudyn", f"the engine gave up{note}: shorten the step")
        return state
