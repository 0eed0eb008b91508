"""Reading of a user's file: MuJoCo's compiled model, and twinrig's description of it."""

import re
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from models.core.errors import InputError
from models.engines.mujoco_quiet import without_warnings
from models.own_model.content import FileContent, check_and_leave_out, limits_switched_off
from models.own_model.names import object_label
from models.own_model.reading import TwinModel, described_model
from models.own_model.xml_guard import ModelXml, checked_document

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

    document: ModelXml
    twin: TwinModel
    removed_contents: tuple[FileContent, ...]
    ignored_limits: tuple[str, ...]
    notes: tuple[str, ...]


def read_model_file(
    model_path: Path, left_out_kinds: Collection[str] = (), allowed_folder: Path | None = None
) -> ModelFile:
    """Read the model file at a path. Raises InputError for what cannot be read, or has no equivalent and is not named
    in ``left_out_kinds``.

    allowed_folder : in which all files must lie that the model names; the file's own if None.
    """
    document = checked_document(model_path, allowed_folder)
    model, notes = compiled_model(document)
    check_model_numbers(model, model_path.name, document.kind)
    left_out = check_and_leave_out(model, document, left_out_kinds)
    twin = described_model(model, model_path.stem)
    return ModelFile(document, twin, tuple(left_out), tuple(limits_switched_off(model)), tuple(notes))


def compiled_model(model_xml: ModelXml) -> tuple[mujoco.MjModel, list[str]]:
    """The document compiled by MuJoCo's parser, and notes. Raises InputError with the parser's message, the line of
    what it names, and what may help."""
    path, urdf = model_xml.path, model_xml.urdf
    try:
        with without_warnings():
            if urdf is None:
                return mujoco.MjModel.from_xml_path(str(path)), []
            if not any(element.tag == "mesh" for element in model_xml.elements):
                return mujoco.MjModel.from_xml_string(urdf.text), list(urdf.notes)
            spec = mujoco.MjSpec.from_string(urdf.text)
            spec.modelfiledir = str(path.resolve().parent)  # a string alone has its meshes in the current folder
            return spec.compile(), list(urdf.notes)
    except (ValueError, mujoco.FatalError, mujoco.UnexpectedError) as error:
        reason = " ".join(str(error).split()).removesuffix(FUSED_REMARK).rstrip()
        told = f"MuJoCo's parser refuses it: {reason}{_place_text(model_xml, reason)}{_remedy_text(model_xml, reason)}"
        raise InputError(path.name, "", None, told) from None


def _place_text(model_xml: ModelXml, parser_message: str) -> str:
    """Text " (FILE:LINE)" of the element that a message of MuJoCo's parser names without its line, or with line 0 for
    an include; "" if unknown."""
    if named := re.search(r"Element name '([^']+)', id \d+(?!.*line)", parser_message):
        place = model_xml.line(("link", "joint", "body", "geom", "mesh"), named[1])
    else:
        attribute, tag = (
            re.search(r"attribute: '([^']+)'", parser_message),
            re.search(r"Element '([^']+)', line 0", parser_message),
        )
        place = model_xml.line_of_attribute(tag[1], attribute[1]) if tag and attribute else ""
    return f" ({place})" if place else ""


def _remedy_text(model_xml: ModelXml, parser_message: str) -> str:
    """Text on how to correct a mistake that a message of MuJoCo's parser reports; "" where that is plain."""
    said = next((remedy for part, remedy in REMEDIES.items() if part in parser_message), "")
    return f". {said.format(place=COMPILER_PLACES[model_xml.kind])}" if said else ""


def check_model_numbers(mujoco_model: mujoco.MjModel, file_name: str, file_kind: str = "MJCF") -> None:
    """Raise InputError if nothing can move, if a number that affects motion is not finite, if the time step is not
    above 0, or if dry friction is negative."""
    if not mujoco_model.nv:
        stands = "; its first link stands on the world: a joint of type floating, from a link before it, sets it free"
        allowed = f"nothing in it can move: it has no joint{stands if file_kind == 'URDF' else ''}"
        raise InputError(file_name, "", None, allowed)
    for numbers in NUMBERS_OF_MOTION:
        _check_numbers(mujoco_model, file_name, numbers)
    if not np.isfinite(mujoco_model.opt.gravity).all():
        raise InputError(file_name, "option gravity", None, "must be finite numbers")
    if not (np.isfinite(mujoco_model.opt.timestep) and mujoco_model.opt.timestep > 0.0):
        raise InputError(file_name, "option timestep", mujoco_model.opt.timestep, "must be a finite number above 0")
    if (mujoco_model.dof_frictionloss < 0.0).any():
        raise InputError(file_name, "frictionloss", float(mujoco_model.dof_frictionloss.min()), "must be 0 or more")


def _check_numbers(mujoco_model: mujoco.MjModel, file_name: str, array_name: str) -> None:
    """Raise InputError, naming the part of the model, if one of its numbers is not finite or too large."""
    values = np.asarray(getattr(mujoco_model, array_name))
    rows = np.array([np.abs(each).max(initial=0.0) for each in values])
    for row in np.flatnonzero(~(rows <= LARGEST_NUMBER)):
        place = ": ".join(filter(None, (_owner_name(mujoco_model, array_name, int(row)), array_name)))
        if not np.isfinite(rows[row]):
            raise InputError(file_name, place, None, "must be finite numbers")
        raise InputError(file_name, place, float(rows[row]), f"must be {LARGEST_NUMBER:g} or less")


OWNERS = {"jnt": "joint", "eq": "equality", "body": "body", "site": "site", "tendon": "tendon", "actuator": "actuator"}
"""Kinds of parts of a model by the prefix of the names of their numbers."""


def _owner_name(mujoco_model: mujoco.MjModel, array_name: str, row_index: int) -> str:
    """Name of the part of the model to which a row of the numbers belongs; "" where it belongs to none."""
    prefix = array_name.partition("_")[0]
    if prefix == "dof":
        return object_label(mujoco_model, "joint", int(mujoco_model.dof_jntid[row_index]))
    if prefix.startswith("qpos"):
        return object_label(
            mujoco_model, "joint", int(np.searchsorted(mujoco_model.jnt_qposadr, row_index, side="right")) - 1
        )
    return object_label(mujoco_model, OWNERS[prefix], row_index) if prefix in OWNERS else ""
