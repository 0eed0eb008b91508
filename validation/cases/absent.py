"""An effect that a scene does not name is not there; one that it names adds what it says."""

import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from models.core.scene_effects import module_of, names_of, scene_without
from models.core.systems import DEFAULT_SYSTEM
from models.core.time_series import write_time_series
from models.engines.model import Model
from models.engines.protocol import build
from models.systems.pitch_plane.run import run
from models.systems.pitch_plane.scene import Scene, assembly_of_scene, settings_of
from models.systems.pitch_plane.scene import build as build_scene
from validation.absence import machinery, of_systems, ride, wheelset
from validation.absence.probes import (
    belongs_to_effects,
    counted_march,
    installed_callbacks,
    march_with_least_memory,
    probe,
    user_functions,
)
from validation.common.grounds import allowing_breaches
from validation.common.rows import CaseAnswer, Observed, Row, System, behaviour_row

TITLE = "What is not named is not computed"
SYSTEM: System = "effects"
ENGINES = ("reference", "exudyn", "mujoco")
STEP = 1e-3
START_MOTION = {"pitch": 0.1, "z3": -0.1}
"""m, rad: the vehicle moves, so that nothing is compared at rest."""

FORCES = {"wheel_forces": {"file": "forces.csv", "interpolation": "held"}}
GUIDED = {"integrator": "GeneralizedAlpha"}
"""The one integrator of Exudyn that solves for a prescribed pitch; its neighbour without one takes it, too."""

EFFECTS = names_of(DEFAULT_SYSTEM)


def added_to(effect: str) -> dict[str, Any]:
    """Tables of the effects that an effect needs."""
    module = module_of(DEFAULT_SYSTEM, effect)
    return {name: module_of(DEFAULT_SYSTEM, name).EXAMPLE for name in module.NEEDS} | module.BESIDE


def scene(effects: dict[str, Any], steps: int, folder: Path, guided: bool = False) -> Scene:
    """Scene: the asymmetric vehicle with some effects, released from a tilted position."""
    start = {} if guided else START_MOTION
    return build_scene(
        {
            "title": TITLE,
            "vehicle": {"parameters": "asymmetric_twin"},
            "run": {"duration": steps * STEP, "step": STEP},
            "start": start,
            "effects": effects,
            "engines": {"exudyn": GUIDED} if guided else {},
        },
        "absent",
        folder,
    )


def write_files(folder: Path) -> None:
    """Write files with two seconds of wheel forces and of pitch, both of which start smoothly."""
    t = STEP * np.arange(2001)
    wave = np.sin(np.pi * t) ** 2
    write_time_series(folder / "forces.csv", {"front": ("N", 4e3 + 300 * wave), "rear": ("N", 3e3 - 200 * wave)}, STEP)
    pitch = {"pitch": ("rad", 0.02 * wave)}
    write_time_series(folder / "pitch.csv", pitch, STEP)
    write_time_series(folder / "motion.csv", {"z3": ("m", 0.06 + 0.01 * wave), **pitch}, STEP)


def model(bare: Scene, engine: str) -> Model:
    """An engine's model of a scene."""
    return build(engine, assembly_of_scene(bare), settings_of(bare, engine))


def pair(effect: str, steps: int, folder: Path) -> tuple[Scene, Scene]:
    """Two scenes that differ by one effect: without it and with it."""
    base, guided, module = added_to(effect), effect.startswith("prescribed"), module_of(DEFAULT_SYSTEM, effect)
    less = scene(base, steps, folder, guided)
    if hasattr(module, "leave_out"):  # the vehicle has it unless the scene says otherwise
        return scene_without(less, effect), less
    return less, scene({**base, effect: module.EXAMPLE}, steps, folder, guided)


def counts_of_scene(bare: Scene, engine: str) -> dict[str, int]:
    """Numbers of components in an engine's model of a scene, and of the channels that are saved."""
    return {**model(bare, engine).plan(), "channels": len(run(bare, engine).data.data_vars)}


def change(effect: str, engine: str, folder: Path) -> dict[str, int]:
    """Counts that an effect changes in an engine, each with its change."""
    before, after = (counts_of_scene(bare, engine) for bare in pair(effect, 20, folder))
    return {key: after[key] - before[key] for key in after if after[key] != before[key]}


def declared(effect: str, engine: str) -> dict[str, int]:
    """Changes of the counts that the effect's file declares for an engine."""
    table = module_of(DEFAULT_SYSTEM, effect).COUNTS
    return {key: value for key, value in {**table.get("all", {}), **table.get(engine, {})}.items() if value}


@allowing_breaches("what is computed is what is counted, whatever the vehicle does meanwhile")
def measure(quick: bool, folder: Path) -> CaseAnswer:
    """All counts of absence, with a positive control of every effect; a quick run has each control in one engine,
    those of the vehicle in turn and of other systems every third, and one process that looks for what is imported.
    """
    with tempfile.TemporaryDirectory() as name:
        files_folder = Path(name)
        write_files(files_folder)
        rows = [*_imports(), *(row for engine in ENGINES for row in _absence(engine, files_folder))]
        rows += [
            _control(effect, files_folder, ENGINES[i % len(ENGINES) :][:1] if quick else ENGINES)
            for i, effect in enumerate(EFFECTS)
        ]
    return rows + ride.rows(quick) + wheelset.rows() + machinery.rows() + of_systems.rows(quick), {}


def _imports() -> list[Row]:
    """Modules imported and kernels compiled in a fresh process that ran a bare scene in all engines."""
    probed = probe({"title": TITLE, "run": {"duration": 20 * STEP, "step": STEP}, "start": START_MOTION})
    foreign = [name for name in probed["modules"] if belongs_to_effects(name)]
    why = "a fresh process ran a scene without effects in all engines; counted in its list of modules"
    kernels = len(probed["marches"]) + len(probed["derivatives"])
    return [
        Observed(
            "absent.imports", SYSTEM, "number of modules of effects that a bare scene imports", len(foreign), ""
        ).at_most(0, why, "none"),
        Observed(
            "absent.kernels",
            SYSTEM,
            "number of kernels that a bare scene compiles beyond its own march",
            kernels - 1,
            "",
        ).at_most(0, "the same process; the reference compiles one march per kind of scene, when first asked", "none"),
    ]


def _absence(engine: str, folder: Path) -> list[Row]:
    """Rows: Python frames, memory and callbacks that a bare scene's march needs in 1,980 more steps; they must be
    none."""
    for bare in (scene({}, steps, folder) for steps in (20, 20)):  # wrappers cache on their first calls
        counted_march(engine, model(bare, engine))
    short, long = (
        march_with_least_memory(engine, partial(model, scene({}, steps, folder), engine)) for steps in (20, 2000)
    )
    callbacks = max(short.callbacks, installed_callbacks())
    if engine == "exudyn":
        callbacks += user_functions(model(scene({}, 20, folder), engine))
    why = "20 steps against 2,000 steps of a bare scene, watched around the engine's own march"
    return [
        Observed(
            f"absent.frames.{engine}",
            SYSTEM,
            f"{engine}: number of Python functions that 1,980 more steps enter",
            long.frames - short.frames,
            "",
        ).at_most(0, why, "none"),
        Observed(
            f"absent.memory.{engine}",
            SYSTEM,
            f"{engine}: memory that 1,980 more steps take beyond their result",
            long.peak_bytes - short.peak_bytes,
            "B",
        ).at_most(1980, f"{why}; less than a byte per step is a wrapper's own", "none"),
        Observed(
            f"absent.callbacks.{engine}", SYSTEM, f"{engine}: number of callbacks that a bare scene has", callbacks, ""
        ).at_most(0, "counted over all items, and in the engine's globals before, during and after the march", "none"),
    ]


def _control(effect: str, folder: Path, engines: Sequence[str] = ENGINES) -> Row:
    """Rows of positive controls: each effect changes the counts of every engine by exactly what it declares."""
    changed = {engine: change(effect, engine, folder) for engine in engines}
    wanted = {engine: declared(effect, engine) for engine in engines}
    return behaviour_row(
        f"absent.present.{effect}",
        SYSTEM,
        f"counts that the effect {effect} adds to a bare scene",
        _text(changed),
        _text(wanted),
        "positive control: the counts that are zero above do move, and by as much as they should",
    )


def _text(table: dict[str, dict[str, int]]) -> str:
    parts = [f"{engine} {changes(more)}" for engine, more in table.items() if more]
    return "; ".join(parts) or "nothing"


def changes(added_counts: dict[str, int]) -> str:
    """Text of the counts that an effect changes."""
    return ", ".join(f"{value:+d} {key}" for key, value in sorted(added_counts.items()))
