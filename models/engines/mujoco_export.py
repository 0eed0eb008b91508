"""A built MuJoCo model as a file that MuJoCo's viewer opens: MJCF with all digits, and shapes that one sees.

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

SPECK = 1e-14
"""kg and kg m^2 of what has none: MuJoCo's compiler asks for at least 1e-15."""
IDLE = 1e-300
"""Gain of an actuator that no control drives: with a gain and a slope of 0 a positive damping would be a ratio."""
UNSET = -1.0
"""Spring length of a tendon that MuJoCo's compiler takes for "as in the design position"."""
SHAPE_DENSITY, LEAST_HALF_WIDTH = 400.0, 0.04
"""kg/m^3 of a body's shape, and its least half width (m): large enough to be seen."""
COLOURS = ((0.0, 0.45, 0.7, 0.6), (0.84, 0.37, 0.0, 0.6), (0.0, 0.62, 0.45, 0.6), (0.8, 0.47, 0.65, 0.6))
"""Of shapes, in turn: red, green, blue, opaque."""
DIGITS = 17
"""Digits that give every double back."""


def add_shapes(spec: mujoco.MjSpec, masses: Mapping[str, float]) -> None:
    """Add to bodies of a specification a box without contact and mass, to be seen; masses (kg) by body set its size."""
    spec.visual.headlight.ambient = spec.visual.headlight.diffuse = [0.5, 0.5, 0.5]
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    for i, (name, mass) in enumerate(masses.items()):
        half = max(LEAST_HALF_WIDTH, 0.5 * (mass / SHAPE_DENSITY) ** (1 / 3))
        spec.body(name).add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[1.6 * half, 0.8 * half, 0.6 * half],
            rgba=COLOURS[i % len(COLOURS)],
            contype=0,
            conaffinity=0,
            group=1,
        )


def mjcf(spec: mujoco.MjSpec, model: mujoco.MjModel, names: Mapping[str, str], title: str, comment: str) -> str:
    """Text of a MJCF file with the structure of a specification and the numbers of the model compiled from it.

    names : what bodies and joints are called in the file, by their names in the specification; title : of the model;
    comment : for people, at its head.
    """
    _readable(model)
    spec.copy_back(model)
    spec.modelname = title
    with _all_digits():
        root = ElementTree.fromstring(spec.to_xml())
    for numbers in root.findall("custom"):  # which twinrig's callback reads
        root.remove(numbers)
    for element in root.iter():
        for key in ("name", "joint") if element.tag == "joint" else ("name",) if element.tag == "body" else ():
            if (value := element.get(key)) is not None:
                element.set(key, names.get(value, value))
    ElementTree.indent(root)
    note = comment.replace("--", "- -")
    return f"<!--\n{note}\n-->\n{ElementTree.tostring(root, encoding='unicode')}\n"


def _readable(model: mujoco.MjModel) -> None:
    """Change those numbers of a model that MuJoCo's compiler would refuse or read with another meaning."""
    model.body_mass[1:] = np.maximum(model.body_mass[1:], SPECK)
    model.body_inertia[1:] = np.maximum(model.body_inertia[1:], SPECK)
    idle = (model.actuator_gainprm[:, 0] == 0.0) & (model.actuator_biasprm[:, 1] == 0.0)
    model.actuator_gainprm[idle & (model.actuator_biasprm[:, 2] > 0.0), 0] = IDLE
    unset = model.tendon_lengthspring == UNSET
    model.tendon_lengthspring[unset] = np.nextafter(UNSET, 0.0)


@contextmanager
def _all_digits() -> Iterator[None]:
    """Within the block, let MuJoCo write files with all digits; its default is six, which no public header can
    change.
    """
    library = ctypes.CDLL(str(next(Path(mujoco.__file__).parent.glob("libmujoco.*"))))
    before = library._mjPRIVATE__get_xml_precision()
    library._mjPRIVATE__set_xml_precision(DIGITS)
    try:
        yield
    finally:
        library._mjPRIVATE__set_xml_precision(before)


def item_counts(model: mujoco.MjModel) -> Sequence[str]:
    """Texts with the numbers of bodies, joints, tendons and actuators in a MuJoCo model."""
    kinds = (("bodies", model.nbody - 1), ("joints", model.njnt), ("tendons", model.ntendon), ("actuators", model.nu))
    return [f"{count} {kind}" for kind, count in kinds if count]
