"""Check of the links and blocks of an MDF 4 file before asammdf reads it: blocks complete, chains finite, records
present.

A library that follows damaged links may loop, ask for memory that no machine has, or return what is not there. Block
layouts: ASAM MDF 4.1.
"""

import mmap
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from models.core.errors import InputError
from models.core.finding import Finding
from models.measured.formats.opened import flaw_finding

HEAD_BYTES, FIRST_BLOCK_OFFSET = 24, 64
"""Length (bytes) of a block's head, and position of the first block, HD."""
CHAINED_BLOCKS = (
    b"##DG",
    b"##CG",
    b"##CN",
    b"##DL",
    b"##LD",
    b"##EV",
    b"##AT",
    b"##CH",
    b"##FH",
    b"##SR",
    b"##CC",
    b"##HL",
)
"""Kinds of blocks whose first link leads to the next block of the chain, or into its list."""
LARGEST_COMPRESSION = 1100
"""Ratio of unpacked to packed size beyond what deflate can reach."""
VARIABLE_LENGTH_FLAG = 1
"""Flag of a channel group whose records have individual lengths."""


@dataclass(frozen=True)
class MdfBlock:
    """A block of an MDF file: kind, length, links, and up to a hundred bytes after the links."""

    kind: bytes
    length: int
    links: tuple[int, ...]
    data: bytes


def check_blocks(mdf_path: Path) -> list[Finding]:
    """Findings on an MDF 4 file with more records than it announces; raises InputError at the byte where its structure
    is inconsistent."""
    size = mdf_path.stat().st_size
    if size < FIRST_BLOCK_OFFSET + HEAD_BYTES:
        raise InputError(mdf_path, f"byte {size}", None, "the file ends in its header")
    with mdf_path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        if data[:8] == b"UnFinMF " or struct.unpack_from("<H", data, 60)[0]:
            text = "the recorder did not finish this file: let its software finalise it, or asammdf save it anew"
            raise InputError(mdf_path, "byte 0", data[:8].decode("latin-1").strip(), text)
        blocks = dict(_linked_blocks(mdf_path, data, size))
        if blocks[FIRST_BLOCK_OFFSET].kind != b"##HD":
            raise InputError(mdf_path, f"byte {FIRST_BLOCK_OFFSET}", None, "the header block ##HD is needed")
    _check_chains(mdf_path, blocks)
    groups = [(place, block) for place, block in blocks.items() if block.kind == b"##DG"]
    return [finding for place, block in groups for finding in _check_records(mdf_path, place, block, blocks)]


def _linked_blocks(mdf_path: Path, file_bytes: mmap.mmap, file_size: int) -> Iterator[tuple[int, MdfBlock]]:
    """Every block that a link points to, by its position in the file."""
    seen, ahead, cut = (
        {FIRST_BLOCK_OFFSET},
        [FIRST_BLOCK_OFFSET],
        f"; the file has {file_size} bytes: it is cut off or damaged",
    )
    while ahead:
        place = ahead.pop()
        if not FIRST_BLOCK_OFFSET <= place <= file_size - HEAD_BYTES or file_bytes[place : place + 2] != b"##":
            raise InputError(mdf_path, f"byte {place}", None, f"a block must begin here{cut}")
        length, count = struct.unpack_from("<QQ", file_bytes, place + 8)
        if place + length > file_size or HEAD_BYTES + 8 * count > length:
            text = f"a block of {length} bytes with {count} links begins here{cut}"
            raise InputError(mdf_path, f"byte {place}", None, text)
        links = struct.unpack_from(f"<{count}Q", file_bytes, place + HEAD_BYTES)
        rest = place + HEAD_BYTES + 8 * count
        yield (
            place,
            MdfBlock(file_bytes[place : place + 4], length, links, file_bytes[rest : min(rest + 100, place + length)]),
        )
        new = {link for link in links if link} - seen
        seen |= new
        ahead += sorted(new)


def _check_chains(mdf_path: Path, blocks_by_position: dict[int, MdfBlock]) -> None:
    """Raise InputError for a chain of links that leads back to one of its own blocks."""
    ended: set[int] = set()
    for place in blocks_by_position:
        chain: dict[int, None] = {}
        while (
            place
            and place not in ended
            and blocks_by_position[place].kind in CHAINED_BLOCKS
            and blocks_by_position[place].links
        ):
            if place in chain:
                raise InputError(mdf_path, f"byte {place}", None, "a chain of blocks leads back to this one")
            chain[place] = None
            place = blocks_by_position[place].links[0]
        ended |= set(chain)


def _check_records(
    mdf_path: Path, link_position: int, data_group: MdfBlock, blocks_by_position: dict[int, MdfBlock]
) -> list[Finding]:
    """Findings on a data group with more bytes than its records need; raises InputError if channel groups announce more
    records than it has bytes for."""
    there = sum(
        _unpacked_length(mdf_path, at, blocks_by_position)
        for at in _data_positions(mdf_path, data_group.links[2], blocks_by_position)
    )
    id_size = data_group.data[0]
    needed, loose, at = 0, False, data_group.links[1]
    while at:
        block = blocks_by_position[at]
        _, cycles, flags = struct.unpack_from("<QQH", block.data)
        record_size = sum(struct.unpack_from("<II", block.data, 24))
        loose |= bool(flags & VARIABLE_LENGTH_FLAG)
        needed += 0 if flags & VARIABLE_LENGTH_FLAG else cycles * (record_size + id_size)
        at = block.links[0]
    if needed > there:
        allowed = f"the records of this data group need {needed} bytes, and {there} are there"
        raise InputError(mdf_path, f"byte {link_position}", None, allowed)
    if needed < there and not loose:
        text = f"the data group at byte {link_position} has {there} bytes of records; {needed} are announced and read"
        return [flaw_finding(mdf_path, "doubt", text)]
    return []


def _data_positions(mdf_path: Path, link_position: int, blocks_by_position: dict[int, MdfBlock]) -> list[int]:
    """Positions of the data blocks that a link leads to, directly or through a list."""
    places, ahead = list[int](), [link_position]
    while ahead:
        at = ahead.pop()
        if len(places) > len(blocks_by_position):
            raise InputError(
                mdf_path, f"byte {link_position}", None, "a list of data blocks names more of them than there are"
            )
        if at and blocks_by_position[at].kind in (b"##DL", b"##HL", b"##LD"):
            ahead += blocks_by_position[at].links
        elif at:
            places.append(at)
    return places


def _unpacked_length(mdf_path: Path, block_position: int, blocks_by_position: dict[int, MdfBlock]) -> int:
    """Number of bytes of records in a data block after unpacking."""
    block = blocks_by_position[block_position]
    if block.kind != b"##DZ":
        return block.length - HEAD_BYTES - 8 * len(block.links)
    plain, packed = struct.unpack_from("<QQ", block.data, 8)
    if plain > LARGEST_COMPRESSION * packed + HEAD_BYTES:
        raise InputError(mdf_path, f"byte {block_position}", plain, f"{packed} packed bytes cannot hold as many")
    return int(plain)
