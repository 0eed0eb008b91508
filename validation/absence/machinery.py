"""Cost of the loop of a bare scene beside a loop written for that scene alone: seconds, and arrays made."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numba.core.runtime import _nrt_python, rtsys  # type: ignore[attr-defined]

from models.machine.timing import interleave, paired_ratio
from models.rail.equations import WheelsetPath
from models.systems.wheelset.of_scene import equations_of
from validation.absence import braking, hand_built_wheelset, hub_forces, wheelset
from validation.absence.bare_cars import cars
from validation.absence.bare_rides import copies, rides
from validation.absence.of_systems import bare_scene
from validation.common.rows import Observed, Row, System

SYSTEM: System = "effects"
STEP, SHORT_RUN_STEPS = 5e-4, 40
"""Step of the wheelset's runs (s); steps of the shorter one of two that are counted."""


def allocated_arrays(job: Callable[[], Any]) -> int:
    """Number of arrays that compiled code allocates during a job, as counted by numba."""
    _nrt_python.memsys_enable_stats()
    try:
        arrays_before = rtsys.get_allocation_stats().alloc
        job()
        return int(rtsys.get_allocation_stats().alloc - arrays_before)
    finally:
        _nrt_python.memsys_disable_stats()


def bare_wheelsets(steps: int) -> tuple[Callable[[], WheelsetPath], Callable[[], WheelsetPath]]:
    """Two runs of the bare wheelset, by twinrig and by code written for linear creep on cones alone. Both check the
    path in the same way, and give states and contacts."""
    equations, times = equations_of(bare_scene("wheelset"), "reference", wheelset.SPEED), STEP * np.arange(steps + 1)
    start = equations.displaced_state(1e-3)
    theirs = hand_built_wheelset.run(equations.wheelset, start, wheelset.SPEED, STEP, steps)

    def written() -> WheelsetPath:
        states, contacts = theirs()
        path = WheelsetPath(times, states, contacts=contacts)
        equations.check(path, STEP, 1)
        return path

    return lambda: equations.run(start, steps * STEP, STEP), written


def ratio_of_wheelsets(steps: int, round_count: int) -> tuple[float, tuple[float, float, float]]:
    """Largest difference of states (m, rad, m/s, rad/s) and contact forces (ratio to the load) between twinrig's
    wheelset and the hand-written one; ratio of their computing times."""
    jobs = bare_wheelsets(steps)
    ours, theirs = (job() for job in jobs)
    gaps = [np.abs(ours.contacts[name] - theirs.contacts[name]).max() for name in ("load", "fx", "fy", "mz")]
    force_gap = max(gaps) / theirs.contacts["load"].max()
    gap = max(np.abs(ours.states - theirs.states).max(), force_gap)
    return float(gap), paired_ratio(*interleave(jobs, round_count, clock=time.process_time))


def arrays_per_steps(
    job: Callable[[int], Callable[[], Any]], short_steps: int = SHORT_RUN_STEPS, long_steps: int = 10 * SHORT_RUN_STEPS
) -> int:
    """How many more arrays a job allocates in ``long_steps`` steps than in ``short_steps`` ones; ``job(steps)`` builds
    the job.
    """
    jobs = [job(steps) for steps in (short_steps, long_steps)]
    for warm in jobs:
        warm()
    arrays_of_short, arrays_of_long = map(allocated_arrays, jobs)
    return arrays_of_long - arrays_of_short


def made_by_wheelset(which: int) -> int:
    """How many more arrays a longer run allocates: 0 for twinrig's bare wheelset, 1 for the hand-written one."""
    return arrays_per_steps(lambda steps: bare_wheelsets(steps)[which])


def made_by_ride() -> int:
    """How many more arrays a longer run of the bare ride allocates: in MuJoCo, where all its forces are compiled, and
    as linear copies."""
    return arrays_per_steps(lambda steps: rides("mujoco", steps)[0]) + arrays_per_steps(lambda steps: copies(steps)[0])


def made_by_car() -> int:
    """How many more arrays a longer run of the bare car of ``handling`` allocates in MuJoCo."""
    return arrays_per_steps(lambda steps: cars(steps)[0])


def made_by_hubs(engine: str) -> int:
    """How many more arrays a longer run of a bare vehicle driven by hub forces allocates."""
    scene = bare_scene("hub-forces")
    step_count = hub_forces.STEPS
    step_count = hub_forces.STEPS
    return arrays_per_steps(lambda steps: hub_forces.job(scene, engine, steps), step_count // 4, step_count)


def made_by_braking(engine: str) -> tuple[int, int]:
    """How many more arrays a longer run of a bare braked vehicle allocates, and by how many samples it is longer."""
    from models.systems.braking.run import run

    slow, fast = (
        bare_scene("braking", procedures={braking.STOP: {"kind": "j_turn", "speed": speed, "steer": 0.02}})
        for speed in (1.0, 3.0)
    )
    samples, counts = [], []
    for scene in (slow, fast):
        samples.append(len(run(scene, engine).times))
        counts.append(allocated_arrays(partial(run, scene, engine)))
    return counts[1] - counts[0], samples[1] - samples[0]


def rows() -> list[Row]:
    """Report rows: numbers of arrays that the time loops of bare scenes allocate, which must be none."""
    braking_arrays, samples = zip(*map(made_by_braking, braking.ENGINES), strict=True)
    why = "a short run against a long one, by the count of numba's own memory; no effect is there that could make one"
    counted = {
        "wheelset": ("360 more steps of a bare wheelset make", made_by_wheelset(0)),
        "ride": ("360 more steps of a bare ride make in MuJoCo and as copies", made_by_ride()),
        "handling": ("360 more steps of a bare car make in MuJoCo", made_by_car()),
        "hub-forces": (
            "15 more steps of a bare vehicle driven by its hub forces make in the reference, Exudyn and MuJoCo "
            "together",
            sum(map(made_by_hubs, hub_forces.ENGINES)),
        ),
        "braking": (
            f"{samples[0]} more samples of a bare braked vehicle make in compiled code of the reference, Exudyn and "
            "MuJoCo together, in four steps each",
            sum(braking_arrays),
        ),
    }
    return [
        Observed(f"absent.{name}.arrays", SYSTEM, f"arrays that {cause}", count, "").at_most(0, why, "none")
        for name, (cause, count) in counted.items()
    ]
