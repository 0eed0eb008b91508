"""What a worker of a Dask cluster is told before it computes: imported only where there is a cluster."""

import dask
from distributed import Worker, WorkerPlugin

from models.ensemble.workers import keep_freed_memory


class Plain(WorkerPlugin):
    """Dask plugin: tasks do not use a scheduler, and a worker keeps freed memory as local workers do.

    Otherwise xarray would ask the scheduler in vain for locks on files in a worker's own memory.
    """

    name = "twinrig: tasks without a scheduler, memory kept"

    def setup(self, worker: Worker) -> None:
        """Prepare a worker; Dask calls this on every worker, including those that join later."""
        dask.config.set(scheduler="synchronous")
        keep_freed_memory()
