"""The six runs of the paper, Section 4: scenes on the files of a virtual measurement, and what each run shows.

The vehicle is driven by the measured wheel forces: undisturbed, with noise, with a perturbed model, with both; at last
its pitch is prescribed, and the moment that this takes is the price.
"""

from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from models.core.result import Result
from models.core.strict import Strict, quantity, read
from models.systems.pitch_plane.scene import Scene
from models.systems.pitch_plane.trust import GrowthCurve
from models.systems.pitch_plane.virtual_measurement import (
    PAPER_FACTORS,
    check_road,
    follower_builder,
    measure,
    perturbed_parameters,
    write_measurement,
)

DRIFT_OFF_PITCH = 0.05
"""A run has drifted off when its pitch is this far (rad) from the measured one."""


class Options(Strict):
    """[options] of the study of six runs."""

    sampling_rate: float = quantity("Hz", "rate at which forces and pitch are measured", default=1000.0)
    noise_fraction: float = quantity(
        "", "standard deviation of the noise by the largest force", default=0.002, zero=True
    )
    noise_samples: int = Field(5, ge=1, description="number of noise samples")
    perturbed_models: int = Field(5, ge=0, description="number of random models beside the paper's")
    seed: int = Field(1, ge=0, lt=2**63, description="seed of noise and models")


def options_of(scene: Scene, engines: tuple[str, ...] = ()) -> Options:
    """The scene's options; refuses, before any file is written, options with which one of the study's runs is
    impossible.
    """
    options = read(Options, scene.options, scene.file, "options")
    check_road(scene, engines, options.sampling_rate)
    return options


def measurement_and_runs(scene: Scene, folder: Path, error: bool = False) -> tuple[Result, float, dict[str, Scene]]:
    """The measurement, the standard deviation (N) of the forces' noise, and by name the scenes of runs on the measured
    files. ``error`` requests the error of the measurement's steps.
    """
    options, measured = options_of(scene), measure(scene, error)
    deviation = options.noise_fraction * write_measurement(measured, folder, 1.0 / options.sampling_rate)
    vehicle, follow = scene.vehicle_parameters(), follower_builder(scene, folder)
    paper = perturbed_parameters(vehicle)
    noises = [
        {"force_noise": {"deviation": deviation, "seed": 1000 * options.seed + i}} for i in range(options.noise_samples)
    ]
    scenes = {"undisturbed": follow({}, {})}
    scenes |= {f"noisy {i + 1}": follow({}, noise) for i, noise in enumerate(noises)}
    scenes["perturbed"] = follow(paper, {})
    for i in range(options.perturbed_models):  # Fig. 7
        factors = np.random.Generator(np.random.Philox(key=[options.seed, i])).uniform(0.9, 1.1, 5).tolist()
        scenes[f"model {i + 1}"] = follow(
            perturbed_parameters(vehicle, dict(zip(PAPER_FACTORS, factors, strict=True))), {}
        )
    scenes["both"] = follow(paper, noises[0])
    guide = {"prescribed_pitch": {"file": "pitch.csv"}}
    guided = {"undisturbed": ({}, {}), "noisy": ({}, noises[0]), "perturbed": (paper, {}), "both": (paper, noises[0])}
    scenes |= {f"guided, {name}": follow(model, noise | guide) for name, (model, noise) in guided.items()}
    return measured, deviation, scenes


def error(measured_run: Result, run: Result, channel: str) -> np.ndarray:
    """A run's channel less the measured one, at the run's own times."""
    return run[channel] - np.interp(run.times, measured_run.times, measured_run[channel])


def figures_of_run(engine: str, name: str, measured_run: Result, run: Result) -> dict[str, Any]:
    """Drift-off time (s, None if never), heave error, and for a guided run the enforced moment and the inertia term."""
    figures: dict[str, Any] = {
        "engine": engine,
        "run": name,
        "drift-off": GrowthCurve(run.times, np.abs(error(measured_run, run, "pitch"))).passing_time(DRIFT_OFF_PITCH),
        "heave error": float(np.abs(error(measured_run, run, "z3")).max()),
    }
    if "enforced_moment" in run.data:
        moment = run["enforced_moment"]
        figures["moment rms"] = float(np.sqrt(np.mean(moment**2)))
        figures["moment max"] = float(np.abs(moment).max())
        figures["inertia max"] = float(np.abs(run["inertia_term"]).max())
    return figures
