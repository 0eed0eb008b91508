"""Comparison of stabilisers against drift, on the same wrong model and noisy forces, scored by damage
(models/drift/score).

A perturbed model is driven by measured forces with noise: free, with prescribed pitch, with springs to the ground, with
a high-pass, or with a moment towards a Kalman filter's estimate; on the scene's road, and on the same road with a
grade.
"""

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.core.errors import InputError, RunFailed
from models.core.noise import PITCH_SENSOR, normal_samples
from models.core.result import Result
from models.core.strict import Strict, quantity, read
from models.core.time_series import write_time_series
from models.drift.growth import holding_stiffness, rigid_pitch
from models.drift.score import (
    COARSEST_SPACING,
    FEWEST_ROWS,
    SECTION_FORCE_CHANNELS,
    TUMBLING_PITCH,
    AcceptanceLimits,
    errors_of_run,
    figures_of_run,
    innovations_are_consistent,
    stated_pitch_uncertainty,
    verdict_on_run,
    verdict_without_true_run,
)
from models.fatigue.damage import WOEHLER_SLOPE
from models.systems.pitch_plane.run import run
from models.systems.pitch_plane.scene import Scene, assembly_of_scene, changed_scene
from models.systems.pitch_plane.trust import predict_trust
from models.systems.pitch_plane.virtual_measurement import (
    PAPER_FACTORS,
    check_road,
    check_steps,
    follower_builder,
    measure,
    perturbed_parameters,
    steps_per_sample,
    write_measurement,
)
from models.vehicles.pitch_plane import PitchPlaneParameters

Progress = Callable[[str, float], None]
FiguresRow = dict[str, Any]

DAMPING_RATIO = 0.7
"""Damping ratio of stabilising springs and high-pass filters."""


class StabiliserOptions(Strict):
    """[options] of the study of stabilisers: measurement, perturbed model, stabilisers, limits of the score."""

    sampling_rate: float = quantity("Hz", "rate at which forces and pitch are measured", default=1000.0)
    noise_fraction: float = quantity("", "standard deviation of the force noise by the largest force", default=0.002)
    angle_deviation: float = quantity("rad", "white noise on each measured pitch", default=math.radians(0.1))
    inertia_deviation: float = quantity("", "share by which the filter lets the inertia be wrong", default=0.05)
    factors: dict[str, float] = Field(PAPER_FACTORS, description="what the model's parameters are multiplied by")
    seed: int = Field(1, ge=0, lt=2**63, description="seed of force and pitch noise")
    bandwidth: float = quantity("Hz", "of the prescribed measured pitch", default=15.0)
    stiffnesses: list[float] = Field([50.0, 100.0, 300.0, 1e4], min_length=1, description="springs, N m/rad")
    dead_band: float = quantity("rad", "half width of the dead band of the stiffest spring", default=0.05)
    cut_offs: list[float] = Field([0.1, 0.5], description="high-pass filters, Hz")
    sweep: list[float] = Field(
        np.geomspace(30.0, 3e5, 9).tolist(), min_length=1, description="springs of the second figure, N m/rad"
    )
    grade: float | None = Field(
        None, gt=-0.5, lt=0.5, description="slope angle of the second road", json_schema_extra={"unit": "rad"}
    )
    slope: float = quantity("", "Woehler exponent", default=WOEHLER_SLOPE)
    limits: AcceptanceLimits = AcceptanceLimits()


def options_of(scene: Scene, engines: tuple[str, ...] = ()) -> StabiliserOptions:
    """Reads the scene's options. Raises InputError, before any file is written, for options with which a run of the
    study is impossible.
    """
    options = read(StabiliserOptions, scene.options, scene.file, "options")
    check_road(scene, engines, options.sampling_rate)
    check_steps(scene, engines)
    if scene.run.step > COARSEST_SPACING or scene.run.duration < FEWEST_ROWS * scene.run.step:
        length = f"{scene.run.duration:g} s by {scene.run.step:g} s"
        allowed = f"the score takes {FEWEST_ROWS} steps or more, of {COARSEST_SPACING:g} s or less"
        raise InputError(scene.file, "run", length, allowed)
    for name, factor in options.factors.items():
        if name not in PitchPlaneParameters.model_fields:
            allowed = "not a parameter of the vehicle"
            raise InputError(
                scene.file, f"options.factors.{name}", factor, allowed, tuple(PitchPlaneParameters.model_fields)
            )
    for name in ("stiffnesses", "cut_offs", "sweep"):
        for value in getattr(options, name):
            if not 0.0 < value < math.inf:
                raise InputError(scene.file, f"options.{name}", value, "must be above 0 and finite")
    for on_road in scenes_by_road(scene, options).values():
        assembly_of_scene(on_road)
    return options


def scenes_by_road(scene: Scene, study_options: StabiliserOptions) -> dict[str, Scene]:
    """Returns the scene on its road and, where options.grade is set, on the same road with that grade, by name."""
    if study_options.grade is None:
        return {"road": scene}
    road = scene.table()["effects"]["road"]
    if "grade" in road:
        allowed = "this study puts the road on options.grade itself: drop this key"
        raise InputError(scene.file, "effects.road.grade", road["grade"], allowed)
    return {"road": scene, "grade": changed_scene(scene, effects={"road": {**road, "grade": study_options.grade}})}


def compare_stabilisers(
    scene: Scene, engines: tuple[str, ...], output_folder: Path, report_study_progress: Progress
) -> tuple["list[StabiliserBench]", list[FiguresRow], dict[str, str]]:
    """Run all stabilisers on all roads. Returns the benches, a row of figures for each run, and reasons of failed runs
    by name.

    The first engine runs all stabilisers; the other engines run, on the scene's road, the free run and
    those that are accepted.
    """
    options, failed, rows = options_of(scene, engines), dict[str, str](), list[FiguresRow]()
    benches = [
        StabiliserBench(on_road, road, options, output_folder, scene.error)
        for road, on_road in scenes_by_road(scene, options).items()
    ]
    for i, bench in enumerate(benches):

        def report_progress(progress_text: str, road_share: float, completed_share: int = i) -> None:
            report_study_progress(progress_text, (completed_share + road_share) / (len(benches) + 1))

        rows += bench.score_stabilisers(engines[0], () if i else engines[1:], failed, report_progress)
    return benches, rows, failed


class StabiliserBench:
    """Virtual measurement on a road, and runs of the perturbed model with each stabiliser on the measured files.

    trusted : time (s) until which a free run can be trusted; holding : stiffness (N m/rad) of a spring that prevents
    drift, both predicted before any run; error : whether the error of the measurement's time steps is estimated;
    results : the measurement and all runs, by name.
    """

    def __init__(
        self,
        scene: Scene,
        road_name: str,
        study_options: StabiliserOptions,
        output_folder: Path,
        estimate_error: bool = False,
    ) -> None:
        self.road, self.options, self.folder = road_name, study_options, output_folder / road_name
        self.folder.mkdir()
        self.truth, period = measure(scene, estimate_error), 1.0 / study_options.sampling_rate
        self.results = {f"measurement ({road_name})": self.truth}
        self.deviation = study_options.noise_fraction * write_measurement(self.truth, self.folder, period)
        self._write_sensors(steps_per_sample(scene, study_options.sampling_rate), period)
        self.override = perturbed_parameters(scene.vehicle_parameters(), study_options.factors)
        self.follow = follower_builder(scene, self.folder)
        self.parameters = self.follow(self.override, {}).vehicle_parameters()
        self.methods = self._effects_of_methods()
        predicted = predict_trust(assembly_of_scene(self._scene({})), study_options.limits.pitch_error)
        assert predicted is not None  # nothing holds a free run
        self.trusted = scene.run.duration if predicted.until is None else predicted.until[1]
        self.holding = holding_stiffness(self.parameters, predicted.rate)

    def _write_sensors(self, steps_per_sample: int, sample_period: float) -> None:
        """Write files of measured pitch with noise, and of exact heave and pitch, sampled every ``steps_per_sample``
        steps.
        """
        heave, pitch = self.truth["z3"][::steps_per_sample], self.truth["pitch"][::steps_per_sample]
        noise = normal_samples(self.options.seed, 0, len(pitch), 1, noise_source=PITCH_SENSOR)[:, 0]
        noisy = {"pitch": ("rad", pitch + self.options.angle_deviation * noise)}
        write_time_series(self.folder / "measured_pitch.csv", noisy, sample_period)
        exact_columns = {"z3": ("m", heave), "pitch": ("rad", pitch)}
        write_time_series(self.folder / "heave_and_pitch.csv", exact_columns, sample_period)

    @property
    def pitch_inertia(self) -> float:
        """Pitch inertia of chassis and wheels together, I + J, in kg m^2."""
        return rigid_pitch(self.parameters).total_inertia

    def spring_settings(self, spring_stiffness: float) -> dict[str, float]:
        """Stiffness (N m/rad) and damping (N m s/rad) of a pitch spring to the ground with the damping ratio
        DAMPING_RATIO.
        """
        return {
            "stiffness": spring_stiffness,
            "damping": 2.0 * DAMPING_RATIO * math.sqrt(spring_stiffness * self.pitch_inertia),
        }

    def _effects_of_methods(self) -> dict[str, dict[str, Any]]:
        """Effects of each stabiliser by name, in addition to wheel forces and noise."""
        options, noisy = self.options, "measured_pitch.csv"
        sure = {"file": noisy, "pitch_deviation": options.angle_deviation, "force_deviation": self.deviation}
        filtered = {**sure, "inertia_deviation": options.inertia_deviation}
        smoothed = {"file": noisy, "bandwidth": options.bandwidth}
        springs = {f"spring {k:g} N m/rad": {"pitch_spring": self.spring_settings(k)} for k in options.stiffnesses}
        stiffest = max(options.stiffnesses)
        banded = {"pitch_spring": {**self.spring_settings(stiffest), "dead_band": options.dead_band}}
        passes = {
            f"high-pass {f:g} Hz": {"high_pass": {"cut_off": f, "damping_ratio": DAMPING_RATIO}}
            for f in options.cut_offs
        }
        return {
            "free": {},
            "exact pitch prescribed": {"prescribed_pitch": {"file": "pitch.csv"}},
            "exact heave and pitch": {"prescribed_heave_and_pitch": {"file": "heave_and_pitch.csv"}},
            f"measured pitch to {options.bandwidth:g} Hz": {"prescribed_pitch": smoothed},
            **springs,
            f"{stiffest:g} beyond {options.dead_band:g} rad": banded,
            **passes,
            "Kalman, sure of the model": {"kalman_filter": sure},
            "Kalman filter": {"kalman_filter": filtered},
            "Kalman smoother": {"kalman_filter": {**filtered, "smoother": True}},
        }

    def score_stabilisers(
        self, engine: str, other_engines: tuple[str, ...], failures: dict[str, str], report_progress: Progress
    ) -> list[FiguresRow]:
        """Run all stabilisers in an engine, and the free run and the accepted ones in the other engines. Returns a row
        of figures per run; reasons of failed runs are added to ``failures``.
        """
        rows: list[FiguresRow] = []
        self.simulate(engine, {})  # compiles what is not compiled yet, so that no row pays for it
        for i, (name, effects) in enumerate(self.methods.items()):
            report_progress(f"{engine}, {self.road}: {name}", i / len(self.methods))
            of_method = self._rows_of_run(engine, name, effects, failures)
            rows += of_method
            if of_method and (name == "free" or of_method[0]["verdict"] == "accepted"):
                rows += [
                    row
                    for other_engine in other_engines
                    for row in self._rows_of_run(other_engine, name, effects, failures)
                ]
        return rows

    def _rows_of_run(
        self, engine: str, stabiliser_name: str, stabiliser_effects: dict[str, Any], failures: dict[str, str]
    ) -> list[FiguresRow]:
        """Run a stabiliser in an engine. Returns its row of figures, or nothing if the run fails."""
        start = time.perf_counter()
        try:
            result = self.simulate(engine, stabiliser_effects)
        except RunFailed as error:
            failures[f"{engine}, {self.road}, {stabiliser_name}"] = str(error)
            return []
        seconds = time.perf_counter() - start
        self.results[f"{engine}: {stabiliser_name} ({self.road})"] = result
        return [
            {
                "engine": engine,
                "road": self.road,
                **self.row(stabiliser_name, stabiliser_effects, result),
                "seconds": seconds,
            }
        ]

    def simulate(self, engine: str, stabiliser_effects: dict[str, Any]) -> Result:
        """Run the perturbed model under the noisy forces with some effects in an engine."""
        return run(self._scene(stabiliser_effects), engine)

    def _scene(self, stabiliser_effects: dict[str, Any]) -> Scene:
        noise = {"force_noise": {"deviation": self.deviation, "seed": self.options.seed}}
        return self.follow(self.override, noise | stabiliser_effects)

    def row(self, stabiliser_name: str, stabiliser_effects: dict[str, Any], run_result: Result) -> FiguresRow:
        """Figures and verdicts of a run by name. A run whose vehicle tumbled has no damage ratios,
        which would mislead.
        """
        limits = self.options.limits
        figures, wrong = (
            figures_of_run(run_result, self.parameters),
            errors_of_run(run_result, self.truth, self.options.slope),
        )
        with_truth = verdict_on_run(figures, wrong, stabiliser_effects, limits)
        verdict_without_truth = verdict_without_true_run(
            figures,
            stabiliser_effects,
            float(run_result.times[-1]),
            limits,
            self.trusted,
            innovations_are_consistent(run_result),
            stated_pitch_uncertainty(run_result),
        )
        loads = {f"damage {channel}": wrong.damage[channel] for channel in SECTION_FORCE_CHANNELS}
        loads |= {f"error {channel} [N]": wrong.force_rms[channel] for channel in SECTION_FORCE_CHANNELS}
        return {
            "method": stabiliser_name,
            **(dict.fromkeys(loads) if figures.pitch_max > TUMBLING_PITCH else loads),
            **{f"vertical damage {stabiliser_name}": ratio for stabiliser_name, ratio in wrong.vertical_damage.items()},
            "pitch error max [rad]": wrong.pitch_max,
            "pitch error rms [rad]": wrong.pitch_rms,
            "heave error max [m]": wrong.heave_max,
            "moment rms [N m]": figures.moment_rms,
            "moment max [N m]": figures.moment_max,
            "moment share": figures.moment_share,
            "moment share to 15 Hz": figures.moment_share_band,
            "force share to 15 Hz": figures.force_share_band,
            "force calls": figures.force_calls,
            "steps": figures.steps,
            "verdict": with_truth.word,
            "reason": with_truth.reason,
            "without truth": verdict_without_truth.word,
            "reason without truth": verdict_without_truth.reason,
        }

    def sweep(self) -> np.ndarray:
        """Sweep over the stiffness of a pitch spring. Columns (n, 4): stiffness (N m/rad), largest pitch error (rad)
        with the spring and with the equivalent high-pass, worst damage ratio with the spring.
        """
        rows = []
        for stiffness in self.options.sweep:
            cut_off = math.sqrt(stiffness / self.pitch_inertia) / (2.0 * math.pi)
            high_pass = {"high_pass": {"cut_off": cut_off, "damping_ratio": DAMPING_RATIO}}
            sprung, passed = (
                errors_of_run(self.simulate("reference", effects), self.truth, self.options.slope)
                for effects in ({"pitch_spring": self.spring_settings(stiffness)}, high_pass)
            )
            worst = max(sprung.damage.values(), key=lambda ratio: abs(math.log(ratio)))
            rows.append((stiffness, sprung.pitch_max, passed.pitch_max, worst))
        return np.array(rows)
