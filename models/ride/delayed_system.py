"""x' = A x + sum_i B_i w(t - tau_i): a linear system whose axles meet the same white noise one after the other."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class DelayedSystem:
    """State, noise and outputs y = C x + sum_i D_i w(t - tau_i), w of unit intensity with k channels.

    A (n, n); B, one (n, k) per axle; delays tau_i in s, the first 0, none falling; C (p, n); D, one (p, k) per axle.
    ``independent`` axles meet noises that know nothing of one another; the delays then have no meaning.
    """

    A: np.ndarray
    B: tuple[np.ndarray, ...]
    delays: tuple[float, ...]
    C: np.ndarray
    D: tuple[np.ndarray, ...]
    names: tuple[str, ...]
    independent: bool = False
