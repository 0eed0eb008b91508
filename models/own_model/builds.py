"""One model in every build: mass matrix and forces at a state, in the coordinates of the description."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np

from models.engines.free_vehicle import ENGINES, free_model
from models.engines.native_parts import SLIDES
from models.multibody.plain.joint_elements import PlainTree
from models.own_model.coordinates import MujocoState
from models.own_model.reading import TwinModel, controls, tie_rows

PLAIN = "plain"
BUILDS = (*ENGINES, PLAIN)
SOFT = "mujoco"
"""The build whose couplings are soft, as the file's own; those of the others are rigid."""


class Moved(NamedTuple):
    """At one state: mass matrix (n, n), forces (n,), accelerations (n,)."""

    mass: np.ndarray
    force: np.ndarray
    acceleration: np.ndarray


State = tuple[np.ndarray, np.ndarray]
"""Coordinates and rates (n,)."""
WHOLE = 1.0 - 1e-12
"""Share of a dry friction's force from which it is whole."""
Equations = Callable[[np.ndarray, np.ndarray], Moved]
"""Of coordinates and rates (n,)."""


def equations(twin: TwinModel, build: str) -> Equations:
    """The description in "exudyn", "mujoco" or "plain"; couplings are rigid but in MuJoCo."""
    built: Any = plain_tree(twin) if build == PLAIN else free_model(build, twin.driven)
    rows, _ = tie_rows(twin.driven.couplings, twin.size)
    rigid, by_engine = bool(len(rows)) and build != SOFT, build != PLAIN

    def move(q: np.ndarray, v: np.ndarray) -> Moved:
        mass, force = built.mass_and_force(0.0, q, v)
        if rigid:
            force = _tied(mass, force, built.ties(q, v) if by_engine else rows)
        return Moved(mass, force, np.linalg.solve(mass, force))

    return move


def _tied(mass: np.ndarray, force: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Forces (n,) with those of rigid constraints whose derivatives by the coordinates are constant rows (c, n)."""
    free, compliance = np.linalg.solve(mass, force), np.linalg.solve(mass, rows.T)
    tied: np.ndarray = force - rows.T @ np.linalg.solve(rows @ compliance, rows @ free)
    return tied


def plain_tree(twin: TwinModel) -> PlainTree:
    """The plain equations of the description."""
    loads = [(spring.body, spring.point, spring.load) for spring in twin.driven.ground_springs]
    lines = [(line.ends, line.stiffness, line.damping, line.length) for line in twin.driven.line_springs]
    frictions = [(friction.coordinate, friction.force, SLIDES) for friction in twin.driven.frictions]
    return PlainTree(twin.driven.vehicle, twin.driven.gravity, loads, lines, frictions)


def expected(twin: TwinModel, build: str) -> Equations:
    """What a build must do: the file's own model, with rigid couplings unless the build is MuJoCo's."""
    return as_parsed(twin) if build == SOFT or not twin.driven.couplings else rigid(twin)


def as_parsed(twin: TwinModel) -> Equations:
    """The file's own model as MuJoCo parsed it."""
    data = mujoco.MjData(twin.model)

    def move(q: np.ndarray, v: np.ndarray) -> Moved:
        state = forward(twin, data, q, v)
        mass, force = _of_file(twin, data, state, data.qfrc_constraint)
        return Moved(mass, force, np.linalg.solve(state.jacobian, data.qacc - state.rest))

    return move


def rigid(twin: TwinModel) -> Equations:
    """The file's own model as MuJoCo parsed it, its equality constraints made rigid."""
    data = mujoco.MjData(twin.model)

    def move(q: np.ndarray, v: np.ndarray) -> Moved:
        state = forward(twin, data, q, v)
        ties = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
        others, rows = np.empty(twin.size), np.empty((twin.size, data.nefc))
        mujoco.mj_mulJacTVec(twin.model, data, others, np.where(ties, 0.0, data.efc_force))
        for row, unit in zip(rows, np.eye(twin.size), strict=True):
            mujoco.mj_mulJacVec(twin.model, data, row, unit)
        mass, force = _of_file(twin, data, state, others)
        force = _tied(mass, force, rows.T[ties] @ state.jacobian)
        return Moved(mass, force, np.linalg.solve(mass, force))

    return move


def forward(twin: TwinModel, data: mujoco.MjData, q: np.ndarray, v: np.ndarray) -> MujocoState:
    """MuJoCo's state at coordinates and rates (n,), and data of the file's own model there."""
    state = twin.coordinates.to_mujoco(q, v)
    data.ctrl[:] = controls(twin.model)
    data.qpos[:], data.qvel[:], data.time = state.qpos, state.qvel, 0.0
    mujoco.mj_forward(twin.model, data)
    return state


def _of_file(
    twin: TwinModel, data: mujoco.MjData, state: MujocoState, constraint: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Mass matrix (n, n) and forces (n,) of the file's own model in the coordinates of the description."""
    own_mass, j = np.empty((twin.size, twin.size)), state.jacobian
    mujoco.mj_fullM(twin.model, data, own_mass)
    return j.T @ own_mass @ j, j.T @ (data.qfrc_smooth + constraint - own_mass @ state.rest)


def sliding(twin: TwinModel, states: Sequence[State]) -> list[State]:
    """The states at which every joint with dry friction slides: there it has its whole force in every build.

    MuJoCo's is a soft constraint, whose force is less where a joint sticks.
    """
    rubbing = [friction.coordinate for friction in twin.driven.frictions]
    if not rubbing:
        return list(states)
    data = mujoco.MjData(twin.model)

    def slides(q: np.ndarray, v: np.ndarray) -> bool:
        forward(twin, data, q, v)
        of = data.efc_type == mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF
        whole = np.abs(data.efc_force[of]) >= WHOLE * data.efc_frictionloss[of]
        against = data.efc_force[of] * v[data.efc_id[of]] < 0.0
        return bool((whole & against).all() and (np.abs(v[rubbing]) >= SLIDES).all())

    return [(q, v) for q, v in states if slides(q, v)]
