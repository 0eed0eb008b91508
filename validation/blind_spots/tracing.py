"""Which functions of ``models`` a piece of work calls: Python's by the profiler, compiled ones at Python's border.

A compiled function calls others without Python noticing. So with each that Python calls come those that it may call:
the functions among its globals and the variables around it, and theirs.
"""

import sys
import threading
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from time import perf_counter
from types import CodeType, FrameType, FunctionType, ModuleType
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[2]
MODELS = str(ROOT / "models")


def name_of(code: CodeType) -> str:
    """``module:qualified name`` of a function's code; "" outside of ``models``."""
    if not code.co_filename.startswith(MODELS):
        return ""
    path = Path(code.co_filename).relative_to(ROOT).with_suffix("")
    return f"{'.'.join(path.parts).removesuffix('.__init__')}:{code.co_qualname}"


def called(function: FunctionType) -> Iterator[FunctionType]:
    """Functions of ``models`` that a function names, compiled or not."""
    codes = [function.__code__]
    for code in codes:
        codes += [each for each in code.co_consts if isinstance(each, CodeType)]
    names = {name for code in codes for name in code.co_names}
    things = [function.__globals__.get(name) for name in names]
    things += [getattr(module, name, None) for module in things if isinstance(module, ModuleType) for name in names]
    things += [cell.cell_contents for cell in function.__closure__ or () if _is_filled(cell)]
    things += [part for thing in things if isinstance(thing, tuple) for part in thing]
    for thing in things:
        inner = getattr(thing, "py_func", None) or getattr(thing, "_pyfunc", None) or thing
        if isinstance(inner, FunctionType) and name_of(inner.__code__):
            yield inner


def _is_filled(cell: Any) -> bool:
    try:
        return cell.cell_contents is not None
    except ValueError:
        return False


def reached(function: FunctionType) -> set[CodeType]:
    """Codes of a function and of all that it may call, as far as they are compiled together."""
    codes, left = {function.__code__}, [function]
    while left:
        for each in called(left.pop()):
            if each.__code__ not in codes:
                codes.add(each.__code__)
                left.append(each)
    return codes


def numeric(value: Any) -> bool:
    """Whether a value holds numbers that can be 1 % off."""
    if isinstance(value, np.ndarray):
        return value.dtype.kind in "fc"
    if isinstance(value, tuple | list):
        return any(numeric(part) for part in value[:20])
    if is_dataclass(value) and not isinstance(value, type):
        return any(numeric(getattr(value, field.name, None)) for field in fields(value))
    return isinstance(value, float | complex | np.floating)


class Recorder:
    """Names of the functions called after ``reset``; in ``numbers``, those that are compiled or gave numbers.

    compiling : seconds that numba took so far.
    """

    def __init__(self) -> None:
        self.names, self.numbers = set[str](), set[str]()
        self.compiling = 0.0
        self._seen: dict[CodeType, str] = {}
        self._compiled: dict[CodeType, set[str]] = {}

    def reset(self) -> None:
        """Begin with the next piece of work."""
        self.names = set()

    def profile(self, frame: FrameType, event: str, value: Any) -> None:
        """Python's profiler."""
        if event != "return":
            return
        code = frame.f_code
        name = self._seen.get(code)
        if name is None:
            name = self._seen[code] = name_of(code)
        if name and (name not in self.names or name not in self.numbers):
            self.names.add(name)
            if name not in self.numbers and numeric(value):
                self.numbers.add(name)

    def compiled(self, function: FunctionType) -> None:
        """A compiled function is called, or handed to an engine."""
        names = self._compiled.get(function.__code__)
        if names is None:
            names = {name_of(code) for code in reached(function)} - {""}
            self._compiled[function.__code__] = names
            self.numbers |= names
        self.names |= names

    def start(self) -> None:
        """Watch this process from now on."""
        _watch_compiled(self)
        threading.setprofile(self.profile)
        sys.setprofile(self.profile)


def _watch_compiled(recorder: Recorder) -> None:
    """Tell calls of compiled functions and addresses of callbacks; compiling itself is not profiled, which is slow."""
    from numba.core import ccallback, dispatcher

    Dispatcher: Any = dispatcher.Dispatcher
    CFunc: Any = ccallback.CFunc
    call, make, address = Dispatcher.__call__, Dispatcher.compile, CFunc.address

    def watched(self: Any, *arguments: Any, **options: Any) -> Any:
        recorder.compiled(self.py_func)
        for each in arguments:
            if isinstance(each, Dispatcher):
                recorder.compiled(each.py_func)
        return call(self, *arguments, **options)

    def quiet(self: Any, signature: Any) -> Any:
        profiler, start = sys.getprofile(), perf_counter()
        sys.setprofile(None)
        try:
            return make(self, signature)
        finally:
            recorder.compiling += perf_counter() - start if profiler else 0.0  # not within another compilation
            sys.setprofile(profiler)

    def told(self: Any) -> Any:
        recorder.compiled(self._pyfunc)
        return address.fget(self)

    def as_ctypes(self: Any) -> Any:
        recorder.compiled(self._pyfunc)
        if "_made_ctypes" not in self.__dict__:
            self._made_ctypes = made.func(self)
        return self._made_ctypes

    made = CFunc.__dict__["ctypes"]
    Dispatcher.__call__, Dispatcher.compile = watched, quiet
    CFunc.address, CFunc.ctypes = property(told), property(as_ctypes)
