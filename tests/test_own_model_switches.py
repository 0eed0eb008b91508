"""Switches of a file that change what acts: each build does as MuJoCo does, or the file is refused."""

import pytest

from models.core.errors import InputError
from models.own_model.certificate import certificate
from models.own_model.file import read_model_file

MASS = '<inertial pos=".1 0 .3" mass="1" diaginertia=".1 .08 .05"/>'
MOTOR = '<actuator><motor joint="a"/></actuator>'


def _lifted(flag, actuated, motor):
    joint = '<joint name="{}" axis="0 1 0" stiffness="2" actuatorgravcomp="{}"/>'
    first, second = (joint.format(name, str(by).lower()) for name, by in zip("ab", actuated, strict=True))
    body = f'<body name="fore" pos="0 0 1" gravcomp=".3">{second}{MASS}</body>'
    return f"""<mujoco><option><flag {flag}/></option><worldbody>
<body name="upper" gravcomp=".7">{first}{MASS}{body}</body></worldbody>{motor}</mujoco>"""


@pytest.mark.parametrize("motor", ["", MOTOR], ids=["no actuator", "an actuator"])
@pytest.mark.parametrize("actuated", [True, False])
@pytest.mark.parametrize("flag", ['gravity="enable"', 'spring="disable" damper="disable"', 'actuation="disable"'])
def test_weight_is_compensated_where_mujoco_does(tmp_path, motor, actuated, flag):
    path = tmp_path / "a.xml"
    path.write_text(_lifted(flag, (actuated, actuated), motor))
    twin = read_model_file(path).twin
    none = "spring" in flag or (actuated and (not motor or "actuation" in flag))
    assert len(twin.driven.ground_springs) == (0 if none else 2)
    assert all(row.alike for row in certificate(twin, 3))


def test_weight_that_is_compensated_at_some_joints_alone_is_refused(tmp_path):
    path = tmp_path / "a.xml"
    path.write_text(_lifted('gravity="enable"', (False, True), ""))
    with pytest.raises(InputError, match=r"gravity_compensation: body 'fore' \(a.xml:2\)"):
        read_model_file(path)
    twin = read_model_file(path, ("gravity_compensation",)).twin
    assert len(twin.driven.ground_springs) == 1 and all(row.alike for row in certificate(twin, 3))


@pytest.mark.parametrize("switch,touching", [("enable", False), ("disable", True)])
def test_bodies_and_what_rides_on_them_touch_where_mujoco_lets_them(tmp_path, switch, touching):
    ball, path = '<geom name="{}" size=".3" mass="0"/>', tmp_path / "a.xml"
    inner = f'<body name="b"><joint name="b"/>{MASS}{ball.format("two")}</body>'
    flag = f'<option><flag filterparent="{switch}"/></option>'
    body = f'<body name="a"><joint name="a" axis="0 1 0"/>{MASS}{ball.format("first")}{inner}</body>'
    path.write_text(f"<mujoco>{flag}<worldbody>{body}</worldbody></mujoco>")
    if touching:
        with pytest.raises(InputError, match="contact: geom 'first'"):
            read_model_file(path)
    assert all(row.alike for row in certificate(read_model_file(path, ("contact",)).twin, 3))


def test_switched_off_constraints_are_not_built(tmp_path):
    path = tmp_path / "a.xml"
    body = f'<body><joint name="a" axis="0 1 0" frictionloss=".2"/>{MASS}</body>'
    tie = '<equality><joint joint1="a"/></equality>'
    path.write_text(f'<mujoco><option><flag constraint="disable"/></option><worldbody>{body}</worldbody>{tie}</mujoco>')
    twin = read_model_file(path).twin
    assert not twin.driven.tied and not twin.driven.frictions and all(row.alike for row in certificate(twin, 3))
