"""The single-track vehicle with saturating tyres, in the plane, at a prescribed speed.

Each axle has a load N = its static share + transfer by the forward acceleration - lift v^2, a largest side force
D = mu N sqrt(1 - (X / (mu N))^2) beside its forward force X, and the side force

    Y = -D x ((1 - e) / (1 + |x|^n)^(1/n) + e),    x = c N alpha / D,

of its slip angle alpha: c N alpha at small slip, D at large slip where e is 0, with a bend as sharp as n. The forward
force of all tyres is what the measured speed asks for, m a_x + drag v^2, shared by the axles as the scene says. With v
the speed, w the lateral velocity and r the yaw rate at the centre of mass, alpha = (w + a r) / v - delta in front and
(w - b r) / v behind, m (w' + v r) = Y_f + X_f delta + Y_r, J r' = a (Y_f + X_f delta) - b Y_r.
Source: ISO 8855 for axes; Mitschke and Wallentowitz, Dynamik der Kraftfahrzeuge, for the model.
"""

from typing import NamedTuple

import numpy as np

from models.machine.compiled import compiled

GRAVITY = 9.81
LEAST_LOAD, LEAST_SHARE = 0.05, 0.1
"""Shares: of its static load that an axle keeps, and of its squared friction that is left to the side."""
TURNING_SLIP_WIDTH = 0.02
"""rad of slip angle over which friction goes from that of right turns to that of left ones."""


class Axle(NamedTuple):
    """Tyres of an axle. stiffness : cornering stiffness by load (1/rad); friction; bend_sharpness : n; side : friction
    in left turns is larger by this share, in right turns smaller; downforce_coefficient : N s^2/m^2; rise : e, share of
    the stiffness beyond the bend.
    """

    stiffness: float
    friction: float
    bend_sharpness: float
    side: float
    downforce_coefficient: float
    rise: float


class Car(NamedTuple):
    """Parameters of a car in SI units. mass; front_arm, rear_arm : from the centre of mass to the axles; inertia :
    about the upright; height : of the centre of mass; drag : N s^2/m^2; front_braking_share, front_driving_share :
    shares of the front axle in forward forces below and above 0.
    """

    mass: float
    front_arm: float
    rear_arm: float
    inertia: float
    height: float
    drag: float
    front_braking_share: float
    front_driving_share: float


@compiled
def axle_force(axle: Axle, load: float, forward: float, slip_angle: float) -> float:
    """Side force (N, left positive) of an axle under a load (N) and a forward force (N), at a slip angle (rad)."""
    grip = axle.friction * load * (1.0 - axle.side * np.tanh(slip_angle / TURNING_SLIP_WIDTH))
    across = grip * np.sqrt(max(1.0 - (forward / grip) ** 2, LEAST_SHARE))
    x = axle.stiffness * load * slip_angle / across
    bent = (1.0 + abs(x) ** axle.bend_sharpness) ** (-1.0 / axle.bend_sharpness)
    return -across * x * ((1.0 - axle.rise) * bent + axle.rise)


@compiled
def forces(car: Car, front: Axle, rear: Axle, motion: tuple[float, float], drive: tuple[float, float, float]) -> tuple:
    """Side force of all tyres (N), yaw moment (N m), and load, side force and slip angle of the front and rear axle.

    motion : lateral velocity (m/s) and yaw rate (rad/s); drive : steer angle (rad), speed (m/s), its rate (m/s^2).
    """
    steer, speed, rate = drive
    base = car.front_arm + car.rear_arm
    weight, transferred_load, pressure = car.mass * GRAVITY, car.mass * rate * car.height / base, speed * speed
    load_f, load_r = weight * car.rear_arm / base, weight * car.front_arm / base
    load_f = max(load_f - transferred_load - front.downforce_coefficient * pressure, LEAST_LOAD * load_f)
    load_r = max(load_r + transferred_load - rear.downforce_coefficient * pressure, LEAST_LOAD * load_r)
    forward = car.mass * rate + car.drag * pressure
    forward_front = (car.front_driving_share if forward > 0.0 else car.front_braking_share) * forward
    angle_f = (motion[0] + car.front_arm * motion[1]) / speed - steer
    angle_r = (motion[0] - car.rear_arm * motion[1]) / speed
    side_f = axle_force(front, load_f, forward_front, angle_f)
    side_r = axle_force(rear, load_r, forward - forward_front, angle_r)
    lateral_front = side_f + forward_front * steer
    return (
        lateral_front + side_r,
        car.front_arm * lateral_front - car.rear_arm * side_r,
        load_f,
        load_r,
        side_f,
        side_r,
        angle_f,
        angle_r,
    )


@compiled
def motion_rates(
    car: Car, front: Axle, rear: Axle, motion: tuple[float, float], drive: tuple[float, float, float]
) -> tuple:
    """Rates of lateral velocity (m/s^2) and of yaw rate (rad/s^2)."""
    answer = forces(car, front, rear, motion, drive)
    return answer[0] / car.mass - drive[1] * motion[1], answer[1] / car.inertia


@compiled
def march(car: Car, front: Axle, rear: Axle, inputs: np.ndarray, step: float, first: tuple[float, float]) -> np.ndarray:
    """Motion (n, 2) at every sample, by Heun's method from sample to sample: lateral velocity (m/s) and yaw rate
    (rad/s).

    given (n, 3) : steer angle, speed, its rate at samples ``step`` (s) apart; first : motion at the first of them.
    """
    motion = np.empty((len(inputs), 2))
    w, r = first
    motion[0] = w, r
    for i in range(len(inputs) - 1):
        inputs_now = inputs[i, 0], inputs[i, 1], inputs[i, 2]
        inputs_next = inputs[i + 1, 0], inputs[i + 1, 1], inputs[i + 1, 2]
        w1, r1 = motion_rates(car, front, rear, (w, r), inputs_now)
        w2, r2 = motion_rates(car, front, rear, (w + step * w1, r + step * r1), inputs_next)
        w += 0.5 * step * (w1 + w2)
        r += 0.5 * step * (r1 + r2)
        motion[i + 1] = w, r
    return motion


@compiled
def motion_reports(car: Car, front: Axle, rear: Axle, inputs: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """Channels (n, 7) of a motion: lateral acceleration (m/s^2), then loads (N), side forces (N) and slip angles (rad),
    front first.
    """
    table = np.empty((len(inputs), 7))
    for i in range(len(inputs)):
        answer = forces(car, front, rear, (motion[i, 0], motion[i, 1]), (inputs[i, 0], inputs[i, 1], inputs[i, 2]))
        table[i, 0] = answer[0] / car.mass
        table[i, 1:] = answer[2:]
    return table
