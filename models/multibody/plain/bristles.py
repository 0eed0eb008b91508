"""Creep forces of a tyre as an elliptic patch of bristles, in plain numpy: tractions as complex numbers, strip by
strip.

The law of ``models.tyre.bristles`` (Kalker's simplified theory, marched to second order) on a net that is made anew
here. Pressure is parabolic. In a strip's own scale, tractions by the bound in its middle, a bristle runs from 1 to -1;
without slip its traction p changes by -w per cell, w the rigid slip. Where it slides it keeps on the bound, and its
angle to -w obeys psi' = -(|w| / g) sin psi: the tangent of the half angle shrinks by an exponential, taken as an
eighth power. A slip that turns over a step counts a little after its middle.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

FADING_SPEED = 0.1
"""Speed (m/s) of the tread below which slip is taken relative to this speed, and the forces of both rolling directions
are mixed."""
MARGIN = 1.0 + 2e-15
"""Factor by which a traction bound is enlarged where a traction is projected onto it."""
NEGLIGIBLE_SLIP = 1e-60
"""Square of a rigid slip below which it does not change the direction of a traction."""
LARGEST_EXPONENT = 50.0


class PatchGrid(NamedTuple):
    """Grid of the contact patch. Strips: position y / b, ratio of half length to a, share of the load per cell and
    height; cells: positions of their centres and of the middles of the steps to them, bounds at both; ``peak``:
    pressure in the patch's middle times a b / N."""

    y: np.ndarray
    half: np.ndarray
    share: np.ndarray
    centre: np.ndarray
    middle: np.ndarray
    bound: np.ndarray
    bound_between: np.ndarray
    peak: float


@cache
def grid_of_patch(cell_count: int) -> PatchGrid:
    """Grid of a contact patch with an even number of strips of equal width, at least ``cell_count``, and ``cell_count``
    cells in each."""
    count = cell_count + cell_count % 2
    y = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    centre = 1.0 - (2.0 * np.arange(cell_count) + 1.0) / cell_count
    middle = 1.0 - 2.0 * np.arange(cell_count) / cell_count
    middle[0] = 1.0 - 0.5 / cell_count
    bound, half = 1.0 - centre**2, np.sqrt(1.0 - y**2)
    share = (1.0 - y**2) * half
    carried = share.sum() * bound.sum()
    return PatchGrid(
        y, half, share / carried, centre, middle, bound, 1.0 - middle**2, cell_count * count / (4.0 * carried)
    )


class TyrePatches(NamedTuple):
    """Contact patches of w tyres, each (w,): half length and half width (m), load (N), friction coefficient, stiffness
    of the bristles (N/m^3)."""

    half_length: np.ndarray
    half_width: np.ndarray
    load: np.ndarray
    mu: np.ndarray
    stiffness: np.ndarray


def tyre_forces(contact_patches: TyrePatches, sliding_velocities: np.ndarray, cell_count: int) -> np.ndarray:
    """Creep forces fx, fy (N) and moments mz (N m) on w tyres, (w, 3).

    sliding_velocities (w, 4) : velocity on the road along and across (m/s), turning (1/s), speed of the tread (m/s).
    """
    tread = sliding_velocities[:, 3]
    ahead = _forward_rolling_forces(
        contact_patches, sliding_velocities[:, :3], np.maximum(np.abs(tread), FADING_SPEED), cell_count
    )
    if (tread >= FADING_SPEED).all():
        return ahead
    mirrored = sliding_velocities[:, :3] * np.array([-1.0, 1.0, -1.0])
    behind = _forward_rolling_forces(
        contact_patches, mirrored, np.maximum(np.abs(tread), FADING_SPEED), cell_count
    ) * np.array([-1.0, 1.0, -1.0])
    part = np.clip(0.5 + 0.5 * tread / FADING_SPEED, 0.0, 1.0)[:, None]
    mixed: np.ndarray = part * ahead + (1.0 - part) * behind
    return mixed


def cornering_factor(cell_count: int) -> float:
    """Ratio, near 8/3, of the cornering stiffness without sliding to a^2 b k (half length a, half width b, bristle
    stiffness k) on the grid of cells."""
    ones = np.ones(1)
    return -float(
        tyre_forces(TyrePatches(ones, ones, ones, 1e9 * ones, ones), np.array([[0.0, 1.0, 0.0, 1.0]]), cell_count)[0, 1]
    )


def _forward_rolling_forces(
    contact_patches: TyrePatches, sliding_velocities: np.ndarray, rolling_speeds: np.ndarray, cell_count: int
) -> np.ndarray:
    """Creep forces fx, fy (N) and moments mz (N m), (w, 3), of tyres that roll forwards."""
    of = grid_of_patch(cell_count)
    a, b = contact_patches.half_length[:, None], contact_patches.half_width[:, None]
    grip, area = contact_patches.mu * contact_patches.load, contact_patches.half_length * contact_patches.half_width
    stretch = 2.0 / cell_count * contact_patches.stiffness * contact_patches.half_length * area
    gain = np.divide(stretch, of.peak * grip, out=np.zeros(len(a)), where=grip > 0.0)  # of a slip per bound and cell
    x, y, spin = (sliding_velocities / rolling_speeds[:, None] * gain[:, None]).T[:, :, None]
    across = of.half / (1.0 - of.y**2)
    slip = (across * (x - spin * b * of.y) + 1j * across * y).ravel()
    turning = 1j * (across * spin * a * of.half).ravel()
    pulled, twisted = (part.reshape(len(a), -1) for part in _strip_sums(of, slip, turning))
    force = grip[:, None] * of.share
    moment = force * (a * of.half * twisted - b * of.y * pulled.real)
    return np.column_stack([(force * pulled.real).sum(1), (force * pulled.imag).sum(1), moment.sum(1)])


def _strip_sums(
    patch_grid: PatchGrid, slip_per_cell: np.ndarray, slip_gradient: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Sums over the cells of each strip, from the leading edge on: of tractions (complex), and of position times
    lateral traction.

    slip_per_cell, slip_gradient : rigid slip per cell in a strip's middle, along + i across, and its change by the
    place."""
    traction, slides = _limited_tractions(
        -0.5 * (slip_per_cell + slip_gradient * patch_grid.middle[0]), patch_grid.bound[0]
    )
    pulled, twisted, turn = (
        traction.copy(),
        patch_grid.centre[0] * traction.imag,
        -2.0 * slip_gradient / len(patch_grid.centre),
    )
    for i in range(1, len(patch_grid.centre)):
        w = slip_per_cell + slip_gradient * patch_grid.middle[i]
        traction, slides = _next_tractions(
            traction, slides, w, turn, (patch_grid.bound[i], patch_grid.bound[i - 1], patch_grid.bound_between[i])
        )
        pulled += traction
        twisted += patch_grid.centre[i] * traction.imag
    return pulled, twisted


def _limited_tractions(tractions: np.ndarray, friction_bound: float) -> tuple[np.ndarray, np.ndarray]:
    """Tractions limited to the friction bound, and flags of those that exceeded it."""
    size = np.abs(tractions)
    beyond = size > friction_bound
    return np.where(beyond, friction_bound * tractions / np.where(beyond, size, 1.0), tractions), beyond


def _next_tractions(
    tractions_before: np.ndarray,
    is_sliding: np.ndarray,
    slip_per_cell: np.ndarray,
    slip_change: np.ndarray,
    friction_bounds: tuple[float, float, float],
) -> tuple[np.ndarray, np.ndarray]:
    """Tractions in the next cell, and flags of the bristles that slide there. bounds: in that cell, in the one before,
    and between them."""
    bound, last, between = friction_bounds
    stuck = tractions_before - slip_per_cell
    after, beyond = _limited_tractions(stuck, bound)
    if not (is_sliding & beyond).any():
        return after, beyond
    z = (np.abs(slip_per_cell.real) + np.abs(slip_per_cell.imag)) / (8.0 * between)
    slip_per_cell = slip_per_cell + slip_change * np.minimum(np.minimum(0.5 * z, 0.12 + 0.2 * z), 0.47)
    size = np.abs(slip_per_cell)
    turns = is_sliding & beyond & (size * size > NEGLIGIBLE_SLIP)
    size = np.where(turns, size, 1.0)
    h = np.minimum(size / (8.0 * between), LARGEST_EXPONENT)
    grown = (1.0 + h * (1.0 + h * (0.5 + h / 6.0))) ** 8
    angle = tractions_before * np.conj(-slip_per_cell)
    half = grown * (last * MARGIN * size + angle.real) + 1j * angle.imag
    turned = bound * (-slip_per_cell / size) * half * half / np.maximum(np.abs(half) ** 2, 1e-300)
    return np.where(turns, turned, after), beyond
