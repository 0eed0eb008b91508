"""Random recordings of a virtual measurement, whose section forces are computed in random engines.

The truth, measurement and run, has steps a twelfth as long: by their order of 4 its errors are a ten-thousandth.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from models.core.discretisation import errors_of
from models.core.errors import RunFailed
from models.core.result import Result
from models.engines.cut_vehicle import ENGINES
from models.systems.measured.run import run
from models.systems.measured.scene import build
from validation.stated_errors.sample import Sample, drawn_samples
from validation.stated_errors.systems.hub_forces import counted_forces

FINER_STEPS = 12
"""Times that the truth's steps are shorter."""


def samples(sample_count: int, seed: int) -> Iterator[Sample]:
    """``sample_count`` samples from random recordings whose runs come to an end."""
    return drawn_samples(sample_count, seed, _draw_recording)


def _draw_recording(random: np.random.Generator) -> Sample:
    """Sample from one random recording; raises before the run if the step would be unstable."""
    engine = str(random.choice(ENGINES))
    return _sample_of_recording(_table(random), engine)


def _table(random: np.random.Generator) -> dict[str, Any]:
    """Table of a random virtual measurement. The steps of the road run divide its sampling period; the steps of the
    driven run are equal to it."""
    period, steps_per_sample = float(f"{10.0 ** random.uniform(-2.9, -2.1):.3g}"), int(random.choice([1, 2]))
    road = {
        "iso8608": str(random.choice(list("BCD"))),
        "speed": random.uniform(15.0, 45.0),
        "seed": int(random.integers(99)),
    }
    return {
        "title": f"drawn, every {period:g} s, {steps_per_sample} steps of the road each",
        "system": "measured",
        "vehicle": {"file": "r19_free"},
        "virtual": {
            "road": road,
            "duration": period * int(random.uniform(2.0, 4.0) / period),
            "sampling_rate": 1.0 / period,
            "step": period / steps_per_sample,
            "frame": str(random.choice(["hub", "body"])),
            "faults": {"noise": {"force": random.uniform(0.0, 10.0), "angle": 1e-3, "angular rate": 3e-3}},
            "format": "csv",
        },
        "stabilise": {"method": str(random.choice(["none", "kalman", "prescribed"])), "smoothing": 3.0},
    }


def _sample_of_recording(table: dict[str, Any], engine: str) -> Sample:
    """Run a recording with its stated error, and compute its true error."""
    scene = build(table, "drawn.toml")
    with counted_forces() as calls:
        try:
            stated_run = run(scene, engine, error=True)
        except RunFailed as error:
            if error.partial is None:
                raise
            stated_run = error.partial
    virtual = table["virtual"] | {"step": table["virtual"]["step"] / FINER_STEPS}
    truth = run(
        build(table | {"virtual": virtual, "run": {"step": 1.0 / (FINER_STEPS * virtual["sampling_rate"])}}), engine
    )
    steps = 4.0 * (round(virtual["duration"] / table["virtual"]["step"]) + stated_run.counts()["steps"])
    title = f"{table['title']}, {table['stabilise']['method']}"
    return Sample(title, engine, errors_of(stated_run), _true_errors(stated_run, truth), steps, sum(calls) - steps)


def _true_errors(stated_result: Result, truth: Result) -> dict[str, float]:
    """True errors of every channel whose error is stated."""
    mine, fine = (run_result.detail.outcome for run_result in (stated_result, truth))
    return {
        name: float(np.sqrt(np.mean((mine.samples(name) - fine.samples(name)[: mine.done]) ** 2)))
        for name in errors_of(stated_result)
    }
