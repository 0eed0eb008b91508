"""How a scene of a recording holds roll and pitch, and the noise that its filter reckons with."""

import numpy as np

from models.measured.checks.noise_floor import noise
from models.measured.recording import Recording
from models.measured.signal import Quantity
from models.systems.measured.scene import Deviations, MeasuredScene
from models.systems.measured.section_run import Hold

NOISE: dict[str, Quantity] = {"force": "force", "moment": "moment", "angle": "angle", "rate": "angular rate"}
"""Keys of the scene's table ``noise``, and the quantities that they are of."""


def noise_of(stated: Deviations, recording: Recording) -> dict[str, float]:
    """Noise (SI, by key) as stated; or else estimated, and not below what transducers have: filters hide noise."""
    usual, out = Hold(), dict[str, float]()
    for key, quantity in NOISE.items():
        sizes = np.array([noise(recording, s) for s in recording.find(quantity) if not s.check])
        known = sizes[np.isfinite(sizes)]  # none of a channel with too many gaps
        least = float(getattr(usual, key))
        out[key] = getattr(stated, key) or max(least, float(np.median(known)) if len(known) else least)
    return out


def hold_of(scene: MeasuredScene, recording: Recording) -> Hold:
    """As the scene says."""
    own = scene.stabilise
    return Hold(own.method, own.bandwidth, own.model, own.smoothing, **noise_of(scene.noise, recording))
