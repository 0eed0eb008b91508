"""Effects that a scene does not name cost no computation; effects that it names change the model's numbers of
components exactly as they declare."""

import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from models.core.scene_effects import effect_names_of, effect_of, scene_without
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
ENGINE_NAMES = ("reference", "exudyn", "mujoco")
TIME_STEP = 1e-3
START_MOTION = {"pitch": 0.1, "z3": -0.1}
"""Initial pitch (rad) and heave displacement (m); the vehicle moves, so that nothing is compared at rest."""

FORCE_EFFECT = {"wheel_forces": {"file": "forces.csv", "interpolation": "held"}}
"""Scene table of the effect that applies sampled wheel forces from a file."""
PRESCRIBED_PITCH_SETTINGS = {"integrator": "GeneralizedAlpha"}
"""Exudyn settings for a scene with a prescribed pitch: only this integrator solves for the prescribed pitch. The scene
without the effect uses the same settings."""

EFFECT_NAMES = effect_names_of(DEFAULT_SYSTEM)
"""Names of all effects of the pitch-plane vehicle."""


def required_effects(effect_name: str) -> dict[str, Any]:
    """Scene tables of the effects without which an effect cannot be used."""
    module = effect_of(DEFAULT_SYSTEM, effect_name)
    return {name: effect_of(DEFAULT_SYSTEM, name).EXAMPLE for name in module.NEEDS} | module.BESIDE


def scene_with_effects(
    effect_tables: dict[str, Any], step_count: int, work_folder: Path, has_prescribed_pitch: bool = False
) -> Scene:
    """Scene of the asymmetric vehicle with the given effects, released from a tilted position unless its pitch is
    prescribed."""
    start = {} if has_prescribed_pitch else START_MOTION
    return build_scene(
        {
            "title": TITLE,
            "vehicle": {"parameters": "asymmetric_twin"},
            "run": {"duration": step_count * TIME_STEP, "step": TIME_STEP},
            "start": start,
            "effects": effect_tables,
            "engines": {"exudyn": PRESCRIBED_PITCH_SETTINGS} if has_prescribed_pitch else {},
        },
        "absent",
        work_folder,
    )


def write_input_files(work_folder: Path) -> None:
    """Write CSV files with two seconds of wheel forces, of pitch, and of heave and pitch, all of which start
    smoothly."""
    t = TIME_STEP * np.arange(2001)
    wave = np.sin(np.pi * t) ** 2
    write_time_series(
        work_folder / "forces.csv", {"front": ("N", 4e3 + 300 * wave), "rear": ("N", 3e3 - 200 * wave)}, TIME_STEP
    )
    pitch = {"pitch": ("rad", 0.02 * wave)}
    write_time_series(work_folder / "pitch.csv", pitch, TIME_STEP)
    write_time_series(work_folder / "motion.csv", {"z3": ("m", 0.06 + 0.01 * wave), **pitch}, TIME_STEP)


def engine_model(simulated_scene: Scene, engine_name: str) -> Model:
    """Model of a scene in one engine."""
    return build(engine_name, assembly_of_scene(simulated_scene), settings_of(simulated_scene, engine_name))


def scenes_without_and_with_effect(effect_name: str, step_count: int, work_folder: Path) -> tuple[Scene, Scene]:
    """Two scenes that differ by one effect: the first without the effect, the second with the effect."""
    needed, prescribed, module = (
        required_effects(effect_name),
        effect_name.startswith("prescribed"),
        effect_of(DEFAULT_SYSTEM, effect_name),
    )
    scene_below = scene_with_effects(needed, step_count, work_folder, prescribed)
    if hasattr(module, "leave_out"):  # the vehicle has it unless the scene says otherwise
        return scene_without(scene_below, effect_name), scene_below
    return scene_below, scene_with_effects({**needed, effect_name: module.EXAMPLE}, step_count, work_folder, prescribed)


def component_counts_of_scene(simulated_scene: Scene, engine_name: str) -> dict[str, int]:
    """Numbers of components in an engine's model of a scene, and of the channels that are saved."""
    return {
        **engine_model(simulated_scene, engine_name).plan(),
        "channels": len(run(simulated_scene, engine_name).data.data_vars),
    }


def component_count_changes(effect_name: str, engine_name: str, work_folder: Path) -> dict[str, int]:
    """Changes of the numbers of components in an engine's model when an effect is added; unchanged numbers are left
    out."""
    before, after = (
        component_counts_of_scene(bare, engine_name)
        for bare in scenes_without_and_with_effect(effect_name, 20, work_folder)
    )
    return {key: after[key] - before[key] for key in after if after[key] != before[key]}


def declared_count_changes(effect_name: str, engine_name: str) -> dict[str, int]:
    """Changes of the numbers of components in an engine's model that an effect declares in its COUNTS; zero changes are
    left out."""
    table = effect_of(DEFAULT_SYSTEM, effect_name).COUNTS
    return {key: value for key, value in {**table.get("all", {}), **table.get(engine_name, {})}.items() if value}


@allowing_breaches("what is computed is what is counted, whatever the vehicle does meanwhile")
def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows: an effect that a scene does not name adds no computation, and an effect that it names changes the declared
    numbers of components. A quick run tests each effect of the vehicle in one engine (the engines take turns), every
    third effect of other systems, and the imports of one process."""
    with tempfile.TemporaryDirectory() as name:
        files_folder = Path(name)
        write_input_files(files_folder)
        rows = [
            *_imported_module_rows(),
            *(row for engine in ENGINE_NAMES for row in _cost_of_absence_rows(engine, files_folder)),
        ]
        rows += [
            _positive_control_row(
                effect, files_folder, ENGINE_NAMES[i % len(ENGINE_NAMES) :][:1] if quick else ENGINE_NAMES
            )
            for i, effect in enumerate(EFFECT_NAMES)
        ]
    return rows + ride.rows(quick) + wheelset.rows() + machinery.rows() + of_systems.rows(quick), {}


def _imported_module_rows() -> list[Row]:
    """Rows: number of effect modules imported, and of kernels compiled, by a fresh process that ran a scene without
    effects in all engines."""
    probed = probe({"title": TITLE, "run": {"duration": 20 * TIME_STEP, "step": TIME_STEP}, "start": START_MOTION})
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


def _cost_of_absence_rows(engine_name: str, work_folder: Path) -> list[Row]:
    """Rows: Python function calls, memory and callbacks that 1,980 more steps of a scene without effects need. All must
    be zero."""
    for bare in (
        scene_with_effects({}, steps, work_folder) for steps in (20, 20)
    ):  # wrappers cache on their first calls
        counted_march(engine_name, engine_model(bare, engine_name))
    short, long = (
        march_with_least_memory(
            engine_name, partial(engine_model, scene_with_effects({}, steps, work_folder), engine_name)
        )
        for steps in (20, 2000)
    )
    callbacks = max(short.callbacks, installed_callbacks())
    if engine_name == "exudyn":
        callbacks += user_functions(engine_model(scene_with_effects({}, 20, work_folder), engine_name))
    why = "20 steps against 2,000 steps of a bare scene, watched around the engine's own march"
    return [
        Observed(
            f"absent.frames.{engine_name}",
            SYSTEM,
            f"{engine_name}: number of Python functions that 1,980 more steps enter",
            long.frames - short.frames,
            "",
        ).at_most(0, why, "none"),
        Observed(
            f"absent.memory.{engine_name}",
            SYSTEM,
            f"{engine_name}: memory that 1,980 more steps take beyond their result",
            long.peak_bytes - short.peak_bytes,
            "B",
        ).at_most(1980, f"{why}; less than a byte per step is a wrapper's own", "none"),
        Observed(
            f"absent.callbacks.{engine_name}",
            SYSTEM,
            f"{engine_name}: number of callbacks that a bare scene has",
            callbacks,
            "",
        ).at_most(0, "counted over all items, and in the engine's globals before, during and after the march", "none"),
    ]


def _positive_control_row(effect_name: str, work_folder: Path, engine_names: Sequence[str] = ENGINE_NAMES) -> Row:
    """Row of a positive control: the effect changes the numbers of components in each engine's model exactly as it
    declares."""
    changed = {engine: component_count_changes(effect_name, engine, work_folder) for engine in engine_names}
    wanted = {engine: declared_count_changes(effect_name, engine) for engine in engine_names}
    return behaviour_row(
        f"absent.present.{effect_name}",
        SYSTEM,
        f"counts that the effect {effect_name} adds to a bare scene",
        count_changes_text(changed),
        count_changes_text(wanted),
        "positive control: the counts that are zero above do move, and by as much as they should",
    )


def count_changes_text(changes_by_engine: dict[str, dict[str, int]]) -> str:
    """Text that lists the numbers of components that an effect changes in each engine; "nothing" where it changes
    none."""
    parts = [f"{engine} {changes_text(more)}" for engine, more in changes_by_engine.items() if more]
    return "; ".join(parts) or "nothing"


def changes_text(count_changes: dict[str, int]) -> str:
    """Text that lists the signed change of each number of components that an effect changes."""
    return ", ".join(f"{value:+d} {key}" for key, value in sorted(count_changes.items()))
