"""Comparison of all stabilisers on the same perturbed model and noisy forces, by the damage of section forces.

The runs are those of models/systems/pitch_plane/stabilised.py, on the road as it is and on the same road with a grade,
where whatever keeps the pitch near zero is wrong. The first engine runs all methods, the others those that it accepts.
"""

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from models.core.result import result_from_table
from models.core.told import Results
from models.core.whole_files import whole_file, write_whole
from models.drift.score import SECTION_FORCE_CHANNELS
from models.fatigue.damage import COUNTING_CONVENTION
from models.systems.pitch_plane.scene import Scene
from models.systems.pitch_plane.stabilised import FiguresRow, StabiliserBench, compare_stabilisers, options_of
from models.systems.pitch_plane.stabilised import StabiliserOptions as Options

ReportProgress = Callable[[str, float], None]
check = options_of


def run(scene: Scene, engines: tuple[str, ...], output_folder: Path, report_progress: ReportProgress) -> dict[str, Any]:
    """Run all methods on both roads; saves every road's files, ``score.csv``, ``score.nc``, ``table.txt`` and two
    figures, and returns the summary."""
    from models.drawing.drift import decision_figure, stiffness_figure
    from models.drawing.figures import save

    benches_of_roads, rows, failed = compare_stabilisers(scene, engines, output_folder, report_progress)
    options = benches_of_roads[0].options
    report_progress("sweep of stiffness and cut-off", len(benches_of_roads) / (len(benches_of_roads) + 1))
    sweep = {bench.road: bench.sweep() for bench in benches_of_roads}
    table = summary_lines(rows, benches_of_roads, options)
    write_whole(output_folder / "table.txt", "\n".join(table) + "\n")
    with whole_file(output_folder / "score.csv") as partial_path, partial_path.open("w", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    results = {name: result for bench in benches_of_roads for name, result in bench.results.items()}
    saved = result_from_table(scene, rows, "run")
    saved.data.attrs["error"] = _step_error_text(benches_of_roads[0].results)
    saved.save(output_folder / "score.nc")
    report_progress("figures", 1.0)
    of_first = [row for row in rows if row["engine"] == engines[0]]
    save(decision_figure(of_first, options.limits, options.grade, results), output_folder / "decide.png")
    save(stiffness_figure(sweep, benches_of_roads[0], options.limits, options.grade), output_folder / "stiffness.png")
    return {
        "scene": scene.title,
        "folder": str(output_folder),
        "rows": rows,
        "failed": failed,
        "results": results,
        "table": table,
        "sweep": {road: curve.tolist() for road, curve in sweep.items()},
    }


def _step_error_text(score_results: Results) -> str:
    """JSON text of the step error of the score, which is that of the measurement, because all runs use its steps."""
    error = json.loads(next(iter(score_results.values())).data.attrs["error"])
    return json.dumps(
        error | {"how": f"{error['how']}, of the measurement, whose steps all runs share"} if error else {}
    )


def summary_lines(
    score_rows: list[FiguresRow], benches_of_roads: list[StabiliserBench], study_options: Options
) -> list[str]:
    """Lines for the screen: a table of all methods, with a block for each engine and road."""
    lines = [
        f"  Damage ratios: {COUNTING_CONVENTION}, exponent {study_options.slope:g}. Accepted: all four "
        "body-frame ratios within "
        f"{study_options.limits.damage_error:.0%},",
        f"  pitch within {study_options.limits.pitch_error:g} rad, artificial moment up to 15 Hz at most "
        f"{study_options.limits.artificial_share:.0%} of I pitch''. The vertical f3 is never judged: it is blind.",
        "  * seconds by those of the free run, each run once",
    ]
    for engine, road in dict.fromkeys((row["engine"], row["road"]) for row in score_rows):
        of_engine = [row for row in score_rows if (row["engine"], row["road"]) == (engine, road)]
        bench = next(bench for bench in benches_of_roads if bench.road == road)
        road_text = "the road" if road == "road" else f"a grade of {study_options.grade:g} rad"
        free = next(row["seconds"] for row in of_engine if row["method"] == "free")
        lines += [
            "",
            f"  {engine} on {road_text}: force noise {bench.deviation:.1f} N; predicted beforehand: a free run "
            f"can be trusted for {bench.trusted:.1f} s, springs hold from {bench.holding:.0f} N m/rad on",
        ]
        lines += [HEADING_LINE, UNITS_LINE]
        lines += [_score_line(row, free) for row in of_engine]
    return lines


HEADING_LINE = (
    f"  {'':<25}{'damage ratio':^28}{'vertical':>9}{'pitch error':>16}{'artificial moment':>21}{'cost':>8}"
    f"{'verdict':>11}{'without':>11}"
)
UNITS_LINE = (
    f"  {'method':<25}{'f3x':>7}{'f3z':>7}{'f4x':>7}{'f4z':>7}{'f3':>9}{'max':>9}{'rms':>7}"
    f"{'rms':>7}{'max N m':>8}{'share':>6}{'x free*':>8}{'':>11}{'truth':>11}"
)


def _score_line(score: FiguresRow, free_seconds: float) -> str:
    ratios = "".join(f"{_ratio_text(score[f'damage {channel}']):>7}" for channel in SECTION_FORCE_CHANNELS)
    return (
        f"  {score['method']:<25}{ratios}{_ratio_text(score['vertical damage f3']):>9}"
        f"{score['pitch error max [rad]']:>9.4f}{score['pitch error rms [rad]']:>7.4f}"
        f"{score['moment rms [N m]']:>7.0f}{score['moment max [N m]']:>8.0f}"
        f"{score['moment share to 15 Hz']:>6.0%}{score['seconds'] / free_seconds:>8.1f}{score['verdict']:>11}"
        f"{score['without truth']:>11}"
    )


def _ratio_text(damage_ratio: float | None) -> str:
    """Text of a damage ratio in at most six characters; "-" for a tumbled run, which has none."""
    return (
        "-"
        if damage_ratio is None
        else f"{damage_ratio:.3f}"
        if damage_ratio < 10
        else f"{damage_ratio:.1f}"
        if damage_ratio < 1e3
        else f"{damage_ratio:.0e}"
    )


if __name__ == "__main__":
    from studies.command_line import run_study_as_script

    run_study_as_script("stabilisers")
