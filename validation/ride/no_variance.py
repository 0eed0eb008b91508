"""Rows on outputs without a finite variance, on motions without a restoring force, and on frequency weightings."""

from dataclasses import replace

import numpy as np

from models.ride.closed_forms import QuarterCar
from models.ride.covariance import FINITE, stationary_covariance
from models.ride.excited import DelayedSystem, vehicle_with_road
from models.ride.frequency import spectral_densities, variances_by_quadrature
from models.ride.marginal import UnstableVehicle, split_marginal
from models.ride.weighting import WEIGHTINGS, system_with_weightings
from models.vehicles.spatial_linear import linearise
from models.vehicles.vehicle_file import load_vehicle
from validation.common.rows import Observed, Row, System, behaviour_row
from validation.ride.rides import changed_vehicle, largest_relative_error, one_track, paper_road, quarter_car_vehicle

SYSTEM: System = "ride"
QUARTER_CAR = QuarterCar(300.0, 40.0, 2e4, 1500.0, 2e5)


def weighting_rows(seed: int) -> list[Row]:
    """Rows: frequency-weighted seat accelerations of an asymmetric vehicle, by weighting filters as states, compared
    with their frequency response."""
    vehicle = linearise(changed_vehicle(load_vehicle("r19_ride"), seed))
    road, rows = paper_road(vehicle.wheels), []
    for name in ("Wk", "Wd"):
        deviation = stationary_covariance(
            system_with_weightings(vehicle_with_road(vehicle, road, 20.0), {"left occupant": name})
        ).deviation[-1]
        integrals = variances_by_quadrature(vehicle, road, 20.0, {"left occupant": WEIGHTINGS[name].response})
        output_index = vehicle.names.index("left occupant")
        rows.append(
            Observed(
                f"ride_covariance.weighting.{name}",
                SYSTEM,
                f"difference of {name} of a seat, as states behind the vehicle, from its frequency "
                "response in the quadrature",
                deviation / integrals.variance[output_index] ** 0.5 - 1,
                "",
            ).at_most(1e-8, "asked of the cascade; as one polynomial it is 2e-4 off", "native")
        )
    return rows


def no_variance_rows() -> list[Row]:
    """Rows on outputs without a finite variance: white noise, diffusing positions, and an unstable vehicle."""
    return [*_white_rows(), *_free_rows(), _unstable_row()]


def _white_rows() -> list[Row]:
    """Rows on a quarter car with damped tyres: outputs with infinite variance are reported as such, and the finite
    variances are compared with quadrature."""
    vehicle = quarter_car_vehicle([(0.0, QUARTER_CAR)], tyre_damping=100.0)
    covariance = stationary_covariance(vehicle_with_road(vehicle, one_track((0.0,), 0.3), 20.0))
    by_quadrature = variances_by_quadrature(vehicle, one_track((0.0,), 0.3), 20.0)
    rows = [
        behaviour_row(
            f"ride_covariance.white.{name}",
            SYSTEM,
            f"tyre damping under a road of first order: {quantity}",
            covariance.status[i],
            expected,
            covariance.reason[i],
        )
        for name, quantity, i, expected in (
            ("body", "body acceleration", 0, "finite"),
            ("load", "wheel load", 4, "infinite"),
            ("wheel", "wheel acceleration", 5, "infinite"),
        )
    ]
    return [
        *rows,
        Observed(
            "ride_covariance.white.value",
            SYSTEM,
            "difference of the outputs that stay finite from quadrature",
            largest_relative_error(covariance.variance[:4], by_quadrature.variance[:4]),
            "",
        ).at_most(1e-10, "both routes at their best", "native"),
    ]


def _free_rows() -> list[Row]:
    """Rows on a free vehicle with three zero eigenvalues: their number, finite variances of all outputs, the same with
    the package slycot, and the diffusing lateral position with roll steer."""
    free = load_vehicle("r19_free")
    vehicle = linearise(free, 20.0)
    road = paper_road(vehicle.wheels)
    system = vehicle_with_road(vehicle, road, 20.0)
    split, covariance = split_marginal(system.A), stationary_covariance(system)
    same_bits = np.array_equal(_with_slycot(system), covariance.variance)
    steer = {"fl": 0.05, "fr": 0.05}
    forces = tuple(replace(force, roll_steer=steer.get(force.name, 0.0)) for force in free.side_forces)
    turning = linearise(replace(free, side_forces=forces), 20.0)
    walking = stationary_covariance(vehicle_with_road(turning, road, 20.0))
    side = walking.names.index("lateral position")
    other_statuses = {status for i, status in enumerate(walking.status) if i != side}
    rate, deviation_after = walking.rate[side], float(np.sqrt(walking.rate[side] * 100.0 ** walking.power[side]))
    omega = 1e-3  # a place that grows as c t per unit of noise has the density c^2 / (2 pi w^4) at low frequencies
    density = spectral_densities(turning, road, 20.0, np.array([omega]))[0, side]
    return [
        Observed(
            "ride_covariance.free.zeros", SYSTEM, "number of zero eigenvalues of R19-free", split.zero_count, ""
        ).within(3, 0, "place along and across, heading", "closed form"),
        behaviour_row(
            "ride_covariance.free.status",
            SYSTEM,
            "variance of all outputs of R19-free",
            " and ".join(set(covariance.status)),
            FINITE,
            covariance.reason[0],
        ),
        behaviour_row(
            "ride_covariance.free.slycot",
            SYSTEM,
            "R19-free gives the same bits where slycot seems installed",
            "same" if same_bits else "different",
            "same",
            "the method is named; its routines would raise here",
        ),
        behaviour_row(
            "ride_covariance.free.steered",
            SYSTEM,
            "front roll steer 0.05: variance of the lateral position",
            walking.status[side] if other_statuses == {FINITE} else "others too",
            "diffusing",
            walking.reason[side],
        ),
        Observed(
            "ride_covariance.free.walk",
            SYSTEM,
            "standard deviation of the lateral position after 100 s, front roll steer 0.05",
            deviation_after,
            "m",
        ).within(7.0, 0.5, "known to one digit, from the same law worked out beforehand", "closed form"),
        Observed(
            "ride_covariance.free.rate",
            SYSTEM,
            "ratio of the growth of the lateral position's variance, rate t^3, to 2 pi w^4 / 3 times "
            "its density at 0.001 rad/s",
            float(rate) / (2 * np.pi * omega**4 * density / 3) - 1,
            "",
        ).at_most(1e-4, "the next term is smaller by the square of frequency over the slowest pole", "native"),
    ]


def _with_slycot(delayed_system: DelayedSystem) -> np.ndarray:
    """Variances (p,) computed while python-control takes the package slycot as installed, whose routines would fail."""
    import control.exception as installed
    import control.mateqn as solvers

    original_routines = installed.slycot_installed, solvers.sb03md, solvers.sb04md
    installed.slycot_installed, solvers.sb03md, solvers.sb04md = True, None, None
    try:
        return stationary_covariance(delayed_system).variance
    finally:
        installed.slycot_installed, solvers.sb03md, solvers.sb04md = original_routines


def _unstable_row() -> Row:
    outcome, why = "answered", "it swings up"
    try:
        stationary_covariance(
            vehicle_with_road(quarter_car_vehicle([(0.0, replace(QUARTER_CAR, c=-5.0))]), one_track((0.0,), 0.3), 20.0)
        )
    except UnstableVehicle as error:
        why = str(error)
        outcome = "refused" if "swings at 11.8" in why and "grows" in why else "refused without its mode"
    quantity = "a quarter car with a damper of -5 N s/m"
    return behaviour_row("ride_covariance.unstable", SYSTEM, quantity, outcome, "refused", why)
