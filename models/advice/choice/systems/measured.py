"""Recordings of a vehicle in space, for a choice of effects: quantities are the section forces, with roll and pitch
held as in the scene.
"""

import math
import tempfile
from pathlib import Path
from typing import Any

from models.advice.choice.answer import Quantity, RunQuantities
from models.core.errors import InputError
from models.systems.measured.clock import FEWEST_SAMPLES
from models.systems.measured.run import RecordingAnalysis, read_files, run
from models.systems.measured.scene import MeasuredScene

DEFAULT_ENGINE, PART_REPRESENTS_RUN = "mujoco", True
SHORTEST_PART_STEPS = 60
"""Number of steps of which whole multiples make up the shortest part of a recording, so that it can be computed with
longer steps, too.
"""


def computed_quantities(scene: MeasuredScene, engine: str, with_error_estimate: bool = False) -> RunQuantities:
    """Bring the measurement onto one clock, run the vehicle, and collect the section forces; the seconds are those of
    the time integration.
    """
    if scene.vehicle.file is None:
        allowed = "a recording is priced and its effects chosen for a vehicle in space: name vehicle.file"
        raise InputError(scene.file, "vehicle.parameters", scene.vehicle.parameters, allowed)
    result = run(scene, engine, error=with_error_estimate)
    exam: RecordingAnalysis = result.detail
    assert exam.outcome is not None
    forces = [answer for answer in exam.outcome.answers if answer.quantity != "acceleration"]
    quantities = {answer.name: Quantity(answer.unit, (exam.outcome.samples(answer),)) for answer in forces}
    counts = result.counts()
    called = {"steps": counts["steps"], "calls": counts["force calls"], "states": counts["states"]}
    return RunQuantities(quantities, called, result.seconds)


def step_count(scene: MeasuredScene) -> int:
    """Number of steps of a run."""
    return round(_period_and_duration(scene)[1] / _time_step(scene))


divisible_step_count = step_count


def _time_step(scene: MeasuredScene) -> float:
    """Step of the run (s): the scene's, else the period of the recording."""
    return scene.run.step or _period_and_duration(scene)[0]


def _period_and_duration(scene: MeasuredScene) -> tuple[float, float]:
    """Sampling period and duration (s) of the recording. For a virtual measurement they are known without a run."""
    if scene.virtual is not None:
        full_duration = scene.virtual.duration - scene.clock.start
        return 1.0 / (scene.clock.rate or scene.virtual.sampling_rate), min(
            full_duration, scene.clock.duration or full_duration
        )
    with tempfile.TemporaryDirectory() as name:
        recording = read_files(scene, Path(name))
        return recording.period, recording.duration


def shorten_run(scene_table: dict[str, Any], scene: MeasuredScene, step_limit: int) -> None:
    """Edit ``scene_table`` to shorten the run to ``step_limit`` steps, but no less than a recording must have; a
    virtual measurement is shortened with it.
    """
    period, full_duration = _period_and_duration(scene)
    least_steps = SHORTEST_PART_STEPS * math.ceil(FEWEST_SAMPLES * period / (_time_step(scene) * SHORTEST_PART_STEPS))
    duration = min(max(step_limit, least_steps) * _time_step(scene), full_duration)
    if scene.virtual is None:
        scene_table.setdefault("clock", {})["duration"] = duration
    else:
        scene_table["virtual"]["duration"] = scene.clock.start + duration
        scene_table.get("clock", {}).pop("duration", None)


def lengthen_steps(scene_table: dict[str, Any], scene: MeasuredScene, step_factor: int) -> None:
    """Edit ``scene_table`` to multiply the step by ``step_factor``."""
    scene_table.setdefault("run", {})["step"] = step_factor * _time_step(scene)
