"""Hard cases of a quarter vehicle braked by its only wheel, advanced by the compiled step or by an engine; each
function returns the case's error."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from models.brake.advance import AT_REST, FATAL_END_STATUSES, advance, ending_sentence
from models.brake.plane_vehicle import GRAVITY, PlaneVehicle
from models.brake.quarter import QuarterVehicle
from models.brake.surfaces import UNIFORM_ROAD, RoadStretch, RoadSurfaces, road_of_stretches
from models.core.errors import RunFailed
from models.engines.braking import EngineChassis
from models.tyre.magic_formula import table_of_surface
from models.tyre.tyre_table import TyreTable, stacked_tables
from validation.braking.braked_truck import RollingTruck, on_road
from validation.braking.quarter_stops import exact_distance

Error = Callable[[str, Path], float]
STEP, SPEED = 5.5e-3, 10.0
QUARTER = QuarterVehicle(mass=1700.0, radius=0.5, spin_inertia=13.35)
LOAD = QUARTER.mass * GRAVITY
DRY, ICE = table_of_surface("dry"), table_of_surface("ice")


def piecewise_linear_friction(*points: tuple[float, float]) -> TyreTable:
    """Tyre table with longitudinal friction linear between points (slip, mu), equal at every load and slip angle, and
    no lateral friction."""
    slips, mu = np.array(points).T
    friction_along = np.tile(mu, (2, 1, 1))
    return TyreTable(
        np.array([0.0, 1.5]), slips, np.array([LOAD]), friction_along, np.ones((2, slips.size)), np.zeros((2, 1))
    )


class AdvancedVehicle(RollingTruck):
    """A plane vehicle that starts with rolling wheels and is advanced by the reference or an engine."""

    def __init__(
        self,
        implementation: str,
        plane_vehicle: PlaneVehicle,
        *tyre_table: TyreTable,
        speed: float = SPEED,
        rim_turning: float | None = None,
        road: RoadSurfaces = UNIFORM_ROAD,
        steer: float = 0.0,
    ) -> None:
        go = advance if implementation == "reference" else EngineChassis(implementation, plane_vehicle).advance
        super().__init__(on_road(plane_vehicle, stacked_tables(tyre_table), road), speed, steer=steer, advance_step=go)
        self.implementation = implementation
        if rim_turning is not None:
            self.turning[:] = rim_turning

    def advance_with(self, brake_torques: np.ndarray, time_step: float = STEP) -> bool:
        """Advance with brake torques (n + 1, number of wheels) in N m at the ends of n steps (s). Returns whether the
        vehicle came to rest. Raises RunFailed."""
        self.motion.accelerations[:] = 0.0
        status, used = self.on(brake_torques, time_step)
        if status in FATAL_END_STATUSES:
            raise RunFailed(self.implementation, ending_sentence(status, self.plane, self.motion), used)
        return status == AT_REST and bool(np.isfinite(self.state).all() and np.isfinite(self.turning).all())

    @property
    def first_wheel_slip(self) -> float:
        """Magnitude of the first wheel's slip: |rim speed / vehicle speed - 1|."""
        return float(abs(self.plane.radius[0] * self.turning[0] / self.state[1, 0] - 1.0))


def stopping_distance(
    implementation: str,
    brake_torque: float,
    *tyre_table: TyreTable,
    time_step: float = STEP,
    rim_turning: float | None = None,
    road: RoadSurfaces = UNIFORM_ROAD,
) -> float:
    """Stopping distance (m) of the quarter vehicle under a constant brake torque (N m); infinite unless all speeds end
    at exactly 0."""
    wheel = AdvancedVehicle(implementation, QUARTER.plane, *tyre_table, rim_turning=rim_turning, road=road)
    least_force = min(brake_torque / QUARTER.radius, LOAD * min(float(tyre.mu_x[0, 0, -1]) for tyre in tyre_table))
    rests = wheel.advance_with(
        np.full((int(2.0 * SPEED * QUARTER.mass / least_force / time_step) + 50, 1), brake_torque), time_step
    )
    return float(wheel.state[0, 0]) if rests and not wheel.state[1].any() and wheel.turning[0] == 0.0 else np.inf


def constant_slip_stop(tyre_table: TyreTable, slip: float) -> tuple[float, float, float]:
    """Brake torque (N m) at which a slip stays constant, the stopping distance (m) at this slip, and the wheel's
    initial angular velocity (rad/s)."""
    force = LOAD * float(np.interp(slip, tyre_table.slips, tyre_table.mu_x[0, 0]))
    return (
        QUARTER.steady_torque(slip, force),
        QUARTER.mass * SPEED**2 / (2.0 * force),
        (1.0 - slip) * SPEED / QUARTER.radius,
    )


def constant_slip_case(tyre_table: TyreTable, slip: float, time_step: float = STEP) -> Error:
    """Case: a stop at constant slip. Error: relative difference of the stopping distance from m v^2 / (2 F)."""
    level, distance, turning = constant_slip_stop(tyre_table, slip)
    return lambda name, folder: abs(
        stopping_distance(name, level, tyre_table, time_step=time_step, rim_turning=turning) / distance - 1.0
    )


def rolling_start_case(tyre_table: TyreTable, slip: float, time_step: float) -> Error:
    """Case: a stop that starts with a rolling wheel. Error: relative difference of the stopping distance from the exact
    one."""
    level, _, _ = constant_slip_stop(tyre_table, slip)
    return lambda name, folder: abs(
        stopping_distance(name, level, tyre_table, time_step=time_step)
        / exact_distance(QUARTER, tyre_table, level, SPEED)
        - 1.0
    )


PEAKED_FRICTION = piecewise_linear_friction((0.0, 0.0), (0.1, 0.8), (1.0, 0.6))


def locking_torque_error(implementation: str, work_folder: Path) -> float:
    """Case: a brake torque 0.1 % above the torque of the friction peak, so that the wheel locks. Error: relative
    difference of the stopping distance from the exact one."""
    peak = 1.001 * LOAD * 0.8 * (QUARTER.radius + QUARTER.spin_inertia / (QUARTER.mass * QUARTER.radius))
    return abs(
        stopping_distance(implementation, peak, PEAKED_FRICTION) / exact_distance(QUARTER, PEAKED_FRICTION, peak, SPEED)
        - 1.0
    )


def peak_torque_error(implementation: str, work_folder: Path) -> float:
    """Case: a brake torque exactly at the friction peak. Error: relative amount by which the stopping distance lies
    outside the range from constant peak friction to constant sliding friction."""
    force = LOAD * 0.8
    distance = stopping_distance(
        implementation, QUARTER.steady_torque(0.1, force), PEAKED_FRICTION, rim_turning=0.9 * SPEED / QUARTER.radius
    )
    shortest_distance = QUARTER.mass * SPEED**2 / (2.0 * force)
    return max(1.0 - distance / shortest_distance, distance / (shortest_distance * 0.8 / 0.6) - 1.0, 0.0)


def locked_wheel_error(implementation: str, work_folder: Path) -> float:
    """Case: the wheel is locked from the start. Error: relative difference of the stopping distance from v^2 / (2 mu
    g)."""
    distance = stopping_distance(implementation, 2e4, DRY, rim_turning=0.0)
    return abs(distance * 2.0 * GRAVITY * float(DRY.mu_x[0, 0, -1]) / SPEED**2 - 1.0)


def changing_friction_error(implementation: str, work_folder: Path) -> float:
    """Case: a locked wheel whose friction changes from 0.2 to 0.8 after 10 m. Error: relative difference of the
    stopping distance from its closed form."""
    slick, rough = (piecewise_linear_friction((0.0, 0.0), (1.0, mu)) for mu in (0.2, 0.8))
    distance = stopping_distance(
        implementation,
        1e5,
        slick,
        rough,
        rim_turning=0.0,
        road=road_of_stretches([RoadStretch(0.0, 0, 0), RoadStretch(10.0, 1, 1)]),
    )
    return abs(distance / (10.0 + (SPEED**2 - 2.0 * 0.2 * GRAVITY * 10.0) / (2.0 * 0.8 * GRAVITY)) - 1.0)


def friction_range_error(implementation: str, work_folder: Path) -> float:
    """Case: a wheel locked for 0.2 s, with friction from 1e-6 to 1.5. Error: relative difference of the loss of speed
    from mu g t."""
    errors = []
    for mu in (1e-6, 1e-3, 0.1, 1.5):
        wheel = AdvancedVehicle(
            implementation, QUARTER.plane, piecewise_linear_friction((0.0, 0.0), (1.0, mu)), rim_turning=0.0
        )
        wheel.advance_with(np.full((41, 1), 1e6), 5e-3)
        errors.append(abs((SPEED - wheel.state[1, 0]) / (mu * GRAVITY * 0.2) - 1.0))
    return float(max(errors))


def standing_vehicle_error(implementation: str, work_folder: Path) -> float:
    """Case: a standing vehicle with its brakes on. Error: its displacement and speed (m, m/s), which should be 0."""
    wheel = AdvancedVehicle(implementation, QUARTER.plane, DRY, speed=0.0)
    wheel.advance_with(np.full((51, 1), 5e3))
    return float(np.abs(wheel.state).max() + abs(wheel.turning[0]))


def backwards_spin_error(implementation: str, work_folder: Path) -> float:
    """Case: an unbraked wheel that spins backwards at the start. Error: relative difference of rim speed and vehicle
    speed after 0.5 s."""
    wheel = AdvancedVehicle(implementation, QUARTER.plane, DRY, rim_turning=-10.0)
    wheel.advance_with(np.zeros((101, 1)), 5e-3)
    return wheel.first_wheel_slip


def released_brake_error(implementation: str, work_folder: Path) -> float:
    """Case: the brake of a locked wheel is released at the end of a step. Error: relative difference of rim speed and
    vehicle speed 0.6 s later."""
    wheel = AdvancedVehicle(implementation, QUARTER.plane, ICE, rim_turning=0.0)
    wheel.advance_with(np.where(np.arange(161) < 40, 2e4, 0.0)[:, None], 5e-3)
    return wheel.first_wheel_slip


def surface_line_error(implementation: str, work_folder: Path) -> float:
    """Case: a wheel exactly on the line between dry surface (left) and ice (right). Error: difference of the stopping
    distance (m) from the distance on dry surface alone."""
    distance_on_line = stopping_distance(
        implementation, 2e3, DRY, ICE, road=road_of_stretches([RoadStretch(0.0, 0, 1)])
    )
    return abs(distance_on_line - stopping_distance(implementation, 2e3, DRY))


def surface_change_error(implementation: str, work_folder: Path) -> float:
    """Case: a lightly braked wheel whose surface changes from dry to wet within a step of 20 ms. Error: relative
    difference of the stopping distance from the distance with unchanged tyre force."""
    level, steady_distance, turning = constant_slip_stop(DRY, 0.004)
    two_surfaces = road_of_stretches([RoadStretch(0.0, 0, 0), RoadStretch(5.03, 1, 1)])
    stop = stopping_distance(
        implementation, level, DRY, table_of_surface("wet"), time_step=2e-2, rim_turning=turning, road=two_surfaces
    )
    return abs(stop / steady_distance - 1.0)
