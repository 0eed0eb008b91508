"""Compilation with numba: machine code is cached on disk, and never loaded where it does not belong.

numba numbers the files of a function's signatures from its index. Two processes that compile two signatures at once
then write the same file, and each later loads the other's machine code. Nor does numba see a change in a function
that another file gives to a kernel. Both are wrong answers without a word. So here every file has a name of its own
(if an entry of the index is lost, the function is compiled again), and machine code is as old as the newest of its
folder, of the vehicles' equations, of the marches, of the contact's kernels, and of the kernels that its file imports
from elsewhere.
"""

import re
import zlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any
from uuid import uuid4

import numba
from numba.core.ccallback import CFunc
from numba.core.sigutils import normalize_signature
from numba.core.types import unliteral

from models.machine.alone import KernelLock, load_after_others

ROOT = Path(__file__).parents[2]
COMMON = tuple(ROOT / "models" / name for name in ("vehicles", "engines", "contact", "machine"))
"""Folders whose functions are compiled into kernels of other folders."""
SOURCES = (".py", ".csv")
"""Suffixes of source files, and of tables whose numbers are compiled into kernels."""
IMPORT = re.compile(r"^from ((?:models|validation)[.\w]*) import (?:\(([^)]*)\)|(.*))", re.MULTILINE)
"""Pattern of an import statement from this project, with the module and the imported names."""


def njit(**options: Any) -> Callable[[Callable], Any]:
    """``numba.njit`` with the given options; with ``cache=True`` the cache files are safe from other processes.

    What may make arrays says so (``_nrt``), or it would be compiled like whoever calls it first, who may be ``lean``.
    """
    return lambda function: _kept_apart(numba.njit(**{"_nrt": True, **options})(function))


compiled = njit(cache=True, error_model="numpy")
"""``njit`` with numpy's rules for division by zero, cached on disk."""


def lean(function: Callable) -> Any:
    """``njit`` for functions that allocate no arrays: array arguments are not reference-counted, and machine code is
    cached on disk.

    Counting costs functions of a microsecond as much as their work. An array made in one is an error as it compiles;
    what it calls may make some.
    """
    return njit(cache=True, error_model="numpy", _nrt=False)(function)


def inlined(function: Callable) -> Any:
    """``lean``, with the function inlined into its callers, because passing an array costs as much as ten numbers."""
    return njit(cache=True, error_model="numpy", _nrt=False, inline="always")(function)


def _kept_apart(compiled_function: Any) -> Any:
    """The numba function, compiled once for all literal numbers of its callers, and by one process at a time, with
    cache files that are safe from other processes."""
    _without_literals(compiled_function)
    compiled_function.compile = _compile_alone(
        compiled_function._cache, compiled_function.py_func, compiled_function.compile
    )
    return compiled_function


def _compile_alone(function_cache: Any, function: Callable, compile_function: Callable) -> Callable:
    """A numba function's method that compiles it, which waits where another process compiles the same one.

    The cache is made safe: file names that do not depend on a shared counter, and stamps of the sources.
    """
    file = getattr(function_cache, "_cache_file", None)  # there is none where nothing is kept
    if file is None:
        return compile_function
    stem = file._index_name.removesuffix(".nbi")
    file._data_name = lambda number: f"{stem}.{uuid4().hex[:12]}.nbc"
    file._source_stamp = source_checksum(*_compiled_source_files(function))
    file._load_index = _or_none(file._load_index)
    lock = KernelLock(Path(function_cache.cache_path) / f"{stem}.lock")
    load_after_others(function_cache, lock)

    def compile_alone(*signature: Any) -> Any:
        try:
            return compile_function(*signature)
        finally:
            lock.give_back()

    return compile_alone


def callback(function: Callable, callback_signature: Any) -> Any:
    """C callback with a signature, cached on disk as kernels are; a kernel that the function calls is one of its
    globals."""
    law: Any = CFunc(function, normalize_signature(callback_signature), {}, {})
    law.enable_caching()
    _compile_alone(law._cache, function, law.compile)()
    return law


def _without_literals(compiled_function: Any) -> None:
    """Have the function compiled once for all literal numbers of its callers; numba would compile it for each
    number."""
    template = compiled_function.get_call_template

    def plain(argument_types: Any, keywords: dict[str, Any]) -> Any:
        return template(
            tuple(unliteral(each) for each in argument_types),
            {name: unliteral(each) for name, each in keywords.items()},
        )

    compiled_function.get_call_template = plain


def _or_none(load_index: Callable[[], dict]) -> Callable[[], dict]:
    """Wrapper of a cache index reader that returns an empty index if older sources wrote the index, with classes that
    no longer exist."""

    def read() -> dict:
        try:
            return load_index()
        except (AttributeError, ImportError):
            return {}

    return read


def closure_with_unique_name(closure: Any, *name_parts: Any) -> Any:
    """The closure, renamed after ``name_parts`` so that its name is unique among its factory's closures; must be done
    before compiling."""
    closure.__qualname__ = closure.__name__ = "_".join([closure.__name__, *(str(part) for part in name_parts)])
    return closure


@cache
def folder_checksum(source_folder: Path) -> int:
    """Checksum of all sources in a folder and in the folders that all kernels share, with the tables beside them:
    whatever a kernel of this folder may contain."""
    sources = (
        path for place in sorted({source_folder, *COMMON}) for path in sorted(place.iterdir()) if path.suffix in SOURCES
    )
    return zlib.crc32(b"".join(path.read_bytes() for path in sources))


def _compiled_source_files(function: Any) -> list[Path]:
    """Source files of a function and of the compiled functions among its globals."""
    called = [function.__globals__.get(name) for name in function.__code__.co_names]
    functions = [function, *(each.py_func for each in called if hasattr(each, "py_func"))]
    return [Path(each.__code__.co_filename) for each in functions]


def source_checksum(kernel_file: Path, *called_kernels: Path) -> int:
    """Checksum of all sources that a kernel in ``kernel_file`` may contain: the sources of its folder, and the kernels
    of ``called_kernels`` and of all files that these import."""
    made_of = {*called_kernels, *(path for each in (kernel_file, *called_kernels) for path in _imported(each))}
    elsewhere = sorted(path for path in made_of if path.parent not in (kernel_file.parent, *COMMON))
    return zlib.crc32(b"".join(path.read_bytes() for path in elsewhere), folder_checksum(kernel_file.parent))


def _imported(source_file: Path) -> set[Path]:
    """Files with compiled kernels that a file imports, directly or through other such files."""
    imported, left = set[Path](), [source_file]
    while left:
        new = _imported_kernel_files(left.pop()) - imported
        imported |= new
        left += new
    return imported


@cache
def _imported_kernel_files(source_file: Path) -> frozenset[Path]:
    """Files with compiled kernels that a file's import statements name; read from the text, without importing."""
    if not source_file.is_file():
        return frozenset()
    places = [
        ROOT.joinpath(*module.split("."), *name)
        for module, *names in IMPORT.findall(source_file.read_text())
        for name in ((), *((part.split()[0],) for part in "".join(names).split(",") if part.strip()))
    ]
    files = {place.with_suffix(".py") for place in places}
    return frozenset(
        path for path in files if path.is_file() and "from models.machine.compiled import" in path.read_text()
    )
