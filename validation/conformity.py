"""Conformity of an engine or an integrator from outside the tree: the checks that the built-in ones pass.

The same functions judge it (``checks``, the hard cases of the pitch plane), so a row means the same as in the
report. A check in which the engine raises, or returns something unusable, is a failed row with the reason.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from models.core.errors import InputError, RunFailed
from models.core.result import provenance
from models.engines.assembly import Assembly, Settings
from models.engines.catalogue import CATALOGUE, OUTSIDE_CLASSES
from models.engines.outside import register
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import assembly_of_scene
from models.systems.pitch_plane.virtual_measurement import write_measurement
from validation.common import checks
from validation.common.rows import Independence, Observed, Row, System, behaviour_row, not_run
from validation.common.scenes import VEHICLE_SETS, force_scene, road_scene
from validation.hard_cases.case import CaseOutcome, judge
from validation.run import print_summary, save

SYSTEM: System = "pitch-plane"
HARD_CASE_FAMILIES = (
    "stepping",
    "sampled_input",
    "contact_points",
    "prescribed_pitch",
    "stabilisers",
    "invariants",
    "extremes",
)
"""Families of hard cases, by module, that any engine of the pitch-plane vehicle can run."""
STEP, DURATION = 1e-3, 0.5
ORDER_STEPS = (5e-4, 2.5e-4)
"""Steps (s) between which the order is measured, as in the report: RK4 is not asymptotic at 1 ms yet."""
TOLERANCE = 1e-9
"""Relative tolerance of a run by an adaptive method."""
LOOSE_TOLERANCE = 1e-4
"""Largest state error (m, rad, m/s, rad/s) of a method of order 4 or more at 1 ms; RK4 has 1e-6."""
ROUNDING_ERROR = 1e-11
"""Errors below this are rounding; the observed order is not computed from them."""

EXACT_BOUND = 1e3 * TOLERANCE
"""Bound for an adaptive method, in SI units or relative, of errors that are mere rounding with fixed steps."""
STEP_COMPARISON_UNITS = ("of the error at the double step", "orders lost")
"""Units of hard cases that compare two step sizes, which are not run for adaptive methods and methods of low order."""
OTHER_SYSTEMS_NOTE = (
    "only the pitch-plane vehicle is built for engines from outside: this table says nothing of other systems"
)

Check = tuple[str, str, str, float, str, Callable[[], float]]


def conformity(engine_name: str, output_folder: Path, command: str) -> int:
    """Run all conformity checks on the engine or integrator ``module:Class``; writes report.html, results.json and
    results.csv, and prints the table.

    Returns the number of failed rows; raises InputError if there is no such class.
    """
    register(engine_name)
    with TemporaryDirectory() as cases_folder:
        rows = list(_printed_rows(_conformity_rows(engine_name, Path(cases_folder))))
    (output_folder / "data").mkdir(exist_ok=True)
    save(
        output_folder,
        rows,
        {
            **provenance(command),
            "engine": engine_name,
            "seeds": {"random states": checks.SEED},
            "quick": False,
            "seconds": {},
            "wall": None,
        },
    )
    from validation.report.page import write

    return print_summary(rows, None, write(output_folder))


def _printed_rows(report_rows: Iterator[Row]) -> Iterator[Row]:
    """Print each row as soon as it is computed, because a slow engine takes minutes; yields the rows."""
    for row in report_rows:
        print(f"  {row.status:<8} {row.quantity:<86} {_value_text(row):>12}  {row.reason}", flush=True)
        yield row


def _value_text(report_row: Row) -> str:
    return f"{report_row.value:.3g}" if isinstance(report_row.value, int | float) else str(report_row.value or "")


def _conformity_rows(engine_name: str, work_folder: Path) -> Iterator[Row]:
    second: Independence = "shared kernel" if hasattr(OUTSIDE_CLASSES[engine_name], "integrate") else "native"
    for id, quantity, unit, bound, why, error in _checks_on_engine(engine_name, work_folder):
        yield _error_row(f"conformity.{id}", quantity, unit, bound, why, error, second)
    yield _order_row(engine_name, second)
    yield _guard_row(engine_name, work_folder)
    yield from _hard_cases(engine_name, work_folder)
    yield not_run(
        "conformity.others", SYSTEM, "wheelset, contact, ride, handling, hub forces, braking", OTHER_SYSTEMS_NOTE
    )


def _error_row(
    row_id: str,
    quantity: str,
    quantity_unit: str,
    error_bound: float,
    tolerance_reason: str,
    compute_error: Callable[[], float],
    independence: Independence,
) -> Row:
    """Row that compares the value of ``compute_error`` with its bound; if the check raises, the row is failed and holds
    the message of the exception."""
    try:
        return Observed(row_id, SYSTEM, quantity, compute_error(), quantity_unit).at_most(
            error_bound, tolerance_reason, independence
        )
    except (InputError, RunFailed) as reason:
        return Row(
            row_id,
            SYSTEM,
            quantity,
            None,
            quantity_unit,
            0.0,
            error_bound,
            tolerance_reason,
            independence,
            "failed",
            str(reason),
        )


def _settings_of_engine(engine_name: str, time_step: float = STEP) -> Settings:
    return Settings(engine_name, time_step, DURATION, TOLERANCE)


def _run(engine_name: str, assembly: Assembly, run_settings: Settings) -> Any:
    """Trajectory of the engine or integrator called ``engine_name``. Its exceptions pass through, so that their message
    is reported.

    Raises RunFailed, too, if the times of its rows are not the ends of the steps.
    """
    path = checks.engine(engine_name)(assembly, run_settings).run()
    if not np.array_equal(np.rint(path.times / run_settings.step), np.arange(run_settings.steps + 1)):
        allowed = f"instead of {run_settings.steps + 1} from 0 to {run_settings.duration:g} s, the ends of the steps"
        raise RunFailed(
            engine_name, f"gave {len(path.times)} times from {path.times[0]:.6g} to {path.times[-1]:.6g} s {allowed}"
        )
    return path


def _checks_on_engine(engine_name: str, work_folder: Path) -> Iterator[Check]:
    make, settings = checks.engine(engine_name), _settings_of_engine(engine_name)
    for vehicle in VEHICLE_SETS:
        for geometry in ("exact", "linear"):
            yield (
                f"audit.{vehicle}.{geometry}",
                f"acceleration at 100 random states against the equations of the paper, {vehicle}, {geometry}",
                "of the largest",
                1e-12,
                "both sides are a dozen products of doubles",
                partial(checks.acceleration_gap, make, _audit_assembly(vehicle, geometry), settings),
            )
    yield (
        "equilibrium",
        "distance from the static equilibrium on a flat road",
        "m, rad, m/s, rad/s",
        EXACT_BOUND if _is_adaptive(engine_name) else 1e-9,
        "nothing moves what is at rest, beyond a kept tolerance",
        partial(_equilibrium_error, engine_name, settings),
    )
    for kind, scene in _compared_scenes(work_folder).items():
        yield (
            f"path.{kind}",
            f"largest state error, {kind}, against the reference by DOP853 at 1e-13",
            "m, rad, m/s, rad/s",
            _difference_bound(engine_name),
            f"{DURATION:g} s at {STEP:g} s, RK4 has 1e-6 at most",
            partial(_state_error, engine_name, assembly_of_scene(scene), settings),
        )
    yield (
        "momentum",
        "vertical momentum against weight less wheel forces over time",
        "of weight times time",
        _momentum_bound(engine_name),
        "an invariant of any vehicle, exact from order 2 on for forces linear over each step",
        partial(
            _momentum_error,
            engine_name,
            assembly_of_scene(_compared_scenes(work_folder)["wheel forces, linear"]),
            settings,
        ),
    )


def _audit_assembly(vehicle_name: str, geometry: str) -> Assembly:
    audit = import_module("validation.cases.audit")
    return assembly_of_scene(audit.study_road_scene(vehicle_name, geometry))


def _is_adaptive(engine_name: str) -> bool:
    return bool(getattr(OUTSIDE_CLASSES[engine_name], "adaptive", False))


def _difference_bound(engine_name: str) -> float:
    """Largest allowed state difference (m, rad, m/s, rad/s) from the reference run: wide for methods of low order,
    whose observed order is judged in another row."""
    order = CATALOGUE[engine_name][engine_name].order
    return 1e-5 if _is_adaptive(engine_name) else LOOSE_TOLERANCE if order >= 4 else 0.5


def _momentum_bound(engine_name: str) -> float:
    return 1e-7 if _is_adaptive(engine_name) else 1e-9 if CATALOGUE[engine_name][engine_name].order > 1 else 1e-2


def _compared_scenes(scene_folder: Path) -> dict[str, Any]:
    """Scenes, by name, whose trajectories are compared: a road, and wheel forces with linear interpolation and held."""
    if not (scene_folder / "wheel_forces.csv").exists():
        write_measurement(simulate(road_scene(duration=DURATION), "reference"), scene_folder, STEP)
    return {
        "study road": road_scene(duration=DURATION),
        "wheel forces, linear": force_scene(scene_folder, duration=DURATION),
        "wheel forces, held": force_scene(scene_folder, duration=DURATION, interpolation="held"),
    }


def _reference_run(assembly: Assembly, time_step: float = STEP) -> Any:
    return checks.engine("reference")(assembly, Settings("DOP853", time_step, DURATION, 1e-13)).run()


def _state_error(engine_name: str, assembly: Assembly, run_settings: Settings) -> float:
    return checks.state_gap(_run(engine_name, assembly, run_settings), _reference_run(assembly))


def _equilibrium_error(engine_name: str, run_settings: Settings) -> float:
    from models.systems.pitch_plane.scene import build

    flat = assembly_of_scene(build({"title": "at rest", "run": {"duration": DURATION, "step": STEP}}))
    _run(engine_name, flat, run_settings)
    return checks.equilibrium_gap(checks.engine(engine_name), flat, run_settings)


def _momentum_error(engine_name: str, assembly: Assembly, run_settings: Settings) -> float:
    _run(engine_name, assembly, run_settings)
    return checks.momentum_gap(checks.engine(engine_name), assembly, run_settings)


def _order_row(engine_name: str, independence: Independence) -> Row:
    """Row: observed order of a fixed-step method; for an adaptive method, ratio of its errors at a tight and a loose
    tolerance."""
    road = assembly_of_scene(road_scene(duration=DURATION))
    if _is_adaptive(engine_name):
        return _error_row(
            "conformity.tolerance",
            "error at a tolerance of 1e-9 by that at 1e-5",
            "ratio",
            0.1,
            "a method that keeps a tolerance is the more exact the tighter it is",
            partial(_ratio_of_tolerance_errors, engine_name, road),
            independence,
        )
    declared, why = (
        CATALOGUE[engine_name][engine_name].order,
        "one halving; the band leaves room for the next term of the error",
    )

    def gap() -> float:
        truth = _reference_run(road, ORDER_STEPS[-1])
        errors = [
            checks.state_gap(_run(engine_name, road, _settings_of_engine(engine_name, step)), truth)
            for step in ORDER_STEPS
        ]
        return 0.0 if errors[0] < ROUNDING_ERROR else abs(float(np.log2(errors[0] / errors[1])) - declared)

    return _error_row(
        "conformity.order", f"observed order less the declared {declared}", "", 0.35, why, gap, independence
    )


def _ratio_of_tolerance_errors(engine_name: str, road_assembly: Assembly) -> float:
    loose = Settings(engine_name, STEP, DURATION, 1e-5)
    errors = [
        checks.state_gap(_run(engine_name, road_assembly, settings), _reference_run(road_assembly))
        for settings in (loose, _settings_of_engine(engine_name))
    ]
    return errors[1] / errors[0] if errors[0] > ROUNDING_ERROR else 0.0


def _guard_row(engine_name: str, work_folder: Path) -> Row:
    """Row: with wheel forces of a million times the weight the vehicle leaves all bounds, and the engine must raise an
    error."""
    throw = work_folder / "throw"
    throw.mkdir(exist_ok=True)
    run = simulate(road_scene(duration=DURATION), "reference")
    for channel in ("f1", "f2"):
        run.data[channel].values[:] *= 1e6
    write_measurement(run, throw, STEP)
    meant = {"file": "wheel_forces.csv", "interpolation": "linear", "accept": ["weight", "unit", "sign"]}
    try:
        scene = force_scene(throw, duration=DURATION, effects={"wheel_forces": meant})
        _run(engine_name, assembly_of_scene(scene), _settings_of_engine(engine_name))
        ended = "silent"
    except RunFailed:
        ended = "raised"
    except InputError:
        ended = "refused"
    return behaviour_row(
        "conformity.guard",
        SYSTEM,
        "a run that leaves all bounds",
        ended,
        "raised",
        "what is no vehicle any more is no answer",
    )


def _hard_cases(engine_name: str, work_folder: Path) -> Iterator[Row]:
    built_in = {engine_name, *(integrator for integrators in CATALOGUE.values() for integrator in integrators)}
    for family in HARD_CASE_FAMILIES:
        for case in import_module(f"validation.hard_cases.{family}").CASES:
            id = f"conformity.hard.{case.name.replace(',', '').replace(' ', '-')}"
            quantity, case_folder = f"hard case: {case.name}: {case.exact_answer}", work_folder / id
            case_folder.mkdir()
            if case.unit in STEP_COMPARISON_UNITS and (
                _is_adaptive(engine_name) or CATALOGUE[engine_name][engine_name].order < 4
            ):
                yield not_run(id, SYSTEM, quantity, "compares steps of a method of order 4")
                continue
            if _is_adaptive(engine_name):
                case = replace(case, tolerance=max(case.tolerance, EXACT_BOUND))
            try:
                outcome = judge(case, engine_name, case_folder)
            except Exception as error:  # what foreign code leads to is a row, not the end of the table
                if isinstance(error, KeyError) and error.args[0] in built_in:
                    yield not_run(id, SYSTEM, quantity, "is about the engines and integrators that come with twinrig")
                    continue
                outcome = CaseOutcome("SILENT", float("inf"), f"{type(error).__name__}: {error}")
            good = outcome.word != "SILENT"
            yield behaviour_row(
                id,
                SYSTEM,
                quantity,
                outcome.word if good else f"SILENT, off by {outcome.error:.3g}",
                outcome.word if good else "right, refused or raised",
                f"{case.difficulty}{f': {outcome.message}' if outcome.message else ''}",
            )
