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


def table_from_file(path: Path) -> TyreTable:
    """Tyre table from a file whose extension gives the format. Raises InputError if the file contains no such table."""
    if path.suffix.lower() not in READER_OF_EXTENSION:
        raise InputError(path.name, "", path.suffix, "is no file of a tyre", tuple(READER_OF_EXTENSION))
    return READER_OF_EXTENSION[path.suffix.lower()](path)


def table_of_named_tyre(name: str, rear: bool = False) -> TyreTable:
    """Tyre table of a named surface; with ``rear``, the rear tyre's table if the surface has a separate one."""
    rear_name = f"{name}/rear"
    return table_of_surface(rear_name if rear and rear_name in PACEJKA else name)


SURFACE_NAMES = tuple(name for name in NAMED_SURFACES if "/" not in name)
"""Names of the surfaces for which a tyre table is available."""
