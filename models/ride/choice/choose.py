"""Which effects a scene's quantities can do without: screened one by one and in pairs, chosen by what they save.

A greedy choice: of all single effects, and of all pairs where no single one will do, the next to be left out is the
one that saves most for the error that the screen predicts for the whole set: calls (their logarithm) and, where no step
saves any, calls times states, if calls do not rise. A second choice saves calls times states throughout, and lets fast
motions follow last of all; it is taken where it ends with fewer calls, or with fewer states for hardly more. The set is
confirmed by the exact solve at every speed. Where it is not kept, the step of the path that breaks it is found by
halving, taken back for good, and the choice goes on without it. What is reported was confirmed and certified, always.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import exp, inf, log

import numpy as np

from models.errors import InputError
from models.ride.choice.cost import Cost, cost
from models.ride.choice.held import Effect, Held, effects_of, illegal, without
from models.ride.choice.reduced import Reduced, Whole
from models.ride.choice.screen import Screen, confirmed, silent

BUDGET = 1.0
"""Share of the tolerance that predictions may use."""
SCREENED = 3
"""Speeds at which effects are screened, from the slowest to the fastest; the choice is confirmed at all."""
HOPELESS = 20.0
"""A single effect that breaks the tolerance so many times is not tried in pairs, unless it is singular."""
ROUNDS = 30
"""Choices that are confirmed at most."""
CERTAIN = 1e-12
"""Relative error of the identity that certifies a choice; beyond it, rounding has eaten the certificate."""
WORTH, EVEN = 0.05, 1e-3
"""Logarithm of calls up to which two sets cost the same; by how much, relative, a step that saves states may raise
them."""

Set = frozenset[Effect]
Steps = Callable[[], list[Set]]
Order = tuple[tuple[Callable[[Set, Set], float], Steps], ...]
"""Measures of what a step saves, from a set to a larger one, each with the steps that it judges; a later one counts
where no step saves by those before."""


@dataclass(frozen=True)
class Choice:
    """Effects ``left_out`` of all ``candidates``; relative changes (quantities,) of standard deviations.

    predicted and confirmed : the worst over speeds, with sign; kept : every confirmed change within the tolerance.
    rounds : choices that were confirmed.
    """

    candidates: tuple[Effect, ...]
    left_out: tuple[Effect, ...]
    predicted: np.ndarray
    confirmed: np.ndarray
    kept: bool
    before: Cost
    after: Cost
    rounds: int


class Chooser:
    """Candidates of a scene at its speeds (m/s), for quantities (names of outputs, weighted ones too)."""

    def __init__(self, held: Held, speeds: Sequence[float] | np.ndarray, quantities: Sequence[str],
                 tolerance: float) -> None:  # fmt: skip
        self.held, self.tolerance, self.effects = held, tolerance, effects_of(held)
        self.wholes = [Whole(held, float(speed)) for speed in speeds]
        names = self.wholes[0].full.system.names
        self.rows = [names.index(name) for name in quantities]
        few = min(SCREENED, len(speeds))
        self.screened = [self.wholes[i] for i in np.linspace(0, len(speeds) - 1, few).round().astype(int)]
        self.full = [confirmed(whole.full, self.rows) for whole in self.wholes]
        self._check(quantities)
        Screen(self.wholes[0].full, self.rows)  # refuses a vehicle that cannot be screened
        self._screens: dict[tuple[int, Set], Screen] = {}
        self._systems: dict[tuple[int, Set], Reduced | None] = {}
        self._predicted: dict[Set, np.ndarray] = {}
        self._costs: dict[Set, Cost] = {}
        self._promising: list[Set] | None = None

    def _check(self, quantities: Sequence[str]) -> None:
        for whole, variances in zip(self.wholes, self.full, strict=True):
            for name, own, least in zip(quantities, variances, silent(whole.full, self.rows), strict=True):
                if not least < own < inf:
                    said = "has no finite standard deviation above zero in this scene, so nothing to hold it to"
                    raise InputError("", f"quantities.{name}", None, said)

    def system(self, whole: Whole, chosen: Set) -> Reduced | None:
        """The scene less these effects at a speed; None where nothing sensible is left."""
        key = (id(whole), chosen)
        if key not in self._systems:
            try:
                self._systems[key] = whole.reduced(without(self.held, sorted(chosen, key=lambda e: e.name)))
            except InputError:
                self._systems[key] = None
        return self._systems[key]

    def screen(self, whole: Whole, chosen: Set) -> Screen | None:
        """Covariance and adjoints of the scene less the singular ones of these effects."""
        base = frozenset(effect for effect in chosen if effect.singular)
        if base and any(effect.needs for effect in base):
            base |= {effect for effect in chosen for one in base if effect.name in one.needs}
        key = (id(whole), base)
        if key not in self._screens:
            reduced = self.system(whole, base)
            if reduced is None:
                return None
            try:
                self._screens[key] = Screen(reduced, self.rows)
            except InputError:
                return None
        return self._screens[key]

    def predicted(self, chosen: Set) -> np.ndarray:
        """Changes (quantities,) of the worst of the screened speeds; inf where there is no system."""
        if chosen not in self._predicted:
            self._predicted[chosen] = self._worst(self.screened, chosen, self._predict)
        return self._predicted[chosen]

    def confirm(self, chosen: Set) -> np.ndarray:
        """The same by the exact solve, of all speeds."""
        return self._worst(self.wholes, chosen, lambda whole, chosen, reduced: confirmed(reduced, self.rows))

    def certified(self, chosen: Set) -> np.ndarray:
        """What ``confirm`` finds; inf where it holds the tolerance, but the identity of covariance and adjoint, which
        certifies it, is not exact at a screened speed."""
        found = self.confirm(chosen)
        exact = not self.holds(found) or all(self._exact(whole, chosen) for whole in self.screened)
        return found if exact else np.full(len(found), inf)

    def _exact(self, whole: Whole, chosen: Set) -> bool:
        screen, reduced = self.screen(whole, frozenset()), self.system(whole, chosen)
        if screen is None or reduced is None:
            return False
        two, one = screen.identity(reduced)
        return bool((abs(two / one - 1.0) <= CERTAIN).all())

    def _predict(self, whole: Whole, chosen: Set, reduced: Reduced) -> np.ndarray:
        screen = self.screen(whole, chosen)
        return np.full(len(self.rows), inf) if screen is None else screen.predicted(reduced)

    def _worst(self, wholes: Sequence[Whole], chosen: Set,
               variances: Callable[[Whole, Set, Reduced], np.ndarray]) -> np.ndarray:  # fmt: skip
        changes = []
        for whole in wholes:
            reduced, full = self.system(whole, chosen), self.full[self.wholes.index(whole)]
            try:
                found = np.full(len(full), inf) if reduced is None else variances(whole, chosen, reduced)
            except InputError:  # unstable
                found = np.full(len(full), inf)
            changes.append(np.sqrt(found / full) - 1.0)
        of = np.array(changes)
        return of[abs(of).argmax(axis=0), np.arange(of.shape[1])]

    def cost(self, chosen: Set) -> Cost:
        """Of the dearest screened speed; without end where nothing sensible is left."""
        if chosen not in self._costs:
            systems = [self.system(whole, chosen) for whole in self.screened]
            costs = (Cost(0, 0.0, inf) if system is None else cost(system) for system in systems)
            self._costs[chosen] = max(costs, key=lambda c: c.calls)
        return self._costs[chosen]

    def choose(self) -> Choice:
        """Of two greedy choices, each confirmed, the one of fewer calls, or of fewer states for as good as no more: the
        first saves calls wherever a step can, the second calls times states throughout, and leaves motions last."""
        calls, work, one, two = self._calls_saved, self._work_saved, self._singles, self._pairs
        both = [self._greedy(((calls, one), (calls, two), (work, one), (work, two))),
                self._greedy(((work, self._firsts), (work, two), (work, one)))]  # fmt: skip
        least = min(choice.after.calls for choice in both) * exp(WORTH)
        return min((choice for choice in both if choice.after.calls <= least), key=lambda choice: choice.after.states)

    def _greedy(self, order: Order) -> Choice:
        kept: list[Set] = [frozenset()]
        banned: set[Set] = set()
        rounds, found = 0, self.confirm(frozenset())
        while rounds < ROUNDS:
            path = self.path(kept, banned, order)
            if path == kept:
                break
            rounds += 1
            last = self.certified(path[-1])
            if self.holds(last):
                kept, found = path, last
                continue
            low, high = len(kept) - 1, len(path) - 1  # path[low] is kept, path[high] is not
            while high - low > 1:
                middle = (low + high) // 2
                rounds, tried = rounds + 1, self.certified(path[middle])
                low, high, found = (middle, high, tried) if self.holds(tried) else (low, middle, found)
            banned.add(path[high] - path[low])
            kept = path[: low + 1]
        chosen = kept[-1]
        left_out = tuple(effect for effect in self.effects if effect in chosen)
        return Choice(self.effects, left_out, self.predicted(chosen), found, self.holds(found),
                      self.cost(frozenset()), self.cost(chosen), rounds)  # fmt: skip

    def further(self, chosen: Set) -> dict[Effect, float]:
        """Largest confirmed change if an effect that stayed went, too, with what it needs: at a tolerance above, it
        would no longer matter. Only legal and finite ones."""
        found = {}
        for effect, step in zip(self.effects, self._singles(), strict=True):
            if effect not in chosen and not illegal(chosen | step):
                found[effect] = float(abs(self.confirm(chosen | step)).max())
        return {effect: change for effect, change in found.items() if change < inf}

    def holds(self, changes: np.ndarray) -> bool:
        """Whether all changes are within the tolerance."""
        return bool((abs(changes) <= self.tolerance).all())

    def path(self, kept: list[Set], banned: set[Set], order: Order) -> list[Set]:
        """The path that goes on from a kept one, step by step, as far as predictions allow."""
        path = list(kept)
        while step := self._next(path[-1], banned, order):
            path.append(path[-1] | step)
        return path

    def _next(self, chosen: Set, banned: set[Set], order: Order) -> Set:
        """The next step: one that saves by the first of the measures by which one does; empty where none is within the
        budget."""
        found = (self._best(chosen, banned, steps(), saved) for saved, steps in order)
        return next((step for step in found if step), frozenset())

    def _calls_saved(self, chosen: Set, further: Set) -> float:
        """Logarithm, of savings worth the tolerance they take."""
        saved = log(self.cost(chosen).calls / self.cost(further).calls)
        return saved if saved > WORTH else 0.0

    def _work_saved(self, chosen: Set, further: Set) -> float:
        now, then = self.cost(chosen), self.cost(further)
        return log(now.work / then.work) if then.calls <= now.calls * (1 + EVEN) else 0.0

    def _singles(self) -> list[Set]:
        """Every effect with those that it needs or that go before it."""
        named = {effect.name: effect for effect in self.effects}
        return [frozenset([effect, *(named[name] for name in (*effect.needs, *effect.after))])
                for effect in self.effects]  # fmt: skip

    def _firsts(self) -> list[Set]:
        """The same of effects that none need go after."""
        return [own for own in self._singles() if not any(effect.last for effect in own)]

    def _pairs(self) -> list[Set]:
        """Pairs of which at least one breaks the tolerance alone, while both together hold it; of effects that others
        go before, the first only."""
        if self._promising is None:
            alone = {one: self._share(one) for one in self._singles() if not any(effect.after for effect in one)}
            tried = [one for one, share in alone.items() if share < HOPELESS or any(effect.singular for effect in one)]
            found = [one | two for one, two in combinations(tried, 2) if max(alone[one], alone[two]) > BUDGET
                     and not illegal(one | two) and not (one <= two or two <= one)]  # fmt: skip
            self._promising = [pair for pair in found if self._glance(pair) <= BUDGET and self._share(pair) <= BUDGET]
        return self._promising

    def _glance(self, chosen: Set) -> float:
        """Share of the tolerance at the middle one of the screened speeds."""
        at = self.screened[len(self.screened) // 2]
        return float(abs(self._worst([at], chosen, self._predict)).max()) / self.tolerance

    def _best(self, chosen: Set, banned: set[Set], steps: list[Set], saved: Callable[[Set, Set], float]) -> Set:
        """The step that saves most for what it adds to the predicted error; empty where none is within the budget."""
        best, most, now = frozenset[Effect](), 0.0, self._share(chosen)
        for step in steps:
            further = chosen | step
            if further == chosen or step - chosen in banned or step in banned or illegal(further):
                continue
            share = self._on_the_way(chosen, further)
            score = saved(chosen, further) / max(share - now, LEAST) if share <= BUDGET else 0.0
            if score > most:
                best, most = step - chosen, score
        return best

    def _on_the_way(self, chosen: Set, further: Set) -> float:
        """Share of a set, or a larger one on the way to it, effect after effect: none that cancel later are kept."""
        share = self._share(further)
        last = max((effect for effect in further - chosen if effect.after), key=lambda e: len(e.after), default=None)
        return share if last is None or share > BUDGET else max(share, self._on_the_way(chosen, further - {last}))

    def _share(self, chosen: Set) -> float:
        """Largest predicted change by the tolerance."""
        return float(abs(self.predicted(chosen)).max()) / self.tolerance


LEAST = 1e-3
"""Share of the tolerance below which an error counts as none."""
