"""From a scene to its recording: files as they are, or those that a virtual measurement leaves."""

from pathlib import Path

from models.measured import plan
from models.measured.clock import record
from models.measured.recording import Recording
from models.measured.scene import MeasuredScene
from models.systems import load


def recorded(scene: MeasuredScene, engine: str, folder: Path) -> Recording:
    """The recording on one clock, in an empty folder; InputError for files that cannot be, RunFailed on the road."""
    rig = scene.rig()
    if scene.virtual is not None and rig.vehicle is not None:
        from models.measured.pattern import write_pattern
        from models.measured.virtual import virtual_measurement

        true = virtual_measurement(rig.vehicle, scene.virtual, engine, scene.file)
        write_pattern(scene, true, true.samples(scene.virtual.faults, scene.virtual.seed), folder)
        scene = load(folder / "scene.toml")
    sources = plan.opened(scene)
    return record(scene, sources, plan.mapped(scene, sources, scene.rig()), rig.hubs, folder)
