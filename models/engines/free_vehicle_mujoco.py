"""A free vehicle in MuJoCo: native bodies and joints, all other forces by a native callback."""

from collections.abc import Iterator
from contextlib import contextmanager

import mujoco
import numpy as np

from models.core.errors import RunFailed
from models.engines.assembly import Settings
from models.engines.free_vehicle import Driven, FreeModel
from models.engines.mujoco_callback import kernel_law
from models.engines.mujoco_layout import check_offsets
from models.engines.mujoco_march import GAVE_UP, Marcher
from models.engines.mujoco_native import Native, native
from models.engines.mujoco_quiet import installed, without_warnings
from models.engines.mujoco_tree import MujocoIndices, keep_small_turns, set_masses, spec_of
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


def specification_of(driven: Driven) -> mujoco.MjSpec:
    """MuJoCo specification with bodies, joints, springs and space for the callback's numbers, which ``compiled_from``
    fills in."""
    spec = spec_of(driven.vehicle, 1e-3, _merged_bodies(driven))
    add_parts(spec, driven.vehicle, driven.parts)
    add_rotors(spec, driven.vehicle, rotors(driven.vehicle))
    for spring in driven.ground_springs:
        add_ground_spring(spec, driven.vehicle, spring)
    for line in driven.line_springs:
        add_line_spring(spec, driven.vehicle, line)
    for load in driven.body_loads:
        add_body_load(spec, driven.vehicle, load)
    for turning in driven.turning_springs:
        add_turning_spring(spec, driven.vehicle, turning)
    add_constraints(spec, driven.vehicle, driven.frictions, driven.couplings)
    for connection in driven.connections:
        add_connection(spec, driven.vehicle, connection)
    spec.option.gravity = driven.gravity
    spec.add_numeric(name="vehicle", size=driven.numbers.size, data=[0.0])
    return spec


def _merged_bodies(driven: Driven) -> dict[str, str]:
    """Bodies that are merged with the only body that they carry: those of ``mergeable_carriers`` at which no spring or
    constraint ends."""
    end_bodies_of_springs = [body for line in driven.line_springs for body, _ in line.ends]
    end_bodies_of_springs += [body for connection in driven.connections for body, _ in connection.ends]
    end_bodies_of_springs += [body for each in driven.turning_springs for body in each.bodies]
    end_bodies_of_springs += [load.body for load in driven.body_loads]
    bearing = end_bodies(driven.parts) | {body for body in end_bodies_of_springs if body is not None}
    return {name: rider for name, rider in mergeable_carriers(driven.vehicle).items() if name not in bearing}


def compiled_from(spec: mujoco.MjSpec, driven: Driven) -> mujoco.MjModel:
    """MuJoCo model compiled from the specification of ``specification_of``, with all its numbers but without the
    callback."""
    model = spec.compile()
    model.numeric_data[:] = driven.numbers
    places = MujocoIndices(driven.vehicle, model, _merged_bodies(driven))
    if not np.array_equal(places.columns, np.arange(driven.size)):
        raise ValueError("the bodies are not in the order of a walk through their tree")
    with without_warnings():  # a hinge with a ball joint of one body has no inertia but its rotor, which comes next
        set_masses(model, places, driven.vehicle.bodies)
    set_rotors(model, rotors(driven.vehicle))
    if driven.tied or driven.frictions:  # how soft constraints are depends on all inertias
        model.dof_simplenum[:] = model.body_simple[:] = 0  # else rotors of slides would not count
        mujoco.mj_setConst(model, mujoco.MjData(model))
    keep_small_turns(model)  # last, since mj_setConst looks for them, too
    set_laws(model, driven.parts)
    set_line_springs(model, driven.line_springs)
    return model


def compiled_model(driven: Driven) -> mujoco.MjModel:
    """Compiled MuJoCo model of a free vehicle with bodies, joints, springs and the callback's numbers, but without the
    callback."""
    return compiled_from(specification_of(driven), driven)


def native_elements_and_joints(driven: Driven) -> tuple[tuple[str, ...], int]:
    """Names of the elements that have a tendon or an actuator in the built model, and the number of its joints."""
    model = compiled_model(driven)
    return built_elements(model), int(model.njnt)


class FreeMujoco(FreeModel):
    """One free vehicle in one MuJoCo model; the callback's numbers are stored in the model."""

    ENGINE = "mujoco"

    def __init__(self, driven: Driven, settings: Settings | None = None) -> None:
        self.driven, self.size, self.settings = driven, driven.size, settings
        self.model = compiled_model(driven)
        self.data = mujoco.MjData(self.model)
        self.law = kernel_law(driven.kernel) if driven.has_kernel else None
        self._marcher = Marcher(self.model)
        check_offsets(self.model, self.data)

    @property
    def numbers(self) -> np.ndarray:
        """The table of the callback's numbers in the model."""
        return self.model.numeric_data

    @contextmanager
    def at_step(self, step: float) -> Iterator[None]:
        """Context for a march in steps of ``step`` (s), in which the callback is installed."""
        self.model.opt.timestep = step
        with installed(self.law):
            yield

    def compiled(self) -> Native:
        """Handle with which compiled code calls MuJoCo: its functions and arrays."""
        return native(self.model, self.data)

    def plan(self) -> dict[str, int]:
        """Counts of built items: degrees of freedom, native items, callbacks."""
        m = self.model
        native = m.nbody - 1 + m.njnt + m.ntendon + m.nu
        return {"degrees of freedom": m.nv, "native items": native, "callbacks": int(self.driven.has_kernel)}

    def acceleration(self, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (n,) from MuJoCo's ``mj_forward``."""
        self.data.time, self.data.qpos[:], self.data.qvel[:] = time, q, v
        with installed(self.law):
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
        with installed(self.law):
            return np.vstack((start, self._marcher.run(start[None], steps)[0]))

    def _stepped(self, q: np.ndarray, v: np.ndarray, step: float) -> np.ndarray:
        """State (2 n,) after one step (s), without the overhead of a loop; RunFailed where MuJoCo resets itself to time
        zero."""
        data = self.data
        data.time, data.qpos[:], data.qvel[:] = 0.0, q, v
        with installed(self.law):
            mujoco.mj_step(self.model, data)
        after = np.concatenate((data.qpos, data.qvel))
        if data.time < 0.5 * step or not np.isfinite(after).all():
            raise RunFailed("mujoco", GAVE_UP, data.time)
        return after
