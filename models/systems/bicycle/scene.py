"""Scenes of a bicycle: parameters, tyres, control, speeds at which eigenvalues are computed, and one run that begins
upright.
"""

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from models.bicycle.rolling_tyres import UNCHANGED_TYRE, BicycleTyre, RollingBicycle
from models.bicycle.whipple import HIGHEST_SPEED, SteeringControl, Whipple, load_bicycle
from models.core.errors import InputError
from models.core.scene_effects import extended_by_effects, with_effect_tables
from models.core.scene_file import SceneFile, checked
from models.core.steps import MOST_STEPS, dividing_step, step_divides
from models.core.strict import Strict, quantity

LARGEST_LEAN_RATE = 3.0
"""Largest lean rate (rad/s) at the start of a run. With a higher rate a bicycle lies on the ground before it steers."""


class BicycleTable(Strict):
    """[bicycle]: the bicycle's parameters, by the name of a parameter set or of the user's file."""

    parameters: str = Field(default="benchmark", description="a parameter set, or a TOML file with every parameter")


class BicycleRunTable(Strict):
    """[run]: a run that begins straight ahead and upright, with a lean rate."""

    speed: float = quantity("m/s", "speed at the start, backwards below 0", default=4.6, signed=True)
    lean_rate: float = quantity("rad/s", "lean rate at the start, to the right", default=0.5, signed=True)
    duration: float = quantity("s", "length of the run", default=5.0)
    step: float = quantity("s", "step of Runge-Kutta 4 in engines", default=2e-4)


class EigenvalueSpeedsTable(Strict):
    """[speeds]: speeds at which eigenvalues are computed, evenly spaced from start to stop (backwards below 0)."""

    start: float = quantity("m/s", "first speed", default=0.0, signed=True)
    stop: float = quantity("m/s", "last speed", default=10.0, signed=True)
    count: int = Field(default=101, ge=2, le=10_000, description="number of speeds")


class BicycleScene(SceneFile):
    """A scene of a bicycle: all tables of its scene file."""

    system: Literal["bicycle"] = "bicycle"
    study: str = Field(default="bicycle", description="the study that runs the scene")
    bicycle: BicycleTable = BicycleTable()
    tyres: BicycleTyre = UNCHANGED_TYRE
    control: SteeringControl = SteeringControl()
    speeds: EigenvalueSpeedsTable = EigenvalueSpeedsTable()
    run: BicycleRunTable = BicycleRunTable()
    effects: dict[str, Any] = Field(default_factory=dict, description="effects of your own, a table each")

    @cached_property
    def whipple(self) -> Whipple:
        """Parameters of the bicycle for the linear (Whipple) equations."""
        return load_bicycle(self.bicycle.parameters, self.folder, self.file, "bicycle.parameters")

    def bicycle_on_tyres(self) -> RollingBicycle:
        """Returns the bicycle on its tyres with the scene's control and effects."""
        return extended_by_effects(RollingBicycle(self.whipple, self.tyres, self.control), self)


def build(scene_tables: Mapping[str, Any], scene_path: str = "", scene_folder: Path = Path()) -> BicycleScene:
    """Build a checked bicycle scene from the nested tables of a scene file. Raises InputError for unknown keys and for
    values outside their ranges.
    """
    scene = checked(BicycleScene, scene_tables, scene_path, scene_folder)
    run, speeds = scene.run, scene.speeds
    for key_path, value, largest, unit in (
        ("run.speed", run.speed, HIGHEST_SPEED, "m/s"),
        ("run.lean_rate", run.lean_rate, LARGEST_LEAN_RATE, "rad/s"),
        ("speeds.start", speeds.start, HIGHEST_SPEED, "m/s"),
        ("speeds.stop", speeds.stop, HIGHEST_SPEED, "m/s"),
    ):
        if abs(value) > largest:
            raise InputError(scene_path, key_path, value, f"must be from -{largest:g} to {largest:g} {unit}")
    if speeds.start >= speeds.stop:
        raise InputError(scene_path, "speeds.stop", speeds.stop, f"must be above speeds.start = {speeds.start:g} m/s")
    if run.duration / run.step > MOST_STEPS:
        raise InputError(scene_path, "run.duration", run.duration, f"needs more than {MOST_STEPS:,} steps")
    if not step_divides(run.step, run.duration):
        allowed = (
            f"must divide run.duration = {run.duration:g} s; use for example {dividing_step(run.step, run.duration)}"
        )
        raise InputError(scene_path, "run.step", run.step, allowed)
    return with_effect_tables(scene)
