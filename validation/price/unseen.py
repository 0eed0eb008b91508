"""Random pitch-plane scenes for ``twinrig price``, and verdicts on the settings that it recommends for them.

The verdict's truth is of another kind than the search's: scipy's DOP853 at a tolerance of 1e-11, restarted wherever
the input has a kink, on the instants of the setting that was recommended.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from models.advice.price import PricedRun
from models.advice.price.problem import Setting
from models.advice.price.recommendation import (
    SHORTEST_TURN,
    SLOWER_SECONDS_RATIO,
    Recommendation,
    SettingChoice,
    priced_scene,
    recommend,
)
from models.advice.price.search import TriedSetting
from models.advice.price.systems.pitch_plane import PricedPitchPlane
from models.advice.price.truth import ReferenceSolution
from models.core.time_series import write_time_series
from models.engines.assembly import Settings
from models.machine.timing import interleave, paired_ratio
from models.systems.pitch_plane.scene import Scene, build
from models.vehicles.parameters.itwm_drift import PARAMETERS

SEED = 907
ENGINES = ("reference", "exudyn", "mujoco")
TRUTH_TOLERANCE = 1e-11
COARSE_SPACING, FINE_SPACING = 5e-5, 2e-5
"""Largest row spacing (s) of the true solution, and least one at which all settings are compared at common times."""
TIMING_ROUNDS = 9, 25
"""Numbers of interleaved timing rounds of a first comparison, and of a second that must confirm it."""
LARGEST_TIMED_RATIO = 3.0
"""Ratio of seconds from which a default setting is not timed again, as times do not scatter that much."""
QUANTITY_SCALES = {
    "f1,f2": 1e3,
    "pitch": 1e-2,
    "z3": 1e-2,
    "f3,f4": 1e3,
    "suspension_moment": 1e3,
    "enforced_moment": 1e3,
}
"""Usual magnitude of a quantity in its unit, of which tolerances are fractions."""
TOLERANCE_POWERS = (-5.0, -1.5)
"""Range of the logarithm (base 10) of a tolerance divided by the quantity's usual magnitude."""
CHANGED_PARAMETERS = ("m1", "m3", "I", "k1", "k2", "k3", "k4", "d1", "d3", "d4", "a")
"""Vehicle parameters, of which four are multiplied by random factors from e^-0.5 to e^0.5."""


@dataclass(frozen=True)
class DrawnScene:
    """A random scene with the quantity and the tolerance for which a setting is to be recommended."""

    scene: Scene
    quantity: str
    tolerance: float


@dataclass(frozen=True)
class Verdict:
    """Verdict on a recommended setting. predicted, true : errors in the quantity's unit; floor : accuracy of the
    reference that the recommendation used; slower : whether the engine's default that keeps the tolerance is cheaper,
    in force calls or significantly in seconds, depending on ``kind``."""

    title: str
    curve: str
    label: str
    tolerance: float
    predicted: float
    true: float
    floor: float
    slower: bool
    kind: str = "calls"

    @property
    def keeps_tolerance(self) -> bool:
        """Whether the true error of the recommended setting is within the tolerance."""
        return self.true <= self.tolerance

    @property
    def error_ratio(self) -> float:
        """Ratio of the larger to the smaller of predicted and true error; errors below the floor are replaced by the
        floor."""
        first, larger_true = max(self.predicted, self.floor), max(self.true, self.floor)
        if first == larger_true:
            return 1.0
        return max(first, larger_true) / min(first, larger_true) if min(first, larger_true) > 0.0 else math.inf


def random_scene(scene_number: int, scene_folder: Path) -> DrawnScene:
    """The random scene with a number, which seeds it; its files are written to ``scene_folder``."""
    rng = np.random.Generator(np.random.Philox(key=[SEED, scene_number]))
    kind = SCENE_KINDS[scene_number % len(SCENE_KINDS)]
    name, effects, further_tables = kind(rng, scene_folder, scene_number)
    override = {
        key: float(np.exp(rng.uniform(-0.5, 0.5))) * getattr(PARAMETERS, key)
        for key in map(str, rng.choice(CHANGED_PARAMETERS, 4, replace=False))
    }
    table = {
        "title": f"scene {scene_number}, {name}",
        "vehicle": {"geometry": str(rng.choice(["exact", "linear"])), "override": override},
        "run": {"duration": float(further_tables.pop("duration", round(rng.uniform(0.1, 0.3), 2))), "step": 1e-3},
        "effects": effects,
        **further_tables,
    }
    quantity, common = "enforced_moment", ["pitch", "z3", "f3,f4"]
    if "prescribed_pitch" not in effects:
        quantity = str(rng.choice(common if "wheel_forces" in effects else ["f1,f2", *common]))
    return DrawnScene(
        build(table, "", scene_folder), quantity, QUANTITY_SCALES[quantity] * 10.0 ** rng.uniform(*TOLERANCE_POWERS)
    )


Random = np.random.Generator
Kind = tuple[str, dict[str, Any], dict[str, Any]]
"""Name, effects, and further tables of a random scene."""


def _random_iso_road(generator: Random, scene_folder: Path, scene_number: int) -> Kind:
    road = {
        "source": "iso8608",
        "road_class": str(generator.choice(list("ABCDE"))),
        "seed": scene_number,
        "speed": float(round(generator.uniform(5.0, 35.0), 1)),
    }
    return "rough road", {"road": road}, {}


def _random_study_road(generator: Random, scene_folder: Path, scene_number: int) -> Kind:
    source = str(generator.choice(["study", "hills"]))
    return f"{source} road", {"road": {"source": source, "speed": float(round(generator.uniform(5.0, 35.0), 1))}}, {}


def _random_release(generator: Random, scene_folder: Path, scene_number: int) -> Kind:
    start = {"z1": 2e-2, "z3": 5e-2, "pitch": 5e-2, "pitch_rate": 0.3, "z2_rate": 0.3}
    start_values = {key: float(size * generator.uniform(-1, 1)) for key, size in start.items()}
    return "release", {}, {"start": start_values, "duration": float(generator.choice([0.2, 0.4, 2.5]))}


def _random_measured_forces(generator: Random, scene_folder: Path, scene_number: int) -> Kind:
    interpolation, period = (
        str(generator.choice(["linear", "held", "smooth"])),
        float(generator.choice([1e-2, 5e-3, 2e-3])),
    )
    file = _write_wheel_forces(generator, scene_folder, scene_number, period)
    return (
        f"{interpolation} forces",
        {"wheel_forces": {"file": file, "interpolation": interpolation}},
        {"duration": 0.2},
    )


def _random_guided_vehicle(generator: Random, scene_folder: Path, scene_number: int) -> Kind:
    file, pitch = _write_wheel_forces(generator, scene_folder, scene_number, 5e-3), f"pitch{scene_number}.csv"
    sample_times = 5e-3 * np.arange(101)
    wave = generator.uniform(5e-3, 3e-2) * (1 - np.cos(2 * np.pi * generator.uniform(0.5, 3.0) * sample_times))
    write_time_series(scene_folder / pitch, {"pitch": ("rad", wave)}, 5e-3)
    effects = {"wheel_forces": {"file": file, "interpolation": "smooth"}, "prescribed_pitch": {"file": pitch}}
    return "prescribed pitch", effects, {"duration": 0.2}


SCENE_KINDS: tuple[Callable[[Random, Path, int], Kind], ...] = (
    _random_iso_road,
    _random_measured_forces,
    _random_release,
    _random_iso_road,
    _random_guided_vehicle,
    _random_study_road,
    _random_measured_forces,
    _random_iso_road,
    _random_release,
    _random_measured_forces,
)


def _write_wheel_forces(generator: Random, scene_folder: Path, scene_number: int, sample_period: float) -> str:
    """Write a random file of wheel forces: static load, a sine wave for each wheel, and noise on each sample; returns
    its name."""
    sample_times, name = sample_period * np.arange(round(0.5 / sample_period) + 1), f"forces{scene_number}.csv"
    forces = {
        wheel: (
            "N",
            3825.9
            + 500 * np.sin(2 * np.pi * generator.uniform(1, 10) * sample_times + generator.uniform(0, 6))
            + 200 * generator.standard_normal(len(sample_times)),
        )
        for wheel in ("front", "rear")
    }
    write_time_series(scene_folder / name, forces, sample_period)
    return name


def verdicts_on_pitch_plane(drawn_scene: DrawnScene, engines: tuple[str, ...] = ENGINES) -> list[Verdict]:
    """Verdicts on all settings recommended for a scene: the best of all engines, and the best of each engine."""
    return verdicts_on_scene(
        drawn_scene, engines, lambda recommendation, settings: true_errors(recommendation.scene, settings)
    )


def verdicts_on_scene(
    drawn_scene: DrawnScene,
    engines: tuple[str, ...],
    compute_true_errors: Callable[[Recommendation, list[Setting]], dict[Setting, float]],
) -> list[Verdict]:
    """Verdicts on the settings recommended for a scene; the function ``compute_true_errors`` returns the true error of
    each recommended setting."""
    recommendation = recommend(priced_scene(drawn_scene.scene, drawn_scene.quantity, engines), drawn_scene.tolerance)
    errors = compute_true_errors(
        recommendation, list(dict.fromkeys(choice.tried.setting for choice in recommendation.winners.values()))
    )
    return [
        Verdict(
            drawn_scene.scene.title,
            choice.tried.setting.curve,
            choice.tried.setting.label(),
            drawn_scene.tolerance,
            choice.error,
            errors[choice.tried.setting],
            recommendation.truth.uncertainty,
            default_is_cheaper(recommendation, key, choice),
            key[1],
        )
        for key, choice in recommendation.winners.items()
    ]


def true_errors(pitch_plane_scene: Any, tried_settings: list[Setting]) -> dict[Setting, float]:
    """Largest error of each setting over the complete run, against DOP853. All settings are compared at common times
    if their steps allow it."""
    runs = {
        setting: pitch_plane_scene.priced_run(pitch_plane_scene.solve(setting, pitch_plane_scene.full_duration))
        for setting in tried_settings
    }
    parts = {setting: 1 if setting.adaptive else round(pitch_plane_scene.base_step / setting.value) for setting in runs}
    common = _fine_multiple(pitch_plane_scene, math.lcm(*parts.values()))
    if pitch_plane_scene.base_step / common < FINE_SPACING:
        parts = {setting: _fine_multiple(pitch_plane_scene, n) for setting, n in parts.items()}
    else:
        parts = dict.fromkeys(runs, common)
    exact = {
        n: ReferenceSolution(
            _accurate_solution(pitch_plane_scene, pitch_plane_scene.base_step / n),
            0.0,
            "",
            0,
            pitch_plane_scene.kink_period,
        )
        for n in set(parts.values())
    }
    return {setting: exact[parts[setting]].error(run) for setting, run in runs.items()}


def _fine_multiple(pitch_plane_scene: PricedPitchPlane, part_count: int) -> int:
    """Least multiple of ``part_count`` that divides ``scene.base_step`` (s) into parts of COARSE_SPACING (s) at
    most.
    """
    return part_count * math.ceil(pitch_plane_scene.base_step / part_count / COARSE_SPACING * (1 - 1e-9))


def _accurate_solution(pitch_plane_scene: PricedPitchPlane, time_spacing: float) -> PricedRun:
    return pitch_plane_scene.priced_run(
        pitch_plane_scene.run(
            "reference", Settings("DOP853", time_spacing, pitch_plane_scene.full_duration, TRUTH_TOLERANCE)
        )
    )


def default_is_cheaper(
    recommendation: Recommendation, engine_and_kind: tuple[str, str], setting_choice: SettingChoice
) -> bool:
    """Whether an engine's default setting keeps the tolerance and is cheaper than the recommended setting."""
    engine, kind = engine_and_kind
    rivals = [attempt for attempt in _coarsest_defaults(recommendation) if attempt.setting.engine.startswith(engine)]
    if kind == "calls":
        return any(rival.calls < setting_choice.calls for rival in rivals)
    return any(_is_slower_in_pairs(recommendation, setting_choice, rival) for rival in rivals)


def _coarsest_defaults(recommendation: Recommendation) -> list[TriedSetting]:
    """The coarsest setting of each default method that keeps the tolerance. If the complete run was searched, all tried
    settings count, as the recommendation may have missed one."""
    if not recommendation.searched_whole_run:
        return [
            tried.refined.tried
            for tried in recommendation.defaults.values()
            if tried.refined is not None and not tried.extrapolated
        ]
    error_bound = recommendation.tolerance - recommendation.search_truth.uncertainty
    able = sorted(
        (tried for tried in recommendation.tried if tried.setting.default and tried.error <= error_bound),
        key=lambda tried: tried.setting.value,
    )
    return list({tried.setting.curve: tried for tried in able}.values())


def _is_slower_in_pairs(
    recommendation: Recommendation, setting_choice: SettingChoice, rival_setting: TriedSetting
) -> bool:
    if (
        rival_setting.setting == setting_choice.tried.setting
        or rival_setting.seconds > LARGEST_TIMED_RATIO * setting_choice.seconds
    ):
        return False
    jobs = [
        partial(recommendation.scene.solve, attempt.setting, recommendation.scene.searched_duration)
        for attempt in (setting_choice.tried, rival_setting)
    ]
    return all(
        paired_ratio(*interleave(jobs, rounds, SHORTEST_TURN, clock=time.process_time))[1] > SLOWER_SECONDS_RATIO
        for rounds in TIMING_ROUNDS
    )
