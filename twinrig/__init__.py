"""twinrig as a library: scenes of every system, run, compared and priced from Python.

    import twinrig

    result = twinrig.run("study_road", "mujoco", set={"run.duration": 2.0})
    print(result)
    result.plot("f1", "f2")

A scene is the name of a shipped scene, a file, a table of nested dictionaries, or what ``load`` returns. What the
command line refuses is refused here with the same messages: ``InputError`` for what was asked wrongly, ``RunFailed``
for a run without an answer. Axes, signs and units stand in ``models``.
"""

from typing import TYPE_CHECKING, Any

from twinrig import shadowed

shadowed.check()

from models.core.errors import InputError, RunFailed  # noqa: E402  only ours, as was just checked
from twinrig.calls import choose, compare, export, load, price, read, run, validate  # noqa: E402

if TYPE_CHECKING:
    from twinrig.report import Report
    from twinrig.result import Result
    from twinrig.scene import Scene

__all__ = [
    "InputError",
    "Report",
    "Result",
    "RunFailed",
    "Scene",
    "choose",
    "compare",
    "export",
    "load",
    "price",
    "read",
    "run",
    "validate",
]

_CLASSES = {"Report": "twinrig.report", "Result": "twinrig.result", "Scene": "twinrig.scene"}
"""Module of each public class, imported at its first use, because these imports take most of the time."""


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name in _CLASSES:
        return getattr(import_module(_CLASSES[name]), name)
    if name == "__version__":
        from importlib.metadata import version

        return version("twinrig")
    from models.core.errors import nearest_names_phrase

    raise AttributeError(f"twinrig has no {name!r}{nearest_names_phrase(name, tuple(__all__))}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
