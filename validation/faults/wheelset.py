"""Faults planted in the reference's equations of a wheelset, which run as plain Python for this, and the checks that
see them."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any, Literal
from unittest import mock

import numpy as np

from models.contact.inputs import Array
from models.contact.linear_theory import linear_creep_forces as kalker
from models.engines.wheelset import MujocoWheelset
from models.rail import equations as eq
from models.rail import wheel_forces as wf
from models.rail.eigenvalues import hunting_wavelength
from models.rail.energy import energies_at_states, rates_and_powers
from models.rail.equations import WheelsetEquations
from models.rail.linear import klingel_wavelength
from models.rail.wheelset import CHOSEN_WHEELSET
from validation.common.checks import largest_relative_difference
from validation.faults.campaign import Campaign, CampaignFault, Check
from validation.faults.patches import Context, Patch, attribute_patch, with_globals

CreepLaw = Literal["linear", "fastsim"]
STATES = np.array(
    [
        [3e-3, 4e-5, -1e-4, 4e-3, 0.0, 0.02, 0.01, 0.2, 0.3, 0.5],
        [-4e-3, 2e-5, 2e-4, 1e-2, 0.0, -0.05, 0.0, 0.1, -0.4, 2.0],
    ]
)
"""Displacements of two states from rest (m, rad, m/s, rad/s); in the second state the wheels slide fully."""
MIRROR_SIGNS = np.array([-1.0, 1.0, -1.0, -1.0, 1.0] * 2)
SPEED, SLIDING_STATE = 60.0, 1
HALF_DIFFERENCE_TIME = 1e-6
"""Half the time difference (s) over which energies are differentiated."""


def equations(creep_law: CreepLaw = "fastsim") -> WheelsetEquations:
    """The reference's equations of the chosen wheelset, with few contact cells."""
    return WheelsetEquations(CHOSEN_WHEELSET, SPEED, creep_law, 7)


@cache
def states() -> Array:
    """Two states (2, 10) of the wheelset near rest."""
    return equations().rest + STATES


@cache
def rates_by_mujoco() -> Array:
    """Time derivatives (2, 10) of the two states of ``states`` by MuJoCo."""
    built = MujocoWheelset(CHOSEN_WHEELSET, SPEED, cells=7)
    return np.array([built.rates(state) for state in states()])


def _engine_difference() -> float:
    return max(
        largest_relative_difference(equations().rates(state), rates)
        for state, rates in zip(states(), rates_by_mujoco(), strict=True)
    )


def _mirror_error() -> float:
    rates = equations().rates
    return max(
        largest_relative_difference(MIRROR_SIGNS * rates(MIRROR_SIGNS * state), rates(state)) for state in states()
    )


def _energy_balance_error() -> float:
    """Largest error of the wheelset's energy balance, divided by the largest power.

    The change of kinetic, spring and potential energy is taken by central differences along the motion.
    """
    written, state_rows = equations(), states()
    rates, powers = rates_and_powers(written, state_rows)
    energy_ahead, behind = (
        np.sum(energies_at_states(written, state_rows + direction * HALF_DIFFERENCE_TIME * rates), axis=0)
        for direction in (1.0, -1.0)
    )
    stored, driven, *lost = powers.T
    missing = (energy_ahead - behind) / (2.0 * HALF_DIFFERENCE_TIME) + stored - driven + sum(lost)
    return float(np.abs(missing).max() / np.abs(powers).max())


def _contact_report(wheelset_state: Array, creep_law: CreepLaw = "fastsim") -> Array:
    return equations(creep_law).at(wheelset_state[None])[1][0]


def _sliding_force_error() -> float:
    """Relative difference of the creep forces of fully sliding wheels from mu N; infinite if a contact gains energy."""
    report = _contact_report(states()[SLIDING_STATE])
    if report["power"].max() > 0.0:
        return np.inf
    bound = CHOSEN_WHEELSET.friction * report["load"]
    return float(np.abs(np.hypot(report["fx"], report["fy"]) / bound - 1.0).max())


def _spin_and_load_at_rest() -> float:
    """Relative error of the spin -V / r and of the carried load of a wheelset that rolls in the middle of the track;
    the larger of both."""
    rest_state = equations().rest
    report = _contact_report(rest_state)
    vertical_force = report["load"] * np.cos(report["angle"]) - report["fy"] * np.sin(report["angle"])
    return max(
        abs(rest_state[eq.SPIN] * CHOSEN_WHEELSET.radius / SPEED + 1.0),
        abs(vertical_force.sum() / CHOSEN_WHEELSET.load - 1.0),
    )


def _linear_law_error() -> float:
    """Largest relative error of the linear law's creep forces and moment against Kalker's theory at the reported
    creepages."""
    report = _contact_report(states()[0], "linear")
    a, b, x, y, spin = (report[name] for name in ("a", "b", "xi_x", "xi_y", "spin"))
    wanted = kalker(a, b, x, y, spin, CHOSEN_WHEELSET.material_pair)
    return max(
        largest_relative_difference(report[name], value) for name, value in zip(("fx", "fy", "mz"), wanted, strict=True)
    )


CHECKS = {
    "engine": Check("rates at two states by MuJoCo", "of the largest", 1e-10, _engine_difference),
    "mirror": Check("rates of the mirror image", "of the largest", 1e-12, _mirror_error),
    "balance": Check("change of energy by the powers", "of the largest", 1e-6, _energy_balance_error),
    "friction": Check(
        "force of sliding wheels by mu N, little of it by spin, no power", "relative", 1e-3, _sliding_force_error
    ),
    "wave": Check(
        "Klingel's wavelength in closed form",
        "relative",
        1e-3,
        lambda: abs(hunting_wavelength(WheelsetEquations, CHOSEN_WHEELSET) / klingel_wavelength(CHOSEN_WHEELSET) - 1.0),
    ),
    "rest": Check("spin and load at rest", "relative", 1e-5, _spin_and_load_at_rest),
    "linear": Check("forces by Kalker's linear theory", "of the largest", 1e-9, _linear_law_error),
}


def plain_python_patch(**replaced_functions: Any) -> Patch:
    """Patch that runs the wheelset's equations as plain Python, contact by contact, with some functions replaced."""

    def prepare() -> Context:
        @contextmanager
        def context() -> Iterator[None]:
            faulty_patches = with_globals(wf.fill_forces_patch_by_patch.py_func, **replaced_functions)
            faulty = with_globals(wf.fill_wheel_forces.py_func, LINEAR=None, fill_forces_patch_by_patch=faulty_patches)
            plain = {
                name: getattr(eq, name).py_func
                for name in ("fill_rates", "fill_rates_with_workspace", "workspace_for", "rails_from_tuples")
            }
            with mock.patch.multiple(eq, fill_wheel_forces=faulty, **plain):
                yield

        return context

    return prepare


def after_rates_patch(change_rates: Callable[..., None]) -> Patch:
    """Patch that changes the state's time derivatives by change_rates(state, body, rates) after their computation."""

    def with_change(original_function: Any) -> Any:
        def rates(wheelset_state: Any, speed: Any, body_parameters: Any, *further_arguments: Any) -> None:
            original_function(wheelset_state, speed, body_parameters, *further_arguments)
            change_rates(wheelset_state, eq.WheelsetBody(*body_parameters), further_arguments[-2])

        return rates

    return attribute_patch("models.rail.equations:fill_rates", with_change)


def creep_law_patch(change_inputs: Callable[[Any, Any], None], speed_factor: float = 1.0) -> Patch:
    """Patch of the creep law: its inputs are changed by change_inputs(contacts, slip), and its rolling speed is
    multiplied by the factor ``speed_factor``."""

    def creep(wheel_contacts: Any, slips: Any, rolling_speed: float, *further_arguments: Any) -> None:
        wheel_contacts, slips = wheel_contacts.copy(), slips.copy()
        change_inputs(wheel_contacts, slips)
        wf.fill_creep_forces(wheel_contacts, slips, speed_factor * rolling_speed, *further_arguments)

    return plain_python_patch(fill_creep_forces=creep)


def contact_point_patch(change_points: Callable[[Any], None]) -> Patch:
    """Patch that changes the wheels' contact points by change_points(touches) after their computation."""

    def contact_points(wheelset_pose: Any, rails: Any, contact_points: Any) -> None:
        wf.contact_points(wheelset_pose, rails, contact_points)
        change_points(contact_points)

    return plain_python_patch(contact_points=contact_points)


def multiplied_field(field_name: str, field_factor: float, argument_index: int = 0) -> Callable[..., None]:
    """Returns a function that multiplies a field of its argument number ``argument_index``, an array of records, by a
    factor."""

    def change(*record_arrays: Any) -> None:
        record_arrays[argument_index][field_name] *= field_factor

    return change


spin_reversed = multiplied_field("turn", -1.0, argument_index=1)


def _mean_load_on_both_wheels(wheel_contacts: Any, slips: Any) -> None:
    wheel_contacts["load"] = wheel_contacts["load"].mean()


def _opposite_spin_moment(wheel_contacts: Any, slips: Any, *further_arguments: Any) -> None:
    """Fault: the creep law gives the spin moment the opposite sign."""
    wf.fill_creep_forces(wheel_contacts, slips, *further_arguments)
    further_arguments[-1].forces["mz"] *= -1.0


def _swap_contacts(contact_points: Any) -> None:
    """Fault: each wheel has the contact of the other wheel."""
    sides = {name: contact_points[name].copy() for name in ("y", "n_y")}
    contact_points[:] = contact_points[::-1].copy()
    for name, values in sides.items():
        contact_points[name] = values


def _no_gyroscope(wheelset_state: Any, body_parameters: Any, state_rates: Any) -> None:
    whirl, cosine = (
        body_parameters.spin_inertia * wheelset_state[eq.SPIN] / body_parameters.yaw_inertia,
        np.cos(wheelset_state[eq.ROLL]),
    )
    state_rates[eq.ROLL_RATE] -= whirl * wheelset_state[eq.YAW_RATE] * cosine
    state_rates[eq.YAW_RATE] += whirl * wheelset_state[eq.ROLL_RATE] / cosine


def _one_gyroscope(wheelset_state: Any, body_parameters: Any, state_rates: Any) -> None:
    state_rates[eq.ROLL_RATE] -= (
        body_parameters.spin_inertia
        * wheelset_state[eq.SPIN]
        / body_parameters.yaw_inertia
        * wheelset_state[eq.YAW_RATE]
    )


def _doubled_damping(original_function: Any) -> Any:
    def rates(wheelset_state: Any, speed: Any, body_parameters: Any, *further_arguments: Any) -> None:
        body_record = eq.WheelsetBody(*body_parameters)
        x, y, z = body_record.damping
        original_function(
            wheelset_state, speed, tuple(body_record._replace(damping=(2.0 * x, 2.0 * y, 2.0 * z))), *further_arguments
        )

    return rates


FAULTS = (
    CampaignFault("sign of the spin creepage", "creep law", creep_law_patch(spin_reversed)),
    CampaignFault("sign of the spin moment", "creep law", plain_python_patch(fill_creep_forces=_opposite_spin_moment)),
    CampaignFault("creepage by a speed 2 % off", "creep law", creep_law_patch(lambda contacts, slip: None, 1.02)),
    CampaignFault(
        "load not distributed: both wheels have the mean", "creep law", creep_law_patch(_mean_load_on_both_wheels)
    ),
    CampaignFault("friction 1 % off", "creep law", creep_law_patch(multiplied_field("mu", 1.01))),
    CampaignFault(
        "depth, place and radius of left and right contact swapped", "contact", contact_point_patch(_swap_contacts)
    ),
    CampaignFault("normal leans the other way", "contact", contact_point_patch(multiplied_field("n_y", -1.0))),
    CampaignFault("arm of the contact forces 1 % off", "contact", contact_point_patch(multiplied_field("z", 1.01))),
    CampaignFault("no gyroscopic moments", "body", after_rates_patch(_no_gyroscope)),
    CampaignFault("one gyroscopic moment missing", "body", after_rates_patch(_one_gyroscope)),
    CampaignFault(
        "dampers twice as strong", "suspension", attribute_patch("models.rail.equations:fill_rates", _doubled_damping)
    ),
)

CAMPAIGN = Campaign("planted.wheelset", "a wheelset", "rolling-vehicle", CHECKS, FAULTS)
