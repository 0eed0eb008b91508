"""Undeformed distances that are no ellipsoids, or very long ones, and the exact contact to compare a theory with."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from models.contact.inputs import Array
from models.contact.material import MaterialPair
from models.contact.normal_problem import NormalSolution, centres, solve_normal
from models.contact.patches import Patch
from models.contact.rolling_problem import RollingSolution, solve_rolling
from models.contact.simplified_theory import NormalContact
from models.contact.standard_profiles import s1002, uic60
from models.contact.undeformed_distance import Distance, from_function
from models.contact.wheel_on_rail import TouchingPlace, wheel_on_rail
from models.core.errors import InputError, RunFailed

MATERIAL_PAIR = MaterialPair()
FRICTION = 0.3
CURVATURE = 1.0 / 0.92
"""A of a wheel of 0.46 m radius (1/m)."""
CREEPAGE_SIZES = (0.5, 2.0)
"""Creepages by the linear scale mu N / (4 G c^2), c the radius of a circle of the exact area."""
CREEPAGE_KINDS = {
    "x": (1.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0),
    "spin": (0.0, 0.0, 1.0),
    "y + spin": (0.0, 1.0, 0.6),
    "y - spin": (0.0, -1.0, 0.6),
}


Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class Shape:
    """Undeformed distance of two bodies, load (N), and rectangle x0, x1, y0, y1 (m) for the exact grid (None: to be
    found)."""

    name: str
    distance: Distance
    load: float
    box: Box | None = None


def _shape_of_formula(name: str, height: Callable[[Array, Array], Array], load: float, x: float, y: float) -> Shape:
    """A shape given by a formula, whose exact contact area lies within -x..x and -y..y."""
    distance = from_function(height, (-2.0 * x, 2.0 * x), (-2.0 * y, 2.0 * y))
    return Shape(name, distance, load, (-x, x, -y, y))


def _hertz_shape(name: str, ratio: float, x: float, y: float) -> Shape:
    return _shape_of_formula(name, lambda u, v: CURVATURE * (u**2 + ratio * v**2), 1e5, x, y)


def _two_grooves(name: str, ridge: float, load: float, half: float = 3e-3, tilt: float = 0.0) -> Shape:
    """Two parallel grooves at a distance ``half`` (m) on both sides of the middle, with a ridge (m) between; one is
    ``tilt`` (m) higher."""
    return _shape_of_formula(
        name,
        lambda u, v: CURVATURE * u**2 + ridge * ((v / half) ** 2 - 1.0) ** 2 + tilt * (v / half + 1.0) / 2.0,
        load,
        0.0135,
        2.2 * half + 9e-4,
    )


def shapes_by_formula() -> list[Shape]:
    """Shapes whose distance is given by a formula."""
    apart = 8e-3
    return [
        _hertz_shape("circle", 1.0, 0.0078, 0.0078),
        _hertz_shape("ellipse, B/A = 5", 5.0, 0.0098, 0.0037),
        _hertz_shape("ellipse, B/A = 1/5", 0.2, 0.0078, 0.0235),
        _shape_of_formula("quartic in y", lambda u, v: CURVATURE * u**2 + 2e4 * v**4, 5e4, 0.0078, 0.0078),
        _shape_of_formula("egg", lambda u, v: CURVATURE * u**2 + np.where(v > 0, 3.0, 0.7) * v**2, 5e4, 0.0072, 0.0088),
        _shape_of_formula(
            "two patches",
            lambda u, v: CURVATURE * u**2 + np.minimum(1.7 * (v - apart) ** 2, 1.7 * (v + apart) ** 2 + 5e-6),
            2e4,
            0.0058,
            0.0138,
        ),
        _two_grooves("two grooves, apart", 1e-5, 1e4),
        _two_grooves("two grooves, grown together", 1e-5, 1e5),
    ]


def merged_shapes() -> list[Shape]:
    """Shapes whose contact areas have merged, with ridges and distances of many sizes; in the last ones along x, and of
    three areas."""
    wells = (
        (2, 3, 100, 0),
        (5, 2, 50, 0),
        (10, 3, 30, 0),
        (10, 3, 200, 0),
        (20, 3, 100, 0),
        (20, 4, 100, 0),
        (10, 3, 100, 4),
        (20, 4, 120, 10),
        (30, 5, 150, 0),
        (8, 2.5, 50, -3),
        (3, 4, 40, 0),
        (10, 5, 80, 5),
    )
    shapes = [
        _two_grooves(
            f"grooves {2 * half:g} mm apart, ridge {ridge:g} um, one {tilt:g} um higher, {load:g} kN",
            1e-6 * ridge,
            1e3 * load,
            1e-3 * half,
            1e-6 * tilt,
        )
        for ridge, half, load, tilt in wells
    ]
    return [
        *shapes,
        _shape_of_formula(
            "two arcs that meet in an edge",
            lambda u, v: CURVATURE * u**2 + 1.7 * (np.abs(v) - 3e-3) ** 2,
            6e4,
            0.012,
            0.012,
        ),
        _shape_of_formula(
            "two grooves along x", lambda u, v: 4.0 * v**2 + 6e-6 * ((u / 4e-3) ** 2 - 1.0) ** 2, 4e4, 0.011, 7.5e-3
        ),
        _shape_of_formula(
            "three grooves",
            lambda u, v: (
                CURVATURE * u**2
                + 4e-6 * (1.0 + np.cos(np.pi * (v / 2.5e-3 + 1.0)))
                + np.maximum(np.abs(v) - 5e-3, 0.0) ** 2
                + 0.15 * v**2
            ),
            8e4,
            0.0135,
            0.0115,
        ),
    ]


def profile_shapes() -> list[Shape]:
    """Main contact patch of the right wheel (S1002 on UIC 60, inclined 1:40) at several lateral shifts (m) and loads
    (N)."""
    shapes = []
    for shift, load in ((0.002, 5e4), (0.004, 5e4), (0.006, 2e4), (0.008, 2e4)):
        distance = wheel_on_rail(s1002(), uic60(), lateral_shift=shift)[0].patch.distance
        shapes.append(Shape(f"S1002 on UIC 60, {1e3 * shift:g} mm", distance, load))
    return shapes


@dataclass(frozen=True)
class PlacedWheelset:
    """A wheelset on a track: lateral shift (m), yaw (rad), load on the right wheel (N), and the contact points of this
    wheel."""

    shift: float
    yaw: float
    load: float
    touches: list[TouchingPlace]


def placed_wheelsets() -> list[PlacedWheelset]:
    """Placements of S1002 on UIC 60, with and without yaw, at which the contact normals are nearly vertical.

    Half-spaces are joined along the contour there; flange and tread lie on none.
    """
    wheelsets = []
    for yaw in (0.0, 0.01, -0.02):
        for shift in np.arange(-4e-3, 8.1e-3, 2e-3):
            touches = wheel_on_rail(s1002(), uic60(), lateral_shift=float(shift), yaw=yaw)
            if max(touch.patch.lean for touch in touches) < JOINED_ANGLE or len(touches) == 1:
                wheelsets += [PlacedWheelset(float(shift), yaw, load, touches) for load in (2e4, 1e5)]
    return wheelsets


JOINED_ANGLE = 0.15
"""Angle (rad) between patch and track up to which several patches are joined to one half-space."""


GRID_MARGINS = (1.4, 2.0, 3.0)
"""Sides of the exact grid divided by those of the simplified theory's area."""


def exact_placed(wheelset: PlacedWheelset, normal_contact: NormalContact, cells: int) -> NormalSolution:
    """Exact normal contact of a wheel on a rail; the heights of all patches count along the track's vertical."""
    boxes = np.array(
        [
            np.add(part.box, (0.0, 0.0, part.patch.contour_position, part.patch.contour_position))
            for part in normal_contact.patches
        ]
    ).T
    (x0, y0), (x1, y1) = boxes[::2].min(axis=1), boxes[1::2].max(axis=1)
    slope = float(np.cos(min(part.patch.lean for part in normal_contact.patches)))
    for margin in GRID_MARGINS:
        step_x, step_y = margin * (x1 - x0) / cells, margin * (y1 - y0 + 2e-3) / (2 * cells)
        x, y = (x0 + x1) / 2 + centres(cells, step_x), (y0 + y1) / 2 + centres(2 * cells, step_y)
        heights = np.min([_height(touch.patch, x, y) for touch in wheelset.touches], axis=0)
        try:
            return solve_normal(heights * slope, step_x, step_y, MATERIAL_PAIR, load=wheelset.load / slope)
        except InputError as error:  # the contact reaches the edge of the grid
            refused = error
    raise refused


UNKNOWN_HEIGHT = 1e-3
"""Height (m) where a distance is not known."""


def _height(patch: Patch, x: Array, y: Array) -> Array:
    """Heights (ny, nx) of a patch along the track's vertical, on a grid that all patches share."""
    known, across = patch.distance, y - patch.contour_position
    over = (across >= known.y[0]) & (across <= known.y[-1])
    heights = np.full((y.size, x.size), UNKNOWN_HEIGHT)
    inside = np.clip(x, known.x[0], known.x[-1])
    heights[over] = known.at(inside[None, :], across[over][:, None]) / np.cos(patch.lean)
    return heights


def exact_normal(contact_shape: Shape, cells: int, box: Box) -> NormalSolution:
    """Exact normal contact on a grid of cells x cells over the box x0, x1, y0, y1 (m)."""
    x0, x1, y0, y1 = box
    x, y = (low + (np.arange(cells) + 0.5) / cells * (high - low) for low, high in ((x0, x1), (y0, y1)))
    heights = contact_shape.distance.at(x[None, :], y[:, None])
    solution = solve_normal(heights, x[1] - x[0], y[1] - y[0], MATERIAL_PAIR, load=contact_shape.load)
    return replace(solution, x=x, y=y)


def creepages(area: float, load: float) -> dict[tuple[str, float], tuple[float, float, float]]:
    """Creepages and spin (1/m) of every kind and level for a contact of this area (m^2) and load (N)."""
    c = np.sqrt(area / np.pi)
    scale = FRICTION * load / (4.0 * MATERIAL_PAIR.G * c**2)
    return {
        (name, level): (level * scale * x, level * scale * y, level * scale * spin / c)
        for name, (x, y, spin) in CREEPAGE_KINDS.items()
        for level in CREEPAGE_SIZES
    }


def exact_rolling(normal: NormalSolution, creepage: tuple[float, float, float]) -> RollingSolution | None:
    """Exact rolling solution; None if the exact solver did not converge."""
    try:
        return solve_rolling(normal, FRICTION, *creepage, MATERIAL_PAIR)
    except RunFailed:
        return None
