"""Recordings: a bare scene has one file and holds nothing; what its run is made of, and its answers."""

import tempfile
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from models.hub_forces.scene import ANGLES
from models.measured.recording import Recording
from models.measured.scene import MeasuredScene
from models.systems import load
from models.time_series import write_time_series

ENGINES = ("reference", "exudyn", "mujoco")
HUBS = ("fl", "fr", "rl", "rr")
SAMPLES, PERIOD = 101, 1e-3
CHANNELS = [*({"channel": hub, "quantity": "force", "at": hub, "component": "z", "frame": "inertial"} for hub in HUBS),
            *({"channel": name, "quantity": "angular rate" if "rate" in name else "angle", "at": "body",
               "component": name.partition("_")[0], "frame": "inertial"} for name in ANGLES)]  # fmt: skip
FILE: dict[str, Any] = {"file": "recording.csv", "channels": CHANNELS}
BARE: dict[str, Any] = {"title": "bare", "system": "measured", "vehicle": {"file": "r19_free"}, "files": [FILE],
                        "stabilise": {"method": "none", "smoothing": 20.0}}  # fmt: skip
VIRTUAL = {"duration": PERIOD * (SAMPLES - 1), "format": "csv"}
ON_ROAD: dict[str, Any] = {"files": [], "virtual": VIRTUAL}
NOISY = {"noise": {"force": 8.0, "moment": 1.0}}
BY_HAND: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "own_clocks": ({}, {"files": [FILE | {"drift": 1e-4}]}),
    "virtual_measurement": ({}, ON_ROAD),
    "transducer_faults": (ON_ROAD, {**ON_ROAD, "virtual": VIRTUAL | {"faults": NOISY}}),
}


def write(folder: Path) -> None:
    """Forces that carry the vehicle, and angles of a vehicle that leans to and fro."""
    swing = np.sin(np.linspace(0.0, 3.0, SAMPLES))
    forces = dict.fromkeys(HUBS, ("N", 4000.0 + 100.0 * swing))
    angles = {name: (next(iter(units)), 1e-3 * swing) for name, units in ANGLES.items()}
    write_time_series(folder / "recording.csv", forces | angles, PERIOD)


def seen(scene: MeasuredScene, engine: str) -> tuple[dict[str, int], bytes]:
    """Counts of the run that a recording drives, as an engine is handed it, and its answers."""
    from models.hub_forces import kernel
    from models.measured import section_run
    from models.measured.sections import Sections

    tables, build, said = list[np.ndarray](), section_run.build, scene.stabilise

    def watched(*given: Any) -> Any:
        tables.append((model := build(*given)).numbers)
        return model

    with tempfile.TemporaryDirectory() as name, mock.patch.object(section_run, "build", watched):
        vehicle, (own, faulty) = scene.rig().vehicle, _recorded(scene, engine, Path(name))
        assert vehicle is not None
        hold = section_run.Hold(said.method, smoothing=said.smoothing)
        job = section_run.SectionRun(vehicle, own, Sections(vehicle), engine, hold)
        found = section_run.run(job, Path(name) / "run")
        path = b"".join(found.samples(answer).tobytes() for answer in found.answers)
    guides = {int(table[kernel.GUIDE]) for table in tables}
    counts = {"runs on tyres": int(scene.virtual is not None), "faulty channels": faulty,
              "pulled angles": 2 * (guides == {kernel.PULLED}),
              "enforced angles": 2 * (guides == {kernel.HELD}),
              "moved clocks": sum(bool(file.offset or file.drift) for file in scene.files)}  # fmt: skip
    return counts, path


def _recorded(scene: MeasuredScene, engine: str, folder: Path) -> tuple[Recording, int]:
    """The scene's files, or those of its virtual measurement, on one clock; channels that do not tell the truth."""
    from models.measured import plan
    from models.measured.clock import record
    from models.measured.faults_of_measurement import Faults
    from models.measured.pattern import write_pattern
    from models.measured.virtual import virtual_measurement

    rig, own, faulty = scene.rig(), scene.virtual, 0
    if own is not None and rig.vehicle is not None:
        true = virtual_measurement(rig.vehicle, own, engine)
        samples = true.samples(own.faults, own.seed)
        faulty = int((samples != true.samples(Faults(), own.seed)).any(axis=0).sum())
        write_pattern(scene, true, samples, folder)
        scene = load(folder / "scene.toml")
    sources = plan.opened(scene)
    return record(scene, sources, plan.mapped(scene, sources, rig), rig.hubs, folder), faulty
