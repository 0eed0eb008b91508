"""What a worker of a Dask cluster is told before it computes: imported only where there is a cluster."""

import dask
from distributed import Worker, WorkerPlugin

from models.ensemble.workers import keep_freed_memory


class Plain(WorkerPlugin):
    """Tasks see no scheduler, and a worker keeps freed memory as those of this machine do.

    xarray would ask the scheduler for locks of files that lie in a worker's own memory, in vain.
    """

    name = "twinrig: tasks without a scheduler, memory kept"

    def setup(self, worker: Worker) -> None:
        """Called on every worker, those that join later too."""
        dask.config.set(scheduler="synchronous")
        keep_freed_memory()
