"""An extended Kalman filter beside a force-excited vehicle: its pitch from measured angle and rate, gaps and all.

filterpy's extended filter (Joseph form), compiled, over the samples of the wheel forces. The prediction is the
vehicle's own nonlinear step (the reference's Runge-Kutta), its Jacobians are that same step's, and the process
noise is the exact response of a step to the noise of its force samples: no exponential of a stiff matrix is taken.

State: (z1 - z3, z2 - z3, pitch) and their rates, m and rad, and the share by which 1/I differs from the model's.
Equations (37) do not feel where the vehicle stands or how fast it falls as a whole, and no measured pitch shows it:
with the absolute heave among the states their covariance would grow for ever as t^3 beside entries of 1e-10.
The inertia is what a wrong model errs by: wheel forces turn the vehicle as d/dt (I pitch' - b m1 z1' + a m2 z2')
= b f1 - a f2 whatever its springs and dampers are. A filter that trusts a wrong inertia either follows the
measurement's noise or lacks as much of every fast motion as the inertia is wrong.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from filterpy.kalman import KalmanFilter

from models.assembly import Assembly
from models.drift.kalman_recursion import STATES, Trace, blank
from models.drift.pitch_step import RELATIVE, PitchStep
from models.errors import RunFailed
from models.vehicles.pitch_plane_equations import suspension

PITCH, RATE, INERTIA = 2, 5, 6
"""Where pitch, its rate and the inertia's share stand in the filter's state."""
KNOWN = 1e-6
"""Deviation (m, rad, m/s, rad/s, share) of what is known at the start: nothing beside any measurement, but not 0."""


@dataclass(frozen=True)
class Measurement:
    """Measured pitch and/or pitch rate.

    values : (n, columns) in rad and rad/s, the first row at t = 0; NaN where nothing was measured
    period : s; columns : PITCH, RATE or both; deviations : white noise of each column, per sample
    """

    values: np.ndarray
    period: float
    columns: tuple[int, ...]
    deviations: tuple[float, ...]


@dataclass(frozen=True)
class Estimate:
    """What the filter, or the smoother, found at times i ``period`` (s), n of them.

    states : (n, 7), see above
    covariances : (n, 7, 7), without what the force sample of that very instant has done already
    pending : (n, 7, 2), what it has: a root of its covariance
    used, missed : (n,) measured values that were taken in, and that were no numbers
    surprises : (n,) normalised innovation squared, chi-square of ``used`` degrees of freedom where the filter is
        consistent; NaN where nothing was measured
    """

    period: float
    states: np.ndarray
    covariances: np.ndarray
    pending: np.ndarray
    used: np.ndarray
    missed: np.ndarray
    surprises: np.ndarray

    def errors(self) -> np.ndarray:
        """Covariance (n, 7, 7) of the states' errors."""
        return self.covariances + self.pending @ self.pending.transpose(0, 2, 1)


def estimate(assembly: Assembly, measured: Measurement, deviation: float, *, start_deviation: float = 0.0,
             inertia_deviation: float = 0.0, smoother: bool = False) -> Estimate:  # fmt: skip
    """Filter the pitch of a force-excited assembly over its run.

    deviation : N, standard deviation of the noise of each force sample, white
    start_deviation : rad, that of the pitch at the start, the vehicle turned as a whole
    inertia_deviation : standard deviation of the share by which 1/I may differ from the model's; 0 trusts it
    smoother : whether each estimate knows of later measurements, too

    The steps are the finer of the two sampling periods, of which the coarser one is a multiple; between force
    samples that are coarser the noise keeps its intensity, not its correlation over their period. Raises RunFailed
    if anything that is not a number reaches the estimate.
    """
    assert assembly.input is not None and assembly.input.period is not None
    period = min(assembly.input.period, measured.period)
    step = PitchStep(assembly, period, math.ceil(assembly.scene.run.duration / period - 1e-9))
    intensity = deviation**2 * assembly.input.period / period
    trace = march(step, *start(assembly, start_deviation, inertia_deviation), intensity, measured)
    found = _estimate(trace, period, intensity, measured)
    return _smoothed(found, trace) if smoother else found


def march(step: PitchStep, x: np.ndarray, covariance: np.ndarray, intensity: float,
          measured: Measurement) -> Trace:  # fmt: skip
    """Predict over each step, take in what was measured at its end, and keep everything.

    x (7,), covariance (7, 7) : state at the start; intensity : variance (N^2) of a force sample, per step of the
    filter. Raises RunFailed.
    """
    trace = blank(step.count + 1)
    values = np.ascontiguousarray(measured.values)  # other layouts would be compiled anew
    rows = (values, np.array(measured.columns), np.square(measured.deviations), _every(measured, step.period))
    failed = step.filtered(x.copy(), covariance.copy(), intensity, rows, trace)
    if failed >= 0:
        raise RunFailed("kalman filter", "the estimate became infinite or not a number", failed * step.period)
    return trace


def _every(measured: Measurement, period: float) -> int:
    """Steps of the filter from one row of the measurement to the next."""
    return round(measured.period / period)


def _estimate(trace: Trace, period: float, intensity: float, measured: Measurement) -> Estimate:
    missed = np.zeros_like(trace.used)
    rows = np.arange(0, len(missed), _every(measured, period))[: len(measured.values)]
    missed[rows] = len(measured.columns) - trace.used[rows]
    return Estimate(period, trace.states, trace.covariances, math.sqrt(intensity) * trace.pending, trace.used, missed,
                    trace.surprises)  # fmt: skip


def _smoothed(found: Estimate, steps: Trace) -> Estimate:
    """The same by filterpy's Rauch-Tung-Striebel smoother.

    It knows linear steps alone, x -> F x. An eighth state that is always 1 carries the rest of the nonlinear one.
    """
    n = len(found.states)
    states, covariances = np.ones((n, 8)), np.zeros((n, 8, 8))
    transitions, noises = np.zeros((n, 8, 8)), np.zeros((n, 8, 8))
    states[:, :7], covariances[:, :7, :7], noises[:, :7, :7] = found.states, found.covariances, steps.noises
    transitions[:, :7, :7], transitions[:, 7, 7] = steps.transitions, 1.0
    linear = np.einsum("nij,nj->ni", steps.transitions[1:], found.states[:-1])
    transitions[1:, :7, 7] = steps.predictions[1:] - linear
    states, covariances, _, _ = KalmanFilter(8, 1).rts_smoother(states, covariances, transitions, noises, _inverse)
    return replace(found, states=states[:, :7], covariances=covariances[:, :7, :7])


def _inverse(matrix: np.ndarray) -> np.ndarray:
    """Inverse of the covariance of seven states and an eighth that is certain."""
    found = np.zeros((8, 8))
    found[:7, :7] = np.linalg.inv(matrix[:7, :7])
    return found


def suspension_moment(assembly: Assembly, states: np.ndarray) -> np.ndarray:
    """Moment (n,) in N m of the suspension on the chassis, nose up, at filter states (n, 7); eqs (35) and (36)."""
    p, (front, rear, pitch, front_rate, rear_rate, rate, _) = assembly.parameters, states.T
    exact = assembly.vehicle.geometry == "exact"
    sine, cosine = (np.sin(pitch), np.cos(pitch)) if exact else (pitch, np.ones_like(pitch))
    still = np.zeros_like(pitch)
    f3, f4 = suspension((front, rear, still, pitch, front_rate, rear_rate, still, rate), p.array(), sine, cosine)
    return cosine * (p.b * f3 - p.a * f4)


def start(assembly: Assembly, turn: float, inertia: float) -> tuple[np.ndarray, np.ndarray]:
    """State and covariance at the start: the vehicle turned as a whole by ``turn`` (rad), its inertia's share."""
    p = assembly.parameters
    turned = turn * np.array([-p.b, p.a, 1.0, 0.0, 0.0, 0.0, 0.0])
    covariance = np.outer(turned, turned) + KNOWN**2 * np.eye(STATES)
    covariance[INERTIA, INERTIA] += inertia**2
    return np.append(RELATIVE @ assembly.initial, 0.0), covariance
