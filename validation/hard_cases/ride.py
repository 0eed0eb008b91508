"""Hard cases of rides: roads without finite variance, no stiffness or damping, stiff systems, invalid vehicles.

Where an implementation takes part, the linear vehicle is its own; the covariance behind it is the same for all.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import InputError
from models.core.scene_file import parse_toml
from models.ride.covariance import DIFFUSING, INFINITE, stationary_covariance
from models.ride.excited import vehicle_with_road
from models.ride.frequency import variances_by_quadrature
from models.ride.marginal import UnstableVehicle
from models.ride.speed_profile import SpeedProfile
from models.ride.varying_speed import varying_speed
from models.ride.weighting import WEIGHTINGS, system_with_weightings
from models.vehicles.linear_vehicle import LinearVehicle, eigenvalues
from models.vehicles.vehicle_file import SHIPPED_FOLDER, build_vehicle, load_vehicle
from validation.hard_cases.case import IMPLEMENTATIONS, HardCase, OutcomeWord
from validation.ride.hard_rides import (
    QUARTER_CAR_NUMBERS,
    SPEED,
    closed_form_error,
    linear_equations,
    quarter_car,
    roll_steered_vehicle,
    single_body,
    variances_after_hours,
)
from validation.ride.rides import ROAD_INTENSITY, largest_relative_error, one_track, paper_road

VehicleTableChange = Callable[[dict[str, Any]], object]


def damped_tyre_error(engine_name: str, work_folder: Path) -> float:
    """Relative error of the first two outputs' variances with a damped tyre, against quadrature; infinite unless only
    the tyre force is reported as infinite."""
    vehicle, road = (
        linear_equations(quarter_car(*QUARTER_CAR_NUMBERS, c_t=100.0), engine_name),
        one_track((0.0,), 0.3),
    )
    covariance = stationary_covariance(vehicle_with_road(vehicle, road, SPEED))
    if [status == INFINITE for status in covariance.status] != [False, False, True]:
        return np.inf
    return largest_relative_error(covariance.variance[:2], variances_by_quadrature(vehicle, road, SPEED).variance[:2])


def damped_tyre_naive_result(work_folder: Path) -> str:
    """Result without the guard, as text: variances by the Lyapunov equation if the white noise that reaches outputs
    directly is ignored."""
    system = vehicle_with_road(
        linear_equations(quarter_car(*QUARTER_CAR_NUMBERS, c_t=100.0), "reference"), one_track((0.0,), 0.3), SPEED
    )
    silent = replace(system, D=tuple(0.0 * D for D in system.D))
    return f"C P C' gives the tyre force a standard deviation of {stationary_covariance(silent).deviation[2]:.0f} N"


def free_car_error(engine_name: str, work_folder: Path) -> float:
    """Relative error of R19-free's acceleration variances, with independent axles, against the exact covariance one
    hour after rest."""
    vehicle = linear_equations(load_vehicle("r19_free"), engine_name)
    system = vehicle_with_road(vehicle, paper_road(vehicle.wheels, "modelled", "uncorrelated"), SPEED)
    rows = [i for i, output in enumerate(vehicle.outputs) if "acceleration" in output.kind]
    covariance, wanted = stationary_covariance(system), variances_after_hours(system)[0]
    return largest_relative_error(covariance.variance[rows], wanted[rows])


def growth_rate_error(engine_name: str, work_folder: Path) -> float:
    """Relative error of the growth rates of heading variance (as t) and lateral position variance (as t^3), against the
    exact covariance after 1 and 2 hours."""
    vehicle = linear_equations(roll_steered_vehicle(), engine_name)
    system = vehicle_with_road(vehicle, paper_road(vehicle.wheels, "modelled", "uncorrelated"), SPEED)
    covariance = stationary_covariance(system)
    if covariance.status != (DIFFUSING, DIFFUSING) or covariance.power.tolist() != [1, 3]:
        return np.inf
    after_1, after_2 = variances_after_hours(system)
    grown = (after_2 - after_1) / (2.0**covariance.power - 1.0) / 3600.0**covariance.power
    return largest_relative_error(grown, covariance.rate)


def undamped_tyre_case(corner_wavenumber: float) -> Callable[..., float]:
    """Case: a body on an undamped tyre. Error: that of the growth rates of its variances, against S(w) / 2 w^2."""

    def error(engine_name: str, work_folder: Path) -> float:
        undamped_car = replace(single_body(300.0, 2e5, 0.0), springs=())
        covariance = stationary_covariance(
            vehicle_with_road(linear_equations(undamped_car, engine_name), one_track((0.0,), corner_wavenumber), SPEED)
        )
        if covariance.status != (DIFFUSING, DIFFUSING):
            return np.inf
        w2 = 2e5 / 300.0
        height = w2 * ROAD_INTENSITY * SPEED / (2.0 * (w2 + (corner_wavenumber * SPEED) ** 2))
        return largest_relative_error(covariance.rate, np.array([w2**2, 1.0]) * height)

    return error


def triple_pole_error(engine_name: str, work_folder: Path) -> float:
    """Case: a critically damped body at the frequency of the road's corner. Error: relative difference of the variances
    from 3 q w^3 / 16 and 3 q / 16 w."""
    w = 6.0
    covariance = stationary_covariance(
        vehicle_with_road(
            linear_equations(single_body(300.0, 300.0 * w**2, 600.0 * w), engine_name),
            one_track((0.0,), w / SPEED),
            SPEED,
        )
    )
    return largest_relative_error(covariance.variance, 3.0 * ROAD_INTENSITY * SPEED / 16.0 * np.array([w**3, 1.0 / w]))


def triple_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: condition number of the eigenvectors in this case."""
    system = vehicle_with_road(
        linear_equations(single_body(300.0, 10800.0, 3600.0), "reference"), one_track((0.0,), 0.3), SPEED
    )
    with np.errstate(all="ignore"):
        condition = np.linalg.cond(np.linalg.eig(system.A)[1])
    return f"sums over eigenvectors have a condition of {condition:.0e} there"


def unstable_car_error(engine_name: str, work_folder: Path) -> float:
    """Case: a damper with the wrong sign must be refused, with the growth rate of the fastest motion."""
    return _error_unless_refused(linear_equations(quarter_car(300.0, 40.0, 2e4, -1500.0, 2e5), engine_name))


def toppling_car_error(engine_name: str, work_folder: Path) -> float:
    """Case: a body 30 m above its springs must be refused, with the rate at which it topples under gravity."""
    car = load_vehicle("seven_freedoms")
    x, y, _ = car.bodies[0].position
    tall = replace(car, gravity=9.81, bodies=(replace(car.bodies[0], position=(x, y, 30.0)), *car.bodies[1:]))
    return _error_unless_refused(linear_equations(tall, engine_name))


def _error_unless_refused(vehicle: LinearVehicle) -> float:
    """Raises the refusal of an unstable vehicle if both routes to the variances state the right growth rate; else
    infinite."""
    road, growing = paper_road(vehicle.wheels), float(eigenvalues(vehicle).real.max())
    for route in (
        lambda: stationary_covariance(vehicle_with_road(vehicle, road, SPEED)),
        lambda: variances_by_quadrature(vehicle, road, SPEED),
    ):
        try:
            route()
        except UnstableVehicle as error:
            refusal = error
            if largest_relative_error(error.growth, growing) > 1e-9:
                return np.inf
        else:
            return np.inf
    raise refusal


def long_delay_error(engine_name: str, work_folder: Path) -> float:
    """Case: a delay of 26,000 s between the axles. Error: relative difference from independent axles."""
    vehicle = linear_equations(load_vehicle("half_car"), engine_name)
    late, independent = (_deviations_of_ride(vehicle, 1e-4, word) for word in ("delayed", "uncorrelated"))
    return largest_relative_error(late, independent)


def no_delay_error(engine_name: str, work_folder: Path) -> float:
    """Case: two axles at the same x, without delay. Error: relative difference of the deviations from a common
    input."""
    vehicle = linear_equations(load_vehicle("half_car"), engine_name)
    at_one_place = replace(vehicle, wheels=tuple(replace(wheel, x=0.0) for wheel in vehicle.wheels))
    delayed, equal = (_deviations_of_ride(at_one_place, SPEED, word) for word in ("delayed", "equal"))
    return largest_relative_error(delayed, equal)


def _deviations_of_ride(vehicle: LinearVehicle, speed: float = SPEED, axle_correlation: str = "delayed") -> np.ndarray:
    """Standard deviations of the outputs on the paper's road at a speed (m/s)."""
    return stationary_covariance(
        vehicle_with_road(vehicle, paper_road(vehicle.wheels, "modelled", axle_correlation), speed)
    ).deviation


def mirrored_springs_error(engine_name: str, work_folder: Path) -> float:
    """Case: the left springs, then the right springs, are twice as stiff. Error: relative difference of the deviations
    of outputs on the centre line."""
    car = load_vehicle("seven_freedoms")
    deviations = []
    for side in (1.0, -1.0):
        springs = tuple(
            replace(s, stiffness=s.stiffness * (2.0 if side * s.first_point[1] > 0 else 1.0)) for s in car.springs
        )
        vehicle = linear_equations(replace(car, springs=springs), engine_name)
        rows = [o.name == "body centre" or "angular" in o.kind for o in vehicle.outputs]
        deviations.append(_deviations_of_ride(vehicle)[rows])
    return largest_relative_error(deviations[0], deviations[1])


def slow_weighting_error(engine_name: str, work_folder: Path) -> float:
    """Relative error of the body acceleration's variance weighted by Wk at 1 mm/s, against quadrature."""
    vehicle = linear_equations(quarter_car(*QUARTER_CAR_NUMBERS), engine_name)
    road, name = one_track((0.0,), 0.3), vehicle.outputs[0].name
    variance = stationary_covariance(
        system_with_weightings(vehicle_with_road(vehicle, road, 1e-3), {name: "Wk"})
    ).variance[-1]
    wanted = variances_by_quadrature(vehicle, road, 1e-3, {name: WEIGHTINGS["Wk"].response}).variance[0]
    return largest_relative_error(variance, wanted)


def drive_with_standstill_error(engine_name: str, work_folder: Path) -> float:
    """Case: a drive that starts and ends with a stop. Error: largest relative change of the road height's variance
    under each wheel."""
    vehicle = linear_equations(load_vehicle("half_car"), engine_name)
    drive = SpeedProfile((0.0, 0.1, 1.1, 1.6, 2.0), (0.0, 0.0, 10.0, 0.0, 0.0))
    height = varying_speed(vehicle, paper_road(vehicle.wheels), drive).height
    return largest_relative_error((height / height[0]) ** 2, 1.0)


def invalid_speeds_error(engine_name: str, work_folder: Path) -> float:
    """Case: speeds of -1, NaN, infinity and 0 must each be refused."""
    vehicle = linear_equations(load_vehicle("half_car"), engine_name)
    for speed in (-1.0, float("nan"), float("inf"), 0.0):
        try:
            _deviations_of_ride(vehicle, speed)
        except InputError as error:
            refusal = error
        else:
            return np.inf
    raise refusal


def wrong_entry_case(spoil_table: VehicleTableChange, expected_error_place: str) -> Callable[..., float]:
    """Case: the half car's file with a wrong entry must be refused with the entry's name."""

    def error(engine_name: str, work_folder: Path) -> float:
        table = parse_toml(SHIPPED_FOLDER / "half_car.toml")
        spoil_table(table)
        try:
            vehicle = build_vehicle(table, "half_car.toml")
        except InputError as refusal:
            if expected_error_place not in refusal.place:
                return np.inf
            raise
        return float(np.isfinite(_deviations_of_ride(linear_equations(vehicle, engine_name))).all()) + 1.0

    return error


def _add_unconnected_body(vehicle_table: dict[str, Any]) -> None:
    """Add a body without any spring to the table of a vehicle."""
    vehicle_table["bodies"].append({"name": "box", "mass": 5.0, "position": [0.0, 0.0, 1.0], "freedoms": ["z"]})


REFUSED: dict[str, OutcomeWord] = dict.fromkeys(IMPLEMENTATIONS, "refused")
CLOSED, ROUNDED = "closed form", "rounding, and that of an engine's differences"
CASES = (
    HardCase(
        "tyre damping on a road of first order",
        "the road's rate is white noise: a force without a variance",
        "body by quadrature; tyre force called infinite",
        "",
        1e-9,
        ROUNDED,
        damped_tyre_error,
        naive_result=damped_tyre_naive_result,
    ),
    HardCase(
        "road that walks at random",
        "its height has no variance, the vehicle's motion has one",
        CLOSED,
        "",
        1e-10,
        ROUNDED,
        closed_form_error(corner=0.0),
    ),
    HardCase(
        "road that next to walks at random",
        "a corner of 1e-9 rad/m",
        CLOSED,
        "",
        1e-6,
        "counts as none: 2e-8 1/s beside 3 1/s",
        closed_form_error(corner=1e-9),
    ),
    HardCase(
        "car that is free on the road",
        "three zero eigenvalues, two of them a Jordan pair",
        "exact covariance after an hour",
        "",
        1e-6,
        "rounding, doubled twenty times",
        free_car_error,
    ),
    HardCase(
        "roll steer on a free car",
        "its heading diffuses, its place sideways goes with t^3",
        "exact covariance after 1 and 2 hours",
        "",
        1e-3,
        "what is left of its first seconds",
        growth_rate_error,
    ),
    HardCase(
        "no damping at all",
        "an undamped motion under white noise: Lyapunov's equation has no solution",
        "growth by S(w) / 2 w^2",
        "",
        1e-9,
        ROUNDED,
        undamped_tyre_case(0.3),
    ),
    HardCase(
        "no damping, road that next to walks",
        "undamped beside a pole at -2e-8 1/s",
        "growth by S(w) / 2 w^2",
        "",
        1e-9,
        ROUNDED,
        undamped_tyre_case(1e-9),
    ),
    HardCase(
        "next to no damping",
        "a damper of 0.1 mN s/m: ratio 2e-8",
        CLOSED,
        "",
        1e-6,
        "asked for",
        closed_form_error(c=1e-4),
    ),
    HardCase(
        "threefold eigenvalue",
        "critical damping at the road's own corner: eigenvectors are parallel",
        CLOSED,
        "",
        1e-9,
        ROUNDED,
        triple_pole_error,
        naive_result=triple_naive_result,
    ),
    HardCase(
        "stiffness ratio of 1e9",
        "a tyre of 2e13 N/m on a spring of 2e4 N/m",
        CLOSED,
        "",
        1e-6,
        "asked for",
        closed_form_error(k_t=2e13),
    ),
    HardCase(
        "wheel of a milligram",
        "a rate of 1.5e9 1/s beside one of 1 1/s",
        CLOSED,
        "",
        1e-6,
        "asked for",
        closed_form_error(m_u=1e-6),
    ),
    HardCase(
        "speeds of 1 mm/s and 300 m/s",
        "the road's rates lie five decades apart",
        CLOSED,
        "",
        1e-10,
        ROUNDED,
        closed_form_error(speeds=(1e-3, 300.0)),
    ),
    HardCase(
        "weighting at 1 mm/s",
        "eight states with rates of 600 1/s behind a road of 3e-4 1/s",
        "quadrature",
        "",
        1e-9,
        ROUNDED,
        slow_weighting_error,
    ),
    HardCase("delay of hours", "e^(A tau) underflows", "independent axles", "", 1e-12, "rounding", long_delay_error),
    HardCase("two axles at one place", "a delay of nothing", "one input", "", 0.0, "exact", no_delay_error),
    HardCase(
        "left springs twice the right ones",
        "roll and heave are coupled",
        "its mirror image",
        "",
        1e-10,
        ROUNDED,
        mirrored_springs_error,
    ),
    HardCase(
        "drive from stop to stop",
        "path stands still while time goes on",
        "the road's own variance",
        "",
        1e-10,
        "rounding",
        drive_with_standstill_error,
    ),
    HardCase(
        "damper of the wrong sign",
        "integrals over frequencies stay finite",
        "growth rate",
        "",
        0.0,
        "exact",
        unstable_car_error,
        REFUSED,
    ),
    HardCase(
        "top-heavy body under gravity",
        "stable unloaded, toppling loaded",
        "growth rate",
        "",
        0.0,
        "exact",
        toppling_car_error,
        REFUSED,
    ),
    HardCase(
        "no speed", "0, below 0, not a number", "refused by name", "", 0.0, "exact", invalid_speeds_error, REFUSED
    ),
    *(
        HardCase(
            name,
            "a number from a singular or senseless matrix",
            f"refused at {place}",
            "",
            0.0,
            "exact",
            wrong_entry_case(change, place),
            REFUSED,
        )
        for name, place, change in (
            ("negative mass", "bodies[rl].mass", lambda t: t["bodies"][2].update(mass=-1.0)),
            ("mass of zero", "bodies[rl].mass", lambda t: t["bodies"][2].update(mass=0.0)),
            ("missing mass", "bodies[rl].mass", lambda t: t["bodies"][2].pop("mass")),
            ("body without inertia", "bodies[body].inertia", lambda t: t["bodies"][0].pop("inertia")),
            ("unconnected body", "bodies[box]", _add_unconnected_body),
            ("output on an unknown body", "outputs[body rear].body", lambda t: t["outputs"][2].update(body="bdoy")),
            ("axle behind axle", "axles[rear].x", lambda t: t["axles"][1].update(x=2.0)),
            ("negative damper in a file", "springs[rear left].damping", lambda t: t["springs"][1].update(damping=-1.0)),
        )
    ),
)
