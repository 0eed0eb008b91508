"""Adhesion utilisation of an anti-lock system, measured as in a road test: adhesion k of each axle braked alone, then
braking rate z with the anti-lock system.

The procedure is that of UN R13, Annex 13, appendix 2, in a simulation that repeats exactly; not checked against the
text of the regulation.
"""

from dataclasses import astuple, dataclass
from typing import Any

import numpy as np

from models.brake.controller import ConstantPressures
from models.brake.figures_of_merit import (
    METRES_PER_SECOND_OF_KMH,
    AxleLoads,
    adhesion_front,
    adhesion_of_vehicle,
    adhesion_rear,
    adhesion_trailer,
    braking_rate,
    crossing_time,
    least_braking_rate_on_split,
    mean_of_shortest_times,
)
from models.brake.plane_vehicle import GRAVITY
from models.core.errors import RunFailed
from models.systems.braking.march import BrakedVehicle, BrakingPath
from models.systems.braking.of_scene import braked_vehicle, surfaces_of_stretch, vehicle_of
from models.systems.braking.plan import controller_text
from models.systems.braking.procedures import controlled_run, step_steer_response
from models.systems.braking.scene import BrakingProcedure, BrakingRoadTable, BrakingScene, RoadStretch
from models.systems.braking.stop_report import StopHistory

AXLE_NAMES_IN_ERRORS = ("front axle", "rear axle", "trailer's front axle", "trailer's rear axle")
PRESSURE_BISECTION_COUNT = 9
"""Halvings of the interval that contains the pressure at which an axle locks, to 1/500 of the supply pressure."""
LONGEST_RUN_DURATION = 120.0
"""Longest duration (s) of a run that measures adhesion, in place of the scene's duration."""
PRESSURE_SHARES_BELOW_LOCK = (1.0, 0.98, 0.96)
"""Pressures of the three runs that measure k, divided by the largest pressure at which no wheel locks."""


class NoAdhesion(RunFailed):
    """The test procedure gives no adhesion coefficient for this vehicle on this surface."""

    def __init__(self, reason: str) -> None:
        super().__init__("adhesion utilisation", f"not found: {reason}")


@dataclass(frozen=True)
class Adhesion:
    """Adhesion coefficients k on a surface: of the front axle, of the rear axle, and of the trailer's axles if there
    are any.
    """

    front: float
    rear: float
    trailer: tuple[float, ...] = ()


@dataclass(frozen=True)
class AdhesionUtilisation:
    """Braking rate z (deceleration divided by g) with the anti-lock system, adhesion k_M of the vehicle, and their
    ratio epsilon = z / k_M.

    With a trailer all three are those of the train.
    """

    z: float
    adhesion: Adhesion
    k_vehicle: float

    @property
    def epsilon(self) -> float:
        """Adhesion utilisation by the anti-lock system, z / k_M. Category 1 requires at least 0.75; above 1, k must be
        measured again.
        """
        return self.z / self.k_vehicle


def axle_geometry(scene: BrakingScene) -> AxleLoads:
    """Axle loads (N), wheelbase (m) and height of the centre of mass (m) of the scene's vehicle."""
    truck = vehicle_of(scene)
    weight = truck.mass * GRAVITY
    front = weight * -truck.rear.x / truck.wheelbase
    return AxleLoads(front, weight - front, truck.wheelbase, truck.height)


def trailer_loads(vehicle: BrakedVehicle, braking_rate_z: float) -> np.ndarray:
    """Loads (2,) in N of the trailer's axles at a deceleration z g; shape (0,) without a trailer."""
    loads = vehicle.plane.static_loads - vehicle.plane.load_per_x_acceleration * braking_rate_z * GRAVITY
    return loads[4:].reshape(-1, 2).sum(axis=1)


def vehicle_on_one_surface(scene: BrakingScene, surface_name: str, **scene_changes: Any) -> BrakedVehicle:
    """Returns the scene's vehicle on a road of a single surface; ``scene_changes`` replace values of the scene, for
    example its trailer.
    """
    road = BrakingRoadTable(stretches=[RoadStretch(left=surface_name)])
    return braked_vehicle(scene.model_copy(update={"road": road, **scene_changes}), BrakingProcedure())


def measured_adhesion(scene: BrakingScene, surface_name: str) -> Adhesion:
    """Measure the adhesion k of every axle on a surface: each axle is braked alone from 50 km/h without locking. Raises
    NoAdhesion.
    """
    vehicle, lengths = vehicle_on_one_surface(scene, surface_name, trailer=None), axle_geometry(scene)
    if vehicle.sprung is not None and vehicle.sprung.turns.size:
        raise NoAdhesion("axles are braked without trailer: name a vehicle.file whose vehicle tows nothing")
    front, rear = (
        adhesion_front(_single_axle_braking_rate(scene, vehicle, 0), lengths),
        adhesion_rear(_single_axle_braking_rate(scene, vehicle, 1), lengths),
    )
    if scene.trailer is None:
        return Adhesion(front, rear)
    train = vehicle_on_one_surface(scene, surface_name)
    rates, weight = (
        [_single_axle_braking_rate(scene, train, axle) for axle in (2, 3)],
        float(train.plane.static_loads.sum()),
    )
    trailer = (adhesion_trailer(z, weight, float(trailer_loads(train, z)[i])) for i, z in enumerate(rates))
    return Adhesion(front, rear, tuple(trailer))


def _controlled_braking_rate(
    scene: BrakingScene, procedure_name: str, vehicle: BrakedVehicle, speeds_kmh: tuple[float, float, float]
) -> float:
    """Braking rate z with the scene's controller, or with what is connected to its port. ``speeds_kmh`` (km/h) : at
    which braking begins, and between which z is measured.
    """
    port = None if scene.port is None else scene.port.model_copy(update={"log": None})
    lasting = scene.model_copy(
        update={"port": port, "run": scene.run.model_copy(update={"duration": LONGEST_RUN_DURATION})}
    )
    begin, high, low = speeds_kmh
    path = controlled_run(lasting, procedure_name, vehicle, vehicle.rolling(begin * METRES_PER_SECOND_OF_KMH))
    return braking_rate(high * METRES_PER_SECOND_OF_KMH, low * METRES_PER_SECOND_OF_KMH, _slowing_time(path, high, low))


def _single_axle_braking_rate(scene: BrakingScene, vehicle: BrakedVehicle, axle_index: int) -> float:
    """Braking rate z with a single braked axle, from the mean time of the fastest runs between 40 and 20 km/h."""
    wheels = np.arange(vehicle.plane.wheels) // 2 == axle_index

    def run(pressure: float) -> BrakingPath:
        return vehicle.run(
            ConstantPressures(np.where(wheels, pressure, 0.0)), 50.0 * METRES_PER_SECOND_OF_KMH, LONGEST_RUN_DURATION
        )

    low, high = 0.0, scene.brakes.supply
    if not _wheel_locks(run(high)):
        raise NoAdhesion(f"the {AXLE_NAMES_IN_ERRORS[axle_index]} does not lock at the supply's {high:g} bar")
    for _ in range(PRESSURE_BISECTION_COUNT):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _wheel_locks(run(middle)) else (middle, high)
    braking_times = [_slowing_time(run(share * low), 40.0, 20.0) for share in PRESSURE_SHARES_BELOW_LOCK]
    if not np.isfinite(braking_times).any():
        raise NoAdhesion(f"the {AXLE_NAMES_IN_ERRORS[axle_index]} alone does not slow the vehicle down to 20 km/h")
    return braking_rate(
        40.0 * METRES_PER_SECOND_OF_KMH,
        20.0 * METRES_PER_SECOND_OF_KMH,
        mean_of_shortest_times(np.array(braking_times)),
    )


def _wheel_locks(braking_path: BrakingPath) -> bool:
    """Whether a wheel locks above 20 km/h."""
    fast = StopHistory(braking_path).speed[:-1] > 20.0 * METRES_PER_SECOND_OF_KMH
    return bool((braking_path.reports.locked[fast] > 0.0).any())


def _slowing_time(braking_path: BrakingPath, upper_speed: float, lower_speed: float) -> float:
    """Time (s) in which the vehicle slows from ``upper_speed`` to ``lower_speed`` (km/h); NaN if it never reaches
    ``lower_speed``.
    """
    stop = StopHistory(braking_path)
    return crossing_time(stop.times, stop.speed, lower_speed * METRES_PER_SECOND_OF_KMH) - crossing_time(
        stop.times, stop.speed, upper_speed * METRES_PER_SECOND_OF_KMH
    )


def measured_utilisation(
    scene: BrakingScene, surface_name: str, known_adhesions: Adhesion | None = None, port_run_name: str = "adhesion"
) -> AdhesionUtilisation:
    """Measure the adhesion utilisation epsilon of the scene's anti-lock system on a surface. z is measured from 45 to
    15 km/h after braking from 55 km/h.

    known_adhesions : adhesion of the axles, measured if None; port_run_name : of the run at the port.
    """
    lengths, known_adhesions = axle_geometry(scene), known_adhesions or measured_adhesion(scene, surface_name)
    train = vehicle_on_one_surface(scene, surface_name)
    z = _controlled_braking_rate(scene, port_run_name, train, (55.0, 45.0, 15.0))
    loads = np.concatenate(([lengths.weight], trailer_loads(train, z)))
    axle_adhesions = np.array(
        [adhesion_of_vehicle(z, known_adhesions.front, known_adhesions.rear, lengths), *known_adhesions.trailer]
    )
    return AdhesionUtilisation(z, known_adhesions, float(axle_adhesions @ loads / loads.sum()))


@dataclass(frozen=True)
class SplitAdhesion:
    """Braking rate z on split friction, and adhesion of the vehicle on the surface of lower (k_L) and higher (k_H)
    friction. The required z is the larger of 0.75 (4 k_L + k_H) / 5 and k_L.
    """

    z: float
    k_low: float
    k_high: float

    @property
    def required_braking_rate(self) -> float:
        """Smallest braking rate z on split friction that the regulation requires."""
        return least_braking_rate_on_split(self.k_low, self.k_high)


def measured_split_adhesion(scene: BrakingScene, procedure_name: str) -> SplitAdhesion:
    """Measure the braking rate z of a split procedure, braked from 50 km/h, between 40 and 20 km/h, and the vehicle's
    adhesion on each of the two surfaces of the first stretch.
    """
    procedure, scene_without_trailer = scene.procedures[procedure_name], scene.model_copy(update={"trailer": None})
    adhesions = [
        measured_adhesion(scene_without_trailer, surface)
        for surface in surfaces_of_stretch(procedure, scene.road.stretches[0])
    ]
    z = _controlled_braking_rate(
        scene_without_trailer, procedure_name, braked_vehicle(scene_without_trailer, procedure), (50.0, 40.0, 20.0)
    )
    return SplitAdhesion(z, *sorted(adhesion_of_vehicle(z, k.front, k.rear, axle_geometry(scene)) for k in adhesions))


def figures_of_merit(scene: BrakingScene, procedure_name: str, stop: StopHistory) -> dict[str, float]:
    """Figures of merit of a procedure, by name and unit: response in a turn or J-turn, braking rate on split friction,
    adhesion utilisation of straight braking. Empty where they have no meaning.

    Figures that need further runs are left out where the port has a client that connects once or a log, and where the
    pressures were measured.
    """
    procedure, port = scene.procedures[procedure_name], scene.port
    if procedure.radius is not None:
        if stop.times[-1] < 1.0:
            return {}
        return {f"after 1 s: {key}": value for key, value in stop.results_in_turn(procedure.radius).items()}
    if procedure.kind == "j_turn":
        response = step_steer_response(scene, procedure_name)
        time, overshoot, steady = (np.nan,) * 3 if response is None else astuple(response)
        return {
            "without brakes: response time [s]": time,
            "without brakes: overshoot [%]": 100.0 * overshoot,
            "without brakes: steady yaw rate [deg/s]": np.degrees(steady),
        }
    once = port is not None and (port.port is not None or port.replay is not None)
    if controller_text(scene) == "none" or scene.measured is not None or once:
        return {}
    if procedure.kind == "split":
        split = measured_split_adhesion(scene, procedure_name)
        return {
            "z_MALS": split.z,
            "z_MALS asked for": split.required_braking_rate,
            "k low": split.k_low,
            "k high": split.k_high,
        }
    used = measured_utilisation(scene, scene.road.stretches[0].left)
    return {
        "z_AL": used.z,
        "k front": used.adhesion.front,
        "k rear": used.adhesion.rear,
        "k of all": used.k_vehicle,
        "adhesion utilisation epsilon": used.epsilon,
        **dict(zip(("k trailer front", "k trailer rear"), used.adhesion.trailer, strict=False)),
    }
