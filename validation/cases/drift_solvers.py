"""What drift depends on: solver and tolerance, interpolation, smoothing, and the order of the integration scheme.

The paper remarks that drift does not depend on the solver, and that smoothing or better schemes only rescale the
error. Here the error of the interpolation between the samples stands apart from that of the integrator: the first
one is what the drift of the undisturbed run comes from, and every accurate solver reads the same samples.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from models.core.noise import normal_samples
from models.core.result import Result
from models.core.signals import SampledSignal
from models.drift.growth import pitch_rate_of_forces, pitch_variance, rigid_pitch, sinh_law_rate
from models.drift.score import section_forces
from models.engines.assembly import Assembly, Settings
from models.engines.protocol import build
from models.fatigue.damage import damage_ratio
from models.systems.pitch_plane.scene import assembly_of_scene
from models.systems.pitch_plane.trust import GrowthCurve
from models.vehicles.pitch_plane_equations import suspension_loads
from validation.common.rows import CaseAnswer, Observed, Row, Saved, System, Table
from validation.common.scenes import force_scene, on_paper_road, virtual_drive

TITLE = "What drift depends on: samples and noise, not solvers"
SYSTEM: System = "drift"
SEED = 14
SAMPLING_RATE, DURATION = 50.0, 15.0
"""Sampling rate (Hz) and length (s) of the runs by solver; the samples are few because adaptive solvers restart at
each."""
COMPARED_SOLVERS = (
    ("reference", "RK4", 1e-3),
    ("reference", "RK4", 5e-4),
    ("reference", "DOP853", 1e-6),
    ("reference", "DOP853", 1e-9),
    ("reference", "LSODA", 1e-6),
    ("reference", "LSODA", 1e-9),
    ("reference", "Radau", 1e-4),
    ("reference", "Radau", 1e-6),
    ("exudyn", "RK44", 1e-3),
    ("exudyn", "RK44", 5e-4),
    ("exudyn", "DOPRI5", 1e-5),
    ("exudyn", "DOPRI5", 1e-8),
    ("exudyn", "GeneralizedAlpha", 5e-4),
    ("exudyn", "GeneralizedAlpha", 2.5e-4),
    ("mujoco", "RK4", 1e-3),
    ("mujoco", "RK4", 5e-4),
)
"""Engine, method, and step (s) of a fixed-step method or relative tolerance of an adaptive one. LSODA is Adams' and the
BDF methods.

DOPRI5 steps over the kinks of the samples, and rounding decides which of its steps it rejects: changes of the tolerance
by 1e-9 of itself move its drift-off by 0.5 % at 1e-7, which is TIGHT_TOLERANCE, and by 0.02 % at 1e-8.
"""
TIGHT_TOLERANCE, LOOSE_TOLERANCE = 0.005, 0.1
"""Allowed difference of drift-off times divided by the time of the first solver. LOOSE_TOLERANCE holds for solver
tolerances of 1e-5 and above, whose error is as large as that of the samples."""
ADAPTIVE_METHODS = ("DOP853", "LSODA", "Radau", "DOPRI5")
FORCE_NOISE, NOISE_SAMPLING_RATE, NOISY_SECONDS = 30.7, 1000.0, 8.0
"""Standard deviation (N) of the noise on each force sample, the sampling rate (Hz), and the length (s) of the noisy
runs with and without smoothing."""
LOW_PASS_CUTOFFS = (5.0, 15.0, 50.0)
"""Cut-off frequencies (Hz) of the low-pass filter that smooths the forces before the run."""
INTEGRATION_SCHEMES = (("ExplicitEuler", 1, 2.5e-4), ("ExplicitMidpoint", 2, 1e-3), ("RK44", 4, 1e-3))
"""Exudyn's methods, with order and step (s). Forces that were smoothed before the run are integrated by the reference's
RK4, which equals Exudyn's RK44 to rounding."""
NOISE_PATH_COUNT = 20
GROWTH_WINDOW = (4.0, 8.0)
"""Times (s) between which the growth of the spread is measured: after the start, before the pitch tumbles."""
DAMAGE_SECONDS = 5.0
"""Time (s) up to which section forces are compared, before drift-off."""


@on_paper_road()
def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows on the drift-off times of solvers and interpolations, and on growth and damage with smoothing and
    integration schemes; a quick run has four solvers."""
    solvers = _drift_records_by_solver(
        work_folder, (*COMPARED_SOLVERS[:2], *COMPARED_SOLVERS[-2:]) if quick else COMPARED_SOLVERS
    )
    rows = _solver_rows(solvers)
    if quick:
        return rows, {"solvers": solvers, "smoothing": []}
    smoothing = _treatment_records(work_folder)
    return rows + _smoothing_rows(smoothing), {"solvers": solvers, "smoothing": smoothing}


def _drift_records_by_solver(work_folder: Path, solvers: Any) -> list[Saved]:
    """Drift-off time (s) and final pitch error (rad) of each solver under three inputs: linear samples, smooth samples,
    and noisy linear samples.

    Every solver takes the undisturbed linear samples. Only the half with the tighter tolerances takes the smooth ones,
    and only fixed-step solvers of this half take the noise.
    """
    true = virtual_drive(work_folder, DURATION, 1 / SAMPLING_RATE, 2.5e-4)
    noise = {"force_noise": {"deviation": FORCE_NOISE, "seed": SEED}}
    drifted = []
    tight = solvers[1::2]
    fixed = tuple(solver_record for solver_record in tight if solver_record[1] not in ADAPTIVE_METHODS)
    inputs: tuple[tuple[str, str, Saved, Any], ...] = (
        ("linear", "linear", {}, solvers),
        ("smooth", "smooth", {}, tight),
        ("noisy", "linear", noise, fixed),
    )
    for name, rule, effects, chosen in inputs:
        scene = force_scene(work_folder, step=1e-3, duration=DURATION, interpolation=rule, effects=effects)
        assembly = assembly_of_scene(scene)
        for engine, method, value in chosen:
            solver = {"engine": engine, "method": method, "value": value, "input": name}
            drifted.append(solver | _drift_of_run(assembly, engine, method, value, true))
    return drifted


def _drift_of_run(
    assembly: Assembly, engine_name: str, integration_method: str, step_or_tolerance: float, true_run: Result
) -> dict[str, float]:
    """Drift-off time (s) of a run (its duration if it does not drift off), and its final pitch error (rad)."""
    settings = Settings(integration_method, step_or_tolerance, DURATION)
    if integration_method in ADAPTIVE_METHODS:
        settings = Settings(
            integration_method, 1e-3 if engine_name == "reference" else 5e-3, DURATION, step_or_tolerance
        )
    run = build(engine_name, assembly, settings).run()
    error = np.abs(run.states[:, 3] - np.interp(run.times, true_run.times, true_run["pitch"]))
    time = GrowthCurve(run.times, error).passing_time()
    return {"drift-off": DURATION if time is None else time, "error": float(error[-1])}


def _treatment_records(work_folder: Path) -> list[Saved]:
    """For each smoothing filter and each integration scheme, with the same noise: growth rate of the pitch's standard
    deviation, and damage ratio of the section forces."""
    true = virtual_drive(work_folder, NOISY_SECONDS, 1 / NOISE_SAMPLING_RATE, 2.5e-4)
    quiet = assembly_of_scene(force_scene(work_folder, step=1e-3, duration=NOISY_SECONDS))
    treatments = [
        _treatment_record(f"low-pass {cutoff:g} Hz, order 4", true, quiet, cutoff, "reference", "RK4", 1e-3)
        for cutoff in LOW_PASS_CUTOFFS
    ]
    return treatments + [
        _treatment_record(f"not smoothed, order {order}", true, quiet, None, "exudyn", method, step)
        for method, order, step in INTEGRATION_SCHEMES
    ]


def _treatment_record(
    treatment_name: str,
    true_run: Result,
    noise_free_assembly: Assembly,
    cutoff_frequency: float | None,
    engine_name: str,
    integration_method: str,
    time_step: float,
) -> Saved:
    """Growth rate of the pitch's standard deviation and damage ratios for one smoothing filter or integration
    scheme."""
    forces = noise_free_assembly.input
    assert isinstance(forces, SampledSignal)
    settings = Settings(integration_method, time_step, NOISY_SECONDS)
    clean = _noisy_states(engine_name, noise_free_assembly, forces.values, cutoff_frequency, settings)
    rows = np.rint(np.array(GROWTH_WINDOW) / time_step).astype(int)
    spread = np.zeros(2)
    for path in range(NOISE_PATH_COUNT):
        noise = FORCE_NOISE * normal_samples(SEED, path, len(forces.values), 2)
        spread += (
            _noisy_states(engine_name, noise_free_assembly, forces.values + noise, cutoff_frequency, settings)[rows, 3]
            - clean[rows, 3]
        ) ** 2
    spread, law = (
        np.sqrt(spread / NOISE_PATH_COUNT),
        _pitch_deviation_law(_low_passed_forces(forces.values, cutoff_frequency), noise_free_assembly),
    )
    growth, expected = (
        float(np.log(record_of_run[1] / record_of_run[0]) / np.diff(GROWTH_WINDOW)[0])
        for record_of_run in (spread, law)
    )
    return {
        "name": treatment_name,
        "law": expected,
        "growth": growth,
        "spread": float(spread[1]),
        **_damage_ratios(clean[:: round(1e-3 / time_step)], true_run, noise_free_assembly),
    }


def _noisy_states(
    engine_name: str,
    assembly: Assembly,
    force_samples: np.ndarray,
    cutoff_frequency: float | None,
    solver_settings: Settings,
) -> np.ndarray:
    """States (n, 8) of a run under force samples (n, 2), which are low-passed before the run if ``cutoff_frequency``
    (Hz) is given."""
    forces = SampledSignal(_low_passed_forces(force_samples, cutoff_frequency), 1 / NOISE_SAMPLING_RATE, held=False)
    return build(engine_name, replace(assembly, input=forces), solver_settings).run().states


def _low_passed_forces(force_samples: np.ndarray, cutoff_frequency: float | None) -> np.ndarray:
    """Samples filtered by a Butterworth low-pass of order 4, which runs forward and backward and so causes no delay;
    unchanged without a cut-off."""
    if cutoff_frequency is None:
        return force_samples
    from scipy.signal import butter, sosfiltfilt

    return sosfiltfilt(butter(4, cutoff_frequency, fs=NOISE_SAMPLING_RATE, output="sos"), force_samples, axis=0)


def _damage_ratios(states: np.ndarray, true_run: Result, assembly: Assembly) -> dict[str, float]:
    """Damage of the front section force divided by the true damage, for both components, without noise and before
    drift-off."""
    end = round(DAMAGE_SECONDS * NOISE_SAMPLING_RATE)
    wanted = section_forces(*(true_run[name][::4][:end] for name in ("f3", "f4", "pitch")))
    f3, f4, _ = suspension_loads(states[:end].T, assembly.parameters, "exact")
    loads = section_forces(f3, f4, states[:end, 3])
    return {f"damage {name}": damage_ratio(loads[name], wanted[name]) for name in ("f3x", "f3z")}


def _pitch_deviation_law(smoothed_forces: np.ndarray, assembly: Assembly) -> np.ndarray:
    """Standard deviation (2,) of the pitch in rad at the two times of GROWTH_WINDOW by the closed law, computed from
    the smoothed forces (n, 2)."""
    p, period = assembly.parameters, 1 / NOISE_SAMPLING_RATE
    rates = sinh_law_rate(pitch_rate_of_forces(smoothed_forces, period, p), period, p)
    at = np.rint(np.array(GROWTH_WINDOW) / period).astype(int)
    return np.sqrt(
        pitch_variance(np.array(GROWTH_WINDOW), rates[at], rigid_pitch(p).noise_intensity(FORCE_NOISE, period))
    )


def _solver_rows(solver_records: list[Saved]) -> list[Row]:
    """Rows on the drift-off times of the solvers, and on the pitch errors of both interpolations."""
    rows = []
    for name in ("linear", "noisy"):
        of_input = [solver_record for solver_record in solver_records if solver_record["input"] == name]
        first = of_input[0]["drift-off"]
        for solver_record in of_input[1:]:
            solver = f"{solver_record['engine']} {solver_record['method']} {solver_record['value']:g}"
            rows.append(
                Observed(
                    f"drift_solvers.{name}.{solver.replace(' ', '.')}",
                    SYSTEM,
                    f"ratio of the drift-off time of the {name} run to that of the first solver "
                    f"({first:.2f} s), {solver}",
                    solver_record["drift-off"] / first,
                    "",
                ).within(
                    1.0,
                    LOOSE_TOLERANCE
                    if solver_record["value"] >= 1e-5 and solver_record["method"] in ADAPTIVE_METHODS
                    else TIGHT_TOLERANCE,
                    "the samples make the error, so accurate solvers agree; a loose tolerance adds to it",
                    "native",
                )
            )
    smooth = [solver_record["error"] for solver_record in solver_records if solver_record["input"] == "smooth"]
    linear = solver_records[0]["error"]
    return [
        *rows,
        Observed(
            "drift_solvers.interpolation",
            SYSTEM,
            "ratio of pitch errors at the end: largest of accurate solvers with samples joined by a "
            "spline, to the reference with straight lines",
            max(smooth) / linear,
            "",
        ).within(0.0, 0.2, "interpolation is what drifts", "native"),
    ]


def _smoothing_rows(treatment_records: list[Saved]) -> list[Row]:
    """Rows: with every smoothing and scheme, the pitch's standard deviation grows by the closed law of the smoothed
    forces."""
    rows = []
    for smoothing_record in treatment_records:
        key = smoothing_record["name"].replace(" ", "-").replace(",", "")
        rows += [
            Observed(
                f"drift_solvers.growth.{key}",
                SYSTEM,
                f"ratio of the growth of the pitch's spread from {GROWTH_WINDOW[0]:g} to {GROWTH_WINDOW[1]:g} s to "
                f"the closed law, {smoothing_record['name']}",
                smoothing_record["growth"] / smoothing_record["law"],
                "",
            ).within(
                1.0, 0.1, f"the same {NOISE_PATH_COUNT} noise files in all; their own chance is 3 %", "closed form"
            )
        ]
        for axis, what in (
            (
                "f3z",
                "ratio of the damage of the front section force, body z, to the true damage, "
                f"{smoothing_record['name']}, no noise",
            ),
            (
                "f3x",
                "ratio of the damage of the front section force, body x, to the true damage, "
                f"{smoothing_record['name']}, no noise",
            ),
        ):
            id, damage = f"drift_solvers.bias.{key}.{axis}", smoothing_record[f"damage {axis}"]
            rows.append(Observed(id, SYSTEM, what, damage, "").beside("1", "what smoothing takes away", "none"))
    return rows


def tables(case_data: Saved) -> list[Table]:
    """Tables of the drift-off by solver, and of the effects of smoothing and integration scheme."""
    rows = tuple(
        (
            solver_record["input"],
            solver_record["engine"],
            solver_record["method"],
            f"{solver_record['value']:g}",
            _drift_off_text(solver_record),
            f"{solver_record['error']:.2e}",
        )
        for solver_record in case_data["solvers"]
    )
    note = (
        f"Study road at 20 m/s, {SAMPLING_RATE:g} Hz, {DURATION:g} s. Value: step (s), or relative tolerance of "
        "an adaptive "
        f"solver. Linear and smooth: undisturbed; noisy: {FORCE_NOISE} N, linear."
    )
    heads = ("input", "engine", "method", "value", "drift-off [s]", "pitch error at the end [rad]")
    tables = [Table("Drift-off by solver and interpolation", note, heads, rows)]
    if case_data["smoothing"]:
        shown = {"growth": ".3f", "law": ".3f", "spread": ".4f", "damage f3z": ".3f", "damage f3x": ".3f"}
        lines = tuple(
            (solver_record["name"], *(f"{solver_record[name]:{form}}" for name, form in shown.items()))
            for solver_record in case_data["smoothing"]
        )
        columns = (
            "treatment",
            "growth of the spread [1/s]",
            "law [1/s]",
            f"spread at {GROWTH_WINDOW[1]:g} s [rad]",
            "damage f3z / true damage",
            "damage f3x / true damage",
        )
        about = (
            f"{NOISE_PATH_COUNT} noise files of {FORCE_NOISE} N at {NOISE_SAMPLING_RATE:g} Hz; damage without noise, "
            f"first {DAMAGE_SECONDS:g} s, front section force in the chassis' frame."
        )
        tables.append(Table("Smoothing before the run, and schemes", about, columns, lines))
    return tables


def _drift_off_text(solver_record: Saved) -> str:
    """Text of a solver's drift-off time; "never" if the run does not drift off."""
    return "never" if solver_record["drift-off"] >= DURATION else f"{solver_record['drift-off']:.2f}"
