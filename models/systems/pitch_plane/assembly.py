"""From a scene to what its run computes: the vehicle, its input, its effects, and nothing else."""

import numpy as np

from models.core.errors import InputError
from models.core.scene_effects import legal, module_of
from models.core.systems import DEFAULT
from models.engines.assembly import Assembly
from models.systems.pitch_plane.scene import Scene
from models.vehicles import pitch_plane


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
