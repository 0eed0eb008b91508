"""Scene table [engines.NAME]: an integrator that controls its error, in place of Runge-Kutta 4."""

from collections.abc import Mapping

from pydantic import Field

from models.core.errors import InputError
from models.core.strict import Strict
from models.engines.catalogue import ADAPTIVE

NO_ESTIMATE = "its steps are kept to a tolerance; for an error leave engines.NAME out: Runge-Kutta 4 tells it"
"""Reason why a run with an adaptive integrator states no error: the error of its input would be missing."""


class AdaptiveEngineTable(Strict):
    """[engines.NAME]: in place of Runge-Kutta 4 an integrator of this engine that chooses its own steps."""

    integrator: str = Field(description="DOPRI5 or ODE23 of exudyn; DOP853, Radau or LSODA of the reference")
    tolerance: float = Field(default=1e-8, ge=1e-13, le=1e-3, description="of every step, relative; absolute: 1/100")


def check_engines(scene_path: str, engine_tables: Mapping[str, AdaptiveEngineTable]) -> None:
    """Raise InputError for an engine, or an integrator of an engine, that cannot choose its own steps."""
    for engine, adaptive in engine_tables.items():
        if engine not in ADAPTIVE:
            allowed = "no engine with integrators that pick their own steps"
            raise InputError(scene_path, f"engines.{engine}", engine, allowed, tuple(ADAPTIVE))
        if adaptive.integrator not in ADAPTIVE[engine]:
            allowed = "no integrator of this engine that picks its own steps"
            raise InputError(scene_path, f"engines.{engine}.integrator", adaptive.integrator, allowed, ADAPTIVE[engine])


def plan_lines(engine_tables: Mapping[str, AdaptiveEngineTable], row_spacing: float) -> list[tuple[str, str]]:
    """Lines of a plan, heading and text, on the integrators that replace Runge-Kutta 4, with rows every ``row_spacing``
    (s)."""
    return [
        (
            engine,
            f"{adaptive.integrator} in its place, which picks its own steps to {adaptive.tolerance:g}, "
            f"rows every {row_spacing:g} s",
        )
        for engine, adaptive in engine_tables.items()
    ]
