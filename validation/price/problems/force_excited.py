"""Problem B: the pitch-plane vehicle driven by the samples of its wheel forces, before it drifts off.

The forces are a virtual measurement of the study road at 100 Hz, linear between the samples: every solver reads the
same ones, so the error here is the integrator's alone, and not that of the interpolation, from which such a run
drifts. Adaptive solvers restart at each sample; what they do is in the case ``drift_solvers``.
"""

import math
from dataclasses import replace
from functools import cache

import numpy as np

from models.advice.price.problem import Setting
from models.core.signals import Sampled
from models.engines.assembly import Assembly, Model, Settings, Trajectory
from models.engines.protocol import build
from models.systems.pitch_plane.run import run as simulate
from models.systems.pitch_plane.scene import assemble
from validation.price.problems.road_excited import SPEED, scene, setting, settings_of

DURATION, RATE = 2.0, 100.0
"""Length of the run (s); rate of the samples (Hz), whose period every fixed step divides."""
PERIOD = 1 / RATE
FINE = PERIOD / 1280
"""Step (s) of the reference's own Runge-Kutta march, which meets every sample: its error is that of rounding."""

MS = 1e-3
STEPS = (2.5 * MS, 2 * MS, 1.25 * MS, 1 * MS, 0.5 * MS, 0.25 * MS, 0.125 * MS, 0.0625 * MS)
FULL: dict[tuple[str, str], tuple[float, ...]] = {
    ("reference", "RK4"): STEPS,
    ("exudyn", "RK44"): STEPS[:-1],
    ("exudyn", "ExplicitMidpoint"): STEPS,
    ("exudyn", "ExplicitEuler"): STEPS,
    ("exudyn", "GeneralizedAlpha 0.9"): (10 * MS, *STEPS),
    ("exudyn", "GeneralizedAlpha 0.6"): STEPS[:-1],
    ("exudyn", "TrapezoidalIndex2"): STEPS[:-1],
    ("mujoco", "RK4"): STEPS[:-1],
    ("mujoco", "Euler"): STEPS,
    ("mujoco", "implicit"): STEPS[:-1],
    ("mujoco", "implicitfast"): STEPS[:-1],
    ("mujoco", "discrete"): STEPS[:-1],
}
"""Steps (s) of every method; the finest is for the engines' defaults and those whose order shows late."""
QUICK: dict[tuple[str, str], tuple[float, ...]] = {
    ("reference", "RK4"): (0.5 * MS, 0.25 * MS, 0.125 * MS),
    ("exudyn", "ExplicitEuler"): (1 * MS, 0.5 * MS, 0.25 * MS),
    ("mujoco", "Euler"): (2 * MS, 1 * MS, 0.5 * MS),
}
"""The named share of FULL that the quick report takes."""


def driven() -> Assembly:
    """The vehicle cut off the road and driven by what its tyres carried there."""
    on_road = assemble(scene(DURATION))
    true = simulate(on_road.scene, "reference", Settings("RK4", PERIOD / 80, DURATION))
    forces = Sampled(np.column_stack([true["f1"], true["f2"]])[::80], PERIOD, held=False)
    return replace(on_road.without_tyres().with_input("force", forces))


class ForceExcited:
    """The problem with its reference; see ``validation.price.problems.Problem``."""

    key = "forces"
    duration = DURATION
    note = "The forces are those of a virtual measurement at 100 Hz, linear between the samples, the same for all."
    tolerances: tuple[float, ...] = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
    what = "driven by its wheel forces"

    def __init__(self, quick: bool, first: tuple[str, str] | None = None) -> None:
        """first : a quantity and its unit on which tolerances are set, before those of the states."""
        self.units = dict([*([first] if first else []), ("state", "m, rad, m/s, rad/s")])
        steps = [1e3 * one.value for one in self.settings(quick)]
        self.title = (
            f"Pitch-plane vehicle {self.what}, {DURATION:g} s at {SPEED:g} m/s, before "
            f"drift-off, fixed steps of {min(steps):g} to {max(steps):g} ms"
        )
        self.assembly = self.driven()
        other = Settings("RK4", 2 * FINE, DURATION) if quick else Settings("DOP853", PERIOD, DURATION, 1e-12)
        self.reference = f"RK4 at {1e6 * FINE:.2g} us and " + ("twice that" if quick else "DOP853 at 1e-12")
        self._true = self._by(Settings("RK4", FINE, DURATION))
        self.uncertainty = self._off(self._by(other))
        self.bound = 10 * float(np.abs(next(iter(self._true.values()))).max())

    def chosen(self, quick: bool) -> dict[tuple[str, str], tuple[float, ...]]:
        """Steps (s) of every method."""
        return QUICK if quick else FULL

    def driven(self) -> Assembly:
        """What is solved."""
        return driven()

    def read(self, run: Trajectory) -> dict[str, np.ndarray]:
        """The quantities, (n, ...) each, at all instants of a run."""
        return {"state": run.states}

    def _by(self, settings: Settings) -> dict[str, np.ndarray]:
        """The quantities by the paper's equations at the samples."""
        return self._sampled(build("reference", self.assembly, settings).run())

    def _sampled(self, run: Trajectory) -> dict[str, np.ndarray]:
        every = (len(run.states) - 1) // round(DURATION / PERIOD)
        return {name: values[::every] for name, values in self.read(run).items()}

    def _off(self, found: dict[str, np.ndarray]) -> dict[str, float]:
        """Largest difference of each quantity from the reference."""
        return {name: float(np.abs(values - self._true[name]).max()) for name, values in found.items()}

    def settings(self, quick: bool) -> tuple[Setting, ...]:
        """FULL, or its named share QUICK."""
        chosen = self.chosen(quick)
        return tuple(setting(*curve, value) for curve, values in chosen.items() for value in values)

    def setting(self, engine: str, method: str, value: float) -> Setting:
        """A setting of this problem by its curve and the longest step (s) up to ``value`` that meets every sample."""
        return setting(engine, method, PERIOD / math.ceil(PERIOD / value * (1 - 1e-9)))

    def build(self, setting: Setting) -> Model:
        """The vehicle in one engine."""
        return build(setting.engine, self.assembly, settings_of(setting))

    def errors(self, solution: Trajectory) -> dict[str, float]:
        """Largest error of each quantity at the samples, which every fixed step meets."""
        return self._off(self._sampled(solution))


@cache
def problem(quick: bool) -> ForceExcited:
    """The problem, its reference computed once per process."""
    return ForceExcited(quick)
