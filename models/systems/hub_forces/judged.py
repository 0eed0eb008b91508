"""Measured hub forces and angles against the vehicle that they are to drive, by the checks of recordings."""

import json
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from models.core.errors import InputError
from models.core.finding import Finding, gathered
from models.measured.signal import UNITS, Quantity, Signal
from models.systems.hub_forces.measurement import Angles, HubForces
from models.vehicles.cut_vehicle import CutVehicle

if TYPE_CHECKING:
    from models.measured.recording import Recording
    from models.systems.hub_forces.scene import HubScene

ANGLES: tuple[tuple[Quantity, str], ...] = (
    ("angle", "roll"),
    ("angle", "pitch"),
    ("angular rate", "roll"),
    ("angular rate", "pitch"),
)
WRENCH: tuple[tuple[Quantity, str], ...] = tuple((what, axis) for what in ("force", "moment") for axis in "xyz")
REMEDY = "Correct the columns of the file, or map them in a scene of the system measured"
"""Files of hub forces have no channel map, of which the checks of recordings speak."""


def judged(scene: "HubScene", vehicle: CutVehicle) -> tuple[Finding, ...]:
    """Doubts about the files of a scene; InputError for what cannot be, unless the scene accepts it."""
    from models.measured.checks import check

    forces, angles = scene.measured(vehicle)
    recording = _recording(scene, vehicle, forces, angles)
    found = [
        replace(each, text=_of_file(each.text))
        for each in check(recording, vehicle)
        if each.check not in scene.forces.accept
    ]
    errors = [each for each in found if each.weight == "error"]
    if errors:
        names = json.dumps(list(dict.fromkeys(each.check for each in errors)))
        raise InputError(
            scene.file,
            "forces.file",
            scene.forces.file,
            f"{' '.join(each.text for each in gathered(errors))} {REMEDY}; if it is meant so: accept = {names} under "
            "[forces].",
        )
    return tuple(each for each in found if each.weight == "doubt")


def _of_file(text: str) -> str:
    """What a finding says, without the remedy of a channel map that is not there."""
    before, colon, _ = text.partition("; give sign")
    return before + "." if colon else text.replace(" in the channel map", "")


def _recording(scene: "HubScene", vehicle: CutVehicle, forces: HubForces, angles: Angles) -> "Recording":
    """Both files as a recording; noise of angles is as the scene states."""
    from models.measured.columns import MemoryColumns
    from models.measured.recording import Recording

    named = [(hub, what, axis, str(scene.forces.file)) for hub in vehicle.hubs for what, axis in WRENCH]
    named += [(vehicle.chassis, what, axis, str(scene.angles.file)) for what, axis in ANGLES]
    signals = tuple(
        Signal(
            f"{at} {what} {axis}",
            file,
            f"{at} {what} {axis}",
            what,
            at,
            axis,
            scene.forces.frame if at in vehicle.hubs else "body",
            1,
            UNITS[what],
            1.0,
        )
        for at, what, axis, file in named
    )
    count = min(len(forces.samples), len(angles.samples))
    samples = np.hstack([forces.samples[:count], angles.samples[:count]])
    return Recording(signals, MemoryColumns(tuple(s.name for s in signals), samples), forces.period)
