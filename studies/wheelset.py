"""A wheelset on straight track: Klingel's wave, where it becomes unstable, and how it moves below and above."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import RunFailed
from models.rail import wheel_forces as wf
from models.rail.climbing import flange_share, nadal
from models.rail.eigenvalues import growth, hunting, locus, wavelength
from models.rail.energy import ledger
from models.rail.equations import YAW, Y
from models.rail.equations import Path as Motion
from models.rail.limit_cycle import maxima
from models.rail.linear import NoCriticalSpeed, critical_speed, kinematic_wavelength, klingel
from models.rail.wheelset import Wheelset
from models.systems.wheelset.channels import CONTACTS, STATES
from models.systems.wheelset.of_scene import equations_of, implementation, path_speeds, wheelset_of
from models.systems.wheelset.scene import WheelsetScene

SYSTEM = "wheelset"
Progress = Callable[[str, float], None]


def run(scene: WheelsetScene, engines: tuple[str, ...], folder: Path, progress: Progress) -> dict[str, Any]:
    """Linearise over the speeds, run the paths; saves ``eigenvalues.nc``, ``paths.nc``, ``over_speed.csv``, figures."""
    from studies.wheelset_figures import creep_figure, paths_figure, stability_figure

    wheelset, speeds, failed = wheelset_of(scene), scene.speeds.all(), dict[str, str]()
    linear, paths = dict[str, Linear](), dict[str, dict[float, Motion]]()
    for i, engine in enumerate(engines):
        try:
            progress(f"eigenvalues of {engine}", i / len(engines))
            linear[engine] = Linear(engine, wheelset, speeds)
            progress(f"paths of {engine}", (i + 0.5) / len(engines))
            paths[engine] = {speed: path(scene, engine, speed) for speed in path_speeds(scene)}
        except RunFailed as error:
            failed[engine] = str(error)
    _save(scene, linear, paths, folder)
    if linear:
        stability_figure(linear, wheelset, scene.title, folder / "stability.png")
    if paths:
        paths_figure(paths, scene.title, folder / "paths.png")
        creep_figure(next(iter(paths.values())), scene.title, folder / "creep.png")
    return {
        "scene": scene.title,
        "folder": str(folder),
        "failed": failed,
        "answer": _answer(wheelset, linear, paths),
        "table": [*_waves(wheelset, linear), *_stability(wheelset, linear), *_motions(scene, paths)],
    }


class Linear:
    """What one implementation's linearisation tells: wavelength (m), eigenvalues (speeds, 9), critical speed (m/s)."""

    def __init__(self, engine: str, wheelset: Wheelset, speeds: np.ndarray) -> None:
        kind = implementation(engine)
        self.speeds, self.values, self.wavelength = speeds, locus(kind, wheelset, speeds), wavelength(kind, wheelset)
        self.critical, self.why = critical(wheelset, partial(growth, kind))

    @property
    def hunting(self) -> np.ndarray:
        """The least damped oscillation's eigenvalue (speeds,) in 1/s."""
        return hunting(self.values)


def critical(wheelset: Wheelset, growth: Callable[[Wheelset, float], float]) -> tuple[float | None, str]:
    """The critical speed (m/s), or why there is none."""
    try:
        return critical_speed(wheelset, growth), ""
    except NoCriticalSpeed as error:
        return None, str(error.allowed)


def path(scene: WheelsetScene, engine: str, speed: float) -> Motion:
    """The motion from the scene's displacement and yaw at a speed (m/s), every step of it."""
    equations = equations_of(scene, engine, speed)
    start = equations.displaced(scene.run.displacement)
    start[YAW] = scene.run.yaw
    return equations.run(start, scene.run.duration, scene.run.step)


def _save(scene: WheelsetScene, linear: dict[str, Linear], paths: dict[str, dict[float, Motion]], folder: Path) -> None:
    """Eigenvalues over the speeds and every step of the paths as netCDF; damping and frequency as a table."""
    import xarray as xr

    from models.core.result import provenance, write

    origin = {"title": scene.title, **{key: str(value) for key, value in provenance().items()}}
    if linear:
        axes = {"engine": list(linear), "speed": next(iter(linear.values())).speeds}
        values = np.array([one.values for one in linear.values()])
        data = xr.Dataset(
            {
                name: (("engine", "speed", "eigenvalue"), part, {"units": "1/s"})
                for name, part in (("real", values.real), ("imag", values.imag))
            },
            axes,
            origin,
        )
        data["speed"].attrs["units"] = "m/s"
        write(data, folder / "eigenvalues.nc")
        _save_table(linear, folder)
    if paths:
        write(dataset(paths).assign_attrs(origin), folder / "paths.nc")


def dataset(paths: dict[str, dict[float, Motion]]) -> Any:
    """States and contacts over engine, speed and time, with units, as an xarray Dataset."""
    import xarray as xr

    one = next(iter(paths.values()))
    axes = {"engine": list(paths), "speed": list(one), "time": next(iter(one.values())).times}
    every = [[own[speed] for speed in one] for own in paths.values()]
    states = {
        name: (tuple(axes), np.array([[p.states[:, k] for p in row] for row in every]), {"units": unit})
        for name, (k, unit) in STATES.items()
    }
    contacts = {
        name: ((*axes, "patch"), np.array([[p.contacts[:, :, k] for p in row] for row in every]), {"units": unit})
        for name, (k, unit) in CONTACTS.items()
    }
    data = xr.Dataset({**states, **contacts}, axes)
    data["speed"].attrs["units"], data["time"].attrs["units"] = "m/s", "s"
    return data


def _save_table(linear: dict[str, Linear], folder: Path) -> None:
    from models.core.tables import write_table

    columns = {"speed": ("m/s", next(iter(linear.values())).speeds)}
    for engine, one in linear.items():
        columns[f"{engine} growth"] = ("1/s", one.values.real.max(axis=1))
        columns[f"{engine} hunting damping"] = ("1/s", -one.hunting.real)
        columns[f"{engine} hunting frequency"] = ("Hz", one.hunting.imag / (2.0 * np.pi))
    write_table(folder / "over_speed.csv", columns)


def _answer(wheelset: Wheelset, linear: dict[str, Linear], paths: dict[str, dict[float, Motion]]) -> dict[str, Any]:
    """What was found, as plain numbers in SI; None where there is no critical speed."""
    return {
        "klingel": klingel(wheelset),
        "wavelength": {engine: one.wavelength for engine, one in linear.items()},
        "critical_speed": {engine: one.critical for engine, one in linear.items()},
        "largest_power": {
            engine: max(float(p.contacts[:, :, wf.POWER].max()) for p in own.values()) for engine, own in paths.items()
        },
    }


def _waves(wheelset: Wheelset, linear: dict[str, Linear]) -> list[str]:
    """Klingel's wavelength by its closed form, and how far each implementation's lies from it."""
    closed_form = "closed form of the cones, no slip" if wheelset.profiles else "closed form, no slip"
    closed, first = klingel(wheelset), next((one.wavelength for one in linear.values()), 0.0)
    lines = [
        "  wavelength of the free wheelset",
        f"    {closed_form:<34}{closed:>14.9g} m",
        f"    {'creep forces alone':<34}{kinematic_wavelength(wheelset):>14.9g} m",
    ]
    for engine, one in linear.items():
        lines.append(
            f"    {f'eigenvalues of {engine}':<34}{one.wavelength:>14.9g} m   "
            f"{one.wavelength / closed - 1:+.1e} from the closed form, "
            f"{one.wavelength / first - 1:+.0e} from the first"
        )
    return lines


def _stability(wheelset: Wheelset, linear: dict[str, Linear]) -> list[str]:
    """The critical speed of every implementation, with the frequency there; or that there is none."""
    two, why = critical(wheelset, _two_motions)
    lines = ["  critical speed with linear creep", f"    {'lateral and yaw motion alone':<34}" + _speed(two, why)]
    if wheelset.friction == 0.0:
        lines.append("    DOUBT: without friction nothing creeps: what follows from creep forces is no wheelset's")
    first = next((one.critical for one in linear.values()), None)
    return lines + [
        f"    {f'eigenvalues of {engine}':<34}" + _speed(one.critical, one.why, first if k else None)
        for k, (engine, one) in enumerate(linear.items())
    ]


def _two_motions(wheelset: Wheelset, speed: float) -> float:
    from models.rail.linear import growth as of_two

    return of_two(wheelset, speed)


def _speed(critical: float | None, why: str, first: float | None = None) -> str:
    if critical is None:
        return f"none: the wheelset {why}"
    return f"{critical:>14.9g} m/s" + (f" {critical / first - 1:+.0e} from the first" if first else "")


def _motions(scene: WheelsetScene, paths: dict[str, dict[float, Motion]]) -> list[str]:
    """How each path ends, how far the implementations are apart, and the power of the creep forces."""
    if not paths:
        return []
    name, first = next(iter(paths.items()))
    lines = [f"  paths, by {name}, with {scene.contact.law}"]
    for speed, own in first.items():
        lines.append(f"    {speed:g} m/s: {_ending(own)}")
        lines += [
            f"      {engine}: within {np.abs(other[speed].states - own.states).max():.1e} of {name} (m, rad, s)"
            for engine, other in paths.items()
            if engine != name
        ]
        lines += _climbs(wheelset_of(scene), own) + _slides(scene, own)
        power = own.contacts[:, :, wf.POWER]
        book = ledger(equations_of(scene, "reference", speed), own)
        lines.append(
            f"      power of the creep forces: from {power.min():,.3g} to {power.max():.3g} W at a patch; "
            f"together they take {book.creep[-1]:,.4g} J"
        )
        lines.append(
            f"      energy: the drive gives {book.drive[-1]:,.4g} J, dampers take {book.dampers[-1]:,.4g} J; "
            f"{np.abs(book.residual).max():.1e} J are not accounted for"
        )
    return lines


def _climbs(wheelset: Wheelset, motion: Motion) -> list[str]:
    """A line for a path on which a cone's flange is pushed harder than it would bear without climbing."""
    share, limit = flange_share(motion.contacts), nadal(wheelset.friction)
    if wheelset.profiles is not None or share <= max(limit, 0.0):
        return []
    return [
        f"      DOUBT: a flange is pushed with {share:.2g} times its wheel's load; beyond {limit:.2g} (Nadal, 70 "
        "degrees) it may climb, which cones cannot show: use [profiles]"
    ]


def _slides(scene: WheelsetScene, motion: Motion) -> list[str]:
    """A line for a path whose linear creep forces are more than friction carries."""
    force, own = np.hypot(motion.contacts[:, :, wf.FX], motion.contacts[:, :, wf.FY]), wheelset_of(scene)
    bound = own.friction * motion.contacts[:, :, wf.LOAD]
    if scene.contact.law != "linear" or not (force > bound).any():
        return []
    with np.errstate(divide="ignore", invalid="ignore"):
        most = np.nanmax(force / bound)
    return [
        f"      DOUBT: the linear law's creep forces are up to {most:.3g} times what friction carries: it knows no "
        "slip; use fastsim"
    ]


def _ending(motion: Motion) -> str:
    """Last amplitude of a path, and what a cycle makes of it."""
    y = motion.states[:, Y]
    tops = y[maxima(y)]
    if tops.size < 2:
        return f"ends at {1e3 * motion.states[-1, Y]:.3g} mm without a second maximum"
    return f"last amplitude {1e3 * tops[-1]:.4g} mm, {100 * (tops[-1] / tops[-2] - 1):+.3g} % in the last cycle"


if __name__ == "__main__":
    from studies.command_line import study

    study("wheelset")
