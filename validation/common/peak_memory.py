"""Peak memory of this process, without its parent's."""

import resource
from pathlib import Path

PROCESS_STATUS = Path("/proc/self/status")


def peak_memory() -> int:
    """Peak memory (bytes) of this process since its program began.

    Linux reports it as ``VmHWM``. ``getrusage``, which serves where there is no such file, also counts the parent's
    memory at the start: in a child of a large process it would return the size of the parent.
    """
    if not PROCESS_STATUS.exists():
        return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    line = next(line for line in PROCESS_STATUS.read_text().splitlines() if line.startswith("VmHWM:"))
    return 1024 * int(line.split()[1])
