"""How roll and pitch are held in the runs of a recording: free, and by the stabiliser of its scene, tuned to the stated
noise."""

import numpy as np

from models.measured.checks.spectra import white_noise
from models.measured.recording import Recording
from models.measured.signal import Quantity
from models.systems.measured.scene import Deviations, MeasuredScene
from models.systems.measured.section_run import AttitudeHold

FREE_RUN = "free"
"""Name of the run without a stabiliser."""
QUANTITY_OF_NOISE_KEY: dict[str, Quantity] = {
    "force": "force",
    "moment": "moment",
    "angle": "angle",
    "rate": "angular rate",
}
"""Keys of the scene's table ``white_noise``, and the quantities that they are of."""


def holds_of(scene: MeasuredScene, recording: Recording) -> dict[str, AttitudeHold]:
    """For each run by name, the way in which roll and pitch are held: free, and by the stabiliser that the scene
    names.
    """
    settings, deviations = scene.stabilise, noise_of(scene.noise, recording)
    stabilised_hold = {
        settings.method: AttitudeHold(
            settings.method, settings.bandwidth, settings.model, settings.smoothing, **deviations
        )
    }
    return {FREE_RUN: AttitudeHold("none", **deviations)} | ({} if settings.method == "none" else stabilised_hold)


def noise_of(stated: Deviations, recording: Recording) -> dict[str, float]:
    """Standard deviations of the noise (SI, by key): as stated, else as estimated but at least those of usual
    transducers, since filters hide noise.
    """
    deviations = dict[str, float]()
    for key, quantity in QUANTITY_OF_NOISE_KEY.items():
        sizes = np.array([white_noise(recording, s) for s in recording.find(quantity) if not s.check])
        known = sizes[np.isfinite(sizes)]  # none of a channel with too many gaps
        least = float(getattr(AttitudeHold, key))
        deviations[key] = getattr(stated, key) or max(least, float(np.median(known)) if len(known) else least)
    return deviations
