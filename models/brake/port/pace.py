"""Pacing by the wall clock: each exchange takes place at its time, with overruns counted; the results stay the same."""

import time
from dataclasses import dataclass

from models.brake.controller import Command, Controller, Sample


@dataclass
class WallClockController:
    """A controller whose samples are paced by wall-clock time, counted from the first sample.

    An exchange overruns if its answer comes after the time (s) of the next sample. overruns : their number; worst : the
    longest time (s) by which one was late.
    """

    controller: Controller
    period: float
    overruns: int = 0
    worst: float = 0.0
    _start: float | None = None

    def sample(self, sample: Sample) -> Command:
        """The controller's command for a sample. The controller is called only when the wall clock has reached the
        sample's time.
        """
        now = time.perf_counter()
        if self._start is None:
            self._start = now - 1e-9 * sample.time
        due = self._start + 1e-9 * sample.time
        if now < due:
            time.sleep(due - now)
        command = self.controller.sample(sample)
        late = time.perf_counter() - (due + self.period)
        if late > 0.0:
            self.overruns, self.worst = self.overruns + 1, max(self.worst, late)
        return command

    def report(self) -> str:
        """One line of text on the number of overruns and the worst one."""
        return f"{self.overruns} overruns, the worst by {1e3 * self.worst:.3f} ms"
