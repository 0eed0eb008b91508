"""Test problems: the pitch-plane vehicle, without a road, under samples of its wheel forces, before it drifts off.

The forces are a virtual measurement of the study road at 100 Hz, linear between the samples: every solver reads the
same ones, so the error here is the integrator's alone, and not that of the interpolation, from which such a run
drifts. Adaptive solvers restart at each sample; what they do is in the case ``drift_solvers``. Beside it stand the same
with the error of a sensor on every sample, and with the pitch prescribed, as measured on the road.
"""

import math
from dataclasses import replace
from functools import cache

import numpy as np

from models.advice.price.problem import Setting
from models.core.noise import normal_samples
from models.core.signals import SampledSignal, Smooth, StackedSignal
from models.core.trajectory import Trajectory
from models.engines.assembly import Assembly, Settings
from models.engines.model import Model
from models.engines.protocol import build
from models.systems.pitch_plane.run import output_channels
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import assembly_of_scene
from validation.price.problems import Curves, curves_of_methods, largest_differences, milliseconds, settings_of_curves
from validation.price.problems.road_excited import (
    MUJOCO_METHODS,
    SPEED,
    result_with_assumptions,
    scene,
    setting,
    settings_of,
)

DURATION, SAMPLING_RATE = 2.0, 100.0
"""Length of the run (s); sampling rate of the forces (Hz), whose period every fixed step divides."""
SAMPLE_PERIOD = 1 / SAMPLING_RATE
FINE_STEP = SAMPLE_PERIOD / 1280
"""Step (s) of the reference solution by RK4, with every sample at a step: its error is that of rounding."""
STEPS = milliseconds(2.5, 2, 1.25, 1, 0.5, 0.25, 0.125, 0.0625)
FULL_STEPS: Curves = {
    ("reference", "RK4"): STEPS,
    ("exudyn", "RK44"): STEPS[:-1],
    **curves_of_methods("exudyn", STEPS, "ExplicitMidpoint", "ExplicitEuler"),
    ("exudyn", "GeneralizedAlpha 0.9"): (*milliseconds(10), *STEPS),
    **curves_of_methods("exudyn", STEPS[:-1], "GeneralizedAlpha 0.6", "TrapezoidalIndex2"),
    ("mujoco", "RK4"): STEPS[:-1],
    ("mujoco", "Euler"): STEPS,
    **curves_of_methods("mujoco", STEPS[:-1], "implicit", "implicitfast", "discrete"),
}
"""Steps (s) by engine and method; the finest are for the engines' defaults and methods whose order shows late."""
QUICK_STEPS: Curves = {
    ("reference", "RK4"): milliseconds(0.5, 0.25, 0.125),
    ("exudyn", "ExplicitEuler"): milliseconds(1, 0.5, 0.25),
    ("mujoco", "Euler"): milliseconds(2, 1, 0.5),
}
"""Steps (s), by engine and method, that the quick report takes."""
PRESCRIBED_PITCH_STEPS: Curves = {
    ("reference", "RK4"): STEPS,
    **curves_of_methods("exudyn", (*milliseconds(10), *STEPS), "GeneralizedAlpha 0.9", "GeneralizedAlpha 0.6"),
    ("exudyn", "RK44"): milliseconds(1),
    **curves_of_methods("mujoco", STEPS[:-2], *MUJOCO_METHODS),
}
"""Steps (s), by engine and method, with a prescribed pitch. RK44 is there to be refused, as it cannot solve for a
constraint; MuJoCo calls Python in every step."""
SEED, DEVIATION = 77, 100.0
"""Seed of the noise on the wheel forces, and its standard deviation, N."""


def vehicle_under_forces() -> Assembly:
    """The vehicle without a road, under the sampled wheel forces of its run on the road."""
    on_road = assembly_of_scene(scene(DURATION))
    true = simulate(on_road.scene, "reference", Settings("RK4", SAMPLE_PERIOD / 80, DURATION))
    forces = SampledSignal(np.column_stack([true["f1"], true["f2"]])[::80], SAMPLE_PERIOD, held=False)
    return replace(on_road.without_tyres().with_input("force", forces), assumptions=())  # those of the road are gone


class ForceExcited:
    """Test problem: a vehicle under wheel forces, with its reference solution; a
    ``models.advice.price.problem.WorkPrecisionProblem``.

    ``judged_quantities`` : name and unit of the quantity for which a variant sets tolerances, before the states.
    """

    key, duration, full, quick = "forces", DURATION, FULL_STEPS, QUICK_STEPS
    note = "The forces are those of a virtual measurement at 100 Hz, linear between the samples, the same for all."
    tolerances: tuple[float, ...] = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
    excitation_text = "driven by its wheel forces"
    judged_quantities: tuple[tuple[str, str], ...] = ()

    def __init__(self, is_quick: bool) -> None:
        self.units = dict((*self.judged_quantities, ("state", "m, rad, m/s, rad/s")))
        steps = [1e3 * setting.value for setting in self.settings(is_quick)]
        self.title = (
            f"Pitch-plane vehicle {self.excitation_text}, {DURATION:g} s at {SPEED:g} m/s, before "
            f"drift-off, fixed steps of {min(steps):g} to {max(steps):g} ms"
        )
        self.assembly = self.vehicle_under_forces()
        other_settings = (
            Settings("RK4", 2 * FINE_STEP, DURATION) if is_quick else Settings("DOP853", SAMPLE_PERIOD, DURATION, 1e-12)
        )
        self.reference = f"RK4 at {1e6 * FINE_STEP:.2g} us and " + ("twice that" if is_quick else "DOP853 at 1e-12")
        self._true, check = (
            self._sampled(build("reference", self.assembly, settings).run())
            for settings in (Settings("RK4", FINE_STEP, DURATION), other_settings)
        )
        self.uncertainty = largest_differences(check, self._true)
        self.bound = 10 * float(np.abs(next(iter(self._true.values()))).max())

    def vehicle_under_forces(self) -> Assembly:
        """The vehicle with its inputs, whose equations are solved."""
        return vehicle_under_forces()

    def read(self, finished_run: Trajectory) -> dict[str, np.ndarray]:
        """The compared quantities (n, ...) by name, at all n rows of a run."""
        return {"state": finished_run.states}

    def _sampled(self, finished_run: Trajectory) -> dict[str, np.ndarray]:
        """The compared quantities of a run by name, at the sample times of the forces."""
        stride = (len(finished_run.states) - 1) // round(DURATION / SAMPLE_PERIOD)
        return {name: values[::stride] for name, values in self.read(finished_run).items()}

    def settings(self, quick: bool) -> tuple[Setting, ...]:
        """Settings of all curves, or for the quick report of QUICK_STEPS."""
        return settings_of_curves(self.quick if quick else self.full, self.setting)

    def setting(self, engine: str, method: str, step_or_tolerance: float) -> Setting:
        """Setting of an engine and a method, with the longest step (s) that is not above ``step_or_tolerance`` and
        divides the sampling period of the forces.
        """
        return setting(engine, method, SAMPLE_PERIOD / math.ceil(SAMPLE_PERIOD / step_or_tolerance * (1 - 1e-9)))

    def build(self, setting: Setting) -> Model:
        """The vehicle in the engine of a setting, ready to run."""
        return build(setting.engine, self.assembly, settings_of(setting))

    def errors(self, solution: Trajectory) -> dict[str, float]:
        """Largest error of each quantity at the sample times of the forces, which lie on steps; assumptions that
        the run breaks are reported."""
        result_with_assumptions(self.assembly, solution)
        return largest_differences(self._sampled(solution), self._true)


class NoisyForces(ForceExcited):
    """Test problem: a vehicle under noisy wheel forces. All solvers read the same noise, so that no sampling error
    enters; tolerances are those of the suspension force."""

    key = "noise"
    note = f"The forces carry the noise of one fixed file, {DEVIATION:g} N on every sample at 100 Hz."
    tolerances: tuple[float, ...] = (100.0, 10.0, 1.0, 0.1, 0.01)
    excitation_text = "driven by noisy wheel forces"
    judged_quantities = (("suspension force", "N"),)

    def vehicle_under_forces(self) -> Assembly:
        """The vehicle under wheel forces with noise on every sample."""
        clean = vehicle_under_forces()
        assert isinstance(clean.input, SampledSignal)
        noise = DEVIATION * normal_samples(SEED, 0, *clean.input.values.shape)
        return replace(clean, input=SampledSignal(clean.input.values + noise, SAMPLE_PERIOD, held=False))

    def read(self, finished_run: Trajectory) -> dict[str, np.ndarray]:
        """Suspension forces (n, 2) in N and states (n, 8) of a run."""
        channels = output_channels(self.assembly, finished_run)
        return {
            "suspension force": np.column_stack([channels[name][2] for name in ("f3", "f4")]),
            "state": finished_run.states,
        }


class PrescribedPitch(ForceExcited):
    """Test problem: a vehicle under wheel forces with the pitch prescribed as on the road; tolerances are those of the
    enforced moment.

    The pitch at 100 Hz is a quintic spline: twice differentiable, and the same for all. A constraint is solved by
    Exudyn's generalised-alpha alone, whose multiplier needs a radius below one; MuJoCo and the reference have the
    reduced model, in which the pitch is an input.
    """

    key, full, quick = "pitch", PRESCRIBED_PITCH_STEPS, PRESCRIBED_PITCH_STEPS
    note = "The moment of Exudyn is a multiplier, that of the others follows from the reduced model."
    tolerances: tuple[float, ...] = (100.0, 10.0, 1.0, 0.1, 0.01)
    excitation_text = "driven by its wheel forces, pitch prescribed"
    judged_quantities = (("enforced moment", "N m"),)

    def vehicle_under_forces(self) -> Assembly:
        """The vehicle with wheel forces and prescribed pitch as inputs; it starts with the prescribed pitch and pitch
        rate."""
        forces = vehicle_under_forces()
        assert isinstance(forces.input, SampledSignal)
        run = build(
            "reference", assembly_of_scene(scene(DURATION)), Settings("RK4", SAMPLE_PERIOD / 80, DURATION)
        ).run()
        pitch = Smooth(run.states[::80, 3, None], SAMPLE_PERIOD, derivatives=2, degree=5)
        assembly = replace(forces, initial=forces.initial.copy()).with_input(
            "pitch", StackedSignal((forces.input, pitch))
        )
        assembly.initial[[3, 7]] = pitch.at(0.0)[:2]
        return assembly

    def read(self, finished_run: Trajectory) -> dict[str, np.ndarray]:
        """Enforced moment (n,) in N m and states (n, 8) of a run."""
        assert finished_run.moment is not None
        return {"enforced moment": finished_run.moment, "state": finished_run.states}


@cache
def problem(is_quick: bool) -> ForceExcited:
    """The test problem of a vehicle under wheel forces; its reference solution is computed once per process."""
    return ForceExcited(is_quick)


@cache
def noisy_problem(is_quick: bool) -> NoisyForces:
    """The test problem of a vehicle under noisy wheel forces, computed once per process."""
    return NoisyForces(is_quick)


@cache
def prescribed_pitch_problem(is_quick: bool) -> PrescribedPitch:
    """The test problem of a vehicle with prescribed pitch, computed once per process."""
    return PrescribedPitch(is_quick)
