"""A vehicle in space without its tyres, free to move and rotate without limit, to be loaded by forces at its wheel
hubs.

All bodies ride on the chassis, in its own axes. The axes of springs, mounts and bars are fixed in it, too, unless their
frame is another body: what is inside the vehicle feels relative coordinates alone. The chassis itself has position,
heading (about the vertical), pitch and roll, in this order, so that roll and pitch say where gravity points whatever
the heading is. Two carriers without mass hold these joints. Wheels ride along sideways. The tyres are cut off; what
they did comes from outside, at the hubs.
"""

from dataclasses import dataclass, replace

import numpy as np

from models.core.errors import InputError
from models.vehicles.free_vehicle import with_chassis_as_parent
from models.vehicles.sliding_springs import sliding_springs
from models.vehicles.spatial import AntiRollBar, Body, Curve, SpatialVehicle, SpringDamper, Vector, point_mass_inertia
from models.vehicles.spatial_linear import Preloads, static_preloads

GRAVITY = 9.81
X, Y, Z, HEADING, PITCH, ROLL = range(6)
"""Indices of the chassis' coordinates: m and rad; nose down is a positive pitch (about y, to the left)."""
ANGLES = {"roll": ROLL, "pitch": PITCH, "heading": HEADING}


@dataclass(frozen=True)
class CutVehicleElement:
    """Spring, mount or bar of a cut vehicle: a force along an axis, positive in compression, or a moment.

    F = preload + stiffness d + damping d' + travel_force(d) + rate_force(d') + friction tanh(d' / friction_rate) with
    d = axis . (second_point - first_point) less its design value, in the axes of the body ``frame``, the chassis
    mostly; of an anti-roll bar the axis is divided by the track, so that d is an angle and F a moment. points in the
    design position, m; N or N m."""

    name: str
    first_body: str
    second_body: str
    first_point: np.ndarray
    second_point: np.ndarray
    axis: np.ndarray
    stiffness: float
    damping: float
    preload: float
    frame: str
    travel_force: Curve | None = None
    rate_force: Curve | None = None
    friction: float = 0.0
    friction_rate: float = 1.0

    def travel_gauge(self) -> "CutVehicleElement":
        """A copy of the element whose force equals its travel d, so that a simulation records the travel."""
        straight = replace(self, travel_force=None, rate_force=None, friction=0.0)
        return replace(straight, stiffness=1.0, damping=0.0, preload=0.0)

    @property
    def design(self) -> float:
        """Value of axis . (second_point - first_point) in the design position."""
        return float(self.axis @ (self.second_point - self.first_point))

    @property
    def unit(self) -> str:
        """Unit of the element's force: N or N m."""
        return "N" if np.isclose(np.linalg.norm(self.axis), 1.0) else "N m"


@dataclass(frozen=True)
class CutVehicle:
    """A vehicle without its tyres, cut at its wheel hubs.

    tree : bodies and joints, carriers first, then the chassis; without springs and tyres
    uncut : the vehicle that was cut, all its bodies on the chassis, loaded; tyres are listed there
    elements : springs, mounts, seats and bars, in that order
    loads : (hubs,) static load of every tyre, N
    """

    chassis: str
    tree: SpatialVehicle
    uncut: SpatialVehicle
    elements: tuple[CutVehicleElement, ...]
    loads: np.ndarray

    @property
    def hubs(self) -> tuple[str, ...]:
        """Names of the tyres that were removed, one per hub."""
        return tuple(tyre.name for tyre in self.uncut.tyres)

    @property
    def size(self) -> int:
        """Number of degrees of freedom of the cut vehicle."""
        return len(self.tree.coordinates())


def cut_at_hubs(vehicle: SpatialVehicle, chassis_name: str) -> CutVehicle:
    """The cut vehicle: the tyres of a vehicle whose body ``chassis_name`` has all six freedoms are removed. Raises
    InputError if the vehicle cannot be cut."""
    _check_can_be_cut(vehicle, chassis_name)
    sprung = sliding_springs(with_chassis_as_parent(vehicle, chassis_name))
    whole = replace(sprung, gravity=GRAVITY, drags=()).in_frame(chassis_name)
    held = static_preloads(whole)
    loads = np.array([held.tyres[tyre.name] for tyre in whole.tyres])
    return CutVehicle(chassis_name, _cut_vehicle_tree(whole, chassis_name), whole, elements_of(whole, held), loads)


def elements_of(vehicle: SpatialVehicle, preloads: Preloads) -> tuple[CutVehicleElement, ...]:
    """Elements for the springs, then the bars, of a vehicle whose springs and bars all name their frames; preloads :
    their static forces."""

    def element(
        spring_or_bar: SpringDamper | AntiRollBar, first_body: str, second_body: str, *attachment_points: Vector
    ) -> CutVehicleElement:
        first, second, axis = map(np.array, attachment_points)
        force = preloads.parts[spring_or_bar.name]
        return CutVehicleElement(
            spring_or_bar.name,
            first_body,
            second_body,
            first,
            second,
            axis,
            spring_or_bar.stiffness,
            spring_or_bar.damping,
            force,
            str(spring_or_bar.frame),
        )

    def bent(spring: SpringDamper) -> CutVehicleElement:
        straight = element(
            spring, spring.first_body, str(spring.second_body), spring.first_point, spring.second_point, spring.axis
        )
        rough = replace(straight, friction=spring.friction, friction_rate=spring.friction_rate)
        return replace(rough, travel_force=spring.travel_force, rate_force=spring.rate_force)

    springs = map(bent, vehicle.springs)
    bars = (element(b, b.left, b.right, b.point_left, b.point_right, (0.0, 0.0, 1.0 / b.track)) for b in vehicle.bars)
    return (*springs, *bars)


def _cut_vehicle_tree(vehicle: SpatialVehicle, chassis_name: str) -> SpatialVehicle:
    """Bodies of the cut vehicle in tree order: massless carriers for heading and pitch, the chassis with roll, and all
    other bodies behind it."""
    body = vehicle.body(chassis_name)
    carriers = (
        Body(f"{chassis_name} heading", 0.0, body.position, ("x", "y", "z", "rz")),
        Body(f"{chassis_name} pitch", 0.0, body.position, ("ry",), parent=f"{chassis_name} heading"),
    )
    turned = replace(body, freedoms=("rx",), parent=f"{chassis_name} pitch")
    others = tuple(body for body in vehicle.bodies if body.name != chassis_name)
    return SpatialVehicle(vehicle.name, (*carriers, turned, *others), (), (), vehicle.axles, gravity=vehicle.gravity)


def _check_can_be_cut(vehicle: SpatialVehicle, chassis_name: str) -> None:
    names = tuple(body.name for body in vehicle.bodies)
    if chassis_name not in names:
        raise InputError(vehicle.name, "chassis", chassis_name, "no such body", names)
    body = vehicle.body(chassis_name)
    if len(body.freedoms) != 6 or body.parent is not None:
        raise InputError(
            vehicle.name,
            f"bodies[{chassis_name}].freedoms",
            body.freedoms,
            "what is left of a vehicle without tyres is free: its chassis needs x, y, z, rx, ry and rz",
        )
    for spring in vehicle.springs:
        if spring.second_body is None:
            raise InputError(vehicle.name, f"springs[{spring.name}].bodies", "ground", "a cut vehicle has no ground")
    for bar in vehicle.bars:
        if bar.body != chassis_name:
            place = f"anti_roll_bars[{bar.name}].body"
            raise InputError(vehicle.name, place, bar.body, "must be the chassis", (chassis_name,))
    if not vehicle.tyres:
        raise InputError(vehicle.name, "tyres", None, "there is nothing to cut: no tyre")


@dataclass(frozen=True)
class RigidVehicle:
    """The cut vehicle as a single rigid body, which describes its drift when the springs have settled.

    mass (kg), centre (3,) in the design position (m), inertia (3, 3) about it (kg m^2), arms (h, 3) of the hubs.

    Forces and moments of white noise at the hubs turn the vehicle as a double integral, var = q t^3 / 3, with q =
    period I^-1 C I^-1 of the covariance C of the moment samples about the common centre of mass. What turns by phi
    carries body-fixed forces with it, but not gravity: the vehicle slides off by g times the tilt, a double integral of
    a double integral, var = g^2 q t^7 / 252. Forces that are given in the space do not turn, and there is no such
    error; but what carries the vehicle from below its centre of mass then topples it, as an upright pendulum, with the
    rates sqrt(m g h / I) of roll and pitch, h the height of the centre above the hubs.
    """

    mass: float
    centre: np.ndarray
    inertia: np.ndarray
    arms: np.ndarray

    def moments(self, wrenches: np.ndarray) -> np.ndarray:
        """Moments (m, 3) about the vehicle's centre of mass, N m, of hub wrenches (m, 6 h) in the chassis' axes."""
        parts = wrenches.reshape(len(wrenches), -1, 6)
        return (np.cross(self.arms, parts[:, :, :3]) + parts[:, :, 3:]).sum(axis=1)

    def turning(self, standard_deviations: np.ndarray) -> np.ndarray:
        """Covariance (3, 3) of the angular accelerations, rad^2/s^4, caused by noise with standard deviations (6 h,), N
        and N m, of the hub samples."""
        rows = self.moments(np.eye(len(standard_deviations)))
        inverse = np.linalg.inv(self.inertia)
        return inverse @ (rows.T * standard_deviations**2) @ rows @ inverse

    def toppling_rates(self) -> np.ndarray:
        """Growth rates (2,) of roll and pitch, 1/s, under forces whose directions are fixed in space."""
        loads = -self.arms[:, 2].mean() * self.mass * GRAVITY
        return np.sqrt(np.maximum(loads, 0.0) / np.diag(self.inertia)[:2])

    def angle_variance(self, standard_deviations: np.ndarray, sampling_period: float, times: np.ndarray) -> np.ndarray:
        """Variances (m, 3) of roll, pitch and heading (rad^2) caused by noise of the hub samples, at times (m,) after a
        start from rest."""
        return np.outer(times**3 / 3, sampling_period * np.diag(self.turning(standard_deviations)))

    def position_variance(
        self, standard_deviations: np.ndarray, sampling_period: float, times: np.ndarray, frame: str
    ) -> np.ndarray:
        """Variances (m, 3) of x, y, z (m^2) caused by noise of the hub samples, at times (m,) after a start from rest;
        ``frame`` : of the forces."""
        force = sampling_period * (standard_deviations.reshape(-1, 6)[:, :3] ** 2).sum(axis=0) / self.mass**2
        variances = np.outer(times**3 / 3, force)
        if frame != "inertial":
            turning = sampling_period * np.diag(self.turning(standard_deviations))
            variances[:, :2] += GRAVITY**2 * np.outer(times**7 / 252, turning[[1, 0]])
        return variances


def rigid_vehicle(vehicle: CutVehicle) -> RigidVehicle:
    """``RigidVehicle`` with the mass properties of all bodies of a cut vehicle, combined in the design position."""
    bodies = vehicle.uncut.bodies
    mass = sum(body.mass for body in bodies)
    centre = np.array([body.mass * np.array(body.position) for body in bodies]).sum(axis=0) / mass
    inertia = np.zeros((3, 3))
    for body in bodies:
        arm = np.subtract(body.position, centre)
        inertia += np.array(body.inertia) + point_mass_inertia(body.mass, arm)
    return RigidVehicle(mass, centre, inertia, np.array([tyre.point for tyre in vehicle.uncut.tyres]) - centre)
