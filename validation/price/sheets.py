"""Problems as sheets that serve without twinrig: equations, numbers, inputs as CSV, end values of the reference.

    python -m validation.price.sheets FOLDER
"""

import csv
import sys
from pathlib import Path

import numpy as np

from models.engines.protocol import Settings, build
from studies.folders import new_folder
from validation.price.problems import force_excited, noisy_forces, prescribed_pitch
from validation.price.problems.force_excited import DURATION, FINE, PERIOD, ForceExcited

PROBLEMS = (force_excited.problem, noisy_forces.problem, prescribed_pitch.problem)
NAMES = ("z1", "z2", "z3", "pitch", "z1_rate", "z2_rate", "z3_rate", "pitch_rate")
UNITS = ("m", "m", "m", "rad", "m/s", "m/s", "m/s", "rad/s")
EQUATIONS = r"""
    m1 z1'' = m1 g + F3 - f1            F3 = k3 (z3 - z1 - b sin p) + d3 (z3' - z1' - b p' cos p)
    m2 z2'' = m2 g + F4 - f2            F4 = k4 (z3 - z2 + a sin p) + d4 (z3' - z2' + a p' cos p)
    m3 z3'' = m3 g - F3 - F4
    I p''   = cos p (b F3 - a F4) + M

z positive down, the pitch p positive nose up; f1, f2 are the wheel forces, positive up.
"""


def main(folder: Path) -> None:
    """Write a sheet and its input per problem, and ``reference_values.csv`` of all."""
    rows = [row for make in PROBLEMS for row in write(make(False), folder)]
    with open(folder / "reference_values.csv", "w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(("problem", "quantity", "unit", "time [s]", "value", "uncertainty"))
        table.writerows(rows)


def write(problem: ForceExcited, folder: Path) -> list[tuple[str, ...]]:
    """The sheet and the input of one problem; rows of its reference's end values."""
    own, signal = problem.assembly, problem.assembly.input
    assert signal is not None
    guided = bool(own.guided)
    columns = ["time [s]", "front [N]", "rear [N]", *(["pitch [rad]"] if guided else [])]
    times = PERIOD * np.arange(round(DURATION / PERIOD) + 1)
    values = signal.sample(0.0, PERIOD, len(times))[:, : len(columns) - 1]
    np.savetxt(folder / f"{problem.key}.csv", np.column_stack([times, values]), fmt="%.17g", delimiter=",",
               header=",".join(columns), comments="")  # fmt: skip
    rows = ends(problem)
    (folder / f"{problem.key}.md").write_text(_sheet(problem, guided, rows))
    return rows


def ends(problem: ForceExcited) -> list[tuple[str, ...]]:
    """Every state at the end, to all digits, with the largest difference of the two reference solvers over the run."""
    runs = [build("reference", problem.assembly, settings).run()
            for settings in (Settings("RK4", FINE, DURATION), Settings("DOP853", PERIOD, DURATION, 1e-12))]  # fmt: skip
    true, other = (run.states[:: (len(run.states) - 1) // round(DURATION / PERIOD)] for run in runs)
    off = np.abs(true - other).max(axis=0)
    return [(problem.key, name, unit, f"{DURATION:g}", f"{value:.16e}", f"{sure:.1e}")
            for name, unit, value, sure in zip(NAMES, UNITS, true[-1], off, strict=True)]  # fmt: skip


def _sheet(problem: ForceExcited, guided: bool, rows: list[tuple[str, ...]]) -> str:
    """The page as Markdown."""
    numbers = ", ".join(f"{name} = {value:g}" for name, value in problem.assembly.parameters)
    start = ", ".join(f"{name} = {value:.16e}" for name, value in zip(NAMES, problem.assembly.initial, strict=True))
    pitch = (" The pitch is a quintic spline through its samples (not-a-knot at both ends), prescribed; M is the "
             "moment that this takes." if guided else " M is zero.")  # fmt: skip
    table = "\n".join(f"| {name} | {value} | {unit} | {sure} |" for _, name, unit, _, value, sure in rows)
    asked = ", ".join(f"largest error of the {name} [{unit}]" for name, unit in problem.units.items())
    return f"""# {problem.title}

{problem.note}
{EQUATIONS}
Parameters (SI): {numbers}.

Start: {start}.

Input: `{problem.key}.csv`; between samples, forces are linear.{pitch}

Asked for: {asked}, at the samples up to {DURATION:g} s. Steps should end on the samples, where the
input has kinks.

End values at {DURATION:g} s ({problem.reference}); the uncertainty is the largest difference of the two over the run.

| state | value | unit | uncertainty |
|---|---|---|---|
{table}
"""


if __name__ == "__main__":
    main(new_folder(Path(sys.argv[1]) if sys.argv[1:] else None, "sheets"))
