"""Hard cases of wheels on rails: standstill, reversal, lift-off, tiny loads and friction, extreme speeds and steps.

Every implementation marches the equations of motion that it writes itself; creep forces are the same compiled ones.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import InputError, RunFailed
from models.rail import equations as eq
from models.rail import wheel_forces as wf
from models.rail.eigenvalues import free_wheelset
from models.rail.equations import WheelsetEquations
from models.rail.equations import WheelsetPath as Motion
from models.rail.wheelset import CHOSEN_WHEELSET, GRAVITY, Wheelset
from models.systems.wheelset.of_scene import equations_class as kind_of
from validation.hard_cases.case import IMPLEMENTATIONS, HardCase, OutcomeWord

ENGINE_KINDS = {name: kind_of(name) for name in IMPLEMENTATIONS}
TIME_STEP = 5e-4
FREE_WHEELSET = free_wheelset(CHOSEN_WHEELSET)
HEAVY_WHEELSET = FREE_WHEELSET.changed(mass=8000.0, spin_inertia=2500.0, yaw_inertia=8000.0)
"""Wheelsets without suspension, the second so heavy that it is stable at standstill in steps of 0.08 ms."""
STEEP_WHEELSET = CHOSEN_WHEELSET.changed(conicity=0.5)
MIRROR_SIGNS = np.array([-1.0, 1.0, -1.0, -1.0, 1.0] * 2)
"""Signs of a state's entries in the mirror image of a wheelset, left and right exchanged; its spin does not change."""


def built_wheelset(
    engine_name: str, wheelset: Wheelset = CHOSEN_WHEELSET, speed: float = 40.0, **wheelset_options: Any
) -> WheelsetEquations:
    """Equations of motion of a wheelset in an implementation, with few contact cells."""
    return ENGINE_KINDS[engine_name](wheelset, speed, **({"cells": 7} | wheelset_options))


def displaced_state(equations: WheelsetEquations, **start_values: float) -> np.ndarray:
    """Rest state with values added to entries named as in ``models.rail.equations``, such as Y."""
    state = equations.rest.copy()
    for name, value in start_values.items():
        state[getattr(eq, name)] += value
    return state


def excess_over_friction_limit(motion: Motion, friction_coefficient: float) -> float:
    """Largest tangential force divided by mu N, minus 1; infinite if a force adds energy or acts at zero friction."""
    force = np.hypot(motion.contacts["fx"], motion.contacts["fy"])
    bound = friction_coefficient * motion.contacts["load"]
    if motion.contacts["power"].max() > 0.0 or (force[bound == 0.0] > 0.0).any():
        return np.inf
    loaded = bound > 0.0
    return float(np.max(force[loaded] / bound[loaded] - 1.0, initial=0.0))


def creep_at_standstill(engine_name: str, work_folder: Path) -> float:
    """Case: a wheelset stands under a lateral force of a third of the friction limit. Error: its lateral creep speed
    (m/s)."""
    equations = built_wheelset(engine_name, HEAVY_WHEELSET, 0.0, lean=0.1)
    motion = equations.run(equations.rest, 0.04, 8e-5, 250)
    return float(abs(motion.states[-1, eq.Y] - motion.states[-2, eq.Y]) / 0.02)


def standstill_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: creepage by a speed of travel that is not regularised."""
    with np.errstate(divide="ignore"):
        return f"creepage by the speed of travel: {np.float64(1e-4) / np.float64(0.0)}"


def acceleration_jump_at_reversal(engine_name: str, work_folder: Path) -> float:
    """Case: the speed passes 0 and the limits of its regularisation. Error: largest jump of an acceleration divided by
    mu N / m."""
    jumps = []
    for middle in (-wf.REGULARISED_SPEED, 0.0, wf.REGULARISED_SPEED):
        rates_below, rates_above = (
            built_wheelset(engine_name, CHOSEN_WHEELSET, middle + speed_offset) for speed_offset in (-1e-9, 1e-9)
        )
        state = np.array([2e-3, 5e-5, 1e-4, 1e-3, 0.0, 1e-3, 0.0, 1e-3, 1e-3, 0.1])
        jumps.append(np.abs(rates_above.rates(state) - rates_below.rates(state)).max())
    return float(max(jumps) * CHOSEN_WHEELSET.mass / (CHOSEN_WHEELSET.friction * CHOSEN_WHEELSET.load))


def energy_gain_through_standstill(engine_name: str, work_folder: Path) -> float:
    """Case: runs at speeds that fall through 0. Error: relative gain of the kinetic energy of lateral motion and
    yaw."""
    state, energies = None, []
    for speed in np.linspace(0.06, -0.06, 7):
        equations = built_wheelset(engine_name, HEAVY_WHEELSET, float(speed))
        state = displaced_state(equations, Y_RATE=2e-3, YAW_RATE=2e-3) if state is None else state
        state[eq.SPIN] = -speed / HEAVY_WHEELSET.radius
        motion = equations.run(state, 0.002, 8e-5)
        if excess_over_friction_limit(motion, HEAVY_WHEELSET.friction) > 1e-12:
            return np.inf
        energies.append(
            motion.states[:, [eq.Y_RATE, eq.YAW_RATE]] ** 2 @ [HEAVY_WHEELSET.mass, HEAVY_WHEELSET.yaw_inertia]
        )
        state = motion.states[-1].copy()
    return float(np.max(energies) / energies[0][0] - 1.0)


def total_energy(motion: Motion, wheelset: Wheelset) -> np.ndarray:
    """Energy (n,) in J of a wheelset without suspension: kinetic energy, weight and contact energy."""
    _, z, roll, _, _, vy, vz, roll_rate, yaw_rate, spin = motion.states.T
    turning = wheelset.yaw_inertia * (roll_rate**2 + (yaw_rate * np.cos(roll)) ** 2) + wheelset.spin_inertia * spin**2
    pressed = 0.4 * (motion.contacts["load"] * motion.contacts["depth"]).sum(axis=1)
    return 0.5 * (wheelset.mass * (vy**2 + vz**2) + turning) - wheelset.load * z + pressed


def energy_gain_of_fall(engine_name: str, work_folder: Path, **displacements: float) -> float:
    """Case: an elastic, frictionless wheelset falls on its rails. Error: gained energy divided by that of a fall by 1
    mm."""
    elastic = FREE_WHEELSET.changed(friction=0.0, contact_damping=0.0, flange_clearance=0.1)
    wheelset = built_wheelset(engine_name, elastic)
    motion = wheelset.run(displaced_state(wheelset, **displacements), 0.06, 5e-5)
    loads = motion.contacts["load"]
    if not ((loads == 0.0).any(axis=0) & (loads > 0.0).any(axis=0)).all():
        return np.inf  # nothing has lifted off, or nothing has landed
    gained = total_energy(motion, elastic)
    return float((gained - gained[0]).max() / (elastic.load * 1e-3))


def bounce_height(engine_name: str, work_folder: Path) -> float:
    """Case: a rolling wheelset with friction and damping is released 1 mm above its rails. Error: height by which it
    rises above the release point, divided by 1 mm."""
    wheelset = built_wheelset(engine_name, FREE_WHEELSET)
    start = displaced_state(wheelset, Z=-1e-3)
    motion = wheelset.run(start, 0.2, 1e-4)
    if excess_over_friction_limit(motion, FREE_WHEELSET.friction) > 1e-12:
        return np.inf
    return float(max(0.0, (start[eq.Z] - motion.states[:, eq.Z].min()) / 1e-3))


def light_wheelset_load(engine_name: str, work_folder: Path, mass: float) -> float:
    """Case: a wheelset of a toy's mass at rest. Error: relative difference of its wheel loads from its weight; infinite
    if creep forces exceed the friction limit."""
    toy = FREE_WHEELSET.changed(mass=mass, load=mass * GRAVITY, spin_inertia=0.1 * mass, yaw_inertia=mass)
    wheelset = built_wheelset(engine_name, toy)
    motion = wheelset.run(wheelset.rest, 2e-3, 2e-4)
    if excess_over_friction_limit(motion, toy.friction) > 1e-12:
        return np.inf
    contact = motion.contacts[-1]
    vertical_force = contact["load"] * np.cos(contact["angle"]) - contact["fy"] * np.sin(contact["angle"])
    return float(abs(vertical_force.sum() / toy.load - 1.0))


def friction_excess(engine_name: str, work_folder: Path) -> float:
    """Case: friction coefficients from 0 to 1. Error: largest relative excess of a creep force over mu N."""
    shares = []
    for mu in (0.0, 1e-6, 1e-3, 1.0):
        wheelset = built_wheelset(engine_name, CHOSEN_WHEELSET.changed(friction=mu), 60.0)
        shares.append(
            excess_over_friction_limit(
                wheelset.run(displaced_state(wheelset, Y=3e-3, YAW=3e-3), 0.05, TIME_STEP / 4.0), mu
            )
        )
    return max(shares)


def pure_spin_force_error(engine_name: str, work_folder: Path) -> float:
    """Case: steep cones roll without displacement, in pure spin. Error: sum of both lateral forces divided by mu N, and
    moments about the axle divided by mu N r."""
    wheelset = built_wheelset(engine_name, STEEP_WHEELSET, 20.0)
    contact = wheelset.run(wheelset.rest, 1e-4, 1e-4).contacts[0]
    bound = STEEP_WHEELSET.friction * contact["load"]
    if np.abs(contact["fy"] / bound).min() < 0.1:
        return np.inf
    moment = contact["fx"] * contact["z"] - contact["mz"] * np.sin(contact["angle"])
    return float(max(np.abs(moment / (bound * STEEP_WHEELSET.radius)).max(), abs(contact["fy"].sum()) / bound[0]))


def step_halving_error(
    engine_name: str, work_folder: Path, wheelset: Wheelset, speed: float, time_step: float
) -> float:
    """Case: a displaced wheelset at a speed (m/s). Error: largest difference (m, rad) from half the step (s)."""
    equations = built_wheelset(engine_name, wheelset, speed)
    start = equations.displaced_state(1e-3)
    ends = [equations.run(start, 100 * time_step, h).states[-1] for h in (time_step, time_step / 2.0)]
    return float(np.abs(ends[1] - ends[0])[: eq.ANGLE].max())


def crawling_speed_error(engine_name: str, work_folder: Path) -> float:
    """Case: a speed of 1e-6 m/s. Error: relative difference of the displacement from a standing wheelset's."""
    rest_state = built_wheelset(engine_name, HEAVY_WHEELSET, 0.0).rest
    runs = (
        built_wheelset(engine_name, HEAVY_WHEELSET, speed, lean=0.1).run(rest_state, 0.01, 8e-5)
        for speed in (0.0, 1e-6)
    )
    still, slow = (motion.states[-1, eq.Y] for motion in runs)
    return float(abs(slow / still - 1.0))


def centred_motion(engine_name: str, work_folder: Path) -> float:
    """Case: a wheelset in the middle of the track above its critical speed. Error: displacement, roll and yaw, which
    must stay 0."""
    equations = built_wheelset(engine_name, CHOSEN_WHEELSET, 80.0)
    return float(np.abs(equations.run(equations.rest, 0.3, TIME_STEP).states[:, [eq.Y, eq.ROLL, eq.YAW]]).max())


def mirror_error(engine_name: str, work_folder: Path) -> float:
    """Case: a start and its mirror image, with one wheel in the air. Error: difference of the mirrored paths."""
    equations = built_wheelset(engine_name)
    start = displaced_state(equations, Y=2e-3, Z=-7e-4, ROLL=1e-3, YAW=2e-3, ROLL_RATE=0.05, YAW_RATE=0.1)
    straight, other_path = (equations.run(state, 0.05, 1e-4).states for state in (start, MIRROR_SIGNS * start))
    return float(np.abs(straight - MIRROR_SIGNS * other_path).max())


def refusal_error(
    engine_name: str, work_folder: Path, expected_error_place: str, run_engine: Callable[[str], Any]
) -> float:
    """Case: ``run_engine`` must be refused with the name ``expected_error_place``. Error: infinite if it is not."""
    try:
        run_engine(engine_name)
    except InputError as refusal:
        if expected_error_place in refusal.place:
            raise
    return np.inf


def run_of_displaced_wheelset(
    engine_name: str,
    *,
    duration: float = 0.01,
    time_step: float = TIME_STEP,
    row_stride: int = 1,
    speed: float = 40.0,
    **displacements: float,
) -> Motion:
    """Motion of the chosen wheelset that starts displaced from rest; speed in m/s, duration and step in s."""
    wheelset = built_wheelset(engine_name, speed=speed)
    return wheelset.run(displaced_state(wheelset, **displacements), duration, time_step, row_stride)


def failing_run_error(engine_name: str, work_folder: Path, **displacements: Any) -> float:
    """Case: a run that must fail within its first half, with the time in the message. Error: infinite if it does
    not."""
    try:
        run_of_displaced_wheelset(engine_name, duration=0.1, **displacements)
    except RunFailed as failure:
        if failure.time is not None and 0.0 <= failure.time < 0.05:
            raise
    return np.inf


LANDING: dict[str, Any] = {"Z": -5e-3, "Y_RATE": 0.01, "YAW": 1e-3}


def too_large_step_naive_result(work_folder: Path) -> str:
    """Result without the guard, as text: difference of a path without the check of loads from the path with an eighth
    of the step."""
    equations, ends = built_wheelset("reference"), []
    for step in (TIME_STEP, TIME_STEP / 8.0):
        states, contacts = np.empty((1, eq.STATE_COUNT)), equations.empty_contacts(1)
        state = displaced_state(equations, **LANDING)
        equations.march_with_reports(state, (step, round(0.1 / step), 1_000_000), states, contacts)
        ends.append(state)
    return f"displaced by {1e3 * abs(ends[1][eq.Y] - ends[0][eq.Y]):.2g} mm more or less after 0.1 s"


REFUSED: dict[str, OutcomeWord] = dict.fromkeys(IMPLEMENTATIONS, "refused")
RAISED: dict[str, OutcomeWord] = dict.fromkeys(IMPLEMENTATIONS, "raised")
FAST_RUN, STEEP_RUN = dict[str, Any](speed=200.0, time_step=2e-4), dict[str, Any](speed=20.0, time_step=1e-4)
CASES = (
    HardCase(
        "wheelset that stands on a slope",
        "creepage is velocity by no speed; friction that sticks would not move",
        "creeps sideways by less than 1 mm/s",
        "m/s",
        1e-3,
        "asked for; creepage is regularised below 0.1 m/s",
        creep_at_standstill,
        naive_result=standstill_naive_result,
    ),
    HardCase(
        "speed that changes its sign",
        "the leading edge becomes the trailing one",
        "accelerations do not jump",
        "mu N / m",
        1e-5,
        "slope times 2e-9 m/s",
        acceleration_jump_at_reversal,
    ),
    HardCase(
        "reversal",
        "forces of rolling forwards and backwards are mixed",
        "lateral motion gains no energy",
        "of it",
        0.0,
        "creep forces have no power",
        energy_gain_through_standstill,
    ),
    *(
        HardCase(name, hard, "gains no energy", "of 1 mm", 1e-3, why, partial(energy_gain_of_fall, Z=-1e-3, ROLL=roll))
        for name, hard, why, roll in (
            (
                "wheelset dropped on its rails",
                "contact begins and ends within steps",
                "error of the step, 3e-4 at twice the step",
                0.0,
            ),
            (
                "one wheel lifted",
                "the wheelset lands on one wheel, then on the other",
                "Hertz' energy changes with the place of contact",
                2e-3,
            ),
        )
    ),
    HardCase(
        "wheelset that bounces and rolls",
        "creep forces come and go with the load",
        "height of release",
        "of it",
        0.0,
        "damped",
        bounce_height,
    ),
    HardCase(
        "wheelset of a kilogram",
        "patches of a quarter of a millimetre",
        "its weight",
        "",
        1e-6,
        "asked for",
        partial(light_wheelset_load, mass=1.0),
    ),
    HardCase(
        "wheelset of a milligram",
        "sinks in by less than rounding of its height",
        "says that it finds no rest",
        "",
        0.0,
        "exact",
        partial(light_wheelset_load, mass=1e-6),
        RAISED,
    ),
    HardCase(
        "friction from 0 to 1",
        "creep forces are bounded by next to nothing",
        "|F| <= mu N, no power gained",
        "mu N",
        1e-12,
        "rounding",
        friction_excess,
    ),
    HardCase(
        "steep cones at rest",
        "nothing but spin, and much of it",
        "no lateral force, no moment about the axle",
        "mu N",
        1e-9,
        "rounding of the height of rest",
        pure_spin_force_error,
    ),
    *(
        HardCase(
            name, hard, "half the step", "m", 1e-8, "error of the step", partial(step_halving_error, wheelset=w, **run)
        )
        for name, hard, w, run in (
            ("wheelset at 200 m/s", "far above its critical speed", CHOSEN_WHEELSET, FAST_RUN),
            ("conicity of 0.5", "geometry far from linear", STEEP_WHEELSET, STEEP_RUN),
        )
    ),
    HardCase(
        "wheelset at 1 micrometre per second",
        "next to singular",
        "the one that stands",
        "",
        1e-4,
        "1e-5 of the mixture",
        crawling_speed_error,
    ),
    HardCase(
        "wheelset in the middle of the track",
        "unstable: rounding grows",
        "stays there",
        "m, rad",
        1e-12,
        "rounding",
        centred_motion,
    ),
    HardCase(
        "wheelset in a mirror",
        "one wheel in the air, the other rolls",
        "mirror image",
        "SI",
        1e-11,
        "rounding",
        mirror_error,
    ),
    *(
        HardCase(
            name,
            hard,
            "fails, and says when",
            "",
            0.0,
            "exact",
            partial(failing_run_error, **moved),
            RAISED,
            naive_result=naive,
        )
        for name, hard, moved, naive in (
            ("wheelset that derails", "geometry has no sense any more", {"YAW_RATE": 50.0}, None),
            (
                "step too large for a landing",
                "stable at rest, not under a load 12 times as large",
                LANDING,
                too_large_step_naive_result,
            ),
            ("spin of 1e300 rad/s", "finite, squares are not", {"SPIN": 1e300}, None),
        )
    ),
    *(
        HardCase(
            name,
            "a number from senseless input",
            f"refused at {place}",
            "",
            0.0,
            "exact",
            partial(refusal_error, expected_error_place=place, run_engine=run),
            REFUSED,
        )
        for name, place, run in (
            ("step of 4 ms on rails", "step", partial(run_of_displaced_wheelset, time_step=4e-3, duration=0.04)),
            ("step of 0.5 ms at standstill", "step", partial(run_of_displaced_wheelset, speed=0.0)),
            ("wheelset somewhere unknown", "state[0]", partial(run_of_displaced_wheelset, Y=np.nan)),
            ("spin that is infinite", "state[9]", partial(run_of_displaced_wheelset, SPIN=np.inf)),
            ("duration between two steps on rails", "duration", partial(run_of_displaced_wheelset, duration=0.0013)),
            ("wheelset that runs for no time", "duration", partial(run_of_displaced_wheelset, duration=0.0)),
            ("every third of twenty steps", "every", partial(run_of_displaced_wheelset, row_stride=3)),
            ("wheelset at 300 m/s", "speed", partial(run_of_displaced_wheelset, speed=300.0)),
            ("wheelset without a mass", "mass", lambda _: CHOSEN_WHEELSET.changed(mass=np.nan)),
            ("strips of two cells", "cells", lambda name: built_wheelset(name, cells=2).rest),
            ("strips of 2000 cells in an engine", "cells", lambda name: built_wheelset(name, cells=2000).rest),
        )
    ),
)
