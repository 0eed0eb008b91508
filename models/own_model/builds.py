"""One model in every build: mass matrix and forces at a state, in the coordinates of the description."""

from collections.abc import Callable
from typing import Any, NamedTuple

import mujoco
import numpy as np

from models.engines.free_vehicle import ENGINES, free_model
from models.multibody.plain.joint_elements import PlainTree
from models.own_model.reading import TwinModel, controls

PLAIN = "plain"
BUILDS = (*ENGINES, PLAIN)


class Moved(NamedTuple):
    """At one state: mass matrix (n, n), forces (n,), accelerations (n,)."""

    mass: np.ndarray
    force: np.ndarray
    acceleration: np.ndarray


Equations = Callable[[np.ndarray, np.ndarray], Moved]
"""Of coordinates and rates (n,)."""


def equations(twin: TwinModel, build: str) -> Equations:
    """The description in "exudyn", "mujoco" or "plain"."""
    built: Any = plain_tree(twin) if build == PLAIN else free_model(build, twin.driven)
    mass_and_force = built.mass_and_force

    def move(q: np.ndarray, v: np.ndarray) -> Moved:
        mass, force = mass_and_force(0.0, q, v)
        return Moved(mass, force, np.linalg.solve(mass, force))

    return move


def plain_tree(twin: TwinModel) -> PlainTree:
    """The plain equations of the description."""
    loads = [(spring.body, spring.point, spring.load) for spring in twin.driven.ground_springs]
    lines = [(line.ends, line.stiffness, line.damping, line.length) for line in twin.driven.line_springs]
    return PlainTree(twin.driven.vehicle, twin.driven.gravity, loads, lines)


def as_parsed(twin: TwinModel) -> Equations:
    """The file's own model as MuJoCo parsed it."""
    model, data, coordinates = twin.model, mujoco.MjData(twin.model), twin.coordinates
    data.ctrl[:] = controls(model)

    def move(q: np.ndarray, v: np.ndarray) -> Moved:
        state = coordinates.to_mujoco(q, v)
        data.qpos[:], data.qvel[:], data.time = state.qpos, state.qvel, 0.0
        mujoco.mj_forward(model, data)
        own_mass, j = np.empty((twin.size, twin.size)), state.jacobian
        mujoco.mj_fullM(model, data, own_mass)
        mass = j.T @ own_mass @ j
        force = j.T @ (data.qfrc_smooth + data.qfrc_constraint - own_mass @ state.rest)
        return Moved(mass, force, np.linalg.solve(j, data.qacc - state.rest))

    return move
