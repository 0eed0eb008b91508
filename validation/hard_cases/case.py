"""Definition of a hard case, and how the outcome of an implementation is judged."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, get_args

from models.core.errors import InputError, RunFailed
from validation.common.rows import Independence

OutcomeWord = Literal["right", "refused", "raised", "SILENT"]
WORDS: tuple[OutcomeWord, ...] = get_args(OutcomeWord)
IMPLEMENTATIONS = ("reference", "exudyn", "mujoco")


@dataclass(frozen=True)
class HardCase:
    """A hard case, judged in each implementation.

    Attributes
    ----------
    difficulty, exact_answer : why the case is hard, and the invariant or exact answer, as phrases
    unit, tolerance, tolerance_reason : unit and tolerance of the error, and the reason for the tolerance
    error_function : function of the implementation and a folder for input files that returns the error
    expected_outcomes : outcomes other than "right", by implementation
    naive_result : function that returns, as a phrase, what code without the guard or rule does; None if there is none
    answer_independence : how independent the exact answer is of the implementations
    is_without_engine : whether no implementation takes part, so that the case is judged only once
    """

    name: str
    difficulty: str
    exact_answer: str
    unit: str
    tolerance: float
    tolerance_reason: str
    error_function: Callable[[str, Path], float]
    expected_outcomes: Mapping[str, OutcomeWord] = field(default_factory=dict)
    naive_result: Callable[[Path], str] | None = None
    answer_independence: Independence = "closed form"
    is_without_engine: bool = False

    def wanted_outcome(self, engine_name: str) -> OutcomeWord:
        """The outcome that an implementation must have in this case."""
        return self.expected_outcomes.get(engine_name, "right")

    def judged_engines(self) -> tuple[str, ...]:
        """Names of the implementations in which this case is judged."""
        return IMPLEMENTATIONS[:1] if self.is_without_engine else IMPLEMENTATIONS

    def independence(self, engine_name: str) -> Independence:
        """How independent the exact answer is of an implementation. The tight-tolerance solution uses the reference's
        equations, so that for the reference it is a shared kernel."""
        return (
            "shared kernel"
            if self.answer_independence == "native" and engine_name == "reference"
            else self.answer_independence
        )


@dataclass(frozen=True)
class CaseOutcome:
    """Outcome of a hard case. word: "right", "refused", "raised" or "SILENT"; error: in the case's unit, None without a
    result; message: text of the exception."""

    word: OutcomeWord
    error: float | None = None
    message: str = ""


def judge(case: HardCase, engine_name: str, work_folder: Path) -> CaseOutcome:
    """Outcome of a case in an implementation. Only InputError and RunFailed count as outcomes; other exceptions pass
    through."""
    try:
        error = float(case.error_function(engine_name, work_folder))
    except InputError as refusal:
        return CaseOutcome("refused", message=str(refusal))
    except RunFailed as failure:
        return CaseOutcome("raised", message=str(failure))
    return CaseOutcome("right" if error <= case.tolerance else "SILENT", error)
