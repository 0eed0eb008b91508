"""Figures of a work-precision curve: its order of convergence, which curves coincide, and the cost at which it meets an
error.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

RESOLVED_ERROR_FACTOR = 10.0
"""Ratio of an error to the uncertainty of the reference below which the point is drawn hollow."""
FITTED_POINT_COUNT = 3
"""Number of the finest points to which an observed order is fitted, as the coarse ones are not yet asymptotic."""
EQUAL_ERROR_SHARE = 0.01
"""Relative difference up to which two errors count as equal."""


def log_log_slope(step_sizes: Sequence[float], errors: Sequence[float]) -> float:
    """Least-squares slope of the logarithm of error over the logarithm of step size; not a number for fewer than two
    points.
    """
    if len(step_sizes) < 2:
        return float("nan")
    return float(np.polyfit(np.log(step_sizes), np.log(errors), 1)[0])


def observed_order(step_sizes: Sequence[float], errors: Sequence[float], error_floor: float) -> float:
    """Observed order of convergence: slope of log error over log step size, at the finest points whose errors are above
    ``error_floor``.
    """
    clear = sorted((h, e) for h, e in zip(step_sizes, errors, strict=True) if e >= error_floor)[:FITTED_POINT_COUNT]
    return log_log_slope(*zip(*clear, strict=True)) if len(clear) > 1 else float("nan")


def coinciding_curves(curves: Mapping[str, Mapping[float, float]]) -> list[tuple[str, ...]]:
    """Groups of work-precision curves (name -> {setting: error}) that coincide: their errors at all common settings
    agree to EQUAL_ERROR_SHARE.

    At least three settings must be common: two curves that merely cross are not the same.
    """
    groups: list[list[str]] = []
    for name, curve in curves.items():
        home = next((group for group in groups if _coincide(curve, curves[group[0]])), None)
        groups.append([name]) if home is None else home.append(name)
    return [tuple(group) for group in groups if len(group) > 1]


def _coincide(curve: Mapping[float, float], other_curve: Mapping[float, float]) -> bool:
    common = set(curve) & set(other_curve)
    return len(common) >= 3 and all(
        abs(curve[x] - other_curve[x]) <= EQUAL_ERROR_SHARE * max(curve[x], other_curve[x]) for x in common
    )


@dataclass(frozen=True)
class ToleranceCost:
    """Cost at which a method meets a tolerance: the cost, the setting's value, and the ``origin`` of both.

    "tried" : the first setting that does, nothing in between; "coarsest" : already the coarsest setting
    does; "extrapolated" : not even the finest does.
    """

    cost: float
    value: float
    origin: Literal["interpolated", "tried", "coarsest", "extrapolated"]


def cost_at_tolerance(
    setting_values: Sequence[float],
    errors: Sequence[float],
    costs: Sequence[float],
    target_error: float,
    convergence_order: int = 0,
    extrapolate: bool = False,
) -> ToleranceCost | None:
    """Cost at which the error of a work-precision curve falls below ``target_error`` and stays there; None where it
    does not.

    Points are taken from coarse to fine by ``setting_values``. With the declared ``convergence_order`` of a fixed-step
    method the answer is interpolated log-log between two settings, and, with ``extrapolate``, carried beyond the finest
    one. Order 0 stands for adaptive methods, whose error is no smooth function of their tolerance: there only
    settings that were tried count. None where the target is not met.
    """
    table = np.array(sorted(zip(setting_values, errors, costs, strict=True), reverse=True))
    rows_above = np.flatnonzero(table[:, 1] > target_error)
    if not len(rows_above):
        return ToleranceCost(float(table[0, 2]), float(table[0, 0]), "coarsest")
    last_above = int(rows_above[-1])
    if last_above + 1 < len(table) and not convergence_order:
        return ToleranceCost(float(table[last_above + 1, 2]), float(table[last_above + 1, 0]), "tried")
    if last_above + 1 < len(table):
        logs = np.log(table[last_above : last_above + 2])
        fraction = (logs[0, 1] - np.log(target_error)) / (logs[0, 1] - logs[1, 1])
        value, _, cost = np.exp(logs[0] + fraction * (logs[1] - logs[0]))
        return ToleranceCost(float(cost), float(value), "interpolated")
    if not (extrapolate and convergence_order):
        return None
    finer = (table[-1, 1] / target_error) ** (1 / convergence_order)
    return ToleranceCost(float(table[-1, 2] * finer), float(table[-1, 0] / finer), "extrapolated")


def pareto_front(costs: Sequence[float], errors: Sequence[float]) -> list[int]:
    """Indices of the points that no other point beats in both cost and error, in the order of rising cost."""
    order = sorted(range(len(costs)), key=lambda i: (costs[i], errors[i]))
    front: list[int] = []
    for i in order:
        if not front or errors[i] < (1 - EQUAL_ERROR_SHARE) * errors[front[-1]]:
            front.append(i)
    return front
