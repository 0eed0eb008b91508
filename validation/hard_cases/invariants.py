"""Hard cases judged by invariants: rest, signs, momentum, free motion, tumbling, the frame of the forces."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from models.core.result import Result
from models.core.signals import SampledSignal
from models.engines.assembly import Assembly, Mode
from models.engines.protocol import build
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import build as build_scene
from validation.hard_cases.case import HardCase
from validation.hard_cases.setups import (
    driven_by_forces,
    largest_magnitude,
    run,
    run_settings,
    static_forces,
    tight_solution,
    vehicle,
)

VEHICLES = ("itwm_drift", "asymmetric_twin")
GRAVITY = 9.81


def motion_at_rest(engine_name: str, work_folder: Path) -> float:
    """Case: both vehicles, in exact and linear geometry, start in their static equilibrium. Error: largest motion (m,
    rad, m/s, rad/s) in 2 s."""
    worst = 0.0
    for parameters in VEHICLES:
        for geometry in ("exact", "linear"):
            base = vehicle(parameters, geometry)
            worst = max(worst, largest_magnitude(run(engine_name, base, 1e-3, 2.0).states - base.initial))
    return worst


def rest_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: motion of a vehicle that starts at zero, with unstressed springs."""
    base = vehicle(start_state=np.zeros(8))
    fall = largest_magnitude(run("reference", base, 1e-3, 2.0).states[:, 4:7])
    return f"a start from the coordinates' zero falls at up to {fall:.2f} m/s"


def loads_at_rest(engine_name: str, work_folder: Path) -> float:
    """Case: both vehicles at rest. Error: difference (N) of the tyre loads from the closed form."""
    worst = 0.0
    for parameters in VEHICLES:
        base = vehicle(parameters)
        p = base.parameters
        path = simulate(base.scene, engine_name, run_settings(engine_name, 1e-3, 0.1), base)
        front = (p.m3 * p.a / (p.a + p.b) + p.m1) * GRAVITY
        rear = (p.m3 * p.b / (p.a + p.b) + p.m2) * GRAVITY
        for name, load in (("f1", front), ("f2", rear)):
            worst = max(worst, largest_magnitude(path[name] - load))
    return worst


def raised_nose_error(engine_name: str, work_folder: Path) -> float:
    """Case: the nose is raised by 0.01 rad. Error: relative difference of the accelerations from values written by hand
    for the linear geometry."""
    base, tilt = vehicle("asymmetric_twin", "linear"), 0.01
    p, state = base.parameters, base.initial.copy()
    state[3] += tilt
    acceleration = build(engine_name, base, run_settings(engine_name, 1e-3, 0.1)).acceleration(0.0, *np.split(state, 2))
    front, rear = -p.k3 * p.b * tilt, p.k4 * p.a * tilt  # the front strut is pulled, the rear one pressed
    hand = np.array([front / p.m1, rear / p.m2, -(front + rear) / p.m3, (p.b * front - p.a * rear) / p.I])
    if not (acceleration[0] < 0 < acceleration[1] and acceleration[3] < 0):
        return np.inf
    return largest_magnitude(acceleration - hand) / largest_magnitude(hand)


def pushed_wheels_error(engine_name: str, work_folder: Path) -> float:
    """Case: each wheel is pushed up by 100 N in addition to its static load. Error: relative difference of the
    accelerations from 100 N / mass."""
    base = vehicle("asymmetric_twin")
    p, worst = base.parameters, 0.0
    for wheel, mass in enumerate((p.m1, p.m2)):
        forces = static_forces(base, 3, 1e-3)
        forces.values[:, wheel] += 100.0
        model = build(engine_name, driven_by_forces(base, forces), run_settings(engine_name, 1e-3, 2e-3))
        wanted = np.zeros(4)
        wanted[wheel] = -100.0 / mass
        worst = max(
            worst, largest_magnitude(model.acceleration(0.0, *np.split(base.initial, 2)) - wanted) * mass / 100.0
        )
    return worst


def raised_front_error(engine_name: str, work_folder: Path) -> float:
    """Case: 500 N more on the front wheel for 50 ms. Error: relative difference from the tight-tolerance solution;
    infinite unless front and pitch rise."""
    base = vehicle("asymmetric_twin")
    forces = static_forces(base, 51, 1e-3)
    forces.values[:, 0] += 500.0
    end = run(engine_name, driven_by_forces(base, forces), 1e-3, 0.05).states[-1] - base.initial
    truth = tight_solution(driven_by_forces(base, forces), 1e-3, 0.05).states[-1] - base.initial
    if not (end[3] > 0 and end[0] < 0 and end[2] - base.parameters.b * np.sin(end[3]) < 0):
        return np.inf
    return largest_magnitude(end - truth) / largest_magnitude(truth)


def momentum_error(engine_name: str, work_folder: Path) -> float:
    """Case: noisy wheel forces in linear geometry. Error: relative difference of linear momentum sum m z' and angular
    momentum I b' - m1 b z1' + m2 a z2' from the integrals of the forces."""
    base = vehicle("asymmetric_twin", "linear")
    p = base.parameters
    forces = static_forces(base, 1000, 1e-3, noise_deviation=800.0)
    rates = run(engine_name, driven_by_forces(base, forces), 1e-3, 1.0).states[:, 4:]
    t = 1e-3 * np.arange(1001)[:, None]
    pushed = np.vstack((np.zeros(2), np.cumsum(forces.values * 1e-3, axis=0)))
    angular = rates @ np.array([-p.m1 * p.b, p.m2 * p.a, 0.0, p.I])
    linear = rates @ np.array([p.m1, p.m2, p.m3, 0.0])
    angular_impulse = pushed @ np.array([p.b, -p.a]) + (p.a * p.m2 - p.b * p.m1) * p.g * t[:, 0]
    fallen = (p.m1 + p.m2 + p.m3) * p.g * t[:, 0] - pushed.sum(axis=1)
    return max(
        largest_magnitude(angular - angular_impulse) / largest_magnitude(angular_impulse - angular_impulse[0]),
        largest_magnitude(linear - fallen) / largest_magnitude(pushed),
    )


def free_heave_error(engine_name: str, work_folder: Path) -> float:
    """Case: 50 random states with pitch up to 3 rad. Error: relative difference of the centre of mass' acceleration
    from the external forces divided by the mass."""
    base = vehicle("asymmetric_twin")
    p = base.parameters
    forces = static_forces(base, 100, 1e-3, noise_deviation=2000.0)
    model = build(engine_name, driven_by_forces(base, forces), run_settings(engine_name, 1e-3, 0.1))
    masses, worst, size = np.array([p.m1, p.m2, p.m3]), 0.0, 0.0
    for i, state in enumerate(np.random.default_rng(6).uniform(-1, 1, (50, 8)) * [0.5, 0.5, 0.5, 3, 3, 3, 3, 3]):
        acceleration = model.acceleration(2 * i * 1e-3, *np.split(state, 2))[:3]
        wanted = p.g - forces.values[2 * i].sum() / masses.sum()
        worst, size = (
            max(worst, abs(acceleration @ masses / masses.sum() - wanted)),
            max(size, largest_magnitude(acceleration)),
        )
    return worst / size


def _spinning_assembly(geometry: str) -> Assembly:
    """The asymmetric twin under its weight, rotating in pitch at 6 rad/s."""
    base = vehicle("asymmetric_twin", geometry)
    start = base.initial.copy()
    start[7] = 6.0
    return driven_by_forces(replace(base, initial=start), static_forces(base, 2, 2.0, is_held=False))


@cache
def _tumbled_states() -> np.ndarray:
    """States of the tumbling vehicle over 1 s, every 0.25 ms, by the solution of order 8."""
    return tight_solution(_spinning_assembly("exact"), 2.5e-4, 1.0).states


def tumbling_error(engine_name: str, work_folder: Path) -> float:
    """Case: a vehicle that pitches at 6 rad/s turns over, for 1 s in steps of 0.25 ms. Error: difference of the states
    from a solution of order 8."""
    states = run(engine_name, _spinning_assembly("exact"), 2.5e-4, 1.0).states
    truth = _tumbled_states()
    if truth[:, 3].max() < np.pi / 2:
        return np.inf
    return largest_magnitude(states - truth)


def tumbling_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: the same scene in linear geometry."""
    ends = [run("reference", _spinning_assembly(geometry), 1e-3, 1.0).states[-1, 3] for geometry in ("exact", "linear")]
    return f"exact geometry turns to {ends[0]:.2f} rad, the linear one says {ends[1]:.2f} rad"


DRIVE_DURATION = 8.0


@cache
def _measured_forces() -> SampledSignal:
    """Wheel forces (N) of a drive on the study road, sampled at 1 kHz."""
    scene = build_scene(
        {"title": "", "run": {"duration": DRIVE_DURATION}, "effects": {"road": {"source": "study", "speed": 20.0}}}
    )
    result: Result = simulate(scene, "reference")
    return SampledSignal(np.column_stack([result["f1"], result["f2"]]), 1e-3, held=False)


def pitch_error_growth(engine_name: str, drive_mode: Mode) -> float:
    """Factor by which a pitch error of 1e-6 rad grows over a drive with measured wheel forces."""
    base = vehicle()
    start = base.initial.copy()
    start[3] += 1e-6
    ends = [
        run(
            engine_name,
            driven_by_forces(replace(base, initial=y), _measured_forces(), drive_mode),
            1e-3,
            DRIVE_DURATION,
        ).states[-1, 3]
        for y in (base.initial, start)
    ]
    return abs(ends[1] - ends[0]) / 1e-6


def body_frame_growth(engine_name: str, work_folder: Path) -> float:
    """Case: wheel forces along the chassis' axis, under which a pitch error must not grow. Error: growth factor of the
    pitch error."""
    return pitch_error_growth(engine_name, "force-body")


def body_frame_naive_result(work_folder: Path) -> str:
    """Result without the remedy, as text: the body-fixed forces are applied as vertical ones."""
    factor = pitch_error_growth("reference", "force")
    return f"vertical forces let the error grow {factor:.0f}-fold in {DRIVE_DURATION:.0f} s"


CASES = (
    HardCase(
        "static equilibrium",
        "gravity, preload and the zero of the coordinates must fit together",
        "nothing moves for 2 s, both vehicles and geometries",
        "m, rad, m/s, rad/s",
        1e-12,
        "rounding of kN on kg: 1e-13 m/s^2 held down by the dampers",
        motion_at_rest,
        {},
        rest_naive_result,
    ),
    HardCase(
        "+z is down",
        "engines think z up; a wrong sign mirrors the vehicle",
        "static tyre loads, 3825.9 N each",
        "N",
        1e-8,
        "rounding of 4 kN",
        loads_at_rest,
    ),
    HardCase(
        "nose up",
        "sign of pitch, places of the axles",
        "accelerations of a tilted vehicle written out by hand",
        "of the largest",
        1e-11,
        "a preload of 4 kN cancels to 10 N",
        raised_nose_error,
    ),
    HardCase(
        "nothing but what is described",
        "engines add gravity, inertia from density and contacts on their own",
        "a push at one wheel: 100 N / its mass, and no other acceleration",
        "of the acceleration",
        1e-11,
        "a preload of 4 kN cancels to nothing",
        pushed_wheels_error,
    ),
    HardCase(
        "more force in front",
        "a moment that lifts the nose must lift it",
        "front up, pitch up, and the tight solution",
        "of the motion",
        1e-4,
        "RK4 at 1 ms over the jump at the start",
        raised_front_error,
        answer_independence="native",
    ),
    HardCase(
        "momentum",
        "both momenta ignore springs and dampers, so a stiff error cannot hide",
        "impulse of the forces",
        "of the impulse",
        1e-12,
        "a thousand additions of doubles",
        momentum_error,
    ),
    HardCase(
        "unconstrained heave",
        "a free vehicle has four zero eigenvalues; hidden damping would look like stability",
        "centre of mass: sum of external forces / mass",
        "of the largest acceleration",
        1e-12,
        "internal forces of 1e5 N cancel",
        free_heave_error,
    ),
    HardCase(
        "tumbling",
        "pitch far beyond 90 degrees: sin and cos, signs of the arms",
        "order 8, tolerance 1e-12",
        "m, rad, m/s, rad/s",
        1e-3,
        "RK4 at 0.25 ms; the wheels start 8 m/s off the struts' ends and are caught within 1.5 ms",
        tumbling_error,
        {},
        tumbling_naive_result,
        answer_independence="native",
    ),
    HardCase(
        "forces in the body's frame",
        "vertical forces at rotating arms make the pitch unstable; body-fixed ones do not",
        "a pitch error of 1e-6 rad does not double in 8 s",
        "growth",
        2.0,
        "1 for massless wheels; the wheels' own mass holds the pitch weakly, so an error may also shrink",
        body_frame_growth,
        {},
        body_frame_naive_result,
        answer_independence="none",
    ),
)
