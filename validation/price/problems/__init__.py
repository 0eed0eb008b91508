"""Test problems of the work-precision measurements: one file each, with the computed quantities and their errors.

A problem knows its reference solution and that solution's own uncertainty; ``models.advice.price.runner`` does the
rest. A new system adds a file here whose class fulfils ``models.advice.price.problem.WorkPrecisionProblem``.
"""

from collections.abc import Callable

import numpy as np

from models.advice.price.problem import Setting

Curves = dict[tuple[str, str], tuple[float, ...]]
"""Steps (s), tolerances or sampling rates that are tried, by engine and method."""


def curves_of_methods(engine: str, steps_or_tolerances: tuple[float, ...], *method_names: str) -> Curves:
    """Curves of several methods of an engine, all with the same steps or tolerances."""
    return {(engine, method): steps_or_tolerances for method in method_names}


def milliseconds(*steps_in_milliseconds: float) -> tuple[float, ...]:
    """Steps in s, from steps in milliseconds."""
    return tuple(1e-3 * step for step in steps_in_milliseconds)


def settings_of_curves(
    values_of_curves: Curves, make_setting: Callable[[str, str, float], Setting]
) -> tuple[Setting, ...]:
    """One setting for each value of each curve, made by ``make_setting(engine, method, value)``."""
    return tuple(make_setting(*curve, value) for curve, values in values_of_curves.items() for value in values)


def largest_differences(computed_values: dict[str, np.ndarray], true_values: dict[str, np.ndarray]) -> dict[str, float]:
    """Largest absolute difference of each quantity from its reference values."""
    return {name: float(np.abs(values - true_values[name]).max()) for name, values in computed_values.items()}
