"""Propagation of small errors along a force-excited run, by the equations linearised about its path, step by step.

An error x (8,) of the state obeys x' = A(t) x + g(t), where A is the Jacobian of eq. (37) at the path and g what
wrong forces or wrong parameters add. The march below is the exact linearisation of the reference's Runge-Kutta
step, so it gives what a run with a very small error would give, free of rounding.

Covariance under white noise on the samples of the forces, which are held over each period or linear in between: from
one sample to the next x+ = Phi x + G0 w + G1 w+, with Phi, G0 and G1 from the same linearisation, so the recursion
gives what a Monte Carlo with the same samples gives, as long as the errors are small. Linear samples reach into two
periods: x and w are correlated, E[x w^T] = s^2 G1 of the period before. No matrix exponential is taken: van Loan's
block form holds exp(-A T) of a pole at -697 1/s and overflows without a word (filterpy's ``van_loan_discretization`` is
wrong from T = 0.05 s on).
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba.extending import register_jitable

from models.core.signals import SampledSignal, Smooth
from models.engines.assembly import Assembly
from models.engines.reference import compiled_closure
from models.machine.compiled import closure_with_unique_name
from models.vehicles.pitch_plane import STATES, PitchPlaneParameters
from models.vehicles.pitch_plane_equations import RIGHT_HAND_SIDES, suspension_forces

LONGEST_TIME_STEP = 1e-3
"""Longest time step (s) of the path; the fastest pole of the published vehicle, -697 1/s, needs steps below 4 ms."""

MODEL_DIFFERENCE_SHARE = 1e-6
"""Share of a wrong model's parameter differences over which derivatives are taken. With a large share the errors of two
parameters would multiply, and a wrong stiffness with a wrong inertia would give a moment that no run has."""


class StageForces(NamedTuple):
    """Wheel forces and errors of wheel forces at the start, the middle and the end of each time step.

    step : time step (s). forces : (rows, 2) in N. errors : (rows, m, 2) in N, for m error columns. to_middle, to_end,
    to_next : number of rows of ``forces`` from a step's start to its middle, its end and the next step.
    """

    step: float
    forces: np.ndarray
    errors: np.ndarray
    to_middle: int
    to_end: int
    to_next: int


@register_jitable
def jacobian_product(state, wheel_forces, parameters, forces_turn_with_body, is_linearised, state_error, error_rate):
    """Compute dx = A x, where A is the Jacobian of the state's rates at the state y (8,) under wheel forces u (2,) in
    N. forces_turn_with_body : forces turn with the chassis; is_linearised : linear geometry; parameters : vehicle
    parameters.
    """
    pitch, rate = (0.0, 0.0) if is_linearised else (state[3], state[7])
    sine, cosine = math.sin(pitch), math.cos(pitch)
    a, b, inertia = parameters[0], parameters[1], parameters[5]
    turn = cosine * state_error[7] - rate * sine * state_error[3]
    df3 = parameters[8] * (state_error[2] - state_error[0] - b * cosine * state_error[3]) + parameters[12] * (
        state_error[6] - state_error[4] - b * turn
    )
    df4 = parameters[9] * (state_error[2] - state_error[1] + a * cosine * state_error[3]) + parameters[13] * (
        state_error[6] - state_error[5] + a * turn
    )
    f3, f4 = suspension_forces(state, parameters, sine, cosine)
    for i in range(4):
        error_rate[i] = state_error[4 + i]
    error_rate[4], error_rate[5], error_rate[6] = df3 / parameters[2], df4 / parameters[3], -(df3 + df4) / parameters[4]
    error_rate[7] = (cosine * (b * df3 - a * df4) - sine * (b * f3 - a * f4) * state_error[3]) / inertia
    if forces_turn_with_body:
        error_rate[4] += wheel_forces[0] * sine * state_error[3] / parameters[2]
        error_rate[5] += wheel_forces[1] * sine * state_error[3] / parameters[3]
        error_rate[7] += 2 * sine * cosine * (b * wheel_forces[0] - a * wheel_forces[1]) * state_error[3] / inertia


@register_jitable
def add_force_errors(state, parameters, forces_turn_with_body, force_errors, error_rate):
    """Add the effect of errors du (2,) in N of the wheel forces to the rates dx (8,) of the state's error."""
    sine, cosine = (math.sin(state[3]), math.cos(state[3])) if forces_turn_with_body else (0.0, 1.0)
    error_rate[4] -= cosine * force_errors[0] / parameters[2]
    error_rate[5] -= cosine * force_errors[1] / parameters[3]
    error_rate[7] += sine * sine * (parameters[1] * force_errors[0] - parameters[0] * force_errors[1]) / parameters[5]


def _step_of(state_rates, forces_turn_with_body, is_linearised):
    def step_of(state, present_errors, stage_inputs, step_index, first_row, parameters, wrong_parameters):
        """Advance the path y (8,) and the error columns x (m, 8), in place, by the Runge-Kutta step number
        ``step_index``.

        stage_inputs : ``StageForces``, whose errors are read from ``first_row`` on; parameters, wrong_parameters :
        parameters (15,), true and wrong.
        """
        step, first, columns = stage_inputs.step, step_index * stage_inputs.to_next, present_errors.shape[0]
        input_rows = (first, first + stage_inputs.to_middle, first + stage_inputs.to_end)
        wrong = (wrong_parameters != parameters).any()
        k, kx = np.zeros((4, 8)), np.zeros((4, columns, 8))
        stage, stage_x, wrong_rate = np.empty(8), np.empty(8), np.zeros(8)
        for s in range(4):
            half_steps = (s + 1) // 2
            stage_step = 0.5 * step * half_steps
            u, e = stage_inputs.forces[input_rows[half_steps]], stage_inputs.errors[first_row + half_steps]
            for q in range(8):
                stage[q] = state[q] + stage_step * k[s - 1, q]
            state_rates(stage, u, parameters, k[s])
            if wrong:
                state_rates(stage, u, wrong_parameters, wrong_rate)
                for q in range(8):
                    wrong_rate[q] = (wrong_rate[q] - k[s, q]) / MODEL_DIFFERENCE_SHARE
            for j in range(columns):
                for q in range(8):
                    stage_x[q] = present_errors[j, q] + stage_step * kx[s - 1, j, q]
                jacobian_product(stage, u, parameters, forces_turn_with_body, is_linearised, stage_x, kx[s, j])
                add_force_errors(stage, parameters, forces_turn_with_body, e[j], kx[s, j])
                for q in range(8):
                    kx[s, j, q] += wrong_rate[q]
        for q in range(8):
            state[q] += step / 6 * (k[0, q] + 2 * k[1, q] + 2 * k[2, q] + k[3, q])
            for j in range(columns):
                present_errors[j, q] += step / 6 * (kx[0, j, q] + 2 * kx[1, j, q] + 2 * kx[2, j, q] + kx[3, j, q])

    return register_jitable(
        closure_with_unique_name(step_of, state_rates.__name__, forces_turn_with_body, is_linearised)
    )


def compile_carry(compiled_step, cache_key):
    """Compile the time integration that records the path and its error columns at every step."""

    def carry(state, present_errors, stage_inputs, parameters, wrong_parameters, states, error_columns):
        states[0], error_columns[0] = state, present_errors
        for i in range(len(states) - 1):
            compiled_step(state, present_errors, stage_inputs, i, 3 * i, parameters, wrong_parameters)
            states[i + 1], error_columns[i + 1] = state, present_errors

    return compiled_closure(carry, cache_key)


@cache
def march_along(compile_march: Any, drive_mode: str, geometry: str) -> Any:
    """Returns a compiled time integration along the path, for a mode of excitation and a geometry."""
    one_step = _step_of(RIGHT_HAND_SIDES[drive_mode, geometry], drive_mode == "force-body", geometry == "linear")
    return compile_march(one_step, (drive_mode, geometry))


@dataclass(frozen=True)
class TangentPath:
    """A force-excited run along which small errors are propagated, in fixed steps that divide the sampling period.

    steps_per_sample : number of steps between force samples; samples : number of sampling periods of the run.
    """

    assembly: Assembly
    forces: SampledSignal | Smooth
    steps_per_sample: int
    samples: int

    @property
    def step(self) -> float:
        """Time step of the path (s)."""
        return self.forces.period / self.steps_per_sample

    @property
    def steps(self) -> int:
        """Number of time steps of the path."""
        return self.steps_per_sample * self.samples

    @property
    def forces_at_stages(self) -> np.ndarray:
        """Wheel forces (rows, 2) in N at the Runge-Kutta stages of all steps."""
        if self.forces.held:
            return self.forces.sample(0.0, self.step, self.steps)
        return self.forces.sample(0.0, self.step / 2, 2 * self.steps + 1)

    def stage_forces(self, force_errors: np.ndarray) -> StageForces:
        """Returns the wheel forces at the stages of all steps, together with their errors (rows, m, 2) in N."""
        return StageForces(
            self.step, self.forces_at_stages, force_errors, *((0, 0, 1) if self.forces.held else (1, 2, 2))
        )

    def march(self, compile_march: Any):
        """Returns the compiled time integration for the assembly's mode of excitation and geometry."""
        return march_along(compile_march, self.assembly.mode, self.assembly.vehicle.geometry)

    def propagate_errors(
        self,
        start_error_columns: np.ndarray,
        force_errors: np.ndarray | None = None,
        wrong_parameters: PitchPlaneParameters | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Propagate errors along the path. Returns states (n + 1, 8) and error columns (n + 1, m, 8) at all steps; the
        columns begin with ``start_error_columns`` (m, 8).

        force_errors : (3 steps, m, 2), errors of the forces (N) at the start, the middle and the end of each step;
        wrong_parameters : the parameters of a wrong model, whose error forces every column.
        """
        count, p = self.steps, self.assembly.parameters.array()
        wrong = p if wrong_parameters is None else p + MODEL_DIFFERENCE_SHARE * (wrong_parameters.array() - p)
        pushes = np.zeros((3 * count, len(start_error_columns), 2)) if force_errors is None else force_errors
        states, error_columns = np.empty((count + 1, 8)), np.empty((count + 1, *start_error_columns.shape))
        self.march(compile_carry)(
            self.assembly.initial.copy(),
            np.array(start_error_columns, dtype=float),
            self.stage_forces(pushes),
            p,
            wrong,
            states,
            error_columns,
        )
        return states, error_columns

    @property
    def times(self) -> np.ndarray:
        """Times (n + 1,) of all steps in s, the start included."""
        return self.step * np.arange(self.steps + 1)


def tangent_path_of(vehicle_assembly: Assembly, longest_step: float = LONGEST_TIME_STEP) -> TangentPath:
    """Returns the path of a free force-excited run, in steps of at most ``longest_step`` (s). Raises ValueError for
    a run of another kind.
    """
    forces = vehicle_assembly.input
    held_up = vehicle_assembly.vehicle.pitch_springs or vehicle_assembly.moment is not None
    if (
        vehicle_assembly.mode not in ("force", "force-body")
        or held_up
        or not isinstance(forces, SampledSignal | Smooth)
    ):
        raise ValueError("errors grow along a free force-excited run; this one is guided or held, or has a road")
    samples = round(vehicle_assembly.scene.run.duration / forces.period)
    return TangentPath(vehicle_assembly, forces, max(1, math.ceil(forces.period / longest_step - 1e-9)), samples)


def tilt_error_columns(vehicle_assembly: Assembly) -> np.ndarray:
    """Initial error columns (2, 8): a tilt of 1 rad, and a tilt rate of 1 rad/s, of the rigid vehicle with its wheels.

    The struts keep their lengths, so that no fast motion is excited that would have to decay first.
    """
    p, pitch = vehicle_assembly.parameters, vehicle_assembly.initial[3]
    cosine = 1.0 if vehicle_assembly.vehicle.geometry == "linear" else math.cos(pitch)
    shape = np.array([-p.b * cosine, p.a * cosine, 0.0, 1.0])
    return np.array([[*shape, *np.zeros(4)], [*np.zeros(4), *shape]])


def tilt_map(tangent_path: TangentPath) -> np.ndarray:
    """Matrix (2, 2) that maps errors of tilt and tilt rate at the start of a path to those at its end.

    The slow error has no damping, so that the determinant of the exact map is 1. Its difference from 1 measures the
    share of fast motion in the matrix.
    """
    _, columns = tangent_path.propagate_errors(tilt_error_columns(tangent_path.assembly))
    return columns[-1][:, [3, 7]].T


def measured_growth(tangent_path: TangentPath) -> tuple[float, float]:
    """Growth rate (1/s) of a tilt error along a path, and the uncertainty (1/s) of this rate, which falls with the
    path's length.

    The rate is that of the larger eigenvalue of ``tilt_map``; with both eigenvalues on the unit circle the error swings
    and does not grow. Where the eigenvalues meet, at 1, an error of the map changes them by its square root.
    """
    tilting, duration = tilt_map(tangent_path), tangent_path.forces.period * tangent_path.samples
    departure = abs(float(np.linalg.det(tilting)) - 1.0)
    return float(np.log(np.abs(np.linalg.eigvals(tilting)).max())) / duration, math.sqrt(departure) / duration


def slow_swing_frequency(tangent_path: TangentPath) -> float:
    """Angular frequency (rad/s) of the slow swing of a tilt error along a path; 0 where the error grows instead."""
    half = 0.5 * float(np.trace(tilt_map(tangent_path)))
    return math.acos(half) / (tangent_path.forces.period * tangent_path.samples) if abs(half) <= 1.0 else 0.0


@dataclass(frozen=True)
class CovarianceOverTime:
    """Covariance of the vehicle's state over time. times (n,) : of the force samples (s); matrices (n, 8, 8) : in
    products of the states' units.
    """

    times: np.ndarray
    matrices: np.ndarray

    def deviation(self, coordinate_name: str) -> np.ndarray:
        """Standard deviation (n,) over time of a coordinate (m or rad), by its name."""
        i = STATES.index(coordinate_name)
        return np.sqrt(self.matrices[:, i, i])


def covariance_over_time(
    vehicle_assembly: Assembly, force_deviation: float, longest_step: float = LONGEST_TIME_STEP
) -> CovarianceOverTime:
    """Covariance of the state along a free force-excited run under white noise on the wheel forces, of standard
    deviation ``force_deviation`` (N) per sample.

    longest_step : longest time step (s). Raises ValueError for any other run, and for spline interpolation of
    samples, as every sample of a spline acts on all periods.
    """
    path = tangent_path_of(vehicle_assembly, longest_step)
    if vehicle_assembly.scene.effects["wheel_forces"].interpolation == "smooth":
        raise ValueError("the noise of samples that a spline goes through has no recursion: hold it, or take it linear")
    return CovarianceOverTime(
        path.forces.period * np.arange(path.samples + 1), noise_covariances(path, force_deviation)
    )


def noise_covariances(tangent_path: TangentPath, force_deviation: float) -> np.ndarray:
    """Covariances (samples + 1, 8, 8) of the state at the force samples of a path, under noise of standard deviation
    ``force_deviation`` (N); 0 at the start.
    """
    matrices = np.zeros((tangent_path.samples + 1, 8, 8))
    stages = np.arange(2 * tangent_path.steps_per_sample + 1) / (2 * tangent_path.steps_per_sample)
    weights = np.zeros((len(stages), 12, 2))  # force errors of 1 N in the sample at the start and in that at the end
    for wheel in range(2):
        weights[:, 8 + wheel, wheel] = 1.0 if tangent_path.forces.held else 1.0 - stages
        weights[:, 10 + wheel, wheel] = 0.0 if tangent_path.forces.held else stages
    tangent_path.march(_compile_covariance)(
        tangent_path.assembly.initial.copy(),
        tangent_path.steps_per_sample,
        tangent_path.stage_forces(weights),
        tangent_path.assembly.parameters.array(),
        force_deviation**2,
        matrices,
    )
    return matrices


def _compile_covariance(compiled_step, cache_key):
    def covariance_march(state, steps_per_sample, stage_inputs, parameters, force_variance, covariances):
        """Run the covariance recursion of this file; x holds the columns of Phi, G0 and G1."""
        x, last_end_response = np.empty((12, 8)), np.zeros((2, 8))
        for i in range(len(covariances) - 1):
            x[:] = 0.0
            for j in range(8):
                x[j, j] = 1.0
            for j in range(steps_per_sample):
                compiled_step(state, x, stage_inputs, i * steps_per_sample + j, 2 * j, parameters, parameters)
            transition, start_response, ended = x[:8], x[8:10], x[10:]
            cross = force_variance * transition.T @ last_end_response.T @ start_response
            covariances[i + 1] = transition.T @ covariances[i] @ transition + force_variance * (
                start_response.T @ start_response + ended.T @ ended
            )
            covariances[i + 1] += cross + cross.T
            last_end_response[:] = ended

    return compiled_closure(covariance_march, cache_key)
