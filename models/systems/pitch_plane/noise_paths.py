"""Ensembles of noise paths of a force-excited scene: path i is the run of the scene with ``path = i``, to the last bit.

Every effect that has a parameter ``path`` (``force_noise``) gets the number; effects before the first of them are
assembled once. A path is run by the engine itself, so there is no second copy of the equations, and every scene that an
engine can run can be an ensemble. The reference takes some 220 ns per path and step, 30 of them for the noise.

MuJoCo computes them in its own threads, too. Its callbacks are global to a process, so its runs cannot each bring their
own into several Python threads: the compiled callback is installed once and ``rollout`` shares the models, each of
which holds its path's forces as a table, among its threads. Exudyn, and anything else, runs in processes:
``noise_paths(..., engine="exudyn")`` on ``workers.process_pool``.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from models.core.errors import InputError, RunFailed
from models.core.scene_effects import effect_of
from models.core.steps import step_divides
from models.core.systems import DEFAULT_SYSTEM
from models.core.trajectory import Trajectory
from models.engines.assembly import Assembly, Settings
from models.engines.catalogue import CATALOGUE
from models.engines.protocol import build, check_trajectory
from models.ensemble.runner import PathFailed
from models.ensemble.store import ArraysByName
from models.systems.pitch_plane.scene import Scene, assembly_of_scene, effects_in_order, settings_of

LARGEST_PITCH_BEFORE_DRIFT_OFF = 0.05
"""Difference (rad) from the true pitch beyond which a path has drifted off, unless the job has another threshold."""


@dataclass(frozen=True)
class NoisePaths:
    """Ensemble job (see ``models.ensemble.runner``) that runs a scene once per noise path. It returns states at chosen
    steps, and the time at which each path drifts off.

    Attributes
    ----------
    base : assembly of the scene with the effects that all paths share
    path_effects : names and parameters of the effects that have a ``path``, and of effects that depend on these
    rows : numbers of the steps whose states are returned, shape (rows,)
    truth : pitch (rad) of the true path at every step, shape (steps + 1,)
    threshold : difference from the true pitch (rad) beyond which a path has drifted off
    """

    base: Assembly
    path_effects: tuple[tuple[str, Any], ...]
    engine: str
    settings: Settings
    rows: np.ndarray
    truth: np.ndarray
    threshold: float = LARGEST_PITCH_BEFORE_DRIFT_OFF

    def assembly(self, noise_path: int) -> Assembly:
        """Returns the assembly of the scene with the noise path of a number."""
        assembly = self.base
        for name, p in self.path_effects:
            with_path = p.model_copy(update={"path": noise_path}) if "path" in type(p).model_fields else p
            assembly = effect_of(DEFAULT_SYSTEM, name).extend(assembly, with_path)
        return assembly

    def trajectory(self, noise_path: int) -> Trajectory:
        """Runs a noise path in the engine; raises RunFailed if it leaves all bounds."""
        return build(self.engine, self.assembly(noise_path), self.settings).run()

    def trajectories(self, path_numbers: range) -> Iterator[Trajectory | RunFailed]:
        """Yields the trajectory of each path, or its RunFailed. Raises PathFailed for a failure that is not of the
        simulated physics.
        """
        for path in path_numbers:
            try:
                yield self.trajectory(path)
            except RunFailed as error:
                yield error
            except Exception as error:
                raise PathFailed(path, f"{type(error).__name__}: {error}") from error

    def __call__(self, paths: range) -> ArraysByName:
        """Runs a block of n paths. Returns arrays by name.

        ``states`` (n, rows, 8); ``drift_off`` (n,): first time (s) at which the pitch is further than ``threshold``
        from the truth, infinite if never; ``failed`` (n,): last good time (s) of a path that left all bounds, whose
        states are then NaN and whose drift-off is at the latest that time; NaN for all others.
        """
        columns = zip(*map(self._saved_part, self.trajectories(paths)), strict=True)
        return {name: np.array(column) for name, column in zip(("states", "drift_off", "failed"), columns, strict=True)}

    def _saved_part(self, path_outcome: Trajectory | RunFailed) -> tuple[np.ndarray, float, float]:
        """Returns the states (rows, 8) at the saved steps, NaN after a failure; then the time (s) at which the pitch
        drifts off, infinite if it never does, and the time (s) of the failure, NaN without one.
        """
        if isinstance(path_outcome, RunFailed):
            failure_time = 0.0 if path_outcome.time is None else path_outcome.time
            return np.full((len(self.rows), 8), np.nan), failure_time, failure_time
        far = np.abs(path_outcome.states[:, 3] - self.truth) > self.threshold
        first = far.argmax()
        return path_outcome.states[self.rows], path_outcome.times[first] if far[first] else np.inf, np.nan

    def facts(self) -> dict[str, Any]:
        """Returns everything on which the paths depend, by name."""
        forces = self.base.input
        return {
            "engine": self.engine,
            "settings": vars(self.settings),
            "scene": self.base.scene.table(),
            "forces": getattr(forces, "values", None),
            "start": self.base.initial,
            "rows": self.rows,
            "truth": self.truth,
            "threshold": self.threshold,
        }


def noise_paths(
    scene: Scene,
    saved_times: np.ndarray,
    true_states: np.ndarray | None = None,
    drift_off_pitch: float = LARGEST_PITCH_BEFORE_DRIFT_OFF,
    engine: str = "reference",
) -> NoisePaths:
    """Returns the job that runs a scene's noise paths; states are returned at ``saved_times`` (s), multiples of the
    step.

    true_states : pitch (rad) of the true path at every step, shape (steps + 1,); None takes the run of the same scene
    in the reference without noise on its forces. Raises InputError for a scene without ``force_noise``, an integrator
    that picks its own steps, times off the steps and a truth of another length.
    """
    if "force_noise" not in scene.effects:
        raise InputError(scene.file, "effects.force_noise", None, "is missing: without it all paths are the same")
    settings = settings_of(scene, engine)
    if CATALOGUE[engine][settings.integrator].adaptive:
        raise InputError(
            scene.file,
            f"engines.{engine}.integrator",
            settings.integrator,
            "picks its own steps: an ensemble keeps states at common times and needs fixed ones",
        )
    base, path_effects = _shared_and_path_effects(scene)
    if true_states is None:
        silent = scene.effects["force_noise"].model_copy(update={"deviation": 0.0})
        quiet = scene.model_copy(update={"effects": scene.effects | {"force_noise": silent}})
        true_states = build("reference", assembly_of_scene(quiet), settings_of(quiet, "reference")).run().states[:, 3]
    if true_states.shape != (settings.steps + 1,):
        raise InputError(
            scene.file, "truth", list(true_states.shape), f"must have one pitch per step: {settings.steps + 1}"
        )
    return NoisePaths(
        base, path_effects, engine, settings, _step_rows(scene, settings, saved_times), true_states, drift_off_pitch
    )


def _shared_and_path_effects(scene: Scene) -> tuple[Assembly, tuple[tuple[str, Any], ...]]:
    """Returns the assembly that all paths share, and the effects that have a path or depend on such an effect."""
    names, unshared = effects_in_order(scene), list[str]()
    for name in names:
        module = effect_of(DEFAULT_SYSTEM, name)
        if "path" in type(scene.effects[name]).model_fields or set(unshared) & {*module.NEEDS, *module.AFTER}:
            unshared.append(name)
    shared = scene.model_copy(update={"effects": {name: scene.effects[name] for name in names if name not in unshared}})
    return replace(assembly_of_scene(shared), scene=scene), tuple((name, scene.effects[name]) for name in unshared)


def _step_rows(scene: Scene, solver_settings: Settings, saved_times: np.ndarray) -> np.ndarray:
    """Numbers of the time steps at requested times (s); raises InputError for a time between steps."""
    for time in saved_times:
        if not 0 <= time <= solver_settings.duration * (1 + 1e-9) or (
            time > 0 and not step_divides(solver_settings.step, time)
        ):
            duration, step = solver_settings.duration, solver_settings.step
            allowed = f"must lie between 0 and {duration:g} s, on a multiple of the step {step:g} s"
            raise InputError(scene.file, "times", float(time), allowed)
    return np.rint(np.asarray(saved_times) / solver_settings.step).astype(np.int64)


@dataclass(frozen=True)
class MujocoThreads(NoisePaths):
    """Ensemble job of noise paths that MuJoCo computes in several threads; results do not depend on their number."""

    threads: int = 2

    def __post_init__(self) -> None:
        if self.engine != "mujoco" or self.base.guided:
            raise InputError(self.base.scene.file, "engine", self.engine, "only free runs of mujoco have its threads")

    def trajectories(self, path_numbers: range) -> Iterator[Trajectory | RunFailed]:
        """Yields the trajectory of each path, all from one call of MuJoCo's ``rollout``. If MuJoCo warns, the paths are
        run again one by one.
        """
        models = [build("mujoco", self.assembly(path), self.settings) for path in path_numbers]
        step_times = self.settings.step * np.arange(self.settings.steps + 1)
        marched, warned = self._rollout(models)
        if warned:
            yield from super().trajectories(path_numbers)
            return
        for states in marched:
            try:
                check_trajectory("mujoco", step_times, states, self.settings.duration)
                yield Trajectory(step_times, states)
            except RunFailed as error:
                yield error

    def _rollout(self, mujoco_models: list[Any]) -> tuple[np.ndarray, bool]:
        """Returns the states (paths, steps + 1, 8) of all models, and whether MuJoCo warned of anything."""
        from mujoco import rollout

        from models.engines.mujoco_march import warning_text
        from models.engines.mujoco_quiet import installed_callback, without_warnings

        start = np.concatenate(([0.0], self.base.initial))
        has_controls = mujoco_models[0].drive.controls is not None
        controls = np.stack([model.controls() for model in mujoco_models]) if has_controls else None
        working = mujoco_models[: self.threads]
        with installed_callback(mujoco_models[0].drive.law), without_warnings():
            sensed, _ = rollout.rollout(
                [model.model for model in mujoco_models],
                [model.data for model in working],
                np.tile(start, (len(mujoco_models), 1)),
                control=controls,
                nstep=self.settings.steps,
            )
        states = np.concatenate((np.tile(self.base.initial, (len(mujoco_models), 1, 1)), sensed[:, :, 1:9]), axis=1)
        return states, any(warning_text(model.data) for model in working)

    def facts(self) -> dict[str, Any]:
        """Returns everything on which the paths depend, as for ``NoisePaths``, and that threads computed them."""
        return {**super().facts(), "way": "threads"}


def mujoco_threads(
    scene: Scene,
    saved_times: np.ndarray,
    true_states: np.ndarray | None = None,
    drift_off_pitch: float = LARGEST_PITCH_BEFORE_DRIFT_OFF,
    thread_count: int = 2,
) -> MujocoThreads:
    """Returns the job that runs a scene's noise paths in MuJoCo with several threads; arguments as of
    ``noise_paths``.
    """
    return MujocoThreads(
        **vars(noise_paths(scene, saved_times, true_states, drift_off_pitch, "mujoco")), threads=thread_count
    )


def largest_difference(reference_paths: ArraysByName, other_paths: ArraysByName, times: np.ndarray) -> float:
    """Largest difference in any state between two ensembles of the same paths, before both drift off, divided by the
    reference's largest state in that time.

    reference_paths, other_paths : arrays of ``NoisePaths``; the second may hold fewer paths; times (rows,) in s. After
    drift-off a rounding error is as large as the run, so that a comparison is meaningless; nan where all paths have
    drifted off before the first row after the start.
    """
    count = len(other_paths["states"])
    until = np.minimum(reference_paths["drift_off"][:count], other_paths["drift_off"])
    if not (times[times > 0.0] < until[:, None]).any():
        return math.nan
    first = np.where((times < until[:, None])[:, :, None], reference_paths["states"][:count], 0.0)
    other_states = np.where((times < until[:, None])[:, :, None], other_paths["states"], 0.0)
    return float(np.abs(first - other_states).max() / np.abs(first).max())
