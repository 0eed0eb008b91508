"""Results: labelled channels with units, counts, cost and provenance, saved as netCDF."""

import json
import os
import platform
import subprocess
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from models.core.errors import InputError
from models.core.whole_files import write_whole

if TYPE_CHECKING:
    import xarray as xr

PACKAGES = ("exudyn", "mujoco", "numpy", "scipy", "numba")
_version = cache(version)
"""Version of an installed package; finding it out takes longer than a short run."""


@dataclass(frozen=True)
class Result:
    """One run: ``data`` is an xarray Dataset over ``time`` (s), each channel with its unit and meaning.

    Its attributes hold engine, integrator, step, status, counts, the scene and the provenance, as text (JSON)
    or numbers, and seconds until it is saved.
    """

    data: "xr.Dataset"

    def __getitem__(self, channel: str) -> np.ndarray:
        """Values of a channel, shape (n,)."""
        return self.data[channel].values

    @property
    def times(self) -> np.ndarray:
        """Times (n,) in s."""
        return self.data["time"].values

    @property
    def states(self) -> np.ndarray:
        """States (n, 2 k): the k coordinates that the run integrated, then their rates."""
        names = json.loads(self.data.attrs["coordinates"])
        return np.column_stack([self[name] for name in (*names, *(f"{name}_rate" for name in names))])

    def counts(self) -> dict[str, int]:
        """Steps and force calls of the run."""
        return json.loads(self.data.attrs["counts"])

    def every(self, spacing: float) -> "Result":
        """The same with rows ``spacing`` (s) apart, or all of them where they already are."""
        step = max(1, round(spacing / float(self.times[1] - self.times[0])))
        return Result(self.data.isel(time=slice(None, None, step)))

    def save(self, path: Path) -> None:
        """Write netCDF without the seconds: the same run gives the same bytes."""
        kept = {name: value for name, value in self.data.attrs.items() if name != "seconds"}
        write(self.data.drop_attrs(deep=False).assign_attrs(kept), path)


def write(data: "xr.Dataset", path: Path) -> None:
    """Write netCDF whole or not at all; numbers with checksums, so that whoever reads a damaged file is told."""
    checked = {
        name: {"fletcher32": True}
        for name, own in data.variables.items()
        if own.size and own.ndim and own.dtype.kind in "fiu"
    }
    write_whole(path, data.to_netcdf(engine="h5netcdf", encoding=checked))  # HDF5 itself crashes on a full disk


def load(path: Path) -> Result:
    """Read a saved result; raises InputError if the file is not one."""
    import xarray as xr

    try:
        with xr.open_dataset(path, engine="h5netcdf") as data:
            return Result(data.load())
    except (OSError, ValueError, KeyError, RuntimeError) as error:  # the last: what HDF5 finds in its own headers
        reason = str(error).splitlines()[0]
        raise InputError(path, "", None, f"not a saved result, or a damaged one: {reason}") from None


def provenance(command: str = "") -> dict[str, Any]:
    """Versions, machine and commit: what someone needs to repeat a figure."""
    return {
        "twinrig": _version("twinrig"),
        "commit": _commit(),
        "versions": {name: _version(name) for name in PACKAGES},
        "python": platform.python_version(),
        "machine": f"{platform.machine()}, {os.cpu_count()} cores, {_processor()}",
        "system": f"{platform.system()} {platform.release()}",
        "command": command,
    }


@cache
def _commit() -> str:
    """Commit of the checkout that runs, with a mark if it was changed since."""

    def ask(*arguments: str) -> str:
        here = Path(__file__).parent
        done = subprocess.run(["git", *arguments], cwd=here, capture_output=True, text=True, timeout=10, check=False)
        return done.stdout.strip() if done.returncode == 0 else ""

    try:
        commit = ask("rev-parse", "--short=12", "HEAD")
        return f"{commit}, changed since" if commit and ask("status", "--porcelain") else commit or "not a checkout"
    except OSError:
        return "not a checkout"


@cache
def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown processor"
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "unknown processor")
