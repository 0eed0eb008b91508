"""A quantity of a result, and its difference from the same quantity of another result: how large, and where."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class ResultQuantity:
    """Values (n,) of a quantity of a result over ``grid`` (n,): times, another coordinate, the first column of a table,
    or row numbers.

    kind : system and mode of the run, if the file states them; labels (n,) : names of a table's rows, if these are no
    numbers; error : stated by the result for the channel, in its unit, nan if it states none.
    """

    unit: str
    values: np.ndarray
    over: str
    grid: np.ndarray
    kind: str = ""
    labels: tuple[str, ...] = ()
    error: float = np.nan


@dataclass(frozen=True)
class QuantityDifference:
    """Difference of a quantity in two results, ``second`` minus ``first`` (n,), over ``grid`` (n,); ``note`` : how both
    were brought to the same rows.

    stated : errors that both results state for the channel, together, root mean squares; nan where one states none.
    """

    name: str
    unit: str
    over: str
    grid: np.ndarray
    first: np.ndarray
    second: np.ndarray
    note: str = ""
    labels: tuple[str, ...] = ()
    stated: float = np.nan

    @property
    def within(self) -> bool:
        """Whether the rms difference of both results is within the errors that they state, and thus has no
        significance."""
        return 0.0 < self.rms <= self.stated

    @property
    def gap(self) -> np.ndarray:
        """Difference (n,) of both results; 0 where both are NaN, infinite where only one is a number or infinities
        differ."""
        with np.errstate(invalid="ignore"):
            gap = self.second - self.first
        are_equal = (self.first == self.second) | (np.isnan(self.first) & np.isnan(self.second))
        return np.where(are_equal, 0.0, np.where(np.isnan(gap), np.inf, gap))

    @property
    def row(self) -> int:
        """Index of the row at which the difference of both results is largest."""
        return int(np.abs(self.gap).argmax())

    @property
    def largest(self) -> float:
        """Largest magnitude of the difference of both results."""
        return float(abs(self.gap[self.row]))

    @property
    def rms(self) -> float:
        """Root mean square of the difference of both results."""
        return float(np.sqrt(np.mean(self.gap**2)))

    @property
    def at(self) -> float:
        """Time, or other coordinate, at which the difference of both results is largest."""
        return float(self.grid[self.row])

    @property
    def where(self) -> str:
        """Text on where the difference of both results is largest."""
        return f"{self.over.partition(' [')[0]} = {self.labels[self.row] if self.labels else f'{self.at:.9g}'}"

    @property
    def share(self) -> float:
        """Ratio of the largest difference to the largest magnitude of the first result."""
        size = np.abs(self.first[np.isfinite(self.first)]).max(initial=0.0)
        return 0.0 if self.largest == 0.0 else self.largest / size if size > 0 else np.inf
