"""Long recordings: equal bits of runs in blocks and of killed runs, memory, section forces compared with the engines,
and cycle counting."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from models.engines.cut_vehicle import build
from models.fatigue.counting import counted_load, level_crossings, range_pairs
from models.fatigue.rainflow_cycles import rainflow_cycles
from models.measured.formats import open_source
from models.measured.signal import HUB_COMPONENTS
from models.systems.measured.hand_on import write_section_forces
from models.systems.measured.section_run import AttitudeHold, run
from models.systems.measured.sections import Sections, guided_bodies
from models.systems.measured.verdict import channels_to_compare, compare_channel
from models.vehicles.cut_vehicle import cut_at_hubs
from validation.common.rows import Observed, Row, System, Table, behaviour_row
from validation.measured.long_recording import (
    SEED,
    computed_channel_bytes,
    run_killed_process,
    section_run_of_recording,
)
from validation.spatial.cars import random_states, random_wrenches, twin
from validation.spatial.joint_forces import exudyn_guides, mujoco_guides

TITLE = "Long recordings, section forces, what is handed on"
SYSTEM: System = "measured"
ASTM_EXAMPLE_LOAD = np.array([-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0])
"""The load of figure 6 of ASTM E1049-85; ASTM_CYCLE_COUNTS has the printed counts for ranges 3, 4, 6, 8 and 9."""
ASTM_CYCLE_COUNTS = {3.0: 0.5, 4.0: 1.5, 6.0: 0.5, 8.0: 1.0, 9.0: 0.5}
PATTERN_SECONDS = 2.5
"""Length (s) of the pattern that a long recording repeats."""
LONG_DURATION = 24.0
"""Length (s) of the run whose memory is measured."""


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of section forces, of counting, and of a run in blocks in MuJoCo; a full run also has all engines, a killed
    run, memory, and exported files."""
    rows = [*_guide_force_rows(quick), *_cycle_counting_rows()]
    if quick:
        return [*rows, _equal_blocks_row(work_folder, "mujoco", "kalman", 0.3)], {}
    lasting = {"mujoco": 0.5, "exudyn": 0.25, "reference": 0.2}
    rows += [
        _equal_blocks_row(work_folder, engine, method, seconds)
        for engine, seconds in lasting.items()
        for method in ("none", "kalman", "prescribed")
    ]
    return [*rows, _killed_run_row(work_folder), *_peak_memory_rows(work_folder), *_export_rows(work_folder)], {}


def _guide_force_rows(quick: bool) -> list[Row]:
    """Rows: forces and moments of the suspension guides in a turning, shaken car without symmetry, compared with the
    engines' own sensors."""
    car, worst = cut_at_hubs(twin(), "body"), 0.0
    sections = Sections(car, "hub")
    drive = random_wrenches(car, "hub", has_guide=False)
    numbers, wrenches = build("reference", car, drive, 1e-3, 1e-3).numbers, drive.hubs[0].reshape(-1, 6)
    for seed in range(1 if quick else 5):
        q, v = random_states(car, seed)
        guided, by_mujoco = _guide_forces(sections, numbers, q, v), mujoco_guides(car, q, v, wrenches)
        worst = max(worst, float(np.abs(guided - by_mujoco).max() / np.abs(by_mujoco).max()))
    rows = [
        Observed(
            "measured_long.guides_mujoco",
            SYSTEM,
            "relative difference of the forces and moments that guides transmit from MuJoCo's "
            "sensors, turning car without symmetry",
            worst,
            "1",
        ).at_most(1e-11, "Newton and Euler along the run; the sensors know nothing of the kernel", "native")
    ]
    if quick:
        return rows
    q, v = random_states(car, 0)
    for i, (body, freedom) in enumerate(car.tree.coordinates()):
        q[i] = 0.0 if body == "engine" and freedom.startswith("r") else q[i]
    guided, by_mujoco = _guide_forces(sections, numbers, q, 0 * v), exudyn_guides(car, q, wrenches)
    off = float(np.abs(guided - by_mujoco).max() / np.abs(by_mujoco).max())
    return [
        *rows,
        Observed(
            "measured_long.guides_exudyn",
            SYSTEM,
            "relative difference of the forces and moments that guides transmit from Exudyn's "
            "constraints of free bodies, car at rest",
            off,
            "1",
        ).at_most(1e-5, "positions rounded to 1e-16 m over the square of a step of 3e-5 s", "native"),
    ]


def _guide_forces(sections: Sections, parameter_table: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Forces and moments (guides, 6) that the suspension guides transmit (N, N m); components along which a guide lets
    its body slide are 0."""
    read = sections.read(parameter_table, np.concatenate((q, v))[None], 2)[0]
    values = {answer.name: value for answer, value in zip(sections.answers, read, strict=True)}
    return np.array(
        [
            [values.get(f"{name} guide {axis}", 0.0) for axis, *_ in HUB_COMPONENTS]
            for name in guided_bodies(sections.vehicle)
        ]
    )


def _cycle_counting_rows() -> list[Row]:
    """Rows: rainflow counting of the standard's example, and damage and counts of a sine, which are known exactly."""
    spans, _, counts = rainflow_cycles(ASTM_EXAMPLE_LOAD)
    by_span = {float(span): float(counts[spans == span].sum()) for span in np.unique(spans)}
    sine = np.sin(2 * np.pi * np.arange(100 * 64 + 1) / 64)  # 100 periods from 0: half cycles of 1, whole ones of 2
    counted = counted_load(sine, (5.0,))
    levels = level_crossings(sine, np.array([-1.1, -0.5, 0.5, 1.1])).tolist()
    spans, _, counts = rainflow_cycles(sine[np.r_[0, 16:6400:32, 6400]])
    pairs = range_pairs(spans, counts, np.array([0.5, 1.5])).tolist()
    return [
        behaviour_row(
            "measured_long.astm",
            SYSTEM,
            "rainflow counts of the example of ASTM E1049-85",
            str(by_span),
            str(ASTM_CYCLE_COUNTS),
            "the standard's own table",
            "published",
        ),
        Observed(
            "measured_long.sine_damage",
            SYSTEM,
            "pseudo-damage, slope 5, of 100 periods of a sine of amplitude 1",
            counted.damage[5.0],
            "1",
        ).within(99.5 * 2**5 + 2 * 0.5, 1e-9, "199 half cycles of 2 and two of 1 at the ends", "closed form"),
        behaviour_row(
            "measured_long.levels",
            SYSTEM,
            "level crossings of a sine at -1.1, -0.5, 0.5, 1.1, and range pairs of at least 0.5 and 1.5",
            f"{levels} {pairs}",
            "[0, 100, 100, 0] [100.5, 99.5]",
            "a hundred rises; 199 halves of range 2 and two of range 1",
            "closed form",
        ),
    ]


def _equal_blocks_row(work_folder: Path, engine_name: str, stabiliser: str, recording_seconds: float) -> Row:
    """Row: number of channels that differ between a run in one block and a run in uneven blocks."""
    run_folder = work_folder / f"blocks {recording_seconds}"
    run_folder.mkdir(exist_ok=True)
    hold = AttitudeHold(stabiliser)  # type: ignore[arg-type]
    job = section_run_of_recording(run_folder, recording_seconds, PATTERN_SECONDS, engine_name, hold)
    bits = []
    for block_duration in (60.0, 0.073):
        name = f"{engine_name} {stabiliser} {block_duration}"
        run(job, run_folder / name, block_duration=block_duration)
        bits.append(np.frombuffer(computed_channel_bytes(run_folder, name), np.int64))
    changed = float(np.sum(bits[0] != bits[1]))
    return Observed(
        f"measured_long.blocks_{engine_name}_{stabiliser}",
        SYSTEM,
        f"channels in {engine_name} whose bits change if {recording_seconds:g} s are run in blocks of 0.073 s, "
        "stabiliser "
        f"{stabiliser}",
        changed,
        "1",
    ).at_most(0.0, "state, filter and inputs go from block to block as they are", "closed form")


def _killed_run_row(work_folder: Path) -> Row:
    """Row: number of channels that differ between a run that was killed twice and a run that was not."""
    seconds, bits = 3.0, list[np.ndarray]()
    for times in (0, 2):
        run_folder = work_folder / f"killed {times}"
        run_folder.mkdir()
        job = section_run_of_recording(run_folder, seconds, PATTERN_SECONDS)
        if times:
            run_killed_process(run_folder, seconds, PATTERN_SECONDS, 0.25, times)
        else:
            run(job, run_folder / "run")
        bits.append(np.frombuffer(computed_channel_bytes(run_folder), np.int64))
    changed = float(np.sum(bits[0] != bits[1]))
    return Observed(
        "measured_long.killed",
        SYSTEM,
        f"channels whose bits change if a run of {seconds:g} s in blocks of 0.25 s is killed twice, "
        f"at moments drawn from seed {SEED}, and goes on",
        changed,
        "1",
    ).at_most(0.0, "a checkpoint is written whole or not at all", "closed form")


def _peak_memory_rows(work_folder: Path) -> list[Row]:
    """Rows: peak memory for an hour of recording, extrapolated from a shorter recording, and speed of the run."""
    section_run_of_recording(work_folder, LONG_DURATION, PATTERN_SECONDS)
    words = map(str, (work_folder, LONG_DURATION, PATTERN_SECONDS, LONG_DURATION / 10, 2e-3))
    command = [sys.executable, "-m", "validation.measured.long_recording", *words]
    output_lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    lines = np.array([line.split() for line in output_lines], float)  # of every block: seconds, memory, processor
    half, last = lines[len(lines) // 2], lines[-1]
    growth = (last[1] - half[1]) / (last[0] - half[0])
    return [
        Observed(
            "measured_long.memory",
            SYSTEM,
            f"memory for 60 channels at 1 kHz, measured once: the largest over {LONG_DURATION:g} s in ten "
            "blocks, and the growth of an hour at the rate of the second half",
            float(last[1] + growth * 3600.0),
            "B",
        ).aim(2e9, "only a block is in memory"),
        Observed(
            "measured_long.speed",
            SYSTEM,
            "seconds of recording per second of the processor, measured once, MuJoCo, step 2 ms, all sections",
            float((last[0] - lines[1, 0]) / (last[2] - lines[1, 2])),
            "1",
        ).aim(1.0, "how long an hour takes", "at least"),
    ]


def _export_rows(work_folder: Path) -> list[Row]:
    """Rows: section forces written in every format and read back; a measured check channel compared with the run."""
    run_folder = work_folder / "handed on"
    run_folder.mkdir()
    job = section_run_of_recording(run_folder, 2.0, PATTERN_SECONDS)
    outcome = run(job, run_folder / "run")
    wanted = outcome.answers[:6]
    values = np.column_stack([outcome.samples(answer) for answer in wanted])
    worst, format_text = 0.0, set()
    for path in write_section_forces(outcome, run_folder, ("csv", "mf4", "rsp", "tdms"), wanted, file_comment="Monday"):
        source = open_source(path)
        names = [channel.name for channel in source.channels if channel.name in {answer.name for answer in wanted}]
        read = np.vstack([block.values for block in source.blocks(names)])
        worst = max(worst, float(np.abs(read - values).max() / np.abs(values).max()))
        format_text |= {
            (channel.name, channel.unit, channel.comment) for channel in source.channels if channel.name in names
        }
    kept_share = format_text == {(answer.name, answer.unit, answer.comment) for answer in wanted}
    compared = [compare_channel(job.recording, outcome, *pair) for pair in channels_to_compare(job)]
    force = next(channel_match for channel_match in compared if channel_match.signal.name == "front left_force")
    return [
        Observed(
            "measured_long.handed_on",
            SYSTEM,
            "relative change of section forces that are written as CSV, MDF, RPC III and TDMS and read back",
            worst,
            "1",
        ).at_most(2.0**-24, "RPC III keeps singles, the others every bit", "native"),
        behaviour_row(
            "measured_long.handed_on_names",
            SYSTEM,
            "names, units and comments of section forces survive writing and reading",
            str(kept_share),
            "True",
            "they say axes and signs",
        ),
        Observed(
            "measured_long.check_channel",
            SYSTEM,
            "share of a measured spring force's variance that the stabilised run does not explain",
            1.0 - force.explained_variance,
            "1",
        ).at_most(0.01, "noise of 8 N on 100 N, and what the filter adds", "native"),
    ]


def tables(case_data: dict[str, Any]) -> list[Table]:
    """No tables."""
    return []


def draw(case_data: dict[str, Any]) -> list[tuple[str, Any]]:
    """No figures."""
    return []
