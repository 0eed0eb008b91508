"""Braked vehicle on its suspension by the independent reference: no engine and no compiled code in its steps.

It replaces ``models.engines.braking_sprung.EngineSprungVehicle``, with the same start, controller and samples.
"""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from models.brake.advance import AT_REST, FINE, FOLDED
from models.brake.plain.pressure import PlainAirSystem
from models.brake.plain.step import NEGLIGIBLE_TIME, OVER, UPRIGHT, MovingVehicle, PlainVehicleSteps, StepSetting
from models.brake.plain.suspension import PlainSuspension
from models.brake.plane_records import PlaneMotion
from models.brake.samples import BrakeCommands, BrakeSystem, SampleRecord
from models.brake.sprung import LARGEST_HINGE_ANGLE, SprungVehicle
from models.brake.surfaces import VehicleOnRoad
from models.core.errors import RunFailed
from models.engines.assembly import Settings
from models.engines.spatial_protocol import INTEGRATORS, check_modes
from models.engines.stability import LONG_RUN
from models.vehicles.spatial_linear import linearise

if TYPE_CHECKING:
    from models.brake.plain.relaxation import LaggingTyres
    from models.brake.relaxation import TyreLag

NAME = "reference"


class PlainSprungVehicle:
    """A braked vehicle on its suspension in plain Python, with ``advance`` and ``moving`` as in
    ``EngineSprungVehicle``."""

    def __init__(self, sprung_vehicle: SprungVehicle) -> None:
        self.vehicle, self.size, self.suspension = sprung_vehicle, sprung_vehicle.size, PlainSuspension(sprung_vehicle)
        self.liveliness = self.suspension.liveliness()
        self._changes = np.zeros(len(self.suspension.tyres))

    def advance(
        self,
        motion: PlaneMotion,
        torques: np.ndarray,
        step: float,
        steer: np.ndarray,
        vehicle: VehicleOnRoad,
        lag: "LaggingTyres | None" = None,
    ) -> tuple[int, float]:
        """Advance the vehicle in plain Python as ``models.brake.advance.advance`` does; the state (2, n) has all
        coordinates and their rates. Returns the status and the time (s).

        lag : of tyres that lag, moved in place. A run begins with accelerations of zero. Raises RunFailed where the
        vehicle turns over.
        """
        if not motion.accelerations.any():
            self._changes[:] = 0.0
        course = StepSetting(vehicle, steer, vehicle.slope * self.liveliness * step)
        steps, moving, time = PlainVehicleSteps(self.suspension, course, step), self._moving(motion, lag), 0.0
        for ends in pairwise(torques):
            status, used = steps.on(moving, np.array(ends))
            time += used
            if status == OVER:
                raise RunFailed(NAME, f"the vehicle turns over: it leans by more than {UPRIGHT} rad", time)
            if status == FOLDED:
                raise RunFailed(
                    NAME, f"the train jackknifes: a hitch yaws by more than {LARGEST_HINGE_ANGLE:.2f} rad", time
                )
            if status == AT_REST:
                return AT_REST, time
        return FINE, time

    def _moving(self, plane_motion: PlaneMotion, lagging_tyres: "LaggingTyres | None") -> MovingVehicle:
        """The arrays of the compiled motion in the form of the plain code: the report has a row for each wheel."""
        return MovingVehicle(
            plane_motion.state,
            plane_motion.turning,
            self._changes,
            plane_motion.report.T,
            plane_motion.accelerations,
            lagging_tyres,
        )

    def moving(
        self,
        commands: BrakeCommands,
        record: SampleRecord,
        sample: float,
        braking: BrakeSystem,
        motion: PlaneMotion,
        vehicle: VehicleOnRoad,
        lag: "TyreLag | None" = None,
    ) -> Iterator[tuple[int, float, float, float]]:
        """Generator that marches the vehicle in plain Python as ``models.brake.samples.sample_generator`` does; ``lag``
        is the slip lag of the tyres. Raises Refused for a step that is too long, and RunFailed as ``advance`` does.
        """
        torques, time, status, lagging = braking.torques, 0.0, FINE, None
        if lag is not None:
            from models.brake.plain.relaxation import LaggingTyres

            lagging = LaggingTyres(lag.length, vehicle.slope, lag.angle)
        step = sample / (len(torques) - 1)
        self.check_step(step)
        pressures = PlainAirSystem(braking.chambers, braking.brakes, sample, braking.air)
        while True:
            yield status, time, float(np.hypot(*motion.state[1, :2])), float(braking.air.supply[0])
            for _ in range(int(commands.samples[0])):
                if math.isnan(commands.pressures[0]):
                    pressures.by_valves(commands.valves, torques)
                else:
                    pressures.by_pressures(commands.pressures, torques)
                status, used = self.advance(motion, torques, step, commands.steer, vehicle, lagging)
                time += used
                record.present_row[0] = time
                record.rows[record.uncollected_count[0]] = record.present_row
                record.uncollected_count[0] += 1
                if status == AT_REST or time >= record.end_time:
                    break

    def check_step(self, step: float) -> None:
        """Raise Refused for a step (s) with which a mode of the vehicle on its springs and tyres would be unstable."""
        settings = Settings(INTEGRATORS["mujoco"], step, LONG_RUN * step)
        check_modes(NAME, linearise(self.vehicle.handling.vehicle), settings)

    def rolling(self, state: np.ndarray, steer: np.ndarray, vehicle: VehicleOnRoad) -> tuple[np.ndarray, np.ndarray]:
        """Accelerations (n,) of a state (2, n) in which the wheels roll without brakes, and the wheels' rotational
        speeds (W,) in rad/s."""
        return PlainVehicleSteps(self.suspension, StepSetting(vehicle, steer, 0.0), NEGLIGIBLE_TIME).rolling(state)
