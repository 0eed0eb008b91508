"""A wheelset on straight track: geometry, linear theory, equations of motion, limit cycle, contact table."""

import math
from functools import partial

import numpy as np
import pytest
from scipy.optimize import minimize

from models.core.errors import InputError, RunFailed
from models.rail import equations as eq
from models.rail.contact_point import LEFT, RIGHT, ConicalWheel, cone_on_rail
from models.rail.contact_table import rolling_radius_difference
from models.rail.eigenvalues import largest_growth_rate as of_all
from models.rail.equations import WheelsetEquations
from models.rail.equivalent_conicity import harmonic_linearised_conicity
from models.rail.limit_cycle import attained_limit_cycle, refined_orbit
from models.rail.linear import (
    critical_speed,
    gravity_stiffness,
    kinematic_wavelength,
    klingel_wavelength,
    largest_growth_rate,
    linear_matrices,
)
from models.rail.profile_contact import WheelPose
from models.rail.wheel_forces import REPORT_RECORD
from models.rail.wheelset import CHOSEN_WHEELSET
from validation.contact.manchester_references import PUBLISHED_CONTACT, contact_of, placement_at, wheel_sums

SPRINGS = {f"{kind}_{axis}": 0.0 for kind in ("stiffness", "damping") for axis in "xyz"}
FREE = CHOSEN_WHEELSET.changed(**SPRINGS)
CONE = ConicalWheel(
    CHOSEN_WHEELSET.radius, CHOSEN_WHEELSET.half_gauge, CHOSEN_WHEELSET.conicity, CHOSEN_WHEELSET.head_radius
)
POSE = WheelPose(0.006, 1e-4, -0.004, 0.03)


def turn(roll, yaw):
    """From the axle to the track."""
    cr, sr, cy, sy = math.cos(roll), math.sin(roll), math.cos(yaw), math.sin(yaw)
    return np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1.0]]) @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])


@pytest.mark.parametrize("side", [RIGHT, LEFT])
@pytest.mark.grounds("closed form")
def test_cone_touches_where_its_surface_is_nearest_to_the_axis_of_the_head(side):
    y, z, roll, yaw = POSE
    radius, half_gauge, conicity, head = CONE
    sine = math.sin(math.atan(conicity))
    axis = np.array([side * (half_gauge + head * sine), radius + head * math.cos(math.atan(conicity))])

    def surface(u):
        along, round_about = u
        rolling = radius - conicity * (along - half_gauge)
        own = np.array([rolling * math.sin(round_about), side * along, rolling * math.cos(round_about)])
        return np.array([0.0, y, z]) + turn(roll, yaw) @ own

    found = minimize(
        lambda u: np.hypot(*(surface(u)[1:] - axis)),
        [half_gauge, 0.0],
        method="Nelder-Mead",
        options={"xatol": 1e-12, "fatol": 1e-16, "maxiter": 2000},
    )
    depth, rolling, n_y, n_z, *place = cone_on_rail(side, POSE, CONE)
    assert depth == pytest.approx(head - found.fun, abs=1e-14)
    # The place is found to the root of the distance's rounding, 1e-8 and more along the axle.
    assert np.add(place, [0.0, y, z]) == pytest.approx(surface(found.x), abs=3e-7)
    assert rolling == pytest.approx(radius - conicity * (found.x[0] - half_gauge), abs=3e-8)
    toward = (axis - surface(found.x)[1:]) / found.fun
    assert (n_y, n_z) == pytest.approx(tuple(toward), abs=3e-7)


@pytest.mark.grounds("closed form")
def test_roll_and_equivalent_conicity_are_those_of_the_geometry():
    y = 1e-5
    pose = (y, 0.0, -CHOSEN_WHEELSET.roll_per_displacement * y, 0.0)
    right, left = (cone_on_rail(side, WheelPose(*pose), CONE) for side in (RIGHT, LEFT))
    assert (right[0], left[0]) == pytest.approx((0.0, 0.0), abs=3e-11)  # second order: tilt y^2 = 7e-12
    assert (right[1] - left[1]) / (2 * y) == pytest.approx(CHOSEN_WHEELSET.equivalent_conicity, rel=1e-6)
    assert CHOSEN_WHEELSET.coned(0.2).equivalent_conicity == pytest.approx(0.2, rel=1e-9)


@pytest.mark.grounds("closed form")
def test_klingels_wave():
    # Spin creepage and its lateral force leave 1e-5 of it.
    assert kinematic_wavelength(CHOSEN_WHEELSET) == pytest.approx(klingel_wavelength(CHOSEN_WHEELSET), rel=3e-5)
    edges = CHOSEN_WHEELSET.changed(head_radius=0.01)
    klingels = 2 * math.pi * math.sqrt(CHOSEN_WHEELSET.radius * CHOSEN_WHEELSET.half_gauge / CHOSEN_WHEELSET.conicity)
    assert klingel_wavelength(edges) == pytest.approx(klingels, rel=1e-3)
    # All five motions, slow and free: the closed form within the 1e-3 asked for; 2.5e-5 seen.
    values = np.linalg.eigvals(WheelsetEquations(FREE, 0.2, "linear").state_matrix)
    slow = min(values[values.imag > 0], key=abs)
    assert 2 * math.pi * 0.2 / slow.imag == pytest.approx(klingel_wavelength(FREE), rel=1e-4)


@pytest.mark.grounds("plain counterpart")
def test_critical_speed():
    speed = critical_speed(CHOSEN_WHEELSET)
    assert abs(largest_growth_rate(CHOSEN_WHEELSET, speed)) < 1e-9
    assert (
        largest_growth_rate(CHOSEN_WHEELSET, speed * 1.001) > 0.0 > largest_growth_rate(CHOSEN_WHEELSET, speed * 0.999)
    )
    # The equations with linear creep have what the two motions leave out: 0.4 % less.
    assert critical_speed(CHOSEN_WHEELSET, partial(of_all, WheelsetEquations)) == pytest.approx(speed, rel=6e-3)
    assert critical_speed(CHOSEN_WHEELSET.changed(stiffness_x=8e5)) > speed
    with pytest.raises(InputError, match="stable up to"):
        critical_speed(CHOSEN_WHEELSET.changed(stiffness_x=1e9, stiffness_y=1e9))


@pytest.mark.grounds("closed form")
def test_load_is_a_spring_across_and_a_negative_one_in_yaw():
    """Potential energy of the load, by the height at which both cones touch: independent of the written matrices."""

    def fall(y, yaw):
        z = roll = 0.0
        for _ in range(20):
            right, left = (cone_on_rail(side, WheelPose(y, z, roll, yaw), CONE)[0] for side in (RIGHT, LEFT))
            z, roll = z - (right + left) / 2, roll - (right - left) / (2 * CHOSEN_WHEELSET.half_gauge)
        return z

    h = 2e-3
    measured = [-CHOSEN_WHEELSET.load * (fall(h * (k == 0), h * (k == 1)) * 2 - 2 * fall(0, 0)) / h**2 for k in (0, 1)]
    heavier = linear_matrices(FREE.changed(load=2 * FREE.load), 10.0).stiffness
    assert np.diag(gravity_stiffness(CHOSEN_WHEELSET)) == pytest.approx(
        measured, rel=1e-4
    )  # the fourth order in h is 1e-5
    assert heavier[0, 0] == pytest.approx(2 * measured[0], rel=1e-4)  # creep forces do not follow y in the first row


@pytest.mark.grounds("closed form")
def test_nothing_accelerates_at_rest_and_the_rails_carry_the_load():
    equations = WheelsetEquations(CHOSEN_WHEELSET, 50.0)
    path = equations.run(equations.rest, 0.01, 5e-4)
    assert np.abs(equations.rates(equations.rest)[[eq.Y_RATE, eq.Z_RATE, eq.ROLL_RATE, eq.YAW_RATE]]).max() < 1e-9
    contact = path.contacts[0]
    upward = contact["load"] * np.cos(contact["angle"]) - contact["fy"] * np.sin(contact["angle"])
    assert upward.sum() == pytest.approx(CHOSEN_WHEELSET.load, rel=1e-5)  # the springs bear what the spin's forces lift
    assert contact["a"][0] == pytest.approx(
        float(CHOSEN_WHEELSET.ellipse.a), rel=1e-3
    )  # 0.2 % of the load is that of spin


@pytest.mark.parametrize("law", ["linear", "fastsim"])
@pytest.mark.grounds("closed form")
def test_energy_is_what_the_forces_do(law):
    """d(T + U)/dt by the energies' own expressions against the power of the contacts, at a lively state."""
    w = CHOSEN_WHEELSET.changed(damping_x=0.0, damping_y=0.0, damping_z=0.0, flange_clearance=0.02)
    equations = WheelsetEquations(w, 40.0, law)
    body = equations.body
    state = np.array([0.006, 9e-5, -0.0004, 0.02, 0.0, 0.3, 0.02, 1.0, -20.0, -90.0])

    def energy(s):
        y, z, roll, yaw, _, vy, vz, roll_rate, yaw_rate, spin = s
        kinetic = w.mass * (vy**2 + vz**2) + w.yaw_inertia * (roll_rate**2 + (yaw_rate * math.cos(roll)) ** 2)
        kinetic = 0.5 * (kinetic + w.spin_inertia * spin**2)
        held = 0.0
        for side in (1, -1):
            out = turn(roll, yaw) @ [0.0, side * w.half_spacing, 0.0]
            u = np.array([0.0, y, z]) + out - [0.0, side * w.half_spacing, body.rest_height]
            held += 0.5 * (w.stiffness_x * u[0] ** 2 + w.stiffness_y * u[1] ** 2 + w.stiffness_z * u[2] ** 2)
        return kinetic + held - (w.mass * 9.81 + 2 * body.carried_weight) * z

    def depths(s):
        return np.array([cone_on_rail(side, WheelPose(*s[:4].tolist()), CONE)[0] for side in (RIGHT, LEFT)])

    rates, h = equations.rates(state), 1e-8
    gained = (energy(state + h * rates) - energy(state - h * rates)) / (2 * h)
    deeper = (depths(state + h * rates) - depths(state - h * rates)) / (2 * h)
    contact = equations.run(state, 1e-6, 1e-6).contacts[0]
    assert (contact["load"] > 1e3).all()
    assert (contact["power"] < 0.0).all()
    done = (contact["power"] - contact["load"] * deeper - contact["fx"] * 40.0).sum()
    assert gained == pytest.approx(done, abs=0.1)  # W; the energy of 4e5 J leaves 0.01 W, the least of faults 100 W


@pytest.mark.parametrize("shape", [(), (3,), (2, 3)])
def test_contacts_that_are_not_known_yet_are_no_numbers(shape):
    contacts = WheelsetEquations(CHOSEN_WHEELSET, 50.0).empty_contacts(*shape)
    assert contacts.dtype == REPORT_RECORD and contacts.shape == (*shape, 2)
    assert all(np.isnan(contacts[name]).all() for name in REPORT_RECORD.names)


@pytest.mark.parametrize("law", ["linear", "fastsim"])
def test_backwards_is_the_mirror_image(law):
    forwards, backwards = (
        WheelsetEquations(CHOSEN_WHEELSET, 60.0, law, 11),
        WheelsetEquations(CHOSEN_WHEELSET, -60.0, law, 11),
    )
    start, mirrored = forwards.displaced_state(5e-3), backwards.displaced_state(5e-3)
    one, two = forwards.run(start, 0.1, 5e-4).states, backwards.run(mirrored, 0.1, 5e-4).states
    assert one[:, eq.Y] == pytest.approx(two[:, eq.Y], abs=1e-14)
    assert one[:, eq.YAW] == pytest.approx(-two[:, eq.YAW], abs=1e-14)
    assert np.abs(one[-1, eq.YAW]) > 1e-5


def test_order_of_the_march():
    equations = WheelsetEquations(CHOSEN_WHEELSET, 60.0, "linear")
    start = equations.displaced_state(5e-3)
    ends = [equations.run(start, 0.1, h).states[-1] for h in (5e-4, 2.5e-4, 1.25e-4)]
    first, second = np.abs(ends[0] - ends[1])[eq.YAW], np.abs(ends[1] - ends[2])[eq.YAW]
    assert math.log2(first / second) > 3.8


def test_wheel_that_lifts_off_has_no_forces_and_comes_back():
    equations = WheelsetEquations(CHOSEN_WHEELSET, 40.0, cells=11)
    start = equations.rest.copy()
    start[eq.Z] -= 2e-4
    path = equations.run(start, 0.3, 2e-4)
    assert (path.contacts["load"][0] == 0.0).all()
    assert not any(path.contacts[name][0].any() for name in ("fx", "fy", "mz"))
    assert np.isfinite(path.states).all()
    assert (path.contacts["power"] <= 0.0).all()
    assert path.states[-1, eq.Z] == pytest.approx(equations.rest[eq.Z], abs=2e-6)


def test_limit_cycle_above_the_critical_speed():
    above = refined_orbit(attained_limit_cycle(WheelsetEquations(CHOSEN_WHEELSET, 75.0, cells=11)), "amplitude")
    assert above.stable and above.multiplier < 0.1
    assert CHOSEN_WHEELSET.flange_clearance < above.amplitude < CHOSEN_WHEELSET.flange_clearance + 1.5e-3
    # Creep forces that saturate and a flange make the wave a little shorter or longer than Klingel's: 3 % here.
    assert above.frequency == pytest.approx(75.0 / klingel_wavelength(CHOSEN_WHEELSET), rel=0.05)
    assert above.error < 1e-5 * above.amplitude  # 1e-6 seen; asked for 1e-2
    assert above.frequency_error < 1e-5 * above.frequency
    # The motion itself, marched in other steps, comes back to the orbit.
    tops = above.equations.run(above.equations.displaced_state(6e-3), 6.0, 4e-4).states[:, eq.Y]
    assert tops[-1000:].max() == pytest.approx(above.amplitude, rel=1e-4)  # of maxima that fall between two steps
    assert attained_limit_cycle(WheelsetEquations(CHOSEN_WHEELSET, 45.0, cells=11)) is None


def test_what_cannot_be_is_refused():
    equations = WheelsetEquations(CHOSEN_WHEELSET, 50.0, cells=11)
    with pytest.raises(InputError, match="at most"):
        equations.run(equations.rest, 1.0, 5e-3)
    with pytest.raises(InputError, match="did you mean"):
        WheelsetEquations(CHOSEN_WHEELSET, 50.0, "fastsimm")
    with pytest.raises(InputError, match="speed"):
        WheelsetEquations(CHOSEN_WHEELSET, 200.1)
    with pytest.raises(InputError, match="own weight"):
        CHOSEN_WHEELSET.changed(load=1000.0)
    with pytest.raises(InputError, match="conicity"):
        CHOSEN_WHEELSET.changed(conicity=0.0)
    start = equations.rest.copy()
    start[eq.YAW_RATE] = 50.0
    with pytest.raises(RunFailed, match="leaves the track"):
        equations.run(start, 1.0, 5e-4)
    with pytest.raises(RunFailed, match="mass = 1e-06 kg"):
        _ = WheelsetEquations(CHOSEN_WHEELSET.changed(mass=1e-6), 50.0).rest


def test_first_harmonic_of_a_table():
    shifts = np.linspace(0.0, 0.01, 21)
    assert harmonic_linearised_conicity(shifts, 2 * 0.05 * shifts, 0.004) == pytest.approx(0.05, rel=1e-12)
    # Of a difference c y^3 the first harmonic is 3/4 of that at the amplitude.
    shifts = np.linspace(0.0, 0.01, 2001)
    assert harmonic_linearised_conicity(shifts, 2e3 * shifts**3, 0.004) == pytest.approx(
        0.75 * 1e3 * 0.004**2, rel=1e-4
    )


def against_contact(rows):
    """Mean places, forces and peaks of both wheels against CONTACT's, with yaw and rolling."""
    found = [placement_at("A-2", float(shift)) for shift in rows[:, 0] * 1e-3]
    for (_, _, *right_left), one in zip(rows, found, strict=True):
        for wheel, (y, normal, peak) in (("right", right_left[:3]), ("left", right_left[3:])):
            own = wheel_sums(one, wheel)
            assert own[0] == pytest.approx(y, abs=0.3)
            assert own[1] == pytest.approx(normal, rel=0.02)  # 0.5 % seen
            assert own[2] == pytest.approx(peak, rel=0.04)  # cells of 0.2 mm there


def test_manchester_at_the_flange():
    against_contact(PUBLISHED_CONTACT[[13]])


@pytest.mark.full
def test_manchester():
    against_contact(PUBLISHED_CONTACT)


def test_two_patches_at_five_millimetres():
    one = placement_at("A-1", 5e-3)
    assert [round(1e3 * place.touch_y) for place in one.right] == [727, 737]
    assert len(one.left) == 1
    assert rolling_radius_difference(one) > 2e-3
    for wheel in (one.right, one.left):
        # Without friction the vertical parts of the normal forces are the load, to the precision of the shares.
        assert sum(p.vertical for p in wheel) == pytest.approx(1e4, rel=1e-5)


def test_table_mirrors():
    contact = contact_of("A-1")
    one, two = contact.at(2e-3, 0.004), contact.at(-2e-3, -0.004)
    assert one.roll == pytest.approx(-two.roll, abs=1e-12)
    assert one.right[0].normal == pytest.approx(two.left[0].normal, rel=1e-9)
