"""Drift by index reduction compared with drift by noise: which constraint formulations have which, and what cures
it."""

from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from models.core.noise import normal_samples
from models.core.runge_kutta import runge_kutta_step
from models.core.time_series import write_time_series
from models.engines.assembly import Assembly, Settings
from models.engines.protocol import build
from models.engines.reference import compiled_derivative
from models.systems.pitch_plane.scene import Scene, assembly_of_scene
from models.vehicles.description import mass_damping_stiffness
from models.vehicles.pitch_plane_equations import parameter_numbers
from validation.common.rows import CaseAnswer, Drawn, Observed, Row, Saved, System, behaviour_row, not_run
from validation.common.scenes import force_scene, on_paper_road, virtual_drive
from validation.hard_cases.prescribed_pitch import UncheckedExudyn

TITLE = "Drift by index reduction, and drift by noise"
SYSTEM: System = "drift"
TIME_STEP = 1e-3
START_ERROR, START_RATE_ERROR = 1e-4, 1e-4
"""Error of the initial angle (rad) and rate (rad/s), of the size that a measured start has or that rounding accumulates
in a long run."""
BAUMGARTE_RATE = 10.0
"""Rate (1/s) of Baumgarte's stabilisation: slow compared with a step of 1 ms, fast compared with a run."""
SEED, FORCE_NOISE, RATE_WALK = 31, 31.0, np.deg2rad(0.2)
"""Seed of the noise; standard deviation (N) of the noise on each force sample; angle random walk (rad per sqrt(s)) of a
cheap gyro."""
PITCH_BANDWIDTH = 5.0
"""Bandwidth (Hz) of the pitch angle that is integrated from such a gyro."""
HAND_WRITTEN_FORMULATIONS: dict[str, Saved] = {
    "index 1": {},
    "index 1, Baumgarte": {"baumgarte_rate": BAUMGARTE_RATE},
    "index 1, projection": {"with_projection": True},
}
EXUDYN_INTEGRATORS = {"index 2": "TrapezoidalIndex2", "index 3": "GeneralizedAlpha"}
MISSING_FORMULATIONS = (
    (
        "exudyn.1",
        "Exudyn is asked to run at index 1",
        "has no formulation on the level of accelerations; its explicit solvers leave "
        "constraints out without a word, which the adapter refuses",
    ),
    ("exudyn.baumgarte", "Exudyn is asked for Baumgarte's stabilisation", "has none: its index 3 needs none"),
    ("exudyn.projection", "Exudyn is asked for projection", "has none between steps"),
    (
        "mujoco",
        "MuJoCo is asked to run at index 3, 2 or 1",
        "has no hard constraints: an equality is a spring and a damper on the "
        "level of accelerations, so the adapter leaves the pitch out of the coordinates",
    ),
)
"""Formulations that an engine does not have: row id, description, and reason (Exudyn 1.13, MuJoCo 4)."""


@dataclass(frozen=True)
class MeasuredPitchDrive:
    """Virtual measurement on the study road: folder with its files, duration (s), and true pitch (n,) in rad."""

    work_folder: Path
    duration: float
    true_pitch: np.ndarray

    def scene(self, **effect_tables: Any) -> Scene:
        """Scene of the vehicle under the measured forces, which are interpolated linearly."""
        return force_scene(self.work_folder, step=TIME_STEP, duration=self.duration, effects=effect_tables)

    def prescribed_assembly(self, file_name: str = "pitch.csv", **effect_values: Any) -> Assembly:
        """Assembly of the vehicle whose pitch is prescribed by one of the files."""
        return assembly_of_scene(self.scene(prescribed_pitch={"file": file_name, **effect_values}))


@on_paper_road()
def measure(quick: bool, work_folder: Path) -> CaseAnswer:
    """Rows of pitch gaps after a start off the constraint, by formulation, and of drift by noise with and without
    prescribed pitch. A quick run has short runs."""
    with TemporaryDirectory() as name:
        drive = _measured_drive(Path(name), 0.2 if quick else 4.0)
        gaps, laws = _pitch_gaps(drive), _pitch_gap_laws(drive)
        walked = _pitch_errors(
            drive.prescribed_assembly("gyro.csv", bandwidth=PITCH_BANDWIDTH), drive
        )  # from a start on the constraint
        loose = _unguided_pitch_errors(_measured_drive(Path(name), 1.0 if quick else 12.0))
    rows = [
        *_pitch_gap_rows(gaps, laws, drive.duration),
        *_noise_drift_rows(walked, loose),
        *(not_run(f"index_reduction.{id}", SYSTEM, words, why) for id, words, why in MISSING_FORMULATIONS),
    ]
    times = TIME_STEP * np.arange(len(next(iter(gaps.values()))))
    return rows, {
        "times": times.tolist(),
        "gaps": {name: gap.tolist() for name, gap in gaps.items()},
        "walked": {name: error.tolist() for name, error in walked.items()},
        "loose": {name: error[::10].tolist() for name, error in loose.items()},
    }


def _measured_drive(work_folder: Path, duration: float) -> MeasuredPitchDrive:
    """Make a virtual measurement on the study road; write its forces, its pitch, and the pitch integrated from a noisy
    gyro."""
    measured = virtual_drive(work_folder, duration, TIME_STEP, TIME_STEP)
    walk = RATE_WALK * np.sqrt(TIME_STEP) * np.cumsum(normal_samples(SEED, 0, len(measured.times), 1)[:, 0])
    write_time_series(work_folder / "gyro.csv", {"pitch": ("rad", measured["pitch"] + walk)}, TIME_STEP)
    return MeasuredPitchDrive(work_folder, duration, measured["pitch"])


def _pitch_errors(assembly: Assembly, measured_drive: MeasuredPitchDrive) -> dict[str, np.ndarray]:
    """Difference (n,) in rad between the run's pitch and the true pitch for every constraint formulation, from the
    assembly's initial state."""
    duration = measured_drive.duration
    paths = {
        name: IndexOneVehicle(assembly, **values).run(TIME_STEP, duration)
        for name, values in HAND_WRITTEN_FORMULATIONS.items()
    }
    for name, integrator in EXUDYN_INTEGRATORS.items():
        paths[name] = (
            UncheckedExudyn(assembly, Settings(integrator, TIME_STEP, duration, spectral_radius=0.6)).run().states
        )
    paths |= {
        f"eliminated, {engine}": build(engine, assembly, Settings("RK4", TIME_STEP, duration)).run().states
        for engine in ("reference", "mujoco")
    }
    return {name: states[:, 3] - measured_drive.true_pitch for name, states in paths.items()}


def _pitch_gaps(measured_drive: MeasuredPitchDrive) -> dict[str, np.ndarray]:
    """Difference (n,) in rad between the run's pitch and the prescribed pitch for every constraint formulation, if the
    start is wrong by START_ERROR and START_RATE_ERROR."""
    prescribed_assembly = measured_drive.prescribed_assembly()
    start = prescribed_assembly.initial.copy()
    start[[3, 7]] += START_ERROR, START_RATE_ERROR
    return _pitch_errors(replace(prescribed_assembly, initial=start), measured_drive)


def _unguided_pitch_errors(measured_drive: MeasuredPitchDrive) -> dict[str, np.ndarray]:
    """Difference (n,) in rad between the run's pitch and the true pitch under noisy forces and without a prescribed
    pitch, for several solvers."""
    noisy = assembly_of_scene(measured_drive.scene(force_noise={"deviation": FORCE_NOISE, "seed": SEED}))
    solvers = {
        "Exudyn's solver of index 2": ("exudyn", "TrapezoidalIndex2"),
        "Exudyn's solver of index 3": ("exudyn", "GeneralizedAlpha"),
        "Runge-Kutta": ("reference", "RK4"),
    }
    return {
        name: build(engine, noisy, Settings(integrator, TIME_STEP, measured_drive.duration, spectral_radius=0.6))
        .run()
        .states[:, 3]
        - measured_drive.true_pitch
        for name, (engine, integrator) in solvers.items()
    }


def _pitch_gap_laws(measured_drive: MeasuredPitchDrive) -> dict[str, tuple[np.ndarray, str]]:
    """For each formulation, the closed form of the pitch error (n,) in rad after the wrong start, and the reason for
    this form."""
    times = TIME_STEP * np.arange(len(measured_drive.true_pitch))
    return {
        "index 1": (
            pitch_gap_law(times, START_ERROR, START_RATE_ERROR),
            "g'' = 0 keeps both errors: g = g(0) + g'(0) t",
        ),
        "index 1, Baumgarte": (
            pitch_gap_law(times, START_ERROR, START_RATE_ERROR, BAUMGARTE_RATE),
            "g'' + 2 alpha g' + alpha^2 g = 0",
        ),
        "index 2": (
            np.append(
                START_ERROR,
                START_ERROR + TIME_STEP / 2 * START_RATE_ERROR + _prescribed_pitch_quadrature_error(measured_drive)[1:],
            ),
            "g' = 0 keeps the error of the angle, and adds that of the trapezoidal rule over the rate",
        ),
    }


def _pitch_gap_rows(
    pitch_gaps: dict[str, np.ndarray], gap_laws: dict[str, tuple[np.ndarray, str]], duration: float
) -> list[Row]:
    """Rows: difference of each formulation's pitch gap from its closed law."""
    start = f"from a start off by {START_ERROR:g} rad and {START_RATE_ERROR:g} rad/s"
    rows = [
        Observed(
            f"index_reduction.law.{_formulation_in_row_id(name)}",
            SYSTEM,
            f"{name}: difference of the gap {start} from its law",
            float(np.abs(pitch_gaps[name] - law).max() / START_ERROR),
            "of the start's",
        ).at_most(1e-3, why, "closed form")
        for name, (law, why) in gap_laws.items()
    ]
    none = {
        "index 1, projection": "each step ends on the constraint",
        "index 3": "the angle itself is the constraint",
        "eliminated, reference": "the pitch is no unknown",
        "eliminated, mujoco": "the pitch is no unknown",
    }
    rows += [
        Observed(
            f"index_reduction.none.{_formulation_in_row_id(name)}",
            SYSTEM,
            f"{name}: gap after the first step {start}",
            float(np.abs(pitch_gaps[name][1:]).max()),
            "rad",
        ).at_most(1e-12, why, "closed form")
        for name, why in none.items()
    ]
    rows.append(
        Observed(
            "index_reduction.gain",
            SYSTEM,
            f"index 1: ratio of the gap after {duration:g} s to the gap at the start",
            float(pitch_gaps["index 1"][-1] / START_ERROR),
            "",
        ).beside(1 + START_RATE_ERROR / START_ERROR * duration, "it never stops", "none")
    )
    return [*rows, _exudyn_index_two_row()]


def _prescribed_pitch_quadrature_error(measured_drive: MeasuredPitchDrive) -> np.ndarray:
    """Error (n,) in rad of the prescribed pitch if its rate is integrated by the trapezoidal rule."""
    signal = measured_drive.prescribed_assembly().input
    assert signal is not None
    angle, rate = signal.sample(0.0, TIME_STEP, len(measured_drive.true_pitch))[:, 2:4].T
    summed = np.concatenate(([0.0], np.cumsum(0.5 * TIME_STEP * (rate[1:] + rate[:-1]))))
    return summed - (angle - angle[0])


def _exudyn_index_two_row() -> Row:
    """Row: outcome of Exudyn's generalised-alpha solver with its flag for index 2."""
    import exudyn as exu

    system = exu.SystemContainer().AddSystem()
    system.Assemble()
    options: Any = exu.SimulationSettings()
    options.solution.file.write = False
    options.timeIntegration.generalizedAlpha.useIndex2Constraints = True
    try:
        system.SolveDynamic(options, solverType=exu.DynamicSolverType.GeneralizedAlpha)
    except (exu.ExudynError, RuntimeError, ValueError) as error:
        ended = "refused" if "useNewmark" in str(error) else str(error)
    else:
        ended = "answered"
    return behaviour_row(
        "index_reduction.exudyn.alpha_2",
        SYSTEM,
        "outcome of Exudyn's generalised-alpha solver with its flag for index 2",
        ended,
        "refused",
        "index 2 is there with the trapezoidal rule alone",
    )


def _noise_drift_rows(guided_errors: dict[str, np.ndarray], unguided_errors: dict[str, np.ndarray]) -> list[Row]:
    """Rows: the drift by noise, with and without prescribed pitch, is the same in all formulations."""
    rows = []
    guided = "guided by the integrated rate of a noisy gyro"
    free = f"without guidance, {FORCE_NOISE:g} N of noise on each sample of the forces"
    why = "stabilisation puts the vehicle where the data is, and the data is what drifts"
    for id, words, errors in (("walk", guided, guided_errors), ("force", free, unguided_errors)):
        paths = np.array(list(errors.values()))
        size = float(np.sqrt(np.mean(paths[-1] ** 2)))
        rows.append(
            Observed(f"index_reduction.{id}.size", SYSTEM, f"rms error of the pitch, {words}", size, "rad").beside(
                "not zero", "noise, integrated once or twice: the data itself drifts", "none"
            )
        )
        apart = float(np.ptp(paths, axis=0).max()) / size
        rows.append(
            Observed(
                f"index_reduction.{id}",
                SYSTEM,
                f"largest difference of the pitch error between {len(paths)} formulations, over its rms, {words}",
                apart,
                "",
            ).at_most(0.05, why, "native")
        )
    return rows


def _formulation_in_row_id(formulation_name: str) -> str:
    """Part of a row id for a constraint formulation."""
    return formulation_name.replace(", ", ".").replace(" ", "_")


def draw(case_data: Saved) -> Drawn:
    """Plot pitch gaps after a wrong start by formulation, and pitch errors by noise, which are equal in all
    formulations."""
    from models.drawing.figures import COLUMN_WIDTH, add_heading, subplots

    figure, (left, right) = subplots(1, 2, figsize=(COLUMN_WIDTH, 3.6))
    for name, gap in case_data["gaps"].items():
        if max(map(abs, gap[1:])) > 1e-12:
            left.semilogy(case_data["times"], [abs(value) for value in gap], label=name)
    left.set(
        xlabel="time [s]",
        ylabel="|pitch - prescribed pitch| [rad]",
        ylim=(1e-9, None),
        title=f"Start off by {START_ERROR:g} rad and {START_RATE_ERROR:g} rad/s",
    )
    left.legend(title="projection, index 3, eliminated: 0", title_fontsize=8)
    for i, (name, error) in enumerate(case_data["loose"].items()):
        right.plot([10 * TIME_STEP * j for j in range(len(error))], error, label=name, linewidth=4 - 1.5 * i)
    right.set(xlabel="time [s]", ylabel="pitch - true pitch [rad]", title="No guidance, noise on the forces")
    right.legend()
    add_heading(figure, "Drift of a reduced constraint can be cured, drift by noise cannot")
    for axis in (left, right):
        axis.locator_params(axis="x", nbins=5)  # runs of the quick report are short, their times have many digits
    caption = (
        "Drift by index reduction is the constraint's own and can be cured; drift by noise is the data's, and no "
        "formulation and no solver sees it."
    )
    return [(caption, figure)]


CONSTRAINT_JACOBIAN = np.array([[0.0, 0.0, 0.0, 1.0]])
"""Constraint matrix G (1, 4): the pitch alone is prescribed."""


class IndexOneVehicle:
    """The vehicle with prescribed pitch, its constraint differentiated twice (index 1).

    baumgarte_rate : Baumgarte's rate in 1/s, 0 for none; with_projection : whether each step ends on the constraint
    """

    def __init__(self, assembly: Assembly, baumgarte_rate: float = 0.0, with_projection: bool = False) -> None:
        self.assembly, self.alpha, self.with_projection = assembly, baumgarte_rate, with_projection
        self._mass = mass_damping_stiffness(assembly.vehicle)[0]
        self._solve = np.linalg.inv(
            np.block([[self._mass, -CONSTRAINT_JACOBIAN.T], [CONSTRAINT_JACOBIAN, np.zeros((1, 1))]])
        )
        self._free = compiled_derivative("force", assembly.vehicle.geometry)
        self._p = parameter_numbers(assembly.parameters, assembly.vehicle)

    def run(self, time_step: float, duration: float) -> np.ndarray:
        """States (n + 1, 8) by classical Runge-Kutta from the assembly's initial state, which may be off the
        constraint."""
        assert self.assembly.input is not None
        count = round(duration / time_step)
        inputs = self.assembly.input.sample(0.0, time_step / 2, 2 * count + 1)
        states = np.empty((count + 1, 8))
        y = states[0] = self.assembly.initial
        acting = dict[float, np.ndarray]()

        def rate(time: float, y: np.ndarray) -> np.ndarray:
            return self._derivative(y, acting[time])

        for i in range(count):
            acting |= zip((0.0, 0.5 * time_step, time_step), inputs[2 * i : 2 * i + 3], strict=True)
            y = runge_kutta_step(rate, 0.0, y, time_step)
            states[i + 1] = y = self._projection(y, acting[time_step]) if self.with_projection else y
        return states

    def _derivative(self, state: np.ndarray, prescribed_input: np.ndarray) -> np.ndarray:
        """Derivative y' (8,) of the state under the input u = (f1, f2, beta, beta', beta'')."""
        dy = self._free(state, prescribed_input[:2].copy(), self._p)
        wanted = (
            prescribed_input[4]
            - 2 * self.alpha * (state[7] - prescribed_input[3])
            - self.alpha**2 * (state[3] - prescribed_input[2])
        )
        dy[4:] = (self._solve @ np.append(self._mass @ dy[4:], wanted))[:4]
        return dy

    def _projection(self, state: np.ndarray, prescribed_input: np.ndarray) -> np.ndarray:
        """Projection of a state onto the constraint: the nearest state by the metric of the kinetic energy."""
        along = self._solve[:4, 4]
        return state - np.concatenate(
            (along * (state[3] - prescribed_input[2]), along * (state[7] - prescribed_input[3]))
        )


def pitch_gap_law(times: np.ndarray, start_gap: float, start_rate: float, alpha: float = 0.0) -> np.ndarray:
    """Solution g (n,) in rad of g'' + 2 alpha g' + alpha^2 g = 0 from g(0) = start_gap (rad) and g'(0) = start_rate
    (rad/s)."""
    return (start_gap + (start_rate + alpha * start_gap) * times) * np.exp(-alpha * times)
