"""The best that any choice could do: all legal sets of effects, those of fewest calls confirmed first."""

from itertools import chain, combinations

from models.ride.choice.choose import Chooser, Set
from models.ride.choice.held import illegal


def fewest_calls(chooser: Chooser) -> float:
    """Least calls (1/s) of all sets that keep the tolerance when confirmed; 2^effects sets are looked at."""
    effects = chooser.effects
    sets: list[Set] = [frozenset(own) for own in chain.from_iterable(
        combinations(effects, count) for count in range(len(effects) + 1)) if not illegal(own)]  # fmt: skip
    calls = {own: chooser.cost(own).calls for own in sets}
    return next(calls[own] for own in sorted(sets, key=calls.__getitem__) if chooser.holds(chooser.confirm(own)))
