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
from models.engines.free_vehicle import ENGINES, FreeModel, Plain, free_model
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


def step_count_of_path(twin: TwinModel) -> int:
    """Number of steps of a path at the step of the file. Raises InputError if there are too many."""
    step = float(twin.model.opt.timestep)
    if PATH_DURATION / step > LARGEST_STEP_COUNT:
        allowed = (
            f"paths over {PATH_DURATION:g} s would take {PATH_DURATION / step:,.0f} steps, of "
            f"{LARGEST_STEP_COUNT:,} at the most: leave "
            "them out with `--no-paths`, or give the file a longer step"
        )
        raise InputError(twin.name, "option timestep", step, allowed)
    return int(np.ceil(PATH_DURATION / step - 1e-9))


def compare_paths(
    twin: TwinModel,
    step: float | None = None,
    table: ControlTable | None = None,
    report_progress: Callable[[float], object] = lambda share: None,
) -> PathReport:
    """Comparison of the paths of all builds over 1 s. step (s) : that of the file if None; table : of controls, which
    are constant without it; report_progress : receives the share that is done. Raises InputError for too many steps."""
    steps = int(np.ceil(PATH_DURATION / step - 1e-9)) if step else step_count_of_path(twin)
    step, start = PATH_DURATION / steps, start_of_path(twin)
    legs = table.path_sections(twin, steps, step) if table else constant_sections(twin, steps)
    built, failed, under = dict[str, np.ndarray](), dict[str, str](), table.path.name if table else ""
    _march_build(ENGINES[0], lambda: _path_until_stopped(twin, legs, start, step), built, failed)
    report_progress(1 / 4)
    first = built.pop(ENGINES[0], None)
    if first is None:
        _march_others(twin, legs, start, step, built, failed)
        return PathReport(step, 0.0, {}, failed, bool(twin.coordinates.turnings), None, controls=under)
    rows, struck = _rows_before_stop(twin, legs, first)
    soft, legs = twin.driven.tied or not sliding_states(twin, [start]), _sections_between(legs, 0, rows - 1)
    calm_rows = _rows_undisturbed(legs, PLAIN_BUILD if soft else ENGINES[0], start, step)
    report_progress(1 / 2)
    rows, struck = min(rows, calm_rows), struck if rows <= calm_rows else ""
    first, legs = first[:rows], _sections_between(legs, 0, rows - 1)
    _march_others(twin, legs, start, step, built, failed)
    base = {FILE_BUILD_NAME: built.get(SOFT_BUILD, first)} if soft else {}
    distances = {name: _relative_distance(twin, name, base.get(name, first), path) for name, path in built.items()}
    energy = _energy_imbalance(legs, first, step)
    kinds = bool(twin.coordinates.turnings), energy, soft, bool(twin.driven.frictions), struck, under
    return PathReport(step, (rows - 1) * step, distances, failed, *kinds)


def _march_others(
    twin: TwinModel,
    sections: Sequence[PathSection],
    start: State,
    step: float,
    built: dict[str, np.ndarray],
    failed: dict[str, str],
) -> None:
    """Store the paths of all builds but the first, and of MuJoCo's model of the file."""
    for build in (*ENGINES[1:], PLAIN_BUILD):
        _march_build(build, partial(path_of_build, sections, build, start, step), built, failed)
    held = np.concatenate([np.tile(leg.controls, (leg.step_count, 1)) for leg in sections])
    _march_build(FILE_BUILD_NAME, lambda: file_path(twin, start, (len(held), step), controls=held), built, failed)


def _path_until_stopped(twin: TwinModel, sections: Sequence[PathSection], start: State, step: float) -> np.ndarray:
    """The path of the first build; with constant controls in a few pieces, up to the piece in which the comparison must
    stop."""
    steps, path = sum(leg.step_count for leg in sections), np.concatenate(start)[None]
    for share in PATH_SHARES if len(sections) == 1 else (1.0,):
        q, v = np.split(path[-1], 2)
        piece = _sections_between(sections, len(path) - 1, int(np.ceil(share * steps)))
        path = np.concatenate((path, path_of_build(piece, ENGINES[0], (q, v), step)[1:]))
        if has_diverged(path) or _rows_before_stop(twin, sections, path)[0] < len(path):
            break
    return path


def _rows_before_stop(twin: TwinModel, sections: Sequence[PathSection], path: np.ndarray) -> tuple[int, str]:
    """Number of states of a path before dry friction sticks or a limit is reached, and the name of the joint with this
    limit."""
    return _unlimited_rows(twin, path[: _sliding_rows(sections, path)])


def _sections_between(path_sections: Sequence[PathSection], first_step: int, last_step: int) -> list[PathSection]:
    """The sections of a path from one step to another."""
    sections, done = list[PathSection](), 0
    for leg in path_sections:
        steps = min(last_step, done + leg.step_count) - max(first_step, done)
        sections += [leg._replace(step_count=steps)] if steps > 0 else []
        done += leg.step_count
    return sections


def _rows_undisturbed(sections: Sequence[PathSection], build: str, start: State, step: float) -> int:
    """Number of states of a build's path before a small disturbance of its start makes a difference."""
    steps, (q, v) = sum(leg.step_count for leg in sections), start
    try:
        with np.errstate(all="ignore"):  # what blows up differs
            path, disturbed = (path_of_build(sections, build, (q + change, v), step) for change in (0.0, DISTURBANCE))
    except RunFailed:
        return 2
    return count_of_equal_states(path, disturbed, steps)


def start_of_path(twin: TwinModel) -> tuple[np.ndarray, np.ndarray]:
    """The first random state at which no limit acts and all dry friction slides; if there is none, the first random
    state."""
    struck = limits_struck(twin) if limits_switched_off(twin.model) else lambda q: ()
    first, *more = [*zip(*random_states(twin, 1), strict=True), *zip(*random_states(twin, START_COUNT), strict=True)]
    good = (state for state in (first, *more) if not struck(state[0]) and sliding_states(twin, [state]))
    return next(good, first)


def _march_build(
    name: str, march_path: Callable[[], np.ndarray], built: dict[str, np.ndarray], failed: dict[str, str]
) -> None:
    """Store the path of a build, or the reason why it failed."""
    try:
        with np.errstate(all="ignore"):  # what blows up is told
            path = march_path()
    except RunFailed as error:
        failed[name] = error.reason
        return
    if has_diverged(path):
        failed[name] = "the motion blows up at this step"
    else:
        built[name] = path


def has_diverged(path: np.ndarray) -> bool:
    """Whether the path contains numbers that are infinite, NaN or absurdly large."""
    return not (np.isfinite(path).all() and np.abs(path).max() < LARGEST_STATE)


def path_of_build(
    sections: Sequence[PathSection], build: str, start: tuple[np.ndarray, np.ndarray], step: float
) -> np.ndarray:
    """States (steps + 1, 2 n) of a build, integrated from coordinates and rates (n,) section by section, with ``step``
    seconds per step."""
    path = np.concatenate(start)[None]
    for leg in sections:
        q, v = np.split(path[-1], 2)
        path = np.concatenate((path, _model_of_build(leg.twin, build).march(q, v, leg.step_count, step)[1:]))
    return path


def _model_of_build(twin: TwinModel, build: str) -> FreeModel:
    if twin.driven.tied and build != SOFT_BUILD:
        move = equations_of_build(twin, build)
        return Plain(build, lambda time, q, v: move(q, v).acceleration, twin.size)
    if build != PLAIN_BUILD:
        return free_model(build, twin.driven)
    return Plain(PLAIN_BUILD, plain_tree(twin).acceleration, twin.size)


def file_path(
    twin: TwinModel,
    start: tuple[np.ndarray, np.ndarray],
    grid: tuple[int, float],
    integrator: str = "RK4",
    controls: np.ndarray | None = None,
) -> np.ndarray:
    """MuJoCo's own states (steps + 1, nq + n) of the file's model from coordinates and rates (n,), over the number and
    size of steps in ``grid``; controls : controls (steps, nu), constant if not given. Actuators that were left out keep
    their states, which move nothing."""
    (steps, step), model, data = grid, twin.model, mujoco.MjData(twin.model)
    before = model.opt.timestep, model.opt.integrator
    model.opt.timestep, model.opt.integrator = step, INTEGRATORS[integrator]
    state, size = twin.coordinates.to_mujoco(*start), model.nq + model.nv
    idle = np.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS) - 1 - size)
    controls = np.tile(constant_controls(model), (steps, 1)) if controls is None else controls
    try:
        return march(model, data, np.concatenate((state.qpos, state.qvel, idle)), controls)[:, :size]
    finally:
        model.opt.timestep, model.opt.integrator = before


def count_of_equal_states(undisturbed: np.ndarray, disturbed: np.ndarray, step_count: int) -> int:
    """Number of states before a small disturbance grows so much that the two paths count as different."""
    size = np.maximum.accumulate(np.abs(undisturbed).max(axis=1))
    grown = np.flatnonzero(~(np.abs(disturbed - undisturbed).max(axis=1) <= EQUAL_PATH_SHARE * np.maximum(size, 1.0)))
    return max(2, int(grown[0])) if len(grown) else step_count + 1


def _sliding_rows(sections: Sequence[PathSection], path: np.ndarray) -> int:
    """Number of states of a path before dry friction sticks in MuJoCo, minus one, since the step before may already be
    affected."""
    acting = (leg.twin for leg in sections for _ in range(leg.step_count))
    for i, (twin, row) in enumerate(zip(acting, path, strict=False)):
        q, v = np.split(row, 2)
        if twin.driven.frictions and not sliding_states(twin, [(q, v)]):
            return max(2, i - 1)
    return len(path)


def _unlimited_rows(twin: TwinModel, path: np.ndarray) -> tuple[int, str]:
    """Number of states of a path before it reaches a joint limit, minus one, since the step before may already be
    affected; and the joint's name."""
    struck = limits_struck(twin) if limits_switched_off(twin.model) else lambda q: ()
    for i, row in enumerate(path):
        if names := struck(row[: twin.size]):
            return max(2, i - 1), names[0]
    return len(path), ""


def _relative_distance(twin: TwinModel, name: str, first: np.ndarray, path: np.ndarray) -> float:
    if name == FILE_BUILD_NAME:
        n = twin.size
        states = [twin.coordinates.to_mujoco(row[:n], row[n:]) for row in first]
        first = np.array([np.concatenate((state.qpos, state.qvel)) for state in states])
        for turning in twin.coordinates.turnings:  # a quaternion and its opposite are the same
            at = slice(turning.quaternion_index, turning.quaternion_index + 4)
            path = path.copy()
            path[:, at] *= np.sign(np.einsum("tk,tk->t", path[:, at], first[:, at]))[:, None]
    return float(np.abs(path - first).max() / max(1.0, np.abs(first).max()))


def _energy_imbalance(sections: Sequence[PathSection], path: np.ndarray, step: float) -> float | None:
    """Change of kinetic energy less the work of all forces (Simpson's rule), relative to the largest kinetic energy;
    None for fewer than three states."""
    if len(path) < 3:
        return None
    kinetic, work, first = list[float](), 0.0, 0
    for leg in sections:
        plain, states = plain_tree(leg.twin), path[first : first + leg.step_count + 1]
        energies, powers = zip(*(_energy_and_power(plain, *np.split(row, 2)) for row in states), strict=True)
        kinetic, work, first = [*kinetic, *energies], work + float(simpson(powers, dx=step)), first + leg.step_count
        if first >= len(path) - 1:
            break
    return float(abs(kinetic[-1] - kinetic[0] - work) / max(*kinetic, 1e-12))


def _energy_and_power(plain: PlainTree, q: np.ndarray, v: np.ndarray) -> tuple[float, float]:
    """Kinetic energy (J), and power of all forces (W)."""
    mass, _ = plain.mass_and_force(0.0, q, v)
    return 0.5 * float(v @ mass @ v), float(v @ plain.applied_forces(q, v))
