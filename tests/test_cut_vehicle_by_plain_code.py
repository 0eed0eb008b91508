"""The compiled forces of a cut vehicle held to plain matrices: joint forces, march, axes that turn, points."""

from dataclasses import replace

import numpy as np
import pytest

from models.engines.cut_vehicle import PLAIN_ENGINE, build
from models.multibody.cut_kernel import set_joint_forces
from models.multibody.cut_table import HubInputs
from models.multibody.plain.hubs import PlainHubs
from models.multibody.plain.motion import BIAS, FIRST_DERIVATIVE, PLACE
from models.systems.measured.sections import AccelerometerPoint, Sections
from models.vehicles.cut_vehicle import CutVehicle, cut_at_hubs
from validation.spatial.cars import r19, rough_car, static_forces, twin
from validation.spatial.written_equations import cut_state

pytestmark = pytest.mark.grounds("plain counterpart")
STEP, TIME = 1e-3, 1.3e-3
RNG = np.random.default_rng(51)


def turning() -> CutVehicle:
    """The twin with springs whose axes are fixed in what rides on the chassis, and turn with it, their ends apart."""
    whole, frames = twin(), {"left mount.x": "engine", "front left": "fl"}
    springs = [
        replace(s, frame=frames[s.name], second_point=tuple(np.add(s.second_point, (0.1, -0.2, 0.3))))
        if s.name in frames
        else s
        for s in whole.springs
    ]
    return cut_at_hubs(replace(whole, springs=tuple(springs)), "body")


def hub_inputs_of(vehicle: CutVehicle, rows: int) -> HubInputs:
    """Static loads and 400 N at random, and a guide that enforces roll and pitch."""
    hubs = static_forces(vehicle, rows).hubs
    return HubInputs(hubs + RNG.normal(0.0, 400.0, hubs.shape), "hub", guide=RNG.normal(0.0, 0.02, (rows, 6)))


@pytest.mark.parametrize("car", [r19, rough_car, turning])
def test_joint_forces_in_a_block_are_those_of_the_plain_equations(car):
    """f = M q'' - what weight and inertia give; read at the nearest half step of a time."""
    vehicle = car()
    hub_inputs = replace(hub_inputs_of(vehicle, 5), guide=None)
    plain, numbers = (
        PlainHubs(vehicle, hub_inputs, STEP),
        build("reference", vehicle, hub_inputs, STEP, 2.0 * STEP).numbers,
    )
    q, v = cut_state(vehicle, 3)
    block = np.concatenate((np.full(vehicle.size, 5.0), q, v, numbers))
    set_joint_forces(block.ctypes.data, TIME, vehicle.size)
    mass, bias = plain.bodies.inertia(plain.bodies.move(q, v), np.array([0.0, 0.0, -vehicle.tree.gravity]))
    expected = mass @ plain.acceleration(TIME, q, v) - bias
    assert block[: vehicle.size] == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())


def test_a_march_is_that_of_the_plain_equations():
    vehicle = rough_car()
    hub_inputs = hub_inputs_of(vehicle, 21)
    compiled, plain = (build(name, vehicle, hub_inputs, STEP, 10 * STEP).run() for name in ("reference", PLAIN_ENGINE))
    assert np.abs(plain.states[-1]).max() > 1e-3
    assert compiled.states == pytest.approx(plain.states, abs=1e-10)
    for name in ("elements", "wrenches", "moments"):
        expected = getattr(plain, name)
        assert getattr(compiled, name) == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def test_points_feel_the_second_derivative_of_their_places():
    """In the axes of the body that carries them, with and without the weight: r'' = (r'' without q'') + dr/dq q''."""
    vehicle = r19()
    hub_inputs = replace(hub_inputs_of(vehicle, 3), guide=None)
    places = {"body": (0.4, 0.2, 0.9), "engine": (1.1, -0.1, 0.7)}
    points = tuple(
        AccelerometerPoint(f"{name} {weight}", name, place, weight)
        for name, place in places.items()
        for weight in (True, False)
    )
    plain, sections = PlainHubs(vehicle, hub_inputs, STEP), Sections(vehicle, points=points)
    q, v = cut_state(vehicle, 4)
    numbers = build("reference", vehicle, hub_inputs, STEP, STEP).numbers
    row = sections.read(numbers, np.concatenate((q, v))[None], 1)[0]
    felt = {answer.name: value for answer, value in zip(sections.answers, row, strict=True)}
    motion, q2 = plain.bodies.move(q, v), plain.acceleration(0.0, q, v)
    for point in points:
        at = motion.at(plain.bodies.points([(point.body, point.position)]))[0]
        space = at[BIAS] + q2 @ at[FIRST_DERIVATIVE:] + np.array([0.0, 0.0, vehicle.tree.gravity * point.gravity])
        expected = space @ motion.axes(plain.bodies.row[point.body])[PLACE]
        names = [name for name in felt if name.startswith(point.name)]
        assert [felt[name] for name in names] == pytest.approx(expected.tolist(), rel=1e-9, abs=1e-9), names
