"""Plane vehicles under prescribed brake torques, advanced by twinrig's step or by an engine, for checks of a truck."""

from collections.abc import Callable

import numpy as np

from models.brake.advance import AT_REST, FINE, advance
from models.brake.plane_records import WheelReport, motion_of
from models.brake.plane_vehicle import GRAVITY, PAPER_TRUCK, PlaneVehicle, plane_of_truck
from models.brake.surfaces import UNIFORM_ROAD, RoadSurfaces, VehicleOnRoad
from models.core.errors import RunFailed
from models.tyre.magic_formula import table_of_surface
from models.tyre.tyre_table import StackedTyreTables, TyreTable, stacked_tables


def on_road(
    plane_vehicle: PlaneVehicle,
    tyre_tables: StackedTyreTables,
    road: RoadSurfaces = UNIFORM_ROAD,
    cornering_slope: float = 10.0,
) -> VehicleOnRoad:
    """A vehicle in the plane on a road, all of its wheels with the same tyre. cornering_slope: slope of its friction
    at small slip angles (1/rad)."""
    return VehicleOnRoad(plane_vehicle, np.zeros(plane_vehicle.wheels, dtype=int), cornering_slope, tyre_tables, road)


class RollingTruck:
    """A plane vehicle that starts by rolling along x at a speed (m/s), with steered front wheels (rad).

    motion : its present motion, overwritten in every step; time : simulated until now (s); step_function : ``advance``,
    or an engine's.
    """

    def __init__(
        self,
        vehicle: VehicleOnRoad,
        speed: float,
        *,
        steer: float = 0.0,
        advance_step: Callable[..., tuple[int, float]] = advance,
    ) -> None:
        self.plane, self.time = vehicle.plane, 0.0
        state = np.zeros((2, 2 + vehicle.plane.masses.size))
        state[1, 0] = speed
        self.motion = motion_of(state, speed / self.plane.radius)
        steered = np.where(self.plane.place[:, 0] > 0.0, steer, 0.0)
        self._go, self._others = advance_step, (steered, vehicle)

    @property
    def state(self) -> np.ndarray:
        """Positions and rates (2, 2 + number of units): x, y (m, m/s), then heading of each unit (rad, rad/s)."""
        return self.motion.state

    @property
    def turning(self) -> np.ndarray:
        """Angular velocities of the wheels (number of wheels,) in rad/s."""
        return self.motion.turning

    @property
    def report(self) -> WheelReport:
        """Forces, loads, slips and further quantities of the wheels in the last step."""
        return WheelReport(*self.motion.report)

    @property
    def speed(self) -> float:
        """Speed of the first unit's centre of mass (m/s)."""
        return float(np.hypot(*self.state[1, :2]))

    def on(self, brake_torques: np.ndarray, time_step: float) -> tuple[int, float]:
        """Advance by n time steps (s) with brake torques (n + 1, number of wheels) in N m at their ends. Returns the
        status of the last step and the simulated time (s).

        brake_torques (number of wheels,) : constant during a single step.
        """
        ends = brake_torques if brake_torques.ndim > 1 else np.tile(brake_torques, (2, 1))
        status, used = self._go(self.motion, ends, time_step, *self._others)
        self.time += used
        return status, used

    def braked(
        self, brake_torques: np.ndarray, time_step: float = 5.5e-3, end_speed: float = 0.0, duration: float = 200.0
    ) -> "RollingTruck":
        """Advance with constant brake torques (N m) until the vehicle stands, or until it reaches a speed (m/s) or a
        time (s); returns the vehicle. Raises RunFailed."""
        status = FINE
        while status == FINE and self.speed > end_speed and self.time < duration - 1e-9:
            status, _ = self.on(brake_torques, time_step)
        if status not in (FINE, AT_REST):
            raise RunFailed("braking", "the truck does not come to its end", self.time)
        return self


PAPER_PLANE = plane_of_truck(PAPER_TRUCK)
ICE_TABLE = table_of_surface("ice")
LOCKING_TORQUE = 1e9
"""Torque (N m) that locks a wheel at once."""


def truck_on_tables(
    tyre_tables: StackedTyreTables | None = None, plane_vehicle: PlaneVehicle = PAPER_PLANE
) -> VehicleOnRoad:
    """The paper's truck on ice, or on other tyre tables with the cornering slope of ice."""
    return on_road(plane_vehicle, tyre_tables or stacked_tables([ICE_TABLE]), cornering_slope=ICE_TABLE.cornering)


def constant_friction(friction_coefficient: float) -> StackedTyreTables:
    """Tyre tables whose friction coefficient is the given one at every slip above 0.1."""
    flat = np.broadcast_to(np.array([0.0, friction_coefficient, friction_coefficient]), (3, 1, 3)).copy()
    nodes = np.array([0.0, 0.1, np.pi / 2.0]), np.array([0.0, 0.1, 1.0]), np.array([1e4])
    g, h = (
        np.ones((3, 3)) * np.array([1.0, 0.0, 0.0]),
        np.array([[0.0], [friction_coefficient], [friction_coefficient]]),
    )
    return stacked_tables([TyreTable(*nodes, flat, g, h)])


def transfer_errors(friction_coefficient: float = 0.4) -> dict[str, float]:
    """Relative errors of the axle loads against a closed form, with all wheels, the front or the rear wheels locked.

    A friction coefficient mu on a part of the weight slows the whole mass: z = mu F / (m g -+ mu m g h / E) for one
    axle, and the axles' loads change by m z g h / E.
    """
    lift = PAPER_TRUCK.height / PAPER_TRUCK.wheelbase
    light, static = PAPER_PLANE._replace(spin_inertia=np.full(4, 1e-9)), PAPER_PLANE.static_loads.reshape(2, 2).sum(1)
    slowing = {
        "all wheels": friction_coefficient * GRAVITY,
        "front wheels": friction_coefficient * static[0] / (PAPER_TRUCK.mass * (1.0 - friction_coefficient * lift)),
        "rear wheels": friction_coefficient * static[1] / (PAPER_TRUCK.mass * (1.0 + friction_coefficient * lift)),
    }
    torques, errors = {"all wheels": (1e5, 1e5), "front wheels": (1e5, 0.0), "rear wheels": (0.0, 1e5)}, {}
    for name, torque in torques.items():
        slid = RollingTruck(truck_on_tables(constant_friction(friction_coefficient), light), 10.0).braked(
            np.repeat(torque, 2), duration=0.5
        )
        wanted = static + PAPER_TRUCK.mass * slowing[name] * lift * np.array([1.0, -1.0])
        errors[name] = float(np.abs(slid.report.load.reshape(2, 2).sum(1) / wanted - 1.0).max())
    return errors


def lateral_displacement_when_locked() -> float:
    """Lateral displacement (m) of a truck that slows from 10 to 1 m/s on ice with its front wheels steered by 0.05 rad
    and locked."""
    locked = np.array([LOCKING_TORQUE, LOCKING_TORQUE, 0.0, 0.0])
    return float(RollingTruck(truck_on_tables(), 10.0, steer=0.05).braked(locked, end_speed=1.0).state[0, 1])
