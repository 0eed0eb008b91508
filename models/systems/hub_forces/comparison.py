"""Runs of a scene of hub forces with every stabiliser and without, and what is computed of them: errors, damage."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from models.core.discretisation import with_stated_errors
from models.core.errors import RunFailed
from models.core.result import Result
from models.fatigue.damage import damage_ratio
from models.systems.hub_forces.run import MOTION_CHANNELS, Measurement, labelled_result, measure
from models.systems.hub_forces.run import run as run_scene
from models.systems.hub_forces.scene import HubScene, Method

Progress = Callable[[str, float], None]
FREE_RUN, FILTERED_RUN, PRESCRIBED_RUN = "free", "filter", "prescribed"
METHOD_OF_RUN: dict[str, Method] = {FREE_RUN: "none", FILTERED_RUN: "kalman", PRESCRIBED_RUN: "prescribed"}
"""Runs that are compared, whatever the scene's own method, and how roll and pitch are held in them."""
DRIFT_OFF_ANGLE = 0.05
"""rad: a roll or pitch that is off by more is drift-off, as in the study of the pitch plane."""


@dataclass(frozen=True)
class Comparison:
    """A measurement, its runs by name, reasons why other runs failed, and the true run, None where it is not known."""

    measurement: Measurement
    runs: dict[str, Result]
    failed: dict[str, str]
    truth: Result | None

    @property
    def beside(self) -> str:
        """Text that names the run to which errors and damages refer."""
        return "the true run" if self.truth is not None else "the run with the filter; the true one is not known"

    @property
    def results(self) -> dict[str, Result]:
        """All results by name: the true run, if it is known, and all other runs."""
        return {**({"true": self.truth} if self.truth else {}), **self.runs}

    def errors(self, run: Result) -> np.ndarray:
        """Errors (m, 6) of a run relative to the true run: roll, pitch, heading (rad), x, y, z (m).

        Without a true run, errors of roll and pitch are relative to the filter's estimate, and the others NaN.
        """
        if self.truth is not None:
            return np.column_stack([run[name] - self.truth[name] for name in MOTION_CHANNELS])
        tilt, errors_of_motion = self.measurement.tilt, np.full((len(run.times), len(MOTION_CHANNELS)), np.nan)
        angle_times = self.measurement.angles.period * np.arange(len(tilt.states))
        for i, name in enumerate(("roll", "pitch")):
            errors_of_motion[:, i] = run[name] - np.interp(run.times, angle_times, tilt.states[:, i])
        return errors_of_motion

    def damages(self, forces: np.ndarray) -> dict[str, float]:
        """Damage of every element from section forces (m, e), divided by that in the true run or, without one, in the
        filter's run.
        """
        true = (self.truth or self.runs[FILTERED_RUN])["section_force"]
        names = (element.name for element in self.measurement.vehicle.elements)
        return {name: damage_ratio(forces[:, i], true[:, i]) for i, name in enumerate(names)}

    def drift_off(self, run: Result) -> float:
        """First time (s) at which the error of roll or pitch exceeds DRIFT_OFF_ANGLE; infinite if it never does."""
        has_drifted = np.abs(self.errors(run)[:, :2]).max(axis=1) > DRIFT_OFF_ANGLE
        return float(run.times[np.argmax(has_drifted)]) if has_drifted.any() else float("inf")

    def answer(self) -> dict[str, Any]:
        """For each run: largest errors, rms of the stabiliser's moments, damage of every element, all relative to the
        run that ``beside`` names.
        """
        figures: dict[str, Any] = {"beside": self.beside}
        figures |= {name: {"failed": text} for name, text in self.failed.items()}
        for name, run in self.runs.items():
            figures[name] = {
                **dict(zip(MOTION_CHANNELS, map(float, np.abs(self.errors(run)).max(axis=0)), strict=True)),
                "moments": np.sqrt(np.mean(run["holding_moment"] ** 2, axis=0)).tolist(),
                "damage": self.damages(run["section_force"]),
            }
        return figures

    def engines_apart(self) -> float:
        """Largest difference between engines in any coordinate or rate before drift-off, for the method with the most
        runs.
        """
        kinds = [[run for name, run in self.runs.items() if name.startswith(kind)] for kind in METHOD_OF_RUN]
        comparable = max(kinds, key=len)
        first, common_times = comparable[0].detail.states, comparable[0].times
        rows = int(min(min(map(self.drift_off, comparable)), common_times[-1]) / common_times[1]) + 1
        return max(float(np.abs(run.detail.states[:rows] - first[:rows]).max()) for run in comparable)


def compare(scene: HubScene, engines: tuple[str, ...], progress: Progress = lambda text, part: None) -> Comparison:
    """Run the scene's own method in every engine, and the other methods in the last engine, which is the fastest.

    Raises RunFailed where even the filter cannot hold the vehicle, or where the step is too long for its springs.
    """
    last_engine, planned = engines[-1], planned_runs(scene, engines)
    progress("virtual measurement", 0.05)
    measurement = measure(scene, last_engine, scene.error)
    progress("Kalman filter", 0.2)
    measurement.tilt  # noqa: B018
    runs, failed = dict[str, Result](), dict[str, str]()
    for i, (name, (method, engine)) in enumerate(planned.items()):
        progress(name, 0.3 + 0.6 * i / len(planned))
        try:
            runs[name] = run_scene(scene, engine, method, measurement, scene.error)
        except RunFailed as error:
            if name == FILTERED_RUN:  # what the others are compared with
                raise
            failed[name] = str(error)
    return Comparison(measurement, runs, failed, _true_run(measurement, last_engine))


def _true_run(measurement: Measurement, engine: str) -> Result | None:
    """The true run of a virtual measurement as a labelled result, with the errors that were estimated for it."""
    if measurement.truth is None:
        return None
    run = labelled_result(measurement, measurement.truth, engine)
    return with_stated_errors(run, measurement.errors, "runs in longer steps") if measurement.errors else run


def planned_runs(scene: HubScene, engines: tuple[str, ...]) -> dict[str, tuple[Method, str]]:
    """Method and engine of every run by its name. A stabiliser's run in the last engine has a name without the
    engine.
    """
    return {
        name if name != FREE_RUN and engine == engines[-1] else f"{name}, {engine}": (method, engine)
        for name, method in METHOD_OF_RUN.items()
        for engine in engines
        if method == scene.stabilise.method or engine == engines[-1]
    }
