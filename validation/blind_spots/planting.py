"""Import hook of the audit's processes: shared functions are rewritten on import to multiply their results by a factor.

An environment variable names the functions, so that worker processes are changed in the same way. Files on the disk are
not changed. All factors are 1 except where the shared memory states a fault, so that machine code is compiled once, for
all faults.
"""

import json
import sys
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from typing import Any

from validation.blind_spots.memory import audit_instructions


def install_import_hook() -> None:
    """Install the import hook that rewrites functions for planted faults, if this process belongs to an audit."""
    if audit_instructions():
        sys.meta_path.insert(0, Planter(json.loads(Path(audit_instructions()["functions"]).read_text())))


class Planter:
    """Import hook that rewrites given functions when their module is imported, so that faults can be planted in them.

    functions : ``module:name`` of each function; its position in this list is its number.
    """

    def __init__(self, function_names: list[str]) -> None:
        self.modules: dict[str, dict[str, int]] = {}
        for number, function in enumerate(function_names):
            module, _, name = function.partition(":")
            self.modules.setdefault(module, {})[name] = number

    def find_spec(self, fullname: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        """Import specification of a module whose functions are to be rewritten, with a loader that rewrites them; None
        for any other module."""
        if fullname not in self.modules:
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is not None and spec.origin is not None:
            spec.loader = _RewritingLoader(fullname, spec.origin, self.modules[fullname])
        return spec


class _RewritingLoader(SourceFileLoader):
    def __init__(self, module_name: str, source_path: str, function_numbers: dict[str, int]) -> None:
        super().__init__(module_name, source_path)
        self.names = function_numbers

    def get_code(self, fullname: str) -> Any:
        """Code of the rewritten module. Its bytecode is cached in a separate folder from the original's bytecode."""
        earlier, sys.pycache_prefix = sys.pycache_prefix, audit_instructions()["bytecode"]
        try:
            return super().get_code(fullname)
        finally:
            sys.pycache_prefix = earlier

    def source_to_code(self, data: Any, path: Any, *, _optimization: int = -1) -> Any:  # type: ignore[override]
        from validation.blind_spots.rewriting import rewritten_module

        parsed = rewritten_module(bytes(data).decode(), self.name, self.names)
        return compile(parsed, path, "exec", dont_inherit=True, optimize=_optimization)
