"""Independent equations of the braked truck, for comparison: Newton and Euler in vehicle axes, with wheel speeds as
states.

Nothing of the compiled step is used: velocities are those along and across the vehicle, slips follow from the wheels'
own speeds, loads from a linear system, and a solver of stiff equations marches all of it. Wheels must not lock.
"""

from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from models.brake.plane_vehicle import GRAVITY, Truck
from models.core.errors import RunFailed
from models.tyre.tyre_table import TyreTable

SOLVER_TOLERANCE = 1e-9


class TurnEnd(NamedTuple):
    """Position x, y (m), heading (rad) and time (s) of a vehicle at the end of a braked turn."""

    x: float
    y: float
    heading: float
    time: float


def braked_turn(
    vehicle: Truck,
    tyre_table: TyreTable,
    steer: float,
    brake_torques: tuple[float, float],
    speed: float,
    end_speed: float,
    relaxation_length: float = 0.0,
) -> TurnEnd:
    """Final position of a braked turn from steady rolling at ``speed`` down to ``end_speed`` (m/s). The front wheels
    are steered by an angle (rad); brake_torques: brake torques of the two axles (N m).

    relaxation_length : of the tyres (m); 0 for none. With one, speeds must stay above 1 m/s, as the tyres' damper at
    lower speeds is left out. The tyre's friction must not depend on the load. Raises RunFailed if the vehicle does not
    reach ``end_speed`` in 200 s.
    """
    equations = _TruckEquations(vehicle, tyre_table, steer, np.repeat(brake_torques, 2), relaxation_length)
    lags = np.zeros(4 if relaxation_length else 0)
    start = np.concatenate(([0.0, 0.0, 0.0, speed, 0.0, 0.0], speed / equations.radius, lags))

    def slow(time: float, state: np.ndarray) -> float:
        return float(np.hypot(state[3], state[4]) - end_speed)

    slow.terminal = True  # type: ignore[attr-defined]
    solution = solve_ivp(
        equations, (0.0, 200.0), start, method="LSODA", rtol=SOLVER_TOLERANCE, atol=SOLVER_TOLERANCE, events=slow
    )
    if not solution.success or not solution.t_events[0].size:
        raise RunFailed("written", "the vehicle does not slow down", float(solution.t[-1]))
    x, y, heading = solution.y_events[0][0][:3]
    return TurnEnd(float(x), float(y), float(heading), float(solution.t_events[0][0]))


class _TruckEquations:
    """Equations of motion of a braked truck. The state has x, y, heading, longitudinal and lateral velocity, yaw rate
    and the angular velocities of the four wheels; with a relaxation length also the tangents of the lagging slip
    angles."""

    def __init__(
        self,
        vehicle: Truck,
        tyre_table: TyreTable,
        steer: float,
        brake_torques: np.ndarray,
        relaxation_length: float = 0.0,
    ) -> None:
        self.vehicle, self.tyre, self.torques, self.relaxation_length = (
            vehicle,
            tyre_table,
            brake_torques,
            relaxation_length,
        )
        axles, sides = (vehicle.front, vehicle.front, vehicle.rear, vehicle.rear), np.array([1.0, -1.0, 1.0, -1.0])
        self.x = np.array([axle.x for axle in axles])
        self.y = sides * [axle.track / 2.0 for axle in axles]
        self.radius = np.array([axle.radius for axle in axles])
        self.inertia = np.array([axle.spin_inertia for axle in axles])
        self.c, self.s = np.cos([steer, steer, 0.0, 0.0]), np.sin([steer, steer, 0.0, 0.0])
        arms, m, h = np.array([-vehicle.rear.x] * 2 + [vehicle.front.x] * 2), vehicle.mass, vehicle.height
        self.rest = m * GRAVITY * arms / vehicle.wheelbase / 2.0
        self.by_x = m * h / vehicle.wheelbase / 2.0 * np.array([-1.0, -1.0, 1.0, 1.0])
        self.by_y = -sides * m * h * [axle.roll_share / axle.track for axle in axles]

    def __call__(self, time: float, state: np.ndarray) -> np.ndarray:
        psi, u, v, r, turning = state[2], state[3], state[4], state[5], state[6:10]
        vx, vy = u - r * self.y, v + r * self.x
        speed_along, speed_aside = self.c * vx + self.s * vy, self.c * vy - self.s * vx
        slope = state[10:] if self.relaxation_length else speed_aside / speed_along
        mu_x, mu_y = self._friction(1.0 - self.radius * turning / speed_along, np.arctan(np.abs(slope)))
        mu_y = -np.sign(slope) * mu_y
        force_ahead, left = -self.c * mu_x - self.s * mu_y, -self.s * mu_x + self.c * mu_y
        m = self.vehicle.mass
        system = np.array(
            [[m - force_ahead @ self.by_x, -force_ahead @ self.by_y], [-left @ self.by_x, m - left @ self.by_y]]
        )
        ax, ay = np.linalg.solve(system, [force_ahead @ self.rest, left @ self.rest])
        loads = self.rest + self.by_x * ax + self.by_y * ay
        yaw = (self.x * left - self.y * force_ahead) @ loads / self.vehicle.yaw_inertia
        wheels = (self.radius * mu_x * loads - self.torques) / self.inertia
        rates = [u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi), r, ax + v * r, ay - u * r, yaw]
        lags = (
            (speed_aside - np.abs(speed_along) * slope) / self.relaxation_length
            if self.relaxation_length
            else np.zeros(0)
        )
        return np.concatenate((rates, wheels, lags))

    def _friction(self, slips: np.ndarray, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Longitudinal friction coefficients mu_x with the sign of the slip, and lateral ones mu_y, (4,) each."""
        tyre = self.tyre
        i, p = _cells_and_shares(tyre.angles, angles)
        k, w = _cells_and_shares(tyre.slips, np.abs(slips))

        def interpolated(friction_values: np.ndarray) -> np.ndarray:
            low, high = (
                (1 - w) * friction_values[i, k] + w * friction_values[i, k + 1],
                (1 - w) * friction_values[i + 1, k] + w * friction_values[i + 1, k + 1],
            )
            return (1 - p) * low + p * high

        h = tyre.h[:, 0]
        return np.sign(slips) * interpolated(tyre.mu_x[:, 0, :]), interpolated(tyre.g) * ((1 - p) * h[i] + p * h[i + 1])


def _cells_and_shares(nodes: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For each value, the index of the cell between nodes in which it lies, and its relative position in the cell."""
    cell = np.clip(np.searchsorted(nodes, values, side="right") - 1, 0, nodes.size - 2)
    return cell, (values - nodes[cell]) / (nodes[cell + 1] - nodes[cell])
