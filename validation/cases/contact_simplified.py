"""Kalker's simplified theory of 1983 compared with the exact contact of half-spaces: approach, area, peak pressure,
forces, and computing time."""

import re
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from models.contact.fastsim import RollingEllipse, fastsim
from models.contact.hertz import by_load
from models.contact.patches import Patch, separate_patches
from models.contact.simplified_theory import (
    DEFAULT_OPTIONS,
    PAPER_OPTIONS,
    NormalContact,
    SimplifiedOptions,
    load_at_depth,
    solve_normal_contact,
    solve_rolling_contact,
)
from models.contact.undeformed_distance import quadratic
from models.machine.seconds import seconds_text
from models.machine.timing import interleave
from validation.common.rows import Observed, Row, System, Table
from validation.contact.contact_shapes import (
    CURVATURE,
    FRICTION,
    MATERIAL_PAIR,
    Box,
    Shape,
    creepages,
    exact_contact_of_wheelset,
    exact_normal,
    exact_rolling,
    merged_shapes,
    placed_wheelsets,
    profile_shapes,
    shapes_by_formula,
)

TITLE = "Rolling contact of any shape: the theory of 1983"
SYSTEM: System = "contact"
EXACT_CELL_COUNT = 36
"""Cells of the exact grid along each axis."""
FITTING_OPTIONS = {
    "elliptic": DEFAULT_OPTIONS,
    "paper": PAPER_OPTIONS,
    "elliptic, gradient": SimplifiedOptions(fit="gradient"),
    "paper, gradient": replace(PAPER_OPTIONS, fit="gradient"),
    "elliptic, one net": replace(DEFAULT_OPTIONS, separate=False),
}
"""Variants of the theory; the first is the default, the second follows the paper to the letter."""
TIMING_ROUNDS = 10
"""Number of timing rounds."""
MESHES_PER_SIDE = (5, 7, 9, 11, 15, 19, 25)
"""Meshes per side of the coarse net of the normal problem."""
CURVATURE_RATIOS = (0.05, 0.2, 1.0, 5.0, 20.0)
"""Ratios of curvatures B/A of the ellipses for which Hertz's closed form is exact."""
APPROACH_TOLERANCE, LOAD_JUMP_TOLERANCE = 0.02, 1e-6
"""Relative tolerance of the approach, and largest jump (N) of the load as a function of depth."""
APPROACH_REASON = "the figure set for the theory"
NO_ACCURACY_CLAIM_REASON = (
    "the theory has one W for the whole contact: nothing is claimed, the figure tells what it is worth"
)


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows on Hertz's ellipses and on the continuity of the load; a full run has all shapes, variants and net sizes,
    and computing times."""
    hertz = {
        f"{ratio:g}": _errors_on_hertz_ellipse(ratio, DEFAULT_OPTIONS)
        | {"paper": _errors_on_hertz_ellipse(ratio, PAPER_OPTIONS)["approach"]}
        for ratio in CURVATURE_RATIOS
    }
    jump = largest_load_jump(separate_patches(shapes_by_formula()[4].distance)[0], 20 if quick else 200)
    data: dict[str, Any] = {"hertz": hertz, "jump": jump}
    rows = [*_hertz_rows(hertz), _load_jump_row(jump)]
    if quick:
        return rows, data
    data["shapes"] = {shape.name: _errors_of_variants(shape) for shape in shapes_by_formula() + profile_shapes()}
    data["grown"] = {shape.name: _approach_errors(shape) for shape in merged_shapes()} | _rail_approach_errors()
    data["nets"] = {
        str(net): _errors_on_hertz_ellipse(5.0, replace(DEFAULT_OPTIONS, net=net)) for net in MESHES_PER_SIDE
    }
    data["time"] = _computing_times()
    return rows + _contact_shape_rows(data["shapes"]) + _merged_patch_rows(data["grown"]) + _computing_time_rows(
        data["time"]
    ), data


def _errors_on_hertz_ellipse(curvature_ratio: float, fitting_options: SimplifiedOptions) -> dict[str, float]:
    """Relative errors of approach, area and peak pressure on a Hertzian ellipse with the ratio of curvatures B/A."""
    exact = by_load(CURVATURE, CURVATURE * curvature_ratio, 1e5, MATERIAL_PAIR)
    a, b = float(exact.a), float(exact.b)
    contact = solve_normal_contact(
        quadratic(CURVATURE, CURVATURE * curvature_ratio, 2.5 * a, 2.5 * b),
        MATERIAL_PAIR,
        load=1e5,
        simplified_options=fitting_options,
    )
    return _relative_errors(contact, float(exact.approach), np.pi * a * b, float(exact.p0))


def _relative_errors(
    normal_contact: NormalContact, exact_approach: float, exact_area: float, exact_peak: float
) -> dict[str, float]:
    """Relative errors of a contact's approach, area and peak pressure."""
    exact = {"approach": exact_approach, "area": exact_area, "peak": exact_peak}
    return {key: getattr(normal_contact, key) / value - 1.0 for key, value in exact.items()}


def largest_load_jump(contact_patch: Patch, depth_step_count: int) -> float:
    """Largest jump (N) of the load as a function of depth. Each step of a sweep over depths is bisected towards the
    larger change, down to rounding."""

    def load(depth: float) -> float:
        return load_at_depth(contact_patch, depth, MATERIAL_PAIR).load

    return max(_load_jump(load, *ends) for ends in pairwise(np.linspace(2e-6, 6e-5, depth_step_count + 1).tolist()))


def _load_jump(load_of_depth: Callable[[float], float], lower_depth: float, upper_depth: float) -> float:
    """Jump (N) of the load between two depths, located by bisection down to a relative distance of 1e-15."""
    at_low, at_high = load_of_depth(lower_depth), load_of_depth(upper_depth)
    while upper_depth - lower_depth > 1e-15 * upper_depth:
        middle = 0.5 * (lower_depth + upper_depth)
        at_middle = load_of_depth(middle)
        if abs(at_middle - at_low) > abs(at_high - at_middle):
            upper_depth, at_high = middle, at_middle
        else:
            lower_depth, at_low = middle, at_middle
    return abs(at_high - at_low)


def _errors_of_variants(contact_shape: Shape) -> dict[str, Any]:
    """Errors of every variant of the theory for one contact shape, and the exact values. Errors of approach, area and
    peak pressure are relative; those of forces are in % of mu N."""
    contacts = {
        name: solve_normal_contact(
            contact_shape.distance, MATERIAL_PAIR, load=contact_shape.load, simplified_options=fitting_options
        )
        for name, fitting_options in FITTING_OPTIONS.items()
    }
    normal = exact_normal(
        contact_shape, EXACT_CELL_COUNT, contact_shape.box or _box_around_patches(contacts["elliptic"])
    )
    motions = creepages(normal.area, contact_shape.load)
    exact = {key: exact_rolling(normal, motion) for key, motion in motions.items()}
    solved = {key: solution for key, solution in exact.items() if solution is not None}
    figures = {"approach": normal.approach, "area": normal.area, "peak": float(normal.pressure.max())}
    errors_by_fitting = {}
    for name, contact in contacts.items():
        forces = [
            float(100.0 * np.hypot(rolled.fx - true.fx, rolled.fy - true.fy) / (FRICTION * contact_shape.load))
            for rolled, true in (
                (solve_rolling_contact(contact, FRICTION, *motions[key]), true) for key, true in solved.items()
            )
        ]
        mean, most = (float(np.mean(forces)), float(np.max(forces))) if forces else (np.nan, np.nan)
        errors_by_fitting[name] = _relative_errors(contact, *figures.values()) | {"force": mean, "force_max": most}
    return {"exact": figures, "ways": errors_by_fitting, "rolling": len(solved), "asked": len(exact)}


def _approach_errors(contact_shape: Shape) -> dict[str, float]:
    """Relative errors of the approach with a separate grid for each patch, and with one grid for all patches."""
    exact = exact_normal(contact_shape, EXACT_CELL_COUNT, contact_shape.box or (0.0, 0.0, 0.0, 0.0)).approach
    return {
        name: solve_normal_contact(
            contact_shape.distance, MATERIAL_PAIR, load=contact_shape.load, simplified_options=fitting_options
        ).approach
        / exact
        - 1.0
        for name, fitting_options in (("each", DEFAULT_OPTIONS), ("one", FITTING_OPTIONS["elliptic, one net"]))
    }


def _rail_approach_errors() -> dict[str, dict[str, float]]:
    """Relative errors of the approach of wheels on rails with a separate grid for each patch; NaN for one common
    grid."""
    errors = {}
    for position in placed_wheelsets():
        pressed = solve_normal_contact([touch.patch for touch in position.touches], MATERIAL_PAIR, load=position.load)
        along = np.cos(min(patch_pressure.patch.lean for patch_pressure in pressed.patches))
        name = f"S1002 on UIC 60, {1e3 * position.shift:g} mm, yaw {1e3 * position.yaw:g} mrad, "
        name += f"{1e-3 * position.load:g} kN"
        error = pressed.approach * along / exact_contact_of_wheelset(position, pressed, EXACT_CELL_COUNT).approach - 1.0
        errors[name] = {"each": float(error), "one": np.nan}
    return errors


def _box_around_patches(normal_contact: NormalContact) -> Box:
    """Box around all patches of a contact, enlarged by a fifth of its size on every side."""
    x0, x1, y0, y1 = np.array([patch_pressure.box for patch_pressure in normal_contact.patches]).T
    (low_x, high_x), (low_y, high_y) = (x0.min(), x1.max()), (y0.min(), y1.max())
    wide, high = 0.2 * (high_x - low_x), 0.2 * (high_y - low_y)
    return low_x - wide, high_x + wide, low_y - high, high_y + high


def _computing_times() -> dict[str, list[float]]:
    """Computing times (s) of FASTSIM of 1982, of the functions of the theory of 1983, and of the exact theory, at about
    45 x 45 cells."""
    hertz = by_load(CURVATURE, 1.5 * CURVATURE, 1e5, MATERIAL_PAIR)
    a, b = float(hertz.a), float(hertz.b)
    distance, creepage = quadratic(CURVATURE, 1.5 * CURVATURE, 2.5 * a, 2.5 * b), (1e-3, 5e-4, 0.3)
    contact, (patch,) = solve_normal_contact(distance, MATERIAL_PAIR, load=1e5), separate_patches(distance)
    jobs: dict[str, Callable[[], Any]] = {
        "1982": lambda: fastsim(RollingEllipse(a, b, 1e5, FRICTION, *creepage), MATERIAL_PAIR, cells=45),
        "roll": lambda: solve_rolling_contact(contact, FRICTION, *creepage),
        "press": lambda: solve_normal_contact(distance, MATERIAL_PAIR, load=1e5),
        "depth": lambda: load_at_depth(patch, 5e-5, MATERIAL_PAIR),
        "exact": lambda: exact_normal(shapes_by_formula()[0], 45, (-0.008, 0.008, -0.008, 0.008)),
    }
    return dict(zip(jobs, interleave(list(jobs.values()), TIMING_ROUNDS).tolist(), strict=True))


def _hertz_rows(errors_by_ratio: dict[str, dict[str, float]]) -> list[Row]:
    """Rows: largest errors on Hertzian ellipses over all ratios of curvatures."""
    worst = {key: max(abs(case[key]) for case in errors_by_ratio.values()) for key in ("approach", "paper")}
    why = "the figure set for the theory; the closed form is Hertz's"
    rows = [
        Observed(
            f"contact_simplified.hertz.{key}",
            SYSTEM,
            f"largest error of the approach, B/A {CURVATURE_RATIOS[0]:g} to "
            f"{CURVATURE_RATIOS[-1]:g}, {'pressure to the letter of the paper' if key == 'paper' else 'default'}",
            100.0 * value,
            "%",
        ).at_most(100.0 * APPROACH_TOLERANCE, why, "closed form")
        for key, value in worst.items()
    ]
    circle = errors_by_ratio["1"]
    rows += [
        Observed(
            f"contact_simplified.hertz_circle.{key}",
            SYSTEM,
            f"{key} of a circular contact",
            100.0 * abs(circle[key]),
            "%",
        ).at_most(2.0, "with Hertz's profile the theory contains the circle but for its net", "closed form")
        for key in ("area", "peak")
    ]
    return rows


def _load_jump_row(load_jump: float) -> Row:
    """Row: largest jump of the load as a function of depth."""
    return Observed(
        "contact_simplified.continuity", SYSTEM, "largest jump of the load N(a3) of a lopsided contact", load_jump, "N"
    ).at_most(
        LOAD_JUMP_TOLERANCE,
        "every step of the sweep is bisected to neighbouring numbers; the figure set for the theory",
        "none",
    )


def _contact_shape_rows(errors_by_shape: dict[str, dict[str, Any]]) -> list[Row]:
    """Rows: errors of approach and forces for every contact shape, compared with the exact theory."""
    rows = []
    for name, case in errors_by_shape.items():
        row_name = "contact_simplified." + "_".join(re.findall(r"\w+", name))
        best = case["ways"]["elliptic"]
        rows.append(
            Observed(
                f"{row_name}.approach", SYSTEM, f"error of the approach, {name}", 100.0 * abs(best["approach"]), "%"
            ).at_most(100.0 * APPROACH_TOLERANCE, APPROACH_REASON, "native")
        )
        for key, what in (("area", "area"), ("peak", "peak pressure")):
            rows.append(
                Observed(f"{row_name}.{key}", SYSTEM, f"error of the {what}, {name}", 100.0 * best[key], "%").beside(
                    0.0, NO_ACCURACY_CLAIM_REASON, "native"
                )
            )
        asked = f"{case['rolling']} of {case['asked']} creepages"
        rows.append(
            Observed(
                f"{row_name}.force", SYSTEM, f"mean error of the force, {name}, {asked}", best["force"], "% of mu N"
            ).beside(0.0, NO_ACCURACY_CLAIM_REASON, "native")
        )
    return rows


def _merged_patch_rows(errors_by_contact: dict[str, dict[str, float]]) -> list[Row]:
    """Rows: largest error of the approach among contacts whose patches have merged, and among wheels on rails."""
    rows = []
    kinds = (("grown", "distances with several valleys", False), ("wheels", "wheels on rails", True))
    for row_name, what, chosen in kinds:
        errors = {
            name: abs(case["each"]) for name, case in errors_by_contact.items() if name.startswith("S1002") == chosen
        }
        worst = max(errors, key=errors.__getitem__)
        rows.append(
            Observed(
                f"contact_simplified.{row_name}.approach",
                SYSTEM,
                f"error of the approach, {len(errors)} {what}, worst: {worst}",
                100.0 * errors[worst],
                "%",
            ).at_most(100.0 * APPROACH_TOLERANCE, APPROACH_REASON, "native")
        )
    return rows


def _computing_time_rows(seconds_by_program: dict[str, list[float]]) -> list[Row]:
    """Rows: ratios of computing times of the theories."""
    why = "the paper's program was written for one machine of 1983; compiled marches made FASTSIM alone much cheaper"
    return [
        Observed(
            "contact_simplified.time.forces",
            SYSTEM,
            f"ratio of the time of FASTSIM twice with the refit, {seconds_text(seconds_by_program['roll'])}, to that "
            f"of the 1982 program, {seconds_text(seconds_by_program['1982'])}",
            _computing_time_ratio(seconds_by_program, "roll", "1982"),
            "",
        ).beside("about 3 with the contact, which contact_price compares", why),
        Observed(
            "contact_simplified.time.exact",
            SYSTEM,
            "ratio of the time of the exact normal problem at the same fineness, "
            f"{seconds_text(seconds_by_program['exact'])}, to that of this method, "
            f"{seconds_text(seconds_by_program['press'])}",
            _computing_time_ratio(seconds_by_program, "exact", "press"),
            "",
        ).beside("", "what the theory saves", "none"),
    ]


def _computing_time_ratio(seconds_by_program: dict[str, list[float]], numerator: str, denominator: str) -> float:
    """Ratio of the median computing times of two programs."""
    return float(np.median(seconds_by_program[numerator]) / np.median(seconds_by_program[denominator]))


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Tables of the errors on Hertz's ellipses; a full run also has every shape and variant, and the size of the
    net."""
    signed = "{:+.2f}".format
    hertz = tuple(
        (ratio, *(signed(100.0 * case[key]) for key in ("approach", "area", "peak", "paper")))
        for ratio, case in case_data["hertz"].items()
    )
    heads: tuple[str, ...] = ("B/A", "approach [%]", "area [%]", "peak pressure [%]", "approach, paper [%]")
    tables = [Table("Theory of 1983 on Hertz's ellipses", "Error by ratio of curvatures, 15 x 15 net.", heads, hertz)]
    if "shapes" not in case_data:
        return tables
    rows = tuple(
        (
            name,
            variant,
            *(signed(100.0 * errors[key]) for key in ("approach", "area", "peak")),
            f"{errors['force']:.1f}",
            f"{errors['force_max']:.1f}",
        )
        for name, case in case_data["shapes"].items()
        for variant, errors in case["ways"].items()
    )
    note = (
        f"Errors against the exact contact on {EXACT_CELL_COUNT} x {EXACT_CELL_COUNT} cells. Forces: mean and "
        "largest over "
        "five kinds of "
        "creepage at 0.5 and 2 times the linear scale. Paper: pressure proportional to the depth, to the letter; "
        "elliptic: to its root, the default; gradient: least squares of the slopes; one net: one W for all patches."
    )
    heads = ("shape", "way", "approach [%]", "area [%]", "peak [%]", "force, mean [% mu N]", "force, max [% mu N]")
    nets = tuple(
        (net, *(signed(100.0 * case[key]) for key in ("approach", "area", "peak")))
        for net, case in case_data["nets"].items()
    )
    together = tuple(
        (name, *("" if np.isnan(value) else signed(100.0 * value) for value in case.values()))
        for name, case in case_data["grown"].items()
    )
    return [
        *tables,
        Table("Theory of 1983 against the exact contact", note + " " + _errors_text(case_data["shapes"]), heads, rows),
        Table(
            "Size of the crude net",
            "Errors on an ellipse with B/A = 5. " + _net_errors_text(case_data["nets"]),
            ("net", *heads[2:5]),
            nets,
        ),
        Table(
            "Approach where areas have grown together, and of wheels on rails",
            "Error by the theory of 1983. Least "
            "squares with the displacement by all patches do for areas apart and grown together alike; one net for "
            "all needs no valleys, but fails where they are apart.",
            ("contact", "a net for each patch [%]", "one net for all [%]"),
            together,
        ),
    ]


def _errors_text(errors_by_shape: dict[str, dict[str, Any]]) -> str:
    """Sentences on the mean errors of the variants over all shapes."""

    def mean(variant_name: str, error_name: str) -> str:
        scale = 1.0 if error_name == "force" else 100.0
        errors = [abs(case["ways"][variant_name][error_name]) for case in errors_by_shape.values()]
        return f"{scale * np.nanmean(errors):.1f} %"

    apart = errors_by_shape["two patches"]["ways"]
    return (
        f"Mean errors over all shapes: Hertz's profile of the pressure instead of the paper's makes "
        f"{mean('elliptic', 'area')} of {mean('paper', 'area')} in the area, {mean('elliptic', 'force')} of "
        f"{mean('paper', 'force')} in the force and {mean('elliptic', 'peak')} of {mean('paper', 'peak')} in the "
        "peak, which is nearer on ellipses and farther where there are several valleys. "
        f"Fitting the gradient changes the force to {mean('elliptic, gradient', 'force')} and the approach from "
        f"{mean('elliptic', 'approach')} to {mean('elliptic, gradient', 'approach')}. One W for two patches apart "
        f"makes the approach wrong by {100.0 * apart['elliptic, one net']['approach']:+.0f} % instead of "
        f"{100.0 * apart['elliptic']['approach']:+.1f} %."
    )


def _net_errors_text(errors_by_net: dict[str, dict[str, float]]) -> str:
    """Sentences on the errors by the size of the net."""
    sizes = (next(iter(errors_by_net)), str(DEFAULT_OPTIONS.net), list(errors_by_net)[-1])
    first, used, last = (100.0 * abs(errors_by_net[net]["approach"]) for net in sizes)
    area, peak = (100.0 * errors_by_net[sizes[-1]][key] for key in ("area", "peak"))
    return (
        f"The approach settles: off by {first:.2f} % with {sizes[0]} x {sizes[0]} meshes, {used:.2f} % with the "
        f"{sizes[1]} x {sizes[1]} that are used, {last:.2f} % with {sizes[2]} x {sizes[2]}. Area and peak are off "
        f"by {area:+.1f} and {peak:+.1f} % even there: that is the theory, not its net."
    )


def draw(case_data: dict[str, Any]) -> list[tuple[str, Any]]:
    """Plot the errors of the two pressure profiles for each contact shape."""
    if "shapes" not in case_data:
        return []
    from models.drawing.figures import COLUMN_WIDTH, add_heading, subplots

    shapes = case_data["shapes"]
    figure, axes = subplots(1, 4, figsize=(COLUMN_WIDTH, 4.2), sharey=True)
    shape_positions = np.arange(len(shapes))
    for axis, (key, label) in zip(
        axes,
        {
            "approach": "approach [%]",
            "area": "area [%]",
            "peak": "peak pressure [%]",
            "force": "force [% of μN]",
        }.items(),
        strict=True,
    ):
        for variant, mark in (("elliptic", "o"), ("paper", "x")):
            scale = 1.0 if key == "force" else 100.0
            axis.plot(
                [scale * case["ways"][variant][key] for case in shapes.values()], shape_positions, mark, label=variant
            )
        axis.axvline(0.0, color="0.7", linewidth=0.8)
        axis.set_xlabel(label)
    axes[0].set_yticks(shape_positions, list(shapes))
    axes[0].invert_yaxis()
    axes[0].legend(loc="upper right")
    add_heading(figure, "Theory of 1983 against exact contact: errors with Hertz's and with the paper's pressure")
    caption = (
        "Errors of the theory of 1983 against the exact contact: with Hertz's profile of the pressure "
        "(elliptic) area and forces are nearer than with the paper's, the peak on ellipses alone."
    )
    return [(caption, figure)]
