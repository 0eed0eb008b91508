"""A quarter vehicle: one wheel that bears all of a mass, braked by a torque that is given over time.

It is the plane's vehicle with a single wheel under its centre of mass, so that it runs through the same step as the
truck: what stopping distances and times of locking show of the one holds for the other.
"""

from dataclasses import dataclass

import numpy as np
from pydantic import model_validator

from models.brake.plane_step import LOCKED, REPORTED, step_on
from models.brake.plane_vehicle import GRAVITY, Plane
from models.brake.surfaces import Road, under_wheels
from models.core.errors import InputError, RunFailed
from models.core.strict import Strict, quantity
from models.machine.compiled import njit
from models.tyre.tyre_table import Tables

REGULAR = 0.1
"""Speed (m/s) below which slip angles are those of this one: without a motion across there is none at all."""
TIME, PLACE, SPEED, TURNING, HELD = range(5)
"""Columns of a path: s, m, m/s, rad/s at the end of a step, and the time (s) within it for which the wheel was
locked."""


class Quarter(Strict):
    """One wheel and the mass upon it."""

    mass: float = quantity("kg", "of vehicle and wheel together")
    radius: float = quantity("m", "of the wheel")
    spin_inertia: float = quantity("kg m^2", "of the wheel about its axle")

    @model_validator(mode="after")
    def _holds_its_wheel(self) -> "Quarter":
        least = self.spin_inertia / self.radius**2
        if self.mass <= least:
            raise ValueError(f"mass must be above {least:.4g} kg: J / r^2 of the wheel, which cannot be lighter")
        return self

    @property
    def plane(self) -> Plane:
        """As compiled functions take it: unit and group are the only ones, the wheel is at the centre."""
        none, one = np.zeros(1, dtype=np.int64), np.ones(1)
        return Plane(
            self.mass * one,
            one,
            np.zeros((1, 1)),
            none,
            none.copy(),
            np.zeros((1, 2)),
            self.radius * one,
            self.spin_inertia * one,
            self.mass * GRAVITY * one,
            np.zeros(1),
            np.zeros(1),
            0,
        )

    def steady_torque(self, slip: float, force: float) -> float:
        """Torque (N m) under which a slip stays as it is while the tyre gives a force (N)."""
        return force * (self.radius + self.spin_inertia * (1.0 - slip) / (self.mass * self.radius))


@dataclass(frozen=True, eq=False)
class Stop:
    """Path (n, 5) from the start on, its columns named above, and the step (index) in which it came to rest, or -1."""

    path: np.ndarray
    rest: int

    @property
    def distance(self) -> float:
        """Way (m) from the start to the last row."""
        return float(self.path[-1, PLACE] - self.path[0, PLACE])

    @property
    def released(self) -> float:
        """Time (s) at which a wheel that was locked in one run of steps turned again; not a number if it never did."""
        held = np.flatnonzero(self.path[:, HELD] > 0.0)
        if held.size == 0 or self.path[held[-1], TURNING] == 0.0:
            return float("nan")
        return float(self.path[held[-1] - 1, TIME] + self.path[held[-1], HELD])


@njit(cache=True, error_model="numpy")
def march(state, turning, torques, step, kind, road, plane, tables, path):
    """Steps (s) from ``state`` (2, 2 + U) and ``turning`` (W,), both moved, under torques (n + 1, W) at their ends.

    path (n + 1, 5) is filled from row 1 on, of the first wheel. Returns the step in which the vehicle came to rest, -1
    if in none, -2 if loads were not found; a vehicle that rests is left to its torques like one that moves.
    """
    found, report, rest = np.zeros(state.shape[1]), np.empty((turning.size, REPORTED)), -1
    surface = np.empty((turning.size, 3))
    for n in range(torques.shape[0] - 1):
        under_wheels(state, step, plane, kind, road, surface)
        used = step_on(
            state,
            turning,
            torques[n],
            torques[n + 1],
            step,
            np.zeros(turning.size),
            surface,
            REGULAR,
            plane,
            tables,
            found,
            report,
        )
        if used < 0.0:
            return -2
        if used < step and rest < 0:
            rest = n + 1
        path[n + 1, 0], path[n + 1, 1], path[n + 1, 2] = path[n, 0] + step, state[0, 0], state[1, 0]
        path[n + 1, 3], path[n + 1, 4] = turning[0], report[0, LOCKED] if used == step else 0.0
    return rest


def braked(
    quarter: Quarter,
    tyres: Tables,
    road: Road,
    torques: np.ndarray,
    step: float,
    speed: float,
    turning: float | None = None,
) -> Stop:
    """Motion along x from a speed (m/s) under torques (n + 1,) in N m at the ends of steps (s), linear in between.

    turning : rad/s at the start, that of rolling if not given. Raises InputError for a torque below 0 or no number.
    """
    if not (np.isfinite(torques).all() and (torques >= 0.0).all()):
        raise InputError("", "torques", float(np.min(torques)), "must be numbers from 0 on: a brake opposes turning")
    state, path = np.zeros((2, 3)), np.zeros((torques.size, 5))
    state[1, 0] = speed
    spin = np.array([speed / quarter.radius if turning is None else turning])
    path[0, SPEED], path[0, TURNING] = speed, spin[0]
    rest = march(
        state,
        spin,
        np.ascontiguousarray(torques, dtype=float)[:, None],
        step,
        np.zeros(1, dtype=np.int64),
        road,
        quarter.plane,
        tyres.packed,
        path,
    )
    if rest == -2 or not np.isfinite(path).all():
        raise RunFailed("braking", "no loads were found", float(path[np.argmax(path[:, TIME]), TIME]))
    return Stop(path, rest)
