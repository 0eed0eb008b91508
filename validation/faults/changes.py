"""Changes that plant a fault in what an engine is given: the description of the vehicle, or its input."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from models.engines.assembly import Assembly
from models.road.iso8608 import iso8608_road
from models.vehicles.description import Body, PitchSpring, Point, Strut, Vehicle

Change = Callable[[Assembly], Assembly]


def unchanged(assembly: Assembly) -> Assembly:
    """No change."""
    return assembly


def vehicle(change: Callable[[Vehicle], Vehicle]) -> Change:
    """The description changed."""
    return lambda assembly: replace(assembly, vehicle=change(assembly.vehicle))


def struts(change: Callable[[Strut, dict[str, Strut]], Strut]) -> Change:
    """Each strut changed, with all struts of the vehicle at hand by name."""

    def changed(original: Vehicle) -> Vehicle:
        named = {strut.name: strut for strut in original.struts}
        return replace(original, struts=tuple(change(strut, named) for strut in original.struts))

    return vehicle(changed)


def bodies(change: Callable[[Body, dict[str, Body]], Body]) -> Change:
    """Each body changed, with all bodies of the vehicle at hand by name."""

    def changed(original: Vehicle) -> Vehicle:
        named = {body.name: body for body in original.bodies}
        return replace(original, bodies=tuple(change(body, named) for body in original.bodies))

    return vehicle(changed)


def with_moved_points(position_of: Callable[[float, float, float], float]) -> Change:
    """Suspension points and axles at place(x, a, b) instead of x (m)."""

    def changed(assembly: Assembly) -> Assembly:
        p, changed_vehicle = assembly.parameters, assembly.vehicle
        held = tuple(
            replace(strut, upper=_point_moved_to(strut.upper, position_of(strut.upper.x, p.a, p.b)))
            for strut in changed_vehicle.struts
        )
        axles = tuple(replace(axle, x=position_of(axle.x, p.a, p.b)) for axle in changed_vehicle.axles)
        return replace(assembly, vehicle=replace(changed_vehicle, struts=held, axles=axles))

    return changed


def _point_moved_to(point: Point, x: float) -> Point:
    return replace(point, x=x) if point.body == "chassis" else point


def swapped(first: str, other_strut: str) -> Change:
    """Stiffness and damping of two struts exchanged."""

    def change(strut: Strut, struts: dict[str, Strut]) -> Strut:
        source = struts.get({first: other_strut, other_strut: first}.get(strut.name, strut.name), strut)
        return replace(strut, stiffness=source.stiffness, damping=source.damping)

    return struts(change)


def stiffened(name: str, factor: float) -> Change:
    """One strut's stiffness times a factor."""
    return struts(lambda s, named: replace(s, stiffness=factor * s.stiffness) if s.name == name else s)


def undamped_tyre(strut: Strut, struts: dict[str, Strut]) -> Strut:
    """A tyre without its damping."""
    return replace(strut, damping=0.0) if strut.name.startswith("tyre") else strut


def swapped_wheel(body: Body, bodies: dict[str, Body]) -> Body:
    """A wheel with the mass of the other one."""
    other = {"wheel1": "wheel2", "wheel2": "wheel1"}.get(body.name, body.name)
    return replace(body, mass=bodies[other].mass)


def mixed_inertia(body: Body, bodies: dict[str, Body]) -> Body:
    """The chassis with its inertia for its mass, and the other way round."""
    return body if body.pitch_inertia is None else replace(body, mass=body.pitch_inertia, pitch_inertia=body.mass)


def inertia_about_axle(assembly: Assembly) -> Assembly:
    """Pitch inertia about the front axle instead of the centre of mass."""
    b = assembly.parameters.b

    def change(body: Body, bodies: dict[str, Body]) -> Body:
        about = None if body.pitch_inertia is None else body.pitch_inertia + body.mass * b**2
        return replace(body, pitch_inertia=about)

    return bodies(change)(assembly)


def unstressed_start(assembly: Assembly) -> Assembly:
    """Heave starts at zero instead of the static equilibrium."""
    start = assembly.initial.copy()
    start[:3] = 0.0
    return replace(assembly, initial=start)


def body_fixed(assembly: Assembly) -> Assembly:
    """Wheel forces that turn with the chassis where vertical ones were asked for."""
    return replace(assembly, mode="force-body") if assembly.mode == "force" else assembly


Values = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class AlteredSignal:
    """A signal read ``late`` (s) and passed through ``change``, values (n, channels) -> values."""

    signal: Any
    late: float = 0.0
    change: Values = field(default=lambda values: values)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.signal, name)

    def sample(self, start: float, step: float, count: int) -> np.ndarray:
        """Values at start + i step, shape (count, channels)."""
        return self.change(self.signal.sample(start - self.late, step, count))

    def at(self, time: float) -> np.ndarray:
        """Values at one time (s), shape (channels,)."""
        return self.change(self.signal.at(time - self.late)[None, :])[0]


@dataclass(frozen=True)
class HeldStages(AlteredSignal):
    """A signal whose reading in the middle of a step is the one at its start."""

    def sample(self, start: float, step: float, count: int) -> np.ndarray:
        """Values at start + i step, every second one repeated, shape (count, channels)."""
        values = self.signal.sample(start, step, count)
        values[1::2] = values[:-1:2]
        return values


@dataclass(frozen=True)
class OtherTrack(AlteredSignal):
    """The road of one track where the mean was asked for: it differs by a class A road."""

    def sample(self, start: float, step: float, count: int) -> np.ndarray:
        """Values at start + i step, shape (count, 4)."""
        return self.signal.sample(start, step, count) + self._other_profile().sample(start, step, count)

    def at(self, time: float) -> np.ndarray:
        """Road at one time (s), shape (4,): heights under the front and the rear wheel (m), then their rates (m/s)."""
        return self.signal.at(time) + self._other_profile().at(time)

    def _other_profile(self) -> Any:
        return replace(self.signal, profile=iso8608_road("A", 1))


def driven(modes: tuple[str, ...], change: Callable[[Any], Any]) -> Change:
    """The input changed where the vehicle is driven in one of the modes."""

    def changed(assembly: Assembly) -> Assembly:
        if assembly.input is None or assembly.mode not in modes:
            return assembly
        return replace(assembly, input=change(assembly.input))

    return changed


def channels(modes: tuple[str, ...], change: Values) -> Change:
    """The values of the input changed."""
    return driven(modes, lambda signal: AlteredSignal(signal, 0.0, change))


def times(factors: dict[int, float]) -> Values:
    """Channels by number, times a factor each; the others stay."""

    def change(values: np.ndarray) -> np.ndarray:
        out = values.copy()
        for channel, factor in factors.items():
            out[:, channel] *= factor
        return out

    return change


def springs(change: Callable[[PitchSpring], PitchSpring]) -> Change:
    """Every pitch spring replaced."""
    return vehicle(
        lambda original: replace(original, pitch_springs=tuple(change(spring) for spring in original.pitch_springs))
    )


def front_twice(values: np.ndarray) -> np.ndarray:
    """The rear channel filled from the front one."""
    return values[:, [0, 0, *range(2, values.shape[1])]]


def moment(periods: float, change: Values = lambda values: values) -> Change:
    """The added moment late by a part of its sampling period, and its values changed."""

    def changed(assembly: Assembly) -> Assembly:
        signal = assembly.moment
        if signal is None:
            return assembly
        return replace(assembly, moment=AlteredSignal(signal, periods * (signal.period or 0.0), change))

    return changed


def with_late_input(periods: float, step: float = 1e-3) -> Change:
    """Input late by a part of its sampling period, or of a step of 1 ms where it has none."""
    return driven(("road", "force", "pitch"), lambda signal: AlteredSignal(signal, periods * (signal.period or step)))


def road(**factors: float) -> Change:
    """Numbers of the road signal (speed, wheelbase) times a factor."""
    return driven(
        ("road",),
        lambda signal: replace(signal, **{name: factor * getattr(signal, name) for name, factor in factors.items()}),
    )
