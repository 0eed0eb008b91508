"""Numbers of a study's summary by descriptive names, and columns of these numbers over many runs."""

import math
from collections.abc import Iterator
from itertools import takewhile
from typing import Any

LONGEST_LIST = 8
"""Longest list whose entries are numbers of their own; of a longer list, largest magnitude and rms are taken."""
SKIPPED_KEYS = ("seconds", "folder", "scene", "table", "failed", "results")
"""Keys of a summary that hold no results of the study: computing times, texts, and names."""
FRAME_KEYS = ("answer", "runs", "rows", "channels")
"""Keys of a summary that are left out of the numbers' names, since they only mark the results."""
Columns = dict[str, list[Any]]
"""For the name of each number, its values at all points of a sweep; None where it is missing."""


def summary_scalars(summary: dict[str, Any]) -> dict[str, float]:
    """Every finite number of a study's summary: keys joined with ", ", and the unit in [ ] at the end if the study
    gives one.

    Lists of tables are named by the texts with which each table begins, if that tells them apart, or else counted.
    What is not finite is left out.
    """
    return {name: value for name, value in _scalars_of("", "", summary) if math.isfinite(value)}


def _scalars_of(quantity_name: str, quantity_unit: str, summary_value: Any) -> Iterator[tuple[str, float]]:
    """Yield name and value of every finite number in an entry of the summary."""
    if isinstance(summary_value, dict):
        quantity_unit = (
            f" [{summary_value['unit']}]"
            if isinstance(summary_value.get("unit"), str) and summary_value["unit"]
            else quantity_unit
        )
        for key, inner in summary_value.items():
            if key not in SKIPPED_KEYS:
                yield from _scalars_of(
                    quantity_name if key in FRAME_KEYS else _joined_name(quantity_name, str(key)), quantity_unit, inner
                )
    elif isinstance(summary_value, list):
        yield from _numbers_of_list(quantity_name, quantity_unit, summary_value)
    elif isinstance(summary_value, int | float) and not isinstance(summary_value, bool):
        yield quantity_name + quantity_unit, float(summary_value) if isinstance(summary_value, float) else summary_value


def _numbers_of_list(quantity_name: str, quantity_unit: str, summary_list: list[Any]) -> Iterator[tuple[str, float]]:
    """Yield name and value of every finite number in a list of the summary."""
    if len(summary_list) > LONGEST_LIST and all(isinstance(value, dict) for value in summary_list):
        columns = {
            key: [record[key] for record in summary_list if key in record]
            for key in summary_list[0]
            if key not in SKIPPED_KEYS
        }
        yield from _scalars_of(
            quantity_name,
            quantity_unit,
            {key: numbers for key, numbers in columns.items() if all(map(_is_number, numbers))},
        )
    elif len(summary_list) > LONGEST_LIST:
        numbers = [float(value) for value in summary_list if _is_number(value)]
        if numbers:
            yield f"{_joined_name(quantity_name, 'largest')}{quantity_unit}", max(map(abs, numbers))
            yield (
                f"{_joined_name(quantity_name, 'rms')}{quantity_unit}",
                math.sqrt(math.fsum(value * value for value in numbers) / len(numbers)),
            )
    else:
        leading = (takewhile(_is_text, value.values()) if isinstance(value, dict) else () for value in summary_list)
        labels = [", ".join(texts) for texts in leading]
        if len(set(labels)) < len(labels) or not all(labels):
            labels = [str(i + 1) for i in range(len(summary_list))]
        for label, value in zip(labels, summary_list, strict=True):
            yield from _scalars_of(_joined_name(quantity_name, label), quantity_unit, value)


def _is_text(summary_value: Any) -> bool:
    return isinstance(summary_value, str)


def _is_number(summary_value: Any) -> bool:
    return (
        isinstance(summary_value, int | float) and not isinstance(summary_value, bool) and math.isfinite(summary_value)
    )


def _joined_name(parent_name: str, summary_key: str) -> str:
    return f"{parent_name}, {summary_key}" if parent_name else summary_key


def present_numbers(number_column: list[Any]) -> list[Any]:
    """Values of a column without missing ones."""
    return [value for value in number_column if value is not None]


def has_several_values(number_column: list[Any]) -> bool:
    """Whether a column has different values."""
    return len(set(present_numbers(number_column))) > 1
