"""Listing of a measurement file: its channels, and a draft scene for an engineer to correct.

What a channel probably measures is read from its name and unit, in English and German, as FL_Fx, WFT_RR_MZ, Radkraft
vorne links, ax_dash or Nickrate are written.
"""

import json
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from models.core.finding import merged_findings
from models.measured.channel import SAMPLES_PER_BLOCK, FileChannel, MeasurementSource
from models.measured.formats import open_source
from models.measured.signal import UNIT_OF_QUANTITY, Quantity
from models.measured.units import quantities_of_unit

LARGEST_BLOCK_COUNT = 20
"""Most blocks of a channel group that are read for the range of values: all of a file of twenty minutes at 1 kHz."""
SCENE_TEMPLATE = """\
title = "{title}"
system = "measured"
study = "recording"

[vehicle]
file = "r19_free"                # or a file of your own, whose tyres are then the hubs below
chassis = "body"

[[files]]
file = "{file}"
channels = ["""
HUB_PATTERNS = {
    "fl": r"fl|lf|vl|lv|front ?left|left ?front|vorne? ?links|links ?vorne?",
    "fr": r"fr|rf|vr|rv|front ?right|right ?front|vorne? ?rechts|rechts ?vorne?",
    "rl": r"rl|lr|hl|lh|rear ?left|left ?rear|hinten ?links|links ?hinten",
    "rr": r"rr|hr|rh|rear ?right|right ?rear|hinten ?rechts|rechts ?hinten",
}
"""Patterns of channel names by hub of the vehicle r19_free."""
SPRING_OF_HUB = {"fl": "front left", "fr": "front right", "rl": "rear left", "rr": "rear right"}
"""Springs of the vehicle r19_free by hub."""
QUANTITY_PATTERNS: dict[Quantity, str] = {
    "force": r"f[xyz]|force|rad(last|kraft)|kraft|load",
    "moment": r"m[xyz]|moment|torque|drehmoment",
    "acceleration": r"a[xyz]|acc|accel(eration)?|beschl(eunigung)?",
    "angular rate": r"(roll|pitch|yaw|nick|wank|gier) ?(rate|vel)|(nick|wank|gier)(rate|geschwindigkeit)|gyro|w[xyz]",
    "angle": r"roll|pitch|yaw|heading|nick(winkel)?|wank(winkel)?|gier(winkel)?",
    "travel": r"travel|federweg|weg|defl(ection)?|disp(lacement)?",
    "strain": r"strain|dms|sg|eps",
}
AXIS_PATTERNS = {
    "x": r"[fmaw]?x|long(itudinal)?|längs",
    "y": r"[fmaw]?y|lat(eral)?|quer",
    "z": r"[fmaw]?z|vert(ical)?|hoch|vertikal",
}
SUSPENSION_PART_PATTERN = (
    r"strut|damper|shock|absorber|spring|coil ?over|feder|d(ä|ae|a)mpf|sto(ß|ss)d|bellow|balg|top ?mount|domlager|"
    r"bump ?stop|puffer|tie ?rod|track ?rod|push ?rod|pull ?rod|spurstange|druckstrebe|lenker|\barm\b|wishbone|"
    r"\blink\b|stange|(roll|sway|torsion) ?bar|stabi|bush|buchse|ball ?joint|gelenk|sub ?frame|hilfsrahmen|"
    r"lagerung|mount\b|\b(shk|spr|dmp|dmpr|damp|arb|coil|mcpherson|leaf)\b"
)
"""Pattern of suspension parts in channel names, whose forces are not hub forces."""
WHEEL_PATTERN = r"(mess)?rad(last|kraft)?|wheel(force|load)?|wft|rmr|hub|spindle|naben?(kraft)?|tyre|tire|reifen"
"""Pattern of wheels in channel names."""
UNSPECIFIC_PATTERN = (
    r"f|fw|vert(ical)?|dyn(amic)?|stat(ic)?|total|sum|gesamt|measured|meas|gemessen|signal|ch|chan|channel|kanal"
)
"""Pattern of words in channel names that do not tell where a force acts."""
ROTATION_PATTERNS = {"roll": r"roll.*|wank.*|w?x", "pitch": r"pitch.*|nick.*|w?y", "yaw": r"yaw.*|gier.*|heading|w?z"}


@dataclass(frozen=True)
class ChannelGuess:
    """Guess at the meaning of a channel from its name and unit. unit : empty where the file's unit is usable; doubt :
    text on what is uncertain.

    at : place on the vehicle, empty where unknown; left_out : reason why the guess should not be used unchanged.
    """

    channel: str
    quantity: Quantity
    at: str
    component: str
    unit: str
    doubt: str
    left_out: str = ""


def guess_channel(channel: FileChannel) -> ChannelGuess | None:
    """Guess the meaning of a channel from its name and unit; None without any clue. Unknown fields are empty."""
    words, family = _words_of_name(channel.name), _words_of_name(channel.family)
    kinds = quantities_of_unit(channel.unit) or tuple(QUANTITY_PATTERNS)
    what = next(
        (kind for kind in kinds if _has_words(QUANTITY_PATTERNS[kind], words)), kinds[0] if len(kinds) == 1 else None
    )
    if what is None:
        return None
    corner = next(
        (hub for text in (words, family) for hub, names in HUB_PATTERNS.items() if _has_words(names, text)), ""
    )
    axes = (
        ROTATION_PATTERNS
        if what in ("angular rate", "angle")
        else AXIS_PATTERNS
        if what in ("force", "moment", "acceleration")
        else {}
    )
    component = next((axis for axis, names in axes.items() if _has_words(names, words)), "")
    unit = "" if channel.unit.strip() or what == "strain" else UNIT_OF_QUANTITY[what]
    doubts, left_out = [f"the file names no unit: is it {unit}?"] if unit else [], ""
    part = _suspension_words(words, family) if what in ("force", "moment") else ""
    if part:
        left_out = (
            f"left out: of a part of the suspension ({part}), not of a hub; at a connector it can be compared with"
        )
        return ChannelGuess(channel.name, what, "", "", unit, " ".join(doubts), left_out)
    if what == "force" and corner and not component:
        component, strange = "z", _unexpected_word(words)
        doubts.append("vertical?")
        left_out = f"left out: is {strange!r} at the hub?" if strange else ""
    if what == "acceleration":
        doubts.append("where? name the place under [sensors]")
    places = {"force": corner, "moment": corner, "travel": SPRING_OF_HUB.get(corner, ""), "strain": channel.name}
    at = places.get(what, "" if what == "acceleration" else "body")
    return ChannelGuess(channel.name, what, at, component, unit, " ".join(doubts), left_out)


def _words_of_name(channel_name: str) -> str:
    """Words of a channel's name in lower case, separated by spaces."""
    return " ".join(re.findall(r"[a-zäöüß]+", re.sub(r"([a-zäöüß])([A-Z])", r"\1 \2", channel_name).lower()))


def _suspension_words(*searched_texts: str) -> str:
    """First word in texts that names a part of a suspension; empty if there is none."""
    matches = (re.search(rf"[^ ]*({SUSPENSION_PART_PATTERN})[^ ]*", text) for text in searched_texts)
    return next((match.group() for match in matches if match), "")


def _unexpected_word(name_words: str) -> str:
    """First word of a force channel's name that is no known word for a corner, a force or a wheel, and no filler
    word.
    """
    for known in (*HUB_PATTERNS.values(), QUANTITY_PATTERNS["force"], WHEEL_PATTERN, UNSPECIFIC_PATTERN):
        name_words = re.sub(rf"(?<![^ ])(?:{known})(?![^ ])", "", name_words)
    return next((word for word in name_words.split() if len(word) > 1), "")


def _has_words(word_pattern: str, name_words: str) -> bool:
    return re.search(rf"(?:^| )(?:{word_pattern})(?: |$)", name_words) is not None


def describe(measured_path: Path) -> str:
    """Text on a measurement file: its channels with unit, rate, samples, times and range, findings of the reader, and a
    scene with a guessed channel map.

    All lines except those of the scene are comments, so that the text is a scene file.

    Raises InputError for a file that is no measurement.
    """
    source = open_source(measured_path)
    began = f", began {source.start.isoformat(sep=' ')}" if source.start else ", which does not say when it began"
    lines = [f"{measured_path.name}: {len(source.channels)} channels{began}"]
    lines += [f"  {line}" for line in source.comment.splitlines()[:10]]
    width = max([len(channel.name) for channel in source.channels], default=0)
    lines += [
        f"  {'channel':<{width}} {'unit':<9}{'rate':>10} {'samples':>10} {'from':>9} {'to':>9} {'least':>11} "
        f"{'most':>11}",
        f"  {'':<{width}} {'':<9}{'[Hz]':>10} {'':>10} {'[s]':>9} {'[s]':>9}",
    ]
    groups = dict[int, list[str]]()
    for channel in source.channels:
        groups.setdefault(channel.group, []).append(channel.name)
    ranges = {name: text for names in groups.values() for name, text in _range_texts(source, names).items()}
    lines += [f"  {c.name:<{width}} {c.unit:<9}{ranges[c.name]}" for c in source.channels]
    lines += [f"  {finding.weight}: {finding.text}" for finding in merged_findings(source.findings)]
    lines += ["", "A scene to begin with, its map guessed from names and units; check every line."]
    return "\n".join([*(f"# {line}".rstrip() for line in lines), "", scene_text(source)])


def _range_texts(measurement_file: MeasurementSource, channel_names: list[str]) -> dict[str, str]:
    """Text for each channel of a group: rate, number of samples, first and last time, least and largest value."""
    count = next(channel.count for channel in measurement_file.channels if channel.name == channel_names[0])
    firsts = (
        sorted(
            {
                *range(0, count, max(SAMPLES_PER_BLOCK, -(-count // LARGEST_BLOCK_COUNT))),
                max(count - SAMPLES_PER_BLOCK, 0),
            }
        )
        if count
        else []
    )
    blocks = [next(measurement_file.blocks(channel_names, SAMPLES_PER_BLOCK, first)) for first in firsts]
    if not blocks:
        return dict.fromkeys(channel_names, f"{'':>10} {0:>10}")
    steps = np.concatenate([np.diff(block.times) for block in blocks])
    step, mean = (float(fun(steps)) if len(steps) else 0.0 for fun in (np.median, np.mean))  # rounded times repeat
    rate = f"{1.0 / step:.6g}" if step > 0 else f"~{1.0 / mean:.4g}" if mean > 0 else "none"
    low, high = (
        fun([fun(block.values, axis=0, initial=start, where=np.isfinite(block.values)) for block in blocks], axis=0)
        for fun, start in ((np.min, np.inf), (np.max, -np.inf))
    )
    head = f"{rate:>10} {count:>10} {blocks[0].times[0]:>9.6g} {blocks[-1].times[-1]:>9.6g}"
    return {name: f"{head} {a:>11.5g} {b:>11.5g}" for name, a, b in zip(channel_names, low, high, strict=True)}


def scene_text(measurement_file: MeasurementSource) -> str:
    """Returns a draft scene for a measurement file as TOML: entries for guessed channels, comments for the others."""
    rows = [_map_entry(channel.name, guess_channel(channel)) for channel in measurement_file.channels]
    return "\n".join(
        [SCENE_TEMPLATE.format(title=measurement_file.path.stem, file=measurement_file.path.name), *rows, "]", ""]
    )


def _map_entry(channel_name: str, channel_guess: ChannelGuess | None) -> str:
    """Returns an entry of the channel map as TOML, as a comment where anything is missing or uncertain."""
    if channel_guess is None:
        return f"  # {{ channel = {_toml_string(channel_name)} }},  # not known"
    free = channel_guess.quantity in ("travel", "strain") or bool(channel_guess.left_out and not channel_guess.at)
    entries = {
        "channel": channel_name,
        "quantity": channel_guess.quantity,
        "at": channel_guess.at or "?",
        "component": channel_guess.component or ("" if free else "?"),
        "unit": channel_guess.unit,
    }
    text = ", ".join(f"{key} = {_toml_string(value)}" for key, value in entries.items() if value)
    told = " ".join(word for word in (channel_guess.doubt, channel_guess.left_out) if word)
    unsure = channel_guess.left_out or "?" in entries.values()
    return f"  {'# ' if unsure else ''}{{ {text} }},{f'  # {told}' if told else ''}"


def _toml_string(plain_text: str) -> str:
    """Returns a text as a quoted TOML string."""
    return json.dumps(plain_text, ensure_ascii=False)
