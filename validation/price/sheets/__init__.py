"""Problem sheets that serve without twinrig: equations, parameters, inputs as CSV, end values of the reference.

    python -m validation.price.sheets FOLDER

One file per system; ``page`` holds what they share.
"""

import csv
from collections.abc import Callable
from pathlib import Path

from validation.price.sheets import braking, inertial_unit, pitch_plane, ride, vehicle
from validation.price.sheets.page import ReferenceValue

WRITERS: tuple[Callable[[Path], list[ReferenceValue]], ...] = (
    pitch_plane.write,
    braking.write,
    vehicle.write,
    ride.write,
    inertial_unit.write,
)
TABLE_HEADS = ("problem", "quantity", "unit", "time [s]", "value", "uncertainty")


def main(output_folder: Path, writers: tuple[Callable[[Path], list[ReferenceValue]], ...] = WRITERS) -> None:
    """Write a problem sheet and its input files for each problem into ``output_folder``, and one
    ``reference_values.csv``."""
    values = [value for write in writers for value in write(output_folder)]
    with open(output_folder / "reference_values.csv", "w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerows([TABLE_HEADS, *(value.cells() for value in values)])
