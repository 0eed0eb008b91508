"""Motion over time of all builds of a model, with the same integration method (classical Runge-Kutta) and step, from
the same state.

Builds have the same coordinates, so they agree to rounding as long as the motion does not magnify it: a disturbance of
1e-14 tells how long. The file's own model has quaternions where something turns without limit: there one step of the
same tableau is another approximation of the same motion, and its distance is of the order of the step's error.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import mujoco
import numpy as np
from scipy.integrate import simpson

from models.core.errors import InputError, RunFailed
from models.engines.free_vehicle import ENGINES, FreeModel, PlainModel, free_model
from models.engines.mujoco import INTEGRATORS
from models.engines.mujoco_march import march
from models.multibody.plain.joint_elements import PlainTree
from models.own_model.builds import PLAIN_BUILD, SOFT_BUILD, State, equations_of_build, plain_tree, sliding_states
from models.own_model.content import limits_switched_off
from models.own_model.control_table import ControlTable, PathSection, constant_sections
from models.own_model.elements import two_digit_text
from models.own_model.limits import limits_struck
from models.own_model.reading import TwinModel, constant_controls
from models.own_model.states import random_states

PATH_DURATION = 1.0
"""Duration (s) of a path."""
EQUAL_PATH_SHARE, DISTURBANCE = 1e-10, 1e-14
"""Relative distance up to which paths count as equal, and the disturbance of the start whose effect must stay below
it."""
LARGEST_STEP_COUNT = 100_000
"""Largest step count of a path: the plain equations take about a minute for it."""
LARGEST_STATE = 1e6
"""Size (m, rad, m/s, rad/s) of a coordinate or rate beyond which a motion has diverged."""
FILE_BUILD_NAME = "the file's own model"
PATH_SHARES = (1.0 / 16.0, 1.0 / 4.0, 1.0)
"""Shares of a path after which integration pauses to check whether the comparison must stop."""
START_COUNT = 20
"""Count of random states from which the start of a path is chosen."""


@dataclass(frozen=True)
class PathReport:
    """Comparison of the paths of all builds over time.

    step : s; comparison_horizon : time (s) until which a disturbance of 1e-14 stays below 1e-10; distances : relative
    distance of each other build from the first up to there; failed : what stopped a build; has_quaternions : whether
    the file's model has them; energy : what the balance of kinetic energy and work leaves, as a share of the largest
    kinetic energy; has_soft_constraints : whether MuJoCo has soft constraints, or dry friction that sticks at the
    start, so that its path differs and the file's is compared with it; has_dry_friction : if so, paths are compared as
    long as it slides; struck_limit : name of the joint or tendon whose limit, which is not built, ends the comparison,
    "" if none does; controls : name of their file, "" where they are constant.
    """

    step: float
    comparison_horizon: float
    distances: dict[str, float]
    failed: dict[str, str]
    has_quaternions: bool
    energy: float | None
    has_soft_constraints: bool = False
    has_dry_friction: bool = False
    struck_limit: str = ""
    controls: str = ""

    @property
    def alike(self) -> bool:
        """Whether all builds have the same path; the path of MuJoCo's model of the file counts only if it has the same
        coordinates."""
        others = {FILE_BUILD_NAME: self.has_quaternions, SOFT_BUILD: self.has_soft_constraints}
        held = [size for name, size in self.distances.items() if not others.get(name)]
        return bool(held) and max(held) <= EQUAL_PATH_SHARE

    def lines(self) -> list[str]:
        """Lines of text for the terminal."""
        under = f", under {self.controls}" if self.controls else ""
        rows = [
            f"path over {PATH_DURATION:g} s by Runge-Kutta 4 with steps of {self.step:g} s, from a random state{under}:"
        ]
        rows += [f"  {name} stopped: {why}" for name, why in self.failed.items()]
        if self.struck_limit:
            rows.append(
                f"  compared up to {self.comparison_horizon:.3g} s, where {self.struck_limit} strikes its limit, "
                "which is not built"
            )
        elif not self.comparison_horizon:
            rows.append("  not compared: this step is too long for the motion; give the file a shorter one")
        elif self.comparison_horizon < PATH_DURATION:
            rows.append(
                f"  compared up to {self.comparison_horizon:.3g} s, where a disturbance of {DISTURBANCE:g} "
                f"reaches {EQUAL_PATH_SHARE:g}"
                f"{', or dry friction sticks' if self.has_dry_friction else ''}"
            )
        for name, size in self.distances.items():
            turned = (
                " (quaternions: distance of the step's error)"
                if name == FILE_BUILD_NAME and self.has_quaternions
                else ""
            )
            soft = f"soft constraints{' and dry friction that sticks' if self.has_dry_friction else ''} give way"
            given = f" ({soft})" if name == SOFT_BUILD and self.has_soft_constraints else ""
            first = SOFT_BUILD if name == FILE_BUILD_NAME and self.has_soft_constraints else ENGINES[0]
            rows.append(f"  {name} from {first}: {two_digit_text(size)}{turned}{given}")
        if self.energy is not None:
            rows.append(
                f"  kinetic energy less work of all forces: {two_digit_text(self.energy)} of the largest kinetic energy"
            )
        return rows


def step_count_of_path(user_model: TwinModel) -> int:
    """Number of steps of a path at the step of the file. Raises InputError if there are too many."""
    step = float(user_model.model.opt.timestep)
    if PATH_DURATION / step > LARGEST_STEP_COUNT:
        allowed = (
            f"paths over {PATH_DURATION:g} s would take {PATH_DURATION / step:,.0f} steps, of "
            f"{LARGEST_STEP_COUNT:,} at the most: leave "
            "them out with `--no-paths`, or give the file a longer step"
        )
        raise InputError(user_model.name, "option timestep", step, allowed)
    return int(np.ceil(PATH_DURATION / step - 1e-9))


def compare_paths(
    user_model: TwinModel,
    time_step: float | None = None,
    control_table: ControlTable | None = None,
    report_progress: Callable[[float], object] = lambda share: None,
) -> PathReport:
    """Comparison of the paths of all builds over 1 s. time_step (s) : that of the file if None; control_table :
    controls are constant without it; report_progress : receives the share that is done. Raises InputError for too many
    steps."""
    steps = int(np.ceil(PATH_DURATION / time_step - 1e-9)) if time_step else step_count_of_path(user_model)
    time_step, start = PATH_DURATION / steps, start_of_path(user_model)
    legs = (
        control_table.path_sections(user_model, steps, time_step)
        if control_table
        else constant_sections(user_model, steps)
    )
    built, failed, under = dict[str, np.ndarray](), dict[str, str](), control_table.path.name if control_table else ""
    _march_build(ENGINES[0], lambda: _path_until_stopped(user_model, legs, start, time_step), built, failed)
    report_progress(1 / 4)
    first = built.pop(ENGINES[0], None)
    if first is None:
        _march_others(user_model, legs, start, time_step, built, failed)
        return PathReport(time_step, 0.0, {}, failed, bool(user_model.coordinates.turnings), None, controls=under)
    rows, struck = _rows_before_stop(user_model, legs, first)
    soft, legs = user_model.driven.tied or not sliding_states(user_model, [start]), _sections_between(legs, 0, rows - 1)
    calm_rows = _rows_undisturbed(legs, PLAIN_BUILD if soft else ENGINES[0], start, time_step)
    report_progress(1 / 2)
    rows, struck = min(rows, calm_rows), struck if rows <= calm_rows else ""
    first, legs = first[:rows], _sections_between(legs, 0, rows - 1)
    _march_others(user_model, legs, start, time_step, built, failed)
    base = {FILE_BUILD_NAME: built.get(SOFT_BUILD, first)} if soft else {}
    distances = {
        name: _relative_distance(user_model, name, base.get(name, first), path) for name, path in built.items()
    }
    energy = _energy_imbalance(legs, first, time_step)
    kinds = bool(user_model.coordinates.turnings), energy, soft, bool(user_model.driven.frictions), struck, under
    return PathReport(time_step, (rows - 1) * time_step, distances, failed, *kinds)


def _march_others(
    user_model: TwinModel,
    path_sections: Sequence[PathSection],
    start_state: State,
    time_step: float,
    built_paths: dict[str, np.ndarray],
    failure_reasons: dict[str, str],
) -> None:
    """Store the paths of all builds but the first, and of MuJoCo's model of the file."""
    for build in (*ENGINES[1:], PLAIN_BUILD):
        _march_build(
            build, partial(path_of_build, path_sections, build, start_state, time_step), built_paths, failure_reasons
        )
    held = np.concatenate([np.tile(leg.controls, (leg.step_count, 1)) for leg in path_sections])
    _march_build(
        FILE_BUILD_NAME,
        lambda: file_path(user_model, start_state, (len(held), time_step), controls=held),
        built_paths,
        failure_reasons,
    )


def _path_until_stopped(
    user_model: TwinModel, path_sections: Sequence[PathSection], start_state: State, time_step: float
) -> np.ndarray:
    """The path of the first build; with constant controls in a few pieces, up to the piece in which the comparison must
    stop."""
    steps, path = sum(leg.step_count for leg in path_sections), np.concatenate(start_state)[None]
    for share in PATH_SHARES if len(path_sections) == 1 else (1.0,):
        q, v = np.split(path[-1], 2)
        piece = _sections_between(path_sections, len(path) - 1, int(np.ceil(share * steps)))
        path = np.concatenate((path, path_of_build(piece, ENGINES[0], (q, v), time_step)[1:]))
        if has_diverged(path) or _rows_before_stop(user_model, path_sections, path)[0] < len(path):
            break
    return path


def _rows_before_stop(
    user_model: TwinModel, path_sections: Sequence[PathSection], path_states: np.ndarray
) -> tuple[int, str]:
    """Number of states of a path before dry friction sticks or a limit is reached, and the name of the joint with this
    limit."""
    return _unlimited_rows(user_model, path_states[: _sliding_rows(path_sections, path_states)])


def _sections_between(path_sections: Sequence[PathSection], first_step: int, last_step: int) -> list[PathSection]:
    """The sections of a path from one step to another."""
    sections, done = list[PathSection](), 0
    for leg in path_sections:
        steps = min(last_step, done + leg.step_count) - max(first_step, done)
        sections += [leg._replace(step_count=steps)] if steps > 0 else []
        done += leg.step_count
    return sections


def _rows_undisturbed(
    path_sections: Sequence[PathSection], build_name: str, start_state: State, time_step: float
) -> int:
    """Number of states of a build's path before a small disturbance of its start makes a difference."""
    steps, (q, v) = sum(leg.step_count for leg in path_sections), start_state
    try:
        with np.errstate(all="ignore"):  # what blows up differs
            path, disturbed = (
                path_of_build(path_sections, build_name, (q + change, v), time_step) for change in (0.0, DISTURBANCE)
            )
    except RunFailed:
        return 2
    return count_of_equal_states(path, disturbed, steps)


def start_of_path(user_model: TwinModel) -> tuple[np.ndarray, np.ndarray]:
    """The first random state at which no limit acts and all dry friction slides; if there is none, the first random
    state."""
    struck = limits_struck(user_model) if limits_switched_off(user_model.model) else lambda q: ()
    first, *more = [
        *zip(*random_states(user_model, 1), strict=True),
        *zip(*random_states(user_model, START_COUNT), strict=True),
    ]
    good = (state for state in (first, *more) if not struck(state[0]) and sliding_states(user_model, [state]))
    return next(good, first)


def _march_build(
    build_name: str,
    march_path: Callable[[], np.ndarray],
    built_paths: dict[str, np.ndarray],
    failure_reasons: dict[str, str],
) -> None:
    """Store the path of a build, or the reason why it failed."""
    try:
        with np.errstate(all="ignore"):  # what blows up is told
            path = march_path()
    except RunFailed as error:
        failure_reasons[build_name] = error.reason
        return
    if has_diverged(path):
        failure_reasons[build_name] = "the motion blows up at this step"
    else:
        built_paths[build_name] = path


def has_diverged(path_states: np.ndarray) -> bool:
    """Whether the path contains numbers that are infinite, NaN or absurdly large."""
    return not (np.isfinite(path_states).all() and np.abs(path_states).max() < LARGEST_STATE)


def path_of_build(
    path_sections: Sequence[PathSection], build_name: str, start_state: tuple[np.ndarray, np.ndarray], time_step: float
) -> np.ndarray:
    """States (steps + 1, 2 n) of a build, integrated from coordinates and rates (n,) section by section, with
    ``time_step`` seconds per step."""
    path = np.concatenate(start_state)[None]
    for leg in path_sections:
        q, v = np.split(path[-1], 2)
        path = np.concatenate((path, _model_of_build(leg.twin, build_name).march(q, v, leg.step_count, time_step)[1:]))
    return path


def _model_of_build(user_model: TwinModel, build_name: str) -> FreeModel:
    if user_model.driven.tied and build_name != SOFT_BUILD:
        move = equations_of_build(user_model, build_name)
        return PlainModel(build_name, lambda time, q, v: move(q, v).acceleration, user_model.size)
    if build_name != PLAIN_BUILD:
        return free_model(build_name, user_model.driven)
    return PlainModel(PLAIN_BUILD, plain_tree(user_model).acceleration, user_model.size)


def file_path(
    user_model: TwinModel,
    start_state: tuple[np.ndarray, np.ndarray],
    step_count_and_step: tuple[int, float],
    integrator: str = "RK4",
    controls: np.ndarray | None = None,
) -> np.ndarray:
    """MuJoCo's own states (steps + 1, nq + n) of the file's model from coordinates and rates (n,), over the number and
    size of steps in ``step_count_and_step``; controls : controls (steps, nu), constant if not given. Actuators that
    were left out keep their states, which move nothing."""
    (steps, step), model, data = step_count_and_step, user_model.model, mujoco.MjData(user_model.model)
    before = model.opt.timestep, model.opt.integrator
    model.opt.timestep, model.opt.integrator = step, INTEGRATORS[integrator]
    state, size = user_model.coordinates.to_mujoco(*start_state), model.nq + model.nv
    idle = np.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS) - 1 - size)
    controls = np.tile(constant_controls(model), (steps, 1)) if controls is None else controls
    try:
        return march(model, data, np.concatenate((state.qpos, state.qvel, idle)), controls)[:, :size]
    finally:
        model.opt.timestep, model.opt.integrator = before


def count_of_equal_states(undisturbed_path: np.ndarray, disturbed_path: np.ndarray, step_count: int) -> int:
    """Number of states before a small disturbance grows so much that the two paths count as different."""
    size = np.maximum.accumulate(np.abs(undisturbed_path).max(axis=1))
    grown = np.flatnonzero(
        ~(np.abs(disturbed_path - undisturbed_path).max(axis=1) <= EQUAL_PATH_SHARE * np.maximum(size, 1.0))
    )
    return max(2, int(grown[0])) if len(grown) else step_count + 1


def _sliding_rows(path_sections: Sequence[PathSection], path_states: np.ndarray) -> int:
    """Number of states of a path before dry friction sticks in MuJoCo, minus one, since the step before may already be
    affected."""
    acting = (leg.twin for leg in path_sections for _ in range(leg.step_count))
    for i, (twin, row) in enumerate(zip(acting, path_states, strict=False)):
        q, v = np.split(row, 2)
        if twin.driven.frictions and not sliding_states(twin, [(q, v)]):
            return max(2, i - 1)
    return len(path_states)


def _unlimited_rows(user_model: TwinModel, path_states: np.ndarray) -> tuple[int, str]:
    """Number of states of a path before it reaches a joint limit, minus one, since the step before may already be
    affected; and the joint's name."""
    struck = limits_struck(user_model) if limits_switched_off(user_model.model) else lambda q: ()
    for i, row in enumerate(path_states):
        if names := struck(row[: user_model.size]):
            return max(2, i - 1), names[0]
    return len(path_states), ""


def _relative_distance(
    user_model: TwinModel, build_name: str, first_path: np.ndarray, compared_path: np.ndarray
) -> float:
    if build_name == FILE_BUILD_NAME:
        n = user_model.size
        states = [user_model.coordinates.to_mujoco(row[:n], row[n:]) for row in first_path]
        first_path = np.array([np.concatenate((state.qpos, state.qvel)) for state in states])
        for turning in user_model.coordinates.turnings:  # a quaternion and its opposite are the same
            at = slice(turning.quaternion_index, turning.quaternion_index + 4)
            compared_path = compared_path.copy()
            compared_path[:, at] *= np.sign(np.einsum("tk,tk->t", compared_path[:, at], first_path[:, at]))[:, None]
    return float(np.abs(compared_path - first_path).max() / max(1.0, np.abs(first_path).max()))


def _energy_imbalance(path_sections: Sequence[PathSection], path_states: np.ndarray, time_step: float) -> float | None:
    """Change of kinetic energy less the work of all forces (Simpson's rule), relative to the largest kinetic energy;
    None for fewer than three states."""
    if len(path_states) < 3:
        return None
    kinetic, work, first = list[float](), 0.0, 0
    for leg in path_sections:
        plain, states = plain_tree(leg.twin), path_states[first : first + leg.step_count + 1]
        energies, powers = zip(*(_energy_and_power(plain, *np.split(row, 2)) for row in states), strict=True)
        kinetic, work, first = (
            [*kinetic, *energies],
            work + float(simpson(powers, dx=time_step)),
            first + leg.step_count,
        )
        if first >= len(path_states) - 1:
            break
    return float(abs(kinetic[-1] - kinetic[0] - work) / max(*kinetic, 1e-12))


def _energy_and_power(tree_equations: PlainTree, q: np.ndarray, v: np.ndarray) -> tuple[float, float]:
    """Kinetic energy (J), and power of all forces (W)."""
    mass, _ = tree_equations.mass_and_force(0.0, q, v)
    return 0.5 * float(v @ mass @ v), float(v @ tree_equations.applied_forces(q, v))
