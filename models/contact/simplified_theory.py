"""Kalker's simplified theory for non-Hertzian contact: "the 1983 program".

J. J. Kalker, A simplified theory for non-Hertzian contact, 8th IAVSD symposium, extensive summaries, 1983, pp. 43-45.

Both bodies are replaced by a bed of springs, u_i = W_i p_i + a_i, in the normal (3) and both tangential directions (1,
2). Contact is where the undeformed distance h is below a depth d = -a_3, and the pressure there is (d - h) / W_3. The
constants follow from the half-space: on a crude net of equal meshes that follows the contact, the pressure gives the
displacements u^H by Boussinesq's influence numbers, and least squares make the springs like them. The depth is
adjusted to the load.

How equation (10) is read
    With p* = W_3 p and u* = W_3 u^H, both known without W_3, the paper minimises the sum of (u* + W_3 L)^2 and calls L
    the undeformed distance. As h >= 0 and u* > 0 that gives a negative W_3, -sum(u* h) / sum(h^2). The condition of
    contact is u^H + h = delta with the rigid approach delta, so L must hold the true approach, h - delta. As delta is
    not known either, both are fitted: least squares of u* / W_3 + h - delta over the contact, which are linear in (1 /
    W_3, delta):
        1 / W_3 = -cov(u*, h) / var(u*),    delta = mean(u* / W_3 + h).
    The mean that is reported as approach is weighted by the pressure, which makes it the work of the pressure by the
    load: off by 0.2 % at most on Hertz's ellipses where the plain mean is off by up to 3 %.

Continuity
    The net is the rectangle about the contact (``Patch.box``), and a mesh counts by the share of it that is covered, so
    nothing enters or leaves at once and the load is a continuous function of the depth. The net of a fixed size would
    make it jump whenever a mesh comes into contact.

Several patches
    Each has a net, W_3 and depth of its own. They share the rigid approach and the half-space: least squares see the
    displacement by all of them (``several_patches``). Where patches lean (tread and flange), the approach and the load
    are those along the common direction, the track's vertical.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.optimize import brentq

from models.contact.fields import ContactFields
from models.contact.inputs import Array, checked_creepages, checked_number, checked_whole_number
from models.contact.material import MaterialPair
from models.contact.patches import NO_DEPTH, Patch, Rectangle, no_bottom_error, separate_patches, single_patch_of
from models.contact.several_patches import coarse_grid, displacement_by_others, solve_depths
from models.contact.simplified_kernels import (
    DISPLACEMENT,
    ELLIPTIC,
    GRADIENT,
    PARABOLIC,
    FineGrid,
    coarse_fit,
    coarse_tractions,
    fine_strips,
    march_strips,
    tangential_displacement,
    tangential_fit,
)
from models.contact.undeformed_distance import UndeformedDistance
from models.core.errors import InputError

COARSE_CELLS = 15
"""Number of cells of the coarse grid along each axis."""
FINE_CELLS = 45
"""Number of strips of the fine grid, and of cells along each strip."""
LEAST_CELLS, MOST_CELLS = 3, 2000
PRESSURE_SHAPES = {"parabolic": PARABOLIC, "elliptic": ELLIPTIC}
DEPTH_BY_APPROACH = 0.6
"""Ratio of a patch's depth to its approach, about; the search for several patches starts there."""
FIT_KINDS = {"displacement": DISPLACEMENT, "gradient": GRADIENT}


@dataclass(frozen=True)
class SimplifiedOptions:
    """Options of the simplified theory: coarse grid, shape of the pressure, kind of fit, separate patches.

    net : meshes of the crude net along each axis. shape : of the pressure over the depth: "parabolic", proportional to
    d - h as the paper has it, or "elliptic", proportional to its root as in Hertz's contact. The latter is nearer to
    the half-space in area and forces, on ellipses in the peak pressure too, so it is what is used where nothing else
    is said. fit : least squares of the displacement or of its gradient, which is what rolling feels. separate : a net
    and constants for each patch, or one for all.
    """

    net: int = COARSE_CELLS
    shape: Literal["parabolic", "elliptic"] = "elliptic"
    fit: Literal["displacement", "gradient"] = "displacement"
    separate: bool = True

    def __post_init__(self) -> None:
        checked_whole_number("net", self.net, 3, 100)
        for name, allowed in (("shape", PRESSURE_SHAPES), ("fit", FIT_KINDS)):
            if getattr(self, name) not in allowed:
                raise InputError("", name, getattr(self, name), "is not known", tuple(allowed))

    @property
    def numbers(self) -> tuple[int, int, int]:
        """Number of coarse cells, shape and kind of fit, coded as compiled functions read them."""
        return self.net, PRESSURE_SHAPES[self.shape], FIT_KINDS[self.fit]


DEFAULT_OPTIONS = SimplifiedOptions()
PAPER_OPTIONS = SimplifiedOptions(shape="parabolic")
"""Options with which the theory is exactly that of the paper."""


@dataclass(frozen=True, eq=False)
class PatchPressure:
    """Normal contact of one patch by the simplified theory.

    depth : d = -a_3 (m). stiffness : 1 / W_3 (Pa/m). approach : rigid approach that the fit finds, along its normal
    (m). load : N. box : x0, x1, y0, y1 of its net (m).
    """

    patch: Patch
    depth: float
    stiffness: float
    approach: float
    load: float
    box: Rectangle


@dataclass(frozen=True, eq=False)
class NormalContact:
    """Normal contact of all patches by the simplified theory.

    approach : rigid approach (m), counted from distance zero. load : N. Both are along the common direction where
    patches lean. area : m^2. peak : largest pressure (Pa). patches : the parts in contact.
    """

    approach: float
    load: float
    area: float
    peak: float
    patches: tuple[PatchPressure, ...]
    pair: MaterialPair
    options: SimplifiedOptions


@dataclass(frozen=True, eq=False)
class SimplifiedRolling:
    """Forces of rolling contact by the simplified theory, the sum over all patches.

    fx, fy : forces on the wheel (N). mz : moment on the wheel about the z axis through x = y = 0 (N m). stick_share :
    sticking part of the area. power : dissipated power by the rolling speed (N). flexibilities : W_1 = W_2 of each
    patch (m/Pa). fields : pressure and tractions of each patch; rows are strips, columns run from the leading edge
    back.
    """

    fx: float
    fy: float
    mz: float
    stick_share: float
    power: float
    flexibilities: tuple[float, ...]
    fields: tuple[ContactFields, ...]


def solve_normal_contact(
    bodies: UndeformedDistance | Sequence[Patch],
    material_pair: MaterialPair,
    *,
    load: float | None = None,
    approach: float | None = None,
    simplified_options: SimplifiedOptions = DEFAULT_OPTIONS,
) -> NormalContact:
    """Normal contact of two bodies under a load (N), or at a rigid approach (m): area, pressure and approach.

    bodies : their undeformed distance, or the patches of a wheel on a rail.

    Zero or negative load, or bodies apart, give an empty contact. Raises InputError for a load that is not one finite
    number, both or neither of load and approach, no bodies, or a contact that reaches the edge of the distance.
    """
    if (load is None) == (approach is None):
        raise InputError("", "load", load, "give either the load in N or the approach in m")
    if isinstance(bodies, UndeformedDistance):
        bodies = separate_patches(bodies) if simplified_options.separate else single_patch_of(bodies)
    patches = list(bodies)
    if not patches:
        raise InputError("", "bodies", bodies, "must be an undeformed distance, or one patch at least")
    lowest = min(patch.low / np.cos(patch.lean) for patch in patches)
    if load is not None:
        wanted = checked_number("load", load, "a load in N, up to 1e9", -1e9, 1e9)
        if wanted <= 0.0:
            return _sum_of_patches(lowest, (), material_pair, simplified_options)
        return _contact_under_load(patches, lowest, wanted, material_pair, simplified_options)
    reached = checked_number("approach", approach, "an approach in m, up to 0.1", -0.1, 0.1)
    if reached <= lowest:
        return _sum_of_patches(reached, (), material_pair, simplified_options)
    return _patches_at_common_approach(patches, reached, None, material_pair, simplified_options)


def load_at_depth(
    patch: Patch, depth: float, material_pair: MaterialPair, simplified_options: SimplifiedOptions = DEFAULT_OPTIONS
) -> PatchPressure:
    """Load and approach of one patch at a depth d = -a_3 (m), the paper's N(a_3); W_3 is fitted on the coarse grid."""
    if depth <= patch.low:
        return PatchPressure(patch, depth, 0.0, depth, 0.0, (0.0, 0.0, 0.0, 0.0))
    box = patch.box(depth)
    stiffness, approach, volume = coarse_fit(patch.surface(depth), *simplified_options.numbers, material_pair.modulus)
    if not (volume > 0.0 and np.isfinite(stiffness)):  # so shallow that rounding leaves nothing of it
        return PatchPressure(patch, depth, 0.0, depth, 0.0, box)
    return PatchPressure(patch, depth, stiffness, approach, volume * stiffness, box)


def _contact_under_load(
    patches: list[Patch],
    lowest_depth: float,
    load: float,
    material_pair: MaterialPair,
    simplified_options: SimplifiedOptions,
) -> NormalContact:
    """Normal contact that carries a load (N): the depth of a single patch, or the depths and common approach of
    several.
    """
    if len(patches) == 1:
        patch, along = patches[0], np.cos(patches[0].lean)
        depth = _depth_for_load(
            lambda d: along * load_at_depth(patch, d, material_pair, simplified_options).load,
            load,
            patch.low,
            patch.edge,
        )
        alone = load_at_depth(patch, depth, material_pair, simplified_options)
        return _sum_of_patches(alone.approach / along, (alone,), material_pair, simplified_options)

    def alone_at(reached_approach: float) -> float:
        depths = zip(patches, _rough_depths(patches, reached_approach), strict=True)
        return _total_load([load_at_depth(patch, depth, material_pair, simplified_options) for patch, depth in depths])

    return _patches_at_common_approach(
        patches, _depth_for_load(alone_at, load, lowest_depth, np.inf), load, material_pair, simplified_options
    )


def _depth_for_load(load_at: Callable[[float], float], load: float, lowest_depth: float, largest_depth: float) -> float:
    """Depth or approach (m) above ``lowest_depth`` at which the load is carried: doubled until the load is exceeded,
    then refined by Brent's method.
    """
    if largest_depth - lowest_depth <= NO_DEPTH:
        raise no_bottom_error()
    low, high = 0.0, min(1e-6, largest_depth - lowest_depth)
    while load_at(lowest_depth + high) < load:
        if lowest_depth + high >= largest_depth:
            raise InputError(
                "",
                "load",
                load,
                "makes contact reach the edge of the area over which the distance is "
                f"known (there it carries {load_at(largest_depth):.4g} N): give a larger area",
            )
        low, high = high, min(2.0 * high, largest_depth - lowest_depth)
    return lowest_depth + float(
        brentq(lambda over: load_at(lowest_depth + over) - load, low, high, xtol=1e-20, rtol=1e-14)
    )


def _total_load(patch_pressures: Sequence[PatchPressure]) -> float:
    """Sum of the patches' loads (N) along the common direction."""
    return float(sum(part.load * np.cos(part.patch.lean) for part in patch_pressures))


def _rough_depths(patches: list[Patch], approach: float) -> list[float]:
    """Rough depths (m) of patches at an approach (m): a fixed share of the approach beyond each patch's first touch."""
    over = [approach * np.cos(patch.lean) - patch.low for patch in patches]
    return [
        float(patch.low + (DEPTH_BY_APPROACH * o if o > 0.0 else o)) for patch, o in zip(patches, over, strict=True)
    ]


def _patches_at_common_approach(
    patches: list[Patch],
    approach: float,
    load: float | None,
    material_pair: MaterialPair,
    simplified_options: SimplifiedOptions,
) -> NormalContact:
    """Patches at their common approach (m); if a load (N) is given, the approach that carries it is found from here."""
    start = np.array([*_rough_depths(patches, approach), approach])
    (*depths, reached), stiffnesses, loads = solve_depths(
        patches, start, load, material_pair, simplified_options.numbers
    )
    parts = []
    for patch, depth, stiffness, carried in zip(patches, map(float, depths), stiffnesses, loads, strict=True):
        if carried > 0.0:
            along = float(reached * np.cos(patch.lean))
            parts.append(PatchPressure(patch, depth, float(stiffness), along, float(carried), patch.box(depth)))
    return _sum_of_patches(float(reached), tuple(parts), material_pair, simplified_options)


def _sum_of_patches(
    approach: float,
    patch_pressures: tuple[PatchPressure, ...],
    material_pair: MaterialPair,
    simplified_options: SimplifiedOptions,
) -> NormalContact:
    """Normal contact summed over the patches; area and peak pressure come from strips with exact ends."""
    area = sum(_patch_area(part) for part in patch_pressures)
    peak = max((part.stiffness * (part.depth - part.patch.low) for part in patch_pressures), default=0.0)
    return NormalContact(
        approach, _total_load(patch_pressures), area, peak, patch_pressures, material_pair, simplified_options
    )


def _patch_area(patch: PatchPressure, line_count: int = 100) -> float:
    """Area (m^2) of one contact patch."""
    net = fine_strips(patch.patch.surface(patch.depth), line_count, 1, PARABOLIC)
    return float((net.high_x - net.low_x).sum() * (patch.box[3] - patch.box[2]) / line_count) if net.y.size else 0.0


def solve_rolling_contact(
    normal_contact: NormalContact,
    friction: float,
    xi_x: float,
    xi_y: float,
    spin: float,
    *,
    cell_count: int = FINE_CELLS,
) -> SimplifiedRolling:
    """Forces of steady rolling: FASTSIM twice on the fine grid of each patch, W_1 = W_2 refitted in between.

    friction : coefficient. xi_x, xi_y : creepages. spin : 1/m. cell_count : strips, and cells in each, 3 or more. Spin
    and moment are about x = y = 0 of the distance, where patches lean of each patch; roll these one by one if their
    creepages differ. Raises InputError for what is not one finite number, a friction below zero, too few cells, or
    bodies too unlike for the slip that their pressure makes to be left out.
    """
    normal_contact.pair.require_likeness()
    friction = checked_number("friction", friction, "a coefficient of friction from 0 to 10", 0.0, 10.0)
    motion = tuple(checked_creepages(xi_x, xi_y, spin, checked_number).values())
    cell_count = checked_whole_number("cells", cell_count, LEAST_CELLS, MOST_CELLS)
    fine = [_fine_strips(part, normal_contact.options, cell_count) for part in normal_contact.patches]
    tractions = [np.zeros((*net.pressure.shape, 2)) for net in fine]
    tractions_on_coarse_cells = []
    # W_1 = W_2 = W_3 is the paper's first estimate. a_1 and a_2 drop out: rolling feels du/dx alone, and they are
    # constant over the patch.
    for part, net, traction in zip(normal_contact.patches, fine, tractions, strict=True):
        march_strips(net, friction, 1.0 / part.stiffness, motion, traction)
        tractions_on_coarse_cells.append(coarse_tractions(net, traction, part.box, normal_contact.options.net))
    flexibilities = _refitted_flexibilities(normal_contact, tractions_on_coarse_cells)
    rolled = [
        march_strips(net, friction, flexibility, motion, traction)
        for net, flexibility, traction in zip(fine, flexibilities, tractions, strict=True)
    ]
    fx, fy, mz, stuck, area = (float(sum(forces[k] for forces in rolled)) for k in range(5))
    power = -(fx * motion[0] + fy * motion[1] + mz * motion[2])
    fields = tuple(_fields_of_patch(net, traction, friction) for net, traction in zip(fine, tractions, strict=True))
    return SimplifiedRolling(fx, fy, mz, stuck / area if area > 0.0 else 0.0, power, tuple(flexibilities), fields)


def _fine_strips(patch: PatchPressure, simplified_options: SimplifiedOptions, cell_count: int) -> FineGrid:
    """``FineGrid`` of a patch whose pressure carries its load, as ``march_strips`` expects it."""
    net = fine_strips(
        patch.patch.surface(patch.depth), cell_count, cell_count, PRESSURE_SHAPES[simplified_options.shape]
    )
    carried = net.pressure.sum(axis=1) @ (net.high_x - net.low_x) * net.width / cell_count
    net.pressure[:] *= patch.load / carried  # full sliding gives mu N exactly
    return net


def _refitted_flexibilities(normal_contact: NormalContact, tractions: list[Array]) -> list[float]:
    """Flexibility W_1 = W_2 (m/Pa) of each patch from the least-squares fit u = W p + a on the coarse grids, with
    displacements u by the tractions of all patches.

    It is W_3 if no traction can be fitted.
    """
    options, pair = normal_contact.options, normal_contact.pair
    nets = [coarse_grid(part.patch, part.depth, options.net, PARABOLIC) for part in normal_contact.patches]
    flexibilities = []
    for k, (part, net, traction) in enumerate(zip(normal_contact.patches, nets, tractions, strict=True)):
        u = tangential_displacement(traction, *net.step, pair.nu) / (np.pi * pair.G) + displacement_by_others(
            nets, tractions, k, pair
        )
        fitted = float(tangential_fit(u, traction, net.cover, *net.step, FIT_KINDS[options.fit]))
        flexibilities.append(fitted if fitted > 0.0 else 1.0 / part.stiffness)
    return flexibilities


def _fields_of_patch(fine_net: FineGrid, traction: Array, friction: float) -> ContactFields:
    """Pressure, tractions and slip in each cell of each strip of a patch."""
    y, low, high, width, pressure = fine_net
    shape = pressure.shape
    length = ((high - low) / shape[1])[:, None]
    x = high[:, None] - (np.arange(shape[1]) + 0.5) * length
    px, py = traction[..., 0], traction[..., 1]
    slips = np.hypot(px, py) >= friction * pressure * (1.0 - 1e-9)
    lines, lengths = np.broadcast_to(y[:, None], shape), np.broadcast_to(length, shape)
    return ContactFields(x, lines, lengths, np.full(shape, width), pressure, px, py, slips, np.full(shape, True))
