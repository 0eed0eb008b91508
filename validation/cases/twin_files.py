"""Models in MJCF and URDF: every build beside the file as MuJoCo parsed it, and planted differences of two files."""

from importlib import import_module
from pathlib import Path

from models.core.systems import SYSTEMS, load
from models.own_model.builds import SOFT_BUILD
from models.own_model.certificate import EQUAL_ACCELERATION_SHARE as SAME
from models.own_model.certificate import (
    Agreement,
    agreement_of_build,
    certificate,
    comparison_states,
    motion_at,
    reference_of_file,
)
from models.own_model.content import CONTENT_KINDS
from models.own_model.explain import compare
from models.own_model.file import ModelFile, read
from models.own_model.path import EQUAL_PATH_SHARE, compare_paths
from validation.common.rows import CaseAnswer, Observed, Row, System
from validation.own_model.files import (
    ARM_URDF,
    CART,
    GEARED,
    HELD,
    JOINTED,
    LINKED,
    PLANTED,
    TIED,
    chain,
    changed,
    tree,
)
from validation.own_model.soft_couplings import softly_coupled

TITLE = "A user's own model: MJCF and URDF in every build"
SYSTEM: System = "rolling-vehicle"
STATES, QUICK_STATES = 100, 5
SOLVED = 1e-8
SCENES = Path(__file__).parents[2] / "studies" / "scenes"
EXPORTED = ("ride", "ride_nonlinear", "handling", "hub_forces", "wheelset", "study_road", "ride_drive", "motion")
"""Scenes whose vehicle is written as MJCF by ``twinrig export`` and read again."""
OUTSIDE = tuple(kind for kind in CONTENT_KINDS if kind not in ("flex", "turning_law"))
"""Content that is left out of exported vehicles: springs along axes of bodies are actuators at sites there."""


def measure(quick: bool, folder: Path) -> CaseAnswer:
    """Quick: seven models, five states, six planted differences; in full 24 models, eight of them exported, all 30."""
    texts = {"jointed": JOINTED, "cart": CART, "arm": ARM_URDF, "tied": TIED, "geared": GEARED}
    texts |= {"linked": LINKED, "held": HELD}
    if not quick:
        texts |= {f"chain_{count}": chain(count) for count in (8, 30)}
        texts |= {f"tree_{seed}": tree(4 + 2 * seed, seed) for seed in range(1, 8)}
    rows = [_agreement(name, _read(folder, name, text), quick) for name, text in texts.items()]
    rows += [] if quick else [_agreement(name, _exported(folder, name), quick) for name in EXPORTED]
    return [
        *rows,
        _soft(folder, "geared", GEARED),
        _soft(folder, "linked", LINKED),
        *_path(folder),
        _planted(folder, quick),
    ], {}


def _read(folder: Path, name: str, text: str, without: tuple[str, ...] = ()) -> ModelFile:
    path = folder / f"{name}{'.urdf' if '<robot' in text else '.xml'}"
    path.write_text(text, encoding="utf-8")
    return read(path, without)


def _exported(folder: Path, name: str) -> ModelFile:
    scene = load(SCENES / f"{name}.toml")
    answer = import_module(f"{SYSTEMS[scene.system].package}.export").exported(scene, "mujoco")
    return _read(folder, f"exported_{name}", answer.text, OUTSIDE)


def _agreement(name: str, file: ModelFile, quick: bool) -> Row:
    """Row: largest difference of accelerations from the model file, over all builds."""
    agreements = certificate(file.twin, QUICK_STATES if quick else STATES)
    worst: Agreement = max(agreements, key=lambda agreement: agreement.acceleration)
    return Observed(
        f"twin_files.{name}",
        SYSTEM,
        f"largest difference of accelerations in Exudyn, MuJoCo and plain equations from the file as MuJoCo parsed it, "
        f"{file.twin.size} coordinates, {name}",
        worst.acceleration,
        "of its size",
    ).at_most(SAME, "what counts as alike; an acceleration near 0 is counted by what rounding may make of it", "native")


def _soft(folder: Path, name: str, text: str) -> Row:
    """Row: accelerations with MuJoCo's soft constraints, compared with the law in MuJoCo's documentation applied to the
    plain equations."""
    twin = _read(folder, name, text).twin
    states = comparison_states(twin, QUICK_STATES)
    apart = agreement_of_build("", reference_of_file(twin, states, SOFT_BUILD), motion_at(softly_coupled(twin), states))
    return Observed(
        f"twin_files.soft_{name}",
        SYSTEM,
        "largest difference of accelerations with soft constraints in MuJoCo from the law of its documentation about "
        f"the plain equations, at states that satisfy them, {name}",
        apart.acceleration,
        "of the largest",
    ).at_most(SOLVED, "what MuJoCo's constraint solver leaves, whose tolerance is 1e-8", "closed form")


def _path(folder: Path) -> list[Row]:
    """Rows: paths of the cart over 1 s, and its balance of energy and work."""
    report = compare_paths(_read(folder, "cart", CART).twin)
    return [
        Observed(
            "twin_files.path",
            SYSTEM,
            "largest difference of the states of all builds over 1 s, same tableau and step, cart",
            max(report.distances.values()),
            "of the largest",
        ).at_most(EQUAL_PATH_SHARE, "rounding; a disturbance of 1e-14 stays below it", "native"),
        Observed(
            "twin_files.energy",
            SYSTEM,
            "kinetic energy less the work of all forces over 1 s, cart",
            report.energy if report.energy is not None else float("nan"),
            "of the largest",
        ).at_most(1e-9, "error of Runge-Kutta 4 and of Simpson's rule at steps of 2 ms", "closed form"),
    ]


def _planted(folder: Path, quick: bool) -> Row:
    """Row: number of planted differences that the comparison names first, with their right size."""
    first, named = _read(folder, "original", JOINTED).twin, 0
    chosen = PLANTED[::5] if quick else PLANTED
    for name, old, new, kind, owner, size in chosen:
        second = _read(folder, "planted", changed(JOINTED, name, old, new)).twin
        influential = compare(first, second, 3).influential
        sentence = influential[0].sentence(("original", "planted")) if influential else ""
        named += sentence.startswith(f"{kind} of {owner}: ") and size.replace("b.xml", "planted") in sentence
    quantity = f"planted differences of one number, of {len(chosen)}, whose element and size are named first"
    why = "all of them change accelerations"
    return Observed("twin_files.planted", SYSTEM, quantity, named, "differences").within(len(chosen), 0, why, "none")
