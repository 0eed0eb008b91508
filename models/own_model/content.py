"""Content of a file beyond a tree of bodies with linear force laws: refused by name and line where twinrig has no
equivalent, left out on request.

Limits of joints are the exception: as long as no coordinate leaves its range they do nothing, so states are drawn
inside the ranges, limits are switched off in the file's own model, and that is said.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from models.core.errors import InputError
from models.engines.native_mujoco import SOLVER_TOLERANCE
from models.own_model.coordinates import BALL_JOINT, FREE_JOINT
from models.own_model.equalities import couples_joints, joins_bodies
from models.own_model.names import feature_is_disabled, first_names_text, object_label, object_name
from models.own_model.reading import (
    JOINT_TARGETS,
    affine_law,
    compensation,
    has_dry_friction,
    is_fixed,
    is_line,
    pushes_site,
)
from models.own_model.xml_guard import ModelXml

DSBL, TRN, GAIN, BIAS = mujoco.mjtDisableBit, mujoco.mjtTrn, mujoco.mjtGain, mujoco.mjtBias
PLAIN_ACTUATORS = ("motor", "position", "velocity", "general", "damper")
STATEFUL_ACTUATORS = ("intvelocity", "cylinder", "muscle", "adhesion", "dcmotor", "pid")
TAGS_OF_ELEMENT = {
    "joint": ("joint", "freejoint"),
    "tendon": ("fixed", "spatial"),
    "body": ("body", "link"),
    "geom": ("geom",),
    "actuator": (*PLAIN_ACTUATORS, *STATEFUL_ACTUATORS),
    "equality": ("connect", "weld", "joint", "tendon", "flex"),
    "flex": ("flex", "flexcomp"),
}
"""Tags of the elements of MJCF and URDF that have a name, by MuJoCo's name for the kind of object."""
AFFINE_GAINS = (int(GAIN.mjGAIN_FIXED), int(GAIN.mjGAIN_AFFINE))
AFFINE_BIASES = (int(BIAS.mjBIAS_NONE), int(BIAS.mjBIAS_AFFINE))


@dataclass(frozen=True)
class FileContent:
    """Content of a file that needs attention. kind : its name for ``--without``; names : of the elements concerned,
    with "FILE:LINE" where known; reason : why other builds cannot represent it."""

    kind: str
    names: tuple[str, ...]
    reason: str

    def line(self) -> str:
        """Text of one line with kind, names and reason."""
        return f"{self.kind}: {first_names_text(self.names)}: {self.reason}"


def contents_of_model(mujoco_model: mujoco.MjModel, model_xml: ModelXml) -> list[FileContent]:
    """All content of the model beyond a tree with linear force laws, one item for each kind that occurs."""
    return _contents_of_kind(mujoco_model, model_xml, lambda kind, what, number: True)


def without_equal(mujoco_model: mujoco.MjModel, model_xml: ModelXml) -> list[FileContent]:
    """The content of ``contents_of_model`` that other builds cannot represent."""
    return _contents_of_kind(
        mujoco_model, model_xml, lambda kind, what, number: not _has_equal(mujoco_model, kind, what, number)
    )


def _contents_of_kind(
    mujoco_model: mujoco.MjModel, model_xml: ModelXml, is_wanted: Callable[[str, str, int], bool]
) -> list[FileContent]:
    rows = list[FileContent]()
    for kind, (listed, why, _) in CONTENT_KINDS.items():
        if names := [
            _with_line(mujoco_model, model_xml, *each) for each in listed(mujoco_model) if is_wanted(kind, *each)
        ]:
            rows.append(FileContent(kind, tuple(names), why))
    return rows


def _has_equal(mujoco_model: mujoco.MjModel, content_kind: str, object_kind: str, object_index: int) -> bool:
    """Whether other builds can represent an object of the file: a ball joint without rotor, dry friction of a hinge or
    slide, or an equality constraint between bodies or of one or two hinges or slides."""
    if content_kind == "friction_loss":
        return object_kind == "joint" and has_dry_friction(mujoco_model, object_index)
    if content_kind == "turning_law":
        return not _has_rotor(mujoco_model, object_index)
    return content_kind == "equality" and (
        couples_joints(mujoco_model, object_index) or joins_bodies(mujoco_model, object_index)
    )


def check_and_leave_out(
    mujoco_model: mujoco.MjModel, model_xml: ModelXml, left_out_kinds: Collection[str]
) -> list[FileContent]:
    """Remove the kinds of content named in ``left_out_kinds`` from the model, and return what was removed. Raises
    InputError where other content cannot be represented."""
    for kind in left_out_kinds:
        if kind not in CONTENT_KINDS:
            raise InputError("--without", "", kind, "no such content", tuple(CONTENT_KINDS))
    if there := [
        row for row in without_equal(mujoco_model, model_xml) if row.kind not in left_out_kinds or row.kind == "flex"
    ]:
        raise InputError(model_xml.path.name, "", None, _refusal(there, left_out_kinds))
    left_out = [row for row in contents_of_model(mujoco_model, model_xml) if row.kind in left_out_kinds]
    for row in left_out:
        CONTENT_KINDS[row.kind][2](mujoco_model)
    mujoco_model.opt.disableflags |= int(DSBL.mjDSBL_LIMIT) | int(DSBL.mjDSBL_AUTORESET) | int(DSBL.mjDSBL_SENSOR)
    mujoco_model.opt.solver = mujoco.mjtSolver.mjSOL_NEWTON  # constraints are compared, not their solvers
    mujoco_model.opt.iterations, mujoco_model.opt.noslip_iterations = max(100, mujoco_model.opt.iterations), 0
    mujoco_model.opt.tolerance = min(SOLVER_TOLERANCE, mujoco_model.opt.tolerance)
    if not feature_is_disabled(mujoco_model, "REFSAFE"):  # at shorter steps of a path constraints stay as soft
        for times in (mujoco_model.eq_solref[:, 0], mujoco_model.dof_solref[:, 0]):
            times[:] = np.where(times > 0.0, np.maximum(times, 2.0 * mujoco_model.opt.timestep), times)
    return left_out


def _refusal(contents: Sequence[FileContent], left_out_kinds: Collection[str]) -> str:
    """Text of a refusal: the content without an equivalent, and the option that leaves all of it out;
    left_out_kinds : kinds left out already."""
    told = ". ".join(row.line() for row in contents)
    if any(row.kind == "flex" for row in contents):
        return (
            f"{told}. Deformable bodies have no equal, and cannot be left out: their vertices are bodies of the model"
        )
    subject_and_verb, pronoun = ("It has", "it") if len(contents) == 1 else ("They have", "them")
    kinds = ",".join(dict.fromkeys((*left_out_kinds, *(row.kind for row in contents))))
    return f"{told}. {subject_and_verb} no equal in the other builds; leave {pronoun} out with `--without {kinds}`"


def _with_line(mujoco_model: mujoco.MjModel, model_xml: ModelXml, object_kind: str, object_index: int) -> str:
    if object_index == NAMELESS_INDEX:
        return object_kind
    name = object_name(mujoco_model, object_kind, object_index)
    line = model_xml.line(TAGS_OF_ELEMENT.get(object_kind, ()), name) if name else ""
    return (
        f"{object_label(mujoco_model, object_kind, object_index)} ({line})"
        if line
        else object_label(mujoco_model, object_kind, object_index)
    )


ObjectIterator = Iterator[tuple[str, int]]
"""Objects of a model: MuJoCo's name for the kind of object, and its number."""
NAMELESS_INDEX = -1


def _touching_geoms(mujoco_model: mujoco.MjModel) -> ObjectIterator:
    """Geoms that could come into contact with another geom, and explicit contact pairs."""
    if feature_is_disabled(mujoco_model, "CONTACT"):
        return
    weld, above = mujoco_model.body_weldid, mujoco_model.body_weldid[mujoco_model.body_parentid]
    of = weld[mujoco_model.geom_bodyid]
    parents, filtered = above[of], not feature_is_disabled(mujoco_model, "FILTERPARENT")
    for g in range(mujoco_model.ngeom):
        fits = (mujoco_model.geom_contype[g] & mujoco_model.geom_conaffinity) | (
            mujoco_model.geom_conaffinity[g] & mujoco_model.geom_contype
        )
        kin = (of != 0) & (of[g] != 0) & ((parents == of[g]) | (parents[g] == of))
        if (fits.astype(bool) & (of != of[g]) & ~(kin & filtered)).any():
            yield "geom", g
    for p in range(mujoco_model.npair):
        yield "pair", p


def _joints_with_dry_friction(mujoco_model: mujoco.MjModel) -> ObjectIterator:
    if feature_is_disabled(mujoco_model, "FRICTIONLOSS"):
        return
    for j in sorted(set(mujoco_model.dof_jntid[mujoco_model.dof_frictionloss > 0.0])):
        yield "joint", int(j)
    for t in np.flatnonzero(mujoco_model.tendon_frictionloss > 0.0):
        yield "tendon", int(t)


def _unbuilt_equalities(mujoco_model: mujoco.MjModel) -> ObjectIterator:
    if not feature_is_disabled(mujoco_model, "EQUALITY"):
        for e in np.flatnonzero(mujoco_model.eq_active0):
            yield "equality", int(e)


def _unbuilt_actuators(mujoco_model: mujoco.MjModel) -> ObjectIterator:
    """Actuators that have a state, act along a spatial tendon, or follow a force law that is not affine."""
    for i in range(mujoco_model.nu):
        target = int(mujoco_model.actuator_trnid[i, 0])
        kind = int(mujoco_model.actuator_trntype[i])
        along_joint = kind in JOINT_TARGETS and int(mujoco_model.jnt_type[target]) not in (BALL_JOINT, FREE_JOINT)
        along_tendon = kind == TRN.mjTRN_TENDON and is_fixed(mujoco_model, target)
        on_site = pushes_site(mujoco_model, i) and not any(
            affine_law(mujoco_model, i, control)[2] for control in (0.0, 1.0)
        )
        straight = (
            int(mujoco_model.actuator_gaintype[i]) in AFFINE_GAINS
            and int(mujoco_model.actuator_biastype[i]) in AFFINE_BIASES
        )
        more = (
            mujoco_model.actuator_damping[i]
            or mujoco_model.actuator_armature[i]
            or mujoco_model.actuator_dampingpoly[i].any()
        )
        stateless = mujoco_model.actuator_dyntype[i] == mujoco.mjtDyn.mjDYN_NONE and not mujoco_model.actuator_delay[i]
        if not ((along_joint or along_tendon or on_site) and straight and stateless) or more:
            yield "actuator", i


def _limited_elements(mujoco_model: mujoco.MjModel) -> ObjectIterator:
    if not mujoco_model.nu:
        return
    for i in np.flatnonzero(mujoco_model.actuator_forcelimited):
        yield "actuator", int(i)
    for j in np.flatnonzero(mujoco_model.jnt_actfrclimited):
        yield "joint", int(j)
    for t in np.flatnonzero(mujoco_model.tendon_actfrclimited):
        yield "tendon", int(t)


def _spatial_tendons(mujoco_model: mujoco.MjModel) -> ObjectIterator:
    for t in range(mujoco_model.ntendon):
        forces = mujoco_model.tendon_stiffness[t] or mujoco_model.tendon_damping[t] or mujoco_model.tendon_armature[t]
        slack = mujoco_model.tendon_stiffness[t] and np.ptp(mujoco_model.tendon_lengthspring[t])
        straight = is_fixed(mujoco_model, t) or (is_line(mujoco_model, t) and not mujoco_model.tendon_armature[t])
        if (forces and not straight) or slack:
            yield "tendon", t


def _turning_laws(mujoco_model: mujoco.MjModel) -> ObjectIterator:
    """Ball and free joints with springs, dampers or rotors that act about all three axes at once."""
    for j in np.flatnonzero((mujoco_model.jnt_type == BALL_JOINT) | (mujoco_model.jnt_type == FREE_JOINT)):
        first = int(mujoco_model.jnt_dofadr[j]) + (3 if mujoco_model.jnt_type[j] == FREE_JOINT else 0)
        if mujoco_model.jnt_stiffness[j] or mujoco_model.dof_damping[first] or _has_rotor(mujoco_model, int(j)):
            yield "joint", int(j)


def _has_rotor(mujoco_model: mujoco.MjModel, joint: int) -> bool:
    """Whether a ball joint has an armature."""
    return bool(
        mujoco_model.jnt_type[joint] == BALL_JOINT and mujoco_model.dof_armature[mujoco_model.jnt_dofadr[joint]]
    )


def _nonlinear_laws(mujoco_model: mujoco.MjModel) -> ObjectIterator:
    for j in range(mujoco_model.njnt):
        bent = mujoco_model.jnt_stiffnesspoly[j].any() or mujoco_model.dof_dampingpoly[mujoco_model.jnt_dofadr[j]].any()
        if bent or (mujoco_model.nplastic and mujoco_model.jnt_plasticadr[j] >= 0):
            yield "joint", j
    for t in range(mujoco_model.ntendon):
        bent = mujoco_model.tendon_stiffnesspoly[t].any() or mujoco_model.tendon_dampingpoly[t].any()
        if bent or (mujoco_model.nplastic and mujoco_model.tendon_plasticadr[t] >= 0):
            yield "tendon", t


def _partly_compensated_bodies(mujoco_model: mujoco.MjModel) -> ObjectIterator:
    for b in range(1, mujoco_model.nbody):
        if 0.0 < compensation(mujoco_model, b) < 1.0:
            yield "body", b


def _medium_elements(mujoco_model: mujoco.MjModel) -> ObjectIterator:
    if mujoco_model.opt.density or mujoco_model.opt.viscosity:
        yield "density and viscosity", NAMELESS_INDEX


def _flexible_elements(mujoco_model: mujoco.MjModel) -> ObjectIterator:
    for i in range(mujoco_model.nflex):
        yield "flex", i


def _forget_contacts(mujoco_model: mujoco.MjModel) -> None:
    mujoco_model.opt.disableflags |= int(DSBL.mjDSBL_CONTACT)


def _forget_friction(mujoco_model: mujoco.MjModel) -> None:
    mujoco_model.opt.disableflags |= int(DSBL.mjDSBL_FRICTIONLOSS)


def _forget_equalities(mujoco_model: mujoco.MjModel) -> None:
    mujoco_model.opt.disableflags |= int(DSBL.mjDSBL_EQUALITY)


def _forget_actuators(mujoco_model: mujoco.MjModel) -> None:
    """Switch off the force of the actuators from ``_unbuilt_actuators``, by setting gain and bias to zero."""
    for i in [i for _, i in _unbuilt_actuators(mujoco_model)]:
        mujoco_model.actuator_gaintype[i], mujoco_model.actuator_biastype[i] = GAIN.mjGAIN_FIXED, BIAS.mjBIAS_NONE
        mujoco_model.actuator_gainprm[i], mujoco_model.actuator_biasprm[i] = 0.0, 0.0
        mujoco_model.actuator_damping[i] = mujoco_model.actuator_armature[i] = 0.0
        mujoco_model.actuator_dampingpoly[i] = 0.0


def _forget_bounds(mujoco_model: mujoco.MjModel) -> None:
    mujoco_model.actuator_forcelimited[:] = mujoco_model.jnt_actfrclimited[:] = mujoco_model.tendon_actfrclimited[:] = 0


def _forget_tendons(mujoco_model: mujoco.MjModel) -> None:
    for t in [t for _, t in _spatial_tendons(mujoco_model)]:
        mujoco_model.tendon_stiffness[t] = mujoco_model.tendon_damping[t] = mujoco_model.tendon_armature[t] = 0.0


def _forget_turning_laws(mujoco_model: mujoco.MjModel) -> None:
    for j in np.flatnonzero((mujoco_model.jnt_type == BALL_JOINT) | (mujoco_model.jnt_type == FREE_JOINT)):
        first = int(mujoco_model.jnt_dofadr[j]) + (3 if mujoco_model.jnt_type[j] == FREE_JOINT else 0)
        mujoco_model.dof_damping[first : first + 3] = mujoco_model.jnt_stiffness[j] = 0.0
        if mujoco_model.jnt_type[j] == BALL_JOINT:
            mujoco_model.dof_armature[first : first + 3] = 0.0


def _forget_bent_laws(mujoco_model: mujoco.MjModel) -> None:
    for numbers in ("jnt_stiffnesspoly", "dof_dampingpoly", "tendon_stiffnesspoly", "tendon_dampingpoly"):
        getattr(mujoco_model, numbers)[:] = 0.0
    mujoco_model.jnt_springyield[:] = mujoco_model.tendon_springyield[:] = 0.0


def _forget_compensation(mujoco_model: mujoco.MjModel) -> None:
    for b in [b for _, b in _partly_compensated_bodies(mujoco_model)]:
        mujoco_model.body_gravcomp[b] = 0.0


def _forget_medium(mujoco_model: mujoco.MjModel) -> None:
    mujoco_model.opt.density = mujoco_model.opt.viscosity = 0.0


def _keep_flexes(mujoco_model: mujoco.MjModel) -> None:
    """Does nothing: a model with flexes has been refused before."""


CONTENT_KINDS: dict[str, tuple[Callable[[mujoco.MjModel], ObjectIterator], str, Callable[[mujoco.MjModel], None]]] = {
    "contact": (_touching_geoms, "bodies that may touch", _forget_contacts),
    "friction_loss": (
        _joints_with_dry_friction,
        "dry friction, a soft constraint in MuJoCo, is built for hinges and slides alone",
        _forget_friction,
    ),
    "equality": (
        _unbuilt_equalities,
        "a soft constraint in MuJoCo, which is built between points of bodies, and for joints that follow another in "
        "proportion",
        _forget_equalities,
    ),
    "actuator": (
        _unbuilt_actuators,
        "a state, a delay, a muscle, a rotor of its own, or a target other than a hinge, a slide, a fixed tendon, or a "
        "site that it does not damp",
        _forget_actuators,
    ),
    "force_range": (_limited_elements, "a force that is cut off at a bound", _forget_bounds),
    "tendon": (
        _spatial_tendons,
        "a spring around bodies or with slack, or a rotor along a way in space",
        _forget_tendons,
    ),
    "turning_law": (
        _turning_laws,
        "a rotor of a ball joint, or what turns it or a free one back",
        _forget_turning_laws,
    ),
    "bent_law": (_nonlinear_laws, "a stiffness or damping that is no constant", _forget_bent_laws),
    "gravity_compensation": (
        _partly_compensated_bodies,
        "weight that is compensated at some joints alone, since others leave that to actuators, which are off",
        _forget_compensation,
    ),
    "fluid": (_medium_elements, "forces of a medium", _forget_medium),
    "flex": (_flexible_elements, "a deformable body", _keep_flexes),
}
"""Kinds of content without an equivalent: function that lists it in a model, reason why other builds lack it, function
that removes it."""


def limits_switched_off(mujoco_model: mujoco.MjModel) -> list[str]:
    """Names of the joints and tendons whose limits were switched off."""
    joints = [object_label(mujoco_model, "joint", int(j)) for j in np.flatnonzero(mujoco_model.jnt_limited)]
    return joints + [object_label(mujoco_model, "tendon", int(t)) for t in np.flatnonzero(mujoco_model.tendon_limited)]
