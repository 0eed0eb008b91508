"""Kernels of braking in the plane held to balances, closed forms and plain matrices."""

import math

import numpy as np
import pytest

from models.brake.advance import AT_REST
from models.brake.brake import Brake
from models.brake.controllers.five_phase_cycle import WheelAtConstantSpeed, state_after
from models.brake.plane_chain import factorise_mass, fill_headings, fill_mass_matrix, solve_accelerations
from models.brake.plane_step import JUMP_WIDTH
from models.brake.plane_vehicle import GRAVITY, PAPER_TRUCK, plane_of_truck
from models.brake.trailer import CHOSEN_TRAILER, plane_of_trailer, plane_of_train
from models.engines.braking import set_constant_wheel_forces
from models.tyre.magic_formula import table_of_surface
from models.tyre.tyre_table import StackedTyreTables, TyreTable, stacked_tables
from validation.braking.braked_truck import RollingTruck, constant_friction, on_road, truck_on_tables

MU = 0.4
LOCKING = np.full(4, 1e14)


def places(q, plane):
    """Centres of the units on the ground (U, 2): each unit's reach along all headings before it, and its own."""
    ways = np.column_stack((np.cos(q[2:]), np.sin(q[2:])))
    return q[:2] + plane.arm_lengths @ ways


def slopes(function, q, step=1e-6):
    """Derivative of a function of the coordinates, by central differences: (..., n)."""
    moves = step * np.eye(q.size)
    return np.stack([(function(q + move) - function(q - move)) / (2.0 * step) for move in moves], axis=-1)


def plain_mass(q, plane):
    """Mass matrix (n, n) by the kinetic energy of units whose centres move as ``places`` do."""
    by_place, size = slopes(lambda x: places(x, plane), q), q.size
    mass = np.diag(np.concatenate((np.zeros(2), plane.inertias)))
    for k, m in enumerate(plane.masses):
        mass += m * by_place[k].T @ by_place[k]
    assert mass.shape == (size, size)
    return mass


@pytest.mark.grounds("plain counterpart")
@pytest.mark.parametrize(
    "plane",
    [plane_of_truck(PAPER_TRUCK), plane_of_train(PAPER_TRUCK, CHOSEN_TRAILER), plane_of_trailer(CHOSEN_TRAILER)],
    ids=["truck", "train", "hooked"],
)
def test_forces_give_the_accelerations_of_the_mass_matrix_by_energy(plane):
    """At rest; coordinates that are prescribed do not take part."""
    random, units = np.random.default_rng(3), plane.masses.size
    q, n = random.uniform(-0.5, 0.5, 2 + units), 2 + units
    mass, right, along, across, ways = np.empty((n, n)), np.empty(n), np.empty(n), np.empty(n), np.empty((units, 2))
    fill_headings(q, ways)
    fill_mass_matrix(ways, np.zeros(n), plane, mass, right, along, across)
    factorise_mass(mass, plane)
    forces = random.normal(0.0, 1e4, n)
    accelerations = forces.copy()
    solve_accelerations(mass, plane, accelerations)
    free = slice(2 if plane.has_prescribed_hook else 0, n)
    expected = np.linalg.solve(plain_mass(q, plane)[free, free], forces[free])
    assert not right.any() and accelerations[free] == pytest.approx(expected, rel=1e-7)


@pytest.mark.grounds("closed form")
def test_wheels_act_on_a_train_by_the_work_of_their_forces():
    """Generalised forces are the derivatives of F . r by the engine's coordinates: place, heading, angles of hinges."""
    plane, random = plane_of_train(PAPER_TRUCK, CHOSEN_TRAILER), np.random.default_rng(4)
    units, wheels = plane.masses.size, plane.wheels
    steer, held = random.uniform(-0.2, 0.2, wheels), random.normal(0.0, 5e3, (2, wheels))
    q = random.uniform(-0.5, 0.5, 2 + units)
    numbers = np.concatenate(
        ([units, wheels], plane.arm_lengths.ravel(), plane.unit, plane.place.T.ravel(), steer, held.ravel())
    )
    block = np.concatenate((np.full(q.size, 9.0), q, np.zeros(q.size), numbers))
    set_constant_wheel_forces(block.ctypes.data, 0.0, q.size)

    def centres(x):
        absolute = np.concatenate((x[:2], np.cumsum(x[2:])))
        turns = absolute[2:][plane.unit]
        c, s = np.cos(turns), np.sin(turns)
        arms = np.column_stack(
            (c * plane.place[:, 0] - s * plane.place[:, 1], s * plane.place[:, 0] + c * plane.place[:, 1])
        )
        return places(absolute, plane)[plane.unit] + arms

    angles = np.cumsum(q[2:])[plane.unit] + steer
    forces = np.column_stack(
        (np.cos(angles) * held[0] - np.sin(angles) * held[1], np.sin(angles) * held[0] + np.cos(angles) * held[1])
    )
    assert block[: q.size] == pytest.approx(np.einsum("wi,win->n", forces, slopes(centres, q)), rel=1e-7)


@pytest.mark.grounds("closed form")
@pytest.mark.parametrize("speed", [10.0, 0.3])
def test_locked_wheels_stop_in_the_time_of_coulomb_s_friction(speed):
    """t = v / (mu g), and the wheels bear mu m g on the way; at a walking pace steps are cut into parts."""
    plane = plane_of_truck(PAPER_TRUCK)
    still = plane._replace(radius=plane.radius * 1e9)  # wheels that turn at next to no speed: locked at once
    moving = RollingTruck(truck_on_tables(constant_friction(MU), still), speed)
    moving.on(np.tile(LOCKING, (2, 1)), 5.5e-3)
    forces, loads = -moving.report.force_x.sum(), moving.report.load.sum()
    assert (loads, forces) == pytest.approx((PAPER_TRUCK.mass * GRAVITY, MU * PAPER_TRUCK.mass * GRAVITY), rel=1e-6)
    status = 0
    while status != AT_REST:
        status, _ = moving.on(np.tile(LOCKING, (2, 1)), 5.5e-3)
    assert moving.time == pytest.approx(speed / (MU * GRAVITY), rel=1e-6)


@pytest.mark.grounds("closed form")
def test_a_wheel_at_a_frozen_speed_keeps_its_momentum():
    """J (w1 - w0) = r int F dt - int T dt, where pressure and torque rise on the brake's upward line."""
    brake = Brake(push_out=0.5, release=0.5, rising=1500.0, falling=1500.0)
    frozen = WheelAtConstantSpeed(20.0, 4e3, 0.3, 1.2, brake, table_of_surface("dry"))
    start = frozen.rolling()._replace(pressure=0.6, torque=150.0)
    end = state_after(start, 40.0, 2e-3, frozen.driven)
    assert (end.time, end.pressure, end.torque) == pytest.approx((2e-3, 0.68, 1500.0 * (0.68 - 0.5)), rel=1e-12)
    braked = 0.5 * (150.0 + end.torque) * 2e-3
    assert 1.2 * (end.turning - start.turning) == pytest.approx(0.3 * end.impulse - braked, rel=1e-10)
    assert 0.0 < end.impulse < 1.2 * 4e3 * 2e-3 and not math.isclose(end.turning, start.turning)


def falling() -> StackedTyreTables:
    """Friction that is greatest at a slip of 0.1, and half as great where a wheel is locked."""
    along = np.broadcast_to(np.array([0.0, 2.0 * MU, MU]), (3, 1, 3)).copy()
    nodes = np.array([0.0, 0.1, np.pi / 2.0]), np.array([0.0, 0.1, 1.0]), np.array([1e4])
    g, h = np.ones((3, 3)) * np.array([1.0, 0.0, 0.0]), np.array([[0.0], [MU], [MU]])
    return stacked_tables([TyreTable(*nodes, along, g, h)])


@pytest.mark.grounds("closed form")
@pytest.mark.parametrize(("inertia", "speed", "step", "share"), [(3.0, 0.1, 5.5e-3, 5e-3), (1.0, 0.03, 2e-3, 1.4e-3)])
def test_wheels_at_the_edge_of_locking_bear_the_load_that_just_locks_them(inertia, speed, step, share):
    """r mu N = T: a little more load, and the rear wheels roll at once, with more friction, which takes the load away.

    Loads give the acceleration by load transfer, and this the forces; the front wheels are locked. The jump is closed
    in to ``JUMP_WIDTH`` on both sides.
    """
    plane = plane_of_truck(PAPER_TRUCK)._replace(spin_inertia=np.full(4, inertia))
    load = (plane.static_loads - plane.load_per_x_acceleration * MU * GRAVITY) * (
        1.0 - share
    )  # a little less than behind if all are locked
    torques = np.where(plane.place[:, 0] < 0.0, plane.radius * MU * load, LOCKING)
    moving = RollingTruck(on_road(plane, falling(), cornering_slope=1e-6), speed)
    moving.turning[:] = 0.0
    moving.on(torques, step)
    lift, mass = PAPER_TRUCK.mass * PAPER_TRUCK.height / (2.0 * PAPER_TRUCK.wheelbase), PAPER_TRUCK.mass
    slowing = (plane.static_loads[2] - load[2]) / lift
    loads = plane.static_loads + lift * slowing * np.array([1.0, 1.0, -1.0, -1.0])
    front = MU * loads[0]
    rear = 0.5 * mass * slowing - front
    report = moving.report
    assert rear > 1.01 * MU * loads[2]  # not locked all the time, nor rolling
    assert -moving.motion.accelerations[0] == pytest.approx(slowing, abs=2.0 * JUMP_WIDTH)
    assert report.load == pytest.approx(loads, abs=2.0 * lift * JUMP_WIDTH)
    assert -report.force_x == pytest.approx([front, front, rear, rear], abs=2.0 * mass * JUMP_WIDTH)
    assert report.force_x.sum() == pytest.approx(mass * moving.motion.accelerations[0], rel=1e-12)
