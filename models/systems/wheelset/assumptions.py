"""Assumptions of the equations of a wheelset on straight track."""

from collections.abc import Callable

import numpy as np

from models.contact.inputs import Array
from models.contact.limits import FAST_SLIP, LARGEST_AXIS_SHARE, LINEAR_FORCE_SHARE, YIELD_PRESSURE, yield_is_known
from models.core.assumptions import Assumption, Watched
from models.core.result import Result
from models.rail import wheel_forces as wf
from models.rail.equations import ROLL, YAW, WheelsetEquations, WheelsetPath, Y
from models.rail.flange_climbing import nadal_limit, shares_of_bounds
from models.rail.wheelset import Wheelset

LEAST_LOAD = 0.05
"""Least wheel load divided by the load at rest: below, the wheel is about to leave its rail."""
LARGEST_FLANGE_DEFLECTION = 5e-3
"""Largest deflection (m) of a rail under a flange, beyond the clearance. The flange of a cone is modelled by a spring
without end.
"""
LARGEST_TRAVEL = 0.02
"""Largest travel (m) of the axle's ends in their linear suspension: guides and stops allow no more."""
LARGEST_YAW = 0.05
"""Largest yaw (rad) at which a contact's curvatures may be taken as without yaw."""
CLIMBING_DISTANCE = 2e-3
"""Distance (m) of a contact from the flange's tip at which a wheel has climbed, as in the table of contacts."""
LEAST_FRICTION = 0.02
"""Coefficient of friction below which wheels slide instead of creep, so that eigenvalues mean nothing."""


def assumptions(equations: WheelsetEquations) -> list[Assumption]:
    """Assumptions of the equations of a wheelset at a speed. They are checked on the path, the detail of a result."""
    wheelset = equations.wheelset
    listed = [
        _wheel_load_assumption(wheelset),
        _small_yaw_assumption(),
        _rolling_assumption(equations),
        _half_space_assumption(),
        _slow_slip_assumption(equations),
    ]
    listed += [_elastic_assumption()] if yield_is_known(wheelset.material) else []
    listed += [_no_slip_assumption(wheelset)] if equations.law == "linear" else []
    listed += [_travel_assumption(wheelset)] if equations.body.has_suspension else []
    if wheelset.profiles is not None:
        return [*listed, _profile_bounds_assumption(wheelset)]
    return [*listed, _climbing_assumption(wheelset), _flange_deflection_assumption(wheelset)]


def linear_motion_assumptions(wheelset: Wheelset) -> list[Assumption]:
    """Assumption of the eigenvalues that there is friction, so that creep forces act on small motions."""
    return [
        Assumption(
            "friction",
            "creep forces of small motions find friction",
            "raise wheelset.override.friction",
            lambda run: {"rails": np.array([wheelset.friction])},
            "",
            lower_limit=LEAST_FRICTION,
        )
    ]


def branch_assumptions(wheelset: Wheelset) -> list[Assumption]:
    """Assumption of a branch of limit cycles that amplitudes stay small enough for the flange spring of a cone; none
    for profiles.
    """
    return (
        [] if wheelset.profiles else [_flange_deflection_assumption(wheelset, lambda run: {"cycle": run["amplitude"]})]
    )


def sums_by_wheel(contact_records: Array, patch_values: Array) -> dict[str, Array]:
    """Sums a quantity of contact patches, shape (n, patches), over the patches of each wheel; (n,) by wheel."""
    patches_per_wheel = contact_records.shape[1] // 2
    return {
        "right wheel": patch_values[:, :patches_per_wheel].sum(axis=1),
        "left wheel": patch_values[:, patches_per_wheel:].sum(axis=1),
    }


def _values_of_path_function(values_of_path: Callable[[WheelsetPath], Watched]) -> Callable[[Result], Watched]:
    """Returns a function of a result that applies ``values_of_path`` to its path; the result's detail is a path or a
    limit cycle.
    """

    def of_result(run_result: Result) -> Watched:
        return values_of_path(
            run_result.detail if isinstance(run_result.detail, WheelsetPath) else run_result.detail.path()
        )

    return of_result


def _values_of_contacts_function(values_of_contacts: Callable[[Array], Array]) -> Callable[[Result], Watched]:
    """Returns a function of a result that gives, for each wheel and time, the largest magnitude of
    ``values_of_contacts`` among its loaded patches, 0 where no patch is loaded.
    """

    def of_path(wheelset_path: WheelsetPath) -> Watched:
        patches_per_wheel, load = wheelset_path.contacts.shape[1] // 2, wheelset_path.contacts["load"]
        values = np.where(load > 0.0, np.abs(values_of_contacts(wheelset_path.contacts)), 0.0)
        return {
            "right wheel": values[:, :patches_per_wheel].max(axis=1),
            "left wheel": values[:, patches_per_wheel:].max(axis=1),
        }

    return _values_of_path_function(of_path)


def _wheel_load_assumption(wheelset: Wheelset) -> Assumption:
    return Assumption(
        "wheels press",
        "both wheels stay on their rails",
        "start with a smaller displacement, or travel below the critical speed",
        _values_of_path_function(
            lambda path: sums_by_wheel(path.contacts, path.contacts["load"] * np.cos(path.contacts["angle"]))
        ),
        "N",
        lower_limit=LEAST_LOAD * wheelset.load / 2.0,
    )


def _small_yaw_assumption() -> Assumption:
    return Assumption(
        "small yaw",
        "the yaw is so small that a contact's curvatures are those without it",
        "start with a smaller displacement or yaw, or stiffen stiffness_x",
        _values_of_path_function(lambda path: {"axle": path.states[:, YAW]}),
        "rad",
        -LARGEST_YAW,
        LARGEST_YAW,
    )


def _rolling_assumption(equations: WheelsetEquations) -> Assumption:
    return Assumption(
        "speed",
        "the wheelset rolls so fast that creepage is by its speed",
        f"travel at {wf.REGULARISED_SPEED:g} m/s or more",
        lambda run: {"wheelset": np.array([abs(equations.speed)])},
        "m/s",
        lower_limit=wf.REGULARISED_SPEED,
    )


def _half_space_assumption() -> Assumption:
    """Assumption that contacts are small beside the bodies' radii (half-spaces). In a Hertzian contact the ratio of
    penetration to the shorter semi-axis is about the ratio of that semi-axis to its radius.
    """

    def watched(contact_records: Array) -> Array:
        short = np.minimum(contact_records["a"], contact_records["b"])
        return contact_records["depth"] / np.where(short > 0.0, short, np.inf)

    return Assumption(
        "half-space",
        "contacts are small beside the radii of wheel and rail",
        "lower the load, or use profiles whose radii are larger",
        _values_of_contacts_function(watched),
        "of the radius",
        upper_limit=LARGEST_AXIS_SHARE,
    )


def _elastic_assumption() -> Assumption:
    def watched(contact_records: Array) -> Array:
        area = np.pi * contact_records["a"] * contact_records["b"]
        return 1.5e-6 * contact_records["load"] / np.where(area > 0.0, area, np.inf)

    return Assumption(
        "elastic",
        "the steel does not flow",
        "lower the load or the displacement: real contacts would be larger, and their pressure lower",
        _values_of_contacts_function(watched),
        "MPa",
        upper_limit=1e-6 * YIELD_PRESSURE,
    )


def _slow_slip_assumption(equations: WheelsetEquations) -> Assumption:
    speed = max(abs(equations.speed), wf.REGULARISED_SPEED)
    return Assumption(
        "constant friction",
        "friction is the same however fast the wheels slip",
        "give wheelset.override.friction as it is for such slip, or travel slower",
        _values_of_contacts_function(lambda contacts: speed * np.hypot(contacts["xi_x"], contacts["xi_y"])),
        "m/s",
        upper_limit=FAST_SLIP,
    )


def _no_slip_assumption(wheelset: Wheelset) -> Assumption:
    def watched(wheelset_path: WheelsetPath) -> Watched:
        contacts = wheelset_path.contacts
        creep, limit = np.hypot(contacts["fx"], contacts["fy"]), contacts["load"]
        used = shares_of_bounds(creep, wheelset.friction * limit)
        return {"patches": used.max(axis=1)}

    return Assumption(
        "no slip",
        "the creep forces of the linear law are far below mu N",
        'name the effect fastsim: contact.law = "fastsim"',
        _values_of_path_function(watched),
        "mu N",
        upper_limit=LINEAR_FORCE_SHARE,
    )


def _travel_assumption(wheelset: Wheelset) -> Assumption:
    def watched(wheelset_path: WheelsetPath) -> Watched:
        travel_along, travel_up = (1e3 * wheelset.half_spacing * wheelset_path.states[:, k] for k in (YAW, ROLL))
        return {
            "along": np.abs(travel_along),
            "across": 1e3 * np.abs(wheelset_path.states[:, Y]),
            "vertical": np.abs(travel_up),
        }

    return Assumption(
        "suspension",
        "springs and dampers of the suspension are lines",
        "stiffen the suspension: real guides have stops",
        _values_of_path_function(watched),
        "mm",
        upper_limit=1e3 * LARGEST_TRAVEL,
    )


def _climbing_assumption(wheelset: Wheelset) -> Assumption:
    def watched(wheelset_path: WheelsetPath) -> Watched:
        flange_share = shares_of_bounds(wheelset_path.contacts["flange_force"], wheelset_path.contacts["load"])
        return {"right wheel": flange_share[:, 0], "left wheel": flange_share[:, 1]}

    return Assumption(
        "no flange climbs",
        "no flange is pushed so hard that it climbs (Nadal, 70 degrees)",
        "name the effect profiles, which show it",
        _values_of_path_function(watched),
        "of the wheel's load",
        upper_limit=max(0.0, nadal_limit(wheelset.friction)),
    )


def _flange_deflection_assumption(
    wheelset: Wheelset, values_of_result: Callable[[Result], Watched] | None = None
) -> Assumption:
    return Assumption(
        "on the tread",
        "the wheels roll on their cones, and a flange's rail gives way by a few mm at most",
        "name the effect profiles, which have flanges of their own",
        values_of_result or _values_of_path_function(lambda path: {"wheelset": np.abs(path.states[:, Y])}),
        "m",
        upper_limit=wheelset.flange_clearance + LARGEST_FLANGE_DEFLECTION,
    )


def _profile_bounds_assumption(wheelset: Wheelset) -> Assumption:
    """Assumption that contacts lie within the profiles: their distances (mm) from the flange's tip, the wheel's face
    and the ends of the rail's profile are above 0.
    """
    assert wheelset.profiles is not None
    side = wheelset.profiles.wheel_on_rail(wheelset.radius)
    tip, outer = float(side.wheel.y[np.argmax(side.wheel.z)]), float(side.wheel.y[-1])

    def watched(wheelset_path: WheelsetPath) -> Watched:
        contacts = wheelset_path.contacts
        load, half = contacts["load"], contacts["b"]
        wheel, rail = np.abs(_along_axle(wheelset_path)) - side.wheelset.arm, np.abs(_across_track(wheelset_path))
        ends = {
            "flange's tip": wheel - tip - CLIMBING_DISTANCE,
            "wheel's face": outer - wheel - half,
            "rail's ends": np.minimum(rail - side.rail.y[0], side.rail.y[-1] - rail) - half,
        }
        return {wheel_name: 1e3 * np.where(load > 0.0, free, np.inf).min(axis=1) for wheel_name, free in ends.items()}

    return Assumption(
        "within the profiles",
        "contacts lie within the profiles, below the flange's tip",
        "start with a smaller displacement, or use longer profiles",
        _values_of_path_function(watched),
        "mm",
        lower_limit=0.0,
    )


def _along_axle(wheelset_path: WheelsetPath) -> Array:
    """Positions (n, patches) of the contacts along the axle, from its middle, in m."""
    roll, yaw, contacts = (
        wheelset_path.states[:, ROLL, None],
        wheelset_path.states[:, YAW, None],
        wheelset_path.contacts,
    )
    x, y, z = (contacts[name] for name in "xyz")
    return np.asarray(np.cos(roll) * (np.cos(yaw) * y - np.sin(yaw) * x) + np.sin(roll) * z)


def _across_track(wheelset_path: WheelsetPath) -> Array:
    """Lateral positions (n, patches) of the contacts, from the middle of the track, in m, positive to the right."""
    return np.asarray(wheelset_path.states[:, Y, None] + wheelset_path.contacts["y"])
