"""A tyre as an elastic foundation: an elliptic patch of bristles that roll through it, each held by friction.

This is Kalker's simplified theory (``models.contact``, marched to second order) with the bristles of a tyre instead of
an elastic half-space: one stiffness k (N/m^3) along and across, pressure parabolic. Of the patch, the half width b is
constant and the half length is a = sqrt(R N / k_z), R the free radius and N / k_z the deflection; so C = 8/3 a^2 b k,
the cornering stiffness while nothing slides, is proportional to the load. k is such that C at the tyre's static load is
the cornering stiffness of the ride vehicle, to the net's own digits. The aligning moment of small slip has the arm 3 pi
a / 32 behind the centre. A camber's, a path's and a steering wheel's turning spin the patch, and are felt as such.

Slip is relative to the speed u at which the tread runs through the patch, |u| below ``SLOW`` counting as that: there
bristles act like dampers, so a tyre at rest creeps, by as much less as SLOW is small. Between SLOW and -SLOW the
forces of rolling forwards and backwards are mixed, so that nothing jumps. Both have no power, nor has a mixture.
"""

from functools import cache

import numpy as np

from models.contact.fastsim import KINDS, MARCHES
from models.contact.fastsim_grid import Grid, grid, strips_of
from models.contact.fastsim_many import LOAD, MU, PER_SLIP, ROOM, SPIN, XI_X, XI_Y, A, B, forces, forces_within
from models.core.errors import InputError
from models.machine.compiled import lean
from models.machine.stack import array, doubles

SLOW = 0.1
"""Speed (m/s) of the tread below which slip is relative to it."""
THREE, ORDER = KINDS["three"], MARCHES["second-order"]
FIRST = 7
"""Place of the first flexibility among a contact's numbers."""


@cache
def net(cells: int) -> Grid:
    """Net of the patch with ``cells`` per strip, from 3 to 200; InputError."""
    if isinstance(cells, bool) or not isinstance(cells, int) or not 3 <= cells <= 200:
        raise InputError("", "cells", cells, "must be a whole number from 3 to 200")
    return grid(cells, int(strips_of(np.array(1.0), cells)), "parabolic")


def shape_factor(cells: int) -> float:
    """C / (a^2 b k) as the net sums it up, nearly 8/3."""
    of, found = net(cells), np.empty((1, 4))
    contact = np.array([[1.0, 1.0, 1.0, 1e9, 0.0, 1.0, 0.0, 1.0, 1.0, 1.0]])
    forces(contact, of.strips, of.cells, of.middle, THREE, ORDER, found)
    return -float(found[0, 1])


@lean
def tyre_forces(contacts, slides, strips, cells, middle, found):
    """Fill ``found`` (w, 4) with fx, fy (N) and mz (N m) on tyres; the last column is of no meaning. No array is made.

    contacts (w, 10) : a, b, load, mu, three numbers that are filled in here, and three times 1/k (m^3/N); slides
    (w, 4) : velocity on the road along x and y (m/s), turning about its normal (1/s), speed of the tread (m/s).
    """
    w = len(contacts)
    slips, lanes, slowest = array(doubles(PER_SLIP * w), (w, PER_SLIP)), array(doubles(ROOM), (ROOM,)), SLOW
    for i in range(w):
        slowest = min(slowest, slides[i, 3])
    _creepages(1.0, contacts, slides)
    forces_within(contacts, strips, cells, middle, THREE, ORDER, slips, lanes, found)
    if slowest < SLOW:
        some = array(doubles(4 * w), (w, 4))
        _creepages(-1.0, contacts, slides)
        forces_within(contacts, strips, cells, middle, THREE, ORDER, slips, lanes, some)
        _mix(slides, some, found)


@lean
def _creepages(sign, contacts, slides):
    """Of tyres that roll forwards (sign 1) or backwards (-1)."""
    for i in range(len(contacts)):
        speed = max(abs(slides[i, 3]), SLOW)
        contacts[i, XI_X], contacts[i, XI_Y] = sign * slides[i, 0] / speed, slides[i, 1] / speed
        contacts[i, SPIN] = sign * slides[i, 2] / speed


@lean
def _mix(slides, backwards, found):
    """Forces of rolling forwards with their share, and those of rolling backwards, seen from ahead, with theirs."""
    for i in range(len(found)):
        share = min(1.0, max(0.0, 0.5 + 0.5 * slides[i, 3] / SLOW))
        found[i, 0] = share * found[i, 0] - (1.0 - share) * backwards[i, 0]
        found[i, 1] = share * found[i, 1] + (1.0 - share) * backwards[i, 1]
        found[i, 2] = share * found[i, 2] - (1.0 - share) * backwards[i, 2]


def brush(
    load: float, mu: float, half_length: float, half_width: float, stiffness: float, slides: np.ndarray, cells: int = 21
) -> np.ndarray:
    """fx, fy (N), mz (N m) (m, 3) of one tyre at ``slides`` (m, 4), as ``tyre_forces`` takes them.

    load in N; mu; half_length, half_width of the patch in m; stiffness of its bristles in N/m^3.
    """
    slides = np.atleast_2d(np.asarray(slides, float))
    contacts, found, of = np.zeros((len(slides), 10)), np.empty((len(slides), 4)), net(cells)
    contacts[:, [A, B, LOAD, MU]] = half_length, half_width, load, mu
    contacts[:, FIRST:] = 1.0 / stiffness
    tyre_forces(contacts, slides, of.strips, of.cells, of.middle, found)
    return found[:, :3]
