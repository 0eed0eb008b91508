"""A recording of any length with 60 channels: a virtual measurement repeated with soft seams, noise never twice."""

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from models.measured.columns import Columns
from models.measured.faults_of_measurement import Faults
from models.measured.recording import Recording
from models.measured.sections import Point, Sections
from models.measured.signal import Signal
from models.measured.virtual import VirtualTable, virtual_measurement
from models.noise import normal
from validation.cases.hub_forces import r19

PERIOD, SEAM, BLOCK = 1e-3, 1000, 60_000
"""s; samples over which a repetition fades into the next; samples made at once."""
PLACES = {"acc fl": (1.2, 0.6, 0.6), "acc fr": (1.2, -0.6, 0.6), "acc rear": (-1.3, 0.0, 0.6),
          "acc roof": (0.0, 0.0, 1.4)}  # fmt: skip
NOISE = {"force": 8.0, "moment": 1.0, "angle": 1.75e-3, "angular rate": 5e-3, "acceleration": 0.01, "travel": 1e-5}
"""Standard deviations on every sample, SI."""
SEED = 81


@cache
def pattern(seconds: float = 20.0) -> tuple[tuple[Signal, ...], np.ndarray]:
    """Signals and their true samples (n, 60), one repetition and its seam."""
    car = r19()
    names = [element.name for element in car.elements]
    table = VirtualTable(duration=seconds, accelerometers={name: list(place) for name, place in PLACES.items()},
                         travels=names[:10], sections=names[:9])  # fmt: skip
    found = virtual_measurement(car, table, "mujoco")
    assert len(found.signals) == 60
    return found.signals, found.samples(Faults(), 1)


def blocks(seconds: float, repeated: float = 20.0) -> Iterator[np.ndarray]:
    """Samples (n, 60), block by block, of a recording of this length (s)."""
    signals, whole = pattern(repeated)
    deviation = np.array([NOISE[signal.quantity] for signal in signals])
    length, count = len(whole) - SEAM, round(seconds / PERIOD) + 1
    fade = np.linspace(0.0, 1.0, SEAM, endpoint=False)[:, None]
    once = whole[:length].copy()
    once[:SEAM] = fade * whole[:SEAM] + (1 - fade) * whole[length:]
    for first in range(0, count, BLOCK):
        at = np.arange(first, min(first + BLOCK, count))
        values = once[at % length]
        if first == 0:
            values[: min(SEAM, count)] = whole[: min(SEAM, count)]  # begins at rest
        yield values + normal(SEED, 0, len(at), 60, first) * deviation


def recorded(seconds: float, path: Path, repeated: float = 20.0) -> Recording:
    """The same as a recording, past all files and maps; ``path`` is where its samples lie."""
    signals, _ = pattern(repeated)
    columns = Columns(path, tuple(signal.name for signal in signals), round(seconds / PERIOD) + 1)
    for values in blocks(seconds, repeated):
        columns.write(columns.done, values)
    return Recording(signals, columns, PERIOD)


def sections() -> Sections:
    """All sections, and where the accelerometers sit."""
    return Sections(r19(), points=tuple(Point(name, "body", place) for name, place in PLACES.items()))
