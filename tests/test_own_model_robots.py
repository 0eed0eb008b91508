"""Models that others wrote, from packages of the extra ``robots``: legs, arms, carts, swimmers, a humanoid robot, cars,
hands.

Each is certified, with what has no equal left out by name, or refused with the element that makes it impossible.
"""

from importlib.util import find_spec
from pathlib import Path

import pytest

from models.core.errors import InputError
from models.own_model.certificate import certificate
from models.own_model.file import read_model_file
from models.own_model.urdf import misread_numbers

LEGS = ("ant", "half_cheetah", "hopper", "humanoid", "humanoidstandup", "walker2d", "walker2d_v5")
CARTS = ("inverted_pendulum", "inverted_double_pendulum", "point")
ARMS = ("pusher", "pusher_v5", "reacher")
MUJOCO = tuple(f"gymnasium/envs/mujoco/assets/{name}.xml" for name in (*LEGS, *CARTS, *ARMS, "swimmer"))
URDF = (
    *(f"hex_util_urdf/urdf/archer_y6/{name}.urdf" for name in ("empty", "gp80", "gp100", "gp80_p008_handle")),
    "hex_util_urdf/urdf/archer_d6y/gp80.urdf",
    "hex_util_urdf/urdf/firefly_y6/gp80.urdf",
    "jvrc_description/urdf/jvrc1.urdf",
)
CARS = tuple(f"pybullet_data/racecar/{name}.urdf" for name in ("racecar", "racecar_differential"))
"""With plugins of a simulator, and one with a differential that meshes by contact alone."""
ASSETS = "gymnasium_robotics/envs/assets"
HANDS = (f"{ASSETS}/hand/reach.xml", f"{ASSETS}/adroit_hand/adroit_door.xml")
"""Tendons that tie joints of a finger; dry friction that holds light fingers at any rate. Their shapes lie in folders
beside that of the file."""
IMPOSSIBLE = "hex_util_urdf/urdf/archer_y6/gp100_p050_handle.urdf"
OUTSIDE = ("contact", "equality", "fluid", "force_range")
STATES = 5
FEW_STATES = 3
"""Of models of 30 joints."""


def _path(name: str) -> Path:
    """A file of a package, which is not imported; skipped where it is not installed."""
    package, _, rest = name.partition("/")
    spec = find_spec(package)
    if spec is None or spec.origin is None:
        pytest.skip(f"{package} is not installed: pip install 'twinrig[robots]'")
    return Path(spec.origin).parent / rest


@pytest.mark.parametrize("name", MUJOCO)
def test_mjcf_of_others_is_certified(name):
    for row in certificate(read_model_file(_path(name), OUTSIDE).twin, STATES):
        assert row.acceleration < 1e-10, row


@pytest.mark.parametrize("name", URDF)
def test_urdf_of_others_is_certified_and_nothing_of_it_lost(name):
    file = read_model_file(_path(name), OUTSIDE)
    assert misread_numbers(file) == []
    for row in certificate(file.twin, STATES):
        assert row.acceleration < 1e-10, row


@pytest.mark.parametrize("name", CARS)
def test_cars_of_others_are_certified(name):
    file = read_model_file(_path(name))
    assert misread_numbers(file) == [] and "stands on the world" in file.notes[-1]
    for row in certificate(file.twin, FEW_STATES):
        assert row.alike, row


@pytest.mark.parametrize("name", HANDS)
def test_hands_of_others_are_certified(name):
    for row in certificate(read_model_file(_path(name), OUTSIDE, _path(ASSETS)).twin, FEW_STATES):
        assert row.alike, row


def test_an_inertia_that_no_mass_has_is_refused_by_name():
    with pytest.raises(InputError, match="'link_6'"):
        read_model_file(_path(IMPOSSIBLE))


def test_a_refusal_of_what_xacro_left_names_its_line():
    """It stands in <origin xyz="$(optenv HUSKY_IMU_XYZ ...)">."""
    with pytest.raises(InputError, match=r"husky\.urdf: .*bad format in attribute 'xyz'.*line 97"):
        read_model_file(_path("pybullet_data/husky/husky.urdf"))
