"""Vehicle, road and linear vehicle at a speed of a ride scene."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import copysign
from typing import TYPE_CHECKING

from models.core.errors import InputError
from models.core.scene_effects import extended_by_effects
from models.own_model.scene_vehicle import scene_vehicle
from models.road.excitation import RoadExcitation
from models.road.iso8608 import level_of_class
from models.road.shape_filter import ShapeFilter
from models.road.two_track import TwoTrackRoad, half_track, road_excitation, road_of_level, wheels_on_track
from models.systems.ride.scene import RideScene
from models.vehicles.linear_vehicle import LinearVehicle, WheelPosition
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import linearise

if TYPE_CHECKING:
    from models.road.fitted import FittedRoad

GRAVITY = 9.81
"""Gravity (m/s^2) where a scene's operating point is loaded."""
LinearVehicleAtSpeed = Callable[[float], LinearVehicle]
"""Function that returns the linear vehicle at a speed (m/s)."""
CLOSED_FORM_STUDY = "ride"
"""Name of the study that takes vehicle files of reduced vehicles, with massless or rigid parts."""
ONE_TRACK_OFFSET = 1.0
"""Distance (m) from the centre line of the track of a vehicle without a width; its level is the same at any distance.
"""


@dataclass(frozen=True)
class Built:
    """Vehicle and road of a scene, which effects change. ``road`` : functions that change the road under the wheels,
    applied in turn.

    A change keeps the noise; states that it adds come after the states of the road's filters.
    """

    vehicle: SpatialVehicle
    road: tuple[Callable[[RoadExcitation], RoadExcitation], ...] = ()


def vehicle_of(scene: RideScene) -> SpatialVehicle:
    """Returns the scene's vehicle with its effects; it has gravity if its operating point is loaded.

    Raises InputError for a loaded vehicle that may yaw, since its preloaded springs keep their directions in space and
    not in the vehicle, so that their moments about z would turn it back or further. Raises InputError also for a tyre
    that may lift where small motion is requested.
    """
    vehicle = _built_vehicle(scene).vehicle
    if vehicle.lifts and scene.vehicle.small_motion:
        allowed = "in small motion no wheel leaves the road: leave it out beside effects.lift_off"
        raise InputError(scene.file, "vehicle.small_motion", True, allowed)
    if scene.vehicle.operating_point == "loaded" and vehicle.side_forces:
        allowed = "a vehicle with side forces may yaw, while preloads keep their directions in space: use unloaded"
        raise InputError(scene.file, "vehicle.operating_point", "loaded", allowed)
    return replace(vehicle, gravity=GRAVITY if scene.vehicle.operating_point == "loaded" else 0.0)


def _built_vehicle(scene: RideScene) -> Built:
    file, reduced = scene.vehicle.file, scene.study == CLOSED_FORM_STUDY
    return extended_by_effects(
        Built(scene_vehicle(file, scene.folder, scene.file, "vehicle.file", allows_reduced_vehicle=reduced)), scene
    )


def check_linear(scene: RideScene, vehicle: SpatialVehicle) -> None:
    """Raise InputError for springs with curves or friction, unless the scene asks for small motion, which uses their
    slopes at rest, and for tyres that may lift.
    """
    if vehicle.lifts:
        raise InputError(
            scene.file,
            "effects.lift_off",
            None,
            "has no covariance: use the study ride_nonlinear, whose copies and engines run in time, or leave it out",
        )
    bent = [spring.name for spring in vehicle.springs if spring.is_nonlinear]
    if bent and not scene.vehicle.small_motion:
        raise InputError(
            scene.file,
            "vehicle.file",
            scene.vehicle.file,
            f"has curves or friction ({', '.join(bent)}), whose slopes at rest can be 60 % wrong: "
            "use the study ride_nonlinear, or say vehicle.small_motion = true",
        )


def needs_run_in_time(scene: RideScene) -> bool:
    """Whether a scene needs runs in time: springs of its vehicle are nonlinear or tyres may lift, and small motion is
    not requested.
    """
    return not scene.vehicle.small_motion and has_no_linear_equivalent(vehicle_of(scene))


def has_no_linear_equivalent(vehicle: SpatialVehicle) -> bool:
    """Whether a vehicle has no linear equivalent: its springs are nonlinear or its tyres may lift."""
    return vehicle.lifts or any(spring.is_nonlinear for spring in vehicle.springs)


def linear_vehicle(vehicle: SpatialVehicle, engine: str = "reference") -> LinearVehicleAtSpeed:
    """Returns a function from speed (m/s) to the linear vehicle, linearised by an engine or from its equations."""
    if engine != "reference":
        from models.engines.spatial_protocol import linear_vehicle_at_speeds

        return linear_vehicle_at_speeds(engine, vehicle)
    if vehicle.side_forces or vehicle.drags:
        return lambda speed: linearise(vehicle, speed)
    only = linearise(vehicle)
    return lambda speed: only


def road_of(scene: RideScene, wheel_positions: tuple[WheelPosition, ...]) -> TwoTrackRoad:
    """Returns the scene's road of two tracks. The level holds at half_track of [road], by default half the front
    track.
    """
    road = scene.road
    if road.file is not None:
        fitted = fitted_road(scene).road
        return TwoTrackRoad(replace(fitted.mean, cutoff=road.cutoff), replace(fitted.roll, cutoff=road.cutoff))
    if road.q_mean is not None and road.q_roll is not None:
        return TwoTrackRoad(
            ShapeFilter(road.corner_mean, road.q_mean, road.cutoff),
            ShapeFilter(road.corner_roll, road.q_roll, road.cutoff),
        )
    level = road.level if road.iso8608 is None else level_of_class(road.iso8608)
    return road_of_level(
        half_track_of(scene, wheel_positions),
        level,
        corner_wavenumbers=(road.corner_mean, road.corner_roll),
        cutoff_wavenumber=road.cutoff,
    )


def fitted_road(scene: RideScene) -> "FittedRoad":
    """Reads the measured road of a scene and fits spectra to it; raises InputError where none can be fitted."""
    from models.road.fitted import fit_road
    from models.road.measured_tracks import read_tracks

    road = scene.road
    assert road.file is not None
    path = scene.path(road.file, "road.file")
    return fit_road(read_tracks(path, road.track_width, first_station=road.first, last_station=road.last))


def half_track_of(scene: RideScene, wheel_positions: tuple[WheelPosition, ...]) -> float:
    """Distance (m) of the road's tracks from the centre line."""
    if scene.road.file is not None:
        return scene.road.track_width / 2.0
    return scene.road.half_track or half_track(wheel_positions) or ONE_TRACK_OFFSET


def excitation_of(
    scene: RideScene, wheel_positions: tuple[WheelPosition, ...], correlation_case: tuple[str, str] | None = None
) -> RoadExcitation:
    """Returns the road's excitation of the wheels with the scene's effects; ``correlation_case`` : correlations left to
    right and front to rear, by default the scene's.
    """
    left_right, front_rear = correlation_case or (scene.road.left_right, scene.road.front_rear)
    placed = placed_wheels(scene, wheel_positions)
    try:
        heights = road_excitation(road_of(scene, wheel_positions), placed, left_right, front_rear)
    except InputError as error:
        if error.file:
            raise
        raise InputError(scene.file, f"road.{error.place}", error.value, error.allowed) from None
    for change in _built_vehicle(scene).road if scene.effects else ():
        heights = change(heights)
    return heights


@contextmanager
def scene_errors(scene: RideScene) -> Iterator[None]:
    """Context that adds the scene's file and key to an InputError of functions that know no scene."""
    try:
        yield
    except InputError as error:
        if error.file:
            raise
        if error.place.partition(" ")[0] not in ("vehicle", "output"):
            raise InputError(scene.file, error.place, error.value, error.allowed) from None
        allowed = error.allowed if error.place == "vehicle" else f"{error.place}: {error.allowed}"
        raise InputError(scene.file, "vehicle.file", scene.vehicle.file, allowed) from None


def placed_wheels(scene: RideScene, wheel_positions: tuple[WheelPosition, ...]) -> tuple[WheelPosition, ...]:
    """Returns the wheels with the lateral positions at which they meet the road: at their own y, or in the tracks of
    the first axle's wheels.

    A vehicle without a width runs on one of the tracks where the road is given by the level of a track.
    """
    if not any(wheel.y for wheel in wheel_positions):
        return (
            wheels_on_track(wheel_positions, half_track_of(scene, wheel_positions))
            if scene.road.q_mean is None
            else wheel_positions
        )
    if scene.road.wheels == "own":
        return wheel_positions
    if half_track(wheel_positions) == 0.0:
        raise InputError(scene.file, "road.wheels", "tracks", "the first axle has no two tracks in which to run")
    return wheels_in_tracks(wheel_positions)


def wheels_in_tracks(wheel_positions: tuple[WheelPosition, ...]) -> tuple[WheelPosition, ...]:
    """Returns the wheels moved laterally into the track of the first axle's outermost wheel on the same side."""
    first = [wheel.y for wheel in wheel_positions if wheel.axle == 0]
    tracks = {1.0: max(first), -1.0: min(first)}
    return tuple(replace(wheel, y=tracks[copysign(1.0, wheel.y)] if wheel.y else 0.0) for wheel in wheel_positions)
