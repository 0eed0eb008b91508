"""Peak memory of the computation of a long table of contacts, which is read and written as a stream.

``python -m validation.price.contact_stream [ROWS ...]`` computes tables of so many rows, each in a fresh process,
and prints memory and time; 10,000,000 rows need 2 GB of disk.
"""

import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from models.contact.material import MaterialPair
from models.ensemble.workers import process_pool
from models.systems.contact.cases_table import solve_table
from models.systems.contact.run import Built
from models.systems.contact.scene import ContactMethod
from validation.common.peak_memory import peak_memory

ROW_COUNTS = (100_000, 1_000_000)
REPEATED_ROWS = 1000
"""Number of rows after which the contents of a table repeat."""
HEADER = "a [m],b [m],load [N],friction [-],xi_x [-],xi_y [-],spin [1/m]\n"


class ProcessCost(NamedTuple):
    """Cost of a process that computed a table of contacts: peak memory (bytes) and computing time (s)."""

    memory: int
    seconds: float


def write_table(table_path: Path, row_count: int) -> None:
    """Write a table (CSV) of contacts with creepages from rolling to sliding; row_count : a multiple of
    REPEATED_ROWS."""
    lines = (f"5e-3,4e-3,{8e4 + i},0.3,{1e-5 * i:.6g},1e-4,{1e-3 * i:.4g}\n" for i in range(REPEATED_ROWS))
    text = "".join(lines)
    with table_path.open("w") as file:
        file.write(HEADER)
        file.writelines(text for _ in range(row_count // REPEATED_ROWS))


def cost_of_table(work_folder: Path, row_count: int) -> ProcessCost:
    """Compute a table of ``row_count`` contacts into ``forces.csv``, with few cells and without error estimates;
    returns the cost."""
    write_table(work_folder / "cases.csv", row_count)
    start_time = time.perf_counter()
    counts = solve_table(
        work_folder / "cases.csv",
        work_folder / "forces.csv",
        partial(Built, MaterialPair()),
        ContactMethod(cells=5),
        with_errors=False,
    )
    if counts != {"rows": row_count, "wrong": 0}:
        raise AssertionError(f"{counts} in place of {row_count} sound rows")
    return ProcessCost(peak_memory(), time.perf_counter() - start_time)


def in_fresh_process(cost_function: Callable[[Path, int], ProcessCost], row_count: int) -> ProcessCost:
    """Cost that cost_function(folder, row_count) returns, computed in a new process."""
    with TemporaryDirectory() as name, process_pool(1) as executor:
        process_cost: ProcessCost = executor.submit(cost_function, Path(name), row_count).result()
        return process_cost


if __name__ == "__main__":
    for rows in map(int, sys.argv[1:]) if sys.argv[1:] else ROW_COUNTS:
        taken = in_fresh_process(cost_of_table, rows)
        print(f"{rows:>12,} rows: {taken.memory / 1e6:.0f} MB, {taken.seconds:.0f} s", flush=True)
