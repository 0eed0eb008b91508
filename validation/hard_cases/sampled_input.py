"""Hard cases of sampled input: which sample is read when, held against linear, roads with kinks, damaged files."""

import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from models.core.discretisation import Estimate, error_estimates_of, largest_estimate
from models.core.errors import InputError
from models.core.result import Result
from models.core.signals import SNAP_SHARE, SampledSignal
from models.core.time_series import write_time_series
from models.engines.protocol import build
from models.engines.stability import first_order, linearised_matrices
from models.road.continuation import road_with_run_in
from models.road.polyline import PolylineProfile
from models.road.profile import SplineProfile
from models.road.signal import RoadUnderWheels
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.run import run_with_drift
from models.systems.pitch_plane.scene import build as build_scene
from validation.hard_cases import setups
from validation.hard_cases.case import HardCase
from validation.hard_cases.setups import (
    RAISED,
    REFUSED,
    exact_states,
    largest_magnitude,
    run,
    run_settings,
    static_forces,
    vehicle,
)


def momentum_error(
    engine_name: str, interpolation: str, force_samples: np.ndarray, sample_period: float, time_step: float
) -> float:
    """Error of the momentum sum m z' against the exact impulse of the wheel forces, divided by the largest impulse."""
    base = vehicle("asymmetric_twin")
    forces = SampledSignal(force_samples, sample_period, held=interpolation == "held")
    steps = round((len(force_samples) - 1) * sample_period / time_step)
    path = run(engine_name, setups.driven_by_forces(base, forces), time_step, steps * time_step)
    p, stride = base.parameters, round(sample_period / time_step)
    masses = np.array([p.m1, p.m2, p.m3])
    total = force_samples.sum(axis=1)
    impulse_so_far = np.concatenate(([0.0], np.cumsum(total[:-1] * sample_period)))
    impulse = impulse_so_far if forces.held else impulse_so_far + sample_period * (total - total[0]) / 2
    truth = masses.sum() * p.g * sample_period * np.arange(len(force_samples)) - impulse
    return largest_magnitude(path.states[::stride, 4:7] @ masses - truth) / largest_magnitude(impulse)


def ramp_momentum_error(engine_name: str, work_folder: Path) -> float:
    """Case: forces that rise by 1 N per sample, so that a wrong sample shows. Error: that of ``momentum_error``."""
    values = np.add.outer(np.arange(1001.0), np.array([0.0, 100.0]))
    return max(momentum_error(engine_name, "held", values, period, period) for period in (1e-3, 2e-3))


def ramp_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: share of steps that read the wrong sample if the accumulated time is
    truncated."""
    shares = []
    for step in (1e-3, 2e-3, 5.5e-3):
        accumulated_times = np.cumsum(np.full(2000, step)) - step
        shares.append(np.mean((accumulated_times / step).astype(int) != np.arange(2000)))
    return (
        "int(t / dt) with accumulated t reads the wrong sample in "
        + ", ".join(f"{x:.0%}" for x in shares)
        + " of the steps of 1, 2 and 5.5 ms"
    )


def noise_impulse_error(engine_name: str, work_folder: Path) -> float:
    """Case: noisy wheel forces, held or interpolated between samples, with two steps per sample. Error: the larger
    ``momentum_error`` of the two."""
    values = 3800.0 + 800.0 * np.random.default_rng(3).standard_normal((251, 2))
    return max(momentum_error(engine_name, rule, values, 2e-3, 1e-3) for rule in ("held", "linear"))


def impulse_naive_result(work_folder: Path) -> str:
    """Difference of the final pitch between held and linearly interpolated forces, as text."""
    base = vehicle()
    values = static_forces(base, 1002, 2e-3, noise_deviation=800.0).values
    ends = [
        run("reference", setups.driven_by_forces(base, SampledSignal(values, 2e-3, is_held)), 1e-3, 2.0).states[-1, 3]
        for is_held in (True, False)
    ]
    return f"held and linear end {abs(ends[0] - ends[1]) / abs(ends[0]):.1%} apart in pitch: half a sample of shift"


def step_halving_ratio(engine_name: str, work_folder: Path) -> float:
    """Case: held noise sampled every 2 ms, in steps of 1 and 0.5 ms. Error: error of the finer steps, against the
    matrix exponential, divided by that of the coarser."""
    base = vehicle(geometry="linear")
    forces = static_forces(base, 250, 2e-3, noise_deviation=500.0)
    truth = exact_states(setups.driven_by_forces(base, forces), 2e-3, 250, forces.values)
    coarse, fine = (run(engine_name, setups.driven_by_forces(base, forces), h, 0.5).states for h in (1e-3, 5e-4))
    return largest_magnitude(fine[::4] - truth) / largest_magnitude(coarse[::2] - truth)


@dataclass(frozen=True)
class StageTimeSamples(SampledSignal):
    """Faulty held samples: every stage reads the sample at its time, so that the last stage of a step reads the next
    sample."""

    def sample(self, start_time: float, step: float, sample_count: int) -> np.ndarray:
        """Values (sample_count, channels) of the samples at start_time + i step."""
        periods = (start_time + step * np.arange(sample_count)) / self.period
        return self.values[np.floor(periods + SNAP_SHARE).astype(int).clip(0, len(self.values) - 1)]


def halving_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: pitch under a force that is read at the time of each stage."""
    base = vehicle(geometry="linear")
    values = static_forces(base, 251, 2e-3, noise_deviation=500.0).values
    truth = exact_states(setups.driven_by_forces(base, SampledSignal(values, 2e-3, True)), 2e-3, 250, values[:250])
    forces = StageTimeSamples(values, 2e-3, held=False)
    errors = [
        largest_magnitude(
            run("reference", setups.driven_by_forces(base, forces), h, 0.5).states[:: round(2e-3 / h)] - truth
        )
        for h in (1e-3, 5e-4)
    ]
    return f"looked up at each stage's time: error {errors[0]:.1e} at 1 ms, {errors[1]:.1e} at 0.5 ms, order 1"


@cache
def _profile_points() -> tuple[np.ndarray, np.ndarray]:
    """Positions and heights (m) of a smooth road every 0.237 m, none of which falls on a step."""
    s = 0.237 * np.arange(-20, 100)
    rise = np.clip(s / 3.0, 0, 1) ** 3
    return s, -0.02 * rise * np.sin(1.7 * s) - 0.004 * rise * np.sin(7.1 * s)


def observed_order(engine_name: str, road_profile: SplineProfile) -> float:
    """Observed order of convergence over steps of 2, 1 and 0.5 ms, from the largest state differences over 1 s."""
    base = vehicle()
    road = base.with_input("road", RoadUnderWheels(road_profile, 20.0, 2.0))
    runs = [run(engine_name, road, h, 1.0).states for h in (2e-3, 1e-3, 5e-4)]
    first, second = runs[1][::2] - runs[0], runs[2][::4] - runs[1][::2]
    return float(np.log2(largest_magnitude(first) / largest_magnitude(second)))


def lost_order_on_spline_road(engine_name: str, work_folder: Path) -> float:
    """Case: a road that is a C2 spline through its points. Error: 4 minus the observed order of convergence."""
    return max(0.0, 4.0 - observed_order(engine_name, SplineProfile.through(*_profile_points())))


def polyline_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: observed order on straight lines through the points."""
    observed = observed_order("reference", PolylineProfile.through(*_profile_points()))
    return f"straight lines through the same points: order {observed:.1f}"


def adaptive_noise_error(engine_name: str, work_folder: Path) -> float:
    """Case: an adaptive solver on held noise must restart at each sample, or be refused. Error: that of the states."""
    name = {"reference": "DOP853"}.get(engine_name, "DOPRI5")
    build_scene({"title": "", "run": {"duration": 0.2}, "engines": {engine_name: {"integrator": name}}})
    base = vehicle(geometry="linear")
    forces = static_forces(base, 200, 1e-3, noise_deviation=500.0)
    path = run(engine_name, setups.driven_by_forces(base, forces), 1e-3, 0.2, name)
    return largest_magnitude(
        path.states - exact_states(setups.driven_by_forces(base, forces), 1e-3, 200, forces.values)
    )


def noise_adaptive_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: error of scipy's RK45 that integrates across the jumps of noisy forces."""
    base = vehicle(geometry="linear")
    forces = static_forces(base, 200, 1e-3, noise_deviation=500.0)
    driven = setups.driven_by_forces(base, forces)
    linear = linearised_matrices(driven.vehicle)
    a, masses, g = first_order(linear), linear[0].diagonal(), base.parameters.g

    def rhs(t: float, y: np.ndarray) -> np.ndarray:
        u = forces.values[min(int(t / 1e-3), 199)]
        return a @ y + np.array([0, 0, 0, 0, g - u[0] / masses[0], g - u[1] / masses[1], g, 0])

    solution = solve_ivp(rhs, (0, 0.2), base.initial, rtol=1e-4, atol=1e-6)
    error = largest_magnitude(solution.y[:, -1] - exact_states(driven, 1e-3, 200, forces.values)[-1])
    return f"RK45 straight across the jumps: {solution.nfev} force calls for 200 samples, error {error:.0e}"


def state_from_damaged_file(engine_name: str, work_folder: Path) -> float:
    """Case: the 58th sample of a force file is NaN; it must be refused with its line. Error: largest state."""
    values = np.full(301, 3825.9)
    values[57] = np.nan
    write_time_series(work_folder / "forces.csv", {"front": ("N", values), "rear": ("N", values)}, 1e-3)
    effects = {"wheel_forces": {"file": "forces.csv", "interpolation": "held"}}
    scene = build_scene({"title": "", "run": {"duration": 0.2}, "effects": effects}, "scene.toml", work_folder)
    try:
        return largest_magnitude(simulate(scene, engine_name).states)
    except InputError as error:
        if "line 59" not in str(error):
            raise AssertionError(f"the line is not named: {error}") from error
        raise


def state_from_undetected_nan(engine_name: str, work_folder: Path) -> float:
    """Case: a NaN bypasses the file reader; the guard after the run must raise. Error: largest state."""
    base = vehicle()
    forces = static_forces(base, 200, 1e-3)
    forces.values[57, 0] = np.nan
    return largest_magnitude(run(engine_name, setups.driven_by_forces(base, forces), 1e-3, 0.2).states)


def state_with_uneven_steps(engine_name: str, work_folder: Path) -> float:
    """Case: steps of 0.7 ms with samples every 1 ms must be refused. Error: largest state."""
    base = vehicle()
    forces = static_forces(base, 211, 1e-3, noise_deviation=500.0)
    return largest_magnitude(run(engine_name, setups.driven_by_forces(base, forces), 0.7e-3, 0.21).states)


@cache
def _road_with_bump() -> RoadUnderWheels:
    """Road with a bump 50 mm high and 0.3 m long after 200 m of flat road, at 20 m/s."""
    station = 0.1 * np.arange(2300)
    height = -0.05 * np.exp(-(((station - 200.0) / 0.15) ** 2))
    return RoadUnderWheels(road_with_run_in(SplineProfile.through(station, height, "bump")), 20.0, 2.0)


def bump_error(engine_name: str, work_folder: Path) -> float:
    """Case: an adaptive solver, after ten seconds of flat road, must not step over a bump (MuJoCo has no adaptive
    solver). Error: relative difference of the largest pitch."""
    name = {"reference": "LSODA", "exudyn": "DOPRI5", "mujoco": "RK4"}[engine_name]
    assembly = vehicle().with_input("road", _road_with_bump())
    path = run(engine_name, assembly, 1e-3, 10.5, name)
    truth = run("reference", assembly, 5e-4, 10.5).states[:, 3]
    return abs(largest_magnitude(path.states[:, 3]) - largest_magnitude(truth)) / largest_magnitude(truth)


def bump_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: the bump by scipy's LSODA with default settings."""
    assembly = vehicle().with_input("road", _road_with_bump())
    model = build("reference", assembly, run_settings("reference", 5e-4, 10.5))
    solution = solve_ivp(
        lambda t, y: np.concatenate((y[4:], model.acceleration(t, y[:4], y[4:]))),
        (0.0, 10.5),
        assembly.initial,
        "LSODA",
        rtol=1e-6,
        atol=1e-9,
    )
    return f"LSODA ends 'successfully' after {len(solution.t) - 1} steps with a pitch of {pitch_text(solution.y)}"


def pitch_text(states: np.ndarray) -> str:
    """Text with the largest pitch (rad) of states (8, n)."""
    return f"{np.abs(states[3]).max():.0e} rad"


def run_over_waves(engine_name: str, time_step: float, with_error: bool = False) -> Result:
    """Run of the half car with stiffly damped tyres on the study road at 560 m/s for 0.2 s, in equal steps of at most
    ``time_step`` (s)."""
    damped = {"parameters": "itwm_drift", "override": {"d1": 3000.0, "d2": 3000.0}}
    run = {"duration": 0.2, "step": 0.2 / math.ceil(0.2 / time_step - 1e-9)}
    road = {"road": {"source": "study", "speed": 560.0}}
    scene = build_scene({"title": "", "vehicle": damped, "run": run, "effects": road})
    return run_with_drift(scene, engine_name, with_error)


def passed_waves_ratio(engine_name: str, work_folder: Path) -> float:
    """Case: the study road at 560 m/s in steps of 2 ms, or 1.1 m. Error: true error divided by the stated error;
    infinite unless the stated error is a warning, and the steps that the warnings name lead to a run without a
    warning."""
    stated_run = run_over_waves(engine_name, 2e-3, with_error=True)
    name, estimate = max(error_estimates_of(stated_run).items(), key=lambda each: each[1].share)
    cured: Estimate | None = estimate
    for _ in range(3):
        if cured and cured.warned:
            cured = largest_estimate(run_over_waves(engine_name, cured.step, with_error=True))
    if not estimate.warned or cured is None or cured.warned:
        return np.inf
    error_of_values = stated_run[name] - run_over_waves(engine_name, 1e-4)[name][::20]
    return float(np.sqrt(np.mean(error_of_values**2))) / estimate.error


def passed_waves_naive_result(work_folder: Path) -> str:
    """Result without the guard, as text: error of a run whose steps miss waves of the road, against steps that resolve
    every wave."""
    ends = [run_over_waves("reference", step)["z1_rate"][-1] for step in (2e-3, 1e-4)]
    return f"without its error the front wheel ends at {ends[0]:.2f} m/s, in steps of 0.1 ms at {ends[1]:.2f} m/s"


CASES = (
    HardCase(
        "replay of a ramp",
        "time accumulates rounding, so a truncated index slips by one sample",
        "sum m z' equals the impulse of the samples at every step",
        "of the impulse",
        1e-12,
        "a thousand additions of doubles",
        ramp_momentum_error,
        {},
        ramp_naive_result,
    ),
    HardCase(
        "held against linear",
        "the two rules differ by half a sample; each must conserve its own impulse",
        "sum m z' equals the impulse at every sample",
        "of the impulse",
        1e-12,
        "a thousand additions of doubles",
        noise_impulse_error,
        {},
        impulse_naive_result,
    ),
    HardCase(
        "samples belong to the recorder",
        "held samples must not move when the step is halved",
        "matrix exponential on the samples: the error falls with the step",
        "of the error at the double step",
        0.1,
        "order 4 gives 1/16; a force that is looked up per stage gives 1/2",
        step_halving_ratio,
        {},
        halving_naive_result,
    ),
    HardCase(
        "measured road between its points",
        "straight lines have a slope that jumps",
        "observed order 4 on the C2 road",
        "orders lost",
        0.5,
        "the third derivative still jumps at each point",
        lost_order_on_spline_road,
        {},
        polyline_naive_result,
        answer_independence="none",
    ),
    HardCase(
        "adaptive solver on held noise",
        "every sample is a jump that an error estimate takes for its own",
        "matrix exponential on the samples",
        "m, rad, m/s, rad/s",
        1e-6,
        "tolerance 1e-9, restarted at each sample",
        adaptive_noise_error,
        {"exudyn": "refused", "mujoco": "refused"},
        noise_adaptive_naive_result,
    ),
    HardCase(
        "bump after a long flat road",
        "an adaptive solver's steps grow while nothing happens, and it steps over what comes",
        "largest pitch of the reference at 0.5 ms",
        "of it",
        1e-2,
        "rows of an adaptive run miss the very peak; a bump that is missed is off by 1",
        bump_error,
        {},
        bump_naive_result,
    ),
    HardCase(
        "NaN in a force file",
        "numpy reads it and the solvers carry it on",
        "refused with its line",
        "",
        0.0,
        "there is no answer",
        state_from_damaged_file,
        REFUSED,
    ),
    HardCase(
        "NaN past the reader",
        "Exudyn's explicit solvers end 'successfully' with it",
        "raised",
        "",
        0.0,
        "there is no answer",
        state_from_undetected_nan,
        RAISED,
    ),
    HardCase(
        "step that does not divide the sampling period",
        "a held sample would change within a step",
        "refused",
        "",
        0.0,
        "there is no answer",
        state_with_uneven_steps,
        REFUSED,
    ),
    HardCase(
        "step over whole waves of the road",
        "at 2000 km/h a step of 2 ms goes 1.1 m and sees a wave of 0.5 m as another one; all implementations agree",
        "a warning or a refusal, whose steps end it, and the error beside steps of 0.1 ms by the one told",
        "of the error told",
        3.0,
        "an estimate by longer steps may be so wrong",
        passed_waves_ratio,
        {},
        passed_waves_naive_result,
    ),
)
