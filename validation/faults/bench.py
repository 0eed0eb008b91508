"""Test bench for an engine with and without a planted fault: a pitch-plane vehicle in seven short situations.

Inputs are closed forms that start at rest in the static equilibrium, with different frequencies front
and rear, so that nothing cancels by accident. Forces are sampled at 500 Hz and stepped at 1 kHz: a sample
spans two steps, so an index that is off by one shows.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from models.core.errors import InputError, RunFailed
from models.core.signals import SampledSignal, Smooth, StackedSignal
from models.core.trajectory import Trajectory
from models.engines.assembly import Assembly, Settings
from models.systems.pitch_plane.scene import Scene, assembly_of_scene
from models.systems.pitch_plane.scene import build as build_scene
from models.vehicles.description import PitchSpring
from validation.common import checks
from validation.common.checks import (
    ModelBuilder,
    enforced_gap,
    equilibrium_gap,
    momentum_gap,
    order_gap,
    random_states,
    relative_difference,
    run,
    state_gap,
)

STEP = 1e-3
SAMPLING_PERIOD = 2e-3
ORDER_STEP = 2.5e-4
"""Step (s) of the check of the convergence order, at which the stiff wheels no longer distort the order of RK4."""
RUNGE_KUTTA = {"reference": "RK4", "exudyn": "RK44", "mujoco": "RK4"}
CONSTRAINED_INTEGRATORS = {"reference": "RK4", "exudyn": "GeneralizedAlpha", "mujoco": "RK4"}
ROUNDING_BOUND = 1e-12


def bench_scene(parameter_set: str, duration: float) -> Scene:
    """Scene of the vehicle with a parameter set on the study road at 20 m/s."""
    return build_scene(
        {
            "title": "bench",
            "vehicle": {"parameters": parameter_set},
            "run": {"duration": duration, "step": STEP},
            "effects": {"road": {"source": "study", "speed": 20.0}},
        }
    )


@dataclass(eq=False)
class Bench:
    """A vehicle, named by its parameter set, in several situations of a duration (s), for checks on planted faults."""

    parameter_set: str
    duration: float

    @cached_property
    def road(self) -> Assembly:
        """The vehicle on the study road."""
        return assembly_of_scene(bench_scene(self.parameter_set, self.duration))

    @cached_property
    def flat_road(self) -> Assembly:
        """The vehicle on a flat road, at rest."""
        return replace(self.road, mode="free", input=None)

    @cached_property
    def linear_forces(self) -> Assembly:
        """The vehicle under wheel forces that are linear between their samples."""
        return self.road.without_tyres().with_input("force", SampledSignal(self._forces(), SAMPLING_PERIOD, held=False))

    @cached_property
    def held_forces(self) -> Assembly:
        """The vehicle under wheel forces that are constant over each sample."""
        return self.road.without_tyres().with_input("force", SampledSignal(self._forces(), SAMPLING_PERIOD, held=True))

    @cached_property
    def prescribed_pitch(self) -> Assembly:
        """The vehicle under wheel forces, with a prescribed pitch."""
        start = self.road.initial
        pitch = Smooth((start[3] + 0.05 * self._oscillation(7.0))[:, None], SAMPLING_PERIOD, derivatives=2, degree=5)
        forces = Smooth(self._forces(), SAMPLING_PERIOD)
        return self.road.without_tyres().with_input("pitch", StackedSignal((forces, pitch)))

    @cached_property
    def prescribed_heave_and_pitch(self) -> Assembly:
        """The vehicle under wheel forces, with heave and pitch prescribed."""
        start = self.road.initial
        motion = start[2:4] + np.column_stack([0.01 * self._oscillation(9.0), 0.05 * self._oscillation(7.0)])
        parts = (Smooth(self._forces(), SAMPLING_PERIOD), Smooth(motion, SAMPLING_PERIOD, derivatives=2, degree=5))
        return self.road.without_tyres().with_input("heave-pitch", StackedSignal(parts))

    @cached_property
    def stabilised(self) -> Assembly:
        """The vehicle under sampled wheel forces, with an added moment, and with a pitch spring whose dead band is
        exceeded."""
        moment = SampledSignal(3e3 * self._oscillation(31.0)[:, None], SAMPLING_PERIOD, held=False)
        spring = PitchSpring("chassis", 5e4, 500.0, 2e-3)
        vehicle = replace(self.held_forces.vehicle, pitch_springs=(spring,))
        return replace(self.held_forces, vehicle=vehicle).with_moment(moment)

    @cached_property
    def fine_reference_run(self) -> Trajectory:
        """The reference's run on the road at a sixteenth of the order check's step, which serves as the exact path."""
        return checks.engine("reference")(self.road, Settings("RK4", ORDER_STEP / 16, self.duration)).run()

    @cache  # noqa: B019 - a bench lives as long as its case
    def reference_run(self, situation_name: str) -> Trajectory:
        """The reference's run of a situation, given by the name of its attribute."""
        return checks.engine("reference")(getattr(self, situation_name), self.settings("reference")).run()

    @cache  # noqa: B019
    def reference_accelerations(self, situation_name: str) -> np.ndarray:
        """The reference's accelerations (100, 4) at random states in a situation."""
        reference, settings = checks.engine("reference"), self.settings("reference")
        return checks.accelerations(reference, getattr(self, situation_name), settings, random_states())

    def _oscillation(self, frequency: float) -> np.ndarray:
        """Samples that rise smoothly from 0 to 1 and fall back, periodically with a frequency in rad/s."""
        sample_times = SAMPLING_PERIOD * np.arange(round(self.duration / SAMPLING_PERIOD) + 4)
        return 0.5 * (1 - np.cos(frequency * sample_times))

    def _forces(self) -> np.ndarray:
        """Wheel forces (n, 2) in N: static forces, raised periodically by up to 20 % in front and 15 % at the rear."""
        p = self.road.parameters
        front, rear = p.m1 + p.m3 * p.a / (p.a + p.b), p.m2 + p.m3 * p.b / (p.a + p.b)
        return p.g * np.column_stack(
            [front * (1 + 0.2 * self._oscillation(20.0)), rear * (1 + 0.15 * self._oscillation(27.0))]
        )

    def settings(self, engine: str) -> Settings:
        """Settings of an engine: classical Runge-Kutta method with steps of 1 ms."""
        return Settings(RUNGE_KUTTA[engine], STEP, self.duration)


@dataclass(frozen=True)
class Check:
    """A check for planted faults. measure(bench, engine name, model builder) returns an error; the check sees a fault
    if the error exceeds tolerance(engine name)."""

    title: str
    unit: str
    tolerance: Callable[[str], float]
    why: str
    measure: Callable[[Bench, str, ModelBuilder], float]


def _acceleration_error(bench: Bench, engine: str, build_model: ModelBuilder) -> float:
    settings, states = bench.settings(engine), random_states()
    return max(
        relative_difference(
            checks.accelerations(build_model, getattr(bench, name), settings, states),
            bench.reference_accelerations(name),
        )
        for name in ("road", "linear_forces")
    )


def _order_error(bench: Bench, engine: str, build_model: ModelBuilder) -> float:
    return order_gap(
        build_model, bench.road, replace(bench.settings(engine), step=ORDER_STEP), bench.fine_reference_run
    )


def _momentum_error(bench: Bench, engine: str, build_model: ModelBuilder) -> float:
    return max(
        momentum_gap(build_model, assembly, bench.settings(engine))
        for assembly in (bench.linear_forces, bench.held_forces)
    )


def _enforced_force_check(situation_name: str) -> Callable[[Bench, str, ModelBuilder], float]:
    """Returns a check's function: error of the enforced moment and force in a situation, against the reference, which
    eliminates the prescribed coordinates."""
    return lambda bench, engine, make: enforced_gap(
        make,
        getattr(bench, situation_name),
        replace(bench.settings(engine), integrator=CONSTRAINED_INTEGRATORS[engine], step=STEP / 2),
    )


def _path_difference_check(situation_name: str) -> Callable[[Bench, str, ModelBuilder], float]:
    """Returns a check's function: largest difference of an engine's path from the reference's in a situation."""
    return lambda bench, engine, make: state_gap(
        run(make, getattr(bench, situation_name), bench.settings(engine)), bench.reference_run(situation_name)
    )


def _rounding_error(engine: str) -> float:
    return ROUNDING_BOUND


CHECKS: dict[str, Check] = {
    "audit": Check(
        "accelerations at 100 states",
        "of the largest",
        _rounding_error,
        "rounding of a dozen products",
        _acceleration_error,
    ),
    "road twin": Check(
        "path on the road", "SI", _rounding_error, "same tableau, same step: rounding", _path_difference_check("road")
    ),
    "linear twin": Check(
        "path under linear forces", "SI", _rounding_error, "the same", _path_difference_check("linear_forces")
    ),
    "held twin": Check(
        "path under held forces", "SI", _rounding_error, "the same", _path_difference_check("held_forces")
    ),
    "stabilised twin": Check(
        "path with an added moment and a dead band",
        "SI",
        _rounding_error,
        "the same",
        _path_difference_check("stabilised"),
    ),
    "order": Check(
        "observed order against the declared one",
        "",
        lambda engine: 0.15,
        "the stiff wheels still bend it by 0.06 at these steps",
        _order_error,
    ),
    "equilibrium": Check(
        "drift off the static equilibrium",
        "SI",
        _rounding_error,
        "the closed form is exact",
        lambda bench, engine, make: equilibrium_gap(make, bench.flat_road, bench.settings(engine)),
    ),
    "momentum": Check(
        "vertical momentum against impulse",
        "of weight times time",
        _rounding_error,
        "Runge-Kutta integrates such forces exactly",
        _momentum_error,
    ),
    "moment": Check(
        "enforced moment against the eliminated form",
        "of its rms",
        lambda engine: 1e-4 if engine == "exudyn" else ROUNDING_BOUND,
        "generalised-alpha at 0.5 ms leaves 4e-5; MuJoCo's inverse dynamics is exact",
        _enforced_force_check("prescribed_pitch"),
    ),
    "rails": Check(
        "enforced force and moment against the eliminated form",
        "of their rms",
        lambda engine: 1e-4 if engine == "exudyn" else ROUNDING_BOUND,
        "the same",
        _enforced_force_check("prescribed_heave_and_pitch"),
    ),
}
"""Name -> check that is run under every fault, in the order of the report's table."""


def size_of_error(bench_check: Check, bench: Bench, engine: str, build_model: ModelBuilder) -> float:
    """Error that a check measures on an engine; infinite where the engine refuses or fails."""
    try:
        return bench_check.measure(bench, engine, build_model)
    except (InputError, RunFailed):
        return float("inf")
