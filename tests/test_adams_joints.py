"""Single joints from model files: engines against constraints with multipliers, closed forms, faults, refusals.

The models are written here, with axes, places and velocities that no default has.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from models.core.errors import InputError, Refused
from validation.adams_joints.constrained import ConstrainedBody
from validation.adams_joints.joint_tree import BodyMotion, joint_tree
from validation.adams_joints.mechanism import read_mechanism
from validation.adams_joints.output_file import OutputFile
from validation.adams_joints.twin_model import as_mjcf, build_differences
from validation.cases import adams_joints

HEAD = """ADAMS/View model name: own
UNITS/
, FORCE = NEWTON
, MASS = KILOGRAM
, LENGTH = METER
, TIME = SECOND
PART/01, GROUND
MARKER/0102, PART = 01
, QP = {ground}
, REULER = {turn}
PART/02, MASS = 3
, CM = 0201, IP = 0.3, 0.2, 0.25, 0.02, -0.01, 0.03
{start}
MARKER/0201, PART = 02
, QP = {centre}
, REULER = 20D, 30D, -40D
MARKER/0202, PART = 02
, QP = {body}
, REULER = {turn_of_body}
ACCGRAV/
, IGRAV = 1.0, KGRAV = -9.80665
"""
SPRING = """SFORCE/1
, TRANSLATIONAL
, I = 0102, J = 0202
, FUNCTION = - 400.0*(dm(0102,0202)-0.8)
, - 3.0*vr(0102,0202)
"""
TORSION = """SFORCE/1
, ROTATIONAL, I = 0102, J = 0202
, FUNCTION = - 0.5*RTOD*(az(0102,0202)-10.0*DTOR)
, - 2.0E-002*RTOD*wz(0102,0202,0202)
"""
PLACES = {"ground": "0.1, -0.2, 0.3", "body": "0.1, -0.2, 0.3", "centre": "0.7, 0.1, 0.2", "start": ""}
TURNS = {"turn": "25D, 70D, 10D", "turn_of_body": "25D, 70D, 10D"}
MODELS = {
    "revolute": "JOINT/1, REVOLUTE, I = 0102, J = 0202\n",
    "torsion": "JOINT/1, REVOLUTE, I = 0102, J = 0202\n" + TORSION,
    "prismatic": "JOINT/1, TRANSLATIONAL, I = 0102, J = 0202\n",
    "cylindrical": "JOINT/1, CYLINDRICAL, I = 0202, J = 0102\n",
    "spherical": "JOINT/1, SPHERICAL, I = 0102, J = 0202\n",
    "universal": "JOINT/1, HOOKE, I = 0102, J = 0202\n",
    "universal, turned round": "JOINT/1, HOOKE, I = 0202, J = 0102\n",
    "distance": "GCON/1, I = 0102, FUNCTION = DM(0202, 0102)-0.5\n",
    "spring": SPRING,
}
OTHER = {"distance": {"body": "0.1, 0.1, 0.7"}, "spring": {"body": "0.1, 0.1, 0.7", "start": ", VX = 0.3, WY = 0.5"}}


@pytest.fixture
def model(tmp_path):
    """Function of name and changes: the mechanism of a text."""

    def read(name, **changes):
        path = tmp_path / "own.adm"
        path.write_text(
            HEAD.format(**PLACES | TURNS | OTHER.get(name, {}) | changes) + MODELS.get(name, name) + "END\n"
        )
        return read_mechanism(path)

    return read


def compared(mechanism, of_engine=None, engine="mujoco", duration=0.4):
    """Largest differences of place (m), rotation and reaction (by the weight) between an engine and the constraints."""
    motion, reaction = ConstrainedBody(mechanism).run(duration, 2e-3, 10)
    path, pushed = joint_tree(of_engine or mechanism, motion).run(engine, duration, 2e-3, 10)
    weight = mechanism.mass * 9.8
    gaps = abs(path.position - motion.position), abs(path.rotation - motion.rotation)
    forces = abs(pushed.force - reaction.force) / weight, abs(pushed.moment - reaction.moment) / weight
    return max(gap.max() for gap in (*gaps, *forces))


@pytest.mark.parametrize("engine", ["mujoco", "exudyn"])
@pytest.mark.parametrize("name", MODELS)
def test_engines_are_the_constraints(model, name, engine):
    """Runge-Kutta's error of 2 ms, 1e-9 at most on joints; the two sides have no coordinates in common.

    The spring turns the body at w = 24 rad/s: (w h)^5 / 120 in each of 200 steps is 4e-7.
    """
    assert compared(model(name), engine=engine) < (4e-7 if name == "spring" else 1e-8)


@pytest.mark.parametrize("name", MODELS)
def test_planted_faults_are_seen(model, name):
    """5 % of the inertia, and gravity along a swapped axis, in the engine alone."""
    mechanism = model(name)
    swapped = replace(mechanism, gravity=mechanism.gravity[[2, 1, 0]])
    assert compared(mechanism, swapped) > 1e-3
    heavy = replace(mechanism, inertia=1.05 * mechanism.inertia)
    if name != "prismatic":  # which does not turn
        assert compared(mechanism, heavy) > 1e-6


def test_swapped_axis_of_a_universal_joint_is_seen(model):
    """x of the first marker and y of the second are the arms of the cross, and not the other way round."""
    one, two = model("universal"), model("universal, turned round")
    assert compared(one, two) > 1e-3


def test_pendulum_on_a_skew_axis(model):
    """Start: angular acceleration g' m a / (I + m a^2), with what of gravity and arm is square to the axis."""
    mechanism = model("revolute")
    axis, arm = mechanism.ground_marker.axes[:, 2], mechanism.centre - mechanism.ground_marker.position
    turning = axis @ np.cross(arm, mechanism.mass * mechanism.gravity)
    inertia = axis @ mechanism.inertia @ axis + mechanism.mass * (arm @ arm - (arm @ axis) ** 2)
    motion, _ = ConstrainedBody(mechanism).run(0.02, 2e-3, 10)
    np.testing.assert_allclose(motion.angular_acceleration[0], turning / inertia * axis, rtol=1e-12, atol=1e-12)


def test_start_velocity(model):
    """A turn about the joint's axis is taken; any other is refused by both."""
    mechanism = model("revolute")
    axis, arm = mechanism.ground_marker.axes[:, 2], mechanism.centre - mechanism.ground_marker.position
    turning = replace(mechanism, angular_velocity=2.0 * axis, velocity=np.cross(2.0 * axis, arm))
    assert compared(turning) < 1e-8
    motion, _ = ConstrainedBody(mechanism).run(0.02, 2e-3, 10)
    broken = replace(mechanism, velocity=np.ones(3))
    with pytest.raises(InputError, match="no velocity that the joint allows"):
        ConstrainedBody(broken).start()
    with pytest.raises(InputError, match="no velocity that the joint allows"):
        joint_tree(broken, motion).start_rates()


def test_energy_is_kept(model):
    """Of a body on a ball: the first integral that no fault of a gyroscopic term leaves alone."""
    mechanism = model("spherical")
    motion, _ = ConstrainedBody(mechanism).run(1.0, 2e-3, 10)
    inertia = motion.rotation @ mechanism.inertia @ np.transpose(motion.rotation, (0, 2, 1))
    kinetic = 0.5 * 3.0 * (motion.velocity**2).sum(axis=1)
    kinetic += 0.5 * np.einsum("mi,mij,mj->m", motion.angular_velocity, inertia, motion.angular_velocity)
    energy = kinetic - 3.0 * motion.position @ mechanism.gravity
    assert np.ptp(energy) < 1e-8 * kinetic.max()


def test_hinges_that_fall_into_one_are_refused(model):
    """A ball that turns by 90 degrees about every axis has no layout of three hinges."""
    mechanism = model("spherical")
    angle = np.linspace(0.0, 2.0 * math.pi, 73)
    turns = [_about(axis, angle) for axis in np.vstack([np.eye(3), joint_tree_axes(mechanism)])]
    turned = np.concatenate(turns)
    nothing = np.zeros((len(turned), 3))
    path = BodyMotion(np.zeros(len(turned)), nothing, nothing, nothing, turned, nothing, nothing)
    with pytest.raises(Refused, match="fall into one"):
        joint_tree(mechanism, path)


def joint_tree_axes(mechanism):
    motion, _ = ConstrainedBody(mechanism).run(0.02, 2e-3, 10)
    return joint_tree(mechanism, motion).axes.T


def _about(axis, angle):
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.array([np.eye(3) + math.sin(a) * cross + (1 - math.cos(a)) * cross @ cross for a in angle])


@pytest.mark.parametrize(
    ("name", "changes", "said"),
    [
        ("JOINT/1, PLANAR, I = 0102, J = 0202\n", {}, "line 22.*PLANAR.*not supported"),
        ("JOINT/1, UNIVERSAL, I = 0102, J = 0202\n", {}, "not supported"),
        ("BEAM/1, I = 0102, J = 0202\n", {}, "line 22.*BEAM.*not supported"),
        ("JOINT/1, REVOLUTE, I = 0102, J = 0999\n", {}, "999.*no marker"),
        ("JOINT/1, REVOLUTE, I = 0201, J = 0202\n", {}, "one of the body"),
        (MODELS["revolute"], {"body": "0.1, -0.2, 0.4"}, "must be assembled"),
        (MODELS["revolute"], {"turn": "0, 0, 0"}, "not parallel"),
        (MODELS["revolute"], {"turn": "0, x, 0"}, "REULER.*finite number"),
        (MODELS["universal"], {"turn": "0, 0, 0"}, "not square"),
        ("GCON/1, I = 0102, FUNCTION = DM(0202, 0102)-2\n", {}, "distance at the start"),
        ("GCON/1, I = 0102, FUNCTION = DX(0202, 0102)-2\n", {}, "only DM"),
        (SPRING.replace("dm(0102,0202)-0.8", "dm(0102,0202)**2"), {}, "straight in travel"),
        (SPRING.replace("- 3.0*vr(0102,0202)", "+ varval(3)"), {}, "varval.*not supported"),
        (TORSION, {}, "no revolute joint has"),
        (MODELS["revolute"] + MODELS["spherical"], {}, "second joint"),
        ("", {"start": ", VM = 0201"}, "VM.*not supported"),
    ],
)
def test_what_is_not_supported_is_refused_by_line(model, name, changes, said):
    with pytest.raises(InputError, match=said):
        model(name, **changes)


def test_units_are_refused(tmp_path):
    path = tmp_path / "own.adm"
    path.write_text("UNITS/\n, LENGTH = MILLIMETER\n")
    with pytest.raises(InputError, match=r"line 1.*MILLIMETER.*only METER"):
        read_mechanism(path)


@pytest.mark.parametrize("name", [name for name in MODELS if name != "distance"])
def test_joints_in_mjcf_move_as_the_constraints_do(model, tmp_path, name):
    """Through the reader of ``twinrig twin``: certified, and on the path of the multipliers; the fault: 1 % more
    weight."""
    mechanism = model(name)
    motion, _ = ConstrainedBody(mechanism).run(0.4, 5e-3, 2)
    accelerations, paths = build_differences(mechanism, tmp_path, 80, 5e-3)
    assert accelerations < 1e-10
    for places in paths.values():
        assert np.abs(places[::2] - motion.position).max() < 1e-6  # steps of 5 ms
    faulty = replace(mechanism, gravity=1.01 * mechanism.gravity)
    _, others = build_differences(faulty, tmp_path, 80, 5e-3)
    assert np.abs(others["exudyn"][::2] - motion.position).max() > 1e-4


def test_a_rod_without_mass_is_no_mjcf(model):
    with pytest.raises(Refused, match="no mass"):
        as_mjcf(model("distance"))


def test_a_ball_swings_as_a_hinge_does_and_a_fault_is_seen(model, monkeypatch, tmp_path):
    hinge, ball = (_level_pendulum(model(name)) for name in ("revolute", "spherical"))
    file = _file_of(hinge)
    monkeypatch.setattr(adams_joints, "read_output", lambda path: file)
    for mechanism, status in (ball, "passed"), (replace(ball, inertia=1.01 * ball.inertia), "failed"):
        place, force, files = adams_joints._same_pendulum_rows("Spherical", mechanism, file, tmp_path)
        assert (place.status, force.status, files.value) == (status, status, 0.0)


def _level_pendulum(mechanism):
    """2 m long and at rest, level: it swings in a plane on a ball as on a hinge about y."""
    place, axes = np.array([2.0, 0.0, 0.0]), np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    ground, body = (
        replace(each, position=np.zeros(3), axes=axes.T) for each in (mechanism.ground_marker, mechanism.body_marker)
    )
    still = {"velocity": np.zeros(3), "angular_velocity": np.zeros(3), "gravity": np.array([0.0, 0.0, -9.80665])}
    inertia = np.diag([0.04, 0.1, 0.1])
    return replace(
        mechanism,
        mass=1.0,
        centre=place,
        inertia=inertia,
        axes=np.eye(3),
        ground_marker=ground,
        body_marker=body,
        **still,
    )


def _file_of(mechanism):
    """Half a second of its motion, as a file of twelve digits."""
    motion, reaction = ConstrainedBody(mechanism).run(0.5, 5e-3, 2)
    return OutputFile(motion.times, {"Pos": motion.position, "Rforce": reaction.force}, 12)
