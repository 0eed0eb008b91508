"""Independent reference: the nonlinear bicycle with ideally rolling wheels, in hand-written equations.

Bodies move by products of matrices (``models.multibody.plain``); coordinates are those of ``bicycle_of_four_bodies``.
Each wheel
touches the ground in its lowest point, whose material point has no velocity: six conditions J(q) v = 0 on nine rates.
The rates of lean, steer and rear wheel are free, v = N(q) u, and the multipliers drop out of N' (M dv/dt - f) = 0. No
kernel and no engine takes part.
"""

import numpy as np
from scipy.integrate import cumulative_simpson, solve_ivp

from models.bicycle.four_bodies import (
    COUNT,
    FALLEN_LEAN,
    FRONT,
    HEIGHT,
    LEAN,
    PITCH,
    REAR,
    STEER,
    YAW,
    BicycleRide,
    X,
    Y,
    bicycle_of_four_bodies,
)
from models.bicycle.whipple import NO_CONTROL, SteeringControl, Whipple
from models.core.errors import RunFailed
from models.multibody.plain.motion import BIAS, FIRST_DERIVATIVE, PLACE, RATE, Bodies, PlainMotion

FREE_RATES, DEPENDENT_RATES = [LEAN, STEER, REAR], [X, Y, YAW, HEIGHT, PITCH, FRONT]
UPWARD = np.array([0.0, 0.0, 1.0])


class IdealBicycle:
    """The bicycle as four bodies with ideally rolling wheels; raises the same errors as ``Whipple``."""

    def __init__(self, bicycle: Whipple, control: SteeringControl = NO_CONTROL) -> None:
        vehicle = bicycle_of_four_bodies(bicycle)
        self.bicycle, self.control, self.bodies = bicycle, control, Bodies(vehicle)
        self.gravity = -bicycle.gravity * UPWARD
        self._masses = np.array([body.mass for body in vehicle.bodies])
        wheels = {"rear wheel": bicycle.rear_wheel.radius, "front wheel": bicycle.front_wheel.radius}
        self._wheels = [(self.bodies.row[name], radius) for name, radius in wheels.items()]

    def contacts(self, bicycle_motion: PlainMotion) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Kinematics of both wheel contacts: their heights (2,) in m, the Jacobian (6, 9) of the velocities of the
        material points there, and the part (6,) of these points' accelerations without dv/dt.
        """
        contact_rows = [_wheel_contact(bicycle_motion.matrices[row], radius) for row, radius in self._wheels]
        heights, jacobians, rates = zip(*contact_rows, strict=True)
        return np.array(heights), np.vstack(jacobians), np.concatenate(rates)

    def rolling(self, positions: np.ndarray, free_rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Matrix N (9, 3) of rolling, with v = N u and the free rates u of FREE_RATES, and all rates v (9,)."""
        contact = self.contacts(self.bodies.move(positions, np.zeros(COUNT)))[1]
        N = np.zeros((COUNT, 3))
        N[FREE_RATES] = np.eye(3)
        N[DEPENDENT_RATES] = -np.linalg.solve(contact[:, DEPENDENT_RATES], contact[:, FREE_RATES])
        return N, N @ free_rates

    def rates(self, time: float, rolling_state: np.ndarray) -> np.ndarray:
        """Time derivatives (12,) of the bicycle's state, which holds positions (9,) and free rates (3,)."""
        q, (N, v) = rolling_state[:COUNT], self.rolling(rolling_state[:COUNT], rolling_state[COUNT:])
        motion, bias = self.bodies.move(q, v), np.zeros(COUNT)
        _, contact, without = self.contacts(motion)
        bias[DEPENDENT_RATES] = -np.linalg.solve(contact[:, DEPENDENT_RATES], without)
        mass, force = self.bodies.inertia(motion, self.gravity)
        return np.concatenate([v, np.linalg.solve(N.T @ mass @ N, N.T @ (force + self.applied(v) - mass @ bias))])

    def applied(self, all_rates: np.ndarray) -> np.ndarray:
        """Generalised forces (9,) of control and steering friction; the control depends on the speed of the rear
        wheel.
        """
        force, control = np.zeros(COUNT), self.control
        speed = all_rates[REAR] * self.bicycle.rear_wheel.radius
        force[STEER] = -control.lean_rate_gain(speed) * all_rates[LEAN] - control.friction * all_rates[STEER]
        force[STEER] -= control.dry_friction * np.tanh(all_rates[STEER] / control.dry_rate)
        return force

    def upright(
        self, speed: float, lean_rate: float = 0.0, lean_angle: float = 0.0, steer_angle: float = 0.0
    ) -> np.ndarray:
        """Start state (12,) with the wheels on the ground, at a speed (m/s) of the rear wheel, with a lean rate
        (rad/s).

        lean, steer in rad; height and pitch follow from the contacts.
        """
        q, radius = np.zeros(COUNT), self.bicycle.rear_wheel.radius
        q[LEAN], q[STEER], q[PITCH], q[HEIGHT] = (
            lean_angle,
            steer_angle,
            -self.bicycle.tilt,
            radius * (np.cos(lean_angle) - 1.0),
        )
        for _ in range(20):
            heights, jacobian, _ = self.contacts(self.bodies.move(q, np.zeros(COUNT)))
            if np.abs(heights).max() < 1e-15:
                break
            q[[HEIGHT, PITCH]] -= np.linalg.solve(jacobian[[2, 5]][:, [HEIGHT, PITCH]], heights)
        return np.concatenate([q, [lean_rate, 0.0, speed / radius]])

    def energy(self, q: np.ndarray, v: np.ndarray) -> float:
        """Sum of kinetic and potential energy (J) of the bicycle; the potential energy is 0 when all centres of mass
        are on the ground.
        """
        motion = self.bodies.move(q, v)
        mass, _ = self.bodies.inertia(motion, self.gravity)
        levels = motion.matrices[1:, PLACE, 2, 3]
        return float(0.5 * v @ mass @ v + self.bicycle.gravity * self._masses @ levels)

    def run(
        self, start_state: np.ndarray, duration: float, row_count: int = 501, tolerance: float = 1e-9
    ) -> BicycleRide:
        """Integrate the motion from a state (12,) over a duration (s) by DOP853; RunFailed if the bicycle falls to the
        ground.
        """

        def lies(time: float, rolling_state: np.ndarray) -> float:
            return FALLEN_LEAN - abs(rolling_state[LEAN])

        lies.terminal = True  # type: ignore[attr-defined]
        times = np.linspace(0.0, duration, row_count)
        solution = solve_ivp(
            self.rates, (0.0, duration), start_state, "DOP853", times, events=lies, rtol=tolerance, atol=tolerance
        )
        if solution.status != 0:
            why = "the bicycle has fallen over" if solution.status == 1 else solution.message
            raise RunFailed("reference", why, float(solution.t[-1]) if solution.t.size else 0.0)
        q = solution.y[:COUNT].T
        v = np.array([self.rolling(row[:COUNT], row[COUNT:])[1] for row in solution.y.T])
        energy = np.array([self.energy(*row) for row in zip(q, v, strict=True)])
        work = cumulative_simpson([self.applied(row) @ row for row in v], x=times, initial=0.0)
        return BicycleRide(times, q, v, energy, work, solution.nfev)


def _wheel_contact(wheel_matrices: np.ndarray, radius: float) -> tuple[float, np.ndarray, np.ndarray]:
    """Height (m) of a wheel's material point at the ground, Jacobian (3, 9) of its velocity, and its acceleration (3,)
    without dv/dt.

    wheel_matrices (12, 3, 4) : its matrices. The point s that touches, in the wheel's axes, runs on by s' while it
    rolls, and the rate of its velocity R' s + c' is R'' s + c'' + R' s'.
    """
    axes, moving = wheel_matrices[PLACE, :, :3], wheel_matrices[RATE, :, :3]
    axle, turning = axes[:, 1], moving[:, 1]
    flat = np.sqrt(1.0 - axle[2] ** 2)
    downward = (axle * axle[2] - UPWARD) / flat
    lowering = (turning * axle[2] + axle * turning[2] + downward * axle[2] * turning[2] / flat) / flat
    point, running = radius * axes.T @ downward, radius * (moving.T @ downward + axes.T @ lowering)
    point_terms = wheel_matrices @ np.append(point, 1.0)
    return point_terms[PLACE, 2], point_terms[FIRST_DERIVATIVE:].T, point_terms[BIAS] + moving @ running
