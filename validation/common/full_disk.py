"""Check that a full disk leaves no damaged files, at moments from before the first byte to after the last byte.

A limit on the size of this process' files simulates the disk: the system reports the same kind of error for a write
beyond the limit as on a full disk.
"""

import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from models.core.result import Result
from models.core.tables import write_table
from models.core.whole_files import DISK_FULL_ERRORS
from models.systems.pitch_plane.run import run as simulate
from validation.common.scenes import road_scene

MOMENTS_TRIED = 20
"""Number of file sizes at which the disk is full."""


@contextmanager
def files_of_at_most(byte_limit: int) -> Iterator[None]:
    """Context in which no file of this process can grow beyond ``byte_limit`` bytes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (byte_limit, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def damaged_moments(work_folder: Path) -> int:
    """Number of moments at which a full disk left a damaged file or caused no error."""
    result = simulate(road_scene(duration=0.05), "reference")
    (work_folder / "whole").mkdir()
    _save_until_full(result, work_folder / "whole")
    complete_sizes = file_sizes(work_folder / "whole")
    shares = np.linspace(0.0, 0.99, MOMENTS_TRIED)
    return sum(_is_damaged(result, work_folder / f"{i}", share, complete_sizes) for i, share in enumerate(shares))


def file_sizes(measured_folder: Path) -> dict[str, int]:
    """File name -> size in bytes, for all files of a folder."""
    return {path.name: path.stat().st_size for path in measured_folder.iterdir()}


def _is_damaged(
    saved_result: Result, output_folder: Path, share_of_size: float, complete_sizes: dict[str, int]
) -> bool:
    output_folder.mkdir()
    try:
        with files_of_at_most(int(share_of_size * max(complete_sizes.values()))):
            _save_until_full(saved_result, output_folder)
    except OSError as error:
        return error.errno not in DISK_FULL_ERRORS or not file_sizes(output_folder).items() <= complete_sizes.items()
    return True


def _save_until_full(saved_result: Result, output_folder: Path) -> None:
    write_table(
        output_folder / "table.csv", {"time": ("s", saved_result.times[::4]), "z3": ("m", saved_result["z3"][::4])}
    )
    saved_result.save(output_folder / "result.nc")
