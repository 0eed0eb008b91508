"""Extended Kalman filter that estimates the pitch of a force-excited vehicle from measured angle and rate, with gaps.

filterpy's ``ExtendedKalmanFilter`` (Joseph form) over the samples of the wheel forces. The prediction is the
vehicle's own nonlinear step (the reference's Runge-Kutta), its Jacobians are that same step's, and the process
noise is the exact response of a step to the noise of its force samples: no exponential of a stiff matrix is taken.

State: (z1 - z3, z2 - z3, pitch) and their rates, m and rad, and the share by which 1/I differs from the model's.
Equations (37) do not feel where the vehicle stands or how fast it falls as a whole, and no measured pitch shows it:
with the absolute heave among the states their covariance would grow for ever as t^3 beside entries of 1e-10.
The step is the reference's compiled Runge-Kutta, and its derivatives are central differences of it: the nonlinear
step itself with all its substeps, without a second copy of the equations that could differ.
They are good to 1e-9, because states differ by 1e-5 about values near one, and forces and 1/I enter linearly.

The inertia is what a wrong model errs by: wheel forces turn the vehicle as d/dt (I pitch' - b m1 z1' + a m2 z2')
= b f1 - a f2 whatever its springs and dampers are. A filter that trusts a wrong inertia either follows the
measurement's noise or lacks as much of every fast motion as the inertia is wrong.
"""

import math
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter, KalmanFilter
from numba.extending import register_jitable

from models.core.errors import RunFailed
from models.engines.assembly import Assembly
from models.engines.reference import compiled_closure, compiled_march
from models.engines.stability import first_order, linearised_matrices

FILTERED_STATES = np.array([0, 1, 3, 4, 5, 7])
"""Indices of z1, z2, pitch and their rates in the vehicle's state (8,)."""
RELATIVE_STATES = np.eye(8)[FILTERED_STATES]
RELATIVE_STATES[0:2, 2] = RELATIVE_STATES[3:5, 6] = -1.0
"""Matrix (6, 8) that maps the vehicle's state to z1 - z3, z2 - z3, pitch and their rates."""
PITCH_INERTIA_INDEX = 5
"""Index of the pitch inertia in the vehicle's array of parameters."""
DIFFERENCE_WIDTHS = np.array([1.0, *[1e-5] * 6, 1e-2, *[1e3] * 4])
"""Half widths of the central differences: none for the step itself, then of the states (m, rad, m/s, rad/s), the share
of 1/I, and the force samples (N).
"""
LONGEST_SUBSTEP = 0.7
"""Longest substep divided by the time constant of the fastest pole: RK4 then errs by 1e-3 of that mode per step."""


@dataclass
class PitchStep:
    """Prediction steps of the pitch filter under the wheel forces of an assembly: ``count`` steps of ``period`` (s)."""

    assembly: Assembly
    period: float
    count: int
    _substeps: int = field(init=False)

    def __post_init__(self) -> None:
        assembly, signal = self.assembly, self.assembly.input
        assert signal is not None
        pole = np.abs(np.linalg.eigvals(first_order(linearised_matrices(assembly.vehicle, ())))).max()
        n = self._substeps = math.ceil(self.period * pole / LONGEST_SUBSTEP)
        self._rows = (0, 0, 1) if signal.held else (1, 2, 2)
        per_step, ends = n * self._rows[2], 0 if signal.held else 1
        self._inputs = signal.sample(0.0, self.period / per_step, self.count * per_step + ends)
        falling = np.ones(per_step) if signal.held else np.linspace(1.0, 0.0, per_step + 1)
        self._sample_weights = np.column_stack([falling, 1.0 - falling])
        self._p = assembly.parameters.array()
        self._respond = compiled_filter_step(assembly.mode, assembly.vehicle.geometry)

    def advance(
        self, filter_state: np.ndarray, step_index: int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Advance the filter's state x (7,) by a step. Returns the new state (7,), its derivatives with respect to x
        (7, 7), and with respect to the force samples at the step's start and at its end, (7, 2) per N each.

        filter_state : (z1 - z3, z2 - z3, pitch), their rates, and the share by which 1/I is above the assembly's.
        A held sample acts on the step after it alone; a spline counts as the polyline through its samples.
        """
        first = step_index * self._substeps * self._rows[2]
        inputs = self._inputs[first : first + len(self._sample_weights)]
        answer = self._respond(
            filter_state,
            self.period / self._substeps,
            self._substeps,
            inputs,
            self._rows,
            self._p,
            self._sample_weights,
        )
        return answer[:, 0].copy(), answer[:, 1:8], answer[:, 8:10], answer[:, 10:]


@cache
def compiled_filter_step(drive_mode: str, geometry: str) -> Any:
    """Returns the compiled filter step with its derivatives, for a mode of excitation and a geometry.

    The step maps (x, step, count, inputs, rows, p, sample_weights) to (7, 12): the new x, then derivatives with respect
    to x (7), the first force sample (2) and the last force sample (2). step to p are those of the reference's march;
    sample_weights (rows, 2) : weights of the first and the last sample in each row of the inputs.
    """
    # the march goes in as Python: numba cannot cache what encloses compiled code
    march = register_jitable(compiled_march(drive_mode, geometry).py_func)

    def respond(filter_state, time_step, step_count, force_inputs, input_rows, vehicle_parameters, sample_weights):
        states, transition, parameters = np.empty((step_count + 1, 8)), np.zeros((7, 12)), vehicle_parameters.copy()
        for column in range(12):
            for sign in (1.0, -1.0):
                y, pushed, nudge = np.zeros(8), force_inputs, sign * DIFFERENCE_WIDTHS[column]
                y[FILTERED_STATES] = filter_state[:6]
                parameters[PITCH_INERTIA_INDEX] = vehicle_parameters[PITCH_INERTIA_INDEX] / (
                    1.0 + filter_state[6] + (nudge if column == 7 else 0.0)
                )
                if 0 < column < 7:
                    y[FILTERED_STATES[column - 1]] += nudge
                elif column > 7:
                    pushed = force_inputs.copy()
                    pushed[:, (column - 8) % 2] += nudge * sample_weights[:, (column - 8) // 2]
                march(y, time_step, step_count, pushed, input_rows, parameters, states)
                end, share = states[step_count], 0.5 / (nudge if column > 0 else 1.0)
                for row in range(6):
                    heave = end[2] if row < 2 else end[6] if 2 < row < 5 else 0.0
                    transition[row, column] += share * (end[FILTERED_STATES[row]] - heave)
        transition[6, 0], transition[6, 7] = filter_state[6], 1.0
        return transition

    return compiled_closure(respond, ("pitch_step", drive_mode, geometry))


PITCH, PITCH_RATE, INERTIA_SHARE, FILTER_STATES = 2, 5, 6, 7
"""Indices of pitch, pitch rate and share of 1/I in the filter's state, and the length of that state."""
KNOWN_DEVIATION = 1e-6
"""Standard deviation (m, rad, m/s, rad/s, share) of states that are known at the start: tiny, but not 0."""


@dataclass(frozen=True)
class PitchMeasurement:
    """Measurement of the pitch, the pitch rate, or both.

    values : (n, columns) in rad and rad/s, the first row at t = 0; NaN where nothing was measured
    period : between rows (s); columns : PITCH, PITCH_RATE or both; deviations : standard deviation of each column's
    white noise
    """

    values: np.ndarray
    period: float
    columns: tuple[int, ...]
    deviations: tuple[float, ...]


@dataclass(frozen=True)
class PitchEstimate:
    """Estimates of the pitch filter or smoother at n times, ``period`` (s) apart.

    states : (n, 7), the filter's states
    covariances : (n, 7, 7), without the effect of the force sample at the same time
    pending_noise : (n, 7, 2), a root of the covariance that this force sample has caused already
    used_values, missed_values : (n,) numbers of measured values that were used, and that were missing
    normalised_innovations : (n,) normalised innovation squared, chi-square of ``used_values`` degrees of freedom where
        the filter is consistent; NaN where nothing was measured
    innovations : (n, columns), whitened: independent and of deviation 1 where the filter is consistent; NaN where
        nothing was measured
    """

    period: float
    states: np.ndarray
    covariances: np.ndarray
    pending_noise: np.ndarray
    used_values: np.ndarray
    missed_values: np.ndarray
    normalised_innovations: np.ndarray
    innovations: np.ndarray

    def error_covariances(self) -> np.ndarray:
        """Covariance (n, 7, 7) of the errors of the estimated states."""
        return self.covariances + self.pending_noise @ self.pending_noise.transpose(0, 2, 1)


@dataclass(frozen=True)
class _StepRecord:
    """Record of the filter's prediction steps: predicted states (n, 7), transition and process noise matrices
    (n, 7, 7).
    """

    predictions: np.ndarray
    transitions: np.ndarray
    noises: np.ndarray


class PitchFilter(ExtendedKalmanFilter):
    """Extended Kalman filter of the pitch, on filterpy's class: state ``x`` (7,) and covariance ``P`` (7, 7)."""

    def __init__(
        self,
        prediction_step: PitchStep,
        start_state: np.ndarray,
        start_covariance: np.ndarray,
        force_variance: float,
        pitch_measurement: PitchMeasurement,
    ) -> None:
        """Start from a state (7,) and a covariance (7, 7); force_variance : variance (N^2) of a force sample, per step
        of the filter.
        """
        super().__init__(dim_x=FILTER_STATES, dim_z=1)
        self.step, self.intensity, self.measured = prediction_step, force_variance, pitch_measurement
        self.x, self.P = start_state.copy(), start_covariance.copy()
        self.pending_response = np.zeros((FILTER_STATES, 2))
        self._present_columns = np.isfinite(pitch_measurement.values) @ (1 << np.arange(len(pitch_measurement.columns)))
        self._measurement_models = [
            self._model_of_columns(column_mask) for column_mask in range(1 << len(pitch_measurement.columns))
        ]

    def predict_x(self, u: Any = 0) -> None:
        """Predict state, Jacobian and process noise over the filter's step number ``u``.

        A force sample that is interpolated linearly acts on the step before it, too. This response,
        ``pending_response``, is not in P: it is added one step later, together with the sample's response in that step.
        So the added noise is white, and the covariance of the error is P plus the pending part.
        """
        self.x, self.F, early, late = self.step.advance(self.x, u)
        push = early + self.F.dot(self.pending_response)
        self.Q, self.pending_response = self.intensity * push.dot(push.T), late

    def measure(self, measurement_row: int) -> np.ndarray:
        """Update the filter with the finite values in a row of the measurement. Returns whitened innovations
        (columns,), NaN for missing values."""
        white, columns_present = np.full(len(self.measured.columns), math.nan), self._present_columns[measurement_row]
        if not columns_present:
            return white
        chosen, rows, variance = self._measurement_models[columns_present]
        late = rows.dot(self.pending_response)
        values = self.measured.values[measurement_row, chosen]
        self.update(values, lambda x: rows, rows.dot, R=variance + self.intensity * late.dot(late.T))
        white[chosen] = np.linalg.cholesky(self.SI).T.dot(self.y)
        return white

    def _model_of_columns(self, column_bits: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns the measurement model of the columns whose bits are set in ``column_bits``: their indices, rows
        (m, 7) that select them from the state, and noise covariance (m, m).
        """
        chosen = np.array([i for i in range(len(self.measured.columns)) if column_bits >> i & 1], dtype=int)
        return (
            chosen,
            self._I[[self.measured.columns[i] for i in chosen]],
            np.diag([self.measured.deviations[i] ** 2 for i in chosen]),
        )


def estimate_pitch(
    vehicle_assembly: Assembly,
    pitch_measurement: PitchMeasurement,
    force_deviation: float,
    *,
    start_deviation: float = 0.0,
    inertia_deviation: float = 0.0,
    with_smoother: bool = False,
) -> PitchEstimate:
    """Estimate the pitch of a force-excited assembly over its run from a measurement, by the Kalman filter or smoother.

    force_deviation : standard deviation of the white noise on each force sample (N)
    start_deviation : standard deviation of the pitch at the start, by a rotation of the vehicle (rad)
    inertia_deviation : standard deviation of the share by which 1/I may differ from the model's; 0 trusts the model
    with_smoother : whether each estimate uses later measurements, too

    The steps are the finer of the two sampling periods, of which the coarser one is a multiple; between force
    samples that are coarser the noise keeps its intensity, not its correlation over their period. Raises RunFailed
    if anything that is not a number reaches the estimate.
    """
    assert vehicle_assembly.input is not None and vehicle_assembly.input.period is not None
    period = min(vehicle_assembly.input.period, pitch_measurement.period)
    step = PitchStep(vehicle_assembly, period, math.ceil(vehicle_assembly.scene.run.duration / period - 1e-9))
    start = _initial_state_and_covariance(vehicle_assembly, start_deviation, inertia_deviation)
    estimated, steps = _march_filter(
        PitchFilter(step, *start, force_deviation**2 * vehicle_assembly.input.period / period, pitch_measurement)
    )
    return _smoothed_estimate(estimated, steps) if with_smoother else estimated


def _march_filter(pitch_filter: PitchFilter) -> tuple[PitchEstimate, _StepRecord]:
    """Run the filter: predict each step, update with the measurement at its end. Returns estimates and step records."""
    n, period, measured = pitch_filter.step.count + 1, pitch_filter.step.period, pitch_filter.measured
    stride, width = round(measured.period / period), len(measured.columns)
    states, pending, predictions = np.empty((n, 7)), np.empty((n, 7, 2)), np.empty((n, 7))
    covariances, transitions, noises = (np.empty((n, 7, 7)) for _ in range(3))
    missed, innovations = np.zeros(n, dtype=int), np.full((n, width), np.nan)
    for i in range(n):
        if i:
            pitch_filter.predict(i - 1)
        if not math.isfinite(pitch_filter.x.dot(pitch_filter.P).dot(pitch_filter.x)):
            raise RunFailed("kalman filter", "the estimate became infinite or not a number", i * period)
        predictions[i], transitions[i], noises[i] = pitch_filter.x, pitch_filter.F, pitch_filter.Q
        if i % stride == 0 and i // stride < len(measured.values):
            innovations[i] = pitch_filter.measure(i // stride)
            missed[i] = np.count_nonzero(np.isnan(innovations[i]))
        states[i], covariances[i], pending[i] = pitch_filter.x, pitch_filter.P, pitch_filter.pending_response
    pending *= math.sqrt(pitch_filter.intensity)
    used = np.count_nonzero(np.isfinite(innovations), axis=1)
    surprises = np.where(used > 0, np.nansum(innovations**2, axis=1), np.nan)
    estimated = PitchEstimate(period, states, covariances, pending, used, missed, surprises, innovations)
    return estimated, _StepRecord(predictions, transitions, noises)


def _smoothed_estimate(filter_estimate: PitchEstimate, step_record: _StepRecord) -> PitchEstimate:
    """Smooth the filter's estimate by filterpy's Rauch-Tung-Striebel smoother.

    The smoother supports linear steps only, x -> F x. An eighth state, always 1, carries the difference between the
    nonlinear step and F x.
    """
    n = len(filter_estimate.states)
    states, covariances = np.ones((n, 8)), np.zeros((n, 8, 8))
    transitions, noises = np.zeros((n, 8, 8)), np.zeros((n, 8, 8))
    states[:, :7], covariances[:, :7, :7], noises[:, :7, :7] = (
        filter_estimate.states,
        filter_estimate.covariances,
        step_record.noises,
    )
    transitions[:, :7, :7], transitions[:, 7, 7] = step_record.transitions, 1.0
    linear = np.einsum("nij,nj->ni", step_record.transitions[1:], filter_estimate.states[:-1])
    transitions[1:, :7, 7] = step_record.predictions[1:] - linear
    states, covariances, _, _ = KalmanFilter(8, 1).rts_smoother(
        states, covariances, transitions, noises, _covariance_inverse
    )
    return replace(filter_estimate, states=states[:, :7], covariances=covariances[:, :7, :7])


def _covariance_inverse(covariance: np.ndarray) -> np.ndarray:
    """Inverse of a covariance (8, 8) of seven states and an eighth that is certain, whose row and column stay zero."""
    inverse = np.zeros((8, 8))
    inverse[:7, :7] = np.linalg.inv(covariance[:7, :7])
    return inverse


def _initial_state_and_covariance(
    vehicle_assembly: Assembly, pitch_deviation: float, inertia_deviation: float
) -> tuple[np.ndarray, np.ndarray]:
    """State (7,) and covariance (7, 7) of the filter at the start.

    pitch_deviation : standard deviation of a rotation of the vehicle (rad); inertia_deviation : standard deviation of
    the share by which 1/I is wrong.
    """
    p = vehicle_assembly.parameters
    rotated_state = pitch_deviation * np.array([-p.b, p.a, 1.0, 0.0, 0.0, 0.0, 0.0])
    covariance = np.outer(rotated_state, rotated_state) + KNOWN_DEVIATION**2 * np.eye(FILTER_STATES)
    covariance[INERTIA_SHARE, INERTIA_SHARE] += inertia_deviation**2
    return np.append(RELATIVE_STATES @ vehicle_assembly.initial, 0.0), covariance
