"""A steady circle of a vehicle on its suspension, from that of the plane vehicle."""

import numpy as np
from scipy.optimize import root

from models.systems.braking.procedures import STEADY, SteadyTurn, steered
from models.systems.braking.run import Braked, Start


def sprung_turn(vehicle: Braked, speed: float, radius: float, plane: SteadyTurn) -> SteadyTurn | None:
    """Circle of the centre of mass (m, positive to the left) at a speed (m/s), springs settled; None if there is none.

    Unknown are steer angle and side slip, of which ``plane`` is the first guess, and all coordinates but those in the
    plane; as there, no drive holds the speed.
    """
    go, size = vehicle.engine, vehicle.engine.size

    def state(unknown: np.ndarray) -> np.ndarray:
        both = np.zeros((2, size))
        both[0, 3:], both[1, 2] = unknown[2:], speed / radius
        both[1, :2] = speed * np.cos(unknown[1]), speed * np.sin(unknown[1])
        return both

    def moved(unknown: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        found: tuple[np.ndarray, np.ndarray] = go.rolling(
            state(unknown),
            steered(vehicle, unknown[0]),
            vehicle.plane,
            vehicle.kind,
            vehicle.road,
            vehicle.tables.packed,
        )
        return found

    def left(unknown: np.ndarray) -> np.ndarray:
        found, _ = moved(unknown)
        across = found[1] * np.cos(unknown[1]) - found[0] * np.sin(unknown[1])
        return np.concatenate(([across - speed**2 / radius], found[2:]))

    guess = np.zeros(size - 1)
    guess[0], guess[1] = plane.steer[0], np.arctan2(plane.start.state[1, 1], plane.start.state[1, 0])
    answer = root(left, guess, tol=1e-12).x
    if not np.abs(left(answer)).max() <= STEADY:
        return None
    return SteadyTurn(steered(vehicle, answer[0]), Start(state(answer), moved(answer)[1]))
