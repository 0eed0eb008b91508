"""Computing time of a scene without effects compared with a model built by hand, and the time that each effect of the
pitch-plane vehicle adds."""

import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from models.engines.protocol import build, check_trajectory
from models.machine.timing import interleave, paired_ratio, timing_statistics
from models.systems.pitch_plane.run import output_channels
from models.systems.pitch_plane.scene import Scene, assembly_of_scene, settings_of
from validation.absence.bare_cars import ratio_of_cars
from validation.absence.bare_rides import ratio_of_rides
from validation.absence.hand_built import exudyn_run, mujoco_run
from validation.absence.hand_built_braking import ratio_of_stops
from validation.absence.hand_built_contact import ratio_of_contacts
from validation.absence.machinery import ratio_of_wheelsets
from validation.cases.absent import (
    EFFECT_NAMES,
    ENGINE_NAMES,
    TIME_STEP,
    changes_text,
    component_count_changes,
    engine_model,
    scene_with_effects,
    scenes_without_and_with_effect,
    write_input_files,
)
from validation.choice.price_of_choice import price_of_choice
from validation.common.grounds import allowing_breaches
from validation.common.rows import CaseAnswer, Observed, Row, Saved, System, Table

TITLE = "What the machinery costs, and each effect"
SYSTEM: System = "effects"
TIMED_STEP_COUNTS = {True: 2000, False: 4000}
"""Number of steps of the runs that are timed against hand-built models, for a quick run (True) and a full run (False).
4 s are a fifth of a study scene, and short enough that the load of the machine hardly changes between the two runs of a
comparison."""
RATIO_ROUNDS, PRICE_ROUNDS = {True: 7, False: 80}, {True: 5, False: 15}
"""Numbers of timing rounds, for a quick run (True) and a full run (False): of the ratios to hand-built models, and of
the price of each effect."""
ROUNDS_BETWEEN_UNCHECKED_RUNS = 4
"""The hand-built run without a result check is timed in the first of every so many rounds."""
RIDE_STEP_COUNTS = {
    "reference": {True: 50, False: 500},
    "exudyn": {True: 50, False: 300},
    "mujoco": {True: 500, False: 1000},
}
"""Number of steps of timed rides, by engine and ``quick``. A step of Exudyn takes as long as eight of MuJoCo, or as a
step of all copies in the hand-written reference."""
HAND_WRITTEN_RIDES = {
    "reference": "the same copies one after the other, equations written out",
    "exudyn": "a car of its items whose path passes the same guard",
    "mujoco": "a car of its XML with site actuators whose path passes the same guard",
}
"""Description of the hand-written model of the ride, by engine."""
TIME_RATIO_BOUND = 1.03
"""Largest ratio asked for of the time of a scene without effects to that of a hand-built model."""
EFFECT_STEP_COUNT = 500
"""Number of steps of the runs that measure the time an effect adds."""


@allowing_breaches("what is computed is what is counted, whatever the vehicle does meanwhile")
def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows of the computing times divided by those of hand-built models, and the price list of effects. A quick run
    simulates 2 s instead of 4 s, takes a tenth of the rounds, and each effect in one of the three engines, in turn."""
    with tempfile.TemporaryDirectory() as name:
        files_folder = Path(name)
        write_input_files(files_folder)
        ratios = {
            engine: _time_ratio_to_hand_built(engine, files_folder, TIMED_STEP_COUNTS[quick], RATIO_ROUNDS[quick])
            for engine in ("exudyn", "mujoco")
        }
        price = [
            _price_of_effect(effect, engine, files_folder, PRICE_ROUNDS[quick])
            for i, effect in enumerate(EFFECT_NAMES)
            for j, engine in enumerate(ENGINE_NAMES)
            if not quick or i % len(ENGINE_NAMES) == j
        ]
    rows = [
        row for engine, ratio in ratios.items() for row in _hand_built_rows(engine, ratio, TIMED_STEP_COUNTS[quick])
    ]
    rows += _wheelset_rows(TIMED_STEP_COUNTS[quick] // 4, quick) + _ride_rows(quick) + _contact_rows(quick)
    rows += (
        _car_rows(TIMED_STEP_COUNTS[quick] // 20, quick) + _stop_rows(quick) + ([] if quick else [_effect_choice_row()])
    )
    return rows, {"price": price, "ratios": ratios}


def hand_built_run(engine_name: str, bare_scene: Scene) -> Any:
    """Run of the hand-built model of the vehicle without effects in an engine: a function that returns the states."""
    assembly, settings = assembly_of_scene(bare_scene), settings_of(bare_scene, engine_name)
    run = {"exudyn": exudyn_run, "mujoco": mujoco_run}[engine_name]
    return run(assembly.parameters, assembly.initial, settings.step, settings.steps)


def _time_ratio_to_hand_built(engine_name: str, work_folder: Path, step_count: int, round_count: int) -> Saved:
    """Ratio of the computing time of twinrig's model of a scene without effects to that of the hand-built model, and
    the largest difference of their states.

    Every run of the machinery passes the guard; the hand-built model is timed with it and without it.
    """
    bare = scene_with_effects({}, step_count, work_folder)
    ours, theirs, times = (
        engine_model(bare, engine_name),
        hand_built_run(engine_name, bare),
        TIME_STEP * np.arange(step_count + 1),
    )
    gap = float(np.abs(ours.run().states - theirs()).max())
    jobs = [ours.run, lambda: check_trajectory(engine_name, times, theirs(), bare.run.duration), theirs]
    seconds = interleave(
        jobs, round_count, round_interval=(1, 1, ROUNDS_BETWEEN_UNCHECKED_RUNS), clock=time.process_time
    )
    return {
        "ratio": paired_ratio(seconds[0], seconds[1]),
        "gap": gap,
        "unchecked": paired_ratio(
            seconds[0, ::ROUNDS_BETWEEN_UNCHECKED_RUNS], seconds[2, ::ROUNDS_BETWEEN_UNCHECKED_RUNS]
        ),
    }


def _hand_built_rows(engine_name: str, time_comparison: Saved, step_count: int) -> list[Row]:
    """Rows: difference of a scene without effects from the hand-built model, and ratio of their computing times."""
    why = (
        f"interleaved runs of {step_count:,} steps, seconds of the processor, median of paired ratios: what the "
        "machinery costs where no effect is named"
    )
    return [
        Observed(
            f"effect_prices.same.{engine_name}",
            SYSTEM,
            f"{engine_name}: largest difference of the states of a bare scene from those of a hand-built model",
            time_comparison["gap"],
            "m, rad, m/s, rad/s",
        ).at_most(0.0, "the same items in the same order give the same numbers", "native"),
        time_ratio_row(
            f"effect_prices.ratio.{engine_name}",
            f"{engine_name}: ratio of the time of a bare scene to that of a hand-built model "
            "whose result passes the same guard",
            time_comparison["ratio"],
            why,
        ),
        time_ratio_row(
            f"effect_prices.unchecked.{engine_name}",
            f"{engine_name}: ratio of the time of a bare scene to that of a hand-built model whose result nobody "
            "checks",
            time_comparison["unchecked"],
            why,
        ),
    ]


def time_ratio_row(
    row_id: str, title: str, ratio_and_interval: tuple[float, float, float], tolerance_reason: str
) -> Row:
    """Row with a ratio of computing times and its 95 % interval."""
    value, low, high = ratio_and_interval
    return Observed(row_id, SYSTEM, f"{title}, 95 % interval {low:.3f} to {high:.3f}", value, "").aim(
        TIME_RATIO_BOUND, tolerance_reason
    )


def _wheelset_rows(step_count: int, quick: bool) -> list[Row]:
    """Rows: difference and time of a free wheelset with linear creep on cones, compared with code written for this case
    alone."""
    gap, ratio = ratio_of_wheelsets(step_count, RATIO_ROUNDS[quick])
    return [
        Observed(
            "effect_prices.same.wheelset",
            SYSTEM,
            "largest difference of a bare wheelset's states, and of its contact forces over their "
            "load, from a hand-written wheelset with linear creep on cones",
            gap,
            "m, rad, m/s, rad/s",
        ).at_most(1e-11, "the same equations, sums in another order", "none"),
        time_ratio_row(
            "effect_prices.ratio.wheelset",
            "ratio of the time of a bare wheelset to that of the hand-written one, whose path passes the same checks",
            ratio,
            "what the kernel of all wheelsets costs where no effect is named",
        ),
    ]


def _ride_rows(quick: bool) -> list[Row]:
    """Rows: a car with seven degrees of freedom on a rough road, compared in Exudyn and MuJoCo with a model built by
    hand, and in the reference implementation with equations written for this car alone.

    In MuJoCo the suspension is of site actuators, as XML has them. All forces of this car alone in one callback, by
    hand, on addresses in MuJoCo's memory, beat the general callback by an eighth.
    """
    rows = []
    for engine, steps in RIDE_STEP_COUNTS.items():
        gap, ratio = ratio_of_rides(engine, steps[quick], 3 if quick else RATIO_ROUNDS[quick])
        rows += [
            Observed(
                f"effect_prices.same.ride.{engine}",
                SYSTEM,
                f"{engine}: largest difference of the states of a bare ride from those of {HAND_WRITTEN_RIDES[engine]}",
                gap,
                "m, rad, m/s, rad/s",
            ).at_most(
                1e-11,
                "the same vehicle on the same road; forces are summed in another order",
                "none" if engine == "reference" else "native",
            ),
            time_ratio_row(
                f"effect_prices.ratio.ride.{engine}",
                f"{engine}: ratio of the time of a bare ride to that of {HAND_WRITTEN_RIDES[engine]}",
                ratio,
                "what the machinery of all vehicles in space costs where no effect is named",
            ),
        ]
    return rows


def _car_rows(step_count: int, quick: bool) -> list[Row]:
    """Rows: difference and time of a car that rolls freely on a flat road in MuJoCo, compared with code written for
    this case alone.

    MuJoCo's own step is the same and so is the march of the tyres' cells, three fifths of the time; what is
    left, a microsecond of every call of the forces, is the walk through a table that any vehicle has.
    """
    gap, ratio = ratio_of_cars(step_count, RATIO_ROUNDS[quick])
    return [
        Observed(
            "effect_prices.same.handling",
            SYSTEM,
            "MuJoCo: largest difference of the states of a bare car of handling from a hand-written "
            "car with its springs, bars, mounts and brush tyres alone",
            gap,
            "m, rad, m/s, rad/s",
        ).at_most(1e-11, "the same equations, sums in another order", "native"),
        time_ratio_row(
            "effect_prices.ratio.handling",
            "MuJoCo: ratio of the time of a bare car of handling to that of the "
            "hand-written car, whose path passes the same guard",
            ratio,
            "what walking through any vehicle's tree costs where no effect is named",
        ),
    ]


def _stop_rows(quick: bool) -> list[Row]:
    """Rows: difference and time of a truck that brakes in a turn on snow, compared with code written for this stop
    alone.

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
        time_ratio_row(
            "effect_prices.ratio.braking",
            "ratio of the time of a bare stop to that of the hand-written truck",
            ratio,
            "what a step of any braked vehicle in the plane costs where no effect is named",
        ),
    ]


def _contact_rows(quick: bool) -> list[Row]:
    """Rows: difference and time of FASTSIM on one ellipse without spin, called from Python, compared with code written
    for this case alone."""
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
        time_ratio_row(
            "effect_prices.ratio.contact",
            "ratio of the time of a call of FASTSIM on a bare ellipse to that of the hand-written FASTSIM",
            ratio,
            "what spin, other shapes, marches and friction cost where nothing asks for them",
        ),
    ]


def _effect_choice_row() -> Row:
    """Row: ratio of the time of a choice of effects for a linear car to the time of the car's full covariance."""
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


def _price_of_effect(effect_name: str, engine_name: str, work_folder: Path, round_count: int) -> Saved:
    """Line of the price list: time per step (microseconds) that an effect adds in an engine, with the numbers of
    components that the effect changes."""
    seconds = interleave(
        [
            _simulation_to_time(bare, engine_name)
            for bare in scenes_without_and_with_effect(effect_name, EFFECT_STEP_COUNT, work_folder)
        ],
        round_count,
        5e-3,
    )
    added = (seconds[1] - seconds[0]) / EFFECT_STEP_COUNT * 1e6
    return {
        "effect": effect_name,
        "engine": engine_name,
        "adds": changes_text(component_count_changes(effect_name, engine_name, work_folder)) or "nothing",
        "step": float(np.median(seconds[0])) / EFFECT_STEP_COUNT * 1e6,
        "us": timing_statistics(added),
        "ratio": paired_ratio(seconds[1], seconds[0]),
    }


def _simulation_to_time(simulated_scene: Scene, engine_name: str) -> Any:
    """Function that runs a scene and computes its output channels; the model is built beforehand, outside the timed
    call."""
    assembly = assembly_of_scene(simulated_scene)
    built = build(engine_name, assembly, settings_of(simulated_scene, engine_name))
    return lambda: output_channels(assembly, built.run(), built)


def tables(case_data: Saved) -> list[Table]:
    """Table of the computing time that each effect adds."""
    note = (
        "Each effect is added to the scene without it: wheel_forces, road, pitch_spring and the sensors to the "
        "bare vehicle, geometry to one of small angles, gyro_bias to one with a gyro, the others to one under "
        "wheel forces. Counts are exact; "
        "microseconds per step of 1 ms, channels included, are the median of paired differences with their median "
        "deviation, the factor is the median of paired ratios with a 95 % interval. An effect that is not named "
        "costs nothing."
    )
    headings = ("effect", "engine", "adds", "without it, us per step", "adds, us per step", "factor")
    return [
        Table("Price list of effects", note, headings, tuple(_price_list_line(entry) for entry in case_data["price"]))
    ]


def _price_list_line(effect_cost_record: Saved) -> tuple[str, ...]:
    """Line of the price list for one effect in one engine."""
    value, low, high = effect_cost_record["ratio"]
    return (
        effect_cost_record["effect"],
        effect_cost_record["engine"],
        effect_cost_record["adds"],
        f"{effect_cost_record['step']:.2f}",
        f"{effect_cost_record['us']['median']:+.2f} +/- {effect_cost_record['us']['mad']:.2f}",
        f"{value:.2f} ({low:.2f} to {high:.2f})",
    )
