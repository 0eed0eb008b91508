"""Errors that results state, of random scenes of every system in random engines, against truths 100 times finer.

The true error is that of the channel which the screen names: the one whose stated error is the largest share.
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
SYSTEMS = modules_of("validation.stated_errors.systems")
"""Modules that draw samples, by system."""
SAMPLES_OF_ALL = 60
"""Samples of all systems together, at least; as many of each."""
QUICK_SAMPLES = {"pitch-plane": 3}
"""Those of the quick share."""
NEAR, FAR, TENTH = 3.0, 10.0, 0.1
"""Ratios of true to stated error: up to which it is right, from which it misleads, and below which it is useless."""
LEAST_RIGHT_SHARE, LARGEST_USELESS_SHARE, LARGEST_COST = 0.95, 0.1, 0.6
"""Least share that is right, largest one that is useless, and largest cost of an estimate, by the run's."""
ROUNDING_SHARE = 1e-12
"""True errors below this share of their channel are rounding."""


@allowing_breaches("what is judged is how well equations are solved, whatever a random vehicle does")
def measure(quick: bool, folder: Path) -> CaseAnswer:
    """All systems that have samples; the quick share has a few of the pitch plane, and judges no shares."""
    names = list(SYSTEMS)
    counts = QUICK_SAMPLES if quick else dict.fromkeys(names, -(-SAMPLES_OF_ALL // len(names)))
    samples = [sample for of_system in _make_samples(counts) for sample in of_system]
    return [*_rows(samples, quick), *(row for name in counts for row in _of_system(name, samples))], {
        "samples": samples
    }


def _make_samples(sample_counts: dict[str, int]) -> list[list[Saved]]:
    """Samples of each system, computed by at most two processes; by this process if there is only one system."""
    if len(sample_counts) == 1:
        return [samples(name, count) for name, count in sample_counts.items()]
    with process_pool(min(2, os.cpu_count() or 1)) as pool:
        return list(pool.map(samples, sample_counts, sample_counts.values()))


def samples(name: str, sample_count: int) -> list[Saved]:
    """Samples of a system in the form for JSON."""
    drawn: Iterator[Sample] = import_module(SYSTEMS[name]).samples(sample_count, SEED)
    return [_sample_as_table(name, sample) for sample in drawn]


def _sample_as_table(system: str, sample: Sample) -> Saved:
    """A sample in the form for JSON; ``ratio``: ratio of the true to the stated error, None where no number is
    stated."""
    sample_table = {
        "system": system,
        "name": sample.name,
        "engine": sample.engine,
        "cost": sample.extra_calls / sample.calls,
        "ratio": None,
    }
    if not sample.stated_errors:
        return sample_table
    stated, true = sample.stated_errors[sample.printed_channel], sample.true_errors[sample.printed_channel]
    return sample_table | {
        "channel": sample.printed_channel,
        "stated": stated.error,
        "true": true,
        "unit": stated.unit,
        "share": stated.share,
        "warned": stated.warned,
        "ratio": ratio(true, stated.error),
        "rounding": true <= ROUNDING_SHARE * stated.error / stated.share if stated.share > 0.0 else true == 0.0,
    }


def ratio(true_error: float, stated: float) -> float:
    """Ratio of the true to the stated error."""
    return true_error / stated if stated > 0.0 else (0.0 if true_error == 0.0 else math.inf)


def _rows(samples: list[Saved], quick: bool) -> list[Row]:
    """Rows on the stated errors of all systems together. A quick run has few samples, so its shares are reported
    without a verdict."""
    known = [sample for sample in samples if sample["ratio"] is not None]
    right = _share_of_true(sample["ratio"] <= NEAR or sample["rounding"] for sample in known)
    useless = _share_of_true(sample["ratio"] < TENTH and not sample["rounding"] for sample in known)
    silent = [sample for sample in known if sample["ratio"] > FAR and not (sample["warned"] or sample["rounding"])]
    costs = [_cost(name, samples) for name in dict.fromkeys(sample["system"] for sample in samples)]
    near = f"share of {len(known)} samples whose true error is at most {NEAR:g} times the stated error"
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
            f"samples whose true error is above {FAR:g} times the stated error, without a warning",
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
        ).at_most(LARGEST_COST, "asked: about half the run again", "none"),
        Observed(
            "stated_errors.without",
            SYSTEM,
            f"results, of {len(samples)} samples, that say why there is no number",
            float(len(samples) - len(known)),
            "",
        ).beside("few", "what does not repeat has no error of steps", "none"),
    ]


def _share_of_true(hits: Iterator[bool]) -> float:
    """Share of true entries; 1 if there are no entries."""
    counted = list(hits)
    return float(np.mean(counted)) if counted else 1.0


def _cost(name: str, samples: list[Saved]) -> float:
    """Median cost of a system's error estimates; estimates without a number count only if all are of this kind."""
    of_system = [sample for sample in samples if sample["system"] == name]
    return float(
        np.median(
            [sample["cost"] for sample in of_system if sample["ratio"] is not None]
            or [sample["cost"] for sample in of_system]
        )
    )


def _of_system(name: str, samples: list[Saved]) -> list[Row]:
    """Rows on the stated errors of one system, reported."""
    of_system = [sample for sample in samples if sample["system"] == name]
    known = [sample for sample in of_system if sample["ratio"] is not None]
    sample_text = f"{name}, {len(known)} of {len(of_system)} samples"
    near = _share_of_true(sample["ratio"] <= NEAR or sample["rounding"] for sample in known)
    middle = float(np.median([sample["ratio"] for sample in known])) if known else math.nan
    why = "all systems are judged together"
    shown = (
        ("near", f"share within {NEAR:g} times the stated error", near, 1.0),
        ("ratio", "median ratio of true to stated error", middle, 1.0),
        ("cost", "median ratio of the cost of the estimate to that of the run", _cost(name, samples), LARGEST_COST),
    )
    return [
        Observed(f"stated_errors.{name}.{id}", SYSTEM, f"{sample_text}: {what}", value, "").beside(
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
    for factor, style in ((1.0, "-"), (NEAR, "--"), (FAR, ":"), (TENTH, ":")):
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
