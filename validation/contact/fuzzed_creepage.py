"""Random contacts up to the extremes, and how far creep forces are from what must always hold of them."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from models.contact.fastsim import fastsim
from models.contact.material import Pair
from validation.contact.friction_limit import most_moment, most_power

OPTIONS: tuple[dict[str, Any], ...] = (
    {},
    {"cells": 11, "bound": "parabolic"},
    {"bound": "elliptic"},
    {"flexibilities": "three"},
    {"flexibilities": "one"},
    {"march": "plain"},
    {"cells": 9, "bound": "elliptic", "march": "plain", "flexibilities": "one"},
    {"cells": 12, "bound": "elliptic", "flexibilities": "three"},
)
"""What the contacts are computed with, in turn."""
KINDS = 8
ROUNDING = 1e-12
"""Of sums over some hundred cells, each right to 1e-16."""


def contacts(seed: int, stream: int, count: int) -> dict[str, Any]:
    """``count`` contacts: load 1e-6 to 1e6 N, friction 1e-6 to 1, a/b 1e-3 to 1e3, creepage 0 to 1, spin up to 1 by b.

    In turn: pure xi_x, xi_y and spin, none at all, spin against lateral creepage with its pole inside the ellipse, all
    of one size, all of random sizes, and a load of zero or less.
    """
    draw = np.random.default_rng((seed, stream))
    load, mu, ratio = (10.0 ** draw.uniform(*ends, count) for ends in ((-6, 6), (-6, 0), (-3, 3)))
    mean = 1.2e-4 * np.cbrt(load) * 10.0 ** draw.uniform(-0.5, 0.5, count)
    a, b = mean * np.sqrt(ratio), mean / np.sqrt(ratio)
    kind = np.arange(count) % KINDS
    sizes = 10.0 ** draw.uniform(-12, 0, (3, count)) * draw.choice((-1.0, 1.0), (3, count))
    sizes[:, kind == 5] = np.abs(sizes[0, kind == 5]) * np.sign(sizes[:, kind == 5])
    xi_x, xi_y, spin = sizes[0], sizes[1], sizes[2] / np.maximum(a, b)
    for own in (0, 1, 2, 3):
        for i, values in enumerate((xi_x, xi_y, spin)):
            values[kind == own] *= float(i == own)
    against = kind == 4
    xi_y[against] = (-spin * a * draw.uniform(-1, 1, count))[against]
    xi_x[against] = (spin * b * draw.uniform(-1, 1, count) * draw.integers(0, 2, count))[against]
    load[kind == 7] *= -draw.integers(0, 2, count)[kind == 7]
    return {"a": a, "b": b, "load": load, "mu": mu, "xi_x": xi_x, "xi_y": xi_y, "spin": spin}


def worst(given: Mapping[str, Any], options: Mapping[str, Any], pair: Pair) -> dict[str, float]:
    """Largest violation of each invariant, by mu N and the creepages where it has a size; not finite counts as inf."""
    found = fastsim(**given, pair=pair, **options)
    back = fastsim(**{**given, **{name: -given[name] for name in ("xi_x", "xi_y", "spin")}}, pair=pair, **options)
    mirror = fastsim(**{**given, **{name: -given[name] for name in ("xi_y", "spin")}}, pair=pair, **options)
    grown = fastsim(**{**given, **_grown(given)}, pair=pair, **options)
    limit = given["mu"] * np.maximum(given["load"], 0.0)
    least = np.maximum(limit, np.finfo(float).tiny)
    arm = np.maximum(given["a"], given["b"])
    creep = np.hypot(given["xi_x"], given["xi_y"]) + np.abs(given["spin"]) * arm
    still = (creep == 0.0) | (limit == 0.0)
    net = {name: options[name] for name in ("cells", "bound") if name in options}
    forces = np.stack([found.fx / least, found.fy / least, found.mz / (least * arm)])
    reverse = np.stack([back.fx / least, back.fy / least, back.mz / (least * arm)])
    mirrored = np.stack([mirror.fx / least, -mirror.fy / least, -mirror.mz / (least * arm)])
    larger = np.stack([grown.fx / 8.0 / least, grown.fy / 8.0 / least, grown.mz / 16.0 / (least * arm)])
    return {
        "finite": 0.0 if all(np.isfinite(values).all() for values in vars(found).values()) else np.inf,
        "bound": _most(np.hypot(forces[0], forces[1]) - 1.0),
        "moment": _most((np.abs(found.mz) - most_moment(given, **net)) / (least * arm)),
        "limit": _most((found.dissipation - most_power(given, **net)) / (least * np.where(creep > 0.0, creep, 1.0))),
        "reversal": _most(np.abs(forces + reverse)),
        "mirror": _most(np.abs(forces - mirrored)),
        "power": _most(-found.dissipation / (least * np.where(creep > 0.0, creep, 1.0))),
        "zero": _most(np.abs(forces[:, still])),
        "similarity": _most(np.abs(forces - larger)),
        "stick": _most(np.abs(found.stick - 0.5) - 0.5),
    }


def _grown(given: Mapping[str, Any]) -> dict[str, Any]:
    """The similar contact of twice the size: eight times the load, twice the creepage."""
    powers = {"a": 2.0, "b": 2.0, "load": 8.0, "xi_x": 2.0, "xi_y": 2.0}
    return {name: given[name] * power for name, power in powers.items()}


def _most(values: np.ndarray) -> float:
    """The largest value, infinite if one is none; 0 if there are none, or all are below."""
    if not values.size:
        return 0.0
    return float(max(0.0, np.where(np.isnan(values), np.inf, values).max()))
