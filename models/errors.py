"""The two errors that a user can meet: an input that cannot be used, and a run that failed."""

from difflib import get_close_matches
from typing import Any

import numpy as np


class InputError(ValueError):
    """Something that the user wrote cannot be used; its text is one complete message.

    Parameters
    ----------
    file : name of the file (or ``--set``), "" if there is none
    place : key, row or column within the file
    value : the offending value, None if there is none to show
    allowed : what would have been accepted, as a phrase
    choices : accepted names, from which the nearest match is offered
    """

    def __init__(self, file: object, place: str, value: Any, allowed: str, choices: tuple[str, ...] = ()) -> None:
        self.file, self.place, self.value, self.allowed = str(file), place, value, allowed
        where = ": ".join(part for part in (str(file), place) if part)
        shown = "" if value is None else f" = {value!r}"
        if len(shown) > 120:
            shown = shown[:117] + "..."
        super().__init__(f"{where}{shown}: {allowed}{nearest(value, choices)}")


def nearest(value: object, choices: tuple[str, ...]) -> str:
    """Phrase that lists the accepted names and offers the one most like ``value``."""
    if not choices:
        return ""
    match = get_close_matches(str(value), choices, n=1, cutoff=0.5)
    offered = f"; did you mean {match[0]!r}?" if match else ""
    return f" (allowed: {', '.join(sorted(choices))}){offered}"


class RunFailed(RuntimeError):
    """A simulation that did not give a complete, finite answer.

    Parameters
    ----------
    engine : name of the engine
    reason : what was found, as a phrase
    time : last time (s) with a good state, None if there is none
    state : the last good state, shape (8,) or None
    """

    def __init__(self, engine: str, reason: str, time: float | None = None, state: np.ndarray | None = None) -> None:
        self.engine, self.reason, self.time, self.state = engine, reason, time, state
        since = "" if time is None else f" (last good state at t = {time:.6g} s)"
        super().__init__(f"{engine}: {reason}{since}")


class Refused(InputError):
    """A scene that is well written but asks an engine for something it does not do correctly."""

    def __init__(self, engine: str, why: str) -> None:
        super().__init__("", engine, None, why)
