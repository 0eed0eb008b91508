"""Checks of user inputs to the contact functions: finite arrays, within plausible SI values, of one common shape."""

from collections.abc import Callable
from typing import Any

import numpy as np

from models.core.errors import InputError

Array = np.ndarray
"""Array of numbers or flags, of any shape."""
LARGEST_LOAD = 1e10
"""Largest load (N) that is accepted."""
LARGEST_APPROACH = 0.05
"""Largest approach (m) that is accepted: beyond it no contact is small against its body; an approach in mm often is."""
LARGEST_CREEPAGE = 10.0
LARGEST_SPIN = 1e9
"""Largest spin (1/m) that is accepted."""
NEGLIGIBLE_BOUND = 1e-60
"""Friction limit (N) below which tangential forces are zero: otherwise the slip divided by it, squared, would
overflow.
"""


def checked_quantity(
    quantity_name: str, value: Any, allowed_text: str, minimum: float = -np.inf, maximum: float = np.inf
) -> Array:
    """A user's input as a floating-point array of any shape; every element must be finite and between ``minimum`` and
    ``maximum``.

    Raises InputError with the first value that is not, and ``allowed_text``: what is expected, with its unit. Texts,
    complex numbers and masked elements are none, and nothing is guessed in their place.
    """
    try:
        raw = np.asanyarray(value)
        if raw.dtype.kind not in "fiuO" or np.ma.is_masked(raw):
            raise TypeError
        numbers = np.asarray(raw, dtype=float)
    except (TypeError, ValueError):
        raise InputError("", quantity_name, value, f"must be a number or an array of numbers: {allowed_text}") from None
    good = (numbers >= minimum) & (numbers <= maximum) & np.isfinite(numbers)
    if not good.all():
        first = np.unravel_index(int(np.argmin(good)), numbers.shape)
        place = f"{quantity_name}[{', '.join(map(str, first))}]" if first else quantity_name
        raise InputError("", place, float(numbers[first]), f"must be {allowed_text}")
    return numbers


def checked_number(
    quantity_name: str, value: Any, allowed_text: str, minimum: float = -np.inf, maximum: float = np.inf
) -> float:
    """A user's input as one number; checks are those of ``checked_quantity``, and an array is refused."""
    numbers = checked_quantity(quantity_name, value, allowed_text, minimum, maximum)
    if numbers.ndim:
        raise InputError("", quantity_name, value, f"must be one number, not an array: {allowed_text}")
    return float(numbers)


def checked_whole_number(quantity_name: str, value: Any, minimum: int, maximum: int) -> int:
    """A user's input if it is a whole number from ``minimum`` to ``maximum``, else InputError."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not minimum <= value <= maximum:
        raise InputError("", quantity_name, value, f"must be a whole number from {minimum} to {maximum}")
    return int(value)


def checked_creepages(
    xi_x: Any, xi_y: Any, spin: Any, read_value: Callable[..., Any] = checked_quantity
) -> dict[str, Any]:
    """Creepages and spin (1/m) in a dict by name, each checked by ``read_value``, which is ``checked_quantity`` or
    ``checked_number``.
    """
    allowed, turn = f"a creepage within +-{LARGEST_CREEPAGE:g}", f"a spin in 1/m within +-{LARGEST_SPIN:g}"
    return {
        "xi_x": read_value("xi_x", xi_x, allowed, -LARGEST_CREEPAGE, LARGEST_CREEPAGE),
        "xi_y": read_value("xi_y", xi_y, allowed, -LARGEST_CREEPAGE, LARGEST_CREEPAGE),
        "spin": read_value("spin", spin, turn, -LARGEST_SPIN, LARGEST_SPIN),
    }


def broadcast_together(**arrays: Array) -> tuple[Array, ...]:
    """The given arrays, broadcast to their common shape; raises InputError with their shapes if there is none."""
    try:
        shape = np.broadcast_shapes(*(array.shape for array in arrays.values()))
        return tuple(a if a.shape == shape else np.broadcast_to(a, shape).copy() for a in arrays.values())
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
        raise InputError("", ", ".join(arrays), None, f"have no common shape: {shapes}") from None
