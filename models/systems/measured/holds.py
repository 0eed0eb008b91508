"""Stabilisation of roll and pitch in the runs of a recording: a free run, and the scene's stabiliser tuned to the
noise."""

import numpy as np

from models.measured.checks.spectra import white_noise
from models.measured.recording import Recording
from models.measured.signal import Quantity
from models.systems.measured.scene import MeasuredScene, NoiseTable
from models.systems.measured.section_run import AttitudeHold

FREE_RUN_NAME = "free"
"""Name of the run without a stabiliser."""
QUANTITY_OF_NOISE_KEY: dict[str, Quantity] = {
    "force": "force",
    "moment": "moment",
    "angle": "angle",
    "rate": "angular rate",
}
"""Keys of the scene's table [noise], with the quantity of each."""


def stabilisers_of_runs(scene: MeasuredScene, recording: Recording) -> dict[str, AttitudeHold]:
    """Returns the stabiliser settings of each run by name: of the free run, and of the run with the
    scene's stabiliser.
    """
    settings, deviations = scene.stabilise, noise_deviations(scene.noise, recording)
    stabilised_hold = {
        settings.method: AttitudeHold(
            settings.method, settings.bandwidth, settings.model, settings.smoothing, **deviations
        )
    }
    return {FREE_RUN_NAME: AttitudeHold("none", **deviations)} | ({} if settings.method == "none" else stabilised_hold)


def noise_deviations(stated_deviations: NoiseTable, recording: Recording) -> dict[str, float]:
    """Standard deviations of the measured noise in SI, by key of [noise]: as stated, else estimated from the recording,
    but at least those of usual transducers, since filters hide noise.
    """
    deviations = dict[str, float]()
    for key, quantity in QUANTITY_OF_NOISE_KEY.items():
        sizes = np.array([white_noise(recording, s) for s in recording.find_signals(quantity) if not s.check])
        known = sizes[np.isfinite(sizes)]  # none of a channel with too many gaps
        least = float(getattr(AttitudeHold, key))
        deviations[key] = getattr(stated_deviations, key) or max(
            least, float(np.median(known)) if len(known) else least
        )
    return deviations
