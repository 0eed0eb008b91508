"""A run of an engine from outside the tree, held against the equations of the reference.

Nothing is known of such an engine but the order that it states. A run that is further from the reference than that
order and step, or its tolerance, can explain is a failed run; any other run says how far it is.
"""

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from models.core.errors import InputError, RunFailed
from models.engines.assembly import Assembly
from models.engines.catalogue import CATALOGUE, OUTSIDE
from models.engines.protocol import Settings, Trajectory, build

TIGHT = 1e-10
"""Tolerance of the reference's own run."""
MARGIN, FLOOR, CEILING = 100.0, 1e-5, 0.1
"""A run is refused beyond so many times the expected error, of the largest motion; but not below the first share of
that motion (between their own steps, methods interpolate to 3e-6), and always beyond the second."""


def beside_reference(engine: str, assembly: Assembly, settings: Settings, run: Trajectory) -> str:
    """Say how far a run is from the reference; raises RunFailed where its order and step cannot explain that."""
    try:
        truth = _of_reference(assembly, replace(settings, integrator="DOP853", tolerance=TIGHT))
    except (InputError, RunFailed) as error:
        return f"nothing was compared with it: the reference gives no run of this scene ({error})"
    gap, where = relative_gap(run, truth)
    allowed = min(max(MARGIN * _expected(engine, assembly, settings, truth), FLOOR), CEILING)
    if not gap <= allowed:
        raise RunFailed(
            engine,
            f"its states are {100 * gap:.3g} % of the largest motion away from the reference at "
            f"{where:.3g} s, where its order and step explain at most {100 * allowed:.3g} %: "
            f"`twinrig validate --engine {engine}` says what is wrong",
        )
    return f"states within {gap:.1e} of the largest motion from the reference"


def relative_gap(run: Trajectory, truth: Trajectory) -> tuple[float, float]:
    """Largest distance of the states (n, 8) by the largest motion in truth of the same kind, and its time in s.

    Kinds are heights, pitch, and the rates of each; where nothing moves, a millimetre or milliradian counts.
    """
    states = CubicSpline(truth.times, truth.states)(run.times)
    motion = np.abs(truth.states - truth.states[0]).max(axis=0)
    sizes = np.concatenate([np.full(3, motion[:3].max()), motion[3:4], np.full(3, motion[4:7].max()), motion[7:]])
    gaps = (np.abs(run.states - states) / np.maximum(sizes, 1e-3)).max(axis=1)
    worst = int(gaps.argmax())
    return float(gaps[worst]), float(run.times[worst])


def _of_reference(assembly: Assembly, settings: Settings) -> Trajectory:
    return build("reference", assembly, settings).run()


def _expected(engine: str, assembly: Assembly, settings: Settings, truth: Trajectory) -> float:
    """Relative error that the stated order and step make likely; of an adaptive method, its tolerance."""
    if getattr(OUTSIDE[engine], "adaptive", False):
        return settings.tolerance
    try:
        gap, _ = relative_gap(_of_reference(assembly, replace(settings, integrator="RK4")), truth)
    except (InputError, RunFailed):
        return CEILING  # too coarse for RK4: only what no step explains is told
    return float(gap ** (min(CATALOGUE[engine][settings.integrator].order, 4) / 4))
