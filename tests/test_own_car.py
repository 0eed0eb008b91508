"""A car in MJCF as the vehicle of scenes: read, held to MuJoCo's own model of the file, driven in both engines."""

import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from models.brake.sprung import suspended_vehicle
from models.core.errors import InputError, Refused
from models.core.systems import load
from models.engines.braking_sprung_plain import PlainSprungVehicle
from models.engines.export import ExportSubject
from models.engines.spatial_protocol import build as build_spatial
from models.multibody.numbers import Controls, Handling
from models.multibody.plain.rolling import PlainRolling
from models.multibody.plain.statics import preloads_at_rest
from models.own_model.car import vehicle_of_file
from models.systems.braking import plan as braking_plan
from models.systems.handling import plan as handling_plan
from models.systems.handling.assumptions import assumptions
from models.systems.handling.energy import unaccounted_energy
from models.systems.handling.export import export_handling
from models.systems.handling.run import REFERENCE_ENGINE, build_in_engine, drive_run
from models.systems.ride.run import run as run_ride
from models.tyre.magic_formula import table_of_surface
from models.vehicles.cut_vehicle import cut_at_hubs
from models.vehicles.free_vehicle import CARRIER
from models.vehicles.spatial import JointElement, SpatialVehicle
from models.vehicles.spatial_linear import linearise
from models.vehicles.vehicle_file import build_vehicle, load_vehicle
from validation.braking.sprung_box import braked_vehicle, steady_torques
from validation.own_model.car_energy import largest_energy_difference
from validation.own_model.cars import SALOON

ROOT = Path(__file__).parents[1]
LANE_CHANGE = Controls(steer=((0.1, 0.0), (0.4, 0.04), (0.9, -0.04), (1.2, 0.0)))


def read(folder: Path, text: str = SALOON, name: str = "saloon.xml") -> SpatialVehicle:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return vehicle_of_file(path)


@pytest.fixture(scope="module")
def saloon(tmp_path_factory: pytest.TempPathFactory) -> SpatialVehicle:
    return read(tmp_path_factory.mktemp("saloon"))


@pytest.fixture(scope="module")
def drives(saloon):
    handling = Handling(saloon, controls=LANE_CHANGE)
    return {engine: drive_run(engine, handling, 22.0, 1.5) for engine in ("exudyn", "mujoco")}


def test_parts_of_the_file_are_those_of_the_vehicle(saloon):
    """Wheels are one with what they spin in, tendons and joints act along the suspension."""
    assert saloon.coordinates()[6:] == (
        ("fl strut", "z"),
        ("fr strut", "z"),
        ("rl arm joint 1", "ry"),
        ("rr arm joint 1", "ry"),
        ("engine joint 1", "rx"),
        ("engine", "z"),
    )
    assert sum(body.mass for body in saloon.bodies) == pytest.approx(1150 + 2 * 36 + 2 * 29 + 140, rel=1e-12)
    assert [(tyre.name, tyre.axle, tyre.spin_inertia) for tyre in saloon.tyres] == [
        ("fl", 0, 1.1),
        ("fr", 0, 1.1),
        ("rl", 1, 1.2),
        ("rr", 1, 1.2),
    ]
    assert {place: (low, high) for place, low, high in saloon.ranges}["fl strut", "z"] == (-0.09, 0.1)
    assert "steering" in saloon.notes[0] and "contacts" in saloon.notes[0] and "equality 'rack'" in saloon.notes[0]


def test_the_car_has_the_energy_of_the_file_as_mujoco_parsed_it(saloon):
    """Equal energies at all states are equal equations of motion; a rotor weighs 1e-9 kg more."""
    handling = Handling(saloon)
    assert largest_energy_difference(handling, 20) < 1e-11
    arm = handling.vehicle.body("rl arm")
    bodies = tuple(replace(b, mass=b.mass + 1e-3) if b is arm else b for b in handling.vehicle.bodies)
    object.__setattr__(handling, "vehicle", replace(handling.vehicle, bodies=bodies))
    assert largest_energy_difference(handling, 20) > 1e-7  # the fault: a gram


def test_it_drives_a_lane_change_in_both_engines(drives):
    """Same tableau, same step: rounding. It does change the lane."""
    exudyn, other = drives.values()
    assert np.abs(exudyn.run.states - other.run.states).max() < 1e-10 * np.abs(other.run.states).max()
    assert np.abs(exudyn["fy"] - other["fy"]).max() < 1e-10 * np.abs(other["fy"]).max()
    assert np.abs(other["fy"]).max() > 1500.0
    assert np.ptp(other.path[:, 1]) > 0.5
    assert np.abs(unaccounted_energy(other)).max() < 1e-5 * np.ptp(other.ledger[:, 0])


def test_engines_accelerate_it_as_the_plain_equations_do(saloon, drives):
    """These share no force with them; and they notice a lost damper."""
    handling, run = Handling(saloon, controls=LANE_CHANGE), drives["mujoco"].run
    models = {engine: build_in_engine(engine, handling) for engine in ("exudyn", "mujoco", REFERENCE_ENGINE)}
    for row in (300, 700, 1100):
        state = run.positions[row] + 0.01, run.rates[row] + 0.05
        exudyn, other, plain = (models[engine].acceleration(run.times[row], *state) for engine in models)
        assert np.abs(exudyn - plain).max() < 1e-10 * np.abs(plain).max()
        assert np.abs(other - plain).max() < 1e-10 * np.abs(plain).max()
    lost = replace(saloon, joint_elements=saloon.joint_elements[:-1])
    assert np.abs(PlainRolling(Handling(lost)).acceleration(run.times[row], *state) - plain).max() > 0.1


def test_loads_at_rest_are_those_of_the_plain_statics(saloon):
    handling = Handling(saloon)
    held, loads = preloads_at_rest(handling.vehicle, CARRIER)
    assert loads == pytest.approx(list(handling.held.tyres.values()), rel=1e-10)
    assert held == pytest.approx([handling.held.parts[e.name] for e in saloon.joint_elements], rel=1e-9, abs=1e-6)
    assert sum(loads) == pytest.approx(9.81 * sum(body.mass for body in saloon.bodies), rel=1e-9)


WRONG = {
    "no site": (r'<site name="(tyre|hub).*?/>', "", "no site is named as a tyre or a hub"),
    "partner": (r'<site name="hub_rr".*?/>', "", r"hub_rl.*its partner is missing"),
    "three wheels": (r'<site name="driver"', '<site name="tyre five" user="1e5" pos="1.2 .2 0"/>\\g<0>', "3 wheels"),
    "between axles": (
        r'<site name="driver"',
        '<site name="tyre five" user="1e5" pos="1.25 0 0"/>\\g<0>',
        "0.2 m apart",
    ),
    "same name": ("hub_rr", "tyre rl", "two sites have this name"),
    "no stiffness": ('user="190000 150 62000"', "", "stiffness in N/m above 0"),
    "negative": ('user="190000 150 62000"', 'user="190000 -1 62000"', "damping in N s/m"),
    "below the road": ('pos="0 0 .55"><freejoint', 'pos="0 0 .2"><freejoint', "above the road, z = 0"),
    "in the world": ("<worldbody>", '<worldbody><site name="tyre x" user="1e5" pos="0 0 1"/>', "lies in the world"),
    "no free joint": ('<freejoint name="root"/>', "", "the chassis must be free|one tree"),
    "planar": ('<freejoint name="root"/>', '<joint name="root" type="slide"/>', "the chassis must be free"),
    "trailer": (
        "</worldbody>",
        '<body><freejoint/><inertial pos="0 0 1" mass="1" diaginertia="1 1 1"/></body></worldbody>',
        "one tree",
    ),
    "oblique": (
        'name="fl travel" type="slide" axis="0 0 1"',
        'name="fl travel" type="slide" axis="0 .1 1"',
        r"joint 'fl travel' \(saloon.xml:\d+\)",
    ),
    "ball": (
        'name="engine roll" axis="1 0 0" stiffness="60000" damping="400"',
        'name="engine roll" type="ball"',
        "no hinge or slide",
    ),
    "unbalanced": ('mass="18" diaginertia=".6 1.2 .6"', 'mass="18" diaginertia=".6 1.2 .7"', "one of revolution"),
    "off centre": ('<inertial pos="0 0 0" mass="18"', '<inertial pos=".01 0 0" mass="18"', "0.01 m off"),
    "bearing": ('name="fl spin" axis="0 1 0"', 'name="fl spin" axis="0 1 0" damping=".1"', "damping.*must be 0"),
    "kingpin": (
        'name="fl steer" axis="0 0 1"',
        'name="fl steer" axis="0 0 1" pos=".02 0 0"',
        "0.02: m beside the centre",
    ),
    "rear steer": ('name="rl swing" axis="0 -1 0"', 'name="rl swing" axis="0 0 1"', "only wheels of the front axle"),
    "friction loss": ('name="fl travel"', 'name="fl travel" frictionloss="50"', "friction_loss: joint 'fl travel'"),
    "connect": (
        "<equality>",
        '<equality><connect body1="fl strut" body2="body" anchor="0 0 0"/>',
        "equality.*cannot have it",
    ),
    "gravity": ("0 0 -9.81", "1 0 -9.81", "z is up"),
    "muscle": ("<actuator>", '<actuator><muscle joint="fl travel" lengthrange="0 1"/>', "actuator"),
    "mixed tendon": ('joint="fl travel" coef', 'joint="fl steer" coef', "which twinrig moves, and along others"),
    "compensated": ('<body name="engine"', '<body name="engine" gravcomp="1"', "a vehicle has its weight"),
    "line": (
        "<tendon>",
        '<tendon><spatial name="rope" stiffness="1"><site site="driver"/><site site="hub_rr"/></spatial>',
        "rope.*springs of a car act along joints",
    ),
    "jet": (
        "<actuator>",
        '<actuator><general name="jet" site="driver" biastype="affine" biasprm="5 0 0"/>',
        "jet.*actuators of a car act along joints",
    ),
    "massless": ("<worldbody>", '<worldbody><body name="loose"><joint/></body>', "parser refuses it"),
}


@pytest.mark.parametrize("fault", WRONG)
def test_what_is_no_car_of_a_scene_is_refused_by_name(tmp_path, fault):
    pattern, instead, said = WRONG[fault]
    text = re.sub(pattern, instead, SALOON, flags=re.DOTALL, count=0 if fault == "no site" else 1)
    assert text != SALOON
    with pytest.raises(InputError, match=said) as told:
        read(tmp_path, text)
    assert "saloon.xml" in str(told.value)


def exported(handling: Handling) -> str:
    """A car as ``twinrig export`` writes it, with the sites that its user adds."""
    text = export_handling("mujoco", handling, ExportSubject("car", "car.toml", ""), []).text
    for tyre in handling.given.tyres:
        cornering = next(side.stiffness for side in handling.given.side_forces if side.name == tyre.name)
        site = f'<site name="tyre {tyre.name}" user="{tyre.stiffness} {tyre.damping} {cornering}"/>'
        text = re.sub(f'(<body name="{tyre.name} rotor".*?>)', f"\\1{site}", text)
    return text


def test_a_car_that_twinrig_exported_is_the_same_car_again(tmp_path):
    """19 coordinates of r19_free, on springs along them: what MJCF can say of them. Its chassis gets an inertia that a
    distribution of mass has: MuJoCo takes no other."""
    whole = load_vehicle("r19_free")
    bodies = tuple(
        replace(b, inertia=((200, 0, -10), (0, 1390, 0), (-10, 0, 1500))) if b.name == "body" else b
        for b in whole.bodies
    )
    along = {"z": (25e3, 1800.0), "x": (3e5, 900.0), "rx": (6e4, 300.0), "ry": (6e4, 300.0)}
    elements = tuple(
        JointElement(f"{body} {freedom}", ((body, freedom),), (1.0,), *along[freedom])
        for body, freedom in whole.coordinates()
        if body != "body"
    )
    bar = JointElement("bar", (("fl", "z"), ("fr", "z")), (1.0, -1.0), 5000.0)
    given = replace(whole, bodies=bodies, springs=(), bars=(), drags=(), joint_elements=(*elements, bar))
    before = Handling(given, controls=LANE_CHANGE)
    after = Handling(read(tmp_path, exported(before), "export.xml"), controls=LANE_CHANGE)
    assert len(after.vehicle.coordinates()) == len(before.vehicle.coordinates()) == 23
    assert list(after.held.tyres.values()) == pytest.approx(list(before.held.tyres.values()), rel=1e-9)
    places = before.vehicle.coordinates()
    order = [
        places.index((body.removesuffix(" rotor of the file"), *rest)) for body, *rest in after.vehicle.coordinates()
    ]
    draw, (q, v) = np.random.default_rng(3), before.straight(20.0)
    q, v = q + draw.uniform(-0.02, 0.02, len(q)), v + draw.uniform(-0.2, 0.2, len(v))
    first, second = (build_in_engine("mujoco", car) for car in (before, after))
    accelerations = first.acceleration(0.5, q, v)[order]
    apart = second.acceleration(0.5, q[order], v[order]) - accelerations
    assert np.abs(apart).max() < 1e-10 * np.abs(accelerations).max()


STRUTS = """<mujoco><compiler angle="radian"/><worldbody><body name="body" pos="0 0 .6"><freejoint/>
 <inertial pos="0 0 0" mass="900" diaginertia="300 1400 1500"/>
 {}</body></worldbody>
<tendon>{}<fixed name="bar" stiffness="2500">
 <joint joint="fl z" coef="1"/><joint joint="fr z" coef="-1"/></fixed></tendon>
</mujoco>"""
STRUT = """<body name="{0}" pos="{1} {2} -.28"><joint name="{0} x" type="slide" axis="1 0 0"/>
 <joint name="{0} z" type="slide" axis="0 0 -1"/><inertial pos="0 0 0" mass="32" diaginertia=".5 .7 .5"/>
 <site name="tyre {0}" user="160000 100 60000"/></body>"""
OBLIQUE = """<fixed name="{0} {1}" stiffness="{2}" damping="{3}">
 <joint joint="{0} x" coef="{4}"/><joint joint="{0} z" coef="{5}"/></fixed>"""
PLACES = {"fl": (1.2, 0.7), "fr": (1.2, -0.7), "rl": (-1.4, 0.69), "rr": (-1.4, -0.69)}
LAWS = {"strut": (24e3, 1800.0, -0.06, 0.998), "bush": (3e5, 900.0, 0.998, 0.06)}


FILE = """title = "struts"
chassis = "body"
axles = [{name = "f", x = 1.2}, {name = "r", x = -1.4}]
outputs = [{name = "heave", kind = "acceleration", body = "body"}]
[[bodies]]
name = "body"
mass = 900.0
position = [0.0, 0.0, 0.6]
inertia = [300.0, 1400.0, 1500.0]
freedoms = ["x", "y", "z", "rx", "ry", "rz"]
[[anti_roll_bars]]
name = "bar"
body = "body"
tyres = ["fl", "fr"]
stiffness = 4900.0
"""
CORNER = """[[bodies]]
name = "{0}"
mass = 32.0
position = [{1}, {2}, 0.32]
parent = "body"
inertia = [0.5, 0.7, 0.5]
freedoms = ["x", "z"]
[[tyres]]
name = "{0}"
body = "{0}"
axle = "{3}"
stiffness = 160e3
damping = 100.0
cornering = 60e3
"""
SPRING = """[[springs]]
name = "{0} {1}"
bodies = ["body", "{0}"]
point = [{2}, {3}, 0.32]
direction = [{4}, 0.0, {5}]
stiffness = {6}
damping = {7}
"""


def twice_written() -> tuple[str, str]:
    """One car in MJCF, its slides along -z, and as a vehicle file; a tendon's coefficients need not be of length 1, and
    its stiffness is a bar's by the square of the track."""
    bodies = "".join(STRUT.format(name, *place) for name, place in PLACES.items())
    tendons, text = "", FILE
    for name, (x, y) in PLACES.items():
        text += CORNER.format(name, x, y, name[0])
        for law, (k, c, ahead, up) in LAWS.items():
            tendons += OBLIQUE.format(name, law, k, c, ahead, -up)
            size = ahead**2 + up**2
            text += SPRING.format(name, law, x, y, ahead, up, k * size, c * size)
    return STRUTS.format(bodies, tendons), text


def test_a_car_in_mjcf_is_that_of_a_vehicle_file(tmp_path):
    """The linear vehicles under weight, and what hub forces cut; to rounding."""
    mjcf, toml = twice_written()
    of_mjcf, of_toml = read(tmp_path, mjcf), build_vehicle(tomllib.loads(toml), "car.toml")
    for first, second in ((of_mjcf, of_toml), (cut_at_hubs(of_mjcf, "body").uncut, cut_at_hubs(of_toml, "body").uncut)):
        one, other = (linearise(replace(each, gravity=9.81).in_frame("body"), 20.0) for each in (first, second))
        for name in ("mass", "damping", "stiffness", "road_stiffness"):
            left, right = getattr(one, name), getattr(other, name)
            assert np.abs(left - right).max() < 1e-11 * np.abs(right).max(), name


def test_springs_on_hinges_are_refused_where_springs_lie_between_points(saloon):
    with pytest.raises(InputError, match="joint 'rl swing': is neither along slides of one body"):
        cut_at_hubs(saloon, "body")
    with pytest.raises(Refused, match="joint 'fl travel' acts along coordinates"):
        build_spatial("mujoco", saloon)


def test_it_brakes_in_both_engines_as_the_plain_equations_do(saloon):
    """To rounding where the wheels' forces are held over the same steps; its wheels spin with the file's inertia."""
    own = suspended_vehicle(saloon, 0.0)
    assert (own.plane.front.spin_inertia, own.plane.rear.spin_inertia) == (1.1, 1.2)
    torques = steady_torques(500.0, 500.0, 200.0, 200.0)
    in_engines = [braked_vehicle(own, table_of_surface("wet"), engine, 0.05, 1e-3) for engine in ("exudyn", "mujoco")]
    cars = (*in_engines, replace(in_engines[0], engine=PlainSprungVehicle(own)))
    exudyn, mujoco, plain = (each.run(torques, 6.0, 0.1).states[-1] for each in cars)
    assert mujoco == pytest.approx(exudyn, abs=1e-10)
    assert plain == pytest.approx(exudyn, abs=1e-10)
    assert exudyn[1, 0] < 5.9  # m/s
    lost = replace(saloon, joint_elements=saloon.joint_elements[:-1])
    without = (
        braked_vehicle(suspended_vehicle(lost, 0.0), table_of_surface("wet"), "mujoco", 0.05, 1e-3)
        .run(torques, 6.0, 0.1)
        .states[-1]
    )
    assert np.abs(without - exudyn).max() > 1e-4  # the fault: no rear bar
    with pytest.raises(InputError, match="of its spin must be above 0"):
        suspended_vehicle(replace(saloon, tyres=(replace(saloon.tyres[0], spin_inertia=1.3), *saloon.tyres[1:])), 0.0)


def blocks(page: Path) -> dict[str, str]:
    """Files that a page of the documentation has its reader save."""
    return dict(re.findall(r"<!-- file: (\S+) -->\n```\w+\n(.*?)```", page.read_text(), re.DOTALL))


RIDE = """title = "r"
system = "ride"
vehicle = { file = "my_car.xml" }
road = { iso8608 = "B" }
speeds = { start = 20.0, stop = 25.0, count = 2 }
"""
HUBS = """title = "h"
system = "hub-forces"
vehicle = { file = "my_car.xml", chassis = "body" }
forces = { sampling_rate = 100.0 }
road = { iso8608 = "B" }
run = { duration = 1.0 }
"""
STOP = """title = "b"
system = "braking"
vehicle = { file = "my_car.xml" }
road = { stretches = [{ left = "wet" }] }
brakes = { front = { gradient = 300.0 }, rear = { gradient = 100.0 }, supply = 2.0 }
procedures = { straight = { speed = 3.0 } }
"""


def test_scenes_take_the_car_of_the_documentation(tmp_path):
    """Handling says what was left out, ride reads named sites, hub forces have its springs by name."""
    for name, text in blocks(ROOT / "docs" / "how-to" / "own_vehicle.md").items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "ride.toml").write_text(RIDE)
    (tmp_path / "hubs.toml").write_text(HUBS)
    (tmp_path / "stop.toml").write_text(STOP)
    handling = load(tmp_path / "my_lane_change.toml")
    plan = handling_plan.describe(handling)
    assert "read               tyres, steering, brakes and drive are twinrig's; not built: joint 'fl spin'" in plan
    assert "mujoco: bodies and 14 joints, 5 of 5 springs and 0 bars" in plan
    assert not handling_plan.findings(handling)
    ride = run_ride(load(tmp_path / "ride.toml"))
    assert {"driver", "travel joint 'fl travel'", "tyre force rr"} <= set(ride.data["output"].values)
    assert (ride.data["deviation"] > 0.0).all()
    assert re.search(r"\n  read +tyres, steering", braking_plan.describe(load(tmp_path / "stop.toml")))
    assert "tendon 'front bar'" in [each.name for each in load(tmp_path / "hubs.toml").cut_vehicle().elements]


def test_a_run_that_passes_a_stop_of_the_file_says_so(saloon):
    handling = Handling(saloon)
    (stop,) = [each for each in assumptions(handling) if each.name == "stops fl strut z"]
    column = handling.vehicle.coordinates().index(("fl strut", "z"))
    positions = np.zeros((3, len(handling.vehicle.coordinates())))
    positions[:, column] = 0.0, 0.08, 0.11
    watched = stop.watched_values({"positions": positions})["fl strut z"]
    assert (stop.lower_limit, stop.upper_limit, stop.unit) == (-0.09, 0.1, "m")
    assert [not stop.lower_limit <= value <= stop.upper_limit for value in watched] == [False, False, True]
