"""Arguments and options that several commands share: types, names and help texts."""

from pathlib import Path
from typing import Annotated

import typer

SceneName = Annotated[str, typer.Argument(help="A scene file, or the name of one from `twinrig list`.")]
SetOption = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Change a key, e.g. run.step=5e-4; repeatable.")
]
OutOption = Annotated[Path | None, typer.Option(help="Folder for the results; it must be new or empty.")]
ResumeOption = Annotated[
    Path | None, typer.Option(help="Folder of a killed sweep, ensemble, recording or report: go on with what it kept.")
]
SweepOption = Annotated[
    str | None,
    typer.Option(metavar="KEY=FROM:TO:N", help="Run the scene at N values of a key, or at those of KEY=a,b,c."),
]
NoErrorOption = Annotated[bool, typer.Option("--no-error", help="Do not estimate the error of steps or cells.")]
StrictOption = Annotated[bool, typer.Option("--strict", help="End with code 1 where an assumption is broken.")]
ProfileOption = Annotated[bool, typer.Option("--profile", help="Tell where the time goes: imports, kernels, marches.")]
WorkersOption = Annotated[
    int | None,
    typer.Option(min=1, max=256, help="Processes for what repeats; no result depends on their number (default: 2)."),
]
ClusterOption = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="A Dask scheduler whose workers compute instead, as tcp://host:8786."),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the summary as JSON and nothing else.")]
