"""Faults planted where a vehicle's table reads measured hub forces, and the checks that see them."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from models.engines.cut_vehicle import HubModel, build
from models.multibody.cut_kernel import WRENCH
from models.multibody.cut_table import HubInputs
from models.vehicles.cut_vehicle import CutVehicle
from validation.common.checks import largest_relative_difference
from validation.faults.campaign import Campaign, CampaignFault, Check
from validation.faults.patches import Patch, attribute_patch
from validation.spatial.cars import hub_forces_by_jacobians, r19, static_forces


def _driven_model(hub_wrenches: np.ndarray) -> HubModel:
    """The vehicle R19-free in MuJoCo under hub forces and moments (3, 6 number of hubs) in N, N m."""
    return build("mujoco", r19(), HubInputs(hub_wrenches), 1e-3, 1e-3)


def _jacobian_difference() -> float:
    """Relative difference between the generalised forces of hub forces and moments and those by MuJoCo's Jacobians, in
    a state far from rest."""
    vehicle, rows = r19(), static_forces(r19(), 3).hubs
    rows += np.random.default_rng(4).normal(0.0, 500.0, rows.shape[1])
    q = np.random.default_rng(5).uniform(-0.03, 0.03, vehicle.size)
    q[3:6] = 1.0, 0.1, -0.2
    built, bare = _driven_model(rows), _driven_model(0.0 * rows)
    return largest_relative_difference(
        built.forces_at_rest(q) - bare.forces_at_rest(q), hub_forces_by_jacobians(built, q, rows[0])
    )


def _accelerations_at_rest() -> float:
    """Largest acceleration at rest under the static loads (m/s^2, rad/s^2), which should be 0."""
    rest_state = np.zeros(r19().size)
    return float(np.abs(_driven_model(static_forces(r19(), 3).hubs).acceleration(0.0, rest_state, rest_state)).max())


CHECKS = {
    "Jacobians": Check("joint forces by MuJoCo's own Jacobians", "of the largest", 1e-12, _jacobian_difference),
    "still": Check("no acceleration on the static loads", "m/s^2, rad/s^2", 1e-9, _accelerations_at_rest),
}


def wrench_reading_patch(
    change_wrenches: Callable[[np.ndarray], np.ndarray] | None = None, force_frame: str = "hub"
) -> Patch:
    """Fault: hub forces and moments (samples, hubs, 6) are changed as they are read, or read in a wrong frame."""

    def table(original_function: Any) -> Any:
        def planted(vehicle: CutVehicle, hub_inputs: HubInputs, step: float) -> Any:
            parts = hub_inputs.hubs.reshape(len(hub_inputs.hubs), -1, WRENCH)
            rows = parts if change_wrenches is None else change_wrenches(parts)
            return original_function(
                vehicle, replace(hub_inputs, hubs=rows.reshape(hub_inputs.hubs.shape), frame=force_frame), step
            )

        return planted

    return attribute_patch("models.engines.cut_vehicle:cut_vehicle_table", table)


FAULTS = (
    CampaignFault("left and right hubs swapped", "input", wrench_reading_patch(lambda parts: parts[:, [1, 0, 3, 2]])),
    CampaignFault("front and rear hubs swapped", "input", wrench_reading_patch(lambda parts: parts[:, [2, 3, 0, 1]])),
    CampaignFault("forces read along axes of the road", "input", wrench_reading_patch(force_frame="inertial")),
    CampaignFault(
        "y turned round",
        "input",
        wrench_reading_patch(lambda parts: parts * np.array([1.0, -1.0, 1.0, 1.0, -1.0, 1.0])),
    ),
    CampaignFault("moments left out", "input", wrench_reading_patch(lambda parts: parts * np.repeat([1.0, 0.0], 3))),
    CampaignFault(
        "one force 1 % off",
        "input",
        wrench_reading_patch(lambda parts: parts * np.r_[1.01, np.ones(parts[0].size - 1)].reshape(parts[0].shape)),
    ),
)

CAMPAIGN = Campaign("planted.hubs", "hub forces", "rolling-vehicle", CHECKS, FAULTS)
