"""Controllers as Python classes, or functions that make one, named as "module:Name" or "file.py:Name"."""

import importlib.util
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

from models.brake.controller import Controller
from models.core.errors import InputError


def named_controller(
    callable_path: str, scene_folder: Path, wheel_count: int, parameters: dict[str, Any], scene_path: str = ""
) -> Controller:
    """Controller made by calling the class or function ``callable_path`` with the number of wheels and parameters;
    raises InputError.

    callable_path : "module:Name", or "file.py:Name" with a path from ``scene_folder``.
    """
    make = _callable_of_path(callable_path, scene_folder, scene_path)
    try:
        controller = make(wheel_count, **parameters)
    except (Exception, SystemExit) as error:
        raise InputError(
            scene_path, "port.callable", callable_path, f"was not made: {type(error).__name__}: {error}"
        ) from error
    if not callable(getattr(controller, "sample", None)):
        raise InputError(scene_path, "port.callable", callable_path, "makes something that has no method sample(given)")
    return controller


def _callable_of_path(callable_path: str, scene_folder: Path, scene_path: str) -> Callable[..., Any]:
    """The class or function that a name "module:Name" or "file.py:Name" refers to; raises InputError."""
    module_name, _, attribute = callable_path.rpartition(":")
    if not module_name or not attribute:
        raise InputError(scene_path, "port.callable", callable_path, 'must be "module:Name" or "file.py:Name"')
    try:
        module = (
            _module_of_file(scene_folder / module_name) if module_name.endswith(".py") else import_module(module_name)
        )
    except (Exception, SystemExit) as error:
        raise InputError(
            scene_path, "port.callable", callable_path, f"was not loaded: {type(error).__name__}: {error}"
        ) from error
    choices = tuple(key for key in vars(module) if not key.startswith("_"))
    if attribute not in choices:
        raise InputError(scene_path, "port.callable", attribute, f"{module_name} has no such name", choices)
    return getattr(module, attribute)


def _module_of_file(module_path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(module_path.stem, module_path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
