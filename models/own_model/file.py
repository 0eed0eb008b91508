"""Reading of a user's file: MuJoCo's compiled model, and twinrig's description of it."""

import re
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from models.core.errors import InputError
from models.engines.mujoco_quiet import without_warnings
from models.own_model.content import Content, check_and_leave_out, limits_switched_off
from models.own_model.names import label
from models.own_model.reading import TwinModel, described_model
from models.own_model.xml_guard import Document, checked_document

NUMBERS_OF_MOTION = (
    *("body_mass", "body_inertia", "body_pos", "body_quat", "body_ipos", "body_iquat", "body_gravcomp"),
    *("site_pos", "site_quat", "jnt_axis", "jnt_pos"),
    *("qpos0", "qpos_spring", "jnt_stiffness", "jnt_range", "dof_damping", "dof_armature", "dof_frictionloss"),
    *("dof_solref", "dof_solimp"),
    *("tendon_stiffness", "tendon_damping", "tendon_lengthspring", "wrap_prm", "eq_data", "eq_solref", "eq_solimp"),
    *("actuator_gear", "actuator_gainprm", "actuator_biasprm", "actuator_ctrlrange"),
)
"""Names of the numbers of a compiled MuJoCo model that affect motion."""
REMEDIES = {
    "use 'balanceinertia'": "No mass has this inertia: correct it, or let MuJoCo, by "
    '<compiler balanceinertia="true"/> {place}',
    "positive eigenvalues": "No mass has this inertia: correct it",
    "larger than mjMINVAL": "Give it mass and inertia, or fix it to a part that has them; or let MuJoCo, by "
    '<compiler boundmass="1e-6" boundinertia="1e-9"/> {place}, with numbers of yours',
    "Error opening file": "What shapes need must lie beside the model or where its <compiler> says; a body with an "
    "<inertial> of its own can do without",
    "Schema violation": "Is it a part that another model includes? Then give that; or of another version of MuJoCo",
    "not found in": "Is it a part that another model includes, where this name is? Then give that",
}
"""Remedies for mistakes in a file, by a part of the message of MuJoCo's parser."""
FUSED_REMARK = "The static bodies of the spec were fused before this error, and remain so."
"""Remark of MuJoCo's parser that is cut off from messages."""
COMPILER_PLACES = {"MJCF": "below <mujoco>", "URDF": "within a <mujoco> below <robot>"}
"""Where the element <compiler> belongs, by the format of the file."""
LARGEST_NUMBER = 1e30
"""Largest number that a file may contain: sums of larger ones are not finite."""


@dataclass(frozen=True, eq=False)
class ModelFile:
    """A file that was read.

    document : its elements; twin : its model; removed_contents : content without an equivalent, left out on request;
    ignored_limits : joints and tendons whose limits are switched off, and inside whose ranges states are drawn; notes :
    sentences on what reading passed over.
    """

    document: Document
    twin: TwinModel
    removed_contents: tuple[Content, ...]
    ignored_limits: tuple[str, ...]
    notes: tuple[str, ...]


def read(path: Path, without: Collection[str] = (), folder: Path | None = None) -> ModelFile:
    """Read the model file at a path. Raises InputError for what cannot be read, or has no equivalent and is not named
    in ``without``.

    folder : in which all files must lie that the model names; the file's own if None.
    """
    document = checked_document(path, folder)
    model, notes = compiled_model(document)
    check_sane(model, path.name, document.kind)
    left_out = check_and_leave_out(model, document, without)
    twin = described_model(model, path.stem)
    return ModelFile(document, twin, tuple(left_out), tuple(limits_switched_off(model)), tuple(notes))


def compiled_model(document: Document) -> tuple[mujoco.MjModel, list[str]]:
    """The document compiled by MuJoCo's parser, and notes. Raises InputError with the parser's message, the line of
    what it names, and what may help."""
    path, urdf = document.path, document.urdf
    try:
        with without_warnings():
            if urdf is None:
                return mujoco.MjModel.from_xml_path(str(path)), []
            if not any(element.tag == "mesh" for element in document.elements):
                return mujoco.MjModel.from_xml_string(urdf.text), list(urdf.notes)
            spec = mujoco.MjSpec.from_string(urdf.text)
            spec.modelfiledir = str(path.resolve().parent)  # a string alone has its meshes in the current folder
            return spec.compile(), list(urdf.notes)
    except (ValueError, mujoco.FatalError, mujoco.UnexpectedError) as error:
        reason = " ".join(str(error).split()).removesuffix(FUSED_REMARK).rstrip()
        told = f"MuJoCo's parser refuses it: {reason}{_place_text(document, reason)}{_remedy_text(document, reason)}"
        raise InputError(path.name, "", None, told) from None


def _place_text(document: Document, reason: str) -> str:
    """Text " (FILE:LINE)" of the element that a message of MuJoCo's parser names without its line, or with line 0 for
    an include; "" if unknown."""
    if named := re.search(r"Element name '([^']+)', id \d+(?!.*line)", reason):
        place = document.line(("link", "joint", "body", "geom", "mesh"), named[1])
    else:
        attribute, tag = re.search(r"attribute: '([^']+)'", reason), re.search(r"Element '([^']+)', line 0", reason)
        place = document.line_of_attribute(tag[1], attribute[1]) if tag and attribute else ""
    return f" ({place})" if place else ""


def _remedy_text(document: Document, reason: str) -> str:
    """Text on how to correct a mistake that a message of MuJoCo's parser reports; "" where that is plain."""
    said = next((remedy for part, remedy in REMEDIES.items() if part in reason), "")
    return f". {said.format(place=COMPILER_PLACES[document.kind])}" if said else ""


def check_sane(model: mujoco.MjModel, name: str, kind: str = "MJCF") -> None:
    """Raise InputError if nothing can move, if a number that affects motion is not finite, if the time step is not
    above 0, or if dry friction is negative."""
    if not model.nv:
        stands = "; its first link stands on the world: a joint of type floating, from a link before it, sets it free"
        allowed = f"nothing in it can move: it has no joint{stands if kind == 'URDF' else ''}"
        raise InputError(name, "", None, allowed)
    for numbers in NUMBERS_OF_MOTION:
        _check_numbers(model, name, numbers)
    if not np.isfinite(model.opt.gravity).all():
        raise InputError(name, "option gravity", None, "must be finite numbers")
    if not (np.isfinite(model.opt.timestep) and model.opt.timestep > 0.0):
        raise InputError(name, "option timestep", model.opt.timestep, "must be a finite number above 0")
    if (model.dof_frictionloss < 0.0).any():
        raise InputError(name, "frictionloss", float(model.dof_frictionloss.min()), "must be 0 or more")


def _check_numbers(model: mujoco.MjModel, name: str, array_name: str) -> None:
    """Raise InputError, naming the part of the model, if one of its numbers is not finite or too large."""
    values = np.asarray(getattr(model, array_name))
    rows = np.array([np.abs(each).max(initial=0.0) for each in values])
    for row in np.flatnonzero(~(rows <= LARGEST_NUMBER)):
        place = ": ".join(filter(None, (_owner_name(model, array_name, int(row)), array_name)))
        if not np.isfinite(rows[row]):
            raise InputError(name, place, None, "must be finite numbers")
        raise InputError(name, place, float(rows[row]), f"must be {LARGEST_NUMBER:g} or less")


OWNERS = {"jnt": "joint", "eq": "equality", "body": "body", "site": "site", "tendon": "tendon", "actuator": "actuator"}
"""Kinds of parts of a model by the prefix of the names of their numbers."""


def _owner_name(model: mujoco.MjModel, array_name: str, row: int) -> str:
    """Name of the part of the model to which a row of the numbers belongs; "" where it belongs to none."""
    prefix = array_name.partition("_")[0]
    if prefix == "dof":
        return label(model, "joint", int(model.dof_jntid[row]))
    if prefix.startswith("qpos"):
        return label(model, "joint", int(np.searchsorted(model.jnt_qposadr, row, side="right")) - 1)
    return label(model, OWNERS[prefix], row) if prefix in OWNERS else ""
