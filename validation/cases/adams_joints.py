"""Joints and springs against another multibody code: motion and reactions of single bodies on single joints.

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
FOLDER = "adams_joints"
FAMILIES = ("Revolute", "Prismatic", "Cylindrical", "Spherical", "Universal", "Distance", "RotSpring", "TranSpring")
QUICK_FAMILIES = ("Revolute", "Distance")
MODELS = {"TranSpring": "TransSpring"}
"""Families whose model file has another name."""
ENGINES = ("exudyn", "mujoco")
STEP, STEPS_PER_ROW, DURATION, QUICK_DURATION = 5e-3, 2, 5.0, 1.0
"""s; steps for each row of the files."""
JOINT_STEPS = 5
"""Steps of the joints in MJCF for each of the others: the spring of the free body has no length at the start, where
MuJoCo's tendon has no direction and so no damping. Its first step errs by order 2 (5.7e-6 m by 5 ms over 5 s, 1.4e-6 m
by 2.5 ms), Exudyn's by order 5."""
PLACE_BOUND, FORCE_BOUND = 1e-5, 1e-4
"""Bounds asked for: m, and share of the largest reaction, which is the weight where nothing larger acts."""
TWINS = 1e-6
"""Of engines and reference, m and share: steps of 5 ms leave 3e-7 of both."""
LOSES = 1e-4
"""Share of the largest kinetic energy that a file's own motion may lose without friction."""
WINDOW_ROWS = 10
"""Rows of a file, a tenth of a second, after which a march from its own state is compared."""
SHARED_FILES = {"Spherical": 0.0, "Universal": 90.0}
"""Families whose file is of the pendulum of Revolute's, and by how many degrees about z it is turned from that."""
READ_OFF_SECONDS = 1.0
"""s of a file from which a spring's constants are read off, where the model file describes another case."""


def measure(quick: bool, folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows of every family; in the quick share of two, one second long."""
    data = data_folder()
    rows: list[Row] = []
    saved: dict[str, Any] = {}
    for family in QUICK_FAMILIES if quick else FAMILIES:
        model = None if data is None else data / FOLDER / f"{MODELS.get(family, family)}_Case01.adm"
        if model is None or not model.is_file():
            reason = "TWINRIG_DATA names no folder with the other code's models"
            rows.append(not_run(_id(family, "position"), SYSTEM, f"{family}: position and reaction", reason))
            continue
        output = read_output(model.with_name(f"{family}_Case01.csv.gz"))
        mechanism, notes = _fitting(read_mechanism(model), output)
        rows += [*notes_rows(family, notes), *family_rows(family, mechanism, output, quick)]
        if mechanism.kind != "distance":
            rows += own_model_rows(family, mechanism, folder, 1.0 if quick else DURATION)
        if family in SHARED_FILES:
            rows += _same_pendulum(family, mechanism, output, model.with_name("Revolute_Case01.csv.gz"))
        saved[family] = {
            "lost": output.energy_lost(mechanism) if not mechanism.springs else None,
            "digits": output.digits,
        }
    return rows, saved


def _id(family: str, row_name: str) -> str:
    return f"adams_joints.{family.lower()}.{row_name}"


def _fitting(mechanism: Mechanism, output: OutputFile) -> tuple[Mechanism, dict[str, float]]:
    """The mechanism, and the constants that were fitted. If the output file has another start or another spring, the
    mechanism takes the file's start, with spring constants fitted to its data."""
    if not mechanism.springs:
        return mechanism, {}
    shift = output.columns["Pos"][0] - mechanism.centre
    moved = mechanism if starts_with_mechanism(mechanism, output) else mechanism.displaced(shift)
    (spring,) = moved.springs
    travel, rate, law = _springdamper_parameters(moved, output)
    law_force = spring.stiffness * (travel - spring.free_length) + spring.damping * rate
    if moved is mechanism and np.abs(law_force - law).max() <= FORCE_BOUND * np.abs(law).max():
        return mechanism, {}
    early = output.times <= READ_OFF_SECONDS
    parts = np.column_stack([travel, rate, np.ones(len(travel))])[early]
    stiffness, damping, preload = np.linalg.lstsq(parts, law[early], rcond=None)[0].tolist()
    constants = {"stiffness": stiffness, "damping": damping, "rest": -preload / stiffness}
    return moved.with_spring(stiffness=stiffness, damping=damping, free_length=constants["rest"]), constants


def _springdamper_parameters(mechanism: Mechanism, output: OutputFile) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Travel and rate of the only spring during the output's motion, and the spring force (m,) by the output, positive
    in extension."""
    (spring,), motion = mechanism.springs, output.motion(mechanism)
    if spring.is_rotational:
        axis = mechanism.ground.axes[:, 2]
        return (
            np.unwrap(np.arctan2(*_angle(motion, axis))),
            motion.angular_velocity @ axis,
            output.columns["Rtorque"] @ axis,
        )
    arm = motion.rotation @ (spring.body_point - mechanism.centre)
    apart, speed = motion.position + arm - spring.ground_point, motion.velocity + np.cross(motion.angular_velocity, arm)
    travel = np.linalg.norm(apart, axis=1)
    unit = apart / np.maximum(travel, 1e-30)[:, None]
    return travel, (speed * unit).sum(axis=1), (output.columns["Rforce"] * unit).sum(axis=1)


def _angle(motion: BodyMotion, axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sine and cosine (m,) of the body's rotation about an axis."""
    side = np.eye(3)[np.argmin(np.abs(axis))]
    first = np.cross(axis, side) / np.linalg.norm(np.cross(axis, side))
    turned = motion.rotation @ first
    return turned @ np.cross(axis, first), turned @ first


def notes_rows(family: str, constants: dict[str, float]) -> list[Row]:
    """Rows with spring constants that were fitted to the output file, since its model file describes another case."""
    why = f"read off the first {READ_OFF_SECONDS:g} s of the output: the model file describes another case; calibrated"
    units = {"stiffness": "N/m or N m/rad", "damping": "N s/m or N m s/rad", "rest": "m or rad"}
    return [
        Observed(_id(family, name), SYSTEM, f"{family}: {name} of the spring", value, units[name]).beside("-", why)
        for name, value in constants.items()
    ]


def family_rows(family: str, mechanism: Mechanism, output: OutputFile, quick: bool = False) -> list[Row]:
    """Rows for one model and its output file: positions, reactions, reactions for the file's own motion, and the
    engines."""
    duration = min(QUICK_DURATION if quick else DURATION, float(output.times[-1]))
    motion, reaction = ConstrainedBody(mechanism).run(duration, STEP, STEPS_PER_ROW)
    runs = {"reference": (motion, reaction)}
    tree = joint_tree(mechanism, motion)
    runs |= {engine: tree.run(engine, duration, STEP, STEPS_PER_ROW) for engine in ENGINES}
    rows = [_own_motion(family, mechanism, output)]
    for name, (path, pushed) in runs.items():
        rows += _against_file(family, name, mechanism, output, path, pushed)
    if not mechanism.springs and output.energy_lost(mechanism) > LOSES:
        rows.append(_windows(family, mechanism, output, duration))
    for name in ENGINES:
        rows.append(_twin(family, name, mechanism, runs[name], runs["reference"]))
    return rows


def own_model_rows(family: str, mechanism: Mechanism, folder: Path, duration: float) -> list[Row]:
    """Rows for the joint as an MJCF model: the certificate of ``twinrig twin``, and paths compared with those of
    constraint equations."""
    step, every = STEP / JOINT_STEPS, JOINT_STEPS * STEPS_PER_ROW
    accelerations, paths = build_differences(mechanism, folder, round(duration / step), step)
    motion, _ = ConstrainedBody(mechanism).run(duration, step, every)
    quantity = f"{family} in MJCF: accelerations of all builds from the file as MuJoCo parsed it"
    tolerance_reason = "rounding; the bound asked for"
    alike = Observed(_id(family, "mjcf.accelerations"), SYSTEM, quantity, accelerations, "of the largest")
    rows: list[Row] = [alike.at_most(EQUAL_ACCELERATION_SHARE, tolerance_reason, "native")]
    for name, positions in paths.items():
        off = float(np.abs(positions[::every] - motion.position).max())
        quantity = f"{family} in MJCF: position of the centre from the reference with constraints, {name}"
        observed = Observed(_id(family, f"mjcf.position.{name}"), SYSTEM, quantity, off, "m")
        rows.append(observed.at_most(TWINS, "no code in common but Runge-Kutta's steps of 1 ms", "native"))
    return rows


def _largest_reaction(mechanism: Mechanism, reaction: Reaction) -> tuple[float, float]:
    """Reference sizes for reactions: the larger of largest force and weight (N), and this force times the distance of
    the centre from the joint, at least 1 m (N m)."""
    weight = mechanism.mass * float(np.linalg.norm(mechanism.gravity))
    force = max(float(np.abs(reaction.force).max()), weight)
    return force, force * max(float(np.linalg.norm(mechanism.centre - mechanism.ground.position)), 1.0)


def _reaction_difference(
    mechanism: Mechanism, first_reaction: Reaction, second_reaction: Reaction, rounding: tuple[Any, Any] = (0.0, 0.0)
) -> float:
    """Largest difference of two reactions beyond rounding, divided by the sizes of ``_largest_reaction``."""
    force, moment = _largest_reaction(mechanism, second_reaction)
    off = (
        np.abs(first_reaction.force - second_reaction.force) - rounding[0],
        np.abs(first_reaction.moment - second_reaction.moment) - rounding[1],
    )
    return max(0.0, float(off[0].max()) / force, float(off[1].max()) / moment)


def _own_motion(family: str, mechanism: Mechanism, output: OutputFile) -> Row:
    """Row: reactions by Newton's and Euler's equations from the motion in the file, compared with the file's; no
    integration is involved."""
    off = _reaction_difference(mechanism, output.reaction_of_motion(mechanism), output.reaction())
    why = "Newton's and Euler's equations on the motion that the file tells; the bound asked for"
    quantity = f"{family}: reaction on the file's own motion, by the largest"
    return Observed(_id(family, "own_motion"), SYSTEM, quantity, off, "").at_most(FORCE_BOUND, why, "published")


def _against_file(
    family: str, name: str, mechanism: Mechanism, output: OutputFile, path: BodyMotion, pushed: Reaction
) -> list[Row]:
    m = len(path.times)
    position_error = np.abs(path.position - output.columns["Pos"][:m]) - output.rounding_error("Pos")[:m]
    digits = output.rounding_error("Rforce")[:m], output.rounding_error("Rtorque")[:m]
    theirs = Reaction(output.columns["Rforce"][:m], output.columns["Rtorque"][:m])
    seen = (
        ("position", "position of the centre", max(0.0, float(position_error.max())), "m", PLACE_BOUND),
        (
            "reaction",
            "reaction by the largest",
            _reaction_difference(mechanism, pushed, theirs, digits),
            "",
            FORCE_BOUND,
        ),
    )
    lost = 0.0 if mechanism.springs else output.energy_lost(mechanism)
    rows = []
    for what, words, off, unit, bound in seen:
        quantity = f"{family}: {words}, beside the other code's digits, {name}"
        observed = Observed(_id(family, f"{what}.{name}"), SYSTEM, quantity, off, unit)
        if lost <= LOSES:
            rows.append(observed.at_most(bound, "the bound asked for", "published"))
        else:
            why = f"nothing damps, and the motion in the file loses {100 * lost:.2g} % of its kinetic energy: its error"
            rows.append(observed.aim(bound, why))
    return rows


def _windows(family: str, mechanism: Mechanism, output: OutputFile, duration: float) -> Row:
    """Row: error of the position 0.1 s after each of the file's own states, a time in which the file's integration
    error cannot grow.

    What energy the file loses meanwhile, dE, changes its speed by dE / (m v), and its place by that for this time.
    """
    body, theirs = ConstrainedBody(mechanism), output.motion(mechanism)
    starts = np.arange(0, round(duration / STEP / STEPS_PER_ROW) - WINDOW_ROWS, WINDOW_ROWS)
    ends = [
        body.state_after(body.state_at_row(theirs, k), WINDOW_ROWS * STEPS_PER_ROW, STEP)[:3] for k in starts.tolist()
    ]
    digits = output.rounding_error("Pos")[starts] + output.rounding_error("Pos")[starts + WINDOW_ROWS]
    off = (np.abs(np.array(ends) - theirs.position[starts + WINDOW_ROWS]) - digits).max(axis=1)
    _, total_energy = output.energies(mechanism)
    speed = np.linalg.norm(theirs.velocity, axis=1)
    fastest = np.maximum(speed[starts], speed[starts + WINDOW_ROWS])
    lost = (
        np.abs(total_energy[starts + WINDOW_ROWS] - total_energy[starts])
        / (mechanism.mass * fastest)
        * (WINDOW_ROWS * STEPS_PER_ROW * STEP)
    )
    why = "from state to state of the file, less its digits and what its loss of energy explains; the bound asked for"
    quantity = f"{family}: position 0.1 s after each of the file's own states, reference"
    left = max(0.0, float((off - lost).max()))
    return Observed(_id(family, "window"), SYSTEM, quantity, left, "m").at_most(PLACE_BOUND, why, "published")


def _same_pendulum(family: str, mechanism: Mechanism, output: OutputFile, revolute: Path) -> list[Row]:
    """Rows: the joint compared with the other code's file of the same pendulum on a hinge, in which the energy is kept.

    A body that starts at rest on a ball or a cross swings in a plane. Mass, arm and moment of inertia are those of the
    Revolute case: the other code's files of one motion must agree with one another, too.
    """
    hinge, back = read_output(revolute), Rotation.from_euler("z", -SHARED_FILES[family], degrees=True)
    motion, reaction = ConstrainedBody(mechanism).run(float(hinge.times[-1]), STEP, STEPS_PER_ROW)
    position_error, force = hinge.columns["Pos"], hinge.columns["Rforce"]
    off = float((np.abs(back.apply(motion.position) - position_error) - hinge.rounding_error("Pos")).max())
    pushed = float((np.abs(back.apply(reaction.force) - force) - hinge.rounding_error("Rforce")).max())
    files = np.abs(back.apply(output.columns["Pos"]) - position_error).max(axis=1)
    since = output.times[np.argmax(files > PLACE_BOUND)]
    why = "the same pendulum on a hinge by the other code, in a file that keeps its energy; the bound asked for"
    hinged = f"{family}: %s beside the other code's file of the same pendulum on a hinge, reference"
    both = (
        f"{family}: largest distance of the other code's files of one pendulum, "
        f"above {PLACE_BOUND:g} m from {since:.2f} s on"
    )
    return [
        Observed(_id(family, "hinge"), SYSTEM, hinged % "position", max(0.0, off), "m").at_most(
            PLACE_BOUND, why, "published"
        ),
        Observed(
            _id(family, "hinge_force"),
            SYSTEM,
            hinged % "force by the largest",
            max(0.0, pushed) / float(np.abs(force).max()),
            "",
        ).at_most(FORCE_BOUND, why, "published"),
        Observed(_id(family, "files"), SYSTEM, both, float(files.max()), "m").beside(
            PLACE_BOUND, "one motion: what is left is the error of the file that loses energy", "published"
        ),
    ]


def _twin(
    family: str, name: str, mechanism: Mechanism, run: tuple[BodyMotion, Reaction], plain: tuple[BodyMotion, Reaction]
) -> Row:
    """Rows: a mechanism built of joints in an engine, compared with the reference's constraint equations."""
    position_error = float(np.abs(run[0].position - plain[0].position).max())
    turned = float(np.abs(run[0].rotation - plain[0].rotation).max())
    off = max(position_error, turned, _reaction_difference(mechanism, run[1], plain[1]))
    why = "joint coordinates against constraints with multipliers, no code in common but Runge-Kutta's steps of 5 ms"
    quantity = f"{family}: {name} from the reference: position, rotation, reaction by the largest"
    return Observed(_id(family, f"twin.{name}"), SYSTEM, quantity, off, "m, -").at_most(TWINS, why, "native")


def tables(case_data: dict[str, Any]) -> list[Table]:
    """What the files themselves hold."""
    rows = tuple(
        (family, str(file_facts["digits"]), "-" if file_facts["lost"] is None else f"{file_facts['lost']:.1e}")
        for family, file_facts in case_data.items()
    )
    note = "Where nothing damps, a motion that loses energy carries an integration error of the code that wrote it."
    heads = ("family", "digits of the file", "energy lost by the largest kinetic one")
    return [Table("Motion of the other code", note, heads, rows)] if rows else []
