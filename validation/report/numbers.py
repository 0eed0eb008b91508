"""How the report writes numbers and text: four significant digits, engineering notation, margins as shares."""

import math
import re
from collections.abc import Sequence
from itertools import zip_longest
from typing import Any

from markupsafe import Markup, escape

PLAIN = (1e-3, 1e5)
"""Magnitudes that are written without a power of ten."""


def number(value: Any, digits: int = 4) -> Markup:
    """A number with ``digits`` significant ones, powers of ten in threes; text stays text, None a dash."""
    if value is None or value == "":
        return Markup("–")
    if isinstance(value, bool) or not isinstance(value, int | float):
        return escape(value)
    if not math.isfinite(value):
        return Markup("not a number") if math.isnan(value) else Markup("infinite" if value > 0 else "-infinite")
    if value == 0 or (isinstance(value, int) and abs(value) < 10**7):
        return Markup(_minus(f"{value:d}" if isinstance(value, int) else "0"))
    if PLAIN[0] <= abs(value) < PLAIN[1]:
        return Markup(_minus(_significant(value, digits)))
    power = _power(value, digits)
    return Markup(_scientific(_significant(value / 10.0**power, digits), power))


def _scientific(mantissa: str, power: int) -> str:
    return f"{_minus(mantissa)}&thinsp;·&thinsp;10<sup>{_minus(str(power))}</sup>"


def _power(value: float, digits: int) -> int:
    """The multiple of three below the magnitude of the rounded value."""
    exponent = int(f"{value:.{digits - 1}e}".split("e")[1])
    return 3 * (exponent // 3)


def _significant(value: float, digits: int) -> str:
    """Fixed notation with so many significant digits, without trailing zeros."""
    decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    text = f"{value:.{decimals}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def _minus(text: str) -> str:
    return text.replace("-", "−")


def margin(row: dict[str, Any]) -> float | None:
    """|value - expected| over tolerance; None where a row has no tolerance or it is exactly zero."""
    value, expected, tolerance = row["value"], row["expected"], row["tolerance"]
    numeric = all(isinstance(x, int | float) and not isinstance(x, bool) for x in (value, expected, tolerance))
    if not numeric or tolerance <= 0:
        return None
    return abs(value - expected) / tolerance


def share(value: float | None) -> Markup:
    """A margin in per cent of its tolerance, or how many times over it is."""
    if value is None or math.isnan(value):
        return Markup("–")
    if value > 10:
        return number(value, 2) + Markup(" times")
    if 0 < value < 1e-4:
        return Markup("&lt; 0.01 %")
    return Markup(f"{_significant(100 * value, 2) if value else '0'} %")


def duration(seconds: float) -> str:
    """Seconds, or minutes from two on."""
    whole = round(seconds)
    return f"{seconds:.1f} s" if seconds < 10 else f"{whole} s" if whole < 120 else f"{round(whole / 60)} min"


POWER = re.compile(r"(?<![\w.])(-?\d+(?:\.\d+)?)e([+-]\d+)(?![\w.])")
NUMERIC = re.compile(
    r"[-−+±<>≤≥~ ]*\d[\d,]*(\.\d+)?(e[+-]?\d+)?\*?( ?(%|s|ms|x))?( (±|\+/-) [\d.]+)?"
    r"|[-–]?|never|refused|not met"
)
"""A cell of a table that reads as a number, or as the absence of one."""


def powers(cell: Any) -> Markup:
    """Text with numbers such as 2e-06 written with a power of ten, which does not break across lines."""

    def written(found: re.Match[str]) -> str:
        if int(found[2]) in range(4):
            return _minus(f"{float(found[0]):g}")
        return f'<span class="nowrap">{_scientific(found[1], int(found[2]))}</span>'

    return Markup(POWER.sub(written, str(escape(cell))))


def numeric_columns(rows: Sequence[Sequence[Any]], count: int) -> list[bool]:
    """Which columns of a table, ``count`` or more, hold numbers and go to the right; the first one never does."""
    columns = [[str(cell).strip() for cell in column] for column in zip_longest([""] * count, *rows, fillvalue="")]
    right = [all(map(NUMERIC.fullmatch, column)) and any(cell[-1:].isdigit() for cell in column) for column in columns]
    return [False, *right[1:]]


def marked(text: str) -> Markup:
    """Text of a docstring: **strong** and ``code``."""
    strong = re.sub(r"\*\*(.+?)\*\*", r"<b>\1</b>", str(escape(text)))
    return Markup(re.sub(r"``(.+?)``", r"<code>\1</code>", strong))
