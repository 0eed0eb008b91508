"""Faults of the pitch-plane vehicle, planted in an engine's inputs, in its adapter or in the reference's equations.

A check that has never seen a fault proves nothing. Each fault here is a mistake that is easily made in such code.
``planted_builder`` returns an engine with a fault, which is active only while the engine computes.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from models.core.trajectory import Trajectory
from models.engines.assembly import Assembly, Settings
from models.engines.model import Model
from models.engines.protocol import build
from validation.common.checks import ModelBuilder
from validation.faults import changes as change
from validation.faults import patches
from validation.faults.changes import AssemblyChange
from validation.faults.patches import Context, Patch, attribute_patch, rewritten_reference

BOTH_ENGINES = ("exudyn", "mujoco")
EXUDYN_ONLY, MUJOCO_ONLY, REFERENCE_ONLY = ("exudyn",), ("mujoco",), ("reference",)
FORCE_FUNCTIONS = ("force", "pitch")


def _unchanged_settings(run_settings: Settings) -> Settings:
    return run_settings


@dataclass(frozen=True)
class EngineFault:
    """A fault: its description, the engines in which it is planted, its change of the assembly, its patch of the code,
    and its change of the run's settings."""

    name: str
    engines: tuple[str, ...]
    change: AssemblyChange = change.unchanged
    patch: Patch = patches.no_fault
    settings: Callable[[Settings], Settings] = _unchanged_settings


@dataclass
class PlantedModel:
    """An engine's model with a fault that is active only while the model computes."""

    context: Context
    model: Model

    def run(self) -> Trajectory:
        """Trajectory of the engine's run with the fault."""
        with self.context():
            return self.model.run()

    def acceleration(self, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (4,) of the engine with the fault, at a time (s), coordinates q and rates v."""
        with self.context():
            return self.model.acceleration(time, q, v)

    def plan(self) -> dict[str, int]:
        """Numbers of elements, callbacks and states that the engine with the planted fault built."""
        return self.model.plan()


def planted_builder(engine_fault: EngineFault, engine: str) -> ModelBuilder:
    """Returns a function (assembly, settings) -> model that builds models with the fault in an engine."""

    def make(assembly: Assembly, settings: Settings) -> PlantedModel:
        context = engine_fault.patch()
        with context():
            return PlantedModel(context, build(engine, engine_fault.change(assembly), engine_fault.settings(settings)))

    return make


def _first_order_settings(run_settings: Settings) -> Settings:
    """Fault: a first-order integrator is used instead of Runge-Kutta."""
    lower = {"RK44": "ExplicitEuler", "RK4": "Euler"}
    return replace(run_settings, integrator=lower.get(run_settings.integrator, run_settings.integrator))


CONTROLS_WITHOUT_FAULT = (
    EngineFault("no fault", (*BOTH_ENGINES, *REFERENCE_ONLY)),
    EngineFault("no fault, equations interpreted", REFERENCE_ONLY, patch=rewritten_reference()),
)

DESCRIPTION_FAULTS = (
    EngineFault("a and b swapped", BOTH_ENGINES, change.with_moved_points(lambda x, a, b: a if x > 0 else -b)),
    EngineFault("sign of pitch mirrored", BOTH_ENGINES, change.with_moved_points(lambda x, a, b: -x)),
    EngineFault("front and rear suspension swapped", BOTH_ENGINES, change.swapped_struts("suspension3", "suspension4")),
    EngineFault("front and rear tyre swapped", BOTH_ENGINES, change.swapped_struts("tyre1", "tyre2")),
    EngineFault("front and rear wheel mass swapped", BOTH_ENGINES, change.replaced_bodies(change.swapped_wheel)),
    EngineFault(
        "mass and pitch inertia of the chassis exchanged", BOTH_ENGINES, change.replaced_bodies(change.mixed_inertia)
    ),
    EngineFault("pitch inertia about the front axle", BOTH_ENGINES, change.inertia_about_axle),
    EngineFault("front suspension 1 % too stiff", BOTH_ENGINES, change.stiffened_strut("suspension3", 1.01)),
    EngineFault("front suspension in N/mm", BOTH_ENGINES, change.stiffened_strut("suspension3", 1e-3)),
    EngineFault("tyre damping dropped", BOTH_ENGINES, change.replaced_struts(change.undamped_tyre)),
    EngineFault(
        "linear geometry where exact was asked for",
        BOTH_ENGINES,
        change.changed_vehicle_of(lambda v: replace(v, geometry="linear")),
    ),
    EngineFault("gravity upward", BOTH_ENGINES, change.changed_vehicle_of(lambda v: replace(v, gravity=-v.gravity))),
    EngineFault(
        "gravity 9.80665 for 9.81", BOTH_ENGINES, change.changed_vehicle_of(lambda v: replace(v, gravity=9.80665))
    ),
    EngineFault("start from zero heave", BOTH_ENGINES, change.unstressed_start),
    EngineFault(
        "dead band missing", BOTH_ENGINES, change.replaced_springs(lambda spring: replace(spring, dead_band=0.0))
    ),
    EngineFault(
        "dead band counted as a width",
        BOTH_ENGINES,
        change.replaced_springs(lambda s: replace(s, dead_band=s.dead_band / 2)),
    ),
)
"""Faults in the vehicle's description that an engine is built from."""

INPUT_FAULTS = (
    EngineFault("input half a sample late", BOTH_ENGINES, change.with_late_input(0.5)),
    EngineFault("input a whole sample late", BOTH_ENGINES, change.with_late_input(1.0)),
    EngineFault("road held at the middle stages", BOTH_ENGINES, change.replaced_input(("road",), change.HeldStages)),
    EngineFault("rear wheel ahead of the front one", BOTH_ENGINES, change.scaled_road(wheelbase=-1.0)),
    EngineFault("rear delay missing", BOTH_ENGINES, change.scaled_road(wheelbase=0.0)),
    EngineFault("speed in km/h", BOTH_ENGINES, change.scaled_road(speed=3.6)),
    EngineFault(
        "rate of the road missing",
        BOTH_ENGINES,
        change.replaced_channels(("road",), change.multiplied_channels({2: 0.0, 3: 0.0})),
    ),
    EngineFault("left track instead of the mean", BOTH_ENGINES, change.replaced_input(("road",), change.OtherTrack)),
    EngineFault(
        "wheel forces in kN",
        BOTH_ENGINES,
        change.replaced_channels(FORCE_FUNCTIONS, change.multiplied_channels({0: 1e-3, 1: 1e-3})),
    ),
    EngineFault(
        "wheel forces with the other sign",
        BOTH_ENGINES,
        change.replaced_channels(FORCE_FUNCTIONS, change.multiplied_channels({0: -1.0, 1: -1.0})),
    ),
    EngineFault(
        "front wheel force at both wheels",
        BOTH_ENGINES,
        change.replaced_channels(FORCE_FUNCTIONS, change.front_values_at_rear),
    ),
    EngineFault("wheel forces along the chassis, not vertical", BOTH_ENGINES, change.body_fixed_forces),
    EngineFault(
        "prescribed pitch in degrees",
        BOTH_ENGINES,
        change.replaced_channels(("pitch",), change.multiplied_channels(dict.fromkeys((2, 3, 4), 180 / math.pi))),
    ),
    EngineFault(
        "rate of the prescribed pitch missing",
        MUJOCO_ONLY,
        change.replaced_channels(("pitch",), change.multiplied_channels({3: 0.0})),
    ),
    EngineFault(
        "rate of the prescribed heave missing",
        MUJOCO_ONLY,
        change.replaced_channels(("heave-pitch",), change.multiplied_channels({4: 0.0})),
    ),
    EngineFault(
        "prescribed heave upward",
        BOTH_ENGINES,
        change.replaced_channels(("heave-pitch",), change.multiplied_channels(dict.fromkeys((2, 4, 6), -1.0))),
    ),
    EngineFault(
        "added moment with the other sign",
        BOTH_ENGINES,
        change.changed_moment(0.0, change.multiplied_channels({0: -1.0})),
    ),
    EngineFault("added moment half a sample late", BOTH_ENGINES, change.changed_moment(0.5)),
    EngineFault("Euler where Runge-Kutta was asked for", BOTH_ENGINES, settings=_first_order_settings),
)
"""Faults in the input or the settings that an engine is run with."""

ADAPTER_FAULTS = (
    EngineFault(
        "held sample of the step's end",
        EXUDYN_ONLY,
        patch=attribute_patch("models.engines.exudyn:SignalClock.advance", patches.sample_of_step_end),
    ),
    EngineFault(
        "time cut off instead of rounded",
        EXUDYN_ONLY,
        patch=attribute_patch("models.engines.exudyn:SignalClock.reader", patches.truncated_time),
    ),
    EngineFault(
        "constraint starts without its acceleration",
        EXUDYN_ONLY,
        patch=attribute_patch("models.engines.exudyn:ExudynModel._consistent_start", patches.reset_accelerations),
    ),
    EngineFault(
        "enforced moment with the other sign",
        EXUDYN_ONLY,
        patch=attribute_patch("models.engines.exudyn:ExudynModel._enforced", patches.negated_result),
    ),
    EngineFault(
        "gravity missing on one wheel",
        MUJOCO_ONLY,
        patch=attribute_patch("models.engines.mujoco:specification", patches.weightless_wheel),
    ),
    EngineFault(
        "strut measured along the rotating body",
        MUJOCO_ONLY,
        patch=attribute_patch("models.engines.mujoco:_add_suspension", patches.turning_reference),
    ),
    EngineFault(
        "chassis row of eq. (39) with the other sign",
        MUJOCO_ONLY,
        patch=attribute_patch("models.engines.mujoco:_guidance_forces", patches.reversed_pitch_row),
    ),
    EngineFault(
        "callback never installed",
        MUJOCO_ONLY,
        patch=attribute_patch("models.engines.mujoco:installed_callback", patches.callback_not_installed),
    ),
)
"""Faults in the code of an engine's adapter."""

EQUATIONS_FAULTS = (
    EngineFault(
        "cos(pitch) missing in the moment",
        REFERENCE_ONLY,
        patch=rewritten_reference(newton_euler=patches.moment_without_cosine),
    ),
    EngineFault(
        "cos(pitch) missing in the damper",
        REFERENCE_ONLY,
        patch=rewritten_reference(suspension_forces=patches.damper_without_cosine),
    ),
    EngineFault(
        "forces from the state before", REFERENCE_ONLY, patch=rewritten_reference(suspension_forces=patches.stale_state)
    ),
    EngineFault(
        "no reaction on the front wheel", REFERENCE_ONLY, patch=rewritten_reference(newton_euler=patches.no_reaction)
    ),
)
"""Faults in the hand-written equations of the reference."""

FAULTS = (*DESCRIPTION_FAULTS, *INPUT_FAULTS, *ADAPTER_FAULTS, *EQUATIONS_FAULTS)
