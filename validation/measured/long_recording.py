"""A recording of any length with 60 channels: a short virtual measurement is repeated with gradual transitions, and its
noise never repeats."""

import subprocess
import sys
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from models.core.noise import normal_samples
from models.measured.columns import SampleFile
from models.measured.faults_of_measurement import SimulatedFaults
from models.measured.recording import Recording
from models.measured.signal import MeasuredSignal
from models.systems.measured.section_run import AttitudeHold, SectionRunSettings, run
from models.systems.measured.sections import AccelerometerPoint, Sections
from models.systems.measured.virtual import VirtualTable, virtual_measurement
from validation.common.peak_memory import peak_memory
from validation.spatial.cars import r19

SAMPLE_PERIOD, SEAM_SAMPLES, BLOCK = 1e-3, 1000, 60_000
"""Sampling period (s), number of samples in the transition between repetitions, number of samples made at a time."""
SENSOR_PLACES = {
    "acc fl": (1.2, 0.6, 0.6),
    "acc fr": (1.2, -0.6, 0.6),
    "acc rear": (-1.3, 0.0, 0.6),
    "acc roof": (0.0, 0.0, 1.4),
}
NOISE = {"force": 8.0, "moment": 1.0, "angle": 1.75e-3, "angular rate": 5e-3, "acceleration": 0.01, "travel": 1e-5}
"""Standard deviation of the noise on every sample, by quantity, in SI units."""
SEED = 81


@cache
def repeated_pattern(pattern_duration: float = 20.0) -> tuple[tuple[MeasuredSignal, ...], np.ndarray]:
    """Signals, and their samples without noise (n, 60): one repetition of the recording, with the transition to the
    next one."""
    car = r19()
    names = [element.name for element in car.elements]
    table = VirtualTable(
        duration=pattern_duration,
        accelerometers={name: list(sensor_position) for name, sensor_position in SENSOR_PLACES.items()},
        travels=names[:10],
        sections=names[:9],
    )
    virtual = virtual_measurement(car, table, "mujoco")
    assert len(virtual.signals) == 60
    return virtual.signals, virtual.samples(SimulatedFaults(), 1)


def sample_blocks(duration: float, pattern_seconds: float = 20.0) -> Iterator[np.ndarray]:
    """Samples (n, 60) of a recording of a given length (s), returned block by block."""
    signals, pattern = repeated_pattern(pattern_seconds)
    deviation = np.array([NOISE[signal.quantity] for signal in signals])
    length, count = len(pattern) - SEAM_SAMPLES, round(duration / SAMPLE_PERIOD) + 1
    fade = np.linspace(0.0, 1.0, SEAM_SAMPLES, endpoint=False)[:, None]
    once = pattern[:length].copy()
    once[:SEAM_SAMPLES] = fade * pattern[:SEAM_SAMPLES] + (1 - fade) * pattern[length:]
    for first in range(0, count, BLOCK):
        sample_numbers = np.arange(first, min(first + BLOCK, count))
        values = once[sample_numbers % length]
        if first == 0:
            values[: min(SEAM_SAMPLES, count)] = pattern[: min(SEAM_SAMPLES, count)]  # begins at rest
        yield values + normal_samples(SEED, 0, len(sample_numbers), 60, first) * deviation


def long_recording(duration: float, samples_path: Path, pattern_seconds: float = 20.0) -> Recording:
    """The long recording as an object, without any measurement files. Its samples are stored at ``samples_path`` and
    are created if they are missing."""
    signals, _ = repeated_pattern(pattern_seconds)
    columns = SampleFile(samples_path, tuple(signal.name for signal in signals), round(duration / SAMPLE_PERIOD) + 1)
    for values in sample_blocks(duration, pattern_seconds) if columns.done == 0 else ():
        columns.write(columns.done, values)
    assert columns.done == columns.count
    return Recording(signals, columns, SAMPLE_PERIOD)


def recorded_sections() -> Sections:
    """Sections of the car: forces are computed in all of them. Includes the positions of the accelerometers."""
    return Sections(
        r19(),
        points=tuple(
            AccelerometerPoint(name, "body", sensor_position) for name, sensor_position in SENSOR_PLACES.items()
        ),
    )


def section_run_of_recording(
    run_folder: Path,
    duration: float,
    pattern_seconds: float = 20.0,
    engine: str = "mujoco",
    attitude_hold: AttitudeHold | None = None,
    time_step: float | None = None,
) -> SectionRunSettings:
    """A run that computes section forces from the long recording in this folder. The recording is created if it is
    missing."""
    recording = long_recording(duration, run_folder / "recording.f64", pattern_seconds)
    return SectionRunSettings(r19(), recording, recorded_sections(), engine, attitude_hold or AttitudeHold(), time_step)


def computed_channel_bytes(run_folder: Path, run_name: str = "run") -> bytes:
    """All computed channels of a finished run, as bytes."""
    return (run_folder / run_name / "run.f64").read_bytes()


def run_killed_process(
    run_folder: Path,
    duration: float,
    pattern_seconds: float,
    block_duration: float,
    kill_count: int,
    kill_window: float = 1.0,
) -> int:
    """Do the run in a separate process that is killed (signal 9) ``kill_count`` times at random moments and restarted
    each time. Returns the number of starts.

    Each moment is drawn from the first ``kill_window`` s after the first line of progress.
    """
    rng, kills, runs = np.random.default_rng(SEED), 0, 0
    command = [
        sys.executable,
        "-m",
        "validation.measured.long_recording",
        *map(str, (run_folder, duration, pattern_seconds, block_duration)),
    ]
    while True:
        runs += 1
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            process.stdout.readline()
            if kills < kill_count:
                time.sleep(float(rng.uniform(0.0, kill_window)))
                process.kill()
                kills += 1
            elif process.wait() == 0:
                return runs
            else:
                raise RuntimeError(f"the run ended with {process.returncode}")


def _main(run_folder: str, duration: str, pattern_seconds: str, block_duration: str, time_step: str = "") -> None:
    """Start or continue a run. For every block, print the seconds completed, the peak memory (bytes) and the processor
    time (s)."""

    def report_block(completed_seconds: float, total_seconds: float) -> None:
        print(completed_seconds, peak_memory(), time.process_time(), flush=True)

    job = section_run_of_recording(
        Path(run_folder), float(duration), float(pattern_seconds), time_step=float(time_step) if time_step else None
    )
    run(job, Path(run_folder) / "run", report_block, float(block_duration))


if __name__ == "__main__":
    _main(*sys.argv[1:])
