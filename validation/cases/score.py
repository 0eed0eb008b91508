"""Score of a stabilised run: the errors that it detects, the errors that vertical forces cannot show, and its verdicts
in every engine."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from models.core.noise import normal_samples
from models.core.strict import read
from models.core.systems import load
from models.drift.score import SECTION_FORCE_CHANNELS, errors_of_run
from models.fatigue.damage import WOEHLER_SLOPE, pseudo_damage
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.stabilised import (
    StabiliserBench,
    StabiliserOptions,
    compare_stabilisers,
    scenes_by_road,
)
from validation.common.grounds import allowing_breaches
from validation.common.rows import CaseAnswer, Drawn, Observed, Row, Saved, System, Table, behaviour_row
from validation.common.scenes import force_scene, on_paper_road, virtual_drive
from validation.hard_cases.case import IMPLEMENTATIONS

TITLE = "The score of a stabilised run"
SYSTEM: System = "drift"
STUDY_SCENE = Path(__file__).parents[2] / "studies" / "scenes" / "stabilisers.toml"
QUICK_SCENE_CHANGES = ("run.duration=5.0", "options.stiffnesses=[300.0]", "options.cut_offs=[0.1]")
"""Changes of the study's scene in a quick run: two stabilisers on a grade."""
FULL_SCENE_CHANGES = (
    "run.duration=60.0",
    "options.sampling_rate=1000.0",
    "options.stiffnesses=[50.0, 100.0, 300.0, 1e4, 1e5]",
)
"""Changes of the study's scene that reproduce the prototype's runs."""
SINKING_SPEED = 0.5
"""Speed (m/s) at which the whole vehicle sinks in the run with a heave drift."""
SEED = 11
"""Seed of the random walk and of the white noise on which damage conventions are compared."""
SAMPLE_COUNT = 20_000

GOOD_STABILISERS = ("exact pitch prescribed", "exact heave and pitch", "Kalman filter", "Kalman smoother")
BAD_STABILISERS = ("free", "spring 300 N m/rad", "spring 10000 N m/rad", "10000 beyond 0.05 rad", "high-pass 0.1 Hz")
"""Stabilisers that are known to give wrong results on both roads; those of GOOD_STABILISERS give right ones."""

PROTOTYPE_RESULTS = {
    "free": (5.9, 0.755, 5e5),
    "exact pitch prescribed": (0.0, 1.004, 1.007),
    "measured pitch to 15 Hz": (0.002, 1.035, 1.024),
    "spring 50 N m/rad": (0.98, 0.349, 2.7e5),
    "spring 100 N m/rad": (0.067, 0.994, 1.59),
    "spring 300 N m/rad": (0.071, 0.997, 0.47),
    "spring 10000 N m/rad": (0.087, 1.013, 0.14),
    "spring 100000 N m/rad": (0.122, 1.073, 0.05),
    "Kalman filter": (0.0018, 0.994, 0.985),
}
"""Largest pitch error (rad), damage ratio of f3z and damage ratio of f3x that an earlier prototype measured with other
noise, by stabiliser."""


@on_paper_road()
@allowing_breaches("what holds a run too softly, or too hard, is scored like all else")
def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows on heave drift, vertical forces, damage conventions and verdicts; a full run has the whole study in all
    engines, and the prototype's runs."""
    rows = [
        *_damage_convention_rows(),
        *_heave_drift_rows(("reference",) if quick else IMPLEMENTATIONS, 5.0 if quick else 20.0),
    ]
    with TemporaryDirectory() as name:
        if quick:
            return rows + _verdicts_on_grade_rows(Path(name), ("reference",)), {"study": [], "prototype": []}
        rows += _verdicts_on_grade_rows(Path(name), IMPLEMENTATIONS)
        studied = _results_of_study(Path(name))
        long = _results_of_long_runs(Path(name))
    rows += [*_verdict_rows(studied), *_vertical_damage_rows(studied), *_prototype_rows(long)]
    return rows, {"study": studied, "prototype": long}


def _damage_convention_rows() -> list[Row]:
    """Rows: cycle counting from turning points alone gives the library's result; and change of the damage by another
    convention."""
    from rainflow import extract_cycles

    walk = normal_samples(SEED, 0, SAMPLE_COUNT, 1)[:, 0].cumsum()
    white = normal_samples(SEED, 1, SAMPLE_COUNT, 1)[:, 0]
    library_damage = sum(count * span**WOEHLER_SLOPE for span, _, count, _, _ in extract_cycles(walk.tolist()))
    repeated = {
        name: _repeated_damage(load) / pseudo_damage(load) - 1 for name, load in (("walk", walk), ("white", white))
    }
    why = "the residue closed by repeating the load, instead of counted as half cycles: the convention must be stated"
    return [
        Observed(
            "score.damage.turning-points",
            SYSTEM,
            f"relative difference of the damage of a random walk of {SAMPLE_COUNT:,} samples by its "
            "turning points alone from all samples",
            abs(pseudo_damage(walk) / library_damage - 1),
            "",
        ).at_most(1e-12, "rainflow reads turning points only; the sum is in another order", "native"),
        *(
            Observed(f"score.damage.convention.{name}", SYSTEM, what, repeated[name], "").beside(
                f"{counting_text} between two libraries", why
            )
            for name, what, counting_text in (
                ("walk", "damage of a random walk with its residue closed, difference", 0.34),
                ("white", "damage of white noise with its residue closed, difference", 0.001),
            )
        ),
    ]


def _repeated_damage(load: np.ndarray) -> float:
    """Pseudo-damage of one period of a load that is repeated for ever: the amount that a second period adds to the
    first."""
    return pseudo_damage(np.concatenate((load, load))) - pseudo_damage(load)


def _heave_drift_rows(engine_names: tuple[str, ...], duration: float) -> list[Row]:
    """Rows: in a run that sinks steadily, the heave error grows, but the section forces are right."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        virtual_drive(folder, duration)
        sunk = {engine: _errors_of_sinking_run(engine, folder, duration) for engine in engine_names}
    rows = []
    for engine, (drift, worst) in sunk.items():
        rows += [
            Observed(
                f"score.heave.drift.{engine}",
                SYSTEM,
                f"{engine}: heave error of a run that sinks at {SINKING_SPEED} m/s",
                drift,
                "m",
            ).within(SINKING_SPEED * duration, 1e-6, "a large drift, on purpose", "closed form"),
            Observed(
                f"score.heave.damage.{engine}",
                SYSTEM,
                f"{engine}: largest |damage ratio - 1| of a run that sinks at {SINKING_SPEED} m/s",
                worst,
                "",
            ).at_most(
                1e-9,
                "the equations feel neither place nor common speed: a heave drift leaves all four "
                "section forces alone, up to rounding of heights of 10 m that the pitch's growth carries on",
                "closed form",
            ),
        ]
    return rows


def _errors_of_sinking_run(engine_name: str, work_folder: Path, duration: float) -> tuple[float, float]:
    """Heave error (m) of the sinking run, and largest deviation of its damage ratios from 1."""
    scene = force_scene(work_folder, duration=duration)
    sinking = scene.model_copy(update={"start": dict.fromkeys(("z1_rate", "z2_rate", "z3_rate"), SINKING_SPEED)})
    still, moved = (simulate(simulated_scene, engine_name) for simulated_scene in (scene, sinking))
    wrong = errors_of_run(moved, still)
    return wrong.heave_max, max(abs(ratio - 1) for ratio in wrong.damage.values())


def _verdicts_on_grade_rows(work_folder: Path, engine_names: tuple[str, ...]) -> list[Row]:
    """Rows: on a grade of 0.1 rad a holding spring gives wrong results, and a prescribed pitch right ones, in each
    implementation."""
    scene = load(STUDY_SCENE, QUICK_SCENE_CHANGES)
    options = read(StabiliserOptions, scene.options, "", "options")
    (work_folder / "short").mkdir()
    bench = StabiliserBench(scenes_by_road(scene, options)["grade"], "grade", options, work_folder / "short")
    rows = []
    for engine in engine_names:
        for name, word in (("exact pitch prescribed", "accepted"), ("spring 300 N m/rad", "rejected")):
            row = _score_of_stabiliser(bench, name, engine)
            rows.append(
                behaviour_row(
                    f"score.grade.{name.split()[0]}.{engine}",
                    SYSTEM,
                    f"{engine}: {name}, 5 s up to a grade of 0.1 rad",
                    row["verdict"],
                    word,
                    f"damage of f3x x {row['damage f3x']:.3g}, "
                    f"pitch wrong by {row['pitch error max [rad]']:.2g} rad: what keeps it near zero "
                    "is wrong on a grade",
                    "closed form",
                )
            )
    return rows


def _results_of_study(work_folder: Path) -> list[Saved]:
    """Results of all stabilisers of the study with its default options, in all engines."""
    (work_folder / "study").mkdir()
    _, rows, failed = compare_stabilisers(
        load(STUDY_SCENE), IMPLEMENTATIONS, work_folder / "study", lambda text, progress_share: None
    )
    assert not failed, failed
    return rows


def _verdict_rows(study_results: list[Saved]) -> list[Row]:
    """Rows: runs known to be good or bad get the right verdict. The verdict without the true run is judged for bad runs
    only."""
    rows = []
    for row in study_results:
        name, word, alone = row["method"], row["verdict"], row["without truth"]
        run_text = f"{row['engine']}, {row['road']}: {name}"
        if name in GOOD_STABILISERS or name in BAD_STABILISERS:
            id, wanted = (
                f"score.verdict.{_row_id_of_stabiliser(row)}",
                "accepted" if name in GOOD_STABILISERS else "rejected",
            )
            rows.append(behaviour_row(id, SYSTEM, f"{run_text}, by damage", word, wanted, row["reason"], "closed form"))
        if name in BAD_STABILISERS:
            id, what, why = (
                f"score.without-truth.{_row_id_of_stabiliser(row)}",
                f"{run_text}, without the truth",
                row["reason without truth"],
            )
            verdict_text = "accepted" if alone == "accepted" else "not accepted"
            rows.append(behaviour_row(id, SYSTEM, what, verdict_text, "not accepted", why, "none"))
        elif word != "accepted" and alone == "accepted":
            id, what = (
                f"score.unseen.{_row_id_of_stabiliser(row)}",
                f"{run_text}, damage ratio of f3x where the run itself shows nothing",
            )
            why = "what an engineer without the truth cannot know"
            rows.append(Observed(id, SYSTEM, what, row["damage f3x"], "").beside(word, why, "none"))
    return rows


def _stabiliser_in_row_id(stabiliser_name: str) -> str:
    """Name of a stabiliser as part of a row id."""
    return stabiliser_name.replace(" ", "-").replace("/", "-")


def _row_id_of_stabiliser(study_result: Saved) -> str:
    """Part of a row id for a stabiliser, road and engine."""
    return ".".join((_stabiliser_in_row_id(study_result["method"]), study_result["road"], study_result["engine"]))


def _vertical_damage_rows(study_results: list[Saved]) -> list[Row]:
    """Rows: the damage of the vertical section force is nearly right even in a run that has tumbled, so this damage
    must not be used as a score."""
    return [
        Observed(
            f"score.vertical.{row['road']}.{row['engine']}",
            SYSTEM,
            f"{row['engine']}, {row['road']}: damage "
            f"ratio of the vertical f3 of a free run, pitch {row['pitch error max [rad]']:.1f} rad wrong",
            row["vertical damage f3"],
            "",
        ).within(
            1.0,
            0.1,
            "f3 = f1 - m1 g + m1 z1'' at every pitch: whoever scores "
            "by it calls a tumbling run good; here it is shown, never judged by",
            "closed form",
        )
        for row in study_results
        if row["method"] == "free"
    ]


def _results_of_long_runs(work_folder: Path) -> list[Saved]:
    """Results of the prototype's stabilisers over 60 s at 1 kHz on the road, in the hand-written reference."""
    scene = load(STUDY_SCENE, FULL_SCENE_CHANGES)
    (work_folder / "long").mkdir()
    bench = StabiliserBench(scene, "road", read(StabiliserOptions, scene.options, "", "options"), work_folder / "long")
    return [_score_of_stabiliser(bench, name) for name in PROTOTYPE_RESULTS]


def _score_of_stabiliser(
    stabiliser_bench: StabiliserBench, stabiliser_name: str, engine_name: str = "reference"
) -> Saved:
    """Score of a run with one stabiliser."""
    effects = stabiliser_bench.methods[stabiliser_name]
    return stabiliser_bench.row(stabiliser_name, effects, stabiliser_bench.simulate(engine_name, effects))


def _prototype_rows(results_of_long_runs: list[Saved]) -> list[Row]:
    """Rows: pitch errors and damage ratios over 60 s, reported next to the prototype's; a tumbled run has no damage
    ratio."""
    rows = []
    for row in results_of_long_runs:
        pitch, upright, along = PROTOTYPE_RESULTS[row["method"]]
        name = _stabiliser_in_row_id(row["method"])
        why = "the same road, model and levels of noise; other noise samples, and here the filter estimates the inertia"
        shown = (
            ("pitch", "pitch error max [rad]", "largest pitch error", "rad", pitch),
            ("f3z", "damage f3z", "damage ratio of f3z", "", upright),
            ("f3x", "damage f3x", "damage ratio of f3x", "", along),
        )
        rows += [
            Observed(
                f"score.prototype.{name}.{short}", SYSTEM, f"{row['method']}, 60 s: {words}", row[key], unit
            ).beside(f"{wanted:g} (prototype)", why, "none")
            for short, key, words, unit, wanted in shown
            if row[key] is not None
        ]
    return rows


def tables(case_data: Saved) -> list[Table]:
    """Tables of every stabiliser on both roads, and over 60 s compared with the prototype."""
    tables = []
    shown = {"Stabilisers compared": case_data["study"], "Stabilisers over 60 s at 1 kHz": case_data["prototype"]}
    for title, rows in shown.items():
        if rows:
            note = (
                "Damage ratios of the section forces in the chassis' frame; a tumbled run has none. The vertical "
                "f3 is shown because it is blind. The last two columns: the verdict by damage, and that of an "
                "engineer who has no true run."
            )
            tables.append(Table(title, note, TABLE_HEADINGS, tuple(_table_cells(row) for row in rows)))
    return tables


TABLE_HEADINGS = (
    "engine",
    "road",
    "method",
    *SECTION_FORCE_CHANNELS,
    "vertical f3",
    "pitch error [rad]",
    "moment rms [N m]",
    "share to 15 Hz",
    "by damage",
    "without truth",
)


def _table_cells(study_result: Saved) -> tuple[str, ...]:
    """Table cells of a stabiliser's result."""
    ratios = (study_result[f"damage {channel}"] for channel in SECTION_FORCE_CHANNELS)
    return (
        study_result.get("engine", "reference"),
        study_result.get("road", "road"),
        study_result["method"],
        *("" if ratio is None else f"{ratio:.3g}" for ratio in ratios),
        f"{study_result['vertical damage f3']:.3f}",
        f"{study_result['pitch error max [rad]']:.2g}",
        f"{study_result['moment rms [N m]']:.0f}",
        f"{study_result['moment share to 15 Hz']:.1%}",
        study_result["verdict"],
        study_result["without truth"],
    )


def draw(case_data: Saved) -> Drawn:
    """Plot the damage ratios of all stabilisers of the study."""
    if not case_data["study"]:
        return []
    from models.drawing.drift import decision_figure

    scene = load(STUDY_SCENE)
    options = read(StabiliserOptions, scene.options, "", "options")
    rows = [row for row in case_data["study"] if row["engine"] == "reference"]
    return [("What each stabiliser leaves in the section forces", decision_figure(rows, options.limits, options.grade))]
