"""Rolling contact scenes for a choice of effects: quantities are the contact forces, one case per creepage, and every
creepage counts as a call.
"""

from typing import Any

from models.advice.choice.answer import Quantity, RunQuantities
from models.core.errors import InputError
from models.systems.contact.run import run, swept_creepages
from models.systems.contact.scene import ContactScene

DEFAULT_ENGINE, PART_REPRESENTS_RUN = "reference", False
COMPARED_QUANTITIES = ("fx", "fy", "mz", "dissipation")


def computed_quantities(scene: ContactScene, engine: str, with_error_estimate: bool = False) -> RunQuantities:
    """Solve the contact at every creepage, and collect forces, spin moment and dissipation."""
    if scene.cases is not None:
        raise InputError(scene.file, "cases", None, "is a table of contacts: give the price of one of them")
    forces = run(scene, error=with_error_estimate)
    quantities = {name: Quantity(forces.data[name].attrs["units"], (forces[name],)) for name in COMPARED_QUANTITIES}
    return RunQuantities(quantities, forces.counts(), forces.seconds)


def step_count(scene: ContactScene) -> int:
    """Number of creepages, as nothing is marched in time."""
    return len(swept_creepages(scene))


def divisible_step_count(scene: ContactScene) -> int:
    """Number of steps that a longer step must divide: 1, as a contact has no time steps."""
    return 1


def shorten_run(scene_table: dict[str, Any], scene: ContactScene, step_limit: int) -> None:
    """Do nothing: a contact has no time steps to shorten."""


def lengthen_steps(scene_table: dict[str, Any], scene: ContactScene, step_factor: int) -> None:
    """Do nothing: a contact has no time steps to coarsen."""
