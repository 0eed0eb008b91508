"""Which effects of a ride scene do its quantities call for: chosen within a tolerance, and confirmed."""

import csv
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from models.choice.systems.ride import opened
from models.errors import InputError
from models.ride.choice.activity import activity
from models.ride.choice.choose import Choice, Chooser
from models.ride.choice.held import Effect, Held, illegal, without
from models.ride.choice.in_time import Samples, goes_in_time
from models.ride.choice.reduced import Reduced, Whole
from models.ride.of_scene import told_by, vehicle_of
from models.ride.scene import RideScene
from models.seconds import cost
from models.strict import read
from studies.choice import told

SYSTEM = "ride"
Progress = Callable[[str, float], None]
SECONDS = 2.0
"""Motion (s) of the time runs that are timed, each at its own largest stable step."""


class Options(Samples):
    """[options] of this study: the copies of a vehicle whose springs are bent; none for a linear one."""


@dataclass(frozen=True)
class Alone:
    """One effect left out alone: predicted and confirmed changes (quantities,); why it may not, else empty."""

    effect: Effect
    predicted: np.ndarray
    confirmed: np.ndarray
    illegal: str


def check(scene: RideScene, engines: tuple[str, ...]) -> None:
    """Refuse scenes that ask no question, and options of copies where there are none."""
    read(Options, scene.options, scene.file, "options")
    if goes_in_time(scene):
        opened(scene)
    elif scene.options:
        place, value = next(iter(scene.options.items()))
        raise InputError(scene.file, f"options.{place}", value, "is read where springs are bent, and effects chosen "
                         "by runs; for this vehicle there is a closed form")  # fmt: skip


def run(scene: RideScene, engines: tuple[str, ...], folder: Path, progress: Progress) -> dict[str, Any]:
    """Choose; saves ``effects.csv``, ``activity.csv`` and a figure; by runs where springs are bent."""
    from studies.ride_choice_figure import choice_figure

    check(scene, engines)
    if goes_in_time(scene):
        return told([scene], engines, folder, progress)
    assert scene.speeds is not None and scene.tolerance is not None
    progress("screening", 0.1)
    with told_by(scene):
        chooser = Chooser(Held(scene, vehicle_of(scene)), scene.speeds.all(), scene.quantities, scene.tolerance)
        choice = chooser.choose()
        progress("single effects", 0.7)
        further = chooser.further(frozenset(choice.left_out))
        alone = [_alone(chooser, effect) for effect in chooser.effects]
        middle = chooser.wholes[len(chooser.wholes) // 2]
        watts = activity(middle)
    _save(scene, alone, choice, folder / "effects.csv")
    _save_activity(watts, folder / "activity.csv")
    choice_figure(scene, alone, choice, watts, folder / "choice.png")
    return {"scene": scene.title, "folder": str(folder), "failed": {}, "answer": _answer(scene, choice, further),
            "table": _table(scene, choice, alone, further, _seconds(chooser, choice, middle))}  # fmt: skip


def _alone(chooser: Chooser, effect: Effect) -> Alone:
    one = frozenset([effect])
    return Alone(effect, chooser.predicted(one), chooser.confirm(one), illegal(one))


def _answer(scene: RideScene, choice: Choice, further: dict[Effect, float]) -> dict[str, Any]:
    """What was chosen, and how right and how cheap that is."""
    errors = zip(scene.quantities, choice.predicted.tolist(), choice.confirmed.tolist(), strict=True)
    return {
        "left out": [effect.name for effect in choice.left_out],
        "stay": [effect.name for effect in choice.candidates if effect not in choice.left_out],
        "errors": {name: {"predicted": predicted, "confirmed": found} for name, predicted, found in errors},
        "kept": choice.kept, "states": [choice.before.states, choice.after.states],
        "step limit": [choice.before.step, choice.after.step], "calls": [choice.before.calls, choice.after.calls],
        "confirmations": choice.rounds, "would matter no more above": {
            effect.name: change for effect, change in further.items()},
    }  # fmt: skip


def _seconds(chooser: Chooser, choice: Choice, whole: Whole) -> tuple[list[float], list[float]]:
    """Seconds of time runs of the whole scene and of what is left."""
    rest = whole.reduced(without(chooser.held, choice.left_out))
    return _timed(whole.full, choice.before.step), _timed(rest, choice.after.step)


def _timed(reduced: Reduced, step: float) -> list[float]:
    """Seconds for SECONDS of free motion by the classical Runge-Kutta method, of three runs."""
    A, taken = reduced.system.A[: reduced.states, : reduced.states], []
    for _ in range(3):
        x, start = np.ones(len(A)), time.perf_counter()
        for _ in range(int(SECONDS / step)):
            k1 = A @ x
            k2 = A @ (x + step / 2 * k1)
            k3 = A @ (x + step / 2 * k2)
            x = x + step / 6 * (k1 + 2 * k2 + 2 * k3 + A @ (x + step * k3))
        taken.append(time.perf_counter() - start)
    return taken


def _save(scene: RideScene, alone: list[Alone], choice: Choice, path: Path) -> None:
    """A row per effect: what leaving it out alone changes, predicted and confirmed, and whether it was left out."""
    with path.open("x", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        heads = [f"{name}, {kind} [-]" for name in scene.quantities for kind in ("predicted", "confirmed")]
        writer.writerow(["effect", "left out", *heads, "not alone because"])
        for one in alone:
            values = np.column_stack([one.predicted, one.confirmed]).ravel().tolist()
            writer.writerow([one.effect.name, one.effect in choice.left_out, *map(repr, values), one.illegal])


def _save_activity(watts: dict[str, float], path: Path) -> None:
    """Energy activity of every element."""
    with path.open("x", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerows([["element", "activity [W]"], *([name, repr(value)] for name, value in watts.items())])


def percent(value: float) -> str:
    """A relative change in words."""
    digits = "+.2g" if abs(value) < 0.1 else "+,.0f"
    return f"{100 * value:{digits}} %" if np.isfinite(value) else "without end"


def _table(scene: RideScene, choice: Choice, alone: list[Alone], further: dict[Effect, float],
           seconds: tuple[list[float], list[float]]) -> list[str]:  # fmt: skip
    """The choice in words."""
    before, after = choice.before, choice.after
    names = ", ".join(effect.name for effect in choice.left_out) or "nothing"
    lines = [f"  left out: {names}"]
    lines += [f"    {effect.name}: {effect.says}" for effect in choice.left_out]
    for name, predicted, found in zip(scene.quantities, choice.predicted, choice.confirmed, strict=True):
        lines.append(f"  {name}: {percent(predicted)} predicted, {percent(found)} confirmed, tolerance "
                     f"{100 * (scene.tolerance or 0):g} %")  # fmt: skip
    lines += [f"  states {before.states} -> {after.states}; step limit {1e3 * before.step:.3g} -> "
              f"{1e3 * after.step:.3g} ms; calls per second of motion {before.calls:.4g} -> {after.calls:.4g}, "
              f"{before.calls / after.calls:.3g} times fewer; {SECONDS:g} s of motion in {cost(seconds[0])} -> "
              f"{cost(seconds[1])}"]  # fmt: skip
    lines += ["  alone, what leaving it out changes (confirmed):"]
    lines += [f"    {one.effect.name}: {', '.join(map(percent, one.confirmed))}"
              + (f" ({one.illegal})" if one.illegal else "") for one in alone]  # fmt: skip
    for effect, change in sorted(further.items(), key=lambda item: item[1]):
        lines.append(f"  {effect.name} would matter no more at a tolerance above {100 * change:.3g} %")
    worst = float(abs(choice.confirmed).max())
    return [*lines, f"  the choice holds for tolerances down to {100 * worst:.3g} %"] if choice.left_out else lines


if __name__ == "__main__":
    from studies.command_line import study

    study("ride_choice")
