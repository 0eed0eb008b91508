"""Computing time of FASTSIM against a lower bound of its arithmetic: a square root and a division per cell."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from models.contact.fastsim import FastsimEllipse, RollingEllipse, fastsim
from models.contact.fastsim_grid import ellipse_grid
from models.contact.fastsim_kernels import march_plain, march_second_order
from models.contact.fastsim_records import BLOCK, LANE_COUNT
from models.contact.material import MaterialPair
from models.machine.compiled import compiled
from models.machine.timing import bootstrap_median, interval_text, paired_ratio
from validation.common.rows import Observed, Row, System

SYSTEM: System = "contact"
CELLS = 21
TIMING_ROUNDS, REPEATS = 300, 30
CONTACTS = 400
TIMING_NOTE = "median of interleaved rounds, seconds of the processor"


def speed_rows_and_table(
    material_pair: MaterialPair, load: float, mu: float, semi_axis: float
) -> tuple[list[Row], list[list[str]]]:
    """Report rows on FASTSIM's time per call and per cell, and a table (job, time, ratio to the arithmetic bound).
    load in N, semi_axis in m."""
    draw = np.random.default_rng(5)
    blocks = _aligned_blocks(1)
    for name in ("u", "v0", "v1"):
        blocks[name] = draw.normal(0.0, 0.3, LANE_COUNT)
    (_, cells), values = (
        ellipse_grid(CELLS, CELLS + 1, "intermediate").records,
        draw.uniform(1.0, 2.0, CELLS * LANE_COUNT),
    )
    along, across = (draw.normal(0.0, 2e-3, CONTACTS) for _ in range(2))
    many = RollingEllipse(semi_axis, semi_axis, load, mu, along, across, draw.normal(0.0, 0.3, CONTACTS))
    calls = {n: FastsimEllipse(1.0, material_pair, cells=n) for n in (12, CELLS)}
    marched = REPEATS * CELLS * LANE_COUNT
    jobs: dict[str, tuple[Callable[[], Any], float]] = {
        "bound": (partial(_arithmetic_bound, values, REPEATS), marched),
        "plain": (partial(_plain_loop, blocks, cells, REPEATS), marched),
        "second": (partial(_repeat_second_order, blocks, cells, REPEATS), marched),
        **{
            f"call {n}": (partial(_call_kernel, e, (semi_axis, load, mu, 1e-3, 5e-4, 0.2)), REPEATS)
            for n, e in calls.items()
        },
        **{
            f"many {march}": (partial(fastsim, many, material_pair, march=march), CONTACTS * CELLS * (CELLS + 1))
            for march in ("plain", "second-order")
        },
    }
    took = _processor_times(jobs)
    ratio = {name: paired_ratio(seconds, took["bound"]) for name, seconds in took.items()}
    calls_took = {n: bootstrap_median(1e6 * took[f"call {n}"]) for n in calls}
    rows = [
        Observed(f"fastsim.speed.{name}", SYSTEM, f"{what}, 95 % interval {low:.3g} to {high:.3g}", value, unit).aim(
            most, TIMING_NOTE
        )
        for name, what, (value, low, high), unit, most in (
            ("plain", "plain march per cell, by a root and a division", ratio["plain"], "", 1.8),
            ("second", "second-order march per cell, by a root and a division", ratio["second"], "", 4.0),
            ("call.1", "one call from Python, 12 cells per strip (0.8 % of mu N)", calls_took[12], "us", 5.0),
            ("call.04", "one call from Python, 21 cells per strip (0.4 % of mu N)", calls_took[CELLS], "us", 10.0),
        )
    ]
    table = [
        [
            name,
            f"{interval_text(lasted, 1e6)} us" if "call" in name else f"{interval_text(lasted, 1e9)} ns per cell",
            "" if "call" in name else f"{ratio[name][0]:.2f}",
        ]
        for name, lasted in took.items()
    ]
    return rows, table


def _call_kernel(ellipse: FastsimEllipse, ellipse_values: tuple[float, ...]) -> None:
    for _ in range(REPEATS):
        ellipse(*ellipse_values)


def _processor_times(timed_jobs: dict[str, tuple[Callable[[], Any], float]]) -> dict[str, np.ndarray]:
    """Job -> processor times (rounds,) in s per call or cell; the jobs take turns over several rounds."""
    for job, _ in timed_jobs.values():
        job()
    seconds = np.empty((TIMING_ROUNDS, len(timed_jobs)))
    for row in seconds:
        for j, (job, units) in enumerate(timed_jobs.values()):
            start = time.process_time()
            job()
            row[j] = (time.process_time() - start) / units
    return dict(zip(timed_jobs, seconds.T, strict=True))


@compiled
def _arithmetic_bound(numbers, repeat_count):
    """Loop that is timed as the lower bound of FASTSIM's arithmetic: a square root and a division per element, all
    independent, in vector registers."""
    total = 0.0
    for _ in range(repeat_count):
        for i in range(numbers.size):
            numbers[i] = 1.0 / np.sqrt(numbers[i])
        total += numbers[0]
    return total


def _aligned_blocks(block_count: int) -> np.ndarray:
    """Array of zero blocks aligned to the vector registers; without alignment the march takes 1.5 times as long."""
    room = np.zeros(block_count * BLOCK.itemsize // 8 + 8)
    first = -room.ctypes.data % 64 // 8
    return room[first : first + room.size - 8].view(BLOCK)


@compiled
def _plain_loop(contact_blocks, cell_count, repeat_count):
    for _ in range(repeat_count):
        march_plain(contact_blocks[0], cell_count)


@compiled
def _repeat_second_order(contact_blocks, cell_count, repeat_count):
    for _ in range(repeat_count):
        march_second_order(contact_blocks[0], cell_count)
