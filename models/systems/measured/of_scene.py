"""From a scene to its recording: files as they are, or those that a virtual measurement leaves."""

from pathlib import Path

from models.core.systems import load
from models.measured.recording import Recording
from models.systems.measured import plan
from models.systems.measured.clock import record
from models.systems.measured.scene import MeasuredScene


def recorded(scene: MeasuredScene, engine: str, folder: Path) -> Recording:
    """The recording on one clock, in an empty folder; InputError for files that cannot be, RunFailed on the road."""
    rig = scene.rig()
    if scene.virtual is not None and rig.vehicle is not None:
        from models.systems.measured.pattern import write_pattern
        from models.systems.measured.virtual import virtual_measurement

        true = virtual_measurement(rig.vehicle, scene.virtual, engine, scene.file)
        write_pattern(scene, true, true.samples(scene.virtual.faults, scene.virtual.seed), folder)
        scene = load(folder / "scene.toml")
    sources = plan.opened(scene)
    return record(scene, sources, plan.mapped(scene, sources, scene.rig()), rig.hubs, folder)
