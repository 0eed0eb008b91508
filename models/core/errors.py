"""The two errors that a user can meet: an input that cannot be used, and a run that failed."""

from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # the command line imports this file before it knows whether it will compute anything
    import numpy as np

LONGEST_VALUE_TEXT = 80
"""Most characters of an offending value that an error message shows."""
MOST_NAMES = 40
"""Most accepted names that an error message lists in full; beyond this number only the most similar names are
listed."""


class InputError(ValueError):
    """Error for user input that cannot be used; its text is one complete message.

    Parameters
    ----------
    file : name of the file (or ``--set``), "" if there is none
    place : key, row or column within the file
    value : the offending value, None if there is none to show
    allowed : what would have been accepted, as a phrase
    choices : accepted names, from which the one nearest to a text value, or else to the key, is offered
    """

    def __init__(self, file: object, place: str, value: Any, allowed: str, choices: tuple[str, ...] = ()) -> None:
        self.file, self.place, self.value, self.allowed = str(file), place, value, allowed
        self.choices = choices
        location = ": ".join(text for text in (str(file), place) if text)
        name = value if isinstance(value, str) else place.rpartition(".")[2]
        super().__init__(f"{location}{_value_text(value)}: {allowed}{nearest_names_phrase(name, choices)}")

    def __reduce__(self) -> tuple[Any, ...]:
        """Arguments for recreating the error in another process."""
        return type(self), (self.file, self.place, self.value, self.allowed, self.choices), vars(self)


def _value_text(shown_value: Any) -> str:
    """Text `` = value`` as a scene file would hold the value, cut to a readable length; empty for None."""
    if shown_value is None:
        return ""
    plain = shown_value.tolist() if hasattr(shown_value, "tolist") else shown_value
    text = str(plain).lower() if isinstance(plain, bool) else repr(plain)
    return f" = {text if len(text) <= LONGEST_VALUE_TEXT else text[: LONGEST_VALUE_TEXT - 3] + '...'}"


def nearest_names_phrase(unknown_name: object, choices: tuple[str, ...]) -> str:
    """Phrase that lists the accepted names and proposes the one most similar to ``unknown_name``."""
    if not choices:
        return ""
    listed, omitted_text = sorted(choices), ""
    if len(choices) > MOST_NAMES:
        listed = get_close_matches(str(unknown_name), choices, n=5, cutoff=0.3) or listed[:5]
        omitted_text = f", and {len(choices) - len(listed)} others"
    return f" (allowed: {', '.join(listed)}{omitted_text}){suggestion_phrase(unknown_name, choices)}"


def suggestion_phrase(unknown_name: object, choices: tuple[str, ...]) -> str:
    """Phrase "did you mean ..." with the accepted name most similar to ``unknown_name``, regardless of upper and lower
    case; empty if none is similar."""
    lower = {choice.casefold(): choice for choice in choices}
    match = get_close_matches(str(unknown_name).casefold(), lower, n=1, cutoff=0.6)
    return f"; did you mean {lower[match[0]]!r}?" if match else ""


def similar_file(missing_path: Path) -> str:
    """Phrase "did you mean ..." with the most similar name among the files of the same kind in the folder of
    ``missing_path``."""
    try:
        stems = tuple(p.stem for p in missing_path.parent.iterdir() if p.suffix == missing_path.suffix and p.is_file())
    except OSError:
        return ""
    return suggestion_phrase(missing_path.stem, stems).replace("'?", f"{missing_path.suffix}'?")


class RunFailed(RuntimeError):
    """Error for a simulation that did not give a complete, finite result.

    ``partial`` is what the run had recorded until then, where its system keeps that.

    Parameters
    ----------
    engine : name of the engine
    reason : what was found, as a phrase
    time : last time (s) with a good state, None if there is none
    state : the last good state, shape (8,) or None
    """

    partial: Any = None

    def __init__(self, engine: str, reason: str, time: float | None = None, state: "np.ndarray | None" = None) -> None:
        self.engine, self.reason, self.time, self.state = engine, reason, time, state
        since = "" if time is None else f" (last good state at t = {time:.6g} s)"
        super().__init__(f"{engine}: {reason}{since}")

    def __reduce__(self) -> tuple[Any, ...]:
        """Arguments for recreating the error in another process, with the recorded state."""
        return type(self), (self.engine, self.reason, self.time, self.state), vars(self)


class Refused(InputError):
    """Error for a valid scene that needs something which the engine does not compute correctly."""

    def __init__(self, engine: str, reason: str, file: str = "") -> None:
        self.engine, self.why = engine, reason
        super().__init__(file, f"engines.{engine}" if file else engine, None, reason)

    def __reduce__(self) -> tuple[Any, ...]:
        """Arguments for recreating the error in another process."""
        return type(self), (self.engine, self.why, self.file), vars(self)
