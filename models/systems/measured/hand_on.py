"""Output of a recording's run: files of section forces for the durability engineer, and the result."""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from models.core.result import Channel, Result, result
from models.drift.score import root_mean_square
from models.fatigue.counting import CountedLoad
from models.measured.channel import SAMPLES_PER_BLOCK
from models.measured.formats import write
from models.measured.formats.writing import ChannelGroup
from models.systems.measured.section_run import SectionOutcome
from models.systems.measured.sections import SectionChannel

FILE_STEM = "section_forces"
"""Name of the files of section forces, before their extensions."""
COUNTED_FIGURES = {"least": "smallest_load", "greatest": "largest_load", "mean": "mean"}
"""Channels of the result over the section forces, with the attribute of ``CountedLoad`` for each."""


def hand_on(
    outcome: SectionOutcome,
    folder: Path,
    formats: Iterable[str],
    answers: Sequence[SectionChannel] | None = None,
    start: datetime | None = None,
    comment: str = "",
) -> list[Path]:
    """Write section forces and moments of a run, or only the channels ``answers``, to a file ``section_forces.EXT`` for
    every format.

    The files also have names, units and comments (axes and signs). Returns the paths; raises InputError where a file
    exists or a format has no room for a name.
    """
    answers = forces(outcome.answers) if answers is None else answers
    names, units, comments = (tuple(getattr(a, key) for a in answers) for key in ("name", "unit", "comment"))

    def blocks() -> Iterator[np.ndarray]:
        for first in range(0, outcome.done, SAMPLES_PER_BLOCK):
            yield outcome.columns.block(names, first, min(SAMPLES_PER_BLOCK, outcome.done - first))

    return [
        write(
            folder / f"{FILE_STEM}.{form}",
            [ChannelGroup(names, units, comments, outcome.period, outcome.done, blocks())],
            start,
            comment,
        )
        for form in formats
    ]


def forces(answers: Iterable[SectionChannel]) -> tuple[SectionChannel, ...]:
    """Returns those channels that are section forces and moments."""
    return tuple(answer for answer in answers if answer.section and answer.unit in ("N", "N m"))


def labelled_result(
    scene: Any, outcome: SectionOutcome | None, counted: Mapping[SectionChannel, CountedLoad], folder: Path, **more: Any
) -> Result:
    """Returns the result of a run whose samples lie in ``folder``. Without an outcome it has attributes only.

    It has all channels over time, where they are no longer than a block, and statistics and pseudo-damage of the
    counted section forces; ``more`` : further arguments of ``models.core.result.result``.
    """
    channels, axes = dict[str, Channel](), dict[str, Channel]()
    if outcome is not None:
        more["columns"] = str(outcome.columns.path.relative_to(folder))
        more["columns_of"] = json.dumps([answer.name for answer in outcome.answers])
        if outcome.done <= SAMPLES_PER_BLOCK:
            axes["time"] = Channel("time", outcome.period * np.arange(outcome.done), "s", "time")
            for answer in outcome.answers:
                name = answer.name.replace("/", "|")  # which would be a group of the file
                channels[name] = Channel("time", outcome.samples(answer), answer.unit, answer.comment)
    if outcome is not None and counted:
        unit, damage = "that of the section force", [list(counts.damage.values()) for counts in counted.values()]
        slopes = list(next(iter(counted.values())).damage)
        axes["section_force"] = Channel("section_force", [answer.name for answer in counted])
        axes["slope"] = Channel("slope", slopes, "1", "Woehler exponent")
        figures = {
            name: [getattr(counts, attribute) for counts in counted.values()]
            for name, attribute in COUNTED_FIGURES.items()
        }
        figures["rms"] = [root_mean_square(outcome.samples(answer)) for answer in counted]
        channels |= {name: Channel("section_force", values, "", unit) for name, values in figures.items()}
        channels["unit"] = Channel("section_force", [answer.unit for answer in counted])
        meaning = f"pseudo-damage: {unit}, to the slope"
        channels["damage"] = Channel(("section_force", "slope"), np.array(damage), "", meaning)
    return result(scene, channels, axes, counts=outcome.counts if outcome else {}, **more)
