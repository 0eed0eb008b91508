"""Models in MJCF and URDF: the models of all engines compared with the file as MuJoCo parsed it, and planted
differences of two files."""

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
from models.own_model.explain import compare_models
from models.own_model.file import ModelFile, read_model_file
from models.own_model.path import EQUAL_PATH_SHARE, compare_paths
from validation.common.rows import CaseAnswer, Observed, Row, System
from validation.own_model.files import (
    ARM_URDF,
    BOX_WELDED_TO_CRANK,
    CART,
    GEARED,
    JOINTED,
    LINKED,
    PLANTED_DIFFERENCES,
    TIED,
    model_with_change,
    random_chain,
    random_tree,
)
from validation.own_model.soft_couplings import soft_constraint_equations

TITLE = "A user's own model: MJCF and URDF in every build"
SYSTEM: System = "rolling-vehicle"
STATE_COUNT, QUICK_STATE_COUNT = 100, 5
SOLVER_TOLERANCE = 1e-8
SCENE_FOLDER = Path(__file__).parents[2] / "studies" / "scenes"
EXPORTED_SCENES = ("ride", "ride_nonlinear", "handling", "hub_forces", "wheelset", "study_road", "ride_drive", "motion")
"""Scenes whose vehicle is written as MJCF by ``twinrig export`` and read again."""
IGNORED_CONTENT = tuple(kind for kind in CONTENT_KINDS if kind not in ("flex", "turning_law"))
"""Content that is ignored in exported vehicles: there, springs along axes of bodies are actuators at sites."""


def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows of 24 models, eight of them exported, and of 30 planted differences; a quick run has seven models, five
    states and six planted differences."""
    texts = {"jointed": JOINTED, "cart": CART, "arm": ARM_URDF, "tied": TIED, "geared": GEARED}
    texts |= {"linked": LINKED, "held": BOX_WELDED_TO_CRANK}
    if not quick:
        texts |= {f"chain_{count}": random_chain(count) for count in (8, 30)}
        texts |= {f"tree_{seed}": random_tree(4 + 2 * seed, seed) for seed in range(1, 8)}
    rows = [_agreement_row(name, _model_file_of_text(work_folder, name, text), quick) for name, text in texts.items()]
    rows += (
        []
        if quick
        else [_agreement_row(name, _model_file_of_exported_scene(work_folder, name), quick) for name in EXPORTED_SCENES]
    )
    return [
        *rows,
        _soft_constraint_row(work_folder, "geared", GEARED),
        _soft_constraint_row(work_folder, "linked", LINKED),
        *_simulated_cart_rows(work_folder),
        _planted_differences_row(work_folder, quick),
    ], {}


def _model_file_of_text(
    work_folder: Path, model_name: str, model_text: str, ignored_content: tuple[str, ...] = ()
) -> ModelFile:
    """Write the text of a model to an MJCF or URDF file, and read the file."""
    path = work_folder / f"{model_name}{'.urdf' if '<robot' in model_text else '.xml'}"
    path.write_text(model_text, encoding="utf-8")
    return read_model_file(path, ignored_content)


def _model_file_of_exported_scene(work_folder: Path, scene_name: str) -> ModelFile:
    """Export the vehicle of a scene as MJCF, and read the file."""
    scene = load(SCENE_FOLDER / f"{scene_name}.toml")
    answer = import_module(f"{SYSTEMS[scene.system].package}.export").exported(scene, "mujoco")
    return _model_file_of_text(work_folder, f"exported_{scene_name}", answer.text, IGNORED_CONTENT)


def _agreement_row(model_name: str, model_file: ModelFile, quick: bool) -> Row:
    """Row: largest difference of accelerations from the model file, over the models of all engines."""
    agreements = certificate(model_file.twin, QUICK_STATE_COUNT if quick else STATE_COUNT)
    worst: Agreement = max(agreements, key=lambda agreement: agreement.acceleration)
    return Observed(
        f"twin_files.{model_name}",
        SYSTEM,
        f"largest difference of accelerations in Exudyn, MuJoCo and plain equations from the file as MuJoCo parsed it, "
        f"{model_file.twin.size} coordinates, {model_name}",
        worst.acceleration,
        "of its size",
    ).at_most(SAME, "what counts as alike; an acceleration near 0 is counted by what rounding may make of it", "native")


def _soft_constraint_row(work_folder: Path, model_name: str, model_text: str) -> Row:
    """Row: accelerations with MuJoCo's soft constraints, compared with the law of MuJoCo's documentation in
    independently written equations."""
    twin = _model_file_of_text(work_folder, model_name, model_text).twin
    states = comparison_states(twin, QUICK_STATE_COUNT)
    apart = agreement_of_build(
        "", reference_of_file(twin, states, SOFT_BUILD), motion_at(soft_constraint_equations(twin), states)
    )
    return Observed(
        f"twin_files.soft_{model_name}",
        SYSTEM,
        "largest difference of accelerations with soft constraints in MuJoCo from the law of its documentation about "
        f"the plain equations, at states that satisfy them, {model_name}",
        apart.acceleration,
        "of the largest",
    ).at_most(SOLVER_TOLERANCE, "what MuJoCo's constraint solver leaves, whose tolerance is 1e-8", "closed form")


def _simulated_cart_rows(work_folder: Path) -> list[Row]:
    """Rows: largest difference between the states of all engines' models over 1 s, and balance of energy and work, of
    the cart model."""
    report = compare_paths(_model_file_of_text(work_folder, "cart", CART).twin)
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


def _planted_differences_row(work_folder: Path, quick: bool) -> Row:
    """Row: number of planted differences that the comparison names first, with their right size."""
    first, named = _model_file_of_text(work_folder, "original", JOINTED).twin, 0
    chosen = PLANTED_DIFFERENCES[::5] if quick else PLANTED_DIFFERENCES
    for name, old, new, kind, owner, size in chosen:
        second = _model_file_of_text(work_folder, "planted", model_with_change(JOINTED, name, old, new)).twin
        influential = compare_models(first, second, 3).influential
        sentence = influential[0].sentence(("original", "planted")) if influential else ""
        named += sentence.startswith(f"{kind} of {owner}: ") and size.replace("b.xml", "planted") in sentence
    quantity = f"planted differences of one number, of {len(chosen)}, whose element and size are named first"
    why = "all of them change accelerations"
    return Observed("twin_files.planted", SYSTEM, quantity, named, "differences").within(len(chosen), 0, why, "none")
