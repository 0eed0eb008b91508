"""Readers of wheel and rail profile files: two columns of text, Simpack (.prw, .prr) and MiniProf (.whl, .ban).

two columns   y and z per line and nothing else, apart by blanks, commas or semicolons; from #, ! or % on a comment
Simpack       keys "name = value" and the points between point.begin and point.end; "!" starts a comment. Shift,
              rotation, bounds, mirrors, order and unit of the header are applied, in this order
MiniProf      a header of lines "key=value", an empty line, then the points x y ...; y upwards

Lengths are in mm unless a Simpack header says otherwise. What a file leaves open is found from the shape: a wheel's
flange is where its profile is farthest from the tread, and is laid at negative y, downwards; the top of a rail is up. A
rail's gauge corner cannot be told from its shape, so a rail that is drawn the other way round needs ``mirror``.
"""

import math
import re
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from models.contact.inputs import Array
from models.contact.profiles import ContactProfile, profile_of_points
from models.core.errors import InputError, similar_file

METRES_PER_MILLIMETRE = 1e-3
ProfileKind = Literal["wheel", "rail"]
PointArrays = tuple[Array, Array]
SIMPACK, MINIPROF = (".prw", ".prr"), (".whl", ".ban")
KIND_OF_ENDING = {".prw": "wheel", ".prr": "rail", ".whl": "wheel", ".ban": "rail"}
COMMENT_PATTERN = re.compile(r"[#!%].*")
SEPARATOR_PATTERN = re.compile(r"[\s,;]+")
DECIMAL_COMMA_PATTERN = re.compile(r"\d,\d.*(?<!,)[\s;]|(?<!,)[\s;].*\d,\d")
"""Pattern of a decimal comma: a comma between digits where something else separates the numbers."""
SHOWN_CHARACTER_LIMIT = 40
"""Largest number of characters of a file's line that an error message shows."""
LARGEST_TAPING_OFFSET = 5e-3
"""Largest |z| (m) of a wheel profile at y = 0, where its radius is measured."""


def read_profile(
    profile_path: str | Path, profile_kind: ProfileKind, *, smoothing: float = 0.0, is_mirrored: bool = False
) -> ContactProfile:
    """Wheel or rail profile read from a file, in the package's axes (m, z down, flange or gauge corner at negative y).

    profile_kind : "wheel" or "rail". smoothing : wavelength (m) of which half is left. is_mirrored : exchange left and
    right. Raises InputError for a file that cannot be read or understood, naming the line and its text.
    """
    if profile_kind not in get_args(ProfileKind):
        raise InputError("", "kind", profile_kind, "is not known", get_args(ProfileKind))
    profile_path = Path(profile_path)
    ending = profile_path.suffix.lower()
    if KIND_OF_ENDING.get(ending, profile_kind) != profile_kind:
        raise InputError(
            profile_path,
            "",
            None,
            f"is a file of a {KIND_OF_ENDING[ending]} by its ending, and a {profile_kind} is wanted",
        )
    lines = _lines_of_file(profile_path)
    reader = (
        _points_of_simpack if ending in SIMPACK else _points_of_miniprof if ending in MINIPROF else _points_of_columns
    )
    y, z = reader(lines, profile_path)
    if y.size < 10:
        raise InputError(profile_path, "", int(y.size), "points found; a profile needs ten or more, two numbers a line")
    y, z = _upright_points(y, z, profile_kind)
    read = profile_of_points(-y if is_mirrored else y, z, smoothing, profile_path)
    if profile_kind == "wheel":
        _check_taping(read, profile_path)
    return read


def _check_taping(wheel: ContactProfile, profile_path: Path) -> None:
    """Refuse a wheel profile whose y or z is not measured from the taping line, but from the flange's back or the
    axle.
    """
    middle = float(np.interp(0.0, wheel.y, wheel.z, left=np.nan, right=np.nan))
    if not abs(middle) <= LARGEST_TAPING_OFFSET:
        raise InputError(
            profile_path,
            "profile at y = 0, in m",
            middle,
            "y must count from the taping line and z from the "
            f"tread there, to within {LARGEST_TAPING_OFFSET:g} m: shift the profile",
        )


def _lines_of_file(profile_path: Path) -> list[str]:
    """Lines of a text file; raises InputError where it cannot be read."""
    try:
        return profile_path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    except OSError as error:
        reason = error.strerror or "cannot be read"
        raise InputError(
            profile_path, "", None, f"{reason[0].lower()}{reason[1:]}{similar_file(profile_path)}"
        ) from None


def _parse_numbers(line_text: str, line_number: int, profile_path: Path, least_count: int = 2) -> list[float]:
    """Numbers in one line of a file; raises InputError with the line if it has too few numbers or other text."""
    if DECIMAL_COMMA_PATTERN.search(line_text.strip()):
        raise InputError(
            profile_path,
            f"line {line_number}",
            line_text.strip()[:SHOWN_CHARACTER_LIMIT],
            "has decimal commas: write decimal points",
        )
    try:
        numbers = [float(part) for part in SEPARATOR_PATTERN.split(line_text.strip(" \t,;"))]
    except ValueError:
        numbers = []
    if len(numbers) < least_count or not all(math.isfinite(value) for value in numbers):
        raise InputError(
            profile_path,
            f"line {line_number}",
            line_text.strip()[:SHOWN_CHARACTER_LIMIT],
            f"must hold {least_count} or more finite numbers",
        )
    return numbers


def _points_of_rows(table_rows: list[list[float]], first_column: int = 0, second_column: int = 1) -> PointArrays:
    """Two columns of a table of rows, as arrays (n,)."""
    return np.array([row[first_column] for row in table_rows]), np.array([row[second_column] for row in table_rows])


def _points_of_columns(file_lines: list[str], profile_path: Path) -> PointArrays:
    """Points y, z (m) of a file with two columns of numbers in mm."""
    plain = [(k, COMMENT_PATTERN.sub("", line)) for k, line in enumerate(file_lines, 1)]
    rows = [(k, _parse_numbers(line, k, profile_path)) for k, line in plain if line.strip()]
    for k, row in rows:
        if len(row) > 2:
            raise InputError(
                profile_path,
                f"line {k}",
                file_lines[k - 1].strip()[:SHOWN_CHARACTER_LIMIT],
                f"must hold y and z, found {len(row)} numbers",
            )
    y, z = _points_of_rows([row for _, row in rows])
    return y * METRES_PER_MILLIMETRE, z * METRES_PER_MILLIMETRE


def _points_of_miniprof(file_lines: list[str], profile_path: Path) -> PointArrays:
    """Points y, z (m) of a MiniProf file: a header that ends with the first empty line, then points with y upwards."""
    rows, columns, heading = [], ["X", "Y"], True
    for k, line in enumerate(file_lines, 1):
        if heading:
            key, equals, value = line.partition("=")
            if key.strip().lower() == "columndef":
                columns = [name.strip().upper() for name in value.split(",")]
            if line.strip() and not equals:
                raise InputError(
                    profile_path,
                    f"line {k}",
                    line.strip()[:SHOWN_CHARACTER_LIMIT],
                    "must be key=value: a MiniProf header ends with an empty line",
                )
            heading = bool(line.strip())
        elif line.strip():
            rows.append(_parse_numbers(line, k, profile_path))
    if not {"X", "Y"} <= set(columns[:2]):
        raise InputError(profile_path, "ColumnDef", ",".join(columns), "must begin with X,Y or Y,X")
    x, y = _points_of_rows(rows, columns.index("X"), columns.index("Y"))
    return x * METRES_PER_MILLIMETRE, -y * METRES_PER_MILLIMETRE


def _points_of_simpack(file_lines: list[str], profile_path: Path) -> PointArrays:
    """Points y, z (m) of a Simpack file, transformed as its header says."""
    keys: dict[str, tuple[str, int]] = {}
    rows: list[list[float]] = []
    inside = ended = False
    for k, line in enumerate(file_lines, 1):
        text = line.partition("!")[0].strip()
        if text == "point.begin":
            inside = True
        elif text == "point.end":
            inside, ended = False, True
        elif inside and text:
            rows.append(_parse_numbers(text, k, profile_path))
        elif "=" in text:
            name, _, value = text.partition("=")
            keys[name.strip()] = (value.strip(), k)
    if not ended:
        raise InputError(profile_path, "", None, "has no points between point.begin and point.end")
    return _transformed_points(
        _points_of_rows(rows), {name: _header_value(keys, name, profile_path) for name in HEADER_DEFAULTS}
    )


HEADER_DEFAULTS = {
    "shift.y": 0.0,
    "shift.z": 0.0,
    "rotate": 0.0,
    "bound.y.min": 1.0,
    "bound.y.max": 0.0,
    "bound.z.min": 1.0,
    "bound.z.max": 0.0,
    "mirror.y": 0.0,
    "mirror.z": 0.0,
    "inversion": 0.0,
    "units.len.f": 1e3,
    "units.ang.f": 1.0,
}
"""Keys of a Simpack file that change its points, with their defaults; bounds whose lower one is larger are no
bounds.
"""


def _header_value(header_keys: dict[str, tuple[str, int]], key_name: str, profile_path: Path) -> float:
    """Value of a key of a Simpack header, or its default."""
    text, line = header_keys.get(key_name, (str(HEADER_DEFAULTS[key_name]), 0))
    value = _parse_numbers(text, line, profile_path, 1)[0]
    if key_name.startswith("units") and value <= 0.0:
        raise InputError(
            profile_path, f"line {line}: {key_name}", value, "must be above 0 (units of the file by m or rad)"
        )
    return value


def _transformed_points(points: PointArrays, header_values: dict[str, float]) -> PointArrays:
    """Points y, z (m) after the operations of a Simpack header: shift, rotation, bounds, mirrors, order and unit, in
    this order.
    """
    y, z = points[0] + header_values["shift.y"], points[1] + header_values["shift.z"]
    angle = header_values["rotate"] / header_values["units.ang.f"]
    y, z = y * np.cos(angle) - z * np.sin(angle), y * np.sin(angle) + z * np.cos(angle)
    keep = np.full(y.shape, True)
    for values, axis in ((y, "y"), (z, "z")):
        low, high = header_values[f"bound.{axis}.min"], header_values[f"bound.{axis}.max"]
        keep &= (low >= high) | ((values >= low) & (values <= high))
    y, z = y[keep] * (1.0 - 2.0 * header_values["mirror.y"]), z[keep] * (1.0 - 2.0 * header_values["mirror.z"])
    order = slice(None, None, -1 if header_values["inversion"] else 1)
    return y[order] / header_values["units.len.f"], z[order] / header_values["units.len.f"]


def _upright_points(y: Array, z: Array, profile_kind: ProfileKind) -> PointArrays:
    """Profile points turned so that the rail's top is up, or the wheel's flange is down and at negative y."""
    if profile_kind == "rail":
        ends = 0.5 * (z[0] + z[-1])
        return (y, z) if ends >= np.median(z) else (y, -z)
    middle = np.median(z)
    tip = int(np.argmax(np.abs(z - middle)))
    z = z if z[tip] > middle else -z
    return (y, z) if y[tip] < 0.5 * (y.min() + y.max()) else (-y, z)
