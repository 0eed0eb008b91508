"""FASTSIM: discretisation error, model error, invariants, derivatives, and computing time."""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ellipe

from models.contact.fastsim import FLEXIBILITY_KINDS as KINDS_OF_FLEXIBILITY
from models.contact.fastsim import RollingEllipse, fastsim
from models.contact.fastsim_derivatives import creep_force_derivatives
from models.contact.fastsim_grid import POWERS
from models.contact.inputs import Array
from models.contact.linear_theory import kalker_coefficients
from models.contact.linear_theory import linear_creep_forces as linear_forces
from models.contact.material import MaterialPair
from validation.common.rows import Observed, Row, System, Table
from validation.contact.contact_bands import theory_errors
from validation.contact.contact_set import JUDGED_PART, read_contacts, read_drawn
from validation.contact.fastsim_speed import speed_rows_and_table
from validation.contact.fuzzed_creepage import COMPUTED_OPTIONS, SUM_ROUNDING, random_contacts, worst_violation

TITLE = "FASTSIM"
SYSTEM: System = "contact"
SEED = 41
"""Seed of the random contacts; a quick and a full run draw different streams of this seed, the tests a third one."""
AXIS_RATIOS = (0.2, 0.5, 1.0, 2.0, 5.0)
SPIN_AXIS_RATIOS = (0.1, *AXIS_RATIOS, 10.0)
"""Axis ratios a/b of the ellipses that slide under spin alone."""
CREEPAGE_KINDS = {
    "x": (1.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0),
    "spin": (0.0, 0.0, 1.0),
    "y+spin": (0.0, 0.7071, 0.7071),
    "y-spin": (0.0, 0.7071, -0.7071),
    "y-spin 30": (0.0, 0.866, -0.5),
    "x+spin": (0.7071, 0.0, 0.7071),
    "x-y+spin": (0.5774, -0.5774, 0.5774),
}
CREEPAGE_LEVELS = (0.05, 0.2, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0)
SLIDING_LEVELS = (5.0, 5.5, 6.0, 7.0, 8.0, 10.0, 15.0, 20.0, 50.0, 200.0)
"""Creepage levels around the level from which the whole contact area slides."""
NORMAL_LOAD, FRICTION_COEFFICIENT, MEAN_SEMI_AXIS = 80e3, 0.3, 5e-3
"""Normal load (N), coefficient of friction, and sqrt(a b) (m) of the ellipses with the semi-axes a and b."""
MATERIAL_PAIR = MaterialPair()
FORCE_SCALES = FRICTION_COEFFICIENT * NORMAL_LOAD * np.array([1.0, 1.0, MEAN_SEMI_AXIS])
"""Scales of fx and fy (N) and of mz (N m)."""
ContactColumns = dict[str, Any]
"""Type of a set of contacts: arrays by the names of the parameters of ``fastsim``."""
CELL_COUNTS = (11, 21, 41, 81)
CONVERGED_CELLS, FINE_CELLS = 161, 321
"""Cells per strip for the error of the model compared with the exact theory, and for the solution with which the
discretisation error is measured."""
EXACT_TO_ROUNDING = (0.0, "exact in floating point")
INVARIANT_TOLERANCES = {
    "finite": EXACT_TO_ROUNDING,
    "reversal": EXACT_TO_ROUNDING,
    "zero": EXACT_TO_ROUNDING,
    "similarity": EXACT_TO_ROUNDING,
    "power coarse": (1e-5, "a slender strip that sticks to its end, in the last half cell"),
}
CELL_COUNT_REASON = "the same model with 321 cells per strip; a fifth of the model's own error"


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows for the discretisation, the invariants and the derivatives; a full run also has the model's error and the
    computing time.

    Every run computes the model's error on random contacts, whose exact forces are stored.
    """
    rows, data = _discretisation_rows()
    rows += _invariant_rows(2 if quick else 64, 10_000 if quick else 16_000, 0 if quick else 100)
    rows += _creepage_limit_rows() + _spin_moment_rows() + _force_derivative_rows() + _random_contact_rows()
    if quick:
        return rows, data
    answers, data["model"] = _model_error_rows()
    timed, data["speed"] = speed_rows_and_table(MATERIAL_PAIR, NORMAL_LOAD, FRICTION_COEFFICIENT, MEAN_SEMI_AXIS)
    return rows + answers + timed, data


def creepage_contacts(kind_names: tuple[str, ...], creepage_levels: tuple[float, ...]) -> ContactColumns:
    """Contacts, as columns, for every axis ratio, kind and level of creepage. Creepages have the unit mu N / (G c^2 C),
    where c is sqrt(a b) and C is C11, C22 or C23 c."""
    ratio, kind, level = (
        grid.ravel() for grid in np.meshgrid(AXIS_RATIOS, np.arange(len(kind_names)), creepage_levels, indexing="ij")
    )
    creepage_parts = np.array([CREEPAGE_KINDS[name] for name in kind_names])[kind] * level[:, None]
    known, unit = (
        kalker_coefficients(ratio, MATERIAL_PAIR.nu),
        FRICTION_COEFFICIENT * NORMAL_LOAD / (MATERIAL_PAIR.G * MEAN_SEMI_AXIS**2),
    )
    scale = unit / np.stack([known.c11, known.c22, known.c23 * MEAN_SEMI_AXIS], axis=1)
    xi_x, xi_y, spin = (creepage_parts * scale).T
    a, b = MEAN_SEMI_AXIS * np.sqrt(ratio), MEAN_SEMI_AXIS / np.sqrt(ratio)
    return {
        "a": a,
        "b": b,
        "load": np.full(len(a), NORMAL_LOAD),
        "mu": np.full(len(a), FRICTION_COEFFICIENT),
        "xi_x": xi_x,
        "xi_y": xi_y,
        "spin": spin,
    }


def _relative_forces(contacts: ContactColumns, **fastsim_options: Any) -> Array:
    """Forces fx and fy (n, 2) divided by mu N."""
    answers = fastsim(RollingEllipse(**contacts), MATERIAL_PAIR, **fastsim_options)
    return np.stack([answers.fx, answers.fy], axis=1) / (FRICTION_COEFFICIENT * NORMAL_LOAD)


def _discretisation_rows() -> tuple[list[Row], dict[str, Any]]:
    """Rows and data on the discretisation: mean and largest error on every grid, and observed order of convergence."""
    columns = creepage_contacts(tuple(CREEPAGE_KINDS), CREEPAGE_LEVELS)
    rows: list[Row] = []
    data: dict[str, Any] = {}
    for bound in POWERS:
        truth = _relative_forces(columns, cells=FINE_CELLS, bound=bound)
        for march in ("second-order", "plain"):
            errors = [
                np.hypot(*(_relative_forces(columns, cells=n, bound=bound, march=march) - truth).T) for n in CELL_COUNTS
            ]
            data[f"{bound}, {march}"] = [[float(e.mean()), float(e.max())] for e in errors]
            if march == "plain":
                continue
            rows.append(
                Observed(
                    f"fastsim.cells.{bound}",
                    SYSTEM,
                    f"largest error of the force at 21 cells per strip, {bound} bound, {len(truth)} cases",
                    float(errors[1].max()),
                    "mu N",
                ).at_most(0.004, CELL_COUNT_REASON, "none")
            )
            mean = np.array([np.sqrt(np.mean(e**2)) for e in errors])
            order = float(np.log(mean[0] / mean[-1]) / np.log(CELL_COUNTS[-1] / CELL_COUNTS[0]))
            if bound == "parabolic":
                rows.append(
                    Observed(
                        "fastsim.order",
                        SYSTEM,
                        "shortfall of the observed order from 2, 11 to 81 cells per strip",
                        max(0.0, 2.0 - order),
                        "",
                    ).at_most(
                        0.2,
                        "order 1.8 or more; root mean square over all "
                        "cases, because single ones jump as cells begin to slip",
                        "none",
                    )
                )
    return rows, {"cells": data}


def _invariant_rows(batch_count: int, contact_count: int, first_random_stream: int) -> list[Row]:
    """Rows on invariants of the forces, over random contacts."""
    answers: dict[str, float] = {}
    for i in range(batch_count):
        options = COMPUTED_OPTIONS[i % len(COMPUTED_OPTIONS)]
        for name, value in worst_violation(
            random_contacts(SEED, first_random_stream + i, contact_count), options, MATERIAL_PAIR
        ).items():
            name += " coarse" if name == "power" and options.get("cells", 21) < 20 else ""
            answers[name] = max(answers.get(name, 0.0), value)
    what = {
        "finite": "results that are not finite",
        "bound": "excess of the force |F| above mu N",
        "moment": "moment beyond the sum of the traction's bound times the distance from the centre, "
        "over the longer semi-axis",
        "limit": "power that friction takes beyond that of full sliding, over the creepage",
        "reversal": "sum of the forces at creepages of opposite sign",
        "mirror": "difference of the forces from those of the contact mirrored in y",
        "power": "power that friction would give, over the creepage",
        "power coarse": "power that friction would give, over the creepage, 9 to 12 cells per strip",
        "zero": "force without load or creepage",
        "similarity": "difference of the forces at eight times the load and twice the size from the law of similarity",
        "stick": "excess of the share of stick beyond 0 to 1",
    }
    total = batch_count * contact_count
    return [
        Observed(
            f"fastsim.always.{name.replace(' ', '_')}",
            SYSTEM,
            f"{what[name]}, worst of {total:,} random contacts",
            value,
            "mu N",
        ).at_most(*INVARIANT_TOLERANCES.get(name, (SUM_ROUNDING, "rounding of some hundred sums")), "none")
        for name, value in answers.items()
    ]


def _creepage_limit_rows() -> list[Row]:
    """Rows: agreement with the linear theory at small creepages, and size and direction of the force in full
    sliding."""
    columns = creepage_contacts(("x", "y", "spin"), (1e-6,))
    answers = fastsim(RollingEllipse(**columns), MATERIAL_PAIR)
    linear = np.stack(
        linear_forces(columns["a"], columns["b"], columns["xi_x"], columns["xi_y"], columns["spin"], MATERIAL_PAIR)
    )
    size = np.hypot(linear[0], linear[1])
    slope = np.hypot(answers.fx - linear[0], answers.fy - linear[1]) / size
    sliding = creepage_contacts(("x", "y"), SLIDING_LEVELS)
    turn = np.random.default_rng((SEED, 999)).uniform(-np.pi, np.pi, len(sliding["a"]))
    most = np.hypot(sliding["xi_x"], sliding["xi_y"])
    sliding["xi_x"], sliding["xi_y"] = most * np.cos(turn), most * np.sin(turn)
    slid = fastsim(RollingEllipse(**sliding), MATERIAL_PAIR)
    slides = slid.stick == 0.0
    off = np.abs(np.angle(-(slid.fx + 1j * slid.fy) * np.exp(-1j * turn), deg=True))[slides].max()
    short = np.abs(np.hypot(slid.fx, slid.fy) / (FRICTION_COEFFICIENT * NORMAL_LOAD) - 1.0)[slides].max()
    return [
        Observed(
            "fastsim.slope",
            SYSTEM,
            "largest difference of the forces at a millionth of the linear scale from the linear theory",
            float(slope.max()),
            "of them",
        ).at_most(0.004, "error of 21 cells: strips of finite width", "closed form"),
        Observed(
            "fastsim.sliding.direction",
            SYSTEM,
            "angle between the force and the direction against the slip while all slides, "
            f"{slides.sum()} cases from where that begins",
            float(off),
            "deg",
        ).at_most(0.3, "one flexibility in full sliding makes it rounding; 0.3 asked for", "closed form"),
        Observed(
            "fastsim.sliding.size", SYSTEM, "difference of the force in full sliding from mu N", float(short), "mu N"
        ).at_most(SUM_ROUNDING, "pressures of the cells sum up to the load", "closed form"),
    ]


def _spin_moment_rows() -> list[Row]:
    """Rows: moment in full sliding under spin alone, on 21 cells, compared with the integral of mu times Hertz's
    pressure."""
    ratio = np.array(SPIN_AXIS_RATIOS)
    a, b = MEAN_SEMI_AXIS * np.sqrt(ratio), MEAN_SEMI_AXIS / np.sqrt(ratio)
    longer, shorter = np.maximum(a, b), np.minimum(a, b)
    most = FRICTION_COEFFICIENT * NORMAL_LOAD * 0.375 * longer * ellipe(1.0 - (shorter / longer) ** 2)
    rows = []
    for bound in POWERS:
        ellipse = RollingEllipse(a=a, b=b, load=NORMAL_LOAD, mu=FRICTION_COEFFICIENT, xi_x=0.0, xi_y=0.0, spin=1e5)
        spun = fastsim(ellipse, MATERIAL_PAIR, bound=bound)
        beyond = float(np.max(np.abs(spun.mz) / most - 1.0))
        what = f"moment of sliding about the centre beyond that of Hertz's pressure, {bound} bound, a/b 0.1 to 10"
        name = f"fastsim.spun.{bound}"
        rows.append(
            Observed(name, SYSTEM, what, beyond, "of it").aim(
                0.0,
                "Hertz's own pressure on 21 cells, whose sum errs "
                "by their area; the friction on the cells is never exceeded",
            )
            if bound == "elliptic"
            else Observed(name, SYSTEM, what, max(0.0, beyond), "of it").at_most(
                0.0, "pressures of these bounds lie closer to the centre", "closed form"
            )
        )
    return rows


def _force_derivative_rows() -> list[Row]:
    """Row: difference of the forces' analytic derivatives from central differences."""
    columns = creepage_contacts(tuple(CREEPAGE_KINDS), CREEPAGE_LEVELS)
    scale = {"xi_x": 1e-3, "xi_y": 1e-3, "spin": 1e-3 / MEAN_SEMI_AXIS, "load": NORMAL_LOAD}
    known, off = creep_force_derivatives(RollingEllipse(**columns), MATERIAL_PAIR), []
    for k, (name, unit) in enumerate(scale.items()):
        ends = [_forces_with_changed_input(columns, name, sign * 1e-6 * unit) for sign in (1.0, -1.0)]
        off.append(np.abs((ends[0] - ends[1]) / 2e-6 - known.slopes[..., k] * unit) / FORCE_SCALES)
    share = np.quantile(np.max(off, axis=(0, 2)), 0.98)
    return [
        Observed(
            "fastsim.derivatives",
            SYSTEM,
            "difference of the derivatives to creepages, spin and load from finite differences, 98 % "
            f"of {len(known.forces)} cases",
            float(share),
            "mu N, mu N c",
        ).at_most(
            1e-7,
            "differences over 2e-6 of a scale err by 1e-9; where a cell begins to slip within them forces jump",
            "none",
        )
    ]


def _forces_with_changed_input(contacts: ContactColumns, input_name: str, input_change: float) -> Array:
    """Forces and moments (n, 3) with one input changed by ``input_change``. If the load changes, the ellipse changes
    with the load."""
    moved = {**contacts, input_name: contacts[input_name] + input_change}
    if input_name == "load":
        grown = np.cbrt(moved["load"] / contacts["load"])
        moved |= {"a": contacts["a"] * grown, "b": contacts["b"] * grown}
    creep = fastsim(RollingEllipse(**moved), MATERIAL_PAIR)
    return np.stack([creep.fx, creep.fy, creep.mz], axis=1)


def _random_contact_rows() -> list[Row]:
    """Rows: error of the model on random contacts that were not used to calibrate it."""
    error = theory_errors("blended intermediate", read_drawn(JUDGED_PART)).error
    why = "exact theory with its cells' first order taken out, kept; the target of the regular set"
    return [
        Observed(
            f"fastsim.drawn.{name}",
            SYSTEM,
            f"{what} error of the model on {len(error)} contacts drawn at random",
            float(value),
            "mu N",
        ).at_most(most, why, "native")
        for name, what, value, most in (("mean", "mean", error.mean(), 0.02), ("max", "largest", error.max(), 0.09))
    ]


def _model_error_rows() -> tuple[list[Row], list[list[Any]]]:
    """Rows and table: error of the model relative to the exact theory on a converged grid, for every traction bound and
    kind of flexibility."""
    table, known = list[list[Any]](), read_contacts()
    for bound in POWERS:
        for kind in KINDS_OF_FLEXIBILITY:
            contacts = theory_errors(f"{kind} {bound}", known, CONVERGED_CELLS)
            errors = contacts.error, contacts.moment_error
            table.append([bound, kind, *(float(value) for e in errors for value in (e.mean(), e.max()))])
    why = "exact theory with its cells' first order taken out, kept; the case of the price solves some of them anew"
    what = f"error of the model against the exact theory, {len(contacts.error)} contacts of five ellipses"
    return [
        Observed("fastsim.model.mean", SYSTEM, f"mean {what}", table[0][2], "mu N").at_most(0.02, why, "native"),
        Observed("fastsim.model.max", SYSTEM, f"largest {what}", table[0][3], "mu N").at_most(0.09, why, "native"),
    ], table


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Tables of the errors by number of cells; a full run also has those of the model and the computing time."""
    rows = tuple(
        (name, *(f"{100 * mean:.2g} / {100 * most:.2g}" for mean, most in values))
        for name, values in case_data["cells"].items()
    )
    answers = [
        Table(
            "FASTSIM: error of the cells",
            "Mean / largest error of the force in % of mu N against "
            f"{FINE_CELLS} cells per strip, over all ellipses, kinds and levels of creepage.",
            ("bound, march", *(f"{n} cells" for n in CELL_COUNTS)),
            rows,
        )
    ]
    if "model" in case_data:
        answers.append(
            Table(
                "FASTSIM: error of the model",
                "Converged, against the exact theory: force in % of mu N, "
                "moment in % of mu N and the longer semi-axis.",
                ("bound", "flexibilities", "mean", "largest", "moment, mean", "moment, largest"),
                tuple((*row[:2], *(f"{100 * v:.2f}" for v in row[2:])) for row in case_data["model"]),
            )
        )
    if "speed" in case_data:
        answers.append(
            Table(
                "FASTSIM: price",
                "Beside the time that a root and a division per cell take on this "
                "machine, its lower bound: median of rounds with its 95 % interval.",
                ("what", "time", "time / bound"),
                tuple(tuple(row) for row in case_data["speed"]),
            )
        )
    return answers


def draw(case_data: dict[str, Any]) -> list[tuple[str, Any]]:
    """Plot the largest error over the number of cells."""
    from models.drawing.figures import COLUMN_WIDTH, add_heading, legend_below, subplots

    figure, axis = subplots(figsize=(COLUMN_WIDTH, 4.4))
    for i, (name, values) in enumerate(case_data["cells"].items()):
        axis.loglog(
            CELL_COUNTS,
            [100 * most for _, most in values],
            "o-" if "second" in name else "s--",
            color=f"C{i // 2}",
            label=name,
        )
    axis.axhline(0.4, color="black", linestyle=":", label="0.4 % asked for at 21")
    axis.set_xticks(CELL_COUNTS, [str(n) for n in CELL_COUNTS])
    axis.minorticks_off()
    axis.set(xlabel="cells per strip [-]", ylabel="largest error of the force [% of μN]")
    axis.set_yticks([0.01, 0.1, 0.4, 1, 10], ["0.01", "0.1", "0.4", "1", "10"])
    legend_below(figure, axis)
    add_heading(figure, "FASTSIM: the second-order march needs a tenth of the cells")
    return [("Largest error of FASTSIM's force over its cells, three bounds and both marches.", figure)]
