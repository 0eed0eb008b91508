"""Planted faults in Python functions: their results, or what they write into arguments, multiplied by 1.01.

Counts and indices are not changed: integers of Python and numba, and whole numbers in arrays made by Python, whose
tables contain indices; nor are labels of labelled arrays, and dataclasses nested in another dataclass. Without a fault
a value is returned itself, not a copy.
"""

import copy
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from validation.blind_spots.memory import FAULTS, FUNCTIONS_THAT_RAN, FUNCTIONS_WITH_NUMBERS


def has_numbers(value: Any) -> bool:
    """Whether a value contains floating-point numbers that a fault can change."""
    if isinstance(value, np.ndarray):
        return value.dtype.kind in "fc" or value.dtype.names is not None
    if isinstance(value, tuple | list):
        return any(has_numbers(part) for part in value[:20])
    if type(value) is dict:
        return any(has_numbers(part) for part in value.values())
    if is_dataclass(value) and not isinstance(value, type):
        parts = (getattr(value, field.name, None) for field in fields(value))
        return any(has_numbers(part) for part in parts if not is_dataclass(part))
    if _is_labelled(value):
        return any(has_numbers(channel.values) for channel in value.data_vars.values())
    return isinstance(value, float | complex | np.floating | np.complexfloating)


def _is_labelled(value: Any) -> bool:
    """Whether a value is an xarray.Dataset, tested without importing xarray."""
    return type(value).__name__ == "Dataset" and hasattr(value, "data_vars")


def _mark_and_factor(value: Any, function_number: int) -> float:
    """Record that a function ran, and whether its value contains numbers. Returns the factor of its planted fault, 1
    without a fault."""
    FUNCTIONS_THAT_RAN[function_number] = 1.0
    if not FUNCTIONS_WITH_NUMBERS[function_number] and has_numbers(value):
        FUNCTIONS_WITH_NUMBERS[function_number] = 1.0
    return 1.0 + FAULTS[function_number]


def spoiled(value: Any, function_number: int) -> Any:
    """Returns a copy of a value with its numbers multiplied by the fault's factor of function ``function_number``, or
    the value itself without a fault."""
    factor = _mark_and_factor(value, function_number)
    return value if factor == 1.0 else _multiplied(value, factor)


def scaled(values: Any, function_number: int) -> None:
    """Multiply the numbers of an array, or of its records, in place by the fault's factor of function
    ``function_number``. Pointers and other values stay unchanged."""
    factor = _mark_and_factor(values, function_number)
    if factor != 1.0:
        _multiply_in_place(values, factor)


def put(value: Any, target_argument: Any, function_number: int) -> Any:
    """Returns a value that is to be assigned into an argument ``target_argument``, multiplied by the fault's factor. A
    value for an array stays unchanged, as the whole array is ``scaled`` when the function ends."""
    return value if isinstance(target_argument, np.ndarray) else spoiled(value, function_number)


def _multiplied(value: Any, fault_factor: float) -> Any:
    """Copy of a value with all its numbers multiplied by a factor; the value itself if it contains no numbers."""
    if isinstance(value, float | complex | np.floating | np.complexfloating):
        return type(value)(fault_factor * value)  # type: ignore[arg-type]
    if isinstance(value, np.ndarray):
        return _multiplied_array(value, fault_factor)
    if isinstance(value, tuple):
        parts = [_multiplied(part, fault_factor) for part in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    if isinstance(value, list):
        return [_multiplied(part, fault_factor) for part in value]
    if type(value) is dict:
        return {key: _multiplied(part, fault_factor) for key, part in value.items()}
    if _is_labelled(value):
        return value.map(lambda channel: channel.copy(data=_multiplied(channel.values, fault_factor)), keep_attrs=True)
    return _multiplied_dataclass(value, fault_factor) if is_dataclass(value) and not isinstance(value, type) else value


def _multiplied_array(values: np.ndarray, fault_factor: float) -> Any:
    if values.dtype.kind not in "fc":
        return values
    made = np.where(values == np.rint(values), values, fault_factor * values).astype(values.dtype)
    made.flags.writeable = values.flags.writeable
    return made


def _multiplied_dataclass(value: Any, fault_factor: float) -> Any:
    """Copy of a dataclass with the numbers of its fields multiplied by a factor; its validation is not run again."""
    made = copy.copy(value)
    for field in fields(value):
        old = getattr(value, field.name, None)
        new = old if is_dataclass(old) else _multiplied(old, fault_factor)
        if new is not old:
            object.__setattr__(made, field.name, new)
    return made


def _multiply_in_place(values: Any, fault_factor: float) -> None:
    if isinstance(values, np.ndarray) and values.dtype.names:
        for name in values.dtype.names:
            _multiply_in_place(values[name], fault_factor)
    if isinstance(values, np.ndarray) and values.dtype.kind in "fc":
        values[...] = _multiplied_array(values, fault_factor)
