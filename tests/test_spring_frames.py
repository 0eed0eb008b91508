"""The frame of an axis: which one each system takes, what the file may say, and that closed forms know it."""

from dataclasses import replace

import numpy as np
import pytest

from models.core.errors import InputError, Refused
from models.core.scene_file import parse_toml
from models.engines.spatial_protocol import build, jacobian
from models.engines.spatial_reference import SpatialReference
from models.multibody.numbers import Handling
from models.vehicles.cut_vehicle import cut_at_hubs
from models.vehicles.free_vehicle import CARRIER, free_vehicle
from models.vehicles.spatial_linear import linearise
from models.vehicles.vehicle_file import SHIPPED_FOLDER, build_vehicle, load_vehicle
from validation.spatial.cars import twin


def _frames(vehicle):
    return {part.frame for part in (*vehicle.springs, *vehicle.bars)}


def test_every_system_names_its_frame():
    """The space in ride, the carrier in handling, the chassis under hub forces."""
    car = load_vehicle("r19_free")
    assert _frames(car) == {None}
    assert _frames(free_vehicle(car)) == {CARRIER}
    assert _frames(cut_at_hubs(car, "body").uncut) == {"body"}


def _with_frame(frame):
    table = parse_toml(SHIPPED_FOLDER / "r19_free.toml")
    table["springs"][0]["frame"] = table["mounts"][0]["frame"] = frame
    return build_vehicle(table, "car.toml")


def test_a_vehicle_file_may_name_a_frame():
    """A spring and the three springs of a mount; a body that is none is told by its entry."""
    named = {spring.name for spring in _with_frame("engine").springs if spring.frame == "engine"}
    assert named == {"front left", "left mount.x", "left mount.y", "left mount.z"}
    with pytest.raises(InputError, match=r"springs\[front left\].frame"):
        _with_frame("motor")


def test_systems_refuse_frames_that_they_do_not_know():
    """Engines of the ride, and handling, say which entry they cannot carry."""
    car = _with_frame("engine")
    with pytest.raises(Refused, match="front left"):
        build("mujoco", car, speed=20.0)
    with pytest.raises(InputError, match=r"springs\[front left\].frame"):
        Handling(car)


def test_the_closed_form_knows_frames():
    """M, D and K of springs with ends apart, fixed in chassis or engine, beside differences of the full equations.

    Loaded, so that preloads turn with the frame. Differences of order six err by 1e-13 at 2e-3.
    """
    loaded = replace(cut_at_hubs(twin(), "body").uncut, side_forces=(), bars=())
    moved = tuple(
        replace(s, second_point=tuple(np.add(s.second_point, (0.1, -0.2, 0.3))), frame="engine" if i % 2 else "body")
        for i, s in enumerate(loaded.springs)
    )
    car = replace(loaded, springs=moved)
    linear, reference, still = linearise(car), SpatialReference(car), np.zeros(len(car.coordinates()))
    n, step = len(still), 2e-3
    stiffness = -linear.mass @ jacobian(lambda q: reference.acceleration(0.0, q, still), n, step)
    damping = -linear.mass @ jacobian(lambda v: reference.acceleration(0.0, still, v), n, step)
    assert np.abs(reference.acceleration(0.0, still, still)).max() < 1e-9  # m/s^2: the preloads hold it
    assert np.abs(stiffness - linear.stiffness).max() < 1e-11 * np.abs(stiffness).max()
    assert np.abs(damping - linear.damping).max() < 1e-11 * np.abs(damping).max()
    in_space = linearise(replace(car, springs=tuple(replace(s, frame=None) for s in moved)))
    assert np.abs(in_space.stiffness - linear.stiffness).max() > 1e-3 * np.abs(stiffness).max()
