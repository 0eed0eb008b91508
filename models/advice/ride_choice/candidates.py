"""Changes and savings by leaving out any set of effects of a ride: predicted, confirmed, examined
nearby, and run."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import wraps
from math import inf
from typing import Any, Self, TypeVar, cast

import numpy as np

from models.advice.ride_choice.march import Cost, March, cost, longest_step
from models.advice.ride_choice.neighbourhood import Neighbourhood
from models.advice.ride_choice.reduced import FullScene, Reduced
from models.advice.ride_choice.screen import Screen, confirmed, silent
from models.core.errors import InputError
from models.core.runge_kutta import STAGES
from models.systems.ride.omissions import effects_of
from models.systems.ride.reduced_scene import Effect, ReducedScene, without
from models.systems.ride.scene import RideScene

SCREENED = 3
"""Speeds at which effects are screened, from the slowest to the fastest; the choice is confirmed at all."""
CERTAIN = 1e-12
"""Relative error of the identity that certifies a choice; beyond it, rounding has eaten the certificate."""

Set = frozenset[Effect]
Method = TypeVar("Method", bound=Callable[..., Any])


def remembered(method: Method) -> Method:
    """A method whose answers its object keeps by their arguments."""

    @wraps(method)
    def answer(candidates: "Candidates", *asked: Any) -> Any:
        key = method.__name__, *asked
        if key not in candidates.answers:
            candidates.answers[key] = method(candidates, *asked)
        return candidates.answers[key]

    return cast(Method, answer)


class Candidates:
    """Effects of a scene at its speeds (m/s), for quantities (names of outputs, weighted ones too)."""

    def __init__(
        self, scene: ReducedScene, speeds: Sequence[float] | np.ndarray, quantities: Sequence[str], tolerance: float
    ) -> None:
        self.scene, self.tolerance, self.effects = scene, tolerance, effects_of(scene)
        self.answers: dict[tuple[Any, ...], Any] = {}
        self.wholes = [FullScene(scene, float(speed)) for speed in speeds]
        names = self.wholes[0].full.system.names
        self.quantities, self.rows = tuple(quantities), [names.index(name) for name in quantities]
        few = min(SCREENED, len(speeds))
        self.screened = [self.wholes[i] for i in np.linspace(0, len(speeds) - 1, few).round().astype(int)]
        self.full = [confirmed(whole.full, self.rows) for whole in self.wholes]
        for whole, variances in zip(self.wholes, self.full, strict=True):
            for name, variance, least in zip(quantities, variances, silent(whole.full, self.rows), strict=True):
                if not least < variance < inf:
                    allowed = "has no finite standard deviation above zero in this scene, so nothing to hold it to"
                    raise InputError("", f"quantities.{name}", None, allowed)
        Screen(self.wholes[0].full, self.rows)  # refuses a vehicle that cannot be screened
        self.near = Neighbourhood(scene, np.asarray(speeds, float), [self._plain(name) for name in quantities])

    @classmethod
    def of(cls, ride: RideScene) -> Self:
        """The candidate effects of a scene that asks for a choice."""
        assert ride.speeds is not None and ride.tolerance is not None
        return cls(ReducedScene.complete(ride), ride.speeds.all(), ride.quantities, ride.tolerance)

    def _plain(self, quantity: str) -> tuple[int, str]:
        """Row of the vehicle's output, and its weighting or ""."""
        weighted = {f"{name} {by}": (name, by) for name, by in self.scene.ride.weighting.items()}
        name, by = weighted.get(quantity, (quantity, ""))
        return [output.name for output in self.scene.vehicle.outputs].index(name), by

    def rest(self, chosen: Set) -> ReducedScene:
        """The reduced scene without these effects."""
        return without(self.scene, sorted(chosen, key=lambda effect: effect.name))

    @remembered
    def system(self, full_scene: FullScene, chosen: Set) -> Reduced | None:
        """System matrices of the scene without these effects at a speed; None where no sensible vehicle remains."""
        try:
            return full_scene.reduced(self.rest(chosen))
        except InputError:
            return None

    def screen(self, full_scene: FullScene, chosen: Set) -> Screen | None:
        """Covariance and adjoints of the scene less the singular ones of these effects."""
        base = frozenset(effect for effect in chosen if effect.singular)
        needs = {name for effect in base for name in effect.needs}
        return self._screen(full_scene, base | {effect for effect in chosen if effect.name in needs})

    @remembered
    def _screen(self, full_scene: FullScene, base: Set) -> Screen | None:
        reduced = self.system(full_scene, base)
        try:
            return None if reduced is None else Screen(reduced, self.rows)
        except InputError:
            return None

    @remembered
    def predicted(self, chosen: Set) -> np.ndarray:
        """Changes (quantities,) of the worst of the screened speeds; inf where there is no system."""
        return self._worst(self.screened, chosen, self._predict)

    def confirm(self, chosen: Set) -> np.ndarray:
        """Relative changes by leaving effects out, from the exact solve at all listed speeds."""
        return self._worst(self.wholes, chosen, lambda whole, chosen, reduced: confirmed(reduced, self.rows))

    def certified(self, chosen: Set) -> np.ndarray:
        """Changes by ``confirm``; inf where it holds the tolerance, but the identity of covariance and adjoint, which
        certifies it, is not exact at a screened speed."""
        changes = self.confirm(chosen)
        exact = not self.holds(changes) or all(self._exact(whole, chosen) for whole in self.screened)
        return changes if exact else np.full(len(changes), inf)

    def _exact(self, full_scene: FullScene, chosen: Set) -> bool:
        screen, reduced = self.screen(full_scene, frozenset()), self.system(full_scene, chosen)
        if screen is None or reduced is None:
            return False
        two, variance = screen.identity(reduced)
        return bool((abs(two / variance - 1.0) <= CERTAIN).all())

    def _predict(self, full_scene: FullScene, chosen: Set, reduced: Reduced) -> np.ndarray:
        screen = self.screen(full_scene, chosen)
        return np.full(len(self.rows), inf) if screen is None else screen.predicted(reduced)

    def _worst(
        self, wholes: Sequence[FullScene], chosen: Set, variances: Callable[[FullScene, Set, Reduced], np.ndarray]
    ) -> np.ndarray:
        changes = []
        for whole in wholes:
            reduced, full = self.system(whole, chosen), self.full[self.wholes.index(whole)]
            left = np.full(len(full), inf)
            with suppress(InputError):  # unstable
                left = left if reduced is None else variances(whole, chosen, reduced)
            changes.append(np.sqrt(left / full) - 1.0)
        return largest(np.array(changes))

    @remembered
    def between(self, chosen: Set) -> np.ndarray:
        """Changes (quantities,) of the worst speed of the range; inf where there is no system."""
        reduced = self.system(self.wholes[0], chosen)
        if reduced is None or not all((d[self.rows] == 0).all() for d in reduced.system.D):
            return np.full(len(self.rows), inf)
        return largest(self.near.changes(self.rest(chosen)))

    @remembered
    def off(self, chosen: Set) -> np.ndarray:
        """Relative changes with parameters varied to the corner that is worst for each quantity."""
        rest = self.rest(chosen)
        return largest(np.concatenate([self.near.changes(rest, corner) for corner in self.near.corners(rest)]))

    def holds(self, changes: np.ndarray) -> bool:
        """Whether all changes are within the tolerance."""
        return bool((abs(changes) <= self.tolerance).all())

    def told(self, changes: np.ndarray) -> str:
        """The largest of changes (quantities,) in words."""
        worst = int(abs(changes).argmax())
        return f"{self.quantities[worst]} by {100 * changes[worst]:+.3g} %"

    @remembered
    def cost(self, chosen: Set) -> Cost:
        """Cost of a run without these effects at the longest stable step of the dearest screened speed; infinite where
        no sensible vehicle remains."""
        systems = [self.system(whole, chosen) for whole in self.screened]
        costs = (Cost(0, 0.0, inf) if system is None else cost(system) for system in systems)
        return max(costs, key=lambda c: c.calls)

    @remembered
    def accurate(self, chosen: Set) -> Cost:
        """Cost of a run at the longest step that keeps the tolerance at all screened speeds, what is left out and steps
        together."""
        return self.at_step(chosen, longest_step(self.marches(chosen), self.exact(), self.tolerance))

    def exact(self) -> list[np.ndarray]:
        """Standard deviations (quantities,) of the whole scene at the screened speeds."""
        return [np.sqrt(self.full[self.wholes.index(whole)]) for whole in self.screened]

    def marches(self, chosen: Set) -> list[March]:
        """Runs at the screened speeds."""
        weightings = tuple((row, by) for row, (_, by) in zip(self.rows, self.near.quantities, strict=True) if by)
        rest = self.rest(chosen)
        return [March(whole.reduced(rest), whole.speed, tuple(self.rows), weightings) for whole in self.screened]

    def at_step(self, chosen: Set, step: float) -> Cost:
        """Cost of runs in steps (s)."""
        return Cost(self.cost(chosen).states, step, STAGES / step if step else inf)


def largest(changes: np.ndarray) -> np.ndarray:
    """The largest change of each quantity among changes (n, quantities), with its sign."""
    return changes[abs(changes).argmax(axis=0), np.arange(changes.shape[1])]
