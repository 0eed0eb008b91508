"""A vehicle without its wheels, loaded by hub forces or by its tyres on a road, in plain numpy.

The laws of ``models.multibody.cut_kernel`` anew: springs and bars from the vehicle that was cut, not from its
elements; preloads from ``statics``; moments as couples; what enforces roll and pitch from one linear system.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from models.multibody.plain.motion import FIRST_DERIVATIVE, GROUND, PLACE, RATE, Bodies, PlainMotion
from models.multibody.plain.parts import PlainParts
from models.multibody.plain.statics import preloads_at_rest
from models.vehicles.cut_vehicle import HEADING, PITCH, ROLL, CutVehicle

if TYPE_CHECKING:
    from models.multibody.cut_table import HubInputs

ROLL_AND_PITCH = [ROLL, PITCH]
WRENCH = 6
REPORTED = ("inside", "wrenches", "moments")


class HubState(NamedTuple):
    """Accelerations (n,), forces of springs and bars (p,), wrenches (h, 6) in the frame of the hub inputs and moments
    (2,) that stabilise roll and pitch, at one state."""

    acceleration: np.ndarray
    inside: np.ndarray
    wrenches: np.ndarray
    moments: np.ndarray


class PlainHubs:
    """Equations of motion of a vehicle loaded at its wheel hubs, in plain numpy. ``step`` (s) covers two intervals
    between rows of the inputs.

    any_time : whether the hub inputs are read between its rows, too, for methods that pick their own steps.
    """

    def __init__(
        self, vehicle: CutVehicle, hub_inputs: "HubInputs", time_step: float, reads_any_time: bool = False
    ) -> None:
        self.vehicle, self.hub_inputs, self.step, self.any_time = vehicle, hub_inputs, time_step, reads_any_time
        self.bodies = Bodies(vehicle.tree)
        self.parts = PlainParts(self.bodies, vehicle.uncut, vehicle.chassis)
        self.held, self.loads = preloads_at_rest(vehicle.uncut, vehicle.chassis)
        self._weight = np.array([0.0, 0.0, -vehicle.tree.gravity])
        tyres = vehicle.uncut.tyres
        self._hubs = self.bodies.points([(tyre.body, tyre.point) for tyre in tyres])
        self._chassis = self.bodies.row[vehicle.chassis]
        sides = {force.name: force for force in vehicle.uncut.side_forces}
        self._sides = [
            (sides[t.name].stiffness, sides[t.name].roll_steer) if t.name in sides else (0.0, 0.0) for t in tyres
        ]
        frames = {"hub": self._hubs.rows, "body": np.full(len(tyres), self._chassis)}
        self._frames = frames.get(hub_inputs.frame, np.full(len(tyres), GROUND))

    def at(self, t: float, q: np.ndarray, v: np.ndarray) -> HubState:
        """Accelerations, forces and moments at a time (s), coordinates and rates (n,)."""
        hubs, guide = self._inputs(t)
        motion = self.bodies.move(q, v)
        mass, force = self.bodies.inertia(motion, self._weight)
        travels = self.parts.travels(motion, q, v)
        spring, other = self.parts.forces(travels, self.held)
        inside = spring + other
        by_hubs, wrenches = self._hub_forces(motion, hubs, q)
        force += by_hubs - inside @ travels.gradient
        acceleration, moments = self._guide_accelerations(mass, force, guide, q, v)
        return HubState(acceleration, inside, wrenches, moments)

    def _inputs(self, t: float) -> tuple[np.ndarray, np.ndarray | None]:
        """Rows of the hub inputs and of the prescribed roll and pitch at a time (s): the nearest rows, or a parabola
        through the three rows of a step."""
        last, place = len(self.hub_inputs.hubs) - 1, 2.0 * t / self.step
        if not self.any_time:
            nearest = min(max(round(place), 0), last)
            return self.hub_inputs.hubs[nearest], None if self.hub_inputs.guide is None else self.hub_inputs.guide[
                nearest
            ]
        first = min(2 * int(max(place, 0.0) // 2), last - 2)
        part = min(max(place - first, 0.0), 2.0)

        def between(input_rows: np.ndarray) -> np.ndarray:
            slope, bend = (
                np.diff(input_rows[first : first + 2], axis=0)[0],
                np.diff(input_rows[first : first + 3], 2, axis=0)[0],
            )
            value: np.ndarray = input_rows[first] + part * slope + 0.5 * part * (part - 1.0) * bend
            return value

        return between(self.hub_inputs.hubs), None if self.hub_inputs.guide is None else between(self.hub_inputs.guide)

    def acceleration(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (n,) at a time (s), coordinates and rates (n,)."""
        return self.at(t, q, v).acceleration

    def report(self, times: np.ndarray, states: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Forces (m, p) of springs and bars, wrenches (m, h, 6) and moments (m, 2) of states (m, 2 n) at times (m,)."""
        rows = [self.at(float(t), *np.split(state, 2)) for t, state in zip(times, states, strict=True)]
        return tuple(np.array([getattr(row, name) for row in rows]) for name in REPORTED)  # type: ignore[return-value]

    def _hub_forces(
        self, body_motion: PlainMotion, hub_loads: np.ndarray, q: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Generalised forces (n,) of all hubs for one row of the hub inputs, and the hubs' wrenches (h, 6)."""
        points, total, wrenches = (
            body_motion.at(self._hubs),
            np.zeros(self.bodies.size),
            np.empty((len(self.loads), WRENCH)),
        )
        for i, (point, frame) in enumerate(zip(points, self._frames, strict=True)):
            axes = body_motion.axes(int(frame))[PLACE]
            if self.hub_inputs.road:
                force, moment = self._tyre_wrench(i, point, body_motion, (hub_loads[i], hub_loads[len(points) + i]), q)
                wrenches[i] = np.concatenate((force @ axes, moment @ axes))
            else:
                wrenches[i] = hub_loads[WRENCH * i : WRENCH * (i + 1)]
                force, moment = axes @ wrenches[i, :3], axes @ wrenches[i, 3:]
            total += point[FIRST_DERIVATIVE:] @ force + body_motion.moment_forces(int(self._hubs.rows[i]), moment)
        return total, wrenches

    def _tyre_wrench(
        self,
        hub_index: int,
        hub_position: np.ndarray,
        body_motion: PlainMotion,
        road_height_and_rate: tuple[float, float],
        q: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Force (N) and moment (N m), in space, on hub i from its tyre, on a road with height (m) and vertical velocity
        (m/s)."""
        tyre, (cornering, roll_steer), speed = (
            self.vehicle.uncut.tyres[hub_index],
            self._sides[hub_index],
            self.hub_inputs.speed,
        )
        height, rising = road_height_and_rate
        down = -tyre.point[2] * body_motion.axes(self._chassis)[PLACE][:, 2]
        spin = body_motion.axes(int(self._hubs.rows[hub_index]))
        sideways = (hub_position[RATE] + spin[RATE] @ (spin[PLACE].T @ down))[1]
        elastic, grip = (
            self.loads[hub_index] + tyre.stiffness * (height - (hub_position[PLACE, 2] - tyre.point[2])),
            1.0,
        )
        load = elastic + tyre.damping * (rising - hub_position[RATE, 2])
        if tyre.pushes_only:
            load = max(min(load, 2.0 * elastic), 0.0)
            grip = load / self.loads[hub_index]
        side = grip * cornering * (roll_steer * q[ROLL] + q[HEADING] - sideways / speed)
        return np.array([-load * rising / speed, side, load]), side * np.array([-down[2], 0.0, down[0]])

    def _guide_accelerations(
        self,
        mass_matrix: np.ndarray,
        generalised_forces: np.ndarray,
        wanted_roll_and_pitch: np.ndarray | None,
        q: np.ndarray,
        v: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Accelerations (n,), and moments (2,) on roll and pitch in N m that pull the vehicle towards its prescribed
        angles or enforce them."""
        hub_inputs, moments = self.hub_inputs, np.zeros(2)
        if wanted_roll_and_pitch is None:
            return np.linalg.solve(mass_matrix, generalised_forces), moments
        wanted, rates, accelerations = wanted_roll_and_pitch.reshape(3, 2)
        off, late = wanted - q[ROLL_AND_PITCH], rates - v[ROLL_AND_PITCH]
        if hub_inputs.pull:
            moments = np.array(hub_inputs.pull[0::2]) * off + np.array(hub_inputs.pull[1::2]) * late
            generalised_forces[ROLL_AND_PITCH] += moments
            return np.linalg.solve(mass_matrix, generalised_forces), moments
        wanted = accelerations + 2.0 * hub_inputs.enforcing_rate * late + hub_inputs.enforcing_rate**2 * off
        picks = np.eye(len(generalised_forces))[ROLL_AND_PITCH]
        system = np.block([[mass_matrix, -picks.T], [picks, np.zeros((2, 2))]])
        both = np.linalg.solve(system, np.concatenate((generalised_forces, wanted)))
        return both[:-2], both[-2:]
