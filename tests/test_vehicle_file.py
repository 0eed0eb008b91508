"""Vehicle files: what a user writes is what is built, and every fault is told by its entry."""
# ruff: noqa: E501 - a table reads best with a row a line

import tomllib

import numpy as np
import pytest

from models.core.errors import InputError
from models.core.scene_file import parse_toml
from models.vehicles.spatial_linear import linearise
from models.vehicles.vehicle_file import SHIPPED_FOLDER, build_vehicle, load_vehicle, shipped_vehicles

EXAMPLE = """
title = "Half car with digressive dampers and a bump stop"
bodies = [
  { name = "body", mass = 700.0, position = [0.0, 0.0, 0.55], inertia = [0.0, 1100.0, 0.0], freedoms = ["z", "ry"], source = "measured" },
  { name = "front wheel", mass = 38.0, position = [1.2, 0.0, 0.31], freedoms = ["z"], source = "measured" },
  { name = "rear wheel", mass = 36.0, position = [-1.4, 0.0, 0.31], freedoms = ["z"], source = "measured" },
]
axles = [{ name = "front", x = 1.2 }, { name = "rear", x = -1.4 }]
tyres = [
  { name = "front", axle = "front", body = "front wheel", stiffness = 190e3, source = "chosen" },
  { name = "rear", axle = "rear", body = "rear wheel", stiffness = 190e3, source = "chosen" },
]
springs = [
  { name = "front strut", bodies = ["body", "front wheel"], point = [1.2, 0, 0.31], stiffness = 21e3, rate_force = { at = [-0.5, -0.1, 0, 0.1, 0.5], force = [-1200, -400, 0, 250, 600] } },
  { name = "rear strut", bodies = ["body", "rear wheel"], point = [-1.4, 0, 0.31], stiffness = 19e3, damping = 1500, travel_force = { at = [0, 0.06, 0.08], force = [0, 0, 4000] } },
]
outputs = [
  { name = "driver's floor", kind = "acceleration", body = "body", point = [0.2, 0, 0.4] },
  { name = "front travel", kind = "travel", part = "front strut" },
  { name = "front wheel load", kind = "tyre force", tyre = "front" },
]
"""

FULL = """
title = "every table"
chassis = "body"
bodies = [
  { name = "body", mass = 700, position = [0, 0, 0.55], inertia = [300, 1100, 1200], products = [0, -10, 0], freedoms = ["y", "z", "rx", "ry", "rz"] },
  { name = "left", mass = 38, position = [1.2, 0.7, 0.31], freedoms = ["z"], parent = "body" },
  { name = "right", mass = 38, position = [1.2, -0.7, 0.31], freedoms = ["z"], parent = "body" },
  { name = "rear", mass = 80, position = [-1.4, 0, 0.31], inertia = [20, 0, 20], freedoms = ["z", "rx"] },
  { name = "engine", mass = 90, position = [1, 0, 0.5], freedoms = ["x", "z"] },
]
axles = [{ name = "front", x = 1.2, roll_steer = 0.05 }, { name = "rear", x = -1.4 }]
tyres = [
  { name = "fl", axle = "front", body = "left", stiffness = 190e3, cornering = 5e4 },
  { name = "fr", axle = "front", body = "right", stiffness = 190e3, damping = 10 },
  { name = "rl", axle = "rear", body = "rear", y = 0.6, stiffness = 190e3 },
  { name = "rr", axle = "rear", body = "rear", y = -0.6, stiffness = 190e3 },
]
springs = [
  { name = "sl", bodies = ["body", "left"], point = [1.2, 0.7, 0.31], stiffness = 2e4, damping = 1e3 },
  { name = "sr", bodies = ["body", "right"], point = [1.2, -0.7, 0.31], stiffness = 2e4, damping = 1e3 },
  { name = "tilted", bodies = ["body", "rear"], points = [[-1.4, 0.3, 0.7], [-1.4, 0.5, 0.3]], stiffness = 3e4 },
  { name = "stop", bodies = ["body", "rear"], point = [-1.4, -0.5, 0.3], direction = [0, 0, 2], travel_force = { at = [-1, 0, 1], force = [-3e4, 0, 3e4] } },
]
mounts = [{ name = "mount", bodies = ["engine", "body"], point = [1, 0, 0.4], stiffness = [1e5, 1e5, 2e5], damping = [1, 2, 3] }]
seats = [{ name = "driver", body = "body", mass = 70, position = [0, 0.3, 0.6], stiffness = 1e4, damping = 500 }]
anti_roll_bars = [{ name = "bar", body = "body", tyres = ["fl", "fr"], stiffness = 5e3 }]
drag = { body = "body", coefficient = 0.5 }
outputs = [
  { name = "driver", kind = "acceleration", body = "driver" },
  { name = "roll", kind = "angle", body = "body", direction = [3, 0, 0] },
  { name = "mount", kind = "force", part = "mount.z" },
  { name = "load", kind = "tyre force", tyre = "rl" },
]
"""


def built(text):
    return build_vehicle(tomllib.loads(text), "car.toml")


@pytest.mark.grounds("closed form")
def test_the_example_means_what_it_says():
    linear = linearise(built(EXAMPLE))
    assert linear.coordinates == (("body", "z"), ("body", "ry"), ("front wheel", "z"), ("rear wheel", "z"))
    assert [(w.name, w.x, w.y, w.axle) for w in linear.wheels] == [("front", 1.2, 0.0, 0), ("rear", -1.4, 0.0, 1)]
    # pitch is positive nose down: a point ahead sinks; the digressive damper's slope at rest is (4000 + 2500) / 2
    front, rear = np.array([1, -1.2, -1, 0]), np.array([1, 1.4, 0, -1])
    np.testing.assert_allclose(linear.damping, 3250 * np.outer(front, front) + 1500 * np.outer(rear, rear))
    np.testing.assert_allclose(linear.outputs[0].acceleration_factors, [1, -0.2, 0, 0])
    np.testing.assert_allclose(linear.outputs[1].displacement_factors, -front)  # positive in compression
    np.testing.assert_allclose(linear.outputs[2].displacement_factors, [0, 0, -190e3, 0])
    np.testing.assert_allclose(linear.outputs[2].road_factors, [190e3, 0])


@pytest.mark.grounds("closed form")
def test_every_table_is_built():
    vehicle = built(FULL)
    springs = {spring.name: spring for spring in vehicle.springs}
    assert list(springs) == ["sl", "sr", "tilted", "stop", "mount.x", "mount.y", "mount.z", "driver"]
    assert springs["mount.y"].damping == 2 and springs["mount.y"].axis == (0, 1, 0)
    # from the second point to the first, so that travel is positive in compression
    np.testing.assert_allclose(springs["tilted"].axis, np.array([0, -0.2, 0.4]) / np.hypot(0.2, 0.4))
    assert springs["stop"].axis == (0, 0, 1)
    assert vehicle.bodies[0].inertia == ((300, 0, -10), (0, 1100, 0), (-10, 0, 1200))
    assert vehicle.tyres[3].point == (-1.4, -0.6, 0.31)
    (side,) = vehicle.side_forces
    assert (side.body, side.point, side.roll_steer) == ("body", (1.2, 0.7, 0.0), 0.05)
    assert vehicle.bars[0].track == 1.4
    bar, seat, tyre = vehicle.bars[0], springs["driver"], vehicle.tyres[1]
    assert (bar.stiffness, bar.damping, bar.point_left, bar.point_right) == (
        5e3,
        0,
        (1.2, 0.7, 0.31),
        (1.2, -0.7, 0.31),
    )
    assert (seat.stiffness, seat.damping, seat.first_point, seat.second_point) == (1e4, 500, *[(0, 0.3, 0.6)] * 2)
    assert (tyre.stiffness, tyre.damping, tyre.point) == (190e3, 10, (1.2, -0.7, 0.31))
    assert vehicle.drags[0].coefficient == 0.5
    assert vehicle.outputs[1].axis == (1, 0, 0)
    assert linearise(vehicle, 10.0).stiffness.shape == (12, 12)


def test_a_direction_of_its_own_beside_two_points():
    vehicle = built(FULL.replace("stiffness = 3e4 }", "stiffness = 3e4, direction = [0, 0, 1] }"))
    (tilted,) = (spring for spring in vehicle.springs if spring.name == "tilted")
    assert tilted.axis == (0, 0, 1) and tilted.second_point == (-1.4, 0.5, 0.3)


def test_children_may_come_before_their_parents():
    table = tomllib.loads(FULL)
    table["bodies"].append(table["bodies"].pop(0))
    assert [body.name for body in build_vehicle(table, "f").bodies][:3] == ["rear", "engine", "body"]


@pytest.mark.parametrize("name", shipped_vehicles())
def test_shipped_vehicles_name_their_sources(name):
    load_vehicle(name, allows_towing=True)
    table = parse_toml(SHIPPED_FOLDER / f"{name}.toml")
    entries = [entry for key, value in table.items() if isinstance(value, list) and key != "outputs" for entry in value]
    assert all("published" in entry["source"] or "chosen" in entry["source"] for entry in entries)


def test_shipped_vehicles():
    assert shipped_vehicles() == (
        "half_car",
        "quarter_car",
        "quarter_car_nonlinear",
        "r19_caravan",
        "r19_free",
        "r19_ride",
        "race_car",
        "seven_freedoms",
        "three_axle_truck",
    )
    sizes = [len(load_vehicle(name, allows_towing=True).coordinates()) for name in shipped_vehicles()]
    assert sizes == [4, 2, 2, 24, 19, 19, 14, 7, 13]


def test_a_file_of_ones_own(tmp_path):
    (tmp_path / "mine.toml").write_text(EXAMPLE)
    assert load_vehicle("mine.toml", tmp_path).name == "mine.toml"
    with pytest.raises(
        InputError, match=r"scene.toml: vehicle.file = 'mind.toml': no such file.*did you mean 'mine.toml'"
    ):
        load_vehicle("mind.toml", tmp_path, "scene.toml", "vehicle.file")
    with pytest.raises(InputError, match=r"vehicle.file = 'r19_rid': no such vehicle.*did you mean 'r19_ride'"):
        load_vehicle("r19_rid", tmp_path, "scene.toml", "vehicle.file")


BAD = {
    "no mass": ("mass = 700, ", "", "car.toml: bodies[body].mass: is missing (mass, in kg)"),
    "negative mass": ("mass = 700", "mass = -700", "bodies[body].mass = -700: must be above 0"),
    "mass 0": ("mass = 90", "mass = 0", "bodies[engine].mass = 0: must be above 0"),
    "mass as text": ("mass = 90", "mass = '90 kg'", "bodies[engine].mass = '90 kg': must be a number"),
    "mass not a number": ("mass = 90", "mass = nan", "bodies[engine].mass = nan: must be a finite number"),
    "unknown key": ("mass = 90", "weight = 90, mass = 90", "bodies[engine].weight = 90: unknown key"),
    "misspelt key": ("mass = 90", "masss = 90", "did you mean 'mass'?"),
    "unknown table": ("title =", "wheels = []\ntitle =", "car.toml: wheels = []: unknown key"),
    "unknown freedom": (
        '["z", "rx"]',
        '["z", "roll"]',
        "bodies[rear].freedoms.1 = 'roll': must be x or y or z or rx or ry or rz",
    ),
    "freedom twice": ('["z", "rx"]', '["z", "z"]', "bodies[rear].freedoms = ['z', 'z']: a freedom is named twice"),
    "no freedom": (
        'inertia = [20, 0, 20], freedoms = ["z", "rx"]',
        "freedoms = []",
        "bodies[rear].freedoms = []: a body that rides on no other",
    ),
    "position of two": (
        "position = [1, 0, 0.5]",
        "position = [1, 0]",
        "bodies[engine].position = [1, 0]: must hold at least 3",
    ),
    "position of four": ("position = [1, 0, 0.5]", "position = [1, 0, 1, 1]", "must hold at most 3"),
    "negative inertia": ("[300, 1100, 1200]", "[300, -1, 1200]", "bodies[body].inertia.1 = -1: must be 0 or more"),
    "indefinite inertia": ("[0, -10, 0]", "[0, 700, 0]", "bodies[body].inertia = [[300.0, 0.0, 700.0]"),
    "roll without inertia": (
        "inertia = [20, 0, 20], ",
        "",
        "bodies[rear].inertia: nothing inert moves with the freedom rx",
    ),
    "unknown parent": (
        'parent = "body" },\n  { name = "right"',
        'parent = "boddy" },\n  { name = "right"',
        "bodies[left].parent = 'boddy': no such body (allowed: body, engine, left, rear, right); did you mean 'body'?",
    ),
    "parents in a ring": (
        '"rz"] }',
        '"rz"], parent = "left" }',
        "bodies[body].parent = 'left': bodies ride on one another",
    ),
    "two of a name": (
        'name = "right", mass',
        'name = "left", mass',
        "bodies[left].name = 'left': two entries have this name",
    ),
    "a body called ground": (
        'name = "engine", mass',
        'name = "ground", mass',
        "bodies[ground].name = 'ground': this name means the ground",
    ),
    "empty name": ('name = "engine", mass', 'name = "", mass', "bodies[4].name = '': must not be empty"),
    "two springs of a name": ('name = "sr"', 'name = "sl"', "[sl].name = 'sl': two entries have this name"),
    "seat named as a spring": ('name = "tilted"', 'name = "driver"', "[driver].name = 'driver': two entries"),
    "axle behind axle": (
        '{ name = "rear", x = -1.4 }',
        '{ name = "rear", x = 1.6 }',
        "axles[rear].x = 1.6: axles are listed from the front: must lie behind 'front', below 1.2 m",
    ),
    "axles at one place": (
        '{ name = "rear", x = -1.4 }',
        '{ name = "rear", x = 1.2 }',
        "axles[rear].x = 1.2: axles are listed",
    ),
    "axle without tyre": (
        '{ name = "rear", x = -1.4 }',
        '{ name = "rear", x = -1.4 }, { name = "third", x = -2 }',
        "axles[third]: no tyre names this axle",
    ),
    "wheel on no axle": (
        '"fl", axle = "front"',
        '"fl", axle = "frond"',
        "tyres[fl].axle = 'frond': no such axle (allowed: front, rear); did you mean 'front'?",
    ),
    "tyre without axle": ('"fl", axle = "front", ', '"fl", ', "tyres[fl].axle: is missing"),
    "tyre beside its axle": (
        '"fl", axle = "front", body = "left"',
        '"fl", axle = "front", body = "rear"',
        "tyres[fl].axle = 'front': its body lies at x = -1.4 m, its axle 'front' at 1.2 m",
    ),
    "tyre on unknown body": ('body = "left"', 'body = "lefd"', "tyres[fl].body = 'lefd': no such body"),
    "tyre that cannot rise": (
        'freedoms = ["z", "rx"] }',
        'freedoms = ["x"] }',
        "tyres[rl].body = 'rear': this body cannot move up and down",
    ),
    "tyre stiffness 0": (
        "stiffness = 190e3, damping = 10",
        "stiffness = 0, damping = 10",
        "tyres[fr].stiffness = 0: must be above 0",
    ),
    "negative damper": (
        '2e4, damping = 1e3 },\n  { name = "tilted',
        '2e4, damping = -1 },\n  { name = "tilted',
        "springs[sr].damping = -1: must be 0 or more",
    ),
    "unknown body of a spring": ('["body", "left"]', '["body", "lefft"]', "springs[sl].bodies = 'lefft': no such body"),
    "spring to itself": (
        '["body", "left"]',
        '["left", "left"]',
        "springs[sl].bodies = ['left', 'left']: connects a body with itself",
    ),
    "ground first": (
        '["body", "left"]',
        '["ground", "left"]',
        "springs[sl].bodies = ['ground', 'left']: name the ground second",
    ),
    "three bodies": ('["body", "left"]', '["body", "left", "right"]', "springs[sl].bodies"),
    "no point": ("point = [1.2, 0.7, 0.31], ", "", "springs[sl].point: give either point"),
    "zero direction": (
        "direction = [0, 0, 2]",
        "direction = [0, 0, 0]",
        "springs[stop].direction = [0.0, 0.0, 0.0]: a direction needs a length",
    ),
    "spring of nothing": (
        'stiffness = 2e4, damping = 1e3 },\n  { name = "sr',
        'stiffness = 0 },\n  { name = "sr',
        "springs[sl].stiffness: is missing",
    ),
    "mount of nothing": (
        "[1e5, 1e5, 2e5], damping = [1, 2, 3]",
        "[0, 0, 0]",
        "mounts[mount].stiffness = [0.0, 0.0, 0.0]: has neither",
    ),
    "curve that falls back": (
        "at = [-1, 0, 1]",
        "at = [-1, 1, 0]",
        "springs[stop].travel_force.at = [-1.0, 1.0, 0.0]: must rise",
    ),
    "curve of two lengths": (
        "at = [-1, 0, 1]",
        "at = [-1, 1]",
        "springs[stop].travel_force.force = [-30000.0, 0.0, 30000.0]: must hold as many",
    ),
    "curve beside the origin": (
        "force = [-3e4, 0, 3e4]",
        "force = [-3e4, 1e3, 3e4]",
        "springs[stop].travel_force.force = 1000.0: must be 0 N at 0",
    ),
    "bar on a body that cannot roll": (
        '"y", "z", "rx", "ry", "rz"',
        '"y", "z", "ry", "rz"',
        "anti_roll_bars[bar].body = 'body': needs a body with the freedom rx",
    ),
    "bar of unknown tyre": ('["fl", "fr"]', '["fl", "left"]', "anti_roll_bars[bar].tyres = 'left': no such tyre"),
    "bar the wrong way round": ('["fl", "fr"]', '["fr", "fl"]', "must be the left and the right tyre of one axle"),
    "bar across axles": ('["fl", "fr"]', '["fl", "rr"]', "must be the left and the right tyre of one axle"),
    "no chassis": ('chassis = "body"', "", "chassis: is missing: tyre 'fl' has a side force"),
    "unknown chassis": ('chassis = "body"', 'chassis = "boddy"', "chassis = 'boddy': no such body"),
    "roll steer of nothing": (", cornering = 5e4", "", "axles[front].roll_steer = 0.05: steers nothing"),
    "side force on a wheel that slides": (
        '{ name = "left", mass = 38, position = [1.2, 0.7, 0.31], freedoms = ["z"]',
        '{ name = "left", mass = 38, position = [1.2, 0.7, 0.31], freedoms = ["z", "y"]',
        "tyres[fl].cornering = 50000.0: its side force acts on the chassis",
    ),
    "drag on unknown body": ('drag = { body = "body"', 'drag = { body = "bodi"', "drag.body = 'bodi': no such body"),
    "output on unknown body": (
        'body = "driver" }',
        'body = "diver" }',
        "outputs[driver].body = 'diver': no such body (allowed: body, driver, engine, left, rear, right); did you mean 'driver'?",
    ),
    "output of unknown part": ('"mount.z"', '"mount"', "outputs[mount].part = 'mount': no such part"),
    "output of unknown tyre": ('tyre = "rl"', 'tyre = "lr"', "outputs[load].tyre = 'lr': no such tyre"),
    "output of unknown kind": ('kind = "force"', 'kind = "fource"', "outputs[mount].kind = 'fource': must be"),
    "output of nothing": (
        'kind = "force", part = "mount.z"',
        'kind = "force"',
        "outputs[mount].part: is missing: force is read of a part",
    ),
    "output of the wrong thing": (
        'kind = "force", part = "mount.z"',
        'kind = "force", body = "body"',
        "outputs[mount].body = 'body': force is read of a part",
    ),
    "output about no axis": (
        "direction = [3, 0, 0]",
        "direction = [0, 0, 0]",
        "outputs[roll].direction = [0.0, 0.0, 0.0]: a direction needs a length",
    ),
    "outputs of a name": ('name = "load"', 'name = "roll"', "outputs[roll].name = 'roll': two entries"),
    "unconnected body": (
        'bodies = ["engine", "body"]',
        'bodies = ["rear", "body"]',
        "bodies[engine]: unconnected: no spring, mount, seat or tyre leads",
    ),
    "unconnected child": (
        'freedoms = ["x", "z"] }',
        'freedoms = ["x", "z"] },\n { name = "fan", mass = 1, position = [1, 0, 0], freedoms = ["y"], parent = "engine" }',
        "bodies[fan]: unconnected",
    ),
    "two that float": (
        'freedoms = ["x", "z"] }',
        'freedoms = ["x", "z"] },\n { name = "bird", mass = 1, position = [1, 0, 0], freedoms = ["z"] }',
        "bodies[bird]: unconnected",
    ),
    "no outputs": ("outputs = [", "outputs = []\nnotes = '''", "outputs = []: must hold at least 1"),
    "not a list": ("drag = {", "drag = 3 #", "drag = 3: must be a table"),
}
"""What is replaced in FULL, by what, and words of the message."""


@pytest.mark.parametrize("fault", BAD)
def test_bad_files_are_told_by_their_entry(fault):
    old, new, words = BAD[fault]
    assert FULL.count(old) == 1
    text = FULL.replace(old, new)
    if fault == "no outputs":
        text += "'''"
    with pytest.raises(InputError) as error:
        built(text)
    assert words in str(error.value)
    assert str(error.value).startswith("car.toml")


def test_two_bodies_that_only_hold_one_another():
    bird = 'freedoms = ["x", "z"] },\n { name = "bird", mass = 1, position = [1, 0, 0], freedoms = ["z"] }'
    text = FULL.replace('freedoms = ["x", "z"] }', bird).replace('["engine", "body"]', '["engine", "bird"]')
    with pytest.raises(InputError, match=r"bodies\[engine\]: unconnected"):
        built(text)


def test_side_force_on_a_chassis_that_cannot_move_sideways():
    text = EXAMPLE.replace("stiffness = 190e3, source", "stiffness = 190e3, cornering = 5e4, source", 1)
    with pytest.raises(
        InputError, match=r"tyres\[front\].cornering = 50000.0: side force on a chassis that cannot move"
    ):
        built(text.replace("bodies =", 'chassis = "body"\nbodies =', 1))
