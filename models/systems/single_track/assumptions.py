"""What the car of two axles takes for granted, and whether a drive keeps to it."""

from models.core.assumptions import Assumption
from models.systems.single_track.equations import LEAST_LOAD
from models.systems.single_track.scene import SingleTrackScene

SMALL_ANGLE = 0.35
"""rad: angles whose sine is the angle within 2 %."""


def assumptions(scene: SingleTrackScene) -> list[Assumption]:
    """Assumptions that slip angles are small and that both axles keep on the ground."""
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
