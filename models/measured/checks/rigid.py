"""Whether the accelerometers of a body move as a rigid body does."""

from collections.abc import Sequence

import numpy as np

from models.core.errors import InputError
from models.core.finding import Finding
from models.measured.checks.evidence import Evidence
from models.measured.checks.noise_floor import noise
from models.measured.checks.place import Place
from models.measured.signal import Signal
from models.sensors.rigid_body_motion import quality
from models.sensors.sensor_array import SensorArray, sensor_array

NAME = "rigid"
MOST = 6000
"""Samples that are looked at, spread evenly: nothing is integrated."""
Axes = tuple[Signal, Signal, Signal]


def check(evidence: Evidence) -> list[Finding]:
    """One finding for each body with at least three tri-axial accelerometers; its size is the share in %."""
    found = [_body(evidence, body, sensors) for body, sensors in _bodies(evidence).items() if len(sensors) > 2]
    lacks = "Not looked at whether the body is rigid: this needs four tri-axial accelerometers on it, of known places."
    return found or [Finding(NAME, "note", "", lacks)]


def _bodies(evidence: Evidence) -> dict[str, dict[str, tuple[Place, Axes]]]:
    """Complete sensors by body and name."""
    found: dict[str, dict[str, tuple[Place, Axes]]] = {}
    for name in dict.fromkeys(s.at for s in evidence.recording.find("acceleration")):
        axes = [evidence.recording.find("acceleration", name, axis) for axis in "xyz"]
        place = evidence.place(axes[0][0]) if all(axes) else None
        if place is not None:
            found.setdefault(place.body, {})[name] = place, (axes[0][0], axes[1][0], axes[2][0])
    return found


def _body(evidence: Evidence, body: str, sensors: dict[str, tuple[Place, Axes]]) -> Finding:
    try:
        array = sensor_array({name: place.position for name, (place, _) in sensors.items()})
    except InputError as error:
        return Finding(NAME, "note", body, f"Not looked at whether {body} is rigid: {error}.")
    signals = [axes for _, axes in sensors.values()]
    names = tuple(s.name for axes in signals for s in axes)
    own = quality(array, _readings(evidence, signals), _noise(evidence, signals))
    if own.rigid is None:
        return Finding(NAME, "note", body, f"{body}: {array.describe()[-1]}; a fourth sensor would tell.")
    return _finding(body, array, own.share, own.suspect, bool(own.rigid), names)


def _readings(evidence: Evidence, signals: Sequence[Axes]) -> np.ndarray:
    """Samples (n, sensors, 3), with gravity as they are, where all of them have one."""
    every = -(-evidence.recording.count // MOST)
    columns = [[evidence.recording.samples(s)[::every] for s in axes] for axes in signals]
    readings = np.moveaxis(np.array(columns), 2, 0)
    return readings[np.isfinite(readings).all(axis=(1, 2))]


def _noise(evidence: Evidence, signals: Sequence[Axes]) -> float:
    sizes = [noise(evidence.recording, s) for axes in signals for s in axes]
    return float(np.sqrt(np.nanmean(np.square(sizes)))) if np.isfinite(sizes).any() else 0.0


def _finding(body: str, array: SensorArray, share: float, suspect: str, rigid: bool, names: tuple[str, ...]) -> Finding:
    left = f"{100 * share:.2g} % of what its {len(array.names)} accelerometers read against each other"
    if rigid:
        return Finding(NAME, "note", body, f"A rigid body explains {body} but for {left}.", 100 * share, "%", names)
    cause = (
        f"without {suspect} it is rigid: check its mount, place, axes and factor"
        if suspect
        else "no single sensor explains it: check places and axes of all"
    )
    text = f"No rigid body explains {left} on {body}; {cause}."
    return Finding(NAME, "doubt", suspect or body, text, 100 * share, "%", names)
