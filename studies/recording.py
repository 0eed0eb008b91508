"""From an engineer's measurement files to section forces: read, checked, predicted, run, judged, handed on, a page."""

import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from models.core.errors import InputError, RunFailed
from models.core.finding import Finding, gathered, queries
from models.core.strict import Strict, read
from models.core.systems import load
from models.drift.score import Verdict, rms
from models.fatigue.counting import Counted, count
from models.measured.checks import findings as findings_of
from models.measured.checks.evidence import Evidence
from models.measured.checks.noise_floor import noise
from models.measured.checks.place import Place
from models.measured.checks.weight import moments
from models.measured.recording import Recording
from models.measured.signal import Signal
from models.multibody.cut_kernel import WRENCH
from models.systems.measured import plan
from models.systems.measured.clock import record
from models.systems.measured.comparison import Compared, checks, compare
from models.systems.measured.consequences import Consequence, consequences, judged, told
from models.systems.measured.hand_on import NAME, forces, hand_on
from models.systems.measured.hold_of import NOISE, hold_of, noise_of
from models.systems.measured.pattern import write_pattern
from models.systems.measured.rig import Rig
from models.systems.measured.scene import MeasuredScene
from models.systems.measured.section_run import Hold, Outcome, SectionRun
from models.systems.measured.section_run import check as check_run
from models.systems.measured.section_run import run as march
from models.systems.measured.sections import Answer, Sections, points
from models.systems.measured.trust import Drift, Level, drift
from models.systems.measured.verdict import judge, surprised
from models.systems.measured.virtual import VirtualMeasurement, virtual_measurement
from models.systems.pitch_plane.trust import ANGLE, Trust
from models.vehicles.cut_vehicle import CutVehicle

if TYPE_CHECKING:
    from models.systems.measured.pitch_plane import PlaneJob

SYSTEM = "measured"
BLOCKS = "work"
"""Folder of what a killed run goes on with: samples on one clock, and runs with their checkpoints."""
FREE = "free"
Progress = Callable[[str, float], None]


class Options(Strict):
    """[options] of this study: none."""


@dataclass
class Found:
    """What there is of a recording, in the order in which it was found; what was not reached is empty."""

    scene: MeasuredScene
    rig: Rig
    engine: str
    recording: Recording
    evidence: Evidence
    virtual: VirtualMeasurement | None = None
    findings: tuple[Finding, ...] = ()
    drift: Drift | None = None
    trust: tuple[tuple[str, Trust], ...] = ()
    runs: dict[str, Outcome] = field(default_factory=dict)
    verdicts: dict[str, Verdict] = field(default_factory=dict)
    consequences: tuple[Consequence, ...] = ()
    compared: tuple[Compared, ...] = ()
    handed: tuple[Path, ...] = ()
    failed: dict[str, str] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def stopped(self) -> bool:
        """Whether an error in the recording forbids a run."""
        return any(finding.weight == "error" for finding in self.findings)

    @property
    def chosen(self) -> str:
        """The run that is handed on: with the stabiliser, or free where the scene names none."""
        return FREE if self.scene.stabilise.method == "none" else self.scene.stabilise.method

    @property
    def held(self) -> Outcome | None:
        """The same; None where none was made."""
        return self.runs.get(self.chosen)

    def put_in(self, signal: Signal) -> bool:
        """Whether a signal drives or holds the vehicle; all others are compared with."""
        moving = signal.at == self.rig.chassis and signal.quantity in ("angle", "angular rate")
        return not signal.check and (signal.at in self.rig.hubs or (moving and self.chosen != FREE))

    def counted(self, run: Outcome, answer: Answer) -> Counted:
        """Damage, level crossings and range pairs of one answer of a run."""
        return count(run.samples(answer), tuple(self.scene.hand_on.slopes))


def check(scene: MeasuredScene, engines: tuple[str, ...]) -> None:
    """Refuse options: there are none."""
    read(Options, scene.options, scene.file, "options")


def run(scene: MeasuredScene, engines: tuple[str, ...], folder: Path, progress: Progress) -> dict[str, Any]:
    """Do all of it; the page is written even where errors in the recording stop the run."""
    from studies.recording_page import write

    found = compute(scene, engines[-1], folder, progress)
    page = write(found, folder / "recording.html")
    return {
        "scene": found.scene.title,
        "folder": str(folder),
        "failed": _failed(found),
        "page": str(page),
        "verdicts": {name: [own.word, own.reason] for name, own in found.verdicts.items()},
        "effects": [str(one) for one in found.consequences],
        "findings": queries(finding for finding in found.findings if finding.weight != "note"),
        "doubts": sum(finding.weight == "doubt" for finding in found.findings),
        "channels": _sizes(found),
        "table": [*_told(found), f"  the page: {page}"],
    }


def compute(scene: MeasuredScene, engine: str, folder: Path, progress: Progress = lambda text, part: None) -> Found:
    """All but the page; raises InputError for files that cannot be read."""
    work, rig, watch, virtual = folder / BLOCKS, scene.rig(), _Watch(), None
    work.mkdir(parents=True, exist_ok=True)
    if scene.virtual is not None and rig.vehicle is not None:
        progress("virtual measurement", 0.0)
        virtual = virtual_measurement(rig.vehicle, scene.virtual, engine, scene.file)
        scene = _written(scene, virtual, folder)
        watch.lap("virtual measurement")
    recording = _read(scene, scene.rig(), work, progress)
    watch.lap("reading")
    evidence = Evidence(recording, rig.vehicle, _places(scene), _claimed(scene, recording), scene.plane())
    found = Found(scene, rig, engine, recording, evidence, virtual, seconds=watch.seconds)
    progress("checks", 0.2)
    found.findings = findings_of(evidence)
    watch.lap("checks")
    if not found.stopped:
        (_in_space if rig.vehicle else _in_plane)(found, work, progress)
        watch.lap("runs")
        if found.held is not None:
            said = {(finding.check, finding.signals, finding.place) for finding in found.findings}
            found.findings += tuple(f for f in found.held.findings if (f.check, f.signals, f.place) not in said)
            found.findings += surprised(found.held)
        progress("what the findings do", 0.9)
        _weighed(found, work)
        watch.lap("what the findings do")
        if found.held is not None:
            progress("files", 0.95)
            _handed(found, folder)
            watch.lap("files")
    return found


def _in_space(found: Found, work: Path, progress: Progress) -> None:
    """Predict, run and judge a vehicle in space."""
    found.drift = _predicted(found)
    lacking = found.evidence.lacking
    rest = f"not checked: whether a channel is late; this needs {lacking}" if lacking else ""
    found.trust = tuple(
        (what, replace(found.drift.trust(angle), unchecked=rest))
        for what, angle in (("section forces", None), ("motion", ANGLE))
    )
    _run(found, work, progress)
    _judged(found)


def _in_plane(found: Found, work: Path, progress: Progress) -> None:
    """Predict, run and judge the pitch plane."""
    from models.systems.measured.pitch_plane import run as run_plane

    for i, name in enumerate(_holds(found)):
        progress(f"{name} run", 0.2 + 0.35 * i)
        try:
            own = run_plane(_plane_job(found, name), _fresh(work / name), found.scene.limits)
        except RunFailed as error:
            found.failed[name] = str(error)
            continue
        found.runs[name], found.verdicts[name] = own.outcome, own.verdict
        if name == FREE and own.trust is not None:
            found.trust = (("pitch", own.trust),)


def _plane_job(found: Found, name: str) -> "PlaneJob":
    """A run of the pitch plane to be made."""
    from models.systems.measured.pitch_plane import PlaneJob

    assert found.scene.vehicle.parameters is not None
    return PlaneJob(
        found.recording,
        found.scene.vehicle.parameters,
        found.engine,
        _holds(found)[name],
        found.scene.run.step,
        found.scene.file,
    )


def _fresh(folder: Path) -> Path:
    """A run of the pitch plane takes seconds: what a killed one has left is made anew."""
    shutil.rmtree(folder, ignore_errors=True)
    return folder


def _written(scene: MeasuredScene, virtual: VirtualMeasurement, folder: Path) -> MeasuredScene:
    """The scene that reads the virtual measurement's file, which is written unless a killed run has done so."""
    assert scene.virtual is not None
    path = folder / "scene.toml"
    if not path.is_file():
        write_pattern(scene, virtual, virtual.samples(scene.virtual.faults, scene.virtual.seed), folder)
    return load(path)


def _read(scene: MeasuredScene, rig: Rig, work: Path, progress: Progress) -> Recording:
    sources = plan.opened(scene)
    signals = plan.mapped(scene, sources, rig)
    return record(scene, sources, signals, rig.hubs, work, lambda text, part: progress(text, 0.2 * part))


def _places(scene: MeasuredScene) -> dict[str, Place]:
    """Where sensors sit."""
    return {name: Place(s.body, (s.position[0], s.position[1], s.position[2])) for name, s in scene.sensors.items()}


def _claimed(scene: MeasuredScene, recording: Recording) -> dict[str, float]:
    """Noise that the scene states, by signal."""
    stated = {quantity: getattr(scene.noise, key) for key, quantity in NOISE.items()}
    return {s.name: stated[s.quantity] for s in recording.signals if stated.get(s.quantity) is not None}


def _predicted(found: Found) -> Drift:
    """Drift of the free run, which begins level and at rest, from the noise and from how the vehicle really began."""
    own, chassis, vehicle = found.recording, found.rig.chassis, _vehicle(found)
    noise = noise_of(found.scene.noise, own)
    tilt, rate = (
        (_began(own, what, "roll", chassis), _began(own, what, "pitch", chassis)) for what in ("angle", "angular rate")
    )
    frame = next(s.frame for s in own.signals if s.at in vehicle.hubs)
    level = Level(noise["force"], noise["moment"], _bias(found), tilt, rate)
    return drift(vehicle, level, own.period, own.duration, frame)


def _bias(found: Found) -> np.ndarray | None:
    """Moments that the motion does not bear out, as a couple at the first hub (6 h,); None where there are none."""
    couple = moments(found.evidence)
    if not couple.any():
        return None
    return np.concatenate([np.zeros(3), couple, np.zeros(WRENCH * len(_vehicle(found).hubs) - 5)])


def _began(own: Recording, what: str, axis: str, chassis: str) -> float:
    """Mean (rad, rad/s) of the first tenth of a second of an angle or a rate; 0 where it is not measured."""
    values = [own.columns.read(s.name, 0, max(round(0.1 / own.period), 1)) for s in own.find(what, chassis, axis)[:1]]
    return float(np.nanmean(values[0])) if values and np.isfinite(values[0]).any() else 0.0


def _run(found: Found, work: Path, progress: Progress) -> None:
    """Free, and with the stabiliser that the scene names; a run that fails keeps what it has."""
    holds = _holds(found)
    for name in holds:
        check_run(_job(found, name))
    for i, name in enumerate(holds):
        told = _left(f"{name} run", progress, 0.2 + 0.7 * i / len(holds), 0.7 / len(holds))
        try:
            found.runs[name] = march(_job(found, name), work / name, told)
        except RunFailed as error:
            found.failed[name] = str(error)
            if isinstance(error.partial, Outcome):
                found.runs[name] = error.partial
        except InputError as error:  # what the filter refuses, the findings may explain
            if all(finding.weight == "note" for finding in found.findings):
                raise
            found.failed[name] = str(error)


def _holds(found: Found) -> dict[str, Hold]:
    """How each run is held."""
    held = hold_of(found.scene, found.recording)
    free = replace(Hold("none"), force=held.force, moment=held.moment, angle=held.angle, rate=held.rate)
    return {FREE: free} if held.method == "none" else {FREE: free, held.method: held}


def _vehicle(found: Found) -> CutVehicle:
    assert found.rig.vehicle is not None
    return found.rig.vehicle


def _job(found: Found, name: str) -> SectionRun:
    """A run to be made; answers at the sections of the scene, in the chassis' axes, and at accelerometers."""
    own, vehicle = found.recording, _vehicle(found)
    sections = Sections(vehicle, points=points(vehicle, own.signals, _places(found.scene)))
    return SectionRun(vehicle, own, sections, found.engine, _holds(found)[name], found.scene.run.step, found.scene.file)


def _judged(found: Found) -> None:
    """Check channels beside the run that is handed on, and the verdict on every run."""
    assert found.drift is not None
    slopes, own = tuple(found.scene.hand_on.slopes), found.recording
    for name, run in found.runs.items():
        beside = tuple(compare(own, run, *pair, slopes) for pair in checks(_job(found, name)))
        found.verdicts[name] = judge(
            run,
            _vehicle(found),
            _holds(found)[name],
            own.period,
            found.scene.limits,
            found.drift.passes(found.drift.angle) or own.duration,
            [one for one in beside if one.signal.check],
            {s.name: noise(own, s) for s in own.signals if s.check},
        )
        if name == found.chosen:
            found.compared = beside


def _weighed(found: Found, work: Path) -> None:
    """What the findings do to the section forces that are handed on, and the verdicts that follow from it: by the run
    with the stabiliser, or by the free one where that failed."""
    name = found.chosen if found.chosen in found.runs and found.chosen not in found.failed else FREE
    if name not in found.runs:
        return
    make = _make_in_space if found.rig.vehicle else _make_in_plane
    found.consequences = consequences(
        found.findings,
        found.recording,
        partial(make, found, name),
        handed_on(found, found.runs[name]),
        work / "findings",
    )
    found.verdicts = {name: judged(verdict, found.consequences) for name, verdict in found.verdicts.items()}


def _make_in_space(found: Found, name: str, recording: Recording, folder: Path) -> Outcome:
    """A run of another recording, held as the one of this name."""
    return march(replace(_job(found, name), recording=recording), folder / "run")


def _make_in_plane(found: Found, name: str, recording: Recording, folder: Path) -> Outcome:
    from models.systems.measured.pitch_plane import run as run_plane

    return run_plane(replace(_plane_job(found, name), recording=recording), folder / "run").outcome


def _handed(found: Found, folder: Path) -> None:
    """Section forces into files, in every format that the scene names; those of a killed run are left."""
    assert found.held is not None
    formats = [each for each in found.scene.hand_on.formats if not (folder / f"{NAME}.{each}").exists()]
    comment = f"{found.scene.title}; computed from wheel forces, {found.chosen} run, {found.engine}"
    hand_on(found.held, folder, formats, handed_on(found, found.held), found.recording.start, comment)
    found.handed = tuple(folder / f"{NAME}.{each}" for each in found.scene.hand_on.formats)


def handed_on(found: Found, run: Outcome) -> list[Answer]:
    """Forces and moments of the sections that the scene names, all if none."""
    wanted = found.scene.hand_on.sections
    return [answer for answer in forces(run.answers) if wanted is None or answer.section in wanted]


def _sizes(found: Found) -> dict[str, Any]:
    """Largest magnitude and rms of what is handed on: what a sweep draws."""
    if found.held is None:
        return {}
    answers = handed_on(found, found.held)  # of an hour only one at a time is in memory
    return {
        answer.name: {"unit": answer.unit, "max": float(np.abs(values).max()), "rms": rms(values)}
        for answer, values in zip(answers, map(found.held.samples, answers), strict=True)
    }


def _left(name: str, progress: Progress, begin: float, share: float) -> Callable[[float, float], None]:
    """Progress of a run with the time that it will still take."""
    started, first = time.monotonic(), [-1.0]

    def told(done: float, whole: float) -> None:
        first[0] = done if first[0] < 0 else first[0]
        spent = time.monotonic() - started
        left = f", {spent * (whole - done) / (done - first[0]):.0f} s left" if done > first[0] else ""
        progress(f"{name}: {done:.0f} of {whole:.0f} s{left}", begin + share * done / max(whole, 1e-9))

    return told


class _Watch:
    """Seconds of each part."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        now = time.perf_counter()
        self.seconds[name], self._last = now - self._last, now


def _failed(found: Found) -> dict[str, str]:
    """What makes the command end with 1: errors in the recording, or a failed run of what was to be handed on."""
    if found.stopped:
        count = sum(finding.weight == "error" for finding in found.findings)
        return {"checks": f"{count} error(s) in the recording: nothing was run"}
    return {name: text for name, text in found.failed.items() if name == found.scene.stabilise.method}


def _told(found: Found) -> list[str]:
    """Lines for the terminal: findings that matter, and how the runs ended."""
    lines = [f"  {finding.weight}: {finding.text}" for finding in gathered(found.findings) if finding.weight != "note"]
    notes = sum(finding.weight == "note" for finding in found.findings)
    lines.append(f"  {notes} notes say what was looked at and found good, or could not be looked at: see the page")
    lines += [f"  {what} of the free run: {own}" for what, own in found.trust]
    for name, outcome in found.runs.items():
        end = found.failed.get(name, "to the end")
        lines.append(f"  {name} run: {outcome.period * (outcome.done - 1):.6g} s, {end}")
    lines += [f"  effect of {text}" for text in told(found.consequences)]
    lines += [f"  verdict on the {name} run: {own.word} ({own.reason})" for name, own in found.verdicts.items()]
    return lines


if __name__ == "__main__":
    from studies.command_line import study

    study("recording")
