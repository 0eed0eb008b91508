"""Contact points and forces of a wheelset at given positions on its rails: one case of a scene at every position."""

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from models.contact.wheel_on_rail import SURROUNDINGS_DISTANCE
from models.core.assumptions import with_assumptions
from models.core.discretisation import grid_error, not_estimated, with_stated_errors
from models.core.errors import InputError, RunFailed
from models.core.result import Channel, Result, result
from models.rail.contact_table import PatchReport, WheelsetContact, WheelsetPlacement, rolling_radius_difference
from models.systems.wheel_rail.assumptions import WHEEL_NAMES, assumptions
from models.systems.wheel_rail.scene import LARGEST_CELL_COUNT, WheelRailScene

INPUTS_OF_DEEP_CONTACT = ("distance", "load")
"""Inputs that the contact theories refuse where the contact grows beyond the computed surroundings of the profiles."""
POSITION_UNITS = {"shift": "mm", "yaw": "mrad", "roll": "mrad", "spin_speed": "rad/s", "radius_difference": "mm"}
"""Channels of the wheelset at a position, with their units."""
OUTWARD_DEGREES_PER_RADIAN = -180.0 / np.pi
"""Factor from a contact angle in rad to degrees, with the sign turned."""
WHEEL_QUANTITIES = {"normal": "N", "area": "m^2", "fx": "N", "fy": "N", "peak": "Pa"}
"""Quantities of a wheel whose error is stated, with their units."""
ERROR_POSITION_STRIDE = 2
"""The error of the cells is estimated at every n-th position of the wheelset; this is n."""
PATCH_QUANTITIES: dict[str, tuple[str, float, str]] = {
    "on_rail": ("mm", 1e3, "on_rail"),
    "in_track": ("mm", 1e3, "y"),
    "on_wheel": ("mm", 1e3, "wheel_centre"),
    "ahead": ("mm", 1e3, "x"),
    "angle": ("deg", OUTWARD_DEGREES_PER_RADIAN, "centre_angle"),
    "normal": ("kN", 1e-3, "normal"),
    "peak": ("MPa", 1e-6, "peak"),
    "area": ("mm^2", 1e6, "area"),
    "half_length": ("mm", 5e2, "length"),
    "half_width": ("mm", 5e2, "width"),
    "rolling_radius": ("mm", 1e3, "rolling_radius"),
    "touch_on_rail": ("mm", 1e3, "touch_on_rail"),
    "touch_on_wheel": ("mm", 1e3, "wheel_y"),
    "touch_angle": ("deg", OUTWARD_DEGREES_PER_RADIAN, "angle"),
    "fx": ("kN", 1e-3, "fx"),
    "fy": ("kN", 1e-3, "fy"),
    "mz": ("N m", 1.0, "mz"),
    "mz_on_rail": ("mm", 1e3, "touch_on_rail"),
    "mz_ahead": ("mm", 1e3, "touch_x"),
    "xi_x": ("-", 1.0, "xi_x"),
    "xi_y": ("-", 1.0, "xi_y"),
    "spin": ("1/m", 1.0, "spin"),
    "approach": ("um", 1e6, "approach"),
}
"""Channels of a contact patch: unit, factor from SI to this unit, and attribute of ``PatchReport``."""


@dataclass(frozen=True, eq=False)
class ContactsOfCase:
    """Contacts of a case. placements : contacts of the wheelset at each position where they were computed; failures :
    reasons for the positions that failed, by lateral displacement (mm); seconds : processor time of each position.
    """

    placements: list[WheelsetPlacement] = field(default_factory=list)
    failures: dict[float, str] = field(default_factory=dict)
    seconds: list[float] = field(default_factory=list)


def run(
    scene: WheelRailScene,
    engine: str = "",
    case: str = "",
    progress: Callable[[float, float], Any] = lambda shift, share: None,
    *,
    error: bool = False,
) -> Result:
    """Compute a case, by default the first, at every position of the wheelset; the detail is its ``ContactsOfCase``.

    Channels of positions lie over the shift, those of patches over shift, wheel and patch, the patch with the largest
    load first; not a number where there is no further patch. Positions that fail are doubts. progress : called
    before each shift with the shift (mm) and the completed share; error : whether every other position is computed on
    half the cells, too, from which the error of the cells is estimated. Raises InputError for files that are no
    profiles.
    """
    name = case or next(iter(scene.cases))
    contact, yaw, contacts = scene.contact(scene.cases[name]), scene.cases[name].yaw, ContactsOfCase()
    for i, shift in enumerate(scene.positions.values().tolist()):
        progress(1e3 * shift, i / scene.positions.count)
        start_time = time.process_time()
        try:
            contacts.placements.append(contact.at(shift, yaw * shift))
        except (InputError, RunFailed) as failure:
            deep = isinstance(failure, InputError) and failure.place in INPUTS_OF_DEEP_CONTACT
            contacts.failures[1e3 * shift] = (
                f"a load of {contact.load:g} N presses wheel and rail more than "
                f"{1e3 * SURROUNDINGS_DISTANCE:g} mm into "
                "each other"
                if deep
                else str(failure)
            )
        contacts.seconds.append(time.process_time() - start_time)
    labelled = with_assumptions(_labelled_result(scene, name, contacts), assumptions(scene, scene.cases[name].friction))
    return _with_error(labelled, scene, contact) if error and contacts.placements else labelled


def _with_error(run_result: Result, scene: WheelRailScene, wheelset_contact: WheelsetContact) -> Result:
    """Returns the result with the error that the finite cells cause, as the root mean square over both wheels and every
    other position.

    The error of the cells is of first order, so that it is as large as the change on half the cells. Relative errors
    refer to the root mean square.
    """
    fine, coarse = list[WheelsetPlacement](), list[WheelsetPlacement]()
    for placed in run_result.detail.placements[::ERROR_POSITION_STRIDE]:
        with suppress(InputError, RunFailed):
            coarse.append(
                replace(wheelset_contact, cell_factor=2.0 * wheelset_contact.cell_factor).at(placed.shift, placed.yaw)
            )
            fine.append(placed)
    if not coarse:
        return not_estimated(run_result, "no position is found on half the cells")
    of_fine, of_coarse = (np.array([wheel_sums(placed) for placed in placements]) for placements in (fine, coarse))
    errors, sizes = (np.sqrt(np.mean(values**2, axis=(0, 1))) for values in (of_fine - of_coarse, of_fine))
    estimates = {
        name: grid_error(float(error), float(size), unit, scene.method.cells, 1.0, LARGEST_CELL_COUNT)
        for (name, unit), error, size in zip(WHEEL_QUANTITIES.items(), errors, sizes, strict=True)
    }
    return with_stated_errors(
        run_result, estimates, f"half the cells at {len(fine)} of {len(run_result.detail.placements)} positions"
    )


def wheel_sums(wheelset_placement: WheelsetPlacement) -> np.ndarray:
    """Normal force (N), area (m^2), creep forces fx and fy (N), each summed over a wheel's patches, and its largest
    pressure (Pa). Shape (2, 5): right wheel, left wheel.
    """
    return np.array(
        [
            [*(sum(getattr(patch, name) for patch in wheel) for name in ("normal", "area", "fx", "fy")), peak]
            for wheel in (wheelset_placement.right, wheelset_placement.left)
            for peak in [max(patch.peak for patch in wheel)]
        ]
    )


def _labelled_result(scene: WheelRailScene, case_name: str, contacts_of_case: ContactsOfCase) -> Result:
    positions = [position_quantities(placed) for placed in contacts_of_case.placements]
    most_patches = max((len(position[wheel]) for position in positions for wheel in WHEEL_NAMES), default=0)
    missing = dict.fromkeys(PATCH_QUANTITIES, np.nan)
    rows = [
        (*position[wheel], *[missing] * most_patches)[:most_patches] for position in positions for wheel in WHEEL_NAMES
    ]
    channels = {
        key: Channel("shift", np.array([position[key] for position in positions], float), unit)
        for key, unit in POSITION_UNITS.items()
    }
    axes = {"shift": channels.pop("shift"), "wheel": Channel("wheel", list(WHEEL_NAMES))}
    channels |= {
        key: Channel(
            ("shift", "wheel", "patch"),
            np.array([[patch[key] for patch in row] for row in rows], float).reshape(
                len(positions), len(WHEEL_NAMES), most_patches
            ),
            unit,
        )
        for key, (unit, _, _) in PATCH_QUANTITIES.items()
    }
    doubts = [f"{shift:g} mm: {why}" for shift, why in contacts_of_case.failures.items()]
    return result(
        scene,
        channels,
        axes,
        seconds=sum(contacts_of_case.seconds),
        doubts=doubts,
        detail=contacts_of_case,
        case=case_name,
    )


def patches_by_force(wheelset_placement: WheelsetPlacement, right_or_left: str) -> tuple[PatchReport, ...]:
    """Contact patches of one wheel ("right" or "left"), sorted by normal force, largest first."""
    return tuple(sorted(getattr(wheelset_placement, right_or_left), key=lambda patch: -patch.normal))


def position_quantities(wheelset_placement: WheelsetPlacement) -> dict[str, Any]:
    """Channels of the wheelset at a position (POSITION_UNITS) and of every patch of both wheels (PATCH_QUANTITIES), by
    name.
    """
    return {
        "shift": 1e3 * wheelset_placement.shift,
        "yaw": 1e3 * wheelset_placement.yaw,
        "roll": 1e3 * wheelset_placement.roll,
        "spin_speed": wheelset_placement.spin_speed,
        "radius_difference": 1e3 * rolling_radius_difference(wheelset_placement),
        **{
            wheel: [
                {key: factor * getattr(patch, name) for key, (_, factor, name) in PATCH_QUANTITIES.items()}
                for patch in patches_by_force(wheelset_placement, wheel)
            ]
            for wheel in WHEEL_NAMES
        },
    }
