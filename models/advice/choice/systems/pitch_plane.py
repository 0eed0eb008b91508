"""The pitch-plane vehicle: quantities are the channels of its result."""

import time
from typing import Any

from models.advice.choice.answer import Answer, Quantity
from models.engines.protocol import build
from models.systems.pitch_plane.run import outputs
from models.systems.pitch_plane.scene import Scene, assemble, settings_of

ENGINE, WINDOWED = "reference", True
CALLS = {"RK4": 4, "RK44": 4, "Euler": 1}
"""Calls of a step of methods that do not count them."""


def answer(scene: Scene, engine: str) -> Answer:
    """Run the scene."""
    assembly, own = assemble(scene), settings_of(scene, engine)
    model = build(engine, assembly, own)
    begun = time.process_time()
    run = model.run()
    found = outputs(assembly, run, model)
    seconds = time.process_time() - begun
    counts = {"steps": run.counts.get("steps", len(run.times) - 1), "states": run.states.shape[1]}
    counts["calls"] = run.counts.get("force calls", CALLS.get(own.integrator, 1) * counts["steps"])
    return Answer({name: Quantity(unit, (values,)) for name, (unit, _, values) in found.items()}, counts, seconds)


def steps(scene: Scene) -> int:
    """Steps of the run."""
    return round(scene.run.duration / scene.run.step)


parts = steps


def shorten(table: dict[str, Any], scene: Scene, steps: int) -> None:
    """So many steps of the scene's own."""
    table["run"] |= {"duration": steps * scene.run.step}
    table["run"].pop("output_step", None)


def coarsen(table: dict[str, Any], scene: Scene, times: int) -> None:
    """Steps so many times as long, those of every engine; all of them are kept."""
    table["run"] |= {"step": times * scene.run.step}
    table["run"].pop("output_step", None)
    for own in table.get("engines", {}).values():
        if "step" in own:
            own["step"] *= times
