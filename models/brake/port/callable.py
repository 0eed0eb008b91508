"""Controllers as Python classes, or functions that make one, named as "module:Name" or "file.py:Name"."""

import importlib.util
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

from models.brake.controller import Controller
from models.core.errors import InputError


def named_controller(name: str, folder: Path, wheels: int, parameters: dict[str, Any], file: str = "") -> Controller:
    """Controller made by calling the class or function ``name`` with the number of wheels and parameters; raises
    InputError.

    name : "module:Name", or "file.py:Name" with a path from ``folder``.
    """
    make = _callable_of_path(name, folder, file)
    try:
        controller = make(wheels, **parameters)
    except (Exception, SystemExit) as error:
        raise InputError(file, "port.callable", name, f"was not made: {type(error).__name__}: {error}") from error
    if not callable(getattr(controller, "sample", None)):
        raise InputError(file, "port.callable", name, "makes something that has no method sample(given)")
    return controller


def _callable_of_path(name: str, folder: Path, file: str) -> Callable[..., Any]:
    """The class or function that a name "module:Name" or "file.py:Name" refers to; raises InputError."""
    module_name, _, attribute = name.rpartition(":")
    if not module_name or not attribute:
        raise InputError(file, "port.callable", name, 'must be "module:Name" or "file.py:Name"')
    try:
        module = _module_of_file(folder / module_name) if module_name.endswith(".py") else import_module(module_name)
    except (Exception, SystemExit) as error:
        raise InputError(file, "port.callable", name, f"was not loaded: {type(error).__name__}: {error}") from error
    choices = tuple(key for key in vars(module) if not key.startswith("_"))
    if attribute not in choices:
        raise InputError(file, "port.callable", attribute, f"{module_name} has no such name", choices)
    return getattr(module, attribute)


def _module_of_file(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
