"""Stated errors of the contacts of a wheelset at prescribed positions; the true solution has four times as many cells
along each axis.

The work is counted in cells of a patch. More cells would not be more accurate: areas are counted in whole cells, and
their error falls with the first power.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from models.core.discretisation import error_estimates_of, finite_rms
from models.systems.wheel_rail.run import ERROR_POSITION_STRIDE, WHEEL_QUANTITIES, run, wheel_sums
from models.systems.wheel_rail.scene import WheelRailScene, build
from validation.stated_errors.sample import Sample, random_samples

FINER_CELLS, POSITION_COUNT = 4.0, 4


def samples(sample_count: int, seed: int) -> Iterator[Sample]:
    """Yield ``sample_count`` samples from random wheel-rail scenes; scenes that fail or are refused are replaced."""
    return random_samples(sample_count, seed, lambda random: _sample_of_position(_random_scene(random)))


def _random_scene(generator: np.random.Generator) -> WheelRailScene:
    start = float(generator.uniform(-0.004, 0.004))
    rolls = generator.random() < 0.6
    case = {"yaw": float(generator.uniform(0.0, 3.0)), "friction": float(generator.uniform(0.1, 0.5))} if rolls else {}
    return build(
        {
            "title": "a random held wheelset",
            "system": "wheel-rail",
            "wheelset": {
                "load": float(10.0 ** generator.uniform(3.7, 5.0)),
                "radius": float(generator.uniform(0.35, 0.6)),
            },
            "profiles": {"inclination": float(generator.choice([0.025, 0.05]))},
            "positions": {"start": start, "stop": start + 0.004, "count": POSITION_COUNT},
            "method": {"cells": int(generator.integers(10, 24))},
            "cases": {"one": case},
        }
    )


def _sample_of_position(scene: WheelRailScene) -> Sample | None:
    stated_run = run(scene, error=True)
    estimates, case = error_estimates_of(stated_run), next(iter(scene.cases.values()))
    contact = scene.contact(case)
    fine = replace(contact, cell_factor=contact.cell_factor / FINER_CELLS)
    placed = stated_run.detail.placements
    gaps = np.array(
        [
            wheel_sums(wheelset_place) - wheel_sums(fine.at(wheelset_place.shift, wheelset_place.yaw))
            for wheelset_place in placed
        ]
    )
    true = {name: finite_rms(gaps[:, :, k]) for k, name in enumerate(WHEEL_QUANTITIES)}
    calls, extra_seconds = (
        len(placed) * scene.method.cells**2,
        len(placed[::ERROR_POSITION_STRIDE]) * (scene.method.cells / 2.0) ** 2,
    )
    name = f"{scene.wheelset.load:.3g} N, {scene.method.cells} cells, {'rolling' if case.friction else 'pressed'}"
    return (
        Sample(name, "", estimates, {channel: true[channel] for channel in estimates}, calls, extra_seconds)
        if estimates
        else None
    )
