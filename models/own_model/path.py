"""Paths of all builds at the same tableau (classical Runge-Kutta) and step, from the same state.

Builds have the same coordinates, so they agree to rounding as long as the motion does not magnify it: a disturbance of
1e-14 tells how long. The file's own model has quaternions where something turns without limit: there one step of the
same tableau is another approximation of the same motion, and its distance is of the order of the step's error.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import mujoco
import numpy as np

from models.core.errors import RunFailed
from models.engines.free_vehicle import ENGINES, FreeModel, Plain, free_model
from models.engines.mujoco import INTEGRATORS
from models.engines.mujoco_march import march
from models.own_model.builds import PLAIN, SOFT, equations, plain_tree, sliding
from models.own_model.content import ranges
from models.own_model.limits import limits_struck
from models.own_model.reading import TwinModel, controls
from models.own_model.states import random_states

DURATION = 1.0
"""s"""
ALIKE, DISTURBED = 1e-10, 1e-14
"""Relative distance up to which paths are the same, and the disturbance that must stay below it."""
LARGEST = 1e6
"""m, rad, m/s, rad/s: what lies beyond has blown up."""
FILE = "the file's own model"


@dataclass(frozen=True)
class PathReport:
    """step (s); horizon : until when (s) a disturbance of 1e-14 stays below 1e-10; distances : of each other build from
    the first one up to there, relative; failed : what stopped a build; quaternions : whether the file's has them;
    energy : what the balance of kinetic energy and work leaves, as a share of the largest kinetic energy; soft :
    whether MuJoCo has soft constraints, so that its path is another one: from it the file's is counted then; rubbing :
    whether there is dry friction: paths are compared as long as it slides; struck : whose limit, which is not
    built, ends the comparison, empty if none's."""

    step: float
    horizon: float
    distances: dict[str, float]
    failed: dict[str, str]
    quaternions: bool
    energy: float | None
    soft: bool = False
    rubbing: bool = False
    struck: str = ""

    @property
    def alike(self) -> bool:
        """Whether the builds have the same path; the file's own model counts where it has the same coordinates."""
        others = {FILE: self.quaternions, SOFT: self.soft}
        held = [size for name, size in self.distances.items() if not others.get(name)]
        return bool(held) and max(held) <= ALIKE

    def lines(self) -> list[str]:
        """For the terminal."""
        rows = [f"path over {DURATION:g} s by Runge-Kutta 4 with steps of {self.step:g} s, from a random state:"]
        rows += [f"  {name} stopped: {why}" for name, why in self.failed.items()]
        if self.struck:
            rows.append(
                f"  compared up to {self.horizon:.3g} s, where {self.struck} strikes its limit, which is not built"
            )
        elif self.horizon < DURATION:
            rows.append(
                f"  compared up to {self.horizon:.3g} s, where a disturbance of {DISTURBED:g} reaches {ALIKE:g}"
                f"{', or dry friction sticks' if self.rubbing else ''}"
            )
        for name, size in self.distances.items():
            turned = " (quaternions: distance of the step's error)" if name == FILE and self.quaternions else ""
            given = " (soft constraints give way)" if name == SOFT and self.soft else ""
            first = SOFT if name == FILE and self.soft else ENGINES[0]
            rows.append(f"  {name} from {first}: {size:.1e}{turned}{given}")
        if self.energy is not None:
            rows.append(f"  kinetic energy less work of all forces: {self.energy:.1e} of the largest kinetic energy")
        return rows


def paths(twin: TwinModel, step: float | None = None) -> PathReport:
    """Paths over 1 s; step (s): the file's unless given."""
    step = DURATION / np.ceil(DURATION / (step or float(twin.model.opt.timestep)) - 1e-9)
    steps, (q,), (v,) = round(DURATION / step), *random_states(twin, 1)
    built, failed = dict[str, np.ndarray](), dict[str, str]()
    for build in (*ENGINES, PLAIN):
        _march(build, partial(_by_build, twin, build, (q, v), (steps, step)), built, failed)
    _march(FILE, lambda: file_path(twin, (q, v), (steps, step)), built, failed)
    first = built.pop(ENGINES[0], None)
    if first is None:
        return PathReport(step, 0.0, {}, failed, bool(twin.coordinates.turnings), None)
    soft = twin.driven.tied
    calm = PLAIN if soft and PLAIN in built else ENGINES[0]
    disturbed = _model(twin, calm).march(q + DISTURBED, v, steps, step)
    rows = _sliding_rows(twin, first[: _rows(built.get(calm, first), disturbed, steps)])
    rows, struck = _unlimited_rows(twin, first[:rows])
    base = {FILE: built.get(SOFT, first)} if soft else {}
    distances = {name: _distance(twin, name, base.get(name, first)[:rows], path[:rows]) for name, path in built.items()}
    energy = _ledger(twin, first[:rows], step)
    kinds = bool(twin.coordinates.turnings), energy, soft, bool(twin.driven.frictions), struck
    return PathReport(step, (rows - 1) * step, distances, failed, *kinds)


def _march(name: str, run: Callable[[], np.ndarray], built: dict[str, np.ndarray], failed: dict[str, str]) -> None:
    """Keep a path, or why there is none."""
    try:
        path = run()
    except RunFailed as error:
        failed[name] = error.reason
        return
    if np.isfinite(path).all() and np.abs(path).max() < LARGEST:
        built[name] = path
    else:
        failed[name] = "the motion blows up at this step"


def _by_build(twin: TwinModel, build: str, start: tuple[np.ndarray, np.ndarray], grid: tuple[int, float]) -> np.ndarray:
    """States (steps + 1, 2 n) of a build from coordinates and rates, by so many steps of so many seconds."""
    return _model(twin, build).march(*start, *grid)


def _model(twin: TwinModel, build: str) -> FreeModel:
    if twin.driven.tied and build != SOFT:
        move = equations(twin, build)
        return Plain(build, lambda time, q, v: move(q, v).acceleration, twin.size)
    if build != PLAIN:
        return free_model(build, twin.driven)
    return Plain(PLAIN, plain_tree(twin).acceleration, twin.size)


def file_path(
    twin: TwinModel, start: tuple[np.ndarray, np.ndarray], grid: tuple[int, float], integrator: str = "RK4"
) -> np.ndarray:
    """MuJoCo's own states (steps + 1, nq + n) of the file's model from coordinates and rates (n,), by so many steps of
    so many seconds."""
    (steps, step), model, data = grid, twin.model, mujoco.MjData(twin.model)
    before = model.opt.timestep, model.opt.integrator
    model.opt.timestep, model.opt.integrator = step, INTEGRATORS[integrator]
    state = twin.coordinates.to_mujoco(*start)
    held = np.tile(controls(model), (steps, 1)) if model.nu else np.empty((steps, 0))
    try:
        return march(model, data, np.concatenate((state.qpos, state.qvel)), held)
    finally:
        model.opt.timestep, model.opt.integrator = before


def _rows(first: np.ndarray, disturbed: np.ndarray, steps: int) -> int:
    """How many states lie before a disturbance has grown to what counts as different."""
    size = np.maximum.accumulate(np.abs(first).max(axis=1))
    grown = np.flatnonzero(~(np.abs(disturbed - first).max(axis=1) <= ALIKE * np.maximum(size, 1.0)))
    return max(2, int(grown[0])) if len(grown) else steps + 1


def _sliding_rows(twin: TwinModel, path: np.ndarray) -> int:
    """How many states of a path lie before dry friction sticks in MuJoCo, less one whose step may have met that."""
    n = twin.size
    for i, row in enumerate(path if twin.driven.frictions else ()):
        if not sliding(twin, [(row[:n], row[n:])]):
            return max(2, i - 1)
    return len(path)


def _unlimited_rows(twin: TwinModel, path: np.ndarray) -> tuple[int, str]:
    """How many states of a path lie before it strikes a limit, and whose; less one whose step may have met it."""
    struck = limits_struck(twin) if ranges(twin.model) else lambda q: ()
    for i, row in enumerate(path):
        if names := struck(row[: twin.size]):
            return max(2, i - 1), names[0]
    return len(path), ""


def _distance(twin: TwinModel, name: str, first: np.ndarray, path: np.ndarray) -> float:
    if name == FILE:
        n = twin.size
        states = [twin.coordinates.to_mujoco(row[:n], row[n:]) for row in first]
        first = np.array([np.concatenate((state.qpos, state.qvel)) for state in states])
        for turning in twin.coordinates.turnings:  # a quaternion and its opposite are the same
            at = slice(turning.place, turning.place + 4)
            path = path.copy()
            path[:, at] *= np.sign(np.einsum("tk,tk->t", path[:, at], first[:, at]))[:, None]
    return float(np.abs(path - first).max() / max(1.0, np.abs(first).max()))


def _ledger(twin: TwinModel, path: np.ndarray, step: float) -> float | None:
    """Kinetic energy less the work of all forces by Simpson's rule, as a share; None for fewer than three states."""
    n, rows = twin.size, len(path) - 1 + len(path) % 2
    if rows < 3:
        return None
    plain = plain_tree(twin)
    kinetic, power = np.empty(rows), np.empty(rows)
    for i, row in enumerate(path[:rows]):
        q, v = row[:n], row[n:]
        mass, _ = plain.mass_and_force(0.0, q, v)
        kinetic[i], power[i] = 0.5 * v @ mass @ v, v @ plain.applied(q, v)
    weights = np.full(rows, 2.0)
    weights[1::2], weights[[0, -1]] = 4.0, 1.0
    work = step / 3.0 * float(weights @ power)
    return float(abs(kinetic[-1] - kinetic[0] - work) / max(kinetic.max(), 1e-12))
