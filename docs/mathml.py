"""Formulas of the site as MathML, which browsers draw themselves: a page needs no script and no network for them.

A hook of MkDocs, which calls ``on_page_content`` for every page; the extension arithmatex has marked the formulas.
"""

import re
from html import unescape
from typing import Any

MARKED_FORMULA = re.compile(
    r'<(?P<tag>span|div) class="arithmatex">\\[(\[](?P<formula>.*?)\\[)\]]</(?P=tag)>', re.DOTALL
)
"""A formula in the words of LaTeX: within a line (span) or as a line of its own (div)."""


def on_page_content(html: str, page: Any = None, **unused: Any) -> str:
    """A page in which all marked formulas are MathML. Raises ValueError for one that cannot be read, with the page."""
    from latex2mathml.converter import convert

    def drawn(marked: re.Match[str]) -> str:
        formula = unescape(marked["formula"]).strip()
        try:
            math = convert(formula, display="inline" if marked["tag"] == "span" else "block")
        except Exception as error:  # the library has one for each kind of mistake
            raise ValueError(f"{page}: the formula {formula!r} cannot be read: {error!r}") from error
        if "\\" in math:
            raise ValueError(f"{page}: the formula {formula!r} has a command that is not known")
        return math

    return MARKED_FORMULA.sub(drawn, html)
