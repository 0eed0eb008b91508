"""A controller as a Python class or function that makes one, named as "module:Name" or "file.py:Name"."""

import importlib.util
import signal
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any

from models.braking.controller import Command, Controller, Sample
from models.braking.port.ask import ControllerFailed
from models.errors import InputError


def named_controller(name: str, folder: Path, wheels: int, parameters: dict[str, Any], file: str = "") -> Controller:
    """Controller that ``name`` makes of the number of wheels and its parameters; raises InputError.

    name : "module:Name", or "file.py:Name" with a path from ``folder``.
    """
    make = _find(name, folder, file)
    try:
        made = make(wheels, **parameters)
    except (Exception, SystemExit) as error:
        raise InputError(file, "port.callable", name, f"was not made: {type(error).__name__}: {error}") from error
    if not callable(getattr(made, "sample", None)):
        raise InputError(file, "port.callable", name, "makes something that has no method sample(given)")
    return made


def _find(name: str, folder: Path, file: str) -> Callable[..., Any]:
    place, _, attribute = name.rpartition(":")
    if not place or not attribute:
        raise InputError(file, "port.callable", name, 'must be "module:Name" or "file.py:Name"')
    try:
        module = _of_file(folder / place) if place.endswith(".py") else import_module(place)
    except (Exception, SystemExit) as error:
        raise InputError(file, "port.callable", name, f"was not loaded: {type(error).__name__}: {error}") from error
    choices = tuple(key for key in vars(module) if not key.startswith("_"))
    if attribute not in choices:
        raise InputError(file, "port.callable", attribute, f"{place} has no such name", choices)
    return getattr(module, attribute)


def _of_file(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@dataclass
class Within:
    """A controller in this process that has ``timeout`` seconds for each answer.

    In the main thread of a Unix process Python code that goes on for longer is interrupted; elsewhere, and in foreign
    code that does not come back, only an answer that comes late can be told. Raises ControllerFailed.
    """

    inner: Controller
    timeout: float

    def __post_init__(self) -> None:
        self._alarm = hasattr(signal, "setitimer") and threading.current_thread() is threading.main_thread()

    def sample(self, given: Sample) -> Command:
        """Its answer, in time."""
        start = time.perf_counter()
        command = self._interrupted(given) if self._alarm else self.inner.sample(given)
        if time.perf_counter() - start > self.timeout:
            raise self._late(given)
        return command

    def _interrupted(self, given: Sample) -> Command:
        before = signal.signal(signal.SIGALRM, _raise)
        try:
            try:
                signal.setitimer(signal.ITIMER_REAL, self.timeout)
                return self.inner.sample(given)
            finally:
                signal.setitimer(signal.ITIMER_REAL, 0.0)
        except _Late:
            raise self._late(given) from None
        finally:
            signal.signal(signal.SIGALRM, before)

    def _late(self, given: Sample) -> ControllerFailed:
        return ControllerFailed(given, "silence", f"no answer within {self.timeout:g} s")


class _Late(BaseException):
    """Raised in a controller whose time is over; no exception that it might catch by itself."""


def _raise(number: int, frame: FrameType | None) -> None:
    raise _Late
