"""Times and values of one channel of a measurement file, in a wanted unit."""

import numpy as np

from models.core.errors import InputError
from models.measured.channel import MeasurementSource
from models.measured.timing import sample_timing
from models.measured.units import factor_between


def channel_curve(measurement_source: MeasurementSource, channel_name: str, unit: str) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) in s, strictly ascending, and values (n,) of a channel in ``unit``, NaN where nothing was measured.

    Raises InputError where the file has no such channel, for a unit that is missing or does not fit, and for times
    that go back.
    """
    names = tuple(channel.name for channel in measurement_source.channels)
    if channel_name not in names:
        raise InputError(measurement_source.path, channel_name, None, "no such channel in the file", names)
    channel = measurement_source.channels[names.index(channel_name)]
    if not channel.unit and unit not in ("", "-"):
        raise InputError(
            measurement_source.path,
            channel_name,
            None,
            f"has no unit: write {channel_name} [{unit}] in the header, or its unit",
        )
    factor = factor_between(channel.unit, unit, measurement_source.path, channel_name)
    blocks = list(measurement_source.blocks([channel_name]))
    times, values = (np.concatenate(parts) for parts in zip(*((b.times, b.values[:, 0]) for b in blocks), strict=True))
    clock = sample_timing(times, str(measurement_source.path), (channel_name,))
    return clock.times, factor * (values if clock.order is None else values[clock.order])
