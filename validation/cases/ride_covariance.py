"""Stationary covariance against closed forms and quadrature; outputs without a variance; the fast route over speeds."""

import time
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from models.ride.closed_forms import QuarterCar, half_car_acceleration, split_half_car
from models.ride.covariance import FINITE, Covariance, stationary
from models.ride.excited import DelayedSystem, excited
from models.ride.frequency import quadrature, spectra
from models.ride.marginal import Unstable, parts
from models.ride.sweep import sweep
from models.ride.weighting import WEIGHTINGS, weighted
from models.road.excitation import Excitation
from models.road.shape_filter import ShapeFilter
from models.road.two_track import CASES, TwoTrackRoad, excitation, half_track, input_covariance, road_of_level
from models.systems.ride.of_scene import linear_vehicle
from models.vehicles.linear_vehicle import LinearVehicle
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import linearise
from models.vehicles.vehicle_file import load_vehicle
from validation.common.rows import Row, System, Table, aim, at_most, behaves, within
from validation.ride.ride_corners import corners
from validation.ride.ride_twins import twin

TITLE = "Ride: stationary covariance with exact delays"
SYSTEM: System = "ride"
SEED = 5
"""Of the asymmetric twins, and of the roads and speeds they run at."""
CORNER = QuarterCar(300.0, 40.0, 2e4, 1500.0, 2e5)
INTENSITY = 1e-4
"""Of the walking road, m^2 per m."""
SHIPPED = ("r19_ride", "r19_free", "seven_freedoms", "three_axle_truck")
TWINS = ("r19_ride", "r19_free", "three_axle_truck")
FILTERS = {"left occupant": "Wk", "right occupant": "Wk", "body centre": "Wk"}
SPEEDS = np.linspace(5.0, 50.0, 60)
LEAST = 1e-20
"""Variances below this share of the largest of their kind are zero by symmetry."""


def measure(quick: bool, folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """All but the engines' own linearisations in quick; there, of the vehicles, two at one speed."""
    routes = [_by_quadrature(*job) for job in _jobs(quick)]
    rows = [
        *_closed_rows(),
        *_route_rows(routes),
        *_limit_rows(),
        *_weighting_rows(),
        *_white_rows(),
        *_free_rows(),
        _unstable_row(),
    ]
    engines = () if quick else ("exudyn", "mujoco")
    rows += [_engine_row(engine) for engine in engines]
    speeds = SPEEDS[::20] if quick else SPEEDS
    fast_rows, figure = _fast(speeds, "reference" if quick else "exudyn")
    return rows + fast_rows, {"routes": routes, "figure": figure}


@cache
def _vehicle(name: str, seed: int = 0) -> SpatialVehicle:
    vehicle = load_vehicle(name)
    return twin(vehicle, seed) if seed else vehicle


def _cases(vehicle: LinearVehicle, road: TwoTrackRoad | None = None) -> dict[int, Excitation]:
    road = road or road_of_level(half_track(vehicle.wheels))
    return {number: excitation(road, vehicle.wheels, *case) for number, case in CASES.items()}


def _jobs(quick: bool) -> Iterator[tuple[str, int, TwoTrackRoad | None, float]]:
    """Vehicle, seed of its twin or 0, its own road or None for the paper's, speed."""
    if quick:
        yield from (("r19_ride", 0, None, 20.0), ("three_axle_truck", SEED, _random_road(SEED), 13.0))
        return
    rng = np.random.default_rng(SEED)
    for name in SHIPPED:
        yield from ((name, 0, None, speed) for speed in (2.0, 20.0, 50.0))
    for name in TWINS:
        for seed in (SEED, SEED + 1):
            yield from ((name, seed, _random_road(int(rng.integers(1000))), rng.uniform(1.0, 60.0)) for _ in range(2))


def _random_road(seed: int) -> TwoTrackRoad:
    """Corners over a decade, intensities over two."""
    rng = np.random.default_rng(seed)
    mean, roll = (ShapeFilter(10 ** rng.uniform(-1.5, 0.5), 1e-5 * 10 ** rng.uniform(-1, 1)) for _ in range(2))
    return TwoTrackRoad(mean, roll)


def _by_quadrature(name: str, seed: int, road: TwoTrackRoad | None, speed: float) -> dict[str, Any]:
    """Largest relative difference of standard deviations, of all outputs in all five cases, and both own errors."""
    vehicle = linearise(_vehicle(name, seed), speed)
    worst, errors, count = 0.0, [0.0, 0.0], 0
    for one in _cases(vehicle, road).values():
        found, other = stationary(excited(vehicle, one, speed)), quadrature(vehicle, one, speed)
        told = _told(found)
        worst = max(worst, _worst(found.deviation[told], np.sqrt(other.variance[told])))
        errors = [max(errors[0], found.error[told].max()), max(errors[1], other.error[told].max())]
        count += int(told.sum())
    label = name + (f", twin {seed}" if seed else "")
    return {"vehicle": label, "speed": speed, "values": count, "worst": worst, "errors": errors}


def _told(found: Covariance) -> np.ndarray:
    """Outputs that are not zero by symmetry."""
    return found.variance > LEAST * found.variance.max()


def _worst(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.abs(found / expected - 1.0).max())


def _walk(places: tuple[float, ...], corner: float = 0.0) -> Excitation:
    """One track under axles at ``places``, z' = -corner z + w."""
    heights = tuple(np.eye(len(places))[:, [i]] for i in range(len(places)))
    filter_ = np.array([[-corner]]), np.array([[INTENSITY**0.5]])
    return Excitation(*filter_, heights, tuple(places[0] - x for x in places))


def _closed_rows() -> list[Row]:
    """Quarter car and half car against their formulas."""
    worst = {"acceleration": 0.0, "travel": 0.0, "deflection": 0.0}
    for corner in (0.0, 1e-6, 1e-3, 0.3, 3.0):
        found = stationary(excited(corners([(0.0, CORNER)]), _walk((0.0,), corner), 20.0)).variance
        q, w = 20.0 * INTENSITY, 20.0 * corner
        pairs = {
            "acceleration": (found[0], CORNER.body_acceleration(q, w)),
            "travel": (found[1], CORNER.suspension_travel(q, w)),
        }
        pairs |= {"deflection": (found[2], CORNER.tyre_deflection(q))} if corner == 0.0 else {}
        worst |= {key: max(worst[key], abs(a / b - 1)) for key, (a, b) in pairs.items()}
    rows = [
        at_most(
            f"ride_covariance.quarter.{key}",
            SYSTEM,
            f"quarter car, variance of the {key}, corners of the road from 0 to 3 rad/m",
            value,
            "",
            1e-10,
            "asked; the sums have no cancellation",
            "closed form",
        )
        for key, value in worst.items()
    ]
    a, b = 1.2, 1.5
    front, rear, inertia = split_half_car(CORNER, a, b)
    vehicle = corners([(a, front), (-b, rear)], np.diag([front.m_s + rear.m_s, inertia]))
    half = [stationary(excited(vehicle, _walk((a, -b)), v)).variance[0] for v in (3.0, 17.0, 50.0)]
    formula = [half_car_acceleration(CORNER, v * INTENSITY, a, b, v) for v in (3.0, 17.0, 50.0)]
    off = _worst(np.array(half), np.array(formula))
    what = "half car that splits into quarter cars, variance at its centre of gravity, delay exact, 3 to 50 m/s"
    return [*rows, at_most("ride_covariance.half", SYSTEM, what, off, "", 1e-10, "asked", "closed form")]


def _route_rows(routes: list[dict[str, Any]]) -> list[Row]:
    rows = []
    for name in dict.fromkeys(route["vehicle"] for route in routes):
        own = [route for route in routes if route["vehicle"] == name]
        what = f"standard deviations of {name}, {sum(route['values'] for route in own)} values, five cases"
        rows.append(
            at_most(
                f"ride_covariance.quadrature.{name.replace(', ', '-').replace(' ', '-')}",
                SYSTEM,
                f"{what}: against quadrature of spectra by dynamic stiffness",
                max(route["worst"] for route in own),
                "",
                1e-6,
                "asked; both routes claim better than 1e-9",
                "native",
            )
        )
    return rows


def _limit_rows() -> list[Row]:
    """Delays of zero and without end, and the road's own covariances."""
    vehicle = linearise(_vehicle("three_axle_truck", SEED))
    road = _cases(vehicle)[3]
    one = excited(vehicle, road, 20.0)
    at_once = stationary(replace(one, delays=(0.0,) * 3)).deviation
    joined = stationary(replace(one, B=(sum(one.B),), D=(sum(one.D),), delays=(0.0,))).deviation  # type: ignore[arg-type]
    late = stationary(replace(one, delays=(0.0, 1e6, 2e6))).deviation
    apart = stationary(replace(one, independent=True)).deviation
    return [
        at_most(
            "ride_covariance.delay.zero",
            SYSTEM,
            "three axles at delay 0 against one input, worst output",
            _worst(at_once, joined),
            "",
            0.0,
            "exact: they are the same equation",
            "closed form",
        ),
        at_most(
            "ride_covariance.delay.long",
            SYSTEM,
            "delays of 1e6 s against independent axles, worst output",
            _worst(late, apart),
            "",
            1e-14,
            "exact but for rounding: the response has died out",
            "closed form",
        ),
        _inputs_row(),
    ]


def _inputs_row() -> Row:
    """What the system says of the heights under its own wheels."""
    vehicle = linearise(_vehicle("three_axle_truck", SEED))
    road, worst = road_of_level(1.0), 0.0
    for number, case in CASES.items():
        system = excited(vehicle, _cases(vehicle, road)[number], 13.0)
        states = 2 * len(vehicle.mass)
        H = np.hstack([np.zeros((len(vehicle.wheels), states)), *_cases(vehicle, road)[number].heights])
        found, wanted = H @ stationary(system).P @ H.T, input_covariance(road, vehicle.wheels, *case)
        worst = max(worst, float(np.abs(found - wanted).max() / np.abs(wanted).max()))
    return at_most(
        "ride_covariance.inputs",
        SYSTEM,
        "covariances of the heights under six wheels in five cases",
        worst,
        "",
        1e-12,
        "exact but for rounding",
        "closed form",
    )


def _weighting_rows() -> list[Row]:
    vehicle = linearise(_vehicle("r19_ride", SEED))
    road, rows = _cases(vehicle)[3], []
    for name in ("Wk", "Wd"):
        found = stationary(weighted(excited(vehicle, road, 20.0), {"left occupant": name})).deviation[-1]
        other = quadrature(vehicle, road, 20.0, {"left occupant": WEIGHTINGS[name].response})
        at = [output.name for output in vehicle.outputs].index("left occupant")
        rows.append(
            at_most(
                f"ride_covariance.weighting.{name}",
                SYSTEM,
                f"{name} of a seat as states behind the vehicle, against its frequency response in the quadrature",
                found / other.variance[at] ** 0.5 - 1,
                "",
                1e-8,
                "asked of the cascade; as one polynomial it is 2e-4 off",
                "native",
            )
        )
    return rows


def _white_rows() -> list[Row]:
    """Tyre damping: what has no variance is said, with its reason, and what has one is right."""
    vehicle = corners([(0.0, CORNER)], tyre_damping=100.0)
    found = stationary(excited(vehicle, _walk((0.0,), 0.3), 20.0))
    other = quadrature(vehicle, _walk((0.0,), 0.3), 20.0)
    rows = [
        behaves(
            f"ride_covariance.white.{name}",
            SYSTEM,
            f"tyre damping under a road of first order: {what}",
            found.status[i],
            expected,
            found.reason[i],
        )
        for name, what, i, expected in (
            ("body", "body acceleration", 0, "finite"),
            ("load", "wheel load", 4, "infinite"),
            ("wheel", "wheel acceleration", 5, "infinite"),
        )
    ]
    return [
        *rows,
        at_most(
            "ride_covariance.white.value",
            SYSTEM,
            "the outputs that stay finite, against quadrature",
            _worst(found.variance[:4], other.variance[:4]),
            "",
            1e-10,
            "both routes at their best",
            "native",
        ),
    ]


def _free_rows() -> list[Row]:
    """Three zero eigenvalues: found, harmless, the same with slycot, and a heading that roll steer lets walk."""
    free = _vehicle("r19_free")
    vehicle = linearise(free, 20.0)
    road = _cases(vehicle)[3]
    system = excited(vehicle, road, 20.0)
    split, found = parts(system.A), stationary(system)
    same = np.array_equal(_with_slycot(system), found.variance)
    steer = {"fl": 0.05, "fr": 0.05}
    forces = tuple(replace(force, roll_steer=steer.get(force.name, 0.0)) for force in free.side_forces)
    turning = linearise(replace(free, side_forces=forces), 20.0)
    walking = stationary(excited(turning, road, 20.0))
    side = walking.names.index("lateral position")
    others = {status for i, status in enumerate(walking.status) if i != side}
    after = float(np.sqrt(walking.rate[side] * 100.0 ** walking.power[side]))
    return [
        within(
            "ride_covariance.free.zeros",
            SYSTEM,
            "zero eigenvalues that are found in R19-free",
            split.zeros,
            "",
            3,
            0,
            "place along and across, heading",
            "closed form",
        ),
        behaves(
            "ride_covariance.free.status",
            SYSTEM,
            "all outputs of R19-free",
            " and ".join(set(found.status)),
            FINITE,
            found.reason[0],
        ),
        behaves(
            "ride_covariance.free.slycot",
            SYSTEM,
            "R19-free where slycot seems installed, bit by bit",
            "same" if same else "different",
            "same",
            "the method is named; its routines would raise here",
        ),
        behaves(
            "ride_covariance.free.steered",
            SYSTEM,
            "front roll steer 0.05: lateral position",
            walking.status[side] if others == {FINITE} else "others too",
            "diffusing",
            walking.reason[side],
        ),
        within(
            "ride_covariance.free.walk",
            SYSTEM,
            "its standard deviation after 100 s",
            after,
            "m",
            7.0,
            0.5,
            "known to one digit, from the same law worked out beforehand",
            "closed form",
        ),
        _walk_row(turning, road, float(walking.rate[side]), side),
    ]


def _walk_row(vehicle: LinearVehicle, road: Excitation, rate: float, side: int) -> Row:
    """A place that grows as c t per unit of noise has the density c^2 / (2 pi w^4) at low frequencies."""
    omega = np.array([1e-3])
    density = spectra(vehicle, road, 20.0, omega)[0, side]
    return at_most(
        "ride_covariance.free.rate",
        SYSTEM,
        "growth of its variance, rate t^3, against 2 pi w^4 / 3 times its density at 0.001 rad/s",
        rate / (2 * np.pi * omega[0] ** 4 * density / 3) - 1,
        "",
        1e-4,
        "the next term is smaller by the square of frequency over the slowest pole",
        "native",
    )


def _with_slycot(system: DelayedSystem) -> np.ndarray:
    """Variances where python-control believes that slycot is installed, with routines that cannot be called."""
    import control.exception as installed
    import control.mateqn as solvers

    kept = installed.slycot_installed, solvers.sb03md, solvers.sb04md
    installed.slycot_installed, solvers.sb03md, solvers.sb04md = True, None, None
    try:
        return stationary(system).variance
    finally:
        installed.slycot_installed, solvers.sb03md, solvers.sb04md = kept


def _unstable_row() -> Row:
    try:
        stationary(excited(corners([(0.0, replace(CORNER, c=-5.0))]), _walk((0.0,), 0.3), 20.0))
    except Unstable as error:
        said = "refused" if "swings at 11.8" in str(error) and "grows" in str(error) else "refused without its mode"
        return behaves(
            "ride_covariance.unstable", SYSTEM, "a quarter car with a damper of -5 N s/m", said, "refused", str(error)
        )
    return behaves(
        "ride_covariance.unstable",
        SYSTEM,
        "a quarter car with a damper of -5 N s/m",
        "answered",
        "refused",
        "it swings up",
    )


def _engine_row(engine: str) -> Row:
    """The engines' own linearisation through the covariance, against quadrature of the analytic vehicle."""
    from models.engines.spatial_protocol import build

    worst = 0.0
    for name, speed in (("r19_ride", 20.0), ("r19_free", 33.0), ("three_axle_truck", 9.0)):
        vehicle = _vehicle(name, SEED)
        linear, analytic = build(engine, vehicle, speed=speed).linearise(), linearise(vehicle, speed)
        for road in _cases(analytic).values():
            found, other = stationary(excited(linear, road, speed)), quadrature(analytic, road, speed)
            told = _told(found)
            worst = max(worst, _worst(found.deviation[told], np.sqrt(other.variance[told])))
    return at_most(
        f"ride_covariance.engine.{engine}",
        SYSTEM,
        "standard deviations from the linearisation of "
        f"{engine}, three asymmetric twins, five cases, against quadrature of the analytic vehicles",
        worst,
        "",
        1e-6,
        "asked",
        "native",
    )


def _fast(speeds: np.ndarray, source: str) -> tuple[list[Row], dict[str, Any]]:
    """Five cases over speeds with weighting, fast and direct, timed in this process's own seconds."""
    vehicle = _vehicle("r19_ride")
    linear = linear_vehicle(vehicle, source)
    roads = {str(number): road for number, road in _cases(linear(20.0)).items()}
    sweep(linear, roads, speeds[:1], FILTERS)  # what is loaded and linearised once is no part of the sweep
    start = time.process_time()
    quick = sweep(linear, roads, speeds, FILTERS)
    seconds = time.process_time() - start
    some = slice(None, None, max(1, len(speeds) // 6))
    slow = sweep(linear, roads, speeds[some], FILTERS, fast=False)
    told = slow.variance > LEAST * slow.variance.max()
    rows = [
        at_most(
            "ride_covariance.fast.equal",
            SYSTEM,
            "fast route against the direct one, with three weighted seats, variance, worst of all outputs",
            _worst(quick.variance[:, some][told], slow.variance[told]),
            "",
            1e-10,
            "asked",
            "none",
        ),
        behaves(
            "ride_covariance.fast.taken",
            SYSTEM,
            "points of the sweep that had to go the direct way",
            str(sum(quick.direct.values())),
            "0",
            "its eigenvectors are well apart",
        ),
        aim(
            "ride_covariance.fast.time",
            SYSTEM,
            f"five cases times {len(speeds)} speeds with ISO weighting, from "
            f"the linear vehicle of {source}, one core, once",
            seconds,
            "s",
            2.0,
            "asked for 60 speeds; it counts this process's seconds and not other load",
        ),
    ]
    return rows, {
        "speeds": speeds.tolist(),
        "cases": list(quick.cases),
        "seat": "left occupant Wk",
        **{name: [quick.of(case, name).tolist() for case in quick.cases] for name in (*ALONG, "left occupant Wk")},
    }


ALONG = ("body front", "body centre", "body rear")


def tables(data: dict[str, Any]) -> list[Table]:
    """Agreement of the two routes beside what each claims of itself."""
    rows = tuple(
        (
            route["vehicle"],
            f"{route['speed']:.3g}",
            str(route["values"]),
            f"{route['worst']:.1e}",
            *(f"{error:.1e}" for error in route["errors"]),
        )
        for route in data["routes"]
    )
    note = (
        "Largest relative difference of standard deviations over all outputs in the five cases of correlation; the "
        "last two columns are what each route says of its own variances, at its worst output."
    )
    headings = ("vehicle", "speed [m/s]", "values", "difference", "covariance says", "quadrature says")
    return [Table("Covariance against frequency quadrature", note, headings, rows)]


def draw(data: dict[str, Any]) -> list[tuple[str, Any]]:
    """Standard deviation of the vertical acceleration along the body over speed, one line per case."""
    from models.drawing.figures import plt

    shown = data["figure"]
    figure, axes = plt.subplots(1, 3, figsize=(11, 4.4), sharey=True, layout="constrained")
    for axis, place in zip(axes, ALONG, strict=True):
        for i, case in enumerate(shown["cases"]):
            words = "left/right {}, front/rear {}".format(*CASES[int(case)])
            axis.plot(shown["speeds"], shown[place][i], label=f"{case}: {words}")
        axis.set(title=place, xlabel="speed [m/s]")
    axes[0].set_ylabel("standard deviation of\nvertical acceleration [m/s$^2$]")
    axes[0].set_ylim(bottom=0.0)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False)
    return [(SAID, figure)]


SAID = (
    "R19-ride on the paper's road in its five cases of correlation. At the centre the order of the cases changes with "
    "the speed: there front and rear add up or cancel with the delay, which axles that are equal or independent both "
    "miss. Front and rear of the body hardly feel it: there only the correlation of left and right matters."
)
