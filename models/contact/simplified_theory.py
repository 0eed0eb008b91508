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
    Each has a net, W_3 and depth of its own. They share the rigid approach, and each is pushed down by the others'
    pressure as the half-space has it, as a whole. Where patches lean (tread and flange), the approach
    and the load are those along the common direction, the track's vertical.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.optimize import brentq

from models.contact.fields import Fields
from models.contact.half_space import Convolution, influence, offsets
from models.contact.inputs import quantity
from models.contact.material import Pair
from models.contact.patches import Box, Patch, separate, whole
from models.contact.simplified_kernels import (
    DISPLACEMENT,
    ELLIPTIC,
    GRADIENT,
    PARABOLIC,
    crude_fit,
    crude_net,
    gather,
    march,
    mean_push,
    strips,
)
from models.contact.undeformed_distance import Distance
from models.errors import InputError, RunFailed

NET = 15
"""Meshes of the crude net along each axis."""
CELLS = 45
"""Strips of the fine net, and cells along each strip."""
SHAPES = {"parabolic": PARABOLIC, "elliptic": ELLIPTIC}
FITS = {"displacement": DISPLACEMENT, "gradient": GRADIENT}
CLOSE = 1e-13
"""Change of the depths, as a share of the approach, at which patches that press on each other have settled."""
PASSES = 200
ROUNDING = 1e-12
"""Depth (m) above the bottom below which rounding spoils the ratio of approach and depth."""


@dataclass(frozen=True)
class Options:
    """How the theory is used.

    net : meshes of the crude net along each axis. shape : of the pressure over the depth: "parabolic", proportional to
    d - h as the paper has it, or "elliptic", proportional to its root as in Hertz's contact. The latter is nearer to
    the half-space in area, peak pressure and forces, so it is what is used where nothing else is said. fit : least
    squares of the displacement or of its gradient, which is what rolling feels. separate : a net and constants for
    each patch, or one for all.
    """

    net: int = NET
    shape: Literal["parabolic", "elliptic"] = "elliptic"
    fit: Literal["displacement", "gradient"] = "displacement"
    separate: bool = True

    def __post_init__(self) -> None:
        if not 3 <= self.net <= 100:
            raise InputError("", "net", self.net, "must be from 3 to 100 meshes")
        for name, allowed in (("shape", SHAPES), ("fit", FITS)):
            if getattr(self, name) not in allowed:
                raise InputError("", name, getattr(self, name), "is not known", tuple(allowed))


PLAIN = Options()
PAPER = Options(shape="parabolic")
"""The theory to the letter."""


@dataclass(frozen=True, eq=False)
class PatchPressure:
    """Normal contact of one patch.

    depth : d = -a_3 (m). stiffness : 1 / W_3 (Pa/m). approach : rigid approach that the fit finds for this pressure
    alone (m). load : N. box : x0, x1, y0, y1 of its net (m).
    """

    patch: Patch
    depth: float
    stiffness: float
    approach: float
    load: float
    box: Box


@dataclass(frozen=True, eq=False)
class NormalContact:
    """Normal contact by the simplified theory.

    approach : rigid approach (m), counted from distance zero. load : N. Both are along the common direction where
    patches lean. area : m^2. peak : largest pressure (Pa). patches : the parts in contact.
    """

    approach: float
    load: float
    area: float
    peak: float
    patches: tuple[PatchPressure, ...]
    pair: Pair
    options: Options


@dataclass(frozen=True, eq=False)
class Rolling:
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
    fields: tuple[Fields, ...]


def press(bodies: Distance | Sequence[Patch], pair: Pair, *, load: float | None = None, approach: float | None = None,
          options: Options = PLAIN) -> NormalContact:  # fmt: skip
    """Area, pressure and approach of two bodies, by a load (N) or by a rigid approach (m).

    bodies : their undeformed distance, or the patches of a wheel on a rail.

    Zero or negative load, or bodies apart, give an empty contact. Raises InputError for a load that is not finite, both
    or neither of load and approach, or a contact that reaches the edge of the distance.
    """
    if (load is None) == (approach is None):
        raise InputError("", "load", load, "give either the load in N or the approach in m")
    if isinstance(bodies, Distance):
        bodies = separate(bodies) if options.separate else whole(bodies)
    patches = list(bodies)
    lowest = min(patch.low / np.cos(patch.lean) for patch in patches)
    if load is not None:
        wanted = float(quantity("load", load, "a load in N, up to 1e9", -1e9, 1e9))
        if wanted <= 0.0:
            return _gathered(lowest, (), pair, options)
        return _by_load(patches, lowest, wanted, pair, options)
    reached = float(quantity("approach", approach, "an approach in m, up to 0.1", -0.1, 0.1))
    return _gathered(reached, _share(patches, reached, pair, options), pair, options)


def load_at_depth(patch: Patch, depth: float, pair: Pair, options: Options = PLAIN) -> PatchPressure:
    """One patch at a depth d = -a_3 (m): the paper's N(a_3), with W_3 and the approach fitted on the crude net."""
    if depth <= patch.low:
        return PatchPressure(patch, depth, 0.0, depth, 0.0, (0.0, 0.0, 0.0, 0.0))
    box, (origin, step) = patch.box(depth), _grid(patch)
    stiffness, approach, volume = crude_fit(
        patch.distance.padded, origin, step, box, depth, patch.low, options.net, SHAPES[options.shape],
        FITS[options.fit], pair.modulus)  # fmt: skip
    if not (volume > 0.0 and np.isfinite(stiffness)):  # so shallow that rounding leaves nothing of it
        return PatchPressure(patch, depth, 0.0, depth, 0.0, box)
    return PatchPressure(patch, depth, stiffness, approach, volume * stiffness, box)


def _grid(patch: Patch) -> tuple[tuple[float, float], tuple[float, float]]:
    """First node and spacing along x and y."""
    distance = patch.distance
    return (float(distance.x[0]), float(distance.y[0])), (distance.dx, distance.dy)


def _by_load(patches: list[Patch], lowest: float, load: float, pair: Pair, options: Options) -> NormalContact:
    """Find the depth of a single patch, or the common approach of several, that carries the load."""
    if len(patches) == 1:
        patch, along = patches[0], np.cos(patches[0].lean)
        depth = _found(lambda d: load_at_depth(patch, d, pair, options).load, load / along, patch.low, patch.edge)
        alone = load_at_depth(patch, depth, pair, options)
        return _gathered(alone.approach / along, (alone,), pair, options)
    approach = _found(lambda reached: _total(_share(patches, reached, pair, options)), load, lowest, np.inf)
    return _gathered(approach, _share(patches, approach, pair, options), pair, options)


def _found(load_at: Callable[[float], float], load: float, lowest: float, limit: float) -> float:
    """Depth or approach (m) above ``lowest`` at which the load is carried: doubled until it is, then Brent's method."""
    low, high = 0.0, min(1e-6, limit - lowest)
    while load_at(lowest + high) < load:
        if lowest + high >= limit:
            raise InputError("", "load", load, "makes contact reach the edge of the area over which the distance is "
                             f"known (there it carries {load_at(limit):.4g} N): give a larger area")  # fmt: skip
        low, high = high, min(2.0 * high, limit - lowest)
    return lowest + float(brentq(lambda over: load_at(lowest + over) - load, low, high, xtol=1e-20, rtol=1e-14))


def _total(parts: tuple[PatchPressure, ...]) -> float:
    return float(sum(part.load * np.cos(part.patch.lean) for part in parts))


def _share(patches: list[Patch], approach: float, pair: Pair, options: Options) -> tuple[PatchPressure, ...]:
    """The patches at a common rigid approach, each pushed down by the others.

    A patch alone follows approach - low = ratio (depth - low) with a ratio that hardly changes, which gives the next
    depth; the displacements by the others are less than their own, so passing on converges, relaxed by Aitken's rule
    where patches that grow together make the ratio turn sharply.
    """
    low = np.array([patch.low for patch in patches])
    reached = approach * np.cos([patch.lean for patch in patches])
    depths, ratios = low + 0.6 * (reached - low), np.full(len(patches), 1.0 / 0.6)
    before, share = np.zeros(len(patches)), 1.0
    for _ in range(PASSES):
        parts = tuple(load_at_depth(p, float(d), pair, options) for p, d in zip(patches, depths, strict=True))
        for k, part in enumerate(parts):
            if part.load > 0.0 and part.depth - low[k] > ROUNDING:
                ratios[k] = (part.approach - low[k]) / (part.depth - low[k])
        off = np.maximum(low + (reached - _pushed(parts, pair, options) - low) / ratios, low) - np.maximum(depths, low)
        if np.abs(off).max() <= CLOSE * abs(approach):
            return tuple(part for part in parts if part.load > 0.0)
        share = _relaxed(share, before, off)
        depths, before = np.maximum(depths, low) + share * off, off
    raise RunFailed("simplified theory", f"patches that share an approach of {approach:.4g} m did not settle")


def _relaxed(share: float, before: np.ndarray, off: np.ndarray) -> float:
    """Share of the next change that is taken: Aitken's, from how the last change changed it (Irons and Tuck, 1969)."""
    turned = off - before
    square = float(turned @ turned)
    return float(np.clip(-share * (before @ turned) / square, 0.02, 1.5)) if before.any() and square > 0.0 else 1.0


def _pushed(parts: tuple[PatchPressure, ...], pair: Pair, options: Options) -> np.ndarray:
    """Displacement (m) of each patch, weighted by its pressure, by the others', each mesh a load N / (pi E* r)."""
    nets = [_net(part, options) for part in parts]
    found = np.zeros(len(parts))
    for k, (x, y, _, weight) in enumerate(nets):
        for m, (other_x, other_y, force, _) in enumerate(nets):
            if m != k and parts[m].load > 0.0:
                found[k] += mean_push(other_x, other_y, force, x, y, weight) / (np.pi * pair.modulus)
    return found


def _net(part: PatchPressure, options: Options) -> tuple[np.ndarray, ...]:
    """Crude net of one patch, flat: x, y along the common contour (m), load (N) and weight of every mesh.

    A patch that carries nothing is its bottom, which it shrinks to, and which the others push.
    """
    if part.load == 0.0:
        bottom = part.patch.bottom
        return np.array([bottom[0]]), np.array([bottom[1] + part.patch.place]), np.zeros(1), np.ones(1)
    x0, x1, y0, y1 = part.box
    middles = (np.arange(options.net) + 0.5) / options.net
    y, x = np.meshgrid(y0 + middles * (y1 - y0) + part.patch.place, x0 + middles * (x1 - x0), indexing="ij")
    origin, step = _grid(part.patch)
    pressure = crude_net(part.patch.distance.padded, origin, step, part.box, part.depth, part.patch.low, options.net,
                         SHAPES[options.shape])[1]  # fmt: skip
    weight = (pressure / pressure.sum()).ravel()
    return x.ravel(), y.ravel(), part.load * weight, weight


def _gathered(approach: float, parts: tuple[PatchPressure, ...], pair: Pair, options: Options) -> NormalContact:
    """The sum of the patches; area and peak from strips with exact ends."""
    area = sum(_area(part) for part in parts)
    peak = max((part.stiffness * (part.depth - part.patch.low) for part in parts), default=0.0)
    return NormalContact(approach, _total(parts), area, peak, parts, pair, options)


def _area(part: PatchPressure, rows: int = 100) -> float:
    """Area (m^2) of one patch."""
    y, low, high, _ = _strips(part, rows, 1, PARABOLIC)
    return float((high - low).sum() * (part.box[3] - part.box[2]) / rows) if y.size else 0.0


def _strips(part: PatchPressure, rows: int, cells: int, shape: int) -> tuple[np.ndarray, ...]:
    patch, (origin, step) = part.patch, _grid(part.patch)
    return strips(patch.distance.padded, origin, step, part.box, part.depth, patch.low, rows, cells, shape)


def roll(pressed: NormalContact, friction: float, xi_x: float, xi_y: float, spin: float, *,
         cells: int = CELLS) -> Rolling:  # fmt: skip
    """Forces of steady rolling: FASTSIM twice on the fine net of each patch, W_1 = W_2 refitted in between.

    friction : coefficient. xi_x, xi_y : creepages. spin : 1/m. cells : strips, and cells in each. Spin and moment are
    about x = y = 0 of the distance, where patches lean of each patch; roll these one by one if their creepages differ.
    Raises InputError for values that are not finite or a friction below zero.
    """
    quantity("friction", friction, "a coefficient of friction from 0 to 10", 0.0, 10.0)
    for name, value in (("xi_x", xi_x), ("xi_y", xi_y)):
        quantity(name, value, "a creepage from -10 to 10", -10.0, 10.0)
    quantity("spin", spin, "a spin in rad/m from -1e4 to 1e4", -1e4, 1e4)
    rolled = [_roll_patch(part, pressed, friction, (xi_x, xi_y, spin), cells) for part in pressed.patches]
    fx, fy, mz, stuck, area = (float(sum(found[0][k] for found in rolled)) for k in range(5))
    power = -(fx * xi_x + fy * xi_y + mz * spin)
    return Rolling(fx, fy, mz, stuck / area if area > 0.0 else 0.0, power, tuple(found[1] for found in rolled),
                   tuple(found[2] for found in rolled))  # fmt: skip


def _roll_patch(part: PatchPressure, pressed: NormalContact, friction: float, creepage: tuple[float, float, float],
                cells: int) -> tuple[tuple[float, ...], float, Fields]:  # fmt: skip
    """Forces, flexibility and fields of one patch."""
    y, low, high, pressure = _strips(part, cells, cells, SHAPES[pressed.options.shape])
    width = (part.box[3] - part.box[2]) / cells
    pressure *= part.load / (pressure.sum(axis=1) @ (high - low) * width / cells)  # full sliding gives mu N exactly
    traction = np.zeros((*pressure.shape, 2))
    # W_1 = W_2 = W_3 is the paper's first estimate. a_1 and a_2 drop out: rolling feels du/dx alone, and they are
    # constant over the patch.
    flexibility = 1.0 / part.stiffness
    march(y, low, high, width, pressure, friction, flexibility, *creepage, traction)
    flexibility = _refitted(part, pressed, gather(y, low, high, width, traction, part.box, pressed.options.net))
    found = march(y, low, high, width, pressure, friction, flexibility, *creepage, traction)
    return found, flexibility, _fields(y, low, high, width, pressure, traction, friction)


def _refitted(part: PatchPressure, pressed: NormalContact, traction: np.ndarray) -> float:
    """W_1 = W_2 (m/Pa) by least squares of u = W p + a against the half-space; W_3 where no traction can be fitted."""
    net, (x0, x1, y0, y1), pair = pressed.options.net, part.box, pressed.pair
    dx, dy = (x1 - x0) / net, (y1 - y0) / net
    kernel = influence(offsets(net, dx), offsets(net, dy)[:, None], dx, dy, pair)[..., :2, :2]
    u = np.moveaxis(Convolution(kernel)(np.moveaxis(traction, 0, -1)), -1, 0)
    origin, step = _grid(part.patch)
    cover = crude_net(part.patch.distance.padded, origin, step, part.box, part.depth, part.patch.low, net, PARABOLIC)[2]
    products = _slopes(u, traction, cover) if pressed.options.fit == "gradient" else _spread(u, traction, cover)
    both, square = products
    return both / square if square > 0.0 and both > 0.0 else 1.0 / part.stiffness


def _spread(u: np.ndarray, p: np.ndarray, cover: np.ndarray) -> tuple[float, float]:
    """Covariance of u and p and variance of p, both directions together, weighted by the covered shares."""
    share = cover / cover.sum()
    du, dp = (f - (share * f).sum(axis=(1, 2), keepdims=True) for f in (u, p))
    return float((share * du * dp).sum()), float((share * dp * dp).sum())


def _slopes(u: np.ndarray, p: np.ndarray, cover: np.ndarray) -> tuple[float, float]:
    """The same of the changes along x, from mesh to mesh."""
    share = cover[:, 1:] * cover[:, :-1]
    du, dp = np.diff(u, axis=2), np.diff(p, axis=2)
    return float((share * du * dp).sum()), float((share * dp * dp).sum())


def _fields(y: np.ndarray, low: np.ndarray, high: np.ndarray, width: float, pressure: np.ndarray, traction: np.ndarray,
            friction: float) -> Fields:  # fmt: skip
    """Pressure and tractions by strip and cell."""
    cells = pressure.shape[1]
    length = ((high - low) / cells)[:, None]
    x = high[:, None] - (np.arange(cells) + 0.5) * length
    slips = np.hypot(traction[..., 0], traction[..., 1]) >= friction * pressure * (1.0 - 1e-9)
    shape = pressure.shape
    lines, lengths = np.broadcast_to(y[:, None], shape), np.broadcast_to(length, shape)
    return Fields(x, lines, lengths, np.full(shape, width), pressure, traction[..., 0], traction[..., 1], slips,
                  np.full(shape, True))  # fmt: skip
