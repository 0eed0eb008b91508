"""Arrays that a user hands to a function of this package: finite, within what is plausible in SI, of one shape."""

from typing import Any

import numpy as np

from models.errors import InputError

Array = np.ndarray[Any, np.dtype[np.float64]]


def quantity(name: str, value: Any, allowed: str, least: float = -np.inf, most: float = np.inf) -> Array:
    """``value`` as a floating-point array of any shape, every element finite and from ``least`` to ``most``.

    Raises InputError with the first value that is not, and ``allowed``: what is expected, with its unit. Texts, complex
    numbers and masked elements are none, and nothing is guessed in their place.
    """
    try:
        given = np.asanyarray(value)
        if given.dtype.kind not in "fiuO" or np.ma.is_masked(given):
            raise TypeError
        found = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise InputError("", name, value, f"must be a number or an array of numbers: {allowed}") from None
    good = (found >= least) & (found <= most) & np.isfinite(found)
    if not good.all():
        first = np.unravel_index(int(np.argmin(good)), found.shape)
        place = f"{name}[{', '.join(map(str, first))}]" if first else name
        raise InputError("", place, float(found[first]), f"must be {allowed}")
    return found


def together(**arrays: Array) -> tuple[Array, ...]:
    """The arrays broadcast to their common shape; raises InputError that names the shapes where there is none."""
    try:
        return tuple(np.broadcast_arrays(*arrays.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
        raise InputError("", ", ".join(arrays), None, f"have no common shape: {shapes}") from None
