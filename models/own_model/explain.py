"""Which properties of two model files make their accelerations differ, by building each file with values of the other.

The builds are the plain equations of the description, which the certificate holds to both files. First all elements
that differ are taken over together: what is left then has no element. Then each alone: what it changes is its
influence, and elements that change nothing are listed as without influence.
"""

from collections.abc import Sequence
from contextlib import suppress
from copy import copy
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from models.core.errors import RunFailed
from models.own_model.builds import PLAIN_BUILD, StateMotion, equations_of_build
from models.own_model.certificate import (
    EQUAL_ACCELERATION_SHARE,
    Agreement,
    MotionReference,
    agreement_of_build,
    comparison_states,
    motion_at,
    reference_of_file,
)
from models.own_model.elements import (
    ModelProperty,
    distinct_texts,
    elements_of_model,
    is_word,
    remove_property,
    set_property,
    tensor_of,
    two_digit_text,
)
from models.own_model.reading import TwinModel, described_model

STATE_COUNT = 20
"""Count of random states at which properties are tried."""
UNCOMPARED_KINDS = ("range", "softness")
"""Kinds of properties that are off, or that only MuJoCo has: a difference in them is listed, and not compared."""
NO_EFFECT_SHARE = 1e-11
"""Relative change of accelerations and of the mass matrix below which a property has no influence: a tenth of what
counts as different, and above the 7e-12 that rounding alone was seen to cause in a coordinate near 0."""
PropertyKey = tuple[str, str]
States = list[tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True, eq=False)
class PropertyDifference:
    """A property that differs between two files: what it is, its values in both files (None: it has none), its unit,
    and its influence, the largest relative change of accelerations when it alone is as in the other file, or of the
    mass matrix where no acceleration changes (None where it cannot be tried); off : it is listed, and not compared;
    said : its kind in words, where that says more."""

    kind: str
    owner: str
    unit: str
    first: np.ndarray | None
    second: np.ndarray | None
    influence: float | None
    off: bool
    said: str = ""

    @property
    def key(self) -> PropertyKey:
        """Identification of the property that differs: its kind and owner."""
        return self.kind, self.owner

    def sentence(self, file_names: Sequence[str]) -> str:
        """Text such as "armature of joint 'hip': 0.02 kg m^2 in a.xml, none in b.urdf"."""
        values = [np.zeros(0) if value is None else value for value in (self.first, self.second)]
        first, second = distinct_texts(values[0], values[1], self.unit)
        return f"{self.said or self.kind} of {self.owner}: {first} in {file_names[0]}, {second} in {file_names[1]}"


@dataclass(frozen=True)
class ModelComparison:
    """Comparison of two files: agreement of their accelerations; properties that differ, the most influential first;
    the disagreement that remains when the second file's values are taken for all of these; and coordinates that only
    one file has."""

    acceleration_agreement: Agreement | None
    differences: tuple[PropertyDifference, ...]
    unexplained_difference: float
    unmatched_coordinates: tuple[str, ...]

    @property
    def alike(self) -> bool:
        """Whether both files move alike."""
        return self.acceleration_agreement is not None and self.acceleration_agreement.alike

    @property
    def influential(self) -> tuple[PropertyDifference, ...]:
        """Differences that change accelerations or the mass matrix, and those whose influence could not be
        determined."""
        tried = (each for each in self.differences if not each.off)
        return tuple(each for each in tried if each.influence is None or each.influence > NO_EFFECT_SHARE)

    @property
    def not_compared(self) -> tuple[PropertyDifference, ...]:
        """Differences in properties that are off, or that only MuJoCo has: they are listed and not compared."""
        return tuple(each for each in self.differences if each.off)

    @property
    def silent_differences(self) -> tuple[PropertyDifference, ...]:
        """Differences that change neither accelerations nor the mass matrix."""
        return tuple(each for each in self.differences if each not in (*self.influential, *self.not_compared))

    def remainder_text(self) -> str:
        """Text on the disagreement that remains when all possible values of the second file are taken over."""
        if self.unexplained_difference <= EQUAL_ACCELERATION_SHARE:
            return f"with these taken over, both move alike: {two_digit_text(self.unexplained_difference)} is left"
        untried = any(each.influence is None for each in self.influential)
        why = "what cannot be tried" if untried else "something that is no element here, or that these change together"
        return (
            "with these taken over where they can be, accelerations still differ by "
            f"{two_digit_text(self.unexplained_difference)}: {why}"
        )


def compare_models(first_model: TwinModel, second_model: TwinModel, state_count: int = STATE_COUNT) -> ModelComparison:
    """Comparison of two model files, at random states within the ranges of the first file."""
    unmatched = _unmatched_coordinates(first_model, second_model)
    if unmatched:
        return ModelComparison(None, tuple(_differences(first_model, second_model, None)), np.inf, tuple(unmatched))
    order = [second_model.names.index(name) for name in first_model.names]
    states = comparison_states(first_model, state_count)
    places = _reordered_states(states, order)
    here, there = (
        reference_of_file(first_model, states, PLAIN_BUILD),
        reference_of_file(second_model, places, PLAIN_BUILD),
    )
    apart = agreement_of_build(
        "the second file", _with_larger_sensitivity(here, there, order), _reordered_motion(there.motions, order)
    )
    trial = _PropertyTrial(
        first_model, states, replace(here, motions=motion_at(equations_of_build(first_model, PLAIN_BUILD), states))
    )
    back = _PropertyTrial(
        second_model, places, replace(there, motions=motion_at(equations_of_build(second_model, PLAIN_BUILD), places))
    )
    differences = sorted(_differences(first_model, second_model, (trial, back)), key=_importance_key)
    model, taken = trial.with_all(elements_of_model(second_model.model), differences)
    changed = trial.motions(model)
    alone = [each.key for each in differences if each.first is None and each.key not in taken]
    remaining = back.motions(back.without(alone))
    left = agreement_of_build(
        "", replace(_with_larger_sensitivity(here, there, order), motions=changed), _reordered_motion(remaining, order)
    )
    return ModelComparison(apart, tuple(differences), left.acceleration, ())


def _importance_key(difference: PropertyDifference) -> float:
    """Sort key: differences with unknown influence first, then the most influential."""
    return -np.inf if difference.influence is None else -difference.influence


@dataclass(frozen=True, eq=False)
class _PropertyTrial:
    """A model file whose properties can be given the other file's values, to see how its motion changes."""

    twin: TwinModel
    states: States
    base: MotionReference

    def influence(self, mujoco_model: mujoco.MjModel) -> float | None:
        """Largest relative change that a changed model causes in accelerations, or in the mass matrix if these do not
        change; None if it cannot be built."""
        try:
            change = agreement_of_build("", self.base, self.motions(mujoco_model))
            return change.acceleration if change.acceleration > NO_EFFECT_SHARE else change.mass
        except RunFailed:
            return None

    def with_all(
        self, other_elements: dict[PropertyKey, ModelProperty], differences: Sequence[PropertyDifference]
    ) -> tuple[mujoco.MjModel, list[PropertyKey]]:
        """The model with all differing properties changed to the other file's values where possible, and the properties
        that were changed."""
        model, taken = copy(self.twin.model), list[PropertyKey]()
        for each in sorted(differences, key=lambda each: each.kind == "spring reference"):
            value = other_elements[each.key].value if each.key in other_elements else np.zeros_like(each.first)
            with suppress(ValueError, KeyError):
                set_property(model, each.key, value)
                taken.append(each.key)
        return model, taken

    def with_one(self, property_key: PropertyKey, new_value: np.ndarray) -> mujoco.MjModel:
        """The model with one property set to another value."""
        model = copy(self.twin.model)
        set_property(model, property_key, new_value)
        return model

    def without(self, property_keys: Sequence[PropertyKey]) -> mujoco.MjModel:
        """The model with the given properties removed, where they can be."""
        model = copy(self.twin.model)
        for key in property_keys:
            remove_property(model, key)
        return model

    def motions(self, mujoco_model: mujoco.MjModel) -> list[StateMotion]:
        """Motion of a changed model at the states of the trial."""
        return motion_at(equations_of_build(described_model(mujoco_model, self.twin.name), PLAIN_BUILD), self.states)


def _reordered_states(states: States, coordinate_order: list[int]) -> States:
    """States of the first file, reordered to the coordinates of the second."""
    places = np.argsort(coordinate_order)
    return [(q[places], v[places]) for q, v in states]


def _reordered_motion(second_motions: Sequence[StateMotion], coordinate_order: list[int]) -> list[StateMotion]:
    """Motion of the second file, reordered to the coordinates of the first."""
    return [
        StateMotion(
            each.mass[np.ix_(coordinate_order, coordinate_order)],
            each.force[coordinate_order],
            each.acceleration[coordinate_order],
        )
        for each in second_motions
    ]


def _with_larger_sensitivity(
    first_reference: MotionReference, second_reference: MotionReference, coordinate_order: list[int]
) -> MotionReference:
    """The first file's reference, with the larger rounding sensitivity of the two files."""
    pairs = zip(
        first_reference.sensitivities, _reordered_motion(second_reference.sensitivities, coordinate_order), strict=True
    )
    return replace(
        first_reference, sensitivities=[StateMotion(*map(np.maximum, first, second)) for first, second in pairs]
    )


def _unmatched_coordinates(first_model: TwinModel, second_model: TwinModel) -> list[str]:
    """Sentences on the coordinates of each file that do not exist in the other."""
    names = [(twin.name, twin.names) for twin in (first_model, second_model)]
    rows = list[str]()
    for (file, listed), (_, others) in (names, names[::-1]):
        rows += [f"{name} of {file} has no partner" for name in listed if name not in others]
    return rows


def _differences(
    first_model: TwinModel, second_model: TwinModel, property_trials: tuple[_PropertyTrial, _PropertyTrial] | None
) -> list[PropertyDifference]:
    """Properties that differ between the files; property_trials : one for the first and one for the second file, None
    if they have no common states."""
    rows, listed, others = (
        list[PropertyDifference](),
        elements_of_model(first_model.model),
        elements_of_model(second_model.model),
    )
    rubbing = first_model.driven.frictions or second_model.driven.frictions
    for key in dict.fromkeys((*listed, *others)):
        element, other = listed.get(key), others.get(key)
        if element is not None and other is not None and element.has_same_value(other):
            continue
        there = element if element is not None else other
        if there is None or _is_insignificant(there, element, other):
            continue
        influence = (
            _influence_of_difference(property_trials, key, element, other) if property_trials is not None else None
        )
        first_value, second_value = (None if each is None else each.value for each in (element, other))
        kind = "orientation of the inertia" if _differ_in_orientation_alone(key[0], element, other) else key[0]
        off = key[0] in UNCOMPARED_KINDS or (key[0] == "friction loss" and not rubbing)
        rows.append(PropertyDifference(*key, there.unit, first_value, second_value, influence, off, kind))
    return rows


def _influence_of_difference(
    property_trials: tuple[_PropertyTrial, _PropertyTrial],
    property_key: PropertyKey,
    first_element: ModelProperty | None,
    second_element: ModelProperty | None,
) -> float | None:
    """Influence of one difference: the first file takes over the other's value, or the second file loses a property
    that only it has. None if the first file cannot have that value."""
    first, second = property_trials
    if first_element is None:
        return second.influence(second.without([property_key]))
    value = np.zeros_like(first_element.value) if second_element is None else second_element.value
    try:
        return first.influence(first.with_one(property_key, value))
    except ValueError:
        return None


def _differ_in_orientation_alone(
    property_kind: str, first_element: ModelProperty | None, second_element: ModelProperty | None
) -> bool:
    """Whether two inertias have the same principal moments and differ only in orientation."""
    if property_kind != "inertia" or first_element is None or second_element is None:
        return False
    first, second = (np.linalg.eigvalsh(tensor_of(each.value)) for each in (first_element, second_element))
    return bool(np.abs(first - second).max() <= 1e-9 * first.max())


def _is_insignificant(
    present_element: ModelProperty, first_element: ModelProperty | None, second_element: ModelProperty | None
) -> bool:
    """Whether a property that only one file has is insignificant: zero, or a word that repeats other properties."""
    return (first_element is None or second_element is None) and (
        is_word(present_element.value) or not present_element.is_nonzero
    )


def removals_that_agree(
    user_model: TwinModel, build_name: str, state_count: int = STATE_COUNT
) -> list[tuple[ModelProperty, float]]:
    """Properties whose removal makes a build agree with the file's model in MuJoCo; each is removed from both.

    With each its relative difference of accelerations without it, the smallest first; empty where none explains it.
    """
    states = comparison_states(user_model, state_count)
    rows = list[tuple[ModelProperty, float]]()
    for key, element in elements_of_model(user_model.model).items():
        model = copy(user_model.model)
        if not element.is_nonzero or not remove_property(model, key):
            continue
        less = described_model(model, user_model.name)
        seen = agreement_of_build(
            build_name,
            reference_of_file(less, states, build_name),
            motion_at(equations_of_build(less, build_name), states),
        )
        if seen.alike:
            rows.append((element, seen.acceleration))
    return sorted(rows, key=lambda row: row[1])
