"""Jobs of a replay: shipped scenes, jobs listed in a file, base scenes, and seeded random variants of base scenes."""

import copy
import subprocess
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

BASE_SCENES = Path(__file__).with_name("scenes")
"""Folder of base scenes, which are short to run and have as many tables as go together, and of the files they read."""
SHORT_RUN_SETTINGS = Path(__file__).with_name("shipped.toml")
"""File that lists, for each shipped scene, the arguments of --set that make it short to run."""
COMMANDS_FILE = Path(__file__).with_name("commands.toml")
"""File that lists jobs of several commands each."""
VARIED_JOBS, SEED = 300, 20
DROPPED_CHANCE, CHANGED_CHANCE, MISTAKE_CHANCE = 0.25, 0.6, 0.2
"""Probabilities that a table is removed, that numbers are changed, and that the scene gets a mistake."""
FACTOR_RANGE = (0.7, 1.4)
"""Limits of the random factor by which a number of a scene is multiplied."""
ENGINES = ("reference", "exudyn", "mujoco", "all")
NEVER_DROPPED_KEYS = ("title", "system", "study", "vehicle", "run", "options", "quantities", "tolerance")
"""Keys of a scene that are never removed at random."""

Table = dict[str, Any]


@dataclass(frozen=True)
class ReplayJob:
    """Commands that run in one folder: the words of each after ``twinrig``, and the scene (TOML text) that they read as
    ``scene.toml``, if any."""

    name: str
    commands: tuple[tuple[str, ...], ...]
    scene: str = ""


def replay_jobs(executable: str) -> list[ReplayJob]:
    """All jobs of a replay; ``executable``: the twinrig executable that lists the shipped scenes."""
    return [
        ReplayJob("list", (("list",),)),
        *_shipped_jobs(executable),
        *_listed_jobs(),
        *_base_jobs(),
        *_varied_jobs(),
    ]


def _shipped_jobs(executable: str) -> Iterator[ReplayJob]:
    """Yield a job for every shipped scene, which shows the scene and runs it in a shortened form."""
    shorter = tomllib.loads(SHORT_RUN_SETTINGS.read_text())
    listing = subprocess.run([executable, "list"], capture_output=True, text=True, check=True).stdout
    for line in listing.splitlines()[1:]:
        if not line.startswith("  "):
            return
        name = line.split()[0]
        shortening = [word for change in shorter.get(name, ()) for word in ("--set", change)]
        yield ReplayJob(f"shipped-{name}", (("show", name), ("run", name, *shortening, "--json", "--out", "out")))


def _listed_jobs() -> Iterator[ReplayJob]:
    for job in tomllib.loads(COMMANDS_FILE.read_text())["jobs"]:
        yield ReplayJob(f"commands-{job['name']}", tuple(tuple(words) for words in job["commands"]))


def _base_jobs() -> Iterator[ReplayJob]:
    """Yield a job for every base scene and each of its engines, which shows the unchanged scene and runs it."""
    from tomli_w import dumps

    for base in sorted(BASE_SCENES.glob("*.toml")):
        scene = tomllib.loads(base.read_text())
        engines = scene.pop("engines_asked", ENGINES)
        for engine in engines or ("",):
            yield ReplayJob(
                f"{base.stem}-{engine or 'plain'}", (("show", "scene.toml"), _run_command(engine)), dumps(scene)
            )


def _run_command(engine: str) -> tuple[str, ...]:
    return ("run", "scene.toml", *(("--engine", engine) if engine else ()), "--json", "--out", "out")


def _varied_jobs() -> Iterator[ReplayJob]:
    bases = sorted(BASE_SCENES.glob("*.toml"))
    for i in range(VARIED_JOBS):
        base = bases[i % len(bases)]
        generator = np.random.default_rng([SEED, i])
        yield _random_job(f"{base.stem}-{i:03d}", tomllib.loads(base.read_text()), generator)


def _random_job(job_name: str, scene_table: Table, generator: np.random.Generator) -> ReplayJob:
    """Job that runs a random variant of a base scene: tables removed, numbers changed, a random engine, and sometimes a
    mistake."""
    from tomli_w import dumps

    engines = scene_table.pop("engines_asked", ENGINES)
    engine = str(generator.choice(engines)) if engines else ""
    _drop_random_tables(scene_table, generator)
    if generator.random() < CHANGED_CHANCE:
        for number_path in generator.permutation(list(_paths_of_numbers(scene_table)))[:3]:
            _change_number(scene_table, str(number_path), float(generator.uniform(*FACTOR_RANGE)))
    if generator.random() < MISTAKE_CHANCE:
        engine = _make_mistake(scene_table, engine, generator)
    return ReplayJob(job_name, (_run_command(engine),), dumps(scene_table))


def _drop_random_tables(scene_table: Table, generator: np.random.Generator) -> None:
    effects = scene_table.get("effects")
    for table in (scene_table, effects if isinstance(effects, dict) else {}):
        for key in list(table):
            if (
                isinstance(table[key], dict)
                and key not in (*NEVER_DROPPED_KEYS, "effects")
                and generator.random() < DROPPED_CHANCE
            ):
                del table[key]


def _paths_of_numbers(scene_table: Table, key_path_prefix: str = "") -> Iterator[str]:
    """Yield the paths (keys joined by /) of all floating-point numbers of a table."""
    for key, value in scene_table.items():
        if isinstance(value, dict):
            yield from _paths_of_numbers(value, f"{key_path_prefix}{key}/")
        elif isinstance(value, float):
            yield f"{key_path_prefix}{key}"


def _table_and_key(scene_table: Table, key_path: str) -> tuple[Table, str]:
    *parent_keys, key = key_path.split("/")
    for parent_key in parent_keys:
        scene_table = scene_table[parent_key]
    return scene_table, key


def _change_number(scene_table: Table, key_path: str, number_factor: float) -> None:
    table, key = _table_and_key(scene_table, key_path)
    table[key] = float(f"{number_factor * table[key]:.4g}")


def _make_mistake(scene_table: Table, engine: str, generator: np.random.Generator) -> str:
    """Put a typical user's mistake into a scene; returns the name of the engine to run, which may be the mistake."""
    original_scene = copy.deepcopy(scene_table)
    number_paths = sorted(_paths_of_numbers(original_scene))
    kind = int(generator.integers(5))
    if kind == 0 or not number_paths:
        scene_table["vehicel"] = {}
    elif kind == 4:
        return "exodyn"
    else:
        table, key = _table_and_key(scene_table, str(generator.choice(number_paths)))
        table[key] = {1: "a text", 2: -abs(table[key]) - 1.0, 3: float("nan")}[kind]
    return engine
