"""A quantity of a result, and its difference from the same quantity of another result: how large, and where."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class ResultQuantity:
    """Values (n,) of a quantity of a result over ``grid`` (n,): times, another coordinate, the first column of a table,
    or row numbers.

    run_kind : system and mode of the run, if the file states them; row_labels (n,) : names of a table's rows, if these
    are no numbers; stated_error : stated by the result for the channel, in its unit, nan if it states none.
    """

    unit: str
    values: np.ndarray
    grid_name: str
    grid: np.ndarray
    run_kind: str = ""
    row_labels: tuple[str, ...] = ()
    stated_error: float = np.nan


@dataclass(frozen=True)
class QuantityDifference:
    """Difference of a quantity in two results, ``second_values`` minus ``first_values`` (n,), over ``grid`` (n,);
    rows_note : how both were brought to the same rows.

    stated : errors that both results state for the channel, together, root mean squares; nan where one states none.
    """

    name: str
    unit: str
    grid_name: str
    grid: np.ndarray
    first_values: np.ndarray
    second_values: np.ndarray
    rows_note: str = ""
    row_labels: tuple[str, ...] = ()
    stated: float = np.nan

    @property
    def within(self) -> bool:
        """Whether the rms difference of both results is within the errors that they state, and thus has no
        significance."""
        return 0.0 < self.rms <= self.stated

    @property
    def difference_values(self) -> np.ndarray:
        """Difference (n,) of both results; 0 where both are NaN, infinite where only one is a number or infinities
        differ."""
        with np.errstate(invalid="ignore"):
            gap = self.second_values - self.first_values
        are_equal = (self.first_values == self.second_values) | (
            np.isnan(self.first_values) & np.isnan(self.second_values)
        )
        return np.where(are_equal, 0.0, np.where(np.isnan(gap), np.inf, gap))

    @property
    def row_of_largest(self) -> int:
        """Index of the row at which the difference of both results is largest."""
        return int(np.abs(self.difference_values).argmax())

    @property
    def largest(self) -> float:
        """Largest magnitude of the difference of both results."""
        return float(abs(self.difference_values[self.row_of_largest]))

    @property
    def rms(self) -> float:
        """Root mean square of the difference of both results."""
        return float(np.sqrt(np.mean(self.difference_values**2)))

    @property
    def at(self) -> float:
        """Time, or other coordinate, at which the difference of both results is largest."""
        return float(self.grid[self.row_of_largest])

    @property
    def where(self) -> str:
        """Text on where the difference of both results is largest."""
        position = self.row_labels[self.row_of_largest] if self.row_labels else f"{self.at:.9g}"
        return f"{self.grid_name.partition(' [')[0]} = {position}"

    @property
    def share(self) -> float:
        """Ratio of the largest difference to the largest magnitude of the first result."""
        size = np.abs(self.first_values[np.isfinite(self.first_values)]).max(initial=0.0)
        return 0.0 if self.largest == 0.0 else self.largest / size if size > 0 else np.inf
