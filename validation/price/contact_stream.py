"""Memory of a long table of contacts, which is answered as a stream.

``python -m validation.price.contact_stream [ROWS ...]`` answers tables of so many rows, each in a fresh process, and
prints what memory and time that takes; 10,000,000 rows need 2 GB of disk.
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
from models.systems.contact.scene import Method
from validation.common.peak_memory import peak_memory

ROWS = (100_000, 1_000_000)
REPEATED_ROWS = 1000
"""Rows after which a table repeats itself."""
HEADER = "a [m],b [m],load [N],friction [-],xi_x [-],xi_y [-],spin [1/m]\n"


class ProcessCost(NamedTuple):
    """Peak memory (bytes) and computing time (s) of a process that computed a table of contacts."""

    memory: int
    seconds: float


def write(path: Path, rows: int) -> None:
    """Write a table of creepages from rolling to sliding; rows : a multiple of PERIOD."""
    lines = (f"5e-3,4e-3,{8e4 + i},0.3,{1e-5 * i:.6g},1e-4,{1e-3 * i:.4g}\n" for i in range(REPEATED_ROWS))
    text = "".join(lines)
    with path.open("w") as file:
        file.write(HEADER)
        file.writelines(text for _ in range(rows // REPEATED_ROWS))


def answered(folder: Path, rows: int) -> ProcessCost:
    """Compute a table of ``rows`` contacts into ``forces.csv``, without errors and with few cells."""
    write(folder / "cases.csv", rows)
    start_time = time.perf_counter()
    counts = solve_table(
        folder / "cases.csv", folder / "forces.csv", partial(Built, MaterialPair()), Method(cells=5), errors=False
    )
    if counts != {"rows": rows, "wrong": 0}:
        raise AssertionError(f"{counts} in place of {rows} sound rows")
    return ProcessCost(peak_memory(), time.perf_counter() - start_time)


def in_fresh_process(function: Callable[[Path, int], ProcessCost], rows: int) -> ProcessCost:
    """Result of function(folder, rows) in a process of its own."""
    with TemporaryDirectory() as name, process_pool(1) as executor:
        process_cost: ProcessCost = executor.submit(function, Path(name), rows).result()
        return process_cost


if __name__ == "__main__":
    for rows in map(int, sys.argv[1:]) if sys.argv[1:] else ROWS:
        taken = in_fresh_process(answered, rows)
        print(f"{rows:>12,} rows: {taken.memory / 1e6:.0f} MB, {taken.seconds:.0f} s", flush=True)
