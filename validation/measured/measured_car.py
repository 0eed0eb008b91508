"""The moving car of ``validation.measured.recording`` as an engineer's recording: accelerometers, gyros, angles."""

from pathlib import Path

import numpy as np

from models.measured.columns import Columns
from models.measured.recording import Recording
from models.measured.signal import Quantity, Signal
from models.sensors.rotations import matrix
from validation.measured import recording as car

CHANNELS: tuple[tuple[str, Quantity, str], ...] = (
    ("ax", "acceleration", "x"),
    ("ay", "acceleration", "y"),
    ("az", "acceleration", "z"),
    ("p", "angular rate", "roll"),
    ("q", "angular rate", "pitch"),
    ("r", "angular rate", "yaw"),
    ("roll", "angle", "roll"),
    ("pitch", "angle", "pitch"),
)
TURNED = np.array([1.0, -1.0, -1.0])
"""The telephone's x forward, y right, z down into x forward, y left, z up."""


def samples(path: Path) -> np.ndarray:
    """Samples (n, channels) in SI, ISO 8855: of the telephone, and roll and pitch of the camera's pose.

    Roll and pitch are those of the vertical at the place where the car was, by the earth's centre.
    """
    own = car.read(path)
    with np.load(path) as data:
        begin, end = (side([data["gyro_t"][i], data["frame_t"][i]]) for side, i in ((max, 0), (min, -1)))
        clock = np.arange(begin, end, car.PERIOD)
        felt = np.column_stack([np.interp(clock, data["acc_t"], column) for column in data["acc"].T])
        place = data["frame_p"].mean(axis=0)
    up = np.einsum("nji,j->ni", matrix(own.pose), place / np.linalg.norm(place)) * TURNED
    return np.column_stack([felt * TURNED, own.rates * TURNED, np.arctan2(up[:, 1], up[:, 2]), -np.arcsin(up[:, 0])])


def recording(values: np.ndarray, path: Path) -> Recording:
    """Samples (n, channels) as a recording; its columns lie at ``path``."""
    own = Columns(path, tuple(name for name, *_ in CHANNELS), len(values))
    own.write(0, values)
    signals = tuple(
        Signal(name, "", name, what, "body", component, "body", 1, "", 1.0) for name, what, component in CHANNELS
    )
    return Recording(signals, own, car.PERIOD)
