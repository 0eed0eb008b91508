"""Least-squares fit in stages, each of which can be stored and resumed with identical bits."""

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from models.core.errors import InputError
from models.ensemble.store import BlockStore
from models.identification.problem import FAILED_RESIDUAL, IdentificationProblem

TRIALS_OF_STAGE, MOST_STAGES = 4, 20
"""Most trials of parameter values per stage, and most stages of a fit."""
LEAST_COST_DECREASE = 1e-4
"""Relative decrease of the cost in a stage at which a fit ends: with the residuals of a hundred corners, estimates then
move by a tenth of their standard errors at most."""
STEP_INSIDE_BOUNDS = 1e-6
"""Distance, in the parameter's scale, by which start values lie inside their bounds."""
StageProgress = Callable[[str, float], None]
"""Function that is called after each stage with a text and the completed share of the fit."""


@dataclass(frozen=True, eq=False)
class ParameterFit:
    """Result of a fit. values (p,) : estimates; residuals (channels, m); cost : half the sum of the squared residuals;
    stages : number of stages; converged : whether the cost settled."""

    problem: IdentificationProblem
    values: np.ndarray
    residuals: np.ndarray
    cost: float
    stages: int
    converged: bool

    @property
    def is_at_bound(self) -> np.ndarray:
        """Which of the estimates (p,) lie at a bound."""
        low, high = self.problem.bounds
        near = 1e-3 * self.problem.scales
        return (self.values - low < near) | (high - self.values < near)


def fit(
    identification_problem: IdentificationProblem,
    stage_store: BlockStore | None = None,
    report_stage: StageProgress = lambda text, share: None,
    first_block_number: int = 0,
    executor: Executor | None = None,
) -> ParameterFit:
    """Least-squares estimates of a problem's parameters; InputError where the model fails at the start values.

    stage_store : finished stages, the first of them block ``first_block_number``; report_stage : told after each stage;
    executor : computes the columns of Jacobians.
    """
    values, cost, converged = identification_problem.start_values, np.inf, False
    for stage in range(MOST_STAGES):
        if stage_store is not None and stage_store.has(first_block_number + stage):
            block = stage_store.load(first_block_number + stage)
        else:
            block = _one_stage(identification_problem, values, executor)
            if stage_store is not None:
                stage_store.save(first_block_number + stage, block)
        values, cost_before, cost = block["values"], cost, float(block["cost"])
        converged = cost_before - cost <= LEAST_COST_DECREASE * cost
        size = np.sqrt(2.0 * cost / int((identification_problem.weights > 0.0).sum()))
        report_stage(f"stage {stage + 1}, error {size:.4g} of the channels", _completed_share(stage, cost_before, cost))
        if converged:
            break
    return ParameterFit(
        identification_problem, values, identification_problem.residuals(values), cost, stage + 1, converged
    )


def _completed_share(stage_number: int, previous_cost: float, cost: float) -> float:
    """Estimated completed share of the fit, from how little a stage still reduces the cost."""
    settled = (
        0.0
        if not np.isfinite(previous_cost)
        else min(1.0, -np.log10(max(1.0 - cost / previous_cost, LEAST_COST_DECREASE)) / 4.0)
    )
    return 0.9 * max(settled, stage_number / MOST_STAGES)


def _one_stage(
    identification_problem: IdentificationProblem, start_values: np.ndarray, executor: Executor | None
) -> dict[str, np.ndarray]:
    """Values and cost after one stage of the fit: a few iterations that start from ``start_values`` (p,)."""
    from scipy.optimize import least_squares

    scale, (low, high), residuals = (
        identification_problem.scales,
        identification_problem.bounds,
        identification_problem.residuals,
    )
    begin = np.clip(start_values / scale, low / scale + STEP_INSIDE_BOUNDS, high / scale - STEP_INSIDE_BOUNDS)
    if np.abs(residuals(begin * scale)).max() >= FAILED_RESIDUAL:
        names = ", ".join(
            f"{parameter.name} = {value:.4g}"
            for parameter, value in zip(identification_problem.parameters, start_values, strict=True)
        )
        raise InputError("identify", "start", names, "the model fails at these values: start from others")
    solved = least_squares(
        lambda x: residuals(x * scale).ravel(),
        begin,
        jac=lambda x: identification_problem.jacobian(x * scale, residuals, executor).reshape(-1, len(x)),
        bounds=(low / scale, high / scale),
        max_nfev=TRIALS_OF_STAGE,
        ftol=0.1 * LEAST_COST_DECREASE,
        xtol=1e-8,
        gtol=1e-12,
    )
    return {"values": solved.x * scale, "cost": np.array(solved.cost)}


def problem_with_fixed_parameter(
    identification_problem: IdentificationProblem, parameter_index: int, fixed_value: float, start_values: np.ndarray
) -> IdentificationProblem:
    """The problem with parameter number ``parameter_index`` fixed at a value; the others start from ``start_values``
    (p,).
    """
    other_parameters = [
        replace(parameter, start=float(start_value))
        for parameter, start_value in zip(identification_problem.parameters, start_values, strict=True)
    ]
    del other_parameters[parameter_index]

    def model(free_values: np.ndarray) -> object:
        return identification_problem.model(np.insert(free_values, parameter_index, fixed_value))

    return replace(identification_problem, model=model, parameters=other_parameters)  # type: ignore[arg-type]
