"""Stated errors of random manoeuvres of cars; the true solution has ten times as many cells across and along the
contact patch, and steps an eighth as long, so that its errors are a hundredth or less."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from unittest import mock

import numpy as np

from models.core.discretisation import error_estimates_of
from models.core.errors import RunFailed
from models.core.result import Result
from models.core.trajectory import Trajectory
from models.engines.free_vehicle import ENGINES, FreeModel
from models.multibody.forces import CELLS
from models.systems.handling.run import SimulatedDrive, drive_run, principal_series, run
from models.systems.handling.scene import HandlingScene, build
from validation.stated_errors.sample import Sample, random_samples

FINER_CELLS, FINER_STEPS = 10, 8
"""Ratio of the true solution's number of cells along the contact patch, and of steps, to that of the run."""


def samples(sample_count: int, seed: int) -> Iterator[Sample]:
    """Yield ``sample_count`` samples from random manoeuvres; a scene is replaced if it is refused or its run fails."""
    return random_samples(sample_count, seed, _sample_of_random_manoeuvre)


def _sample_of_random_manoeuvre(generator: np.random.Generator) -> Sample:
    """Sample from a random manoeuvre; raises, before the error is estimated, if the step is too long for the tyres."""
    engine = str(generator.choice(ENGINES))
    return _sample_of_drive(build(_random_scene_table(generator), "drawn.toml"), engine)


def _random_scene_table(generator: np.random.Generator) -> dict[str, Any]:
    """Table of a random handling scene with one manoeuvre; its duration is a multiple of the step."""
    step, steps = float(f"{10.0 ** generator.uniform(-3.4, -2.3):.3g}"), int(generator.integers(120, 400))
    lasts = steps * step
    manoeuvre: dict[str, Any] = {
        "speed": generator.uniform(10.0, 35.0),
        "duration": lasts,
        "steer": [[0.1 * lasts, 0.0], [generator.uniform(0.3, 0.9) * lasts, generator.uniform(-0.08, 0.08)]],
        "rough": bool(generator.integers(2)),
    }
    if pedal := generator.choice(["brake", "drive", ""]):
        manoeuvre[str(pedal)] = [[0.2 * lasts, 0.0], [0.6 * lasts, generator.uniform(100.0, 2500.0)]]
    return {
        "title": f"drawn, steps of {step:g} s",
        "system": "handling",
        "tyres": {"friction": generator.uniform(0.3, 1.1), "cells": int(generator.integers(5, 20))},
        "road": {"iso8608": str(generator.choice(list("ABC"))), "seed": int(generator.integers(1000))},
        "run": {"step": step},
        "manoeuvres": {"drawn": manoeuvre},
    }


def _sample_of_drive(scene: HandlingScene, engine: str) -> Sample:
    """Sample from a run of a handling scene with its stated error; the true error is computed by a finer run."""
    with counting_force_calls() as calls:
        try:
            stated_run = run(scene, engine, error=True)
        except RunFailed as error:
            if error.partial is None:
                raise
            stated_run = error.partial
    errors, drive = error_estimates_of(stated_run), stated_run.detail
    return Sample(scene.title, engine, errors, _true_errors(scene, drive, engine, stated_run), calls[0], sum(calls[1:]))


def _true_errors(scene: HandlingScene, drive: SimulatedDrive, engine: str, stated_result: Result) -> dict[str, float]:
    """True root mean square error of every channel whose error is stated, by a finer run."""
    manoeuvre = scene.manoeuvres["drawn"]
    fine = scene.model_copy(update={"tyres": scene.tyres.model_copy(update={"cells": FINER_CELLS * scene.tyres.cells})})
    truth = principal_series(
        drive_run(engine, fine.handling("drawn"), manoeuvre.speed, manoeuvre.duration, scene.run.step / FINER_STEPS)
    )
    return {
        name: float(np.sqrt(np.mean((values - truth.channels[name][::FINER_STEPS]) ** 2)))
        for name, values in principal_series(drive).channels.items()
        if name in error_estimates_of(stated_result)
    }


@contextmanager
def counting_force_calls() -> Iterator[list[float]]:
    """Context that yields a list, to which every run within it adds its number of force evaluations times cells of a
    tyre."""
    calls, march = list[float](), FreeModel.run

    def counting(model: FreeModel, q: np.ndarray, v: np.ndarray) -> Trajectory:
        assert model.settings is not None
        calls.append(4.0 * model.settings.steps * model.numbers[CELLS])
        return march(model, q, v)

    with mock.patch.object(FreeModel, "run", counting):
        yield calls
