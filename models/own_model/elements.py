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
from models.own_model.names import feature_is_disabled, object_label
from models.own_model.reading import is_line, pushes_site, sites_of

AFFINE_LAW, CONSTANT_LAW = int(mujoco.mjtGain.mjGAIN_AFFINE), int(mujoco.mjtGain.mjGAIN_FIXED)
"""MuJoCo's numbers of the kinds of actuator laws, which are the same for gain and bias."""
EQUALITY_TOLERANCE = 1e-12
"""Relative difference up to which two values of an element are equal."""
SHOWN_DIGITS, EXACT_DIGITS = 6, 17
"""Digits in which values are shown, and digits in which any two different numbers differ."""


@dataclass(frozen=True, eq=False)
class ModelProperty:
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

    def has_same_value(self, other_element: "ModelProperty") -> bool:
        """Whether this and another property have the same value."""
        if is_word(self.value) or is_word(other_element.value):
            return bool(np.array_equal(self.value, other_element.value))
        if self.value.shape != other_element.value.shape:
            return False
        size = max(np.abs(self.value).max(initial=0.0), np.abs(other_element.value).max(initial=0.0))
        return bool(np.abs(self.value - other_element.value).max(initial=0.0) <= EQUALITY_TOLERANCE * size)


def is_word(property_value: np.ndarray) -> bool:
    """Whether a value is a word, not numbers."""
    return property_value.dtype.kind == "U"


def value_is_nonzero(property_value: np.ndarray) -> bool:
    """Whether a value is a word or contains a number other than zero."""
    return is_word(property_value) or bool(property_value.any())


def value_text(property_value: np.ndarray, unit: str = "", digits: int = SHOWN_DIGITS) -> str:
    """A value with its unit as text; "none" for zeros or an empty value."""
    if not value_is_nonzero(property_value):
        return "none"
    if is_word(property_value):
        return ", ".join(property_value)
    numbers = property_value[:1] if property_value.size > 1 and np.ptp(property_value) == 0.0 else property_value
    text = ", ".join(f"{number:.{digits}g}" for number in numbers)
    return f"{text if numbers.size == 1 else f'({text})'} {unit}".rstrip()


def distinct_texts(first_value: np.ndarray, second_value: np.ndarray, unit: str) -> tuple[str, str]:
    """Two different values as texts, with as few digits as show the difference."""
    texts = value_text(first_value, unit), value_text(second_value, unit)
    for digits in range(SHOWN_DIGITS + 1, EXACT_DIGITS + 1):
        if texts[0] != texts[1]:
            break
        texts = value_text(first_value, unit, digits), value_text(second_value, unit, digits)
    return texts


def two_digit_text(relative_difference: float) -> str:
    """A relative difference as text with two digits; "0" for zero."""
    return f"{relative_difference:.1e}" if relative_difference else "0"


@dataclass(frozen=True)
class _PropertyKind:
    """A kind of property of all parts of a sort, such as all joints: its name, its unit, its reader and its writer."""

    sort: str
    kind: str
    unit: str
    read: Callable[[mujoco.MjModel, int], np.ndarray]
    write: Callable[[mujoco.MjModel, int, np.ndarray], None]


def elements_of_model(mujoco_model: mujoco.MjModel) -> dict[tuple[str, str], ModelProperty]:
    """All properties of a model, by kind and owner, in the order of the model."""
    return {each.key: each for each in _elements_of_kind(mujoco_model)}


def set_property(mujoco_model: mujoco.MjModel, property_key: tuple[str, str], new_value: np.ndarray) -> None:
    """Write the value of a property into a model for ``described_model``. Raises KeyError if the model has no such
    property, ValueError if the property cannot have this value."""
    kind, number = _kind_and_index(mujoco_model, property_key)
    if kind.read(mujoco_model, number).shape != new_value.shape:
        raise ValueError(f"{kind.kind} has another number of values")
    kind.write(mujoco_model, number, new_value)
    mujoco_model.body_sameframe[:] = 0


def remove_property(mujoco_model: mujoco.MjModel, property_key: tuple[str, str]) -> bool:
    """Set a property to zero in a model, if its kind allows this; returns whether it does."""
    kind, number = _kind_and_index(mujoco_model, property_key)
    if kind.kind not in REMOVABLE_KINDS:
        return False
    kind.write(mujoco_model, number, np.zeros_like(kind.read(mujoco_model, number)))
    return True


def _elements_of_kind(mujoco_model: mujoco.MjModel) -> Iterator[ModelProperty]:
    for kind in ELEMENT_KINDS:
        for number in range(_count_of_sort(mujoco_model, kind.sort)):
            value = np.atleast_1d(kind.read(mujoco_model, number))
            if value.size:
                yield ModelProperty(
                    kind.kind, _owner_name(mujoco_model, kind, number), _unit_text(mujoco_model, kind, number), value
                )


def _kind_and_index(mujoco_model: mujoco.MjModel, property_key: tuple[str, str]) -> tuple[_PropertyKind, int]:
    for kind in ELEMENT_KINDS:
        if kind.kind == property_key[0]:
            for number in range(_count_of_sort(mujoco_model, kind.sort)):
                if _owner_name(mujoco_model, kind, number) == property_key[1]:
                    return kind, number
    raise KeyError(property_key)


def _count_of_sort(mujoco_model: mujoco.MjModel, object_kind: str) -> int:
    counts = {
        "joint": mujoco_model.njnt,
        "body": mujoco_model.nbody,
        "tendon": mujoco_model.ntendon,
        "actuator": mujoco_model.nu,
    }
    return {**counts, "equality": mujoco_model.neq, "model": 1}[object_kind]


def _owner_name(mujoco_model: mujoco.MjModel, property_kind: _PropertyKind, object_index: int) -> str:
    return (
        "the model" if property_kind.sort == "model" else object_label(mujoco_model, property_kind.sort, object_index)
    )


def _unit_text(mujoco_model: mujoco.MjModel, property_kind: _PropertyKind, object_index: int) -> str:
    """Unit of a property; of two units, that of translation for slides and free joints, else that of rotation."""
    turning, _, shifting = property_kind.unit.partition(" | ")
    slides = property_kind.sort == "joint" and mujoco_model.jnt_type[object_index] in (SLIDE_JOINT, FREE_JOINT)
    return shifting if shifting and slides else turning


def _body_accessors(field_name: str) -> tuple[Callable, Callable]:
    return _number_accessors(field_name, lambda model, b: b)


def _number_accessors(field_name: str, index_of: Callable[[mujoco.MjModel, int], object]) -> tuple[Callable, Callable]:
    """Reader and writer of a field of a compiled model, at the index that ``index_of`` returns."""

    def write(mujoco_model: mujoco.MjModel, object_index: int, new_value: np.ndarray) -> None:
        numbers = getattr(mujoco_model, field_name)
        numbers[index_of(mujoco_model, object_index)] = np.reshape(
            new_value, np.shape(numbers[index_of(mujoco_model, object_index)])
        )

    return lambda model, number: np.ravel(getattr(model, field_name)[index_of(model, number)]).copy(), write


def _joint_accessors(field_name: str) -> tuple[Callable, Callable]:
    return _number_accessors(field_name, lambda model, j: j)


def _freedom_accessors(field_name: str) -> tuple[Callable, Callable]:
    """Reader and writer of a field's numbers for all degrees of freedom of a joint: 6, 3 or 1."""

    def places(mujoco_model: mujoco.MjModel, joint: int) -> slice:
        first = int(mujoco_model.jnt_dofadr[joint])
        return slice(first, first + {FREE_JOINT: 6, BALL_JOINT: 3}.get(int(mujoco_model.jnt_type[joint]), 1))

    return _number_accessors(field_name, places)


def _read_spring_reference(mujoco_model: mujoco.MjModel, joint: int) -> np.ndarray:
    """Rest position of a joint's spring relative to the design position; empty if there is no spring."""
    at = int(mujoco_model.jnt_qposadr[joint])
    several = int(mujoco_model.jnt_type[joint]) in (BALL_JOINT, FREE_JOINT)
    return (
        np.zeros(0)
        if several or not mujoco_model.jnt_stiffness[joint]
        else mujoco_model.qpos_spring[at : at + 1] - mujoco_model.qpos0[at]
    )


def _write_spring_reference(mujoco_model: mujoco.MjModel, joint: int, new_value: np.ndarray) -> None:
    at = int(mujoco_model.jnt_qposadr[joint])
    if new_value.size:
        mujoco_model.qpos_spring[at] = mujoco_model.qpos0[at] + new_value[0]


def _read_joint_zero(mujoco_model: mujoco.MjModel, joint: int) -> np.ndarray:
    """The joint coordinate that the file assigns to the design position of a hinge or slide."""
    at = int(mujoco_model.jnt_qposadr[joint])
    return (
        np.zeros(0)
        if int(mujoco_model.jnt_type[joint]) in (BALL_JOINT, FREE_JOINT)
        else mujoco_model.qpos0[at : at + 1].copy()
    )


def _write_joint_zero(mujoco_model: mujoco.MjModel, joint: int, new_value: np.ndarray) -> None:
    at = int(mujoco_model.jnt_qposadr[joint])
    mujoco_model.qpos_spring[at] += new_value[0] - mujoco_model.qpos0[at]
    mujoco_model.qpos0[at] = new_value[0]


def _read_axis(mujoco_model: mujoco.MjModel, joint: int) -> np.ndarray:
    return (
        np.zeros(0)
        if int(mujoco_model.jnt_type[joint]) in (BALL_JOINT, FREE_JOINT)
        else mujoco_model.jnt_axis[joint].copy()
    )


def _read_inertia(mujoco_model: mujoco.MjModel, body: int) -> np.ndarray:
    """The six components xx, yy, zz, xy, xz, yz (kg m^2) of a body's inertia tensor in the body's axes."""
    numbers = np.empty(9)
    mujoco.mju_quat2Mat(numbers, mujoco_model.body_iquat[body])
    axes = numbers.reshape(3, 3)
    tensor = axes * mujoco_model.body_inertia[body] @ axes.T
    return np.array([*tensor.diagonal(), tensor[0, 1], tensor[0, 2], tensor[1, 2]])


def tensor_of(six_components: np.ndarray) -> np.ndarray:
    """Inertia tensor (3, 3) from its six components xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = six_components
    return np.array(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))


def _write_inertia(mujoco_model: mujoco.MjModel, body: int, new_value: np.ndarray) -> None:
    moments, axes = np.linalg.eigh(tensor_of(new_value))
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    mujoco_model.body_inertia[body] = moments
    mujoco.mju_mat2Quat(mujoco_model.body_iquat[body], np.ascontiguousarray(axes).ravel())


def _read_gravity(mujoco_model: mujoco.MjModel, _: int) -> np.ndarray:
    return np.zeros(3) if feature_is_disabled(mujoco_model, "GRAVITY") else np.array(mujoco_model.opt.gravity)


def _write_gravity(mujoco_model: mujoco.MjModel, _: int, new_value: np.ndarray) -> None:
    mujoco_model.opt.gravity[:] = new_value
    mujoco_model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)


def _read_gear(mujoco_model: mujoco.MjModel, actuator: int) -> np.ndarray:
    """Factors that multiply an actuator's force: six numbers on a site, one elsewhere."""
    return mujoco_model.actuator_gear[actuator, : 6 if pushes_site(mujoco_model, actuator) else 1].copy()


def _write_gear(mujoco_model: mujoco.MjModel, actuator: int, new_value: np.ndarray) -> None:
    mujoco_model.actuator_gear[actuator, : new_value.size] = new_value


def _range_accessors(range_field: str, limited_field: str) -> tuple[Callable, Callable]:
    """Reader and writer of a range, given as zeros where the range is not limited."""
    read, write = _number_accessors(range_field, lambda model, i: i)

    def read_limited(mujoco_model: mujoco.MjModel, object_index: int) -> np.ndarray:
        return read(mujoco_model, object_index) * float(getattr(mujoco_model, limited_field)[object_index])

    def write_limited(mujoco_model: mujoco.MjModel, object_index: int, new_value: np.ndarray) -> None:
        getattr(mujoco_model, limited_field)[object_index] = new_value.any()
        write(mujoco_model, object_index, new_value)

    return read_limited, write_limited


def _actuator_law_accessors(numbers_field: str, kinds_field: str, first_affine_index: int) -> tuple[Callable, Callable]:
    """Reader and writer of the three numbers of an actuator's gain or bias. Numbers from index ``first_affine_index``
    on count only for an affine law."""

    def read(mujoco_model: mujoco.MjModel, actuator: int) -> np.ndarray:
        law = np.array(getattr(mujoco_model, numbers_field)[actuator, :3])
        law[first_affine_index:] *= getattr(mujoco_model, kinds_field)[actuator] == AFFINE_LAW
        return law

    def write(mujoco_model: mujoco.MjModel, actuator: int, new_value: np.ndarray) -> None:
        getattr(mujoco_model, kinds_field)[actuator] = (
            AFFINE_LAW if new_value[first_affine_index:].any() else CONSTANT_LAW
        )
        getattr(mujoco_model, numbers_field)[actuator, :3] = new_value

    return read, write


def _tendon_coefficient_accessors() -> tuple[Callable, Callable]:
    def places(mujoco_model: mujoco.MjModel, tendon: int) -> slice:
        return slice(
            int(mujoco_model.tendon_adr[tendon]), int(mujoco_model.tendon_adr[tendon] + mujoco_model.tendon_num[tendon])
        )

    return _number_accessors("wrap_prm", places)


def _read_ends(mujoco_model: mujoco.MjModel, tendon: int) -> np.ndarray:
    """Positions of both sites of a straight tendon, in the axes of their bodies."""
    return (
        mujoco_model.site_pos[sites_of(mujoco_model, tendon)].ravel() if is_line(mujoco_model, tendon) else np.zeros(0)
    )


def _write_ends(mujoco_model: mujoco.MjModel, tendon: int, new_value: np.ndarray) -> None:
    mujoco_model.site_pos[sites_of(mujoco_model, tendon)] = new_value.reshape(-1, 3)
    mujoco_model.site_sameframe[sites_of(mujoco_model, tendon)] = 0


def _read_coupling(mujoco_model: mujoco.MjModel, equality: int) -> np.ndarray:
    """Numbers of a coupling of joints: 1 if it is active, its offset and ratio; zeros if it is not."""
    return (
        np.array([1.0, *mujoco_model.eq_data[equality, :2]]) * mujoco_model.eq_active0[equality]
        if couples_joints(mujoco_model, equality)
        else np.zeros(0)
    )


def _write_coupling(mujoco_model: mujoco.MjModel, equality: int, new_value: np.ndarray) -> None:
    mujoco_model.eq_active0[equality], mujoco_model.eq_data[equality, :2] = new_value[0] != 0.0, new_value[1:]


def _read_connection(mujoco_model: mujoco.MjModel, equality: int) -> np.ndarray:
    """Numbers of a constraint between bodies: 1 if it is active, and the positions of both ends; zeros if it is not."""
    if not joins_bodies(mujoco_model, equality):
        return np.zeros(0)
    if is_between_sites(mujoco_model, equality):
        sites = [mujoco_model.eq_obj1id[equality], mujoco_model.eq_obj2id[equality]]
        ends = np.concatenate((mujoco_model.site_pos[sites].ravel(), mujoco_model.site_quat[sites].ravel()))
    else:
        ends = mujoco_model.eq_data[equality, : 6 if mujoco_model.eq_type[equality] == CONNECT_EQUALITY else 10]
    return np.array([1.0, *ends]) * mujoco_model.eq_active0[equality]


def _write_connection(mujoco_model: mujoco.MjModel, equality: int, new_value: np.ndarray) -> None:
    mujoco_model.eq_active0[equality] = new_value[0] != 0.0
    if not new_value[0]:
        return
    if is_between_sites(mujoco_model, equality):
        sites = [mujoco_model.eq_obj1id[equality], mujoco_model.eq_obj2id[equality]]
        mujoco_model.site_pos[sites], mujoco_model.site_quat[sites] = (
            new_value[1:7].reshape(2, 3),
            new_value[7:].reshape(2, 4),
        )
        mujoco_model.site_sameframe[sites] = 0
    else:
        mujoco_model.eq_data[equality, : len(new_value) - 1] = new_value[1:]


def _read_softness(mujoco_model: mujoco.MjModel, equality: int) -> np.ndarray:
    """MuJoCo's softness parameters solref and solimp of a constraint."""
    built = couples_joints(mujoco_model, equality) or joins_bodies(mujoco_model, equality)
    return (
        np.concatenate((mujoco_model.eq_solref[equality], mujoco_model.eq_solimp[equality])) if built else np.zeros(0)
    )


def _write_softness(mujoco_model: mujoco.MjModel, equality: int, new_value: np.ndarray) -> None:
    mujoco_model.eq_solref[equality], mujoco_model.eq_solimp[equality] = new_value[:2], new_value[2:]


def _read_site(mujoco_model: mujoco.MjModel, actuator: int) -> np.ndarray:
    """Position and orientation of the site on which an actuator acts, in the axes of its body."""
    site = int(mujoco_model.actuator_trnid[actuator, 0])
    return (
        np.concatenate((mujoco_model.site_pos[site], mujoco_model.site_quat[site]))
        if pushes_site(mujoco_model, actuator)
        else np.zeros(0)
    )


def _write_site(mujoco_model: mujoco.MjModel, actuator: int, new_value: np.ndarray) -> None:
    site = int(mujoco_model.actuator_trnid[actuator, 0])
    mujoco_model.site_pos[site], mujoco_model.site_quat[site], mujoco_model.site_sameframe[site] = (
        new_value[:3],
        new_value[3:],
        0,
    )


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
    _PropertyKind("joint", "zero", "rad | m", _read_joint_zero, _write_joint_zero),
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
