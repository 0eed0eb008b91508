"""The price list of effects as text for a reader, and as JSON."""

from dataclasses import asdict
from typing import Any

import numpy as np

from models.advice.price.effects import EffectPrice, PriceList, QuantityChange

SHOWN_QUANTITY_COUNT = 3
"""Number of changed quantities of an effect that are printed; JSON has all."""
NAME_COLUMN_WIDTH = 26
"""Width of the column of effect names, in characters."""
NEGLIGIBLE_CHANGE = 1e-12
"""Relative change of a quantity up to which it is only rounding."""


def price_list_lines(price_list: PriceList, quantity_names: list[str]) -> list[str]:
    """Text lines of a price list: the cost of the scene, then every effect with its cost and the changes that it
    makes.
    """
    counts = ", ".join(f"{value:,} {name}" for name, value in price_list.counts.items())
    priced_steps_text = (
        "" if price_list.each >= price_list.whole else f", {price_list.each:,} of {price_list.whole:,} steps priced"
    )
    return [
        price_list.title,
        f"  {price_list.engine}, {counts}{priced_steps_text}; {_microseconds_text(price_list.micros)} a step, CPU, "
        "median and its deviation",
        "",
        "  effects of the scene: what each adds to it, and what leaving it out changes",
        *(line for price in price_list.prices if price.there for line in _effect_lines(price, quantity_names)),
        *_absent_effect_lines(price_list, quantity_names),
        "",
        "  changes: rms of the difference, largest of all cases; in ( ) by the quantity's own deviation"
        + ("; +- what chance may add, of so few samples" if _has_statistical_errors(price_list) else ""),
    ]


def _has_statistical_errors(price_list: PriceList) -> bool:
    return any(change.chance for price in price_list.prices for change in price.changes)


def _absent_effect_lines(price_list: PriceList, quantity_names: list[str]) -> list[str]:
    rows = [line for price in price_list.prices if not price.there for line in _effect_lines(price, quantity_names)]
    return ["", "  effects that it could have, at usual values: the same of putting it in", *rows] if rows else []


def _microseconds_text(median_and_deviation: tuple[float, float]) -> str:
    return f"{_number_text(median_and_deviation[0], 3)} +- {_number_text(median_and_deviation[1], 1)} us"


def _number_text(number: float, significant_digits: int) -> str:
    """A number as text with ``significant_digits`` significant digits, without an exponent even if it is large."""
    large = np.isfinite(number) and abs(float(f"{number:.{significant_digits}g}")) >= 10.0**significant_digits
    return f"{float(f'{number:.{significant_digits}g}'):,.0f}" if large else f"{number:.{significant_digits}g}"


def _effect_lines(effect_price: EffectPrice, quantity_names: list[str]) -> list[str]:
    """Text lines on an effect: its cost, the quantities that it changes, and the assumptions that it keeps."""
    name = f"    {effect_price.name:<{NAME_COLUMN_WIDTH}} "
    if effect_price.why:
        return [f"{name}no price: {effect_price.why}"]
    ratio = f"{effect_price.ratio[0]:.3g} times ({effect_price.ratio[1]:.3g} to {effect_price.ratio[2]:.3g})"
    plus = "+" if effect_price.micros[0] >= 0.0 else ""
    cost = f"{name}{plus}{_microseconds_text(effect_price.micros)} a step, {ratio}{_counts_text(effect_price)}"
    further = ", ..." if len(effect_price.gone) > SHOWN_QUANTITY_COUNT else ""
    new = f"; there with it alone: {', '.join(effect_price.gone[:SHOWN_QUANTITY_COUNT])}{further}"
    rows = [f"{_changes_text(effect_price, quantity_names)}{new if effect_price.gone else ''}"]
    rows += [f"keeps an assumption that is broken without it: {says}" for says in effect_price.keeps]
    return [cost, *(f"    {'':<{NAME_COLUMN_WIDTH}} {row}" for row in rows)]


def _counts_text(effect_price: EffectPrice) -> str:
    """Text on the counts (steps, calls, states) that an effect changes."""
    counts_without, counts_with = effect_price.counts
    count_texts = [
        f"{counts_with[name] - counts_without[name]:+,} {name}"
        for name in counts_with
        if counts_with[name] != counts_without[name]
    ]
    return "; " + ", ".join(count_texts) if count_texts else ""


def _changes_text(effect_price: EffectPrice, quantity_names: list[str]) -> str:
    """Text on the changes of the requested quantities, or of those that change most."""
    requested_changes = [change for change in effect_price.changes if change.name in quantity_names]
    shown = (
        requested_changes
        or [change for change in effect_price.changes if change.relative > NEGLIGIBLE_CHANGE][:SHOWN_QUANTITY_COUNT]
    )
    return "changes " + ("; ".join(map(_changed_quantity_text, shown)) or "nothing")


def _changed_quantity_text(quantity_change: QuantityChange) -> str:
    unit = f" {quantity_change.unit}" if quantity_change.unit and quantity_change.unit != "1" else ""
    name = quantity_change.name.partition(" [")[0]
    error_text = f" +- {_number_text(100 * quantity_change.chance, 2)} %" if quantity_change.chance else ""
    share = (
        f"{_number_text(100 * quantity_change.relative, 2)} %{error_text}"
        if np.isfinite(quantity_change.relative)
        else "from nothing"
    )
    return f"{name} by {_number_text(quantity_change.absolute, 3)}{unit} ({share})"


def as_dict(price_list: PriceList) -> dict[str, Any]:
    """The price list as plain values for JSON; values that are not finite become None."""
    plain: dict[str, Any] = _json_value(asdict(price_list))
    return plain


def _json_value(table_value: Any) -> Any:
    if isinstance(table_value, dict):
        return {key: _json_value(inner) for key, inner in table_value.items()}
    if isinstance(table_value, list | tuple):
        return [_json_value(inner) for inner in table_value]
    if isinstance(table_value, float | np.floating):
        return float(table_value) if np.isfinite(table_value) else None
    return table_value
