"""The systems that a scene can be of: a folder each, found by listing (``models.core.systems``).

``run(scene, engine)`` is the way from a scene of any system to its result.
"""

from importlib import import_module
from typing import Any

from models.core.result import Result
from models.core.systems import SYSTEMS


def run(scene: Any, engine: str = "", **run_options: Any) -> Result:
    """Run a scene in one engine; ``run_options`` is passed on to the system's own ``run``, for example the name of a
    manoeuvre.

    Raises InputError, Refused or RunFailed, never returns a partial run.
    """
    result: Result = import_module(f"{SYSTEMS[scene.system].package}.run").run(scene, engine, **run_options)
    return result
