"""Names of modules that have moved: who imports an old one is told the new one."""

import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from types import ModuleType

CORE = ("errors", "noise", "piecewise", "result", "scene_effects", "scene_file", "signals", "steps", "strict", "tables")
MOVED = {
    **{f"models.{name}": f"models.core.{name}" for name in (*CORE, "time_series", "whole_files")},
    "models.compiled": "models.machine.compiled",
    "models.damage": "models.fatigue.damage",
    "models.assembly": "models.engines.assembly",
    "models.effects": "models.systems.pitch_plane.effects",
    "models.plan": "models.systems.pitch_plane.plan",
    "models.scene": "models.systems.pitch_plane.scene",
    "models.simulate": "models.systems.pitch_plane.run",
    "models.parameters": "models.vehicles.parameters",
    "models.handling": "models.systems.handling, and its vehicle and forces models.multibody",
    "models.handling.numbers": "models.multibody.numbers",
    "models.braking.controller": "models.brake.controller",
    "models.hub_forces": "models.systems.hub_forces, and its vehicle models.vehicles.cut_vehicle",
    "models.braking": "models.brake, its tyres models.tyre and its scenes models.systems.braking",
    "models.choice": "models.advice.choice",
    "models.rail.climbing": "models.rail.doubts",
    "models.rail.orbit": "models.rail.limit_cycle",
    "models.rail.scene": "models.systems.wheelset.scene",
    "models.rail.of_scene": "models.systems.wheelset.of_scene",
    "models.contact.built": "models.systems.contact.run",
    "models.contact.falling_friction": "models.contact.material",
    "models.systems.wheelset.channels": "models.systems.wheelset.run",
    "models.contact.scene": "models.systems.contact.scene",
    "models.ride.of_scene": "models.systems.ride.of_scene",
    "models.ride.scene": "models.systems.ride.scene",
    "models.ride.delayed_system": "models.ride.excited",
    "models.ride.massless": "models.ride.excited",
    "models.ride.height_densities": "models.ride.frequency",
    "models.ride.time_averages": "models.ride.frequency",
    "models.ride.modal": "models.ride.sweep",
    "models.ride.noise_cells": "models.ride.speed_profile",
    "models.ride.responses": "models.ride.road_in_path",
    "models.ride.operating_point": "models.vehicles.linear_vehicle",
    "models.systems.ride.in_engines": "models.systems.ride.nonlinear",
    "models.advice.ride_choice.cost": "models.advice.ride_choice.march",
    "models.measured.scene": "models.systems.measured.scene",
    "models.section_forces": "models.drift.score",
    "models.sensors.gyro": "models.sensors.inertial_unit",
    "models.sensors.high_pass": "models.sensors.rigid_body_motion",
    "models.sensors.virtual_accelerometers": "models.sensors.sensor_array",
    "models.vehicles.linear": "models.vehicles.description",
    "models.ensemble.named_files": "models.ensemble.store",
    "models.engines.beside_reference": "models.engines.outside",
    "validation.price.own_scene": "models.advice.price",
}
"""Old names, of modules or of whole packages, and where their content is now."""


class Moved(MetaPathFinder):
    """Asked for what nobody else has found."""

    def find_spec(self, name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> None:
        """Raise ModuleNotFoundError with the new name for an old one."""
        if name in MOVED:
            raise ModuleNotFoundError(f"{name} is now {MOVED[name]}: change the import", name=name)


def tell_new_names() -> None:
    """Have old names answered, once per process."""
    if not any(isinstance(finder, Moved) for finder in sys.meta_path):
        sys.meta_path.append(Moved())
