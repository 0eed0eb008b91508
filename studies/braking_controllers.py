"""Controllers of anti-lock brakes compared on several surfaces in all procedures, by distance and course."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.core.errors import RunFailed
from models.core.result import Channel, result
from models.core.strict import Strict, read
from models.core.whole_files import write_whole
from models.systems.braking.plan import check as check_scene
from models.systems.braking.plan import check_reference
from models.systems.braking.run import run as drive
from models.systems.braking.scene import BrakingScene, ControllerTable, RoadTable, Stretch
from models.systems.braking.stop_report import Stop

SYSTEM = "braking"
Progress = Callable[[str, float], None]
SHOWN = {
    "distance [m]": "stopping distance [m]",
    "v0^2/2d [m/s^2]": "v0^2/2d [m/s^2]",
    "y [m]": "y [m]",
    "yaw [deg]": "final yaw [deg]",
    "side slip [deg]": "largest side slip [deg]",
}


ESTIMATED = (
    "  true_speed = false: the speed is estimated from the wheels, which tell the vehicle's only when they "
    "come back to it; slip_pi holds them at a slip, and may lock them for seconds on ice"
)


class Options(Strict):
    """[options] of this study."""

    surfaces: dict[str, str] = Field(
        {"ice": "snow", "snow": "dry", "dry": "snow"},
        min_length=1,
        description="and what lies right of each in split procedures",
    )
    controllers: dict[str, ControllerTable] = Field(
        {kind: ControllerTable(kind=kind) for kind in ("slip_bang_bang", "acceleration_phases", "slip_pi")},
        min_length=1,
        description="tables as [controller], by their names",
    )


@dataclass(frozen=True)
class Case:
    """One run: names of surface, procedure and controller, and the scene of it alone."""

    surface: str
    procedure: str
    controller: str
    scene: BrakingScene


def cases(scene: BrakingScene) -> list[Case]:
    """All runs, surface by surface."""
    options = read(Options, scene.options, scene.file, "options")
    trains = [scene] if scene.trailer is None else [scene.model_copy(update={"trailer": None}), scene]
    return [
        Case(
            surface,
            name,
            controller + " + trailer" * (train.trailer is not None),
            _alone(train, surface, right, name, table),
        )
        for surface, right in options.surfaces.items()
        for name in scene.procedures
        for train in trains
        for controller, table in options.controllers.items()
    ]


def _alone(scene: BrakingScene, surface: str, right: str, name: str, controller: ControllerTable) -> BrakingScene:
    """The scene with one procedure on one surface under one controller."""
    procedure = scene.procedures[name]
    if procedure.kind == "split":
        procedure = procedure.model_copy(update={"right": right})
    return scene.model_copy(
        update={
            "road": RoadTable(stretches=[Stretch(left=surface)]),
            "controller": controller,
            "procedures": {name: procedure},
        }
    )


def check(scene: BrakingScene, engines: tuple[str, ...]) -> None:
    """Refuse what a controller or a surface cannot be."""
    check_reference(scene, engines)
    for case in cases(scene):
        check_scene(case.scene, ("reference",))


def run(scene: BrakingScene, engines: tuple[str, ...], folder: Path, progress: Progress) -> dict[str, Any]:
    """Drive all; saves ``controllers.nc``, ``controllers.csv`` and ``controllers.png``."""
    every, stops, failed = cases(scene), list[tuple[Case, dict[str, float]]](), dict[str, str]()
    for i, case in enumerate(every):
        progress(f"{case.surface}, {case.procedure}, {case.controller}", i / len(every))
        try:
            path = drive(case.scene).detail
        except RunFailed as error:
            failed[f"{case.surface}, {case.procedure}, {case.controller}"] = str(error)
            continue
        if not path.stands:
            failed[f"{case.surface}, {case.procedure}, {case.controller}"] = f"not stopped by {path.times[-1]:g} s"
            continue
        stop = Stop(path)
        values = stop.of_vehicle()
        stops.append(
            (case, {key: values[name] for key, name in SHOWN.items()} | {"locked [s]": float(stop.locks().time.max())})
        )
    _save(scene, stops, folder)
    _figure(scene, stops, folder / "controllers.png")
    answer = [
        {"surface": case.surface, "procedure": case.procedure, "controller": case.controller, **values}
        for case, values in stops
    ]
    return {"scene": scene.title, "folder": str(folder), "failed": failed, "answer": answer, "table": table(stops)}


def table(stops: list[tuple[Case, dict[str, float]]]) -> list[str]:
    """One line per run."""
    heads = [*SHOWN, "locked [s]"]
    lines = [f"  {'surface':<10}{'procedure':<12}{'controller':<32}" + "".join(f"{head:>17}" for head in heads)]
    for case, values in stops:
        name = case.procedure.replace("_", " ")
        lines.append(
            f"  {case.surface:<10}{name:<12}{case.controller:<32}" + "".join(f"{values[head]:>17.2f}" for head in heads)
        )
    lines += ["  locked: longest of the wheels, above 15 km/h"]
    return lines + [ESTIMATED] * any(not case.scene.controller.true_speed for case, _ in stops)


def _save(scene: BrakingScene, stops: list[tuple[Case, dict[str, float]]], folder: Path) -> None:
    """A stop per line, or along the axis of the result."""
    names, heads = ("surface", "procedure", "controller"), list(stops[0][1]) if stops else []
    cases = [[getattr(case, name) for name in names] for case, _ in stops]
    values = [[stop[head] for head in heads] for _, stop in stops]
    channels = {
        head.partition(" [")[0].replace("/", " by "): Channel("stop", np.array(column), head.partition(" [")[2][:-1])
        for head, column in zip(heads, zip(*values, strict=True), strict=True)
    }
    texts = {name: Channel("stop", list(column)) for name, column in zip(names, zip(*cases, strict=True), strict=False)}
    result(scene, channels, texts, engine="reference").save(folder / "controllers.nc")
    rows = [",".join((*case, *(f"{value:.17g}" for value in row))) for case, row in zip(cases, values, strict=True)]
    write_whole(folder / "controllers.csv", "\n".join([",".join((*names, *heads)), *rows]) + "\n")


PANELS = {"v0^2/2d [m/s^2]": "Equivalent deceleration", "yaw [deg]": "Final yaw angle"}


def _figure(scene: BrakingScene, stops: list[tuple[Case, dict[str, float]]], file: Path) -> None:
    """Bars by procedure, a column of panels per surface, one colour per controller."""
    from models.drawing.figures import plt, save

    surfaces = list(dict.fromkeys(case.surface for case, _ in stops))
    rights = read(Options, scene.options, scene.file, "options").surfaces
    each = len(read(Options, scene.options, scene.file, "options").controllers)
    names, kinds = list(scene.procedures), list(dict.fromkeys(case.controller for case, _ in stops))
    figure, axes = plt.subplots(
        len(PANELS), max(len(surfaces), 1), figsize=(4.4 * max(len(surfaces), 1), 6.4), squeeze=False, sharey="row"
    )
    width = 0.8 / max(len(kinds), 1)
    for column, surface in enumerate(surfaces):
        for row, (key, heading) in enumerate(PANELS.items()):
            axis = axes[row, column]
            for k, kind in enumerate(kinds):
                bars = {
                    case.procedure: values[key]
                    for case, values in stops
                    if case.surface == surface and case.controller == kind
                }
                heights = [bars.get(name, np.nan) for name in names]
                axis.bar(
                    np.arange(len(names)) + (k - (len(kinds) - 1) / 2) * width,
                    heights,
                    width * 0.95,
                    label=kind.replace("_", " "),
                    color=f"C{k % each}",
                    alpha=1.0 if k < each else 0.5,
                )
            axis.set_xticks(range(len(names)), [name.replace("_", " ") for name in names])
            axis.set(
                title=f"{heading} on {surface}; split: {rights[surface]} on the right",
                ylabel=key.replace("^2", "²") if column == 0 else "",
            )
    if stops:
        axes[0, 0].legend(fontsize=8)
    figure.suptitle(f"{scene.title}, each procedure from its speed to a stop", x=0.01, ha="left", fontweight="bold")
    save(figure, file)


if __name__ == "__main__":
    from studies.command_line import study

    study("braking_controllers")
