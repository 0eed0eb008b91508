"""Bent springs on a random road: statistical linearisation against Monte Carlo, both engines in time."""

from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from models.systems.ride.in_engines import Ride, ridden
from scipy.integrate import quad

from models.ride.covariance import stationary
from models.ride.excited import excited
from models.ride.frequency import spectra, standard_errors
from models.ride.gaussian_laws import of_curve, of_friction
from models.ride.nonlinear_copies import copies_in_time
from models.ride.road_path import road_path
from models.ride.statistical_linearisation import promised, statistically_linear
from models.road.excitation import Excitation
from models.road.two_track import LEVEL, excitation, half_track, on_track, road_of_level
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import linearise, wheels
from models.vehicles.vehicle_file import load_vehicle
from validation.common.rows import Row, System, Table, at_most

TITLE = "Nonlinear ride: statistical linearisation, Monte Carlo beside it, both engines in time"
SYSTEM: System = "ride"
ENGINES = ("exudyn", "mujoco")
SEED, GRAVITY, SPEED = 2211, 9.81, 20.0
NONLINEAR = "quarter_car_nonlinear"
LEVELS = (1.0, 4.0, 16.0)
"""Times the level of the paper: class C or so, E, and G, where the stops are met all the time."""
COPIES, LASTING = (60, 400), (1.5, 10.0)
"""Monte Carlo in the quick and in the full share; its length in s."""
STEP, DRIVEN, SKIPPED = 2.5e-3, 24.0, 4.0
"""Of the engines' runs with 19 freedoms (s): longest step, length, and what is left out at the beginning."""
NONLINEAR_STEP, NONLINEAR_DRIVEN = 2e-3, (1.0, 60.0)
MILD = 1500.0
"""Damping (N s/m) beside a law that is looked at alone."""
SHOWN = ("body centre", "left occupant", "travel front left", "tyre force front left")
SAME = "the same tableau, road and laws; the sums are taken in another order"


def measure(quick: bool, folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Gains, fixed point, one level of road and a short path; in full three levels, and 19 freedoms in time."""
    rows = [*_gains(), *_fixed_point()]
    table = []
    for level in LEVELS[: 1 if quick else None]:
        found, line = _level(level, quick)
        rows += found
        table.append(line)
    rows += _bent_in_engines(quick)
    if quick:
        return rows, {"levels": table, "spectra": {}}
    rows += [_linear_copies(), *_alone()]
    found, shown = _linear_in_engines()
    return rows + found, {"levels": table, "spectra": shown}


@cache
def ride(name: str, level: float = 1.0, gravity: float = GRAVITY) -> tuple[SpatialVehicle, Excitation]:
    """A shipped vehicle and a road of some times the paper's level, one without a width on one track."""
    vehicle = replace(load_vehicle(name), gravity=gravity)
    own = wheels(vehicle)
    y = half_track(own)
    return vehicle, excitation(road_of_level(y or 1.0, level * LEVEL), own if y else on_track(own, 1.0))


def _gains() -> list[Row]:
    """Closed forms against the defining integrals, from laws that are all corner to laws that look straight."""
    spring = ride(NONLINEAR)[0].springs[0]
    worst, dry = 0.0, 0.0
    for curve, mean, size in ((spring.rate_force, 0.0, 0.3), (spring.travel_force, 0.01, 0.02)):
        assert curve is not None
        for deviation in size * np.array([0.1, 1.0, 10.0]):
            cut = [(x - mean) / deviation for x in curve.arguments[1:-1]]
            force = expected(lambda x: curve(mean + deviation * x), cut)  # noqa: B023
            gain = expected(lambda x: curve(mean + deviation * x) * x, cut) / deviation  # noqa: B023
            found = of_curve(curve, mean, deviation)
            scale = max(abs(force), abs(gain) * deviation, 1e-3)
            worst = max(worst, abs(found[0] - force) / scale, abs(found[1] - gain) * deviation / scale)
    for ratio in (0.1, 1.0, 10.0, 100.0):
        gain = expected(lambda x: np.tanh(ratio * x) * x, (-1.0 / ratio, 0.0, 1.0 / ratio)) / ratio  # noqa: B023
        dry = max(dry, abs(of_friction(1.0, 1.0, ratio) / gain - 1.0))
    coulomb = of_friction(1.0, 1e-6, 1.0) / np.sqrt(2.0 / np.pi) - 1.0
    return [
        at_most(
            "ride_nonlinear.gains.curves",
            SYSTEM,
            "mean force and gain of damper and stops, closed form against "
            "the defining integrals, at 6 motions, relative",
            worst,
            "",
            1e-9,
            "error functions",
            "closed form",
        ),
        at_most(
            "ride_nonlinear.gains.friction",
            SYSTEM,
            "gain of dry friction, likewise, rates 0.1 to 100 times that of friction, relative",
            dry,
            "",
            1e-9,
            "the trapezoidal rule converges geometrically",
            "closed form",
        ),
        at_most(
            "ride_nonlinear.gains.coulomb",
            SYSTEM,
            "the same against friction (2 / pi)^(1/2) / deviation, which Coulomb's law has",
            abs(float(coulomb)),
            "",
            1e-9,
            "rates 1e6 times that of friction",
            "closed form",
        ),
    ]


def expected(law: Any, cuts: Any) -> float:
    """Mean of law(x) over the standard normal x, cut where the law has corners."""
    edges = np.unique(np.clip([-12.0, *cuts, 12.0], -12.0, 12.0))
    found = [
        quad(lambda x: law(x) * np.exp(-x * x / 2), a, b, epsabs=0.0, epsrel=1e-12, limit=200)[0]
        for a, b in pairwise(edges)
    ]
    return float(sum(found)) / np.sqrt(2 * np.pi)


def _fixed_point() -> list[Row]:
    """Reached, and the same from elsewhere; gravity moves nothing in a vehicle that only goes up and down."""
    vehicle, road = ride(NONLINEAR, 4.0)
    one, other = (statistically_linear(vehicle, road, SPEED, scale) for scale in (1.0, 10.0))
    unloaded = statistically_linear(replace(vehicle, gravity=0.0), road, SPEED)
    apart = [
        float(np.abs(each.covariance.deviation / one.covariance.deviation - 1.0).max()) for each in (other, unloaded)
    ]
    return [
        at_most(
            "ride_nonlinear.fixed_point",
            SYSTEM,
            f"{len(one.changes)} iterations, each change at most "
            f"{one.contraction:.2g} of the last: distance of the gains to the fixed point, relative",
            one.distance,
            "",
            1e-11,
            "last change * c / (1 - c), Banach's bound",
            "none",
        ),
        at_most(
            "ride_nonlinear.start",
            SYSTEM,
            "standard deviations from first gains of a tenfold motion, relative",
            apart[0],
            "",
            1e-10,
            "one fixed point, whatever the start",
            "none",
        ),
        at_most(
            "ride_nonlinear.gravity",
            SYSTEM,
            "standard deviations without gravity, relative",
            apart[1],
            "",
            1e-10,
            "preloads hold the weights, and nothing turns",
            "none",
        ),
    ]


def _level(level: float, quick: bool) -> tuple[list[Row], list[str]]:
    """Deviations and mean travel beside Monte Carlo, each by what its sentence promises."""
    vehicle, road = ride(NONLINEAR, level)
    found = statistically_linear(vehicle, road, SPEED)
    copies = copies_in_time(vehicle, road, SPEED, LASTING[not quick], copies=COPIES[not quick], seed=SEED)
    rows, cells = [], [f"{level:g}"]
    for i, name in enumerate(copies.names):
        error = float(found.covariance.deviation[i] / copies.deviation[i] - 1.0)
        spread = float(copies.error[i] / copies.variance[i] / 2.0)
        cells.append(
            f"{100 * error:+.1f} ± {100 * spread:.1f} % ({100 * found.left_out[i]:.1f} %, {copies.kurtosis[i]:.1f})"
        )
        rows.append(
            at_most(
                f"ride_nonlinear.level.{level:g}.{name}",
                SYSTEM,
                f"{level:g} times the paper's road: "
                f"deviation of {name} beside {len(copies.moments[0])} copies, {copies.duration:.0f} s",
                abs(error),
                "",
                promised(found.left_out[i]) + 4.0 * spread,
                f"left out {100 * found.left_out[i]:.2g} % of the variance: what its sentence promises, "
                "and 4 standard errors",
                "none",
            )
        )
    travel = copies.names.index("travel front left")
    size = float(copies.deviation[travel])
    shift = float(found.mean[travel] - copies.mean[travel]) / size
    rows.append(
        at_most(
            f"ride_nonlinear.mean.{level:g}",
            SYSTEM,
            f"the same: mean travel, {1e3 * found.mean[travel]:.2f} mm, beside the copies', by its deviation",
            abs(shift),
            "",
            promised(found.left_out[travel]) + 4.0 * float(copies.mean_error[travel]) / size,
            "as above: the damper pulls the body down",
            "none",
        )
    )
    return rows, cells


def _linear_copies() -> Row:
    """What the copies do without bent springs is what the covariance says."""
    vehicle, road = ride("quarter_car")
    exact = stationary(excited(linearise(vehicle), road, SPEED))
    copies = copies_in_time(vehicle, road, SPEED, LASTING[1], copies=COPIES[1], seed=SEED)
    return at_most(
        "ride_nonlinear.linear",
        SYSTEM,
        f"quarter_car, {COPIES[1]} copies in time: variances against the covariance, largest |z| of 3",
        float(np.abs(copies.z(exact.deviation)).max()),
        "",
        4.0,
        "of 3 normal values one beyond 4 in 5000 times",
        "none",
    )


def _alone() -> list[Row]:
    """Each law by itself where it is at its worst: what the sentences promise was found on these, too."""
    vehicle, _ = ride(NONLINEAR)
    spring = vehicle.springs[0]
    others: dict[str, tuple[float, dict[str, Any]]] = {
        "damper": (4.0, {"travel_force": None, "friction": 0.0}),
        "friction of 100 N": (0.25, {"travel_force": None, "rate_force": None, "damping": MILD, "friction": 100.0}),
        "stops": (64.0, {"rate_force": None, "damping": MILD, "friction": 0.0}),
    }
    rows = []
    for name, (level, laws) in others.items():
        alone = replace(vehicle, springs=(replace(spring, **laws),))
        road = ride(NONLINEAR, level)[1]
        found = statistically_linear(alone, road, SPEED)
        copies = copies_in_time(alone, road, SPEED, LASTING[1], copies=COPIES[1] // 2, seed=SEED)
        error = np.abs(found.covariance.deviation / copies.deviation - 1.0)
        kept = [promised(share) for share in found.left_out] + 4.0 * copies.error / copies.variance / 2.0
        worst = int((error / kept).argmax())
        rows.append(
            at_most(
                f"ride_nonlinear.alone.{name.split()[0]}",
                SYSTEM,
                f"{name} alone on {level:g} times the "
                f"paper's road: deviation of {copies.names[worst]}, which keeps its promise worst",
                float(error[worst]),
                "",
                float(kept[worst]),
                f"left out {100 * found.left_out[worst]:.2g} %: the promise, and 4 standard errors",
                "none",
            )
        )
    return rows


def _bent_in_engines(quick: bool) -> list[Row]:
    """The nonlinear quarter car under gravity in both engines; its mean travel where the damper pulls it."""
    vehicle, excitation_ = ride(NONLINEAR)
    road = road_path(excitation_, SPEED, NONLINEAR_STEP)
    runs = {
        engine: ridden(
            engine, vehicle, road, NONLINEAR_DRIVEN[not quick], seed=SEED, skipped=SKIPPED * (not quick), every=5
        )
        for engine in ENGINES
    }
    rows = [_apart("bent", f"{NONLINEAR} under gravity, {NONLINEAR_DRIVEN[not quick]:g} s", runs)]
    if quick:
        return rows
    found = statistically_linear(vehicle, excitation_, SPEED)
    travel, force = (found.covariance.names.index(f"{kind} front left") for kind in ("travel", "tyre force"))
    size, left = found.covariance.deviation, found.left_out
    error, _ = standard_errors(found.vehicle, excitation_, SPEED, NONLINEAR_DRIVEN[1] - SKIPPED)
    for engine, run in runs.items():
        shift = abs(run.outputs[:, travel].mean() - found.mean[travel]) / size[travel]
        rows.append(
            at_most(
                f"ride_nonlinear.mean.{engine}",
                SYSTEM,
                f"the same in {engine}: mean travel, predicted {1e3 * found.mean[travel]:.2f} mm, by its deviation",
                float(shift),
                "",
                promised(left[travel]) + 4.0 * float(error[travel] / size[travel]),
                "what its sentence promises, and 4 standard errors",
                "none",
            )
        )
        mean = abs(run.outputs[:, force].mean()) / error[force]
        rows.append(
            at_most(
                f"ride_nonlinear.load.{engine}",
                SYSTEM,
                "the same: mean of the dynamic tyre force, |z|",
                float(mean),
                "",
                4.0,
                "the tyre bears the weight, however the damper pulls",
                "none",
            )
        )
    return rows


def _apart(id: str, what: str, runs: dict[str, Ride]) -> Row:
    one, other = (runs[engine].run for engine in ENGINES)
    gap = max(np.abs(one.positions - other.positions).max(), np.abs(one.rates - other.rates).max())
    return at_most(
        f"ride_nonlinear.path.{id}",
        SYSTEM,
        f"{what} on one random road: exudyn against mujoco, all states",
        float(gap),
        "m, rad, m/s, rad/s",
        1e-12,
        SAME,
        "native",
    )


def _linear_in_engines() -> tuple[list[Row], dict[str, Any]]:
    """19 freedoms, gravity on, one path of the random road: variances and means against the covariance."""
    vehicle, excitation_ = ride("r19_ride")
    road = road_path(excitation_, SPEED, STEP)
    runs = {engine: ridden(engine, vehicle, road, DRIVEN, seed=SEED, skipped=SKIPPED, every=2) for engine in ENGINES}
    linear = linearise(vehicle)
    exact = stationary(excited(linear, excitation_, SPEED))
    errors = standard_errors(linear, excitation_, SPEED, DRIVEN - SKIPPED)
    rows = [_apart("r19_ride", f"r19_ride under gravity, {DRIVEN:g} s", runs)]
    for engine, run in runs.items():
        mean = run.outputs.mean(axis=0) / errors[0]
        square = ((run.outputs**2).mean(axis=0) - exact.variance) / errors[1]
        share = float(np.median(errors[1] / exact.variance / 2.0))
        rows += [
            at_most(
                f"ride_nonlinear.variance.{engine}",
                SYSTEM,
                f"r19_ride in {engine}, {DRIVEN - SKIPPED:g} s: "
                f"variances of 16 outputs against the covariance (deviations to {100 * share:.1f} %), largest |z|",
                float(np.abs(square).max()),
                "",
                4.0,
                "standard errors by the densities: samples of a path know of each other",
                "none",
            ),
            at_most(
                f"ride_nonlinear.zero.{engine}",
                SYSTEM,
                "the same: means about the equilibrium, largest |z| of 16",
                float(np.abs(mean).max()),
                "",
                4.0,
                "the road has no mean, and gravity is carried",
                "none",
            ),
        ]
    return rows, _spectra(runs, linear, excitation_)


def _spectra(runs: dict[str, Ride], linear: LinearVehicle, excitation_: Excitation) -> dict[str, Any]:
    """One-sided densities over Hz of shown outputs: the covariance's own, and each engine's by Welch's method."""
    from scipy.signal import welch

    frequency = np.geomspace(0.2, 40.0, 300)
    own = 4.0 * np.pi * spectra(linear, excitation_, SPEED, 2.0 * np.pi * frequency)
    names = [output.name for output in linear.outputs]
    shown = {"frequency": frequency.tolist(), "own": {name: own[:, names.index(name)].tolist() for name in SHOWN}}
    for engine, run in runs.items():
        f, density = welch(run.outputs, 1.0 / run.interval, nperseg=round(4.0 / run.interval), axis=0)
        keep = (f > 0.4) & (f <= frequency[-1])  # below, leakage of the windows
        shown[engine] = {
            "frequency": f[keep].tolist(),
            **{name: density[keep, names.index(name)].tolist() for name in SHOWN},
        }
    return shown


def tables(data: dict[str, Any]) -> list[Table]:
    """What statistical linearisation is worth."""
    names = [output.name for output in ride(NONLINEAR)[0].outputs]
    note = (
        "Error of each standard deviation beside Monte Carlo; in brackets what was left out of the variance, and "
        "the kurtosis, 3 for a Gaussian output. The road's level by that of the paper."
    )
    return [Table("Statistical linearisation", note, ("level", *names), tuple(tuple(row) for row in data["levels"]))]


def draw(data: dict[str, Any]) -> list[tuple[str, Any]]:
    """Spectra of both engines' runs over the covariance's own."""
    if not data["spectra"]:
        return []
    from models.drawing.figures import COLOURS, LABELS, plt

    shown = data["spectra"]
    units = ("(m/s$^2$)$^2$/Hz", "(m/s$^2$)$^2$/Hz", "m$^2$/Hz", "N$^2$/Hz")
    figure, axes = plt.subplots(2, 2, figsize=(10.0, 6.4), sharex=True)
    for axis, name, unit in zip(axes.ravel(), SHOWN, units, strict=True):
        for engine, width, style in zip(ENGINES, (2.2, 1.0), ("-", "--"), strict=True):
            own = shown[engine]
            axis.loglog(
                own["frequency"],
                own[name],
                style,
                color=COLOURS[engine],
                linewidth=width,
                label=f"{LABELS[engine]}, {DRIVEN - SKIPPED:g} s in time",
            )
        axis.loglog(shown["frequency"], shown["own"][name], "k", linewidth=1.2, label="of the covariance")
        top = max(shown["own"][name])
        axis.set(title=name.capitalize(), ylabel=f"one-sided density [{unit}]", ylim=(1e-5 * top, 5 * top))
    for axis in axes[1]:
        axis.set_xlabel("frequency [Hz]")
    axes[0, 0].legend(fontsize=8)
    figure.suptitle(f"R19-ride at {SPEED:g} m/s: one path through both engines, over the spectra of its covariance")
    caption = (
        "Spectra of one path of 19 freedoms on the paper's road through both engines, gravity on, by Welch's "
        "method; black, what the covariance's own linear vehicle and road say."
    )
    return [(caption, figure)]
