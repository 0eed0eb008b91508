"""Format of numbers and text in the report: four significant digits, powers of ten as ``e-16``, margins in per cent."""

import math
import re
from collections.abc import Sequence
from itertools import zip_longest
from typing import Any

from markupsafe import Markup, escape

PLAIN_MAGNITUDES = (1e-3, 1e5)
"""Range of magnitudes that are written without a power of ten."""


def number_markup(table_value: Any, digit_count: int = 4) -> Markup:
    """Text of a number with ``digit_count`` significant digits, such as ``0.0123`` or ``8.9e-16``; text stays as it is,
    None becomes a dash."""
    if table_value is None or table_value == "":
        return Markup("–")
    if isinstance(table_value, bool) or not isinstance(table_value, int | float):
        return escape(table_value)
    if not math.isfinite(table_value):
        return (
            Markup("not a number")
            if math.isnan(table_value)
            else Markup("infinite" if table_value > 0 else "-infinite")
        )
    if isinstance(table_value, int) and abs(table_value) < 10**7:
        return Markup(table_value)
    if table_value == 0 or PLAIN_MAGNITUDES[0] <= abs(table_value) < PLAIN_MAGNITUDES[1]:
        return Markup(_significant(table_value, digit_count))
    return Markup(_scientific_text(table_value, digit_count))


def error_markup(table_value: Any) -> Markup:
    """Text of an error or tolerance: four significant digits in fixed notation, two with a power of ten."""
    plain = isinstance(table_value, int | float) and PLAIN_MAGNITUDES[0] <= abs(table_value) < PLAIN_MAGNITUDES[1]
    return number_markup(table_value, 4 if plain else 2)


def _scientific_text(number: float, digit_count: int) -> str:
    """Text of a number in scientific notation such as ``8.9e-16``, without leading zeros in the exponent."""
    mantissa, power = f"{number:.{digit_count - 1}e}".split("e")
    return f"{mantissa.rstrip('0').rstrip('.')}e{int(power)}"


def _significant(number: float, digit_count: int) -> str:
    """Text of a number in fixed notation with ``digit_count`` significant digits, without trailing zeros."""
    decimals = max(0, digit_count - 1 - math.floor(math.log10(abs(number)))) if number else 0
    text = f"{number:.{decimals}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def margin_of_row(report_row: dict[str, Any]) -> float | None:
    """Ratio of |value - expected| of a row to its tolerance; None if a number is missing or the tolerance is zero."""
    value, expected, tolerance = report_row["value"], report_row["expected"], report_row["tolerance"]
    numeric = all(isinstance(x, int | float) and not isinstance(x, bool) for x in (value, expected, tolerance))
    if not numeric or tolerance <= 0:
        return None
    return abs(value - expected) / tolerance


def share_markup(tolerance_share: float | None) -> Markup:
    """Text of an error relative to its tolerance: in per cent, or as a multiple if it is above ten."""
    if tolerance_share is None or math.isnan(tolerance_share):
        return Markup("–")
    if tolerance_share > 10:
        return number_markup(tolerance_share, 2) + Markup(" times")
    if 0 < tolerance_share < 1e-4:
        return Markup("&lt; 0.01 %")
    return Markup(f"{_significant(100 * tolerance_share, 2) if tolerance_share else '0'} %")


def duration(seconds: float) -> str:
    """Text of a duration (s): in seconds, or in minutes from two minutes on."""
    whole = round(seconds)
    return f"{seconds:.1f} s" if seconds < 10 else f"{whole} s" if whole < 120 else f"{round(whole / 60)} min"


POWER_OF_TEN = re.compile(r"(?<![\w.])(-?\d+(?:\.\d+)?)e([+-]\d+)(?![\w.])")
NUMERIC_PATTERN = re.compile(
    r"[-−+±<>≤≥~ ]*\d[\d,]*(\.\d+)?(e[+-]?\d+)?\*?( ?(%|s|ms|x))?( (±|\+/-) [\d.]+)?"
    r"|[-–]?|never|refused|not met"
)
"""Pattern of a table cell that holds a number, or a word for a missing number."""


def powers_markup(table_cell: Any) -> Markup:
    """Text in which numbers such as 2e-06 are written ``2e-6``, and numbers up to a few thousand without a power of
    ten."""

    def written(number_match: re.Match[str]) -> str:
        power = int(number_match[2])
        return f"{float(number_match[0]):g}" if power in range(4) else f"{number_match[1]}e{power}"

    return Markup(POWER_OF_TEN.sub(written, str(escape(table_cell))))


def numeric_columns(table_rows: Sequence[Sequence[Any]], column_count: int) -> list[bool]:
    """For each column of a table, at least ``column_count``, whether it holds numbers and is aligned right; False for
    the first column."""
    columns = [
        [str(cell).strip() for cell in column] for column in zip_longest([""] * column_count, *table_rows, fillvalue="")
    ]
    right = [
        all(map(NUMERIC_PATTERN.fullmatch, column)) and any(cell[-1:].isdigit() for cell in column)
        for column in columns
    ]
    return [False, *right[1:]]


def docstring_markup(docstring: str) -> Markup:
    """HTML of a docstring, with its **strong** and ``code`` marks."""
    strong = re.sub(r"\*\*(.+?)\*\*", r"<b>\1</b>", str(escape(docstring)))
    return Markup(re.sub(r"``(.+?)``", r"<code>\1</code>", strong))
