"""Undeformed distances that are no ellipsoids, or very long ones, and the exact contact to compare a theory with."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from models.contact.material import Pair
from models.contact.normal_problem import NormalSolution, solve_normal
from models.contact.rolling_problem import RollingSolution, solve_rolling
from models.contact.standard_profiles import s1002, uic60
from models.contact.undeformed_distance import Distance, from_function
from models.contact.wheel_on_rail import wheel_on_rail
from models.errors import RunFailed

PAIR = Pair()
FRICTION = 0.3
GROWN = "two grooves, grown together"
CURVATURE = 1.0 / 0.92
"""A of a wheel of 0.46 m radius (1/m)."""
LEVELS = (0.5, 2.0)
"""Creepages by the linear scale mu N / (4 G c^2), c the radius of a circle of the exact area."""
KINDS = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "spin": (0.0, 0.0, 1.0), "y + spin": (0.0, 1.0, 0.6),
         "y - spin": (0.0, -1.0, 0.6)}  # fmt: skip


Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class Shape:
    """A distance, a load (N), and the rectangle x0, x1, y0, y1 (m) of the exact grid, None to find it."""

    name: str
    distance: Distance
    load: float
    box: Box | None = None


def _over(name: str, height: Callable[[np.ndarray, np.ndarray], np.ndarray], load: float, x: float, y: float) -> Shape:
    """A shape from a formula, its exact contact within -x..x and -y..y."""
    distance = from_function(height, (-2.0 * x, 2.0 * x), (-2.0 * y, 2.0 * y))
    return Shape(name, distance, load, (-x, x, -y, y))


def _hertz(name: str, ratio: float, x: float, y: float) -> Shape:
    return _over(name, lambda u, v: CURVATURE * (u**2 + ratio * v**2), 1e5, x, y)


def _well(name: str, ridge: float, load: float) -> Shape:
    """Two grooves 3 mm to each side of the middle, a ridge of this height (m) between them."""
    return _over(name, lambda u, v: CURVATURE * u**2 + ridge * ((v / 3e-3) ** 2 - 1.0) ** 2, load, 0.0135, 0.0075)


def formulas() -> list[Shape]:
    """Distances from formulas."""
    apart = 8e-3
    return [
        _hertz("circle", 1.0, 0.0078, 0.0078),
        _hertz("ellipse, B/A = 5", 5.0, 0.0098, 0.0037),
        _hertz("ellipse, B/A = 1/5", 0.2, 0.0078, 0.0235),
        _over("quartic in y", lambda u, v: CURVATURE * u**2 + 2e4 * v**4, 5e4, 0.0078, 0.0078),
        _over("egg", lambda u, v: CURVATURE * u**2 + np.where(v > 0, 3.0, 0.7) * v**2, 5e4, 0.0072, 0.0088),
        _over("two patches", lambda u, v: CURVATURE * u**2 + np.minimum(1.7 * (v - apart) ** 2,
              1.7 * (v + apart) ** 2 + 5e-6), 2e4, 0.0058, 0.0138),
        _well("two grooves, apart", 1e-5, 1e4),
        _well(GROWN, 1e-5, 1e5),
    ]  # fmt: skip


def profiles() -> list[Shape]:
    """The main patch of the right wheel S1002 on UIC 60, inclined 1:40, at some lateral shifts (m) and loads (N)."""
    found = []
    for shift, load in ((0.002, 5e4), (0.004, 5e4), (0.006, 2e4), (0.008, 2e4)):
        distance = wheel_on_rail(s1002(), uic60(), lateral_shift=shift)[0].patch.distance
        found.append(Shape(f"S1002 on UIC 60, {1e3 * shift:g} mm", distance, load))
    return found


def exact_normal(shape: Shape, cells: int, box: Box) -> NormalSolution:
    """The exact contact on cells x cells over a box x0, x1, y0, y1 (m)."""
    x0, x1, y0, y1 = box
    x, y = (low + (np.arange(cells) + 0.5) / cells * (high - low) for low, high in ((x0, x1), (y0, y1)))
    heights = shape.distance.at(x[None, :], y[:, None])
    solution = solve_normal(heights, x[1] - x[0], y[1] - y[0], PAIR, load=shape.load)
    return replace(solution, x=x, y=y)


def creepages(area: float, load: float) -> dict[tuple[str, float], tuple[float, float, float]]:
    """Creepages and spin (1/m) of every kind and level for a contact of this area (m^2) and load (N)."""
    c = np.sqrt(area / np.pi)
    scale = FRICTION * load / (4.0 * PAIR.G * c**2)
    return {
        (name, level): (level * scale * x, level * scale * y, level * scale * spin / c)
        for name, (x, y, spin) in KINDS.items()
        for level in LEVELS
    }


def exact_rolling(normal: NormalSolution, creepage: tuple[float, float, float]) -> RollingSolution | None:
    """The exact forces, None where the exact solver says that it did not reach them."""
    try:
        return solve_rolling(normal, FRICTION, *creepage, PAIR)
    except RunFailed:
        return None
