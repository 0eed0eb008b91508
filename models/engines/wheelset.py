"""A wheelset on rails whose accelerations an engine computes.

It is a free vehicle (``free_vehicle``): one body behind five joints, with its weight, the primary suspension as
elements of the engine, and both rails as the compiled forces. The suspension's ends are points of the axle, which spin
does not move. All that follows from accelerations and paths (rest, linearisation, critical speed, limit cycle) is that
of ``rail.equations``, of which this takes the rates and the march from the engine.
"""

from functools import cached_property

import numpy as np

from models.contact.inputs import Array
from models.core.errors import RunFailed
from models.engines.free_vehicle import FreeModel, LoadedVehicle, free_model
from models.engines.native_parts import GroundSpring
from models.rail.equations import DERAILED_LIMIT, ROLL, YAW, WheelsetEquations, Y, Z
from models.rail.joint_forces import (
    JOINTS,
    joint_force_table,
    joint_forces,
    joints_from_states,
    set_joint_forces,
    state_rates,
    states_from_joints,
)
from models.rail.wheelset import GRAVITY
from models.vehicles.spatial import Body, SpatialVehicle

CENTRE = (0.0, 0.0, 0.0)


def driven_wheelset(wheelset_equations: WheelsetEquations) -> LoadedVehicle:
    """The wheelset as engines build it: bodies in the order of the joints, the suspension at both ends, and the table
    of numbers for the forces of the rails."""
    body = wheelset_equations.body
    across, along = body.yaw_inertia, body.spin_inertia
    inertia = ((across, 0.0, 0.0), (0.0, along, 0.0), (0.0, 0.0, across))
    track = np.array([0.0, body.lean, 1.0])  # along the track's axes, by a weight's part square to the track
    bodies = (
        Body("yaw", 0.0, CENTRE, ("y", "z", "rz")),
        Body("roll", 0.0, CENTRE, ("rx",), parent="yaw"),
        Body("wheelset", body.mass, CENTRE, ("ry",), inertia, parent="roll"),
    )
    springs = tuple(
        GroundSpring(
            "wheelset",
            (0.0, arm, 0.0),
            (0.0, arm, body.rest_height),
            body.stiffness,
            body.damping,
            body.carried_weight * track,
        )
        for arm in (body.half_spacing, -body.half_spacing)
    )
    numbers = joint_force_table(float(wheelset_equations.speed), wheelset_equations.rails)
    vehicle = SpatialVehicle("wheelset", bodies, (), (), ())
    return LoadedVehicle(vehicle, GRAVITY * track, numbers, joint_forces, set_joint_forces, ground_springs=springs)


class EngineWheelset(WheelsetEquations):
    """A wheelset that an engine moves along the track at a constant speed; parameters and results as in
    ``WheelsetEquations``."""

    @cached_property
    def model(self) -> FreeModel:
        """The wheelset in its engine, with joint coordinates."""
        return free_model(self.ENGINE, driven_wheelset(self))

    def rates(self, wheelset_state: Array) -> Array:
        """Time derivatives (10,) of a state (10,), computed by the engine."""
        joints = joints_from_states(np.asarray(wheelset_state, float))
        return state_rates(joints, self.model.acceleration(0.0, joints[:JOINTS], joints[JOINTS:]))

    def _states_and_contacts(
        self, wheelset_state: Array, row_count: int, time_step: float, steps_per_row: int
    ) -> tuple[Array, Array]:
        """States (m, 10) by the engine's RK4, every ``steps_per_row``-th of them, and the contacts in these states."""
        joints = joints_from_states(wheelset_state)
        states = states_from_joints(self.model.march(joints[:JOINTS], joints[JOINTS:], row_count, time_step))
        away = ~(np.abs(states[:, [Y, Z, ROLL, YAW]]).sum(axis=1) < DERAILED_LIMIT)
        if away.any():
            raise RunFailed(self.ENGINE, "the wheelset leaves the track", (int(np.argmax(away)) - 1) * time_step)
        return states[::steps_per_row], self.at(states[::steps_per_row])[1]


class ExudynWheelset(EngineWheelset):
    """The wheelset in Exudyn."""

    ENGINE = "exudyn"


class MujocoWheelset(EngineWheelset):
    """The wheelset in MuJoCo."""

    ENGINE = "mujoco"
