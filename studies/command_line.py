"""The command ``twinrig``: list, show, run, validate."""

import json
import sys
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer

SCENES = Path(__file__).parent / "scenes"
ENGINES = ("reference", "exudyn", "mujoco")

app = typer.Typer(
    add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False,
    help="Ground vehicles built in Exudyn, in MuJoCo and by hand, held to closed forms and to one another.",
)  # fmt: skip

SceneName = Annotated[str, typer.Argument(help="A scene file, or the name of one from `twinrig list`.")]
Changes = Annotated[list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Change a key, e.g. run.step=5e-4.")]
Out = Annotated[Path | None, typer.Option(help="Folder for the results; it must be new or empty.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the summary as JSON and nothing else.")]


def main() -> None:
    """Run the command; a user's mistake is one message and exit code 2, a failed run exit code 1."""
    from models.errors import InputError, RunFailed

    try:
        app()
    except InputError as error:
        print(f"twinrig: {error}", file=sys.stderr)
        sys.exit(2)
    except RunFailed as error:
        print(f"twinrig: the run failed: {error}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        print("twinrig: interrupted; finished results are kept", file=sys.stderr)
        sys.exit(130)


@app.command("list")
def list_scenes() -> None:
    """List the scenes that come with twinrig, the effects, the parameter sets and the engines."""
    from models.engines.catalogue import CATALOGUE
    from models.scene import _names, effect_names, load

    print("scenes (twinrig run NAME, or a file of your own)")
    for path in sorted(SCENES.glob("*.toml")):
        print(f"  {path.stem:<22} {load(path).title}")
    print("effects     " + ", ".join(effect_names()))
    print("parameters  " + ", ".join(_names("parameters")))
    for engine, integrators in CATALOGUE.items():
        print(f"{engine:<11} {', '.join(integrators)}")


@app.command()
def show(scene: SceneName, changes: Changes = None) -> None:
    """Print what a scene will compute, per engine, without running it."""
    from models.plan import describe

    print(describe(_load(scene, changes)))


@app.command()
def run(
    scene: SceneName,
    engine: Annotated[str, typer.Option(help="exudyn, mujoco, reference or all")] = "all",
    out: Out = None,
    changes: Changes = None,
    as_json: AsJson = False,
) -> None:
    """Run a scene and save its results and figures."""
    loaded = _load(scene, changes)
    _finish(loaded, _engines(engine), out, as_json)


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
    """A built-in scene by its name, or a file."""
    from models.errors import InputError
    from models.scene import load

    builtin = SCENES / f"{name}.toml"
    path = builtin if builtin.exists() else Path(name)
    if not path.exists() and path.suffix != ".toml":
        raise InputError("", "scene", name, "no such scene", tuple(p.stem for p in SCENES.glob("*.toml")))
    return load(path, changes or ())


def _engines(name: str) -> tuple[str, ...]:
    from models.errors import InputError

    if name == "all":
        return ENGINES
    if name not in ENGINES:
        raise InputError("--engine", "", name, "no such engine", (*ENGINES, "all"))
    return (name,)


def _finish(scene: Any, engines: tuple[str, ...], out: Path | None, as_json: bool) -> None:
    """Check everything, then run the scene's study with a progress bar and print its summary."""
    from models.plan import check
    from studies.folders import new_folder

    module = _study(scene)
    check(scene, engines)
    folder = new_folder(out, Path(scene.file).stem)
    with _progress(as_json) as progress:
        summary = module.run(scene, engines, folder, progress)
    if as_json:
        print(json.dumps(summary, indent=1))
    else:
        _print(summary)
    if summary.get("failed"):
        sys.exit(1)


def _study(scene: Any) -> Any:
    from models.errors import InputError

    names = tuple(sorted(path.stem for path in SCENES.parent.glob("*.py") if path.stem not in NOT_STUDIES))
    if scene.study not in names:
        raise InputError(scene.file, "study", scene.study, "no such study", names)
    return import_module(f"studies.{scene.study}")


NOT_STUDIES = ("__init__", "command_line", "figures", "folders")


class _progress:  # noqa: N801 - used like a function
    """A progress bar on the terminal; silent where nobody looks."""

    def __init__(self, silent: bool) -> None:
        self.silent = silent

    def __enter__(self) -> Any:
        if self.silent or not sys.stderr.isatty():
            return lambda text, part: None
        from rich.console import Console
        from rich.progress import Progress

        self.bar = Progress(console=Console(stderr=True), transient=True)
        self.bar.__enter__()
        task = self.bar.add_task("", total=1.0)
        return lambda text, part: self.bar.update(task, description=text, completed=part)

    def __exit__(self, *error: object) -> None:
        if hasattr(self, "bar"):
            self.bar.__exit__(*error)


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
    print(f"  results in {summary['folder']}")


def study(scene: str) -> None:
    """What ``python studies/NAME.py`` does: ``twinrig run`` on that study's scene, with the same options."""
    sys.argv = [sys.argv[0], "run", scene, *sys.argv[1:]]
    main()


if __name__ == "__main__":
    main()
