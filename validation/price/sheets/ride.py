"""Problem sheet of the standard deviations of the vehicle R19-ride on a random road of two tracks."""

from pathlib import Path

import numpy as np

from models.road.two_track import half_track, road_of_level
from validation.price import ride
from validation.price.sheets.page import ReferenceValue, write_matrices
from validation.price.sheets.page import write as write_page


def write(output_folder: Path) -> list[ReferenceValue]:
    """Write the problem sheet and its matrices into ``output_folder``; returns the reference standard deviation of each
    output."""
    problem = ride.problem()
    vehicle = problem.vehicle
    write_matrices(
        output_folder,
        "ride",
        {
            "M": vehicle.mass,
            "D": vehicle.damping,
            "K": vehicle.stiffness,
            "R": vehicle.road_stiffness,
            "S": vehicle.road_damping,
            **dict(zip("AVPHE", vehicle.read, strict=True)),
        },
    )
    sure = problem.true_deviations * max(
        0.5 * problem.uncertainty, float(np.abs(ride.lyapunov_deviations(problem) / problem.true_deviations - 1).max())
    )
    values = [
        ReferenceValue("ride", output.name, output.unit, 0.0, *map(float, known))
        for output, *known in zip(vehicle.outputs, problem.true_deviations, sure, strict=True)
    ]
    write_page(
        output_folder,
        "ride",
        f"Standard deviations of a passenger car of 19 freedoms at {ride.SPEED:g} m/s",
        _sheet_text(problem),
        "Standard deviations by quadrature over frequencies; the uncertainty holds its own "
        "estimate and the largest relative difference from a Lyapunov equation.",
        values,
    )
    return values


def _sheet_text(problem: ride.PricedRide) -> str:
    road = road_of_level(half_track(problem.vehicle.wheels))
    wheels = "\n".join(
        f"| {i} | {w.name} | {w.x:.17g} | {w.y:.17g} |" for i, w in enumerate(problem.vehicle.wheels, start=1)
    )
    front = max(w.x for w in problem.vehicle.wheels)
    return f"""A linear vehicle with {len(problem.vehicle.mass)} coordinates q on {len(problem.vehicle.wheels)} wheels:

    M q'' + D q' + K q = R z + S z'        outputs = A q'' + V q' + P q + H z + E z'

All matrices are in `ride.csv`, row by row of the outputs below; entries that are not there are 0. z (m, up) are the
heights under the wheels, that of a wheel at y (m, left) and x (m, forward)

    z(t) = m(v t - d) + y n(v t - d)        d = {front:.17g} - x        v = {ride.SPEED:g} m/s

with independent stationary random processes m and n of the way, whose two-sided spectral densities over the wavenumber
W (rad/m) are

    S_m = {road.mean.intensity:.17g} / (2 pi (W^2 + {road.mean.corner:.17g}^2))
    S_n = {road.roll.intensity:.17g} / (2 pi (W^2 + {road.roll.corner:.17g}^2))

| wheel | name | x [m] | y [m] |
|---|---|---|---|
{wheels}

A variance is the integral of an output's density over all W of both signs.

Asked for: the largest relative error of the standard deviations of accelerations and of tyre forces."""
