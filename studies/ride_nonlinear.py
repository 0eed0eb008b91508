"""Motion of a vehicle with nonlinear springs on a random road: standard deviations, and the error of linearisation.

If tyres may lift off, results are those of Monte Carlo copies: the linearised vehicle keeps its tyres on the road.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import InputError, RunFailed
from models.core.strict import read
from models.engines.spatial_protocol import INTEGRATORS
from models.ride.frequency import standard_errors
from models.ride.road_path import check_rates
from models.road.excitation import RoadExcitation
from models.systems import run as run_scene
from models.systems.ride.nonlinear import EngineRide, NonlinearRide, RunSampling
from models.systems.ride.of_scene import excitation_of, has_no_linear_equivalent, vehicle_of
from models.systems.ride.scene import RideScene
from models.vehicles.spatial import SpatialVehicle, TyreOutput
from models.vehicles.spatial_linear import static_preloads, wheels

SYSTEM = "ride"
ReportProgress = Callable[[str, float], None]


class Options(RunSampling):
    """Keys of the table [options] of this study."""


def check(scene: RideScene, engines: tuple[str, ...]) -> None:
    """Raise InputError for a varying speed, a linear vehicle, weightings, and damped tyres on a road without rates."""
    if scene.speeds is None:
        raise InputError(scene.file, "study", scene.study, "runs at constant speeds; with a drive use ride_drive")
    vehicle = vehicle_of(scene)
    if not has_no_linear_equivalent(vehicle):
        allowed = "has neither curves nor friction, nor tyres that lift: use ride, which is exact for it"
        raise InputError(scene.file, "vehicle.file", scene.vehicle.file, allowed)
    for name, weighting_name in scene.weighting.items():
        raise InputError(scene.file, f"weighting.{name}", weighting_name, "is not read by this study: leave it out")
    check_rates(vehicle, excitation_of(scene, wheels(vehicle)), scene.file)
    options = _study_options(scene)
    for i, speed in enumerate(options.beside):
        if not speed > 0.0:
            raise InputError(scene.file, f"options.beside.{i}", speed, "must be above 0, in m/s")
    if options.skipped >= options.driven:
        allowed = f"must be below options.driven, {options.driven:g} s"
        raise InputError(scene.file, "options.skipped", options.skipped, allowed)


def run(
    scene: RideScene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress
) -> dict[str, Any]:
    """Compute standard deviations over speed by statistical linearisation, Monte Carlo copies and engines' runs; saves
    ``nonlinear.nc`` and two figures, and returns the summary."""
    from studies.ride_figures import FigureHeading, engine_spectra_figure, nonlinear_figure

    check(scene, engines)
    assert scene.speeds is not None
    options, vehicle = _study_options(scene), vehicle_of(scene)
    speed, road = options.shown(scene.speeds.all()), excitation_of(scene, wheels(vehicle))
    results = {
        "reference": run_scene(scene, "reference", sampling=options, progress=report_progress, error=scene.error)
    }
    results["reference"].save(output_folder / "nonlinear.nc")
    answer, runs, failed = results["reference"].detail, dict[str, EngineRide](), dict[str, str]()
    for engine in (engine for engine in engines if engine in INTEGRATORS):
        report_progress(f"{engine} in time", 0.8)
        try:
            results[engine] = run_scene(scene, engine, sampling=options, error=scene.error)
        except RunFailed as error:
            failed[engine] = str(error)
            continue
        runs[engine] = results[engine].detail
    top = FigureHeading(scene.title, results)
    nonlinear_figure(answer, top, output_folder / "deviations.png")
    if runs:
        engine_spectra_figure(runs, answer.shown.vehicle, road, speed, top, output_folder / "spectra.png")
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "failed": failed,
        "results": results,
        "answer": _summary_of_deviations(answer),
        "table": _table_lines(answer, speed)
        + _lift_off_shares(vehicle, answer, runs)
        + _engine_run_lines(runs, answer, road, speed),
    }


def _study_options(scene: RideScene) -> Options:
    return read(Options, scene.options, scene.file, "options")


def _summary_of_deviations(nonlinear_sweep: NonlinearRide) -> dict[str, Any]:
    """Summary: standard deviation and mean (SI) of each output at all speeds, None for values that are not finite; for
    tyres that may lift off, those of the Monte Carlo copies at the copies' speeds."""
    copies = list(nonlinear_sweep.copies.values())
    table: dict[str, Any] = {
        "speed": list(nonlinear_sweep.copies) if nonlinear_sweep.tyres_may_lift else nonlinear_sweep.speeds.tolist()
    }
    for key, on_road in (("deviation", nonlinear_sweep.deviation), ("mean", nonlinear_sweep.quantity_by_speed("mean"))):
        values = (
            np.array([getattr(copies_at_speed, key) for copies_at_speed in copies])
            if nonlinear_sweep.tyres_may_lift
            else on_road
        )
        table[key] = {
            name: [float(value) if np.isfinite(value) else None for value in values[:, i]]
            for i, name in enumerate(nonlinear_sweep.shown.covariance.names)
        }
    return table


def _table_lines(nonlinear_sweep: NonlinearRide, speed: float) -> list[str]:
    """Lines for the screen: the springs' equivalent gains at a speed (m/s), and the Monte Carlo copies with the errors
    of both linear vehicles relative to them."""
    lines, shown = [f"  at {speed:g} m/s"], nonlinear_sweep.shown
    for name, spring in shown.springs.items():
        k, c = spring.equivalent_gains
        lines.append(
            f"    {name}: {k:.5g} N/m and {c:.5g} N s/m stand for it; its travel has the mean "
            f"{1e3 * spring.travel:+.2f} mm and the deviation {1e3 * spring.deviation:.3g} mm"
        )
    if not nonlinear_sweep.tyres_may_lift:
        lines += [f"    {sentence}" for sentence in shown.sentences]
    lines.append(f"    gains found in {len(shown.gain_changes)} iterations, to {shown.fixed_point_distance:.0e}")
    for speed_of_copies, copies in nonlinear_sweep.copies.items():
        lines.append(
            f"  at {speed_of_copies:g} m/s beside {len(copies.moments[0])} copies of {copies.duration:.0f} s: "
            "deviations and means, kurtosis (3 if Gaussian)"
        )
        width = max(map(len, copies.names))
        for i, name in enumerate(copies.names):
            deviation = f"{copies.deviation[i]:>10.4g} ± {50 * copies.error[i] / copies.variance[i]:.1f} %"
            mean = f"mean {copies.mean[i]:+.3g} ± {copies.mean_error[i]:.1g}, {copies.kurtosis[i]:.1f}"
            lines.append(
                f"    {name:<{width}}{deviation}{_errors_at_speed(nonlinear_sweep, speed_of_copies, i)}   {mean}"
            )
    return lines


def _errors_at_speed(nonlinear_sweep: NonlinearRide, speed: float, output_number: int) -> str:
    """Text on the errors of small motion and of statistical linearisation of an output at a speed (m/s); ""
    if the sweep does not have the speed."""
    matching = np.flatnonzero(np.isclose(nonlinear_sweep.speeds, speed))
    if not len(matching):
        return ""
    true = nonlinear_sweep.copies[speed].deviation[output_number]
    small, replaced = (
        100 * (values[matching[0], output_number] / true - 1)
        for values in (nonlinear_sweep.small_motion, nonlinear_sweep.deviation)
    )
    return f"   small motion {small:+.1f} %, statistical linearisation {replaced:+.1f} %"


def _lift_off_shares(
    vehicle: SpatialVehicle, nonlinear_sweep: NonlinearRide, runs_by_engine: dict[str, EngineRide]
) -> list[str]:
    """Lines for the screen on two shares of time for each tyre: for which a tyre that cannot lift off would pull, by a
    Gaussian law, and for which it is in the air in the engines' runs. Empty if no tyre may lift off."""
    from scipy.special import ndtr

    if not vehicle.lifts:
        return []
    loads, names, largest_deviations = (
        static_preloads(vehicle).tyres,
        nonlinear_sweep.shown.covariance.names,
        nonlinear_sweep.deviation.max(axis=0),
    )
    lines = [
        "  tyres lift in copies and engines; small motion and statistical linearisation keep them on the road and "
        "are no answer where a tyre would pull"
    ]
    for spec in (spec for spec in vehicle.outputs if isinstance(spec, TyreOutput) and spec.kind == "tyre force"):
        shares = [
            f"{engine} {100 * np.mean(run.output_values(spec.name) <= -loads[spec.tyre]):.2g} %"
            for engine, run in runs_by_engine.items()
        ]
        pulls = float(ndtr(-loads[spec.tyre] / largest_deviations[names.index(spec.name)]))
        air_text = f"; in the air {', '.join(shares)}" if shares else ""
        lines.append(
            f"    {spec.name}: {loads[spec.tyre]:.4g} N at rest; on the road it would pull for up to "
            f"{100 * pulls:.2g} % of the time{air_text}"
        )
    return lines


def _engine_run_lines(
    runs_by_engine: dict[str, EngineRide], nonlinear_sweep: NonlinearRide, road_excitation: RoadExcitation, speed: float
) -> list[str]:
    """Lines for the screen: the engines' standard deviations beside statistical linearisation, and the difference
    between the engines."""
    if not runs_by_engine:
        return []
    shown, (first, *other_runs) = nonlinear_sweep.shown, runs_by_engine.items()
    length = float(first[1].times[-1])
    errors = standard_errors(shown.vehicle, road_excitation, speed, length)[1] / shown.covariance.variance / 2
    lines = [f"  in time at {speed:g} m/s, {length:.3g} s of one road: deviation, beside statistical linearisation"]
    for engine, run in runs_by_engine.items():
        for i, name in enumerate(run.names):
            value = run.outputs[:, i].std()
            if np.isfinite(value):
                difference_percent = 100 * (value / shown.covariance.deviation[i] - 1)
                lines.append(
                    f"    {engine:<8} {name}: {value:.4g}, {difference_percent:+.1f} % (one path scatters by "
                    f"{100 * errors[i]:.1f} %)"
                )
    for engine, run in other_runs:
        gap = np.abs(run.run.positions - first[1].run.positions).max()
        lines.append(f"    {engine} and {first[0]}: positions within {gap:.1e} m or rad on the same road")
    return lines


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("ride_nonlinear")
