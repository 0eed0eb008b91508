"""Largest memory of this process alone."""

import resource
from pathlib import Path

PROCESS_STATUS = Path("/proc/self/status")


def peak_memory() -> int:
    """Largest memory that this process has had since its program began (bytes).

    Linux writes it into ``VmHWM``. ``getrusage`` counts the parent's memory at the moment of the start as well: in a
    process that a large one starts it would tell the size of the large one. It serves where there is no such file.
    """
    if not PROCESS_STATUS.exists():
        return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    line = next(line for line in PROCESS_STATUS.read_text().splitlines() if line.startswith("VmHWM:"))
    return 1024 * int(line.split()[1])
