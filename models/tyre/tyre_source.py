"""Source of a tyre table: a named surface, or a file of the user."""

from pathlib import Path

from models.core.errors import InputError
from models.tyre.magic_formula import NAMED_SURFACES, PACEJKA, table_of_surface
from models.tyre.tir_file import tir_table
from models.tyre.tyre_file import tyre_table
from models.tyre.tyre_table import TyreTable

READER_OF_EXTENSION = {".csv": tyre_table, ".tir": tir_table}
SCALE_BOUNDS = (0.0, 2.0)
"""Bounds of a factor on friction: above the first and up to the second."""


def table_from_file(table_path: Path) -> TyreTable:
    """Tyre table from a file whose extension gives the format. Raises InputError if the file contains no such table."""
    if table_path.suffix.lower() not in READER_OF_EXTENSION:
        raise InputError(table_path.name, "", table_path.suffix, "is no file of a tyre", tuple(READER_OF_EXTENSION))
    return READER_OF_EXTENSION[table_path.suffix.lower()](table_path)


def table_of_named_tyre(tyre_name: str, is_rear: bool = False) -> TyreTable:
    """Tyre table of a named surface; with ``is_rear``, the rear tyre's table if the surface has a separate one."""
    rear_name = f"{tyre_name}/rear"
    return table_of_surface(rear_name if is_rear and rear_name in PACEJKA else tyre_name)


SURFACE_NAMES = tuple(name for name in NAMED_SURFACES if "/" not in name)
"""Names of the surfaces for which a tyre table is available."""
