"""Stated errors of random wheelsets; the true solutions have steps an eighth as long, or ten times as many cells.

The work is counted in cells of FASTSIM in a stage of a step, or in stages with the linear law. True solutions are runs
of the reference, from which the engines differ by 1e-11.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any
from unittest import mock

import numpy as np

from models.core.discretisation import RunSeries, error_estimates_of, nearest_rows
from models.core.result import Result
from models.rail.equations import WheelsetPath
from models.systems.wheelset import run as system
from models.systems.wheelset.of_scene import equations_of
from models.systems.wheelset.scene import WheelsetScene, build
from models.systems.wheelset.stated_error import principal_series, with_step_factor
from validation.stated_errors.sample import Sample, random_samples

ENGINES = ("reference", "exudyn", "mujoco")
FINER_STEPS, FINER_CELLS, MOST_CELLS = 8.0, 10, 200
"""Ratio of the run's step to the true solution's, of the true solution's cells to the run's, and most cells."""
LONGEST_STEP_FACTOR = 2.4
"""Longest step multiplied by the rate (1/s) of the fastest motion, the largest |eigenvalue|."""


def samples(sample_count: int, seed: int) -> Iterator[Sample]:
    """Yield ``sample_count`` samples from random wheelset scenes; scenes that fail or are refused are replaced."""
    return random_samples(sample_count, seed, lambda random: _sample_of_path(*_random_scene(random)))


def _random_scene(generator: np.random.Generator) -> tuple[WheelsetScene, str, float]:
    speed, profiled = float(generator.uniform(8.0, 90.0)), generator.random() < 0.25
    override = {
        "stiffness_x": 10.0 ** generator.uniform(4.7, 6.3),
        "damping_x": 10.0 ** generator.uniform(2.0, 4.0),
        "friction": generator.uniform(0.15, 0.5),
        "load": 10.0 ** generator.uniform(4.7, 5.2),
        "conicity": generator.uniform(0.03, 0.2),
    }
    law = "linear" if generator.random() < 0.2 else "fastsim"
    table: dict[str, Any] = {
        "title": "a random wheelset",
        "system": "wheelset",
        "wheelset": {"override": {name: float(value) for name, value in override.items()}},
        "contact": {"law": law} | ({"cells": int(generator.integers(5, 25))} if law == "fastsim" else {}),
        "speeds": {"values": [speed]},
        "run": {
            "displacement": float(generator.uniform(5e-4, 7e-3)),
            "speeds": [speed],
            "step": 1e-4,
            "duration": 1e-4,
        },
    }
    table |= {"profiles": {}} if profiled else {}
    equations = equations_of(build(table), "reference", speed)
    fastest = float(np.abs(np.linalg.eigvals(equations.state_matrix)).max())
    duration = float(generator.uniform(0.3, 2.0))
    steps = math.ceil(duration * fastest / (LONGEST_STEP_FACTOR * generator.uniform(0.1, 1.0)))
    table["run"] |= {"step": duration / steps, "duration": duration}
    return build(table), str(generator.choice(ENGINES)), speed


def _sample_of_path(scene: WheelsetScene, engine: str, speed: float) -> Sample:
    marched, march = list[float](), system.simulated_path

    def counted(other_scene: WheelsetScene, engine: str, speed: float) -> WheelsetPath:
        path = march(other_scene, engine, speed)
        marched.append((len(path.times) - 1) * _count_of_cells(other_scene))
        return path

    with mock.patch.object(system, "simulated_path", counted):
        run = system.run(scene, engine, speed, error=True)
    true = _true_errors(scene, run, lambda changed_scene: march(changed_scene, "reference", speed))
    estimates = error_estimates_of(run)
    name = f"{speed:.3g} m/s, step {scene.run.step:.2g} s, {scene.contact.law}, {scene.contact.cells} cells"
    name += ", profiles" if scene.profiles else ""
    true = {channel: true[channel] for channel in estimates}
    return Sample(name, engine, estimates, true, 4.0 * marched[0], 4.0 * sum(marched[1:]))


def _count_of_cells(scene: WheelsetScene) -> float:
    return scene.contact.cells**2 if scene.contact.law == "fastsim" else 1.0


def _true_errors(
    scene: WheelsetScene, run_result: Result, march_scene: Callable[[WheelsetScene], WheelsetPath]
) -> Mapping[str, float]:
    """True root mean square errors of a run's channels: by shorter steps, and by more cells ("NAME of cells")."""
    fine = principal_series(run_result.detail)
    true = _rms_differences(fine, principal_series(march_scene(with_step_factor(scene, 1.0 / FINER_STEPS))))
    if scene.contact.law == "linear":
        return true
    cells = min(FINER_CELLS * scene.contact.cells, MOST_CELLS)
    of_cells = _rms_differences(fine, principal_series(march_scene(with_step_factor(scene, 1.0, cell_count=cells))))
    return true | {f"{name} of cells": error for name, error in of_cells.items()}


def _rms_differences(fine_series: RunSeries, true_series: RunSeries) -> dict[str, float]:
    rows = nearest_rows(true_series.times, fine_series.times)
    return {
        name: float(np.sqrt(np.mean((values - true_series.channels[name][rows]) ** 2)))
        for name, values in fine_series.channels.items()
    }
