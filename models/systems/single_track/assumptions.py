"""Assumptions of the single-track car, with the limits that decide whether a drive breaks them."""

from models.core.assumptions import Assumption
from models.systems.single_track.equations import LEAST_LOAD
from models.systems.single_track.scene import SingleTrackScene

SMALL_ANGLE = 0.35
"""Largest slip angle (rad) that counts as small: its sine is within 2 % of the angle."""


def assumptions(scene: SingleTrackScene) -> list[Assumption]:
    """Assumptions of a drive: slip angles are small, and both axles stay on the ground."""
    weight = scene.vehicle.mass
    return [
        Assumption(
            "small angles",
            "slip angles are so small that sines and angles are the same",
            "use a vehicle on four wheels (system handling)",
            lambda run: {f"{axle} axle": run[f"slip angle {axle}"] for axle in ("front", "rear")},
            "rad",
            -SMALL_ANGLE,
            SMALL_ANGLE,
        ),
        Assumption(
            "axles stay on the ground",
            "each axle keeps a part of its weight",
            "lower vehicle.centre_height or the lift of the axle",
            lambda run: {f"{axle} axle": run[f"load {axle}"] / (9.81 * weight) for axle in ("front", "rear")},
            "of the weight",
            2.0 * LEAST_LOAD,
        ),
    ]
