"""Hub forces: a bare scene has files of forces and angles; what a run of the cut vehicle is made of, and its path."""

from pathlib import Path
from typing import Any

import numpy as np

from models.hub_forces.scene import ANGLES, COMPONENTS, HubScene
from models.time_series import write_time_series

ENGINES = ("reference", "exudyn", "mujoco")
HUBS = ("fl", "fr", "rl", "rr")
STEPS, STEP, PERIOD = 20, 1e-3, 2e-3
BARE: dict[str, Any] = {"title": "bare", "system": "hub-forces", "vehicle": {"file": "r19_free"},
                        "run": {"duration": STEPS * STEP, "step": STEP}, "angles": {"file": "angles.csv"},
                        "forces": {"file": "forces.csv", "frame": "inertial"}}  # fmt: skip
ON_ROAD: dict[str, Any] = {"road": {}, "angles": {}, "forces": {"frame": "inertial"}}
BY_HAND: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {"virtual_measurement": ({}, ON_ROAD)}


def write(folder: Path) -> None:
    """Forces that carry the vehicle, one of them rising, and angles of a vehicle that stands."""
    rising = np.linspace(0.0, 1.0, round(STEPS * STEP / PERIOD) + 1) ** 2
    units = {name: next(iter(known)) for name, known in COMPONENTS.items()}
    forces = {f"{hub}_{name}": (units[name], (4e3 + 500.0 * rising) * (name == "fz"))
              for hub in HUBS for name in COMPONENTS}  # fmt: skip
    write_time_series(folder / "forces.csv", forces, PERIOD)
    angles = {name: (next(iter(known)), 0.0 * rising) for name, known in ANGLES.items()}
    write_time_series(folder / "angles.csv", angles, PERIOD)


def seen(scene: HubScene, engine: str) -> tuple[dict[str, int], bytes]:
    """Counts of the run that is free, as an engine is handed it, and its path."""
    from models.engines.hub_forces import build
    from models.hub_forces import kernel
    from models.hub_forces.of_scene import measured

    vehicle, own = scene.cut_vehicle(), scene.run
    truth, forces, _ = measured(scene, vehicle, engine)
    drive = forces.drive(own.step, round(own.duration / own.step), scene.forces.interpolation)
    model = build(engine, vehicle, drive, own.step, own.duration)
    table = model.numbers
    within = drive.hubs[: round(2 * forces.period / own.step) + 1]  # a period of them, at half steps
    curved = np.abs(np.diff(within, n=2, axis=0)).max() > 1e-9 * np.abs(within).max()
    counts = {"runs on tyres": int(truth is not None), "guides": int(table[kernel.GUIDE]),
              "turning hubs": int(table[kernel.HUBS] * (table[kernel.FRAME] != kernel.FRAMES.index("inertial"))),
              "curves between samples": int(curved)}  # fmt: skip
    return counts, model.run().states.tobytes()
