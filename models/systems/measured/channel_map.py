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
    scene: MeasuredScene, measurement_files: Sequence[MeasurementSource], transducer_places: MeasurementPlaces
) -> tuple[MeasuredSignal, ...]:
    """Returns the signals of all mapped channels, in the order of the scene; ``measurement_files`` : the scene's opened
    files.

    Measurements at connectors, and strains, are only compared with the run. Raises InputError at the first channel that
    is not in its file, is there or in the map twice, or whose unit, place, component or frame makes no sense.
    """
    rows = [
        (f"files, {file.file}, {row.channel!r}", row, source)
        for file, source in zip(scene.files, measurement_files, strict=True)
        for row in file.channels
    ]
    names, mapped = [row.channel for _, row, _ in rows], list[MeasuredSignal]()
    for place, row, source in rows:
        name = row.channel if names.count(row.channel) == 1 else f"{row.channel} ({source.path.name})"
        signal = _signal_of_entry(scene.file, place, row, source, transducer_places, name)
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
    frames = {signal.frame: signal for signal in mapped if signal.at in transducer_places.hubs and not signal.check}
    if len(frames) > 1:
        examples = ", ".join(f"{signal.channel!r} is in {signal.frame!r}" for signal in [*frames.values()][:2])
        raise InputError(scene.file, "files", None, f"hub forces must all be in one frame: {examples}")
    return tuple(mapped)


def _signal_of_entry(
    file_name: str,
    key_path: str,
    mapped_channel: MappedChannel,
    measurement_file: MeasurementSource,
    transducer_places: MeasurementPlaces,
    key_of_place: str,
) -> MeasuredSignal:
    channel, at_hub = (
        find_channel(measurement_file, mapped_channel.channel, file_name, key_path),
        mapped_channel.at in transducer_places.hubs,
    )
    unit, unit_place = mapped_channel.unit, (file_name, f"{key_path}, unit")
    if unit is None:
        unit, unit_place = channel.unit.strip(), (measurement_file.path.name, f"unit of {mapped_channel.channel!r}")
        if not unit and mapped_channel.quantity != "strain":
            missing = f"is missing: {measurement_file.path.name} names none of {mapped_channel.channel!r}"
            raise InputError(file_name, f"{key_path}, unit", None, missing)
    factor = factor_to_si(unit, mapped_channel.quantity, *unit_place)
    _check_place(file_name, key_path, mapped_channel, transducer_places)
    usual: Frame = "hub" if at_hub else "inertial" if mapped_channel.quantity == "angle" else "body"
    frame, frames = (
        mapped_channel.frame or usual,
        ("hub", "body", "inertial") if at_hub else ("body", "inertial", "sensor"),
    )
    if frame not in frames:
        raise InputError(
            file_name,
            f"{key_path}, frame",
            frame,
            f"is no frame of {mapped_channel.quantity} at {mapped_channel.at!r}",
            frames,
        )
    check = (
        mapped_channel.check or mapped_channel.quantity == "strain" or mapped_channel.at in transducer_places.connectors
    )
    location = mapped_channel.channel, mapped_channel.quantity, mapped_channel.at, mapped_channel.component
    return MeasuredSignal(
        key_of_place,
        measurement_file.path.name,
        *location,
        frame,
        mapped_channel.sign,
        unit,
        factor,
        zero=mapped_channel.zero,
        gravity=mapped_channel.gravity,
        check=check,
    )


def find_channel(measurement_file: MeasurementSource, channel_name: str, file_name: str, key_path: str) -> FileChannel:
    """Returns the channel of a file by its name. Raises InputError, with the most similar names, if there is not
    exactly one.
    """
    alike = [channel for channel in measurement_file.channels if channel.name == channel_name]
    if len(alike) == 1:
        return alike[0]
    numbered = [
        repr(c.name) for c in measurement_file.channels if re.fullmatch(re.escape(channel_name) + r" \(\d+\)", c.name)
    ]
    if alike or numbered:
        remedy = f"name one of {', '.join(numbered)}" if not alike else "rename all but one"
        text = f"is there {len(alike or numbered)} times in {measurement_file.path.name}: {remedy}"
        raise InputError(file_name, key_path, channel_name, text)
    raise InputError(
        file_name,
        key_path,
        channel_name,
        f"no such channel in {measurement_file.path.name}{_similar_channels(channel_name, measurement_file)}",
    )


def _similar_channels(channel_name: str, measurement_file: MeasurementSource) -> str:
    """Text with the channels of a file whose names are most similar to ``channel_name``, or else with the first
    channels.
    """
    plain = {channel.name.casefold(): channel.name for channel in measurement_file.channels}
    close = [plain[each] for each in get_close_matches(channel_name.casefold(), plain, n=3, cutoff=0.6)]
    if close:
        return f"; did you mean {' or '.join(map(repr, close))}?"
    first = ", ".join(channel.name for channel in measurement_file.channels[:8])
    return (
        f", which has {len(measurement_file.channels)}: {first}{', ...' if len(measurement_file.channels) > 8 else ''}"
    )


def _check_place(
    file_name: str, key_path: str, mapped_channel: MappedChannel, transducer_places: MeasurementPlaces
) -> None:
    """Raise InputError for a place where the mapped quantity cannot be measured, and for a component that it does not
    have there.
    """
    names_by_kind = transducer_places.of(mapped_channel.quantity)
    all_names = tuple(name for names in names_by_kind.values() for name in names)
    if names_by_kind and mapped_channel.at not in all_names:
        known = "; ".join(f"{kind}: {', '.join(names)}" for kind, names in names_by_kind.items() if names)
        suggestion = suggestion_phrase(mapped_channel.at, all_names)
        text = f"the vehicle has no such place for {mapped_channel.quantity} ({known}){suggestion}"
        raise InputError(file_name, f"{key_path}, at", mapped_channel.at, text)
    along = mapped_channel.at in transducer_places.connectors and mapped_channel.quantity in ("force", "moment")
    axes = () if along else COMPONENTS_OF_QUANTITY[mapped_channel.quantity]
    if mapped_channel.component not in (axes or ("",)):
        allowed = "has a direction of its own: leave component out"
        if axes:
            allowed = f"must be {', '.join(axes[:-1])} or {axes[-1]}"
        text = f"{allowed} ({mapped_channel.quantity} at {mapped_channel.at!r})"
        raise InputError(file_name, f"{key_path}, component", mapped_channel.component or None, text)
