"""Scene of a measured recording without effects, for the absence checks: one file, no stabiliser, counts of the run's
components, its computed channels."""

from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from models.core.time_series import write_time_series
from models.measured.faults_of_measurement import SimulatedFaults
from models.multibody import cut_kernel as kernel
from models.systems.hub_forces.scene import COLUMNS_OF_ANGLES
from models.systems.measured import section_run
from models.systems.measured.run import RecordingAnalysis, run
from models.systems.measured.scene import MeasuredScene

ENGINES = ("reference", "exudyn", "mujoco")
HUBS = ("fl", "fr", "rl", "rr")
SAMPLE_COUNT, SAMPLE_PERIOD = 101, 1e-3
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
        for name in COLUMNS_OF_ANGLES
    ),
]
FILE: dict[str, Any] = {"file": "recording.csv", "channels": CHANNELS}
BARE_SCENE: dict[str, Any] = {
    "title": "bare",
    "system": "measured",
    "vehicle": {"file": "r19_free"},
    "files": [FILE],
    "stabilise": {"method": "none", "smoothing": 20.0},
}
VIRTUAL = {"duration": SAMPLE_PERIOD * (SAMPLE_COUNT - 1), "format": "csv"}
ON_ROAD: dict[str, Any] = {"files": [], "virtual": VIRTUAL}
FAULTS: dict[str, Any] = {
    "sensor_noise": {"noise": {"force": 8.0, "moment": 1.0, "angle": 1.75e-3, "angular rate": 5e-3}},
    "quantisation": {"quantisation": {"bits": 12}},
    "late_channels": {"delay": {"force": 2e-3}},
    "wrong_gains": {"gain": {"force": 0.01}},
    "offsets": {"bias": {"force": 20.0}},
    "dropouts": {"dropouts": {"rate": 20.0, "length": 5e-3}},
}
"""Effect of a transducer -> its table of faults in the scene. Dropouts are more frequent than usual, so that a short
recording has some."""
HAND_WRITTEN_TABLES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "own_clocks": ({}, {"files": [FILE | {"drift": 1e-4}]}),
    "virtual_measurement": ({}, ON_ROAD),
    **{name: (ON_ROAD, {**ON_ROAD, "virtual": VIRTUAL | {"faults": fault}}) for name, fault in FAULTS.items()},
}


def write(scene_folder: Path) -> None:
    """Write a recording with hub forces that carry the vehicle's weight and angles of a vehicle that sways."""
    swing = np.sin(np.linspace(0.0, 3.0, SAMPLE_COUNT))
    forces = dict.fromkeys(HUBS, ("N", 4000.0 + 100.0 * swing))
    angles = {name: (next(iter(units)), 1e-3 * swing) for name, units in COLUMNS_OF_ANGLES.items()}
    write_time_series(scene_folder / "recording.csv", forces | angles, SAMPLE_PERIOD)


def counts_and_path(scene: MeasuredScene, engine: str) -> tuple[dict[str, int], bytes]:
    """Counts of the components of a run on a recording (faulty channels, enforced angles, ...), and the computed
    channels as bytes."""
    tables, build = list[np.ndarray](), section_run.build

    def watched(*estimator_settings: Any) -> Any:
        tables.append((model := build(*estimator_settings)).numbers)
        return model

    with mock.patch.object(section_run, "build", watched):
        exam: RecordingAnalysis = run(scene, engine).detail
    assert exam.outcome is not None
    path = b"".join(exam.outcome.samples(answer).tobytes() for answer in exam.outcome.answers)
    guides, faulty = {int(table[kernel.STABILISER]) for table in tables}, np.zeros((2, 1), bool)
    if scene.virtual is not None and exam.virtual is not None:
        samples, true = (
            exam.virtual.samples(faults, scene.virtual.seed) for faults in (scene.virtual.faults, SimulatedFaults())
        )
        faulty = np.array([(samples != true).any(axis=0), np.isnan(samples).any(axis=0)])
    counts = {
        "runs on tyres": int(exam.virtual is not None),
        "faulty channels": int(faulty[0].sum()),
        "silent channels": int(faulty[1].sum()),
        "pulled angles": 2 * (guides == {kernel.PULLED}),
        "enforced angles": 2 * (guides == {kernel.ENFORCED}),
        "moved clocks": sum(bool(file.offset or file.drift) for file in scene.files),
    }
    return counts, path
