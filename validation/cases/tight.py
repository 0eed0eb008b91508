"""Every engine at its recommended setting compared with an independent solution at a tight tolerance, over 20 s."""

from pathlib import Path

from models.engines.assembly import Settings
from models.systems.pitch_plane.run import run as simulate
from validation.common.rows import CaseAnswer, Independence, Observed, System
from validation.common.scenes import largest_difference, on_paper_road, road_scene

TITLE = "Road-excited run at the recommended setting against a tight-tolerance solution"
SYSTEM: System = "pitch-plane"
DURATION = 20.0
QUICK_DURATION = 0.5
TIME_STEP = 2.5e-4
TIGHT_SOLVER_TOLERANCE = 1e-9
"""Tolerance of the solutions that judge. Two solver families then differ by 5e-9, a twentieth of their bound; a row
shows this difference."""


@on_paper_road()
def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """A row for the uncertainty of the tight solution, and a row for each implementation; a quick run takes half a
    second."""
    duration = QUICK_DURATION if quick else DURATION
    scene = road_scene(step=TIME_STEP, duration=duration)
    tight = simulate(scene, "reference", Settings("DOP853", TIME_STEP, duration, TIGHT_SOLVER_TOLERANCE))
    by_lsoda = simulate(scene, "reference", Settings("LSODA", TIME_STEP, duration, TIGHT_SOLVER_TOLERANCE))
    rows = [
        Observed(
            "tight.uncertainty",
            SYSTEM,
            "difference between the tight solutions by Dormand-Prince 8 and by Adams/BDF",
            largest_difference(tight, by_lsoda),
            "m, rad, m/s, rad/s",
        ).at_most(1e-7, "a tenth of the bound that it has to judge", "shared kernel")
    ]
    for engine in ("reference", "exudyn", "mujoco"):
        independence: Independence = "shared kernel" if engine == "reference" else "native"
        run = simulate(scene, engine)
        name = run.data.attrs["integrator"]
        rows.append(
            Observed(
                f"tight.{engine}",
                SYSTEM,
                f"largest error of the states over {duration:g} s, {engine} {name} at {1e3 * TIME_STEP:g} ms",
                largest_difference(run, tight),
                "m, rad, m/s, rad/s",
            ).at_most(1e-6, "a thousandth of a millimetre: far below what a road survey resolves", independence)
        )
    return rows, {}
