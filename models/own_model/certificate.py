"""Whether builds move alike: mass matrix, forces and accelerations at random states.

Accelerations are compared in the coordinates of the description, each state's difference by the largest acceleration of
that state; masses and forces by their largest entries. What a badly conditioned mass matrix makes of rounding is
counted: the bound is 1e-10, or 100 times the rounding of that matrix's condition where this is more, up to 1e-6, and
then said.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from models.core.errors import RunFailed
from models.own_model.builds import (
    BUILDS,
    Equations,
    Moved,
    State,
    as_parsed,
    equations,
    expected,
    largest_gap,
    rigid,
    sliding,
)
from models.own_model.reading import TwinModel
from models.own_model.states import COUNT, random_states

ALIKE = 1e-10
"""Relative difference up to which accelerations are the same."""
ROUNDING = 100.0 * float(np.finfo(float).eps)
LOOSEST = 1e-6
"""Bound beyond which nothing is certified, whatever the condition of the mass matrix."""
SMALL = 1e-6
"""m/s^2, rad/s^2: what accelerations are compared with where none is larger."""
MET = 1e-10
"""m, rad: gap up to which a state satisfies the constraints of a build."""
SINGULAR = "the mass matrix is singular: something without inertia can move, or constraints repeat one another"
QUIET = 1e-3
"""Share of the largest acceleration of all states, or of gravity, that counts where a state has less: what is there is
rounding alone, of weights that joints bear."""
FASTER = (1.0, 3.0, 10.0)
"""Factors of random rates, of which the first is taken at which all dry friction slides."""
Told = Callable[[float], object]
"""Told the share that is done."""


@dataclass(frozen=True)
class Agreement:
    """Of one build with the file's own model: largest relative differences of mass, force and acceleration.

    worst : the coordinate whose acceleration differs most; difference, size : of its accelerations there, in m/s^2 or
    rad/s^2; bound : what acceleration and mass may differ by; gap : how far states are from satisfying the build's own
    constraints (m, rad).
    """

    build: str
    mass: float
    force: float
    acceleration: float
    worst: str
    difference: float
    size: float
    bound: float
    gap: float = 0.0

    @property
    def alike(self) -> bool:
        """Whether accelerations are the same, and the mass matrix: what no force moves now may be pushed one day."""
        return max(self.acceleration, self.mass) <= self.bound and self.gap <= MET


def certificate(twin: TwinModel, count: int = COUNT, told: Told = lambda share: None) -> tuple[Agreement, ...]:
    """Every build of the description beside the file's own model; RunFailed where dry friction sticks at all states."""
    states, rows = states_of(twin, count), list[Agreement]()
    for i, build in enumerate(BUILDS):
        true, seen = (moved_at(each, states) for each in (expected(twin, build), equations(twin, build)))
        rows.append(replace(agreement(build, true, seen, twin), gap=largest_gap(twin, build, states)))
        told((i + 1) / len(BUILDS))
    return tuple(rows)


def states_of(twin: TwinModel, count: int) -> list[State]:
    """Random states; where dry friction sticks with rates that are faster, and left out where it sticks all the same.

    RunFailed where none is left.
    """
    states = list[State]()
    for q, v in zip(*random_states(twin, count), strict=True):
        tried = (sliding(twin, [(q, factor * v)]) for factor in FASTER)
        states += next((each for each in tried if each), [])
    if not states:
        said = "dry friction sticks at all states, and MuJoCo's gives way: try `--without friction_loss`"
        raise RunFailed("twin", said)
    return states


def softness(twin: TwinModel, count: int) -> float:
    """Largest relative difference of accelerations of the file's own model with MuJoCo's soft constraints from those
    with rigid ones, at states that satisfy them."""
    states = states_of(twin, count)
    return agreement("", moved_at(rigid(twin), states), moved_at(as_parsed(twin), states), twin).acceleration


def moved_at(move: Equations, states: Sequence[tuple[np.ndarray, np.ndarray]]) -> list[Moved]:
    """Mass, forces and accelerations at all states; RunFailed where a mass matrix cannot be solved for any."""
    try:
        return [move(q, v) for q, v in states]
    except np.linalg.LinAlgError:
        raise RunFailed("twin", SINGULAR) from None


def agreement(build: str, expected: Sequence[Moved], seen: Sequence[Moved], twin: TwinModel) -> Agreement:
    """Largest differences over all states of a model."""
    mass = max(_share(a.mass, b.mass) for a, b in zip(expected, seen, strict=True))
    force = max(_share(a.force, b.force) for a, b in zip(expected, seen, strict=True))
    largest = max(float(np.abs(a.acceleration).max()) for a in expected)
    least = QUIET * max(largest, float(np.linalg.norm(twin.driven.gravity)))
    shares = [_share(a.acceleration, b.acceleration, least) for a, b in zip(expected, seen, strict=True)]
    at = int(np.nanargmax(shares)) if np.isfinite(shares).any() else 0
    apart = np.abs(seen[at].acceleration - expected[at].acceleration)
    i = int(apart.argmax())
    bound = min(LOOSEST, max(ALIKE, ROUNDING * max(_condition(a.mass) for a in expected)))
    size = float(np.abs(expected[at].acceleration[i]))
    worst = max(shares) if np.isfinite(shares).all() else np.inf
    return Agreement(build, mass, force, worst, twin.names[i], float(apart[i]), size, bound)


def _share(expected: np.ndarray, seen: np.ndarray, least: float = 0.0) -> float:
    return float(np.abs(seen - expected).max() / max(SMALL, least, np.abs(expected).max()))


def _condition(mass: np.ndarray) -> float:
    """Of a mass matrix scaled to a unit diagonal."""
    scale = 1.0 / np.sqrt(np.maximum(mass.diagonal(), np.finfo(float).tiny))
    return float(np.linalg.cond(mass * np.outer(scale, scale)))
