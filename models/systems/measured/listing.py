"""What is in a measurement file: its channels, and a scene to begin with."""

from pathlib import Path

import numpy as np

from models.core.finding import gathered
from models.measured.channel import BLOCK, Source
from models.measured.formats import open_source
from models.systems.measured.guess import scene_text

LOOKED_AT = 20
"""Blocks of a group whose values are read for the range: all of a file of twenty minutes at 1 kHz."""


def describe(path: Path) -> str:
    """Channels with unit, rate, samples, times and range; what the reader noticed; a scene with a guessed map.

    All but the scene is in comments: the whole is a scene file.

    Raises InputError for what is no measurement file.
    """
    source = open_source(path)
    began = f", began {source.start.isoformat(sep=' ')}" if source.start else ", which does not say when it began"
    lines = [f"{path.name}: {len(source.channels)} channels{began}"]
    lines += [f"  {line}" for line in source.comment.splitlines()[:10]]
    width = max([len(channel.name) for channel in source.channels], default=0)
    lines += [
        f"  {'channel':<{width}} {'unit':<9}{'rate':>10} {'samples':>10} {'from':>9} {'to':>9} {'least':>11} "
        f"{'most':>11}",
        f"  {'':<{width}} {'':<9}{'[Hz]':>10} {'':>10} {'[s]':>9} {'[s]':>9}",
    ]
    ranges = {name: text for group in _groups(source) for name, text in _ranges(source, group).items()}
    lines += [f"  {c.name:<{width}} {c.unit:<9}{ranges[c.name]}" for c in source.channels]
    lines += [f"  {finding.weight}: {finding.text}" for finding in gathered(source.noticed)]
    lines += ["", "A scene to begin with, its map guessed from names and units; check every line."]
    return "\n".join([*(f"# {line}".rstrip() for line in lines), "", scene_text(source)])


def _groups(source: Source) -> list[list[str]]:
    """Names of the channels of each group."""
    groups = dict.fromkeys(channel.group for channel in source.channels)
    return [[c.name for c in source.channels if c.group == group] for group in groups]


def _ranges(source: Source, names: list[str]) -> dict[str, str]:
    """Rate, samples, first and last time, least and most of each channel of a group, as text."""
    count = next(channel.count for channel in source.channels if channel.name == names[0])
    firsts = sorted({*range(0, count, max(BLOCK, -(-count // LOOKED_AT))), max(count - BLOCK, 0)}) if count else []
    blocks = [next(source.blocks(names, BLOCK, first)) for first in firsts]
    if not blocks:
        return dict.fromkeys(names, f"{'':>10} {0:>10}")
    rate = _rate(np.concatenate([np.diff(block.times) for block in blocks]))
    low, high = (
        fun([fun(block.values, axis=0, initial=start, where=np.isfinite(block.values)) for block in blocks], axis=0)
        for fun, start in ((np.min, np.inf), (np.max, -np.inf))
    )
    head = f"{rate:>10} {count:>10} {blocks[0].times[0]:>9.6g} {blocks[-1].times[-1]:>9.6g}"
    return {name: f"{head} {a:>11.5g} {b:>11.5g}" for name, a, b in zip(names, low, high, strict=True)}


def _rate(steps: np.ndarray) -> str:
    """Samples per second by the steps (s) between them, their mean where rounded times repeat; none of one sample."""
    step = float(np.median(steps)) if len(steps) else 0.0
    if step > 0:
        return f"{1.0 / step:.6g}"
    return f"~{1.0 / steps.mean():.4g}" if len(steps) and steps.mean() > 0 else "none"
