"""Random contacts up to extreme values, and violations of the invariants of their creep forces.

Tractions of at most g = mu times the pressure that they are bounded by have, about the normal through the centre, at
most the moment of the sum of g r dA over the cells, r the distance of a cell's centre from there. With the forces that
go with it, the moment is bounded more closely: whatever the slip w, no tractions take more power than the sum of
g |w| dA, so also at the contact's own creepages and spin (limit surface of Goyal, Ruina and Papadopoulos, Wear 143
(1991) 307). On 21 cells the first sum is up to 0.3 % larger than the integral.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from models.contact.fastsim import CreepForces, RollingEllipse, fastsim
from models.contact.fastsim_grid import BoundShape, grids_of_ratios
from models.contact.inputs import Array
from models.contact.material import MaterialPair

COMPUTED_OPTIONS: tuple[dict[str, Any], ...] = (
    {},
    {"cells": 11, "bound": "parabolic"},
    {"bound": "elliptic"},
    {"flexibilities": "three"},
    {"flexibilities": "one"},
    {"march": "plain"},
    {"cells": 9, "bound": "elliptic", "march": "plain", "flexibilities": "one"},
    {"cells": 12, "bound": "elliptic", "flexibilities": "three"},
)
"""Options of FASTSIM with which the random contacts are computed, in turn."""
KIND_COUNT = 8
SIMILAR_CONTACTS: dict[str, tuple[dict[str, float], tuple[float, ...]]] = {
    "reversal": ({"xi_x": -1.0, "xi_y": -1.0, "spin": -1.0}, (-1.0, -1.0, -1.0)),
    "mirror": ({"xi_y": -1.0, "spin": -1.0}, (1.0, -1.0, -1.0)),
    "similarity": ({"a": 2.0, "b": 2.0, "load": 8.0, "xi_x": 2.0, "xi_y": 2.0}, (8.0, 8.0, 16.0)),
}
"""Symmetry -> factors on the inputs of a contact, and factors by which fx, fy and mz must then change; "similarity" is
the contact of twice the size."""
SUM_ROUNDING = 1e-12
"""Relative rounding error of sums over some hundred cells, each accurate to 1e-16."""


def random_contacts(seed: int, stream_number: int, contact_count: int) -> dict[str, Any]:
    """Random contacts: load 1e-6 to 1e6 N, friction 1e-6 to 1, a/b 1e-3 to 1e3, creepage 0 to 1, spin up to
    1/b.

    In turn: pure xi_x, xi_y and spin, none at all, spin against lateral creepage with its pole inside the ellipse, all
    of one size, all of random sizes, and a load of zero or less.
    """
    draw = np.random.default_rng((seed, stream_number))
    load, mu, ratio = (10.0 ** draw.uniform(*ends, contact_count) for ends in ((-6, 6), (-6, 0), (-3, 3)))
    mean = 1.2e-4 * np.cbrt(load) * 10.0 ** draw.uniform(-0.5, 0.5, contact_count)
    a, b = mean * np.sqrt(ratio), mean / np.sqrt(ratio)
    kind = np.arange(contact_count) % KIND_COUNT
    sizes = 10.0 ** draw.uniform(-12, 0, (3, contact_count)) * draw.choice((-1.0, 1.0), (3, contact_count))
    sizes[:, kind == 5] = np.abs(sizes[0, kind == 5]) * np.sign(sizes[:, kind == 5])
    xi_x, xi_y, spin = sizes[0], sizes[1], sizes[2] / np.maximum(a, b)
    for i, values in enumerate((xi_x, xi_y, spin)):
        values[(kind < 4) & (kind != i)] *= 0.0
    against = kind == 4
    xi_y[against] = (-spin * a * draw.uniform(-1, 1, contact_count))[against]
    xi_x[against] = (spin * b * draw.uniform(-1, 1, contact_count) * draw.integers(0, 2, contact_count))[against]
    load[kind == 7] *= -draw.integers(0, 2, contact_count)[kind == 7]
    return {"a": a, "b": b, "load": load, "mu": mu, "xi_x": xi_x, "xi_y": xi_y, "spin": spin}


def worst_violation(
    contact_columns: Mapping[str, Any], theory_options: Mapping[str, Any], material_pair: MaterialPair
) -> dict[str, float]:
    """Invariant -> its largest violation over contacts, divided by mu N (and by the creepages where these scale it);
    infinite for values that are not finite."""
    creep = fastsim(RollingEllipse(**contact_columns), material_pair, **theory_options)
    limit = contact_columns["mu"] * np.maximum(contact_columns["load"], 0.0)
    least, arm = np.maximum(limit, np.finfo(float).tiny), np.maximum(contact_columns["a"], contact_columns["b"])
    motion = np.hypot(contact_columns["xi_x"], contact_columns["xi_y"]) + np.abs(contact_columns["spin"]) * arm
    still, power = (motion == 0.0) | (limit == 0.0), least * np.where(motion > 0.0, motion, 1.0)
    net = {name: theory_options[name] for name in ("cells", "bound") if name in theory_options}

    def scaled_forces(creep_forces: CreepForces, force_scales: tuple[float, ...]) -> Array:
        parts = zip(
            (creep_forces.fx, creep_forces.fy, creep_forces.mz), force_scales, (least, least, least * arm), strict=True
        )
        return np.array([value / size / unit for value, size, unit in parts])

    def difference_of_similar(scaled_quantity: str) -> float:
        factors, sizes = SIMILAR_CONTACTS[scaled_quantity]
        changed = {key: value * factors.get(key, 1.0) for key, value in contact_columns.items()}
        return _largest_finite(
            np.abs(forces - scaled_forces(fastsim(RollingEllipse(**changed), material_pair, **theory_options), sizes))
        )

    forces = scaled_forces(creep, (1.0, 1.0, 1.0))
    return {
        "finite": 0.0 if all(np.isfinite(values).all() for values in vars(creep).values()) else np.inf,
        "bound": _largest_finite(np.hypot(forces[0], forces[1]) - 1.0),
        "moment": _largest_finite((np.abs(creep.mz) - moment_bound(contact_columns, **net)) / (least * arm)),
        "limit": _largest_finite((creep.dissipation - power_bound(contact_columns, **net)) / power),
        "reversal": difference_of_similar("reversal"),
        "mirror": difference_of_similar("mirror"),
        "power": _largest_finite(-creep.dissipation / power),
        "zero": _largest_finite(np.abs(forces[:, still])),
        "similarity": difference_of_similar("similarity"),
        "stick": _largest_finite(np.abs(creep.stick - 0.5) - 0.5),
    }


def _largest_finite(values: Array) -> float:
    """Largest of the values and 0; infinite if a value is not finite."""
    if not values.size:
        return 0.0
    return float(max(0.0, np.where(np.isfinite(values), values, np.inf).max()))


def moment_bound(contact_columns: Mapping[str, Any], cells: int = 21, bound: BoundShape = "intermediate") -> Array:
    """Upper bound (n,) of the spin moment (N m) for contacts with arrays (n,) of semi-axes a, b (m), load (N) and
    friction mu."""
    pure = {
        "xi_x": np.zeros_like(contact_columns["a"]),
        "xi_y": np.zeros_like(contact_columns["a"]),
        "spin": np.ones_like(contact_columns["a"]),
    }
    return power_bound({**contact_columns, **pure}, cells, bound)


def power_bound(contact_columns: Mapping[str, Any], cells: int = 21, bound: BoundShape = "intermediate") -> Array:
    """Upper bound (n,) of the power that friction dissipates, divided by the rolling speed (N). The columns hold a, b,
    load, mu, and creepages xi_x, xi_y, spin."""
    a, b, xi_x, xi_y, spin = (contact_columns[name][:, None, None] for name in ("a", "b", "xi_x", "xi_y", "spin"))
    work = np.zeros(len(contact_columns["a"]))
    for rows, net in grids_of_ratios(contact_columns["a"] / contact_columns["b"], cells, bound):
        strips, along_strip = net.records
        y, half, part = (values[:, None] for values in (strips.y, strips.half, strips.part))
        along, across = -b[rows] * y, a[rows] * half * along_strip.centre
        slip = np.hypot(xi_x[rows] + spin[rows] * along, xi_y[rows] + spin[rows] * across)
        work[rows] = np.sum(part * along_strip.bound * slip, axis=(1, 2))
    return contact_columns["mu"] * np.maximum(contact_columns["load"], 0.0) * work
