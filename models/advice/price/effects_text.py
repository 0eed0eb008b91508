"""The price list of effects as text for a reader, and as JSON."""

from dataclasses import asdict
from typing import Any

import numpy as np

from models.advice.price.effects import EffectPrice, PriceList, QuantityChange

SHOWN_QUANTITIES = 3
"""Number of changed quantities of an effect that are printed; JSON has all."""
NAME_COLUMN_WIDTH = 26
"""Width of the column of effect names, in characters."""
ROUNDING_CHANGE = 1e-12
"""Relative change of a quantity up to which it is only rounding."""


def price_list_lines(prices: PriceList, quantities: list[str]) -> list[str]:
    """Text lines of a price list: the cost of the scene, then every effect with its cost and the changes that it
    makes.
    """
    counts = ", ".join(f"{value:,} {name}" for name, value in prices.counts.items())
    priced_steps_text = "" if prices.each >= prices.whole else f", {prices.each:,} of {prices.whole:,} steps priced"
    return [
        prices.title,
        f"  {prices.engine}, {counts}{priced_steps_text}; {_microseconds_text(prices.micros)} a step, CPU, "
        "median and its deviation",
        "",
        "  effects of the scene: what each adds to it, and what leaving it out changes",
        *(line for price in prices.prices if price.there for line in _effect_lines(price, quantities)),
        *_absent_effect_lines(prices, quantities),
        "",
        "  changes: rms of the difference, largest of all cases; in ( ) by the quantity's own deviation"
        + ("; +- what chance may add, of so few samples" if _by_chance(prices) else ""),
    ]


def _by_chance(prices: PriceList) -> bool:
    return any(change.chance for price in prices.prices for change in price.changes)


def _absent_effect_lines(prices: PriceList, quantities: list[str]) -> list[str]:
    rows = [line for price in prices.prices if not price.there for line in _effect_lines(price, quantities)]
    return ["", "  effects that it could have, at usual values: the same of putting it in", *rows] if rows else []


def _microseconds_text(median_and_deviation: tuple[float, float]) -> str:
    return f"{_number_text(median_and_deviation[0], 3)} +- {_number_text(median_and_deviation[1], 1)} us"


def _number_text(value: float, digits: int) -> str:
    """A number as text with ``digits`` significant digits, without an exponent even if it is large."""
    large = np.isfinite(value) and abs(float(f"{value:.{digits}g}")) >= 10.0**digits
    return f"{float(f'{value:.{digits}g}'):,.0f}" if large else f"{value:.{digits}g}"


def _effect_lines(price: EffectPrice, quantities: list[str]) -> list[str]:
    """Text lines on an effect: its cost, the quantities that it changes, and the assumptions that it keeps."""
    name = f"    {price.name:<{NAME_COLUMN_WIDTH}} "
    if price.why:
        return [f"{name}no price: {price.why}"]
    ratio = f"{price.ratio[0]:.3g} times ({price.ratio[1]:.3g} to {price.ratio[2]:.3g})"
    plus = "+" if price.micros[0] >= 0.0 else ""
    cost = f"{name}{plus}{_microseconds_text(price.micros)} a step, {ratio}{_counts_text(price)}"
    further = ", ..." if len(price.gone) > SHOWN_QUANTITIES else ""
    new = f"; there with it alone: {', '.join(price.gone[:SHOWN_QUANTITIES])}{further}"
    rows = [f"{_changes_text(price, quantities)}{new if price.gone else ''}"]
    rows += [f"keeps an assumption that is broken without it: {says}" for says in price.keeps]
    return [cost, *(f"    {'':<{NAME_COLUMN_WIDTH}} {row}" for row in rows)]


def _counts_text(price: EffectPrice) -> str:
    """Text on the counts (steps, calls, states) that an effect changes."""
    counts_without, counts_with = price.counts
    count_texts = [
        f"{counts_with[name] - counts_without[name]:+,} {name}"
        for name in counts_with
        if counts_with[name] != counts_without[name]
    ]
    return "; " + ", ".join(count_texts) if count_texts else ""


def _changes_text(price: EffectPrice, quantities: list[str]) -> str:
    """Text on the changes of the requested quantities, or of those that change most."""
    requested_changes = [change for change in price.changes if change.name in quantities]
    shown = (
        requested_changes
        or [change for change in price.changes if change.relative > ROUNDING_CHANGE][:SHOWN_QUANTITIES]
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


def as_dict(prices: PriceList) -> dict[str, Any]:
    """The price list as plain values for JSON; values that are not finite become None."""
    plain: dict[str, Any] = _json_value(asdict(prices))
    return plain


def _json_value(table_value: Any) -> Any:
    if isinstance(table_value, dict):
        return {key: _json_value(inner) for key, inner in table_value.items()}
    if isinstance(table_value, list | tuple):
        return [_json_value(inner) for inner in table_value]
    if isinstance(table_value, float | np.floating):
        return float(table_value) if np.isfinite(table_value) else None
    return table_value
