"""What a step of a vehicle in the plane reads and writes: motion, wheels and room to work in, W wheels, n coordinates.

All are arrays with names, made once for a run and then written in place.
"""

from typing import NamedTuple

import numpy as np

from models.brake.plane_vehicle import Plane
from models.brake.surfaces import Surfaces


class Report(NamedTuple):
    """What the wheels did in a step, each (W,), of a whole run (samples, W).

    whole (7, W) : all of it, of which the others are rows; force_x, force_y : mean forces on the wheel in its own axes
    (N); load : N; slip : the mean one; slip_angle : rad; locked : time (s) for which the wheel was locked; turning :
    speed of turning at the end (rad/s).
    """

    whole: np.ndarray
    force_x: np.ndarray
    force_y: np.ndarray
    load: np.ndarray
    slip: np.ndarray
    slip_angle: np.ndarray
    locked: np.ndarray
    turning: np.ndarray


REPORTED = len(Report._fields) - 1
"""Numbers that a wheel reports."""


def report_of(whole: np.ndarray) -> Report:
    """The report whose numbers are the rows of ``whole`` (..., 7, W)."""
    return Report(whole, *np.moveaxis(whole, -2, 0))


def report(wheels: int) -> Report:
    """A report of zeros."""
    return report_of(np.zeros((REPORTED, wheels)))


class Motion(NamedTuple):
    """A vehicle that moves, all of it moved in place.

    state (2, n) : positions and rates; turning (W,) : rad/s; accelerations (2 + U,) : those of the last step, from
    which the next one searches on; report : of the last step.
    """

    state: np.ndarray
    turning: np.ndarray
    accelerations: np.ndarray
    report: Report


class Wheels(NamedTuple):
    """What is known of each wheel within a step, each (W,).

    start : speed of its centre along it at the start (m/s); rate : what that one's rate has besides the accelerations
    of the coordinates (m/s^2); along, aside : speeds of its centre along it, from 0 on, and across it where slip angles
    are taken; angle : slip angle (rad), cell, share : where that lies in the tables; still : load (N) besides what
    accelerations move, load : with that; cosine, sine : of the angle by which it is steered.
    """

    start: np.ndarray
    rate: np.ndarray
    along: np.ndarray
    aside: np.ndarray
    angle: np.ndarray
    cell: np.ndarray
    share: np.ndarray
    still: np.ndarray
    load: np.ndarray
    cosine: np.ndarray
    sine: np.ndarray


def wheels_of(count: int) -> Wheels:
    """Zeros for so many wheels."""
    numbers = {name: np.zeros(count) for name in Wheels._fields}
    return Wheels(**{**numbers, "cell": np.zeros(count, dtype=np.int64)})


class Workspace(NamedTuple):
    """Room in which a step works.

    along, across, press (W, n) : see ``plane_chain.rows``, and load by accelerations; units (U, 2) : see ``headings``;
    mass (n, n) : the factor of the mass matrix; right (n,) : forces besides the tyres' ones; out, out_before, off
    (n,) : accelerations that a round gave, that the one before gave, and by how much that was off; begun (n,) : those
    at the start of a window of rounds; before (2, n) : state at the start of the step; ends (2, W) : torques at the
    ends of a part of a step; middle (W,) : those in its middle; means (7, W), sums : reports of rounds and of parts.
    """

    wheels: Wheels
    surfaces: Surfaces
    along: np.ndarray
    across: np.ndarray
    press: np.ndarray
    units: np.ndarray
    mass: np.ndarray
    right: np.ndarray
    out: np.ndarray
    out_before: np.ndarray
    off: np.ndarray
    begun: np.ndarray
    before: np.ndarray
    ends: np.ndarray
    middle: np.ndarray
    means: np.ndarray
    sums: Report


def workspace(plane: Plane) -> Workspace:
    """Room for a vehicle in the plane, whose tyres do not lag as long as nobody says so."""
    w, n = plane.wheels, 2 + plane.masses.size
    none = np.zeros(w, dtype=np.int64)
    return Workspace(
        wheels=wheels_of(w),
        surfaces=Surfaces(none, none.copy(), np.zeros(w), np.full(w, np.nan)),
        along=np.zeros((w, n)),
        across=np.zeros((w, n)),
        press=np.zeros((w, n)),
        units=np.zeros((n - 2, 2)),
        mass=np.zeros((n, n)),
        right=np.zeros(n),
        out=np.zeros(n),
        out_before=np.zeros(n),
        off=np.zeros(n),
        begun=np.zeros(n),
        before=np.zeros((2, n)),
        ends=np.zeros((2, w)),
        middle=np.zeros(w),
        means=np.zeros((REPORTED, w)),
        sums=report(w),
    )
