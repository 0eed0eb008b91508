"""Input signals in the form that Exudyn's callbacks read."""

from collections.abc import Callable
from typing import Any

import numpy as np

from models.core.signals import Signal
from models.engines.assembly import Settings
from models.engines.catalogue import CATALOGUE


class SignalClock:
    """A signal as Exudyn's callbacks read it: by step, by half step or at any time."""

    def __init__(self, input_signal: Signal, run_settings: Settings) -> None:
        h, n = run_settings.step, run_settings.steps
        self.per_time = 2.0 / h
        self.step = 0
        nodes = CATALOGUE["exudyn"][run_settings.integrator].nodes
        self.held = input_signal.held
        self.table: list[list[float]] = []
        self.steps: list[list[float]] = []
        if self.held:
            self.steps = input_signal.sample(0.0, h, n).T.tolist()
        if not self.held and nodes != "any":
            self.table = input_signal.sample(0.0, h / 2, 2 * n + 1).T.tolist()
        self.signal = input_signal
        self.latest = (-1.0, np.empty(0))

    def reader(self, channel_index: int, value_factor: float) -> Callable[[Any, float, float], float]:
        """Callback (mbs, t, load) that returns ``value_factor`` times one channel of the signal."""
        if self.held:
            values = [value_factor * value for value in self.steps[channel_index]]
            return lambda mbs, t, load: values[self.step]
        if self.table:
            values, per_time = [value_factor * value for value in self.table[channel_index]], self.per_time
            return lambda mbs, t, load: values[round(t * per_time)]
        return lambda mbs, t, load: value_factor * self.at(t)[channel_index]

    def at(self, t: float) -> np.ndarray:
        """All channels of the signal at one time t (s). The last values are stored, since all loads of a stage ask for
        the same time."""
        if t != self.latest[0]:
            self.latest = (t, self.signal.at(t))
        return self.latest[1]

    def advance(self, mbs: Any, t: float) -> bool:
        """Set the current step. Exudyn calls this before each step with the time t of the step's end, and expects
        True."""
        self.step = min(round(t * self.per_time / 2) - 1, len(self.steps[0]) - 1)
        return True
