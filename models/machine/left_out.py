"""Optional libraries that are hidden from xarray in this process, since importing them takes longer than a short run.

xarray imports dask (with its cluster) and pint where they are installed, to ask whether an array is one of theirs. That
takes longer than all the rest of a short run, whose arrays are numpy's.
"""

import sys
from typing import Any

OF_LABELS = ("dask", "pint")
"""Optional array libraries that xarray looks for."""
SEEKER = "xarray"
"""Library that looks for the optional libraries; it remembers the result, so that nothing may be hidden after its
import."""


def hide_libraries(*library_names: str) -> None:
    """Make optional libraries appear as not installed in this process, until ``show_libraries`` is called.

    Those that are imported already stay, and all stay where xarray is: it may count on them.
    """
    modules: dict[str, Any] = sys.modules
    if SEEKER not in modules:
        for name in library_names:
            modules.setdefault(name, None)


def show_libraries(*library_names: str) -> None:
    """Undo ``hide_libraries`` for these libraries; must be called before one of them is imported."""
    modules: dict[str, Any] = sys.modules
    for name in library_names:
        if name in modules and modules[name] is None:
            del modules[name]
