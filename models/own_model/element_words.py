"""Properties of a model that are words, not numbers: what is switched off, and which parts are connected.

Each has a reader, which gives one word or none, and a writer, which raises ValueError where a model cannot have that
word without being another tree.
"""

from collections.abc import Callable

import mujoco
import numpy as np

from models.own_model.coordinates import SLIDE_JOINT
from models.own_model.equalities import couples_joints, is_between_sites, joins_bodies
from models.own_model.names import feature_is_disabled, object_label
from models.own_model.reading import (
    JOINT_TARGETS,
    LAST_GROUP,
    actuator_is_on,
    is_fixed,
    is_line,
    pushes_site,
    sites_of,
    tendon_travel,
)

HINGE_JOINT = int(mujoco.mjtJoint.mjJNT_HINGE)
WORLD_BODY = "the world"
SWITCHED_OFF = "off"
Reader = Callable[[mujoco.MjModel, int], np.ndarray]
Writer = Callable[[mujoco.MjModel, int, np.ndarray], None]


def _word_value(word: str) -> np.ndarray:
    return np.array([word])


def _refusing_writer(property_name: str) -> Writer:
    """Writer that raises ValueError, for properties that belong to the structure of the tree."""

    def write(mujoco_model: mujoco.MjModel, object_index: int, new_value: np.ndarray) -> None:
        raise ValueError(f"{property_name} cannot be changed in a compiled model")

    return write


def _index_of_name(mujoco_model: mujoco.MjModel, object_kind: str, object_name: str) -> int:
    """Index of the joint, body or tendon with the name that ``object_label`` gives; ValueError if there is none."""
    count = {"joint": mujoco_model.njnt, "body": mujoco_model.nbody, "tendon": mujoco_model.ntendon}[object_kind]
    for number in range(count):
        if object_label(mujoco_model, object_kind, number) == object_name:
            return number
    raise ValueError(f"no {object_name}")


def _feature_switch(flag_name: str) -> tuple[Reader, Writer]:
    """Reader and writer of the switch by which a file turns off a feature of MuJoCo."""
    bit = int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag_name}"))

    def write(mujoco_model: mujoco.MjModel, _: int, new_value: np.ndarray) -> None:
        off = new_value[0] == SWITCHED_OFF
        mujoco_model.opt.disableflags = (mujoco_model.opt.disableflags & ~bit) | (bit if off else 0)

    return lambda model, _: _word_value(SWITCHED_OFF if feature_is_disabled(model, flag_name) else "on"), write


def _read_switch(mujoco_model: mujoco.MjModel, actuator: int) -> np.ndarray:
    """ "on" or "off": whether an actuator acts, or belongs to a group that is switched off."""
    return _word_value("on" if actuator_is_on(mujoco_model, actuator) else SWITCHED_OFF)


def _write_switch(mujoco_model: mujoco.MjModel, actuator: int, new_value: np.ndarray) -> None:
    off = new_value[0] == SWITCHED_OFF
    free = next((g for g in range(LAST_GROUP) if not mujoco_model.opt.disableactuator & (1 << g)), None)
    if not off and free is None:
        raise ValueError("all groups are off")
    if off:
        mujoco_model.opt.disableactuator |= 1 << LAST_GROUP
    mujoco_model.actuator_group[actuator] = LAST_GROUP if off else free


def _read_type(mujoco_model: mujoco.MjModel, joint: int) -> np.ndarray:
    return _word_value(mujoco.mjtJoint(int(mujoco_model.jnt_type[joint])).name.removeprefix("mjJNT_").lower())


def _write_type(mujoco_model: mujoco.MjModel, joint: int, new_value: np.ndarray) -> None:
    kinds = {"hinge": HINGE_JOINT, "slide": SLIDE_JOINT}
    if new_value[0] not in kinds or int(mujoco_model.jnt_type[joint]) not in kinds.values():
        raise ValueError("ball and free joints have other coordinates")
    mujoco_model.jnt_type[joint] = kinds[new_value[0]]


def _read_parent(mujoco_model: mujoco.MjModel, joint: int) -> np.ndarray:
    """Name of the joint before a joint on the path from the world."""
    body = int(mujoco_model.jnt_bodyid[joint])
    if joint > mujoco_model.body_jntadr[body]:
        return _word_value(object_label(mujoco_model, "joint", joint - 1))
    return _moved_by(mujoco_model, int(mujoco_model.body_parentid[body]))


def _moved_by(mujoco_model: mujoco.MjModel, body: int) -> np.ndarray:
    """Name of the last joint on the path from the world to a body."""
    while body and not mujoco_model.body_jntnum[body]:
        body = int(mujoco_model.body_parentid[body])
    last = int(mujoco_model.body_jntadr[body] + mujoco_model.body_jntnum[body] - 1)
    return _word_value(object_label(mujoco_model, "joint", last) if body else WORLD_BODY)


def _read_attachment(mujoco_model: mujoco.MjModel, tendon: int) -> np.ndarray:
    """Names of the joints of a fixed tendon, or of the bodies at both ends of a straight one."""
    if is_fixed(mujoco_model, tendon):
        return _word_value(
            ", ".join(object_label(mujoco_model, "joint", j) for j in tendon_travel(mujoco_model, tendon)[0])
        )
    if is_line(mujoco_model, tendon):
        return _word_value(", ".join(_body_of(mujoco_model, site) for site in sites_of(mujoco_model, tendon)))
    return np.zeros(0)


def _write_attachment(mujoco_model: mujoco.MjModel, tendon: int, new_value: np.ndarray) -> None:
    names, first = new_value[0].split(", "), int(mujoco_model.tendon_adr[tendon])
    if not is_fixed(mujoco_model, tendon) or len(names) != mujoco_model.tendon_num[tendon]:
        raise ValueError("a tendon of another kind, or of another number of joints")
    mujoco_model.wrap_objid[first : first + len(names)] = [
        _index_of_name(mujoco_model, "joint", name) for name in names
    ]


def _body_of(mujoco_model: mujoco.MjModel, site: int) -> str:
    body = int(mujoco_model.site_bodyid[site])
    return object_label(mujoco_model, "body", body) if body else WORLD_BODY


def _read_target(mujoco_model: mujoco.MjModel, actuator: int) -> np.ndarray:
    """Name of what an actuator drives: a joint, a tendon, the body of a site."""
    target = int(mujoco_model.actuator_trnid[actuator, 0])
    if pushes_site(mujoco_model, actuator):
        return _word_value(f"a site of {_body_of(mujoco_model, target)}")
    if int(mujoco_model.actuator_trntype[actuator]) in JOINT_TARGETS:
        return _word_value(object_label(mujoco_model, "joint", target))
    tendon = mujoco_model.actuator_trntype[actuator] == mujoco.mjtTrn.mjTRN_TENDON
    return _word_value(object_label(mujoco_model, "tendon", target)) if tendon else np.zeros(0)


def _write_target(mujoco_model: mujoco.MjModel, actuator: int, new_value: np.ndarray) -> None:
    kind, there = new_value[0].split(" ")[0], _read_target(mujoco_model, actuator)[0].split(" ")[0]
    if kind != there or kind == "a":
        raise ValueError("a target of another kind")
    mujoco_model.actuator_trnid[actuator, 0] = _index_of_name(mujoco_model, kind, new_value[0])


def _read_partners(mujoco_model: mujoco.MjModel, equality: int) -> np.ndarray:
    """Names of the joints or bodies that an equality constraint connects."""
    things = [int(mujoco_model.eq_obj1id[equality]), int(mujoco_model.eq_obj2id[equality])]
    if couples_joints(mujoco_model, equality):
        return _word_value(" and ".join(object_label(mujoco_model, "joint", j) for j in things if j >= 0))
    if not joins_bodies(mujoco_model, equality):
        return np.zeros(0)
    bodies = [
        _body_of(mujoco_model, s)
        if is_between_sites(mujoco_model, equality)
        else object_label(mujoco_model, "body", s)
        if s
        else WORLD_BODY
        for s in things
    ]
    return _word_value(" and ".join(bodies))


def _write_partners(mujoco_model: mujoco.MjModel, equality: int, new_value: np.ndarray) -> None:
    names, sort = new_value[0].split(" and "), "joint" if couples_joints(mujoco_model, equality) else "body"
    before = _read_partners(mujoco_model, equality)[0].split(" and ")
    if (
        len(names) != len(before)
        or is_between_sites(mujoco_model, equality)
        or not all(name.startswith(sort) for name in names)
    ):
        raise ValueError("a constraint of another kind")
    numbers = [_index_of_name(mujoco_model, sort, name) for name in names]
    mujoco_model.eq_obj1id[equality], mujoco_model.eq_obj2id[equality] = (*numbers, -1)[:2]


WORD_ELEMENTS: tuple[tuple[str, str, Reader, Writer], ...] = (
    ("model", "springs", *_feature_switch("SPRING")),
    ("model", "dampers", *_feature_switch("DAMPER")),
    ("model", "actuators", *_feature_switch("ACTUATION")),
    ("model", "equality constraints", *_feature_switch("EQUALITY")),
    ("model", "dry friction", *_feature_switch("FRICTIONLOSS")),
    ("actuator", "switch", _read_switch, _write_switch),
    ("joint", "type", _read_type, _write_type),
    ("joint", "parent", _read_parent, _refusing_writer("the joint before a joint")),
    ("body", "supporting joint", _moved_by, _refusing_writer("the joint that moves a body")),
    ("tendon", "attachment", _read_attachment, _write_attachment),
    ("actuator", "target", _read_target, _write_target),
    ("equality", "partners", _read_partners, _write_partners),
)
"""Properties that are words: kind of owner, name of the property, its reader and its writer."""
