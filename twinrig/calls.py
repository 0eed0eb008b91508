"""Functions of the library: load, run, compare, price, choose, export, validate; thin layers on the command line's
code.

Heavy packages are imported by the functions that use them.
"""

import io
import json
from collections.abc import Mapping
from contextlib import contextmanager, redirect_stdout
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from models.core.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from twinrig.report import Report
    from twinrig.result import Result
    from twinrig.scene import Scene

AnyScene: TypeAlias = "str | Path | Mapping[str, Any] | Scene"
"""Type of an argument that is a scene: the name of a shipped scene, a file, a table, or a loaded scene."""
Changes: TypeAlias = "Mapping[str, Any] | None"
"""Type of changes of a scene: values by dotted keys, as ``{"run.step": 5e-4}``."""
MANOEUVRE_OPTIONS = {
    "braking": ("procedure", "procedures"),
    "handling": ("manoeuvre", "manoeuvres"),
    "wheel-rail": ("case", "cases"),
}
"""For each system with several manoeuvres in a scene, the option of ``run`` that selects one, and the scene's table of
them."""


def load(scene: AnyScene, set: Changes = None) -> "Scene":
    """Read and check a scene of any system; nothing is run.

    set : values by dotted keys that replace those of the scene; None as a value takes a key out. Files that a table
    names are looked for in the current folder. Raises InputError that names place, value and what is allowed.
    """
    from models.core.scene_file import parse_toml
    from studies.command.asked import scene_path
    from twinrig.scene import Scene, of_table

    if isinstance(scene, Scene):
        return scene.with_(set) if set else scene
    if isinstance(scene, Mapping):
        return of_table(scene, "table", Path(), set or {})
    if not isinstance(scene, str | Path):
        raise InputError("", "scene", None, f"must be a name, a file, a table or a scene, not {type(scene).__name__}")
    if str(scene).endswith(".nc"):
        raise InputError(scene, "", None, "is no scene; twinrig.read reads a saved result")
    path = scene_path(str(scene))
    return of_table(parse_toml(path), path.name, path.parent, set or {})


def run(scene: AnyScene, engine: str = "", *, set: Changes = None, error: bool = True, **how: Any) -> "Result":
    """Run a scene in one engine and save nothing. Without a named engine, the system's usual one runs the scene.

    set : as in ``load``; error : whether the error of steps or cells is estimated, by further runs, which cost about
    half as much as the run; how : what the system's run takes besides, such as ``procedure`` of braking, ``manoeuvre``
    of handling, ``case`` of wheel and rail, or ``speed`` (m/s) of a wheelset. Raises InputError before anything is run,
    RunFailed where there is no answer. What is unlikely of the input, such as a mass in tonnes, stands in the result.
    """
    from models.core.finding import findings_as_dicts, merged_findings
    from models.systems import run as run_system
    from studies.command.asked import input_findings_of, plan_module_of
    from studies.command.waiting import progress_bar
    from twinrig.result import Result

    loaded = load(scene, set).checked
    options = _run_parameters(loaded)
    _check_run_options(loaded, how, options)
    chosen, checked = _engines(loaded, engine, options["engine"].default == "")
    with _library_messages(loaded):
        plan_module_of(loaded).check(loaded, checked)
        doubtful = findings_as_dicts(merged_findings(input_findings_of(loaded)))
        with progress_bar(f"{loaded.title}: {chosen or loaded.system}", loaded.system):
            answer = run_system(loaded, chosen, error=error, **how)
    answer.data.attrs["queries"] = json.dumps(doubtful)
    return Result(answer.data, answer.detail)


def _run_parameters(scene: Any) -> Mapping[str, Any]:
    """Parameters of the function that runs a scene of the system; raises InputError for a system without one."""
    from importlib import import_module

    from models.core.systems import SYSTEMS

    if scene.system not in SYSTEMS:
        raise InputError(
            scene.file, "system", scene.system, "is drawn by its study; use the command twinrig run", tuple(SYSTEMS)
        )
    return signature(import_module(f"{SYSTEMS[scene.system].package}.run").run).parameters


def _check_run_options(scene: Any, run_options: Mapping[str, Any], options: Mapping[str, Any]) -> None:
    """Raise InputError for options that the system's run does not have, and for manoeuvres that the scene does not
    have."""
    names = (*(name for name in options if name not in ("scene", "engine", "error")), "engine", "error", "set")
    for name in run_options:
        if name not in names:
            raise InputError("run", name, None, f"is no option of a run of {scene.system}", names)
    option, table = MANOEUVRE_OPTIONS.get(scene.system, ("", ""))
    if run_options.get(option) is not None and run_options[option] not in getattr(scene, table):
        raise InputError(scene.file, option, run_options[option], f"is not among {table}", tuple(getattr(scene, table)))


def _engines(scene: Any, requested_engine: str, optional: bool) -> tuple[str, tuple[str, ...]]:
    """The engine of a run ("" if the system chooses it), and the engines for which the scene is checked."""
    from studies.command.asked import requested_engines

    named = requested_engine or getattr(getattr(scene, "run", None), "engine", None) or None
    engines = requested_engines(named, scene.system, "engine")
    if requested_engine and len(engines) != 1:
        allowed = "a result is of one engine: run each, and lay two beside each other with twinrig.compare"
        raise InputError("engine", "", requested_engine, allowed, engines)
    if len(engines) == 1:
        return engines[0], engines
    if optional or not engines:
        return "", engines
    usual = "reference" if "reference" in engines else engines[0]
    return usual, (usual,)


@contextmanager
def _library_messages(scene: Any = None, **names: str) -> "Iterator[None]":
    """Context in which error messages name the argument of the library's function in place of the command line's
    option. ``names`` maps options to arguments; an option that is not in it keeps its name.

    What is unlikely about the vehicle of a scene that is refused is a note of the error: it may be the cause.
    """
    from studies.command.asked import doubt_lines

    try:
        yield
    except InputError as error:
        if error.file.startswith("--"):
            option = error.file.lstrip("-")
            renamed = InputError(names.get(option, option), error.place, error.value, error.allowed, error.choices)
            raise renamed from None
        for line in doubt_lines(scene) if scene is not None else ():
            error.add_note(line)
        raise


def read(path: str | Path) -> "Result":
    """Read a result that ``Result.save`` or the command line has saved; raises InputError for another file."""
    from models.core.result import load_result
    from twinrig.result import Result

    return Result(load_result(Path(path)).data)


def compare(first: "Result | str | Path", second: "Result | str | Path", shift: float | None = None) -> "Report":
    """Lay two results of the same kind beside each other, or a measurement over a result.

    Each is a result or the file of a saved result; ``second`` may be the file of a measurement, whose channels have the
    names of the run's with units in brackets, as ``f1 [kN]``. The detail of two results is a list of
    ``QuantityDifference``, those that differ most first: ``second`` less ``first``, with the place where it is largest
    and whether it lies within the errors that both state. That of a measurement is a ``MeasurementOverlay``: the time
    shift, and the error of every channel.

    shift : s, what the measurement's clock shows at the run's time 0; sought where None. Raises InputError for what has
    nothing in common.
    """
    from models.measured.file_kinds import is_measurement
    from studies.command.comparison import compare_runs, comparison_lines
    from twinrig.report import Report

    if isinstance(second, str | Path) and Path(second).suffix != ".nc" and is_measurement(Path(second)):
        from studies.command.against_measurement import overlay_of_run

        laid = overlay_of_run(_loaded_result(first), second, shift)
        values = {
            "shift": laid.shift.seconds,
            "channels": {compared.name: compared.errors_for_json() for compared in laid.matches},
        }
        return Report((f"{second} over {_result_name(first, 'the run')}", *laid.lines()), values, laid)
    if shift is not None:
        raise InputError("compare", "shift", shift, "belongs to a comparison of a run with a measurement")
    names = (_result_name(first, "the first"), _result_name(second, "the second"))
    differences, notes = compare_runs(_loaded_result(first), _loaded_result(second), names)
    values = {
        compared.name: {key: getattr(compared, key) for key in ("largest", "rms", "at", "share")}
        for compared in differences
    }
    return Report((f"{names[1]} less {names[0]}", *comparison_lines(differences, notes)), values, differences)


def _loaded_result(run_or_path: Any) -> "Result":
    from models.core.result import Result as SavedResult

    if isinstance(run_or_path, SavedResult):
        return run_or_path  # type: ignore[return-value]
    if isinstance(run_or_path, str | Path) and Path(run_or_path).suffix == ".nc":
        return read(run_or_path)
    raise InputError(
        "compare", "", str(run_or_path), "is no result: give what twinrig.run returns, or a saved file (.nc)"
    )


def _result_name(run_or_path: Any, otherwise: str) -> str:
    if isinstance(run_or_path, str | Path):
        return str(run_or_path)
    engine = getattr(run_or_path, "data", None) is not None and run_or_path.data.attrs.get("engine")
    return f"{otherwise} ({engine})" if engine else otherwise


def price(
    scene: AnyScene,
    tolerance: float,
    quantity: "str | list[str] | None" = None,
    engine: str = "all",
    *,
    set: Changes = None,
) -> "Report":
    """Find the cheapest engine, integrator and step that hold a quantity of a scene to a tolerance, by runs.

    tolerance : largest error that is allowed, in the quantity's unit; quantity : channels, as "f1,f2" or a list, if
    not the usual one of the system; engine : one, or all. The detail is the ``Recommendation``. Raises InputError for
    scenes that have no steps to choose, RunFailed where nothing is known.
    """
    from models.advice.price.recommendation import price as recommended
    from models.advice.price.text import as_dict, recommendation_lines
    from studies.command.asked import requested_engines
    from studies.command.waiting import progress_bar
    from twinrig.report import Report

    loaded = load(scene, set).checked
    with _library_messages(loaded):
        engines = requested_engines(engine, loaded.system, "engine")
        with progress_bar("runs of every engine in ever finer steps", loaded.system):
            answer = recommended(loaded, tolerance, _channels_in_words(quantity), engines)
    return Report(tuple(recommendation_lines(answer)), as_dict(answer), answer)


def _channels_in_words(quantity: "str | list[str] | None") -> str | None:
    """Names of channels as one text, separated by commas, as the command line takes them."""
    if quantity is None or isinstance(quantity, str):
        return quantity
    if not isinstance(quantity, list | tuple) or not all(isinstance(name, str) for name in quantity):
        raise InputError("quantity", "", quantity, "must be a name, or a list of names")
    return ",".join(quantity)


def choose(
    scene: AnyScene,
    quantities: "list[str] | None" = None,
    tolerance: float | None = None,
    engine: str = "all",
    *,
    set: Changes = None,
    folder: str | Path | None = None,
) -> "Report":
    """Choose the effects of a scene that its quantities call for within a relative tolerance, by runs.

    quantities, tolerance : those of the scene where None; a scene of another study needs both. folder : new or empty,
    where figures, tables and the reduced scene are kept; else they are dropped. The values are those of ``twinrig run
    --json``. Raises InputError.
    """
    from tempfile import TemporaryDirectory

    from models.core.told import summary_with_errors
    from studies.command.asked import checked_study, requested_engines
    from studies.command.waiting import progress_bar
    from twinrig.report import Report

    loaded = _scene_for_choice(load(scene, set), quantities, tolerance).checked
    engines = requested_engines(engine, loaded.system, "engine")
    with _library_messages(loaded), TemporaryDirectory() as temporary:
        study = checked_study(loaded, engines)
        result_folder = _new_folder(folder, "choice") if folder is not None else Path(temporary)
        with progress_bar(loaded.title, loaded.system) as progress:
            summary = summary_with_errors(study.run(loaded, engines, result_folder, progress))
    return Report((loaded.title, *summary["table"]), summary)


def _scene_for_choice(scene: "Scene", quantities: "list[str] | None", tolerance: float | None) -> "Scene":
    """The scene with the study that chooses effects, and with the given quantities and tolerance."""
    choice_keys = {"quantities": quantities, "tolerance": tolerance}
    changes: dict[str, Any] = {key: value for key, value in choice_keys.items() if value is not None}
    study = scene.checked.CHOOSING
    if scene.checked.study != study:
        for key, value in choice_keys.items():
            if value is None:
                raise InputError("choose", key, None, "is missing: this scene asks for no choice, so give both")
        changes |= {"study": study, **({"options": None} if "options" in scene.table else {})}
    return scene.with_(changes) if changes else scene


def export(scene: AnyScene, engine: str, file: str | Path | None = None, *, set: Changes = None) -> "Report":
    """Write the native part of a scene's vehicle as a file of an engine that opens without twinrig.

    engine : "mujoco" for an MJCF, "exudyn" for a script in Python; file : SCENE_ENGINE.xml or .py in the current folder
    if None. The values name the file, what it has and what is left out: forces that are functions of twinrig. Raises
    InputError for a scene without a vehicle that an engine builds, and for a file that is there already.
    """
    from studies.command.export import export as write
    from studies.command.export import export_lines
    from studies.command.waiting import progress_bar
    from twinrig.report import Report

    loaded = load(scene, set).checked
    with _library_messages(loaded, out="file"), progress_bar("building the vehicle", loaded.system):
        exported = write(loaded, engine, None if file is None else Path(file))
    return Report(tuple(export_lines(loaded.title, exported)), exported)


def validate(quick: bool = False, folder: str | Path | None = None) -> "Report":
    """Run the validation cases and write the report into a folder, a new one in ``results`` if none is named.

    quick : the named short subset, about a minute. The values are those of ``results.json``; the detail is the number
    of failed rows. Cases run in processes of their own: a script calls it below ``if __name__ == "__main__":``.
    """
    from twinrig.report import Report
    from validation.run import validate as run_all

    report_folder = _new_folder(folder, "validate-quick" if quick else "validate")
    with redirect_stdout(io.StringIO()) as printed:
        failed = run_all(report_folder, quick, f"twinrig.validate(quick={quick})")
    values = json.loads((report_folder / "results.json").read_text(encoding="utf-8"))
    return Report(tuple(printed.getvalue().splitlines()), {"folder": str(report_folder), "results": values}, failed)


def _new_folder(requested_folder: str | Path | None, name: str) -> Path:
    from models.core.result_folders import new_folder

    with _library_messages(out="folder"):
        return new_folder(None if requested_folder is None else Path(requested_folder), name)
