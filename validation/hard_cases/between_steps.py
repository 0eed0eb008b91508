"""Hard cases of what happens between the steps of a run or the samples of a signal: stiff springs and stops, fast
drivers, short waves, slow filters.

Each was answered once by finite numbers that were wrong by a hundredth to all of themselves.
"""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from models.brake.controllers import CONTROLLERS
from models.core.discretisation import error_estimates_of
from models.core.errors import InputError
from models.core.noise import normal_samples
from models.core.signals import signal_from_samples
from models.core.smoothing import low_passed
from models.fatigue.counting import level_crossings
from models.rail.wheelset import CHOSEN_WHEELSET
from models.sensors.rotations import integrate_attitude
from models.systems.handling.run import principal_series, run
from models.systems.handling.scene import HandlingScene, build
from models.systems.hub_forces.run import run as run_on_hubs
from models.systems.hub_forces.scene import build as build_hubs
from validation.braking.braked_trucks import braking_scene
from validation.hard_cases.case import IMPLEMENTATIONS, HardCase, OutcomeWord
from validation.hard_cases.rolling import TIME_STEP, built_wheelset

HANDLING_OUTCOMES: dict[str, OutcomeWord] = {"reference": "refused"}
"""Expected outcome of the reference in handling cases, which only the engines can run."""


def released_wheelset_case(
    speed: float = 60.0, yaw: float = 0.0, **wheelset_changes: float
) -> Callable[[str, Path], float]:
    """Case: a wheelset is released 5 mm off centre and runs for 0.2 s. Error: difference of its final lateral position
    and yaw (m, rad) from a run with a quarter of the step."""

    def error(engine_name: str, work_folder: Path) -> float:
        equations = built_wheelset(engine_name, CHOSEN_WHEELSET.changed(**wheelset_changes), speed)
        start = equations.displaced_state(5e-3)
        start[3] = yaw
        ends = [equations.run(start, 0.2, step).states[-1] for step in (TIME_STEP, TIME_STEP / 4.0)]
        return float(np.abs(ends[1] - ends[0])[[0, 3]].max())

    return error


def car_scene(time_step: float = 1e-3, **manoeuvre: Any) -> HandlingScene:
    """Scene of a car with 19 degrees of freedom in a manoeuvre of 0.2 s; step in s."""
    driven = {"hard": {"speed": 20.0, "duration": 0.2} | manoeuvre}
    return build({"title": "hard", "system": "handling", "run": {"step": time_step}, "manoeuvres": driven})


def manoeuvre_case(**manoeuvre: Any) -> Callable[[str, Path], float]:
    """Case: a car in a manoeuvre. Error: difference of its final coordinates (m, rad) from a run with a quarter of the
    step."""

    def error(engine_name: str, work_folder: Path) -> float:
        if engine_name == "reference":
            raise InputError("", "engine", engine_name, "handling is marched by engines")
        ends = [run(car_scene(step, **manoeuvre), engine_name)["positions"][-1] for step in (1e-3, 2.5e-4)]
        return float(np.abs(ends[1] - ends[0]).max())

    return error


def refused_case(run_case: Callable[[], Any]) -> Callable[[str, Path], float]:
    """Case: ``run_case`` must raise a refusal. Error: infinite if it returns."""

    def error(engine_name: str, work_folder: Path) -> float:
        run_case()
        return np.inf

    return error


def hubs_over_waves_error(engine_name: str, work_folder: Path) -> float:
    """Case: hub forces of a road at 60 m/s in steps of 20 ms, each of which passes three waves; it must fail. Error:
    infinite if it does not."""
    table = {
        "title": "hard",
        "system": "hub-forces",
        "vehicle": {"file": "r19_free"},
        "road": {"speed": 60.0},
        "run": {"duration": 1.0, "step": 0.02},
        "forces": {"sampling_rate": 50.0},
    }
    run_on_hubs(build_hubs(table), engine_name, error=True)
    return np.inf


def error_ratio_over_waves(engine_name: str, work_folder: Path) -> float:
    """Case: a car on a rough road at 1000 m/s in steps of 1 ms. Error: true error (against a tenth of the step) divided
    by the stated error in the worst channel; infinite unless the stated error is a warning."""
    if engine_name == "reference":
        raise InputError("", "engine", engine_name, "handling is marched by engines")
    stated_run = run(car_scene(speed=1000.0, rough=True), engine_name, error=True)
    name, estimate = max(error_estimates_of(stated_run).items(), key=lambda each: each[1].share)
    fine = principal_series(run(car_scene(1e-4, speed=1000.0, rough=True), engine_name).detail).channels[name][::10]
    error_of_values = principal_series(stated_run.detail).channels[name] - fine
    return float(np.sqrt(np.mean(error_of_values**2))) / estimate.error if estimate.warned else np.inf


def level_crossing_error(engine_name: str, work_folder: Path) -> float:
    """Case: level crossings counted for unsorted levels. Error: difference from counting level by level."""
    load, levels = np.array([0.0, 3.0, 1.0, 5.0, 0.0, 2.0, 1.0, 4.0]), np.array([2.5, 0.5, 3.5, 1.5])
    rises = [sum(a < level <= b for a, b in pairwise(load)) for level in levels]
    return float(np.abs(level_crossings(load, levels) - rises).max())


def equal_stream_count(engine_name: str, work_folder: Path) -> float:
    """Case: noise seeds near 2^63 and at the end of the range. Error: number of seeds with the same stream as another
    seed."""
    seeds = (2**63 - 1, 2**63, 2**63 + 1, 2**64 - 2, 2**64 - 1)
    return float(len(seeds) - len({float(normal_samples(seed, 0, 1, 1)[0, 0]) for seed in seeds}))


def low_passed_line_error(engine_name: str, work_folder: Path) -> float:
    """Case: a straight line of 2 s through the slowest low-pass filter that is allowed. Error: largest change divided
    by the line's rise."""
    line = np.linspace(0.0, 1.0, 2001)[:, None]
    return float(np.abs(low_passed(line, 1e-3, 0.5, "", "bandwidth") - line).max())


def slow_filter_naive_result(work_folder: Path) -> str:
    """Result without the guard, as text: the filter alone, with a fiftieth of its period in the record."""
    from scipy.signal import butter, sosfiltfilt

    line = np.linspace(0.0, 1.0, 2001)
    filtered = sosfiltfilt(butter(4, 0.01 / 500.0, output="sos"), line, padlen=2000)
    return f"a line from 0 to 1 comes out with an error of {np.abs(filtered - line).max():.2g}"


STRAIGHT_LINE = np.arange(5.0)[:, None]
SPINNING_RATES = np.tile([0.0, 0.0, 400.0], (50, 1)) + np.sin(np.arange(50.0))[:, None]
NO_ROTATION = np.array([1.0, 0.0, 0.0, 0.0])
REFUSED: dict[str, OutcomeWord] = dict.fromkeys(IMPLEMENTATIONS, "refused")
RAISED: dict[str, OutcomeWord] = dict.fromkeys(IMPLEMENTATIONS, "raised")
CASES = (
    *(
        HardCase(name, hard, "fails, and says when", "", 0.0, "exact", released_wheelset_case(**changes), RAISED)
        for name, hard, changes in (
            ("suspension of 1e9 N/m on rails", "ten steps for a swing, which dies of them", {"stiffness_y": 1e9}),
            (
                "suspension of 1e9 N/m, yawed",
                "ten steps for a swing, which dies of them",
                {"yaw": 0.01, "stiffness_x": 1e9},
            ),
            ("flange of 1e12 N/m", "hit and left within a step", {"speed": 90.0, "flange_stiffness": 1e12}),
        )
    ),
    HardCase(
        "flange of 1e8 N/m",
        "hit within few steps",
        "a quarter of the step",
        "m, rad",
        1e-6,
        "error of the step",
        released_wheelset_case(speed=90.0, flange_stiffness=1e8),
    ),
    HardCase(
        "brake of 100 kN m",
        "its friction turns round within every step",
        "fails, and says when",
        "",
        0.0,
        "exact",
        manoeuvre_case(brake=[[0.0, 0.0], [0.05, 1e5]]),
        HANDLING_OUTCOMES | dict.fromkeys(("exudyn", "mujoco"), "raised"),
    ),
    HardCase(
        "driver who steers within 1 ms",
        "to and fro from step to step",
        "fails, and says when",
        "",
        0.0,
        "exact",
        manoeuvre_case(steer=[[0.001 * i, 0.02 * (i % 2)] for i in range(1, 200)]),
        HANDLING_OUTCOMES | dict.fromkeys(("exudyn", "mujoco"), "raised"),
    ),
    HardCase(
        "road at 300 m/s",
        "a wave in two steps",
        "a quarter of the step",
        "m, rad",
        1e-4,
        "error of the step",
        manoeuvre_case(speed=300.0, rough=True),
        HANDLING_OUTCOMES,
    ),
    HardCase(
        "rough road at 1000 m/s",
        "a step passes two waves",
        "a warning, and a tenth of the step beside the error told",
        "of the error told",
        3.0,
        "an estimate by longer steps may be so wrong",
        error_ratio_over_waves,
        HANDLING_OUTCOMES,
    ),
    HardCase(
        "hub forces of a road in steps of 20 ms",
        "a step passes three waves",
        "fails, and names the step to use",
        "",
        0.0,
        "there is no answer",
        hubs_over_waves_error,
        RAISED,
    ),
    HardCase(
        "levels in any order",
        "crossings are counted between sorted ones",
        "one by one",
        "",
        0.0,
        "exact",
        level_crossing_error,
        is_without_engine=True,
    ),
    HardCase(
        "seeds beyond 2^63",
        "whole numbers become doubles",
        "a stream for each",
        "",
        0.0,
        "exact",
        equal_stream_count,
        is_without_engine=True,
    ),
    HardCase(
        "low-pass of one period",
        "most of what it reads lies beyond the ends",
        "keeps a straight line",
        "of its rise",
        0.02,
        "0.7 % found",
        low_passed_line_error,
        naive_result=slow_filter_naive_result,
        is_without_engine=True,
    ),
    *(
        HardCase(name, hard, "refused", "", 0.0, "exact", refused_case(answer), REFUSED, is_without_engine=True)
        for name, hard, answer in (
            (
                "driver who steers within 0.5 ms",
                "steps of 1 ms see no change, or a constant one",
                lambda: car_scene(steer=[[0.0005 * i, 0.02 * (i % 2)] for i in range(1, 200)]),
            ),
            ("braking in steps of 0.1 s", "stops 3 % short", lambda: braking_scene(run={"sample": 0.1, "substeps": 1})),
            (
                "controller with a share that is no number",
                "would spread to every pressure",
                lambda: CONTROLLERS["slip_pi"](4, mix=float("nan"), period=5.5e-3),
            ),
            (
                "low-pass slower than its record",
                "what is beyond the ends is all that is left",
                lambda: low_passed(np.linspace(0.0, 1.0, 2001)[:, None], 1e-3, 0.01, "", "bandwidth"),
            ),
            (
                "body that turns 4 rad from sample to sample",
                "nobody can tell the way it went",
                lambda: integrate_attitude(SPINNING_RATES, 1e-2, NO_ROTATION),
            ),
            (
                "body that turns from an orientation of length 2",
                "its matrix would be four times a rotation",
                lambda: integrate_attitude(0.1 * SPINNING_RATES, 1e-2, 2.0 * NO_ROTATION),
            ),
            ("seed of -1", "the stream of 2^64 - 1 would answer", lambda: normal_samples(-1, 0, 1, 1)),
            ("seed of 1.7", "the stream of 1 would answer", lambda: normal_samples(1.7, 0, 1, 1)),  # type: ignore[arg-type]
            (
                "level that is no number",
                "all counts behind it would shift",
                lambda: level_crossings(STRAIGHT_LINE[:, 0], np.array([0.5, np.nan, 2.5])),
            ),
            (
                "samples with a period of -0.1 s",
                "time would run backwards",
                lambda: signal_from_samples(STRAIGHT_LINE, -0.1, "linear"),
            ),
            (
                "three samples, smooth",
                "a cubic needs four",
                lambda: signal_from_samples(STRAIGHT_LINE[:3], 0.1, "smooth"),
            ),
        )
    ),
)
