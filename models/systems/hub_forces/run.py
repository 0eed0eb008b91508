"""A scene of hub forces in an engine: what its transducers say, what holds roll and pitch, and the run that follows.

A run reads its road or its forces at half steps. What changes faster between them is not resolved but mistaken for
something slower, which no state of the run shows: one that reads twice as often does.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from models.core.errors import RunFailed
from models.core.result import Channel, Result, result
from models.core.signals import Smooth
from models.core.smoothing import smoothed
from models.engines.cut_vehicle import HubRun, build
from models.multibody.cut_table import Drive
from models.road.iso8608 import iso8608_road
from models.systems.hub_forces.measurement import Angles, HubForces, recorded, truth, two_tracks
from models.systems.hub_forces.scene import HubScene, Method
from models.vehicles.cut_vehicle import ANGLES, PITCH, ROLL, CutVehicle, X, Y, Z

if TYPE_CHECKING:
    from models.systems.hub_forces.tilt_filter import Tilt

WINDOW = 1.0
"""s: time of the start over which a run is repeated in half its steps."""
ALLOWED = 0.02
"""Change of an element's force by half the step, by the largest of it: 94 % of a fourth-order error."""
LEAST = 1e-3
"""Share of the largest force of all elements that counts as the largest of one that hardly carries anything."""
MOTION = {name: (column, "rad") for name, column in ANGLES.items()} | {"x": (X, "m"), "y": (Y, "m"), "z": (Z, "m")}
"""Channels of the chassis: its coordinate, and the unit of that."""


@dataclass(frozen=True)
class Measurement:
    """What drives the runs of a scene: hub forces and angles, and the true run (None) where both are virtual."""

    scene: HubScene
    vehicle: CutVehicle
    truth: HubRun | None
    forces: HubForces
    angles: Angles

    @cached_property
    def tilt(self) -> "Tilt":
        """The Kalman filter's estimate; InputError where the measurement contradicts itself."""
        from models.systems.hub_forces.tilt_filter import estimate

        scene = self.scene
        deviations = scene.deviations(self.vehicle), scene.angles.deviations
        return estimate(self.vehicle, self.forces, self.angles, *deviations, scene.stabilise.model, scene.file)

    def drive(self, method: Method, step: float, steps: int) -> Drive:
        """Inputs of so many steps (s), roll and pitch held by a method; raises InputError."""
        scene, free = self.scene, self.forces.drive(step, steps, self.scene.forces.interpolation)
        if method == "kalman":
            from models.systems.hub_forces.tilt_filter import pulled

            return pulled(free, self.vehicle, self.tilt, step, scene.stabilise.bandwidth)
        if method == "prescribed":
            return enforced(free, self.angles, step, scene.stabilise.smoothing, scene.file)
        return free

    def start(self, drive: Drive) -> np.ndarray:
        """At rest in the design position (2 n,); an enforced tilt begins where its file does."""
        n = self.vehicle.size
        start = np.zeros(2 * n)
        if drive.guide is not None and drive.pull is None:
            start[[ROLL, PITCH, n + ROLL, n + PITCH]] = drive.guide[0, :4]
        return start


def enforced(drive: Drive, angles: Angles, step: float, smoothing: float, file: str = "") -> Drive:
    """The drive with measured angles enforced, once through a low-pass of ``smoothing`` (Hz); raises InputError."""
    quiet = smoothed(angles.samples[:, :2], angles.period, smoothing, file, "stabilise.smoothing")
    return with_angles(drive, quiet, angles.period, step)


def with_angles(drive: Drive, angles: np.ndarray, period: float, step: float) -> Drive:
    """The drive with roll and pitch (m, 2), rad, enforced: a quintic spline through the samples."""
    motion = Smooth(angles, period, derivatives=2, degree=5)
    return replace(drive, guide=motion.sample(0.0, step / 2, len(drive.hubs)))


def measure(scene: HubScene, engine: str) -> Measurement:
    """What transducers say: of the files, or of a run on the road, with its noise; RunFailed for too long a step."""
    vehicle, road, step = scene.cut_vehicle(), scene.road, scene.run.step
    if road is None:
        return Measurement(scene, vehicle, None, *scene.measured(vehicle))
    left, right = (iso8608_road(road.iso8608, road.seed + i) for i in range(2))

    def on_road(step: float, steps: int) -> HubRun:
        drive = two_tracks(vehicle, left, right, road.speed, step, steps)
        return truth(engine, vehicle, drive, scene.forces.frame, step, step * steps)

    true = on_road(step, scene.steps)
    check_halved(engine, true, [element.name for element in vehicle.elements], on_road)
    forces, angles = recorded(true, scene.forces.frame, round(1.0 / (scene.forces.sampling_rate * step)))
    if scene.forces.noise == "white":
        forces = forces.noisy(scene.deviations(vehicle), scene.seed)
    if scene.angles.noise == "white":
        angles = angles.noisy(scene.angles.deviations, scene.seed)
    return Measurement(scene, vehicle, true, forces, angles)


def check_halved(engine: str, run: HubRun, names: list[str], again: Callable[[float, int], HubRun]) -> None:
    """Raise RunFailed where the steps were too long; again : (step in s, steps) -> the same run with these.

    A vehicle that has no springs, mounts or bars has nothing that a step could be too long for.
    """
    if not names:
        return
    step = float(run.times[1] - run.times[0])
    rows = min(len(run.times) - 1, max(2, round(WINDOW / step)))
    fine = again(step / 2.0, 2 * rows).elements[::2]
    largest = np.abs(fine).max(axis=0)
    changes = np.abs(fine - run.elements[: rows + 1]).max(axis=0) / np.maximum(largest, LEAST * largest.max())
    worst = int(changes.argmax())
    if not changes[worst] <= ALLOWED:
        raise RunFailed(
            engine,
            f"steps of {step:g} s are too long: half of them change the force of "
            f"{names[worst]!r} by {changes[worst]:.2g} of its largest; use a smaller step",
        )


def run(scene: HubScene, engine: str, method: Method | None = None, measurement: Measurement | None = None) -> Result:
    """The cut vehicle on its hub forces; the result's detail is the HubRun. Raises InputError, Refused, RunFailed.

    method : what holds roll and pitch, the scene's own where none is named; measurement : of the scene, where it was
    made before, as for runs in several engines; else this engine makes it.
    """
    measurement, method = measurement or measure(scene, engine), method or scene.stabilise.method
    drive = measurement.drive(method, scene.run.step, scene.steps)
    model = build(engine, measurement.vehicle, drive, scene.run.step, scene.run.duration)
    begun = time.process_time()
    path = model.run(measurement.start(drive))
    seconds = time.process_time() - begun
    return labelled(measurement, path, engine, method, seconds)


def labelled(
    measurement: Measurement, path: HubRun, engine: str, method: str = "on tyres", seconds: float = 0.0
) -> Result:
    """A run of the measurement's vehicle: motion of its chassis, section forces, moments that hold roll and pitch."""
    steps = len(path.times) - 1
    channels = {name: Channel("time", path.states[:, column], unit) for name, (column, unit) in MOTION.items()}
    channels |= {
        "section_force": Channel(("time", "element"), path.elements, "N", "compression; of bars a moment, N m"),
        "holding_moment": Channel(("time", "held"), path.moments, "N m", "of the stabiliser on roll and pitch"),
    }
    axes = {
        "time": Channel("time", path.times, "s"),
        "element": Channel("element", [element.name for element in measurement.vehicle.elements]),
        "held": Channel("held", ["roll", "pitch"]),
    }
    return result(
        measurement.scene,
        channels,
        axes,
        engine=engine,
        counts={"steps": steps, "force calls": 4 * steps, "states": path.states.shape[1]},
        seconds=seconds,
        doubts=measurement.tilt.doubts if method == "kalman" else (),
        detail=path,
        method=method,
    )
