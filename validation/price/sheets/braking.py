"""Problem sheet of the anti-lock braking stop from snow on to a wet road."""

from pathlib import Path

import numpy as np

from models.brake.brake import PAPER_FRONT_BRAKE
from models.brake.controller import SAMPLING_PERIOD
from models.brake.plane_vehicle import GRAVITY
from validation.braking.quarter_stops import FRONT_WHEEL
from validation.braking.sampled_quarter import EMPTY, FILL, LAST_SPEED, SUPPLY
from validation.price.problems import braking_stop
from validation.price.problems.braking_stop import SPEED, SURFACE_CHANGE, SURFACES
from validation.price.sheets.page import ReferenceValue, write_columns
from validation.price.sheets.page import write as write_page

SHEET_TEXT = f"""A wheel, and the mass that it carries, are braked straight ahead:

    m u' = -F        J w' = r F - T        x' = u        F = m g mu(slip)        slip = 1 - r w / u, held to 0 .. 1

mu is linear between the lines of `braking_friction.csv`, whose second column holds up to x = {SURFACE_CHANGE:g} m, the
third ({SURFACES[1]}) behind it. A wheel that stops, w = 0, stands as long as T >= r F with slip 1.

Brake: pressure p (bar) and torque T (N m) begin at 0. In each sample of {1e3 * SAMPLING_PERIOD:g} ms a valve of
`braking_valves.csv` is set (the last one for ever):

    1:  p' = ({SUPPLY:g} - p) / {FILL:g} s        0:  p' = 0        -1:  p' = -p / {EMPTY:g} s
    T = max(up(p), min(down(p), T before))
    up(p) = {PAPER_FRONT_BRAKE.rising:g} max(p - {PAPER_FRONT_BRAKE.push_out:g}, 0)
    down(p) = {PAPER_FRONT_BRAKE.falling:g} max(p - {PAPER_FRONT_BRAKE.release:g}, 0)

with T before that at the start of the sample. Parameters (SI): m = {FRONT_WHEEL.mass:.17g}, r =
{FRONT_WHEEL.radius:.17g}, J = {FRONT_WHEEL.spin_inertia:.17g}, g = {GRAVITY:g}. Start: x = 0, u = {SPEED:g} m/s, w = u
/ r.

Asked for: the stopping distance. After the first sample that ends at u <= {LAST_SPEED:g} m/s the wheel stands, and the
rest of the way is u^2 / (2 g mu(1))."""


def write(output_folder: Path) -> list[ReferenceValue]:
    """Write the problem sheet, tyre table and valve commands; returns the reference value of the stopping distance."""
    problem = braking_stop.problem(False)
    heads = ("slip", *(f"mu {name}" for name in SURFACES))
    write_columns(output_folder, "braking_friction", heads, np.column_stack([problem.slips, *problem.mu]))
    write_columns(output_folder, "braking_valves", ("valve",), problem.valves[:, None])
    values = [
        ReferenceValue("braking", "stopping distance", "m", 0.0, problem.true, problem.uncertainty["stopping distance"])
    ]
    write_page(
        output_folder,
        "braking",
        problem.title,
        SHEET_TEXT,
        f"The distance ({problem.reference}); the uncertainty is the difference of the two.",
        values,
    )
    return values
