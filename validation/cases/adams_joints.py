"""Joints and springs compared with another multibody code: motion and reactions of single bodies on single joints.

Every body is built from the other code's model file on the common description, marched in both engines, and by the
plain reference, which has constraints with multipliers where the engines have joint coordinates. Reactions of the
engines follow from their accelerations by Newton's and Euler's equations of the body; those of the reference are its
multipliers.
"""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from models.own_model.certificate import EQUAL_ACCELERATION_SHARE
from validation.adams_joints.constrained import ConstrainedBody
from validation.adams_joints.joint_tree import joint_tree
from validation.adams_joints.mechanism import Mechanism, read_mechanism
from validation.adams_joints.motion import BodyMotion, Reaction
from validation.adams_joints.output_file import OutputFile, read_output, starts_with_mechanism
from validation.adams_joints.twin_model import build_differences
from validation.common.rows import Observed, Row, System, Table, not_run
from validation.common.scenes import data_folder

TITLE = "Joints and springs of another multibody code"
SYSTEM: System = "rolling-vehicle"
MODEL_FOLDER = "adams_joints"
JOINT_FAMILIES = (
    "Revolute",
    "Prismatic",
    "Cylindrical",
    "Spherical",
    "Universal",
    "Distance",
    "RotSpring",
    "TranSpring",
)
QUICK_JOINT_FAMILIES = ("Revolute", "Distance")
MODEL_FILE_NAMES = {"TranSpring": "TransSpring"}
"""Model file names of the joint families whose file has another name."""
ENGINE_NAMES = ("exudyn", "mujoco")
TIME_STEP, STEPS_PER_ROW, DURATION, QUICK_DURATION = 5e-3, 2, 5.0, 1.0
"""Step (s); number of steps for each row of the output files; lengths (s) of a full and of a quick run."""
MJCF_STEP_RATIO = 5
"""Number of steps of the joints in MJCF for each step of the other runs. The spring of the free body has no length at
the start, where MuJoCo's tendon has no direction and so no damping. MuJoCo's first step errs by order 2 (5.7e-6 m by 5
ms over 5 s, 1.4e-6 m by 2.5 ms), Exudyn's by order 5."""
POSITION_BOUND, FORCE_BOUND = 1e-5, 1e-4
"""Largest position error (m) and largest error of a reaction that are asked for. The error of a reaction is divided by
the largest reaction, or by the weight where the weight is larger."""
ENGINE_TOLERANCE = 1e-6
"""Tolerance between engines and reference, of positions (m) and of reactions divided by the largest: steps of 5 ms
leave 3e-7 of both."""
ENERGY_LOSS_LIMIT = 1e-4
"""Energy that a motion without friction may lose in the other code's output file, divided by its largest kinetic
energy."""
WINDOW_ROW_COUNT = 10
"""Rows of an output file, 0.1 s, over which a simulation that starts from a state in the file is compared with the
file."""
ANGLES_FROM_REVOLUTE = {"Spherical": 0.0, "Universal": 90.0}
"""Joint families whose output file holds the same pendulum as the Revolute file, each with the angle (degrees) about z
by which its pendulum is turned from the Revolute one."""
SPRING_FIT_SECONDS = 1.0
"""First part (s) of an output file to which spring constants are fitted if the model file describes another case."""


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of every joint family; a quick run takes two families and one second."""
    data = data_folder()
    rows: list[Row] = []
    saved: dict[str, Any] = {}
    for family in QUICK_JOINT_FAMILIES if quick else JOINT_FAMILIES:
        model = None if data is None else data / MODEL_FOLDER / f"{MODEL_FILE_NAMES.get(family, family)}_Case01.adm"
        if model is None or not model.is_file():
            reason = "TWINRIG_DATA names no folder with the other code's models"
            rows.append(not_run(_report_row_id(family, "position"), SYSTEM, f"{family}: position and reaction", reason))
            continue
        output = read_output(model.with_name(f"{family}_Case01.csv.gz"))
        mechanism, notes = _mechanism_of_output(read_mechanism(model), output)
        rows += [*fitted_constant_rows(family, notes), *joint_family_rows(family, mechanism, output, quick)]
        if mechanism.joint_kind != "distance":
            rows += mjcf_rows(family, mechanism, work_folder, 1.0 if quick else DURATION)
        if family in ANGLES_FROM_REVOLUTE:
            rows += _same_pendulum_rows(family, mechanism, output, model.with_name("Revolute_Case01.csv.gz"))
        saved[family] = {
            "lost": output.energy_lost(mechanism) if not mechanism.springs else None,
            "digits": output.digit_count,
        }
    return rows, saved


def _report_row_id(joint_family: str, row_name: str) -> str:
    """Id of a report row of a joint family."""
    return f"adams_joints.{joint_family.lower()}.{row_name}"


def _mechanism_of_output(mechanism: Mechanism, output_file: OutputFile) -> tuple[Mechanism, dict[str, float]]:
    """The mechanism that fits an output file, and the spring constants that were fitted. If the file has another start
    or another spring than the model, the mechanism takes the file's start and constants fitted to the file."""
    if not mechanism.springs:
        return mechanism, {}
    shift = output_file.columns["Pos"][0] - mechanism.centre
    moved = mechanism if starts_with_mechanism(mechanism, output_file) else mechanism.displaced(shift)
    (spring,) = moved.springs
    travel, rate, law = _spring_motion(moved, output_file)
    law_force = spring.stiffness * (travel - spring.free_length) + spring.damping * rate
    if moved is mechanism and np.abs(law_force - law).max() <= FORCE_BOUND * np.abs(law).max():
        return mechanism, {}
    early = output_file.times <= SPRING_FIT_SECONDS
    parts = np.column_stack([travel, rate, np.ones(len(travel))])[early]
    stiffness, damping, preload = np.linalg.lstsq(parts, law[early], rcond=None)[0].tolist()
    constants = {"stiffness": stiffness, "damping": damping, "rest": -preload / stiffness}
    return moved.with_spring(stiffness=stiffness, damping=damping, free_length=constants["rest"]), constants


def _spring_motion(mechanism: Mechanism, output_file: OutputFile) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Deflection, rate and force (each (m,)) of the mechanism's only spring during the motion in the output file. The
    force is read from the file and positive in extension."""
    (spring,), motion = mechanism.springs, output_file.motion(mechanism)
    if spring.is_rotational:
        axis = mechanism.ground_marker.axes[:, 2]
        return (
            np.unwrap(np.arctan2(*_sine_and_cosine_of_rotation(motion, axis))),
            motion.angular_velocity @ axis,
            output_file.columns["Rtorque"] @ axis,
        )
    arm = motion.rotation @ (spring.body_point - mechanism.centre)
    apart, speed = motion.position + arm - spring.ground_point, motion.velocity + np.cross(motion.angular_velocity, arm)
    travel = np.linalg.norm(apart, axis=1)
    unit = apart / np.maximum(travel, 1e-30)[:, None]
    return travel, (speed * unit).sum(axis=1), (output_file.columns["Rforce"] * unit).sum(axis=1)


def _sine_and_cosine_of_rotation(body_motion: BodyMotion, unit_axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sine and cosine (m,) of the body's rotation about a unit axis."""
    side = np.eye(3)[np.argmin(np.abs(unit_axis))]
    first = np.cross(unit_axis, side) / np.linalg.norm(np.cross(unit_axis, side))
    turned = body_motion.rotation @ first
    return turned @ np.cross(unit_axis, first), turned @ first


def fitted_constant_rows(joint_family: str, spring_constants: dict[str, float]) -> list[Row]:
    """Rows with the spring constants that were fitted to an output file because its model file describes another
    case."""
    why = (
        f"read off the first {SPRING_FIT_SECONDS:g} s of the output: the model file describes another case; calibrated"
    )
    units = {"stiffness": "N/m or N m/rad", "damping": "N s/m or N m s/rad", "rest": "m or rad"}
    return [
        Observed(
            _report_row_id(joint_family, name), SYSTEM, f"{joint_family}: {name} of the spring", value, units[name]
        ).beside("-", why)
        for name, value in spring_constants.items()
    ]


def joint_family_rows(
    joint_family: str, mechanism: Mechanism, output_file: OutputFile, quick: bool = False
) -> list[Row]:
    """Rows for one joint family: positions and reactions of all engines compared with the output file, reactions on the
    motion in the file, and the engines compared with the reference equations."""
    duration = min(QUICK_DURATION if quick else DURATION, float(output_file.times[-1]))
    motion, reaction = ConstrainedBody(mechanism).run(duration, TIME_STEP, STEPS_PER_ROW)
    runs = {"reference": (motion, reaction)}
    tree = joint_tree(mechanism, motion)
    runs |= {engine: tree.run(engine, duration, TIME_STEP, STEPS_PER_ROW) for engine in ENGINE_NAMES}
    rows = [_reaction_on_file_motion_row(joint_family, mechanism, output_file)]
    for name, (path, pushed) in runs.items():
        rows += _rows_against_output_file(joint_family, name, mechanism, output_file, path, pushed)
    if not mechanism.springs and output_file.energy_lost(mechanism) > ENERGY_LOSS_LIMIT:
        rows.append(_restart_row(joint_family, mechanism, output_file, duration))
    for name in ENGINE_NAMES:
        rows.append(_engine_row(joint_family, name, mechanism, runs[name], runs["reference"]))
    return rows


def mjcf_rows(joint_family: str, mechanism: Mechanism, work_folder: Path, duration: float) -> list[Row]:
    """Rows for the joint as an MJCF model: the certificate of ``twinrig twin``, and positions compared with those by
    constraint equations."""
    step, every = TIME_STEP / MJCF_STEP_RATIO, MJCF_STEP_RATIO * STEPS_PER_ROW
    accelerations, paths = build_differences(mechanism, work_folder, round(duration / step), step)
    motion, _ = ConstrainedBody(mechanism).run(duration, step, every)
    quantity = f"{joint_family} in MJCF: accelerations of all builds from the file as MuJoCo parsed it"
    tolerance_reason = "rounding; the bound asked for"
    alike = Observed(
        _report_row_id(joint_family, "mjcf.accelerations"), SYSTEM, quantity, accelerations, "of the largest"
    )
    rows: list[Row] = [alike.at_most(EQUAL_ACCELERATION_SHARE, tolerance_reason, "native")]
    for name, positions in paths.items():
        off = float(np.abs(positions[::every] - motion.position).max())
        quantity = f"{joint_family} in MJCF: position of the centre from the reference with constraints, {name}"
        observed = Observed(_report_row_id(joint_family, f"mjcf.position.{name}"), SYSTEM, quantity, off, "m")
        rows.append(observed.at_most(ENGINE_TOLERANCE, "no code in common but Runge-Kutta's steps of 1 ms", "native"))
    return rows


def _reaction_scales(mechanism: Mechanism, reaction: Reaction) -> tuple[float, float]:
    """Scales of reactions: the larger of largest force and weight (N), and this force times the distance of the centre
    of mass from the joint, at least 1 m (N m)."""
    weight = mechanism.mass * float(np.linalg.norm(mechanism.gravity))
    force = max(float(np.abs(reaction.force).max()), weight)
    return force, force * max(float(np.linalg.norm(mechanism.centre - mechanism.ground_marker.position)), 1.0)


def _reaction_difference(
    mechanism: Mechanism,
    first_reaction: Reaction,
    second_reaction: Reaction,
    rounding_errors: tuple[Any, Any] = (0.0, 0.0),
) -> float:
    """Largest difference of two reactions beyond their rounding errors, divided by the scales of
    ``_reaction_scales``."""
    force, moment = _reaction_scales(mechanism, second_reaction)
    off = (
        np.abs(first_reaction.force - second_reaction.force) - rounding_errors[0],
        np.abs(first_reaction.moment - second_reaction.moment) - rounding_errors[1],
    )
    return max(0.0, float(off[0].max()) / force, float(off[1].max()) / moment)


def _reaction_on_file_motion_row(joint_family: str, mechanism: Mechanism, output_file: OutputFile) -> Row:
    """Row: difference of the file's reactions from those that Newton's and Euler's equations give for the file's
    motion; no integration is involved."""
    off = _reaction_difference(mechanism, output_file.reaction_of_motion(mechanism), output_file.reaction())
    why = "Newton's and Euler's equations on the motion that the file tells; the bound asked for"
    quantity = f"{joint_family}: reaction on the file's own motion, by the largest"
    return Observed(_report_row_id(joint_family, "own_motion"), SYSTEM, quantity, off, "").at_most(
        FORCE_BOUND, why, "published"
    )


def _rows_against_output_file(
    joint_family: str,
    solver_name: str,
    mechanism: Mechanism,
    output_file: OutputFile,
    computed_motion: BodyMotion,
    computed_reaction: Reaction,
) -> list[Row]:
    """Rows: positions and reactions of one simulation compared with the output file. Where the motion in the file loses
    energy although nothing damps, the bound is only an aim."""
    m = len(computed_motion.times)
    position_error = (
        np.abs(computed_motion.position - output_file.columns["Pos"][:m]) - output_file.rounding_error("Pos")[:m]
    )
    digits = output_file.rounding_error("Rforce")[:m], output_file.rounding_error("Rtorque")[:m]
    theirs = Reaction(output_file.columns["Rforce"][:m], output_file.columns["Rtorque"][:m])
    seen = (
        ("position", "position of the centre", max(0.0, float(position_error.max())), "m", POSITION_BOUND),
        (
            "reaction",
            "reaction by the largest",
            _reaction_difference(mechanism, computed_reaction, theirs, digits),
            "",
            FORCE_BOUND,
        ),
    )
    lost = 0.0 if mechanism.springs else output_file.energy_lost(mechanism)
    rows = []
    for what, words, off, unit, bound in seen:
        quantity = f"{joint_family}: {words}, beside the other code's digits, {solver_name}"
        observed = Observed(_report_row_id(joint_family, f"{what}.{solver_name}"), SYSTEM, quantity, off, unit)
        if lost <= ENERGY_LOSS_LIMIT:
            rows.append(observed.at_most(bound, "the bound asked for", "published"))
        else:
            why = f"nothing damps, and the motion in the file loses {100 * lost:.2g} % of its kinetic energy: its error"
            rows.append(observed.aim(bound, why))
    return rows


def _restart_row(joint_family: str, mechanism: Mechanism, output_file: OutputFile, duration: float) -> Row:
    """Row: position error 0.1 s after each state of the output file at which a simulation is started anew. In this time
    the file's integration error cannot grow.

    The energy dE that the file's motion loses in this time changes the speed by dE / (m v). The resulting change of
    position is subtracted.
    """
    body, theirs = ConstrainedBody(mechanism), output_file.motion(mechanism)
    starts = np.arange(0, round(duration / TIME_STEP / STEPS_PER_ROW) - WINDOW_ROW_COUNT, WINDOW_ROW_COUNT)
    ends = [
        body.state_after(body.state_at_row(theirs, k), WINDOW_ROW_COUNT * STEPS_PER_ROW, TIME_STEP)[:3]
        for k in starts.tolist()
    ]
    digits = output_file.rounding_error("Pos")[starts] + output_file.rounding_error("Pos")[starts + WINDOW_ROW_COUNT]
    off = (np.abs(np.array(ends) - theirs.position[starts + WINDOW_ROW_COUNT]) - digits).max(axis=1)
    _, total_energy = output_file.energies(mechanism)
    speed = np.linalg.norm(theirs.velocity, axis=1)
    fastest = np.maximum(speed[starts], speed[starts + WINDOW_ROW_COUNT])
    lost = (
        np.abs(total_energy[starts + WINDOW_ROW_COUNT] - total_energy[starts])
        / (mechanism.mass * fastest)
        * (WINDOW_ROW_COUNT * STEPS_PER_ROW * TIME_STEP)
    )
    why = "from state to state of the file, less its digits and what its loss of energy explains; the bound asked for"
    quantity = f"{joint_family}: position 0.1 s after each of the file's own states, reference"
    left = max(0.0, float((off - lost).max()))
    return Observed(_report_row_id(joint_family, "window"), SYSTEM, quantity, left, "m").at_most(
        POSITION_BOUND, why, "published"
    )


def _same_pendulum_rows(
    joint_family: str, mechanism: Mechanism, output_file: OutputFile, revolute_path: Path
) -> list[Row]:
    """Rows: the joint compared with the other code's output file of the same pendulum on a hinge, in which the energy
    is conserved.

    A body that starts at rest on a ball joint or a universal joint swings in a plane. Mass, arm and moment of inertia
    are those of the Revolute case: the other code's files of one motion must agree with one another, too.
    """
    hinge, back = (
        read_output(revolute_path),
        Rotation.from_euler("z", -ANGLES_FROM_REVOLUTE[joint_family], degrees=True),
    )
    motion, reaction = ConstrainedBody(mechanism).run(float(hinge.times[-1]), TIME_STEP, STEPS_PER_ROW)
    file_position, force = hinge.columns["Pos"], hinge.columns["Rforce"]
    off = float((np.abs(back.apply(motion.position) - file_position) - hinge.rounding_error("Pos")).max())
    pushed = float((np.abs(back.apply(reaction.force) - force) - hinge.rounding_error("Rforce")).max())
    files = np.abs(back.apply(output_file.columns["Pos"]) - file_position).max(axis=1)
    since = output_file.times[np.argmax(files > POSITION_BOUND)]
    why = "the same pendulum on a hinge by the other code, in a file that keeps its energy; the bound asked for"
    hinged = f"{joint_family}: %s beside the other code's file of the same pendulum on a hinge, reference"
    both = (
        f"{joint_family}: largest distance of the other code's files of one pendulum, "
        f"above {POSITION_BOUND:g} m from {since:.2f} s on"
    )
    return [
        Observed(_report_row_id(joint_family, "hinge"), SYSTEM, hinged % "position", max(0.0, off), "m").at_most(
            POSITION_BOUND, why, "published"
        ),
        Observed(
            _report_row_id(joint_family, "hinge_force"),
            SYSTEM,
            hinged % "force by the largest",
            max(0.0, pushed) / float(np.abs(force).max()),
            "",
        ).at_most(FORCE_BOUND, why, "published"),
        Observed(_report_row_id(joint_family, "files"), SYSTEM, both, float(files.max()), "m").beside(
            POSITION_BOUND, "one motion: what is left is the error of the file that loses energy", "published"
        ),
    ]


def _engine_row(
    joint_family: str,
    engine_name: str,
    mechanism: Mechanism,
    engine_run: tuple[BodyMotion, Reaction],
    reference_run: tuple[BodyMotion, Reaction],
) -> Row:
    """Row: difference of position, rotation and reaction between a mechanism built of an engine's joints and the
    reference's constraint equations."""
    position_error = float(np.abs(engine_run[0].position - reference_run[0].position).max())
    rotation = float(np.abs(engine_run[0].rotation - reference_run[0].rotation).max())
    off = max(position_error, rotation, _reaction_difference(mechanism, engine_run[1], reference_run[1]))
    why = "joint coordinates against constraints with multipliers, no code in common but Runge-Kutta's steps of 5 ms"
    quantity = f"{joint_family}: {engine_name} from the reference: position, rotation, reaction by the largest"
    return Observed(_report_row_id(joint_family, f"twin.{engine_name}"), SYSTEM, quantity, off, "m, -").at_most(
        ENGINE_TOLERANCE, why, "native"
    )


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Table of the output files of Adams: digits that they print, and energy that undamped motions in them lose."""
    rows = tuple(
        (family, str(file_facts["digits"]), "-" if file_facts["lost"] is None else f"{file_facts['lost']:.1e}")
        for family, file_facts in case_data.items()
    )
    note = "Where nothing damps, a motion that loses energy carries an integration error of the code that wrote it."
    heads = ("family", "digits of the file", "energy lost by the largest kinetic one")
    return [Table("Motion of the other code", note, heads, rows)] if rows else []
