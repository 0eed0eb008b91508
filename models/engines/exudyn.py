"""The pitch-plane vehicle in Exudyn: native bodies and spring-dampers, a constraint for a prescribed pitch.

Exudyn's plane is x-y with rotation from x to y. The description's x forward, z down, nose-up pitch
becomes x **backward**, y down: then a positive rotation lifts the front, as it should.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import exudyn as exu
import numpy as np

from models.core.trajectory import Trajectory
from models.engines.assembly import Assembly, Settings
from models.engines.exudyn_clock import SignalClock
from models.engines.exudyn_system import (
    KINDS,
    add_state_sensors,
    items,
    march_settings,
    mass_and_force,
    set_start,
    solve,
    solver_counts,
)
from models.engines.protocol import check_balance, check_landings, check_trajectory
from models.vehicles.description import PitchSpring, PlaneVehicle, Point, Strut, mass_damping_stiffness

Reader = Callable[[Any, float, float], float]
"""Function that Exudyn calls at a stage's time: (system, time in s, constant load) -> value."""


@dataclass
class PitchPlaneBuild:
    """Exudyn's system of a pitch-plane vehicle while it is being built, with handles of its items.

    coordinate_markers maps (body, "z" or "pitch") to a coordinate marker, nodes a body's name to its node.
    """

    container: Any
    mbs: Any
    coordinate_markers: dict[tuple[str, str], Any] = field(default_factory=dict)
    nodes: dict[str, Any] = field(default_factory=dict)
    callbacks: int = 0


def _exact_bodies(assembly: Assembly) -> PitchPlaneBuild:
    """The vehicle as point masses, a rigid body, and vertical springs between points: exact in sin and cos of the
    pitch."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    built = PitchPlaneBuild(container, mbs)
    bodies: dict[str | None, Any] = {None: mbs.AddObject(items.ObjectGround())}
    for body in assembly.vehicle.bodies:
        if body.pitch_inertia is None:
            node = mbs.AddNode(items.NodePoint2D())
            item: Any = items.MassPoint2D(nodeNumber=node, mass=body.mass)
        else:
            node = mbs.AddNode(items.NodeRigidBody2D())
            item = items.RigidBody2D(nodeNumber=node, mass=body.mass, inertia=body.pitch_inertia)
        bodies[body.name] = mbs.AddObject(item)
        if body.pitch_inertia is not None:
            built.coordinate_markers[body.name, "pitch"] = _marker(mbs, node, 2)
        built.nodes[body.name] = node
        built.coordinate_markers[body.name, "z"] = _marker(mbs, node, 1)
        weight = body.mass * assembly.vehicle.gravity
        mbs.AddLoad(items.LoadCoordinate(markerNumber=built.coordinate_markers[body.name, "z"], load=weight))

    def end_marker(point: Point) -> Any:  # x is counted backward in Exudyn's plane
        return mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=bodies[point.body], localPosition=[-point.x, 0, 0]))

    for strut in (strut for strut in assembly.vehicle.struts if not strut.pushes_only):
        mbs.AddObject(
            items.CartesianSpringDamper(
                name=f"strut {strut.name!r}",
                markerNumbers=[end_marker(strut.lower), end_marker(strut.upper)],
                stiffness=[0, strut.stiffness, 0],
                damping=[0, strut.damping, 0],
            )
        )
    for spring in assembly.vehicle.pitch_springs:
        _add_pitch_spring(built, spring)
    return built


def ground_marker(mbs: Any) -> Any:
    """Marker of a new coordinate that is fixed to the ground."""
    return _marker(mbs, mbs.AddNode(items.NodePointGround()), 0)


def _marker(mbs: Any, node: Any, coordinate_index: int) -> Any:
    """Marker of one coordinate of a node."""
    return mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate_index))


def _add_ground_spring(
    exudyn_build: PitchPlaneBuild, coordinate: tuple[str, str], element: Strut | PitchSpring, force_law: Any = None
) -> None:
    """Add a spring and damper between a coordinate and the ground; ``force_law`` replaces their force."""
    keywords = {} if force_law is None else {"springForceUserFunction": force_law}
    exudyn_build.callbacks += len(keywords)
    exudyn_build.mbs.AddObject(
        items.CoordinateSpringDamper(
            markerNumbers=[ground_marker(exudyn_build.mbs), exudyn_build.coordinate_markers[coordinate]],
            stiffness=element.stiffness,
            damping=element.damping,
            **keywords,
        )
    )


def _add_pitch_spring(exudyn_build: PitchPlaneBuild, pitch_spring: PitchSpring) -> None:
    """Add a pitch spring between chassis and ground; one with a dead band gets a force law as a callback.

    Exudyn has limit stops, but checks only once per step whether one is touched, not at every stage.
    """

    def moment(mbs: Any, t: float, item: int, angle: float, rate: float, *law: float) -> float:
        (k, d, _), beyond = law, abs(angle) - pitch_spring.dead_band
        return k * math.copysign(beyond, angle) + d * rate if beyond >= 0 else 0.0

    _add_ground_spring(
        exudyn_build, (pitch_spring.body, "pitch"), pitch_spring, moment if pitch_spring.dead_band else None
    )


def _add_pushing_tyre(exudyn_build: PitchPlaneBuild, tyre: Strut, read_height: Reader, read_rate: Reader) -> None:
    """Add a tyre that can lift off, on a road of given height (m, down) and rate, with a callback: Exudyn has no item
    that switches within a step."""

    def force(mbs: Any, t: float, item: int, position: float, speed: float, *law: float) -> float:
        k, d, _ = law
        pressed = k * (position - read_height(mbs, t, 0.0))
        return max(min(pressed + d * (speed - read_rate(mbs, t, 0.0)), 2.0 * pressed), 0.0)

    _add_ground_spring(exudyn_build, (str(tyre.upper.body), "z"), tyre, force)


def _linear_vehicle(assembly: Assembly) -> PitchPlaneBuild:
    """The vehicle linearised about zero pitch, as one object with constant mass, damping and stiffness matrices."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    linear = tuple(strut for strut in assembly.vehicle.struts if not strut.pushes_only)
    mass, damping, stiffness = mass_damping_stiffness(replace(assembly.vehicle, struts=linear))
    zero = [0.0] * len(mass)
    start = dict.fromkeys(("referenceCoordinates", "initialCoordinates", "initialCoordinates_t"), zero)
    node = mbs.AddNode(items.NodeGenericODE2(**start, numberOfODE2Coordinates=len(mass)))
    weight = [body.mass * assembly.vehicle.gravity for body in assembly.vehicle.bodies]
    mbs.AddObject(
        items.ObjectGenericODE2(
            nodeNumbers=[node],
            massMatrix=mass,
            dampingMatrix=damping,
            stiffnessMatrix=stiffness,
            forceVector=[*weight, *zero[len(weight) :]],
        )
    )
    places = {place: _marker(mbs, node, i) for i, place in enumerate(assembly.vehicle.coordinates())}
    built = PitchPlaneBuild(container, mbs, places, {"vehicle": node})
    for spring in (spring for spring in assembly.vehicle.pitch_springs if spring.dead_band):
        _add_pitch_spring(built, spring)
    return built


def native_elements(assembly: Assembly) -> PitchPlaneBuild:
    """Bodies, weights, springs and dampers without any input, in an Exudyn system that is not yet assembled."""
    return _exact_bodies(assembly) if assembly.vehicle.geometry == "exact" else _linear_vehicle(assembly)


def coordinate_indices(exudyn_build: PitchPlaneBuild, vehicle: PlaneVehicle) -> list[int]:
    """Index of each of the four coordinates in Exudyn's vector, once the system is assembled."""
    if vehicle.geometry == "linear":
        return [0, 1, 2, 3]
    start = {name: exudyn_build.mbs.GetNodeODE2Index(node) for name, node in exudyn_build.nodes.items()}
    return [start[body] + (1 if kind == "z" else 2) for body, kind in vehicle.coordinates()]


def _apply_input(exudyn_build: PitchPlaneBuild, assembly: Assembly, signal_clock: SignalClock) -> None:
    """Apply the input signal as loads on the wheels, and on the chassis as well if forces act along its own axis."""
    if signal_clock.held:
        exudyn_build.mbs.SetPreStepUserFunction(signal_clock.advance)
        exudyn_build.callbacks += 1
    tyres = {tyre.upper.body: tyre for tyre in assembly.vehicle.tyres}
    for i, axle in enumerate(assembly.vehicle.axles):
        if assembly.mode == "road":
            tyre = tyres[axle.wheel]
            if tyre.pushes_only:
                continue
            _add_load(exudyn_build, (axle.wheel, "z"), signal_clock.reader(i, tyre.stiffness))
            _add_load(exudyn_build, (axle.wheel, "z"), signal_clock.reader(2 + i, tyre.damping))
        elif assembly.mode == "force-body":
            _add_body_fixed_force(exudyn_build, axle.wheel, axle.x, signal_clock.reader(i, 1.0))
        else:
            _add_load(exudyn_build, (axle.wheel, "z"), signal_clock.reader(i, -1.0))


def _flat_road(mbs: Any, t: float, load: float) -> float:
    """Height and rate of a flat road (0), for a vehicle without road input."""
    return 0.0


def _add_load(exudyn_build: PitchPlaneBuild, coordinate: tuple[str, str], load_function: Any) -> None:
    """Add a load on a coordinate whose value (N, N m) a function gives."""
    exudyn_build.mbs.AddLoad(
        items.LoadCoordinate(
            markerNumber=exudyn_build.coordinate_markers[coordinate], load=0.0, loadUserFunction=load_function
        )
    )
    exudyn_build.callbacks += 1


def _add_body_fixed_force(
    exudyn_build: PitchPlaneBuild, wheel_body: str, axle_position: float, read_force: Reader
) -> None:
    """Apply a wheel force f (up) along the chassis' vertical axis: the force f cos(pitch) on the wheel, and the pitch
    moment f x sin(pitch)^2 on the chassis."""
    node = exudyn_build.nodes["chassis"]

    def pitch(mbs: Any) -> float:
        return mbs.GetNodeOutput(node, KINDS.Coordinates)[2]

    _add_load(exudyn_build, (wheel_body, "z"), lambda mbs, t, load: -read_force(mbs, t, load) * np.cos(pitch(mbs)))
    _add_load(
        exudyn_build,
        ("chassis", "pitch"),
        lambda mbs, t, load: axle_position * read_force(mbs, t, load) * np.sin(pitch(mbs)) ** 2,
    )


def _add_constraints(exudyn_build: PitchPlaneBuild, assembly: Assembly, run_settings: Settings) -> list[Any]:
    """Add constraints, which have Lagrange multipliers, for the prescribed coordinates; returns the constraints."""
    if not assembly.guided or assembly.input is None:
        return []
    table = assembly.input.sample(0.0, run_settings.step / 2, 2 * run_settings.steps + 1).T.tolist()
    places = [assembly.vehicle.coordinates()[i] for i in assembly.guided]
    paths, rates = table[2 : 2 + len(places)], table[2 + len(places) :]
    return [
        _add_constraint(exudyn_build, *path, 2.0 / run_settings.step)
        for path in zip(places, paths, rates, strict=False)
    ]


def _add_constraint(
    exudyn_build: PitchPlaneBuild,
    coordinate: tuple[str, str],
    half_step_positions: list[float],
    half_step_rates: list[float],
    rows_per_second: float,
) -> Any:
    """Add a constraint by which a coordinate follows a path given at half steps."""
    exudyn_build.callbacks += 2
    return exudyn_build.mbs.AddObject(
        items.CoordinateConstraint(
            markerNumbers=[ground_marker(exudyn_build.mbs), exudyn_build.coordinate_markers[coordinate]],
            offsetUserFunction=lambda mbs, t, item, offset: half_step_positions[round(t * rows_per_second)],
            offsetUserFunction_t=lambda mbs, t, item, offset: half_step_rates[round(t * rows_per_second)],
        )
    )


class ExudynModel:
    """Model of one pitch-plane assembly in an Exudyn system."""

    def __init__(self, assembly: Assembly, run_settings: Settings) -> None:
        self.assembly, self.settings = assembly, run_settings
        self.built = native_elements(assembly)
        if assembly.input is not None:
            self.clock = SignalClock(assembly.input, run_settings)
            _apply_input(self.built, assembly, self.clock)
        for i, tyre in enumerate(tyre for tyre in assembly.vehicle.tyres if tyre.pushes_only):
            flat = assembly.input is None
            height, rate = (
                (_flat_road, _flat_road) if flat else (self.clock.reader(i, 1.0), self.clock.reader(2 + i, 1.0))
            )
            _add_pushing_tyre(self.built, tyre, height, rate)
        if assembly.moment is not None:
            _add_load(self.built, ("chassis", "pitch"), SignalClock(assembly.moment, run_settings).reader(0, 1.0))
        self.constraints = _add_constraints(self.built, assembly, run_settings)
        p = assembly.parameters
        self._inertia = np.array([p.m1, p.m2, p.m3, p.I])[list(assembly.guided)]
        mbs, kept = self.built.mbs, {"storeInternal": True, "writeToFile": False}
        self._sensors = add_state_sensors(mbs, self.built.nodes.values())
        self._multipliers = [
            mbs.AddSensor(items.SensorObject(objectNumber=constraint, outputVariableType=KINDS.Force, **kept))
            for constraint in self.constraints
        ]
        mbs.Assemble()
        self._columns = coordinate_indices(self.built, assembly.vehicle)
        self._set_state(*np.split(assembly.initial, 2))

    def _set_state(self, q: np.ndarray, v: np.ndarray) -> None:
        """Set the initial coordinates and rates (4,) of the system."""
        whole = np.zeros((2, self.built.mbs.systemData.ODE2Size()))
        whole[:, self._columns] = q, v
        set_start(self.built.mbs, *whole)

    def acceleration(self, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (4,) at a time (s), from coordinates and rates (4,) by Exudyn's own residual and mass
        matrix."""
        accelerations = self._free_acceleration(time, q, v)
        accelerations[list(self.assembly.guided)] = self._prescribed_accelerations(time)
        return accelerations

    def _prescribed_accelerations(self, time: float) -> np.ndarray:
        """Accelerations of the prescribed coordinates at a time (s); empty if there are none."""
        signal, count = self.assembly.input, len(self.assembly.guided)
        return np.empty(0) if not count or signal is None else signal.at(time)[-count:]

    def _free_acceleration(self, time: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Accelerations (4,) of the vehicle if nothing enforced the prescribed coordinates."""
        self._set_state(q, v)
        if self.assembly.input is not None:
            self.clock.step = min(int(time / self.settings.step + 1e-6), self.settings.steps - 1)
        mass_force = mass_and_force(self.built.mbs, time)
        self._set_state(*np.split(self.assembly.initial, 2))
        return np.linalg.solve(*mass_force)[self._columns]

    def plan(self) -> dict[str, int]:
        """Counts of built items: degrees of freedom, native items, callbacks."""
        data = self.built.mbs.systemData
        return {
            "degrees of freedom": 4,
            "native items": data.NumberOfObjects() + data.NumberOfLoads(),
            "callbacks": self.built.callbacks,
        }

    def run(self) -> Trajectory:
        """Trajectory over the whole duration; raises RunFailed unless it is complete and finite."""
        options = march_settings(self.settings)
        if self.assembly.input is not None:
            self.clock.step = 0  # a run before this one has left it at its own last sample
        if self.constraints:
            self._consistent_start(options)
        note = solve(self.built.mbs, self.settings, options)
        times, states = self._recorded_states()
        enforced = self._enforced()
        check_trajectory("exudyn", times, states, self.settings.duration, note, enforced)
        check_landings("exudyn", self.assembly, self.settings, times, states)
        counts = solver_counts(self.built.mbs)
        if enforced is not None:
            check_balance("exudyn", times, enforced, lambda i: self._balance(times[i], states[i]))
        return Trajectory(times, states, enforced, counts)

    def _balance(self, time: float, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forces and moments (N, N m) that enforce the prescribed coordinates at a time (s) and state (8,), and the
        inertia terms of the same coordinates."""
        wanted, free = (
            self._prescribed_accelerations(time),
            self._free_acceleration(time, *np.split(state, 2))[list(self.assembly.guided)],
        )
        return self._inertia * (wanted - free), self._inertia * wanted

    def _consistent_start(self, solver_options: Any) -> None:
        """Set initial accelerations that are consistent with the prescribed coordinates.

        Exudyn leaves the constraint's own acceleration out of its initial values; the multiplier then
        rings, or never forgets the error.
        """
        self._first = self._balance(0.0, self.assembly.initial)[0]
        data, initial = self.built.mbs.systemData, exu.ConfigurationType.Initial
        all_of_them = np.zeros(data.ODE2Size())
        all_of_them[self._columns] = self.acceleration(0.0, *np.split(self.assembly.initial, 2))
        data.SetODE2Coordinates_tt(all_of_them, initial)
        solver_options.timeIntegration.generalizedAlpha.computeInitialAccelerations = False
        solver_options.timeIntegration.generalizedAlpha.resetAccelerations = False

    def _recorded_states(self) -> tuple[np.ndarray, np.ndarray]:
        """Times (n,) and states (n, 8) as the sensors stored them; Exudyn's y is the heave, its rotation the pitch."""
        read = self.built.mbs.GetSensorStoredData
        halves = [[read(sensor) for sensor in sensors] for sensors in self._sensors]
        times = halves[0][0][:, 0]
        if self.assembly.vehicle.geometry == "linear":
            return times, np.hstack([half[0][:, 1:] for half in halves])
        states = [column for front, rear, body in halves for column in (front[:, 2], rear[:, 2], *body[:, 2:].T)]
        grid = self.settings.step * np.arange(len(times))  # Exudyn adds up its steps and ends 1e-13 early
        fixed = np.allclose(times, grid, rtol=0, atol=1e-9 * max(1.0, self.settings.duration))
        return grid if fixed else times, np.column_stack(states)

    def _enforced(self) -> np.ndarray | None:
        """Force and moment (n, constraints) that enforce the prescribed coordinates: the Lagrange multipliers, with the
        sign of loads on the chassis.

        Exudyn has no multipliers at t = 0 yet; those follow from the accelerations of the start.
        """
        if not self.constraints:
            return None
        read = self.built.mbs.GetSensorStoredData
        enforced = -np.column_stack([read(sensor)[:, 1] for sensor in self._multipliers])
        enforced[0] = self._first
        return enforced


def build(assembly: Assembly, run_settings: Settings) -> ExudynModel:
    """The Exudyn model of a pitch-plane assembly."""
    return ExudynModel(assembly, run_settings)
