"""What two files differ in that is no number: each is named with both values, and the words on the rest are true."""

import pytest

from models.own_model.explain import compare_models
from models.own_model.file import read_model_file
from models.own_model.two_paths import compare_two_paths
from studies.command.twin import _comparison_lines

FLAGS = '<option><flag gravity="enable"/></option>'
MODEL = f"""<mujoco>{FLAGS}<worldbody>
<body name="a"><joint name="a" axis="0 1 0" stiffness="3" damping=".2"/>
 <inertial pos="0 0 .3" mass="1" diaginertia=".1 .08 .05"/>
 <site name="tip" pos="0 0 1"/><body name="lug"><inertial pos="0 .1 0" mass=".1" diaginertia=".01 .01 .01"/></body>
</body>
<body name="b" pos="0 1 0"><joint name="b" type="slide" axis="1 0 0"/>
 <inertial pos="0 .1 .3" mass="2" diaginertia=".1 .08 .05"/></body></worldbody>
<tendon><fixed name="rope"><joint joint="a" coef="2"/></fixed></tendon>
<actuator><motor name="jet" site="tip" gear="1 0 0 0 0 0" ctrllimited="true" ctrlrange="1 2"/>
 <motor name="push" joint="b" ctrllimited="true" ctrlrange="2 3" group="1"/>
 <general name="hold" joint="a" biastype="affine" biasprm="4 -3 0"/>
 <motor name="pull" tendon="rope" ctrllimited="true" ctrlrange="1 2"/></actuator></mujoco>"""
LIES = '<body name="lug"><inertial pos="0 .1 0" mass=".1" diaginertia=".01 .01 .01"/></body>'
GRAVITY = 'gravity="enable"'


@pytest.mark.parametrize(
    "old,new,said",
    [
        (GRAVITY, 'gravity="disable"', "gravity of the model: (0, 0, -9.81) m/s^2 in a, none in b"),
        (GRAVITY, 'spring="disable"', "springs of the model: on in a, off in b"),
        (GRAVITY, 'damper="disable"', "dampers of the model: on in a, off in b"),
        (GRAVITY, 'actuation="disable"', "actuators of the model: on in a, off in b"),
        ("<option>", '<option actuatorgroupdisable="1">', "switch of actuator 'push': on in a, off in b"),
        ('ctrllimited="true" ctrlrange="2 3"', "", "control range of actuator 'push': (2, 3) in a, none in b"),
        ('ctrllimited="true" ctrlrange="2 3"', 'ctrllimited="false" ctrlrange="2 3"', "(2, 3) in a, none in b"),
        ('biastype="affine"', 'biastype="none"', "bias of actuator 'hold': (4, -3, 0) in a, none in b"),
        ('name="hold" joint="a"', 'name="hold" joint="b"', "target of actuator 'hold': joint 'a' in a, joint 'b' in b"),
        ('pos="0 0 1"', 'pos="0 0 2"', "place of the site of actuator 'jet': (0, 0, 1, 1, 0, 0, 0)"),
        (
            '<joint joint="a" coef',
            '<joint joint="b" coef',
            "attachment of tendon 'rope': joint 'a' in a, joint 'b' in b",
        ),
        ('"b" type="slide"', '"b" type="hinge"', "type of joint 'b': slide in a, hinge in b"),
    ],
)
def test_what_is_no_number_is_named_with_both_values(tmp_path, old, new, said):
    """It alone changes what moves, and with it taken over nothing is left."""
    assert old in MODEL
    comparison = _compared(tmp_path, MODEL.replace(old, new, 1))
    lines = _comparison_lines(comparison, ("a", "b"))
    assert not comparison.alike and any(said in line for line in lines), lines
    assert all(each.influence is not None for each in comparison.influential)
    assert comparison.unexplained_difference < 1e-10 and any("both move alike" in line for line in lines)


@pytest.mark.parametrize(
    "moved,said",
    [
        ("b", "parent of joint 'b': the world in a, joint 'a' in b"),
        ("lug", "supporting joint of body 'lug': joint 'a' in a, joint 'b' in b"),
        ("site", "target of actuator 'jet': a site of body 'a' in a, a site of body 'b' in b"),
        ("tendon", "coefficients of tendon 'rope': 2 in a, (2, 1) in b"),
    ],
)
def test_what_makes_another_tree_is_named_and_said_to_be_left(tmp_path, moved, said):
    text, site = MODEL, '<site name="tip" pos="0 0 1"/>'
    if moved == "b":
        start, end = text.index('<body name="b"'), text.index("</worldbody>")
        text = text[:start] + text[end:]
        text = text.replace(LIES, LIES + MODEL[start:end])
    elif moved == "tendon":
        text = text.replace('coef="2"/>', 'coef="2"/><joint joint="b" coef="1"/>')
    else:
        part = LIES if moved == "lug" else site
        text = text.replace(part, "").replace("</body></worldbody>", f"{part}</body></worldbody>")
    comparison = _compared(tmp_path, text)
    lines = _comparison_lines(comparison, ("a", "b"))
    assert not comparison.alike and any(said in line and "cannot be tried" in line for line in lines), lines
    assert comparison.unexplained_difference > 1e-3 and any("still differ by" in line for line in lines)


def test_a_spring_that_one_file_lacks_brings_its_reference(tmp_path):
    comparison = _compared(tmp_path, MODEL.replace('type="slide"', 'type="slide" stiffness="5" springref=".4"'))
    assert not comparison.alike and comparison.unexplained_difference < 1e-10


def test_paths_of_two_files_are_compared_joint_by_joint(tmp_path):
    """In another order of bodies the same to rounding, with another spring far apart."""
    start, end = MODEL.index('<body name="b"'), MODEL.index("</worldbody>")
    turned = MODEL[:start] + MODEL[end:]
    turned = turned.replace('<body name="a">', MODEL[start:end] + '<body name="a">')
    first, second, third = (
        _twin(tmp_path, text, f"{i}.xml") for i, text in enumerate((MODEL, turned, MODEL.replace('"3"', '"4"')))
    )
    assert first.names == second.names[::-1]
    same, other = compare_two_paths(first, second), compare_two_paths(first, third)
    assert same.distance < 1e-12 and same.horizon == 1.0
    assert other.distance > 1e-3 and other.worst == "joint 'a'" and "most at joint 'a'" in other.line()


def _twin(folder, text, name):
    path = folder / name
    path.write_text(text)
    return read_model_file(path).twin


def _compared(folder, text):
    return compare_models(_twin(folder, MODEL, "a.xml"), _twin(folder, text, "b.xml"), 3)
