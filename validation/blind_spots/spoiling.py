"""Numbers that are 1 % off: what a spoiled function gives back or writes into its arguments.

Numbers that count or name places stay: whole numbers of Python, of numba, and those in arrays that Python makes, whose
tables hold places among their numbers.
"""

import copy
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from numba import types
from numba.core.targetconfig import ConfigStack
from numba.extending import overload

FACTOR = 1.01


def spoiled(value: Any) -> Any:
    """A new value whose numbers are 1 % off; the value itself where it holds none."""
    if isinstance(value, float | complex | np.floating | np.complexfloating):
        return type(value)(FACTOR * value)  # type: ignore[arg-type]
    if isinstance(value, np.ndarray):
        return _array(value)
    if isinstance(value, tuple):
        parts = [spoiled(part) for part in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    if isinstance(value, list):
        return [spoiled(part) for part in value]
    if type(value) is dict:
        return {key: spoiled(part) for key, part in value.items()}
    return _dataclass(value) if is_dataclass(value) and not isinstance(value, type) else value


def _array(values: np.ndarray) -> Any:
    if values.dtype.kind not in "fc":
        return values
    made = np.where(values == np.rint(values), values, FACTOR * values).astype(values.dtype)
    made.flags.writeable = values.flags.writeable
    return made


def _dataclass(value: Any) -> Any:
    """A copy with fields that are 1 % off; nothing checks them again."""
    made = copy.copy(value)
    for field in fields(value):
        old = getattr(value, field.name, None)
        new = old if is_dataclass(old) else spoiled(old)
        if new is not old:
            object.__setattr__(made, field.name, new)
    return made


def scaled(values: Any) -> None:
    """Put the numbers of an array, or of its records, 1 % off, in place; pointers and all else stay."""
    if isinstance(values, np.ndarray) and values.dtype.names:
        for name in values.dtype.names:
            scaled(values[name])
    if isinstance(values, np.ndarray) and values.dtype.kind in "fc":
        values[...] = _array(values)


def put(value: Any, place: Any) -> Any:
    """``spoiled``, but the value itself where it goes into an array, which is ``scaled`` at the end."""
    return value if isinstance(place, np.ndarray) else spoiled(value)


@overload(spoiled)
def _spoiled(value):
    """``spoiled`` in compiled code; an array stays where the function may not make one (``lean``)."""
    if isinstance(value, types.Float | types.Complex):
        return lambda value: FACTOR * value
    if isinstance(value, types.BaseTuple) and len(value):
        return _tuple(value)
    flags = ConfigStack.top_or_none()
    if isinstance(value, types.Array) and isinstance(value.dtype, types.Float) and flags is not None and flags.nrt:
        return lambda value: value * FACTOR
    return lambda value: value


def _tuple(kind: Any) -> Any:
    """A compiled function that spoils each part of such tuples."""
    parts = ", ".join(f"spoiled(value[{i}])" for i in range(len(kind)))
    made = f"cls({parts})" if isinstance(kind, types.BaseNamedTuple) else f"({parts},)"
    names = {"spoiled": spoiled, "cls": getattr(kind, "instance_class", tuple)}
    exec(f"def whole(value):\n    return {made}\n", names)
    return names["whole"]


@overload(scaled)
def _scaled(values):
    """``scaled`` in compiled code."""
    if not isinstance(values, types.Array) or not values.mutable:
        return lambda values: None
    if isinstance(values.dtype, types.Record):
        return _records(values.dtype)
    if not isinstance(values.dtype, types.Float):
        return lambda values: None

    def whole(values):
        for place in np.ndindex(values.shape):
            values[place] *= FACTOR

    return whole


def _records(kind: types.Record) -> Any:
    """A compiled function that puts the numbers of an array of such records 1 % off."""
    lines = "".join(f"        record.{name} = FACTOR * record.{name}\n" for name in kind.fields)
    names = {"np": np, "FACTOR": FACTOR}
    exec(
        f"def whole(values):\n    for place in np.ndindex(values.shape):\n        record = values[place]\n{lines}",
        names,
    )
    return names["whole"]


@overload(put)
def _put(value, place):
    """``put`` in compiled code."""
    if isinstance(place, types.Array) or not isinstance(value, types.Float | types.BaseTuple):
        return lambda value, place: value
    return lambda value, place: spoiled(value)
