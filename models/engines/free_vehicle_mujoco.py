"""A free vehicle in MuJoCo: native bodies and joints, all other forces by a native callback."""

from collections.abc import Iterator
from contextlib import contextmanager

import mujoco
import numpy as np

from models.core.errors import RunFailed
from models.engines.assembly import Settings
from models.engines.free_vehicle import FreeModel, LoadedVehicle
from models.engines.mujoco_callback import kernel_law
from models.engines.mujoco_layout import check_offsets
from models.engines.mujoco_march import GAVE_UP, Marcher
from models.engines.mujoco_native import NativeMujoco, native_mujoco
from models.engines.mujoco_quiet import installed_callback, without_warnings
from models.engines.mujoco_tree import MujocoIndices, keep_small_turns, mujoco_specification, set_masses
from models.engines.native_mujoco import (
    add_body_load,
    add_connection,
    add_constraints,
    add_ground_spring,
    add_line_spring,
    add_parts,
    add_rotors,
    add_turning_spring,
    built_elements,
    end_bodies,
    set_laws,
    set_line_springs,
    set_rotors,
)
from models.engines.native_parts import rotors
from models.vehicles.spatial import SpatialVehicle


def mergeable_carriers(vehicle: SpatialVehicle) -> dict[str, str]:
    """Bodies that MuJoCo can merge with the only body that they carry: name of the carrier to name of the carried body.

    They have no mass, or are points about which the other does no more than turn: either way the other's mass and
    inertia, with the point's mass, move as both do.
    """
    only = {}
    for body in vehicle.bodies:
        riders = [rider for rider in vehicle.bodies if rider.parent == body.name]
        if len(riders) != 1 or np.any(body.inertia):
            continue
        (rider,) = riders
        turns_about = rider.position == body.position and all(freedom.startswith("r") for freedom in rider.freedoms)
        if turns_about or not body.mass:
            only[body.name] = rider.name
    return only


def specification_of(loaded_vehicle: LoadedVehicle) -> mujoco.MjSpec:
    """MuJoCo specification with bodies, joints, springs and space for the callback's numbers, which ``compiled_from``
    fills in."""
    spec = mujoco_specification(loaded_vehicle.vehicle, 1e-3, _merged_bodies(loaded_vehicle))
    add_parts(spec, loaded_vehicle.vehicle, loaded_vehicle.parts)
    add_rotors(spec, loaded_vehicle.vehicle, rotors(loaded_vehicle.vehicle))
    for spring in loaded_vehicle.ground_springs:
        add_ground_spring(spec, loaded_vehicle.vehicle, spring)
    for line in loaded_vehicle.line_springs:
        add_line_spring(spec, loaded_vehicle.vehicle, line)
    for load in loaded_vehicle.body_loads:
        add_body_load(spec, loaded_vehicle.vehicle, load)
    for turning in loaded_vehicle.turning_springs:
        add_turning_spring(spec, loaded_vehicle.vehicle, turning)
    add_constraints(spec, loaded_vehicle.vehicle, loaded_vehicle.frictions, loaded_vehicle.couplings)
    for connection in loaded_vehicle.connections:
        add_connection(spec, loaded_vehicle.vehicle, connection)
    spec.option.gravity = loaded_vehicle.gravity
    spec.add_numeric(name="vehicle", size=loaded_vehicle.numbers.size, data=[0.0])
    return spec


def _merged_bodies(loaded_vehicle: LoadedVehicle) -> dict[str, str]:
    """Bodies that are merged with the only body that they carry: those of ``mergeable_carriers`` at which no spring or
    constraint ends."""
    end_bodies_of_springs = [body for line in loaded_vehicle.line_springs for body, _ in line.ends]
    end_bodies_of_springs += [body for connection in loaded_vehicle.connections for body, _ in connection.ends]
    end_bodies_of_springs += [body for each in loaded_vehicle.turning_springs for body in each.bodies]
    end_bodies_of_springs += [load.body for load in loaded_vehicle.body_loads]
    bearing = end_bodies(loaded_vehicle.parts) | {body for body in end_bodies_of_springs if body is not None}
    return {name: rider for name, rider in mergeable_carriers(loaded_vehicle.vehicle).items() if name not in bearing}


def compiled_from(mujoco_spec: mujoco.MjSpec, loaded_vehicle: LoadedVehicle) -> mujoco.MjModel:
    """MuJoCo model compiled from the specification of ``specification_of``, with all its numbers but without the
    callback."""
    model = mujoco_spec.compile()
    model.numeric_data[:] = loaded_vehicle.numbers
    places = MujocoIndices(loaded_vehicle.vehicle, model, _merged_bodies(loaded_vehicle))
    if not np.array_equal(places.columns, np.arange(loaded_vehicle.size)):
        raise ValueError("the bodies are not in the order of a walk through their tree")
    with without_warnings():  # a hinge with a ball joint of one body has no inertia but its rotor, which comes next
        set_masses(model, places, loaded_vehicle.vehicle.bodies)
    set_rotors(model, rotors(loaded_vehicle.vehicle))
    if loaded_vehicle.tied or loaded_vehicle.frictions:  # how soft constraints are depends on all inertias
        model.dof_simplenum[:] = model.body_simple[:] = 0  # else rotors of slides would not count
        mujoco.mj_setConst(model, mujoco.MjData(model))
    keep_small_turns(model)  # last, since mj_setConst looks for them, too
    set_laws(model, loaded_vehicle.parts)
    set_line_springs(model, loaded_vehicle.line_springs)
    return model


def compiled_model(loaded_vehicle: LoadedVehicle) -> mujoco.MjModel:
    """Compiled MuJoCo model of a free vehicle with bodies, joints, springs and the callback's numbers, but without the
    callback."""
    return compiled_from(specification_of(loaded_vehicle), loaded_vehicle)


def native_elements_and_joints(loaded_vehicle: LoadedVehicle) -> tuple[tuple[str, ...], int]:
    """Names of the elements that have a tendon or an actuator in the built model, and the number of its joints."""
    model = compiled_model(loaded_vehicle)
    return built_elements(model), int(model.njnt)


class FreeMujoco(FreeModel):
    """One free vehicle in one MuJoCo model; the callback's numbers are stored in the model."""

    ENGINE = "mujoco"

    def __init__(self, loaded_vehicle: LoadedVehicle, run_settings: Settings | None = None) -> None:
        self.driven, self.size, self.settings = loaded_vehicle, loaded_vehicle.size, run_settings
        self.model = compiled_model(loaded_vehicle)
        self.data = mujoco.MjData(self.model)
        self.law = kernel_law(loaded_vehicle.kernel) if loaded_vehicle.has_kernel else None
        self._marcher = Marcher(self.model)
        check_offsets(self.model, self.data)

    @property
    def numbers(self) -> np.ndarray:
        """The table of the callback's numbers in the model."""
        return self.model.numeric_data

    @contextmanager
    def at_step(self, time_step: float) -> Iterator[None]:
        """Context for a march in steps of ``time_step`` (s), in which the callback is installed."""
        self.model.opt.timestep = time_step
        with installed_callback(self.law):
            yield

    def compiled(self) -> NativeMujoco:
        """Handle with which compiled code calls MuJoCo: its functions and arrays."""
        return native_mujoco(self.model, self.data)

    def plan(self) -> dict[str, int]:
        """Counts of built items: degrees of freedom, native items, callbacks."""
        m = self.model
        native = m.nbody - 1 + m.njnt + m.ntendon + m.nu
        return {"degrees of freedom": m.nv, "native items": native, "callbacks": int(self.driven.has_kernel)}

    def acceleration(self, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (n,) from MuJoCo's ``mj_forward``."""
        self.data.time, self.data.qpos[:], self.data.qvel[:] = time, q, v
        with installed_callback(self.law):
            mujoco.mj_forward(self.model, self.data)
        return self.data.qacc.copy()

    def mass_and_force(self, time: float, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """MuJoCo's own mass matrix (n, n) and generalised forces (n,), constraint forces included, at a time (s),
        positions and rates (n,)."""
        self.acceleration(time, q, v)
        mass = np.empty((self.size, self.size))
        mujoco.mj_fullM(self.model, self.data, mass)
        return mass, self.data.qfrc_smooth + self.data.qfrc_constraint

    def gaps(self, q: np.ndarray) -> np.ndarray:
        """Residuals (c,) of MuJoCo's own c equality constraints at coordinates (n,)."""
        self.acceleration(0.0, q, np.zeros(self.size))
        gaps: np.ndarray = self.data.efc_pos[self.data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY]
        return gaps.copy()

    def march(self, q: np.ndarray, v: np.ndarray, steps: int, step: float) -> np.ndarray:
        """Positions and rates (steps + 1, 2 n) by MuJoCo's RK4; RunFailed where MuJoCo gives up."""
        self.model.opt.timestep, start = step, np.concatenate((q, v))
        if steps == 1:
            return np.vstack((start, self._stepped(q, v, step)))
        with installed_callback(self.law):
            return np.vstack((start, self._marcher.run(start[None], steps)[0]))

    def _stepped(self, q: np.ndarray, v: np.ndarray, time_step: float) -> np.ndarray:
        """State (2 n,) after one step (s), without the overhead of a loop; RunFailed where MuJoCo resets itself to time
        zero."""
        data = self.data
        data.time, data.qpos[:], data.qvel[:] = 0.0, q, v
        with installed_callback(self.law):
            mujoco.mj_step(self.model, data)
        after = np.concatenate((data.qpos, data.qvel))
        if data.time < 0.5 * time_step or not np.isfinite(after).all():
            raise RunFailed("mujoco", GAVE_UP, data.time)
        return after
