"""Probable cause of a channel's wrong factor: its sign, its unit, or its calibration factor."""

from collections.abc import Mapping
from typing import Literal

import numpy as np

from models.measured.signal import MeasuredSignal, Quantity

UNIT_FACTORS: dict[Quantity, dict[str, float]] = {
    "force": {"N": 1.0, "daN": 10.0, "kN": 1e3, "lbf": 4.4482216, "kip": 4448.2216},
    "moment": {"N m": 1.0, "kN m": 1e3},
    "acceleration": {"m/s^2": 1.0, "g": 9.80665, "mm/s^2": 1e-3, "ft/s^2": 0.3048},
    "angular rate": {"rad/s": 1.0, "deg/s": np.pi / 180, "mrad/s": 1e-3},
    "angle": {"rad": 1.0, "deg": np.pi / 180, "mrad": 1e-3},
    "travel": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "inch": 0.0254},
    "strain": {"-": 1.0, "um/m": 1e-6, "%": 1e-2},
}
"""Usual units in files, by quantity, with their factors to SI."""
EXPLAINED_RATIO_DIFFERENCE = 0.2
"""Largest difference of logarithms between a measured ratio and the ratio of two units that explains it."""
SUSPICIOUS_GAIN = 0.25
"""Largest relative error of a calibration factor; larger errors have another cause."""
NEGLIGIBLE_MEAN_LOAD_SHARE = 0.05
"""Share of the static load below which a mean force counts as zero, where the force varies by more."""
WrongFactor = Literal["sign", "unit", "gain", "size"]
"""Causes of a wrong factor; "size" means that no usual unit explains it."""


def probable_mistake(recorded_to_true: float, signal: MeasuredSignal) -> tuple[WrongFactor, str]:
    """Probable mistake behind a ratio of recorded to true value, and, for a wrong unit, which unit was taken for which.

    "size" means that no two usual units explain the ratio. Of several pairs of units, one that contains the map's unit
    is preferred.
    """
    if recorded_to_true < 0:
        return "sign", ""
    if abs(recorded_to_true - 1) <= SUSPICIOUS_GAIN:
        return "gain", ""
    units = UNIT_FACTORS[signal.quantity]
    far = {
        (units[taken] != signal.factor, abs(np.log(recorded_to_true * units[true] / units[taken]))): f"{true} taken "
        f"for {taken}"
        for true in units
        for taken in units
        if true != taken and {1.0, signal.factor} & {units[true], units[taken]}
    }
    near = [pair for pair in far if pair[1] <= EXPLAINED_RATIO_DIFFERENCE]
    return ("unit", far[min(near)]) if near else ("size", "")


def cause_and_sentence(
    recorded_to_true: float,
    signal: MeasuredSignal,
    reference_name: str,
    remedies: Mapping[WrongFactor, str] | None = None,
) -> tuple[WrongFactor, str]:
    """The cause of a wrong factor and a sentence on it; ``reference_name`` names the source of the true value.

    remedies : what to do about each, None for those of a channel map.
    """
    kind, unit = probable_mistake(recorded_to_true, signal)
    reads = f"{signal.name} reads {recorded_to_true:.4g} times {reference_name}"
    reading = (
        f"{signal.name} reads {abs(recorded_to_true - 1):.2%} too "
        f"{'much' if recorded_to_true > 1 else 'little'} against {reference_name}"
    )
    texts: dict[WrongFactor, str] = {
        "sign": f"{reads}: its sign is wrong",
        "unit": f"{reads}, as {unit} does",
        "gain": reading,
        "size": f"{reads}, which no usual unit explains",
    }
    in_map: dict[WrongFactor, str] = {
        "sign": f"give sign = {-signal.sign} in the channel map",
        "unit": "correct its unit in the channel map",
        "gain": "check its calibration factor",
        "size": "check its calibration factor and the vehicle file",
    }
    between = "; " if kind == "sign" else ": "
    return kind, f"{texts[kind]}{between}{(remedies or in_map)[kind]}."


def missing_load_sentence(signal_name: str, mean_force: float, static_load: float) -> str:
    """Sentence on a vertical force whose mean (N) is negligible compared with the static load (N): the load must be
    added."""
    return (
        f"{signal_name} reads {mean_force:.4g} N on average, less than it varies: it counts from the static load; "
        f"add {static_load:.5g} N."
    )
