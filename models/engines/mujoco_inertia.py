"""Inertia tensors that MuJoCo's files may hold: its compiler refuses tensors that no mass distribution has.

Principal moments A <= B <= C of any mass keep A + B >= C. Published vehicles break that, as do rotors that have an
inertia about their axle alone. What is refused is replaced by what moves alike, where there is such a tensor; otherwise
the largest moment is lowered to A + B, and the difference is told as left out.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from models.vehicles.spatial import Body, SpatialVehicle, Vector

MARGIN = 1e-13
"""Relative margin of the triangle inequality A + B >= C of principal moments of inertia, so that rounding does not
break it."""
REPORTED_SHARE = 1e-9
"""Relative reduction of a principal moment of inertia above which it is reported."""


def with_realisable_inertia(vehicle: SpatialVehicle) -> tuple[SpatialVehicle, list[str]]:
    """The vehicle with inertia tensors that MuJoCo's compiler accepts, and sentences on the inertia that is lost by
    that."""
    tensors = {body.name: np.array(body.inertia, float) for body in vehicle.bodies}
    for body in vehicle.bodies:
        if not _is_physical(tensors[body.name]):
            _replace_by_equivalent(vehicle, body, tensors)
    lowered = [_lower_largest_moment(name, tensors) for name, tensor in tensors.items() if not _is_physical(tensor)]
    bodies = tuple(replace(body, inertia=_rows(tensors[body.name])) for body in vehicle.bodies)
    return replace(vehicle, bodies=bodies), [sentence for sentence in lowered if sentence]


def _is_physical(inertia_tensor: np.ndarray) -> bool:
    """Whether a mass distribution can have this inertia tensor (3, 3); zero inertia counts, too."""
    least, middle, largest = np.linalg.eigvalsh(inertia_tensor)
    return bool(least >= 0.0 and least + middle >= (1.0 + MARGIN) * largest)


def _replace_by_equivalent(vehicle: SpatialVehicle, body: Body, inertia_tensors: dict[str, np.ndarray]) -> None:
    """Replace an inertia tensor by one with the same motion, which is possible for bodies that turn about one axis at
    most, and for rotors.

    A rotor is as heavy about every axis across its axle: what is added there is constant in the axes of its carrier,
    and is taken from the heaviest body that always lies parallel to these.
    """
    tensor = inertia_tensors[body.name]
    axes = {turn for name in vehicle.chain(body.name) for turn in _turning_freedoms(vehicle.body(name))}
    if len(axes) <= 1:
        place = "xyz".index(axes.pop()[1]) if axes else 0
        inertia_tensors[body.name] = float(tensor[place, place]) * np.eye(3)
    elif len(_turning_freedoms(body)) == 1 and np.count_nonzero(tensor) == 1 and body.parent is not None:
        across = (0.5 + MARGIN) * (tensor.max() * np.eye(3) - tensor)
        inertia_tensors[body.name] = tensor + across
        inertia_tensors[
            max(_parallel_bodies(vehicle, body.parent), key=lambda name: float(np.trace(inertia_tensors[name])))
        ] -= across


def _turning_freedoms(body: Body) -> list[str]:
    """Rotational freedoms of a body relative to its carrier."""
    return [freedom for freedom in body.freedoms if freedom.startswith("r")]


def _parallel_bodies(vehicle: SpatialVehicle, body_name: str) -> Sequence[str]:
    """Names of the bodies whose axes always remain parallel to those of ``body_name``."""

    def turning_ancestor(body_name: str) -> str:
        body = vehicle.body(body_name)
        return body_name if _turning_freedoms(body) or body.parent is None else turning_ancestor(body.parent)

    return [body.name for body in vehicle.bodies if turning_ancestor(body.name) == turning_ancestor(body_name)]


def _lower_largest_moment(body_name: str, inertia_tensors: dict[str, np.ndarray]) -> str:
    """Lower the largest principal moment of inertia of a body to one that a mass distribution can have. Returns a
    sentence on the change, empty where it is only rounding."""
    moments, axes = np.linalg.eigh(inertia_tensors[body_name])
    largest, axis = float(moments[2]), axes[:, 2]
    moments = np.maximum(moments, 0.0)
    moments[2] = (moments[0] + moments[1]) / (1.0 + 2.0 * MARGIN)
    inertia_tensors[body_name] = axes * moments @ axes.T
    if largest - moments[2] < REPORTED_SHARE * largest:
        return ""
    where = ", ".join(f"{part:.3g}" for part in axis)
    return (
        f"{largest - moments[2]:.4g} kg m^2 of the inertia of {body_name!r} about its axis ({where}), which is "
        f"{largest:.6g} kg m^2: no distribution of mass has that beside the two other moments, and MuJoCo refuses it"
    )


def _rows(inertia_tensor: np.ndarray) -> tuple[Vector, Vector, Vector]:
    """The rows of a tensor (3, 3) as tuples."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = inertia_tensor.tolist()
    return (xx, xy, xz), (yx, yy, yz), (zx, zy, zz)
