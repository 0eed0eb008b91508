"""The channel map of a scene: each channel named in it, found in its file, with its factor to SI and its place."""

import re
from collections.abc import Sequence
from difflib import get_close_matches

from models.core.errors import InputError, suggestion
from models.measured.channel import Channel, Source
from models.measured.places import Places
from models.measured.signal import Frame, Quantity, Signal
from models.measured.units import conversion
from models.systems.measured.scene import MappedChannel, MeasuredScene

AXES: dict[Quantity, tuple[str, ...]] = {
    "force": ("x", "y", "z"),
    "moment": ("x", "y", "z"),
    "acceleration": ("x", "y", "z"),
    "angular rate": ("roll", "pitch", "yaw"),
    "angle": ("roll", "pitch", "yaw"),
    "travel": (),
    "strain": (),
}
"""Components that a quantity can have; none along a connector, which has its own direction."""


def signals(scene: MeasuredScene, sources: Sequence[Source], places: Places) -> tuple[Signal, ...]:
    """Signals in the order of the scene; ``sources`` are its files, opened, in theirs.

    What is measured at a connector, and any strain, is only compared with. Raises InputError at the first channel that
    is not in its file, is there or in the map twice, or whose unit, place, component or frame makes no sense.
    """
    rows = [
        (f"files, {file.file}, {row.channel!r}", row, source)
        for file, source in zip(scene.files, sources, strict=True)
        for row in file.channels
    ]
    names = [row.channel for _, row, _ in rows]
    found = list[Signal]()
    for place, row, source in rows:
        name = row.channel if names.count(row.channel) == 1 else f"{row.channel} ({source.path.name})"
        signal = _signal(scene.file, place, row, source, places, name)
        _check_new(scene.file, f"{place}", signal, found)
        found.append(signal)
    _check_frames(scene.file, found, places)
    return tuple(found)


def _signal(file: str, place: str, row: MappedChannel, source: Source, places: Places, name: str) -> Signal:
    channel = find(source, row.channel, file, f"{place}")
    unit, where = row.unit, (file, f"{place}, unit")
    if unit is None:
        unit, where = channel.unit.strip(), (source.path.name, f"unit of {row.channel!r}")
        if not unit and row.quantity != "strain":
            allowed = f"is missing: {source.path.name} names none of {row.channel!r}"
            raise InputError(file, f"{place}, unit", None, allowed)
    factor = conversion(unit, row.quantity, *where)
    _check_place(file, place, row, places)
    usual: Frame = "hub" if row.at in places.hubs else "inertial" if row.quantity == "angle" else "body"
    frame = row.frame or usual
    frames = ("hub", "body", "inertial") if row.at in places.hubs else ("body", "inertial", "sensor")
    if frame not in frames:
        raise InputError(file, f"{place}, frame", frame, f"is no frame of {row.quantity} at {row.at!r}", frames)
    check = row.check or row.quantity == "strain" or row.at in places.connectors
    return Signal(
        name,
        source.path.name,
        row.channel,
        row.quantity,
        row.at,
        row.component,
        frame,
        row.sign,
        unit,
        factor,
        zero=row.zero,
        gravity=row.gravity,
        check=check,
    )


def find(source: Source, name: str, file: str, place: str) -> Channel:
    """The one channel of a file with this name; InputError that offers the nearest ones."""
    found = [channel for channel in source.channels if channel.name == name]
    if len(found) == 1:
        return found[0]
    if found:
        raise InputError(file, place, name, f"is there {len(found)} times in {source.path.name}: rename all but one")
    same = re.compile(re.escape(name) + r" \(\d+\)")
    numbered = [channel.name for channel in source.channels if same.fullmatch(channel.name)]
    if numbered:
        raise InputError(
            file,
            place,
            name,
            f"is there {len(numbered)} times in {source.path.name}: name one of {', '.join(map(repr, numbered))}",
        )
    raise InputError(file, place, name, f"no such channel in {source.path.name}{_near(name, source)}")


def _near(name: str, source: Source) -> str:
    """Phrase with the channels of a file that are most like a name, or else the first ones."""
    plain = {channel.name.casefold(): channel.name for channel in source.channels}
    close = [plain[each] for each in get_close_matches(name.casefold(), plain, n=3, cutoff=0.6)]
    if close:
        return f"; did you mean {' or '.join(map(repr, close))}?"
    first = ", ".join(channel.name for channel in source.channels[:8])
    return f", which has {len(source.channels)}: {first}{', ...' if len(source.channels) > 8 else ''}"


def _check_place(file: str, place: str, row: MappedChannel, places: Places) -> None:
    """Refuse what is not a place for this quantity, and a component that it does not have there."""
    kinds = places.of(row.quantity)
    if kinds and not any(row.at in names for names in kinds.values()):
        known = "; ".join(f"{kind}: {', '.join(names)}" for kind, names in kinds.items() if names)
        every = tuple(name for names in kinds.values() for name in names)
        raise InputError(
            file,
            f"{place}, at",
            row.at,
            f"the vehicle has no such place for {row.quantity} ({known}){suggestion(row.at, every)}",
        )
    along = row.at in places.connectors and row.quantity in ("force", "moment")
    axes = () if along else AXES[row.quantity]
    if row.component not in (axes or ("",)):
        own = "has a direction of its own: leave component out"
        allowed = f"must be {', '.join(axes[:-1])} or {axes[-1]}" if axes else own
        raise InputError(
            file, f"{place}, component", row.component or None, f"{allowed} ({row.quantity} at {row.at!r})"
        )


def _check_new(file: str, place: str, signal: Signal, found: list[Signal]) -> None:
    """Refuse a channel that is mapped twice, and two that would both be put in as the same."""
    for other in found:
        if other.name == signal.name:
            raise InputError(file, place, signal.channel, "is mapped twice: each channel is one signal")
        same = (other.quantity, other.at, other.component) == (signal.quantity, signal.at, signal.component)
        if same and not (signal.check or other.check):
            raise InputError(
                file, place, signal.channel, f"measures the same as {other.channel!r}: say check = true of one of them"
            )


def _check_frames(file: str, found: list[Signal], places: Places) -> None:
    own = {signal.frame: signal for signal in found if signal.at in places.hubs and not signal.check}
    if len(own) > 1:
        one, two = list(own.values())[:2]
        raise InputError(
            file,
            "files",
            None,
            f"hub forces must all be in one frame: {one.channel!r} is in "
            f"{one.frame!r}, {two.channel!r} in {two.frame!r}",
        )
