"""The command ``twinrig``: list, show, run, validate."""

import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from typer.exceptions import TyperException

SCENES = Path(__file__).parent / "scenes"

MEASURED = (".csv", ".txt", ".mf4", ".mdf", ".dat", ".rsp", ".tdms")
"""Files that ``show`` takes for measurements."""

app = typer.Typer(
    add_completion=False, pretty_exceptions_enable=False,
    help="Ground vehicles built in Exudyn, in MuJoCo and by hand, held to closed forms and to one another.",
)  # fmt: skip

SceneName = Annotated[str, typer.Argument(help="A scene file, or the name of one from `twinrig list`.")]
Changes = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Change a key, e.g. run.step=5e-4; repeatable.")
]
Out = Annotated[Path | None, typer.Option(help="Folder for the results; it must be new or empty.")]
Resume = Annotated[
    Path | None, typer.Option(help="Folder of a killed run that keeps finished blocks (ensemble): go on with it.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print the summary as JSON and nothing else.")]


def main() -> None:
    """Run the command; a user's mistake is one message and exit code 2, a failed run exit code 1."""
    from models.errors import InputError, RunFailed

    try:
        sys.exit(app(sys.argv[1:] or ["--help"], standalone_mode=False) or 0)
    except TyperException as error:  # what was typed does not fit the command's options
        command = getattr(getattr(error, "ctx", None), "command_path", "twinrig")
        _end(f"{error.format_message().rstrip('.')}; see `{command} --help`", 2)
    except InputError as error:
        _end(str(error), 2)
    except RunFailed as error:
        _end(f"the run failed: {error}", 1)
    except MemoryError:
        _end("the run failed: it does not fit into the memory of this machine; use a longer step or shorten it", 1)
    except OSError as error:
        _end(f"the results could not be written: {error}", 1)


def _end(message: str, code: int) -> NoReturn:
    print(f"twinrig: {message}", file=sys.stderr)
    sys.exit(code)


@app.command("list")
def list_scenes() -> None:
    """List the scenes that come with twinrig, the effects, the parameter sets and the engines."""
    from models.engines.catalogue import CATALOGUE
    from models.scene import effect_names, parameter_sets
    from models.scene_file import parse

    scenes = {path.stem: parse(path)["title"] for path in sorted(SCENES.glob("*.toml"))}
    effects = {name: _first_sentence(f"models.effects.{name}") for name in effect_names()}
    sets = {name: import_module(f"models.parameters.{name}").SOURCE for name in parameter_sets()}
    _print_list("scenes (twinrig run NAME, or a file of your own)", scenes)
    _print_list("effects ([effects.NAME] in a scene; one that is not named is not computed)", effects)
    _print_list("parameter sets (vehicle.parameters = NAME, or a TOML file of your own)", sets)
    _print_list("engines and their integrators (--engine NAME; [engines.NAME] integrator = ...)",
                {name: ", ".join(integrators) for name, integrators in CATALOGUE.items()})


def _first_sentence(module: str) -> str:
    return (import_module(module).__doc__ or "").partition("\n")[0].rstrip(".")


def _print_list(title: str, entries: dict[str, str]) -> None:
    width = max(map(len, entries))
    print(title)
    for name, text in entries.items():
        print(f"  {name:<{width}} {text}")


@app.command()
def show(scene: SceneName, changes: Changes = None) -> None:
    """Print what a scene will compute, without running it, or what is in a measurement file, with a scene for it."""
    if Path(scene).suffix.lower() in MEASURED:
        from models.measured.listing import describe

        return print(describe(Path(scene)))
    loaded = _load(scene, changes)
    print(_plan(loaded).describe(loaded))


@app.command()
def run(
    scene: SceneName,
    engine: Annotated[str | None, typer.Option(help="exudyn, mujoco, reference or all (which is the default)")] = None,
    out: Out = None,
    resume: Resume = None,
    changes: Changes = None,
    as_json: AsJson = False,
) -> None:
    """Run a scene and save its results and figures."""
    loaded = _load(scene, changes)
    engine = engine or getattr(getattr(loaded, "run", None), "engine", None)
    _finish(loaded, _engines(engine, loaded.system), out, resume, as_json)


@app.command()
def validate(
    quick: Annotated[bool, typer.Option("--quick", help="The named short subset, in about a minute.")] = False,
    out: Out = None,
) -> None:
    """Run the validation cases and write report.html, results.json and results.csv."""
    from studies.folders import new_folder
    from validation.run import validate as run_all

    folder = new_folder(out, "validate-quick" if quick else "validate")
    failed = run_all(folder, quick, " ".join(["twinrig", *sys.argv[1:]]))
    sys.exit(1 if failed else 0)


def _load(name: str, changes: list[str] | None) -> Any:
    """A scene that comes with twinrig by its name, or a file; a file's name ends in .toml."""
    from models.errors import InputError
    from models.systems import load

    names = tuple(sorted(path.stem for path in SCENES.glob("*.toml")))
    if name in names:
        return load(SCENES / f"{name}.toml", changes or ())
    if not name.endswith(".toml") and not os.path.lexists(name):
        raise InputError("", "scene", name, "no such scene, and no such file", names)
    return load(Path(name), changes or ())


def _plan(scene: Any) -> Any:
    """The module that describes and checks scenes of this one's system."""
    from models.systems import SYSTEMS

    return import_module(SYSTEMS[scene.system].plan)


def _engines(name: str | None, system: str) -> tuple[str, ...]:
    """The engines that were asked for; none for a system that no engine computes."""
    from models.errors import InputError
    from models.systems import SYSTEMS

    engines = SYSTEMS[system].engines
    if name is not None and not engines:
        raise InputError("--engine", "", name, f"has no meaning for {system}, which no engine computes: leave it out")
    if name is None or name == "all":
        return engines
    if name not in engines:
        raise InputError("--engine", "", name, "no such engine", (*engines, "all"))
    return (name,)


def _finish(scene: Any, engines: tuple[str, ...], out: Path | None, resume: Path | None, as_json: bool) -> None:
    """Check everything, then run the scene's study with a progress bar and print its summary."""
    from studies.folders import drop_if_empty

    module = _study(scene)
    _plan(scene).check(scene, engines)
    if hasattr(module, "check"):
        module.check(scene, engines)
    folder = _folder(module, scene, out, resume)
    try:
        with _progress(as_json) as progress:
            summary = module.run(scene, engines, folder, progress)
    except KeyboardInterrupt:
        _end(f"interrupted; finished results are kept in {folder}", 130)
    finally:
        drop_if_empty(folder)
    if as_json:
        print(json.dumps(summary, indent=1))
    else:
        _print(summary)
    if summary.get("failed"):
        sys.exit(1)


def _folder(module: Any, scene: Any, out: Path | None, resume: Path | None) -> Path:
    """Where the results go: a new folder, or that of a killed run whose study keeps finished blocks."""
    from models.errors import InputError
    from studies.folders import new_folder, resumed_folder

    if resume is None:
        return new_folder(out, Path(scene.file).stem)
    if out is not None:
        raise InputError("--resume", "", str(resume), "goes on in its own folder: leave out --out")
    if not hasattr(module, "BLOCKS"):
        raise InputError("--resume", "", str(resume), f"the study {scene.study!r} keeps nothing that can be resumed")
    return resumed_folder(resume, module.BLOCKS)


def _study(scene: Any) -> Any:
    """The study's module, once the scene's options are known to be its own."""
    from models.errors import InputError
    from models.strict import read
    from models.systems import DEFAULT

    names = tuple(sorted(path.stem for path in SCENES.parent.glob("*.py") if path.stem not in NOT_STUDIES))
    if scene.study not in names:
        raise InputError(scene.file, "study", scene.study, "no such study", names)
    module = import_module(f"studies.{scene.study}")
    own = getattr(module, "SYSTEM", DEFAULT)
    if own != scene.system:
        allowed = f"is a study of system {own!r}; this scene's system is {scene.system!r}"
        raise InputError(scene.file, "study", scene.study, allowed)
    if hasattr(module, "Options"):
        read(module.Options, scene.options, scene.file, "options")
    elif scene.options:
        place, value = next(iter(scene.options.items()))
        raise InputError(scene.file, f"options.{place}", value, f"the study {scene.study!r} takes no options")
    return module


NOT_STUDIES = ("__init__", "braking_figures", "command_line", "contact_figures", "figures", "folders",
               "handling_figures", "hub_forces_figures", "manchester_figure", "recording_figures", "recording_page",
               "recording_runs", "ride_figures", "ride_nonlinear_figures", "stabiliser_figures", "tyre_figure",
               "virtual_measurement", "wheelset_figures")  # fmt: skip


@contextmanager
def _progress(silent: bool) -> Iterator[Any]:
    """A progress bar on the terminal; silent where nobody looks."""
    if silent or not sys.stderr.isatty():
        yield lambda text, part: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0)
        yield lambda text, part: bar.update(task, description=text, completed=part)


def _print(summary: dict[str, Any]) -> None:
    """Summary as a person reads it."""
    print(summary["scene"])
    for engine, line in summary.get("runs", {}).items():
        steps, calls = line["counts"].get("steps", 0), line["counts"].get("force calls", 0)
        print(f"  {engine:<10} {line['integrator']:<17} step {line['step']:g} s  {steps} steps, "
              f"{calls} force calls, {line['seconds']:.3f} s")
    for engine, reason in summary.get("failed", {}).items():
        print(f"  {engine:<10} FAILED: {reason}")
    for pair, gap in summary.get("largest difference of states", {}).items():
        print(f"  {pair}: states differ by at most {gap:.1e}")
    for line in summary.get("table", []):
        print(line)
    kept = Path(summary["folder"]).exists()
    print(f"  results in {summary['folder']}" if kept else "  nothing was saved")


def study(scene: str) -> None:
    """What ``python studies/NAME.py`` does: ``twinrig run`` on that study's scene, with the same options."""
    sys.argv = [sys.argv[0], "run", scene, *sys.argv[1:]]
    main()


if __name__ == "__main__":
    main()
