"""Protocols of a work-precision problem and of the solver that computes it with one setting."""

from dataclasses import dataclass
from typing import Any, Protocol


@dataclass(frozen=True)
class Setting:
    """One setting with which a problem is solved: an engine, a method, and its step, tolerance or number of cells.

    engine, method : together the name of a work-precision curve
    value : step in s, relative tolerance where ``adaptive``, or 1 by the number of cells where ``cells``
    order : declared order of the method, 0 if it varies or is not kept on this problem; then
    nominal : what it is on smooth ones
    stages : force evaluations per step, 0 where they are not fixed
    default : whose default setting this is, "" for no one's
    """

    engine: str
    method: str
    value: float
    order: int
    adaptive: bool = False
    stages: int = 0
    default: str = ""
    cells: bool = False
    nominal: int = 0

    @property
    def curve(self) -> str:
        """Name of the work-precision curve to which the setting belongs."""
        return f"{self.engine} {self.method}"

    def label(self) -> str:
        """The setting as text: a step in ms, a tolerance, or a number of cells along a contact."""
        if self.cells:
            return f"{round(1.0 / self.value)} cells"
        return f"tolerance {self.value:.3g}" if self.adaptive else f"{1e3 * self.value:.3g} ms"


class ProblemSolver(Protocol):
    """A model of a problem that has been built and can be run."""

    def run(self) -> Any:
        """Solve the problem and return its solution; raises RunFailed rather than give a wrong solution."""
        ...


class WorkPrecisionProblem(Protocol):
    """Protocol of a problem whose cost and error the work-precision runner measures.

    key : part of the rows' names; title : what is computed; note : what a reader of its figure must know;
    duration : of the run, s; units : unit of each error, the quantity that
    tolerances are set on first; reference : how the reference was made, in words; uncertainty : largest
    difference between its solvers, per quantity; bound : an error above it is not an answer any more;
    tolerances : for the table of cheapest settings.
    """

    key: str
    title: str
    note: str
    duration: float
    units: dict[str, str]
    reference: str
    uncertainty: dict[str, float]
    bound: float
    tolerances: tuple[float, ...]

    def settings(self, quick: bool) -> tuple[Setting, ...]:
        """All solver settings to try, or the few that quick runs use."""
        ...

    def setting(self, engine: str, method: str, step_or_tolerance: float) -> Setting:
        """The solver setting of this problem that has this engine, this method, and this step (s) or tolerance."""
        ...

    def build(self, setting: Setting) -> ProblemSolver:
        """A model of the problem, ready to run with a setting; raises Refused where the engine would give a wrong
        solution.
        """
        ...

    def errors(self, solution: Any) -> dict[str, float]:
        """Largest error of each quantity over a run, in the units of ``units``. Problems may also judge the run's
        assumptions; work-precision curves then mark points that break one.
        """
        ...
