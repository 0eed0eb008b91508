"""``twinrig identify``: keys of a scene from a measurement, with their errors and what the data do not determine."""

import json
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from models.core.whole_files import write_whole
from models.ensemble.runner import in_order
from models.ensemble.store import Store, named_files
from models.ensemble.workers import Crew, places_of
from models.identification.fit import Fit, fit
from models.identification.of_scene import problem_of
from models.identification.problem import Problem
from models.identification.uncertainty import Profile, Uncertainty, profile, uncertainty

STAGES = "stages"
"""Folder of finished stages, from which ``--resume`` goes on."""
NAMED_SHARE = 0.3
"""Share of a combination from which on a parameter is named in it."""
Tell = Callable[[str, float], None]


def identify(
    scene: Any,
    measurement: str | Path,
    parameters: Sequence[str],
    *,
    engine: str = "",
    low_pass: float = 0.0,
    folder: Path | None = None,
    tell: Tell = lambda text, share: None,
) -> Uncertainty:
    """Estimates of keys of any scene whose run has channels over time, with their uncertainty.

    scene : as ``load_scene`` gives it; measurement : its channels have the names of the run's; parameters : KEY or
    KEY=LOW:HIGH; engine : "" for the usual one; low_pass : Hz, on both, 0 for none; folder : keeps finished stages.
    The scene's crew computes the columns of Jacobians. Raises InputError and RunFailed.
    """
    problem = problem_of(scene, measurement, parameters, engine, low_pass)
    with Crew.of(scene, usual=1).at_work(1 + len(problem.parameters), *places_of(scene)) as pool:
        if folder is None:
            return uncertainty(fit(problem, None, tell, executor=pool), pool)
        store = Store(folder / STAGES)
        with store.claimed(_facts(scene, measurement, problem, engine, low_pass)):
            return uncertainty(fit(problem, store, tell, executor=pool), pool)


def profiles_of(
    scene: Any, known: Uncertainty, every: bool = False, tell: Tell = lambda text, share: None
) -> Iterator[Profile]:
    """Profiles of every parameter, or of those that the data do not determine, computed by the scene's crew."""
    wanted = [k for k in range(len(known.fit.problem.parameters)) if every or not known.determined[k]]
    with Crew.of(scene, usual=1).at_work(len(wanted), *places_of(scene)) as pool:
        for done, (k, made) in enumerate(in_order(partial(profile, known), iter(wanted), pool), start=1):
            tell(f"profile of {known.fit.problem.parameters[k].name}", 0.9 + 0.1 * done / len(wanted))
            yield made


def _facts(scene: Any, measurement: str | Path, problem: Problem, engine: str, low_pass: float) -> dict[str, Any]:
    """Everything that stages depend on."""
    table = scene.table()
    return {
        "scene": table,
        "files": named_files([table, str(measurement)], Path(scene.folder)),
        "measurement": str(measurement),
        "parameters": [[each.name, each.start, each.low, each.high] for each in problem.parameters],
        "engine": engine,
        "low pass": low_pass,
    }


def report(
    scene: Any, measurement: Path, parameters: Sequence[str], folder: Path, tell: Tell, every: bool, **more: Any
) -> dict[str, Any]:
    """Identify, save ``identify.json`` and ``identify.png``, and say it in lines; every : profiles of all of them."""
    known = identify(scene, measurement, parameters, folder=folder, tell=tell, **more)
    drawn = list(profiles_of(scene, known, every, tell))
    answer = as_dict(known, drawn)
    write_whole(folder / "identify.json", json.dumps(answer, indent=1) + "\n")
    draw_fit(known, f"{measurement.name} by {scene.title}", folder / "identify.png")
    return {
        "scene": f"{scene.title}, identified from {measurement}",
        "folder": str(folder),
        "failed": {},
        "identified": answer,
        "table": lines(known, drawn),
        "results": {},
    }


def as_dict(known: Uncertainty, profiles: Sequence[Profile] = ()) -> dict[str, Any]:
    """All of it in plain values; None stands for a standard error that is none."""
    solved, names = known.fit, [each.name for each in known.fit.problem.parameters]
    return {
        "estimates": {
            name: {
                "value": float(value),
                "standard error": _finite_number(error),
                "determined": bool(sure),
                "at a bound": bool(at),
            }
            for name, value, error, sure, at in zip(
                names, solved.values, known.deviations, known.determined, solved.at_bound, strict=True
            )
        },
        "correlation": {"of": names, "rows": correlation(known).tolist()},
        "combinations": [
            {"standard error": error, "direction": dict(zip(names, vector.tolist(), strict=True))}
            for error, vector in known.combinations()
        ],
        "condition": _finite_number(known.condition),
        "residuals stay alike for [s]": known.staying,
        "errors of channels": errors(solved),
        "samples left out": {channel.name: channel.left_out for channel in solved.problem.channels},
        "converged": solved.converged,
        "profiles": {
            each.name: {"values": each.values.tolist(), "rise": each.rise.tolist(), "quadratic": each.quadratic}
            for each in profiles
        },
    }


def correlation(known: Uncertainty) -> np.ndarray:
    """(p, p): of the estimates, 0 with those at a bound."""
    size = np.sqrt(np.clip(np.diag(known.covariance), 0.0, None))
    outer = np.outer(size, size)
    return np.divide(known.covariance, outer, out=np.zeros_like(outer), where=outer > 0.0)


def _finite_number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def errors(solved: Fit) -> dict[str, float]:
    """Rms error of each channel by its rms."""
    weights = solved.problem.weights > 0.0
    return {
        channel.name: float(np.sqrt(np.mean(row[used] ** 2)))
        for channel, row, used in zip(solved.problem.channels, solved.residuals, weights, strict=True)
    }


def lines(known: Uncertainty, profiles: Sequence[Profile] = ()) -> list[str]:
    """Lines for the screen."""
    solved = known.fit
    table = [f"  {'parameter':<32}{'estimate':>13}{'standard error':>16}"]
    for k, each in enumerate(solved.problem.parameters):
        error = "at its bound" if solved.at_bound[k] else f"{known.deviations[k]:.3g}"
        doubt = "" if known.determined[k] else "  not determined by the data"
        table.append(f"  {each.name:<32}{solved.values[k]:>13.6g}{error:>16}{doubt}")
    table += [f"  error of {name:<23}{100.0 * value:>12.3g} % of its rms" for name, value in errors(solved).items()]
    table += _combined(known)
    table.append(
        f"  residuals stay alike for {known.staying:.3g} s; standard errors count them so, not as independent samples"
    )
    left = {channel.name: channel.left_out for channel in solved.problem.channels}
    table.append("  left out as spikes or not measured: " + ", ".join(f"{n} of {name}" for name, n in left.items()))
    if not solved.converged:
        table.append("  the search has not settled: resume it, or start nearer")
    for curve in profiles:
        shape = "as the standard error says" if curve.quadratic else "not as the standard error says"
        at = ", ".join(f"{r:.3g} at {v:.4g}" for v, r in zip(curve.values, curve.rise, strict=True))
        table.append(f"  profile of {curve.name}: {at} (95 % below 3.84), {shape}")
    return table


def _combined(known: Uncertainty) -> list[str]:
    combinations = known.combinations()
    if not combinations:
        return []
    names = [each.name for each in known.fit.problem.parameters]

    def told(vector: np.ndarray) -> str:
        order = np.argsort(-np.abs(vector))
        return " ".join(f"{vector[k]:+.2f} {names[k]}" for k in order if abs(vector[k]) >= NAMED_SHARE)

    (best, first), (worst, last) = combinations[0], combinations[-1]
    return [
        f"  best determined, within {100.0 * best:.2g} %: {told(first)}",
        f"  worst determined, within {100.0 * worst:.2g} %: {told(last)}",
        f"  condition of the information: {known.condition:.3g}",
    ]


def draw_fit(known: Uncertainty, title: str, path: Path) -> None:
    """Every channel with the model at the estimates, the error below it."""
    from models.drawing.figures import BLUE, DARK, VERMILION, heading, save, subplots

    problem = known.fit.problem
    predicted, times = problem.predicted(known.fit.values), problem.clock.times
    count = len(problem.channels)
    figure, axes = subplots(2 * count, 1, figsize=(8.0, 2.6 * count + 0.8), sharex=True, squeeze=False)
    for (top, below), channel, row in zip(axes[:, 0].reshape(count, 2), problem.channels, predicted, strict=True):
        measured = np.where(channel.used, channel.values, np.nan)
        top.plot(times, measured, color=DARK, linewidth=1.2, label="measured")
        top.plot(times, row, color=VERMILION, linewidth=0.8, label="model")
        top.set(title=channel.name, ylabel=f"[{channel.unit or '-'}]")
        below.plot(times, row - measured, color=BLUE, linewidth=0.8)
        below.set(ylabel="model less\nmeasured")
    axes[-1, 0].set_xlabel("time [s]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    heading(figure, title, {})
    save(figure, path)
