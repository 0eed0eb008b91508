"""Properties of a model that are words, not numbers: what is switched off, and which parts are connected.

Each has a reader, which gives one word or none, and a writer, which raises ValueError where a model cannot have that
word without being another tree.
"""

from collections.abc import Callable

import mujoco
import numpy as np

from models.own_model.coordinates import SLIDE_JOINT
from models.own_model.equalities import couples_joints, is_between_sites, joins_bodies
from models.own_model.names import feature_is_disabled, label
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


def _word_value(text: str) -> np.ndarray:
    return np.array([text])


def _refusing_writer(what: str) -> Writer:
    """Writer that raises ValueError, for properties that belong to the structure of the tree."""

    def write(model: mujoco.MjModel, number: int, value: np.ndarray) -> None:
        raise ValueError(f"{what} cannot be changed in a compiled model")

    return write


def _index_of_name(model: mujoco.MjModel, sort: str, owner: str) -> int:
    """Index of the joint, body or tendon with the name that ``label`` gives; ValueError if there is none."""
    count = {"joint": model.njnt, "body": model.nbody, "tendon": model.ntendon}[sort]
    for number in range(count):
        if label(model, sort, number) == owner:
            return number
    raise ValueError(f"no {owner}")


def _feature_switch(flag: str) -> tuple[Reader, Writer]:
    """Reader and writer of the switch by which a file turns off a feature of MuJoCo."""
    bit = int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag}"))

    def write(model: mujoco.MjModel, _: int, value: np.ndarray) -> None:
        off = value[0] == SWITCHED_OFF
        model.opt.disableflags = (model.opt.disableflags & ~bit) | (bit if off else 0)

    return lambda model, _: _word_value(SWITCHED_OFF if feature_is_disabled(model, flag) else "on"), write


def _read_switch(model: mujoco.MjModel, i: int) -> np.ndarray:
    """ "on" or "off": whether an actuator acts, or belongs to a group that is switched off."""
    return _word_value("on" if actuator_is_on(model, i) else SWITCHED_OFF)


def _write_switch(model: mujoco.MjModel, i: int, value: np.ndarray) -> None:
    off = value[0] == SWITCHED_OFF
    free = next((g for g in range(LAST_GROUP) if not model.opt.disableactuator & (1 << g)), None)
    if not off and free is None:
        raise ValueError("all groups are off")
    if off:
        model.opt.disableactuator |= 1 << LAST_GROUP
    model.actuator_group[i] = LAST_GROUP if off else free


def _read_type(model: mujoco.MjModel, j: int) -> np.ndarray:
    return _word_value(mujoco.mjtJoint(int(model.jnt_type[j])).name.removeprefix("mjJNT_").lower())


def _write_type(model: mujoco.MjModel, j: int, value: np.ndarray) -> None:
    kinds = {"hinge": HINGE_JOINT, "slide": SLIDE_JOINT}
    if value[0] not in kinds or int(model.jnt_type[j]) not in kinds.values():
        raise ValueError("ball and free joints have other coordinates")
    model.jnt_type[j] = kinds[value[0]]


def _read_parent(model: mujoco.MjModel, j: int) -> np.ndarray:
    """Name of the joint before a joint on the path from the world."""
    body = int(model.jnt_bodyid[j])
    if j > model.body_jntadr[body]:
        return _word_value(label(model, "joint", j - 1))
    return _moved_by(model, int(model.body_parentid[body]))


def _moved_by(model: mujoco.MjModel, body: int) -> np.ndarray:
    """Name of the last joint on the path from the world to a body."""
    while body and not model.body_jntnum[body]:
        body = int(model.body_parentid[body])
    last = int(model.body_jntadr[body] + model.body_jntnum[body] - 1)
    return _word_value(label(model, "joint", last) if body else WORLD_BODY)


def _read_attachment(model: mujoco.MjModel, t: int) -> np.ndarray:
    """Names of the joints of a fixed tendon, or of the bodies at both ends of a straight one."""
    if is_fixed(model, t):
        return _word_value(", ".join(label(model, "joint", j) for j in tendon_travel(model, t)[0]))
    if is_line(model, t):
        return _word_value(", ".join(_body_of(model, site) for site in sites_of(model, t)))
    return np.zeros(0)


def _write_attachment(model: mujoco.MjModel, t: int, value: np.ndarray) -> None:
    names, first = value[0].split(", "), int(model.tendon_adr[t])
    if not is_fixed(model, t) or len(names) != model.tendon_num[t]:
        raise ValueError("a tendon of another kind, or of another number of joints")
    model.wrap_objid[first : first + len(names)] = [_index_of_name(model, "joint", name) for name in names]


def _body_of(model: mujoco.MjModel, site: int) -> str:
    body = int(model.site_bodyid[site])
    return label(model, "body", body) if body else WORLD_BODY


def _read_target(model: mujoco.MjModel, i: int) -> np.ndarray:
    """Name of what an actuator drives: a joint, a tendon, the body of a site."""
    target = int(model.actuator_trnid[i, 0])
    if pushes_site(model, i):
        return _word_value(f"a site of {_body_of(model, target)}")
    if int(model.actuator_trntype[i]) in JOINT_TARGETS:
        return _word_value(label(model, "joint", target))
    tendon = model.actuator_trntype[i] == mujoco.mjtTrn.mjTRN_TENDON
    return _word_value(label(model, "tendon", target)) if tendon else np.zeros(0)


def _write_target(model: mujoco.MjModel, i: int, value: np.ndarray) -> None:
    kind, there = value[0].split(" ")[0], _read_target(model, i)[0].split(" ")[0]
    if kind != there or kind == "a":
        raise ValueError("a target of another kind")
    model.actuator_trnid[i, 0] = _index_of_name(model, kind, value[0])


def _read_partners(model: mujoco.MjModel, e: int) -> np.ndarray:
    """Names of the joints or bodies that an equality constraint connects."""
    things = [int(model.eq_obj1id[e]), int(model.eq_obj2id[e])]
    if couples_joints(model, e):
        return _word_value(" and ".join(label(model, "joint", j) for j in things if j >= 0))
    if not joins_bodies(model, e):
        return np.zeros(0)
    bodies = [
        _body_of(model, s) if is_between_sites(model, e) else label(model, "body", s) if s else WORLD_BODY
        for s in things
    ]
    return _word_value(" and ".join(bodies))


def _write_partners(model: mujoco.MjModel, e: int, value: np.ndarray) -> None:
    names, sort = value[0].split(" and "), "joint" if couples_joints(model, e) else "body"
    before = _read_partners(model, e)[0].split(" and ")
    if len(names) != len(before) or is_between_sites(model, e) or not all(name.startswith(sort) for name in names):
        raise ValueError("a constraint of another kind")
    numbers = [_index_of_name(model, sort, name) for name in names]
    model.eq_obj1id[e], model.eq_obj2id[e] = (*numbers, -1)[:2]


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
