"""A user's own model: read, built, certified, compared and refused as it should be."""

from copy import copy
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from models.advice.own_model_price import recommended_settings
from models.core.errors import InputError, RunFailed
from models.engines.free_vehicle import free_model
from models.own_model import certificate as certifying
from models.own_model.builds import (
    ALL_BUILDS,
    SOFT_BUILD,
    equations_of_build,
    equations_of_file,
    largest_constraint_gap,
    sliding_states,
)
from models.own_model.certificate import (
    agreement_of_build,
    certificate,
    comparison_states,
    motion_at,
    reference_of_file,
    softness_difference,
)
from models.own_model.coordinates import rotation_by_angles
from models.own_model.elements import distinct_texts, elements_of_model
from models.own_model.explain import compare_models, removals_that_agree
from models.own_model.file import ModelFile, read_model_file
from models.own_model.limits import limits_struck
from models.own_model.path import _model_of_build as march_of
from models.own_model.path import compare_paths
from models.own_model.reading import described_model
from models.own_model.states import random_states
from models.own_model.urdf import misread_numbers
from validation.own_model.files import (
    ARM_URDF,
    BOX_ON_GROUND_POINT,
    BOX_WELDED_TO_CRANK,
    CART,
    GEARED,
    JOINTED,
    LINKED,
    LOOP_CONSTRAINT,
    PLANTED_DIFFERENCES,
    TIED,
    model_with_change,
    random_chain,
    random_tree,
)
from validation.own_model.soft_couplings import soft_constraint_equations


def _file(folder: Path, text: str, name: str = "a.xml") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def _read(folder: Path, text: str, name: str = "a.xml", without: tuple[str, ...] = ()) -> ModelFile:
    return read_model_file(_file(folder, text, name), without)


REPELLED = model_with_change(TIED, "rope", 'springlength=".7"', 'springlength="-.01"')
"""With a rest length below 0, which no connector of Exudyn takes: a preload of another code may leave that."""


@pytest.mark.parametrize(
    "text",
    [JOINTED, CART, TIED, REPELLED, random_chain(8), random_tree(9, 4)],
    ids=["jointed", "cart", "tied", "repelled", "chain", "tree"],
)
def test_every_build_moves_as_the_file_does(tmp_path, text):
    for row in certificate(_read(tmp_path, text).twin, 20):
        assert max(row.mass, row.force, row.acceleration) < 1e-11, row  # rounding by a condition of about 100


@pytest.fixture(scope="module")
def geared(tmp_path_factory):
    return _read(tmp_path_factory.mktemp("geared"), GEARED).twin


def as_drawn(twin):
    """20 random states, of which dry friction sticks at some."""
    return list(zip(*random_states(twin, 20), strict=True))


def test_dry_friction_and_couplings_are_those_of_the_file(geared):
    """To rounding; a coupling or a friction that is 1 % off is seen in every build."""
    states = comparison_states(geared, 20)
    assert (
        len(sliding_states(geared, states)) == len(states) > len(sliding_states(geared, as_drawn(geared)))
    )  # faster rates slide
    for row in certificate(geared, 20):
        assert max(row.mass, row.force, row.acceleration) < 1e-11, row
    (gear, shut), (swing, slide) = geared.driven.couplings, geared.driven.frictions
    wrong = replace(geared.driven, couplings=(replace(gear, ratio=1.01 * gear.ratio), shut))
    dry = replace(geared.driven, frictions=(swing, replace(slide, force=1.01 * slide.force)))
    for driven in (wrong, dry):
        assert all(row.acceleration > 1e-5 for row in certificate(replace(geared, driven=driven), 20))


def test_what_couplings_give_way_in_mujoco_is_the_law_of_its_documentation(geared):
    """Far from rigid, and the law all the same: to 1e-8, MuJoCo's tolerance; the fault: another impedance."""
    states = comparison_states(geared, 10)
    assert softness_difference(geared, 10) > 1e-3
    soft = reference_of_file(geared, states, SOFT_BUILD)
    assert agreement_of_build("", soft, motion_at(soft_constraint_equations(geared), states)).acceleration < 1e-8
    ties = tuple(replace(tie, solimp=(0.91, *tie.solimp[1:])) for tie in geared.driven.couplings)
    other = replace(geared, driven=replace(geared.driven, couplings=ties))
    assert agreement_of_build("", soft, motion_at(soft_constraint_equations(other), states)).acceleration > 1e-4


SPRUNG = model_with_change(
    model_with_change(JOINTED, "ball", 'pos=".1 .2 .3"', 'pos=".1 .2 .3" stiffness="4" damping=".3"'),
    "free",
    '<freejoint name="root"/>',
    '<joint name="root" type="free" stiffness="6" damping=".7"/>',
)
"""A spring and a damper of a ball joint, and of a free one."""


def test_springs_of_ball_and_free_joints_are_those_of_the_file(tmp_path):
    """To rounding, with a rest that is not the design position; the fault: 1 % of a stiffness, of a damping."""
    as_read, model = _read(tmp_path, SPRUNG).twin, _read(tmp_path, SPRUNG, "turned.xml").twin.model
    at = int(model.joint("ball").qposadr[0])
    model.qpos_spring[at : at + 4] = np.array((0.9, 0.1, -0.3, 0.2)) / np.linalg.norm((0.9, 0.1, -0.3, 0.2))
    for twin in (as_read, described_model(model, "turned")):
        assert all(max(row.force, row.acceleration) < 1e-11 for row in certificate(twin, 20))
        for i, change in ((0, "stiffness"), (1, "damping")):
            springs = list(twin.driven.turning_springs)
            springs[i] = replace(springs[i], **{change: 1.01 * getattr(springs[i], change)})
            wrong = replace(twin.driven, turning_springs=tuple(springs))
            assert all(row.acceleration > 1e-6 for row in certificate(replace(twin, driven=wrong), 20))
    assert compare_paths(as_read, 0.01).energy < 1e-4  # steps of 10 ms


def test_a_sprung_ball_joint_is_one_of_several_joints_of_its_body(tmp_path):
    """Its spring and damper act from what the hinge before it turned to what the slide behind it shifts."""
    joints = """<joint name="h" axis="0 1 .2" armature=".02"/><joint name="b" type="ball" stiffness="3" damping=".4"
    pos="0 .1 0"/><joint name="s" type="slide" axis="1 0 0"/>"""
    mass = '<inertial pos=".1 0 .3" mass="1" diaginertia=".1 .08 .05"/>'
    body = f'<body><joint name="arm" axis="0 0 1"/>{mass}<body pos="1 0 0" euler="9 0 0">{joints}{mass}</body></body>'
    twin = _read(tmp_path, f"<mujoco><worldbody>{body}</worldbody></mujoco>").twin
    assert all(max(row.mass, row.acceleration) < 1e-11 for row in certificate(twin, 10))


PUSHED = TIED.replace(
    "</mujoco>",
    """<actuator><motor name="jet" site="elbow" gear="1 -2 .5 .3 .1 -.2" ctrlrange="1.5 2"/>
    <general name="prop" site="ring" gear="0 0 3 0 0 .4" biastype="affine" biasprm="2 0 0"/></actuator></mujoco>""",
)
"""Forces and moments that turn with bodies."""


def test_actuators_that_push_sites_are_those_of_the_file(tmp_path):
    """To rounding; the fault: a force that is 1 % larger, a moment along other axes."""
    twin = _read(tmp_path, PUSHED).twin
    assert all(max(row.force, row.acceleration) < 1e-11 for row in certificate(twin, 20))
    jet, prop = twin.driven.body_loads
    for wrong in (replace(jet, force=1.01 * jet.force), replace(jet, moment=jet.moment[[1, 0, 2]])):
        driven = replace(twin.driven, body_loads=(wrong, prop))
        assert all(row.acceleration > 1e-5 for row in certificate(replace(twin, driven=driven), 20))
    other = _read(tmp_path, model_with_change(PUSHED, "prop", "0 0 3 0 0 .4", "0 0 3 0 0 .5"), "b.xml").twin
    comparison = compare_models(twin, other, 3)
    assert [(each.kind, each.owner) for each in comparison.influential] == [("gear", "actuator 'prop'")]


FALLING = """<mujoco><option gravity="0 0 -9.8"/><worldbody><site name="foot"/><body name="ball">
<freejoint name="free"/><inertial pos="0 0 0" mass="1" diaginertia=".04 .1 .1"/><site name="tip"/></body></worldbody>
<tendon><spatial name="spring" stiffness="10" damping=".5" springlength="0"><site site="foot"/><site site="tip"/>
</spatial></tendon></mujoco>"""
"""A free body on a spring without length, whose ends meet in the design position."""


@pytest.mark.parametrize("height", [0.0, -1e-3])
def test_a_tendon_without_length_is_not_damped_in_mujoco(tmp_path, height):
    """One step from rest beside the exact motion: the second of four stages lacks c g h / 2, as the ends still meet."""
    twin, (k, c, g), h = _read(tmp_path, FALLING).twin, (10.0, 0.5, 9.8), 5e-3
    rest, start = -g / k, np.array((0.0, 0.0, height, 0.0, 0.0, 0.0))
    exact = (expm(h * np.array(((0.0, 1.0), (-k, -c)))) @ (height - rest, 0.0))[1]
    for engine, error in (("exudyn", 0.0), ("mujoco", -c * g * h**2 / 6.0 if height == 0.0 else 0.0)):
        speed = free_model(engine, twin.driven).march(start, np.zeros(6), 1, h)[-1, 8]
        assert abs(speed - exact - error) < 5e-8  # the next order, g h^3 k / 24; Runge-Kutta's own is 2e-11 m/s


@pytest.mark.parametrize("text", [LINKED, BOX_WELDED_TO_CRANK, BOX_ON_GROUND_POINT], ids=["linked", "held", "hung"])
def test_joints_between_bodies_are_those_of_the_file(tmp_path, text):
    """To rounding, rigid in two builds; what gives way in MuJoCo is its law; ends that are 1 mm off are seen in all."""
    twin = _read(tmp_path, text).twin
    states = comparison_states(twin, 5)
    for row in certificate(twin, 5):
        assert max(row.mass, row.acceleration) < 1e-11, row  # rounding, MuJoCo's solver included
    soft = reference_of_file(twin, states, SOFT_BUILD)
    assert softness_difference(twin, 5) > 1e-3
    assert agreement_of_build("", soft, motion_at(soft_constraint_equations(twin), states)).acceleration < 1e-8
    ties = twin.driven.connections
    for i, tie in enumerate(ties):
        body, (x, y, z) = tie.ends[0]
        moved = replace(tie, ends=((body, (x + 1e-3, y, z)), tie.ends[1]))
        wrong = replace(twin, driven=replace(twin.driven, connections=(*ties[:i], moved, *ties[i + 1 :])))
        assert all(row.acceleration > 1e-6 for row in certificate(wrong, 5))
        other = (*ties[:i], replace(tie, solimp=(tie.solimp[0] + 0.01, *tie.solimp[1:])), *ties[i + 1 :])
        yielding = replace(twin, driven=replace(twin.driven, connections=other))
        assert agreement_of_build("", soft, motion_at(soft_constraint_equations(yielding), states)).acceleration > 1e-5


def test_welds_hold_both_bodies_as_they_lie(tmp_path, monkeypatch):
    """Rigid bodies that lie wrong to each other have the right accelerations all the same: their gap tells."""
    twin = _read(tmp_path, LINKED).twin
    loop, grip = twin.driven.connections
    turned = replace(grip, axes=(grip.axes[0] @ Rotation.from_rotvec((0.0, 0.02, 0.0)).as_matrix(), grip.axes[1]))
    wrong = replace(twin.driven, connections=(loop, turned))
    assert all(largest_constraint_gap(twin, build, comparison_states(twin, 5)) < 1e-11 for build in ALL_BUILDS)
    assert all(
        largest_constraint_gap(replace(twin, driven=wrong), build, comparison_states(twin, 5)) > 1e-3
        for build in ALL_BUILDS
    )
    monkeypatch.setattr("models.own_model.builds.free_model", lambda build, driven: free_model(build, wrong))
    assert [row.alike for row in certificate(twin, 5)] == [False, False, True]


def test_inertia_of_rotors_is_in_what_gives_way(tmp_path):
    twin = _read(tmp_path, model_with_change(GEARED, "turn", 'axis="0 1 .3"', 'axis="0 1 .3" armature=".3"')).twin
    assert all(row.acceleration < 1e-11 for row in certificate(twin, 5))


def test_a_path_of_a_body_hung_by_a_point_and_of_a_loop_of_bars(tmp_path):
    """The step is coarse, since Exudyn's constraints are asked four times in each."""
    report = compare_paths(_read(tmp_path, BOX_ON_GROUND_POINT).twin, 0.02)
    assert report.alike and report.has_soft_constraints and not report.failed and report.distances["mujoco"] > 1e-6
    assert report.energy < 1e-3  # of the largest, by steps of 20 ms


def test_constraints_that_contradict_each_other_are_told(tmp_path):
    far = LINKED.replace("<worldbody>", '<worldbody><site name="far" pos="0 0 9"/>')
    twin = _read(tmp_path, far.replace(LOOP_CONSTRAINT, f'<connect site1="tip" site2="far"/>{LOOP_CONSTRAINT}')).twin
    with pytest.raises(RunFailed, match="cannot be satisfied all at once"):
        certificate(twin, 2)


def test_couplings_that_contradict_each_other_are_told_by_name(tmp_path):
    other = '<joint name="other" joint1="slide" joint2="turn" polycoef=".2 .25 0 0 0"/></equality>'
    twin = _read(tmp_path, GEARED.replace("</equality>", other)).twin
    with pytest.raises(RunFailed, match="equality 'gear' and equality 'other' contradict each other"):
        certificate(twin, 2)


def test_where_a_joint_between_bodies_lies_is_told(tmp_path):
    first = _read(tmp_path, LINKED).twin
    second = _read(tmp_path, model_with_change(LINKED, "loop", '"rod"', '"crank"'), "b.xml").twin
    other = _read(tmp_path, model_with_change(LINKED, "grip", 'solimp=".92', 'solimp=".93'), "c.xml").twin
    moved = _read(tmp_path, LINKED.replace('name="tip" pos="0 .3 .1"', 'name="tip" pos="0 .3 .11"'), "d.xml").twin
    assert not compare_models(first, second, 3).alike
    comparison = compare_models(first, moved, 3)
    assert [(each.kind, each.owner) for each in comparison.influential] == [("joint", "equality 'grip'")]
    soft = compare_models(first, other, 3)
    assert soft.alike and [each.owner for each in soft.not_compared] == ["equality 'grip'"]


def test_paths_with_couplings_agree_as_long_as_dry_friction_slides(geared):
    report = compare_paths(geared)
    assert report.alike and report.has_soft_constraints and 0.0 < report.comparison_horizon < 1.0
    assert report.distances["mujoco"] > 1e-6  # its couplings give way
    assert any("dry friction sticks" in line for line in report.lines())


@pytest.mark.parametrize(
    "name,old,new,kind,owner",
    [
        ("gear", 'polycoef=".1 .25', 'polycoef=".1 .26', "coupling", "equality 'gear'"),
        ("gear", '<joint name="shut"', '<joint active="false" name="shut"', "coupling", "equality 'shut'"),
        ("swing", 'frictionloss=".4"', 'frictionloss=".5"', "friction loss", "joint 'swing'"),
        ("slide", 'frictionloss="1.5"', "", "friction loss", "joint 'slide'"),
    ],
)
def test_differences_of_couplings_and_friction_are_named(tmp_path, geared, name, old, new, kind, owner):
    comparison = compare_models(geared, _read(tmp_path, model_with_change(GEARED, name, old, new), "b.xml").twin, 5)
    assert not comparison.alike and comparison.unexplained_difference < 1e-10
    assert [(each.kind, each.owner) for each in comparison.influential] == [(kind, owner)]


def test_softness_of_couplings_is_listed_and_not_compared(tmp_path, geared):
    second = _read(tmp_path, model_with_change(GEARED, "shut", ".95 .99", ".9 .99"), "b.xml").twin
    comparison = compare_models(geared, second, 5)
    assert comparison.alike and [each.owner for each in comparison.not_compared] == ["equality 'shut'"]


def test_couplings_and_dry_friction_have_no_price(geared):
    with pytest.raises(InputError, match="no price here"):
        recommended_settings(geared, 1e-4, None)


def test_ends_of_a_tendon_between_sites_are_told(tmp_path):
    """And the balance of energy and work holds with it."""
    first = _read(tmp_path, TIED)
    second = _read(tmp_path, TIED.replace('pos=".3 .1 -.2"', 'pos=".3 .1 -.21"'), "b.xml")
    (difference,) = compare_models(first.twin, second.twin, 3).influential
    assert (difference.kind, difference.owner) == ("ends", "tendon 'rope'")
    assert compare_paths(first.twin).energy < 1e-7  # Simpson's rule at 2 ms, on a rope that moves at 6 Hz


def test_urdf_is_built_and_its_xml_says_the_same(tmp_path):
    file = _read(tmp_path, ARM_URDF, "arm.urdf")
    assert all(row.acceleration < 1e-12 for row in certificate(file.twin, 20))
    assert misread_numbers(file) == []
    assert file.ignored_limits == ("joint 'shoulder'",)
    assert "1 shapes" in file.notes[0]


def test_inertia_rotation_lost_by_a_parser_is_told(tmp_path):
    file = _read(tmp_path, ARM_URDF, "arm.urdf")
    body = file.twin.model.body("upper").id
    file.twin.model.body_iquat[body] = 1.0, 0.0, 0.0, 0.0
    file.twin.model.body_sameframe[:] = 0
    (lost,) = misread_numbers(file)
    assert (lost.kind, lost.owner) == ("inertia", "body 'upper'")
    assert "in the file" in lost.sentence()


@pytest.mark.parametrize("kind", ["armature", "damping", "stiffness"])
def test_an_element_that_a_build_lacks_is_named(tmp_path, monkeypatch, kind):
    """The fault: the plain equations forget one number of a joint."""
    file, field = _read(tmp_path, CART.replace('name="tilt"', 'name="tilt" armature=".1" stiffness="3"')), kind
    owner = {"damping": "joint 'x'"}.get(kind, "joint 'tilt'")
    honest = equations_of_build

    def forgetful(twin, build):
        vehicle = twin.driven.vehicle
        forgotten = {"armature": "inertia"}.get(field, field)
        rows = tuple(replace(e, **{forgotten: 0.0}) if e.name == owner else e for e in vehicle.joint_elements)
        driven = replace(twin.driven, vehicle=replace(vehicle, joint_elements=rows))
        return honest(replace(twin, driven=driven) if build == "plain" else twin, build)

    monkeypatch.setattr(certifying, "equations_of_build", forgetful)
    monkeypatch.setattr("models.own_model.explain.equations_of_build", forgetful)
    exudyn, engine, plain = certificate(file.twin, 5)
    assert exudyn.alike and engine.alike and not plain.alike
    assert [(element.kind, element.owner) for element, _ in removals_that_agree(file.twin, "plain", 5)] == [
        (kind, owner)
    ]


@pytest.fixture(scope="module")
def original(tmp_path_factory):
    return _read(tmp_path_factory.mktemp("original"), JOINTED)


@pytest.mark.parametrize("name,old,new,kind,owner,size", PLANTED_DIFFERENCES)
def test_planted_difference_is_named_with_its_size(tmp_path, original, name, old, new, kind, owner, size):
    other = _read(tmp_path, model_with_change(JOINTED, name, old, new), "b.xml")
    comparison = compare_models(original.twin, other.twin, 3)
    assert not comparison.alike
    first = comparison.influential[0]
    said = first.sentence(("a.xml", "b.xml"))
    assert said.startswith(f"{kind} of {owner}: ") and size in said, said
    assert comparison.unexplained_difference < 1e-10


def test_difference_without_influence_is_listed_as_such(tmp_path, original):
    text = JOINTED.replace('ctrlrange="1 2"', 'ctrlrange="1 3"')
    comparison = compare_models(original.twin, _read(tmp_path, text, "b.xml").twin, 3)
    assert comparison.alike and comparison.influential == ()
    assert [(each.kind, each.owner) for each in comparison.differences] == [("control range", "actuator 'push'")]


def test_a_difference_in_what_is_off_is_listed_as_not_compared(tmp_path):
    rubbed = CART.replace('name="x"', 'name="x" frictionloss="2" range="-1 1"')
    first = _read(tmp_path, rubbed, "a.xml", ("friction_loss",))
    second = _read(
        tmp_path,
        rubbed.replace('frictionloss="2" range="-1 1"', 'frictionloss="3" range="-2 1"'),
        "b.xml",
        ("friction_loss",),
    )
    comparison = compare_models(first.twin, second.twin, 3)
    assert comparison.alike and comparison.silent_differences == ()
    assert {each.kind for each in comparison.not_compared} == {"friction loss", "range"}


def test_an_actuator_that_one_file_lacks_explains_the_difference(tmp_path, original):
    text = JOINTED.replace("</actuator>", '<position name="hold" joint="hinge" kp="4"/></actuator>')
    comparison = compare_models(original.twin, _read(tmp_path, text, "b.xml").twin, 3)
    assert {each.owner for each in comparison.influential} == {"actuator 'hold'"}
    assert comparison.unexplained_difference < 1e-10


def test_joints_without_a_partner_are_named(tmp_path, original):
    comparison = compare_models(original.twin, _read(tmp_path, CART, "cart.xml").twin, 3)
    assert (
        comparison.acceleration_agreement is None
        and "joint 'hinge' of a has no partner" in comparison.unmatched_coordinates
    )


def test_mjcf_and_urdf_of_the_same_arm(tmp_path):
    """The same arm as MuJoCo itself writes it: its numbers are rounded to six digits there, and no more."""
    arm = _read(tmp_path, ARM_URDF, "arm.urdf")
    mujoco.mj_saveLastXML(str(tmp_path / "arm.xml"), arm.twin.model)
    comparison = compare_models(arm.twin, read_model_file(tmp_path / "arm.xml").twin, 3)
    assert comparison.acceleration_agreement is not None and comparison.acceleration_agreement.acceleration < 1e-4


def test_paths_of_all_builds_agree_and_the_ledger_closes(tmp_path):
    report = compare_paths(_read(tmp_path, CART).twin)
    assert report.alike and not report.failed and not report.has_quaternions
    assert report.energy < 1e-9  # Simpson's rule at steps of 2 ms


def test_a_build_with_another_path_is_told(tmp_path, monkeypatch):
    """The fault: gravity is 1e-6 off in MuJoCo; the disturbance that ends a comparison is one of the first build."""
    honest = march_of

    def heavier(twin, build):
        driven = replace(twin.driven, gravity=(1.0 + 1e-6) * twin.driven.gravity)
        return honest(replace(twin, driven=driven) if build == "mujoco" else twin, build)

    monkeypatch.setattr("models.own_model.path._model_of_build", heavier)
    report = compare_paths(_read(tmp_path, CART).twin)
    assert not report.alike and report.comparison_horizon > 0.9 and report.distances["mujoco"] > 1e-7


LIMITED = model_with_change(CART, "tilt", 'axis="0 1 0"', 'axis="0 1 0" range="-20 20" margin=".02"').replace(
    "<worldbody>", '<compiler autolimits="true"/><worldbody>'
)


def test_inside_their_ranges_limits_do_nothing(tmp_path):
    """The file's own model with its limits accelerates as without; the fault: states that reach beyond."""
    twin = _read(tmp_path, LIMITED).twin
    states, struck = comparison_states(twin, 30), limits_struck(twin)
    with_limits = copy(twin.model)
    with_limits.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_LIMIT)

    def apart(states):
        moved = motion_at(equations_of_file(replace(twin, model=with_limits)), states)
        return agreement_of_build("", reference_of_file(twin, states, SOFT_BUILD), moved).acceleration

    assert apart(states) == 0.0 and not any(struck(q) for q, _ in states)
    beyond = [(1.2 * q, v) for q, v in states]
    assert apart(beyond) > 1e-3 and {name for q, _ in beyond for name in struck(q)} == {"joint 'tilt'"}


def test_a_path_that_strikes_a_limit_is_compared_up_to_there(tmp_path):
    report = compare_paths(_read(tmp_path, LIMITED).twin)
    assert report.alike and report.struck_limit == "joint 'tilt'" and 0.0 < report.comparison_horizon < 1.0
    assert any("joint 'tilt' strikes its limit, which is not built" in line for line in report.lines())


def test_what_a_limit_adds_is_no_stop_of_springs(tmp_path):
    """1 / (1 - d) of the inertia, and d of MuJoCo's spring and damper: what ``limits`` says of a joint that presses."""
    twin = _read(tmp_path, LIMITED).twin
    impedance, (time, ratio) = 0.93, (0.05, 0.7)
    model = copy(twin.model)
    model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_DIAGEXACT)
    model.jnt_solimp[:], model.jnt_solref[:] = (impedance, impedance, 1e-3, 0.5, 2.0), (time, ratio)
    q, v = np.array((0.1, 0.4)), np.array((0.2, 0.3))
    (free,), (seen,) = (
        motion_at(equations_of_file(replace(twin, model=each)), [(q, v)]) for each in (twin.model, model)
    )
    depth = q[1] - (twin.model.jnt_range[1, 1] - twin.model.jnt_margin[1])
    stiffness, damping = 1.0 / (impedance * time**2 * ratio**2), 2.0 / (impedance * time)
    law = (1.0 - impedance) * free.acceleration[1] - impedance * (stiffness * depth + damping * v[1])
    assert abs(seen.acceleration[1] - law) < 1e-8 * abs(law)


def test_path_with_quaternions_differs_by_the_error_of_the_step(tmp_path):
    twin = _read(tmp_path, JOINTED).twin
    coarse, fine = (compare_paths(twin, step).distances["the file's own model"] for step in (4e-3, 2e-3))
    assert 8.0 < coarse / fine < 32.0  # order 4: 16


def test_thirty_joints_are_certified(tmp_path):
    assert all(row.alike for row in certificate(_read(tmp_path, random_chain(30)).twin, 100))


DAMPED = '<actuator><general name="damp" site="s" biastype="affine" biasprm="0 0 -1"/></actuator>'
REFUSED = [
    ("actuator", '<site name="s"/>', "actuator: actuator 'damp' (a.xml:2)"),
    ("contact", '<geom name="box" type="box" size=".1 .1 .1"/>', "geom 'box' (a.xml:2)"),
    ("friction_loss", '<joint name="rub" type="ball" frictionloss="2"/>', "friction_loss: joint 'rub' (a.xml:2)"),
    ("turning_law", '<joint name="soft" type="ball" armature="1"/>', "turning_law: joint 'soft' (a.xml:2)"),
]


@pytest.mark.parametrize("kind,element,said", REFUSED)
def test_content_without_an_equal_is_refused_by_name_and_line(tmp_path, kind, element, said):
    floor = '<geom name="floor" type="plane" size="1 1 1"/>' if kind == "contact" else ""
    text = (
        f'<mujoco><worldbody>{floor}<body name="b"><inertial pos="0 .1 0" mass="1" diaginertia="1 1 1"/>\n'
        f'{element}<joint name="j" axis="0 0 1"/></body></worldbody></mujoco>'
    )
    if kind == "actuator":
        text = text.replace("</mujoco>", f"{DAMPED}</mujoco>")
    if "ball" in element:
        text = text.replace('<joint name="j" axis="0 0 1"/>', "")
    path = _file(tmp_path, text)
    with pytest.raises(InputError) as error:
        read_model_file(path)
    assert said in str(error.value) and f"--without {kind}" in str(error.value)
    file = read_model_file(path, (kind,))
    assert [content.kind for content in file.removed_contents] == [kind]
    assert all(row.alike for row in certificate(file.twin, 5))


@pytest.mark.parametrize(
    "text,said",
    [
        ('<mujoco><include file="../other.xml"/></mujoco>', "must name a file in the folder"),
        ('<mujoco><extension><plugin plugin="x"/></extension></mujoco>', "plugins are code"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><mujoco/>', "document types"),
        ("<mujoco>", "no well-formed XML"),
        ("<html/>", "must be <mujoco> (MJCF) or <robot> (URDF)"),
        ("<mujoco/>", "it has no joint"),
        ('<mujoco><worldbody><replicate count="100000000"/></worldbody></mujoco>', "more than 2000 copies"),
        ('<mujoco><size memory="900G"/></mujoco>', "asks for too much memory"),
        ("<mujoco><worldbody><body><joint/></body></worldbody></mujoco>", "MuJoCo's parser refuses it"),
    ],
)
def test_what_must_not_reach_the_parser_does_not(tmp_path, text, said):
    with pytest.raises(InputError) as error:
        _read(tmp_path, text)
    assert said in str(error.value) and "a.xml" in str(error.value)


def _nested(folder: Path, **texts: str) -> Path:
    """A model in ``in``, with files in and beside it; keys: folders joined by two underscores, and the file."""
    for name, text in texts.items():
        path = folder / f"{name.replace('__', '/')}.xml"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder / "in" / "main.xml"


@pytest.mark.parametrize("kind", ["include", "model"])
def test_nothing_outside_is_read_by_an_include_within_an_include(tmp_path, kind):
    """MuJoCo looks in the folder of the model, not of the file that includes; the sound file that a reader from the
    other folder would take is there, too."""
    asks = {"include": '<include file="../x.xml"/>', "model": '<asset><model name="x" file="../x.xml"/></asset>'}[kind]
    sound = "<mujoco><worldbody/></mujoco>"
    main = _nested(
        tmp_path,
        in__main='<mujoco><include file="sub/a.xml"/></mujoco>',
        in__sub__a=f"<mujoco>{asks}</mujoco>",
        in__x=sound,
        x='<mujoco><extension><plugin plugin="mujoco.elasticity.cable"/></extension></mujoco>',
    )
    with pytest.raises(InputError, match=r"a\.xml.*\.\./x\.xml.*must name a file in the folder"):
        read_model_file(main)


MESH = (
    '<mujoco>{}<asset><mesh name="m" file="{}"/></asset><worldbody><body><joint/><geom type="mesh" mesh="m" '
    'contype="0" conaffinity="0"/></body></worldbody></mujoco>'
)
CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


@pytest.mark.parametrize(
    "compiler,name",
    [("", "../m.obj"), ("", "{}/m.obj"), ('<compiler meshdir="{}"/>', "m.obj"), ('<compiler assetdir=".."/>', "m.obj")],
)
def test_no_mesh_is_read_from_outside(tmp_path, compiler, name):
    """Neither by a way up, nor by a whole path, nor by a folder of the compiler; one beside the model is read."""
    (tmp_path / "in").mkdir()
    for folder in (tmp_path, tmp_path / "in"):
        (folder / "m.obj").write_text(CORNERS)
    with pytest.raises(InputError, match=r"a\.xml: line 1 = .*m\.obj.*<mesh> must name a file in the folder"):
        _read(tmp_path / "in", MESH.format(compiler.format(tmp_path), name.format(tmp_path)))
    assert _read(tmp_path / "in", MESH.format("", "m.obj")).twin.size == 1


def test_includes_are_looked_for_where_mujoco_does(tmp_path):
    """Those of a model in its folder, those of an attached model in that one's: the plugin of either is seen."""
    plugin, sound = '<mujoco><extension><plugin plugin="x"/></extension></mujoco>', "<mujoco/>"
    nested = {"in__main": '<mujoco><include file="sub/a.xml"/></mujoco>'}
    nested |= {"in__sub__a": '<mujoco><include file="b.xml"/></mujoco>', "in__b": plugin, "in__sub__b": sound}
    attached = nested | {"in__main": '<mujoco><asset><model name="a" file="sub/a.xml"/></asset></mujoco>'}
    attached |= {"in__b": sound, "in__sub__b": plugin}
    for texts in (nested, attached):
        with pytest.raises(InputError, match="plugins are code"):
            read_model_file(_nested(tmp_path, **texts))


@pytest.mark.parametrize(
    "text,old,new,said",
    [
        (LINKED, 'anchor=".6 0 0"', 'anchor="nan 0 0"', "eq_data: must be finite"),
        (JOINTED, 'stiffness="2"', 'stiffness="nan"', "joint 'hinge': jnt_stiffness: must be finite"),
        (JOINTED, 'axis="1 2 3"', 'axis="1 nan 3"', "joint 'hinge': jnt_axis: must be finite"),
        (JOINTED, 'gear="3"', 'gear="nan"', "actuator_gear: must be finite"),
        (JOINTED, 'gravity="1 2 -9"', 'gravity="nan 2 -9"', "gravity: must be finite"),
        (JOINTED, 'gravity="1 2 -9"', 'timestep="0"', "timestep = 0.0: must be a finite number above 0"),
        (JOINTED, 'stiffness="2"', 'stiffness="1e308"', "jnt_stiffness = 1e+308: must be 1e+30 or less"),
        (GEARED, 'frictionloss=".4"', 'frictionloss="-1"', "frictionloss = -1.0: must be 0 or more"),
    ],
)
def test_numbers_that_the_parser_passes_are_refused(tmp_path, text, old, new, said):
    with pytest.raises(InputError) as error:
        _read(tmp_path, text.replace(old, new, 1))
    assert said in str(error.value)


@pytest.mark.parametrize(
    "old,new",
    [("<worldbody>", '<option solver="PGS" iterations="3"/><worldbody>'), ('torquescale="2"', 'torquescale="0"')],
)
def test_solvers_of_constraints_and_welds_without_torque(tmp_path, old, new):
    twin = _read(tmp_path, LINKED.replace(old, new, 1)).twin
    assert all(row.alike for row in certificate(twin, 3))


def test_a_hundred_spoilt_files_are_answered(tmp_path):
    """Bytes changed, cut out or doubled at random: read, or one clear error, never anything else."""
    draw, refused = np.random.default_rng(3), 0
    for i in range(100):
        content = bytearray((ARM_URDF if i % 3 == 0 else JOINTED).encode())
        for _ in range(int(draw.integers(1, 6))):
            at, kind = int(draw.integers(len(content) - 20)), i % 3
            if kind == 0:
                content[at] = int(draw.integers(256))
            elif kind == 1:
                del content[at : at + int(draw.integers(1, 20))]
            else:
                content[at:at] = content[at : at + int(draw.integers(1, 20))]
        path = tmp_path / f"spoilt{i}.xml"
        path.write_bytes(bytes(content))
        try:
            certificate(read_model_file(path, ("contact", "equality", "bent_law")).twin, 1)
        except InputError as error:
            assert path.name in str(error) or "--without" in str(error)
            refused += 1
    assert 0 < refused < 100


def test_angular_velocity_of_the_angles():
    """G rates is the angular velocity in turned axes, and G' rates its rate at constant rates, by differences."""
    angles, rates, h = np.array((0.3, -0.5, 0.8)), np.array((0.7, 1.1, -0.4)), 1e-6
    before, after = rotation_by_angles(angles - h * rates, rates), rotation_by_angles(angles + h * rates, rates)
    rotation, gains, bias = rotation_by_angles(angles, rates)
    spin = rotation.T @ (after[0] - before[0]) / (2 * h)
    assert np.allclose([spin[2, 1], spin[0, 2], spin[1, 0]], gains @ rates, atol=1e-9)
    assert np.allclose((after[1] - before[1]) @ rates / (2 * h), bias, atol=1e-9)


def test_elements_have_names_units_and_values(tmp_path):
    listed = elements_of_model(_read(tmp_path, JOINTED).twin.model)
    assert listed["armature", "joint 'hinge'"].unit == "kg m^2"
    assert listed["damping", "joint 'slide'"].unit == "N s/m"
    assert np.allclose(listed["inertia", "body 'arm'"].value, (0.3, 0.4, 0.5, 0.02, 0.03, 0.04))


def test_joints_that_move_without_inertia_are_named(tmp_path, capfd):
    joints = "".join(
        f'<joint name="{name}" type="slide" axis="{axis}"/>' for name, axis in (("x", "1 0 0"), ("y", "1 0 0"))
    )
    text = f"<mujoco><worldbody><body>{joints}<geom size='.1' pos='0 0 .1' mass='1'/></body></worldbody></mujoco>"
    with pytest.raises(RunFailed, match="singular: joint 'x' and joint 'y' can move without inertia"):
        certificate(_read(tmp_path, text).twin, 3)
    assert capfd.readouterr() == ("", "")  # MuJoCo's own warnings


def test_a_mass_that_no_force_moves_is_no_silent_difference(tmp_path):
    """A wheel in balance: armature changes no acceleration, as there is none, and the mass matrix all the same."""
    body = "<body><joint axis='0 1 0' armature='0.1'/><geom size='0.1' mass='1'/></body>"
    wheel = f"<mujoco><worldbody>{body}</worldbody></mujoco>"
    first, second = (_read(tmp_path, wheel.replace("0.1'/><g", f"{size}'/><g"), f"{size}.xml") for size in (0.1, 0.12))
    comparison = compare_models(first.twin, second.twin, 3)
    assert not comparison.alike and [each.kind for each in comparison.influential] == ["armature"]


def test_two_values_are_shown_in_digits_that_tell_them_apart():
    first, second = (np.array([value]) for value in (10.0, 10.00000001))
    assert distinct_texts(first, second, "N/m") == ("10 N/m", "10.00000001 N/m")
    assert distinct_texts(first, np.zeros(0), "N/m") == ("10 N/m", "none")
