"""Random cut vehicles on hub forces of a virtual measurement, in random engines, steps and rates.

The truth, measurement and run, has steps a twelfth as long: by their order of 4 its errors are a ten-thousandth, and
where wheels leave the road a hundredth.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from unittest import mock

import numpy as np

from models.core.discretisation import errors_of
from models.core.errors import RunFailed
from models.core.result import Result
from models.core.trajectory import Trajectory
from models.engines.cut_vehicle import ENGINES, HubModel
from models.systems.hub_forces.run import principal_series, run
from models.systems.hub_forces.scene import HubScene, build
from validation.stated_errors.sample import Sample, drawn_samples

FINER_STEPS = 12
"""Times that the truth's steps are shorter."""


def samples(sample_count: int, seed: int) -> Iterator[Sample]:
    """``sample_count`` samples from random scenes whose runs come to an end."""
    return drawn_samples(sample_count, seed, _draw_scene)


def _draw_scene(random: np.random.Generator) -> Sample:
    """Sample from one random scene; raises before the run if the step would be unstable."""
    engine = str(random.choice(ENGINES))
    return _sample_of_run(build(_table(random), "drawn.toml"), engine)


def _table(random: np.random.Generator) -> dict[str, Any]:
    """Table of a random virtual measurement; its sampling period is a multiple of the step."""
    step, steps_per_sample = float(f"{10.0 ** random.uniform(-3.0, -1.9):.3g}"), int(random.choice([1, 1, 2, 2, 3, 4]))
    noise = str(random.choice(["white", "none"]))
    return {
        "title": f"drawn, steps of {step:g} s, {steps_per_sample} a sample",
        "system": "hub-forces",
        "vehicle": {"file": str(random.choice(["r19_free", "r19_ride"]))},
        "run": {
            "step": step,
            "duration": step * steps_per_sample * int(random.uniform(0.8, 1.6) / (step * steps_per_sample)),
        },
        "road": {
            "iso8608": str(random.choice(list("BCDE"))),
            "speed": random.uniform(15.0, 60.0),
            "seed": int(random.integers(1000)),
        },
        "forces": {
            "sampling_rate": 1.0 / (step * steps_per_sample),
            "frame": str(random.choice(["hub", "body"])),
            "interpolation": str(random.choice(["linear", "smooth"])),
            "noise": noise,
        },
        "angles": {"noise": noise},
        "effects": {"lift_off": {}} if random.integers(4) == 0 else {},
        "stabilise": {"method": str(random.choice(["none", "kalman", "prescribed"])), "smoothing": 3.0},
    }


def _sample_of_run(scene: HubScene, engine: str) -> Sample:
    """Run a scene with its stated error, and compute its true error by a finer run."""
    with counted_forces() as calls:
        stated_run = _run_with_error(scene, engine)
    errors, plain = errors_of(stated_run), 2 * scene.step_count
    names = list(errors)
    title = f"{scene.title}, {scene.stabilise.method}, {scene.vehicle.file}"
    return Sample(
        title, engine, errors, _true_errors(scene, engine, stated_run, names), 4.0 * plain, sum(calls) - 4.0 * plain
    )


def _run_with_error(scene: HubScene, engine: str) -> Result:
    """The run with its stated error; if the run fails on the way, its partial result."""
    try:
        return run(scene, engine, error=True)
    except RunFailed as error:
        if error.partial is None:
            raise
        return error.partial


def _true_errors(scene: HubScene, engine: str, stated_result: Result, names: list[str]) -> dict[str, float]:
    """True errors of every channel whose error is stated."""
    fine = scene.model_copy(update={"run": scene.run.model_copy(update={"step": scene.run.step / FINER_STEPS})})
    vehicle = scene.cut_vehicle()
    truth, stated = (
        principal_series(vehicle, run(fine, engine).detail).channels,
        principal_series(vehicle, stated_result.detail).channels,
    )
    return {name: float(np.sqrt(np.mean((stated[name] - truth[name][::FINER_STEPS]) ** 2))) for name in names}


@contextmanager
def counted_forces() -> Iterator[list[float]]:
    """Context that counts the force evaluations of every run."""
    calls, march = list[float](), HubModel.marched

    def counting(model: HubModel, q: np.ndarray, v: np.ndarray) -> Trajectory:
        calls.append(4.0 * model.steps)
        return march(model, q, v)

    with mock.patch.object(HubModel, "marched", counting):
        yield calls
