"""Effect of floating-point rounding on mass matrices, forces and accelerations, measured on the file's model in MuJoCo.

A computation in floating point is at best the exact answer for numbers that are changed by their rounding (backward
stability). So the model is computed again with every number of it, and the state, changed at random by a small share
of itself: lengths by this share of the model's reach, since places are sums of lengths, directions by this angle. The
change of an answer divided by the share, times the rounding of a number, is what rounding may make of that answer. Each
coordinate has its own: a light wheel that spins up fast says nothing about a heavy slide beside it, unless the mass
matrix couples them; a stiff constraint magnifies the rounding of places; weights that a joint bears leave rounding
where the acceleration is zero; three angles of a body mix as its axes turn. A badly conditioned mass matrix is in it.

Forces of a turning body that cancel on every axis, as those towards the axle of a pendulum without weight do, stay zero
whatever the numbers are, and leave rounding all the same: sizes of what is summed up are added
(``_with_summation_rounding``).

Solving for accelerations rounds once more, and the entries of the mass matrix independently of one another, which no
change of the model's numbers does: that is added (``_with_solver_rounding``). Up to 100 roundings of it were seen, on a
car.
"""

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import replace

import mujoco
import numpy as np

from models.own_model.builds import Equations, State, StateMotion, equations_of_file, forward_state
from models.own_model.coordinates import BALL_JOINT, FREE_JOINT
from models.own_model.equalities import joins_bodies
from models.own_model.names import moving_bodies
from models.own_model.reading import TwinModel

CHANGED_SHARE = 1e-9
"""Relative size of the random changes of numbers: far above rounding, and small enough for results to change in
proportion."""
RANDOM_CHANGES, SEED = 8, 27
"""Count of random changes, whose effects are averaged as root mean square because those of a single change may cancel;
seed of the random numbers."""
RELATIVE_NUMBERS = (
    *("body_mass", "body_inertia", "body_gravcomp", "jnt_stiffness", "dof_damping", "dof_armature"),
    *("dof_frictionloss", "tendon_stiffness", "tendon_damping", "tendon_armature", "tendon_lengthspring", "wrap_prm"),
    *("actuator_gainprm", "actuator_biasprm", "actuator_gear", "eq_solref", "eq_solimp", "qpos_spring"),
)
LENGTH_NUMBERS = ("body_pos", "body_ipos", "jnt_pos", "site_pos")
DIRECTION_NUMBERS = ("body_quat", "body_iquat", "site_quat", "jnt_axis")
"""Names of the numbers of a compiled model that are changed at random: by a share of themselves, by a share of the
model's reach (m), and as unit vectors."""
EquationsOfModel = Callable[[TwinModel], Equations]
"""Function from a model to its equations of motion: with soft constraints, or with rigid ones."""


def sensitivities(
    user_model: TwinModel, equations_of: EquationsOfModel, states: Sequence[State], motions: Sequence[StateMotion]
) -> list[StateMotion]:
    """Rounding sensitivities of mass (n, n), force (n,) and acceleration (n,) at each state: rms change per relative
    random change of all input numbers.

    equations_of, motions : the equations of MuJoCo's model of the file, and its motion at the states.
    """
    draw, reach = np.random.default_rng(SEED), reach_of(user_model)
    squares = [StateMotion(*map(np.zeros_like, each)) for each in motions]
    for _ in range(RANDOM_CHANGES):
        move = equations_of(replace(user_model, model=changed_model(user_model.model, draw, reach)))
        for square, exact, (q, v) in zip(squares, motions, states, strict=True):
            other = move(*_changed_state(user_model, draw, q, v))
            for total, there, here in zip(square, other, exact, strict=True):
                total += ((there - here) / CHANGED_SHARE) ** 2 / RANDOM_CHANGES
    by_numbers = [
        _with_solver_rounding(_with_summation_rounding(StateMotion(*map(np.sqrt, square)), exact, sums), exact)
        for square, exact, sums in zip(squares, motions, _sums_of_rates(user_model, states), strict=True)
    ]
    return (
        by_numbers
        if not user_model.driven.tied
        else list(map(_with_constraint_rounding, by_numbers, _unconstrained_motion(user_model, states)))
    )


def _with_summation_rounding(sensitivity: StateMotion, motion: StateMotion, force_sums: np.ndarray) -> StateMotion:
    """Rounding sensitivities, with the rounding of summing forces of the sizes (n,) ``force_sums`` added; these
    forces may cancel."""
    by_sums = np.abs(np.linalg.pinv(motion.mass)) @ force_sums
    return sensitivity._replace(force=sensitivity.force + force_sums, acceleration=sensitivity.acceleration + by_sums)


def _sums_of_rates(user_model: TwinModel, states: Sequence[State]) -> Iterator[np.ndarray]:
    """For each state, the sums (n,) over the bodies of the sizes of the velocity-dependent forces on each coordinate:
    mass times centripetal acceleration by lever, and gyroscopic moments."""
    model, data = user_model.model, mujoco.MjData(user_model.model)
    shifts, turns, shifting, turning = (np.empty((3, user_model.size)) for _ in range(4))
    for q, v in states:
        state, sums = forward_state(user_model, data, q, v), np.zeros(user_model.size)
        for b in moving_bodies(model):
            mujoco.mj_jacBodyCom(model, data, shifts, turns, b)
            mujoco.mj_jacDot(model, data, shifting, turning, data.xipos[b], b)
            axes = data.ximat[b].reshape(3, 3)
            inertia, rate = axes * model.body_inertia[b] @ axes.T, turns @ data.qvel
            gyroscopic = np.linalg.norm(rate) * np.linalg.norm(inertia @ rate)  # before an axis cancels it
            moment = np.linalg.norm(inertia @ (turning @ data.qvel)) + gyroscopic
            force = model.body_mass[b] * np.linalg.norm(shifting @ data.qvel)
            sums += force * np.linalg.norm(shifts, axis=0) + moment * np.linalg.norm(turns, axis=0)
        yield np.abs(state.jacobian).T @ sums


def _with_solver_rounding(sensitivity: StateMotion, motion: StateMotion) -> StateMotion:
    """Rounding sensitivities, with that of solving M a = f for the accelerations a added, where every entry of the mass
    matrix M is rounded.

    This is Skeel's componentwise condition, |M^-1| |M| |a| (Higham 2002, Accuracy and Stability of Numerical
    Algorithms, section 7.2; recalled). A light seat on a car takes its share of the rounding of wheels that spin up a
    million times as fast; a coordinate that the mass matrix does not couple with others takes none.
    """
    inverse = np.abs(np.linalg.pinv(motion.mass))
    solution = inverse @ np.abs(motion.mass) @ np.abs(motion.acceleration)
    return sensitivity._replace(acceleration=sensitivity.acceleration + solution)


def _unconstrained_motion(user_model: TwinModel, states: Sequence[State]) -> list[StateMotion]:
    """Motion of the file's model in MuJoCo at the states, without its equality constraints."""
    model = copy(user_model.model)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_EQUALITY)
    move = equations_of_file(replace(user_model, model=model))
    return [move(q, v) for q, v in states]


def _with_constraint_rounding(sensitivity: StateMotion, unconstrained_motion: StateMotion) -> StateMotion:
    """Rounding sensitivities, with the motion that constraints suppress added. Rounding errors of all other coordinates
    remain in a stopped coordinate, weighted with the root of inertia."""
    weight = np.sqrt(unconstrained_motion.mass.diagonal())
    taken = float((weight * np.abs(unconstrained_motion.acceleration)).max())
    return sensitivity._replace(
        force=sensitivity.force + taken * weight, acceleration=sensitivity.acceleration + taken / weight
    )


def reach_of(user_model: TwinModel) -> float:
    """Largest distance (m) of a body, a centre of mass or an anchor from the world's origin in the design position."""
    data = mujoco.MjData(user_model.model)
    forward_state(user_model, data, np.zeros(user_model.size), np.zeros(user_model.size))
    places = np.concatenate((data.xpos, data.xipos, data.xanchor, data.site_xpos))
    return float(np.linalg.norm(places, axis=1).max())


def changed_model(
    mujoco_model: mujoco.MjModel, random_generator: np.random.Generator, largest_distance: float
) -> mujoco.MjModel:
    """A copy of the model in which all numbers that affect motion are changed at random by a small relative amount."""
    mujoco_model = copy(mujoco_model)

    def unit(shape: tuple[int, ...]) -> np.ndarray:
        return CHANGED_SHARE * random_generator.uniform(-1.0, 1.0, shape)

    for name in RELATIVE_NUMBERS:
        numbers = getattr(mujoco_model, name)
        numbers *= 1.0 + unit(numbers.shape)
    for name in LENGTH_NUMBERS:
        numbers = getattr(mujoco_model, name)
        numbers += largest_distance * unit(numbers.shape)
    for name in DIRECTION_NUMBERS:
        numbers = getattr(mujoco_model, name)
        numbers += unit(numbers.shape)
        numbers /= np.linalg.norm(numbers, axis=-1, keepdims=True)
    mujoco_model.opt.gravity += np.linalg.norm(mujoco_model.opt.gravity) * unit((3,))
    for e, size in _equality_magnitudes(mujoco_model, largest_distance):
        mujoco_model.eq_data[e] += size * unit(size.shape)
    mujoco_model.body_sameframe[:] = mujoco_model.site_sameframe[:] = 0
    return mujoco_model


def _equality_magnitudes(mujoco_model: mujoco.MjModel, largest_distance: float) -> Iterator[tuple[int, np.ndarray]]:
    """For every equality constraint, its index and the magnitudes (k,) of its numbers: positions between bodies, else
    factors."""
    for e in range(mujoco_model.neq):
        size = np.abs(mujoco_model.eq_data[e])
        if joins_bodies(mujoco_model, e):
            size[:6] = np.maximum(size[:6], largest_distance)
            size[6:10] = 1.0
        yield e, size


def _changed_state(user_model: TwinModel, random_generator: np.random.Generator, q: np.ndarray, v: np.ndarray) -> State:
    """State changed at random by a small relative amount; coordinates are changed including the offset that the file
    gives them."""
    model, size = user_model.model, np.abs(q)
    for j in range(model.njnt):
        first, several = int(model.jnt_dofadr[j]), int(model.jnt_type[j] in (BALL_JOINT, FREE_JOINT))
        place, shifts = int(model.jnt_qposadr[j]), 3 if model.jnt_type[j] == FREE_JOINT else 0 if several else 1
        size[first : first + shifts] += np.abs(model.qpos0[place : place + shifts])
        size[first + shifts : first + shifts + 3 * several] += 1.0
    share = CHANGED_SHARE * random_generator.uniform(-1.0, 1.0, (2, user_model.size))
    return q + size * share[0], v * (1.0 + share[1])
