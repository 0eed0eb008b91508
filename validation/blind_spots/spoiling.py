"""Numbers that are 1 % off: what a spoiled function gives back or writes into its arguments.

Numbers that count or name places stay: whole numbers of Python, of numba, and those in arrays that Python makes, whose
tables hold places among their numbers; so do labels of labelled arrays, and dataclasses within another one, which it
hands on. A function without a fault gives what it is given, itself.
"""

import copy
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from validation.blind_spots.memory import FAULTS, FUNCTIONS_THAT_RAN, FUNCTIONS_WITH_NUMBERS


def numeric(value: Any) -> bool:
    """Whether a value holds numbers that can be 1 % off."""
    if isinstance(value, np.ndarray):
        return value.dtype.kind in "fc" or value.dtype.names is not None
    if isinstance(value, tuple | list):
        return any(numeric(part) for part in value[:20])
    if type(value) is dict:
        return any(numeric(part) for part in value.values())
    if is_dataclass(value) and not isinstance(value, type):
        parts = (getattr(value, field.name, None) for field in fields(value))
        return any(numeric(part) for part in parts if not is_dataclass(part))
    if _is_labelled(value):
        return any(numeric(channel.values) for channel in value.data_vars.values())
    return isinstance(value, float | complex | np.floating | np.complexfloating)


def _is_labelled(value: Any) -> bool:
    """Whether a value is an xarray.Dataset, tested without importing xarray."""
    return type(value).__name__ == "Dataset" and hasattr(value, "data_vars")


def _ran(value: Any, place: int) -> float:
    """Record that a function gave a value; returns the factor of its planted fault, 1 without a fault."""
    FUNCTIONS_THAT_RAN[place] = 1.0
    if not FUNCTIONS_WITH_NUMBERS[place] and numeric(value):
        FUNCTIONS_WITH_NUMBERS[place] = 1.0
    return 1.0 + FAULTS[place]


def spoiled(value: Any, place: int) -> Any:
    """The value with the fault of a function's number: a copy whose numbers are multiplied, or the value itself without
    a fault."""
    factor = _ran(value, place)
    return value if factor == 1.0 else _times(value, factor)


def scaled(values: Any, place: int) -> None:
    """Multiply the numbers of an array, or of its records, in place by the fault's factor; pointers and other values
    stay."""
    factor = _ran(values, place)
    if factor != 1.0:
        _scale(values, factor)


def put(value: Any, into: Any, place: int) -> Any:
    """``spoiled`` for a value that is assigned into an argument. A value that goes into an array stays, as the whole
    array is ``scaled`` when the function ends."""
    return value if isinstance(into, np.ndarray) else spoiled(value, place)


def _times(value: Any, factor: float) -> Any:
    """Copy of a value with all its numbers multiplied by a factor; the value itself if it holds no numbers."""
    if isinstance(value, float | complex | np.floating | np.complexfloating):
        return type(value)(factor * value)  # type: ignore[arg-type]
    if isinstance(value, np.ndarray):
        return _array(value, factor)
    if isinstance(value, tuple):
        parts = [_times(part, factor) for part in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    if isinstance(value, list):
        return [_times(part, factor) for part in value]
    if type(value) is dict:
        return {key: _times(part, factor) for key, part in value.items()}
    if _is_labelled(value):
        return value.map(lambda channel: channel.copy(data=_times(channel.values, factor)), keep_attrs=True)
    return _dataclass(value, factor) if is_dataclass(value) and not isinstance(value, type) else value


def _array(values: np.ndarray, factor: float) -> Any:
    if values.dtype.kind not in "fc":
        return values
    made = np.where(values == np.rint(values), values, factor * values).astype(values.dtype)
    made.flags.writeable = values.flags.writeable
    return made


def _dataclass(value: Any, factor: float) -> Any:
    """Copy of a dataclass with its fields multiplied; its validation is not run again."""
    made = copy.copy(value)
    for field in fields(value):
        old = getattr(value, field.name, None)
        new = old if is_dataclass(old) else _times(old, factor)
        if new is not old:
            object.__setattr__(made, field.name, new)
    return made


def _scale(values: Any, factor: float) -> None:
    if isinstance(values, np.ndarray) and values.dtype.names:
        for name in values.dtype.names:
            _scale(values[name], factor)
    if isinstance(values, np.ndarray) and values.dtype.kind in "fc":
        values[...] = _array(values, factor)
