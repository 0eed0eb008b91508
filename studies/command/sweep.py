"""A scene at many values of one key: every point a run of its own, kept as soon as it is finished, and drawn.

``twinrig run SCENE --sweep vehicle.override.k3=8e4:1.2e5:9`` leaves a folder ``runs/0003`` per point, as the run of
that scene alone would, and ``sweep.csv``, ``sweep.json`` and figures of every number that its study gives. A sweep is
an ensemble whose path i is point i: the records of finished points lie in ``points``, and ``--resume`` goes on there.
"""

import csv
import io
import json
import os
import re
import shutil
import tomllib
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from models.core.errors import InputError, RunFailed
from models.core.scene_file import changed
from models.core.whole_files import write_whole
from models.drawing.figures import COLOURS, LABELS, plt, save
from models.ensemble.runner import Progress as Done
from models.ensemble.runner import run_paths
from models.ensemble.store import Arrays, code, locked, named_files
from models.ensemble.workers import processes
from studies.command.asked import STUDIES, engines_of, load_scene, ready, scene_path
from studies.command.summary_numbers import numbers

RECORDS, RUNS = "points", "runs"
"""Folders of the records of finished points, and of what each of them left."""
MOST = 10_000
"""Points of a sweep."""
WORKERS = 2
"""Processes, if there are so many cores; the results do not depend on it."""

ACROSS, DOWN, PAGES = 3, 4, 4
"""Panels of a page, and the most pages; all numbers are in ``sweep.csv``."""
DECADES = 30.0
"""Ratio of the largest to the least value from which on an axis is logarithmic."""

Record = dict[str, Any]
Columns = dict[str, list[Any]]
"""Numbers of all points by their names, None where there is none."""
Failures = list[dict[str, str]]
"""What failed at each point, by engine."""


@dataclass(frozen=True)
class Points:
    """Job (see ``models.ensemble.runner``): point i is the scene with the i-th value of the key."""

    scene: str
    changes: tuple[str, ...]
    key: str
    values: tuple[Any, ...]
    engine: str | None
    folder: Path

    def __call__(self, paths: range) -> Arrays:
        """``record`` (n,): the record of each point as JSON."""
        return _array(map(self.record, paths))

    def ready(self, i: int) -> tuple[Any, tuple[str, ...], Any]:
        """Scene, engines and study of a point; InputError if it cannot be run."""
        scene = load_scene(self.scene, [*self.changes, f"{self.key}={_written(self.values[i])}"])
        engine = self.engine or getattr(getattr(scene, "run", None), "engine", None)
        engines = engines_of(engine, scene.system)
        return scene, engines, ready(scene, engines)

    def check(self) -> None:
        """Raise the InputError of the first point if every point is refused: then it is not one value that is wrong."""
        first: InputError | None = None
        for i in range(len(self.values)):
            try:
                self.ready(i)
                return
            except InputError as error:
                first = first or error
        if first:
            raise first

    def record(self, i: int) -> Record:
        """Numbers of one point by their names, and what failed, by engine where the study told it."""
        try:
            scene, engines, study = self.ready(i)
            with whole_folder(self.folder / RUNS / f"{i:04d}") as own:
                summary = study.run(scene, engines, own, lambda text, part: None)
        except (InputError, RunFailed) as error:
            return _failed(error)
        return {"numbers": numbers(summary), "failed": summary.get("failed", {})}

    def facts(self) -> dict[str, Any]:
        """Everything that the points depend on: the scene as written, the files that it names, the code."""
        path = scene_path(self.scene)
        table = changed(path, self.changes)
        return {
            "sweep": self.key,
            "values": list(self.values),
            "engine": self.engine,
            "scene": table,
            "files": named_files([table, self.values, self.engine], path.parent),
            "code of studies": code(STUDIES),
        }


def _array(records: Iterable[Record]) -> Arrays:
    return {"record": np.array(list(map(json.dumps, records)))}


def _failed(reason: object) -> Record:
    return {"numbers": {}, "failed": {"": str(reason)}}


@contextmanager
def whole_folder(folder: Path) -> Iterator[Path]:
    """A folder to write into that takes its name when all of it is there, in place of what may lie there."""
    part = folder.with_name(f".{folder.name}.{os.getpid()}.part")
    part.mkdir(parents=True)
    try:
        yield part
        shutil.rmtree(folder, ignore_errors=True)
        os.replace(part, folder)
    finally:
        shutil.rmtree(part, ignore_errors=True)


_RANGE = re.compile(r"([^:,]+):([^:,]+):([^:,]+)")


def asked(text: str) -> tuple[str, tuple[Any, ...]]:
    """Key and values of KEY=FROM:TO:N, evenly spaced, or of KEY=a,b,c; raises InputError."""
    key, equals, rest = (part.strip() for part in text.partition("="))
    if not equals or not key or not rest:
        raise InputError("--sweep", "", text, "must read KEY=FROM:TO:N or KEY=a,b,c, for example run.step=1e-4,2e-4")
    found = _RANGE.fullmatch(rest)
    values = _spaced(text, *found.groups()) if found else _listed(rest)
    for value in values:
        if not _writable(value):
            allowed = "must be a finite number, a text, true, false or a list of these"
            raise InputError("--sweep", key, str(value), allowed)
    if not 2 <= len(values) <= MOST:
        raise InputError("--sweep", key, rest, f"gives {len(values)} value(s): 2 to {MOST:,} make a sweep")
    if len(set(map(_written, values))) < len(values):
        raise InputError("--sweep", key, rest, "gives a value twice")
    return key, values


def points(text: str, scene: str, changes: Sequence[str], engine: str | None) -> Points:
    """The job of a sweep that was asked for, its folder not yet known; InputError where no point of it can be run."""
    key, values = asked(text)
    job = Points(scene, tuple(changes), key, values, engine, Path())
    job.check()
    return job


def _spaced(text: str, first: str, last: str, count: str) -> tuple[Any, ...]:
    """Evenly spaced values; whole numbers where both ends and the spacing are."""
    try:
        ends, n = (float(first), float(last)), int(count)
    except ValueError:
        raise InputError("--sweep", "", text, "FROM and TO must be numbers and N a whole number of points") from None
    if not np.isfinite(ends).all() or not 2 <= n <= MOST:
        raise InputError("--sweep", "", text, f"FROM and TO must be finite, N from 2 to {MOST:,}")
    values = np.linspace(*ends, n).tolist()
    whole = all(re.fullmatch(r"\s*[+-]?\d+\s*", end) for end in (first, last)) and all(v == int(v) for v in values)
    return tuple(int(value) for value in values) if whole else tuple(values)


def _listed(rest: str) -> tuple[Any, ...]:
    """Values as a scene file would hold them, or texts without quotes."""
    try:
        return tuple(tomllib.loads(f"x = [{rest}]")["x"])
    except ValueError:
        return tuple(part.strip() for part in rest.split(","))


def _written(value: Any) -> str:
    """The value as a scene file would hold it."""
    return json.dumps(value, ensure_ascii=False, default=str)


def _writable(value: Any) -> bool:
    """Whether a scene file that holds what is written holds this value."""
    try:
        return bool(tomllib.loads(f"x = {_written(value)}")["x"] == value)
    except ValueError:
        return False


def run(job: Points, progress: Callable[[str, float], None]) -> dict[str, Any]:
    """All points that are not finished yet, then table and figures."""
    with locked(job.folder):
        for part in (job.folder / RUNS).glob(".*.part"):
            shutil.rmtree(part, ignore_errors=True)  # of a process that was killed while it wrote
        found = _records(job, progress)
        quantities = list(dict.fromkeys(name for record in found for name in record["numbers"]))
        columns = {name: [record["numbers"].get(name) for record in found] for name in quantities}
        failures = [record["failed"] for record in found]
        _save(job, columns, failures)
        pages = draw(job, columns, failures)
    reasons = {
        f"{job.key}={value}{f', {who}' if who else ''}": reason
        for value, failed in zip(job.values, failures, strict=True)
        for who, reason in failed.items()
    }
    return {
        "scene": f"{scene_path(job.scene).stem} over {job.key}, {len(job.values)} points",
        "failed": reasons,
        "folder": str(job.folder),
        "values": list(job.values),
        "numbers": columns,
        "table": _table(columns, pages),
    }


def _records(job: Points, progress: Callable[[str, float], None]) -> list[Record]:
    """Records of all points; InputError if none of them has a number although none failed."""

    def tell(done: Done) -> None:
        progress(f"{done.done} of {done.paths} points", done.done / done.paths)

    def lost(points: range, reason: str) -> Arrays:
        return _array(_failed(reason) for _ in points)

    with processes(min(WORKERS, os.cpu_count() or 1, len(job.values))) as pool:
        found = run_paths(job, len(job.values), job.folder / RECORDS, pool, 1, tell, lost)["record"]
    records = [json.loads(str(one)) for one in found]
    if not any(record["numbers"] or record["failed"] for record in records):
        raise InputError("--sweep", job.key, None, f"the study of {job.scene} gives no numbers to draw over it")
    return records


def _save(job: Points, columns: Columns, failures: Failures) -> None:
    """``sweep.csv`` and ``sweep.json``: the same bytes from the same points."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([job.key, *columns, "failed"])
    for i, value in enumerate(job.values):
        told = "; ".join(f"{who}: {reason}" if who else reason for who, reason in failures[i].items())
        writer.writerow([value, *(column[i] for column in columns.values()), told])
    write_whole(job.folder / "sweep.csv", text.getvalue().encode())
    content = {"key": job.key, "values": list(job.values), "numbers": columns, "failed": failures}
    write_whole(job.folder / "sweep.json", json.dumps(content, indent=1).encode())


def _table(columns: Columns, pages: list[str]) -> list[str]:
    """The first quantities that change, from their least to their largest value."""
    moving = {name: _there(column) for name, column in columns.items() if _moves(column)}
    lines = [
        f"    {name:<58} {own[0]:>12.5g} at first {own[-1]:>12.5g} at last {min(own):>12.5g} to {max(own):.5g}"
        for name, own in list(moving.items())[:12]
    ]
    rest = f", {len(moving) - 12} more of them" if len(moving) > 12 else ""
    return [*lines, f"  {len(moving)} of {len(columns)} numbers change{rest}: sweep.csv, {', '.join(pages)}"]


def draw(job: Points, columns: Columns, failures: Failures) -> list[str]:
    """Write ``sweep.png``, ``sweep-2.png``, ... and return their names."""
    panels = _panels(columns)
    size, names = ACROSS * DOWN, list[str]()
    shown = list(panels.items())[: size * PAGES] or [("no number changes", {})]
    for first in range(0, len(shown), size):
        name = f"sweep-{first // size + 1}.png" if first else "sweep.png"
        _page(job, shown[first : first + size], failures, name, f"the {len(panels)} quantities that change")
        names.append(name)
    return names


def _panels(columns: Columns) -> dict[str, dict[str, list[Any]]]:
    """Quantities that change -> curve of each implementation, "" where there is but one."""
    panels: dict[str, dict[str, list[Any]]] = {}
    for name, column in columns.items():
        first, _, rest = name.partition(", ")
        engine, what = (first, rest) if rest and first in LABELS else ("", name)
        panels.setdefault(what, {})[engine] = column
    return {what: own for what, own in panels.items() if any(_moves(column) for column in own.values())}


def _there(column: list[Any]) -> list[Any]:
    return [value for value in column if value is not None]


def _moves(column: list[Any]) -> bool:
    return len(set(_there(column))) > 1


def _page(
    job: Points, panels: list[tuple[str, dict[str, list[Any]]]], failures: Failures, name: str, note: str
) -> None:
    down = -(-len(panels) // ACROSS)
    figure, axes = plt.subplots(down, min(ACROSS, len(panels)), figsize=(12, 2.6 * down + 0.9), squeeze=False)
    at, ticks = _places(job.values)
    for axis, (what, curves) in zip(axes.flat, panels, strict=False):
        _panel(axis, at, what, curves, failures, "o" if ticks else "o-")
        if ticks:
            axis.set_xticks(at, ticks)
        elif _spread(at):
            axis.set_xscale("log")
        axis.set_xlabel(job.key)
    for axis in axes.flat[len(panels) :]:
        axis.set_visible(False)
    handles: dict[str, Any] = {}
    for axis in axes.flat:
        found, labels = axis.get_legend_handles_labels()
        handles |= dict(zip(labels, found, strict=True))
    figure.legend(handles.values(), handles.keys(), loc="outside upper right", ncols=max(1, len(handles)))
    figure.suptitle(f"{job.scene.rpartition('/')[2]} over {job.key}: {note}", x=0.01, ha="left", fontweight="bold")
    save(figure, job.folder / name)


def _places(values: tuple[Any, ...]) -> tuple[np.ndarray, list[str]]:
    """Places on the axis and, for values that are no numbers, what is written there."""
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        return np.array(values, float), []
    return np.arange(float(len(values))), [str(value)[:18] for value in values]


def _panel(axis: Any, at: np.ndarray, what: str, curves: dict[str, list[Any]], failures: Failures, style: str) -> None:
    order = np.argsort(at)
    for i, (engine, column) in enumerate(curves.items()):
        axis.plot(
            at[order],
            np.array(column, float)[order],
            style,
            color=COLOURS.get(engine, "#0072b2"),
            markersize=3.5,
            linewidth=2.2 - 0.6 * min(i, 2),
            label=LABELS[engine] or None,
        )
    if all(_spread(np.array(_there(column), float)) for column in curves.values()):
        axis.set_yscale("log")
    else:
        axis.ticklabel_format(axis="y", useOffset=False)
    lost = [i for i, failed in enumerate(failures) if failed and any(column[i] is None for column in curves.values())]
    if lost:
        axis.plot(
            at[lost],
            np.full(len(lost), 0.04),
            "x",
            transform=axis.get_xaxis_transform(),
            color="#cc0000",
            markersize=8,
            markeredgewidth=2,
            clip_on=False,
            label="failed",
        )
    axis.set_title(_title(what), fontsize=9)


def _title(what: str) -> str:
    """The quantity on at most two lines, its unit last."""
    text, unit = re.fullmatch(r"(.*?)( \[[^\[\]]*\])?", what, re.DOTALL).groups()  # type: ignore[union-attr]
    if len(what) <= 46:
        return what
    cut = text.rfind(", ", 0, 46)
    cut = cut + 1 if cut > 0 else 46
    return f"{text[:cut]}\n{text[cut : cut + 46].strip()}{unit or ''}"


def _spread(values: np.ndarray) -> bool:
    return bool(len(values) and (values > 0).all() and values.max() > DECADES * values.min())
