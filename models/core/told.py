"""Texts that accompany results: the error of each result, and every broken assumption."""

import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

from models.core.assumptions import BrokenAssumption, assumption_sentences, broken_assumptions_of
from models.core.discretisation import (
    WARNED_SHARE,
    error_estimates_of,
    error_lines,
    largest_estimate,
    with_stated_errors,
)
from models.core.result import Result

LISTED_RESULTS = 4
"""Most results whose errors are printed one by one; of more, only the largest error is printed."""

Results = Mapping[str, Result]
"""Results of one command by what distinguishes them, such as the engine."""


def messages_on_results(results_by_name: Results) -> list[str]:
    """Printed lines on results: errors first, then broken assumptions, each listed once with the results that broke
    it."""
    return [
        *_error_lines(results_by_name),
        *(f"  {names}: {breach.line()}" for names, breach in worst_broken_assumptions(results_by_name)),
    ]


def _error_lines(results_by_name: Results) -> list[str]:
    """Printed lines on the errors of results: one by one for few results, else the largest error, the names of
    the results with a warning, and the lines of those without an estimate."""
    if len(results_by_name) <= LISTED_RESULTS:
        return [f"  {name}: {line}" for name, run in results_by_name.items() for line in error_lines(run)]
    results_without_estimate: dict[str, list[str]] = {}
    worst = {name: estimate for name, run in results_by_name.items() if (estimate := largest_estimate(run)) is not None}
    for name, run in results_by_name.items():
        for line in error_lines(run) if name not in worst else ():
            results_without_estimate.setdefault(line, []).append(name)
    listed = [f"  {_few_names_text(names)}: {line}" for line, names in results_without_estimate.items()]
    if not worst:
        return listed
    largest = max(worst, key=lambda name: worst[name].share)
    warned = [name for name, estimate in worst.items() if estimate.warned]
    further_lines = (
        [f"  errors above {100.0 * WARNED_SHARE:g} % in {len(warned)} of {len(worst)}: {_few_names_text(warned)}"]
        if warned[1:]
        else []
    )
    first = f"  {len(worst)} results, the largest error {largest}: {error_lines(results_by_name[largest])[0]}"
    return [first, *further_lines, *listed]


def _few_names_text(result_names: list[str]) -> str:
    """The first few names, and the number of the others, as text."""
    return ", ".join(result_names[:LISTED_RESULTS]) + (
        f" and {len(result_names) - LISTED_RESULTS} more" if len(result_names) > LISTED_RESULTS else ""
    )


def worst_broken_assumptions(results_by_name: Results) -> list[tuple[str, BrokenAssumption]]:
    """Broken assumptions with the names of the results that broke them: of each assumption the worst violation over all
    results."""
    names_by_breach: dict[str, list[str]] = {}
    worst: dict[str, BrokenAssumption] = {}
    for name, run in results_by_name.items():
        for breach in broken_assumptions_of(run):
            names_by_breach.setdefault(breach.name, []).append(name)
            if breach.name not in worst or breach.share > worst[breach.name].share:
                worst[breach.name] = breach
    return [(_few_names_text(names_by_breach[name]), breach) for name, breach in worst.items()]


def figure_remarks(results_by_name: Results) -> list[str]:
    """Short lines below a figure: warnings about errors, and broken assumptions."""
    steps = [
        f"{name}: {error_lines(run)[0]}"
        for name, run in results_by_name.items()
        if (worst := largest_estimate(run)) is not None and worst.warned
    ]
    return [*steps[:LISTED_RESULTS], *(breach.brief() for _, breach in worst_broken_assumptions(results_by_name))]


def joined_result(joined_data: Result, results_by_name: Results) -> Result:
    """A result joined from other results, with all their stated errors and all assumptions that any of them broke."""
    stored_errors = {name: json.loads(run.data.attrs["error"]) for name, run in results_by_name.items()}
    first = next(iter(stored_errors.values()))
    channels = {
        f"{name}, {channel}": values
        for name, stored_error in stored_errors.items()
        for channel, values in stored_error.get("channels", {}).items()
    }
    joined_data.data.attrs["error"] = json.dumps({**first, "channels": channels} if channels else first)
    assumed = dict.fromkeys(text for run in results_by_name.values() for text in assumption_sentences(run))
    worst_breach = [
        replace(breach, where=f"{names}, {breach.where}") for names, breach in worst_broken_assumptions(results_by_name)
    ]
    joined_data.data.attrs["assumptions"] = json.dumps(
        {"assumed": list(assumed), "broken": [asdict(breach) for breach in worst_breach]}
    )
    broke = (run.data.attrs["status"] for run in results_by_name.values() if broken_assumptions_of(run))
    joined_data.data.attrs["status"] = next(broke, joined_data.data.attrs["status"])
    return joined_data


def derived_result(derived_data: Result, results_by_name: Results, method_text: str) -> Result:
    """A result computed from other results, with the errors and broken assumptions of these; ``method_text`` is text on
    how the errors carry over.

    Without estimates in the results it has none.
    """
    assumed = [says for run in results_by_name.values() for says in assumption_sentences(run)]
    assumptions = {
        "assumed": list(dict.fromkeys(assumed)),
        "broken": [asdict(breach) for _, breach in worst_broken_assumptions(results_by_name)],
    }
    derived_data.data.attrs["assumptions"] = json.dumps(assumptions)
    if assumptions["broken"] and "assumptions broken" not in derived_data.data.attrs["status"]:
        derived_data.data.attrs["status"] += ", assumptions broken"
    pairs = [pair for run in results_by_name.values() for pair in error_estimates_of(run).items()]
    worst = dict(sorted(pairs, key=lambda pair: pair[1].share))
    return with_stated_errors(derived_data, worst, method_text) if worst else derived_data


def errors_and_assumptions(results_by_name: Results) -> dict[str, Any]:
    """Items "errors" and "assumptions" of a summary, from the statements of each result; NaN becomes None."""
    return {
        "errors": {name: _json_attribute(run, "error") for name, run in results_by_name.items()},
        "assumptions": {
            name: {"assumed": [], "broken": [], **_json_attribute(run, "assumptions")}
            for name, run in results_by_name.items()
        },
    }


def summary_with_errors(study_summary: dict[str, Any]) -> dict[str, Any]:
    """The summary of a study, with the errors and broken assumptions of its "results" added as text at the end."""
    results = study_summary.pop("results", {})
    return (
        study_summary
        | errors_and_assumptions(results)
        | {"table": [*study_summary.get("table", []), *messages_on_results(results)]}
    )


def _json_attribute(run_result: Result, attribute_name: str) -> dict[str, Any]:
    """Attribute ``attribute_name`` of a result, parsed from JSON, with None in place of NaN and infinity."""
    attribute: dict[str, Any] = json.loads(run_result.data.attrs[attribute_name], parse_constant=lambda text: None)
    return attribute


DOUBT_ATTRIBUTES = ("engine", "error", "assumptions")
"""Attributes of a result that state its engine, its error and its assumptions."""


def attributes_for_json(results_by_name: Results) -> dict[str, dict[str, str]]:
    """Attributes of results, without their channels, for JSON; ``results_with_attributes`` is the inverse."""
    return {name: {key: run.data.attrs[key] for key in DOUBT_ATTRIBUTES} for name, run in results_by_name.items()}


def results_with_attributes(attributes_by_result: Mapping[str, Mapping[str, str]]) -> dict[str, Result]:
    """Results without channels that have the given attributes; inverse of ``attributes_for_json``."""
    import xarray as xr

    return {
        name: Result(xr.Dataset(attrs=attributes_of_run)) for name, attributes_of_run in attributes_by_result.items()
    }
