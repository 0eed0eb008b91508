"""What a scene without effects costs beside a model built by hand, and what each effect of the vehicle adds to it."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from models.assembly import assemble
from models.engines.protocol import build, guard, settings_of
from models.scene import Scene
from models.simulate import outputs
from validation.absence.hand_built import exudyn_run, mujoco_run
from validation.cases.absent import EFFECTS, ENGINES, STEP, change, changes, model, pair, scene, write_files
from validation.rows import Row, System, Table, at_most, finding
from validation.timing import describe, interleave, paired_ratio

TITLE = "What the machinery costs, and each effect"
SYSTEM: System = "effects"
STEPS = {True: 2000, False: 8000}
"""Steps of the runs that are timed against hand-built ones, by ``quick``: 8 s are less than half of a study scene."""
SHORT = 500
"""Steps of the runs whose seconds tell what an effect adds."""


def measure(quick: bool, folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """The ratio to hand-built models and the price list; a quick run has runs of 2 s instead of 8 s, a quarter of the
    rounds, and each effect in one of the three engines, in turn.
    """
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        write_files(place)
        ratios = {engine: _ratio(engine, place, STEPS[quick], 7 if quick else 40) for engine in ("exudyn", "mujoco")}
        price = [_price(effect, engine, place, 5 if quick else 25)
                 for i, effect in enumerate(EFFECTS) for j, engine in enumerate(ENGINES)
                 if not quick or i % len(ENGINES) == j]  # fmt: skip
    rows = [row for engine, ratio in ratios.items() for row in _machinery(engine, ratio, STEPS[quick])]
    return rows, {"price": price, "ratios": ratios}


def hand_built(engine: str, own: Scene) -> Any:
    """The bare vehicle written directly for an engine."""
    assembly, settings = assemble(own), settings_of(own, engine)
    run = {"exudyn": exudyn_run, "mujoco": mujoco_run}[engine]
    return run(assembly.parameters, assembly.initial, settings.step, settings.steps)


def _ratio(engine: str, folder: Path, steps: int, rounds: int) -> dict[str, Any]:
    """Seconds of the machinery without effects against the hand-built model, and whether they agree.

    Every run of the machinery passes the guard; the hand-built model is timed with it and without it.
    """
    own = scene({}, steps, folder)
    ours, theirs, times = model(own, engine), hand_built(engine, own), STEP * np.arange(steps + 1)
    gap = float(np.abs(ours.run().states - theirs()).max())
    seconds = interleave([ours.run, lambda: guard(engine, times, theirs(), own.run.duration), theirs], rounds)
    return {"ratio": paired_ratio(seconds[0], seconds[1]), "unchecked": paired_ratio(seconds[0], seconds[2]),
            "gap": gap, "seconds": [describe(one) for one in seconds]}


def _machinery(engine: str, found: dict[str, Any], steps: int) -> list[Row]:
    ways = {"ratio": "whose result passes the same guard", "unchecked": "whose result nobody checks"}
    why = (f"interleaved runs of {steps:,} steps, median of paired ratios with a bootstrap interval: what the "
           "machinery costs where no effect is named; seconds are reported, never judged")
    return [
        at_most(f"effect_prices.same.{engine}", SYSTEM, f"{engine}: states of a bare scene against a hand-built model",
                found["gap"], "m, rad, m/s, rad/s", 0.0, "the same items in the same order give the same numbers",
                "native"),
        *(finding(f"effect_prices.{key}.{engine}", SYSTEM, f"{engine}: time of a bare scene by that of a hand-built "
                  f"model {what}, 95 % interval {found[key][1]:.3f} to {found[key][2]:.3f}", found[key][0], "",
                  "at most 1.03", why, "native") for key, what in ways.items()),
    ]  # fmt: skip


def _price(effect: str, engine: str, folder: Path, rounds: int) -> dict[str, Any]:
    """One line of the price list."""
    seconds = interleave([_job(own, engine) for own in pair(effect, SHORT, folder)], rounds, 5e-3)
    added = (seconds[1] - seconds[0]) / SHORT * 1e6
    return {"effect": effect, "engine": engine, "adds": changes(change(effect, engine, folder)) or "nothing",
            "step": float(np.median(seconds[0])) / SHORT * 1e6, "us": describe(added),
            "ratio": paired_ratio(seconds[1], seconds[0])}


def _job(own: Scene, engine: str) -> Any:
    """A run with its channels, built beforehand."""
    assembly = assemble(own)
    built = build(engine, assembly, settings_of(own, engine))
    return lambda: outputs(assembly, built.run(), built)


def tables(data: dict[str, Any]) -> list[Table]:
    """The price list of effects."""
    note = ("Each effect is added to the scene without it: wheel_forces, road, pitch_spring and the sensors to the "
            "bare vehicle, gyro_bias to one with a gyro, the others to one under wheel forces. Counts are exact; "
            "microseconds per step of 1 ms, channels included, are the median of paired differences with their median "
            "deviation, the factor is the median of paired ratios with a 95 % interval. An effect that is not named "
            "costs nothing.")
    headings = ("effect", "engine", "adds", "without it, us per step", "adds, us per step", "factor")
    return [Table("Price list of effects", note, headings, tuple(_line(entry) for entry in data["price"]))]


def _line(entry: dict[str, Any]) -> tuple[str, ...]:
    value, low, high = entry["ratio"]
    return (entry["effect"], entry["engine"], entry["adds"], f"{entry['step']:.2f}",
            f"{entry['us']['median']:+.2f} +/- {entry['us']['mad']:.2f}", f"{value:.2f} ({low:.2f} to {high:.2f})")
