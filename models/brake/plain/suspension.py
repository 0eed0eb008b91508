"""Bodies, springs and tyre contacts of a braked vehicle on its suspension, in plain code.

Bodies and springs are those of the independent reference, ``models.multibody.plain``. Here its tyres stand on a flat
road: discs about axles that keep to the heading of the carrier, or of the towed body that they are on, turned by the
steering, with loads along the vertical at the wheels' centres and held forces at the contacts. See
``models.brake.sprung_step`` for what is held.
"""

from dataclasses import dataclass

import numpy as np

from models.brake.sprung import SprungVehicle
from models.multibody.plain.joint_elements import joint_numbers, joint_rows
from models.multibody.plain.motion import FIRST_DERIVATIVE, PLACE, RATE, Bodies, PlainMotion
from models.multibody.plain.parts import PlainParts
from models.multibody.plain.statics import preloads_at_rest
from models.vehicles.free_vehicle import CARRIER, chassis_of

UPWARD = np.array([0.0, 0.0, 1.0])


def product_with_upward(vector: np.ndarray) -> np.ndarray:
    """Vector product (3,) of the upward unit vector with a vector."""
    return np.array([-vector[1], vector[0], 0.0])


@dataclass(frozen=True, eq=False)
class TyreContact:
    """Contact of a tyre with the road: level axes along the wheel and along its axle, in space; height of the centre
    above the road (m), load (N), and speeds (m/s) of the centre along the wheel and of the contact across it.
    """

    along: np.ndarray
    axle: np.ndarray
    height: float
    load: float
    speed_along: float
    speed_across: float


@dataclass(frozen=True, eq=False)
class ConstantWheelForces:
    """Wheel quantities that are constant over a step: steer angles (rad), mean forces (W, 2) on the tyres along and
    across the wheels (N), and the mean moments (N m) that accelerate their rotation.
    """

    steer: np.ndarray
    forces: np.ndarray
    spin_moments: np.ndarray


class PlainSuspension:
    """A vehicle on its springs and tyres; turns, leans : indices of its coordinates, see ``SprungVehicle``."""

    def __init__(self, sprung_vehicle: SprungVehicle) -> None:
        free = sprung_vehicle.handling.vehicle
        self.bodies, self.tyres = Bodies(free), free.tyres
        self.parts = PlainParts(self.bodies, free, CARRIER)
        preloads, self.loads = preloads_at_rest(free, CARRIER)
        self.held, self._joint_held = np.split(preloads, [len(self.parts.names)])
        self._joints = joint_rows(self.bodies, free)
        self._joint_stiffness, self._joint_damping, _, self._joint_inertia = joint_numbers(free)
        self.turns, self.leans = sprung_vehicle.turns, sprung_vehicle.leans
        self._gravity = -free.gravity * UPWARD
        self._hubs = self.bodies.points([(tyre.body, tyre.point) for tyre in free.tyres])
        spatial_handling = sprung_vehicle.handling.given
        chassis = chassis_of(spatial_handling)
        towed = [free.towed_under(tyre.body) for tyre in free.tyres]
        self._carrier, self._towed = self.bodies.row[CARRIER], [self.bodies.row[name] if name else 0 for name in towed]
        self._carrying = [self.bodies.row[name or chassis.name] for name in towed]
        self._centre = self.bodies.points([(chassis.name, chassis.position)])
        self._drag = 0.5 * spatial_handling.drags[0].coefficient if spatial_handling.drags else 0.0

    @property
    def size(self) -> int:
        """Number of coordinates of the suspended vehicle."""
        return self.bodies.size

    def contacts(self, vehicle_motion: PlainMotion, steer_angles: np.ndarray) -> list[TyreContact]:
        """Contact of every tyre with the road, for wheels steered by angles (W,) in rad."""
        hubs = vehicle_motion.at(self._hubs)
        return [self._contact(i, hub, vehicle_motion, float(steer_angles[i])) for i, hub in enumerate(hubs)]

    def _heading(self, wheel_index: int, vehicle_motion: PlainMotion) -> np.ndarray:
        """Axes (3, 3) of a wheel's heading: the carrier's axes, or those of a towed body turned upright."""
        if not self._towed[wheel_index]:
            carrier: np.ndarray = vehicle_motion.axes(self._carrier)[PLACE]
            return carrier
        forward = vehicle_motion.axes(self._towed[wheel_index])[PLACE][:2, 0]
        cosine, sine = forward / np.hypot(*forward)
        return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])

    def _contact(
        self, wheel_index: int, hub_motion: np.ndarray, vehicle_motion: PlainMotion, steer_angle: float
    ) -> TyreContact:
        """Contact of one tyre with the road, for a steer angle (rad)."""
        heading = self._heading(wheel_index, vehicle_motion)
        axle = heading @ (-np.sin(steer_angle), np.cos(steer_angle), 0.0)
        rolling_direction = heading @ (np.cos(steer_angle), np.sin(steer_angle), 0.0)
        height = max(float(hub_motion[PLACE, 2]), 0.0)
        hub_turning, carrying = (
            vehicle_motion.angular_velocity(int(self._hubs.rows[wheel_index])),
            vehicle_motion.angular_velocity(self._carrying[wheel_index]),
        )
        turning = hub_turning + axle * (
            axle @ (carrying - hub_turning)
        )  # the rim does not turn beside what carries the wheel about its axle
        sliding = hub_motion[RATE] + height * product_with_upward(turning)
        return TyreContact(
            rolling_direction,
            axle,
            height,
            self._load(wheel_index, hub_motion),
            float(hub_motion[RATE] @ rolling_direction),
            float(sliding @ axle),
        )

    def _load(self, wheel_index: int, hub_motion: np.ndarray) -> float:
        """Load (N) of a tyre, whose spring and damper together never pull."""
        tyre = self.tyres[wheel_index]
        elastic = self.loads[wheel_index] - tyre.stiffness * (hub_motion[PLACE, 2] - tyre.point[2])
        return float(max(elastic - tyre.damping * hub_motion[RATE, 2], 0.0)) if elastic > 0.0 else 0.0

    def acceleration(self, q: np.ndarray, v: np.ndarray, wheel_forces: ConstantWheelForces) -> np.ndarray:
        """Accelerations (n,) of the vehicle at coordinates and rates (n,), under constant wheel forces."""
        motion = self.bodies.move(q, v)
        mass, force = self.bodies.inertia(motion, self._gravity)
        travels = self.parts.travels(motion, q, v)
        force -= sum(self.parts.forces(travels, self.held)) @ travels.gradient
        joint_forces = (
            self._joint_held + self._joint_stiffness * (self._joints @ q) + self._joint_damping * (self._joints @ v)
        )
        mass += self._joints.T * self._joint_inertia @ self._joints
        force += self._by_tyres(motion, wheel_forces) + self._drag_forces(motion) - joint_forces @ self._joints
        accelerations: np.ndarray = np.linalg.solve(mass, force)
        return accelerations

    def _drag_forces(self, vehicle_motion: PlainMotion) -> np.ndarray:
        """Generalised forces (n,) of aerodynamic drag at the chassis' centre, opposite to its speed along the vehicle's
        heading.
        """
        centre, forward = vehicle_motion.at(self._centre)[0], vehicle_motion.axes(self._carrier)[PLACE][:, 0]
        speed = float(centre[RATE] @ forward)
        forces: np.ndarray = centre[FIRST_DERIVATIVE:] @ (-self._drag * abs(speed) * speed * forward)
        return forces

    def _by_tyres(self, vehicle_motion: PlainMotion, wheel_forces: ConstantWheelForces) -> np.ndarray:
        """Generalised forces (n,) of all tyres; torques of brakes and locked wheels act on the bodies that carry the
        wheels.
        """
        hubs, total = vehicle_motion.at(self._hubs), np.zeros(self.size)
        for i, contact in enumerate(self.contacts(vehicle_motion, wheel_forces.steer)):
            creep = contact.along * wheel_forces.forces[i, 0] + contact.axle * wheel_forces.forces[i, 1]
            moment = -contact.height * product_with_upward(creep)
            rolling = contact.axle * (contact.axle @ moment)
            total += hubs[i, FIRST_DERIVATIVE:] @ (creep + contact.load * UPWARD)
            total += vehicle_motion.moment_forces(int(self._hubs.rows[i]), moment - rolling)
            total += vehicle_motion.moment_forces(
                self._carrying[i], rolling - contact.axle * wheel_forces.spin_moments[i]
            )
        return total

    def liveliness(self) -> float:
        """Largest damping rate (m/s^2) of a motion in the design position by side forces of cornering coefficient 1 at
        a speed of 1 m/s.
        """
        still, straight = np.zeros(self.size), np.zeros(len(self.tyres))
        motions = [self.bodies.move(still, rate) for rate in np.eye(self.size)]
        across = np.array([[sliding.speed_across for sliding in self.contacts(motion, straight)] for motion in motions])
        mass, _ = self.bodies.inertia(motions[0], self._gravity)
        damping = np.linalg.solve(mass, across @ (self.loads[:, None] * across.T))
        return float(np.linalg.eigvals(damping).real.max())
