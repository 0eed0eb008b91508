"""Laws of the braked wheel by compiled code, each called alone: what the plain ones are compared with."""

import numpy as np

from models.brake.plain.suspension import Held
from models.brake.plain.tyre import Braked, Motion, Surface
from models.brake.plane_step import ALONG, ANGLE, ASIDE, CELL, KNOWN, PART, REPORTED, START, begin
from models.brake.plane_step import tyre as compiled_tyre
from models.brake.plane_vehicle import PAPER, Plane, truck
from models.brake.relaxation import lag_on as compiled_lag_on
from models.brake.sprung import Sprung
from models.brake.sprung_step import HELD_X, HELD_Y, ROW, SPUN, STEER, fill, held
from models.brake.surfaces import Road
from models.brake.surfaces import under_wheels as compiled_under_wheels
from models.engines.free_vehicle import Driven, FreeModel, free_model
from models.tyre.tyre_table import Tables, across, along, place

PLANE: Plane = truck(PAPER)


def tyre(tables: Tables, under: Surface, motion: Motion, load: float, of: Braked) -> np.ndarray:
    """(7,) as ``models.brake.plain.tyre.tyre``."""
    one = PLANE._replace(radius=np.array([of.radius]), spin=np.array([of.inertia]))
    known, report = np.zeros((1, KNOWN)), np.empty(REPORTED)
    begin(np.array([of.turning]), np.array([[under.first, under.second, under.share]]), one, known)
    known[0, START], known[0, ALONG], known[0, ASIDE] = motion.start, motion.forwards, motion.across
    known[0, ANGLE] = np.arctan2(abs(motion.across), max(motion.forwards, motion.regular))
    known[0, CELL], known[0, PART] = place(tables.angles, known[0, ANGLE])
    compiled_tyre(known[0], motion.rate, load, *of.torques, of.step, tables.packed, report)
    return report


def friction(tables: Tables, which: int, angle: float, load: float, slip: float) -> tuple[float, float]:
    """mu_x and mu_y of one of the tables at a slip angle (rad), a load (N) and a slip."""
    angles, slips, loads, mu_x, g, h = tables.packed
    (a, p), (f, q), (s, w) = place(angles, angle), place(loads, load), place(slips, slip)
    below, above = (along(which, a, p, f, q, k, mu_x) for k in (s, min(s + 1, slips.size - 1)))
    return below + w * (above - below), across(which, a, p, f, q, s, w, g, h)


def under_wheels(road: Road, state: np.ndarray, step: float, kinds: np.ndarray) -> np.ndarray:
    """Tables and share of the second (4, 3) under the wheels of the truck at a state (2, 3), over a step (s)."""
    surface = np.empty((4, 3))
    compiled_under_wheels(state, step, PLANE, kinds, road, surface)
    return surface


def lag_on(
    state: np.ndarray, time: float, steer: np.ndarray, slope: float, length: np.ndarray, lag: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """As ``validation.braking.plain_relaxation.lag_on``, of the truck's wheels."""
    after, surface = lag.copy(), np.zeros((4, 4))
    compiled_lag_on(state, time, steer, PLANE, slope, length, after, surface)
    return after, surface[:, 3].copy()


def in_engine(vehicle: Sprung, engine: str) -> FreeModel:
    """A vehicle on its suspension in an engine, around the compiled forces; ``held_in`` its table is what its wheels
    hold."""
    own = vehicle.handling
    table = np.concatenate((own.numbers, np.zeros(ROW * len(own.vehicle.tyres))))
    return free_model(engine, Driven(own.vehicle, own.gravity, table, held, lambda block, t, n: fill(block, n, table)))


def held_in(numbers: np.ndarray) -> Held:
    """What four wheels hold by a table of numbers: views, to read and to write."""
    rows = numbers[-4 * ROW :].reshape(4, ROW)
    return Held(rows[:, STEER], rows[:, HELD_X : HELD_Y + 1], rows[:, SPUN])
