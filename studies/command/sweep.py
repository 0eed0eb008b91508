"""Sweep of a scene over the values of one key: a run for every point, saved as soon as it is finished, and figures.

``twinrig run SCENE --sweep vehicle.override.k3=8e4:1.2e5:9`` leaves a folder ``runs/0003`` per point, as the run of
that scene alone would, and ``sweep.csv``, ``sweep.json`` and figures of every number that its study gives. A sweep is
an ensemble whose path i is point i: the records of finished points lie in ``sweep_points``, and ``--resume`` goes on
there.
"""

import csv
import io
import json
import os
import re
import shutil
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import BaseModel

from models.core import told
from models.core.assumptions import broken_assumptions_of
from models.core.discretisation import largest_estimate
from models.core.errors import InputError, RunFailed
from models.core.scene_file import changed_tables
from models.core.whole_files import write_whole
from models.ensemble.runner import Blocks, run_paths
from models.ensemble.runner import EnsembleProgress as Done
from models.ensemble.store import Arrays, checksum_of_sources, exclusive_folder, named_files
from models.ensemble.workers import Crew
from studies.command.asked import STUDIES_FOLDER, checked_study, engines_of, load_scene, scene_path
from studies.command.summary_numbers import Columns, has_several_values, present_numbers, summary_scalars

if TYPE_CHECKING:
    from studies.command.sweep_figure import SweepResults

RECORDS_FOLDER, RUNS_FOLDER = "points", "runs"
"""Names of the folders of the records of finished points, and of the points' results."""
MOST_POINTS = 10_000
"""Largest number of points of a sweep."""

Record = dict[str, Any]


@dataclass(frozen=True)
class SweepJob:
    """Ensemble job (see ``models.ensemble.runner``) of a sweep: point i is the scene with the i-th value of the key.

    error : whether the error of each point is estimated.
    """

    scene: str
    changes: tuple[str, ...]
    key: str
    values: tuple[Any, ...]
    engine: str | None
    folder: Path
    error: bool = True

    def __call__(self, paths: range) -> Arrays:
        """Array "record" (n,): the record of each of the n points as JSON text."""
        return _json_array(map(self.record, paths))

    def prepared_point(self, point_number: int) -> tuple[Any, tuple[str, ...], Any]:
        """Scene, engines and study of a point of the sweep; raises InputError if the point cannot be run."""
        scene = load_scene(self.scene, [*self.changes, f"{self.key}={_value_text(self.values[point_number])}"])
        scene = scene.model_copy(update={"error": scene.error and self.error})
        engine = self.engine or getattr(getattr(scene, "run", None), "engine", None)
        engines = engines_of(engine, scene.system)
        return scene, engines, checked_study(scene, engines)

    def check(self) -> Any:
        """The scene of the first point that can be run; if every point is refused, the InputError of the first is
        raised."""
        first: InputError | None = None
        for i in range(len(self.values)):
            try:
                return self.prepared_point(i)[0]
            except InputError as error:
                first = first or error
        assert first is not None
        raise first

    def record(self, point_number: int) -> Record:
        """Run a point of the sweep; returns its record: its numbers by name, its failures (by engine, if the study
        gives them), and the errors and assumptions that its results state."""
        try:
            scene, engines, study = self.prepared_point(point_number)
            scene = scene.model_copy(update={"workers": 1, "cluster": None})
            with complete_folder(self.folder / RUNS_FOLDER / f"{point_number:04d}") as run_folder:
                summary = study.run(scene, engines, run_folder, lambda text, part: None)
        except (InputError, RunFailed) as error:
            return _failed_record(error)
        attributes = told.attributes_for_json(summary.get("results", {}))
        return {"numbers": summary_scalars(summary), "failed": summary.get("failed", {}), "results": attributes}

    def facts(self) -> dict[str, Any]:
        """Facts on which the results of all points depend: the scene's table, the files that it names, and the code."""
        path = scene_path(self.scene)
        table = changed_tables(path, self.changes)
        return {
            "sweep": self.key,
            "values": list(self.values),
            "engine": self.engine,
            "error": self.error,
            "scene": table,
            "files": named_files([table, self.values, self.engine], path.parent),
            "code of studies": checksum_of_sources(STUDIES_FOLDER),
        }


def _json_array(records: Iterable[Record]) -> Arrays:
    return {"record": np.array(list(map(json.dumps, records)))}


def _failed_record(reason: object) -> Record:
    return {"numbers": {}, "failed": {"": str(reason)}, "results": {}}


@contextmanager
def complete_folder(folder: Path) -> Iterator[Path]:
    """Context that yields a temporary folder to write into. It gets its final name only when it is complete, and then
    replaces an older folder of this name."""
    partial_folder = folder.with_name(f".{folder.name}.{os.getpid()}.part")
    partial_folder.mkdir(parents=True)
    try:
        yield partial_folder
        shutil.rmtree(folder, ignore_errors=True)
        os.replace(partial_folder, folder)
    finally:
        shutil.rmtree(partial_folder, ignore_errors=True)


_RANGE_PATTERN = re.compile(r"([^:,]+):([^:,]+):([^:,]+)")


def parse_range(text: str) -> tuple[str, tuple[Any, ...]]:
    """Key and values of a sweep from the text KEY=FROM:TO:N, with N evenly spaced values, or KEY=a,b,c; raises
    InputError."""
    key, equals, value_text = (text_part.strip() for text_part in text.partition("="))
    if not equals or not key or not value_text:
        raise InputError("--sweep", "", text, "must read KEY=FROM:TO:N or KEY=a,b,c, for example run.step=1e-4,2e-4")
    matched = _RANGE_PATTERN.fullmatch(value_text)
    values = _spaced_values(text, *matched.groups()) if matched else _listed_values(value_text)
    for value in values:
        if not _is_writable(value):
            allowed = "must be a finite number, a text, true, false or a list of these"
            raise InputError("--sweep", key, str(value), allowed)
    if not 2 <= len(values) <= MOST_POINTS:
        raise InputError("--sweep", key, value_text, f"gives {len(values)} value(s): 2 to {MOST_POINTS:,} make a sweep")
    if len(set(map(_value_text, values))) < len(values):
        raise InputError("--sweep", key, value_text, "gives a value twice")
    return key, values


def sweep_points(text: str, scene: str, changes: Sequence[str], engine: str | None, error: bool = True) -> SweepJob:
    """The job of the sweep that ``text`` describes, without its folder; raises InputError if none of its points can be
    run."""
    key, values = parse_range(text)
    job = SweepJob(scene, tuple(changes), key, values, engine, Path(), error)
    job.check()
    return job


def _spaced_values(text: str, first_text: str, last_text: str, count_text: str) -> tuple[Any, ...]:
    """Evenly spaced values of a sweep from the texts of both ends and of their number; integers if all are integers."""
    try:
        ends, n = (float(first_text), float(last_text)), int(count_text)
    except ValueError:
        raise InputError("--sweep", "", text, "FROM and TO must be numbers and N a whole number of points") from None
    if not np.isfinite(ends).all() or not 2 <= n <= MOST_POINTS:
        raise InputError("--sweep", "", text, f"FROM and TO must be finite, N from 2 to {MOST_POINTS:,}")
    values = np.linspace(*ends, n).tolist()
    are_integers = all(re.fullmatch(r"\s*[+-]?\d+\s*", end) for end in (first_text, last_text)) and all(
        v == int(v) for v in values
    )
    return tuple(int(value) for value in values) if are_integers else tuple(values)


def _listed_values(list_text: str) -> tuple[Any, ...]:
    """Values of a sweep from a list in the notation of scene files; words may lack quotes."""
    try:
        return tuple(tomllib.loads(f"x = [{list_text}]")["x"])
    except ValueError:
        return tuple(word.strip() for word in list_text.split(","))


def _value_text(summary_value: Any) -> str:
    """Text of a value in the notation of scene files."""
    return json.dumps(summary_value, ensure_ascii=False, default=str)


def _is_writable(summary_value: Any) -> bool:
    """Whether a scene file can represent a value exactly."""
    try:
        return bool(tomllib.loads(f"x = {_value_text(summary_value)}")["x"] == summary_value)
    except ValueError:
        return False


def run(job: SweepJob, progress: Callable[[str, float], None], crew: Crew) -> dict[str, Any]:
    """Run all unfinished points of a sweep by workers, then save its table and figures; returns the summary."""
    from studies.command.sweep_figure import draw_sweep  # workers, which import this file, draw nothing

    with exclusive_folder(job.folder):
        for partial_folder in (job.folder / RUNS_FOLDER).glob(".*.part"):
            shutil.rmtree(partial_folder, ignore_errors=True)  # of a process that was killed while it wrote
        records = _records_of_points(job, progress, crew)
        swept = _sweep_columns(job, records)
        _save_sweep(job.folder, swept)
        pages = draw_sweep(swept, job.folder)
    reasons = {
        f"{job.key}={value}{f', {who}' if who else ''}": reason
        for value, failed in zip(job.values, swept.failures, strict=True)
        for who, reason in failed.items()
    }
    return {
        "scene": f"{scene_path(job.scene).stem} over {job.key}, {len(job.values)} points",
        "failed": reasons,
        "folder": str(job.folder),
        "values": list(job.values),
        "numbers": swept.columns,
        "table": _table_lines(swept.columns, pages),
        "results": {
            f"{job.key}={value} {name}".rstrip(): run
            for value, results in zip(job.values, swept.results, strict=True)
            for name, run in results.items()
        },
    }


def _sweep_columns(job: SweepJob, records: list[Record]) -> "SweepResults":
    """Results of a sweep from the records of all points: a column per quantity, failures, and the errors and
    assumptions of the results."""
    from studies.command.sweep_figure import SweepResults

    quantities = list(dict.fromkeys(name for record in records for name in record["numbers"]))
    columns = {name: [record["numbers"].get(name) for record in records] for name in quantities}
    failures = [record["failed"] for record in records]
    results: list[told.Results] = [told.results_with_attributes(record["results"]) for record in records]
    return SweepResults(job.scene, job.key, job.values, columns, failures, results, _unit_of_key(job))


def _unit_of_key(job: SweepJob) -> str:
    """Unit of the swept key; "-" if the key has no unit, "SI" if no table describes it."""
    owner: Any = load_scene(job.scene, list(job.changes))
    *tables, name = job.key.split(".")
    for table in tables:
        owner = owner.get(table) if isinstance(owner, Mapping) else getattr(owner, table, None)
    known = type(owner).model_fields.get(name) if isinstance(owner, BaseModel) else None
    extra = known.json_schema_extra if known is not None else None
    return str(extra["unit"]) or "-" if isinstance(extra, dict) and "unit" in extra else "SI"


def _records_of_points(job: SweepJob, progress: Callable[[str, float], None], crew: Crew) -> list[Record]:
    """Records of all points of a sweep, computed by workers; raises InputError if no point failed but none has a number
    to show."""

    def tell(finished: Done) -> None:
        progress(f"{finished.done} of {finished.paths} points", finished.done / finished.paths)

    def lost(points: range, reason: str) -> Arrays:
        return _json_array(_failed_record(reason) for _ in points)

    if crew.cluster is not None:  # whose workers compute in folders of their own
        job = replace(job, folder=job.folder.resolve(), scene=_absolute_path(job.scene))
    with crew.at_work(len(job.values), job.folder, *([Path(job.scene)] if Path(job.scene).is_file() else [])) as pool:
        text_records = run_paths(job, len(job.values), job.folder / RECORDS_FOLDER, pool, Blocks(1), tell, lost)[
            "record"
        ]
    records = [json.loads(str(text_of_record)) for text_of_record in text_records]
    if not any(record["numbers"] or record["failed"] for record in records):
        raise InputError("--sweep", job.key, None, f"the study of {job.scene} gives no numbers to draw over it")
    return records


def _absolute_path(scene: str) -> str:
    """Absolute path of a scene file; the name of a shipped scene is unchanged."""
    return str(Path(scene).resolve()) if Path(scene).is_file() else scene


def _save_sweep(folder: Path, sweep_results: "SweepResults") -> None:
    """Save the results of a sweep as ``sweep.csv`` and ``sweep.json``; equal points give equal bytes."""
    errors, broken = (
        [_largest_error(results) for results in sweep_results.results],
        [_broken_assumptions_text(results) for results in sweep_results.results],
    )
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([sweep_results.key, *sweep_results.columns, "failed", "largest error [-]", "broken assumptions"])
    for i, value in enumerate(sweep_results.values):
        failed = "; ".join(
            f"{engine_name}: {reason}" if engine_name else reason
            for engine_name, reason in sweep_results.failures[i].items()
        )
        writer.writerow(
            [value, *(column[i] for column in sweep_results.columns.values()), failed, errors[i], broken[i]]
        )
    write_whole(folder / "sweep.csv", text.getvalue().encode())
    content = {
        "key": sweep_results.key,
        "values": list(sweep_results.values),
        "numbers": sweep_results.columns,
        "failed": sweep_results.failures,
    }
    content |= {"results": [told.errors_and_assumptions(results) for results in sweep_results.results]}
    write_whole(folder / "sweep.json", json.dumps(content, indent=1).encode())


def _largest_error(results: told.Results) -> float | None:
    """Largest stated relative error of a point's results (error divided by the channel's standard deviation); None if
    no error was estimated."""
    return max((error.share for run in results.values() if (error := largest_estimate(run)) is not None), default=None)


def _broken_assumptions_text(results: told.Results) -> str:
    """Text on assumptions that a point's results broke, each with the share of time for which it was broken."""
    breaches = [(name, breach) for name, run in results.items() for breach in broken_assumptions_of(run)]
    return "; ".join(f"{name}: {breach.name} ({100.0 * breach.share:.2g} %)" for name, breach in breaches)


def _table_lines(columns: Columns, pages: list[str]) -> list[str]:
    """Lines for the screen on at most 12 quantities that change in the sweep: first, last, least and largest value."""
    moving = {name: present_numbers(column) for name, column in columns.items() if has_several_values(column)}
    lines = [
        f"    {name:<58} {values[0]:>12.5g} at first {values[-1]:>12.5g} at last "
        f"{min(values):>12.5g} to {max(values):.5g}"
        for name, values in list(moving.items())[:12]
    ]
    omitted_text = f", {len(moving) - 12} more of them" if len(moving) > 12 else ""
    return [
        *lines,
        f"  {len(moving)} of {len(columns)} numbers change{omitted_text}: {', '.join(['sweep.csv', *pages])}",
    ]
