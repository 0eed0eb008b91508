"""Scene -> what will be computed: the vehicle, its input, its effects, and nothing else."""

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from models.errors import InputError
from models.scene import Scene
from models.scene_effects import legal, module_of
from models.signals import Signal
from models.systems import DEFAULT
from models.vehicles import pitch_plane
from models.vehicles.description import Vehicle

Mode = Literal["free", "road", "force", "force-body", "pitch", "heave-pitch"]
GUIDED: dict[str, tuple[int, ...]] = {"pitch": (3,), "heave-pitch": (2, 3)}
"""Coordinates that a mode's input prescribes, by their place in the state. The input is then the two wheel forces,
these coordinates, their rates and their second derivatives."""


@dataclass(frozen=True)
class Assembly:
    """What a run computes. Effects extend it; engines read it.

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
    """

    scene: Scene
    vehicle: Vehicle
    parameters: pitch_plane.Parameters
    mode: Mode
    input: Signal | None
    initial: np.ndarray
    outputs: tuple[Any, ...] = ()
    moment: Signal | None = None
    sensors: tuple[Any, ...] = ()
    doubts: tuple[str, ...] = ()

    @property
    def guided(self) -> tuple[int, ...]:
        """Coordinates that the input prescribes; empty for most modes."""
        return GUIDED.get(self.mode, ())

    def with_input(self, mode: Mode, signal: Signal) -> "Assembly":
        """The same, driven by ``signal``."""
        return replace(self, mode=mode, input=signal)

    def with_moment(self, signal: Signal) -> "Assembly":
        """The same, with a pitch moment added on the chassis; it stands beside any forces, held ones too."""
        assert self.mode in ("force", "force-body") and signal.channels == 1 and not signal.held
        return replace(self, moment=signal)

    def without_tyres(self) -> "Assembly":
        """The same, cut off the road."""
        struts = tuple(strut for strut in self.vehicle.struts if strut.lower.body is not None)
        return replace(self, vehicle=replace(self.vehicle, struts=struts))


def assemble(scene: Scene) -> Assembly:
    """Build what the scene names; only the files of its effects are imported."""
    p = scene.vehicle_parameters()
    vehicle = pitch_plane.describe(p, scene.vehicle.geometry)
    assembly = Assembly(scene, vehicle, p, "free", None, _initial(scene, p))
    for name in ordered(scene):
        assembly = module_of(DEFAULT, name).extend(assembly, scene.effects[name])
    return assembly


def _initial(scene: Scene, p: pitch_plane.Parameters) -> np.ndarray:
    """Static equilibrium, with the coordinates that the scene sets put in its place."""
    state = pitch_plane.equilibrium(p, scene.vehicle.geometry)
    names = (*pitch_plane.STATES, *(f"{name}_rate" for name in pitch_plane.STATES))
    for name, value in scene.start.items():
        if name not in names:
            raise InputError(scene.file, f"start.{name}", value, "not a state", names)
        state[names.index(name)] = value
    return state


def ordered(scene: Scene) -> list[str]:
    """The scene's effects, each after those that it needs; refuses illegal combinations."""
    modules = {name: module_of(DEFAULT, name) for name in scene.effects}
    legal(modules, scene)
    done: list[str] = []
    waiting = list(modules)
    while waiting:
        ready = [n for n in waiting if all(m in done for m in (*modules[n].NEEDS, *modules[n].AFTER) if m in modules)]
        done += ready
        waiting = [n for n in waiting if n not in ready]
    return done
