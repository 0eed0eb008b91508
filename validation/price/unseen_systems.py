"""Random scenes of a wheelset, of handling and of braking for ``twinrig price``, and verdicts on its recommendations.

The verdict's truth has four times the cells that were recommended, or more, and steps of DOP853's own. A stop with
valves in the loop has one method alone: its truth has thrice the steps of the search's.
"""

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from models.advice.price import PricedRun
from models.advice.price.meshed import MeshedScene
from models.advice.price.problem import Setting
from models.advice.price.recommendation import Recommendation
from models.advice.price.truth import ReferenceSolution
from models.core.systems import SYSTEMS
from validation.price.unseen import DrawnScene, Random, Verdict, verdicts_on_scene

SEED = 908
ENGINES = {"wheelset": ("reference", "mujoco"), "handling": ("mujoco",), "braking": ("reference",)}
"""Engines for which settings are recommended, by system."""
TRUTH_CELLS_RATIO, FEWEST_CELLS, MOST_CELLS = 4, 60, 200
"""Ratio of the true solution's cells to the recommended number, and the fewest and most cells of its contacts."""
TRUTH_STEPS_RATIO = 3
"""Ratio of the number of steps of the true solution to that of the recommendation's reference."""
TOLERANCE_RANGES = {
    "y": (1e-6, 1e-4),
    "fy": (20.0, 500.0),
    "yaw_rate": (1e-4, 3e-3),
    "load": (1.0, 50.0),
    "stopping_distance": (1e-5, 0.05),
    "yaw": (1e-4, 1e-2),
}


TablesAndQuantities = tuple[dict[str, Any], list[str]]
"""Tables of a random scene, and the quantities that a tolerance may be set on."""


def drawn_scene_of_system(system_name: str, scene_number: int) -> DrawnScene:
    """The random scene of a system with a number, which seeds it, with a quantity and a tolerance."""
    rng = np.random.Generator(np.random.Philox(key=[SEED, scene_number]))
    table, quantities = {"wheelset": _random_wheelset, "handling": _random_handling, "braking": _random_braking}[
        system_name
    ](rng)
    table |= {"title": f"{system_name} {scene_number}", "system": system_name}
    quantity = str(rng.choice(quantities))
    low, high = np.log(TOLERANCE_RANGES[quantity])
    scene = import_module(SYSTEMS[system_name].scene).build(table, "", Path())
    return DrawnScene(scene, quantity, float(np.exp(rng.uniform(low, high))))


def _random_wheelset(generator: Random) -> TablesAndQuantities:
    override = {
        "conicity": float(generator.uniform(0.02, 0.2)),
        "stiffness_x": float(generator.uniform(1e5, 1e6)),
        "friction": float(generator.uniform(0.1, 0.5)),
    }
    run = {
        "duration": 0.1,
        "step": 5e-4,
        "displacement": float(generator.uniform(1e-3, 5e-3)),
        "speeds": [float(round(generator.uniform(10.0, 60.0), 1))],
    }
    law = str(generator.choice(["fastsim", "fastsim", "linear"]))
    speeds = {"values": [10.0]}
    return {"wheelset": {"override": override}, "contact": {"law": law}, "run": run, "speeds": speeds}, ["y", "fy"]


def _random_handling(generator: Random) -> TablesAndQuantities:
    manoeuvre = {
        "speed": float(generator.uniform(12.0, 30.0)),
        "duration": 0.5,
        "rough": bool(generator.integers(2)),
        "steer": [[0.05, 0.0], [float(generator.uniform(0.2, 0.4)), float(generator.uniform(-0.06, 0.06))]],
    }
    tyres = {"friction": float(generator.uniform(0.4, 1.0))}
    return {"tyres": tyres, "manoeuvres": {"drawn": manoeuvre}}, ["yaw_rate", "load"]


def _random_braking(generator: Random) -> TablesAndQuantities:
    kind, surface = (
        str(generator.choice(["straight", "j_turn", "split"])),
        str(generator.choice(["snow", "wet", "ice"])),
    )
    procedure: dict[str, Any] = {"kind": kind, "speed": float(generator.uniform(4.0, 9.0))}
    if kind == "j_turn":
        procedure["steer"] = float(generator.uniform(0.01, 0.05))
    if kind == "split":
        procedure["right"] = "ice"
    controller = {"kind": str(generator.choice(["none", "slip_bang_bang", "slip_pi"]))}
    quantities = ["stopping_distance"] if kind == "straight" else ["stopping_distance", "yaw"]
    return {
        "controller": controller,
        "pressure": {},
        "load_transfer": {},
        "procedures": {"drawn": procedure},
        "road": {"stretches": [{"left": surface}]},
    }, quantities


def verdicts_on_system(drawn_scene: DrawnScene) -> list[Verdict]:
    """Verdicts on all settings recommended for a scene."""
    return verdicts_on_scene(drawn_scene, ENGINES[drawn_scene.scene.system], true_errors)


def true_errors(recommendation: Recommendation, tried_settings: list[Setting]) -> dict[Setting, float]:
    """Largest error of each setting over the complete run, against a solution that is computed differently from the
    recommendation's reference."""
    scene: Any = recommendation.scene
    ladder = scene.reference_ladder()
    finer = Setting(
        ladder.engine, ladder.method, ladder.values[recommendation.truth.rung] / TRUTH_STEPS_RATIO, ladder.order
    )

    def error(tried_setting: Setting) -> float:
        exact = (
            _accurate_solution(scene, tried_setting)
            if isinstance(scene, MeshedScene)
            else scene.priced_run(scene.solve(finer, scene.full_duration))
        )
        return ReferenceSolution(exact, 0.0, "", 0).error(
            scene.priced_run(scene.solve(tried_setting, scene.full_duration))
        )

    return {setting: error(setting) for setting in tried_settings}


def _accurate_solution(meshed_scene: MeshedScene, tried_setting: Setting) -> PricedRun:
    cells = (
        min(MOST_CELLS, max(FEWEST_CELLS, TRUTH_CELLS_RATIO * round(1.0 / tried_setting.value)))
        if meshed_scene.cells
        else 0
    )
    step = min(meshed_scene.steps.values()) if meshed_scene.cells else tried_setting.value
    return meshed_scene.priced_run((cells, meshed_scene.exact_run(cells, step, meshed_scene.full_duration)))
