"""A car on brush tyres in plain numpy, the independent reference to ``models.multibody.forces``; all vectors in the
axes of space.

Vectors of tyres are rows (w, 3). Everything comes from the vehicle, its tyres, controls, road and pushes; no table of
numbers is read. The laws are those of the compiled forces, written down anew; the motion is that of ``motion``.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from models.multibody.plain.bristles import TyrePatches, cornering_factor, tyre_forces
from models.multibody.plain.joint_elements import joint_numbers, joint_rows
from models.multibody.plain.motion import FIRST_DERIVATIVE, PLACE, RATE, Bodies, PlainMotion
from models.multibody.plain.parts import PlainParts
from models.multibody.plain.road import control_value, road_surface
from models.multibody.plain.statics import preloads_at_rest
from models.vehicles.free_vehicle import CARRIER, chassis_of, rotor_name
from models.vehicles.spatial import Tyre

if TYPE_CHECKING:
    from models.multibody.numbers import Handling

UP = np.array([0.0, 0.0, 1.0])
NEXT, LAST = [1, 2, 0], [2, 0, 1]


class TyreReport(NamedTuple):
    """Report of all w tyres, each (w,): load (N), creep forces (N) and moment (N m) in the tyre's axes, slip along and
    across (m/s), speed of the tread (m/s), rate of turning (1/s), power (W), moment about the steering axis (N m),
    steer angle (rad), torque on the wheel by brake and drive (N m)."""

    press: np.ndarray
    fx: np.ndarray
    fy: np.ndarray
    mz: np.ndarray
    slip_x: np.ndarray
    slip_y: np.ndarray
    tread: np.ndarray
    turn: np.ndarray
    power: np.ndarray
    steer_moment: np.ndarray
    angle: np.ndarray
    spin_torque: np.ndarray


class EnergyLedger(NamedTuple):
    """Energy ledger of a car on tyres: energy of springs and tyres (J); powers (W) of dampers, friction, drag and
    pushes; of brakes and drive; of the steering on the wheels."""

    potential: float
    dissipated: float
    torque_power: float
    steer_power: float


class RollingState(NamedTuple):
    """Accelerations (n,) of a car on tyres at one state, with the report of the tyres and the energy ledger."""

    acceleration: np.ndarray
    tyres: TyreReport
    ledger: EnergyLedger


class TyreContact(NamedTuple):
    """Contact points, axes and loads of w tyres on the road.

    down (w, 3) : arms from the wheels' centres to the contacts (m); along, across, normal (w, 3) : axes on the road;
    axle (w, 3); loading (w, 3) : forces of the loads; load (w,) along the normal, N; elastic (w,) : its spring's part
    upwards; damping_power (w,), W.
    """

    down: np.ndarray
    along: np.ndarray
    across: np.ndarray
    normal: np.ndarray
    axle: np.ndarray
    loading: np.ndarray
    load: np.ndarray
    elastic: np.ndarray
    damping_power: np.ndarray


class PlainRolling:
    """Equations of motion of a car on brush tyres, with steering, brake and drive over time."""

    def __init__(self, vehicle_on_tyres: "Handling") -> None:
        self.handling, vehicle = vehicle_on_tyres, vehicle_on_tyres.vehicle
        self.bodies = Bodies(vehicle)
        self.parts = PlainParts(self.bodies, vehicle, CARRIER)
        held, self.loads = preloads_at_rest(vehicle, CARRIER)
        self.held, self._joint_held = np.split(held, [len(self.parts.names)])
        self._joints = joint_rows(self.bodies, vehicle)
        self._joint_stiffness, self._joint_damping, _, self._joint_inertia = joint_numbers(vehicle)
        chassis = chassis_of(vehicle_on_tyres.given)
        self._carrier = self.bodies.row[CARRIER]
        self._middle = self.bodies.points([(chassis.name, chassis.position)])
        self._drag = vehicle_on_tyres.given.drags[0].coefficient / 2.0 if vehicle_on_tyres.given.drags else 0.0
        self._pushed = self.bodies.points([(push.body, push.point) for push in vehicle_on_tyres.pushes])
        tyres = vehicle.tyres
        towed = [vehicle.towed_under(tyre.body) for tyre in tyres]
        self._towed = np.array([name is not None for name in towed])
        self._carrying = [self.bodies.row[name or chassis.name] for name in towed]
        self._headings = [self.bodies.row[name or CARRIER] for name in towed]
        self._points = self.bodies.points([(tyre.body, tyre.point) for tyre in tyres])
        self._rotors = np.array([self.bodies.index(rotor_name(tyre.name), "ry") for tyre in tyres])
        self._height, self._stiffness, self._damping = (
            np.array(column) for column in zip(*((t.point[2], t.stiffness, t.damping) for t in tyres), strict=True)
        )
        sunk = self.loads / self._stiffness
        self._radius = self._height + sunk
        sides = {force.name: force.stiffness for force in vehicle_on_tyres.given.side_forces}
        cornering = np.array([sides[tyre.name] for tyre in tyres])
        of = vehicle_on_tyres.tyres
        self._bristles = cornering / (cornering_factor(of.cells) * self._radius * sunk * of.half_width)
        self._leans = np.where(self._towed, 0.0, of.inclination * np.sign([tyre.point[1] for tyre in tyres]))
        self._shares_of_tyres(tyres)

    def _shares_of_tyres(self, tyres: tuple[Tyre, ...]) -> None:
        """Each tyre's share in steering, brake and drive. Wheels of an axle share evenly, and so do rear axles;
        trailers are not driven."""
        axles, controls = np.array([tyre.axle for tyre in tyres]), self.handling.controls
        beside, behind, front = np.array([np.sum(axles == axle) for axle in axles]), max(axles.max(), 1), axles == 0
        self._steered = front.astype(float)
        self._braked = np.where(front, controls.front_brake, (1.0 - controls.front_brake) / behind) / beside
        behind = max(axles[~self._towed].max(), 1)
        drive_share = np.where(front, controls.front_drive, (1.0 - controls.front_drive) / behind) / beside
        self._driven = np.where(self._towed, 0.0, drive_share)

    def at(self, t: float, q: np.ndarray, v: np.ndarray) -> RollingState:
        """Accelerations, tyre report and energy ledger at a time (s), coordinates and rates (n,)."""
        motion = self.bodies.move(q, v)
        mass, force = self.bodies.inertia(motion, self.handling.gravity)
        travels = self.parts.travels(motion, q, v)
        spring, other = self.parts.forces(travels, self.held)
        by_tyres, report, ledger = self._wheel_forces(t, motion, v)
        outside, power = self._drag_and_pushes(t, motion)
        travel, rate = self._joints @ q, self._joints @ v
        along, damped = self._joint_held + self._joint_stiffness * travel, self._joint_damping * rate
        mass += self._joints.T * self._joint_inertia @ self._joints
        force += by_tyres + outside - (spring + other) @ travels.gradient - (along + damped) @ self._joints
        energy = 0.5 * ((self.held + spring) @ travels.travel + (self._joint_held + along) @ travel)
        whole = ledger._replace(
            potential=float(ledger.potential + energy),
            dissipated=float(ledger.dissipated + power - other @ travels.rate - damped @ rate),
        )
        return RollingState(np.linalg.solve(mass, force), report, whole)

    def acceleration(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (n,) at a time (s), coordinates and rates (n,)."""
        return self.at(t, q, v).acceleration

    def report(self, times: np.ndarray, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Reports (m, w, 12) of the tyres and energy ledgers (m, 4), fields in their order, of states (m, n) at times
        (m,)."""
        states = [self.at(float(t), *state) for t, *state in zip(times, q, v, strict=True)]
        tyres = np.array([np.column_stack(state.tyres) for state in states])
        return tyres, np.array([state.ledger for state in states])

    def _wheel_forces(
        self, t: float, body_motion: PlainMotion, v: np.ndarray
    ) -> tuple[np.ndarray, TyreReport, EnergyLedger]:
        """Generalised forces (n,) of tyres, brakes and drive; the tyres' report; and the energy ledger of these
        forces."""
        steer, steering = control_value(self.handling.controls.steer, t)
        points, angle = body_motion.at(self._points), self._steered * steer
        contact = self._loads_and_points(body_motion, points, angle)
        slides, beside = self._sliding_velocities(body_motion, points, contact, self._steered * steering, v)
        creep = self._creep_forces(contact, slides)
        force, moments = self._tyre_forces(body_motion, points, contact, creep)
        torques = self._torques(t, beside)
        force += self._turn_wheels(body_motion, contact.axle, torques)
        power = (creep * slides[:, :3]).sum(1)
        slip = dict(zip(("slip_x", "slip_y", "turn", "tread"), slides.T, strict=True))
        by_creep = dict(zip(("fx", "fy", "mz"), creep.T, strict=True))
        report = TyreReport(
            press=contact.load,
            power=power,
            steer_moment=moments[:, 2],
            angle=angle,
            spin_torque=torques,
            **slip,
            **by_creep,
        )
        ledger = EnergyLedger(
            float((0.5 * contact.elastic**2 / self._stiffness).sum()),
            float(contact.damping_power.sum()),
            float(torques @ beside),
            -float(self._steered @ moments[:, 2]) * steering,
        )
        return force, report, ledger

    def _loads_and_points(
        self, body_motion: PlainMotion, wheel_centres: np.ndarray, steer_angles: np.ndarray
    ) -> TyreContact:
        """Loads, contact points and axes of all tyres on the road; steer (w,), rad."""
        place, speed = wheel_centres[:, PLACE], wheel_centres[:, RATE]
        height, slope_x, slope_y = road_surface(self.handling.waves, place[:, 0], place[:, 1])
        upwards = np.column_stack([-slope_x, -slope_y, np.ones(len(height))])
        elastic = np.maximum(self.loads + self._stiffness * (height - (place[:, 2] - self._height)), 0.0)
        rising = (speed * upwards).sum(1)
        load = np.where(elastic > 0.0, np.maximum(elastic - self._damping * rising, 0.0), 0.0)
        axle, long = self._axles(body_motion, steer_angles), _vector_lengths(upwards)
        normal = upwards / long[:, None]
        along = _vector_products(axle, normal)
        flat = _vector_lengths(along)
        along /= flat[:, None]
        radius = np.maximum(place[:, 2] - height, 0.0) / (long * flat)
        down = (axle * (axle * normal).sum(1)[:, None] - normal) * (radius / flat)[:, None]
        pressing = upwards * load[:, None]
        across = _vector_products(normal, along)
        return TyreContact(down, along, across, normal, axle, pressing, load * long, elastic, (load - elastic) * rising)

    def _sliding_velocities(
        self,
        body_motion: PlainMotion,
        wheel_centres: np.ndarray,
        tyre_contact: TyreContact,
        steer_rates: np.ndarray,
        v: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Sliding velocities (w, 4), as ``bristles`` takes them, and spin rates (w,) of the wheels relative to the
        bodies that carry them, rad/s.

        steer_rates (w,) : rates of steering, rad/s.
        """
        axle, angular_velocity = (
            tyre_contact.axle,
            np.array([body_motion.angular_velocity(row) for row in self._points.rows]),
        )
        locked = (
            (np.array([body_motion.angular_velocity(row) for row in self._carrying]) - angular_velocity) * axle
        ).sum(1)
        spin = np.where(self._rotors >= 0, v[self._rotors], locked)
        whole = angular_velocity + axle * spin[:, None] + np.multiply.outer(steer_rates, UP)
        sliding = wheel_centres[:, RATE] + _vector_products(whole, tyre_contact.down)
        tread = -spin * (_vector_products(axle, tyre_contact.down) * tyre_contact.along).sum(1)
        on_road = (sliding * tyre_contact.along).sum(1), (sliding * tyre_contact.across).sum(1)
        return np.column_stack([*on_road, (whole * tyre_contact.normal).sum(1), tread]), spin - locked

    def _axles(self, body_motion: PlainMotion, steer_angles: np.ndarray) -> np.ndarray:
        """Unit vectors (w, 3) along the axles, to the left: steered and inclined relative to the heading of the
        carrier, or of a towed body's x axis in the road's plane."""
        ahead = np.array([body_motion.axes(row)[PLACE, :, 0] for row in self._headings]) * (1.0, 1.0, 0.0)
        ahead /= _vector_lengths(ahead)[:, None]
        left, level = _vector_products(np.tile(UP, (len(ahead), 1)), ahead), np.cos(self._leans)[:, None]
        sideways = np.cos(steer_angles)[:, None] * left - np.sin(steer_angles)[:, None] * ahead
        axles: np.ndarray = level * sideways + np.multiply.outer(np.sin(self._leans), UP)
        return axles

    def _creep_forces(self, tyre_contact: TyreContact, sliding_velocities: np.ndarray) -> np.ndarray:
        """Creep forces along and across (N) and moments (N m), (w, 3), of all tyres from sliding velocities
        ``sliding_velocities`` (w, 4)."""
        of, ones = self.handling.tyres, np.ones(len(sliding_velocities))
        half = np.sqrt(self._radius * tyre_contact.load / self._stiffness)
        patch = TyrePatches(half, of.half_width * ones, tyre_contact.load, of.friction * ones, self._bristles)
        return tyre_forces(patch, sliding_velocities, of.cells)

    def _tyre_forces(
        self, body_motion: PlainMotion, wheel_centres: np.ndarray, tyre_contact: TyreContact, creep_forces: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Generalised forces (n,) of tyre loads and creep forces, and the moments (w, 3) of the creep forces about the
        wheels' centres."""
        force = tyre_contact.along * creep_forces[:, [0]] + tyre_contact.across * creep_forces[:, [1]]
        moments = _vector_products(tyre_contact.down, force) + tyre_contact.normal * creep_forces[:, [2]]
        total = np.tensordot(wheel_centres[:, FIRST_DERIVATIVE:], force + tyre_contact.loading, ((0, 2), (0, 1)))
        for row, moment in zip(self._points.rows, moments, strict=True):
            total += body_motion.moment_forces(int(row), moment)
        about = (moments * tyre_contact.axle).sum(1)
        fixed = self._rotors < 0
        np.add.at(total, self._rotors[~fixed], about[~fixed])
        for i in np.flatnonzero(fixed).tolist():
            total += self._transferred_moment(body_motion, i, about[i] * tyre_contact.axle[i])
        return total, moments

    def _transferred_moment(self, body_motion: PlainMotion, wheel_index: int, moment: np.ndarray) -> np.ndarray:
        """Generalised forces (n,) when the body that carries wheel i takes over a moment (N m) from the wheel's own
        body."""
        return body_motion.moment_forces(self._carrying[wheel_index], moment) - body_motion.moment_forces(
            int(self._points.rows[wheel_index]), moment
        )

    def _torques(self, t: float, spin_rates: np.ndarray) -> np.ndarray:
        """Torques (w,) of brake and drive on wheels (N m).

        spin_rates (w,) : beside what carries each wheel, rad/s.
        """
        controls, of = self.handling.controls, self.handling.tyres
        braking, driving = control_value(controls.brake, t)[0], control_value(controls.drive, t)[0]
        torque = self._driven * driving - self._braked * braking * np.tanh(spin_rates / of.brake_rate)
        return np.where(self._rotors >= 0, torque, 0.0)

    def _turn_wheels(self, body_motion: PlainMotion, axles: np.ndarray, wheel_torques: np.ndarray) -> np.ndarray:
        """Generalised forces (n,) of torques on the wheels, and of the opposite torques on the bodies that carry
        them."""
        total = np.zeros(self.bodies.size)
        for i in np.flatnonzero(wheel_torques).tolist():
            total[self._rotors[i]] += wheel_torques[i]
            total -= self._transferred_moment(body_motion, i, wheel_torques[i] * axles[i])
        return total

    def _drag_and_pushes(self, t: float, body_motion: PlainMotion) -> tuple[np.ndarray, float]:
        """Generalised forces (n,) of aerodynamic drag and external pushes, and their power (W)."""
        heading = body_motion.axes(self._carrier)[PLACE]
        total, power = np.zeros(self.bodies.size), 0.0
        if self._drag:
            (middle,) = body_motion.at(self._middle)
            ahead = float(middle[RATE] @ heading[:, 0])
            force = -self._drag * abs(ahead) * ahead
            total += middle[FIRST_DERIVATIVE:] @ (force * heading[:, 0])
            power += force * ahead
        for push, point in zip(self.handling.pushes, body_motion.at(self._pushed), strict=True):
            pushed = heading @ (control_value(push.size, t)[0] * np.array(push.axis))
            total += point[FIRST_DERIVATIVE:] @ pushed
            power += float(point[RATE] @ pushed)
        return total, power


def _vector_lengths(vectors: np.ndarray) -> np.ndarray:
    """Lengths (w,) of rows (w, 3)."""
    return np.sqrt((vectors * vectors).sum(1))


def _vector_products(first_vectors: np.ndarray, second_vectors: np.ndarray) -> np.ndarray:
    """Vector products of rows (w, 3)."""
    product: np.ndarray = (
        first_vectors[:, NEXT] * second_vectors[:, LAST] - first_vectors[:, LAST] * second_vectors[:, NEXT]
    )
    return product
