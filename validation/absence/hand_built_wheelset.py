"""A free wheelset with conical wheels, written by hand for this case alone: Kalker's linear creep forces and Hertz'
normal load, nothing else.

No suspension, flange, contact damping, profiles or FASTSIM, and no way to have them. The equations of motion are stated
in the head of ``models.rail.equations``; the columns of a contact's report are those of REPORT in
``models.rail.wheel_forces``. The contact point of a cone, Hertz' theory and Kalker's coefficients are twinrig's.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from models.contact.linear_theory import coefficient_at
from models.machine.compiled import lean, njit
from models.machine.records import size_of
from models.rail.contact_point import LEFT, RIGHT, ConicalWheel, cone_on_rail
from models.rail.profile_contact import WheelPose, normal_force_and_axes
from models.rail.wheel_forces import REPORT_RECORD, rails_of

STATE_COUNT = 10
REPORT_LENGTH = size_of(REPORT_RECORD)


@lean
def rates(wheelset_state, speed, parameters, fills_report, state_rate, contact_report):
    """Compute the time derivatives (10,) of a wheelset's state: y, z, roll, yaw, spin angle, and their rates. If
    ``fills_report``, the two contacts are written to contact_report (2, 18). parameters: mass, inertia about the axle,
    inertia across the axle, weight on each side, radius, half gauge, conicity, rail head radius, contact modulus, shear
    modulus, Poisson's ratio.
    """
    mass, spin_inertia, cross_inertia, carried, radius, gauge, conicity, head, modulus, shear, poisson = parameters
    cone = ConicalWheel(radius, gauge, conicity, head)
    y, z, roll, yaw, _, y_rate, z_rate, roll_rate, yaw_rate, spin = wheelset_state
    cr, sr, cy, sy = np.cos(roll), np.sin(roll), np.cos(yaw), np.sin(yaw)
    turn_rate = spin - yaw_rate * sr
    wx, wy, wz = cy * roll_rate - sy * cr * turn_rate, sy * roll_rate + cy * cr * turn_rate, yaw_rate + sr * turn_rate
    fy = fz = mx = my = mz = 0.0
    for side in (RIGHT, LEFT):
        depth, rolling, n_y, n_z, px, py, pz = cone_on_rail(side, WheelPose(y, z, roll, yaw), cone)
        load, a, b = normal_force_and_axes(
            depth, 0.5 / (rolling * np.sqrt(1.0 + conicity * conicity)), 0.5 / head, modulus
        )
        vx, vy, vz = speed + wy * pz - wz * py, y_rate + wz * px - wx * pz, z_rate + wx * py - wy * px
        slip, turning = n_z * vy - n_y * vz, wy * n_y + wz * n_z
        xi_x, xi_y, xi_spin, force_ahead, force_aside, moment = vx / speed, slip / speed, turning / speed, 0.0, 0.0, 0.0
        if a > 0.0:
            area, ratio = a * b, a / b
            turn = area**1.5 * coefficient_at(2, ratio, poisson)
            force_ahead = -shear * area * coefficient_at(0, ratio, poisson) * xi_x
            force_aside = -shear * (area * coefficient_at(1, ratio, poisson) * xi_y + turn * xi_spin)
            moment = shear * (turn * xi_y - area**2 * coefficient_at(3, ratio, poisson) * xi_spin)
        left, force_down = n_z * force_aside - n_y * load, -n_y * force_aside - n_z * load
        fy, fz = fy + left, fz + force_down
        mx, my, mz = (
            mx + (py * force_down - pz * left),
            my + (pz * force_ahead - px * force_down + n_y * moment),
            mz + (px * left - py * force_ahead + n_z * moment),
        )
        if fills_report:
            power = force_ahead * vx + force_aside * slip + moment * turning
            line = (
                load,
                force_ahead,
                force_aside,
                moment,
                xi_x,
                xi_y,
                xi_spin,
                a,
                b,
                depth,
                power,
                np.arctan2(-n_y, n_z),
                px,
                py,
                pz,
                0.0,
                -load * (n_y * vy + n_z * vz),
                0.0,
            )
            for k in range(REPORT_LENGTH):
                contact_report[0 if side == RIGHT else 1, k] = line[k]
    m1, level = cy * mx + sy * my, cy * my - sy * mx
    m2, m3 = cr * level + sr * mz, cr * mz - sr * level
    state_rate[0], state_rate[1], state_rate[2], state_rate[3], state_rate[4] = (
        y_rate,
        z_rate,
        roll_rate,
        yaw_rate,
        turn_rate,
    )
    state_rate[5], state_rate[6], state_rate[9] = fy / mass, (fz + 2.0 * carried) / mass + 9.81, m2 / spin_inertia
    state_rate[7] = (m1 + spin_inertia * spin * yaw_rate * cr) / cross_inertia - yaw_rate**2 * sr * cr
    state_rate[8] = ((m3 - spin_inertia * spin * roll_rate) / cross_inertia + 2.0 * roll_rate * yaw_rate * sr) / cr


@njit(cache=True, error_model="numpy")
def march(wheelset_state, speed, step, parameters, state_path, contact_reports):
    """Simulate from a state (10,) by the classical Runge-Kutta method; fills state_path (step_count + 1, 10) and
    contact_reports (step_count + 1, 2, 18)."""
    total, rate, stage_state = np.empty(STATE_COUNT), np.empty(STATE_COUNT), np.empty(STATE_COUNT)
    state_path[0] = wheelset_state
    for i in range(len(state_path)):
        for stage in range(4):
            for k in range(STATE_COUNT):
                stage_state[k] = (
                    state_path[i, k] + (step if stage == 3 else 0.5 * step) * rate[k] if stage > 0 else state_path[i, k]
                )
            rates(stage_state, speed, parameters, stage == 0, rate, contact_reports[i])
            for k in range(STATE_COUNT):
                total[k] = total[k] + (1.0 if stage == 3 else 2.0) * rate[k] if stage > 0 else rate[k]
            if i == len(state_path) - 1:
                return
        for k in range(STATE_COUNT):
            state_path[i + 1, k] = state_path[i, k] + step / 6.0 * total[k]


def run(wheelset: Any, wheelset_state: np.ndarray, speed: float, step: float, step_count: int) -> Callable[[], Any]:
    """Returns a function that simulates a free wheelset (``models.rail.wheelset``). The function returns states
    (step_count + 1, 10) and contact reports (step_count + 1, 2)."""
    w = wheelset
    p = (w.mass, w.spin_inertia, w.yaw_inertia, (w.load - w.mass * 9.81) / 2.0, *rails_of(w).wheels[0].tolist()[:7])

    def run_wheelset() -> tuple[np.ndarray, np.ndarray]:
        path, reports = np.empty((step_count + 1, STATE_COUNT)), np.empty((step_count + 1, 2, REPORT_LENGTH))
        march(wheelset_state, speed, step, p, path, reports)
        return path, reports.view(REPORT_RECORD)[..., 0]

    return run_wheelset
