"""Runs of samples of which something holds."""

import numpy as np


def runs(holds: np.ndarray) -> np.ndarray:
    """First index and end (r, 2) of every run of true values of (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], holds.astype(np.int8), [0]))))
    return edges.reshape(-1, 2)
