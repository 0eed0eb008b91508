"""What a trailer does behind its truck: angles of its hitch, and both from above."""

import numpy as np

from models.brake.plane_chain import place_of
from models.brake.plane_vehicle import Plane
from models.systems.braking.of_scene import vehicle_of
from models.systems.braking.scene import BrakingScene
from models.systems.braking.stop_report import Stop

OVERHANG = 1.2
"""m, of an outline beyond its axles, chosen; half of its width is BESIDE."""
BESIDE = 1.1


def hitch(stop: Stop) -> np.ndarray:
    """Angle (n,) of the drawbar against the truck in rad, positive to the left."""
    return stop.path.states[:, 0, 3] - stop.path.states[:, 0, 2]


def of_hitch(stop: Stop) -> dict[str, float]:
    """Of the hitch of a train, by name and unit."""
    angle = hitch(stop)
    largest = int(np.argmax(np.abs(angle)))
    return {
        "largest hitch angle [deg]": float(np.degrees(angle[largest])),
        "largest hitch angle at [s]": float(stop.times[largest]),
        "final hitch angle [deg]": float(np.degrees(angle[-1])),
    }


def outlines(scene: BrakingScene) -> list[tuple[int, np.ndarray]]:
    """Unit and corners (m, 2) in m in its axes: of the truck, the drawbar and the trailer's body."""
    own = vehicle_of(scene)
    found = [(0, _box(own.front.x, own.rear.x))]
    if scene.trailer is not None:
        found += [
            (1, np.array([[scene.trailer.drawbar, 0.0], [0.0, 0.0]])),
            (2, _box(scene.trailer.front.x, scene.trailer.rear.x)),
        ]
    return found


def on_ground(unit: int, corners: np.ndarray, positions: np.ndarray, plane: Plane) -> np.ndarray:
    """Places (m, 2) of a unit's corners at positions (2 + U,) of the vehicle."""
    return np.array([place_of(unit, x, y, positions, plane.reach) for x, y in corners])


def _box(front: float, rear: float) -> np.ndarray:
    ahead, behind = front + OVERHANG, rear - OVERHANG
    return np.array([[ahead, BESIDE], [ahead, -BESIDE], [behind, -BESIDE], [behind, BESIDE], [ahead, BESIDE]])
