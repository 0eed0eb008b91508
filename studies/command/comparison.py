"""Comparison of two results of one study: the largest and the rms difference of every quantity, and where it is."""

import csv
from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from models.core.discretisation import error_estimates_of
from models.core.errors import InputError
from models.core.result import Result, load_result
from models.core.told import DOUBT_ATTRIBUTES, Results
from models.core.whole_files import whole_file
from studies.command.differences import QuantityDifference, ResultQuantity

RESULT_SUFFIXES = (".nc", ".csv")
PRINTED_QUANTITY_LIMIT = 20
"""Number of quantities that are printed, those that differ most; ``compare.csv`` has all."""
RUN_KIND_ATTRIBUTES = ("system", "mode")
"""Attributes of a result that must be equal in both results."""
EQUAL_POSITION_TOLERANCE = 1e-9
"""Difference of two grid positions, divided by the largest position, below which they are equal."""


def compare(first_path: Path, second_path: Path) -> tuple[list[QuantityDifference], list[str]]:
    """Differences of all quantities that occur in both results, the largest relative difference first, and notes on
    quantities that occur in only one result.

    Raises InputError for what is no result, and for two results that have nothing to compare.
    """
    pairs, notes = _file_pairs(first_path, second_path)
    differences = list[QuantityDifference]()
    for name, *files in pairs:
        prefix = f"{name}: " if len(pairs) > 1 else ""
        a, b = (dict(_quantities_of_file(file)) for file in files)
        notes += _notes_on_missing(prefix, (files[0], a), (files[1], b))
        differences += [_quantity_difference(prefix + key, a[key], b[key], files[1]) for key in a if key in b]
    return _sorted_by_relative_difference(differences, first_path, second_path), notes


def compare_runs(
    first_run: Result, second_run: Result, run_names: tuple[str, str]
) -> tuple[list[QuantityDifference], list[str]]:
    """Differences of all quantities of two results in memory, and notes on quantities that occur in only one;
    ``run_names`` are the results' names in messages."""
    a, b = (dict(_with_stated_errors(run, channels_of(run.data))) for run in (first_run, second_run))
    differences = [_quantity_difference(key, a[key], b[key], run_names[1]) for key in a if key in b]
    return _sorted_by_relative_difference(differences, *run_names), _notes_on_missing(
        "", (run_names[0], a), (run_names[1], b)
    )


def _sorted_by_relative_difference(
    differences: list[QuantityDifference], first_name: object, second_name: object
) -> list[QuantityDifference]:
    """Differences sorted by their size relative to the quantity, largest first; raises InputError if there are none."""
    if not differences:
        raise InputError(
            second_name, "", None, f"has no quantity in common with {first_name}: compare two results of one study"
        )
    return sorted(differences, key=lambda difference: -difference.share)


def _notes_on_missing(note_prefix: str, *names_of_results: tuple[object, Collection[str]]) -> list[str]:
    """Notes on quantities or files that occur in only one of the two results."""
    return [
        f"{note_prefix}only in {path}: {', '.join(only_here)}"
        for (path, names), (_, names_of_other) in (names_of_results, names_of_results[::-1])
        if (only_here := [name for name in names if name not in names_of_other])
    ]


def _file_pairs(first_path: Path, second_path: Path) -> tuple[list[tuple[str, Path, Path]], list[str]]:
    """Pairs of files to compare, with their name: the two given files, or the files of equal name in both folders; and
    notes on files that occur in only one folder."""
    for path in (first_path, second_path):
        if not path.exists():
            raise InputError(path, "", None, "no such file or folder")
        if path.is_file() and path.suffix not in RESULT_SUFFIXES:
            raise InputError(path, "", None, "is no result: name a folder, a netCDF file (.nc) or a table (.csv)")
    kinds = ["file" if path.is_file() else "folder" for path in (first_path, second_path)]
    if kinds[0] != kinds[1]:
        raise InputError(second_path, "", None, f"is a {kinds[1]} and {first_path} a {kinds[0]}: name two of a kind")
    if first_path.is_file():
        return [("", first_path, second_path)], []
    first, second = _result_files(first_path), _result_files(second_path)
    for folder, files in ((first_path, first), (second_path, second)):
        if not files:
            raise InputError(folder, "", None, "holds no results (.nc or .csv): name the folder of a run")
    common = [name for name in first if name in second]
    if not common and len(first) == len(second) == 1:
        return [("", next(iter(first.values())), next(iter(second.values())))], []
    if not common:
        raise InputError(
            second_path, "", None, f"has no results of the same names as {first_path}: compare two results of one study"
        )
    return [(name, first[name], second[name]) for name in common], _notes_on_missing(
        "", (first_path, first), (second_path, second)
    )


def _result_files(results_folder: Path) -> dict[str, Path]:
    """Result files of a folder by name: netCDF files, except for those whose table is in a CSV file, too; the CSV files
    if there are no such netCDF files."""
    files = [
        path
        for path in sorted(results_folder.rglob("*"))
        if path.suffix in RESULT_SUFFIXES
        and not any(folder_name.startswith(".") for folder_name in path.relative_to(results_folder).parts)
    ]
    netcdf = [path for path in files if path.suffix == ".nc" and not _holds_same_table(path)]
    chosen = netcdf or [path for path in files if path.suffix == ".csv"]
    return {path.relative_to(results_folder).as_posix(): path for path in chosen}


def _holds_same_table(result_path: Path) -> bool:
    """Whether the CSV file of the same name as a netCDF file holds the same table: all channels have one common
    axis."""
    return result_path.with_suffix(".csv").exists() and len(load_result(result_path).data.sizes) < 2


def results_of(first_path: Path, second_path: Path) -> dict[str, Result]:
    """Results of both files or folders by file, whose stated errors and assumptions are known; for a CSV table beside a
    netCDF file, the netCDF file is read."""
    files = [file for _, *pair in _file_pairs(first_path, second_path)[0] for file in pair]
    results = ((str(file), _result_of_file(file)) for file in files)
    return {
        name: run
        for name, run in results
        if run is not None and all(attribute in run.data.attrs for attribute in DOUBT_ATTRIBUTES)
    }


def _result_of_file(result_path: Path) -> Result | None:
    """The saved result of a netCDF file, or of the netCDF file beside a CSV table; None if there is none."""
    netcdf_path = result_path.with_suffix(".nc")
    return load_result(netcdf_path) if netcdf_path.is_file() else None


def _quantities_of_file(result_path: Path) -> Iterator[tuple[str, ResultQuantity]]:
    """Yield name and values of each quantity of a file, with the error that its result states."""
    yield from _with_stated_errors(
        _result_of_file(result_path),
        channels_of(load_result(result_path).data)
        if result_path.suffix == ".nc"
        else _quantities_of_table(result_path),
    )


def _with_stated_errors(
    saved_run: Result | None, quantities: Iterable[tuple[str, ResultQuantity]]
) -> Iterator[tuple[str, ResultQuantity]]:
    """Yield name and values of each quantity of a result, with the error that the result states for the channel, if
    any."""
    errors = {} if saved_run is None else error_estimates_of(saved_run)
    for name, quantity in quantities:
        stated = errors.get(name.partition(", ")[0])
        yield name, quantity if stated is None else replace(quantity, stated_error=stated.error)


def channels_of(dataset: Any) -> Iterator[tuple[str, ResultQuantity]]:
    """Yield name and values of the numeric channels of a dataset over time or another axis. A channel with further axes
    gives one quantity for each entry of these."""
    kinds = ", ".join(str(dataset.attrs[kind]) for kind in RUN_KIND_ATTRIBUTES if kind in dataset.attrs)
    for name, channel in dataset.data_vars.items():
        if channel.dtype.kind not in "fiu" or channel.size == 0:
            continue
        dimension = _compared_dimension(channel)
        axis_name, grid = _grid_of_dimension(channel, dimension)
        other_dims = [dim for dim in channel.dims if dim != dimension]
        for index in np.ndindex(*(channel.sizes[dim] for dim in other_dims)):
            index_by_dim = dict(zip(other_dims, index, strict=True))
            labels = (
                str(channel[dim].values[i]) if dim in channel.coords else f"{dim} {i}"
                for dim, i in index_by_dim.items()
            )
            values = channel.isel(index_by_dim).values.astype(float).reshape(-1)
            quantity = ResultQuantity(str(channel.attrs.get("units", "")), values, axis_name, grid, kinds)
            yield ", ".join((str(name), *labels)), quantity


def _compared_dimension(channel: Any) -> Any:
    """Dimension along which a channel is compared: time, or else the longest dimension with numbers, or nothing, as
    coordinates."""
    numbered = [dim for dim in channel.dims if dim not in channel.coords or channel[dim].dtype.kind in "fiu"]
    return "time" if "time" in numbered else max(numbered, key=channel.sizes.get, default=None)


def _grid_of_dimension(channel: Any, dimension: Any) -> tuple[str, np.ndarray]:
    """Name and values of the coordinate along a dimension of a channel; row numbers if it has no coordinate."""
    if dimension not in channel.coords:
        return "entry", np.arange(channel.sizes.get(dimension, 1), dtype=float)
    unit = channel[dimension].attrs.get("units", "s" if dimension == "time" else "")
    return f"{dimension} [{unit}]" if unit else str(dimension), channel[dimension].values.astype(float)


def _quantities_of_table(table_path: Path) -> Iterator[tuple[str, ResultQuantity]]:
    """Yield name and values of each numeric column of a CSV file over its first column; an empty cell is NaN."""
    try:
        with table_path.open(newline="", encoding="utf-8-sig") as file:
            heads, *rows = [row for row in csv.reader(file) if row and not row[0].startswith("#")]
        names = [head.strip() for head in heads]
        for name, count in Counter(names).items():
            if count > 1:
                raise ValueError(f"two columns are called {name!r}")
        columns = dict(zip(names, zip(*rows, strict=True), strict=True)) if rows else {}
    except (OSError, ValueError, csv.Error) as error:
        raise InputError(table_path, "", None, f"is not a table of results: {error}") from None
    if not columns:
        raise InputError(table_path, "", None, "is not a table of results: it has no rows")
    numeric = {head: values for head, cells in columns.items() if (values := _numeric_cells(cells)) is not None}
    axis_name = names[0]
    labels = () if axis_name in numeric else columns[axis_name]
    grid = numeric.pop(axis_name, np.arange(len(rows), dtype=float))
    for head, values in numeric.items():
        name, _, unit = head.partition(" [")
        yield name, ResultQuantity(unit.rstrip("]"), values, axis_name, grid, row_labels=labels)


def _numeric_cells(column_cells: tuple[str, ...]) -> np.ndarray | None:
    """Numbers of a column's cells, NaN for empty ones; None if a cell is no number or all are empty."""
    try:
        values = np.array([float(cell) if cell.strip() else np.nan for cell in column_cells])
    except ValueError:
        return None
    return values if np.isfinite(values).any() else None


def _quantity_difference(
    quantity_name: str, first_quantity: ResultQuantity, second_quantity: ResultQuantity, file_name: object
) -> QuantityDifference:
    """Difference of a quantity in two results; raises InputError if kinds, units or rows do not match."""
    if first_quantity.run_kind != second_quantity.run_kind:
        raise InputError(
            file_name,
            quantity_name,
            second_quantity.run_kind,
            f"the other run is of {first_quantity.run_kind}: compare two runs of one kind",
        )
    if (first_quantity.unit, first_quantity.grid_name) != (second_quantity.unit, second_quantity.grid_name):
        raise InputError(
            file_name,
            quantity_name,
            f"{second_quantity.unit} over {second_quantity.grid_name}",
            f"the other one is in {first_quantity.unit} over {first_quantity.grid_name}",
        )
    for label, other in zip(first_quantity.row_labels, second_quantity.row_labels, strict=False):
        if label != other:
            raise InputError(
                file_name, quantity_name, other, f"has other rows than the first, which has {label!r} there"
            )
    near = EQUAL_POSITION_TOLERANCE * np.abs(first_quantity.grid).max(initial=0.0)
    if first_quantity.grid.shape == second_quantity.grid.shape and np.allclose(
        first_quantity.grid, second_quantity.grid, rtol=0.0, atol=near
    ):
        return QuantityDifference(
            quantity_name,
            first_quantity.unit,
            first_quantity.grid_name,
            first_quantity.grid,
            first_quantity.values,
            second_quantity.values,
            "",
            first_quantity.row_labels,
            first_quantity.stated_error + second_quantity.stated_error,
        )
    if first_quantity.grid_name != "time [s]":
        rows = (
            ""
            if len(first_quantity.grid) == len(second_quantity.grid)
            else f", {len(second_quantity.grid)} instead of {len(first_quantity.grid)}"
        )
        raise InputError(
            file_name,
            quantity_name,
            None,
            f"has rows at other places ({first_quantity.grid_name}) than the first{rows}",
        )
    return _difference_in_time(quantity_name, first_quantity, second_quantity, file_name)


def _difference_in_time(
    quantity_name: str, first_quantity: ResultQuantity, second_quantity: ResultQuantity, file_name: object
) -> QuantityDifference:
    """Difference of a quantity in two runs with rows at different times; the denser run is interpolated at the rows of
    the other by a cubic spline."""
    from scipy.interpolate import CubicSpline

    fine, coarse = (
        (first_quantity, second_quantity)
        if len(first_quantity.grid) > len(second_quantity.grid)
        else (second_quantity, first_quantity)
    )
    unread = "cannot be read at other times: the"
    if not (np.diff(fine.grid) > 0.0).all():
        raise InputError(file_name, quantity_name, None, f"{unread} times of the denser run do not increase")
    if not np.isfinite(fine.values).all():
        raise InputError(file_name, quantity_name, None, f"{unread} denser run holds what is no number")
    is_within = (coarse.grid >= fine.grid[0] - 1e-9) & (coarse.grid <= fine.grid[-1] + 1e-9)
    if not (is_within.sum() > 1 and len(fine.grid) > 3):
        raise InputError(file_name, quantity_name, None, "has no times in common with the first")
    common_times = coarse.grid[is_within]
    pair = CubicSpline(fine.grid, fine.values)(common_times), coarse.values[is_within]
    extent = _common_times_phrase(common_times, first_quantity.grid, second_quantity.grid)
    note = f"on {len(common_times)} common rows, the denser run by a cubic spline{extent}"
    values_of_both = pair if fine is first_quantity else pair[::-1]
    return QuantityDifference(
        quantity_name,
        first_quantity.unit,
        first_quantity.grid_name,
        common_times,
        *values_of_both,
        note,
        stated=first_quantity.stated_error + second_quantity.stated_error,
    )


def _common_times_phrase(common_times: np.ndarray, *times_of_runs: np.ndarray) -> str:
    """Phrase on the compared times (s) if one run begins later or ends earlier than the other; else ""."""
    begin, end = (float(extreme(np.concatenate(times_of_runs))) for extreme in (np.min, np.max))
    spacing = min(float(np.diff(grid).max()) for grid in times_of_runs)
    first, last = common_times[0], common_times[-1]
    if first - begin < spacing and end - last < spacing:
        return ""
    return f"; only from {first:g} to {last:g} s, the part that both runs have of {begin:g} to {end:g} s"


def report(first_path: Path, second_path: Path, output_folder: Path) -> dict[str, Any]:
    """Compare two results; saves ``compare.csv`` and ``compare.png``, and returns the summary."""
    differences, notes = compare(first_path, second_path)
    with whole_file(output_folder / "compare.csv") as partial_path, partial_path.open("w", newline="") as file:
        writer = csv.writer(file)
        heads = ("quantity", "unit", "largest difference", "at", "rms difference", "share of largest value")
        writer.writerow((*heads, "stated error of both"))
        writer.writerows(
            (d.name, d.unit, d.largest, d.where, d.rms, d.share, "" if np.isnan(d.stated) else d.stated)
            for d in differences
        )
    results = results_of(first_path, second_path)
    _figure(first_path, second_path, differences, results, output_folder / "compare.png")
    return {
        "scene": f"{second_path} less {first_path}",
        "folder": str(output_folder),
        "failed": {},
        "names": [difference.name for difference in differences],
        "differences": {
            name: [getattr(difference, name) for difference in differences]
            for name in ("largest", "rms", "at", "share")
        },
        "within the stated error": [difference.name for difference in differences if difference.within],
        "table": comparison_lines(differences, notes),
        "results": results,
    }


def comparison_lines(differences: list[QuantityDifference], notes: list[str]) -> list[str]:
    """Lines for the screen: the quantities with the largest differences, and notes."""
    return [*_quantity_lines(differences), *(f"  {note}" for note in notes)]


def _quantity_lines(differences: list[QuantityDifference]) -> list[str]:
    differ = [difference for difference in differences if difference.largest > 0.0]
    notes = [
        f"  {note}"
        for note in dict.fromkeys(difference.rows_note for difference in differences if difference.rows_note)
    ]
    if not differ:
        return [f"  all {len(differences)} quantities are the same to the last bit", *notes]
    shown = [difference for difference in differences[:PRINTED_QUANTITY_LIMIT] if difference.largest > 0.0]
    equal_count, not_shown = len(differences) - len(differ), len(differ) - len(shown)
    return [
        f"  {'quantity':<44} {'largest':>11} {'rms':>11} {'unit':<9} {'share':>8}  where it is largest",
        *(
            f"  {d.name:<44} {d.largest:>11.4g} {d.rms:>11.4g} {d.unit:<9} {d.share:>8.1e}  {_difference_text(d)}"
            for d in shown
        ),
        *([f"  {not_shown} more that differ less: compare.csv"] if not_shown else []),
        *([f"  the same to the last bit: {equal_count} of {len(differences)}"] if equal_count else []),
        *notes,
    ]


def _difference_text(quantity_difference: QuantityDifference) -> str:
    """Text on where a difference is largest, and on whether it lies within the stated errors."""
    return (
        f"{quantity_difference.where}; rms within the stated error of {quantity_difference.stated:.2g}"
        if quantity_difference.within
        else quantity_difference.where
    )


def _figure(
    first_path: Path,
    second_path: Path,
    differences: list[QuantityDifference],
    shown_results: Results,
    figure_path: Path,
) -> None:
    """Save a figure of both results and, below, their difference, for the three quantities that differ most; of one
    quantity if all are equal."""
    from models.drawing.figures import (
        BLUE,
        COLUMN_WIDTH,
        DARK,
        TITLE_TEXT,
        VERMILION,
        add_heading,
        legend_below,
        save,
        subplots,
        wrapped_text,
    )

    differ = [difference for difference in differences if difference.largest != 0][:3]
    shown = differ or differences[:1]
    share = 0.95 * COLUMN_WIDTH / len(shown) - 0.3
    figure, axes = subplots(2 if differ else 1, len(shown), figsize=(COLUMN_WIDTH, 4.8), sharex="col", squeeze=False)
    for top, difference in zip(axes[0], shown, strict=True):
        top.plot(difference.grid, difference.first_values, color=DARK, linewidth=2.0, label=str(first_path))
        top.plot(difference.grid, difference.second_values, color=VERMILION, linewidth=1.0, label=str(second_path))
        top.set_title(wrapped_text(f"{difference.name} [{difference.unit or '-'}]", share, TITLE_TEXT))
    for error_axis, difference in zip(axes[-1], differ, strict=False):
        error_axis.plot(
            difference.grid,
            np.where(np.isfinite(difference.difference_values), difference.difference_values, np.nan),
            color=BLUE,
        )
        error_axis.plot(
            difference.at, difference.difference_values[difference.row_of_largest], "o", color=BLUE, markersize=5
        )
        error = ", rms within the stated error" if difference.within else ""
        panel_title = f"difference [{difference.unit or '-'}], largest {difference.largest:.3g} at the mark{error}"
        error_axis.set_title(wrapped_text(panel_title, share, TITLE_TEXT))
    for lowest, difference in zip(axes[-1], shown, strict=True):
        lowest.set_xlabel(difference.grid_name)
    legend_below(figure, axes[0, 0], column_count=1)
    add_heading(figure, f"Largest differences of {len(differences)} quantities", shown_results)
    save(figure, figure_path)
