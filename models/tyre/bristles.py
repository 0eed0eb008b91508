"""Creep forces of a tyre as an elastic foundation: an elliptic patch of bristles that roll through it and slide under
friction.

This is Kalker's simplified theory (``models.contact``, marched to second order) with the bristles of a tyre instead of
an elastic half-space: one stiffness k (N/m^3) along and across, pressure parabolic. Of the patch, the half width b is
constant and the half length is a = sqrt(R N / k_z), R the free radius and N / k_z the deflection; so C = 8/3 a^2 b k,
the cornering stiffness while nothing slides, is proportional to the load. k is such that C at the tyre's static load is
the cornering stiffness of the ride vehicle, to the net's own digits. The aligning moment of small slip has the arm 3 pi
a / 32 behind the centre. A camber's, a path's and a steering wheel's turning spin the patch, and are felt as such.

Slip is relative to the speed u at which the tread runs through the patch, |u| below ``FADING_SPEED`` counting as that:
there bristles act like dampers, so a tyre at rest creeps, by as much less as FADING_SPEED is small. Between
FADING_SPEED and -FADING_SPEED the forces of rolling forwards and backwards are mixed, so that nothing jumps. Both have
no power, nor has a mixture."""

from functools import cache

import numpy as np

from models.contact.fastsim import FLEXIBILITY_KINDS, MARCH_KINDS
from models.contact.fastsim_grid import FastsimGrid, count_of_strips, ellipse_grid
from models.contact.fastsim_many import fill_contact_forces, fill_contact_forces_in_place
from models.contact.fastsim_records import BLOCK, CONTACT, FORCES, SLIP, MarchWorkspace, cells_in, strips_in
from models.core.errors import InputError
from models.machine.compiled import lean
from models.machine.records import records_at_pointer, stack_records
from models.machine.stack import start

FADING_SPEED = 0.1
"""Speed (m/s) of the tread below which slip is taken relative to this speed instead."""
THREE_BRISTLES, SECOND_ORDER_MARCH = FLEXIBILITY_KINDS["three"], MARCH_KINDS["second-order"]
FIRST_FLEXIBILITY = 7
"""Index of the first flexibility among the numbers of a contact."""
UNIT_CONTACT = {"a": 1.0, "b": 1.0, "load": 1.0, "mu": 1e9, "xi_y": 1.0, "l1": 1.0, "l2": 1.0, "l3": 1.0}
"""Contact patch that sticks everywhere and whose side force is the cornering stiffness C."""


@cache
def patch_grid(cell_count: int) -> FastsimGrid:
    """Grid of a contact patch with ``cell_count`` cells per strip, from 3 to 200. Raises InputError otherwise."""
    if isinstance(cell_count, bool) or not isinstance(cell_count, int) or not 3 <= cell_count <= 200:
        raise InputError("", "cells", cell_count, "must be a whole number from 3 to 200")
    return ellipse_grid(cell_count, int(count_of_strips(np.array(1.0), cell_count)), "parabolic")


def cornering_stiffness_factor(cell_count: int) -> float:
    """Ratio, near the exact 8/3, of the cornering stiffness to a^2 b k (half length a, half width b, bristle stiffness
    k), for a patch with ``cell_count`` cells."""
    contacts, answers = np.zeros(1, CONTACT), np.empty(1, FORCES)
    for name, value in UNIT_CONTACT.items():
        contacts[name] = value
    fill_contact_forces(contacts, *patch_grid(cell_count).records, THREE_BRISTLES, SECOND_ORDER_MARCH, answers)
    return -float(answers["fy"][0])


@lean
def tyre_forces(patch_contacts, sliding_velocities, grid_strips, cell_table, middle_pressure, forces_out):
    """Fill ``forces_out`` (w, 4) with the creep forces fx, fy (N) and moments mz (N m) on w tyres; the last column has
    no meaning. No array is allocated.

    patch_contacts (w, 10) : a, b, load, mu, three numbers that are filled in here, and three times 1/k (m^3/N);
    sliding_velocities (w, 4) : velocity on the road along x and y (m/s), turning about its normal (1/s), speed of the
    tread (m/s); grid_strips (4, m), cell_table (5, n), middle_pressure : the patch's net as ``FastsimGrid`` holds it.
    """
    w = len(patch_contacts)
    patches, answers = (
        records_at_pointer(start(patch_contacts), w, CONTACT),
        records_at_pointer(start(forces_out), w, FORCES),
    )
    lines, cells = strips_in(grid_strips), cells_in(cell_table, middle_pressure)
    room, slowest = MarchWorkspace(stack_records(w, SLIP), stack_records(1, BLOCK)), FADING_SPEED
    for i in range(w):
        slowest = min(slowest, sliding_velocities[i, 3])
    _creepages(1.0, patches, sliding_velocities)
    fill_contact_forces_in_place(patches, lines, cells, THREE_BRISTLES, SECOND_ORDER_MARCH, room, answers)
    if slowest < FADING_SPEED:
        backwards = stack_records(w, FORCES)
        _creepages(-1.0, patches, sliding_velocities)
        fill_contact_forces_in_place(patches, lines, cells, THREE_BRISTLES, SECOND_ORDER_MARCH, room, backwards)
        _blend_directions(sliding_velocities, backwards, answers)


@lean
def _creepages(direction_sign, patch_contacts, sliding_velocities):
    """Fill the creepages of tyres that roll forwards (sign 1) or backwards (sign -1), from the sliding velocities
    (m/s)."""
    for i in range(len(patch_contacts)):
        patch, speed = patch_contacts[i], max(abs(sliding_velocities[i, 3]), FADING_SPEED)
        patch.xi_x, patch.xi_y = direction_sign * sliding_velocities[i, 0] / speed, sliding_velocities[i, 1] / speed
        patch.spin = direction_sign * sliding_velocities[i, 2] / speed


@lean
def _blend_directions(sliding_velocities, backwards, forces_out):
    """Blend the forces of forward and of backward rolling in ``forces_out``, weighted by the speed of the tread; those
    of backward rolling are mirror images, whose fx and mz change their sign."""
    for i in range(len(forces_out)):
        share, answer, behind = (
            min(1.0, max(0.0, 0.5 + 0.5 * sliding_velocities[i, 3] / FADING_SPEED)),
            forces_out[i],
            backwards[i],
        )
        answer.fx = share * answer.fx - (1.0 - share) * behind.fx
        answer.fy = share * answer.fy + (1.0 - share) * behind.fy
        answer.mz = share * answer.mz - (1.0 - share) * behind.mz


def brush_forces(
    load: float,
    mu: float,
    half_length: float,
    half_width: float,
    bristle_stiffness: float,
    sliding_velocities: np.ndarray,
    cell_count: int = 21,
) -> np.ndarray:
    """Creep forces fx, fy (N) and moments mz (N m), (m, 3), of a tyre at sliding velocities (m, 4) as in
    ``tyre_forces``.

    load in N; mu; half_length, half_width of the patch in m; stiffness of its bristles in N/m^3.
    """
    sliding_velocities = np.atleast_2d(np.asarray(sliding_velocities, float))
    contacts, forces, cell_net = (
        np.zeros((len(sliding_velocities), 10)),
        np.empty((len(sliding_velocities), 4)),
        patch_grid(cell_count),
    )
    patches = contacts.view(CONTACT)
    patches["a"], patches["b"], patches["load"], patches["mu"] = half_length, half_width, load, mu
    patches["l1"] = patches["l2"] = patches["l3"] = 1.0 / bristle_stiffness
    tyre_forces(contacts, sliding_velocities, cell_net.strips, cell_net.cells, cell_net.middle, forces)
    return forces[:, :3]
