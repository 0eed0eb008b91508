"""A rigid body with its joint and springs to the ground, read from an Adams model file.

Everything is in SI and in the axes of the ground, at the start. The ground's markers lie where the file says; those of
the body follow its own frame. Inertia is about the centre of mass.
"""

import ast
import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from models.core.errors import InputError
from validation.adams_joints.model_file import Statement, read_statements

Kind = Literal["revolute", "prismatic", "cylindrical", "spherical", "universal", "distance", "free"]
JOINT_KINDS: dict[str, Kind] = {
    "REVOLUTE": "revolute",
    "TRANSLATIONAL": "prismatic",
    "CYLINDRICAL": "cylindrical",
    "SPHERICAL": "spherical",
    "HOOKE": "universal",
}
ASSEMBLY_TOLERANCE = 1e-6
"""Largest gap (m) and angle (rad) between the joint's markers at the start; angles in files have at least six
digits."""
NUMBER_PATTERN = r"([-+]?\d*\.?\d+(?:[eE][-+]?\d+)?)"


@dataclass(frozen=True, eq=False)
class Marker:
    """A coordinate frame on a part of the mechanism. part : number of the part; position (3,) in m; axes (3, 3) : axes
    as columns."""

    part: int
    position: np.ndarray
    axes: np.ndarray


@dataclass(frozen=True, eq=False)
class Spring:
    """A spring and damper from the ground to the body.

    is_rotational : acts about the joint's axis, or else along the line between both points. ground_point, body_point
    (3,): ends at the start (m). stiffness (N/m or N m/rad), damping (N s/m or N m s/rad), free_length : length (m) or
    angle (rad) without force.
    """

    is_rotational: bool
    ground_point: np.ndarray
    body_point: np.ndarray
    stiffness: float
    damping: float
    free_length: float


@dataclass(frozen=True, eq=False)
class Mechanism:
    """A rigid body on a joint. mass (kg), centre (3,) m, inertia (3, 3) kg m^2, axes (3, 3) of the marker at the
    centre; gravity (3,) m/s^2.

    joint_kind, ground_marker, body_marker : the joint and its markers on ground and body; rod_length (m): of a distance
    joint. velocity (3,) m/s and angular_velocity (3,) rad/s at the start. is_first_marker_on_body : whether the joint's
    first marker, at which the file states reactions, lies on the body.
    """

    mass: float
    centre: np.ndarray
    inertia: np.ndarray
    axes: np.ndarray
    gravity: np.ndarray
    joint_kind: Kind
    ground_marker: Marker
    body_marker: Marker
    rod_length: float
    springs: tuple[Spring, ...]
    velocity: np.ndarray
    angular_velocity: np.ndarray
    is_first_marker_on_body: bool = False

    def with_spring(self, **spring_parameters: float) -> "Mechanism":
        """A copy of the mechanism with parameters of its only spring replaced."""
        (spring,) = self.springs
        return replace(self, springs=(replace(spring, **spring_parameters),))  # type: ignore[arg-type]

    def displaced(self, displacement: np.ndarray) -> "Mechanism":
        """A copy of the mechanism with the body displaced (m) at the start, together with its joint point and spring
        ends."""
        return replace(
            self,
            centre=self.centre + displacement,
            body_marker=replace(self.body_marker, position=self.body_marker.position + displacement),
            springs=tuple(replace(spring, body_point=spring.body_point + displacement) for spring in self.springs),
        )


def read_mechanism(model_path: str | Path) -> Mechanism:
    """Read the mechanism of a model file. Raises InputError with statement and line for what is not supported or not
    assembled."""
    return _MechanismReader(str(model_path), read_statements(model_path)).mechanism()


class _MechanismReader:
    """Reader that makes a mechanism from the statements of a model file."""

    def __init__(self, file_name: str, statements: list[Statement]) -> None:
        self.file, self.statements = file_name, statements
        parts = {part_statement.number: part_statement for part_statement in self.statements_named("PART")}
        grounds = [part_statement for part_statement in parts.values() if part_statement.has("GROUND")]
        bodies = [part_statement for part_statement in parts.values() if not part_statement.has("GROUND")]
        if len(grounds) != 1 or len(bodies) != 1:
            part_counts = [len(grounds), len(bodies)]
            raise InputError(
                file_name, "PART", part_counts, "must be one GROUND and one body: other counts are not supported"
            )
        self.ground_marker, self.part = grounds[0], bodies[0]
        self.markers = {
            part_statement.number: self._marker(part_statement, parts)
            for part_statement in self.statements_named("MARKER")
        }

    def statements_named(self, *statement_names: str) -> list[Statement]:
        return [statement for statement in self.statements if statement.name in statement_names]

    def _marker(self, statement: Statement, parts_by_number: dict[int, Statement]) -> Marker:
        marker_part = parts_by_number.get(statement.reference("PART"))
        if marker_part is None:
            raise statement.refuse(", PART", statement.reference("PART"), "is no part of the file")
        frame = _turned_axes(marker_part.numbers("REULER", (0.0, 0.0, 0.0)))
        position = marker_part.numbers("QG", (0.0, 0.0, 0.0)) + frame @ statement.numbers("QP", (0.0, 0.0, 0.0))
        return Marker(marker_part.number, position, frame @ _turned_axes(statement.numbers("REULER", (0.0, 0.0, 0.0))))

    def marker(self, statement: Statement, marker_number: int) -> Marker:
        if marker_number not in self.markers:
            raise statement.refuse("", marker_number, "is no marker of the file")
        return self.markers[marker_number]

    def ground_and_body_markers(
        self, statement: Statement, first_marker_number: int, second_marker_number: int
    ) -> tuple[Marker, Marker]:
        """Two markers given by their numbers, sorted: first the marker on the ground, then the marker on the body."""
        marker_pair = self.marker(statement, first_marker_number), self.marker(statement, second_marker_number)
        if {marker.part for marker in marker_pair} != {self.ground_marker.number, self.part.number}:
            raise statement.refuse(
                "", [first_marker_number, second_marker_number], "must be a marker of the ground and one of the body"
            )
        return marker_pair if marker_pair[0].part == self.ground_marker.number else marker_pair[::-1]

    def mechanism(self) -> Mechanism:
        body_part = self.part
        centre = self.marker(body_part, body_part.reference("CM"))
        ixx, iyy, izz, ixy, ixz, iyz = body_part.numbers("IP", (0.0,) * 6)
        inertia_at_marker = np.array([[ixx, -ixy, -ixz], [-ixy, iyy, -iyz], [-ixz, -iyz, izz]])
        mass = float(body_part.numbers("MASS", (0.0,))[0])
        if mass <= 0.0 or np.linalg.eigvalsh(inertia_at_marker)[0] <= 0.0:
            raise body_part.refuse("", None, "must have a mass and a positive inertia")
        kind, (ground, body), length = self._joint(centre)
        gravity = [
            sum(float(g.numbers(f"{axis}GRAV", (0.0,))[0]) for g in self.statements_named("ACCGRAV")) for axis in "IJK"
        ]
        return Mechanism(
            mass=mass,
            centre=centre.position,
            inertia=centre.axes @ inertia_at_marker @ centre.axes.T,
            axes=centre.axes,
            gravity=np.array(gravity),
            joint_kind=kind,
            ground_marker=ground,
            body_marker=body,
            rod_length=length,
            springs=tuple(
                self._spring(spring_statement, kind, ground)
                for spring_statement in self.statements_named("SFORCE", "SPRINGDAMPER")
            ),
            velocity=np.array([body_part.numbers(f"V{axis}", (0.0,))[0] for axis in "XYZ"]),
            is_first_marker_on_body=any(
                self.marker(j, j.reference("I")).part == body_part.number for j in self.statements_named("JOINT")
            ),
            angular_velocity=centre.axes @ [body_part.numbers(f"W{axis}", (0.0,))[0] for axis in "XYZ"],
        )

    def _joint(self, centre_marker: Marker) -> tuple[Kind, tuple[Marker, Marker], float]:
        joints = self.statements_named("JOINT", "GCON")
        if len(joints) > 1:
            raise joints[1].refuse("", None, "is the second joint of one body: not supported")
        if not joints:
            springs = [
                self.ground_and_body_markers(s, s.reference("I"), s.reference("J"))
                for s in self.statements_named("SFORCE", "SPRINGDAMPER")
            ]
            origin = Marker(self.ground_marker.number, np.zeros(3), np.eye(3))
            return "free", (springs[0][0] if springs else origin, centre_marker), 0.0
        (joint,) = joints
        if joint.name == "GCON":
            return self._distance_joint(joint)
        kind = next((kind for name, kind in JOINT_KINDS.items() if joint.has(name)), None)
        if kind is None:
            raise joint.refuse("", ", ".join(joint.values), "is not supported: " + ", ".join(JOINT_KINDS) + " are")
        ends = self.ground_and_body_markers(joint, joint.reference("I"), joint.reference("J"))
        first = self.marker(joint, joint.reference("I"))
        if kind == "universal":
            ends = _crossed_markers(*ends, first.part == self.ground_marker.number)
        _check_assembled(joint, kind, *ends)
        return kind, ends, 0.0

    def _distance_joint(self, joint_statement: Statement) -> tuple[Kind, tuple[Marker, Marker], float]:
        text = re.sub(r"\s", "", joint_statement.text("FUNCTION")).upper()
        match = re.fullmatch(r"DM\((\d+),(\d+)\)-" + NUMBER_PATTERN, text)
        if match is None:
            raise joint_statement.refuse(", FUNCTION", text, "is not supported: only DM(marker, marker) - length")
        ends, length = self.ground_and_body_markers(joint_statement, int(match[1]), int(match[2])), float(match[3])
        distance = float(np.linalg.norm(ends[1].position - ends[0].position))
        if abs(distance - length) > ASSEMBLY_TOLERANCE or length <= 0.0:
            raise joint_statement.refuse(
                ", FUNCTION", length, f"must be above 0 and the distance at the start, {distance:g} m"
            )
        return "distance", ends, distance

    def _spring(self, statement: Statement, joint_kind: Kind, joint_marker: Marker) -> Spring:
        ground, body = self.ground_and_body_markers(statement, statement.reference("I"), statement.reference("J"))
        turns = statement.has("ROTATIONAL") or statement.has("ROTATION")
        if turns and not (joint_kind == "revolute" and _are_parallel(ground.axes[:, 2], joint_marker.axes[:, 2])):
            raise statement.refuse("", None, "turns about an axis that no revolute joint has: not supported")
        law = (
            self._springdamper_parameters(statement, turns)
            if statement.name == "SPRINGDAMPER"
            else self._parameters_of_function(statement, turns)
        )
        angle = 0.0
        if turns:  # of the body beside the ground about the joint's axis, at the start
            x, y = (ground.axes[:, k] @ body.axes[:, 0] for k in range(2))
            sense = math.copysign(1.0, ground.axes[:, 2] @ joint_marker.axes[:, 2])
            angle = math.atan2(y, x) * sense
        stiffness, damping, free_length = law
        return Spring(
            turns, ground.position, body.position, stiffness, damping, free_length - angle if turns else free_length
        )

    def _springdamper_parameters(self, statement: Statement, is_rotational: bool) -> tuple[float, float, float]:
        names = ("KT", "CT", "ANGLE", "TORQUE") if is_rotational else ("K", "C", "LENGTH", "FORCE")
        stiffness, damping, free_length, preload = (float(statement.numbers(name, (0.0,))[0]) for name in names)
        if preload:
            raise statement.refuse(f", {names[3]}", preload, "is not supported: give the free length or angle")
        return stiffness, damping, free_length

    def _parameters_of_function(self, statement: Statement, is_rotational: bool) -> tuple[float, float, float]:
        """Stiffness, damping and free length (or angle) of a spring force given as an expression, which must be linear
        in travel and rate."""
        text = statement.text("FUNCTION").lower().replace("\\", " ")
        i, j = (f"0*{statement.reference(end)}" for end in "IJ")
        travel, rate = (rf"az\(\s*{i}\s*,\s*{j}\s*\)", rf"wz\(\s*{i}\s*,\s*{j}\s*,\s*{j}\s*\)")
        if not is_rotational:
            travel, rate = (rf"{name}\(\s*(?:{i}\s*,\s*{j}|{j}\s*,\s*{i})\s*\)" for name in ("dm", "vr"))
        plain = re.sub(rate, "(rate)", re.sub(travel, "(travel)", text))
        force = _evaluated_expression(statement, plain)
        base, k, c = force(0.0, 0.0), force(1.0, 0.0), force(0.0, 1.0)
        stiffness, damping = base - k, base - c
        if abs(force(2.0, 3.0) - (base - 2.0 * stiffness - 3.0 * damping)) > 1e-9 * (abs(stiffness) + abs(damping)):
            raise statement.refuse(
                ", FUNCTION", text, "is not supported: only forces that are straight in travel and rate"
            )
        if not stiffness and base:
            raise statement.refuse(", FUNCTION", text, "is not supported: a constant force needs a stiffness")
        free_length = base / stiffness if stiffness else 0.0
        return (
            stiffness,
            damping,
            -free_length if is_rotational else free_length,
        )  # az is the angle of the ground beside the body


def _evaluated_expression(statement: Statement, expression_text: str) -> Callable[[float, float], float]:
    """The force expression as a function of travel and rate; it may contain numbers, RTOD and DTOR."""
    names = {"rtod": 180.0 / math.pi, "dtor": math.pi / 180.0, "pi": math.pi}
    try:
        tree = ast.parse(expression_text.strip(), mode="eval")
    except SyntaxError:
        raise statement.refuse(", FUNCTION", expression_text, "cannot be read") from None
    allowed = (ast.Expression, ast.BinOp, ast.UnaryOp, ast.Name, ast.Load, ast.Constant, ast.operator, ast.unaryop)
    for node in ast.walk(tree):
        strange = isinstance(node, ast.Name) and node.id not in (*names, "travel", "rate")
        if strange or not isinstance(node, allowed):
            shown = node.id if isinstance(node, ast.Name) else ast.unparse(node)
            raise statement.refuse(", FUNCTION", shown, "is not supported: numbers, DM, VR, AZ, WZ, RTOD and DTOR are")
    code = compile(tree, "", "eval")
    return lambda travel, rate: float(eval(code, {"__builtins__": {}}, {**names, "travel": travel, "rate": rate}))


def _turned_axes(angles: np.ndarray) -> np.ndarray:
    """Axes (3, 3) as columns after rotations (rad) about z, the new x and the new z."""
    return Rotation.from_euler("ZXZ", angles).as_matrix()


def _are_parallel(first_vector: np.ndarray, second_vector: np.ndarray) -> bool:
    return bool(np.linalg.norm(np.cross(first_vector, second_vector)) < ASSEMBLY_TOLERANCE)


def _crossed_markers(ground_marker: Marker, body_marker: Marker, is_ground_first: bool) -> tuple[Marker, Marker]:
    """Both markers of a universal joint, turned so that their z axes are the arms of the cross: the x axis of the I
    marker, and the y axis of the J marker."""
    of_ground, of_body = (0, 1) if is_ground_first else (1, 0)
    return replace(ground_marker, axes=np.roll(ground_marker.axes, 2 - of_ground, 1)), replace(
        body_marker, axes=np.roll(body_marker.axes, 2 - of_body, 1)
    )


def _check_assembled(joint_statement: Statement, joint_kind: Kind, ground_marker: Marker, body_marker: Marker) -> None:
    """Raise InputError where the joint's markers do not fit together at the start."""
    offset, z = body_marker.position - ground_marker.position, ground_marker.axes[:, 2]
    if joint_kind in ("prismatic", "cylindrical"):
        offset = offset - z * (z @ offset)
    if np.linalg.norm(offset) > ASSEMBLY_TOLERANCE:
        raise joint_statement.refuse(
            "", offset.round(9).tolist(), "m lie between its markers at the start: it must be assembled"
        )
    if joint_kind == "universal":
        if abs(z @ body_marker.axes[:, 2]) > ASSEMBLY_TOLERANCE:
            raise joint_statement.refuse("", None, "has arms that are not square to each other at the start")
    elif joint_kind != "spherical" and not (
        _are_parallel(z, body_marker.axes[:, 2]) and z @ body_marker.axes[:, 2] > 0.0
    ):
        raise joint_statement.refuse("", None, "has z axes that are not parallel at the start")
