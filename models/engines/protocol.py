"""Engine protocol of the pitch plane, the scenes that it refuses, and the checks that every run of every system passes.

An engine is a module with ``build(assembly, settings) -> Model``.
"""

from collections.abc import Callable
from importlib import import_module

import numpy as np

from models.core.errors import Refused, RunFailed
from models.core.resolved import check_resolved
from models.core.signals import Signal
from models.core.steps import dividing_step, step_divides
from models.engines.assembly import Assembly, Settings
from models.engines.catalogue import CATALOGUE, OUTSIDE_CLASSES, UNAVAILABLE_INTEGRATORS, Integrator
from models.engines.model import Model
from models.engines.stability import check_step

BALANCE_ROWS, BALANCE_START, BALANCE_BOUND = 60, 50, 0.05
"""Number of rows at which a multiplier is checked, number of rows at the start that may ring, and the accepted relative
rms error.

Sixty rows cost 5 ms. Clean data are met to 1e-4; white noise on the data that is differentiated over a
step of one sample comes out 10 times too large, a constant wrong multiplier 0.2 to 1 times."""
SIZE_BOUND = 1e4
"""Largest magnitude of a state (m, rad, m/s, rad/s) of a vehicle; 1e303 is finite, too."""


def build(engine: str, assembly: Assembly, run_settings: Settings) -> Model:
    """Model of an assembly in an engine by name; raises Refused where the engine would compute wrong results."""
    check_assembly(engine, assembly, run_settings)
    return build_unchecked(engine, assembly, run_settings)


def build_unchecked(engine: str, assembly: Assembly, run_settings: Settings) -> Model:
    """Model of an assembly in an engine, without a check that the engine computes right results."""
    if engine in OUTSIDE_CLASSES:
        return import_module("models.engines.outside").build(engine, assembly, run_settings)
    return import_module(f"models.engines.{engine}").build(assembly, run_settings)


def check_assembly(engine: str, assembly: Assembly, run_settings: Settings) -> None:
    """Raise Refused for combinations of input, integrator and step with which the engine would compute wrong
    results."""
    integrator = CATALOGUE[engine][run_settings.integrator]
    if (engine, run_settings.integrator) in UNAVAILABLE_INTEGRATORS:
        raise Refused(engine, UNAVAILABLE_INTEGRATORS[engine, run_settings.integrator])
    _refuse_uneven_step(engine, run_settings.step, "the duration", run_settings.duration)
    if assembly.guided and not integrator.constraints:
        right = (name for name, known in CATALOGUE[engine].items() if known.constraints)
        raise Refused(
            engine,
            f"{run_settings.integrator} does not solve for a prescribed pitch: its enforced moment would "
            f"be wrong without a word; use {' or '.join(right)}",
        )
    if assembly.guided and run_settings.integrator == "GeneralizedAlpha" and run_settings.spectral_radius > 0.95:
        raise Refused(
            engine,
            f"a spectral radius of {run_settings.spectral_radius} never damps the error of the enforced "
            "moment at the start; use at most 0.95 (0.6 is recommended)",
        )
    for signal in (assembly.input, assembly.moment):
        if signal is not None:
            _check_reading(engine, integrator, run_settings, signal)
    check_step(engine, assembly, run_settings)


def _check_reading(engine: str, integrator: Integrator, run_settings: Settings, input_signal: Signal) -> None:
    """Raise Refused if an integrator reads the input signal at wrong times or may miss details of the signal."""
    if input_signal.period is not None:
        _check_sampling(engine, integrator, run_settings, input_signal.period, input_signal.held)
    if integrator.adaptive and engine != "reference" and run_settings.step > input_signal.resolution:
        raise Refused(
            engine,
            f"{run_settings.integrator} may take steps of {run_settings.step:g} s and miss details of the "
            f"input, which are {input_signal.resolution:.3g} s long: use a step of at most that",
        )


def _check_sampling(
    engine: str, integrator: Integrator, run_settings: Settings, sampling_period: float, is_held: bool
) -> None:
    """Raise Refused if an integrator cannot read a signal of this sampling period (s), ``is_held`` over it or not."""
    if integrator.adaptive and engine != "reference":
        if is_held:
            raise Refused(
                engine,
                f"{run_settings.integrator} picks its own steps and cannot hold samples over them; "
                "use a fixed-step integrator",
            )
        return
    if is_held and not integrator.holds:
        raise Refused(
            engine,
            f"{run_settings.integrator} reads a held sample half a step late, which costs it its order: "
            "use interpolation = 'linear' or 'smooth', or an explicit Runge-Kutta integrator",
        )
    if not integrator.adaptive:
        _refuse_uneven_step(engine, run_settings.step, "the sampling period", sampling_period)


def _refuse_uneven_step(engine: str, time_step: float, length_name: str, time_length: float) -> None:
    """Raise Refused if the step (s) does not divide a length of time (s)."""
    if not step_divides(time_step, time_length):
        raise Refused(
            engine,
            f"the step {time_step:g} s does not divide {length_name} {time_length:g} s; "
            f"use for example {dividing_step(time_step, time_length)} s",
        )


def settings_of(engine: str, run_settings: Settings | None) -> Settings:
    """The settings of a run; RunFailed where the model was built without settings."""
    if run_settings is None:
        raise RunFailed(engine, "the model was built without settings: it knows no step and no duration")
    return run_settings


def check_trajectory(
    engine: str,
    times: np.ndarray,
    states: np.ndarray,
    run_duration: float,
    engine_note: str = "",
    enforcing_forces: np.ndarray | None = None,
) -> None:
    """Raise RunFailed unless the run is finite, of sane size and complete in time.

    times (n,), states (n, anything), duration in s; ``engine_note`` is what the engine itself reported;
    ``enforcing_forces`` (n, anything) in N or N m, where there is some, must be finite."""
    if len(times) == 0 or len(times) != len(states):
        raise RunFailed(engine, f"gave {len(states)} states at {len(times)} times{engine_note}")
    if not _is_sane(times, states, enforcing_forces):
        _raise_failure(engine, times, states, engine_note, enforcing_forces)
    if engine_note:
        raise RunFailed(engine, engine_note.lstrip("; "), times[-1], states[-1])
    if abs(times[-1] - run_duration) > 1e-9 * max(1.0, run_duration):
        raise RunFailed(engine, f"stopped at {times[-1]:.6g} s instead of {run_duration:.6g} s", times[-1], states[-1])


def _is_sane(times: np.ndarray, states: np.ndarray, enforcing_forces: np.ndarray | None) -> bool:
    """Whether times, states and enforced forces are all finite and of sane size. Written to be fast, for ten thousand
    runs; NaN fails every comparison."""
    sane = states.max() < SIZE_BOUND and states.min() > -SIZE_BOUND
    forward = np.isfinite(times).all() and (np.diff(times) > 0).all()
    return bool(sane and forward and (enforcing_forces is None or np.isfinite(enforcing_forces).all()))


def _raise_failure(
    engine: str, times: np.ndarray, states: np.ndarray, engine_note: str, enforcing_forces: np.ndarray | None
) -> None:
    """Raise RunFailed for a run that is not sane, with the state before the first wrong state."""
    finite = np.isfinite(states).all(axis=1) & (
        True if enforcing_forces is None else np.isfinite(enforcing_forces).all(axis=1)
    )
    sane = finite & (np.abs(np.where(np.isfinite(states), states, 0)) < SIZE_BOUND).all(axis=1)
    forward = np.concatenate(([True], np.diff(times) > 0))
    first = np.flatnonzero(~(sane & forward & np.isfinite(times)))[0]
    grown = "time ran backwards" if sane[first] else f"the state grew beyond {SIZE_BOUND:g}: no vehicle any more"
    reason, last = grown if finite[first] else "the state became infinite or not a number", first - 1
    raise RunFailed(
        engine, reason + engine_note, times[last] if last >= 0 else None, states[last] if last >= 0 else None
    )


def check_landings(
    engine: str, assembly: Assembly, run_settings: Settings, times: np.ndarray, states: np.ndarray
) -> None:
    """Raise RunFailed where fixed steps were too long for the landings of tyres that can lift off. A step that is
    stable on the road may still jump over a landing.

    times (n,) in s, states (n, 8); nothing is looked at where tyres cannot lift.
    """
    lifts = any(tyre.pushes_only for tyre in assembly.vehicle.tyres)
    integrator = CATALOGUE[engine][run_settings.integrator]
    if not lifts or integrator.adaptive:
        return
    p = assembly.parameters
    mass = np.array([p.m1, p.m2, p.m3, p.I])
    check_resolved(engine, times, states[:, :4], states[:, 4:], mass, integrator.order)


def check_balance(
    engine: str,
    times: np.ndarray,
    enforcing_forces: np.ndarray,
    balance_at_row: Callable[[int], tuple[np.ndarray, np.ndarray]],
) -> None:
    """Raise RunFailed unless multipliers (n, 1 or 2) agree with the balance of moments, the last column, and of forces.

    ``balance_at_row`` gives, for a row, the required force and moment and the inertia terms m3 z3'' and I beta'' (N, N
    m), which are the scale of the error where little is required. A solver can follow a prescribed motion perfectly
    with a multiplier that stays wrong."""
    rows = np.unique(np.linspace(min(BALANCE_START, len(times) - 1), len(times) - 1, BALANCE_ROWS).astype(int))
    wanted, inertia = (np.array(part) for part in zip(*(balance_at_row(int(row)) for row in rows), strict=True))
    size = np.sqrt(np.maximum(np.mean(wanted**2, axis=0), np.mean(inertia**2, axis=0)))
    off = np.sqrt(np.mean((enforcing_forces[rows] - wanted) ** 2, axis=0))
    for i in np.flatnonzero(~(off <= BALANCE_BOUND * size + 1e-3))[::-1]:
        what, unit, data = ("moment", "N m", "pitch") if i == len(size) - 1 else ("force", "N", "heave")
        raise RunFailed(
            engine,
            f"the enforced {what} misses the balance of {what}s by {off[i]:.3g} {unit} (rms) of "
            f"{size[i]:.3g}: the {data} is too rough for this step; smooth its data "
            "(bandwidth) or shorten it",
        )
