"""Runs of a recording's scene: resampling, checks, a free and a stabilised run, verdicts, and files of section forces.

Samples lie on disk in columns, read block by block. A result has the samples of the chosen run if they are no longer
than a block, figures of every section force, and the path of the columns.
"""

import json
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from models.core.assumptions import with_assumptions
from models.core.discretisation import not_estimated, with_stated_errors
from models.core.errors import InputError, RunFailed
from models.core.finding import Finding
from models.core.result import Result
from models.core.systems import load
from models.drift.score import StabilisedRunVerdict
from models.fatigue.counting import CountedLoad, counted_load
from models.measured.checks import findings_of_all_checks
from models.measured.checks.evidence import CheckedRecording
from models.measured.checks.spectra import white_noise
from models.measured.checks.weight import mean_hub_moments
from models.measured.recording import Progress, Recording, report_no_progress
from models.measured.signal import MeasuredSignal
from models.multibody.cut_kernel import WRENCH
from models.systems.measured.assumptions import assumptions
from models.systems.measured.clock import record_on_clock
from models.systems.measured.consequences import Consequence, consequences
from models.systems.measured.consequences import verdict_with_consequences as judged_by_consequences
from models.systems.measured.errors import errors_of_steps
from models.systems.measured.hand_on import FILE_STEM, labelled_result, section_force_channels, write_section_forces
from models.systems.measured.holds import FREE_RUN_NAME, QUANTITY_OF_NOISE_KEY, stabilisers_of_runs
from models.systems.measured.pitch_plane import PlaneRunSettings
from models.systems.measured.pitch_plane import run as run_plane
from models.systems.measured.plan import opened_files, signals_of_files
from models.systems.measured.scene import MeasuredRig, MeasuredScene
from models.systems.measured.section_run import AttitudeHold, SectionOutcome, SectionRunSettings
from models.systems.measured.section_run import check_settings as check_run
from models.systems.measured.section_run import run as march
from models.systems.measured.sections import SectionChannel, Sections, accelerometer_points
from models.systems.measured.trust import Drift, MeasurementErrors, predicted_drift
from models.systems.measured.verdict import (
    ChannelComparison,
    channels_to_compare,
    compare_channel,
    filter_doubts,
    judge_run,
)
from models.systems.measured.virtual import VirtualMeasurement, virtual_measurement, write_pattern
from models.systems.pitch_plane.trust import UNTRUSTED_PITCH, TrustPrediction
from models.vehicles.cut_vehicle import CutVehicle

WORK_FOLDER = "work"
"""Folder from which an interrupted run is resumed: resampled recording, and runs with their checkpoints."""


@dataclass
class RecordingAnalysis:
    """Everything that is computed for a recording, in the order of computation; fields that were not reached are empty.

    scene : scene that reads the files, also of a virtual measurement; holds : stabiliser of each run, by name;
    seconds : of each stage; plane : result of the chosen run in the pitch plane; counted : section forces that are
    written, with their cycle counts; temporary_folder : folder of all files, None in a user's folder.
    """

    scene: MeasuredScene
    rig: MeasuredRig
    engine: str
    recording: Recording
    virtual: VirtualMeasurement | None
    holds: dict[str, AttitudeHold]
    findings: tuple[Finding, ...] = ()
    drift: Drift | None = None
    trust: tuple[tuple[str, TrustPrediction], ...] = ()
    runs: dict[str, SectionOutcome] = field(default_factory=dict)
    verdicts: dict[str, StabilisedRunVerdict] = field(default_factory=dict)
    consequences: tuple[Consequence, ...] = ()
    channel_comparisons: tuple[ChannelComparison, ...] = ()
    plane: Result | None = None
    counted: dict[SectionChannel, CountedLoad] = field(default_factory=dict)
    written_files: tuple[Path, ...] = ()
    failed: dict[str, str] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    temporary_folder: "TemporaryDirectory[str] | None" = None

    @cached_property
    def evidence_for_checks(self) -> CheckedRecording:
        """Recording, vehicle and stated noise in the form that the checks of recordings take."""
        stated = {quantity: getattr(self.scene.noise, key) for key, quantity in QUANTITY_OF_NOISE_KEY.items()}
        claimed = {s.name: stated[s.quantity] for s in self.recording.signals if stated.get(s.quantity) is not None}
        return CheckedRecording(self.recording, self.rig.vehicle, self.scene.places, claimed, self.scene.plane())

    @property
    def has_error_findings(self) -> bool:
        """Whether the recording has a finding of weight "error", so that no run is made."""
        return any(finding.weight == "error" for finding in self.findings)

    @property
    def chosen_run(self) -> str:
        """Name of the run whose section forces are written to files: stabilised, or free without a stabiliser."""
        return [*self.holds][-1]

    @property
    def outcome(self) -> SectionOutcome | None:
        """The outcome of the chosen run; None where no run was made."""
        return self.runs.get(self.chosen_run)

    def is_input(self, signal: MeasuredSignal) -> bool:
        """Whether a signal is an input of the chosen run; other signals are only compared with the run."""
        moving = signal.at == self.rig.chassis and signal.quantity in ("angle", "angular rate")
        return not signal.check and (signal.at in self.rig.hubs or (moving and self.chosen_run != FREE_RUN_NAME))

    def forces(self, run_outcome: SectionOutcome) -> list[SectionChannel]:
        """Channels of section forces and moments of a run at the scene's sections, or at all sections if the scene
        names none.
        """
        wanted = self.scene.hand_on.sections
        return [
            answer
            for answer in section_force_channels(run_outcome.answers)
            if wanted is None or answer.section in wanted
        ]

    def settings_of_run(
        self, run_name: str, recording: Recording | None = None
    ) -> SectionRunSettings | PlaneRunSettings:
        """Returns the settings of a run by its name, also for another recording. The run computes forces at all
        sections in axes of the chassis, and accelerations at accelerometers.
        """
        recording, vehicle = recording or self.recording, self.rig.vehicle
        settings = self.engine, self.holds[run_name], self.scene.run.step, self.scene.file
        if vehicle is None:
            return PlaneRunSettings(recording, self.rig.name, *settings)
        sections = Sections(vehicle, points=accelerometer_points(vehicle, recording.signals, self.scene.places))
        return SectionRunSettings(vehicle, recording, sections, *settings)

    def march(
        self,
        run_name: str,
        run_folder: Path,
        report_progress: Callable[[float, float], None] = report_no_progress,
        estimate_error: bool = False,
    ) -> SectionOutcome:
        """Make a run by its name, or complete the run in a folder. estimate_error : whether the error of a run in the
        pitch plane is estimated.
        """
        job = self.settings_of_run(run_name)
        if isinstance(job, SectionRunSettings):
            return march(job, run_folder, report_progress)
        shutil.rmtree(run_folder, ignore_errors=True)  # a run of seconds: what a killed one has left is made anew
        run = run_plane(job, run_folder, self.scene.limits, estimate_error and run_name == self.chosen_run)
        self.verdicts[run_name], self.plane = run.verdict, run.result
        if run_name == FREE_RUN_NAME and run.trust is not None:
            self.trust = (("pitch", run.trust),)
        return run.outcome

    def rerun(self, run_name: str, recording: Recording, run_folder: Path) -> SectionOutcome:
        """Run another recording with the stabiliser of a run, given by its name."""
        job = self.settings_of_run(run_name, recording)
        return (
            march(job, run_folder / "run")
            if isinstance(job, SectionRunSettings)
            else run_plane(job, run_folder / "run").outcome
        )


def run(
    scene: MeasuredScene,
    engine: str = "",
    folder: Path | None = None,
    progress: Progress = report_no_progress,
    whole_run: bool = False,
    error: bool = False,
) -> Result:
    """Run a recording with the scene's stabiliser; the result's detail is the ``RecordingAnalysis``.

    folder : folder of all samples, from which an interrupted run is resumed; without a folder they live as long as the
    detail. whole_run : whether the recording is also checked, run free and judged, and section forces are written to
    files. error : whether the error of the time steps is estimated, by further runs. Raises InputError for files that
    cannot be read. If a run fails with whole_run, the detail has the reason; otherwise RunFailed is raised.
    """
    temporary = None if folder else TemporaryDirectory()
    folder = folder or Path(temporary.name if temporary else "")
    exam = _start_examination(scene, engine or scene.run.engine, folder, progress, error)
    exam.temporary_folder = temporary
    if whole_run:
        _examine(exam, folder, progress, error)
    else:
        begun = time.process_time()
        exam.runs[exam.chosen_run] = exam.march(
            exam.chosen_run, folder / WORK_FOLDER / exam.chosen_run, estimate_error=error
        )
        exam.seconds["march"] = time.process_time() - begun
    labelled = _with_assumptions(_labelled_result(scene, exam, folder), exam)
    try:
        return _with_error(labelled, exam, folder / WORK_FOLDER / "error") if error else labelled
    except RunFailed as failure:
        if not whole_run:
            raise
        exam.failed[exam.chosen_run] = str(failure)
        exam.verdicts[exam.chosen_run] = StabilisedRunVerdict("rejected", failure.reason)
        labelled.data.attrs |= _endings_of_runs(exam)
        return labelled


def _with_assumptions(run_result: Result, recording_analysis: RecordingAnalysis) -> Result:
    """Returns the result with its assumptions and the broken ones; in the pitch plane together with the assumptions of
    the pitch-plane run.
    """
    if recording_analysis.outcome is None:
        return run_result
    with_assumptions(
        run_result, assumptions(recording_analysis.scene, recording_analysis.rig.vehicle, recording_analysis)
    )
    if recording_analysis.plane is not None:
        stated_here, stated_by_run = (
            json.loads(each.data.attrs["assumptions"]) for each in (run_result, recording_analysis.plane)
        )
        run_result.data.attrs["assumptions"] = json.dumps(
            {key: [*stated_by_run[key], *stated_here[key]] for key in stated_here}
        )
        run_result.data.attrs["error"] = recording_analysis.plane.data.attrs["error"]
    return run_result


def _with_error(run_result: Result, recording_analysis: RecordingAnalysis, work_folder: Path) -> Result:
    """Returns the result with the errors of the time steps of the chosen run."""
    job, outcome = recording_analysis.settings_of_run(recording_analysis.chosen_run), recording_analysis.outcome
    if outcome is None or not isinstance(job, SectionRunSettings):
        return run_result
    if recording_analysis.chosen_run in recording_analysis.failed:
        return not_estimated(
            run_result, f"the run did not end: {recording_analysis.failed[recording_analysis.chosen_run]}"
        )
    earlier_errors = recording_analysis.virtual.errors if recording_analysis.virtual is not None else {}
    try:
        errors = errors_of_steps(job, outcome, earlier_errors, work_folder)
    except (InputError, RunFailed) as failure:
        return not_estimated(run_result, f"a part of it, in half the step, did not end: {failure}")
    return with_stated_errors(run_result, errors, "a part from the middle, in its steps and in half of them")


def _start_examination(
    scene: MeasuredScene, engine: str, output_folder: Path, report_progress: Progress, estimate_error: bool
) -> RecordingAnalysis:
    """Start the analysis: resample the recording from the scene's files, or from those of a virtual measurement."""
    rig, virtual, seconds, start_time = scene.rig(), None, dict[str, float](), time.perf_counter()
    (output_folder / WORK_FOLDER).mkdir(parents=True, exist_ok=True)
    if scene.virtual is not None and rig.vehicle is not None:
        report_progress("virtual measurement", 0.0)
        virtual = virtual_measurement(rig.vehicle, scene.virtual, engine, scene.file, estimate_error)
        if not (output_folder / "scene.toml").is_file():  # else a killed run has written it
            write_pattern(scene, virtual, virtual.samples(scene.virtual.faults, scene.virtual.seed), output_folder)
        scene = load(output_folder / "scene.toml")
        seconds["virtual measurement"] = time.perf_counter() - start_time
    recording = read_files(scene, output_folder / WORK_FOLDER, lambda text, part: report_progress(text, 0.2 * part))
    exam = RecordingAnalysis(
        scene, rig, engine, recording, virtual, stabilisers_of_runs(scene, recording), seconds=seconds
    )
    _record_seconds(exam, "reading", start_time)
    return exam


def read_files(scene: MeasuredScene, columns_folder: Path, report_progress: Progress = report_no_progress) -> Recording:
    """Reads the files of a scene as a recording with common sample times, stored in a folder. Raises InputError for
    unusable files.
    """
    sources, rig = opened_files(scene), scene.rig()
    return record_on_clock(
        scene, sources, signals_of_files(scene, sources, rig), rig.hubs, columns_folder, report_progress
    )


def _record_seconds(recording_analysis: RecordingAnalysis, stage_name: str, start_time: float) -> None:
    """Record the seconds of a stage that has ended: time since ``start_time`` less the seconds of earlier stages."""
    recording_analysis.seconds[stage_name] = time.perf_counter() - start_time - sum(recording_analysis.seconds.values())


def _examine(
    recording_analysis: RecordingAnalysis, output_folder: Path, report_progress: Progress, estimate_error: bool
) -> None:
    """Check the recording, predict the drift, make the runs, judge them, and write section forces to files; stops after
    the checks if these find an error.
    """
    lap = partial(
        _record_seconds, recording_analysis, start_time=time.perf_counter() - sum(recording_analysis.seconds.values())
    )
    report_progress("checks", 0.2)
    recording_analysis.findings = findings_of_all_checks(recording_analysis.evidence_for_checks)
    lap("checks")
    if recording_analysis.has_error_findings:
        return
    if recording_analysis.rig.vehicle is not None:
        _predict_drift(recording_analysis, recording_analysis.rig.vehicle)
    _make_runs(recording_analysis, output_folder / WORK_FOLDER, report_progress, estimate_error)
    if recording_analysis.rig.vehicle is not None:
        _add_verdicts(recording_analysis)
    lap("runs")
    if recording_analysis.outcome is not None:
        named = {(finding.check, finding.signals, finding.place) for finding in recording_analysis.findings}
        recording_analysis.findings += tuple(
            f for f in recording_analysis.outcome.findings if (f.check, f.signals, f.place) not in named
        )
        recording_analysis.findings += filter_doubts(recording_analysis.outcome)
    report_progress("what the findings do", 0.9)
    _add_consequences(recording_analysis, output_folder / WORK_FOLDER)
    lap("what the findings do")
    if recording_analysis.outcome is not None:
        report_progress("files", 0.95)
        _save_section_forces(recording_analysis, recording_analysis.outcome, output_folder)
        lap("files")


def _predict_drift(recording_analysis: RecordingAnalysis, vehicle: CutVehicle) -> None:
    """Predict the drift of the free run, which begins level and at rest: from noise, from mean moments that contradict
    the motion, and from the measured initial tilt and rates.
    """
    recording, free = recording_analysis.recording, recording_analysis.holds[FREE_RUN_NAME]
    tilt, rate = (
        [_initial_value(recording, what, axis, vehicle.chassis) for axis in ("roll", "pitch")]
        for what in ("angle", "angular rate")
    )
    couple = mean_hub_moments(
        recording_analysis.evidence_for_checks
    )  # that the motion does not bear out, at the first hub
    bias = np.concatenate([np.zeros(3), couple, np.zeros(WRENCH * len(vehicle.hubs) - 5)]) if couple.any() else None
    frame = next(s.frame for s in recording.signals if s.at in vehicle.hubs)
    level = MeasurementErrors(free.force, free.moment, bias, tilt, rate)
    recording_analysis.drift = predicted_drift(vehicle, level, recording.period, recording.duration, frame)
    lacking = recording_analysis.evidence_for_checks.missing_data_text
    unchecked_text = f"not checked: whether a channel is late; this needs {lacking}" if lacking else ""
    recording_analysis.trust = tuple(
        (what, replace(recording_analysis.drift.trust(angle), unchecked_text=unchecked_text))
        for what, angle in (("section forces", None), ("motion", UNTRUSTED_PITCH))
    )


def _initial_value(recording: Recording, quantity: str, angle_axis: str, chassis_name: str) -> float:
    """Mean of an angle (rad) or a rate (rad/s) over the first 0.1 s of a recording; 0 where it is not measured."""
    for signal in recording.find_signals(quantity, chassis_name, angle_axis)[:1]:
        values = recording.columns.read(signal.name, 0, max(round(0.1 / recording.period), 1))
        return float(np.nanmean(values)) if np.isfinite(values).any() else 0.0
    return 0.0


def _make_runs(
    recording_analysis: RecordingAnalysis, work_folder: Path, report_progress: Progress, estimate_error: bool
) -> None:
    """Make the free run and the run with the scene's stabiliser; a run that fails keeps its samples up to the
    failure."""
    for name in recording_analysis.holds:
        if isinstance(job := recording_analysis.settings_of_run(name), SectionRunSettings):
            check_run(job)
    for i, name in enumerate(recording_analysis.holds):
        report_progress(f"{name} run", 0.2 + 0.7 * i / len(recording_analysis.holds))
        progress_of_run = _with_time_left(
            f"{name} run",
            report_progress,
            0.2 + 0.7 * i / len(recording_analysis.holds),
            0.7 / len(recording_analysis.holds),
        )
        try:
            recording_analysis.runs[name] = recording_analysis.march(
                name, work_folder / name, progress_of_run, estimate_error
            )
        except RunFailed as error:
            recording_analysis.failed[name] = str(error)
            if isinstance(error.partial, SectionOutcome):
                recording_analysis.runs[name] = error.partial
        except InputError as error:  # what the filter refuses, the findings may explain
            if recording_analysis.rig.vehicle is None or all(
                finding.weight == "note" for finding in recording_analysis.findings
            ):
                raise
            recording_analysis.failed[name] = str(error)


def _with_time_left(
    run_name: str, report_progress: Progress, begin_share: float, run_share: float
) -> Callable[[float, float], None]:
    """Returns a progress callback of a run that adds an estimate of the remaining time."""
    started, first = time.monotonic(), [-1.0]

    def report(completed_time: float, total_time: float) -> None:
        first[0] = completed_time if first[0] < 0 else first[0]
        spent = time.monotonic() - started
        time_left = (
            f", {spent * (total_time - completed_time) / (completed_time - first[0]):.0f} s left"
            if completed_time > first[0]
            else ""
        )
        report_progress(
            f"{run_name}: {completed_time:.0f} of {total_time:.0f} s{time_left}",
            begin_share + run_share * completed_time / max(total_time, 1e-9),
        )

    return report


def _add_verdicts(recording_analysis: RecordingAnalysis) -> None:
    """Compare measured check channels with the chosen run, and judge every run."""
    assert recording_analysis.drift is not None
    recording, slopes = recording_analysis.recording, tuple(recording_analysis.scene.hand_on.slopes)
    for name, outcome in recording_analysis.runs.items():
        job = recording_analysis.settings_of_run(name)
        assert isinstance(job, SectionRunSettings)
        comparisons = tuple(compare_channel(recording, outcome, *pair, slopes) for pair in channels_to_compare(job))
        recording_analysis.verdicts[name] = judge_run(
            job,
            outcome,
            recording_analysis.scene.limits,
            recording_analysis.drift.passing_time(recording_analysis.drift.angle) or recording.duration,
            [compared for compared in comparisons if compared.signal.check],
            {s.name: white_noise(recording, s) for s in recording.signals if s.check},
        )
        if name == recording_analysis.chosen_run:
            recording_analysis.channel_comparisons = comparisons


def _add_consequences(recording_analysis: RecordingAnalysis, work_folder: Path) -> None:
    """Compute the effect of each finding on the section forces, and revise the verdicts. The chosen run is used, or the
    free run where the chosen run failed.
    """
    name = (
        recording_analysis.chosen_run
        if recording_analysis.chosen_run in recording_analysis.runs
        and recording_analysis.chosen_run not in recording_analysis.failed
        else FREE_RUN_NAME
    )
    if name in recording_analysis.runs:
        rerun, answers = (
            partial(recording_analysis.rerun, name),
            recording_analysis.forces(recording_analysis.runs[name]),
        )
        recording_analysis.consequences = consequences(
            recording_analysis.findings, recording_analysis.recording, rerun, answers, work_folder / "findings"
        )
        recording_analysis.verdicts = {
            name: judged_by_consequences(verdict, recording_analysis.consequences)
            for name, verdict in recording_analysis.verdicts.items()
        }


def _save_section_forces(
    recording_analysis: RecordingAnalysis, run_outcome: SectionOutcome, output_folder: Path
) -> None:
    """Count the cycles of the section forces, and write the forces in every format of the scene. Existing files of an
    interrupted run are kept.
    """
    answers, settings = recording_analysis.forces(run_outcome), recording_analysis.scene.hand_on
    recording_analysis.counted = {
        answer: counted_load(run_outcome.samples(answer), tuple(settings.slopes)) for answer in answers
    }
    recording_analysis.written_files = tuple(output_folder / f"{FILE_STEM}.{form}" for form in settings.formats)
    formats = [path.suffix[1:] for path in recording_analysis.written_files if not path.exists()]
    run_name, engine = recording_analysis.chosen_run, recording_analysis.engine
    comment = f"{recording_analysis.scene.title}; computed from wheel forces, {run_name} run, {engine}"
    write_section_forces(run_outcome, output_folder, formats, answers, recording_analysis.recording.start, comment)


def _labelled_result(scene: MeasuredScene, recording_analysis: RecordingAnalysis, output_folder: Path) -> Result:
    """Returns the result of a recording's scene; its detail is the ``RecordingAnalysis``."""
    return labelled_result(
        scene,
        recording_analysis.outcome,
        recording_analysis.counted,
        output_folder,
        engine=recording_analysis.engine,
        seconds=recording_analysis.seconds.get("march", 0.0),
        doubts=[finding.text for finding in recording_analysis.findings if finding.weight != "note"],
        detail=recording_analysis,
        run=recording_analysis.chosen_run,
        **_endings_of_runs(recording_analysis),
    )


def _endings_of_runs(recording_analysis: RecordingAnalysis) -> dict[str, str]:
    """Verdicts on the runs and reasons of failures as JSON texts, for the attributes of the result."""
    verdicts = {name: [verdict.word, verdict.reason] for name, verdict in recording_analysis.verdicts.items()}
    return {"verdicts": json.dumps(verdicts), "failed": json.dumps(recording_analysis.failed)}
