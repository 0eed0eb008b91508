"""What an audit does to a process before it imports anything: spoil one function, or watch all that are called.

The environment says what (``VARIABLE``), so that the workers of a process are treated as it is. Files on the disk stay
as they are: the function's module is rewritten as it is imported, and compiled functions that may call it are neither
taken from numba's cache nor put there. All others come from it.
"""

import json
import os
import sys
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from typing import Any

VARIABLE = "TWINRIG_BLIND_SPOTS"
"""JSON of an ``order``: {"spoil": "module:name"} or {"trace": path of a folder, "label": name of the work}."""
recorder: Any = None
"""Of this process, where it traces."""


def start() -> None:
    """Do what the environment says; nothing without it."""
    order = json.loads(os.environ.get(VARIABLE, "{}"))
    if "spoil" in order:
        module, _, name = order["spoil"].partition(":")
        sys.meta_path.insert(0, Spoiler(module, name))
        _bypass_cache(order["spoil"])
    if "trace" in order:
        _trace(order)


class Spoiler:
    """Finds the module of the spoiled function first, and rewrites it as it is imported."""

    def __init__(self, module: str, name: str) -> None:
        self.module, self.name = module, name

    def find_spec(self, fullname: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        """The spec of the spoiled module with a loader of its own; None for any other."""
        if fullname != self.module:
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is not None and spec.origin is not None:
            spec.loader = _Rewriting(fullname, spec.origin, self.name)
        return spec


class _Rewriting(SourceFileLoader):
    def __init__(self, fullname: str, path: str, name: str) -> None:
        super().__init__(fullname, path)
        self.spoiled = name

    def get_code(self, fullname: str) -> Any:
        from validation.blind_spots.rewriting import rewritten

        source = self.get_data(self.path).decode()
        return compile(rewritten(source, fullname, self.spoiled), self.path, "exec", dont_inherit=True)


def _bypass_cache(spoiled: str) -> None:
    """Neither load nor keep machine code of what may call the spoiled function, or takes functions as arguments."""
    from numba.core import types
    from numba.core.caching import Cache

    from validation.blind_spots.tracing import name_of, reached

    load, save = Cache.load_overload, Cache.save_overload
    known: dict[Any, bool] = {}

    def sound(cache: Any, signature: Any) -> bool:
        function = cache._py_func
        arguments = getattr(signature, "args", signature)
        if function not in known:
            known[function] = spoiled not in {name_of(code) for code in reached(function)}
        return known[function] and not any(isinstance(each, types.Callable) for each in arguments)

    def load_sound(cache: Any, signature: Any, context: Any) -> Any:
        return load(cache, signature, context) if sound(cache, signature) else None

    def save_sound(cache: Any, signature: Any, data: Any) -> None:
        if sound(cache, getattr(data, "signature", signature)):
            save(cache, signature, data)

    Cache.load_overload, Cache.save_overload = load_sound, save_sound  # type: ignore[method-assign]


def _trace(order: dict[str, str]) -> None:
    """Watch this process; a worker writes what it has called as it ends."""
    global recorder
    import atexit
    from multiprocessing import parent_process, util
    from pathlib import Path
    from uuid import uuid4

    from validation.blind_spots.tracing import Recorder

    recorder = Recorder()

    def tell() -> None:
        if order.get("label"):
            text = json.dumps({"names": sorted(recorder.names), "numbers": sorted(recorder.numbers)})
            (Path(order["trace"]) / f"{order['label']}.{uuid4().hex}.json").write_text(text)

    if order.get("label"):
        util.Finalize(None, tell, exitpriority=0) if parent_process() else atexit.register(tell)
    recorder.start()
