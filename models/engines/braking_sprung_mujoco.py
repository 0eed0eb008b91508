"""Braked vehicle on its suspension in MuJoCo, compiled as a whole: steps, and generators of samples."""

from collections.abc import Callable
from functools import cache
from typing import Any

from models.brake import samples
from models.brake.sprung_step import compiled
from models.engines.mujoco_native import accelerate, march

advance = compiled("in_mujoco", accelerate=accelerate, march=march)
samples_by_steps = samples.compiled_samples(advance, "by_steps_in_mujoco")


@cache
def lagging() -> tuple[Callable[..., Any], Callable[..., Any]]:
    """The compiled functions that advance the vehicle and that generate samples, with tyres whose slip lags."""
    from models.brake.sprung_relaxation import advance_contact_lag

    go = compiled("lagging_in_mujoco", accelerate=accelerate, march=march, relax=advance_contact_lag)
    return go, samples.compiled_samples(go, "by_lagging_steps_in_mujoco")
