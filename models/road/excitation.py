"""How a road reaches the wheels: one shape filter per axle, all driven by the same noise, axle after axle."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Excitation:
    """Road filter f' = F f + G w over the path (1/m), with unit noise per metre, and heights under the wheels z = sum_i
    H_i f_i.

    F (m, m), G (m, k); heights, one (w, m) per axle, zero in the rows of other axles' wheels; lengths (m): how far
    each axle runs behind the first, the first 0. ``independent``: every axle has noise of its own.
    """

    F: np.ndarray
    G: np.ndarray
    heights: tuple[np.ndarray, ...]
    lengths: tuple[float, ...]
    independent: bool = False
