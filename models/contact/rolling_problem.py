"""Exact theory of steady rolling, on a grid: two half-spaces with Coulomb friction under a given pressure.

Kalker, Three-Dimensional Elastic Bodies in Rolling Contact, 1990, section 4.3. Material flows through the contact from
the leading edge (largest x) back, so the slip of the wheel over the rail, by the rolling speed, is

    s = (xi_x - spin y, xi_y + spin x) - du/dx,

u the displacement difference of the tractions p. A cell sticks (s = 0, |p| <= g) or slips (p = -g s/|s|), with g = mu
times the pressure. On a grid s = w + C p with du/dx from a cell's centre and the next two upstream, and this is a
variational inequality: |p| <= g and s.(q - p) >= 0 for every |q| <= g. C is positive definite (``SlipOperator``), so
there is exactly one solution, and tractions that meet the conditions of every cell are it: ``RollingSolution.residual``
is the proof.

Solved by Newton's method for the cells that stick and slip in the last state: GMRES with the fast Fourier transform for
products with C, preconditioned by each strip's own coupling. It converges in three to six steps from tractions that are
nearly right, and those are the tractions on cells twice as long and wide, solved in the same way before. On the
coarsest cells, and wherever Newton's steps alone lead nowhere, Gauss-Seidel sweeps come before each of them. Sweeps
alone do not settle many cells that are wider than long: they made things worse on 100 x 100 cells of a/b = 0.2.

Error of the cells, in forces divided by mu N (validation case ``contact_exact``): with 40 cells along each axis of an
ellipse 0.1 to 0.4 %, 0.7 % for spin on a long one, with 80 half as much. The order is 2 where all slips, 1 where much
sticks: the edge of the contact and the leading edge of the zone that sticks lie somewhere within a cell. Carter's
cylinder is met to 0.2 % with 80 cells, Cattaneo and Mindlin's shift to 0.04 % with 40. Full sliding gives mu N to
rounding.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from models.contact.inputs import NEGLIGIBLE_BOUND, Array, checked_creepages, checked_number
from models.contact.material import MaterialPair
from models.contact.normal_problem import PressureGrid
from models.contact.rolling_kernels import gauss_seidel_sweep
from models.contact.rolling_operator import ROLLING_WEIGHTS, SHIFT_WEIGHTS, FreeTractionSystem, SlipOperator
from models.core.errors import RunFailed

STICK_SLIP_TOLERANCE = 1e-8
"""Largest residual of a rolling solution."""
COARSEST_CELLS = 16
"""Number of cells along the shorter side below which a grid is solved from zero traction; larger grids start from a
grid with half of them, for which the exact theory of few cells is near enough.
"""
NEWTON_STEP_LIMIT = 12
"""Largest number of steps of Newton's method alone; three to six are usual."""
RELAXATION, RELAXATION_FACTOR = 0.5, 0.7
"""Relaxation of the first sweeps, and its factor after each round that came no nearer: needed for cells narrower than
long.
"""
SWEEP_COUNT = 3
"""Number of Gauss-Seidel sweeps in each round."""
ROUND_LIMIT = 60
"""Largest number of rounds of sweeps and Newton steps before the problem is given up."""
RigidSlipOfGrid = Callable[[Array, Array, float], Array]
"""Function for the rigid slip (ny, nx, 2) at positions x (nx,) and y (ny,) of cells of a length (m)."""


@dataclass(frozen=True)
class RollingSolution:
    """Forces and fields of steady rolling, on the cells of the pressure's grid.

    fx, fy : forces on the wheel (N). mz : moment on the wheel about the origin of x and y (N m).
    traction : (ny, nx, 2) on the wheel (Pa). slip : (ny, nx, 2) by the rolling speed, zero outside the slipping cells.
    stick : (ny, nx) bool. power : dissipated by friction per unit of rolling speed (W s/m = N), never negative.
    residual : largest change of a cell's traction that would still be needed if all others were right, by the largest
        bound. rounds : Newton steps on these cells, with sweeps before them or without.
    """

    fx: float
    fy: float
    mz: float
    traction: Array
    slip: Array
    stick: Array
    power: float
    residual: float
    rounds: int


def solve_rolling(
    normal_solution: PressureGrid, mu: float, xi_x: float, xi_y: float, spin: float, material_pair: MaterialPair
) -> RollingSolution:
    """Tractions, slip and forces of steady rolling under a given pressure.

    Parameters
    ----------
    normal_solution : pressure on its grid; a ``NormalSolution`` is one. Its x and y are the origin of spin and moment.
    mu : coefficient of friction
    xi_x, xi_y : creepages
    spin : 1/m
    material_pair : materials; too unlike ones are refused

    Raises
    ------
    InputError : a value that is not one number in its range, too unlike materials
    RunFailed : the conditions of stick and slip were not met to ``STICK_SLIP_TOLERANCE``
    """
    motion = checked_creepages(xi_x, xi_y, spin, checked_number).values()
    return _stick_slip_solution(
        normal_solution, mu, lambda x, y, length: rigid_slip(x, y, *motion), material_pair, ROLLING_WEIGHTS
    )


def solve_shift(
    normal_solution: PressureGrid, mu: float, shift_x: float, shift_y: float, material_pair: MaterialPair
) -> RollingSolution:
    """Tractions after the wheel has been shifted over the rail without rolling, from a state of rest without tractions.

    The problem of Cattaneo (1938) and Mindlin (1949): s = shift + u. Arguments and errors as of ``solve_rolling``, with
    shifts in m; in the result ``slip`` is in m and ``power`` the work of friction in J.
    """
    way_x, way_y = (
        checked_number(name, value, "a shift in m, at most 0.1", -0.1, 0.1)
        for name, value in (("shift_x", shift_x), ("shift_y", shift_y))
    )
    by_cell = _stick_slip_solution(
        normal_solution,
        mu,
        lambda x, y, length: rigid_slip(x, y, way_x, way_y, 0.0) / length,
        material_pair,
        SHIFT_WEIGHTS,
    )
    return replace(by_cell, slip=by_cell.slip * normal_solution.dx, power=by_cell.power * normal_solution.dx)


def _stick_slip_solution(
    normal_solution: PressureGrid,
    mu: float,
    rigid_slip_of_grid: RigidSlipOfGrid,
    material_pair: MaterialPair,
    difference_weights: tuple[float, ...],
) -> RollingSolution:
    """Solution of stick and slip for the given rigid slip, on the cells in contact."""
    mu = checked_number("mu", mu, "a coefficient of friction from 0 to 10", 0.0, 10.0)
    material_pair.require_likeness()
    shape = normal_solution.pressure.shape
    traction, slip = np.zeros((2, *shape, 2))
    stick = np.zeros(shape, bool)
    if mu * normal_solution.load <= NEGLIGIBLE_BOUND:
        return RollingSolution(0.0, 0.0, 0.0, traction, slip, stick, 0.0, 0.0, 0)
    contact = normal_solution.contact
    spans = (np.flatnonzero(contact.any(axis=axis)) for axis in (1, 0))
    rows, columns = box = tuple(slice(span[0], span[-1] + 1) for span in spans)
    bound = mu * normal_solution.pressure[box] / material_pair.G
    cells = _CellGrid(
        normal_solution.x[columns], normal_solution.y[rows], normal_solution.dx, normal_solution.dy, bound
    )
    state, rounds = _solve_on_grid(cells, rigid_slip_of_grid, material_pair, difference_weights)
    slips = ~state.stick & (state.bound > 0)
    traction[box], stick[box], slip[box] = material_pair.G * state.traction, state.stick, state.slip * slips[..., None]
    cell = normal_solution.dx * normal_solution.dy
    fx, fy = (float(force) for force in traction.sum(axis=(0, 1)) * cell)
    mz = float(np.sum(normal_solution.x * traction[..., 1] - normal_solution.y[:, None] * traction[..., 0]) * cell)
    power = float(-np.sum(traction * slip) * cell)
    return RollingSolution(fx, fy, mz, traction, slip, stick, power, state.residual, rounds)


def rigid_slip(x: Array, y: Array, xi_x: float, xi_y: float, spin: float) -> Array:
    """Ratio (ny, nx, 2) of the rigid bodies' slip velocity to the rolling speed, at positions x (nx,) and y (ny,) in
    m.
    """
    along, across = np.broadcast_arrays(xi_x - spin * y[:, None], xi_y + spin * x)
    return np.stack([along, across], axis=-1)


class _TractionState:
    """State of the cells: tractions (ny, nx, 2) in units of G, their slip, and the largest residual of the stick and
    slip conditions.
    """

    def __init__(
        self, slip_operator: SlipOperator, rigid_slips: Array, traction_bounds: Array, traction: Array
    ) -> None:
        self.operator, self.rigid, self.bound, self.traction = slip_operator, rigid_slips, traction_bounds, traction
        self.slip = rigid_slips + slip_operator(traction)
        self.trial = traction - self.slip / slip_operator.own_slip.max()
        self.size = np.linalg.norm(self.trial, axis=-1)
        cut = np.where(self.size > traction_bounds, traction_bounds / np.where(self.size > 0, self.size, 1.0), 1.0)
        needed = self.trial * cut[..., None] - traction
        self.residual = float(np.linalg.norm(needed, axis=-1)[traction_bounds > 0].max() / traction_bounds.max())

    def with_tractions(self, traction: Array) -> "_TractionState":
        """A new state of the cells with other tractions."""
        return _TractionState(self.operator, self.rigid, self.bound, traction)

    @property
    def stick(self) -> Array:
        """Whether each cell sticks (ny, nx): its traction is within the friction bound."""
        return (self.size <= self.bound) & (self.bound > 0)


@dataclass(frozen=True)
class _CellGrid:
    """Grid of cells: centres x (nx,) and y (ny,) (m), sides dx and dy (m), and traction bounds in units of G (ny,
    nx).
    """

    x: Array
    y: Array
    dx: float
    dy: float
    bound: Array

    def coarser(self) -> "_CellGrid":
        """Grid of cells twice as long and wide; their bounds are means over the smaller cells. A last cell may extend
        beyond the old grid."""
        rows, columns = (count + count % 2 for count in self.bound.shape)
        bound = np.zeros((rows, columns))
        bound[: self.y.size, : self.x.size] = self.bound
        return _CellGrid(
            self.x[::2] + self.dx / 2,
            self.y[::2] + self.dy / 2,
            2 * self.dx,
            2 * self.dy,
            bound.reshape(rows // 2, 2, columns // 2, 2).mean(axis=(1, 3)),
        )


def _solve_on_grid(
    cell_grid: _CellGrid,
    rigid_slip_of_grid: RigidSlipOfGrid,
    material_pair: MaterialPair,
    difference_weights: tuple[float, ...],
) -> tuple[_TractionState, int]:
    """State in which all stick and slip conditions hold, and the number of rounds on this grid; a coarser grid gives
    its start.
    """
    bound, motion = cell_grid.bound, rigid_slip_of_grid(cell_grid.x, cell_grid.y, cell_grid.dx)
    operator = SlipOperator(
        bound.shape[1], bound.shape[0], cell_grid.dx, cell_grid.dy, material_pair, difference_weights
    )
    zero_state = _TractionState(operator, motion, bound, np.zeros_like(motion))
    if min(bound.shape) < COARSEST_CELLS:
        return _solve_tractions(zero_state)
    coarse = cell_grid.coarser()
    coarse_tractions = _solve_on_grid(coarse, rigid_slip_of_grid, material_pair, difference_weights)[0].traction
    relative = _at_quarter_cells(coarse_tractions / np.where(coarse.bound > 0, coarse.bound, 1.0)[..., None])
    state = zero_state.with_tractions(relative[: bound.shape[0], : bound.shape[1]] * bound[..., None])
    for step in range(NEWTON_STEP_LIMIT):
        if state.residual <= STICK_SLIP_TOLERANCE:
            return state, step
        state = _after_newton_step(state)
    return _solve_tractions(_state_of_least_residual(state, zero_state))


def _state_of_least_residual(*cell_states: _TractionState) -> _TractionState:
    """The state with the smallest residual."""
    return min(cell_states, key=lambda state: state.residual)


def _at_quarter_cells(cell_values: Array) -> Array:
    """Values (2 ny, 2 nx, 2) in the quarters of cells, linear between the cells' centres, from values (ny, nx, 2)."""
    for axis in (0, 1):
        ends = np.pad(cell_values, [(1, 1) if k == axis else (0, 0) for k in range(3)], mode="edge")
        before, here, after = (np.delete(ends, outer, axis) for outer in ([-1, -2], [0, -1], [0, 1]))
        pairs = np.stack([0.75 * here + 0.25 * before, 0.75 * here + 0.25 * after], axis=axis + 1)
        cell_values = pairs.reshape([2 * n if k == axis else n for k, n in enumerate(cell_values.shape)])
    return cell_values


def _solve_tractions(cell_state: _TractionState) -> tuple[_TractionState, int]:
    """State that satisfies all stick and slip conditions, by alternating sweeps and Newton steps, and the number of
    rounds."""
    relaxation, round_count = RELAXATION, 0
    while cell_state.residual > STICK_SLIP_TOLERANCE:
        if round_count == ROUND_LIMIT:
            raise RunFailed(
                "rolling problem",
                f"conditions of stick and slip met to {cell_state.residual:.2g} only after {ROUND_LIMIT} rounds",
            )
        traction, motion = (
            np.ascontiguousarray(np.moveaxis(v, -1, 0)) for v in (cell_state.traction, cell_state.rigid)
        )
        for _ in range(SWEEP_COUNT):
            gauss_seidel_sweep(traction, motion, cell_state.operator.reversed_kernel, cell_state.bound, relaxation)
        swept = cell_state.with_tractions(np.moveaxis(traction, 0, -1))
        nearest = (
            swept
            if swept.residual <= STICK_SLIP_TOLERANCE
            else _state_of_least_residual(swept, _after_newton_step(swept))
        )
        relaxation *= 1.0 if nearest.residual < cell_state.residual else RELAXATION_FACTOR
        cell_state, round_count = nearest, round_count + 1
    return cell_state, round_count


def _after_newton_step(cell_state: _TractionState) -> _TractionState:
    """The state after one Newton step, or the unchanged state if the linear solver fails for rounding."""
    try:
        return cell_state.with_tractions(_newton_tractions(cell_state))
    except RunFailed:
        return cell_state


def _newton_tractions(cell_state: _TractionState) -> Array:
    """Tractions after a Newton step in which the sets of sticking and slipping cells are those of ``cell_state``.

    A sticking cell is free to change; a slipping one is put on its bound and turns there, until its traction is
    opposite to its slip: t.C d + (|s| / g) d = -t.s along the tangent t.
    """
    bound, slips = cell_state.bound, (cell_state.size > cell_state.bound) & (cell_state.bound > 0)
    opposite = cell_state.trial / np.where(cell_state.size > 0, cell_state.size, 1.0)[..., None]
    traction = np.where(slips[..., None], bound[..., None] * opposite, cell_state.traction)
    slip = cell_state.rigid + cell_state.operator(traction)
    tangent = np.stack([-opposite[..., 1], opposite[..., 0]], axis=-1)
    free = np.where(slips[..., None, None], tangent[..., :, None] * tangent[..., None, :], np.eye(2))
    free = free * (bound > 0)[..., None, None]
    against = np.maximum(-np.sum(slip * opposite, axis=-1), 0.0)
    stiff = np.where(slips, against / np.where(slips, bound, 1.0), 0.0)
    new_tractions = traction + FreeTractionSystem(cell_state.operator, free, stiff).solve(-slip)
    size = np.linalg.norm(new_tractions, axis=-1)
    onto = np.where(slips | (size > bound), bound / np.where(size > 0, size, 1.0), 1.0)
    return new_tractions * onto[..., None]
