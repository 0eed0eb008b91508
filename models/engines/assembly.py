"""Input and output of pitch-plane engines: the system with its bodies, struts and input, and the settings of the time
integration."""

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from models.core.assumptions import Assumption
from models.core.signals import Signal
from models.vehicles import pitch_plane
from models.vehicles.description import PitchSpring, PlaneVehicle

Mode = Literal["free", "road", "force", "force-body", "pitch", "heave-pitch"]
PRESCRIBED_COORDINATES: dict[str, tuple[int, ...]] = {"pitch": (3,), "heave-pitch": (2, 3)}
"""Indices of the coordinates that a mode's input prescribes. The input is then the two wheel forces, these coordinates,
their rates and their second derivatives."""
Channels = dict[str, tuple[str, str, np.ndarray]]
"""Channels by name: unit, meaning, values (n,)."""


@dataclass(frozen=True)
class Assembly:
    """A pitch-plane system to be simulated. Effects extend it, and engines build models from it.

    Attributes
    ----------
    vehicle : bodies and struts that take part (no tyres where wheel forces are prescribed)
    parameters : the paper's symbols, for the equations and the outputs
    mode : which equations hold; "free" is the vehicle on its tyres over a flat road
    input : signal of that mode (see ``pitch_plane_equations``), None if nothing drives the vehicle
    initial : state at t = 0, shape (8,)
    moment : added pitch moment on the chassis of a force-excited vehicle, one channel in N m, nose up, read at
        each stage's time (never held); None if there is none
    outputs : functions of the run that add channels to its result, one per effect that asks for any
    sensors : the same, of the run and of the model that made it, for effects that read accelerations
    doubts : sentences on what contradicts the scene, with size and remedy: told before the run and saved with it
    assumptions : what its effects take for granted, beside what the vehicle does
    """

    scene: Any
    vehicle: PlaneVehicle
    parameters: pitch_plane.PitchPlaneParameters
    mode: Mode
    input: Signal | None
    initial: np.ndarray
    outputs: tuple[Any, ...] = ()
    moment: Signal | None = None
    sensors: tuple[Any, ...] = ()
    doubts: tuple[str, ...] = ()
    assumptions: tuple[Assumption, ...] = ()

    @property
    def guided(self) -> tuple[int, ...]:
        """Indices of the coordinates that the input prescribes; empty for most modes."""
        return PRESCRIBED_COORDINATES.get(self.mode, ())

    def with_input(self, input_mode: Mode, input_signal: Signal) -> "Assembly":
        """A copy of the assembly in the mode ``input_mode``, driven by ``input_signal``."""
        return replace(self, mode=input_mode, input=input_signal)

    def with_moment(self, moment_signal: Signal) -> "Assembly":
        """A copy of the assembly with an added pitch moment (N m, nose up) on the chassis; it acts together with any
        wheel forces."""
        assert self.mode in ("force", "force-body") and moment_signal.channels == 1 and not moment_signal.held
        return replace(self, moment=moment_signal)

    def with_spring(self, pitch_spring: PitchSpring) -> "Assembly":
        """A copy of the assembly with one more rotational spring from chassis to ground."""
        springs = (*self.vehicle.pitch_springs, pitch_spring)
        return replace(self, vehicle=replace(self.vehicle, pitch_springs=springs))

    def without_tyres(self) -> "Assembly":
        """A copy of the assembly without tyres, so that the road does not act on it."""
        struts = tuple(strut for strut in self.vehicle.struts if strut.lower.body is not None)
        return replace(self, vehicle=replace(self.vehicle, struts=struts))


@dataclass(frozen=True)
class Settings:
    """Settings of the time integration: name of the integrator in its engine, step (s), duration (s), tolerance and
    spectral radius."""

    integrator: str
    step: float
    duration: float
    tolerance: float = 1e-9
    spectral_radius: float = 0.6

    @property
    def steps(self) -> int:
        """Number of fixed steps that cover the duration."""
        return round(self.duration / self.step)
