"""Tyre tables from property files of the magic formula (`.tir`, MF-Tyre 5.x and PAC2002).

Read are the coefficients of pure slip over load; slipping in both directions goes by similarity (``magic_formula``).
Left out: camber, inflation pressure, shifts of the curves (a table is 0 at no slip), the difference of left and right,
combined coefficients. Along the wheel the curve is that of braking. Slips beyond the file's range are the formula's.
Source: H. B. Pacejka, Tyre and vehicle dynamics, sec. 4.3.2, Delft-Tyre '97 and its equations (4.E9) to (4.E28).
"""

import math
import re
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from models.core.errors import InputError
from models.core.tables import whole_text
from models.tyre.magic_formula import MagicFormulaCurve, table_by_similarity
from models.tyre.tyre_table import TyreTable

ACCEPTED_UNITS = {"LENGTH": ("meter", "metre", "m"), "FORCE": ("newton", "n"), "ANGLE": ("radians", "radian", "rad")}
"""Units of a property file in which the formula is read; a file in other units is refused."""
FITTYP_VERSIONS = (5.0, 6.0, 50.0, 51.0, 52.0)
"""Values of the key FITTYP of the property files whose equations are read here."""
NEEDED_KEYS = ("FNOMIN", "FZMIN", "FZMAX", "PCX1", "PDX1", "PKX1", "PCY1", "PDY1", "PKY1", "PKY2")
SCALING_FACTORS = ("LFZO", "LCX", "LMUX", "LEX", "LKX", "LCY", "LMUY", "LEY", "LKY")
"""Names of scaling factors, 1 where the file has none; all other coefficients are then 0."""
COEFFICIENT_PATTERN = re.compile(r"P[CDEK][XY]\d")
LOAD_NODES = 9
"""Count of nodes of the load from FZMIN to FZMAX."""


@dataclass(frozen=True)
class TirProperty:
    """Value of a key of a property file as text, and its line number."""

    text: str
    line: int


def tir_table(tir_path: str | Path) -> TyreTable:
    """Tyre table from a `.tir` file. Raises InputError with file, line, key, value and the allowed values."""
    properties = _keys_of_sections(tir_path)
    _check_properties(tir_path, properties)
    named = (
        name for name in properties if name in (*NEEDED_KEYS, *SCALING_FACTORS) or COEFFICIENT_PATTERN.fullmatch(name)
    )
    c = defaultdict(float, dict.fromkeys(SCALING_FACTORS, 1.0)) | {
        name: _number_of_key(tir_path, properties, name) for name in named
    }
    least_load, largest_load, nominal = c["FZMIN"], c["FZMAX"], c["FNOMIN"]
    for name in ("FNOMIN", "FZMIN", "FZMAX"):
        if not 0.0 < c[name] <= 1e7:
            raise _wrong_value_error(tir_path, properties, name, "must be a load above 0 and at most 1e7 N")
    if not least_load < largest_load:
        raise _wrong_value_error(tir_path, properties, "FZMAX", f"must be above FZMIN, {least_load:g}")
    loads = np.unique(
        np.concatenate(
            (np.linspace(least_load, largest_load, LOAD_NODES), np.clip([nominal], least_load, largest_load))
        )
    )
    curves = {load: (longitudinal_formula(c, load), lateral_formula(c, load)) for load in loads}
    _check_curves(tir_path, curves)
    return table_by_similarity(
        lambda k, load: curves[load][0](k), lambda k, load: curves[load][1](k), loads, table_name=Path(tir_path).name
    )


def longitudinal_formula(coefficients: dict[str, float], wheel_load: float) -> MagicFormulaCurve:
    """Magic formula of braking under a load (N) from the coefficients of a property file."""
    _, load_excess = _load_excess(coefficients, wheel_load)
    peak = (coefficients["PDX1"] + coefficients["PDX2"] * load_excess) * coefficients["LMUX"]
    shape = coefficients["PCX1"] * coefficients["LCX"]
    bend = (
        (coefficients["PEX1"] + coefficients["PEX2"] * load_excess + coefficients["PEX3"] * load_excess**2)
        * (1.0 + coefficients["PEX4"])
        * coefficients["LEX"]
    )
    stiffness = (
        (coefficients["PKX1"] + coefficients["PKX2"] * load_excess)
        * math.exp(coefficients["PKX3"] * load_excess)
        * coefficients["LKX"]
    )
    return MagicFormulaCurve(peak, stiffness / (shape * peak) if shape * peak else math.nan, shape, min(bend, 1.0))


def lateral_formula(coefficients: dict[str, float], wheel_load: float) -> MagicFormulaCurve:
    """Magic formula of cornering under a load (N) from the coefficients of a property file, without their signs."""
    nominal, load_excess = _load_excess(coefficients, wheel_load)
    peak = abs(coefficients["PDY1"] + coefficients["PDY2"] * load_excess) * coefficients["LMUY"]
    shape = coefficients["PCY1"] * coefficients["LCY"]
    bend = (coefficients["PEY1"] + coefficients["PEY2"] * load_excess) * coefficients["LEY"]
    turn = math.sin(2.0 * math.atan2(wheel_load, coefficients["PKY2"] * nominal))
    stiffness = abs(coefficients["PKY1"]) * nominal * turn * coefficients["LKY"] / wheel_load
    return MagicFormulaCurve(peak, stiffness / (shape * peak) if shape * peak else math.nan, shape, min(bend, 1.0))


def _load_excess(coefficients: dict[str, float], wheel_load: float) -> tuple[float, float]:
    """Scaled nominal load (N), and relative excess of a load above it."""
    nominal = coefficients["FNOMIN"] * coefficients["LFZO"]
    return nominal, (wheel_load - nominal) / nominal


def _keys_of_sections(tir_path: str | Path) -> dict[str, TirProperty]:
    """Keys of all sections of a property file, in capital letters."""
    properties: dict[str, TirProperty] = {}
    for line, row in enumerate(whole_text(tir_path).splitlines(), start=1):
        plain = row.partition("$")[0].partition("!")[0].strip()
        name, equals, value = plain.partition("=")
        if equals:
            key = name.strip().upper()
            if key in properties and key in (*NEEDED_KEYS, *ACCEPTED_UNITS):
                raise InputError(
                    tir_path, f"line {line}, {key}", value.strip(), f"stands in line {properties[key].line} already"
                )
            properties[key] = TirProperty(value.strip().strip("'\""), line)
    return properties


def _check_properties(tir_path: str | Path, properties: dict[str, TirProperty]) -> None:
    for name, allowed in ACCEPTED_UNITS.items():
        if name not in properties:
            raise InputError(tir_path, f"[UNITS] {name}", None, f"is missing: write {name} = '{allowed[0]}'")
        if properties[name].text.lower() not in allowed:
            raise _wrong_value_error(tir_path, properties, name, f"must be '{allowed[0]}'")
    if "FITTYP" in properties and _number_of_key(tir_path, properties, "FITTYP") not in FITTYP_VERSIONS:
        raise _wrong_value_error(
            tir_path,
            properties,
            "FITTYP",
            "is of other equations; read are those of MF-Tyre 5.x and PAC2002 (5, 6, 50, 51, 52)",
        )
    for name in NEEDED_KEYS:
        if name not in properties:
            raise InputError(tir_path, name, None, "is missing; needed are " + ", ".join(NEEDED_KEYS))


def _number_of_key(tir_path: str | Path, properties: dict[str, TirProperty], key_name: str) -> float:
    try:
        value = float(properties[key_name].text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise _wrong_value_error(tir_path, properties, key_name, "must be a finite number")
    return value


def _wrong_value_error(
    tir_path: str | Path, properties: dict[str, TirProperty], key_name: str, allowed_text: str
) -> InputError:
    return InputError(
        tir_path, f"line {properties[key_name].line}, {key_name}", properties[key_name].text, allowed_text
    )


def _check_curves(
    tir_path: str | Path, curves_by_load: dict[float, tuple[MagicFormulaCurve, MagicFormulaCurve]]
) -> None:
    """Raise InputError for coefficients that give no friction, or friction that changes its sign."""
    for load, pair in curves_by_load.items():
        for letter, curve in zip("XY", pair, strict=True):
            if not (0.0 < curve.D <= 3.0 and 0.0 < curve.C <= 2.0 and 0.0 < curve.B < 1e4):
                raise InputError(
                    tir_path,
                    f"P*{letter}* at {load:g} N",
                    [curve.D, curve.B, curve.C],
                    "give no friction: peak from 0 to 3, B above 0, C from 0 to 2",
                )
