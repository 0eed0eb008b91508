"""Timing of computations: interleaved and repeated in rounds, and compared only within a round.

Seconds wander by a fifth on a shared machine. Jobs are therefore timed in rounds, in a random order that
differs from round to round, and two jobs are compared by the median of their ratios within the rounds.
"""

import math
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

SEED = 20
"""Seed of the random order of jobs and of the bootstrap."""
RESAMPLES = 1000
"""Number of bootstrap samples."""
LONG_JOB_RATIO = 2.0
"""Ratio of a job's time to the least time of its turn above which no warm-up run is needed to know that it runs once
per turn."""


Clock = Callable[[], float]
"""Function that returns the time in s."""


def interleave(
    jobs: Sequence[Callable[[], Any]],
    rounds: int,
    minimum_seconds: float = 0.02,
    warm_up_times: Sequence[float] | np.ndarray | None = None,
    round_interval: Sequence[int] | None = None,
    clock: Clock = time.perf_counter,
) -> np.ndarray:
    """Computing times (s) of jobs in interleaved rounds, shape (jobs, rounds), NaN in rounds without the job; single
    thread, warmed up.

    minimum_seconds : a job is repeated within its turn until it lasts about this long (s);
    warm_up_times : seconds of a run of each job that has been, 0 where there was none; round_interval : a job is in one
    of so many rounds, a run that has been its first; clock : that of the processor leaves out what else the machine
    does."""
    known = [0.0] * len(jobs) if warm_up_times is None else warm_up_times
    repeats = [
        1 if duration > LONG_JOB_RATIO * minimum_seconds else _repeats(job, minimum_seconds, clock)
        for job, duration in zip(jobs, known, strict=True)
    ]
    order = np.random.default_rng(SEED)
    seconds = np.full((len(jobs), rounds), np.nan)
    for i in range(rounds):
        for j in order.permutation(len(jobs)):
            each = 1 if round_interval is None else round_interval[j]
            if i == 0 and each > 1 and known[j] > 0.0:
                seconds[j, i] = known[j]
            elif i % each == 0:
                seconds[j, i] = _timed(jobs[j], repeats[j], clock)
    return seconds


def _repeats(timed_job: Callable[[], Any], minimum_seconds: float, clock: Clock) -> int:
    """Number of repeats of a job that last ``minimum_seconds`` (s) together, from the warm-up run, or from one more run
    if that was short."""
    if _timed(timed_job, 1, clock) >= minimum_seconds:
        return 1
    return max(1, math.ceil(0.9 * minimum_seconds / max(_timed(timed_job, 1, clock), 1e-9)))


def _timed(timed_job: Callable[[], Any], repeat_count: int, clock: Clock) -> float:
    """Mean time (s) of a run of the job over some repeats."""
    start = clock()
    for _ in range(repeat_count):
        timed_job()
    return (clock() - start) / repeat_count


def timing_statistics(seconds: Sequence[float]) -> dict[str, float]:
    """Median, median absolute deviation and minimum of timed samples (s), by name."""
    values = np.asarray(seconds)
    middle = float(np.median(values))
    return {"median": middle, "mad": float(np.median(np.abs(values - middle))), "min": float(values.min())}


def bootstrap_interval(bootstrapped_values: np.ndarray) -> tuple[float, float, float]:
    """Median and 95 % interval (2.5 % and 97.5 % quantile) of bootstrapped values."""
    low, middle, high = np.quantile(bootstrapped_values, (0.025, 0.5, 0.975))
    return float(middle), float(low), float(high)


def bootstrap_rounds(round_count: int, resample_count: int = RESAMPLES) -> np.ndarray:
    """Numbers of rounds drawn with replacement, shape (count, rounds); the same draw for all jobs keeps paired times
    together."""
    return np.random.default_rng(SEED).integers(round_count, size=(resample_count, round_count))


def bootstrap_median(timed_samples: Sequence[float] | np.ndarray) -> tuple[float, float, float]:
    """Median of the samples of all rounds with its bootstrap 95 % interval."""
    values = np.asarray(timed_samples, float)
    _, low, high = bootstrap_interval(np.median(values[bootstrap_rounds(len(values))], axis=1))
    return float(np.median(values)), low, high


def interval_text(timed_samples: Sequence[float] | np.ndarray, scale: float = 1.0) -> str:
    """Text of the samples' median with its interval, as used in tables: "12.3 (11.9 to 12.8)"."""
    middle, low, high = (f"{scale * value:.3g}" for value in bootstrap_median(timed_samples))
    return f"{middle} ({low} to {high})"


def paired_ratio(
    numerator_times: Sequence[float] | np.ndarray, denominator_times: Sequence[float] | np.ndarray
) -> tuple[float, float, float]:
    """Ratio a / b of paired times, by the median of the log ratios within the rounds, with its bootstrap 95 %
    interval."""
    logs = np.log(np.asarray(numerator_times) / np.asarray(denominator_times))
    _, low, high = bootstrap_interval(np.median(logs[bootstrap_rounds(len(logs))], axis=1))
    return math.exp(float(np.median(logs))), math.exp(low), math.exp(high)
