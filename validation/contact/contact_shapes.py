"""Shapes of contacting bodies that are not ellipsoids, or very long ones, and their exact contact solutions."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from models.contact.inputs import Array
from models.contact.material import MaterialPair
from models.contact.normal_problem import NormalSolution, cell_centres, solve_normal
from models.contact.patches import Patch
from models.contact.rolling_problem import RollingSolution, solve_rolling
from models.contact.simplified_theory import NormalContact
from models.contact.standard_profiles import s1002_profile, uic60_profile
from models.contact.undeformed_distance import UndeformedDistance, from_function
from models.contact.wheel_on_rail import TouchingPlace, wheel_on_rail
from models.core.errors import InputError, RunFailed

MATERIAL_PAIR = MaterialPair()
FRICTION = 0.3
CURVATURE = 1.0 / 0.92
"""Half the longitudinal curvature (1/m) of a wheel of 0.46 m radius: the distance is CURVATURE x^2."""
CREEPAGE_SIZES = (0.5, 2.0)
"""Creepages divided by the linear scale mu N / (4 G c^2), where c is the radius of a circle of the exact area."""
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
    """A pair of bodies in contact: their undeformed distance, the load (N), and the rectangle x0, x1, y0, y1 (m) of the
    exact grid (None: to be determined)."""

    name: str
    distance: UndeformedDistance
    load: float
    box: Box | None = None


def _shape_of_formula(
    shape_name: str, gap_height: Callable[[Array, Array], Array], load: float, half_length: float, half_width: float
) -> Shape:
    """A shape whose undeformed distance is a formula, and whose exact contact area lies within
    -half_length..half_length in x and -half_width..half_width in y (m)."""
    distance = from_function(gap_height, (-2.0 * half_length, 2.0 * half_length), (-2.0 * half_width, 2.0 * half_width))
    return Shape(shape_name, distance, load, (-half_length, half_length, -half_width, half_width))


def _hertz_shape(shape_name: str, axis_ratio: float, half_length: float, half_width: float) -> Shape:
    return _shape_of_formula(
        shape_name, lambda u, v: CURVATURE * (u**2 + axis_ratio * v**2), 1e5, half_length, half_width
    )


def _two_grooves(
    shape_name: str, ridge_height: float, load: float, half_spacing: float = 3e-3, groove_tilt: float = 0.0
) -> Shape:
    """A shape with two parallel grooves at -half_spacing and half_spacing (m) in y, with a ridge (m) between them; the
    second groove is ``groove_tilt`` (m) higher."""
    return _shape_of_formula(
        shape_name,
        lambda u, v: (
            CURVATURE * u**2
            + ridge_height * ((v / half_spacing) ** 2 - 1.0) ** 2
            + groove_tilt * (v / half_spacing + 1.0) / 2.0
        ),
        load,
        0.0135,
        2.2 * half_spacing + 9e-4,
    )


def shapes_by_formula() -> list[Shape]:
    """Shapes whose undeformed distance is a formula: ellipses, a quartic, an egg, two patches."""
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
    """Shapes whose contact areas have merged over ridges of many heights and spacings; the last shapes have grooves
    along x and three merged areas."""
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
        distance = wheel_on_rail(s1002_profile(), uic60_profile(), lateral_shift=shift)[0].patch.distance
        shapes.append(Shape(f"S1002 on UIC 60, {1e3 * shift:g} mm", distance, load))
    return shapes


@dataclass(frozen=True)
class PlacedWheelset:
    """A wheelset on a track: lateral shift (m), yaw (rad), load on the right wheel (N), and this wheel's contact
    points."""

    shift: float
    yaw: float
    load: float
    touches: list[TouchingPlace]


def placed_wheelsets() -> list[PlacedWheelset]:
    """Wheelsets with S1002 on UIC 60, with and without yaw, at shifts at which the contact normals are nearly vertical
    or a single patch is in contact.

    There, patches can be joined to one half-space along the contour; flange and tread cannot.
    """
    wheelsets = []
    for yaw in (0.0, 0.01, -0.02):
        for shift in np.arange(-4e-3, 8.1e-3, 2e-3):
            touches = wheel_on_rail(s1002_profile(), uic60_profile(), lateral_shift=float(shift), yaw=yaw)
            if max(touch.patch.lean for touch in touches) < JOINED_ANGLE or len(touches) == 1:
                wheelsets += [PlacedWheelset(float(shift), yaw, load, touches) for load in (2e4, 1e5)]
    return wheelsets


JOINED_ANGLE = 0.15
"""Largest angle (rad) between patch and track at which several patches are joined to one half-space."""


GRID_MARGINS = (1.4, 2.0, 3.0)
"""Side lengths of the exact grid divided by those of the simplified theory's contact area, tried in turn."""


def exact_contact_of_wheelset(
    placed_wheelset: PlacedWheelset, normal_contact: NormalContact, cell_count: int
) -> NormalSolution:
    """Exact normal contact of a wheel with all its patches on a rail, with heights along the track's vertical."""
    boxes = np.array(
        [
            np.add(part.box, (0.0, 0.0, part.patch.contour_position, part.patch.contour_position))
            for part in normal_contact.patches
        ]
    ).T
    (x0, y0), (x1, y1) = boxes[::2].min(axis=1), boxes[1::2].max(axis=1)
    slope = float(np.cos(min(part.patch.lean for part in normal_contact.patches)))
    for margin in GRID_MARGINS:
        step_x, step_y = margin * (x1 - x0) / cell_count, margin * (y1 - y0 + 2e-3) / (2 * cell_count)
        x, y = (x0 + x1) / 2 + cell_centres(cell_count, step_x), (y0 + y1) / 2 + cell_centres(2 * cell_count, step_y)
        heights = np.min([_heights_of_patch(touch.patch, x, y) for touch in placed_wheelset.touches], axis=0)
        try:
            return solve_normal(heights * slope, step_x, step_y, MATERIAL_PAIR, load=placed_wheelset.load / slope)
        except InputError as error:  # the contact reaches the edge of the grid
            refused = error
    raise refused


UNKNOWN_HEIGHT = 1e-3
"""Height (m) assumed where the undeformed distance is not known."""


def _heights_of_patch(contact_patch: Patch, x: Array, y: Array) -> Array:
    """Heights (ny, nx) in m of a patch along the track's vertical, on the grid that all patches share."""
    known, across = contact_patch.distance, y - contact_patch.contour_position
    over = (across >= known.y[0]) & (across <= known.y[-1])
    heights = np.full((y.size, x.size), UNKNOWN_HEIGHT)
    inside = np.clip(x, known.x[0], known.x[-1])
    heights[over] = known.at(inside[None, :], across[over][:, None]) / np.cos(contact_patch.lean)
    return heights


def exact_normal(contact_shape: Shape, cell_count: int, grid_box: Box) -> NormalSolution:
    """Exact normal contact on a grid of cell_count x cell_count cells over the box x0, x1, y0, y1 (m)."""
    x0, x1, y0, y1 = grid_box
    x, y = (low + (np.arange(cell_count) + 0.5) / cell_count * (high - low) for low, high in ((x0, x1), (y0, y1)))
    heights = contact_shape.distance.at(x[None, :], y[:, None])
    solution = solve_normal(heights, x[1] - x[0], y[1] - y[0], MATERIAL_PAIR, load=contact_shape.load)
    return replace(solution, x=x, y=y)


def creepages(contact_area: float, load: float) -> dict[tuple[str, float], tuple[float, float, float]]:
    """Kind and level -> creepages xi_x, xi_y and spin (1/m) for a contact of an area (m^2) and a load (N)."""
    c = np.sqrt(contact_area / np.pi)
    scale = FRICTION * load / (4.0 * MATERIAL_PAIR.G * c**2)
    return {
        (name, level): (level * scale * x, level * scale * y, level * scale * spin / c)
        for name, (x, y, spin) in CREEPAGE_KINDS.items()
        for level in CREEPAGE_SIZES
    }


def exact_rolling(
    normal_solution: NormalSolution, creepages_and_spin: tuple[float, float, float]
) -> RollingSolution | None:
    """Exact rolling solution for creepages xi_x, xi_y and spin (1/m); None if the exact solver did not converge."""
    try:
        return solve_rolling(normal_solution, FRICTION, *creepages_and_spin, MATERIAL_PAIR)
    except RunFailed:
        return None
