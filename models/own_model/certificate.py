"""Agreement of all builds of a user's model with MuJoCo's: mass matrix, forces and accelerations at random states.

Every coordinate is judged for itself, in the coordinates of the description: the difference of its acceleration by its
acceleration at that state (the largest of three where a body turns or shifts along three axes at once), that of an
entry of the mass matrix by the root of both entries of the diagonal. Where a change of all numbers by 1000 roundings
changes it by more than 1e-10 of that (``rounding``), its difference is counted by this change: 1e-10 is then the whole.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from models.core.errors import RunFailed
from models.engines.mujoco_quiet import without_warnings
from models.own_model.builds import (
    ALL_BUILDS,
    PLAIN_BUILD,
    SOFT_BUILD,
    Equations,
    State,
    StateMotion,
    equations_of_build,
    expected_equations,
    is_soft_in_mujoco,
    largest_constraint_gap,
    moving_friction_states,
    sliding_states,
)
from models.own_model.coordinates import joint_coordinate_slices
from models.own_model.reading import TwinModel
from models.own_model.rounding import sensitivities
from models.own_model.states import STATE_COUNT, random_states

EQUAL_ACCELERATION_SHARE = 1e-10
"""Relative difference up to which accelerations count as equal."""
ROUNDING_SHARE = 1000.0 * float(np.finfo(float).eps)
"""Relative change of all numbers that rounding may amount to: up to 300 roundings were seen, with 30 joints in a
row."""
WORST_CONDITION = 1e8
"""Condition number of a mass matrix beyond which the rounding allowed does not grow further."""
CONSTRAINT_GAP = 1e-10
"""Violation (m, rad) up to which a state satisfies the constraints of a build."""
SINGULAR_MASS_REASON = (
    "the mass matrix is singular: something without inertia can move, or constraints repeat one another"
)
HARDLY_MOVING_SHARE = 1e-6
"""Share of the largest acceleration, weighted with the root of inertia, below which a coordinate counts as hardly
moving."""
NAMED_COORDINATE_SHARE = 0.1
"""Share of the largest coordinate of a motion without inertia from which a coordinate is named in the message."""
SMALLEST_FLOAT = float(np.finfo(float).tiny)
RATE_FACTORS = (1.0, 3.0, 10.0)
"""Factors of random rates; the first at which all dry friction slides is taken."""
Progress = Callable[[float], object]
"""Function that is called with the share of the work that is done."""


@dataclass(frozen=True, eq=False)
class MotionReference:
    """Motion of the file's model in MuJoCo as the reference for the builds: names of coordinates (n,), for each the
    slice of coordinates that are judged together with it (n,), its motion at some states, and the sensitivity of this
    motion to rounding."""

    names: tuple[str, ...]
    judged_together: tuple[slice, ...]
    motions: list[StateMotion]
    sensitivities: list[StateMotion]


@dataclass(frozen=True)
class Agreement:
    """Agreement of one build with the file's model in MuJoCo: largest relative differences of mass, force and
    acceleration.

    worst : the coordinate whose acceleration differs most; difference, size : of its accelerations there, in m/s^2 or
    rad/s^2; bound : share of the largest acceleration of a coordinate that moves which may be rounding, 1e-10 or more;
    gap : how far states are from satisfying the build's own constraints (m, rad).
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
    def same_motion(self) -> bool:
        """Whether accelerations and the mass matrix agree. The mass matrix counts too, because a force may later act
        where none acts now."""
        return max(self.acceleration, self.mass) <= EQUAL_ACCELERATION_SHARE

    @property
    def alike(self) -> bool:
        """Whether the motion is the same, and the build's own constraints are satisfied."""
        return self.same_motion and self.gap <= CONSTRAINT_GAP


def certificate(
    user_model: TwinModel, state_count: int = STATE_COUNT, report_progress: Progress = lambda share: None
) -> tuple[Agreement, ...]:
    """Agreement of every build of the description with the file's model in MuJoCo.

    RunFailed where a joint with dry friction cannot move.
    """
    states, rows = comparison_states(user_model, state_count), list[Agreement]()
    soft = reference_of_file(user_model, states, SOFT_BUILD)
    rigid = reference_of_file(user_model, states, PLAIN_BUILD) if is_soft_in_mujoco(user_model) else soft
    for i, build in enumerate(ALL_BUILDS):
        row = agreement_of_build(
            build, soft if build == SOFT_BUILD else rigid, motion_at(equations_of_build(user_model, build), states)
        )
        rows.append(replace(row, gap=largest_constraint_gap(user_model, build, states)))
        report_progress((i + 1) / len(ALL_BUILDS))
    return tuple(rows)


def comparison_states(user_model: TwinModel, state_count: int) -> list[State]:
    """Random states at which dry friction slides. Where it sticks in MuJoCo, the rates are increased; a state is left
    out if it sticks all the same, unless all do: then those are taken at which every joint with dry friction moves.

    RunFailed where none does.
    """
    states, drawn = list[State](), list(zip(*random_states(user_model, state_count), strict=True))
    for q, v in drawn:
        tried = (sliding_states(user_model, [(q, factor * v)]) for factor in RATE_FACTORS)
        states += next((each for each in tried if each), [])
    states = states or moving_friction_states(user_model, drawn)
    if not states:
        said = "a joint with dry friction cannot move, so its friction has no direction: try `--without friction_loss`"
        raise RunFailed("twin", said)
    return states


def softness_difference(user_model: TwinModel, state_count: int) -> float:
    """Largest relative difference between the file's accelerations with MuJoCo's soft constraints and those with rigid
    constraints, at states that satisfy the constraints."""
    states = comparison_states(user_model, state_count)
    return agreement_of_build(
        "",
        reference_of_file(user_model, states, PLAIN_BUILD),
        motion_at(expected_equations(user_model, SOFT_BUILD), states),
    ).acceleration


def reference_of_file(user_model: TwinModel, states: Sequence[State], build_name: str) -> MotionReference:
    """``MotionReference`` for a build from the file's model in MuJoCo at some states. Raises RunFailed as ``motion_at``
    does."""
    law = partial(expected_equations, build_name=build_name)
    moved = motion_at(law(user_model), states)
    _check_inertia(user_model, moved[0].mass)
    return MotionReference(
        user_model.names,
        joint_coordinate_slices(user_model.model),
        moved,
        sensitivities(user_model, law, states, moved),
    )


def _check_inertia(user_model: TwinModel, mass_matrix: np.ndarray) -> None:
    """Raise RunFailed, naming the joints that together move without inertia, where the mass matrix (n, n) is
    singular."""
    scale = 1.0 / np.sqrt(np.maximum(mass_matrix.diagonal(), SMALLEST_FLOAT))
    values, shapes = np.linalg.eigh(mass_matrix * np.outer(scale, scale))
    if values[0] <= len(mass_matrix) * float(np.finfo(float).eps):
        share = np.abs(shapes[:, 0])
        names = [
            name
            for name, part in zip(user_model.names, share, strict=True)
            if part > NAMED_COORDINATE_SHARE * share.max()
        ]
        raise RunFailed(user_model.name, f"the mass matrix is singular: {' and '.join(names)} can move without inertia")


def motion_at(equations: Equations, states: Sequence[tuple[np.ndarray, np.ndarray]]) -> list[StateMotion]:
    """Mass matrix, forces and accelerations at all states. Raises RunFailed where a mass matrix is singular or an
    acceleration is not finite."""
    try:
        with without_warnings():  # which say less than what is raised here
            moved = [equations(q, v) for q, v in states]
    except np.linalg.LinAlgError:
        raise RunFailed("twin", SINGULAR_MASS_REASON) from None
    if not all(np.isfinite(each.acceleration).all() for each in moved):
        raise RunFailed("twin", "an acceleration is not finite: a number of the file is too large, or a mass too small")
    return moved


def agreement_of_build(
    build_name: str, expected_reference: MotionReference, motions: Sequence[StateMotion]
) -> Agreement:
    """Largest differences between the motions of a build and the reference over all states."""
    rows = [_scales_at_state(expected_reference, i) for i in range(len(motions))]
    magnitudes, rounding = (StateMotion(*map(np.array, zip(*each, strict=True))) for each in zip(*rows, strict=True))
    apart = StateMotion(
        *(
            np.abs(np.array(there) - np.array(here))
            for there, here in _paired_values(motions, expected_reference.motions)
        )
    )
    mass, force, shares = (
        np.where(d > 0.0, d / np.maximum(np.maximum(a, r / EQUAL_ACCELERATION_SHARE), SMALLEST_FLOAT), 0.0)
        for d, a, r in zip(apart, magnitudes, rounding, strict=True)
    )
    at, i = np.unravel_index(np.argmax(np.nan_to_num(shares, nan=np.inf)), shares.shape)
    bound = _may_be_rounding(magnitudes, rounding.acceleration)
    sizes = (float(apart.acceleration[at, i]), float(np.abs(expected_reference.motions[at].acceleration[i])))
    return Agreement(
        build_name,
        _largest_difference(mass),
        _largest_difference(force),
        _largest_difference(shares),
        expected_reference.names[i],
        *sizes,
        bound,
    )


def _may_be_rounding(magnitudes: StateMotion, allowed_rounding: np.ndarray) -> float:
    """Largest ratio, over the coordinates, of the allowed rounding (s, n) to the largest acceleration, limited to 1e-10
    to 1; coordinates that hardly move are left out."""
    largest, allowed = magnitudes.acceleration.max(axis=0), allowed_rounding.max(axis=0)
    weighted = largest * np.sqrt(np.diagonal(magnitudes.mass, axis1=1, axis2=2).max(axis=0))
    moves = weighted > HARDLY_MOVING_SHARE * weighted.max()
    return min(1.0, max(EQUAL_ACCELERATION_SHARE, float((allowed[moves] / largest[moves]).max(initial=0.0))))


def _paired_values(
    build_motions: Sequence[StateMotion], expected_motions: Sequence[StateMotion]
) -> Iterator[tuple[tuple, tuple]]:
    """Pairs of a build's and the expected values over all states: first mass matrices, then forces, then
    accelerations."""
    return zip(zip(*build_motions, strict=True), zip(*expected_motions, strict=True), strict=True)


def _largest_difference(relative_differences: np.ndarray) -> float:
    return float(relative_differences.max()) if np.isfinite(relative_differences).all() else np.inf


def _scales_at_state(expected_reference: MotionReference, state_index: int) -> tuple[StateMotion, StateMotion]:
    """Reference magnitudes of masses, forces and accelerations at one state, and the rounding error allowed in each.

    The allowed error does not grow further where a mass matrix is nearly singular.
    """
    moved, sensitive = expected_reference.motions[state_index], expected_reference.sensitivities[state_index]
    inertia = np.sqrt(np.maximum(moved.mass.diagonal(), 0.0))
    force, acceleration = (np.abs(each) for each in (moved.force, moved.acceleration))
    acceleration = np.array([acceleration[together].max() for together in expected_reference.judged_together])
    magnitudes = StateMotion(np.outer(inertia, inertia), force, acceleration)
    allowed = ROUNDING_SHARE * min(1.0, WORST_CONDITION / _scaled_condition(moved.mass))
    return magnitudes, StateMotion(*(allowed * each for each in sensitive))


def _scaled_condition(mass_matrix: np.ndarray) -> float:
    """Condition number of a mass matrix after scaling to a unit diagonal."""
    scale = 1.0 / np.sqrt(np.maximum(mass_matrix.diagonal(), np.finfo(float).tiny))
    return float(np.linalg.cond(mass_matrix * np.outer(scale, scale)))
