"""Statistics of noise paths, accumulated block by block: errors over time, drift-off times, and the first paths.

The memory does not grow with the number of paths.
"""

import numpy as np

from models.ensemble.statistics import FAN_PERCENTILES
from models.ensemble.store import ArraysByName
from models.ensemble.streamed import MagnitudeQuantiles, StreamedCovariance, StreamedMoments, ValueCounts

PITCH_STATE_INDEX = 3
"""Index of the pitch in a state."""


class PathStatistics:
    """Statistics of noise paths relative to the true states (rows, 8), accumulated from the blocks of ``noise_paths``.

    moments, covariance : of the errors of all states at each row; fan : percentiles of the size of the pitch error;
    drift_off : tally of drift-off times (s), infinite for a path that never did; lost : number of paths that left all
    bounds; steepest (rows,) : largest magnitude of the pitch (rad) among the other paths; first : arrays of the first
    ``saved_paths`` paths.
    """

    def __init__(self, true_states: np.ndarray, saved_path_count: int) -> None:
        self._true, self._saved, self._blocks = true_states, saved_path_count, list[ArraysByName]()
        self.moments, self.covariance, self._spread, self.drift_off = (
            StreamedMoments(),
            StreamedCovariance(),
            MagnitudeQuantiles(),
            ValueCounts(),
        )
        self.lost, self.steepest = 0, np.full(len(true_states), np.nan)

    def add(self, path_block: ArraysByName) -> None:
        """Add a block of noise paths to all statistics."""
        errors = path_block["states"] - self._true
        self.moments.add(errors)
        self.covariance.add(errors)
        self._spread.add(errors[:, :, PITCH_STATE_INDEX])
        self.drift_off.add(path_block["drift_off"])
        self.lost += int(np.isfinite(path_block["failed"]).sum())
        self.steepest = np.fmax(
            self.steepest, np.fmax.reduce(np.abs(path_block["states"][:, :, PITCH_STATE_INDEX]), axis=0)
        )
        paths_kept = sum(len(saved_block["drift_off"]) for saved_block in self._blocks)
        if paths_kept < self._saved:
            self._blocks.append({name: values[: self._saved - paths_kept] for name, values in path_block.items()})

    @property
    def first(self) -> ArraysByName:
        """Arrays of the first ``saved_paths`` paths, by name."""
        return {name: np.concatenate([block[name] for block in self._blocks]) for name in self._blocks[0]}

    @property
    def pitch_error_percentiles(self) -> np.ndarray:
        """Percentiles FAN_PERCENTILES of the magnitude of the pitch error (rad), shape (5, rows), each within
        ``streamed.QUANTILE_ACCURACY``.
        """
        return self._spread.percentiles(FAN_PERCENTILES)
