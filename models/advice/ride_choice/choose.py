"""Choice of effects of a linear ride scene: which ones its quantities can do without; screened, chosen by savings,
confirmed.

A greedy choice: the next effect to be left out is the one that saves most calls at the stable step (their logarithm)
for the error that the screen predicts for the whole set; where none saves any, calls times states, if calls do not
rise. What it takes must hold:

- at every listed speed, by the exact solve, certified by the identity of covariance and adjoint;
- between the speeds, and with all parameters off by a few per cent, wherever that is worst;
- effect by effect: each one left out alone, and all but each one. An error that lives because two larger ones cancel
  holds until one of them changes.

No effect is tried whose absence alone breaks the tolerance. Where a set does not hold, the step of the path that breaks
it is found by halving, taken back for good, and the choice goes on without it. At last every effect comes back whose
absence saves no calls at equal accuracy: of runs by the classical Runge-Kutta method, each in the longest steps that
keep the tolerance. What is reported was confirmed, always.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import inf, log

import numpy as np

from models.advice.ride_choice.candidates import Candidates, EffectSet, cached_in_object
from models.advice.ride_choice.march import Cost
from models.advice.ride_choice.marched import confirms_step
from models.systems.ride.omissions import TYRE_DAMPING_EFFECT
from models.systems.ride.reduced_scene import OmissibleEffect, refusal_reason

MOST_CONFIRMATIONS = 30
"""Largest number of sets of effects that are confirmed."""
EQUAL_COST_LOG, LARGEST_CALL_RISE = 0.05, 1e-3
"""Difference of the logarithm of calls up to which two sets cost the same, and the relative rise of calls that is
allowed where a step saves states.
"""
STEP_FACTOR = 0.9
"""Factor by which a time step is shortened if no run confirms it."""
NEGLIGIBLE_SHARE = 1e-3
"""Share of the tolerance below which an error counts as none."""

SavingOfStep = Callable[[EffectSet, EffectSet], float]
"""Function for the saving by a step of the search, from a set of omitted effects to a larger one."""


@dataclass(frozen=True)
class RideChoice:
    """Result of a choice of effects: the effects ``left_out`` of all ``candidates``, and the relative changes
    (quantities,) of standard deviations that result.

    predicted_change and confirmed_change : the worst over the listed speeds, with sign; change_between_speeds : over
    all speeds of their range;
    change_with_parameters_off : the same with parameters that are off, where that is worst; within_tolerance : whether
    all of them are.
    cost_before, cost_after : cost at equal accuracy; stable_steps : the longest stable steps (s) of both, whatever the
    accuracy.
    confirmations : choices that were confirmed. refusal_texts : reasons why promising effects were not left out.
    """

    candidates: tuple[OmissibleEffect, ...]
    left_out: tuple[OmissibleEffect, ...]
    predicted_change: np.ndarray
    confirmed_change: np.ndarray
    change_between_speeds: np.ndarray
    change_with_parameters_off: np.ndarray
    within_tolerance: bool
    cost_before: Cost
    cost_after: Cost
    stable_steps: tuple[float, float]
    confirmations: int
    refusal_texts: tuple[str, ...]


class Chooser(Candidates):
    """Search for the effects that a linear ride scene can do without."""

    @cached_property
    def refusal_reasons(self) -> dict[EffectSet, str]:
        """Sets of omitted effects that kept the tolerance at all speeds but were refused, with the reasons."""
        return {}

    @cached_property
    def uncertified_sets(self) -> set[EffectSet]:
        """Sets of omitted effects that kept the tolerance but whose certificate was not exact."""
        return set()

    @cached_property
    def single_effect_sets(self) -> list[EffectSet]:
        """For each effect, the set of this effect and all effects that must be left out with it."""
        named = {effect.name: effect for effect in self.effects}
        return [frozenset([effect, *(named[name] for name in effect.needs)]) for effect in self.effects]

    @cached_property
    def sets_to_search(self) -> list[EffectSet]:
        """The sets of ``single_effect_sets`` that the search tries: all but those whose absence alone breaks the
        tolerance, since a larger set could only keep it by errors that cancel.
        """
        return [effect_set for effect_set in self.single_effect_sets if not self._breaks_alone(effect_set)]

    def _breaks_alone(self, omitted_effects: EffectSet) -> bool:
        """Whether finite changes without these effects alone break the tolerance at some speed of the range.

        Changes without end do not count: white noise that passes is nothing that another change could make up for.
        """
        if not omitted_effects or refusal_reason(omitted_effects):
            return False
        changes = self.changes_between_speeds(omitted_effects)
        return bool(np.isfinite(changes).all()) and not self.holds(changes)

    def within_tolerance(self, omitted_effects: EffectSet) -> bool:
        """Whether the tolerance holds without these effects: at all speeds of the range, with parameters off, and
        without errors that cancel each other.

        A certificate is required of the final choice and, once one has failed, of all sets for which it failed.
        """
        if not omitted_effects:
            return True
        if not (
            self.holds(self.changes_by_modes(omitted_effects))
            and self.holds(self.changes_between_speeds(omitted_effects))
        ):
            return False
        why = self._cancellation_text(omitted_effects)
        perturbed_changes = np.zeros(len(self.rows)) if why else self.off(omitted_effects)
        if not self.holds(perturbed_changes):
            why = f"changes {self.largest_change_text(perturbed_changes)} with parameters 5 % off"
        if why:
            self.refusal_reasons[omitted_effects] = why
        return not why and omitted_effects not in self.uncertified_sets

    def _cancellation_text(self, omitted_effects: EffectSet) -> str:
        """Text on an effect whose removal alone, or return alone, breaks the tolerance that the whole set keeps, since
        errors cancel; "" if there is none.
        """
        single_removals = zip(self.effects, self.single_effect_sets, strict=True)
        parts = {f"{effect.name} alone changes": step for effect, step in single_removals if step < omitted_effects}
        parts |= {f"all but {effect.name} change": omitted_effects - {effect} for effect in omitted_effects}
        for step_text, effect_set in parts.items():
            if self._breaks_alone(effect_set):
                changes_text = self.largest_change_text(self.changes_between_speeds(effect_set))
                return f"holds by errors that cancel: {step_text} {changes_text}"
        return ""

    @cached_in_object
    def _cost_by_run(self, omitted_effects: EffectSet) -> Cost:
        """Cost of a run at equal accuracy without these effects, with a step that a time simulation at the middle
        screened speed confirms.
        """
        step, marches = self.cost_at_equal_accuracy(omitted_effects).step, self.marches(omitted_effects)
        while step and not confirms_step(marches[len(marches) // 2], step):
            step *= STEP_FACTOR
        return self.cost_at_step(omitted_effects, step)

    def choose(self) -> RideChoice:
        """The choice by greedy search, confirmed, without effects whose removal saves nothing at equal accuracy."""
        chosen, rounds = self._certified_choice()
        unchanged, no_effects = np.zeros(len(self.rows)), frozenset[OmissibleEffect]()
        looks = (self.confirmed_changes, self.changes_between_speeds, self.off)
        changes, between, perturbed_changes = (look(chosen) if chosen else unchanged for look in looks)
        return RideChoice(
            self.effects,
            tuple(effect for effect in self.effects if effect in chosen),
            self.predicted_changes(chosen),
            changes,
            between,
            perturbed_changes,
            all(map(self.holds, (changes, between, perturbed_changes))),
            self._cost_by_run(no_effects),
            self._cost_by_run(chosen),
            (self.cost(no_effects).step, self.cost(chosen).step),
            rounds,
            self._refusal_texts(chosen),
        )

    def _certified_choice(self) -> tuple[EffectSet, int]:
        """The certified set of omitted effects that saves calls, and the number of sets that were tested for it."""
        rounds = 0
        while rounds < MOST_CONFIRMATIONS:
            chosen, tested = self._greedy_set()
            chosen, rounds = self._without_worthless_effects(chosen), rounds + tested
            saves = (
                self.cost_at_equal_accuracy(chosen).calls * (1 + EQUAL_COST_LOG)
                <= self.cost_at_equal_accuracy(frozenset()).calls
            )
            if not chosen or not saves:
                break
            if self.certified(chosen):
                return chosen, rounds
            self.uncertified_sets.add(chosen)
        return frozenset(), rounds

    def _refusal_texts(self, omitted_effects: EffectSet) -> tuple[str, ...]:
        """Texts on why larger sets that kept the tolerance were refused."""
        larger = {
            refused - omitted_effects: why for refused, why in self.refusal_reasons.items() if refused - omitted_effects
        }
        return tuple(
            f"{' and '.join(sorted(effect.name for effect in larger_set))} stays: without it, the choice {why}"
            for larger_set, why in larger.items()
        )

    def _greedy_set(self) -> tuple[EffectSet, int]:
        """The set of effects to leave out by greedy search, and the number of sets that were tested, also those that
        failed.
        """
        steps_taken, refused_steps, rounds = [frozenset[OmissibleEffect]()], set[EffectSet](), 0
        while rounds < MOST_CONFIRMATIONS:
            path = self.path(steps_taken, refused_steps)
            if path == steps_taken:
                break
            rounds += 1
            if self.within_tolerance(path[-1]):
                steps_taken = path
                continue
            low, high = len(steps_taken) - 1, len(path) - 1  # path[low] is kept, path[high] is not
            while high - low > 1:
                middle = (low + high) // 2
                rounds += 1
                low, high = (middle, high) if self.within_tolerance(path[middle]) else (low, middle)
            refused_steps.add(path[high] - path[low])
            steps_taken = path[: low + 1]
        return steps_taken[-1], rounds

    def _without_worthless_effects(self, omitted_effects: EffectSet) -> EffectSet:
        """The set without effects whose return costs hardly any more calls at equal accuracy, or no shorter stable
        step. Fewer calls without a longer stable step only mean that errors of reduction and of steps cancel.
        """
        fewer = [
            omitted_effects - {effect} for effect in omitted_effects if not refusal_reason(omitted_effects - {effect})
        ]
        for smaller_set in sorted(
            fewer, key=lambda candidate: float(abs(self.changes_between_speeds(candidate)).max())
        ):
            if self._costs_the_same(smaller_set, omitted_effects) and self.within_tolerance(smaller_set):
                return self._without_worthless_effects(smaller_set)
        return omitted_effects

    def _costs_the_same(self, smaller_set: EffectSet, omitted_effects: EffectSet) -> bool:
        """Whether a run without ``smaller_set`` has no shorter stable step than one without the larger set, or about as
        few calls at equal accuracy.
        """
        stable = self.cost(smaller_set).step
        if stable >= self.cost(omitted_effects).step * (1 - EQUAL_COST_LOG):
            return True
        if stable < self.cost_at_equal_accuracy(omitted_effects).step * (1 - EQUAL_COST_LOG):
            return False  # what is in the larger one alone bounds the step
        return self.cost_at_equal_accuracy(smaller_set).calls <= self.cost_at_equal_accuracy(omitted_effects).calls * (
            1 + EQUAL_COST_LOG
        )

    def change_if_left_out_too(self, omitted_effects: EffectSet) -> dict[OmissibleEffect, float]:
        """Largest relative change for each effect that stayed, if it were left out as well with what it needs: with a
        larger tolerance than this, it could be. Only legal sets and finite changes.
        """
        changes = {
            effect: float(abs(self.changes_by_modes(omitted_effects | step)).max())
            for effect, step in zip(self.effects, self.single_effect_sets, strict=True)
            if effect not in omitted_effects and not refusal_reason(omitted_effects | step)
        }
        return {effect: change for effect, change in changes.items() if change < inf}

    def path(self, sets_so_far: list[EffectSet], refused_additions: set[EffectSet]) -> list[EffectSet]:
        """Growing sets of omitted effects: ``sets_so_far``, continued one step at a time as far as predictions allow.

        A step saves calls, or where none does, work; there is none where none is within the tolerance.
        """
        path = list(sets_so_far)
        while step := self._best_step(path[-1], refused_additions, self._calls_saved) or self._best_step(
            path[-1], refused_additions, self._work_saved
        ):
            path.append(path[-1] | step)
        return path

    def _calls_saved(self, omitted_effects: EffectSet, added_effects: EffectSet) -> float:
        """Logarithm of the ratio by which leaving out more effects reduces the calls; 0 for ratios too small to spend
        tolerance on.
        """
        calls_after = self.cost(added_effects).calls
        saved = log(self.cost(omitted_effects).calls / calls_after) if calls_after < inf else 0.0
        return saved if saved > EQUAL_COST_LOG else 0.0

    def _work_saved(self, omitted_effects: EffectSet, added_effects: EffectSet) -> float:
        """Logarithm of the ratio by which leaving out more effects reduces calls times states; 0 where calls rise."""
        cost_now, cost_after = self.cost(omitted_effects), self.cost(added_effects)
        return (
            log(cost_now.work / cost_after.work)
            if cost_after.calls <= cost_now.calls * (1 + LARGEST_CALL_RISE)
            else 0.0
        )

    def _smallest_sets(self) -> list[EffectSet]:
        """The smallest sets that can be left out. A set that lets white noise reach a quantity is also tried together
        with the tyres' damping, through which this noise enters.
        """
        damping = frozenset(effect for effect in self.effects if effect.name == TYRE_DAMPING_EFFECT)
        white = [
            step for step in self.sets_to_search if damping and not np.isfinite(self.predicted_changes(step)).all()
        ]
        return self.sets_to_search + [step | damping for step in white]

    def _best_step(
        self, omitted_effects: EffectSet, refused_additions: set[EffectSet], saving_of_addition: SavingOfStep
    ) -> EffectSet:
        """The set of effects that saves the most for what it adds to the predicted error; empty if none keeps the
        tolerance.
        """
        best, best_score, current_share = frozenset[OmissibleEffect](), 0.0, self.share(omitted_effects)
        for step in self._smallest_sets():
            further = omitted_effects | step
            if (
                further == omitted_effects
                or step - omitted_effects in refused_additions
                or step in refused_additions
                or refusal_reason(further)
            ):
                continue
            saves = saving_of_addition(omitted_effects, further)
            if saves <= NEGLIGIBLE_SHARE * best_score:
                continue  # whatever error it adds
            share = self.share(further)
            score = saves / max(share - current_share, NEGLIGIBLE_SHARE) if share <= 1.0 else 0.0
            if score > best_score:
                best, best_score = step - omitted_effects, score
        return best
