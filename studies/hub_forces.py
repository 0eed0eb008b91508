"""How far noisy hub forces let a vehicle drift, what that does to its springs and mounts, and what holding it takes."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from models.core.errors import RunFailed
from models.core.strict import Strict, read
from models.core.time_series import write_time_series
from models.engines.cut_vehicle import HubRun, build
from models.fatigue.damage import damage_ratio
from models.systems.hub_forces.halved import check_halved
from models.systems.hub_forces.measurement import Angles, HubForces
from models.systems.hub_forces.of_scene import measured
from models.systems.hub_forces.scene import COMPONENTS, HubScene, Method
from models.systems.hub_forces.stabilised import Stabilised
from models.vehicles.cut_vehicle import ANGLES, CutVehicle, X, Y, Z

if TYPE_CHECKING:
    from models.systems.hub_forces.tilt_filter import Tilt

SYSTEM = "hub-forces"
Progress = Callable[[str, float], None]
FREE, FILTER, PRESCRIBED = "free", "filter", "prescribed"
METHODS: dict[str, Method] = {FREE: "none", FILTER: "kalman", PRESCRIBED: "prescribed"}
"""Runs that are compared, whatever the scene's own method, and how roll and pitch are held in them."""
DRIFTED = 0.05
"""rad: a roll or pitch that is off by more is drift-off, as in the study of the pitch plane."""


class Options(Strict):
    """[options] of this study: none."""


@dataclass(frozen=True)
class Found:
    """What was measured, what the filter made of it, the true run if it was a virtual measurement, and the runs."""

    vehicle: CutVehicle
    forces: HubForces
    angles: Angles
    tilt: "Tilt"
    truth: HubRun | None
    runs: dict[str, HubRun]
    failed: dict[str, str]


def check(scene: HubScene, engines: tuple[str, ...]) -> None:
    """Refuse options: there are none."""
    read(Options, scene.options, scene.file, "options")


def run(scene: HubScene, engines: tuple[str, ...], folder: Path, progress: Progress) -> dict[str, Any]:
    """Measure, run free and with both stabilisers; saves the measurement, ``runs.csv`` and two figures."""
    from studies.hub_forces_figures import damage_figure, drift_figure

    found = compute(scene, engines, progress)
    _save(found, folder)
    drift_figure(found, scene.title, folder / "drift.png")
    damage_figure(found, scene.title, folder / "damage.png")
    return {
        "scene": scene.title,
        "folder": str(folder),
        "failed": {},
        "answer": answer(found),
        "doubts": list(found.tilt.doubts),
        "table": _table(scene, found),
    }


def compute(scene: HubScene, engines: tuple[str, ...], progress: Progress = lambda text, part: None) -> Found:
    """All runs: by the scene's own method in every engine, by the others in the last one, which is the fastest. Raises
    RunFailed where even the filter cannot hold the vehicle, or where the step is too long for its springs."""
    vehicle, own, last = scene.cut_vehicle(), scene.run, engines[-1]
    progress("virtual measurement", 0.05)
    true, forces, angles = measured(scene, vehicle, last)
    stabilised = Stabilised(scene, vehicle, forces, angles)
    progress("Kalman filter", 0.2)
    tilt = stabilised.tilt
    runs, failed, planned = dict[str, HubRun](), dict[str, str](), _planned(scene, engines)
    for i, (name, (method, engine)) in enumerate(planned.items()):
        progress(name, 0.3 + 0.6 * i / len(planned))
        drive = stabilised.drive(method, own.step, round(own.duration / own.step))
        try:
            runs[name] = build(engine, vehicle, drive, own.step, own.duration).run(stabilised.start(drive))
        except RunFailed as error:
            if name == FILTER:  # what the others are compared with
                raise
            failed[name] = str(error)
    check_halved(
        last,
        runs[FILTER],
        [element.name for element in vehicle.elements],
        lambda step, steps: build(last, vehicle, stabilised.drive("kalman", step, steps), step, step * steps).run(),
    )
    return Found(vehicle, forces, angles, tilt, true, runs, failed)


def _planned(scene: HubScene, engines: tuple[str, ...]) -> dict[str, tuple[Method, str]]:
    """Method and engine of every run by its name; those of a stabiliser in the last engine need none beside theirs."""
    pairs = [
        (name, method, engine)
        for name, method in METHODS.items()
        for engine in engines
        if method == scene.stabilise.method or engine == engines[-1]
    ]
    return {
        name if name != FREE and engine == engines[-1] else f"{name}, {engine}": (method, engine)
        for name, method, engine in pairs
    }


def errors(found: Found, run: HubRun) -> np.ndarray:
    """Errors (m, 6) of roll, pitch, heading (rad), x, y, z (m) against the true run; of a file only of both angles."""
    order = [*ANGLES.values(), X, Y, Z]
    if found.truth is not None:
        return run.states[:, order] - found.truth.states[:, order]
    off = np.full((len(run.times), len(order)), np.nan)
    for i in range(2):
        times = found.angles.period * np.arange(len(found.tilt.states))
        off[:, i] = run.states[:, order[i]] - np.interp(run.times, times, found.tilt.states[:, i])
    return off


def damages(found: Found, run: HubRun) -> dict[str, float]:
    """Pseudo-damage of every element's section force by the true one, or by that of the run with the filter."""
    true = found.truth or found.runs[FILTER]
    return {
        element.name: damage_ratio(run.elements[:, i], true.elements[:, i])
        for i, element in enumerate(found.vehicle.elements)
    }


def beside(found: Found) -> str:
    """What errors and damages are taken against: without a virtual measurement nobody knows the true run."""
    return "the true run" if found.truth is not None else "the run with the filter; the true one is not known"


def drift_off(found: Found, run: HubRun) -> float:
    """First time (s) at which roll or pitch is off by DRIFTED; infinite if never."""
    off = np.abs(errors(found, run)[:, :2]).max(axis=1) > DRIFTED
    return float(run.times[np.argmax(off)]) if off.any() else float("inf")


def answer(found: Found) -> dict[str, Any]:
    """Per run: largest errors, rms of the stabiliser's moments, damage of every element; all against ``beside``."""
    out: dict[str, Any] = {"beside": beside(found)}
    out |= {name: {"failed": text} for name, text in found.failed.items()}
    for name, run in found.runs.items():
        off = np.abs(errors(found, run)).max(axis=0)
        out[name] = {
            **dict(zip((*ANGLES, "x", "y", "z"), map(float, off), strict=True)),
            "moments": np.sqrt(np.mean(run.moments**2, axis=0)).tolist(),
            "damage": damages(found, run),
        }
    return out


def engines_apart(found: Found) -> float:
    """Largest difference of any coordinate or rate between the engines, before drift-off, of what several ran."""
    kinds = [[run for name, run in found.runs.items() if name.startswith(kind)] for kind in METHODS]
    own = max(kinds, key=len)
    before = int(min(min(drift_off(found, run) for run in own), own[0].times[-1]) / own[0].times[1]) + 1
    return max(float(np.abs(run.states[:before] - own[0].states[:before]).max()) for run in own)


def _table(scene: HubScene, found: Found) -> list[str]:
    off, damage = (
        ("largest error", "damage / true damage")
        if found.truth is not None
        else ("largest difference", "damage / that with the filter")
    )
    lines = [
        f"  forces in the frame {scene.forces.frame!r}; innovations squared {found.tilt.surprise:.2f} times",
        f"  {'':<18}{'roll':>9}{'pitch':>9}{'heading':>9}{'x':>8}{'y':>8}{'z':>8}{'drift-off':>11}"
        f"{'moments rms':>16}   {damage}",
        f"  {off:<18}{'[mrad]':>9}{'[mrad]':>9}{'[mrad]':>9}{'[m]':>8}{'[m]':>8}{'[m]':>8}{'[s]':>11}"
        f"{'[N m]':>16}   least, most",
    ]
    for name, run in found.runs.items():
        largest, (roll, pitch) = np.abs(errors(found, run)).max(axis=0), np.sqrt(np.mean(run.moments**2, axis=0))
        ratios = damages(found, run).values()
        lines.append(
            f"  {name:<18}"
            + "".join(f"{1e3 * v:>9.3g}" for v in largest[:3])
            + "".join(f"{v:>8.2g}" for v in largest[3:])
            + f"{_told(drift_off(found, run)):>11}{roll:>8.3g}{pitch:>8.3g}   "
            + f"{min(ratios):.3g}, {max(ratios):.3g}"
        )
    if found.truth is None:
        lines.append("  the true run is not known: angles are beside the filter's estimate, damage beside that run's")
    lines += [f"  doubt: {text}" for text in found.tilt.doubts]
    lines += [f"  {name}: {text}" for name, text in found.failed.items()]
    if len(found.runs) > len(METHODS):
        lines.append(f"  engines before drift-off: {engines_apart(found):.1e}")
    return lines


def _told(time: float) -> str:
    return f"{time:.4g}" if np.isfinite(time) else "never"


def _save(found: Found, folder: Path) -> None:
    """The measurement as a user would give it, and the chassis of every run."""
    names = [(f"{hub}_{name}", next(iter(units))) for hub in found.vehicle.hubs for name, units in COMPONENTS.items()]
    columns = {name: (unit, found.forces.samples[:, i]) for i, (name, unit) in enumerate(names)}
    write_time_series(folder / "hub_forces.csv", columns, found.forces.period)
    angles = zip(
        ("roll", "pitch", "roll_rate", "pitch_rate"),
        ("rad", "rad", "rad/s", "rad/s"),
        found.angles.samples.T,
        strict=True,
    )
    write_time_series(
        folder / "angles.csv", {name: (unit, values) for name, unit, values in angles}, found.angles.period
    )
    runs = {**({"true": found.truth} if found.truth else {}), **found.runs}
    every = {f"{name}: {what}": ("rad", run.states[:, i]) for name, run in runs.items() for what, i in ANGLES.items()}
    every |= {
        f"{name}: {what}": ("m", run.states[:, i])
        for name, run in runs.items()
        for what, i in (("x", X), ("y", Y), ("z", Z))
    }
    write_time_series(folder / "runs.csv", every, float(next(iter(found.runs.values())).times[1]))


if __name__ == "__main__":
    from studies.command_line import study

    study("hub_forces")
