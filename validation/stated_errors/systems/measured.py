"""Stated errors of section forces, computed in random engines from random recordings of a virtual measurement.

The true solution, measurement and run, has steps a twelfth as long: with order 4 its errors are a ten-thousandth.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from models.core.discretisation import error_estimates_of
from models.core.errors import RunFailed
from models.core.result import Result
from models.engines.cut_vehicle import ENGINES
from models.systems.measured.run import run
from models.systems.measured.scene import build
from validation.stated_errors.sample import Sample, random_samples
from validation.stated_errors.systems.hub_forces import counting_force_calls

FINER_STEPS = 12
"""Ratio of the run's step to the step of the true solution."""


def samples(sample_count: int, seed: int) -> Iterator[Sample]:
    """Yield ``sample_count`` samples from random recordings; a recording is replaced if it is refused or its run
    fails."""
    return random_samples(sample_count, seed, _sample_of_random_recording)


def _sample_of_random_recording(generator: np.random.Generator) -> Sample:
    """Sample from a random recording; raises before the run if the step would be unstable."""
    engine = str(generator.choice(ENGINES))
    return _sample_of_recording(_random_scene_table(generator), engine)


def _random_scene_table(generator: np.random.Generator) -> dict[str, Any]:
    """Table of a random virtual measurement. The steps of the run on the road divide the sampling period; the steps of
    the run under the measured forces are equal to it."""
    period, steps_per_sample = float(f"{10.0 ** generator.uniform(-2.9, -2.1):.3g}"), int(generator.choice([1, 2]))
    road = {
        "iso8608": str(generator.choice(list("BCD"))),
        "speed": generator.uniform(15.0, 45.0),
        "seed": int(generator.integers(99)),
    }
    return {
        "title": f"drawn, every {period:g} s, {steps_per_sample} steps of the road each",
        "system": "measured",
        "vehicle": {"file": "r19_free"},
        "virtual": {
            "road": road,
            "duration": period * int(generator.uniform(2.0, 4.0) / period),
            "sampling_rate": 1.0 / period,
            "step": period / steps_per_sample,
            "frame": str(generator.choice(["hub", "body"])),
            "faults": {"noise": {"force": generator.uniform(0.0, 10.0), "angle": 1e-3, "angular rate": 3e-3}},
            "format": "csv",
        },
        "stabilise": {"method": str(generator.choice(["none", "kalman", "prescribed"])), "smoothing": 3.0},
    }


def _sample_of_recording(scene_table: dict[str, Any], engine: str) -> Sample:
    """Sample from the run of a recording with its stated error; the true error is computed by a finer measurement and
    run."""
    scene = build(scene_table, "drawn.toml")
    with counting_force_calls() as calls:
        try:
            stated_run = run(scene, engine, error=True)
        except RunFailed as error:
            if error.partial is None:
                raise
            stated_run = error.partial
    virtual = scene_table["virtual"] | {"step": scene_table["virtual"]["step"] / FINER_STEPS}
    truth = run(
        build(scene_table | {"virtual": virtual, "run": {"step": 1.0 / (FINER_STEPS * virtual["sampling_rate"])}}),
        engine,
    )
    steps = 4.0 * (round(virtual["duration"] / scene_table["virtual"]["step"]) + stated_run.counts()["steps"])
    title = f"{scene_table['title']}, {scene_table['stabilise']['method']}"
    return Sample(
        title, engine, error_estimates_of(stated_run), _true_errors(stated_run, truth), steps, sum(calls) - steps
    )


def _true_errors(stated_result: Result, fine_result: Result) -> dict[str, float]:
    """True root mean square error of every channel whose error is stated, against a finer run."""
    mine, fine = (run_result.detail.outcome for run_result in (stated_result, fine_result))
    return {
        name: float(np.sqrt(np.mean((mine.samples(name) - fine.samples(name)[: mine.done]) ** 2)))
        for name in error_estimates_of(stated_result)
    }
