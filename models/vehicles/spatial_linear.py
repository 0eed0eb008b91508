"""Mass, damping and stiffness matrices, road inputs and outputs of a vehicle in space, for small motion about its
design position."""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import null_space

from models.core.errors import InputError
from models.vehicles.kinematics import Kinematics
from models.vehicles.linear_vehicle import LinearOutput, LinearVehicle, WheelPosition
from models.vehicles.spatial import (
    AntiRollBar,
    JointElement,
    PartOutput,
    PointOutput,
    ReductionLimits,
    SpatialOutput,
    SpatialVehicle,
    SpringDamper,
    TurnOutput,
)

NEGLIGIBLE_TRAVEL = 1e-10
"""Share of the largest travel below which a travel of a reduced vehicle counts as none."""
Gains = tuple[float, float]
"""Stiffness and damping of a spring (N/m, N s/m)."""


def linearise(
    vehicle: SpatialVehicle, speed: float | None = None, equivalent_gains: Mapping[str, Gains] | None = None
) -> LinearVehicle:
    """Linear vehicle M q'' + D q' + K q = R z + S z' for small motion about the design position, unloaded without
    gravity, in equilibrium with it.

    speed : m/s, above 0, wanted by side forces and drag only; InputError where they miss it.
    Tyres that may leave the road are on it.
    equivalent_gains : stiffness (N/m) and damping (N s/m) that stand for springs of these names instead of their slopes
    at rest, as statistical linearisation finds them; InputError for a name that no spring has."""
    motion = Kinematics(vehicle)
    gains = _gains_by_name(vehicle)
    for name in set(equivalent_gains or {}) - set(gains):
        raise InputError(vehicle.name, "equivalent", name, "no such spring", tuple(gains))
    gains |= equivalent_gains or {}
    tyres = _tyre_rows(vehicle, motion)
    damping, stiffness = np.zeros((2, motion.size, motion.size))
    parts = _parts_by_name(vehicle, motion, gains)
    for row, k, c in (*parts.values(), *tyres.values()):
        stiffness += k * np.outer(row, row)
        damping += c * np.outer(row, row)
    stiffness += _geometric_stiffness(vehicle, motion)
    _add_speed_forces(vehicle, motion, speed, damping, stiffness)
    whole = LinearVehicle(
        mass=design_mass_matrix(vehicle),
        damping=damping,
        stiffness=stiffness,
        road_stiffness=np.column_stack([k * row for row, k, _ in tyres.values()]),
        road_damping=np.column_stack([c * row for row, _, c in tyres.values()]),
        coordinates=vehicle.coordinates(),
        wheels=wheels(vehicle),
        outputs=tuple(_linear_output(spec, vehicle, motion, parts, tyres) for spec in vehicle.outputs),
        source="analytic, " + ("loaded" if vehicle.gravity else "unloaded"),
    )
    limits = vehicle.limits
    return (
        reduced_vehicle(whole, mass_matrix_without(vehicle, limits.massless), remaining_motions(vehicle, limits))
        if limits
        else whole
    )


def wheels(vehicle: SpatialVehicle) -> tuple[WheelPosition, ...]:
    """Positions of the contacts of a vehicle's tyres with the road."""
    return tuple(WheelPosition(tyre.name, tyre.point[0], tyre.point[1], tyre.axle) for tyre in vehicle.tyres)


def linear_outputs(vehicle: SpatialVehicle, kinematics: Kinematics) -> tuple[LinearOutput, ...]:
    """``LinearOutput`` of every output of a vehicle: from the ``kinematics`` of points (possibly an engine's), and the
    slopes of the springs at rest."""
    parts, tyres = _parts_by_name(vehicle, kinematics, _gains_by_name(vehicle)), _tyre_rows(vehicle, kinematics)
    return tuple(_linear_output(spec, vehicle, kinematics, parts, tyres) for spec in vehicle.outputs)


def design_mass_matrix(vehicle: SpatialVehicle) -> np.ndarray:
    """Mass matrix (n, n) of a vehicle in the design position: kg, kg m, kg m^2."""
    motion = Kinematics(vehicle)
    total = np.zeros((motion.size, motion.size))
    for body in vehicle.bodies:
        shift, turn = motion.shift(body.name, body.position), motion.turn(body.name)
        total += body.mass * shift.T @ shift + turn.T @ np.array(body.inertia) @ turn
    for element in vehicle.joint_elements:
        row = _joint_row(motion, element)
        total += element.inertia * np.outer(row, row)
    return total


def slopes_at_rest(spring: SpringDamper) -> Gains:
    """Stiffness (N/m) and damping (N s/m) of a spring for small motion: linear terms, and slopes of curves and friction
    at rest."""
    travel, rate = spring.travel_force, spring.rate_force
    return (
        spring.stiffness + (travel.slope_at_rest() if travel else 0.0),
        spring.damping + (rate.slope_at_rest() if rate else 0.0) + spring.friction / spring.friction_rate,
    )


class Preloads(NamedTuple):
    """Static forces of a vehicle's parts by name: of spring-dampers (N), bars (N m), joint elements (N, N m) and tyres
    (N); all 0 without gravity."""

    parts: dict[str, float]
    tyres: dict[str, float]


def static_preloads(vehicle: SpatialVehicle) -> Preloads:
    """Preloads that hold a vehicle in its design position against gravity; that of a tyre is its static wheel load.

    Shares that several could bear are those of the linear statics: what each would carry had the unloaded vehicle
    sunk by K^-1 times the weights. InputError where no spring can carry a weight, and for a tyre that only pushes
    and would have to pull.
    """
    motion = Kinematics(vehicle)
    parts, tyres = _parts_by_name(vehicle, motion, _gains_by_name(vehicle)), _tyre_rows(vehicle, motion)
    stiffness = static_stiffness(vehicle, motion)
    weight = sum(body.mass * vehicle.gravity * motion.shift(body.name, body.position)[2] for body in vehicle.bodies)
    sunk = -np.linalg.lstsq(stiffness, weight, rcond=1e-12)[0]
    left = np.abs(stiffness @ sunk + weight)
    if left.max() > 1e-8 * np.abs(weight).max():
        name = ".".join(vehicle.coordinates()[int(left.argmax())])
        raise InputError(vehicle.name, name, None, "no spring carries the weight along this freedom")
    loads = {name: -k * float(row @ sunk) for name, (row, k, _) in tyres.items()}
    for tyre in vehicle.tyres:
        if tyre.pushes_only and not loads[tyre.name] > 0.0:
            raise InputError(
                vehicle.name,
                f"tyres[{tyre.name}]",
                loads[tyre.name],
                "N is its load at rest: a tyre that only pushes must bear one",
            )
    return Preloads({name: k * float(row @ sunk) for name, (row, k, _) in parts.items()}, loads)


DeformationRow = tuple[np.ndarray, float, float]
"""A spring, bar or tyre for small motion: row (n,) of its deformation per coordinate, stiffness, damping."""


def _gains_by_name(vehicle: SpatialVehicle) -> dict[str, Gains]:
    return {spring.name: slopes_at_rest(spring) for spring in vehicle.springs}


def _parts_by_name(
    vehicle: SpatialVehicle, kinematics: Kinematics, gains_by_name: Mapping[str, Gains]
) -> dict[str, DeformationRow]:
    """Rows and gains of a vehicle's spring-dampers, bars and joint elements, by name."""
    rows = dict[str, DeformationRow]()
    for spring in vehicle.springs:
        ends = kinematics.shift(spring.second_body, spring.second_point) - kinematics.shift(
            spring.first_body, spring.first_point
        )
        apart, turning = (
            np.subtract(spring.second_point, spring.first_point),
            kinematics.turned_axis(spring.frame, spring.axis),
        )
        rows[spring.name] = np.array(spring.axis) @ ends + apart @ turning, *gains_by_name[spring.name]
    rows |= {bar.name: (_bar_twist_row(kinematics, bar), bar.stiffness, bar.damping) for bar in vehicle.bars}
    return rows | {e.name: (_joint_row(kinematics, e), e.stiffness, e.damping) for e in vehicle.joint_elements}


def _joint_row(kinematics: Kinematics, joint_element: JointElement) -> np.ndarray:
    """Row (n,) of the coordinates' factors in the displacement d of a joint element, which is linear in the
    coordinates."""
    places = zip(joint_element.coordinates, joint_element.factors, strict=True)
    return np.asarray(sum(factor * kinematics.coordinate(*place) for place, factor in places))


def _bar_twist_row(kinematics: Kinematics, bar: AntiRollBar) -> np.ndarray:
    """Row (n,) of the coordinates' factors in the twist angle of a bar, whose vertical direction turns with its
    frame."""
    risen = kinematics.shift(bar.left, bar.point_left)[2] - kinematics.shift(bar.right, bar.point_right)[2]
    turning = np.subtract(bar.point_right, bar.point_left) @ kinematics.turned_axis(bar.frame, (0.0, 0.0, 1.0))
    rolls = 0.0 if bar.frame == bar.body else kinematics.coordinate(bar.body, "rx")
    return rolls - risen / bar.track + turning / bar.track


def _tyre_rows(vehicle: SpatialVehicle, kinematics: Kinematics) -> dict[str, DeformationRow]:
    return {t.name: (kinematics.shift(t.body, t.point)[2], t.stiffness, t.damping) for t in vehicle.tyres}


def with_preloads(vehicle: SpatialVehicle, joint_preloads: Preloads) -> SpatialVehicle:
    """The vehicle with the preloads of its joint elements included in these."""
    elements = tuple(replace(element, preload=joint_preloads.parts[element.name]) for element in vehicle.joint_elements)
    return replace(vehicle, joint_elements=elements)


def static_stiffness(vehicle: SpatialVehicle, kinematics: Kinematics) -> np.ndarray:
    """Stiffness (n, n) of springs, bars and tyres at rest, without gravity: N/m, N, N m."""
    parts = (
        *_parts_by_name(vehicle, kinematics, _gains_by_name(vehicle)).values(),
        *_tyre_rows(vehicle, kinematics).values(),
    )
    return np.asarray(sum(k * np.outer(row, row) for row, k, _ in parts))


def _geometric_stiffness(vehicle: SpatialVehicle, kinematics: Kinematics) -> np.ndarray:
    """Geometric stiffness (n, n) from weights and preloads whose lever arms change: -sum of force times second
    derivative."""
    total = np.zeros((kinematics.size, kinematics.size))
    if not vehicle.gravity:
        return total
    held = static_preloads(vehicle)
    for body in vehicle.bodies:
        total += body.mass * vehicle.gravity * kinematics.second_derivatives(body.name, body.position)[2]
    for spring in vehicle.springs:
        ends = (spring.first_body, spring.first_point), (spring.second_body, spring.second_point)
        total += held.parts[spring.name] * kinematics.travel_second_derivatives(*ends, spring.axis, spring.frame)
    for bar in vehicle.bars:
        ends = (bar.left, bar.point_left), (bar.right, bar.point_right)
        total += (
            held.parts[bar.name] / bar.track * kinematics.travel_second_derivatives(*ends, (0.0, 0.0, 1.0), bar.frame)
        )
    for tyre in vehicle.tyres:
        total -= held.tyres[tyre.name] * kinematics.second_derivatives(tyre.body, tyre.point)[2]
    return total


def _add_speed_forces(
    vehicle: SpatialVehicle,
    kinematics: Kinematics,
    speed: float | None,
    damping_matrix: np.ndarray,
    stiffness_matrix: np.ndarray,
) -> None:
    """Add the contributions of side forces and drag at a speed (m/s) to the damping and stiffness matrices in place."""
    if not vehicle.side_forces and not vehicle.drags:
        return
    if speed is None or not speed > 0:
        allowed = "a vehicle with side forces or drag needs a speed above 0 m/s: its damping depends on it"
        raise InputError(vehicle.name, "speed", speed, allowed)
    for force in vehicle.side_forces:
        sideways = kinematics.shift(force.body, force.point)[1]
        roll, _, yaw = kinematics.turn(force.chassis)
        steered = force.roll_steer * roll + yaw
        damping_matrix += force.stiffness / speed * np.outer(sideways, sideways)
        stiffness_matrix -= force.stiffness * np.outer(sideways, steered)
    for drag in vehicle.drags:
        along = kinematics.shift(drag.body, vehicle.body(drag.body).position)[0]
        damping_matrix += drag.coefficient * speed * np.outer(along, along)


UNITS = {
    "acceleration": "m/s^2",
    "velocity": "m/s",
    "displacement": "m",
    "angular acceleration": "rad/s^2",
    "angular velocity": "rad/s",
    "angle": "rad",
    "travel": "m",
    "travel rate": "m/s",
    "force": "N",
    "tyre force": "N",
    "tyre deflection": "m",
}
"""Unit of each kind of output; for an anti-roll bar, and for a joint element that rotates, rad, rad/s and N m."""


def _linear_output(
    wanted_output: SpatialOutput,
    vehicle: SpatialVehicle,
    kinematics: Kinematics,
    part_rows: Mapping[str, DeformationRow],
    tyre_rows: Mapping[str, DeformationRow],
) -> LinearOutput:
    """``LinearOutput`` with the factors of an output of the vehicle."""
    rows = np.zeros((3, kinematics.size))  # of q, q', q''
    road = np.zeros((2, len(vehicle.tyres)))  # of z, z'
    unit, order = (
        UNITS[wanted_output.kind],
        2 if "acceleration" in wanted_output.kind else int("velocity" in wanted_output.kind),
    )
    if isinstance(wanted_output, PointOutput):
        rows[order] = np.array(wanted_output.axis) @ kinematics.shift(wanted_output.body, wanted_output.point)
    elif isinstance(wanted_output, TurnOutput):
        rows[order] = np.array(wanted_output.axis) @ kinematics.turn(wanted_output.body)
    elif isinstance(wanted_output, PartOutput):
        row, *force_gains = part_rows[wanted_output.part]
        gains = {"travel": (1.0, 0.0), "travel rate": (0.0, 1.0), "force": force_gains}[wanted_output.kind]
        rows[:2] = np.outer(gains, row)
        turning = {bar.name for bar in vehicle.bars} | {e.name for e in vehicle.joint_elements if _is_angle(e)}
        if wanted_output.part in turning:
            unit = {"m": "rad", "m/s": "rad/s", "N": "N m"}[unit]
    else:
        row, *force_gains = tyre_rows[wanted_output.tyre]
        gains = {"tyre force": force_gains, "tyre deflection": (1.0, 0.0)}[wanted_output.kind]
        rows[:2], road[:, list(tyre_rows).index(wanted_output.tyre)] = -np.outer(gains, row), gains
    return LinearOutput(wanted_output.name, unit, wanted_output.kind, rows[2], rows[1], rows[0], road[0], road[1])


def _is_angle(joint_element: JointElement) -> bool:
    """Whether the displacement d of a joint element is an angle."""
    return all(freedom.startswith("r") for _, freedom in joint_element.coordinates)


def reduced_vehicle(linear_vehicle: LinearVehicle, mass_matrix: np.ndarray, motion_matrix: np.ndarray) -> LinearVehicle:
    """Linear vehicle in the remaining coordinates r of a reduced vehicle, with q = N r; the mass matrix may be
    singular.

    mass_matrix : (n, n) of ``mass_matrix_without``; motion_matrix : (n, r) of ``remaining_motions``. InputError where
    no coordinate is left."""
    if not motion_matrix.size:
        raise InputError("", "effects", None, "nothing is left that could move")
    moved = [factors @ motion_matrix for factors in linear_vehicle.read[:3]] if linear_vehicle.outputs else [()] * 3
    outputs = tuple(
        LinearOutput(o.name, o.unit, o.kind, acceleration, rate, displacement, o.road_factors, o.road_rate_factors)
        for o, acceleration, rate, displacement in zip(linear_vehicle.outputs, *moved, strict=True)
    )
    return replace(
        linear_vehicle,
        mass=motion_matrix.T @ mass_matrix @ motion_matrix,
        damping=motion_matrix.T @ linear_vehicle.damping @ motion_matrix,
        stiffness=motion_matrix.T @ linear_vehicle.stiffness @ motion_matrix,
        road_stiffness=motion_matrix.T @ linear_vehicle.road_stiffness,
        road_damping=motion_matrix.T @ linear_vehicle.road_damping,
        coordinates=tuple(("", str(i)) for i in range(motion_matrix.shape[1])),
        outputs=outputs,
    )


def mass_matrix_without(vehicle: SpatialVehicle, massless_bodies: frozenset[str]) -> np.ndarray:
    """Mass matrix (n, n) of a vehicle without the mass of the given bodies; no rounding residue of them remains."""
    light = tuple(
        replace(body, mass=0.0, inertia=((0.0,) * 3,) * 3) if body.name in massless_bodies else body
        for body in vehicle.bodies
    )
    return design_mass_matrix(replace(vehicle, bodies=light))


def remaining_motions(vehicle: SpatialVehicle, reduction_limits: ReductionLimits) -> np.ndarray:
    """Matrix N (n, r) of the motions that remain to a reduced vehicle: unit vectors where only coordinates are locked,
    else a basis of motions that leave the rigid springs' lengths unchanged."""
    coordinates = vehicle.coordinates()
    kept = np.eye(len(coordinates))[:, [c not in reduction_limits.locked for c in coordinates]]
    if not reduction_limits.rigid:
        return kept
    motion = Kinematics(vehicle)
    rows = [
        np.array(s.axis)
        @ (motion.shift(s.second_body, s.second_point) - motion.shift(s.first_body, s.first_point))
        @ kept
        for s in vehicle.springs
        if s.name in reduction_limits.rigid
    ]
    return kept @ null_space(np.array(rows), rcond=NEGLIGIBLE_TRAVEL) if rows else kept
