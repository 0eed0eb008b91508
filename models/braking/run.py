"""A braked vehicle with its controller in the loop, sample by sample, until it stands or its time is over."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from models.braking.advance import AT_REST, LIFTED, NOT_FOUND, advance
from models.braking.brake import Brakes
from models.braking.controller import SAMPLE, Controller, Sample
from models.braking.plane_step import REPORTED
from models.braking.plane_vehicle import Plane
from models.braking.port.ask import ask
from models.braking.pressure import RELEASE, Chambers, by_pressures, by_valves, still
from models.braking.surfaces import Road, check_way
from models.braking.tyre_table import Tables
from models.errors import RunFailed


@dataclass(frozen=True, eq=False)
class Path:
    """What a run recorded at every sample, the start included.

    times (n,) : s; states (n, 2, 2 + U) : positions and rates; turning, pressures, torques (n, W) : rad/s, bar, N m;
    reports (n - 1, W, 7) : of the last step of every sample, see ``plane_step``; stands : whether it ended at rest;
    coordinates : names of those of the states, the first three always x, y (m) and heading (rad); clock : what the
    clock on the wall told of overruns, if the run kept to it.
    """

    times: np.ndarray
    states: np.ndarray
    turning: np.ndarray
    pressures: np.ndarray
    torques: np.ndarray
    reports: np.ndarray
    stands: bool
    coordinates: tuple[str, ...] = ()
    clock: str = ""


class Start(NamedTuple):
    """What a run goes on from: positions and rates (2, 2 + U), and speeds of the wheels' turning (W,) in rad/s."""

    state: np.ndarray
    turning: np.ndarray


@dataclass(frozen=True, eq=False)
class Braked:
    """A vehicle on a road with brakes, ready to run.

    kind (W,) : which tyre each wheel has; steer (W,) : rad, or in its place steering : such angles by time (s), those
    in the middle of each sample; engine : ``models.engines.braking.Carried`` if an engine is to carry the chassis.
    sprung : ``models.braking.sprung.Sprung`` of a vehicle on its suspension, which its engine then marches.
    """

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
    engine: Any = None
    relaxation: np.ndarray | None = None
    sprung: Any = None
    steering: Callable[[float], np.ndarray] | None = None

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates of a state."""
        if self.sprung is not None:
            return tuple(self.sprung.names)
        return ("x", "y", *(f"heading_{k}" for k in range(self.plane.masses.size)))

    def rolling(self, speed: float) -> Start:
        """Steady rolling along x at a speed (m/s)."""
        state = np.zeros((2, len(self.coordinates)))
        state[1, 0] = speed
        return Start(state, speed / self.plane.radius)

    def run(self, controller: Controller, start: float | Start, duration: float = 60.0) -> Path:
        """From a start, or steady rolling along x at a speed (m/s); the brake switch closes at ``switch``.

        Until then no valve lets anything through, whatever the controller commands.

        Raises RunFailed, which names the time and whose ``partial`` is the path until then.
        """
        units, wheels = self.plane.masses.size, self.plane.wheels
        given = start if isinstance(start, Start) else self.rolling(start)
        state, turning = given.state.copy(), given.turning.copy()
        air, torques = still(self.chambers, self.sample), np.zeros((self.substeps + 1, wheels))
        found = np.zeros(2 + units)
        report, time, status, number = np.zeros((wheels, REPORTED)), 0.0, 0, 0
        rows = [(time, state.copy(), turning.copy(), air.pressure.copy(), air.torque.copy())]
        reports = list[np.ndarray]()
        step, released = self.sample / self.substeps, np.full(wheels, RELEASE)
        check_way(self.road, step * float(np.hypot(*state[1, :2])))
        go = advance if self.relaxation is None else _lagging(self.relaxation, state)
        go = go if self.engine is None else self.engine.advance
        with _kept(rows, reports, self.coordinates):
            while status != AT_REST and time < duration - 1e-9:
                braked = time >= self.switch - 1e-9
                known = math.hypot(state[1, 0], state[1, 1]) if self.speed_given else math.nan
                supply = float(air.supply[0])
                asked = Sample(number, round(time * 1e9), turning * self.plane.radius, braked, supply, known)
                command = ask(controller, asked)
                if command.pressures is None:
                    valves = command.valves if braked else released
                    by_valves(valves, self.sample, air, self.chambers, self.brakes, torques)
                else:
                    by_pressures(command.pressures, air, self.brakes, torques)
                steer = self.steer if self.steering is None else self.steering(time + 0.5 * self.sample)
                status, used = go(state, turning, torques, step, steer, self.slope, self.plane, self.kind,
                                       self.road, self.tables.packed, found, report)  # fmt: skip
                time, number = time + used, number + 1
                if status in (NOT_FOUND, LIFTED):
                    raise RunFailed("braking", "a wheel lifts off" if status == LIFTED else "no loads were found", time)
                rows.append((time, state.copy(), turning.copy(), air.pressure.copy(), air.torque.copy()))
                reports.append(report.copy())
        return _path(rows, reports, status == AT_REST, self.coordinates)


def _lagging(lengths: np.ndarray, state: np.ndarray) -> Callable[..., Any]:
    """``advance`` with tyres of relaxation lengths (W,) in m: straight ahead they begin without slip angles, whatever
    the wheels are steered then, and in a turn as in a steady one."""
    from models.braking.relaxation import advance_lagging

    lag = np.full(lengths.size, np.nan if state[1, 1:].any() else 0.0)
    return lambda *given: advance_lagging(*given, lengths, lag)


@contextmanager
def _kept(rows: list[Any], reports: list[Any], names: tuple[str, ...]) -> Iterator[None]:
    """Gives a failed run the path until then."""
    try:
        yield
    except RunFailed as error:
        error.partial = _path(rows, reports, False, names)
        raise


def _path(rows: list[Any], reports: list[Any], stands: bool, names: tuple[str, ...]) -> Path:
    times, states, turning, pressures, torques = (np.array(column) for column in zip(*rows, strict=True))
    return Path(times, states, turning, pressures, torques,
                np.array(reports).reshape(-1, turning.shape[1], REPORTED), stands, names)  # fmt: skip
