"""Units in the spellings of measurement systems, converted to SI by pint: strictly, for each quantity."""

import re
from functools import cache
from typing import Any

from models.core.errors import InputError, suggestion_phrase
from models.machine.left_out import show_libraries
from models.measured.signal import UNIT_OF_QUANTITY, Quantity

UNIT_SPELLINGS = {
    "Grad": "degree",
    "Grad/s": "degree/s",
    "deg.": "degree",
    "deg./s": "degree/s",
    "U/min": "rpm",
    "rev/min": "rpm",
    "kp": "kgf",
    "Newton": "N",
    "newton": "N",
    "-": "",
    "strain": "",
    "ustrain": "microstrain",
}
"""Spellings that pint does not know or mistakes for something else (Grad is German for degree, to pint 1e9 rad), with
pint's unit."""
AMBIGUOUS_UNITS = ("grad",)
"""Refused spellings with two meanings: degrees to some, gon to others."""
GRAVITY_UNITS = ("g", "G", "gn", "g_n")
"""Spellings of standard gravity as a unit of acceleration; pint takes g for a gram."""
ANGLE_UNITS = {
    "radian",
    "milliradian",
    "microradian",
    "degree",
    "millidegree",
    "turn",
    "revolutions_per_minute",
    "grade",
    "arcminute",
    "arcsecond",
}
"""Names of angle units, one of which must occur in a unit of an angle; pint does not distinguish turns, percent and
pure numbers."""
UNIT_EXAMPLES: dict[Quantity, tuple[str, ...]] = {
    "force": ("N", "kN", "lbf"),
    "moment": ("N m", "kN m", "lbf ft"),
    "acceleration": ("m/s^2", "g", "mm/s^2"),
    "angular rate": ("rad/s", "deg/s", "rpm"),
    "angle": ("rad", "mrad", "deg"),
    "travel": ("m", "mm", "in"),
    "strain": ("m/m", "um/m", "microstrain", "%"),
}
"""Examples of accepted units of each quantity, for messages."""


def factor_to_si(unit: str, quantity: Quantity, error_file: object, error_place: str) -> float:
    """Factor from a unit to SI: value in SI = value * factor.

    Raises InputError at ``error_file`` and ``error_place`` for a unit that nobody knows or that is of another quantity.
    """
    parsed = _parsed_unit(unit, quantity)
    if parsed is None:
        raise InputError(
            error_file,
            error_place,
            unit,
            f"no such unit is known: write {_units_of_quantity(quantity)}{_intended_unit(unit, quantity)}",
        )
    if not parsed.is_compatible_with(_si_unit(quantity)):
        raise InputError(
            error_file,
            error_place,
            unit,
            f"{_kind_of_quantity(parsed)}, and the channel is mapped as {quantity}: write "
            f"{_units_of_quantity(quantity)}, or map it as what it is{_intended_unit(unit, quantity)}",
        )
    turned = _has_angle(parsed)
    if turned != (quantity in ("angle", "angular rate")):
        what = "is a unit of angle" if turned else "does not say whether of a turn, a degree or a radian"
        raise InputError(
            error_file,
            error_place,
            unit,
            f"{what}, and the channel is mapped as {quantity}: write {_units_of_quantity(quantity)}",
        )
    return float(_unit_registry().Quantity(1.0, parsed).to(_si_unit(quantity)).magnitude)


def factor_between(unit: str, target_unit: str, error_file: object, error_place: str) -> float:
    """Factor from a unit to another one: value in ``target_unit`` = value * factor.

    Raises InputError at ``error_file`` and ``error_place`` where the unit is not known or of another quantity; an angle
    is no pure number.
    """
    goal = _parsed_unit(target_unit, "force")
    accelerates = goal is not None and goal.is_compatible_with(_si_unit("acceleration"))
    given = _parsed_unit(unit, "acceleration" if accelerates else "force")
    if given is None or goal is None or not given.is_compatible_with(goal) or _has_angle(given) != _has_angle(goal):
        told = "no such unit is known" if given is None else "is the unit of another quantity"
        raise InputError(error_file, error_place, unit, f"{told}: the channel is in {target_unit or '-'}")
    return float(_unit_registry().Quantity(1.0, given).to(goal).magnitude)


def _has_angle(pint_unit: Any) -> bool:
    """Whether an angle occurs in a pint unit."""
    return bool(ANGLE_UNITS & set(re.split(r"[^a-z_]+", str(pint_unit))))


def quantities_of_unit(unit: str) -> tuple[Quantity, ...]:
    """Quantities that can have this unit; empty for no unit, which gives no information."""
    kinds = list[Quantity]()
    for kind in UNIT_OF_QUANTITY if unit.strip() else ():
        try:
            factor_to_si(unit, kind, "", "")
            kinds.append(kind)
        except InputError:
            pass
    return tuple(kinds)


@cache
def _unit_registry() -> Any:
    """pint's registry of units, created once."""
    show_libraries("pint")
    import pint

    return pint.UnitRegistry()


def _si_unit(quantity: Quantity) -> Any:
    """SI unit of a quantity as a pint unit."""
    return _unit_registry().parse_units(UNIT_OF_QUANTITY[quantity].replace("-", ""))


def _parsed_unit(unit: str, quantity: Quantity) -> Any:
    """The unit as a pint unit; None if pint does not know it."""
    text = unit.strip().strip("[]").strip()
    if quantity == "acceleration" and text in GRAVITY_UNITS:
        text = "standard_gravity"
    text = re.sub(
        r"\b([kMmcd]|da)?N[.\-·]?m\b", r"\1N m", UNIT_SPELLINGS.get(text, text)
    )  # Nm is a number of metres to pint
    text = re.sub(r"(?<=/)(s|sec)(2|²)$", "s^2", text)
    try:
        return None if text.split("/")[0] in AMBIGUOUS_UNITS else _unit_registry().parse_units(text)
    except Exception:  # pint's parser raises whatever its tokens raise, down to AssertionError
        return None


def _kind_of_quantity(pint_unit: Any) -> str:
    """Phrase on the kind of quantity that a pint unit measures, as an engineer calls it."""
    if "volt" in str(pint_unit) or "ampere" in str(pint_unit):
        return f"is the unit of a raw reading ({pint_unit:~P}), which needs the sensor's calibration in the logger"
    same = [name for name in UNIT_OF_QUANTITY if pint_unit.is_compatible_with(_si_unit(name))]
    if pint_unit.dimensionless:
        return "is a pure number"
    return f"is a unit of {same[0]}" if same else f"is {pint_unit:P}"


def _intended_unit(unit: str, quantity: Quantity) -> str:
    """Phrase that suggests the unit which was probably meant; empty if none is similar."""
    return suggestion_phrase(unit, UNIT_EXAMPLES[quantity])


def _units_of_quantity(quantity: Quantity) -> str:
    """Examples of accepted units of a quantity, as text."""
    *others, last = UNIT_EXAMPLES[quantity]
    return f"{', '.join(others)} or {last}"
