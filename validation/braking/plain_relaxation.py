"""Lagging slip angles of tyres with a relaxation length by plain code, and a braked turn of a truck on such tyres."""

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from models.brake.brake import Brake, brakes_of_wheels
from models.brake.plain import relaxation as plain
from models.brake.plane_vehicle import PAPER_TRUCK, plane_of_truck
from models.brake.pressure import BrakeChambers
from models.systems.braking.march import braked_vehicle_on_tyres
from models.tyre.magic_formula import table_of_surface
from validation.braking.sprung_box import TORQUE_PER_BAR, steady_torques
from validation.braking.truck_equations import braked_turn

FIRST_SPEED, LAST_SPEED, STEER_ANGLE = 11.11, 9.0, 0.03
"""Speeds (m/s) at start and end of the truck's braked turn, and its steer angle (rad)."""


def lag_on(
    truck_state: np.ndarray,
    time_step: float,
    steer_angles: np.ndarray,
    wheel_positions: np.ndarray,
    cornering_slope: float,
    relaxation_lengths: np.ndarray,
    slip_lags: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Lagging slip angles after a time step (s), and those used within the step (W,) in rad, by plain code for a state
    (2, 3): x, y, heading, and their rates.

    wheel_positions (W, 2) : of the W wheels (m); steer_angles (W,) : rad; slip_lags (W,) : lagging angles before the
    step.
    """
    velocity, turning = truck_state[1, :2], truck_state[1, 2]
    centres = velocity + turning * (wheel_positions @ rotation(truck_state[0, 2] + 0.5 * np.pi).T)
    speeds = np.array(
        [rotation(truck_state[0, 2] + angle).T @ centre for angle, centre in zip(steer_angles, centres, strict=True)]
    ).T
    return plain.advance_slip_tangents(slip_lags, speeds, time_step, relaxation_lengths, cornering_slope)


def rotation(angle: float) -> np.ndarray:
    """Rotation matrix (2, 2) for an angle (rad)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def braked_turn_difference(relaxation_length: float, substep_count: int = 4) -> float:
    """Distance (m) between the final positions of a braked turn by twinrig's truck model and by independently written
    equations. The truck's tyres have a relaxation length (m)."""
    tyre, torques = table_of_surface("ice"), (300.0, 200.0)
    end = braked_turn(PAPER_TRUCK, tyre, STEER_ANGLE, torques, FIRST_SPEED, LAST_SPEED, relaxation_length)
    path = braked_vehicle_on_tyres(
        plane_of_truck(PAPER_TRUCK),
        [tyre],
        brakes_of_wheels(*4 * (Brake(push_out=0.0, release=0.0, rising=TORQUE_PER_BAR, falling=TORQUE_PER_BAR),)),
        BrakeChambers(np.zeros(4), np.zeros(4), 6.0),
        steer=np.array([STEER_ANGLE, STEER_ANGLE, 0.0, 0.0]),
        substeps=substep_count,
        relaxation=np.full(4, relaxation_length),
    ).run(steady_torques(*np.repeat(torques, 2)), FIRST_SPEED, end.time)
    position_at = CubicHermiteSpline(path.times, path.states[:, 0, :2], path.states[:, 1, :2])
    return float(np.hypot(*(position_at(end.time) - (end.x, end.y))))
