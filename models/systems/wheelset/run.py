"""Runs of a wheelset's scene: paths, its linearisation over the speeds, the branch of limit cycles."""

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
from models.rail.eigenvalues import hunting_eigenvalue, largest_growth, root_locus, uncertainty, wavelength
from models.rail.equations import ROLL, SPIN, YAW, WheelsetPath, Y, Z
from models.rail.limit_cycle import (
    Orbit,
    SoughtQuantity,
    attained_cycle,
    bifurcation,
    guess_from_orbit,
    refined_orbit,
    solved_orbit,
)
from models.rail.linear import NoCriticalSpeed, critical_speed_or_reason
from models.systems.wheelset.assumptions import assumptions, of_branch, of_linear
from models.systems.wheelset.of_scene import (
    SPEED_SHARES,
    equations_and_start,
    equations_of,
    implementation,
    path_speeds,
    wheelset_of,
)
from models.systems.wheelset.scene import WheelsetScene
from models.systems.wheelset.stated_error import FEWEST_CELLS, with_error, with_error_of_cycles

STATES = {"y": (Y, "m"), "z": (Z, "m"), "roll": (ROLL, "rad"), "yaw": (YAW, "rad"), "spin": (SPIN, "rad/s")}
CONTACTS = {"normal": ("load", "N"), "fx": ("fx", "N"), "fy": ("fy", "N"), "mz": ("mz", "N m"), "power": ("power", "W")}
"""What is saved of every path, with its place or field and its unit."""
SPEED: SoughtQuantity = "speed"
AMPLITUDE: SoughtQuantity = "amplitude"
"""What is sought of a cycle: along a branch, and at a speed."""
PAIRS_OF_MARCHES = 11
"""Pairs of marches that linearise a return: what workers can share."""
ORBIT_CHANNELS = {
    "speed": "m/s",
    "amplitude": "m",
    "frequency": "Hz",
    "multiplier": "-",
    "error": "m/s or m",
    "frequency_error": "Hz",
}
"""What is saved of every limit cycle of a branch, with its unit."""


def run(scene: WheelsetScene, engine: str, speed: float | None = None, *, error: bool = False) -> Result:
    """Compute the path at a speed (m/s), by default the first of the scene's; the detail is its ``WheelsetPath``.

    error : whether the error of steps and cells is estimated, by further paths. What the path assumes is judged always.
    Channels are states over time and forces of the contacts over time and patch. Raises InputError or RunFailed.
    """
    speed = path_speeds(scene)[0] if speed is None else speed
    equations_and_start(scene, engine, speed)  # kept: its seconds are none of the path
    start_time = time.process_time()
    motion = path(scene, engine, speed)
    labelled = judged_path(scene, engine, speed, motion, seconds=time.process_time() - start_time)
    return with_error(labelled, scene, lambda changed_scene: path(changed_scene, engine, speed)) if error else labelled


def judged_path(scene: WheelsetScene, engine: str, speed: float, motion: WheelsetPath, **result_fields: Any) -> Result:
    """A motion as the result of a scene at a speed (m/s), with the assumptions that it breaks."""
    equations, _ = equations_and_start(scene, engine, speed)
    return with_assumptions(_labelled_result(scene, engine, motion, **result_fields), assumptions(equations))


def path(scene: WheelsetScene, engine: str, speed: float) -> WheelsetPath:
    """The motion at a speed (m/s) from the scene's displacement and yaw, at every step."""
    equations, start = equations_and_start(scene, engine, speed)
    return equations.run(start, scene.run.duration, scene.run.step)


def _labelled_result(scene: WheelsetScene, engine: str, motion: WheelsetPath, **result_fields: Any) -> Result:
    steps, time_axis = len(motion.times) - 1, Channel("time", motion.times, "s")
    channels = {name: Channel("time", motion.states[:, k], unit) for name, (k, unit) in STATES.items()}
    channels |= {
        name: Channel(("time", "patch"), motion.contacts[field], unit) for name, (field, unit) in CONTACTS.items()
    }
    counts = {"steps": steps, "force calls": 4 * steps}
    return result(scene, channels, {"time": time_axis}, engine=engine, counts=counts, detail=motion, **result_fields)


def over_speeds(paths: Mapping[str, Mapping[Any, Result]]) -> Result:
    """Results by engine and speed (m/s), joined to one result over engine, speed and time."""
    by_engine = {engine: joined_result(join_results(path, "speed"), at_speeds(path)) for engine, path in paths.items()}
    joined = joined_result(join_results(by_engine, "engine"), by_engine)
    joined.data["speed"].attrs["units"] = "m/s"
    return joined


def at_speeds(results: Mapping[Any, Result]) -> dict[str, Result]:
    """Results of one engine by speed, with text such as "20 m/s" as keys."""
    return {f"{speed:g} m/s": result for speed, result in results.items()}


@dataclass(frozen=True, eq=False)
class Linear:
    """Linearised motion. values (speeds, 9) : eigenvalues in 1/s at speeds (m/s); wavelength (m) : of the free
    wheelset; critical_speed : critical speed (m/s), None if there is none; no_critical_reason : the reason.
    """

    speeds: np.ndarray
    values: np.ndarray
    wavelength: float
    critical_speed: float | None
    no_critical_reason: str

    @property
    def hunting(self) -> np.ndarray:
        """Eigenvalue (speeds,) of the least damped oscillation in 1/s."""
        return hunting_eigenvalue(self.values)


def linearised_result(scene: WheelsetScene, engine: str, *, error: bool = False) -> Result:
    """Eigenvalues over the scene's speeds with linear creep; the result's detail is ``Linear``.

    error : whether the error of the finite differences of the linearisation is estimated, at the last speed.
    """
    kind, wheelset, speeds = implementation(engine), wheelset_of(scene), scene.speeds.all()
    linear = Linear(
        speeds,
        root_locus(kind, wheelset, speeds),
        wavelength(kind, wheelset),
        *critical_speed_or_reason(wheelset, partial(largest_growth, kind)),
    )
    channels = {
        name: Channel(("speed", "eigenvalue"), part_of_values, "1/s")
        for name, part_of_values in (("real", linear.values.real), ("imag", linear.values.imag))
    }
    labelled = result(scene, channels, {"speed": Channel("speed", speeds, "m/s")}, engine=engine, detail=linear)
    with_assumptions(labelled, of_linear(wheelset))
    left = hunting_uncertainty(kind, wheelset, float(speeds[-1])) if error else math.nan
    if math.isfinite(left):
        estimate_of_hunting = Estimate(left, "1/s", left / abs(linear.hunting[-1]), 4.0, 1.0)
        with_stated_errors(
            labelled,
            {"hunting eigenvalue": estimate_of_hunting},
            "differences over twice the way at the last speed",
            "times the way",
        )
    return labelled


def branch_result(
    scene: WheelsetScene, progress: Callable[[int], Any] = lambda count: None, *, error: bool = False
) -> Result:
    """Limit cycles in the order of rising amplitude, within the scene's speeds, by the written equations; the detail is
    their orbits.

    Where no branch begins because nothing is stable, cycles that motions reach at these speeds. Why it ends or never
    begins is a doubt. The scene's workers compute what linearises. progress : called with the number of cycles after
    each; error : whether one is solved on half the cells, too, from which the error of the cells is estimated.
    """
    speeds, orbits, why, unknown = scene.speeds.all(), list[Orbit](), list[str](), SPEED
    equations = equations_of(scene, "reference", float(speeds[-1]))
    with Crew.of(scene, default_workers=1).at_work(PAIRS_OF_MARCHES, *folders_for_workers(scene)) as pool:
        try:
            for orbit in bifurcation(equations, float(speeds.min()), float(speeds.max()), scene.run.step, pool):
                orbits.append(orbit)
                progress(len(orbits))
        except NoCriticalSpeed as no_speed:
            why, unknown = [f"no branch begins: the wheelset {no_speed.allowed}"], AMPLITUDE
            reached = block_results(partial(_reached_cycle, scene), speeds.tolist() if no_speed.unstable else [], pool)
            orbits = [orbit for orbit in reached if orbit is not None]
        except RunFailed as failure:
            why = [f"the branch is followed no further: {failure.reason}"]
    channels = {
        name: Channel("cycle", np.array([getattr(orbit, name) for orbit in orbits]), unit)
        for name, unit in ORBIT_CHANNELS.items()
    }
    labelled = result(scene, channels, {}, engine="reference", doubts=why, detail=orbits)
    with_assumptions(labelled, of_branch(equations.wheelset))
    if error and orbits:
        middle = len(orbits) // 2
        coarse = _on_half_the_cells(scene, orbits[middle], unknown)
        with_error_of_cycles(labelled, orbits, {} if coarse is None else {middle: coarse}, unknown, scene.contact.cells)
    return labelled


def _on_half_the_cells(scene: WheelsetScene, limit_cycle: Orbit, unknown: SoughtQuantity) -> Orbit | None:
    """The limit cycle solved on half the cells, in twice the step; None where there is none."""
    if scene.contact.cells < FEWEST_CELLS:
        return None
    coarse = replace(limit_cycle, step_count=limit_cycle.step_count // 2)
    try:
        return solved_orbit(
            guess_from_orbit(coarse, replace(limit_cycle.equations, cells=coarser_cells(scene.contact.cells))),
            unknown,
            precise=False,
        )
    except RunFailed:
        return None


def _reached_cycle(scene: WheelsetScene, speed: float) -> Orbit | None:
    """The refined limit cycle that a motion reaches at a speed (m/s); None where the motion dies out."""
    orbit = _attained_in_engine(scene, speed)
    return None if orbit is None else refined_orbit(orbit, AMPLITUDE)


def _attained_in_engine(scene: WheelsetScene, speed: float) -> Orbit | None:
    return attained_cycle(
        equations_of(scene, "reference", speed), start_displacement=scene.run.displacement, step=scene.run.step
    )


def cycle_speed(scene: WheelsetScene, orbits: Sequence[Orbit]) -> float:
    """A speed (m/s) above the one at which the branch begins; the scene's last speed where there is no branch."""
    last_speed = float(scene.speeds.all().max())
    return min(last_speed, round(SPEED_SHARES[1] * orbits[0].speed, 2)) if orbits else last_speed


def cycles_of_engines(
    scene: WheelsetScene, engines: Sequence[str], speed: float, *, error: bool = False
) -> tuple[dict[str, Result], dict[str, str]]:
    """One period of the refined limit cycle at a speed (m/s) in every engine, and reasons why some engines have none.

    Each engine starts from a guess that is deliberately off. The details are the orbits. Both are empty where the
    motion dies out. error : whether each is solved on half the cells, too, from which the error of the cells is
    estimated.
    """
    results, failed = dict[str, Result](), dict[str, str]()
    first = _attained_in_engine(scene, speed)
    if first is None:
        return results, failed
    for engine in engines:
        try:
            guess = guess_from_orbit(first, equations_of(scene, engine, speed))
            orbit = refined_orbit(solved_orbit(guess, AMPLITUDE, precise=False), AMPLITUDE)
            results[engine] = _one_period(scene, engine, orbit, error)
        except RunFailed as failure:
            failed[engine] = str(failure)
    return results, failed


def _one_period(scene: WheelsetScene, engine: str, limit_cycle: Orbit, error: bool) -> Result:
    """The result of a limit cycle over one period; its detail is the orbit."""
    labelled = with_assumptions(_labelled_result(scene, engine, limit_cycle.path()), assumptions(limit_cycle.equations))
    period = Result(over_speeds({engine: {limit_cycle.speed: labelled}}).data, limit_cycle)
    if not error:
        return period
    coarse = _on_half_the_cells(scene, limit_cycle, AMPLITUDE)
    return with_error_of_cycles(
        period, [limit_cycle], {} if coarse is None else {0: coarse}, AMPLITUDE, scene.contact.cells
    )
