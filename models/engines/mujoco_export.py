"""Export of a built MuJoCo model as an MJCF file with all digits, and with shapes that MuJoCo's viewer shows.

The structure is the builder's specification and the numbers are those of the compiled model, into which the builders
write what MuJoCo's compiler would take for something else (masses of 0, positive damping). Of these the compiler that
reads the file later must not be reminded: bodies without mass get a speck, and a force that depends on speed alone has
a gain that nothing drives.
"""

import ctypes
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np

LEAST_MASS = 1e-14
"""Mass (kg) and inertia (kg m^2) of exported bodies that have none: MuJoCo's compiler requires at least 1e-15."""
IDLE_GAIN = 1e-300
"""Gain of an actuator that no control drives: with a gain and a slope of 0, MuJoCo's compiler would read a positive
damping as a ratio."""
UNSET_SPRING_LENGTH = -1.0
"""Spring length of a tendon that MuJoCo's compiler reads as "as in the design position"."""
SHAPE_DENSITY, LEAST_HALF_WIDTH = 400.0, 0.04
"""Density (kg/m^3) of a body's shape, and its least half width (m), so that it is large enough to be seen."""
SHAPE_COLOURS = ((0.0, 0.45, 0.7, 0.6), (0.84, 0.37, 0.0, 0.6), (0.0, 0.62, 0.45, 0.6), (0.8, 0.47, 0.65, 0.6))
"""Colours of shapes, in turn: red, green, blue and opacity, 0 to 1."""
DIGITS = 17
"""Number of digits from which every double is read back exactly."""


def add_shapes(mujoco_spec: mujoco.MjSpec, shown_masses: Mapping[str, float]) -> None:
    """Add a box without contact and mass to bodies of a specification, so that they are seen; masses (kg) by body set
    the sizes."""
    mujoco_spec.visual.headlight.ambient = mujoco_spec.visual.headlight.diffuse = [0.5, 0.5, 0.5]
    mujoco_spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    for i, (name, mass) in enumerate(shown_masses.items()):
        half = max(LEAST_HALF_WIDTH, 0.5 * (mass / SHAPE_DENSITY) ** (1 / 3))
        mujoco_spec.body(name).add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[1.6 * half, 0.8 * half, 0.6 * half],
            rgba=SHAPE_COLOURS[i % len(SHAPE_COLOURS)],
            contype=0,
            conaffinity=0,
            group=1,
        )


def mjcf(
    mujoco_spec: mujoco.MjSpec,
    mujoco_model: mujoco.MjModel,
    names_in_file: Mapping[str, str],
    model_title: str,
    head_comment: str,
) -> str:
    """Text of an MJCF file with the structure of a specification and the numbers of the model compiled from it.

    names_in_file : what bodies and joints are called in the file, by their names in the specification; model_title : of
    the model; head_comment : for people, at its head."""
    _make_readable(mujoco_model)
    mujoco_spec.copy_back(mujoco_model)
    mujoco_spec.modelname = model_title
    with _all_digits():
        root = ElementTree.fromstring(mujoco_spec.to_xml())
    for numbers in root.findall("custom"):  # which twinrig's callback reads
        root.remove(numbers)
    for element in root.iter():
        for key in ("name", "joint") if element.tag == "joint" else ("name",) if element.tag == "body" else ():
            if (value := element.get(key)) is not None:
                element.set(key, names_in_file.get(value, value))
    ElementTree.indent(root)
    note = head_comment.replace("--", "- -")
    return f"<!--\n{note}\n-->\n{ElementTree.tostring(root, encoding='unicode')}\n"


def _make_readable(mujoco_model: mujoco.MjModel) -> None:
    """Change the numbers of a model that MuJoCo's compiler would refuse or read with another meaning."""
    mujoco_model.body_mass[1:] = np.maximum(mujoco_model.body_mass[1:], LEAST_MASS)
    mujoco_model.body_inertia[1:] = np.maximum(mujoco_model.body_inertia[1:], LEAST_MASS)
    idle = (mujoco_model.actuator_gainprm[:, 0] == 0.0) & (mujoco_model.actuator_biasprm[:, 1] == 0.0)
    mujoco_model.actuator_gainprm[idle & (mujoco_model.actuator_biasprm[:, 2] > 0.0), 0] = IDLE_GAIN
    unset = mujoco_model.tendon_lengthspring == UNSET_SPRING_LENGTH
    mujoco_model.tendon_lengthspring[unset] = np.nextafter(UNSET_SPRING_LENGTH, 0.0)


@contextmanager
def _all_digits() -> Iterator[None]:
    """Context in which MuJoCo writes files with all digits; its default is six, which no public header can change."""
    library = ctypes.CDLL(str(next(Path(mujoco.__file__).parent.glob("libmujoco.*"))))
    before = library._mjPRIVATE__get_xml_precision()
    library._mjPRIVATE__set_xml_precision(DIGITS)
    try:
        yield
    finally:
        library._mjPRIVATE__set_xml_precision(before)


def item_counts(mujoco_model: mujoco.MjModel) -> Sequence[str]:
    """Texts with the numbers of bodies, joints, tendons and actuators in a MuJoCo model."""
    kinds = (
        ("bodies", mujoco_model.nbody - 1),
        ("joints", mujoco_model.njnt),
        ("tendons", mujoco_model.ntendon),
        ("actuators", mujoco_model.nu),
    )
    return [f"{count} {kind}" for kind, count in kinds if count]
