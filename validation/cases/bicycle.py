"""Whipple's bicycle: published figures, the limit of ideal rolling for stiff tyres, energy, and a measured bicycle."""

import os
from pathlib import Path
from typing import Any

import numpy as np

from models.bicycle.ideal_rolling import IdealBicycle
from models.bicycle.rolling_tyres import BicycleTyre, RollingBicycle
from models.bicycle.suspects import forecast_deviations, predicted_weave, ranked_suspects
from models.bicycle.weave import WeaveObservation, read_observations
from models.bicycle.whipple import SteeringControl, Whipple, load_bicycle
from models.core.errors import RunFailed
from models.identification.subsets import SubsetChoice
from models.systems.bicycle.run import engine_eigenvalues, run
from models.systems.bicycle.scene import build
from validation.common.bicycle_published import CAPSIZE_SPEED, PUBLISHED_EIGENVALUES, PUBLISHED_MATRICES, WEAVE_SPEED
from validation.common.rows import Observed, Row, System, Table, not_run

TITLE = "A bicycle: benchmark and measured"
SYSTEM: System = "rolling-vehicle"
ENGINE_NAMES = ("exudyn", "mujoco")
TYRE_STIFFNESS_FACTORS = (4.0, 16.0, 64.0, 256.0)
"""Factors by which the tyres are stiffer than usual."""
EIGENVALUE_SPEED = 5.0
"""Speed (m/s) at which eigenvalues of the bicycle on tyres are compared."""
MEASURED_FEEDBACK = SteeringControl(gain=2.0)
"""Feedback control of the measured bicycle."""
LOWEST_JUDGED_SPEED = 2.0
"""Lowest speed (m/s) at which the predicted weave damping, with nothing fitted, must meet the measured one."""
PLANTED_TRAIL_FACTOR = 1.001
"""Factor on the trail in the planted fault."""


def measure(quick: bool, work_folder: Path) -> tuple[list[Row], dict[str, Any]]:
    """Rows: published figures, the limit of ideal rolling, energy, and the measured bicycle. A quick run simulates half
    a second, and omits the predictions with one speed left out."""
    benchmark = load_bicycle("benchmark")
    rows = [*_published_benchmark_rows(benchmark), *_planted_fault_rows(benchmark)]
    gaps = {engine: _eigenvalue_differences(benchmark, engine) for engine in ENGINE_NAMES}
    rows += [*_stiff_tyre_limit_rows(gaps), *_energy_rows(0.5 if quick else 5.0)]
    measured_rows, data = _measured_bicycle_rows(quick)
    return [*rows, *measured_rows], {"gaps": {e: g.tolist() for e, g in gaps.items()}, "measured": data}


def tables(case_data: dict[str, Any]) -> list[Table]:
    """Tables of eigenvalues on tyres of rising stiffness, and of the measured bicycle if its recordings exist."""
    gaps = case_data["gaps"][ENGINE_NAMES[0]]
    rows_of_tables = [
        Table(
            "Tyres that stiffen tend to ideal rolling",
            f"Largest distance (1/s) of the benchmark's eigenvalues at {EIGENVALUE_SPEED:g} m/s from those of ideal "
            "rolling.",
            ("stiffness", *ENGINE_NAMES, "order"),
            tuple(
                (
                    f"{s:g}",
                    *(f"{case_data['gaps'][e][i]:.3e}" for e in ENGINE_NAMES),
                    "" if i == 0 else _convergence_order_text(gaps, i),
                )
                for i, s in enumerate(TYRE_STIFFNESS_FACTORS)
            ),
        )
    ]
    if case_data["measured"]:
        headings = ("speed", "damping", "nothing fitted", "frequency", "nothing fitted", "chosen without this speed")
        rows_of_tables.append(
            Table(
                "Weave of a measured bicycle",
                "Damping (1/s) and frequency (rad/s) with the windows' scatter; last, deviations in standard ones.",
                headings,
                tuple(map(tuple, case_data["measured"])),
            )
        )
    return rows_of_tables


def _convergence_order_text(eigenvalue_gaps: list[float], stiffness_index: int) -> str:
    """Text of the order at which the eigenvalue differences fall from stiffness i - 1 to stiffness i."""
    stiffer = TYRE_STIFFNESS_FACTORS[stiffness_index] / TYRE_STIFFNESS_FACTORS[stiffness_index - 1]
    return f"{np.log(eigenvalue_gaps[stiffness_index - 1] / eigenvalue_gaps[stiffness_index]) / np.log(stiffer):.3f}"


def _published_benchmark_rows(bicycle: Whipple) -> list[Row]:
    """Rows: matrices, eigenvalues and critical speeds of the benchmark bicycle compared with the published ones."""
    M, C1, K0, K2 = bicycle.linear
    matrices = zip((M, C1, bicycle.gravity * K0, K2), PUBLISHED_MATRICES.values(), strict=True)
    off = max(float(np.abs(here - there).max()) for here, there in matrices)
    values = max(float(np.abs(bicycle.eigenvalues(v) - there).max()) for v, there in PUBLISHED_EIGENVALUES.items())
    critical = max(abs((bicycle.weave_speed or 0.0) - WEAVE_SPEED), abs((bicycle.capsize_speed or 0.0) - CAPSIZE_SPEED))
    published_values = (
        ("matrices", "M, C1, g K0, K2 of the benchmark bicycle: largest difference", off, "kg m^2 and so on"),
        ("eigenvalues", "eigenvalues at 0 to 10 m/s: largest difference", values, "1/s"),
        ("speeds", "weave and capsize speed: larger difference", critical, "m/s"),
    )
    why = "printed to 14 digits or more; rounding of the largest entries is 1e-13"
    return [
        Observed(f"bicycle.published.{key}", SYSTEM, quantity, value, unit).at_most(1e-12, why, "published")
        for key, quantity, value, unit in published_values
    ]


def _planted_fault_rows(bicycle: Whipple) -> list[Row]:
    """Row: a trail that is 0.1 % longer must change an eigenvalue by far more than the tolerance of the published
    figures."""
    wrong = bicycle.changed(trail=PLANTED_TRAIL_FACTOR * bicycle.trail)
    caught = float(np.abs(wrong.eigenvalues(EIGENVALUE_SPEED) - PUBLISHED_EIGENVALUES[EIGENVALUE_SPEED]).max())
    quantity = (
        "trail a thousandth longer: largest change of an eigenvalue by what the published figures allow (1e-12 1/s)"
    )
    seen = Observed("bicycle.published.fault", SYSTEM, quantity, min(caught / 1e-12, 1e6), "")
    return [seen.within(1e6, 1e-3, "a planted fault must be seen by far; counted up to a million", "closed form")]


def _eigenvalue_differences(bicycle: Whipple, engine_name: str) -> np.ndarray:
    """Largest difference (1/s) between the eigenvalues on tyres and those of ideal rolling, for each tyre stiffness."""
    wanted = bicycle.eigenvalues(EIGENVALUE_SPEED)
    stiff = [RollingBicycle(bicycle, BicycleTyre(stiffness=s)) for s in TYRE_STIFFNESS_FACTORS]
    return np.array(
        [np.abs(engine_eigenvalues(engine_name, rolling, EIGENVALUE_SPEED) - wanted).max() for rolling in stiff]
    )


def _stiff_tyre_limit_rows(eigenvalue_gaps: dict[str, np.ndarray]) -> list[Row]:
    """Rows on the limit of stiff tyres: order of convergence in each engine, and difference between the engines."""
    rows = []
    for engine, gap in eigenvalue_gaps.items():
        order = np.log(gap[-2] / gap[-1]) / np.log(TYRE_STIFFNESS_FACTORS[-1] / TYRE_STIFFNESS_FACTORS[-2])
        rows.append(
            Observed(
                f"bicycle.tyres.order.{engine}",
                SYSTEM,
                f"{engine}: order by which eigenvalues on tyres of stiffness s tend to those of ideal rolling",
                float(order),
                "",
            ).within(1.0, 0.02, "side slip, trail and patch fall as 1 / s; what is left is of order 2", "closed form")
        )
    between = float(np.abs(eigenvalue_gaps["exudyn"] / eigenvalue_gaps["mujoco"] - 1.0).max())
    rows.append(
        Observed(
            "bicycle.tyres.engines",
            SYSTEM,
            "distance of eigenvalues on tyres from ideal rolling: largest relative difference of the engines",
            between,
            "",
        ).at_most(1e-4, "differences over 2e-7 of accelerations that stiff tyres make large", "shared kernel")
    )
    return rows


def _energy_rows(duration: float) -> list[Row]:
    """Rows: change of energy in a run with ideal rolling, energy balance in runs on tyres, and a planted fault of
    gravity."""
    table = {"title": "benchmark run", "system": "bicycle", "run": {"duration": duration}}
    scene, rows = build(table), []
    for engine in ("reference", *ENGINE_NAMES):
        try:
            gap = run(scene, engine).detail.unaccounted()
        except RunFailed:
            gap = float("nan")
        kept_quantity = "energy" if engine == "reference" else "energy less work of the tyres"
        rows.append(
            Observed(
                f"bicycle.energy.{engine}",
                SYSTEM,
                f"{engine}, from 4.6 m/s upright with 0.5 rad/s of lean rate, {duration:g} s: largest change of "
                f"{kept_quantity}",
                gap,
                "",
            ).at_most(1e-8, "relative to the energy at the start; no integrator here may lose more", "none")
        )
    plain = IdealBicycle(load_bicycle("benchmark").changed(gravity=9.80))
    q = IdealBicycle(load_bicycle("benchmark")).upright(4.6, 0.5)
    moved = abs(
        plain.energy(q[:9], np.zeros(9)) / IdealBicycle(load_bicycle("benchmark")).energy(q[:9], np.zeros(9)) - 1
    )
    seen = Observed("bicycle.energy.fault", SYSTEM, "gravity 0.1 % off: change of the potential energy", moved, "")
    return [*rows, seen.within(1.019e-3, 1e-5, "the ledger sees a planted fault a hundred thousand times", "none")]


def _measured_bicycle_rows(quick: bool) -> tuple[list[Row], list[list[str]]]:
    """Rows on the measured bicycle: predictions with nothing fitted, and predictions for each speed with parameters
    that were chosen and fitted on the other speeds."""
    root = os.environ.get("TWINRIG_DATA")
    folder = Path(root) / "bicycle" if root else None
    if folder is None or not (folder / "windows.csv").is_file():
        why = "TWINRIG_DATA names no folder with bicycle/windows.csv"
        return [not_run("bicycle.measured", SYSTEM, "weave of a measured bicycle", why)], []
    bicycle, seen = load_bicycle("steer_by_wire"), read_observations(folder)
    rows, table = [], []
    for observation in seen:
        rows += _unfitted_prediction_rows(bicycle, observation)
        by = (
            None
            if quick
            else ranked_suspects(bicycle, MEASURED_FEEDBACK, [other for other in seen if other is not observation])
        )
        rows += [] if by is None else _fitted_prediction_rows(bicycle, by, observation)
        table.append(_weave_table_line(bicycle, by, observation))
    return [*rows, *_suspect_parameter_rows(ranked_suspects(bicycle, MEASURED_FEEDBACK, seen))], table


def _unfitted_prediction_rows(bicycle: Whipple, weave_observation: WeaveObservation) -> list[Row]:
    """Rows: weave at one speed predicted with nothing fitted, compared with the measured one."""
    model, mean, deviation = (
        predicted_weave(bicycle, MEASURED_FEEDBACK, weave_observation),
        weave_observation.mean,
        weave_observation.deviation,
    )
    at = f"{weave_observation.speed:g} m/s, {len(weave_observation.weave)} windows"
    damping = Observed(
        f"bicycle.measured.damping.{weave_observation.speed:g}",
        SYSTEM,
        f"weave damping at {at}, nothing fitted: deviation by the measured {-mean[0]:.2f} +- {deviation[0]:.2f} 1/s",
        float(model[0] / mean[0] - 1.0),
        "",
    )
    frequency = Observed(
        f"bicycle.measured.frequency.{weave_observation.speed:g}",
        SYSTEM,
        f"weave frequency at {at}, nothing fitted: deviation by the measured {mean[1]:.2f} +- {deviation[1]:.2f} rad/s",
        float(model[1] / mean[1] - 1.0),
        "",
    )
    why = "parameters and feedback as published, no number fitted"
    judged = (
        damping.at_most(0.1, why, "measured")
        if weave_observation.speed >= LOWEST_JUDGED_SPEED
        else damping.beside(0.0, why, "measured")
    )
    return [judged, frequency.beside(0.0, f"{why}; judged after the choice of suspects", "measured")]


def _fitted_prediction_rows(
    bicycle: Whipple, parameter_choice: SubsetChoice, weave_observation: WeaveObservation
) -> list[Row]:
    """Rows: weave at one speed predicted with parameters fitted to the other speeds, compared with the measured one."""
    gaps = forecast_deviations(bicycle, MEASURED_FEEDBACK, parameter_choice, weave_observation)
    why = (
        "scatter of the windows and error of the forecast; suspects chosen and fitted on the other speeds, by weights "
        "that were settled with all of these speeds in sight"
    )
    return [
        Observed(
            f"bicycle.chosen.{name}.{weave_observation.speed:g}",
            SYSTEM,
            f"weave {name} at {weave_observation.speed:g} m/s by suspects chosen on the other speeds: "
            "standard deviations off",
            float(gap),
            "",
        ).at_most(2.0, why, "measured")
        for name, gap in zip(("damping", "frequency"), gaps, strict=True)
    ]


def _suspect_parameter_rows(parameter_choice: SubsetChoice) -> list[Row]:
    """Rows: for each parameter that the experimenters suspected, the p value of the F test of leaving the parameter
    out."""
    parameters_text = ", ".join(
        f"{name} {value:.3g}"
        for name, value in zip(parameter_choice.best_subset.names, parameter_choice.best_subset.values, strict=True)
    )
    return [
        Observed(
            f"bicycle.suspects.{key}",
            SYSTEM,
            f"chance of leaving {suspect} out; best subset: {parameters_text}",
            parameter_choice.removal_tests[name][1],
            "",
        ).at_most(0.05, "F test against the fullest subset that can be told apart", "measured")
        for key, suspect, name in (
            ("friction", "friction of the steering", "friction of either kind"),
            ("speed_gain", "the speed sensor's gain", "speed_gain"),
            ("speed_bias", "the speed sensor's bias", "speed_bias"),
        )
        if name in parameter_choice.removal_tests
    ]


def _weave_table_line(
    bicycle: Whipple, parameter_choice: SubsetChoice | None, weave_observation: WeaveObservation
) -> list[str]:
    """Line of the table of measured and predicted weave at one speed."""
    model, mean, deviation = (
        predicted_weave(bicycle, MEASURED_FEEDBACK, weave_observation),
        weave_observation.mean,
        weave_observation.deviation,
    )
    gaps = (
        np.empty(0)
        if parameter_choice is None
        else forecast_deviations(bicycle, MEASURED_FEEDBACK, parameter_choice, weave_observation)
    )
    return [
        f"{weave_observation.speed:g} m/s",
        f"{-mean[0]:.2f} +- {deviation[0]:.2f}",
        f"{-model[0]:.2f}",
        f"{mean[1]:.2f} +- {deviation[1]:.2f}",
        f"{model[1]:.2f}",
        " and ".join(f"{gap:+.2f}" for gap in gaps),
    ]
