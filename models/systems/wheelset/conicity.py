"""Equivalent conicity of a scene's wheels, or of a table: by EN 15302 and by the first harmonic, at each amplitude."""

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import InputError
from models.core.result import Channel, Result, result
from models.core.tables import write_table
from models.rail.equivalent_conicity import ConicityRow, conicity_row
from models.rail.laid_profiles import CrossSections
from models.rail.rolling_radius_table import RollingRadiusTable, read_rolling_radii, rolling_radii_of
from models.rail.wheelset import Wheelset
from models.systems.wheelset.of_scene import wheelset_of
from models.systems.wheelset.scene import ConicityTable, WheelsetScene

CONICITY_CHANNELS = {
    "centre": ("m", "of the wave, to the right"),
    "equivalent": ("-", "equivalent conicity by EN 15302"),
    "harmonic": ("-", "conicity of the harmonic linearisation"),
    "spacing_error": ("-", "of the standard's: its difference on the table without every other row"),
    "wavelength": ("m", "of Klingel's wave on the track"),
}
"""Channels over the amplitude: unit and meaning."""


@dataclass(frozen=True, eq=False)
class Conicities:
    """Equivalent conicities over the amplitude. table : rolling radius differences (m) over lateral displacement (m);
    rows : one per amplitude, NaN where the wheelset has no wave; missing_reasons : why there is no wave, by amplitude
    (m); source : text on what the table describes; wavelengths : of Klingel's wave (m), one per row.
    """

    table: RollingRadiusTable
    rows: tuple[ConicityRow, ...]
    missing_reasons: dict[float, str]
    source: str
    wavelengths: tuple[float, ...]

    def save_table(self, table_path: Path) -> None:
        """Write the rolling radius differences as a table that ``read_rolling_radii`` reads."""
        write_table(table_path, {"y": ("m", self.table.displacements), "dr": ("m", self.table.differences)})


def reports_conicity(scene: WheelsetScene) -> bool:
    """Whether runs of a scene report the equivalent conicity: the scene has [conicity], or a wheelset with profiles."""
    return scene.conicity is not None or wheelset_of(scene).profiles is not None


def run(scene: WheelsetScene, report_progress: Callable[[float], Any] = lambda share: None) -> Result:
    """Compute the equivalent conicity by EN 15302 and by the first harmonic at the scene's amplitudes; the result's
    detail is ``Conicities``.

    report_progress : called with the share of the rolling radii that is done. Raises InputError for a file that is no
    table and for wheels that do not stand on their rails; an amplitude without a wave is a doubt.
    """
    conicity_table, wheelset = scene.conicity or ConicityTable(), wheelset_of(scene)
    table, source = _rolling_radius_table(scene, conicity_table, wheelset, report_progress)
    rows, why = list[ConicityRow](), dict[float, str]()
    for amplitude in conicity_table.amplitudes:
        try:
            rows.append(conicity_row(table, amplitude, centre_guess=conicity_table.near))
        except InputError as error:
            rows.append(ConicityRow(amplitude, *[math.nan] * 5))
            why[amplitude] = error.allowed
    track = math.sqrt(wheelset.radius * 2.0 * wheelset.half_gauge)
    detail = Conicities(table, tuple(rows), why, source, tuple(row.period * track for row in rows))
    values = [asdict(row) | {"wavelength": row.period * track} for row in rows]
    channels = {
        name: Channel("amplitude", np.array([row[name] for row in values]), unit, meaning)
        for name, (unit, meaning) in CONICITY_CHANNELS.items()
    }
    axis = Channel("amplitude", np.array(conicity_table.amplitudes), "m")
    doubts = [f"at {amplitude:g} m: {reason}" for amplitude, reason in why.items()]
    return result(scene, channels, {"amplitude": axis}, engine="reference", doubts=doubts, detail=detail)


def check(scene: WheelsetScene) -> None:
    """Raise InputError, before anything is computed, for a file that is no table of rolling radius differences, and for
    left wheel or rail files that are no profiles.
    """
    conicity_table = scene.conicity or ConicityTable()
    if conicity_table.table is not None:
        read_rolling_radii(scene.path(conicity_table.table, "conicity.table"))
    elif (profiles := wheelset_of(scene).profiles) is not None:
        _left_profiles(scene, conicity_table, profiles)


def _left_profiles(scene: WheelsetScene, conicity_table: ConicityTable, profiles: CrossSections) -> CrossSections:
    """Profiles of the left wheel and rail: as [conicity] names them, else the right side's."""
    named = {
        key: value
        for key, value in (("wheel", conicity_table.left_wheel), ("rail", conicity_table.left_rail))
        if value is not None
    }
    return profiles.model_copy(update=named).with_full_paths(scene) if named else profiles


def _rolling_radius_table(
    scene: WheelsetScene, conicity_table: ConicityTable, wheelset: Wheelset, report_progress: Callable[[float], Any]
) -> tuple[RollingRadiusTable, str]:
    if conicity_table.table is not None:
        return read_rolling_radii(scene.path(conicity_table.table, "conicity.table")), conicity_table.table
    right, left = conicity_table.right_radius or wheelset.radius, conicity_table.left_radius or wheelset.radius
    radii = f"radius {right:g} m" if right == left else f"radii {right:g} m right, {left:g} m left"
    if wheelset.profiles is None:
        half = max(conicity_table.amplitudes) + abs(right - left) / wheelset.equivalent_conicity
        y = np.array([-half, 0.0, half])
        cones = f"cones of conicity {wheelset.conicity:g}, {radii}"
        return RollingRadiusTable(y, 2.0 * wheelset.equivalent_conicity * y + right - left), cones
    profiles = wheelset.profiles
    of_left = _left_profiles(scene, conicity_table, profiles)
    count = round(conicity_table.reach / conicity_table.spacing)
    displacements = conicity_table.reach * np.arange(-count, count + 1) / count
    sides = f"{profiles.wheel} on {profiles.rail}"
    sides += f", left {of_left.wheel} on {of_left.rail}" if of_left != profiles else ""
    table = rolling_radii_of(profiles.wheel_on_rail(right), of_left.wheel_on_rail(left), displacements, report_progress)
    return replace(table, source=sides), f"{sides}, {radii}"


def refuse_without_wave(scene: WheelsetScene, conicities: Conicities) -> None:
    """Raise InputError where the wheelset runs on no wave at any of the scene's amplitudes."""
    if len(conicities.missing_reasons) == len(conicities.rows):
        amplitude, why = next(iter(conicities.missing_reasons.items()))
        table = scene.conicity.table if scene.conicity else None
        raise InputError(table or scene.file, "conicity.amplitudes", amplitude, why)


def conicity_numbers(conicity_result: Result) -> dict[str, Any]:
    """Equivalent conicity by EN 15302 and by the first harmonic at each amplitude (m), with the centre of the wave (m),
    as numbers for a JSON file; None where there is no wave.
    """
    rows: tuple[ConicityRow, ...] = conicity_result.detail.rows
    return {
        "conicity": [
            {name: value if math.isfinite(value) else None for name, value in asdict(row).items() if name != "period"}
            for row in rows
        ]
    }


def conicity_lines(conicities: Conicities) -> list[str]:
    """Lines of a text table with the equivalent conicity by EN 15302 and by the first harmonic at every amplitude."""
    head = f"    {'amplitude':>12}{'EN 15302':>12}{'+-':>10}{'1st harmonic':>14}{'centre':>13}{'wavelength':>14}"
    lines_of_text = [f"  equivalent conicity of {conicities.source}", head]
    for row, wavelength in zip(conicities.rows, conicities.wavelengths, strict=True):
        if row.amplitude in conicities.missing_reasons:
            lines_of_text.append(f"    {1e3 * row.amplitude:>9.4g} mm  {conicities.missing_reasons[row.amplitude]}")
            continue
        error = f"{row.spacing_error:>10.1g}" if math.isfinite(row.spacing_error) else f"{'-':>10}"
        wave = f"{wavelength:>12.5g} m" if math.isfinite(wavelength) else f"{'no wave':>14}"
        lines_of_text.append(
            f"    {1e3 * row.amplitude:>9.4g} mm{row.equivalent:>12.5f}{error}{row.harmonic:>14.5f}"
            f"{1e3 * row.centre + 0.0:>10.4f} mm{wave}"
        )
    return lines_of_text
