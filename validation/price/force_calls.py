"""Independent counts of force evaluations: by calls of a load function in Exudyn, and by MuJoCo's timers.

They check the number of force calls that twinrig reports for a run.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from unittest.mock import patch

from models.engines.assembly import Assembly, Settings
from models.engines.protocol import build

START_FORCE_CALLS = {"VelocityVerlet": 1, "GeneralizedAlpha": 1, "TrapezoidalIndex2": 1}
"""Force evaluations before the first step, for the start accelerations of a method; twinrig does not report them."""


@contextmanager
def _counting_load_calls() -> Iterator[list[int]]:
    """Context that counts the calls of the first load in every Exudyn model built within it; yields the count in a
    list."""
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


def _mujoco_calls(mujoco_run: Any) -> int:
    """Number of force evaluations of a run, from MuJoCo's timers."""
    import mujoco

    return int(mujoco_run.data.timer[mujoco.mjtTimer.mjTIMER_ACTUATION].number)


def counted_calls(engine: str, assembly: Assembly, run_settings: Settings) -> tuple[int, int]:
    """Number of force calls of one run in Exudyn or MuJoCo: counted independently, and as twinrig reports it."""
    if engine == "mujoco":
        model: Any = build(engine, assembly, run_settings)
        reported_calls = model.run().counts["force calls"]
        return _mujoco_calls(model), reported_calls
    with _counting_load_calls() as calls:
        reported_calls = build(engine, assembly, run_settings).run().counts["force calls"]
    return calls[0] - START_FORCE_CALLS.get(run_settings.integrator, 0), reported_calls
