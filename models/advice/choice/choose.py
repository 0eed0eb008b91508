"""Choice of effects: which ones a scene's quantities can do without, and how long its time steps may be.

Screened are cheap runs: with steps as much longer as costs a small share of the tolerance over the first part of the
scene; without single effects, and without pairs. Of all that the screen keeps within the tolerance, the next to go is
the effect, or the pair where no single one will do, that saves most (logarithm of work at the longest step that is then
allowed) for what it adds to the error. Work is counted and not timed, so that the choice repeats on any machine. What
is left is run over the whole scene, beside the scene as it is. Where it is not within the tolerance, steps become
shorter; if that does not help, the step of the path that breaks it is found by halving and taken back for good, and the
choice goes on without it. A run that breaks an assumption which the scene keeps is not within any tolerance. So what is
reported was confirmed, always; the scene as it is holds with no error at all.

Where quantities are means of samples that are alike, few samples find the set, and all of them tell what it changes.
The search ends where it has taken as many calls as so many runs of the scene: what it has found by then is confirmed,
and larger sets were not tried.
"""

import math
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import numpy as np

from models.advice.choice.answer import sum_of_differences
from models.advice.choice.screen import EffectScreen
from models.advice.choice.variants import EffectSet, Variants
from models.core.assumptions import BrokenAssumption
from models.core.errors import InputError

TOLERANCE_SHARE_OF_PREDICTION = 0.8
"""Share of the tolerance that the predicted change may use."""
TOLERANCE_SHARE_OF_SCREENING_STEP = 0.05
"""Share of the tolerance that the longer steps of screening runs may cost."""
TOLERANCE_SHARE_OF_SAMPLED_STEP = 0.15
"""Share as TOLERANCE_SHARE_OF_SCREENING_STEP for samples that met the same roads: both compared runs have the step
error.
"""
STEP_CHECK_REFINEMENT = 8
"""Factor by which steps are refined to find the error of the longest ones."""
RUN_SHARE_FOR_STEP_SEARCH = 0.25
"""Share of a run over which the longest steps of screening runs are searched."""
NEGLIGIBLE_TOLERANCE_SHARE = 1e-3
"""Share of the tolerance below which an error counts as none."""
STEP_REDUCTION_LIMIT = 2
"""Number of times that steps become shorter after a failed confirmation, before effects are put back."""
CONFIRMATION_LIMIT = 30
"""Largest number of sets of effects that are confirmed by runs of the whole scene."""
PAIRS_COMPUTED_IN_ADVANCE = 16
"""Number of pairs of effects whose runs the executor computes in advance at once."""
SEARCH_BUDGET_IN_RUNS = 100
"""Largest cost of the search in right-hand side calls, as a multiple of one run of the whole scene."""


@dataclass(frozen=True)
class EffectChoice:
    """Result of a choice of effects: the effects ``left_out`` of all ``candidates``, the factor ``step_factor`` by
    which the step is longer, and relative changes (quantities,).

    predicted_change : by the screen; prediction_remainder : estimate of what the prediction omits; confirmed_change :
    over the whole run; statistical_error : of the confirmed change, where quantities are means of samples;
    within_tolerance : whether each sum of both is. calls and seconds (CPU) : of the scene, of the scene with longer
    steps alone, and of the reduced scene. confirmations : runs of the whole scene for confirmation; calls_of_search :
    calls of all runs. sample_factor : factor, roughly, by which more samples would let more effects be left out, 0
    where statistical errors prevent nothing. ended_early : whether the search ended before all sets were tried.
    assumptions_barring : for effects that stay, the assumptions that the scene keeps and that would be broken without
    them.
    """

    candidates: tuple[str, ...]
    left_out: tuple[str, ...]
    step_factor: int
    predicted_change: np.ndarray
    prediction_remainder: np.ndarray
    confirmed_change: np.ndarray
    statistical_error: np.ndarray
    within_tolerance: bool
    calls: tuple[int, ...]
    seconds: tuple[float, ...]
    confirmations: int
    calls_of_search: int
    sample_factor: float
    ended_early: bool = False
    assumptions_barring: dict[str, list[BrokenAssumption]] = field(default_factory=dict)


class EffectChooser:
    """Search for the effects that a scene can do without, for given quantities (see ``models.advice.choice.answer``), a
    tolerance and one implementation.

    report_progress(share) : called with the share that is spent of the runs that the search may make. executor :
    computes the runs without one or two effects that the screen will need; runs that confirm, and timed runs, are made
    by this process.
    """

    def __init__(
        self,
        scene: Any,
        engine: str,
        quantities: list[str],
        tolerance: float,
        report_progress: Callable[[float], None] = lambda share: None,
        executor: Executor | None = None,
    ) -> None:
        self.tolerance, self.report_progress = tolerance, report_progress
        self.whole = EffectScreen(Variants(scene, engine, executor), quantities)
        self.all_sampled = self.whole.sampled == set(quantities)
        partial_screen = self._partial_screen()
        self.step_factor, self.error = self._longest_screen_step(partial_screen)
        self.reporting_screen = self._coarse_screen(self.whole)
        self.screen = self._coarse_screen(partial_screen) if self.all_sampled else self.reporting_screen
        self.step_factors = [self.step_factor * k for k in self.screen.variants.step_factors()]
        self.effects = self.whole.variants.effects
        self._longest_step_factors: dict[EffectSet, int] = {}
        self._confirmed: dict[EffectSet, tuple[int, np.ndarray, np.ndarray]] = {}
        self._pairs: list[EffectSet] | None = None
        self.rounds, self._sample_factors, self.ended = 0, list[float](), False

    def _partial_screen(self) -> EffectScreen:
        """Screen over a part of the run or over a few of its samples; over all of it if it cannot be cut."""
        all_variants = self.whole.variants
        if not all_variants.system.PART_REPRESENTS_RUN:
            return self.whole
        partial_variants = all_variants.window(
            math.ceil(RUN_SHARE_FOR_STEP_SEARCH * all_variants.system.step_count(all_variants.scene))
        )
        return self.whole if partial_variants is all_variants else EffectScreen(partial_variants, self.whole.quantities)

    def _coarse_screen(self, screen: EffectScreen) -> EffectScreen:
        """Screen of the same runs with steps longer by the factor ``step_factor``."""
        runs = screen.variants
        coarse = Variants(runs.changed_scene(frozenset(), self.step_factor), runs.engine, runs.executor)
        return screen if self.step_factor == 1 else EffectScreen(coarse, screen.quantities)

    def _longest_screen_step(self, screen: EffectScreen) -> tuple[int, np.ndarray]:
        """Longest step factor of screening runs, and the relative changes (quantities,) that it causes."""
        all_variants = self.whole.variants
        step_factors = [k for k in all_variants.step_factors() if k in screen.variants.step_factors()]
        allowed = (
            TOLERANCE_SHARE_OF_SAMPLED_STEP if self.all_sampled else TOLERANCE_SHARE_OF_SCREENING_STEP
        ) * self.tolerance
        longest, error = self._longest_allowed_step(screen, frozenset(), step_factors, allowed)
        while all_variants.quantities_of_run(step_factor=longest) is None:  # its run fails after that part
            longest = max(k for k in step_factors if k < longest)
        return longest, error

    def _longest_allowed_step(
        self, screen: EffectScreen, omitted_effects: EffectSet, step_factors: list[int], largest_change: float
    ) -> tuple[int, np.ndarray]:
        """Longest step of ``step_factors`` that changes no quantity by more than ``largest_change``, by bisection, and
        its relative changes (quantities,). The first step is always allowed.
        """
        low, high, shares = 0, len(step_factors), np.zeros(len(screen.quantities))
        while high - low > 1:
            middle = (low + high) // 2
            tried = screen.change_by_longer_steps(omitted_effects, step_factors[middle] // step_factors[0])
            low, high, shares = (middle, high, tried) if (tried <= largest_change).all() else (low, middle, shares)
        return step_factors[low], shares

    def tolerance_share(self, omitted_effects: EffectSet) -> float:
        """Ratio of the largest predicted change, with an estimate of what the prediction omits, to the tolerance;
        infinite where leaving the effects out breaks an assumption that the scene keeps.
        """
        if self.breaks_assumption(omitted_effects):
            return math.inf
        error = (
            self.error
            + self.screen.predicted_change(omitted_effects)
            + self.screen.higher_order_estimate(omitted_effects)
        )
        return float(np.max(error)) / self.tolerance

    def breaks_assumption(self, omitted_effects: EffectSet) -> bool:
        """Whether leaving out these effects breaks an assumption that the scene keeps. For more than two, predicted
        from pairs: some effect breaks one in every pair with another effect.
        """
        runs = self.screen.variants
        if len(omitted_effects) <= 2:
            return bool(runs.newly_broken(omitted_effects))
        return any(
            all(runs.newly_broken(frozenset([effect, other_effect])) for other_effect in omitted_effects - {effect})
            for effect in omitted_effects
        )

    def longest_step_factor(self, omitted_effects: EffectSet) -> int:
        """Longest step without these effects that the predictions allow, as a multiple of the scene's step."""
        if omitted_effects not in self._longest_step_factors:
            left = max(0.0, TOLERANCE_SHARE_OF_PREDICTION - self.tolerance_share(omitted_effects)) * self.tolerance
            self._longest_step_factors[omitted_effects], _ = self._longest_allowed_step(
                self.screen, omitted_effects, self.step_factors, left
            )
        return self._longest_step_factors[omitted_effects]

    def predicted_work(self, omitted_effects: EffectSet) -> float:
        """Predicted work of a run without these effects with the longest allowed step; infinite if the run fails."""
        return self.screen.variants.work(omitted_effects, self.longest_step_factor(omitted_effects) // self.step_factor)

    def confirmed_changes(self, omitted_effects: EffectSet) -> np.ndarray:
        """Relative changes (quantities,) over the whole run without these effects, plus their statistical errors, with
        the longest step that meets the tolerance, else with the shortest of the few that are tried.
        """
        if omitted_effects not in self._confirmed:
            longest = self.longest_step_factor(omitted_effects)
            for step_factor in [k for k in reversed(self.whole.variants.step_factors()) if k <= longest][
                : 1 + STEP_REDUCTION_LIMIT
            ]:
                self.rounds += 1
                change = self.whole.differences_of_runs(
                    self.whole.variants.quantities_of_run(omitted_effects, step_factor),
                    self.whole.variants.quantities_of_run(),
                )
                shares, chance = self.whole.relative_changes(change), self.whole.statistical_errors(change)
                if self.whole.variants.newly_broken(omitted_effects, step_factor):
                    shares = np.full_like(shares, np.inf)
                self._confirmed[omitted_effects] = step_factor, shares, chance
                if self.within_tolerance(shares + chance):
                    break
                if (shares < self.tolerance).all():
                    self._sample_factors.append(float(np.max(chance / (self.tolerance - shares)) ** 2))
        return np.add(*self._confirmed[omitted_effects][1:])

    def within_tolerance(self, changes: np.ndarray) -> bool:
        """Whether all relative changes (quantities,) are within the tolerance."""
        return bool((changes <= self.tolerance).all())

    def is_better(self, larger_set: EffectSet, current_set: EffectSet) -> bool:
        """Whether leaving out ``larger_set`` is confirmed, with less work than without ``current_set``."""
        if not self.within_tolerance(self.confirmed_changes(larger_set)):
            return False
        work = [self.whole.variants.work(effects, self._confirmed[effects][0]) for effects in (larger_set, current_set)]
        return work[0] < work[1]

    def choose(self) -> EffectChoice:
        """The choice of effects by greedy search, confirmed over the whole run."""
        no_effects: EffectSet = frozenset()
        if not self.within_tolerance(self.confirmed_changes(no_effects)):
            self._confirmed[no_effects] = 1, *np.zeros((2, len(self.whole.quantities)))
        steps_taken, refused_steps = [no_effects], set[EffectSet]()
        while self.rounds < CONFIRMATION_LIMIT and not self.ended:
            path = self.growing_sets(steps_taken, refused_steps)
            if path == steps_taken:
                break
            if self.is_better(path[-1], steps_taken[-1]):
                steps_taken = path
                continue
            low, high = len(steps_taken) - 1, len(path) - 1  # path[low] is kept, path[high] is not
            while high - low > 1:
                middle = (low + high) // 2
                low, high = (middle, high) if self.is_better(path[middle], steps_taken[-1]) else (low, middle)
            refused_steps.add(path[high] - path[low])
            steps_taken = path[: low + 1]
        return self._refuse_too_few_samples(self._choice_of_set(steps_taken[-1]))

    def _refuse_too_few_samples(self, choice: EffectChoice) -> EffectChoice:
        """The choice; InputError if only the statistical errors keep all effects in the scene."""
        if not choice.sample_factor or choice.left_out or choice.step_factor > 1:
            return choice
        raise InputError(
            self.whole.variants.scene.file,
            "tolerance",
            self.tolerance,
            "is too fine for so few samples: "
            "what could go changes the quantities by less, but by chance it may be more; about "
            f"{choice.sample_factor:.2g} times as many samples would tell",
        )

    def _choice_of_set(self, omitted_effects: EffectSet) -> EffectChoice:
        step_factor, shares, chance = self._confirmed[omitted_effects]
        no_effects: EffectSet = frozenset()
        shown = [(no_effects, 1), (no_effects, self._confirmed[no_effects][0]), (omitted_effects, step_factor)]
        calls = [
            run.counts["calls"] for key in shown if (run := self.whole.variants.quantities_of_run(*key)) is not None
        ]
        seconds_per_call = [self.screen.variants.seconds_per_call(left_out) for left_out, _ in shown]
        return EffectChoice(
            self.effects,
            tuple(sorted(omitted_effects)),
            step_factor,
            self.change_with_longer_steps(omitted_effects, step_factor),
            self.reporting_screen.higher_order_estimate(omitted_effects),
            shares,
            chance,
            self.within_tolerance(shares + chance),
            tuple(calls),
            tuple(count * seconds for count, seconds in zip(calls, seconds_per_call, strict=True)),
            self.rounds,
            self._calls_so_far(),
            min(self._sample_factors, default=0.0),
            self.ended,
            {
                name: broken
                for name in self.effects
                if (broken := self.reporting_screen.variants.newly_broken(frozenset([name])))
            },
        )

    def _calls_so_far(self) -> int:
        """Number of right-hand side calls of all runs of the search so far."""
        return sum(
            {id(screen): screen.variants.calls for screen in (self.whole, self.reporting_screen, self.screen)}.values()
        )

    def _budget_spent(self) -> bool:
        """Whether the search has used all the calls that it may make; if so, it is marked as ended early."""
        whole_run = self.whole.variants.quantities_of_run()
        share = self._calls_so_far() / (SEARCH_BUDGET_IN_RUNS * whole_run.counts["calls"]) if whole_run else 1.0
        self.ended = self.ended or share >= 1.0
        self.report_progress(min(share, 1.0))
        return self.ended

    def change_with_longer_steps(self, omitted_effects: EffectSet, step_factor: int) -> np.ndarray:
        """Predicted relative changes (quantities,) if effects are left out and steps lengthened as well.

        The change by the longer step comes from a comparison with a shorter step.
        """
        screen, runs = self.reporting_screen, self.whole.variants
        change = screen.predicted_difference(omitted_effects) if omitted_effects else None
        if step_factor == 1:
            return screen.predicted_change(omitted_effects)
        shorter = [
            k
            for k in reversed(runs.step_factors())
            if step_factor % k == 0 and (STEP_CHECK_REFINEMENT * k <= step_factor or k == 1)
        ]
        step = screen.differences_of_runs(
            runs.quantities_of_run(omitted_effects, step_factor),
            next(filter(None, (runs.quantities_of_run(omitted_effects, k) for k in shorter)), None),
        )
        if change is None or step is None or step_factor % self.step_factor:
            return screen.predicted_change(omitted_effects) + screen.relative_changes(step)
        return screen.relative_changes(
            {name: sum_of_differences(change[name], step[name]) for name in screen.quantities}
        )

    def change_if_left_out_too(self, omitted_effects: EffectSet) -> dict[str, float]:
        """Predicted relative change for each remaining effect, if it were left out as well.

        Only of effects that may be left out, and whose omission saves work at the same step.
        """
        shares, step_factor = {}, self.longest_step_factor(omitted_effects) // self.step_factor
        for effect in self.effects:
            further = omitted_effects | {effect}
            if effect not in omitted_effects and self.screen.variants.work(further, step_factor) < self.predicted_work(
                omitted_effects
            ):
                shares[effect] = self.tolerance_share(further) * self.tolerance
        return {effect: change for effect, change in shares.items() if math.isfinite(change)}

    def growing_sets(self, sets_so_far: list[EffectSet], refused_additions: set[EffectSet]) -> list[EffectSet]:
        """Growing sets of omitted effects: ``sets_so_far``, continued one step at a time as far as predictions
        allow.
        """
        path = list(sets_so_far)
        while True:
            step = self._best_addition(path[-1], refused_additions, [frozenset([effect]) for effect in self.effects])
            step = step or self._best_addition(path[-1], refused_additions, self._promising_pairs())
            if not step:
                return path
            path.append(path[-1] | step)

    def _promising_pairs(self) -> list[EffectSet]:
        """Pairs of effects that keep to the error budget together, though one of them alone exceeds it."""
        if self._pairs is None:
            change_alone = {effect: self.tolerance_share(frozenset([effect])) for effect in self.effects}
            pairs = [
                pair
                for pair in combinations(self.effects, 2)
                if max(change_alone[effect] for effect in pair) > TOLERANCE_SHARE_OF_PREDICTION
            ]
            pairs.sort(key=lambda pair: sum(change_alone[effect] for effect in pair))
            self._pairs = self._pairs_within_budget([frozenset(pair) for pair in pairs])
        return self._pairs

    def _pairs_within_budget(self, effect_pairs: list[EffectSet]) -> list[EffectSet]:
        """Pairs of effects that keep to the error budget, as far as the budget of calls lets them be tested."""
        within = list[EffectSet]()
        for i, pair in enumerate(effect_pairs):
            if self._budget_spent():
                break
            if i % PAIRS_COMPUTED_IN_ADVANCE == 0:
                self.screen.compute_in_advance(effect_pairs[i : i + PAIRS_COMPUTED_IN_ADVANCE])
            within += [pair] if self.tolerance_share(pair) <= TOLERANCE_SHARE_OF_PREDICTION else []
        return within

    def _best_addition(
        self, omitted_effects: EffectSet, refused_additions: set[EffectSet], additions: list[EffectSet]
    ) -> EffectSet:
        """The effect or pair that saves the most work for the predicted error that it adds; empty where none may go."""
        best, best_score = frozenset[str](), 0.0
        current_share, work = self.tolerance_share(omitted_effects), self.predicted_work(omitted_effects)
        additions = [
            step
            for step in additions
            if not (step <= omitted_effects or step - omitted_effects in refused_additions or step in refused_additions)
        ]
        if additions and not self._budget_spent():
            self.screen.compute_in_advance(omitted_effects | step for step in additions)
        for step in additions:
            further = omitted_effects | step
            if self._budget_spent():
                break
            share = self.tolerance_share(further)
            saved = math.log(work / self.predicted_work(further)) if share <= TOLERANCE_SHARE_OF_PREDICTION else 0.0
            score = saved / max(share - current_share, NEGLIGIBLE_TOLERANCE_SHARE) if saved > 0.0 else 0.0
            if score > best_score:
                best, best_score = step - omitted_effects, score
        return best
