"""Hard cases of time steps: at and beyond the stability limit, resets, sudden loads, repeated and continued runs, times
of adaptive runs."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np

from models.core.signals import SampledSignal
from models.engines import exudyn as exudyn_engine
from models.engines import mujoco as mujoco_engine
from models.engines.exudyn_system import solve
from models.engines.mujoco_quiet import without_warnings
from models.engines.protocol import build
from models.systems.pitch_plane.scene import build as build_scene
from validation.hard_cases.case import IMPLEMENTATIONS, HardCase
from validation.hard_cases.setups import (
    CONSTRAINED_INTEGRATORS,
    IMPLICIT_INTEGRATORS,
    RAISED,
    REFUSED,
    driven_by_forces,
    exact_decay,
    exact_states,
    largest_magnitude,
    run,
    run_settings,
    static_forces,
    tight_solution,
    unchecked_run,
    vehicle,
)

ROAD_EFFECT = {"road": {"source": "study", "speed": 20.0}}
EULER_INTEGRATORS = {"reference": "RK4", "exudyn": "ExplicitEuler", "mujoco": "Euler"}


def _displaced_vehicle(geometry: str = "linear"):
    """The vehicle with its front wheel displaced by 1 mm from equilibrium."""
    base = vehicle(geometry=geometry)
    return replace(base, initial=base.initial + np.array([1e-3, 0, 0, 0, 0, 0, 0, 0]))


def inside_limit_error(engine_name: str, work_folder: Path) -> float:
    """Case: RK4 with 300 steps of 3.9 ms, just inside the stability limit; the fastest mode must have decayed. Error:
    difference of the final state from the exact one divided by the displacement."""
    assembly = _displaced_vehicle()
    path = run(engine_name, assembly, 3.9e-3, 1.17)
    return largest_magnitude(path.states[-1] - exact_states(assembly, 3.9e-3, 300)[-1]) / 1e-3


def beyond_limit_error(engine_name: str, work_folder: Path) -> float:
    """Case: RK4 with eight steps of 5 ms, beyond the stability limit, so that all values are still small and finite; it
    must be refused. Error: relative difference from the tight-tolerance solution."""
    assembly = vehicle(effects=ROAD_EFFECT)
    path = run(engine_name, assembly, 5e-3, 0.04)
    return _relative_error_of_states(assembly, path.states, 5e-3)


def _relative_error_of_states(assembly, computed_states, time_step: float) -> float:
    """Largest difference of the states from the tight-tolerance solution, divided by the solution's largest
    displacement."""
    truth = tight_solution(assembly, time_step, (len(computed_states) - 1) * time_step).states
    return largest_magnitude(computed_states - truth) / largest_magnitude(truth - truth[0])


def beyond_limit_naive_result(work_folder: Path) -> str:
    """Result without the guard, as text: the run beyond the stability limit."""
    assembly = vehicle(effects=ROAD_EFFECT)
    shares = [
        _relative_error_of_states(assembly, unchecked_run(engine, assembly, 5e-3, 0.04).states, 5e-3)
        for engine in IMPLEMENTATIONS
    ]
    return f"unchecked, all three answer, finite, off by {min(shares):.0%} to {max(shares):.0%} of the motion"


def unchecked_long_step_error(engine_name: str, work_folder: Path) -> float:
    """Case: RK4 at 8 ms without the checks before the run, so that only the guard after the run remains. Error:
    relative difference from the tight-tolerance solution."""
    assembly = vehicle(effects=ROAD_EFFECT)
    return _relative_error_of_states(assembly, unchecked_run(engine_name, assembly, 8e-3, 2.0).states, 8e-3)


def reset_naive_result(work_folder: Path) -> str:
    """Result without the guard, as text: MuJoCo resets the state, and its time starts again."""
    model = mujoco_engine.MujocoModel(_displaced_vehicle("exact"), run_settings("mujoco", 8e-3, 2.0)).model
    model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    data = mujoco.MjData(model)
    data.qpos[:] = _displaced_vehicle("exact").initial[:4]
    resets, time_before = 0, 0.0
    with without_warnings():
        for _ in range(250):
            mujoco.mj_step(model, data)
            resets, time_before = resets + (data.time <= time_before), data.time
    return f"MuJoCo resets itself {resets} times, ends at t = {data.time:.3f} s of 2 s, all finite, no exception"


def huge_states_error(engine_name: str, work_folder: Path) -> float:
    """Case: a first-order explicit method at 5 ms without the checks before the run. Error: relative difference from
    the tight-tolerance solution."""
    assembly = vehicle(effects=ROAD_EFFECT)
    return _relative_error_of_states(
        assembly, unchecked_run(engine_name, assembly, 5e-3, 2.0, EULER_INTEGRATORS[engine_name]).states, 5e-3
    )


def huge_naive_result(work_folder: Path) -> str:
    """Result without the guard, as text: Exudyn's own success flag, and the largest finite state."""
    assembly = vehicle(geometry="linear", start_state=_displaced_vehicle().initial)
    model = exudyn_engine.build(assembly, run_settings("exudyn", 5e-3, 2.0, "ExplicitEuler"))
    flag = not solve(model.built.mbs, model.settings)
    _, states = model._recorded_states()
    return f"Exudyn returns {flag} with states of up to {largest_magnitude(states[np.isfinite(states)]):.0e}"


def sudden_load_error(engine_name: str, work_folder: Path) -> float:
    """Case: the front force rises by 1 kN from one sample to the next, in steps of 1 ms. Error: difference of the
    states from the exact ones divided by the largest wheel velocity."""
    assembly, forces = vehicle_under_stepped_force()
    path = run(engine_name, assembly, 1e-3, 0.2)
    truth = exact_states(assembly, 1e-3, 200, forces.sample(0.0, 1e-3, 200))
    return largest_magnitude(path.states - truth) / largest_magnitude(truth[:, 4])


def vehicle_under_stepped_force():
    """The linearised vehicle under its weight and 1 kN more on the front wheel from 50 ms on, and these forces."""
    base = vehicle(geometry="linear")
    values = static_forces(base, 20, 10e-3).values.copy()
    values[5:, 0] += 1000.0
    forces = SampledSignal(values, 10e-3, held=True)
    return driven_by_forces(base, forces), forces


def sudden_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: generalised-alpha with a step that does not resolve the fast pole."""
    assembly, forces = vehicle_under_stepped_force()
    path = unchecked_run("exudyn", assembly, 10e-3, 0.2, "GeneralizedAlpha", spectral_radius=0.9)
    truth = exact_states(assembly, 10e-3, 20, forces.values)
    velocity_errors = (path.states - truth)[6:9, 4]
    return (
        "Exudyn's default at 10 ms overshoots: front wheel velocity off by "
        f"{', '.join(f'{value:+.3f}' for value in velocity_errors)} m/s (peak {largest_magnitude(truth[:, 4]):.3f})"
    )


def repeated_run_difference(engine_name: str, work_folder: Path) -> float:
    """Case: a model is run twice, with an acceleration evaluated in between. Error: difference of the runs, which must
    be 0."""
    base = vehicle()
    forces = static_forces(base, 200, 1e-3, noise_deviation=500.0)
    worst = 0.0
    for integrator in ("", "DOP853" if engine_name == "reference" else IMPLICIT_INTEGRATORS[engine_name]):
        signal = replace(forces, held=False) if integrator == "GeneralizedAlpha" else forces
        model = build(engine_name, driven_by_forces(base, signal), run_settings(engine_name, 1e-3, 0.2, integrator))
        first = model.run().states
        model.acceleration(0.05, *np.split(first[50], 2))
        worst = max(worst, largest_magnitude(model.run().states - first))
    return worst


def restart_difference(engine_name: str, work_folder: Path) -> float:
    """Case: a run is stopped at half its time and continued from the saved state. Error: difference of the states from
    the uninterrupted run."""
    base = vehicle()
    forces = static_forces(base, 400, 1e-3, noise_deviation=500.0)
    full_states = run(engine_name, driven_by_forces(base, forces), 1e-3, 0.4).states
    second_half = driven_by_forces(
        replace(base, initial=full_states[200].copy()), SampledSignal(forces.values[200:], 1e-3, True)
    )
    return largest_magnitude(run(engine_name, second_half, 1e-3, 0.2).states - full_states[200:])


def adaptive_time_error(engine_name: str, work_folder: Path) -> float:
    """Case: an adaptive run, whose rows lie at other times than asked for. Error: difference of each row from the exact
    state at its time."""
    name = {"reference": "DOP853"}.get(engine_name, "DOPRI5")
    build_scene({"title": "", "run": {"duration": 0.2}, "engines": {engine_name: {"integrator": name}}})
    assembly = _displaced_vehicle()
    path = run(engine_name, assembly, 1e-3, 0.2, name)
    return largest_magnitude(path.states - exact_decay(assembly, path.times))


def row_numbers_as_times_result(work_folder: Path) -> str:
    """Result without the remedy, as text: error if row numbers are used as times."""
    assembly = _displaced_vehicle()
    path = run("exudyn", assembly, 1e-3, 0.2, "DOPRI5")
    time_errors = np.abs(path.times - 1e-3 * np.arange(len(path.times)))
    truth = exact_states(assembly, 1e-3, len(path.times) - 1)
    return (
        f"Exudyn's rows lie up to {time_errors.max() * 1e3:.2g} ms off the grid: compared row by row the same run "
        f"shows an error of {largest_magnitude(path.states - truth):.0e}"
    )


DECLARED_ORDERS = {"reference": 4.0, "exudyn": 2.0, "mujoco": 4.0}


def lost_order_of_convergence(engine_name: str, work_folder: Path) -> float:
    """Case: four halvings of a step of 2 ms. Error: amount by which the observed order of convergence is below the
    declared one."""
    base = vehicle("asymmetric_twin", "linear")
    base = replace(base, initial=base.initial - np.array([0, 0, 0.01, 0.02, 0, 0, 0, 0]))
    truth, errors = exact_states(base, 0.1, 2)[-1], []
    for step in (2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4):
        end = run(engine_name, base, step, 0.2, CONSTRAINED_INTEGRATORS[engine_name]).states[-1]
        errors.append(largest_magnitude(end - truth))
    return float(DECLARED_ORDERS[engine_name] - np.log2(np.array(errors[:-1]) / errors[1:]).min())


CASES = (
    HardCase(
        "stiff damper, step just inside the limit",
        "a 10 kN s/m damper on a 15 kg wheel: fastest pole -691 1/s, RK4 is stable up to 4.03 ms",
        "matrix exponential after 300 steps of 3.9 ms",
        "of the push",
        1e-4,
        "the fast mode has shrunk by 0.87 per step; what is left is RK4's error of the slow ones",
        inside_limit_error,
    ),
    HardCase(
        "stiff damper, step just beyond the limit",
        "RK4 at 5 ms over eight steps: everything is still small and finite",
        "refused with the limit named, before the run",
        "of the motion",
        0.1,
        "a tenth of the motion is no answer",
        beyond_limit_error,
        REFUSED,
        beyond_limit_naive_result,
    ),
    HardCase(
        "automatic reset",
        "an unstable MuJoCo run starts again from t = 0 and goes on",
        "time rises to n h",
        "of the motion",
        0.1,
        "a tenth of the motion is no answer",
        unchecked_long_step_error,
        RAISED,
        reset_naive_result,
    ),
    HardCase(
        "finite but huge states",
        "explicit runs end 'successfully' far beyond any vehicle",
        "size bound of 1e4",
        "of the motion",
        0.1,
        "a tenth of the motion is no answer",
        huge_states_error,
        RAISED,
        huge_naive_result,
    ),
    HardCase(
        "sudden load",
        "a force jumps from one sample to the next; the wheel answers within 1.5 ms",
        "matrix exponential with held forces",
        "of the peak wheel velocity",
        5e-3,
        "RK4 at 1 ms meets the pole -691 1/s with h lambda = 0.7: (0.7)^5 / 120 = 1.4e-3 per step at the jump",
        sudden_load_error,
        {},
        sudden_naive_result,
    ),
    HardCase(
        "repeated run",
        "solvers and callbacks keep state between runs",
        "the same bits",
        "m, rad, m/s, rad/s",
        0.0,
        "the same operations in the same order",
        repeated_run_difference,
        answer_independence="none",
    ),
    HardCase(
        "restart from a saved state",
        "a continued run must not differ from an uninterrupted one",
        "the uninterrupted run",
        "m, rad, m/s, rad/s",
        1e-12,
        "times are counted anew: only rounding may differ",
        restart_difference,
        answer_independence="none",
    ),
    HardCase(
        "adaptive output stamps",
        "an adaptive engine's rows do not lie where they were asked for",
        "matrix exponential at the returned times",
        "m, rad, m/s, rad/s",
        1e-6,
        "tolerance 1e-9 per step; DOP853 reads its rows from a polynomial between steps, two digits worse",
        adaptive_time_error,
        {"mujoco": "refused"},
        row_numbers_as_times_result,
    ),
    HardCase(
        "order down to fine steps",
        "a Newton tolerance looser than a step's error stops convergence, and more work buys nothing",
        "matrix exponential: the order of the method from 2 to 0.125 ms",
        "by which the order falls short",
        0.25,
        "the first halvings still see the next order",
        lost_order_of_convergence,
    ),
)
