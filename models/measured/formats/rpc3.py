"""Reader of MTS RPC III time histories: a header of named parameters, then groups of samples, channel after channel in
each.

The header is of 512-byte blocks, each of four parameters: 32 bytes of name, 96 of value, ended by a zero byte (source:
MTS, RPC III file formats, as rpc3-file lays it out). One sampling period holds for all channels. Samples are whole
numbers of 16 bits times a scale (their resolution), or floating-point numbers of 32 bits, which keep 2^-24 of a value.
A file has whole groups; the parameter SAMPLES says how many samples count, and without it the last ones may be padding,
which is said. The public reader loads a file whole, therefore this one.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from models.core.errors import InputError
from models.core.finding import Finding
from models.measured.channel import FileChannel
from models.measured.formats.opened import (
    OpenFile,
    SampleSpan,
    distinct_names,
    flaw_finding,
    library_errors_as_input,
    start_with_zone,
)

HEADER_BLOCK, KEY_LENGTH, RECORD_LENGTH = 512, 32, 128
"""Lengths (bytes) of a header block, of a parameter's name, and of a parameter."""
MOST_BLOCKS = 1024
"""Most header blocks: four times what the format allows, as there are files that need them."""
SAMPLE_TYPES: dict[str, np.dtype] = {"SHORT_INTEGER": np.dtype("<i2"), "FLOATING_POINT": np.dtype("<f4")}
"""numpy types of the samples, by the format's names."""
LITTLE_ENDIAN = ("BINARY", "BINARY_IEEE_LITTLE_END")
"""Names of the byte orders that can be read."""
FIRST_PARAMETERS = ["FORMAT", "NUM_HEADER_BLOCKS", "NUM_PARAMS"]
"""Names of the first three parameters of a header, in order."""
HISTORY_TYPES = ("DRIVE", "RESPONSE", "MULT_DRIVE", "MULT_RESP", "1", "2", "3", "4")
"""Accepted types of time histories."""


@dataclass(frozen=True)
class SampleLayout:
    """Layout of the samples in an RPC III file: byte of the first group, points in a group, number of channels, data
    type, factor of each channel, period (s)."""

    first_byte: int
    samples_per_group: int
    channel_count: int
    dtype: np.dtype
    scales: np.ndarray
    period: float


@dataclass(frozen=True)
class RpcFile(OpenFile):
    """Reader of an RPC III file, whose samples lie in groups of equal length."""

    layout: SampleLayout

    def pieces(
        self, channel_indices: list[int], sample_spans: Iterable[SampleSpan]
    ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Times and values of each span, from the groups that hold it."""
        layout = self.layout
        size = layout.samples_per_group * layout.channel_count * layout.dtype.itemsize
        with self.path.open("rb") as file:
            for first, count in sample_spans:
                low, high = first // layout.samples_per_group, -(-(first + count) // layout.samples_per_group)
                file.seek(layout.first_byte + low * size)
                data = np.frombuffer(file.read((high - low) * size), layout.dtype).reshape(
                    -1, layout.channel_count, layout.samples_per_group
                )
                samples = data[:, channel_indices].transpose(0, 2, 1).reshape(-1, len(channel_indices))
                with np.errstate(invalid="ignore"):  # a NaN that signals is a NaN all the same
                    values = samples.astype(float) * layout.scales[channel_indices]
                skipped = first - low * layout.samples_per_group
                yield layout.period * np.arange(first, first + count), values[skipped : skipped + count]


def open_rpc(rpc_path: Path) -> RpcFile:
    """``RpcFile`` of a path: header read and compared with the length of the file; raises InputError."""
    with library_errors_as_input(rpc_path):
        parameters = read_parameters(rpc_path)
        layout = _sample_layout(rpc_path, parameters)
        count, said = _usable_samples(rpc_path, parameters, layout)
        said += _findings_on_names(rpc_path, parameters, layout.channel_count)
        numbers = range(1, layout.channel_count + 1)
        names = [parameters.get(f"DESC.CHAN_{i}", "").strip() or f"channel {i}" for i in numbers]
        names, repeated = distinct_names(rpc_path, names)
        steps = (
            np.abs(layout.scales) if layout.dtype == SAMPLE_TYPES["SHORT_INTEGER"] else np.zeros(layout.channel_count)
        )
        channels = tuple(
            FileChannel(
                name,
                parameters.get(f"UNITS.CHAN_{i}", "").strip(),
                _join_long_text(parameters, f"COMMENT.CHAN_{i}"),
                0,
                count,
                layout.period,
                float(step),
            )
            for name, i, step in zip(names, numbers, steps, strict=True)
        )
        start, notes = (
            start_with_zone(rpc_path, parameters["DATE"]) if parameters.get("DATE", "").strip() else (None, [])
        )
        return RpcFile(
            rpc_path, channels, start, _join_long_text(parameters, "COMMENT"), (*said, *repeated, *notes), layout
        )


def read_parameters(rpc_path: Path) -> dict[str, str]:
    """Parameters of an RPC III header by name; the first three have fixed positions and give the number of the
    others."""
    with rpc_path.open("rb") as file:
        head = file.read(HEADER_BLOCK)
        if len(head) < HEADER_BLOCK:
            raise InputError(rpc_path, f"byte {len(head)}", None, "the file ends in its header")
        first = dict(_header_record(head, i) for i in range(3))
        if list(first) != FIRST_PARAMETERS:
            text = f"RPC III begins with {', '.join(FIRST_PARAMETERS[:2])} and {FIRST_PARAMETERS[2]}"
            raise InputError(rpc_path, "header", list(first), text)
        if first["FORMAT"] not in LITTLE_ENDIAN:
            raise InputError(
                rpc_path, "header, FORMAT", first["FORMAT"], f"one of {', '.join(LITTLE_ENDIAN)} can be read"
            )
        blocks = whole_number(rpc_path, first, "NUM_HEADER_BLOCKS", MOST_BLOCKS)
        count = whole_number(rpc_path, first, "NUM_PARAMS", 4 * blocks)
        head += file.read(HEADER_BLOCK * (blocks - 1))
    if len(head) < HEADER_BLOCK * blocks:
        raise InputError(rpc_path, f"byte {len(head)}", None, f"the file ends in its header of {blocks} blocks")
    return dict(_header_record(head, i) for i in range(count))


def _header_record(record_bytes: bytes, parameter_index: int) -> tuple[str, str]:
    """Name and value of header parameter number ``parameter_index``; both are ended by a zero byte."""
    record = record_bytes[parameter_index * RECORD_LENGTH : (parameter_index + 1) * RECORD_LENGTH]
    key, value = (part.split(b"\0")[0] for part in (record[:KEY_LENGTH], record[KEY_LENGTH:]))
    try:
        return key.decode("utf-8").strip(), value.decode("utf-8")
    except UnicodeDecodeError:
        return key.decode("latin-1").strip(), value.decode("latin-1")


def whole_number(rpc_path: Path, parameters: dict[str, str], parameter_name: str, maximum: int) -> int:
    """Value of a header parameter that must be a whole number from 1 to ``maximum``; raises InputError otherwise."""
    text = parameters.get(parameter_name, "").strip()
    if not re.fullmatch(r"\d{1,18}(\.0*)?", text) or not 1 <= int(float(text)) <= maximum:
        raise InputError(rpc_path, f"header, {parameter_name}", text, f"a whole number from 1 to {maximum} is needed")
    return int(text.split(".")[0])


def _real_parameter(rpc_path: Path, parameters: dict[str, str], parameter_name: str, must_be_positive: bool) -> float:
    """Value of a header parameter that must be a finite number; raises InputError otherwise."""
    try:
        value = float(parameters.get(parameter_name, ""))
    except ValueError:
        value = np.nan
    if not np.isfinite(value) or (must_be_positive and value <= 0.0):
        needed = "a finite number is needed" + (" above 0" if must_be_positive else "")
        raise InputError(rpc_path, f"header, {parameter_name}", parameters.get(parameter_name, ""), needed)
    return value


def _sample_layout(rpc_path: Path, parameters: dict[str, str]) -> SampleLayout:
    """``SampleLayout`` from the header parameters."""
    for name, allowed in (
        ("FILE_TYPE", ("TIME_HISTORY",)),
        ("TIME_TYPE", HISTORY_TYPES),
        ("DATA_TYPE", tuple(SAMPLE_TYPES)),
    ):
        type_of_file = parameters.get(name, allowed[0]).strip()
        if type_of_file not in allowed:
            raise InputError(
                rpc_path, f"header, {name}", type_of_file, "only time histories of one of these can be read", allowed
            )
    dtype = SAMPLE_TYPES[parameters.get("DATA_TYPE", "SHORT_INTEGER").strip()]
    width = whole_number(rpc_path, parameters, "CHANNELS", 10**4)
    points = whole_number(rpc_path, parameters, "PTS_PER_GROUP", 10**7)
    if points % whole_number(rpc_path, parameters, "PTS_PER_FRAME", points):
        raise InputError(rpc_path, "header, PTS_PER_GROUP", points, "a group must hold whole frames")
    period = _real_parameter(rpc_path, parameters, "DELTA_T", True)
    scales = np.ones(width)
    if dtype == SAMPLE_TYPES["SHORT_INTEGER"]:
        scales = np.array(
            [_real_parameter(rpc_path, parameters, f"SCALE.CHAN_{i}", False) for i in range(1, width + 1)]
        )
    return SampleLayout(
        HEADER_BLOCK * int(float(parameters["NUM_HEADER_BLOCKS"])), points, width, dtype, scales, period
    )


def _usable_samples(rpc_path: Path, parameters: dict[str, str], layout: SampleLayout) -> tuple[int, list[Finding]]:
    """Number of usable samples, and findings on missing or surplus ones."""
    frame = whole_number(rpc_path, parameters, "PTS_PER_FRAME", layout.samples_per_group)
    announced = frame * whole_number(rpc_path, parameters, "FRAMES", 10**12)
    size = layout.samples_per_group * layout.channel_count * layout.dtype.itemsize
    data = rpc_path.stat().st_size - layout.first_byte
    present = layout.samples_per_group * (data // size)
    texts = list[str]()
    if "SAMPLES" in parameters:
        announced = whole_number(rpc_path, parameters, "SAMPLES", announced)
    else:
        texts.append(
            f"the header does not say how many of the {announced} samples are measured: up to "
            f"{layout.samples_per_group - 1} at "
            "the end may be padding of the last group"
        )
    count, extra = min(announced, present), data - size * -(-announced // layout.samples_per_group)
    if count == 0:
        raise InputError(
            rpc_path, f"byte {layout.first_byte}", None, "the file ends before its first group of samples does"
        )
    if count < announced:
        texts.append(
            f"the header announces {announced} samples, but {count} are there in whole groups: the file is cut off"
        )
    if extra > 0:
        texts.append(f"{extra} bytes follow the samples that the header announces, unread")
    return count, [flaw_finding(rpc_path, "doubt", text) for text in texts]


def _findings_on_names(rpc_path: Path, parameters: dict[str, str], channel_count: int) -> list[Finding]:
    """Findings on channels without a name; raises InputError for a name with a number above that of the channels."""
    numbers = {int(matched[1]) for key in parameters if (matched := re.fullmatch(r"DESC\.CHAN_(\d{1,9})", key))}
    if numbers and max(numbers) > channel_count:
        raise InputError(rpc_path, "header, CHANNELS", channel_count, f"a channel {max(numbers)} is described as well")
    unnamed = [str(i) for i in range(1, channel_count + 1) if i not in numbers]
    return [flaw_finding(rpc_path, "doubt", f"the header names no channel {', '.join(unnamed)}")] if unnamed else []


def _join_long_text(parameters: dict[str, str], parameter_name: str) -> str:
    """Text that is spread over several header parameters, NAME_1, NAME_2, ... with line ends written as ``\\n``."""
    parts: list[str] = []
    while (key := f"{parameter_name}_{len(parts) + 1}") in parameters:
        parts.append(parameters[key])
    return re.sub(r"\\(.)", lambda matched: "\n" if matched[1] == "n" else matched[1], "".join(parts))
