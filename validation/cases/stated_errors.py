"""Errors that results state, for random scenes of every system in random engines, compared with true errors from 100
times finer solutions.

The true error is that of the printed channel: the channel whose stated error is the largest share.
"""

import math
import os
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import numpy as np

from models.core.discretisation import WARNED_SHARE
from models.core.systems import modules_of
from models.ensemble.workers import process_pool
from validation.common.grounds import allowing_breaches
from validation.common.rows import CaseAnswer, Drawn, Observed, Row, Saved, System, Table
from validation.stated_errors.sample import Sample

TITLE = "Stated errors against truths a hundred times finer"
SYSTEM: System = "cost"
SEED = 21
SAMPLING_MODULES = modules_of("validation.stated_errors.systems")
"""Modules that draw random samples, by system."""
LEAST_ERROR_SAMPLE_COUNT = 60
"""Least number of samples of all systems together; each system has the same number."""
QUICK_SAMPLE_COUNTS = {"pitch-plane": 3}
"""Number of samples by system in a quick run."""
RIGHT_RATIO, MISLEADING_RATIO, USELESS_RATIO = 3.0, 10.0, 0.1
"""Ratios of true to stated error: up to which the stated error is right, above which it misleads, and below which it is
useless."""
LEAST_RIGHT_SHARE, LARGEST_USELESS_SHARE, LARGEST_COST_RATIO = 0.95, 0.1, 0.6
"""Least share of stated errors that must be right, largest share that may be useless, and largest cost of an error
estimate divided by the cost of the run."""
ROUNDING_ERROR_SHARE = 1e-12
"""True errors below this share of their channel's deviation count as rounding."""


@allowing_breaches("what is judged is how well equations are solved, whatever a random vehicle does")
def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows on the stated errors of all systems that draw random samples; a quick run has a few samples of the pitch
    plane, and gives no verdict on shares."""
    names = list(SAMPLING_MODULES)
    counts = QUICK_SAMPLE_COUNTS if quick else dict.fromkeys(names, -(-LEAST_ERROR_SAMPLE_COUNT // len(names)))
    samples = [sample for of_system in _samples_by_system(counts) for sample in of_system]
    return [*_common_rows(samples, quick), *(row for name in counts for row in _system_rows(name, samples))], {
        "samples": samples
    }


def _samples_by_system(sample_counts: dict[str, int]) -> list[list[Saved]]:
    """Random samples of stated and true errors for each system, computed by at most two processes; by this process if
    there is only one system."""
    if len(sample_counts) == 1:
        return [error_samples_of_system(name, count) for name, count in sample_counts.items()]
    with process_pool(min(2, os.cpu_count() or 1)) as pool:
        return list(pool.map(error_samples_of_system, sample_counts, sample_counts.values()))


def error_samples_of_system(system_name: str, sample_count: int) -> list[Saved]:
    """Random samples of stated and true errors for one system, as tables for JSON."""
    drawn: Iterator[Sample] = import_module(SAMPLING_MODULES[system_name]).samples(sample_count, SEED)
    return [_error_sample_as_table(system_name, sample) for sample in drawn]


def _error_sample_as_table(system_name: str, error_sample: Sample) -> Saved:
    """A sample of stated and true error as a table for JSON; its ``ratio`` is the ratio of the true to the stated
    error, None where no number is stated."""
    sample_table = {
        "system": system_name,
        "name": error_sample.name,
        "engine": error_sample.engine,
        "cost": error_sample.extra_calls / error_sample.calls,
        "ratio": None,
    }
    if not error_sample.stated_errors:
        return sample_table
    stated, true = (
        error_sample.stated_errors[error_sample.printed_channel],
        error_sample.true_errors[error_sample.printed_channel],
    )
    return sample_table | {
        "channel": error_sample.printed_channel,
        "stated": stated.error,
        "true": true,
        "unit": stated.unit,
        "share": stated.share,
        "warned": stated.warned,
        "ratio": error_ratio(true, stated.error),
        "rounding": true <= ROUNDING_ERROR_SHARE * stated.error / stated.share if stated.share > 0.0 else true == 0.0,
    }


def error_ratio(true_error: float, stated_error: float) -> float:
    """Ratio of the true to the stated error; infinite if only the stated error is 0."""
    return true_error / stated_error if stated_error > 0.0 else (0.0 if true_error == 0.0 else math.inf)


def _common_rows(error_samples: list[Saved], quick: bool) -> list[Row]:
    """Rows on the stated errors of all systems together. A quick run has few samples, so its shares are reported
    without a verdict."""
    known = [sample for sample in error_samples if sample["ratio"] is not None]
    right = _share_of_true_entries(sample["ratio"] <= RIGHT_RATIO or sample["rounding"] for sample in known)
    useless = _share_of_true_entries(sample["ratio"] < USELESS_RATIO and not sample["rounding"] for sample in known)
    silent = [
        sample
        for sample in known
        if sample["ratio"] > MISLEADING_RATIO and not (sample["warned"] or sample["rounding"])
    ]
    costs = [
        _median_estimate_cost(name, error_samples)
        for name in dict.fromkeys(sample["system"] for sample in error_samples)
    ]
    near = f"share of {len(known)} samples whose true error is at most {RIGHT_RATIO:g} times the stated error"
    below = f"share of {len(known)} samples whose true error is below a tenth of the stated error"
    asked, tenth = (
        f"asked: {100 * LEAST_RIGHT_SHARE:g} of 100",
        "asked: at most a tenth; below rounding no error tells anything",
    )
    shares = (
        [
            Observed("stated_errors.near", SYSTEM, near, right, "").beside(1.0, asked, "none"),
            Observed("stated_errors.useless", SYSTEM, below, useless, "").beside(0.0, tenth, "none"),
        ]
        if quick
        else [
            Observed("stated_errors.near", SYSTEM, near, right, "").within(1.0, 1.0 - LEAST_RIGHT_SHARE, asked, "none"),
            Observed("stated_errors.useless", SYSTEM, below, useless, "").at_most(LARGEST_USELESS_SHARE, tenth, "none"),
        ]
    )
    return [
        *shares,
        Observed(
            "stated_errors.silent",
            SYSTEM,
            f"samples whose true error is above {MISLEADING_RATIO:g} times the stated error, without a warning",
            float(len(silent)),
            "",
        ).at_most(
            0.0, f"asked: none; a warning stands above {100 * WARNED_SHARE:g} % of the channel's deviation", "none"
        ),
        Observed(
            "stated_errors.cost",
            SYSTEM,
            "ratio of the force evaluations of the error estimate to those of the run, median of systems",
            float(np.median(costs)),
            "",
        ).at_most(LARGEST_COST_RATIO, "asked: about half the run again", "none"),
        Observed(
            "stated_errors.without",
            SYSTEM,
            f"results, of {len(error_samples)} samples, that say why there is no number",
            float(len(error_samples) - len(known)),
            "",
        ).beside("few", "what does not repeat has no error of steps", "none"),
    ]


def _share_of_true_entries(true_or_false: Iterator[bool]) -> float:
    """Share of true entries; 1 if there are no entries."""
    counted = list(true_or_false)
    return float(np.mean(counted)) if counted else 1.0


def _median_estimate_cost(system_name: str, error_samples: list[Saved]) -> float:
    """Median cost of a system's error estimates; estimates without a number count only if no estimate has a number."""
    of_system = [sample for sample in error_samples if sample["system"] == system_name]
    return float(
        np.median(
            [sample["cost"] for sample in of_system if sample["ratio"] is not None]
            or [sample["cost"] for sample in of_system]
        )
    )


def _system_rows(system_name: str, error_samples: list[Saved]) -> list[Row]:
    """Rows on the stated errors of one system, reported without a verdict."""
    of_system = [sample for sample in error_samples if sample["system"] == system_name]
    known = [sample for sample in of_system if sample["ratio"] is not None]
    sample_text = f"{system_name}, {len(known)} of {len(of_system)} samples"
    near = _share_of_true_entries(sample["ratio"] <= RIGHT_RATIO or sample["rounding"] for sample in known)
    middle = float(np.median([sample["ratio"] for sample in known])) if known else math.nan
    why = "all systems are judged together"
    shown = (
        ("near", f"share within {RIGHT_RATIO:g} times the stated error", near, 1.0),
        ("ratio", "median ratio of true to stated error", middle, 1.0),
        (
            "cost",
            "median ratio of the cost of the estimate to that of the run",
            _median_estimate_cost(system_name, error_samples),
            LARGEST_COST_RATIO,
        ),
    )
    return [
        Observed(f"stated_errors.{system_name}.{id}", SYSTEM, f"{sample_text}: {what}", value, "").beside(
            expected, why, "none"
        )
        for id, what, value, expected in shown
    ]


def tables(case_data: Saved) -> list[Table]:
    """Table of all samples, sorted by the ratio of the true to the stated error, largest first."""
    known = sorted(
        (sample for sample in case_data["samples"] if sample["ratio"] is not None), key=lambda sample: -sample["ratio"]
    )
    rows = tuple(
        (
            sample["system"],
            sample["name"],
            sample["engine"],
            sample["channel"],
            f"{sample['stated']:.2g} {sample['unit']}".rstrip(),
            f"{100.0 * sample['share']:.2g}{' (warned)' if sample['warned'] else ''}",
            f"{sample['true']:.2g}",
            f"{sample['ratio']:.2g}",
            f"{sample['cost']:.2f}",
        )
        for sample in known
    )
    heads = ("System", "Scene", "Engine", "Channel", "Stated", "in %", "True", "True / stated", "Cost")
    note = "Shares are of the channel's standard deviation over the run; the cost is estimate / run."
    return [Table("Stated and true errors", note, heads, rows)]


def draw(case_data: Saved) -> Drawn:
    """Plot true error over stated error, both divided by the channel's standard deviation."""
    from models.drawing.figures import CURVE_COLOURS, GREY, ORANGE, REJECTED_COLOUR, add_heading, subplots

    figure, axis = subplots(figsize=(6.5, 5.0))
    known = [sample for sample in case_data["samples"] if sample["ratio"] is not None and sample["share"] > 0.0]
    for name, colour in zip(
        dict.fromkeys(sample["system"] for sample in known), (*CURVE_COLOURS, REJECTED_COLOUR), strict=False
    ):
        stated = np.array([sample["share"] for sample in known if sample["system"] == name])
        ratios = np.array([sample["ratio"] for sample in known if sample["system"] == name])
        axis.plot(stated, np.maximum(stated * ratios, 1e-17), "o", color=colour, ms=5, label=name)
    ends = np.array([1e-16, 1.0])
    for factor, style in ((1.0, "-"), (RIGHT_RATIO, "--"), (MISLEADING_RATIO, ":"), (USELESS_RATIO, ":")):
        axis.plot(ends, factor * ends, style, color=GREY, lw=0.9)
    axis.axvspan(WARNED_SHARE, 10.0, color=ORANGE, alpha=0.15, lw=0)
    axis.set(
        xscale="log",
        yscale="log",
        xlabel="stated error / deviation of the channel [-]",
        ylabel="true error / deviation of the channel [-]",
    )
    axis.set_title("dashed: 3 times the stated error; dotted: 10 times and a tenth; shaded: warned")
    add_heading(figure, "Errors of random scenes, true and as their results state them")
    axis.legend(loc="upper left")
    return [("True errors of random scenes over what their results state.", figure)]
