"""Model files in MJCF and URDF, from a cart to a chain of 30 joints, and differences to be planted in them.

``twinrig twin`` is held to them by the case ``twin_files`` and by the tests.
"""

import numpy as np

JOINTED = """<mujoco model="jointed"><option gravity="1 2 -9"/><worldbody>
<body name="arm" pos=".1 .2 .3" euler="20 30 40">
  <joint name="hinge" axis="1 2 3" pos=".1 0 .2" stiffness="2" springref="10" ref="5" damping=".3" armature=".02"/>
  <inertial pos=".3 .1 .1" mass="2" fullinertia=".3 .4 .5 .02 .03 .04"/>
  <body name="slider" pos=".3 0 0" euler="0 50 0">
    <joint name="slide" type="slide" axis="0 1 1" damping="2" stiffness="30"/>
    <joint name="twist" axis="0 0 1" pos="0 .1 0"/>
    <inertial pos=".1 .1 .1" mass="1.5" diaginertia=".1 .12 .15"/></body>
  <body name="bob" pos="-.3 0 0" euler="0 50 10" gravcomp=".5">
    <joint name="ball" type="ball" pos=".1 .2 .3"/>
    <inertial pos=".1 .1 .1" quat=".9 .1 .3 .2" mass=".7" diaginertia=".1 .12 .15"/>
    <body name="weight" pos="0 0 1"><inertial pos="0 .1 0" mass=".2" diaginertia=".01 .01 .01"/></body></body>
</body>
<body name="free" pos="1 1 1" euler="10 20 30"><freejoint name="root"/>
  <inertial pos=".1 0 0" mass="3" diaginertia=".2 .3 .4"/>
  <body name="wheel"><joint name="spin" axis="0 1 0" damping=".05"/>
    <inertial pos="0 0 0" mass=".4" diaginertia=".01 .02 .01"/></body></body>
</worldbody>
<tendon><fixed name="belt" stiffness="3" damping=".1" springlength=".1">
  <joint joint="hinge" coef="2"/><joint joint="slide" coef="-1"/><joint joint="twist" coef=".5"/></fixed></tendon>
<actuator><motor name="push" joint="hinge" gear="3" ctrlrange="1 2" ctrllimited="true"/>
  <position name="servo" joint="twist" kp="10" kv=".5"/>
  <velocity name="speed" tendon="belt" kv=".7" gear="2"/></actuator>
</mujoco>"""

CART = """<mujoco model="cart"><worldbody>
<body name="hand" mocap="true"><inertial pos="0 0 0" mass="5" diaginertia="1 1 1"/></body>
<body name="cart"><joint name="x" type="slide" axis="1 0 0" damping=".1"/>
<inertial pos="0 0 0" mass="1" diaginertia=".1 .1 .1"/><body name="pole"><joint name="tilt" axis="0 1 0"/>
<inertial pos="0 0 .5" mass=".2" diaginertia=".02 .02 .001"/></body></body></worldbody></mujoco>"""

ARM_URDF = """<?xml version="1.0"?>
<robot name="arm"><link name="base"/>
<link name="upper"><inertial><origin xyz="0.1 0.02 0" rpy="0.3 0.4 0.5"/><mass value="2"/>
<inertia ixx="0.2" ixy="0.01" ixz="0.02" iyy="0.3" iyz="0.015" izz="0.4"/></inertial>
<collision><geometry><mesh filename="package://nowhere/upper.stl"/></geometry></collision></link>
<link name="fore"><inertial><origin xyz="0 0 0.2" rpy="0 0 0.7"/><mass value="1"/>
<inertia ixx="0.05" ixy="0" ixz="0" iyy="0.06" iyz="0" izz="0.02"/></inertial></link>
<link name="tool"><inertial><origin xyz="0.01 0 0.05"/><mass value="0.3"/>
<inertia ixx="0.001" ixy="0" ixz="0" iyy="0.002" iyz="0" izz="0.0015"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
<origin xyz="0 0 0.3" rpy="0.1 0.2 0.3"/><axis xyz="0 1 1"/><limit lower="-2" upper="1" effort="10" velocity="1"/>
<dynamics damping="0.2"/></joint>
<joint name="elbow" type="continuous"><parent link="upper"/><child link="fore"/><origin xyz="0.4 0 0" rpy="0 0.5 0"/>
<axis xyz="0 0 1"/></joint>
<joint name="flange" type="fixed"><parent link="fore"/><child link="tool"/><origin xyz="0 0 0.4" rpy="1 0 0"/></joint>
</robot>"""


TIED = """<mujoco model="tied"><worldbody><site name="hook" pos="0 .3 1"/>
<body name="arm" pos="0 0 .5"><joint name="swing" axis="1 .2 0"/>
 <inertial pos="0 0 -.2" mass="1" diaginertia=".1 .1 .02"/>
 <site name="elbow" pos=".1 0 -.4" euler="10 20 30"/><body name="hand" pos="0 0 -.4"><joint name="wrist" axis="0 1 0"/>
  <joint name="reach" type="slide" axis="0 0 1"/><inertial pos=".1 0 -.1" mass=".5" diaginertia=".02 .03 .01"/>
  <site name="tip" pos=".3 .1 -.2"/></body></body>
<body name="buoy" pos="1 1 1"><freejoint/><inertial pos="0 .1 0" mass="2" diaginertia=".1 .2 .15"/>
 <site name="ring" pos=".1 .2 .3"/></body></worldbody>
<tendon>
 <spatial name="rope" stiffness="40" damping="2" springlength=".7"><site site="hook"/><site site="tip"/></spatial>
 <spatial name="rubber" stiffness="25" springlength="0"><site site="elbow"/><site site="ring"/></spatial>
 <spatial name="seen"><site site="hook"/><site site="ring"/></spatial></tendon></mujoco>"""
"""Model with spatial tendons: a spring from the ground, a spring of zero length between bodies, one without force."""


GEARED = """<mujoco model="geared"><worldbody>
<body name="crank" pos="0 0 1"><joint name="turn" axis="0 1 .3" damping=".2"/>
 <inertial pos=".1 0 .2" mass="1" diaginertia=".1 .12 .05"/>
 <body name="hand" pos=".3 0 0"><joint name="swing" axis="1 0 .2" ref="20" frictionloss=".4"/>
  <inertial pos="0 .1 -.2" mass=".6" diaginertia=".03 .03 .01"/></body></body>
<body name="rack" pos="1 0 0" euler="0 20 10"><joint name="slide" type="slide" axis="1 0 .2" frictionloss="1.5"/>
 <inertial pos="0 0 .1" mass="2" diaginertia=".1 .1 .1"/>
 <body name="flap"><joint name="fold" axis="0 1 0" stiffness="3"/>
  <inertial pos=".2 0 0" mass=".3" diaginertia=".01 .01 .02"/></body>
 <body name="lid" pos="0 .2 0"><joint name="cover" axis="1 0 0"/>
  <inertial pos="0 0 .2" mass=".2" diaginertia=".01 .01 .02"/></body></body></worldbody>
<equality><joint name="gear" joint1="slide" joint2="turn" polycoef=".1 .25 0 0 0"/>
 <joint name="shut" joint1="cover" polycoef=".3 0 0 0 0" solimp=".95 .99 .001"/></equality></mujoco>"""
"""Model with dry friction in joints, a rack that a joint equality couples to a crank, and a lid that is held shut."""


LINKED = """<mujoco model="linked"><worldbody>
<body name="crank"><joint name="crank" axis="0 1 0" damping=".1" armature=".02"/>
 <inertial pos="0 0 .1" mass="1" diaginertia=".02 .02 .01"/>
 <body name="rod" pos="0 0 .2"><joint name="rod" axis="0 1 0"/>
  <inertial pos=".3 0 0" mass=".6" diaginertia=".01 .03 .03"/></body></body>
<body name="rocker" pos=".6 0 -.2"><joint name="rocker" axis="0 1 0"/>
 <inertial pos="0 0 .15" mass="1.2" diaginertia=".03 .03 .01"/></body>
<body name="box" pos="0 1 0" euler="10 20 30"><freejoint name="root"/>
 <inertial pos=".1 0 .05" mass="2" diaginertia=".05 .06 .07"/><site name="lug" pos=".1 .2 .1" euler="30 0 10"/>
 <body name="lid" pos="0 .2 .1"><joint name="hinge" axis="1 0 .2" armature=".05"/>
  <inertial pos="0 .1 0" mass=".4" diaginertia=".01 .01 .01"/></body></body>
<body name="arm" pos=".2 1.3 0"><joint name="swing" axis="1 .2 0"/>
 <inertial pos="0 .1 0" mass=".7" diaginertia=".02 .01 .02"/><site name="tip" pos="0 .3 .1" euler="0 20 0"/></body>
</worldbody><equality>
 <connect name="loop" body1="rod" body2="rocker" anchor=".6 0 0" solimp=".95 .99 .001"/>
 <weld name="grip" site1="lug" site2="tip" solimp=".92 .95 .001" torquescale="2"/></equality></mujoco>"""
"""Model with a plane four-bar loop, whose closing joint has redundant constraints, and a box welded to an arm."""

LOOP_CONSTRAINT, GRIP_CONSTRAINT = (
    '<connect name="loop" body1="rod" body2="rocker" anchor=".6 0 0"',
    '<weld name="grip" site1="lug" site2="tip"',
)
BOX_WELDED_TO_CRANK = LINKED.replace(
    GRIP_CONSTRAINT, '<weld name="grip" body1="box" body2="crank" relpose=".1 .4 .1 .9 .1 .2 .1" anchor=".05 0 0"'
)
"""``LINKED`` with the box welded to the crank instead, at a relative pose that differs from the one in the file."""
BOX_ON_GROUND_POINT = LINKED.replace(GRIP_CONSTRAINT, '<connect name="grip" body1="box" anchor=".1 .2 .1"').replace(
    'torquescale="2"', ""
)
"""``LINKED`` with a point of the box fixed to the ground instead."""


def random_chain(body_count: int, seed: int = 1) -> str:
    """MJCF text of a chain of ``body_count`` bodies on hinges and slides with springs, dampers and armatures, all
    random."""
    draw = np.random.default_rng(seed)

    def row(lower_limit: float, upper_limit: float, value_count: int) -> str:
        return " ".join(f"{number:.4g}" for number in draw.uniform(lower_limit, upper_limit, value_count))

    text = ""
    for i in range(body_count):
        kind = "slide" if i % 5 == 4 else "hinge"
        text += (
            f'<body name="b{i}" pos="{row(-0.3, 0.3, 3)}" euler="{row(-90, 90, 3)}">'
            f'<joint name="j{i}" type="{kind}" axis="{row(-1, 1, 3)}" pos="{row(-0.1, 0.1, 3)}" '
            f'damping="{row(0, 1, 1)}" '
            f'stiffness="{row(0, 5, 1)}" springref="{row(-10, 10, 1)}" armature="{row(0.1, 0.2, 1)}"/>'
            f'<inertial pos="{row(-0.1, 0.1, 3)}" quat="{row(-1, 1, 4)}" mass="{row(0.5, 2, 1)}" '
            f'diaginertia="{row(0.1, 0.15, 3)}"/>'
        )
    return f'<mujoco model="chain"><worldbody>{text}{"</body>" * body_count}</worldbody></mujoco>'


def random_tree(body_count: int, seed: int) -> str:
    """MJCF text of ``body_count`` bodies: free ones with branches on hinges, slides and ball joints; all numbers
    random."""
    draw = np.random.default_rng(seed)
    children = dict[int, list[int]]()
    for i in range(1, body_count):
        children.setdefault(int(draw.integers(i)), []).append(i)

    def row(lower_limit: float, upper_limit: float, value_count: int) -> str:
        return " ".join(f"{number:.4g}" for number in draw.uniform(lower_limit, upper_limit, value_count))

    def body(body_number: int) -> str:
        kind = "free" if body_number == 0 else str(draw.choice(["hinge", "hinge", "slide", "ball"]))
        laws = f'damping="{row(0, 1, 1)}" stiffness="{row(0, 5, 1)}"' if kind in ("hinge", "slide") else ""
        return (
            f'<body name="b{body_number}" pos="{row(-0.3, 0.3, 3)}" euler="{row(-90, 90, 3)}">'
            f'<joint name="j{body_number}" type="{kind}" axis="{row(-1, 1, 3)}" '
            f'pos="{"0 0 0" if body_number == 0 else row(-0.1, 0.1, 3)}" '
            f'{laws}/><inertial pos="{row(-0.1, 0.1, 3)}" quat="{row(-1, 1, 4)}" mass="{row(0.5, 2, 1)}" '
            f'diaginertia="{row(0.1, 0.15, 3)}"/>{"".join(map(body, children.get(body_number, [])))}</body>'
        )

    return f'<mujoco model="tree"><worldbody>{body(0)}</worldbody></mujoco>'


def model_with_change(model_text: str, element_name: str, old_text: str, new_text: str) -> str:
    """Text of a model file in which the first ``old_text`` after the name of an element is replaced by ``new_text``."""
    there = model_text.index(old_text, model_text.index(f'"{element_name}"'))
    return model_text[:there] + new_text + model_text[there + len(old_text) :]


PLANTED_DIFFERENCES = [
    ("hinge", 'damping=".3"', 'damping=".31"', "damping", "joint 'hinge'", "0.3 N m s/rad"),
    ("hinge", 'armature=".02"', 'armature=".03"', "armature", "joint 'hinge'", "0.02 kg m^2"),
    ("hinge", 'armature=".02"', "", "armature", "joint 'hinge'", "none in b.xml"),
    ("hinge", 'stiffness="2"', 'stiffness="2.1"', "stiffness", "joint 'hinge'", "2 N m/rad"),
    ("hinge", 'springref="10"', 'springref="11"', "spring reference", "joint 'hinge'", "0.0872665 rad"),
    ("hinge", 'axis="1 2 3"', 'axis="1 2 3.1"', "axis", "joint 'hinge'", "0.267261"),
    ("hinge", 'pos=".1 0 .2"', 'pos=".1 0 .21"', "anchor", "joint 'hinge'", "0.21"),
    ("hinge", 'mass="2"', 'mass="2.2"', "mass", "body 'arm'", "2.2 kg"),
    ("arm", 'pos=".3 .1 .1"', 'pos=".3 .1 .12"', "centre of mass", "body 'arm'", "0.12"),
    ("arm", 'fullinertia=".3 .4 .5 .02', 'fullinertia=".3 .4 .5 .03', "inertia", "body 'arm'", "0.03"),
    ("slide", 'damping="2"', 'damping="2.5"', "damping", "joint 'slide'", "2 N s/m"),
    ("slide", 'stiffness="30"', 'stiffness="31"', "stiffness", "joint 'slide'", "30 N/m"),
    ("slide", 'axis="0 1 1"', 'axis="0 1 1.1"', "axis", "joint 'slide'", "0.707107"),
    ("twist", 'axis="0 0 1"', 'axis="0 .1 1"', "axis", "joint 'twist'", "0.0995037"),
    ("twist", 'pos="0 .1 0"', 'pos=".05 .1 0"', "anchor", "joint 'twist'", "0.05"),
    ("twist", 'mass="1.5"', 'mass="1.6"', "mass", "body 'slider'", "1.6 kg"),
    ("twist", 'diaginertia=".1 .12 .15"', 'diaginertia=".1 .12 .16"', "inertia", "body 'slider'", "0.16"),
    ("bob", 'gravcomp=".5"', "", "gravity compensation", "body 'bob'", "none in b.xml"),
    ("ball", 'pos=".1 .2 .3"', 'pos=".1 .2 .4"', "anchor", "joint 'ball'", "0.4"),
    ("ball", 'quat=".9 .1 .3 .2"', 'quat=".9 .1 .3 .3"', "orientation of the inertia", "body 'bob'", "kg m^2"),
    ("weight", 'mass=".2"', 'mass=".3"', "mass", "body 'weight'", "0.3 kg"),
    ("root", 'mass="3"', 'mass="3.1"', "mass", "body 'free'", "3.1 kg"),
    ("root", 'diaginertia=".2 .3 .4"', 'diaginertia=".2 .3 .41"', "inertia", "body 'free'", "0.41"),
    ("spin", 'damping=".05"', "", "damping", "joint 'spin'", "none in b.xml"),
    ("spin", 'axis="0 1 0"', 'axis="0 -1 0"', "axis", "joint 'spin'", "-1"),
    ("belt", 'stiffness="3"', 'stiffness="4"', "stiffness", "tendon 'belt'", "4 N/m"),
    ("belt", 'springlength=".1"', 'springlength=".2"', "spring length", "tendon 'belt'", "0.2 m"),
    ("belt", 'coef="2"', 'coef="2.5"', "coefficients", "tendon 'belt'", "2.5"),
    ("push", 'gear="3"', 'gear="4"', "gear", "actuator 'push'", "4"),
    ("jointed", 'gravity="1 2 -9"', 'gravity="1 2 -9.1"', "gravity", "the model", "-9.1"),
]
"""Differences to be planted in ``JOINTED``: the name after which the text is changed, the old text and the new one;
then what the comparison must report: the quantity, its element, and a piece of the text on its size."""
