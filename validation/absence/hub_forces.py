"""Hub forces: a bare scene has files of forces and angles; what a run of the cut vehicle is made of, and its path."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from models.core.time_series import write_time_series
from models.systems.hub_forces.scene import ANGLES, COMPONENTS, HubScene

ENGINES = ("reference", "exudyn", "mujoco")
HUBS = ("fl", "fr", "rl", "rr")
STEPS, STEP, PERIOD = 20, 1e-3, 2e-3
BARE: dict[str, Any] = {
    "title": "bare",
    "system": "hub-forces",
    "vehicle": {"file": "r19_free"},
    "run": {"duration": STEPS * STEP, "step": STEP},
    "stabilise": {"smoothing": 60.0},
    "angles": {"file": "angles.csv"},
    "forces": {"file": "forces.csv", "frame": "inertial"},
}
QUIET: dict[str, Any] = {"noise": "none"}
ON_ROAD: dict[str, Any] = {"road": {}, "angles": QUIET, "forces": QUIET | {"frame": "inertial"}}
BY_HAND: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "virtual_measurement": ({}, ON_ROAD),
    "force_noise": (ON_ROAD, ON_ROAD | {"forces": {"frame": "inertial"}}),
    "angle_noise": (ON_ROAD, ON_ROAD | {"angles": {}}),
    "lift_off": (ON_ROAD, ON_ROAD | {"effects": {"lift_off": {}}}),
}


def write(folder: Path) -> None:
    """Forces that carry the vehicle, one of them rising, and angles of a vehicle that stands."""
    rising = np.linspace(0.0, 1.0, round(STEPS * STEP / PERIOD) + 1) ** 2
    units = {name: next(iter(known)) for name, known in COMPONENTS.items()}
    forces = {
        f"{hub}_{name}": (units[name], (4e3 + 500.0 * rising) * (name == "fz")) for hub in HUBS for name in COMPONENTS
    }
    write_time_series(folder / "forces.csv", forces, PERIOD)
    angles = {name: (next(iter(known)), 0.0 * rising) for name, known in ANGLES.items()}
    write_time_series(folder / "angles.csv", angles, PERIOD)


def seen(scene: HubScene, engine: str) -> tuple[dict[str, int], bytes]:
    """Counts of the scene's run, as an engine is handed it, and its path."""
    from models.engines.cut_vehicle import build
    from models.multibody import cut_kernel as kernel
    from models.systems.hub_forces.of_scene import measured
    from models.systems.hub_forces.stabilised import Stabilised

    vehicle, own = scene.cut_vehicle(), scene.run
    truth, forces, angles = measured(scene, vehicle, engine)
    stabilised = Stabilised(scene, vehicle, forces, angles)
    drive = stabilised.drive(scene.stabilise.method, own.step, STEPS)
    model = build(engine, vehicle, drive, own.step, own.duration)
    table = model.numbers
    within = drive.hubs[: round(2 * forces.period / own.step) + 1]  # a period of them, at half steps
    curved = np.abs(np.diff(within, n=2, axis=0)).max() > 1e-9 * np.abs(within).max()
    noisy = _noisy(scene, truth, forces, angles)
    lifting = sum(tyre.pushes_only for tyre in vehicle.whole.tyres)
    counts = {
        "runs on tyres": int(truth is not None),
        "tyres that lift": lifting,
        "noisy forces": noisy[0],
        "noisy angles": noisy[1],
        "pulled angles": 2 * int(table[kernel.GUIDE] == kernel.PULLED),
        "enforced angles": 2 * int(table[kernel.GUIDE] == kernel.HELD),
        "turning hubs": int(table[kernel.HUBS] * (table[kernel.FRAME] != kernel.FRAMES.index("inertial"))),
        "curves between samples": int(curved),
    }
    return counts, model.run(stabilised.start(drive)).states.tobytes()


def job(scene: HubScene, engine: str, steps: int) -> Callable[[], Any]:
    """A run of the scene over so many of its steps, built beforehand."""
    from models.engines.cut_vehicle import build
    from models.systems.hub_forces.of_scene import measured

    vehicle, own = scene.cut_vehicle(), scene.run
    drive = measured(scene, vehicle, engine)[1].drive(own.step, steps, scene.forces.interpolation)
    return build(engine, vehicle, drive, own.step, steps * own.step).run


def _noisy(scene: HubScene, truth: Any, forces: Any, angles: Any) -> tuple[int, int]:
    """Columns of forces and of angles that are not those of the true run; none of files, which have no true one."""
    from models.systems.hub_forces.measurement import recorded

    if truth is None:
        return 0, 0
    of_forces, of_angles = recorded(truth, scene.forces.frame, round(forces.period / scene.run.step))
    noisy = (forces.samples != of_forces.samples).any(axis=0), (angles.samples != of_angles.samples).any(axis=0)
    return int(noisy[0].sum()), int(noisy[1].sum())
