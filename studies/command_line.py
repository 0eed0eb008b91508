"""The command ``twinrig``: list, show, run, price, compare, identify, export, validate."""

import io
import json
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.exceptions import TyperException

from models.core.errors import InputError, RunFailed
from models.core.result_folders import check_unused
from models.core.whole_files import write_error_phrase
from models.machine.left_out import OF_LABELS, hide_libraries
from models.measured.file_kinds import is_measurement
from studies.command.asked import (
    check_for_any_engine,
    checked_study,
    doubt_lines,
    input_findings_of,
    load_scene,
    plan_module_of,
    requested_engines,
    runs_without_extras,
)
from studies.command.audits import blind_spot_audit, conformity_report
from studies.command.crew import crew_changes_by_options
from studies.command.finishing import (
    exit_with_message,
    profiling_wrapper,
    results_folder_of,
    run_and_print_summary,
    unprinted_finding_lines,
)
from studies.command.options import (
    ClusterOption,
    JsonOption,
    NoErrorOption,
    OutOption,
    ProfileOption,
    ResumeOption,
    SceneName,
    SetOption,
    StrictOption,
    SweepOption,
    WorkersOption,
)
from studies.command.second_compiler import second_process_compiles
from studies.command.waiting import progress_bar

app = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Ground vehicles built in Exudyn, in MuJoCo and by hand, held to closed forms and to one another.",
)


def _print_version(is_requested: bool) -> None:
    """Print the version and end the process if the option ``--version`` is given."""
    if is_requested:
        from importlib.metadata import version

        print(f"twinrig {version('twinrig')}")
        raise typer.Exit()


@app.callback()
def handle_version_option(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and end.")
    ] = False,
) -> None:
    """Options that belong to no command."""


def main() -> None:
    """Run the command; a user's mistake is one message and exit code 2, a failed run exit code 1."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # how schedulers end a job: as Ctrl-C does
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # names of files may hold bytes that are no text
    try:
        sys.exit(app(sys.argv[1:] or ["--help"], standalone_mode=False) or 0)
    except TyperException as error:  # what was typed does not fit the command's options
        command = getattr(getattr(error, "ctx", None), "command_path", "twinrig")
        exit_with_message(f"{error.format_message().rstrip('.')}; see `{command} --help`", 2)
    except InputError as error:
        exit_with_message(str(error), 2)
    except RunFailed as error:
        exit_with_message(f"the run failed: {error}", 1)
    except MemoryError:
        exit_with_message(
            "the run failed: it does not fit into the memory of this machine; use a longer step or shorten it", 1
        )
    except OSError as error:
        exit_with_message(f"the results could not be written: {write_error_phrase(error)}", 1)


@app.command("list")
def list_scenes() -> None:
    """List the scenes that come with twinrig, the effects, the parameter sets and the engines."""
    from studies.command.listing import print_lists

    print_lists()


@app.command()
def show(
    scene: SceneName,
    price: Annotated[bool, typer.Option("--price", help="What each effect costs and changes, by short runs.")] = False,
    engine: Annotated[str | None, typer.Option(help="Of --price: one of exudyn, mujoco, reference.")] = None,
    changes: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Print what a scene will compute, without running it, or what is in a measurement file, with a scene for it."""
    if not price and (engine is not None or as_json):
        raise InputError("--engine" if engine else "--json", "", engine, "belongs to --price here: name it too")
    if is_measurement(Path(scene)):
        from models.systems.measured.listing import describe

        return print(describe(Path(scene)))
    loaded = load_scene(scene, changes)
    if not price:
        check_for_any_engine(
            loaded, requested_engines(getattr(getattr(loaded, "run", None), "engine", None), loaded.system)
        )
        plan = plan_module_of(loaded).describe(loaded)
        return print(
            "\n".join([plan, *unprinted_finding_lines(input_findings_of(loaded), plan), *_search_lines(loaded)])
        )
    _announce_user_code(loaded)
    from models.advice.price.effects import price_list
    from models.advice.price.effects_text import as_dict
    from models.advice.price.effects_text import price_list_lines as price_lines

    with progress_bar("short runs with and without each effect", loaded.system):
        prices = price_list(loaded, None if engine is None else requested_engines(engine, loaded.system)[0])
    print(json.dumps(as_dict(prices), indent=1) if as_json else "\n".join(price_lines(prices, loaded.quantities)))


def _announce_user_code(scene: Any) -> None:
    """Print on stderr that code of the user is about to run many times, if the scene has any."""
    code = getattr(plan_module_of(scene), "user_code", lambda scene: "")(scene)
    if code:
        print(f"twinrig: this runs your own code, many times: [port] {code}", file=sys.stderr, flush=True)


def _search_lines(scene: Any) -> list[str]:
    """Lines for the screen on the number of runs that a choice of effects may take, if the scene asks for a choice."""
    from studies.choice import search_effort_text

    return [] if scene.tolerance is None else [search_effort_text(scene)]


@app.command("run")
def run_scene(
    scene: SceneName,
    engine: Annotated[str | None, typer.Option(help="exudyn, mujoco, reference or all (which is the default)")] = None,
    out: OutOption = None,
    resume: ResumeOption = None,
    sweep: SweepOption = None,
    workers: WorkersOption = None,
    cluster: ClusterOption = None,
    changes: SetOption = None,
    no_error: NoErrorOption = False,
    strict: StrictOption = False,
    profile: ProfileOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run a scene and save its results and figures."""
    telling = profiling_wrapper(profile)
    if out is not None:
        check_unused(out)  # before kernels are compiled
    if sweep is not None:
        from studies.command.crew import crew_of
        from studies.command.sweep import RECORDS_FOLDER, sweep_points
        from studies.command.sweep import run as run_points

        job = sweep_points(sweep, scene, changes or (), engine, not no_error)
        crew = crew_of(job.check(), workers, cluster)
        folder = results_folder_of(f"{Path(scene).stem}-sweep", RECORDS_FOLDER, "", out, resume)
        work = partial(run_points, replace(job, output_folder=folder), worker_crew=crew)
        return run_and_print_summary(telling(work), folder, as_json, is_strict=strict)
    loaded = load_scene(scene, changes)
    loaded = loaded.model_copy(
        update={"error": loaded.error and not no_error, **crew_changes_by_options(workers, cluster)}
    )
    engines = requested_engines(engine or getattr(getattr(loaded, "run", None), "engine", None), loaded.system)
    with _doubts_printed_on_refusal(loaded), second_process_compiles(scene, changes or [], loaded, engines):
        with progress_bar("checking the scene", loaded.system):
            module = checked_study(loaded, engines)
        if runs_without_extras(loaded, engines, module):
            hide_libraries(*OF_LABELS)
        folder = results_folder_of(
            Path(loaded.file).stem, getattr(module, "BLOCKS_FOLDER", None), loaded.study, out, resume
        )
        doubts = input_findings_of(loaded)
        work = partial(module.run, loaded, engines, folder)
        run_and_print_summary(telling(work), folder, as_json, doubts, strict, loaded.system)


@contextmanager
def _doubts_printed_on_refusal(scene: Any) -> Iterator[None]:
    """Context that prints doubtful values of a scene's vehicle and channels if the scene is refused, as a possible
    cause."""
    try:
        yield
    except InputError:
        for line in doubt_lines(scene):
            print(line, file=sys.stderr)
        raise


@app.command()
def price(
    scene: SceneName,
    tolerance: Annotated[float, typer.Option(help="Largest error that is allowed, in the unit of the quantity.")],
    quantity: Annotated[str | None, typer.Option(help="Channels of the result, e.g. f1,f2, if not the usual.")] = None,
    engine: Annotated[str | None, typer.Option(help="exudyn, mujoco, reference or all (which is the default)")] = None,
    workers: WorkersOption = None,
    cluster: ClusterOption = None,
    changes: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Find the cheapest engine, integrator and step that hold a scene's quantity to a tolerance.

    What is timed runs in this process alone; workers compute the rest.
    """
    from models.advice.price.recommendation import price as price_of
    from models.advice.price.text import as_dict
    from models.advice.price.text import recommendation_lines as price_lines

    loaded = load_scene(scene, changes).model_copy(update=crew_changes_by_options(workers, cluster))
    _announce_user_code(loaded)
    with progress_bar("runs of every engine in ever finer steps", loaded.system):
        priced = price_of(loaded, tolerance, quantity, requested_engines(engine, loaded.system))
    print(json.dumps(as_dict(priced), indent=1) if as_json else "\n".join(price_lines(priced)))
    if not priced.winners:
        sys.exit(1)


@app.command()
def compare(
    first: Annotated[Path, typer.Argument(help="A folder of results, or one file of it.")],
    second: Annotated[Path, typer.Argument(help="Another one of the same study, or a measurement (.csv, .mf4, ...).")],
    out: OutOption = None,
    shift: Annotated[
        float | None,
        typer.Option(help="Of a measurement: s that its clock shows at the run's start, if it is not to be sought."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compare two results quantity by quantity, or lay a measurement over a run.

    Two results: largest and rms difference of each quantity, and where. A measurement: its channels are those of the
    run by their names, with units in brackets, as f1 [kN]; units are converted, the time shift is found, and each
    channel has its rms error, also by the standard deviation of the measurement, and its peak error.
    """
    from studies.command import against_measurement as measured
    from studies.command.comparison import compare as differences
    from studies.command.comparison import report

    if measured.is_run_against_measurement(first, second):
        for run in measured.saved_results(first).values():
            measured.overlay_of_run(run, second, shift)  # before a folder is made
        folder = results_folder_of("compare", None, "", out, None)
        return run_and_print_summary(lambda progress: measured.report(first, second, folder, shift), folder, as_json)
    if shift is not None:
        raise InputError("--shift", "", shift, "belongs to a comparison of a run with a measurement")
    differences(first, second)  # before a folder is made
    folder = results_folder_of("compare", None, "", out, None)
    run_and_print_summary(lambda progress: report(first, second, folder), folder, as_json)


@app.command()
def identify(
    scene: SceneName,
    measurement: Annotated[
        Path, typer.Option("--from", help="Measurement (.csv, .mf4, ...) with channels of the run.")
    ],
    parameters: Annotated[str, typer.Option(help="Keys of the scene: a,b=LOW:HIGH,c.")],
    engine: Annotated[str | None, typer.Option(help="One of exudyn, mujoco, reference.")] = None,
    low_pass: Annotated[float, typer.Option(help="Hz, of run and measurement alike, without phase; 0 for none.")] = 0.0,
    profiles: Annotated[bool, typer.Option("--profiles", help="Profile likelihood of every parameter.")] = False,
    workers: WorkersOption = None,
    cluster: ClusterOption = None,
    out: OutOption = None,
    resume: ResumeOption = None,
    changes: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Identify numbers of a scene from a measurement, with standard errors, and say what it does not determine."""
    from studies.command.identify import STAGES_FOLDER, report

    loaded, keys = load_scene(scene, changes), [key.strip() for key in parameters.split(",") if key.strip()]
    if not keys:
        raise InputError("--parameters", "", parameters, "must name keys of the scene, as front.friction,rear.friction")
    loaded = loaded.model_copy(update=crew_changes_by_options(workers, cluster))
    engines = requested_engines(engine, loaded.system)
    checked_study(loaded, engines)
    if not measurement.is_file():
        raise InputError(measurement, "--from", None, "no such file")
    folder = results_folder_of(f"{Path(loaded.file).stem}-identify", STAGES_FOLDER, "", out, resume)
    usual = engines[0] if engines else ""

    def computed(report_progress: Callable[[str, float], None]) -> dict[str, Any]:
        return report(loaded, measurement, keys, folder, report_progress, profiles, engine=usual, low_pass=low_pass)

    run_and_print_summary(computed, folder, as_json, (), False, loaded.system)


@app.command()
def export(
    scene: SceneName,
    engine: Annotated[str, typer.Option(help="mujoco, for an MJCF file, or exudyn, for a script in Python.")],
    out: Annotated[Path | None, typer.Option(help="The file to write; SCENE_ENGINE.xml or .py here if none.")] = None,
    changes: SetOption = None,
) -> None:
    """Write the vehicle of a scene as a file of an engine that opens without twinrig.

    It has what the engine has as its own: bodies, joints, weights, springs and dampers. Forces that are functions of
    twinrig, such as tyres, stay behind; the file and the terminal name each of them.
    """
    from studies.command.export import export as write
    from studies.command.export import export_lines as written

    loaded = load_scene(scene, changes)
    with progress_bar("building the vehicle", loaded.system):
        told = write(loaded, engine, out)
    print("\n".join(written(loaded.title, told)))


@app.command()
def twin(
    files: Annotated[list[Path], typer.Argument(help="One model, MJCF or URDF, or two to be compared.")],
    without: Annotated[
        str, typer.Option(metavar="KINDS", help="Leave out what has no equal, e.g. contact,friction_loss.")
    ] = "",
    states: Annotated[int, typer.Option(help="Random states at which accelerations are compared.")] = 100,
    page: Annotated[Path | None, typer.Option(help="Write one HTML file with all of it there.")] = None,
    compare_paths: Annotated[bool, typer.Option("--paths/--no-paths", help="Compare paths over 1 s, too.")] = True,
    tolerance: Annotated[
        float | None, typer.Option(help="Find the engine, integrator and step that hold this error, rad or m.")
    ] = None,
    quantity: Annotated[str | None, typer.Option(help="Joint that the tolerance is of; all joints if none.")] = None,
    controls: Annotated[
        Path | None, typer.Option(help="CSV of the actuators' controls over time, for the paths; constant if none.")
    ] = None,
    output_folder: Annotated[
        Path | None, typer.Option(help="Folder from which includes, meshes and pictures may come; the model's if none.")
    ] = None,
) -> None:
    """Build a model of your own in every engine, and prove it equal or tell where it differs.

    The file as MuJoCo parsed it is held to the same model built in Exudyn, in MuJoCo and by plain equations, at random
    states. Of two files the elements that make them move differently are named. Ends with code 1 if anything differs.
    """
    from studies.command.twin import TwinOptions, check_arguments, examine, listed_content_kinds, twin_lines

    check_arguments(files, page)
    with progress_bar("building the model") as tell:
        twin_options = TwinOptions(states, compare_paths, tolerance, quantity, controls, output_folder)
        twins = examine(files, listed_content_kinds(without), twin_options, tell)
    print("\n".join(twin_lines(twins)))
    if page is not None:
        from studies.twin_page import write

        print(f"page: {write(twins, page)}")
    if not twins.alike:
        raise typer.Exit(1)


@app.command()
def validate(
    quick: Annotated[bool, typer.Option("--quick", help="The named short subset, in about a minute.")] = False,
    against: Annotated[
        Path | None, typer.Option(help="results.json of an earlier report: what changed is told first.")
    ] = None,
    engine: Annotated[
        str | None, typer.Option(metavar="MODULE:CLASS", help="Judge an engine or integrator of your own instead.")
    ] = None,
    blind_spots: Annotated[
        bool, typer.Option("--blind-spots", help="Which rows and tests notice each shared function 1 % off (hours).")
    ] = False,
    only: Annotated[
        str | None,
        typer.Option(metavar="PATTERN", help="Of --blind-spots: functions of this name alone, as 'models.tyre.*'."),
    ] = None,
    workers: WorkersOption = None,
    cluster: ClusterOption = None,
    out: OutOption = None,
    resume: ResumeOption = None,
) -> None:
    """Run the validation cases and write report.html, results.json and results.csv."""
    if only is not None and not blind_spots:
        raise InputError("--only", "", only, "goes with --blind-spots")
    crew = crew_changes_by_options(workers, cluster)
    if engine is not None:
        return conformity_report(engine, quick or blind_spots or against is not None or resume is not None, out)
    if blind_spots:
        return blind_spot_audit(quick or against is not None, only, out, resume)
    from models.ensemble.workers import Crew
    from validation.common.changes import read_results
    from validation.run import FINISHED_CASES
    from validation.run import validate as run_all

    earlier = None if against is None else read_results(against)
    folder = results_folder_of("validate-quick" if quick else "validate", FINISHED_CASES, "", out, resume)
    try:
        command = " ".join(["twinrig", *sys.argv[1:]])
        failed = run_all(folder, quick, command, earlier, resume is not None, Crew.given(**crew))
    except KeyboardInterrupt:
        exit_with_message(f"interrupted; finished cases are kept: twinrig validate --resume {folder}", 130)
    sys.exit(1 if failed else 0)


def run_study_as_script(scene: str) -> None:
    """Run a study's scene as ``python studies/NAME.py`` does: as ``twinrig run``, with the same options."""
    sys.argv = [sys.argv[0], "run", scene, *sys.argv[1:]]
    main()


if __name__ == "__main__":
    main()
