"""Braking with an anti-lock system in the loop: procedures driven one by one, in the paper's terms and as figures."""

import time
from collections.abc import Callable
from pathlib import Path as File
from typing import Any

import numpy as np
from pydantic import Field

from models.brake.figures_of_merit import NOT_CHECKED
from models.brake.plane_step import FORCE_X, FORCE_Y, LOAD, SLIP, SLIP_ANGLE
from models.core.errors import RunFailed
from models.core.strict import Strict, read
from models.systems.braking.adhesion import NoAdhesion, split, utilisation
from models.systems.braking.hitch import of_hitch
from models.systems.braking.measured_pressures import MeasuredPressures, write_pressures
from models.systems.braking.of_scene import measured_of, plane_of
from models.systems.braking.plan import behind
from models.systems.braking.procedures import drive, engines_of, step_steer
from models.systems.braking.run import Path
from models.systems.braking.scene import BrakingScene
from models.systems.braking.stop_report import WHEELS, Stop

SYSTEM = "braking"
Progress = Callable[[str, float], None]


class Options(Strict):
    """[options] of this study."""

    adhesion: bool = Field(True, description="measure adhesion utilisation too, by many short runs")


def run(scene: BrakingScene, engines: tuple[str, ...], folder: File, progress: Progress) -> dict[str, Any]:
    """Drive every procedure; saves NAME.nc, NAME.png and NAME_pressures.csv of each, also of one that failed, until it
    did."""
    from studies.braking_figures import stop_figure

    options = read(Options, scene.options, scene.file, "options")
    failed, table, answer = {}, list[str](), dict[str, dict[str, Any]]()
    engines = engines_of(scene, engines)
    for i, name in enumerate(scene.procedures):
        paths, seconds = dict[str, Path](), dict[str, float]()
        for j, engine in enumerate(engines):
            progress(f"{name}, {engine}", (i * len(engines) + j) / (len(scene.procedures) * len(engines)))
            begun = time.perf_counter()
            try:
                path: Path | None = drive(scene, name, engine)
            except RunFailed as error:
                failed[f"{name}, {engine}"], path = str(error), error.partial
            seconds[engine] = time.perf_counter() - begun
            if path is not None and len(path.times) > 2:
                paths[engine] = path
                save(scene, name, path, folder / (f"{name}.nc" if len(engines) == 1 else f"{name}_{engine}.nc"))
        if not paths:
            if not any(place.startswith(f"{name}, ") for place in failed):
                table.append(f"  {name}: stands within two samples of {scene.run.sample:g} s: it has no figures")
            continue
        stop = Stop(next(iter(paths.values())))
        radius = plane_of(scene).radius
        measured, rims = measured_of(scene, name, radius.size), stop.path.turning * radius
        write_pressures(folder / f"{name}_pressures.csv", stop.times, stop.path.pressures, rims)
        stop_figure(scene, name, stop, folder / f"{name}.png", measured)
        told, remarks = dict[str, float](), list[str]()
        try:
            told = engineers(scene, name, stop) if options.adhesion else {}
        except NoAdhesion as error:
            remarks = [f"    {error}"]
        except RunFailed as error:
            failed[f"{name}, figures of merit"] = str(error)
        train = of_hitch(stop) if scene.trailer is not None else {}
        remarks += [f"    {key:<40}{value:>10.2f}" for key, value in train.items()]
        wheels = stop.of_wheels() | beside(measured, stop, rims)
        answer[name] = {**stop.of_vehicle(), **{key: value.tolist() for key, value in wheels.items()}, **told, **train}
        table += lines(name, stop, told, wheels) + remarks + ended(measured, stop) + compared(paths, seconds)
    return {"scene": scene.title, "folder": str(folder), "failed": failed, "answer": answer, "table": table}


def beside(measured: MeasuredPressures | None, stop: Stop, rims: np.ndarray) -> dict[str, np.ndarray]:
    """By how much the speeds of rims (n, W) in m/s differ from measured ones, if there are any."""
    if measured is None or measured.speeds is None:
        return {}
    return {"rim less measured, rms [m/s]": measured.rms(stop.times, rims)}


def ended(measured: MeasuredPressures | None, stop: Stop) -> list[str]:
    """A line if the run lasts longer than its measured pressures."""
    if measured is None or measured.times[-1] > stop.times[-2]:
        return []
    return [f"    measured pressures end at {measured.times[-1]:.3f} s: from then on the last ones stay"]


STEP_STEER = (
    "without brakes: response time [s]",
    "without brakes: overshoot [%]",
    "without brakes: steady yaw rate [deg/s]",
)


def engineers(scene: BrakingScene, name: str, stop: Stop) -> dict[str, float]:
    """Figures of merit of a procedure, by name and unit; none where they have no meaning.

    Nor are there any that need runs of their own where a client that connects once, or a log, is behind the port, or
    where the pressures were measured.
    """
    own, surface = scene.procedures[name], scene.road.stretches[0].left
    if own.radius is not None:
        if stop.times[-1] < 1.0:
            return {}
        return {f"after 1 s: {key}": value for key, value in stop.in_turn(own.radius).items()}
    if own.kind == "j_turn":
        found = step_steer(scene, name)
        values = [np.nan] * 3 if found is None else [found.time, 100.0 * found.overshoot, np.degrees(found.steady)]
        return dict(zip(STEP_STEER, values, strict=True))
    once = scene.port is not None and (scene.port.port is not None or scene.port.replay is not None)
    if behind(scene) == "none" or scene.measured is not None or once:
        return {}
    if own.kind == "split":
        both = split(scene, name)
        return {"z_MALS": both.z, "z_MALS asked for": both.asked, "k low": both.k_low, "k high": both.k_high}
    used = utilisation(scene, surface)
    return {
        "z_AL": used.z,
        "k front": used.k.front,
        "k rear": used.k.rear,
        "k of all": used.k_vehicle,
        "adhesion utilisation epsilon": used.epsilon,
        **dict(zip(("k trailer front", "k trailer rear"), used.k.trailer, strict=False)),
    }


def compared(paths: dict[str, Path], seconds: dict[str, float]) -> list[str]:
    """A line per engine: where it stopped, and how long that took."""
    rows = []
    for engine, path in paths.items():
        x, y, yaw = path.states[-1, 0, :3]
        clock = f"; {path.clock}" if path.clock else ""
        rows.append(
            f"    {engine:<12}x {x:8.3f} m, y {y:8.3f} m, yaw {np.degrees(yaw):8.3f} deg after "
            f"{path.times[-1]:.3f} s; {len(path.times) - 1} samples in {seconds[engine]:.2f} s, once{clock}"
        )
    return rows


def lines(name: str, stop: Stop, told: dict[str, float], wheels: dict[str, np.ndarray]) -> list[str]:
    """Tables of one procedure: of the vehicle, and of its wheels."""
    rows = [f"  {name.replace('_', ' ')}" + _unfinished(stop)]
    rows += [f"    {stop.path.clock}"] if stop.path.clock else []
    rows += [f"    {key:<40}{value:>10.2f}" for key, value in stop.of_vehicle().items()]
    rows += [f"    {key:<40}{_figure_of_merit(value):>10}" for key, value in told.items()]
    rows += [f"    ({NOT_CHECKED})"] if told else []
    rows += ["    (without steering correction, and of the vehicle without trailer)"] if "z_MALS" in told else []
    names = WHEELS[: stop.path.turning.shape[1]]
    rows += ["    " + f"{'wheel':<40}" + "".join(f"{wheel.replace('trailer ', 'tr. '):>17}" for wheel in names)]
    return rows + [f"    {key:<40}" + "".join(f"{value:>17.2f}" for value in values) for key, values in wheels.items()]


def _figure_of_merit(value: float) -> str:
    return f"{value:.3f}" if np.isfinite(value) else "not steady"


def _unfinished(stop: Stop) -> str:
    if stop.path.stands:
        return ""
    return f": not stopped by {stop.times[-1]:g} s, still {stop.speed[-1]:.2f} m/s; all figures are those until then"


REPORTS = {
    "force_x": (FORCE_X, "N"),
    "force_y": (FORCE_Y, "N"),
    "load": (LOAD, "N"),
    "slip": (SLIP, "1"),
    "slip_angle": (SLIP_ANGLE, "rad"),
}


def save(scene: BrakingScene, name: str, path: Path, file: File) -> None:
    """The path as netCDF with units; wheels' forces, loads and slips are those of the last step of every sample."""
    import json

    import xarray as xr

    from models.core.result import Result, provenance

    units = ", ".join("rad" if name.split()[-1][0] in "hr" else "m" for name in path.coordinates)
    rates = ", ".join(f"{unit}/s" for unit in units.split(", "))
    wheel, moving = ("time", "wheel"), ("time", "coordinate")
    data = xr.Dataset(
        {
            "positions": (moving, path.states[:, 0], {"units": units}),
            "rates": (moving, path.states[:, 1], {"units": rates}),
            "turning": (wheel, path.turning, {"units": "rad/s"}),
            "pressure": (wheel, path.pressures, {"units": "bar"}),
            "torque": (wheel, path.torques, {"units": "N m"}),
        }
        | {
            key: (
                wheel,
                np.concatenate((np.full((1, path.turning.shape[1]), np.nan), path.reports[:, :, column])),
                {"units": unit},
            )
            for key, (column, unit) in REPORTS.items()
        },
        {
            "time": ("time", path.times, {"units": "s"}),
            "coordinate": list(path.coordinates),
            "wheel": list(WHEELS[: path.turning.shape[1]]),
        },
    )
    data.attrs = {
        "title": f"{scene.title}: {name}",
        "stands": int(path.stands),
        "scene_table": json.dumps(scene.table()),
        "provenance": json.dumps(provenance()),
    }
    Result(data).save(file)


if __name__ == "__main__":
    from studies.command_line import study

    study("braking")
