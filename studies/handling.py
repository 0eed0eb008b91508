"""A car on four rolling tyres: manoeuvres in both engines, with its path, slip angles, loads and friction used."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import RunFailed
from models.multibody import forces as at
from models.systems.handling.in_engines import Drive, driven
from models.systems.handling.scene import HandlingScene

SYSTEM = "handling"
Progress = Callable[[str, float], None]


def run(scene: HandlingScene, engines: tuple[str, ...], folder: Path, progress: Progress) -> dict[str, Any]:
    """Drive every manoeuvre in every engine; saves NAME.nc and NAME.png of each, by the first engine that ended."""
    from studies.handling_figures import manoeuvre_figure

    failed, lines, answer = {}, [], {}
    count = len(scene.manoeuvres) * len(engines)
    for i, (name, own) in enumerate(scene.manoeuvres.items()):
        handling, drives = scene.handling(name), dict[str, Drive]()
        for j, engine in enumerate(engines):
            progress(f"{name}, {engine}", (i * len(engines) + j) / count)
            try:
                drives[engine] = driven(engine, handling, own.speed, own.duration, scene.run.step)
            except RunFailed as error:
                failed[f"{name}, {engine}"] = str(error)
        if not drives:
            continue
        drive = next(iter(drives.values()))
        _save(scene, drives, folder / f"{name}.nc")
        manoeuvre_figure(drive, name.replace("_", " "), folder / f"{name}.png")
        answer[name] = _answer(drives)
        lines.append(_line(name, answer[name]))
    head = (
        f"    {'':<16}{'largest':>26}{'least':>12}{'friction':>10}{'engines':>10}\n"
        f"    {'':<16}{'yaw rate':>12}{'lateral acc.':>14}{'load':>12}{'used':>10}{'differ':>10}"
    )
    return {"scene": scene.title, "folder": str(folder), "failed": failed, "answer": answer, "table": [head, *lines]}


def slip_angles(drive: Drive) -> np.ndarray:
    """(m, w) rad: direction in which each wheel's contact moves beside its plane, right of it positive."""
    ahead = drive.tyres[:, :, at.TREAD] + drive.tyres[:, :, at.SLIP_X]
    return np.arctan2(-drive.tyres[:, :, at.SLIP_Y], np.abs(ahead))


def friction_used(drive: Drive) -> np.ndarray:
    """(m, w): horizontal force of each tyre by mu N, 0 in the air."""
    own, mu = drive.tyres, drive.handling.tyres.friction
    bound = mu * own[:, :, at.PRESS]
    return np.hypot(own[:, :, at.FX], own[:, :, at.FY]) / np.where(bound > 0.0, bound, 1.0)


def _answer(drives: dict[str, Drive]) -> dict[str, float]:
    one, *others = drives.values()
    pairs = [
        (a, b)
        for other in others
        for a, b in ((one.run.positions, other.run.positions), (one.run.rates, other.run.rates))
    ]
    found = {
        "largest yaw rate [rad/s]": np.abs(one.velocity()[:, 2]).max(),
        "largest lateral acceleration [m/s^2]": np.abs(one.lateral_acceleration()).max(),
        "least wheel load [N]": one.tyres[:, :, at.PRESS].min(),
        "largest use of friction": friction_used(one).max(),
        "last speed [m/s]": one.velocity()[-1, 0],
        "largest power of a contact [W]": one.tyres[:, :, at.POWER].max(),
    }
    if pairs:
        found["largest difference of the engines"] = max(np.abs(a - b).max() for a, b in pairs)
    return {key: float(value) for key, value in found.items()}


def _line(name: str, answer: dict[str, float]) -> str:
    yaw, lateral, load, used = list(answer.values())[:4]
    gap = answer.get("largest difference of the engines")
    return f"    {name:<16}{yaw:>6.3f} rad/s{lateral:>8.2f} m/s^2{load:>10.0f} N{100 * used:>8.0f} %" + (
        f"{gap:>10.1e}" if gap is not None else ""
    )


REPORTS = {
    "load": (at.PRESS, "N"),
    "fx": (at.FX, "N"),
    "fy": (at.FY, "N"),
    "mz": (at.MZ, "N m"),
    "slip_x": (at.SLIP_X, "m/s"),
    "slip_y": (at.SLIP_Y, "m/s"),
    "tread": (at.TREAD, "m/s"),
    "steer": (at.ANGLE, "rad"),
    "power": (at.POWER, "W"),
}


def _save(scene: HandlingScene, drives: dict[str, Drive], path: Path) -> None:
    import xarray as xr

    from models.core.result import provenance, write

    first = next(iter(drives.values()))
    axes = ("engine", "time")
    data = xr.Dataset(
        {
            "positions": ((*axes, "coordinate"), np.array([d.run.positions for d in drives.values()])),
            "rates": ((*axes, "coordinate"), np.array([d.run.rates for d in drives.values()])),
        }
        | {
            name: ((*axes, "tyre"), np.array([d.tyres[:, :, column] for d in drives.values()]), {"units": unit})
            for name, (column, unit) in REPORTS.items()
        },
        {
            "engine": list(drives),
            "time": ("time", first.run.times, {"units": "s"}),
            "coordinate": [".".join(place) for place in first.handling.vehicle.coordinates()],
            "tyre": [tyre.name for tyre in first.handling.vehicle.tyres],
        },
    )
    data.attrs = {"title": scene.title, **{key: str(value) for key, value in provenance().items()}}
    write(data, path)


if __name__ == "__main__":
    from studies.command_line import study

    study("handling")
