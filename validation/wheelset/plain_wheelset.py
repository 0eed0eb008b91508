"""A wheelset of cones on round rails in plain vectors: contact, Hertz, creep forces, equations of motion.

The laws of ``models.rail.wheel_forces`` and ``models.rail.equations`` anew, from their statement, without their code.
From the cone's vector equation follows where it touches; from Hertz' integrals, the normal force; from Kalker's table,
or FASTSIM as a user calls it, the creep forces of a contact. The axes are the track's: x along, y to the right, z down.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

from models.contact.fastsim import RollingEllipse, fastsim
from models.contact.linear_theory import linear_creep_forces as linear_forces
from models.rail.wheelset import Wheelset

SLOWEST_SPEED = 0.1
"""Speed (m/s): below it, creepages are sliding speeds divided by it, and both directions of rolling are mixed."""
LEAST_ECCENTRICITY = 1e-12
"""Distance from 0 and from 1 at which the search for the squared eccentricity of a contact ellipse begins and ends."""


class WheelRailContact(NamedTuple):
    """Contact of a wheel with its rail: penetration (m), normal into the rail, position relative to the wheelset's
    centre (m), and curvature along the track (1/m)."""

    depth: float
    normal: np.ndarray
    position: np.ndarray
    curvature_along: float


class PlainAxle(NamedTuple):
    """Motion of a wheelset: position of its centre from the middle of the track (m), velocity including travel (m/s),
    unit vectors along the axle and horizontally forward, and angular velocity including spin (rad/s)."""

    centre: np.ndarray
    velocity: np.ndarray
    axle: np.ndarray
    forward: np.ndarray
    angular_velocity: np.ndarray


class PatchForces(NamedTuple):
    """Force (N) of a contact on the wheelset, its moment about the wheelset's centre (N m), and further quantities of
    the contact by name."""

    force: np.ndarray
    moment: np.ndarray
    contact_quantities: dict[str, float]


def axle_of(wheelset_state: np.ndarray, speed: float) -> PlainAxle:
    """Motion of a wheelset that travels at ``speed`` (m/s), for a state (10,) of ``models.rail.equations``."""
    y, z, roll, yaw, _, y_rate, z_rate, roll_rate, yaw_rate, spin = wheelset_state
    forward = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    axle = np.cos(roll) * np.array([-np.sin(yaw), np.cos(yaw), 0.0]) + np.array([0.0, 0.0, np.sin(roll)])
    frame = roll_rate * forward + np.array([0.0, 0.0, yaw_rate])
    turning = frame + (spin - frame @ axle) * axle
    return PlainAxle(np.array([0.0, y, z]), np.array([speed, y_rate, z_rate]), axle, forward, turning)


def contact_of_wheel(wheelset: Wheelset, wheel_side: float, axle_motion: PlainAxle) -> WheelRailContact:
    """Contact of a conical wheel with its rail; wheel_side : 1 right, -1 left.

    The tangent plane's normal n, square to x, is inclined to the axle by the cone's half angle: n . axle = side sin.
    The generator of that plane runs from the apex; the place is where it crosses the head's axis as seen along n.
    """
    w, (sine, cosine) = wheelset, wheelset.cone_sine_and_cosine
    outward = wheel_side * axle_motion.axle
    size, phase = np.hypot(outward[1], outward[2]), np.arctan2(outward[1], outward[2])
    angle = phase - np.arccos(sine / size) if outward[1] > 0.0 else phase + np.arccos(sine / size)
    normal = np.array([0.0, np.sin(angle), np.cos(angle)])
    apex = axle_motion.centre + (w.half_gauge + w.radius / w.conicity) * outward
    middle = np.array([0.0, wheel_side * (w.half_gauge + w.head_radius * sine), w.radius + w.head_radius * cosine])
    radial = (normal - sine * outward) / cosine
    inward = -cosine * outward + sine * radial
    across_normal = np.cross(np.array([1.0, 0.0, 0.0]), normal)
    distance_to_rail = ((middle - apex) @ across_normal) / (inward @ across_normal)
    depth = w.head_radius - float(normal @ (middle - apex))
    return WheelRailContact(
        depth,
        normal,
        apex + distance_to_rail * inward - axle_motion.centre,
        float(cosine / (2.0 * distance_to_rail * sine)),
    )


def hertz_force(
    penetration: float, curvature_along: float, curvature_across: float, contact_modulus: float
) -> tuple[float, float, float]:
    """Force (N) and semi-axes along and across (m) at a penetration (m) by Hertz' theory, K. L. Johnson, Contact
    mechanics (1985), eqs (4.26) to (4.33); curvatures of z = along x^2 + across y^2 (1/m), modulus E* (Pa)."""
    if penetration <= 0.0:
        return 0.0, 0.0, 0.0
    flat, steep = sorted((curvature_along, curvature_across))

    def shape(m: float) -> float:
        return float((ellipe(m) / (1.0 - m) - ellipk(m)) * flat - (ellipk(m) - ellipe(m)) * steep)

    m = brentq(shape, LEAST_ECCENTRICITY, 1.0 - LEAST_ECCENTRICITY, xtol=1e-16) if steep > flat else 0.0
    elliptic_ratio = (ellipk(m) - ellipe(m)) / m if m > 1e-6 else np.pi / 4.0
    long = np.sqrt(penetration * elliptic_ratio / (ellipk(m) * flat))
    short = long * np.sqrt(1.0 - m)
    force = 2.0 * np.pi / 3.0 * long * penetration * contact_modulus / ellipk(m)
    return float(force), *((long, short) if curvature_along <= curvature_across else (short, long))


def creep_forces(
    wheelset: Wheelset,
    load_and_semi_axes: tuple[float, float, float],
    creepages_and_spin: np.ndarray,
    creep_law: str,
    cell_count: int,
) -> np.ndarray:
    """Creep forces (N) and moment (N m) (3,) of a contact with load (N) and semi-axes a, b (m), at creepages and spin
    (3,), by a creep law."""
    load, a, b = load_and_semi_axes
    if a == 0.0:
        return np.zeros(3)
    if creep_law == "linear":
        return np.array(
            [
                float(force)
                for force in linear_forces(
                    a, b, creepages_and_spin[0], creepages_and_spin[1], creepages_and_spin[2], wheelset.material_pair
                )
            ]
        )
    creep = fastsim(
        RollingEllipse(
            a, b, load, wheelset.friction, creepages_and_spin[0], creepages_and_spin[1], creepages_and_spin[2]
        ),
        wheelset.material_pair,
        cells=cell_count,
    )
    return np.array([float(creep.fx), float(creep.fy), float(creep.mz)])


def patch_forces(
    wheelset: Wheelset, wheel_side: float, axle_motion: PlainAxle, creep_law: str, cell_count: int
) -> PatchForces:
    """Force and moment of a rail on the wheelset, by a creep law; wheel_side : 1 right, -1 left."""
    w, speed, touch = wheelset, axle_motion.velocity[0], contact_of_wheel(wheelset, wheel_side, axle_motion)
    across = np.cross(touch.normal, np.array([1.0, 0.0, 0.0]))
    velocity = axle_motion.velocity + np.cross(axle_motion.angular_velocity, touch.position)
    slip, approach = (
        np.array([velocity[0], velocity @ across, axle_motion.angular_velocity @ touch.normal]),
        velocity @ touch.normal,
    )
    elastic, a, b = hertz_force(touch.depth, touch.curvature_along, 0.5 / w.head_radius, w.material_pair.modulus)
    load = elastic * max(0.0, 1.0 + w.contact_damping * approach)
    forwards, reference_speed = (
        float(np.clip(0.5 + 0.5 * speed / SLOWEST_SPEED, 0.0, 1.0)),
        max(abs(speed), SLOWEST_SPEED),
    )
    mirror, creep = np.array([-1.0, 1.0, -1.0]), np.zeros(3)
    if forwards > 0.0:
        creep += forwards * creep_forces(w, (load, a, b), slip / reference_speed, creep_law, cell_count)
    if forwards < 1.0:
        creep += (
            (1.0 - forwards)
            * mirror
            * creep_forces(w, (load, a, b), mirror * slip / reference_speed, creep_law, cell_count)
        )
    beyond = max(0.0, wheel_side * axle_motion.centre[1] - w.flange_clearance)
    push = np.array([0.0, -wheel_side * w.flange_stiffness * beyond, 0.0])
    force = np.array([creep[0], 0.0, 0.0]) + creep[1] * across - load * touch.normal + push
    report = {"load": load, "fx": creep[0], "fy": creep[1], "mz": creep[2], "a": a, "b": b, "depth": touch.depth}
    report |= {
        "xi_x": slip[0] / reference_speed,
        "xi_y": slip[1] / reference_speed,
        "spin": slip[2] / reference_speed,
        "power": float(creep @ slip),
    }
    report |= {"x": touch.position[0], "y": touch.position[1], "z": touch.position[2], "flange_force": push[1]}
    report |= {"angle": float(np.arcsin(-touch.normal[1])), "damping_power": (elastic - load) * approach}
    report["elastic_power"] = float(push @ velocity) - elastic * approach
    return PatchForces(force, np.cross(touch.position, force) + creep[2] * touch.normal, report)


class PlainWheelset:
    """Equations of motion of a wheelset at a speed (m/s) with a creep law; gravity is inclined to the right by
    ``gravity_inclination`` (rad)."""

    def __init__(
        self, wheelset: Wheelset, speed: float, creep_law: str, cell_count: int = 21, gravity_inclination: float = 0.0
    ) -> None:
        self.wheelset, self.speed, self.law, self.cells, self.lean = (
            wheelset,
            speed,
            creep_law,
            cell_count,
            gravity_inclination,
        )
        half = wheelset.load / (2.0 * wheelset.cone_sine_and_cosine[1])
        curvatures = wheelset.cone_sine_and_cosine[1] / (2.0 * wheelset.radius), 0.5 / wheelset.head_radius

        def short(penetration: float) -> float:
            return hertz_force(penetration, *curvatures, wheelset.material_pair.modulus)[0] - half

        self.approach_at_rest = brentq(short, 1e-9, 1e-2, xtol=1e-17) / wheelset.cone_sine_and_cosine[1]

    def patches(self, wheelset_state: np.ndarray) -> list[PatchForces]:
        """Contact forces of both rails on the wheelset for a state (10,), right rail first."""
        axle = axle_of(wheelset_state, self.speed)
        return [patch_forces(self.wheelset, side, axle, self.law, self.cells) for side in (1.0, -1.0)]

    def rail_force_and_moment(self, wheelset_state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Force (N) and moment about the centre (N m) of both rails on the wheelset, in the track's axes."""
        right, left = self.patches(wheelset_state)
        return right.force + left.force, right.moment + left.moment

    def suspension_force_and_moment(self, wheelset_state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Force (N) and moment about the centre (N m) of the suspension at both ends of the axle on the wheelset, in
        the track's axes."""
        w, axle = self.wheelset, axle_of(wheelset_state, self.speed)
        stiffness = np.array([w.stiffness_x, w.stiffness_y, w.stiffness_z])
        damping = np.array([w.damping_x, w.damping_y, w.damping_z])
        moving = np.array([0.0, *axle.velocity[1:]])
        force, moment = np.zeros(3), np.zeros(3)
        for side in (1.0, -1.0):
            arm = side * w.half_spacing * axle.axle
            extension = axle.centre + arm - np.array([0.0, side * w.half_spacing, self.approach_at_rest])
            pull = -stiffness * extension - damping * (moving + np.cross(axle.angular_velocity, arm))
            force, moment = force + pull, moment + np.cross(arm, pull)
        return force, moment

    def rates(self, wheelset_state: np.ndarray) -> np.ndarray:
        """Time derivatives (10,) of a state (10,), by Newton's and Euler's equations in axes that rotate with the
        wheelset without its spin."""
        w, axle = self.wheelset, axle_of(wheelset_state, self.speed)
        roll, (roll_rate, yaw_rate, spin) = wheelset_state[2], wheelset_state[7:]
        sums = [
            rail_force_and_moment + suspension_part
            for rail_force_and_moment, suspension_part in zip(
                self.rail_force_and_moment(wheelset_state),
                self.suspension_force_and_moment(wheelset_state),
                strict=True,
            )
        ]
        weight = w.load * np.array([0.0, self.lean, 1.0])
        acceleration = (sums[0] + weight) / w.mass
        upright = np.cross(axle.forward, axle.axle)
        moments = np.array([axis @ sums[1] for axis in (axle.forward, axle.axle, upright)])
        inertia, turning = (
            np.array([w.yaw_inertia, w.spin_inertia, w.yaw_inertia]),
            np.array([roll_rate, spin, yaw_rate * np.cos(roll)]),
        )
        axes = np.array([roll_rate, yaw_rate * np.sin(roll), yaw_rate * np.cos(roll)])
        gained = (moments - np.cross(axes, inertia * turning)) / inertia
        yawing = (gained[2] + yaw_rate * roll_rate * np.sin(roll)) / np.cos(roll)
        position_rates = [wheelset_state[5], wheelset_state[6], roll_rate, yaw_rate, spin - yaw_rate * np.sin(roll)]
        return np.array([*position_rates, acceleration[1], acceleration[2], gained[0], yawing, gained[1]])

    def rail_forces_on_coordinates(self, wheelset_state: np.ndarray) -> np.ndarray:
        """Generalised forces (5,) of both rails on y, z, yaw, roll and spin about the axle (N, N m), by virtual
        work."""
        axle, (force, moment) = axle_of(wheelset_state, self.speed), self.rail_force_and_moment(wheelset_state)
        return np.array([force[1], force[2], moment[2], moment @ axle.forward, moment @ axle.axle])

    def run(self, wheelset_state: np.ndarray, time_step: float, step_count: int) -> np.ndarray:
        """States (step_count + 1, 10) from a start state (10,), by steps (s) of the classical Runge-Kutta method."""
        states = [np.asarray(wheelset_state, float)]
        for _ in range(step_count):
            last_state = states[-1]
            k1 = self.rates(last_state)
            k2 = self.rates(last_state + 0.5 * time_step * k1)
            k3 = self.rates(last_state + 0.5 * time_step * k2)
            states.append(
                last_state + time_step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + self.rates(last_state + time_step * k3))
            )
        return np.array(states)
