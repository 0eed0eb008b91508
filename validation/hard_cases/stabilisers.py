"""Hard cases of stabilisers: a pitch spring with a kink, an added moment with held forces, prescribed heave and
pitch."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any
from unittest import mock

import exudyn.itemInterface as items
import numpy as np

from models.core.signals import SampledSignal, Smooth, StackedSignal
from models.core.time_series import write_time_series
from models.core.trajectory import Trajectory
from models.engines import exudyn as exudyn_engine
from models.engines.assembly import Assembly
from models.systems.pitch_plane.scene import assembly_of_scene
from models.systems.pitch_plane.scene import build as build_scene
from models.vehicles.description import PitchSpring
from validation.hard_cases.case import HardCase
from validation.hard_cases.setups import (
    CONSTRAINED_INTEGRATORS,
    REFUSED,
    driven_by_forces,
    largest_magnitude,
    root_mean_square,
    run,
    static_forces,
    tight_solution,
    unchecked_run,
    vehicle,
)

STEP, DURATION = 1e-3, 0.5
DEAD_BAND, STIFFNESS = 0.02, 1e5
"""Dead band (rad) and stiffness (N m/rad) of the pitch spring; the pitch crosses the band in 0.1 s and turns round
within 0.1 s."""
PITCH_NOISE = 1e-6


def vehicle_with_pitch_spring(dead_band: float) -> Assembly:
    """The vehicle under its weight, pitching at 0.4 rad/s, with a pitch spring that has a dead band (rad)."""
    base = vehicle("asymmetric_twin")
    start = base.initial.copy()
    start[7] = 0.4
    assembly = driven_by_forces(base, static_forces(base, 2, DURATION, is_held=False))
    spring = PitchSpring("chassis", STIFFNESS, 0.0, dead_band)
    return replace(assembly, initial=start, vehicle=replace(assembly.vehicle, pitch_springs=(spring,)))


def dead_band_edge_error(engine_name: str, work_folder: Path) -> float:
    """Case: the pitch crosses the edges of a spring's dead band many times. Error: largest error of the pitch (rad)."""
    path = run(engine_name, vehicle_with_pitch_spring(DEAD_BAND), STEP, DURATION)
    return largest_magnitude((path.states - _exact_motion_with_kinks().states)[:, 3])


@cache
def _exact_motion_with_kinks() -> Trajectory:
    """Motion with the dead band by the solution of order 8."""
    return tight_solution(vehicle_with_pitch_spring(DEAD_BAND), STEP, DURATION)


def kink_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: error of Exudyn's limit stops in place of the force law."""
    with mock.patch.object(exudyn_engine, "_add_pitch_spring", _add_limit_stop):
        pitch_error = dead_band_edge_error("exudyn", work_folder)
    return f"Exudyn's limit stops, asked once per step: pitch off by {pitch_error:.1e} rad"


def _add_limit_stop(exudyn_build: exudyn_engine.PitchPlaneBuild, pitch_spring: PitchSpring) -> None:
    """Add Exudyn's limit stops at the edges of the dead band, in place of the pitch spring."""
    state = exudyn_build.mbs.AddNode(items.NodeGenericData(initialCoordinates=[0, 0, 0], numberOfDataCoordinates=3))
    exudyn_build.mbs.AddObject(
        items.CoordinateSpringDamperExt(
            markerNumbers=[
                exudyn_engine.ground_marker(exudyn_build.mbs),
                exudyn_build.coordinate_markers[pitch_spring.body, "pitch"],
            ],
            nodeNumber=state,
            useLimitStops=True,
            limitStopsUpper=pitch_spring.dead_band,
            limitStopsLower=-pitch_spring.dead_band,
            limitStopsStiffness=pitch_spring.stiffness,
            limitStopsDamping=pitch_spring.damping,
        )
    )


def wide_dead_band_error(engine_name: str, work_folder: Path) -> float:
    """Case: a dead band wider than the motion. Error: difference of the states from a run without the spring."""
    tied = vehicle_with_pitch_spring(1.0)
    free = replace(tied, vehicle=replace(tied.vehicle, pitch_springs=()))
    between, free_states = (run(engine_name, assembly, STEP, DURATION).states for assembly in (tied, free))
    return largest_magnitude(between - free_states)


def vehicle_under_held_forces(is_moment_held: bool = False) -> Assembly:
    """The vehicle under noisy forces that are constant over each sample and a moment of 2 kN m at 20 Hz, both sampled
    every 4 ms."""
    base = vehicle("asymmetric_twin")
    assembly = driven_by_forces(base, static_forces(base, 126, 4e-3, noise_deviation=300.0))
    samples = 2e3 * np.sin(2 * np.pi * 20.0 * 4e-3 * np.arange(126))[:, None]
    return replace(assembly, moment=SampledSignal(samples, 4e-3, is_moment_held))


def moving_moment_error(engine_name: str, work_folder: Path) -> float:
    """Case: forces constant over each sample and an interpolated moment. Error: largest error of the pitch (rad)."""
    path = run(engine_name, vehicle_under_held_forces(), STEP, DURATION)
    return largest_magnitude((path.states - _exact_motion_with_moment().states)[:, 3])


@cache
def _exact_motion_with_moment() -> Trajectory:
    """Motion under held forces and the interpolated moment by the solution of order 8."""
    return tight_solution(vehicle_under_held_forces(), STEP, DURATION)


def moving_moment_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: error if the moment is held over a sample like the forces."""
    path = unchecked_run("reference", vehicle_under_held_forces(is_moment_held=True), STEP, DURATION)
    pitch_error = (path.states - _exact_motion_with_moment().states)[:, 3]
    return f"held as well: pitch off by {largest_magnitude(pitch_error):.1e} rad"


def moment_between_steps_error(engine_name: str, work_folder: Path) -> float:
    """Case: a moment sampled every 1.5 ms in a run with steps of 1 ms must be refused. Error: 0 if it is not."""
    moment = SampledSignal(np.zeros((400, 1)), 1.5e-3, held=False)
    run(engine_name, replace(vehicle_under_held_forces(), moment=moment), STEP, DURATION)
    return 0.0


@cache
def _free_motion() -> np.ndarray:
    """States (n, 8) every 0.25 ms of the vehicle under its weight, released from a tilted position."""
    base = vehicle("asymmetric_twin")
    base.initial[[2, 3]] += 0.02, 0.05
    assembly = driven_by_forces(base, static_forces(vehicle("asymmetric_twin"), 2, DURATION, is_held=False))
    return tight_solution(assembly, 2.5e-4, DURATION).states


def guided_assembly(noise_deviation: float = 0.0, mass_factor: float = 1.0) -> Assembly:
    """The vehicle with prescribed heave and pitch. noise (m, rad) is added to the samples; the chassis' mass is
    multiplied by ``mass_factor``."""
    states = _free_motion()
    motion = states[:, 2:4] + noise_deviation * np.random.default_rng(7).standard_normal((len(states), 2))
    base = vehicle("asymmetric_twin")
    forces = static_forces(base, 2, DURATION, is_held=False)
    signal = StackedSignal((forces, Smooth(motion, 2.5e-4, derivatives=2, degree=5)))
    assembly = vehicle("asymmetric_twin", start_state=states[0], m3=mass_factor * base.parameters.m3)
    assembly.initial[[2, 3, 6, 7]] = signal.at(0.0)[2:6]
    return assembly.without_tyres().with_input("heave-pitch", signal)


def _guided_run(engine_name: str, assembly: Assembly) -> Trajectory:
    """Run with prescribed heave and pitch in steps of 0.25 ms."""
    return run(engine_name, assembly, 2.5e-4, DURATION, CONSTRAINED_INTEGRATORS[engine_name])


def missing_mass_error(engine_name: str, work_folder: Path) -> float:
    """Case: a model whose chassis is 5 % too light. Error: relative difference of the mean stabilising force from 0.05
    m3 (g - z3'')."""
    p, states = vehicle("asymmetric_twin").parameters, _free_motion()
    force = _guided_run(engine_name, guided_assembly(mass_factor=0.95)).force
    assert force is not None
    wanted = 0.05 * p.m3 * (p.g - (states[-1, 6] - states[0, 6]) / DURATION)
    return abs(float(force.mean()) / wanted - 1)


def missing_mass_naive_result(work_folder: Path) -> str:
    """Difference between the states of guided runs with the true and a wrong mass, as text."""
    states_of_true, states_of_wrong = (
        _guided_run("reference", guided_assembly(mass_factor=mass)).states for mass in (1.0, 0.95)
    )
    return (
        f"the states of the guided run differ by {largest_magnitude(states_of_true - states_of_wrong):.1e}: "
        "only the force can tell"
    )


def guided_noise_gain(engine_name: str, work_folder: Path) -> float:
    """Case: noise of 1e-6 m and rad on prescribed heave and pitch. Error: rms change of enforced force and moment,
    divided by the finite-difference values."""
    p = vehicle("asymmetric_twin").parameters
    enforced, clean = (
        _guided_run(engine_name, guided_assembly(PITCH_NOISE)).enforced,
        _guided_run("reference", guided_assembly()).enforced,
    )
    assert enforced is not None and clean is not None
    sizes = np.array([p.m3, p.I]) * PITCH_NOISE * np.sqrt(6) / 2.5e-4**2
    return float((np.sqrt(np.mean((enforced - clean) ** 2, axis=0)) / sizes).max())


def measured_pitch(work_folder: Path, **scene_keys: float) -> Assembly:
    """Writes the files of a scene whose prescribed pitch has the noise of an inertial unit, 0.1 degrees at 1 kHz, and
    returns its assembly."""
    t = STEP * np.arange(1001)
    noise = np.deg2rad(0.1) * np.random.default_rng(8).standard_normal(len(t))
    write_time_series(work_folder / "pitch.csv", {"pitch": ("rad", 0.05 * np.sin(6.0 * t) + noise)}, STEP)
    write_time_series(work_folder / "forces.csv", {"front": ("N", 3.8e3 + 0 * t), "rear": ("N", 3.8e3 + 0 * t)}, STEP)
    effects = {
        "wheel_forces": {"file": "forces.csv", "interpolation": "linear"},
        "prescribed_pitch": {"file": "pitch.csv", **scene_keys},
    }
    return assembly_of_scene(
        build_scene({"title": "hard case", "run": {"duration": 1.0}, "effects": effects}, "", work_folder)
    )


def smoothed_pitch_error(engine_name: str, work_folder: Path) -> float:
    """Case: a pitch smoothed to 5 Hz is prescribed. Error: difference of the enforced moment from the solution in which
    the pitch is eliminated, divided by its rms."""
    assembly = measured_pitch(work_folder, bandwidth=5.0)
    moment = run(engine_name, assembly, STEP, 1.0, CONSTRAINED_INTEGRATORS[engine_name]).moment
    true = run("reference", assembly, STEP / 8, 1.0).moment
    assert moment is not None and true is not None
    return root_mean_square((moment - true[::8])[50:]) / root_mean_square(true)


def smoothed_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: the noisy pitch is used without smoothing."""
    raw = run("reference", measured_pitch(work_folder), STEP, 1.0).moment
    assert raw is not None
    return f"without a bandwidth the moment is {root_mean_square(raw):.1e} N m rms, and Exudyn's multiplier raises"


def bandwidth_beyond_nyquist(engine_name: str, work_folder: Path) -> float:
    """Case: a smoothing bandwidth above half of the file's sampling rate must be refused."""
    run(engine_name, measured_pitch(work_folder, bandwidth=600.0), STEP, 1.0, CONSTRAINED_INTEGRATORS[engine_name])
    return 0.0


def refused_scene_case(scene_effects: dict[str, Any]) -> Callable[[str, Path], float]:
    """Case: a scene under wheel forces with the effects must be refused."""

    def error(engine_name: str, work_folder: Path) -> float:
        measured_pitch(work_folder)  # writes the files
        forces = {"wheel_forces": {"file": "forces.csv", "interpolation": "linear"}}
        table = {"title": "hard case", "run": {"duration": 1.0}, "effects": forces | scene_effects}
        run(engine_name, assembly_of_scene(build_scene(table, "", work_folder)), STEP, 1.0)
        return 0.0

    return error


CASES = (
    HardCase(
        "edge of a dead band",
        "the spring's law has a kink that a step does not stop at",
        "order 8, tolerance 1e-12",
        "rad",
        5e-7,
        "three crossings; what a step across an edge leaves falls as h^2 to h^3, from 2.3e-7 here",
        dead_band_edge_error,
        {},
        kink_naive_result,
        answer_independence="native",
    ),
    HardCase(
        "dead band that is never left",
        "the law is asked at every stage and must give nothing",
        "the same vehicle without the spring",
        "SI",
        0.0,
        "nothing added is nothing",
        wide_dead_band_error,
    ),
    HardCase(
        "added moment beside held forces",
        "forces stay over a step while the moment moves on",
        "order 8, tolerance 1e-12, restarted at each sample",
        "rad",
        1e-7,
        "RK4's own error at 1 ms",
        moving_moment_error,
        {},
        moving_moment_naive_result,
        answer_independence="native",
    ),
    HardCase(
        "added moment sampled off the steps",
        "its corners lie within the steps",
        "refused",
        "",
        0.0,
        "a corner within a step costs Runge-Kutta its order",
        moment_between_steps_error,
        REFUSED,
        answer_independence="none",
    ),
    HardCase(
        "5 % of the chassis missing",
        "the motion is prescribed: no state shows it",
        "dm (g - z3'')",
        "of that force",
        1e-3,
        "generalised-alpha's start rings for 20 of 2,000 rows",
        missing_mass_error,
        {},
        missing_mass_naive_result,
    ),
    HardCase(
        "noise of 1e-6 on prescribed heave and pitch",
        "its second derivatives are noise of kN and kN m",
        "at most 3 m s sqrt(6) / dt^2",
        "m s sqrt(6) / dt^2",
        3.0,
        "the finite-difference value; the spline's own gain is below 3",
        guided_noise_gain,
        {"exudyn": "raised"},
        answer_independence="native",
    ),
    HardCase(
        "measured pitch, smoothed",
        "noise of 0.1 degrees at 1 kHz is 1e6 N m",
        "pitch eliminated, an eighth of the step",
        "of its rms",
        1e-3,
        "second order at 5 Hz and 1 ms: (2 pi f h)^2 / 12 = 8e-5, and the start's rest",
        smoothed_pitch_error,
        {},
        smoothed_naive_result,
        answer_independence="native",
    ),
    HardCase(
        "bandwidth above half the sampling rate",
        "there is no such motion in the file",
        "refused",
        "",
        0.0,
        "the filter does not exist",
        bandwidth_beyond_nyquist,
        REFUSED,
        answer_independence="none",
    ),
    HardCase(
        "high-pass stiffer than the step",
        "a corner of 1 kHz is a pole that Runge-Kutta at 1 ms cannot follow",
        "refused",
        "",
        0.0,
        "an error would grow",
        refused_scene_case({"high_pass": {"cut_off": 1000.0}}),
        REFUSED,
        answer_independence="none",
    ),
    HardCase(
        "spring beside a prescribed pitch",
        "one of the two would do nothing",
        "refused",
        "",
        0.0,
        "a scene that says two things",
        refused_scene_case({"pitch_spring": {"stiffness": 1e3}, "prescribed_pitch": {"file": "pitch.csv"}}),
        REFUSED,
        answer_independence="none",
    ),
)
