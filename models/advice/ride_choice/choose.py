"""Which effects a scene's quantities can do without: screened one by one, chosen by what they save, confirmed.

A greedy choice: the next effect to be left out is the one that saves most calls at the stable step (their logarithm)
for the error that the screen predicts for the whole set; where none saves any, calls times states, if calls do not
rise. What it takes must hold:

- at every listed speed, by the exact solve, certified by the identity of covariance and adjoint;
- between the speeds, and with all parameters off by a few per cent, wherever that is worst;
- effect by effect: each one left out alone, and all but each one. An error that lives because two larger ones cancel
  holds until one of them changes.

Where a set does not hold, the step of the path that breaks it is found by halving, taken back for good, and the choice
goes on without it. At last every effect comes back whose absence saves no calls at equal accuracy: of runs by the
classical Runge-Kutta method, each in the longest steps that keep the tolerance. What is reported was confirmed, always.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf, log

import numpy as np

from models.advice.ride_choice.cost import STAGES, Cost, cost
from models.advice.ride_choice.march import March, longest_step
from models.advice.ride_choice.marched import confirms
from models.advice.ride_choice.neighbourhood import Neighbourhood
from models.advice.ride_choice.reduced import Reduced, Whole
from models.advice.ride_choice.screen import Screen, confirmed, silent
from models.core.errors import InputError
from models.systems.ride.effects import tyre_damping
from models.systems.ride.reduced_scene import Effect, Held, effects_of, illegal, without

SCREENED = 3
"""Speeds at which effects are screened, from the slowest to the fastest; the choice is confirmed at all."""
ROUNDS = 30
"""Choices that are confirmed at most."""
CERTAIN = 1e-12
"""Relative error of the identity that certifies a choice; beyond it, rounding has eaten the certificate."""
WORTH, EVEN = 0.05, 1e-3
"""Logarithm of calls up to which two sets cost the same; by how much, relative, a step that saves states may raise
them."""
SHORTER = 0.9
"""A step that no run confirms becomes so many times as long."""
LEAST = 1e-3
"""Share of the tolerance below which an error counts as none."""

Set = frozenset[Effect]
Saved = Callable[[Set, Set], float]
"""What a step saves, from a set to a larger one."""


@dataclass(frozen=True)
class Choice:
    """Effects ``left_out`` of all ``candidates``; relative changes (quantities,) of standard deviations.

    predicted and confirmed : the worst over the listed speeds, with sign; between : over all speeds of their range;
    off : there with parameters that are off, where that is worst; kept : all of them within the tolerance.
    before, after : cost at equal accuracy; stable : the longest stable steps (s) of both, which no accuracy bounds.
    rounds : choices that were confirmed. said : why promising effects were not left out.
    """

    candidates: tuple[Effect, ...]
    left_out: tuple[Effect, ...]
    predicted: np.ndarray
    confirmed: np.ndarray
    between: np.ndarray
    off: np.ndarray
    kept: bool
    before: Cost
    after: Cost
    stable: tuple[float, float]
    rounds: int
    said: tuple[str, ...]


class Chooser:
    """Candidates of a scene at its speeds (m/s), for quantities (names of outputs, weighted ones too)."""

    def __init__(
        self, held: Held, speeds: Sequence[float] | np.ndarray, quantities: Sequence[str], tolerance: float
    ) -> None:
        self.held, self.tolerance, self.effects = held, tolerance, effects_of(held)
        self.wholes = [Whole(held, float(speed)) for speed in speeds]
        names = self.wholes[0].full.system.names
        self.quantities, self.rows = tuple(quantities), [names.index(name) for name in quantities]
        few = min(SCREENED, len(speeds))
        self.screened = [self.wholes[i] for i in np.linspace(0, len(speeds) - 1, few).round().astype(int)]
        self.full = [confirmed(whole.full, self.rows) for whole in self.wholes]
        self._check(quantities)
        Screen(self.wholes[0].full, self.rows)  # refuses a vehicle that cannot be screened
        self.near = Neighbourhood(held, np.asarray(speeds, float), [self._plain(name) for name in quantities])
        self._screens: dict[tuple[int, Set], Screen] = {}
        self._systems: dict[tuple[int, Set], Reduced | None] = {}
        self._predicted: dict[Set, np.ndarray] = {}
        self._costs: dict[Set, Cost] = {}
        self._accurate: dict[Set, Cost] = {}
        self._between: dict[Set, np.ndarray] = {}
        self._off: dict[Set, np.ndarray] = {}
        self.refused: dict[Set, str] = {}

    def _plain(self, quantity: str) -> tuple[int, str]:
        """Row of the vehicle's output, and its weighting or ""."""
        weighted = {f"{name} {by}": (name, by) for name, by in self.held.scene.weighting.items()}
        name, by = weighted.get(quantity, (quantity, ""))
        return [output.name for output in self.held.vehicle.outputs].index(name), by

    def _check(self, quantities: Sequence[str]) -> None:
        for whole, variances in zip(self.wholes, self.full, strict=True):
            for name, own, least in zip(quantities, variances, silent(whole.full, self.rows), strict=True):
                if not least < own < inf:
                    said = "has no finite standard deviation above zero in this scene, so nothing to hold it to"
                    raise InputError("", f"quantities.{name}", None, said)

    def rest(self, chosen: Set) -> Held:
        """The scene less these effects."""
        return without(self.held, sorted(chosen, key=lambda effect: effect.name))

    def system(self, whole: Whole, chosen: Set) -> Reduced | None:
        """The scene less these effects at a speed; None where nothing sensible is left."""
        key = (id(whole), chosen)
        if key not in self._systems:
            try:
                self._systems[key] = whole.reduced(self.rest(chosen))
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
        """The same by the exact solve, of all listed speeds."""
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

    def _worst(
        self, wholes: Sequence[Whole], chosen: Set, variances: Callable[[Whole, Set, Reduced], np.ndarray]
    ) -> np.ndarray:
        changes = []
        for whole in wholes:
            reduced, full = self.system(whole, chosen), self.full[self.wholes.index(whole)]
            try:
                found = np.full(len(full), inf) if reduced is None else variances(whole, chosen, reduced)
            except InputError:  # unstable
                found = np.full(len(full), inf)
            changes.append(np.sqrt(found / full) - 1.0)
        return largest(np.array(changes))

    def between(self, chosen: Set) -> np.ndarray:
        """Changes (quantities,) of the worst speed of the range; inf where there is no system."""
        if chosen not in self._between:
            reduced = self.system(self.wholes[0], chosen)
            finite = reduced is not None and all((d[self.rows] == 0).all() for d in reduced.system.D)
            self._between[chosen] = (
                largest(self.near.changes(self.rest(chosen))) if finite else np.full(len(self.rows), inf)
            )
        return self._between[chosen]

    def off(self, chosen: Set) -> np.ndarray:
        """The same with parameters off, in the corner that is worst for each quantity."""
        if chosen not in self._off:
            rest = self.rest(chosen)
            found = [self.near.changes(rest, corner) for corner in self.near.corners(rest)]
            self._off[chosen] = largest(np.concatenate(found))
        return self._off[chosen]

    def kept(self, chosen: Set) -> bool:
        """Whether the tolerance holds without these effects, wherever and whatever of them is left out."""
        if not chosen:
            return True
        if not (self.holds(self.certified(chosen)) and self.holds(self.between(chosen))):
            return False
        why = self._cancels(chosen)
        off = np.zeros(len(self.rows)) if why else self.off(chosen)
        if not self.holds(off):
            why = f"changes {self._told(off)} with parameters 5 % off"
        if why:
            self.refused[chosen] = why
        return not why

    def _cancels(self, chosen: Set) -> str:
        """Which effect alone, or which one's coming back, breaks the tolerance that all together keep; or empty.

        Changes without end do not count: white noise that passes is nothing that another change could make up for.
        """
        parts = {
            f"{effect.name} alone changes": step
            for effect, step in zip(self.effects, self._singles(), strict=True)
            if step < chosen
        }
        parts |= {f"all but {effect.name} change": chosen - {effect} for effect in chosen}
        for said, part in parts.items():
            found = np.zeros(len(self.rows)) if not part or illegal(part) else self.between(part)
            if np.isfinite(found).all() and not self.holds(found):
                return f"holds by errors that cancel: {said} {self._told(found)}"
        return ""

    def _told(self, changes: np.ndarray) -> str:
        worst = int(abs(changes).argmax())
        return f"{self.quantities[worst]} by {100 * changes[worst]:+.3g} %"

    def cost(self, chosen: Set) -> Cost:
        """At the stable step of the dearest screened speed; without end where nothing sensible is left."""
        if chosen not in self._costs:
            systems = [self.system(whole, chosen) for whole in self.screened]
            costs = (Cost(0, 0.0, inf) if system is None else cost(system) for system in systems)
            self._costs[chosen] = max(costs, key=lambda c: c.calls)
        return self._costs[chosen]

    def accurate(self, chosen: Set) -> Cost:
        """At the longest step that keeps the tolerance at all screened speeds, what is left out and steps together."""
        if chosen not in self._accurate:
            exact = [np.sqrt(self.full[self.wholes.index(whole)]) for whole in self.screened]
            step = longest_step(self.marches(chosen), exact, self.tolerance)
            self._accurate[chosen] = self._at(chosen, step)
        return self._accurate[chosen]

    def marches(self, chosen: Set) -> list[March]:
        """Runs at the screened speeds."""
        weightings = tuple((row, by) for row, (_, by) in zip(self.rows, self.near.quantities, strict=True) if by)
        systems = [whole.reduced(self.rest(chosen)) for whole in self.screened]
        return [
            March(reduced, whole.speed, tuple(self.rows), weightings)
            for reduced, whole in zip(systems, self.screened, strict=True)
        ]

    def _at(self, chosen: Set, step: float) -> Cost:
        return Cost(self.cost(chosen).states, step, STAGES / step if step else inf)

    def _by_run(self, chosen: Set) -> Cost:
        """``accurate``, with a step that a run confirms, at the middle one of the screened speeds."""
        step, marches = self.accurate(chosen).step, self.marches(chosen)
        while step and not confirms(marches[len(marches) // 2], step):
            step *= SHORTER
        return self._at(chosen, step)

    def choose(self) -> Choice:
        """The greedy choice, confirmed, less what saves nothing at equal accuracy."""
        chosen, rounds = self._greedy((self._calls_saved, self._work_saved))
        chosen = self._worthwhile(chosen)
        if self.accurate(chosen).calls * (1 + WORTH) > self.accurate(frozenset()).calls:
            chosen = frozenset()
        found, between, none = self.confirm(chosen), self.between(chosen), frozenset[Effect]()
        off = self.off(chosen) if chosen else np.zeros(len(self.rows))
        left_out = tuple(effect for effect in self.effects if effect in chosen)
        return Choice(
            self.effects,
            left_out,
            self.predicted(chosen),
            found,
            between,
            off,
            self.holds(found) and self.holds(between) and self.holds(off),
            self._by_run(none),
            self._by_run(chosen),
            (self.cost(none).step, self.cost(chosen).step),
            rounds,
            self._reasons(chosen),
        )

    def _reasons(self, chosen: Set) -> tuple[str, ...]:
        """Of the larger sets that kept the tolerance as they stood, and were refused all the same."""
        found = {frozenset(refused - chosen): why for refused, why in self.refused.items() if refused - chosen}
        return tuple(
            f"{' and '.join(sorted(effect.name for effect in more))} stays: without it, the choice {why}"
            for more, why in found.items()
        )

    def _greedy(self, measures: tuple[Saved, ...]) -> tuple[Set, int]:
        """The set, and how many were confirmed."""
        kept: list[Set] = [frozenset()]
        banned: set[Set] = set()
        rounds = 0
        while rounds < ROUNDS:
            path = self.path(kept, banned, measures)
            if path == kept:
                break
            rounds += 1
            if self.kept(path[-1]):
                kept = path
                continue
            low, high = len(kept) - 1, len(path) - 1  # path[low] is kept, path[high] is not
            while high - low > 1:
                middle = (low + high) // 2
                rounds += 1
                low, high = (middle, high) if self.kept(path[middle]) else (low, middle)
            banned.add(path[high] - path[low])
            kept = path[: low + 1]
        return kept[-1], rounds

    def _worthwhile(self, chosen: Set) -> Set:
        """Less every effect that may come back for hardly more calls at equal accuracy, or without a shorter stable
        step: calls that are fewer then are so because errors of what is left out and of steps make up for each other.
        """
        fewer = [chosen - {effect} for effect in chosen if not illegal(chosen - {effect})]
        for less in sorted(fewer, key=lambda one: float(abs(self.between(one)).max())):
            if self.cost(less).step < self.accurate(chosen).step * (1 - WORTH):
                continue  # it alone bounds the step
            same = self.cost(less).step >= self.cost(chosen).step * (1 - WORTH)
            same = same or self.accurate(less).calls <= self.accurate(chosen).calls * (1 + WORTH)
            if same and self.kept(less):
                return self._worthwhile(less)
        return chosen

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

    def path(self, kept: list[Set], banned: set[Set], measures: tuple[Saved, ...]) -> list[Set]:
        """The path that goes on from a kept one, step by step, as far as predictions allow."""
        path = list(kept)
        while step := self._next(path[-1], banned, measures):
            path.append(path[-1] | step)
        return path

    def _next(self, chosen: Set, banned: set[Set], measures: tuple[Saved, ...]) -> Set:
        """The next step: one that saves by the first of the measures by which one does; empty where none is within the
        tolerance."""
        found = (self._best(chosen, banned, saved) for saved in measures)
        return next((step for step in found if step), frozenset())

    def _calls_saved(self, chosen: Set, further: Set) -> float:
        """Logarithm, of savings worth the tolerance they take."""
        saved = log(self.cost(chosen).calls / self.cost(further).calls)
        return saved if saved > WORTH else 0.0

    def _work_saved(self, chosen: Set, further: Set) -> float:
        now, then = self.cost(chosen), self.cost(further)
        return log(now.work / then.work) if then.calls <= now.calls * (1 + EVEN) else 0.0

    def _singles(self) -> list[Set]:
        """Every effect with those that it needs."""
        named = {effect.name: effect for effect in self.effects}
        return [frozenset([effect, *(named[name] for name in effect.needs)]) for effect in self.effects]

    def _steps(self) -> list[Set]:
        """These, and where white noise would pass, the same with damping of the tyres, by which it comes."""
        damping = frozenset(effect for effect in self.effects if effect.name == tyre_damping.NAME)
        singles = self._singles()
        return singles + [step | damping for step in singles if damping and not np.isfinite(self.predicted(step)).all()]

    def _best(self, chosen: Set, banned: set[Set], saved: Saved) -> Set:
        """The step that saves most for what it adds to the predicted error; empty if none is within the tolerance."""
        best, most, now = frozenset[Effect](), 0.0, self._share(chosen)
        for step in self._steps():
            further = chosen | step
            if further == chosen or step - chosen in banned or step in banned or illegal(further):
                continue
            share = self._share(further)
            score = saved(chosen, further) / max(share - now, LEAST) if share <= 1.0 else 0.0
            if score > most:
                best, most = step - chosen, score
        return best

    def _share(self, chosen: Set) -> float:
        """Largest predicted change by the tolerance."""
        return float(abs(self.predicted(chosen)).max()) / self.tolerance


def largest(changes: np.ndarray) -> np.ndarray:
    """Of changes (n, quantities) the largest of each quantity, with its sign."""
    return np.asarray(changes[abs(changes).argmax(axis=0), np.arange(changes.shape[1])])
