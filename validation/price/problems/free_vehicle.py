"""Test problem: time integration of the passenger car of 19 freedoms, free on the road; variances are in
``price.ride``.

The road is a formula, smooth in every derivative, so that a method keeps its order and another tool has the same one:
two tracks of sines that rise out of the plane some metres after the start. An engineer reads wheel loads and the
accelerations of body and occupants. Every engine has its own bodies, joints and turns; the reference is the equations
written by hand. The price of a call differs fifty-fold: Exudyn asks Python for the side forces, the road and the bars.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

from models.advice.price.problem import Setting
from models.core.trajectory import Trajectory
from models.engines.catalogue import CATALOGUE
from models.engines.spatial_protocol import build
from models.engines.spatial_reference import SpatialReference
from models.systems.ride.nonlinear import factors_of_output
from models.vehicles.spatial_linear import linearise
from models.vehicles.vehicle_file import load_vehicle
from validation.price.problems import Curves, curves_of_methods, largest_differences, milliseconds, settings_of_curves
from validation.price.problems.road_excited import setting, settings_of

DURATION, SPEED = 0.5, 20.0
"""Length of the run (s), and speed (m/s)."""
SINE_COUNT, LONGEST_WAVELENGTH, LARGEST_AMPLITUDE = 12, 24.0, 0.012
"""Number of sines in each track's height; wavelength (m) and amplitude (m) of the first sine; both fall as 1 / k."""
GOLDEN = 0.6180339887498949
"""Golden ratio less 1, whose multiples give the phases of the sines, so that no random numbers are needed."""
RISE_STATION, RISE_LENGTH = 3.0, 0.5
"""Station (m) at which the road has risen to half its height, and length (m) over which it rises."""
COMPARED_GRID = 20e-3
"""Spacing (s) of the times at which solutions are compared; every step divides it."""
GRAVITY = 9.81
_LONG_STEPS = milliseconds(20, 10, 20 / 3, 5, 4, 2)
_MIDDLE_STEPS = milliseconds(10, 5, 4, 2.5, 2, 1)
_SHORT_STEPS = milliseconds(20 / 7, 2.5, 2, 1, 0.5, 0.3125)
_MUJOCO_STEPS = milliseconds(20, 10, 5, 4, 2, 1, 0.5, 0.25, 0.125)
FULL_STEPS: Curves = {
    ("exudyn", "RK44"): _LONG_STEPS,
    ("exudyn", "ExplicitMidpoint"): milliseconds(10, 20 / 3, 5, 4, 2.5, 2),
    ("exudyn", "ExplicitEuler"): _SHORT_STEPS,
    ("exudyn", "VelocityVerlet"): _MIDDLE_STEPS,
    **curves_of_methods("exudyn", _LONG_STEPS, "GeneralizedAlpha 0.9", "TrapezoidalIndex2"),
    **curves_of_methods("exudyn", (1e-6,), "DOPRI5", "ODE23"),
    ("mujoco", "RK4"): _MUJOCO_STEPS,
    **curves_of_methods("mujoco", _MUJOCO_STEPS[1:], "Euler", "implicit", "implicitfast", "discrete"),
}
"""Steps (s) by engine and method; Exudyn has few, because a force call takes half a millisecond there. Adaptive
methods are there to be refused, as the road is sampled at half steps."""
OUTPUT_KINDS = {"wheel load": "tyre force", "acceleration": "acceleration"}
"""Kind of the vehicle's outputs that are compared, by the name of the quantity."""
REFERENCE_SOLVERS = (("DOP853", 1e-11, "equations by hand"), ("LSODA", 1e-12, "MuJoCo's accelerations"))
"""Reference solvers: method of scipy, relative tolerance, and name of the equations that it solves."""


def track_heights(positions: ArrayLike, track_number: int) -> tuple[np.ndarray, np.ndarray]:
    """Height (m) and slope of the road's left (0) or right (1) track at positions (...) in m along the road."""
    x, k = np.asarray(positions, dtype=float), np.arange(1, SINE_COUNT + 1)
    angle = 2 * np.pi * (x[..., None] * k / LONGEST_WAVELENGTH + GOLDEN * k * (k + SINE_COUNT * track_number))
    shape = (LARGEST_AMPLITUDE / k * np.sin(angle)).sum(axis=-1)
    slope = 2 * np.pi * LARGEST_AMPLITUDE / LONGEST_WAVELENGTH * np.cos(angle).sum(axis=-1)
    rise = 1 / (1 + np.exp(-(x - RISE_STATION) / RISE_LENGTH))
    return rise * shape, rise * slope + rise * (1 - rise) / RISE_LENGTH * shape


@dataclass(frozen=True)
class FreeVehicleSolver:
    """A run of the free vehicle in an engine, ready to start."""

    run: Callable[[], Trajectory]


class FreeVehicle:
    """Test problem: a free vehicle on a road, with its reference solution; a
    ``models.advice.price.problem.WorkPrecisionProblem``."""

    key, duration = "vehicle", DURATION
    note = (
        "All of Exudyn's calls ask Python for side forces, bars and the road, fifty times as dear as MuJoCo's "
        "compiled callback: force calls do not show it, seconds do."
    )
    tolerances: tuple[float, ...] = (100.0, 10.0, 1.0, 0.1)

    def __init__(self, is_quick: bool) -> None:
        steps = [1e3 * setting.value for setting in self.settings(is_quick) if not setting.adaptive]
        self.title = (
            f"Passenger car of 19 freedoms, free on a road of two tracks, {DURATION:g} s at {SPEED:g} m/s, "
            f"steps of {min(steps):g} to {max(steps):g} ms"
        )
        self.units = {"wheel load": "N", "acceleration": "m/s^2"}
        self.vehicle = replace(load_vehicle("r19_free"), gravity=GRAVITY)
        self.instants = COMPARED_GRID * np.arange(round(DURATION / COMPARED_GRID) + 1)
        self.reference = " and ".join(f"{purpose} by {method} at {tol:g}" for method, tol, purpose in REFERENCE_SOLVERS)
        self._outputs = linearise(self.vehicle, SPEED).outputs
        self._model = build("mujoco", self.vehicle, None, SPEED)
        laws = SpatialReference(self.vehicle, SPEED).acceleration, self._model.acceleration
        self.states, self.other_states = (
            self._solved(law, *setting[:2]) for law, setting in zip(laws, REFERENCE_SOLVERS, strict=True)
        )
        self._true = self.read(self.states, self.instants)
        self.uncertainty = largest_differences(self.read(self.other_states, self.instants), self._true)
        self.bound = 10 * float(np.abs(self._true["wheel load"]).max())

    def road(self, times: ArrayLike) -> np.ndarray:
        """Road heights (m) under the w wheels at times (...) in s, then their rates (m/s): (..., 2 w)."""
        waves = [
            track_heights(SPEED * np.asarray(times) + tyre.point[0], int(tyre.point[1] < 0))
            for tyre in self.vehicle.tyres
        ]
        return np.stack([*(height for height, _ in waves), *(SPEED * slope for _, slope in waves)], axis=-1)

    def _solved(
        self, acceleration_function: Callable[..., np.ndarray], method_name: str, tolerance: float
    ) -> np.ndarray:
        """States (m, 2 n) at the m compared times by a method of scipy, from the equilibrium."""
        n = len(self.vehicle.coordinates())

        def rates(t: float, y: np.ndarray) -> np.ndarray:
            return np.concatenate([y[n:], acceleration_function(t, y[:n], y[n:], self.road(t))])

        solution = solve_ivp(
            rates,
            (0.0, DURATION),
            np.zeros(2 * n),
            method=method_name,
            t_eval=self.instants,
            rtol=tolerance,
            atol=1e-2 * tolerance,
        )
        return solution.y.T

    def read(self, states: np.ndarray, times: np.ndarray) -> dict[str, np.ndarray]:
        """Dynamic wheel loads (m, w) in N, without the static ones, and accelerations (m, p) in m/s^2, for states
        (m, 2 n)."""
        road = self.road(times)
        n = states.shape[1] // 2
        accelerations = [self._model.acceleration(0.0, y[:n], y[n:], z) for y, z in zip(states, road, strict=True)]
        motion = np.column_stack([accelerations, states[:, n:], states[:, :n], road])
        return {
            name: motion @ np.array([factors_of_output(output) for output in self._outputs if output.kind == kind]).T
            for name, kind in OUTPUT_KINDS.items()
        }

    def settings(self, quick: bool) -> tuple[Setting, ...]:
        """Settings of FULL_STEPS, also in the quick report, because the reference solution alone takes seconds."""
        return settings_of_curves(FULL_STEPS, self.setting)

    def setting(self, engine: str, method: str, step_or_tolerance: float) -> Setting:
        """Setting of an engine and a method: the longest step (s) up to ``step_or_tolerance`` for which all compared
        times fall on steps; or, for an adaptive method, the tolerance.
        """
        known = CATALOGUE[engine][method.split()[0]]
        step = (
            step_or_tolerance
            if known.adaptive
            else COMPARED_GRID / np.ceil(COMPARED_GRID / step_or_tolerance * (1 - 1e-9))
        )
        return setting(engine, method, float(step))

    def build(self, setting: Setting) -> FreeVehicleSolver:
        """The vehicle in the engine of a setting, ready to run."""
        settings = replace(settings_of(setting, DURATION), step=1e-3 if setting.adaptive else setting.value)
        half_step_times = 0.5 * settings.step * np.arange(2 * settings.steps + 1)
        model = build(setting.engine, self.vehicle, settings, SPEED, self.road(half_step_times))
        rest_state = np.zeros(len(self.vehicle.coordinates()))
        return FreeVehicleSolver(partial(model.run, rest_state, rest_state))

    def errors(self, solution: Trajectory) -> dict[str, float]:
        """Largest error of any wheel load (N) and of any acceleration (m/s^2) at the compared times."""
        stride = round(COMPARED_GRID / (solution.times[1] - solution.times[0]))
        states = np.hstack([solution.positions, solution.rates])[::stride]
        return largest_differences(self.read(states, self.instants), self._true)


@cache
def problem(is_quick: bool) -> FreeVehicle:
    """The test problem of the free vehicle; its reference solution is computed once per process."""
    return FreeVehicle(is_quick)
