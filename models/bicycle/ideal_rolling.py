"""Independent reference: the nonlinear bicycle with wheels that roll ideally, in plain equations.

Axes of ISO 8855: x forward, y to the left, z up. Positions q are x, y (m) of the rear wheel's centre, yaw, its height
z (m), lean, pitch (rad), steer to the left, angles of the rear and the front wheel (rad). The rear frame turns by yaw,
lean, pitch in this order; lean to the right is positive, as a right-handed turn about x.

Each wheel touches the ground in its lowest point, whose material point has no velocity: six conditions J(q) v = 0 on
nine rates. The rates of lean, steer and rear wheel are free, v = N(q) u, and the multipliers drop out of
N' (M dv/dt + h - f) = 0. The only derivative along the motion, that of the Jacobians, is a complex step, exact to
rounding. No kernel and no engine takes part.
"""

from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from models.bicycle.whipple import FREE, Control, Whipple
from models.core.errors import RunFailed

X, Y, YAW, Z, LEAN, PITCH, STEER, REAR, FRONT = range(9)
FREE_RATES = [LEAN, STEER, REAR]
FALLEN = 1.4
"""rad of lean at which a run ends: the bicycle lies on the ground."""
TINY = 1e-30
"""Complex step."""
AXES = np.eye(3)
DOWN_TO_UP = np.diag([1.0, -1.0, -1.0])
"""The paper's axes seen in ours."""


class Motion(NamedTuple):
    """times (n,) s, positions and rates (n, 9), energy (n,) J, heights (n, 2) m of the contacts above the ground.

    steps : calls of the rates, as the method picks its own steps.
    """

    times: np.ndarray
    positions: np.ndarray
    rates: np.ndarray
    energy: np.ndarray
    heights: np.ndarray
    steps: int


def turn(axis: np.ndarray, angle: complex) -> np.ndarray:
    """Rotation (3, 3) about a unit axis, for complex angles, too."""
    x, y, z = axis
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return AXES + np.sin(angle) * across + (1.0 - np.cos(angle)) * (across @ across)


class IdealBicycle:
    """The bicycle as four bodies; raises nothing beyond what ``Whipple`` does."""

    def __init__(self, bicycle: Whipple, control: Control = FREE) -> None:
        R, B, H, F = bicycle.rear_wheel, bicycle.body, bicycle.front_frame, bicycle.front_wheel
        self.bicycle, self.control, self.radii = bicycle, control, (R.radius, F.radius)
        self.steering = np.array([-np.sin(bicycle.tilt), 0.0, np.cos(bicycle.tilt)])
        origin, pivot = np.array([0.0, 0.0, R.radius]), np.array([bicycle.wheelbase + bicycle.trail, 0.0, 0.0])
        self.to_pivot = pivot - origin
        self.to_body = np.array([B.x, 0.0, -B.z]) - origin
        self.to_front = np.array([H.x, 0.0, -H.z]) - pivot
        self.to_wheel = np.array([bicycle.wheelbase, 0.0, F.radius]) - pivot
        self.masses = [R.mass, B.mass, H.mass, F.mass]
        wheels = [np.diag([wheel.Ixx, wheel.Iyy, wheel.Ixx]) for wheel in (R, F)]
        frames = [DOWN_TO_UP @ frame.inertia @ DOWN_TO_UP for frame in (B, H)]
        self.inertias = [wheels[0], *frames, wheels[1]]

    def jacobians(self, q: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray], list[np.ndarray], np.ndarray]:
        """Of positions (9,), complex allowed: rotations of the four bodies (wheels without spin), Jacobians (3, 9) of
        their centres and of their turning, and that of the velocities of both contacts, (6, 9)."""
        heading = turn(AXES[2], q[YAW])
        leaning = heading @ turn(AXES[0], q[LEAN])
        rear = leaning @ turn(AXES[1], q[PITCH])
        front = rear @ turn(self.steering, q[STEER])
        centre = np.array([q[X], q[Y], q[Z]])
        pivot = centre + rear @ self.to_pivot
        hub = pivot + front @ self.to_wheel
        hinges = [(YAW, AXES[2], centre), (LEAN, heading[:, 0], centre), (PITCH, leaning[:, 1], centre)]
        steered = [*hinges, (STEER, rear @ self.steering, pivot)]
        chains = [
            (rear, [*hinges, (REAR, rear[:, 1], centre)], centre, 0),
            (rear, hinges, centre + rear @ self.to_body, None),
            (front, steered, pivot + front @ self.to_front, None),
            (front, [*steered, (FRONT, front[:, 1], hub)], hub, 1),
        ]
        moving = [_jacobian(chain, point) for _, chain, point, _ in chains]
        touching = [
            _jacobian(chain, point + self.radii[wheel] * _down(body[:, 1]))[0]
            for body, chain, point, wheel in chains
            if wheel is not None
        ]
        return [chain[0] for chain in chains], [m[0] for m in moving], [m[1] for m in moving], np.vstack(touching)

    def free_motion(self, contact: np.ndarray) -> np.ndarray:
        """N (9, 3) with v = N u for the rates u of FREE_RATES."""
        held = [i for i in range(9) if i not in FREE_RATES]
        N = np.zeros((9, 3))
        N[FREE_RATES] = np.eye(3)
        N[held] = -np.linalg.solve(contact[:, held], contact[:, FREE_RATES])
        return N

    def rates(self, time: float, state: np.ndarray) -> np.ndarray:
        """Rates (12,) of positions and free rates."""
        q, u = state[:9], state[9:]
        turned, centres, turnings, contact = self.jacobians(q)
        N = self.free_motion(contact)
        v = N @ u
        _, centres_on, turnings_on, contact_on = self.jacobians(q + 1j * TINY * v)
        bias, held = np.zeros(9), [i for i in range(9) if i not in FREE_RATES]
        bias[held] = -np.linalg.solve(contact[:, held], contact_on.imag @ v / TINY)
        mass, force = np.zeros((9, 9)), self.applied(v)
        for m, inertia, R, Jp, Jw, Jp_on, Jw_on in zip(
            self.masses, self.inertias, turned, centres, turnings, centres_on, turnings_on, strict=True
        ):
            tensor, spin = R @ inertia @ R.T, Jw @ v
            mass += m * Jp.T @ Jp + Jw.T @ tensor @ Jw
            force -= m * Jp.T @ (Jp_on.imag @ v / TINY + self.bicycle.gravity * AXES[2])
            force -= Jw.T @ (tensor @ (Jw_on.imag @ v / TINY) + _cross(spin, tensor @ spin))
        return np.concatenate([v, np.linalg.solve(N.T @ mass @ N, N.T @ (force - mass @ bias))])

    def applied(self, v: np.ndarray) -> np.ndarray:
        """Forces (9,) of control and friction of the steering, at the speed of the rear wheel."""
        force, control = np.zeros(9), self.control
        speed = v[REAR] * self.radii[0]
        force[STEER] = -control.lean_rate_gain(speed) * v[LEAN] - control.friction * v[STEER]
        force[STEER] -= control.dry_friction * np.tanh(v[STEER] / control.dry_rate)
        return force

    def upright(self, speed: float, lean_rate: float = 0.0, lean: float = 0.0, steer: float = 0.0) -> np.ndarray:
        """State (12,): wheels on the ground, at a speed (m/s) of the rear wheel, with a lean rate (rad/s).

        lean, steer in rad; height and pitch follow from the contacts.
        """
        q = np.zeros(9)
        q[LEAN], q[STEER], q[Z] = lean, steer, self.radii[0] * np.cos(lean)
        for _ in range(20):
            heights = self.heights(q)
            if np.abs(heights).max() < 1e-15:
                break
            contact = self.jacobians(q)[3]
            q[[Z, PITCH]] -= np.linalg.solve(contact[[2, 5]][:, [Z, PITCH]], heights)
        return np.concatenate([q, [lean_rate, 0.0, speed / self.radii[0]]])

    def heights(self, q: np.ndarray) -> np.ndarray:
        """(2,) m of the wheels' lowest points above the ground."""
        rear = turn(AXES[2], q[YAW]) @ turn(AXES[0], q[LEAN]) @ turn(AXES[1], q[PITCH])
        front = rear @ turn(self.steering, q[STEER])
        hub = q[Z] + (rear @ self.to_pivot + front @ self.to_wheel)[2]
        lowest = [radius * _down(body[:, 1])[2] for radius, body in zip(self.radii, (rear, front), strict=True)]
        return np.real(np.array([q[Z], hub]) + lowest)

    def energy(self, q: np.ndarray, v: np.ndarray) -> float:
        """Kinetic and potential energy (J); the latter 0 with all centres on the ground."""
        turned, centres, turnings, _ = self.jacobians(q)
        total = 0.0
        for m, inertia, R, Jp, Jw, height in zip(
            self.masses, self.inertias, turned, centres, turnings, self._levels(q), strict=True
        ):
            speed, spin = Jp @ v, R.T @ Jw @ v
            total += 0.5 * m * speed @ speed + 0.5 * spin @ inertia @ spin + m * self.bicycle.gravity * height
        return float(total)

    def _levels(self, q: np.ndarray) -> list[float]:
        """Heights (m) of the four centres."""
        rear = turn(AXES[2], q[YAW]) @ turn(AXES[0], q[LEAN]) @ turn(AXES[1], q[PITCH])
        front = rear @ turn(self.steering, q[STEER])
        pivot = q[Z] + (rear @ self.to_pivot)[2]
        front_level, hub = pivot + (front @ self.to_front)[2], pivot + (front @ self.to_wheel)[2]
        return [q[Z], q[Z] + (rear @ self.to_body)[2], front_level, hub]

    def run(self, state: np.ndarray, duration: float, rows: int = 501, tolerance: float = 1e-9) -> Motion:
        """From a state (12,) for a duration (s), by DOP853; RunFailed where the bicycle lies on the ground."""

        def lies(time: float, state: np.ndarray) -> float:
            return FALLEN - abs(state[LEAN])

        lies.terminal = True  # type: ignore[attr-defined]
        times = np.linspace(0.0, duration, rows)
        solution = solve_ivp(
            self.rates, (0.0, duration), state, "DOP853", times, events=lies, rtol=tolerance, atol=tolerance
        )
        if solution.status != 0:
            why = "the bicycle has fallen over" if solution.status == 1 else solution.message
            raise RunFailed("reference", why, float(solution.t[-1]) if solution.t.size else 0.0)
        q = solution.y[:9].T
        v = np.array([self.free_motion(self.jacobians(row)[3]) @ u for row, u in zip(q, solution.y[9:].T, strict=True)])
        energy = np.array([self.energy(*row) for row in zip(q, v, strict=True)])
        return Motion(times, q, v, energy, np.array([self.heights(row) for row in q]), solution.nfev)


def _jacobian(chain: list[tuple[int, np.ndarray, np.ndarray]], point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(3, 9) of a point's velocity and of the turning, for hinges (coordinate, axis, place) behind one another."""
    moving, turning = np.zeros((2, 3, 9), point.dtype)
    moving[:, [X, Y, Z]] = np.eye(3)
    for coordinate, axis, place in chain:
        turning[:, coordinate], moving[:, coordinate] = axis, _cross(axis, point - place)
    return moving, turning


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a x b of vectors (3,); numpy's takes ten times as long."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _down(axle: np.ndarray) -> np.ndarray:
    """Unit vector (3,) from a wheel's centre to its lowest point."""
    down = axle * axle[2] - AXES[2]
    return down / np.sqrt(down @ down)
