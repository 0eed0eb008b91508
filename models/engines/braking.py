"""Braked vehicle whose chassis moves in an engine: "exudyn" or "mujoco" has the bodies, joints and masses.

Tyres, wheels and the loads under them stay with the compiled step, which is exact where an engine would need steps of
microseconds. Each step it finds the mean force of every tyre in the wheel's own axes; the engine then marches by its
own Runge-Kutta method with these forces held at the wheels, turned with them, as custom forces. Its coordinates are X,
Y and the heading of the first unit and the angles of the hinges.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from models.brake.advance import FINE, advance
from models.brake.plane_records import PlaneMotion, WheelReport
from models.brake.plane_vehicle import PlaneVehicle
from models.brake.samples import samples_with_step
from models.brake.surfaces import VehicleOnRoad
from models.engines.free_vehicle import FreeModel, LoadedVehicle, free_model
from models.machine.compiled import lean
from models.machine.stack import array, at, beyond
from models.vehicles.spatial import Body, SpatialVehicle

HEADER, HELD = 2, 6
"""Length of the table's header, which holds the numbers of units and of wheels, and number of table rows of wheel
quantities."""


class WheelForces(NamedTuple):
    """Wheel quantities, each (W,), that are constant over a step: number of the unit (tractor or trailer), position (m)
    in the unit's axes, steer angle (rad), and mean forces (N) in the wheel's own axes. They are the rows at the end of
    the table, behind the units' reach."""

    unit: np.ndarray
    x: np.ndarray
    y: np.ndarray
    steer: np.ndarray
    force_x: np.ndarray
    force_y: np.ndarray


@lean
def add_constant_wheel_forces(parameter_table, time, q, v, generalised_forces):
    """Add the wheel forces, constant in the wheels' own axes, to the generalised forces ``generalised_forces``. All
    arguments but the time are pointers to doubles."""
    head = array(parameter_table, (HEADER,))
    units, wheels = int(head[0]), int(head[1])
    reach = array(beyond(parameter_table, HEADER), (units, units))
    rows = array(beyond(parameter_table, HEADER + units * units), (HELD, wheels))
    wheel = WheelForces(rows[0], rows[1], rows[2], rows[3], rows[4], rows[5])
    position, force = array(q, (2 + units,)), array(generalised_forces, (2 + units,))
    for i in range(wheels):
        k, heading = int(wheel.unit[i]), wheel.steer[i]
        for j in range(k + 1):
            heading += position[2 + j]
        c, s = np.cos(heading), np.sin(heading)
        fx, fy = c * wheel.force_x[i] - s * wheel.force_y[i], s * wheel.force_x[i] + c * wheel.force_y[i]
        force[0] += fx
        force[1] += fy
        psi = 0.0
        for j in range(units):
            psi += position[2 + j]
            way = reach[k, j] + (wheel.x[i] if j == k else 0.0)
            side = wheel.y[i] if j == k else 0.0
            c, s = np.cos(psi), np.sin(psi)
            moment = fx * (-way * s - side * c) + fy * (way * c - side * s)
            for a in range(j + 1):
                force[2 + a] += moment


@lean
def set_constant_wheel_forces(block_address, t, coordinate_count):
    """Compute the generalised wheel forces for a state, in a block of doubles at an address: forces f (n,), which are
    set to zero first, q and v (n,), and the table."""
    f = at(block_address)
    array(f, (coordinate_count,))[:] = 0.0
    add_constant_wheel_forces(
        beyond(f, 3 * coordinate_count), t, beyond(f, coordinate_count), beyond(f, 2 * coordinate_count), f
    )


def bodies_of_plane_vehicle(plane_vehicle: PlaneVehicle) -> SpatialVehicle:
    """The units of a plane vehicle (tractor, trailers) as bodies of an engine. Each unit after the first turns about
    its hinge.

    The hinge of unit k lies at reach[k, j] ahead of the units j < k and reach[k, k] behind its own centre.
    """
    chain = list[Body]()
    for k, (mass, turn) in enumerate(zip(plane_vehicle.masses, plane_vehicle.inertias, strict=True)):
        tensor = ((turn, 0.0, 0.0), (0.0, turn, 0.0), (0.0, 0.0, turn))
        hinge, centre = float(plane_vehicle.arm_lengths[k, :k].sum()), float(plane_vehicle.arm_lengths[k].sum())
        if k == 0:
            chain.append(Body("0", float(mass), (0.0, 0.0, 0.0), ("x", "y", "rz"), tensor))
            continue
        below = "0" if k == 1 else f"hinge {k - 1}"
        chain.append(Body(f"hinge {k}", 0.0, (hinge, 0.0, 0.0), ("rz",), parent=below))
        chain.append(Body(str(k), float(mass), (centre, 0.0, 0.0), (), tensor, parent=f"hinge {k}"))
    return SpatialVehicle("braked", tuple(chain), (), (), ())


class EngineChassis:
    """The chassis of a plane vehicle in an engine. Its ``advance`` replaces the compiled function
    ``models.brake.advance.advance``."""

    def __init__(self, engine: str, plane_vehicle: PlaneVehicle) -> None:
        units, none = plane_vehicle.masses.size, np.zeros((3, plane_vehicle.wheels))
        wheels = np.vstack((plane_vehicle.unit, plane_vehicle.place.T, none))
        numbers = np.concatenate(([units, plane_vehicle.wheels], plane_vehicle.arm_lengths.ravel(), wheels.ravel()))
        driven = LoadedVehicle(
            bodies_of_plane_vehicle(plane_vehicle),
            np.zeros(3),
            numbers,
            add_constant_wheel_forces,
            set_constant_wheel_forces,
        )
        self._model: FreeModel = free_model(engine, driven)
        self._held = WheelForces(*self._model.numbers[HEADER + units * units :].reshape(HELD, plane_vehicle.wheels))

    def advance(
        self,
        motion: PlaneMotion,
        torques: np.ndarray,
        step: float,
        steer: np.ndarray,
        vehicle: VehicleOnRoad,
        *lag: Any,
    ) -> tuple[int, float]:
        """Advance a braked vehicle as ``models.brake.advance.advance`` does (``advance_lagging`` with a ``TyreLag``);
        the engine computes the motion in each step (s). Returns the status and the time (s).
        """
        time, report, go = 0.0, WheelReport(*motion.report), advance
        if lag:
            from models.brake.relaxation import advance_lagging as go
        for n in range(len(torques) - 1):
            before = motion.state.copy()
            status, used = go(motion, torques[n : n + 2], step, steer, vehicle, *lag)
            time += used
            if status != FINE:
                return status, time
            self._held.steer[:] = steer
            self._held.force_x[:], self._held.force_y[:] = report.force_x, report.force_y
            motion.state[:] = self._state_after_step(before, step)
        return FINE, time

    def moving(self, *arguments: Any) -> Iterator[tuple[int, float, float, float]]:
        """Generator that marches a braked vehicle as ``models.brake.samples.sample_generator`` does; the engine
        computes the motion in each step.
        """
        return samples_with_step(self.advance)(*arguments)

    def _state_after_step(self, state_before: np.ndarray, time_step: float) -> np.ndarray:
        """Positions and rates (2, 2 + U) of the U units after a step (s) of the engine."""
        carried = state_before.copy()
        carried[:, 3:] = np.diff(state_before[:, 2:], axis=1)
        after = self._model.march(carried[0], carried[1], 1, time_step)[-1].reshape(2, -1)
        after[:, 2:] = np.cumsum(after[:, 2:], axis=1)
        return after
