"""The plain reference's mechanics: matrices of 4 by 4 beside Jacobians, preloads; nothing of it is compiled."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from models.engines.spatial_reference import SpatialReference
from models.multibody import plain
from models.multibody.plain.march import march
from models.multibody.plain.motion import FIRST_DERIVATIVE, PLACE, RATE, Bodies
from models.multibody.plain.parts import PlainParts
from models.multibody.plain.statics import preloads_at_rest
from models.vehicles.spatial import SpatialVehicle
from models.vehicles.spatial_linear import design_mass_matrix, static_preloads
from models.vehicles.vehicle_file import load_vehicle
from validation.spatial.cars import twin
from validation.spatial.spatial_twin import asymmetric_vehicle as spatial_twin

ROUNDING = 1e-12
"""Of the largest: sums of some hundred products each, and one linear system."""


def acceleration(vehicle: SpatialVehicle, gravity: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Accelerations of bodies under their weights, springs and bars without preloads, axes fixed in space."""
    bodies = Bodies(vehicle)
    motion, parts = bodies.move(q, v), PlainParts(bodies, vehicle, None)
    matrix, force = bodies.inertia(motion, np.array([0.0, 0.0, -gravity]))
    travels = parts.travels(motion, q, v)
    spring, other = parts.forces(travels, np.zeros(len(parts.names)))
    return np.linalg.solve(matrix, force - (spring + other) @ travels.gradient)


def test_accelerations_are_those_of_the_sums_of_jourdain():
    """The twin has products of inertia, riders on riders, springs and bars inclined between bodies that turn."""
    bare, worst = replace(spatial_twin(), tyres=(), side_forces=(), drags=()), 0.0
    reference, rng = SpatialReference(bare), np.random.default_rng(3)
    reference.vehicle = replace(bare, gravity=9.81)  # after its preloads, which no tyre could bear
    for _ in range(100):
        q, v = rng.uniform(-0.3, 0.3, (2, len(bare.coordinates())))
        wanted = reference.acceleration(0.0, q, v)
        worst = max(worst, float(np.abs(acceleration(bare, 9.81, q, v) - wanted).max() / np.abs(wanted).max()))
    assert worst < ROUNDING


def test_a_mass_matrix_at_rest_is_that_of_small_motion():
    whole = spatial_twin()
    still = np.zeros(len(whole.coordinates()))
    bodies = Bodies(whole)
    matrix, force = bodies.inertia(bodies.move(still, still), np.zeros(3))
    assert matrix == pytest.approx(design_mass_matrix(whole), abs=ROUNDING * design_mass_matrix(whole).max())
    assert np.abs(force).max() == 0.0


def test_rates_and_derivatives_are_those_of_the_places():
    """Central differences of places along the motion, and by every coordinate: right to h^2."""
    whole, h = spatial_twin(), 1e-5
    bodies, rng = Bodies(whole), np.random.default_rng(5)
    q, v = rng.uniform(-0.5, 0.5, (2, bodies.size))
    points = bodies.points([("lid", (1.0, 0.2, 1.0)), ("hub", (-1.1, 0.6, 0.5)), (None, (1.0, 2.0, 3.0))])

    def places(change: np.ndarray) -> np.ndarray:
        return bodies.move(q + change, v).at(points)[:, PLACE]

    here = bodies.move(q, v).at(points)
    assert here[:, RATE] == pytest.approx((places(h * v) - places(-h * v)) / (2 * h), abs=1e-8)
    for i, unit in enumerate(np.eye(bodies.size)):
        assert here[:, FIRST_DERIVATIVE + i] == pytest.approx(
            (places(h * unit) - places(-h * unit)) / (2 * h), abs=1e-8
        )
    assert here[2, PLACE].tolist() == [1.0, 2.0, 3.0] and not here[2, RATE:].any()


@pytest.mark.parametrize("body", ["lid", "pump", "body"])
def test_a_moment_does_the_work_of_its_angular_velocity(body):
    bodies, rng = Bodies(spatial_twin()), np.random.default_rng(7)
    q, v = rng.uniform(-0.5, 0.5, (2, bodies.size))
    motion, moment, row = bodies.move(q, v), np.array([3.0, -2.0, 5.0]), bodies.row[body]
    assert motion.moment_forces(row, moment) @ v == pytest.approx(moment @ motion.angular_velocity(row), abs=1e-13)
    spin = motion.axes(row)[RATE] @ motion.axes(row)[PLACE].T
    assert spin == pytest.approx(-spin.T, abs=1e-14)


@pytest.mark.parametrize("car", [load_vehicle("r19_free"), twin(), spatial_twin(9.81)], ids=["r19", "twin", "spatial"])
def test_preloads_are_those_of_the_description(car):
    car = replace(car, gravity=9.81, side_forces=(), drags=())
    held, loads = preloads_at_rest(car, None)
    wanted = static_preloads(car)
    assert held == pytest.approx([*wanted.parts.values()], abs=1e-9)
    assert loads == pytest.approx([*wanted.tyres.values()], rel=1e-12)


def test_the_march_has_order_four():
    """A linear oscillator beside its cosine: half the step leaves a sixteenth of the error."""
    ends = [march(lambda t, q, v: -q, np.ones(1), np.zeros(1), n, 1.0 / n)[-1, 0] - np.cos(1.0) for n in (10, 20)]
    assert np.log2(ends[0] / ends[1]) == pytest.approx(4.0, abs=0.1)


def test_the_plain_reference_imports_no_kernel():
    """No compiled function can reach it, and it cannot share one."""
    for path in Path(plain.__file__).parent.glob("*.py"):
        tree = ast.parse(path.read_text())
        guarded = {id(node) for test in ast.walk(tree) if isinstance(test, ast.If) for node in ast.walk(test)}
        modules = [
            node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and id(node) not in guarded
        ]
        modules += [alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names]
        own, described = "models.multibody.plain", ("models.vehicles.", "models.core.")
        for module in (module for module in modules if module.startswith("models")):
            assert module.startswith(own) or module.startswith(described), (path.name, module)
        assert "numba" not in modules, path.name
