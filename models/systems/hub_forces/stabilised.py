"""What drives the runs of a measurement: its hub forces alone, or with a stabiliser, made when one is asked for."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from models.multibody.cut_table import Drive
from models.systems.hub_forces.measurement import Angles, HubForces
from models.systems.hub_forces.scene import HubScene, Method
from models.vehicles.cut_vehicle import PITCH, ROLL, CutVehicle

if TYPE_CHECKING:
    from models.systems.hub_forces.tilt_filter import Tilt


@dataclass(frozen=True)
class Stabilised:
    """A measurement that drives a scene's vehicle."""

    scene: HubScene
    vehicle: CutVehicle
    forces: HubForces
    angles: Angles

    @cached_property
    def tilt(self) -> "Tilt":
        """The Kalman filter's estimate; InputError where the measurement contradicts itself."""
        from models.systems.hub_forces.tilt_filter import estimate

        own = self.scene
        return estimate(
            self.vehicle,
            self.forces,
            self.angles,
            own.deviations(self.vehicle),
            own.angles.deviations,
            own.stabilise.model,
            own.file,
        )

    def drive(self, method: Method, step: float, steps: int) -> Drive:
        """Inputs of so many steps (s), roll and pitch held by a method; raises InputError."""
        free = self.forces.drive(step, steps, self.scene.forces.interpolation)
        if method == "kalman":
            from models.systems.hub_forces.tilt_filter import pulled

            return pulled(free, self.vehicle, self.tilt, step, self.scene.stabilise.bandwidth)
        if method == "prescribed":
            from models.systems.hub_forces.enforced import enforced

            return enforced(free, self.angles, step, self.scene.stabilise.smoothing, self.scene.file)
        return free

    def start(self, drive: Drive) -> np.ndarray:
        """At rest in the design position (2 n,); an enforced tilt begins where its file does."""
        start, n = np.zeros(2 * self.vehicle.size), self.vehicle.size
        if drive.guide is not None and drive.pull is None:
            start[[ROLL, PITCH, n + ROLL, n + PITCH]] = drive.guide[0, :4]
        return start
