"""Roll and pitch enforced as they were measured: smoothed, then made twice differentiable."""

from dataclasses import replace

import numpy as np

from models.core.signals import Smooth
from models.core.smoothing import smoothed
from models.multibody.cut_table import Drive
from models.systems.hub_forces.measurement import Angles


def enforced(drive: Drive, angles: Angles, step: float, smoothing: float, file: str = "") -> Drive:
    """The drive with measured angles enforced, once through a low-pass of ``smoothing`` (Hz); raises InputError."""
    quiet = smoothed(angles.samples[:, :2], angles.period, smoothing, file, "stabilise.smoothing")
    return held(drive, quiet, angles.period, step)


def held(drive: Drive, angles: np.ndarray, period: float, step: float) -> Drive:
    """The drive with roll and pitch (m, 2), rad, enforced: a quintic spline through the samples."""
    motion = Smooth(angles, period, derivatives=2, degree=5)
    return replace(drive, guide=motion.sample(0.0, step / 2, len(drive.hubs)))
