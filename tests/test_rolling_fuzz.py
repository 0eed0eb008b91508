"""Random wheelsets from random states: three implementations agree, or say that they fail."""

import numpy as np
import pytest

from models.core.errors import InputError, RunFailed
from models.rail import equations as eq
from models.rail.wheelset import CHOSEN_WHEELSET
from validation.hard_cases.rolling import ENGINE_KINDS

SPREAD = np.array([2e-3, 1e-4, 2e-4, 5e-3, 1.0, 0.05, 0.01, 0.05, 0.05, 1.0])
SPREADABLE = (
    "mass",
    "spin_inertia",
    "yaw_inertia",
    "radius",
    "conicity",
    "head_radius",
    "stiffness_x",
    "stiffness_y",
    "stiffness_z",
    "damping_x",
    "damping_y",
    "damping_z",
    "friction",
    "flange_clearance",
)
SAME, NUDGE, SENSITIVE = 1e-8, 1e-13, 100.0
"""Largest difference between the engines, SI, but where wheels that bounce make more of rounding: the written equations
do so too with a start moved by NUDGE of itself, and engines may differ by so many times that. The written equations
count the spin about the axle itself, engines that against axes that do not spin: RK4 makes another error of each, so
that these may differ by what halving the step does.
"""


def drawn(draw):
    """A wheelset, its speed, law, step and the move of its start."""
    values = {name: getattr(CHOSEN_WHEELSET, name) * 2.0 ** draw.uniform(-2.0, 2.0) for name in SPREADABLE}
    values["load"] = values["mass"] * 9.81 + 10.0 ** draw.uniform(2.0, 5.0)
    speed = 10.0 ** draw.uniform(0.5, 2.0) * draw.choice((-1.0, 1.0))
    step = float(draw.choice((1e-4, 5e-4)))
    return (
        CHOSEN_WHEELSET.changed(**values),
        speed,
        str(draw.choice(("linear", "fastsim"))),
        step,
        draw.normal(size=eq.STATE_COUNT),
    )


def ended(kind, wheelset, speed, law, step, moved, parts=1, nudge=0.0):
    """State after 0.1 s, None where that is refused or fails; parts : of each step; nudge : of the start."""
    try:
        own = kind(wheelset, speed, law, 7)
        return own.run((own.rest + SPREAD * moved) * (1.0 + nudge), 0.1, step / parts).states[-1]
    except (InputError, RunFailed):
        return None


def distance(one, other):
    """Largest difference of two ends; infinite where the first failed, for then the run is at its very limit."""
    return np.inf if one is None else np.abs(one - other).max()


@pytest.mark.parametrize("count", [pytest.param(200, marks=pytest.mark.full)])
def test_random_wheelsets_agree_or_fail_aloud(count):
    draw, done = np.random.default_rng(6), 0
    for i in range(count):
        given = drawn(draw)
        ends = [end for kind in ENGINE_KINDS.values() if (end := ended(kind, *given)) is not None]
        assert np.isfinite(ends).all(), i
        assert len(ends) in (0, len(ENGINE_KINDS)), (i, given)
        if not ends:
            continue
        done, (written, *engines) = done + 1, ends
        if (apart := np.ptp(engines, axis=0).max()) > SAME:
            nudged = [ended(ENGINE_KINDS["reference"], *given, nudge=nudge) for nudge in (-NUDGE, NUDGE)]
            assert apart < SENSITIVE * max(distance(end, written) for end in nudged), (i, given)
        if (apart := np.abs(written - engines[0]).max()) > SAME:
            half = ended(ENGINE_KINDS["reference"], *given, parts=2)
            assert apart < distance(half, written), (i, given)
    assert done > count / 3
