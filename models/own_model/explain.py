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
from models.own_model.builds import PLAIN_BUILD, Moved, equations_of_build
from models.own_model.certificate import (
    EQUAL_ACCELERATION_SHARE,
    Agreement,
    Reference,
    agreement_of_build,
    moved_at,
    reference_of_file,
    states_of,
)
from models.own_model.elements import (
    Element,
    drop,
    elements_of_model,
    is_word,
    put,
    tensor_of,
    told_apart,
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
Key = tuple[str, str]
States = list[tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True, eq=False)
class Difference:
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
    def key(self) -> Key:
        """Identification of the property that differs: its kind and owner."""
        return self.kind, self.owner

    def sentence(self, files: Sequence[str]) -> str:
        """Text such as "armature of joint 'hip': 0.02 kg m^2 in a.xml, none in b.urdf"."""
        values = [np.zeros(0) if value is None else value for value in (self.first, self.second)]
        first, second = told_apart(values[0], values[1], self.unit)
        return f"{self.said or self.kind} of {self.owner}: {first} in {files[0]}, {second} in {files[1]}"


@dataclass(frozen=True)
class Comparison:
    """Comparison of two files: agreement of their accelerations; properties that differ, the most influential first;
    the disagreement that remains when the second file's values are taken for all of these; and coordinates that only
    one file has."""

    acceleration_agreement: Agreement | None
    differences: tuple[Difference, ...]
    unexplained: float
    unmatched: tuple[str, ...]

    @property
    def alike(self) -> bool:
        """Whether both files move alike."""
        return self.acceleration_agreement is not None and self.acceleration_agreement.alike

    @property
    def influential(self) -> tuple[Difference, ...]:
        """Differences that change accelerations or the mass matrix, and those whose influence could not be
        determined."""
        tried = (each for each in self.differences if not each.off)
        return tuple(each for each in tried if each.influence is None or each.influence > NO_EFFECT_SHARE)

    @property
    def not_compared(self) -> tuple[Difference, ...]:
        """Differences in properties that are off, or that only MuJoCo has: they are listed and not compared."""
        return tuple(each for each in self.differences if each.off)

    @property
    def silent_differences(self) -> tuple[Difference, ...]:
        """Differences that change neither accelerations nor the mass matrix."""
        return tuple(each for each in self.differences if each not in (*self.influential, *self.not_compared))

    def rest(self) -> str:
        """Text on the disagreement that remains when all possible values of the second file are taken over."""
        if self.unexplained <= EQUAL_ACCELERATION_SHARE:
            return f"with these taken over, both move alike: {two_digit_text(self.unexplained)} is left"
        untried = any(each.influence is None for each in self.influential)
        why = "what cannot be tried" if untried else "something that is no element here, or that these change together"
        return (
            "with these taken over where they can be, accelerations still differ by "
            f"{two_digit_text(self.unexplained)}: {why}"
        )


def compare(first: TwinModel, second: TwinModel, count: int = STATE_COUNT) -> Comparison:
    """Comparison of two model files, at random states within the ranges of the first file."""
    unmatched = _unmatched_coordinates(first, second)
    if unmatched:
        return Comparison(None, tuple(_differences(first, second, None)), np.inf, tuple(unmatched))
    order = [second.names.index(name) for name in first.names]
    states = states_of(first, count)
    places = _in_order(states, order)
    here, there = reference_of_file(first, states, PLAIN_BUILD), reference_of_file(second, places, PLAIN_BUILD)
    apart = agreement_of_build(
        "the second file", _rounded_as_both(here, there, order), _reordered_motion(there.moved, order)
    )
    trial = _Trial(first, states, replace(here, moved=moved_at(equations_of_build(first, PLAIN_BUILD), states)))
    back = _Trial(second, places, replace(there, moved=moved_at(equations_of_build(second, PLAIN_BUILD), places)))
    differences = sorted(_differences(first, second, (trial, back)), key=_importance_key)
    model, taken = trial.with_all(elements_of_model(second.model), differences)
    moved = trial.moved(model)
    alone = [each.key for each in differences if each.first is None and each.key not in taken]
    rest = back.moved(back.without(alone))
    left = agreement_of_build(
        "", replace(_rounded_as_both(here, there, order), moved=moved), _reordered_motion(rest, order)
    )
    return Comparison(apart, tuple(differences), left.acceleration, ())


def _importance_key(difference: Difference) -> float:
    """Sort key: differences with unknown influence first, then the most influential."""
    return -np.inf if difference.influence is None else -difference.influence


@dataclass(frozen=True, eq=False)
class _Trial:
    """A model file whose properties can be given the other file's values, to see how its motion changes."""

    twin: TwinModel
    states: States
    base: Reference

    def influence(self, model: mujoco.MjModel) -> float | None:
        """Largest relative change that a changed model causes in accelerations, or in the mass matrix if these do not
        change; None if it cannot be built."""
        try:
            change = agreement_of_build("", self.base, self.moved(model))
            return change.acceleration if change.acceleration > NO_EFFECT_SHARE else change.mass
        except RunFailed:
            return None

    def with_all(
        self, values: dict[Key, Element], differences: Sequence[Difference]
    ) -> tuple[mujoco.MjModel, list[Key]]:
        """The model with all differing properties changed to the other file's values where possible, and the properties
        that were changed."""
        model, taken = copy(self.twin.model), list[Key]()
        for each in sorted(differences, key=lambda each: each.kind == "spring reference"):
            value = values[each.key].value if each.key in values else np.zeros_like(each.first)
            with suppress(ValueError, KeyError):
                put(model, each.key, value)
                taken.append(each.key)
        return model, taken

    def with_one(self, key: Key, value: np.ndarray) -> mujoco.MjModel:
        """The model with one property set to another value."""
        model = copy(self.twin.model)
        put(model, key, value)
        return model

    def without(self, keys: Sequence[Key]) -> mujoco.MjModel:
        """The model with the given properties removed, where they can be."""
        model = copy(self.twin.model)
        for key in keys:
            drop(model, key)
        return model

    def moved(self, model: mujoco.MjModel) -> list[Moved]:
        """Motion of a changed model at the states of the trial."""
        return moved_at(equations_of_build(described_model(model, self.twin.name), PLAIN_BUILD), self.states)


def _in_order(states: States, order: list[int]) -> States:
    """States of the first file, reordered to the coordinates of the second."""
    places = np.argsort(order)
    return [(q[places], v[places]) for q, v in states]


def _reordered_motion(moved: Sequence[Moved], order: list[int]) -> list[Moved]:
    """Motion of the second file, reordered to the coordinates of the first."""
    return [Moved(each.mass[np.ix_(order, order)], each.force[order], each.acceleration[order]) for each in moved]


def _rounded_as_both(here: Reference, there: Reference, order: list[int]) -> Reference:
    """The first file's reference, with the larger rounding sensitivity of the two files."""
    pairs = zip(here.sensitivities, _reordered_motion(there.sensitivities, order), strict=True)
    return replace(here, sensitivities=[Moved(*map(np.maximum, first, second)) for first, second in pairs])


def _unmatched_coordinates(first: TwinModel, second: TwinModel) -> list[str]:
    """Sentences on the coordinates of each file that do not exist in the other."""
    names = [(twin.name, twin.names) for twin in (first, second)]
    rows = list[str]()
    for (file, listed), (_, others) in (names, names[::-1]):
        rows += [f"{name} of {file} has no partner" for name in listed if name not in others]
    return rows


def _differences(first: TwinModel, second: TwinModel, trials: tuple[_Trial, _Trial] | None) -> list[Difference]:
    """Properties that differ between the files; trials : one for the first and one for the second file, None if they
    have no common states."""
    rows, listed, others = list[Difference](), elements_of_model(first.model), elements_of_model(second.model)
    rubbing = first.driven.frictions or second.driven.frictions
    for key in dict.fromkeys((*listed, *others)):
        element, other = listed.get(key), others.get(key)
        if element is not None and other is not None and element.has_same_value(other):
            continue
        there = element if element is not None else other
        if there is None or _says_nothing(there, element, other):
            continue
        influence = _influence_of_difference(trials, key, element, other) if trials is not None else None
        first_value, second_value = (None if each is None else each.value for each in (element, other))
        kind = "orientation of the inertia" if _only_turned(key[0], element, other) else key[0]
        off = key[0] in UNCOMPARED_KINDS or (key[0] == "friction loss" and not rubbing)
        rows.append(Difference(*key, there.unit, first_value, second_value, influence, off, kind))
    return rows


def _influence_of_difference(
    trials: tuple[_Trial, _Trial], key: Key, element: Element | None, other: Element | None
) -> float | None:
    """Influence of one difference: the first file takes over the other's value, or the second file loses a property
    that only it has. None if the first file cannot have that value."""
    first, second = trials
    if element is None:
        return second.influence(second.without([key]))
    value = np.zeros_like(element.value) if other is None else other.value
    try:
        return first.influence(first.with_one(key, value))
    except ValueError:
        return None


def _only_turned(kind: str, element: Element | None, other: Element | None) -> bool:
    """Whether two inertias have the same principal moments and differ only in orientation."""
    if kind != "inertia" or element is None or other is None:
        return False
    first, second = (np.linalg.eigvalsh(tensor_of(each.value)) for each in (element, other))
    return bool(np.abs(first - second).max() <= 1e-9 * first.max())


def _says_nothing(there: Element, element: Element | None, other: Element | None) -> bool:
    """Whether a property that only one file has is insignificant: zero, or a word that repeats other properties."""
    return (element is None or other is None) and (is_word(there.value) or not there.is_nonzero)


def removals_that_agree(twin: TwinModel, build: str, count: int = STATE_COUNT) -> list[tuple[Element, float]]:
    """Properties whose removal makes a build agree with the file's model in MuJoCo; each is removed from both.

    With each its relative difference of accelerations without it, the smallest first; empty where none explains it.
    """
    states = states_of(twin, count)
    rows = list[tuple[Element, float]]()
    for key, element in elements_of_model(twin.model).items():
        model = copy(twin.model)
        if not element.is_nonzero or not drop(model, key):
            continue
        less = described_model(model, twin.name)
        seen = agreement_of_build(
            build, reference_of_file(less, states, build), moved_at(equations_of_build(less, build), states)
        )
        if seen.alike:
            rows.append((element, seen.acceleration))
    return sorted(rows, key=lambda row: row[1])
