"""Faults planted in an engine's native springs, mounts and anti-roll bars of a vehicle on hub forces, and the checks
that see them.

Both engines are compared with compiled forces, which use nothing of the engines' builders, at states far from rest.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from validation.faults.campaign import Campaign, CampaignFault, Check
from validation.faults.patches import Patch, attribute_patch
from validation.spatial.cars import rough_car
from validation.spatial.native_builds import native_acceleration_difference, random_states

STATE_COUNT = 3
EXUDYN_MODULE = "models.engines.native_exudyn"


def _compiled_difference_check(engine: str) -> Callable[[], float]:
    """Returns a check's function: relative difference between an engine's accelerations and those by compiled
    forces."""
    return lambda: native_acceleration_difference(engine, rough_car(), random_states(rough_car(), STATE_COUNT))


CHECK_TITLE = "accelerations of {} beside compiled forces"
CHECKS = {
    engine: Check(CHECK_TITLE.format(engine), "of the largest", 1e-12, _compiled_difference_check(engine))
    for engine in ("exudyn", "mujoco")
}


def _mujoco_model_patch(change_model: Callable[[Any], None]) -> Patch:
    """Fault: MuJoCo's compiled model is changed after its force laws were written into it."""

    def set_laws(original_function: Any) -> Any:
        def written(mujoco_model: Any, native_parts: Any) -> None:
            original_function(mujoco_model, native_parts)
            if native_parts:
                change_model(mujoco_model)

        return written

    return attribute_patch("models.engines.free_vehicle_mujoco:set_laws", set_laws)


def _scale_patch(array_name: str) -> Patch:
    """Fault: the first row of an array of MuJoCo's model is 1 % too large."""

    def change(mujoco_model: Any) -> None:
        getattr(mujoco_model, array_name)[:1] *= 1.01

    return _mujoco_model_patch(change)


def _larger_bar_coefficient(mujoco_model: Any) -> None:
    """Fault: the coefficient of the first coordinate in the first anti-roll bar's tendon is 1 % too large."""
    bar = next(i for i in range(mujoco_model.ntendon) if mujoco_model.tendon(i).name.endswith("bar"))
    mujoco_model.wrap_prm[mujoco_model.tendon_adr[bar]] *= 1.01


def _site_actuator(mujoco_model: Any) -> int:
    """Number of the first actuator in a MuJoCo model that acts between two sites."""
    return int(np.argmax(mujoco_model.actuator_trntype == mujoco.mjtTrn.mjTRN_SITE))


def _swap_sites(mujoco_model: Any) -> None:
    """Fault: an actuator's reference site lies on the other body, so that its axis turns with this body."""
    sites = mujoco_model.actuator_trnid[_site_actuator(mujoco_model)]
    sites[:] = sites[::-1].copy()


def _larger_mount_preload(mujoco_model: Any) -> None:
    sited = mujoco_model.actuator_trntype == mujoco.mjtTrn.mjTRN_SITE
    actuator = int(
        np.argmax(sited * (mujoco_model.actuator_forcelimited == 0) * abs(mujoco_model.actuator_biasprm[:, 0]))
    )
    mujoco_model.actuator_biasprm[actuator, 0] *= 1.01


def _shift_corner(mujoco_model: Any) -> None:
    """Fault: the force limit of an actuator, which represents a corner of a curve, is switched off."""
    mujoco_model.actuator_forcelimited[int(np.argmax(mujoco_model.actuator_forcelimited))] = 0


def _element_law_patch(**law_factors: float) -> Patch:
    """Fault: stiffness, damping or preload of Exudyn's first element is multiplied by a factor."""

    def add_parts(original_function: Any) -> Any:
        def added(exudyn_model: Any, node: Any, native_parts: Any) -> None:
            first = native_parts[0].element
            changed = replace(first, **{name: factor * getattr(first, name) for name, factor in law_factors.items()})
            original_function(exudyn_model, node, (replace(native_parts[0], element=changed), *native_parts[1:]))

        return added

    return attribute_patch("models.engines.free_vehicle_exudyn:add_parts", add_parts)


def _larger_bar_factor(original_function: Any) -> Any:
    """Fault: the coefficient of the first coordinate in a bar is 1 % too large."""

    def add(self: Any, element: Any, travel: Any) -> None:
        first, *other_factors = travel.factors
        scaled = replace(travel, factors=(1.01 * first, *other_factors))
        original_function(self, element, scaled if element.name.endswith("bar") else travel)

    return add


def _axes_fixed_in_space(original_function: Any) -> Any:
    """Fault: mounts are measured along axes fixed in space, since the connector belongs to the vehicle's tree."""

    def tree(self: Any, axes_frame: str) -> Any:
        return self.built.links[axes_frame][0]

    return tree


FAULTS = (
    CampaignFault("a stiffness 1 % off", "MuJoCo", _scale_patch("tendon_stiffness")),
    CampaignFault("a damping 1 % off", "MuJoCo", _scale_patch("tendon_damping")),
    CampaignFault("a preload 1 % off", "MuJoCo", _scale_patch("tendon_lengthspring")),
    CampaignFault("a bar's factor 1 % off", "MuJoCo", _mujoco_model_patch(_larger_bar_coefficient)),
    CampaignFault("a mount's axis fixed in the engine", "MuJoCo", _mujoco_model_patch(_swap_sites)),
    CampaignFault("a mount's preload 1 % off", "MuJoCo", _mujoco_model_patch(_larger_mount_preload)),
    CampaignFault("a curve without its corner", "MuJoCo", _mujoco_model_patch(_shift_corner)),
    CampaignFault("a stiffness 1 % off", "Exudyn", _element_law_patch(stiffness=1.01)),
    CampaignFault("a damping 1 % off", "Exudyn", _element_law_patch(damping=1.01)),
    CampaignFault("a preload 1 % off", "Exudyn", _element_law_patch(preload=1.01)),
    CampaignFault(
        "a bar's factor 1 % off",
        "Exudyn",
        attribute_patch(f"{EXUDYN_MODULE}:CoordinateConnectors.add", _larger_bar_factor),
    ),
    CampaignFault(
        "mounts' axes fixed in the space",
        "Exudyn",
        attribute_patch(f"{EXUDYN_MODULE}:_AxisFrameTrees._tree", _axes_fixed_in_space),
    ),
)

CAMPAIGN = Campaign("planted.native", "springs of the engines' own", "drift", CHECKS, FAULTS)
