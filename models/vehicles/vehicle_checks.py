"""Checks that a vehicle is possible, before any number is computed from it."""

from collections import defaultdict

import numpy as np

from models.core.errors import InputError
from models.vehicles.kinematics import Kinematics
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import design_mass_matrix

GROUND = "the ground"


def check_vehicle(vehicle: SpatialVehicle, vehicle_file: str) -> None:
    """Raise InputError with the name of the entry in the vehicle file that makes the vehicle impossible."""
    _check_bodies(vehicle, vehicle_file)
    _check_connections(vehicle, vehicle_file)
    _check_inertia(vehicle, vehicle_file)
    _check_mobility(vehicle, vehicle_file)
    _check_towing(vehicle, vehicle_file)


def _check_bodies(vehicle: SpatialVehicle, vehicle_file: str) -> None:
    for body in vehicle.bodies:
        place = f"bodies[{body.name}]"
        if len(set(body.freedoms)) < len(body.freedoms):
            raise InputError(vehicle_file, f"{place}.freedoms", list(body.freedoms), "a freedom is named twice")
        if not body.freedoms and body.parent is None:
            raise InputError(vehicle_file, f"{place}.freedoms", [], "a body that rides on no other needs a freedom")
        tensor = np.array(body.inertia)
        least = float(np.linalg.eigvalsh(tensor).min())
        if least < -1e-12 * np.abs(tensor).max():
            said = f"the tensor is indefinite, its least principal inertia is {least:.6g} kg m^2: must be 0 or more"
            raise InputError(vehicle_file, f"{place}.inertia", tensor.tolist(), said)


def _check_connections(vehicle: SpatialVehicle, vehicle_file: str) -> None:
    """Raise InputError unless springs, tyres and bars connect every body to the ground, and no moving body is held by
    its joint alone."""
    beside = defaultdict[str, set[str]](set)
    for first, two in _connected_bodies(vehicle):
        beside[first].add(two)
        beside[two].add(first)
    touched = set(beside)
    for body in vehicle.bodies:
        if body.parent is not None:
            beside[body.name].add(body.parent)
            beside[body.parent].add(body.name)
    reached, border = {GROUND}, [GROUND]
    while border:
        new = beside[border.pop()] - reached
        reached |= new
        border += new
    carried = touched | {body.parent for body in vehicle.bodies}
    for body in vehicle.bodies:
        if body.name not in reached or (body.freedoms and body.name not in carried):
            said = "unconnected: no spring, mount, seat or tyre leads from this body to the road"
            raise InputError(vehicle_file, f"bodies[{body.name}]", None, said)


def _connected_bodies(vehicle: SpatialVehicle) -> list[tuple[str, str]]:
    springs = [(spring.first_body, spring.second_body or GROUND) for spring in vehicle.springs]
    tyres = [(tyre.body, GROUND) for tyre in vehicle.tyres]
    bars = [(bar.body, end) for bar in vehicle.bars for end in (bar.left, bar.right)]
    along = [(body, vehicle.body(body).parent or GROUND) for e in vehicle.joint_elements for body, _ in e.coordinates]
    return springs + tyres + bars + along


def _check_inertia(vehicle: SpatialVehicle, vehicle_file: str) -> None:
    """Raise InputError unless every freedom moves some inertia: the mass matrix, scaled to a unit diagonal, is positive
    definite."""
    matrix, coordinates = design_mass_matrix(vehicle), vehicle.coordinates()
    for (name, freedom), inertia in zip(coordinates, matrix.diagonal(), strict=True):
        if inertia <= 0:
            said = f"nothing inert moves with the freedom {freedom}: give an inertia or leave the freedom out"
            raise InputError(vehicle_file, f"bodies[{name}].inertia", None, said)
    scale = 1 / np.sqrt(matrix.diagonal())
    values, vectors = np.linalg.eigh(matrix * np.outer(scale, scale))
    if values[0] < 1e-10:
        name, freedom = coordinates[int(np.abs(vectors[:, 0]).argmax())]
        said = f"nothing inert moves with a mixture of freedoms, {freedom} of this body most of all"
        raise InputError(vehicle_file, f"bodies[{name}].inertia", None, said)


def _check_mobility(vehicle: SpatialVehicle, vehicle_file: str) -> None:
    """Raise InputError unless every tyre can move vertically, and a chassis with side forces laterally."""
    motion = Kinematics(vehicle)
    for tyre in vehicle.tyres:
        if not motion.shift(tyre.body, tyre.point)[2].any():
            raise InputError(vehicle_file, f"tyres[{tyre.name}].body", tyre.body, "this body cannot move up and down")
    for force in vehicle.side_forces:
        if not motion.shift(force.body, force.point)[1].any():
            said = "side force on a chassis that cannot move sideways: give it the freedom y, or leave it out"
            raise InputError(vehicle_file, f"tyres[{force.name}].cornering", force.stiffness, said)


def _check_towing(vehicle: SpatialVehicle, vehicle_file: str) -> None:
    """Raise InputError unless every towed body, and the vehicle that tows it, has wheels."""
    on_wheels = {vehicle.towed_under(tyre.body) for tyre in vehicle.tyres}
    for name in vehicle.towed:
        if name not in on_wheels:
            said = "is towed without wheels: no tyre is on it, or on a body that rides on it"
            raise InputError(vehicle_file, f"bodies[{name}].hitch", None, said)
    if vehicle.towed and None not in on_wheels:
        raise InputError(vehicle_file, "tyres", [tyre.name for tyre in vehicle.tyres], "the towing vehicle has no tyre")
