"""Runs of a wheelset scene: simulated motions, eigenvalues over the speed, the branch of limit cycles."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from models.contact.accuracy import coarser_cells
from models.core.assumptions import with_assumptions
from models.core.discretisation import Estimate, with_stated_errors
from models.core.errors import RunFailed
from models.core.result import Channel, Result, join_results, result
from models.core.told import joined_result
from models.ensemble.runner import block_results
from models.ensemble.workers import Crew, folders_for_workers
from models.rail.eigenvalues import (
    hunting_eigenvalue,
    hunting_uncertainty,
    hunting_wavelength,
    largest_growth_rate,
    root_locus,
)
from models.rail.equations import ROLL, SPIN, YAW, WheelsetPath, Y, Z
from models.rail.limit_cycle import (
    Orbit,
    SoughtQuantity,
    attained_limit_cycle,
    bifurcation_orbit,
    guess_from_orbit,
    refined_orbit,
    solved_orbit,
)
from models.rail.linear import NoCriticalSpeed, critical_speed_or_reason
from models.systems.wheelset.assumptions import assumptions, branch_assumptions, linear_motion_assumptions
from models.systems.wheelset.of_scene import (
    SPEED_SHARES,
    equations_and_start,
    equations_class,
    equations_of,
    path_speeds,
    wheelset_of,
)
from models.systems.wheelset.scene import WheelsetScene
from models.systems.wheelset.stated_error import FEWEST_CELLS, with_error, with_error_of_cycles

STATE_CHANNELS = {"y": (Y, "m"), "z": (Z, "m"), "roll": (ROLL, "rad"), "yaw": (YAW, "rad"), "spin": (SPIN, "rad/s")}
CONTACT_CHANNELS = {
    "normal": ("load", "N"),
    "fx": ("fx", "N"),
    "fy": ("fy", "N"),
    "mz": ("mz", "N m"),
    "power": ("power", "W"),
}
"""Channels of every path: states with their index, quantities of the contact patches with their field, and units."""
SPEED: SoughtQuantity = "speed"
AMPLITUDE: SoughtQuantity = "amplitude"
"""Unknown that is solved for in a limit cycle: the speed along a branch, the amplitude at a given speed."""
TIMED_MARCH_PAIR_COUNT = 11
"""Pairs of simulated periods, displaced to both sides, whose differences linearise a limit cycle; worker processes
share them.
"""
ORBIT_CHANNELS = {
    "speed": "m/s",
    "amplitude": "m",
    "frequency": "Hz",
    "multiplier": "-",
    "error": "m/s or m",
    "frequency_error": "Hz",
}
"""Channels over the limit cycles of a branch, with their units."""


def run(scene: WheelsetScene, engine: str, speed: float | None = None, *, error: bool = False) -> Result:
    """Simulate the wheelset at a speed (m/s), by default the scene's first; the result's detail is the
    ``WheelsetPath``.

    error : whether the errors of time steps and cells are estimated, by further paths; assumptions are checked always.
    Channels are states over time and forces of the contacts over time and patch. Raises InputError or RunFailed.
    """
    speed = path_speeds(scene)[0] if speed is None else speed
    equations_and_start(scene, engine, speed)  # kept: its seconds are none of the path
    start_time = time.process_time()
    motion = simulated_path(scene, engine, speed)
    labelled = path_result(scene, engine, speed, motion, seconds=time.process_time() - start_time)
    return (
        with_error(labelled, scene, lambda changed_scene: simulated_path(changed_scene, engine, speed))
        if error
        else labelled
    )


def path_result(
    scene: WheelsetScene, engine: str, speed: float, wheelset_path: WheelsetPath, **result_fields: Any
) -> Result:
    """Returns the result of a simulated motion at a speed (m/s), with the assumptions that the motion breaks."""
    equations, _ = equations_and_start(scene, engine, speed)
    return with_assumptions(_labelled_result(scene, engine, wheelset_path, **result_fields), assumptions(equations))


def simulated_path(scene: WheelsetScene, engine: str, speed: float) -> WheelsetPath:
    """Simulate the wheelset at a speed (m/s) from the scene's initial displacement and yaw; states at every step."""
    equations, start = equations_and_start(scene, engine, speed)
    return equations.run(start, scene.run.duration, scene.run.step)


def _labelled_result(scene: WheelsetScene, engine: str, wheelset_path: WheelsetPath, **result_fields: Any) -> Result:
    steps, time_axis = len(wheelset_path.times) - 1, Channel("time", wheelset_path.times, "s")
    channels = {name: Channel("time", wheelset_path.states[:, k], unit) for name, (k, unit) in STATE_CHANNELS.items()}
    channels |= {
        name: Channel(("time", "patch"), wheelset_path.contacts[field], unit)
        for name, (field, unit) in CONTACT_CHANNELS.items()
    }
    counts = {"steps": steps, "force calls": 4 * steps}
    return result(
        scene, channels, {"time": time_axis}, engine=engine, counts=counts, detail=wheelset_path, **result_fields
    )


def over_speeds(results_by_engine: Mapping[str, Mapping[Any, Result]]) -> Result:
    """Join results by engine and speed (m/s) to one result over engine, speed and time."""
    by_engine = {
        engine: joined_result(join_results(path, "speed"), results_by_speed_text(path))
        for engine, path in results_by_engine.items()
    }
    joined = joined_result(join_results(by_engine, "engine"), by_engine)
    joined.data["speed"].attrs["units"] = "m/s"
    return joined


def results_by_speed_text(results_by_speed: Mapping[Any, Result]) -> dict[str, Result]:
    """Results of one engine with their speeds as text keys, such as "20 m/s"."""
    return {f"{speed:g} m/s": result for speed, result in results_by_speed.items()}


@dataclass(frozen=True, eq=False)
class LinearisedMotion:
    """Linearised motion of a wheelset. values (speeds, 9) : eigenvalues (1/s) at the speeds (m/s); wavelength : of the
    free wheelset (m); critical_speed : m/s, None if there is none; no_critical_reason : why there is none.
    """

    speeds: np.ndarray
    values: np.ndarray
    wavelength: float
    critical_speed: float | None
    no_critical_reason: str

    @property
    def hunting_eigenvalue(self) -> np.ndarray:
        """Eigenvalue (speeds,) in 1/s of the least damped oscillation, the hunting motion."""
        return hunting_eigenvalue(self.values)


def linearised_result(scene: WheelsetScene, engine: str, *, estimate_error: bool = False) -> Result:
    """Compute eigenvalues over the scene's speeds with linear creep; the result's detail is ``LinearisedMotion``.

    estimate_error : whether the error of the finite differences of the linearisation is estimated, at the last speed.
    """
    kind, wheelset, speeds = equations_class(engine), wheelset_of(scene), scene.speeds.all()
    linear = LinearisedMotion(
        speeds,
        root_locus(kind, wheelset, speeds),
        hunting_wavelength(kind, wheelset),
        *critical_speed_or_reason(wheelset, partial(largest_growth_rate, kind)),
    )
    channels = {
        name: Channel(("speed", "eigenvalue"), part_of_values, "1/s")
        for name, part_of_values in (("real", linear.values.real), ("imag", linear.values.imag))
    }
    labelled = result(scene, channels, {"speed": Channel("speed", speeds, "m/s")}, engine=engine, detail=linear)
    with_assumptions(labelled, linear_motion_assumptions(wheelset))
    left = hunting_uncertainty(kind, wheelset, float(speeds[-1])) if estimate_error else math.nan
    if math.isfinite(left):
        estimate_of_hunting = Estimate(left, "1/s", left / abs(linear.hunting_eigenvalue[-1]), 4.0, 1.0)
        with_stated_errors(
            labelled,
            {"hunting eigenvalue": estimate_of_hunting},
            "differences over twice the way at the last speed",
            "times the way",
        )
    return labelled


def branch_result(
    scene: WheelsetScene, report_progress: Callable[[int], Any] = lambda count: None, *, estimate_error: bool = False
) -> Result:
    """Compute the branch of limit cycles by the reference's equations, in the order of rising amplitude, within the
    scene's speeds; the result's detail is the list of orbits.

    Where no branch begins because the wheelset is unstable at all speeds, the cycles are those that motions reach at
    these speeds. Why the branch ends or never begins is a doubt. The scene's worker processes compute linearisations.
    report_progress : called after each cycle with the number of cycles; estimate_error : whether one cycle is also
    solved on half the cells, from which the error of the cells is estimated.
    """
    speeds, orbits, why, unknown = scene.speeds.all(), list[Orbit](), list[str](), SPEED
    equations = equations_of(scene, "reference", float(speeds[-1]))
    with Crew.of(scene, default_workers=1).at_work(TIMED_MARCH_PAIR_COUNT, *folders_for_workers(scene)) as pool:
        try:
            for orbit in bifurcation_orbit(equations, float(speeds.min()), float(speeds.max()), scene.run.step, pool):
                orbits.append(orbit)
                report_progress(len(orbits))
        except NoCriticalSpeed as no_speed:
            why, unknown = [f"no branch begins: the wheelset {no_speed.allowed}"], AMPLITUDE
            reached = block_results(
                partial(_cycle_reached_at_speed, scene), speeds.tolist() if no_speed.unstable else [], pool
            )
            orbits = [orbit for orbit in reached if orbit is not None]
        except RunFailed as failure:
            why = [f"the branch is followed no further: {failure.reason}"]
    channels = {
        name: Channel("cycle", np.array([getattr(orbit, name) for orbit in orbits]), unit)
        for name, unit in ORBIT_CHANNELS.items()
    }
    labelled = result(scene, channels, {}, engine="reference", doubts=why, detail=orbits)
    with_assumptions(labelled, branch_assumptions(equations.wheelset))
    if estimate_error and orbits:
        middle = len(orbits) // 2
        coarse = _cycle_on_half_the_cells(scene, orbits[middle], unknown)
        with_error_of_cycles(labelled, orbits, {} if coarse is None else {middle: coarse}, unknown, scene.contact.cells)
    return labelled


def _cycle_on_half_the_cells(scene: WheelsetScene, limit_cycle: Orbit, sought_quantity: SoughtQuantity) -> Orbit | None:
    """Returns the limit cycle solved on half the cells, in twice the time step; None where there is no solution."""
    if scene.contact.cells < FEWEST_CELLS:
        return None
    coarse = replace(limit_cycle, step_count=limit_cycle.step_count // 2)
    try:
        return solved_orbit(
            guess_from_orbit(coarse, replace(limit_cycle.equations, cells=coarser_cells(scene.contact.cells))),
            sought_quantity,
            is_precise=False,
        )
    except RunFailed:
        return None


def _cycle_reached_at_speed(scene: WheelsetScene, speed: float) -> Orbit | None:
    """Returns the refined limit cycle that a motion reaches at a speed (m/s); None where the motion dies out."""
    orbit = _attained_in_engine(scene, speed)
    return None if orbit is None else refined_orbit(orbit, AMPLITUDE)


def _attained_in_engine(scene: WheelsetScene, speed: float) -> Orbit | None:
    """Returns the limit cycle that a motion in the reference reaches at a speed (m/s), or None where it dies out."""
    return attained_limit_cycle(
        equations_of(scene, "reference", speed), initial_displacement=scene.run.displacement, time_step=scene.run.step
    )


def cycle_speed(scene: WheelsetScene, limit_cycles: Sequence[Orbit]) -> float:
    """Returns 1.1 times the speed (m/s) at which the branch begins, at most the scene's last speed; without a branch
    that last speed.
    """
    last_speed = float(scene.speeds.all().max())
    return min(last_speed, round(SPEED_SHARES[1] * limit_cycles[0].speed, 2)) if limit_cycles else last_speed


def cycles_of_engines(
    scene: WheelsetScene, engines: Sequence[str], speed: float, *, estimate_error: bool = False
) -> tuple[dict[str, Result], dict[str, str]]:
    """Solve the limit cycle at a speed (m/s) in every engine. Returns the results over one period by engine, and the
    reasons of failures by engine.

    Each engine starts from a guess that is deliberately off. Details of the results are the orbits. Both are empty
    where the motion dies out. estimate_error : whether each cycle is also solved on half the cells, from which the
    error of the cells is estimated.
    """
    results, failed = dict[str, Result](), dict[str, str]()
    first = _attained_in_engine(scene, speed)
    if first is None:
        return results, failed
    for engine in engines:
        try:
            guess = guess_from_orbit(first, equations_of(scene, engine, speed))
            orbit = refined_orbit(solved_orbit(guess, AMPLITUDE, is_precise=False), AMPLITUDE)
            results[engine] = _one_period_result(scene, engine, orbit, estimate_error)
        except RunFailed as failure:
            failed[engine] = str(failure)
    return results, failed


def _one_period_result(scene: WheelsetScene, engine: str, limit_cycle: Orbit, estimate_error: bool) -> Result:
    """Returns the result of a limit cycle over one period; its detail is the orbit."""
    labelled = with_assumptions(_labelled_result(scene, engine, limit_cycle.path()), assumptions(limit_cycle.equations))
    period = Result(over_speeds({engine: {limit_cycle.speed: labelled}}).data, limit_cycle)
    if not estimate_error:
        return period
    coarse = _cycle_on_half_the_cells(scene, limit_cycle, AMPLITUDE)
    return with_error_of_cycles(
        period, [limit_cycle], {} if coarse is None else {0: coarse}, AMPLITUDE, scene.contact.cells
    )
