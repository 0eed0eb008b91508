"""Report of a library function: text for readers, and values for programs."""

from dataclasses import dataclass
from html import escape
from typing import Any


@dataclass(frozen=True, repr=False)
class Report:
    """Report that ``compare``, ``price``, ``choose``, ``export`` and ``validate`` return: lines to print, values,
    detail.

    lines : as the command line prints them; values : plain values, those of ``--json``; detail : in the types of the
    module that computed it.
    """

    lines: tuple[str, ...]
    values: dict[str, Any]
    detail: Any = None

    def __repr__(self) -> str:
        return "\n".join(self.lines)

    def _repr_html_(self) -> str:
        return f"<pre>{escape(repr(self))}</pre>"
