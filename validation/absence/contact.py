"""One contact: what computes a bare one, and its forces."""

from typing import Any
from unittest import mock

import numpy as np

from models.systems.contact.scene import ContactScene

ENGINES = ("reference",)
BARE: dict[str, Any] = {
    "title": "bare",
    "system": "contact",
    "ellipse": {"a": 5e-3, "b": 4e-3},
    "contact": {"load": 8e4, "friction": 0.3},
    "creepage": {"xi_x": 1e-3},
    "method": {"name": "linear"},
}
BOUNDED: dict[str, Any] = {"method": {"name": "simplified"}}
BY_HAND: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "profiles": (BOUNDED, BOUNDED | {"ellipse": None, "profiles": {}})
}


def seen(scene: ContactScene, engine: str) -> tuple[dict[str, int], bytes]:
    """Counts of the theory that computes, and forces at all motions."""
    from models.contact.theories import Exact, ExactOnEllipse, Linear, Simplified
    from models.systems.contact import of_scene

    with mock.patch.object(of_scene, "touches", wraps=of_scene.touches) as searched:
        own, motions = of_scene.contact(scene), of_scene.creepages(scene)
    found = [own.roll(motion, 7) for motion in motions]
    counts = {
        "bounded": int(not isinstance(own, Linear)),
        "areas of any shape": int(isinstance(own, Simplified)),
        "half-spaces": int(isinstance(own, Exact | ExactOnEllipse)),
        "laws of friction": int(getattr(own, "choices", {}).get("falling") is not None),
        "searches": searched.call_count,
        "motions with spin": sum(motion[2] != 0.0 for motion in motions),
    }
    return counts, np.array([[one.fx, one.fy, one.mz] for one in found]).tobytes()
