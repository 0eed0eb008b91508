"""Workers of a scene, as the options ``--workers`` and ``--cluster`` request them."""

from typing import TYPE_CHECKING, Any

from models.core.errors import InputError

if TYPE_CHECKING:  # the command line imports this file before it knows whether it will compute anything
    from models.ensemble.workers import Crew


def crew_changes_by_options(worker_count: int | None, cluster_address: str | None) -> dict[str, Any]:
    """Changes of a scene's keys "workers" and "cluster" by the options; raises InputError if both options are given."""
    if worker_count is not None and cluster_address is not None:
        allowed = "is for this machine, and the workers of a cluster are those that have joined it: leave one out"
        raise InputError("--workers", "", worker_count, allowed)
    crew_changes = {"workers": worker_count, "cluster": cluster_address}
    return {} if worker_count is None and cluster_address is None else crew_changes


def crew_of(scene: Any, worker_count: int | None, cluster_address: str | None) -> "Crew":
    """The workers of a scene, with the options ``--workers`` and ``--cluster`` in place of the scene's keys."""
    from models.ensemble.workers import Crew

    return Crew.of(scene.model_copy(update=crew_changes_by_options(worker_count, cluster_address)))
