"""Who computes what repeats, as the command's options ``--workers`` and ``--cluster`` ask for it."""

from typing import TYPE_CHECKING, Any

from models.core.errors import InputError

if TYPE_CHECKING:  # the command line imports this file before it knows whether it will compute anything
    from models.ensemble.workers import Crew


def given_crew(workers: int | None, cluster: str | None) -> dict[str, Any]:
    """What the options change of a scene; InputError where they ask for both."""
    if workers is not None and cluster is not None:
        allowed = "is for this machine, and the workers of a cluster are those that have joined it: leave one out"
        raise InputError("--workers", "", workers, allowed)
    crew_changes = {"workers": workers, "cluster": cluster}
    return {} if workers is None and cluster is None else crew_changes


def crew_of(scene: Any, workers: int | None, cluster: str | None) -> "Crew":
    """The workers of a scene, with these options in place of the scene's own."""
    from models.ensemble.workers import Crew

    return Crew.of(scene.model_copy(update=given_crew(workers, cluster)))
