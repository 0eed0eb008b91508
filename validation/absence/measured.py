"""Recordings: a bare scene has one file and holds nothing; what its run is made of, and its answers."""

import tempfile
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from models.core.systems import load
from models.core.time_series import write_time_series
from models.measured.recording import Recording
from models.systems.hub_forces.scene import ANGLES
from models.systems.measured.scene import MeasuredScene

ENGINES = ("reference", "exudyn", "mujoco")
HUBS = ("fl", "fr", "rl", "rr")
SAMPLES, PERIOD = 101, 1e-3
CHANNELS = [
    *({"channel": hub, "quantity": "force", "at": hub, "component": "z", "frame": "inertial"} for hub in HUBS),
    *(
        {
            "channel": name,
            "quantity": "angular rate" if "rate" in name else "angle",
            "at": "body",
            "component": name.partition("_")[0],
            "frame": "inertial",
        }
        for name in ANGLES
    ),
]
FILE: dict[str, Any] = {"file": "recording.csv", "channels": CHANNELS}
BARE: dict[str, Any] = {
    "title": "bare",
    "system": "measured",
    "vehicle": {"file": "r19_free"},
    "files": [FILE],
    "stabilise": {"method": "none", "smoothing": 20.0},
}
VIRTUAL = {"duration": PERIOD * (SAMPLES - 1), "format": "csv"}
ON_ROAD: dict[str, Any] = {"files": [], "virtual": VIRTUAL}
FAULTS: dict[str, Any] = {
    "sensor_noise": {"noise": {"force": 8.0, "moment": 1.0, "angle": 1.75e-3, "angular rate": 5e-3}},
    "quantisation": {"quantisation": {"bits": 12}},
    "late_channels": {"delay": {"force": 2e-3}},
    "wrong_gains": {"gain": {"force": 0.01}},
    "offsets": {"bias": {"force": 20.0}},
    "dropouts": {"dropouts": {"rate": 20.0, "length": 5e-3}},
}
"""What the effects of transducers put in; of dropouts more than usual, so that a short recording has some."""
BY_HAND: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "own_clocks": ({}, {"files": [FILE | {"drift": 1e-4}]}),
    "virtual_measurement": ({}, ON_ROAD),
    **{name: (ON_ROAD, {**ON_ROAD, "virtual": VIRTUAL | {"faults": fault}}) for name, fault in FAULTS.items()},
}


def write(folder: Path) -> None:
    """Forces that carry the vehicle, and angles of a vehicle that leans to and fro."""
    swing = np.sin(np.linspace(0.0, 3.0, SAMPLES))
    forces = dict.fromkeys(HUBS, ("N", 4000.0 + 100.0 * swing))
    angles = {name: (next(iter(units)), 1e-3 * swing) for name, units in ANGLES.items()}
    write_time_series(folder / "recording.csv", forces | angles, PERIOD)


def seen(scene: MeasuredScene, engine: str) -> tuple[dict[str, int], bytes]:
    """Counts of the run that a recording drives, as an engine is handed it, and its answers."""
    from models.multibody import cut_kernel as kernel
    from models.systems.measured import section_run
    from models.systems.measured.sections import Sections

    tables, build, said = list[np.ndarray](), section_run.build, scene.stabilise

    def watched(*given: Any) -> Any:
        tables.append((model := build(*given)).numbers)
        return model

    with tempfile.TemporaryDirectory() as name, mock.patch.object(section_run, "build", watched):
        vehicle, (own, faults) = scene.rig().vehicle, _recorded(scene, engine, Path(name))
        assert vehicle is not None
        hold = section_run.Hold(said.method, smoothing=said.smoothing)
        job = section_run.SectionRun(vehicle, own, Sections(vehicle), engine, hold)
        found = section_run.run(job, Path(name) / "run")
        path = b"".join(found.samples(answer).tobytes() for answer in found.answers)
    guides = {int(table[kernel.GUIDE]) for table in tables}
    counts = {
        "runs on tyres": int(scene.virtual is not None),
        **faults,
        "pulled angles": 2 * (guides == {kernel.PULLED}),
        "enforced angles": 2 * (guides == {kernel.HELD}),
        "moved clocks": sum(bool(file.offset or file.drift) for file in scene.files),
    }
    return counts, path


def _recorded(scene: MeasuredScene, engine: str, folder: Path) -> tuple[Recording, dict[str, int]]:
    """The scene's files, or those of its virtual measurement, on one clock; how many channels do not tell the truth."""
    from models.systems.measured.pattern import write_pattern

    from models.measured.faults_of_measurement import Faults
    from models.systems.measured import plan
    from models.systems.measured.clock import record
    from models.systems.measured.virtual import virtual_measurement

    rig, own, faulty = scene.rig(), scene.virtual, np.zeros((2, 1), bool)
    if own is not None and rig.vehicle is not None:
        true = virtual_measurement(rig.vehicle, own, engine)
        samples = true.samples(own.faults, own.seed)
        faulty = np.array([(samples != true.samples(Faults(), own.seed)).any(axis=0), np.isnan(samples).any(axis=0)])
        write_pattern(scene, true, samples, folder)
        scene = load(folder / "scene.toml")
    sources, counts = (
        plan.opened(scene),
        dict(zip(("faulty channels", "silent channels"), map(int, faulty.sum(axis=1)), strict=True)),
    )
    return record(scene, sources, plan.mapped(scene, sources, rig), rig.hubs, folder), counts
