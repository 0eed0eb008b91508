"""What friction allows the forces and the moment of one ellipse, on the cells of FASTSIM.

Tractions of at most g = mu times the pressure that they are bounded by have, about the normal through the centre, at
most the moment of the sum of g r dA over the cells, r the distance of a cell's centre from there. With the forces that
go with it, the moment is bounded more closely: whatever the slip w, no tractions take more power than the sum of
g |w| dA, so also at the contact's own creepages and spin (limit surface of Goyal, Ruina and Papadopoulos, Wear 143
(1991) 307). On 21 cells the first sum is up to 0.3 % larger than the integral.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from models.contact.fastsim_grid import Bound, grid, strips_of
from models.contact.fastsim_kernels import BOUND, CENTRE
from models.contact.fastsim_many import HALF, PART, Y


def most_moment(given: Mapping[str, Any], cells: int = 21, bound: Bound = "intermediate") -> np.ndarray:
    """Largest moment (N m), (n,), of contacts with columns a, b (m), load (N) and mu, (n,) each."""
    pure = {"xi_x": np.zeros_like(given["a"]), "xi_y": np.zeros_like(given["a"]), "spin": np.ones_like(given["a"])}
    return most_power({**given, **pure}, cells, bound)


def most_power(given: Mapping[str, Any], cells: int = 21, bound: Bound = "intermediate") -> np.ndarray:
    """Largest power by the rolling speed (N), (n,), that friction takes from the motion; also xi_x, xi_y, spin."""
    a, b, xi_x, xi_y, spin = (given[name][:, None, None] for name in ("a", "b", "xi_x", "xi_y", "spin"))
    found, counts = np.zeros(len(given["a"])), strips_of(given["a"] / given["b"], cells)
    for count in np.unique(counts):
        net, rows = grid(cells, int(count), bound), counts == count
        y, half, part = (net.strips[row][:, None] for row in (Y, HALF, PART))
        along, across = -b[rows] * y, a[rows] * half * net.cells[CENTRE]
        slip = np.hypot(xi_x[rows] + spin[rows] * along, xi_y[rows] + spin[rows] * across)
        found[rows] = np.sum(part * net.cells[BOUND] * slip, axis=(1, 2))
    return given["mu"] * np.maximum(given["load"], 0.0) * found
