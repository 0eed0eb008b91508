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
from models.systems.measured.hand_on import FILE_STEM, forces, hand_on, labelled_result
from models.systems.measured.holds import FREE_RUN, QUANTITY_OF_NOISE_KEY, stabilisers_of_runs
from models.systems.measured.pitch_plane import PlaneJob
from models.systems.measured.pitch_plane import run as run_plane
from models.systems.measured.plan import opened_files, signals_of_files
from models.systems.measured.scene import MeasuredScene, Rig
from models.systems.measured.section_run import AttitudeHold, SectionOutcome, SectionRun
from models.systems.measured.section_run import check as check_run
from models.systems.measured.section_run import run as march
from models.systems.measured.sections import SectionChannel, Sections, accelerometer_points
from models.systems.measured.trust import Drift, MeasurementErrors, predicted_drift
from models.systems.measured.verdict import ChannelComparison, channels_to_compare, compare, filter_doubts, judge
from models.systems.measured.virtual import VirtualMeasurement, virtual_measurement, write_pattern
from models.systems.pitch_plane.trust import UNTRUSTED_PITCH, Trust
from models.vehicles.cut_vehicle import CutVehicle

WORK_FOLDER = "work"
"""Folder from which an interrupted run is resumed: resampled recording, and runs with their checkpoints."""


@dataclass
class Examination:
    """Everything that is computed for a recording, in the order of computation; fields that were not reached are empty.

    scene : scene that reads the files, also of a virtual measurement; holds : stabiliser of each run, by name;
    seconds : of each stage; plane : result of the chosen run in the pitch plane; counted : section forces that are
    written, with their cycle counts; temporary_folder : folder of all files, None in a user's folder.
    """

    scene: MeasuredScene
    rig: Rig
    engine: str
    recording: Recording
    virtual: VirtualMeasurement | None
    holds: dict[str, AttitudeHold]
    findings: tuple[Finding, ...] = ()
    drift: Drift | None = None
    trust: tuple[tuple[str, Trust], ...] = ()
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
    def evidence(self) -> CheckedRecording:
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
        return not signal.check and (signal.at in self.rig.hubs or (moving and self.chosen_run != FREE_RUN))

    def forces(self, outcome: SectionOutcome) -> list[SectionChannel]:
        """Channels of section forces and moments of a run at the scene's sections, or at all sections if the scene
        names none.
        """
        wanted = self.scene.hand_on.sections
        return [answer for answer in forces(outcome.answers) if wanted is None or answer.section in wanted]

    def job(self, name: str, recording: Recording | None = None) -> SectionRun | PlaneJob:
        """Returns the settings of a run by its name, also for another recording. The run computes forces at all
        sections in axes of the chassis, and accelerations at accelerometers.
        """
        recording, vehicle = recording or self.recording, self.rig.vehicle
        settings = self.engine, self.holds[name], self.scene.run.step, self.scene.file
        if vehicle is None:
            return PlaneJob(recording, self.rig.name, *settings)
        sections = Sections(vehicle, points=accelerometer_points(vehicle, recording.signals, self.scene.places))
        return SectionRun(vehicle, recording, sections, *settings)

    def march(
        self,
        name: str,
        folder: Path,
        progress: Callable[[float, float], None] = report_no_progress,
        error: bool = False,
    ) -> SectionOutcome:
        """Make a run by its name, or complete the run in a folder. error : whether the error of a run in the pitch
        plane is estimated.
        """
        job = self.job(name)
        if isinstance(job, SectionRun):
            return march(job, folder, progress)
        shutil.rmtree(folder, ignore_errors=True)  # a run of seconds: what a killed one has left is made anew
        run = run_plane(job, folder, self.scene.limits, error and name == self.chosen_run)
        self.verdicts[name], self.plane = run.verdict, run.result
        if name == FREE_RUN and run.trust is not None:
            self.trust = (("pitch", run.trust),)
        return run.outcome

    def rerun(self, name: str, recording: Recording, folder: Path) -> SectionOutcome:
        """Run another recording with the stabiliser of a run, given by its name."""
        job = self.job(name, recording)
        return march(job, folder / "run") if isinstance(job, SectionRun) else run_plane(job, folder / "run").outcome


def run(
    scene: MeasuredScene,
    engine: str = "",
    folder: Path | None = None,
    progress: Progress = report_no_progress,
    whole_run: bool = False,
    error: bool = False,
) -> Result:
    """Run a recording with the scene's stabiliser; the result's detail is the Examination.

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
        exam.runs[exam.chosen_run] = exam.march(exam.chosen_run, folder / WORK_FOLDER / exam.chosen_run, error=error)
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


def _with_assumptions(run: Result, examination: Examination) -> Result:
    """Returns the result with its assumptions and the broken ones; in the pitch plane together with the assumptions of
    the pitch-plane run.
    """
    if examination.outcome is None:
        return run
    with_assumptions(run, assumptions(examination.scene, examination.rig.vehicle, examination))
    if examination.plane is not None:
        stated_here, stated_by_run = (json.loads(each.data.attrs["assumptions"]) for each in (run, examination.plane))
        run.data.attrs["assumptions"] = json.dumps(
            {key: [*stated_by_run[key], *stated_here[key]] for key in stated_here}
        )
        run.data.attrs["error"] = examination.plane.data.attrs["error"]
    return run


def _with_error(run: Result, examination: Examination, work: Path) -> Result:
    """Returns the result with the errors of the time steps of the chosen run."""
    job, outcome = examination.job(examination.chosen_run), examination.outcome
    if outcome is None or not isinstance(job, SectionRun):
        return run
    if examination.chosen_run in examination.failed:
        return not_estimated(run, f"the run did not end: {examination.failed[examination.chosen_run]}")
    earlier_errors = examination.virtual.errors if examination.virtual is not None else {}
    try:
        errors = errors_of_steps(job, outcome, earlier_errors, work)
    except (InputError, RunFailed) as failure:
        return not_estimated(run, f"a part of it, in half the step, did not end: {failure}")
    return with_stated_errors(run, errors, "a part from the middle, in its steps and in half of them")


def _start_examination(scene: MeasuredScene, engine: str, folder: Path, progress: Progress, error: bool) -> Examination:
    """Start an examination: resample the recording from the scene's files, or from those of a virtual measurement."""
    rig, virtual, seconds, start_time = scene.rig(), None, dict[str, float](), time.perf_counter()
    (folder / WORK_FOLDER).mkdir(parents=True, exist_ok=True)
    if scene.virtual is not None and rig.vehicle is not None:
        progress("virtual measurement", 0.0)
        virtual = virtual_measurement(rig.vehicle, scene.virtual, engine, scene.file, error)
        if not (folder / "scene.toml").is_file():  # else a killed run has written it
            write_pattern(scene, virtual, virtual.samples(scene.virtual.faults, scene.virtual.seed), folder)
        scene = load(folder / "scene.toml")
        seconds["virtual measurement"] = time.perf_counter() - start_time
    recording = read_files(scene, folder / WORK_FOLDER, lambda text, part: progress(text, 0.2 * part))
    exam = Examination(scene, rig, engine, recording, virtual, stabilisers_of_runs(scene, recording), seconds=seconds)
    _record_seconds(exam, "reading", start_time)
    return exam


def read_files(scene: MeasuredScene, folder: Path, progress: Progress = report_no_progress) -> Recording:
    """Reads the files of a scene as a recording with common sample times, stored in a folder. Raises InputError for
    unusable files.
    """
    sources, rig = opened_files(scene), scene.rig()
    return record_on_clock(scene, sources, signals_of_files(scene, sources, rig), rig.hubs, folder, progress)


def _record_seconds(examination: Examination, stage: str, start_time: float) -> None:
    """Record the seconds of a stage that has ended: time since ``start_time`` less the seconds of earlier stages."""
    examination.seconds[stage] = time.perf_counter() - start_time - sum(examination.seconds.values())


def _examine(examination: Examination, folder: Path, progress: Progress, error: bool) -> None:
    """Check the recording, predict the drift, make the runs, judge them, and write section forces to files; stops after
    the checks if these find an error.
    """
    lap = partial(_record_seconds, examination, start_time=time.perf_counter() - sum(examination.seconds.values()))
    progress("checks", 0.2)
    examination.findings = findings_of_all_checks(examination.evidence)
    lap("checks")
    if examination.has_error_findings:
        return
    if examination.rig.vehicle is not None:
        _predict_drift(examination, examination.rig.vehicle)
    _make_runs(examination, folder / WORK_FOLDER, progress, error)
    if examination.rig.vehicle is not None:
        _add_verdicts(examination)
    lap("runs")
    if examination.outcome is not None:
        named = {(finding.check, finding.signals, finding.place) for finding in examination.findings}
        examination.findings += tuple(
            f for f in examination.outcome.findings if (f.check, f.signals, f.place) not in named
        )
        examination.findings += filter_doubts(examination.outcome)
    progress("what the findings do", 0.9)
    _add_consequences(examination, folder / WORK_FOLDER)
    lap("what the findings do")
    if examination.outcome is not None:
        progress("files", 0.95)
        _save_section_forces(examination, examination.outcome, folder)
        lap("files")


def _predict_drift(examination: Examination, vehicle: CutVehicle) -> None:
    """Predict the drift of the free run, which begins level and at rest: from noise, from mean moments that contradict
    the motion, and from the measured initial tilt and rates.
    """
    recording, free = examination.recording, examination.holds[FREE_RUN]
    tilt, rate = (
        [_initial_value(recording, what, axis, vehicle.chassis) for axis in ("roll", "pitch")]
        for what in ("angle", "angular rate")
    )
    couple = mean_hub_moments(examination.evidence)  # that the motion does not bear out, at the first hub
    bias = np.concatenate([np.zeros(3), couple, np.zeros(WRENCH * len(vehicle.hubs) - 5)]) if couple.any() else None
    frame = next(s.frame for s in recording.signals if s.at in vehicle.hubs)
    level = MeasurementErrors(free.force, free.moment, bias, tilt, rate)
    examination.drift = predicted_drift(vehicle, level, recording.period, recording.duration, frame)
    lacking = examination.evidence.missing_data_text
    unchecked_text = f"not checked: whether a channel is late; this needs {lacking}" if lacking else ""
    examination.trust = tuple(
        (what, replace(examination.drift.trust(angle), unchecked_text=unchecked_text))
        for what, angle in (("section forces", None), ("motion", UNTRUSTED_PITCH))
    )


def _initial_value(recording: Recording, quantity: str, axis: str, chassis: str) -> float:
    """Mean of an angle (rad) or a rate (rad/s) over the first 0.1 s of a recording; 0 where it is not measured."""
    for signal in recording.find_signals(quantity, chassis, axis)[:1]:
        values = recording.columns.read(signal.name, 0, max(round(0.1 / recording.period), 1))
        return float(np.nanmean(values)) if np.isfinite(values).any() else 0.0
    return 0.0


def _make_runs(examination: Examination, work: Path, progress: Progress, error: bool) -> None:
    """Make the free run and the run with the scene's stabiliser; a run that fails keeps its samples up to the
    failure."""
    for name in examination.holds:
        if isinstance(job := examination.job(name), SectionRun):
            check_run(job)
    for i, name in enumerate(examination.holds):
        progress(f"{name} run", 0.2 + 0.7 * i / len(examination.holds))
        progress_of_run = _with_time_left(
            f"{name} run", progress, 0.2 + 0.7 * i / len(examination.holds), 0.7 / len(examination.holds)
        )
        try:
            examination.runs[name] = examination.march(name, work / name, progress_of_run, error)
        except RunFailed as error:
            examination.failed[name] = str(error)
            if isinstance(error.partial, SectionOutcome):
                examination.runs[name] = error.partial
        except InputError as error:  # what the filter refuses, the findings may explain
            if examination.rig.vehicle is None or all(finding.weight == "note" for finding in examination.findings):
                raise
            examination.failed[name] = str(error)


def _with_time_left(name: str, progress: Progress, begin: float, share: float) -> Callable[[float, float], None]:
    """Returns a progress callback of a run that adds an estimate of the remaining time."""
    started, first = time.monotonic(), [-1.0]

    def report(completed: float, total: float) -> None:
        first[0] = completed if first[0] < 0 else first[0]
        spent = time.monotonic() - started
        time_left = (
            f", {spent * (total - completed) / (completed - first[0]):.0f} s left" if completed > first[0] else ""
        )
        progress(f"{name}: {completed:.0f} of {total:.0f} s{time_left}", begin + share * completed / max(total, 1e-9))

    return report


def _add_verdicts(examination: Examination) -> None:
    """Compare measured check channels with the chosen run, and judge every run."""
    assert examination.drift is not None
    recording, slopes = examination.recording, tuple(examination.scene.hand_on.slopes)
    for name, outcome in examination.runs.items():
        job = examination.job(name)
        assert isinstance(job, SectionRun)
        comparisons = tuple(compare(recording, outcome, *pair, slopes) for pair in channels_to_compare(job))
        examination.verdicts[name] = judge(
            job,
            outcome,
            examination.scene.limits,
            examination.drift.passing_time(examination.drift.angle) or recording.duration,
            [compared for compared in comparisons if compared.signal.check],
            {s.name: white_noise(recording, s) for s in recording.signals if s.check},
        )
        if name == examination.chosen_run:
            examination.channel_comparisons = comparisons


def _add_consequences(examination: Examination, work: Path) -> None:
    """Compute the effect of each finding on the section forces, and revise the verdicts. The chosen run is used, or the
    free run where the chosen run failed.
    """
    name = (
        examination.chosen_run
        if examination.chosen_run in examination.runs and examination.chosen_run not in examination.failed
        else FREE_RUN
    )
    if name in examination.runs:
        rerun, answers = partial(examination.rerun, name), examination.forces(examination.runs[name])
        examination.consequences = consequences(
            examination.findings, examination.recording, rerun, answers, work / "findings"
        )
        examination.verdicts = {
            name: judged_by_consequences(verdict, examination.consequences)
            for name, verdict in examination.verdicts.items()
        }


def _save_section_forces(examination: Examination, outcome: SectionOutcome, folder: Path) -> None:
    """Count the cycles of the section forces, and write the forces in every format of the scene. Existing files of an
    interrupted run are kept.
    """
    answers, settings = examination.forces(outcome), examination.scene.hand_on
    examination.counted = {answer: counted_load(outcome.samples(answer), tuple(settings.slopes)) for answer in answers}
    examination.written_files = tuple(folder / f"{FILE_STEM}.{form}" for form in settings.formats)
    formats = [path.suffix[1:] for path in examination.written_files if not path.exists()]
    comment = (
        f"{examination.scene.title}; computed from wheel forces, {examination.chosen_run} run, {examination.engine}"
    )
    hand_on(outcome, folder, formats, answers, examination.recording.start, comment)


def _labelled_result(scene: MeasuredScene, examination: Examination, folder: Path) -> Result:
    """Returns the result of a recording's scene; its detail is the examination."""
    return labelled_result(
        scene,
        examination.outcome,
        examination.counted,
        folder,
        engine=examination.engine,
        seconds=examination.seconds.get("march", 0.0),
        doubts=[finding.text for finding in examination.findings if finding.weight != "note"],
        detail=examination,
        run=examination.chosen_run,
        **_endings_of_runs(examination),
    )


def _endings_of_runs(examination: Examination) -> dict[str, str]:
    """Verdicts on the runs and reasons of failures as JSON texts, for the attributes of the result."""
    verdicts = {name: [verdict.word, verdict.reason] for name, verdict in examination.verdicts.items()}
    return {"verdicts": json.dumps(verdicts), "failed": json.dumps(examination.failed)}
