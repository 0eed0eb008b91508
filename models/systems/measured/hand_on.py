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


def write_section_forces(
    run_outcome: SectionOutcome,
    output_folder: Path,
    file_formats: Iterable[str],
    section_channels: Sequence[SectionChannel] | None = None,
    start_date: datetime | None = None,
    file_comment: str = "",
) -> list[Path]:
    """Write section forces and moments of a run, or only the channels ``section_channels``, to a file
    ``section_forces.EXT`` for every format.

    The files also have names, units and comments (axes and signs). Returns the paths; raises InputError where a file
    exists or a format has no room for a name.
    """
    section_channels = section_force_channels(run_outcome.answers) if section_channels is None else section_channels
    names, units, comments = (tuple(getattr(a, key) for a in section_channels) for key in ("name", "unit", "comment"))

    def blocks() -> Iterator[np.ndarray]:
        for first in range(0, run_outcome.done, SAMPLES_PER_BLOCK):
            yield run_outcome.columns.block(names, first, min(SAMPLES_PER_BLOCK, run_outcome.done - first))

    return [
        write(
            output_folder / f"{FILE_STEM}.{form}",
            [ChannelGroup(names, units, comments, run_outcome.period, run_outcome.done, blocks())],
            start_date,
            file_comment,
        )
        for form in file_formats
    ]


def section_force_channels(output_channels: Iterable[SectionChannel]) -> tuple[SectionChannel, ...]:
    """Returns those channels that are section forces and moments."""
    return tuple(answer for answer in output_channels if answer.section and answer.unit in ("N", "N m"))


def labelled_result(
    scene: Any,
    run_outcome: SectionOutcome | None,
    counted_loads: Mapping[SectionChannel, CountedLoad],
    output_folder: Path,
    **further_fields: Any,
) -> Result:
    """Returns the result of a run whose samples lie in ``output_folder``. Without an outcome it has attributes only.

    It has all channels over time, where they are no longer than a block, and statistics and pseudo-damage of the
    counted section forces; ``further_fields`` : further arguments of ``models.core.result.result``.
    """
    channels, axes = dict[str, Channel](), dict[str, Channel]()
    if run_outcome is not None:
        further_fields["columns"] = str(run_outcome.columns.path.relative_to(output_folder))
        further_fields["columns_of"] = json.dumps([answer.name for answer in run_outcome.answers])
        if run_outcome.done <= SAMPLES_PER_BLOCK:
            axes["time"] = Channel("time", run_outcome.period * np.arange(run_outcome.done), "s", "time")
            for answer in run_outcome.answers:
                name = answer.name.replace("/", "|")  # which would be a group of the file
                channels[name] = Channel("time", run_outcome.samples(answer), answer.unit, answer.comment)
    if run_outcome is not None and counted_loads:
        unit, damage = "that of the section force", [list(counts.damage.values()) for counts in counted_loads.values()]
        slopes = list(next(iter(counted_loads.values())).damage)
        axes["section_force"] = Channel("section_force", [answer.name for answer in counted_loads])
        axes["slope"] = Channel("slope", slopes, "1", "Woehler exponent")
        figures = {
            name: [getattr(counts, attribute) for counts in counted_loads.values()]
            for name, attribute in COUNTED_FIGURES.items()
        }
        figures["rms"] = [root_mean_square(run_outcome.samples(answer)) for answer in counted_loads]
        channels |= {name: Channel("section_force", values, "", unit) for name, values in figures.items()}
        channels["unit"] = Channel("section_force", [answer.unit for answer in counted_loads])
        meaning = f"pseudo-damage: {unit}, to the slope"
        channels["damage"] = Channel(("section_force", "slope"), np.array(damage), "", meaning)
    return result(scene, channels, axes, counts=run_outcome.counts if run_outcome else {}, **further_fields)
