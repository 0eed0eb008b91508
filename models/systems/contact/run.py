"""Runs of a contact scene: creep forces of a contact at all creepages, or of a table of contacts."""

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import Any, Literal

import numpy as np

from models.contact.accuracy import ContactErrors, rolled_with_errors
from models.contact.hertz import HertzContact, by_approach, by_axes, by_load
from models.contact.material import FallingFriction, MaterialPair
from models.contact.profile_files import read_profile
from models.contact.profiles import ContactProfile
from models.contact.simplified_theory import DEFAULT_OPTIONS, NormalContact, SimplifiedOptions, solve_normal_contact
from models.contact.standard_profiles import BUILT_IN_RAILS, BUILT_IN_WHEELS, built_in_profile
from models.contact.theories import (
    CreepagesAndSpin,
    ExactTheory,
    ExactTheoryOnEllipse,
    FastsimTheory,
    LinearTheory,
    RollingContact,
    RollingResult,
    SimplifiedTheory,
    friction_warning,
)
from models.contact.undeformed_distance import quadratic
from models.contact.wheel_on_rail import TouchingPlace, TrackGeometry, WheelsetGeometry, wheel_on_rail
from models.core.assumptions import with_assumptions
from models.core.errors import InputError
from models.core.result import Channel, Result, result
from models.core.scene_effects import extended_by_effects
from models.core.tables import ROWS_PER_BLOCK as ROWS_PER_TABLE_BLOCK
from models.ensemble.store import BlockStore, named_files
from models.ensemble.workers import Crew, folders_for_workers
from models.systems.contact.assumptions import assumptions
from models.systems.contact.assumptions import table_assumptions as assumptions_of_rows
from models.systems.contact.cases_table import column_sizes, compile_kernels, first_rows, solve_table
from models.systems.contact.scene import ContactScene, scene_errors
from models.systems.contact.stated_error import with_error, with_error_of_rows

BUILT_IN_PROFILES = {"wheel": BUILT_IN_WHEELS, "rail": BUILT_IN_RAILS}
FORCES_OF_ROLLED_CONTACT = attrgetter("fx", "fy", "mz", "stick", "dissipation")
ERRORS_OF_ROLLED_CONTACT = attrgetter("cells", "theory", "moment_cells", "moment_theory")
CONTACT_CHANNELS = {
    "xi_x": ("-", "longitudinal creepage"),
    "xi_y": ("-", "lateral creepage"),
    "spin": ("1/m", "spin by the rolling speed"),
    "fx": ("N", "force on the wheel in the direction of rolling"),
    "fy": ("N", "force on the wheel to the right"),
    "mz": ("N m", "moment on the wheel about the normal"),
    "stick": ("-", "share of the area that sticks"),
    "dissipation": ("N", "power lost by the rolling speed"),
    "error_of_cells": ("N", "error of the force that the cells leave"),
    "error_of_theory": ("N", "error of the force that the theory has"),
    "moment_error_of_cells": ("N m", "error of the moment that the cells leave"),
    "moment_error_of_theory": ("N m", "error of the moment that the theory has"),
}
"""Units and meanings of a motion, of its forces (``FORCES_OF_ROLLED_CONTACT``) and of their errors
(``ERRORS_OF_ROLLED_CONTACT``), in this order.
"""
FIELD_UNITS = {"x": "m", "y": "m", "dx": "m", "dy": "m", "pressure": "Pa", "px": "Pa", "py": "Pa", "slips": "-"}
ERROR_ORDER_OF_CELLS = {"linear": None, "fastsim": 2, "simplified": 2, "exact": 4}
"""Power of the number of cells along an axis with which the work of a call grows, by theory; in the exact theory each
cell acts on every other cell.
"""
BLOCKS_FOLDER = "blocks"
"""Folder of the finished blocks of a long table, beside the output file."""
LARGE_TABLE_BYTES = 8_000_000
"""Size in bytes (about four blocks) above which a table's blocks are stored, and computed by several processes."""
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Built:
    """Inputs of a contact before its normal problem is solved: materials, friction, load or approach. Effects may
    change them.

    pair : elastic constants; friction : its coefficient; load (N) or approach (m) : the other of the two is None.
    falling : friction that falls with the speed of slip, of FASTSIM alone; profiles : cross-sections of "wheel" and
    "rail", none where an ellipse is given. In a table of cases friction and load are arrays (n,) over its rows.
    """

    pair: MaterialPair
    friction: Any
    load: Any = None
    approach: float | None = None
    falling: FallingFriction | None = None
    profiles: Mapping[str, ContactProfile] = field(default_factory=dict)


@dataclass(frozen=True)
class ContactResults:
    """A contact with its creep forces at every creepage, and their errors if these were requested.

    pressing_seconds : time of the normal problem; rolling_seconds (n,) : time of each creepage, errors included.
    """

    contact: RollingContact
    motions: list[CreepagesAndSpin]
    rolled: Sequence[RollingResult]
    errors: Sequence[ContactErrors]
    pressing_seconds: float
    rolling_seconds: np.ndarray


def run(
    scene: ContactScene,
    engine: str = "",
    *,
    error: bool = True,
    fields: bool = False,
    answers: Path | None = None,
    progress: Progress = lambda stage, share: None,
) -> Result:
    """Compute the creep forces of a scene at every creepage, with ``ContactResults`` as detail, or those of its table
    of cases.

    error : whether errors are stated, for which each force is computed again on half the cells; assumptions are always
    checked. fields : whether pressures and tractions of all cells are kept for the last creepage; everything is then
    compiled before times are measured. answers : CSV file into which the forces of a table of cases are written block
    by block; the result has its first rows, and sizes of all. There are no engines. Raises InputError, or RunFailed
    where the exact theory is not solved.
    """
    if scene.cases is not None:
        if answers is None:
            raise InputError(scene.file, "cases", None, "is a table of contacts, which is answered into a file")
        return _table_result(scene, answers, progress, error)
    motions, cells = swept_creepages(scene), scene.method.cells
    progress("loading", 0.0)
    shown = rolled_with_errors(solved_contact(scene), motions[-1], cells, with_fields=True) if fields else None
    begun, start = time.process_time(), time.perf_counter()
    contact = solved_contact(scene)
    steps, marks = list[tuple[RollingResult, ContactErrors | None]](), [time.perf_counter()]
    for i, motion in enumerate(motions):
        progress("rolling", i / len(motions))
        steps.append(rolled_with_errors(contact, motion, cells) if error else (contact.roll(motion, cells), None))
        marks.append(time.perf_counter())
    seconds = time.process_time() - begun
    if shown is not None:
        steps[-1] = shown
    forces, errors_of_forces = zip(*steps, strict=True)
    rolls = ContactResults(
        contact, motions, forces, errors_of_forces if error else (), marks[0] - start, np.diff(marks)
    )
    labelled = with_assumptions(_labelled_result(scene, rolls, seconds), assumptions(scene, contact))
    return with_error(labelled, scene, contact, errors_of_forces) if error else labelled


def _labelled_result(scene: ContactScene, contact_results: ContactResults, run_seconds: float) -> Result:
    contact, count, power = (
        contact_results.contact,
        len(contact_results.motions),
        ERROR_ORDER_OF_CELLS[scene.method.name],
    )
    errors: list[tuple[float, ...]] = [ERRORS_OF_ROLLED_CONTACT(error) for error in contact_results.errors] or [
        ()
    ] * count
    rows = zip(contact_results.motions, map(FORCES_OF_ROLLED_CONTACT, contact_results.rolled), errors, strict=True)
    columns = np.array([[*motion, *forces, *errors_of_forces] for motion, forces, errors_of_forces in rows]).T
    doubt = ""
    if isinstance(contact, LinearTheory):
        with np.errstate(divide="ignore", invalid="ignore"):  # no friction carries nothing
            used = np.array([np.linalg.norm(force.force) for force in contact_results.rolled])
            doubt = friction_warning(used / (contact.friction * contact.pressing.load))
    return result(
        scene,
        {
            name: Channel("motion", values, *CONTACT_CHANNELS[name])
            for name, values in zip(CONTACT_CHANNELS, columns, strict=False)
        },
        {},
        counts={
            "steps": count,
            "calls": count,
            "states": 0,
            "terms": 0 if power is None else scene.method.cells**power,
        },
        seconds=run_seconds,
        doubts=[doubt] if doubt else [],
        detail=contact_results,
    )


def fields_by_cell(scene: ContactScene, contact_results: ContactResults) -> Result | None:
    """Result with pressure and tractions (Pa) in every cell in contact at the last creepage, patch after patch; None if
    ``run`` was called without fields.
    """
    patches = contact_results.rolled[-1].fields
    if not patches:
        return None
    columns = {
        name: Channel("cell", np.concatenate([getattr(patch, name)[patch.inside] for patch in patches]), unit)
        for name, unit in FIELD_UNITS.items()
    }
    return result(scene, columns, {}, motion=list(contact_results.motions[-1]))


def _table_result(scene: ContactScene, output_path: Path, report_progress: Progress, estimate_error: bool) -> Result:
    """Solve the scene's table of cases, and write the forces to a file; the result has the first rows."""
    built = partial(inputs_of_table_contacts, scene)
    compile_kernels(built, scene.method)  # no part of the time below
    start = time.perf_counter()
    counts = _solved_table(scene, output_path, built, report_progress, estimate_error)
    seconds = time.perf_counter() - start
    rows = {name: Channel("row", values, unit) for name, (unit, values) in first_rows(output_path).items()}
    table = result(scene, rows, {}, counts=counts, seconds=seconds, sizes=json.dumps(column_sizes(output_path)))
    with_assumptions(table, assumptions_of_rows(scene.cases_file()))
    return with_error_of_rows(table, scene) if estimate_error else table


def _solved_table(
    scene: ContactScene, output_path: Path, built_contact: Any, report_progress: Progress, estimate_error: bool
) -> dict[str, int]:
    """Solve a table of cases, and return the numbers of its rows and of refused rows. A table of many blocks is solved
    by the scene's worker processes, and finished blocks are stored.
    """
    file = scene.cases_file()
    rows, several = _line_count(file), file.stat().st_size > LARGE_TABLE_BYTES
    count = partial(_count_rows, report_progress, rows)
    if not several:
        return solve_table(file, output_path, built_contact, scene.method, count, with_errors=estimate_error)
    store = BlockStore(output_path.parent / BLOCKS_FOLDER)
    facts = {"scene": scene.table(), "error": estimate_error, "files": named_files(scene.table(), Path(scene.folder))}
    with (
        store.reserved_folder(facts),
        Crew.of(scene).at_work(rows // ROWS_PER_TABLE_BLOCK + 1, *folders_for_workers(scene)) as pool,
    ):
        return solve_table(
            file,
            output_path,
            built_contact,
            scene.method,
            count,
            with_errors=estimate_error,
            executor=pool,
            block_store=store,
        )


def _line_count(text_path: Path) -> int:
    """Number of line ends in a file, which is about its number of rows."""
    with text_path.open("rb") as lines:
        return sum(block.count(b"\n") for block in iter(partial(lines.read, 1 << 20), b""))


def _count_rows(report_progress: Progress, total_rows: int, finished_rows: int) -> None:
    """Report how many rows of all are finished."""
    report_progress(f"{finished_rows:,} of {total_rows:,} rows", min(finished_rows / max(total_rows, 1), 1.0))


def inputs_of_table_contacts(scene: ContactScene, friction: Any, load: Any) -> Built:
    """Inputs of the contacts in the rows of a table of cases, with the scene's materials and effects."""
    return extended_by_effects(Built(scene.pair, friction, load), scene)


def inputs_of_scene_contact(scene: ContactScene) -> Built:
    """Inputs of a scene's contact (materials, friction, load or approach, profiles), changed by the scene's effects."""
    table = scene.contact
    assert table is not None
    kinds: tuple[Literal["wheel", "rail"], ...] = ("wheel", "rail") if scene.profiles is not None else ()
    profiles: dict[str, ContactProfile] = {kind: _profile_by_name(scene, kind) for kind in kinds}
    return extended_by_effects(
        Built(scene.pair, table.friction, table.load, table.approach, scene.falling_friction, profiles), scene
    )


def solved_contact(scene: ContactScene) -> RollingContact:
    """Solve the normal problem of a scene's contact. Returns the contact, ready to roll by the scene's theory."""
    method, built = scene.method, inputs_of_scene_contact(scene)
    friction, pair = built.friction, built.pair
    if built.falling is not None and method.name != "fastsim":
        raise InputError(
            scene.file,
            "method.name",
            method.name,
            "has constant friction, and an effect of this scene makes it fall: use fastsim",
        )
    if scene.profiles is not None:
        with scene_errors(scene):
            patches = [touch.patch for touch in touching_points(scene, built)]
            pressed = solve_normal_contact(patches, pair, load=built.load, approach=built.approach)
            exact = method.name == "exact"
            return ExactTheory(pressed, friction, method.cells) if exact else SimplifiedTheory(pressed, friction)
    hertz = hertzian_contact(scene)
    if method.name == "simplified":
        return SimplifiedTheory(interpenetration_contact(hertz, pair), friction)
    if method.name == "fastsim":
        choices = method.model_dump(include={"march", "bound", "flexibilities"})
        return FastsimTheory(hertz, friction, pair, **choices, falling=built.falling)
    return (LinearTheory if method.name == "linear" else ExactTheoryOnEllipse)(hertz, friction, pair)


def swept_creepages(scene: ContactScene) -> list[CreepagesAndSpin]:
    """Creepages (xi_x, xi_y, spin) of a scene, with spin in 1/m: a single triple, or one for each value of [sweep]."""
    fixed = scene.creepage.model_dump()
    values = [{}] if scene.sweep is None else [{scene.sweep.of: float(value)} for value in scene.sweep.values()]
    return [tuple({**fixed, **value}.values()) for value in values]  # type: ignore[misc]


def interpenetration_contact(
    hertz_contact: HertzContact, material_pair: MaterialPair, simplified_options: SimplifiedOptions = DEFAULT_OPTIONS
) -> NormalContact:
    """Solve the normal problem of a Hertzian contact by the simplified theory of 1983 (interpenetration), on a
    rectangle larger than the ellipse.
    """
    A, B = float(hertz_contact.A), float(hertz_contact.B)
    x, y = (float(np.sqrt(1.5 * hertz_contact.approach / curvature)) for curvature in (A, B))
    return solve_normal_contact(
        quadratic(A, B, x, y), material_pair, load=float(hertz_contact.load), simplified_options=simplified_options
    )


def touching_points(scene: ContactScene, built_contact: Built) -> list[TouchingPlace]:
    """Points at which the profiles of wheel and rail touch."""
    p = scene.profiles
    assert p is not None
    return wheel_on_rail(
        built_contact.profiles["wheel"],
        built_contact.profiles["rail"],
        lateral_shift=p.lateral_shift,
        yaw=p.yaw,
        track=TrackGeometry(p.gauge, p.gauge_depth, p.inclination),
        wheelset=WheelsetGeometry(p.radius, p.back_to_back),
    )


def _profile_by_name(scene: ContactScene, wheel_or_rail: Literal["wheel", "rail"]) -> ContactProfile:
    """Returns the profile of "wheel" or "rail": a built-in profile, or the profile in the user's file."""
    assert scene.profiles is not None
    name = getattr(scene.profiles, wheel_or_rail)
    if name in BUILT_IN_PROFILES[wheel_or_rail]:
        return built_in_profile(name)
    if "." not in name:
        raise InputError(
            scene.file,
            f"profiles.{wheel_or_rail}",
            name,
            "must be a file or built in",
            tuple(BUILT_IN_PROFILES[wheel_or_rail]),
        )
    return read_profile(
        scene.path(name, f"profiles.{wheel_or_rail}"), wheel_or_rail, smoothing=scene.profiles.smoothing
    )


def hertzian_contact(scene: ContactScene) -> HertzContact:
    """Solve the Hertzian contact of a scene from semi-axes, curvatures or radii, under a load or at an approach."""
    built = inputs_of_scene_contact(scene)
    load, approach, pair = built.load, built.approach, built.pair
    if scene.ellipse is not None:
        return by_axes(scene.ellipse.a, scene.ellipse.b, pair, load=load, approach=approach)
    if scene.radii is not None:
        A, B = scene.radii.curvatures(scene.file)
    else:
        assert scene.curvatures is not None
        A, B = scene.curvatures.A, scene.curvatures.B
    return by_load(A, B, load, pair) if load is not None else by_approach(A, B, approach, pair)
