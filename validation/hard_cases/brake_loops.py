"""Hard cases of a brake's hysteresis loop of pressure and torque, with steps that miss its corners."""

from pathlib import Path

import numpy as np

from models.brake.brake import Brake, brakes_of_wheels, torques_of_pressures
from validation.hard_cases.case import HardCase

LOOPED_BRAKE = brakes_of_wheels(Brake(push_out=0.8, release=0.3, rising=1400.0, falling=1500.0))


def step_split_error(engine_name: str, work_folder: Path) -> float:
    """Case: a random pressure path in 1, 7 and 50 steps between its turning points. Error: largest difference of the
    torque (N m) at the turning points."""
    turns = np.concatenate(([0.0], np.random.default_rng(2).uniform(0.0, 6.0, 60)))
    levels = []
    for parts in (1, 7, 50):
        between = np.linspace(turns[:-1], turns[1:], parts, endpoint=False, axis=1).ravel()
        levels.append(torques_of_pressures(np.append(between, turns[-1]), LOOPED_BRAKE)[::parts])
    return float(max(np.abs(walk - levels[0]).max() for walk in levels))


def negative_loop_area(engine_name: str, work_folder: Path) -> float:
    """Case: hysteresis loops between random pressures, in 1000 steps each way. Error: magnitude of the most negative
    area (N m bar) or torque (N m)."""
    worst = 0.0
    for low, high in np.sort(np.random.default_rng(3).uniform(0.0, 6.0, (20, 2)), axis=1):
        once = np.concatenate((np.linspace(low, high, 1001), np.linspace(high, low, 1001)))
        levels = torques_of_pressures(np.concatenate((once, once)), LOOPED_BRAKE)
        area = -float(np.trapezoid(levels[once.size :], once))
        worst = max(worst, -area, -float(levels.min()))
    return worst


CASES = (
    HardCase(
        "loop of a brake in odd steps",
        "corners of the loop lie within steps",
        "the same torque at every turn of the pressure in 1, 7 or 50 steps",
        "N m",
        1e-9,
        "rounding of kN m",
        step_split_error,
        is_without_engine=True,
    ),
    HardCase(
        "small loops of a brake",
        "hysteresis passed in the wrong sense gives energy",
        "no loop between random pressures has a negative area or torque",
        "N m bar",
        1e-9,
        "rounding of kN m bar",
        negative_loop_area,
        is_without_engine=True,
    ),
)
