"""Changes of quantities by leaving effects out, predicted from runs without each effect and without each pair of
effects.

With y(S) the quantities' paths without the effects S, to the second order

    y(S) - y() = sum of d_i + sum of e_ij,    d_i = y(i) - y(),    e_ij = y(ij) - y(i) - y(j) + y(),

over the effects of S and their pairs. What is left out of that is estimated by taking the next order to lie to the
second as the second does to the first.
"""

from collections.abc import Iterable
from itertools import combinations
from typing import NoReturn

import numpy as np

from models.advice.choice.answer import (
    CaseValues,
    RunQuantities,
    difference_of_runs,
    largest_relative_change,
    rounding_floor,
    sampled_change_and_error,
    sum_of_differences,
)
from models.advice.choice.variants import EffectSet, Variants
from models.core.errors import InputError

LARGEST_SHARE_OF_SINGLE_SAMPLE = 1 / 3
"""Largest share that one sample may have of a sampled quantity's mean square."""
ChangesByQuantity = dict[str, CaseValues]
"""Differences of two runs, by the name of the quantity."""


class EffectScreen:
    """Predictions of how quantities change if effects are left out, from runs of ``variants`` of a scene. InputError
    for a quantity that does not move.
    """

    def __init__(self, variants: Variants, quantities: list[str]) -> None:
        self.variants, self.quantities = variants, quantities
        full = variants.quantities_of_run()
        if full is None:  # tells why
            full = variants.system.computed_quantities(variants.scene, variants.engine)
        quantities_by_name = {name: full.quantity(name, variants.scene.file) for name in quantities}
        self.full = {name: quantity.case_values for name, quantity in quantities_by_name.items()}
        self.sizes = {name: quantity.reference_sizes for name, quantity in quantities_by_name.items()}
        self.sampled = {name for name, quantity in quantities_by_name.items() if quantity.is_mean_of_samples}
        for name, size in self.sizes.items():
            if not (np.isfinite(size).all() and (size > rounding_floor(full, quantities_by_name[name].unit)).any()):
                self._refuse(name, "does not move in this scene, so that there is nothing to hold it to")
        for name in self.sampled:
            share = max(float(case.max() / case.sum()) for case in self.full[name])
            if share > LARGEST_SHARE_OF_SINGLE_SAMPLE:  # no error could be told of it
                m = len(self.full[name][0])
                why = f"by one sample of {m}, so that chance decides: ask for more or longer ones"
                self._refuse(name, f"is made up to {100 * share:.0f} % {why}")

    def _refuse(self, quantity_name: str, reason: str) -> NoReturn:
        raise InputError(self.variants.scene.file, f"quantities.{quantity_name}", None, reason)

    def differences_of_runs(
        self, run: RunQuantities | None, other_run: RunQuantities | None
    ) -> ChangesByQuantity | None:
        """Differences of two runs, by quantity; None where one of the runs or one of its quantities is missing."""
        if run is None or other_run is None:
            return None
        try:
            return {
                name: difference_of_runs(run.quantity(name).case_values, other_run.quantity(name).case_values)
                for name in self.quantities
            }
        except InputError as error:
            if "rms" in error.allowed and "ends" not in error.allowed:
                return None  # what is left has no such quantity
            raise

    def relative_changes(self, differences: ChangesByQuantity | None) -> np.ndarray:
        """Relative changes (quantities,) from differences of runs; infinite where ``differences`` is None."""
        return self._changes_with_errors(differences)[0]

    def statistical_errors(self, differences: ChangesByQuantity | None) -> np.ndarray:
        """Statistical errors (quantities,) of relative changes; zero for a quantity that is no mean of samples."""
        return self._changes_with_errors(differences)[1]

    def _changes_with_errors(self, differences: ChangesByQuantity | None) -> np.ndarray:
        """Relative changes and their statistical errors (2, quantities)."""
        if differences is None:
            return np.outer((np.inf, 0.0), np.ones(len(self.quantities)))
        pairs = [
            sampled_change_and_error(differences[name], self.full[name])
            if name in self.sampled
            else (largest_relative_change(differences[name], self.sizes[name]), 0.0)
            for name in self.quantities
        ]
        return np.array(pairs).T

    def first_order_change(self, effect: str) -> ChangesByQuantity | None:
        """First-order difference d_i of the quantities: their change if this effect alone is left out."""
        return self.predicted_difference(frozenset([effect]))

    def second_order_change(self, effect: str, other_effect: str) -> ChangesByQuantity | None:
        """Second-order difference e_ij of a pair of effects: the change without both, less the changes without each
        alone.
        """
        sets = map(frozenset, ((effect, other_effect), (effect,), (other_effect,)))
        change_without_both, *singles = (self.predicted_difference(effects) for effects in sets)
        known = [change_of_single for change_of_single in singles if change_of_single is not None]
        if change_without_both is None or len(known) < 2:
            return None
        return {
            name: sum_of_differences(
                change_without_both[name], *(_negated(change_of_single[name]) for change_of_single in known)
            )
            for name in self.quantities
        }

    def compute_in_advance(self, effect_sets: Iterable[EffectSet]) -> None:
        """Compute in advance the runs from which the changes without these sets of effects are predicted."""
        self.variants.compute_in_advance(
            (subset, 1) for chosen in effect_sets for subset in _effect_sets_needed(chosen)
        )

    def predicted_difference(self, omitted_effects: EffectSet) -> ChangesByQuantity | None:
        """Predicted differences of the quantities if a set of effects is left out; None where they cannot be
        predicted.
        """
        parts: list[ChangesByQuantity | None] = [None]
        if len(omitted_effects) > 2:
            parts = [
                *map(self.first_order_change, omitted_effects),
                *(self.second_order_change(*pair) for pair in combinations(sorted(omitted_effects), 2)),
            ]
        if None in parts:
            return self.differences_of_runs(
                self.variants.quantities_of_run(omitted_effects), self.variants.quantities_of_run()
            )
        return {
            name: sum_of_differences(*(difference[name] for difference in parts if difference))
            for name in self.quantities
        }

    def predicted_change(self, omitted_effects: EffectSet) -> np.ndarray:
        """Predicted relative changes (quantities,) if a set of effects is left out, without the
        ``higher_order_estimate``.
        """
        return (
            self.relative_changes(self.predicted_difference(omitted_effects))
            if omitted_effects
            else np.zeros(len(self.quantities))
        )

    def higher_order_estimate(self, omitted_effects: EffectSet) -> np.ndarray:
        """Estimate (quantities,) of changes of third and higher order: the second order, reduced by the ratio of the
        second order to the first.
        """
        no_change = np.zeros(len(self.quantities))
        if len(omitted_effects) <= 2:
            return no_change
        first = np.sum([self.relative_changes(self.first_order_change(effect)) for effect in omitted_effects], axis=0)
        second_order_change = np.sum(
            [
                self.relative_changes(self.second_order_change(*pair))
                for pair in combinations(sorted(omitted_effects), 2)
            ],
            axis=0,
        )
        if not (np.isfinite(first).all() and np.isfinite(second_order_change).all()):
            return no_change  # the set was run itself
        return second_order_change * np.minimum(1.0, second_order_change / np.maximum(first, 1e-300))

    def change_by_longer_steps(self, omitted_effects: EffectSet, step_factor: int) -> np.ndarray:
        """Relative changes (quantities,) that longer steps alone cause in a run without these effects."""
        if step_factor == 1:
            return np.zeros(len(self.quantities))
        return self.relative_changes(
            self.differences_of_runs(
                self.variants.quantities_of_run(omitted_effects, step_factor),
                self.variants.quantities_of_run(omitted_effects),
            )
        )


def _effect_sets_needed(omitted_effects: EffectSet) -> list[EffectSet]:
    """Sets of effects whose runs are needed to predict the changes without ``omitted_effects``."""
    if len(omitted_effects) <= 2:
        return [omitted_effects]
    return [frozenset(subset) for count in (1, 2) for subset in combinations(sorted(omitted_effects), count)]


def _negated(case_values: CaseValues) -> CaseValues:
    return tuple(-case for case in case_values)
