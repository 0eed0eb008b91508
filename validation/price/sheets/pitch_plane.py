"""Problem sheets of the pitch-plane vehicle: on a road, under wheel forces, with noise, and with prescribed pitch."""

from pathlib import Path

import numpy as np

from models.engines.assembly import Settings
from models.engines.protocol import build
from models.road.study import FADE_IN_LENGTH, study_road
from validation.price.problems import force_excited, road_excited
from validation.price.problems.force_excited import DURATION, FINE_STEP, SAMPLE_PERIOD, ForceExcited
from validation.price.problems.road_excited import REFERENCE_SOLVERS, SPEED
from validation.price.sheets.page import ReferenceValue, write_columns
from validation.price.sheets.page import write as write_page

FORCE_PROBLEMS = (force_excited.problem, force_excited.noisy_problem, force_excited.prescribed_pitch_problem)
STATE_NAMES = ("z1", "z2", "z3", "pitch", "z1_rate", "z2_rate", "z3_rate", "pitch_rate")
STATE_UNITS = ("m", "m", "m", "rad", "m/s", "m/s", "m/s", "rad/s")
EQUATIONS_TEXT = r"""
    m1 z1'' = m1 g + F3 - f1            F3 = k3 (z3 - z1 - b sin p) + d3 (z3' - z1' - b p' cos p)
    m2 z2'' = m2 g + F4 - f2            F4 = k4 (z3 - z2 + a sin p) + d4 (z3' - z2' + a p' cos p)
    m3 z3'' = m3 g - F3 - F4
    I p''   = cos p (b F3 - a F4) + M

z positive down, the pitch p positive nose up; f1, f2 are the wheel forces, positive up.
"""
ROAD_FORCES_TEXT = f"""
    f1 = k1 (z1 - r(s)) + d1 (z1' - v r'(s))                s = v t
    f2 = k2 (z2 - r(s - l)) + d2 (z2' - v r'(s - l))        l = a + b
    r(s) = -w(s / {FADE_IN_LENGTH:g} m) sum_i A_i sin(W_i s + P_i)  for s > 0, else 0
    w(x) = 10 x^3 - 15 x^4 + 6 x^5  for x < 1, else 1

r is the road, positive down; A_i [m], W_i [rad/m], P_i [rad] are the lines of `road.csv`; v = {SPEED:g} m/s. M is zero.
"""


def write(output_folder: Path) -> list[ReferenceValue]:
    """Write all four problem sheets with their input files; returns the reference values."""
    return [
        *write_road_sheet(output_folder),
        *(value for make in FORCE_PROBLEMS for value in write_force_sheet(make(False), output_folder)),
    ]


def write_road_sheet(output_folder: Path) -> list[ReferenceValue]:
    """Write the problem sheet of the vehicle on the study road; returns the reference values."""
    problem, road = road_excited.problem(False), study_road()
    write_columns(
        output_folder,
        "road",
        ("amplitude [m]", "wavenumber [rad/m]", "phase [rad]"),
        np.column_stack([road.amplitude, road.wavenumber, road.phase]),
    )
    end = np.array([road_excited.DURATION])
    true, *other_solutions = (
        road_excited.continuous_solution(problem.assembly, *solver)(end)[:, 0] for solver in REFERENCE_SOLVERS[False]
    )
    sure = np.max([np.abs(other_solution - true) for other_solution in other_solutions], axis=0)
    return write_page(
        output_folder,
        "road",
        problem.title,
        f"{EQUATIONS_TEXT}{ROAD_FORCES_TEXT}\n{_parameters_and_start(problem)}",
        f"End values at {problem.duration:g} s ({problem.reference}); the "
        "uncertainty is the largest difference of the three.",
        _reference_values("road", problem.duration, true, sure),
    )


def write_force_sheet(priced_problem: ForceExcited, output_folder: Path) -> list[ReferenceValue]:
    """Write the problem sheet and the input file of a vehicle under wheel forces; returns the reference values."""
    signal, guided = priced_problem.assembly.input, bool(priced_problem.assembly.guided)
    assert signal is not None
    heads = ["time [s]", "front [N]", "rear [N]", *(["pitch [rad]"] if guided else [])]
    sample_times = SAMPLE_PERIOD * np.arange(round(DURATION / SAMPLE_PERIOD) + 1)
    inputs = signal.sample(0.0, SAMPLE_PERIOD, len(sample_times))[:, : len(heads) - 1]
    write_columns(output_folder, priced_problem.key, heads, np.column_stack([sample_times, inputs]))
    return write_page(
        output_folder,
        priced_problem.key,
        priced_problem.title,
        _sheet_text(priced_problem, guided),
        f"End values at {DURATION:g} s "
        f"({priced_problem.reference}); the uncertainty is the largest difference of the two over the run.",
        final_values(priced_problem),
    )


def final_values(priced_problem: ForceExcited) -> list[ReferenceValue]:
    """Reference values of all final states; the uncertainty is the largest difference between two reference solvers
    over the run."""
    runs = [
        build("reference", priced_problem.assembly, settings).run()
        for settings in (Settings("RK4", FINE_STEP, DURATION), Settings("DOP853", SAMPLE_PERIOD, DURATION, 1e-12))
    ]
    true, other_states = (run.states[:: (len(run.states) - 1) // round(DURATION / SAMPLE_PERIOD)] for run in runs)
    return _reference_values(priced_problem.key, DURATION, true[-1], np.abs(true - other_states).max(axis=0))


def _reference_values(
    problem_name: str, time: float, final_states: np.ndarray, uncertainties: np.ndarray
) -> list[ReferenceValue]:
    return [
        ReferenceValue(problem_name, *entry[:2], time, *map(float, entry[2:]))
        for entry in zip(STATE_NAMES, STATE_UNITS, final_states, uncertainties, strict=True)
    ]


def _parameters_and_start(priced_problem: ForceExcited | road_excited.RoadExcited) -> str:
    """Text of a problem's parameters and initial state."""
    numbers = ", ".join(f"{name} = {value!r}" for name, value in priced_problem.assembly.parameters)
    start = ", ".join(
        f"{name} = {value:.16e}" for name, value in zip(STATE_NAMES, priced_problem.assembly.initial, strict=True)
    )
    return f"Parameters (SI): {numbers}.\n\nStart: {start}."


def _sheet_text(priced_problem: ForceExcited, is_guided: bool) -> str:
    pitch = (
        " The pitch is a quintic spline through its samples (not-a-knot at both ends), prescribed; M is the "
        "moment that this takes."
        if is_guided
        else " M is zero."
    )
    question = ", ".join(f"largest error of the {name} [{unit}]" for name, unit in priced_problem.units.items())
    return f"""{priced_problem.note}
{EQUATIONS_TEXT}
{_parameters_and_start(priced_problem)}

Input: `{priced_problem.key}.csv`; between samples, forces are linear.{pitch}

Asked for: {question}, at the samples up to {DURATION:g} s. Steps should end on the samples, where the
input has kinks."""
