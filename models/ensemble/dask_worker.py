"""What a worker of a Dask cluster is told before it computes: imported only where there is a cluster."""

import dask
from distributed import Worker, WorkerPlugin


class Plain(WorkerPlugin):
    """Tasks see no scheduler: xarray would ask it for locks of files that lie in a worker's own memory, in vain."""

    name = "twinrig: tasks without a scheduler"

    def setup(self, worker: Worker) -> None:
        """Called on every worker, those that join later too."""
        dask.config.set(scheduler="synchronous")
