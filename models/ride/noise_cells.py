"""Where a drive is cut: steps in time for the motion, and on them the cells and points that integrate noise in path."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from models.ride.speed_profile import SpeedProfile

NODES = 5
"""Points of Gauss's integral in a cell, good to the power 2 NODES of its length."""
POINTS, WEIGHTS = (half / 2.0 for half in (np.polynomial.legendre.leggauss(NODES) + np.array([[1.0], [0.0]])))
"""Points and weights of the integral from 0 to 1."""
CLOSE = 1e-11
"""Cuts (s) nearer to one another than this are one: 1e-9 m of road at most."""

SHRINKING = np.outer((-1.0, 1.0), 4.0 ** -np.arange(1.0, 7.0)).ravel()
"""Cuts about a place of standstill, over the longest step."""


@dataclass(frozen=True)
class Nodes:
    """Points (K,) of the integral over the path: time (s), weight (m), step in which they lie."""

    time: np.ndarray
    weight: np.ndarray
    step: np.ndarray


def steps(
    profile: SpeedProfile,
    begin: float,
    instants: Sequence[float] | np.ndarray,
    motion: float,
    road: float,
    reach: float,
) -> np.ndarray:
    """Ends (N + 1,) of steps (s) from ``begin`` to the profile's end; its points and ``instants`` are among them.

    A step times the fastest rate of the motion (1/s) and of the road met (``road`` in 1/m) is at most ``reach``.
    """
    within = [t for t in instants if begin < t < profile.times[-1]]
    cuts = np.unique(np.concatenate([[begin], profile.times, within]))
    ends = [cuts[:1]]
    for start, stop in pairwise(cuts):
        rate = max(motion, road * float(profile.speed(np.array([start, stop])).max()))
        ends.append(np.linspace(start, stop, max(1, int(np.ceil(rate * (stop - start) / reach))) + 1)[1:])
    return np.concatenate(ends)


def nodes(profile: SpeedProfile, ends: np.ndarray, distances: Sequence[float]) -> Nodes:
    """Points on cells that end with every step and wherever an axle passes the place of a step's end.

    ``distances`` (m) of axles behind others: at such a place the other one's speed may bend, or it may have stood.
    Towards a place of standstill, where its time goes like the root of the distance, cells shrink.
    """
    path, own = profile.path(ends), ends[ends >= profile.times[0]]
    stops = _passing(profile, path[profile.speed(ends) == 0.0], distances)
    shrinking = (stops[:, None] + np.diff(own).max() * SHRINKING).ravel()
    more = np.sort(np.concatenate([_passing(profile, path, distances), shrinking]))
    more = more[(more > own[0]) & (more < own[-1])]
    after = np.searchsorted(own, more)
    apart = np.minimum(own[after] - more, more - own[after - 1]) > CLOSE
    apart &= np.diff(more, prepend=-np.inf) > CLOSE
    cuts = np.sort(np.concatenate([own, more[apart]]))
    time = cuts[:-1, None] + np.diff(cuts)[:, None] * POINTS
    weight = np.diff(cuts)[:, None] * WEIGHTS * profile.speed(time)
    moving = weight.any(axis=1)
    time, weight = time[moving].ravel(), weight[moving].ravel()
    return Nodes(time, weight, np.searchsorted(ends, time, side="right") - 1)


def _passing(profile: SpeedProfile, places: np.ndarray, distances: Sequence[float]) -> np.ndarray:
    """Times (s) at which an axle that is one of the ``distances`` behind passes the places of the first."""
    different = np.unique(places)
    return np.concatenate([profile.time(different + distance) for distance in distances] or [np.zeros(0)])
