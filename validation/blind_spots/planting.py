"""Change of a process by an audit before it imports anything: shared functions multiply their results by a factor.

The environment names the functions, so that the workers of a process are treated as it is. Files on the disk stay as
they are: modules are rewritten as they are imported. All factors are 1 but where the memory of the process says
otherwise, so that machine code is compiled once, for every function that is spoiled after that.
"""

import json
import sys
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from typing import Any

from validation.blind_spots.memory import order


def start() -> None:
    """Install the import hook that plants faults, if the environment asks for it."""
    if order():
        sys.meta_path.insert(0, Planter(json.loads(Path(order()["functions"]).read_text())))


class Planter:
    """Import hook for modules with given functions: it rewrites these functions as their module is imported.

    functions : ``module:name`` of each; its place in this list is the place of its factor.
    """

    def __init__(self, functions: list[str]) -> None:
        self.modules: dict[str, dict[str, int]] = {}
        for place, function in enumerate(functions):
            module, _, name = function.partition(":")
            self.modules.setdefault(module, {})[name] = place

    def find_spec(self, fullname: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        """Import specification, with a rewriting loader, of a module whose functions are to be rewritten; None for any
        other module."""
        if fullname not in self.modules:
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is not None and spec.origin is not None:
            spec.loader = _Rewriting(fullname, spec.origin, self.modules[fullname])
        return spec


class _Rewriting(SourceFileLoader):
    def __init__(self, fullname: str, path: str, names: dict[str, int]) -> None:
        super().__init__(fullname, path)
        self.names = names

    def get_code(self, fullname: str) -> Any:
        """Code of the rewritten module. Its bytecode is cached apart from that of the original source."""
        earlier, sys.pycache_prefix = sys.pycache_prefix, order()["bytecode"]
        try:
            return super().get_code(fullname)
        finally:
            sys.pycache_prefix = earlier

    def source_to_code(self, data: Any, path: Any, *, _optimization: int = -1) -> Any:  # type: ignore[override]
        from validation.blind_spots.rewriting import rewritten

        parsed = rewritten(bytes(data).decode(), self.name, self.names)
        return compile(parsed, path, "exec", dont_inherit=True, optimize=_optimization)
