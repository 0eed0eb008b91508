"""Stated errors of random cut vehicles under hub forces of a virtual measurement, in random engines, steps and rates.

The true solution, measurement and run, has steps a twelfth as long: with order 4 its errors are a ten-thousandth, and
where wheels leave the road a hundredth.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from unittest import mock

import numpy as np

from models.core.discretisation import error_estimates_of
from models.core.errors import RunFailed
from models.core.result import Result
from models.core.trajectory import Trajectory
from models.engines.cut_vehicle import ENGINES, HubModel
from models.systems.hub_forces.run import principal_series, run
from models.systems.hub_forces.scene import HubScene, build
from validation.stated_errors.sample import Sample, random_samples

FINER_STEPS = 12
"""Ratio of the run's step to the step of the true solution."""


def samples(sample_count: int, seed: int) -> Iterator[Sample]:
    """Yield ``sample_count`` samples from random scenes of hub forces; a scene is replaced if it is refused or its run
    fails."""
    return random_samples(sample_count, seed, _sample_of_random_scene)


def _sample_of_random_scene(generator: np.random.Generator) -> Sample:
    """Sample from a random scene of hub forces; raises before the run if the step would be unstable."""
    engine = str(generator.choice(ENGINES))
    return _sample_of_run(build(_random_scene_table(generator), "drawn.toml"), engine)


def _random_scene_table(generator: np.random.Generator) -> dict[str, Any]:
    """Table of a random scene of hub forces, with a virtual measurement whose sampling period is a multiple of the
    step."""
    step, steps_per_sample = (
        float(f"{10.0 ** generator.uniform(-3.0, -1.9):.3g}"),
        int(generator.choice([1, 1, 2, 2, 3, 4])),
    )
    noise = str(generator.choice(["white", "none"]))
    return {
        "title": f"drawn, steps of {step:g} s, {steps_per_sample} a sample",
        "system": "hub-forces",
        "vehicle": {"file": str(generator.choice(["r19_free", "r19_ride"]))},
        "run": {
            "step": step,
            "duration": step * steps_per_sample * int(generator.uniform(0.8, 1.6) / (step * steps_per_sample)),
        },
        "road": {
            "iso8608": str(generator.choice(list("BCDE"))),
            "speed": generator.uniform(15.0, 60.0),
            "seed": int(generator.integers(1000)),
        },
        "forces": {
            "sampling_rate": 1.0 / (step * steps_per_sample),
            "frame": str(generator.choice(["hub", "body"])),
            "interpolation": str(generator.choice(["linear", "smooth"])),
            "noise": noise,
        },
        "angles": {"noise": noise},
        "effects": {"lift_off": {}} if generator.integers(4) == 0 else {},
        "stabilise": {"method": str(generator.choice(["none", "kalman", "prescribed"])), "smoothing": 3.0},
    }


def _sample_of_run(scene: HubScene, engine: str) -> Sample:
    """Sample from a run under hub forces with its stated error; the true error is computed by a finer run."""
    with counting_force_calls() as calls:
        stated_run = _run_with_error(scene, engine)
    errors, plain = error_estimates_of(stated_run), 2 * scene.step_count
    names = list(errors)
    title = f"{scene.title}, {scene.stabilise.method}, {scene.vehicle.file}"
    return Sample(
        title, engine, errors, _true_errors(scene, engine, stated_run, names), 4.0 * plain, sum(calls) - 4.0 * plain
    )


def _run_with_error(scene: HubScene, engine: str) -> Result:
    """Result of a run with its stated error; the partial result if the run stops early."""
    try:
        return run(scene, engine, error=True)
    except RunFailed as error:
        if error.partial is None:
            raise
        return error.partial


def _true_errors(scene: HubScene, engine: str, stated_result: Result, channel_names: list[str]) -> dict[str, float]:
    """True root mean square error of each channel in ``channel_names``, by a finer measurement and run."""
    fine = scene.model_copy(update={"run": scene.run.model_copy(update={"step": scene.run.step / FINER_STEPS})})
    vehicle = scene.cut_vehicle()
    truth, stated = (
        principal_series(vehicle, run(fine, engine).detail).channels,
        principal_series(vehicle, stated_result.detail).channels,
    )
    return {name: float(np.sqrt(np.mean((stated[name] - truth[name][::FINER_STEPS]) ** 2))) for name in channel_names}


@contextmanager
def counting_force_calls() -> Iterator[list[float]]:
    """Context that yields a list, to which every run of a cut vehicle within it adds its number of force
    evaluations."""
    calls, march = list[float](), HubModel.marched

    def counting(model: HubModel, q: np.ndarray, v: np.ndarray) -> Trajectory:
        calls.append(4.0 * model.steps)
        return march(model, q, v)

    with mock.patch.object(HubModel, "marched", counting):
        yield calls
