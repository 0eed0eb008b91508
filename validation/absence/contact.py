"""Contact scene without effects, for the absence checks: its tables, counts of the theory's features, its forces."""

from typing import Any
from unittest import mock

import numpy as np

from models.systems.contact.scene import ContactScene

ENGINES = ("reference",)
BARE_SCENE: dict[str, Any] = {
    "title": "bare",
    "system": "contact",
    "ellipse": {"a": 5e-3, "b": 4e-3},
    "contact": {"load": 8e4, "friction": 0.3},
    "creepage": {"xi_x": 1e-3},
    "method": {"name": "linear"},
}
BOUNDED: dict[str, Any] = {"method": {"name": "simplified"}}
HAND_WRITTEN_TABLES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "profiles": (BOUNDED, BOUNDED | {"ellipse": None, "profiles": {}})
}


def counts_and_path(scene: ContactScene, engine: str) -> tuple[dict[str, int], bytes]:
    """Counts of the features that a scene's contact theory uses (spin, falling friction, contact search, ...), and the
    creep forces as bytes."""
    from models.contact.theories import ExactTheory, ExactTheoryOnEllipse, LinearTheory, SimplifiedTheory
    from models.systems.contact import run

    coarse = scene.model_copy(update={"method": scene.method.model_copy(update={"cells": 7})})
    with mock.patch.object(run, "touching_points", wraps=run.touching_points) as searched:
        forces = run.run(coarse, error=False)
    body = forces.detail.contact
    counts = {
        "bounded": int(not isinstance(body, LinearTheory)),
        "areas of any shape": int(isinstance(body, SimplifiedTheory)),
        "half-spaces": int(isinstance(body, ExactTheory | ExactTheoryOnEllipse)),
        "laws of friction": int(getattr(body, "choices", {}).get("falling") is not None),
        "searches": searched.call_count,
        "motions with spin": int((forces["spin"] != 0.0).sum()),
    }
    return counts, np.array([forces[name] for name in ("fx", "fy", "mz")]).tobytes()
