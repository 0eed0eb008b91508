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
"""Lower bounds: of an axle's load divided by its static load, and of the share of its squared friction force that
remains for the side force.
"""
TURNING_SLIP_WIDTH = 0.02
"""Range of slip angle (rad) over which friction changes from its value in right turns to its value in left turns."""


class AxleTyres(NamedTuple):
    """Tyres of an axle. stiffness : cornering stiffness divided by load (1/rad); friction : largest side force divided
    by load, mu; bend_sharpness : exponent n of the bend; side : share by which friction is larger in left turns and
    smaller in right turns; lift_coefficient : upward air force divided by speed squared (N s^2/m^2), negative for
    downforce; rise : share e of the stiffness that remains beyond the bend.
    """

    stiffness: float
    friction: float
    bend_sharpness: float
    side: float
    lift_coefficient: float
    rise: float


class SingleTrackCar(NamedTuple):
    """Parameters of a car in the plane. mass (kg); front_arm, rear_arm : distances from the centre of mass to the axles
    (m); inertia : yaw inertia about the centre of mass (kg m^2); height : of the centre of mass (m); drag : air drag
    divided by speed squared (N s^2/m^2); front_braking_share, front_driving_share : shares of the front axle in
    braking and in driving forces.
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
def axle_force(axle_tyres: AxleTyres, axle_load: float, forward_force: float, slip_angle: float) -> float:
    """Side force (N, left positive) of an axle at a slip angle (rad), under a load (N) and a forward force (N)."""
    grip = axle_tyres.friction * axle_load * (1.0 - axle_tyres.side * np.tanh(slip_angle / TURNING_SLIP_WIDTH))
    across = grip * np.sqrt(max(1.0 - (forward_force / grip) ** 2, LEAST_SHARE))
    x = axle_tyres.stiffness * axle_load * slip_angle / across
    bent = (1.0 + abs(x) ** axle_tyres.bend_sharpness) ** (-1.0 / axle_tyres.bend_sharpness)
    return -across * x * ((1.0 - axle_tyres.rise) * bent + axle_tyres.rise)


@compiled
def forces(
    car: SingleTrackCar,
    front_tyres: AxleTyres,
    rear_tyres: AxleTyres,
    motion: tuple[float, float],
    driven_input: tuple[float, float, float],
) -> tuple:
    """Returns side force of all tyres (N), yaw moment (N m), then loads (N), side forces (N) and slip angles (rad) of
    the axles, front before rear.

    motion : lateral velocity (m/s) and yaw rate (rad/s); driven_input : steer angle (rad), speed (m/s), its rate
    (m/s^2).
    """
    steer, speed, rate = driven_input
    base = car.front_arm + car.rear_arm
    weight, transferred_load, pressure = car.mass * GRAVITY, car.mass * rate * car.height / base, speed * speed
    load_f, load_r = weight * car.rear_arm / base, weight * car.front_arm / base
    load_f = max(load_f - transferred_load - front_tyres.lift_coefficient * pressure, LEAST_LOAD * load_f)
    load_r = max(load_r + transferred_load - rear_tyres.lift_coefficient * pressure, LEAST_LOAD * load_r)
    forward = car.mass * rate + car.drag * pressure
    forward_front = (car.front_driving_share if forward > 0.0 else car.front_braking_share) * forward
    angle_f = (motion[0] + car.front_arm * motion[1]) / speed - steer
    angle_r = (motion[0] - car.rear_arm * motion[1]) / speed
    side_f = axle_force(front_tyres, load_f, forward_front, angle_f)
    side_r = axle_force(rear_tyres, load_r, forward - forward_front, angle_r)
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
    car: SingleTrackCar,
    front_tyres: AxleTyres,
    rear_tyres: AxleTyres,
    motion: tuple[float, float],
    driven_input: tuple[float, float, float],
) -> tuple:
    """Rates of the lateral velocity (m/s^2) and of the yaw rate (rad/s^2) of the single-track car."""
    resultants = forces(car, front_tyres, rear_tyres, motion, driven_input)
    return resultants[0] / car.mass - driven_input[1] * motion[1], resultants[1] / car.inertia


@compiled
def march(
    car: SingleTrackCar,
    front_tyres: AxleTyres,
    rear_tyres: AxleTyres,
    input_samples: np.ndarray,
    time_step: float,
    initial_motion: tuple[float, float],
) -> np.ndarray:
    """Integrate by Heun's method from sample to sample. Returns lateral velocity (m/s) and yaw rate (rad/s) at every
    sample, shape (n, 2).

    input_samples (n, 3) : steer angle (rad), speed (m/s) and its rate (m/s^2) at samples ``time_step`` (s) apart;
    initial_motion : lateral velocity and yaw rate at the first sample.
    """
    motion = np.empty((len(input_samples), 2))
    w, r = initial_motion
    motion[0] = w, r
    for i in range(len(input_samples) - 1):
        inputs_now = input_samples[i, 0], input_samples[i, 1], input_samples[i, 2]
        inputs_next = input_samples[i + 1, 0], input_samples[i + 1, 1], input_samples[i + 1, 2]
        w1, r1 = motion_rates(car, front_tyres, rear_tyres, (w, r), inputs_now)
        w2, r2 = motion_rates(car, front_tyres, rear_tyres, (w + time_step * w1, r + time_step * r1), inputs_next)
        w += 0.5 * time_step * (w1 + w2)
        r += 0.5 * time_step * (r1 + r2)
        motion[i + 1] = w, r
    return motion


@compiled
def motion_reports(
    car: SingleTrackCar, front_tyres: AxleTyres, rear_tyres: AxleTyres, input_samples: np.ndarray, motion: np.ndarray
) -> np.ndarray:
    """Lateral acceleration (m/s^2), loads (N), side forces (N) and slip angles (rad) of a motion, shape (n, 7); of each
    pair the front axle stands first.
    """
    table = np.empty((len(input_samples), 7))
    for i in range(len(input_samples)):
        resultants = forces(
            car,
            front_tyres,
            rear_tyres,
            (motion[i, 0], motion[i, 1]),
            (input_samples[i, 0], input_samples[i, 1], input_samples[i, 2]),
        )
        table[i, 0] = resultants[0] / car.mass
        table[i, 1:] = resultants[2:]
    return table
