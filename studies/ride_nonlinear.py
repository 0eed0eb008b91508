"""How much a vehicle with bent springs moves on a random road, and when its covariance is no longer good.

Where tyres may lift, the answer is that of the copies: what stands for the vehicle over speed keeps them on the road.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.core.errors import InputError
from models.core.strict import Strict, quantity, read
from models.engines.spatial_protocol import INTEGRATORS
from models.ride.covariance import stationary
from models.ride.excited import excited
from models.ride.nonlinear_copies import Copies, copies_in_time, followed
from models.ride.road_path import check_rates, road_path
from models.ride.statistical_linearisation import StatisticallyLinear, bent, statistically_linear
from models.ride.time_averages import standard_errors
from models.road.excitation import Excitation
from models.systems.ride.in_engines import Ride, ridden
from models.systems.ride.of_scene import excitation_of, linear_vehicle, vehicle_of
from models.systems.ride.scene import RideScene
from models.vehicles.spatial import SpatialVehicle, TyreOutput
from models.vehicles.spatial_linear import preloads, wheels

SYSTEM = "ride"
Progress = Callable[[str, float], None]
STEP = 2e-3
"""Longest step (s) of the engines' runs; steep springs want a shorter one."""


class Options(Strict):
    """[options] of this study."""

    beside: list[float] = Field(default_factory=list, description="speeds in m/s for Monte Carlo; the middle if none")
    copies: int = Field(default=200, ge=2, le=100_000, description="of the vehicle, each on a road of its own")
    lasting: float = quantity("s", "length of each copy after it has forgotten its beginning", default=10.0)
    speed: float | None = quantity("m/s", "of the engines' runs and tables; the middle one if not given", default=None)
    driven: float = quantity("s", "length of the engines' runs", default=30.0)
    skipped: float = quantity("s", "left out at their beginning", default=4.0, zero=True)
    seed: int = Field(default=1, ge=0, lt=2**64, description="of all roads in time")


@dataclass(frozen=True)
class Answer:
    """By speed: the vehicle of small motion (N, p), the replaced one, and Monte Carlo where it was asked for.

    lifts : whether tyres may lift, in Monte Carlo alone.
    """

    speeds: np.ndarray
    small: np.ndarray
    found: list[StatisticallyLinear]
    copies: dict[float, Copies]
    lifts: bool = False

    def of(self, part: str) -> np.ndarray:
        """One part (N, p) of what was found."""
        return np.array([getattr(each, part) for each in self.found])

    @property
    def deviation(self) -> np.ndarray:
        """Deviations (N, p) by statistical linearisation."""
        return np.array([each.covariance.deviation for each in self.found])


def check(scene: RideScene, engines: tuple[str, ...]) -> None:
    """Refuse a varying speed, a vehicle that is linear, weightings, and damped tyres on a road without rates."""
    if scene.speeds is None:
        raise InputError(scene.file, "study", scene.study, "runs at constant speeds; with a drive use ride_drive")
    vehicle = vehicle_of(scene)
    if not (bent(vehicle) or vehicle.lifts):
        allowed = "has neither curves nor friction, nor tyres that lift: use ride, which is exact for it"
        raise InputError(scene.file, "vehicle.file", scene.vehicle.file, allowed)
    for name, by in scene.weighting.items():
        raise InputError(scene.file, f"weighting.{name}", by, "is not read by this study: leave it out")
    check_rates(vehicle, excitation_of(scene, wheels(vehicle)), scene.file)
    options = _options(scene)
    for i, speed in enumerate(options.beside):
        if not speed > 0.0:
            raise InputError(scene.file, f"options.beside.{i}", speed, "must be above 0, in m/s")
    if options.skipped >= options.driven:
        allowed = f"must be below options.driven, {options.driven:g} s"
        raise InputError(scene.file, "options.skipped", options.skipped, allowed)


def run(scene: RideScene, engines: tuple[str, ...], folder: Path, progress: Progress) -> dict[str, Any]:
    """Sweep the speeds, run copies and engines in time; saves ``nonlinear.nc`` and two figures."""
    from studies.ride_nonlinear_figures import deviations_figure, spectra_figure

    check(scene, engines)
    assert scene.speeds is not None
    vehicle, options, speeds = vehicle_of(scene), _options(scene), scene.speeds.all()
    road = excitation_of(scene, wheels(vehicle))
    speed = options.speed or float(speeds[len(speeds) // 2])
    answer = _swept(vehicle, road, speeds, options, options.beside or [speed], progress)
    own = statistically_linear(vehicle.with_tyres(pushes_only=False), road, speed)
    runs = _in_engines(vehicle, road, speed, engines, options, progress)
    _save(scene, answer, folder / "nonlinear.nc")
    deviations_figure(answer, own.vehicle.outputs, scene.title, folder / "deviations.png")
    if runs:
        spectra_figure(runs, own.vehicle, road, speed, scene.title, folder / "spectra.png")
    return {
        "scene": scene.title,
        "folder": str(folder),
        "failed": {},
        "answer": _answer(answer),
        "table": _table(answer, own, speed) + _lifted(vehicle, answer, runs) + _time_table(runs, own, road, speed),
    }


def _options(scene: RideScene) -> Options:
    return read(Options, scene.options, scene.file, "options")


def _swept(
    vehicle: SpatialVehicle,
    road: Excitation,
    speeds: np.ndarray,
    options: Options,
    beside: list[float],
    progress: Progress,
) -> Answer:
    """Small motion and statistical linearisation at all speeds, Monte Carlo at some."""
    linear, on_road = linear_vehicle(vehicle), vehicle.with_tyres(pushes_only=False)
    small, found, copies = [], [], {}
    for i, speed in enumerate(speeds):
        progress("statistical linearisation", 0.3 * i / len(speeds))
        small.append(stationary(excited(linear(speed), road, speed)).deviation)
        found.append(statistically_linear(on_road, road, speed))
    for i, speed in enumerate(beside):
        progress(f"Monte Carlo at {speed:g} m/s", 0.3 + 0.4 * i / len(beside))
        copies[speed] = copies_in_time(vehicle, road, speed, options.lasting, copies=options.copies, seed=options.seed)
    return Answer(speeds, np.array(small), found, copies, vehicle.lifts)


def _in_engines(
    vehicle: SpatialVehicle,
    road: Excitation,
    speed: float,
    engines: tuple[str, ...],
    options: Options,
    progress: Progress,
) -> dict[str, Ride]:
    """One path of the road through each engine that runs in time."""
    path, runs = road_path(road, speed, min(STEP, followed(vehicle, speed))), {}
    for engine in (engine for engine in engines if engine in INTEGRATORS):
        progress(f"{engine} in time", 0.8)
        runs[engine] = ridden(
            engine,
            vehicle,
            path,
            options.driven,
            seed=options.seed,
            skipped=options.skipped,
            every=max(1, round(2.0 * STEP / path.step)),
        )
    return runs


def _save(scene: RideScene, answer: Answer, path: Path) -> None:
    import xarray as xr

    from models.core.result import provenance, write

    axes, few = ("speed", "output"), ("speed_of_copies", "output")
    copies = list(answer.copies.values())
    data = xr.Dataset(
        {
            "deviation": (axes, answer.deviation),
            "small_motion": (axes, answer.small),
            "mean": (axes, answer.of("mean")),
            "left_out": (axes, answer.of("left_out")),
            "copies_deviation": (few, [c.deviation for c in copies]),
            "copies_mean": (few, [c.mean for c in copies]),
            "copies_variance_error": (few, [c.error for c in copies]),
            "copies_kurtosis": (few, [c.kurtosis for c in copies]),
        },
        {
            "speed": ("speed", answer.speeds, {"units": "m/s"}),
            "output": list(answer.found[0].covariance.names),
            "speed_of_copies": ("speed_of_copies", list(answer.copies), {"units": "m/s"}),
        },
    )
    data["unit"] = ("output", [output.unit for output in answer.found[0].vehicle.outputs])
    tyres = {"tyres": "lift in copies alone"} if answer.lifts else {}
    data.attrs = {"title": scene.title, **tyres, **{key: str(value) for key, value in provenance().items()}}
    write(data, path)


def _answer(answer: Answer) -> dict[str, Any]:
    """Deviations and means at all speeds, SI; None where there is none. Of tyres that lift, at the copies' speeds."""
    copies = list(answer.copies.values())
    out: dict[str, Any] = {"speed": list(answer.copies) if answer.lifts else answer.speeds.tolist()}
    for key, found in (("deviation", answer.deviation), ("mean", answer.of("mean"))):
        values = np.array([getattr(each, key) for each in copies]) if answer.lifts else found
        out[key] = {
            name: [float(value) if np.isfinite(value) else None for value in values[:, i]]
            for i, name in enumerate(answer.found[0].covariance.names)
        }
    return out


def _table(answer: Answer, own: StatisticallyLinear, speed: float) -> list[str]:
    """Gains and sentences at one speed; the error of either linear vehicle where Monte Carlo is beside."""
    lines = [f"  at {speed:g} m/s"]
    for name, spring in own.springs.items():
        k, c = spring.gains
        lines.append(
            f"    {name}: {k:.5g} N/m and {c:.5g} N s/m stand for it; its travel has the mean "
            f"{1e3 * spring.travel:+.2f} mm and the deviation {1e3 * spring.deviation:.3g} mm"
        )
    if not answer.lifts:
        lines += [f"    {sentence}" for sentence in own.sentences]
    lines.append(f"    gains found in {len(own.changes)} iterations, to {own.distance:.0e}")
    for beside, copies in answer.copies.items():
        lines.append(
            f"  at {beside:g} m/s beside {len(copies.moments[0])} copies of {copies.duration:.0f} s: "
            "deviations and means, kurtosis (3 if Gaussian)"
        )
        width = max(map(len, copies.names))
        for i, name in enumerate(copies.names):
            deviation = f"{copies.deviation[i]:>10.4g} ± {50 * copies.error[i] / copies.variance[i]:.1f} %"
            mean = f"mean {copies.mean[i]:+.3g} ± {copies.mean_error[i]:.1g}, {copies.kurtosis[i]:.1f}"
            lines.append(f"    {name:<{width}}{deviation}{_off(answer, beside, i)}   {mean}")
    return lines


def _off(answer: Answer, speed: float, i: int) -> str:
    """Errors of small motion and of statistical linearisation where the speed is among those of the sweep."""
    at = np.flatnonzero(np.isclose(answer.speeds, speed))
    if not len(at):
        return ""
    true = answer.copies[speed].deviation[i]
    small, found = (100 * (values[at[0], i] / true - 1) for values in (answer.small, answer.deviation))
    return f"   small motion {small:+.1f} %, statistical linearisation {found:+.1f} %"


def _lifted(vehicle: SpatialVehicle, answer: Answer, runs: dict[str, Ride]) -> list[str]:
    """Share of time for which each tyre would pull by its Gaussian law, and for which it is in the air in the engines'
    runs; nothing where no tyre lifts.
    """
    from scipy.special import ndtr

    if not vehicle.lifts:
        return []
    loads = preloads(vehicle).tyres
    lines = [
        "  tyres lift in copies and engines; small motion and statistical linearisation keep them on the road and "
        "are no answer where a tyre would pull"
    ]
    for spec in (spec for spec in vehicle.outputs if isinstance(spec, TyreOutput) and spec.kind == "tyre force"):
        shares = [
            f"{engine} {100 * np.mean(run.of(spec.name) <= -loads[spec.tyre]):.2g} %" for engine, run in runs.items()
        ]
        worst = max(
            float(deviation[answer.found[0].covariance.names.index(spec.name)]) for deviation in answer.deviation
        )
        pulls = float(ndtr(-loads[spec.tyre] / worst))
        told = f"; in the air {', '.join(shares)}" if shares else ""
        lines.append(
            f"    {spec.name}: {loads[spec.tyre]:.4g} N at rest; on the road it would pull for up to "
            f"{100 * pulls:.2g} % of the time{told}"
        )
    return lines


def _time_table(runs: dict[str, Ride], own: StatisticallyLinear, road: Excitation, speed: float) -> list[str]:
    """Deviations of the engines' runs beside those of statistical linearisation, and how far the engines are apart."""
    if not runs:
        return []
    first = next(iter(runs.values()))
    length = float(first.times[-1])
    errors = standard_errors(own.vehicle, road, speed, length)[1] / own.covariance.variance / 2
    lines = [f"  in time at {speed:g} m/s, {length:.3g} s of one road: deviation, beside statistical linearisation"]
    for engine, run in runs.items():
        for i, name in enumerate(run.names):
            value = run.outputs[:, i].std()
            if np.isfinite(value):
                off = 100 * (value / own.covariance.deviation[i] - 1)
                lines.append(
                    f"    {engine:<8} {name}: {value:.4g}, {off:+.1f} % (one path scatters by {100 * errors[i]:.1f} %)"
                )
    for engine, run in list(runs.items())[1:]:
        gap = np.abs(run.run.positions - first.run.positions).max()
        lines.append(f"    {engine} and {next(iter(runs))}: positions within {gap:.1e} m or rad on the same road")
    return lines


if __name__ == "__main__":
    from studies.command_line import study

    study("ride_nonlinear")
