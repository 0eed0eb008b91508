"""Cost of the time loop of scenes without effects beside hand-written loops: computing time and allocated arrays."""

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
from validation.absence.bare_cars import car_runs
from validation.absence.bare_rides import copy_runs, ride_runs
from validation.absence.of_systems import bare_scene
from validation.common.rows import Observed, Row, System

SYSTEM: System = "effects"
STEP, SHORT_RUN_STEPS = 5e-4, 40
"""Step of the wheelset's runs (s); number of steps of the shorter of two runs whose allocated arrays are compared."""


def allocated_arrays(compiled_run: Callable[[], Any]) -> int:
    """Number of arrays that compiled code allocates while a function runs, as counted by numba."""
    _nrt_python.memsys_enable_stats()
    try:
        arrays_before = rtsys.get_allocation_stats().alloc
        compiled_run()
        return int(rtsys.get_allocation_stats().alloc - arrays_before)
    finally:
        _nrt_python.memsys_disable_stats()


def bare_wheelsets(step_count: int) -> tuple[Callable[[], WheelsetPath], Callable[[], WheelsetPath]]:
    """Two functions that simulate the same wheelset without effects: by twinrig and by hand-written code for linear
    creep on cones. Both check the path in the same way, and return states and contacts."""
    equations, times = (
        equations_of(bare_scene("wheelset"), "reference", wheelset.SPEED),
        STEP * np.arange(step_count + 1),
    )
    start = equations.displaced_state(1e-3)
    theirs = hand_built_wheelset.run(equations.wheelset, start, wheelset.SPEED, STEP, step_count)

    def run_hand_built() -> WheelsetPath:
        states, contacts = theirs()
        path = WheelsetPath(times, states, contacts=contacts)
        equations.check(path, STEP, 1)
        return path

    return lambda: equations.run(start, step_count * STEP, STEP), run_hand_built


def ratio_of_wheelsets(step_count: int, round_count: int) -> tuple[float, tuple[float, float, float]]:
    """Largest difference of states (m, rad, m/s, rad/s) and contact forces (divided by the load) between twinrig's
    wheelset and the hand-written one, and the ratio of their computing times with its confidence interval."""
    jobs = bare_wheelsets(step_count)
    ours, theirs = (job() for job in jobs)
    gaps = [np.abs(ours.contacts[name] - theirs.contacts[name]).max() for name in ("load", "fx", "fy", "mz")]
    force_gap = max(gaps) / theirs.contacts["load"].max()
    gap = max(np.abs(ours.states - theirs.states).max(), force_gap)
    return float(gap), paired_ratio(*interleave(jobs, round_count, clock=time.process_time))


def added_arrays(
    make_run_of_steps: Callable[[int], Callable[[], Any]],
    shorter_step_count: int = SHORT_RUN_STEPS,
    longer_step_count: int = 10 * SHORT_RUN_STEPS,
) -> int:
    """How many more arrays a run of ``longer_step_count`` steps allocates than a run of ``shorter_step_count`` steps.
    ``make_run_of_steps(step_count)`` returns the function that runs.
    """
    jobs = [make_run_of_steps(steps) for steps in (shorter_step_count, longer_step_count)]
    for warm in jobs:
        warm()
    arrays_of_short, arrays_of_long = map(allocated_arrays, jobs)
    return arrays_of_long - arrays_of_short


def arrays_added_by_wheelset(run_index: int) -> int:
    """How many more arrays a longer run of the wheelset without effects allocates; run_index 0: twinrig, 1:
    hand-written code."""
    return added_arrays(lambda steps: bare_wheelsets(steps)[run_index])


def arrays_added_by_ride() -> int:
    """How many more arrays a longer run of the ride scene without effects allocates: in MuJoCo, where all its forces
    are compiled, and as linear Monte Carlo copies."""
    return added_arrays(lambda steps: ride_runs("mujoco", steps)[0]) + added_arrays(lambda steps: copy_runs(steps)[0])


def arrays_added_by_car() -> int:
    """How many more arrays a longer run of the handling scene's car without effects allocates in MuJoCo."""
    return added_arrays(lambda steps: car_runs(steps)[0])


def arrays_added_by_hubs(engine: str) -> int:
    """How many more arrays a longer run of a vehicle on prescribed hub forces allocates in an engine, without
    effects."""
    scene = bare_scene("hub-forces")
    step_count = hub_forces.STEP_COUNT
    return added_arrays(lambda steps: hub_forces.scene_run(scene, engine, steps), step_count // 4, step_count)


def arrays_added_by_braking(engine: str) -> tuple[int, int]:
    """How many more arrays a longer stop of a braked vehicle without effects allocates, and by how many samples the
    stop is longer."""
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
    """Report rows: numbers of arrays that the time loops of scenes without effects allocate, which must be 0."""
    braking_arrays, samples = zip(*map(arrays_added_by_braking, braking.ENGINES), strict=True)
    why = "a short run against a long one, by the count of numba's own memory; no effect is there that could make one"
    counted = {
        "wheelset": ("360 more steps of a bare wheelset make", arrays_added_by_wheelset(0)),
        "ride": ("360 more steps of a bare ride make in MuJoCo and as copies", arrays_added_by_ride()),
        "handling": ("360 more steps of a bare car make in MuJoCo", arrays_added_by_car()),
        "hub-forces": (
            "15 more steps of a bare vehicle driven by its hub forces make in the reference, Exudyn and MuJoCo "
            "together",
            sum(map(arrays_added_by_hubs, hub_forces.ENGINES)),
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
