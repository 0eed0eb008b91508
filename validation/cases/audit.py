"""Build audit: accelerations at random states, before any trajectory."""

from pathlib import Path
from typing import Any

import numpy as np

from models.assembly import assemble
from models.engines.protocol import build, settings_of
from models.scene import build as build_scene
from validation.rows import Row, at_most

TITLE = "Accelerations at 100 random states"
SYSTEM = "pitch-plane"
STATES = 100
SPREAD = np.array([0.5, 0.5, 0.5, 0.6, 3.0, 3.0, 3.0, 3.0])
"""Half-width of the random states (m, rad, m/s, rad/s): pitch up to 34 degrees, far beyond any road."""


def scene(parameters: str, geometry: str = "exact"):
    """The vehicle on the study road, whose input takes part in the audit."""
    return build_scene({
        "title": TITLE, "vehicle": {"parameters": parameters, "geometry": geometry},
        "run": {"duration": 2.0, "step": 1e-3}, "effects": {"road": {"source": "study", "speed": 20.0}},
    })  # fmt: skip


def difference(engine: str, parameters: str, geometry: str = "exact") -> float:
    """Largest difference to the reference, relative to the largest acceleration, over all states."""
    own = scene(parameters, geometry)
    assembly = assemble(own)
    models = [build(name, assembly, settings_of(own, name)) for name in ("reference", engine)]
    states = np.random.default_rng(20).uniform(-1, 1, (STATES, 8)) * SPREAD
    times = np.round(np.linspace(0.1, 1.9, STATES), 3)
    hand, found = (np.array([model.acceleration(t, y) for t, y in zip(times, states, strict=True)]) for model in models)
    return float(np.abs(found - hand).max() / np.abs(hand).max())


def measure(quick: bool, folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """A row per engine, vehicle and geometry."""
    rows = [
        at_most(f"audit.{engine}.{parameters}.{geometry}", SYSTEM,
                f"acceleration, {engine} against the equations of the paper, {parameters}, {geometry} geometry",
                difference(engine, parameters, geometry), "of the largest", 1e-12,
                "both sides are a dozen products of doubles; 1e-12 leaves four digits for cancellation", "native")
        for engine in ("exudyn", "mujoco")
        for parameters in ("itwm_drift", "asymmetric_twin")
        for geometry in ("exact", "linear")
    ]  # fmt: skip
    return rows, {}
