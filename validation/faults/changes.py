"""Changes that plant a fault in an engine's inputs: the description of the pitch-plane vehicle, or its excitation."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from models.engines.assembly import Assembly
from models.road.iso8608 import iso8608_road
from models.vehicles.description import PitchSpring, PlaneBody, PlaneVehicle, Point, Strut

AssemblyChange = Callable[[Assembly], Assembly]


def unchanged(assembly: Assembly) -> Assembly:
    """Returns the assembly unchanged, as a control without a fault."""
    return assembly


def changed_vehicle_of(change_vehicle: Callable[[PlaneVehicle], PlaneVehicle]) -> AssemblyChange:
    """Fault: the vehicle's description is changed."""
    return lambda assembly: replace(assembly, vehicle=change_vehicle(assembly.vehicle))


def replaced_struts(change_strut: Callable[[Strut, dict[str, Strut]], Strut]) -> AssemblyChange:
    """Fault: each strut is replaced by change_strut(strut, struts), where ``struts`` are all struts of the vehicle by
    name."""

    def changed(original_vehicle: PlaneVehicle) -> PlaneVehicle:
        named = {strut.name: strut for strut in original_vehicle.struts}
        return replace(original_vehicle, struts=tuple(change_strut(strut, named) for strut in original_vehicle.struts))

    return changed_vehicle_of(changed)


def replaced_bodies(change_body: Callable[[PlaneBody, dict[str, PlaneBody]], PlaneBody]) -> AssemblyChange:
    """Fault: each body is replaced by change_body(body, bodies), where ``bodies`` are all bodies of the vehicle by
    name."""

    def changed(original_vehicle: PlaneVehicle) -> PlaneVehicle:
        named = {body.name: body for body in original_vehicle.bodies}
        return replace(original_vehicle, bodies=tuple(change_body(body, named) for body in original_vehicle.bodies))

    return changed_vehicle_of(changed)


def with_moved_points(position_of: Callable[[float, float, float], float]) -> AssemblyChange:
    """Fault: suspension points and axles are at position_of(x, a, b) instead of x (m)."""

    def changed(assembly: Assembly) -> Assembly:
        p, changed_vehicle = assembly.parameters, assembly.vehicle
        moved_struts = tuple(
            replace(strut, upper=_point_moved_to(strut.upper, position_of(strut.upper.x, p.a, p.b)))
            for strut in changed_vehicle.struts
        )
        axles = tuple(replace(axle, x=position_of(axle.x, p.a, p.b)) for axle in changed_vehicle.axles)
        return replace(assembly, vehicle=replace(changed_vehicle, struts=moved_struts, axles=axles))

    return changed


def _point_moved_to(point: Point, x: float) -> Point:
    return replace(point, x=x) if point.body == "chassis" else point


def swapped_struts(first_strut: str, second_strut: str) -> AssemblyChange:
    """Fault: stiffness and damping of two struts are exchanged."""

    def change(strut: Strut, all_struts: dict[str, Strut]) -> Strut:
        source = all_struts.get(
            {first_strut: second_strut, second_strut: first_strut}.get(strut.name, strut.name), strut
        )
        return replace(strut, stiffness=source.stiffness, damping=source.damping)

    return replaced_struts(change)


def stiffened_strut(strut_name: str, factor: float) -> AssemblyChange:
    """Fault: the stiffness of one strut is multiplied by a factor."""
    return replaced_struts(lambda s, named: replace(s, stiffness=factor * s.stiffness) if s.name == strut_name else s)


def undamped_tyre(strut: Strut, all_struts: dict[str, Strut]) -> Strut:
    """Fault: a tyre has no damping."""
    return replace(strut, damping=0.0) if strut.name.startswith("tyre") else strut


def swapped_wheel(body: PlaneBody, all_bodies: dict[str, PlaneBody]) -> PlaneBody:
    """Fault: a wheel has the mass of the other wheel."""
    other_wheel = {"wheel1": "wheel2", "wheel2": "wheel1"}.get(body.name, body.name)
    return replace(body, mass=all_bodies[other_wheel].mass)


def mixed_inertia(body: PlaneBody, all_bodies: dict[str, PlaneBody]) -> PlaneBody:
    """Fault: mass and inertia of the chassis are exchanged."""
    return body if body.pitch_inertia is None else replace(body, mass=body.pitch_inertia, pitch_inertia=body.mass)


def inertia_about_axle(assembly: Assembly) -> Assembly:
    """Fault: the pitch inertia is taken about the front axle instead of the centre of mass."""
    b = assembly.parameters.b

    def change(body: PlaneBody, all_bodies: dict[str, PlaneBody]) -> PlaneBody:
        axle_inertia = None if body.pitch_inertia is None else body.pitch_inertia + body.mass * b**2
        return replace(body, pitch_inertia=axle_inertia)

    return replaced_bodies(change)(assembly)


def unstressed_start(assembly: Assembly) -> Assembly:
    """Fault: heave starts at zero instead of the static equilibrium."""
    start = assembly.initial.copy()
    start[:3] = 0.0
    return replace(assembly, initial=start)


def body_fixed_forces(assembly: Assembly) -> Assembly:
    """Fault: wheel forces turn with the chassis, although vertical forces were specified."""
    return replace(assembly, mode="force-body") if assembly.mode == "force" else assembly


SignalChange = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class AlteredSignal:
    """Fault: a signal has a delay (s), and its values (n, channels) are replaced by change(values)."""

    signal: Any
    delay: float = 0.0
    change: SignalChange = field(default=lambda values: values)

    def __getattr__(self, attribute_name: str) -> Any:
        return getattr(self.signal, attribute_name)

    def sample(self, start_time: float, step: float, sample_count: int) -> np.ndarray:
        """Values (sample_count, channels) of the altered signal at start_time + i step (s)."""
        return self.change(self.signal.sample(start_time - self.delay, step, sample_count))

    def at(self, time: float) -> np.ndarray:
        """Values (channels,) of the altered signal at a time (s)."""
        return self.change(self.signal.at(time - self.delay)[None, :])[0]


@dataclass(frozen=True)
class HeldStages(AlteredSignal):
    """Fault: a signal's value in the middle of a step equals its value at the step's start."""

    def sample(self, start_time: float, step: float, sample_count: int) -> np.ndarray:
        """Values (sample_count, channels) at start_time + i step (s), where every second value repeats the previous
        one."""
        values = self.signal.sample(start_time, step, sample_count)
        values[1::2] = values[:-1:2]
        return values


@dataclass(frozen=True)
class OtherTrack(AlteredSignal):
    """Fault: the road is a single track instead of the mean of both; it differs from the mean by a class A road."""

    def sample(self, start_time: float, step: float, sample_count: int) -> np.ndarray:
        """Road (sample_count, 4) at start_time + i step (s): heights under the front and the rear wheel (m), then their
        rates (m/s)."""
        return self.signal.sample(start_time, step, sample_count) + self._other_profile().sample(
            start_time, step, sample_count
        )

    def at(self, time: float) -> np.ndarray:
        """Road (4,) at a time (s): heights under the front and the rear wheel (m), then their rates (m/s)."""
        return self.signal.at(time) + self._other_profile().at(time)

    def _other_profile(self) -> Any:
        return replace(self.signal, profile=iso8608_road("A", 1))


def replaced_input(excitation_modes: tuple[str, ...], change_signal: Callable[[Any], Any]) -> AssemblyChange:
    """Fault: the input signal is replaced by change_signal(signal), if the vehicle is excited in one of the modes."""

    def changed(assembly: Assembly) -> Assembly:
        if assembly.input is None or assembly.mode not in excitation_modes:
            return assembly
        return replace(assembly, input=change_signal(assembly.input))

    return changed


def replaced_channels(excitation_modes: tuple[str, ...], change_values: SignalChange) -> AssemblyChange:
    """Fault: the input's values are replaced by change_values(values)."""
    return replaced_input(excitation_modes, lambda signal: AlteredSignal(signal, 0.0, change_values))


def multiplied_channels(factor_of_channel: dict[int, float]) -> SignalChange:
    """Returns a function that multiplies channels of a signal by factors (channel number -> factor)."""

    def change(channel_values: np.ndarray) -> np.ndarray:
        changed_values = channel_values.copy()
        for channel, factor in factor_of_channel.items():
            changed_values[:, channel] *= factor
        return changed_values

    return change


def replaced_springs(change_spring: Callable[[PitchSpring], PitchSpring]) -> AssemblyChange:
    """Fault: every pitch spring is replaced by change_spring(spring)."""
    return changed_vehicle_of(
        lambda original: replace(
            original, pitch_springs=tuple(change_spring(spring) for spring in original.pitch_springs)
        )
    )


def front_values_at_rear(channel_values: np.ndarray) -> np.ndarray:
    """Fault: the rear channel has the values of the front channel."""
    return channel_values[:, [0, 0, *range(2, channel_values.shape[1])]]


def changed_moment(delay_periods: float, change_values: SignalChange = lambda values: values) -> AssemblyChange:
    """Fault: the added moment is delayed by a fraction of its sampling period, and its values are changed."""

    def changed(assembly: Assembly) -> Assembly:
        signal = assembly.moment
        if signal is None:
            return assembly
        return replace(assembly, moment=AlteredSignal(signal, delay_periods * (signal.period or 0.0), change_values))

    return changed


def with_late_input(delay_periods: float, step: float = 1e-3) -> AssemblyChange:
    """Fault: the input is delayed by a fraction of its sampling period, or of a 1 ms step if it is not sampled."""
    return replaced_input(
        ("road", "force", "pitch"), lambda signal: AlteredSignal(signal, delay_periods * (signal.period or step))
    )


def scaled_road(**parameter_factors: float) -> AssemblyChange:
    """Fault: parameters of the road signal (speed, wheelbase) are multiplied by factors."""
    return replaced_input(
        ("road",),
        lambda signal: replace(
            signal, **{name: factor * getattr(signal, name) for name, factor in parameter_factors.items()}
        ),
    )
