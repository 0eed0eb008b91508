"""Uncertain parameters of a vehicle: every mass, inertia, stiffness and damping, each of which may be off by itself."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from models.vehicles.spatial import SpatialVehicle

PARAMETER_ERROR = 0.05
"""Relative error that every mass, inertia, stiffness and damping may have independently."""
PARAMETERS_OF_PARTS = {
    "bodies": ("mass", "inertia"),
    "springs": ("stiffness", "damping"),
    "tyres": ("stiffness", "damping"),
    "bars": ("stiffness", "damping"),
}
"""Names of the uncertain parameters, by the group of vehicle parts that have them."""

Parameter = tuple[str, str, str]
"""Name of a parameter: group, part and key, as in ("springs", "front left", "damping")."""


def uncertain_parameters(vehicle: SpatialVehicle) -> list[Parameter]:
    """All uncertain parameters of a vehicle: its masses, inertias, stiffnesses and dampings other than 0."""
    return [
        (group, element.name, key)
        for group, keys in PARAMETERS_OF_PARTS.items()
        for element in getattr(vehicle, group)
        for key in keys
        if np.any(getattr(element, key))
    ]


def scaled_vehicle(vehicle: SpatialVehicle, parameter_factors: Mapping[Parameter, float]) -> SpatialVehicle:
    """The vehicle with its parameters multiplied by these factors; factors of parameters that it does not have are
    ignored.
    """

    def scaled_part(group_name: str, part: Any) -> Any:
        known = [key for key in PARAMETERS_OF_PARTS[group_name] if (group_name, part.name, key) in parameter_factors]
        changed_values = {
            key: _multiplied(getattr(part, key), parameter_factors[group_name, part.name, key]) for key in known
        }
        return replace(part, **changed_values) if changed_values else part

    groups: dict[str, Any] = {
        group: tuple(scaled_part(group, each) for each in getattr(vehicle, group)) for group in PARAMETERS_OF_PARTS
    }
    return replace(vehicle, **groups)


def _multiplied(parameter_value: Any, factor: float) -> Any:
    return (
        tuple(_multiplied(component, factor) for component in parameter_value)
        if isinstance(parameter_value, tuple)
        else parameter_value * factor
    )
