"""Static equilibrium of a wheelset with profiles on smooth rails at a lateral displacement, and the cones that steer
like the profiles."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import root

from models.contact.inputs import Array
from models.core.errors import InputError, RunFailed
from models.rail.equivalent_conicity import harmonic_linearised_conicity
from models.rail.profile_contact import TOUCH_RECORD, WheelPose, normal_force_and_axes
from models.rail.wheel_forces import contact_points, count_of_patches, rails_of
from models.rail.wheelset import Wheelset

DIFFERENCE_SIZES = 1e-5
"""Scale (m, rad) of the changes of height and roll that the search makes."""
LOAD_PRECISION = 1e-9
"""Relative precision of each wheel's load."""
SHIFT_COUNT = 16
"""Count of lateral displacements up to the amplitude at which rolling radii are computed."""


@dataclass(frozen=True, eq=False)
class StaticEquilibrium:
    """Static position of a wheelset: height z (m) and roll (rad), its contact patches, TOUCH (patches,), and their
    loads (patches,) in N, those of the right wheel first."""

    z: float
    roll: float
    touches: Array
    loads: Array

    def rolling_radii(self) -> Array:
        """Rolling radii (2,) of the right and the left wheel (m); each is the load-weighted mean over the wheel's
        patches."""
        axle = np.array([0.0, np.cos(self.roll), np.sin(self.roll)])
        positions = np.column_stack([self.touches[name] for name in "xyz"])
        radius = np.linalg.norm(positions - np.outer(positions @ axle, axle), axis=1)
        weighed, loads = (radius * self.loads).reshape(2, -1).sum(axis=1), self.loads.reshape(2, -1).sum(axis=1)
        return weighed / loads


def static_equilibrium(wheelset: Wheelset, lateral_shift: float) -> StaticEquilibrium:
    """Static equilibrium of the wheelset at a lateral displacement (m), without yaw, with half the load on each wheel.

    Raises InputError for a wheelset without profiles or a displacement at which not both wheels touch.
    """
    if wheelset.profiles is None:
        raise InputError("", "wheelset", None, "has cones: this needs profiles")
    rails, half = rails_of(wheelset), 0.5 * wheelset.load
    z, roll = wheelset.profiles.first_touch_pose(wheelset.radius, lateral_shift)

    def pose(fall_and_roll: Array) -> StaticEquilibrium:
        touches = np.zeros(count_of_patches(rails.profile), TOUCH_RECORD)
        height_and_roll = (z + fall_and_roll[0] * DIFFERENCE_SIZES, roll + fall_and_roll[1] * DIFFERENCE_SIZES)
        contact_points(WheelPose(lateral_shift, *height_and_roll, 0.0), rails, touches)
        modulus = rails.wheels["modulus"][0]
        loads = np.array(
            [normal_force_and_axes(touch.depth, touch.along, touch.across, modulus)[0] for touch in touches]
        )
        return StaticEquilibrium(*height_and_roll, touches, loads)

    def load_error(fall_and_roll: Array) -> Array:
        placed = pose(fall_and_roll)
        return (placed.loads * placed.touches["n_z"]).reshape(2, -1).sum(axis=1) / half - 1.0

    solved = root(load_error, [5.0, 0.0], tol=1e-14)
    if np.abs(solved.fun).max() > LOAD_PRECISION:
        raise RunFailed(
            "wheelset", f"no height was found at which both wheels carry their load at y = {lateral_shift:g} m"
        )
    return pose(solved.x)


def steering_cones(wheelset: Wheelset, amplitude: float) -> Wheelset:
    """The wheelset on cones with the equivalent conicity that its profiles have at an amplitude (m), for
    ``models.rail.linear``."""
    shifts = np.linspace(0.0, amplitude, SHIFT_COUNT + 1)
    differences = np.array(
        [0.0, *(-np.diff(static_equilibrium(wheelset, float(shift)).rolling_radii())[0] for shift in shifts[1:])]
    )
    return wheelset.coned(harmonic_linearised_conicity(shifts, differences, amplitude)).changed(profiles=None)
