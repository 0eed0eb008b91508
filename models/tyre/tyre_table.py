"""Friction of a tyre by tables of friction coefficients: mu_x(slip angle, slip, load) along, and mu_y = g(slip angle,
slip) h(slip angle, load) across the wheel.

Between the nodes each is linear in every variable, at the nodes exact, beyond the last node constant; slopes are those
of the cell. Their resultant does not exceed the largest of either. Source: G.
Palmkvist and O. Nordstrom, A hybrid laboratory test method for anti-lock systems (IAVSD extensive summaries): friction
is "defined at distinct points and by linear interpolation".
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from models.core.errors import InputError
from models.machine.compiled import lean

LARGEST_FRICTION = 3.0
"""Largest friction coefficient that a tyre on a road can have."""
ROUNDING_SHARE = 0.01
"""Share by which the resultant friction may be above the largest in a single direction: figures are rounded."""


@dataclass(frozen=True, eq=False)
class TyreTable:
    """Tables of the friction coefficients of a tyre on a surface.

    angles (a,) : slip angles in rad, rising from 0; slips (s,) : rising from 0 to 1; loads (f,) : N, rising, above 0;
    mu_x (a, f, s) : along the wheel; g (a, s), h (a, f) : mu_y = g h across it, as a magnitude.
    """

    angles: np.ndarray
    slips: np.ndarray
    loads: np.ndarray
    mu_x: np.ndarray
    g: np.ndarray
    h: np.ndarray
    name: str = ""

    def __post_init__(self) -> None:
        for name in ("angles", "slips", "loads", "mu_x", "g", "h"):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), dtype=float))
        self._check_nodes()
        self._check_values()

    def _check_nodes(self) -> None:
        for name in ("angles", "slips", "loads"):
            nodes = getattr(self, name)
            if nodes.ndim != 1 or nodes.size == 0 or not np.isfinite(nodes).all() or (np.diff(nodes) <= 0.0).any():
                raise InputError(self.name, name, nodes.tolist()[:8], "must be finite numbers that rise strictly")
        if self.angles[0] != 0.0 or self.angles[-1] > np.pi / 2.0:
            raise InputError(self.name, "angles", float(self.angles[0]), "must begin at 0 and end at pi/2 or before")
        if self.slips[0] != 0.0 or self.slips[-1] != 1.0:
            raise InputError(self.name, "slips", float(self.slips[-1]), "must begin at 0 and end at 1 (locked)")
        if self.loads[0] <= 0.0:
            raise InputError(self.name, "loads", float(self.loads[0]), "must be above 0")

    def _check_values(self) -> None:
        a, s, f = self.angles.size, self.slips.size, self.loads.size
        for name, shape in (("mu_x", (a, f, s)), ("g", (a, s)), ("h", (a, f))):
            values = getattr(self, name)
            if values.shape != shape:
                raise InputError(self.name, name, values.shape, f"must have the shape {shape} of its nodes")
            if not np.isfinite(values).all() or values.min() < 0.0 or values.max() > LARGEST_FRICTION:
                raise InputError(
                    self.name, name, float(np.abs(values).max()), f"must be numbers from 0 to {LARGEST_FRICTION:g}"
                )
        if self.mu_x[:, :, 0].any():
            raise InputError(self.name, "mu_x", float(self.mu_x[:, :, 0].max()), "must be 0 at slip 0")
        if self.h[0].any():
            raise InputError(self.name, "h", float(self.h[0].max()), "must be 0 at slip angle 0")
        self._check_resultant()

    def _check_resultant(self) -> None:
        """Raise InputError if the resultant friction is above the largest mu_x or mu_y. Friction is linear in slip and
        load, so only angles between nodes are checked besides."""
        peak = max(self.mu_x.max(), (self.g[:, None, :] * self.h[:, :, None]).max())
        for share in (0.0, 0.25, 0.5, 0.75) if self.angles.size > 1 else (0.0,):
            x, g, h = (
                values + share * np.diff(values, axis=0, append=values[-1:]) for values in (self.mu_x, self.g, self.h)
            )
            total = np.hypot(x, g[:, None, :] * h[:, :, None])
            if total.max() > peak * (1.0 + ROUNDING_SHARE):
                i, j, k = np.unravel_index(total.argmax(), total.shape)
                largest_position = (
                    f"slip angle {np.rad2deg(self.angles[i]):.4g} deg, load {self.loads[j]:g} N, slip {self.slips[k]:g}"
                )
                raise InputError(
                    self.name,
                    largest_position,
                    float(total[i, j, k]),
                    "both together must not be above the largest "
                    f"of either alone, {peak:.6g}, by more than {ROUNDING_SHARE:.0%}",
                )

    @property
    def cornering(self) -> float:
        """Largest slope (1/rad) of the lateral friction mu_y over the slip angle, at zero slip angle."""
        if self.angles.size == 1:
            return 0.0
        return float((self.g[1].max() * self.h[1].max()) / self.angles[1])

    def refined(self, angles: np.ndarray, slips: np.ndarray, loads: np.ndarray) -> "TyreTable":
        """The table on finer nodes that include its own nodes; linear interpolation keeps its values."""
        mu_x, g, h = self._at_nodes(angles, slips, loads)
        return TyreTable(angles, slips, loads, mu_x, g, h, self.name)

    def scaled(self, friction_factor: float) -> "TyreTable":
        """Returns a copy of the table in which friction is ``friction_factor`` times as large."""
        return replace(self, mu_x=friction_factor * self.mu_x, h=friction_factor * self.h)

    def friction(self, angles: np.ndarray, slips: np.ndarray, load: float) -> tuple[np.ndarray, np.ndarray]:
        """Friction coefficients mu_x and mu_y (a, s) at slip angles (rad, from 0), slips from 0 to 1 and a load (N)."""
        mu_x, g, h = self._at_nodes(np.asarray(angles, dtype=float), np.asarray(slips, dtype=float), np.array([load]))
        return mu_x[:, 0, :], g * h

    def characteristic_values(self, load: float) -> dict[str, float]:
        """Characteristic friction values of the tyre under a load (N), by name and unit."""
        x, y = self.friction(self.angles, self.slips, load)
        little_slip, little_angle = self.slips[1], self.angles[min(1, self.angles.size - 1)]
        return {
            "peak along": float(x[0].max()),
            "at slip [%]": 100.0 * float(self.slips[x[0].argmax()]),
            "locked": float(x[0, -1]),
            "slope [1/%]": 0.01 * float(x[0, 1] / little_slip),
            "peak across": float(y[:, 0].max()),
            "at slip angle [deg]": float(np.rad2deg(self.angles[y[:, 0].argmax()])),
            "slope [1/deg]": float(y[:, 0][min(1, len(y) - 1)] / np.rad2deg(little_angle)) if little_angle else 0.0,
        }

    def _at_nodes(self, angles: np.ndarray, slips: np.ndarray, loads: np.ndarray) -> list[np.ndarray]:
        """Tables mu_x, g and h, interpolated at other nodes."""
        mu_x = _interpolate_axis(
            _interpolate_axis(_interpolate_axis(self.mu_x, 0, self.angles, angles), 1, self.loads, loads),
            2,
            self.slips,
            slips,
        )
        g = _interpolate_axis(_interpolate_axis(self.g, 0, self.angles, angles), 1, self.slips, slips)
        return [mu_x, g, _interpolate_axis(_interpolate_axis(self.h, 0, self.angles, angles), 1, self.loads, loads)]


def _interpolate_axis(table_values: np.ndarray, axis: int, old_nodes: np.ndarray, new_nodes: np.ndarray) -> np.ndarray:
    """Values at new nodes along one axis, linear between the old ones and constant beyond."""
    if np.array_equal(old_nodes, new_nodes):
        return table_values
    cell = np.interp(new_nodes, old_nodes, np.arange(old_nodes.size))
    low = np.minimum(cell.astype(int), max(old_nodes.size - 2, 0))
    share = np.expand_dims(cell - low, tuple(range(1, table_values.ndim - axis)))
    values_below, values_above = (
        table_values.take(low, axis),
        table_values.take(np.minimum(low + 1, old_nodes.size - 1), axis),
    )
    return (1.0 - share) * values_below + share * values_above


class StackedTyreTables(NamedTuple):
    """Tables of t tyres on common nodes, for compiled functions: mu_x (t, a, f, s), g (t, a, s), h (t, a, f)."""

    angles: np.ndarray
    slips: np.ndarray
    loads: np.ndarray
    mu_x: np.ndarray
    g: np.ndarray
    h: np.ndarray


class TableCell(NamedTuple):
    """Location of a slip angle and a load in the tables: the cells of both, and their relative positions in these
    cells."""

    angle: int
    angle_share: float
    load: int
    load_share: float


def stacked_tables(tyre_tables: Sequence[TyreTable]) -> StackedTyreTables:
    """``StackedTyreTables`` of several tyres on the union of their nodes, which does not change their interpolated
    values.
    """
    if not tyre_tables:
        raise InputError("", "tyres", [], "needs at least one table")
    nodes = [
        np.unique(np.concatenate([getattr(t, name) for t in tyre_tables])) for name in ("angles", "slips", "loads")
    ]
    fine = [t.refined(*nodes) for t in tyre_tables]
    return StackedTyreTables(*nodes, *(np.stack([getattr(t, name) for t in fine]) for name in ("mu_x", "g", "h")))


@lean
def cell_and_share(table_nodes, node_value):
    """Index of the table cell that contains a value, and the value's relative position in the cell; clamped at the
    ends."""
    last_node = table_nodes.size - 1
    if last_node == 0 or node_value <= table_nodes[0]:
        return 0, 0.0
    if node_value >= table_nodes[last_node]:
        return last_node - 1, 1.0
    low, high = 0, last_node
    while high - low > 1:
        middle = (low + high) // 2
        if table_nodes[middle] <= node_value:
            low = middle
        else:
            high = middle
    return low, (node_value - table_nodes[low]) / (table_nodes[low + 1] - table_nodes[low])


@lean
def lateral_adhesion(table_index, table_cell, slip_cell, slip_share, slip_factors, angle_factors):
    """Lateral friction coefficient mu_y of a table at the slip angle and load of ``table_cell``, and at the slip in
    cell k with relative position w.
    """
    i, p, j, q = table_cell
    i1, j1, k1 = (
        min(i + 1, angle_factors.shape[1] - 1),
        min(j + 1, angle_factors.shape[2] - 1),
        min(slip_cell + 1, slip_factors.shape[2] - 1),
    )
    by_slip = (1.0 - p) * (
        (1.0 - slip_share) * slip_factors[table_index, i, slip_cell] + slip_share * slip_factors[table_index, i, k1]
    )
    by_slip += p * (
        (1.0 - slip_share) * slip_factors[table_index, i1, slip_cell] + slip_share * slip_factors[table_index, i1, k1]
    )
    if q == 0.0:  # at a node, as everywhere in a table of one load
        return by_slip * ((1.0 - p) * angle_factors[table_index, i, j] + p * angle_factors[table_index, i1, j])
    by_load = (1.0 - p) * ((1.0 - q) * angle_factors[table_index, i, j] + q * angle_factors[table_index, i, j1])
    by_load += p * ((1.0 - q) * angle_factors[table_index, i1, j] + q * angle_factors[table_index, i1, j1])
    return by_slip * by_load


@lean
def longitudinal_adhesion(table_index, table_cell, slip_node, mu_x):
    """Longitudinal friction coefficient mu_x of a table at the slip angle and load of ``table_cell``, and at slip
    node k.
    """
    i, p, j, q = table_cell
    i1, j1 = min(i + 1, mu_x.shape[1] - 1), min(j + 1, mu_x.shape[2] - 1)
    if q == 0.0:
        return (1.0 - p) * mu_x[table_index, i, j, slip_node] + p * mu_x[table_index, i1, j, slip_node]
    low = (1.0 - q) * mu_x[table_index, i, j, slip_node] + q * mu_x[table_index, i, j1, slip_node]
    return (1.0 - p) * low + p * (
        (1.0 - q) * mu_x[table_index, i1, j, slip_node] + q * mu_x[table_index, i1, j1, slip_node]
    )
