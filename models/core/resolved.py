"""Whether the steps of a run were short enough for what happened in it, told from its states alone.

Simpson's rule over two steps gives the way that the rates make: where the positions went another way, the motion bent
within a step, at a stop that was hit, a stick that let go, a swing that took few steps. What is missing, over the time
of both steps, is a velocity; its sum over a second, by the largest velocity that the run took up, was 0.3 to 8 times
the error of the velocities, against a quarter of the step, in runs of wheelsets and cars from 1e-4 to 1 of it.
"""

import numpy as np

from models.core.errors import RunFailed

ALLOWED = 0.08
"""Share of the velocities that may be missing in any second."""
NEGLIGIBLE_VELOCITY, ROUNDING = 1e-6, 1e-9
"""m/s of the largest mass, and share of the velocities at the start, below which a motion is none."""


def missed_velocity_share(positions: np.ndarray, rates: np.ndarray, step: float, mass: np.ndarray) -> tuple[float, int]:
    """Largest share of the velocities that two-step ways miss within a second, and the row where that second begins.

    positions, rates (m, n) at every step (s); mass (n, n) or its diagonal (n,) weighs one coordinate against another.
    """
    if len(positions) < 3:
        return 0.0, 0
    mass = mass if np.ndim(mass) == 2 else np.diag(mass)
    root = np.linalg.cholesky(mass)
    way = step / 3.0 * (rates[:-2] + 4.0 * rates[1:-1] + rates[2:])
    each = np.linalg.norm((positions[2:] - positions[:-2] - way) @ root, axis=1) / (2.0 * step)
    whole = np.linalg.norm((rates - rates[0]) @ root, axis=1).max()
    whole = max(whole, ROUNDING * np.linalg.norm(rates[0] @ root), NEGLIGIBLE_VELOCITY * np.sqrt(mass.diagonal().max()))
    sums = np.concatenate(([0.0], np.cumsum(each)))
    window = min(len(each), max(1, round(1.0 / step)))
    within = sums[window:] - sums[:-window]
    return float(within.max() / whole), int(within.argmax())


def check_resolved(engine: str, times: np.ndarray, positions: np.ndarray, rates: np.ndarray, mass: np.ndarray) -> None:
    """Raise RunFailed for a run whose steps were too long for its motion; arguments as ``missing``, times (m,) in s."""
    if len(times) < 3:
        return
    step = float(times[1] - times[0])
    share, row = missed_velocity_share(positions, rates, step, mass)
    if not share <= ALLOWED:
        raise RunFailed(
            engine,
            f"steps of {step:g} s are too long for this motion: {share:.2g} of its velocity goes "
            "unseen between them within a second; use a smaller step",
            float(times[row]),
        )
