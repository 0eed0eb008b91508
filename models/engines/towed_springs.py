"""Springs and bars of towed bodies as an engine's native elements, and the table of numbers of all other parts.

They act along axes of the body that carries them, as those of a car that is cut at its wheels do. What a car has of
springs acts along axes that only yaw: no element of an engine has that.
"""

import numpy as np

from models.engines.native_parts import ElementDivision, divide_between_engine_and_callback
from models.multibody import forces as at
from models.multibody import parts
from models.multibody.numbers import Handling
from models.vehicles.cut_vehicle import CutVehicleElement, elements_of
from models.vehicles.spatial import AntiRollBar, SpringDamper

FORCE_COLUMNS = [parts.STIFFNESS, parts.DAMPING, parts.HELD, parts.FRICTION, parts.ON_TRAVEL, parts.ON_RATE]
"""Columns of a spring's or bar's row in the table for the compiled forces (stiffness, damping, preload, friction,
curves); all are 0 if the engine itself computes the part."""


def towed_division(vehicle_on_tyres: Handling, engine: str) -> ElementDivision:
    """Division of the springs and bars of towed bodies between "exudyn" or "mujoco" and the compiled forces."""
    free = vehicle_on_tyres.vehicle
    elements = elements_of(free, vehicle_on_tyres.held) if vehicle_on_tyres.forces == "native" and free.towed else ()
    return divide_between_engine_and_callback(
        free, (element for element in elements if element.frame in free.towed), engine
    )


def shared_numbers(vehicle_on_tyres: Handling, division: ElementDivision) -> np.ndarray:
    """The table for the compiled forces, without the terms that native parts compute; the vehicle's own table where
    there are no native parts."""
    if not division.native:
        return vehicle_on_tyres.numbers
    numbers, native = vehicle_on_tyres.numbers.copy(), {part.element.name for part in division.native}
    first, count = int(numbers[at.OF_PARTS]), int(numbers[at.PARTS])
    rows = numbers[first : first + count * parts.PER_PART].reshape(count, parts.PER_PART)
    left = {element.name: element for element in division.shared}
    all_parts: tuple[SpringDamper | AntiRollBar, ...] = (
        *vehicle_on_tyres.vehicle.springs,
        *vehicle_on_tyres.vehicle.bars,
    )
    for row, part in zip(rows, all_parts, strict=True):
        if part.name in native:
            _remainder(row, left.get(part.name))
    kept = rows[rows[:, FORCE_COLUMNS].any(axis=1)]
    rows[: len(kept)], numbers[at.PARTS] = kept, len(kept)
    return numbers


def _remainder(element_row: np.ndarray, shared_element: CutVehicleElement | None) -> None:
    """Reduce a part's row of the table to the terms that are not native; to zeros where the part is entirely native."""
    gone = (
        shared_element is None or shared_element.travel_force is None,
        shared_element is None or shared_element.rate_force is None,
    )
    element_row[FORCE_COLUMNS[:4]] = (
        (shared_element.stiffness, shared_element.damping, shared_element.preload, shared_element.friction)
        if shared_element
        else 0.0
    )
    for column, none in zip(FORCE_COLUMNS[4:], gone, strict=True):
        element_row[column] = 0.0 if none else element_row[column]
