"""Guards against wrong results: what cannot be right is refused before the run or raised after it, in every
implementation."""

from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from models.core.errors import InputError, RunFailed
from models.engines.assembly import Assembly
from models.engines.catalogue import CATALOGUE, UNAVAILABLE_INTEGRATORS
from validation.common import full_disk, wrong_engines
from validation.common.rows import CaseAnswer, Observed, Row, Saved, System, Table, behaviour_row
from validation.hard_cases import prescribed_pitch, sampled_input, setups

TITLE = "Guards against silent wrong answers"
SYSTEM: System = "pitch-plane"
UNSTABLE_TIME_STEPS = (2e-3, 4e-3, 5e-3, 8e-3, 1e-2)
RUN_DURATIONS = (0.04, 0.2, 2.0)
QUICK_TIME_STEPS, QUICK_DURATIONS = UNSTABLE_TIME_STEPS[::2], RUN_DURATIONS[:2]
"""Steps and durations (s) of the runs at unstable steps, in a quick run."""
SILENT_ERROR_LIMIT = 1.0
"""Error, divided by the motion, above which a complete run counts as silently wrong: 100 % wrong without a warning."""
RunFunction = Callable[..., Any]


def run_ending(attempt_run: Callable[[], Any]) -> str:
    """How an attempt ends: "refused" (InputError), "raised" (RunFailed) or "answered"."""
    try:
        attempt_run()
    except InputError:
        return "refused"
    except RunFailed:
        return "raised"
    return "answered"


def integrator_names(engine_name: str, is_adaptive: bool | None = None) -> list[str]:
    """Integrators that an engine offers: fixed-step, adaptive, or both if ``is_adaptive`` is None."""
    return [
        name
        for name, facts in CATALOGUE[engine_name].items()
        if (engine_name, name) not in UNAVAILABLE_INTEGRATORS and is_adaptive in (None, facts.adaptive)
    ]


def study_road_assembly() -> Assembly:
    """Assembly of the vehicle on the study road."""
    return setups.vehicle(effects={"road": {"source": "study", "speed": 20.0}})


@cache
def _tight_solution(duration: float) -> np.ndarray:
    """States at every millisecond by an integrator with tight tolerances."""
    return setups.tight_solution(study_road_assembly(), 1e-3, duration).states


def unstable_run_counts(engine_name: str, run_function: RunFunction, quick: bool = False) -> dict[str, int]:
    """Numbers of runs that end right, refused, raised or silently wrong, for every fixed-step integrator at steps of 2
    to 10 ms and durations of 0.04 and 0.2 s, in a full run also of 2 s."""
    counts = {"right": 0, "refused": 0, "raised": 0, "SILENT": 0}
    for name in integrator_names(engine_name, is_adaptive=False):
        for step in QUICK_TIME_STEPS if quick else UNSTABLE_TIME_STEPS:
            for duration in QUICK_DURATIONS if quick else RUN_DURATIONS:
                counts[_ending_of_unstable_run(engine_name, name, step, duration, run_function)] += 1
    return counts


def _ending_of_unstable_run(
    engine_name: str, integrator_name: str, time_step: float, duration: float, run_function: RunFunction
) -> str:
    """How a run at an unstable step ends: right, refused, raised or silently wrong."""
    try:
        states = run_function(engine_name, study_road_assembly(), time_step, duration, integrator_name).states
    except InputError:
        return "refused"
    except RunFailed:
        return "raised"
    truth = _tight_solution(duration)[:: round(time_step / 1e-3)]
    share = np.abs(states - truth).max() / np.abs(truth - truth[0]).max()
    return "right" if share <= SILENT_ERROR_LIMIT else "SILENT"


def nan_force_endings(engine_name: str) -> dict[str, str]:
    """How runs end if a force sample is NaN and has not passed the file reader, for every integrator and both
    interpolations."""
    base, endings = setups.vehicle(), {}
    for name in integrator_names(engine_name):
        for is_held in (True, False):
            forces = setups.static_forces(base, 102, 1e-3, is_held)
            forces.values[57, 0] = np.nan
            attempt = partial(setups.run, engine_name, setups.driven_by_forces(base, forces), 1e-3, 0.1, name)
            endings[f"{name}, {'held' if is_held else 'linear'}"] = run_ending(attempt)
    return endings


def prescribed_pitch_endings(engine_name: str) -> dict[str, str]:
    """How runs with a prescribed pitch end in each integrator that cannot solve constraints."""
    wrong = [name for name in integrator_names(engine_name) if not CATALOGUE[engine_name][name].constraints]
    return {
        name: run_ending(partial(setups.run, engine_name, prescribed_pitch.guided_assembly(), 1e-3, 0.5, name))
        for name in wrong
    }


def unchecked_prescribed_pitch_endings() -> dict[str, str]:
    """How runs with a prescribed pitch end in Exudyn's explicit integrators if the check before the run is bypassed.
    The guard after the run compares the multiplier with the balance of moments."""
    names = [
        name
        for name in integrator_names("exudyn", is_adaptive=False)
        if name not in setups.CONSTRAINED_INTEGRATORS.values()
    ]
    explicit = [name for name in names if name != "TrapezoidalIndex2"]
    scene = prescribed_pitch.guided_assembly()
    return {name: run_ending(partial(setups.unchecked_run, "exudyn", scene, 1e-3, 0.5, name)) for name in explicit}


def _unexpected_endings(run_endings: dict[str, str], expected_ending: str) -> str:
    """The expected ending if all runs ended so; else text that lists the runs that did not."""
    unexpected = [f"{name}: {ended}" for name, ended in run_endings.items() if ended != expected_ending]
    return "; ".join(unexpected) or expected_ending


def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows for each engine; a quick run has all of them, over fewer unstable steps and durations."""
    rows: list[Row] = []
    endings: Saved = {}
    for engine in CATALOGUE:
        rows += _unstable_step_rows(engine, endings, quick)
        rows += _wrong_input_rows(engine)
    for name, endings_of in (
        ("refused", prescribed_pitch_endings("exudyn")),
        ("raised", unchecked_prescribed_pitch_endings()),
    ):
        how = "" if name == "refused" else ", with the check bypassed"
        rows.append(
            behaviour_row(
                f"guards.constraint.exudyn.{name}",
                SYSTEM,
                f"an integrator that ignores the active constraint, Exudyn, all {len(endings_of)}{how}",
                _unexpected_endings(endings_of, name),
                name,
                "Exudyn's explicit solvers freeze or free the pitch without a word",
            )
        )
    rows += [_explicit_solver_row(engine) for engine in ("reference", "mujoco")]
    return [*rows, *_outside_engine_rows(), _full_disk_row(work_folder)], {"unstable": endings}


def _outside_engine_rows() -> list[Row]:
    """Rows: the guards report wrong integrators from outside the project in every run, and pass a right one."""
    silent, right = (
        wrong_engines.integrators_that_pass(),
        wrong_engines.integrators_that_pass((wrong_engines.FaultlessIntegrator,)),
    )
    names = ", ".join(kind.__name__ for kind in wrong_engines.WRONG_ENGINES)
    return [
        Observed(
            "guards.outside.silent",
            SYSTEM,
            f"wrong integrators from outside the project that run without a warning, of {names}",
            len(silent),
            "",
        ).at_most(0.0, "every such run is held against the reference", "native"),
        behaviour_row(
            "guards.outside.right",
            SYSTEM,
            "a right integrator from outside the project passes the same comparison",
            "answered" if right else "raised",
            "answered",
            "a check that refuses everything is no check",
        ),
    ]


def _full_disk_row(work_folder: Path) -> Row:
    """Row: number of moments at which a full disk leaves an incomplete file or is not reported."""
    return Observed(
        "guards.full_disk",
        SYSTEM,
        f"number of moments (of {full_disk.MOMENTS_TRIED}) at which a full disk leaves an incomplete "
        "file or is not reported",
        full_disk.damaged_moments(work_folder),
        "",
    ).at_most(0.0, "files are written whole or not at all", "none")


def _unstable_step_rows(engine_name: str, run_endings: Saved, quick: bool) -> list[Row]:
    """Rows: no run at an unstable step gives a silent wrong result; if the check before the run is bypassed, the guard
    after the run raises an error."""
    checked = unstable_run_counts(engine_name, setups.run, quick)
    past = unstable_run_counts(engine_name, setups.unchecked_run, quick)
    run_endings[engine_name] = {"checked": checked, "unchecked": past}
    total = sum(checked.values())
    return [
        Observed(
            f"guards.unstable.{engine_name}",
            SYSTEM,
            f"silent wrong answers of {total} runs at 2 to 10 ms with every fixed-step integrator, {engine_name}",
            checked["SILENT"],
            "runs",
        ).at_most(0.0, "a step beyond the stability limit is refused with the limit named", "native"),
        behaviour_row(
            f"guards.unstable.{engine_name}.unchecked",
            SYSTEM,
            f"RK4 at 5 ms over 2 s with the step check bypassed, {engine_name}",
            run_ending(lambda: setups.unchecked_run(engine_name, study_road_assembly(), 5e-3, 2.0)),
            "raised",
            "finite, size and time are checked after every run",
        ),
    ]


def _wrong_input_rows(engine_name: str) -> list[Row]:
    """Rows: NaN among the forces, and steps that do not divide the sampling period or the duration, are detected."""
    numbers = nan_force_endings(engine_name)
    caught = {name: "caught" if ended in ("raised", "refused") else ended for name, ended in numbers.items()}
    with TemporaryDirectory() as files_folder:
        file = run_ending(lambda: sampled_input.state_from_damaged_file(engine_name, Path(files_folder)))
    return [
        behaviour_row(
            f"guards.nan-file.{engine_name}",
            SYSTEM,
            f"a force file that holds NaN, {engine_name}",
            file,
            "refused",
            "the reader names the line",
        ),
        behaviour_row(
            f"guards.nan.{engine_name}",
            SYSTEM,
            f"NaN in forces that the reader has not checked, all {len(numbers)} integrators and rules, {engine_name}",
            _unexpected_endings(caught, "caught"),
            "caught",
            "Exudyn's explicit solvers return True with NaN",
        ),
        behaviour_row(
            f"guards.step-sampling.{engine_name}",
            SYSTEM,
            f"a step that does not divide the sampling period, {engine_name}",
            run_ending(lambda: sampled_input.state_with_uneven_steps(engine_name, Path())),
            "refused",
            "a held sample would change in a step",
        ),
        behaviour_row(
            f"guards.step-duration.{engine_name}",
            SYSTEM,
            f"a step that does not divide the duration, {engine_name}",
            run_ending(lambda: setups.run(engine_name, setups.vehicle(), 3e-4, 1.0)),
            "refused",
            "the run would end elsewhere",
        ),
    ]


def _explicit_solver_row(engine_name: str) -> Row:
    """Row: error of the enforced moment by an explicit solver in the hand-written reference and in MuJoCo, where the
    pitch is an input and no constraint."""
    error = prescribed_pitch.explicit_solver_error(engine_name, Path())
    return Observed(
        f"guards.constraint.{engine_name}",
        SYSTEM,
        f"error of the enforced moment by an explicit solver, {engine_name}: the pitch is an input, no constraint is "
        "active",
        error,
        "of its rms",
    ).at_most(1e-4, "the project's bound at 1 ms", "closed form")


def tables(case_data: Saved) -> list[Table]:
    """Table of how runs end at stable and unstable steps, with the check before the run and without it."""
    words = ("right", "refused", "raised", "SILENT")
    rows = tuple(
        (engine, how, *(str(counts[word]) for word in words))
        for engine, both in case_data["unstable"].items()
        for how, counts in both.items()
    )
    note = (
        f"Every fixed-step integrator at steps of {', '.join(f'{1e3 * step:g}' for step in UNSTABLE_TIME_STEPS)} ms "
        "over "
        f"{', '.join(f'{duration:g}' for duration in RUN_DURATIONS)} s on the study road. Silent: a complete run "
        "that is "
        "wrong by more than the motion itself. Past the check, short unstable runs are finite, small and wrong."
    )
    return [Table("Runs at too long steps", note, ("engine", "", *words), rows)]
