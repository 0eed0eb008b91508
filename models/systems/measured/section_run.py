"""The run of a recording: a cut vehicle marched block by block, each ending in a checkpoint from which it goes on.

Only a block is in memory. The state goes from block to block as it is, the stabiliser's filter with it, and inputs are
read alike whatever the block: a run in blocks, or resumed after any interruption, has the bits of a run in one piece.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from models.core.errors import InputError, RunFailed
from models.core.finding import Finding
from models.engines.cut_vehicle import UPRIGHT, HubModel, build, check_step
from models.engines.protocol import SIZE_BOUND
from models.machine.compiled import checksum
from models.measured.columns import Columns
from models.measured.recording import Recording
from models.multibody.cut_table import Drive, table
from models.systems.measured.checkpoint import Checkpoint, digest, digest_of
from models.systems.measured.inputs import Grid, Inputs, Prescribed
from models.systems.measured.sections import Answer, Sections
from models.vehicles.cut_vehicle import PITCH, ROLL, CutVehicle, rigid

if TYPE_CHECKING:
    from models.systems.hub_forces.tilt_filter import TiltFilter

BLOCK = 60.0
"""s of recording between two checkpoints."""
DAMPING = 0.7
"""Of the moment towards the filter's estimate, of the critical one."""
STIFF = 0.1
"""Bandwidth of the pull by the rate of the steps: a stiffer one outruns Runge-Kutta 4."""
Progress = Callable[[float, float], None]


@dataclass(frozen=True)
class Hold:
    """How roll and pitch are held; Hz, rad/s^2, Hz as in the scene's table ``stabilise``.

    Standard deviations of the noise of samples: force (N), moment (N m), angle (rad), rate (rad/s).
    """

    method: Literal["kalman", "prescribed", "none"] = "kalman"
    bandwidth: float = 0.7
    model: float = 10.0
    smoothing: float = 5.0
    force: float = 8.0
    moment: float = 1.0
    angle: float = 1.75e-3
    rate: float = 5e-3


@dataclass(frozen=True)
class SectionRun:
    """A run to be made: ``step`` in s, the recording's period if None; ``file`` is the scene that messages name."""

    vehicle: CutVehicle
    recording: Recording
    sections: Sections
    engine: str = "mujoco"
    hold: Hold = field(default_factory=Hold)
    step: float | None = None
    file: str = ""

    @property
    def grid(self) -> Grid:
        """Steps on the recording's clock."""
        return Grid(self.step or self.recording.period, self.recording.period)

    @property
    def count(self) -> int:
        """Answers of the whole run."""
        return (self.recording.count - 1) // self.grid.skip + 1


@dataclass(frozen=True)
class Outcome:
    """Answers of a run, ``period`` (s) apart, of which ``done`` are there; ``surprise`` of the filter, NaN without,
    and what it says against its measurements."""

    columns: Columns
    answers: tuple[Answer, ...]
    period: float
    done: int
    surprise: float
    findings: tuple[Finding, ...]
    doubts: tuple[str, ...] = ()

    def samples(self, answer: Answer) -> np.ndarray:
        """Samples (done,) of one answer."""
        return self.columns.read(answer.name, 0, self.done)


def check(own: SectionRun) -> None:
    """Refuse what no run can do right, before any is made."""
    own.grid.check(own.file)
    if own.count < 2:
        raise InputError(own.file, "files", None, f"the recording has {own.recording.count} samples: nothing to run")
    check_step(own.engine, own.vehicle, own.grid.step, own.grid.step * own.grid.every)
    if own.hold.method == "kalman" and own.hold.bandwidth * own.grid.step > STIFF:
        raise InputError(
            own.file,
            "stabilise.bandwidth",
            own.hold.bandwidth,
            f"must be at most {STIFF:g} of the rate of the run's steps, {STIFF / own.grid.step:g} Hz",
        )
    used = [signal for signal in own.recording.signals if not signal.check and signal.at == own.vehicle.chassis]
    if own.hold.method != "none" and not any(signal.quantity in ("angle", "angular rate") for signal in used):
        raise InputError(
            own.file,
            "stabilise.method",
            own.hold.method,
            f"needs roll and pitch or their rates at the body {own.vehicle.chassis!r}; 'none' runs without",
        )


def run(own: SectionRun, folder: Path, progress: Progress = lambda done, of: None, block: float = BLOCK) -> Outcome:
    """Run all of a recording, or what is missing of it in ``folder``; ``progress`` is told seconds done and in all.

    ``block`` : s between checkpoints, which changes no bit of the answers. Raises InputError where the folder holds a
    run of other inputs, and RunFailed, whose ``partial`` is the outcome until then, where the vehicle topples.
    """
    check(own)
    march = _March(own, folder, max(round(block / (own.grid.step * own.grid.every)), 1))
    period = own.recording.period * own.grid.skip
    progress(march.done * period, own.recording.duration)
    while march.done < own.count:
        march.advance()
        progress(march.done * period, own.recording.duration)
    return march.outcome()


class _March:
    """A run under way: ``done`` answers are on disk, ``state`` (2 n,) is that of the next one."""

    def __init__(self, own: SectionRun, folder: Path, length: int) -> None:
        self.own, self.length, hold = own, length, own.hold
        self.inputs = Inputs(own.recording, own.vehicle, hold.method == "prescribed")
        self.filter = self._filter() if hold.method == "kalman" else None
        self.prescribed = None
        if hold.method == "prescribed":
            self.prescribed = Prescribed(self.inputs, own.grid, hold.smoothing, own.file)
        folder.mkdir(parents=True, exist_ok=True)
        self._checkpoint = Checkpoint(folder / "run.npz", _inputs_of(own, self.inputs))
        found = self._checkpoint.load()
        self.done, self.state = (0, self._start()) if found is None else (int(found["done"]), found["state"])
        if found is None:
            self._save()
        elif self.filter is not None:
            known = self.filter.state
            self.filter.state = replace(known, **{name: found[name] for name in vars(known)})
        names = tuple(answer.name for answer in own.sections.answers)
        self.columns = Columns(folder / "run.f64", names, own.count)

    def outcome(self) -> Outcome:
        """What there is until now."""
        grid = self.own.grid
        return Outcome(
            self.columns,
            self.own.sections.answers,
            grid.period * grid.skip,
            self.done,
            self.filter.surprise if self.filter else math.nan,
            tuple(self.inputs.findings),
            self.filter.doubts() if self.filter else (),
        )

    def advance(self) -> None:
        """March a block and save it; RunFailed with the outcome until then."""
        grid, last = self.own.grid, self.own.count - 1
        answers = min(self.length, max(last - self.done, 1))
        drive = self._drive(self.done * grid.skip, answers * grid.every)
        model = build(self.own.engine, self.own.vehicle, drive, grid.step, answers * grid.every * grid.step)
        states, failure = self._marched(model)
        ends = self.done + answers >= last
        kept = states[:: grid.every] if failure or ends else states[: -1 : grid.every]
        self.columns.write(self.done, self.own.sections.read(model.numbers, kept, 2 * grid.every))
        self.done, self.state = self.done + len(kept), states[-1].copy()
        if failure is not None:
            failure.partial = self.outcome()
            raise failure
        self._save()

    def _marched(self, model: HubModel) -> tuple[np.ndarray, RunFailed | None]:
        """States of a block until its end or until the vehicle topples, and the failure that says when."""
        began, steps = self.done * self.own.grid.period * self.own.grid.skip, model.steps
        try:
            states = model.marched(*np.split(self.state, 2))
        except RunFailed as error:
            states = self._until(model, error)
        n = self.own.vehicle.size
        inside = np.delete(np.arange(2 * n), [0, 1, 2, 3])  # where it is and where it heads may be anything
        toppled = np.abs(states[:, [ROLL, PITCH]]).max(axis=1) > UPRIGHT
        bad = toppled | ~np.isfinite(states).all(axis=1) | (np.abs(states[:, inside]) > SIZE_BOUND).any(axis=1)
        if not bad.any() and len(states) == steps + 1:
            return states, None
        good = int(np.argmax(bad)) if bad.any() else len(states)
        reason = (
            f"the vehicle topples: roll or pitch beyond {UPRIGHT} rad"
            if good < len(states) and toppled[good]
            else "the state became infinite or not a number"
        )
        states = states[: max(good, 1)]
        at = began + (len(states) - 1) * self.own.grid.step
        return states, RunFailed(self.own.engine, reason, at, states[-1])

    def _until(self, model: HubModel, error: RunFailed) -> np.ndarray:
        """States of a block that the engine gave up: the longest part, by halves, that it can march."""
        good, bad, states = 0, model.steps, self.state[None]
        while bad - good > 1:
            model.steps = (good + bad) // 2
            try:
                found = model.marched(*np.split(self.state, 2))
                good, states = model.steps, found
            except RunFailed:
                bad = model.steps
        return states

    def _drive(self, first: int, steps: int) -> Drive:
        """What drives the vehicle from a sample on."""
        own, grid, rows = self.own, self.own.grid, 2 * steps + 1
        samples = math.floor((rows - 1) * grid.part) + 2
        wrenches = self.inputs.around(first, samples)
        drive = Drive(grid.cubic(wrenches, rows), self.inputs.frame)
        if self.prescribed is not None:
            return Drive(drive.hubs, drive.frame, guide=self.prescribed.rows(first, rows))
        if self.filter is None:
            return drive
        used = math.floor((rows - 1) * grid.part) + 1
        tilt, _ = self.filter.advance(wrenches[1 : used + 1], self.inputs.tilt(first, used))
        guide = np.hstack([grid.rows(tilt, rows), np.zeros((rows, 2))])
        corner, (roll, pitch, _) = 2 * math.pi * own.hold.bandwidth, np.diag(rigid(own.vehicle).inertia)
        pull = (roll * corner**2, 2 * DAMPING * roll * corner, pitch * corner**2, 2 * DAMPING * pitch * corner)
        return Drive(drive.hubs, drive.frame, guide=guide, pull=pull)

    def _start(self) -> np.ndarray:
        """At rest in the design position; where roll and pitch are held, these and their rates as measured."""
        state, n = np.zeros(2 * self.own.vehicle.size), self.own.vehicle.size
        if self.prescribed is not None:
            state[[ROLL, PITCH, n + ROLL, n + PITCH]] = self.prescribed.rows(0, 1)[0, :4]
        elif self.filter is not None:
            state[[ROLL, PITCH, n + ROLL, n + PITCH]] = np.nan_to_num(self.inputs.tilt(0, 1)[0])
        return state

    def _filter(self) -> "TiltFilter":
        from models.systems.hub_forces.tilt_filter import TiltFilter

        own, hold = self.own, self.own.hold
        deviations = np.tile(np.repeat([hold.force, hold.moment], 3), len(own.vehicle.hubs))
        return TiltFilter(
            own.vehicle,
            self.inputs.frame,
            own.recording.period,
            deviations,
            (hold.angle, hold.rate),
            hold.model,
            own.file,
        )

    def _save(self) -> None:
        known = vars(self.filter.state) if self.filter else {}
        self._checkpoint.save(done=np.array(self.done), state=self.state, **known)


def _inputs_of(own: SectionRun, inputs: Inputs) -> dict[str, str]:
    """What decides the bits of a run, by names that a user understands."""
    library = {"reference": "numpy"}.get(own.engine, own.engine)
    sources = [checksum(Path(__file__).parents[2] / folder) for folder in ("multibody", "systems/measured", "measured")]
    idle = np.zeros((1, 6 * len(inputs.hubs)))
    vehicle = digest(table(own.vehicle, Drive(idle), own.grid.step), own.vehicle.tree.coordinates())
    return {
        "vehicle": vehicle,
        "recording": digest_of(own.recording, inputs.used),
        "stabiliser": repr(own.hold),
        "engine": f"{own.engine} {version(library)}",
        "step": repr(own.grid.step),
        "list of sections": digest(own.sections.answers, own.sections.frame),
        "version": f"{version('twinrig')} {sources}",
    }
