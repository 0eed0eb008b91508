"""Cost of a step in processor instructions, whose number does not scatter as seconds do, and how well this number
repeats.

Valgrind counts every method with fixed steps. Two processes run the same steps; both are copies of one process that has
loaded everything without being counted. Within each, runs of two lengths are differenced, so that the start of a run
drops out. Counts compare the same code over time and between settings: valgrind offers the program another processor
than this one, and its instructions are no time.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

from models.drawing.figures import LABELS
from models.engines.stability import linearised_matrices
from models.systems.pitch_plane.scene import assembly_of_scene
from validation.common.rows import CaseAnswer, Observed, Saved, System, Table, not_run
from validation.common.scenes import road_scene
from validation.price import instructions_run
from validation.price.tables import curve_name

TITLE = "Instructions per step"
SYSTEM: System = "cost"
INTEGRATION_METHODS = {
    "exudyn": (
        "GeneralizedAlpha",
        "TrapezoidalIndex2",
        "RK44",
        "RK67",
        "RK33",
        "ExplicitMidpoint",
        "ExplicitEuler",
        "VelocityVerlet",
    ),
    "mujoco": ("Euler", "implicit", "implicitfast", "discrete", "RK4"),
}
METHODS_OF_ENGINES = tuple(
    f"{engine} {method}" for engine, methods in INTEGRATION_METHODS.items() for method in methods
)
COUNTED_STEP_COUNTS = (40, 120)
"""Numbers of steps of the two runs that are differenced."""
COUNT_TOLERANCE = 1e-6
PROCESS_TIMEOUT = 900
"""Time (s) after which a counting process is given up."""
CASE_ID, CASE_QUANTITY = (
    "instruction_counts",
    f"instructions of {len(METHODS_OF_ENGINES)} methods counted in two processes",
)


def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows of instruction counts of every method in two processes under valgrind; a quick run has none."""
    if quick:
        return [], {"instructions": {}}
    if shutil.which("valgrind") is None:
        return [not_run(CASE_ID, SYSTEM, CASE_QUANTITY, "valgrind is not installed")], {"instructions": {}}
    try:
        first, second = _instruction_counts(work_folder / "instructions")
    except (subprocess.SubprocessError, OSError) as error:
        reason = f"valgrind failed: {str(error).splitlines()[0][:120]}"
        return [not_run(CASE_ID, SYSTEM, CASE_QUANTITY, reason)], {"instructions": {}}
    off = np.abs(second / first - 1.0).max(axis=1)
    rows = [
        Observed(
            f"{CASE_ID}.{engine}",
            SYSTEM,
            f"{CASE_QUANTITY}: largest difference of a run in {LABELS[engine]}",
            float(largest.max()),
            "relative",
        ).at_most(
            COUNT_TOLERANCE,
            "the same instructions in the same order: seed of hashes and "
            "number of threads are set, and no clock's reading is printed while they are counted",
            "none",
        )
        for engine, largest in zip(
            INTEGRATION_METHODS, np.split(off, [len(INTEGRATION_METHODS["exudyn"])]), strict=True
        )
    ]
    per_step = np.diff(first, axis=1)[:, 0] / (COUNTED_STEP_COUNTS[1] - COUNTED_STEP_COUNTS[0])
    return rows, {"instructions": dict(zip(METHODS_OF_ENGINES, per_step.tolist(), strict=True))}


def _instruction_counts(work_folder: Path) -> np.ndarray:
    """Numbers of instructions (2 processes, methods, 2 step counts), as the profiler writes them between the runs."""
    work_folder.mkdir()
    mass, damping, stiffness, *_ = linearised_matrices(assembly_of_scene(road_scene()).vehicle)
    march = {
        "masses": np.diag(mass).tolist(),
        "damping": damping.tolist(),
        "stiffness": stiffness.tolist(),
        "methods": INTEGRATION_METHODS,
        "steps": COUNTED_STEP_COUNTS,
    }
    settled = {**os.environ, "PYTHONHASHSEED": "0", "OPENBLAS_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    command = [
        "valgrind",
        "--tool=callgrind",
        "--instr-atstart=no",
        f"--dump-before={instructions_run.MARKING_SYSTEM_CALL}",
        f"--callgrind-out-file={work_folder}/count.%p",
        sys.executable,
        instructions_run.__file__,
        json.dumps(march),
    ]
    subprocess.run(command, env=settled, check=True, capture_output=True, timeout=PROCESS_TIMEOUT)
    marches = len(METHODS_OF_ENGINES) * len(COUNTED_STEP_COUNTS)
    counts = [
        [_instructions_in_dump_file(path.with_name(f"{path.name}.{i}")) for i in range(2, marches + 2)]
        for path in work_folder.glob("count.*")
        if path.with_name(f"{path.name}.{marches + 1}").exists()
    ]
    shutil.rmtree(work_folder)
    return np.array(counts, float).reshape(2, -1, len(COUNTED_STEP_COUNTS))


def _instructions_in_dump_file(dump_path: Path) -> int:
    """Number of instructions in one dump file of the profiler."""
    matched = re.search(r"^totals: (\d+)", dump_path.read_text(errors="replace"), re.MULTILINE)
    assert matched is not None
    return int(matched[1])


def tables(case_data: Saved) -> list[Table]:
    """Table of instructions per step; none if they were not counted."""
    rows = tuple((curve_name(curve), f"{count / 1e3:,.1f}") for curve, count in case_data["instructions"].items())
    note = (
        f"Linear pitch-plane vehicle, steps of {1e3 * instructions_run.STEP:g} ms, all forces from one Python "
        "function, which they include: the engine, the way into Python and a law there. The start of a run is "
        "differenced out."
    )
    return [Table(TITLE, note, ("method", "thousand instructions a step"), rows)] if rows else []
