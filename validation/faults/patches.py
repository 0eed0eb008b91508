"""Patches that plant a fault in an engine's adapter or in the reference's equations, within a ``with`` block.

A patch is called once for each built model and returns a context that can be entered repeatedly.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from types import FunctionType
from typing import Any
from unittest.mock import patch

import numpy as np

from models.vehicles import pitch_plane_equations as equations

Context = Callable[[], AbstractContextManager[Any]]
Patch = Callable[[], Context]
FrontRearForces = tuple[float, float]
"""Forces (N) at the front and the rear wheel or strut."""


def no_fault() -> Context:
    """Patch that plants no fault."""
    return nullcontext


def attribute_patch(attribute_path: str, change_attribute: Callable[[Any], Any]) -> Patch:
    """Patch that replaces ``module:object.name`` by change_attribute(original)."""

    def prepare() -> Context:
        owner, name = _owner_and_name(attribute_path)
        return lambda: patch.object(owner, name, change_attribute(getattr(owner, name)))

    return prepare


def _owner_and_name(attribute_path: str) -> tuple[Any, str]:
    from importlib import import_module

    module, _, qualified_name = attribute_path.partition(":")
    *parents, name = qualified_name.split(".")
    owner: Any = import_module(module)
    for parent in parents:
        owner = getattr(owner, parent)
    return owner, name


def with_globals(copied_function: Callable[..., Any], **other_globals: Any) -> Callable[..., Any]:
    """A copy of a function in which some of its module's global names are replaced. Raises AttributeError for a name
    that the module does not have."""
    if unknown := other_globals.keys() - copied_function.__globals__.keys():
        raise AttributeError(f"{copied_function.__module__} has no {', '.join(sorted(unknown))}")
    return FunctionType(copied_function.__code__, copied_function.__globals__ | other_globals, copied_function.__name__)


# Exudyn


def sample_of_step_end(original_function: Any) -> Any:
    """Fault: with samples that are constant over a step, a step reads the sample at its end."""

    def advance(clock: Any, mbs: Any, t: float) -> bool:
        clock.step = min(round(t * clock.per_time / 2), len(clock.steps[0]) - 1)
        return True

    return advance


def truncated_time(original_function: Any) -> Any:
    """Fault: the row number in the table of input samples at half steps is truncated instead of rounded."""

    def reader(clock: Any, column_number: int, time_scale: float) -> Any:
        if not clock.table:
            return original_function(clock, column_number, time_scale)
        return lambda mbs, t, load: time_scale * clock.table[column_number][int(t * clock.per_time)]

    return reader


def reset_accelerations(original_function: Any) -> Any:
    """Fault: a constrained run starts with accelerations that Exudyn computes without the acceleration of the
    prescribed motion."""

    def start(model: Any, options: Any) -> None:
        original_function(model, options)
        options.timeIntegration.generalizedAlpha.computeInitialAccelerations = True
        options.timeIntegration.generalizedAlpha.resetAccelerations = True

    return start


# MuJoCo


def weightless_wheel(original_function: Any) -> Any:
    """Fault: the front wheel has no weight."""

    def spec(*arguments: Any) -> Any:
        built = original_function(*arguments)
        built.body("wheel1").gravcomp = 1.0
        return built

    return spec


def turning_reference(original_function: Any) -> Any:
    """Fault: struts are measured along the chassis' axis, because the reference site lies on the rotating body."""

    def suspension(mujoco_spec: Any, vehicle: Any, strut: Any, joints: Any) -> None:
        original_function(mujoco_spec, vehicle, strut, joints)
        actuator = mujoco_spec.actuator(strut.name)
        actuator.target, actuator.refsite = actuator.refsite, actuator.target

    return suspension


def reversed_pitch_row(original_function: Any) -> Any:
    """Fault: with a prescribed pitch, the chassis' row of eq. (39) has the wrong sign."""

    def guidance(*arguments: Any) -> np.ndarray:
        forces = original_function(*arguments)
        forces[:, 2:] *= -1.0
        return forces

    return guidance


def callback_not_installed(original_function: Any) -> Any:
    """Fault: the context that installs a callback does not install it."""
    return lambda law: nullcontext()


def negated_result(original_function: Any) -> Any:
    """Fault: a method's result has the opposite sign."""

    def method(*arguments: Any) -> Any:
        answer = original_function(*arguments)
        return None if answer is None else -answer

    return method


# the equations


def rewritten_reference(**replaced_functions: Callable[[], Any]) -> Patch:
    """Patch that runs the reference without compilation, with some functions of its equations replaced."""

    def prepare() -> Context:
        from models.engines import reference

        changes = {
            reference: {"_FIXED": {}, "_SINGLE": {}, "njit": lambda **options: lambda function: function},
            equations: {name: function() for name, function in replaced_functions.items()},
        }
        return lambda: _patched_functions(changes)

    return prepare


@contextmanager
def _patched_functions(replacements_by_module: dict[Any, dict[str, Any]]) -> Iterator[None]:
    with ExitStack() as stack:
        for module, replaced in replacements_by_module.items():
            for name, value in replaced.items():
                stack.enter_context(patch.object(module, name, value))
        yield


def moment_without_cosine() -> Any:
    """Fault: the moment is b f3 - a f4 instead of cos(beta) (b f3 - a f4)."""
    original = equations.newton_euler

    def newton_euler(y: Any, wheels: FrontRearForces, struts: FrontRearForces, cosine: float, p: Any, dy: Any) -> None:
        original(y, wheels, struts, 1.0, p, dy)

    return newton_euler


def no_reaction() -> Any:
    """Fault: the suspension force acts on the chassis, but not on the front wheel."""
    original = equations.newton_euler

    def newton_euler(y: Any, wheels: FrontRearForces, struts: FrontRearForces, cosine: float, p: Any, dy: Any) -> None:
        original(y, wheels, struts, cosine, p, dy)
        dy[4] -= struts[0] / p[2]

    return newton_euler


def damper_without_cosine() -> Any:
    """Fault: dampers use b beta' instead of b beta' cos(beta)."""
    original = equations.suspension_forces
    return lambda y, p, sine, cosine: original(y, p, sine, 1.0)


def stale_state() -> Any:
    """Fault: suspension forces are computed from the state of the previous evaluation."""
    original, states_seen = equations.suspension_forces, []

    def suspension(y: Any, p: Any, sine: float, cosine: float) -> Any:
        states_seen.append(y.copy())
        old = states_seen[-2] if len(states_seen) > 1 else y
        del states_seen[:-1]
        return original(old, p, math.sin(old[3]), math.cos(old[3]))

    return suspension
