"""Masses, inertias, origins and axes of a URDF, read without MuJoCo and compared with the model that MuJoCo's parser
makes of it.

Links that are fixed to one another are one body in MuJoCo: masses, centres and inertias are summed over them. All is
compared in the design position, in the axes of space. After the specification of URDF (ROS): rpy turns about the fixed
x, then y, then z; an axis is (1, 0, 0) where none is given; an inertia is in the axes of its own origin.
"""

from dataclasses import dataclass
from xml.etree import ElementTree

import mujoco
import numpy as np

from models.core.errors import InputError
from models.own_model.file import ModelFile
from models.own_model.names import object_label
from models.own_model.urdf_text import parsed_root
from models.vehicles.spatial import point_mass_inertia

PARSER_TOLERANCE = 1e-6
"""Relative difference allowed between file and parser: the parser keeps all digits, yet computing principal axes costs
some."""
MOVING_JOINT_TYPES = ("revolute", "continuous", "prismatic", "floating", "planar")


@dataclass(frozen=True)
class MisreadNumber:
    """A number that MuJoCo's parser changed: kind, owner, unit, the file's value, and the parser's value."""

    kind: str
    owner: str
    unit: str
    in_file: np.ndarray
    parsed: np.ndarray

    def sentence(self) -> str:
        """Sentence that states the number in the file and as MuJoCo parsed it."""
        said = [", ".join(f"{number:.6g}" for number in np.ravel(each)) for each in (self.in_file, self.parsed)]
        return f"{self.kind} of {self.owner}: ({said[0]}) {self.unit} in the file, ({said[1]}) as MuJoCo parsed it"


@dataclass
class _UrdfLink:
    """Link of a URDF in the design position: its position and axes in space, and the name of the moving link to which
    it is fixed."""

    position: np.ndarray
    axes: np.ndarray
    group: str


@dataclass
class _LinkMass:
    """Mass properties of rigidly connected links: mass (kg), centre (m) and inertia about it (kg m^2), in space."""

    mass: float = 0.0
    centre: np.ndarray | None = None
    inertia: np.ndarray | None = None

    def add(self, mass: float, centre: np.ndarray, inertia: np.ndarray) -> None:
        """Add another mass that is rigidly fixed to this one."""
        if self.centre is None or self.inertia is None:
            self.mass, self.centre, self.inertia = mass, centre, inertia
            return
        total = self.mass + mass
        middle = (self.mass * self.centre + mass * centre) / total if total else centre
        moved = point_mass_inertia(self.mass, self.centre - middle) + point_mass_inertia(mass, centre - middle)
        self.mass, self.centre, self.inertia = total, middle, self.inertia + inertia + moved


def misread_numbers(model_file: ModelFile) -> list[MisreadNumber]:
    """Numbers of a URDF that differ in MuJoCo's compiled model, each with the file's and the parser's value."""
    root = parsed_root(model_file.document.path.read_bytes())
    model, design = model_file.twin.model, mujoco.MjData(model_file.twin.model)
    design.qpos[:] = model.qpos0
    mujoco.mj_kinematics(model, design)
    links, joints = _links_in_place(root, model_file.document.path.name)
    rows = list[MisreadNumber]()
    for name, expected in _masses_of_groups(root, links, model_file.document.path.name).items():
        rows += _compared_mass(model, design, name, expected)
    for name, (anchor, axis) in joints.items():
        rows += _compared_joint(model, design, name, anchor, axis)
    return rows


def _compared_mass(
    mujoco_model: mujoco.MjModel, design_data: mujoco.MjData, body_name: str, expected_mass: _LinkMass
) -> list[MisreadNumber]:
    body = mujoco.mj_name2id(mujoco_model, mujoco.mjtObj.mjOBJ_BODY, body_name)
    stands = body <= 0 or mujoco_model.body_weldid[body] == 0
    if stands or expected_mass.centre is None or expected_mass.inertia is None:
        return []
    axes, owner = design_data.ximat[body].reshape(3, 3), object_label(mujoco_model, "body", body)
    tensor = axes * mujoco_model.body_inertia[body] @ axes.T
    pairs = (
        ("mass", "kg", np.array([expected_mass.mass]), np.array([mujoco_model.body_mass[body]])),
        ("centre of mass", "m", expected_mass.centre, design_data.xipos[body]),
        ("inertia", "kg m^2", expected_mass.inertia, tensor),
    )
    return [
        MisreadNumber(kind, owner, unit, a, b.copy()) for kind, unit, a, b in pairs if not _equal_numbers(a, b, kind)
    ]


def _compared_joint(
    mujoco_model: mujoco.MjModel,
    design_data: mujoco.MjData,
    joint_name: str,
    expected_anchor: np.ndarray,
    expected_axis: np.ndarray,
) -> list[MisreadNumber]:
    joint = mujoco.mj_name2id(mujoco_model, mujoco.mjtObj.mjOBJ_JOINT, joint_name)
    if joint < 0:
        return []
    owner = object_label(mujoco_model, "joint", joint)
    pairs = (
        ("axis", "", expected_axis, design_data.xaxis[joint]),
        ("anchor", "m", expected_anchor, design_data.xanchor[joint]),
    )
    return [
        MisreadNumber(kind, owner, unit, a, b.copy()) for kind, unit, a, b in pairs if not _equal_numbers(a, b, kind)
    ]


def _equal_numbers(expected_numbers: np.ndarray, parsed_numbers: np.ndarray, quantity_name: str) -> bool:
    least = 1.0 if quantity_name in ("axis", "anchor", "centre of mass") else 0.0
    size = max(np.abs(expected_numbers).max(), np.abs(parsed_numbers).max(), least)
    return bool(np.abs(expected_numbers - parsed_numbers).max() <= PARSER_TOLERANCE * size)


def _links_in_place(
    xml_root: ElementTree.Element, urdf_path: str
) -> tuple[dict[str, _UrdfLink], dict[str, tuple[np.ndarray, np.ndarray]]]:
    """Links by name in the design position; and for hinges and slides by name, their anchors and axes in space."""
    joints = list(xml_root.iter("joint"))
    children = {_link_name(joint, "child") for joint in joints}
    links = {
        name: _UrdfLink(np.zeros(3), np.eye(3), name)
        for name in (link.get("name", "") for link in xml_root.iter("link"))
        if name not in children
    }
    axes, waiting = dict[str, tuple[np.ndarray, np.ndarray]](), joints
    while waiting:
        ready = [joint for joint in waiting if _link_name(joint, "parent") in links]
        if not ready:
            return links, axes  # a loop, which MuJoCo's parser has refused
        for joint in ready:
            above, child = links[_link_name(joint, "parent")], _link_name(joint, "child")
            shift, turn = _origin_of(joint, urdf_path)
            moves = joint.get("type") in MOVING_JOINT_TYPES
            link = _UrdfLink(above.position + above.axes @ shift, above.axes @ turn, child if moves else above.group)
            links[child] = link
            if joint.get("type") in MOVING_JOINT_TYPES[:3]:
                axis = _numbers_in_attribute(joint.find("axis"), "xyz", (1.0, 0.0, 0.0), urdf_path)
                axes[joint.get("name", "")] = link.position, link.axes @ (axis / np.linalg.norm(axis))
        waiting = [joint for joint in waiting if joint not in ready]
    return links, axes


def _masses_of_groups(
    xml_root: ElementTree.Element, links: dict[str, _UrdfLink], urdf_path: str
) -> dict[str, _LinkMass]:
    """Mass, centre and inertia of each group of links that are fixed to one another, by the name of its moving link."""
    sums = dict[str, _LinkMass]()
    for element in xml_root.iter("link"):
        inertial, link = element.find("inertial"), links.get(element.get("name", ""))
        if inertial is None or link is None:
            continue
        shift, turn = _origin_of(inertial, urdf_path)
        mass = float(_numbers_in_attribute(inertial.find("mass"), "value", (0.0,), urdf_path)[0])
        tensor, axes = _inertia_tensor(inertial.find("inertia"), urdf_path), link.axes @ turn
        sums.setdefault(link.group, _LinkMass()).add(mass, link.position + link.axes @ shift, axes @ tensor @ axes.T)
    return sums


def _inertia_tensor(xml_element: ElementTree.Element | None, urdf_path: str) -> np.ndarray:
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    xx, xy, xz, yy, yz, zz = (float(_numbers_in_attribute(xml_element, name, (0.0,), urdf_path)[0]) for name in names)
    return np.array(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))


def _link_name(joint_element: ElementTree.Element, end_tag: str) -> str:
    end = joint_element.find(end_tag)
    return "" if end is None else end.get("link", "")


def _origin_of(xml_element: ElementTree.Element, urdf_path: str) -> tuple[np.ndarray, np.ndarray]:
    """Translation (3,) in m and rotation (3, 3) of the <origin> in an element."""
    origin = xml_element.find("origin")
    roll, pitch, yaw = _numbers_in_attribute(origin, "rpy", (0.0, 0.0, 0.0), urdf_path)
    (sa, sb, sc), (ca, cb, cc) = np.sin((roll, pitch, yaw)), np.cos((roll, pitch, yaw))
    x = np.array(((1.0, 0.0, 0.0), (0.0, ca, -sa), (0.0, sa, ca)))
    y = np.array(((cb, 0.0, sb), (0.0, 1.0, 0.0), (-sb, 0.0, cb)))
    z = np.array(((cc, -sc, 0.0), (sc, cc, 0.0), (0.0, 0.0, 1.0)))
    return _numbers_in_attribute(origin, "xyz", (0.0, 0.0, 0.0), urdf_path), z @ y @ x


def _numbers_in_attribute(
    xml_element: ElementTree.Element | None, attribute_name: str, default_numbers: tuple[float, ...], urdf_path: str
) -> np.ndarray:
    """Numbers in an attribute of an element. Raises InputError where they are not numbers, or not as many as wanted."""
    text = None if xml_element is None else xml_element.get(attribute_name)
    if text is None:
        return np.array(default_numbers)
    try:
        numbers = np.array([float(part) for part in text.split()])
    except ValueError:
        raise InputError(urdf_path, attribute_name, text, "must be numbers") from None
    if len(numbers) != len(default_numbers):
        raise InputError(urdf_path, attribute_name, text, f"must be {len(default_numbers)} numbers")
    return numbers
