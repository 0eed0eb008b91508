"""How much a vehicle on a random road moves: standard deviations of all its outputs, over speed, without simulation."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import InputError
from models.core.strict import Strict, quantity, read
from models.core.whole_files import write_whole
from models.ride.excited import excited
from models.ride.height_densities import variances
from models.ride.measures import dynamic_load_factor, exceedances, share_beyond
from models.ride.sweep import Sweep, sweep
from models.ride.weighting import weighted
from models.road.isotropic import isotropic_like, spectral_matrix
from models.systems.ride.of_scene import (
    GRAVITY,
    Linear,
    check_linear,
    excitation_of,
    fitted_road,
    half_track_of,
    linear_vehicle,
    placed_wheels,
    road_of,
    told_by,
    vehicle_of,
)
from models.systems.ride.plan import doubts, met
from models.systems.ride.scene import RideScene
from models.vehicles.spatial import PartOutput, PointOutput, SpatialVehicle, TyreOutput
from models.vehicles.spatial_linear import preloads, wheels

SYSTEM = "ride"
Progress = Callable[[str, float], None]
SIMPLER = {
    "axles independent": ("", "uncorrelated"),
    "axles alike": ("", "equal"),
    "tracks independent": ("uncorrelated", ""),
    "tracks alike": ("equal", ""),
}
"""What is often assumed instead of the scene's own road: left and right, front and rear; empty as in the scene."""
ISOTROPIC = "isotropic road"
LONGEST, SHORTEST = 1e-2, 500.0
"""Band of the comparison with the isotropic road: a share of the smallest corner, and rad/m."""
ROUNDING = 1e-13
"""Deviations below, in SI, are what rounding leaves of zero."""
LEAST = 1e-6
"""An output this much smaller than on another road is zero but for rounding: no change is given."""
ALONG = 13
"""Points along the body at which its vertical acceleration is drawn."""
OVERHANG = 0.2
"""How far (m) these points reach beyond the axles."""


class Options(Strict):
    """[options] of this study."""

    speed: float | None = quantity("m/s", "of tables, spectra and export; the middle one if not given", default=None)
    free_travel: float | None = quantity("m", "free travel of every output that is a travel", default=None)


def check(scene: RideScene, engines: tuple[str, ...]) -> None:
    """Refuse a varying speed, which is another study's."""
    if scene.speeds is None:
        raise InputError(scene.file, "study", scene.study, "runs at constant speeds; with a drive use ride_drive")
    check_linear(scene, vehicle_of(scene))


def run(scene: RideScene, engines: tuple[str, ...], folder: Path, progress: Progress) -> dict[str, Any]:
    """Sweep speeds and correlations; saves ``deviations.nc`` and ``.csv``, ``system.npz`` and ``.mat``, figures."""
    from studies.ride_figures import along_figure, outputs_figure, road_figure, spectra_figure

    options = read(Options, scene.options, scene.file, "options")
    assert scene.speeds is not None
    vehicle, speeds = vehicle_of(scene), scene.speeds.all()
    speed = options.speed or float(speeds[len(speeds) // 2])
    engines = ("reference",) if vehicle.limits and len(engines) > 1 else engines  # no other has rigid springs
    cases = {"as in the scene": excitation_of(scene, wheels(vehicle))}
    sided = {wheel.y != 0.0 for wheel in placed_wheels(scene, wheels(vehicle))}
    for name, case in SIMPLER.items():
        if len(sided) == 1 or case[0] != "uncorrelated":  # a wheel in the middle is on neither of two such tracks
            cases[name] = excitation_of(scene, wheels(vehicle), _simpler(scene, case))
    found = {}
    for i, engine in enumerate(engines):
        progress(f"linear vehicle of {engine}", 0.6 * i / len(engines))
        with told_by(scene):
            found[engine] = sweep(linear_vehicle(vehicle, engine), cases, [*speeds, speed], scene.weighting)
    first = found[engines[0]]
    linear = linear_vehicle(vehicle, engines[0])
    progress("figures", 0.7)
    _save(scene, vehicle, linear, found, speed, folder)
    along = _along(vehicle)
    if along is not None:
        at = sweep(linear_vehicle(along, "reference"), cases, [speed])
        places = [output.point[0] for output in along.outputs if isinstance(output, PointOutput)]
        along_figure(places, at, first, vehicle, speed, scene.title, folder / "body_acceleration.png")
    panels = kinds(vehicle, linear(speed), first)
    outputs_figure(first, panels, _static(vehicle), scene.title, folder / "over_speed.png")
    spectra_figure(linear(speed), cases["as in the scene"], speed, scene.title, folder / "spectra.png")
    fitted = fitted_road(scene) if scene.road.file else None
    road, y = road_of(scene, wheels(vehicle)), half_track_of(scene, wheels(vehicle))
    road_figure(road, y, fitted, scene.title, folder / "road.png")
    texts = (road.label(y), *met(scene, wheels(vehicle)), *(fitted.notes if fitted else ()))
    notes = [*(f"  question: {text}" for text in doubts(vehicle)), *(f"  road: {text}" for text in texts)]
    return {
        "scene": scene.title,
        "folder": str(folder),
        "failed": {},
        "answer": _answer(found),
        "table": [*_table(scene, vehicle, found, speed, options), *notes],
    }


def _simpler(scene: RideScene, case: tuple[str, str]) -> tuple[str, str]:
    return case[0] or scene.road.left_right, case[1] or scene.road.front_rear


def _along(vehicle: SpatialVehicle) -> SpatialVehicle | None:
    """The vehicle with the vertical acceleration of points along its heaviest body that pitches, if there is one."""
    bodies = [body for body in vehicle.bodies if "ry" in body.freedoms and "z" in body.freedoms]
    if not bodies or len(vehicle.axles) < 2:
        return None
    body = max(bodies, key=lambda body: body.mass)
    places = np.linspace(vehicle.axles[-1] - OVERHANG, vehicle.axles[0] + OVERHANG, ALONG)
    points = [(float(x), 0.0, body.position[2]) for x in places]
    outputs = [PointOutput(f"x = {p[0]:.2f} m", "acceleration", body.name, p, (0.0, 0.0, 1.0)) for p in points]
    return replace(vehicle, outputs=tuple(outputs))


def _static(vehicle: SpatialVehicle) -> dict[str, float]:
    """Static load (N) of the tyre behind each output that is a tyre force."""
    loads = preloads(replace(vehicle, gravity=GRAVITY)).tyres
    return {
        output.name: loads[output.tyre]
        for output in vehicle.outputs
        if isinstance(output, TyreOutput) and output.kind == "tyre force"
    }


def _save(
    scene: RideScene, vehicle: SpatialVehicle, linear: Linear, found: dict[str, Sweep], speed: float, folder: Path
) -> None:
    """Deviations of every engine over case, speed and output; the system at one speed for other programs."""
    import xarray as xr

    from models.core.result import provenance, write
    from models.ride.covariance import stationary
    from models.ride.export import save

    engines, one = list(found), next(iter(found.values()))
    axes = {"engine": engines, "correlation": list(one.cases), "speed": one.speeds[:-1], "output": list(one.outputs)}
    values = np.stack([each.deviation[:, :-1] for each in found.values()])
    data = xr.Dataset({"deviation": (tuple(axes), values)}, axes)
    data["speed"].attrs["units"] = "m/s"
    data["unit"] = ("output", list(units(vehicle, linear(speed), one)))
    data.attrs = {"title": scene.title, **{key: str(value) for key, value in provenance().items()}}
    write(data, folder / "deviations.nc")
    write_whole(folder / "deviations.csv", data["deviation"].to_dataframe().to_csv())
    at = linear(speed)
    system = weighted(excited(at, excitation_of(scene, at.wheels), speed), scene.weighting)
    save(system, stationary(system), folder / "system")


def units(vehicle: SpatialVehicle, linear: Any, found: Sweep) -> list[str]:
    """Unit of every output, weighted ones after the vehicle's own."""
    own = [output.unit for output in linear.outputs]
    return [*own, *["m/s^2"] * (len(found.outputs) - len(own))]


def kinds(vehicle: SpatialVehicle, linear: Any, found: Sweep) -> list[tuple[str, str]]:
    """Kind and unit of every output, weighted ones after the vehicle's own."""
    own = [output.kind for output in vehicle.outputs]
    own += ["acceleration"] * (len(found.outputs) - len(own))
    return list(zip(own, units(vehicle, linear, found), strict=True))


def _answer(found: dict[str, Sweep]) -> dict[str, Any]:
    """Standard deviations at all speeds in the scene's own case, SI; None where an output has none."""
    one = next(iter(found.values()))
    finite = np.where(np.isfinite(one.deviation[0, :-1]), one.deviation[0, :-1], np.nan)
    values = {
        name: [None if np.isnan(value) else float(value) for value in finite[:, i]]
        for i, name in enumerate(one.outputs)
    }
    return {"speed": one.speeds[:-1].tolist(), "deviation": values}


def _table(
    scene: RideScene, vehicle: SpatialVehicle, found: dict[str, Sweep], speed: float, options: Options
) -> list[str]:
    """What each output does at one speed, and how wrong simpler roads are."""
    first = next(iter(found.values()))
    linear = linear_vehicle(vehicle)(speed)
    width = max(map(len, first.outputs))
    heads = "".join(f"{name:>20}" for name in (*first.cases[1:], ISOTROPIC))
    lines = [f"  at {speed:g} m/s, standard deviations; then what other roads make of them", " " * (width + 24) + heads]
    alike = isotropic_change(scene, vehicle, speed)
    for i, (name, unit) in enumerate(zip(first.outputs, units(vehicle, linear, first), strict=True)):
        own = _own(first.deviation[:, -1, i])
        changes = "".join(f"{_change(first.deviation[j, -1, i], own):>20}" for j in range(1, len(first.cases)))
        changes += f"{_change(own * (1 + alike.get(name, np.nan)), own):>20}"
        lines.append(f"    {name:<{width}}{_value(own, unit, str(first.status[0, -1, i])):>20}{changes}")
    lines += [f"  {name} [{unit}]: {reason}" for name, unit, reason in _notes(first, units(vehicle, linear, first))]
    lines += _travels(vehicle, first, options) + _loads(vehicle, first)
    return [*lines, *_agreement(found)]


def isotropic_change(scene: RideScene, vehicle: SpatialVehicle, speed: float) -> dict[str, float]:
    """What an isotropic road with the same track spectrum makes of every output, relative, both up to SHORTEST.

    Empty where there is none: a vehicle without a width, a road of second order, axles or tracks not as modelled.
    """
    placed = placed_wheels(scene, wheels(vehicle))
    road, y = road_of(scene, placed), half_track_of(scene, placed)
    modelled = (scene.road.left_right, scene.road.front_rear) == ("modelled", "delayed")
    if not modelled or road.mean.cutoff is not None or len({wheel.y for wheel in placed}) < 2:
        return {}
    linear = linear_vehicle(vehicle)(speed)
    low = LONGEST * min(f.corner for f in (road.mean, road.roll) if f.corner) if road.mean.corner else 0.01
    found = [
        variances(linear, partial(spectral_matrix, one, placed), speed, low, SHORTEST)
        for one in (road, isotropic_like(road, y))
    ]
    names = [output.name for output in vehicle.outputs]
    return {name: float(np.sqrt(iso / own) - 1.0) for name, own, iso in zip(names, *found, strict=True) if own > 0}


def _own(deviations: np.ndarray) -> float:
    """The scene's own of the deviations (cases,), 0 where symmetry leaves only rounding."""
    largest = np.max(deviations, initial=0.0, where=np.isfinite(deviations))
    return float(deviations[0]) if deviations[0] > max(LEAST * largest, ROUNDING) else 0.0


def _value(value: float, unit: str, status: str) -> str:
    """A deviation with its unit, lengths in mm; the status where there is none."""
    if status != "finite":
        return status
    return f"{1e3 * value:.3g} mm" if unit == "m" else f"{value:.4g} {unit}"


def _change(value: float, own: float) -> str:
    return f"{100 * (value / own - 1):+.1f} %" if np.isfinite(value) and LEAST * value < own < np.inf else "-"


def _notes(found: Sweep, unit: list[str]) -> list[tuple[str, str, str]]:
    """Why an output has no standard deviation; its name and unit before."""
    at = range(len(found.outputs))
    return [(found.outputs[i], unit[i], str(found.reason[0, -1, i])) for i in at if found.status[0, -1, i] != "finite"]


def _travels(vehicle: SpatialVehicle, found: Sweep, options: Options) -> list[str]:
    """How often each travel passes the free travel; how fast it moves where the vehicle file asks for its rate."""
    if options.free_travel is None:
        return []
    rates = {
        output.part: output.name
        for output in vehicle.outputs
        if isinstance(output, PartOutput) and output.kind == "travel rate"
    }
    lines = []
    for output in vehicle.outputs:
        if not isinstance(output, PartOutput) or output.kind != "travel":
            continue
        own = float(found.of(found.cases[0], output.name)[-1])
        share = share_beyond(own, options.free_travel)
        text = f"  {output.name}: beyond {1e3 * options.free_travel:g} mm for {share:.3g} of the time"
        if output.part in rates:
            rate = float(found.of(found.cases[0], rates[output.part])[-1])
            text += f", {3600 * exceedances(own, rate, options.free_travel):.3g} times an hour"
        lines.append(text)
    return lines


def _loads(vehicle: SpatialVehicle, found: Sweep) -> list[str]:
    """Dynamic wheel load factors in a line."""
    static = _static(vehicle)
    own = {name: float(found.of(found.cases[0], name)[-1]) for name in static}
    parts = [
        f"{name} {dynamic_load_factor(own[name], load):.3f}" if load > 0 else f"{name} has no load to carry"
        for name, load in static.items()
        if np.isfinite(own[name])
    ]
    return [f"  dynamic wheel load factor: {', '.join(parts)}"] if parts else []


def _agreement(found: dict[str, Sweep]) -> list[str]:
    """How far the engines' own linearisations lie from the first one."""
    (name, first), *others = found.items()
    lines = []
    for engine, other in others:
        finite = np.isfinite(first.deviation) & np.isfinite(other.deviation)
        largest = np.where(finite, first.deviation, 0.0).max(axis=(0, 1))  # an output may be zero on one of the roads
        gaps = np.abs(np.where(finite, other.deviation, 0.0) - np.where(finite, first.deviation, 0.0))
        gap = np.max(gaps / np.where(largest > 0, largest, 1.0))
        same = "" if (other.status == first.status).all() else "; but what is finite differs"
        lines.append(
            f"  {engine}'s own linear vehicle: standard deviations within {gap:.1e} (of the largest) of {name}'s{same}"
        )
    return lines


if __name__ == "__main__":
    from studies.command_line import study

    study("ride")
