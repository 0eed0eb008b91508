"""Channel map of a scene: the mapped channels of its files as signals, with factors to SI and places on the vehicle."""

import re
from collections.abc import Sequence
from difflib import get_close_matches

from models.core.errors import InputError, suggestion_phrase
from models.measured.channel import FileChannel, MeasurementSource
from models.measured.signal import Frame, MeasuredSignal, MeasurementPlaces, Quantity
from models.measured.units import factor_to_si
from models.systems.measured.scene import MappedChannel, MeasuredScene

COMPONENTS_OF_QUANTITY: dict[Quantity, tuple[str, ...]] = {
    **dict.fromkeys(("force", "moment", "acceleration"), ("x", "y", "z")),
    **dict.fromkeys(("angular rate", "angle"), ("roll", "pitch", "yaw")),
    **dict.fromkeys(("travel", "strain"), ()),
}
"""Components that each quantity can have; none for quantities along a connector, which has a direction itself."""


def mapped_signals(
    scene: MeasuredScene, sources: Sequence[MeasurementSource], places: MeasurementPlaces
) -> tuple[MeasuredSignal, ...]:
    """Returns the signals of all mapped channels, in the order of the scene; ``sources`` : the scene's opened files.

    Measurements at connectors, and strains, are only compared with the run. Raises InputError at the first channel that
    is not in its file, is there or in the map twice, or whose unit, place, component or frame makes no sense.
    """
    rows = [
        (f"files, {file.file}, {row.channel!r}", row, source)
        for file, source in zip(scene.files, sources, strict=True)
        for row in file.channels
    ]
    names, mapped = [row.channel for _, row, _ in rows], list[MeasuredSignal]()
    for place, row, source in rows:
        name = row.channel if names.count(row.channel) == 1 else f"{row.channel} ({source.path.name})"
        signal = _signal_of_entry(scene.file, place, row, source, places, name)
        for earlier in mapped:
            if earlier.name == signal.name:
                raise InputError(scene.file, place, row.channel, "is mapped twice: each channel is one signal")
            measures_same = (earlier.quantity, earlier.at, earlier.component) == (
                signal.quantity,
                signal.at,
                signal.component,
            )
            if measures_same and not (signal.check or earlier.check):
                text = f"measures the same as {earlier.channel!r}: say check = true of one of them"
                raise InputError(scene.file, place, row.channel, text)
        mapped.append(signal)
    frames = {signal.frame: signal for signal in mapped if signal.at in places.hubs and not signal.check}
    if len(frames) > 1:
        examples = ", ".join(f"{signal.channel!r} is in {signal.frame!r}" for signal in [*frames.values()][:2])
        raise InputError(scene.file, "files", None, f"hub forces must all be in one frame: {examples}")
    return tuple(mapped)


def _signal_of_entry(
    file: str, place: str, row: MappedChannel, source: MeasurementSource, places: MeasurementPlaces, name: str
) -> MeasuredSignal:
    channel, at_hub = find(source, row.channel, file, place), row.at in places.hubs
    unit, unit_place = row.unit, (file, f"{place}, unit")
    if unit is None:
        unit, unit_place = channel.unit.strip(), (source.path.name, f"unit of {row.channel!r}")
        if not unit and row.quantity != "strain":
            missing = f"is missing: {source.path.name} names none of {row.channel!r}"
            raise InputError(file, f"{place}, unit", None, missing)
    factor = factor_to_si(unit, row.quantity, *unit_place)
    _check_place(file, place, row, places)
    usual: Frame = "hub" if at_hub else "inertial" if row.quantity == "angle" else "body"
    frame, frames = row.frame or usual, ("hub", "body", "inertial") if at_hub else ("body", "inertial", "sensor")
    if frame not in frames:
        raise InputError(file, f"{place}, frame", frame, f"is no frame of {row.quantity} at {row.at!r}", frames)
    check = row.check or row.quantity == "strain" or row.at in places.connectors
    location = row.channel, row.quantity, row.at, row.component
    return MeasuredSignal(
        name,
        source.path.name,
        *location,
        frame,
        row.sign,
        unit,
        factor,
        zero=row.zero,
        gravity=row.gravity,
        check=check,
    )


def find(source: MeasurementSource, name: str, file: str, place: str) -> FileChannel:
    """Returns the channel of a file by its name. Raises InputError, with the most similar names, if there is not
    exactly one.
    """
    alike = [channel for channel in source.channels if channel.name == name]
    if len(alike) == 1:
        return alike[0]
    numbered = [repr(c.name) for c in source.channels if re.fullmatch(re.escape(name) + r" \(\d+\)", c.name)]
    if alike or numbered:
        remedy = f"name one of {', '.join(numbered)}" if not alike else "rename all but one"
        text = f"is there {len(alike or numbered)} times in {source.path.name}: {remedy}"
        raise InputError(file, place, name, text)
    raise InputError(file, place, name, f"no such channel in {source.path.name}{_similar_channels(name, source)}")


def _similar_channels(name: str, source: MeasurementSource) -> str:
    """Text with the channels of a file whose names are most similar to ``name``, or else with the first channels."""
    plain = {channel.name.casefold(): channel.name for channel in source.channels}
    close = [plain[each] for each in get_close_matches(name.casefold(), plain, n=3, cutoff=0.6)]
    if close:
        return f"; did you mean {' or '.join(map(repr, close))}?"
    first = ", ".join(channel.name for channel in source.channels[:8])
    return f", which has {len(source.channels)}: {first}{', ...' if len(source.channels) > 8 else ''}"


def _check_place(file: str, place: str, row: MappedChannel, places: MeasurementPlaces) -> None:
    """Raise InputError for a place where the mapped quantity cannot be measured, and for a component that it does not
    have there.
    """
    names_by_kind = places.of(row.quantity)
    all_names = tuple(name for names in names_by_kind.values() for name in names)
    if names_by_kind and row.at not in all_names:
        known = "; ".join(f"{kind}: {', '.join(names)}" for kind, names in names_by_kind.items() if names)
        text = f"the vehicle has no such place for {row.quantity} ({known}){suggestion_phrase(row.at, all_names)}"
        raise InputError(file, f"{place}, at", row.at, text)
    along = row.at in places.connectors and row.quantity in ("force", "moment")
    axes = () if along else COMPONENTS_OF_QUANTITY[row.quantity]
    if row.component not in (axes or ("",)):
        allowed = "has a direction of its own: leave component out"
        if axes:
            allowed = f"must be {', '.join(axes[:-1])} or {axes[-1]}"
        text = f"{allowed} ({row.quantity} at {row.at!r})"
        raise InputError(file, f"{place}, component", row.component or None, text)
