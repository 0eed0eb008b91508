"""Rolling contact: quantities are the forces, a case per creepage; every creepage counts as a call."""

import time
from typing import Any

import numpy as np

from models.advice.choice.answer import Answer, Quantity
from models.core.errors import InputError
from models.systems.contact.of_scene import contact, creepages
from models.systems.contact.scene import ContactScene

ENGINE, WINDOWED = "reference", False
POWERS = {"linear": None, "fastsim": 2, "simplified": 2, "exact": 4}
"""By theory, of the cells along an axis: what a call goes through. Of a half-space every cell feels every other."""
FORCES = {"fx": "N", "fy": "N", "mz": "N m", "dissipation": "N"}


def answer(scene: ContactScene, engine: str) -> Answer:
    """Press the bodies and roll them at every creepage."""
    if scene.cases is not None:
        raise InputError(scene.file, "cases", None, "is a table of contacts: give the price of one of them")
    begun = time.process_time()
    body = contact(scene)
    rolled = [body.roll(motion, scene.method.cells) for motion in creepages(scene)]
    seconds = time.process_time() - begun
    found = {name: Quantity(unit, (np.array([getattr(one, name) for one in rolled]),)) for name, unit in FORCES.items()}
    power = POWERS[scene.method.name]
    terms = 0 if power is None else scene.method.cells**power
    return Answer(found, {"steps": len(rolled), "calls": len(rolled), "states": 0, "terms": terms}, seconds)


def steps(scene: ContactScene) -> int:
    """Creepages: nothing is marched in time."""
    return len(creepages(scene))


def parts(scene: ContactScene) -> int:
    """One: there is no step."""
    return 1


def shorten(table: dict[str, Any], scene: ContactScene, steps: int) -> None:
    """Nothing."""


def coarsen(table: dict[str, Any], scene: ContactScene, times: int) -> None:
    """Nothing."""
