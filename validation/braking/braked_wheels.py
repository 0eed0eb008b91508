"""One wheel that bears all of a vehicle, moved on by the compiled step or by an engine: errors of hard cases."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from models.brake.advance import AT_REST, FATAL_ENDS, advance, ending_sentence
from models.brake.plane_vehicle import GRAVITY, Plane
from models.brake.quarter import Quarter
from models.brake.surfaces import UNIFORM_ROAD, Road, Stretch, road
from models.core.errors import RunFailed
from models.engines.braking import EngineChassis
from models.tyre.magic_formula import table_of_surface
from models.tyre.tyre_table import TyreTable, stacked_tables
from validation.braking.braked_truck import RollingTruck, on_road
from validation.braking.quarter_stops import exact_distance

Error = Callable[[str, Path], float]
STEP, SPEED = 5.5e-3, 10.0
QUARTER = Quarter(mass=1700.0, radius=0.5, spin_inertia=13.35)
LOAD = QUARTER.mass * GRAVITY
DRY, ICE = table_of_surface("dry"), table_of_surface("ice")


def bent_friction(*points: tuple[float, float]) -> TyreTable:
    """Tyre table with friction at given points (slip, mu), equal at every load and slip angle, and no lateral
    friction."""
    slips, mu = np.array(points).T
    friction_along = np.tile(mu, (2, 1, 1))
    return TyreTable(
        np.array([0.0, 1.5]), slips, np.array([LOAD]), friction_along, np.ones((2, slips.size)), np.zeros((2, 1))
    )


class MovedVehicle(RollingTruck):
    """A vehicle on tyres that starts with rolling wheels and is advanced by one of the implementations."""

    def __init__(
        self,
        implementation: str,
        plane: Plane,
        *tyres: TyreTable,
        speed: float = SPEED,
        rim_turning: float | None = None,
        road: Road = UNIFORM_ROAD,
        steer: float = 0.0,
    ) -> None:
        go = advance if implementation == "reference" else EngineChassis(implementation, plane).advance
        super().__init__(on_road(plane, stacked_tables(tyres), road), speed, steer=steer, step_function=go)
        self.implementation = implementation
        if rim_turning is not None:
            self.turning[:] = rim_turning

    def under(self, torques: np.ndarray, step: float = STEP) -> bool:
        """Advance with torques (n + 1, W) at the ends of steps (s); returns whether the vehicle came to rest. Raises
        RunFailed."""
        self.motion.accelerations[:] = 0.0
        status, used = self.on(torques, step)
        if status in FATAL_ENDS:
            raise RunFailed(self.implementation, ending_sentence(status, self.plane, self.motion), used)
        return status == AT_REST and bool(np.isfinite(self.state).all() and np.isfinite(self.turning).all())

    @property
    def first_wheel_slip(self) -> float:
        """Slip magnitude of the first wheel: |ratio of rim speed to vehicle speed - 1|."""
        return float(abs(self.plane.radius[0] * self.turning[0] / self.state[1, 0] - 1.0))


def stopping_distance(
    implementation: str,
    brake_torque: float,
    *tyres: TyreTable,
    step: float = STEP,
    rim_turning: float | None = None,
    road: Road = UNIFORM_ROAD,
) -> float:
    """Stopping distance (m) under a constant torque (N m); infinite unless all speeds end at exactly 0."""
    wheel = MovedVehicle(implementation, QUARTER.plane, *tyres, rim_turning=rim_turning, road=road)
    least_force = min(brake_torque / QUARTER.radius, LOAD * min(float(tyre.mu_x[0, 0, -1]) for tyre in tyres))
    rests = wheel.under(np.full((int(2.0 * SPEED * QUARTER.mass / least_force / step) + 50, 1), brake_torque), step)
    return float(wheel.state[0, 0]) if rests and not wheel.state[1].any() and wheel.turning[0] == 0.0 else np.inf


def settled_stop(tyre: TyreTable, slip: float) -> tuple[float, float, float]:
    """Torque (N m) that holds the slip constant, the stopping distance (m) at this slip, and the wheel's initial
    angular velocity (rad/s)."""
    force = LOAD * float(np.interp(slip, tyre.slips, tyre.mu_x[0, 0]))
    return (
        QUARTER.steady_torque(slip, force),
        QUARTER.mass * SPEED**2 / (2.0 * force),
        (1.0 - slip) * SPEED / QUARTER.radius,
    )


def steady_slip_case(tyre: TyreTable, slip: float, step: float = STEP) -> Error:
    """Case: a stop at constant slip. Error: relative difference of the distance from m v^2 / (2 F)."""
    level, distance, turning = settled_stop(tyre, slip)
    return lambda name, folder: abs(
        stopping_distance(name, level, tyre, step=step, rim_turning=turning) / distance - 1.0
    )


def from_rolling(tyre: TyreTable, slip: float, step: float) -> Error:
    """Case: a stop that starts with a rolling wheel. Error: relative difference of the distance from the exact one."""
    level, _, _ = settled_stop(tyre, slip)
    return lambda name, folder: abs(
        stopping_distance(name, level, tyre, step=step) / exact_distance(QUARTER, tyre, level, SPEED) - 1.0
    )


PEAKED_FRICTION = bent_friction((0.0, 0.0), (0.1, 0.8), (1.0, 0.6))


def beyond_the_peak(implementation: str, folder: Path) -> float:
    """Case: a torque 0.1 % above that of the friction peak, so that the wheel locks. Error: relative difference of the
    distance from the exact one."""
    peak = 1.001 * LOAD * 0.8 * (QUARTER.radius + QUARTER.spin_inertia / (QUARTER.mass * QUARTER.radius))
    return abs(
        stopping_distance(implementation, peak, PEAKED_FRICTION) / exact_distance(QUARTER, PEAKED_FRICTION, peak, SPEED)
        - 1.0
    )


def at_the_peak(implementation: str, folder: Path) -> float:
    """Case: exactly the torque of the friction peak. Error: relative amount by which the distance lies outside the
    range from constant peak friction to constant sliding friction."""
    force = LOAD * 0.8
    distance = stopping_distance(
        implementation, QUARTER.steady_torque(0.1, force), PEAKED_FRICTION, rim_turning=0.9 * SPEED / QUARTER.radius
    )
    shortest_distance = QUARTER.mass * SPEED**2 / (2.0 * force)
    return max(1.0 - distance / shortest_distance, distance / (shortest_distance * 0.8 / 0.6) - 1.0, 0.0)


def locked_wheel_error(implementation: str, folder: Path) -> float:
    """Case: the wheel is locked from the start. Error: relative difference of the distance from v^2 / (2 mu g)."""
    distance = stopping_distance(implementation, 2e4, DRY, rim_turning=0.0)
    return abs(distance * 2.0 * GRAVITY * float(DRY.mu_x[0, 0, -1]) / SPEED**2 - 1.0)


def changing_friction_error(implementation: str, folder: Path) -> float:
    """Case: a locked wheel whose friction changes from 0.2 to 0.8 after 10 m. Error: relative difference of the
    distance from its closed form."""
    slick, rough = (bent_friction((0.0, 0.0), (1.0, mu)) for mu in (0.2, 0.8))
    distance = stopping_distance(
        implementation, 1e5, slick, rough, rim_turning=0.0, road=road([Stretch(0.0, 0, 0), Stretch(10.0, 1, 1)])
    )
    return abs(distance / (10.0 + (SPEED**2 - 2.0 * 0.2 * GRAVITY * 10.0) / (2.0 * 0.8 * GRAVITY)) - 1.0)


def friction_range_error(implementation: str, folder: Path) -> float:
    """Case: a locked wheel for 0.2 s, with friction from 1e-6 to 1.5. Error: difference of the lost speed from mu g
    t."""
    errors = []
    for mu in (1e-6, 1e-3, 0.1, 1.5):
        wheel = MovedVehicle(implementation, QUARTER.plane, bent_friction((0.0, 0.0), (1.0, mu)), rim_turning=0.0)
        wheel.under(np.full((41, 1), 1e6), 5e-3)
        errors.append(abs((SPEED - wheel.state[1, 0]) / (mu * GRAVITY * 0.2) - 1.0))
    return float(max(errors))


def at_rest(implementation: str, folder: Path) -> float:
    """Case: a vehicle that stands with its brakes on. Error: distance and speed (m, m/s), which should be 0."""
    wheel = MovedVehicle(implementation, QUARTER.plane, DRY, speed=0.0)
    wheel.under(np.full((51, 1), 5e3))
    return float(np.abs(wheel.state).max() + abs(wheel.turning[0]))


def backwards_spin_error(implementation: str, folder: Path) -> float:
    """Case: an unbraked wheel starts spinning backwards. Error: relative difference of rim speed and vehicle speed
    after 0.5 s."""
    wheel = MovedVehicle(implementation, QUARTER.plane, DRY, rim_turning=-10.0)
    wheel.under(np.zeros((101, 1)), 5e-3)
    return wheel.first_wheel_slip


def released_brake_error(implementation: str, folder: Path) -> float:
    """Case: the brake of a locked wheel is released at the end of a step. Error: relative difference of rim speed and
    vehicle speed 0.6 s later."""
    wheel = MovedVehicle(implementation, QUARTER.plane, ICE, rim_turning=0.0)
    wheel.under(np.where(np.arange(161) < 40, 2e4, 0.0)[:, None], 5e-3)
    return wheel.first_wheel_slip


def on_the_line(implementation: str, folder: Path) -> float:
    """Case: a wheel exactly on the line between dry surface (left) and ice (right). Error: difference of the distance
    (m) from that on dry surface alone."""
    distance_on_line = stopping_distance(implementation, 2e3, DRY, ICE, road=road([Stretch(0.0, 0, 1)]))
    return abs(distance_on_line - stopping_distance(implementation, 2e3, DRY))


def slope_changes(implementation: str, folder: Path) -> float:
    """Case: a lightly braked wheel whose surface changes from dry to wet within a step of 20 ms. Error: relative
    difference of the distance from that with the unchanged force."""
    level, steady_distance, turning = settled_stop(DRY, 0.004)
    two_surfaces = road([Stretch(0.0, 0, 0), Stretch(5.03, 1, 1)])
    stop = stopping_distance(
        implementation, level, DRY, table_of_surface("wet"), step=2e-2, rim_turning=turning, road=two_surfaces
    )
    return abs(stop / steady_distance - 1.0)
