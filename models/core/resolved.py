"""Check from the states of a run alone whether its steps were short enough to resolve the motion.

Simpson's rule over two steps gives the way that the rates make: where the positions went another way, the motion bent
within a step, at a stop that was hit, a stick that let go, a swing that took few steps. What is missing, over the time
of both steps, is a velocity; its sum over a second, by the largest velocity that the run took up, was 0.3 to 8 times
the error of the velocities, against a quarter of the step, in runs of wheelsets and cars from 1e-4 to 1 of it.

Euler's rules go the whole step at the rate of one of its ends: taken at that end, the rates would miss half of every
change of velocity, however short the steps are. That rate is the one of the middle of the step, to the second order.
Taken so, it tells what happened within steps, not the error of the first order: runs in longer steps tell that.
"""

import numpy as np

from models.core.errors import RunFailed

ALLOWED_MISSING_SHARE = 0.08
"""Largest allowed share of the velocity that goes unseen between steps within any second."""
NEGLIGIBLE_VELOCITY, ROUNDING_VELOCITY_SHARE = 1e-6, 1e-9
"""Velocity (m/s, of the largest mass), and share of the velocities at the start, below which a motion is negligible."""


def missed_velocity_share(
    positions: np.ndarray, rates: np.ndarray, time_step: float, masses: np.ndarray
) -> tuple[float, int]:
    """Largest velocity error within one second, relative to the velocity change of the run, and the row where that
    second begins. The error compares displacements over two steps with the integral of the rates by Simpson's rule.

    positions, rates (m, n) at every step (s); mass (n, n) or its diagonal (n,) weighs one coordinate against another.
    """
    if len(positions) < 3:
        return 0.0, 0
    masses = masses if np.ndim(masses) == 2 else np.diag(masses)
    root = np.linalg.cholesky(masses)
    displacement = time_step / 3.0 * (rates[:-2] + 4.0 * rates[1:-1] + rates[2:])
    errors_of_step = np.linalg.norm((positions[2:] - positions[:-2] - displacement) @ root, axis=1) / (2.0 * time_step)
    velocity_scale = np.linalg.norm((rates - rates[0]) @ root, axis=1).max()
    velocity_scale = max(
        velocity_scale,
        ROUNDING_VELOCITY_SHARE * np.linalg.norm(rates[0] @ root),
        NEGLIGIBLE_VELOCITY * np.sqrt(masses.diagonal().max()),
    )
    sums = np.concatenate(([0.0], np.cumsum(errors_of_step)))
    window = min(len(errors_of_step), max(1, round(1.0 / time_step)))
    within = sums[window:] - sums[:-window]
    return float(within.max() / velocity_scale), int(within.argmax())


def missed_velocity_share_first_order(
    positions: np.ndarray, rates: np.ndarray, time_step: float, masses: np.ndarray
) -> tuple[float, int]:
    """``missed_velocity_share`` for first-order methods: the smallest of three results, in which the rates belong to
    the ends of the steps, or to the middle of the step after or before."""
    middle = (rates[1:] + rates[:-1]) / 2.0
    variants = ((positions, rates), (positions[:-1], middle), (positions[1:], middle))
    return min(
        missed_velocity_share(positions_at, velocities, time_step, masses) for positions_at, velocities in variants
    )


def check_resolved(
    engine: str, times: np.ndarray, positions: np.ndarray, rates: np.ndarray, masses: np.ndarray, method_order: int = 2
) -> None:
    """Raise RunFailed if the steps of a run were too long to resolve its motion.

    times (m,) in s; method_order : of the method that went the steps; the others as in ``missed_velocity_share``.
    """
    if len(times) < 3:
        return
    step = float(times[1] - times[0])
    missed = missed_velocity_share_first_order if method_order == 1 else missed_velocity_share
    share, row = missed(positions, rates, step, masses)
    if not share <= ALLOWED_MISSING_SHARE:
        raise RunFailed(
            engine,
            f"steps of {step:g} s are too long for this motion: {share:.2g} of its velocity goes "
            "unseen between them within a second; use a smaller step",
            float(times[row]),
        )
