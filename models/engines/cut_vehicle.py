"""A vehicle cut at its wheel hubs in an engine: the code that all engines share.

In an engine it is a free vehicle (``free_vehicle``), of which springs, hub forces and stabilisers are the compiled
forces of ``models.multibody.cut_kernel``. "reference" solves the written-out equations instead, around the same forces;
"plain" shares nothing with any of them (``models.multibody.plain``), and takes some seconds for each of the run.
"""

from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from models.core.errors import Refused, RunFailed
from models.core.trajectory import Trajectory
from models.engines.assembly import Settings
from models.engines.catalogue import ADAPTIVE
from models.engines.free_vehicle import FreeModel, LoadedVehicle, PlainModel, free_model, native_elements_and_joints
from models.engines.native_parts import ElementDivision, divide_between_engine_and_callback
from models.engines.protocol import check_trajectory
from models.engines.spatial_protocol import check_divides, check_modes
from models.multibody.cut_kernel import (
    ANY_TIME,
    WRENCH,
    accelerate,
    joint_forces,
    march,
    report_forces,
    set_joint_forces,
    table_views,
)
from models.multibody.cut_table import HubInputs, cut_vehicle_table
from models.vehicles.cut_vehicle import PITCH, CutVehicle
from models.vehicles.spatial_linear import linearise

if TYPE_CHECKING:
    from models.multibody.plain.hubs import PlainHubs

ENGINES = ("reference", "exudyn", "mujoco")
FIXED_STEP_METHOD = "RK4"
"""The classical Runge-Kutta method, which every engine has; all other integrators choose their own steps."""
PLAIN_ENGINE = "plain"
"""Name of the independent reference, which runs only if it is named."""
ForceRoute = Literal["native", "compiled"]
"""Where springs, mounts and bars are computed: in the engine's own elements as far as it has them, or all in the
compiled forces."""
TUMBLED_PITCH = 1.4
"""Pitch (rad) beyond which a vehicle has tumbled; at pi / 2 its heading and roll become one angle."""


@dataclass(frozen=True, eq=False, kw_only=True)
class HubRun(Trajectory):
    """Trajectory of a cut vehicle with its forces; the chassis' six coordinates come first in the states.

    elements (m, e): forces of springs, mounts and bars in the chassis' axes, compression positive, N or N m
    wrenches (m, hubs, 6): force (N) and moment (N m) at every hub in the frame of the hub inputs
    moments (m, 2): of the stabiliser on roll and pitch, N m
    """

    elements: np.ndarray
    wrenches: np.ndarray
    moments: np.ndarray


class HandWrittenEquations(FreeModel):
    """Hand-written equations of motion of a vehicle, without an engine."""

    ENGINE = "reference"

    def __init__(self, loaded_vehicle: LoadedVehicle) -> None:
        self.driven, self.size, self.settings = loaded_vehicle, loaded_vehicle.size, None

    def plan(self) -> dict[str, int]:
        """Counts of built items: coordinates, and no native items or callbacks."""
        return {"degrees of freedom": self.size, "native items": 0, "callbacks": 0}

    def acceleration(self, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (n,) from the mass matrix of ``models.multibody.cut_mechanics``."""
        rates = np.empty(len(q))
        accelerate(self.numbers, time, np.ascontiguousarray(q), np.ascontiguousarray(v), rates)
        return rates

    def march(self, q: np.ndarray, v: np.ndarray, steps: int, step: float) -> np.ndarray:
        """Coordinates and rates (steps + 1, 2 n) at every step of the classical Runge-Kutta method."""
        states = np.empty((steps + 1, 2 * len(q)))
        states[0] = np.concatenate((q, v))
        march(self.numbers, states, step)
        return states


class HubModel:
    """A cut vehicle in one engine, driven by hub forces or motions. It is marched over ``steps`` steps of ``step`` (s)
    by Runge-Kutta 4, or from row to row of the same spacing by an integrator that chooses its own steps.

    ``model`` is the free vehicle there.
    """

    def __init__(
        self,
        engine: str,
        vehicle: CutVehicle,
        hub_inputs: HubInputs,
        run_settings: Settings,
        force_route: ForceRoute = "compiled",
    ) -> None:
        """Build the model. Raises Refused where the step does not divide the duration, or where the inputs do not have
        one row per half step.

        run_settings : "RK4", or an integrator of the engine that picks its own steps.
        force_route : "native" leaves springs, mounts and bars to the engine, as far as it has them; the written-out
        equations of the reference are the same either way. An enforced tilt needs them "compiled".
        """
        check_divides(engine, run_settings)
        self.engine, self.vehicle, self.hub_inputs, self.settings = engine, vehicle, hub_inputs, run_settings
        step, self.step, self.steps, self.size = run_settings.step, run_settings.step, run_settings.steps, vehicle.size
        self.adaptive = run_settings.integrator != FIXED_STEP_METHOD
        _check_inputs(engine, vehicle, hub_inputs, 2 * self.steps + 1)
        _check_settings(engine, vehicle, run_settings)
        self.numbers = cut_vehicle_table(vehicle, hub_inputs, step)
        weight = np.array([0.0, 0.0, -vehicle.tree.gravity])
        self.plain = _plain_hubs(vehicle, hub_inputs, step, self.adaptive) if engine == PLAIN_ENGINE else None
        division, numbers = ElementDivision((), vehicle.elements), self.numbers
        if force_route == "native" and engine not in (PLAIN_ENGINE, "reference"):
            if hub_inputs.guide is not None and hub_inputs.pull is None:
                raise Refused(engine, 'an enforced tilt needs every force in one place: use forces = "compiled"')
            division = divide_between_engine_and_callback(vehicle.tree, vehicle.elements, engine)
            numbers = cut_vehicle_table(replace(vehicle, elements=division.shared), hub_inputs, step)
        self.division = division
        if hub_inputs.constant_in_step or self.adaptive:
            numbers = numbers.copy()  # forces are reported by the whole table, read at its rows
        self.model = self._in_engine(
            LoadedVehicle(vehicle.tree, weight, numbers, joint_forces, set_joint_forces, division.native)
        )
        if self.adaptive and not self.plain:
            self.model.numbers[ANY_TIME] = 1.0

    def _in_engine(self, loaded_vehicle: LoadedVehicle) -> FreeModel:
        """The free vehicle in the engine, as written equations, or in plain code."""
        if self.plain:
            return PlainModel(self.engine, self.plain.acceleration, self.size)
        return (
            HandWrittenEquations(loaded_vehicle)
            if self.engine == "reference"
            else free_model(self.engine, loaded_vehicle)
        )

    def acceleration(self, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (n,) at a time (s), from coordinates and rates (n,)."""
        return self.model.acceleration(time, q, v)

    def marched(self, q: np.ndarray, v: np.ndarray) -> Trajectory:
        """Trajectory from coordinates and rates (n,), without a check of the attitude; RunFailed where the engine
        stops."""
        if not self.hub_inputs.constant_in_step:
            return self._march(q, v, self.steps)
        states, counts = np.empty((self.steps + 1, 2 * self.size)), Counter[str]()
        states[0] = np.concatenate((q, v))
        for first, last in self.hub_inputs.constant_force_spans():
            self._hold_forces(first, last)
            try:
                path = self._march(states[first, : self.size], states[first, self.size :], last - first)
            except RunFailed as error:
                since = None if error.time is None else first * self.step + error.time
                raise RunFailed(error.engine, error.reason, since, error.state) from error
            states[first : last + 1] = path.states
            counts.update(path.counts)
        return Trajectory(self._times(self.steps), states, counts=dict(counts))

    def _march(self, q: np.ndarray, v: np.ndarray, step_count: int) -> Trajectory:
        """Trajectory over ``step_count`` steps from time 0 on."""
        if self.adaptive:
            from models.engines.free_vehicle_adaptive import march_adaptively

            return march_adaptively(self.model, q, v, replace(self.settings, duration=step_count * self.step))
        states = self.model.march(q, v, step_count, self.step)
        return Trajectory(self._times(step_count), states, counts={"steps": step_count, "force calls": 4 * step_count})

    def _times(self, step_count: int) -> np.ndarray:
        """Times (steps + 1,) in s of the rows of a march."""
        return self.step * np.arange(step_count + 1)

    def _hold_forces(self, first_step: int, last_step: int) -> None:
        """Set the hub forces of a span of steps over which they are constant; the model's time starts again at the
        span."""
        hub_inputs = self.hub_inputs.in_steps(first_step, last_step)
        if self.plain:
            self.plain.hub_inputs = hub_inputs
        else:
            rows = hub_inputs.rows
            table_views(self.model.numbers)[-1][: len(rows)] = rows

    def plan(self) -> dict[str, int]:
        """Counts of built items: degrees of freedom, native items, callbacks."""
        return self.model.plan()

    def run(self, q: np.ndarray | None = None, v: np.ndarray | None = None) -> HubRun:
        """Trajectory with forces from coordinates and rates (n,), or from rest; RunFailed unless the vehicle stays
        upright."""
        rest = np.zeros(self.size)
        path = self.marched(rest if q is None else q, rest if v is None else v)
        times, states = path.times, path.states
        check_trajectory(self.engine, times, states, self.steps * self.step)
        tumbled = np.abs(states[:, PITCH]) > TUMBLED_PITCH
        if tumbled.any():
            at = int(np.argmax(tumbled))
            raise RunFailed(self.engine, f"the vehicle pitches by more than {TUMBLED_PITCH} rad", times[at], states[at])
        return replace(self.reported(times, states), counts=path.counts)

    def reported(self, times: np.ndarray, states: np.ndarray) -> HubRun:
        """The run with given times (m,) in s and states (m, 2 n), with the forces that act in these states."""
        if self.plain:
            inside, wrenches, moments = self.plain.report(times, states)
            return HubRun(times, states, elements=inside, wrenches=wrenches, moments=moments)
        return run_with_forces(self.vehicle, self.numbers, times, states)

    def forces_at_rest(self, q: np.ndarray) -> np.ndarray:
        """Generalised forces (n,) on all joints (N, N m) by the compiled forces at time 0, at coordinates (n,) with
        zero rates."""
        block = np.concatenate((np.zeros(self.size), q, np.zeros(self.size), self.numbers))
        set_joint_forces(block.ctypes.data, 0.0, self.size)
        return block[: self.size].copy()


def run_with_forces(vehicle: CutVehicle, parameter_table: np.ndarray, times: np.ndarray, states: np.ndarray) -> HubRun:
    """The run with given times (m,) in s and states (m, 2 n), with the compiled forces that act in these states;
    ``parameter_table`` is the vehicle's table."""
    rows = len(times)
    inside, moments = np.empty((rows, len(vehicle.elements))), np.empty((rows, 2))
    wrenches = np.empty((rows, len(vehicle.hubs), WRENCH))
    report_forces(parameter_table, times, np.ascontiguousarray(states), inside, wrenches, moments)
    return HubRun(times, states, elements=inside, wrenches=wrenches, moments=moments)


def build(
    engine: str,
    vehicle: CutVehicle,
    hub_inputs: HubInputs,
    time_step: float,
    duration: float,
    force_route: ForceRoute = "compiled",
) -> HubModel:
    """A cut vehicle as ``HubModel`` in "reference", "plain", "exudyn" or "mujoco", for steps (s) of Runge-Kutta 4 over
    a duration (s); raises Refused."""
    return HubModel(engine, vehicle, hub_inputs, Settings(FIXED_STEP_METHOD, time_step, duration), force_route)


def _plain_hubs(vehicle: CutVehicle, hub_inputs: HubInputs, time_step: float, reads_any_time: bool) -> "PlainHubs":
    """The cut vehicle by the independent plain code."""
    from models.multibody.plain.hubs import PlainHubs

    return PlainHubs(vehicle, hub_inputs, time_step, reads_any_time)


@dataclass(frozen=True)
class NativeShare:
    """Native elements of a built model: names of the elements that the engine itself computes, number of its joints,
    and reasons why other elements are not native."""

    elements: tuple[str, ...]
    joints: int
    reasons: dict[str, str]


def native_share(engine: str, vehicle: CutVehicle) -> NativeShare:
    """Elements of a vehicle that "exudyn" or "mujoco" computes natively, counted in a model that is built without a
    callback."""
    division = divide_between_engine_and_callback(vehicle.tree, vehicle.elements, engine)
    driven = LoadedVehicle(vehicle.tree, np.zeros(3), np.zeros(1), None, None, division.native)
    elements, joints = native_elements_and_joints(engine, driven)
    return NativeShare(elements, joints, division.reasons)


def check_step(engine: str, vehicle: CutVehicle, time_step: float, duration: float) -> None:
    """Raise Refused for a step (s) with which a mode of the vehicle on its tyres would grow; without tyres the vehicle
    is softer."""
    check_modes(engine, linearise(replace(vehicle.uncut, side_forces=())), Settings("RK4", time_step, duration))


def _check_inputs(engine: str, vehicle: CutVehicle, hub_inputs: HubInputs, row_count: int) -> None:
    """Raise Refused unless the hub inputs have the right shapes, are finite, and held forces change only between
    steps."""
    width = (2 if hub_inputs.road else WRENCH) * len(vehicle.hubs)
    if hub_inputs.hubs.shape != (row_count, width) or not np.isfinite(hub_inputs.hubs).all():
        raise Refused(engine, f"inputs must be {row_count} rows (half steps) of {width} finite numbers")
    if hub_inputs.guide is not None and (
        hub_inputs.guide.shape != (row_count, 6) or not np.isfinite(hub_inputs.guide).all()
    ):
        raise Refused(engine, f"a guide must be {row_count} rows (half steps) of 6 finite numbers")
    if hub_inputs.constant_in_step and not np.array_equal(hub_inputs.hubs[1::2], hub_inputs.hubs[:-1:2]):
        raise Refused(engine, "held forces change within a step: it must divide the period of their samples")


def _check_settings(engine: str, vehicle: CutVehicle, run_settings: Settings) -> None:
    """Raise Refused if fixed steps are too long, or if the engine does not have the integrator."""
    adaptive = ADAPTIVE.get("reference" if engine == PLAIN_ENGINE else engine, ())
    if run_settings.integrator == FIXED_STEP_METHOD:
        check_step(engine, vehicle, run_settings.step, run_settings.duration)
    elif run_settings.integrator not in adaptive:
        raise Refused(
            engine, f"{run_settings.integrator} is not offered: {' or '.join((FIXED_STEP_METHOD, *adaptive))}"
        )
