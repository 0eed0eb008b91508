"""Results of runs: labelled arrays with units, counts and provenance, saved as netCDF files."""

import json
import math
import os
import platform
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from models.core.errors import InputError
from models.core.whole_files import write_whole

if TYPE_CHECKING:
    import xarray as xr

RECORDED_PACKAGES = ("exudyn", "mujoco", "numpy", "scipy", "numba")
"""Packages whose versions every result records."""
_version = cache(version)
"""Version of an installed package, cached since the look-up takes longer than a short run."""


class Channel(NamedTuple):
    """An array of a result with the names of its axes (one name, or one per axis), its unit and its meaning."""

    axes: str | tuple[str, ...]
    values: Any
    unit: str = ""
    meaning: str = ""

    def labelled(self) -> tuple[Any, ...]:
        """Dimensions, values and attributes of the channel, in the form that xarray expects."""
        return self.axes, self.values, {"units": self.unit, "long_name": self.meaning}


@dataclass(frozen=True)
class Result:
    """Result of one run: ``data`` is an xarray Dataset of channels with their axes, units and meanings.

    Its attributes hold, as text (JSON) or numbers, title, file, system and table of the scene, engine, status, doubts,
    counts, error, assumptions and provenance, and ``seconds`` until it is saved. ``detail`` is what the system's own
    computations go on with, in the system's own types; it is not saved.
    """

    data: "xr.Dataset"
    detail: Any = field(default=None, repr=False)

    def __getitem__(self, channel_name: str) -> np.ndarray:
        """Values of a channel, by its name, as an array."""
        return self.data[channel_name].values

    @property
    def times(self) -> np.ndarray:
        """Times (n,) in s."""
        return self.data["time"].values

    @property
    def states(self) -> np.ndarray:
        """States (n, 2 k): the k coordinates that the run integrated, then their rates."""
        names = json.loads(self.data.attrs["integrated"])
        return np.column_stack([self[name] for name in (*names, *(f"{name}_rate" for name in names))])

    def counts(self) -> dict[str, int]:
        """Counts of steps, force calls and the like of the run, by name."""
        return json.loads(self.data.attrs["counts"])

    def every(self, row_spacing: float) -> "Result":
        """A copy of the result with rows ``row_spacing`` (s) apart; all rows if they are already at least that far
        apart."""
        step = max(1, round(row_spacing / float(self.times[1] - self.times[0])))
        return replace(self, data=self.data.isel(time=slice(None, None, step)))

    @property
    def seconds(self) -> float:
        """Computing time of the run (s); a result that was read from a file does not have it."""
        return float(self.data.attrs["seconds"])

    def save(self, output_path: Path | str) -> None:
        """Write the result as a netCDF file without the computing time, so that equal runs give identical bytes.

        It is written whole or not at all; numbers have checksums, so that whoever reads a damaged file is told.
        """
        saved_attributes = {name: value for name, value in self.data.attrs.items() if name != "seconds"}
        data = self.data.drop_attrs(deep=False).assign_attrs(saved_attributes)
        checked = {
            name: {"fletcher32": True}
            for name, variable in data.variables.items()
            if variable.size and variable.ndim and variable.dtype.kind in "fiu"
        }
        write_whole(
            Path(output_path), data.to_netcdf(engine="h5netcdf", encoding=checked)
        )  # HDF5 itself crashes on a full disk

    def save_table(self, output_path: Path | str, *channel_names: str) -> None:
        """Write channels that share one axis as columns of a CSV file; all channels if none is named."""
        from models.core.tables import write_table

        names = channel_names or [str(name) for name in (*self.data.coords, *self.data.data_vars)]
        write_table(Path(output_path), {name: (self.data[name].attrs.get("units", "-"), self[name]) for name in names})


def result(
    scene: Any,
    channels: Mapping[str, Channel],
    axis_channels: Mapping[str, Channel],
    *,
    counts: Mapping[str, int] | None = None,
    seconds: float = 0.0,
    doubts: Sequence[str] = (),
    detail: Any = None,
    **attributes: Any,
) -> Result:
    """A ``Result`` from the channels of a scene's run, with counts, doubts and provenance.

    axis_channels : coordinates by their names; counts : of steps, calls and the like, which repeat; seconds : of the
    march; doubts : sentences on what contradicts the scene; attributes : the ``engine`` and more, numbers or text."""
    import xarray as xr

    data = xr.Dataset(
        {name: channel.labelled() for name, channel in channels.items()},
        coords={name: axis.labelled() for name, axis in axis_channels.items()},
    )
    data.attrs = {
        "title": scene.title,
        "scene": scene.file,
        "system": scene.system,
        "engine": "",
        **attributes,
        "status": "complete, in doubt" if doubts else "complete",
        "doubts": json.dumps(list(doubts)),
        "counts": json.dumps(dict(counts or {})),
        "error": "{}",
        "assumptions": "{}",
        "seconds": seconds,
        "scene_table": json.dumps(scene.table()),
        "provenance": json.dumps(provenance()),
    }
    return Result(data, detail)


def join_results(results: Mapping[str, Result], axis_name: str) -> Result:
    """Results with the same channels joined into one, along a new first axis labelled with the names in the mapping.

    The attributes are those of the first; counts, seconds, errors and assumptions stand by name.
    """
    import xarray as xr

    parts = [result.data for result in results.values()]
    data = xr.concat(parts, xr.Variable(axis_name, list(results)), combine_attrs="override")
    data.attrs["engine"] = ", ".join(dataset.attrs["engine"] for dataset in parts)
    data.attrs["counts"] = json.dumps({name: result.counts() for name, result in results.items()})
    for attribute in ("error", "assumptions"):
        data.attrs[attribute] = json.dumps(
            {name: json.loads(result.data.attrs[attribute]) for name, result in results.items()}
        )
    data.attrs["seconds"] = sum(result.seconds for result in results.values())
    return Result(data)


def result_from_table(scene: Any, table_rows: Sequence[Mapping[str, Any]], axis_name: str, **attributes: Any) -> Result:
    """A table (rows of dicts) as a ``Result``: one channel per column along ``axis_name``. Columns with computing times
    are left out, since these never repeat.

    Values are numbers, text, or None for no number; a name's unit is what it has in brackets, as "heave [m]".
    """
    columns = {name: [math.nan if row[name] is None else row[name] for row in table_rows] for name in table_rows[0]}
    columns.pop("seconds", None)
    units = {name: name.partition("[")[2].rstrip("]") for name in columns}
    return result(
        scene, {name: Channel(axis_name, values, units[name]) for name, values in columns.items()}, {}, **attributes
    )


def load_result(result_path: Path) -> Result:
    """Read a saved result from a netCDF file; raises InputError if the file holds none."""
    import xarray as xr

    if not result_path.is_file():
        refusal = "is a folder: name one file of it" if result_path.is_dir() else "no such file"
        raise InputError(result_path, "", None, f"{refusal} (a saved result ends in .nc)")
    try:
        with xr.open_dataset(result_path, engine="h5netcdf") as data:
            return Result(data.load())
    except (OSError, ValueError, KeyError, RuntimeError) as error:  # the last: what HDF5 finds in its own headers
        reason = str(error).splitlines()[0]
        raise InputError(result_path, "", None, f"not a saved result, or a damaged one: {reason}") from None


def provenance(command_line: str = "") -> dict[str, Any]:
    """Package versions, commit, machine and command, from which a result can be reproduced."""
    return {
        "twinrig": _version("twinrig"),
        "commit": _commit_of_checkout(),
        "versions": {name: _version(name) for name in RECORDED_PACKAGES},
        "python": platform.python_version(),
        "machine": f"{platform.machine()}, {os.cpu_count()} cores, {_processor_name()}",
        "system": f"{platform.system()} {platform.release()}",
        "command": command_line,
    }


@cache
def _commit_of_checkout() -> str:
    """Git commit of the running source tree, marked if files were changed since."""
    git_output = partial(
        subprocess.run, cwd=Path(__file__).parent, capture_output=True, text=True, timeout=10, check=True
    )
    try:
        commit, changes = (
            git_output(["git", *words]).stdout.strip()
            for words in (("rev-parse", "--short=12", "HEAD"), ("status", "-s"))
        )
    except (OSError, subprocess.CalledProcessError):
        return "not a checkout"
    return f"{commit}, changed since" if changes else commit


@cache
def _processor_name() -> str:
    """Name of the processor's model, or "unknown processor"."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown processor"
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "unknown processor")


def write_dataset(dataset: "xr.Dataset", output_path: Path) -> None:
    """Write an xarray Dataset as a netCDF file, as ``Result.save`` does."""
    Result(dataset).save(output_path)
