"""Mechanisms of Adams files written as MJCF, then read and built as ``twinrig twin`` does with a user's own file.

A body on a joint has that joint in MJCF, with its axis and anchor. A distance joint has none: its rod has no mass, and
MuJoCo's parser refuses a moving body without mass.
"""

from pathlib import Path

import mujoco
import numpy as np

from models.core.errors import Refused
from models.engines.free_vehicle import free_model
from models.own_model.certificate import certificate
from models.own_model.file import read_model_file
from models.own_model.path import file_path
from models.own_model.reading import TwinModel
from validation.adams_joints.mechanism import Mechanism, Spring

STATE_COUNT = 20
"""Number of random states at which accelerations are compared."""
SLIDE, HINGE = "slide", "hinge"


def as_mjcf(mechanism: Mechanism) -> str:
    """The mechanism as MJCF text; the body's frame is at its centre, parallel to the ground's axes at the start."""
    m, inertia = mechanism, mechanism.inertia
    laws = [spring for spring in m.springs if spring.is_rotational]
    lines = [spring for spring in m.springs if not spring.is_rotational]
    six = (*inertia.diagonal(), inertia[0, 1], inertia[0, 2], inertia[1, 2])
    feet = "".join(
        f'<site name="foot {i}" pos="{_numbers_text(spring.ground_point)}"/>' for i, spring in enumerate(lines)
    )
    tips = "".join(
        f'<site name="tip {i}" pos="{_numbers_text(spring.body_point - m.centre)}"/>' for i, spring in enumerate(lines)
    )
    tendons = "".join(_tendon_text(i, spring) for i, spring in enumerate(lines))
    return (
        f'<mujoco><compiler angle="radian"/><option gravity="{_numbers_text(m.gravity)}"/><worldbody>{feet}'
        f'<body name="body" pos="{_numbers_text(m.centre)}">{_joints(m, laws)}'
        f'<inertial pos="0 0 0" mass="{m.mass!r}" '
        f'fullinertia="{_numbers_text(np.array(six))}"/>{tips}</body></worldbody>'
        f"<tendon>{tendons}</tendon></mujoco>"
    )


def _numbers_text(numbers: np.ndarray) -> str:
    return " ".join(repr(float(number)) for number in numbers)


def _joints(mechanism: Mechanism, torsion_springs: list[Spring]) -> str:
    """MJCF text of the body's joints, in the order in which they act. Raises Refused where MJCF has no such joint."""
    first, second = mechanism.ground_marker.axes[:, 2], mechanism.body_marker.axes[:, 2]
    kinds = {
        "revolute": [(HINGE, first)],
        "prismatic": [(SLIDE, first)],
        "cylindrical": [(SLIDE, first), (HINGE, first)],
        "spherical": [("ball", first)],
        "universal": [(HINGE, first), (HINGE, second)],
        "free": [("free", first)],
    }
    if mechanism.joint_kind not in kinds:
        raise Refused(mechanism.joint_kind, "its rod has no mass, and MuJoCo's parser takes no moving body without")
    law = "".join(
        f' stiffness="{s.stiffness!r}" damping="{s.damping!r}" springref="{s.free_length!r}"' for s in torsion_springs
    )
    anchor = mechanism.body_marker.position - mechanism.centre
    return "".join(
        f'<joint name="{kind} {i}" type="{kind}"/>'
        if kind == "free"
        else f'<joint name="{kind} {i}" type="{kind}" axis="{_numbers_text(axis)}" pos="{_numbers_text(anchor)}"{law}/>'
        for i, (kind, axis) in enumerate(kinds[mechanism.joint_kind])
    )


def _tendon_text(spring_number: int, spring: Spring) -> str:
    law = f'stiffness="{spring.stiffness!r}" damping="{spring.damping!r}" springlength="{spring.free_length!r}"'
    sites = f'<site site="foot {spring_number}"/><site site="tip {spring_number}"/>'
    return f'<spatial name="spring {spring_number}" {law}>{sites}</spatial>'


def build_differences(
    mechanism: Mechanism, work_folder: Path, step_count: int, time_step: float
) -> tuple[float, dict[str, np.ndarray]]:
    """Largest relative difference of accelerations between the models that twinrig builds and the MJCF file. Then, by
    engine, paths (step_count + 1, 3) of the body's centre: by the MJCF file in MuJoCo and by twinrig's model in Exudyn,
    with steps of ``time_step`` (s) from the start.
    """
    path = work_folder / "joint.xml"
    path.write_text(as_mjcf(mechanism), encoding="utf-8")
    twin = read_model_file(path).twin
    worst = max(row.acceleration for row in certificate(twin, STATE_COUNT))
    start = np.zeros(twin.size), _start_rates(mechanism, twin)
    n, built = twin.size, free_model("exudyn", twin.driven).march(*start, step_count, time_step)
    in_engine = [twin.coordinates.to_mujoco(row[:n], row[n:]).qpos for row in built]
    in_file = file_path(twin, start, (step_count, time_step))[:, : twin.model.nq]
    return worst, {"mujoco": _body_centres(twin, in_file), "exudyn": _body_centres(twin, np.array(in_engine))}


def _start_rates(mechanism: Mechanism, mjcf_twin: TwinModel) -> np.ndarray:
    """Joint rates (n,) at the start that give the body its initial velocity and angular velocity."""
    data, size = mujoco.MjData(mjcf_twin.model), mjcf_twin.size
    mujoco.mj_forward(mjcf_twin.model, data)
    centre_jacobian, rotation_jacobian = np.empty((2, 3, size))
    mujoco.mj_jacBodyCom(mjcf_twin.model, data, centre_jacobian, rotation_jacobian, 1)
    wanted = np.concatenate((mechanism.velocity, mechanism.angular_velocity))
    rates: np.ndarray = np.linalg.lstsq(np.vstack((centre_jacobian, rotation_jacobian)), wanted, rcond=None)[0]
    return rates


def _body_centres(mjcf_twin: TwinModel, coordinates: np.ndarray) -> np.ndarray:
    """Positions (m, 3) of the body's centre at MuJoCo's coordinates (m, nq)."""
    data, centres = mujoco.MjData(mjcf_twin.model), np.empty((len(coordinates), 3))
    for centre, data.qpos[:] in zip(centres, coordinates, strict=True):
        mujoco.mj_kinematics(mjcf_twin.model, data)
        centre[:] = data.xipos[1]
    return centres
