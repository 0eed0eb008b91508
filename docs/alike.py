"""Comparison of two printed outputs: seconds and versions may differ, and numbers by their last digit.

- white space counts as one space, as the widths of columns depend on the numbers in them
- a number before a unit of time (s, ms, us, min) stands for any number: seconds are those of the machine
- a version, such as 1.13.6, a date and a commit stand for any other
- a number with digits after its point may differ by one in the last digit printed
- numbers below 1e-9 are rounding, and stand for any other such number
- everything else, whole numbers included, is the same
"""

import re
from decimal import Decimal

TIME_PATTERN = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?:e[+-]?\d+)?(?= ?(?:s|ms|us|min)\b(?!/))")
DATE_PATTERN = r"\b\d{4}-\d\d-\d\d(?:[T ]\d\d:\d\d(?::\d\d)?)?"
COMMIT_PATTERN = r"\b(?=[0-9]*[a-f])(?=[a-f]*[0-9])[0-9a-f]{7,40}\b"
VERSION_PATTERN = re.compile(rf"\b\d+(?:\.\d+){{2,}}\w*|{DATE_PATTERN}|{COMMIT_PATTERN}")
NUMBER_PATTERN = re.compile(r"(?<![\w.])[+-]?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?!\w)")
ROUNDING = Decimal("1e-9")


def alike(shown_output: str, printed_output: str) -> bool:
    """Whether a printed output agrees with the output that a page shows, by the rules of this module."""
    (words, numbers), (others, values) = _text_and_numbers(shown_output), _text_and_numbers(printed_output)
    return words == others and all(map(_agree, numbers, values))


def _text_and_numbers(text: str) -> tuple[str, list[str]]:
    """The text with "#" in place of every number, and the numbers as text; times and versions are replaced by words."""
    text = TIME_PATTERN.sub("TIME", VERSION_PATTERN.sub("VERSION", " ".join(text.split())))
    return NUMBER_PATTERN.sub("#", text), NUMBER_PATTERN.findall(text)


def _agree(shown_number: str, printed_number: str) -> bool:
    """Whether the texts of two numbers agree to within one in the last digit that both have; whole numbers must be
    equal."""
    if shown_number == printed_number:
        return True
    first, second = Decimal(shown_number), Decimal(printed_number)
    if max(abs(first), abs(second)) < ROUNDING:
        return True
    if not {".", "e"} & {*shown_number, *printed_number}:
        return False
    digit = Decimal(1).scaleb(max(int(number.as_tuple().exponent) for number in (first, second)))
    return abs(first - second) <= digit
