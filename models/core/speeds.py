"""The speeds of a scene: a range or a list."""

import numpy as np
from pydantic import Field

from models.core.errors import InputError
from models.core.strict import Strict, quantity


class Speeds(Strict):
    """[speeds]: constant ones, from start to stop, or the values of a list."""

    start: float | None = quantity("m/s", "first speed", default=None)
    stop: float | None = quantity("m/s", "last speed", default=None)
    count: int = Field(default=25, ge=2, le=10_000, description="number of speeds")
    values: list[float] = Field(default_factory=list, description="speeds in m/s instead")

    def all(self) -> np.ndarray:
        """All speeds, m/s, from the range or from the list."""
        return np.array(self.values) if self.values else np.linspace(self.start, self.stop, self.count)  # type: ignore[arg-type]


def check_speeds(scene_path: str, speeds: Speeds) -> None:
    """Raise InputError for a speed of 0, half a range, or a range beside a list."""
    for i, value in enumerate(speeds.values):
        if not (np.isfinite(value) and value > 0.0):
            raise InputError(
                scene_path, f"speeds.values.{i}", value, "must be above 0, in m/s: at standstill nothing moves"
            )
    for name in ("start", "stop", "count"):
        if speeds.values and name in speeds.model_fields_set:
            allowed = "is not read beside a list of speeds: drop one of them"
            raise InputError(scene_path, f"speeds.{name}", getattr(speeds, name), allowed)
    for name in ("start", "stop"):
        if not speeds.values and getattr(speeds, name) is None:
            raise InputError(scene_path, f"speeds.{name}", None, "is missing (m/s)")
