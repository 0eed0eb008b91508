"""Where the massless contact points of a force-excited vehicle are (rows 9 and 10 of eq. 37).

With e = z - zeta each obeys d e' + k e = f alone: it feels the vehicle's force and never feeds back. So
it is not a state of any engine but an exact filter over the run's own time steps.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from models.assembly import Assembly
from models.signals import Signal
from models.strict import Strict

NEEDS = ("wheel_forces",)
EXCLUDES = ("road",)
AFTER = ("wheel_forces", "prescribed_pitch")
COST = "two exact first-order filters after the run; no state in any engine"


class Parameters(Strict):
    """[effects.contact_points]: no settings."""


def extend(assembly: Assembly, p: Any) -> Assembly:
    """The assembly with the contact points among its results."""
    return replace(assembly, outputs=(*assembly.outputs, contact_points))


def contact_points(assembly: Assembly, times: np.ndarray, states: np.ndarray) -> dict[str, tuple[str, np.ndarray]]:
    """Channels zeta1, zeta2 (m, down), starting with the tyres at rest under the first force."""
    p, signal = assembly.parameters, assembly.input
    assert signal is not None
    grid, rows, forces = _grid(signal, times)
    pairs = ((p.k1, p.d1), (p.k2, p.d2))
    springs = [compression(forces[:, i], k, d, np.diff(grid), signal.held)[rows] for i, (k, d) in enumerate(pairs)]
    return {f"zeta{i + 1}": ("m", states[:, i] - springs[i]) for i in range(2)}


def _grid(signal: Signal, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times over whose steps the force is held or linear, which of them are the run's own, and the forces.

    Fixed steps divide the sampling period. An adaptive engine's do not: the samples are put in between.
    """
    step = float(times[1] - times[0])
    if np.allclose(np.diff(times), step, rtol=1e-6, atol=0):
        uniform = step * np.arange(len(times))
        return uniform, np.arange(len(times)), signal.sample(0.0, step, len(times))
    grid = np.unique(np.concatenate((times, signal.knots(times[-1]))))
    return grid, np.searchsorted(grid, times), np.array([signal.at(time) for time in grid])


def compression(force: np.ndarray, stiffness: float, damping: float, steps: np.ndarray | float,
                held: bool) -> np.ndarray:  # fmt: skip
    """Tyre compression e (n,) in m of d e' + k e = f, exact for a force that is held or linear over each step.

    force (n,) in N at the ends of the steps, one or (n - 1,) in s; stiffness in N/m, damping in N s/m.
    The update is e_1 = r e_0 + (1 - r) f / k for a held force, r = exp(-k h / d); a linear one adds the
    part of its change that has arrived, 1 - (1 - r) d / (k h).
    """
    if damping == 0.0:
        return force / stiffness
    x = stiffness * np.broadcast_to(steps, len(force) - 1) / damping
    decay, gained = np.exp(-x), -np.expm1(-x)
    arrived = np.zeros_like(x) if held else 1.0 - gained / x
    out = np.empty_like(force)
    out[0] = force[0] / stiffness
    for i in range(len(force) - 1):
        rise = arrived[i] * (force[i + 1] - force[i])
        out[i + 1] = decay[i] * out[i] + (gained[i] * force[i] + rise) / stiffness
    return out
