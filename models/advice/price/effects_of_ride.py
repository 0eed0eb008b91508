"""The price list of effects of a linear stationary ride scene, in closed form: states, calls at the step limit,
standard deviations.

Only microseconds are measured, those of a step of the classical Runge-Kutta method on the vehicle's own matrix.
"""

import time
from typing import Any

import numpy as np

from models.advice.price.effects import (
    TIMING_ROUNDS,
    TURN_ORDER_SEED,
    EffectPrice,
    PriceList,
    QuantityChange,
    median_and_deviation,
)
from models.advice.ride_choice.march import cost
from models.advice.ride_choice.reduced import FullScene, Reduced
from models.advice.ride_choice.screen import exact_variances
from models.core.errors import InputError
from models.core.runge_kutta import runge_kutta_step
from models.core.scene_effects import absent_effects, effect_sentences, with_effects
from models.machine.timing import paired_ratio
from models.systems.ride.of_scene import scene_errors
from models.systems.ride.omissions import effects_of
from models.systems.ride.reduced_scene import OmissibleEffect, ReducedScene, reduced_without, refusal_reason

TIMED_STEPS = 500
"""Number of Runge-Kutta steps that are timed in every turn."""


def price_list_of_ride(scene: Any) -> PriceList:
    """Price list of a ride scene's effects at its middle speed, in closed form; InputError for a scene whose speed
    varies.
    """
    if scene.speeds is None:
        raise InputError(scene.file, "drive", None, "has no effects priced in closed form: give [speeds]")
    speeds = scene.speeds.all()
    with scene_errors(scene):
        full = FullScene(ReducedScene.complete(scene), float(speeds[len(speeds) // 2]))
        effects = effects_of(full.scene)
        systems_without_effect = {effect.name: _without_effect(full, effect) for effect in effects}
    with_added_effect = {name: _with_added_effect(scene, name, full.speed) for name in absent_effects(scene)}
    systems = {
        name: system
        for name, system in ({"": full.full} | systems_without_effect | with_added_effect).items()
        if isinstance(system, Reduced)
    }
    micros = _microseconds_by_turn(systems)
    says = effect_sentences(scene.system)
    prices = [
        _price_of_effect(full, effect.name, effect.says, systems_without_effect[effect.name], micros)
        for effect in effects
    ]
    prices += [
        _price_of_effect(full, name, says[name], with_added_effect[name], micros, is_present=False)
        for name in with_added_effect
    ]
    return PriceList(
        f"{scene.title} (at {full.speed:g} m/s)",
        "closed form",
        TIMED_STEPS,
        TIMED_STEPS,
        _counts_of_scene(full.full),
        median_and_deviation(micros[""]),
        tuple(prices),
    )


def _without_effect(full_scene: FullScene, omitted_effect: OmissibleEffect) -> Reduced | str:
    """The linear ride system without an effect, or the reason why it cannot be left out."""
    why = refusal_reason([omitted_effect])
    if why:
        return why
    try:
        return full_scene.reduced(reduced_without(full_scene.scene, [omitted_effect]))
    except InputError as error:
        return error.allowed


def _with_added_effect(scene: Any, effect_name: str, speed: float) -> Reduced | str:
    """The linear ride system with one more effect at its usual values, or the reason why it cannot be added."""
    try:
        return FullScene(ReducedScene.complete(with_effects(scene, effect_name)), speed).full
    except InputError as error:
        return error.allowed


def _counts_of_scene(linear_system: Reduced) -> dict[str, int]:
    """Counts of a linear ride system: states, and right-hand side calls per second of motion with the longest stable
    step.
    """
    of_run = cost(linear_system.reduced_vehicle, linear_system.excitation)
    return {"states": of_run.states, "calls per second": round(of_run.calls) if np.isfinite(of_run.calls) else 0}


def _microseconds_by_turn(linear_systems: dict[str, Reduced]) -> dict[str, np.ndarray]:
    """CPU microseconds of a step (TIMING_ROUNDS,) for every system; the systems take turns in random order."""
    micros, order = {name: np.empty(TIMING_ROUNDS) for name in linear_systems}, np.random.default_rng(TURN_ORDER_SEED)
    for i in range(TIMING_ROUNDS):
        for j in order.permutation(len(linear_systems)):
            name, system = list(linear_systems.items())[j]
            micros[name][i] = _step_microseconds(system.system.A[: system.states, : system.states])
    return micros


def _step_microseconds(A: np.ndarray) -> float:
    """CPU microseconds of one Runge-Kutta step of x' = A x with the state matrix A."""
    x, step = np.ones(len(A)), 1e-6
    start_time = time.process_time()
    for _ in range(TIMED_STEPS):
        x = runge_kutta_step(lambda _, state: A @ state, 0.0, x, step)
    return 1e6 * (time.process_time() - start_time) / TIMED_STEPS


def _price_of_effect(
    full_scene: FullScene,
    effect_name: str,
    description: str,
    changed_system: Reduced | str,
    microseconds: dict[str, np.ndarray],
    is_present: bool = True,
) -> EffectPrice:
    """Price of an effect. ``changed_system`` is the scene without the effect if it ``is_present``, else the scene with
    it.
    """
    if isinstance(changed_system, str):
        return EffectPrice(effect_name, is_present, description, changed_system)
    without_it, with_it = ((changed_system, microseconds[effect_name]), (full_scene.full, microseconds[""]))[
        :: 1 if is_present else -1
    ]
    gone = tuple(key for key in with_it[0].system.names if key not in without_it[0].system.names)
    return EffectPrice(
        effect_name,
        is_present,
        description,
        "",
        (_counts_of_scene(without_it[0]), _counts_of_scene(with_it[0])),
        median_and_deviation(with_it[1] - without_it[1]),
        paired_ratio(with_it[1].tolist(), without_it[1].tolist()),
        _deviation_changes(full_scene, changed_system),
        gone,
    )


def _deviation_changes(full_scene: FullScene, reduced_system: Reduced) -> tuple[QuantityChange, ...]:
    """Changes of the outputs' standard deviations, exact; infinite where white noise reaches an output."""
    names = full_scene.full.system.names
    units = [output.unit for output in full_scene.linear.outputs]
    units += ["m/s^2"] * (len(names) - len(units))  # weighted accelerations come last
    try:
        with np.errstate(invalid="ignore"):
            full, without = (
                np.sqrt(exact_variances(system, list(range(len(names)))))
                for system in (full_scene.full, reduced_system)
            )
    except InputError:
        return ()
    changes = [
        QuantityChange(name, unit, float(abs(b - a)), float(abs(b / a - 1.0)))
        for name, unit, a, b in zip(names, units, full, without, strict=True)
        if np.isfinite(a) and a > 0.0
    ]
    return tuple(sorted(changes, key=lambda change: -change.relative))
