"""A car in MJCF as the vehicle of a handling scene: energies compared with MuJoCo's model of the file, and a lane
change."""

from pathlib import Path

import numpy as np

from models.multibody.numbers import Controls, Handling
from models.own_model.car import vehicle_of_file
from models.systems.handling.run import REFERENCE_ENGINE, build_in_engine, drive_run
from validation.common.rows import CaseAnswer, Observed, Row, System
from validation.own_model.car_energy import largest_energy_difference
from validation.own_model.cars import SALOON

TITLE = "A user's own car: MJCF as the vehicle of a scene"
SYSTEM: System = "rolling-vehicle"
LANE_CHANGE_CONTROLS = Controls(steer=((0.1, 0.0), (0.4, 0.04), (0.9, -0.04), (1.2, 0.0)))
SPEED = 22.0
"""Speed (m/s) of the lane change."""
DIFFERENCE_TOLERANCE = 1e-10
"""Largest difference allowed, divided by the largest value."""
RANDOM_STATE_COUNTS = {True: 10, False: 100}
"""Number of random states, for a quick run (True) and a full run (False)."""


def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows of energies and of a lane change, which takes 0.5 s in a quick run and 1.5 s in a full one."""
    path = work_folder / "saloon.xml"
    path.write_text(SALOON, encoding="utf-8")
    handling = Handling(vehicle_of_file(path), controls=LANE_CHANGE_CONTROLS)
    return [_energy_row(handling, quick), *_lane_change_rows(handling, 0.5 if quick else 1.5)], {}


def _energy_row(handling_car: Handling, quick: bool) -> Row:
    """Row: kinetic and potential energy at random states, compared with MuJoCo's own model of the file."""
    return Observed(
        "own_car.energy",
        SYSTEM,
        "largest difference of kinetic and potential energy from MuJoCo's own model of the file, at random states",
        largest_energy_difference(handling_car, RANDOM_STATE_COUNTS[quick]),
        "of the largest",
    ).at_most(1e-11, "rounding, and rotors that weigh 1e-9 kg more; equal energies make equal equations", "native")


def _lane_change_rows(handling_car: Handling, duration: float) -> list[Row]:
    """Rows: difference between Exudyn and MuJoCo over a lane change, and of each engine's accelerations at its end from
    independently written equations."""
    drives = {engine: drive_run(engine, handling_car, SPEED, duration) for engine in ("exudyn", "mujoco")}
    states = [drive.run.states for drive in drives.values()]
    rows = [
        Observed(
            "own_car.lane_change",
            SYSTEM,
            f"largest difference of the states of Exudyn and MuJoCo over {duration:g} s of a lane change",
            float(np.abs(states[0] - states[1]).max() / np.abs(states[1]).max()),
            "of the largest",
        ).at_most(DIFFERENCE_TOLERANCE, "rounding: same tableau, same step", "shared kernel")
    ]
    run = drives["mujoco"].run
    last = run.times[-1], run.positions[-1], run.rates[-1]
    plain = build_in_engine(REFERENCE_ENGINE, handling_car).acceleration(*last)
    for engine in drives:
        apart = np.abs(build_in_engine(engine, handling_car).acceleration(*last) - plain).max() / np.abs(plain).max()
        rows.append(
            Observed(
                f"own_car.plain_{engine}",
                SYSTEM,
                f"largest difference of accelerations between {engine} and the plain equations, at the end of the run",
                float(apart),
                "of the largest",
            ).at_most(DIFFERENCE_TOLERANCE, "rounding", "native")
        )
    return rows
