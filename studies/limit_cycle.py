"""Limit cycles of a wheelset on straight track: amplitude and frequency over speed, those that repel as well."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import InputError, RunFailed
from models.core.strict import Strict, quantity, read
from models.rail import wheel_forces as wf
from models.rail.equations import YAW
from models.rail.limit_cycle import attained, bifurcation
from models.rail.linear import NoCriticalSpeed
from models.rail.orbit import Orbit, beside, refined, solved
from models.systems.wheelset.of_scene import BESIDE, equations_of
from models.systems.wheelset.scene import WheelsetScene

SYSTEM = "wheelset"
Progress = Callable[[str, float], None]


class Options(Strict):
    """[options] of this study."""

    speed: float | None = quantity(
        "m/s", "of the cycle in all implementations; 1.1 of where the branch begins if not given", default=None
    )


def check(scene: WheelsetScene, engines: tuple[str, ...]) -> None:
    """Refuse what has no limit cycle or no range."""
    if scene.contact.law == "linear":
        allowed = "without bound on the creep forces only flanges hold the motion: use fastsim"
        raise InputError(scene.file, "contact.law", scene.contact.law, allowed)
    if len(set(scene.speeds.all())) < 2:
        raise InputError(scene.file, "speeds", None, "a branch needs a range of speeds: give start and stop")


def run(scene: WheelsetScene, engines: tuple[str, ...], folder: Path, progress: Progress) -> dict[str, Any]:
    """Follow the branch, close the cycle in every engine; saves ``branch.csv``, ``cycle.nc`` and figures."""
    from studies.wheelset_figures import branch_figure, cycle_figure

    options = read(Options, scene.options, scene.file, "options")
    orbits, notes = _branch(scene, progress)
    speed = options.speed or _usual(scene, orbits)
    progress(f"cycle at {speed:g} m/s", 0.6)
    cycles, failed = _cycles(scene, engines, speed)
    _save(scene, orbits, cycles, folder)
    if orbits:
        branch_figure(orbits, equations_of(scene, "reference", speed).wheelset, scene.title, folder / "branch.png")
    if cycles:
        cycle_figure(cycles, scene.title, folder / "cycle.png")
    else:
        notes.append(f"at {speed:g} m/s a motion from {1e3 * scene.run.displacement:g} mm dies out: no cycle")
    table = [*_branch_lines(orbits), *_cycle_lines(cycles), *(f"  {note}" for note in notes)]
    return {
        "scene": scene.title,
        "folder": str(folder),
        "failed": failed,
        "answer": _answer(orbits, cycles),
        "table": table,
    }


def _branch(scene: WheelsetScene, progress: Progress) -> tuple[list[Orbit], list[str]]:
    """Orbits of the branch within the scene's speeds, and why it ends or never begins."""
    speeds, orbits = scene.speeds.all(), list[Orbit]()
    equations = equations_of(scene, "reference", float(speeds[-1]))
    try:
        for orbit in bifurcation(equations, float(speeds.min()), float(speeds.max()), scene.run.step):
            orbits.append(orbit)
            progress("branch of cycles", 0.6 * len(orbits) / (len(orbits) + 10))
    except NoCriticalSpeed as error:
        return _at_speeds(scene) if error.unstable else [], [f"no branch begins: the wheelset {error.allowed}"]
    except RunFailed as error:
        return orbits, [f"the branch is followed no further: {error.reason}"]
    return orbits, []


def _at_speeds(scene: WheelsetScene) -> list[Orbit]:
    """Cycles that motions reach at the scene's speeds, where no branch begins because nothing is stable."""
    found = (
        attained(equations_of(scene, "reference", float(speed)), start=scene.run.displacement, step=scene.run.step)
        for speed in scene.speeds.all()
    )
    return [refined(orbit, "amplitude") for orbit in found if orbit is not None]


def _usual(scene: WheelsetScene, orbits: list[Orbit]) -> float:
    """A speed (m/s) above that at which the branch begins, the scene's last where there is none."""
    last = float(scene.speeds.all().max())
    return min(last, round(BESIDE[1] * orbits[0].speed, 2)) if orbits else last


def _cycles(scene: WheelsetScene, engines: tuple[str, ...], speed: float) -> tuple[dict[str, Orbit], dict[str, str]]:
    """The refined cycle of every engine at a speed (m/s); each finds it from a guess that is off."""
    found, failed = dict[str, Orbit](), dict[str, str]()
    first = attained(equations_of(scene, "reference", speed), start=scene.run.displacement, step=scene.run.step)
    if first is None:
        return found, failed
    for engine in engines:
        guess = beside(first, equations_of(scene, engine, speed))
        try:
            found[engine] = refined(solved(guess, "amplitude", precise=False), "amplitude")
        except RunFailed as error:
            failed[engine] = str(error)
    return found, failed


def _save(scene: WheelsetScene, orbits: list[Orbit], cycles: dict[str, Orbit], folder: Path) -> None:
    """The branch as a table, one period of every engine's cycle as netCDF."""
    from models.core.result import provenance, write
    from models.core.tables import write_table
    from studies.wheelset import dataset

    if orbits:
        columns = {
            "speed": "m/s",
            "amplitude": "m",
            "frequency": "Hz",
            "multiplier": "-",
            "error": "m/s or m",
            "frequency_error": "Hz",
        }
        write_table(
            folder / "branch.csv",
            {name: (unit, np.array([getattr(orbit, name) for orbit in orbits])) for name, unit in columns.items()},
        )
    origin = {"title": scene.title, **{key: str(value) for key, value in provenance().items()}}
    for engine, orbit in cycles.items():
        data = dataset({engine: {orbit.speed: orbit.path()}}).assign_attrs(origin)
        write(data, folder / f"cycle_{engine}.nc")


def _answer(orbits: list[Orbit], cycles: dict[str, Orbit]) -> dict[str, Any]:
    """What was found, as plain numbers in SI."""
    names = ("speed", "amplitude", "frequency", "multiplier", "error", "frequency_error")
    numbers = {
        engine: {name: float(getattr(orbit, name)) for name in names if name != "multiplier"}
        for engine, orbit in cycles.items()
    }
    return {"branch": [{name: float(getattr(orbit, name)) for name in names} for orbit in orbits], "cycles": numbers}


def _branch_lines(orbits: list[Orbit]) -> list[str]:
    """Every cycle of the branch."""
    if not orbits:
        return []
    lines = [
        "  cycles, by rising amplitude; the error is what halving the step changes",
        "    amplitude       speed    error   frequency    error  multiplier",
    ]
    for o in orbits:
        kind = "attracts" if o.stable else "repels"
        lines.append(
            f"    {1e3 * o.amplitude:>6.3f} mm{o.speed:>8.3f} m/s{o.error:>9.0e}{o.frequency:>9.4f} Hz"
            f"{o.frequency_error:>9.0e}{o.multiplier:>12.4f} {kind}"
        )
    return lines


def _cycle_lines(cycles: dict[str, Orbit]) -> list[str]:
    """Amplitude, frequency, forces and power of the cycle in every implementation."""
    if not cycles:
        return []
    first = next(iter(cycles.values()))
    path = first.path()
    power, creep = path.contacts[:, :, wf.POWER], np.hypot(path.contacts[:, :, wf.FX], path.contacts[:, :, wf.FY])
    yaw = 1e3 * path.states[:, YAW].max()
    lines = [
        f"  cycle at {first.speed:g} m/s: yaw up to {yaw:.4g} mrad, creep forces up to "
        f"{creep.max():,.0f} N, their power from {power.min():,.4g} to {power.max():.3g} W at a patch, "
        f"{-np.trapezoid(power.sum(axis=1), path.times):.4g} J in a period"
    ]
    for engine, o in cycles.items():
        lines.append(
            f"    {engine:<10}{1e3 * o.amplitude:>12.8f} mm, error {1e3 * o.error:.0e}"
            f"{o.frequency:>14.9f} Hz, error {o.frequency_error:.0e}"
        )
    return lines


if __name__ == "__main__":
    from studies.command_line import study

    study("limit_cycle")
