"""Definition of a hard case, and how an implementation's answer to it is judged."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, get_args

from models.core.errors import InputError, RunFailed
from validation.common.rows import Independence

Word = Literal["right", "refused", "raised", "SILENT"]
WORDS: tuple[Word, ...] = get_args(Word)
IMPLEMENTATIONS = ("reference", "exudyn", "mujoco")


@dataclass(frozen=True)
class Case:
    """One hard case.

    Attributes
    ----------
    hard : what makes it hard; check : the invariant or the exact answer, as a phrase
    unit, tolerance, why : of the error, and the reason for the tolerance
    error : (implementation, folder for input files) -> the measured error
    expected : the outcome where it is not "right"
    against : how far the answer it is judged by is from the implementations
    naive : measures what an obvious build without the guard or rule does, as a phrase; None if nothing is shown
    once : whether no implementation has a part in it, so that it is judged once for all of them
    """

    name: str
    hard: str
    check: str
    unit: str
    tolerance: float
    why: str
    error: Callable[[str, Path], float]
    expected: Mapping[str, Word] = field(default_factory=dict)
    naive: Callable[[Path], str] | None = None
    against: Independence = "closed form"
    once: bool = False

    def wanted(self, implementation: str) -> Word:
        """The outcome that an implementation must have in this case."""
        return self.expected.get(implementation, "right")

    def judged(self) -> tuple[str, ...]:
        """The implementations in which this case is judged."""
        return IMPLEMENTATIONS[:1] if self.once else IMPLEMENTATIONS

    def independence(self, implementation: str) -> Independence:
        """How independent the expected answer is of an implementation. The tight solution uses the reference's
        equations, so it is shared for the reference only."""
        return "shared kernel" if self.against == "native" and implementation == "reference" else self.against


@dataclass(frozen=True)
class CaseOutcome:
    """Outcome of a hard case. word : how it ended; error : in the case's unit, None if there is no answer; message :
    text of the exception."""

    word: Word
    error: float | None = None
    message: str = ""


def judge(case: Case, implementation: str, folder: Path) -> CaseOutcome:
    """Outcome of a case in one implementation; only the project's own exceptions count as outcomes, all others pass
    through."""
    try:
        error = float(case.error(implementation, folder))
    except InputError as refusal:
        return CaseOutcome("refused", message=str(refusal))
    except RunFailed as failure:
        return CaseOutcome("raised", message=str(failure))
    return CaseOutcome("right" if error <= case.tolerance else "SILENT", error)
