"""Motions of the parts of a vehicle on which its assumptions are checked: wheel loads, travels, angles, slip angles."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from models.core.assumptions import GaussianValues
from models.core.errors import InputError
from models.ride.sweep import variance_sweep
from models.road.excitation import RoadExcitation
from models.systems.ride.of_scene import GRAVITY, LinearVehicleAtSpeed
from models.vehicles.kinematics import Kinematics
from models.vehicles.linear_vehicle import LinearOutput, LinearVehicle
from models.vehicles.spatial import PartOutput, PointOutput, SpatialOutput, SpatialVehicle, TurnOutput, TyreOutput
from models.vehicles.spatial_linear import linear_outputs, linearise, static_preloads

ROTATION_AXES = {"rx": (1.0, 0.0, 0.0), "ry": (0.0, 1.0, 0.0), "rz": (0.0, 0.0, 1.0)}
"""Axis of each rotational degree of freedom."""
JUDGED_SPEED_COUNT = 5
"""Number of speeds of a sweep at which assumptions are checked, the slowest and the fastest among them."""


class WatchedMotion(Protocol):
    """Protocol of the motion of a vehicle's parts in a run; motions have the names of ``watched_outputs``."""

    def motion_of_part(self, motion_name: str) -> np.ndarray | GaussianValues:
        """Returns the values of a part's motion at every row of the run, or its Gaussian statistics."""
        ...


def watched_outputs(vehicle: SpatialVehicle) -> tuple[SpatialOutput, ...]:
    """Returns the outputs of a vehicle on which assumptions are checked: tyre forces without the static load, travels
    of springs and their rates, angles of bodies and, where tyres have side forces, the components of their slip.
    """
    turning = [(body.name, f) for body in vehicle.bodies for f in body.freedoms if f in ROTATION_AXES]
    watched_list: list[SpatialOutput] = [
        TyreOutput(f"load {tyre.name}", "tyre force", tyre.name) for tyre in vehicle.tyres
    ]
    watched_list += [PartOutput(f"travel {spring.name}", "travel", spring.name) for spring in vehicle.springs]
    watched_list += [PartOutput(f"rate {spring.name}", "travel rate", spring.name) for spring in vehicle.springs]
    watched_list += [
        TurnOutput(f"{freedom} {body}", "angle", body, ROTATION_AXES[freedom]) for body, freedom in turning
    ]
    for force in vehicle.side_forces:
        watched_list.append(
            PointOutput(f"side velocity {force.name}", "velocity", force.body, force.point, (0.0, 1.0, 0.0))
        )
        watched_list.append(TurnOutput(f"roll {force.name}", "angle", force.chassis, ROTATION_AXES["rx"]))
        watched_list.append(TurnOutput(f"yaw {force.name}", "angle", force.chassis, ROTATION_AXES["rz"]))
    return tuple(watched_list)


def watched_vehicle(linear_vehicle: LinearVehicle, vehicle: SpatialVehicle, speed: float) -> LinearVehicle:
    """Returns a linear vehicle, of any engine, with the outputs of ``watched_outputs`` and the slip angles (rad) at a
    speed (m/s).
    """
    watched = replace(vehicle, outputs=watched_outputs(vehicle))
    rows = linearise(watched, speed).outputs if vehicle.limits else linear_outputs(watched, Kinematics(watched))
    return replace(linear_vehicle, outputs=(*rows, *_slip_outputs(vehicle, rows, speed)))


def _slip_outputs(vehicle: SpatialVehicle, outputs: tuple[LinearOutput, ...], speed: float) -> Iterator[LinearOutput]:
    """Yields the slip angle (rad) at a speed (m/s) of every tyre with a side force, as an output."""
    named = {row.name: row for row in outputs}
    for force in vehicle.side_forces:
        side, roll, yaw = (named[f"{quantity_name} {force.name}"] for quantity_name in ("side velocity", "roll", "yaw"))
        displacement = force.roll_steer * roll.displacement_factors + yaw.displacement_factors
        yield replace(
            yaw, name=f"slip {force.name}", rate_factors=-side.rate_factors / speed, displacement_factors=displacement
        )


def static_loads(vehicle: SpatialVehicle) -> dict[str, float]:
    """Static load (N) of every tyre by name; empty where the springs carry no weight."""
    with suppress(InputError):
        return static_preloads(replace(vehicle, gravity=GRAVITY)).tyres
    return {}


def checked_speeds(speeds: Sequence[float] | np.ndarray) -> list[float]:
    """Returns at most JUDGED_SPEED_COUNT of the speeds (m/s), evenly chosen, with the slowest and the fastest."""
    rising = np.unique(np.asarray(speeds, float))
    return [
        float(rising[i]) for i in np.unique(np.linspace(0, len(rising) - 1, JUDGED_SPEED_COUNT).round().astype(int))
    ]


@dataclass(frozen=True)
class SpectralMotion:
    """Gaussian motion of a vehicle's parts from covariances at constant speeds (m/s). ``means`` (speeds,) : of motions
    whose mean is not the rest position, by name.
    """

    vehicle: SpatialVehicle
    linear: LinearVehicleAtSpeed
    road: RoadExcitation
    speeds: Sequence[float]
    means: Mapping[str, np.ndarray]

    def motion_of_part(self, motion_name: str) -> GaussianValues:
        """Returns the Gaussian statistics of a part's motion at every speed."""
        mean = self.means.get(motion_name, np.zeros(len(self.speeds)))
        return GaussianValues(mean, self._deviations[motion_name], [f"at {speed:g} m/s" for speed in self.speeds])

    @cached_property
    def _deviations(self) -> dict[str, np.ndarray]:
        """Standard deviations (speeds,) of all motions by name; NaN at speeds without a stationary motion."""
        rows, names = [], [output.name for output in self._watched_at_speed(self.speeds[0]).outputs]
        for speed in self.speeds:
            try:
                rows.append(variance_sweep(self._watched_at_speed, {"own": self.road}, [speed]).deviation[0, 0])
            except InputError:
                rows.append(np.full(len(names), np.nan))
        return dict(zip(names, np.array(rows).T, strict=True))

    def _watched_at_speed(self, speed: float) -> LinearVehicle:
        return watched_vehicle(self.linear(speed), self.vehicle, speed)


@dataclass(frozen=True)
class MotionAlongDrive:
    """Gaussian motion of a vehicle's parts along a drive of varying speed. deviations (time,) : of motions that are
    outputs of the run, by name; speed_by_speed : of other motions, stationary at some speeds.
    """

    deviations: Mapping[str, np.ndarray]
    speed_by_speed: SpectralMotion

    def motion_of_part(self, motion_name: str) -> GaussianValues:
        """Returns the Gaussian statistics of a part's motion at every instant of the drive, or at some speeds."""
        if motion_name in self.deviations:
            deviation = self.deviations[motion_name]
            return GaussianValues(np.zeros(len(deviation)), deviation)
        return self.speed_by_speed.motion_of_part(motion_name)


def watched_deviations(vehicle: SpatialVehicle, output_deviations: np.ndarray) -> dict[str, np.ndarray]:
    """Returns those columns of the standard deviations (rows, outputs) of a vehicle's outputs that are motions of
    ``watched_outputs``, by name.
    """
    names_of_outputs = {replace(output, name=""): output.name for output in watched_outputs(vehicle)}
    pairs = zip(vehicle.outputs, output_deviations.T, strict=False)  # weighted ones come last
    return {
        names_of_outputs[unnamed]: values
        for output, values in pairs
        if (unnamed := replace(output, name="")) in names_of_outputs
    }


@dataclass(frozen=True)
class MotionInRun:
    """Motion of a vehicle's parts in a run in time. positions, rates (rows, n) : of the coordinates; heights (rows,
    2 w) : of the road under the wheels, and their rates.
    """

    watched_vehicle: LinearVehicle
    positions: np.ndarray
    rates: np.ndarray
    heights: np.ndarray

    def motion_of_part(self, motion_name: str) -> np.ndarray:
        """Returns the values of a part's motion at every row of the run."""
        row = {output.name: output for output in self.watched_vehicle.outputs}[motion_name]
        road = np.concatenate([row.road_factors, row.road_rate_factors])
        return self.positions @ row.displacement_factors + self.rates @ row.rate_factors + self.heights @ road
