"""Equations of motion of a user's model in every build: mass matrix and forces at a state, in the coordinates of
twinrig's description."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import mujoco
import numpy as np

from models.engines.free_vehicle import ENGINES, free_model
from models.engines.native_parts import FULL_FRICTION_SPEED
from models.multibody.plain.joint_elements import AppliedForces, PlainTree
from models.own_model.constraints import JacobianAt, constrained_forces, jacobian_by_differences, plain_constraints
from models.own_model.coordinates import MujocoState
from models.own_model.reading import TwinModel, constant_controls

PLAIN_BUILD = "plain"
ALL_BUILDS = (*ENGINES, PLAIN_BUILD)
SOFT_BUILD = "mujoco"
"""The build whose constraints are soft, as they are in the user's file; the constraints of the other builds are
rigid."""


class StateMotion(NamedTuple):
    """Mass matrix (n, n), forces (n,) and accelerations (n,) of a model at one state."""

    mass: np.ndarray
    force: np.ndarray
    acceleration: np.ndarray


State = tuple[np.ndarray, np.ndarray]
"""Coordinates and rates (n,) of a model."""
WHOLE_FRICTION_SHARE = 1.0 - 1e-12
"""Share of its full force from which a dry friction counts as sliding."""
Equations = Callable[[np.ndarray, np.ndarray], StateMotion]
"""Function that returns the motion (``StateMotion``) at coordinates and rates (n,)."""


def equations_of_build(user_model: TwinModel, build_name: str) -> Equations:
    """Equations of motion of the description as "exudyn", "mujoco" or "plain" builds it; constraints are soft in
    MuJoCo, and rigid in the others."""
    built: Any = plain_tree(user_model) if build_name == PLAIN_BUILD else free_model(build_name, user_model.driven)
    rigid = user_model.driven.tied and build_name != SOFT_BUILD
    terms = (
        _constraint_jacobian_function(user_model, built.ties if build_name != PLAIN_BUILD else None) if rigid else None
    )

    def move(q: np.ndarray, v: np.ndarray) -> StateMotion:
        mass, force = built.mass_and_force(0.0, q, v)
        if terms is not None:
            force = constrained_forces(mass, force, *terms(q, v))
        return StateMotion(mass, force, np.linalg.solve(mass, force))

    return move


def largest_constraint_gap(user_model: TwinModel, build_name: str, states: Sequence[State]) -> float:
    """Largest violation (m or rad) of a build's constraints at the states. Comparing accelerations would not show it:
    bodies in wrong relative positions can have the same accelerations."""
    if not user_model.driven.tied:
        return 0.0
    if build_name == PLAIN_BUILD:
        constraints = plain_constraints(user_model)
        return max(float(np.abs(constraints.gap(q).size).max()) for q, _ in states)
    built: Any = free_model(build_name, user_model.driven)
    return max(float(np.abs(built.gaps(q)).max(initial=0.0)) for q, _ in states)


def _constraint_jacobian_function(
    user_model: TwinModel, jacobian_at: JacobianAt | None
) -> Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Function that returns the constraint Jacobian J (c, n) and J' q' (c,) at a state, from plain equations or by
    differences of an engine's J."""
    if jacobian_at is None:
        return plain_constraints(user_model).terms
    if user_model.driven.connections:
        return partial(jacobian_by_differences, jacobian_at)

    def constant(q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        (rows,) = jacobian_at([q])
        return rows, np.zeros(len(rows))

    return constant


def plain_tree(user_model: TwinModel) -> PlainTree:
    """Equations of motion of a user's model in plain numpy."""
    loads = [(spring.body, spring.point, spring.load) for spring in user_model.driven.ground_springs]
    lines = [(line.ends, line.stiffness, line.damping, line.length) for line in user_model.driven.line_springs]
    frictions = [(friction.coordinate, friction.force, FULL_FRICTION_SPEED) for friction in user_model.driven.frictions]
    turns = [(turn.bodies, turn.axes, turn.stiffness, turn.damping) for turn in user_model.driven.turning_springs]
    pushes = [(load.body, load.point, load.force, load.moment) for load in user_model.driven.body_loads]
    return PlainTree(
        user_model.driven.vehicle, user_model.driven.gravity, AppliedForces(loads, lines, frictions, turns, pushes)
    )


def expected_equations(user_model: TwinModel, build_name: str) -> Equations:
    """Equations of motion with which a build must agree: MuJoCo's model of the file, with rigid constraints and Coulomb
    friction unless the build is MuJoCo's."""
    if build_name == SOFT_BUILD or not is_soft_in_mujoco(user_model):
        return equations_of_file(user_model)
    return rigid_equations(user_model) if user_model.driven.tied else sliding_equations(user_model)


def is_soft_in_mujoco(user_model: TwinModel) -> bool:
    """Whether a model has constraints or dry friction, which yield in MuJoCo but in no other build."""
    return user_model.driven.tied or bool(user_model.driven.frictions)


def equations_of_file(user_model: TwinModel) -> Equations:
    """Equations of motion of the file's model as MuJoCo parsed it."""
    data = mujoco.MjData(user_model.model)

    def move(q: np.ndarray, v: np.ndarray) -> StateMotion:
        state = forward_state(user_model, data, q, v)
        mass, force = _mass_and_forces_of_file(user_model, data, state, data.qfrc_constraint)
        return StateMotion(mass, force, np.linalg.solve(state.jacobian, data.qacc - state.bias))

    return move


def rigid_equations(user_model: TwinModel) -> Equations:
    """Equations of motion of the file's model as MuJoCo parsed it, with its equality constraints made rigid."""
    data = mujoco.MjData(user_model.model)
    terms = _constraint_jacobian_function(
        user_model, lambda places: [_constraint_jacobian_of_file(user_model, data, q) for q in places]
    )

    def move(q: np.ndarray, v: np.ndarray) -> StateMotion:
        rows, rest = terms(q, v)
        mass, force = _sliding_forces_of_file(user_model, data, q, v)
        force = constrained_forces(mass, force, rows, rest)
        return StateMotion(mass, force, np.linalg.solve(mass, force))

    return move


def sliding_equations(user_model: TwinModel) -> Equations:
    """Equations of motion of the file's model as MuJoCo parsed it, with dry friction by Coulomb's law."""
    data = mujoco.MjData(user_model.model)

    def move(q: np.ndarray, v: np.ndarray) -> StateMotion:
        mass, force = _sliding_forces_of_file(user_model, data, q, v)
        return StateMotion(mass, force, np.linalg.solve(mass, force))

    return move


def _sliding_forces_of_file(
    user_model: TwinModel, mujoco_data: mujoco.MjData, q: np.ndarray, v: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Mass matrix (n, n) and forces (n,) of MuJoCo's model without its equality constraints, with full dry friction
    against the rates."""
    state, sliding = forward_state(user_model, mujoco_data, q, v), np.empty(user_model.size)
    rubs, rows = mujoco_data.efc_type == mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF, np.zeros(mujoco_data.nefc)
    rows[rubs] = -np.sign(v[mujoco_data.efc_id[rubs]]) * mujoco_data.efc_frictionloss[rubs]
    mujoco.mj_mulJacTVec(user_model.model, mujoco_data, sliding, rows)
    return _mass_and_forces_of_file(user_model, mujoco_data, state, sliding)


def _constraint_jacobian_of_file(user_model: TwinModel, mujoco_data: mujoco.MjData, q: np.ndarray) -> np.ndarray:
    """Jacobian (c, n) of the file's equality constraints in MuJoCo, with respect to the coordinates of the
    description."""
    state = forward_state(user_model, mujoco_data, q, np.zeros(user_model.size))
    ties, rows = (
        mujoco_data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY,
        np.empty((user_model.size, mujoco_data.nefc)),
    )
    for row, unit in zip(rows, np.eye(user_model.size), strict=True):
        mujoco.mj_mulJacVec(user_model.model, mujoco_data, row, unit)
    of_constraints: np.ndarray = rows.T[ties] @ state.jacobian
    return of_constraints


def forward_state(user_model: TwinModel, mujoco_data: mujoco.MjData, q: np.ndarray, v: np.ndarray) -> MujocoState:
    """MuJoCo's state at coordinates and rates (n,); fills ``mujoco_data`` with the quantities of MuJoCo's model
    there."""
    state = user_model.coordinates.to_mujoco(q, v)
    mujoco_data.ctrl[:] = constant_controls(user_model.model)
    mujoco_data.qpos[:], mujoco_data.qvel[:], mujoco_data.time = state.qpos, state.qvel, 0.0
    mujoco.mj_forward(user_model.model, mujoco_data)
    return state


def _mass_and_forces_of_file(
    user_model: TwinModel, mujoco_data: mujoco.MjData, mujoco_state: MujocoState, constraint_forces: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Mass matrix (n, n) and forces (n,) of MuJoCo's model in the coordinates of the description."""
    own_mass, j = np.empty((user_model.size, user_model.size)), mujoco_state.jacobian
    mujoco.mj_fullM(user_model.model, mujoco_data, own_mass)
    return j.T @ own_mass @ j, j.T @ (mujoco_data.qfrc_smooth + constraint_forces - own_mass @ mujoco_state.bias)


def sliding_states(user_model: TwinModel, states: Sequence[State]) -> list[State]:
    """The given states at which every joint with dry friction slides, so that its full friction acts in every build.

    MuJoCo's is a soft constraint, whose force is less where a joint sticks.
    """
    if not user_model.driven.frictions:
        return list(states)
    data = mujoco.MjData(user_model.model)

    def slides(q: np.ndarray, v: np.ndarray) -> bool:
        forward_state(user_model, data, q, v)
        of = data.efc_type == mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF
        whole = np.abs(data.efc_force[of]) >= WHOLE_FRICTION_SHARE * data.efc_frictionloss[of]
        against = data.efc_force[of] * v[data.efc_id[of]] < 0.0
        return bool((whole & against).all())

    return [(q, v) for q, v in moving_friction_states(user_model, states) if slides(q, v)]


def moving_friction_states(user_model: TwinModel, states: Sequence[State]) -> list[State]:
    """The given states at which every joint with dry friction moves fast enough for Coulomb's law."""
    rubbing = [friction.coordinate for friction in user_model.driven.frictions]
    return [(q, v) for q, v in states if (np.abs(v[rubbing]) >= FULL_FRICTION_SPEED).all()]
