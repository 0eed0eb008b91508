"""Braked vehicle on its suspension in an engine: "exudyn" or "mujoco" has bodies, joints, masses and weights.

Its steps are those of ``models.brake.sprung_step``; compiled code calls MuJoCo, and all of a sample is compiled.
"""

from collections.abc import Callable, Iterator
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from models.brake.advance import FOLDED
from models.brake.plane_records import WHEEL_QUANTITY_COUNT, PlaneMotion, WheelStates, motion_of
from models.brake.samples import samples_with_step
from models.brake.sprung import LARGEST_HINGE_ANGLE, SprungVehicle
from models.brake.sprung_step import (
    GAVE_UP,
    LARGEST_LEAN,
    OVER,
    PLANE_COORDINATE_COUNT,
    VALUES_PER_WHEEL,
    SprungStepData,
    SprungWheelForces,
    TrainUnits,
    WheelContacts,
    WheelData,
    advance,
    advance_with,
    fill_unit_values,
    forces_and_contacts,
    forces_from_pointers,
    set_forces_from_block,
    set_slip_angles,
    store_mean_forces,
)
from models.brake.surfaces import VehicleOnRoad, fill_surfaces_under_wheels, new_wheel_surfaces
from models.core.errors import RunFailed
from models.engines.assembly import Settings
from models.engines.free_vehicle import FreeModel, LoadedVehicle, free_model
from models.engines.native_parts import joint_parts
from models.engines.spatial_protocol import INTEGRATORS, check_modes
from models.engines.stability import LONG_RUN
from models.engines.towed_springs import shared_numbers, towed_division
from models.vehicles.spatial_linear import design_mass_matrix, linearise

if TYPE_CHECKING:
    from models.brake.relaxation import TyreLag
    from models.brake.sprung_relaxation import ContactLag

SHORT_TIME = 1e-5
"""Duration (s) of the short step from which the accelerations of a freely rolling vehicle are computed."""


def driven_vehicle(sprung_vehicle: SprungVehicle, engine: str) -> LoadedVehicle:
    """The free vehicle for "exudyn" or "mujoco": springs that the engine itself computes, and the table of all other
    forces."""
    handling = sprung_vehicle.handling
    division = towed_division(handling, engine)
    wheels = np.zeros(VALUES_PER_WHEEL * len(handling.vehicle.tyres))
    table = np.concatenate((shared_numbers(handling, division), wheels))
    native = (*joint_parts(handling.vehicle), *division.native)
    return LoadedVehicle(handling.vehicle, handling.gravity, table, forces_from_pointers, set_forces_from_block, native)


class EngineSprungVehicle:
    """A braked vehicle on its suspension in an engine. Its ``advance`` replaces the compiled function
    ``models.brake.advance.advance``, for all coordinates."""

    def __init__(self, engine: str, sprung_vehicle: SprungVehicle) -> None:
        self.engine, self.vehicle, self.size = engine, sprung_vehicle, sprung_vehicle.size
        self.wheels = len(sprung_vehicle.handling.vehicle.tyres)
        self._driven = driven_vehicle(sprung_vehicle, engine)
        self._units = TrainUnits(
            sprung_vehicle.turns,
            sprung_vehicle.leans,
            np.zeros((2, PLANE_COORDINATE_COUNT + sprung_vehicle.turns.size)),
        )
        self._allowed = set[float]()

    @cached_property
    def liveliness(self) -> float:
        """Largest rate (m/s^2) at which lateral forces of unit slip slope under the static loads damp a motion at a
        speed of 1 m/s; for a point mass it is g.

        A body that rolls lets its contacts go sideways more easily than its mass would.
        """
        handling, size = self.vehicle.handling, self.size
        contacts, across = WheelContacts(*np.empty((3, self.wheels))), np.empty((self.wheels, size))
        for j, rate in enumerate(np.eye(size)):
            forces_and_contacts(self._driven.numbers, np.zeros(size), rate, np.zeros(size), contacts)
            across[:, j] = contacts.across
        loads = np.array([handling.held.tyres[tyre.name] for tyre in handling.vehicle.tyres])
        damping = np.linalg.solve(design_mass_matrix(handling.vehicle), across.T @ (loads[:, None] * across))
        return float(np.linalg.eigvals(damping).real.max())

    @cached_property
    def _model(self) -> FreeModel:
        """The engine's model of the vehicle, built when the first step needs it."""
        return free_model(self.engine, self._driven)

    def _march_functions(self, has_lag: bool) -> tuple[Callable[..., Any], Callable[..., Any]]:
        """Functions that advance the vehicle and that generate samples, with or without lag of the tyres; compiled
        where compiled code can call the engine."""
        if self._model.compiled() is not None:
            from models.engines import braking_sprung_mujoco as native

            return native.lagging() if has_lag else (native.advance, native.samples_by_steps)
        if not has_lag:
            return advance, samples_with_step(advance)
        from models.brake.sprung_relaxation import advance_contact_lag

        go = advance_with(relax=advance_contact_lag)
        return go, samples_with_step(go)

    @cached_property
    def _on_engine(self) -> SprungStepData:
        """Data that time steps in the engine need for a vehicle whose tyres respond without lag."""
        engine, size, table = self._model.compiled(), self.size, self._model.numbers
        return SprungStepData(
            table,
            self._at_wheels(table),
            WheelContacts(*np.zeros((3, self.wheels))),
            np.zeros(size),
            np.zeros((2, size)),
            np.zeros(size),
            self.liveliness,
            engine or self._model,
            self._units,
        )

    def _at_wheels(self, parameter_table: np.ndarray) -> WheelData:
        """``WheelData``: the wheel quantities at the end of a table, whose memory they share."""
        wheels = WheelStates(*np.zeros((WHEEL_QUANTITY_COUNT, self.wheels)))
        return WheelData(
            SprungWheelForces(
                *parameter_table[-VALUES_PER_WHEEL * self.wheels :].reshape(VALUES_PER_WHEEL, self.wheels)
            ),
            wheels,
            new_wheel_surfaces(self.wheels),
        )

    def advance(
        self,
        motion: PlaneMotion,
        torques: np.ndarray,
        step: float,
        steer: np.ndarray,
        vehicle: VehicleOnRoad,
        lag: "ContactLag | None" = None,
    ) -> tuple[int, float]:
        """Advance the vehicle as ``models.brake.advance.advance`` does; the state (2, n) has all coordinates and their
        rates. Returns the status and the time (s).

        lag : of tyres that lag, moved in place. A run begins with accelerations of zero. Raises RunFailed where the
        vehicle turns over.
        """
        go, _ = self._march_functions(lag is not None)
        with self._model.at_step(step):
            status, time = go(
                motion, torques, step, steer, _without_unit_count(vehicle), self._on_engine._replace(lag=lag or ())
            )
        return self._checked_status(status, time), time

    def moving(
        self,
        commands: Any,
        record: Any,
        sample: float,
        braking: Any,
        motion: PlaneMotion,
        vehicle: VehicleOnRoad,
        lag: "TyreLag | None" = None,
    ) -> Iterator[tuple[int, float, float, float]]:
        """Generator that marches the vehicle as ``models.brake.samples.sample_generator`` does; ``lag`` is the slip lag
        of the tyres. Raises Refused for a step that is too long, and RunFailed as ``advance`` does.
        """
        _, by_steps = self._march_functions(lag is not None)
        step, on_engine = sample / (braking.torques.shape[0] - 1), self._on_engine
        self.check_step(step)
        if lag is not None:
            from models.brake.sprung_relaxation import ContactLag

            on_engine = on_engine._replace(lag=ContactLag(*lag, np.zeros(1)))
        rows = by_steps(commands, record, sample, braking, motion, _without_unit_count(vehicle), on_engine)
        while True:
            with self._model.at_step(step):
                status, time, speed, supply = next(rows)
            yield self._checked_status(status, time), time, speed, supply

    def check_step(self, step: float) -> None:
        """Raise Refused for a step (s) with which a mode of the vehicle on its springs and tyres would be unstable."""
        if step in self._allowed:
            return
        check_modes(
            self.engine,
            linearise(self.vehicle.handling.vehicle),
            Settings(INTEGRATORS[self.engine], step, LONG_RUN * step),
        )
        self._allowed.add(step)

    def _checked_status(self, march_status: int, time: float) -> int:
        """The status of a march, unchanged; raises RunFailed if the vehicle turned over, jackknifed, or the engine gave
        up."""
        if march_status == OVER:
            raise RunFailed(self.engine, f"the vehicle turns over: it leans by more than {LARGEST_LEAN} rad", time)
        if march_status == FOLDED:
            raise RunFailed(
                self.engine, f"the train jackknifes: a hitch yaws by more than {LARGEST_HINGE_ANGLE:.2f} rad", time
            )
        if march_status == GAVE_UP:
            reason = "the engine gave up, since the motion grew without bound: raise run.substeps"
            raise RunFailed(self.engine, reason, time)
        return march_status

    def rolling(self, state: np.ndarray, steer: np.ndarray, vehicle: VehicleOnRoad) -> tuple[np.ndarray, np.ndarray]:
        """Accelerations (n,) of a state (2, n) in which the wheels roll without brakes, and the wheels' rotational
        speeds (W,) in rad/s."""
        on_engine, none = self._on_engine, np.zeros(steer.size)
        known = self._at_wheels(on_engine.force_table)
        for part in known.wheel_forces:
            part[:] = 0.0
        known.wheel_forces.steer[:] = steer
        forces_and_contacts(on_engine.force_table, *state, np.zeros(self.size), on_engine.contacts)
        turning = on_engine.contacts.along / vehicle.plane.radius
        for whole, of_units in zip(state, on_engine.units.motion, strict=True):
            fill_unit_values(whole, on_engine.units.turns, of_units)
        fill_surfaces_under_wheels(on_engine.units.motion, 0.0, _without_unit_count(vehicle), known.surfaces)
        known.wheels.start[:] = on_engine.contacts.along
        set_slip_angles(on_engine.contacts, 0.0, known.surfaces.lag, vehicle.tables.angles, known.wheels)
        store_mean_forces(known, none, none, SHORT_TIME, motion_of(state, turning), _without_unit_count(vehicle))
        return self._model.acceleration(0.0, *state), turning


def _without_unit_count(vehicle: VehicleOnRoad) -> VehicleOnRoad:
    """The vehicle with the number of its units cleared, so that steps are compiled for one type whatever the vehicle
    tows."""
    return vehicle._replace(plane=vehicle.plane._replace(units=(0,)))
