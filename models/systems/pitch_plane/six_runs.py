"""The six runs of the paper, Section 4: scenes on the files of a virtual measurement, and figures of each run.

The vehicle is driven by the measured wheel forces: undisturbed, with noise, with a perturbed model, with both. Then the
same is done with prescribed pitch, which takes an enforced moment.
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
"""Difference (rad) from the measured pitch beyond which a run has drifted off."""


class SixRunOptions(Strict):
    """[options] of the study of six runs: sampling rate, noise, perturbed models, seed."""

    sampling_rate: float = quantity("Hz", "rate at which forces and pitch are measured", default=1000.0)
    noise_fraction: float = quantity(
        "", "standard deviation of the noise by the largest force", default=0.002, zero=True
    )
    noise_samples: int = Field(5, ge=1, description="number of noise samples")
    perturbed_models: int = Field(5, ge=0, description="number of random models beside the paper's")
    seed: int = Field(1, ge=0, lt=2**63, description="seed of noise and models")


def options_of(scene: Scene, engines: tuple[str, ...] = ()) -> SixRunOptions:
    """Reads the scene's options. Raises InputError, before any file is written, for options with which a run of the
    study is impossible.
    """
    options = read(SixRunOptions, scene.options, scene.file, "options")
    check_road(scene, engines, options.sampling_rate)
    return options


def measurement_and_runs(
    scene: Scene, output_folder: Path, estimate_error: bool = False
) -> tuple[Result, float, dict[str, Scene]]:
    """Makes the virtual measurement and writes its files. Returns the measurement, the standard deviation (N) of the
    force noise, and the scenes of all runs on the measured files by name.

    estimate_error : whether the error of the measurement's time steps is estimated.
    """
    options, measured = options_of(scene), measure(scene, estimate_error)
    deviation = options.noise_fraction * write_measurement(measured, output_folder, 1.0 / options.sampling_rate)
    vehicle, follow = scene.vehicle_parameters(), follower_builder(scene, output_folder)
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


def channel_error(measured_run: Result, run_result: Result, channel_name: str) -> np.ndarray:
    """A run's channel minus the measured channel, at the times of the run."""
    return run_result[channel_name] - np.interp(run_result.times, measured_run.times, measured_run[channel_name])


def figures_of_run(engine: str, run_name: str, measured_run: Result, run_result: Result) -> dict[str, Any]:
    """Figures of a run for a JSON file: drift-off time (s, None if never) and largest heave error (m); with prescribed
    pitch also enforced moment and inertia term (N m).
    """
    figures: dict[str, Any] = {
        "engine": engine,
        "run": run_name,
        "drift-off": GrowthCurve(
            run_result.times, np.abs(channel_error(measured_run, run_result, "pitch"))
        ).passing_time(DRIFT_OFF_PITCH),
        "heave error": float(np.abs(channel_error(measured_run, run_result, "z3")).max()),
    }
    if "enforced_moment" in run_result.data:
        moment = run_result["enforced_moment"]
        figures["moment rms"] = float(np.sqrt(np.mean(moment**2)))
        figures["moment max"] = float(np.abs(moment).max())
        figures["inertia max"] = float(np.abs(run_result["inertia_term"]).max())
    return figures
