"""Whether the price of accuracy keeps what it promises: settings recommended for scenes that it has never seen."""

import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from models.ensemble.workers import one_thread_each
from validation.price.own_scene import unseen_systems
from validation.price.own_scene.unseen import Verdict, drawn, judge
from validation.rows import Row, System, Table, at_most, finding, within

TITLE = "What to recommend"
SYSTEM: System = "cost"
SCENES = {True: (8,), False: tuple(range(88))}
"""Numbers of the scenes that are drawn of the pitch-plane vehicle, by ``quick``."""
OTHERS = {"braking": 6, "wheelset": 4, "handling": 2}
"""How many scenes of other systems a full run draws."""
ENGINE = "mujoco"
"""The one that a quick run asks about; a full one asks about all."""
MET, FACTOR = 0.95, 3.0
"""Least share of scenes whose every recommended setting holds its tolerance; bound of predicted by true error."""


def measure(quick: bool, folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Verdicts on all recommendations for all scenes."""
    alone = (judge(drawn(n, folder), (ENGINE,)) for n in SCENES[quick])
    found = list(alone) if quick else _shared(folder, SCENES[quick])
    return _rows(found), {"verdicts": [[asdict(one) for one in own] for own in found]}


def _shared(folder: Path, numbers: tuple[int, ...]) -> list[list[Verdict]]:
    """The same by as many processes as there are processors, two at most."""
    context = get_context("spawn")  # an engine's threads do not survive a fork
    with one_thread_each(), ProcessPoolExecutor(min(2, os.cpu_count() or 1), mp_context=context) as pool:
        others = [pool.submit(_others, system, n) for system, count in OTHERS.items() for n in range(count)]
        own = list(pool.map(partial(_verdicts, folder), numbers, chunksize=5))
        return own + [one.result() for one in others]


def _verdicts(folder: Path, number: int) -> list[Verdict]:
    return judge(drawn(number, folder))


def _others(system: str, number: int) -> list[Verdict]:
    return unseen_systems.judge(unseen_systems.drawn(system, number))


def _rows(found: list[list[Verdict]]) -> list[Row]:
    """The three promises; a scene counts as held if every setting recommended for it does."""
    every = [one for own in found for one in own]
    held = sum(bool(own) and all(one.meets for one in own) for own in found)
    factors = [one.factor for one in every]
    scenes, why = f"{len(found)} scenes drawn at random", "judged by another solver than the search's, DOP853"
    return [
        within("recommendation.met", SYSTEM, f"share of {scenes} in which every recommended setting holds its "
               f"tolerance ({len(every)} settings)", held / len(found), "", 1.0, 1.0 - MET, why, "closed form"),
        at_most("recommendation.predicted", SYSTEM, "predicted by true error, or its inverse: largest of all",
                max(factors, default=float("inf")), "times", FACTOR,
                f"{why}; errors below what is known of the truth count as that", "closed form"),
        finding("recommendation.factor", SYSTEM, "the same, 95 of 100", float(np.quantile(factors, 0.95)), "times",
                "1", why, "closed form"),
        at_most("recommendation.slower", SYSTEM, "recommended settings that cost more than the engine's default that "
                "meets the tolerance", sum(one.slower for one in every), "settings", 0.0, "force calls exactly; "
                "seconds in two paired measurements", "none"),
    ]  # fmt: skip


def tables(data: dict[str, Any]) -> list[Table]:
    """Every scene with what was recommended over all engines."""
    rows = []
    for own in data["verdicts"]:
        one = own[0]
        rows.append((one["title"], f"{one['tolerance']:.2g}", f"{one['curve']}, {one['label']}",
                     f"{one['predicted']:.3g}", f"{one['true']:.3g}",
                     str(sum(v["true"] <= v["tolerance"] for v in own)) + f" of {len(own)}"))  # fmt: skip
    note = ("The setting that is recommended by seconds over all engines; the last column counts those of each engine "
            "and of force calls too.")  # fmt: skip
    heads = ("scene", "tolerance", "recommended", "predicted error", "true error", "held")
    return [Table("Recommendations for scenes drawn at random", note, heads, tuple(rows))]


def draw(data: dict[str, Any]) -> list[tuple[str, Any]]:
    """Predicted over true error by tolerance."""
    from studies.figures import COLOURS, plt

    figure, ax = plt.subplots(figsize=(7.5, 5.2))
    every = [one for own in data["verdicts"] for one in own]
    for engine in dict.fromkeys(one["curve"].split()[0] for one in every):
        own = [one for one in every if one["curve"].startswith(engine)]
        ax.plot([one["true"] / one["tolerance"] for one in own], [one["predicted"] / one["tolerance"] for one in own],
                "o", color=COLOURS.get(engine, "grey"), markersize=4, alpha=0.6, label=engine)  # fmt: skip
    span = np.array([1e-6, 10.0])
    ax.plot(span, span, color="#333333", linewidth=0.8)
    ax.fill_between(span, span / FACTOR, span * FACTOR, color="#bbbbbb", alpha=0.4, linewidth=0,
                    label=f"within a factor {FACTOR:g}")  # fmt: skip
    ax.axvline(1.0, color="#aa0000", linewidth=1.0, label="tolerance")
    ax.set(xscale="log", yscale="log", xlabel="true error by tolerance", ylabel="predicted error by tolerance",
           xlim=span, ylim=span, title=f"Recommended for {len(data['verdicts'])} scenes never seen")  # fmt: skip
    ax.legend(loc="upper left", fontsize=9)
    return [("Errors of recommended settings: predicted by the search, and true by another solver.", figure)]
