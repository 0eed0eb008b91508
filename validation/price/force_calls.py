"""Force evaluations counted from outside: by Exudyn's own calls of a load, and by MuJoCo's own timers.

What an adapter says about its cost would otherwise be checked against itself.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from unittest.mock import patch

from models.engines.assembly import Assembly, Settings
from models.engines.protocol import build

AT_START = {"VelocityVerlet": 1, "GeneralizedAlpha": 1, "TrapezoidalIndex2": 1}
"""Evaluations before the first step, for the accelerations that a method starts from; not in the reports."""


@contextmanager
def _counted_loads() -> Iterator[list[int]]:
    """Context in which the calls of the first load are counted in every Exudyn model that is built."""
    from models.engines import exudyn

    calls = [0]

    class CountingClock(exudyn.SignalClock):
        def reader(self, column: int, time_scale: float) -> Any:
            read = super().reader(column, time_scale)
            if column:
                return read

            def counted(mbs: Any, t: float, load: float) -> float:
                calls[0] += 1
                return read(mbs, t, load)

            return counted

    with patch.object(exudyn, "SignalClock", CountingClock):
        yield calls


def _mujoco_calls(model: Any) -> int:
    """Number of force evaluations, from MuJoCo's timers."""
    import mujoco

    return int(model.data.timer[mujoco.mjtTimer.mjTIMER_ACTUATION].number)


def counted_calls(engine: str, assembly: Assembly, settings: Settings) -> tuple[int, int]:
    """Force calls of one run in Exudyn or MuJoCo: as counted from outside, and as twinrig reports them."""
    if engine == "mujoco":
        model: Any = build(engine, assembly, settings)
        reported_calls = model.run().counts["force calls"]
        return _mujoco_calls(model), reported_calls
    with _counted_loads() as calls:
        reported_calls = build(engine, assembly, settings).run().counts["force calls"]
    return calls[0] - AT_START.get(settings.integrator, 0), reported_calls
