"""Springs and bars of towed bodies as an engine's own, and the table of numbers without what the engine has of them.

They act along axes of the body that carries them, as those of a car that is cut at its wheels do. What a car has of
springs acts along axes that only yaw: no element of an engine has that.
"""

import numpy as np

from models.engines.native_parts import Division, divide
from models.multibody import forces as at
from models.multibody import parts
from models.multibody.numbers import Handling
from models.vehicles.cut_vehicle import Element, elements_of
from models.vehicles.spatial import AntiRollBar, SpringDamper

ACTS = [parts.STIFFNESS, parts.DAMPING, parts.HELD, parts.FRICTION, parts.ON_TRAVEL, parts.ON_RATE]
"""Columns of a part that are 0 where nothing of it is left."""


def divided(handling: Handling, engine: str) -> Division:
    """Division of the springs and bars of towed bodies between "exudyn" or "mujoco" and the compiled forces."""
    free = handling.vehicle
    elements = elements_of(free, handling.held) if handling.forces == "native" and free.towed else ()
    return divide(free, (element for element in elements if element.frame in free.towed), engine)


def numbers_beside(handling: Handling, division: Division) -> np.ndarray:
    """The table for the compiled forces without what native parts compute; the vehicle's own table where there are no
    native parts.
    """
    if not division.native:
        return handling.numbers
    numbers, native = handling.numbers.copy(), {part.element.name for part in division.native}
    first, count = int(numbers[at.OF_PARTS]), int(numbers[at.PARTS])
    rows = numbers[first : first + count * parts.PER_PART].reshape(count, parts.PER_PART)
    left = {element.name: element for element in division.shared}
    whole: tuple[SpringDamper | AntiRollBar, ...] = (*handling.vehicle.springs, *handling.vehicle.bars)
    for row, part in zip(rows, whole, strict=True):
        if part.name in native:
            _remainder(row, left.get(part.name))
    kept = rows[rows[:, ACTS].any(axis=1)]
    rows[: len(kept)], numbers[at.PARTS] = kept, len(kept)
    return numbers


def _remainder(row: np.ndarray, left: Element | None) -> None:
    """Reduce a part's row of the table to what is not native, to zeros where the part is entirely native."""
    gone = left is None or left.travel_force is None, left is None or left.rate_force is None
    row[ACTS[:4]] = (left.stiffness, left.damping, left.preload, left.friction) if left else 0.0
    for column, none in zip(ACTS[4:], gone, strict=True):
        row[column] = 0.0 if none else row[column]
