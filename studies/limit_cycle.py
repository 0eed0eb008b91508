"""Limit cycles of a wheelset on straight track: amplitude and frequency over speed, stable and unstable ones."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import InputError
from models.core.strict import Strict, quantity, read
from models.rail.equations import YAW
from models.rail.limit_cycle import Orbit
from models.systems.wheelset.of_scene import wheelset_of
from models.systems.wheelset.run import ORBIT_CHANNELS, branch_result, cycle_speed, cycles_of_engines
from models.systems.wheelset.scene import WheelsetScene

SYSTEM = "wheelset"
ReportProgress = Callable[[str, float], None]


class Options(Strict):
    """Keys of the table [options] of this study."""

    speed: float | None = quantity(
        "m/s", "of the cycle in all implementations; 1.1 of where the branch begins if not given", default=None
    )


def check(scene: WheelsetScene, engines: tuple[str, ...]) -> None:
    """Raise InputError for a scene with the linear creep law or without a range of speeds."""
    if scene.contact.law == "linear":
        allowed = "without bound on the creep forces only flanges hold the motion: use fastsim"
        raise InputError(scene.file, "contact.law", scene.contact.law, allowed)
    if len(set(scene.speeds.all())) < 2:
        raise InputError(scene.file, "speeds", None, "a branch needs a range of speeds: give start and stop")


def run(
    scene: WheelsetScene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Compute the branch of limit cycles over speed, and the cycle at one speed in every engine; saves ``branch`` and
    ``cycle_ENGINE.nc``, and figures; returns the summary.

    The branch is a table (CSV) and a result (netCDF).
    """
    from studies.wheelset_figures import limit_cycle_branch_figure, limit_cycle_figure

    options = read(Options, scene.options, scene.file, "options")
    branched = branch_result(
        scene, lambda count: report_progress("branch of cycles", 0.6 * count / (count + 10)), estimate_error=scene.error
    )
    orbits, notes = branched.detail, json.loads(branched.data.attrs["doubts"])
    speed = options.speed or cycle_speed(scene, orbits)
    report_progress(f"cycle at {speed:g} m/s", 0.6)
    results, failed = cycles_of_engines(scene, engines, speed, estimate_error=scene.error)
    by_engine: dict[str, Orbit] = {engine: result.detail for engine, result in results.items()}
    for engine, result in results.items():
        result.save(output_folder / f"cycle_{engine}.nc")
    if orbits:
        branched.save(output_folder / "branch.nc")
        branched.save_table(output_folder / "branch.csv", *ORBIT_CHANNELS)
        limit_cycle_branch_figure(branched, wheelset_of(scene), scene.title, output_folder / "branch.png")
    if by_engine:
        limit_cycle_figure(results, scene.title, output_folder / "cycle.png")
    else:
        notes.append(f"at {speed:g} m/s a motion from {1e3 * scene.run.displacement:g} mm dies out: no cycle")
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": failed,
        "answer": {
            "branch": [_quantities_of_cycle(orbit, *ORBIT_CHANNELS) for orbit in orbits],
            "cycles": {
                engine: _quantities_of_cycle(orbit, *(name for name in ORBIT_CHANNELS if name != "multiplier"))
                for engine, orbit in by_engine.items()
            },
        },
        "results": {**({"branch": branched} if orbits else {}), **results},
        "table": [*_branch_lines(orbits), *_cycle_lines(by_engine), *(f"  {note}" for note in notes)],
    }


def _quantities_of_cycle(orbit: Orbit, *quantity_names: str) -> dict[str, float]:
    """Named quantities of a limit cycle as plain numbers in SI units."""
    return {name: float(getattr(orbit, name)) for name in quantity_names}


def _branch_lines(limit_cycles: list[Orbit]) -> list[str]:
    """Lines for the screen, one for each limit cycle of the branch."""
    if not limit_cycles:
        return []
    lines = [
        "  cycles, by rising amplitude; the error is what halving the step changes",
        "    amplitude       speed    error   frequency    error  multiplier",
    ]
    for o in limit_cycles:
        kind = "attracts" if o.stable else "repels"
        lines.append(
            f"    {1e3 * o.amplitude:>6.3f} mm{o.speed:>8.3f} m/s{o.error:>9.0e}{o.frequency:>9.4f} Hz"
            f"{o.frequency_error:>9.0e}{o.multiplier:>12.4f} {kind}"
        )
    return lines


def _cycle_lines(cycles_by_engine: dict[str, Orbit]) -> list[str]:
    """Lines for the screen on amplitude, frequency, forces and power of the limit cycle in every engine."""
    if not cycles_by_engine:
        return []
    first = next(iter(cycles_by_engine.values()))
    path = first.path()
    power, creep = path.contacts["power"], np.hypot(path.contacts["fx"], path.contacts["fy"])
    yaw = 1e3 * path.states[:, YAW].max()
    lines = [
        f"  cycle at {first.speed:g} m/s: yaw up to {yaw:.4g} mrad, creep forces up to "
        f"{creep.max():,.0f} N, their power from {power.min():,.4g} to {power.max():.3g} W at a patch, "
        f"{-np.trapezoid(power.sum(axis=1), path.times):.4g} J in a period"
    ]
    for engine, o in cycles_by_engine.items():
        lines.append(
            f"    {engine:<10}{1e3 * o.amplitude:>12.8f} mm, error {1e3 * o.error:.0e}"
            f"{o.frequency:>14.9f} Hz, error {o.frequency_error:.0e}"
        )
    return lines


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("limit_cycle")
