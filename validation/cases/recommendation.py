"""Recommended settings on scenes that the recommendation has not used before: do the settings keep the tolerance at the
promised cost?"""

import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from models.core.errors import InputError, RunFailed
from validation.common.grounds import allowing_breaches
from validation.common.rows import CaseAnswer, Drawn, Observed, Row, Saved, System, Table
from validation.price import unseen_systems
from validation.price.unseen import ENGINES, Verdict, random_scene, verdicts_on_pitch_plane

SceneVerdicts = tuple[list[Verdict], list[str]]

TITLE = "What to recommend"
SYSTEM: System = "cost"
QUICK_SCENE_NUMBER = 8
"""Number of the only scene of a quick run."""
SCENE_COUNTS_BY_SYSTEM = {"pitch-plane": 88, "braking": 6, "wheelset": 4, "handling": 2}
"""Number of scenes of each system in a full run."""
REDRAW_COUNT = 3
"""A refused scene is replaced by another random one at most so many times; then it counts as one whose tolerance is
missed."""
QUICK_ENGINE = "mujoco"
"""Engine of a quick run; a full run has all engines."""
REDRAW_STRIDE = 1000
"""Difference between the number of a scene and of the scene that replaces it."""
LEAST_KEPT_TOLERANCE_SHARE, LARGEST_ERROR_FACTOR = 0.95, 3.0
"""Least share of scenes whose every recommended setting keeps its tolerance; and bound of the factor between predicted
and true error."""


@allowing_breaches(
    "random scenes: whether settings hold their tolerance is judged, beside a truth that breaks the same"
)
def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows on all recommendations for all scenes; a quick run has those of one engine for one scene."""
    both = (
        [verdicts_on_scene("pitch-plane", QUICK_SCENE_NUMBER, work_folder, (QUICK_ENGINE,))]
        if quick
        else _verdicts_in_processes(work_folder)
    )
    verdicts, refused = [of_scene for of_scene, _ in both], [why for _, of_scene in both for why in of_scene]
    return _promise_rows(verdicts, refused), {
        "verdicts": [[asdict(verdict) for verdict in of_scene] for of_scene in verdicts],
        "refused": refused,
    }


def _verdicts_in_processes(work_folder: Path) -> list[SceneVerdicts]:
    """Verdicts on the recommendations for all scenes, computed by at most two processes, the long computations
    first."""
    context = get_context("spawn")  # an engine's threads do not survive a fork
    with ProcessPoolExecutor(min(2, os.cpu_count() or 1), mp_context=context) as pool:
        return [
            job.result()
            for job in [
                pool.submit(verdicts_on_scene, system, n, work_folder)
                for system in reversed(SCENE_COUNTS_BY_SYSTEM)
                for n in range(SCENE_COUNTS_BY_SYSTEM[system])
            ]
        ]


def verdicts_on_scene(
    system_name: str, scene_number: int, work_folder: Path, engine_names: tuple[str, ...] = ENGINES
) -> SceneVerdicts:
    """Verdicts on the recommendations for a random scene of a system, and the reasons of refusals. There are no
    verdicts if the scene was refused more than REDRAW_COUNT times."""
    refused: list[str] = []
    for n in range(scene_number, scene_number + (REDRAW_COUNT + 1) * REDRAW_STRIDE, REDRAW_STRIDE):
        try:
            reasons = (
                verdicts_on_pitch_plane(random_scene(n, work_folder), engine_names)
                if system_name == "pitch-plane"
                else unseen_systems.verdicts_on_system(unseen_systems.drawn_scene_of_system(system_name, n))
            )
        except (InputError, RunFailed) as error:
            refused.append(f"{system_name} {n}: {error}")
        else:
            return reasons, refused
    return [], refused


def _promise_rows(verdicts: list[list[Verdict]], refusal_reasons: list[str]) -> list[Row]:
    """Rows on the promises of a recommendation: tolerance, predicted error, and cost. A scene counts as met if every
    recommended setting keeps the scene's tolerance."""
    every = [verdict for of_scene in verdicts for verdict in of_scene]
    kept_scenes = sum(bool(of_scene) and all(verdict.keeps_tolerance for verdict in of_scene) for of_scene in verdicts)
    factors = [verdict.error_ratio for verdict in every]
    scenes, why = f"{len(verdicts)} scenes drawn at random", "judged by another solver than the search's, DOP853"
    return [
        Observed(
            "recommendation.met",
            SYSTEM,
            f"share of {scenes} in which every recommended setting keeps its tolerance ({len(every)} settings)",
            kept_scenes / len(verdicts),
            "",
        ).within(1.0, 1.0 - LEAST_KEPT_TOLERANCE_SHARE, why, "closed form"),
        Observed(
            "recommendation.predicted",
            SYSTEM,
            "largest factor between the predicted and the true error",
            max(factors, default=float("inf")),
            "times",
        ).at_most(LARGEST_ERROR_FACTOR, f"{why}; errors below what is known of the truth count as that", "closed form"),
        Observed(
            "recommendation.refused",
            SYSTEM,
            f"scenes that were refused with a reason and drawn again, in addition to {scenes}",
            len(refusal_reasons),
            "scenes",
        ).at_most(
            (1.0 - LEAST_KEPT_TOLERANCE_SHARE) * len(verdicts),
            "; ".join(refusal_reasons) or "none was: every one got a recommendation",
            "none",
        ),
        Observed(
            "recommendation.factor",
            SYSTEM,
            "factor between the predicted and the true error that 95 of 100 settings keep",
            float(np.quantile(factors, 0.95)),
            "times",
        ).beside("1", why, "closed form"),
        Observed(
            "recommendation.slower",
            SYSTEM,
            "settings recommended by force calls that take more calls than the engine's default at the same tolerance",
            _slower_setting_count(every, "calls"),
            "settings",
        ).at_most(0.0, "exact", "none"),
        Observed(
            "recommendation.slower.seconds",
            SYSTEM,
            "settings recommended by seconds that take longer than the engine's default at the same tolerance",
            _slower_setting_count(every, "seconds"),
            "settings",
        ).aim(
            0.0,
            "seconds of the "
            "processor, where the 95 % interval of the ratio lies above 1.05 in two contests more, of 9 and 25 rounds",
        ),
    ]


def _slower_setting_count(verdicts: list[Verdict], cost_kind: str) -> int:
    """Number of recommended settings that cost more than the engine's default, by one kind of cost."""
    return sum(verdict.slower for verdict in verdicts if verdict.kind == cost_kind)


def tables(case_data: Saved) -> list[Table]:
    """Table of every scene with the setting that was recommended over all engines."""
    rows = []
    for of_scene in case_data["verdicts"]:
        if not of_scene:
            continue
        verdict = of_scene[0]
        rows.append(
            (
                verdict["title"],
                f"{verdict['tolerance']:.2g}",
                f"{verdict['curve']}, {verdict['label']}",
                f"{verdict['predicted']:.3g}",
                f"{verdict['true']:.3g}",
                str(sum(v["true"] <= v["tolerance"] for v in of_scene)) + f" of {len(of_scene)}",
            )
        )
    note = (
        "The setting that is recommended by seconds over all engines; the last column counts those of each engine "
        "and of force calls too."
    )
    heads = ("scene", "tolerance", "recommended", "predicted error", "true error", "held")
    return [Table("Recommendations for scenes drawn at random", note, heads, tuple(rows))]


def draw(case_data: Saved) -> Drawn:
    """Plot predicted over true error, both divided by the tolerance."""
    from models.drawing.figures import COLOURS, DARK, LABELS, REJECTED_COLOUR, add_heading, subplots

    figure, ax = subplots(figsize=(6.0, 4.6))
    every = [verdict for of_engine in case_data["verdicts"] for verdict in of_engine]
    for engine in dict.fromkeys(verdict["curve"].split()[0] for verdict in every):
        of_engine = [verdict for verdict in every if verdict["curve"].startswith(engine)]
        ax.plot(
            [verdict["true"] / verdict["tolerance"] for verdict in of_engine],
            [verdict["predicted"] / verdict["tolerance"] for verdict in of_engine],
            "o",
            color=COLOURS[engine],
            markersize=4,
            alpha=0.6,
            label=LABELS[engine],
        )
    span = np.array([1e-6, 10.0])
    ax.plot(span, span, color=DARK, linewidth=0.8)
    ax.fill_between(
        span,
        span / LARGEST_ERROR_FACTOR,
        span * LARGEST_ERROR_FACTOR,
        color="#bbbbbb",
        alpha=0.4,
        linewidth=0,
        label=f"within a factor {LARGEST_ERROR_FACTOR:g}",
    )
    ax.axvline(1.0, color=REJECTED_COLOUR, linewidth=1.0, label="tolerance")
    ax.set(
        xscale="log",
        yscale="log",
        xlabel="true error / tolerance [-]",
        ylabel="predicted error / tolerance [-]",
        xlim=span,
        ylim=span,
    )
    ax.legend(loc="upper left")
    add_heading(
        figure, f"Settings recommended for scenes never seen ({len(case_data['verdicts'])}): errors predicted and true"
    )
    return [("Errors of recommended settings: predicted by the search, and true by another solver.", figure)]
