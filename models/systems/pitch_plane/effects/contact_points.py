"""Motion of the massless tyre contact points of a force-excited vehicle (rows 9, 10 of eq. 37).

With e = z - zeta each contact point obeys d e' + k e = f alone: it follows the wheel force and has no effect on the
vehicle. So it is no state of any engine but an exact filter over the force samples, whatever the run's steps.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from models.core.errors import InputError
from models.core.signals import SampledSignal, Smooth, StackedSignal
from models.core.strict import Strict
from models.engines.assembly import Assembly, Channels

NEEDS = ("wheel_forces",)
EXCLUDES = ("road",)
AFTER = ("wheel_forces", "force_noise", "prescribed_pitch", "prescribed_heave_and_pitch")
COST = "two exact first-order filters after the run; no state in any engine"
EXAMPLE: dict[str, float] = {}
COUNTS = {"all": {"channels": 2}}

CHANNELS = ("zeta1", "zeta2")


class Parameters(Strict):
    """[effects.contact_points]: no settings."""


def extend(vehicle_assembly: Assembly, parameters: Any) -> Assembly:
    """Returns the assembly with the motion of the contact points among its channels."""
    if vehicle_assembly.mode == "force-body":
        raise InputError(
            vehicle_assembly.scene.file,
            "effects.contact_points",
            None,
            "contact points move vertically: use frame = 'inertial' for the wheel forces",
        )
    return replace(vehicle_assembly, outputs=(*vehicle_assembly.outputs, contact_points))


def contact_points(vehicle_assembly: Assembly, times: np.ndarray, states: np.ndarray) -> Channels:
    """Channels zeta1, zeta2 (m, positive down) of the contact points over a run. At the start the tyres are at rest
    under the first force.
    """
    p, signal = vehicle_assembly.parameters, vehicle_assembly.input
    forces = signal.parts[0] if isinstance(signal, StackedSignal) else signal
    assert isinstance(forces, SampledSignal | Smooth)
    pieces = forces.polynomials()
    tyres = (("front", p.k1, p.d1), ("rear", p.k2, p.d2))
    return {
        f"zeta{i + 1}": (
            "m",
            f"contact point under the {name} wheel, down",
            states[:, i] - compression(pieces[:, :, i], forces.period, stiffness, damping, times),
        )
        for i, (name, stiffness, damping) in enumerate(tyres)
    }


def compression(
    force_polynomials: np.ndarray,
    force_sample_period: float,
    tyre_stiffness: float,
    tyre_damping: float,
    times: np.ndarray,
) -> np.ndarray:
    """Tyre compression e (n,) in m that solves d e' + k e = f at times (n,) in s, exact where the force f is a
    polynomial between samples.

    force_polynomials : (powers, periods), the force (N) in the time since each sample, lowest power first.
    On each piece e = P(t) + (e_0 - P(0)) exp(-t / tau) with tau = d / k and the particular solution
    P = (f - tau f' + tau^2 f'' - ...) / k, which ends because f is a polynomial.
    """
    tau = tyre_damping / tyre_stiffness
    particular = _particular_solution(force_polynomials, tau) / tyre_stiffness
    piece = np.clip(np.floor(times / force_sample_period + 1e-9).astype(int), 0, force_polynomials.shape[1] - 1)
    since = np.maximum(times - piece * force_sample_period, 0.0)
    steady_part = sum(particular[power, piece] * since**power for power in range(len(particular)))
    if tau == 0.0:
        return np.asarray(steady_part)
    starts = _start_compressions(particular, force_polynomials[0, 0] / tyre_stiffness, force_sample_period, tau)
    return steady_part + (starts - particular[0])[piece] * np.exp(-since / tau)


def _particular_solution(force_polynomials: np.ndarray, time_constant: float) -> np.ndarray:
    """Coefficients of the particular solution f - tau f' + tau^2 f'' - ..., shape as ``force_polynomials``; tau in
    s.
    """
    total, derivative = np.zeros_like(force_polynomials), force_polynomials.copy()
    for order in range(len(force_polynomials)):
        total += (-time_constant) ** order * derivative
        derivative = np.vstack(
            [derivative[1:] * np.arange(1, len(force_polynomials))[:, None], np.zeros_like(force_polynomials[:1])]
        )
    return total


def _start_compressions(
    particular_solution: np.ndarray, first_compression: float, sample_period: float, time_constant: float
) -> np.ndarray:
    """Tyre compression (m) at the start of each polynomial piece, equal to the compression at the end of the piece
    before.
    """
    powers = sample_period ** np.arange(len(particular_solution))
    gained = powers @ particular_solution - particular_solution[0] * math.exp(-sample_period / time_constant)
    starts = np.empty(particular_solution.shape[1])
    starts[0] = first_compression
    for i in range(len(starts) - 1):
        starts[i + 1] = gained[i] + starts[i] * math.exp(-sample_period / time_constant)
    return starts
