"""Equivalent conicity of wheel and rail profiles: closed forms of Klingel's nonlinear wave, and the limits of EN 15302
for its reference profiles."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ellipk

from models.core.errors import InputError
from models.rail.equivalent_conicity import KlingelWave, equivalent_conicity, harmonic_linearised_conicity, klingel_wave
from models.rail.laid_profiles import CrossSections
from models.rail.rolling_radius_table import RollingRadiusTable, rolling_radii_of
from validation.common.rows import Observed, Row, System, not_run
from validation.common.scenes import data_folder

TITLE = "Equivalent conicity by EN 15302"
SYSTEM: System = "contact"
TABLE_FOLDER, PROFILE_NAMES = "en15302", ("E1", "E2", "E3", "E4")
TABLE_ROW_SPACING = 0.1
"""Lateral distance (mm) between the rows of the standard's tables, which are symmetric about zero."""
CONICITY_ERROR_BOUND = 0.003
"""Largest error of the conicity that is asked for; the standard prints three digits."""
ROUNDING_TOLERANCE = 1e-11
LATERAL_DISPLACEMENTS = np.linspace(-8.0, 8.0, 161)
"""Lateral displacements (mm) of the wheelset in the tables of the closed forms."""


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of the closed forms and of the standard's profiles; a full run also has a wheelset with wheels of unequal
    radii."""
    rows = [*_closed_form_rows(), _cubic_radius_difference_row(), _refused_tables_row()]
    saved_data: dict[str, Any] = {}
    for name in PROFILE_NAMES:
        of_standard, saved = _reference_profile_rows(name)
        rows += of_standard
        saved_data |= saved
    if not quick:
        rows += _exchanged_wheels_rows()
    return rows, {"standard": saved_data}


def _relative_period_error(wave_period: float, exact_period: float) -> float:
    """Relative error of the wave's period."""
    return abs(wave_period / exact_period - 1.0)


def _closed_form_row(row_name: str, quantity_name: str, relative_error: float, tolerance_reason: str) -> Row:
    """Row: relative error of a quantity whose exact value has a closed form."""
    return Observed(f"conicity.{row_name}", SYSTEM, quantity_name, relative_error, "").at_most(
        ROUNDING_TOLERANCE, tolerance_reason, "closed form"
    )


def _closed_form_rows() -> list[Row]:
    """Rows on tables of the difference of rolling radii that are exact between their rows, so that errors are due to
    rounding alone."""
    cone = max(
        abs(equivalent_conicity(LATERAL_DISPLACEMENTS, 0.1 * LATERAL_DISPLACEMENTS, a) / 0.05 - 1.0)
        for a in (0.1, 3.0, 8.0)
    )
    wave = klingel_wave(RollingRadiusTable(LATERAL_DISPLACEMENTS, 0.1 * LATERAL_DISPLACEMENTS + 1.0 * 0.1), 3.0)
    tread = np.where(
        np.abs(LATERAL_DISPLACEMENTS) < 3.0,
        0.05 * LATERAL_DISPLACEMENTS,
        np.sign(LATERAL_DISPLACEMENTS) * (0.15 + 0.8 * (np.abs(LATERAL_DISPLACEMENTS) - 3.0)),
    )
    bent = max(
        _relative_period_error(
            klingel_wave(RollingRadiusTable(LATERAL_DISPLACEMENTS, tread), a).period,
            two_slope_period(0.05, 0.8, 3.0, a),
        )
        for a in (3.1, 5.0, 7.9)
    )
    jump = klingel_wave(RollingRadiusTable(np.array([-5.0, 0.0, 0.0, 5.0]), np.array([-0.3, -0.3, 0.3, 0.3])), 2.0)
    left, right = 0.1, 0.4
    uneven = klingel_wave(
        RollingRadiusTable(
            LATERAL_DISPLACEMENTS,
            np.where(LATERAL_DISPLACEMENTS < 0.0, left * LATERAL_DISPLACEMENTS, right * LATERAL_DISPLACEMENTS),
        ),
        3.0,
    )
    halves = math.pi / math.sqrt(left) + math.pi / math.sqrt(right)
    off_centre = 3.0 * (math.sqrt(right) - math.sqrt(left)) / (math.sqrt(right) + math.sqrt(left))
    return [
        _closed_form_row("cone", "cones of 1/20 at three amplitudes, relative error", cone, "the cone's tangent"),
        _closed_form_row(
            "offset",
            "cones on wheels of unequal radii, relative error",
            _relative_period_error(wave.conicity, 0.05),
            "the offset moves the centre alone",
        ),
        _closed_form_row(
            "offset.centre",
            "cones on wheels of unequal radii, centre of the wave",
            abs(wave.centre + 1.0),
            "where both radii are equal, -1 mm",
        ),
        _closed_form_row(
            "two_slopes", "period on tread and flange root, two slopes", bent, "two sines, matched at the bend"
        ),
        _closed_form_row(
            "jump",
            "period with a jump in the middle",
            _relative_period_error(jump.period, 4.0 * math.sqrt(4.0 / 0.3)),
            "parabolas",
        ),
        _closed_form_row(
            "uneven",
            "period of a wheel steeper than the other",
            _relative_period_error(uneven.period, halves),
            "two half sines",
        ),
        _closed_form_row(
            "uneven.centre",
            "a wheel steeper than the other, centre of the wave",
            abs(uneven.centre + off_centre),
            "equal potential at both ends",
        ),
    ]


def two_slope_period(inner_slope: float, outer_slope: float, bend_displacement: float, amplitude: float) -> float:
    """Period of Klingel's wave if the difference of rolling radii has the slope ``inner_slope`` up to the displacement
    ``bend_displacement`` and ``outer_slope`` beyond. The amplitude is larger than ``bend_displacement``."""
    rest = inner_slope * bend_displacement / outer_slope
    deep, root = amplitude - bend_displacement + rest, math.sqrt(outer_slope)
    speed = root * math.sqrt(deep**2 - rest**2)
    within = math.atan(math.sqrt(inner_slope) * bend_displacement / speed) / math.sqrt(inner_slope)
    return 4.0 * (within + math.acos(rest / deep) / root)


def _cubic_radius_difference_row() -> Row:
    """Row: observed order of the period's error in the table spacing, for a difference of rolling radii that is cubic
    in the displacement. The exact period is an elliptic integral."""
    a, b, amplitude = 0.1, 0.02, 4.0
    stiff = a + b * amplitude**2
    exact = 4.0 * float(ellipk(b * amplitude**2 / (2.0 * stiff))) / math.sqrt(stiff)
    errors = []
    for rows in (161, 321):
        y = np.linspace(-8.0, 8.0, rows)
        errors.append(
            _relative_period_error(klingel_wave(RollingRadiusTable(y, a * y + b * y**3), amplitude).period, exact)
        )
    order = math.log2(errors[0] / errors[1])
    why = "complete elliptic integral; lines between rows are off by the square of their distance"
    observed = Observed("conicity.cubic", SYSTEM, "order of the error in the spacing, dr = a y + b y^3", order, "")
    return observed.within(2.0, 0.1, why, "closed form")


def _refused_tables_row() -> Row:
    """Row: tables of the difference of rolling radii that allow no periodic wave are refused."""
    refused = 0
    for y, dr, amplitude in (
        (LATERAL_DISPLACEMENTS, -LATERAL_DISPLACEMENTS, 3.0),
        (LATERAL_DISPLACEMENTS, 0.1 * LATERAL_DISPLACEMENTS + 1.0, 3.0),
        (LATERAL_DISPLACEMENTS, 0.1 * LATERAL_DISPLACEMENTS, 8.1),
        (LATERAL_DISPLACEMENTS, 0.1 * (LATERAL_DISPLACEMENTS + 6.0), 3.0),
    ):
        try:
            equivalent_conicity(y, dr, amplitude)
        except InputError:
            refused += 1
    why = "wrong sign, no zero, beyond the table on both sides and on one: no number may come out"
    return Observed(
        "conicity.refused", SYSTEM, "tables without a wave that are refused, of 4", float(refused), ""
    ).within(4.0, 0.0, why, "none")


def _reference_profile_rows(profile_name: str) -> tuple[list[Row], dict[str, Any]]:
    """Rows on one of the standard's reference profiles, and data for the figure."""
    quantities = (f"{profile_name}: amplitudes outside of the standard's limits", f"{profile_name}: largest error")
    data = data_folder()
    table_file = None if data is None else data / TABLE_FOLDER / f"dr_ce_{profile_name}.dat"
    if table_file is None or not table_file.is_file():
        reason = "TWINRIG_DATA names no folder with the standard's tables"
        ids = (f"conicity.{profile_name}.outside", f"conicity.{profile_name}.error")
        return [not_run(id, SYSTEM, quantity, reason) for id, quantity in zip(ids, quantities, strict=True)], {}
    dr = np.array(table_file.read_text().split(), float)
    y = TABLE_ROW_SPACING * (np.arange(dr.size) - (dr.size - 1) / 2.0)
    limits = np.loadtxt(table_file.with_name(f"ben_{profile_name}.dat"))
    limits = limits[limits[:, 0] <= y[-1] + 1e-9]  # beyond, the table says nothing
    amplitudes, printed, upper, lower = limits[:, :4].T
    waves = [klingel_wave(RollingRadiusTable(y, dr), a) for a in amplitudes]
    seen = np.array([wave.conicity for wave in waves])
    harmonic = [_harmonic_conicity(y, dr, wave) for wave in waves]
    outside = float(((seen < lower) | (seen > upper)).sum())
    why = f"limits of EN 15302 at {len(amplitudes)} amplitudes, to the end of the table"
    rows = [
        Observed(f"conicity.{profile_name}.outside", SYSTEM, quantities[0], outside, "").at_most(0.0, why, "published"),
        Observed(
            f"conicity.{profile_name}.error", SYSTEM, quantities[1], float(np.abs(seen - printed).max()), ""
        ).at_most(CONICITY_ERROR_BOUND, "printed to three digits; the bound asked for", "published"),
        Observed(
            f"conicity.{profile_name}.harmonic",
            SYSTEM,
            f"{profile_name}: largest error of the first harmonic",
            float(np.abs(np.array(harmonic) - printed).max()),
            "",
        ).beside(0.0, "another definition, for comparison"),
    ]
    saved = {"amplitude": amplitudes, "upper": upper, "lower": lower, "seen": seen, "harmonic": harmonic}
    return rows, {profile_name: {key: np.asarray(values).tolist() for key, values in saved.items()}}


def _harmonic_conicity(y: np.ndarray, radius_difference: np.ndarray, wave: KlingelWave) -> float:
    """Conicity by the first harmonic of the wave that a table of radius differences gives."""
    return harmonic_linearised_conicity(y, radius_difference, wave.amplitude * (1.0 - 1e-9), wave.centre)


def _exchanged_wheels_rows() -> list[Row]:
    """Rows: conicity and centre of the wave for wheels of 920 and 918 mm diameter, compared with the mirror image with
    both wheels exchanged."""
    profiles, y = CrossSections(), np.arange(-8e-3, 8.0001e-3, 5e-4)
    large, small = profiles.wheel_on_rail(0.460), profiles.wheel_on_rail(0.459)
    there, back = (
        klingel_wave(rolling_radii_of(right, left, y), 3e-3) for right, left in ((large, small), (small, large))
    )
    why = "exchanged wheels are the mirror image; touching places are found to 1e-13 rad of roll"
    off = abs(back.conicity / there.conicity - 1.0)
    centre = abs(back.centre + there.centre) * 1e3
    return [
        Observed("conicity.mirror", SYSTEM, "S1002 of 920 and 918 mm: difference if exchanged", off, "").at_most(
            1e-6, why, "none"
        ),
        Observed("conicity.mirror.centre", SYSTEM, "sum of both centres", centre, "mm").at_most(1e-6, why, "none"),
    ]


def draw(case_data: dict[str, Any]) -> list[tuple[str, Any]]:
    """Plot the conicities by Klingel's wave and by the first harmonic for the standard's profiles, with the standard's
    limits."""
    from models.drawing.figures import BLUE, VERMILION, add_heading, legend_below, panels

    standard = case_data["standard"]
    if not standard:
        return []
    figure, axes = panels(len(standard), 2, 2.6)
    for axis, (name, of) in zip(axes, standard.items(), strict=True):
        axis.fill_between(of["amplitude"], of["lower"], of["upper"], color="0.85", label="limits of EN 15302")
        axis.plot(of["amplitude"], of["seen"], color=BLUE, label="Klingel's wave")
        axis.plot(of["amplitude"], of["harmonic"], "--", color=VERMILION, label="first harmonic")
        axis.set(title=name, xlabel="amplitude [mm]", ylabel="equivalent conicity [-]")
    legend_below(figure, axes[0])
    add_heading(figure, "Equivalent conicity of the standard's reference profiles")
    return [("Equivalent conicity over the amplitude, within the limits of EN 15302.", figure)]
