"""Set-up of the workers of a Dask cluster; imported only where there is a cluster."""

import dask
from distributed import Worker, WorkerPlugin

from models.ensemble.workers import keep_freed_memory


class WorkerSetup(WorkerPlugin):
    """Dask plugin: tasks on a worker use no scheduler, and a worker keeps freed memory as local workers do.

    Otherwise xarray would ask the scheduler in vain for locks on files in a worker's own memory.
    """

    name = "twinrig: tasks without a scheduler, memory kept"

    def setup(self, worker: Worker) -> None:
        """Prepare a worker; Dask calls this on every worker, including those that join later."""
        dask.config.set(scheduler="synchronous")
        keep_freed_memory()
