"""One contact: what computes a bare one, and its forces."""

from typing import Any

import numpy as np

from models.contact.scene import ContactScene

ENGINES = ("reference",)
BARE: dict[str, Any] = {"title": "bare", "system": "contact", "ellipse": {"a": 5e-3, "b": 4e-3},
                        "contact": {"load": 8e4, "friction": 0.3}, "creepage": {"xi_x": 1e-3},
                        "method": {"name": "linear"}}  # fmt: skip


def seen(scene: ContactScene, engine: str) -> tuple[dict[str, int], bytes]:
    """Counts of the theory that computes, and forces at all motions."""
    from models.contact.of_scene import contact, creepages
    from models.contact.theories import Exact, ExactOnEllipse, Linear, Simplified

    own, motions = contact(scene), creepages(scene)
    found = [own.roll(motion, 7) for motion in motions]
    counts = {
        "bounded": int(not isinstance(own, Linear)), "areas of any shape": int(isinstance(own, Simplified)),
        "half-spaces": int(isinstance(own, Exact | ExactOnEllipse)),
        "laws of friction": int(getattr(own, "choices", {}).get("falling") is not None),
        "motions with spin": sum(motion[2] != 0.0 for motion in motions),
    }  # fmt: skip
    return counts, np.array([[one.fx, one.fy, one.mz] for one in found]).tobytes()
