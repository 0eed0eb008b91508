"""Counters of what an effect may leave in a run whose scene does not name it: modules, kernels, callbacks, memory.

Everything here observes a run from outside: the modules of a fresh process, Exudyn's items, MuJoCo's global callbacks,
the Python frames that are entered while an engine integrates over time, and the memory that it takes.
"""

import json
import subprocess
import sys
import tracemalloc
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any
from unittest import mock

import numpy as np

from models.engines.model import Model

CALLBACK_NAMES = ("act_bias", "act_dyn", "act_gain", "contactfilter", "control", "passive", "sensor", "time")
"""MuJoCo's callbacks, all global to the process."""

PROBE_SCRIPT = """
import json, sys
from models.systems.pitch_plane.run import run
from models.systems.pitch_plane.scene import build
scene = build(json.loads(sys.argv[1]), "probe", sys.argv[2])
states = {engine: run(scene, engine).detail.states.tobytes().hex() for engine in ("reference", "exudyn", "mujoco")}
reference = sys.modules["models.engines.reference"]
print(json.dumps({
    "modules": sorted(sys.modules),
    "states": states,
    "marches": [list(key) for key, march in reference._FIXED.items() if march.signatures],
    "derivatives": [list(key) for key in reference._SINGLE],
}))
"""
"""Script that runs a scene in all engines in a fresh process and prints the modules imported, the kernels compiled and
the states computed, as JSON."""


def probe(scene_table: Mapping[str, Any], scene_folder: str = ".", **process_options: Any) -> dict[str, Any]:
    """Modules imported, kernels compiled and states (hexadecimal bytes) after a scene was run in a fresh process."""
    command = [sys.executable, "-c", PROBE_SCRIPT, json.dumps(scene_table), scene_folder]
    completed_process = subprocess.run(command, capture_output=True, text=True, check=True, **process_options)
    return json.loads(completed_process.stdout.splitlines()[-1])


def belongs_to_effects(module_name: str) -> bool:
    """Whether a module belongs to an effect: a bare scene must import no such module."""
    owners = (
        "models.systems.pitch_plane.effects.",
        "models.road",
        "models.contact",
        "models.tyre",
        "models.brake",
        "models.sensors",
        "models.core.time_series",
        "models.core.tables",
        "models.engines.mujoco_callback",
        "models.engines.mujoco_layout",
        "pyopencrg",
    )
    return module_name.startswith(owners)


@dataclass
class MarchCounts:
    """Counts taken while an engine marched: Python frames, memory, callbacks.

    frames : Python functions entered, by the engine's own wrapper or from inside the march
    peak_bytes : bytes that Python and numpy took at most, beyond what the march returned
    callbacks : MuJoCo callbacks that were installed
    """

    frames: int = 0
    peak_bytes: int = 0
    callbacks: int = 0


def installed_callbacks() -> int:
    """Number of MuJoCo callbacks that are installed in this process."""
    import mujoco

    return sum(getattr(mujoco, f"get_mjcb_{name}")() is not None for name in CALLBACK_NAMES)


def counted_march(engine: str, engine_model: Model) -> MarchCounts:
    """Run a model once and return the Python frames, memory and callbacks that its engine used while it integrated over
    time. Checks of the path and the making of results are not counted."""
    march_counts = MarchCounts()
    with _probes_around_march(engine, march_counts):
        engine_model.run()
    return march_counts


def march_with_least_memory(engine: str, make_engine_model: Callable[[], Model], run_count: int = 3) -> MarchCounts:
    """Counts of the run with the least memory among several runs. Memory that the time loop itself allocates occurs in
    every run, so that the least includes it."""
    return min(
        (counted_march(engine, make_engine_model()) for _ in range(run_count)),
        key=lambda march_counts: march_counts.peak_bytes,
    )


@contextmanager
def _probes_around_march(engine: str, march_counts: MarchCounts) -> Iterator[None]:
    """Context in which the function that an engine integrates with counts frames, memory and callbacks."""
    if engine == "reference":
        from models.engines import reference

        real = reference.compiled_march
        patch = mock.patch.object(reference, "compiled_march", lambda *key: _with_probes(real(*key), march_counts))
    elif engine == "mujoco":
        from mujoco import rollout

        patch = mock.patch.object(rollout, "rollout", _with_probes(rollout.rollout, march_counts))
    else:
        import exudyn as exu

        patch = mock.patch.object(
            exu.MainSystem, "SolveDynamic", _with_probes(exu.MainSystem.SolveDynamic, march_counts)
        )
    with patch:
        yield


def _with_probes(march_function: Callable[..., Any], march_counts: MarchCounts) -> Callable[..., Any]:
    """Returns the function with counting added: each call adds its Python frames, memory and callbacks to
    ``march_counts``."""

    def call(*march_arguments: Any, **march_options: Any) -> Any:
        march_counts.callbacks = max(march_counts.callbacks, installed_callbacks())
        tracemalloc.start()
        sys.setprofile(lambda frame, event, argument: _count_frame(march_counts, event))
        try:
            result = march_function(*march_arguments, **march_options)
        finally:
            sys.setprofile(None)
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
        march_counts.peak_bytes += peak - _returned_bytes(result, [*march_arguments, *march_options.values()])
        return result

    return call


def _count_frame(march_counts: MarchCounts, trace_event: str) -> None:
    march_counts.frames += trace_event == "call"


def _returned_bytes(march_result: Any, filled_arrays: Sequence[Any]) -> int:
    """Bytes of the arrays that an engine's run returned, without arrays that it received as arguments and filled."""
    parts = march_result if isinstance(march_result, tuple) else (march_result,)
    arrays = [value for value in parts if isinstance(value, np.ndarray)]
    filled = [array for array in filled_arrays if isinstance(array, np.ndarray)]
    return sum(
        array.nbytes for array in arrays if not any(np.may_share_memory(array, filled_array) for filled_array in filled)
    )


def user_functions(exudyn_model: Any) -> int:
    """Number of Python user functions in an Exudyn model, counted over all items of its system and the system itself.

    The argument is the model and not the system, as a system is silently empty once its container is deleted.
    """
    return _user_functions(exudyn_model.built.mbs)


def _user_functions(mbs: Any) -> int:
    system = mbs.systemData
    kinds = (
        ("Node", system.NumberOfNodes()),
        ("Object", system.NumberOfObjects()),
        ("Marker", system.NumberOfMarkers()),
        ("Load", system.NumberOfLoads()),
        ("Sensor", system.NumberOfSensors()),
    )
    items = [getattr(mbs, f"Get{kind}")(i) for kind, count in kinds for i in range(count)]
    assert items, "the system is empty"
    told_of = [getattr(mbs, name)() for name in dir(mbs) if name.startswith("Get") and name.endswith("UserFunction")]
    function_values = [value for item in items for key, value in item.items() if "UserFunction" in key]
    return sum(bool(value) for value in (*function_values, *told_of))


@contextmanager
def registered_callbacks(engine: str) -> Iterator[list[int]]:
    """Context that yields a list of numbers of callbacks: one number for every Exudyn system that is integrated, or for
    every time that a MuJoCo callback is set or cleared."""
    counts, patches = list[int](), list[Any]()
    if engine == "mujoco":
        import mujoco

        patches = [
            mock.patch.object(mujoco, name, _counting_setter(getattr(mujoco, name), counts))
            for name in (f"set_mjcb_{callback}" for callback in CALLBACK_NAMES)
        ]
    elif engine == "exudyn":
        import exudyn as exu

        patches = [
            mock.patch.object(exu.MainSystem, "SolveDynamic", _counting_march(exu.MainSystem.SolveDynamic, counts))
        ]
    with ExitStack() as stack:
        for patch in patches:
            stack.enter_context(patch)
        yield counts


def _counting_setter(set_callback: Callable[..., Any], callback_counts: list[int]) -> Callable[..., Any]:
    def call(callback: Any) -> None:
        set_callback(callback)
        callback_counts.append(installed_callbacks())

    return call


def _counting_march(solve_march: Callable[..., Any], function_counts: list[int]) -> Callable[..., Any]:
    systems_seen = dict[int, Any]()

    def call(mbs: Any, *march_arguments: Any, **march_options: Any) -> Any:
        if id(mbs) not in systems_seen:  # which keeps it, so that no other one has its number
            systems_seen[id(mbs)] = mbs
            function_counts.append(_user_functions(mbs))
        return solve_march(mbs, *march_arguments, **march_options)

    return call
