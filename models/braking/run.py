"""A braked vehicle with its controller in the loop, sample by sample, until it stands or its time is over."""

from dataclasses import dataclass

import numpy as np

from models.braking.advance import AT_REST, LIFTED, NOT_FOUND, Chambers, advance
from models.braking.brake import Brakes
from models.braking.controller import SAMPLE, Controller, Sample
from models.braking.plane_step import REPORTED
from models.braking.plane_vehicle import Plane
from models.braking.surfaces import Road
from models.braking.tyre_table import Tables
from models.errors import RunFailed


@dataclass(frozen=True, eq=False)
class Path:
    """What a run recorded at every sample, the start included.

    times (n,) : s; states (n, 2, 2 + U) : positions and rates; turning, pressures, torques (n, W) : rad/s, bar, N m;
    reports (n - 1, W, 7) : of the last step of every sample, see ``plane_step``; stands : whether it ended at rest.
    """

    times: np.ndarray
    states: np.ndarray
    turning: np.ndarray
    pressures: np.ndarray
    torques: np.ndarray
    reports: np.ndarray
    stands: bool


@dataclass(frozen=True, eq=False)
class Braked:
    """A vehicle on a road with brakes, ready to run. kind (W,) : which tyre each wheel has; steer (W,) : rad."""

    plane: Plane
    kind: np.ndarray
    tables: Tables
    slope: float
    road: Road
    brakes: Brakes
    chambers: Chambers
    steer: np.ndarray
    substeps: int = 4
    sample: float = SAMPLE
    speed_given: bool = True

    def run(self, controller: Controller, speed: float, duration: float = 60.0) -> Path:
        """From steady rolling along x at a speed (m/s), the brake switch closed at time 0; RunFailed names the time."""
        units, wheels = self.plane.masses.size, self.plane.wheels
        state, turning = np.zeros((2, 2 + units)), speed / self.plane.radius
        state[1, 0] = speed
        pressure, torques, found = np.zeros(wheels), np.zeros(wheels), np.zeros(2 + units)
        report, time, status, number = np.zeros((wheels, REPORTED)), 0.0, 0, 0
        rows = [(time, state.copy(), turning.copy(), pressure.copy(), torques.copy())]
        reports = []
        step = self.sample / self.substeps
        while status != AT_REST and time < duration - 1e-9:
            known = float(np.hypot(*state[1, :2])) if self.speed_given else np.nan
            given = Sample(number, round(time * 1e9), turning * self.plane.radius, True, self.chambers.supply, known)
            command = controller.sample(given)
            status, used = advance(state, turning, pressure, torques, command.valves, self.chambers, self.brakes,
                                   self.substeps, step, self.steer, self.slope, self.plane, self.kind, self.road,
                                   self.tables.packed, found, report)  # fmt: skip
            time, number = time + used, number + 1
            if status in (NOT_FOUND, LIFTED):
                raise RunFailed("braking", "a wheel lifts off" if status == LIFTED else "no loads were found", time)
            rows.append((time, state.copy(), turning.copy(), pressure.copy(), torques.copy()))
            reports.append(report.copy())
        columns = [np.array(column) for column in zip(*rows, strict=True)]
        return Path(*columns, np.array(reports), status == AT_REST)
