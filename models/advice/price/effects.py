"""The price list of a scene's effects: what each effect costs and what it changes, measured by short paired runs.

An effect that the scene names is compared with the scene without it, one that it could have with the scene that has
it, at its usual values. Runs take turns in a random order, and seconds are compared within a turn only.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from models.advice.choice.answer import (
    RunQuantities,
    difference_of_runs,
    largest_relative_change,
    rounding_floor,
    sampled_change_and_error,
)
from models.advice.choice.variants import Variants, module_of_system
from models.core.assumptions import collected_broken_assumptions
from models.core.errors import InputError, RunFailed
from models.machine.timing import paired_ratio, timing_statistics
from models.systems.ride.of_scene import needs_run_in_time

PRICED_STEP_LIMIT = 960
"""Number of steps of a run, at most, over which effects are priced."""
TIMING_ROUNDS, LEAST_ROUNDS, LONG_ROUNDS_SECONDS = 7, 3, 10.0
"""Number of timing turns, in each of which every variant runs once; the fewer turns, and the total CPU seconds above
which only these are made.
"""
TURN_ORDER_SEED = 11


@dataclass(frozen=True)
class QuantityChange:
    """Largest change of a quantity among all cases: absolute, as the rms difference of a time history or the difference
    of a number, and relative to the quantity's size. chance : statistical error of the relative change.
    """

    name: str
    unit: str
    absolute: float
    relative: float
    chance: float = 0.0


@dataclass(frozen=True)
class EffectPrice:
    """Price of an effect that a scene has (``there``) or could have; ``why`` : reason why it has no price, "" where it
    has one.

    counts : steps, calls, states without and with it; micros : CPU microseconds of a step that it adds, median and
    median absolute deviation of the turns; ratio : of seconds with it by those without, and its 95 % interval;
    changes : of every quantity, the largest relative one first; gone : quantities that are there with it alone; keeps :
    assumptions that are broken without it, and kept with it.
    """

    name: str
    there: bool
    says: str
    why: str = ""
    counts: tuple[dict[str, int], dict[str, int]] = ({}, {})
    micros: tuple[float, float] = (np.nan, np.nan)
    ratio: tuple[float, float, float] = (np.nan, np.nan, np.nan)
    changes: tuple[QuantityChange, ...] = ()
    gone: tuple[str, ...] = ()
    keeps: tuple[str, ...] = ()


@dataclass(frozen=True)
class PriceList:
    """Price list of a scene's effects in one implementation. each : largest number of steps of a priced run; whole :
    steps of the complete run.

    micros : CPU microseconds of a step of the scene as it is, median and median absolute deviation.
    """

    title: str
    engine: str
    each: int
    whole: int
    counts: dict[str, int]
    micros: tuple[float, float]
    prices: tuple[EffectPrice, ...]


def price_list(scene: Any, engine: str | None = None) -> PriceList:
    """Price list of effects from runs of the scene, and of every variant with one effect more or one less. Raises
    InputError or RunFailed where the scene itself cannot be run.
    """
    if scene.system == "ride" and not needs_run_in_time(scene):
        from models.advice.price.effects_of_ride import price_list_of_ride

        return price_list_of_ride(scene)
    system = module_of_system(scene)
    engine = engine or system.DEFAULT_ENGINE
    complete = Variants(scene, engine)
    variants = complete.window(PRICED_STEP_LIMIT)
    short, names = variants.scene, (*variants.effects, *variants.absent_effect_names)
    with collected_broken_assumptions() as broken_alone:
        base: RunQuantities = system.computed_quantities(short, engine)
    runs: dict[str, Callable[[], RunQuantities]] = {"": partial(system.computed_quantities, short, engine)}
    first, whys, keeps = {"": base}, dict[str, str](), dict[str, tuple[str, ...]]()
    for name in names:
        try:
            changed_scene = (
                variants.changed_scene(frozenset([name]))
                if name in variants.effects
                else variants.scene_with_effect(name)
            )
            with collected_broken_assumptions() as breaches:
                first[name], runs[name] = (
                    system.computed_quantities(changed_scene, engine),
                    partial(system.computed_quantities, changed_scene, engine),
                )
            without, broken_in_changed = (
                (breaches, broken_alone) if name in variants.effects else (broken_alone, breaches)
            )
            keeps[name] = tuple(assumption.says for key, assumption in without.items() if key not in broken_in_changed)
        except (InputError, RunFailed) as error:
            whys[name] = getattr(error, "why", "") or getattr(error, "allowed", "") or str(error)
    micros = _microseconds_by_turn(runs)
    prices = [
        replace(
            _price_of_effect(variants, name, base, first.get(name), micros.get(name), micros[""], whys.get(name, "")),
            keeps=keeps.get(name, ()),
        )
        for name in names
    ]
    return PriceList(
        scene.title,
        engine,
        system.step_count(short),
        system.step_count(complete.scene),
        base.counts,
        median_and_deviation(micros[""]),
        tuple(prices),
    )


def _microseconds_by_turn(run_functions: dict[str, Callable[[], RunQuantities]]) -> dict[str, np.ndarray]:
    """CPU microseconds of a step (turns,) for every run; the runs take turns in random order."""
    micros = dict[str, list[float]]({name: [] for name in run_functions})
    order, names, start_time = np.random.default_rng(TURN_ORDER_SEED), list(run_functions), time.process_time()
    for i in range(TIMING_ROUNDS):
        if i >= LEAST_ROUNDS and (time.process_time() - start_time) * (i + 1) > i * LONG_ROUNDS_SECONDS:
            break
        for j in order.permutation(len(names)):
            outcome = run_functions[names[j]]()
            micros[names[j]].append(1e6 * outcome.seconds / outcome.counts["steps"])
    return {name: np.array(values) for name, values in micros.items()}


def median_and_deviation(samples: np.ndarray) -> tuple[float, float]:
    """Median and median absolute deviation of ``samples`` (n,), in their unit."""
    statistics = timing_statistics(samples.tolist())
    return statistics["median"], statistics["mad"]


def _price_of_effect(
    variants: Variants,
    effect_name: str,
    scene_quantities: RunQuantities,
    changed_quantities: RunQuantities | None,
    changed_microseconds: np.ndarray | None,
    scene_microseconds: np.ndarray,
    refusal_reason: str,
) -> EffectPrice:
    """Price of one effect from a run of the scene and a run with this effect added or left out."""
    is_present, says = effect_name in variants.effects, variants.sentence_on_effect(effect_name)
    if changed_quantities is None or changed_microseconds is None:
        return EffectPrice(effect_name, is_present, says, refusal_reason)
    quantities_without, quantities_with = (
        (changed_quantities, scene_quantities) if is_present else (scene_quantities, changed_quantities)
    )
    slow, fast = (
        (scene_microseconds, changed_microseconds) if is_present else (changed_microseconds, scene_microseconds)
    )
    seconds = np.maximum(slow, 1e-9), np.maximum(fast, 1e-9)
    gone = tuple(key for key in quantities_with.quantities if key not in quantities_without.quantities)
    return EffectPrice(
        effect_name,
        is_present,
        says,
        "",
        (quantities_without.counts, quantities_with.counts),
        median_and_deviation(slow - fast),
        paired_ratio(*seconds),
        _quantity_changes(scene_quantities, changed_quantities),
        gone,
    )


def _quantity_changes(scene_quantities: RunQuantities, changed_quantities: RunQuantities) -> tuple[QuantityChange, ...]:
    """Changes of the quantities that both runs have, relative to their size in the complete scene."""
    changed = []
    for name, quantity in scene_quantities.quantities.items():
        if name in changed_quantities.quantities:
            try:
                change = difference_of_runs(changed_quantities.quantities[name].case_values, quantity.case_values)
            except (InputError, ValueError):  # of other lengths, or of another number of cases
                continue
            size = quantity.reference_sizes
            if quantity.is_mean_of_samples:
                share, chance = sampled_change_and_error(change, quantity.case_values)
                changed.append(QuantityChange(name, quantity.unit, share * float(size.max()), share, chance))
                continue
            largest_difference = max(float(np.sqrt(np.mean(difference**2))) for difference in change)
            is_changed = largest_difference > rounding_floor(scene_quantities, quantity.unit)
            changed.append(
                QuantityChange(
                    name,
                    quantity.unit,
                    largest_difference,
                    largest_relative_change(change, size) if is_changed else 0.0,
                )
            )
    return tuple(sorted(changed, key=lambda difference: -difference.relative))
