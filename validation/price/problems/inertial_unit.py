"""Test problem: the attitude of a car over ten minutes, integrated from sampled gyro rates.

The motion is a formula: roll, pitch and yaw as sums of sines and a steady turn, with the exact local rates that belong
to them. So the attitude is known in closed form at every sample, and methods differ in how they integrate the rates
between samples. The engines' solutions are in ``turning_sphere``.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from models.advice.price.problem import Setting
from models.sensors.rotations import (
    IntegrationRule,
    conjugate_quaternion,
    integrate_attitude,
    quaternion_from_cardan,
    quaternion_product,
    rotation_vector,
)
from validation.price.problems import Curves, curves_of_methods, settings_of_curves
from validation.price.problems.road_excited import DEFAULT_SETTING_OWNERS, STAGES_OF_METHOD
from validation.price.problems.turning_sphere import Attitudes, attitudes_in_exudyn, attitudes_in_mujoco

DURATION, COMPARED_GRID = 600.0, 1.0
"""Length of the run (s), and spacing (s) of the times at which attitudes are compared, which every step divides."""
ANGLE_SINES = {
    "roll": ((0.03, 1.1, 0.4), (0.015, 7.3, 1.9)),
    "pitch": ((0.02, 0.9, 2.2), (0.01, 8.1, 0.7)),
    "yaw": ((0.6, 0.05, 0.0), (0.01, 2.7, 1.1)),
}
"""Amplitude (rad), circular frequency (rad/s) and phase (rad) of the sines of each angle of the car."""
STEADY_YAW_RATE = 0.02
"""Steady part of the yaw rate, rad/s: two turns in ten minutes."""
INTEGRATION_RULES: dict[str, tuple[IntegrationRule, int]] = {
    "held rates": ("held", 1),
    "mean rates": ("mean", 2),
    "cubic rates": ("cubic", 4),
}
"""Rule of ``models.sensors.rotations`` and its order, by the name of the method."""
FIRST_ORDER_METHODS = {"ExplicitEuler", "Euler", "implicit", "implicitfast", "discrete"}
"""Engine methods of first order; all others have order two, because rates are linear between samples."""
ADAPTIVE_METHODS = ("DOPRI5", "ODE23")
"""Adaptive methods, which are there to be refused."""
_RATES, _FEW_RATES = (5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0), (5.0, 8.0, 10.0, 16.0, 20.0, 25.0)
_NATIVE, _IMPLICIT = (5.0, 8.0, 10.0, 20.0, 50.0, 100.0), (10.0, 12.0, 16.0, 20.0, 25.0, 100.0)
FULL_RATES: Curves = {
    **curves_of_methods("reference", _RATES, *INTEGRATION_RULES),
    **curves_of_methods("exudyn", _FEW_RATES, "RK44", "RK67", "RK33", "ExplicitMidpoint", "ExplicitEuler"),
    **curves_of_methods("exudyn", _IMPLICIT, "GeneralizedAlpha 0.9", "VelocityVerlet"),
    ("exudyn", "TrapezoidalIndex2"): (8.0, *_IMPLICIT[:-1]),
    **curves_of_methods("exudyn", (100.0,), *ADAPTIVE_METHODS),
    ("mujoco", "Euler"): (*_NATIVE, 500.0),
    **curves_of_methods("mujoco", (4.0, *_NATIVE[:-1]), "RK4", "implicit", "implicitfast", "discrete"),
}
"""Sampling rates (Hz) of the gyro by engine and method; Exudyn's last two methods are there to be refused."""
QUICK_RATES: Curves = {("reference", "cubic rates"): (10.0, 20.0, 50.0, 100.0), ("mujoco", "Euler"): (5.0, 10.0, 20.0)}
"""Sampling rates (Hz), by engine and method, that the quick report takes."""
FINE_STEP = 5e-3
"""Step (s) of the sixth-order Magnus method that the closed form is compared with."""


def car_angles(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Roll, pitch and yaw (n, 3) in rad of the car at times (n,) in s, and their rates (n, 3) in rad/s."""
    angle_columns, rates = [], []
    for name, sines in ANGLE_SINES.items():
        steady = STEADY_YAW_RATE if name == "yaw" else 0.0
        angle_columns.append(steady * times + sum(size * np.sin(f * times + phase) for size, f, phase in sines))
        rates.append(steady + sum(size * f * np.cos(f * times + phase) for size, f, phase in sines))
    return np.column_stack(angle_columns), np.column_stack(rates)


def car_attitude(times: np.ndarray) -> np.ndarray:
    """Quaternions (n, 4) of the car's attitude at times (n,) in s, in closed form."""
    return quaternion_from_cardan(*car_angles(times)[0].T)


def gyro(times: np.ndarray) -> np.ndarray:
    """Angular rates (n, 3) in rad/s in body axes at times (n,) in s, as an ideal gyro measures them."""
    (roll, pitch, _), (by_roll, by_pitch, by_yaw) = (columns.T for columns in car_angles(times))
    return np.column_stack(
        [
            by_roll - by_yaw * np.sin(pitch),
            by_pitch * np.cos(roll) + by_yaw * np.sin(roll) * np.cos(pitch),
            -by_pitch * np.sin(roll) + by_yaw * np.cos(roll) * np.cos(pitch),
        ]
    )


def magnus_attitudes(time_step: float) -> np.ndarray:
    """Quaternions (n + 1, 4) of the car's attitude by the Magnus method of order six with steps of ``time_step`` s,
    which reads the rates at three Gauss points.

    The bracket of two rotation vectors is their vector product, with the sign of rates that are local (Blanes, Casas,
    Oteo and Ros, Physics Reports 470, 2009, eq. 257).
    """
    start = time_step * np.arange(round(DURATION / time_step))
    first_turn, middle, last_turn = (
        time_step * gyro(start + time_step * (0.5 + point_offset))
        for point_offset in np.array([-1, 0, 1]) * np.sqrt(0.15)
    )
    slope, bend = np.sqrt(15) / 3 * (last_turn - first_turn), 10 / 3 * (last_turn - 2 * middle + first_turn)
    odd = -np.cross(middle, slope)
    second_commutator = np.cross(middle, 2 * bend + odd) / 60
    turn = middle + bend / 12 - np.cross(-20 * middle - bend + odd, slope + second_commutator) / 240
    # a chain of rotations is what rates that are held for one second each make
    return integrate_attitude(np.concatenate([turn, turn[-1:]]), 1.0, car_attitude(np.zeros(1))[0], "held")


def largest_angle(computed_attitudes: np.ndarray, true_attitudes: np.ndarray) -> float:
    """Largest angle (rad) between computed and true attitudes, quaternions (n, 4) each."""
    return float(
        np.linalg.norm(
            rotation_vector(quaternion_product(conjugate_quaternion(computed_attitudes), true_attitudes)), axis=-1
        ).max()
    )


@dataclass(frozen=True)
class AttitudeSolver:
    """Integration of the attitude, ready to run: by one of twinrig's rules, or by a rotating sphere in an engine."""

    setting: Setting

    def run(self) -> Attitudes:
        """Attitudes at the compared times; Refused or RunFailed from the engine pass through."""
        engine, method, period = self.setting.engine, self.setting.method, self.setting.value
        count, stride, start = round(DURATION / period), round(COMPARED_GRID / period), car_attitude(np.zeros(1))[0]
        if engine != "reference":
            return (attitudes_in_exudyn if engine == "exudyn" else attitudes_in_mujoco)(
                method, period, count, stride, start, gyro
            )
        attitudes = integrate_attitude(gyro(period * np.arange(count + 1)), period, start, INTEGRATION_RULES[method][0])
        return Attitudes(attitudes[::stride], {"steps": count, "force calls": count})


class InertialUnit:
    """Test problem: attitude from gyro rates, with its reference; a
    ``models.advice.price.problem.WorkPrecisionProblem``.
    """

    key, duration, bound = "unit", DURATION, 1.0
    note = (
        "A force call is a sample of the rates, in an engine an evaluation of the torque. Rates are linear between "
        "the samples for an engine, which leaves its methods order two at most."
    )
    tolerances: tuple[float, ...] = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)

    def __init__(self, is_quick: bool) -> None:
        rates = [1 / setting.value for setting in self.settings(is_quick)]
        self.title = (
            f"Attitude of a car for {DURATION:g} s from {min(rates):g} to {max(rates):g} samples of its rates a second"
        )
        self.units = {"attitude": "rad"}
        self.reference = f"closed form, and a Magnus method of order six at {1e3 * FINE_STEP:g} ms"
        self.true = car_attitude(COMPARED_GRID * np.arange(round(DURATION / COMPARED_GRID) + 1))
        self.uncertainty = {
            "attitude": largest_angle(magnus_attitudes(FINE_STEP)[:: round(COMPARED_GRID / FINE_STEP)], self.true)
        }

    def settings(self, quick: bool) -> tuple[Setting, ...]:
        """Settings of FULL_RATES, or for the quick report of QUICK_RATES."""
        return settings_of_curves(
            QUICK_RATES if quick else FULL_RATES, lambda engine, method, rate: self.setting(engine, method, 1 / rate)
        )

    def setting(self, engine: str, method: str, step_or_tolerance: float) -> Setting:
        """Setting of an engine and a method: the longest step (s) up to ``step_or_tolerance`` for which all compared
        times fall on steps.
        """
        step = COMPARED_GRID / np.ceil(COMPARED_GRID / step_or_tolerance * (1 - 1e-9))
        order = INTEGRATION_RULES[method][1] if engine == "reference" else 1 if method in FIRST_ORDER_METHODS else 2
        stages = 1 if engine == "reference" else STAGES_OF_METHOD.get(method, 0)
        return Setting(
            engine,
            method,
            float(step),
            order,
            method in ADAPTIVE_METHODS,
            stages,
            default=DEFAULT_SETTING_OWNERS.get((engine, method, float(step)), ""),
        )

    def build(self, setting: Setting) -> AttitudeSolver:
        """The integration of the attitude by the method and step of a setting, ready to run."""
        return AttitudeSolver(setting)

    def errors(self, solution: Attitudes) -> dict[str, float]:
        """Largest angle (rad) between computed and true attitude at the compared times."""
        return {"attitude": largest_angle(solution.quaternions, self.true)}


@cache
def problem(is_quick: bool) -> InertialUnit:
    """The test problem of the attitude from gyro rates; its reference is computed once per process."""
    return InertialUnit(is_quick)
