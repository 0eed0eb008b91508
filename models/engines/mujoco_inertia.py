"""Inertia tensors as MuJoCo's files may hold them: its compiler refuses those that no distribution of mass has.

Principal moments A <= B <= C of any mass keep A + B >= C. Published vehicles break that, as do rotors that have an
inertia about their axle alone. What is refused is replaced by what moves alike, where there is such a tensor; otherwise
the largest moment is lowered to A + B, and the difference is told as left out.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from models.vehicles.spatial import Body, SpatialVehicle, Vector

MARGIN = 1e-13
"""Share by which A + B is kept above C, so that rounding does not undo it."""
TOLD_SHARE = 1e-9
"""Share of a moment from which on lowering it is told."""


def realisable(vehicle: SpatialVehicle) -> tuple[SpatialVehicle, list[str]]:
    """The vehicle with inertia tensors that MuJoCo's compiler accepts, and sentences on the inertia that is lost
    thereby.
    """
    tensors = {body.name: np.array(body.inertia, float) for body in vehicle.bodies}
    for body in vehicle.bodies:
        if not _fits(tensors[body.name]):
            _move_alike(vehicle, body, tensors)
    lowered = [_lower(name, tensors) for name, tensor in tensors.items() if not _fits(tensor)]
    bodies = tuple(replace(body, inertia=_rows(tensors[body.name])) for body in vehicle.bodies)
    return replace(vehicle, bodies=bodies), [sentence for sentence in lowered if sentence]


def _fits(tensor: np.ndarray) -> bool:
    """Whether a distribution of mass can have this inertia tensor (3, 3); zero inertia counts, too."""
    least, middle, largest = np.linalg.eigvalsh(tensor)
    return bool(least >= 0.0 and least + middle >= (1.0 + MARGIN) * largest)


def _move_alike(vehicle: SpatialVehicle, body: Body, tensors: dict[str, np.ndarray]) -> None:
    """Replace a tensor by one that moves in the same way, possible for bodies that turn about one axis at most, and for
    rotors.

    A rotor is as heavy about every axis across its axle: what is added there is constant in the axes of its carrier,
    and is taken from the heaviest body that always lies parallel to these.
    """
    tensor = tensors[body.name]
    axes = {turn for name in vehicle.chain(body.name) for turn in _turning_freedoms(vehicle.body(name))}
    if len(axes) <= 1:
        place = "xyz".index(axes.pop()[1]) if axes else 0
        tensors[body.name] = float(tensor[place, place]) * np.eye(3)
    elif len(_turning_freedoms(body)) == 1 and np.count_nonzero(tensor) == 1 and body.parent is not None:
        across = (0.5 + MARGIN) * (tensor.max() * np.eye(3) - tensor)
        tensors[body.name] = tensor + across
        tensors[max(_parallel(vehicle, body.parent), key=lambda name: float(np.trace(tensors[name])))] -= across


def _turning_freedoms(body: Body) -> list[str]:
    """Rotational freedoms of a body relative to its carrier."""
    return [freedom for freedom in body.freedoms if freedom.startswith("r")]


def _parallel(vehicle: SpatialVehicle, name: str) -> Sequence[str]:
    """Names of the bodies whose axes always remain parallel to those of ``name``."""

    def leader(name: str) -> str:
        body = vehicle.body(name)
        return name if _turning_freedoms(body) or body.parent is None else leader(body.parent)

    return [body.name for body in vehicle.bodies if leader(body.name) == leader(name)]


def _lower(name: str, tensors: dict[str, np.ndarray]) -> str:
    """Lower the largest principal moment of a body to one that a distribution of mass can have. Returns a sentence that
    says so, empty where the change is only rounding.
    """
    moments, axes = np.linalg.eigh(tensors[name])
    largest, axis = float(moments[2]), axes[:, 2]
    moments = np.maximum(moments, 0.0)
    moments[2] = (moments[0] + moments[1]) / (1.0 + 2.0 * MARGIN)
    tensors[name] = axes * moments @ axes.T
    if largest - moments[2] < TOLD_SHARE * largest:
        return ""
    where = ", ".join(f"{part:.3g}" for part in axis)
    return (
        f"{largest - moments[2]:.4g} kg m^2 of the inertia of {name!r} about its axis ({where}), which is "
        f"{largest:.6g} kg m^2: no distribution of mass has that beside the two other moments, and MuJoCo refuses it"
    )


def _rows(tensor: np.ndarray) -> tuple[Vector, Vector, Vector]:
    """A tensor (3, 3) as rows of plain numbers."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = tensor.tolist()
    return (xx, xy, xz), (yx, yy, yz), (zx, zy, zz)
