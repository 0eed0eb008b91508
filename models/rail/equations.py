"""Nonlinear equations of motion of a wheelset on straight track: rest position, linearisation, integration by RK4 with
fixed steps.

States (10): y, z, roll, yaw, angle of spin; their rates but for the last, which is the spin about the axle itself,
the body's whole angular velocity along it. The frame of the coordinates moves with the speed of travel. Its angular
velocity in axes that roll and yaw with the axle but do not spin is (roll', spin, yaw' cos roll) for the wheelset, with
yaw' sin roll in place of the spin for the axes themselves, and Euler's equations in them are, with the moments M about
the centre, I across and J along the axle,

    I roll''          = M1 - I yaw'^2 sin roll cos roll + J spin yaw' cos roll
    J spin'           = M2
    I yaw'' cos roll  = M3 + 2 I roll' yaw' sin roll - J spin roll'

Forces: both rails' (``fill_wheel_forces``), the weight, and a spring and a damper along each axis of the track at each
end of the suspension, free of force in the middle of the track but for the vehicle's weight. On a track that leans both
wheelset and vehicle weigh to the right as well.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np
from scipy.optimize import brentq, root

from models.contact.inputs import Array, checked_number, checked_quantity
from models.core.errors import InputError, RunFailed
from models.core.resolved import check_resolved
from models.core.steps import step_divides
from models.core.trajectory import Trajectory
from models.machine.compiled import lean, njit
from models.machine.records import size_of
from models.rail.profile_contact import WheelPose
from models.rail.wheel_forces import (
    LAW_NUMBERS,
    REPORT_RECORD,
    RailsAndWheels,
    count_of_patches,
    fill_wheel_forces,
    plain_rails,
    rails_from_tuples,
    rails_of,
    supported_force,
    workspace_for,
)
from models.rail.wheelset import GRAVITY, Wheelset

STATE_COUNT = 10
Y, Z, ROLL, YAW, ANGLE, Y_RATE, Z_RATE, ROLL_RATE, YAW_RATE, SPIN = range(STATE_COUNT)
ALLOWED_STEP_RATE, LIMIT_OF_RK4 = 2.5, 2.785
"""Largest product of step and rate of the fastest motion: the allowed one, with a margin, and the stability limit of
RK4."""
DIFFERENCE_STEPS = np.array([3e-7, 3e-8, 3e-7, 3e-7, 3e-3, 3e-6, 3e-6, 3e-6, 3e-6, 3e-5])
"""Steps (10,) of the finite differences that linearise the rates: small against penetration (7e-5 m) and creepage."""
LARGEST_SPEED = 200.0
"""Largest speed (m/s) of a wheelset."""
DERAILED_LIMIT = 0.3
"""Sum of the magnitudes of yaw and roll (rad) and displacements (m) from which the wheelset counts as derailed."""
DEEPEST_POSITION = 5e-3
"""Lowest position z (m, down) searched at which the rails carry the load."""
NO_REPORT = np.empty(0, REPORT_RECORD)
"""Report without rows, for rates without contact reports, which take longer to compute than the rates."""


TrackVector = tuple[float, float, float]
"""Values along the track's axes x, y, z."""


class WheelsetBody(NamedTuple):
    """Body and suspension of a wheelset (SI): mass; inertia along and across the axle; half spacing of the springs;
    springs and dampers of one side; weight of the vehicle on each side; position z (m, down) at which the springs
    carry exactly that weight; lean of the track; whether there is a spring or a damper."""

    mass: float
    spin_inertia: float
    yaw_inertia: float
    half_spacing: float
    stiffness: TrackVector
    damping: TrackVector
    carried_weight: float
    rest_height: float
    lean: float
    has_suspension: bool


class RungeKuttaArrays(NamedTuple):
    """Work arrays for a Runge-Kutta step: sum of the rates, rates and state of a stage (10,); a report without rows."""

    summed_rate: Array
    rate: Array
    stage_state: Array
    empty_report: Array


@njit(cache=True, error_model="numpy")
def fill_rates(wheelset_state, speed, wheelset_body, rails, state_rate, contact_report):
    """Fill ``state_rate`` with the time derivative of a state (10,), and ``contact_report``, REPORT (patches,), with
    the contacts.

    speed, wheelset_body, rails : ``parameters`` of ``WheelsetEquations``.
    """
    rails_record = rails_from_tuples(rails)
    fill_rates_with_workspace(
        wheelset_state,
        speed,
        WheelsetBody(*wheelset_body),
        rails_record,
        state_rate,
        contact_report,
        workspace_for(rails_record.profile),
    )


@lean
def fill_rates_with_workspace(
    wheelset_state, speed, wheelset_body, rails, state_rate, contact_report, contact_workspace
):
    """Fill ``state_rate`` with the time derivative of a state (10,). contact_workspace : ``WheelForcesWorkspace``,
    written over; contact_report : has no rows where no contact report is wanted.
    """
    y, z, roll, yaw = wheelset_state[Y], wheelset_state[Z], wheelset_state[ROLL], wheelset_state[YAW]
    roll_rate, yaw_rate, spin = wheelset_state[ROLL_RATE], wheelset_state[YAW_RATE], wheelset_state[SPIN]
    cr, sr, cy, sy = math.cos(roll), math.sin(roll), math.cos(yaw), math.sin(yaw)
    wheelset = contact_workspace.wheelset[0]
    force, moment, velocity, turning = wheelset.force, wheelset.moment, wheelset.velocity, wheelset.turning
    for k in range(3):
        force[k] = moment[k] = 0.0
    velocity[0], velocity[1], velocity[2] = speed, wheelset_state[Y_RATE], wheelset_state[Z_RATE]
    axle = axle_x, axle_y, axle_z = -sy * cr, cy * cr, sr
    rolling = spin - yaw_rate * sr  # of the wheel against the axes that do not spin
    turning[0], turning[1] = cy * roll_rate + axle_x * rolling, sy * roll_rate + axle_y * rolling
    turning[2] = yaw_rate + axle_z * rolling
    fill_wheel_forces(WheelPose(y, z, roll, yaw), rails, contact_report, contact_workspace)
    force[1] += 2.0 * wheelset_body.carried_weight * wheelset_body.lean
    force[2] += 2.0 * wheelset_body.carried_weight
    if wheelset_body.has_suspension:
        _add_suspension_forces(wheelset_state, wheelset_body, (cy * roll_rate, sy * roll_rate), axle, force, moment)
    m1 = cy * moment[0] + sy * moment[1]
    across = cy * moment[1] - sy * moment[0]
    m2, m3 = cr * across + sr * moment[2], cr * moment[2] - sr * across
    state_rate[Y], state_rate[Z], state_rate[ROLL], state_rate[YAW] = (
        wheelset_state[Y_RATE],
        wheelset_state[Z_RATE],
        roll_rate,
        yaw_rate,
    )
    state_rate[ANGLE] = rolling
    state_rate[Y_RATE] = force[1] / wheelset_body.mass + GRAVITY * wheelset_body.lean
    state_rate[Z_RATE] = force[2] / wheelset_body.mass + GRAVITY
    whirl = wheelset_body.spin_inertia * spin
    state_rate[ROLL_RATE] = (m1 + whirl * yaw_rate * cr) / wheelset_body.yaw_inertia - yaw_rate**2 * sr * cr
    state_rate[SPIN] = m2 / wheelset_body.spin_inertia
    state_rate[YAW_RATE] = ((m3 - whirl * roll_rate) / wheelset_body.yaw_inertia + 2.0 * roll_rate * yaw_rate * sr) / cr


@lean
def _add_suspension_forces(wheelset_state, wheelset_body, angular_velocity, axle, force, moment):
    """Add the forces of springs and dampers at both ends of the axle; angular_velocity : angular velocity about the x
    and y of the axle's own axes (rad/s).
    """
    (turn_x, turn_y), (kx, ky, kz), (dx, dy, dz) = angular_velocity, wheelset_body.stiffness, wheelset_body.damping
    for side in (1.0, -1.0):
        arm, turn_z = side * wheelset_body.half_spacing, wheelset_state[YAW_RATE]
        ax, ay, az = arm * axle[0], arm * axle[1], arm * axle[2]
        vx, vy, vz = turn_y * az - turn_z * ay, turn_z * ax - turn_x * az, turn_x * ay - turn_y * ax
        fx = -kx * ax - dx * vx
        fy = -ky * (wheelset_state[Y] + ay - arm) - dy * (wheelset_state[Y_RATE] + vy)
        fz = -kz * (wheelset_state[Z] + az - wheelset_body.rest_height) - dz * (wheelset_state[Z_RATE] + vz)
        force[0] += fx
        force[1] += fy
        force[2] += fz
        moment[0] += ay * fz - az * fy
        moment[1] += az * fx - ax * fz
        moment[2] += ax * fy - ay * fx


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False)
def march_wheelset(
    wheelset_state, parameters, time_steps, path_states, contact_reports, contact_workspace, runge_kutta_arrays
):
    """Integrate from ``wheelset_state`` by RK4; the state is modified. Returns the number of steps made.

    parameters : of ``WheelsetEquations``; time_steps : length (s) of a step, count of steps, and after how many steps
    one goes into path and reports; contact_workspace, runge_kutta_arrays : arrays of the caller, to which no reference
    is held, which saves 5 % of the time of a bare wheelset."""
    (speed, plain_body, plain_tuples), (step, count, stride), (total, rate, stage_state, no_report) = (
        parameters,
        time_steps,
        runge_kutta_arrays,
    )
    body, rails = WheelsetBody(*plain_body), rails_from_tuples(plain_tuples)
    for i in range(count + 1):
        row = i // stride
        for stage in range(4):  # one call of the rates, or it is compiled four times
            is_recorded = stage == 0 and row * stride == i
            report = contact_reports[row] if is_recorded else no_report
            stage_step = step if stage == 3 else 0.5 * step
            for k in range(STATE_COUNT):  # a sum of whole arrays would make one
                stage_state[k] = wheelset_state[k] + stage_step * rate[k] if stage > 0 else wheelset_state[k]
            fill_rates_with_workspace(stage_state, speed, body, rails, rate, report, contact_workspace)
            for k in range(STATE_COUNT):
                total[k] = total[k] + (1.0 if stage == 3 else 2.0) * rate[k] if stage > 0 else rate[k]
            if is_recorded:
                for k in range(STATE_COUNT):
                    path_states[row, k] = wheelset_state[k]
            if stage == 0 and i == count:
                return i
        for k in range(STATE_COUNT):
            wheelset_state[k] += step / 6.0 * total[k]
        if (
            not abs(wheelset_state[Y]) + abs(wheelset_state[YAW]) + abs(wheelset_state[ROLL]) + abs(wheelset_state[Z])
            < DERAILED_LIMIT
        ):
            return i
    return count


@dataclass(frozen=True, eq=False, kw_only=True)
class WheelsetPath(Trajectory):
    """Motion of a wheelset over time: states (n, 10) as above; contacts, REPORT (n, patches) of ``fill_wheel_forces``,
    the right wheel's first.
    """

    contacts: Array


@dataclass(frozen=True, eq=False)
class WheelsetEquations:
    """Equations of motion of a wheelset that travels at a speed (m/s), or stands. law : creep law, "linear" or
    "fastsim"; cells : of FASTSIM's strips.

    lean : of the track to the right, the weight across the track as a share of that square to it.
    """

    ENGINE: ClassVar[str] = "wheelset"
    """Name of the engine in messages of failed runs."""

    wheelset: Wheelset
    speed: float
    law: Literal["linear", "fastsim"] = "fastsim"
    cells: int = 21
    lean: float = 0.0

    def __post_init__(self) -> None:
        if self.law not in LAW_NUMBERS:
            raise InputError("", "law", self.law, "is not known", tuple(LAW_NUMBERS))
        checked_number("speed", self.speed, "a speed in m/s from -200 to 200", -LARGEST_SPEED, LARGEST_SPEED)
        checked_number("lean", self.lean, "a slope across the track from -1 to 1", -1.0, 1.0)

    @cached_property
    def body(self) -> WheelsetBody:
        """Body and suspension of the wheelset."""
        w = self.wheelset
        carried = (w.load - w.mass * GRAVITY) / 2.0
        sunk = float(w.ellipse.approach) / w.cone_sine_and_cosine[1]
        if w.profiles:  # the height in the middle of the track at which smooth rails carry the load
            rails = rails_of(w)
            sunk = float(brentq(lambda z: supported_force(z, rails) - w.load, 0.0, DEEPEST_POSITION, xtol=1e-15))
        stiffness, damping = (w.stiffness_x, w.stiffness_y, w.stiffness_z), (w.damping_x, w.damping_y, w.damping_z)
        has_suspension = any(stiffness + damping)
        inertia = w.mass, w.spin_inertia, w.yaw_inertia
        return WheelsetBody(
            *inertia, w.half_spacing, stiffness, damping, carried, sunk, float(self.lean), has_suspension
        )

    @cached_property
    def rails(self) -> RailsAndWheels:
        """Compiled record of the rails or profiles that the wheels roll on."""
        return rails_of(self.wheelset, self.law, self.cells)

    @cached_property
    def parameters(self) -> tuple[float, tuple[Any, ...], tuple[Any, ...]]:
        """Arguments of the compiled functions after the state: speed (m/s), body and rails.

        The last two as plain tuples: numba asks Python for the type of a NamedTuple, in three times a call's own time.
        """
        return float(self.speed), tuple(self.body), plain_rails(self.rails)

    @cached_property
    def patch_count(self) -> int:
        """Largest possible number of contacts of both wheels together."""
        return int(count_of_patches(self.rails.profile))

    def empty_contacts(self, *array_shape: int) -> Array:
        """Contact records REPORT (*shape, patches) filled with NaN.

        Filled as doubles: as records numpy fills them in four times the time, which is that of the rates at two states.
        """
        return np.full((*array_shape, self.patch_count * size_of(REPORT_RECORD)), np.nan).view(REPORT_RECORD)

    def rates(self, wheelset_state: Array) -> Array:
        """Time derivative (10,) of a wheelset's state (10,)."""
        state_rate = np.empty(STATE_COUNT)
        fill_rates(np.asarray(wheelset_state, float), *self.parameters, state_rate, NO_REPORT)
        return state_rate

    def at(self, wheelset_states: Array) -> tuple[Array, Array]:
        """Time derivatives (n, 10) of states (n, 10) by the hand-written equations, and their contacts, REPORT (n,
        patches)."""
        state_rates, contacts = np.empty_like(wheelset_states), self.empty_contacts(len(wheelset_states))
        for state, rate, contact in zip(wheelset_states, state_rates, contacts, strict=True):
            fill_rates(state, *self.parameters, rate, contact)
        return state_rates, contacts

    @cached_property
    def rest(self) -> Array:
        """The steady state (10,) in the middle of the track: height and spin such that nothing accelerates."""
        start = np.zeros(STATE_COUNT)
        start[Z], start[SPIN] = self.body.rest_height, -self.speed / self.wheelset.radius
        return self._state_in_balance(start, (Z, SPIN), (Z_RATE, SPIN))

    def displaced_state(self, lateral_shift: float) -> Array:
        """State (10,) at a lateral displacement (m), at rest but for the spin, without yaw; height and roll are in
        equilibrium."""
        start, w = self.rest.copy(), self.wheelset
        start[Y] = lateral_shift
        start[ROLL] = -lateral_shift * w.roll_per_displacement
        if w.profiles:
            fall, start[ROLL] = w.profiles.first_touch_pose(w.radius, lateral_shift)
            start[Z] += fall
        return self._state_in_balance(start, (Z, ROLL), (Z_RATE, ROLL_RATE))

    def _state_in_balance(
        self, start_state: Array, free_coordinates: tuple[int, int], vanishing_accelerations: tuple[int, int]
    ) -> Array:
        """State in which two coordinates are solved for so that two accelerations vanish."""
        state_indices = list(free_coordinates)
        scale = np.maximum(np.abs(start_state[state_indices]), self.body.rest_height)

        def displaced(unknowns: Array) -> Array:
            state = start_state.copy()
            state[state_indices] += unknowns * scale
            return state

        solution = root(
            lambda unknown: self.rates(displaced(unknown))[list(vanishing_accelerations)], np.zeros(2), tol=1e-15
        )
        if np.abs(solution.fun).max() > 1e-6:
            w = self.wheelset
            raise RunFailed(
                "wheelset",
                f"no height was found at which both rails carry load = {w.load:g} N with mass = {w.mass:g} kg: give "
                "values of a real wheelset",
            )
        return displaced(solution.x)

    @cached_property
    def state_matrix(self) -> Array:
        """State matrix A (9, 9) of the equations linearised about rest; the angle of spin is left out."""
        return rate_jacobian(self.rates, self.rest)

    @cached_property
    def _fastest_rate(self) -> float:
        """Largest magnitude (1/s) of the eigenvalues of the motion about rest."""
        return float(np.abs(np.linalg.eigvals(self.state_matrix)).max())

    def run(self, wheelset_state: Array, duration: float, time_step: float, storing_stride: int = 1) -> WheelsetPath:
        """Integrate by RK4 from a state (10,) over a duration (s) with a step (s); every ``storing_stride``-th step is
        stored.

        Raises InputError for a state that is no wheelset's, a step too large for the fastest motion, or a duration that
        is no whole number of steps; RunFailed if the wheelset leaves the track, or if the step was too large for the
        contacts' largest loads among the states that are kept or, where all are, for the motion.
        """
        count = self._checked_step_count(wheelset_state, duration, time_step, storing_stride)
        states, contacts = self._states_and_contacts(np.array(wheelset_state, float), count, time_step, storing_stride)
        path = WheelsetPath(np.arange(len(states)) * time_step * storing_stride, states, contacts=contacts)
        self.check(path, time_step, storing_stride)
        return path

    def _states_and_contacts(
        self, wheelset_state: Array, step_count: int, time_step: float, storing_stride: int
    ) -> tuple[Array, Array]:
        """States and contacts at every ``storing_stride``-th step of a path; ``wheelset_state`` (10,) is modified."""
        row_count = step_count // storing_stride + 1
        states, contacts = np.empty((row_count, STATE_COUNT)), self.empty_contacts(row_count)
        steps_done = self.march_with_reports(wheelset_state, (time_step, step_count, storing_stride), states, contacts)
        if steps_done < step_count:
            raise RunFailed("wheelset", "leaves the track", steps_done * time_step)
        return states, contacts

    def march_with_reports(
        self, wheelset_state: Array, time_steps: tuple[float, int, int], states: Array, contacts: Array
    ) -> int:
        """Number of steps that ``march_wheelset`` makes before the wheelset leaves the track; ``wheelset_state`` (10,)
        is modified, ``states`` and ``contacts`` are filled."""
        total, rate, stage_state = np.empty((3, STATE_COUNT))
        stages = RungeKuttaArrays(total, rate, stage_state, NO_REPORT)
        return int(
            march_wheelset(
                wheelset_state, self.parameters, time_steps, states, contacts, workspace_for(self.rails.profile), stages
            )
        )

    def check(self, path_states: WheelsetPath, time_step: float, storing_stride: int) -> None:
        """Raise RunFailed if the step was too large for the contact loads or, where every step is stored, for the
        motion."""
        self.check_loads(path_states, time_step)
        if storing_stride == 1:
            w = self.wheelset
            inert = np.array([w.mass, w.mass, w.yaw_inertia, w.yaw_inertia])
            check_resolved(
                self.ENGINE, path_states.times, path_states.states[:, :ANGLE], path_states.states[:, Y_RATE:SPIN], inert
            )

    def check_loads(self, path_states: WheelsetPath, time_step: float) -> None:
        """Raise RunFailed if the step was too large for a patch with more than its load at rest, since the whole path
        is then wrong."""
        for k in sorted(set(path_states.contacts["load"].argmax(axis=0))):
            rate = float(
                np.abs(
                    np.linalg.eigvals(rate_jacobian(partial(WheelsetEquations.rates, self), path_states.states[k]))
                ).max()
            )
            if not time_step * rate <= LIMIT_OF_RK4:
                raise RunFailed(
                    self.ENGINE,
                    f"the step of {time_step:g} s is too large for contacts that carry "
                    f"{path_states.contacts[k]['load'].max():.3g} N, whose motion has a rate of {rate:.4g} 1/s",
                    path_states.times[k],
                )

    def _checked_step_count(self, wheelset_state: Array, duration: float, time_step: float, storing_stride: int) -> int:
        """Number of steps of a run, after checks of state, duration, step and stride."""
        if checked_quantity("state", wheelset_state, "ten finite numbers").shape != (STATE_COUNT,):
            raise InputError("", "state", None, f"must be {STATE_COUNT} finite numbers")
        if not 0.0 < checked_number("step", time_step, "a step in s") * self._fastest_rate <= ALLOWED_STEP_RATE:
            raise InputError(
                "",
                "step",
                time_step,
                f"must be above 0 and at most {ALLOWED_STEP_RATE / self._fastest_rate:.3g} s: the "
                f"fastest motion has a rate of {self._fastest_rate:.4g} 1/s",
            )
        if not step_divides(time_step, checked_number("duration", duration, "a time in s")):
            raise InputError("", "duration", duration, f"must be a whole number of steps of {time_step:g} s, 1 or more")
        count = round(duration / time_step)
        if (
            isinstance(storing_stride, bool)
            or not isinstance(storing_stride, int)
            or not 1 <= storing_stride <= count
            or count % storing_stride
        ):
            raise InputError("", "every", storing_stride, f"must be a whole number that divides the {count} steps")
        return count


def rate_jacobian(
    state_rates: Callable[[Array], Array], wheelset_state: Array, difference_factor: float = 1.0
) -> Array:
    """Jacobian (9, 9) of the rates at a state, without the angle of spin, by fourth-order central differences over
    ``difference_factor`` times the usual distance."""
    columns, steps = [], difference_factor * DIFFERENCE_STEPS
    for k in range(STATE_COUNT):
        a, b, c, d = (
            state_rates(wheelset_state + multiple * steps[k] * np.eye(STATE_COUNT)[k])
            for multiple in (-2.0, -1.0, 1.0, 2.0)
        )
        columns.append((a - 8.0 * b + 8.0 * c - d) / (12.0 * steps[k]))
    return np.delete(np.delete(np.array(columns).T, ANGLE, 0), ANGLE, 1)
