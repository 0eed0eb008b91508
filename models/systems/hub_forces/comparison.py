"""Comparison of runs of a hub forces scene with every stabiliser and without: errors of the motion, fatigue damage."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from models.core.discretisation import with_stated_errors
from models.core.errors import RunFailed
from models.core.result import Result
from models.fatigue.damage import damage_ratio
from models.systems.hub_forces.run import MOTION_CHANNELS, HubMeasurement, labelled_result, measure
from models.systems.hub_forces.run import run as run_scene
from models.systems.hub_forces.scene import HubScene, StabiliserMethod

Progress = Callable[[str, float], None]
FREE_RUN, FILTERED_RUN, PRESCRIBED_RUN = "free", "filter", "prescribed"
METHOD_OF_RUN: dict[str, StabiliserMethod] = {FREE_RUN: "none", FILTERED_RUN: "kalman", PRESCRIBED_RUN: "prescribed"}
"""Compared runs by name, with the stabiliser of each."""
DRIFT_OFF_ANGLE = 0.05
"""Error of roll or pitch (rad) beyond which a run has drifted off, as in the study of the pitch plane."""


@dataclass(frozen=True)
class StabiliserComparison:
    """Compared runs of a measurement. runs : results by name; failed : reasons of failed runs by name; truth : the true
    run, None where it is not known.
    """

    measurement: HubMeasurement
    runs: dict[str, Result]
    failed: dict[str, str]
    truth: Result | None

    @property
    def reference_run_text(self) -> str:
        """Text on the run to which errors and damages refer: the true run, or the run with the Kalman filter."""
        return "the true run" if self.truth is not None else "the run with the filter; the true one is not known"

    @property
    def results(self) -> dict[str, Result]:
        """All results by name: the true run, if it is known, and the compared runs."""
        return {**({"true": self.truth} if self.truth else {}), **self.runs}

    def errors(self, run_result: Result) -> np.ndarray:
        """Errors (m, 6) of a run relative to the true run: roll, pitch, heading (rad), x, y, z (m).

        Without a true run, errors of roll and pitch are relative to the filter's estimate, and the others NaN.
        """
        if self.truth is not None:
            return np.column_stack([run_result[name] - self.truth[name] for name in MOTION_CHANNELS])
        tilt, errors_of_motion = self.measurement.tilt, np.full((len(run_result.times), len(MOTION_CHANNELS)), np.nan)
        angle_times = self.measurement.angles.period * np.arange(len(tilt.states))
        for i, name in enumerate(("roll", "pitch")):
            errors_of_motion[:, i] = run_result[name] - np.interp(run_result.times, angle_times, tilt.states[:, i])
        return errors_of_motion

    def relative_damages(self, section_forces: np.ndarray) -> dict[str, float]:
        """Fatigue damage of every element under section forces (m, e), divided by its damage in the true run, or in the
        run with the Kalman filter where no true run is known.
        """
        true = (self.truth or self.runs[FILTERED_RUN])["section_force"]
        names = (element.name for element in self.measurement.vehicle.elements)
        return {name: damage_ratio(section_forces[:, i], true[:, i]) for i, name in enumerate(names)}

    def drift_off_time(self, run_result: Result) -> float:
        """First time (s) at which a run's error of roll or pitch exceeds DRIFT_OFF_ANGLE; infinite if it never does."""
        has_drifted = np.abs(self.errors(run_result)[:, :2]).max(axis=1) > DRIFT_OFF_ANGLE
        return float(run_result.times[np.argmax(has_drifted)]) if has_drifted.any() else float("inf")

    def figures(self) -> dict[str, Any]:
        """Numbers of each run for a JSON file: largest errors, rms of the stabiliser's moments (N m), relative damage
        of every element.
        """
        figures: dict[str, Any] = {"beside": self.reference_run_text}
        figures |= {name: {"failed": text} for name, text in self.failed.items()}
        for name, run in self.runs.items():
            figures[name] = {
                **dict(zip(MOTION_CHANNELS, map(float, np.abs(self.errors(run)).max(axis=0)), strict=True)),
                "moments": np.sqrt(np.mean(run["holding_moment"] ** 2, axis=0)).tolist(),
                "damage": self.relative_damages(run["section_force"]),
            }
        return figures

    def largest_engine_difference(self) -> float:
        """Largest difference between engines in any coordinate (m, rad) or rate before drift-off, for the stabiliser
        with the most runs.
        """
        kinds = [[run for name, run in self.runs.items() if name.startswith(kind)] for kind in METHOD_OF_RUN]
        comparable = max(kinds, key=len)
        first, common_times = comparable[0].detail.states, comparable[0].times
        rows = int(min(min(map(self.drift_off_time, comparable)), common_times[-1]) / common_times[1]) + 1
        return max(float(np.abs(run.detail.states[:rows] - first[:rows]).max()) for run in comparable)


def compare_stabilisers(
    scene: HubScene, engines: tuple[str, ...], report_progress: Progress = lambda text, part: None
) -> StabiliserComparison:
    """Run the scene's stabiliser in every engine, and the other stabilisers in the last engine, which is the fastest.

    Raises RunFailed where even the run with the Kalman filter fails, or where the step is too long for the springs.
    """
    last_engine, planned = engines[-1], planned_runs(scene, engines)
    report_progress("virtual measurement", 0.05)
    measurement = measure(scene, last_engine, scene.error)
    report_progress("Kalman filter", 0.2)
    measurement.tilt  # noqa: B018
    runs, failed = dict[str, Result](), dict[str, str]()
    for i, (name, (method, engine)) in enumerate(planned.items()):
        report_progress(name, 0.3 + 0.6 * i / len(planned))
        try:
            runs[name] = run_scene(scene, engine, method, measurement, scene.error)
        except RunFailed as error:
            if name == FILTERED_RUN:  # what the others are compared with
                raise
            failed[name] = str(error)
    return StabiliserComparison(measurement, runs, failed, _true_run(measurement, last_engine))


def _true_run(measurement: HubMeasurement, engine: str) -> Result | None:
    """Returns the true run of a virtual measurement as a result with its stated errors; None for measured files."""
    if measurement.truth is None:
        return None
    run = labelled_result(measurement, measurement.truth, engine)
    return with_stated_errors(run, measurement.errors, "runs in longer steps") if measurement.errors else run


def planned_runs(scene: HubScene, engines: tuple[str, ...]) -> dict[str, tuple[StabiliserMethod, str]]:
    """Returns stabiliser and engine of every run by the run's name. Runs with a stabiliser in the last engine have a
    name without the engine.
    """
    return {
        name if name != FREE_RUN and engine == engines[-1] else f"{name}, {engine}": (method, engine)
        for name, method in METHOD_OF_RUN.items()
        for engine in engines
        if method == scene.stabilise.method or engine == engines[-1]
    }
