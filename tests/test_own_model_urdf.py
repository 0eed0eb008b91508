"""URDF as others write it, files in other folders, and what a refusal says to do about it: each remedy is followed."""

import re

import pytest

from models.core.errors import InputError
from models.own_model.certificate import certificate
from models.own_model.file import read_model_file
from models.own_model.urdf import misread_numbers

BOX = '<geometry><box size=".1 .2 .3"/></geometry>'
ROBOT = """<?xml version="1.0"?>
<!-- for other programs: -->
<robot name="r">
  <gazebo><plugin filename="libgazebo.so" name="p"><include file="../../x"/></plugin></gazebo>
  <transmission name="t"><joint name="j"/></transmission>
  <link name="base">
    <visual><geometry><mesh filename="../missing.dae"/></geometry></visual>
    <inertial><mass value="1e-6"/><inertia ixx="1" ixy="5" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
  </link>
  <link name="arm">
    <inertial><origin xyz=".1 0 .2"/><mass value="2"/>
      <inertia ixx=".1" ixy="0" ixz="0" iyy=".1" iyz="0" izz=".1"/></inertial>
    <collision><geometry><mesh filename="../missing.stl"/></geometry></collision>
  </link>
  <joint name="j" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/></joint>
</robot>"""
NO_MASS = ROBOT.replace('izz=".1"', 'izz=".3"')
EMPTY = re.sub(r"<inertial><origin.*?</inertial>", "", ROBOT, flags=re.DOTALL).replace(
    '<collision><geometry><mesh filename="../missing.stl"/></geometry></collision>', ""
)
SHAPED = EMPTY.replace('<link name="arm">', f'<link name="arm"><collision>{BOX}</collision>')
MESHED = EMPTY.replace(
    '<link name="arm">', '<link name="arm"><collision><geometry><mesh filename="m.obj"/></geometry></collision>'
)
CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
BALL = """<robot name="ball"><link name="ball">
<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link></robot>"""


def _file(folder, text, name="a.urdf"):
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def _refusal(path, **options):
    with pytest.raises(InputError) as error:
        read_model_file(path, **options)
    return str(error.value)


def test_what_other_programs_read_is_passed_over_and_told(tmp_path):
    """Nor does a link that stands need an inertia that a mass can have, or a drawn shape its file."""
    file = read_model_file(_file(tmp_path, ROBOT))
    assert "moves nothing here: 1 <gazebo>, 1 <transmission>" in " ".join(file.notes)
    assert "link 'base' stands on the world" in " ".join(file.notes)
    assert misread_numbers(file) == [] and all(row.alike for row in certificate(file.twin, 5))


@pytest.mark.parametrize(
    "old,new,said",
    [
        ("<gazebo>", "<mujoco><extension><plugin plugin='x'/></extension></mujoco><gazebo>", "line 4 = '<extension>'"),
        ('xyz=".1 0 .2"', 'xyz="$(arg x)"', "line 11"),
        ('izz=".1"', 'izz=".3"', "(a.urdf:10)"),
        ('<mesh filename="../missing.stl"/>', "<mesh", "line 13: is no well-formed XML"),
        ("<gazebo>", "<include file='../x.urdf'/><gazebo>", ""),
    ],
    ids=["plugin", "number", "inertia", "xml", "include"],
)
def test_refusals_name_the_line_of_the_file(tmp_path, old, new, said):
    path = _file(tmp_path, ROBOT.replace(old, new))
    assert said in _refusal(path) if said else read_model_file(path).twin.size == 1


@pytest.mark.parametrize("text,asked", [(NO_MASS, "balanceinertia"), (EMPTY, "boundmass")], ids=["inertia", "mass"])
def test_what_a_refusal_of_the_parser_says_helps(tmp_path, text, asked):
    said = _refusal(_file(tmp_path, text))
    compiler = re.search(r"<compiler .*?/>", said)
    assert compiler and asked in compiler[0] and "within a <mujoco> below <robot>" in said and "spec" not in said
    path = _file(tmp_path, text.replace("<gazebo>", f"<mujoco>{compiler[0]}</mujoco><gazebo>"))
    assert all(row.alike for row in certificate(read_model_file(path).twin, 5))


def test_a_link_without_a_joint_is_set_free_as_the_refusal_says(tmp_path):
    assert "a joint of type floating, from a link before it, sets it free" in _refusal(_file(tmp_path, BALL))
    joint = '<link name="w"/><joint name="j" type="floating"><parent link="w"/><child link="ball"/></joint></robot>'
    assert read_model_file(_file(tmp_path, BALL.replace("</robot>", joint))).twin.size == 6


def test_masses_that_mujoco_makes_of_shapes_are_told(tmp_path):
    assert "link 'arm' without <inertial>: MuJoCo takes 1000 kg/m^3" in " ".join(
        read_model_file(_file(tmp_path, SHAPED)).notes
    )


def test_shapes_are_looked_for_beside_the_file(tmp_path, monkeypatch):
    """Not in the current folder, where another one of that name is."""
    for folder, size in (("in", 1), ("elsewhere", 2)):
        _file(tmp_path, CORNERS.replace("1", str(size)) if size > 1 else CORNERS, f"{folder}/m.obj")
    path = _file(tmp_path, MESHED, "in/a.urdf")
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert read_model_file(path).twin.model.body_mass[1] == pytest.approx(1000.0 / 6.0)
    (tmp_path / "in" / "m.obj").unlink()
    assert "What shapes need must lie beside the model" in _refusal(path)


def test_a_part_of_models_is_told_from_a_model(tmp_path):
    path = _file(tmp_path, "<mujocoinclude><worldbody/></mujocoinclude>", "part.xml")
    assert "is a part of other models: give the model that includes it" in _refusal(path)
    path = _file(tmp_path, '<mujoco><texture name="t"/></mujoco>', "part.xml")
    assert "Is it a part that another model includes?" in _refusal(path)


def test_a_folder_above_is_read_where_the_user_names_it(tmp_path):
    """The refusal names that folder; it does not name a whole disk."""
    body = "<worldbody><body><joint/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body></worldbody>"
    _file(tmp_path, f"<mujoco>{body}</mujoco>", "parts/b.xml")
    path = _file(tmp_path, '<mujoco><include file="../parts/b.xml"/></mujoco>', "models/a.xml")
    assert f"`--folder {tmp_path}`" in _refusal(path)
    assert read_model_file(path, allowed_folder=tmp_path).twin.size == 1
    assert "must be a folder that holds" in _refusal(path, allowed_folder=tmp_path / "parts")
    path = _file(tmp_path, '<mujoco><include file="/x.xml"/></mujoco>', "models/a.xml")
    assert "--folder" not in _refusal(path)
    path = _file(tmp_path, '<mujoco><include file="gone.xml"/></mujoco>', "models/a.xml")
    assert "a.xml: line 1 = 'gone.xml': <include> names a file that is not there" in _refusal(path)
