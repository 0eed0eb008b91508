"""M, D, K and outputs of a vehicle in space against differences of its energies, computed in another way."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from models.core.errors import InputError
from models.vehicles.spatial import (
    FREEDOMS,
    AntiRollBar,
    Body,
    Curve,
    Drag,
    PartOutput,
    PointOutput,
    SideForce,
    SpatialVehicle,
    SpringDamper,
    TurnOutput,
    Tyre,
    TyreOutput,
)
from models.vehicles.spatial_linear import linearise, static_preloads
from models.vehicles.vehicle_file import load_vehicle

STEP = 1e-3
"""Step of the fourth-order differences (m, rad): truncation as its fourth power, rounding as its inverse square."""


def twin():
    """Nothing symmetric: a tree three deep, tilted springs with ends apart, tyres off the centres, full tensors."""
    full = ((40.0, -3.0, 5.0), (-3.0, 90.0, 2.0), (5.0, 2.0, 110.0))
    small = ((3.0, 0.2, -0.1), (0.2, 4.0, 0.3), (-0.1, 0.3, 5.0))
    tilted = np.array([0.3, -0.2, 0.9]) / np.linalg.norm([0.3, -0.2, 0.9])
    low = np.array([1.1, 0.7, 0.4])
    apart = ((*(low + 0.35 * tilted),), (*low,))
    bodies = (
        Body("body", 500.0, (0.1, -0.05, 0.7), FREEDOMS, full),
        Body("engine", 90.0, (0.9, 0.12, 0.6), ("y", "z", "rx", "ry", "rz"), small, "body"),
        Body("alternator", 7.0, (1.1, 0.3, 0.8), ("x", "ry"), small, "engine"),
        Body("axle", 60.0, (1.2, 0.02, 0.35), ("z", "rx", "ry"), small),
        Body("arm", 25.0, (-1.3, 0.6, 0.3), ("x", "z", "rx"), small, "body"),
    )
    springs = (
        SpringDamper("tilted", "body", "axle", *apart, tuple(tilted), 2e4, 900.0),
        SpringDamper("right", "body", "axle", (1.1, -0.6, 0.5), (1.1, -0.6, 0.5), (0.0, 0.0, 1.0), 3e4, 700.0),
        SpringDamper("rear", "body", "arm", (-1.3, 0.5, 0.4), (-1.3, 0.5, 0.4), (0.6, 0.0, 0.8), 4e4, 800.0),
        SpringDamper("bush", "body", "arm", (-1.2, 0.4, 0.2), (-1.2, 0.4, 0.2), (0.8, 0.0, -0.6), 9e4, 300.0),
        SpringDamper("belt", "alternator", None, (1.2, 0.3, 0.9), (1.3, 0.1, 0.1), (0.0, 0.0, 1.0), 5e3, 20.0),
    )
    for name, (one, two), at in (
        ("mount", ("engine", "body"), (0.7, 0.3, 0.5)),
        ("stay", ("engine", "body"), (1.2, -0.2, 0.4)),
        ("bracket", ("alternator", "engine"), (1.0, 0.2, 0.7)),
        ("foot", ("body", None), (-0.4, -0.3, 0.2)),
        ("joint", ("arm", "body"), (-0.9, 0.7, 0.35)),
        ("knee", ("axle", "body"), (0.8, 0.1, 0.5)),
    ):
        for i, axis in enumerate(np.eye(3)):
            at_axis = SpringDamper(f"{name}.{i}", one, two, at, at, tuple(axis), 3e4 + 7e3 * i, 100.0 + 30 * i)
            springs += (at_axis,)
    tyres = (
        Tyre("left", "axle", (1.2, 0.8, 0.35), 0, 1.5e5, 50.0),
        Tyre("right", "axle", (1.2, -0.7, 0.35), 0, 1.6e5, 60.0),
        Tyre("rear", "arm", (-1.4, 0.75, 0.28), 1, 1.4e5, 70.0),
    )
    bars = (AntiRollBar("bar", "body", "axle", "arm", (1.2, 0.8, 0.35), (-1.4, 0.75, 0.28), 800.0, 15.0),)
    outputs = (
        PointOutput("a", "acceleration", "alternator", (1.3, 0.1, 1.0), (0.6, 0.0, 0.8)),
        PointOutput("v", "velocity", "arm", (-1.0, 0.1, 0.0), (0.0, 1.0, 0.0)),
        PointOutput("s", "displacement", "axle", (1.0, 0.1, 0.3), (0.0, 0.6, 0.8)),
        PartOutput("force", "force", "tilted"),
        PartOutput("moment", "force", "bar"),
        TyreOutput("load", "tyre force", "rear"),
        TyreOutput("deflection", "tyre deflection", "left"),
        TurnOutput("roll", "angular acceleration", "alternator", (1.0, 0.0, 0.0)),
    )
    return SpatialVehicle("twin", bodies, springs, tyres, (1.2, -1.4), bars, outputs=outputs, gravity=9.81)


def rotation(axis, angles):
    """(m, 3, 3): turns about x, y or z written out."""
    i, j = {0: (1, 2), 1: (2, 0), 2: (0, 1)}[axis]
    matrices = np.broadcast_to(np.eye(3), (len(angles), 3, 3)).copy()
    matrices[:, i, i] = matrices[:, j, j] = np.cos(angles)
    matrices[:, j, i], matrices[:, i, j] = np.sin(angles), -np.sin(angles)
    return matrices


def pose(vehicle, name, q):
    """Centre (m, 3) and rotation (m, 3, 3) of a body in m positions q (m, n), by the words of ``Body``."""
    body = vehicle.body(name)
    own = dict(zip(vehicle.coordinates(), q.T, strict=True))
    x = [own.get((name, freedom), np.zeros(len(q))) for freedom in FREEDOMS]
    centre, turned, origin = np.zeros((len(q), 3)), np.broadcast_to(np.eye(3), (len(q), 3, 3)), np.zeros(3)
    if body.parent is not None:
        centre, turned = pose(vehicle, body.parent, q)
        origin = np.array(vehicle.body(body.parent).position)
    arm = np.array(body.position) - origin + np.stack(x[:3], axis=-1)
    turn = rotation(0, x[3]) @ rotation(1, x[4]) @ rotation(2, x[5])
    return centre + np.einsum("mij,mj->mi", turned, arm), turned @ turn


def place(vehicle, name, point, q, poses=None):
    """(m, 3): where a point of a body is."""
    if name is None:
        return np.broadcast_to(np.array(point), (len(q), 3))
    centre, turn = poses[name] if poses else pose(vehicle, name, q)
    return centre + turn @ (np.array(point) - vehicle.body(name).position)


def deformations(vehicle, q):
    """(m, p): d of every spring-damper, e of every bar, how far every tyre's point has risen, less those at rest."""

    def at(x):
        poses = {body.name: pose(vehicle, body.name, x) for body in vehicle.bodies}

        def where(name, point):
            return place(vehicle, name, point, x, poses)

        own = dict(zip(vehicle.coordinates(), x.T, strict=True))
        springs = [
            (where(s.second_body, s.second_point) - where(s.first_body, s.first_point)) @ s.axis
            for s in vehicle.springs
        ]
        risen = [(where(b.left, b.point_left) - where(b.right, b.point_right))[:, 2] for b in vehicle.bars]
        tracks = [b.point_left[1] - b.point_right[1] for b in vehicle.bars]
        bars = [own[b.body, "rx"] - up / track for b, up, track in zip(vehicle.bars, risen, tracks, strict=True)]
        return np.stack(springs + bars + [where(t.body, t.point)[:, 2] for t in vehicle.tyres], axis=-1)

    return at(q) - at(np.zeros_like(q[:1]))


def gains(vehicle, key):
    return np.array([getattr(part, key) for part in (*vehicle.springs, *vehicle.bars, *vehicle.tyres)])


def held_energy(vehicle, held, q):
    """(m,): potential (J) of the weights and of the preloads alone; the springs' own is 1/2 k d^2 beside it."""
    weights = sum(body.mass * vehicle.gravity * pose(vehicle, body.name, q)[0][:, 2] for body in vehicle.bodies)
    return weights + deformations(vehicle, q) @ held


NEAR = {-2: 1 / 12, -1: -2 / 3, 1: 2 / 3, 2: -1 / 12}
"""Fourth-order weights of a first difference over one step."""


def gradient(function, n):
    """(..., n): first derivatives at 0."""
    values = [weight * function(k * STEP * np.eye(n)) for k, weight in NEAR.items()]
    return np.moveaxis(sum(values) / STEP, 0, -1)


def hessian(function, n):
    """(n, n): second derivatives at 0 of a number."""
    i, j = np.triu_indices(n)
    one, two = STEP * np.eye(n)[i], STEP * np.eye(n)[j]
    found = np.zeros((n, n))
    for (k, u), (m, w) in product(NEAR.items(), repeat=2):
        found[i, j] += u * w * function(k * one + m * two) / STEP**2
    found[j, i] = found[i, j]
    return found


@pytest.fixture(scope="module")
def loaded():
    vehicle = twin()
    held = static_preloads(vehicle)
    # a tyre's preload pushes up: against its rise
    forces = [held.parts[p.name] for p in (*vehicle.springs, *vehicle.bars)] + [
        -held.tyres[t.name] for t in vehicle.tyres
    ]
    return vehicle, np.array(forces), linearise(vehicle)


@pytest.mark.grounds("plain counterpart")
def test_stiffness_is_the_curvature_of_the_energy(loaded):
    vehicle, held, linear = loaded
    n = len(linear.mass)
    rows = gradient(lambda q: deformations(vehicle, q), n)
    springs = np.einsum("ia,i,ib->ab", rows, gains(vehicle, "stiffness"), rows)
    turning = hessian(lambda q: held_energy(vehicle, held, q), n)
    # rounding of differences: 1e-16 x 5 kJ / 1e-6 is 5e-7 N m; a geometric stiffness of no size would show nothing
    np.testing.assert_allclose(linear.stiffness, springs + turning, atol=2e-5, rtol=0)
    assert np.abs(turning).max() > 100.0


@pytest.mark.grounds("plain counterpart")
def test_design_position_is_the_equilibrium(loaded):
    vehicle, held, linear = loaded
    slope = gradient(lambda q: held_energy(vehicle, held, q), len(linear.mass))
    assert np.abs(slope).max() < 1e-7  # of 7 kN: rounding of 5 kJ over 1e-3 leaves 1e-9


@pytest.mark.grounds("plain counterpart")
def test_damping_is_that_of_the_rates(loaded):
    vehicle, _, linear = loaded
    rows = gradient(lambda q: deformations(vehicle, q), len(linear.mass))
    expected = np.einsum("ia,i,ib->ab", rows, gains(vehicle, "damping"), rows)
    np.testing.assert_allclose(linear.damping, expected, atol=1e-10 * np.abs(expected).max(), rtol=0)


@pytest.mark.grounds("plain counterpart")
def test_mass_is_that_of_the_kinetic_energy(loaded):
    vehicle, _, linear = loaded
    n, expected = len(linear.mass), 0.0
    for body in vehicle.bodies:
        shift = gradient(lambda q, b=body: pose(vehicle, b.name, q)[0], n)
        turn = gradient(lambda q, b=body: pose(vehicle, b.name, q)[1], n)
        spin = np.array([turn[2, 1], turn[0, 2], turn[1, 0]])  # R' at rest is the skew matrix of the angular velocity
        expected = expected + body.mass * shift.T @ shift + spin.T @ np.array(body.inertia) @ spin
    np.testing.assert_allclose(linear.mass, expected, atol=1e-10 * np.abs(expected).max(), rtol=0)


@pytest.mark.grounds("plain counterpart")
def test_outputs_and_road(loaded):
    vehicle, _, linear = loaded
    n = len(linear.mass)
    rows = gradient(lambda q: deformations(vehicle, q), n)
    tyre_rows = rows[-3:]
    a, v, s, force, moment, load, deflection, roll = linear.outputs
    for found, spec in zip(
        (a.acceleration_factors, v.rate_factors, s.displacement_factors), vehicle.outputs, strict=False
    ):
        moved = gradient(lambda q, o=spec: place(vehicle, o.body, o.point, q) @ o.axis, n)
        np.testing.assert_allclose(found, moved, atol=1e-10)
    np.testing.assert_allclose(force.displacement_factors, 2e4 * rows[0], atol=1e-6)
    np.testing.assert_allclose(force.rate_factors, 900.0 * rows[0], atol=1e-7)
    np.testing.assert_allclose(moment.displacement_factors, 800.0 * rows[-4], atol=1e-7)
    np.testing.assert_allclose(load.displacement_factors, -1.4e5 * tyre_rows[2], atol=1e-5)
    np.testing.assert_array_equal(load.road_factors, [0, 0, 1.4e5])
    np.testing.assert_array_equal(load.road_rate_factors, [0, 0, 70.0])
    np.testing.assert_array_equal(deflection.road_factors, [1, 0, 0])
    np.testing.assert_allclose(deflection.displacement_factors, -tyre_rows[0], atol=1e-10)
    rolls = [freedom == "rx" and body in ("body", "engine") for body, freedom in linear.coordinates]
    np.testing.assert_array_equal(roll.acceleration_factors, np.array(rolls, float))
    np.testing.assert_allclose(
        linear.road_stiffness, (np.array([1.5e5, 1.6e5, 1.4e5])[:, None] * tyre_rows).T, atol=1e-5
    )
    assert (moment.unit, force.unit, roll.unit, s.unit) == ("N m", "N", "rad/s^2", "m")


@pytest.mark.grounds("closed form")
def test_wheel_loads_carry_the_weight():
    held = static_preloads(replace(load_vehicle("three_axle_truck"), gravity=9.81))
    vehicle = load_vehicle("three_axle_truck")
    weight = 9.81 * sum(body.mass for body in vehicle.bodies)
    assert sum(held.tyres.values()) == pytest.approx(weight, rel=1e-12)
    moment = sum(load * vehicle.axles[tyre.axle] for load, tyre in zip(held.tyres.values(), vehicle.tyres, strict=True))
    assert moment == pytest.approx(9.81 * sum(b.mass * b.position[0] for b in vehicle.bodies), rel=1e-11)


@pytest.mark.grounds("closed form")
def test_side_force_and_drag():
    """A body of six freedoms on one tyre: rows written out by hand, F = C (steer + yaw - y' / v)."""
    body = Body("body", 10.0, (0.2, 0.0, 0.5), FREEDOMS, ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0)))
    tyre = Tyre("tyre", "body", (1.2, 0.3, 0.5), 0, 1e4)
    side = SideForce("tyre", "body", (1.2, 0.3, 0.0), "body", 500.0, roll_steer=0.05)
    vehicle = SpatialVehicle("v", (body,), (), (tyre,), (1.2,), side_forces=(side,), drags=(Drag("body", 2.0),))
    linear = linearise(vehicle, 4.0)
    sideways = np.array([0, 1.0, 0, 0.5, 0, 1.0])  # y' of the contact point: it lies 0.5 m below, 1 m ahead
    expected = 500.0 / 4.0 * np.outer(sideways, sideways)
    expected[0, 0] += 2.0 * 4.0
    np.testing.assert_allclose(linear.damping, expected, atol=1e-12)
    height = np.array([0, 0, 1.0, 0.3, -1.0, 0])
    steered = np.array([0, 0, 0, 0.05, 0, 1.0])
    expected = 1e4 * np.outer(height, height) - 500.0 * np.outer(sideways, steered)
    np.testing.assert_allclose(linear.stiffness, expected, atol=1e-11)
    for speed in (None, 0.0, float("nan")):
        with pytest.raises(InputError, match="needs a speed above 0 m/s"):
            linearise(vehicle, speed)


def eigenvalues(linear):
    n = len(linear.mass)
    own = -np.linalg.solve(linear.mass, np.hstack([linear.stiffness, linear.damping]))
    return np.linalg.eigvals(np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), own]))


FREQUENCIES = [
    1.357622,
    1.47076,
    2.152076,
    2.738235,
    2.89083,
    5.917883,
    6.426765,
    9.707712,
    10.419969,
    10.434258,
    11.280234,
    11.401383,
    11.656264,
    12.007752,
    12.667486,
    15.478222,
    15.487798,
    15.526984,
    15.535278,
]
"""Hz, |lambda| / 2 pi of the damped pairs of R19-ride, as handed over with its parameters."""


def test_frequencies_of_r19_ride():
    found = eigenvalues(linearise(load_vehicle("r19_ride")))
    found = np.sort(np.abs(found[found.imag > 0])) / (2 * np.pi)
    np.testing.assert_allclose(found, FREQUENCIES, rtol=1e-6)  # printed to 1e-6 Hz, the lowest 1.36 Hz


def test_r19_free_floats():
    """Three zero eigenvalues: x, y, and y with yaw as a Jordan pair, which rounding splits by its square root."""
    linear = linearise(load_vehicle("r19_free"), 20.0)
    values = eigenvalues(linear)
    values = values[np.argsort(np.abs(values))]
    assert np.abs(values[:3]).max() < 1e-4
    # drag 1 x 20 N s/m on body, engine and wheels; the occupants move up and down only
    assert values[3].real == pytest.approx(-20 / (965.7108098804363 + 2 * 63.7921826056784), rel=1e-3)
    assert values[4:].real.max() < -0.5
    forwards = np.array([freedom == "x" for _, freedom in linear.coordinates], float)
    assert np.abs(linear.stiffness @ forwards).max() < 1e-9  # body and wheels forward without strain; bushes 3e5 N/m


def test_curves_and_friction_have_their_slopes():
    bump = Curve((-0.05, 0.0, 0.04, 0.06), (-20.0, 0.0, 0.0, 900.0))
    assert [bump(x) for x in (-0.1, 0.02, 0.05, 0.08)] == pytest.approx([-40.0, 0.0, 450.0, 1800.0])
    assert bump.slope_at_rest() == pytest.approx(200.0)  # mean of 400 below and 0 above
    vehicle = load_vehicle("quarter_car")
    spring = replace(vehicle.springs[0], travel_force=bump, friction=30.0, friction_rate=0.02)
    bent = linearise(replace(vehicle, springs=(spring,)))
    plain = linearise(vehicle)
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    np.testing.assert_allclose(bent.stiffness - plain.stiffness, 200.0 * pair, atol=1e-8)
    np.testing.assert_allclose(bent.damping - plain.damping, 1500.0 * pair, atol=1e-9)
    given = linearise(replace(vehicle, springs=(spring,)), equivalent_gains={"front left": (1000.0, 10.0)})
    np.testing.assert_allclose(given.stiffness[0], [1000.0, -1000.0], atol=1e-9)
    np.testing.assert_allclose(given.damping, 10.0 * pair, atol=1e-12)
    with pytest.raises(InputError, match=r"equivalent = 'front lefd': no such spring .*did you mean 'front left'"):
        linearise(vehicle, equivalent_gains={"front lefd": (1000.0, 10.0)})


def test_weight_that_nothing_carries():
    vehicle = load_vehicle("quarter_car")
    spring = replace(vehicle.springs[0], stiffness=0.0)
    with pytest.raises(InputError, match=r"body.z: no spring carries the weight"):
        static_preloads(replace(vehicle, springs=(spring,), gravity=9.81))
