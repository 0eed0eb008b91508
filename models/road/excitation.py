"""Excitation of a vehicle's axles by a random road: one shape filter per axle, all driven by the same noise, axle after
axle."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class RoadExcitation:
    """Road filter f' = F f + G w over the path (m), with unit white noise w per metre, and heights under the wheels z =
    sum_i H_i f_i over the axles i.

    F (m, m), G (m, k); heights, one (w, m) per axle, zero in the rows of other axles' wheels; lengths (m): how far
    each axle runs behind the first, the first 0. ``independent``: every axle has noise of its own.
    """

    F: np.ndarray
    G: np.ndarray
    heights: tuple[np.ndarray, ...]
    lengths: tuple[float, ...]
    independent: bool = False
