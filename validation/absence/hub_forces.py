"""Hub-force scene without effects, for the absence checks: its files of forces and angles, counts of the components in
the model of the vehicle above its hubs, its path."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from models.core.time_series import write_time_series
from models.engines.cut_vehicle import build
from models.multibody import cut_kernel as kernel
from models.multibody.cut_kernel import WRENCH
from models.systems.hub_forces.measurement import recorded_measurement
from models.systems.hub_forces.run import HubMeasurement, measure
from models.systems.hub_forces.scene import COLUMNS_OF_ANGLES, COLUMNS_OF_HUB, HubScene

ENGINES = ("reference", "exudyn", "mujoco")
HUBS = ("fl", "fr", "rl", "rr")
STEP_COUNT, STEP, SAMPLE_PERIOD = 20, 1e-3, 2e-3
BARE_SCENE: dict[str, Any] = {
    "title": "bare",
    "system": "hub-forces",
    "vehicle": {"file": "r19_free"},
    "run": {"duration": STEP_COUNT * STEP, "step": STEP},
    "stabilise": {"smoothing": 60.0},
    "angles": {"file": "angles.csv"},
    "forces": {"file": "forces.csv", "frame": "inertial"},
}
NO_NOISE: dict[str, Any] = {"noise": "none"}
ON_ROAD: dict[str, Any] = {"road": {}, "angles": NO_NOISE, "forces": NO_NOISE | {"frame": "inertial"}}
HAND_WRITTEN_TABLES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "virtual_measurement": ({}, ON_ROAD),
    "force_noise": (ON_ROAD, ON_ROAD | {"forces": {"frame": "inertial"}}),
    "angle_noise": (ON_ROAD, ON_ROAD | {"angles": {}}),
    "lift_off": (ON_ROAD, ON_ROAD | {"effects": {"lift_off": {}}}),
}


def write(scene_folder: Path) -> None:
    """Write a file of hub forces, whose vertical components rise from the static load, and a file of angles that stay
    zero."""
    rising = np.linspace(0.0, 1.0, round(STEP_COUNT * STEP / SAMPLE_PERIOD) + 1) ** 2
    forces = {
        f"{hub}_{name}": (next(iter(units)), (4e3 + 500.0 * rising) * (name == "fz"))
        for hub in HUBS
        for name, units in COLUMNS_OF_HUB.items()
    }
    write_time_series(scene_folder / "forces.csv", forces, SAMPLE_PERIOD)
    angles = {name: (next(iter(units)), 0.0 * rising) for name, units in COLUMNS_OF_ANGLES.items()}
    write_time_series(scene_folder / "angles.csv", angles, SAMPLE_PERIOD)


def counts_and_path(scene: HubScene, engine: str) -> tuple[dict[str, int], bytes]:
    """Counts of the components of a run (noisy columns, sampled and held forces, ...), and its states as bytes."""
    measurement, step = measure(scene, engine), scene.run.step
    hub_inputs = measurement.hub_inputs(scene.stabilise.method, step, STEP_COUNT)
    model = build(engine, measurement.vehicle, hub_inputs, step, scene.run.duration)
    head = model.numbers
    # One sample period in half steps.
    period_inputs = hub_inputs.hubs[: round(2 * measurement.forces.period / step) + 1]
    curved = (
        not hub_inputs.constant_in_step
        and np.abs(np.diff(period_inputs, n=2, axis=0)).max() > 1e-9 * np.abs(period_inputs).max()
    )
    noisy_forces, noisy_angles = _noisy_columns(measurement)
    counts = {
        "runs on tyres": int(measurement.truth is not None),
        "tyres that lift": sum(tyre.pushes_only for tyre in measurement.vehicle.uncut.tyres),
        "noisy forces": noisy_forces,
        "noisy angles": noisy_angles,
        "held forces": hub_inputs.constant_in_step * WRENCH * int(head[kernel.HUBS]),
        "pulled angles": 2 * int(head[kernel.STABILISER] == kernel.PULLED),
        "enforced angles": 2 * int(head[kernel.STABILISER] == kernel.ENFORCED),
        "turning hubs": int(head[kernel.HUBS] * (head[kernel.FRAME] != kernel.FRAMES.index("inertial"))),
        "curves between samples": int(curved),
    }
    return counts, model.run(*np.split(measurement.start(hub_inputs), 2)).states.tobytes()


def scene_run(scene: HubScene, engine: str, step_count: int) -> Callable[[], Any]:
    """Returns a function that simulates the scene over ``step_count`` steps; its model is built beforehand."""
    measurement, step = measure(scene, engine), scene.run.step
    return build(
        engine, measurement.vehicle, measurement.hub_inputs("none", step, step_count), step, step_count * step
    ).run


def _noisy_columns(measurement: HubMeasurement) -> list[int]:
    """Number of force columns with noise and number of angle columns with noise; 0 and 0 for measurements from
    files."""
    forces, angles, scene = measurement.forces, measurement.angles, measurement.scene
    if measurement.truth is None:
        return [0, 0]
    clean = recorded_measurement(measurement.truth, scene.forces.frame, round(forces.period / scene.run.step))
    pairs = ((forces.samples, clean[0].samples), (angles.samples, clean[1].samples))
    return [int((measured != true).any(axis=0).sum()) for measured, true in pairs]
