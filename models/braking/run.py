"""A braked vehicle with its controller in the loop, sample by sample, until it stands or its time is over."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from models.braking.advance import AT_REST, LIFTED, NOT_FOUND, advance
from models.braking.brake import Brakes
from models.braking.controller import SAMPLE, Controller, Sample
from models.braking.plane_step import REPORTED
from models.braking.plane_vehicle import Plane
from models.braking.port.ask import ask
from models.braking.pressure import Chambers, by_pressures, by_valves, still
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
    switch: float = 0.0

    def run(self, controller: Controller, speed: float, duration: float = 60.0) -> Path:
        """From steady rolling along x at a speed (m/s); the brake switch closes at ``switch``.

        Raises RunFailed, which names the time and whose ``partial`` is the path until then.
        """
        units, wheels = self.plane.masses.size, self.plane.wheels
        state, turning = np.zeros((2, 2 + units)), speed / self.plane.radius
        state[1, 0] = speed
        air, torques = still(self.chambers, self.sample), np.zeros((self.substeps + 1, wheels))
        found = np.zeros(2 + units)
        report, time, status, number = np.zeros((wheels, REPORTED)), 0.0, 0, 0
        rows = [(time, state.copy(), turning.copy(), air.pressure.copy(), air.torque.copy())]
        reports = []
        step = self.sample / self.substeps
        with _kept(rows, reports):
            while status != AT_REST and time < duration - 1e-9:
                braked = time >= self.switch - 1e-9
                known = float(np.hypot(*state[1, :2])) if self.speed_given else np.nan
                supply = float(air.supply[0])
                given = Sample(number, round(time * 1e9), turning * self.plane.radius, braked, supply, known)
                command = ask(controller, given)
                if command.pressures is None:
                    by_valves(command.valves, self.sample, air, self.chambers, self.brakes, torques)
                else:
                    by_pressures(command.pressures, air, self.brakes, torques)
                status, used = advance(state, turning, torques, step, self.steer, self.slope, self.plane, self.kind,
                                       self.road, self.tables.packed, found, report)  # fmt: skip
                time, number = time + used, number + 1
                if status in (NOT_FOUND, LIFTED):
                    raise RunFailed("braking", "a wheel lifts off" if status == LIFTED else "no loads were found", time)
                rows.append((time, state.copy(), turning.copy(), air.pressure.copy(), air.torque.copy()))
                reports.append(report.copy())
        return _path(rows, reports, status == AT_REST)


@contextmanager
def _kept(rows: list[Any], reports: list[Any]) -> Iterator[None]:
    """Gives a failed run the path until then."""
    try:
        yield
    except RunFailed as error:
        error.partial = _path(rows, reports, False)
        raise


def _path(rows: list[Any], reports: list[Any], stands: bool) -> Path:
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    wheels = columns[2].shape[1]
    return Path(*columns, np.array(reports).reshape(-1, wheels, REPORTED), stands)
