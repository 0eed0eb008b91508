"""Model files of Adams/Solver (.adm): statements with numbers, keys and values, as far as single bodies on joints go.

A statement is ``NAME/number, key = value, ...`` and goes on in lines that begin with a comma; ``!`` begins a comment.
What draws, prints or steers the solver is passed over. Whatever else is not supported is refused by name and line.
"""

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from models.core.errors import InputError

IGNORED_STATEMENTS = ("ADAMS", "GRAPHICS", "REQUEST", "OUTPUT", "RESULTS", "VARIABLE", "END", "LIST", "INTEGRATOR")
"""Statements without influence on the motion. A force that reads a VARIABLE is refused where its expression names
it."""
KEYS_OF_STATEMENT = {
    "UNITS": ("FORCE", "MASS", "LENGTH", "TIME"),
    "PART": ("GROUND", "MASS", "CM", "IP", "QG", "REULER", "VX", "VY", "VZ", "WX", "WY", "WZ"),
    "MARKER": ("PART", "QP", "REULER"),
    "JOINT": ("REVOLUTE", "TRANSLATIONAL", "CYLINDRICAL", "SPHERICAL", "HOOKE", "UNIVERSAL", "I", "J"),
    "GCON": ("I", "FUNCTION"),
    "SFORCE": ("TRANSLATIONAL", "ROTATIONAL", "I", "J", "FUNCTION"),
    "SPRINGDAMPER": ("TRANSLATION", "ROTATION", "I", "J", "K", "C", "LENGTH", "FORCE", "KT", "CT", "ANGLE", "TORQUE"),
    "ACCGRAV": ("IGRAV", "JGRAV", "KGRAV"),
}
"""Supported statements, and the keys and flags that each may have."""
SI_UNITS = {"FORCE": "NEWTON", "MASS": "KILOGRAM", "LENGTH": "METER", "TIME": "SECOND"}
_STATEMENT_PATTERN = re.compile(r"\s*([A-Za-z_]+)\s*/\s*(\d*)\s*(?:,|$|\b)(.*)", re.DOTALL)
_KEY_PATTERN = re.compile(r"\s*([A-Za-z_]\w*)\s*=\s*(.*)", re.DOTALL)


@dataclass(frozen=True)
class Statement:
    """One statement of a model file: file name, first line, name, number (0 if it has none), and values by key. A flag
    is a key without values."""

    file: str
    line: int
    name: str
    number: int
    values: dict[str, list[str]]

    def refuse(self, key_text: str, wrong_value: object, allowed_text: str) -> InputError:
        """Returns an InputError that names file, line and statement, the wrong value and what is allowed."""
        return InputError(
            self.file, f"line {self.line}: {self.name}/{self.number}{key_text}", wrong_value, allowed_text
        )

    def has(self, statement_key: str) -> bool:
        """Whether the statement has this key or flag."""
        return statement_key in self.values

    def reference(self, statement_key: str) -> int:
        """Number of the marker or part that a key refers to. Raises InputError where it is missing."""
        text = self.values.get(statement_key, [""])[0]
        if not text.isdigit():
            raise self.refuse(f", {statement_key}", text or None, "must be the number of a statement")
        return int(text)

    def numbers(self, statement_key: str, default_values: tuple[float, ...]) -> np.ndarray:
        """Numerical values of a key, angles in rad. Values that the file omits are taken from the default, whose length
        is the number of values."""
        values_given = [self._number(statement_key, text) for text in self.values.get(statement_key, [])]
        if len(values_given) > len(default_values):
            raise self.refuse(
                f", {statement_key}", len(values_given), f"values found, at most {len(default_values)} have a meaning"
            )
        return np.array([*values_given, *default_values[len(values_given) :]])

    def _number(self, statement_key: str, number_text: str) -> float:
        degrees = number_text.upper().endswith("D") and not number_text.upper().endswith("ED")
        try:
            value = float(number_text[:-1]) if degrees else float(number_text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise self.refuse(f", {statement_key}", number_text, "must be a finite number, or an angle as 90D")
        return math.radians(value) if degrees else value

    def text(self, statement_key: str) -> str:
        """Text of the expression that a key has, its lines joined."""
        return " ".join(self.values.get(statement_key, []))


def read_statements(model_path: str | Path) -> list[Statement]:
    """All statements of an Adams model file that affect the motion. Raises InputError with name and line for
    unsupported statements."""
    try:
        lines = Path(model_path).read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise InputError(model_path, "", None, f"the file cannot be read: {error.strerror}") from None
    statements = [
        _parsed_statement(str(model_path), number, text)
        for number, text in _statement_texts(lines)
        if not _is_skipped(text)
    ]
    for statement in (units_statement for units_statement in statements if units_statement.name == "UNITS"):
        for key, (value, *_) in statement.values.items():
            if value.upper() != SI_UNITS[key]:
                raise statement.refuse(f", {key}", value, f"is not supported: only {SI_UNITS[key]}")
    return statements


def _statement_texts(file_lines: list[str]) -> list[tuple[int, str]]:
    """For every statement of a file: number of its first line, and its text with continuation lines joined."""
    joined: list[tuple[int, str]] = []
    for number, line in enumerate(file_lines, 1):
        text = line.partition("!")[0].strip()
        if text.startswith(",") and joined:
            joined[-1] = joined[-1][0], f"{joined[-1][1]} {text}"
        elif text:
            joined.append((number, text))
    return joined


def _is_skipped(statement_text: str) -> bool:
    return re.split(r"[\s/,]", statement_text.upper(), maxsplit=1)[0] in IGNORED_STATEMENTS


def _parsed_statement(file_name: str, line_number: int, statement_text: str) -> Statement:
    head = _STATEMENT_PATTERN.fullmatch(statement_text)
    name = head.group(1).upper() if head else ""
    if head is None or name not in KEYS_OF_STATEMENT:
        raise InputError(
            file_name,
            f"line {line_number}",
            statement_text[:40],
            f"is not supported; read are {', '.join(KEYS_OF_STATEMENT)}",
        )
    values: dict[str, list[str]] = {}
    key = ""
    for assignment in _between_commas(head.group(3)):
        named = _KEY_PATTERN.fullmatch(assignment)
        if named:
            key = named.group(1).upper()
            values[key] = [named.group(2).strip()]
        elif assignment.strip().upper() in KEYS_OF_STATEMENT[name]:
            values[assignment.strip().upper()] = []
        elif key:
            values[key].append(assignment.strip())
        elif assignment.strip():
            values[assignment.strip().upper()] = []
    statement = Statement(file_name, line_number, name, int(head.group(2) or 0), values)
    for unknown in (each for each in values if each not in KEYS_OF_STATEMENT[name]):
        raise statement.refuse(f", {unknown}", None, f"is not supported; read are {', '.join(KEYS_OF_STATEMENT[name])}")
    return statement


def _between_commas(statement_text: str) -> list[str]:
    """Parts of a text between commas outside of brackets."""
    parts, depth = [""], 0
    for sign in statement_text:
        depth += (sign == "(") - (sign == ")")
        if sign == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += sign
    return [piece for piece in parts if piece.strip()]
