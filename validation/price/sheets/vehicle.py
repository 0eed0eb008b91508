"""Problem sheet of the passenger car of 19 freedoms that moves freely on a road."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import static_preloads
from validation.price.problems import free_vehicle
from validation.price.problems.free_vehicle import (
    DURATION,
    GOLDEN,
    GRAVITY,
    LARGEST_AMPLITUDE,
    LONGEST_WAVELENGTH,
    RISE_LENGTH,
    RISE_STATION,
    SINE_COUNT,
    SPEED,
    FreeVehicle,
)
from validation.price.sheets.page import ReferenceValue, vector_text
from validation.price.sheets.page import write as write_page

LAWS = f"""Axes: x forward, y left, z up; every place is given where it lies at rest (m), where all coordinates are 0.

**Bodies** move by Newton's and Euler's laws under weight, g = {GRAVITY:g} m/s^2 along -z. A body has the coordinates
named as its freedoms and rides on its parent, or on the space:

    c = c_parent + R_parent (place - place_parent + (x, y, z))        R = R_parent Rx(rx) Ry(ry) Rz(rz)

with c its centre of mass, R its rotation, and 0 for a coordinate that it has not. Its inertia (kg m^2) is about c in
its own axes.

**Springs** act between p1 of body one and p2 of body two (or the ground): with a fixed in space and d = a . (p2 - p1)
less its value at rest, F = F0 + k d + c d' acts as F a at p1 and -F a at p2.

**Bars** act between the roll rx of a body without parent and two points: with e = rx - (h_left - h_right) / b, h how
far each point has risen and b their distance along y, the moment M = M0 + k e + c e' acts as -M on the coordinate rx,
as the force M / b up at the left point and down at the right one.

**Tyres**: F = F0 + k (z - h) up at the centre of the wheel, h how far it has risen, z the height of the road under it.

**Side forces** along y at a point of a body: F = C (rz - y' / v), y' the rate of that point along y and rz the yaw
coordinate of the body. **Drag** along x at its centre: F = -c v x', x' the rate of its coordinate x.

**Road**: at time t a tyre at (x, y) meets the height (m) at s = v t + x, v = {SPEED:g} m/s, of its track, n = 0 on the
left (y > 0) and 1 on the right:

    z = sum_k {LARGEST_AMPLITUDE:g} / k sin(2 pi (k s / {LONGEST_WAVELENGTH:g} + {GOLDEN:.16g} k (k + {SINE_COUNT} n)))
        / (1 + exp(-(s - {RISE_STATION:g}) / {RISE_LENGTH:g}))

with k = 1 .. {SINE_COUNT}. Start: all coordinates and rates are 0.
"""


def write(output_folder: Path) -> list[ReferenceValue]:
    """Write the problem sheet; returns the reference values of all final coordinates and rates."""
    problem = free_vehicle.problem(False)
    sure = np.abs(problem.states - problem.other_states).max(axis=0)
    values = [
        ReferenceValue("vehicle", name, unit, DURATION, *map(float, known))
        for (name, unit), *known in zip(_names_and_units_of_states(problem), problem.states[-1], sure, strict=True)
    ]
    question = (
        "Asked for: the largest error of a tyre force and of an acceleration along z of body, engine or seats at "
        f"every {1e3 * free_vehicle.COMPARED_GRID:g} ms."
    )
    return write_page(
        output_folder,
        "vehicle",
        problem.title,
        f"{LAWS}\n{_parameter_tables(problem.vehicle)}\n\n{question}",
        f"End values at {DURATION:g} s ({problem.reference}); the uncertainty is the largest difference of the "
        "two over the run.",
        values,
    )


def _names_and_units_of_states(priced_problem: FreeVehicle) -> list[tuple[str, str]]:
    """Names and units of the coordinates, then of their rates."""
    coordinates = [
        (f"{body} {freedom}", "rad" if freedom.startswith("r") else "m")
        for body, freedom in priced_problem.vehicle.coordinates()
    ]
    return coordinates + [(f"{name} rate", f"{unit}/s") for name, unit in coordinates]


def _parameter_tables(vehicle: SpatialVehicle) -> str:
    """Text with tables of all parameters of a vehicle."""
    preload = static_preloads(vehicle)
    parts: dict[tuple[str, ...], Sequence[Sequence[Any]]] = {
        ("body", "mass [kg]", "place", "freedoms", "inertia, rows", "parent"): [
            (
                b.name,
                b.mass,
                vector_text(b.position),
                " ".join(b.freedoms),
                " ".join(map(vector_text, b.inertia)),
                b.parent or "space",
            )
            for b in vehicle.bodies
        ],
        ("spring", "one", "two", "p1", "p2", "a", "k [N/m]", "c [N s/m]", "F0 [N]"): [
            (
                s.name,
                s.first_body,
                s.second_body or "ground",
                *map(vector_text, (s.first_point, s.second_point, s.axis)),
                s.stiffness,
                s.damping,
                preload.parts[s.name],
            )
            for s in vehicle.springs
        ],
        ("bar", "body", "left", "right", "left point", "right point", "k [N m/rad]", "c", "M0 [N m]"): [
            (
                b.name,
                b.body,
                b.left,
                b.right,
                *map(vector_text, (b.point_left, b.point_right)),
                b.stiffness,
                b.damping,
                preload.parts[b.name],
            )
            for b in vehicle.bars
        ],
        ("tyre", "body", "place", "k [N/m]", "F0 [N]"): [
            (t.name, t.body, vector_text(t.point), t.stiffness, preload.tyres[t.name]) for t in vehicle.tyres
        ],
        ("side force", "body", "point", "C [N/rad]"): [
            (f.name, f.body, vector_text(f.point), f.stiffness) for f in vehicle.side_forces
        ],
        ("drag", "c [N s^2/m^2]"): [(d.body, d.coefficient) for d in vehicle.drags],
    }
    return "\n\n".join(_markdown_table(heads, rows) for heads, rows in parts.items())


def _markdown_table(headings: tuple[str, ...], table_rows: Sequence[Sequence[Any]]) -> str:
    """Markdown text of a table; its numbers have all digits."""
    text_rows = [[cell if isinstance(cell, str) else f"{cell:.17g}" for cell in row] for row in table_rows]
    return "\n".join(f"| {' | '.join(row)} |" for row in (headings, ("---",) * len(headings), *text_rows))
