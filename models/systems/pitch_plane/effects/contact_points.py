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


def extend(assembly: Assembly, p: Any) -> Assembly:
    """Returns the assembly with the motion of the contact points among its channels."""
    if assembly.mode == "force-body":
        raise InputError(
            assembly.scene.file,
            "effects.contact_points",
            None,
            "contact points move vertically: use frame = 'inertial' for the wheel forces",
        )
    return replace(assembly, outputs=(*assembly.outputs, contact_points))


def contact_points(assembly: Assembly, times: np.ndarray, states: np.ndarray) -> Channels:
    """Channels zeta1, zeta2 (m, positive down) of the contact points over a run. At the start the tyres are at rest
    under the first force.
    """
    p, signal = assembly.parameters, assembly.input
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
    force_pieces: np.ndarray, force_period: float, stiffness: float, damping: float, times: np.ndarray
) -> np.ndarray:
    """Tyre compression e (n,) in m that solves d e' + k e = f at times (n,) in s, exact where the force f is a
    polynomial between samples.

    force_pieces : (powers, periods), the force (N) in the time since each sample, lowest power first.
    On each piece e = P(t) + (e_0 - P(0)) exp(-t / tau) with tau = d / k and the particular solution
    P = (f - tau f' + tau^2 f'' - ...) / k, which ends because f is a polynomial.
    """
    tau = damping / stiffness
    particular = _particular_solution(force_pieces, tau) / stiffness
    piece = np.clip(np.floor(times / force_period + 1e-9).astype(int), 0, force_pieces.shape[1] - 1)
    since = np.maximum(times - piece * force_period, 0.0)
    steady_part = sum(particular[power, piece] * since**power for power in range(len(particular)))
    if tau == 0.0:
        return np.asarray(steady_part)
    starts = _start_compressions(particular, force_pieces[0, 0] / stiffness, force_period, tau)
    return steady_part + (starts - particular[0])[piece] * np.exp(-since / tau)


def _particular_solution(force_pieces: np.ndarray, tau: float) -> np.ndarray:
    """Coefficients of the particular solution f - tau f' + tau^2 f'' - ..., shape as ``force_pieces``; tau in s."""
    total, derivative = np.zeros_like(force_pieces), force_pieces.copy()
    for order in range(len(force_pieces)):
        total += (-tau) ** order * derivative
        derivative = np.vstack(
            [derivative[1:] * np.arange(1, len(force_pieces))[:, None], np.zeros_like(force_pieces[:1])]
        )
    return total


def _start_compressions(particular: np.ndarray, first: float, sample_period: float, tau: float) -> np.ndarray:
    """Tyre compression (m) at the start of each polynomial piece, equal to the compression at the end of the piece
    before.
    """
    powers = sample_period ** np.arange(len(particular))
    gained = powers @ particular - particular[0] * math.exp(-sample_period / tau)
    starts = np.empty(particular.shape[1])
    starts[0] = first
    for i in range(len(starts) - 1):
        starts[i + 1] = gained[i] + starts[i] * math.exp(-sample_period / tau)
    return starts
