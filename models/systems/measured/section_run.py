"""Run of a recording on a spatial vehicle without tyres, block by block; each block ends with a checkpoint.

Only a block is in memory. The state and the stabiliser's filter are passed from block to block, and inputs do not
depend on the blocks: a run in blocks, or resumed after an interruption, equals a run in one piece to the last bit.
"""

import hashlib
import json
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from models.core.errors import InputError, RunFailed
from models.core.finding import Finding
from models.core.whole_files import write_whole
from models.engines.cut_vehicle import TUMBLED_PITCH, HubModel, build, check_step
from models.engines.protocol import SIZE_BOUND
from models.machine.compiled import folder_checksum
from models.measured.columns import SampleFile
from models.measured.recording import Recording, report_no_progress
from models.multibody.cut_table import HubInputs, cut_vehicle_table
from models.systems.measured.inputs import PrescribedAngles, RecordingInputs, StepGrid
from models.systems.measured.sections import SectionChannel, Sections
from models.vehicles.cut_vehicle import PITCH, ROLL, CutVehicle, rigid_vehicle

if TYPE_CHECKING:
    from models.systems.hub_forces.tilt_filter import TiltFilter

CHECKPOINT_INTERVAL = 60.0
"""Time (s) of the recording between checkpoints."""
PULL_DAMPING = 0.7
"""Damping ratio of the moment towards the filter's estimate."""
STIFFEST_PULL = 0.1
"""Largest bandwidth of the moment towards the filter's estimate, divided by the rate of the time steps; beyond,
Runge-Kutta 4 becomes inaccurate.
"""
Progress = Callable[[float, float], None]


@dataclass(frozen=True)
class AttitudeHold:
    """Stabiliser of roll and pitch in a run; bandwidth (Hz), model (rad/s^2) and smoothing (Hz) as in the scene's table
    [stabilise].

    force (N), moment (N m), angle (rad), rate (rad/s) : standard deviations of the noise of samples.
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
class SectionRunSettings:
    """Settings of a recording's run on a vehicle without tyres. hold : stabiliser; step : time step (s), the
    recording's sampling period if None; file : the scene that messages name.
    """

    vehicle: CutVehicle
    recording: Recording
    sections: Sections
    engine: str = "mujoco"
    hold: AttitudeHold = field(default_factory=AttitudeHold)
    step: float | None = None
    file: str = ""

    @property
    def grid(self) -> StepGrid:
        """Time steps of the run in relation to the recording's samples."""
        return StepGrid(self.step or self.recording.period, self.recording.period)

    @property
    def count(self) -> int:
        """Number of output samples of the run."""
        return (self.recording.count - 1) // self.grid.samples_per_output + 1


@dataclass(frozen=True)
class SectionOutcome:
    """Output of a recording's run. answers : channels; period : between output samples (s); done : number of samples
    that exist; normalised_innovation, filter_objections : of the stabiliser's filter, NaN and empty without a filter;
    counts : of steps, force calls and states.
    """

    columns: SampleFile
    answers: tuple[SectionChannel, ...]
    period: float
    done: int
    normalised_innovation: float
    findings: tuple[Finding, ...]
    filter_objections: tuple[str, ...] = ()
    counts: dict[str, int] = field(default_factory=dict)

    def samples(self, answer: SectionChannel | str) -> np.ndarray:
        """Returns the samples (done,) of a channel, which is given itself or by its name."""
        return self.columns.read(answer if isinstance(answer, str) else answer.name, 0, self.done)


@dataclass(frozen=True)
class Checkpoint:
    """File of arrays of an unfinished run. input_checksums : checksum of each input on which the run depends, by a name
    that users understand.
    """

    path: Path
    input_checksums: dict[str, str] = field(default_factory=dict)

    def load(self) -> dict[str, np.ndarray] | None:
        """Returns the saved arrays, None without a checkpoint. Raises InputError if they depend on other inputs; it
        names the input that differs.
        """
        if not self.path.is_file():
            return None
        try:
            with np.load(self.path) as file:
                arrays = dict(file)
            saved_checksums = json.loads(str(arrays.pop("of")))
        except Exception as error:
            raise InputError(self.path, "", None, f"is no checkpoint of a run: remove its folder ({error})") from error
        differing = [
            name
            for name in sorted({*saved_checksums, *self.input_checksums})
            if saved_checksums.get(name) != self.input_checksums.get(name)
        ]
        if differing:
            reason = f"is of a run with another {' and another '.join(differing)}"
            raise InputError(self.path, "", None, f"{reason}: choose another folder, or remove this one")
        return arrays

    def save(self, **arrays_by_name: np.ndarray) -> None:
        """Save arrays by name in place of the earlier arrays."""
        buffer = BytesIO()
        np.savez(buffer, of=np.array(json.dumps(self.input_checksums)), **arrays_by_name)  # type: ignore[arg-type]
        write_whole(self.path, buffer.getvalue())


def checksum_of(*digested_objects: object) -> str:
    """Checksum of objects: of the bytes of arrays, and of the ``repr`` of other objects."""
    total = hashlib.blake2b(digest_size=16)
    for part in digested_objects:
        if isinstance(part, np.ndarray):
            total.update(f"{part.dtype} {part.shape}".encode())
            total.update(np.ascontiguousarray(part).data)
        else:
            total.update(f"{part!r};".encode())
    return total.hexdigest()


def check_settings(run_settings: SectionRunSettings) -> None:
    """Raise InputError for settings with which a run is impossible or inaccurate, before any run is made."""
    grid, hold = run_settings.grid, run_settings.hold
    grid.check(run_settings.file)
    if run_settings.count < 2:
        raise InputError(
            run_settings.file,
            "files",
            None,
            f"the recording has {run_settings.recording.count} samples: nothing to run",
        )
    check_step(run_settings.engine, run_settings.vehicle, grid.step, grid.step * grid.steps_per_output)
    if hold.method == "kalman" and hold.bandwidth * grid.step > STIFFEST_PULL:
        limit = f"must be at most {STIFFEST_PULL:g} of the rate of the run's steps, {STIFFEST_PULL / grid.step:g} Hz"
        raise InputError(run_settings.file, "stabilise.bandwidth", hold.bandwidth, limit)
    used = [
        signal
        for signal in run_settings.recording.signals
        if not signal.check and signal.at == run_settings.vehicle.chassis
    ]
    if hold.method != "none" and not any(signal.quantity in ("angle", "angular rate") for signal in used):
        needed = (
            f"needs roll and pitch or their rates at the body {run_settings.vehicle.chassis!r}; 'none' runs without"
        )
        raise InputError(run_settings.file, "stabilise.method", hold.method, needed)


def run(
    run_settings: SectionRunSettings,
    run_folder: Path,
    report_progress: Progress = report_no_progress,
    block_duration: float = CHECKPOINT_INTERVAL,
) -> SectionOutcome:
    """Run a recording, or complete its run in ``run_folder``; ``report_progress`` is called with the simulated and the
    total time (s).

    block_duration : time (s) between checkpoints, which changes no bit of the results. Raises InputError where the
    folder has a run of other inputs, and RunFailed, whose ``partial`` is the outcome until then, where the vehicle
    topples.
    """
    check_settings(run_settings)
    march = _RunInProgress(
        run_settings,
        run_folder,
        max(round(block_duration / (run_settings.grid.step * run_settings.grid.steps_per_output)), 1),
    )
    period = run_settings.recording.period * run_settings.grid.samples_per_output
    report_progress(march.done * period, run_settings.recording.duration)
    while march.done < run_settings.count:
        march.advance()
        report_progress(march.done * period, run_settings.recording.duration)
    return march.outcome()


class _RunInProgress:
    """A run in progress: ``done`` output samples are on disk; ``state`` (2 n,) is the state at the next sample."""

    def __init__(self, run_settings: SectionRunSettings, run_folder: Path, block_length: int) -> None:
        self.job, self.grid, self.length, hold = run_settings, run_settings.grid, block_length, run_settings.hold
        self.inputs = RecordingInputs(run_settings.recording, run_settings.vehicle, hold.method == "prescribed")
        self.filter = self._filter() if hold.method == "kalman" else None
        self.prescribed = None
        if hold.method == "prescribed":
            self.prescribed = PrescribedAngles(self.inputs, self.grid, hold.smoothing, run_settings.file)
        run_folder.mkdir(parents=True, exist_ok=True)
        self._checkpoint = Checkpoint(run_folder / "run.npz", _inputs_of(run_settings, self.inputs))
        saved = self._checkpoint.load()
        self.done, self.state = (0, self._start()) if saved is None else (int(saved["done"]), saved["state"])
        if saved is None:
            self._save()
        elif self.filter is not None:
            known = self.filter.state
            self.filter.state = replace(known, **{name: saved[name] for name in vars(known)})
        self.columns = SampleFile(
            run_folder / "run.f64", tuple(answer.name for answer in run_settings.sections.answers), run_settings.count
        )

    def outcome(self) -> SectionOutcome:
        """Returns the outcome of the run up to now."""
        steps = (self.done - 1) * self.grid.steps_per_output
        return SectionOutcome(
            self.columns,
            self.job.sections.answers,
            self.grid.period * self.grid.samples_per_output,
            self.done,
            self.filter.normalised_innovation if self.filter else math.nan,
            tuple(self.inputs.findings),
            self.filter.objections() if self.filter else (),
            {"steps": steps, "force calls": 4 * steps, "states": 2 * self.job.vehicle.size},
        )

    def advance(self) -> None:
        """Run a block and save its samples. Raises RunFailed, whose ``partial`` is the outcome so far."""
        grid, last = self.grid, self.job.count - 1
        sample_count = min(self.length, max(last - self.done, 1))
        hub_inputs = self._hub_inputs(self.done * grid.samples_per_output, sample_count * grid.steps_per_output)
        model = build(
            self.job.engine, self.job.vehicle, hub_inputs, grid.step, sample_count * grid.steps_per_output * grid.step
        )
        states, failure = self._marched(model)
        is_last = self.done + sample_count >= last
        output_states = states[:: grid.steps_per_output] if failure or is_last else states[: -1 : grid.steps_per_output]
        self.columns.write(self.done, self.job.sections.read(model.numbers, output_states, 2 * grid.steps_per_output))
        self.done, self.state = self.done + len(output_states), states[-1].copy()
        if failure is not None:
            failure.partial = self.outcome()
            raise failure
        self._save()

    def _marched(self, hub_model: HubModel) -> tuple[np.ndarray, RunFailed | None]:
        """Returns the states of a block up to its end, or up to the time at which the vehicle topples together with the
        failure.
        """
        began, steps = self.done * self.grid.period * self.grid.samples_per_output, hub_model.steps
        try:
            states = hub_model.marched(*np.split(self.state, 2)).states
        except RunFailed:
            states = self._march_until_failure(hub_model)
        bounded_states = states[:, 4:]  # where it is and where it heads may be anything
        toppled = np.abs(states[:, [ROLL, PITCH]]).max(axis=1) > TUMBLED_PITCH
        is_invalid = toppled | ~np.isfinite(states).all(axis=1) | (np.abs(bounded_states) > SIZE_BOUND).any(axis=1)
        if not is_invalid.any() and len(states) == steps + 1:
            return states, None
        first_invalid = int(np.argmax(is_invalid)) if is_invalid.any() else len(states)
        reason = (
            f"the vehicle topples: roll or pitch beyond {TUMBLED_PITCH} rad"
            if first_invalid < len(states) and toppled[first_invalid]
            else "the state became infinite or not a number"
        )
        states = states[: max(first_invalid, 1)]
        return states, RunFailed(self.job.engine, reason, began + (len(states) - 1) * self.grid.step, states[-1])

    def _march_until_failure(self, hub_model: HubModel) -> np.ndarray:
        """Returns the states of a block that the engine did not complete: of the longest part from its beginning that
        the engine can run, by bisection.
        """
        good, bad, states = 0, hub_model.steps, self.state[None]
        while bad - good > 1:
            hub_model.steps = (good + bad) // 2
            try:
                states = hub_model.marched(*np.split(self.state, 2)).states
                good = hub_model.steps
            except RunFailed:
                bad = hub_model.steps
        return states

    def _hub_inputs(self, first_sample: int, step_count: int) -> HubInputs:
        """Returns the inputs at half steps of a block that begins at sample ``first_sample``: hub forces and, with a
        stabiliser, roll and pitch.
        """
        grid, rows = self.grid, 2 * step_count + 1
        used = math.floor((rows - 1) * grid.half_step_ratio) + 1
        wrenches = self.inputs.wrenches_with_neighbours(first_sample, used + 1)
        free = HubInputs(grid.cubic_rows(wrenches, rows), self.inputs.frame)
        if self.prescribed is not None:
            return replace(free, guide=self.prescribed.rows(first_sample, rows))
        if self.filter is None:
            return free
        tilt, _ = self.filter.advance(wrenches[1 : used + 1], self.inputs.tilt(first_sample, used))
        guide = np.hstack([grid.rows(tilt, rows), np.zeros((rows, 2))])
        corner, (roll, pitch, _) = (
            2 * math.pi * self.job.hold.bandwidth,
            np.diag(rigid_vehicle(self.job.vehicle).inertia),
        )
        pull = (
            roll * corner**2,
            2 * PULL_DAMPING * roll * corner,
            pitch * corner**2,
            2 * PULL_DAMPING * pitch * corner,
        )
        return replace(free, guide=guide, pull=pull)

    def _start(self) -> np.ndarray:
        """Initial state (2 n,): at rest in the design position; with a stabiliser, roll, pitch and their rates as
        measured."""
        n = self.job.vehicle.size
        state, held_columns = np.zeros(2 * n), [ROLL, PITCH, n + ROLL, n + PITCH]
        if self.prescribed is not None:
            state[held_columns] = self.prescribed.rows(0, 1)[0, :4]
        elif self.filter is not None:
            state[held_columns] = np.nan_to_num(self.inputs.tilt(0, 1)[0])
        return state

    def _filter(self) -> "TiltFilter":
        from models.systems.hub_forces.tilt_filter import StatedDeviations, TiltFilter

        vehicle, hold, period = self.job.vehicle, self.job.hold, self.job.recording.period
        forces = np.tile([hold.force] * 3 + [hold.moment] * 3, len(vehicle.hubs))
        deviations = StatedDeviations(forces, (hold.angle, hold.rate), hold.model)
        return TiltFilter(vehicle, self.inputs.frame, period, deviations, self.job.file)

    def _save(self) -> None:
        known = vars(self.filter.state) if self.filter else {}
        self._checkpoint.save(done=np.array(self.done), state=self.state, **known)


def _inputs_of(run_settings: SectionRunSettings, recording_inputs: RecordingInputs) -> dict[str, str]:
    """Checksums of all inputs on which a run's results depend, by names that users understand."""
    library = {"reference": "numpy"}.get(run_settings.engine, run_settings.engine)
    sources = [
        folder_checksum(Path(__file__).parents[2] / folder) for folder in ("multibody", "systems/measured", "measured")
    ]
    idle = HubInputs(np.zeros((1, 6 * len(recording_inputs.hubs))))
    samples = checksum_of(run_settings.recording.period, run_settings.recording.count)
    for signal in recording_inputs.used_signals:
        samples = checksum_of(samples, signal, run_settings.recording.samples(signal))
    return {
        "vehicle": checksum_of(
            cut_vehicle_table(run_settings.vehicle, idle, run_settings.grid.step),
            run_settings.vehicle.tree.coordinates(),
        ),
        "recording": samples,
        "stabiliser": repr(run_settings.hold),
        "engine": f"{run_settings.engine} {version(library)}",
        "step": repr(run_settings.grid.step),
        "list of sections": checksum_of(run_settings.sections.answers, run_settings.sections.frame),
        "version": f"{version('twinrig')} {sources}",
    }
