"""Motion of a vehicle on a random road: standard deviations of all outputs over speed, in closed form."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import InputError
from models.core.result import Result, join_results
from models.core.strict import Strict, quantity, read
from models.core.told import derived_result
from models.core.whole_files import write_whole
from models.ride.measures import dynamic_load_factor, exceedance_rate, time_share_beyond
from models.ride.sweep import VarianceSweep
from models.systems import run as run_scene
from models.systems.ride.of_scene import (
    check_linear,
    excitation_of,
    fitted_road,
    half_track_of,
    linear_vehicle,
    placed_wheels,
    road_of,
    vehicle_of,
)
from models.systems.ride.plan import frequency_doubts, noise_sharing_text
from models.systems.ride.readings import isotropic_change, largest_deviation_difference, static_loads
from models.systems.ride.run import CORRELATIONS_AS_WRITTEN, SweepPoints
from models.systems.ride.scene import RideScene
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial import PartOutput, PointOutput, SpatialVehicle
from models.vehicles.spatial_linear import wheels

SYSTEM = "ride"
ReportProgress = Callable[[str, float], None]
SIMPLER_ROADS = {
    "axles independent": ("", "uncorrelated"),
    "axles alike": ("", "equal"),
    "tracks independent": ("uncorrelated", ""),
    "tracks alike": ("equal", ""),
}
"""Simpler correlations that are often assumed: between left and right, and between front and rear; "" as in the
scene."""
ISOTROPIC_ROAD = "isotropic road"
ROUNDING_DEVIATION = 1e-13
"""Standard deviation (SI) below which a value is a zero with rounding."""
NEGLIGIBLE_OUTPUT = 1e-6
"""Ratio of an output's deviation to that on another road below which it is zero but for rounding: no change is
stated."""
POINTS_ALONG_BODY = 13
"""Number of points along the body at which its vertical acceleration is drawn."""
OVERHANG_LENGTH = 0.2
"""Distance (m) by which the points along the body reach beyond the axles."""


class Options(Strict):
    """Keys of the table [options] of this study."""

    speed: float | None = quantity("m/s", "of tables, spectra and export; the middle one if not given", default=None)
    free_travel: float | None = quantity("m", "free travel of every output that is a travel", default=None)


def check(scene: RideScene, engines: tuple[str, ...]) -> None:
    """Raise InputError for a varying speed, and for a nonlinear vehicle."""
    if scene.speeds is None:
        raise InputError(scene.file, "study", scene.study, "runs at constant speeds; with a drive use ride_drive")
    check_linear(scene, vehicle_of(scene))


def run(
    scene: RideScene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Compute standard deviations over speeds and road correlations; saves ``deviations.nc`` and ``.csv``, the linear
    system as ``system.npz`` and ``.mat``, and figures; returns the summary."""
    from studies.ride_figures import (
        FigureHeading,
        body_acceleration_figure,
        outputs_figure,
        road_figure,
        spectra_figure,
    )

    options = read(Options, scene.options, scene.file, "options")
    assert scene.speeds is not None
    vehicle, speeds = vehicle_of(scene), scene.speeds.all()
    wheel_positions, speed = wheels(vehicle), options.speed or float(speeds[len(speeds) // 2])
    engines = ("reference",) if vehicle.limits and len(engines) > 1 else engines  # no other has rigid springs
    roads = _road_correlation_cases(scene, vehicle)
    results = {}
    for i, engine in enumerate(engines):
        report_progress(f"linear vehicle of {engine}", 0.6 * i / len(engines))
        results[engine] = run_scene(scene, engine, points=SweepPoints([*speeds, speed], roads), error=scene.error)
    sweeps = {engine: result.detail for engine, result in results.items()}
    first, linear = sweeps[engines[0]], linear_vehicle(vehicle, engines[0])(speed)
    report_progress("figures", 0.7)
    top = FigureHeading(scene.title, results)
    _save_deviations(results, output_folder)
    _save_system(scene, linear, speed, output_folder)
    if vehicle_with_points := _with_points_along_body(vehicle):
        plain = scene.model_copy(update={"weighting": {}})
        sweep_of_points = run_scene(
            plain, "reference", vehicle=vehicle_with_points, points=SweepPoints([speed], roads)
        ).detail
        point_positions = [output.point[0] for output in vehicle_with_points.outputs if isinstance(output, PointOutput)]
        body_acceleration_figure(
            point_positions, sweep_of_points, first, vehicle, speed, top, output_folder / "body_acceleration.png"
        )
    kinds = [output.kind for output in vehicle.outputs] + ["acceleration"] * len(scene.weighting)
    panels = list(zip(kinds, first.units, strict=True))
    outputs_figure(first, panels, static_loads(vehicle), top, output_folder / "over_speed.png")
    spectra_figure(linear, excitation_of(scene, wheel_positions), speed, top, output_folder / "spectra.png")
    fitted = fitted_road(scene) if scene.road.file else None
    road, y = road_of(scene, wheel_positions), half_track_of(scene, wheel_positions)
    road_figure(road, y, fitted, top, output_folder / "road.png")
    texts = (road.label(y), *noise_sharing_text(scene, wheel_positions), *(fitted.notes if fitted else ()))
    notes = [*(f"  question: {text}" for text in frequency_doubts(vehicle)), *(f"  road: {text}" for text in texts)]
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": {},
        "results": results,
        "answer": _summary_of_deviations(first),
        "table": [*_table_lines(scene, vehicle, sweeps, speed, options), *notes],
    }


def _road_correlation_cases(scene: RideScene, vehicle: SpatialVehicle) -> dict[str, tuple[str, str] | None]:
    """Cases of road correlation by name: as in the scene (None), then simpler ones. Independent tracks are left out for
    a vehicle with wheels both in the middle and at the sides."""
    sided = {wheel.y != 0.0 for wheel in placed_wheels(scene, wheels(vehicle))}
    return {CORRELATIONS_AS_WRITTEN: None} | {
        name: (left_right or scene.road.left_right, front_rear or scene.road.front_rear)
        for name, (left_right, front_rear) in SIMPLER_ROADS.items()
        if len(sided) == 1 or left_right != "uncorrelated"
    }


def _with_points_along_body(vehicle: SpatialVehicle) -> SpatialVehicle | None:
    """The vehicle with other outputs, vertical accelerations at points along its heaviest body with pitch; None if it
    has no such body or only one axle."""
    bodies = [body for body in vehicle.bodies if "ry" in body.freedoms and "z" in body.freedoms]
    if not bodies or len(vehicle.axles) < 2:
        return None
    body = max(bodies, key=lambda body: body.mass)
    point_positions = np.linspace(
        vehicle.axles[-1] - OVERHANG_LENGTH, vehicle.axles[0] + OVERHANG_LENGTH, POINTS_ALONG_BODY
    )
    points = [(float(x), 0.0, body.position[2]) for x in point_positions]
    outputs = [PointOutput(f"x = {p[0]:.2f} m", "acceleration", body.name, p, (0.0, 0.0, 1.0)) for p in points]
    return replace(vehicle, outputs=tuple(outputs))


def _save_deviations(results_by_engine: Mapping[str, Result], output_folder: Path) -> None:
    """Save the standard deviations by every engine over case, speed and output, without the last speed, which is only
    for the tables."""
    joined = join_results(results_by_engine, "engine")
    saved = derived_result(
        Result(joined.data.isel(speed=slice(-1))), results_by_engine, "the Lyapunov equation of nudged matrices"
    )
    saved.save(output_folder / "deviations.nc")
    write_whole(output_folder / "deviations.csv", saved.data["deviation"].drop_vars("unit").to_dataframe().to_csv())


def _save_system(scene: RideScene, linearised_vehicle: LinearVehicle, speed: float, output_folder: Path) -> None:
    """Save the matrices of the linear system at a speed (m/s), and its covariance, for other programs."""
    from models.ride.covariance import stationary_covariance
    from models.ride.excited import vehicle_with_road
    from models.ride.export import write_exports
    from models.ride.weighting import system_with_weightings

    system = system_with_weightings(
        vehicle_with_road(linearised_vehicle, excitation_of(scene, linearised_vehicle.wheels), speed), scene.weighting
    )
    write_exports(system, stationary_covariance(system), output_folder / "system")


def _summary_of_deviations(speed_sweep: VarianceSweep) -> dict[str, Any]:
    """Summary: standard deviation (SI) of each output at all speeds on the scene's road; None for values that are not
    finite."""
    return {
        "speed": speed_sweep.speeds[:-1].tolist(),
        "deviation": {
            name: [
                float(value) if np.isfinite(value) else None
                for value in speed_sweep.of(CORRELATIONS_AS_WRITTEN, name)[:-1]
            ]
            for name in speed_sweep.outputs
        },
    }


def _table_lines(
    scene: RideScene,
    vehicle: SpatialVehicle,
    sweeps_by_engine: dict[str, VarianceSweep],
    speed: float,
    study_options: Options,
) -> list[str]:
    """Lines for the screen: each output's standard deviation at a speed (m/s), and its change on roads with simpler
    correlation."""
    (name, first), *other_sweeps = sweeps_by_engine.items()
    width = max(map(len, first.outputs))
    heads = "".join(f"{case:>20}" for case in (*first.cases[1:], ISOTROPIC_ROAD))
    lines = [f"  at {speed:g} m/s, standard deviations; then what other roads make of them", " " * (width + 24) + heads]
    isotropic_changes = isotropic_change(scene, vehicle, speed)
    deviations_at_speed, output_rows = (
        first.deviation[:, -1],
        list(zip(first.outputs, first.units, first.status[0, -1], strict=True)),
    )
    for i, (output, unit, status) in enumerate(output_rows):
        value = _value_without_rounding(deviations_at_speed[:, i])
        changes = (*deviations_at_speed[1:, i], value * (1 + isotropic_changes.get(output, np.nan)))
        columns = "".join(f"{_change_text(other_value, value):>20}" for other_value in changes)
        lines.append(f"    {output:<{width}}{_deviation_text(value, unit, status):>20}{columns}")
    reasons = zip(output_rows, first.reason[0, -1], strict=True)
    lines += [f"  {output} [{unit}]: {reason}" for (output, unit, status), reason in reasons if status != "finite"]
    deviations = dict(zip(first.outputs, deviations_at_speed[0].tolist(), strict=True))
    lines += _travel_lines(vehicle, deviations, study_options.free_travel) + _load_factor_lines(vehicle, deviations)
    for engine, other_value in other_sweeps:
        status_note = "" if (other_value.status == first.status).all() else "; but what is finite differs"
        difference = largest_deviation_difference(other_value, first)
        lines.append(
            f"  {engine}'s own linear vehicle: standard deviations within {difference:.1e} "
            f"(of the largest) of {name}'s{status_note}"
        )
    return lines


def _value_without_rounding(deviations_of_cases: np.ndarray) -> float:
    """First of the standard deviations (cases,), on the scene's road, or 0 if it is rounding of a value that vanishes
    by symmetry."""
    largest = np.max(deviations_of_cases, initial=0.0, where=np.isfinite(deviations_of_cases))
    return (
        float(deviations_of_cases[0])
        if deviations_of_cases[0] > max(NEGLIGIBLE_OUTPUT * largest, ROUNDING_DEVIATION)
        else 0.0
    )


def _deviation_text(deviation: float, unit: str, deviation_status: str) -> str:
    """Text of a standard deviation with its unit (mm for lengths), or its status if it is not finite."""
    if deviation_status != "finite":
        return deviation_status
    return f"{1e3 * deviation:.3g} mm" if unit == "m" else f"{deviation:.4g} {unit}"


def _change_text(changed_deviation: float, deviation: float) -> str:
    return (
        f"{100 * (changed_deviation / deviation - 1):+.1f} %"
        if np.isfinite(changed_deviation) and NEGLIGIBLE_OUTPUT * changed_deviation < deviation < np.inf
        else "-"
    )


def _travel_lines(
    vehicle: SpatialVehicle, deviation_by_output: Mapping[str, float], free_travel: float | None
) -> list[str]:
    """Lines for the screen on the share of time for which each suspension travel exceeds the free travel (m), and on
    the exceedances per hour if the travel rate is an output."""
    parts = [output for output in vehicle.outputs if isinstance(output, PartOutput)]
    rates = {output.part: deviation_by_output[output.name] for output in parts if output.kind == "travel rate"}
    lines = []
    for output in parts:
        if output.kind == "travel" and free_travel is not None:
            deviation = deviation_by_output[output.name]
            share = time_share_beyond(deviation, free_travel)
            text = f"  {output.name}: beyond {1e3 * free_travel:g} mm for {share:.3g} of the time"
            if output.part in rates:
                text += f", {3600 * exceedance_rate(deviation, rates[output.part], free_travel):.3g} times an hour"
            lines.append(text)
    return lines


def _load_factor_lines(vehicle: SpatialVehicle, deviation_by_output: Mapping[str, float]) -> list[str]:
    """Line for the screen, in a list, with the dynamic wheel load factors; an empty list if there are none."""
    parts = [
        f"{name} {dynamic_load_factor(deviation_by_output[name], load):.3f}"
        if load > 0
        else f"{name} has no load to carry"
        for name, load in static_loads(vehicle).items()
        if np.isfinite(deviation_by_output[name])
    ]
    return [f"  dynamic wheel load factor: {', '.join(parts)}"] if parts else []


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("ride")
