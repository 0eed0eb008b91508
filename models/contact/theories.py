"""One rolling contact by any of the contact theories, with the same interface.

A contact is pressed once: load, area, largest pressure and approach are then known. ``solve_rolling_contact`` gives its
forces at any creepage on any number of cells. ``models.contact.accuracy`` tells how far they are off.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from models.contact import linear_theory
from models.contact.fastsim import RollingEllipse, fastsim
from models.contact.fields import ContactFields, fastsim_fields
from models.contact.hertz import HertzContact
from models.contact.material import MaterialPair
from models.contact.normal_problem import (
    NormalSolution,
    PressureGrid,
    cell_centres,
    hertzian_pressure_grid,
    solve_normal,
)
from models.contact.rolling_problem import solve_rolling
from models.contact.simplified_theory import NormalContact, PatchPressure
from models.contact.simplified_theory import solve_rolling_contact as roll_simplified
from models.core.errors import InputError

CreepagesAndSpin = tuple[float, float, float]
"""Motion of a rolling contact: xi_x, xi_y and spin (1/m)."""


@dataclass(frozen=True)
class RollingResult:
    """Result of rolling: forces on the wheel (N), moment (N m), sticking share of the area, ratio of dissipated power
    to rolling speed (N).
    """

    fx: float
    fy: float
    mz: float
    stick: float
    dissipation: float
    fields: tuple[ContactFields, ...] = ()

    @property
    def force(self) -> np.ndarray:
        """Creep forces fx and fy (N)."""
        return np.array([self.fx, self.fy])


@dataclass(frozen=True)
class NormalResult:
    """Result of normal contact: load (N) along the normals of all patches, area (m^2), largest pressure (Pa), approach
    (m)."""

    load: float
    area: float
    peak: float
    approach: float


class RollingContact(ABC):
    """Two bodies pressed together whose rolling one theory computes; ``order``: convergence order of the error in the
    cell size.
    """

    order = 1.0

    def __init__(self, normal_result: NormalResult, friction: float, material_pair: MaterialPair) -> None:
        self.pressing, self.friction, self.pair = normal_result, friction, material_pair

    @property
    @abstractmethod
    def lever(self) -> float:
        """Largest distance (m), along an axis, between the reference point of moments and the edge of the contact."""

    @abstractmethod
    def roll(self, creepages: CreepagesAndSpin, cell_count: int, *, with_fields: bool = False) -> RollingResult:
        """Contact forces at the given creepages and spin; with ``with_fields``, also pressure, traction and slip in
        every cell of each patch.
        """


class RollingOnEllipse(RollingContact):
    """Rolling contact on the ellipse of Hertz' contact, with semi-axes a and b (m)."""

    def __init__(self, hertz_contact: HertzContact, friction: float, material_pair: MaterialPair) -> None:
        self.hertz, self.a, self.b = hertz_contact, float(hertz_contact.a), float(hertz_contact.b)
        pressing = NormalResult(
            float(hertz_contact.load),
            float(np.pi * self.a * self.b),
            float(hertz_contact.p0),
            float(hertz_contact.approach),
        )
        super().__init__(pressing, friction, material_pair)

    @property
    def lever(self) -> float:
        """The longer semi-axis (m) of the ellipse."""
        return max(self.a, self.b)


class LinearTheory(RollingOnEllipse):
    """Rolling contact by the linear theory: no slip, forces proportional to the creepages and not limited by
    friction.
    """

    def roll(self, creepages: CreepagesAndSpin, cell_count: int, *, with_fields: bool = False) -> RollingResult:
        """Forces of the linear theory, which has no cells and no fields."""
        fx, fy, mz = (float(f) for f in linear_theory.linear_creep_forces(self.a, self.b, *creepages, self.pair))
        return RollingResult(fx, fy, mz, 1.0, -float(np.dot((fx, fy, mz), creepages)))


def friction_warning(force_ratios: np.ndarray) -> str:
    """Warning that the linear theory's force ratios ``force_ratios`` (n,), force to mu N, exceed the friction limit; ""
    if none does.
    """
    beyond = force_ratios[force_ratios > 1.0]
    if not beyond.size:
        return ""
    return (
        f"the linear theory's force is more than friction can carry at {beyond.size} of {force_ratios.size} creepages, "
        f"up to {beyond.max():.3g} mu N: it knows no slip"
    )


class FastsimTheory(RollingOnEllipse):
    """Rolling contact by the simplified theory of 1982, FASTSIM; ``choices`` : options of ``fastsim``."""

    def __init__(
        self, hertz_contact: HertzContact, friction: float, material_pair: MaterialPair, **choices: Any
    ) -> None:
        super().__init__(hertz_contact, friction, material_pair)
        self.choices = choices
        self.order = 2.0 if choices["march"] == "second-order" and choices["bound"] != "elliptic" else 1.0

    def roll(self, creepages: CreepagesAndSpin, cell_count: int, *, with_fields: bool = False) -> RollingResult:
        """Creep forces, computed with ``cell_count`` cells in each strip."""
        ellipse = RollingEllipse(self.a, self.b, self.pressing.load, self.friction, *creepages)
        creep = fastsim(ellipse, self.pair, cells=cell_count, **self.choices)
        inside = (fastsim_fields(ellipse, self.pair, cells=cell_count, **self.choices),) if with_fields else ()
        values = creep.fx, creep.fy, creep.mz, creep.stick, creep.dissipation
        fx, fy, mz, stick, lost = (float(value) for value in values)
        return RollingResult(fx, fy, mz, stick, lost, inside)


class ExactTheoryOnEllipse(RollingOnEllipse):
    """Rolling contact by the half-space theory with Coulomb friction under Hertzian pressure."""

    def roll(self, creepages: CreepagesAndSpin, cell_count: int, *, with_fields: bool = False) -> RollingResult:
        """Creep forces, computed with ``cell_count`` x ``cell_count`` cells around the ellipse."""
        return _exact_sum_over_patches(
            [hertzian_pressure_grid(self.a, self.b, self.pressing.load, cell_count)],
            creepages,
            self.friction,
            self.pair,
        )


class RollingOnPatches(RollingContact):
    """Rolling contact on patches of any shape; their depths and loads come from the simplified theory of 1983. The load
    acts along the normals.
    """

    def __init__(
        self, normal_contact: NormalContact, friction: float, area: float, peak: float, approach: float
    ) -> None:
        load = sum(part.load for part in normal_contact.patches)
        super().__init__(NormalResult(load, area, peak, approach), friction, normal_contact.pair)
        self.pressed = normal_contact

    @property
    def lever(self) -> float:
        """Lever of the moment (m) for the patch with the largest extent."""
        return max((abs(side) for part in self.pressed.patches for side in part.box), default=0.0)

    def along_contour(self, patch_fields: Sequence[ContactFields]) -> tuple[ContactFields, ...]:
        """Fields whose y is the position (m) along the rail's contour, so that several patches can be shown in one
        picture.
        """
        pairs = zip(patch_fields, self.pressed.patches, strict=True)
        return tuple(replace(cells, y=cells.y + part.patch.contour_position) for cells, part in pairs)


class SimplifiedTheory(RollingOnPatches):
    """Rolling contact by the simplified theory of 1983, for any undeformed distance."""

    def __init__(self, normal_contact: NormalContact, friction: float) -> None:
        super().__init__(normal_contact, friction, normal_contact.area, normal_contact.peak, normal_contact.approach)

    def roll(self, creepages: CreepagesAndSpin, cell_count: int, *, with_fields: bool = False) -> RollingResult:
        """Creep forces, with ``cell_count`` strips and as many cells per strip in each patch; fields are placed along
        the rail's contour.
        """
        forces = roll_simplified(self.pressed, self.friction, *creepages, cell_count=cell_count)
        inside = self.along_contour(forces.fields)
        return RollingResult(forces.fx, forces.fy, forces.mz, forces.stick_share, forces.power, inside)


class ExactTheory(RollingOnPatches):
    """Rolling contact by the half-space theory with Coulomb friction for pressure and tractions; the load of each patch
    comes from the theory of 1983.
    """

    def __init__(self, normal_contact: NormalContact, friction: float, cell_count: int) -> None:
        parts = normal_contact.patches
        grids = [_exact_pressure(part, cell_count, normal_contact.pair) for part in parts]
        alone = grids[0].approach / float(np.cos(parts[0].patch.lean))
        approach = alone if len(grids) == 1 else normal_contact.approach
        peak = max(float(grid.pressure.max()) for grid in grids)
        super().__init__(normal_contact, friction, sum(grid.area for grid in grids), peak, approach)

    def roll(self, creepages: CreepagesAndSpin, cell_count: int, *, with_fields: bool = False) -> RollingResult:
        """Creep forces, computed with ``cell_count`` x ``cell_count`` cells around each patch."""
        grids = [_exact_pressure(part, cell_count, self.pair) for part in self.pressed.patches]
        forces = _exact_sum_over_patches(grids, creepages, self.friction, self.pair)
        return replace(forces, fields=self.along_contour(forces.fields))


def _exact_sum_over_patches(
    pressure_grids: Sequence[PressureGrid], creepages: CreepagesAndSpin, friction: float, material_pair: MaterialPair
) -> RollingResult:
    """Sum of the exact theory's forces over the patches, none of which is affected by the tractions of another one."""
    forces, stuck, fields = np.zeros(3), 0.0, list[ContactFields]()
    for grid in pressure_grids:
        patch, (x, y) = solve_rolling(grid, friction, *creepages, material_pair), np.meshgrid(grid.x, grid.y)
        forces += patch.fx, patch.fy, patch.mz
        stuck += np.count_nonzero(patch.stick & grid.contact) * grid.dx * grid.dy
        px, py = np.moveaxis(patch.traction, -1, 0)
        sizes = np.full_like(x, grid.dx), np.full_like(x, grid.dy)
        fields.append(ContactFields(x, y, *sizes, grid.pressure, px, py, ~patch.stick, grid.contact))
    share = float(stuck / sum(grid.area for grid in pressure_grids))
    fx, fy, mz = forces.tolist()
    return RollingResult(fx, fy, mz, share, -float(np.dot((fx, fy, mz), creepages)), tuple(fields))


GRID_MARGINS = (1.2, 1.6, 2.2)
"""Ratios of the sides of the exact normal problem's grid to those of the simplified theory's area, tried until the
contact fits.
"""


def _exact_pressure(patch: PatchPressure, cell_count: int, material_pair: MaterialPair) -> NormalSolution:
    """Exact pressure of one patch at the load from the simplified theory, in the patch's own coordinates."""
    (x0, x1, y0, y1), known = patch.box, patch.patch.distance
    for margin in GRID_MARGINS:
        dx, dy = (
            margin * (x1 - x0) / (cell_count - 2),
            margin * (y1 - y0) / (cell_count - 2),
        )  # a frame of cells stays free
        x, y = (x0 + x1) / 2 + cell_centres(cell_count, dx), (y0 + y1) / 2 + cell_centres(cell_count, dy)
        inside = np.meshgrid(np.clip(x, known.x[0], known.x[-1]), np.clip(y, known.y[0], known.y[-1]))
        try:
            return replace(solve_normal(known.at(*inside), dx, dy, material_pair, load=patch.load), x=x, y=y)
        except InputError:  # the contact reaches the edge of the grid
            continue
    if not any(patch.patch.cut):
        allowed = f"finds no grid that holds the area of a load of {patch.load:.3g} N: use simplified, or another load"
        raise InputError("", "method.name", "exact", allowed)
    allowed = (
        "does not take patches of wheel and rail that have grown together: use simplified, a smaller load or "
        "another lateral_shift"
    )
    raise InputError("", "method.name", "exact", allowed)
