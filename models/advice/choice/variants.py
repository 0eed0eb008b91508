"""Variants of a scene without some of its effects and with longer time steps; each is run once, and its quantities are
stored.
"""

import math
from collections.abc import Iterable
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from types import ModuleType
from typing import Any

from models.advice.choice.answer import RunQuantities
from models.core.assumptions import BrokenAssumption, collected_broken_assumptions, result_observer
from models.core.errors import InputError, RunFailed
from models.core.result import Result
from models.core.scene_effects import (
    absent_effects,
    effect_of,
    named_effects,
    rebuilt_scene,
    scene_without,
    table_without_defaults,
    with_effects,
)
from models.core.systems import modules_of
from models.ensemble.runner import block_results

EffectSet = frozenset[str]
VariantKey = tuple[EffectSet, int]
"""Key of a variant: the effects that are left out, and the factor by which its steps are longer."""
VariantOutcome = tuple[RunQuantities | None, dict[str, BrokenAssumption]]
"""Outcome of a variant: its quantities, None where the run fails, and the assumptions that it breaks."""
LARGEST_STEP_FACTOR = 128
"""Largest factor by which the scene's step is lengthened."""
SHORTEST_PART_STEPS = 60
"""Number of steps of which whole multiples make up a part of a run, so that the part can be computed with longer steps,
too.
"""
TIMED_RUNS, LEAST_TIMED_SECONDS = 3, 0.02
"""Most timed runs, of which the shortest counts, and the time (s) after which two are enough; the first run may have to
load code.
"""


def module_of_system(scene: Any) -> ModuleType:
    """The module that runs scenes of this scene's system for a price or a choice; InputError where there is none."""
    files = modules_of("models.advice.choice.systems")
    if scene.system not in files:
        raise InputError(
            scene.file,
            "system",
            scene.system,
            "has no runs in time that effects could be priced or "
            "chosen by: linear scenes of ride have closed forms, and scenes of these systems have runs",
            tuple(files),
        )
    return import_module(files[scene.system])


@dataclass
class Variants:
    """Runs of a ``scene`` by one implementation. A variant is given by the effects that are left out and by the factor
    of its step.

    None represents a variant that is impossible, or whose run fails. ``executor`` : computes runs in advance. ``calls``
    : of all runs that were requested so far, without repetitions for their seconds. Runs in advance that are never
    requested do not count, so that no choice depends on the executor.
    """

    scene: Any
    engine: str
    executor: Executor | None = None
    system: ModuleType = field(init=False)
    calls: int = 0
    _quantities_of_variant: dict[VariantKey, RunQuantities | None] = field(default_factory=dict)
    _seconds_per_call: dict[EffectSet, float] = field(default_factory=dict)
    _assumptions_broken: dict[VariantKey, dict[str, BrokenAssumption]] = field(default_factory=dict)
    _computed_in_advance: dict[VariantKey, VariantOutcome] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.system = module_of_system(self.scene)
        self.scene = self.system.copies_of_scene(self.scene) if self._knows_effects else self.scene
        self._job = partial(_run_variant_in_worker, self.scene, self.engine)

    @property
    def _knows_effects(self) -> bool:
        """Whether the system replaces the scene by an object that knows its effects and makes its own variants."""
        return hasattr(self.system, "copies_of_scene")

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that the scene has."""
        return tuple(self.scene.effect_names) if self._knows_effects else named_effects(self.scene)

    @property
    def absent_effect_names(self) -> tuple[str, ...]:
        """Names of the effects that the scene does not have."""
        return tuple(self.scene.absent_effect_names) if self._knows_effects else absent_effects(self.scene)

    def scene_with_effect(self, effect_name: str) -> Any:
        """The scene with an absent effect added at its usual values; InputError where it cannot be added."""
        return self.scene.with_effect(effect_name) if self._knows_effects else with_effects(self.scene, effect_name)

    def sentence_on_effect(self, effect_name: str) -> str:
        """Sentence that describes an effect, or what leaving it out means."""
        sentences = self.scene.effect_sentences if self._knows_effects else {}
        return str(sentences.get(effect_name) or effect_of(self.scene.system, effect_name).__doc__ or "").partition(
            "\n"
        )[0]

    def quantities_of_run(self, omitted_effects: Iterable[str] = (), step_factor: int = 1) -> RunQuantities | None:
        """Quantities of the run without these effects, with steps longer by ``step_factor``; None if the run fails."""
        key = (frozenset(omitted_effects), step_factor)
        if key not in self._quantities_of_variant:
            answer, self._assumptions_broken[key] = (
                self._computed_in_advance.pop(key) if key in self._computed_in_advance else self.run(key)
            )
            self._quantities_of_variant[key] = answer
            self.calls += answer.counts["calls"] if answer else 0
        return self._quantities_of_variant[key]

    def compute_in_advance(self, variant_keys: Iterable[VariantKey]) -> None:
        """Let the executor compute runs that will probably be requested; without an executor no run is computed in
        advance.
        """
        if self.executor is not None:
            new = [
                key
                for key in dict.fromkeys(variant_keys)
                if key not in self._quantities_of_variant and key not in self._computed_in_advance
            ]
            self._computed_in_advance |= zip(new, block_results(self._job, new, self.executor), strict=True)

    def run(self, variant_key: VariantKey) -> VariantOutcome:
        """Run a variant, even if it was run before; returns its quantities, None where the run fails, and the
        assumptions that it breaks.
        """
        with collected_broken_assumptions() as broken:
            return self._run(*variant_key), broken

    def _run(self, omitted_effects: EffectSet, step_factor: int) -> RunQuantities | None:
        try:
            answer: RunQuantities = self.system.computed_quantities(
                self.changed_scene(omitted_effects, step_factor), self.engine
            )
        except (InputError, RunFailed):
            return None
        return answer

    def newly_broken(self, omitted_effects: EffectSet, step_factor: int = 1) -> list[BrokenAssumption]:
        """Assumptions that the complete scene keeps, and that the run without these effects breaks."""
        if self.quantities_of_run(omitted_effects, step_factor) is None or self.quantities_of_run() is None:
            return []
        known = self._assumptions_broken[frozenset(), 1]
        return [
            broken
            for name, broken in self._assumptions_broken[omitted_effects, step_factor].items()
            if name not in known
        ]

    def results_with_errors(self, omitted_effects: EffectSet, step_factor: int = 1) -> list[Result]:
        """Results of a variant together with their error estimates; its runs are repeated for that."""
        results: list[Result] = []
        with suppress(RunFailed), result_observer(results.append):  # raised where an error is as large as what it is of
            self.system.computed_quantities(
                self.changed_scene(omitted_effects, step_factor), self.engine, with_error_estimate=True
            )
        return results

    def changed_scene(self, omitted_effects: EffectSet, step_factor: int = 1) -> Any:
        """The scene without these effects and with a longer step; InputError where there can be no such scene."""
        if self._knows_effects:
            return self.scene.without(omitted_effects).in_longer_steps(step_factor)
        scene = scene_without(self.scene, *sorted(omitted_effects)) if omitted_effects else self.scene
        if step_factor == 1:
            return scene
        table = table_without_defaults(scene)
        self.system.lengthen_steps(table, scene, step_factor)
        return rebuilt_scene(table, scene)

    def work(self, omitted_effects: EffectSet, step_factor: int = 1) -> float:
        """Work of a run, from counts alone, so that it repeats exactly: right-hand side calls times the sum of states,
        terms and remaining effects; infinite where the run fails.
        """
        run = self.quantities_of_run(omitted_effects, step_factor)
        if run is None:
            return math.inf
        size_of_call = run.counts["states"] + run.counts.get("terms", 0) + len(set(self.effects) - omitted_effects)
        return float(run.counts["calls"] * max(size_of_call, 1))

    def seconds_per_call(self, omitted_effects: EffectSet) -> float:
        """CPU seconds of one right-hand side call, the least of a few runs in this process; infinite where no run
        succeeds.
        """
        if omitted_effects not in self._seconds_per_call:
            took, run = (
                list[float](),
                self.quantities_of_run(omitted_effects) if self.executor is None else self._run(omitted_effects, 1),
            )
            while run is not None and (len(took) < 2 or (len(took) < TIMED_RUNS and sum(took) < LEAST_TIMED_SECONDS)):
                took.append(run.seconds)
                self._seconds_per_call[omitted_effects] = min(took) / run.counts["calls"]
                run = self._run(omitted_effects, 1)
            self._seconds_per_call.setdefault(omitted_effects, math.inf)
        return self._seconds_per_call[omitted_effects]

    def step_factors(self) -> list[int]:
        """Factors by which the step may be lengthened so that a whole number of steps still fits into the run."""
        count = self.system.divisible_step_count(self.scene)
        return [
            step_factor for step_factor in range(1, min(count, LARGEST_STEP_FACTOR) + 1) if count % step_factor == 0
        ]

    def window(self, least_step_count: int) -> "Variants":
        """Variants of the first part of the run, at least ``least_step_count`` steps long; of the whole run where the
        part would be hardly shorter.

        The length is one that the scene may have, for example whole samples of a measurement.
        """
        if self._knows_effects:
            return Variants(self.scene.with_fewer_copies(least_step_count), self.engine, self.executor)
        count = self.system.step_count(self.scene)
        for part_steps in (n for n in range(least_step_count, count) if n % SHORTEST_PART_STEPS == 0 or count % n == 0):
            table = table_without_defaults(self.scene)
            self.system.shorten_run(table, self.scene, part_steps)
            with suppress(InputError):
                return Variants(rebuilt_scene(table, self.scene), self.engine, self.executor)
        return self


def _run_variant_in_worker(scene: Any, engine: str, variant_key: VariantKey) -> VariantOutcome:
    """Run a variant of a scene in a worker process; returns what ``Variants.run`` returns."""
    return Variants(scene, engine).run(variant_key)
