"""A car on four tyres along a measured steer angle and speed: Exudyn and MuJoCo, repetition of its own simulated drive,
and identification of its tyres."""

from pathlib import Path
from typing import Any

import numpy as np

from models.core.scene_file import parse_toml
from models.identification.fit import fit
from models.identification.of_scene import identification_problem_of
from models.identification.uncertainty import uncertainty
from models.systems.handling.run import run
from models.systems.handling.scene import HandlingScene, build
from validation.common.rows import Observed, Row, System

TITLE = "A car on four rolling tyres along a measured drive"
SYSTEM: System = "rolling-vehicle"
SCENE_FOLDER = Path(__file__).parents[2] / "studies" / "scenes"
SIMULATED_DRIVE_FILE = SCENE_FOLDER / "single_track.csv"
COLUMN_AND_NOISE_OF_SENSOR = {"yaw rate": (3, 0.004), "side slip": (5, 0.0008)}
"""Column of the file, and standard deviation of the noise (rad/s, rad) that was added to the simulated signal."""
START_STIFFNESS_RATIOS = (0.8, 1.2)
"""Ratios of both axles' cornering stiffness to the true ones at which the identification starts."""
CHI_SQUARE_LIMIT = 18.4
"""99.99 % quantile of the chi-square distribution with 2 degrees of freedom."""


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of the drive in Exudyn and MuJoCo and of the repeated drive over 2 s; a full run takes 8 s and also
    identifies the tyres."""
    scene = _drive_scene([0.0, 2.0] if quick else [0.0, 8.0])
    first, second = (run(scene, engine) for engine in ("mujoco", "exudyn"))
    gap = max(float(np.abs(first[name] - second[name]).max()) for name in ("positions", "rates"))
    rows = [
        Observed(
            "measured_drive.engines",
            SYSTEM,
            "positions and rates of the two engines along a measured drive differ by at most",
            gap,
            "m, rad, m/s, rad/s",
        ).at_most(1e-10, "the same torques and steer angles in two engines: rounding alone", "shared kernel"),
        *_repeated_drive_rows(first),
    ]
    return (rows, {}) if quick else ([*rows, *_identified_tyre_rows()], {})


def _drive_scene(time_stretch: list[float], stiffness_ratios: tuple[float, float] = (1.0, 1.0)) -> HandlingScene:
    """Scene of the measured drive between two times (s), with factors on the cornering stiffness of both axles."""
    table = parse_toml(SCENE_FOLDER / "measured_drive.toml")
    table["tyres"]["cornering"] = list(stiffness_ratios)
    table["manoeuvres"]["measured"]["stretch"] = time_stretch
    return build(table, "measured drive", SCENE_FOLDER)


def _repeated_drive_rows(simulated_drive: Any) -> list[Row]:
    """Rows: a car repeats its simulated drive from steer angle and speed, compared with the noise of the sensors."""
    every = round(0.02 / float(simulated_drive.times[1] - simulated_drive.times[0]))
    made = np.genfromtxt(SIMULATED_DRIVE_FILE, delimiter=",", skip_header=1)[: len(simulated_drive.times[::every])]
    return [
        Observed(
            f"measured_drive.{name.replace(' ', '_')}",
            SYSTEM,
            f"a car repeats its own drive from steer and speed: ratio of the {name}'s error to the sensor's noise",
            float(np.sqrt(np.mean((simulated_drive[name][::every] - made[:, column]) ** 2))) / noise,
            "",
        ).at_most(1.2, "the noise that was put on the file is what is left", "shared kernel")
        for name, (column, noise) in COLUMN_AND_NOISE_OF_SENSOR.items()
    ]


def _identified_tyre_rows() -> list[Row]:
    """Rows: cornering stiffness of both axles identified from the simulated drive, compared with the true one."""
    keys = ["tyres.cornering.0=0.3:3", "tyres.cornering.1=0.3:3"]
    known = uncertainty(
        fit(
            identification_problem_of(
                _drive_scene([0.0, 6.0], START_STIFFNESS_RATIOS),
                SIMULATED_DRIVE_FILE,
                keys,
                "mujoco",
                low_pass_edge=5.0,
            )
        )
    )
    off = known.fit.values - 1.0
    scaled = off / known.fit.problem.scales
    return [
        Observed(
            "measured_drive.tyres",
            SYSTEM,
            "squared Mahalanobis distance of both axles' identified cornering stiffness from the truth",
            float(scaled @ np.linalg.solve(known.covariance, scaled)),
            "",
        ).at_most(
            CHI_SQUARE_LIMIT, "chi-square: larger where standard errors are too small, or estimates off", "closed form"
        ),
        Observed(
            "measured_drive.stiffness",
            SYSTEM,
            "largest relative error of an identified cornering stiffness",
            float(np.abs(off).max()),
            "",
        ).at_most(0.05, "six seconds of turns with noise determine it to a few per cent", "closed form"),
    ]
