"""Cost of a scene without effects beside a model built by hand, and the cost that each effect of the vehicle adds."""

import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from models.engines.protocol import build, guard
from models.machine.timing import describe, interleave, paired_ratio
from models.systems.pitch_plane.run import output_channels
from models.systems.pitch_plane.scene import Scene, assembly_of_scene, settings_of
from validation.absence.bare_cars import ratio_of_cars
from validation.absence.bare_rides import ratio_of_rides
from validation.absence.hand_built import exudyn_run, mujoco_run
from validation.absence.hand_built_braking import ratio_of_stops
from validation.absence.hand_built_contact import ratio_of_contacts
from validation.absence.machinery import ratio_of_wheelsets
from validation.cases.absent import EFFECTS, ENGINES, STEP, change, changes, model, pair, scene, write_files
from validation.choice.price_of_choice import price_of_choice
from validation.common.grounds import allowing_breaches
from validation.common.rows import CaseAnswer, Observed, Row, Saved, System, Table

TITLE = "What the machinery costs, and each effect"
SYSTEM: System = "effects"
STEPS = {True: 2000, False: 4000}
"""Steps of the runs that are timed against hand-built ones, by ``quick``: 4 s are a fifth of a study scene, and short
enough for both of a pair to meet the machine in one mood."""
RATIO_ROUNDS, PRICE_ROUNDS = {True: 7, False: 80}, {True: 5, False: 15}
"""Rounds of these runs, and of those that tell what an effect adds, by ``quick``."""
SELDOM = 4
"""Of how many rounds the unchecked run is in the first."""
RIDES = {"reference": {True: 50, False: 500}, "exudyn": {True: 50, False: 300}, "mujoco": {True: 500, False: 1000}}
"""Steps of rides: one of Exudyn takes as long as eight of MuJoCo or of the reference's copies together."""
WRITTEN = {
    "reference": "the same copies one after the other, equations written out",
    "exudyn": "a car of its items whose path passes the same guard",
    "mujoco": "a car of its XML with site actuators whose path passes the same guard",
}
DEAREST = 1.03
"""Ratio of the time of a bare scene to that of a hand-built model."""
TIMED_STEPS = 500
"""Steps of the runs whose seconds tell what an effect adds."""


@allowing_breaches("what is computed is what is counted, whatever the vehicle does meanwhile")
def measure(quick: bool, folder: Path) -> CaseAnswer:
    """The ratio to hand-built models and the price list; a quick run has runs of 2 s instead of 4 s, a tenth of
    the rounds, and each effect in one of the three engines, in turn.
    """
    with tempfile.TemporaryDirectory() as name:
        files_folder = Path(name)
        write_files(files_folder)
        ratios = {
            engine: _ratio(engine, files_folder, STEPS[quick], RATIO_ROUNDS[quick]) for engine in ("exudyn", "mujoco")
        }
        price = [
            _price(effect, engine, files_folder, PRICE_ROUNDS[quick])
            for i, effect in enumerate(EFFECTS)
            for j, engine in enumerate(ENGINES)
            if not quick or i % len(ENGINES) == j
        ]
    rows = [row for engine, ratio in ratios.items() for row in _machinery(engine, ratio, STEPS[quick])]
    rows += _wheelset(STEPS[quick] // 4, quick) + _rides(quick) + _contact(quick)
    rows += _cars(STEPS[quick] // 20, quick) + _stops(quick) + ([] if quick else [_choice()])
    return rows, {"price": price, "ratios": ratios}


def hand_built(engine: str, bare: Scene) -> Any:
    """The hand-built model of the bare vehicle in an engine."""
    assembly, settings = assembly_of_scene(bare), settings_of(bare, engine)
    run = {"exudyn": exudyn_run, "mujoco": mujoco_run}[engine]
    return run(assembly.parameters, assembly.initial, settings.step, settings.steps)


def _ratio(engine: str, folder: Path, steps: int, round_count: int) -> Saved:
    """Ratio of computing times between twinrig's bare model and the hand-built one, and the largest difference of their
    states.

    Every run of the machinery passes the guard; the hand-built model is timed with it and without it.
    """
    bare = scene({}, steps, folder)
    ours, theirs, times = model(bare, engine), hand_built(engine, bare), STEP * np.arange(steps + 1)
    gap = float(np.abs(ours.run().states - theirs()).max())
    jobs = [ours.run, lambda: guard(engine, times, theirs(), bare.run.duration), theirs]
    seconds = interleave(jobs, round_count, round_interval=(1, 1, SELDOM), clock=time.process_time)
    return {
        "ratio": paired_ratio(seconds[0], seconds[1]),
        "gap": gap,
        "unchecked": paired_ratio(seconds[0, ::SELDOM], seconds[2, ::SELDOM]),
    }


def _machinery(engine: str, machinery: Saved, steps: int) -> list[Row]:
    why = (
        f"interleaved runs of {steps:,} steps, seconds of the processor, median of paired ratios: what the "
        "machinery costs where no effect is named"
    )
    return [
        Observed(
            f"effect_prices.same.{engine}",
            SYSTEM,
            f"{engine}: largest difference of the states of a bare scene from those of a hand-built model",
            machinery["gap"],
            "m, rad, m/s, rad/s",
        ).at_most(0.0, "the same items in the same order give the same numbers", "native"),
        ratio_row(
            f"effect_prices.ratio.{engine}",
            f"{engine}: ratio of the time of a bare scene to that of a hand-built model "
            "whose result passes the same guard",
            machinery["ratio"],
            why,
        ),
        ratio_row(
            f"effect_prices.unchecked.{engine}",
            f"{engine}: ratio of the time of a bare scene to that of a hand-built model whose result nobody checks",
            machinery["unchecked"],
            why,
        ),
    ]


def ratio_row(row: str, title: str, ratio: tuple[float, float, float], tolerance_reason: str) -> Row:
    """Row with a ratio of computing times and its interval."""
    value, low, high = ratio
    return Observed(row, SYSTEM, f"{title}, 95 % interval {low:.3f} to {high:.3f}", value, "").aim(
        DEAREST, tolerance_reason
    )


def _wheelset(steps: int, quick: bool) -> list[Row]:
    """Rows: a free wheelset with linear creep on cones, compared with code written for this alone."""
    gap, ratio = ratio_of_wheelsets(steps, RATIO_ROUNDS[quick])
    return [
        Observed(
            "effect_prices.same.wheelset",
            SYSTEM,
            "largest difference of a bare wheelset's states, and of its contact forces over their "
            "load, from a hand-written wheelset with linear creep on cones",
            gap,
            "m, rad, m/s, rad/s",
        ).at_most(1e-11, "the same equations, sums in another order", "none"),
        ratio_row(
            "effect_prices.ratio.wheelset",
            "ratio of the time of a bare wheelset to that of the hand-written one, whose path passes the same checks",
            ratio,
            "what the kernel of all wheelsets costs where no effect is named",
        ),
    ]


def _rides(quick: bool) -> list[Row]:
    """Rows: a car with seven freedoms on a rough road, compared with a model built by hand in each engine, and with
    hand-written equations.

    In MuJoCo the suspension is of site actuators, as XML has them. All forces of this car alone in one callback, by
    hand, on addresses in MuJoCo's memory, beat the general callback by an eighth.
    """
    rows = []
    for engine, steps in RIDES.items():
        gap, ratio = ratio_of_rides(engine, steps[quick], 3 if quick else RATIO_ROUNDS[quick])
        rows += [
            Observed(
                f"effect_prices.same.ride.{engine}",
                SYSTEM,
                f"{engine}: largest difference of the states of a bare ride from those of {WRITTEN[engine]}",
                gap,
                "m, rad, m/s, rad/s",
            ).at_most(
                1e-11,
                "the same vehicle on the same road; forces are summed in another order",
                "none" if engine == "reference" else "native",
            ),
            ratio_row(
                f"effect_prices.ratio.ride.{engine}",
                f"{engine}: ratio of the time of a bare ride to that of {WRITTEN[engine]}",
                ratio,
                "what the machinery of all vehicles in space costs where no effect is named",
            ),
        ]
    return rows


def _cars(steps: int, quick: bool) -> list[Row]:
    """Rows: a car that rolls freely on a flat road in MuJoCo, compared with code written for this alone.

    MuJoCo's own step is the same and so is the march of the tyres' cells, three fifths of the time; what is
    left, a microsecond of every call of the forces, is the walk through a table that any vehicle has.
    """
    gap, ratio = ratio_of_cars(steps, RATIO_ROUNDS[quick])
    return [
        Observed(
            "effect_prices.same.handling",
            SYSTEM,
            "MuJoCo: largest difference of the states of a bare car of handling from a hand-written "
            "car with its springs, bars, mounts and brush tyres alone",
            gap,
            "m, rad, m/s, rad/s",
        ).at_most(1e-11, "the same equations, sums in another order", "native"),
        ratio_row(
            "effect_prices.ratio.handling",
            "MuJoCo: ratio of the time of a bare car of handling to that of the "
            "hand-written car, whose path passes the same guard",
            ratio,
            "what walking through any vehicle's tree costs where no effect is named",
        ),
    ]


def _stops(quick: bool) -> list[Row]:
    """Rows: a truck brakes in a turn on snow, in the reference, compared with code written for this stop alone.

    A step compiled for any number of tyre tables and of their loads, where the written one has one of each,
    takes a third longer; asking for samples and recording them adds a tenth.
    """
    gap, ratio = ratio_of_stops(3.0 if quick else 10.0, RATIO_ROUNDS[quick])
    return [
        Observed(
            "effect_prices.same.braking",
            SYSTEM,
            "largest difference of the states, wheels, forces and brakes of a bare stop from a "
            "hand-written truck of fixed loads on one surface",
            gap,
            "m, rad, m/s, rad/s, shares",
        ).at_most(1e-11, "the same equations, sums in another order", "none"),
        ratio_row(
            "effect_prices.ratio.braking",
            "ratio of the time of a bare stop to that of the hand-written truck",
            ratio,
            "what a step of any braked vehicle in the plane costs where no effect is named",
        ),
    ]


def _contact(quick: bool) -> list[Row]:
    """Rows: FASTSIM on one ellipse without spin, called from Python, compared with code written for this alone."""
    gap, ratio = ratio_of_contacts(RATIO_ROUNDS[quick])
    return [
        Observed(
            "effect_prices.same.contact",
            SYSTEM,
            "largest difference of FASTSIM's forces on a bare ellipse from a hand-written FASTSIM, "
            "over friction times load",
            gap,
            "",
        ).at_most(1e-13, "the same cells, sums in another order", "none"),
        ratio_row(
            "effect_prices.ratio.contact",
            "ratio of the time of a call of FASTSIM on a bare ellipse to that of the hand-written FASTSIM",
            ratio,
            "what spin, other shapes, marches and friction cost where nothing asks for them",
        ),
    ]


def _choice() -> Row:
    """Row: ratio of the time to choose the effects of a linear car to the time of its full covariance."""
    (ratio, low, high), predicted_seconds = price_of_choice()
    return Observed(
        "effect_prices.choice",
        SYSTEM,
        "ratio of the time of a linear choice of effects to that of the full covariance of the same scene, a car of 19 "
        f"degrees of freedom, 95 % interval {low:.3g} to {high:.3g}; the time told beforehand is "
        f"{predicted_seconds:.2g} times that",
        ratio,
        "times",
    ).aim(20.0, "seconds of the processor, median of interleaved rounds")


def _price(effect: str, engine: str, folder: Path, round_count: int) -> Saved:
    """One line of the price list: time per step in microseconds that an effect adds in an engine, with its counts."""
    seconds = interleave([_job(bare, engine) for bare in pair(effect, TIMED_STEPS, folder)], round_count, 5e-3)
    added = (seconds[1] - seconds[0]) / TIMED_STEPS * 1e6
    return {
        "effect": effect,
        "engine": engine,
        "adds": changes(change(effect, engine, folder)) or "nothing",
        "step": float(np.median(seconds[0])) / TIMED_STEPS * 1e6,
        "us": describe(added),
        "ratio": paired_ratio(seconds[1], seconds[0]),
    }


def _job(bare: Scene, engine: str) -> Any:
    """A run of a scene, channels included, whose model is built already."""
    assembly = assembly_of_scene(bare)
    built = build(engine, assembly, settings_of(bare, engine))
    return lambda: output_channels(assembly, built.run(), built)


def tables(case_data: Saved) -> list[Table]:
    """The price list of effects."""
    note = (
        "Each effect is added to the scene without it: wheel_forces, road, pitch_spring and the sensors to the "
        "bare vehicle, geometry to one of small angles, gyro_bias to one with a gyro, the others to one under "
        "wheel forces. Counts are exact; "
        "microseconds per step of 1 ms, channels included, are the median of paired differences with their median "
        "deviation, the factor is the median of paired ratios with a 95 % interval. An effect that is not named "
        "costs nothing."
    )
    headings = ("effect", "engine", "adds", "without it, us per step", "adds, us per step", "factor")
    return [Table("Price list of effects", note, headings, tuple(_line(entry) for entry in case_data["price"]))]


def _line(saved_entry: Saved) -> tuple[str, ...]:
    value, low, high = saved_entry["ratio"]
    return (
        saved_entry["effect"],
        saved_entry["engine"],
        saved_entry["adds"],
        f"{saved_entry['step']:.2f}",
        f"{saved_entry['us']['median']:+.2f} +/- {saved_entry['us']['mad']:.2f}",
        f"{value:.2f} ({low:.2f} to {high:.2f})",
    )
