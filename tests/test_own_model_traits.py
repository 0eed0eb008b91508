"""Traits of models that others wrote, each of which a build or the certificate once got wrong."""

import re
from dataclasses import replace

import pytest

from models.core.errors import InputError
from models.own_model.builds import sliding_states
from models.own_model.certificate import certificate, comparison_states
from models.own_model.constraints import plain_constraints
from models.own_model.file import read_model_file
from models.own_model.limits import limits_struck
from models.own_model.path import FILE_BUILD_NAME, compare_paths, start_of_path
from models.own_model.states import file_limits

ALMOST_X = """
<mujoco><worldbody>
  <body><joint name="j" axis="1 5e-9 0"/><inertial pos="3 .1 .2" mass="2" diaginertia=".1 .2 .3"/>
    <body pos="4 0 0"><joint name="k" axis="0 1 0"/><inertial pos="2 .3 0" mass="1" diaginertia=".01 .02 .03"/></body>
  </body>
</worldbody></mujoco>"""
"""An axis whose first component rounds to 1, as angles written with ten digits give: 5e-9 of it are seen in masses."""
GEARED_DOWN = """
<mujoco><default><joint axis="0 1 0" armature="2" frictionloss="1" damping=".01"/></default><worldbody>
  <body><joint name="a"/><inertial pos=".1 0 0" mass=".2" diaginertia="1e-4 1e-4 1e-4"/>
    <body pos=".3 0 0"><joint name="b"/><inertial pos="0 0 0" mass="1e-9" diaginertia="1e-9 1e-9 1e-9"/></body>
  </body>
</worldbody></mujoco>"""
"""Joints whose inertia is that of their rotors alone, which makes MuJoCo's dry friction stiff."""
STUCK = GEARED_DOWN.replace('armature="2" frictionloss="1"', 'frictionloss="8"').replace("1e-9", "1e-5")
"""The same without rotors, and with more friction: in MuJoCo it sticks at any rate."""
ROTORS = "<mujoco><worldbody>{}</worldbody></mujoco>".format(
    "".join(
        f'<body pos=".2 {y} .1" euler="0 0 {turn}"><joint axis="0 0 1"/>'
        '<inertial pos="0 0 .023" mass=".005" diaginertia="1.4e-4 1.4e-4 2.74e-4"/></body>'
        for y, turn in ((-0.1, 13), (0.2, 47), (0.3, 110))
    )
)
"""Rotors about their own axes: nothing accelerates them, to the last digit in one build and to rounding in another."""
GRIPPER = """
<mujoco><compiler angle="radian" autolimits="true"/><worldbody>
  <body><joint name="driver" axis="0 1 0" range="0 .8"/><inertial pos=".1 0 .05" mass=".2" diaginertia=".01 .01 .01"/>
    <body pos=".2 0 0"><joint name="coupler" axis="0 1 0" range="-2 2"/>
      <inertial pos=".1 0 0" mass=".1" diaginertia=".01 .01 .01"/><site name="tip" pos=".2 0 .1"/></body></body>
  <body pos="0 0 .2"><joint name="link" axis="0 1 0" range="-.8 .8"/>
    <inertial pos=".1 0 0" mass=".1" diaginertia=".01 .01 .01"/><site name="end" pos=".4 0 -.1"/></body>
</worldbody><equality><connect site1="tip" site2="end"/></equality></mujoco>"""
"""A finger that begins at the ends of its ranges: the nearest places where it closes often lie beyond."""


ALMOST_TURNED = """
<mujoco><worldbody><body quat="1 0 5e-9 0"><joint axis="1 0 0"/><joint axis="0 1 0"/><joint axis="0 0 1"/>
  <inertial pos="0 0 0" mass="1" diaginertia=".01 .02 .029"/>
  <body pos=".1 0 0"><joint axis="0 1 0"/><inertial pos=".1 0 .1" mass=".1" diaginertia="1e-3 1e-3 1e-3"/></body>
</body></worldbody></mujoco>"""
"""Axes of inertia that a compiler takes for those of the body, by an angle of 1e-8."""
KNOBS = """
<mujoco><default><joint axis="0 0 1" armature=".001" damping=".01"/></default><worldbody>
  <body><joint name="knob"/><inertial pos="0 0 0" mass=".1" diaginertia=".01 .01 .01"/></body>
  <body pos="1 0 0"><body pos="0 0 1"><body><joint name="burner" type="slide"/>
    <inertial pos="0 0 0" mass=".01" diaginertia="1 1 1"/></body></body></body>
</worldbody><equality><joint joint1="knob" joint2="burner" polycoef="0 174 0 0 0"/></equality></mujoco>"""
"""A slide with a rotor, on parts that stand, and a soft constraint: how soft, the rotor's inertia says, too."""
IDS = ("axis", "geared down", "stuck", "rotors", "gripper", "turned", "knobs")


def _twin(folder, text):
    path = folder / "a.xml"
    path.write_text(text)
    return read_model_file(path).twin


@pytest.mark.parametrize("text", [ALMOST_X, GEARED_DOWN, STUCK, ROTORS, GRIPPER, ALMOST_TURNED, KNOBS], ids=IDS)
def test_every_build_moves_as_the_file_does(tmp_path, text):
    for row in certificate(_twin(tmp_path, text), 20):
        assert row.alike, row


def test_friction_that_sticks_in_mujoco_has_its_whole_force_elsewhere(tmp_path):
    """1 % more of it is seen in both builds with Coulomb's law; MuJoCo's holds still whatever it is."""
    twin = _twin(tmp_path, STUCK)
    assert sliding_states(twin, comparison_states(twin, 20)) == [] and len(comparison_states(twin, 20)) >= 18
    more = tuple(replace(friction, force=1.01 * friction.force) for friction in twin.driven.frictions)
    wrong = certificate(replace(twin, driven=replace(twin.driven, frictions=more)), 20)
    assert [row.acceleration > 1e-5 for row in wrong] == [True, False, True]


MUSCLED = """
<mujoco><worldbody><geom name="floor" type="plane" size="1 1 1"/>
  <body pos="0 0 1"><joint name="j" axis="0 1 0" damping=".1"/><geom name="ball" size=".1" pos=".3 0 0"/></body>
</worldbody><actuator><general name="m" joint="j" dyntype="filter" dynprm=".1" gainprm="2"/>
  <motor name="t" joint="j" delay=".01" nsample="5"/></actuator>
</mujoco>"""
"""Actuators with states: activation, and a history of controls."""
SHEET = """
<mujoco><worldbody><body><joint/><geom size=".1"/></body>
  <flexcomp name="sheet" type="grid" count="3 3 1" spacing=".1 .1 .1" radius=".01" dim="2"/></worldbody></mujoco>"""


def test_one_refusal_names_all_that_has_no_equal_and_its_option_helps(tmp_path):
    path = tmp_path / "a.xml"
    path.write_text(MUSCLED)
    with pytest.raises(InputError) as error:
        read_model_file(path)
    said = str(error.value)
    assert "geom 'floor' (a.xml:2)" in said and "actuator 'm' (a.xml:4)" in said
    kinds = re.search(r"They have no equal .* with `--without ([\w,]+)`", said)
    assert kinds and kinds[1] == "contact,actuator"
    twin = read_model_file(path, kinds[1].split(",")).twin
    assert compare_paths(twin).alike and set(compare_paths(twin).distances) == {"mujoco", "plain", FILE_BUILD_NAME}


@pytest.mark.parametrize("without", [(), ("flex",), ("contact", "flex")])
def test_a_refusal_of_deformable_bodies_offers_no_option(tmp_path, without):
    path = tmp_path / "a.xml"
    path.write_text(SHEET)
    with pytest.raises(InputError, match=r"sheet.*cannot be left out") as error:
        read_model_file(path, without)
    assert "--without" not in str(error.value)


def test_a_path_begins_where_dry_friction_slides_and_no_limit_acts(tmp_path):
    """The first random state has the joint at rest beyond the range of a tendon; where no state slides, it is told."""
    limited = GEARED_DOWN.replace(
        "</worldbody>",
        '</worldbody><tendon><fixed limited="true" range="-1 1"><joint joint="a" coef="1"/></fixed></tendon>',
    )
    twin = _twin(tmp_path, limited)
    q, v = start_of_path(twin)
    assert limits_struck(twin)(q) == () and sliding_states(twin, [(q, v)])
    report = compare_paths(_twin(tmp_path, STUCK))
    assert report.alike and any("dry friction that sticks give way" in line for line in report.lines())


def test_states_that_close_a_finger_stay_in_its_ranges(tmp_path):
    twin = _twin(tmp_path, GRIPPER)
    low, high = file_limits(twin.model)
    for q, _ in comparison_states(twin, 20):
        assert ((low <= q) & (q <= high)).all() and abs(plain_constraints(twin).gap(q).size).max() < 1e-11
