"""Forces on a bicycle on tyres, by the geometry of its discs and by virtual work on its bodies, at states by hand.

Two kinds of states leave nothing of a tyre to its bristles: locked wheels that slide and do not turn about the vertical
rub with mu N against the sliding; and tyres without friction bear their load alone, however the wheels move. Places of
the wheels come from turns written out here, and what they move with by differences of those places.
"""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from models.bicycle.four_bodies import COUNT, FRONT, HEIGHT, LEAN, PITCH, REAR, STEER, YAW, X, Y, straight_rolling
from models.bicycle.rolling_tyres import BicycleTyre, RollingBicycle, set_bicycle_forces
from models.bicycle.whipple import SteeringControl, load_bicycle
from models.multibody import forces

pytestmark = pytest.mark.grounds("closed form")
BENCHMARK = load_bicycle("benchmark")
CONTROL = SteeringControl(
    gain=2.0, until=6.5, friction=0.3, dry_friction=0.2, torque_gain=0.9, speed_gain=0.8, speed_bias=0.25
)
"""Each number counts, at speeds below 7.8 m/s."""
STEP = 1e-6
"""Of differences, in m and rad: errors of some 1e-10."""
NEAR = 1e-7
"""Of the largest force, beside those errors."""


def bodies(q):
    """Centre and axes (columns) of both wheels, the rear one first, at positions (9,)."""
    b = BENCHMARK
    upright = Rotation.from_euler("y", b.tilt)
    frame = Rotation.from_euler("ZXY", q[[YAW, LEAN, PITCH]])
    hub = np.array([q[X], q[Y], b.rear_wheel.radius + q[HEIGHT]])
    pivot = upright.apply([b.wheelbase + b.trail, 0.0, -b.rear_wheel.radius])
    fork = upright.apply([-b.trail, 0.0, b.front_wheel.radius])
    front = frame * Rotation.from_euler("z", q[STEER])
    centre = hub + frame.apply(pivot) + front.apply(fork)
    turned = (frame * Rotation.from_euler("y", q[REAR]), front * Rotation.from_euler("y", q[FRONT]))
    return [(place, turn.as_matrix()) for place, turn in zip((hub, centre), turned, strict=True)]


def lowest(q):
    """Lowest points of both discs, in space and in the axes of their wheels."""
    points, wheels = [], (BENCHMARK.rear_wheel, BENCHMARK.front_wheel)
    for (centre, axes), wheel in zip(bodies(q), wheels, strict=True):
        axle = axes[:, 1]
        down = axle * axle[2] - [0.0, 0.0, 1.0]
        arm = wheel.radius * down / np.linalg.norm(down)
        points.append((centre + arm, axes.T @ arm))
    return points


def jacobians(q):
    """(2, 3, 9): how the material points move that are lowest now, by each coordinate."""
    inner = [place for _, place in lowest(q)]

    def places(at):
        return np.array([centre + axes @ place for (centre, axes), place in zip(bodies(at), inner, strict=True)])

    steps = STEP * np.eye(COUNT)
    return np.stack([(places(q + step) - places(q - step)) / (2.0 * STEP) for step in steps], axis=-1)


def computed(rolling, q, v):
    """Forces (9,) of the compiled block on a state."""
    block = np.concatenate([np.full(COUNT, np.nan), q, v, rolling.numbers])
    set_bicycle_forces(block.ctypes.data, 0.0, COUNT)
    return block[:COUNT]


def loads(rolling, q, moving):
    """Elastic and whole loads (2,) by statics at rest, the stiffness, and how fast the lowest points rise."""
    tyre = rolling.tyre
    stiffness, damping = tyre.stiffness**2 * tyre.vertical, tyre.stiffness * tyre.damping
    elastic = np.array(rolling.loads()) - stiffness * np.array([place[2] for place, _ in lowest(q)])
    return elastic, elastic - damping * moving[:, 2], stiffness


def a_state(seed):
    """Positions and rates (9,) near riding upright; wheels bear weight."""
    random = np.random.default_rng(seed)
    q, v = straight_rolling(BENCHMARK, 4.0)
    q += random.uniform(-0.3, 0.3, COUNT)
    q[PITCH] = -BENCHMARK.tilt
    q[HEIGHT] -= max(place[2] for place, _ in lowest(q)) + 1e-4
    return q, v + random.uniform(-0.3, 0.3, COUNT)


def test_loads_at_rest_are_those_of_a_beam_on_two_supports():
    b = BENCHMARK
    parts = [(0.0, b.rear_wheel), (b.body.x, b.body), (b.front_frame.x, b.front_frame), (b.wheelbase, b.front_wheel)]
    weight = b.gravity * sum(part.mass for _, part in parts)
    front = b.gravity * sum(x * part.mass for x, part in parts) / b.wheelbase
    q, v = straight_rolling(b, 0.0)
    tyres, _ = RollingBicycle(b).report(q[None], v[None])
    assert tyres[0, :, forces.PRESS] == pytest.approx([weight - front, front], rel=1e-12)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_smooth_tyres_press_where_their_discs_are_lowest_and_control_turns_the_steering(seed):
    rolling = RollingBicycle(BENCHMARK, BicycleTyre(friction=1e-12, stiffness=1.5), CONTROL)
    q, v = a_state(seed)
    ways = jacobians(q)
    moving = ways @ v
    elastic, load, stiffness = loads(rolling, q, moving)
    ahead = math.cos(q[YAW]) * v[X] + math.sin(q[YAW]) * v[Y]
    torque = -0.9 * 2.0 * (6.5 - 0.8 * ahead - 0.25) * v[LEAN] - 0.3 * v[STEER] - 0.2 * math.tanh(v[STEER] / 0.05)
    wanted = np.einsum("i,ij->j", load, ways[:, 2])
    wanted[STEER] += torque
    assert load.min() > 10.0
    assert np.abs(computed(rolling, q, v) - wanted).max() < NEAR * np.abs(wanted).max()
    tyres, ledgers = rolling.report(q[None], v[None])
    assert tyres[0, :, forces.PRESS] == pytest.approx(load, rel=NEAR)
    assert ledgers[0, forces.POTENTIAL] == pytest.approx((elastic**2).sum() / (2.0 * stiffness), rel=NEAR)
    assert ledgers[0, forces.DISSIPATED] == pytest.approx((load - elastic) @ moving[:, 2], rel=1e-6)
    assert ledgers[0, forces.STEER_POWER] == pytest.approx(torque * v[STEER], rel=1e-12)


@pytest.mark.parametrize("seed", [4, 5, 6])
def test_locked_wheels_rub_against_their_sliding(seed):
    """Nothing turns about the vertical: rates along the heading's x alone, and wheels that do not spin."""
    rolling = RollingBicycle(BENCHMARK, BicycleTyre(friction=0.7))
    q, v = a_state(seed)
    v[[YAW, PITCH, REAR, STEER, FRONT]] = 0.0
    v[[X, Y]] += 5.0, 3.0
    ways = jacobians(q)
    moving = ways @ v
    _, load, _ = loads(rolling, q, moving)
    sliding = moving * [1.0, 1.0, 0.0]
    speed = np.linalg.norm(sliding, axis=1)
    force = load[:, None] * ([0.0, 0.0, 1.0] - 0.7 * sliding / speed[:, None])
    wanted = np.einsum("ik,ikj->j", force, ways)
    assert np.abs(computed(rolling, q, v) - wanted).max() < NEAR * np.abs(wanted).max()
    tyres, _ = rolling.report(q[None], v[None])
    assert np.hypot(*tyres[0, :, [forces.SLIP_X, forces.SLIP_Y]]) == pytest.approx(speed, rel=NEAR)
    assert tyres[0, :, forces.POWER] == pytest.approx(-0.7 * load * speed, rel=NEAR)
