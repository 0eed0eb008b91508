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
from models.ensemble.runner import EnsembleProgress as Done
from models.ensemble.runner import PathBlocks, run_paths
from models.ensemble.store import ArraysByName, checksum_of_sources, exclusive_folder, named_files
from models.ensemble.workers import Crew
from studies.command.asked import STUDIES_FOLDER, checked_study, load_scene, requested_engines, scene_path
from studies.command.summary_numbers import Columns, has_several_values, present_numbers, summary_scalars

if TYPE_CHECKING:
    from studies.command.sweep_figure import SweepResults

RECORDS_FOLDER, RUNS_FOLDER = "points", "runs"
"""Names of the folders of the records of finished points, and of the points' results."""
POINT_LIMIT = 10_000
"""Largest number of points of a sweep."""

PointRecord = dict[str, Any]


@dataclass(frozen=True)
class SweepJob:
    """Ensemble job (see ``models.ensemble.runner``) of a sweep: point i is the scene with the i-th value of the key.

    with_error : whether the error of each point is estimated.
    """

    scene_name: str
    key_changes: tuple[str, ...]
    swept_key: str
    swept_values: tuple[Any, ...]
    engine: str | None
    output_folder: Path
    with_error: bool = True

    def __call__(self, paths: range) -> ArraysByName:
        """Array "record" (n,): the record of each of the n points as JSON text."""
        return _json_array(map(self.record, paths))

    def prepared_point(self, point_number: int) -> tuple[Any, tuple[str, ...], Any]:
        """Scene, engines and study of a point of the sweep; raises InputError if the point cannot be run."""
        scene = load_scene(
            self.scene_name, [*self.key_changes, f"{self.swept_key}={_value_text(self.swept_values[point_number])}"]
        )
        scene = scene.model_copy(update={"error": scene.error and self.with_error})
        engine = self.engine or getattr(getattr(scene, "run", None), "engine", None)
        engines = requested_engines(engine, scene.system)
        return scene, engines, checked_study(scene, engines)

    def check(self) -> Any:
        """The scene of the first point that can be run; if every point is refused, the InputError of the first is
        raised."""
        first: InputError | None = None
        for i in range(len(self.swept_values)):
            try:
                return self.prepared_point(i)[0]
            except InputError as error:
                first = first or error
        assert first is not None
        raise first

    def record(self, point_number: int) -> PointRecord:
        """Run a point of the sweep; returns its record: its numbers by name, its failures (by engine, if the study
        gives them), and the errors and assumptions that its results state."""
        try:
            scene, engines, study = self.prepared_point(point_number)
            scene = scene.model_copy(update={"workers": 1, "cluster": None})
            with folder_when_complete(self.output_folder / RUNS_FOLDER / f"{point_number:04d}") as run_folder:
                summary = study.run(scene, engines, run_folder, lambda text, part: None)
        except (InputError, RunFailed) as error:
            return _failed_record(error)
        attributes = told.attributes_for_json(summary.get("results", {}))
        return {"numbers": summary_scalars(summary), "failed": summary.get("failed", {}), "results": attributes}

    def facts(self) -> dict[str, Any]:
        """Facts on which the results of all points depend: the scene's table, the files that it names, and the code."""
        path = scene_path(self.scene_name)
        table = changed_tables(path, self.key_changes)
        return {
            "sweep": self.swept_key,
            "values": list(self.swept_values),
            "engine": self.engine,
            "error": self.with_error,
            "scene": table,
            "files": named_files([table, self.swept_values, self.engine], path.parent),
            "code of studies": checksum_of_sources(STUDIES_FOLDER),
        }


def _json_array(point_records: Iterable[PointRecord]) -> ArraysByName:
    """Records as an array of JSON texts."""
    return {"record": np.array(list(map(json.dumps, point_records)))}


def _failed_record(failure_reason: object) -> PointRecord:
    """Record of a point that has no results, with the reason."""
    return {"numbers": {}, "failed": {"": str(failure_reason)}, "results": {}}


@contextmanager
def folder_when_complete(final_folder: Path) -> Iterator[Path]:
    """Context that yields a temporary folder to write into. It gets its final name only when it is complete, and then
    replaces an older folder of this name."""
    partial_folder = final_folder.with_name(f".{final_folder.name}.{os.getpid()}.part")
    partial_folder.mkdir(parents=True)
    try:
        yield partial_folder
        shutil.rmtree(final_folder, ignore_errors=True)
        os.replace(partial_folder, final_folder)
    finally:
        shutil.rmtree(partial_folder, ignore_errors=True)


_RANGE_PATTERN = re.compile(r"([^:,]+):([^:,]+):([^:,]+)")


def parse_range(range_text: str) -> tuple[str, tuple[Any, ...]]:
    """Key and values of a sweep from the text KEY=FROM:TO:N, with N evenly spaced values, or KEY=a,b,c; raises
    InputError."""
    key, equals, value_text = (text_part.strip() for text_part in range_text.partition("="))
    if not equals or not key or not value_text:
        raise InputError(
            "--sweep", "", range_text, "must read KEY=FROM:TO:N or KEY=a,b,c, for example run.step=1e-4,2e-4"
        )
    matched = _RANGE_PATTERN.fullmatch(value_text)
    values = _spaced_values(range_text, *matched.groups()) if matched else _listed_values(value_text)
    for value in values:
        if not _is_writable(value):
            allowed = "must be a finite number, a text, true, false or a list of these"
            raise InputError("--sweep", key, str(value), allowed)
    if not 2 <= len(values) <= POINT_LIMIT:
        raise InputError("--sweep", key, value_text, f"gives {len(values)} value(s): 2 to {POINT_LIMIT:,} make a sweep")
    if len(set(map(_value_text, values))) < len(values):
        raise InputError("--sweep", key, value_text, "gives a value twice")
    return key, values


def sweep_points(
    range_text: str, scene_name: str, key_changes: Sequence[str], engine: str | None, with_error: bool = True
) -> SweepJob:
    """The job of the sweep that ``range_text`` describes, without its folder; raises InputError if none of its points
    can be run."""
    key, values = parse_range(range_text)
    job = SweepJob(scene_name, tuple(key_changes), key, values, engine, Path(), with_error)
    job.check()
    return job


def _spaced_values(range_text: str, first_text: str, last_text: str, count_text: str) -> tuple[Any, ...]:
    """Evenly spaced values of a sweep from the texts of both ends and of their number; integers if all are integers."""
    try:
        ends, n = (float(first_text), float(last_text)), int(count_text)
    except ValueError:
        raise InputError(
            "--sweep", "", range_text, "FROM and TO must be numbers and N a whole number of points"
        ) from None
    if not np.isfinite(ends).all() or not 2 <= n <= POINT_LIMIT:
        raise InputError("--sweep", "", range_text, f"FROM and TO must be finite, N from 2 to {POINT_LIMIT:,}")
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


def _value_text(key_value: Any) -> str:
    """Text of a value in the notation of scene files."""
    return json.dumps(key_value, ensure_ascii=False, default=str)


def _is_writable(key_value: Any) -> bool:
    """Whether a scene file can represent a value exactly."""
    try:
        return bool(tomllib.loads(f"x = {_value_text(key_value)}")["x"] == key_value)
    except ValueError:
        return False


def run(sweep_job: SweepJob, report_progress: Callable[[str, float], None], worker_crew: Crew) -> dict[str, Any]:
    """Run all unfinished points of a sweep by workers, then save its table and figures; returns the summary."""
    from studies.command.sweep_figure import draw_sweep  # workers, which import this file, draw nothing

    with exclusive_folder(sweep_job.output_folder):
        for partial_folder in (sweep_job.output_folder / RUNS_FOLDER).glob(".*.part"):
            shutil.rmtree(partial_folder, ignore_errors=True)  # of a process that was killed while it wrote
        records = _records_of_points(sweep_job, report_progress, worker_crew)
        swept = _sweep_columns(sweep_job, records)
        _save_sweep(sweep_job.output_folder, swept)
        pages = draw_sweep(swept, sweep_job.output_folder)
    reasons = {
        f"{sweep_job.swept_key}={value}{f', {who}' if who else ''}": reason
        for value, failed in zip(sweep_job.swept_values, swept.failures_of_points, strict=True)
        for who, reason in failed.items()
    }
    return {
        "scene": f"{scene_path(sweep_job.scene_name).stem} over {sweep_job.swept_key}, "
        f"{len(sweep_job.swept_values)} points",
        "failed": reasons,
        "folder": str(sweep_job.output_folder),
        "values": list(sweep_job.swept_values),
        "numbers": swept.columns_by_quantity,
        "table": _table_lines(swept.columns_by_quantity, pages),
        "results": {
            f"{sweep_job.swept_key}={value} {name}".rstrip(): run
            for value, results in zip(sweep_job.swept_values, swept.results_of_points, strict=True)
            for name, run in results.items()
        },
    }


def _sweep_columns(sweep_job: SweepJob, point_records: list[PointRecord]) -> "SweepResults":
    """Results of a sweep from the records of all points: a column per quantity, failures, and the errors and
    assumptions of the results."""
    from studies.command.sweep_figure import SweepResults

    quantities = list(dict.fromkeys(name for record in point_records for name in record["numbers"]))
    columns = {name: [record["numbers"].get(name) for record in point_records] for name in quantities}
    failures = [record["failed"] for record in point_records]
    results: list[told.Results] = [told.results_with_attributes(record["results"]) for record in point_records]
    return SweepResults(
        sweep_job.scene_name,
        sweep_job.swept_key,
        sweep_job.swept_values,
        columns,
        failures,
        results,
        _unit_of_key(sweep_job),
    )


def _unit_of_key(sweep_job: SweepJob) -> str:
    """Unit of the swept key; "-" if the key has no unit, "SI" if no table describes it."""
    owner: Any = load_scene(sweep_job.scene_name, list(sweep_job.key_changes))
    *tables, name = sweep_job.swept_key.split(".")
    for table in tables:
        owner = owner.get(table) if isinstance(owner, Mapping) else getattr(owner, table, None)
    known = type(owner).model_fields.get(name) if isinstance(owner, BaseModel) else None
    extra = known.json_schema_extra if known is not None else None
    return str(extra["unit"]) or "-" if isinstance(extra, dict) and "unit" in extra else "SI"


def _records_of_points(
    sweep_job: SweepJob, report_progress: Callable[[str, float], None], worker_crew: Crew
) -> list[PointRecord]:
    """Records of all points of a sweep, computed by workers; raises InputError if no point failed but none has a number
    to show."""

    def tell(ensemble_progress: Done) -> None:
        report_progress(
            f"{ensemble_progress.done} of {ensemble_progress.paths} points",
            ensemble_progress.done / ensemble_progress.paths,
        )

    def lost(lost_points: range, loss_reason: str) -> ArraysByName:
        return _json_array(_failed_record(loss_reason) for _ in lost_points)

    if worker_crew.cluster is not None:  # whose workers compute in folders of their own
        sweep_job = replace(
            sweep_job, output_folder=sweep_job.output_folder.resolve(), scene_name=_absolute_path(sweep_job.scene_name)
        )
    with worker_crew.at_work(
        len(sweep_job.swept_values),
        sweep_job.output_folder,
        *([Path(sweep_job.scene_name)] if Path(sweep_job.scene_name).is_file() else []),
    ) as pool:
        text_records = run_paths(
            sweep_job,
            len(sweep_job.swept_values),
            sweep_job.output_folder / RECORDS_FOLDER,
            pool,
            PathBlocks(1),
            tell,
            lost,
        )["record"]
    records = [json.loads(str(text_of_record)) for text_of_record in text_records]
    if not any(record["numbers"] or record["failed"] for record in records):
        raise InputError(
            "--sweep",
            sweep_job.swept_key,
            None,
            f"the study of {sweep_job.scene_name} gives no numbers to draw over it",
        )
    return records


def _absolute_path(scene_name: str) -> str:
    """Absolute path of a scene file; the name of a shipped scene is unchanged."""
    return str(Path(scene_name).resolve()) if Path(scene_name).is_file() else scene_name


def _save_sweep(output_folder: Path, sweep_results: "SweepResults") -> None:
    """Save the results of a sweep as ``sweep.csv`` and ``sweep.json``; equal points give equal bytes."""
    errors, broken = (
        [_largest_error(results) for results in sweep_results.results_of_points],
        [_broken_assumption_text(results) for results in sweep_results.results_of_points],
    )
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(
        [
            sweep_results.swept_key,
            *sweep_results.columns_by_quantity,
            "failed",
            "largest error [-]",
            "broken assumptions",
        ]
    )
    for i, value in enumerate(sweep_results.swept_values):
        failed = "; ".join(
            f"{engine_name}: {reason}" if engine_name else reason
            for engine_name, reason in sweep_results.failures_of_points[i].items()
        )
        writer.writerow(
            [value, *(column[i] for column in sweep_results.columns_by_quantity.values()), failed, errors[i], broken[i]]
        )
    write_whole(output_folder / "sweep.csv", text.getvalue().encode())
    content = {
        "key": sweep_results.swept_key,
        "values": list(sweep_results.swept_values),
        "numbers": sweep_results.columns_by_quantity,
        "failed": sweep_results.failures_of_points,
    }
    content |= {"results": [told.errors_and_assumptions(results) for results in sweep_results.results_of_points]}
    write_whole(output_folder / "sweep.json", json.dumps(content, indent=1).encode())


def _largest_error(point_results: told.Results) -> float | None:
    """Largest stated relative error of a point's results (error divided by the channel's standard deviation); None if
    no error was estimated."""
    return max(
        (error.share for run in point_results.values() if (error := largest_estimate(run)) is not None), default=None
    )


def _broken_assumption_text(point_results: told.Results) -> str:
    """Text on assumptions that a point's results broke, each with the share of time for which it was broken."""
    breaches = [(name, breach) for name, run in point_results.items() for breach in broken_assumptions_of(run)]
    return "; ".join(f"{name}: {breach.name} ({100.0 * breach.share:.2g} %)" for name, breach in breaches)


def _table_lines(columns_by_quantity: Columns, figure_names: list[str]) -> list[str]:
    """Lines for the screen on at most 12 quantities that change in the sweep: first, last, least and largest value."""
    moving = {
        name: present_numbers(column) for name, column in columns_by_quantity.items() if has_several_values(column)
    }
    lines = [
        f"    {name:<58} {values[0]:>12.5g} at first {values[-1]:>12.5g} at last "
        f"{min(values):>12.5g} to {max(values):.5g}"
        for name, values in list(moving.items())[:12]
    ]
    omitted_text = f", {len(moving) - 12} more of them" if len(moving) > 12 else ""
    return [
        *lines,
        f"  {len(moving)} of {len(columns_by_quantity)} numbers change{omitted_text}: "
        f"{', '.join(['sweep.csv', *figure_names])}",
    ]
