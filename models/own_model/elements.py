"""The numbers of a compiled model by name: they are compared between two files, and set to zero to see which ones
matter.

An element is one property of one thing: "armature of joint 'hip'". Values are those of MuJoCo's compiled model, in SI
units; an inertia is the tensor in the axes of its body, whichever principal axes a file has.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from models.own_model.coordinates import BALL_JOINT, FREE_JOINT, SLIDE_JOINT
from models.own_model.element_words import WORD_ELEMENTS
from models.own_model.equalities import CONNECT_EQUALITY, couples_joints, is_between_sites, joins_bodies
from models.own_model.names import feature_is_disabled, label
from models.own_model.reading import is_line, pushes_site, sites_of

AFFINE_LAW, CONSTANT_LAW = int(mujoco.mjtGain.mjGAIN_AFFINE), int(mujoco.mjtGain.mjGAIN_FIXED)
"""MuJoCo's numbers of the kinds of actuator laws, which are the same for gain and bias."""
EQUALITY_TOLERANCE = 1e-12
"""Relative difference up to which two values of an element are equal."""
SHOWN_DIGITS, EXACT_DIGITS = 6, 17
"""Digits in which values are shown, and digits in which any two different numbers differ."""


@dataclass(frozen=True, eq=False)
class Element:
    """Property of a part of a model. kind, owner : as in "armature of joint 'hip'"; unit; value : its numbers (k,), or
    one word."""

    kind: str
    owner: str
    unit: str
    value: np.ndarray

    @property
    def key(self) -> tuple[str, str]:
        """Identification of the element: its kind and its owner."""
        return self.kind, self.owner

    @property
    def is_nonzero(self) -> bool:
        """Whether the value is not zero."""
        return value_is_nonzero(self.value)

    @property
    def text(self) -> str:
        """The value with its unit as text."""
        return value_text(self.value, self.unit)

    def has_same_value(self, other: "Element") -> bool:
        """Whether this and another property have the same value."""
        if is_word(self.value) or is_word(other.value):
            return bool(np.array_equal(self.value, other.value))
        if self.value.shape != other.value.shape:
            return False
        size = max(np.abs(self.value).max(initial=0.0), np.abs(other.value).max(initial=0.0))
        return bool(np.abs(self.value - other.value).max(initial=0.0) <= EQUALITY_TOLERANCE * size)


def is_word(value: np.ndarray) -> bool:
    """Whether a value is a word, not numbers."""
    return value.dtype.kind == "U"


def value_is_nonzero(value: np.ndarray) -> bool:
    """Whether a value is a word or contains a number other than zero."""
    return is_word(value) or bool(value.any())


def value_text(value: np.ndarray, unit: str = "", digits: int = SHOWN_DIGITS) -> str:
    """A value with its unit as text; "none" for zeros or an empty value."""
    if not value_is_nonzero(value):
        return "none"
    if is_word(value):
        return ", ".join(value)
    numbers = value[:1] if value.size > 1 and np.ptp(value) == 0.0 else value
    text = ", ".join(f"{number:.{digits}g}" for number in numbers)
    return f"{text if numbers.size == 1 else f'({text})'} {unit}".rstrip()


def distinct_texts(first: np.ndarray, second: np.ndarray, unit: str) -> tuple[str, str]:
    """Two different values as texts, with as few digits as show the difference."""
    texts = value_text(first, unit), value_text(second, unit)
    for digits in range(SHOWN_DIGITS + 1, EXACT_DIGITS + 1):
        if texts[0] != texts[1]:
            break
        texts = value_text(first, unit, digits), value_text(second, unit, digits)
    return texts


def two_digit_text(number: float) -> str:
    """A relative difference as text with two digits; "0" for zero."""
    return f"{number:.1e}" if number else "0"


@dataclass(frozen=True)
class _PropertyKind:
    """A kind of property of all parts of a sort, such as all joints: its name, its unit, its reader and its writer."""

    sort: str
    kind: str
    unit: str
    read: Callable[[mujoco.MjModel, int], np.ndarray]
    write: Callable[[mujoco.MjModel, int, np.ndarray], None]


def elements_of_model(model: mujoco.MjModel) -> dict[tuple[str, str], Element]:
    """All properties of a model, by kind and owner, in the order of the model."""
    return {each.key: each for each in _elements_of_kind(model)}


def set_value(model: mujoco.MjModel, key: tuple[str, str], value: np.ndarray) -> None:
    """Write the value of a property into a model for ``described_model``. Raises KeyError if the model has no such
    property, ValueError if the property cannot have this value."""
    kind, number = _kind_and_index(model, key)
    if kind.read(model, number).shape != value.shape:
        raise ValueError(f"{kind.kind} has another number of values")
    kind.write(model, number, value)
    model.body_sameframe[:] = 0


def remove(model: mujoco.MjModel, key: tuple[str, str]) -> bool:
    """Set a property to zero in a model, if its kind allows this; returns whether it does."""
    kind, number = _kind_and_index(model, key)
    if kind.kind not in REMOVABLE_KINDS:
        return False
    kind.write(model, number, np.zeros_like(kind.read(model, number)))
    return True


def _elements_of_kind(model: mujoco.MjModel) -> Iterator[Element]:
    for kind in ELEMENT_KINDS:
        for number in range(_count_of_sort(model, kind.sort)):
            value = np.atleast_1d(kind.read(model, number))
            if value.size:
                yield Element(kind.kind, _owner_name(model, kind, number), _unit_text(model, kind, number), value)


def _kind_and_index(model: mujoco.MjModel, key: tuple[str, str]) -> tuple[_PropertyKind, int]:
    for kind in ELEMENT_KINDS:
        if kind.kind == key[0]:
            for number in range(_count_of_sort(model, kind.sort)):
                if _owner_name(model, kind, number) == key[1]:
                    return kind, number
    raise KeyError(key)


def _count_of_sort(model: mujoco.MjModel, sort: str) -> int:
    counts = {"joint": model.njnt, "body": model.nbody, "tendon": model.ntendon, "actuator": model.nu}
    return {**counts, "equality": model.neq, "model": 1}[sort]


def _owner_name(model: mujoco.MjModel, kind: _PropertyKind, number: int) -> str:
    return "the model" if kind.sort == "model" else label(model, kind.sort, number)


def _unit_text(model: mujoco.MjModel, kind: _PropertyKind, number: int) -> str:
    """Unit of a property; of two units, that of translation for slides and free joints, else that of rotation."""
    turning, _, shifting = kind.unit.partition(" | ")
    slides = kind.sort == "joint" and model.jnt_type[number] in (SLIDE_JOINT, FREE_JOINT)
    return shifting if shifting and slides else turning


def _body_accessors(field: str) -> tuple[Callable, Callable]:
    return _number_accessors(field, lambda model, b: b)


def _number_accessors(field: str, index_of: Callable[[mujoco.MjModel, int], object]) -> tuple[Callable, Callable]:
    """Reader and writer of a field of a compiled model, at the index that ``index_of`` returns."""

    def write(model: mujoco.MjModel, number: int, value: np.ndarray) -> None:
        numbers = getattr(model, field)
        numbers[index_of(model, number)] = np.reshape(value, np.shape(numbers[index_of(model, number)]))

    return lambda model, number: np.ravel(getattr(model, field)[index_of(model, number)]).copy(), write


def _joint_accessors(field: str) -> tuple[Callable, Callable]:
    return _number_accessors(field, lambda model, j: j)


def _freedom_accessors(field: str) -> tuple[Callable, Callable]:
    """Reader and writer of a field's numbers for all degrees of freedom of a joint: 6, 3 or 1."""

    def places(model: mujoco.MjModel, j: int) -> slice:
        first = int(model.jnt_dofadr[j])
        return slice(first, first + {FREE_JOINT: 6, BALL_JOINT: 3}.get(int(model.jnt_type[j]), 1))

    return _number_accessors(field, places)


def _read_spring_reference(model: mujoco.MjModel, j: int) -> np.ndarray:
    """Rest position of a joint's spring relative to the design position; empty if there is no spring."""
    at = int(model.jnt_qposadr[j])
    several = int(model.jnt_type[j]) in (BALL_JOINT, FREE_JOINT)
    return np.zeros(0) if several or not model.jnt_stiffness[j] else model.qpos_spring[at : at + 1] - model.qpos0[at]


def _write_spring_reference(model: mujoco.MjModel, j: int, value: np.ndarray) -> None:
    at = int(model.jnt_qposadr[j])
    if value.size:
        model.qpos_spring[at] = model.qpos0[at] + value[0]


def _read_zero(model: mujoco.MjModel, j: int) -> np.ndarray:
    """The joint coordinate that the file assigns to the design position of a hinge or slide."""
    at = int(model.jnt_qposadr[j])
    return np.zeros(0) if int(model.jnt_type[j]) in (BALL_JOINT, FREE_JOINT) else model.qpos0[at : at + 1].copy()


def _write_zero(model: mujoco.MjModel, j: int, value: np.ndarray) -> None:
    at = int(model.jnt_qposadr[j])
    model.qpos_spring[at] += value[0] - model.qpos0[at]
    model.qpos0[at] = value[0]


def _read_axis(model: mujoco.MjModel, j: int) -> np.ndarray:
    return np.zeros(0) if int(model.jnt_type[j]) in (BALL_JOINT, FREE_JOINT) else model.jnt_axis[j].copy()


def _read_inertia(model: mujoco.MjModel, b: int) -> np.ndarray:
    """The six components xx, yy, zz, xy, xz, yz (kg m^2) of a body's inertia tensor in the body's axes."""
    numbers = np.empty(9)
    mujoco.mju_quat2Mat(numbers, model.body_iquat[b])
    axes = numbers.reshape(3, 3)
    tensor = axes * model.body_inertia[b] @ axes.T
    return np.array([*tensor.diagonal(), tensor[0, 1], tensor[0, 2], tensor[1, 2]])


def tensor_of(entries: np.ndarray) -> np.ndarray:
    """Inertia tensor (3, 3) from its six components xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = entries
    return np.array(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))


def _write_inertia(model: mujoco.MjModel, b: int, value: np.ndarray) -> None:
    moments, axes = np.linalg.eigh(tensor_of(value))
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    model.body_inertia[b] = moments
    mujoco.mju_mat2Quat(model.body_iquat[b], np.ascontiguousarray(axes).ravel())


def _read_gravity(model: mujoco.MjModel, _: int) -> np.ndarray:
    return np.zeros(3) if feature_is_disabled(model, "GRAVITY") else np.array(model.opt.gravity)


def _write_gravity(model: mujoco.MjModel, _: int, value: np.ndarray) -> None:
    model.opt.gravity[:] = value
    model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)


def _read_gear(model: mujoco.MjModel, i: int) -> np.ndarray:
    """Factors that multiply an actuator's force: six numbers on a site, one elsewhere."""
    return model.actuator_gear[i, : 6 if pushes_site(model, i) else 1].copy()


def _write_gear(model: mujoco.MjModel, i: int, value: np.ndarray) -> None:
    model.actuator_gear[i, : value.size] = value


def _range_accessors(range_field: str, limited_field: str) -> tuple[Callable, Callable]:
    """Reader and writer of a range, given as zeros where the range is not limited."""
    read, write = _number_accessors(range_field, lambda model, i: i)

    def read_limited(model: mujoco.MjModel, i: int) -> np.ndarray:
        return read(model, i) * float(getattr(model, limited_field)[i])

    def write_limited(model: mujoco.MjModel, i: int, value: np.ndarray) -> None:
        getattr(model, limited_field)[i] = value.any()
        write(model, i, value)

    return read_limited, write_limited


def _actuator_law_accessors(numbers: str, kinds: str, first_affine: int) -> tuple[Callable, Callable]:
    """Reader and writer of the three numbers of an actuator's gain or bias. Numbers from index ``first_affine`` on
    count only for an affine law."""

    def read(model: mujoco.MjModel, i: int) -> np.ndarray:
        law = np.array(getattr(model, numbers)[i, :3])
        law[first_affine:] *= getattr(model, kinds)[i] == AFFINE_LAW
        return law

    def write(model: mujoco.MjModel, i: int, value: np.ndarray) -> None:
        getattr(model, kinds)[i] = AFFINE_LAW if value[first_affine:].any() else CONSTANT_LAW
        getattr(model, numbers)[i, :3] = value

    return read, write


def _tendon_coefficient_accessors() -> tuple[Callable, Callable]:
    def places(model: mujoco.MjModel, t: int) -> slice:
        return slice(int(model.tendon_adr[t]), int(model.tendon_adr[t] + model.tendon_num[t]))

    return _number_accessors("wrap_prm", places)


def _read_ends(model: mujoco.MjModel, t: int) -> np.ndarray:
    """Positions of both sites of a straight tendon, in the axes of their bodies."""
    return model.site_pos[sites_of(model, t)].ravel() if is_line(model, t) else np.zeros(0)


def _write_ends(model: mujoco.MjModel, t: int, value: np.ndarray) -> None:
    model.site_pos[sites_of(model, t)] = value.reshape(-1, 3)
    model.site_sameframe[sites_of(model, t)] = 0


def _read_coupling(model: mujoco.MjModel, e: int) -> np.ndarray:
    """Numbers of a coupling of joints: 1 if it is active, its offset and ratio; zeros if it is not."""
    return np.array([1.0, *model.eq_data[e, :2]]) * model.eq_active0[e] if couples_joints(model, e) else np.zeros(0)


def _write_coupling(model: mujoco.MjModel, e: int, value: np.ndarray) -> None:
    model.eq_active0[e], model.eq_data[e, :2] = value[0] != 0.0, value[1:]


def _read_connection(model: mujoco.MjModel, e: int) -> np.ndarray:
    """Numbers of a constraint between bodies: 1 if it is active, and the positions of both ends; zeros if it is not."""
    if not joins_bodies(model, e):
        return np.zeros(0)
    if is_between_sites(model, e):
        sites = [model.eq_obj1id[e], model.eq_obj2id[e]]
        ends = np.concatenate((model.site_pos[sites].ravel(), model.site_quat[sites].ravel()))
    else:
        ends = model.eq_data[e, : 6 if model.eq_type[e] == CONNECT_EQUALITY else 10]
    return np.array([1.0, *ends]) * model.eq_active0[e]


def _write_connection(model: mujoco.MjModel, e: int, value: np.ndarray) -> None:
    model.eq_active0[e] = value[0] != 0.0
    if not value[0]:
        return
    if is_between_sites(model, e):
        sites = [model.eq_obj1id[e], model.eq_obj2id[e]]
        model.site_pos[sites], model.site_quat[sites] = value[1:7].reshape(2, 3), value[7:].reshape(2, 4)
        model.site_sameframe[sites] = 0
    else:
        model.eq_data[e, : len(value) - 1] = value[1:]


def _read_softness(model: mujoco.MjModel, e: int) -> np.ndarray:
    """MuJoCo's softness parameters solref and solimp of a constraint."""
    built = couples_joints(model, e) or joins_bodies(model, e)
    return np.concatenate((model.eq_solref[e], model.eq_solimp[e])) if built else np.zeros(0)


def _write_softness(model: mujoco.MjModel, e: int, value: np.ndarray) -> None:
    model.eq_solref[e], model.eq_solimp[e] = value[:2], value[2:]


def _read_site(model: mujoco.MjModel, i: int) -> np.ndarray:
    """Position and orientation of the site on which an actuator acts, in the axes of its body."""
    site = int(model.actuator_trnid[i, 0])
    return np.concatenate((model.site_pos[site], model.site_quat[site])) if pushes_site(model, i) else np.zeros(0)


def _write_site(model: mujoco.MjModel, i: int, value: np.ndarray) -> None:
    site = int(model.actuator_trnid[i, 0])
    model.site_pos[site], model.site_quat[site], model.site_sameframe[site] = value[:3], value[3:], 0


ELEMENT_KINDS = (
    _PropertyKind("model", "gravity", "m/s^2", _read_gravity, _write_gravity),
    _PropertyKind("body", "mass", "kg", *_body_accessors("body_mass")),
    _PropertyKind("body", "centre of mass", "m", *_body_accessors("body_ipos")),
    _PropertyKind("body", "inertia", "kg m^2", _read_inertia, _write_inertia),
    _PropertyKind("body", "place", "m", *_body_accessors("body_pos")),
    _PropertyKind("body", "orientation", "quaternion", *_body_accessors("body_quat")),
    _PropertyKind("body", "gravity compensation", "", *_body_accessors("body_gravcomp")),
    _PropertyKind("joint", "axis", "", _read_axis, _joint_accessors("jnt_axis")[1]),
    _PropertyKind("joint", "anchor", "m", *_joint_accessors("jnt_pos")),
    _PropertyKind("joint", "zero", "rad | m", _read_zero, _write_zero),
    _PropertyKind("joint", "stiffness", "N m/rad | N/m", *_joint_accessors("jnt_stiffness")),
    _PropertyKind("joint", "spring reference", "rad | m", _read_spring_reference, _write_spring_reference),
    _PropertyKind("joint", "damping", "N m s/rad | N s/m", *_freedom_accessors("dof_damping")),
    _PropertyKind("joint", "armature", "kg m^2 | kg", *_freedom_accessors("dof_armature")),
    _PropertyKind("joint", "friction loss", "N m | N", *_freedom_accessors("dof_frictionloss")),
    _PropertyKind("joint", "range", "rad | m", *_range_accessors("jnt_range", "jnt_limited")),
    _PropertyKind("tendon", "coefficients", "", *_tendon_coefficient_accessors()),
    _PropertyKind("tendon", "ends", "m", _read_ends, _write_ends),
    _PropertyKind("tendon", "stiffness", "N/m", *_number_accessors("tendon_stiffness", lambda model, t: t)),
    _PropertyKind("tendon", "damping", "N s/m", *_number_accessors("tendon_damping", lambda model, t: t)),
    _PropertyKind("tendon", "spring length", "m", *_number_accessors("tendon_lengthspring", lambda model, t: t)),
    _PropertyKind("tendon", "armature", "kg", *_number_accessors("tendon_armature", lambda model, t: t)),
    _PropertyKind("equality", "coupling", "(acts, offset, ratio)", _read_coupling, _write_coupling),
    _PropertyKind("equality", "joint", "(acts, ends)", _read_connection, _write_connection),
    _PropertyKind("equality", "softness", "(solref, solimp)", _read_softness, _write_softness),
    _PropertyKind("actuator", "gear", "", _read_gear, _write_gear),
    _PropertyKind("actuator", "gain", "", *_actuator_law_accessors("actuator_gainprm", "actuator_gaintype", 1)),
    _PropertyKind("actuator", "bias", "", *_actuator_law_accessors("actuator_biasprm", "actuator_biastype", 0)),
    _PropertyKind("actuator", "control range", "", *_range_accessors("actuator_ctrlrange", "actuator_ctrllimited")),
    _PropertyKind("actuator", "place of the site", "(m, quaternion)", _read_site, _write_site),
    *(_PropertyKind(sort, kind, "", read, write) for sort, kind, read, write in WORD_ELEMENTS),
)
REMOVABLE_KINDS = (
    "gravity",
    "gravity compensation",
    "stiffness",
    "damping",
    "armature",
    "friction loss",
    "coupling",
    "joint",
    "gain",
    "bias",
)
"""Kinds of properties that can be removed from a model by setting them to zero."""
