"""Roads in OpenCRG files (.crg), read by the library pyopencrg after a check that all announced bytes are there.

OpenCRG gives heights **up** over u (along the reference line) and v (across, positive to the left);
here zeta = -height, and u minus the file's first u is the arc length s, for every track, so that the
wheels of an axle stay side by side in a bend. Height = grid + reference line + banking v.

The library alone does not refuse everything that is cut off: a text file cut within its last number is
read, without a word, with the digits that are left; one cut anywhere between records, or a binary file
cut between two blocks of 80 bytes, is read as a shorter road with a warning. So the number of records
that the header promises is compared with the bytes that are there before the library reads them, and
every warning of the library about the reading is an error here. What no reader can see is a digit or a
bit of a height that was changed: the format has no check sum.
"""

import math
import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyopencrg
from pyopencrg.io import IplData, cut_block, read_ipl

from models.core.errors import InputError
from models.road import TRACK_WIDTH
from models.road.profile import RoadProfile, SplineProfile

SMALLEST_INCREMENT = 1e-3
"""Smallest distance (m) of stations that the format's own checks accept."""

_LATERAL_POSITIONS = {"left": (0.5,), "right": (-0.5,), "centre": (0.0,), "mean": (0.5, -0.5)}
_BYTES_PER_VALUE = {"KRBI": 4, "KDBI": 8, "LRFI": 10, "LDFI": 20}
_HEADER_LINE_LENGTH = 80
_KEYWORD_PATTERN = re.compile(r"\s*(\w+)\s*=\s*(\S+)")


@dataclass(frozen=True)
class _AnnouncedLayout:
    """Data layout that the header of a file announces: records, channels, bytes per value, text or binary."""

    records: int
    channels: int
    width: int
    text: bool
    offset: int


def read_opencrg(
    road_path: str | Path, track_name: str = "mean", *, lateral_offset: float = 0.0, track_width: float = TRACK_WIDTH
) -> SplineProfile:
    """Road, a C2 spline, along one track of an OpenCRG file.

    Parameters
    ----------
    road_path : file of any of the formats KRBI, KDBI, LRFI, LDFI
    track_name : "left" and "right" lie at v = offset +- track_width / 2, "centre" at v = offset, and "mean" is
        the mean height of left and right; between two long sections the height is linear in v
    lateral_offset, track_width : m; v is positive to the left of the reference line

    Returns
    -------
    profile with stations from 0 (m) and zeta positive down (m)

    Raises
    ------
    InputError : naming file, place, value and what is allowed, for every file that is damaged, cut off,
        inconsistent, has no height on the track, or scales itself by modifiers (apply them first)
    """
    if track_name not in _LATERAL_POSITIONS:
        raise InputError(road_path, "track", track_name, "must be a track", tuple(_LATERAL_POSITIONS))
    road = _load_opencrg(road_path)
    lines = [
        _heights_at(road_path, road, lateral_offset + side * track_width) for side in _LATERAL_POSITIONS[track_name]
    ]
    heights_up = lines[0] if len(lines) == 1 else 0.5 * (lines[0] + lines[1])
    if heights_up.size < 4:
        raise InputError(road_path, "cross sections", heights_up.size, "at least 4 are needed")
    return SplineProfile.through(
        np.arange(heights_up.size) * road.u_inc, -heights_up, f"{Path(road_path).name}, {track_name}"
    )


def write_opencrg(
    road_profile: RoadProfile,
    road_path: str | Path,
    road_length: float,
    increment: float,
    right_profile: RoadProfile | None = None,
    track_width: float = TRACK_WIDTH,
) -> None:
    """Write a road from s = 0 to ``road_length`` (m) to an OpenCRG file in the format KDBI.

    KDBI holds IEEE doubles, and the header writes the increment with 17 digits: what is read back at the
    stations is what was written, bit for bit. Between them the reader's spline stands for the road.

    Parameters
    ----------
    road_profile : the road, or its left track if ``right_profile`` is given
    road_path : file to write; it is replaced
    road_length, increment : m; the length is a whole number (3 or more) of increments of at least 1 mm
    right_profile : right track
    track_width : the two long sections stand at v = +- track_width / 2, m

    Raises
    ------
    InputError : lengths that are not possible, a road too short, a file that cannot be written
    """
    count = _count_of_stations(road_path, road_length, increment)
    tracks = [
        right_profile if right_profile is not None else road_profile,
        road_profile,
    ]  # the format goes from right to left
    s = np.arange(count) * increment
    heights_up = np.column_stack([-track.height_and_slope(s)[0] for track in tracks])
    across = [-track_width / 2.0, track_width / 2.0]
    try:
        road = pyopencrg.CrgRoad(heights_up, increment, across, comments=[f"{road_profile.name[:60]} (heights up, m)"])
        road.save(road_path, fmt="KDBI")
    except (OSError, ValueError) as error:
        raise InputError(road_path, "", None, f"the file cannot be written: {error}") from None


def _count_of_stations(road_path: str | Path, road_length: float, increment: float) -> int:
    """Number of stations of a road to be written, after checks."""
    if not (math.isfinite(increment) and increment >= SMALLEST_INCREMENT):
        raise InputError(road_path, "increment (m)", increment, f"must be {SMALLEST_INCREMENT} or more")
    steps = round(road_length / increment) if math.isfinite(road_length) else 0
    if steps < 3 or abs(steps * increment - road_length) > 1e-9 * road_length:
        raise InputError(
            road_path, "length (m)", road_length, f"must be a whole number, 3 or more, of increments of {increment}"
        )
    return steps + 1


def _load_opencrg(road_path: str | Path) -> Any:
    """The complete OpenCRG file as the library reads it; every complaint of the library about reading becomes an
    error."""
    promise = _check_header(road_path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # looked at below, where they can be told apart
            road = pyopencrg.read(road_path)
    except Exception as error:
        raise _unreadable_file_error(road_path, error) from None
    if road.read_warnings:
        raise InputError(road_path, "data", None, road.read_warnings[0])
    if road.nu != promise.records:
        raise InputError(road_path, "cross sections", road.nu, f"the header promises {promise.records}")
    scaled = {key: x for key, x in (road.mods or {}).items() if key.startswith("scale_") and x != 1.0}
    if scaled:
        key, value = next(iter(scaled.items()))
        raise InputError(road_path, key, value, "modifiers are not applied here: save the file with them applied")
    return road


def _unreadable_file_error(road_path: str | Path, library_error: Exception) -> InputError:
    """InputError from any exception of the library, which damaged bytes may raise in almost any form."""
    reason = str(library_error).replace(f"{road_path}: ", "").split("\nTo open it anyway")[0]
    return InputError(road_path, "", None, f"not a readable OpenCRG file: {reason or type(library_error).__name__}")


def _check_header(road_path: str | Path) -> _AnnouncedLayout:
    """Read the header, check it, and compare the number of bytes that follow with the number that the header gives."""
    try:
        header = read_ipl(road_path, meta_only=True)
        data = Path(road_path).read_bytes()[header.data_offset :]
        marked = b"#:" in Path(road_path).read_bytes()[: header.data_offset]
    except Exception as error:
        raise _unreadable_file_error(road_path, error) from None
    if not header.kd_def or not marked or header.fmt not in _BYTES_PER_VALUE:
        formats = ", ".join(_BYTES_PER_VALUE)
        raise InputError(
            road_path, "$KD_DEFINITION", None, f"the data channels and one of the formats {formats} are needed"
        )
    text = header.fmt.startswith("L")
    promise = _AnnouncedLayout(
        _count_of_records(road_path, header), len(header.kd_def), _BYTES_PER_VALUE[header.fmt], text, header.data_offset
    )
    (_check_text if text else _check_binary)(road_path, promise, data)
    return promise


def _count_of_records(road_path: str | Path, file_header: IplData) -> int:
    """Number of cross sections between the first and the last u (m) of the header."""
    if cut_block(file_header.struct, "ROAD_CRG_FILE")[0] is not None:
        raise InputError(road_path, "$ROAD_CRG_FILE", None, "the data must be in the same file as the header")
    block, _ = cut_block(file_header.struct, "ROAD_CRG")
    matches = [_KEYWORD_PATTERN.match(line.lower()) for line in block or []]
    values = {match[1]: match[2] for match in matches if match}
    start = _header_number(road_path, values, "reference_line_start_u", "0")
    end = _header_number(road_path, values, "reference_line_end_u")
    increment = _header_number(road_path, values, "reference_line_increment")
    if increment < SMALLEST_INCREMENT:
        raise InputError(road_path, "reference_line_increment", increment, f"must be {SMALLEST_INCREMENT} m or more")
    if _header_number(road_path, values, "long_section_v_increment", "1") <= 0.0:
        raise InputError(road_path, "long_section_v_increment", values["long_section_v_increment"], "must be above 0")
    if end <= start:
        raise InputError(road_path, "reference_line_end_u", end, f"must be greater than the start, {start:g}")
    return round((end - start) / increment) + 1


def _header_number(road_path: str | Path, header_values: dict[str, str], header_key: str, default: str = "") -> float:
    """Number from the header. Length and increment must be there, since without them missing data go unnoticed."""
    text = header_values.get(header_key, default)
    try:
        number = float(text.replace("d", "e"))
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InputError(road_path, f"$ROAD_CRG, {header_key}", text or None, "a finite number in m is needed here")
    return number


def _check_binary(road_path: str | Path, announced_layout: _AnnouncedLayout, data_bytes: bytes) -> None:
    """Check that binary data are records without gaps, padded to a multiple of 80 bytes."""
    wanted = (
        math.ceil(announced_layout.records * announced_layout.channels * announced_layout.width / _HEADER_LINE_LENGTH)
        * _HEADER_LINE_LENGTH
    )
    if len(data_bytes) != wanted:
        expectation = (
            f"{announced_layout.records} cross sections of {announced_layout.channels} values need {wanted} bytes"
        )
        raise InputError(
            road_path,
            f"data from byte {announced_layout.offset}",
            len(data_bytes),
            f"{expectation}: the file is cut off or damaged",
        )


def _check_text(road_path: str | Path, announced_layout: _AnnouncedLayout, data_bytes: bytes) -> None:
    """Check that text data are lines of full width with line ends; a number cut short makes its line shorter."""
    body = data_bytes.rstrip(b"\r\n")
    lines, ended = body.split(b"\n"), len(body) < len(data_bytes)
    per_line = _HEADER_LINE_LENGTH // announced_layout.width
    per_record = math.ceil(announced_layout.channels / per_line)
    wanted = announced_layout.records * per_record
    if len(lines) != wanted or not ended:
        counted = len(lines) if ended else f"{len(lines)}, the last without a line end"
        allowed = f"{announced_layout.records} cross sections need {wanted} lines: the file is cut off or damaged"
        raise InputError(road_path, f"lines of data from byte {announced_layout.offset}", counted, allowed)
    last_line_values = announced_layout.channels - (per_record - 1) * per_line
    for i, line in enumerate(lines):
        width = (last_line_values if i % per_record == per_record - 1 else per_line) * announced_layout.width
        if len(line.rstrip()) != width:
            raise InputError(
                road_path, f"data line {i + 1}", line.decode("latin-1"), f"must be {width} characters wide"
            )


def _heights_at(road_path: str | Path, crg_road: Any, lateral_position: float) -> np.ndarray:
    """Heights (m, up) of every cross section at the lateral position ``lateral_position`` (m, positive left)."""
    if not crg_road.v_min - 1e-9 <= lateral_position <= crg_road.v_max + 1e-9:
        allowed = f"the file covers v = {crg_road.v_min:g} to {crg_road.v_max:g} m"
        raise InputError(road_path, "lateral position of the track (m)", lateral_position, allowed)
    nearest = int(np.argmin(np.abs(crg_road.v - lateral_position)))
    if abs(crg_road.v[nearest] - lateral_position) <= 1e-9:  # on a long section: its neighbour may well be empty
        grid = crg_road.z[:, nearest]
    else:
        j = int(np.searchsorted(crg_road.v, lateral_position)) - 1
        fraction = (lateral_position - crg_road.v[j]) / (crg_road.v[j + 1] - crg_road.v[j])
        grid = (1.0 - fraction) * crg_road.z[:, j] + fraction * crg_road.z[:, j + 1]
    heights_up = grid + crg_road.zr + crg_road.banking * lateral_position
    empty = np.flatnonzero(~np.isfinite(heights_up))
    if empty.size:
        location = f"cross section {empty[0] + 1} (u = {crg_road.u[empty[0]]:g} m), v = {lateral_position:g} m"
        raise InputError(
            road_path, location, float(heights_up[empty[0]]), "a height is needed at every station of the track"
        )
    return heights_up
