"""The ride and pitch-plane vehicles built by the builder of free vehicles: equal accelerations, and time of a step.

That builder has one kinematic tree of all bodies, and one callback of compiled forces. The compiled forces of hub
forces read an axis that is fixed in space, too; springs and tyres are their elements here. Anti-roll bars are left out
on both sides: ride's law of them reads the roll coordinate, which no element does.

``python -m validation.price.one_builder`` prints the figures of ``docs/findings/engines.md``.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any
from unittest import mock

import numpy as np

from models.engines import spatial_exudyn_build
from models.engines.assembly import Settings
from models.engines.free_vehicle import FreeModel, LoadedVehicle, free_model
from models.engines.protocol import build as in_plane
from models.engines.spatial_protocol import INTEGRATORS
from models.engines.spatial_protocol import build as in_space
from models.machine.timing import interleave, paired_ratio
from models.multibody.cut_kernel import (
    AXIS_JOINT,
    CHASSIS,
    FIRST_BODY,
    FIRST_POINT,
    SECOND_BODY,
    joint_forces,
    set_joint_forces,
    table_views,
)
from models.multibody.cut_table import HubInputs, cut_vehicle_table
from models.systems.pitch_plane.scene import assembly_of_scene
from models.systems.pitch_plane.scene import build as pitch_plane_scene
from models.vehicles.cut_vehicle import CutVehicle, CutVehicleElement
from models.vehicles.description import PlaneVehicle
from models.vehicles.spatial import Body, SpatialVehicle, SpringDamper, Tyre, Vector
from models.vehicles.vehicle_file import load_vehicle

SEED, STEP, STEPS = 43, 1e-3, 200
UPWARD: Vector = (0.0, 0.0, 1.0)
Acceleration = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class TwoBuilds:
    """A vehicle built twice: by its system's builder, and by the builder of free vehicles. ``sign`` : sign of the free
    vehicle's coordinates relative to those of the system."""

    system_model: Any
    free_model: FreeModel
    sign: float = 1.0

    def gap(self, state_count: int) -> float:
        """Largest difference of the accelerations of both builds at random states, divided by the largest acceleration
        of the state."""
        rng, worst = np.random.default_rng(SEED), 0.0
        for _ in range(state_count):
            q, v = rng.uniform(-0.05, 0.05, self.free_model.size), rng.uniform(-0.5, 0.5, self.free_model.size)
            expected = self.system_model.acceleration(0.0, q, v)
            free = self.sign * self.free_model.acceleration(0.0, self.sign * q, self.sign * v)
            worst = max(worst, float(np.abs(free - expected).max() / np.abs(expected).max()))
        return worst


def ride_vehicle() -> SpatialVehicle:
    """The ride vehicle of 19 degrees of freedom without anti-roll bars."""
    return replace(load_vehicle("r19_ride"), bars=())


def ride_builds(engine: str) -> TwoBuilds:
    """The ride vehicle in an engine, built by the builder of ride and by that of free vehicles."""
    vehicle, settings = ride_vehicle(), Settings(INTEGRATORS[engine], STEP, STEPS * STEP)
    return TwoBuilds(in_space(engine, vehicle, settings), free_model(engine, driven_vehicle(vehicle), settings))


def pitch_plane_builds(engine: str) -> TwoBuilds:
    """The pitch-plane vehicle on its tyres in an engine, built by its system's builder and by that of free vehicles.
    Its coordinates are positive down, those of the free vehicle up."""
    settings = Settings(INTEGRATORS[engine], STEP, STEPS * STEP)
    scene = pitch_plane_scene({"title": "free", "run": {"duration": STEPS * STEP, "step": STEP}})
    assembly = replace(assembly_of_scene(scene), mode="free", input=None, initial=np.zeros(8))
    free = free_model(engine, driven_vehicle(_vehicle_in_space(assembly.vehicle), assembly.vehicle.gravity), settings)
    return TwoBuilds(in_plane(engine, assembly, settings), free, -1.0)


def _vehicle_in_space(pitch_plane_vehicle: PlaneVehicle) -> SpatialVehicle:
    """Description in space of a pitch-plane vehicle."""
    bodies = tuple(
        Body(body.name, body.mass, (0.0, 0.0, 0.0), ("z",))
        if body.pitch_inertia is None
        else Body(
            body.name, body.mass, (0.0, 0.0, 0.0), ("z", "ry"), ((0, 0, 0), (0, body.pitch_inertia, 0), (0, 0, 0))
        )
        for body in pitch_plane_vehicle.bodies
    )
    struts_between_bodies = [strut for strut in pitch_plane_vehicle.struts if strut.lower.body is not None]
    springs = tuple(
        SpringDamper(
            s.name,
            str(s.lower.body),
            s.upper.body,
            (s.lower.x, 0, 0),
            (s.upper.x, 0, 0),
            UPWARD,
            s.stiffness,
            s.damping,
        )
        for s in struts_between_bodies
    )
    tyres = tuple(
        Tyre(s.name, str(s.upper.body), (s.upper.x, 0.0, 0.0), i, s.stiffness, s.damping)
        for i, s in enumerate(pitch_plane_vehicle.tyres)
    )
    return SpatialVehicle("pitch plane", bodies, springs, tyres, (0.0,))


def driven_vehicle(vehicle: SpatialVehicle, gravity: float = 0.0) -> LoadedVehicle:
    """A vehicle on a flat road with its compiled forces, as the builder of free vehicles takes it."""
    tree = replace(vehicle, springs=(), bars=(), tyres=(), side_forces=(), drags=(), outputs=())
    numbers = _force_table(tree, vehicle)
    return LoadedVehicle(tree, np.array([0.0, 0.0, -gravity]), numbers, joint_forces, set_joint_forces)


def _force_table(tree_vehicle: SpatialVehicle, force_vehicle: SpatialVehicle) -> np.ndarray:
    """Parameter table for the compiled forces; all spring axes are fixed in space, and tyres act against the ground."""
    springs = [
        _spring_element(s.name, s.first_body, str(s.second_body), s, s.first_point, s.second_point, s.axis)
        for s in force_vehicle.springs
    ]
    tyres = [_spring_element(t.name, t.body, t.body, t, t.point, t.point, UPWARD) for t in force_vehicle.tyres]
    cut_vehicle = CutVehicle(force_vehicle.bodies[0].name, tree_vehicle, tree_vehicle, (*springs, *tyres), np.zeros(0))
    numbers = cut_vehicle_table(cut_vehicle, HubInputs(np.zeros((3, 0))), STEP)
    rows, numbers[CHASSIS] = table_views(numbers)[3], -1.0
    rows[:, AXIS_JOINT] = -1.0
    for row, tyre in zip(rows[len(springs) :], force_vehicle.tyres, strict=True):
        row[FIRST_BODY], row[FIRST_POINT:SECOND_BODY] = -1.0, tyre.point
    return numbers


def _spring_element(
    element_name: str,
    first_body: str,
    second_body: str,
    spring_or_tyre: SpringDamper | Tyre,
    start_point: Vector,
    end_point: Vector,
    axis: Vector,
) -> CutVehicleElement:
    vectors = (np.array(start_point, float), np.array(end_point, float), np.array(axis, float))
    return CutVehicleElement(
        element_name,
        first_body,
        second_body,
        *vectors,
        spring_or_tyre.stiffness,
        spring_or_tyre.damping,
        0.0,
        second_body,
    )


@contextmanager
def single_tree_context() -> Iterator[None]:
    """Context in which the builder of ride in Exudyn makes a single kinematic tree of all bodies; springs and callbacks
    are unchanged."""
    with mock.patch.object(spatial_exudyn_build, "_trees", lambda vehicle: [list(vehicle.bodies)]):
        yield


def time_ratios(round_count: int, minimum_seconds: float) -> dict[str, tuple[float, float, float]]:
    """Ratios of the processor time of a run with another builder to that with the system's builder, each with its
    interval (ratio, low, high)."""
    jobs, names = list[Callable[[], Any]](), list[str]()
    for engine in INTEGRATORS:
        for system, sides in (("ride", ride_builds(engine)), ("pitch plane", pitch_plane_builds(engine))):
            jobs += [sides.system_model.run, sides.free_model.run]
            names.append(f"{system}, {engine}: the free builder to today's")
    with single_tree_context():
        jobs += [ride_builds("exudyn").system_model.run]
    seconds = interleave(jobs, round_count, minimum_seconds, clock=time.process_time)
    ratios = {name: paired_ratio(seconds[2 * i + 1], seconds[2 * i]) for i, name in enumerate(names)}
    return ratios | {"ride, exudyn: one tree, springs of today, to today's": paired_ratio(seconds[-1], seconds[0])}


if __name__ == "__main__":
    for each_engine in INTEGRATORS:
        for each in (ride_builds, pitch_plane_builds):
            print(f"{each.__name__}, {each_engine}: accelerations apart by {each(each_engine).gap(100):.1e}")
    for each_name, (middle, low, high) in time_ratios(15, 0.1).items():
        print(f"{each_name}: {middle:.2f} ({low:.2f} to {high:.2f})")
