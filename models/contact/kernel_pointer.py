"""The compiled contact as a C function pointer, for engines and programs that are not written in Python.

``pointer(cells)`` has the address of the function and that of the table of cells it marches on. The signature, the
structures and the status are in ``kernel.h`` beside this file, a program that uses them in ``kernel_example.c``:

    int32_t twinrig_contact(int32_t given, const double *net, const twinrig_in *in, twinrig_out *out);

The function takes no lock, holds nothing between two calls and enters Python nowhere, so that any number of threads may
call it at once; on an ellipse it allocates nothing either. The pointers last as long as the object that
``contact_pointer`` returns. Axes, signs and units are those of ``models.contact``.
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from numba import cfunc, types

from models.contact.inputs import Array
from models.contact.kernel import grid_table, solve_contact
from models.contact.kernel_simplified import distance_table
from models.contact.undeformed_distance import UndeformedDistance
from models.machine.stack import DOUBLES

CONTACT_SIGNATURE = types.int32(types.int32, DOUBLES, DOUBLES, DOUBLES)
C_HEADER_PATH = Path(__file__).with_name("kernel.h")
C_EXAMPLE_PATH = Path(__file__).with_name("kernel_example.c")


@dataclass(frozen=True, eq=False)
class ContactPointer:
    """Addresses of the compiled contact function and of its grid table ``grid_table``, and ``call``, the function in
    the form of ctypes.
    """

    address: int
    net: Array
    call: Any

    @property
    def net_address(self) -> int:
        """Address of the first double of the grid table."""
        return int(self.net.ctypes.data)


def contact_pointer(cell_count: int = 21, undeformed_distance: UndeformedDistance | None = None) -> ContactPointer:
    """Pointer to the compiled contact with the grid table for ``cell_count`` cells per strip, or 0 for the linear
    theory. Raises InputError.

    undeformed_distance : of bodies whose contact is no ellipse; then the table is theirs, for Kalker's theory of 1983.
    """
    compiled = _compiled_contact()
    mesh = grid_table(cell_count) if undeformed_distance is None else distance_table(undeformed_distance, cell_count)
    return ContactPointer(int(compiled.address), mesh, compiled.ctypes)


@cache
def _compiled_contact() -> Any:
    """Compiled C function around ``solve_contact``, made anew in each process; the machine code of ``solve_contact``
    itself is cached on disk.
    """

    @cfunc(CONTACT_SIGNATURE, error_model="numpy")
    def twinrig_contact(input_kind, table_pointer, input_pointer, output_pointer):
        return solve_contact(input_kind, input_pointer, table_pointer, output_pointer)

    return twinrig_contact
