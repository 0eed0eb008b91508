"""Faults planted in road, vehicle, covariance and frequency weighting of rides, and the checks that see them."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from models.engines.spatial_reference import SpatialReference
from models.ride.closed_forms import QuarterCar
from models.ride.covariance import stationary_covariance
from models.ride.excited import DelayedSystem
from models.ride.frequency import variances_by_quadrature
from models.ride.weighting import WEIGHTINGS, weighting_of_standard
from models.road import two_track
from models.road.excitation import RoadExcitation
from models.vehicles import spatial_linear, vehicle_file
from models.vehicles.linear_vehicle import LinearOutput, LinearVehicle, WheelPosition, eigenvalues
from models.vehicles.spatial import SpatialVehicle
from validation.faults.campaign import Campaign, CampaignFault, Check
from validation.faults.patches import Patch, attribute_patch
from validation.ride.rides import R19_FREQUENCIES, STANDARD_WEIGHTINGS, largest_relative_error

SPEED = 17.0
PUBLISHED_INERTIA = np.diag([207.26524557936952, 1565.8178787125541, 1791.5995300122856])
"""Published inertia (kg m^2) of the sprung mass of the vehicle R19, body and engine together."""


def _system(
    vehicle_name: str, road_of_vehicle: Callable[[LinearVehicle], RoadExcitation]
) -> tuple[LinearVehicle, RoadExcitation, DelayedSystem]:
    from models.ride import excited

    vehicle = spatial_linear.linearise(vehicle_file.load_vehicle(vehicle_name))
    met = road_of_vehicle(vehicle)
    return vehicle, met, excited.vehicle_with_road(vehicle, met, SPEED)


def _single_track_road(vehicle: LinearVehicle) -> RoadExcitation:
    return two_track.road_excitation(two_track.road_of_level(1.0), two_track.wheels_on_track(vehicle.wheels, 1.0))


@cache
def _variances_by_spectra() -> np.ndarray:
    vehicle, road, _ = _system("half_car", _single_track_road)
    return variances_by_quadrature(vehicle, road, SPEED).variance


def _quadrature_errors() -> float:
    """Largest relative error of the half car's variances against integrals over its spectra."""
    return largest_relative_error(
        stationary_covariance(_system("half_car", _single_track_road)[2]).variance, _variances_by_spectra()
    )


def _closed_form_error() -> float:
    """Relative error of the variance of the quarter car's body acceleration on a first-order road, against its closed
    form."""
    q, corner = 1e-4, 0.3
    road = RoadExcitation(np.array([[-corner]]), np.array([[q**0.5]]), (np.ones((1, 1)),), (0.0,))
    variance = stationary_covariance(_system("quarter_car", lambda vehicle: road)[2]).variance[0]
    car = QuarterCar(297.15222009894956, 31.8960913028392, 24453.137879749014, 1786.2441002440723, 158294.1398119115)
    return largest_relative_error(variance, car.body_acceleration_variance(q * SPEED, corner * SPEED))


@cache
def _covariance_of_heights() -> np.ndarray:
    """Variances of the road heights under each wheel of the vehicle R19-ride, and of the sum of the left heights, in
    closed form."""
    wheels = spatial_linear.wheels(vehicle_file.load_vehicle("r19_ride"))
    P = two_track.input_covariance(two_track.road_of_level(two_track.half_track(wheels)), wheels)
    left = [i for i, wheel in enumerate(wheels) if wheel.y > 0]
    return np.append(np.diag(P), P[np.ix_(left, left)].sum())


def _road_height_errors() -> float:
    """Largest relative error of the variances of road heights under the wheels of R19-ride by filters and delays,
    against their closed form."""
    vehicle = spatial_linear.linearise(vehicle_file.load_vehicle("r19_ride"))
    no, unit = np.zeros(len(vehicle.mass)), np.eye(len(vehicle.wheels))
    left = sum(unit[i] for i, wheel in enumerate(vehicle.wheels) if wheel.y > 0)
    rows = [*unit, left]
    outputs = tuple(LinearOutput(str(i), "m", "road", no, no, no, row, 0.0 * row) for i, row in enumerate(rows))
    road = two_track.road_excitation(two_track.road_of_level(two_track.half_track(vehicle.wheels)), vehicle.wheels)
    from models.ride import excited

    variance = stationary_covariance(excited.vehicle_with_road(replace(vehicle, outputs=outputs), road, SPEED)).variance
    return largest_relative_error(variance, _covariance_of_heights())


def _paper_road_error() -> float:
    """Relative error of the variance of a track of the paper's road, against pi S0 / 2 (1 / 0.3 + 1 / 1.5)."""
    covariance = float(two_track.road_of_level(0.7).covariance(np.array(0.0), 0.7, 0.7))
    return largest_relative_error(covariance, np.pi * 1.6e-5 / 2.0 * (1.0 / 0.3 + 1.0 / 1.5))


def _eigenfrequency_errors() -> float:
    """Largest relative error of the 19 eigenfrequencies of R19-ride, against values computed from its data."""
    rates = eigenvalues(spatial_linear.linearise(vehicle_file.load_vehicle("r19_ride")))
    return largest_relative_error(np.sort(np.abs(rates))[::2] / (2 * np.pi), R19_FREQUENCIES)


def _sprung_inertia_error() -> float:
    """Error of the inertia of R19-free's body and engine about their common centre of mass, divided by the largest
    published entry."""
    vehicle = vehicle_file.load_vehicle("r19_free")
    parts = [vehicle.body(name) for name in ("body", "engine")]
    centre = sum(body_part.mass * np.array(body_part.position) for body_part in parts) / sum(
        body_part.mass for body_part in parts
    )
    total = np.zeros((3, 3))
    for body_part in parts:
        arm = np.array(body_part.position) - centre
        total += np.array(body_part.inertia) + body_part.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return float(np.abs(total - PUBLISHED_INERTIA).max() / PUBLISHED_INERTIA.max())


@cache
def _hand_written_accelerations(vehicle_name: str) -> np.ndarray:
    vehicle = vehicle_file.load_vehicle(vehicle_name)
    return SpatialReference(vehicle, SPEED).acceleration(0.0, *_small_state(vehicle))


def _small_state(vehicle: SpatialVehicle) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Small coordinates, rates and road heights with rates that are all different, so that no errors cancel."""
    n, w = len(vehicle.coordinates()), len(vehicle.tyres)
    return 1e-7 * np.cos(np.arange(n)), 1e-6 * np.sin(1.0 + np.arange(n)), 1e-7 * np.cos(0.7 * np.arange(2 * w))


def _acceleration_errors() -> float:
    """Largest relative error of the accelerations of R19-ride and R19-free at a small state, against equations written
    by hand."""
    sizes = []
    for name in ("r19_ride", "r19_free"):
        vehicle = vehicle_file.load_vehicle(name)
        linear, (q, v, road) = spatial_linear.linearise(vehicle, SPEED), _small_state(vehicle)
        z, rate = np.split(road, 2)
        force = linear.road_stiffness @ z + linear.road_damping @ rate - linear.stiffness @ q - linear.damping @ v
        accelerations, wanted = np.linalg.solve(linear.mass, force), _hand_written_accelerations(name)
        sizes.append(float(np.abs(accelerations - wanted).max() / np.abs(wanted).max()))
    return max(sizes)


def _filter_state_errors() -> float:
    """Largest relative error of the weighting filter Wk's state-space response at eight frequencies, against the
    formulas of its sections."""
    A, B, C = WEIGHTINGS["Wk"].matrices()
    frequency = np.geomspace(0.3, 200.0, 8)
    response = np.array([C @ np.linalg.solve(2j * np.pi * f * np.eye(len(A)) - A, B) for f in frequency])
    return largest_relative_error(response, WEIGHTINGS["Wk"].response(frequency))


def _standard_table_error() -> float:
    """Largest relative error of the frequency weighting Wk against the standard's table."""
    frequency, wk, _ = np.array(STANDARD_WEIGHTINGS).T
    return largest_relative_error(1e3 * np.abs(WEIGHTINGS["Wk"].response(frequency)), wk)


CHECKS = {
    "quadrature": Check("half car: variances, spectra integrated", "relative", 1e-9, _quadrature_errors),
    "closed form": Check("quarter car: body acceleration in closed form", "relative", 1e-10, _closed_form_error),
    "heights": Check("R19-ride: road under its wheels in closed form", "relative", 1e-10, _road_height_errors),
    "paper's road": Check("variance of a track of the paper's road", "relative", 1e-12, _paper_road_error),
    "frequencies": Check("R19-ride: 19 eigenfrequencies of its data", "relative", 1e-5, _eigenfrequency_errors),
    "whole inertia": Check(
        "R19-free: published inertia of body with engine", "of the largest", 1e-9, _sprung_inertia_error
    ),
    "equations": Check("R19: accelerations by hand-written equations", "of the largest", 1e-5, _acceleration_errors),
    "Wk's formula": Check("Wk: states against its sections", "relative", 1e-12, _filter_state_errors),
    "Wk's table": Check("Wk: the standard's table", "relative", 5e-3, _standard_table_error),
}


def _vehicle_patch(change_vehicle: Callable[[SpatialVehicle], SpatialVehicle]) -> Patch:
    """Fault: every vehicle is replaced by change_vehicle(vehicle) as it is loaded."""
    return attribute_patch(
        "models.vehicles.vehicle_file:load_vehicle", lambda real: lambda *arguments: change_vehicle(real(*arguments))
    )


def _excited_patch(change_system: Callable[[DelayedSystem, float], DelayedSystem]) -> Patch:
    """Fault: every linear system of vehicle and road is replaced by change_system(system, speed)."""
    return attribute_patch(
        "models.ride.excited:vehicle_with_road",
        lambda real: lambda v, e, speed: change_system(real(v, e, speed), speed),
    )


def _reversed_delays(original_function: Any) -> Any:
    def hits(delayed_system: DelayedSystem) -> Any:
        met = original_function(delayed_system)
        delays = [met.delays[-1] - delay for delay in met.delays[::-1]]
        return met._replace(B=met.B[::-1], D=met.D[::-1], delays=delays)

    return hits


def _on_front_track(original_function: Any) -> Any:
    def row(
        wheel: WheelPosition,
        mean_process: Any,
        roll_process: Any,
        left_right_word: str,
        wheels: tuple[WheelPosition, ...],
    ) -> Any:
        y = np.copysign(abs(wheels[0].y), wheel.y)
        return original_function(replace(wheel, y=y), mean_process, roll_process, left_right_word, wheels)

    return row


def _opposite_twist(original_function: Any) -> Any:
    return lambda motion, bar: 2.0 * motion.coordinate(bar.body, "rx") - original_function(motion, bar)


def _mirrored_body(vehicle: SpatialVehicle) -> SpatialVehicle:
    """Fault: the heaviest body's centre of mass is mirrored about the middle between the axles (a and b swapped)."""
    heavy = max(vehicle.bodies, key=lambda body: body.mass)
    x, y, z = heavy.position
    moved_body = replace(heavy, position=(vehicle.axles[0] + vehicle.axles[-1] - x, y, z))
    return replace(vehicle, bodies=tuple(moved_body if body is heavy else body for body in vehicle.bodies))


def _opposite_products_of_inertia(vehicle: SpatialVehicle) -> SpatialVehicle:
    """Fault: products of inertia have the opposite sign."""

    def tensor(inertia_matrix: Any) -> Any:
        return tuple(map(tuple, 2.0 * np.diag(np.diag(inertia_matrix)) - np.array(inertia_matrix)))

    return replace(vehicle, bodies=tuple(replace(body, inertia=tensor(body.inertia)) for body in vehicle.bodies))


def _wrong_wk(standard_weightings: Any) -> Any:
    return {**standard_weightings, "Wk": weighting_of_standard("Wk", (12.5, 12.5, 0.63), (3.35, 0.91, 2.37, 0.91))}


def _missing_coupling(original_function: Any) -> Any:
    def matrices(weighting_filter: Any) -> Any:
        A, B, C = original_function(weighting_filter)
        A = A.copy()
        A[5, 2:4] = 0.0  # what the third section hears of the second
        return A, B, C

    return matrices


FAULTS = (
    CampaignFault(
        "rear axle ahead of the front one",
        "covariance",
        attribute_patch("models.ride.covariance:noise_arrivals", _reversed_delays),
    ),
    CampaignFault(
        "cross terms of the axles missing",
        "covariance",
        attribute_patch(
            "models.ride.covariance:_responses_before_arrival",
            lambda real: lambda A, met, moved: [np.zeros_like(b) for b in met.B],
        ),
    ),
    CampaignFault(
        "noise without the root of the speed",
        "road",
        _excited_patch(lambda road, v: replace(road, B=tuple(b / v**0.5 for b in road.B))),
    ),
    CampaignFault(
        "noise with the speed, not its root",
        "road",
        _excited_patch(lambda road, v: replace(road, B=tuple(b * v**0.5 for b in road.B))),
    ),
    CampaignFault(
        "delay by the speed in km/h",
        "road",
        _excited_patch(lambda road, v: replace(road, delays=tuple(tau / 3.6 for tau in road.delays))),
    ),
    CampaignFault(
        "rear wheels on the front track", "road", attribute_patch("models.road.two_track:_height_row", _on_front_track)
    ),
    CampaignFault(
        "one-sided level taken for two-sided",
        "road",
        attribute_patch(
            "models.road.two_track:road_of_level",
            lambda real: lambda y, level=two_track.TRACK_DENSITY_LEVEL, **others: real(y, 2.0 * level, **others),
        ),
    ),
    CampaignFault("a and b swapped", "vehicle", _vehicle_patch(_mirrored_body)),
    CampaignFault("sign of the products of inertia", "vehicle", _vehicle_patch(_opposite_products_of_inertia)),
    CampaignFault(
        "sign of the anti-roll bar",
        "vehicle",
        attribute_patch("models.vehicles.spatial_linear:_bar_twist_row", _opposite_twist),
    ),
    CampaignFault(
        "tyre stiffness per axle for per wheel",
        "vehicle",
        _vehicle_patch(lambda car: replace(car, tyres=tuple(replace(t, stiffness=2 * t.stiffness) for t in car.tyres))),
    ),
    CampaignFault(
        "Wk: upward step turned round", "weighting", attribute_patch("validation.faults.ride:WEIGHTINGS", _wrong_wk)
    ),
    CampaignFault(
        "Wk: a section hears too little",
        "weighting",
        attribute_patch("models.ride.weighting:FrequencyWeighting.matrices", _missing_coupling),
    ),
)


CAMPAIGN = Campaign("planted.ride", "ride", "ride", CHECKS, FAULTS)
